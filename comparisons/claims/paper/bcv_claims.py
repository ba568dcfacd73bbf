"""
Claims about BCV (C33): local minima, and a long way close to risk, with nothing but the length in its objective.

What flies here is a planner in the style of the original, whose text is not public: a verdict is one on this planner.
"""

from collections.abc import Mapping, Sequence
from functools import cache

from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    MAIN,
    RADII,
    Contrast,
    RateContrast,
    contrast_table,
    judged_part,
    rate_contrast,
    rate_table,
    sizes,
    span,
    together,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.paper.flights import K, fly_alone, fly_from, measures
from cgla_graph.comparisons.claims.paper.planner_claims import (
    AVERSE,
    BCV,
    EITHER,
    LENGTH_ONLY,
    NEAR,
    STYLE,
    flown_by,
    flown_cells,
    near_name,
    solver_of,
    versus_cgla,
)
from cgla_graph.comparisons.statistics.intervals import success_interval
from cgla_graph.mission.records import MissionStatus, UavFlight
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario

#: Threats of maps that are crowded.
CROWD = 30
#: Verdicts are on these two of the levels above which a way is close to risk.
RIM, CLOSE = NEAR[0], NEAR[2]
#: Shipped maps with local minima: a pocket, and a crowd, in which BCV-style gets stuck at every radius.
POCKET, STUCK_ON = "trap", "fifty-threats"


@experiment("crowded-maps", quick=5, share=0.5)
def crowded_maps(seed: int) -> list[Record]:
    """Fly CGLA and BCV-style with limited sight where threats are three times as many."""
    field = random_scenario(seed, threats=CROWD, k=K).problem.field
    return [
        {"mode": "online", **flown_by(name, cell), **measures(fly_alone(field, k=K, solver=solver_of(name), **cell))}
        for name, cell in flown_cells(("cgla", *BCV))
    ]


@claim(
    33,
    "Section 5.1",
    "BCV suffers from local minima, and flies a long way close to risk.",
    "where cgla arrives, bcv-style gets stuck: on a shipped map, and more often (McNemar) on random maps of 10 and of "
    "30 threats; where both arrive it flies farther where F > 0.1, and where F > 0.02 (Wilcoxon); with a risk "
    "aversion of 0, which leaves only the length in its objective, and of 5; in twelve cells",
    Kind.STATISTIC,
    experiments=("planners", "crowded-maps"),
    figures=("Fig. 5", "Fig. A2", "Table 1"),
)
def _check_c33(evidence: Evidence) -> Finding:
    samples, crowded = evidence.samples["planners"], evidence.samples["crowded-maps"]
    stuck = {name: stuck_more_often(samples, name) for name in BCV}
    crowd = {name: stuck_more_often(crowded, name) for name in BCV}
    near = {(name, level): versus_cgla(samples, name, near_name(level), ratio=False) for name in BCV for level in NEAR}
    minima = "stuck in local minima"
    return Finding(
        (
            _trapped(minima),
            *(_stuck_part(minima, stuck[name], f"on random maps of 10 threats {BCV[name]}") for name in BCV),
            _stuck_part(minima, together(crowd), f"on random maps of {CROWD} threats {EITHER}"),
            *(_near_part(CLOSE, near[name, CLOSE], BCV[name]) for name in BCV),
            _near_part(RIM, together({name: near[name, RIM] for name in BCV}), EITHER),
        ),
        f"With nothing but the length in its objective, BCV-style flies {sizes(near[LENGTH_ONLY, CLOSE])} map units "
        f"more than CGLA where F > {CLOSE:g}; with a risk aversion of 5, {sizes(near[AVERSE, CLOSE])} more, and where "
        f"F > {RIM:g}, {sizes(near[AVERSE, RIM])} more. It gets stuck on the map `{STUCK_ON}`, and on random maps of "
        f"10 threats on {_rarely(stuck)}, of {CROWD} threats on {_rarely(crowd)}.",
        tables=(
            _trap_table(),
            rate_table("Stuck, K = 10, limited sight, random maps of 10 threats", together(stuck)),
            rate_table(f"Stuck, K = 10, limited sight, random maps of {CROWD} threats", together(crowd)),
            *(
                contrast_table(
                    f"Length flown where {near_name(level)}, map units (difference)",
                    together({name: near[name, level] for name in BCV}),
                )
                for level in NEAR
            ),
        ),
        notes=(
            STYLE,
            (
                "The paper says of BCV that its objective has nothing but the length, as bcv-style's with an aversion "
                "of 0: then only its avoiding of what is near keeps it off threats. The verdict depends on that and "
                f"on what counts as close: F is {RIM:g} at 2.8 spreads from a threat's centre, {CLOSE:g} at 2.1."
            ),
            (
                "The way that is close to risk is not long as a whole: bcv-style's is shorter than CGLA's (C32). "
                "In Fig. 5 the paper's is longer."
            ),
            (
                "Stuck is who comes no nearer to the goal in 200 ticks, and so flies in circles; with ten times that "
                f"patience it is the same on `{STUCK_ON}`. `{POCKET}` was drawn as a local minimum."
            ),
        ),
    )


def stuck_more_often(samples: Samples, planner: str) -> list[RateContrast]:
    """Compare how often flights do not arrive: the planner's are claimed to do so more often than CGLA's."""
    return [
        rate_contrast(
            f"{planner} is stuck > cgla is",
            cell,
            *(1.0 - samples.column("arrived", mode="online", **flown_by(name, cell)) for name in (planner, "cgla")),
        )
        for cell in CELLS
    ]


def _near_part(level: float, contrasts: Sequence[Contrast], condition: str) -> Part:
    effect = f"{sizes(contrasts)} map units more than CGLA"
    return judged_part(f"a long way where {near_name(level)}", contrasts, effect=effect, condition=condition)


def _stuck_part(statement: str, tests: Sequence[RateContrast], condition: str) -> Part:
    """Say how often flights get stuck, beside CGLA's."""
    ends = [success_interval(round(one.first * one.n), one.n) for one in tests if one.n]
    bounds = f", 95 % within {min(end.low for end in ends):.1%} to {max(end.high for end in ends):.1%}" if ends else ""
    first, second = (span([getattr(one, which) for one in tests], ".1%") for which in ("first", "second"))
    return judged_part(statement, tests, effect=f"{first}{bounds}, CGLA {second}", condition=condition)


def _rarely(stuck: Mapping[str, Sequence[RateContrast]]) -> str:
    """Say how often flights get stuck."""
    return " and ".join(f"{span([one.first for one in tests], '.1%')} {BCV[name]}" for name, tests in stuck.items())


@cache
def trapped_flights() -> Mapping[tuple[str, str, float], UavFlight]:
    """Fly CGLA and BCV-style with limited sight on the two shipped maps, by map, planner and detection radius."""
    flights = {}
    for name in (POCKET, STUCK_ON):
        problem = load_scenario(name).problem
        for planner in ("cgla", *BCV):
            for radius in RADII:
                settings = {**MAIN, "radius": radius} if planner == "cgla" else {"radius": radius}
                flights[name, planner, radius] = fly_from(
                    {"a": problem.start}, problem.field, k=K, solver=solver_of(planner), goal=problem.goal, **settings
                ).uavs["a"]
    return flights


def _trapped(statement: str) -> Part:
    """
    Say that BCV-style gets stuck on a shipped map on which CGLA arrives.

    Raises
    ------
    AssertionError
        If it does not.
    """
    flights = trapped_flights()
    for (name, planner, radius), flight in flights.items():
        if planner == "cgla" or name == STUCK_ON:
            expected = MissionStatus.ARRIVED if planner == "cgla" else MissionStatus.STUCK
            require(flight.status is expected, f"{planner} on {name}, OR = {radius:g}: {flight.status.value}")
    pocket = [flight.status for (name, planner, _), flight in flights.items() if (name, planner) == (POCKET, AVERSE)]
    through = [flights[POCKET, LENGTH_ONLY, radius].status for radius in RADII]
    return Part(
        statement,
        Verdict.PROVED,
        "by flights: with either aversion and all three radii BCV-style gets stuck there, and CGLA arrives; on "
        f"`{POCKET}`, {pocket.count(MissionStatus.STUCK)} of {len(RADII)} get stuck with aversion 5 and "
        f"{through.count(MissionStatus.STUCK)} with aversion 0, the others fly across the threats",
        condition=f"on the map `{STUCK_ON}`",
    )


def _trap_table() -> Table:
    rows = [
        (name, planner, radius, flight.status.label, flight.ended - flight.departed, flight.length, flight.risk_sum)
        for (name, planner, radius), flight in trapped_flights().items()
    ]
    columns = ("map", "planner", "OR", "flight", "ticks", "length", "risk sum")
    return Table("Shipped maps, K = 10, limited sight", columns, rows)

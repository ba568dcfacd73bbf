"""
Flights of other planners, and claims about them (C44, C52): FBCRI, CPVS, Q-Learning.

What flies here are planners in the style of the originals, whose texts or programs are not public: a verdict is one on
these planners, not on the originals.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, Verdict, claim
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    RADII,
    RULE,
    Case,
    Contrast,
    contrast,
    contrast_table,
    finite,
    judged_part,
    shown,
    span,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import proportion
from cgla_graph.comparisons.claims.paper.direction_claims import CGLA
from cgla_graph.comparisons.claims.paper.flights import (
    STEP,
    K,
    fly_alone,
    fly_from,
    measures,
    plan_measures,
    positions_at_steps,
)
from cgla_graph.comparisons.claims.paper.introduction_claims import EVOLUTION
from cgla_graph.comparisons.claims.paper.learners import LEARNERS, UNDISCOUNTED
from cgla_graph.comparisons.claims.paper.printed_values import STARTS, value
from cgla_graph.mission.records import MissionStatus, UavFlight
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.random_map import CLEAR, random_scenario
from cgla_graph.solvers import get

#: What stands for the readings of planners that have none: they weigh no segments by a raster, and those that go step
#: by step are asked on every tick anyway.
OWN = "own"
#: BCV as the paper has it, with nothing but the length in its objective, and the default of the toolkit; by what they
#: are called, the condition of a verdict on each.
LENGTH_ONLY, AVERSE = "bcv-style, aversion 0", "bcv-style"
BCV: Mapping[str, str] = {LENGTH_ONLY: "with aversion 0 (length only)", AVERSE: "with aversion 5"}
EITHER = "with either aversion"
#: Those of the paper's comparison and introduction that take well below a second, and reactive ones beside them.
PLANNERS = (
    *BCV,
    "a2d-style",
    "q-learning",
    "fbcri-style",
    "cpvs-style",
    "voronoi",
    "visibility-graph",
    "potential-field",
    "bendy-ruler",
)
#: What flies in company (Fig. 10, Tables 4 and 5).
COMPANY = ("cgla", "fbcri-style", "cpvs-style")
#: Close to risk is where F is above one of these.
NEAR = (0.02, 0.05, 0.1, 0.2)
STYLE = (
    "Planners called -style are in the style of the originals, which are not public; verdicts are on these planners."
)


def solver_of(planner: str) -> Solver:
    """
    Return what plans, by what it is called here.

    Examples
    --------
    >>> solver_of(LENGTH_ONLY).traits.name, solver_of("cgla").traits.name
    ('bcv-style', 'cgla')
    """
    return get(AVERSE, risk_aversion=0.0) if planner == LENGTH_ONLY else get(planner)


@experiment("planners", quick=10)
def planners(seed: int) -> list[Record]:
    """Let every planner plan on a random map with all of it known, and fly it with limited sight."""
    problem = random_scenario(seed, k=K).problem
    offline = [{"planner": name, **plan_measures(problem, solver_of(name))} for name in ("cgla", *PLANNERS, EVOLUTION)]
    online = [
        {**flown_by(name, cell), **measures(flight), **lengths_near(problem.field, flight)}
        for name, cell in flown_cells(("cgla", *PLANNERS))
        for flight in [fly_alone(problem.field, k=K, solver=solver_of(name), **cell)]
    ]
    return [{"mode": "offline", **one} for one in offline] + [{"mode": "online", **one} for one in online]


def flown_cells(names: Sequence[str]) -> list[tuple[str, Case]]:
    """List who flies in which cell: CGLA in all, others with each radius."""
    return [
        (name, cell)
        for name in names
        for cell in (CELLS if name == "cgla" else [{"radius": radius} for radius in RADII])
    ]


def lengths_near(field: RiskField, flight: UavFlight) -> dict[str, float | None]:
    """
    Return the length flown where ``F`` is above each of `NEAR`, map units, to a twentieth of a step.

    Of a flight that did not arrive there is none (see `measures`).
    """
    if flight.status is not MissionStatus.ARRIVED:
        return {near_name(level): None for level in NEAR}
    spots = positions_at_steps(np.asarray(flight.path), STEP / 20.0)
    lengths = np.hypot(*np.diff(spots, axis=0).T)
    risk = field.density(0.5 * (spots[:-1] + spots[1:]))
    return {near_name(level): float(lengths[risk > level].sum()) for level in NEAR}


def near_name(level: float) -> str:
    """
    Say where it is close to risk, as measurements are called.

    Examples
    --------
    >>> near_name(0.1)
    'F > 0.1'
    """
    return f"F > {level:g}"


def flown_by(planner: str, cell: Case) -> Case:
    """Return the case of a planner's flights in a cell."""
    return {"planner": planner, **cell, **({} if planner == "cgla" else {"integral": OWN, "replan": OWN})}


def versus_cgla(samples: Samples, planner: str, measure: str, *, ratio: bool = True, uav: str = "") -> list[Contrast]:
    """
    Compare a planner's flights with CGLA's in all cells: the planner's value is claimed to be greater.

    Parameters
    ----------
    samples
        Of the experiment `planners`, or of `three_uavs`.
    planner, measure
        Names.
    ratio
        Compare ratios, else differences.
    uav
        Which one of `three_uavs`.

    Returns
    -------
    contrasts
        One a cell, over the maps on which both arrive.
    """
    words = f"{measure.replace('_', ' ')}: {planner} > cgla"
    shared = {"uav": uav} if uav else {"mode": "online"}
    return [
        contrast(
            samples,
            f"UAV {uav}, {words}" if uav else words,
            measure,
            flown_by(planner, cell),
            flown_by("cgla", cell),
            shared,
            ratio=ratio,
            name=cell,
        )
        for cell in CELLS
    ]


def relative(contrasts: Sequence[Contrast]) -> str:
    """
    Say how large CGLA's value is, relative to the other planner's, which is claimed to be greater.

    Examples
    --------
    >>> records = [{"map": i, "planner": name, "risk": risk} for i in range(8) for name, risk in (("a", 4), ("b", 2))]
    >>> relative([contrast(Samples(records), "a > b", "risk", {"planner": "a"}, {"planner": "b"}, {})])
    '0.5, 95 % within 0.5 to 0.5'
    """
    shifts = [one.shift.shift for one in contrasts]
    least = min(one.low for one in shifts)
    low, high = 1.0 / max(one.high for one in shifts), 1.0 / least if least > 0.0 else math.inf
    return f"{span([1.0 / one.median for one in shifts])}, 95 % within {low:.3g} to {high:.3g}"


def less_part(
    statement: str, contrasts: Sequence[Contrast], other: str, *, printed: str = "", condition: str = ""
) -> Part:
    """Say of CGLA that its value is less than another planner's, and what part of it it is."""
    effect = f"{relative(contrasts)} of {other}'s"
    return judged_part(statement, contrasts, effect=effect, printed=printed, condition=condition)


@experiment("three-uavs", quick=10)
def three_uavs(seed: int) -> list[Record]:
    """Fly the three UAVs of Fig. 10 on a random map; what one sees, all know."""
    # the paper's UAVs do not start within a threat
    field = RiskField(
        threat
        for threat in random_scenario(seed).problem.field.threats
        if all(math.dist((threat.x, threat.y), start) >= CLEAR for start in STARTS)
    )
    starts = {f"{number + 1}": start for number, start in enumerate(STARTS)}
    records: list[Record] = []
    for name, cell in flown_cells(COMPANY):
        flight = fly_from(starts, field, k=K, solver=name, collisions="record", **cell)
        records += [{**flown_by(name, cell), "uav": uav, **measures(one)} for uav, one in flight.uavs.items()]
    return records


@claim(
    44,
    "Section 5.2, Tables 4 and 5",
    "With three UAVs CGLA is shorter than FBCRI and CPVS, and far less risky than FBCRI.",
    "for each UAV, in twelve cells: greater lengths of fbcri-style and cpvs-style, greater risk sums of fbcri-style",
    Kind.STATISTIC,
    experiments=("three-uavs",),
    figures=("Fig. 10", "Table 4", "Table 5"),
)
def _check_c44(evidence: Evidence) -> Finding:
    samples = evidence.samples["three-uavs"]
    fbcri, cpvs, risk = (company(samples, *pair) for pair in (_FBCRI_LENGTH, _CPVS_LENGTH, _FBCRI_RISK))
    cpvs_risk = company(samples, "cpvs-style", "risk_sum")
    return Finding(
        (
            less_part("shorter than FBCRI", fbcri, "FBCRI-style", printed=_printed("length", "FBCRI")),
            less_part("shorter than CPVS", cpvs, "CPVS-style", printed=_printed("length", "CPVS")),
            less_part("less risky than FBCRI", risk, "FBCRI-style", printed=_printed("risk sum", "FBCRI")),
        ),
        f"CGLA's lengths are {relative(fbcri)} of FBCRI-style's and {relative(cpvs)} of CPVS-style's: less "
        f"{shown(fbcri)} and {shown(cpvs)} (three UAVs, each in all cells). Its risk sums are {relative(risk)} of "
        f"FBCRI-style's: less {shown(risk)}.",
        beside=(
            less_part("less risky than CPVS, whose risks are not printed", cpvs_risk, "CPVS-style"),
            *(
                less_part(f"costs less than {name}", company(samples, name.lower(), "cost"), name)
                for name in ("FBCRI-style", "CPVS-style")
            ),
        ),
        tables=(
            _company_table([fbcri, cpvs, risk, cpvs_risk]),
            arrivals(samples),
        ),
        notes=(
            STYLE,
            "Compared where both planners arrive; threats within 0.12 of a start are left out of the random maps.",
            (
                "Effects are CGLA's value over the other planner's, as are the printed ones (UAV 1, 2, 3); the table "
                "has them the other way round. In the paper, lengths are similar for UAV 1 only (186 against 195)."
            ),
            (
                "CGLA goes around risk, which it weighs with K = 10; who takes more of it flies less far. Length and "
                "risk together are its cost, length + K * risk, which stands beside."
            ),
        ),
    )


_FBCRI_LENGTH, _CPVS_LENGTH = ("fbcri-style", "length"), ("cpvs-style", "length")
_FBCRI_RISK = ("fbcri-style", "risk_sum")


def company(samples: Samples, planner: str, measure: str) -> list[Contrast]:
    """Compare each UAV's flights with CGLA's, cell by cell."""
    return [one for uav in "123" for one in versus_cgla(samples, planner, measure, uav=uav)]


def _printed(quantity: str, planner: str) -> str:
    """Return what CGLA's printed values are of the planner's, for the three UAVs."""
    table = "Table 4" if quantity == "risk sum" else "Table 5"
    ratios = [
        value(table, f"CGLA, UAV {uav}").printed[quantity] / value(table, f"{planner}, UAV {uav}").printed[quantity]
        for uav in "123"
    ]
    return ", ".join(f"{ratio:.3g}" for ratio in ratios)


def _company_table(groups: Sequence[Sequence[Contrast]]) -> Table:
    """Make a table of one row for each UAV and measurement."""
    rows = []
    for group in groups:
        for what in dict.fromkeys(one.what for one in group):
            cells = [one for one in group if one.what == what]
            medians = [one.shift.shift.median for one in cells]
            least = min(one.shift.effect for one in cells)
            rows.append((what, cells[0].shift.n, *finite(min(medians), max(medians)), least, shown(cells)))
    columns = ("first > second", "pairs", "ratio from", "to", "least effect", "shown")
    title = "Three UAVs that tell each other what they see, K = 10 (ratios over twelve cells)"
    return Table(title, columns, rows, RULE)


def arrivals(samples: Samples) -> Table:
    """Tell how often each planner's UAVs arrive, over all cells."""
    rows = []
    for case in samples.cases("planner"):
        rate = proportion([float(record["arrived"]) for record in samples.where(**case)])
        rows.append((case["planner"], rate.n, rate.rate))
    return Table("Arrivals", ("planner", "flights", "arrived"), rows)


_ALL = "for all discounts and rewards tried"


@claim(
    52,
    "Section 5.2, after Table 3",
    "Compared with Q-Learning, the result with sharing is much better.",
    "none: the table has no row of Q-Learning",
    Kind.PROSE,
    experiments=("q-learning-gamma",),
    figures=("Table 3",),
)
def _check_c52(evidence: Evidence) -> Finding:
    samples = evidence.samples["q-learning-gamma"]
    cost, risk = (learners_against_cgla(samples, LEARNERS, name) for name in ("cost", "risk_sum"))
    undiscounted = {name: learners_against_cgla(samples, [UNDISCOUNTED], name) for name in ("cost", "risk_sum")}
    return Finding.single(
        Verdict.NOT_TESTABLE,
        "Table 3 compares CGLA with and without sharing and has no row of Q-Learning. Of our own single flights, "
        f"CGLA's cost is {relative(undiscounted['cost'])} of Q-Learning's for {UNDISCOUNTED}, and its risk sum "
        f"{relative(undiscounted['risk_sum'])}.",
        beside=(
            less_part("CGLA alone costs less than Q-Learning alone", cost, "Q-Learning", condition=_ALL),
            less_part("CGLA alone is less risky than Q-Learning alone", risk, "Q-Learning", condition=_ALL),
        ),
        tables=(contrast_table("Q-Learning against CGLA, K = 10, limited sight (ratios)", [*cost, *risk]),),
        notes=(
            "Our Q-Learning pays for risk as CGLA does (reward -(length + K * risk)) and is trained anew at each plan.",
            "C42 has what sharing does to CGLA.",
        ),
    )


def learners_against_cgla(samples: Samples, names: Sequence[str] | Mapping[str, Any], measure: str) -> list[Contrast]:
    """
    Compare flights of Q-Learning with CGLA's in all cells: Q-Learning's value is claimed to be greater.

    Parameters
    ----------
    samples
        Of the experiment `q_learning_gamma`.
    names
        Of `LEARNERS`.
    measure
        A name.
    """
    return [
        contrast(
            samples,
            f"{measure.replace('_', ' ')}: Q-Learning, {name} > CGLA",
            measure,
            {"planner": name, "radius": cell["radius"]},
            {"planner": CGLA, **cell},
            {},
            name=cell,
        )
        for name in names
        for cell in CELLS
    ]

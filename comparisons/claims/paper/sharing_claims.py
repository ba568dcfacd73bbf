"""What UAVs gain by sharing (C42), by a matrix each (C45), and against planners in the style of others (C44)."""

from functools import partial

import numpy as np

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import FLOWN, Answer, Basis, Finding, Row, claim, flown_at, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.company import UAVS
from cgla_graph.comparisons.claims.panel.flights import team_measures
from cgla_graph.comparisons.claims.panel.one_matrix import DELAYS, fly_on_one_matrix
from cgla_graph.comparisons.claims.panel.settings import FACTORS, PANEL, Panel, PanelMap
from cgla_graph.comparisons.claims.panel.teams import fly_two
from cgla_graph.comparisons.claims.paper.printed_values import value
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Statement
from cgla_graph.solvers import get

COUNTEREXAMPLE = "c42-sharing-hurts.toml"
_LESS = partial(Statement, size="{} % less")


def factors_of_harm() -> dict[str, float]:
    """Fly the stored counterexample, and return by which factors sharing makes length, risk and cost greater."""
    missions = counterexamples.mission(COUNTEREXAMPLE).missions(get)
    without, shared = (team_measures(missions[f"{which} sharing"].fly()) for which in ("without", "with"))
    require(without["arrived"] and shared["arrived"], f"{COUNTEREXAMPLE}: not all arrive")
    factors = {name: shared[name] / without[name] for name in ("length", "risk", "cost")}
    for name, factor in factors.items():
        require(factor > 1.0, f"sharing no longer hurts in {COUNTEREXAMPLE}: {name} is {factor} times as great")
    return factors


@claim(
    42,
    "Section 5.2.2",
    "With sharing, UAVs fly shorter and with less risk.",
    "All cells, sums over two UAVs without and with sharing, side by side as in Fig. 8 and from two corners: sharing "
    "can only tell what the other one has not seen, which the formation decides. Varied: integral, replanning, start, "
    "side by side.",
    experiments=("sharing",),
    figures=("Fig. 9", "Table 3"),
    settings=FLOWN,
)
def _check_c42(evidence: Evidence) -> Finding:
    shared = partial(_LESS, first={"sharing": "global"}, second={"sharing": "none"}, factors=(*FACTORS, "formation"))
    statements = [
        shared("less risk", "risk", printed="45.2 % less"),
        shared("shorter", "length", printed="14.8 % less"),
        shared("less cost", "cost"),
    ]
    found = [judged(evidence.samples["sharing"], one) for one in statements]
    harm = factors_of_harm()
    why = f"both together fly {harm['length']:.3g} times as far, with {harm['risk']:.3g} times the risk"
    never = Row("shorter and less risk on every map", Answer.FAILS, Basis.COUNTEREXAMPLE, why=why)
    return Finding(
        (*(one.row for one in found), never),
        notes=(
            "Table 3: one UAV on one map, where the threats that the other one sees matter. Here: the sum of two.",
            "A UAV that knows more, but not all, may turn away from a known threat into one that none has seen.",
        ),
        tables=(panel_table("With sharing over without (ratios)", found),),
        counterexamples=(COUNTEREXAMPLE,),
    )


def require_same_at_once(seed: int, count: int) -> None:
    """Assert on maps that UAVs fly the same on one matrix, reached at once, as on a matrix each, all told at once."""
    for number in range(seed, seed + count):
        map_ = PanelMap(number)
        each = fly_two(map_, map_.field, sharing="global", k=50.0, radius=0.2)
        one = fly_on_one_matrix(each.mission, 0)
        for name, flight in each.uavs.items():
            same = np.array_equal(flight.trace, one.uavs[name].trace)
            require(same, f"map {number}: {name} flies another way on one matrix that is reached at once")


@claim(
    45,
    "Section 1",
    "One matrix for all UAVs is bad when they cannot communicate; a matrix for each is better.",
    "Sums over two UAVs, side by side, on half of the kinds of maps, each with three settings of OR and K, so that any "
    "two levels meet: the effect is large. Reports take 2, 5 or 10 ticks, in which a UAV flies 0.04 to 0.2. Varied: "
    "integral, replanning, start.",
    experiments=("one-matrix",),
    settings=FLOWN,
)
def _check_c45(evidence: Evidence) -> Finding:
    each = partial(_LESS, first={"matrices": "each"}, second={"matrices": "one"}, factors=(*FACTORS, "delay"))
    text = f"a matrix each costs less, {DELAYS[0]}-{DELAYS[-1]} ticks late"
    found = judged(evidence.samples["one-matrix"], each(text, "cost"))
    count = evidence.instances(25, 5)
    require_same_at_once(evidence.scale.map_seeds(1)[0], count)
    same = f"all UAVs know the same on each tick, so they plan the same; {count} missions agree"
    lost = "the paper does not say what they do; if they fly their first plan, they are worse by construction"
    return Finding(
        (
            found.row,
            Row("both cost the same without delay", Answer.HOLDS, Basis.PROOF, why=same),
            Row("better if one matrix is out of reach", Answer.NOT_TESTABLE, Basis.TEXT, why=lost),
        ),
        notes=("On one matrix a UAV plans with what it sees itself only when the matrix has it.",),
        tables=(panel_table("A matrix each over one matrix (ratios of cost)", [found]),),
    )


#: The three UAVs are levels: each has a row in the paper's tables, and a start of its own.
_OF_UAVS = (*FACTORS, "uav")


def _printed(measure: str, rival: str) -> str:
    """Return what part CGLA's printed value is of a rival's, for each UAV; empty where none is printed."""
    place = {"risk": "Table 4", "length": "Table 5"}.get(measure)
    if place is None:
        return ""
    pairs = [[getattr(value(place, f"{method}, {uav}"), measure) for method in ("CGLA", rival)] for uav in UAVS]
    return ", ".join(f"{own / other:.3g}" for own, other in pairs)


def _statement(words: str, measure: str, rival: str, panel: Panel) -> Statement:
    return Statement(
        f"{words} than {rival}-style",
        measure,
        {"planner": "cgla"},
        {"planner": f"{rival.lower()}-style"},
        factors=_OF_UAVS,
        where=panel.fixed("k", 10.0),
        printed=_printed(measure, rival),
    )


_WORDS = {"length": "shorter", "risk": "less risk", "cost": "less cost"}
#: What is said; no risk of CPVS is printed.
_SAID = {"FBCRI": ("length", "risk", "cost"), "CPVS": ("length", "cost")}


def statements(panel: Panel = PANEL) -> list[Statement]:
    """List what is said of CGLA against FBCRI-style and CPVS-style."""
    return [_statement(_WORDS[measure], measure, rival, panel) for rival, of in _SAID.items() for measure in of]


@claim(
    44,
    "Section 5.2, Tables 4 and 5",
    "With three UAVs CGLA is shorter than FBCRI and CPVS, and far less risky than FBCRI.",
    "All cells with K = 10, the K of its tables; three UAVs from the paper's starts that share what they see, and each "
    "UAV as a level, as the paper's tables have a row for each: a sum would be missing where one does not arrive. "
    "Threats within 0.12 of a start are left out. Varied: integral, replanning and start of CGLA; the rise of risk "
    "that FBCRI-style and CPVS-style tolerate, and whether CPVS-style weighs the way onward, constants of "
    "ours.",
    experiments=("company",),
    figures=("Fig. 10", "Table 4", "Table 5"),
    settings=flown_at(10.0),
)
def _check_c44(evidence: Evidence) -> Finding:
    found = [judged(evidence.samples["company"], one) for one in statements(evidence.panel)]
    return Finding(
        tuple(one.row for one in found),
        notes=(
            "Compared on maps where the UAV arrives with both planners. Printed ratios are of UAV 1, 2 and 3.",
            "Who takes more risk may fly less far: the cost, length + K * risk, weighs both.",
        ),
        tables=(panel_table("CGLA over FBCRI-style and CPVS-style, three UAVs (ratios)", found),),
    )

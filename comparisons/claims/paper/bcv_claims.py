"""
BCV (C32, C33): less risk at a similar length, local minima, and a long way close to risk.

The planner that flies here is in the style of the original, whose text is not public: answers are about this planner.
"""

from functools import partial

from cgla_graph.comparisons.claims.claim import Answer, Basis, Finding, Row, claim, flown_at
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.flights import CGLA, MAX_TICKS, Setup, fly, setup_name
from cgla_graph.comparisons.claims.panel.settings import PANEL, Case, Panel
from cgla_graph.comparisons.claims.panel.single_uav import BCV, BCV_AVERSE
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Rate, Shift, Statement, Within
from cgla_graph.mission.records import MissionStatus
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import get

_CGLA = {"planner": "cgla"}
#: BCV-style by what its objective weighs.
OBJECTIVES = {"length only": BCV, "risk-averse": BCV_AVERSE}
#: The K of the claim; BCV-style has none.
K = 10.0
#: Lengths are similar within this.
SIMILAR = 0.1
#: Close to risk is where F is above this, by the measure of flights.
CLOSE = 0.1
#: A shipped map of a crowd, in which BCV-style gets stuck.
STUCK_ON = "fifty-threats"
_READS = (
    "All cells with K = 10, the K of the claim: CGLA and BCV-style flown on the same maps, BCV-style with an objective "
    "of length only, as the paper describes it, and risk-averse; varied: integral, replanning, start, and how many "
    "spreads BCV-style keeps off threats, a constant of ours."
)


def _flown(words: str, panel: Panel) -> tuple[dict[str, str], Case]:
    """Return the case of BCV-style with an objective, and what restricts the panel."""
    return {"planner": setup_name(OBJECTIVES[words])}, {"mode": "flown", **panel.fixed("k", K)}


def against_bcv(words: str, panel: Panel = PANEL) -> list[Statement]:
    """List what is said of CGLA's risk, cost and length against those of BCV-style with an objective."""
    second, where = _flown(words, panel)
    of = partial(Statement, first=_CGLA, second=second, where=where)
    found = [
        of(f"less risk ({words})", "risk", printed="0.239"),
        of(f"less cost ({words})", "cost"),
        of(f"shorter ({words})", "length", printed="0.949, BCV's re-scaled"),
    ]
    # the paper's BCV minimises length only
    similar = of(f"length within {SIMILAR:.0%} ({words})", "length", test=Within(SIMILAR))
    return [*found, similar] if OBJECTIVES[words] == BCV else found


def _of_bcv(words: str, panel: Panel) -> list[Statement]:
    """List what is said of BCV-style's arrivals, and of its way through risk, with an objective."""
    first, where = _flown(words, panel)
    of = partial(Statement, first=first, second=_CGLA, where=where)
    near = partial(of, less=False, test=Shift(ratio=False), size="{} map units")
    return [
        of(f"arrives less often ({words})", "arrived", test=Rate(), size="{first} % against {second} %"),
        near(f"farther where F > {CLOSE:g} ({words})", "exposure"),
    ]


@claim(
    32,
    "Section 5.1",
    "CGLA with K = 10 beats BCV in both: similar length, a quarter of the risk.",
    _READS,
    experiments=("single-uav",),
    figures=("Fig. 5", "Table 1"),
    settings=flown_at(K),
)
def _check_c32(evidence: Evidence) -> Finding:
    found = [
        judged(evidence.samples["single-uav"], one)
        for words in OBJECTIVES
        for one in against_bcv(words, evidence.panel)
    ]
    return Finding(tuple(one.row for one in found), tables=(panel_table("CGLA over BCV-style (ratios)", found),))


@claim(
    33,
    "Section 5.1",
    "BCV suffers from local minima, and flies a long way close to risk.",
    f"{_READS} Close to risk is where F > {CLOSE:g}.",
    experiments=("single-uav",),
    figures=("Fig. 5", "Table 1"),
    settings=flown_at(K),
)
def _check_c33(evidence: Evidence) -> Finding:
    found = [
        judged(evidence.samples["single-uav"], one) for words in OBJECTIVES for one in _of_bcv(words, evidence.panel)
    ]
    return Finding(
        (stuck_row(evidence.panel), *(one.row for one in found)), tables=(panel_table("BCV-style against CGLA", found),)
    )


def stuck_row(panel: Panel = PANEL) -> Row:
    """Fly CGLA and BCV-style over the shipped crowd, and say for which objectives and radii only CGLA arrives."""
    problem = load_scenario(STUCK_ON).problem

    def arrives(of: Setup, radius: float, k: float) -> bool:
        solver, one = get(of[0], **dict(of[1])), {"a": problem.start}
        flight = fly(one, problem.field, problem.goal, solver, k=k, radius=radius, max_ticks=MAX_TICKS)
        return flight.uavs["a"].status is MissionStatus.ARRIVED

    # BCV-style weighs nothing by K
    ks, radii = panel.levels("k", (K,)), panel.levels("radius")
    seen = [radius for radius in radii if any(arrives(CGLA, radius, k) for k in ks)]
    stuck = [
        f"OR {radius:g} ({words})" for words, of in OBJECTIVES.items() for radius in seen if not arrives(of, radius, K)
    ]
    answer = Answer.HOLDS if stuck else Answer.OPEN
    why = f"K = {', '.join(f'{k:g}' for k in ks)}, with {', '.join(stuck) or f'no OR of {len(radii)}'}"
    return Row("can get stuck where CGLA arrives", answer, Basis.COUNTEREXAMPLE, f"on the map {STUCK_ON}", why=why)

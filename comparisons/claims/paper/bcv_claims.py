"""
BCV (C32, C33): less risk at a similar length, local minima, and a long way close to risk.

The planner that flies here is in the style of the original, whose text is not public: answers are about this planner.
"""

from cgla_graph.comparisons.claims.claim import Answer, Basis, Finding, Row, claim
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.flights import MAX_TICKS, RIM, Setup, fly, setup_name
from cgla_graph.comparisons.claims.panel.settings import FACTORS
from cgla_graph.comparisons.claims.panel.single_uav import BCV, BCV_AVERSE, CGLA
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Rate, Shift, Statement, Within
from cgla_graph.mission.records import MissionStatus
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import get

_CGLA = {"planner": "cgla"}
#: BCV-style by what its objective weighs.
OBJECTIVES = {"length only": BCV, "risk-averse": BCV_AVERSE}
#: The K of the claim; BCV-style has none.
_FLOWN = {"mode": "flown", "k": 10.0}
#: Lengths are similar within this.
SIMILAR = 0.1
#: A shipped map of a crowd, in which BCV-style gets stuck.
STUCK_ON = "fifty-threats"
_READS = (
    "All cells with K = 10, the K of the claim: CGLA and BCV-style flown on the same maps, BCV-style with an objective "
    "of length only, as the paper describes it, and risk-averse; varied: integral, replanning, start, and how many "
    "spreads BCV-style keeps off threats, a constant of ours."
)


def _against_bcv(words: str) -> list[Statement]:
    """List what is said of CGLA's risk, cost and length against those of BCV-style with an objective."""
    bcv, size = {"planner": setup_name(OBJECTIVES[words])}, "{} of BCV-style's"
    less = {"risk": ("less risk", "0.239"), "cost": ("less cost", ""), "length": ("shorter", "0.949, BCV's re-scaled")}
    return [
        *(
            Statement(f"{text} ({words})", measure, _CGLA, bcv, where=_FLOWN, size=size, printed=printed)
            for measure, (text, printed) in less.items()
        ),
        Statement(
            f"length within {SIMILAR:.0%} ({words})",
            "length",
            _CGLA,
            bcv,
            test=Within(SIMILAR),
            where=_FLOWN,
            size=size,
        ),
    ]


#: What C32 says, by objective of BCV-style.
AGAINST_BCV = {words: _against_bcv(words) for words in OBJECTIVES}


def _of_bcv(words: str) -> list[Statement]:
    """List what is said of BCV-style's arrivals, and of its way close to risk, with an objective."""
    bcv, who = {"planner": setup_name(OBJECTIVES[words])}, f"BCV-style ({words})"
    near = {"exposure": 0.1, "rim": RIM}
    return [
        Statement(
            f"{who} arrives less often than CGLA",
            "arrived",
            bcv,
            _CGLA,
            test=Rate(),
            where=_FLOWN,
            size="{first} % against {second} %",
        ),
        *(
            Statement(
                f"{who} flies farther where F > {level:g}",
                measure,
                bcv,
                _CGLA,
                less=False,
                test=Shift(ratio=False),
                where=_FLOWN,
                size="{} map units",
            )
            for measure, level in near.items()
        ),
    ]


@claim(
    32,
    "Section 5.1",
    "CGLA with K = 10 beats BCV in both: similar length, a quarter of the risk.",
    _READS,
    experiments=("single-uav",),
    figures=("Fig. 5", "Table 1"),
)
def _check_c32(evidence: Evidence) -> Finding:
    found = [judged(evidence.samples["single-uav"], one) for of in AGAINST_BCV.values() for one in of]
    return Finding(tuple(one.row for one in found), tables=(panel_table("CGLA over BCV-style (ratios)", found),))


@claim(
    33,
    "Section 5.1",
    "BCV suffers from local minima, and flies a long way close to risk.",
    f"{_READS} Close to risk is where F > 0.1, or F > {RIM:g}.",
    experiments=("single-uav",),
    figures=("Fig. 5", "Table 1"),
)
def _check_c33(evidence: Evidence) -> Finding:
    found = [judged(evidence.samples["single-uav"], one) for words in OBJECTIVES for one in _of_bcv(words)]
    return Finding((stuck_row(), *(one.row for one in found)), tables=(panel_table("BCV-style against CGLA", found),))


def stuck_row() -> Row:
    """Fly CGLA and BCV-style over the shipped crowd, and say for which objectives and radii only CGLA arrives."""
    problem = load_scenario(STUCK_ON).problem

    def arrives(of: Setup, radius: float) -> bool:
        solver, one = get(of[0], **dict(of[1])), {"a": problem.start}
        flight = fly(one, problem.field, problem.goal, solver, k=10.0, radius=radius, max_ticks=MAX_TICKS)
        return flight.uavs["a"].status is MissionStatus.ARRIVED

    seen = [radius for radius in FACTORS["radius"] if arrives(CGLA, radius)]
    stuck = [
        f"OR {radius:g} ({words})" for words, of in OBJECTIVES.items() for radius in seen if not arrives(of, radius)
    ]
    return Row(
        "BCV-style can get stuck where CGLA arrives",
        Answer.HOLDS if stuck else Answer.OPEN,
        Basis.COUNTEREXAMPLE,
        f"on the map {STUCK_ON}",
        why=f"K = 10, with {', '.join(stuck)}",
    )

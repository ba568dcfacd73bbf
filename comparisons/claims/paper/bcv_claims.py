"""
BCV (C32, C33): less risk at a similar length, local minima, and a long way close to risk.

What flies here is a planner in the style of the original, whose text is not public: an answer is one on this planner.
"""

from cgla_graph.comparisons.claims.claim import Finding, claim
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.flights import setup_name
from cgla_graph.comparisons.claims.panel.single_uav import BCV, BCV_AVERSE
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Statement, Within

_CGLA = {"planner": "cgla"}
#: BCV-style by what its objective weighs.
_OBJECTIVES = {"length only": {"planner": setup_name(BCV)}, "risk-averse": {"planner": setup_name(BCV_AVERSE)}}
_FLOWN = {"mode": "flown", "k": 10.0}
#: Lengths are similar within this.
SIMILAR = 0.1
_READS = (
    "All cells, CGLA and BCV-style flown on the same maps, with BCV-style's objective of length only, as the paper "
    "describes it, and risk-averse; varied: integral, replanning, start, and how far BCV-style keeps off threats."
)


@claim(
    32,
    "Section 5.1",
    "CGLA with K = 10 beats BCV in both: similar length, a quarter of the risk.",
    _READS,
    experiments=("single-uav",),
    figures=("Fig. 5", "Table 1"),
)
def _check_c32(evidence: Evidence) -> Finding:
    statements = [
        Statement(f"{text} ({words})", measure, _CGLA, bcv, where=_FLOWN, size="{} of BCV-style's", printed=printed)
        for words, bcv in _OBJECTIVES.items()
        for text, measure, printed in (
            ("less risk", "risk", "0.239"),
            ("shorter", "length", "0.949, BCV's re-scaled"),
            ("less cost", "cost", ""),
        )
    ]
    statements += [
        Statement(
            f"length within {SIMILAR:.0%} ({words})",
            "length",
            _CGLA,
            bcv,
            test=Within(SIMILAR),
            where=_FLOWN,
            size="{} of BCV-style's",
        )
        for words, bcv in _OBJECTIVES.items()
    ]
    found = [judged(evidence.samples["single-uav"], one) for one in statements]
    return Finding(
        tuple(one.row for one in found),
        tables=(panel_table("CGLA over BCV-style (ratios)", found),),
    )

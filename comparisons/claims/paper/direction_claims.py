"""Eight directions (C26): what they cost in length, risk and cost."""

from functools import partial

from cgla_graph.comparisons.claims.claim import Finding, claim
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.settings import FACTORS
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Statement

#: Plans on one and the same lattice, over one and the same cost.
_eight = partial(
    Statement, first={"planner": "eight-direction"}, second={"planner": "cgla"}, less=False, size="{} % more"
)
#: The words for a mode, and the factors of the panel that there are in it.
_MODES = {"known": (", all known", ("threats", "spread", "goal", "k")), "flown": (" in flight", tuple(FACTORS))}
#: What C26 says.
DIRECTIONS = [
    _eight(f"{measure}: greater{words}", measure, factors=factors, where={"mode": mode})
    for measure in ("length", "cost", "risk")
    for mode, (words, factors) in _MODES.items()
]


@claim(
    26,
    "Section 3.1, Fig. 2",
    "A path of eight directions is longer than it has to be, and more so than one over straight segments.",
    "All cells, CGLA and the optimum in eight directions on the lattice of N = 20, planned with all known and flown: "
    "the comparison is about directions alone, as both minimise the same cost.",
    experiments=("single-uav",),
    figures=("Fig. 2",),
)
def _check_c26(evidence: Evidence) -> Finding:
    found = [judged(evidence.samples["single-uav"], one) for one in DIRECTIONS]
    return Finding(
        tuple(one.row for one in found),
        notes=("Every path of eight directions is one over any segments, so that CGLA's optimum never costs more.",),
        tables=(panel_table("Eight directions over CGLA (ratios)", found),),
    )

"""Eight directions (C26, C55): what they cost in length, risk and cost, and what they save in edges."""

from cgla_graph.comparisons.claims.claim import Finding, claim
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Statement

#: Plans on one and the same lattice, over one and the same cost.
_EIGHT, _CGLA = {"planner": "eight-direction"}, {"planner": "cgla"}
_KNOWN = ("threats", "spread", "goal", "k")


def _compared(measure: str) -> list[Statement]:
    """Compare eight directions with CGLA by a measure: with all of the map known, and flown."""
    size = "{} % more"
    return [
        Statement(
            f"{measure}: greater, all known",
            measure,
            _EIGHT,
            _CGLA,
            less=False,
            factors=_KNOWN,
            where={"mode": "known"},
            size=size,
        ),
        Statement(
            f"{measure}: greater in flight", measure, _EIGHT, _CGLA, less=False, where={"mode": "flown"}, size=size
        ),
    ]


#: What C26 says.
DIRECTIONS = [one for name in ("length", "cost", "risk") for one in _compared(name)]


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
        notes=(
            (
                "Every path of eight directions is one over segments of the complete graph, so that the cost of CGLA's "
                "optimum is never greater: the panel shows by how much."
            ),
        ),
        tables=(panel_table("Eight directions over CGLA (ratios)", found),),
    )

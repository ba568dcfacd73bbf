"""
Three UAVs (C44): CGLA against planners in the style of FBCRI and CPVS.

The originals are not public: answers are about our planners.
"""

from cgla_graph.comparisons.claims.claim import Finding, claim
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.company import UAVS
from cgla_graph.comparisons.claims.panel.settings import FACTORS
from cgla_graph.comparisons.claims.paper.printed_values import value
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Statement

#: The three UAVs are levels: each has a row in the paper's tables, and a start of its own.
_FACTORS = (*FACTORS, "uav")


def _printed(measure: str, rival: str) -> str:
    """Return what part CGLA's printed value is of a rival's, for each UAV; empty where none is printed."""
    place = {"risk": "Table 4", "length": "Table 5"}.get(measure)
    if place is None:
        return ""
    pairs = [[getattr(value(place, f"{method}, {uav}"), measure) for method in ("CGLA", rival)] for uav in UAVS]
    return ", ".join(f"{own / other:.3g}" for own, other in pairs)


def _statement(words: str, measure: str, rival: str) -> Statement:
    return Statement(
        f"{words} than {rival}-style",
        measure,
        {"planner": "cgla"},
        {"planner": f"{rival.lower()}-style"},
        factors=_FACTORS,
        printed=_printed(measure, rival),
    )


_WORDS = {"length": "shorter", "risk": "less risk", "cost": "less cost"}
#: What is said; no risk of CPVS is printed.
_SAID = {"FBCRI": ("length", "risk", "cost"), "CPVS": ("length", "cost")}
STATEMENTS = tuple(_statement(_WORDS[measure], measure, rival) for rival, of in _SAID.items() for measure in of)


@claim(
    44,
    "Section 5.2, Tables 4 and 5",
    "With three UAVs CGLA is shorter than FBCRI and CPVS, and far less risky than FBCRI.",
    "All cells, three UAVs from the paper's starts that share what they see, and each UAV as a level, as the paper's "
    "tables have a row for each: a sum would be missing where one does not arrive. Threats within 0.12 of a start are "
    "left out. Varied: integral, replanning and start of CGLA; the rise of risk that FBCRI-style and CPVS-style "
    "tolerate, and whether CPVS-style weighs the way onward from a sub-goal, constants of ours.",
    experiments=("company",),
    figures=("Fig. 10", "Table 4", "Table 5"),
)
def _check_c44(evidence: Evidence) -> Finding:
    found = [judged(evidence.samples["company"], one) for one in STATEMENTS]
    return Finding(
        tuple(one.row for one in found),
        notes=(
            "Compared on maps where the UAV arrives with both planners. Printed ratios are of UAV 1, 2 and 3.",
            "Who takes more risk may fly less far: the cost, length + K * risk, weighs both.",
        ),
        tables=(panel_table("CGLA over FBCRI-style and CPVS-style, three UAVs (ratios)", found),),
    )

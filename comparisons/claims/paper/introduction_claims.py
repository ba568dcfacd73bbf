"""
The introduction on other planners (C50): simple, complex and partial maps, sudden changes, speed.

The planners are in the style of the originals, most of which are not public: answers are about ours.
"""

from cgla_graph.comparisons.claims.claim import Finding, claim
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel.introduction import SHORT, SIMPLE, SUDDEN
from cgla_graph.comparisons.claims.panel.settings import Case
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Share, Shift, Statement

#: A planner does while it costs no more than this beyond the best, or beyond another one; else it fails.
MARGIN = 0.1
#: On so many maps something has to happen to count as usual.
USUAL = 0.95
_KINDS = ("threats", "spread", "goal", "k")
_GRAPHS = {"Voronoi graphs": "voronoi", "visibility graphs": "visibility-graph"}
#: Whether a flight keeps its first plan, or plans again when it sees something new.
_PLANS = {"first plan kept": "never", "planning again": "change"}
#: How rows name levels of the constants.
_WORDS = {
    "with chain": "an elastic chain",
    "without chain": "no chain",
    **{f"{spreads:g} spreads": f"polygons of {spreads:g} spreads" for spreads in (2.0, 2.5, 3.0)},
}
_NEW = {"planner": "milp", "mode": "sudden", "replan": "change"}


def _fails(
    text: str, first: Case, second: Case | float, factors: tuple[str, ...], size: str, *, does: bool = False
) -> Statement:
    """Compare costs, or ratios of costs with 1: more than the margin beyond, or, where a planner does, less."""
    measure = "ratio" if isinstance(second, float) else "cost"
    return Statement(text, measure, first, second, less=does, test=Shift(margin=MARGIN), factors=factors, size=size)


#: Those on simple maps.
ON_SIMPLE = (
    *(
        _fails(
            f"{words} do on simple maps",
            {"planner": planner, "mode": "known"},
            1.0,
            (*_KINDS, "constant"),
            "x {} of the least cost",
            does=True,
        )
        for words, planner in _GRAPHS.items()
    ),
    _fails(
        "MILP fails at a sudden threat, first plan kept",
        {**_NEW, "replan": "never"},
        _NEW,
        (*_KINDS, "radius"),
        "x {} of a new plan's cost",
    ),
    _fails(
        "MILP fails at a sudden threat, planning again",
        _NEW,
        {**_NEW, "planner": "cgla"},
        (*_KINDS, "radius"),
        "x {} of CGLA's cost",
    ),
)
#: Those on complex maps, all known or seen under way.
ON_COMPLEX = (
    *(
        _fails(
            f"{words} fail on complex maps",
            {"planner": planner, "mode": "known"},
            1.0,
            (*_KINDS, "constant"),
            "x {} of the least cost",
        )
        for words, planner in _GRAPHS.items()
    ),
    *(
        _fails(
            f"{words} fail on partial maps, {plan}",
            {"planner": planner, "mode": "flown", "replan": replan},
            1.0,
            (*_KINDS, "constant", "radius"),
            "x {} of the cost with all known",
        )
        for words, planner in _GRAPHS.items()
        for plan, replan in _PLANS.items()
    ),
    Statement(
        f"evolution finds paths within {SHORT:g} s",
        "quick",
        {"planner": "evolutionary"},
        USUAL,
        less=False,
        test=Share(USUAL),
        factors=_KINDS,
        size="on {} % of maps",
    ),
)
#: The one that reads flights of single UAVs.
A2D = _fails(
    "A2D-style fails on complex maps",
    {"planner": "a2d-style", "mode": "flown"},
    {"planner": "cgla", "mode": "flown"},
    (*_KINDS, "radius"),
    "x {} of CGLA's cost",
)


@claim(
    50,
    "Section 1",
    "Voronoi and visibility graphs do for simple maps only and fail fatally on partial ones; MILP fails when "
    "something changes suddenly; A2D fails on complex maps; evolution finds feasible ways quickly.",
    f"Complex maps are all of the panel, simple ones have {SIMPLE} threats; all K. A planner does while its cost is at "
    f"most {MARGIN:.0%} beyond the least in the plane, and fails while it is more than {MARGIN:.0%} beyond: on partial "
    "maps beyond its own with all known, for A2D beyond CGLA's, for MILP beyond a new plan or CGLA's, where a threat "
    f"comes up on its way after {SUDDEN} steps, a detection radius ahead, on simple maps. Factors: Voronoi graphs with "
    "and without their elastic chain, how many spreads visibility graphs keep off threats; varied: A2D's threshold.",
    experiments=("introduction", "single-uav"),
)
def _check_c50(evidence: Evidence) -> Finding:
    records = [
        {**one, "constant": _WORDS.get(one.get("constant", ""))} for one in evidence.samples["introduction"].records
    ]
    simple, complex_ = (
        Samples([one for one in records if (one["threats"] == SIMPLE) is is_simple]) for is_simple in (True, False)
    )
    found = [judged(of, one) for of, group in ((simple, ON_SIMPLE), (complex_, ON_COMPLEX)) for one in group]
    found.append(judged(evidence.samples["single-uav"], A2D))
    return Finding(
        tuple(one.row for one in found),
        notes=(
            "Risk is soft, so that even a straight line arrives: planners are judged by what they cost.",
            "With any planner, a flight that keeps its first plan pays for what it did not know.",
            "The least cost in the plane is that of fast marching. Seconds are those of the machine that ran this.",
        ),
        tables=(panel_table("Remarks of the introduction, by cost", found),),
    )

"""
The introduction on other planners (C50): simple, complex and partial maps, sudden changes, speed.

The planners are in the style of the originals, most of which are not public: answers are about ours.
"""

from functools import partial

from cgla_graph.comparisons.claims.claim import FLOWN, Finding, claim
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel.introduction import SHORT, SIMPLE, SUDDEN
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
#: Costs, or ratios of costs with 1, are more than the margin beyond, or, where a planner does, less.
_costs = partial(Statement, measure="cost", less=False, test=Shift(margin=MARGIN), factors=(*_KINDS, "radius"))
_over_least = partial(_costs, measure="ratio", second=1.0, factors=(*_KINDS, "constant"), size="x {} of the least")
_over_known = partial(_over_least, factors=(*_KINDS, "constant", "radius"), size="x {} of all known")
_NEW, _KEPT = ({"planner": "milp", "mode": "sudden", "replan": replan} for replan in ("change", "never"))
#: Those on simple maps.
ON_SIMPLE = (
    *(
        _over_least(f"{words} do on simple maps", first={"planner": planner, "mode": "known"}, less=True)
        for words, planner in _GRAPHS.items()
    ),
    _costs("MILP fails at sudden threats, first plan kept", first=_KEPT, second=_NEW, size="x {} of a new plan"),
    _costs(
        "MILP fails at sudden threats, planning again",
        first=_NEW,
        second={**_NEW, "planner": "cgla"},
        size="x {} of CGLA's",
    ),
)
#: Those on complex maps, all known or seen under way.
ON_COMPLEX = (
    *(
        _over_least(f"{words} fail on complex maps", first={"planner": planner, "mode": "known"})
        for words, planner in _GRAPHS.items()
    ),
    *(
        _over_known(f"{words} fail on partial maps, {plan}", first={"planner": planner, "mode": "flown", "replan": of})
        for words, planner in _GRAPHS.items()
        for plan, of in _PLANS.items()
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
_CGLA, _A2D = ({"planner": planner, "mode": "flown"} for planner in ("cgla", "a2d-style"))
#: The one that reads flights of single UAVs.
A2D = _costs("A2D-style fails on complex maps", first=_A2D, second=_CGLA, size="x {} of CGLA's")


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
    settings=FLOWN,
)
def _check_c50(evidence: Evidence) -> Finding:
    records = evidence.samples["introduction"].records
    simple, complex_ = (Samples([one for one in records if one["simple"] is is_simple]) for is_simple in (True, False))
    found = [judged(of, one) for of, group in ((simple, ON_SIMPLE), (complex_, ON_COMPLEX)) for one in group]
    found.append(judged(evidence.samples["single-uav"], A2D))
    return Finding(
        tuple(one.row for one in found),
        notes=(
            "Risk is soft: even a straight line arrives. Planners are judged by what they cost.",
            "The least cost in the plane is that of fast marching. Seconds are those of the machine that ran this.",
        ),
        tables=(panel_table("Remarks of the introduction, by cost", found),),
    )

"""
Virtual obstacles (C39, C41, C48): what they do to collisions of two UAVs.

The paper prints neither their spread nor SD: both are factors, beside those of the panel.
"""

from functools import partial

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import FLOWN, Answer, Basis, Finding, Row, Setting, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.flights import COLLISION_DISTANCE, team_measures
from cgla_graph.comparisons.claims.panel.settings import FACTORS
from cgla_graph.comparisons.claims.panel.teams import FEW_THREATS, NO_OBSTACLE, STEPNUM
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Rate, Share, Statement
from cgla_graph.solvers import get

#: Factors of flights with virtual obstacles.
OBSTACLE_FACTORS = (*FACTORS, "obstacle_spread", "safe_distance")
#: Two UAVs collide with obstacles of spread 0.02, 0.03 and 0.05, on a map each.
COUNTEREXAMPLES = tuple(f"c41-{width}obstacles-collide.toml" for width in ("", "wider-", "widest-"))
#: What counts as most conflicts, and as nearly all missions.
MOST, NEARLY_ALL = 0.5, 0.95
_READS = (
    "Two UAVs of one speed that start side by side as in Fig. 8, without sharing, on half of the kinds of maps, each "
    "with three settings of OR, K, spread of the obstacle and SD, so that any two levels meet: a flight around virtual "
    "obstacles takes up to ten times as long as another one. Varied: integral, replanning, start."
)
_SETTINGS = (
    "The unit of stepnum is 1/N, so that 0.4 units are one step, 0.02 (E22). A collision is a distance below 0.03, 1.5 "
    "steps; the paper prints none (E25). SD is 0.06 or 0.1, at OR 0.1 at most 0.09, as it has to be below OR."
)


#: What a user can set of C48, whose numbers of threats are its own.
_FEW = {**FLOWN, "threats": Setting("the first so many threats of each map", usual=FEW_THREATS)}


def _often(measure: str, bar: float) -> partial[Statement]:
    """State that something happens on a share of maps above a bar."""
    return partial(Statement, measure=measure, second=bar, less=False, test=Share(bar))


_collide = partial(
    Statement, measure="collided", test=Rate(), factors=OBSTACLE_FACTORS, size="{first} % against {second} % of flights"
)


@claim(
    39,
    "Section 5.2.1, Fig. 7",
    "With a virtual obstacle 0 or 5 steps ahead two UAVs collide, with 3 steps they do not.",
    _READS,
    experiments=("obstacles",),
    figures=("Fig. 7",),
    settings=FLOWN,
)
def _check_c39(evidence: Evidence) -> Finding:
    more = partial(_collide, second={"stepnum": STEPNUM}, less=False)
    found = [
        judged(
            evidence.samples["obstacles"],
            more(f"{ahead} steps ahead collide more often than {STEPNUM}", first={"stepnum": ahead}),
        )
        for ahead in (0, 5)
    ]
    return Finding(
        tuple(one.row for one in found),
        (_SETTINGS, "Nearer than SD the obstacle is moved ahead of the other UAV, whose own place is left free."),
        (panel_table("Collisions with 0 and 5 steps ahead against 3 (differences of rates)", found),),
    )


def pairs_that_collide() -> str:
    """Assert that two UAVs collide only with virtual obstacles in stored flights, and say how near they come."""
    words = []
    for name in COUNTEREXAMPLES:
        missions = counterexamples.mission(name).missions(get)
        without, with_them = (
            team_measures(missions[f"{which} virtual obstacles"].fly())["separation"] for which in ("without", "with")
        )
        require(without >= COLLISION_DISTANCE, f"the UAVs of {name} collide without virtual obstacles, too")
        require(with_them < COLLISION_DISTANCE, f"the UAVs of {name} no longer collide with virtual obstacles")
        words.append(f"{with_them:.2g} apart, {without:.2g} without")
    return "; ".join(words)


@claim(
    41,
    "Section 5.2.1, Fig. 8",
    "Two UAVs of one speed collide near (0.5, 0.7); virtual obstacles keep them apart.",
    _READS + " With 3 steps ahead, the paper's best; a conflict is a collision of the same two without obstacles.",
    merged=(40,),
    experiments=("obstacles",),
    figures=("Fig. 8",),
    settings=FLOWN,
)
def _check_c41(evidence: Evidence) -> Finding:
    with_them = {"stepnum": STEPNUM}
    avoided = _often("avoided", MOST)
    statements = (
        _collide("fewer collide with virtual obstacles", first=with_them, second={"stepnum": NO_OBSTACLE}),
        avoided("most conflicts are avoided", first=with_them, factors=OBSTACLE_FACTORS, size="{} % of conflicts"),
    )
    found = [judged(evidence.samples["obstacles"], one) for one in statements]
    why = f"with obstacles of spread 0.02, 0.03 and 0.05 two UAVs pass {pairs_that_collide()}"
    unknown = "the map is not printed: UAV b is 0.119 nearer to that point, so that the map decides if they meet there"
    return Finding(
        (
            Row("virtual obstacles always prevent collisions", Answer.FAILS, Basis.COUNTEREXAMPLE, why=why),
            *(one.row for one in found),
            Row("the two collide near (0.5, 0.7)", Answer.NOT_TESTABLE, Basis.TEXT, why=unknown),
        ),
        notes=(
            _SETTINGS,
            "Any change of a flight may end a conflict, or cause one: that fewer collide weighs both.",
            "Planning in space and time around the plans of others does keep the distance: avoidance='prioritized'.",
        ),
        tables=(panel_table("Collisions with and without virtual obstacles", found),),
        counterexamples=COUNTEREXAMPLES,
    )


@claim(
    48,
    "Section 5.2.3, Fig. 12",
    "The method works for two UAVs among five and among seven threats.",
    "Two UAVs that share what they see, side by side, with virtual obstacles 3 steps ahead, among the first five and "
    "seven threats of all maps; each kind of spread and goal with three settings of OR, K, spread of the obstacle and "
    "SD. Varied: integral, replanning and start, each on a third of the maps.",
    experiments=("few-threats",),
    figures=("Fig. 12",),
    settings=_FEW,
)
def _check_c48(evidence: Evidence) -> Finding:
    factors = tuple(name for name in OBSTACLE_FACTORS if name != "threats")
    works = partial(_often("works", NEARLY_ALL), factors=factors, size="{} % of maps")
    found = [
        judged(
            evidence.samples["few-threats"],
            works(f"{count} threats: it works on > {NEARLY_ALL:.0%}", first={"few_threats": count}),
        )
        for count in evidence.panel.levels("threats", FEW_THREATS)
    ]
    return Finding(
        tuple(one.row for one in found),
        (_SETTINGS, "It works if both arrive without a collision."),
        (panel_table("Both arrive without a collision (shares of maps)", found),),
    )

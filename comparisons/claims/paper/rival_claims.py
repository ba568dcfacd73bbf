"""
A2D and Q-Learning against CGLA (C34, C35): risk, its cause, length and cost.

The planners that fly here are in the style of the originals, which are not public: answers are about these planners.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import TypeAlias

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import FLOWN, Answer, Basis, Finding, Row, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel.flights import CGLA, N, Setup, setup_name
from cgla_graph.comparisons.claims.panel.learners import UNDISCOUNTED, discount_name, flying_learners, reward_name
from cgla_graph.comparisons.claims.panel.settings import BOUNDS, FACTORS, GOALS, START
from cgla_graph.comparisons.claims.panel.single_uav import A2D, BCV, BCV_AVERSE, CONSTANTS, EIGHT
from cgla_graph.comparisons.claims.paper.printed_values import value
from cgla_graph.comparisons.claims.rule import VARIED, Judged, judged, panel_table
from cgla_graph.comparisons.claims.statement import LEAST, Statement
from cgla_graph.mission.records import MissionStatus
from cgla_graph.model.lattice import Lattice
from cgla_graph.solvers import get, solve
from cgla_graph.solvers.grid.value_iteration import decision_process, greedy, value_iteration

#: Planners of Table 1 that Q-Learning is said to be riskier than, as rows name them.
OTHERS: Mapping[str, Setup] = {"BCV-style (length only)": BCV, "BCV-style (risk-averse)": BCV_AVERSE, "A2D-style": A2D}
#: A stored map on which the best way in eight directions has more than so many times the risk of that in any.
RISKY, RISKIER = "eight-directions-risky.toml", 10.0
TEN = "CGLA, K = 10"
LONGER = "longer-than-q-learning.toml"
#: A reward for which the fewest moves are best on that map, with these discounts.
ENORMOUS, DISCOUNTS = 1e6, (0.95, 0.99)
#: Where a flight was measured: map, detection radius, K.
Place: TypeAlias = tuple[int, float, float]
#: Flights of one planner, by the varied setting and the place.
Flown: TypeAlias = Mapping[str, Mapping[Place, Record]]


def flights_of(samples: Samples, of: Setup | None = None, **case: str) -> Flown:
    """Return the flights of a planner of the panel, or of a case of Q-Learning, without varied settings of others."""
    if of is not None:
        case["planner"] = setup_name(of)
    theirs = {setup_name(changed) for other, changed in CONSTANTS if other != of}
    found: dict[str, dict[Place, Record]] = {"": {}}
    for record in samples.where(mode="flown", **case):
        if record[VARIED] not in theirs:
            found.setdefault(record[VARIED], {})[record["map"], record["radius"], record["k"]] = record
    return found


def together(*sides: Flown) -> Iterator[tuple[str, tuple[Record, ...]]]:
    """Put flights of several planners side by side; a setting that one side does not have leaves its flights as is."""
    for varied in dict.fromkeys(name for side in sides for name in side):
        chosen = [side.get(varied, side[""]) for side in sides]
        for place in chosen[0]:
            if all(place in flights for flights in chosen):
                yield varied, tuple(flights[place] for flights in chosen)


def against(samples: Mapping[str, Samples], others: Mapping[str, Setup], *, discounted: bool = True) -> Samples:
    """Put Q-Learning's flights beside those of others: records with ``side`` "ours" are Q-Learning's, else "theirs"."""
    records: list[Record] = []
    for names, ours in _learners(samples, discounted=discounted):
        for rival, of in others.items():
            for varied, pair in together(ours, flights_of(samples["single-uav"], of)):
                own = {**names, "rival": rival, VARIED: varied}
                records += [{**one, **own, "side": side} for side, one in zip(("ours", "theirs"), pair, strict=True)]
    return Samples(records)


def causes(samples: Mapping[str, Samples]) -> Samples:
    """Part Q-Learning's risk over CGLA's in a factor that eight directions add, and one that the rest adds."""
    records: list[Record] = []
    exact = [flights_of(samples["single-uav"], of) for of in (EIGHT, CGLA)]
    for names, ours in _learners(samples, discounted=True):
        for varied, flown in together(ours, *exact):
            risks = [None if one["risk"] is None else max(one["risk"], LEAST) for one in flown]
            for side, (over, under) in {"directions": risks[1:], "rest": risks[:2]}.items():
                ratio = None if over is None or under is None else over / under
                records.append({**flown[0], **names, VARIED: varied, "side": side, "risk": ratio})
    return Samples(records)


def _learners(samples: Mapping[str, Samples], *, discounted: bool) -> Iterator[tuple[dict[str, str], Flown]]:
    for gamma, reward in flying_learners():
        if (gamma < UNDISCOUNTED) == discounted:
            names = {"gamma": discount_name(gamma), "reward": reward_name(reward)}
            yield names, flights_of(samples["learners"], None, **names)


def _printed(first: str, second: str) -> str:
    return f"x {value('Table 1', first).risk / value('Table 1', second).risk:.3g}, quoted"


def judged_flights(samples: Mapping[str, Samples]) -> list[Judged]:
    """Judge all statements about flights."""
    cgla, learned, panel = {"CGLA": CGLA}, ("gamma", "reward", *FACTORS), samples["single-uav"]
    learner, undiscounted = (against(samples, cgla, discounted=discounted) for discounted in (True, False))
    riskier = partial(Statement, measure="risk", first={"side": "ours"}, second={"side": "theirs"}, less=False)
    better = partial(Statement, first={"side": "theirs"}, second={"side": "ours"}, factors=learned)
    cause = partial(riskier, first={"side": "directions"}, second={"side": "rest"}, factors=learned)
    a2d, of_cgla = ({"planner": setup_name(of)} for of in (A2D, CGLA))
    others, factors = against(samples, OTHERS), ("rival", *learned)
    text = "Q-Learning takes more risk than"
    printed = "; ".join(_printed("Q-Learning", name) for name in ("BCV", "A2D"))
    length = value("Table 1", TEN).length / value("Table 1", "Q-Learning").length
    than_a2d = riskier("A2D takes more risk than CGLA", first=a2d, second=of_cgla, where={"mode": "flown"})
    statements = (
        (learner, riskier(f"{text} CGLA", factors=learned, printed=_printed("Q-Learning", TEN))),
        (others, riskier(f"{text} BCV and A2D", factors=factors, printed=printed)),
        (causes(samples), cause("eight directions cause most of it", size="{} of the rest's factor")),
        (undiscounted, riskier(f"{text} CGLA (gamma = 1: not the paper's)")),
        (panel, replace(than_a2d, printed=_printed("A2D", TEN))),
        (learner, better("CGLA costs less than Q-Learning", "cost")),
        (learner, better("CGLA flies shorter than Q-Learning", "length", printed=f"x {length:.3g}")),
    )
    return [judged(of, statement) for of, statement in statements]


@claim(
    34,
    "Section 5.1, Table 1",
    "A2D and Q-Learning pass regions of high risk; Q-Learning is much riskier than the others, as it has eight "
    "directions only; CGLA is superior to it.",
    "All cells, flown, Q-Learning with gamma = 0.95 and 0.99 and rewards of 3 and 100 at the target (neither is "
    "printed), on flights that arrive; varied: rate and length of training, replanning, A2D's threshold, how far BCV "
    "keeps off, and for CGLA integral and start. gamma = 1 is outside of the paper's range and stands apart.",
    merged=(35,),
    experiments=("single-uav", "learners"),
    figures=("Fig. 5", "Table 1"),
    settings=FLOWN,
)
def _check_c34(evidence: Evidence) -> Finding:
    found = judged_flights(evidence.samples)
    risks, costs = risky_in_eight_directions()
    return Finding(
        (*(one.row for one in found), longer_on_a_map()),
        notes=(
            "The cause: Q-Learning's risk over CGLA's is that of the best way in eight directions, times the rest.",
            (
                "Proof that with gamma < 1 a large reward R at the target makes Q-Learning blind to risk: a way of n "
                "moves is worth gamma^(n - 1) R - D_n, with D_n its discounted cost. For R above "
                "D_n / (gamma^(n - 1) (1 - gamma)) no way of more moves is worth as much: the fewest are best "
                f"(asserted by value iteration: {fewest_moves()} moves with R = {ENORMOUS:g})."
            ),
            f"Eight directions can have {risks:.3g} times CGLA's risk, at {costs:.3g} times its cost ({RISKY}).",
            "The paper quotes the risks of BCV, A2D and Q-Learning from other papers: other maps, other measures.",
        ),
        tables=(panel_table("A2D-style and Q-Learning against CGLA and others (ratios)", found),),
        counterexamples=(LONGER, RISKY),
    )


def longer_on_a_map() -> Row:
    """Fly CGLA and Q-Learning over a stored map on which CGLA flies farther."""
    ours, theirs = (one.fly().uavs["a"] for one in counterexamples.mission(LONGER).missions(get).values())
    both = theirs.status is ours.status is MissionStatus.ARRIVED
    require(both and ours.length > theirs.length, f"{LONGER} no longer shows that CGLA flies farther than Q-Learning")
    size = f"x {ours.length / theirs.length:.3g}"
    why = f"{ours.length:.4g} against {theirs.length:.4g} on a stored map (K = 10, gamma = 1); Table 1: 243, 204.8"
    return Row("CGLA flies shorter on every map", Answer.FAILS, Basis.COUNTEREXAMPLE, size=size, why=why)


def risky_in_eight_directions() -> tuple[float, float]:
    """Return how much more risk, and cost, the best way in eight directions has at least on a stored map."""
    scenario = counterexamples.scenario(RISKY)
    risks, costs = [], []
    for lattice in (scenario.lattice, Lattice(N, bounds=BOUNDS)):
        eight, free = (solve(scenario.problem, name, resolution=lattice) for name in ("eight-direction", "cgla"))
        risks.append(eight.risk / free.risk)
        costs.append(eight.cost / free.cost)
    require(min(risks) > RISKIER, f"on {RISKY} eight directions have no longer more than ten times the risk: {risks}")
    return min(risks), min(costs)


def fewest_moves() -> int:
    """Return how many moves are best on a stored map with a large reward: the fewest."""
    scenario = counterexamples.scenario(RISKY)
    fewest = round(max(abs(goal - start) for goal, start in zip(GOALS["diagonal"], START, strict=True)) * N)
    process = decision_process(scenario.problem.on_eight_connected(scenario.lattice), target_reward=ENORMOUS)
    for gamma in DISCOUNTS:
        moves = len(greedy(process, value_iteration(process, gamma=gamma).moves).states) - 1
        require(moves == fewest, f"gamma = {gamma:g}: {moves} moves where {fewest} are the fewest")
    return fewest

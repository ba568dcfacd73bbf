"""Whether UAVs that plan again under way arrive (C17, C19), and what Step 5's exclusion changes (C18)."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from cgla_graph._types import Point
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import FLOWN, Answer, Basis, Finding, Row, claim, flown_at, require
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel.arrivals import EXCLUSION_K, RADIUS, same_trace
from cgla_graph.comparisons.claims.panel.flights import MAX_TICKS
from cgla_graph.comparisons.claims.panel.settings import BOUNDS
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Share, Statement
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus, UavFlight
from cgla_graph.mission.rules import Exclude
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.solvers import get

SNAPPED, LIVELOCK, EXCLUSION = "c17-snapped-livelock.toml", "c19-livelock.toml", "c18-exclusion.toml"
#: Where a UAV arrives: of C17, and of what follows from it.
ARRIVES_WHERE = (
    "holds among static threats planning from its place (exact integrals) or at detections only; "
    "fails every tick from lattice points, with virtual obstacles"
)
AS_C17 = "as C17"
#: What rounding may do to costs of size 1 to 100.
ROUNDING = 1e-9
#: How many moves, in multiples of the points of the graph, there are between two detections.
MOVES_BETWEEN: dict[Exclude, int] = {"none": 1, "last": 2}
#: Rarely is on less than one map in twenty; the bar is ours.
MOSTLY = 0.95
PROOFS = (
    (
        "Proof, plans only where something new is seen: a plan is a way of finite length that ends at the target, and "
        "it is flown to its end or to the next detection. M threats are detected at most once each, so M + 1 plans "
        "lead to the target, from whichever point they begin and however weights are summed."
    ),
    (
        "Proof, a plan on every tick from where the UAV is: the rest of a segment weighs less than the whole, by at "
        "least the length that is left out, and the rest of a plan is one of the ways of the next one. So G at the UAV "
        "falls by a step or more a tick, until something is seen: then it is at most (1 + K) sqrt(2), by the straight "
        "way. So there are at most (M + 1)(1 + (1 + K) sqrt(2) / step) ticks. A raster sum of the rest can exceed that "
        "of the whole, and from the nearest lattice point the way is not the rest of the last plan: both are outside."
    ),
    (
        "Proof, from vertex to vertex: a move along the plan lowers G, which stays until something is seen: no point "
        "comes twice in between. With the previous point y excluded, a move from x that is not optimal means that all "
        "optimal paths of x lead through y, so G(y) < G(x): in a row of such moves G rises. After an optimal move G of "
        "the point left is greater, so its exclusion changes nothing, and all further moves are optimal. With all "
        "visited points excluded, each move takes a new one. The straight way to the target is never lacking."
    ),
)


def _field(rng: np.random.Generator, count: int) -> RiskField:
    """Draw threats anywhere, so wide that a lattice of a few points a side goes around them."""
    places, spreads = rng.random((count, 2)).tolist(), rng.uniform(0.03, 0.1, count).tolist()
    return RiskField([Threat(x, y, spread) for (x, y), spread in zip(places, spreads, strict=True)])


def _mission(rng: np.random.Generator) -> Mission:
    """Draw a mission of one UAV, 4 to 7 lattice points a side, and 3 to 9 unknown threats; it plans on every tick."""
    lattice = Lattice(int(rng.integers(4, 8)), bounds=BOUNDS)
    field = _field(rng, int(rng.integers(3, 10)))
    # of the first row to of the last
    places = lattice.points[[rng.integers(lattice.shape[0]), lattice.n_points - 1 - rng.integers(lattice.shape[0])]]
    start, goal = places.tolist()
    uav = _uav((start[0], start[1]), (goal[0], goal[1]), float(rng.uniform(1.0, 200.0)))
    return Mission(World(field, bounds=BOUNDS), [uav], get("cgla"), lattice, replan="tick", max_ticks=100_000)


def _uav(start: Point, goal: Point, k: float) -> Uav:
    return Uav("a", start, goal, 0.25, k=k)


def _arrived(mission: Mission) -> tuple[UavFlight, int]:
    """Fly a mission of one UAV, assert that it arrives, and count its detections."""
    flight = mission.fly()
    (one,) = flight.uavs.values()
    require(one.status is MissionStatus.ARRIVED, f"a UAV among static threats did not arrive: {one.status.value}")
    return one, sum(event.kind == "detected" for event in flight.events)


def require_bounded_moves(mission: Mission) -> None:
    """Assert that a UAV that flies from vertex to vertex arrives within the moves that the proof allows."""
    one, detections = _arrived(mission)
    most = mission.lattice.n_points - 1
    bound = most if mission.exclude == "all" else (detections + 1) * MOVES_BETWEEN[mission.exclude] * most
    moves = one.ended - one.departed
    require(moves <= bound, f"{moves} moves with exclude={mission.exclude}; the proof allows {bound}")


def require_few_plans(mission: Mission) -> None:
    """Assert that a UAV that plans only where it sees something new arrives by the plans that the proof allows."""
    one, detections = _arrived(mission)
    require(len(one.plans) <= detections + 1, f"{len(one.plans)} plans after {detections} detections")


def require_falling_cost(mission: Mission) -> None:
    """Assert that between detections the cost to go falls by at least a step a tick, and that the UAV arrives."""
    one, _ = _arrived(mission)
    step, costs = mission.step_of(one.uav), []
    for tick, plan in one.plans:
        threats = one.knowledge_at(tick).threats
        at = (float(plan[0, 0]), float(plan[0, 1]))
        problem = Problem(at, one.uav.goal, RiskField(threats.values()), one.uav.k, bounds=mission.world.bounds)
        costs.append((len(threats), problem.evaluate(plan).cost))
    for (known, cost), (known_next, cost_next) in pairwise(costs):
        fallen = cost_next <= cost - step + ROUNDING
        require(known_next > known or fallen, f"the cost to go went from {cost} to {cost_next} in a step of {step}")


def _require_arrivals(rng: np.random.Generator) -> None:
    """Assert the steps of all proofs on one random mission."""
    mission = _mission(rng)
    (uav,) = mission.uavs
    x, y = rng.uniform(0.0, 1.0, 2).tolist()
    # from between the lattice points
    anywhere = replace(mission, uavs=[_uav((x, y), uav.goal, uav.k)])
    require_falling_cost(anywhere)
    require_few_plans(replace(anywhere, replan="change", start="snapped", integral="raster"))
    for exclude in ("none", "last", "all"):
        require_bounded_moves(replace(mission, movement="vertex", exclude=exclude))


def stored_livelocks() -> Sequence[Flight]:
    """Fly the stored livelocks, and assert that they are: plans from lattice points, and virtual obstacles."""
    found = []
    for name, locked in ((SNAPPED, "from the nearest lattice point"), (LIVELOCK, "with virtual obstacles")):
        flights = {variant: mission.fly() for variant, mission in counterexamples.mission(name).missions(get).items()}
        found.append(flights.pop(locked))
        require(all(one.all_arrived for one in flights.values()), f"another variant of {name} no longer arrives")
        require(found[-1].livelock is not None, f"{name} no longer ends in a livelock")
    return found


def _stuck_from_lattice_points(samples: Samples) -> str:
    """Assert that all flights with plans from where the UAV is arrive; say how many others do not, over N and K."""
    exact = samples.where(start="exact")
    require(all(one["arrived"] for one in exact), "a UAV that plans from where it is did not arrive on the panel")
    rates = [
        100.0 * (1.0 - np.mean([one["arrived"] for one in samples.where(start="snapped", **case)]))
        for case in samples.cases("n", "k")
    ]
    return f"{min(rates):.2g} to {max(rates):.2g} % stuck from lattice points"


@claim(
    17,
    "Section 4.2.2, end",
    "A UAV that plans again whenever it detects something always reaches its target: the method converges.",
    "A proof, with its steps asserted on random missions. Flights of the panel with plans on every tick, which begin "
    "where the UAV is or at the nearest lattice point: N = 10 and 20, all K, on all kinds of maps.",
    experiments=("starts-of-plans",),
    settings=FLOWN,
)
def _check_c17(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C17"), evidence.instances(200, 25)
    for _ in range(count):
        _require_arrivals(rng)
    samples = evidence.samples["starts-of-plans"]
    stuck = _stuck_from_lattice_points(samples)
    locked = stored_livelocks()
    plans = sum(len(one.replans) for flight in locked for one in flight.uavs.values())
    from_its_place = len(samples.where(start="exact"))
    why = f"proofs asserted on {count} missions; {from_its_place} from its place arrive; two livelocks are stored"
    return Finding(
        (Row("arrives", Answer.DEPENDS, Basis.COUNTEREXAMPLE, ARRIVES_WHERE, stuck, why=why),),
        notes=(
            *PROOFS,
            f"That each plan converges does not make the flight converge: all {plans} of the stored livelocks do.",
            "Outside of the proofs: threats that move or go away, no-fly areas, Step 5's exclusion in steps.",
        ),
        counterexamples=(SNAPPED, LIVELOCK),
    )


def require_same_without_previous(rng: np.random.Generator) -> int:
    """Assert on a map that is all known that no point of an optimal path needs the one before; return how many."""
    n = int(rng.integers(4, 8))
    graph = GeometricGraph.complete(Lattice(n, bounds=BOUNDS), _field(rng, 6), k=float(rng.uniform(1.0, 100.0)))
    weights = np.array(graph.weight_matrix())
    source, target = 0, n * n - 1
    whole = cost_matrix(GeometricGraph.from_matrix(weights, labels=range(n * n)), target)
    # labels are numbers here
    path = [int(str(label)) for label in whole.path_from(source)]
    for previous, here in pairwise(path[:-1]):
        kept = [node for node in range(n * n) if node != previous]
        rest = GeometricGraph.from_matrix(weights[np.ix_(kept, kept)], labels=kept)
        least = cost_matrix(rest, target).value(here)
        agree = math.isclose(least, whole.value(here), rel_tol=ROUNDING)
        require(agree, f"G({here}) is {whole.value(here)}, and {least} without the point before")
    return max(0, len(path) - 2)


def turns_back(free: UavFlight, bound: UavFlight) -> tuple[int, Point]:
    """Return when two flights part, and the point before, over which the one without exclusion plans to go back."""
    common = min(len(free.trace), len(bound.trace))
    parted = np.flatnonzero((free.trace[:common] != bound.trace[:common]).any(axis=1))
    tick = int(parted[0]) - 1 if len(parted) else common - 1
    x, y = free.trace[tick - 1].tolist()
    over = [(one.plan_at(tick) == (x, y)).all(axis=1).any() for one in (free, bound)]
    require(over == [True, False], f"at tick {tick} of {EXCLUSION}, it is not Step 5 that makes the difference")
    return tick, (x, y)


@claim(
    18,
    "Section 4.2.2, Remark 2",
    "Whether the previous point is excluded from the next plan or not, the result is the same.",
    "A proof for maps that are all known, and a stored flight. How often flights differ: goal on the diagonal, OR 0.2, "
    f"K = {EXCLUSION_K:g}; the UAV flies from lattice point to lattice point, as Step 5 excludes these.",
    experiments=("exclusion",),
    settings=flown_at(EXCLUSION_K, radii=(RADIUS,)),
)
def _check_c18(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C18"), evidence.instances(200, 25)
    points = sum(require_same_without_previous(rng) for _ in range(count))
    free, bound = (one.fly().uavs["a"] for one in counterexamples.mission(EXCLUSION).missions(get).values())
    tick, previous = turns_back(free, bound)
    require(not same_trace(free, bound), f"the two flights of {EXCLUSION} are the same")
    differs = [float(one["differs"]) for one in evidence.samples["exclusion"].records]
    lengths = f"length {free.length:.4g} and {bound.length:.4g}"
    why = f"asserted at {points} points; in {EXCLUSION} tick {tick} leads back over {previous}: {lengths}"
    where = "holds if all threats are known; fails with limited sight"
    size = f"{100.0 * np.mean(differs):.2g} % of flights differ"
    return Finding(
        (Row("the same", Answer.DEPENDS, Basis.COUNTEREXAMPLE, where, size, why=why),),
        notes=(
            "Proof with all known: a path from p1 over the point before, p0, costs A(p1, p0) + G(p0) > G(p1).",
            "After a detection G(p0) may be the lesser one: then the best way may turn back, and Step 5 forbids it.",
        ),
        counterexamples=(EXCLUSION,),
    )


_rarely = partial(
    Statement, measure="arrived", first={}, second=MOSTLY, less=False, test=Share(MOSTLY), size="{} % of flights arrive"
)
_FROM_LATTICE_POINTS = _rarely(
    "rarely stuck, every tick from lattice points",
    factors=("threats", "spread", "goal", "n", "radius", "k"),
    where={"start": "snapped"},
)
_PAIRS = _rarely(
    "rarely stuck, two UAVs with virtual obstacles", factors=("threats", "spread", "course", "obstacle", "n")
)


@claim(
    19,
    "Section 4.2.2, Remark 2",
    "A UAV gets stuck rarely, and, as the weights change, never.",
    "Where flights can be stuck by C17: one UAV with plans on every tick from lattice points, on all kinds of maps; "
    "two UAVs with virtual obstacles, which fly side by side or change places, goal on the diagonal; varied: K and OR.",
    experiments=("starts-of-plans", "pairs-apart"),
    settings=FLOWN,
)
def _check_c19(evidence: Evidence) -> Finding:
    locked = stored_livelocks()
    for flight in locked:
        since = flight.livelock.since if flight.livelock else 0
        moving = all(np.ptp(one.trace[since - 1 :], axis=0).max() > 0.0 for one in flight.uavs.values())
        require(moving, "a UAV of a stored livelock stands still: it does not fly to and fro")
    single = judged(evidence.samples["starts-of-plans"], _FROM_LATTICE_POINTS)
    in_pairs = replace(_PAIRS, factors=(*_PAIRS.factors, *evidence.panel.given("radius", "k")))
    pairs = judged(evidence.samples["pairs-apart"], in_pairs)
    never = Row("never stuck", Answer.DEPENDS, Basis.COUNTEREXAMPLE, AS_C17, why="two stored livelocks")
    return Finding(
        (never, single.row, pairs.row),
        notes=(
            "A livelock is for ever: a mission is a function of its state, so that what comes back once always does.",
            f"Rarely: under {1 - MOSTLY:.0%} of maps, our bar. Pairs in flight after {MAX_TICKS} ticks are stuck.",
        ),
        tables=(panel_table(f"Flights that arrive, against {MOSTLY:.0%}", [single, pairs]),),
        counterexamples=(SNAPPED, LIVELOCK),
    )

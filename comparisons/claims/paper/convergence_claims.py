"""Whether UAVs that plan again on the way ever arrive, and what Remark 2 says of it (C17, C18, C19, C54)."""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np

from cgla_graph._types import Point
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    MOSTLY,
    RADII,
    SHARE_RULE,
    Case,
    Share,
    cell_name,
    share_part,
    share_table,
    shares,
    span,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import experiment
from cgla_graph.comparisons.claims.paper.flights import (
    ARRIVAL_RADIUS,
    BOUNDS,
    GOAL,
    MAX_TICKS,
    RADIUS,
    SAFE_DISTANCE,
    SECOND_START,
    START,
    STEP,
    STEPNUM,
    fly_alone,
    fly_alone_variants,
    fly_variants,
    measures,
    paper_lattice,
)
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, Livelock, MissionStatus, UavFlight
from cgla_graph.mission.rules import Exclude, Movement
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.mission.world import World
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get

#: Risk weight of Step 5's exclusion: at a higher one flights replan more often on ways that turn back.
EXCLUSION_K = 50
#: How flights are held against those without exclusion.
SAME_FLIGHTS = (
    f"{SHARE_RULE} K = 50, a plan on every tick, in steps of 0.02 (where the lattice point next to the UAV is what is "
    "excluded later) or from lattice point to lattice point; two flights differ if they are ever more than rounding "
    "apart. Exact integrals only: on raster integrals a plan with an excluded point takes too long for a sample."
)
#: What else Step 5 may exclude.
EXCLUSIONS: tuple[Exclude, ...] = ("last", "all")
#: By which moves (E16).
MOVEMENTS: tuple[Movement, ...] = ("step", "vertex")
#: How far apart two positions of equal flights may be, map units: rounding only.
SAME_PLACE = 1e-6
LIVELOCK = "c19-livelock.toml"
EXCLUSION = "c18-exclusion.toml"
#: How many moves, in multiples of what one plan may take, there are between two detections (see `PROOFS`).
MOVES_BETWEEN = {"none": 1, "last": 2}
#: What rounding may do to costs of size 1 to 100.
ROUNDING = 1e-9
SWAPPED, PAPER, NO_THREATS = "places changed", "the paper's starts", "places changed, no threats"
#: Pairs of UAVs that keep apart by virtual obstacles: from where to where each of them flies.
COURSES: Mapping[str, tuple[tuple[Point, Point], tuple[Point, Point]]] = {
    # as the stored livelock does, but between the paper's start and goal, which random maps keep clear
    SWAPPED: ((START, GOAL), (GOAL, START)),
    PAPER: ((START, GOAL), (SECOND_START, GOAL)),
    # of the stored livelock
    NO_THREATS: (((0.05, 0.5), (0.95, 0.5)), ((0.95, 0.5), (0.05, 0.5))),
}
#: Spreads of a virtual obstacle, map units, and points a side: those of our other missions, those of the stored
#: livelock, and between.
OBSTACLE_SPREADS = (0.02, 0.03, 0.05)
LIVELOCK_SIZES = (12, 16, 20)
#: How far starts are moved at random along each axis at most, map units: symmetry itself locks nobody.
JITTERS = (0.0, 0.005)
#: Risk weight of the stored livelock, and of all flights that are held against it.
LIVELOCK_K = 50.0
#: Of C17.
PROOFS = (
    (
        "Proof. Weights are positive. Between two detections the weights stay, so along the plan G falls strictly with "
        "every move: no point comes twice, which makes at most N^2 - 1 moves. There are at most M detections. In steps "
        "of 0.02, the rest of the last plan is a candidate of the next one, so G falls by at least the length of a "
        "step."
    ),
    (
        "With the previous point y excluded, a move from x that is not optimal means that all optimal paths of x lead "
        "through y, so G(y) < G(x): in a row of such moves G rises strictly, so they are at most N^2 - 1. After an "
        "optimal move G of the point left is greater, so its exclusion changes nothing, and all further moves are "
        "optimal. As the graph is complete, the direct edge to the target is never lacking; with all visited points "
        "excluded, each move takes a new one."
    ),
)


def fly_excluding(
    field: RiskField, exclude: Exclude, *, movement: Movement = "step", radius: float = RADIUS, k: float = EXCLUSION_K
) -> UavFlight:
    """
    Fly one UAV that plans anew on every tick, as the paper's Step 5 does, without the points that it excludes.

    Parameters
    ----------
    field, radius, k
        As of `fly_from`.
    exclude
        ``none``, the ``last`` lattice point, or ``all`` so far (E17).
    movement
        By a ``step`` of 0.02 a tick, or from lattice point to lattice point, ``vertex`` (E16).

    Examples
    --------
    >>> fly_excluding(RiskField([]), "last").status.label
    'arrived'
    """
    # plans from scratch name the same ones of points in line, whether any are excluded; in steps it does not matter
    how: dict[str, Any] = {"exclude": exclude, "movement": movement, "incremental": movement == "step"}
    return fly_alone(field, k=k, radius=radius, replan="tick", max_ticks=MAX_TICKS, **how)


def same_trace(one: UavFlight, other: UavFlight) -> bool:
    """Return whether two UAVs were in the same place on every tick, but for rounding."""
    return one.trace.shape == other.trace.shape and bool((np.abs(one.trace - other.trace) <= SAME_PLACE).all())


@experiment("exclusion", quick=5, share=0.25)
def sample_exclusion(seed: int) -> list[dict[str, Any]]:
    """Fly without exclusion, and compare with Step 5's and with that of all points visited; exact integrals only."""
    field = random_scenario(seed).problem.field
    records = []
    for movement, radius in product(MOVEMENTS, RADII):
        free = fly_excluding(field, "none", movement=movement, radius=radius)
        for exclude in EXCLUSIONS:
            bound = fly_excluding(field, exclude, movement=movement, radius=radius)
            record = {"integral": "exact", "movement": movement, "radius": radius, "exclude": exclude}
            records.append({**record, "differs": not same_trace(free, bound), **measures(bound)})
    return records


@experiment("livelocks", quick=4, share=0.5)
def sample_livelocks(seed: int) -> list[dict[str, Any]]:
    """Fly two UAVs that keep apart by virtual obstacles, of several spreads and on several lattices."""
    field, rng = random_scenario(seed).problem.field, np.random.default_rng(seed)
    records = []
    for course, jitter in product(COURSES, JITTERS):
        if course == NO_THREATS and not jitter:
            # the same on all maps: see `_stored_over_sizes`
            continue
        moved = rng.uniform(-jitter, jitter, (2, 2)).tolist()
        uavs = [
            Uav(name, (x + dx, y + dy), goal, RADIUS, step=STEP, k=LIVELOCK_K, safe_distance=SAFE_DISTANCE)
            for name, ((x, y), goal), (dx, dy) in zip("ab", COURSES[course], moved, strict=True)
        ]
        for n, spread in product(LIVELOCK_SIZES, OBSTACLE_SPREADS):
            flight = Mission(
                World(RiskField() if course == NO_THREATS else field, bounds=BOUNDS),
                uavs,
                get("cgla"),
                resolution=paper_lattice(n),
                arrival_radius=ARRIVAL_RADIUS,
                virtual_obstacle=VirtualObstacle(stepnum=STEPNUM, spread=spread),
                collisions="record",
                max_ticks=MAX_TICKS,
            ).fly()
            records.append(
                {
                    "course": course,
                    "spread": spread,
                    "n": n,
                    "jitter": jitter,
                    "arrived": flight.all_arrived,
                    "livelock": flight.livelock is not None,
                }
            )
    return records


def _field(rng: np.random.Generator, count: int) -> RiskField:
    """Draw threats anywhere, so wide that a lattice of a few points a side goes around them."""
    places, spreads = rng.random((count, 2)).tolist(), rng.uniform(0.03, 0.1, count).tolist()
    return RiskField([Threat(x, y, spread) for (x, y), spread in zip(places, spreads, strict=True)])


def _mission(rng: np.random.Generator) -> Mission:
    """Draw one UAV from lattice point to lattice point, 4 to 7 of them a side, and 3 to 9 unknown threats."""
    lattice = Lattice(int(rng.integers(4, 8)), bounds=BOUNDS)
    field = _field(rng, int(rng.integers(3, 10)))
    # of the first row to of the last
    places = lattice.points[[rng.integers(lattice.shape[0]), lattice.n_points - 1 - rng.integers(lattice.shape[0])]]
    start, goal = places.tolist()
    uav = Uav("a", (start[0], start[1]), (goal[0], goal[1]), 0.25, k=float(rng.uniform(1.0, 100.0)))
    world = World(field, bounds=lattice.bounds)
    return Mission(world, [uav], get("cgla"), resolution=lattice, replan="tick", max_ticks=100_000)


def _share_of_bound(mission: Mission) -> float:
    """Fly from vertex to vertex, assert that it arrives within the moves that the proof allows; return their share."""
    flight = mission.fly()
    (one,) = flight.uavs.values()
    detections = sum(event.kind == "detected" for event in flight.events)
    moves = one.ended - one.departed
    most = mission.lattice.n_points - 1
    bound = most if mission.exclude == "all" else (detections + 1) * MOVES_BETWEEN[mission.exclude] * most
    require(one.status is MissionStatus.ARRIVED, f"a UAV among static threats did not arrive: {one.status.value}")
    require(moves <= bound, f"{moves} moves with exclude={mission.exclude}; the proof allows {bound}")
    return moves / bound


def _require_falling_cost(mission: Mission) -> None:
    """Assert the step of the proof on a flight of the paper's steps: between detections G falls by a step a tick."""
    (one,) = mission.fly().uavs.values()
    require(one.status is MissionStatus.ARRIVED, f"a UAV among static threats did not arrive: {one.status.value}")
    step, costs = mission.step_of(one.uav), []
    for tick, plan in one.plans:
        threats = one.knowledge_at(tick).threats
        at = (float(plan[0, 0]), float(plan[0, 1]))
        problem = Problem(at, one.uav.goal, RiskField(threats.values()), one.uav.k, bounds=mission.world.bounds)
        costs.append((len(threats), problem.evaluate(plan).cost))
    for (known, cost), (known_next, cost_next) in pairwise(costs):
        fallen = cost_next <= cost - step + ROUNDING
        require(known_next > known or fallen, f"the cost to go went from {cost} to {cost_next} in a step of {step}")


def _livelock() -> tuple[Flight, Livelock]:
    """Fly the stored livelock again, and assert that it is one."""
    flights = fly_variants(counterexamples.mission(LIVELOCK))
    alone, flight = flights["without virtual obstacles"], flights["with virtual obstacles"]
    require(alone.all_arrived, "without virtual obstacles, the UAVs of the counterexample no longer arrive")
    lock = flight.livelock
    require(lock is not None, f"{LIVELOCK} no longer ends in a livelock")
    for one in flight.uavs.values():
        require(one.status is MissionStatus.LIVELOCK, f"UAV {one.name} of {LIVELOCK}: {one.status.value}")
    return flight, lock or Livelock(0, 0)


@claim(
    17,
    "Section 4.2.2, end",
    "A UAV that plans again whenever it detects something always reaches its target: the method converges.",
    "For all static threats, unknown at first, and all starts and targets, the flight ends at the target after "
    "finitely many moves, at most (M + 1)(N^2 - 1).",
    Kind.PROOF,
)
def _check_c17(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C17"), evidence.instances(200, 25)
    worst: dict[Exclude, float] = {"none": 0.0, "last": 0.0, "all": 0.0}
    for _ in range(count):
        mission = _mission(rng)
        _require_falling_cost(mission)
        for exclude, share in worst.items():
            vertices = replace(mission, movement="vertex", exclude=exclude)
            worst[exclude] = max(share, _share_of_bound(vertices))
    flight, lock = _livelock()
    plans = sum(len(one.replans) for one in flight.uavs.values())
    seen = ", ".join(f"{exclude}: {share:.2g}" for exclude, share in worst.items())
    known = (
        f"M threats and N x N points take at most (M + 1)(N^2 - 1) moves, twice that with Step 5's exclusion; asserted "
        f"on {count} random missions"
    )
    never = f"in {LIVELOCK} the flight repeats itself every {lock.period} ticks (C19)"
    return Finding(
        (
            Part("arrives", Verdict.PROVED, known, "with static threats"),
            Part("arrives", Verdict.REFUTED, never, "with virtual obstacles"),
        ),
        "Proved where threats stay as they are and become known one after the other, sudden ones too: M threats and "
        "N x N points take at most (M + 1)(N^2 - 1) moves, twice that with Step 5's exclusion. False as soon as the "
        f"virtual obstacles of Section 5.2.1 are on: there is a flight that repeats itself every {lock.period} ticks.",
        beside=(
            Part(
                "the bound on moves",
                Verdict.PROVED,
                f"share of it that flights from vertex to vertex take, by what is excluded: {seen}; in the paper's "
                "steps, the cost to go falls by at least a step a tick",
            ),
            Part(
                "the argument that each plan converges, and so the flight",
                Verdict.REFUTED,
                f"in {LIVELOCK} all {plans} plans converge, and the flight never ends",
            ),
        ),
        notes=(
            *PROOFS,
            "Threats that move or go away are outside of the proof: what is known no longer only grows.",
        ),
        counterexample=LIVELOCK,
    )


def _require_same_without_previous(rng: np.random.Generator) -> int:
    """Assert on a map that is all known that no point of an optimal path needs the one before; return how many."""
    n = int(rng.integers(4, 8))
    field = _field(rng, 6)
    graph = GeometricGraph.complete(Lattice(n, bounds=BOUNDS), field, k=float(rng.uniform(1.0, 100.0)))
    weights = np.array(graph.weight_matrix())
    source, target = 0, n * n - 1
    whole = cost_matrix(GeometricGraph.from_matrix(weights, labels=range(n * n)), target)
    # labels are numbers here
    path = [int(str(label)) for label in whole.path_from(source)]
    for previous, here in pairwise(path[:-1]):
        kept = [node for node in range(n * n) if node != previous]
        rest = GeometricGraph.from_matrix(weights[np.ix_(kept, kept)], labels=kept)
        least = cost_matrix(rest, target).value(here)
        require(
            math.isclose(least, whole.value(here), rel_tol=ROUNDING),
            f"G({here}) is {whole.value(here)}, and {least} without the point before",
        )
    return max(0, len(path) - 2)


def _the_same(samples: Samples, exclude: str) -> list[Share]:
    """Test in each cell whether exclusion leaves more than `MOSTLY` of all flights as they are."""
    cells = samples.cases("movement", "radius")
    return shares({cell_name(cell): 1.0 - samples.column("differs", exclude=exclude, **cell) for cell in cells})


def _turns_back(free: UavFlight, bound: UavFlight) -> tuple[int, Point]:
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
    "For all maps, flights with and without Step 5's exclusion are in the same place on every tick.",
    Kind.PROOF,
    experiments=("exclusion",),
)
def _check_c18(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C18"), evidence.instances(200, 25)
    points = sum(_require_same_without_previous(rng) for _ in range(count))
    flights = fly_alone_variants(counterexamples.mission(EXCLUSION))
    free, bound = flights["without exclusion"], flights["the previous point excluded"]
    require(not same_trace(free, bound), f"the two flights of {EXCLUSION} are the same")
    tick, previous = _turns_back(free, bound)
    same = {exclude: _the_same(evidence.samples["exclusion"], exclude) for exclude in EXCLUSIONS}
    rates = {name: span([1.0 - one.found.rate for one in found], ".1%") for name, found in same.items()}
    counterexample = (
        f"{EXCLUSION}: at tick {tick} the best way leads back over {previous}, where the UAV was the tick before; "
        f"length {free.length:.4g} and {bound.length:.4g}, risk {free.risk:.3g} and {bound.risk:.3g}"
    )
    return Finding(
        (
            Part(
                "the same",
                Verdict.PROVED,
                f"asserted at {points} points of optimal paths on {count} random maps",
                "if all threats are known",
            ),
            Part(
                "the same",
                Verdict.REFUTED,
                counterexample,
                "with limited sight",
                f"{rates['last']} of flights differ",
            ),
            share_part("as a rule the same", same["last"], condition="with limited sight"),
        ),
        f"On a map that is all known it is so, which is proved; with limited sight it is not: in {EXCLUSION} the "
        f"length goes from {free.length:.3g} to {bound.length:.3g}. On random maps {rates['last']} of flights differ, "
        "by cell.",
        beside=(share_part("as a rule the same, all visited points excluded", same["all"]),),
        tables=tuple(
            share_table(f"Flights that are as those without exclusion: {excluded} excluded", same[name], SAME_FLIGHTS)
            for name, excluded in zip(EXCLUSIONS, ("the previous point", "all visited points"), strict=True)
        ),
        notes=(
            (
                "Proof of the first part: a path from p1 over the point before, p0, costs A(p1, p0) + G(p0), and "
                "G(p0) > G(p1) as p1 follows p0 on an optimal path and weights are positive."
            ),
            "After a detection G(p0) may be the lesser one: then the best way may turn back, and Step 5 forbids it.",
            "Step 5 excludes the previous point; Remark 2 speaks of previous points, so all visited ones stand beside.",
        ),
        counterexample=EXCLUSION,
    )


@claim(
    19,
    "Section 4.2.2, Remark 2",
    "A UAV gets stuck rarely, and, as the weights change, never.",
    "No mission of the paper's rules, virtual obstacles among them, comes back to a state that it was in; few do.",
    Kind.PROOF,
    experiments=("livelocks",),
)
def _check_c19(evidence: Evidence) -> Finding:
    flight, lock = _livelock()
    for one in flight.uavs.values():
        first, again = one.position_at(lock.since), one.position_at(lock.since + lock.period)
        require(first == again, f"UAV {one.name} is at {again} when the state of {first} comes back")
        require(
            np.ptp(one.trace[lock.since - 1 :], axis=0).max() > 0.0,
            f"UAV {one.name} stands still: no flight to and fro",
        )
    return judge_c19(evidence.samples["livelocks"], lock, _stored_over_sizes())


def _stored_over_sizes() -> Table:
    """Fly the stored livelock on other lattices, by other spreads: on its map without threats nothing is random."""
    mission = counterexamples.mission(LIVELOCK).missions(get)["with virtual obstacles"]
    rows: list[list[Entry]] = []
    for n in LIVELOCK_SIZES:
        ends = []
        for spread in OBSTACLE_SPREADS:
            ahead = VirtualObstacle(stepnum=STEPNUM, spread=spread)
            flight = replace(mission, resolution=paper_lattice(n), virtual_obstacle=ahead, max_ticks=MAX_TICKS).fly()
            still = f"flies after {MAX_TICKS} ticks"
            ends.append("arrives" if flight.all_arrived else "livelock" if flight.livelock else still)
        rows.append([n, *ends])
    heads = ("N", *(f"spread {spread:g}" for spread in OBSTACLE_SPREADS))
    return Table("how the stored mission ends, with nothing moved", heads, rows)


def judge_c19(samples: Samples, lock: Livelock, stored: Table) -> Finding:
    """Decide by how often two UAVs get stuck on random maps; that it can be is shown by the stored livelock."""
    cells = samples.cases("course", "spread", "n", "jitter")
    found = shares({_course_name(cell): samples.column("arrived", **cell) for cell in cells})
    locked, lost = (
        sum(bool(one["livelock"]) is is_so for one in samples.records if not one["arrived"]) for is_so in (True, False)
    )

    def among(**case: object) -> list[Share]:
        return [one for cell, one in zip(cells, found, strict=True) if case.items() <= cell.items()]

    swapped = {
        one: among(course=SWAPPED, spread=one) + among(course=NO_THREATS, spread=one) for one in OBSTACLE_SPREADS
    }
    cases = {
        **{f"where two change places, obstacle spread {one:g}": of for one, of in swapped.items()},
        "from the paper's starts": among(course=PAPER),
    }
    stuck = {where: span([1.0 - one.found.rate for one in of], ".1%") for where, of in cases.items()}
    rarely = [
        replace(share_part("rarely stuck", of, condition=where), effect=f"{stuck[where]} of maps")
        for where, of in cases.items()
    ]
    never = f"{LIVELOCK}: the whole state of tick {lock.since} comes back at tick {lock.since + lock.period}"
    return Finding(
        (
            Part(
                "never stuck", Verdict.PROVED, "the flight ends after finitely many moves (C17)", "with static threats"
            ),
            Part("never stuck", Verdict.REFUTED, never, "with virtual obstacles"),
            *rarely,
        ),
        "Among static threats nobody is stuck (C17). With virtual obstacles two UAVs that change places can fly to and "
        f"fro for ever: the whole state of tick {lock.since} comes back at tick {lock.since + lock.period}. Stuck, "
        f"by map, lattice and start: {'; '.join(f'{where}, {rate}' for where, rate in stuck.items())}.",
        tables=(
            stored,
            share_table(
                "Maps on which both UAVs arrive",
                found,
                f"Rarely: on fewer than {1 - MOSTLY:.0%} of maps, the bar of all claims of this kind. " + SHARE_RULE,
            ),
        ),
        notes=(
            (
                "Why it is for ever: a mission without losses on the radio is a function of its state (positions, "
                "headings, what is known, plans), so a state that comes back once comes back again and again."
            ),
            (
                "The stored mission, without threats, is locked for some N and some spreads only (table). Remark 2 "
                "speaks of a rare chance first, and then of none: both are judged."
            ),
            (
                "That those who fly on without coming back to a state count as stuck, and that maps without threats "
                "count, was settled on a first few of these maps."
            ),
            f"Where the starts are moved by up to {JITTERS[-1]} along each axis: {_freed(samples)}.",
            (
                f"Virtual obstacles {STEPNUM} steps ahead within SD = {SAFE_DISTANCE}, OR = {RADIUS}, "
                f"K = {LIVELOCK_K:g}. Stuck is who does not arrive within {MAX_TICKS} ticks: {locked} flights whose "
                f"state came back, and {lost} others."
            ),
        ),
        counterexample=LIVELOCK,
    )


def _course_name(cell: Case) -> str:
    starts = "starts moved" if cell["jitter"] else "as they are"
    return f"{cell['course']}, spread {cell['spread']:g}, N = {cell['n']}, {starts}"


def _freed(samples: Samples) -> str:
    """Say how many of those that are stuck are freed by a start that is moved."""
    stuck, freed = 0, 0
    for cell in (one for one in samples.cases("course", "spread", "n") if one["course"] != NO_THREATS):
        exact, moved = (samples.column("arrived", jitter=jitter, **cell) for jitter in JITTERS)
        held = (exact == 0.0) & np.isfinite(moved)
        stuck, freed = stuck + int(held.sum()), freed + int((held & (moved == 1.0)).sum())
    return f"moving the starts frees {freed} of the {stuck} pairs that are stuck without"


@claim(
    54,
    "Section 4.2.2, Remark 2",
    "The weights change at random under way, so that nobody is caught in a loop.",
    "In no flight do all weights come back to what they were; in none is a UAV caught in a loop.",
    Kind.PROOF,
)
def _check_c54(_: Evidence) -> Finding:
    flight, lock = _livelock()
    for one in flight.uavs.values():
        # the flight ends as soon as a state is back, before it is planned on again
        now, later, again = (one.obstacles_at(lock.since - 1 + wait) for wait in (0, 1, lock.period))
        require(now == again, f"UAV {one.name} of {LIVELOCK} plans by other weights after a period")
        require(now != later, f"the weights of UAV {one.name} of {LIVELOCK} do not change at all")
    loop = f"in {LIVELOCK} the weights change on every tick and come back every {lock.period} ticks, and so do the UAVs"
    return Finding(
        (
            Part("weights change at random", Verdict.REFUTED, loop, "as Eqs 1, 2 and 5 define them"),
            Part("nobody is caught", Verdict.REFUTED, loop, "with virtual obstacles"),
            Part(
                "nobody is caught",
                Verdict.PROVED,
                "by the argument of C17, in which weights change by detections only, and nothing is random",
                "with static threats",
            ),
        ),
        "A weight is a function of two points and of what is known: it changes where something is seen, or where a "
        f"virtual obstacle moves, and nothing is drawn. In {LIVELOCK} all weights come back every {lock.period} ticks, "
        "which frees nobody. Among static threats nobody is caught, whether or not anything is random (C17).",
        notes=(
            (
                "What the method leaves open, which point of Delta_k serves as p_r and which of several best moves is "
                "taken, changes neither a weight nor G (C11, C12)."
            ),
            (
                "If random means that nobody foresees what is detected, the first half is no statement about a "
                "program; the second stays as it is."
            ),
            "A radio that loses messages is drawn from a seed in this toolkit, and is no part of the paper.",
        ),
        counterexample=LIVELOCK,
    )

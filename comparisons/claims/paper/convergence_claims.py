"""Whether UAVs that plan again on the way ever arrive, and what Remark 2 says of it (C17, C18, C19, C54)."""

import hashlib
import math
import os
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise, product
from typing import Any

import numpy as np

from cgla_graph._types import Point
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import RADII, cell_name, span
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import experiment
from cgla_graph.comparisons.claims.inference import Proportion, proportion
from cgla_graph.comparisons.claims.paper.flights import (
    BOUNDS,
    MAX_TICKS,
    RADIUS,
    STEPNUM,
    fly_alone,
    fly_alone_variants,
    fly_two,
    fly_variants,
    measures,
)
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, Livelock, MissionStatus, UavFlight
from cgla_graph.mission.rules import Exclude, Movement
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get

#: Risk weight of Step 5's exclusion: at a higher one flights replan more often on ways that turn back.
EXCLUSION_K = 50
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
#: Hash seeds of Python with which the flights of C54 are flown again.
HASH_SEEDS = (0, 1, 4242)
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


@experiment("exclusion", quick=6, share=0.5)
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
    shares = ", ".join(f"{exclude}: {share:.2g}" for exclude, share in worst.items())
    return Finding(
        Verdict.PROVED,
        "Proved where threats stay as they are and become known one after the other: M threats and N x N points take "
        "at most (M + 1)(N^2 - 1) moves, twice that with Step 5's exclusion. False as soon as the virtual obstacles of "
        f"Section 5.2.1 are on: there is a flight that repeats itself every {lock.period} ticks (C19).",
        parts=(
            Part(
                "Static threats, nothing excluded: the target is reached within (M + 1)(N^2 - 1) moves.",
                Verdict.PROVED,
                f"asserted on {count} random missions, in the paper's steps (cost to go falls by at least a step a "
                f"tick) and from vertex to vertex (at most {worst['none']:.2g} of the moves that the bound allows)",
            ),
            Part(
                "The same with the previous point excluded (Step 5), or all points visited (Remark 2).",
                Verdict.PROVED,
                f"at most 2 (M + 1)(N^2 - 1) moves, or N^2 - 1; seen as a share of the bound: {shares}",
            ),
            Part(
                "The paper's argument: as each plan converges, so does the whole flight.",
                Verdict.REFUTED,
                f"in {LIVELOCK} all {plans} plans converge, and the flight never ends",
            ),
        ),
        notes=(
            *PROOFS,
            "Threats that move or go away are outside of the proof: what is known no longer only grows.",
        ),
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


def _how_often_different(samples: Samples) -> list[tuple[str, str, Proportion]]:
    """Count flights that exclusion changes, by what is excluded and cell."""
    return [
        (exclude, cell_name(cell), proportion(samples.column("differs", exclude=exclude, **cell)))
        for exclude in EXCLUSIONS
        for cell in samples.cases("movement", "radius")
    ]


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
    found = _how_often_different(evidence.samples["exclusion"])
    shares = {name: [one.rate for exclude, _, one in found if exclude == name] for name in EXCLUSIONS}
    rates = "; ".join(f"{name} excluded: {span(of)} of flights" for name, of in shares.items())
    table = Table(
        "Flights that differ from those without exclusion",
        ("excluded", "cell", "differ", "maps", "share", "95 % from", "to"),
        [(exclude, cell, one.count, one.n, one.rate, *one.interval) for exclude, cell, one in found],
        "K = 50, a plan on every tick, in steps of 0.02 (where the lattice point next to the UAV is what is excluded "
        "later) or from lattice point to lattice point; two flights differ if they are ever more than rounding apart. "
        "Exact integrals only: on raster integrals a plan with an excluded point takes too long for a sample.",
    )
    return Finding(
        Verdict.REFUTED,
        f"On a map that is all known it is so, which is proved; with limited sight it is not: in {EXCLUSION} the "
        f"length goes from {free.length:.3g} to {bound.length:.3g}. On random maps: {rates}.",
        parts=(
            Part(
                "With all threats known, the previous point makes no difference.",
                Verdict.PROVED,
                f"asserted at {points} points of optimal paths on {count} random maps",
            ),
            Part(
                "With limited sight, the flights with and without exclusion are the same.",
                Verdict.REFUTED,
                f"{EXCLUSION}: at tick {tick} the best way leads back over {previous}, where the UAV was the tick "
                f"before; length {free.length:.4g} and {bound.length:.4g}, risk {free.risk:.3g} and {bound.risk:.3g}; "
                f"{rates}",
            ),
        ),
        tables=(table,),
        notes=(
            (
                "Proof of the first part: a path from p1 over the point before, p0, costs A(p1, p0) + G(p0), and "
                "G(p0) > G(p1) as p1 follows p0 on an optimal path and weights are positive."
            ),
            "After a detection G(p0) may be the lesser one: then the best way may turn back, and Step 5 forbids it.",
        ),
        counterexample=EXCLUSION,
    )


@claim(
    19,
    "Section 4.2.2, Remark 2",
    "A UAV never gets stuck.",
    "No mission of the paper's rules, virtual obstacles among them, comes back to a state that it was in.",
    Kind.PROOF,
)
def _check_c19(_: Evidence) -> Finding:
    flight, lock = _livelock()
    for one in flight.uavs.values():
        first, again = one.position_at(lock.since), one.position_at(lock.since + lock.period)
        require(first == again, f"UAV {one.name} is at {again} when the state of {first} comes back")
        require(
            np.ptp(one.trace[lock.since - 1 :], axis=0).max() > 0.0,
            f"UAV {one.name} stands still: no flight to and fro",
        )
    return Finding(
        Verdict.REFUTED,
        f"Two UAVs that change places and keep apart by virtual obstacles fly to and fro for ever: the whole state of "
        f"tick {lock.since} comes back at tick {lock.since + lock.period}.",
        notes=(
            (
                "Why it is for ever: a mission without losses on the radio is a function of its state (positions, "
                "headings, what is known, plans), so a state that comes back once comes back again and again."
            ),
            "Without virtual obstacles the remark holds for static threats (C17).",
        ),
        counterexample=LIVELOCK,
    )


def digest(flights: Iterable[Flight]) -> str:
    """
    Return a checksum of all positions of flights, to the last bit.

    Examples
    --------
    >>> digest([fly_two(RiskField())]) == digest([fly_two(RiskField())])
    True
    """
    found = hashlib.sha256()
    for one in (one for flight in flights for one in flight.uavs.values()):
        found.update(one.status.label.encode() + one.trace.tobytes() + one.path.tobytes())
    return found.hexdigest()


def digest_of(seeds: Iterable[int]) -> str:
    """Return the checksum of the stored livelock and of two UAVs with sharing and virtual obstacles on random maps."""
    drawn = [fly_two(random_scenario(seed).problem.field, sharing="global", stepnum=STEPNUM) for seed in seeds]
    return digest([*fly_variants(counterexamples.mission(LIVELOCK)).values(), *drawn])


def _digest_elsewhere(seeds: range, hash_seed: int) -> str:
    """Return the same from a fresh process, whose sets and dictionaries hash with another seed."""
    program = f"from {__name__} import digest_of; print(digest_of({seeds!r}))"
    done = subprocess.run(  # noqa: S603 - this very interpreter, a program made of numbers
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONHASHSEED": str(hash_seed)},
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout.strip()


@claim(
    54,
    "Section 4.2.2, Remark 2",
    "The weights change at random under way, so that nobody is caught in a loop.",
    "Two flights of the same mission may differ.",
    Kind.PROOF,
)
def _check_c54(evidence: Evidence) -> Finding:
    seeds = evidence.scale.map_seeds(evidence.instances(20, 2))
    here = digest_of(seeds)
    for hash_seed in HASH_SEEDS:
        there = _digest_elsewhere(seeds, hash_seed)
        require(there == here, f"flights of another process (hash seed {hash_seed}) differ: {there} and {here}")
    _, lock = _livelock()
    return Finding(
        Verdict.REFUTED,
        f"Nothing in the method is drawn at random: {len(seeds) + 2} missions flown in {len(HASH_SEEDS) + 1} processes "
        f"agree in every bit of every position. In {LIVELOCK} the weights change with period {lock.period}, which "
        "frees nobody.",
        notes=(
            "Randomness would have to be added: the paper's steps are a function of the map and of what is seen.",
            "A radio that loses messages is drawn from a seed in this toolkit, and is no part of the paper.",
        ),
        counterexample=LIVELOCK,
    )

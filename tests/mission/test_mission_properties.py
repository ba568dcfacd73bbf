"""Properties of missions: arrival, knowledge, separation, symmetry, scale."""

import dataclasses
import math
from collections.abc import Iterator
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import examples, few

import cgla_graph as cg
from cgla_graph._types import FloatArray, Point
from cgla_graph.errors import MissionError
from cgla_graph.mission import replanner, simulation
from cgla_graph.mission.avoidance import plan_around
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus, UavFlight
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.motion.space_time import Others, SpaceTimePlan, SpaceTimeStatus
from cgla_graph.solvers.exact import cgla
from cgla_graph.testing.strategies import seeds

CGLA = cg.solvers.get("cgla")


def scattered(seed: int, *, n_uavs: int, n_threats: int = 6, **settings: Any) -> Mission:  # noqa: ANN401 - any setting
    """Draw a mission in general position, so that no ties decide: UAVs start and end far enough from each other."""
    rng = np.random.default_rng(seed)
    threats = [Threat(*rng.uniform(0.1, 0.9, 2).tolist(), spread=rng.uniform(0.03, 0.09)) for _ in range(n_threats)]
    ends: list[Point] = []
    while len(ends) < 2 * n_uavs:
        x, y = rng.uniform(0.02, 0.98, 2).tolist()
        if all(math.dist((x, y), other) > 0.15 for other in ends):
            ends.append((x, y))
    uavs = [
        Uav(f"u{i}", ends[2 * i], ends[2 * i + 1], 0.22, k=float(rng.uniform(1.0, 40.0)), safe_distance=0.1)
        for i in range(n_uavs)
    ]
    return Mission(World(RiskField(threats)), uavs, **{"solver": CGLA, "resolution": 8, **settings})


def over_people(mission: Mission, seed: int) -> Mission:
    """Lay a raster under a mission."""
    values = 10.0 ** np.random.default_rng(seed).uniform(-2.0, 0.0, (6, 9))
    raster = cg.RasterRisk(values, mission.world.bounds, interpolation=["bilinear", "nearest"][seed % 2])
    world = dataclasses.replace(mission.world, field=RiskField(mission.world.field.threats, rasters=[raster]))
    return dataclasses.replace(mission, world=world)


def moved(mission: Mission, place: Any, scale: float = 1.0) -> Mission:  # noqa: ANN401 - a function of points
    """Return the same mission with every point moved by `place`, and every length scaled."""

    def threat(one: Threat) -> Threat:
        return Threat(*place((one.x, one.y)), spread=scale * one.spread, peak=one.peak)

    uavs = [
        dataclasses.replace(
            uav,
            start=place(uav.start),
            goal=place(uav.goal),
            detection_radius=scale * uav.detection_radius,
            safe_distance=scale * uav.safe_distance,
        )
        for uav in mission.uavs
    ]
    world = World(RiskField([threat(one) for one in mission.world.field.threats]), bounds=(0.0, 0.0, scale, scale))
    in_units: dict[str, None] = dict.fromkeys(["collision_distance", "terminal_radius"])
    return dataclasses.replace(mission, world=world, uavs=uavs, **in_units)


def assert_same_but_moved(flight: Flight, other: Flight, place: Any, scale: float = 1.0) -> None:  # noqa: ANN401
    for name, one in flight.uavs.items():
        twin = other.uavs[name]
        assert (one.status, one.ended, one.replans) == (twin.status, twin.ended, twin.replans)
        assert np.array([place(spot) for spot in one.trace.tolist()]) == pytest.approx(twin.trace, abs=1e-6 * scale)
        assert scale * one.cost == pytest.approx(twin.cost, rel=1e-6)


@few
@given(seeds, st.integers(1, 3), st.booleans())
def test_with_static_threats_every_uav_arrives_within_the_bound(seed: int, n_uavs: int, shared: bool) -> None:
    """C17: between two detections it follows one plan, whose length is at most (1 + k) times the straight distance."""
    mission = scattered(seed, n_uavs=n_uavs, sharing=Sharing(is_on=shared), collisions="record", max_ticks=100_000)
    flight = mission.fly()
    n_threats = len(mission.world.field)
    for one in flight.uavs.values():
        assert one.status is MissionStatus.ARRIVED
        assert len(one.replans) <= n_threats + 1
        longest = math.ceil((1.0 + one.uav.k) * math.sqrt(2.0) / mission.step_of(one.uav))
        assert one.ended <= (n_threats + 1) * longest


@few
@given(seeds)
def test_from_vertex_to_vertex_it_takes_at_most_as_many_moves_as_c17_says(seed: int) -> None:
    mission = scattered(seed, n_uavs=1, n_threats=8, movement="vertex", replan="tick", max_ticks=100_000)
    (flight,) = mission.fly().uavs.values()
    assert flight.status is MissionStatus.ARRIVED
    n_nodes = mission.lattice.n_points + 2
    assert flight.ended <= (len(flight.knowledge_at(flight.ended).threats) + 1) * (n_nodes - 1)


@few
@given(seeds)
def test_between_detections_the_cost_to_go_falls_with_every_tick(seed: int) -> None:
    """The argument of C17: G of the position falls strictly as long as nothing new is known."""
    mission = scattered(seed, n_uavs=1, replan="tick")
    flight = next(iter(mission.fly().uavs.values()))
    costs: list[tuple[int, float]] = []
    for tick, plan in flight.plans:
        known = RiskField(flight.knowledge_at(tick).threats.values())
        problem = Problem((*plan[0].tolist(),), flight.uav.goal, known, flight.uav.k)  # type: ignore[arg-type]
        costs.append((len(known), problem.evaluate(plan).cost))
    for (known, cost), (known_next, cost_next) in pairwise(costs):
        assert known_next > known or cost_next < cost


def test_two_uavs_that_change_places_lock_each_other_without_end() -> None:
    """C19: "getting stuck never happens" is false; the joint state of tick 12 comes back at tick 14."""
    lattice = Lattice(12, bounds=(0, 0, 1, 1), kind="upper")
    east, west = Uav("e", (0.05, 0.5), (0.95, 0.5), 0.2, k=50.0), Uav("w", (0.95, 0.5), (0.05, 0.5), 0.2, k=50.0)
    rule = VirtualObstacle(stepnum=3, spread=0.05)
    mission = Mission(World(), [east, west], CGLA, resolution=lattice, virtual_obstacle=rule)
    flight = mission.fly()
    assert [one.status for one in flight.uavs.values()] == [MissionStatus.LIVELOCK] * 2
    assert flight.livelock is not None
    assert (flight.livelock.since, flight.livelock.period) == (12, 2)
    # the proof, independently: from that state on, the flight without the check repeats itself
    under_way = mission.simulate()
    under_way._find_livelock = lambda: None  # type: ignore[method-assign]
    for _ in range(60):
        under_way.advance()
    for one in under_way.flight(interrupted=True).uavs.values():
        assert np.array_equal(one.trace[13:-2], one.trace[15:])
        assert not np.array_equal(one.trace[13], one.trace[14])
    # planning in space and time finds the way past
    around = dataclasses.replace(mission, virtual_obstacle=None, avoidance="prioritized").fly()
    assert around.all_arrived
    assert around.least_separation >= 0.1


@few
@given(seeds, st.integers(2, 3))
def test_with_sharing_every_uav_knows_all_sightings(seed: int, n_uavs: int) -> None:
    """C43: with sharing, what a UAV knows is the union of all sightings so far, its own among them."""
    flight = scattered(seed, n_uavs=n_uavs, sharing="global", collisions="record").fly()
    seen: dict[int, set[int]] = {}
    for event in flight.events:
        if event.kind == "detected":
            seen.setdefault(event.tick, set()).add(event.detail["threat"])
    for one in flight.uavs.values():
        for tick in range(one.ended):
            by_all = set().union(*(numbers for when, numbers in seen.items() if when <= tick))
            assert set(one.knowledge_at(tick).threats) == by_all


@few
@given(seeds, st.floats(0.05, 0.5), st.integers(0, 3), st.sampled_from([0.0, 0.4]))
def test_all_knowledge_comes_from_sightings_and_messages(seed: int, radius: float, delay: int, loss: float) -> None:
    flight = scattered(
        seed, n_uavs=3, sharing=Sharing(radius=radius, delay=delay, loss=loss, seed=seed), collisions="record"
    ).fly()
    known: dict[str, set[int]] = {name: set() for name in flight.uavs}
    for event in flight.events:
        if event.kind == "detected":
            known[event.uav].add(event.detail["threat"])
        if event.kind == "learned":
            sent = event.tick - delay
            sender, receiver = (flight.uavs[name] for name in (event.detail["source"], event.uav))
            assert math.dist(_place(sender, sent), _place(receiver, sent)) <= radius
            known[event.uav].add(event.detail["threat"])
    for name, one in flight.uavs.items():
        assert set(one.knowledge_at(flight.ticks).threats) == known[name]


def _place(flight: UavFlight, tick: int) -> Point:
    """Return where a UAV is when it sends: before it moves."""
    x, y = flight.trace[min(tick, len(flight.trace) - 1)].tolist()
    return x, y


@few
@given(seeds, st.sampled_from(["cgla", "dijkstra", "eight-direction", "networkx"]))
def test_with_full_knowledge_the_flight_is_the_offline_optimum_of_its_solver(seed: int, solver: str) -> None:
    mission = scattered(seed, n_uavs=1, knowledge="all", solver=cg.solvers.get(solver))
    flight = mission.fly()
    (one,) = flight.uavs.values()
    problem = Problem(one.uav.start, one.uav.goal, mission.world.field, one.uav.k)
    offline = cg.solve(problem, solver, resolution=8)
    assert one.cost == pytest.approx(offline.cost, rel=1e-9)
    assert one.length == pytest.approx(offline.length, rel=1e-9)
    assert flight.price_of_ignorance == {one.name: 1.0}


@few
@given(seeds)
def test_threats_out_of_sight_change_nothing(seed: int) -> None:
    mission = scattered(seed, n_uavs=2, collisions="record")
    flight = mission.fly()
    rng = np.random.default_rng(seed)
    far = [
        Threat(*spot, spread=0.05)
        for spot in rng.uniform(0.0, 1.0, (20, 2)).tolist()
        if min(math.dist(spot, at) for one in flight.uavs.values() for at in one.trace.tolist()) > 0.22 + 1e-9
    ]
    assume(far)
    world = World(mission.world.field, timed=[TimedThreat(threat) for threat in far])
    other = dataclasses.replace(mission, world=world).fly()
    for name, one in flight.uavs.items():
        assert np.array_equal(one.path, other.uavs[name].path)
    # (the risk at the start has the tails of all threats in it)
    logs = [[event.document() for event in one.events if event.kind != "started-in-risk"] for one in (flight, other)]
    assert logs[0] == logs[1]


@pytest.mark.parametrize(
    ("place", "scale"),
    [
        (lambda spot: (1000.0 * spot[0], 1000.0 * spot[1]), 1000.0),
        (lambda spot: (spot[1], spot[0]), 1.0),
        (lambda spot: (1.0 - spot[0], spot[1]), 1.0),
    ],
    ids=["in metres", "swapped", "flipped"],
)
@few
@given(seeds, st.sampled_from([None, VirtualObstacle()]))
def test_moved_missions_are_moved_flights(place: Any, scale: float, seed: int, rule: VirtualObstacle | None) -> None:  # noqa: ANN401
    mission = scattered(seed, n_uavs=2, collisions="record", virtual_obstacle=rule, max_ticks=300)
    assert_same_but_moved(mission.fly(), moved(mission, place, scale).fly(), place, scale)


@pytest.mark.parametrize("rasters", [False, True])
@few
@given(seeds, st.integers(1, 3), st.sampled_from([None, VirtualObstacle()]), st.sampled_from(["cgla", "dijkstra"]))
def test_repairing_gives_the_same_flight_as_planning_from_scratch(
    rasters: bool, seed: int, n_uavs: int, rule: VirtualObstacle | None, solver: str
) -> None:
    mission = scattered(
        seed, n_uavs=n_uavs, solver=cg.solvers.get(solver), virtual_obstacle=rule, collisions="record", max_ticks=150
    )
    mission = over_people(mission, seed) if rasters else mission
    flight, scratch = mission.fly(), dataclasses.replace(mission, incremental=False).fly()
    assert_same_but_moved(flight, scratch, lambda spot: spot)


@examples(8)
@given(seeds)
def test_rasters_are_known_from_the_start(seed: int) -> None:
    """Without threats nothing is left to see: one plan, which is flown."""
    mission = over_people(scattered(seed, n_uavs=1, n_threats=0), seed)
    (one,) = mission.fly().uavs.values()
    assert one.status is MissionStatus.ARRIVED
    assert len(one.plans) == 1
    known = Problem(one.uav.start, one.uav.goal, mission.world.field, one.uav.k)
    on = known.on_lattice(mission.lattice)
    assert known.evaluate(one.path).cost == pytest.approx(cg.solve(on, "cgla").cost, rel=1e-6)
    assert one.risk == pytest.approx(known.evaluate(one.path).risk, rel=1e-9)


@pytest.mark.parametrize("setting", [{"fusion": "max_integral"}, {"integral": "raster"}])
def test_other_readings_of_the_weights_take_no_rasters(setting: dict[str, Any]) -> None:
    with pytest.raises(MissionError, match=r"rasters, .* threats alone"):
        over_people(scattered(1, n_uavs=2, **setting), 1)


def samples(flight: Flight) -> Iterator[tuple[str, str, float]]:
    """Sample the distances of all pairs 200 times a tick, from the flown waypoints alone."""
    times = np.arange(0.0, flight.ticks, 0.005)

    def positions(one: UavFlight) -> FloatArray:
        there = np.column_stack([np.interp(times, one.times, one.path[:, axis]) for axis in (0, 1)])
        there[(times < one.times[0]) | (times > one.times[-1])] = np.nan
        return there

    places = {name: positions(one) for name, one in flight.uavs.items()}
    for first, second in combinations(places, 2):
        apart = np.hypot(*(places[first] - places[second]).T)
        if np.isfinite(apart).any():
            yield first, second, float(np.nanmin(apart))


@few
@given(seeds, st.integers(2, 5), st.booleans())
def test_prioritized_uavs_are_never_closer_than_the_safe_distance(seed: int, n_uavs: int, moving: bool) -> None:
    mission = scattered(seed, n_uavs=n_uavs, avoidance="prioritized", terminal_radius=0.0)
    if moving:
        # threats that appear while all are in flight, and so plan again
        rng = np.random.default_rng(seed)
        popups = [
            TimedThreat(Threat(*rng.uniform(0.2, 0.8, 2).tolist(), spread=0.08), appears=int(tick))
            for tick in rng.integers(1, 15, 4)
        ]
        world = World(mission.world.field, timed=popups)
        mission = dataclasses.replace(mission, world=world, knowledge="all")
    flight = mission.fly()
    assert flight.least_separation >= 0.1
    for _, _, distance in samples(flight):
        assert distance >= 0.1 * (1.0 - 1e-9)
    for one in flight.uavs.values():
        assert one.status in {MissionStatus.ARRIVED, MissionStatus.NO_PATH}
        if one.status is MissionStatus.NO_PATH:
            assert "safe distances" in one.message


@few
@given(seeds, st.integers(2, 4))
def test_the_least_separation_is_that_of_the_flown_paths(seed: int, n_uavs: int) -> None:
    flight = scattered(seed, n_uavs=n_uavs, collisions="record", terminal_radius=0.0).fly()
    found = {(pair.first, pair.second): pair.distance for pair in flight.separations}
    for first, second, distance in samples(flight):
        assert found[first, second] <= distance + 1e-9
        assert found[first, second] == pytest.approx(distance, abs=0.002)


def test_a_uav_without_a_new_plan_around_the_others_keeps_the_last_one_and_the_distance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Searches fail from tick 1 on; every UAV flies on along a plan that all others planned around."""

    def fails_later(problem: Problem, matrix: Any, others: Others, tick: int, *rest: float) -> SpaceTimePlan:  # noqa: ANN401
        if tick == 0:
            return plan_around(problem, matrix, others, tick, *rest)
        return SpaceTimePlan(SpaceTimeStatus.NOT_FOUND, message="out of luck")

    monkeypatch.setattr(simulation, "plan_around", fails_later)
    kept = 0
    for seed in range(12):
        mission = scattered(seed, n_uavs=5, avoidance="prioritized", terminal_radius=0.0)
        flight = mission.fly()
        kept += sum(event.kind == "kept" for event in flight.events)
        assert flight.least_separation >= 0.1
        for _, _, distance in samples(flight):
            assert distance >= 0.1 * (1.0 - 1e-9)
    assert kept > 0


def test_a_uav_that_would_take_off_too_close_to_another_waits() -> None:
    world = World()
    first = Uav("first", (0.1, 0.5), (0.9, 0.5), 0.3, safe_distance=0.15)
    late = Uav("late", (0.5, 0.55), (0.5, 0.9), 0.3, safe_distance=0.15, departs=20)
    flight = Mission(world, [first, late], CGLA, avoidance="prioritized").fly()
    assert flight.uavs["first"].position_at(20) == pytest.approx((0.5, 0.5))
    assert flight.all_arrived
    assert flight.uavs["late"].departed > 20
    assert 0.15 <= flight.least_separation < 0.2
    early = dataclasses.replace(late, departs=30)
    assert Mission(world, [first, early], CGLA, avoidance="prioritized").fly().all_arrived


@pytest.mark.slow
@few
@given(seeds)
def test_restricted_plans_fly_as_repaired_ones(seed: int) -> None:
    """On lattices too large to keep all of G up to date, each plan is an optimum of its own, of the same cost."""
    mission = scattered(seed, n_uavs=1, resolution=20)
    with pytest.MonkeyPatch.context() as patch:
        whole = mission.fly()
        for module in (replanner, cgla):
            patch.setattr(module, "FULL_UP_TO", 100)
        restricted = mission.fly()
    one, other = (flight.uavs["u0"] for flight in (whole, restricted))
    assert other.status is one.status is MissionStatus.ARRIVED
    assert len(one.replans) == len(other.replans)
    np.testing.assert_allclose(other.trace, one.trace, atol=1e-9)

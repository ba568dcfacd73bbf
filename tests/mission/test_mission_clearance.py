"""Missions with a clearance from known areas."""

import dataclasses
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import event, given, reject
from hypothesis import strategies as st
from strategies import few

import cgla_graph as cg
from cgla_graph._types import FloatArray, Point
from cgla_graph.errors import CglaError, MissionError
from cgla_graph.mission import simulation
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus, UavFlight
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.testing.strategies import seeds
from cgla_graph.timed.timed_area import TimedArea, union_of

CGLA = cg.solvers.get("cgla")
WALL = shapely.box(0.45, 0.3, 0.55, 0.7)
EAST = Uav("a", (0.1, 0.5), (0.9, 0.5), 0.3, k=0.0)
#: A distance is rounded by so much, on the unit square.
ROUNDING = 3e-9
#: How missions plan: on the repaired cost matrix, from scratch, on all weights, in the plane, tick by tick, in time.
WAYS: dict[str, dict[str, Any]] = {
    "repaired": {},
    "scratch": {"incremental": False},
    "weights": {"solver": cg.solvers.get("dijkstra")},
    "raster sums": {"integral": "raster"},
    "fused": {"solver": cg.solvers.get("dijkstra"), "fusion": "max_integral"},
    "snapped": {"start": "snapped"},
    "every tick": {"replan": "tick"},
    "vertex": {"movement": "vertex"},
    "plane": {"solver": cg.solvers.get("visibility-graph")},
    "stepper": {"solver": cg.solvers.get("bcv-style")},
    "prioritized": {"avoidance": "prioritized"},
}


def scattered(seed: int, clearance: float, **settings: Any) -> Mission:  # noqa: ANN401 - any setting
    """Draw two UAVs among threats and areas, half of them on the chart; areas may come up anywhere, at any time."""
    rng = np.random.default_rng(seed)
    areas = []
    while len(areas) < 5:
        x, y = rng.uniform(0.15, 0.8, 2)
        box = shapely.box(x, y, x + rng.uniform(0.03, 0.15), y + rng.uniform(0.03, 0.15))
        areas.append(shapely.affinity.rotate(box, rng.uniform(0.0, 90.0)) if rng.random() < 0.5 else box)
    timed = [TimedArea(area, int(rng.integers(0, 25))) for area in areas[2:]]
    threats = [Threat(*rng.uniform(0.1, 0.9, 2).tolist(), spread=rng.uniform(0.03, 0.09)) for _ in range(2)]
    world = World(RiskField(threats), no_fly=shapely.GeometryCollection(areas[:2]), timed=timed)
    radius = rng.uniform(0.1, 0.25)
    uavs = [
        Uav("a", (0.05, rng.uniform(0.05, 0.45)), (0.95, rng.uniform(0.55, 0.95)), radius, k=rng.uniform(0.0, 20.0)),
        Uav("b", (0.05, rng.uniform(0.55, 0.95)), (0.95, rng.uniform(0.05, 0.45)), radius, k=rng.uniform(0.0, 20.0)),
    ]
    return Mission(world, uavs, **{"solver": CGLA, "resolution": 9, **settings}, clearance=clearance)


def known_areas(mission: Mission, one: UavFlight, tick: int) -> list[shapely.Geometry]:
    """Return the areas that a UAV knows; overlapping areas are united."""
    known = union_of(mission.world.no_fly, one.knowledge_at(tick).areas.values())
    return [] if known is None else list(shapely.get_parts(shapely.union_all([known])))


def plans_of(flight: Flight) -> Iterator[tuple[UavFlight, int, FloatArray]]:
    """Yield every plan, and when it was made."""
    for one in flight.uavs.values():
        for tick, plan in one.plans:
            yield one, tick, plan


def assert_the_same(flight: Flight, other: Flight) -> None:
    """Compare all but the seconds of planning, byte by byte."""
    assert flight.events == other.events
    assert flight.separations == other.separations
    for name, one in flight.uavs.items():
        twin = other.uavs[name]
        assert (one.trace.tobytes(), one.path.tobytes()) == (twin.trace.tobytes(), twin.path.tobytes())
        assert [(tick, plan.tobytes()) for tick, plan in one.plans] == [
            (tick, plan.tobytes()) for tick, plan in twin.plans
        ]
        assert (one.status, one.message, one.ended, one.cost) == (twin.status, twin.message, twin.ended, twin.cost)


@pytest.mark.parametrize("way", WAYS)
@few
@given(seed=seeds, clearance=st.floats(0.01, 0.12))
def test_every_plan_keeps_its_distance_to_known_areas(way: str, seed: int, clearance: float) -> None:
    try:
        mission = scattered(seed, clearance, **WAYS[way])
    except CglaError:
        # an end in an area, or too near to one
        reject()
    flight = mission.fly()
    for one, tick, plan in plans_of(flight):
        # a plan of one step has one point where the UAV stays
        line = shapely.LineString(plan if len(plan) > 1 else np.repeat(plan, 2, axis=0))
        for area in known_areas(mission, one, tick):
            away = shapely.distance(area, shapely.Point(plan[0]))
            # widened corners are up to 0.12 % farther away than the clearance
            near = away < 1.0013 * clearance
            least = 0.4985 * away if near else clearance
            event(f"too near already: {near}")
            if near and away < clearance / 500.0:
                # then the outline counts
                assert not area.buffer(-ROUNDING).crosses(line)
            else:
                assert shapely.distance(area, line) >= least - ROUNDING


def without_clearance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make planners ignore the clearance, as missions did before there was one."""

    def before(self: simulation.Simulation, agent: simulation.Agent) -> tuple[Point, shapely.Geometry | None]:
        known = self._known_areas(agent.belief.areas)
        return self._outside(agent.position, known), known

    monkeypatch.setattr(simulation.Simulation, "_kept_out_of", before)


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_without_a_clearance_flights_are_what_they_were(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    @few
    @given(seeds)
    def check(seed: int) -> None:
        try:
            mission = scattered(seed, 0.0, **WAYS[way])
        except CglaError:
            reject()
        flight = mission.fly()
        with monkeypatch.context() as patched:
            without_clearance(patched)
            before = mission.fly()
        assert_the_same(flight, before)

    check()


@few
@given(seed=seeds, clearance=st.floats(0.005, 0.08), solver=st.sampled_from(["cgla", "dijkstra", "visibility-graph"]))
def test_the_first_plan_is_that_of_the_problem(seed: int, clearance: float, solver: str) -> None:
    """A mission with full knowledge of a still world plans once, with the result of `cg.solve` at that clearance."""
    try:
        mission = scattered(seed, clearance, solver=cg.solvers.get(solver), knowledge="all", max_ticks=1)
        world, uav = World(mission.world.field, no_fly=mission.world.no_fly), mission.uavs[0]
        mission = dataclasses.replace(mission, world=world, uavs=[uav])
        problem = Problem(uav.start, uav.goal, world.field, uav.k, no_fly=world.no_fly, clearance=clearance)
    except CglaError:
        reject()
    best = cg.solve(problem, mission.solver, resolution=mission.lattice)
    plans = mission.fly().uavs["a"].plans
    assert bool(plans) == best.status.has_path
    if plans:
        assert problem.evaluate(plans[0][1]).cost == pytest.approx(best.cost, rel=1e-9)
        assert problem.evaluate(plans[0][1]).feasible


@pytest.mark.parametrize("way", ["repaired", "weights", "plane"])
def test_an_area_comes_up_and_is_flown_around_from_afar(way: str) -> None:
    world = World(timed=[TimedArea(WALL, appears=2)])
    settings = {"solver": CGLA, "resolution": 20, **WAYS[way]}
    lengths = []
    for clearance in (0.0, 0.02, 0.06):
        flight = Mission(world, [EAST], **settings, clearance=clearance).fly()
        one = flight.uavs["a"]
        # it is seen when its outline is within the detection radius, for any clearance
        seen = next(tick for tick in range(99) if 0.45 - one.position_at(tick)[0] <= 0.3)  # type: ignore[index]
        assert [entry.tick for entry in flight.events if entry.kind == "detected"] == [max(seen, 2)]
        assert one.status is MissionStatus.ARRIVED
        assert shapely.distance(shapely.LineString(one.path), WALL) >= clearance - ROUNDING
        lengths.append(one.length)
    assert all(a < b for a, b in pairwise(lengths))


@pytest.mark.parametrize("way", ["repaired", "every tick", "plane", "prioritized"])
def test_a_uav_that_is_too_near_flies_on_with_half_of_it(way: str) -> None:
    """An area comes up 0.03 ahead of it, with a clearance of 0.05: it is kept at 0.025, and the wall beside at 0.05."""
    ahead = shapely.box(0.5, 0.45, 0.6, 0.58)
    beside = shapely.box(0.3, 0.0, 0.7, 0.3)
    # (the step is 0.05: at tick 7 it is at 0.45)
    world = World(no_fly=beside, timed=[TimedArea(ahead, appears=8)])
    uav = dataclasses.replace(EAST, start=(0.07, 0.5), step=0.05)
    settings = {"solver": CGLA, "resolution": 25, **WAYS[way]}
    one = Mission(world, [uav], **settings, clearance=0.05).fly().uavs["a"]
    assert one.position_at(8) == pytest.approx((0.47, 0.5))
    assert one.status is MissionStatus.ARRIVED
    path = shapely.LineString(one.path)
    assert 0.025 - ROUNDING <= shapely.distance(path, ahead) <= 0.03 + ROUNDING
    assert shapely.distance(path, beside) >= 0.05 - ROUNDING


def test_between_two_areas_that_are_too_near_it_finds_the_way_out() -> None:
    channel = [shapely.box(0.3, 0.54, 0.7, 0.9), shapely.box(0.3, 0.1, 0.7, 0.47)]
    world = World(timed=[TimedArea(area, appears=10) for area in channel])
    one = Mission(world, [dataclasses.replace(EAST, step=0.03)], CGLA, resolution=21, clearance=0.1).fly().uavs["a"]
    assert one.position_at(10) == pytest.approx((0.4, 0.5))
    assert one.status is MissionStatus.ARRIVED
    # a UAV that knows of it before does not fly into it
    known = Mission(World(no_fly=shapely.MultiPolygon(channel)), [EAST], CGLA, resolution=21, clearance=0.05).fly()
    assert shapely.distance(shapely.LineString(known.uavs["a"].path), shapely.union_all(channel)) >= 0.05 - ROUNDING


def test_where_no_path_keeps_it_the_flight_ends_and_says_so() -> None:
    gap = shapely.MultiPolygon([shapely.box(0.4, 0.0, 0.6, 0.45), shapely.box(0.4, 0.55, 0.6, 1.0)])
    ends = {
        c: Mission(World(no_fly=gap), [EAST], CGLA, resolution=21, clearance=c).fly().uavs["a"] for c in (0.0, 0.06)
    }
    assert [one.status.label for one in ends.values()] == ["arrived", "no-path"]
    assert ends[0.06].message


def test_a_goal_that_an_area_comes_too_near_to_is_an_end_that_says_so() -> None:
    world = World(timed=[TimedArea(shapely.box(0.8, 0.54, 1.0, 0.7), appears=4)])
    free, kept = (Mission(world, [EAST], CGLA, resolution=21, clearance=c).fly().uavs["a"] for c in (0.03, 0.05))
    assert free.status is MissionStatus.ARRIVED
    assert kept.status is MissionStatus.NO_PATH
    assert "its goal (0.9, 0.5) is inside a no-fly area now, or nearer to one than the clearance 0.05" in kept.message


def test_a_plan_that_is_kept_to_ends_where_it_would_enter_an_area_not_before() -> None:
    beside, ahead = (TimedArea(shapely.box(0.5, y, 0.6, 0.8), appears=3) for y in (0.52, 0.48))
    ends = [
        Mission(World(timed=[one]), [EAST], CGLA, resolution=20, replan="never", clearance=0.05).fly().uavs["a"]
        for one in (beside, ahead)
    ]
    assert [one.status.label for one in ends] == ["arrived", "no-path"]


def test_separation_is_kept_beside_areas() -> None:
    west = Uav("w", (0.9, 0.5), (0.1, 0.5), 0.3, k=0.0)
    world = World(no_fly=WALL)
    flight = Mission(world, [EAST, west], CGLA, resolution=15, avoidance="prioritized", clearance=0.04).fly()
    assert flight.all_arrived
    assert flight.least_separation >= 0.15
    for one in flight.uavs.values():
        assert shapely.distance(shapely.LineString(one.path), WALL) >= 0.04 - ROUNDING


def test_flights_that_are_compared_with_it_keep_the_clearance() -> None:
    mission = Mission(World(timed=[TimedArea(WALL, appears=2)]), [EAST], CGLA, resolution=20, clearance=0.05)
    informed = mission.fly().fly_informed()
    assert informed.mission.clearance == 0.05
    assert shapely.distance(shapely.LineString(informed.uavs["a"].path), WALL) >= 0.05 - ROUNDING


@pytest.mark.parametrize(
    ("world", "clearance", "words"),
    [
        (World(), -0.1, "clearance is -0.1; it must be at least 0"),
        (World(no_fly=shapely.box(0.7, 0, 0.8, 1)), 0.11, r"UAV a: goal \(0.9, 0.5\) is 0.1 from the no-fly area"),
        (World(timed=[TimedArea(shapely.box(0.2, 0, 0.3, 1))]), 0.11, "the clearance is 0.11 .*; move it, or lower"),
    ],
)
def test_a_clearance_that_cannot_be_kept_is_refused_by_name(world: World, clearance: Any, words: str) -> None:  # noqa: ANN401
    with pytest.raises(MissionError, match=words):
        Mission(world, [EAST], CGLA, clearance=clearance)


def test_an_area_that_vanishes_before_take_off_does_not_count() -> None:
    # it is there, around start and goal, before this UAV takes off, and gone by then
    world = World(timed=[TimedArea(shapely.box(0.15, 0.4, 0.85, 0.6), vanishes=5)])
    late = dataclasses.replace(EAST, departs=6)
    assert Mission(world, [late], CGLA, clearance=0.1).fly().all_arrived

"""Missions: their options, and refusal of malformed ones."""

import copy
import dataclasses
import itertools
import json
import math
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import shapely

import cgla_graph as cg
from cgla_graph.errors import CglaError, MissionError
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.mission.world import TimedArea, TimedThreat, World
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits

CGLA = cg.solvers.get("cgla")
MIDDLE = RiskField([Threat(0.5, 0.5, 0.08), Threat(0.35, 0.6, 0.05), Threat(0.7, 0.55, 0.06)])
A = Uav("a", (0.1, 0.1), (0.9, 0.9), 0.2)
B = Uav("b", (0.1, 0.4), (0.55, 0.95), 0.2)
SMALL = 9


def mission(*uavs: Uav, **settings: Any) -> Mission:  # noqa: ANN401 - any setting
    """Return a small mission through three threats."""
    world = settings.pop("world", World(MIDDLE))
    return Mission(world, uavs or (A,), settings.pop("solver", CGLA), **{"resolution": SMALL, **settings})


def kinds(flight: Flight, kind: str, uav: str | None = None) -> list[tuple[int, dict[str, Any]]]:
    """List the events of a kind."""
    return [
        (event.tick, dict(event.detail)) for event in flight.events if event.kind == kind and uav in {None, event.uav}
    ]


def test_a_uav_without_knowledge_sets_out_straight_and_turns_when_it_sees() -> None:
    flight = mission().fly().uavs["a"]
    assert flight.status is MissionStatus.ARRIVED
    # points in line may be on it: adding up lengths is rounded
    assert np.ptp(flight.plans[0][1] @ [1.0, -1.0]) == 0.0
    assert len(flight.knowledge_at(0).threats) == 0
    assert len(flight.knowledge_at(flight.ended).threats) > 0
    assert len(flight.replans) > 1
    assert flight.length > 0.8 * math.sqrt(2.0) + 1e-6
    assert flight.position_at(0) == (0.1, 0.1)
    assert flight.position_at(flight.ended) == (0.9, 0.9)
    assert flight.position_at(flight.ended + 1) is None


def test_every_step_has_the_length_of_a_step() -> None:
    flight = mission().fly().uavs["a"]
    step = 0.4 / SMALL
    along = np.hypot(*np.diff(flight.path, axis=0).T)
    ticks = np.floor(flight.times[1:] - 1e-9).astype(int)
    flown = np.bincount(ticks, weights=along)
    assert flown[:-1] == pytest.approx(step)
    assert 0.0 < flown[-1] <= step * (1 + 1e-9)


def test_the_numbers_of_a_flight_are_the_oracle_s() -> None:
    flight = mission().fly().uavs["a"]
    found = Problem((0.1, 0.1), (0.9, 0.9), MIDDLE, k=10.0).evaluate(flight.path)
    assert (flight.length, flight.risk, flight.cost) == pytest.approx((found.length, found.risk, found.cost))
    assert flight.risk_sum == pytest.approx(float(MIDDLE.density(flight.trace).sum()))
    fine = np.vstack([np.linspace(a, b, 400) for a, b in zip(flight.path[:-1], flight.path[1:], strict=True)])
    assert flight.max_risk == pytest.approx(float(MIDDLE.density(fine).max()), rel=0.02)
    lengths = np.hypot(*np.diff(fine, axis=0).T)
    exposed = lengths[MIDDLE.density(fine)[1:] > 0.1].sum()
    assert flight.exposure == pytest.approx(float(exposed), abs=0.01)
    assert flight.exposure > 0.0


def test_risk_counts_as_it_was_when_it_was_flown_through() -> None:
    east = Uav("a", (0.0, 0.5), (1.0, 0.5), 0.1, step=0.1)
    spot = Threat(0.5, 0.5, 0.05)
    for life, share in [((0, None), 1.0), ((0, 5), 0.5), ((5, None), 0.5), ((5, 6), 0.4772), ((20, None), 0.0)]:
        world = World(timed=[TimedThreat(spot, *life)])
        # k = 0: risk is measured, not avoided
        flight = mission(dataclasses.replace(east, k=0.0), world=world).fly().uavs["a"]
        assert flight.risk == pytest.approx(share * 0.05 * math.sqrt(2.0 * math.pi), rel=1e-3, abs=1e-9)


class _Recorder:
    """A plane solver that keeps every problem it is given, and flies straight."""

    traits = Traits("recorder", "records", domain="plane")

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def solve(self, problem: Problem) -> Solution:
        self.problems.append(problem)
        path = np.array([problem.start, problem.goal])
        return Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost)


def test_a_solver_sees_only_what_its_uav_knows() -> None:
    recorder = _Recorder()
    flight = mission(A, B, solver=recorder, sharing="none").fly()
    for name, uav in (("a", A), ("b", B)):
        mine = [problem for problem in recorder.problems if problem.goal == uav.goal]
        known = [set(problem.field.threats) for problem in mine]
        assert known[0] == set()
        seen = {0: set[Threat]()}
        for tick, detail in kinds(flight, "detected", name):
            seen[tick] = set(seen[max(seen)]) | {MIDDLE.threats[detail["threat"]]}
        assert known == list(seen.values())
        for problem in mine:
            position = np.array(problem.start)
            new = problem.field.threats
            assert all(any(math.dist(spot, (t.x, t.y)) <= 0.2 for spot in flight.uavs[name].trace) for t in new)
            assert position.tolist() in flight.uavs[name].trace.tolist()


def test_events_of_sharing_name_sender_origin_and_tick() -> None:
    flight = mission(A, B).fly()
    seen = {(event.detail["threat"], event.tick): event.uav for event in flight.events if event.kind == "detected"}
    learned = kinds(flight, "learned")
    assert learned
    for tick, detail in learned:
        assert seen[detail["threat"], detail["seen"]] == detail["origin"] == detail["source"]
        assert tick == detail["seen"]
    late = mission(A, B, sharing=Sharing(delay=3)).fly()
    assert {tick - detail["seen"] for tick, detail in kinds(late, "learned")} == {3}
    assert kinds(mission(A, B, sharing="none").fly(), "learned") == []


def test_on_the_ground_a_uav_hears_but_does_not_see() -> None:
    late = dataclasses.replace(B, start=(0.45, 0.45), departs=15)
    flight = mission(A, late).fly()
    assert mission(A, dataclasses.replace(A, name="late", departs=12)).fly().all_arrived, "starts may be equal"
    before = [event for event in flight.events if event.uav == "b" and event.tick < 15]
    assert {event.kind for event in before} == {"learned"}
    assert flight.uavs["b"].departed == 15
    assert flight.uavs["b"].position_at(14) is None
    assert flight.uavs["b"].position_at(15) == (0.45, 0.45)


@pytest.mark.parametrize(
    "settings",
    [
        {"movement": "vertex"},
        {"replan": "tick"},
        {"replan": "never"},
        {"exclude": "last"},
        {"exclude": "all"},
        {"start": "snapped"},
        {"update": "sequential"},
        {"fusion": "max_integral"},
        {"fusion": "integral_max"},
        {"fusion": "riskiest"},
        {"integral": "raster"},
        {"virtual_obstacle": True},
        {"virtual_obstacle": VirtualObstacle(placement="add", zones="near", stepnum=1)},
        {"avoidance": "prioritized"},
        {"incremental": False},
        {"solver": cg.solvers.get("dijkstra")},
        {"solver": cg.solvers.get("eight-direction")},
        {"solver": cg.solvers.get("hybrid", tolerance=None)},
        {"arrival_radius": 0.05},
        {"sharing": Sharing(radius=0.3, delay=1, loss=0.5)},
    ],
    ids=str,
)
def test_every_option_flies(settings: dict[str, Any]) -> None:
    flight = mission(A, B, **settings).fly()
    assert [one.status for one in flight.uavs.values()] == [MissionStatus.ARRIVED] * 2
    again = mission(A, B, **settings).fly()
    assert [event.document() for event in flight.events] == [event.document() for event in again.events]
    for name in "ab":
        assert np.array_equal(flight.uavs[name].path, again.uavs[name].path)


def test_a_uav_at_its_goal_arrives_at_once() -> None:
    here = dataclasses.replace(A, name="here", goal=A.start)
    late = dataclasses.replace(B, name="late", goal=B.start, departs=4)
    flight = mission(here, late).fly()
    assert [(one.status, one.ended, one.length) for one in flight.uavs.values()] == [
        (MissionStatus.ARRIVED, 0, 0.0),
        (MissionStatus.ARRIVED, 4, 0.0),
    ]
    assert flight.price_of_ignorance == {"here": 1.0, "late": 1.0}

    within = mission(arrival_radius=0.05).fly().uavs["a"].trace
    assert math.dist(within[-1], A.goal) <= 0.05 < math.dist(within[-2], A.goal)


def test_from_vertex_to_vertex_it_flies_blind_and_sees_along_the_way() -> None:
    flight = mission(movement="vertex").fly()
    # the first plan knows of nothing: a straight line to the goal
    assert flight.ticks <= 2
    assert flight.uavs["a"].risk == pytest.approx(float(MIDDLE.line_integral(A.start, A.goal)))
    stop = World(MIDDLE, no_fly=shapely.box(0.45, 0.0, 0.55, 0.8))
    # to the next vertex, for any step
    flight = mission(dataclasses.replace(A, step=50.0), movement="vertex", world=stop).fly()
    assert flight.all_arrived
    assert flight.ticks > 2
    assert kinds(flight, "detected")[0][0] == 1


class _Watch:
    """A graph solver that keeps which nodes of each graph no edge leads to, and plans as cgla does."""

    traits = Traits("watch", "watches", domain="graph")

    def __init__(self) -> None:
        self.cut_off: list[set[int]] = []

    def solve(self, problem: GraphProblem) -> Solution:
        weights = problem.graph.weight_matrix()
        self.cut_off.append(set(np.nonzero(np.isfinite(weights).sum(axis=1) == 1)[0].tolist()))
        assert np.array_equal(weights, weights.T)
        answer: Solution = CGLA.solve(problem)
        return answer


@pytest.mark.parametrize("exclude", ["none", "last", "all"])
def test_excluded_points_are_cut_off_from_the_graph(exclude: str) -> None:
    watch = _Watch()
    flight = mission(solver=watch, exclude=exclude, replan="tick").fly()
    (one,) = flight.uavs.values()
    nearest = [flight.mission.lattice.nearest((x, y)) for x, y in one.trace.tolist()]
    assert len(watch.cut_off) == len(one.replans) > 20
    for tick, cut_off in zip(one.replans, watch.cut_off, strict=True):
        runs = [node for node, _ in itertools.groupby(nearest[: tick + 1])]
        before = [node for node in runs if node != runs[-1]]
        assert cut_off == {"none": set(), "last": set(before[-1:]), "all": set(before)}[exclude]


def test_virtual_obstacles_are_ahead_of_where_the_other_flies() -> None:
    east = Uav("e", (0.1, 0.5), (0.9, 0.5), 0.3, safe_distance=0.2, k=1.0)
    north = Uav("n", (0.45, 0.1), (0.45, 0.9), 0.3, safe_distance=0.2, k=1.0)
    rule = VirtualObstacle(stepnum=3, peak=0.1)
    flight = mission(
        east, north, world=World(), virtual_obstacle=rule, collisions="record", resolution=20, replan="tick"
    ).fly()
    checked = 0
    for one, other in (("e", "n"), ("n", "e")):
        mine, theirs = flight.uavs[one].trace, flight.uavs[other].trace
        for tick in range(1, min(len(mine), len(theirs)) - 1):
            apart = math.dist(mine[tick], theirs[tick])
            moved = theirs[tick] - theirs[tick - 1]
            # three steps of 0.4 units, a unit is 1/20
            ahead = theirs[tick] + 0.06 * moved / np.hypot(*moved)
            expected = [] if apart > 0.3 else [theirs[tick] if apart >= 0.2 else ahead]
            found = [(obstacle.x, obstacle.y) for obstacle in flight.uavs[one].obstacles_at(tick)]
            assert found == [pytest.approx(spot) for spot in expected]
            checked += apart < 0.2
    assert checked > 5


def test_a_uav_that_starts_inside_a_threat_says_so_and_flies() -> None:
    world = World(RiskField([Threat(0.1, 0.12, 0.05)]))
    flight = mission(world=world).fly()
    ((tick, detail),) = kinds(flight, "started-in-risk")
    assert (tick, detail["threat"], round(detail["risk"], 3)) == (0, 0, 0.923)
    assert flight.all_arrived


def test_a_threat_that_appears_on_top_of_a_uav_is_logged_and_left_behind() -> None:
    free = mission(world=World()).fly().uavs["a"]
    x, y = free.trace[5].tolist()
    world = World(timed=[TimedThreat(Threat(x, y, 0.05), appears=5)])
    flight = mission(world=world).fly()
    assert [(tick, round(detail["distance"], 9)) for tick, detail in kinds(flight, "appeared-on")] == [(5, 0.0)]
    assert kinds(flight, "detected")[0][0] == 5
    assert flight.all_arrived
    # C38: on top of it, at least half a crossing cannot be avoided
    assert flight.uavs["a"].risk >= 0.5 * 0.05 * math.sqrt(2.0 * math.pi) - 1e-9


@pytest.mark.parametrize("solver", ["cgla", "dijkstra", "hybrid"])
def test_a_goal_that_an_area_swallows_is_an_end_with_its_tick(solver: str) -> None:
    world = World(timed=[TimedArea(shapely.box(0.8, 0.8, 1.0, 1.0), appears=9)])
    seen_all = mission(world=world, solver=cg.solvers.get(solver), knowledge="all").fly().uavs["a"]
    assert seen_all.status is MissionStatus.NO_PATH
    assert seen_all.ended == 9
    assert "tick 9" in seen_all.message
    assert "goal" in seen_all.message
    sensed = mission(world=world, solver=cg.solvers.get(solver)).fly().uavs["a"]
    assert sensed.status is MissionStatus.NO_PATH
    assert sensed.ended > 9
    assert len(sensed.trace) == sensed.ended + 1


def test_an_area_that_appears_is_flown_around_and_one_that_vanishes_is_flown_through() -> None:
    around = mission(world=World(timed=[TimedArea(shapely.box(0.2, 0.2, 0.6, 0.6), appears=8)])).fly()
    assert (around.uavs["a"].status, around.uavs["a"].ended) == (MissionStatus.NO_PATH, 8)
    assert kinds(around, "appeared-on") == [(8, {"area": 0})]
    wall = shapely.box(0.45, 0.2, 0.55, 0.95)
    shut = World(timed=[TimedArea(wall, appears=3)])
    flight = mission(world=shut).fly().uavs["a"]
    assert flight.status is MissionStatus.ARRIVED
    assert not shapely.LineString(flight.path).crosses(wall.buffer(-1e-6))
    opened = World(timed=[TimedArea(wall, vanishes=12)])
    later = mission(world=opened, knowledge="all").fly().uavs["a"]
    assert later.length < flight.length
    refuted = mission(Uav("a", (0.1, 0.5), (0.9, 0.5), 0.3), world=World(timed=[TimedArea(wall, vanishes=9)])).fly()
    assert kinds(refuted, "refuted") == [(9, {"area": 0})]


def test_a_threat_that_moves_is_believed_where_it_was_seen() -> None:
    there, later = Threat(0.5, 0.5, 0.05), (0.5, 0.62)
    world = World(timed=[TimedThreat(there, moves=[(6, *later)])])
    flight = mission(world=world).fly()
    events = [(event.kind, event.tick) for event in flight.events if event.kind in {"detected", "refuted"}]
    assert {kind for kind, _ in events} == {"detected"}
    near = mission(Uav("a", (0.1, 0.1), (0.9, 0.9), 0.6), world=world).fly()
    log = [(event.kind, event.tick) for event in near.events if event.kind in {"detected", "refuted"}]
    # both places are in sight when it moves
    assert log == [("detected", 0), ("refuted", 6), ("detected", 6)]
    assert {(threat.x, threat.y) for threat in near.uavs["a"].knowledge_at(near.ticks).threats.values()} == {later}


def test_uavs_that_collide_end_there_or_are_recorded() -> None:
    east, west = Uav("e", (0.0, 0.5), (1.0, 0.5), 0.2), Uav("w", (1.0, 0.5), (0.0, 0.5), 0.2)
    flight = mission(east, west, world=World()).fly()
    assert [one.status for one in flight.uavs.values()] == [MissionStatus.COLLISION] * 2
    (pair,) = flight.separations
    assert (pair.first, pair.second) == ("e", "w")
    assert math.isinf(flight.cost)
    flight = mission(east, west, world=World(), collisions="record").fly()
    assert flight.all_arrived
    assert flight.least_separation == pytest.approx(0.0, abs=1e-9)
    assert flight.separations[0].where == pytest.approx((0.5, 0.5))
    assert len(kinds(flight, "collision", "e")) == 1
    rule, aside = VirtualObstacle(stepnum=0, spread=0.05), dataclasses.replace(west, start=(1.0, 0.53))
    apart = mission(east, aside, world=World(), virtual_obstacle=rule, collision_distance=0.02).fly()
    assert apart.all_arrived
    assert apart.least_separation > 0.02


def test_near_a_common_goal_distances_do_not_count() -> None:
    other = Uav("b", (0.1, 0.3), (0.9, 0.9), 0.15, safe_distance=0.1)
    first = Uav("a", (0.3, 0.1), (0.9, 0.9), 0.15, safe_distance=0.1)
    flight = mission(first, other, world=World(), terminal_radius=0.3).fly()
    assert flight.all_arrived
    # two sides of 1 meet at the goal, 16.26 degrees apart
    assert flight.least_separation == pytest.approx(0.6 * math.sin(math.radians(16.26 / 2)), rel=1e-3)
    strict = mission(first, other, world=World(), terminal_radius=0.0).fly()
    assert {one.status for one in strict.uavs.values()} == {MissionStatus.COLLISION}


def test_a_solver_that_raises_or_lies_is_an_end_and_not_a_crash() -> None:
    class Broken(_Recorder):
        def solve(self, problem: Problem) -> Solution:
            if len(self.problems) > 1:
                msg = "out of luck"
                raise RuntimeError(msg)
            return super().solve(problem)

    flight = mission(solver=Broken()).fly().uavs["a"]
    assert flight.status is MissionStatus.NO_PATH
    assert "RuntimeError: out of luck" in flight.message

    class Liar(_Recorder):
        def solve(self, problem: Problem) -> Solution:
            return Solution(Status.FOUND, path=np.array([problem.start, (5.0, 5.0), problem.goal]), cost=1.0)

    assert mission(solver=Liar()).fly().uavs["a"].status is MissionStatus.NO_PATH


def test_a_uav_that_gives_up_does_not_fly_on_when_moves_are_sequential() -> None:
    world = World(timed=[TimedArea(shapely.box(0.5, 0.3, 0.6, 0.7), appears=10)])
    uav = Uav("a", (0.1, 0.5), (0.55, 0.5), 0.2)
    one, other = (mission(uav, world=world, update=how).fly().uavs["a"] for how in ("sequential", "simultaneous"))
    assert one.status is MissionStatus.NO_PATH
    assert one.times[-1] == one.ended == other.ended
    assert np.array_equal(one.path, other.path)


def test_a_mission_stops_at_its_last_tick_and_a_uav_on_the_ground_has_no_position() -> None:
    world = World(RiskField([Threat(0.4, 0.4, 0.1)]))
    late = Uav("late", (0.4, 0.4), (0.9, 0.9), 0.2, departs=50)
    flown, flight = mission(A, late, world=world, max_ticks=5).fly().uavs.values()
    assert (flight.status, flight.took_off) == (MissionStatus.OUT_OF_TICKS, False)
    assert (flight.length, flight.risk, flight.risk_sum, flight.max_risk, flight.exposure) == (0.0,) * 5
    assert flight.departed == flight.ended == 5
    assert [flight.position_at(tick) for tick in (0, 5, 50)] == [None] * 3
    assert (flown.status, flown.ended, len(flown.trace)) == (MissionStatus.OUT_OF_TICKS, 5, 6)


def test_waiting_is_flown_in_circles_and_counts() -> None:
    """A UAV that has to wait for another one flies on the spot: length, risk and cost go on."""
    walls = shapely.union_all([shapely.box(0.2, 0.2, 0.45, 0.42), shapely.box(0.55, 0.2, 0.8, 0.42)])
    random = np.random.default_rng(0)
    uavs = [
        Uav("a", (0.1, 0.5), (0.9, 0.5), 0.4, safe_distance=0.15),
        Uav("b", (float(random.uniform(0.3, 0.7)), 0.1), (0.5, 0.9), 0.4, safe_distance=0.15, k=50.0),
        Uav("c", (0.9, float(random.uniform(0.3, 0.7))), (0.1, 0.5), 0.4, safe_distance=0.2),
    ]
    world = World(RiskField([Threat(0.5, 0.5, 0.5, peak=1e-4)]), no_fly=walls)
    flight = mission(*uavs, world=world, avoidance="prioritized", resolution=8, collision_distance=0.0).fly()
    assert flight.all_arrived
    assert sum(one.waited for one in flight.uavs.values()) > 0.9
    for one in flight.uavs.values():
        step = flight.mission.step_of(one.uav)
        lengths, ticks = np.hypot(*np.diff(one.path, axis=0).T), np.diff(one.times)
        assert one.waited == pytest.approx(float(ticks[lengths == 0.0].sum()))
        # the clock agrees: a step a tick, waiting or not
        assert one.length == pytest.approx(float(lengths.sum()) + one.waited * step)
        assert one.length == pytest.approx((one.times[-1] - one.departed) * step)
        spots = one.path[:-1][lengths == 0.0]
        circled = float((world.field.density(spots) * ticks[lengths == 0.0]).sum()) * step
        flown = float(world.field.line_integral(one.path[:-1], one.path[1:]).sum())
        assert one.risk == pytest.approx(flown + circled)


@pytest.mark.parametrize("movement", ["step", "vertex"])
def test_the_greatest_risk_of_a_long_leg_is_found(movement: str) -> None:
    world = World(RiskField([Threat(0.525, 0.5, 0.008)]))
    uav = Uav("a", (0.1, 0.5), (0.9, 0.5), 0.05, k=0.0, step=0.5)
    flight = mission(uav, world=world, movement=movement).fly().uavs["a"]
    assert flight.max_risk == pytest.approx(1.0, abs=1e-6)
    # F > 0.1 within sqrt(2 ln 10) spreads
    assert flight.exposure == pytest.approx(2.0 * 0.008 * math.sqrt(2.0 * math.log(10.0)), rel=0.02)


def test_missions_worlds_and_flights_can_be_pickled_and_copied() -> None:
    world = World(
        MIDDLE, timed=[TimedThreat(Threat(0.6, 0.3, 0.05), appears=3), TimedArea(shapely.box(0, 0.9, 0.1, 1))]
    )
    flight = mission(A, B, world=world).fly()
    for twin in (pickle.loads(pickle.dumps(flight)), copy.deepcopy(flight)):  # noqa: S301 - our own
        assert [event.document() for event in twin.events] == [event.document() for event in flight.events]
        again = twin.mission.fly()
        assert np.array_equal(again.uavs["a"].path, flight.uavs["a"].path)


@pytest.mark.parametrize("step", [0.04, 0.01, 0.002])
def test_planning_in_space_and_time_does_not_depend_on_how_finely_time_is_divided(step: float) -> None:
    gap = shapely.union_all([shapely.box(0.48, 0.0, 0.52, 0.48), shapely.box(0.48, 0.55, 0.52, 1.0)])
    east = Uav("e", (0.1, 0.5), (0.9, 0.5), 0.5, step=step, safe_distance=0.2)
    west = Uav("w", (0.9, 0.52), (0.1, 0.52), 0.5, step=step, safe_distance=0.2)
    flight = mission(east, west, world=World(no_fly=gap), avoidance="prioritized", resolution=15).fly()
    assert flight.all_arrived
    assert flight.least_separation >= 0.2


def test_an_improper_world_warns_once_and_flies_or_is_refused() -> None:
    with pytest.warns(ImproperFieldWarning):
        field = RiskField([Threat(0.5, 0.5, 0.05, peak=2.0)], improper=True)
    flight = mission(world=World(field, timed=[TimedThreat(Threat(0.3, 0.4, 0.05), appears=2)])).fly()
    assert flight.uavs["a"].status in {MissionStatus.ARRIVED, MissionStatus.NO_PATH}
    assert len(flight.uavs["a"].replans) > 1
    for settings in ({"avoidance": "prioritized"}, {"fusion": "max_integral"}, {"integral": "raster"}):
        with pytest.raises(MissionError, match="peaks above 1"):
            mission(world=World(field), **settings)
    with pytest.warns(ImproperFieldWarning):
        late = World(RiskField([], improper=True), timed=[TimedThreat(Threat(0.5, 0.5, 0.1, peak=3.0))])
    with pytest.raises(MissionError, match="peaks above 1"):
        mission(world=late, avoidance="prioritized")


def test_plans_skip_a_snapped_start() -> None:
    flight = mission(start="snapped", replan="tick").fly()
    lattice, bent = flight.mission.lattice, 0
    for tick, plan in flight.uavs["a"].plans:
        assert tuple(plan[0]) == flight.uavs["a"].position_at(tick)
        snapped = lattice.points[lattice.nearest((plan[0, 0], plan[0, 1]))]
        if len(plan) > 2 and not np.array_equal(snapped, plan[0]):
            assert not np.array_equal(snapped, plan[1])
            bent += 1
    assert bent > 5

    # a snapped start inside an area is left out
    world = World(no_fly=shapely.box(0.3, 0.3, 0.52, 0.52))
    flight = mission(Uav("a", (0.53, 0.5), (0.9, 0.9), 0.2), world=world, start="snapped", resolution=3).fly()
    assert flight.all_arrived


def test_an_interrupted_mission_keeps_its_flight_so_far() -> None:
    simulation = mission(A, B).simulate()
    for _ in range(4):
        simulation.advance()
    flight = simulation.flight(interrupted=True)
    assert flight.interrupted
    assert {one.status for one in flight.uavs.values()} == {MissionStatus.INTERRUPTED}
    assert [len(one.trace) for one in flight.uavs.values()] == [5, 5]
    whole = mission(A, B).fly()
    assert np.array_equal(whole.uavs["a"].trace[:5], flight.uavs["a"].trace)


def test_price_of_ignorance_and_value_of_sharing_are_ratios_of_flown_costs() -> None:
    flight = mission(A, B).fly()
    informed = mission(A, B, knowledge="all").fly()
    unshared = mission(A, B, sharing="none").fly()
    for name in "ab":
        price = flight.uavs[name].cost / informed.uavs[name].cost
        assert flight.price_of_ignorance[name] == flight.costs_over(flight.fly_informed())[name] == pytest.approx(price)
        assert flight.value_of_sharing[name] == pytest.approx(unshared.uavs[name].cost / flight.uavs[name].cost)
    assert informed.fly_informed() is informed
    assert unshared.fly_unshared() is unshared
    assert informed.price_of_ignorance == {"a": 1.0, "b": 1.0}
    assert all(math.isnan(value) for value in unshared.value_of_sharing.values())


@pytest.mark.slow
def test_the_same_mission_is_the_same_flight_in_every_process() -> None:
    code = (
        f"import sys, json; sys.path[:0] = {sys.path!r}; import test_mission as t;"
        "f = t.mission(t.A, t.B, sharing=t.Sharing(radius=0.4, loss=0.3), virtual_obstacle=True).fly();"
        "print(json.dumps([e.document() for e in f.events] + [u.path.tolist() for u in f.uavs.values()]))"
    )
    texts = [
        subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, check=True
        ).stdout
        for seed in ("1", "2")
    ]
    assert texts[0] == texts[1]
    assert len(json.loads(texts[0])) > 10


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Mission(World(), [], CGLA), "at least one UAV"),
        (lambda: Mission(World(), "ab", CGLA), "give a list of Uav"),  # type: ignore[arg-type]
        (lambda: Mission(World(), [A, "b"], CGLA), "'b' is no UAV"),  # type: ignore[list-item]
        (lambda: mission(A, A), "two UAVs are called 'a'"),
        (lambda: mission(A, dataclasses.replace(A, name="n", start=(0.15, 0.1))), "start 0.05 apart, closer than"),
        (lambda: mission(world=World(no_fly=shapely.box(0.8, 0.8, 1, 1))), "UAV a: goal"),
        (lambda: mission(world=World(timed=[TimedArea(shapely.box(0.05, 0.05, 0.2, 0.2))])), "inside the no-fly area"),
        (lambda: mission(world=World(bounds=(0, 0, 0.5, 0.5))), "UAV a: goal (0.9, 0.9) is outside the bounds"),
        (lambda: Uav("", (0, 0), (1, 1), 0.2), "name is ''"),
        (lambda: Uav("a", (0, 0), (1, 1), 0.0), "UAV a: detection_radius is 0; it must be above 0"),
        (lambda: Uav("a", (0, 0), (1, 1), 0.2, step=0.0), "step is 0"),
        (lambda: Uav("a", (0, 0), (1, 1), 0.2, k=-1.0), "k is -1"),
        (lambda: Uav("a", (0, 0), (1, 1), 0.2, safe_distance=0.2), "not below its detection_radius 0.2"),
        (lambda: Uav("a", (0, 0), (1, 1), 0.2, departs=-1), "departs is -1"),
        (lambda: Uav("a", "here", (1, 1), 0.2), "UAV a: start is 'here'"),  # type: ignore[arg-type]
        (lambda: mission(world="flat"), "give a World"),
        (lambda: mission(solver="cgla"), "cgla_graph.solvers.get"),
        (lambda: mission(sharing="some"), "sharing is 'some'"),
        (lambda: mission(replan="daily"), "unknown replan 'daily'; choose one of change, tick, never"),
        (lambda: mission(virtual_obstacle=3), "give a VirtualObstacle"),
        (lambda: mission(resolution=1), "resolution is 1"),
        (lambda: mission(max_ticks=0), "max_ticks is 0"),
        (lambda: mission(arrival_radius=-1.0), "arrival_radius is -1"),
        (lambda: mission(incremental=1), "incremental is 1"),
        (lambda: mission(solver=cg.solvers.get("hybrid"), exclude="all"), "needs a graph solver, hybrid plans"),
        (lambda: mission(avoidance="prioritized", virtual_obstacle=True), "virtual_obstacle cannot be combined"),
        (lambda: mission(avoidance="prioritized", movement="vertex"), "movement cannot be combined"),
        (lambda: mission(solver=type(CGLA)), "give a solver"),
        (lambda: mission(replan=np.array(["tick"])), "unknown replan"),
        (lambda: mission(sharing=np.array(["none"])), "sharing is"),
        (lambda: mission(resolution=201), "the lattice has 40401 points"),
        (lambda: mission(resolution=cg.Lattice(9, bounds=(5, 5, 6, 6))), "the lattice lies over (5.0, 5.0, 6.0, 6.0)"),
        (lambda: mission(dataclasses.replace(A, step=1e-310)), "takes more than 1000000 ticks"),
        (
            lambda: mission(*(dataclasses.replace(uav, safe_distance=0.01) for uav in (A, B)), avoidance="prioritized"),
            "both safe distances are below the collision distance 0.0666667",
        ),
        (lambda: mission(dataclasses.replace(A, safe_distance=0.02), virtual_obstacle=True), "need more than 0.1"),
    ],
)
def test_malformed_missions_are_refused_by_name(build: Callable[[], object], words: str) -> None:
    with pytest.raises((CglaError, TypeError)) as caught:
        build()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_replanning_the_first_plan_is_flown() -> None:
    threat, gate = TimedThreat(Threat(0.5, 0.5, spread=0.1), 2), TimedArea(shapely.box(0.45, 0.4, 0.55, 0.6), 2)
    for thing, solver, end in (
        (threat, "cgla", "arrived"),
        (threat, "bcv-style", "arrived"),
        (gate, "cgla", "no-path"),
    ):
        world = World(timed=[thing])
        uav = Uav("a", (0.1, 0.5), (0.9, 0.5), 0.2, k=10.0)
        flown = Mission(world, [uav], cg.solvers.get(solver), resolution=20, replan="never").fly().uavs["a"]
        assert (flown.status.label, len(flown.replans)) == (end, 1)
        assert np.abs(flown.trace[:, 1] - 0.5).max() < 1e-9
        assert thing is threat or not shapely.LineString(flown.trace).crosses(gate.polygon)
        # the same UAV that plans again flies around
        assert Mission(world, [uav], cg.solvers.get(solver), resolution=20).fly().uavs["a"].length > 0.81


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(1, 4))])
def test_no_flight_undercuts_its_lower_bound(seed: int) -> None:
    # (that counts all timed threats as if they had always been there fails)
    random = np.random.default_rng([seed, 50])
    timed = [
        TimedThreat(Threat(*random.uniform(0.2, 0.8, 2).tolist(), 0.08), appears, appears + 4 if appears else None)
        for appears in (0, 1, 12)
    ]
    wall = shapely.box(0.45, 0.0, 0.5, 0.6)
    uavs = [Uav(f"{n}", (0.1, y), (0.9, y), 0.2, k=k) for n, (y, k) in enumerate([(0.1, 0.0), (0.5, 5.0), (0.9, 40.0)])]
    field = RiskField([Threat(*random.uniform(0.2, 0.8, 2).tolist(), 0.1)])
    flight = mission(*uavs, world=World(field, no_fly=wall, timed=timed), collisions="record", knowledge="all").fly()
    assert flight.all_arrived
    costs = [one.cost for one in flight.uavs.values()]
    assert np.all(np.array(costs) >= np.array(list(flight.lower_bounds.values())) * (1.0 - 1e-12))
    # the first one counts length alone: around the wall's upper corners
    shortest = math.dist((0.1, 0.1), (0.45, 0.6)) + 0.05 + math.dist((0.5, 0.6), (0.9, 0.1))
    assert 0.998 * shortest < flight.lower_bounds["0"] <= shortest
    assert flight.gap == pytest.approx(sum(costs) / sum(flight.lower_bounds.values()) - 1.0)
    assert flight.gap < 0.25


def test_what_peaks_above_1_proves_nothing() -> None:
    with pytest.warns(ImproperFieldWarning):
        world = World(RiskField([Threat(0.5, 0.5, 0.08, 1.5)], improper=True))
    flight = mission(world=world).fly()
    assert [math.isnan(flight.lower_bounds["a"]), math.isnan(flight.gap)] == [True, True]

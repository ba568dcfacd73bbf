"""Planning in space and time: a plan keeps its distance at every moment, and says what it proved."""

import heapq
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any
from unittest import mock

import numpy as np
import oracles
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry.base import BaseGeometry
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import Point
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.errors import ProblemError
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.model.weights import DenseWeights
from cgla_graph.motion import space_time
from cgla_graph.motion.space_time import SpaceTimePlan, SpaceTimeStatus, plan_in_space_time
from cgla_graph.motion.trajectory import Trajectory, closest_approach
from cgla_graph.testing.strategies import fields, polygons, seeds

Others = Sequence[tuple[Trajectory, float]]


@dataclass(frozen=True)
class Task:
    """Something to plan, on a lattice."""

    problem: cg.Problem
    matrix: CostMatrix
    others: Others
    start_time: float
    step: float
    latest: float

    def plan(
        self, *, window: float = space_time.WINDOW, most_expansions: int = space_time.MOST_EXPANSIONS
    ) -> SpaceTimePlan:
        times = {"start_time": self.start_time, "step": self.step, "latest": self.latest}
        with mock.patch.multiple(space_time, WINDOW=window, MOST_EXPANSIONS=most_expansions):
            return plan_in_space_time(self.problem, self.matrix, self.others, **times)


def resting(place: Point, since: float, until: float) -> Trajectory:
    return Trajectory([since, until], [place, place])


def matrix_of(problem: cg.Problem, resolution: int, *, stored: bool = False, start_known: bool = True) -> CostMatrix:
    known = problem if start_known else replace(problem, start=problem.goal)
    on_lattice = known.on_lattice(resolution)
    if stored:
        on_lattice = on_lattice.with_weights_held()
    return cost_matrix(on_lattice.graph, on_lattice.target)


@st.composite
def tasks(draw: st.DrawFn, *, sides: tuple[int, int] = (3, 8), step: float = 0.07, latest: float = 80.0) -> Task:
    """Draw a task with up to four others that fly, wait or fly after having waited; on and off the lattice."""
    rng = np.random.default_rng(draw(seeds))
    field = draw(fields(max_threats=3))
    walls = draw(polygons(side=2)) if draw(st.integers(0, 3)) == 0 else shapely.MultiPolygon()
    no_fly = shapely.affinity.scale(walls, 0.5, 0.5, origin=(0.0, 0.0))
    side = draw(st.integers(*sides))

    def place() -> tuple[float, float]:
        for _ in range(100):
            x, y = rng.random(2) if rng.random() < 0.5 else rng.integers(0, side, 2) / (side - 1)
            if not no_fly.buffer(1e-6).contains(shapely.Point(x, y)):
                return float(x), float(y)
        return 0.0, 0.0

    if no_fly.buffer(1e-6).contains(shapely.Point(0.0, 0.0)):
        no_fly = shapely.MultiPolygon()
    problem = cg.Problem(place(), place(), field, draw(st.sampled_from([0.0, 3.0, 20.0])), no_fly=no_fly)
    start_time = float(rng.choice([0.0, 7.0]))
    others = []
    for _ in range(draw(st.integers(0, 4))):
        path = rng.random((rng.integers(1, 4), 2)) if rng.random() < 0.5 else [problem.goal, problem.start]
        flight = Trajectory.along(path, start_time + rng.choice([-3.0, 0.0, 2.5]), step * rng.choice([0.5, 1.0]))
        if rng.random() < 0.4:
            # stays where it arrives
            times = np.append(flight.times, flight.ends + rng.integers(1, 40))
            flight = Trajectory(times, np.vstack([flight.points, flight.goal]))
        others.append((flight, float(rng.choice([0.0, 0.05, 0.15, 0.3]))))
    known = bool(draw(st.booleans()))
    matrix = matrix_of(problem, side, stored=draw(st.booleans()), start_known=known)
    return Task(problem, matrix, others, start_time, step, start_time + latest)


def assert_valid(task: Task, plan: SpaceTimePlan) -> None:
    """Check a plan with nothing of the planner's own: ends, speed, waits, separation, cost."""
    flight = plan.trajectory
    assert (flight is not None) == (plan.status in {SpaceTimeStatus.OPTIMAL, SpaceTimeStatus.FOUND})
    if flight is None:
        assert plan.cost == math.inf
        return
    problem = task.problem
    assert (flight.start, flight.goal) == (problem.start, problem.goal)
    assert (flight.begins, flight.ends <= task.latest + 1e-9) == (task.start_time, True)
    lengths, durations = np.hypot(*np.diff(flight.points, axis=0).T), np.diff(flight.times)
    moving = lengths > 0.0
    assert lengths[moving] == pytest.approx(task.step * durations[moving], rel=1e-9)
    assert durations[~moving] == pytest.approx(durations[~moving].round())
    judged = problem.evaluate(flight.points[np.append(moving, True)])
    risk = np.array([float(problem.field.density(flight.points[i])) for i in np.nonzero(~moving)[0]])
    waiting = (task.step * (1.0 + problem.k * risk) * durations[~moving]).sum()
    assert judged.feasible
    assert plan.cost == pytest.approx(judged.cost + waiting, rel=1e-9)
    assert plan.lower_bound <= plan.cost
    if plan.status is SpaceTimeStatus.OPTIMAL:
        assert plan.lower_bound == pytest.approx(plan.cost, rel=1e-9)
    else:
        assert plan.lower_bound < plan.cost
    for other, separation in task.others:
        # without any tolerance: the planner keeps a margin against rounding
        assert oracles.least_gap((flight.times, flight.points), (other.times, other.points)) >= separation
        approach = closest_approach(flight, other)
        assert approach is None or approach.distance >= separation


# What a plan promises


@examples(120)
@given(tasks())
def test_a_plan_keeps_every_separation_at_every_moment(task: Task) -> None:
    plan = task.plan(most_expansions=2000)
    assert_valid(task, plan)
    if plan.status is SpaceTimeStatus.TOO_CLOSE:
        here = np.array([task.start_time]), np.array([task.problem.start])
        gaps = [oracles.least_gap(here, (other.times, other.points)) - keep for other, keep in task.others]
        assert min(gaps) < 0.0


@examples(40)
@given(tasks())
def test_without_others_the_plan_is_the_optimum_of_the_cost_matrix(task: Task) -> None:
    alone = replace(task, others=[])
    plan = alone.plan()
    known = matrix_of(task.problem, task.matrix.graph.lattice.shape[0])  # type: ignore[union-attr]
    graph = known.graph
    assert graph.positions is not None
    source = int(np.nonzero((graph.positions == task.problem.start).all(axis=1))[0][0])
    if math.isinf(known.value(source)):
        assert plan.status is SpaceTimeStatus.NO_PATH
        return
    assert_valid(alone, plan)
    assert plan.status is SpaceTimeStatus.OPTIMAL
    assert plan.cost == pytest.approx(known.value(source), rel=1e-9, abs=1e-12)
    assert plan.expansions == 0
    # those that are far away, gone already or not there yet change nothing
    passed = Trajectory.along([task.problem.start, task.problem.goal], task.start_time - 100.0, 1.0)
    later = resting(task.problem.start, task.latest + 200.0, task.latest + 300.0)
    hindered = replace(task, others=[(passed, 0.2), (later, 0.2)]).plan()
    assert hindered.trajectory is not None
    assert plan.trajectory is not None
    assert plan.trajectory.waits == []
    assert hindered.trajectory.points.tolist() == plan.trajectory.points.tolist()


@examples(30)
@given(tasks(sides=(3, 6)))
def test_the_same_task_gives_the_same_plan_later_and_with_stored_weights(task: Task) -> None:
    def outcome(plan: SpaceTimePlan, shift: float = 0.0) -> Any:  # noqa: ANN401 - to be compared
        if plan.trajectory is None:
            return plan.status, plan.expansions
        rounded = (plan.trajectory.times - shift).round(6).tolist()
        return plan.status, plan.expansions, rounded, plan.trajectory.points.tolist()

    plan = task.plan(most_expansions=500)
    again = task.plan(most_expansions=500)
    moved = [(other.shifted(64.0), keep) for other, keep in task.others]
    later = replace(task, others=moved, start_time=task.start_time + 64.0, latest=task.latest + 64.0)

    assert outcome(again) == outcome(plan)
    assert outcome(later.plan(most_expansions=500), 64.0) == outcome(plan)
    weighed = replace(task, matrix=replace(task.matrix, graph=task.matrix.graph.with_weights_held()))
    assert outcome(weighed.plan(most_expansions=500)) == outcome(plan)


# Against brute force


def brute_force(task: Task) -> float:
    """Return the least cost of all plans by Dijkstra over all pairs of node and time, with no heuristic."""
    problem, graph = task.problem, task.matrix.graph
    assert graph.positions is not None
    nodes = [*map(tuple, graph.positions.tolist())]
    nodes += [] if problem.start in nodes else [problem.start]
    count = itertools.count()
    queue: list[tuple[float, int, float, tuple[float, float]]] = [(0.0, next(count), task.start_time, problem.start)]
    done: set[tuple[tuple[float, float], float]] = set()
    while queue:
        cost, _, time, here = heapq.heappop(queue)
        if here == problem.goal:
            return cost
        if (here, round(time, 7)) in done:
            continue
        done.add((here, round(time, 7)))
        for there in nodes:
            waits = there == here
            end = time + (1.0 if waits else math.dist(here, there) / task.step)
            if end > task.latest or (there, round(end, 7)) in done:
                continue
            motion = np.array([time, end]), np.array([here, there])
            if any(oracles.least_gap(motion, (o.times, o.points)) < keep * (1.0 + 1e-9) for o, keep in task.others):
                continue
            if waits:
                price = task.step * (1.0 + problem.k * float(problem.field.density(here)))
            else:
                price = float(problem.model.weights([here], [there])[0])
            if price < math.inf:
                heapq.heappush(queue, (cost + price, next(count), end, there))
    return math.inf


@examples(25)
@given(tasks(sides=(2, 3), step=0.25, latest=6.5))
def test_a_small_search_finds_what_brute_force_finds(task: Task) -> None:
    exact = task.plan(window=0.0)
    usual = task.plan(window=0.5)
    if exact.status is SpaceTimeStatus.TOO_CLOSE:
        return
    best = brute_force(task)

    assert_valid(task, exact)
    assert exact.status in {SpaceTimeStatus.OPTIMAL, SpaceTimeStatus.NO_PLAN, SpaceTimeStatus.NO_PATH}
    assert exact.cost == pytest.approx(best, rel=1e-9, abs=1e-12)
    assert (exact.lower_bound == math.inf) == (best == math.inf)
    # what merges arrivals says no more than it knows
    assert usual.lower_bound <= best * (1.0 + 1e-9)
    assert usual.cost >= best * (1.0 - 1e-9)
    assert usual.status is not SpaceTimeStatus.NO_PLAN or best == math.inf


@examples(40)
@given(tasks(), st.floats(0.0, 1.0))
def test_the_rest_of_a_plan_never_costs_less_than_a_new_bound(task: Task, part: float) -> None:
    plan = task.plan(most_expansions=2000)
    if plan.trajectory is None:
        return
    times = plan.trajectory.times
    now = times[0] + part * (times[-1] - times[0])
    before = times[times <= now][-1]
    # whole ticks later: the rest of a wait is a move that a search considers, too
    middle = float(before + math.floor(now - before))
    rest = plan.trajectory.part(middle, math.inf)
    assert rest is not None
    again = replace(
        task, problem=replace(task.problem, start=rest.start), start_time=middle, latest=max(task.latest, rest.ends)
    ).plan(most_expansions=2000)
    moving = np.append((np.diff(rest.points, axis=0) != 0.0).any(axis=1), True)
    waiting = sum(task.step * (1 + task.problem.k * float(task.problem.field.density(p))) * n for p, n in rest.waits)
    assert again.status is not SpaceTimeStatus.TOO_CLOSE
    # the rest of a committed plan can always be flown
    assert again.lower_bound <= (task.problem.evaluate(rest.points[moving]).cost + waiting) * (1.0 + 1e-9) + 1e-12


# Known situations

# Beyond the bounds, because a path may touch an area, and so follow the border of the map.
LANE = shapely.unary_union([shapely.box(0.15, -1.0, 0.85, 0.45), shapely.box(0.15, 0.55, 0.85, 2.0)])
POCKET = LANE.difference(shapely.box(0.45, 0.5, 0.55, 0.85))


def head_on(no_fly: BaseGeometry, *, stays: float = 0.0, latest: float = 200.0) -> Task:
    """Let two fly towards each other through a lane; the other may stay at its end."""
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5), no_fly=no_fly)
    other = Trajectory.along([(1.0, 0.5), (0.0, 0.5)], 0.0, 0.05)
    if stays:
        other = Trajectory([*other.times, other.ends + stays], [*other.points, other.goal])
    return Task(problem, matrix_of(problem, 11), [(other, 0.1)], 0.0, 0.05, latest)


def on_points(problem: cg.Problem, *between: Point) -> CostMatrix:
    """Compute the cost matrix of a graph of few nodes."""
    graph = cg.GeometricGraph.complete([problem.goal, *between], problem.field, problem.k, no_fly=problem.no_fly)
    return cost_matrix(graph, 0)


def test_a_pocket_in_a_lane_lets_one_wait_for_the_other() -> None:
    # in the pocket, waiting costs least
    field = cg.RiskField([cg.Threat(0.0, 0.5, spread=0.02), cg.Threat(0.5, 0.5, spread=0.02)])
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5), field, 2.0, no_fly=POCKET)
    other = Trajectory.along([(1.0, 0.5), (0.0, 0.5)], 8.0, 0.05)
    task = Task(problem, on_points(problem, (0.5, 0.5), (0.5, 0.65)), [(other, 0.1)], 0.0, 0.05, 60.0)
    plan = task.plan(window=0.0)
    assert_valid(task, plan)
    assert plan.trajectory is not None
    assert plan.trajectory.waits == [((0.5, 0.65), 5.0)]
    assert plan.cost == pytest.approx(brute_force(task))


def passing(path: Sequence[Point], separation: float, start: Point, goal: Point, *, step: float = 0.05) -> Task:
    """Let another fly along a path meanwhile."""
    problem = cg.Problem(start, goal, cg.RiskField([cg.Threat(0.5, 0.75, spread=0.05)]), 10.0)
    return Task(problem, matrix_of(problem, 9), [(Trajectory.along(path, 0.0, step), separation)], 0.0, step, 100.0)


@pytest.mark.parametrize(
    ("task", "status"),
    [
        # one waits beside the lane
        (head_on(LANE), SpaceTimeStatus.FOUND),
        # one comes over the start, and is left behind in time
        (passing([(0.0, 0.5), (1.0, 0.5)], 0.2, (0.5, 0.5), (0.5, 1.0)), SpaceTimeStatus.OPTIMAL),
        # one flies beside it, exactly at the separation
        (passing([(0.0, 0.5), (1.0, 0.5)], 0.25, (0.0, 0.25), (1.0, 0.25)), SpaceTimeStatus.OPTIMAL),
        # head-on, as fast as the separation is wide: at whole ticks the two are never near
        (passing([(1.0, 0.5), (0.0, 0.5)], 0.2, (0.0, 0.5), (1.0, 0.5), step=1.0 / 3.0), SpaceTimeStatus.FOUND),
    ],
)
def test_there_is_a_way_past_one_that_flies(task: Task, status: SpaceTimeStatus) -> None:
    plan = task.plan()
    assert_valid(task, plan)
    assert plan.status is status
    (other, separation), alone = task.others[0], replace(task, others=[]).plan()
    assert alone.trajectory is not None
    near = closest_approach(alone.trajectory, other)
    # where it could have kept its way, it did
    assert (plan.cost == alone.cost) == (near is not None and near.distance >= separation)


def test_a_lane_that_stays_blocked_has_no_plan() -> None:
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5), no_fly=LANE)
    blocked = [(resting((0.5, 0.5), 0, 60), 0.1)]
    task = Task(problem, matrix_of(problem, 11), blocked, 0.0, 0.1, 50.0)
    plan = task.plan()
    # arrivals were merged: nothing is proven
    assert (plan.status, plan.trajectory) == (SpaceTimeStatus.NOT_FOUND, None)
    assert "0.25 ticks apart counted as one" in plan.message
    # once it is gone, the way is free
    assert replace(task, latest=100.0).plan().trajectory is not None


def test_a_start_sealed_in_by_others_has_no_plan() -> None:
    angles = 2.0 * math.pi * np.arange(8) / 8
    ring = [(0.5 + 0.2 * math.cos(a), 0.5 + 0.2 * math.sin(a)) for a in angles]
    problem = cg.Problem((0.5, 0.5), (1.0, 0.5))
    others = [(resting(place, 0.0, 100.0), 0.12) for place in ring]
    sealed = Task(problem, matrix_of(problem, 8), others, 0.0, 0.05, 90.0)
    plan = sealed.plan()
    assert (plan.status, plan.lower_bound, plan.cost) == (SpaceTimeStatus.NO_PLAN, math.inf, math.inf)
    assert "tick 90" in plan.message
    # with one of them gone it flies out there
    opened = replace(sealed, others=others[1:])
    assert_valid(opened, opened.plan())
    assert opened.plan().trajectory is not None


def test_it_waits_as_many_ticks_as_it_must() -> None:
    # both would be in the middle at tick 10; after w ticks of waiting they are 0.05 w / sqrt(2) apart at best
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5), cg.RiskField([cg.Threat(0.0, 0.5, spread=0.05, peak=0.5)]), 4.0)
    across = Trajectory.along([(0.5, 0.0), (0.5, 1.0)], 0.0, 0.05)
    task = Task(problem, on_points(problem), [(across, 0.2)], 0.0, 0.05, 60.0)
    plan = task.plan()
    assert_valid(task, plan)
    assert plan.trajectory is not None
    assert plan.trajectory.waits == [((0.0, 0.5), 6.0)]
    # a tick costs as flying through the same risk would: 0.05 (1 + 4 * 0.5)
    assert plan.cost == pytest.approx(problem.evaluate([problem.start, problem.goal]).cost + 6 * 0.15)
    assert plan.status is SpaceTimeStatus.OPTIMAL


def test_waiting_is_tested_like_flying() -> None:
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5))
    across = Trajectory.along([(0.5, 0.0), (0.5, 1.0)], 0.0, 0.05)
    # at the ticks 4 and 5 this one is on either side of the start, and not near; between them it flies over it
    over = Trajectory([0.0, 4.0, 5.0], [(0.0, 0.0), (0.0, 0.2), (0.0, 0.8)])
    task = Task(problem, on_points(problem), [(across, 0.2), (over, 0.2)], 0.0, 0.05, 60.0)
    at_ticks = [math.dist(over.at(t), problem.start) for t in range(6)]
    assert min(at_ticks) >= 0.2
    assert task.plan().status is SpaceTimeStatus.NO_PLAN
    assert replace(task, others=task.others[:1]).plan().status is SpaceTimeStatus.OPTIMAL
    assert replace(task, others=task.others[1:]).plan().status is SpaceTimeStatus.OPTIMAL


def test_in_a_hurry_it_flies_through_what_it_would_fly_around() -> None:
    field = cg.RiskField([cg.Threat(0.5, 0.5, spread=0.1)])
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5), field, 50.0)
    task = Task(problem, matrix_of(problem, 11), [], 0.0, 0.05, 100.0)
    around, hurried = task.plan(), replace(task, latest=20.0).plan()
    late = replace(task, latest=19.9).plan()
    for plan in (around, hurried):
        assert plan.status is SpaceTimeStatus.OPTIMAL
    assert_valid(replace(task, latest=20.0), hurried)
    assert around.trajectory is not None
    assert hurried.trajectory is not None
    assert hurried.trajectory.length == pytest.approx(1.0)
    assert hurried.cost > 2.0 * around.cost
    assert (late.status, late.expansions) == (SpaceTimeStatus.NO_PLAN, 1)


@examples(200)
@given(seeds)
def test_what_passes_at_exactly_the_separation_is_never_found_nearer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, goal = rng.random((2, 2))
    # beside the middle of the only edge there is, as far away as rounding allows; looked at in pieces it may be nearer
    aside = (start + goal) / 2.0 + 0.1 * np.array([goal[1] - start[1], start[0] - goal[0]])
    separation = 0.1 * float(np.hypot(*(goal - start)))
    problem = cg.Problem(tuple(start), tuple(goal))
    times = np.concatenate([[0.0], np.sort(90.0 * rng.random(200)), [99.0]])
    others = [(Trajectory(times, np.tile(aside, (len(times), 1))), separation)]
    task = Task(problem, on_points(problem), others, 0.0, 0.05, 90.0)
    assert_valid(task, task.plan())


def test_each_way_to_fail_says_why() -> None:
    near = [(resting((0.0, 0.55), 0, 9), 0.1)]
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5))
    task = Task(problem, matrix_of(problem, 11), near, 0.0, 0.1, 50.0)
    plan = task.plan()
    assert (plan.status, plan.lower_bound) == (SpaceTimeStatus.TOO_CLOSE, math.inf)
    assert "trajectory 0 is 0.05 away" in plan.message

    wall = replace(problem, no_fly=shapely.box(0.4, -1.0, 0.6, 2.0))
    walled = replace(task, problem=wall, matrix=matrix_of(wall, 11), others=[])
    assert walled.plan().status is SpaceTimeStatus.NO_PATH

    gave_up = head_on(LANE).plan(most_expansions=3)
    assert (gave_up.status, gave_up.expansions) == (SpaceTimeStatus.NOT_FOUND, 3)
    assert "3 expansions" in gave_up.message
    assert gave_up.lower_bound <= head_on(LANE).plan().cost


def test_start_and_goal_may_be_the_same() -> None:
    problem = cg.Problem((0.3, 0.3), (0.3, 0.3))
    plan = Task(problem, matrix_of(problem, 5), [], 3.0, 0.1, 9.0).plan()
    assert plan.trajectory is not None
    assert (plan.status, plan.cost, plan.trajectory.times.tolist()) == (SpaceTimeStatus.OPTIMAL, 0.0, [3.0])


def test_nodes_outside_the_bounds_are_not_used() -> None:
    wall = shapely.box(0.4, -0.05, 0.6, 0.8)
    problem = cg.Problem((0.1, 0.1), (0.9, 0.1), no_fly=wall)
    graph = problem.on_lattice(cg.Lattice(13, bounds=(-0.1, -0.1, 1.1, 1.1)))
    matrix = cost_matrix(graph.graph, graph.target)
    plan = plan_in_space_time(problem, matrix, [], start_time=0.0, step=0.1, latest=100.0)
    assert plan.trajectory is not None
    assert plan.trajectory.points.min() >= 0.0
    assert plan.cost > matrix.value(graph.source) + 0.1


def wrong_tasks() -> list[tuple[dict[str, Any], str]]:
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5))
    other = resting((0.5, 0.9), 0, 1)
    unlike = replace(problem, k=1.0)
    with pytest.warns(ImproperFieldWarning):
        improper = replace(problem, field=cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=2.0)], improper=True))
    chain = cg.GeometricGraph.from_matrix([[0, 1], [1, 0]])
    on_lattice = problem.on_lattice(3)
    dearer = replace(on_lattice.graph, weights=DenseWeights(2.0 * on_lattice.graph.weight_matrix()))
    return [
        ({"step": 0.0}, "step is 0"),
        ({"latest": math.nan}, "latest is nan"),
        ({"start_time": math.inf}, "start_time is inf"),
        ({"others": [(other, -0.1)]}, "separation from trajectory 0 is -0.1"),
        ({"problem": unlike}, "another field, k or no-fly area"),
        ({"problem": improper, "matrix": matrix_of(improper, 3)}, "peaks above 1"),
        ({"matrix": cost_matrix(chain, 0)}, "another field, k or no-fly area"),
        ({"matrix": cost_matrix(dearer, on_lattice.target)}, "not those of the problem"),
        ({"matrix": matrix_of(replace(problem, goal=(0.5, 0.5)), 3)}, "leads to"),
    ]


@pytest.mark.parametrize(("wrong", "message"), wrong_tasks())
def test_what_is_wrong_is_refused(wrong: dict[str, Any], message: str) -> None:
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5))
    right = {"problem": problem, "matrix": matrix_of(problem, 3), "others": []}
    right |= {"start_time": 0.0, "step": 0.1, "latest": 50.0}
    call: Callable[..., SpaceTimePlan] = plan_in_space_time
    assert call(**right).status is SpaceTimeStatus.OPTIMAL
    with pytest.raises(ProblemError, match=message):
        call(**right | wrong)


@examples(15)
@given(seeds)
def test_all_that_plan_one_after_the_other_keep_their_separation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    field = cg.RiskField([cg.Threat(x, y, spread=0.05) for x, y in rng.random((4, 2))])
    around = 2.0 * math.pi * (np.arange(7) + 0.3 * rng.random(7)) / 7
    ring = 0.5 + 0.45 * np.stack([np.cos(around), np.sin(around)], axis=1)
    flights: list[Trajectory] = []
    for start, goal in zip(ring, np.roll(ring, 3, axis=0), strict=True):
        problem = cg.Problem(tuple(start), tuple(goal), field, 5.0)
        others = [(flight, 0.1) for flight in flights]
        plan = plan_in_space_time(problem, matrix_of(problem, 10), others, start_time=0.0, step=0.04, latest=200.0)
        if plan.trajectory is not None:
            flights.append(plan.trajectory)
    assert len(flights) >= 5
    for a, b in itertools.combinations(flights, 2):
        assert oracles.least_gap((a.times, a.points), (b.times, b.points)) >= 0.1

"""Flyable paths: what holds for every one of them, and what they tend to."""

import math
from unittest import mock

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, few

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Solution, Status
from cgla_graph.testing.strategies import problems, seeds
from cgla_graph.turning import bending, fillet_kernels
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.flyable import Flyable, plan_flyable

bearings = st.one_of(st.none(), st.floats(0.0, 360.0))


def kinks(curve: Curve) -> FloatArray:
    """By how much the heading jumps between pieces."""
    inner = np.arange(len(curve.pieces) - 1)
    jumps = curve.headings(inner + 1, np.zeros(len(inner))) - curve.headings(inner, np.ones(len(inner)))
    return np.abs(2.0 * np.sin(0.5 * jumps))


def assert_flyable(problem: Problem, found: Flyable) -> None:
    """Check everything that is promised of a flyable path by dense samples, and its cost by a fine polyline."""
    curve = found.curve
    assert np.array_equal(curve.pieces[1:, :2], curve.pieces[:-1, 2:4])
    assert kinks(curve).max(initial=0.0) < 1e-6
    assert curve.least_radius >= found.turn_radius
    which, shares, points = curve.at(np.linspace(0.0, curve.length, 5000))
    assert np.allclose(points[[0, -1]], [problem.start, problem.goal], atol=1e-12)
    assert np.allclose(np.clip(points, 0.0, 1.0), points, rtol=0.0, atol=1e-9)
    if problem.no_fly is not None:
        places = shapely.points(points)
        inside = shapely.within(places, problem.no_fly)
        assert shapely.distance(places[inside], problem.no_fly.boundary).max(initial=0.0) < 1e-9
    headings = np.degrees(math.pi / 2 - curve.headings(which[[0, -1]], shares[[0, -1]]))
    for heading, asked in zip(headings, (found.start_heading, found.goal_heading), strict=True):
        assert asked is None or abs(math.remainder(heading - asked, 360.0)) < 1e-4
    fine = problem.evaluate(curve.points(1e-6))
    assert found.cost == pytest.approx(fine.cost, rel=1e-3)
    assert found.length == pytest.approx(fine.length, rel=1e-3)


@examples(20)
@given(problem=problems(), start_heading=bearings, goal_heading=bearings, seed=seeds)
def test_what_is_found_may_be_flown(
    problem: Problem, start_heading: float | None, goal_heading: float | None, seed: int
) -> None:
    radius = 10.0 ** np.random.default_rng(seed).uniform(-2.5, -0.7)
    headings = {"start_heading": start_heading, "goal_heading": goal_heading}
    # (a search that ends in vain takes seconds)
    with mock.patch.object(bending, "MOST_POSES", 50_000):
        found = plan_flyable(problem, np.array([problem.start, problem.goal]), radius, **headings, bound=0.0)
    if found.status.has_path and problem.start != problem.goal:
        assert_flyable(problem, found)
    else:
        assert problem.start == problem.goal or found.message.startswith("no curve of turn radius")


@few
@given(seed=seeds)
def test_the_gradient_of_the_barrier_is_its_difference(seed: int) -> None:
    rng = np.random.default_rng(seed)
    field = RiskField([Threat(*rng.random(2).tolist(), spread=0.1, peak=0.8) for _ in range(4)])
    problem = Problem((0.05, 0.05), (0.95, 0.9), field, k=10.0, no_fly=shapely.box(0.4, 0.3, 0.5, 0.45))
    points = np.array([(0.05, 0.05), (0.3, 0.1), (0.56, 0.25), (0.6, 0.5), (0.3, 0.97), (0.95, 0.9)])
    points[1:-1] += rng.uniform(-0.02, 0.02, (4, 2))
    rest = (0.05, problem.model.kernel_model(), problem.bounds, (0.2, 0.3, 0.05, 0.0), 0.01, np.zeros((2, 2)))
    gradient, other = np.empty_like(points), np.empty_like(points)
    assert fillet_kernels.barrier(points, *rest, gradient) < math.inf
    for i in range(1, len(points) - 1):
        for j in range(2):
            step = np.zeros_like(points)
            step[i, j] = 1e-6
            ends = [fillet_kernels.barrier(points + sign * step, *rest, other) for sign in (1.0, -1.0)]
            assert gradient[i, j] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5, abs=1e-6)


@pytest.mark.slow
def test_with_smaller_radii_the_cost_tends_to_that_of_the_polyline() -> None:
    """A corner that is rounded costs more in proportion to the radius."""
    wall = shapely.box(0.45, -0.1, 0.55, 0.7)
    problem = Problem((0.1, 0.1), (0.9, 0.2), RiskField([Threat(0.8, 0.6, 0.1)]), k=5.0, no_fly=wall)
    solution = cg.solve(problem)
    radii = np.array([1e-2, 1e-3, 1e-5])
    more = np.array([solution.flyable(radius).cost for radius in radii]) / solution.cost - 1.0
    assert (more > -1e-4).all()
    assert (more[1:] < 0.5 * more[:-1]).all()
    assert abs(more[-1]) < 2e-5


def test_a_turn_in_a_maze_is_flown_or_its_place_is_told() -> None:
    """In a corridor of width 0.2 that turns back, curves of radius 0.05 turn, and those of radius 0.3 do not."""
    wall = shapely.box(-0.1, 0.48, 0.8, 0.52)
    problem = Problem((0.1, 0.4), (0.1, 0.6), bounds=(0, 0.3, 1, 0.7), no_fly=wall)
    found = cg.solve(problem).flyable(0.05)
    assert found.status is Status.FOUND
    assert found.lower_bound <= found.cost <= 1.1 * found.lower_bound
    none = cg.solve(problem).flyable(0.3)
    assert none.status is Status.NOT_FOUND
    assert "no curve of turn radius 0.3 was found: the search came as far as (0." in none.message
    assert none.cost == math.inf


def test_what_is_in_the_way_of_a_start_is_told() -> None:
    problem = Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.0, 0.6, 0.2, 0.7))
    none = cg.solve(problem).flyable(0.3, start_heading=320)
    assert none.status is Status.NOT_FOUND
    assert none.message.endswith(
        "from there, a turn to the left leaves the bounds and a turn to the right crosses the no-fly area"
    )


def test_a_heading_leads_the_other_way_first() -> None:
    problem = Problem((0.5, 0.5), (0.9, 0.5))
    west = cg.solve(problem).flyable(0.05, start_heading=270)
    assert west.curve.headings(np.array([0]), np.array([0.0])) == pytest.approx([math.pi], abs=1e-6)
    # a half turn, and on: shorter than Dubins' words to any one heading at the goal
    assert 0.4 + math.pi * 0.05 - 0.05 < west.length < 0.4 + math.pi * 0.05 + 0.06


def test_clearance_holds_for_the_curve() -> None:
    problem = Problem((0.1, 0.1), (0.9, 0.1), no_fly=shapely.box(0.45, -0.1, 0.55, 0.5), clearance=0.05)
    found = cg.solve(problem).flyable(0.1)
    dense = shapely.LineString(found.curve.points(1e-7))
    assert 0.05 - 1e-9 <= found.clearance == pytest.approx(float(dense.distance(problem.no_fly)), abs=1e-6)


def test_errors_say_what_was_wrong() -> None:
    solution = cg.solve(Problem((0.1, 0.1), (0.9, 0.9)))
    with pytest.raises(ProblemError, match="turn_radius is 0; it must be above 0"):
        solution.flyable(0.0)
    with pytest.raises(ProblemError, match="start_heading is nan; give a finite number"):
        solution.flyable(0.1, start_heading=math.nan)
    with pytest.raises(ProblemError, match="has lost its problem"):
        Solution(Status.FOUND).flyable(0.1)


def test_waypoints_of_arcs_stay_outside_and_within_the_tolerance() -> None:
    """The curve touches the corners: chords cut them, tangents do not."""
    wall = shapely.box(0.45, -0.1, 0.55, 0.5)
    problem = Problem((0.1, 0.1), (0.9, 0.1), no_fly=wall)
    found = cg.solve(problem).flyable(0.1)
    curve = shapely.LineString(found.curve.points(1e-8))
    assert not problem.evaluate(found.curve.points(0.005)).feasible
    for asked in (0.02, 0.005, 1e-4):
        waypoints, within = found.waypoints(asked)
        assert within <= asked
        assert problem.evaluate(waypoints).feasible
        assert shapely.hausdorff_distance(curve, shapely.LineString(waypoints), densify=0.01) <= within + 1e-6
    assert problem.evaluate(found.path).feasible
    with pytest.raises(ProblemError, match="there is no path to make waypoints of"):
        Flyable(Status.NOT_FOUND).waypoints()

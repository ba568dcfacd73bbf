"""The visibility graph: tangents around a disc, the shortest path around polygons, and ways out where they seal it."""

import math

import numpy as np
import oracles
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st
from quick_solvers import RING
from strategies import few, usual

import cgla_graph as cg
from cgla_graph._types import BoolArray, FloatArray, Point
from cgla_graph.scenarios.scenario import load_scenario, shipped
from cgla_graph.testing.strategies import fields, points, polygons


def around_disc(start: Point, goal: Point, centre: Point, radius: float) -> float:
    """Return the length of the shortest path around a disc that is in the way: two tangents and an arc."""
    ends = np.subtract([start, goal], centre)
    far = np.hypot(*ends.T)
    between = math.acos(float(np.prod(far) ** -1 * (ends[0] @ ends[1])))
    return float(np.sqrt(far**2 - radius**2).sum() + radius * (between - np.arccos(radius / far).sum()))


@pytest.mark.parametrize(("start", "goal"), [((0.1, 0.5), (0.9, 0.5)), ((0.13, 0.41), (0.87, 0.66))])
def test_around_one_disc_it_approaches_tangents_and_arc(start: Point, goal: Point) -> None:
    """From above; with twice as many corners, a fourth of the excess is left."""
    field = cg.RiskField([cg.Threat(0.5, 0.5, spread=0.1)])
    problem = cg.Problem(start, goal, field)
    best = around_disc(start, goal, (0.5, 0.5), 0.2)
    counts = 2 ** np.arange(3, 10)
    excess = [cg.solve(problem, "visibility-graph", spreads=2, corners=int(n)).length / best - 1.0 for n in counts]
    assert min(excess) > 0.0
    slope = np.polyfit(np.log(counts), np.log(excess), 1)[0]
    assert slope == pytest.approx(-2.0, abs=0.15)
    assert excess[-1] < 1e-5


halves = st.integers(0, 8).map(lambda i: i / 2)


def one(area: shapely.Polygon) -> shapely.MultiPolygon:
    return shapely.MultiPolygon([area])


@few
@given(polygons(), st.tuples(halves, halves), st.tuples(halves, halves))
@example(one(shapely.box(0.5, 0, 1, 0.5)), (0, 0), (1, 0))
@example(one(shapely.box(0.5, 0, 1, 0.5)), (0.5, 0), (1, 0))
@example(one(shapely.box(0, 0, 0.5, 0.5)), (0, 0), (1, 0))
@example(one(shapely.box(0, 3, 2, 4)), (0, 3), (2, 4))
@example(one(shapely.Polygon([(1, 4), (2, 4), (3.5, 2.5)])), (2, 4), (3, 3))
@example(one(shapely.Polygon([(0, 0.5), (3, 2.5), (2, 1.5)])), (1.5, 1.5), (4, 1.5))
@example(one(shapely.Polygon([(0, 0), (1, 0.5), (0.5, 1)])), (0, 1), (1, 0))
@example(one(shapely.Polygon([(0.5, 2), (4, 3.5), (1, 4)])), (4, 3.5), (0, 0))
def test_around_areas_it_is_the_shortest_path(area: shapely.MultiPolygon, start: Point, goal: Point) -> None:
    """So says an independent search; where that finds none, the answer is that there is none."""
    bounds = (0.0, 0.0, 4.0, 4.0)

    def is_closed(starts: FloatArray, ends: FloatArray) -> BoolArray:
        return oracles.crosses(area, starts, ends) | oracles.meets_closed_border(area, bounds, starts, ends)

    assume(start != goal)
    both = np.array([start, goal])
    if is_closed(both, both).any():
        with pytest.raises(cg.errors.ProblemError, match=r"is inside the no-fly area|side there is closed"):
            cg.Problem(start, goal, bounds=bounds, no_fly=area)
        return
    problem = cg.Problem(start, goal, bounds=bounds, no_fly=area)
    answer = cg.solve(problem, "visibility-graph")
    wanted = oracles.shortest_around(start, goal, shapely.get_coordinates(area), is_closed)
    assert answer.length == pytest.approx(wanted, rel=1e-12)
    assert answer.status is (cg.Status.FOUND if math.isfinite(wanted) else cg.Status.NO_PATH)


def clearances(problem: cg.Problem, path: FloatArray) -> list[float]:
    """Return how far the path keeps from each threat, in spreads."""
    line = shapely.LineString(path)
    return [line.distance(shapely.Point(t.x, t.y)) / t.spread for t in problem.field.threats]


@usual
@given(fields(max_threats=6), points, points, st.floats(0.3, 4.0), st.integers(3, 20))
def test_there_is_always_a_path_and_it_keeps_out_of_the_discs(
    field: cg.RiskField, start: Point, goal: Point, spreads: float, corners: int
) -> None:
    """Of all discs whose polygons leave start and goal outside, unless the answer says that they are smaller."""
    assume(start != goal)
    problem = cg.Problem(start, goal, field, k=10.0)
    answer = cg.solve(problem, "visibility-graph", spreads=spreads, corners=corners)
    assert answer.status is cg.Status.FOUND
    used = float(answer.message.rsplit(maxsplit=1)[-1]) if answer.message else spreads
    assert answer.message.startswith("the threats seal the way") or used == spreads
    for threat, kept in zip(field.threats, clearances(problem, answer.path), strict=True):
        nearest = min(math.dist((threat.x, threat.y), end) for end in (start, goal)) / threat.spread
        if nearest > used / math.cos(math.pi / corners):
            assert kept >= used * (1.0 - 1e-5)


def test_a_start_and_a_goal_inside_of_discs_are_left_straight_outwards() -> None:
    """The polygons end where start and goal are, so that no way leads deeper into them."""
    threats = [cg.Threat(0.2, 0.2, spread=0.1), cg.Threat(0.8, 0.8, spread=0.1), cg.Threat(0.9, 0.9, spread=0.05)]
    problem = cg.Problem((0.15, 0.15), (0.9, 0.9), cg.RiskField(threats), k=10.0)
    answer = cg.solve(problem, "visibility-graph", corners=64)
    assert answer.status is cg.Status.FOUND
    assert answer.message == ""
    nearest = [problem.start, problem.goal, problem.goal]
    ends = [math.dist((t.x, t.y), end) / t.spread for t, end in zip(threats, nearest, strict=True)]
    np.testing.assert_allclose(clearances(problem, answer.path), ends, rtol=2e-3, atol=1e-12)


def test_discs_that_seal_the_way_become_smaller_and_areas_do_not() -> None:
    wall = [cg.Threat(0.5, y, spread=0.1) for y in np.linspace(0.0, 1.0, 6)]
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField(wall), k=10.0)
    answer = cg.solve(problem, "visibility-graph")
    assert answer.status is cg.Status.FOUND
    assert answer.message == "the threats seal the way at 2.5 spreads, not at 0.5"
    assert min(clearances(problem, answer.path)) >= 0.5
    sealed = cg.solve(cg.Problem((0.1, 0.1), (0.8, 0.8), cg.RiskField(wall), k=1.0, no_fly=RING), "visibility-graph")
    assert (sealed.status, sealed.message) == (cg.Status.NO_PATH, "the no-fly areas seal the way")


@pytest.mark.parametrize("name", shipped())
def test_on_the_shipped_maps_it_finds_a_way(name: str) -> None:
    problem = load_scenario(name).problem
    answer = cg.solve(problem, "visibility-graph")
    assert answer.status is cg.Status.FOUND
    assert answer.evaluations > 0
    if not problem.field.threats:
        assert answer.length <= cg.solve(problem, "fast-marching").length

"""On a map in degrees, bounds of all paths hold on the Earth, from every function that proves one."""

import math
import pickle
from collections.abc import Iterator

import numpy as np
import pyproj
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray, Point
from cgla_graph.certificate.certificate import FIRST_CELLS, prove
from cgla_graph.certificate.costs import cost_bounds, lower_by_scale, needed_for, proven, rounding
from cgla_graph.certificate.subsolution import Level
from cgla_graph.eikonal import cell_runs
from cgla_graph.model.earth import POLAR_RADIUS, LocalProjection
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.scenario import scenario_from_toml
from cgla_graph.solvers.continuous.hybrid import Hybrid
from cgla_graph.turning.flyable import plan_flyable

GEOD = pyproj.Geod(ellps="WGS84")
HELSINKI, TAMPERE = (24.94, 60.17), (23.76, 61.50)
CELLS = FIRST_CELLS**2
#: Chords of the bent lines that legs are on the Earth, and sums along them, are off by less.
CHORDS = 1e-6


def on_earth(problem: Problem, path: FloatArray) -> tuple[float, float]:
    """Measure length and risk on WGS84 along legs that are straight on the plane."""
    assert problem.projection is not None
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    points = shapely.get_coordinates(shapely.segmentize(shapely.LineString(path), length / 3000.0))
    steps = np.array(GEOD.line_lengths(*problem.projection.inverse(points).T))
    risk = problem.field.density(0.5 * (points[1:] + points[:-1]))
    return float(steps.sum()), float((steps * risk).sum())


def around_a_box(k: float = 0.0) -> Problem:
    """Build a map of 900 km on which every path makes a detour."""
    return Problem.in_degrees(
        (-8.0, 60.0), (8.0, 60.0), bounds=(-12.0, 57.0, 12.0, 71.0), no_fly=shapely.box(-7.0, 56.0, 7.0, 68.0), k=k
    )


@pytest.mark.slow
def test_a_path_does_not_undercut_the_bound_that_is_proven_with_it() -> None:
    problem = around_a_box()
    path = cg.solve(problem, tolerance=None).path
    found = cg.lower_bound(problem, 3e-4, path=path, max_cells=800_000)
    length, _ = on_earth(problem, path)
    assert length == pytest.approx(2_370_496.7, abs=1.0)
    assert 0.995 * length < found.lower_bound <= length
    # the plane's own cost is farther away, and the message says why
    assert not found.reached
    assert found.upper_bound > 1.001 * length


@pytest.mark.slow
def test_where_the_rest_is_distortion_the_message_says_so() -> None:
    wall = shapely.box(-5.0, 20.0, 5.0, 60.0)
    problem = Problem.in_degrees((-25.0, 40.0), (25.0, 40.0), bounds=(-30.0, 20.0, 30.0, 75.0), no_fly=wall)
    solution = cg.solve(problem, tolerance=0.005)
    length, _ = on_earth(problem, solution.path)
    assert length > 5e6
    assert 0.99 * length < solution.lower_bound <= length
    assert "for the distortion of the flat map" in solution.certificate.message


def test_around_half_the_earth_the_geodesic_is_the_bound() -> None:
    projection = LocalProjection(0.0, 0.0)
    side = 1.95e7
    box = shapely.box(-1e6, -2e6, 1e6, 2e6)
    problem = Problem((-5e6, 0.0), (5e6, 0.0), bounds=(-side, -1e7, side, 1e7), no_fly=box, projection=projection)
    found = prove(problem, tolerance=0.01)
    assert found.lower_bound == pytest.approx(problem.least_length, rel=1e-12)
    assert "only the geodesic" in found.message


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    """Draw maps of 10 to 6,000 km, up to the poles, across the antimeridian, projected around their middle or not."""
    start = draw(st.floats(-180.0, 180.0)), draw(st.floats(-89.0, 89.0))
    distance = 10.0 ** draw(st.sampled_from([4.0, 5.0, 6.3, 6.6]))
    goal = GEOD.fwd(*start, draw(st.floats(-180.0, 180.0)), distance)[:2]
    middle = LocalProjection.between(start, goal)
    beside = GEOD.fwd(middle.longitude, middle.latitude, draw(st.floats(-180.0, 180.0)), 0.4 * distance)[:2]
    projection = draw(st.sampled_from([middle, LocalProjection(*beside)]))
    ends = projection.forward([start, goal])
    low, high = (float(extreme) for extreme in (ends.min() - 0.4 * distance, ends.max() + 0.4 * distance))
    places = st.tuples(*[st.floats(-0.6, 0.6)] * 2, st.floats(0.1, 0.4))
    drawn = draw(st.lists(places, max_size=2))
    threats = [cg.Threat(x * distance, y * distance, spread * distance, 0.9) for x, y, spread in drawn]
    box = None
    if draw(st.booleans()):
        x, y = draw(st.floats(-0.2, 0.2)) * distance, draw(st.floats(-0.3, 0.3)) * distance
        box = shapely.box(x - 0.05 * distance, y - 0.3 * distance, x + 0.05 * distance, y + 0.3 * distance)
    first, last = ((float(x), float(y)) for x, y in ends)
    if box is not None and any(box.intersects(shapely.Point(end)) for end in (first, last)):
        box = None
    rasters = []
    if draw(st.booleans()):
        cells = np.random.default_rng(draw(st.integers(0, 9))).uniform(0.0, 0.9, (5, 5))
        rasters = [cg.RasterRisk(cells, (low, low, high, high))]
    field = cg.RiskField(threats, rasters=rasters)
    k = draw(st.sampled_from([0.0, 2.0]))
    return Problem(first, last, field, k, (low, low, high, high), box, projection=projection)


def paths_of(problem: Problem, found: Solution) -> Iterator[FloatArray]:
    """Yield feasible paths: the best one found, and ones beside it."""
    yield found.path
    rng = np.random.default_rng(1)
    middle = 0.5 * (found.path[1:] + found.path[:-1])
    for size in (1e-3, 1e-2, 1e-1):
        moved = middle + rng.normal(0.0, size * problem.shorter_side, middle.shape)
        path = np.vstack([problem.start, moved, problem.goal])
        if problem.evaluate(path).feasible:
            yield path


@pytest.mark.slow
@examples(8)
@given(problem=problems())
def test_no_bound_of_any_function_is_above_a_path_on_the_earth(problem: Problem) -> None:
    found = cg.solve(problem, Hybrid(points=150, candidates=2, tolerance=0.02))
    if not found.status.has_path:
        return
    bounds = [
        found.lower_bound,
        found.certificate.lower_bound,
        cg.lower_bound(problem, 0.002, path=found.path, max_cells=CELLS).lower_bound,
        cg.solve(problem, "straight-line").lower_bound,
        plan_flyable(problem, found.path, 0.02 * problem.shorter_side).lower_bound,
    ]
    measured = [on_earth(problem, path) for path in paths_of(problem, found)]
    costs = [length + problem.k * risk for length, risk in measured]
    # (NaN: no flyable path)
    assert np.nanmax(bounds) <= min(costs) * (1.0 + CHORDS)
    length, risk = measured[0]
    solver = Hybrid(points=150, candidates=2, tolerance=None)
    within = cg.plan_within_risk(problem, risk, solver=solver, tolerance=0.02)
    assert within.dual_bound <= length * (1.0 + CHORDS)
    within = cg.plan_within_length(problem, length, solver=solver, tolerance=0.02)
    assert within.dual_bound <= risk * (1.0 + CHORDS) + 1e-9 * length


def test_a_straight_line_is_bounded_by_its_own_geodesic() -> None:
    problem = Problem.in_degrees(HELSINKI, TAMPERE, bounds=(22.0, 59.0, 26.0, 63.0))
    geodesic = GEOD.inv(*HELSINKI, *TAMPERE)[2]
    for bound in (cg.solve(problem, "straight-line").lower_bound, cg.lower_bound(problem, 1e-3).lower_bound):
        assert geodesic - 1e-5 <= bound <= geodesic


@given(
    middle=st.tuples(st.floats(-5e6, 5e6), st.floats(-5e6, 5e6)),
    reach=st.floats(1e2, 1e6),
    cost=st.floats(1.0, 20.0),
    slope=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    drop=st.floats(0.0, 0.5),
)
def test_the_cost_times_the_scale_is_bounded_on_all_of_a_cell(
    middle: Point, reach: float, cost: float, slope: Point, drop: float
) -> None:
    """Where the cost is no more than its own bound."""
    steep = np.array(slope) * 0.4 * (cost - drop) / reach
    bounds = np.array([[[cost, *steep, drop, cost - drop - 0.6 * (cost - drop)]]])
    lower_by_scale(LocalProjection(25.0, 60.0), np.array([middle]), reach, bounds)
    rng = np.random.default_rng(2)
    turn, far = rng.uniform(0.0, 2.0 * math.pi, 500), np.sqrt(rng.uniform(0.0, 1.0, 500))
    away = reach * (far * [np.cos(turn), np.sin(turn)]).T
    angle = np.hypot(*(middle + away).T) / POLAR_RADIUS
    true = np.sin(angle) / angle * (cost + away @ steep - drop)
    lower = bounds[0, 0, 0] + away @ bounds[0, 0, 1:3] - bounds[0, 0, 3]
    assert (lower <= true * (1.0 + 1e-12)).all()
    assert bounds[0, 0, 4] <= true.min()
    # in the middle, nothing is lost
    assert bounds[0, 0, 0] == pytest.approx(cost * LocalProjection(25.0, 60.0).scale(np.hypot(*middle)))


@given(st.floats(0.0, 1e9), st.floats(0.0, 1e11), st.booleans(), st.integers(1, 2))
def test_what_is_needed_for_a_cost_proves_it(cost: float, k: float, on_earth: bool, surfaces: int) -> None:
    field = cg.RiskField([cg.Threat(1e5, 2e5, 3e4)])
    projection = LocalProjection(25.0, 60.0) if on_earth else None
    problem = Problem((0.0, 0.0), (1e6, 0.0), field, k, (0.0, 0.0, 1e6, 1e6), projection=projection)
    bound = needed_for(problem, cost, surfaces)
    # cells that are left out have at least this bound: no path of less than the cost passes them
    assert proven(problem, bound, surfaces) >= cost
    # and it is not greater than the errors ask for
    assert bound <= cost * (1.0 + 2.0 * rounding(problem)) + 2.1e-6 * surfaces * on_earth


def test_a_map_in_the_plane_has_no_scale() -> None:
    problem = Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=10.0)
    mesh = Level.lay(problem, (16, 16), cell_runs.rectangle((16, 16))).mesh
    assert cost_bounds(problem, mesh)[:, 0, 0].min() >= 1.0
    assert problem.least_length == math.dist(problem.start, problem.goal)
    assert problem.stretch(np.array([problem.start])) == 1.0


def test_the_distance_of_threats_may_be_that_on_the_earth() -> None:
    """A path's cost with threats measured by geodesics is no less than the bound."""
    threats = [cg.Threat(27.0, 60.5, 90_000.0), cg.Threat(24.0, 59.0, 50_000.0)]
    problem = Problem.in_degrees((20.0, 60.0), (34.0, 60.0), bounds=(10.0, 50.0, 44.0, 66.5), threats=threats, k=5.0)
    projection = problem.projection
    assert projection is not None
    found = cg.solve(problem)
    points = shapely.get_coordinates(shapely.segmentize(shapely.LineString(found.path), 1000.0))
    x, y = projection.inverse(points).T
    steps = np.array(GEOD.line_lengths(x, y))
    middles = projection.inverse(0.5 * (points[1:] + points[:-1])).T
    safe = np.ones(len(steps))
    for one in threats:
        away = np.array(GEOD.inv(*middles, np.full(len(steps), one.x), np.full(len(steps), one.y))[2])
        safe *= 1.0 - np.exp(-0.5 * (away / one.spread) ** 2)
    assert found.lower_bound <= float((steps * (1.0 + problem.k * (1.0 - safe))).sum())


# The problem knows where it is


def test_in_degrees_is_what_a_scenario_file_says() -> None:
    text = (
        "coordinates = 'lonlat'\nbounds = [22, 60, 26, 62]\nstart = [24.94, 60.17]\ngoal = [23.76, 61.5]\nk = 3\n"
        "clearance = 100\nthreats = [{ x = 24.5, y = 60.9, spread = 5000 }]\n"
        "[no_fly]\npolygons = [[[24, 60.5], [24, 61], [24.2, 61], [24.2, 60.5]]]"
    )
    scenario = scenario_from_toml(text, "mine")
    area = shapely.Polygon([(24.0, 60.5), (24.0, 61.0), (24.2, 61.0), (24.2, 60.5)])
    built = Problem.in_degrees(
        HELSINKI,
        TAMPERE,
        bounds=(22.0, 60.0, 26.0, 62.0),
        threats=[cg.Threat(24.5, 60.9, 5000.0)],
        k=3.0,
        no_fly=area,
        clearance=100.0,
    )
    assert (built.start, built.goal, built.bounds) == (
        scenario.problem.start,
        scenario.problem.goal,
        scenario.problem.bounds,
    )
    assert built.field == scenario.problem.field
    assert built.projection == scenario.projection
    assert built.no_fly is not None
    assert shapely.equals(built.no_fly, scenario.problem.no_fly)


def test_where_a_problem_is_counts() -> None:
    here = Problem((0.0, 0.0), (1e3, 0.0), bounds=(-1e3, -1e3, 2e3, 1e3), projection=LocalProjection(24.0, 60.0))
    there = Problem((0.0, 0.0), (1e3, 0.0), bounds=(-1e3, -1e3, 2e3, 1e3), projection=LocalProjection(24.0, 61.0))
    nowhere = Problem((0.0, 0.0), (1e3, 0.0), bounds=(-1e3, -1e3, 2e3, 1e3))
    assert len({here, there, nowhere}) == 3
    copied = pickle.loads(pickle.dumps(here))  # noqa: S301 - our own bytes
    assert (copied, copied.projection) == (here, here.projection)
    assert here.relaxed().projection == here.projection

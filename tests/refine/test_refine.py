"""Refinement: exact derivatives, a rate of convergence, and never a worse or infeasible path."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import networkx as nx
import numpy as np
import oracles
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray, Point
from cgla_graph.errors import CglaError, ProblemError, SolverSettingError
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.refine import refine_kernels
from cgla_graph.refine.refine import _Refiner, refine_path
from cgla_graph.solvers import registry
from cgla_graph.testing import strategies as drawn

Gradient = Callable[[FloatArray, float, Any, FloatArray], float]

ONE_THREAT = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.55, 0.5, spread=0.1)]), k=10.0)
# No budget of time: the same run gives the same path.
SMALL = {"iterations": 200, "samples": 200, "milestones": 200, "generations": 10}
UNCERTIFIED = {"hybrid": {"tolerance": None}}

# The derivative


def polylines(min_size: int = 2, max_size: int = 6) -> st.SearchStrategy[FloatArray]:
    return st.builds(
        lambda seed, n: np.random.default_rng(seed).random((n, 2)), drawn.seeds, st.integers(min_size, max_size)
    )


def gradient_error(kernel: Gradient, field: cg.RiskField, k: float, points: FloatArray) -> float:
    """Compare with central differences of the oracle, relative to the sharpest threat; also the cost itself."""
    problem = cg.Problem((0.0, 0.0), (1.0, 1.0), field, k)
    found = np.empty_like(points)
    cost = kernel(points, k, field.kernel_field(), found)
    step = 1e-5 * min([1.0, *(threat.spread for threat in field.threats)])
    wanted = np.empty_like(points)
    for index in np.ndindex(points.shape):
        ahead, back = points.copy(), points.copy()
        ahead[index] += step
        back[index] -= step
        wanted[index] = (problem.evaluate(ahead).cost - problem.evaluate(back).cost) / (2.0 * step)
    # rounding of the oracle, and the third derivative
    scale = (1.0 + k) * (1e-6 + 1e-11 / step)
    return max(float(np.abs(found - wanted).max()) / scale, abs(cost - problem.evaluate(points).cost) / scale)


@given(st.one_of(drawn.fields(), drawn.crowds(30)), st.floats(0.0, 100.0), polylines())
@examples(60)
def test_the_gradient_is_that_of_the_cost(field: cg.RiskField, k: float, points: FloatArray) -> None:
    assert gradient_error(refine_kernels.cost_and_gradient, field, k, points) < 1.0


@given(drawn.raster_fields(), st.floats(0.0, 100.0), drawn.seeds)
@examples(60)
def test_the_gradient_is_that_of_the_cost_over_rasters(field: cg.RiskField, k: float, seed: int) -> None:
    """Waypoints in general position: next to a line, a difference sees both sides of it."""
    points = np.random.default_rng(seed).random((4, 2))
    problem = cg.Problem((0.0, 0.0), (1.0, 1.0), field, k)
    found = np.empty_like(points)
    cost = refine_kernels.cost_and_gradient(points, k, field.kernel_field(), found)
    assert cost == pytest.approx(problem.evaluate(points).cost, rel=1e-9)
    for index in np.ndindex(points.shape):
        slopes = []
        for step in (1e-5, 1e-6, 1e-7):
            ahead, back = points.copy(), points.copy()
            ahead[index] += step
            back[index] -= step
            slopes.append((problem.evaluate(ahead).cost - problem.evaluate(back).cost) / (2.0 * step))
        if np.ptp(slopes) <= 1e-4 * (1.0 + abs(slopes[1])):
            assert found[index] == pytest.approx(slopes[1], rel=1e-3, abs=1e-3 * (1.0 + k))


@pytest.mark.parametrize("fault", ["sign", "half", "ends swapped"])
def test_a_wrong_gradient_is_told_from_the_right_one(fault: str) -> None:
    def wrong(points: FloatArray, k: float, field: Any, gradient: FloatArray) -> float:  # noqa: ANN401 - a kernel's
        cost = refine_kernels.cost_and_gradient(points, k, field, gradient)
        gradient[:] = {"sign": -gradient, "half": 0.5 * gradient, "ends swapped": gradient[::-1]}[fault]
        return cost

    points = np.random.default_rng(1).random((5, 2))
    assert gradient_error(wrong, ONE_THREAT.field, 10.0, points) > 1e3


@given(drawn.fields(min_threats=1), drawn.seeds)
@examples(30)
def test_the_gradient_equals_its_integrals(field: cg.RiskField, seed: int) -> None:
    """``dR/db = u F(b)`` along the segment and the integral of ``(s / L) dF/dn`` across, by scipy's quadrature."""
    start, end = np.random.default_rng(seed).random((2, 2))
    length = math.dist(start, end)
    along = (end - start) / length
    across = np.array([-along[1], along[0]])

    def slope(s: float) -> float:
        return float(field.gradient(start + s * along) @ across)

    threats = [(t.x, t.y) for t in field.threats]
    cuts = np.clip([(np.array(centre) - start) @ along for centre in threats], 0.0, length)
    lever = quad(lambda s: s / length * slope(s), 0.0, length, epsabs=1e-12, limit=500, points=cuts)[0]
    whole = quad(slope, 0.0, length, epsabs=1e-12, limit=500, points=cuts)[0]
    densities = oracles.density(field.threats, np.array([start, end]))
    found = np.empty((2, 2))
    refine_kernels.cost_and_gradient(np.array([start, end]), 1.0, field.kernel_field(), found)
    sharp = 1e-9 / min(threat.spread for threat in field.threats)
    assert found[1] == pytest.approx((1.0 + densities[1]) * along + lever * across, abs=sharp)
    assert found[0] == pytest.approx(-(1.0 + densities[0]) * along + (whole - lever) * across, abs=sharp)


def test_coinciding_waypoints_have_a_finite_gradient() -> None:
    found = np.empty((4, 2))
    points = np.array([(0.1, 0.1), (0.5, 0.4), (0.5, 0.4), (0.9, 0.9)])
    cost = refine_kernels.cost_and_gradient(points, 10.0, ONE_THREAT.field.kernel_field(), found)
    assert cost == pytest.approx(ONE_THREAT.evaluate(points).cost)
    assert np.isfinite(found).all()


# What is promised of every path


@st.composite
def walks(draw: st.DrawFn) -> tuple[cg.Problem, FloatArray]:
    """
    Draw a problem with no-fly areas, straight or askew, and a feasible path, mostly one that touches them.

    The path is a random one over the visibility graph of corners and random points.
    """
    area = draw(drawn.polygons())
    if draw(st.booleans()):
        area = shapely.affinity.rotate(area, draw(st.floats(0.0, 360.0)), origin=(2.0, 2.0))
    scale = draw(st.sampled_from([1.0, 1e4]))
    area = shapely.affinity.scale(area, scale, scale, origin=(0.0, 0.0))
    rng = np.random.default_rng(draw(drawn.seeds))
    bounds = tuple(scale * bound for bound in (-0.5, -0.5, 4.5, 4.5))
    corners = shapely.get_coordinates(area)
    inside = ((corners >= bounds[0]) & (corners <= bounds[2])).all(axis=1)
    nodes = np.vstack([rng.uniform(*bounds[1:3], (8, 2)), corners[inside]])
    threats = [
        cg.Threat(*rng.uniform(0.0, 4.0 * scale, 2), spread=scale * rng.uniform(0.1, 1.0), peak=rng.uniform(0.1, 1.0))
        for _ in range(draw(st.integers(0, 4)))
    ]
    model = cg.CostModel(no_fly=area)
    pairs = np.array(list(itertools.combinations(range(len(nodes)), 2)))
    free = ~model.area.crosses(nodes[pairs[:, 0]], nodes[pairs[:, 1]])
    graph = nx.Graph()
    graph.add_weighted_edges_from((i, j, rng.random() ** 4) for i, j in pairs[free].tolist())
    reached = sorted(nx.node_connected_component(graph, pairs[free][0, 0])) if free.any() else [0]
    if not free.any():
        nodes = np.array([[bounds[0], bounds[1]]])
    ends = rng.choice(reached, 2)
    steps = nx.shortest_path(graph, *ends, weight="weight") if free.any() else [0]
    path = nodes[steps]
    k = draw(st.sampled_from([0.0, 1.0, 30.0]))
    start, goal = tuple(path[0].tolist()), tuple(path[-1].tolist())
    return cg.Problem(start, goal, cg.RiskField(threats), k, bounds, area), path


@given(walks())
@examples(80)
def test_refinement_never_harms(case: tuple[cg.Problem, FloatArray]) -> None:
    problem, path = case
    before = problem.evaluate(path)
    assert before.feasible
    kept = path.copy()
    refined = refine_path(problem, path, tolerance=1e-4)
    after = problem.evaluate(refined.path)
    assert after.feasible, after.violations
    assert after.cost == refined.cost
    assert after.cost <= before.cost
    assert np.array_equal(refined.path[[0, -1]], path[[0, -1]])
    assert np.array_equal(path, kept)
    costs = [moment.cost for moment in refined.trace]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == pytest.approx(refined.cost, rel=1e-9)
    again = refine_path(problem, path, tolerance=1e-4)
    assert np.array_equal(again.path, refined.path)


@given(walks())
@examples(40)
def test_without_risk_a_path_becomes_a_taut_string(case: tuple[cg.Problem, FloatArray]) -> None:
    """Every waypoint of a shortest path that is not an end is a corner of the area."""
    problem, path = case
    problem = cg.Problem(problem.start, problem.goal, bounds=problem.bounds, no_fly=problem.no_fly)
    refined = refine_path(problem, path)
    corners = shapely.get_coordinates(problem.model.area.geometry)
    if len(refined.path) > 2:
        away = np.hypot(*(refined.path[1:-1, None] - corners).transpose(2, 0, 1)).min(axis=1)
        assert away.max() <= 1e-3 * refined.cost


@given(drawn.fields(min_threats=1, max_threats=6), polylines(3, 8), st.floats(0.1, 100.0))
@examples(60)
def test_a_refined_path_stays_in_the_box_and_is_settled(field: cg.RiskField, path: FloatArray, k: float) -> None:
    problem = cg.Problem(tuple(path[0]), tuple(path[-1]), field, k)
    refined = refine_path(problem, path, tolerance=1e-5)
    assert problem.evaluate(refined.path).feasible
    assert refined.cost <= problem.evaluate(path).cost
    assert refine_path(problem, refined.path, tolerance=1e-5).cost >= refined.cost * (1.0 - 1e-2)


@given(st.one_of(drawn.crowds(60), drawn.fields(0, 6)), drawn.seeds)
@examples(40)
def test_shortcuts_are_the_cheapest_there_are(field: cg.RiskField, seed: int) -> None:
    """Against Bellman and Ford over all pairs of waypoints in their order, in crowds too."""
    rng = np.random.default_rng(seed)
    points = np.column_stack([np.sort(rng.random(14)), np.cumsum(rng.normal(0.0, 0.05, 14)) + 0.5])
    problem = cg.Problem(tuple(points[0]), tuple(points[-1]), field, 10.0 ** rng.uniform(-1, 3), (-1.0, -1.0, 2.0, 2.0))
    kept = np.ones(len(points), dtype=np.bool_)
    refine_kernels.shortcut(points, problem.model.kernel_model(), 1, kept)
    graph: nx.DiGraph[int] = nx.DiGraph()
    for i, j in itertools.combinations(range(len(points)), 2):
        graph.add_edge(i, j, weight=problem.evaluate(points[[i, j]]).cost)
    best = nx.bellman_ford_path_length(graph, 0, len(points) - 1)
    assert problem.evaluate(points[kept]).cost <= best * (1.0 + 1e-9)


def test_a_path_that_is_not_feasible_comes_back_with_a_word() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.4, 0.2, 0.6, 0.8))
    refined = refine_path(problem, [problem.start, problem.goal])
    assert refined.message == "not refined: segment 0 crosses the no-fly area"
    assert np.array_equal(refined.path, [problem.start, problem.goal])
    outside = refine_path(problem, [problem.start, (0.5, 1.5), problem.goal])
    assert "leaves the bounds" in outside.message


def test_improper_fields_are_not_refined() -> None:
    with pytest.warns(ImproperFieldWarning):
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=5.0)], improper=True)
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=1.0)
    refined = refine_path(problem, [(0.1, 0.1), (0.2, 0.9), (0.9, 0.9)])
    assert "below 0" in refined.message
    assert len(refined.path) == 3


def test_degenerate_paths() -> None:
    for path in ([(0.3, 0.3)], [(0.3, 0.3)] * 3, [(0.3, 0.3), (0.6, 0.2), (0.3, 0.3)]):
        assert refine_path(ONE_THREAT, path).cost == 0.0
    doubled = refine_path(ONE_THREAT, [(0.1, 0.1), (0.1, 0.1), (0.2, 0.8), (0.2, 0.8), (0.9, 0.9)])
    assert doubled.cost == pytest.approx(refine_path(ONE_THREAT, [(0.1, 0.1), (0.2, 0.8), (0.9, 0.9)]).cost, rel=1e-5)


# What is known in closed form


@pytest.mark.parametrize(
    ("start", "goal"), [((0, 0), (0, 5e-324)), ((0, 0), (0, 1e-320)), ((0, 0), (0, 1e-300)), ((0, 5e-324), (1, 0))]
)
def test_ends_as_close_as_numbers_can_be_are_joined(start: Point, goal: Point) -> None:
    """To each other, or to the axis that they are beside."""
    refined = refine_path(cg.Problem(start, goal), [start, goal])
    assert (refined.cost, refined.path.tolist()) == (math.dist(start, goal), [[*start], [*goal]])


def test_on_an_empty_map_nothing_but_the_straight_line_is_left() -> None:
    rng = np.random.default_rng(3)
    path = np.vstack([(0.1, 0.1), rng.random((30, 2)), (0.9, 0.8)])
    assert np.array_equal(refine_path(cg.Problem((0.1, 0.1), (0.9, 0.8)), path).path, path[[0, -1]])


@pytest.mark.parametrize("degrees", [0.0, 17.0, 45.0])
def test_around_a_box_the_path_is_a_string_over_its_corners(degrees: float) -> None:
    box = shapely.affinity.rotate(shapely.box(0.4, -0.3, 0.6, 0.3), degrees, origin=(0.5, 0.0))
    problem = cg.Problem((0.0, 0.0), (1.0, 0.0), bounds=(0, -1, 1, 1), no_fly=box)
    refined = refine_path(problem, [(0, 0), (0.1, 0.9), (0.5, 0.95), (0.9, 0.8), (1, 0)])
    hull = shapely.MultiPoint([problem.start, problem.goal, *box.exterior.coords]).convex_hull
    ring = np.array(hull.exterior.coords)
    upper = ring[(ring[:, 1] >= 0.0)]
    upper = np.unique(upper, axis=0)
    assert refined.cost == pytest.approx(float(np.hypot(*np.diff(upper, axis=0).T).sum()), rel=1e-12)


def test_around_one_threat_the_path_obeys_the_law_of_refraction() -> None:
    """Bouguer: in a field about a centre ``c``, ``(1 + k F) |(p - c) x u|`` is the same all along an optimal path."""
    refined = refine_path(ONE_THREAT, [ONE_THREAT.start, (0.3, 0.8), ONE_THREAT.goal], tolerance=1e-7, max_points=2000)
    (threat,) = ONE_THREAT.field.threats
    steps = np.diff(refined.path, axis=0)
    middles = 0.5 * (refined.path[1:] + refined.path[:-1])
    arms = middles - (threat.x, threat.y)
    lever = (arms[:, 0] * steps[:, 1] - arms[:, 1] * steps[:, 0]) / np.hypot(*steps.T)
    invariant = (1.0 + ONE_THREAT.k * oracles.density([threat], middles)) * lever
    assert np.ptp(invariant) < 2e-3 * abs(invariant.mean())
    first = [ONE_THREAT.start, (0.3, 0.8), ONE_THREAT.goal]
    assert refined.cost < ONE_THREAT.evaluate(first).cost


def test_the_cost_converges_with_the_square_of_the_spacing() -> None:
    guess = [ONE_THREAT.start, (0.3, 0.8), ONE_THREAT.goal]
    best = refine_path(ONE_THREAT, guess, tolerance=0.0, max_points=1500).cost
    refined = [refine_path(ONE_THREAT, guess, tolerance=0.0, max_points=n) for n in (20, 40, 80, 160)]
    segments = np.array([len(one.path) - 1 for one in refined])
    errors = np.array([one.cost for one in refined]) - best
    rates = np.diff(np.log(errors)) / np.diff(np.log(segments))
    assert (errors > 0.0).all()
    assert rates == pytest.approx(-2.0, abs=0.25)


def test_a_line_through_the_middle_of_a_threat_gets_off_the_ridge() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=10.0)
    refined = refine_path(problem, [problem.start, problem.goal])
    assert refined.cost < 0.6 * problem.evaluate([problem.start, problem.goal]).cost


def test_a_threat_presses_a_path_against_a_wall() -> None:
    """The best path runs along an edge askew, at no distance from it, and never crosses it."""
    wall = shapely.affinity.rotate(shapely.box(0.2, 0.55, 0.8, 0.9), 13.0, origin=(0.5, 0.5))
    threat = cg.Threat(0.5, 0.2, spread=0.3)
    problem = cg.Problem((0.1, 0.35), (0.9, 0.55), cg.RiskField([threat]), k=20.0, no_fly=wall)
    refined = refine_path(problem, [problem.start, (0.5, 0.2), problem.goal])
    found = problem.evaluate(refined.path)
    assert found.feasible
    assert found.clearance < 1e-6
    free = refine_path(cg.Problem(problem.start, problem.goal, problem.field, 20.0), refined.path)
    assert free.cost < refined.cost * 0.99


# Through the bridge and as a solver


@pytest.mark.parametrize("name", registry.names(installed=False))
def test_every_solver_can_be_refined(name: str) -> None:
    if (missing := registry.missing(name)) is not None:
        pytest.skip(missing)
    known = registry.setting_names(registry.solver_class(name))
    solver = registry.get(name, **{key: SMALL[key] for key in SMALL if key in known}, **UNCERTIFIED.get(name, {}))
    plain = cg.solve(ONE_THREAT, solver, resolution=8)
    refined = cg.solve(ONE_THREAT, solver, resolution=8, refine=True)
    assert refined.status.has_path
    assert refined.cost <= plain.cost
    if refined.cost < plain.cost:
        assert refined.status is cg.Status.FOUND
        assert refined.nodes == ()
        assert refined.evaluations > plain.evaluations
        assert refined.message.startswith("refined: ")
    costs = [moment.cost for moment in refined.trace]
    assert bool(costs) == bool(plain.trace)
    assert costs == sorted(costs, reverse=True)
    if costs:
        assert costs[-1] == pytest.approx(refined.cost, rel=1e-6)
    assert refined.seconds > 0.0


def test_waypoints_that_coincide_beside_a_wall_are_laid_along_it() -> None:
    """Where rounding puts parts of a segment into the area, they are moved out; a segment without length has none."""
    wall = shapely.Polygon([(0.1, 0.13), (0.83, 0.71), (0.9, 0.05)])
    problem = cg.Problem((0.1, 0.13), (0.83, 0.71), no_fly=wall)
    points = np.array([(0.1, 0.13), (0.1, 0.13), (0.83, 0.71), (0.83, 0.71)])
    lengths = np.hypot(*np.diff(points, axis=0).T)
    for spacing in (0.3, 0.05, 0.011):
        laid = _Refiner(problem, points, math.inf, 512)._laid(points, lengths / spacing, spacing)
        assert len(laid) > 2
        assert problem.evaluate(laid).feasible


def test_an_optimal_straight_line_stays_optimal() -> None:
    solution = cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.1)), "cgla", resolution=3, refine=True)
    assert solution.status is cg.Status.OPTIMAL
    assert len(solution.nodes) >= 2


def test_what_has_no_path_is_not_refined() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.4, 0.2, 0.6, 0.8))
    assert cg.solve(problem, "straight-line", refine=True).status is cg.Status.INFEASIBLE
    ring = shapely.box(0.6, 0.6, 1.0, 1.0).difference(shapely.box(0.7, 0.7, 0.9, 0.9))
    assert cg.solve(cg.Problem((0.1, 0.1), (0.8, 0.8), no_fly=ring), "cgla", refine=True).status is cg.Status.NO_PATH


def test_a_graph_has_nothing_to_refine() -> None:
    chain = cg.GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    with pytest.raises(ProblemError, match="GraphProblem has only its edges"):
        cg.solve(cg.GraphProblem(chain, 0, 2), refine=True)
    with pytest.raises(SolverSettingError, match="refine is 'yes'"):
        cg.solve(ONE_THREAT, refine="yes")  # type: ignore[arg-type]


def test_the_solver_refines_names_solvers_and_paths() -> None:
    by_name = cg.solve(ONE_THREAT, "refine", base="eight-direction", resolution=10)
    ready = cg.solve(ONE_THREAT, "refine", base=registry.get("eight-direction", resolution=10))
    assert by_name.cost == ready.cost
    assert by_name.cost < cg.solve(ONE_THREAT, "eight-direction", resolution=10).cost
    assert by_name.trace[0].cost == pytest.approx(cg.solve(ONE_THREAT, "eight-direction", resolution=10).cost)
    own = cg.solve(ONE_THREAT, "refine", base=[ONE_THREAT.start, (0.3, 0.8), ONE_THREAT.goal])
    assert own.status is cg.Status.FOUND
    assert registry.get("refine", base=[(0, 0), (1, 1)]) == registry.get("refine", base=np.array([[0, 0], [1, 1]]))
    stray = cg.solve(ONE_THREAT, "refine", base=[(0.0, 0.0), ONE_THREAT.goal])
    assert stray.status is cg.Status.UNSUPPORTED
    assert "not start and goal" in stray.message


@pytest.mark.slow
@pytest.mark.ompl
def test_the_seed_goes_to_the_base() -> None:
    if (missing := registry.missing("rrt-star")) is not None:
        pytest.skip(missing)
    base = registry.get("rrt-star", iterations=300)
    one, two, again = (cg.solve(ONE_THREAT, "refine", base=base, base_seed=seed) for seed in (1, 2, 1))
    assert np.array_equal(one.path, again.path)
    assert not np.array_equal(one.path, two.path)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"base": "refine"}, "itself"),
        ({"base": "cgl"}, "did you mean cgla"),
        ({"base": "cgla", "base_seed": 3}, "draws no random numbers"),
        ({"base": [(0, 0), (1, math.nan)]}, "finite"),
        ({"base": 5}, "base"),
        ({"resolution": 1}, "resolution"),
        *(({"tolerance": odd}, "tolerance") for odd in (-1.0, math.nan)),
        *(({"max_points": odd}, "max_points") for odd in (1, 1.5)),
    ],
    ids=str,
)
def test_wrong_settings_are_refused(wrong: dict[str, Any], word: str) -> None:
    with pytest.raises(CglaError, match=word):
        registry.get("refine", **wrong)
    if word in {"tolerance", "max_points"}:
        with pytest.raises(ProblemError, match=word):
            refine_path(ONE_THREAT, [(0.1, 0.1), (0.9, 0.9)], **wrong)

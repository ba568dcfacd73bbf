"""Paths over cells of constant cost: no worse than other planners', and what their search promises."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.regions import paths
from cgla_graph.regions.arrangement import Arrangement, refusal
from cgla_graph.regions.points import Points
from cgla_graph.solvers.continuous import hybrid


def noise(side: int, k: float, seed: int = 1, **settings: Any) -> cg.Problem:  # noqa: ANN401 - of a problem
    values = np.exp(4.0 * (np.random.default_rng(seed).random((side, side)) - 0.5))
    raster = cg.RasterRisk(values / np.median(values), (0, 0, side, side), interpolation="nearest", origin="lower")
    ends = (0.1 * side + 0.13, 0.1 * side + 0.21), (0.9 * side + 0.3, 0.8 * side + 0.4)
    return cg.Problem(*ends, cg.RiskField(rasters=[raster]), k, (0, 0, side, side), **settings)


def several(seed: int) -> cg.Problem:
    """Draw a few rasters of cells of any size, over parts of a map of any place and unit, some cells equal."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-3.0, 4.0)
    low = scale * rng.choice([0.0, 1.0, 100.0]) * rng.standard_normal(2)
    size = scale * np.array([1.0, 10.0 ** rng.uniform(-1.0, 0.0)])
    rasters = []
    for _ in range(int(rng.integers(1, 4))):
        shape = rng.integers(1, 9, 2)
        values = rng.integers(0, 5, shape) * 10.0 ** rng.uniform(-1.0, 1.0) / scale
        values = np.kron(values, np.ones(rng.integers(1, 3, 2)))
        begin = low + size * rng.uniform(-0.5, 0.5, 2) * rng.integers(0, 2)
        bounds = (*begin.tolist(), *(begin + size * rng.uniform(0.5, 1.5, 2)).tolist())
        rasters.append(cg.RasterRisk(values, bounds, interpolation="nearest"))
    ends = low + size * rng.choice([rng.random((2, 2)), rng.integers(0, 3, (2, 2)) / 2.0])
    field = cg.RiskField(rasters=rasters)
    bounds = (*low.tolist(), *(low + size).tolist())
    clipped = np.clip(ends, bounds[:2], bounds[2:])
    return cg.Problem(tuple(clipped[0]), tuple(clipped[1]), field, 10.0 ** rng.uniform(-1.0, 1.0), bounds)


def test_along_the_edge_of_a_raster_it_flies_outside() -> None:
    """The edge belongs to the raster, and beside it there is no risk."""
    raster = cg.RasterRisk([[9.0]], (0.3, 0.0, 0.7, 0.5), interpolation="nearest")
    problem = cg.Problem((0.1, 0.1), (0.9, 0.1), cg.RiskField(rasters=[raster]), k=10.0)
    answer = cg.solve(problem, "weighted-regions")

    assert problem.evaluate([(0.3, 0.5), (0.7, 0.5)]).cost > 30.0
    assert answer.cost == pytest.approx(2.0 * math.hypot(0.2, 0.4) + 0.4, rel=1e-5)


@pytest.mark.parametrize("solver", ["weighted-regions", "hybrid"])
def test_along_a_line_of_two_rasters_each_of_them_has_its_lesser_value(solver: str) -> None:
    """On both sides of the line, one of the rasters is dear."""
    rows = [[9.0], [0.0]], [[0.0], [9.0]]
    field = cg.RiskField(rasters=[cg.RasterRisk(values, (0, 0, 3, 1), interpolation="nearest") for values in rows])
    problem = cg.Problem((0.2, 0.3), (2.8, 0.7), field, k=1.0, bounds=(0, 0, 3, 1))
    answer = cg.solve(problem, solver)
    # (cells of cost 10 are left as steeply as the law of Snell says)
    depth, along = 0.2, 2.6 - 2.0 * 0.2 / math.sqrt(99.0)

    assert answer.cost == pytest.approx(2.0 * 10.0 * depth * 10.0 / math.sqrt(99.0) + along, rel=1e-6)
    assert cg.lower_bound(problem, tolerance=0.002).gap <= 0.002


def test_waypoints_next_to_each_other_are_moved_too() -> None:
    problem = several(36)
    assert cg.solve(problem, "weighted-regions", points=63).status.has_path


@examples(20)
@given(st.integers(0, 10**6))
def test_each_cell_costs_what_the_oracle_says(seed: int) -> None:
    problem = several(seed)
    cells = Arrangement.of(problem)
    rng = np.random.default_rng(seed)
    row, column = (rng.integers(0, count, 50) for count in cells.costs.shape)
    share = rng.uniform(0.01, 0.99, (50, 2))
    places = np.column_stack(
        [lines[at] + part * (lines[at + 1] - lines[at])
         for lines, at, part in ((cells.x, column, share[:, 0]), (cells.y, row, share[:, 1]))]
    )  # fmt: skip
    expected = 1.0 + problem.k * problem.field.density(places)

    assert cells.costs[row, column] == pytest.approx(expected, rel=1e-12)
    assert (cells.x[0], cells.y[0], cells.x[-1], cells.y[-1]) == problem.bounds


@examples(5)
@given(st.integers(0, 10**6), st.integers(0, 3))
def test_costs_over_points_are_those_of_the_graph_of_all_of_them(seed: int, m: int) -> None:
    """The graph is built edge by edge from the places of nodes, and searched by scipy."""
    problem = several(seed)
    cells = Arrangement.of(problem)
    points = Points.lay(cells, m)
    at = points.positions
    best = np.full((len(at) + 1, len(at) + 1), math.inf)
    for row, column in np.ndindex(cells.costs.shape):
        near = points.nodes_of(row, column)
        # (along a side, steps from point to point add up to the same)
        between = cells.costs[row, column] * np.hypot(*(at[near][:, None] - at[near]).transpose(2, 0, 1))
        best[np.ix_(near, near)] = np.minimum(best[np.ix_(near, near)], between)
    np.minimum.at(best[-1], *points.around(problem.goal))
    best[best == 0.0] = 1e-300
    one, other = np.nonzero(np.isfinite(best))
    graph = csr_array((best[one, other], (one, other)), shape=best.shape)
    expected = dijkstra(graph, indices=len(at))[:-1]

    assert points.costs_from(problem.goal) == pytest.approx(expected, rel=1e-8, abs=1e-200)


@examples(15)
@given(st.integers(0, 10**6))
def test_the_path_is_no_more_expensive_than_another_planners(seed: int) -> None:
    problem = several(seed)
    if problem.start == problem.goal:
        return
    found = paths.least_path(problem)
    judged = problem.evaluate(found.path)
    straight = problem.evaluate([problem.start, problem.goal]).cost
    marched = cg.solve(problem, "fast-marching", cells=64)

    assert judged.feasible, judged.violations
    assert judged.cost <= straight
    assert judged.cost <= 1.002 * marched.cost


def test_on_noise_it_finds_what_many_points_find() -> None:
    problem = noise(40, 10.0)
    many, few = (cg.solve(problem, "weighted-regions", points=m).cost for m in (31, 3))

    assert few == pytest.approx(many, rel=1e-6)
    assert many == pytest.approx(245.521, abs=1e-3)


def test_moving_waypoints_along_borders_obeys_the_law_of_snell() -> None:
    field = cg.RiskField(rasters=[cg.RasterRisk([[0.0, 1.0]], (0, 0, 2, 3), interpolation="nearest")])
    problem = cg.Problem((0.0, 0.5), (2.0, 2.5), field, k=1.0, bounds=(0, 0, 2, 3))
    path = cg.solve(problem, "weighted-regions").path
    sines = np.diff(path[:, 1]) / np.hypot(*np.diff(path, axis=0).T)

    assert len(path) == 3
    assert sines[0] == pytest.approx(2.0 * sines[1], rel=1e-4)


def test_in_a_corridor_over_blocks_it_finds_nearly_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = noise(60, 3.0)
    whole = paths.least_path(problem)
    monkeypatch.setattr(paths, "MOST_NODES", 6_000)
    monkeypatch.setattr(paths, "COARSE_NODES", 4_000)
    part = paths.least_path(problem)

    assert "in a corridor found over blocks of 3 x 3" in part.message
    assert part.nodes < whole.nodes
    assert problem.evaluate(part.path).cost < 1.02 * problem.evaluate(whole.path).cost


@pytest.mark.parametrize("clearance", [0.0, 0.7])
def test_it_goes_around_areas(clearance: float) -> None:
    wall = shapely.union_all([shapely.box(18, -1, 19, 33), shapely.Point(30, 30).buffer(4.2)])
    problem = noise(40, 1.0, no_fly=wall, clearance=clearance)
    answer = cg.solve(problem, "weighted-regions")

    assert answer.status.has_path, answer.message
    assert answer.clearance >= clearance * (1.0 - 1e-9)
    assert answer.cost <= 1.001 * cg.solve(problem, "fast-marching", cells=160).cost


def covered_by_shapely(cells: Arrangement, area: shapely.Geometry) -> tuple[FloatArray, FloatArray]:
    boxes = shapely.box(cells.x[:-1], cells.y[:-1, None], cells.x[1:], cells.y[1:, None])
    cut = shapely.intersects(shapely.boundary(area), boxes)
    return shapely.contains(area, boxes) & ~cut, cut


@examples(20)
@given(st.integers(0, 10**6))
def test_cells_in_areas_are_those_that_shapely_finds(seed: int) -> None:
    from cgla_graph.regions.points import covered  # noqa: PLC0415 - of this test alone

    rng = np.random.default_rng(seed)
    x, y = (np.cumsum(rng.uniform(0.1, 1.0, 12)) for _ in range(2))
    cells = Arrangement.laid(x, y, np.ones((11, 11)))
    area = shapely.union_all(
        [shapely.Point(at).buffer(rng.uniform(0.05, 2.0)) for at in rng.uniform(-1.0, 7.0, (4, 2))]
    )
    for found, expected in zip(covered(cells, NoFlyArea(area)), covered_by_shapely(cells, area), strict=True):
        assert (found == expected).all()


@pytest.mark.parametrize(
    ("field", "says"),
    [
        (cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), "no threats"),
        (cg.RiskField(rasters=[cg.RasterRisk([[1.0]], (0, 0, 1, 1))]), "one is bilinear"),
        (cg.RiskField(), "no raster"),
    ],
)
def test_where_risk_is_sampled_it_says_so(field: cg.RiskField, says: str) -> None:
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=10.0)
    answer = cg.solve(problem, "weighted-regions")

    assert says in refusal(problem)
    assert answer.message.endswith("risk sampled in the middles of cells")
    assert answer.cost <= 1.001 * cg.solve(problem, tolerance=None).cost


@pytest.mark.parametrize("seed", [36, 11, 58])
def test_hybrid_takes_the_better_of_both(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """On these maps of a few large cells, 7 points a side miss the best order of cells."""
    problem = several(seed)
    both = cg.solve(problem, tolerance=None).cost
    few = cg.solve(problem, "weighted-regions", points=7).cost
    monkeypatch.setattr(hybrid, "has_cells", lambda _: False)
    before = cg.solve(problem, tolerance=None).cost

    assert both <= before
    assert both <= few


def test_hybrid_finds_the_best_path_over_noise() -> None:
    assert cg.solve(noise(40, 10.0), tolerance=None).cost == pytest.approx(245.521, abs=1e-3)

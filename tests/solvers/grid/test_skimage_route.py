"""scikit-image's routes: its own numbers on cells, paths that stand up to the oracle, and gaps that are closed."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import areas, few, usual

import cgla_graph as cg
from cgla_graph.solvers.grid.skimage_route import ASIDE, Grid
from cgla_graph.testing.strategies import problems, raster_fields

graph: Any = pytest.importorskip("skimage.graph")

WALL = shapely.box(0.45, 0.2, 0.55, 1.0)


def steep(shape: tuple[int, int], seed: int = 1) -> cg.RasterRisk:
    """Draw cells that differ a thousandfold, on a map that is as many units wide and high as it has cells."""
    values = 10.0 ** np.random.default_rng(seed).uniform(-2.0, 1.0, shape)
    return cg.RasterRisk(values, (0, 0, shape[1], shape[0]), interpolation="nearest", origin="lower")


def cells_of(path: np.ndarray[Any, Any]) -> list[tuple[int, int]]:
    """Return row and column of each waypoint on cells of size 1."""
    return [(int(y), int(x)) for x, y in path.tolist()]


@pytest.mark.parametrize("fully_connected", [True, False])
@pytest.mark.parametrize("geometric", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_it_is_route_through_array(fully_connected: bool, geometric: bool, seed: int) -> None:
    raster = steep((12, 17), seed)
    problem = cg.Problem((0.5, 0.5), (16.5, 11.5), cg.RiskField(rasters=[raster]), k=3.0, bounds=raster.bounds)
    answer = cg.solve(problem, "skimage-route", fully_connected=fully_connected, geometric=geometric)
    route, cost = graph.route_through_array(
        1.0 + 3.0 * raster.cells, (0, 0), (11, 16), fully_connected=fully_connected, geometric=geometric
    )
    assert cells_of(answer.path) == [tuple(cell) for cell in route]
    assert answer.evaluations == 12 * 17
    assert answer.status is cg.Status.FOUND
    # on whole cells, half of each move is in either
    if geometric:
        assert answer.cost == pytest.approx(cost, rel=1e-12)


@pytest.mark.slow
def test_cells_wider_than_high_count_as_what_they_are() -> None:
    values = np.ones((40, 10))
    values[10:30, 4:6] = 5.0
    raster = cg.RasterRisk(values, (0, 0, 20, 40), interpolation="nearest", origin="lower")
    problem = cg.Problem((1, 20.5), (19, 20.5), cg.RiskField(rasters=[raster]), k=1.0, bounds=raster.bounds)
    answer = cg.solve(problem, "skimage-route")
    costs = 1.0 + raster.cells
    search = graph.MCP_Geometric(costs, sampling=(1.0, 2.0))
    best = search.find_costs([(20, 0)], [(20, 9)])[0][20, 9]
    assert answer.evaluations == 400
    assert answer.cost == pytest.approx(best, rel=1e-12)
    assert cg.solve(problem, "hybrid").cost <= answer.cost


@pytest.mark.parametrize(
    ("shape", "cells", "count"),
    [
        ((9, 12), None, 9 * 12),
        ((9, 12), 20, 15 * 20),
        ((9, 12), 2, 2 * 2),
        pytest.param((3, 9000), None, 4096, marks=pytest.mark.slow),
    ],
)
def test_cells_are_those_of_the_raster_or_as_many_as_asked_for(
    shape: tuple[int, int], cells: int | None, count: int
) -> None:
    """More than scikit-image should hold are joined."""
    raster = steep(shape)
    goal = shape[1] - 0.5, shape[0] - 0.5
    problem = cg.Problem((0.5, 0.5), goal, cg.RiskField(rasters=[raster]), bounds=raster.bounds)
    assert cg.solve(problem, "skimage-route", cells=cells).evaluations == count
    assert cg.solve(cg.Problem((0, 0), (1, 1)), "skimage-route").evaluations == 256 * 256


def test_in_free_space_it_is_as_much_longer_as_eight_directions_are() -> None:
    worst = max(
        cg.solve(cg.Problem((0.5, 0.5), (0.5 + 0.4 * np.cos(a), 0.5 + 0.4 * np.sin(a))), "skimage-route").cost / 0.4
        for a in np.linspace(0.0, 0.5 * np.pi, 17)
    )
    assert 1.07 < worst < 1.0824 + 0.02


@usual
@given(problems())
def test_every_path_stands_up_to_the_oracle(problem: cg.Problem) -> None:
    answer = cg.solve(problem, "skimage-route", cells=40)
    if answer.status is cg.Status.NOT_FOUND:
        assert not problem.model.area.is_empty
        assert "no-fly areas close" in answer.message
        return
    assert answer.status in {cg.Status.FOUND, cg.Status.OPTIMAL}
    assert not problem.evaluate(answer.path).violations


@pytest.mark.slow
@few
@given(raster_fields(), st.sampled_from([0.0, 1.0, 100.0]))
def test_nothing_is_cheaper_than_the_proven_bound(field: cg.RiskField, k: float) -> None:
    problem = cg.Problem((0.1, 0.15), (0.9, 0.8), field, k=k)
    answer = cg.solve(problem, "skimage-route", cells=60)
    assert answer.cost == pytest.approx(problem.evaluate(answer.path).cost, rel=1e-9)
    # most paths along eight directions are 6 % longer than need be: a bound that is nearer would see no more
    best = cg.solve(problem, "hybrid", tolerance=None).path
    assert answer.cost >= cg.lower_bound(problem, 0.03, path=best, max_cells=2**17).lower_bound * (1.0 - 1e-9)


@usual
@given(areas(), st.tuples(st.integers(1, 24), st.integers(1, 24)))
def test_touched_cells_are_those_that_shapely_names(area: shapely.MultiPolygon, shape: tuple[int, int]) -> None:
    # ends in corners of the map, where an area may be
    problem = cg.Problem((2.0, 2.0), (2.0, -1.0), bounds=(0.0, -1.0, 2.0, 2.0), no_fly=area)
    closed = Grid(problem, shape).costs < 0.0
    rows, columns = (index + 0.0 for index in np.indices(shape))
    height, width = 3.0 / shape[0], 2.0 / shape[1]
    boxes = shapely.box(
        (columns + ASIDE) * width,
        -1.0 + (rows + ASIDE) * height,
        (columns + 1.0 - ASIDE) * width,
        -1.0 + (rows + 1.0 - ASIDE) * height,
    )
    assert closed.tolist() == shapely.intersects(problem.model.area.geometry, boxes).tolist()


@pytest.mark.slow
def test_a_wall_is_gone_around_and_one_without_a_gap_is_told() -> None:
    around = cg.solve(cg.Problem((0.1, 0.7), (0.9, 0.7), no_fly=WALL), "skimage-route")
    assert around.status is cg.Status.FOUND
    assert around.clearance >= 0.0
    narrow = WALL.union(shapely.box(0.45, 0.0, 0.55, 0.197))
    problem = cg.Problem((0.1, 0.7), (0.9, 0.7), no_fly=narrow)
    closed = cg.solve(problem, "skimage-route", cells=100)
    assert closed.status is cg.Status.NOT_FOUND
    assert closed.message == "no-fly areas close the 100 x 100 cells between start and goal"
    assert cg.solve(problem, "skimage-route", cells=2000).status is cg.Status.FOUND


def test_areas_along_the_edges_of_cells_leave_corridors_open() -> None:
    """The cells that a raster's own `area_above` closes are closed, and none beside them."""
    values = np.ones((9, 9))
    values[4] = 0.0
    raster = cg.RasterRisk(values, (0, 0, 0.9, 0.9), interpolation="nearest")
    area = raster.area_above(0.5)
    problem = cg.Problem(
        (0.0, 0.45), (0.9, 0.45), cg.RiskField(rasters=[raster]), k=1.0, bounds=raster.bounds, no_fly=area
    )
    answer = cg.solve(problem, "skimage-route")
    assert answer.status is cg.Status.FOUND
    assert answer.cost == pytest.approx(0.9)


def test_between_areas_that_touch_in_a_corner_no_diagonal_slips_through() -> None:
    """Cells closed like a chessboard's: rounding may lead a diagonal move across a corner that it should touch."""
    for size in (0.1, 1.0 / 3.0, 1234.567):
        black = [
            shapely.box(size * i, size * j, size * (i + 1), size * (j + 1))
            for i in range(7)
            for j in range(7)
            if (i + j) % 2 and 0 < i < 6
        ]
        bounds = (0.0, 0.0, 7 * size, 7 * size)
        problem = cg.Problem((0.5 * size, 0.0), (6.5 * size, 0.0), bounds=bounds, no_fly=shapely.union_all(black))
        answer = cg.solve(problem, "skimage-route", cells=7)
        assert answer.status in {cg.Status.FOUND, cg.Status.NOT_FOUND}, (size, answer.message)


def test_ends_on_the_boundary_of_an_area_are_joined_to_cells_in_sight() -> None:
    for end in ((0.45, 0.5), (0.5, 0.2), (0.45, 1.0)):
        answer = cg.solve(cg.Problem(end, (0.9, 0.1), no_fly=WALL), "skimage-route", cells=37)
        assert answer.status is cg.Status.FOUND, answer.message


def test_ends_deep_between_areas_are_not_joined() -> None:
    ring = shapely.box(0.2, 0.2, 0.8, 0.8).difference(shapely.box(0.499, 0.499, 0.501, 0.501))
    answer = cg.solve(cg.Problem((0.5, 0.5), (0.9, 0.9), no_fly=ring), "skimage-route", cells=50)
    assert answer.status is cg.Status.NOT_FOUND


@pytest.mark.slow
def test_scikit_image_is_loaded_by_the_first_run_only() -> None:
    code = (
        "import sys; from cgla_graph.solvers import registry; "
        "[registry.describe(name) for name in registry.names(installed=False)]; print('skimage' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"

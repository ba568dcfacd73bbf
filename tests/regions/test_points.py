"""Points on the borders of cells: what they take where there are many shapes of cells, thin cells and areas."""

import numpy as np
import pytest
import shapely

import cgla_graph as cg
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.regions import points
from cgla_graph.regions.arrangement import Arrangement
from cgla_graph.regions.points import Points, covered


def odd_cells(side: int) -> Arrangement:
    """Lay cells of which no two have equal sizes."""
    rng = np.random.default_rng(side)
    x, y = (np.append(0.0, np.cumsum(rng.uniform(0.1, 1.0, side))) for _ in range(2))
    return Arrangement.laid(x, y, np.ones((side, side)))


def test_tables_of_many_shapes_stay_few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two rasters of 1000 and 731 cells a side had two million tables: 4 GB."""
    cells = odd_cells(40)
    exact = Points.lay(cells, 3)
    monkeypatch.setattr(points, "MOST_TABLES", 100)
    rounded = Points.lay(cells, 3)
    ends = (0.0, 0.0), (float(cells.x[-1]), float(cells.y[-1]))

    assert len(exact.tables) == 1600
    assert len(rounded.tables) <= 100
    assert rounded.positions == pytest.approx(exact.positions)
    assert rounded.costs_from(ends[0])[-1] == pytest.approx(exact.costs_from(ends[0])[-1], rel=0.02)


def test_tables_are_few_where_points_are_many() -> None:
    laid = Points.lay(odd_cells(30), 64)
    assert laid.tables.size <= points.TABLE_NUMBERS


def test_a_thin_column_makes_no_small_pieces_of_outlines() -> None:
    """Between the edges of two rasters, cells may be as thin as rounding: outlines were cut as finely."""
    lines = np.arange(9.0)
    cells = Arrangement.laid(np.sort(np.append(lines, 4.0 + 1e-12)), lines, np.ones((8, 9)))
    area = shapely.Point(4.3, 4.1).buffer(2.0)
    boxes = shapely.box(cells.x[:-1], cells.y[:-1, None], cells.x[1:], cells.y[1:, None])
    inside, cut = covered(cells, NoFlyArea(area))

    assert (cut == shapely.intersects(area.boundary, boxes)).all()
    assert (inside == (shapely.contains(area, boxes) & ~cut)).all()


def test_cells_that_no_way_leads_through_have_no_table() -> None:
    lines = np.arange(9.0)
    cells = Arrangement.laid(lines, lines, np.ones((8, 8)))
    area = NoFlyArea(shapely.Point(4.3, 4.1).buffer(2.0))
    closed = cells.without(np.ones((8, 8), dtype=np.bool_))

    assert len(Points.lay(cells, 1, area).tables) > 1
    assert len(Points.lay(closed, 1, area).tables) == 1


def test_hybrid_keeps_a_way_over_cells_that_its_roadmap_misses(monkeypatch: pytest.MonkeyPatch) -> None:
    from cgla_graph.solvers.continuous import hybrid  # noqa: PLC0415 - of this test alone

    raster = cg.RasterRisk(np.arange(16.0).reshape(4, 4), (0, 0, 1, 1), interpolation="nearest")
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(rasters=[raster]), 5.0)
    monkeypatch.setattr(hybrid._Search, "_candidates", lambda *_: [])
    monkeypatch.setattr(hybrid._Search, "_first_look", lambda _: ([], False))

    answer = cg.solve(problem, tolerance=None)
    assert answer.cost == cg.solve(problem, "weighted-regions").cost


@pytest.mark.parametrize("wall", [None, shapely.box(0.4, -0.1, 0.5, 0.8)])
def test_a_tube_leaves_out_cells_and_not_the_best_path(wall: object, monkeypatch: pytest.MonkeyPatch) -> None:
    from cgla_graph.regions import paths  # noqa: PLC0415 - of this test alone

    values = np.exp(4.0 * np.random.default_rng(3).random((12, 12)))
    raster = cg.RasterRisk(values, (0, 0, 1, 1), interpolation="nearest")
    problem = cg.Problem((0.1, 0.2), (0.9, 0.8), cg.RiskField(rasters=[raster]), 1.0, no_fly=wall)
    part = paths.least_path(problem, 7)
    monkeypatch.setattr(paths, "MANY", 99)
    whole = paths.least_path(problem, 7)

    assert part.nodes < whole.nodes
    assert problem.evaluate(part.path).cost == pytest.approx(problem.evaluate(whole.path).cost, rel=1e-9)


def test_lengths_are_computed_for_the_shapes_that_are_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    lengths = points.lengths
    monkeypatch.setattr(points, "lengths", lambda *shape: made.append(shape) or lengths(*shape))
    closed = np.ones((20, 20), dtype=np.bool_)
    closed[3, 4] = False
    Points.lay(odd_cells(20).without(closed), 1)

    assert len(made) == 1

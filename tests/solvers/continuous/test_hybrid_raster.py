"""Ways down the costs-to-go over rasters: corridors of large rasters, and what is said where they are sampled."""

from typing import Any

import numpy as np
import pytest
import shapely

import cgla_graph as cg
from cgla_graph.refine.refine import refine_path
from cgla_graph.solvers.continuous import hybrid_raster


def noise(side: int, interpolation: Any, **settings: Any) -> cg.Problem:  # noqa: ANN401 - a literal, and of a problem
    raster = cg.RasterRisk(
        np.random.default_rng(2).random((side, side)), (0, 0, side, side), interpolation=interpolation, origin="lower"
    )
    ends = (0.1 * side + 0.13, 0.1 * side + 0.21), (0.9 * side + 0.3, 0.8 * side + 0.4)
    return cg.Problem(*ends, cg.RiskField(rasters=[raster]), 10.0, (0, 0, side, side), **settings)


def smooth(side: int) -> cg.Problem:
    x, y = np.meshgrid(*2 * [np.linspace(0.0, 3.0, side)])
    raster = cg.RasterRisk(1.0 + np.sin(x) * np.sin(2.0 * y), (0, 0, 1, 1))
    return cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(rasters=[raster]), 3.0)


@pytest.mark.parametrize("interpolation", ["nearest", pytest.param("bilinear", marks=pytest.mark.slow)])
def test_a_route_over_cells_that_is_refined_is_not_cheaper(interpolation: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on a raster that is too large for a grid of two nodes a cell."""
    graph = pytest.importorskip("skimage.graph")
    problem = noise(200, interpolation)
    monkeypatch.setattr(hybrid_raster, "MOST_NODES", 10_000)
    monkeypatch.setattr(hybrid_raster, "COARSE_NODES", 2_500)
    monkeypatch.setattr(hybrid_raster, "RASTER_LEAST", 10)
    cells = 1.0 + problem.k * problem.field.rasters[0].cells
    first, last = ((int(y), int(x)) for x, y in (problem.start, problem.goal))
    nodes, _ = graph.route_through_array(cells, first, last)
    path = np.vstack([problem.start, np.array(nodes)[:, ::-1] + 0.5, problem.goal])
    answer = cg.solve(problem, tolerance=None)

    assert answer.cost <= refine_path(problem, path).cost
    assert "sampled" not in answer.message


def test_corridors_keep_out_of_areas(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hybrid_raster, "MOST_NODES", 10_000)
    monkeypatch.setattr(hybrid_raster, "COARSE_NODES", 2_500)
    monkeypatch.setattr(hybrid_raster, "RASTER_LEAST", 10)
    problem = noise(150, "bilinear", no_fly=shapely.box(60, -1, 64, 120))
    (way, _), _, _ = hybrid_raster.ways_down(problem)

    assert problem.evaluate(way).feasible


def test_where_a_raster_is_sampled_the_message_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = smooth(300)
    assert "sampled" not in cg.solve(problem, tolerance=None).message
    assert "sampled" not in cg.solve(problem, "fast-marching").message

    assert "as wide as 3 of the raster" in cg.solve(problem, "fast-marching", cells=100).message
    monkeypatch.setattr(hybrid_raster, "MOST_NODES", 10_000)
    monkeypatch.setattr(hybrid_raster, "RASTER_LEAST", 10)
    assert "as wide as 3 of the raster" in cg.solve(problem, tolerance=None).message

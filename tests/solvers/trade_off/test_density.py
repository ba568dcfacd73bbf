"""Limits of the density under a corridor, against grown cells and a flood fill."""

import itertools

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.solvers.trade_off.density import below_density, density_front
from cgla_graph.testing import strategies as drawn

BOUNDS = (0.0, 0.0, 6.0, 6.0)


def town(seed: int) -> cg.Problem:
    """Draw a town of 6 x 6 cells, its corners empty, where start and goal are."""
    values = np.random.default_rng(seed).integers(1, 9, (6, 6)).astype(float)
    values[0, 0] = values[-1, -1] = 0.0
    field = cg.RiskField(rasters=[cg.RasterRisk(values, BOUNDS, origin="lower")])
    return cg.Problem((0.5, 0.5), (5.5, 5.5), field, k=1.0, bounds=BOUNDS)


def greatest_under(problem: cg.Problem, path: FloatArray, width: float) -> float:
    """Return the greatest value of a cell that a corridor meets, by shapely."""
    (raster,) = problem.field.rasters
    corridor = shapely.LineString(path).buffer(0.5 * width * (1.0 - 1e-9))
    cells = [(value, shapely.box(i, j, i + 1, j + 1)) for (j, i), value in np.ndenumerate(raster.cells)]
    return max(value for value, cell in cells if shapely.intersection(corridor, cell).area > 1e-9)


def is_joined(problem: cg.Problem, level: float) -> bool:
    """Tell whether cells up to a level join start and goal, over edges: a corridor does not pass a corner."""
    (raster,) = problem.field.rasters
    seen, front = {(0, 0)}, [(0, 0)]
    while front:
        i, j = front.pop()
        for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            cell = i + a, j + b
            if cell not in seen and all(0 <= one < 6 for one in cell) and raster.cells[cell] <= level:
                seen.add(cell)
                front.append(cell)
    return (5, 5) in seen


@pytest.mark.slow
@given(drawn.seeds, st.integers(1, 8), st.sampled_from([0.1, 0.5]))
@examples(15)
@pytest.mark.filterwarnings("ignore::cgla_graph.people.below.DensityLimitWarning")
def test_a_corridor_stays_below_or_there_is_none(seed: int, level: int, width: float) -> None:
    problem = town(seed)
    (point,) = density_front(problem, corridor=width, levels=[float(level)], tolerance=None)
    assert point.solution.status.has_path == is_joined(problem, level)
    assert point.no_path == (not is_joined(problem, level))
    if point.solution.status.has_path:
        assert greatest_under(problem, point.solution.path, width) <= level
        assert below_density(problem, level, corridor=width).evaluate(point.solution.path).feasible


@pytest.mark.slow
@given(drawn.seeds)
@examples(4)
def test_a_front_begins_at_the_least_limit_and_falls(seed: int) -> None:
    problem = town(seed)
    front = density_front(problem, corridor=0.2, levels=4, tolerance=None)
    found = [point for point in front if point.solution.status.has_path]
    assert [point.level for point in front] == sorted(point.level for point in front)
    assert found[0].level == next(level for level in itertools.count() if is_joined(problem, level))
    for lower, higher in itertools.pairwise(found):
        assert higher.solution.cost <= lower.solution.cost * (1.0 + 1e-6)
    assert front[0] is found[0] or front[0].no_path
    # at the end the limit plays no part
    assert found[-1].solution.cost == pytest.approx(cg.solve(problem, "hybrid", tolerance=None).cost, rel=1e-6)


def test_the_rim_of_the_map_is_no_way_around() -> None:
    """Paths may touch an area and follow the rim; where both meet, there is no corridor."""
    values = np.zeros((3, 3))
    values[:, 1] = 5.0
    field = cg.RiskField(rasters=[cg.RasterRisk(values, (0, 0, 3, 3))])
    problem = cg.Problem((0.5, 1.5), (2.5, 1.5), field, bounds=(0, 0, 3, 3))
    (point,) = density_front(problem, levels=[4.0])
    assert point.no_path


def test_what_cannot_be_limited_is_refused() -> None:
    problem = town(1)
    with pytest.raises(ProblemError, match="no raster"):
        below_density(cg.Problem((0, 0), (1, 1)), 1.0)
    with pytest.raises(ProblemError, match=r"start \(0.5, 0.4\) has a density above 0.5 .* within 1: no path"):
        below_density(cg.Problem((0.5, 0.4), (5.5, 5.5), problem.field, bounds=BOUNDS), 0.5, corridor=2.0)
    for wrong in ({"corridor": -1.0}, {"levels": 1}, {"levels": ["a"]}):
        with pytest.raises(ProblemError):
            density_front(problem, **wrong)

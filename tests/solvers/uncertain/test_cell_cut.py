"""The cut over cells of `nearest` rasters: no path is below the number of an interval that it crosses."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.model.uncertain.tail_mean import TailMean
from cgla_graph.regions.paths import least_path
from cgla_graph.solvers.uncertain.cell_cut import CellCut, least_greatest
from cgla_graph.solvers.uncertain.outlook import UncertainSolution

#: Costs are rounded by less than this part.
ROUNDING = 1e-12


def nearest(values: object) -> cg.RiskField:
    """Return a field of one raster over the unit square."""
    return cg.RiskField(rasters=[cg.RasterRisk(values, (0, 0, 1, 1), interpolation="nearest")])  # type: ignore[arg-type]


def drawn(seed: int) -> cg.Problem:
    """Draw scenarios of rasters on one or two grids, with a wall on some maps, which cuts cells."""
    rng = np.random.default_rng(seed)
    grids = [tuple(rng.integers(2, 7, 2)) for _ in range(2)]
    fields = [nearest(rng.integers(0, 4, grids[int(rng.integers(0, 2))])) for _ in range(int(rng.integers(2, 5)))]
    wall = shapely.box(*np.sort(rng.uniform(0.3, 0.7, (2, 2)), axis=0).ravel()) if seed % 3 == 0 else None
    ends = (0.1, float(rng.choice([0.25, 0.3]))), (0.9, float(rng.choice([0.5, 0.77])))
    return cg.Problem(*ends, cg.UncertainField(fields), k=float(rng.uniform(0.5, 5.0)), no_fly=wall)


def crossed(cut: CellCut, path: FloatArray) -> list[float]:
    """List the numbers of the intervals that a path crosses."""
    points, cells, found = cut.points, cut.proof.cells, []
    for (x, y), (u, v) in zip(path[:-1].tolist(), path[1:].tolist(), strict=True):
        for axis, (lines, others) in enumerate(((cells.y, cells.x), (cells.x, cells.y))):
            (a, b), (c, d) = ((y, x), (v, u)) if axis == 0 else ((x, y), (u, v))
            for number in np.flatnonzero((min(a, c) < lines) & (lines < max(a, c))).tolist():
                at = b + (d - b) * (float(lines[number]) - a) / (c - a)
                n = min(max(int(np.searchsorted(others, at)) - 1, 0), len(others) - 2)
                part = (at - others[n]) / (others[n + 1] - others[n])
                side = points.sides[axis][(number, n) if axis == 0 else (n, number)]
                found.append(float(cut.of_sides[side, int(np.searchsorted(points.parts, part))]))
    return found


def check_cut(seed: int, *, scale: float = 1.0, moved: int = 0) -> int:
    """Hold the numbers of intervals, times `scale`, `moved` to others, against paths; return how many were met."""
    problem, rng = drawn(seed), np.random.default_rng([1, seed])
    field, cut = problem.field, CellCut.begin(problem, 10**6)
    assert isinstance(field, cg.UncertainField)
    assert cut is not None
    count = len(field.scenarios)
    tail = TailMean(field.probabilities, float(rng.choice([0.3, 1.0])))
    tried = [tail.inside(one) for one in (*np.eye(count), *rng.dirichlet(np.ones(count), 2))]
    under = [replace(problem, field=field.weighted(one)) for one in tried]
    paths = [least_path(one, 15).path for one in under]
    random = (rng.random((int(rng.integers(0, 3)), 2)) for _ in range(12))
    paths += [np.vstack([problem.start, one, problem.goal]) for one in random]
    paths = [path for path in paths if len(path) and problem.evaluate(path).feasible]
    costs = [max(one.evaluate(path).cost for one in under) for path in paths]
    met, limit = 0, min(costs, default=10.0)
    finer: CellCut | None = cut
    for _ in range(2):
        if finer is None:
            break
        for one in under:
            assert finer.add(one, limit) <= limit * (1.0 + ROUNDING)
        finer.of_sides = np.roll(finer.of_sides, moved, axis=0)
        assert not scale * min(finer.narrowest()[0], limit) > limit * (1.0 + ROUNDING)
        for path, cost in zip(paths, costs, strict=True):
            # (what is left out has no numbers, and no better path)
            numbers = crossed(finer, path) if finer is cut or cost <= limit else []
            met += len(numbers)
            assert scale * max(numbers, default=0.0) <= cost * (1.0 + ROUNDING)
        finer = finer.finer(limit * (1.0 + ROUNDING))
    return met


@examples(12)
@given(st.integers(0, 10**6))
def test_no_path_is_below_the_number_of_an_interval_that_it_crosses(seed: int) -> None:
    check_cut(seed)


@pytest.mark.parametrize("wrong", [{"scale": 1.02}, {"moved": 1}])
def test_numbers_that_are_too_high_are_caught(wrong: dict[str, float]) -> None:
    """One is enough in six maps, on which the true numbers hold."""
    assert sum(check_cut(seed) for seed in range(6)) > 100
    with pytest.raises(AssertionError):
        sum(check_cut(seed, **wrong) for seed in range(6))  # type: ignore[arg-type]


def corridors() -> cg.Problem:
    """Return two ways around dear cells, each of them dear in one of two scenarios."""
    below, above = np.zeros((10, 10)), np.zeros((10, 10))
    for values, low, high in ((below, 4.0, 0.4), (above, 0.4, 4.0)):
        values[2:8, 3:7], values[:2, 4:6], values[8:, 4:6] = 30.0, low, high
    return cg.Problem((0.05, 0.5), (0.95, 0.5), cg.UncertainField([nearest(below), nearest(above)]), k=5.0)


def test_the_cut_closes_the_gap_of_two_corridors_on_cells() -> None:
    """Places on spline grids left 2.7 % of it, in six times the time."""
    found = cg.solve(corridors(), objective="worst")
    assert isinstance(found, UncertainSolution)
    assert found.duality_gap > 0.5
    assert found.weighted_bound < 0.7 * found.lower_bound
    assert found.gap <= 0.01


def test_weights_are_sought_for_the_place_that_all_paths_pass() -> None:
    """Eight rasters: the weights of the ascent alone leave 2.8 %, and spline grids left 3.0 %."""
    rng = np.random.default_rng(1)
    smooth = [ndimage.gaussian_filter(rng.random((24, 24)), 2, mode="nearest") for _ in range(8)]
    fields = [nearest((one - one.min()) / np.ptp(one)) for one in smooth]
    problem = cg.Problem((0.05, 0.05), (0.95, 0.93), cg.UncertainField(fields), k=10.0)
    found = cg.solve(problem, objective="worst")
    assert isinstance(found, UncertainSolution)
    assert found.duality_gap > found.gap
    assert found.gap <= 0.01


def test_chains_pass_corners_and_end_where_start_and_goal_share_a_cell() -> None:
    pairs, values = np.array([[0, 1, 0], [1, 2, 2]]), np.array([1.0, 3.0, 4.0])
    assert least_greatest(pairs, values, [0, 1], [2]) == 3.0
    assert least_greatest(pairs, values, [0], [0, 1]) == -math.inf
    assert least_greatest(pairs[:, :1], values[:1], [0], [2]) == math.inf
    cut = CellCut.begin(corridors(), 10**6)
    assert cut is not None
    # (without weights, nothing is known)
    assert cut.narrowest()[0] == -math.inf

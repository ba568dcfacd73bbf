"""The bound over cells of constant cost: no path is below it, and none of its parts can be left out."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from strategies import examples
from test_paths import noise, several

import cgla_graph as cg
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.certificate.cell_proof import CellProof
from cgla_graph.regions import arrangement, bound, pair_kernels
from cgla_graph.regions.arrangement import Arrangement
from cgla_graph.regions.bound import Rounding, intervals, lowered
from cgla_graph.regions.points import border_points, fractions, lengths


def lower_bound(problem: cg.Problem, m: int, limit: float = math.inf) -> float:
    proof = CellProof.begin(problem, 10**6)
    assert proof is not None
    proof.m = m
    return proof.bounds(limit, math.inf)[0]


def best_over_lines(problem: cg.Problem, m: int) -> float:
    """Find the best path over points on all lines of the rasters, each step weighed by the oracle."""
    lines = []
    for axis in (0, 1):
        low, high = problem.bounds[axis], problem.bounds[axis + 2]
        every = [low, high, problem.start[axis], problem.goal[axis]]
        for raster in problem.field.rasters:
            size = raster.cell_size[axis]
            edges = raster.bounds[axis] + np.arange(raster.values.shape[1 - axis] + 1) * size
            every += [*edges, edges[0] - 1e-6 * size, edges[-1] + 1e-6 * size]
        lines.append(np.unique(np.clip(every, low, high)))
    parts = np.concatenate([[0.0], fractions(m), [1.0]])
    # (numbers of points: along x between each two lines, along y between each two lines)
    fine = [np.unique((of[:-1, None] * (1.0 - parts) + of[1:, None] * parts).ravel()) for of in lines]
    fine = [np.union1d(of, line) for of, line in zip(fine, lines, strict=True)]
    on = [np.isin(of, line) for of, line in zip(fine, lines, strict=True)]
    x, y = (grid.ravel() for grid in np.meshgrid(*fine))
    kept = np.add.outer(on[1], on[0]).ravel() > 0
    places = np.column_stack([x, y])[kept]
    one, other = [], []
    for low_y, high_y in itertools.pairwise(lines[1]):
        row = np.nonzero((places[:, 1] >= low_y) & (places[:, 1] <= high_y))[0]
        for low_x, high_x in itertools.pairwise(lines[0]):
            near = row[(places[row, 0] >= low_x) & (places[row, 0] <= high_x)]
            first, last = np.triu_indices(len(near), 1)
            one.append(near[first])
            other.append(near[last])
    heads, tails = np.concatenate(one), np.concatenate(other)
    weights = np.maximum(problem.model.weights(places[heads], places[tails]), 1e-300)
    free = np.isfinite(weights)
    graph = csr_array((weights[free], (heads[free], tails[free])), shape=(len(places), len(places)))
    start, goal = (int(np.argmin(np.hypot(*(places - end).T))) for end in (problem.start, problem.goal))
    _, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    path = [goal]
    while path[-1] != start:
        if before[path[-1]] < 0:
            return math.inf
        path.append(int(before[path[-1]]))
    found = problem.evaluate(places[path[::-1]])
    return float(found.cost) if found.feasible else math.inf


def adverse(seed: int) -> cg.Problem:
    """Draw up to three rasters of steep costs, some on the same cells, some far away; ends on and beside lines."""
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.uniform(-3.0, 4.0)
    low = scale * rng.choice([0.0, 1.0, 1e5]) * rng.standard_normal(2)
    size = scale * np.array([1.0, 10.0 ** rng.uniform(-1.0, 0.0)])
    same, rasters = rng.random() < 0.6, []
    shape, begin, wide = rng.integers(1, 5, 2), low, size
    for _ in range(int(rng.integers(1, 4))):
        if not same:
            shape = rng.integers(1, 5, 2)
            begin, wide = low + size * rng.uniform(-0.4, 0.4, 2), size * rng.uniform(0.5, 1.2, 2)
        values = rng.integers(0, 5, shape) ** rng.choice([1.0, 5.0]) / scale
        rasters.append(cg.RasterRisk(values, (*begin, *(begin + wide)), interpolation="nearest"))
    first = rasters[0]
    ends = low + size * rng.random((2, 2))
    for end, axis in itertools.product((0, 1), (0, 1)):
        if rng.random() < 0.4:
            step = first.cell_size[axis]
            line = rng.integers(0, first.values.shape[1 - axis] + 1) + rng.choice([0.0, 1e-12, -1e-9, 1e-5])
            ends[end, axis] = first.bounds[axis] + line * step
    if rng.random() < 0.2:
        ends[1] = ends[0] + size * rng.standard_normal(2) * 10.0 ** rng.uniform(-8.0, -2.0)
    ends = np.clip(ends, low, low + size)
    corners = low + size * rng.random((2, 2))
    wall = shapely.box(*corners.min(axis=0), *corners.max(axis=0)) if rng.random() < 0.3 else None
    bounds, k = (*low.tolist(), *(low + size).tolist()), 10.0 ** rng.uniform(-1.0, 2.0)
    free = wall is None or not shapely.intersects_xy(wall, *ends.T).any()
    field = cg.RiskField(rasters=rasters)
    return cg.Problem(tuple(ends[0]), tuple(ends[1]), field, k, bounds, no_fly=wall if free else None)


def refute(problem: cg.Problem, m: int, points: int = 4) -> None:
    """Look for a path below the bound, and below that of the tube that remains."""
    best, proof = best_over_lines(problem, points), CellProof.begin(problem, 10**6)
    if proof is None or problem.start == problem.goal:
        return
    proof.m = m
    for _ in range(2):
        assert proof.bounds(best, math.inf)[0] <= best
        found, keep = proof.bounds(math.inf, math.inf)
        assert found <= best
        if keep is None:
            return
        # (that path itself stays in the tube)
        keep(best * (1.0 + 1e-9))


@examples(8)
@given(st.integers(0, 10**6), st.sampled_from([1, 2, 5, 15]))
def test_no_path_is_below_the_bound(seed: int, m: int) -> None:
    refute(adverse(seed), m)


@examples(6)
@given(st.integers(0, 10**6), st.sampled_from([1, 3, 9]))
def test_neither_is_a_random_one(seed: int, m: int) -> None:
    problem = several(seed)
    if problem.start == problem.goal:
        return
    low = lower_bound(problem, m)
    rng = np.random.default_rng(seed)
    bounds = np.reshape(problem.bounds, (2, 2))
    for n in (0, 1, 1, 2, 5):
        path = np.vstack([problem.start, rng.uniform(*bounds, (n, 2)), problem.goal])
        assert low <= problem.evaluate(path).cost


def test_along_a_line_each_raster_takes_its_lesser_value() -> None:
    """Both cells cost 91; on the line between them, the oracle counts 0 of either raster."""
    rasters = [cg.RasterRisk(values, (0, 0, 2, 4), interpolation="nearest") for values in ([[0, 9]], [[9, 0]])]
    problem = cg.Problem((0.9, 0.5), (1.1, 3.5), cg.RiskField(rasters=rasters), 10.0, (0, 0, 2, 4))
    path = [(0.9, 0.5), (1.0, 0.5), (1.0, 3.5), (1.1, 3.5)]

    assert problem.evaluate(path).cost == pytest.approx(2.0 * 0.1 * 91.0 + 3.0)
    assert 0.95 * problem.evaluate(path).cost < lower_bound(problem, 31) <= best_over_lines(problem, 15)


@pytest.mark.parametrize("beside", [0.0, 1e-16, -1e-12, 3e-10, -3e-10])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("far", [False, True])
def test_on_the_border_the_cells_beyond_count(beside: float, axis: int, far: bool) -> None:
    """The map is a window of a raster, whose cells beyond the border are cheaper: on their line, their value holds."""
    values = np.full((5, 5), 9.0)
    values[:, 4 if far else 0] = 0.0
    raster = cg.RasterRisk(values if axis == 0 else values.T, (-1, -1, 4, 4), interpolation="nearest", origin="lower")
    line, near = (3.0 + beside, 2.9) if far else (0.0 + beside, 0.1)
    path = np.array([(near, 0.5), (line, 0.5), (line, 2.5), (near, 2.5)])
    box = [0.0, 0.0, line, 3.0] if far else [line, 0.0, 3.0, 3.0]
    if axis == 1:
        path, box = path[:, ::-1], [box[1], box[0], box[3], box[2]]
    problem = cg.Problem(tuple(path[0]), tuple(path[3]), cg.RiskField(rasters=[raster]), 10.0, tuple(box))
    least, cost = lower_bound(problem, 31), problem.evaluate(path).cost

    assert least <= min(best_over_lines(problem, 3), cost)
    # (farther off than rounding, a line that is none counts as one)
    assert least > 0.9 * cost or abs(beside) > 1e-15


def test_the_edge_of_a_raster_on_the_border_belongs_to_it() -> None:
    raster = cg.RasterRisk([[9.0, 1.0]], (0, 0, 2, 1), interpolation="nearest")
    problem = cg.Problem((0.1, 0.1), (0.1, 0.9), cg.RiskField(rasters=[raster]), 10.0, (0, 0, 2, 1))
    assert Arrangement.of(problem, for_bound=True).along is None


def test_a_border_keeps_lines_where_its_cost_changes() -> None:
    """Cells of one cost are one, except where the cells beyond the border differ."""
    values = np.full((4, 4), 5.0)
    values[0] = (5.0, 5.0, 0.0, 0.0)
    raster = cg.RasterRisk(values, (0, -1, 4, 3), interpolation="nearest", origin="lower")
    problem = cg.Problem((0.5, 0.5), (3.5, 0.5), cg.RiskField(rasters=[raster]), 1.0, (0, 0, 4, 3))
    cells = Arrangement.of(problem, for_bound=True)

    assert (cells.x.tolist(), cells.y.tolist(), cells.costs.tolist()) == ([0, 2, 4], [0, 3], [[6, 6]])
    assert cells.along is not None
    assert [of.tolist() for of in cells.along] == [[[6, 1], [6, 6]], [[6, 6, 6]]]


def test_a_cell_inside_an_area_counts_on_a_line_beside_its_outline() -> None:
    """The outline is 6e-17 beside the line, on which paths along it have the lesser cost of the cell inside."""
    values = np.full((10, 10), 9.0)
    values[1:-1, 3] = 0.0
    raster = cg.RasterRisk(values, (0, 0, 1, 1), interpolation="nearest")
    area = shapely.box(0.3, 0.01, 0.45, 0.99)
    problem = cg.Problem((0.25, 0.15), (0.25, 0.85), cg.RiskField(rasters=[raster]), 100.0, no_fly=area)
    path = [(0.25, 0.15), (0.3, 0.15), (0.3, 0.85), (0.25, 0.85)]

    assert 0.9 * problem.evaluate(path).cost < lower_bound(problem, 15) <= problem.evaluate(path).cost


def test_lines_are_where_the_rasters_end() -> None:
    """The path search lays lines beside the edges; for a bound, no place must cost less than its cell."""
    raster = cg.RasterRisk([[9.0]], (0.3, 0.0, 0.7, 0.5), interpolation="nearest")
    problem = cg.Problem((0.1, 0.1), (0.9, 0.1), cg.RiskField(rasters=[raster]), k=10.0)
    assert Arrangement.of(problem, for_bound=True).x.tolist() == [0.0, 0.3, 0.7, 1.0]


@examples(10)
@given(st.floats(0.02, 50.0), st.integers(1, 9), st.integers(0, 10**6))
def test_lowered_lengths_bound_all_pairs_of_places(aspect: float, m: int, seed: int) -> None:
    """Of values that keep to the lowered lengths, no two places of the border differ by more than their distance."""
    rng = np.random.default_rng(seed)
    parts = fractions(m)
    table, at = lowered(aspect, 1.0, parts)[0], border_points(aspect, 1.0, parts)
    values = rng.uniform(0.0, 2.0, len(at)) * rng.choice([0.0, 1.0, 1.0], len(at))
    for _ in range(len(at)):
        values = np.minimum(values, (values + table).min(axis=1))
    ends = intervals(m)[:, :2]
    one, other = ends[rng.integers(len(ends), size=(2, 4000))]
    s, t = rng.choice([rng.random(4000), rng.beta(0.3, 0.3, 4000)]), rng.beta(0.3, 0.3, 4000)

    def mean(of: FloatArray, pair: FloatArray, share: FloatArray) -> FloatArray:
        share = share.reshape(-1, *[1] * (of.ndim - 1))
        return np.asarray((1.0 - share) * of[pair[:, 0]] + share * of[pair[:, 1]])

    apart = np.hypot(*(mean(at, one, s) - mean(at, other, t)).T)
    assert (np.abs(mean(values, one, s) - mean(values, other, t)) <= apart * (1.0 + 1e-9) + 1e-12).all()
    assert (table >= 0.0).all()


@pytest.mark.parametrize("m", [1, 4, 8])
def test_enclosed_ratios_are_little_above_sampled_ones(m: int) -> None:
    parts = fractions(m)
    at, ends = border_points(1.0, 1.0, parts), intervals(m)
    grid = np.linspace(0.0, 1.0, 21)
    weights = np.column_stack([1.0 - grid, grid])
    for (a, b, side), (c, d, other) in itertools.combinations(ends.tolist(), 2):
        if side == other or {a, b} & {c, d}:
            continue
        far = np.hypot(*(weights @ at[[a, b]])[:, None].transpose(2, 0, 1) - (weights @ at[[c, d]]).T[:, None])
        mean = weights @ np.hypot(*(at[[a, b]][:, None] - at[[c, d]]).transpose(2, 0, 1)) @ weights.T
        sampled = float((1.0 - far / mean).max())
        enclosed = pair_kernels._enclosed(at, a, b, c, d, bound.BOXES)
        assert sampled <= enclosed <= sampled + 0.02


@pytest.mark.parametrize("thin", [1e-3, 1e-6, 1e-9])
def test_in_thin_cells_no_length_is_negative(thin: float) -> None:
    """Tangent planes of long intervals on near sides fall below 0: lengths were negative, and were not checked."""
    table = lowered(1.0, thin, fractions(3))[0]
    assert (table >= 0.0).all()


@pytest.mark.parametrize(("m", "gap"), [(7, 0.016), (15, 0.0045), (31, 0.0015)])
def test_on_noise_the_gap_falls_with_the_square_of_the_points(m: int, gap: float) -> None:
    assert lower_bound(noise(40, 10.0), m) > 245.521 / (1.0 + gap)


def check() -> None:
    for seed in CHECKED:
        refute(adverse(seed), 3, 8)


def not_lowered(width: float, height: float, parts: FloatArray) -> tuple[FloatArray, FloatArray]:
    return lengths(width, height, parts), lengths(width, height, parts)


#: Maps on which each broken twin is seen.
CHECKED = (16, 39)
seeds_of, of = bound.seeds, Rounding.of


def doubled(nodes: IntArray, values: FloatArray) -> tuple[IntArray, FloatArray]:
    return nodes, 2.0 * values


BROKEN: dict[str, tuple[object, str, Callable[..., object]]] = {
    "lengths as they are": (bound, "lowered", not_lowered),
    "seeds twice as far": (bound, "seeds", lambda points, goal: doubled(*seeds_of(points, goal))),
    "cells dearer than lines": (arrangement, "_along_lines", lambda *_: None),
}


def test_a_path_is_found_below_a_broken_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    check()
    for module, name, twin in BROKEN.values():
        with monkeypatch.context() as changed, pytest.raises(AssertionError):  # noqa: PT012 - the change is undone
            changed.setattr(module, name, twin)
            check()


def test_values_that_are_too_steep_lower_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the stored values count: a search that goes wrong makes no wrong bound."""
    problem = noise(24, 10.0)
    before = lower_bound(problem, 3)
    spread = bound.Points.spread

    def wrong(points: bound.Points, values: FloatArray, limit: float) -> None:
        spread(points, values, limit)
        values[: len(values) // 2] *= 1.5

    monkeypatch.setattr(bound.Points, "spread", wrong)
    after = lower_bound(problem, 3)
    monkeypatch.undo()

    assert 0.0 < after < before

    def broken(points: bound.Points, values: FloatArray, limit: float) -> None:
        spread(points, values, limit)
        values[5] = math.nan

    monkeypatch.setattr(bound.Points, "spread", broken)
    assert 0.0 <= lower_bound(problem, 3) < 0.1 * before


def test_rounding_is_that_of_the_places() -> None:
    """It took the factor of a raster for what counts as on its lines: there was no bound at all."""
    near = Rounding.of(noise(24, 10.0), Arrangement.of(noise(24, 10.0), for_bound=True))
    raster = cg.RasterRisk(np.eye(4), (6e6, 0, 6e6 + 40.0, 40), interpolation="nearest", scale=1e6)
    far = cg.Problem((6e6, 0), (6e6 + 40.0, 40), cg.RiskField(rasters=[raster]), 1.0, raster.bounds)

    assert near.share < 2e-7
    assert near.apart < 1e-7
    assert near.share < Rounding.of(far, Arrangement.of(far, for_bound=True)).share < 1e-6


@examples(4)
@given(st.integers(0, 10**6))
def test_aligned_rasters_are_bounded_closely(seed: int) -> None:
    """Both the search over lines and the bound know what a line costs: they meet."""
    rng = np.random.default_rng(seed)
    rasters = [cg.RasterRisk(rng.random((5, 5)) * 9.0, (0, 0, 1, 1), interpolation="nearest") for _ in range(2)]
    problem = cg.Problem((0.12, 0.17), (0.93, 0.88), cg.RiskField(rasters=rasters), 3.0)
    best = best_over_lines(problem, 9)

    assert Arrangement.of(problem, for_bound=True).along is not None
    assert 0.9 * best < lower_bound(problem, 31) <= best

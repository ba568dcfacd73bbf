"""
Fast marching: against a plain twin, and against exact solutions by the rate of the error.

Differences of first order take the cost half a step upwind, by design.
"""

import math
from collections.abc import Callable

import numpy as np
import oracles
import pytest
import strategies
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph._types import BoolArray, FloatArray, Point, WholeArray
from cgla_graph.eikonal import marching_kernels
from cgla_graph.eikonal.marching import bends_of
from cgla_graph.eikonal.mesh import NO_PAIRS, joints_of
from cgla_graph.testing import strategies as drawn

#: The time from a source to points of shape ``(..., 2)``.
Times = Callable[[FloatArray], FloatArray]


def neighbours_of(shape: tuple[int, int]) -> WholeArray:
    """Tell who is west, east, south and north of each node of a full grid, numbered row by row."""
    ny, nx = shape
    numbers = np.full((ny + 2, nx + 2), ny * nx)
    numbers[1:-1, 1:-1] = np.arange(ny * nx).reshape(ny, nx)
    beside = [numbers[1:-1, :-2], numbers[1:-1, 2:], numbers[:-2, 1:-1], numbers[2:, 1:-1]]
    return np.vstack([np.stack([side.ravel() for side in beside], axis=1), np.full((1, 4), ny * nx)]).astype(np.uint32)


def marched(
    times: FloatArray, cost: FloatArray, spacing: tuple[float, float], *, second: bool, done: BoolArray | None = None
) -> FloatArray:
    """March on from what is finite in `times`; all arrays have shape ``(ny, nx)``."""
    every = np.append(times, math.inf)
    state = np.where(np.isfinite(every), marching_kernels.TRIAL, marching_kernels.FAR).astype(np.int8)
    if done is not None:
        state[:-1][done.ravel()] = marching_kernels.DONE
    padded = np.append(cost, 1.0)
    beside_wall = np.full((len(every), 2), -1.0)
    extra = joints_of(NO_PAIRS, spacing, times.size), bends_of([], times.size)
    marching_kernels.march(every, state, padded, neighbours_of(times.shape), beside_wall, spacing, second, *extra)
    assert every[-1] == math.inf
    return every[:-1].reshape(times.shape)


@st.composite
def marches(draw: st.DrawFn) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Draw first times, costs and a spacing: rough or smooth, from one node or many."""
    rng = np.random.default_rng(draw(drawn.seeds))
    shape = draw(st.integers(1, 12)), draw(st.integers(1, 12))
    spread = draw(st.sampled_from([0.01, 0.3, 3.0]))
    cost = np.exp(spread * rng.standard_normal(shape))
    times = np.full(shape, math.inf)
    n_seeds = draw(st.integers(1, 4))
    times.ravel()[rng.integers(times.size, size=n_seeds)] = rng.random(n_seeds)
    width, height = rng.uniform(0.1, 2.0, 2).tolist()
    return times, cost, (width, height)


@given(marches(), st.booleans())
@strategies.fast
def test_marching_equals_its_plain_twin(
    march: tuple[FloatArray, FloatArray, tuple[float, float]],
    second: bool,
) -> None:
    times, cost, spacing = march
    found = marched(times, cost, spacing, second=second)
    np.testing.assert_allclose(found, oracles.fast_marching(times, cost, spacing, second=second), rtol=1e-6)


def test_costs_at_the_node_itself_are_not_the_same() -> None:
    """The twin can tell: where the cost of a first-order difference is taken matters."""
    rng = np.random.default_rng(1)
    cost, times = np.exp(rng.standard_normal((8, 8))), np.full((8, 8), math.inf)
    times[0, 0] = 0.0
    found = marched(times, cost, (1.0, 1.0), second=False)
    other = oracles.fast_marching(times, cost, (1.0, 1.0), second=False, shifted=False)
    assert abs(found / np.maximum(other, 1e-9) - 1.0)[other > 0.0].max() > 0.01


@given(marches(), st.booleans())
@strategies.usual
def test_times_have_no_local_minimum_but_the_seeds(
    march: tuple[FloatArray, FloatArray, tuple[float, float]],
    second: bool,
) -> None:
    times, cost, spacing = march
    found = marched(times, cost, spacing, second=second)
    assert np.isfinite(found).all()
    framed = np.pad(found, 1, constant_values=math.inf)
    lowest = np.min([framed[1:-1, :-2], framed[1:-1, 2:], framed[:-2, 1:-1], framed[2:, 1:-1]], axis=0)
    assert (np.isfinite(times) | (lowest <= found)).all()
    assert (found <= times).all()


@pytest.mark.parametrize("steep", [1e3, 1e14, 1e17, 1e30])
def test_times_beyond_all_numbers_of_buckets_are_told(steep: float) -> None:
    cost, times = np.ones((5, 5)), np.full((5, 5), math.inf)
    cost[2:, 2:], times[0, 0] = steep, 0.0
    found = marched(times, cost, (0.1, 0.1), second=True)
    assert found[:2].max() < 1.0
    # from either side, half a step upwind
    assert 0.03 * steep < found[2, 2] < found[2, 3] < found[3, 3] < found[4, 4] < 0.4 * steep


# Exact solutions


def distance_times(source: Point) -> Times:
    """Cost 1 everywhere."""
    return lambda points: np.hypot(*np.moveaxis(points - source, -1, 0))


def linear_speed_times(source: Point, slope: Point) -> Times:
    """
    Speed ``1 + slope . p``: paths are arcs of circles.

    ``T = arccosh(1 + |slope|^2 |p - q|^2 / (2 v(p) v(q))) / |slope|``.
    """

    def times(points: FloatArray) -> FloatArray:
        squared = ((points - source) ** 2).sum(axis=-1)
        speeds = (1.0 + points @ np.array(slope)) * (1.0 + np.dot(source, slope))
        size = math.hypot(*slope)
        return np.asarray(np.arccosh(1.0 + size**2 * squared / (2.0 * speeds)) / size)

    return times


def grid(n: int) -> FloatArray:
    """Points of the unit box, shape ``(n + 1, n + 1, 2)``."""
    axis = np.linspace(0.0, 1.0, n + 1)
    return np.stack(np.meshgrid(axis, axis), axis=-1)


def errors(
    exact: Times, cost: Callable[[FloatArray], FloatArray], source: Point, disc: float, *, second: bool
) -> FloatArray:
    """Return the mean error on grids of half the spacing each; times within `disc` are given."""
    found = []
    for n in (32, 64, 128, 256):
        points = grid(n)
        wanted = exact(points)
        away = np.hypot(*np.moveaxis(points - source, -1, 0)) - disc
        given_times = np.where(away <= 1e-9, wanted, math.inf)
        # the last three rings of the disc may be lowered; within, differences would not do for the tip
        done = away < -3.0 / n
        times = marched(given_times, cost(points), (1.0 / n, 1.0 / n), second=second, done=done)
        found.append(float(np.abs(times - wanted).mean()))
    return np.array(found)


SLOPE = (1.0, 0.5)
SOURCE = (0.25, 0.375)


def one(points: FloatArray) -> FloatArray:
    return np.ones(points.shape[:-1])


def slowness(points: FloatArray) -> FloatArray:
    return np.asarray(1.0 / (1.0 + points @ np.array(SLOPE)))


@pytest.mark.parametrize(
    ("exact", "cost"),
    [(distance_times(SOURCE), one), (linear_speed_times(SOURCE, SLOPE), slowness)],
    ids=["constant", "linear speed"],
)
def test_the_order_of_the_differences_is_that_of_the_error(
    exact: Times, cost: Callable[[FloatArray], FloatArray]
) -> None:
    first = errors(exact, cost, SOURCE, 0.2, second=False)
    second = errors(exact, cost, SOURCE, 0.2, second=True)
    assert 0.85 < oracles.rate(first) < 1.3
    assert 1.6 < oracles.rate(second) < 2.5
    assert (second < 0.3 * first).all()


def test_from_a_point_the_error_is_that_of_h_log_h() -> None:
    found = errors(distance_times(SOURCE), one, SOURCE, 0.0, second=False)
    h = 1.0 / np.array([32.0, 64.0, 128.0, 256.0])
    share = found / (h * np.log(1.0 / h))
    assert share.max() < 1.25 * share.min()
    assert 0.6 < oracles.rate(found) < 1.0


@pytest.mark.parametrize("second", [False, True])
def test_scikit_fmm_is_no_nearer_to_the_truth(second: bool) -> None:
    skfmm = pytest.importorskip("skfmm")
    n, radius = 100, 0.2
    points = grid(n)
    away = np.hypot(*np.moveaxis(points - SOURCE, -1, 0)) - radius
    theirs = skfmm.travel_time(away, np.ones_like(away), dx=1.0 / n, order=2 if second else 1)
    times = np.where(away <= 0.0, away, math.inf)
    ours = marched(times, np.ones_like(away), (1.0 / n, 1.0 / n), second=second, done=away < -3.0 / n)
    outside = away > 0.0
    error, reference = (np.abs(found - away)[outside].max() for found in (ours, np.asarray(theirs)))
    assert error < 1.05 * reference
    assert np.abs(ours - theirs)[outside].max() < 2.0 * reference

"""The bound over cells of constant cost: no path is below it, and none of its parts can be left out."""

import itertools
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples
from test_paths import noise, several

import cgla_graph as cg
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.regions import bound, pair_kernels
from cgla_graph.regions.bound import intervals, lower_bound, lowered
from cgla_graph.regions.points import border_points, fractions, lengths


def best_known(problem: cg.Problem) -> float:
    return min(cg.solve(problem, tolerance=None).cost, cg.solve(problem, "weighted-regions", points=20).cost)


@examples(8)
@given(st.integers(0, 10**6), st.sampled_from([1, 2, 5, 9]))
def test_no_path_is_below_the_bound(seed: int, m: int) -> None:
    problem = several(seed)
    if problem.start == problem.goal:
        return
    low, factor = lower_bound(problem, m)
    rng = np.random.default_rng(seed)
    bounds = np.reshape(problem.bounds, (2, 2))
    for n in (0, 1, 1, 2, 5):
        path = np.vstack([problem.start, rng.uniform(*bounds, (n, 2)), problem.goal])
        assert low <= problem.evaluate(path).cost

    assert factor < 1.0 + 1e-6
    assert low <= best_known(problem)


@examples(15)
@given(st.floats(0.05, 20.0), st.integers(1, 9), st.integers(0, 10**6))
def test_lowered_lengths_bound_all_pairs_of_places(aspect: float, m: int, seed: int) -> None:
    """Of values that keep to the lowered lengths, no two places of the border differ by more than their distance."""
    rng = np.random.default_rng(seed)
    parts = fractions(m)
    table, at = lowered(aspect, 1.0, parts), border_points(aspect, 1.0, parts)
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


@pytest.mark.parametrize("m", [1, 4, 8])
def test_enclosed_ratios_are_little_above_sampled_ones(m: int) -> None:
    parts = fractions(m)
    at, ends = border_points(1.0, 1.0, parts), intervals(m)
    grid = np.linspace(0.0, 1.0, 21)
    weights = np.column_stack([1.0 - grid, grid])
    for (a, b, side), (c, d, other) in itertools.product(ends.tolist(), repeat=2):
        if side == other or {a, b} & {c, d}:
            continue
        far = np.hypot(*(weights @ at[[a, b]])[:, None].transpose(2, 0, 1) - (weights @ at[[c, d]]).T[:, None])
        mean = weights @ np.hypot(*(at[[a, b]][:, None] - at[[c, d]]).transpose(2, 0, 1)) @ weights.T
        sampled = float((1.0 - far / mean).max())
        enclosed = pair_kernels._enclosed(at, a, b, c, d, bound.BOXES)
        assert sampled <= enclosed <= sampled + 0.02


@pytest.mark.parametrize(("m", "gap"), [(7, 0.016), (15, 0.0045), (31, 0.0015)])
def test_on_noise_the_gap_falls_with_the_square_of_the_points(m: int, gap: float) -> None:
    low, _ = lower_bound(noise(40, 10.0), m)
    assert low > 245.521 / (1.0 + gap)


def check(m: int = 3) -> None:
    """Look for a path below the bound."""
    for seed in range(8):
        problem = several(seed)
        if problem.start != problem.goal:
            assert lower_bound(problem, m)[0] <= best_known(problem)
    assert lower_bound(noise(24, 10.0), m)[0] <= best_known(noise(24, 10.0))


def not_lowered(width: float, height: float, parts: FloatArray) -> FloatArray:
    return lengths(width, height, parts)


bound_seeds = bound.seeds


def doubled(nodes: IntArray, values: FloatArray) -> tuple[IntArray, FloatArray]:
    return nodes, 2.0 * values


BROKEN: dict[str, tuple[str, Callable[..., object]]] = {
    "lengths as they are": ("lowered", not_lowered),
    "seeds twice as far": ("seeds", lambda points, goal: doubled(*bound_seeds(points, goal))),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_twin_is_seen(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check()
    monkeypatch.setattr(bound, *BROKEN[name])
    with pytest.raises(AssertionError):
        check()


def test_values_that_are_too_steep_lower_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the stored values count: a search that goes wrong makes no wrong bound."""
    problem = noise(24, 10.0)
    before, _ = lower_bound(problem, 3)
    spread = bound.Points.spread

    def wrong(points: bound.Points, values: FloatArray, limit: float) -> None:
        spread(points, values, limit)
        values[: len(values) // 2] *= 1.5

    monkeypatch.setattr(bound.Points, "spread", wrong)
    after, factor = lower_bound(problem, 3)

    assert factor > 1.5
    assert after < before
    assert after <= best_known(problem)

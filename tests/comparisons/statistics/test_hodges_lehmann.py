"""Hodges and Lehmann's estimate: against enumeration, test inversion, a textbook and simulation."""

import itertools
import math
import statistics
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import usual

from cgla_graph.comparisons.statistics.hodges_lehmann import (
    hodges_lehmann,
    signed_rank_distribution,
    subset_sums,
    walsh_rank,
)
from cgla_graph.comparisons.statistics.intervals import Estimate
from cgla_graph.comparisons.statistics.paired import signed_rank

numbers = st.floats(-10.0, 10.0) | st.integers(-3, 3).map(float)
differences = st.lists(numbers | st.sampled_from([math.inf, -math.inf]), min_size=1, max_size=25)

# Hamilton depression scale of nine patients, before and after: Hollander, Wolfe, "Nonparametric Statistical Methods",
# example 3.1 (also in the manual of R's wilcox.test).
BEFORE = (1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30)
AFTER = (0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29)
DEPRESSION = tuple(after - before for before, after in zip(BEFORE, AFTER, strict=True))


def averages(sample: Sequence[float]) -> list[float]:
    """Write out the Walsh averages, in order; opposite infinities average to 0."""
    pairs = itertools.combinations_with_replacement(sample, 2)
    return sorted(0.0 if math.isinf(a) and a == -b else a / 2.0 + b / 2.0 for a, b in pairs)


def by_definition(sample: Sequence[float]) -> Estimate:
    ordered = averages(sample)
    lower, upper = statistics.median_low(ordered), statistics.median_high(ordered)
    middle = lower if lower == upper else 0.0 if math.isinf(lower) and math.isinf(upper) else lower / 2.0 + upper / 2.0
    rank = walsh_rank(len(sample))
    return Estimate(middle, *((ordered[rank - 1], ordered[-rank]) if rank else (-math.inf, math.inf)))


@given(sample=differences)
def test_the_estimate_is_that_of_the_definition(sample: list[float]) -> None:
    assert hodges_lehmann(sample) == pytest.approx(by_definition(sample), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("few", [0, 1, 7, 100])
def test_searching_for_an_average_finds_the_one_that_sorting_finds(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(few)
    samples = [rng.normal(size=40), rng.integers(-3, 4, 41), np.zeros(30), rng.choice([-np.inf, 0.5, np.inf], 33)]
    expected = [by_definition(sample.tolist()) for sample in samples]
    monkeypatch.setattr("cgla_graph.comparisons.statistics.hodges_lehmann._FEW", few)
    for sample, one in zip(samples, expected, strict=True):
        assert hodges_lehmann(sample.tolist()) == pytest.approx(one, rel=1e-14, abs=1e-14)


def test_many_differences() -> None:
    rng = np.random.default_rng(1)
    sample = rng.normal(size=3000)
    rows, columns = np.triu_indices(len(sample))
    ordered = np.sort((sample[rows] + sample[columns]) / 2.0)
    rank = walsh_rank(len(sample))
    expected = (float(np.median(ordered)), ordered[rank - 1], ordered[-rank])
    assert hodges_lehmann(sample.tolist()) == pytest.approx(expected, rel=1e-12)


@usual
@given(sample=st.lists(st.floats(-10.0, 10.0), min_size=6, max_size=14), shift=st.floats(-12.0, 12.0))
def test_the_interval_holds_what_the_test_does_not_reject(sample: list[float], shift: float) -> None:
    moved = [value - shift for value in sample]
    assume(len({abs(value) for value in moved}) == len(sample))
    assume(min(abs(average - shift) for average in averages(sample)) > 1e-9)
    found = hodges_lehmann(sample)
    assert (found.low < shift < found.high) == (signed_rank(moved).p > 0.05)


def test_more_than_a_third_of_failures_has_no_finite_middle() -> None:
    # an average is finite where both parts are: (1 - f) ** 2 of all is less than half from f = 0.29 on
    assert hodges_lehmann([1.0] * 8 + [math.inf] * 2).median == 1.0
    assert hodges_lehmann([1.0] * 6 + [math.inf] * 4).median == math.inf


def test_greatest_and_least_numbers() -> None:
    big, small = 1.7e308, 5e-324
    assert hodges_lehmann([big] * 6) == Estimate(big, big, big)
    assert hodges_lehmann([-big, big]).median == 0.0
    assert hodges_lehmann([big, math.inf]).median == math.inf
    assert hodges_lehmann([0.0] * 5 + [math.inf]) == Estimate(0.0, 0.0, math.inf)
    assert abs(hodges_lehmann([small] * 6).median) <= small
    assert hodges_lehmann([math.inf] * 6) == Estimate(math.inf, math.inf, math.inf)


def test_the_textbook_example() -> None:
    # the estimate, and the interval of confidence 96.1 % that is the next one to 95 %: examples 3.3 and 3.4 of the book
    assert hodges_lehmann(DEPRESSION) == pytest.approx((-0.46, -0.786, -0.010), abs=1e-9)
    assert 1.0 - 2.0 * signed_rank_distribution(9)[: walsh_rank(9)].sum() == pytest.approx(0.961, abs=5e-4)


@given(parts=st.lists(st.integers(0, 9), max_size=9))
def test_sums_of_any_parts(parts: list[int]) -> None:
    found = np.zeros(sum(parts) + 1)
    for chosen in itertools.product([0, 1], repeat=len(parts)):
        found[sum(part for part, is_in in zip(parts, chosen, strict=True) if is_in)] += 0.5 ** len(parts)
    np.testing.assert_array_equal(subset_sums(np.array(parts, dtype=np.int64)), found)


@pytest.mark.parametrize("n", range(1, 51))
def test_ranks_are_the_greatest_that_have_the_confidence(n: int) -> None:
    rank, outside = walsh_rank(n), 2.0 * np.cumsum(signed_rank_distribution(n))
    assert rank == 0 or outside[rank - 1] <= 0.05
    assert outside[rank] > 0.05


def test_ranks_go_on_where_they_become_approximate() -> None:
    ranks = [walsh_rank(n) for n in range(40, 60)]
    steps = np.diff(ranks)
    assert (steps > 0).all()
    assert (np.abs(np.diff(steps)) <= 3).all()


@pytest.mark.parametrize("sample", [[], [1.0, math.nan]])
def test_differences_of_nonsense(sample: list[float]) -> None:
    with pytest.raises(ValueError, match="at least one number and no NaN"):
        hodges_lehmann(sample)

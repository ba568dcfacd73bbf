"""Ranks and tails against `scipy.stats`, which is not imported for them."""

import subprocess
import sys

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from strategies import fast

from cgla_graph.comparisons.statistics.distributions import (
    average_ranks,
    chi_square_tail,
    heads_test,
    median_rank,
)


@fast
@given(
    arrays(
        np.float64,
        array_shapes(min_dims=1, max_dims=2, max_side=8),
        elements=st.sampled_from([-np.inf, -1.0, -0.0, 0.0, 0.5, 1.0, 1.0 + 2.0**-52, np.inf]),
    )
)
def test_ranks_are_those_of_scipy(values: np.ndarray) -> None:
    assert np.array_equal(average_ranks(values), scipy.stats.rankdata(values, axis=0))


def test_ranks_of_no_values_are_none() -> None:
    assert average_ranks(np.empty(0)).shape == (0,)
    assert [average_ranks(np.empty(shape)).shape for shape in ((0, 3), (3, 0))] == [(0, 3), (3, 0)]


@pytest.mark.parametrize("tail", [0.025, 0.005, 0.1])
def test_quantiles_of_tosses_are_those_of_scipy(tail: float) -> None:
    counts = [*range(1, 200), 999, 10_000, 123_457]
    assert [median_rank(tail, n) for n in counts] == scipy.stats.binom.ppf(tail, counts, 0.5).tolist()


def test_tails_are_those_of_scipy() -> None:
    for n in (1, 2, 7, 40, 1001):
        for heads in {0, 1, n // 3, n // 2, n - 1, n}:
            assert heads_test(heads, n) == pytest.approx(scipy.stats.binomtest(heads, n).pvalue, rel=1e-11)
    for value in (0.0, 0.1, 3.0, 40.0, 900.0):
        for degrees in (1, 2, 9, 60):
            assert chi_square_tail(value, degrees) == pytest.approx(scipy.stats.chi2.sf(value, degrees), rel=1e-11)


@pytest.mark.slow
def test_a_comparison_does_not_import_what_is_slow_to_import() -> None:
    words = [
        "compare",
        "one-threat",
        "--solvers",
        "cgla,rrt-star:iterations=50",
        "--resolution",
        "5",
        "--seeds",
        "3",
        "--workers",
        "0",
    ]
    code = (
        "import sys\nfrom cgla_graph.comparisons.cli.app import app\n"
        f"app({words}, standalone_mode=False)\n"
        "print('scipy.stats' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout.splitlines()[-1] == "False"

"""Speed of studies: what isolating a call costs, and what a second worker brings."""

import hashlib
import itertools
import math
import os
import statistics
import time
from collections.abc import Callable

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from cgla_graph.comparisons.study.isolation import Call, isolated


def ends(function: Callable[..., object], args: tuple[object, ...], n_calls: int, workers: int) -> list[float]:
    """Make equal calls; return when each ended, in seconds."""
    calls = (Call(number, function, args) for number in range(n_calls))
    found = isolated(lambda: next(calls, None), workers=workers, seconds=60.0)
    return [time.perf_counter() for _, outcome in found if outcome.failure is None]


@pytest.mark.parametrize("workers", [1, 2])
def test_a_trivial_call(benchmark: BenchmarkFixture, workers: int) -> None:
    """A call that does nothing costs less than a millisecond (median of 1000)."""
    times = ends(math.sqrt, (2.0,), 1000, workers)
    assert len(times) == 1000
    took = statistics.median(now - before for before, now in itertools.pairwise(times))
    print(f"\nisolated call, {workers} workers: {took * 1e3:.2f} ms")
    benchmark.extra_info["ms"] = round(took * 1e3, 2)
    benchmark.pedantic(ends, (math.sqrt, (2.0,), 200, workers), rounds=1)
    assert took < 1e-3


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core")
def test_two_workers(benchmark: BenchmarkFixture) -> None:
    """Two workers make equal calls at least 1.8 times as fast as one, once they have started."""
    work = (hashlib.pbkdf2_hmac, ("sha256", b"word", b"salt", 150_000))
    ratios = []
    for _ in range(3):
        one, two = (ends(*work, n_calls=40, workers=workers)[4:] for workers in (1, 2))
        ratios.append((one[-1] - one[0]) / (two[-1] - two[0]))
    ratio = statistics.median(ratios)
    print(f"\ntwo workers: {ratio:.2f} times as fast as one")
    benchmark.extra_info["times faster"] = round(ratio, 2)
    benchmark.pedantic(ends, (*work, 20, 2), rounds=1)
    assert ratio >= 1.8

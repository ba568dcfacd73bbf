"""Speed of studies: what isolating a call costs, and what a second worker brings."""

import hashlib
import itertools
import math
import os
import statistics
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.execution import run_study
from cgla_graph.comparisons.study.runner import compare
from cgla_graph.comparisons.study.store import StudyStore
from cgla_graph.comparisons.study.study import Study
from cgla_graph.comparisons.workers.pool import Call, isolated
from cgla_graph.scenarios.random_map import random_scenario


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


def gaps(runs: Iterable[object]) -> list[float]:
    """Return the time from one run to the next, seconds."""
    times = [time.perf_counter() for _ in runs]
    return [now - before for before, now in itertools.pairwise(times)]


@pytest.mark.parametrize("workers", [1, 2])
def test_a_trivial_run_of_a_study(benchmark: BenchmarkFixture, tmp_path: Path, workers: int) -> None:
    """Isolation and the database cost less than 5 ms a run (median of 1000) on top of a plain loop."""
    scenarios = [random_scenario(seed) for seed in range(50)]
    entrants = [Entrant(f"straight-{number}", "straight-line") for number in range(20)]
    study = Study(scenarios, entrants, tolerance=None)
    loop = gaps(compare(scenarios, entrants, 1, tolerance=None))
    with StudyStore.create(tmp_path, study) as store:
        ours = benchmark.pedantic(lambda: gaps(run_study(study, store=store, workers=workers)), rounds=1, iterations=1)
    assert len(ours) == len(loop) == 999
    overhead = statistics.median(ours) - statistics.median(loop)
    mean = (sum(ours) - sum(loop)) / len(ours)
    print(f"\nper run, {workers} workers: {overhead * 1e3:.2f} ms more than a loop (mean {mean * 1e3:.2f} ms)")
    benchmark.extra_info["ms"] = round(overhead * 1e3, 2)
    assert overhead < 5e-3


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core")
def test_two_workers_on_equal_runs(benchmark: BenchmarkFixture, tmp_path: Path) -> None:
    """Two workers make equal runs at least 1.8 times as fast as one, once they have started."""
    study = Study([random_scenario(1)], [Entrant.parse("prm-star:milestones=600")], range(1, 61), tolerance=None)

    def took(workers: int, folder: Path) -> float:
        folder.mkdir()
        with StudyStore.create(folder, study) as store:
            return sum(gaps(run_study(study, store=store, workers=workers))[8:])

    ratios = [took(1, tmp_path / f"one{n}") / took(2, tmp_path / f"two{n}") for n in range(2)]
    ratios.append(took(1, tmp_path / "one") / benchmark.pedantic(took, args=(2, tmp_path / "two"), rounds=1))
    ratio = statistics.median(ratios)
    print(f"\nstudy with two workers: {ratio:.2f} times as fast as with one")
    benchmark.extra_info["times faster"] = round(ratio, 2)
    assert ratio >= 1.8

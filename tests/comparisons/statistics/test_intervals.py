"""Statistics over seeds: exact against enumeration and simulation, and failures that count as infinite."""

import itertools
import math
import statistics
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from studies_small import named, proof_of

from cgla_graph.comparisons.leaderboard.performance import PERFORMANCE_COLUMNS, TARGETS, performances
from cgla_graph.comparisons.statistics.intervals import (
    CONFIDENCE,
    FEWEST_RUNS,
    estimate,
    interval_ranks,
    median_curve,
    median_interval,
    progress,
    success_interval,
    to_target,
)
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Solution, Status, TracePoint

SCENARIO = named("one")
NEVER = (math.inf, math.inf)

values = st.floats(0.0, 10.0) | st.just(math.inf)


def solution_of(
    cost: float = 1.0,
    trace: Sequence[tuple[float, int, float]] = (),
    status: Status = Status.FOUND,
    **more: Any,  # noqa: ANN401 - any field of a solution
) -> Solution:
    points = tuple(TracePoint(*point) for point in trace)
    return Solution(status, **{"cost": cost, "seconds": 1.0, "evaluations": 100, "trace": points, **more})


@st.composite
def solutions(draw: st.DrawFn, *, found: bool | None = None) -> Solution:
    """Draw answers of anytime solvers, with equal moments and costs among them, and some without a path."""
    if not (draw(st.booleans()) if found is None else found):
        return solution_of(math.inf, [(0.5, 1, math.inf)], draw(st.sampled_from([Status.NOT_FOUND, Status.FAILED])))
    n = draw(st.integers(0, 5))
    seconds = sorted(draw(st.lists(st.integers(0, 8), min_size=n, max_size=n)))
    costs = sorted(draw(st.lists(st.integers(2, 9), min_size=n, max_size=n)), reverse=True)
    trace = [(float(s), 10 * s, float(c)) for s, c in zip(seconds, costs, strict=True)]
    unfound = [(0.0, 0, math.inf)] if draw(st.booleans()) else []
    end = draw(st.integers(seconds[-1] if seconds else 0, 9))
    cost = float(draw(st.integers(1, costs[-1]))) if costs else 3.0
    build = draw(st.sampled_from([0.0, 2.0]))
    return solution_of(cost, [*unfound, *trace], seconds=float(end), evaluations=10 * end, build_seconds=build)


# Ranks: the exact binomial sum


def outside(n: int, low: int, high: int) -> Fraction:
    """Return the probability that no more than `high - 1`, or less than `low`, of `n` fair coins show heads."""
    inside = sum(math.comb(n, i) for i in range(low, high))
    return 1 - Fraction(inside, 2**n)


@given(n=st.integers(0, 300))
def test_ranks_are_the_narrowest_that_have_the_confidence(n: int) -> None:
    allowed = 1 - Fraction(CONFIDENCE)
    ranks = interval_ranks(n)
    assert (ranks is None) == (n < FEWEST_RUNS)
    low, high = ranks or (0, n + 1)
    assert low + high == n + 1
    assert outside(n, low, high) <= allowed
    assert low + 1 > high - 1 or outside(n, low + 1, high - 1) > allowed


@pytest.mark.parametrize("n", [6, 9, 20, 301])
def test_the_interval_is_that_of_scipy(n: int) -> None:
    sample = np.random.default_rng(n).normal(size=n)
    low, high = scipy.stats.quantile_test(sample, p=0.5).confidence_interval(CONFIDENCE)
    assert median_interval(sample.tolist()) == (low, high)


# Intervals of medians


@pytest.mark.parametrize("n", [1, 5, 6, 7, 9, 12])
def test_the_interval_covers_the_median_in_enough_of_all_samples(n: int) -> None:
    # of a coin's -1 and 1, 0 is a median
    ends = [median_interval(sample) for sample in itertools.product((-1.0, 1.0), repeat=n)]
    covered = Fraction(sum(low <= 0.0 <= high for low, high in ends), 2**n)
    ranks = interval_ranks(n)
    assert covered == (1 if ranks is None else 1 - outside(n, *ranks)) >= Fraction(CONFIDENCE)


@given(sample=st.lists(values, min_size=1, max_size=40), data=st.data())
def test_an_interval_is_two_of_the_values_and_knows_no_order(sample: list[float], data: st.DataObject) -> None:
    low, high = median_interval(sample)
    if len(sample) < FEWEST_RUNS:
        assert (low, high) == (-math.inf, math.inf)
    else:
        assert {low, high} <= set(sample)
    assert low <= estimate(sample).median <= high
    assert median_interval(data.draw(st.permutations(sample))) == (low, high)


@given(sample=st.lists(values, min_size=1, max_size=20))
def test_a_median_is_the_lower_middle_value(sample: list[float]) -> None:
    found = estimate(sample)
    assert found.median == statistics.median_low(sample)
    assert sum(value <= found.median for value in sample) * 2 >= len(sample)
    assert sum(value >= found.median for value in sample) * 2 >= len(sample)


def test_what_is_unknown_stays_unknown() -> None:
    assert all(math.isnan(part) for part in estimate([1.0, math.nan, 2.0]))


# Rates of success


@pytest.mark.parametrize("n", [1, 2, 10, 37])
def test_rates_are_those_of_scipy(n: int) -> None:
    for successes in range(n + 1):
        reference = scipy.stats.binomtest(successes, n).proportion_ci(CONFIDENCE, "exact")
        assert success_interval(successes, n) == pytest.approx((reference.low, reference.high), abs=1e-12)


@pytest.mark.parametrize(("successes", "n"), [(-1, 3), (4, 3), (0, 0)])
def test_rates_of_nonsense(successes: int, n: int) -> None:
    with pytest.raises(ValueError, match="at least one run"):
        success_interval(successes, n)


# Time to a target


def slow_hit(solution: Solution, target: float) -> tuple[float, float]:
    """Walk through the trace: the definition."""
    if not solution.status.has_path:
        return NEVER
    for point in solution.trace:
        if point.cost <= target and math.isfinite(point.cost):
            return point.seconds + solution.build_seconds, point.evaluations
    if solution.cost <= target:
        return solution.seconds + solution.build_seconds, solution.evaluations
    return NEVER


@given(solution=solutions(), target=st.integers(0, 10).map(float) | st.just(math.inf))
def test_hits_are_those_of_the_definition(solution: Solution, target: float) -> None:
    assert to_target(solution, target) == slow_hit(solution, target)


@pytest.mark.parametrize("status", [status for status in Status if not status.has_path])
def test_a_path_that_may_not_be_flown_never_gets_there(status: Status) -> None:
    assert to_target(solution_of(1.0, [(0.1, 1, 1.0)], status)) == NEVER


def test_an_unknown_target_is_no_failure() -> None:
    assert all(math.isnan(part) for part in to_target(solution_of(), math.nan))
    assert all(math.isnan(part) for part in to_target(solution_of(status=Status.NOT_FOUND), math.nan))


def test_a_trace_cannot_undercut_the_path_that_it_led_to() -> None:
    boaster = solution_of(2.0, [(0.1, 1, 0.5)])
    assert to_target(boaster, 1.0) == NEVER
    assert to_target(boaster, 2.0) == (0.1, 1)


def test_a_target_is_hit_up_to_rounding() -> None:
    assert to_target(solution_of(1.1), 1.1 * (1.0 - 1e-15)) == (1.0, 100)
    assert to_target(solution_of(1.1), 1.1 * (1.0 - 1e-9)) == NEVER


@given(solution=solutions(found=True))
def test_progress_falls_and_ends_at_the_cost(solution: Solution) -> None:
    seconds, _, costs = progress(solution).T
    assert (np.diff(seconds) >= 0.0).all()
    assert (np.diff(costs) <= 0.0).all()
    assert costs[-1] == solution.cost
    assert seconds[-1] == solution.seconds + solution.build_seconds


# Curves


@given(runs=st.lists(solutions(), min_size=1, max_size=9))
def test_a_curve_is_the_median_at_every_moment(runs: list[Solution]) -> None:
    curve = median_curve(runs)
    ranks = interval_ranks(len(runs))
    assert curve.is_interval == (ranks is not None)
    low, high = ranks or (1, len(runs))
    for i, second in enumerate(curve.seconds):
        so_far = []
        for run in runs:
            steps = [cost for when, _, cost in progress(run).tolist() if when <= second]
            so_far.append(min(steps, default=math.inf))
        so_far.sort()
        assert curve.median[i] == statistics.median_low(so_far)
        assert (curve.low[i], curve.high[i]) == (so_far[low - 1], so_far[high - 1])


# What one solver does


def runs_of(answers: Sequence[Solution], bound: float = math.nan, solver: str = "own") -> list[Run]:
    return [
        Run(SCENARIO, solver, seed, exact=False, solution=answer, certificate=proof_of(bound))
        for seed, answer in enumerate(answers, 1)
    ]


@given(answers=st.lists(solutions(), min_size=1, max_size=9), bound=st.sampled_from([math.nan, 1.0, 3.0]))
def test_performance_is_made_of_the_medians(answers: list[Solution], bound: float) -> None:
    (one,) = performances(runs_of(answers, bound))
    found = [answer for answer in answers if answer.status.has_path]
    assert (one.n_runs, one.n_paths) == (len(answers), len(found))
    assert one.cost.median == statistics.median_low(
        [answer.cost if answer.status.has_path else math.inf for answer in answers]
    )
    targets = [math.inf, 1.1 * bound, 1.05 * bound, 1.01 * bound]
    for target, seconds, evaluations in zip(targets, one.seconds, one.evaluations, strict=True):
        if math.isnan(target):
            assert math.isnan(seconds.median)
            continue
        hits = [to_target(answer, target) for answer in answers]
        assert seconds.median == statistics.median_low([hit.seconds for hit in hits])
        assert evaluations.median == statistics.median_low([hit.evaluations for hit in hits])


def test_one_lucky_run_does_not_speak_for_those_that_failed() -> None:
    lucky = solution_of(1.0, [(0.001, 1, 1.0)])
    (one,) = performances(runs_of([lucky, *[solution_of(math.inf, status=Status.NOT_FOUND)] * 99], 1.0))
    assert one.cost.median == one.seconds[0].median == one.evaluations[3].median == math.inf
    assert one.success.high < 0.06


def test_a_cheap_path_that_may_not_be_flown_counts_as_infinite() -> None:
    bad = [solution_of(0.5, [(0.1, 1, 0.5)], Status.INFEASIBLE)] * 2
    (one,) = performances(runs_of([*bad, solution_of(2.0)], 1.0))
    assert (one.n_paths, one.cost.median, one.seconds[0].median) == (1, math.inf, math.inf)


@pytest.mark.parametrize(("number", "percent"), list(enumerate((10, 5, 1), 1)))
def test_targets_are_these_percents_above_the_bound(number: int, percent: int) -> None:
    for beyond, reached in ((-1e-9, True), (1e-9, False)):
        cost = 2.0 * (1.0 + percent / 100.0 + beyond)
        (one,) = performances(runs_of([solution_of(cost)], 2.0))
        assert math.isfinite(one.seconds[number].median) == reached
        assert math.isfinite(one.evaluations[number].median) == reached


def test_a_document_has_the_columns_and_only_numbers_of_json() -> None:
    failed = [solution_of(math.inf, status=Status.NOT_FOUND)] * 4
    (one,) = performances(runs_of([solution_of(), *failed], 1.0))
    document = one.document()
    assert tuple(document) == PERFORMANCE_COLUMNS
    assert (document["runs"], document["paths"], document["success"], document["lower_bound"]) == (5, 1, 0.2, 1.0)
    assert all(document[f"seconds_to_{target}"] is None for target in TARGETS)
    (one,) = performances(runs_of([solution_of(1.04)] * 6, 1.0))
    document = one.document()
    assert document["cost"] == document["cost_low"] == document["cost_high"] == 1.04
    assert (document["seconds_to_5_percent"], document["evaluations_to_5_percent_high"]) == (1.0, 100)
    assert document["seconds_to_1_percent_low"] is document["evaluations_to_1_percent"] is None


def test_solvers_are_measured_apart() -> None:
    runs = [*runs_of([solution_of(2.0)], 1.0, "b"), *runs_of([solution_of(1.0)] * 2, 1.0, "a")]
    assert [(one.solver, one.n_runs, one.cost.median) for one in performances(runs)] == [("b", 1, 2.0), ("a", 2, 1.0)]

"""Profiles: by their definitions, with bands that hold whole curves, and failures that never count as answers."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from strategies import costs
from studies_small import named, proof_of

from cgla_graph.comparisons.leaderboard.profiles import (
    finite_bound,
    instance_costs,
    instance_times,
    performance_profile,
    shared_scenarios,
    success_curve,
)
from cgla_graph.comparisons.statistics.intervals import path_cost
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.scenario import Scenario

SCENARIOS = [named(f"map {i}") for i in range(4)]
moments = st.integers(1, 9).map(float) | st.just(math.inf)


def found(
    cost: float = 1.0, *, seconds: float = 1.0, build_seconds: float = 0.0, trace: Sequence[tuple[float, float]] = ()
) -> Solution:
    points = tuple(TracePoint(moment, 1, value) for moment, value in trace)
    return Solution(Status.FOUND, cost=cost, seconds=seconds, build_seconds=build_seconds, trace=points)


def answer(moment: float) -> Solution:
    """Find a path at that moment, or never."""
    return found(seconds=moment) if moment < math.inf else Solution(Status.NOT_FOUND, seconds=10.0)


def run_of(
    scenario: Scenario, solver: str, solution: Solution, seed: int | None = None, bound: float = math.nan
) -> Run:
    return Run(scenario, solver, seed, exact=False, solution=solution, certificate=proof_of(bound))


def value(at: np.ndarray, share: np.ndarray, where: float) -> float:
    """Evaluate a step function."""
    return max(share[at <= where].tolist(), default=0.0)


# Success over time


@given(times=st.lists(moments, min_size=1, max_size=20), moment=st.floats(0.0, 10.0))
def test_the_rate_is_the_share_of_runs_with_a_path(times: list[float], moment: float) -> None:
    curve = success_curve([answer(time) for time in times])
    rate = value(curve.seconds, curve.rate, moment)
    assert rate == pytest.approx(sum(time <= moment for time in times) / len(times))
    assert (np.diff(curve.seconds) > 0.0).all()
    assert ((curve.low >= 0.0) & (curve.low < curve.rate) & (curve.rate <= curve.high) & (curve.high <= 1.0)).all()


def holds_all_over(n: int, runs: int, reach: float) -> float:
    """Say how often the band holds the whole true curve: times are uniform, and a share of runs finds no path."""
    rng = np.random.default_rng(n)
    inside = 0
    for _ in range(runs):
        times = rng.random(n) / reach
        curve = success_curve([answer(time if time < 1.0 else math.inf) for time in times.tolist()])
        truth = curve.seconds * reach
        high = np.concatenate([[min(1.0, stats.kstwo.ppf(0.95, n))], curve.high])
        # the truth is greatest at the end of a step, and least at its beginning
        inside += bool((truth >= curve.low - 1e-12).all() and (np.append(truth, reach) <= high + 1e-12).all())
    return inside / runs


@pytest.mark.slow
@pytest.mark.parametrize(("n", "reach"), [(3, 0.5), (10, 0.6), (10, 1.0), (40, 0.8)])
def test_the_band_holds_the_whole_curve(n: int, reach: float) -> None:
    runs = 500
    assert holds_all_over(n, runs, reach) > 0.95 - 3.0 * math.sqrt(0.95 * 0.05 / runs)


def test_building_counts_and_a_trace_says_when() -> None:
    curve = success_curve([found(2.0, seconds=5.0, build_seconds=1.0, trace=[(0.5, math.inf), (2.0, 3.0)])])
    assert (curve.seconds.tolist(), curve.rate.tolist()) == ([3.0], [1.0])


def test_nobody_finds_a_path() -> None:
    curve = success_curve([answer(math.inf)] * 10)
    assert len(curve.seconds) == 0
    with pytest.raises(ValueError, match="at least one"):
        success_curve([])


# Performance profiles


@st.composite
def tables(draw: st.DrawFn) -> dict[str, list[float]]:
    n = draw(st.integers(1, 8))
    return {f"s{i}": draw(st.lists(costs, min_size=n, max_size=n)) for i in range(draw(st.integers(1, 4)))}


@given(table=tables(), factor=st.sampled_from([1.0, 1.5, 2.0, 10.0, 1e9]))
def test_a_profile_is_that_of_the_definition(table: dict[str, list[float]], factor: float) -> None:
    best = [min(column) for column in zip(*table.values(), strict=True)]
    for solver, profile in performance_profile(table).items():
        # a hair more, as a quotient is rounded
        near = [
            cost < math.inf and cost <= factor * least * (1 + 1e-12)
            for cost, least in zip(table[solver], best, strict=True)
        ]
        assert value(*profile, factor * (1 + 1e-12)) == pytest.approx(sum(near) / len(best))
        assert value(*profile, 0.999) == 0.0


def test_profiles_at_the_edge() -> None:
    profiles = performance_profile({"a": [0.0, math.inf, 1.0, -2.0], "b": [0.0, math.inf, 1.0 + 5e-10, -1.0]})
    assert [(value(*one, 1.0), value(*one, 1e300)) for one in profiles.values()] == [(0.75, 0.75), (0.5, 0.5)]
    assert performance_profile({}) == {}
    assert value(*performance_profile({"a": []})["a"], 2.0) == 0.0
    with pytest.raises(ValueError, match="is nan"):
        performance_profile({"a": [math.nan]})


# One number an instance


def test_a_cost_is_the_lower_median_of_the_seeds_with_failures() -> None:
    one, two = SCENARIOS[:2]
    runs = [
        *(run_of(one, "a", found(cost), seed) for seed, cost in enumerate([3.0, 1.0, 2.0, 9.0])),
        *(
            run_of(one, "b", solution, seed)
            for seed, solution in enumerate([found(1.0), answer(math.inf), answer(math.inf)])
        ),
        run_of(two, "a", Solution(Status.INFEASIBLE, cost=0.1)),
        run_of(two, "b", found(4.0)),
    ]
    assert instance_costs(runs) == {"a": [2.0, math.inf], "b": [math.inf, 4.0]}


def test_what_somebody_has_yet_to_run_is_no_failure() -> None:
    runs = [run_of(scenario, "a", found(1.0 + i)) for i, scenario in enumerate(SCENARIOS)]
    runs += [run_of(SCENARIOS[2], "b", answer(math.inf))]
    assert instance_costs(runs) == {"a": [3.0], "b": [math.inf]}
    assert [list(group) for group in shared_scenarios(runs)] == [["a", "b"]]
    assert instance_costs([*runs[:2], *runs[4:]]) == {"a": [], "b": []}
    assert instance_costs([]) == instance_times([], 5.0) == {}


def test_scenarios_of_the_same_name_stay_apart() -> None:
    twin = named(SCENARIOS[0].name)
    assert instance_costs([run_of(SCENARIOS[0], "a", found(1.0)), run_of(twin, "a", found(2.0))]) == {"a": [1.0, 2.0]}


def test_times_are_those_until_near_the_bound() -> None:
    slow = found(1.0, seconds=9.0, trace=[(1.0, 2.0), (4.0, 1.04)])
    runs = [
        *(run_of(SCENARIOS[0], "a", slow, seed, bound=1.0) for seed in range(2)),
        run_of(SCENARIOS[0], "a", answer(math.inf), 2, bound=1.0),
        run_of(SCENARIOS[1], "a", found(2.0), bound=1.0),
        run_of(SCENARIOS[2], "a", found(2.0)),
        run_of(SCENARIOS[3], "a", Solution(Status.NO_PATH), bound=math.inf),
    ]
    assert instance_times(runs, 5.0) == {"a": [4.0, math.inf]}
    assert instance_times(runs, 1.0) == {"a": [9.0, math.inf]}
    # of two middle times it is the shorter one
    assert instance_times(runs[1:], 5.0) == {"a": [4.0, math.inf]}


@pytest.mark.parametrize(
    ("bound", "usable"), [(0.0, True), (2.0, True), (-1.0, False), (math.inf, False), (math.nan, False)]
)
def test_bounds_to_measure_from(bound: float, usable: bool) -> None:
    assert math.isfinite(finite_bound({"a": [run_of(SCENARIOS[0], "a", found(3.0), bound=bound)]})) == usable


@pytest.mark.parametrize("status", Status)
def test_only_paths_that_may_be_flown_have_a_cost(status: Status) -> None:
    assert path_cost(Solution(status, cost=2.0)) == (2.0 if status.has_path else math.inf)

"""Rows and summaries: what runs become, and that it is strict JSON."""

import json
import math
import statistics
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from studies_small import TEXT, named, proof_of

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.rows import (
    COLUMNS,
    best_exact,
    by_scenario,
    excess_over,
    median_run,
    row,
    rows_of,
    scenario_bound,
    summaries,
    trace_row,
)
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.scenario import Scenario, scenario_from_toml

LINE = np.array([(0.1, 0.1), (0.9, 0.9)])
SCENARIO = named("one")

anything = st.floats(allow_nan=True, allow_infinity=True)
words = st.text(max_size=20)


def run_of(
    cost: float = 1.0,
    *,
    solver: str = "cgla",
    status: Status = Status.FOUND,
    exact: bool = False,
    scenario: Scenario = SCENARIO,
    certificate: Certificate | None = None,
    **more: Any,  # noqa: ANN401 - any field of a solution
) -> Run:
    path = LINE if status.has_path else np.empty((0, 2))
    return Run(scenario, solver, None, exact, Solution(status, **{"path": path, "cost": cost, **more}), certificate)


def strict(document: object) -> Any:  # noqa: ANN401 - any JSON
    """Write and read JSON that knows neither NaN nor Infinity."""
    return json.loads(json.dumps(document, allow_nan=False), parse_constant=pytest.fail)


def test_a_row_has_the_columns_of_the_files() -> None:
    (run,) = compare([SCENARIO], [Entrant.parse("cgla")], 1, tolerance=None)
    found = row(run, 1.0)
    assert tuple(found) == COLUMNS
    solution = run.solution
    assert (found["scenario"], found["solver"], found["seed"], found["status"]) == ("one", "cgla", None, "optimal")
    assert (found["cost"], found["length"], found["risk"]) == (solution.cost, solution.length, solution.risk)
    assert found["excess"] == pytest.approx(0.8 * math.sqrt(2.0) - 1.0)
    assert found["waypoints"] == len(solution.path)
    assert (found["clearance"], found["lower_bound"], found["gap"]) == (None, None, None)
    assert strict(found) == found


@given(
    numbers=st.tuples(*[anything] * 7),
    best=anything,
    status=st.sampled_from(Status),
    evaluations=st.integers(0, 2**60),
    message=words,
    label=words,
)
def test_every_row_is_strict_json(
    numbers: tuple[float, ...], best: float, status: Status, evaluations: int, message: str, label: str
) -> None:
    names = ("length", "risk", "clearance", "lower_bound", "seconds", "build_seconds")
    more = dict(zip(names, numbers[1:], strict=True))
    run = run_of(numbers[0], status=status, solver=label, message=message, evaluations=evaluations, **more)
    found = row(run, best)
    assert strict(found) == found
    assert (found["message"], found["solver"], found["status"]) == (message, label, status.label)
    assert found["cost"] == (numbers[0] if math.isfinite(numbers[0]) else None)


@pytest.mark.parametrize(
    "odd",
    [{"message": ValueError("x")}, *({"evaluations": n} for n in (np.int64(7), np.float32(7.0), math.nan, math.inf))],
)
def test_values_of_any_type_are_strict_json(odd: dict[str, Any]) -> None:
    strict(row(run_of(**odd)))


def test_no_path_at_all() -> None:
    assert row(run_of(status=Status.NO_PATH, path=None))["waypoints"] == 0


def test_rows_keep_the_order_of_the_runs() -> None:
    runs = [run_of(cost, solver=solver) for cost, solver in ((3.0, "b"), (1.0, "a"), (2.0, "c"))]
    assert [found["solver"] for found in rows_of(runs)] == ["b", "a", "c"]
    assert rows_of([]) == []


# The lattice optimum


def test_best_exact_is_the_least_of_the_exact_ones_with_a_path() -> None:
    runs = [
        run_of(3.0, exact=True, status=Status.OPTIMAL),
        run_of(2.0, exact=True),
        run_of(1.0, exact=False),
        run_of(0.5, exact=True, status=Status.INFEASIBLE),
        run_of(0.1, exact=True, status=Status.FAILED),
        run_of(math.inf, exact=True, status=Status.NO_PATH),
    ]
    assert best_exact(runs) == 2.0
    assert math.isnan(best_exact(runs[2:]))
    assert math.isnan(best_exact([]))


@given(costs=st.lists(st.floats(1e-6, 1e6), min_size=1, max_size=8))
def test_excess_is_relative_to_the_lattice_optimum(costs: Sequence[float]) -> None:
    found = rows_of([run_of(cost, exact=True) for cost in costs])
    assert min(line["excess"] for line in found) == 0.0
    for line, cost in zip(found, costs, strict=True):
        assert (1.0 + line["excess"]) * min(costs) == pytest.approx(cost)


def test_excess_without_an_optimum_is_no_number() -> None:
    assert math.isnan(excess_over(1.0, math.nan))
    assert row(run_of())["excess"] is None


# Gaps


@given(cost=st.floats(1.0, 1e6), bound=st.floats(1e-3, 1.0))
def test_the_gap_is_relative_to_the_lower_bound(cost: float, bound: float) -> None:
    found = row(run_of(cost, lower_bound=bound))
    assert found["lower_bound"] == bound
    assert (1.0 + found["gap"]) * bound == pytest.approx(cost)


@pytest.mark.parametrize("status", [status for status in Status if not status.has_path])
def test_only_a_path_that_may_be_flown_has_a_gap(status: Status) -> None:
    found = row(run_of(2.0, status=status, lower_bound=1.0))
    assert (found["lower_bound"], found["gap"]) == (1.0, None)
    assert math.isnan(summaries([run_of(2.0, status=status, lower_bound=1.0)])[0].gap)


def test_the_bound_of_a_scenario_is_the_certificates_before_any_solvers() -> None:
    own = run_of(2.0, lower_bound=1.7)
    assert scenario_bound([own, run_of(2.0, certificate=proof_of(1.5))]) == 1.5
    assert scenario_bound([own, run_of(2.0, certificate=Certificate(math.nan, math.inf, 0.01, 0.1, 1, "", 0.1))]) == 1.7
    assert scenario_bound([own, run_of(3.0, lower_bound=1.2)]) == 1.7
    assert math.isnan(scenario_bound([run_of(2.0), run_of(2.0, status=Status.FAILED, lower_bound=1.0)]))
    assert math.isnan(scenario_bound([]))


# Traces


def test_a_trace_is_strict_json() -> None:
    trace = (TracePoint(0.1, np.int64(3), math.inf), TracePoint(0.2, 5, 2.0))  # type: ignore[arg-type]
    found = trace_row(run_of(2.0, trace=trace, build_seconds=0.5))
    assert strict(found) == found
    assert (found["scenario"], found["solver"], found["seed"], found["build_seconds"]) == ("one", "cgla", None, 0.5)
    assert (found["seconds"], found["evaluations"], found["cost"]) == ([0.1, 0.2], [3, 5], [None, 2.0])


# Scenarios


def test_runs_are_grouped_in_order() -> None:
    first, second = named("b"), named("a")
    runs = [run_of(1.0, scenario=first), run_of(2.0, scenario=second), run_of(3.0, scenario=first)]
    groups = by_scenario(runs)
    assert [[run.solution.cost for run in group] for group in groups] == [[1.0, 3.0], [2.0]]


def test_scenarios_of_one_name_stay_apart() -> None:
    near, far = SCENARIO, scenario_from_toml(TEXT.replace("0.9, 0.9", "1.0, 1.0"), "one")
    runs = [run_of(1.0, exact=True, scenario=near), run_of(2.0, exact=True, scenario=far)]
    assert [line["excess"] for line in rows_of(runs)] == [0.0, 0.0]
    assert len(by_scenario(runs)) == 2


# Summaries


def test_a_summary_is_the_median_over_the_seeds() -> None:
    costs = (3.0, 1.0, 2.0)
    more = [{"length": cost / 2, "seconds": cost, "evaluations": int(10 * cost)} for cost in costs]
    runs = [run_of(cost, solver="rrt", **one) for cost, one in zip(costs, more, strict=True)]
    (found,) = summaries([*runs, run_of(1.0, solver="cgla", exact=True)])[1:]
    assert (found.solver, found.status, found.cost, found.length) == ("rrt", "found", 2.0, 1.0)
    assert (found.seconds, found.evaluations) == (2.0, 20)
    assert found.spread == pytest.approx(2.0)
    assert found.excess == pytest.approx(1.0)


@given(costs=st.lists(st.floats(1.0, 10.0), min_size=1, max_size=6))
def test_a_line_shows_the_numbers_of_the_median_run(costs: list[float]) -> None:
    numbers = ("cost", "length", "risk", "clearance", "seconds", "build_seconds", "evaluations")
    runs = [
        run_of(cost, **{name: 7 * n + place for place, name in enumerate(numbers[1:])}) for n, cost in enumerate(costs)
    ]
    (found,), median = summaries(runs), median_run(runs).solution
    assert [getattr(found, name) for name in numbers] == [getattr(median, name) for name in numbers]


@given(costs=st.lists(st.sampled_from([1.0, 2.0, 3.0, math.inf]), min_size=1, max_size=7))
def test_the_median_run_is_the_lower_middle_one(costs: list[float]) -> None:
    runs = [run_of(cost, status=Status.FOUND if cost < math.inf else Status.NOT_FOUND) for cost in costs]
    found = median_run(runs)
    assert any(found is run for run in runs)
    assert found.solution.cost == statistics.median_low(costs)


def test_of_failures_an_infeasible_path_stands_before_none() -> None:
    statuses = [Status.TIMED_OUT, Status.INFEASIBLE, Status.FOUND]
    runs = [run_of(5.0 - number, status=status) for number, status in enumerate(statuses)]
    assert median_run(runs).solution.status is Status.INFEASIBLE
    assert median_run(runs[:2]).solution.status is Status.INFEASIBLE
    assert median_run([*runs, runs[0], runs[0]]).solution.status is Status.TIMED_OUT
    # a path that may not be flown is no path, however cheap
    assert [(one.status, one.cost) for one in summaries(runs)] == [("found 1/3", math.inf)]


def test_a_single_run_has_no_spread() -> None:
    (found,) = summaries([run_of(2.0)])
    assert math.isnan(found.spread)
    assert math.isnan(found.excess)


def test_runs_without_a_path_count_as_infinitely_costly() -> None:
    runs = [run_of(1.0), *[run_of(math.inf, status=Status.NOT_FOUND, message="none") for _ in range(2)]]
    (found,) = summaries(runs)
    assert (found.status, found.cost, found.message) == ("found 1/3", math.inf, "none")
    (found,) = summaries([*runs, run_of(2.0), run_of(3.0)])
    assert (found.status, found.cost) == ("found 3/5", 3.0)


@given(costs=st.lists(st.floats(1.0, 9.0), min_size=1, max_size=6, unique=True))
def test_the_least_gap_comes_first(costs: list[float]) -> None:
    runs = [run_of(cost, solver=str(cost), lower_bound=1.0) for cost in costs]
    gaps = [found.gap for found in summaries(runs)]
    assert gaps == pytest.approx(sorted(gaps), abs=1e-9)
    assert len(gaps) == len(costs)


@pytest.mark.parametrize(
    "ordered",
    [
        [run_of(2.0, solver="proven", lower_bound=1.9), run_of(1.9, solver="cheap", lower_bound=1.0)],
        # where a gap is not known, the cost decides
        [run_of(1.0, solver="cheap"), run_of(2.0, solver="bounded", lower_bound=1.0)],
        [
            *(run_of(cost, solver=str(cost)) for cost in (1.0, 2.0)),
            run_of(0.5, solver="wall", status=Status.INFEASIBLE),
            run_of(math.inf, solver="none", status=Status.NO_PATH),
        ],
    ],
)
def test_the_least_gap_or_cost_comes_first_and_no_path_last(ordered: list[Run]) -> None:
    assert [found.solver for found in summaries(ordered[::-1])] == [run.solver for run in ordered]


@pytest.mark.parametrize("bound", [1.0, math.nan])
def test_of_equal_gaps_the_one_that_took_less_time_comes_first(bound: float) -> None:
    third = 4.0 / 3.0
    runs = [
        run_of(third, solver="slow", seconds=0.1, build_seconds=2.0, lower_bound=bound),
        run_of(third * (1.0 + 3e-16), solver="quick", seconds=1.0, lower_bound=bound),
        run_of(1.3, solver="better", seconds=9.0, lower_bound=bound),
    ]
    assert [found.solver for found in summaries(runs)] == ["better", "quick", "slow"]


@given(costs=st.lists(st.floats(0.0, 1e9) | st.just(math.inf), min_size=1, max_size=6))
def test_any_runs_can_be_summarised(costs: list[float]) -> None:
    runs = [run_of(cost, status=Status.FOUND if math.isfinite(cost) else Status.NOT_FOUND) for cost in costs]
    (found,) = summaries(runs)
    assert min(costs) <= found.cost <= max(costs)
    assert math.isnan(found.spread) or found.spread >= 0.0
    assert summaries([]) == []


def test_a_path_that_may_not_be_flown_has_no_excess() -> None:
    runs = [run_of(2.0, solver="cgla", exact=True), run_of(1.0, solver="wall", status=Status.INFEASIBLE)]
    assert [line["excess"] for line in rows_of(runs)] == [0.0, None]
    assert math.isnan(summaries(runs)[-1].excess)

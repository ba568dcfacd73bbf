"""Budgets end runs cleanly and at their limits; a trace shows the path of every smaller budget."""

import math
import time
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from quick_solvers import WALLED_IN
from strategies import fast

import cgla_graph as cg
from cgla_graph._types import Point
from cgla_graph.errors import SolverSettingError
from cgla_graph.model.solution import Solution, Status
from cgla_graph.solvers import budget as budget_module
from cgla_graph.solvers import registry
from cgla_graph.solvers.budget import Budget, BudgetSpentError, Incumbent, Meter

COUNTED = {
    "rrt-star": "iterations",
    "informed-rrt-star": "iterations",
    "sorrt-star": "iterations",
    "bit-star": "iterations",
    "prm-star": "milestones",
    "fmt-star": "samples",
    "bfmt-star": "samples",
}
COUNTED = {name: setting for name, setting in COUNTED.items() if registry.missing(name) is None}
ANYTIME = [name for name in COUNTED if not name.endswith("fmt-star")]
THREATS = [cg.Threat(0.5, 0.5, 0.1, peak=0.9), cg.Threat(0.3, 0.7, 0.05)]
PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(THREATS), k=10.0, no_fly=shapely.box(0.6, 0.2, 0.7, 0.6))


def plan(name: str, problem: cg.Problem = PROBLEM, **settings: Any) -> Solution:  # noqa: ANN401 - each solver has its own
    return cg.solve(problem, name, **settings)


def unlimited(name: str) -> dict[str, Any]:
    """Lift the default limit, where a solver can do without."""
    return {COUNTED[name]: None} if name in ANYTIME else {}


# settings


@pytest.mark.parametrize("name", ANYTIME)
def test_a_run_without_any_limit_is_refused(name: str) -> None:
    with pytest.raises(SolverSettingError, match=rf"{name}: .*set {COUNTED[name]}, seconds or evaluations"):
        registry.get(name, **{COUNTED[name]: None})
    for limit in ({"seconds": 1}, {"seconds": 0.5}, {"evaluations": 1}):
        registry.get(name, **{COUNTED[name]: None}, **limit)


# the meter


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def perf_counter(self) -> float:
        return self.now


@given(
    iterations=st.none() | st.integers(1, 5),
    seconds=st.none() | st.integers(1, 5),
    evaluations=st.none() | st.integers(1, 5),
    steps=st.lists(st.sampled_from(["iteration", "second", "evaluation"]), max_size=20),
)
@fast
def test_the_limit_that_is_reached_first_ends_the_run(
    iterations: int | None, seconds: int | None, evaluations: int | None, steps: list[str]
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        clock = Clock()
        patch.setattr(budget_module, "time", clock)
        meter = Meter(Budget(iterations, seconds, evaluations), began=clock.perf_counter())
        for step in steps:
            over_time = seconds is not None and meter.seconds >= seconds
            over_count = evaluations is not None and meter.evaluations >= evaluations
            reached = over_time or over_count or (iterations is not None and meter.iterations >= iterations)
            assert bool(meter.spent) == reached
            if step == "second":
                clock.now += 1.0
            elif step == "iteration":
                meter.iterations += 1
            elif over_time or over_count:
                with pytest.raises(BudgetSpentError):
                    meter.charge()
            else:
                before = meter.evaluations
                meter.charge()
                assert meter.evaluations == before + 1
            if seconds is not None and meter.seconds >= seconds:
                with pytest.raises(BudgetSpentError, match=f"{seconds} s|iterations|evaluations"):
                    meter.check_time()
            else:
                meter.check_time()


# the incumbent


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), max_size=12))
@fast
def test_the_trace_is_the_running_minimum_of_the_oracle(middles: list[tuple[float, float]]) -> None:
    incumbent = Incumbent(PROBLEM, Budget(iterations=1).start())
    costs = []
    for middle in middles:
        path = [PROBLEM.start, middle, PROBLEM.goal]
        found = PROBLEM.evaluate(path)
        if found.feasible:
            incumbent.offer(path, found.cost * (1.0 + 1e-8))
            costs.append(found.cost)
    falls = [cost for i, cost in enumerate(costs) if cost < min(costs[:i], default=math.inf)]
    answer = incumbent.solution("nothing")
    assert [point.cost for point in answer.trace] == falls
    seconds = [point.seconds for point in answer.trace]
    assert seconds == sorted(seconds)
    if costs:
        # the claim is the solver's own, so that the judge has something to judge
        assert answer.cost == min(costs) * (1.0 + 1e-8)
        assert PROBLEM.evaluate(answer.path).cost == min(costs)
    else:
        assert (answer.status, answer.message) == (Status.NOT_FOUND, "nothing")


@pytest.mark.parametrize(
    ("path", "claim", "status"),
    [
        ([PROBLEM.start, (0.65, 0.4), PROBLEM.goal], None, Status.INFEASIBLE),
        ([PROBLEM.start, (0.2, 1.5), PROBLEM.goal], None, Status.INFEASIBLE),
        ([PROBLEM.start, (0.2, 0.9)], None, Status.FAILED),
        ([PROBLEM.start, (0.1, 0.9), PROBLEM.goal], 0.5, Status.FAILED),
        ([PROBLEM.start, (0.1, 0.9), PROBLEM.goal], math.nan, Status.FAILED),
        ([PROBLEM.start, (math.nan, 0.9), PROBLEM.goal], 1.0, Status.FAILED),
    ],
    ids=["crosses", "leaves", "stops short", "lies", "no number", "no point"],
)
def test_an_offer_that_does_not_stand_makes_the_run_fail(
    path: list[Point], claim: float | None, status: Status
) -> None:
    incumbent = Incumbent(PROBLEM, Budget(iterations=1).start())
    good = [PROBLEM.start, (0.1, 0.9), PROBLEM.goal]
    incumbent.offer(good, PROBLEM.evaluate(good).cost)
    incumbent.offer(path, PROBLEM.evaluate(path).cost if claim is None else claim)
    assert len(incumbent.trace) == 1
    assert PROBLEM.judge(incumbent.solution()).status is status


# the solvers


@pytest.mark.slow
@pytest.mark.parametrize("evaluations", [1, 30, 1000, 8000])
@pytest.mark.parametrize("name", COUNTED)
def test_evaluations_are_not_exceeded(name: str, evaluations: int) -> None:
    answer = plan(name, evaluations=evaluations, **unlimited(name))
    # PRM* joins its last milestone to all that it has
    slack = 200 if name == "prm-star" else 0
    assert answer.evaluations <= evaluations + slack
    assert answer.status in {Status.FOUND, Status.NOT_FOUND}
    if answer.status is Status.NOT_FOUND:
        assert f"{evaluations} evaluations" in answer.message
    if name in ANYTIME:
        assert answer.evaluations >= evaluations


@pytest.mark.parametrize("problem", [PROBLEM, WALLED_IN], ids=["open", "walled in"])
@pytest.mark.parametrize("seconds", [1e-9, 0.15])
@pytest.mark.parametrize("name", COUNTED)
def test_no_run_outlives_its_seconds(name: str, seconds: float, problem: cg.Problem) -> None:
    plan(name, evaluations=1, **unlimited(name))  # compiles and imports
    huge = unlimited(name) or {"samples": 100_000}
    began = time.perf_counter()
    answer = plan(name, problem, seconds=seconds, **huge)
    # without the limit they go on for longer than this, and a busy machine may take its time
    assert time.perf_counter() - began < 60.0
    if problem is WALLED_IN or seconds < 1e-6 or name not in ANYTIME:
        assert (answer.status, f"{seconds:g} s" in answer.message) == (Status.NOT_FOUND, True)
    else:
        assert answer.status is Status.FOUND
        assert all(0.0 < point.seconds < 60.0 for point in answer.trace)


@pytest.mark.parametrize("name", ANYTIME)
def test_a_trace_tells_what_a_smaller_budget_would_have_found(name: str) -> None:
    whole = plan(name, **unlimited(name), evaluations=2000 if name == "bit-star" else 20_000)
    costs = [point.cost for point in whole.trace]
    spent = [point.evaluations for point in whole.trace]
    assert len(costs) >= 3
    assert costs == sorted(set(costs), reverse=True)
    assert spent == sorted(spent)
    assert costs[-1] == pytest.approx(whole.cost, rel=1e-12)
    assert costs[-1] == PROBLEM.evaluate(whole.path).cost
    for i in {0, len(costs) // 2, len(costs) - 1}:
        part = plan(name, **unlimited(name), evaluations=spent[i])
        assert [point.cost for point in part.trace][: i + 1] == costs[: i + 1]
        assert part.cost == pytest.approx(costs[i], rel=1e-12)
    # one evaluation earlier, the first path was not there yet (PRM* does not search after every evaluation)
    if name != "prm-star" and spent[0] > 1:
        assert plan(name, **unlimited(name), evaluations=spent[0] - 1).status is Status.NOT_FOUND


@pytest.mark.slow
@pytest.mark.parametrize("name", ANYTIME)
def test_more_iterations_go_on_where_fewer_ended(name: str) -> None:
    few, many = (plan(name, **{COUNTED[name]: n}) for n in (512, 1024))
    assert [point.cost for point in many.trace][: len(few.trace)] == [point.cost for point in few.trace]
    assert many.cost <= few.cost
    assert np.array_equal(few.path, plan(name, **{COUNTED[name]: 512}).path)

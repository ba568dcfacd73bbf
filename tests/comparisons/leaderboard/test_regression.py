"""Regressions: pairing of runs, verdicts, and rates of error."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual
from studies_small import TEXT

from cgla_graph.comparisons.leaderboard.regression import Regression, RunKey, Verdict, regression, same_task
from cgla_graph.comparisons.statistics.paired import holm, mcnemar
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario, scenario_from_toml

THREAT = "[[threats]]\nx = 0.5\ny = 0.5\nspread = 0.1\npeak = {}\n"


def scenario_of(name: str, text: str = TEXT) -> Scenario:
    return scenario_from_toml(text, name)


SCENARIOS = [scenario_of(f"map {i}") for i in range(30)]


def run_of(
    scenario: Scenario,
    cost: float,
    solver: str = "a",
    seed: int | None = None,
    *,
    seconds: float = 1.0,
    settings: Mapping[str, Any] | None = None,
) -> Run:
    status = Status.FOUND if cost < math.inf else Status.CRASHED
    solution = Solution(status, cost=cost, seconds=seconds, build_seconds=0.5)
    return Run(scenario, solver, seed, exact=False, solution=solution, settings=settings or {})


def study(costs: Sequence[float], solver: str = "a", *, seconds: float = 1.0) -> list[Run]:
    """Run a solver once on as many scenarios, each read anew."""
    return [run_of(scenario_of(f"map {i}"), cost, solver, seconds=seconds) for i, cost in enumerate(costs)]


def verdict(old: Sequence[float], new: Sequence[float]) -> Verdict:
    (change,) = regression(study(old), study(new)).changes
    return change.verdict


def test_a_small_one_by_hand() -> None:
    old = study([1.0, 2.0, 4.0, math.inf, math.inf, 1.0])
    new = study([0.5, 2.0, 2.0, 3.0, math.inf, math.inf], seconds=2.5)
    found = regression(old, new)
    (change,) = found.changes
    cost = change.cost
    assert (change.solver, change.n, cost.wins, cost.losses, cost.ties) == ("a", 6, 3, 1, 2)
    assert (cost.only_solver, cost.only_reference, cost.p_success) == (1, 1, mcnemar(1, 1))
    # the logarithms are -ln 2 twice, 0 twice, minus and plus infinity: of 21 averages the middle one is -ln 2 / 2
    assert cost.ratio.median == pytest.approx(2.0**-0.5)
    assert change.verdict is Verdict.SAME
    # three pairs took twice as long, one got a path only now and one only before, one never
    assert (change.seconds.wins, change.seconds.losses, change.seconds.ties) == (1, 4, 1)
    assert (found.only_old, found.only_new, found.changed_scenarios) == ((), (), ())
    assert not change.settings_differ


@pytest.mark.parametrize(
    ("factor", "expected"),
    [
        (1.0, Verdict.IDENTICAL),
        (1.0 + 1e-13, Verdict.IDENTICAL),
        (1.0 + 1e-11, Verdict.SAME),
        (0.9, Verdict.BETTER),
        (1.1, Verdict.WORSE),
        (math.inf, Verdict.WORSE),
    ],
)
def test_verdicts(factor: float, expected: Verdict) -> None:
    old = [1.0 + i for i in range(12)]
    assert verdict(old, [factor * cost for cost in old]) is expected
    turned = {Verdict.BETTER: Verdict.WORSE, Verdict.WORSE: Verdict.BETTER}.get(expected, expected)
    assert verdict([factor * cost for cost in old], old) is turned


def test_a_few_pairs_show_nothing() -> None:
    assert verdict([1.0] * 5, [2.0] * 5) is Verdict.SAME
    assert verdict([1.0] * 6, [2.0] * 6) is Verdict.WORSE
    assert verdict([math.inf] * 6, [math.inf] * 6) is Verdict.IDENTICAL
    assert verdict([1.0], [math.inf]) is Verdict.SAME


def test_runs_without_a_pair_are_named() -> None:
    one, two, three = SCENARIOS[:3]
    old = [run_of(one, 1.0), run_of(two, 1.0), run_of(one, 1.0, "b", 1), run_of(one, 1.0, "b", 2)]
    new = [run_of(one, 1.0), run_of(three, 1.0), run_of(one, 1.0, "b", 2), run_of(one, 1.0, "c")]
    found = regression(old, new)
    assert [(change.solver, change.n) for change in found.changes] == [("a", 1), ("b", 1)]
    assert found.only_old == (RunKey("map 1", "a", None), RunKey("map 0", "b", 1))
    assert found.only_new == (RunKey("map 2", "a", None), RunKey("map 0", "c", None))


@pytest.mark.parametrize(
    "text",
    [
        TEXT.replace("5.0", "6.0"),
        TEXT.replace("0.9, 0.9", "0.9, 0.8"),
        TEXT + THREAT.format(0.5),
        TEXT.replace("resolution = 3", "resolution = 7"),
    ],
)
def test_a_scenario_that_changed_is_named_and_not_paired(text: str) -> None:
    old = [run_of(scenario_of("one"), 1.0), run_of(scenario_of("two"), 1.0)]
    new = [run_of(scenario_of("one", text), 2.0), run_of(scenario_of("two"), 1.0)]
    found = regression(old, new)
    assert found.changed_scenarios == ("one",)
    assert [(change.n, change.verdict) for change in found.changes] == [(1, Verdict.IDENTICAL)]
    assert (found.only_old, found.only_new) == ((), ())


def test_the_same_file_read_twice_is_the_same_task() -> None:
    text = TEXT + THREAT.format(0.5) + "[no_fly]\npolygons = [[[0.2, 0.3], [0.3, 0.3], [0.3, 0.4]]]\n"
    assert same_task(scenario_of("one", text)) == same_task(scenario_of("one", text))
    assert same_task(scenario_of("one", text)) != same_task(scenario_of("one", text.replace("0.4]", "0.41]")))


def test_runs_that_are_there_twice_are_refused() -> None:
    twice = [run_of(SCENARIOS[0], 1.0), run_of(SCENARIOS[0], 2.0)]
    with pytest.raises(ValueError, match="the new runs have two of 'a' on 'map 0' without a seed"):
        regression([], twice)
    with pytest.raises(ValueError, match="the old runs have two of 'a' on 'map 0' with seed 3"):
        regression([run_of(SCENARIOS[0], 1.0, seed=3) for _ in range(2)], [])


def test_other_settings_are_told() -> None:
    old = [run_of(SCENARIOS[0], 1.0, settings={"iterations": 5})]
    new = [run_of(SCENARIOS[0], 1.0, settings={"iterations": 6})]
    assert [change.settings_differ for change in regression(old, new).changes] == [True]
    assert [change.settings_differ for change in regression(old, old).changes] == [False]


def test_p_values_are_adjusted_to_all_solvers() -> None:
    rng = np.random.default_rng(4)
    old = [run for name in "abcd" for run in study(rng.random(12).tolist(), name)]
    new = [run for name in "abcd" for run in study(rng.random(12).tolist(), name, seconds=1.1)]
    found = regression(old, new).changes
    assert [change.cost.p_holm for change in found] == holm([change.cost.p for change in found])
    assert [change.seconds.p_holm for change in found] == holm([change.seconds.p for change in found])
    # a solver may be called as the reference is
    (change,) = regression(study([1.0], "old"), study([2.0], "old")).changes
    assert change.cost.ratio.median == pytest.approx(2.0)


def test_nothing_to_compare() -> None:
    assert regression([], []) == Regression((), (), (), ())


costs = st.lists(st.sampled_from([1.0, 1.5, 2.0, math.inf]), min_size=30, max_size=30)


@usual
@given(old=costs, new=costs, n=st.integers(1, 30), data=st.data())
def test_there_and_back(old: list[float], new: list[float], n: int, data: st.DataObject) -> None:
    before, after = ([run_of(*pair) for pair in zip(SCENARIOS, row[:n], strict=False)] for row in (old, new))
    (there,) = regression(before, after).changes
    (back,) = regression(after, before).changes
    assert (there.cost.wins, there.cost.effect) == (back.cost.losses, -back.cost.effect)
    assert there.cost.only_solver == back.cost.only_reference
    assert there.cost.p == back.cost.p
    turned = {Verdict.BETTER: Verdict.WORSE, Verdict.WORSE: Verdict.BETTER}
    assert back.verdict is turned.get(there.verdict, there.verdict)
    # in any order of the runs
    assert regression(data.draw(st.permutations(before)), after).changes == (there,)
    # no unit of cost matters
    scaled = [
        [
            dataclasses.replace(run, solution=dataclasses.replace(run.solution, cost=8.0 * run.solution.cost))
            for run in runs
        ]
        for runs in (before, after)
    ]
    assert regression(*scaled).changes == (there,)

"""Leaderboards: who wins, by how much, how sure, where each fails; small ones by hand, large ones by what must hold."""

import dataclasses
import math
from collections.abc import Sequence

import pytest
from all_pairs import all_pairs
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual
from studies_small import named, proof_of

from cgla_graph.comparisons.leaderboard.leaderboard import LeaderboardRow, leaderboard_of
from cgla_graph.comparisons.leaderboard.profiles import instance_costs
from cgla_graph.comparisons.statistics.intervals import Estimate, success_interval
from cgla_graph.comparisons.statistics.paired import against
from cgla_graph.comparisons.statistics.ranking import ranking
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario

SCENARIOS = [named(f"map {i}") for i in range(40)]
FAILURES = [status for status in Status if not status.has_path]


def run_of(
    scenario: Scenario,
    solver: str,
    cost: float,
    seed: int | None = None,
    *,
    bound: float = 1.0,
    seconds: float = 1.0,
    status: Status = Status.TIMED_OUT,
) -> Run:
    """Answer at that cost; an infinite one is a failure."""
    solution = Solution(Status.FOUND if cost < math.inf else status, cost=cost, seconds=seconds)
    return Run(scenario, solver, seed, exact=False, solution=solution, certificate=proof_of(bound))


def by_solver(found: Sequence[LeaderboardRow]) -> dict[str, LeaderboardRow]:
    return {one.solver: one for one in found}


def test_a_small_study_by_hand() -> None:
    rows = {"good": [1.0, 1.1, 1.2, 1.5], "tied": [1.0, 1.2, 1.3, math.inf], "bad": [2.0, math.inf, 3.0, math.inf]}
    runs = [
        run_of(scenario, solver, row[i], status=FAILURES[i])
        for i, scenario in enumerate(SCENARIOS[:4])
        for solver, row in rows.items()
    ]
    good, tied, bad = leaderboard_of(runs)
    assert [one.solver for one in (good, tied, bad)] == ["good", "tied", "bad"]
    assert [one.place for one in (good, tied, bad)] == [1, 2, 3]
    assert [one.average_rank for one in (good, tied, bad)] == [1.125, 2.0, 2.875]
    assert [one.wins for one in (good, tied, bad)] == [4, 1, 0]
    assert [one.n_instances for one in (good, tied, bad)] == [4, 4, 4]
    assert [one.gap.median for one in (good, tied, bad)] == pytest.approx([0.1, 0.2, 2.0])
    assert (bad.n_runs, bad.n_paths, bad.success) == (4, 2, success_interval(2, 4))
    assert (good.failures, good.failed_on) == ({}, {})
    assert (bad.failures, bad.failed_on) == ({FAILURES[1]: 1, FAILURES[3]: 1}, {"map 1": 1, "map 3": 1})
    assert good.seconds_to_near.median == math.inf
    assert good.versus_best is None
    assert bad.versus_best == against(instance_costs(runs), "good")[1]


def test_seeds_are_one_instance_but_many_runs() -> None:
    runs = [run_of(SCENARIOS[0], "a", cost, seed) for seed, cost in enumerate([1.0, math.inf, 1.02])]
    runs += [run_of(SCENARIOS[0], "b", 1.5)]
    a, b = leaderboard_of(runs)
    assert (a.n_instances, a.n_runs, a.n_paths, a.failures) == (1, 3, 2, {Status.TIMED_OUT: 1})
    assert a.gap == (pytest.approx(0.02), -math.inf, math.inf)
    assert a.seconds_to_near.median == 1.0
    assert (b.n_runs, b.wins) == (1, 0)


def test_of_equal_ranks_the_smaller_gap_and_then_the_quicker_one_stands_first() -> None:
    runs = [run_of(SCENARIOS[0], "slow", 1.0, seconds=3.0), run_of(SCENARIOS[0], "quick", 1.0, seconds=1.0)]
    assert [(one.solver, one.place, one.wins) for one in leaderboard_of(runs)] == [("quick", 1, 1), ("slow", 1, 1)]
    # each is cheaper on one scenario, and they tie on the third
    rows = {"far": [1.04, 1.02, 3.0], "near": [1.01, 1.03, 3.0]}
    runs = [
        run_of(scenario, solver, cost, seconds={"far": 1.0, "near": 9.0}[solver])
        for solver, row in rows.items()
        for scenario, cost in zip(SCENARIOS, row, strict=False)
    ]
    found = leaderboard_of(runs)
    assert [(one.solver, one.place, one.average_rank) for one in found] == [("near", 1, 1.5), ("far", 1, 1.5)]
    assert found[0].gap.median < found[1].gap.median
    assert found[0].seconds_to_near.median > found[1].seconds_to_near.median


def test_a_study_that_goes_on() -> None:
    runs = [run_of(scenario, "a", 1.0) for scenario in SCENARIOS[:3]] + [run_of(SCENARIOS[0], "b", math.inf)]
    found = by_solver(leaderboard_of(runs))
    assert (found["a"].n_instances, found["a"].n_runs, found["b"].n_runs) == (1, 3, 1)
    # nothing is shared yet
    alone = leaderboard_of([run_of(SCENARIOS[0], "a", 1.0), run_of(SCENARIOS[1], "b", 1.0)])
    assert [one.n_instances for one in alone] == [0, 0]
    assert all(math.isnan(one.average_rank) and math.isnan(one.gap.median) and one.versus_best is None for one in alone)
    assert leaderboard_of([]) == []


def test_unknown_and_unusable_bounds() -> None:
    for bound in (math.nan, math.inf, -1.0):
        (one,) = leaderboard_of([run_of(SCENARIOS[0], "a", 2.0, bound=bound)])
        assert all(math.isnan(end) for end in (*one.gap, *one.seconds_to_near))
        assert (one.average_rank, one.wins) == (1.0, 1)
    runs = [run_of(SCENARIOS[0], "a", 2.0, bound=math.nan), run_of(SCENARIOS[1], "a", 1.5, bound=1.0)]
    assert leaderboard_of(runs)[0].gap.median == 0.5
    assert leaderboard_of([run_of(SCENARIOS[0], "a", 0.0, bound=0.0)])[0].gap == Estimate(0.0, -math.inf, math.inf)


def test_nobody_wins_where_nobody_finds_a_path() -> None:
    runs = [run_of(scenario, solver, math.inf) for scenario in SCENARIOS for solver in "abc"]
    for one in leaderboard_of(runs):
        assert (one.place, one.average_rank, one.wins, one.n_paths) == (1, 2.0, 0, 0)
        assert one.gap.median == one.seconds_to_near.median == math.inf
        assert one.failures == {Status.TIMED_OUT: 40}
        assert one.versus_best is None or (one.versus_best.p_holm, one.versus_best.ratio.median) == (1.0, 1.0)


tables = st.integers(1, 5).flatmap(
    lambda k: st.lists(
        st.lists(st.sampled_from([1.0, 1.04, 1.5, 2.0, math.inf]), min_size=k, max_size=k), min_size=1, max_size=12
    )
)


def study(table: Sequence[Sequence[float]]) -> list[Run]:
    return [
        run_of(scenario, f"s{i}", cost)
        for scenario, row in zip(SCENARIOS, table, strict=False)
        for i, cost in enumerate(row)
    ]


@usual
@given(table=tables, data=st.data())
def test_leaderboards_agree_with_the_ranking_and_all_pairs(table: list[list[float]], data: st.DataObject) -> None:
    runs = study(table)
    found = leaderboard_of(runs)
    costs = instance_costs(runs)
    ranks = ranking(costs)
    assert [one.average_rank for one in found] == pytest.approx(list(ranks.average_ranks))
    assert [one.place for one in found] == sorted(one.place for one in found)
    pairs = {frozenset((one.solver, one.reference)): one for one in all_pairs(costs)}
    for one in found[1:]:
        assert one.versus_best is not None
        assert one.versus_best.reference == found[0].solver
        assert one.versus_best.p_holm == pytest.approx(pairs[frozenset((one.solver, found[0].solver))].p_holm)
    # the order of the scenarios says nothing
    order = data.draw(st.permutations(table))
    again = by_solver(leaderboard_of(study(order)))
    for one in found:
        other = again[one.solver]
        assert one.average_rank == pytest.approx(other.average_rank)
        assert (one.wins, one.success) == (other.wins, other.success)
        assert (one.gap, one.failures) == (other.gap, other.failures)


@usual
@given(table=tables, place=st.integers(0, 11))
def test_a_failure_never_helps(table: list[list[float]], place: int) -> None:
    before = by_solver(leaderboard_of(study(table)))["s0"]
    worse = [[math.inf, *row[1:]] if i == place % len(table) else row for i, row in enumerate(table)]
    after = by_solver(leaderboard_of(study(worse)))["s0"]
    assert after.average_rank >= before.average_rank
    assert after.wins <= before.wins
    assert after.n_paths <= before.n_paths
    assert after.gap.median >= before.gap.median
    assert after.seconds_to_near.median >= before.seconds_to_near.median


def test_real_runs() -> None:
    entrants = [Entrant.parse(name) for name in ("straight-line", "cgla", "rrt-star:iterations=200")]
    runs = list(compare(SCENARIOS[:2], entrants, 2, tolerance=0.1))
    found = by_solver(leaderboard_of(runs))
    # without a threat the straight line is the best path of all
    assert found["straight-line"].wins == found["straight-line"].n_instances == 2
    assert found["straight-line"].gap.median == pytest.approx(0.0, abs=0.1)
    assert found["rrt-star:iterations=200"].n_runs == 4


def test_what_could_not_run_is_not_ranked() -> None:
    """The others are measured on all scenarios."""
    runs = [run_of(scenario, "a", 1.0) for scenario in SCENARIOS] + [run_of(SCENARIOS[0], "b", math.inf)]
    lacking = [
        dataclasses.replace(one, solution=dataclasses.replace(one.solution, status=Status.UNAVAILABLE))
        for one in (run_of(scenario, "c", math.inf) for scenario in SCENARIOS)
    ]
    assert leaderboard_of([*runs, *lacking]) == leaderboard_of(runs)
    assert instance_costs([*runs, *lacking]) == instance_costs(runs)
    assert leaderboard_of(lacking) == []

"""Numbers and words of tables: they can be read back, and show no more digits than are certain."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph._text import DASH, at_most, duration, figure, listed, percent, rounded_down
from cgla_graph.comparisons.leaderboard.leaderboard import failed, failure_groups
from cgla_graph.comparisons.numbers import estimate_cell, or_never, p_equals, p_value, ratio, span
from cgla_graph.comparisons.statistics.intervals import Estimate
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.leaderboard_columns import SPARE, leaderboard_heads
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import load_scenario

numbers = st.floats(1e-6, 1e6) | st.just(math.inf)


@given(st.lists(numbers, min_size=3, max_size=3).map(sorted))
def test_an_interval_is_there_exactly_where_it_says_something(ends: list[float]) -> None:
    low, median, high = ends
    assert estimate_cell(Estimate(median, low, high), ratio, least=0.0).interval == (
        "" if low == math.inf else f"{ratio(low)} to {ratio(high)}"
    )
    for nothing in (Estimate(median, 0.0, math.inf), Estimate(median, -math.inf, math.inf)):
        assert estimate_cell(nothing, ratio, least=0.0) == (ratio(median), "")
    # from 0 on is something where less than 0 could be
    assert estimate_cell(Estimate(median, 0.0, math.inf), or_never(str)).interval == "0.0 to never"
    assert estimate_cell(Estimate(math.nan, low, high), ratio) == (DASH, "")


@given(st.floats(0.0, 1.0))
def test_a_p_value_is_never_written_as_zero_or_far_off(p: float) -> None:
    words = p_value(p)
    if words.startswith("<"):
        assert p < float(words[1:])
    else:
        assert float(words) == pytest.approx(p, rel=0.05, abs=1e-12)
        assert float(words) > 0.0
    assert p_equals(p).removeprefix("p ").removeprefix("= ") == words


@given(st.lists(st.sampled_from("abcdef"), max_size=20), st.integers(1, 12))
def test_names_that_are_not_listed_are_counted(names: list[str], most: int) -> None:
    words = listed(names, most).replace(" and ", ", ").split(", ") if names else []
    if len(names) > most:
        assert words == [*names[:most], f"{len(names) - most} more"]
    else:
        assert words == names


def test_a_unit_stands_once_where_both_ends_have_it() -> None:
    assert span("9 ms", "10 ms") == "9 to 10 ms"
    assert span("0.9 ms", "2 s") == "0.9 ms to 2 s"
    assert span("1 s", "never") == "1 s to never"


@pytest.mark.parametrize(
    ("written", "text"),
    [
        (figure(0.0, 6), "0.00000"),
        (figure(1234567.4, 6), "1234567"),
        (figure(-1234567.4, 6), "-1234567"),
        (figure(999999.7, 6), "1000000"),
        (figure(-math.inf, 6), "-"),
        (figure(math.nan, 6), "-"),
        (percent(-0.0), "+0.00 %"),
        (percent(-1e-9), "+0.00 %"),
        (percent(-0.0001), "-0.01 %"),
        (percent(12.0), "+1200.00 %"),
        (percent(math.nan), "-"),
        (duration(0.0), "0 ms"),
        (duration(0.5), "500 ms"),
        (duration(0.9996), "1.00 s"),
        (duration(75.25), "75.25 s"),
    ],
)
def test_numbers_at_the_edge(written: str, text: str) -> None:
    assert written == text


@given(value=st.floats(-1e6, 1e6), digits=st.integers(1, 12))
def test_numbers_are_read_back_within_their_digits(value: float, digits: int) -> None:
    assert float(figure(value, digits)) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))
    assert float(percent(value).removesuffix(" %")) == pytest.approx(100.0 * value, abs=0.00501)
    assert len(figure(value * 1e290, 6)) < 16


@given(st.floats(1e-6, 1e12), st.integers(3, 9))
def test_a_bound_is_rounded_down(value: float, digits: int) -> None:
    assert value * (1.0 - 2.0 * 10.0 ** (1 - digits)) <= float(rounded_down(value, digits)) <= value


@given(st.floats(0.0, 10.0))
def test_a_gap_is_rounded_up(gap: float) -> None:
    shown = float(at_most(gap).split()[0])
    assert shown - 0.01 - 1e-9 <= 100.0 * gap <= shown + 1e-12


def test_columns_that_may_be_left_out_are_columns() -> None:
    assert {*SPARE} < {*leaderboard_heads([])}


@given(st.lists(st.tuples(st.sampled_from("ab"), st.sampled_from([*Status]), st.sampled_from(["x 1", "x 2.5", "y"]))))
def test_groups_of_failures_share_out_the_failures(ends: list[tuple[str, Status, str]]) -> None:
    scenario = load_scenario("one-threat")
    runs = [
        Run(scenario, solver, None, exact=False, solution=Solution(status, message=message))
        for solver, status, message in ends
    ]
    groups = failure_groups(runs)
    assert sorted(id(run) for group in groups for run in group.runs) == sorted(map(id, failed(runs)))
    keys = {(group.solver, group.status, group.message[0]) for group in groups}
    assert len(keys) == len(groups)
    for group in groups:
        for run in group.runs:
            assert (run.solver, run.solution.status, run.solution.message[0]) in keys
            assert (run.solver, run.solution.status) == (group.solver, group.status)
            assert not run.solution.status.has_path

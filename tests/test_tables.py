"""Tables for the terminal: what users named must stand there as they named it."""

import io
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from rich.table import Table

from cgla_graph.comparisons.runner import Contender, Run, compare
from cgla_graph.comparisons.tables import comparison_table, duration, figure, listing, percent
from cgla_graph.scenario import load_scenario, scenario_from_toml
from cgla_graph.solution import Solution, Status

TEXT = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 5.0\n[lattice]\nresolution = 3\n"
ODD = ["[bold]x[/bold]", "[/]", "[red]", "x]", "[link=https://a.b]y[/link]", "ünï 漢字", "\\[b]", "quo\"te'", "{x}"]


def shown(table: Table, width: int = 200) -> str:
    console = Console(file=io.StringIO(), width=width)
    console.print(table)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def run_of(name: str, solver: str, message: str = "", status: Status = Status.NOT_FOUND) -> Run:
    path = np.array([(0.1, 0.1), (0.9, 0.9)])
    solution = Solution(status, path=path if status.is_path else np.empty((0, 2)), message=message)
    return Run(scenario_from_toml(TEXT, name), solver, None, False, solution)  # noqa: FBT003 - positional fields


@pytest.mark.parametrize("odd", ODD)
def test_names_and_messages_stand_as_they_are(odd: str) -> None:
    run = run_of(odd, odd, message=f"because {odd}")
    text = shown(comparison_table(run.scenario, [run]))
    assert f"{odd}: " in text
    assert f"│ {odd} " in text
    assert f"{odd}: because {odd}" in text


@pytest.mark.parametrize("odd", ODD)
def test_titles_stand_as_they_are(odd: str) -> None:
    title = odd.replace("\\", "\\\\").replace('"', '\\"')
    scenario = scenario_from_toml(f'title = "{title}"\n{TEXT}', "one")
    assert f"one: {odd} (k = 5" in shown(comparison_table(scenario, [run_of("one", "cgla")]))


def test_backslashes_at_the_end_stand_as_they_are() -> None:
    run = run_of("a\\", "b\\", message="c\\")
    text = shown(comparison_table(run.scenario, [run]))
    assert "\\\\" not in text
    assert "b\\: c\\" in text


@pytest.mark.parametrize("odd", ["a:cat:b", "1:100:2", ":warning:"])
def test_colons_stand_as_they_are(odd: str) -> None:
    run = run_of(odd, odd, message=odd)
    assert shown(comparison_table(run.scenario, [run])).count(odd) >= 3


def test_a_name_of_two_lines_keeps_both() -> None:
    run = run_of("one\ntwo", "cgla")
    text = shown(comparison_table(run.scenario, [run]))
    assert "one" in text
    assert "two (k = " in text


@given(name=st.text(st.characters(exclude_categories=["C", "Z"]), min_size=1, max_size=20))
def test_no_name_breaks_a_table(name: str) -> None:
    run = run_of(name, name, message=name)
    assert shown(comparison_table(run.scenario, [run]))
    assert shown(listing(name, [name], [{name: name}]))


def test_a_comparison_has_a_line_a_solver() -> None:
    scenario = load_scenario("one-threat")
    names = ["cgla", "dijkstra", "straight-line"]
    runs = list(compare([scenario], [Contender.parse(name) for name in names], 1))
    text = shown(comparison_table(scenario, runs))
    for name in names:
        assert text.count(f"│ {name} ") == 1
    assert "1.59523" in text
    assert "+0.00 %" in text
    assert text.index("│ cgla ") < text.index("│ straight-line ")
    assert "map units" in text


def test_lengths_on_maps_in_degrees_are_metres() -> None:
    scenario = load_scenario("finland")
    (run,) = compare([scenario], [Contender.parse("straight-line")], 1)
    assert "lengths in m)" in shown(comparison_table(scenario, [run]))


def test_reasons_stand_below() -> None:
    runs = [run_of("one", "a", "the reason", Status.UNAVAILABLE), run_of("one", "b", "quiet", Status.FOUND)]
    text = shown(comparison_table(runs[0].scenario, runs))
    assert "a: the reason" in text
    assert "unavailable" in text
    assert "quiet" not in text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (1.50547714, 6, "1.50548"),
        (0.0, 6, "0.00000"),
        (1.0, 3, "1.00"),
        (232276.4, 6, "232276"),
        (1234567.4, 6, "1234567"),
        (-1234567.4, 6, "-1234567"),
        (999999.7, 6, "1000000"),
        (math.inf, 6, "-"),
        (math.nan, 6, "-"),
        (-math.inf, 6, "-"),
    ],
)
def test_figure(value: float, digits: int, text: str) -> None:
    assert figure(value, digits) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "+0.00 %"),
        (-0.0, "+0.00 %"),
        (-1e-9, "+0.00 %"),
        (-0.001, "-0.10 %"),
        (-0.0001, "-0.01 %"),
        (12.0, "+1200.00 %"),
        (math.inf, "-"),
        (math.nan, "-"),
    ],
)
def test_percent(value: float, text: str) -> None:
    assert percent(value) == text


@pytest.mark.parametrize("value", [1.5e20, 1.5e300])
def test_huge_numbers_stay_short(value: float) -> None:
    assert len(figure(value, 6)) < 16


@given(value=st.floats(-1e6, 1e6), digits=st.integers(1, 12))
def test_numbers_are_read_back_within_their_digits(value: float, digits: int) -> None:
    assert float(figure(value, digits)) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))
    assert float(percent(value).removesuffix(" %")) == pytest.approx(100.0 * value, abs=0.00501)


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.0, "0 ms"), (0.000123, "0.123 ms"), (0.5, "500 ms"), (1.0, "1.00 s"), (75.25, "75.25 s")]
)
def test_duration(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_nearly_a_second() -> None:
    assert "e+" not in duration(0.9996)

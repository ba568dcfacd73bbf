"""Tables for the terminal: what users named must stand there as they named it."""

import io
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console
from rich.table import Table

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.console import listing
from cgla_graph.comparisons.leaderboard.performance import performances
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.rows import bound_note
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.comparisons.tables.tables import comparison_table, performance_table
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import load_scenario, scenario_from_toml

TEXT = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 5.0\n[lattice]\nresolution = 3\n"
SCENARIO = scenario_from_toml(TEXT, "one")
ODD = ["[bold]x[/bold]", "[/]", "[red]", "x]", "[link=https://a.b]y[/link]", "ünï 漢字", "\\[b]", "quo\"te'", "{x}"]
ODD += ["a:cat:b", "1:100:2", ":warning:", "b\\"]


def shown(table: Table, width: int = 200) -> str:
    console = Console(file=io.StringIO(), width=width)
    console.print(table)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def run_of(name: str, solver: str, message: str = "", status: Status = Status.NOT_FOUND) -> Run:
    path = np.array([(0.1, 0.1), (0.9, 0.9)])
    solution = Solution(status, path=path if status.has_path else np.empty((0, 2)), message=message)
    return Run(scenario_from_toml(TEXT, name), solver, None, False, solution)  # noqa: FBT003 - positional fields


@pytest.mark.parametrize("odd", ODD)
def test_names_and_messages_stand_as_they_are(odd: str) -> None:
    title = odd.replace("\\", "\\\\").replace('"', '\\"')
    scenario = scenario_from_toml(f'title = "{title}"\n{TEXT}', odd)
    run = replace(run_of("one", odd, message=f"because {odd}"), scenario=scenario)
    text = shown(comparison_table(scenario, [run]))
    assert f"{odd}: {odd} (k = 5" in text
    assert f"│ {odd} " in text
    assert f"{odd}: because {odd}" in text
    assert f"│ {odd} " in shown(performance_table(performances([run])))


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
    runs = list(compare([scenario], [Entrant.parse(name) for name in names], 1, tolerance=None))
    text = shown(comparison_table(scenario, runs))
    for name in names:
        assert text.count(f"│ {name} ") == 1
    assert "1.59523" in text
    assert "+0.00 %" in text
    assert text.index("│ cgla ") < text.index("│ straight-line ")
    assert "map units" in text


# The lower bound


def proven(bound: float, *costs: float, solver: str = "own", upper: float = 1.6, **more: Any) -> list[Run]:  # noqa: ANN401 - of a solution
    proof = Certificate(bound, upper, 0.1, 0.0005, 9, "the reason", 0.4)
    answers = [
        Solution(Status.FOUND if cost < math.inf else Status.NOT_FOUND, cost=cost, lower_bound=bound, **more)
        for cost in costs
    ]
    return [Run(SCENARIO, solver, seed, False, answer, proof) for seed, answer in enumerate(answers, 1)]  # noqa: FBT003 - positional fields


def columns(text: str) -> list[str]:
    heads = next(line for line in text.splitlines() if line.startswith("┃"))
    return [head.strip() for head in heads.strip("┃").split("┃")]


def test_the_gap_stands_right_after_the_cost_and_the_caption_says_of_what() -> None:
    runs = proven(1.5, 1.515, solver="a") + proven(1.5, math.inf, solver="b")
    text = shown(comparison_table(runs[0].scenario, runs, notes=["what else"]))
    heads = columns(text)
    assert heads[heads.index("cost") + 1] == "gap"
    assert "+1.00 %" in text
    assert "gap: how far above the proven lower bound 1.50000 (grid step 0.0005, 400 ms)\n" in text.replace("  ", "")
    assert "what else" in text


def test_what_a_bound_is_not_is_said() -> None:
    assert bound_note([run_of("one", "a")]) == ""
    assert "not as tight as asked for: the reason" in bound_note(proven(1.0, 1.5))
    assert "no lower bound could be proven: the reason" in bound_note(proven(math.nan, 1.5))
    assert "proven that there is no path: the reason" in bound_note(proven(math.inf, math.inf, upper=math.inf))
    assert "no lower bound was asked for" in shown(comparison_table(SCENARIO, [run_of("one", "a")]))
    own = [Run(SCENARIO, "own", None, False, Solution(Status.FOUND, cost=2.0, lower_bound=1.25))]  # noqa: FBT003 - positional fields
    assert bound_note(own, " m") == "how far above the lower bound 1.25000 m that a solver proved"


# How soon


def test_how_soon_has_a_line_a_solver() -> None:
    runs = proven(1.0, *[1.04] * 6, solver="six", seconds=0.25, evaluations=1234)
    runs += proven(1.0, 1.005, 1.02, math.inf, solver="three", seconds=0.5, evaluations=10)
    runs += proven(1.0, math.inf, solver="none")
    text = shown(performance_table(performances(runs)))
    assert columns(text)[:3] == ["solver", "runs", "success"]
    lines = [line for line in text.splitlines() if line.startswith("│")]
    cells = [[cell.strip() for cell in line.strip("│").split("│")] for line in lines]
    assert cells[0] == ["three", "3", "2/3", "500", "500", "500", "never", "never", "1.02000"]
    assert cells[1] == ["", "", "9 to 99 %", "", "", "", "", "", ""]
    assert cells[2] == ["six", "6", "6/6", "250", "250", "250", "never", "never", "1.04000"]
    assert cells[3] == ["", "", "54 to 100 %", *["250 to 250"] * 3, "", "", "1.04000 to 1.04000"]
    assert cells[4] == ["none", "1", "0/1", *["never"] * 6]
    assert "need at least 6 runs (--seeds 6)" in text
    assert "over 1.00000" in text
    assert "need at least" not in shown(performance_table(performances(runs[:6])))


def test_how_soon_without_a_bound() -> None:
    text = shown(performance_table(performances(proven(math.nan, 1.5, 1.6))))
    assert "unknown without a lower bound" in text
    assert text.count(" - │") == 4


def test_lengths_on_maps_in_degrees_are_metres() -> None:
    scenario = load_scenario("finland")
    (run,) = compare([scenario], [Entrant.parse("straight-line")], 1, tolerance=None)
    assert "lengths in m)" in shown(comparison_table(scenario, [run]))


def test_reasons_stand_below() -> None:
    runs = [run_of("one", "a", "the reason", Status.UNAVAILABLE), run_of("one", "b", "quiet", Status.FOUND)]
    text = shown(comparison_table(runs[0].scenario, runs))
    assert "a: the reason" in text
    assert "unavailable" in text
    assert "quiet" not in text

"""`cgla results`: filters, tables that fit, leaderboard, regression, reruns, and one JSON document."""

import dataclasses
import io
import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rich.cells import cell_len
from rich.console import Console
from studies_small import by_number, named, runs_of, small_study, write_study

from cgla_graph.comparisons.leaderboard.leaderboard import leaderboard_of
from cgla_graph.comparisons.leaderboard.regression import regression
from cgla_graph.comparisons.results import lookup
from cgla_graph.comparisons.results.filters import Filters
from cgla_graph.comparisons.results.rerun import Rerun
from cgla_graph.comparisons.results.tables import (
    failure_lines,
    leaderboard_table,
    regression_table,
    runs_table,
    solver_table,
)
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.execution import run_study
from cgla_graph.comparisons.study.flight_run import FlightRun
from cgla_graph.comparisons.study.store import FILE, Stored, StudyStore, load
from cgla_graph.comparisons.study.study import Study
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.errors import CglaError
from cgla_graph.mission.records import MissionStatus
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import load_scenario

SCENARIOS = [*(f"random-{number}" for number in range(7)), "maze"]
SOLVERS = ["prm-fast", "prm-slow:a=[1,2]", "straight-line"]


def failing(scenario: str, solver: int, seed: int | None) -> Solution:
    """Let the third solver fail on the maze, and the second one with its second seed there."""
    if scenario == "maze" and solver == 2:
        return Solution(Status.TIMED_OUT, seconds=60.0, message="stopped after 60 s")
    if scenario == "maze" and solver == 1 and seed == 2:
        return Solution(Status.CRASHED, message="<b>\ndied at 0x7f12")
    return by_number(scenario, solver, seed)


def dearer(scenario: str, solver: int, seed: int | None) -> Solution:
    """Raise the first solver's costs by 10 % over `failing`."""
    answer = failing(scenario, solver, seed)
    return dataclasses.replace(answer, cost=1.1 * answer.cost) if solver == 0 else answer


STUDY = small_study(SCENARIOS, SOLVERS, title="a study")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    write_study(folder, STUDY, failing)
    return folder


@pytest.fixture(scope="module")
def old(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("old")
    write_study(folder, small_study([*SCENARIOS[1:], "gone"], SOLVERS, title="old"), failing)
    return folder


@pytest.fixture(scope="module")
def stored(folder: Path) -> Stored:
    return load(folder)


def shown(table: object, width: int = 300) -> str:
    console = Console(file=io.StringIO(), width=width)
    console.print(table)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def printed(capfd: pytest.CaptureFixture[str], found: lookup.Results) -> str:
    lookup.print_results(found)
    return capfd.readouterr().out


def cells(text: str) -> list[list[str]]:
    """Return the cells of the lines of tables."""
    return [[cell.strip() for cell in line.strip("│").split("│")] for line in text.splitlines() if line.startswith("│")]


# Filters


def kept(stored: Stored, **texts: str | int) -> list[tuple[str, str, int | None]]:
    filters = Filters.read(**texts)  # type: ignore[arg-type]
    runs = filters.of(stored.runs, [one.name for one in stored.scenarios], stored.solvers, [1, 2, None])
    return [(run.scenario.name, run.solver, run.seed) for run in runs]


def every(stored: Stored, keep: Callable[[str, str, int | None], bool]) -> list[tuple[str, str, int | None]]:
    names = [(run.scenario.name, run.solver, run.seed) for run in stored.runs]
    return [one for one in names if keep(*one)]


def test_filters_keep_what_they_name(stored: Stored) -> None:
    assert kept(stored) == every(stored, lambda *_: True)
    assert kept(stored, scenario="maze, random-1") == every(stored, lambda name, *_: name in {"maze", "random-1"})
    assert kept(stored, scenario="random-*") == every(stored, lambda name, *_: name != "maze")
    assert kept(stored, scenario="random-[1-3]") == every(stored, lambda name, *_: name[-1] in "123")
    assert kept(stored, solver="prm-*", seed=2) == every(stored, lambda *cell: cell[2] == 2)
    assert kept(stored, status="timed-out,crashed") == [
        ("maze", "prm-slow:a=[1,2]", 2),
        ("maze", "straight-line", None),
    ]
    assert kept(stored, status="*-out") == [("maze", "straight-line", None)]


def test_flights_are_kept_by_how_they_ended() -> None:
    labels = sorted({*(one.label for one in Status), *(one.label for one in MissionStatus)})
    flights = [FlightRun("swarm", "told", label, None, 2, label) for label in labels]
    for label in labels:
        (one,) = Filters.read(status=label).of_flights(flights)
        assert one.status == label
    some = Filters.read(status="coll*,out-of-t*").of_flights(flights)
    assert [one.status for one in some] == ["collision", "out-of-ticks"]


def test_a_name_that_looks_like_a_pattern_is_a_name(stored: Stored) -> None:
    found = kept(stored, solver="prm-slow:a=[1,2]")
    assert {label for _, label, _ in found} == {"prm-slow:a=[1,2]"}
    assert len(found) == 2 * len(SCENARIOS)


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        ({"scenario": "mase"}, ["unknown scenario 'mase'", "maze"]),
        ({"scenario": "maze,zzz"}, ["'zzz'", "random-0", "maze"]),
        ({"scenario": "random-9*"}, ["'random-9*'", "random-"]),
        ({"solver": "prm-slow"}, ["'prm-slow'", "prm-slow:a=[1,2]"]),
        ({"solver": " , "}, ["--solver names nothing"]),
        ({"status": "timedout"}, ["unknown status", "timed-out"]),
        ({"seed": 7}, ["seed 7", "1 and 2"]),
    ],
)
def test_names_that_are_not_there_are_refused(folder: Path, texts: dict[str, str], words: list[str]) -> None:
    with pytest.raises(CglaError) as caught:
        lookup.look_up(folder, **texts)  # type: ignore[arg-type]
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


def test_a_seed_where_none_draws_numbers() -> None:
    runs = runs_of(small_study(["one"], ["straight-line"]))
    with pytest.raises(CglaError, match="no solver here draws random numbers"):
        Filters.read(seed=1).of(runs, ["one"], ["straight-line"], [None])


def test_a_status_that_no_run_has_keeps_nothing(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    found = lookup.look_up(folder, status="unsupported")
    assert not found.runs
    assert "status unsupported: 0 runs" in printed(capfd, found)


# Tables that fit


def test_long_words_fold_before_numbers_go() -> None:
    label = "rrt-star:" + ":".join(f"setting{number}=100000" for number in range(6))
    table = FittedTable("t", ("solver",), ("cost", "gap"), spare=("gap",), rows=[[label, "1.50364", "+1.58 %"]])
    text = shown(table, 60)
    assert "1.50364" in text
    assert "+1.58 %" in text
    assert "too narrow" not in text
    assert "".join(line[0] for line in cells(text)) == label
    assert label in shown(table, 200)


@pytest.mark.parametrize("width", [60, 80, 100, 120, 200])
def test_the_tables_of_a_study_fit(stored: Stored, width: int) -> None:
    tables = [
        leaderboard_table(leaderboard_of(stored.runs)),
        runs_table(stored.runs),
        regression_table("both", regression(stored.runs, stored.runs)),
        solver_table(stored.runs),
    ]
    for table in tables:
        assert {*table.spare} <= {*table.left, *table.right}
        text = shown(table, width)
        assert max(cell_len(line) for line in text.splitlines()) <= width
        assert "…" not in text


# Output


def test_the_summary_says_who_wins_and_where_each_fails(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, lookup.look_up(folder))
    assert "a study: 40 of 40 runs, complete" in text
    assert "prm-fast ranks first of 3 solvers on 8 scenarios" in text
    lines = cells(text[text.index("leaderboard") : text.index("ranks first")])
    assert [line[0] for line in lines if line[0]] == SOLVERS
    assert "straight-line: timed-out in 1 run on maze (--rerun 40): stopped after 60 s" in text
    assert "prm-slow:a=[1,2]: crashed in 1 run on maze (--rerun 39): <b> died at 0x7f12" in text
    # who wins comes first, then one table with a line for each solver and scenario
    table = re.search(r"^scenario by scenario *$", text, flags=re.MULTILINE)
    assert table is not None
    assert text.index("ranks first") < table.start() < text.index("│ maze ")
    assert text.count("│ maze ") == 3


def test_many_tables_are_left_to_who_asks(
    folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lookup, "MOST_LINES", 5)
    assert "--solver NAME shows those of one" in printed(capfd, lookup.look_up(folder))
    assert printed(capfd, lookup.look_up(folder, solver="prm-fast")).count("│ maze ") == 1


def test_runs_are_listed_when_asked_for(folder: Path, capfd: pytest.CaptureFixture[str], stored: Stored) -> None:
    assert "--rerun NUMBER" not in printed(capfd, lookup.look_up(folder))
    text = printed(capfd, lookup.look_up(folder, runs=True, scenario="maze"))
    numbers = [line[0] for line in cells(text) if line[0].isdigit()]
    assert numbers == [str(run.number) for run in stored.runs if run.scenario.name == "maze"]


def test_no_leaderboards_of_runs_picked_by_how_they_ended(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    found = lookup.look_up(folder, status="found")
    assert found.leaderboard is None
    text = printed(capfd, found)
    assert "no leaderboard" in text
    assert "ranks first" not in text
    for more in ({"against": folder}, {"export": [Path("a.tex")]}):
        with pytest.raises(CglaError, match="leave out --status"):
            lookup.look_up(folder, status="found", **more)  # type: ignore[arg-type]


def test_names_appear_as_they_are(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    odd = ["[bold]x[/bold]", ":warning:", "<script>", "ünï 漢字"]
    write_study(tmp_path, small_study(odd, [f"prm {one}" for one in odd], title="[red]t"))
    text = printed(capfd, lookup.look_up(tmp_path, runs=True))
    for one in odd:
        assert f"│ {one} " in text
        assert f"│ prm {one} " in text
    assert "[red]t: " in text


def test_a_study_that_is_not_complete_says_so(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write_study(tmp_path, STUDY, first=7)
    text = printed(capfd, lookup.look_up(tmp_path))
    assert "7 of 40 runs, not complete yet" in text
    write_study(tmp_path / "b", STUDY, first=0)
    assert "no runs yet" in printed(capfd, lookup.look_up(tmp_path / "b"))


def test_messages_that_differ_by_numbers_stand_once() -> None:
    scenario = named("one")
    run = runs_of(small_study(["one"], ["prm"]))[0]
    failed = [
        dataclasses.replace(
            run, scenario=scenario, number=n, solution=Solution(Status.FAILED, message=f"cost {n}.5 is wrong")
        )
        for n in range(1, 30)
    ]
    assert failure_lines(failed) == ["prm: failed in 29 runs on one (--rerun 1): cost 1.5 is wrong"]
    others = [dataclasses.replace(run, solution=Solution(Status.FAILED, message=chr(65 + n))) for n in range(10)]
    lines = failure_lines(others)
    assert len(lines) == 4
    assert "7 more, with other messages" in lines[-1]


def test_a_folder_without_a_study(tmp_path: Path) -> None:
    with pytest.raises(CglaError, match=re.escape(FILE)):
        lookup.look_up(tmp_path)


# Against another study


def test_against_names_what_became_worse_and_what_does_not_pair(
    tmp_path: Path, old: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_study(tmp_path / "new", small_study(SCENARIOS, SOLVERS), dearer)
    found = lookup.look_up(tmp_path / "new", against=old)
    assert found.regression is not None
    text = printed(capfd, found)
    verdicts = {line[0]: line[1] for line in cells(text) if line[0]}
    assert verdicts == {"prm-fast": "worse", "prm-slow:a=[1,2]": "identical", "straight-line": "identical"}
    ratios = {line[0]: line[3] for line in cells(text) if line[0]}
    assert ratios["prm-fast"] == "1.1000"
    assert "only the old study has them: 5 runs" in text
    assert "gone" in text
    assert "only the new study has them: 5 runs" in text
    assert "random-0" in text
    assert "1 worse" in text


def test_against_itself_is_identical_and_filters_hold(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    found = lookup.look_up(folder, against=folder, solver="prm-*")
    text = printed(capfd, found)
    assert [line[0] for line in cells(text) if line[0]] == SOLVERS[:2]
    assert "not paired" not in text
    assert "identical" in text


def test_against_where_nothing_pairs(tmp_path: Path, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write_study(tmp_path, small_study(["else"], ["prm-else"]))
    text = printed(capfd, lookup.look_up(folder, against=tmp_path))
    assert "no run is in both studies" in text
    # names of either study are no fault
    assert lookup.look_up(folder, against=tmp_path, scenario="else").regression is not None


# One row again


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study that was really run."""
    folder = tmp_path_factory.mktemp("solved")
    entrants = [Entrant.parse(text) for text in ("cgla", "prm-star:milestones=60", "straight-line")]
    study = Study([load_scenario("thin-wall")], entrants, seeds=(1, 2), tolerance=None)
    with StudyStore.create(folder, study) as store:
        for _ in run_study(study, store=store, workers=0):
            pass
    return folder


@pytest.mark.slow
def test_each_row_again_is_identical(solved: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for run in load(solved).runs:
        assert run.number is not None
        found = lookup.look_up(solved, rerun=run.number)
        assert found.rerun is not None
        assert found.rerun.is_identical
        assert (found.rerun.now.seed, found.rerun.now.solver) == (run.seed, run.solver)
        assert dict(found.rerun.now.settings) == dict(run.settings)
        assert "identical: status, path and cost are the same" in " ".join(printed(capfd, found).split())


def with_solution(both: Rerun, **changes: object) -> Rerun:
    now = dataclasses.replace(both.now, solution=dataclasses.replace(both.now.solution, **changes))  # type: ignore[arg-type]
    return Rerun(both.stored, now)


@pytest.mark.slow
def test_what_differs_is_named(solved: Path) -> None:
    both = lookup.look_up(solved, rerun=1).rerun
    assert both is not None
    cost = both.now.solution.cost
    path = both.now.solution.path.copy()
    path[1, 0] = np.nextafter(path[1, 0], math.inf)
    for changes, word in (
        ({"cost": np.nextafter(cost, math.inf)}, "cost differs"),
        ({"path": path}, "path differs"),
        ({"status": Status.FAILED}, "status differs"),
        ({"path": path, "cost": 0.0}, "path, cost differ;"),
    ):
        other = with_solution(both, **changes)
        assert not other.is_identical
        assert word in other.verdict()
    timed = dataclasses.replace(both.stored, settings={"seconds": 0.5})
    assert "seconds=0.5" in with_solution(Rerun(timed, both.now), cost=0.0).verdict()


def test_no_path_again_is_identical() -> None:
    run = dataclasses.replace(runs_of(STUDY)[0], solution=Solution(Status.NOT_FOUND))
    assert Rerun(run, dataclasses.replace(run)).is_identical


@pytest.mark.parametrize("number", [0, 99, -1])
def test_a_number_that_is_not_there(solved: Path, number: int) -> None:
    with pytest.raises(CglaError, match="from 1 to 4"):
        lookup.look_up(solved, rerun=number)


@pytest.mark.parametrize(
    "more", [{"runs": True}, {"solver": "cgla"}, {"against": Path()}, {"export": [Path("a.csv")]}, {"seed": 1}]
)
def test_a_rerun_takes_no_other_option(solved: Path, more: dict[str, object]) -> None:
    with pytest.raises(CglaError, match="--rerun takes one row"):
        lookup.look_up(solved, rerun=1, **more)  # type: ignore[arg-type]


def test_where_a_limit_stopped_a_run_the_verdict_says_so(folder: Path) -> None:
    found = lookup.look_up(folder, rerun=40)
    assert found.rerun is not None
    assert "where a limit stops a run" in found.rerun.verdict()


# One document


def strict(found: lookup.Results) -> dict[str, object]:
    text = json.dumps(lookup.document(found), allow_nan=False)
    document: dict[str, object] = json.loads(text)
    return document


def test_the_document_says_what_is_printed(folder: Path) -> None:
    document = strict(lookup.look_up(folder, scenario="maze", runs=True))
    assert {key: document[key] for key in ("title", "runs", "cells", "complete", "kept")} == {
        "title": "a study",
        "runs": 40,
        "cells": 40,
        "complete": True,
        "kept": 5,
    }
    ranked = document["standings"]
    assert isinstance(ranked, list)
    assert [one["solver"] for one in ranked] == SOLVERS
    assert ranked[2]["failures"] == {"timed-out": 1}
    assert ranked[2]["gap"]["median"] is None
    rows = document["rows"]
    assert isinstance(rows, list)
    assert [one["number"] for one in rows] == [36, 37, 38, 39, 40]
    failures = document["failures"]
    assert isinstance(failures, list)
    assert [one["status"] for one in failures] == ["crashed", "timed-out"]
    assert strict(lookup.look_up(folder))["rows"] is None


def test_the_document_of_a_regression_and_of_a_rerun(folder: Path, solved: Path) -> None:
    document = strict(lookup.look_up(folder, against=folder))
    assert document["standings"] is None
    assert isinstance(document["regression"], dict)
    assert {one["verdict"] for one in document["regression"]["changes"]} == {"identical"}
    again = strict(lookup.look_up(solved, rerun=2))
    assert again["identical"] is True
    assert again["stored"]["path"] == again["now"]["path"]  # type: ignore[index]


def test_exports_take_the_filters(folder: Path, tmp_path: Path) -> None:
    targets = [tmp_path / "a.csv", tmp_path / "a.jsonl"]
    found = lookup.look_up(folder, solver="prm-fast", export=targets)
    assert list(found.written) == targets
    assert len((tmp_path / "a.jsonl").read_text(encoding="utf-8").splitlines()) == 2 * len(SCENARIOS)
    with pytest.raises(CglaError, match="cannot tell the format"):
        lookup.look_up(folder, export=[tmp_path / "b.csv", tmp_path / "b.txt"])
    assert not (tmp_path / "b.csv").exists()

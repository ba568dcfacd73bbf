"""Metrics of people's own: in tables, files, ranking, report and LaTeX, and what may go wrong with them."""

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgla_graph as cg
from cgla_graph.comparisons import Study, metric, run_study, standings
from cgla_graph.comparisons.leaderboard.leaderboard import leaderboard_of
from cgla_graph.comparisons.results import study_run
from cgla_graph.comparisons.study.metric import read_metrics
from cgla_graph.comparisons.tables.leaderboard_columns import leaderboard_notes
from cgla_graph.errors import CglaError

FILE = """
import os

import numpy as np

from cgla_graph.comparisons import metric


@metric(unit="rad", better="less")
def turning(path, problem):
    steps = np.diff(path, axis=0)
    angles = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    return np.abs(np.diff(angles)).sum()


@metric(better="more", name="room")
def distance_from_threats(path, problem):
    return min(np.hypot(*(path - (t.x, t.y)).T).min() for t in problem.field.threats)


def dies(path, problem):
    os._exit(3)


def raises(path, problem):
    raise ValueError("no such number")
"""
SOLVERS = ("straight-line", "cgla", "eight-direction")


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "mine.py"
    file.write_text(FILE, encoding="utf-8")
    return file


def turning(path: np.ndarray) -> float:
    steps = np.diff(path, axis=0)
    units = steps / np.hypot(*steps.T)[:, None]
    return float(np.arccos(np.clip((units[1:] * units[:-1]).sum(axis=1), -1.0, 1.0)).sum())


def test_metrics_are_in_every_file_and_table(mine: Path, cgla: Callable[..., Any]) -> None:
    asked = ["compare", "one-threat", "--solvers", ",".join(SOLVERS), "--metrics", "./mine.py", "--no-certificate"]
    shown = cgla(*asked, "--out", "results", "--pictures", 0).out
    assert "turning, rad" in shown
    assert "room" in shown
    with (mine.parent / "results" / "rows.csv").open(encoding="utf-8", newline="") as lines:
        rows = {one["solver"]: one for one in csv.DictReader(lines)}
    for line in (mine.parent / "results" / "study.jsonl").read_text(encoding="utf-8").splitlines():
        made = json.loads(line)
        if made["kind"] == "run":
            path = np.array(made["path"])
            assert float(rows[made["key"][1]]["turning"]) == pytest.approx(turning(path), abs=1e-6)
    results = cgla("results", "results", "--runs", "--export", "table.tex", "--export", "rows.jsonl").out
    assert "rank by turning" in results
    tex = (mine.parent / "table.tex").read_text()
    assert "rank by room" in tex
    assert re.search(r"room: median over the scenarios of the metric room.*more is better", tex)
    assert "room" in json.loads((mine.parent / "rows.jsonl").read_text().splitlines()[0])
    page = (mine.parent / "results" / "report.html").read_text(encoding="utf-8")
    assert page.count("turning, rad") >= 2
    # resumed with the same metrics, refused with others
    assert cgla(*asked, "--out", "results", "--resume").code == 0
    mine.write_text(FILE.replace("np.abs(", "2.0 * np.abs("), encoding="utf-8")
    assert "metric 'turning' is not the one" in cgla(*asked, "--out", "results", "--resume").err
    assert "metric 'turning' is not the one" in cgla(*asked[:4], "--no-certificate", "--out", "results", "--resume").err


def test_solvers_are_ranked_by_a_metric_in_its_direction() -> None:
    @metric(better="more", name="[red]far")
    def length(path: np.ndarray, problem: cg.Problem) -> float:
        return problem.evaluate(path).length

    study = Study(["one-threat", "trap"], SOLVERS, tolerance=None, metrics=[length])  # type: ignore[list-item]
    runs = list(run_study(study, workers=0))
    assert all(run.measures[0].value == pytest.approx(run.solution.length) for run in runs if len(run.solution.path))
    found = {one.solver: one.metrics[0] for one in standings(runs)}
    for scenario in study.scenarios:
        lengths = {run.solver: run.solution.length for run in runs if run.scenario is scenario}
        if all(np.isfinite(value) for value in lengths.values()):
            longest = max(lengths, key=lambda name: lengths[name])
            assert found[longest].average_rank < found["straight-line"].average_rank
    assert sum(one.average_rank for one in found.values()) == pytest.approx(6.0)


def test_a_metric_that_fails_says_so_and_harms_no_run(mine: Path) -> None:
    names = ["mine.py:dies", "mine.py:raises", "mine.py:turning"]
    study = Study(["one-threat"], ["cgla"], tolerance=None, metrics=read_metrics(names))  # type: ignore[list-item]
    (run,) = run_study(study, workers=0)
    assert [np.isnan(one.value) for one in run.measures] == [True, True, False]
    assert "metric dies: " in run.solution.message
    assert "metric raises: ValueError: no such number" in run.solution.message
    assert run.solution.status.has_path
    found = leaderboard_of([run])
    assert [one.average_rank for one in found[0].metrics] == pytest.approx([np.nan, np.nan, 1.0], nan_ok=True)
    notes = "\n".join(leaderboard_notes(found))
    assert "dies: the metric has no value on 1 of 1 path;" in notes
    assert "turning: the metric has no value" not in notes


@pytest.mark.parametrize(
    ("text", "name", "says"),
    [
        (FILE, "mine.py:none", "has no none; it has"),
        (FILE, "mine.py:np", "a metric is"),
        ("x = 1\n", "mine.py", "has no metric; mark a function by @metric"),
        (None, "other.py", "no such file"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(mine: Path, text: str | None, name: str, says: str) -> None:
    if text is not None:
        mine.write_text(text, encoding="utf-8")
    with pytest.raises(CglaError, match=says):
        read_metrics([name])


def test_names_that_no_table_can_have_are_refused() -> None:
    for name, says in (("cost", "name of a column"), ("two\nlines", "no name for a table"), ("x" * 41, "no name")):

        @metric(name=name)
        def mine(path: np.ndarray, problem: cg.Problem) -> float:
            return float(len(path))

        with pytest.raises(CglaError, match=says):
            Study(["one-threat"], ["cgla"], metrics=[mine])  # type: ignore[list-item]


def test_an_interrupted_study_of_own_code_is_resumed_by_the_same_command(mine: Path) -> None:
    def note(*metrics: str) -> str:
        study = Study(["one-threat"], ["cgla"], tolerance=None, metrics=read_metrics(metrics))
        done = study_run.Compared(left=1)
        return study_run.kept_note(study_run.Request(study), study_run.RunOptions(folder=mine.parent / "out"), done)

    assert note("mine.py:turning").endswith("(the same command with --resume goes on)")
    assert "(cgla compare --resume --out " in note()

"""OMPL's benchmark database: it holds the runs of the study, and Planner Arena and OMPL's scripts open it."""

import dataclasses
import importlib.util
import math
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studies_small import Answers, add_run, by_number, found, runs_of, small_study, write_study

from cgla_graph.comparisons.results.ompl_database import OMPL_STATUS, STATUS, ompl_database
from cgla_graph.comparisons.study import provenance
from cgla_graph.comparisons.study.provenance import Revision, session
from cgla_graph.comparisons.study.store import StudyStore, load
from cgla_graph.model.solution import Solution, Status, TracePoint

OMPL = importlib.util.find_spec("ompl")
STUDY = small_study(["first", "second"], ["prm-a", "straight", "prm-b"], title="Any runs")
RUNS = runs_of(STUDY)
FILE = "study.db"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "out"


def rows(path: Path, query: str) -> list[Any]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(query).fetchall()


def written(folder: Path) -> Path:
    """Write the database of all runs of a study beside it."""
    stored = load(folder)
    (folder / FILE).write_bytes(ompl_database(stored, stored.runs))
    return folder / FILE


def write_database(folder: Path, answers: Answers = by_number, first: int | None = None) -> None:
    write_study(folder, STUDY, answers, first)
    written(folder)


BASE = {
    "experiments": "id name totaltime timelimit memorylimit runcount version hostname cpuinfo date seed setup",
    "plannerConfigs": "id name settings",
    "enums": "name value description",
    "runs": "id experimentid plannerid",
    "progress": "runid time",
}


def test_the_five_tables_begin_as_those_of_ompl(folder: Path) -> None:
    write_database(folder)
    for table, columns in BASE.items():
        there = [name for _, name, *_ in rows(folder / FILE, f"PRAGMA table_info({table})")]
        assert there[: len(columns.split())] == columns.split()
        if table not in {"runs", "progress"}:
            # OMPL's script inserts without naming columns, and Planner Arena draws no progress where there are more
            assert len(there) == len(columns.split())


def test_what_others_plot(folder: Path) -> None:
    nan, inf = math.nan, math.inf
    trace = (
        TracePoint(0.0, 1, inf), TracePoint(0.25, 2, 9.0), TracePoint(0.25, 3, 8.0), TracePoint(0.5, 5, 7.0),
        TracePoint(nan, 5, 6.5), TracePoint(0.75, 6, 7.5),
    )  # fmt: skip
    path = np.array([(0.1, 0.1), (0.2, 0.2), (0.9, 0.9)])
    good = Solution(
        Status.FOUND, path=path, cost=6.0, length=5.0, risk=0.5, clearance=inf, lower_bound=4.0, seconds=1.0,
        build_seconds=0.5, evaluations=10, trace=trace,
    )  # fmt: skip
    bad = dataclasses.replace(good, status=Status.INFEASIBLE, lower_bound=nan, seconds=nan)
    with StudyStore.create(folder, STUDY) as store:
        add_run(store, dataclasses.replace(RUNS[0], solution=good, megabytes=12.5))
        add_run(store, dataclasses.replace(RUNS[2], solution=bad))
        add_run(store, dataclasses.replace(RUNS[3], solution=Solution(Status.TIMED_OUT, seconds=600.0), megabytes=nan))
    written(folder)
    plotted = rows(
        folder / FILE,
        "SELECT name, runs.time, memory, description, solved, correct_solution, solution_length, best_cost, risk, "
        "clearance, lower_bound, gap, seconds, build_seconds, evaluations, waypoints, seed FROM runs "
        "JOIN plannerConfigs ON plannerConfigs.id = plannerid "
        "JOIN (SELECT value, description FROM enums WHERE name = 'status') ON value = status ORDER BY runs.id",
    )
    assert plotted == [
        ("prm-a", 1.5, 12.5, "found", 1, 1, 5.0, 6.0, 0.5, None, 4.0, 0.5, 1.0, 0.5, 10, 3, 1),
        ("straight", None, 1.5, "infeasible", 0, 0, *[None] * 6, None, 0.5, 10, 0, None),
        ("prm-b", 600.0, None, "timed-out", 0, 0, *[None] * 6, 600.0, 0.0, 0, 0, 1),
    ]
    # building counts, a moment has one row, costs do not rise, and the end is there
    expected = [(1, 0.75, 8.0, 3), (1, 1.0, 7.0, 5), (1, 1.25, 7.0, 6), (1, 1.5, 6.0, 10)]
    assert rows(folder / FILE, "SELECT runid, time, best_cost, evaluations FROM progress ORDER BY 1, 2") == expected
    ((total, limit, memory, count, version, seed),) = rows(
        folder / FILE,
        "SELECT totaltime, timelimit, memorylimit, runcount, version, seed FROM experiments WHERE name = 'first'",
    )
    assert (total, limit, memory, count, seed) == (601.5, 600.0, 4096.0, 1, "1, 2")
    assert version == session(1).label


def test_every_status_has_a_number_of_its_own_apart_from_those_of_ompl() -> None:
    assert set(STATUS) == set(Status)
    numbers = [*STATUS.values(), *range(len(OMPL_STATUS))]
    assert len(set(numbers)) == len(numbers)


def test_runs_of_another_version_are_an_experiment_of_their_own(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that Planner Arena compares versions, in the order of their commits."""
    runs = iter(RUNS)
    for count, start in ((9, StudyStore.create), (10, StudyStore.resume), (9, StudyStore.resume)):
        tree = Revision(f"{count:02}" * 20, count, dirty=False)
        monkeypatch.setattr(provenance, "revision", lambda _, tree=tree: tree)
        with start(folder, STUDY) as store:
            add_run(store, next(runs))
            add_run(store, next(runs))
    written(folder)
    versions = rows(
        folder / FILE,
        "SELECT experiments.name, version, COUNT(*), runcount FROM experiments "
        "JOIN runs ON experimentid = experiments.id GROUP BY experiments.id ORDER BY experiments.id",
    )
    nine, ten = (
        f"CGLA-Graph {session(1).version}+{count}.g{f'{count:02}' * 4}{0 if count == 9 else 1}" for count in (9, 10)
    )
    assert versions == [("first", nine, 3, 2), ("first", ten, 2, 1), ("second", nine, 1, 1)]
    assert planner_arena(folder / FILE)["versions"] == [nine, ten]
    assert [run.number for run in load(folder).runs] == [1, 2, 3, 4, 5, 6]


def planner_arena(path: Path) -> dict[str, Any]:
    """Demand what Planner Arena's loader and plots do (plannerarena 1.0, database.py, performance.py, progress.py)."""
    with closing(sqlite3.connect(path)) as connection:
        tables = {}
        for table in BASE:
            cursor = connection.execute(f"SELECT * FROM {table}")  # noqa: S608 - names of this file
            tables[table] = ([column[0].replace("_", " ") for column in cursor.description], cursor.fetchall())
    heads, experiments = tables["experiments"]
    # each column is of one kind, or its table cannot be made; runs and progress are numbers to plot
    for table, (columns, content) in tables.items():
        for at, column in enumerate(columns):
            kinds = {type(row[at]) for row in content} - {type(None)}
            assert len(kinds) <= 1, (table, column)
            if table in {"runs", "progress"}:
                assert kinds <= {int, float}, (table, column)
    parameters = heads[12:]
    # problem_parameter_filter asks progress for each of them, which has none
    assert parameters == []
    versions = {row[heads.index("version")] for row in experiments}
    assert None not in versions

    def version_key(version: str) -> tuple[object, ...]:
        import re  # noqa: PLC0415 - as there

        return tuple(int(part) if part.isdigit() else part for part in re.split(r"(\d+)", version))

    enums = {(name, value): description for name, value, description in tables["enums"][1]}
    run_heads, runs = tables["runs"]
    statuses = [enums["status", row[run_heads.index("status")]] for row in runs if row[3] is not None]
    planners = {key: name for key, name, _ in tables["plannerConfigs"][1]}
    assert all(row[1] in {one[0] for one in experiments} and row[2] in planners for row in runs)
    numbers = {row[0] for row in runs}
    assert all(row[0] in numbers and row[1] is not None for row in tables["progress"][1])
    return {
        "versions": sorted(versions, key=version_key),
        "attributes": run_heads[3:],
        "progress": tables["progress"][0][2:],
        "statuses": statuses,
    }


def test_planner_arena_takes_it(folder: Path) -> None:
    def answers(scenario: str, solver: int, seed: int | None) -> Solution:
        del scenario
        trace = tuple(TracePoint(0.1 * step, step, 5.0 - step) for step in range(3))
        return dataclasses.replace(found(2.0 + solver), trace=trace if seed else (), lower_bound=math.nan)

    write_database(folder, answers)
    seen = planner_arena(folder / FILE)
    assert {"time", "memory", "status", "solved", "correct solution", "solution length", "best cost"} <= {
        *seen["attributes"]
    }
    assert seen["progress"] == ["best cost", "evaluations"]
    assert set(seen["statuses"]) == {"found"}
    with closing(sqlite3.connect(folder / FILE)) as connection:
        connection.execute("ALTER TABLE experiments ADD k REAL")
    with pytest.raises(AssertionError):
        planner_arena(folder / FILE)


OMPL_LOG = """
import sys
from ompl import base, geometric, tools
space = base.RealVectorStateSpace(2)
bounds = base.RealVectorBounds(2)
bounds.setLow(0)
bounds.setHigh(1)
space.setBounds(bounds)
setup = geometric.SimpleSetup(space)
setup.setStateValidityChecker(lambda state: True)
start, goal = space.allocState(), space.allocState()
start[0] = start[1] = 0.1
goal[0] = goal[1] = 0.9
setup.setStartAndGoalStates(start, goal)
benchmark = tools.Benchmark(setup, "theirs")
benchmark.addPlanner(geometric.RRTstar(setup.getSpaceInformation()))
request = tools.Request()
request.maxTime, request.maxMem, request.runCount, request.timeBetweenUpdates = 0.1, 1000.0, 2, 0.02
request.displayProgress = False
benchmark.benchmark(request)
benchmark.saveResultsToFile(sys.argv[1])
"""

OMPL_SCRIPT = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("script", sys.argv[1])
script = importlib.util.module_from_spec(spec)
spec.loader.exec_module(script)
script.readBenchmarkLog(sys.argv[2], [sys.argv[3]], False)
script.computeViews(sys.argv[2], False)
script.saveAsMysql(sys.argv[2])
"""


@pytest.mark.ompl
@pytest.mark.skipif(OMPL is None, reason="OMPL is not installed")
def test_ompls_own_script_works_on_it(folder: Path, tmp_path: Path) -> None:
    assert OMPL is not None
    assert OMPL.origin is not None
    write_database(folder, first=6)
    path, log = folder / FILE, tmp_path / "their.log"
    script = Path(OMPL.origin).parent / "_benchmark_statistics.py"
    for words in ([OMPL_LOG, log], [OMPL_SCRIPT, script, path, log]):
        program = [sys.executable, "-c", *map(str, words)]
        # OMPL leaves a log where it runs
        done = subprocess.run(program, capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    # theirs is beside ours, and means what it meant
    mixed = rows(
        path,
        "SELECT experiments.name, enums.description, COUNT(*) FROM runs "
        "JOIN experiments ON experiments.id = experimentid "
        "JOIN enums ON enums.name = 'status' AND value = status GROUP BY 1, 2 ORDER BY 1",
    )
    assert mixed == [("first", "found", 5), ("second", "found", 1), ("theirs", "Exact solution", 2)]
    best = rows(path, "SELECT plannerid, avg_solved FROM bestPlannerConfigsPerExperiment")
    assert (1, 1.0) in best
    dump = path.with_suffix(".mysql").read_text(encoding="utf-8")
    assert dump.count("INSERT INTO runs") == 8


@pytest.mark.ompl
@pytest.mark.skipif(OMPL is None, reason="OMPL is not installed")
def test_the_numbers_of_ompls_outcomes_are_its_own() -> None:
    from ompl import base  # noqa: PLC0415 - where it is installed

    names = ["UNKNOWN", "INVALID_START", "INVALID_GOAL", "UNRECOGNIZED_GOAL_TYPE", "TIMEOUT", "APPROXIMATE_SOLUTION"]
    names += ["EXACT_SOLUTION", "CRASH", "ABORT", "INFEASIBLE"]
    values = [getattr(base.PlannerStatus, name) for name in names]
    assert [int(getattr(value, "value", value)) for value in values] == list(range(len(OMPL_STATUS)))
    for value, description in zip(values, OMPL_STATUS, strict=True):
        # OMPL 2.0 has no words for the last two
        assert base.PlannerStatus(value).asString() in {description, "Unknown status"}

"""
Runs as a benchmark database of OMPL (SQLite), which Planner Arena and OMPL's own scripts open.

Its five tables are those of Moll, Șucan and Kavraki, "Benchmarking Motion Planning Algorithms", IEEE Robotics &
Automation Magazine 22(3), 2015, with their columns in their order. Planner Arena offers each further column of ``runs``
and ``progress`` for plotting: so ours are numbers. It takes each further column of ``experiments`` for a parameter to
select by, and then draws no progress: so there is none, and `k` and the like are told in ``setup``. OMPL writes NULL
for NaN and infinity, and knows one row of ``progress`` per moment.
"""

import math
import sqlite3
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import closing
from types import MappingProxyType
from typing import Any

import shapely

from cgla_graph._text import json_number
from cgla_graph.comparisons.statistics.intervals import progress
from cgla_graph.comparisons.study.documents import dumps, entrant_document
from cgla_graph.comparisons.study.provenance import Session, visible
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.store import Stored
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario

#: Marks the file as ours ("CGLA"): the field of SQLite's header for that.
APPLICATION_ID = 0x43474C41
#: OMPL's outcomes of a run (ompl::base::PlannerStatus), by number, so that its logs can be added to the file.
OMPL_STATUS = (
    "Unknown status",
    "Invalid start",
    "Invalid goal",
    "Unrecognized goal type",
    "Timeout",
    "Approximate solution",
    "Exact solution",
    "Crash",
    "Abort",
    "Infeasible",
)
#: Ours stand apart from these; a number, once given, stays.
STATUS: Mapping[Status, int] = MappingProxyType(
    {
        Status.OPTIMAL: 100,
        Status.FOUND: 101,
        Status.NO_PATH: 102,
        Status.NOT_FOUND: 103,
        Status.INFEASIBLE: 104,
        Status.UNSUPPORTED: 105,
        Status.FAILED: 106,
        Status.TIMED_OUT: 107,
        Status.OUT_OF_MEMORY: 108,
        Status.CRASHED: 109,
        Status.UNAVAILABLE: 110,
        Status.STUCK: 111,
    }
)

_TABLES = """
CREATE TABLE experiments (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512),
    totaltime REAL, timelimit REAL, memorylimit REAL, runcount INTEGER,
    version VARCHAR(128), hostname VARCHAR(1024), cpuinfo TEXT,
    date DATETIME, seed VARCHAR(24), setup TEXT);
CREATE TABLE plannerConfigs (id INTEGER PRIMARY KEY AUTOINCREMENT,
    name VARCHAR(512) NOT NULL, settings TEXT);
CREATE TABLE enums (name VARCHAR(512), value INTEGER, description TEXT, PRIMARY KEY (name, value));
CREATE TABLE runs (id INTEGER PRIMARY KEY AUTOINCREMENT, experimentid INTEGER, plannerid INTEGER,
    time REAL, memory REAL, status ENUM, solved BOOLEAN, correct_solution BOOLEAN,
    solution_length REAL, best_cost REAL,
    risk REAL, clearance REAL, lower_bound REAL, claimed_bound REAL, gap REAL,
    seconds REAL, build_seconds REAL, evaluations INTEGER, waypoints INTEGER, seed INTEGER,
    FOREIGN KEY (experimentid) REFERENCES experiments(id) ON DELETE CASCADE,
    FOREIGN KEY (plannerid) REFERENCES plannerConfigs(id) ON DELETE CASCADE);
CREATE TABLE progress (runid INTEGER, time REAL, best_cost REAL, evaluations INTEGER,
    PRIMARY KEY (runid, time),
    FOREIGN KEY (runid) REFERENCES runs(id) ON DELETE CASCADE);
"""
#: The columns of ``runs`` behind OMPL's own three.
RUN_COLUMNS = (
    *("time", "memory", "status", "solved", "correct_solution", "solution_length", "best_cost"),
    *("risk", "clearance", "lower_bound", "claimed_bound", "gap"),
    *("seconds", "build_seconds", "evaluations", "waypoints", "seed"),
)
#: Greatest whole number of SQLite, and greatest one that a float holds exactly.
_MOST = 2**63 - 1
_MOST_EXACT = 2**53


def ompl_database(stored: Stored, runs: Sequence[Run]) -> bytes:
    """
    Write runs of a study, what they belong to and their progress, as the bytes of a database.

    Runs of one scenario are one experiment for each version and machine that made some, so that Planner Arena compares
    versions.
    """
    sessions = {session.number: session for session in stored.sessions}
    experiments: dict[tuple[str, str, str], int] = {}
    planners: dict[str, int] = {}
    counts: Counter[tuple[int, int]] = Counter()
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as database:
        database.executescript(f"BEGIN; {_TABLES}")
        numbered = [*enumerate(OMPL_STATUS), *((number, status.label) for status, number in STATUS.items())]
        database.executemany("INSERT INTO enums VALUES ('status', ?, ?)", numbered)
        for run in sorted(runs, key=lambda run: run.number or 0):
            session = sessions[stored.session_of[run.number or 0]]
            edition = (run.scenario.name, session.label, session.host)
            if edition not in experiments:
                experiments[edition] = _insert(database, "experiments", _experiment(run.scenario, session, stored))
            if run.solver not in planners:
                planners[run.solver] = _insert(database, "plannerConfigs", _planner(run.solver, stored))
            pair = experiments[edition], planners[run.solver]
            row = run_row(run)
            _insert(
                database,
                "runs",
                {"id": run.number, "experimentid": pair[0], "plannerid": pair[1]}
                | dict(zip(RUN_COLUMNS, row, strict=True)),
            )
            steps = [(run.number, *step) for step in progress_rows(run.solution)]
            database.executemany("INSERT INTO progress VALUES (?, ?, ?, ?)", steps)
            counts[pair] += 1
            database.execute(
                "UPDATE experiments SET totaltime = totaltime + ?, runcount = MAX(runcount, ?) WHERE id = ?",
                (row[0] or 0.0, counts[pair], pair[0]),
            )
        database.execute("COMMIT")
        database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
        return database.serialize()


def _insert(database: sqlite3.Connection, table: str, row: Mapping[str, Any]) -> int:
    marks = ", ".join("?" * len(row))
    done = database.execute(f"INSERT INTO {table} ({', '.join(row)}) VALUES ({marks})", tuple(row.values()))  # noqa: S608 - names of ours
    return done.lastrowid or 0


def _experiment(scenario: AnyScenario, session: Session, stored: Stored) -> dict[str, Any]:
    return {
        "name": visible(scenario.name),
        "totaltime": 0.0,
        "timelimit": json_number(stored.limits.seconds),
        "memorylimit": json_number(stored.limits.megabytes),
        "runcount": 0,
        "version": session.label,
        "hostname": session.host,
        "cpuinfo": session.machine,
        "date": session.started.replace("T", " ").partition("+")[0],
        "seed": _listed(stored.seeds),
        "setup": visible(_setup(scenario)),
    }


def _planner(label: str, stored: Stored) -> dict[str, Any]:
    document = entrant_document(stored.entrants[label])
    told = {key: value for key, value in document.items() if key != "label" and value}
    return {"name": visible(label), "settings": dumps(told)}


def run_row(run: Run) -> tuple[float | int | None, ...]:
    """
    Return what others plot of a run, a value for each of `RUN_COLUMNS`.

    Times are in seconds (``time`` is that of building the graph and of solving), memory in units of 2**20 bytes, the
    others in map units. NaN, infinity and the numbers of an infeasible path are None.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> run = Run(load_scenario("paper"), "mine", 7, False, Solution(Status.NOT_FOUND, seconds=1.0, build_seconds=0.5))
    >>> dict(zip(RUN_COLUMNS, run_row(run)))["time"]
    1.5
    """
    solution = run.solution
    is_path = solution.status.has_path
    of_path = (solution.length, solution.cost, solution.risk, solution.clearance)
    length, cost, risk, clearance = (json_number(value) if is_path else None for value in of_path)
    return (
        json_number(solution.total_seconds),
        json_number(run.megabytes),
        STATUS[solution.status],
        # both alike: a path that may not be flown solves nothing
        int(is_path),
        int(is_path),
        length,
        cost,
        risk,
        clearance,
        json_number(solution.lower_bound),
        json_number(solution.claimed_bound),
        json_number(solution.gap) if is_path else None,
        json_number(solution.seconds),
        json_number(solution.build_seconds),
        _whole(solution.evaluations),
        len(solution.nodes or solution.path) if is_path else 0,
        _whole(run.seed),
    )


def progress_rows(solution: Solution) -> list[tuple[float, float, int]]:
    """
    Return the best cost over time that others plot: seconds, cost and evaluations, one row a moment.

    Examples
    --------
    >>> from cgla_graph.model.solution import TracePoint
    >>> trace = (TracePoint(0.1, 5, 4.0), TracePoint(0.1, 6, 3.0))
    >>> progress_rows(Solution(Status.FOUND, cost=2.0, seconds=1.0, evaluations=9, trace=trace))
    [(0.1, 3.0, 6), (1.0, 2.0, 9)]
    """
    if not solution.trace:
        return []
    counts = (solution.evaluations, *(point.evaluations for point in solution.trace))
    if not all(abs(count) <= _MOST_EXACT for count in counts):
        return []
    steps = progress(solution)
    # of one moment, the last row counts, which has the least cost
    by_moment = {seconds: (cost, count) for seconds, count, cost in steps.tolist() if math.isfinite(seconds + cost)}
    return [(seconds, cost, int(count)) for seconds, (cost, count) in by_moment.items()]


def _whole(value: int | None) -> int | None:
    """Return a whole number that fits; else None."""
    return int(value) if value is not None and abs(value) <= _MOST else None


def _setup(scenario: AnyScenario) -> str:
    if isinstance(scenario, GraphScenario):
        source, target = scenario.ends
        return "\n".join(filter(None, [scenario.full_title, f"from {source} to {target}", scenario.notes]))
    problem, (columns, rows) = scenario.problem, scenario.lattice.shape
    corners = 0 if problem.no_fly is None else int(shapely.get_num_coordinates(problem.no_fly))
    field = problem.field
    rasters = [f"raster {number}: {raster}" for number, raster in enumerate(field.rasters)]
    lines = [
        scenario.full_title,
        f"from {problem.start} to {problem.goal} within {problem.bounds}, k = {problem.k:g}",
        f"threats: {len(field.threats)}, corners of the no-fly area: {corners}",
        *rasters,
        f"lattice: {columns} x {rows} points, {scenario.lattice.kind}",
        scenario.notes,
    ]
    return "\n".join(line for line in lines if line)


def _listed(seeds: Sequence[int]) -> str:
    """Write seeds into the 24 characters that OMPL has for them."""
    text = ", ".join(map(str, seeds))
    return text if len(text) <= 24 else f"{text[:23]}…"  # noqa: PLR2004

"""
The tables of a study's database, and how an older file becomes a newer one.

The first five are those of the OMPL benchmark database (Moll, Șucan, Kavraki, "Benchmarking Motion Planning
Algorithms", IEEE Robotics & Automation Magazine 22(3), 2015), with its columns in its order, so that Planner Arena and
OMPL's scripts open the file. Two rules of theirs shape what follows:

- Planner Arena offers each further column of ``runs`` and ``progress`` for plotting: so ours are numbers. It takes each
  further column of ``experiments`` for a parameter to select by, and then draws no progress (its table of that lacks
  the parameter): so there is none, and `k` and the like are told in ``setup``.
- OMPL writes NULL for NaN and infinity, and knows one row of ``progress`` per moment. So the five tables hold what is
  to be plotted; what restores each answer to the last bit (path, trace, settings, message) is in tables of our own,
  which their readers ignore.
"""

import sqlite3
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from cgla_graph.errors import OutputError, StudyError
from cgla_graph.model.solution import Status

#: Marks the file as ours ("CGLA"): the field of SQLite's header for that.
APPLICATION_ID = 0x43474C41
#: Counts changes of the tables.
VERSION = 1

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

TABLES = """
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
    risk REAL, clearance REAL, lower_bound REAL, gap REAL,
    seconds REAL, build_seconds REAL, evaluations INTEGER, waypoints INTEGER, seed INTEGER,
    FOREIGN KEY (experimentid) REFERENCES experiments(id) ON DELETE CASCADE,
    FOREIGN KEY (plannerid) REFERENCES plannerConfigs(id) ON DELETE CASCADE);
CREATE TABLE progress (runid INTEGER, time REAL, best_cost REAL, evaluations INTEGER,
    PRIMARY KEY (runid, time),
    FOREIGN KEY (runid) REFERENCES runs(id) ON DELETE CASCADE);

CREATE TABLE study (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE sessions (id INTEGER PRIMARY KEY AUTOINCREMENT, started TEXT NOT NULL, version TEXT NOT NULL,
    git TEXT NOT NULL, host TEXT NOT NULL, machine TEXT NOT NULL, packages TEXT NOT NULL,
    workers TEXT NOT NULL, command TEXT NOT NULL, source TEXT NOT NULL);
CREATE TABLE areas (digest TEXT PRIMARY KEY, wkb BLOB NOT NULL);
CREATE TABLE scenarios (id INTEGER PRIMARY KEY, place INTEGER NOT NULL, document TEXT NOT NULL,
    area TEXT REFERENCES areas(digest), certificate TEXT);
CREATE TABLE contenders (id INTEGER PRIMARY KEY REFERENCES plannerConfigs(id), place INTEGER NOT NULL,
    document TEXT NOT NULL);
CREATE TABLE editions (experiment INTEGER PRIMARY KEY REFERENCES experiments(id) ON DELETE CASCADE,
    scenario INTEGER NOT NULL REFERENCES scenarios(id));
CREATE TABLE cells (id INTEGER PRIMARY KEY, place INTEGER NOT NULL,
    scenario INTEGER NOT NULL REFERENCES scenarios(id), contender INTEGER NOT NULL REFERENCES contenders(id),
    seed TEXT NOT NULL, UNIQUE (scenario, contender, seed));
CREATE TABLE answers (run INTEGER PRIMARY KEY REFERENCES runs(id) ON DELETE CASCADE,
    cell INTEGER NOT NULL UNIQUE REFERENCES cells(id), session INTEGER NOT NULL REFERENCES sessions(id),
    document TEXT NOT NULL, path BLOB NOT NULL, trace BLOB NOT NULL);
"""

#: Changes the tables of an older version, within a transaction that is begun already, into those of the next one.
Migration = Callable[[sqlite3.Connection], None]
#: By the version that they start from. There has been no other version yet.
MIGRATIONS: dict[int, Migration] = {}


def forget_unavailable(connection: sqlite3.Connection) -> None:
    """Take out the runs of solvers that lacked a package: they were never made."""
    lacking = "SELECT id FROM runs WHERE status = ?"
    number = (STATUS[Status.UNAVAILABLE],)
    connection.execute(f"DELETE FROM answers WHERE run IN ({lacking})", number)  # noqa: S608 - words of ours
    connection.execute("DELETE FROM runs WHERE status = ?", number)


def name_statuses(connection: sqlite3.Connection) -> None:
    """Say what the numbers of statuses mean, as far as the file does not say so yet."""
    values = [*enumerate(OMPL_STATUS), *((number, status.label) for status, number in STATUS.items())]
    connection.executemany("INSERT OR IGNORE INTO enums VALUES ('status', ?, ?)", values)


def lay(connection: sqlite3.Connection) -> None:
    """Make the tables of an empty database, within a transaction that is begun already."""
    for statement in TABLES.split(";"):
        connection.execute(statement)
    name_statuses(connection)
    connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    connection.execute(f"PRAGMA user_version = {VERSION}")


def version_of(connection: sqlite3.Connection, path: Path) -> int:
    """
    Return the version of a database's tables.

    Raises
    ------
    StudyError
        If it is not the database of a study, or one of a newer version.
    """
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if application != APPLICATION_ID or version < 0:
        msg = f"{path}: is no database of a study (another program's, or an empty one); choose another folder"
        raise StudyError(msg)
    if version > VERSION:
        msg = f"{path}: was written by a newer cgla-graph (tables {version}, known {VERSION}); update this one"
        raise StudyError(msg)
    return int(version)


def migrate(connection: sqlite3.Connection, path: Path) -> None:
    """
    Bring the tables up to date, in one transaction: all or nothing.

    Parameters
    ----------
    connection
        In autocommit mode; to a file, or to a copy of one in memory.
    path
        What error messages call it.

    Raises
    ------
    StudyError
        As `version_of`; or if there is no way from its version to this one. Nothing is changed then.
    """
    version = version_of(connection, path)
    missing = [step for step in range(version, VERSION) if step not in MIGRATIONS]
    if missing:
        msg = (
            f"{path}: its tables are of version {version}, and none can be made of version {missing[0]} any more; "
            f"read it with the cgla-graph that wrote it, or run the study anew in another folder"
        )
        raise StudyError(msg)
    if version == VERSION:
        return
    connection.execute("BEGIN IMMEDIATE")
    try:
        for step in range(version, VERSION):
            MIGRATIONS[step](connection)
        connection.execute(f"PRAGMA user_version = {VERSION}")
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise


def migrate_file(connection: sqlite3.Connection, path: Path) -> None:
    """
    Bring the tables of a file up to date, after a copy of it (``study.db.v0`` of version 0) was put beside it.

    Raises
    ------
    StudyError
        As `migrate`.
    OutputError
        If the copy cannot be written, or is there already.
    """
    version = version_of(connection, path)
    if version == VERSION:
        return
    if all(step in MIGRATIONS for step in range(version, VERSION)):
        _copy(connection, path.with_name(f"{path.name}.v{version}"))
    migrate(connection, path)


def _copy(connection: sqlite3.Connection, copy: Path) -> None:
    """Copy a database into a new file."""
    if copy.exists():
        msg = f"{copy}: is there already, and would be overwritten; move it away"
        raise OutputError(msg)
    target = sqlite3.connect(copy)
    try:
        # not the file's bytes: closing it would drop the locks that this process has on it
        connection.backup(target)
        target.close()
    except BaseException as error:
        target.close()
        copy.unlink(missing_ok=True)
        if isinstance(error, sqlite3.Error):
            msg = f"{copy}: cannot be written: {error}; make room"
            raise OutputError(msg) from error
        raise

"""Writing a study's database: each run as it comes, in one transaction, so that nothing that is done is lost."""

import dataclasses
import json
import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from filelock import FileLock

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.files import locked, make_folder
from cgla_graph.comparisons.study import schema
from cgla_graph.comparisons.study.codec import decode, dumps
from cgla_graph.comparisons.study.documents import certificate_document
from cgla_graph.comparisons.study.entry import add_experiment, enter, visible
from cgla_graph.comparisons.study.provenance import Provenance, provenance
from cgla_graph.comparisons.study.records import RUN_COLUMNS, answer, progress_rows, run_row
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.stored import (
    FILE,
    Content,
    Session,
    Stored,
    connect,
    load,
    load_study,
    reading,
    understood,
    unreadable,
)
from cgla_graph.comparisons.study.study import Cell, Study
from cgla_graph.errors import OutputError, StudyError

__all__ = ["FILE", "Database", "Session", "Stored", "load", "load_study"]

#: What SQLite may leave beside a database.
_BESIDE = ("-wal", "-shm", "-journal")
_ADD_RUN = (
    f"INSERT INTO runs (experimentid, plannerid, {', '.join(RUN_COLUMNS)}) "  # noqa: S608 - names of ours
    f"VALUES (?, ?{', ?' * len(RUN_COLUMNS)})"
)
# another program may have added columns (OMPL's script does)
_ADD_STEP = "INSERT INTO progress (runid, time, best_cost, evaluations) VALUES (?, ?, ?, ?)"


class Database:
    """
    The one writer of a study's database (``study.db``); a context manager.

    While it is open, ``study.db.lock`` is held, so that no second process writes; readers (`load`) are welcome. What
    a method wrote is there once it returned, even if the process is killed then. Closing leaves a single file.

    Attributes
    ----------
    path
        The file.
    study
        The study with all that was ever asked for in this folder: what this session brought, then what is older.

    Examples
    --------
    >>> import tempfile
    >>> from cgla_graph.comparisons.study.entrant import Entrant
    >>> from cgla_graph.comparisons.study.runner import compare
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> study = Study([load_scenario("one-threat")], [Entrant.parse("cgla"), Entrant.parse("dijkstra")])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with Database.create(Path(folder), study) as database:
    ...         for run in compare(study.scenarios, study.entrants[:1], tolerance=None):
    ...             run = database.add(run)
    ...     stored = load(Path(folder))
    >>> [(run.number, run.solver, run.solution.status.label) for run in stored.runs], stored.is_complete
    ([(1, 'cgla', 'optimal')], False)
    """

    def __init__(self, path: Path, connection: sqlite3.Connection, lock: FileLock, origin: Provenance) -> None:
        """Take over an open database and its lock; `create` and `resume` do that."""
        self.path = path
        self._connection = connection
        self._lock = lock
        self._origin = origin
        content = Content.read(connection)
        (self._session, source) = connection.execute("SELECT id, source FROM sessions ORDER BY id DESC").fetchone()
        self.study = content.study(source)
        self._scenarios = {scenario.name: key for key, scenario in content.scenarios.items()}
        self._entrants = {entrant.label: key for key, entrant in content.entrants.items()}
        self._certificates = {content.scenarios[key].name: one for key, one in content.certificates.items()}
        self._cells, self._finished = _cells(connection, content)
        self._experiments = _editions(connection, origin)
        counts = connection.execute("SELECT experimentid, plannerid, COUNT(*) FROM runs GROUP BY 1, 2")
        self._counts = Counter({(experiment, planner): count for experiment, planner, count in counts})

    @classmethod
    def create(
        cls, folder: Path, study: Study, *, overwrite: bool = False, workers: int | str = 1, command: str = ""
    ) -> "Database":
        """
        Start the database of a study.

        Parameters
        ----------
        folder
            Where; made if it is not there.
        study
            What will be run.
        overwrite
            Replace the study that is there; never another program's file.
        workers, command
            For the record: how many processes make runs (or which cluster), and the command line.

        Raises
        ------
        OutputError
            If the folder cannot be written, another process writes the study, or there is one already.
        StudyError
            If the study names something twice, or has settings that cannot be kept.
        """
        path = make_folder(folder) / FILE
        with _until_open(locked(path)) as lock:
            if path.exists():
                _check_replaceable(path, overwrite=overwrite)
            origin = provenance()
            part = path.with_name(f".{FILE}.part")
            _remove(part)
            try:
                with _writing(path), closing(connect(part, "mode=rwc")) as connection, _transaction(connection):
                    schema.lay(connection)
                    enter(connection, study, origin, str(workers), command)
            except BaseException:
                _remove(part)
                raise
            # a log that a killed process left would be taken for the new file's
            _remove(path, keep_file=True)
            with _writing(path):
                part.replace(path)
            return cls._open(path, lock, origin)

    @classmethod
    def resume(cls, folder: Path, study: Study, *, workers: int | str = 1, command: str = "") -> "Database":
        """
        Go on with a study, which may have grown by scenarios, entrants and seeds.

        Parameters
        ----------
        folder
            Where its database is.
        study
            What is asked for now. What has the name of something that is there must be equal to it.
        workers, command
            As in `create`.

        Raises
        ------
        OutputError
            If the folder cannot be written, or another process writes the study.
        StudyError
            If there is no database, it cannot be read (see `load`), or the study does not fit it.
        """
        path = folder / FILE
        # what cannot be read is refused before anything is touched
        with reading(path) as connection, understood(path):
            Content.read(connection)
        with _until_open(locked(path)) as lock:
            origin = provenance()
            with _writing(path), closing(connect(path, "mode=rw")) as connection:
                _check_sound(connection, path)
                schema.migrate_file(connection, path)
                with _transaction(connection):
                    # the package that a solver lacked may have been installed since
                    schema.forget_unavailable(connection)
                    schema.name_statuses(connection)
                    enter(connection, study, origin, str(workers), command)
            return cls._open(path, lock, origin)

    @classmethod
    def _open(cls, path: Path, lock: FileLock, origin: Provenance) -> "Database":
        with _writing(path):
            connection = connect(path, "mode=rw")
            try:
                connection.execute("PRAGMA journal_mode = WAL")
                # what is committed outlives the process; only a power cut may take the last runs
                connection.execute("PRAGMA synchronous = NORMAL")
                connection.execute("PRAGMA foreign_keys = ON")
                with understood(path):
                    return cls(path, connection, lock, origin)
            except BaseException:
                connection.close()
                raise

    def __enter__(self) -> Self:
        """Return the database itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close it, whatever happened."""
        self.close()

    def close(self) -> None:
        """Make a single file of it, and let others write. What cannot be merged (a full disk) stays in the log."""
        try:
            with suppress(sqlite3.Error):
                self._connection.execute("PRAGMA journal_mode = DELETE")
            self._connection.close()
        finally:
            self._lock.release()

    def finished(self) -> set[Cell]:
        """Return the cells whose runs are done."""
        return set(self._finished)

    def certificates(self) -> dict[str, Certificate]:
        """Return what is proven of scenarios, by their names; without grids."""
        return dict(self._certificates)

    def add_certificate(self, scenario: str, certificate: Certificate) -> None:
        """
        Write what is proven of a scenario; it counts for all runs of it.

        Raises
        ------
        StudyError
            If the study has no such scenario.
        OutputError
            If it cannot be written; what was written before stays.
        """
        if scenario not in self._scenarios:
            msg = f"{self.path}: there is no scenario {scenario!r} in this study; start it with that one"
            raise StudyError(msg)
        document = dumps(certificate_document(certificate))
        with _writing(self.path), _transaction(self._connection):
            self._connection.execute(
                "UPDATE scenarios SET certificate = ? WHERE id = ?", (document, self._scenarios[scenario])
            )
        self._certificates[scenario] = dataclasses.replace(certificate, grids=())

    def add(self, run: Run) -> Run:
        """
        Write a run.

        Returns
        -------
        run
            With its number.

        Raises
        ------
        StudyError
            If its cell is not one of the study, or has a run already.
        OutputError
            If it cannot be written; what was written before stays, and it may be tried again.
        """
        cell = Cell(run.scenario.name, run.solver, run.seed)
        if cell not in self._cells or cell in self._finished:
            why = "has a run already" if cell in self._cells else "is not part of the study"
            msg = f"{self.path}: {cell.solver!r} on {cell.scenario!r} with seed {cell.seed} {why}; nothing was written"
            raise StudyError(msg)
        kept, published, steps = answer(run), run_row(run), progress_rows(run.solution)
        scenario, planner = self._scenarios[cell.scenario], self._entrants[cell.solver]
        with _writing(self.path), _transaction(self._connection) as connection:
            experiment = self._experiments.get(scenario)
            if experiment is None:
                experiment = add_experiment(connection, scenario, run.scenario, self.study, self._origin)
            number = connection.execute(_ADD_RUN, (experiment, planner, *published)).lastrowid
            connection.executemany(_ADD_STEP, [(number, *step) for step in steps])
            connection.execute(
                "INSERT INTO answers VALUES (?, ?, ?, ?, ?, ?)", (number, self._cells[cell], self._session, *kept)
            )
            runs_per_planner = self._counts[experiment, planner] + 1
            connection.execute(
                "UPDATE experiments SET totaltime = totaltime + ?, runcount = MAX(runcount, ?) WHERE id = ?",
                (published[0] or 0.0, runs_per_planner, experiment),
            )
        self._experiments[scenario] = experiment
        self._counts[experiment, planner] = runs_per_planner
        self._finished.add(cell)
        return dataclasses.replace(run, number=number, certificate=self._certificates.get(cell.scenario))


# What it holds


def _cells(connection: sqlite3.Connection, content: Content) -> tuple[dict[Cell, int], set[Cell]]:
    """Return the keys of all cells, and those that are done."""
    rows = connection.execute(
        "SELECT cells.id, scenario, contender, seed, run FROM cells LEFT JOIN answers ON answers.cell = cells.id"
    )
    keys, done = {}, set()
    for key, scenario, entrant, seed, run in rows:
        name, label = content.scenarios[scenario].name, content.entrants[entrant].label
        cell = Cell(name, label, decode(json.loads(seed)))
        keys[cell] = key
        if run is not None:
            done.add(cell)
    return keys, done


def _editions(connection: sqlite3.Connection, origin: Provenance) -> dict[int, int]:
    """Return the experiments of this version on this machine, by their scenarios."""
    rows = connection.execute(
        "SELECT scenario, experiment FROM editions JOIN experiments ON experiments.id = experiment "
        "WHERE version = ? AND hostname = ?",
        (origin.label, visible(origin.host)),
    )
    return dict(rows.fetchall())


# The folder


@contextmanager
def _until_open(lock: FileLock) -> Iterator[FileLock]:
    """Let go of a lock if what it was taken for failed."""
    try:
        yield lock
    except BaseException:
        lock.release()
        raise


def _check_replaceable(path: Path, *, overwrite: bool) -> None:
    if not overwrite:
        msg = (
            f"{path}: holds a study already; go on with it (--resume), replace it (--overwrite) "
            f"or choose another folder (--out)"
        )
        raise OutputError(msg)
    with suppress(OSError):
        if path.stat().st_size == 0:
            return
    try:
        with closing(connect(path, "mode=ro")) as connection:
            (application,) = connection.execute("PRAGMA application_id").fetchone()
    except sqlite3.Error as error:
        raise unreadable(path, error) from error
    if application != schema.APPLICATION_ID:
        msg = f"{path}: is no study, and is not replaced; move it away, or choose another folder (--out)"
        raise OutputError(msg)


def _check_sound(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse to write into a damaged file."""
    (verdict,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if verdict != "ok":
        what = verdict.splitlines()[-1]
        msg = f"{path}: is damaged ({what}); restore it from a copy, or run the study anew in another folder"
        raise StudyError(msg)


def _remove(path: Path, *, keep_file: bool = False) -> None:
    """Remove a database and what SQLite left beside it."""
    try:
        for ending in _BESIDE if keep_file else ("", *_BESIDE):
            path.with_name(path.name + ending).unlink(missing_ok=True)
    except OSError as error:
        msg = f"{path}: cannot be replaced: {error.strerror or error}; choose another folder (--out)"
        raise OutputError(msg) from error


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Say in one line why a database cannot be written."""
    try:
        yield
    except sqlite3.Error as error:
        words = str(error)
        remedy = "choose another folder (--out)"
        if "locked" in words:
            remedy = "another program has locked it: close that, and go on (--resume)"
        elif "full" in words or "I/O" in words:
            kept = "what was done is kept: make room, and go on (--resume)"
            remedy = kept if path.exists() else "make room, or choose another folder (--out)"
        msg = f"{path}: cannot be written: {words}; {remedy}"
        raise OutputError(msg) from error
    except OutputError:
        raise
    except OSError as error:
        msg = f"{path}: cannot be written: {error.strerror or error}; choose another folder (--out)"
        raise OutputError(msg) from error


@contextmanager
def _transaction(connection: sqlite3.Connection) -> Iterator[sqlite3.Connection]:
    """Write all of it, or nothing."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield connection
        connection.execute("COMMIT")
    except BaseException:
        # a full disk has ended it already
        if connection.in_transaction:
            connection.execute("ROLLBACK")
        raise

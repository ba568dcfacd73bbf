"""Reading a study's database: a snapshot, also while it is being written or from where nothing can be written."""

import gc
import json
import shutil
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study import schema
from cgla_graph.comparisons.study.codec import decode
from cgla_graph.comparisons.study.documents import certificate_from, entrant_from, scenario_from
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.records import Answer, restored
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.study import Study
from cgla_graph.comparisons.workers.limits import Limits
from cgla_graph.errors import StudyError
from cgla_graph.scenarios.scenario import Scenario

#: The database's name in the folder of a study.
FILE = "study.db"
#: How long another program's lock is waited for, seconds.
PATIENCE = 10.0


@dataclass(frozen=True)
class Session:
    """
    One start of a study, or one that went on with it.

    Attributes
    ----------
    number
        From 1.
    started
        When, ISO 8601, UTC.
    version
        Of this package.
    git
        Commit of its source tree, with ``(dirty)`` where files differed from it; empty where that was no checkout.
    host, machine
        Name of the machine that led it, and a description in one line.
    packages
        Versions of the packages in use, by name.
    workers
        How many processes made runs, or the cluster that did.
    command
        The command line.
    source
        The text of the study's file.
    """

    number: int
    started: str
    version: str
    git: str
    host: str
    machine: str
    packages: Mapping[str, str]
    workers: str
    command: str
    source: str

    @property
    def revision(self) -> str:
        """The commit, as short as people write it; empty as `git` may be."""
        commit, *note = self.git.split(maxsplit=1)[:2] or [""]
        return " ".join([commit[:12], *note])


@dataclass(frozen=True, eq=False)
class Stored:
    """
    What a study's database holds at one moment.

    Attributes
    ----------
    folder
        Where it is.
    title
        What the report calls it.
    runs
        Those that are done, in the order of the study's cells: by scenario, solver and seed, whenever they were made.
        Runs of one scenario share it.
    scenarios
        All of the study, those without runs too.
    solvers
        Labels of all entrants.
    n_cells
        How many runs there will be.
    sessions
        How it was started, and gone on with.
    limits
        Of each run.
    """

    folder: Path
    title: str
    runs: list[Run]
    scenarios: list[Scenario]
    solvers: list[str]
    n_cells: int
    sessions: list[Session]
    limits: Limits

    @property
    def is_complete(self) -> bool:
        """Whether no run is left to be made."""
        return len(self.runs) >= self.n_cells


def load(folder: Path) -> Stored:
    """
    Read what a study's database holds, while another process may write it. Nothing in the folder is changed.

    Raises
    ------
    StudyError
        If there is no database, or it cannot be read, is damaged, another program's, or of a newer version.

    Examples
    --------
    >>> try:
    ...     load(Path("no-such-folder"))
    ... except StudyError as error:
    ...     print(str(error).split(";")[0])
    no-such-folder/study.db: there is no such file
    """
    path = folder / FILE
    with reading(path) as connection, understood(path):
        content = Content.read(connection)
        sessions = [_session(row) for row in connection.execute(_SESSIONS)]
        kept = connection.execute(_ANSWERS).fetchall()
    # built when the writer is no longer kept waiting
    with _no_collection(), understood(path):
        runs = content.runs(kept)
    return Stored(
        folder=folder,
        title=content.title,
        runs=runs,
        scenarios=list(content.scenarios.values()),
        solvers=[entrant.label for entrant in content.entrants.values()],
        n_cells=content.n_cells,
        sessions=sessions,
        limits=content.limits,
    )


def load_study(folder: Path) -> Study:
    """
    Return the study of a database as it was asked for, with what later sessions added.

    Raises
    ------
    StudyError
        As `load`.
    """
    path = folder / FILE
    with reading(path) as connection, understood(path):
        (source,) = connection.execute("SELECT source FROM sessions ORDER BY id DESC LIMIT 1").fetchone()
        return Content.read(connection).study(source)


def _session(row: tuple[Any, ...]) -> Session:
    number, started, version, git, host, machine, packages, *rest = row
    return Session(number, started, version, git, host, machine, json.loads(packages), *rest)


_SESSIONS = (
    "SELECT id, started, version, git, host, machine, packages, workers, command, source FROM sessions ORDER BY id"
)
_ANSWERS = """
    SELECT answers.run, cells.scenario, cells.contender, cells.seed, answers.document, answers.path, answers.trace
    FROM answers JOIN cells ON cells.id = answers.cell
    JOIN scenarios ON scenarios.id = cells.scenario JOIN contenders ON contenders.id = cells.contender
    ORDER BY scenarios.place, contenders.place, cells.place, cells.id
"""


@dataclass(frozen=True, eq=False)
class Content:
    """
    What a database says of the study, by the keys of its tables, in the study's order.

    Attributes
    ----------
    title, seeds, tolerance, limits, n_cells
        As in `Study` and `Stored`.
    scenarios, entrants, certificates
        By key; certificates of those scenarios that have one.
    """

    title: str
    seeds: tuple[int, ...]
    tolerance: float | None
    limits: Limits
    n_cells: int
    scenarios: dict[int, Scenario]
    entrants: dict[int, Entrant]
    certificates: dict[int, Certificate]

    @classmethod
    def read(cls, connection: sqlite3.Connection) -> "Content":
        """Read it; what is malformed raises whatever it does (see `understood`)."""
        said = {key: decode(json.loads(value)) for key, value in connection.execute("SELECT key, value FROM study")}
        scenarios, certificates = _scenarios(connection)
        rows = connection.execute("SELECT id, document FROM contenders ORDER BY place, id")
        return cls(
            title=said["title"],
            seeds=tuple(said["seeds"]),
            tolerance=said["tolerance"],
            limits=Limits(said["seconds"], said["megabytes"]),
            n_cells=connection.execute("SELECT COUNT(*) FROM cells").fetchone()[0],
            scenarios=scenarios,
            entrants={key: entrant_from(json.loads(document)) for key, document in rows},
            certificates=certificates,
        )

    def study(self, source: str) -> Study:
        """Return the study."""
        return Study(
            scenarios=list(self.scenarios.values()),
            entrants=list(self.entrants.values()),
            seeds=self.seeds,
            tolerance=self.tolerance,
            limits=self.limits,
            title=self.title,
            source=source,
        )

    def runs(self, kept: Iterable[tuple[Any, ...]]) -> list[Run]:
        """Build runs of their rows."""
        return [
            restored(
                number,
                self.scenarios[scenario],
                self.entrants[entrant].label,
                decode(json.loads(seed)),
                self.certificates.get(scenario),
                Answer(*answer),
            )
            for number, scenario, entrant, seed, *answer in kept
        ]


def _scenarios(connection: sqlite3.Connection) -> tuple[dict[int, Scenario], dict[int, Certificate]]:
    areas = {digest: bytes(wkb).hex() for digest, wkb in connection.execute("SELECT digest, wkb FROM areas")}
    scenarios, certificates = {}, {}
    rows = connection.execute("SELECT id, document, area, certificate FROM scenarios ORDER BY place, id")
    for key, text, area, certificate in rows:
        document = json.loads(text)
        document["problem"]["no_fly"] = None if area is None else areas[area]
        scenarios[key] = scenario_from(document)
        if certificate is not None:
            certificates[key] = certificate_from(json.loads(certificate))
    return scenarios, certificates


@contextmanager
def understood(path: Path) -> Iterator[None]:
    """
    Say of what is read from a database and makes no sense that the file is damaged.

    Raises
    ------
    StudyError
        In one line.
    """
    try:
        yield
    except (sqlite3.Error, StudyError):
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        msg = f"{path}: holds what makes no sense ({reason}); it is damaged: restore it from a copy"
        raise StudyError(msg) from error


@contextmanager
def _no_collection() -> Iterator[None]:
    """Build much at once: looking for garbage in it again and again would take longer than all the rest."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    """
    Open a database for reading, at one moment: what is written meanwhile is not seen.

    Raises
    ------
    StudyError
        As `load`.
    """
    if not path.is_file():
        msg = f"{path}: there is no such file; give the folder of a study, which `cgla compare FILE --out FOLDER` makes"
        raise StudyError(msg)
    try:
        with _opened(path) as connection, closing(_current(connection, path)) as current:
            current.execute("BEGIN")
            _check_whole(connection, path)
            yield current
    except sqlite3.Error as error:
        raise unreadable(path, error) from error
    except UnicodeDecodeError as error:
        # SQLite's own words about it quote what is no text
        raise unreadable(path, sqlite3.DatabaseError("no text where there should be")) from error
    except OSError as error:
        msg = f"{path}: cannot be read: {error.strerror or error}; see who may read it"
        raise StudyError(msg) from error


def unreadable(path: Path, error: sqlite3.Error) -> StudyError:
    """Say why a database cannot be read, and what to do."""
    words = " ".join(str(error).split())
    if "locked" in words:
        remedy = "another program has locked it: close that, and try again"
    elif isinstance(error, sqlite3.OperationalError) and "unable to open" in words:
        remedy = "see who may read it"
    else:
        remedy = "it is damaged, or no database of a study: restore it from a copy, or choose another folder"
    return StudyError(f"{path}: cannot be read ({words}); {remedy}")


def _check_whole(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse a file that was cut within its last page, of which SQLite takes the rest for zeros."""
    (pages,), (size,) = (connection.execute(f"PRAGMA page_{what}").fetchone() for what in ("count", "size"))
    # pages that are in a log beside it are not in the file yet
    if not _beside(path, "-wal").exists() and path.stat().st_size < pages * size:
        msg = "the file ends too early"
        raise sqlite3.DatabaseError(msg)


def _current(connection: sqlite3.Connection, path: Path) -> sqlite3.Connection:
    """Return the database itself, or of an older one a copy in memory with tables of today."""
    if schema.version_of(connection, path) == schema.VERSION:
        return connection
    copy = sqlite3.connect(":memory:", isolation_level=None)
    connection.backup(copy)
    schema.migrate(copy, path)
    return copy


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a file for reading only, wherever it is."""
    connection = connect(path, "mode=ro")
    try:
        # the first question is what opens it
        connection.execute("PRAGMA schema_version").fetchone()
    except sqlite3.OperationalError as error:
        connection.close()
        if "unable to open" not in str(error) and "readonly" not in str(error):
            raise
    else:
        with closing(connection):
            yield connection
        return
    # a log beside it cannot be read where no file can be made: a copy can
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, FILE)
        shutil.copyfile(path, copy)
        for ending in ("-wal", "-journal"):
            with suppress(FileNotFoundError):
                shutil.copyfile(_beside(path, ending), _beside(copy, ending))
        with closing(connect(copy, "mode=rw")) as connection:
            yield connection


def _beside(path: Path, ending: str) -> Path:
    return path.with_name(path.name + ending)


def connect(path: Path, how: str) -> sqlite3.Connection:
    """Open a file as a query of SQLite's URIs says (``mode=ro``), in autocommit mode."""
    return sqlite3.connect(f"{path.absolute().as_uri()}?{how}", uri=True, timeout=PATIENCE, isolation_level=None)

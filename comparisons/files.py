"""Files of results: rows as JSON Lines and CSV, paths as CSV and GeoJSON. Nothing half-written keeps a final name."""

import csv
import errno
import io
import json
import os
import re
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cgla_graph._files import replace_files
from cgla_graph.errors import OutputError
from cgla_graph.model.earth import degrees_of
from cgla_graph.model.path_file import csv_of
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.geojson import line_feature_collection
from cgla_graph.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from filelock import FileLock


def make_folder(folder: Path) -> Path:
    """
    Make a folder for results and check that it can be written to, before any work is done.

    Raises
    ------
    OutputError
        If it cannot.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise cannot_write(folder, error) from error
    return folder


def write_text(path: Path, text: str) -> Path:
    """Write a text file like `write_bytes`; characters outside UTF-8 (from odd file names) become escapes."""
    return write_bytes(path, text.encode("utf-8", errors="backslashreplace"))


def write_bytes(path: Path, data: bytes) -> Path:
    """
    Write a file under a temporary name beside it, then rename.

    Raises
    ------
    OutputError
        If it cannot be written; the temporary file is gone then.
    """
    try:
        replace_files({path: data})
    except OSError as error:
        raise cannot_write(path, error) from error
    return path


def locked(path: Path) -> "FileLock":
    """
    Hold the lock of a file that grows while a study runs, so that no second process writes it.

    Raises
    ------
    OutputError
        If another process holds it, or the folder cannot be written.
    """
    from filelock import FileLock, Timeout  # noqa: PLC0415 - few commands lock a file

    lock = FileLock(path.with_name(f"{path.name}.lock"), timeout=0)
    try:
        lock.acquire()
    except Timeout as error:
        msg = f"{path}: another process writes this study; wait for it, or choose another folder (--out)"
        raise OutputError(msg) from error
    except OSError as error:
        raise cannot_write(path, error) from error
    return lock


def cannot_write(path: Path, error: OSError, *, is_kept: bool = False) -> OutputError:
    """Say in one line why a file cannot be written, and what to do; `is_kept`: who goes on (--resume) finds it."""
    remedy = "choose another folder (--out)"
    if error.errno == errno.ENOSPC:
        kept = "finished runs are kept: make room, and continue (--resume)"
        remedy = kept if is_kept else f"make room, or {remedy}"
    return OutputError(f"{path}: cannot be written: {error.strerror or error}; {remedy}")


def append_text(path: Path, text: str, *, is_kept: bool = False) -> None:
    """
    Append text to a file, which is made if it is not there: all of it, or nothing.

    It is there once this returns, even if the process is killed then. Characters outside UTF-8 become escapes.

    Raises
    ------
    OutputError
        If the disk is full or gone (`is_kept` as of `cannot_write`); the file stays as it was.
    """
    data = text.encode("utf-8", errors="backslashreplace")
    try:
        with path.open("ab", buffering=0) as file:
            before = file.tell()
            is_whole = file.write(data) == len(data)
            if not is_whole:
                file.truncate(before)
    except OSError as error:
        raise cannot_write(path, error, is_kept=is_kept) from error
    if not is_whole:
        raise cannot_write(path, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), is_kept=is_kept)


def json_lines(rows: Iterable[Mapping[str, Any]]) -> str:
    """Write rows as JSON Lines."""
    return "".join(json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n" for row in rows)


def csv_text(rows: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> str:
    """
    Write rows of these columns as CSV; numbers in full precision, nothing where there is no number.

    Examples
    --------
    >>> csv_text([{"cost": 1.5, "gap": None}], ("cost", "gap")).split()
    ['cost,gap', '1.5,']
    """
    text = io.StringIO()
    table = list(rows)
    # Python quotes a carriage return only where it ends lines as well
    odd = any("\r" in value for row in table for value in row.values() if isinstance(value, str))
    how: Literal[0, 1] = csv.QUOTE_ALL if odd else csv.QUOTE_MINIMAL
    writer = csv.DictWriter(text, fieldnames=columns, lineterminator="\n", quoting=how)
    writer.writeheader()
    writer.writerows({key: "" if value is None else value for key, value in row.items()} for row in table)
    return text.getvalue()


def stem_of(folder: Path, scenario: Scenario, solver: str, what: str = "") -> Path:
    """
    Return what the files of a command begin with: no two commands, maps or solvers share it.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> stem_of(Path("out"), load_scenario("paper"), "prm-star:milestones=100+refine", "pareto").name
    'paper-prm-star-milestones-100-refine-pareto'
    """
    return folder / file_stem("-".join(filter(None, (scenario.name, solver, what))), set())


def path_csv(scenario: Scenario, solution: Solution) -> str:
    """Write a path's waypoints as CSV: x and y in map units, and longitude and latitude where the map has them."""
    return csv_of(solution.path, scenario.projection)


def path_geojson(scenario: Scenario, solution: Solution) -> str:
    """Write a path on a lon/lat map as GeoJSON."""
    if scenario.projection is None:
        msg = f"{scenario.name} has no longitudes and latitudes; only its CSV can be written"
        raise OutputError(msg)
    properties = {
        "scenario": scenario.name,
        "solver": solution.solver,
        "cost": solution.cost,
        "length": solution.length,
        "risk": solution.risk,
    }
    document = line_feature_collection(degrees_of(solution.path, scenario.projection), properties)
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def file_stem(name: str, taken: set[str]) -> str:
    """
    Make a file name of a scenario's name that is safe everywhere and not taken yet; it is entered into `taken`.

    Examples
    --------
    >>> taken = set()
    >>> file_stem("arena:3", taken), file_stem("arena/3", taken)
    ('arena-3', 'arena-3-2')
    """
    # 120 bytes leave room for endings: file systems count bytes
    base = re.sub(r"[^\w.-]+", "-", name).encode("utf-8", errors="ignore")[:120].decode("utf-8", errors="ignore")
    base = base.strip("-.") or "scenario"
    if re.fullmatch(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", base, flags=re.IGNORECASE):
        # Windows keeps these names for devices
        base = f"scenario-{base}"
    stem, number = base, 1
    # a scenario's files end in nothing, or in -cost
    while taken & {stem.lower(), f"{stem.lower()}-cost"}:
        number += 1
        stem = f"{base}-{number}"
    taken |= {stem.lower(), f"{stem.lower()}-cost"}
    return stem

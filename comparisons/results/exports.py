"""Exports of a study's runs: CSV, JSON Lines, Parquet, a LaTeX table, and OMPL's benchmark database."""

import importlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cgla_graph.comparisons import files
from cgla_graph.comparisons.leaderboard.leaderboard import leaderboard_of
from cgla_graph.comparisons.results.ompl_database import ompl_database
from cgla_graph.comparisons.study.rows import EXPORTED, Kind, best_exact, by_scenario, exported, row
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.sampling import independence_note
from cgla_graph.comparisons.study.store import FILE, Stored
from cgla_graph.comparisons.tables.latex import booktabs
from cgla_graph.comparisons.tables.leaderboard_columns import leaderboard_cells, leaderboard_heads, leaderboard_notes
from cgla_graph.errors import CglaError, OutputError

#: The columns of a run of a study.
RUN_COLUMNS = tuple(column.key for column in EXPORTED)
#: Names of column types in pyarrow.
_ARROW_TYPES: Mapping[Kind, str] = {"word": "string", "whole": "int64", "number": "float64", "flag": "bool_"}


def run_rows(runs: Sequence[Run], every: Sequence[Run]) -> list[dict[str, Any]]:
    """
    Turn runs into flat rows, one value for each of `RUN_COLUMNS` and of their metrics; None for NaN and infinity.

    Parameters
    ----------
    runs
        The runs.
    every
        All runs of their study: ``excess`` is over the best exact optimum among these.

    Examples
    --------
    >>> from cgla_graph.comparisons.study.entrant import Entrant
    >>> from cgla_graph.comparisons.study.runner import compare
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> runs = list(compare([load_scenario("one-threat")], [Entrant.parse("straight-line")], tolerance=None))
    >>> [(row["solver"], row["status"], row["exact"]) for row in run_rows(runs, runs)]
    [('straight-line', 'found', False)]
    """
    best = {id(group[0].scenario): best_exact(group) for group in by_scenario(every)}
    columns = exported(every)
    return [row(run, best[id(run.scenario)], columns) for run in runs]


def check_targets(targets: Sequence[Path], folder: Path) -> None:
    """
    Check the files of ``--export`` before any work is done.

    Raises
    ------
    CglaError
        If an ending is not known, the package for it is missing, or the file is the study itself or beside one that
        is in use.
    """
    for target in targets:
        kind = target.suffix.lower()
        if kind not in _WRITERS:
            msg = f"--export {target}: cannot tell the format; end it in {', '.join(_WRITERS)}"
            raise CglaError(msg)
        if kind == ".parquet":
            _pyarrow()
        if target.resolve() in {(folder / f"{FILE}{ending}").resolve() for ending in ("", ".lock")}:
            msg = f"--export {target}: that is the study itself; choose another name"
            raise OutputError(msg)
        for ending in ("-wal", "-journal"):
            # SQLite would apply its content to the new file
            if kind == ".db" and Path(f"{target}{ending}").exists():
                msg = f"--export {target}: {target.name}{ending} is beside it, so it is in use; choose another name"
                raise OutputError(msg)


def export(target: Path, stored: Stored, runs: Sequence[Run]) -> Path:
    """
    Write runs of a study, in the format that the file's ending says.

    Parameters
    ----------
    target
        Its ending is ``.csv``, ``.jsonl``, ``.parquet``, ``.tex`` (the leaderboard, with booktabs) or ``.db`` (OMPL's
        benchmark database). It is written under another name beside it and then renamed.
    stored, runs
        The study, and the runs of it to write.

    Raises
    ------
    CglaError
        As in `check_targets`.
    OutputError
        If it cannot be written.
    """
    check_targets([target], stored.folder)
    data = _WRITERS[target.suffix.lower()](stored, runs)
    try:
        return files.write_bytes(target, data)
    except OutputError as error:
        cause = error.__cause__
        why = getattr(cause, "strerror", None) or cause
        msg = f"{target}: cannot be written: {why}; choose another place (--export)"
        raise OutputError(msg) from error


def _csv(stored: Stored, runs: Sequence[Run]) -> bytes:
    columns = [column.key for column in exported(stored.runs)]
    return files.csv_text(run_rows(runs, stored.runs), columns).encode("utf-8", errors="backslashreplace")


def _jsonl(stored: Stored, runs: Sequence[Run]) -> bytes:
    rows = [{**one, "settings": json.loads(one["settings"])} for one in run_rows(runs, stored.runs)]
    return files.json_lines(rows).encode("utf-8", errors="backslashreplace")


def _parquet(stored: Stored, runs: Sequence[Run]) -> bytes:
    pa = _pyarrow()
    parquet = importlib.import_module("pyarrow.parquet")
    fields = [(column.key, getattr(pa, _ARROW_TYPES[column.kind])()) for column in exported(stored.runs)]
    rows = [
        {key: _utf8_text(value) if isinstance(value, str) else value for key, value in one.items()}
        for one in run_rows(runs, stored.runs)
    ]
    table = pa.Table.from_pylist(rows, schema=pa.schema(fields))
    sink = pa.BufferOutputStream()
    parquet.write_table(table.replace_schema_metadata({"title": _utf8_text(stored.title)}), sink)
    return bytes(sink.getvalue())


def _utf8_text(text: str) -> str:
    """Escape characters outside UTF-8, as from odd file names."""
    return text.encode("utf-8", errors="backslashreplace").decode("utf-8")


def _pyarrow() -> Any:  # noqa: ANN401 - pyarrow has no types
    try:
        return importlib.import_module("pyarrow")
    except ImportError as error:
        msg = f"Parquet files need pyarrow, which cannot be imported ({error}); pip install 'cgla-graph[parquet]'"
        raise CglaError(msg) from error


def _tex(stored: Stored, runs: Sequence[Run]) -> bytes:
    found = leaderboard_of(runs)
    title = f"{stored.title or stored.folder.name}: leaderboard of {len(found)} solvers over {len(runs)} runs"
    sampled = independence_note(list({run.scenario.name: run.scenario for run in runs}.values()))
    notes = [title, *leaderboard_notes(found), *filter(None, [sampled]), "needs the package booktabs"]
    return booktabs(leaderboard_heads(found), [leaderboard_cells(one) for one in found], notes).encode("ascii")


_WRITERS: Mapping[str, Callable[[Stored, Sequence[Run]], bytes]] = {
    ".csv": _csv,
    ".jsonl": _jsonl,
    ".parquet": _parquet,
    ".tex": _tex,
    ".db": ompl_database,
}

"""What a study of claims has measured, found and drawn so far: one JSON line each, of the code that is running."""

import hashlib
import inspect
import re
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Self

import cgla_graph
from cgla_graph.comparisons.claims import catalogue, panel
from cgla_graph.comparisons.claims.artefact import Content
from cgla_graph.comparisons.claims.claim import (
    Answer,
    Finding,
    Table,
    finding_document,
    finding_from,
    plain_value,
    table_document,
)
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.store import Line, Log, Reader, understood
from cgla_graph.comparisons.workers.tasks import Key
from cgla_graph.errors import ClaimError, OutputError, StudyError

#: The file's name, and what its first line says.
FILE, _WHAT = "claims.jsonl", "claims"
#: The first line of claims on a user's own settings.
OWN = "own-settings"
#: The kinds of lines, and of tasks.
SAMPLE, FINDING, FIGURE = "sample", "finding", "figure"
#: How a module of the panel imports another one.
_USED = re.compile(r"comparisons\.claims\.panel\.(\w+) import")


class Measured(NamedTuple):
    """What came of an experiment on one map: its records, or why there are none."""

    records: Sequence[Record]
    failed: str = ""


class Found(NamedTuple):
    """What a check found, and how long it took; without a verdict, it is tried again when the study goes on."""

    finding: Finding
    seconds: float = 0.0


class Drawn(NamedTuple):
    """What came of a figure or table, or why there is none."""

    content: Content | None
    failed: str = ""


class Store:
    """
    The one writer of a study's file (``claims.jsonl``); a context manager, which holds its lock.

    What was measured by other code than today's is not taken up again: a line counts only if it has the fingerprint of
    the sources that it follows from. Samples follow from the library, the solvers and their modules of the panel;
    findings, figures and tables from all sources, and from the scale. What failed is not kept, but for samples.

    Parameters
    ----------
    folder, scale
        Where, made if it is not there, None for in memory; the scale of the study.
    resume, overwrite
        Go on with what is there, or replace it; one of them is needed where there is something.

    Raises
    ------
    OutputError
        If the folder cannot be written, another process writes it, or there is a study already and neither is asked
        for; or claims on other settings, which are never mixed.
    ClaimError
        If both are asked for.
    StudyError
        If the file cannot be read, is damaged, or another program's.

    Examples
    --------
    >>> with Store(None, Scale()) as store:
    ...     store.add((SAMPLE, "squares", 3), Measured([{"value": 9.0}])).records
    [{'value': 9.0}]
    """

    def __init__(self, folder: Path | None, scale: Scale, *, resume: bool = False, overwrite: bool = False) -> None:
        self.scale = scale
        self._scale_key = [scale.maps, scale.seed, int(scale.quick)]
        self._results: dict[Key, Any] = {}
        self._log: Log | None = None
        if resume and overwrite:
            msg = "--resume and --overwrite exclude each other; give one of them"
            raise ClaimError(msg)
        if folder is None:
            return
        self._path = folder / FILE
        self._own = {name: list(levels) for name, levels in scale.panel.own.items()}
        if self._path.exists() and self._path.stat().st_size and (resume or overwrite):
            self._require_same(is_same=resume)
        if resume and self._path.exists():
            self._log = Log.resume(self._path, _WHAT, self._take)
        else:
            marks: list[Line] = [{"kind": OWN, "key": OWN, "settings": self._own}] if self._own else []
            self._log = Log.create(self._path, _WHAT, marks, overwrite=overwrite)

    def __enter__(self) -> Self:
        """Return the store itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Let the lock go."""
        if self._log is not None:
            self._log.close()

    def __contains__(self, key: Key) -> bool:
        """Tell whether a sample, a finding or a figure is there."""
        return key in self._results

    def __getitem__(self, key: Key) -> Any:  # noqa: ANN401 - what `add` was given
        """Return a sample, a finding or a figure."""
        return self._results[key]

    def add(self, key: Key, result: Any) -> Any:  # noqa: ANN401 - one of three tuples
        """
        Keep a sample, a finding or a figure, and return it as it is kept: numbers that are not finite become None.

        Raises
        ------
        OutputError
            If the disk is full or gone.
        """
        kind, *names = key
        missing = kind == FINDING and Answer.MISSING in result.finding.answers
        if missing or (kind == FIGURE and result.failed):
            return result
        line: Line = {"kind": kind, "key": names, "code": _code(key), **_document(kind, result)}
        if kind != SAMPLE:
            line["scale"] = self._scale_key
        if self._log is not None:
            self._log.append([line])
        self._results[key] = _read(line)
        return self._results[key]

    def _require_same(self, *, is_same: bool) -> None:
        """Refuse a folder with other settings to go on with, or to mix a study with a user's own settings."""
        try:
            with understood(self._path):
                first = next(Reader(self._path, _WHAT).new_lines(), Line(kind=""))
                found: dict[str, Any] = first["settings"] if first["kind"] == OWN else {}
        except StudyError:
            if is_same:
                raise
            # whether it may be replaced is the log's to say
            return
        if bool(found) != bool(self._own) or (is_same and found != self._own):
            here, there = (_settings_words(one) for one in (self._own, found))
            remedy = "choose another folder (--out)"
            msg = f"{self._path}: holds claims on {there}, never mixed with those on {here}; {remedy}"
            raise OutputError(msg)

    def _take(self, lines: Iterator[Line]) -> list[Line]:
        """Take up what this code measured."""
        with understood(self._path):
            for line in (one for one in lines if one["kind"] != OWN):
                key = (line["kind"], *line["key"])
                if line["code"] == _code(key) and line.get("scale", self._scale_key) == self._scale_key:
                    self._results[key] = _read(line)
        return []


def _settings_words(own: dict[str, Any]) -> str:
    words = "; ".join(f"{name} {', '.join(map(str, levels))}" for name, levels in own.items())
    return f"own settings ({words})" if own else "the settings of the study"


def _document(kind: str, result: Any) -> Line:  # noqa: ANN401 - one of three tuples
    if kind == SAMPLE:
        records = [{name: plain_value(value) for name, value in record.items()} for record in result.records]
        return {"records": records, "failed": result.failed}
    if kind == FINDING:
        return {"finding": finding_document(result.finding), "seconds": result.seconds}
    content: Content = result.content
    table = content.table and table_document(content.table)
    return {"caption": content.caption, "png": content.png.hex(), "svg": content.svg.decode("utf-8"), "table": table}


def _read(line: Line) -> Measured | Found | Drawn:
    if line["kind"] == SAMPLE:
        return Measured(line["records"], str(line["failed"]))
    if line["kind"] == FINDING:
        return Found(finding_from(line["finding"]), float(line["seconds"]))
    table = line["table"] and Table(**line["table"])
    return Drawn(Content(line["caption"], bytes.fromhex(line["png"]), line["svg"].encode(), table))


def _code(key: Key) -> str:
    """Return the fingerprint of what a line follows from."""
    return fingerprint(SAMPLE, str(key[1])) if key[0] == SAMPLE else fingerprint(key[0])


@cache
def fingerprint(kind: str, name: str = "") -> str:
    """
    Return what tells one state of the sources from another that lines of a kind follow from.

    Parameters
    ----------
    kind, name
        `SAMPLE` with the name of the experiment, `FINDING` or `FIGURE`.

    Examples
    --------
    >>> len(fingerprint(SAMPLE, "single-uav")), fingerprint(SAMPLE, "single-uav") == fingerprint(FINDING)
    (16, False)
    """
    # the folders of a checkout are no subfolders of each other
    packages = [cgla_graph, cgla_graph.solvers] + ([] if kind == SAMPLE else [cgla_graph.comparisons])
    files = [path for package in packages for path in sorted(Path(package.__path__[0]).rglob("*.py"))]
    digest = hashlib.sha256()
    for path in [*files, *(_panel_files(name) if kind == SAMPLE else [])]:
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _panel_files(name: str) -> list[Path]:
    """List the files that an experiment follows from: its module, and those of the panel that it uses."""
    one = catalogue.experiments().get(name)
    found = [] if one is None else [Path(inspect.getfile(one.sample))]
    for path in found:
        used = (Path(panel.__path__[0]) / f"{module}.py" for module in _USED.findall(path.read_text(encoding="utf-8")))
        found += [file for file in dict.fromkeys(used) if file not in found]
    return sorted(found)

"""What a study of claims has measured and found so far: one JSON line each, on the disk before the next one begins."""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self

import cgla_graph
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.files import append_line, locked, make_folder
from cgla_graph.errors import ClaimError, OutputError

#: The file's name.
FILE = "claims.jsonl"
#: The kinds of lines.
_SAMPLE, _FINDING = "sample", "finding"


class Measured(NamedTuple):
    """What came of an experiment on one map: its records, or why there are none."""

    records: Sequence[Record]
    failed: str = ""


class Store:
    """
    The one writer of a study's file (``claims.jsonl``); a context manager, which holds its lock.

    What was measured by other code than today's is not taken up again: a line counts only if it has the fingerprint of
    the sources that are running. Findings depend on the scale as well.

    Parameters
    ----------
    folder
        Where; made if it is not there. None keeps everything in memory.
    scale
        Of the study.
    resume, overwrite
        Go on with what is there, or replace it; one of them is needed where there is something.

    Raises
    ------
    OutputError
        If the folder cannot be written, or another process writes it.
    ClaimError
        If there is a study already, and neither is asked for.

    Examples
    --------
    >>> with Store(None, Scale()) as store:
    ...     store.add_sample("squares", 3, Measured([{"value": 9.0}]))
    ...     store.samples["squares", 3].records
    [{'value': 9.0}]
    """

    def __init__(self, folder: Path | None, scale: Scale, *, resume: bool = False, overwrite: bool = False) -> None:
        self.samples: dict[tuple[str, int], Measured] = {}
        self.findings: dict[str, dict[str, Any]] = {}
        self.scale = scale
        self._path = None if folder is None else make_folder(folder) / FILE
        self._lock = None if self._path is None else locked(self._path)
        try:
            self._open(resume=resume, overwrite=overwrite)
        except BaseException:
            self._release()
            raise

    def _open(self, *, resume: bool, overwrite: bool) -> None:
        if self._path is None:
            return
        if resume and overwrite:
            msg = "--resume and --overwrite exclude each other; give one of them"
            raise ClaimError(msg)
        if not self._path.exists():
            return
        if overwrite:
            self._path.unlink()
        elif resume:
            self._read(self._path)
        else:
            msg = (
                f"{self._path} is there already; go on with it (--resume), replace it (--overwrite), or choose another"
            )
            raise ClaimError(msg)

    def __enter__(self) -> Self:
        """Return the store itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let the lock go."""
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()

    def add_sample(self, experiment: str, seed: int, measured: Measured) -> None:
        """
        Keep what was measured on a map; numbers that are not finite become None.

        Raises
        ------
        OutputError
            If the disk is full or gone.
        """
        records = [{name: _plain(value) for name, value in record.items()} for record in measured.records]
        self.samples[experiment, seed] = Measured(records, measured.failed)
        self._append(_SAMPLE, experiment=experiment, seed=seed, records=records, failed=measured.failed)

    def add_finding(self, claim: str, document: Mapping[str, Any]) -> None:
        """
        Keep what was found of a claim, as a JSON document.

        Raises
        ------
        OutputError
            If the disk is full or gone.
        """
        self.findings[claim] = dict(document)
        self._append(_FINDING, claim=claim, scale=_scale_key(self.scale), document=document)

    def _append(self, kind: str, **entries: object) -> None:
        if self._path is not None:
            line = json.dumps({"kind": kind, "code": fingerprint(), **entries}, allow_nan=False)
            append_line(self._path, line)

    def _read(self, path: Path) -> None:
        """Take up what this code measured; a last line that a killed process left half-written is cut off."""
        try:
            data = path.read_bytes()
            whole = data[: data.rfind(b"\n") + 1]
            if len(whole) < len(data):
                with path.open("r+b") as file:
                    file.truncate(len(whole))
        except OSError as error:
            msg = f"{path}: cannot be read: {error.strerror or error}"
            raise OutputError(msg) from error
        for number, text in enumerate(whole.decode("utf-8", errors="replace").splitlines(), start=1):
            try:
                self._take(json.loads(text))
            except (ValueError, LookupError, TypeError) as error:
                msg = f"{path}: line {number} is none of a study of claims ({error}); give --overwrite"
                raise ClaimError(msg) from error

    def _take(self, line: Mapping[str, Any]) -> None:
        if line["code"] != fingerprint():
            return
        if line["kind"] == _SAMPLE:
            self.samples[str(line["experiment"]), int(line["seed"])] = Measured(line["records"], str(line["failed"]))
        elif line["kind"] == _FINDING and line["scale"] == _scale_key(self.scale):
            self.findings[str(line["claim"])] = dict(line["document"])


def _scale_key(scale: Scale) -> list[int]:
    return [scale.maps, scale.seed, int(scale.quick)]


def _plain(value: Any) -> Any:  # noqa: ANN401 - any entry of a record
    """Turn a value into one that JSON has, to the last bit."""
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


@cache
def fingerprint() -> str:
    """
    Return what tells one state of the toolkit's sources from another.

    Examples
    --------
    >>> len(fingerprint())
    16
    """
    digest = hashlib.sha256()
    # the folders of a checkout are no subfolders of each other
    for package in (cgla_graph, cgla_graph.solvers, cgla_graph.comparisons):
        root = Path(package.__path__[0])
        for path in sorted(root.rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]

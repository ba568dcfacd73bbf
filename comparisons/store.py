"""
Results on the disk, one line of JSON each: the one writer only ever appends, and what it wrote is there at once.

A file is `NAME.jsonl`; its first line says what it is. While it is written, `NAME.jsonl.lock` is held. A line that a
killed process or a full disk left half-written is no line: readers pass over it, and the next writer cuts it off.
"""

import json
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeAlias

from cgla_graph._text import place
from cgla_graph.comparisons.files import append_text, cannot_write, locked, make_folder, write_text
from cgla_graph.errors import CglaError, OutputError, StudyError

#: One line; ``kind`` and ``key`` name its subject.
Line: TypeAlias = dict[str, Any]
#: Counts changes of what lines say.
FORMAT = 1
_MARK = "cgla-graph"
#: First bytes of a file of ours.
_MARKED = f'{{"kind":"{_MARK}"'.encode()


class Log:
    """
    The one writer of a file of results; a context manager, which holds the file's lock.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "numbers.jsonl")
    ...     with Log.create(path, "numbers") as log:
    ...         log.append([{"kind": "number", "key": 1, "value": 0.5}])
    ...     [line["value"] for line in Reader(path, "numbers").new_lines()]
    [0.5]
    """

    def __init__(self, path: Path, release: Callable[[], object]) -> None:
        """Take over a file whose lock is held; `create` and `resume` do that."""
        self.path = path
        self._release = release

    @classmethod
    def create(cls, path: Path, what: str, lines: Iterable[Line] = (), *, overwrite: bool = False) -> Self:
        """
        Start a file; its folder is made if it is not there.

        Parameters
        ----------
        path
            The file.
        what
            The kind of its content, which the first line states.
        lines
            What it begins with: all of that, or the file that was there stays.
        overwrite
            Replace the file; never another program's file.

        Raises
        ------
        OutputError
            If the folder cannot be written, another process writes the file, or there is one already.
        """
        make_folder(path.parent)
        with _until_open(path) as release:
            if path.exists() and path.stat().st_size:
                if not overwrite:
                    msg = (
                        f"{path}: holds a study already; go on with it (--resume), replace it (--overwrite) "
                        f"or choose another folder (--out)"
                    )
                    raise OutputError(msg)
                _check_ours(path)
            header = {"kind": _MARK, "key": what, "format": FORMAT}
            write_text(path, "".join(map(_text, (header, *lines))))
            return cls(path, release)

    @classmethod
    def resume(cls, path: Path, what: str, take: Callable[[Iterator[Line]], Iterable[Line]]) -> Self:
        """
        Go on with a file.

        Parameters
        ----------
        path, what
            As in `create`.
        take
            Reads the lines that are there, and returns those to be added; what it refuses leaves the file as it is.

        Raises
        ------
        OutputError
            If the file cannot be written, or another process writes it.
        StudyError
            As `Reader.new_lines`.
        """
        _check_there(path)
        with _until_open(path) as release:
            reader = Reader(path, what)
            more = list(take(reader.new_lines()))
            try:
                with path.open("r+b") as file:
                    file.truncate(reader.offset)
            except OSError as error:
                raise cannot_write(path, error) from error
            log = cls(path, release)
            log.append(more)
            return log

    def append(self, lines: Iterable[Line]) -> None:
        """
        Add lines: all of them, or nothing.

        Raises
        ------
        OutputError
            If the disk is full or gone; earlier lines stay, and it may be tried again.
        """
        append_text(self.path, "".join(map(_text, lines)), is_kept=True)

    def __enter__(self) -> Self:
        """Return the log itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let others write."""
        self.close()

    def close(self) -> None:
        """Let others write."""
        self._release()


class Reader:
    """
    Reads a file of results, and later the lines added since, also while it is being written.

    Attributes
    ----------
    offset
        End of the last whole line, in bytes.
    """

    def __init__(self, path: Path, what: str) -> None:
        """Read nothing yet."""
        self.path = path
        self.offset = 0
        self._what = what
        self._number = 0

    def new_lines(self) -> Iterator[Line]:
        """
        Yield the lines that were not there before, but for the first, which says what the file is.

        Raises
        ------
        StudyError
            If there is no such file, or it cannot be read, is damaged, another program's, or of a newer version.
        """
        _check_there(self.path)
        try:
            with self.path.open("rb") as file:
                file.seek(self.offset)
                if not self._number:
                    self._take_header(file.readline())
                for data in file:
                    if not data.endswith(b"\n"):
                        return
                    line = self._line(data)
                    self.offset += len(data)
                    yield line
        except OSError as error:
            msg = f"{self.path}: cannot be read: {error.strerror or error}; see who may read it"
            raise StudyError(msg) from error

    def _take_header(self, data: bytes) -> None:
        # of another program's file, nothing is read that may not be JSON
        line = self._line(data) if data.startswith(_MARKED) and data.endswith(b"\n") else {}
        if line.get("kind") != _MARK or line.get("key") != self._what:
            msg = (
                f"{self.path}: is no file of a study (another program's, damaged, or empty); "
                f"restore it from a copy, or choose another folder"
            )
            raise StudyError(msg)
        if line.get("format") != FORMAT:
            msg = (
                f"{self.path}: was written by another cgla-graph (format {line.get('format')}, known {FORMAT}); "
                f"read it with that one, or run the study anew in another folder"
            )
            raise StudyError(msg)
        self.offset += len(data)

    def _line(self, data: bytes) -> Line:
        self._number += 1
        try:
            line = json.loads(data)
            return {"kind": line["kind"], "key": line["key"], **line}
        except (ValueError, LookupError, TypeError, RecursionError) as error:
            reason = f"{type(error).__name__}: {error}".splitlines()[0]
            msg = f"{self.path}: line {self._number} is damaged ({reason}); restore the file from a copy"
            raise StudyError(msg) from error


@contextmanager
def understood(path: Path) -> Iterator[None]:
    """
    Report malformed content of a file of results as damage.

    Raises
    ------
    StudyError
        In one line.
    """
    try:
        yield
    except CglaError:
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, RecursionError) as error:
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        msg = f"{path}: holds what makes no sense ({reason}); it is damaged: restore it from a copy"
        raise StudyError(msg) from error


def _text(line: Mapping[str, Any]) -> str:
    """Write a line in ASCII, which every reader takes; JSON has no word for NaN and infinity."""
    return json.dumps(line, allow_nan=False, separators=(",", ":")) + "\n"


@contextmanager
def _until_open(path: Path) -> Iterator[Callable[[], object]]:
    """Hold the lock of a file, and let go of it if what it was taken for fails."""
    lock = locked(path)
    try:
        yield lock.release
    except BaseException:
        lock.release()
        raise


def _check_there(path: Path) -> None:
    if not os.path.isfile(path):  # noqa: PTH113 - no name is too long for it
        makes = "which `cgla compare FILE --out FOLDER` makes"
        msg = f"{place(path)}: there is no such file; give the folder of a study, {makes}"
        raise StudyError(msg)


def _check_ours(path: Path) -> None:
    """Refuse to replace another program's file."""
    try:
        with path.open("rb") as file:
            ours = file.read(len(_MARKED)) == _MARKED
    except OSError as error:
        raise cannot_write(path, error) from error
    if not ours:
        msg = f"{path}: is no study, and is not replaced; move it away, or choose another folder (--out)"
        raise OutputError(msg)

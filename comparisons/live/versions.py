"""Versions of files on disk, and a lock around comparing and replacing them."""

import hashlib
import os
import stat
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

#: Most bytes of a scenario file; a longer one is another version.
MOST_BYTES = 64 << 20
#: The version of a path where there is nothing, and of one that is no file that can be read.
GONE, NO_FILE = "", "no file"

_SAVING = threading.Lock()


def version_of(path: Path) -> str:
    """
    Return the version of a file: it changes with its content, its kind, and the file that a link leads to.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "mine.toml"
    ...     versions = [version_of(file), version_of(Path(folder))]
    ...     for text in ("k = 1", "k = 2", "k = 1"):
    ...         _ = file.write_text(text)
    ...         versions.append(version_of(file))
    >>> versions[:2], versions[2] == versions[4], versions[2] == versions[3]
    (['', 'no file'], True, False)
    """
    try:
        # (a pipe would wait for its writer)
        status = path.stat()
        if not stat.S_ISREG(status.st_mode) or status.st_size > MOST_BYTES:
            return NO_FILE
        return version_with(path, path.read_bytes())
    except (FileNotFoundError, NotADirectoryError):
        return GONE
    except (OSError, ValueError):
        return NO_FILE


def version_with(path: Path, data: bytes) -> str:
    """Return the version that a file has with some content."""
    return hashlib.sha256(os.fsencode(path.resolve()) + b"\0" + data).hexdigest()


@contextmanager
def saving_in(folder: Path) -> Iterator[None]:
    """Let no other server save a map into a folder meanwhile; servers of other processes only wait where they can."""
    with _SAVING:
        if sys.platform == "win32":
            yield
            return
        import fcntl  # noqa: PLC0415 - POSIX has it

        handle = None
        with suppress(OSError):
            handle = os.open(folder, os.O_RDONLY)
            fcntl.flock(handle, fcntl.LOCK_EX)
        try:
            yield
        finally:
            if handle is not None:
                os.close(handle)

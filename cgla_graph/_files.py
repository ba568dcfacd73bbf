"""Writing of files, whole or not at all."""

import errno
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from cgla_graph._text import cut, place
from cgla_graph.errors import OutputError


def replace_files(files: Mapping[Path, bytes]) -> None:
    """
    Write files under temporary names in the same folders, then rename them in order.

    Raises
    ------
    OSError
        If one of them cannot be written; the temporary files are gone then.
    """
    parts = {path: path.with_name(f".{path.name}.part") for path in files}
    try:
        for path, data in files.items():
            parts[path].write_bytes(data)
        for path, part in parts.items():
            part.replace(path)
    except BaseException:
        # on Ctrl-C too; a temporary file may not exist yet
        for part in parts.values():
            with suppress(OSError, ValueError):
                part.unlink(missing_ok=True)
        raise


def write_files(files: Mapping[Path, bytes]) -> None:
    """
    Write files that a user named, as `replace_files` does.

    Raises
    ------
    OutputError
        If they cannot be written; the message names the last file, the main one.
    """
    target = list(files)[-1]
    try:
        replace_files(files)
    except OSError as error:
        room = "make room, or " if error.errno == errno.ENOSPC else ""
        msg = f"{target}: cannot be written: {error.strerror or error}; {room}choose another place"
        raise OutputError(msg) from error
    except ValueError as error:
        msg = f"{place(target)}: no file has such a name ({cut(error)}); choose another"
        raise OutputError(msg) from error

"""Reading of text files, and the form of error messages about files."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

from cgla_graph._text import cut, place
from cgla_graph.errors import CglaError, ScenarioError


@contextmanager
def scenario_errors(where: object) -> Iterator[None]:
    """
    Turn errors into a `ScenarioError` that names the place.

    Examples
    --------
    >>> with scenario_errors("mine.toml"):
    ...     raise CglaError("k is -1")
    Traceback (most recent call last):
    cgla_graph.errors.ScenarioError: mine.toml: k is -1
    """
    try:
        yield
    except CglaError as error:
        msg = f"{where}: {error}"
        raise ScenarioError(msg) from error


def require_file(path: Path) -> None:
    """
    Check that a file is there, before anything else is said about it.

    Raises
    ------
    ScenarioError
        If there is none, or it is a folder or a device.

    Examples
    --------
    >>> require_file(Path("roads.json"))
    Traceback (most recent call last):
    cgla_graph.errors.ScenarioError: roads.json: there is no such file: check the name and the folder
    """
    there = "there is no such file"
    with suppress(OSError, ValueError):
        if path.is_file():
            return
        there = "this is no file" if path.exists() else there
    msg = f"{place(path)}: {there}: check the name and the folder"
    raise ScenarioError(msg)


def is_file(path: Path) -> bool:
    """
    Return whether a file is there; False for names that no file can have.

    Examples
    --------
    >>> is_file(Path("x" * 9999))
    False
    """
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_text(path: str | os.PathLike[str], file: str, what: str) -> str:
    """
    Return the text of a UTF-8 file, without a byte order mark.

    Parameters
    ----------
    path
        The file.
    file
        The name of the file in error messages.
    what
        The kind of file expected, such as "a GeoJSON file".

    Raises
    ------
    ScenarioError
        If it does not exist, cannot be read or is not UTF-8.
    """
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        message = f"{place(file)}: there is no such file: check the name and the folder"
    except OSError as error:
        message = f"{place(file)}: cannot be read ({error.strerror}): give {what} that you may read"
    except UnicodeDecodeError as error:
        message = f"{place(file)}: byte {error.start} is not UTF-8: give {what} saved as UTF-8 text"
    except ValueError as error:
        message = f"{place(file)}: no file has such a name ({cut(error)}): check the name"
    raise ScenarioError(" ".join(message.split()))


def fail(wrong: str, allowed: str, remedy: str) -> NoReturn:
    """Raise a `ScenarioError` of one line: the fault and its place, the allowed values, the remedy."""
    message = f"{wrong}; {allowed} is allowed: {remedy}"
    raise ScenarioError(" ".join(message.split()))

"""Reading text files: one place for all that can go wrong, and one form in which a fault is told."""

import os
from pathlib import Path
from typing import NoReturn

from cgla_graph._text import cut, place
from cgla_graph.errors import ScenarioError


def read_text(path: str | os.PathLike[str], file: str, what: str) -> str:
    """
    Return the text of a file, without the signature that some editors of Windows write first.

    Parameters
    ----------
    path
        The file.
    file
        What error messages call it.
    what
        What it should hold, such as "a GeoJSON file".

    Raises
    ------
    ScenarioError
        If it is not there, cannot be read or is not UTF-8.
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
    """Raise an error that names the fault and its place, the allowed values and the remedy, in one line."""
    message = f"{wrong}; {allowed} is allowed: {remedy}"
    raise ScenarioError(" ".join(message.split()))

"""Checks before the work of a proof file: problems that have none, and files that it may replace."""

import os
import zipfile
from collections.abc import Sequence
from pathlib import Path

from cgla_graph._text import place
from cgla_graph._validate import file_path
from cgla_graph.certificate.check_proof import FORMAT, description
from cgla_graph.errors import OutputError, ProblemError
from cgla_graph.model.risk import RiskField

#: What is not checked of a map in degrees.
ON_EARTH = (
    "checked in the plane and for its least scale on the Earth, not that places of the plane are those of the "
    "longitudes and latitudes"
)


def require_provable(field: RiskField, start: Sequence[float], goal: Sequence[float]) -> None:
    """
    Refuse a problem that no proof file can hold.

    Raises
    ------
    ProblemError
        If its field has peaks above 1, or its start is its goal.

    Examples
    --------
    >>> require_provable(RiskField(), (0.5, 0.5), (0.5, 0.5))
    Traceback (most recent call last):
        ...
    cgla_graph.errors.ProblemError: start and goal are one place: to stay there costs 0; give two places
    """
    if not field.is_proper:
        msg = "there is no proof for a field with peaks above 1; lower them to 1"
        raise ProblemError(msg)
    if tuple(start) == tuple(goal):
        msg = "start and goal are one place: to stay there costs 0; give two places"
        raise ProblemError(msg)


def proof_target(file: str | os.PathLike[str], name: str = "file") -> Path:
    """
    Return the path of a proof file that is to be written; one that is there already is replaced.

    Parameters
    ----------
    file
        The path.
    name
        What messages call it.

    Raises
    ------
    OutputError
        If its folder is not there, or anything but a proof has that name.

    Examples
    --------
    >>> proof_target("pyproject.toml")
    Traceback (most recent call last):
        ...
    cgla_graph.errors.OutputError: pyproject.toml: is there already, and is no proof file; choose another name
    """
    target = file_path(name, file, OutputError)
    where = place(target)
    try:
        if not target.parent.is_dir():
            msg = f"{where}: there is no folder {place(target.parent)}; make it, or choose another place"
            raise OutputError(msg)
        is_free = not target.exists() or (target.is_file() and (not target.stat().st_size or _is_proof(target)))
    except (OSError, ValueError) as error:
        msg = f"{where}: cannot be written: {getattr(error, 'strerror', None) or error}; choose another place"
        raise OutputError(msg) from error
    if not is_free:
        msg = f"{where}: is there already, and is no proof file; choose another name"
        raise OutputError(msg)
    return target


def _is_proof(file: Path) -> bool:
    """Return whether a file says that it is a proof; it is not checked."""
    described = _described(file)
    return isinstance(described, dict) and described.get("format") == FORMAT


def _described(file: Path) -> object:
    """Return the description in a proof file; None if there is none."""
    try:
        with zipfile.ZipFile(file) as archive:
            return description(archive)
    except OSError:
        raise
    except Exception:  # noqa: BLE001 - as the checker, which takes any error for a fault of the file
        return None


def is_on_earth(file: str | os.PathLike[str]) -> bool:
    """Return whether a proof that was verified is about a map in degrees."""
    described = _described(Path(file))
    problem = described.get("problem") if isinstance(described, dict) else None
    return isinstance(problem, dict) and bool(problem.get("on_earth"))

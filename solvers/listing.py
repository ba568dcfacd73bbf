"""
List of the built-in solvers, read from a file without importing them.

``python -m cgla_graph.solvers.write_listing`` writes the file anew; a test fails when it is out of date.
"""

import json
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import resources
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from cgla_graph._installed import read_once

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: Packages whose name for pip differs from that of their module.
_OF_PIP: Mapping[str, str] = {"skimage": "scikit-image"}
FILE = "listing.json"
ENTRY_POINT_GROUP = "cgla_graph.solvers"


@cache
def built_in() -> dict[str, dict[str, Any]]:
    """
    Return the entry of each built-in solver: ``domain``, ``promises``, ``settings``, ``summary``, ``needs``.

    Examples
    --------
    >>> built_in()["cgla"]["domain"]
    'graph'
    """
    text = (resources.files("cgla_graph.solvers") / FILE).read_text(encoding="utf-8")
    return dict(json.loads(text))


def describe(name: str) -> dict[str, str]:
    """
    Describe a built-in solver: its kind, its settings, and whether it can run here.

    Examples
    --------
    >>> describe("cgla")["promises"]
    'exact'
    """
    said = built_in()[name]
    return {
        "name": name,
        "domain": said["domain"],
        "promises": said["promises"],
        "settings": said["settings"],
        "available": lacking(said["needs"]) or "yes",
        "summary": said["summary"],
    }


def plug_ins() -> "dict[str, EntryPoint]":
    """
    Find the solvers of other distributions; a built-in wins over a plug-in of the same name.

    Examples
    --------
    >>> "cgla" in plug_ins()
    False
    """
    found = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
    return {name: point for name, point in sorted(found.items()) if name not in built_in()}


def lacking(packages: Iterable[str]) -> str | None:
    """
    Say which packages are not installed, and how to get them; None if all are.

    Examples
    --------
    >>> lacking(["numpy"]) is None, lacking(["no_such_package"])
    (True, 'needs no_such_package, which is not installed (pip install no_such_package)')
    """
    found = [distribution_of(package) for package in packages if not _is_installed(package)]
    return f"needs {', '.join(found)}, which is not installed (pip install {' '.join(found)})" if found else None


def distribution_of(package: str) -> str:
    """
    Return the name of a package for pip, by the name of its module.

    Examples
    --------
    >>> distribution_of("skimage"), distribution_of("ompl")
    ('scikit-image', 'ompl')
    """
    return _OF_PIP.get(package, package)


def entry_points(group: str) -> "Iterable[EntryPoint]":
    """Find entry points of other distributions; completing built-in names does not need them."""
    return _entry_points(group)


@read_once
def _entry_points(group: str) -> "tuple[EntryPoint, ...]":
    from importlib import metadata  # noqa: PLC0415 - see above

    return tuple(metadata.entry_points(group=group))


def _is_installed(package: str) -> bool:
    try:
        return find_spec(package) is not None
    except ModuleNotFoundError:
        # the package above a missing submodule is missing itself
        return False

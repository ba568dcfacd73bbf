"""Versions of what results depend on, compared between this program and the workers of a cluster."""

import importlib.metadata
import platform
import socket
from collections.abc import Iterable, Mapping, Sequence

from cgla_graph._text import listed
from cgla_graph.solvers import listing

#: Distributions on which the results of every run depend.
RESULTS_OF = ("cgla-graph", "numpy", "scipy", "shapely", "networkx", "numba")
#: Stands for the version of a package or a solver that is not there.
MISSING = "none"
#: Most differences that a message names.
MOST = 4


def environment(packages: Iterable[str] = (), solvers: Iterable[str] = ()) -> dict[str, str]:
    """
    Return versions by name: of Python, of the packages that results depend on, and of solvers' distributions.

    Parameters
    ----------
    packages
        More packages, by the names of their modules.
    solvers
        Solvers, built in or from other distributions; the version of one from elsewhere is that of its distribution.

    Examples
    --------
    >>> found = environment(["no_such_package"], ["cgla", "no-such-solver"])
    >>> found["package no_such_package"], found["solver cgla"], found["solver no-such-solver"]
    ('none', 'built in', 'none')
    """
    found = {"Python": ".".join(platform.python_version_tuple()[:2])}
    found |= {name: _version(name) for name in RESULTS_OF}
    found |= {f"package {name}": _package(name) for name in packages}
    plug_ins = listing.plug_ins()
    for name in solvers:
        point = plug_ins.get(name)
        of = None if point is None else point.dist
        version = MISSING if point is None else point.value if of is None else f"{of.name} {of.version}"
        found[f"solver {name}"] = "built in" if name in listing.built_in() else version
    return found


def differences(wanted: Mapping[str, str]) -> str:
    """
    Say how this process differs from the environment of another one; empty if it does not.

    Parameters
    ----------
    wanted
        What `environment` returned there.

    Examples
    --------
    >>> differences(environment(["numpy"], ["cgla"]))
    ''
    >>> differences({"solver mine": "my-solvers 1.0"}).partition(" has ")[2]
    "solver mine none (wanted: 'my-solvers 1.0')"
    """
    kinds: dict[str, list[str]] = {"package": [], "solver": []}
    for name in wanted:
        kind, _, rest = name.partition(" ")
        if kind in kinds:
            kinds[kind].append(rest)
    here = environment(kinds["package"], kinds["solver"])
    others = [f"{name} {here.get(name)} (wanted: {one!r})" for name, one in wanted.items() if here.get(name) != one]
    return f"{socket.gethostname()} has {listed(others, MOST)}" if others else ""


def _version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return MISSING


def _package(module: str) -> str:
    """Return the version of a package; that it is there, if its distribution has another name."""
    if listing.lacking([module]):
        return MISSING
    version = _version(listing.distribution_of(module))
    return "any" if version == MISSING else version


def needed_by(solvers: Sequence[str]) -> dict[str, str]:
    """
    Return the environment in which solvers run here, for `differences` elsewhere.

    Examples
    --------
    >>> needed_by(["cgla", "igraph"]).keys() >= {"Python", "numpy", "package igraph", "solver igraph"}
    True
    """
    # (a solver that cannot run here cannot run there either)
    able = [name for name in dict.fromkeys(solvers) if name in listing.built_in() or name in listing.plug_ins()]
    needs = [package for name in able for package in listing.built_in().get(name, {}).get("needs", ())]
    return environment(dict.fromkeys(needs), able)

"""Table of solvers: their names, and where their classes are. A new solver is one file and one row."""

import dataclasses
import difflib
import importlib
from collections.abc import Mapping
from contextlib import suppress
from importlib.metadata import EntryPoint
from types import NoneType, UnionType
from typing import Any, Literal, Union, cast, get_args, get_origin, get_type_hints

from cgla_graph._text import shown
from cgla_graph._validate import choice, instance, kind_of, truth_value
from cgla_graph.errors import SolverSettingError, SolverUnavailableError, UnknownSolverError
from cgla_graph.model.solver import Solver, Traits
from cgla_graph.solvers import listing, own

_BUILT_IN: Mapping[str, str] = {
    "cgla": "cgla_graph.solvers.exact.cgla:Cgla",
    "dijkstra": "cgla_graph.solvers.exact.dijkstra:Dijkstra",
    "networkx": "cgla_graph.solvers.exact.networkx_search:NetworkxDijkstra",
    "networkx-astar": "cgla_graph.solvers.exact.networkx_search:NetworkxAstar",
    "networkit": "cgla_graph.solvers.exact.networkit_search:Networkit",
    "igraph": "cgla_graph.solvers.exact.igraph_search:Igraph",
    "rustworkx": "cgla_graph.solvers.exact.rustworkx_search:Rustworkx",
    "eight-direction": "cgla_graph.solvers.grid.eight_direction:EightDirection",
    "lazy-theta-star": "cgla_graph.solvers.grid.lazy_theta_star:LazyThetaStar",
    "skimage-route": "cgla_graph.solvers.grid.skimage_route:SkimageRoute",
    "refine": "cgla_graph.solvers.refine:Refine",
    "hybrid": "cgla_graph.solvers.continuous.hybrid:Hybrid",
    "fast-marching": "cgla_graph.solvers.continuous.fast_marching:FastMarching",
    "weighted-regions": "cgla_graph.solvers.continuous.weighted_regions:WeightedRegions",
    "straight-line": "cgla_graph.solvers.continuous.straight_line:StraightLine",
    "q-learning": "cgla_graph.solvers.grid.q_learning:QLearning",
    "rrt-star": "cgla_graph.solvers.sampling.rrt_star:RrtStar",
    "informed-rrt-star": "cgla_graph.solvers.sampling.rrt_star:InformedRrtStar",
    "sorrt-star": "cgla_graph.solvers.sampling.rrt_star:SorrtStar",
    "bit-star": "cgla_graph.solvers.sampling.bit_star:BitStar",
    "fmt-star": "cgla_graph.solvers.sampling.fmt_star:FmtStar",
    "bfmt-star": "cgla_graph.solvers.sampling.fmt_star:BfmtStar",
    "prm-star": "cgla_graph.solvers.sampling.prm_star:PrmStar",
    "ompl-prm-star": "cgla_graph.solvers.sampling.ompl_prm_star:OmplPrmStar",
    "fbcri-style": "cgla_graph.solvers.reactive.fbcri_style:FbcriStyle",
    "cpvs-style": "cgla_graph.solvers.reactive.cpvs_style:CpvsStyle",
    "bcv-style": "cgla_graph.solvers.reactive.bcv_style:BcvStyle",
    "potential-field": "cgla_graph.solvers.reactive.potential_field:PotentialField",
    "bendy-ruler": "cgla_graph.solvers.reactive.bendy_ruler:BendyRuler",
    "visibility-graph": "cgla_graph.solvers.geometric.visibility_graph:VisibilityGraph",
    "voronoi": "cgla_graph.solvers.geometric.voronoi:VoronoiRoadmap",
    "milp": "cgla_graph.solvers.reactive.milp:Milp",
    "evolutionary": "cgla_graph.solvers.continuous.evolutionary:Evolutionary",
    "a2d-style": "cgla_graph.solvers.reactive.a2d_style:A2dStyle",
}


def names(*, installed: bool = True) -> list[str]:
    """
    List the solvers by name, built-in ones first.

    Parameters
    ----------
    installed
        Leave out those that need a package which is not installed.

    Examples
    --------
    >>> names()[:2]
    ['cgla', 'dijkstra']
    """
    truth_value("installed", installed)
    every = [*_BUILT_IN, *listing.plug_ins()]
    return [name for name in every if not installed or missing(name) is None]


def solver_class(name: str) -> type[Solver]:
    """
    Return the class behind a name, or in a file: ``./detour.py:Detour``.

    Raises
    ------
    UnknownSolverError
        If there is none; the message offers the nearest names.
    SolverUnavailableError
        If a plug-in or a file cannot be imported.

    Examples
    --------
    >>> solver_class("cgla").__name__
    'Cgla'
    """
    instance("the name of a solver", name, str, "a text, as 'hybrid'", UnknownSolverError)
    if name in _BUILT_IN:
        module, _, attribute = _BUILT_IN[name].partition(":")
        return cast("type[Solver]", getattr(importlib.import_module(module), attribute))
    if (found := own.find(name)) is not None:
        return found.kind
    # looking through all installed distributions takes milliseconds: only for names that are not built in
    plug_ins = listing.plug_ins()
    if name in plug_ins:
        return _load(plug_ins[name])
    every = [*_BUILT_IN, *plug_ins]
    head, _, tail = name.partition(":")
    if tail and head in every:
        settings = ", ".join(tail.split(":"))
        msg = f"unknown solver {shown(name)}; here, settings are arguments: {shown(head)}, {settings}"
        raise UnknownSolverError(msg)
    near = difflib.get_close_matches(name, every, n=3, cutoff=0.4)
    hint = f"did you mean {' or '.join(near)}?" if near else f"known solvers: {', '.join(every)}"
    msg = f"unknown solver {shown(name)}; {hint}"
    raise UnknownSolverError(msg)


def _load(plug_in: EntryPoint) -> type[Solver]:
    """Import a plug-in solver; wrap import errors."""
    place = f"solver {shown(plug_in.name)} ({plug_in.value})"
    try:
        kind = plug_in.load()
    except Exception as error:
        msg = f"{place} cannot be imported: {error}"
        raise SolverUnavailableError(msg) from error
    own.check_kind(kind, place)
    return cast("type[Solver]", kind)


def is_built_in(name: str) -> bool:
    """
    Say whether a solver is part of the toolkit; solvers of others may crash the process that runs them.

    Examples
    --------
    >>> is_built_in("cgla"), is_built_in("mine")
    (True, False)
    """
    return name in _BUILT_IN


def built_in_name(kind: type) -> str | None:
    """
    Return the name of a built-in solver's class; None for other classes.

    Examples
    --------
    >>> built_in_name(solver_class("cgla")), built_in_name(int)
    ('cgla', None)
    """
    place = f"{kind.__module__}:{kind.__qualname__}"
    return next((name for name, where in _BUILT_IN.items() if where == place), None)


def traits(name: str) -> Traits:
    """Return the traits of a solver (see `solver_class` for the errors)."""
    return solver_class(name).traits


def missing(name: str) -> str | None:
    """
    Say why a solver cannot run here, or None if it can.

    Raises
    ------
    UnknownSolverError
        If no solver has that name.

    Examples
    --------
    >>> missing("cgla") is None
    True
    """
    try:
        needs = traits(name).needs
        return listing.lacking(needs) if needs else None
    except SolverUnavailableError as error:
        return str(error)


def get(name: str, **settings: Any) -> Solver:  # noqa: ANN401 - each solver has settings of its own
    """
    Build a solver.

    Parameters
    ----------
    name
        As in `names`, or a class in a file, ``./detour.py:Detour``.
    **settings
        The fields of its dataclass.

    Returns
    -------
    solver
        A frozen dataclass of settings. A plug-in runs in a process of its own; if you build it yourself, in yours.

    Raises
    ------
    UnknownSolverError
        If no solver has that name.
    SolverUnavailableError
        If it needs a package that is not installed.
    SolverSettingError
        If it has no such setting, or does not allow the value.

    Examples
    --------
    >>> get("cgla", schedule="synchronous")
    Cgla(schedule='synchronous', early_stop=True, time_limit=None)
    """
    kind = solver_class(name)
    reason = missing(name)
    if reason is not None:
        msg = f"solver {shown(name)} {reason}"
        raise SolverUnavailableError(msg)
    known = setting_names(kind)
    unknown = [key for key in settings if key not in known]
    if unknown:
        msg = f"{name} has no setting {shown(unknown[0])}; it has {', '.join(known) or 'none'}"
        raise SolverSettingError(msg)
    if not is_built_in(name):
        _check_hints(name, kind, settings)
        return _isolated(kind(**settings))
    return kind(**settings)


def ready(solver: str | Solver, settings: Mapping[str, Any]) -> Solver:
    """
    Build a solver that is given by name, or return a built one, which takes no settings.

    Raises
    ------
    SolverSettingError
        If there are settings beside a built solver; else as `get`.

    Examples
    --------
    >>> ready("cgla", {"early_stop": False}).early_stop
    False
    """
    if isinstance(solver, str):
        return get(solver, **settings)
    check_ready(solver)
    if settings:
        msg = f"settings {', '.join(settings)} beside a ready solver; give the solver by name, or build it with them"
        raise SolverSettingError(msg)
    return solver


def check_ready(solver: object) -> None:
    """
    Refuse objects that are not solvers.

    Raises
    ------
    SolverSettingError
        If it is a class instead of an instance, or has no traits or no method `solve`.

    Examples
    --------
    >>> check_ready(get("cgla"))
    """
    if isinstance(solver, type):
        msg = f"solver is the class {solver.__name__}; give an instance, as {solver.__name__}()"
        raise SolverSettingError(msg)
    said = getattr(solver, "traits", None)
    if not isinstance(said, Traits) or not callable(getattr(solver, "solve", None)):
        wanted = "a name, as 'hybrid', or a solver with traits and a method solve, as cg.solvers.get('hybrid')"
        msg = f"solver is {kind_of(solver)}; give {wanted}"
        raise SolverSettingError(msg)
    choice(f"the domain of {said.name}", said.domain, ("graph", "plane"), SolverSettingError)


def _isolated(solver: Solver) -> Solver:
    """Mark a plug-in to run in a process of its own; one without a ``__dict__`` cannot be marked."""
    with suppress(AttributeError):
        object.__setattr__(solver, "traits", dataclasses.replace(solver.traits, isolated=True))
    return solver


def _check_hints(name: str, kind: type[Solver], settings: Mapping[str, Any]) -> None:
    """Check settings against the type hints of a plug-in's fields; built-in solvers check their own."""
    try:
        hints = get_type_hints(kind)
    except (NameError, TypeError):
        # hints for type checkers only
        return
    for key, value in settings.items():
        if not _fits(value, hints.get(key, Any)):
            wanted = hints[key].__name__ if isinstance(hints[key], type) else str(hints[key]).replace("typing.", "")
            msg = f"{name}: {key} is {shown(value)}; its type is {wanted}"
            raise SolverSettingError(msg)


def _fits(value: object, hint: Any) -> bool:  # noqa: ANN401 - any type form
    """Whether a value is of a simple type, one of a union, or a literal; other hints take any value."""
    if get_origin(hint) in {Union, UnionType}:
        return any(_fits(value, part) for part in get_args(hint))
    if get_origin(hint) is Literal:
        return value in get_args(hint)
    if hint is None or hint is NoneType:
        return value is None
    if hint in {int, float}:
        wanted = int if hint is int else int | float
        return isinstance(value, wanted) and not isinstance(value, bool)
    return not isinstance(hint, type) or isinstance(value, hint)


def setting_names(kind: type[Solver]) -> list[str]:
    """List the settings of a solver class."""
    return [field.name for field in dataclasses.fields(cast("Any", kind))]


def describe(name: str) -> dict[str, str]:
    """
    Describe a solver: its kind, its settings, and whether it can run here.

    Examples
    --------
    >>> describe("cgla")["promises"]
    'exact'
    """
    lacking = missing(name)
    try:
        kind = solver_class(name)
    except SolverUnavailableError:
        return {"name": name, "domain": "", "promises": "", "settings": "", "available": str(lacking), "summary": ""}
    promises = {
        "exact": kind.traits.exact,
        "anytime": kind.traits.anytime,
        "seeded": kind.traits.seeded,
        "no rasters": not kind.traits.rasters,
    }
    return {
        "name": name,
        "domain": kind.traits.domain,
        "promises": ", ".join(word for word, holds in promises.items() if holds),
        "settings": ", ".join(setting_names(kind)),
        "available": lacking or "yes",
        "summary": kind.traits.summary,
    }

"""Warm-up: kernels are compiled, or loaded from disk, before a solver's first run is timed."""

import dataclasses
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, TypeVar, cast

import numpy as np

from cgla_graph.certificate import corners
from cgla_graph.certificate.certificate import load_kernels
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.no_fly_kernels import segments_cross
from cgla_graph.model.problem import FULL_UP_TO
from cgla_graph.model.small_problem import SMALL_PATH, load_oracle, small_problem
from cgla_graph.model.solver import Solver
from cgla_graph.refine.refine import refine_path
from cgla_graph.refine.refine_kernels import minimise, shortcut

SolverT = TypeVar("SolverT", bound=Solver)

#: Limits of a short run, by the names of settings; a gap that is asked for is wide, as a narrow one takes long.
_SMALL: Mapping[str, float] = {
    "iterations": 200,
    "milestones": 100,
    "samples": 100,
    "seconds": 0.5,
    "resolution": 8,
    "tolerance": 0.1,
}
#: Without areas, any gap will do: `load_kernels` has all that a proof needs there.
_ANY_GAP = 1e3
#: Runs made in this process: class of solver, with refinement or not, and kind of map.
_ready: set[tuple[type, bool, MapKind]] = set()


def shortened(solver: SolverT, *, walls: bool = True) -> SolverT:
    """
    Return a solver with small limits on its run, on maps with areas or without, and its other settings as they are.

    Examples
    --------
    >>> from cgla_graph.solvers.sampling.prm_star import PrmStar
    >>> shortened(PrmStar(seed=7)).milestones, shortened(PrmStar(seed=7)).seed
    (100, 7)
    """
    names = {setting.name for setting in dataclasses.fields(cast("Any", solver))}
    # (without a tolerance, there is no proof)
    names -= {"tolerance"} if getattr(solver, "tolerance", None) is None else set()
    limits = _SMALL if walls else {**_SMALL, "tolerance": _ANY_GAP}
    small = {name: value for name, value in limits.items() if name in names}
    return dataclasses.replace(cast("Any", solver), **small)  # type: ignore[no-any-return]


def warm_up(solver: Solver, kind: MapKind, *, refine: bool = False) -> None:
    """
    Run a solver of the toolkit on a small problem, once in a process, so that its first timed run compiles nothing.

    Isolated solvers warm up in their own process, and solvers of others may have side effects: neither is run. The
    kernels that evaluate paths are loaded in any case.

    Parameters
    ----------
    solver
        The solver that is going to run.
    kind
        Kind of map; kernels that only other kinds need are not loaded.
    refine
        Whether its path is going to be refined.

    Examples
    --------
    >>> from cgla_graph.solvers.exact.cgla import Cgla
    >>> warm_up(Cgla(), MapKind())
    """
    load_oracle(kind)
    of = type(solver)
    if (of, refine, kind) in _ready or not of.__module__.startswith("cgla_graph.") or solver.traits.isolated:
        return
    _ready.add((of, refine, kind))
    problem = small_problem(kind)
    # errors of a solver are reported by its own run
    with suppress(Exception):
        short: Any = shortened(solver, walls=kind.walls)
        if solver.traits.domain == "graph":
            answer = short.solve(problem.on_lattice(2).with_weights_held())
        else:
            answer = short.solve(problem)
        problem.judge(answer)
        if refine:
            refine_path(problem, answer.path)


def warm_up_restricted(solver: Solver, n_nodes: int, kind: MapKind) -> None:
    """
    Load the kernels of `cgla_graph.restricted` if a solver is going to use it on a graph of `n_nodes` nodes.

    Examples
    --------
    >>> from cgla_graph.solvers.exact.cgla import Cgla
    >>> warm_up_restricted(Cgla(), n_nodes=400, kind=MapKind())
    """
    if solver.traits.lazy and n_nodes > FULL_UP_TO:
        from cgla_graph.restricted import restricted  # noqa: PLC0415 - slow to import, and rarely used

        restricted.load_kernels(kind)


def load_last_first(kind: MapKind) -> None:
    """
    Load the kernels of a plan in another order than the plan: areas, refinement and proofs, then those beside walls.

    Two processes in different orders compile about half of the kernels each. The slowest kernels come first here, each
    by its own call, and the other process begins with line integrals and meshes: neither waits for the other.

    Examples
    --------
    >>> load_last_first(MapKind())
    """
    path, model = np.array(SMALL_PATH), small_problem(kind).model.kernel_model()
    segments_cross(path[:-1], path[1:], model[2])
    minimise(path, path, np.zeros((3, 2)), 1.0, 1.0, model[1], 1, np.zeros(3))
    shortcut(path, model, 1, np.ones(3, dtype=np.bool_))
    load_kernels(kind._replace(walls=False))
    if kind.walls:
        # (before the mesh beside walls, with which the other process begins)
        corners.load_kernels()
        load_kernels(kind)

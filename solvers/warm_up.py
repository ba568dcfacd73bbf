"""Kernels are compiled, or loaded from disk, before the clock of a solver's first run starts."""

import dataclasses
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, TypeVar, cast

import shapely

from cgla_graph.model.problem import FULL_UP_TO, Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solver import Solver
from cgla_graph.refine.refine import refine_path

SolverT = TypeVar("SolverT", bound=Solver)

#: Limits of a short run, by the names of settings.
_SMALL: Mapping[str, float] = {"iterations": 200, "milestones": 100, "samples": 100, "seconds": 0.5, "resolution": 8}
#: What has been run in this process: kinds of solvers, and whether with refinement.
_ready: set[tuple[type, bool]] = set()


def shortened(solver: SolverT) -> SolverT:
    """
    Return a solver with small limits on its run, and its other settings as they are.

    Examples
    --------
    >>> from cgla_graph.solvers.sampling.prm_star import PrmStar
    >>> shortened(PrmStar(seed=7)).milestones, shortened(PrmStar(seed=7)).seed
    (100, 7)
    """
    names = {setting.name for setting in dataclasses.fields(cast("Any", solver))}
    small = {name: value for name, value in _SMALL.items() if name in names}
    return dataclasses.replace(cast("Any", solver), **small)  # type: ignore[no-any-return]


def warm_up(solver: Solver, *, refine: bool = False) -> None:
    """
    Run a solver of the toolkit on a small problem, once in a process; what its first run takes is then its own time.

    Solvers that run in a process of their own are made ready there, and what is not the toolkit's may do anything:
    neither is run.

    Parameters
    ----------
    solver
        What is going to be run.
    refine
        Whether its path is going to be refined.

    Examples
    --------
    >>> from cgla_graph.solvers.exact.cgla import Cgla
    >>> warm_up(Cgla())
    """
    kind = type(solver)
    if (kind, refine) in _ready or not kind.__module__.startswith("cgla_graph.") or solver.traits.isolated:
        return
    _ready.add((kind, refine))
    problem = small_problem()
    # what is wrong with a solver is told by its own run
    with suppress(Exception):
        short: Any = shortened(solver)
        if solver.traits.domain == "graph":
            answer = short.solve(problem.on_lattice(2).weighed())
        else:
            answer = short.solve(problem)
        problem.judge(answer)
        if refine:
            refine_path(problem, answer.path)


def warm_up_restricted(solver: Solver, n_nodes: int) -> None:
    """
    Load what `cgla_graph.restricted` needs, if a solver is going to use it on a graph of so many nodes.

    Examples
    --------
    >>> from cgla_graph.solvers.exact.cgla import Cgla
    >>> warm_up_restricted(Cgla(), n_nodes=400)
    """
    if solver.traits.lazy and n_nodes > FULL_UP_TO:
        from cgla_graph.restricted.restricted import load_kernels  # noqa: PLC0415 - slow to import, and rarely used

        load_kernels()


def small_problem() -> Problem:
    """
    Return a problem with a threat and a wall, so that every kernel has something to do.

    Examples
    --------
    >>> len(small_problem().field)
    1
    """
    field = RiskField([Threat(0.5, 0.5, 0.1)])
    return Problem((0.0, 0.0), (1.0, 1.0), field, k=1.0, no_fly=shapely.box(0.45, 0.2, 0.55, 0.8))

"""Kernels are compiled, or loaded from disk, before the clock of a solver's first run starts."""

import dataclasses
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, TypeVar, cast

import numpy as np
import shapely

from cgla_graph.certificate.certificate import load_kernels
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.problem import FULL_UP_TO, Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_kernels import segment_cost
from cgla_graph.model.solver import Solver
from cgla_graph.refine.refine import refine_path
from cgla_graph.refine.refine_kernels import minimise

SolverT = TypeVar("SolverT", bound=Solver)

#: Limits of a short run, by the names of settings.
_SMALL: Mapping[str, float] = {"iterations": 200, "milestones": 100, "samples": 100, "seconds": 0.5, "resolution": 8}
#: What has been run in this process: kinds of solvers, whether with refinement, and whether beside walls.
_ready: set[tuple[type, bool, bool]] = set()


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


def warm_up(solver: Solver, *, refine: bool = False, walls: bool = True) -> None:
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
    walls
        Whether there may be a no-fly area; without one, the kernels that only an area needs are left alone.

    Examples
    --------
    >>> from cgla_graph.solvers.exact.cgla import Cgla
    >>> warm_up(Cgla())
    """
    kind = type(solver)
    if (kind, refine, walls) in _ready or not kind.__module__.startswith("cgla_graph.") or solver.traits.isolated:
        return
    _ready.update({(kind, refine, walls), (kind, refine, False)})
    problem = small_problem(walls=walls)
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
        from cgla_graph.restricted import restricted  # noqa: PLC0415 - slow to import, and rarely used

        restricted.load_kernels()


def load_last_first() -> None:
    """
    Load what a plan needs, in another order than it does: of costs, refinement, proofs and lattices, then beside walls.

    So two processes compile about half of the kernels each. What takes longest is loaded first, by its own call: the
    other process does not wait for it, and neither does this one for anything before.

    Examples
    --------
    >>> load_last_first()
    """
    risk = RiskField([Threat(0.5, 0.5, 0.1)]).kernel_field()
    segment_cost(0.0, 0.0, 1.0, 1.0, 1.0, risk)
    ends = np.array([(0.0, 0.0), (1.0, 1.0)])
    minimise(ends, ends, np.zeros((2, 2)), 1.0, 1.0, risk, 1, np.zeros(2))
    for walls in (False, True):
        load_kernels(walls=walls)
        problem = small_problem(walls=walls)
        refine_path(problem, [problem.start, (0.2, 0.9), problem.goal])
        on = problem.on_lattice(2).weighed()
        cost_matrix(on.graph, on.target)


def small_problem(*, walls: bool = True) -> Problem:
    """
    Return a problem with a threat and perhaps a wall, so that every kernel that is needed has something to do.

    Examples
    --------
    >>> len(small_problem().field), small_problem(walls=False).model.area.is_empty
    (1, True)
    """
    field = RiskField([Threat(0.5, 0.5, 0.1)])
    wall = shapely.box(0.45, 0.2, 0.55, 0.8) if walls else None
    return Problem((0.0, 0.0), (1.0, 1.0), field, k=1.0, no_fly=wall)

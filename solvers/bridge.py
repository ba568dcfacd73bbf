"""`solve`: one problem, one solver, one answer that the oracle has judged."""

import dataclasses
import time
from typing import Any, cast

import numpy as np

from cgla_graph.errors import ProblemError, SolverSettingError
from cgla_graph.lattice import Lattice
from cgla_graph.problem import GraphProblem, Problem
from cgla_graph.solution import Solution, Status
from cgla_graph.solvers import registry
from cgla_graph.solvers.base import GraphSolver, PlaneSolver, Solver

#: Up to this many nodes, a complete graph is weighed at once (288 MB), so that build and solve time part cleanly.
DENSE_UP_TO = 6000


def solve(
    problem: Problem | GraphProblem,
    solver: str | Solver = "cgla",
    *,
    resolution: int | tuple[int, int] | Lattice = 20,
    on: GraphProblem | None = None,
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> Solution:
    """
    Solve a problem and have the oracle judge the answer.

    Parameters
    ----------
    problem
        A `Problem` in the plane, which every solver takes, or a `GraphProblem`, which graph solvers take.
    solver
        A name (see `cgla_graph.solvers.names`) or a solver.
    resolution
        For solvers that need a lattice: points a side, or a `Lattice`.
    on
        The same problem laid on a graph before (`Problem.on_lattice`), to share its weights between graph solvers.
    settings
        Settings of a solver given by name.

    Returns
    -------
    solution
        Its numbers are the oracle's; the time to weigh the graph is apart from the time to solve. That no path was
        found is a status.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError, SolverSettingError
        If there is no such solver, it cannot run here, or a setting is wrong.
    ProblemError
        If `problem` is no problem, or the resolution is malformed.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> field = cg.RiskField([cg.Threat(x=0.5, y=0.5, spread=0.1, peak=0.9)])
    >>> problem = cg.Problem(start=(0.1, 0.1), goal=(0.9, 0.9), field=field, k=10.0)
    >>> solution = cg.solve(problem, solver="cgla", resolution=20)
    >>> solution.status.label, bool(solution.cost < problem.evaluate([problem.start, problem.goal]).cost)
    ('optimal', True)
    """
    if isinstance(solver, str):
        chosen = registry.get(solver, **settings)
    elif settings:
        msg = f"settings {', '.join(settings)} beside a ready solver; give the solver by name, or build it with them"
        raise SolverSettingError(msg)
    else:
        chosen = solver
    if not isinstance(problem, Problem | GraphProblem):
        msg = f"problem is a {type(problem).__name__}; give a Problem, or a GraphProblem for a graph of your own"
        raise ProblemError(msg)
    if isinstance(problem, GraphProblem):
        return _solve_graph(problem, _graph_solver(chosen))
    if problem.start == problem.goal:
        return _stay(problem, chosen)
    if chosen.traits.domain == "plane":
        return _solve_plane(problem, _with_resolution(chosen, resolution))
    began = time.perf_counter()
    graph_problem = weighed(on or problem.on_lattice(resolution))
    laid = time.perf_counter() - began
    answer = _solve_graph(graph_problem, _graph_solver(chosen))
    return problem.judge(dataclasses.replace(answer, build_seconds=laid + answer.build_seconds))


def weighed(problem: GraphProblem) -> GraphProblem:
    """Weigh a complete graph at once if its matrix is affordable; larger ones are weighed row by row, when asked."""
    if problem.graph.is_implicit and problem.graph.n_nodes <= DENSE_UP_TO:
        problem.graph.weight_matrix()
    return problem


def _solve_graph(problem: GraphProblem, solver: GraphSolver) -> Solution:
    answer = _timed(solver, problem)
    return problem.judge(dataclasses.replace(answer, evaluations=problem.graph.n_pairs + answer.evaluations))


def _solve_plane(problem: Problem, solver: PlaneSolver) -> Solution:
    return problem.judge(_timed(solver, problem))


def _timed(solver: Any, problem: Problem | GraphProblem) -> Solution:  # noqa: ANN401 - of either kind
    """Run a solver against the clock; what it says it spent on building is not solving."""
    began = time.perf_counter()
    answer: Solution = solver.solve(problem)
    seconds = time.perf_counter() - began - answer.build_seconds
    return dataclasses.replace(answer, solver=solver.traits.name, seconds=seconds)


def _stay(problem: Problem, solver: Solver) -> Solution:
    """Answer a problem whose start is its goal, which needs no solver."""
    answer = Solution(Status.OPTIMAL, path=np.array([problem.start]), cost=0.0, lower_bound=0.0)
    return problem.judge(dataclasses.replace(answer, solver=solver.traits.name))


def _graph_solver(solver: Solver) -> GraphSolver:
    if solver.traits.domain != "graph" or not isinstance(solver, GraphSolver):
        msg = f"{solver.traits.name} plans in the plane, not on a graph; give it a Problem"
        raise SolverSettingError(msg)
    return solver


def _with_resolution(solver: Solver, resolution: int | tuple[int, int] | Lattice) -> PlaneSolver:
    """Hand the resolution to a plane solver that has such a setting and left it open."""
    if getattr(solver, "resolution", 0) is None:
        return cast("PlaneSolver", dataclasses.replace(cast("Any", solver), resolution=resolution))
    return cast("PlaneSolver", solver)

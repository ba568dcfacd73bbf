"""
The contract of solvers, as checks that anyone can run on a solver of their own.

>>> from cgla_graph.solvers import get
>>> check_solver(get("cgla"))
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import shapely

from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.errors import SolverFaultError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import Interpolation, RasterRisk
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import NO_RASTERS, GraphSolver, PlaneSolver, Solver, is_blind_to
from cgla_graph.solvers.solving import solve

#: Statuses of answers without a path, whether proven or not.
NOTHING = {Status.NO_PATH, Status.NOT_FOUND, Status.INFEASIBLE, Status.STUCK}
#: Cells along each side of the raster that stands for a threat.
FINE = 40


@dataclass(frozen=True)
class SolverCheck:
    """
    A check of a solver's contract, to be called with the solver.

    Attributes
    ----------
    name
        The check, and its problem.
    run
        Raises `AssertionError` if the solver breaks the contract.
    """

    name: str
    run: Callable[[Any], None]

    def __call__(self, solver: Solver) -> None:
        """Check a solver."""
        self.run(solver)

    def __str__(self) -> str:
        """Return the name."""
        return self.name


def check_solver(solver: Solver) -> None:
    """
    Check that a solver keeps its contract, on small problems whose answers are known.

    Parameters
    ----------
    solver
        A solver of either domain.

    Raises
    ------
    AssertionError
        If it breaks the contract; the message says where.

    Notes
    -----
    Checked of every solver: its answer is a `Solution` that the oracle confirms, with a path from start to goal;
    the same problem gives the same answer again; nothing passed in is changed; where there is no path it says so
    instead of raising; start equal to goal is a path of no length. Of an exact graph solver: the cost is the optimum.
    Of an anytime solver: the trace falls, and ends at the cost. Of a solver that knows no-fly areas: its path is
    feasible. A graph solver that is not exact, and one that is not complete, may find nothing. Of a solver that takes
    risk on rasters: if it turns aside for a threat, then for a raster of the same risk as well; of one that does not:
    it says so.

    Examples
    --------
    >>> from cgla_graph.solvers import get
    >>> check_solver(get("straight-line"))
    """
    for check in solver_checks(solver):
        check(solver)


def solver_checks(solver: Solver) -> list[SolverCheck]:
    """
    Return the checks that `check_solver` makes of a solver, one for each problem.

    Raises
    ------
    AssertionError
        If the solver's domain is unknown.

    Examples
    --------
    >>> from cgla_graph.solvers import get
    >>> [check.name for check in solver_checks(get("cgla"))][:2]
    ['on an empty map', 'on one threat']
    """
    traits = solver.traits
    _require(traits.domain in {"graph", "plane"}, f"{traits.name}: unknown domain {traits.domain!r}")
    checks = [SolverCheck(f"on {title}", partial(_check_plane, title, problem)) for title, problem in plane_problems()]
    if traits.rasters:
        checks.append(SolverCheck("turns aside for a raster as for a threat", _check_sees_rasters))
    if traits.domain == "graph":
        checks += [SolverCheck(f"on {title}", partial(_check_graph, title, one)) for title, one in graph_problems()]
    elif not traits.seeded:
        checks.append(SolverCheck("on a goal that is walled in", _check_unbudgeted))
    return checks


def graph_problems() -> Iterator[tuple[str, GraphProblem]]:
    """Yield small graph problems by name, those that solvers tend to get wrong."""
    inf = np.inf
    detour = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]], labels="abc")
    yield "a detour of two edges", GraphProblem(detour, "a", "c")
    free = GeometricGraph.from_matrix([[0, 0, 5], [0, 0, 0], [5, 0, 0]])
    yield "edges of weight zero", GraphProblem(free, 0, 2)
    split = GeometricGraph.from_matrix([[0, 1, inf], [1, 0, inf], [inf, inf, 0]])
    yield "no way to the target", GraphProblem(split, 0, 2)
    one_way = GeometricGraph.from_matrix([[0, 1, inf], [inf, 0, 1], [1, inf, 0]])
    yield "one-way edges", GraphProblem(one_way, 0, 2)
    yield "against one-way edges", GraphProblem(one_way, 2, 1)
    yield "source equal to target", GraphProblem(detour, "b", "b")
    threats = [Threat(0.5, 0.5, 0.1), Threat(0.3, 0.6, 0.07, peak=0.5)]
    lattice = GeometricGraph.complete(Lattice(6, bounds=(0, 0, 1, 1)), RiskField(threats), k=10.0)
    yield "a lattice with threats", GraphProblem(lattice, 0, 35)


def plane_problems() -> Iterator[tuple[str, Problem]]:
    """Yield small problems in the plane by name; all of them have a path."""
    yield "an empty map", Problem((0.1, 0.1), (0.9, 0.8))
    yield "one threat", Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    yield "start at goal", Problem((0.5, 0.5), (0.5, 0.5), RiskField([Threat(0.5, 0.5, 0.1)]), k=1.0)
    yield (
        "a map in metres",
        Problem((-4e4, 0), (5e4, 3e4), RiskField([Threat(0, 0, 5e3)]), k=5.0, bounds=(-6e4, -6e4, 6e4, 6e4)),
    )
    wall = shapely.box(0.49, 0.2, 0.51, 1.0)
    yield "a wall", Problem((0.1, 0.7), (0.9, 0.7), no_fly=wall)
    smooth, whole = _blocks("bilinear"), _blocks("nearest")
    threat = Threat(0.7, 0.6, 0.1)
    yield "a bilinear raster", Problem((0.1, 0.5), (0.9, 0.45), RiskField(rasters=[smooth]), k=10.0)
    yield "a raster of whole cells", Problem((0.1, 0.5), (0.9, 0.45), RiskField(rasters=[whole]), k=10.0)
    yield (
        "a bilinear raster and a threat",
        Problem((0.1, 0.1), (0.9, 0.9), RiskField([threat], rasters=[smooth]), k=5.0),
    )
    yield (
        "a raster of whole cells, a threat and a wall",
        Problem((0.1, 0.7), (0.9, 0.7), RiskField([threat], rasters=[whole]), k=5.0, no_fly=wall),
    )


def _blocks(interpolation: Interpolation) -> RasterRisk:
    """Return a raster that does not cover the map, with a block in the middle: far riskier than any threat."""
    values = np.full((7, 7), 0.05)
    values[2:5, 2:5] = 3.0
    return RasterRisk(values, (0.05, 0.1, 0.95, 0.9), interpolation=interpolation)


def _require(holds: object, message: str) -> None:
    """Raise with the message unless `holds`; an assert would vanish under ``python -O``."""
    if not holds:
        raise AssertionError(message)


def _check_plane(title: str, problem: Problem, solver: Solver) -> None:
    place = f"{solver.traits.name} on {title}"
    answer = _same_twice(place, partial(solve, problem, solver, resolution=8))
    if is_blind_to(problem, solver.traits):
        said = (answer.status, answer.message) == (Status.UNSUPPORTED, NO_RASTERS)
        _require(said, f"{place}: {answer.status.label}, though it takes no rasters")
        return
    if problem.no_fly is not None and not solver.traits.no_fly:
        _require(answer.status in {Status.INFEASIBLE, Status.FOUND}, f"{place}: {answer.status.label}")
        return
    modest = not solver.traits.complete or (solver.traits.domain == "graph" and not solver.traits.exact)
    if modest and answer.status in NOTHING:
        return
    _require(answer.status.has_path, f"{place}: {answer.status.label}: {answer.message}")
    _require(tuple(answer.path[0]) == problem.start, f"{place}: the path does not begin at the start")
    _require(tuple(answer.path[-1]) == problem.goal, f"{place}: the path does not end at the goal")
    shortest = float(np.hypot(*np.subtract(problem.start, problem.goal)))
    _require(answer.cost >= shortest * (1 - 1e-12), f"{place}: cheaper than the straight line is long")
    if solver.traits.anytime and problem.start != problem.goal:
        _check_trace(place, answer)


def _check_sees_rasters(solver: Solver) -> None:
    """Replace a threat by a raster: a solver that avoids the one has to avoid the other."""
    threat = Threat(0.5, 0.5, 0.1)
    centres = (np.arange(FINE) + 0.5) / FINE
    values = RiskField([threat]).density(np.stack(np.meshgrid(centres, centres), axis=-1))
    fields = RiskField([threat]), RiskField(rasters=[RasterRisk(values, (0.0, 0.0, 1.0, 1.0))])
    problems = [Problem((0.1, 0.2), (0.9, 0.7), field, k=10.0) for field in fields]
    of_threat, of_raster = (solve(problem, solver, resolution=8) for problem in problems)
    straight = problems[0].evaluate([problems[0].start, problems[0].goal]).cost
    if of_threat.status.has_path and of_raster.status.has_path:
        saved, saved_too = straight - of_threat.cost, straight - of_raster.cost
        sees = saved_too >= 0.5 * saved
        _require(
            sees, f"{solver.traits.name}: saves {saved:.3g} around a threat, {saved_too:.3g} around it as a raster"
        )


def _check_trace(place: str, answer: Solution) -> None:
    costs = [moment.cost for moment in answer.trace]
    _require(costs, f"{place}: an anytime solver without a trace")
    _require(costs == sorted(costs, reverse=True), f"{place}: the trace rises")
    _require(abs(costs[-1] - answer.cost) <= 1e-6 * answer.cost, f"{place}: the trace does not end at the cost")


def _check_unbudgeted(solver: PlaneSolver) -> None:
    """Wall the goal in: a solver that does not run out of budget has to say that there is no path."""
    ring = shapely.box(0.6, 0.6, 1.0, 1.0).difference(shapely.box(0.7, 0.7, 0.9, 0.9))
    answer = solve(Problem((0.1, 0.1), (0.8, 0.8), no_fly=ring), solver, resolution=12)
    _require(answer.status in NOTHING, f"{solver.traits.name}: found a path into a closed ring")


def _check_graph(title: str, problem: GraphProblem, solver: GraphSolver) -> None:
    place = f"{solver.traits.name} on {title}"
    before = problem.graph.weight_matrix().copy()
    answer = _same_twice(place, partial(solve, problem, solver))
    _require(np.array_equal(before, problem.graph.weight_matrix()), f"{place}: changed the weights")
    best = cost_matrix(problem.graph, problem.target).value(problem.source)
    if not np.isfinite(best):
        _require(answer.status in NOTHING, f"{place}: {answer.status.label}, but there is no way")
        return
    if answer.status.has_path:
        _require(answer.cost >= best - 1e-12 * best, f"{place}: {answer.cost} is below the optimum {best}")
    if solver.traits.exact:
        _require(answer.status is Status.OPTIMAL, f"{place}: {answer.status.label}: {answer.message}")
        _require(answer.cost <= best + 1e-12 * best, f"{place}: {answer.cost}, the optimum is {best}")


def _same_twice(place: str, run: Callable[[], Any]) -> Solution:
    """Run twice: the answer has to be a judged solution, and the same both times."""
    try:
        first, second = run(), run()
    except SolverFaultError as error:
        # the solver has changed its problem
        raise AssertionError(str(error)) from error
    if not isinstance(first, Solution):
        msg = f"{place}: the answer is {type(first).__name__}, not a Solution"
        raise AssertionError(msg)  # noqa: TRY004 - a broken contract, like all the others
    _require(first.status is not Status.FAILED, f"{place}: {first.message}")
    _require((first.status, first.nodes) == (second.status, second.nodes), f"{place}: another answer the second time")
    _require(np.array_equal(first.path, second.path), f"{place}: another path the second time")
    return first

"""Fast marching: the eikonal solution on a grid, and the path of steepest descent."""

import math
import time
from dataclasses import dataclass
from typing import Annotated, ClassVar

from cgla_graph._types import FloatArray
from cgla_graph.certificate.subsolution import in_line
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import costs_to_go, descent, node_costs
from cgla_graph.eikonal.mesh import SplineMesh
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Settings, Whole

#: Spacings from the goal within which costs begin as those of straight lines, and the descent ends.
NEAR = 4.0
#: Cells along the longer side of the bounds, by default and at most.
CELLS, MOST_CELLS = 256, 2048
#: Least number of cells over which the cost may change e-fold without a warning: with fewer, paths were up to 0.5 %
#: above the best at ``k = 1000``.
RESOLVED = 2.5
#: Cells of a raster along one of a grid from which on it is said to be sampled: rounding to whole numbers is not.
MANY = 1.05


@dataclass(frozen=True)
class FastMarching(Settings):
    """
    Solves ``|grad T| = 1 + k F`` with ``T(goal) = 0`` in one pass over a grid (Tsitsiklis 1995; Sethian 1996).

    ``T`` is the least cost to the goal from everywhere, and the path of steepest descent from the start is the best
    one, up to an error that falls with the spacing of the grid (``order``). Near the goal the path is straight. The
    grid is cut open along no-fly areas, so that no cost leaks through walls, unless they are thinner than about
    1/20,000 of the map; where the descent cuts a corner of an area, the path is led around it: over the best of all
    polylines through its own points and the corners beside it.

    Where threats may change the cost e-fold within 2.5 cells, the message says so: among narrow threats, or at great
    ``k``, the path with the usual number of cells was up to 0.5 % above the best one. So it does where the grid has
    fewer cells than a raster, of which it then takes samples.

    `Solution.evaluations` counts the nodes of the grid, at each of which the cost is computed once.

    Attributes
    ----------
    cells
        Along the longer side of the bounds; None: 256, or over a raster as many as its own, if those are more, up to
        2048.
    order
        Of the differences: 1, or 2 where smoothness allows.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> answer = FastMarching(cells=400).solve(problem)
    >>> round(answer.cost, 3)
    1.352
    """

    cells: Annotated[int, Whole(8, 4096)] | None = None
    order: Annotated[int, Whole(1, 2)] = 2

    traits: ClassVar[Traits] = Traits(
        "fast-marching", "the eikonal solution and its steepest descent", domain="plane", needs_positive=True
    )

    def solve(self, problem: Problem) -> Solution:
        """March from the goal, and descend from the start."""
        began = time.perf_counter()
        columns, rows = self._grid(problem)
        second = self.order == 2  # noqa: PLR2004 - one of two
        found = marched(problem, (columns, rows), second=second)
        path, n_nodes, build_seconds = found.path, found.mesh.n_nodes, found.laid - began
        if not len(path):
            message = f"no way down to the goal on {columns} x {rows} cells"
            return Solution(Status.NOT_FOUND, build_seconds=build_seconds, evaluations=n_nodes, message=message)
        cost, message = problem.evaluate(path).cost, ""
        within = least_change(problem) / max(found.mesh.spacing)
        if within < RESOLVED:
            message = f"the cost may change e-fold within {within:.2g} cells: with more `cells`, the path may cost less"
        message = "; ".join(filter(None, [message, sampled(problem, (columns, rows))]))
        return Solution(
            Status.FOUND,
            path=path,
            cost=cost,
            build_seconds=build_seconds,
            evaluations=n_nodes,
            message=message,
        )

    def _grid(self, problem: Problem) -> tuple[int, int]:
        """Return how many cells there are along each side."""
        x_min, y_min, x_max, y_max = problem.bounds
        sides = x_max - x_min, y_max - y_min
        cells: float = CELLS
        if self.cells is not None:
            cells = self.cells
        elif problem.field.rasters:
            cells = min(max(CELLS, max(sides) / finest_cell(problem)), MOST_CELLS)
        columns, rows = (max(8, round(cells * side / max(sides))) for side in sides)
        return in_line(problem, (columns, rows)) if self.cells is None else (columns, rows)


def least_change(problem: Problem) -> float:
    """
    Bound the distance over which a threat, by itself, changes the cost of a unit of length by a factor of e, map units.

    Beside it, ``c = 1 + k f`` changes by ``|grad c| / c = r / s^2 * k f / (1 + k f)`` a unit of length, where ``f = p
    exp(-r^2 / (2 s^2))``. That is below ``sqrt(2 log(1 + k p)) / s``: where ``k f > 1``, ``r`` is below ``s sqrt(2 log
    k p)``, and elsewhere the last factor is small.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> round(least_change(Problem((0, 0), (1, 1), RiskField([Threat(0.5, 0.5, 0.1)]), k=1000.0)), 3)
    0.027
    """
    threats = problem.field.every_threat
    steepest = max((math.sqrt(2.0 * math.log1p(problem.k * one.peak)) / one.spread for one in threats), default=0.0)
    return 1.0 / steepest if steepest > 0.0 else math.inf


def finest_cell(problem: Problem) -> float:
    """Return the least side of a cell of the rasters of a problem, map units; infinite without any."""
    return min((min(raster.cell_size) for raster in problem.field.rasters), default=math.inf)


def sampled(problem: Problem, last: tuple[int, int]) -> str:
    """
    Say that a grid takes samples of a raster, as it has fewer cells; empty if it has as many.

    Parameters
    ----------
    problem
        The problem.
    last
        Cells of the grid along each side of the bounds.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> field = RiskField(rasters=[RasterRisk([[0.0] * 40] * 40, (0, 0, 1, 1))])
    >>> problem = Problem((0, 0), (1, 1), field, k=1.0)
    >>> sampled(problem, (40, 40)), sampled(problem, (10, 20))
    ('', 'the raster is sampled: a cell of the grid is as wide as 4 of the raster')
    """
    x_min, y_min, x_max, y_max = problem.bounds
    if problem.k == 0.0:
        return ""
    times = max((x_max - x_min) / last[0], (y_max - y_min) / last[1]) / finest_cell(problem)
    return f"the raster is sampled: a cell of the grid is as wide as {times:.3g} of the raster" if times > MANY else ""


@dataclass(frozen=True, eq=False)
class Marched:
    """
    Result of marching from the goal of a problem.

    Attributes
    ----------
    path
        The way down from the start, shape ``(m, 2)``, map units; empty if there is none.
    mesh, costs, times
        The grid, the cost of a unit of length at each node, shape ``(n,)``, and the cost to the goal, shape ``(n +
        1,)``, the last one no node.
    laid
        When the grid was laid, by `time.perf_counter`.
    """

    path: FloatArray
    mesh: SplineMesh
    costs: FloatArray
    times: FloatArray
    laid: float


def marched(problem: Problem, last: tuple[int, int], *, second: bool = True) -> Marched:
    """
    March from the goal over a grid, and descend from the start.

    Parameters
    ----------
    problem
        The problem to solve.
    last
        Cells along each side of the bounds.
    second
        Whether to use differences of second order.

    Examples
    --------
    >>> found = marched(Problem((0.1, 0.1), (0.9, 0.9)), (16, 16))
    >>> found.path[0].tolist(), found.path[-1].tolist(), found.mesh.n_nodes
    ([0.1, 0.1], [0.9, 0.9], 361)
    """
    ends = problem.start, problem.goal
    mesh = SplineMesh.build(problem.bounds, last, cell_runs.rectangle(last), problem.model.area, ends)
    costs = node_costs(problem, mesh)
    laid = time.perf_counter()
    near = NEAR * max(mesh.spacing)
    times = costs_to_go(problem, mesh, problem.goal, mesh.ends[1], costs, radius=near, second=second)
    return Marched(descent(problem, mesh, times, radius=NEAR), mesh, costs, times, laid)

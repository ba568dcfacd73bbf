"""The ways down the costs-to-go at the resolution of rasters, whose corridors a sparse roadmap misses."""

import math

import numpy as np

from cgla_graph._types import FloatArray, Point, WholeArray
from cgla_graph.certificate.subsolution import in_line
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import costs_to_go, descent, node_costs
from cgla_graph.eikonal.mesh import SplineMesh
from cgla_graph.model.problem import Problem
from cgla_graph.solvers.continuous.fast_marching import NEAR, Marched, finest_cell, marched, sampled

#: The most nodes of a grid that is marched over, and the fewest cells along its longer side.
MOST_NODES, RASTER_LEAST = 1_000_000, 256
#: Mean bend of the cost from cell to cell, relative to it, from which on corridors a cell or two wide may pay: where a
#: grid over all would take samples of the raster, and where it would have a node for each cell.
ROUGH, VERY_ROUGH = 0.02, 0.1
#: Cells whose bends are looked at, about.
LOOKED_AT = 100_000
#: Nodes of the coarse grid in which a corridor is sought, each with the mean of so many costs along both axes.
COARSE_NODES, MEANS = 250_000, 4
#: A grid is fine enough if its spacing is at most so many cells.
COARSE = 0.75
#: Further cells around those of a corridor.
HALO = 2


def ways_down(problem: Problem) -> tuple[list[FloatArray], int, str]:
    """
    Return ways down the costs-to-go over rasters, how many nodes there were, and what a message has to say.

    Where costs of neighbouring cells differ much, and a grid of two nodes a cell would be too large, corridors are
    sought over means of blocks first, in there over each cell, and again in there over two nodes a cell.

    Returns
    -------
    ways, n_nodes, remark
        Paths of shape ``(m, 2)``, map units, which may be empty; the nodes; empty unless the raster is sampled.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> field = RiskField(rasters=[RasterRisk([[0, 3, 0], [0, 9, 0]], (0, 0, 3, 2))])
    >>> ways, _, remark = ways_down(Problem((0.5, 0.5), (2.5, 0.5), field, 1.0, (0, 0, 3, 2)))
    >>> len(ways), remark
    (2, '')
    """
    last = raster_grid(problem)
    x_min, y_min, x_max, y_max = problem.bounds
    spacing = max((x_max - x_min) / last[0], (y_max - y_min) / last[1])
    remark, n_nodes = sampled(problem, last), 0
    if spacing <= COARSE * finest_cell(problem) or roughness(problem) < (ROUGH if remark else VERY_ROUGH):
        found = marched(problem, last)
    else:
        (found, n_nodes), remark = _in_corridors(problem), ""
    return [found.path, from_node_to_node(problem, found)], n_nodes + found.mesh.n_nodes, remark


def roughness(problem: Problem) -> float:
    """
    Return the mean bend of the cost from cell to cell of the finest raster, relative to the cost.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> def rough(values):
    ...     return roughness(Problem((0, 0), (1, 1), RiskField(rasters=[RasterRisk(values, (0, 0, 9, 9))]), 1.0))
    >>> steady = np.add.outer(np.arange(9.0), np.arange(9.0))
    >>> round(rough(steady), 9), round(rough(steady % 2.0), 3)
    (0.0, 0.333)
    """
    raster = min(problem.field.rasters, key=lambda one: min(one.cell_size))
    bends = []
    for cells in (raster.cells, raster.cells.T):
        some = 1.0 + problem.k * cells[:: max(cells.size // LOOKED_AT, 1)]
        if some.shape[1] > 2:  # noqa: PLR2004 - a bend takes three cells
            around = some[:, 2:] + some[:, :-2]
            bends.append(float((np.abs(around - 2.0 * some[:, 1:-1]) / (around + 2.0 * some[:, 1:-1])).mean()))
    return max(bends, default=0.0)


def _in_corridors(problem: Problem) -> tuple[Marched, int]:
    """March over two nodes a cell in a corridor; also return how many nodes it took to find it."""
    x_min, y_min, x_max, y_max = problem.bounds
    cell = finest_cell(problem)
    sides = (x_max - x_min) / cell, (y_max - y_min) / cell
    fine, n_nodes = (max(4, round(sides[0])), max(4, round(sides[1]))), 0
    fine = in_line(problem, fine)
    runs = cell_runs.rectangle(fine)
    if fine[0] * fine[1] > MOST_NODES:
        times = math.sqrt(fine[0] * fine[1] / COARSE_NODES)
        last = max(4, round(fine[0] / times)), max(4, round(fine[1] / times))
        runs, n_nodes = _corridor(problem, last, cell_runs.rectangle(last), fine, means=MEANS)
    finest = 2 * fine[0], 2 * fine[1]
    runs, more = _corridor(problem, fine, runs, finest, means=1)
    mesh = _mesh(problem, finest, runs)
    costs = node_costs(problem, mesh)
    times_to_go = costs_to_go(problem, mesh, problem.goal, mesh.ends[1], costs, radius=NEAR * max(mesh.spacing))
    return Marched(descent(problem, mesh, times_to_go, radius=NEAR), mesh, costs, times_to_go, 0.0), n_nodes + more


def _corridor(
    problem: Problem, last: tuple[int, int], runs: WholeArray, finer: tuple[int, int], *, means: int
) -> tuple[WholeArray, int]:
    """Return the cells of a finer grid around the best ways over a grid, as many as may be; and the nodes it took."""
    mesh = _mesh(problem, last, runs)
    costs = node_costs(problem, mesh) if means == 1 else _mean_costs(problem, mesh, means)
    ends: tuple[tuple[Point, int], ...] = ((problem.goal, mesh.ends[1]), (problem.start, mesh.ends[0]))
    there, back = (costs_to_go(problem, mesh, *end, costs, radius=NEAR * max(mesh.spacing)) for end in ends)
    through = np.where(mesh.outside, np.inf, (there + back)[:-1])
    kept = int(MOST_NODES * last[0] * last[1] / (finer[0] * finer[1]))
    chosen = np.argsort(through, kind="stable")[:kept]
    chosen = chosen[np.isfinite(through[chosen])]
    return cell_runs.refined(
        cell_runs.runs_of(mesh.node_columns[chosen], mesh.node_rows[chosen]), last, finer
    ), mesh.n_nodes


def _mesh(problem: Problem, last: tuple[int, int], runs: WholeArray) -> SplineMesh:
    ends = problem.start, problem.goal
    return SplineMesh.build(problem.bounds, last, runs, problem.model.area, ends, HALO)


def _mean_costs(problem: Problem, mesh: SplineMesh, many: int) -> FloatArray:
    """Return the mean cost around each node, over so many places along both axes, shape ``(n,)``."""
    at = (np.arange(many) + 0.5) / many - 0.5
    total = np.zeros(mesh.n_nodes)
    for y in at:
        for x in at:
            places = np.clip(mesh.node_points + np.array([x, y]) * mesh.spacing, problem.bounds[:2], problem.bounds[2:])
            total += problem.field.density(places)
    return 1.0 + problem.k / many**2 * total


def raster_grid(problem: Problem) -> tuple[int, int]:
    """
    Return a grid with two cells along each of the finest raster's, unless those are too many.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> raster = RasterRisk([[0.0] * 200] * 300, (0, 0, 2, 3))
    >>> raster_grid(Problem((0, 0), (1, 1), RiskField(rasters=[raster]), 1.0, (0, 0, 2, 3)))
    (400, 600)
    """
    x_min, y_min, x_max, y_max = problem.bounds
    sides = x_max - x_min, y_max - y_min
    finest = min(min(raster.cell_size) for raster in problem.field.rasters)
    spacing = max(0.5 * finest, math.sqrt(sides[0] * sides[1] / MOST_NODES))
    # a coarse raster is no smoother than a threat
    spacing = min(spacing, max(sides) / RASTER_LEAST)
    # an even number for each of the raster's, so that nodes are in the middle of its cells: in the floor of a valley
    columns, rows = in_line(problem, (max(4, round(0.5 * sides[0] / spacing)), max(4, round(0.5 * sides[1] / spacing))))
    return 2 * columns, 2 * rows


def from_node_to_node(problem: Problem, found: Marched) -> FloatArray:
    """
    Follow costs-to-go down from node to node of the grid; empty if that leads nowhere.

    Where a valley is steep and narrow, the way down a spline leaves its floor, and nodes do not.
    """
    mesh = found.mesh
    columns, rows = mesh.last
    inside = (
        (mesh.node_columns >= 0) & (mesh.node_columns <= columns) & (mesh.node_rows >= 0) & (mesh.node_rows <= rows)
    )
    where = mesh.node_columns[inside], mesh.node_rows[inside]
    # a frame that nothing leads to
    times = np.full((columns + 3, rows + 3), np.inf)
    np.minimum.at(times, (where[0] + 1, where[1] + 1), found.times[:-1][inside])
    origin, spacing = np.array(mesh.origin), np.array(mesh.spacing)
    here, goal = (tuple((np.rint((end - origin) / spacing) + 1).astype(int)) for end in (problem.start, problem.goal))
    moves = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)])
    nodes = [here]
    while here != goal:
        there = np.array(here) + moves
        nearer = times[there[:, 0], there[:, 1]]
        lower = nearer < times[here]
        if not lower.any():
            # at the foot of the valley, near the goal, or nowhere
            break
        ends = origin + (there[lower] - 1) * spacing
        weights = problem.model.weights(np.broadcast_to(origin + (np.array(here) - 1) * spacing, ends.shape), ends)
        here = tuple(there[lower][np.argmin(nearer[lower] + weights)].tolist())
        nodes.append(here)
    if len(nodes) == 1 or max(abs(here[0] - goal[0]), abs(here[1] - goal[1])) > NEAR:
        return np.empty((0, 2))
    steps = np.diff(np.array(nodes), axis=0)
    # where it turns
    turns = np.array(nodes)[np.concatenate([[True], (steps[1:] != steps[:-1]).any(axis=1), [True]])]
    return np.vstack([problem.start, origin + (turns - 1) * spacing, problem.goal])

"""Least-cost paths over cells of constant cost: over points on borders, then moved along the borders."""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import shapely

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.model.problem import Problem
from cgla_graph.refine.refine import refine_path
from cgla_graph.regions import region_kernels
from cgla_graph.regions.arrangement import Arrangement, refusal
from cgla_graph.regions.points import Points, covered, met

#: Nodes of one search, at most, about 25 bytes each; points of a side by default, and nodes up to which they are taken:
#: on large cells, few points may miss the best order of cells.
MOST_NODES, POINTS = 8_000_000, {31: 100_000, 15: 500_000, 7: 2_000_000}
#: Points of a side where those are too many.
FEWEST = 1
#: Cells along the longer side, at least, where the cost changes inside of cells or areas cut them.
LEAST_CELLS = 96
#: Points of a side in the search over blocks of cells, and nodes of it, at most.
COARSE, COARSE_NODES = 3, 2_000_000
#: From so many points a side on, a search over one point a side comes first, which takes a few per cent of the time.
#: In cells of equal cost, its ways are longer than the best ones by up to 2.8 %; only cells are searched through which
#: they cost up to so much more than the best way.
MANY, TUBE = 7, 0.05
#: The cells up to so many off a path are searched again, as often as that gains more than this part of the cost, and so
#: many times at most; points of a side, and nodes of one such search up to which they are taken.
NEAR, GAIN, AGAIN = 3, 1e-6, 6
NEAR_POINTS, NEAR_NODES = (31, 15, 7), 200_000
#: Steps in which waypoints are moved along borders, at most.
STEPS = 100
#: A path is refined until finer waypoints gain less than this part of its cost, or there are too many.
REFINED, MOST_WAYPOINTS = 1e-6, 512


@dataclass(frozen=True, eq=False)
class Found:
    """
    A path over the borders of cells.

    Attributes
    ----------
    path
        Waypoints, shape ``(n, 2)``, map units; empty if there is none.
    nodes
        Points searched.
    evaluations
        Segments weighed by Eq. 5.
    message
        How it was found, in one line.
    """

    path: FloatArray
    nodes: int
    evaluations: int
    message: str


def cells_of(problem: Problem) -> Arrangement:
    """
    Lay the cells over which paths are searched, small enough where the cost changes inside of them or areas cut them.

    Examples
    --------
    >>> cells_of(Problem((0, 0), (1, 1))).costs.shape
    (1, 1)
    """
    sampled = not problem.field.is_empty and refusal(problem) != ""
    return Arrangement.of(problem, least=LEAST_CELLS if sampled or not problem.model.area.is_empty else 1)


def least_path(problem: Problem, points: int | None = None, cells: Arrangement | None = None) -> Found:
    """
    Find a path that costs little more than the best one.

    Parameters
    ----------
    problem
        Any problem with weights of at least 0. Where its cost is not constant on cells, it is sampled.
    points
        Points of a side, from 1 to 64; None: from 31 on few cells to 1 on very many.
    cells
        The cells of the problem (`cells_of`), if they are known.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> field = RiskField(rasters=[RasterRisk([[0, 3, 0], [0, 9, 0]], (0, 0, 3, 2), interpolation="nearest")])
    >>> problem = Problem((0.5, 0.5), (2.5, 0.5), field, k=1.0, bounds=(0, 0, 3, 2))
    >>> found = least_path(problem)
    >>> found.path.round(4).tolist(), round(problem.evaluate(found.path).cost, 4)
    ([[0.5, 0.5], [1.0, 1.0], [2.0, 1.0], [2.5, 0.5]], 5.4142)
    """
    cells = cells or cells_of(problem)
    rows, columns = cells.costs.shape
    sides = 2 * cells.costs.size
    fitting = [m for m, most in POINTS.items() if (m + 0.5) * sides <= min(most, MOST_NODES)]
    m = points or max(fitting, default=FEWEST)
    about = f"{rows} x {columns} cells, {m} points a side"
    most, searched = int(MOST_NODES / (2 * m + 1)), cells
    if cells.costs.size > most:
        searched, times = _corridor(problem, cells, most)
        about += f", in a corridor found over blocks of {times} x {times}"
    elif m >= MANY:
        searched = _tube(problem, cells)
    found = _best(problem, Points.lay(searched, m, problem.model.area))
    sampled = refusal(problem) != "" and problem.k > 0.0
    message = f"{about}; risk sampled in the middles of cells" if sampled else about
    if not len(found.path):
        return replace(found, message=message)
    near = found if m >= NEAR_POINTS[-1] else near_path(problem, found.path, cells, NEAR_POINTS[-1])
    near = near_path(problem, near.path, cells)
    refined = refine_path(problem, near.path, tolerance=REFINED, max_points=MOST_WAYPOINTS)
    evaluations = found.evaluations + near.evaluations + refined.evaluations
    return Found(refined.path, found.nodes + near.nodes, evaluations, message)


def near_path(problem: Problem, path: FloatArray, cells: Arrangement, points: int | None = None) -> Found:
    """
    Find the best path over the cells near one, and near that, until it gains little.

    Parameters
    ----------
    problem
        The problem.
    path
        Waypoints, shape ``(n, 2)``, map units.
    cells
        The cells of the problem.
    points
        Points of a side; None: as many as may be searched.

    Examples
    --------
    >>> problem = Problem((0.1, 0.2), (0.9, 0.4))
    >>> around = np.array([problem.start, (0.3, 0.6), problem.goal])
    >>> near = near_path(problem, around, Arrangement.of(problem, least=8))
    >>> round(problem.evaluate(near.path).cost, 4), round(float(np.hypot(0.8, 0.2)), 4)
    (0.8246, 0.8246)
    """
    judged = problem.evaluate(path)
    best, cost = path, judged.cost if judged.feasible else math.inf
    nodes, evaluations = 0, len(path) - 1
    for _ in range(AGAIN):
        if (best == best[0]).all():
            # (start and goal are one place)
            break
        beside = met(cells, np.array([shapely.LineString(best)]), NEAR)
        fitting = (many for many in NEAR_POINTS if 2 * many * int(beside.sum()) <= NEAR_NODES)
        many = points or next(fitting, NEAR_POINTS[-1])
        found = _best(problem, Points.lay(cells.without(~beside), many, problem.model.area))
        nodes, evaluations = nodes + found.nodes, evaluations + found.evaluations
        if not len(found.path):
            break
        before, now = cost, problem.evaluate(found.path).cost
        if now < cost:
            best, cost = found.path, now
        if before - now <= GAIN * now:
            break
    return Found(best, nodes, evaluations, "")


def _tube(problem: Problem, cells: Arrangement) -> Arrangement:
    """Leave the cells that a good way over few points a side passes; ways through cut cells count as free."""
    area = problem.model.area
    rough = Points.lay(cells if area.is_empty else cells.without(covered(cells, area)[0]), 1)
    through = rough.least_on_cells(rough.costs_from(problem.start) + rough.costs_from(problem.goal))
    least = float(through.min())
    if not area.is_empty:
        walled = Points.lay(cells, FEWEST, area)
        near, first = walled.around(problem.start)
        least = float(np.min(first + walled.costs_from(problem.goal)[near], initial=math.inf))
    left = cells.without(through > (1.0 + TUBE) * least)
    # (start and goal may be in the middle of large cells)
    for row, column in [*cells.cells_of(problem.start), *cells.cells_of(problem.goal)]:
        left.costs[row, column] = cells.costs[row, column]
    return left


def _corridor(problem: Problem, cells: Arrangement, most: int) -> tuple[Arrangement, int]:
    """Leave the cells that the best ways over blocks of cells pass, about as many as may be searched."""
    times = math.ceil(math.sqrt(cells.costs.size * (2 * COARSE + 1) / COARSE_NODES))
    blocks = Points.lay(cells.coarsened(times), COARSE)
    with ThreadPoolExecutor(1) as thread:
        other = thread.submit(blocks.costs_from, problem.start)
        through = blocks.least_on_cells(blocks.costs_from(problem.goal) + other.result())
    chosen = np.argsort(through, axis=None, kind="stable")[: max(most // times**2, 1)]
    kept = np.zeros(through.shape, dtype=np.bool_)
    kept.flat[chosen] = True
    rows, columns = cells.costs.shape
    fine = np.repeat(np.repeat(kept, times, axis=0)[:rows], times, axis=1)[:, :columns]
    for end in (problem.start, problem.goal):
        for row, column in cells.cells_of(end):
            fine[row, column] = True
    return cells.without(~fine), times


def _best(problem: Problem, laid: Points) -> Found:
    """Return the best path over points, moved along borders; empty if there is none."""
    nodes = laid.nodes_to(laid.costs_from(problem.goal), problem.start)
    straight = np.array([problem.start, problem.goal])
    candidates, evaluations = [straight], 1
    if len(nodes):
        path = np.vstack([problem.start, laid.places(nodes), problem.goal])
        candidates += [path, moved(problem, laid, nodes)]
        evaluations += 2 * len(path)
    judged = [(problem.evaluate(path), path) for path in candidates]
    free = [(found.cost, number) for number, (found, _) in enumerate(judged) if found.feasible]
    best = judged[min(free)[1]][1] if free else np.empty((0, 2))
    return Found(best, laid.n_nodes, evaluations, "")


def moved(problem: Problem, laid: Points, nodes: IntArray) -> FloatArray:
    """
    Move the waypoints of a path over nodes along their sides until the path costs least, shape ``(m, 2)``.

    Examples
    --------
    >>> problem = Problem((0.1, 0.2), (0.9, 0.4))
    >>> laid = Points.lay(Arrangement.of(problem, least=2), 1)
    >>> path = moved(problem, laid, laid.nodes_to(laid.costs_from(problem.goal), problem.start))
    >>> round(problem.evaluate(path).cost, 4), round(float(np.hypot(0.8, 0.2)), 4)
    (0.8246, 0.8246)
    """
    path = np.vstack([problem.start, laid.places(nodes), problem.goal])
    axes = np.full(len(path), -1)
    lows, highs = np.zeros(len(path)), np.ones(len(path))
    kind, row, column = laid.sides_of(nodes)
    x, y = laid.cells.x, laid.cells.y
    needed = np.ones(len(path), dtype=np.bool_)
    for axis, lines, at in ((0, x, column), (1, y, row)):
        on = np.nonzero(kind == axis)[0]
        axes[on + 1] = axis
        lows[on + 1], highs[on + 1] = lines[at[on]], lines[at[on] + 1]
        # (along a side, the way from the first to the last point is straight)
        level = path[1:, 1 - axis] == path[:-1, 1 - axis]
        needed[1:-1] &= ~((axes[1:-1] == axis) & level[:-1] & level[1:])
    path, axes, lows, highs = path[needed], axes[needed], lows[needed], highs[needed]
    size = np.hypot(*np.diff(path, axis=0).T)
    with np.errstate(invalid="ignore", divide="ignore"):
        weights = problem.model.weights(path[:-1], path[1:]) / size
    # (a way of no length costs as much as the one after it)
    weights[~np.isfinite(weights)] = 1.0
    region_kernels.slide(path, axes, lows, highs, weights, STEPS)
    return path

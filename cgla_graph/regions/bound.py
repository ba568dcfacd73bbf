"""
A lower bound of the cost of every path where the cost is constant on cells.

`W` has values at points on the borders of cells and is linear in between (`pair_kernels`); ``W(p) - W(q) <= c |p - q|``
for all places ``p`` and ``q`` on the border of each cell, and ``W(p) <= c |p - goal|`` on the borders of the cells that
the goal is in or on. In a cell, let ``W(x)`` be the least ``W(q) + c |x - q|`` over its border (McShane 1934): that
agrees with `W` on the border and changes by at most ``c`` a unit of length in the closed cell; along a side, by the
lesser cost of both cells. So a path from ``p`` to the goal costs at least ``W(p)``, and a path from the start costs at
least the minimum of ``c |start - p| + W(p)`` over the border of a cell of the start, or goes straight to the goal
inside of it.

Only the stored values are checked, not how they were found: where a pair is steeper than it may be by a factor, the
bound is divided by it.
"""

import math
from itertools import pairwise

import numpy as np

from cgla_graph._types import FloatArray, IntArray, Point
from cgla_graph.model.problem import Problem
from cgla_graph.regions import pair_kernels
from cgla_graph.regions.arrangement import BESIDE, Arrangement, refusal
from cgla_graph.regions.points import Points, border_points, fractions, lengths, side_orders

#: Boxes along each side of the unit square, and along an interval.
BOXES, PARTS = 8, 16
#: The part of a bound that covers what differs between cells of one shape, and the rounding of sums.
LESS = 1e-6


def intervals(m: int) -> IntArray:
    """Return the intervals of a border, rows ``(first point, last point, side)``."""
    orders = side_orders(m)
    return np.array([(a, b, side) for side, order in enumerate(orders) for a, b in pairwise(order)])


def lowered(width: float, height: float, parts: FloatArray) -> FloatArray:
    """Return the table of a cell with lowered lengths, map units; infinite where a pair needs no limit."""
    at = border_points(width, height, parts)
    less = np.zeros((len(at), len(at)))
    pair_kernels.lowering(at, intervals(len(parts)), BOXES, less)
    full = np.hypot(*(at[:, None] - at).transpose(2, 0, 1))
    table = np.where(less > 0.0, full, lengths(width, height, parts))
    return np.asarray(table * (1.0 - less) * (1.0 - pair_kernels.ROUNDED))


def _segments(points: Points, cell: tuple[int, int]) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the intervals of a cell's border: nodes, shape ``(n, 2)``, and their places."""
    nodes = points.nodes_of(*cell)[intervals(len(points.parts))[:, :2]]
    return nodes, points.places(nodes[:, 0]), points.places(nodes[:, 1])


def _tangents(start: FloatArray, end: FloatArray, place: Point) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bound the distance of a place from parts of intervals: parts of the ends, and linear bounds at both ends."""
    edges = np.linspace(0.0, 1.0, PARTS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    along = (end - start)[:, None]
    from_place = start[:, None] + middle[:, None] * along - np.array(place)
    away = np.hypot(from_place[..., 0], from_place[..., 1])
    slope = np.divide((from_place * along).sum(axis=-1), away, out=np.zeros_like(away), where=away > 0.0)
    half = 0.5 / PARTS
    return edges, away - half * slope, away + half * slope


def seeds(points: Points, goal: Point) -> tuple[IntArray, FloatArray]:
    """Return nodes and values of `W` such that ``W(p) <= c |p - goal|`` between them."""
    nodes, values = [], []
    for cell in points.cells.cells_of(goal):
        near, start, end = _segments(points, cell)
        edges, low, high = _tangents(start, end, goal)
        first, last = np.hypot(*(start - goal).T), np.hypot(*(end - goal).T)
        mean = first[:, None] * (1.0 - edges) + last[:, None] * edges
        with np.errstate(divide="ignore", invalid="ignore"):
            part = np.minimum(low / mean[:, :-1], high / mean[:, 1:])
        share = np.clip(np.where(np.isnan(part), 0.0, part).min(axis=1) - pair_kernels.ROUNDED, 0.0, 1.0)
        # in line with an interval and not inside of it, the distance is linear
        flat = ((start == end) & (start == goal)).any(axis=1)
        within = ((np.minimum(start, end) < goal) & (goal < np.maximum(start, end))).any(axis=1)
        share = np.where(flat & ~within, 1.0 - pair_kernels.ROUNDED, share)
        for column, at in enumerate((first, last)):
            nodes.append(near[:, column])
            values.append(points.cells.costs[cell] * at * share)
    return np.concatenate(nodes), np.concatenate(values)


def slack(problem: Problem, cells: Arrangement) -> float:
    """
    Return the part of a bound that covers where lines are.

    Within a distance ``d`` of a line the oracle counts a place as on it, and lines are off by `SAME` or `BESIDE` of a
    cell. The map that draws such strips onto the lines stretches the rest of a cell of width ``w`` by ``1 / (1 - 2 d /
    w)`` at most, and so the cost of a path.
    """
    least = min(float(cells.widths.min()), float(cells.heights.min()))
    heads = [(raster.header(0), raster.cell_size) for raster in problem.field.rasters]
    near = max(max(head[-2] * size[0], head[-1] * size[1]) for head, size in heads)
    beside = BESIDE * max(max(size) for _, size in heads)
    return LESS + 4.0 * (near + beside) / least


def lower_bound(problem: Problem, m: int, limit: float = math.inf) -> tuple[float, float]:
    """
    Bound the cost of every path from below.

    Parameters
    ----------
    problem
        One in the plane whose risk is on `nearest` rasters (`refusal`). No-fly areas are left out of account: paths
        that keep clear of them cost no less than the bound.
    m
        Points of a side, from 1 to 64.
    limit
        Cost of a known path: no bound above it is sought.

    Returns
    -------
    bound, factor
        The bound, map units, and by which factor some pair was too steep, 1 but for rounding.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> field = RiskField(rasters=[RasterRisk([[0, 3, 0], [0, 9, 0]], (0, 0, 3, 2), interpolation="nearest")])
    >>> problem = Problem((0.5, 0.5), (2.5, 0.5), field, k=1.0, bounds=(0, 0, 3, 2))
    >>> bound, factor = lower_bound(problem, 15)
    >>> 0.99 < bound / (4.0 + 2.0**0.5) < 1.0, factor < 1.0 + 1e-9
    (True, True)
    """
    if problem.projection is not None or refusal(problem):
        return 0.0, 1.0
    cells = Arrangement.of(problem)
    parts = fractions(m)
    shapes = [(width, height) for height in cells.heights for width in cells.widths]
    points = Points(cells, parts, np.array([lowered(*shape, parts) for shape in shapes]), cells.shape_of)
    values = np.full(points.n_nodes, math.inf)
    np.minimum.at(values, *seeds(points, problem.goal))
    points.spread(values, limit)
    # (the lesser of a value and a constant changes no faster than the value)
    np.minimum(values, limit, out=values)
    horizontal, vertical, _ = points.sides
    steep = pair_kernels.steepest(cells.costs, points.tables, points.table_of, horizontal, vertical, m, values)
    factor = max(steep, 1.0)
    least = min(_from_start(points, values / factor, problem), limit)
    return max(least * (1.0 - slack(problem, cells)), 0.0), factor


def _from_start(points: Points, values: FloatArray, problem: Problem) -> float:
    """Return the least cost from the start by way of the border of a cell of it, or straight to the goal inside."""
    cell = points.cells.cells_of(problem.start)[0]
    near, one, other = _segments(points, cell)
    edges, low, high = _tangents(one, other, problem.start)
    at = values[near[:, :1]] * (1.0 - edges) + values[near[:, 1:]] * edges
    cost = points.cells.costs[cell]
    least = float(min((cost * low + at[:, :-1]).min(), (cost * high + at[:, 1:]).min()))
    if cell in points.cells.cells_of(problem.goal):
        least = min(least, float(cost) * math.dist(problem.start, problem.goal))
    return least

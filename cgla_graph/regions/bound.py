"""
A lower bound of the cost of every path where the cost is constant on cells.

**Statement.** `W` has values at points on the borders of cells and is linear in between (`pair_kernels`); ``W(p) - W(q)
<= c |p - q|`` for all places ``p`` and ``q`` on the border of each cell of cost ``c``, and ``W(p) <= c |p - goal|`` on
the borders of the cells that the goal is in or on. A path is cut where it enters and leaves cells. A piece inside of a
cell from ``p`` to ``q`` costs at least ``c |p - q| >= W(p) - W(q)``; so does one along a side, which has the lesser
cost of both cells. The pieces add up: a path from ``p`` to the goal costs at least ``W(p)``, and a path from the start
at least the minimum of ``c |start - p| + W(p)`` over the border of a cell of the start, unless it goes straight to the
goal inside of it.

Only the stored values are checked, not how they were found: where a pair is steeper than it may be by a factor, the
bound is divided by it. So sums of lengths need no care. `W` may have any values where no path goes: on cells inside of
no-fly areas, and on those through which all paths cost more than a known one (`through`).

**On a line** the oracle takes the least value of each raster. If several rasters have a line in common, or the line is
a border of the map and a raster goes on beyond it, that sum may be less than the cost of the cells. Then ``W(v) -
W(w)`` is at most that cost of the interval for neighbours on the line (`Points.lines`), so that pieces along lines add
up as well. The last piece, along the line to the goal, does so too: where the goal is inside of an interval, `W` is at
most 0 on it.

**In a cell that an area cuts** (`walls`), a piece inside of it, or along its sides, stays in one of the free parts. So
only pairs of intervals that one part meets need the inequality, also two of the same side, between which the side may
be closed: there the distance is the mean of the four, and no length is lowered. A part counts with all that rounding
may move into it.

**Rounding** (`Rounding`). Let ``d`` bound how far lines are from where the oracle has them. It counts places within
some ulps of a line as on it; lines nearer than `SAME` are one. A map that draws strips of width ``d`` on both sides of
the lines onto them stretches the rest of a cell, of width ``w`` at least, by ``1 / (1 - 2 d / w)`` at most. It turns a
path into one that costs at most so many times as much over the cells, and moves its ends by ``2 d`` at most, inside of
each cell that they are in or on: that costs at most ``2 d`` times the least cost of these. The places of points are off
by some ulps of the coordinates; where they are compared with those of start and goal, distances are lowered by `ULPS`
of them. Sizes of cells of one shape differ by four times `SAME`. All other operations have errors relative to what they
add up, which `LESS` exceeds by far.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cgla_graph._types import FloatArray, IntArray, Point
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk_raster_kernels import NEAR_X, NEAR_Y
from cgla_graph.regions import pair_kernels
from cgla_graph.regions.arrangement import SAME, Arrangement
from cgla_graph.regions.points import Points, border_points, fractions, lengths, side_orders
from cgla_graph.regions.walls import Walls

#: Boxes along each side of the unit square, and along an interval.
BOXES, PARTS = 8, 16
#: The part of a bound that covers rounding, and cells of one shape that differ.
LESS = 1e-7
#: Rounding of places, as a part of the greatest coordinate: 32 ulps.
ULPS = 2.0**-47
#: Numbers of all tables, at most.
TABLE_NUMBERS = 1 << 25


@dataclass(frozen=True)
class Rounding:
    """
    What covers the rounding of a bound.

    Attributes
    ----------
    share
        The part of a bound that is taken off; 1 where lines are too uncertain for a bound.
    apart
        How far a map that draws lines onto each other may move start and goal, map units.
    """

    share: float
    apart: float

    @classmethod
    def of(cls, problem: Problem, cells: Arrangement) -> "Rounding":
        """Bound the rounding on the cells of a problem (see the module)."""
        rasters = problem.field.rasters
        least = min(float(np.diff(lines).min()) for lines in (cells.x, cells.y))
        smallest = min([least, *(min(raster.cell_size) for raster in rasters)])
        reach = max(max(map(abs, box)) for box in (problem.bounds, *(raster.bounds for raster in rasters)))
        # (each of several lines may be next to another one)
        off = 2.0 * ULPS * reach + (2.0 * len(rasters) + 2.0) * SAME * smallest
        for raster in rasters:
            near_x, near_y = (raster.header(0)[place] for place in (NEAR_X, NEAR_Y))
            off = max(off, 2.0 * near_x * raster.cell_size[0], 2.0 * near_y * raster.cell_size[1])
        return cls(min(LESS + 4.0 * off / least, 1.0), 2.0 * off)

    def below(self, value: float, costs: float) -> float:
        """
        Lower a bound by its rounding; `costs` are the least of the cells of either end, added up.

        Examples
        --------
        >>> Rounding(0.25, 0.5).below(8.0, 2.0)
        5.0
        """
        return (1.0 - self.share) * value - self.apart * costs


def intervals(m: int) -> IntArray:
    """Return the intervals of a border, rows ``(first point, last point, side)``."""
    orders = side_orders(m)
    return np.array([(a, b, side) for side, order in enumerate(orders) for a, b in pairwise(order)])


def lowered(width: float, height: float, parts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return two tables of a cell with lowered lengths, map units.

    The first one is infinite where a pair needs no limit, as places of a side are joined along it. Where an area cuts
    the cell they may be joined by another way: the second one has all pairs.
    """
    at = border_points(width, height, parts)
    less = np.zeros((len(at), len(at)))
    pair_kernels.lowering(at, intervals(len(parts)), BOXES, less)
    full = np.hypot(*(at[:, None] - at).transpose(2, 0, 1))
    left = (1.0 - less) * (1.0 - pair_kernels.ROUNDED)
    return np.where(less > 0.0, full, lengths(width, height, parts)) * left, full * left


def lay(cells: Arrangement, m: int, walls: Walls | None = None) -> Points | None:
    """
    Lay `m` points on each side, with lowered lengths; None if there would be too many tables.

    Parameters
    ----------
    cells
        The cells.
    m
        Points of a side.
    walls
        What an area leaves free of the cells that it cuts; None: paths lead through.
    """
    shapes = [(width, height) for height in cells.heights for width in cells.widths]
    used = np.unique(cells.shape_of[np.isfinite(cells.costs)])
    size = 4 + 4 * m
    # (each shape has two)
    most = TABLE_NUMBERS // size**2 - 2 * len(used)
    if most < 0:
        return None
    parts, unit = fractions(m), border_points(1.0, 1.0, fractions(m))
    both = []
    for number in used.tolist():
        width, height = shapes[number]
        both.append(lowered(width, height, parts))
    tables = [table for table, _ in both] or [np.empty((size, size))]
    # (cells that no path enters have any table)
    table_of = np.minimum(np.searchsorted(used, cells.shape_of), len(tables) - 1)
    for number, (row, column) in enumerate(() if walls is None else walls.places.tolist()):
        # (a cell without a table of its own counts as free)
        if walls is None or not math.isfinite(cells.costs[row, column]) or len(tables) - len(used) >= most:
            continue
        low = np.array([cells.x[column], cells.y[row]])
        at = low + unit * (np.array([cells.x[column + 1], cells.y[row + 1]]) - low)
        separated = walls.separated(number, at, intervals(m))
        if separated is not None:
            every = both[table_of[row, column]][1]
            table_of[row, column] = len(tables)
            tables.append(np.where(separated, math.inf, every))
    return Points(cells, parts, np.array(tables), table_of)


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


def _uncertain(points: Points) -> float:
    """Bound the rounding of the places of points, map units."""
    cells = points.cells
    return ULPS * float(np.abs([cells.x[0], cells.x[-1], cells.y[0], cells.y[-1]]).max())


def seeds(points: Points, goal: Point) -> tuple[IntArray, FloatArray]:
    """Return nodes and values of `W` such that ``W(p) <= c |p - goal|`` between them."""
    nodes, values = [np.empty(0, dtype=np.int64)], [np.empty(0)]
    for cell in points.cells.cells_of(goal):
        near, start, end = _segments(points, cell)
        edges, low, high = _tangents(start, end, goal)
        near_by = _uncertain(points)
        low, high = low - near_by, high - near_by
        first, last = (np.maximum(np.hypot(*(at - goal).T) - near_by, 0.0) for at in (start, end))
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


def values_to(points: Points, goal: Point, limit: float = math.inf) -> FloatArray:
    """
    Return values at all nodes that bound the cost of every path from there to a place, shape ``(n,)``, map units.

    Parameters
    ----------
    points
        Points with lowered lengths (`lay`).
    goal
        The place.
    limit
        No value is above it.

    Returns
    -------
    values
        Checked, but for `Rounding`; 0 where the check fails.
    """
    values = np.full(points.n_nodes, math.inf)
    near, most = seeds(points, goal)
    np.minimum.at(values, near, most)
    points.spread(values, limit)
    np.minimum.at(values, near, most)
    # (the lesser of a value and a constant changes no faster than the value)
    np.minimum(values, min(limit, float(np.max(values, where=values < math.inf, initial=0.0))), out=values)
    horizontal, vertical, _ = points.sides
    cells = points.cells
    steep = pair_kernels.steepest(
        cells.costs, points.tables, points.table_of, horizontal, vertical, len(points.parts), values
    )
    if steep < math.inf and len(points.lines):
        steep = max(steep, pair_kernels.steepest_along(points.lines, horizontal, vertical, len(points.parts), values))
    if not steep < math.inf:
        return np.zeros(len(values))
    return values / max(steep, 1.0)


def bound_at(points: Points, values: FloatArray, start: Point, goal: Point) -> float:
    """
    Return the least cost from a place by way of the border of a cell of it, or straight to the other one inside.

    Examples
    --------
    >>> cells = Arrangement.laid(np.arange(4.0), np.arange(3.0), np.array([[1.0, 10.0, 1.0], [1.0, 4.0, 1.0]]))
    >>> points = lay(cells, 15)
    >>> least = bound_at(points, values_to(points, (2.5, 0.5)), (0.5, 0.5), (2.5, 0.5))
    >>> 0.99 < least / (4.0 + 2.0**0.5) < 1.0
    True
    """
    of_start = points.cells.cells_of(start)
    if not of_start:
        return 0.0
    cell = min(of_start, key=lambda cell: float(points.cells.costs[cell]))
    near, one, other = _segments(points, cell)
    edges, low, high = _tangents(one, other, start)
    low, high = low - _uncertain(points), high - _uncertain(points)
    at = values[near[:, :1]] * (1.0 - edges) + values[near[:, 1:]] * edges
    cost = float(points.cells.costs[cell])
    least = float(min((cost * low + at[:, :-1]).min(), (cost * high + at[:, 1:]).min()))
    if cell in points.cells.cells_of(goal):
        least = min(least, cost * math.dist(start, goal))
    return least


def least_cost_at(cells: Arrangement, place: Point) -> float:
    """Return the least cost of the cells that a place is in or on the border of; 0 if there is none."""
    return min((float(cells.costs[cell]) for cell in cells.cells_of(place)), default=0.0)

"""Points on the borders of cells, the lengths between them, and the least costs over them."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from cgla_graph._types import BoolArray, FloatArray, IntArray, Point, WholeArray
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.no_fly_kernels import segments_cross
from cgla_graph.regions import region_kernels
from cgla_graph.regions.arrangement import Arrangement

#: Points of a side lie at such powers of their part of half of it: they are denser towards corners, around which the
#: directions of paths change most.
GRADE = 1.6
#: Tables of lengths for cells of different shapes, at most, and numbers in all of them. Where rasters of different
#: cells overlap, there may be a shape for each cell.
MOST_TABLES, TABLE_NUMBERS = 10_000, 1 << 25


def fractions(m: int, grade: float = GRADE) -> FloatArray:
    """
    Return where the points of a side are, shape ``(m,)``, as parts of it.

    Examples
    --------
    >>> fractions(3, 2.0).tolist()
    [0.125, 0.5, 0.875]
    """
    # from -1 to 1 over the side
    at = 2.0 * np.arange(1, m + 1) / (m + 1) - 1.0
    return np.asarray(0.5 + 0.5 * np.sign(at) * (1.0 - (1.0 - np.abs(at)) ** grade))


def border_points(width: float, height: float, parts: FloatArray) -> FloatArray:
    """
    Return the points on the border of a cell from its lower left corner on, shape ``(4 + 4 m, 2)``.

    Corners come first, then those of the lower, upper, left and right side (`region_kernels`).
    """
    none, every = np.zeros_like(parts), np.ones_like(parts)
    x = np.concatenate([[0.0, 1.0, 0.0, 1.0], parts, parts, none, every])
    y = np.concatenate([[0.0, 0.0, 1.0, 1.0], none, every, parts, parts])
    return np.column_stack([x * width, y * height])


def side_orders(m: int) -> list[IntArray]:
    """
    List the border points of each side in their order, corners included, shape ``(m + 2,)`` each.

    Examples
    --------
    >>> [order.tolist() for order in side_orders(1)]
    [[0, 4, 1], [2, 5, 3], [0, 6, 2], [1, 7, 3]]
    """
    ends = [(0, 1), (2, 3), (0, 2), (1, 3)]
    return [np.array([a, *range(4 + q * m, 4 + (q + 1) * m), b]) for q, (a, b) in enumerate(ends)]


def lengths(width: float, height: float, parts: FloatArray) -> FloatArray:
    """
    Return the table of a cell: lengths between its border points, infinite along a side but to the next one.

    Examples
    --------
    >>> lengths(3.0, 4.0, fractions(1))[0, :6].tolist()
    [0.0, inf, inf, 5.0, 1.5, 4.272001872658765]
    """
    at = border_points(width, height, parts)
    table: FloatArray = np.hypot(*(at[:, None] - at).transpose(2, 0, 1))
    for order in side_orders(len(parts)):
        step = np.hypot(*np.diff(at[order], axis=0).T)
        table[np.ix_(order, order)] = math.inf
        table[order[:-1], order[1:]] = table[order[1:], order[:-1]] = step
    np.fill_diagonal(table, 0.0)
    return table


@dataclass(frozen=True, eq=False)
class Points:
    """
    Points on the borders of the cells of an arrangement.

    Attributes
    ----------
    cells
        The arrangement.
    parts
        Where the points of each side are, shape ``(m,)``.
    tables, table_of
        Lengths between the points of a cell's border, shape ``(n, 4 + 4 m, 4 + 4 m)``, map units, and the table of each
        cell, shape ``(rows, columns)``.
    area
        The no-fly area that ways keep out of, if any.
    """

    cells: Arrangement
    parts: FloatArray
    tables: FloatArray
    table_of: WholeArray
    area: NoFlyArea | None = None

    @classmethod
    def lay(cls, cells: Arrangement, m: int, area: NoFlyArea | None = None) -> "Points":
        """
        Lay `m` points on each side of each cell.

        Parameters
        ----------
        cells
            The cells.
        m
            Points of a side, without its ends, at most 64.
        area
            A no-fly area that no way between points crosses; None: ways go through.

        Examples
        --------
        >>> from cgla_graph.model.problem import Problem
        >>> points = Points.lay(Arrangement.of(Problem((0, 0), (1, 1))), 3)
        >>> len(points.positions), points.tables.shape
        (16, (1, 16, 16))
        """
        parts, size = fractions(m), (4 + 4 * m, 4 + 4 * m)
        cells = cells.of_few_shapes(min(MOST_TABLES, TABLE_NUMBERS // size[0] ** 2))
        shapes = [(width, height) for height in cells.heights for width in cells.widths]
        inside, cut, table_of = None, np.empty((0, 2), dtype=np.int64), cells.shape_of
        if area is not None and not area.is_empty:
            inside, is_cut = covered(cells, area)
            # (where no way leads through, none is cut)
            cut = np.argwhere(is_cut & np.isfinite(cells.costs))
            table_of = cells.shape_of.copy()
            table_of[*cut.T] = len(shapes) + np.arange(len(cut))
        tables = np.empty((len(shapes) + len(cut), *size))
        for number in np.unique(cells.shape_of[np.isfinite(cells.costs)]).tolist():
            width, height = shapes[number]
            tables[number] = lengths(width, height, parts)
        if area is None or inside is None:
            return cls(cells, parts, tables, table_of)
        for number, cell in enumerate(cut.tolist(), len(shapes)):
            tables[number] = _free(cells, cell, tables[cells.shape_of[*cell]], parts, area)
        return cls(cells.without(inside), parts, tables, table_of, area)

    @cached_property
    def sides(self) -> tuple[WholeArray, WholeArray, WholeArray]:
        """The numbers of the sides, and the place of each, as `region_kernels.least_costs` takes them."""
        is_open = np.pad(np.isfinite(self.cells.costs), 1)
        is_side = (is_open[1:, 1:-1] | is_open[:-1, 1:-1]), (is_open[1:-1, 1:] | is_open[1:-1, :-1])
        count = int(is_side[0].sum())
        columns = self.cells.costs.shape[1]
        numbers, places = [], []
        for kind, has in enumerate(is_side):
            number = np.full(has.shape, -1, dtype=np.int32)
            number[has] = np.arange(kind * count, kind * count + int(has.sum()))
            row, column = np.nonzero(has)
            numbers.append(number)
            places.append(2 * (row * (columns + 1) + column) + kind)
        return numbers[0], numbers[1], np.concatenate(places)

    @property
    def n_corners(self) -> int:
        """How many corners there are; the other nodes come after them."""
        return len(self.cells.x) * len(self.cells.y)

    @property
    def n_nodes(self) -> int:
        """How many nodes there are."""
        return self.n_corners + len(self.sides[2]) * len(self.parts)

    @property
    def positions(self) -> FloatArray:
        """Places of all nodes, shape ``(n, 2)``, map units."""
        return self.places(np.arange(self.n_nodes))

    def places(self, nodes: IntArray) -> FloatArray:
        """Return the places of nodes, shape ``(n, 2)``, map units."""
        x, y, m = self.cells.x, self.cells.y, max(len(self.parts), 1)
        kind, row, column = self.sides_of(nodes)
        part = np.append(self.parts, 0.0)[np.where(kind >= 0, (nodes - self.n_corners) % m, -1)]
        right, up = np.minimum(column + 1, len(x) - 1), np.minimum(row + 1, len(y) - 1)
        along_x, along_y = np.where(kind == 0, part, 0.0), np.where(kind == 1, part, 0.0)
        return np.column_stack([x[column] + along_x * (x[right] - x[column]), y[row] + along_y * (y[up] - y[row])])

    def nodes_of(self, row: int, column: int) -> IntArray:
        """Return the nodes on the border of a cell, shape ``(4 + 4 m,)``."""
        columns, m = len(self.cells.x), len(self.parts)
        corner = row * columns + column
        horizontal, vertical, _ = self.sides
        sides = horizontal[row, column], horizontal[row + 1, column], vertical[row, column], vertical[row, column + 1]
        inner = [self.n_corners + int(side) * m + np.arange(m) for side in sides]
        return np.concatenate([[corner, corner + 1, corner + columns, corner + columns + 1], *inner])

    def around(self, place: Point) -> tuple[IntArray, FloatArray]:
        """Return the nodes on the borders of the cells that a place is in, and the least cost to each, map units."""
        found = [(self.nodes_of(*cell), self.cells.costs[cell]) for cell in self.cells.cells_of(place)]
        if not found:
            return np.empty(0, dtype=np.int64), np.empty(0)
        nodes = np.concatenate([near for near, _ in found])
        cost = np.repeat([cost for _, cost in found], len(found[0][0]))
        at = self.places(nodes)
        costs = cost * np.hypot(*(at - place).T)
        if self.area is not None:
            starts = np.ascontiguousarray(np.broadcast_to(np.array(place), at.shape))
            costs[segments_cross(starts, at, self.area.kernel_arrays)] = math.inf
        return nodes, costs

    def costs_from(self, place: Point, limit: float = math.inf) -> FloatArray:
        """
        Return the least cost from a place to each node, shape ``(n,)``, map units; that beyond a limit may be greater.

        Examples
        --------
        >>> from cgla_graph.model.problem import Problem
        >>> points = Points.lay(Arrangement.of(Problem((0, 0), (1, 1))), 1)
        >>> points.costs_from((0.5, 0.5)).round(3).tolist()
        [0.707, 0.707, 0.707, 0.707, 0.5, 0.5, 0.5, 0.5]
        """
        values = np.full(self.n_nodes, math.inf)
        np.minimum.at(values, *self.around(place))
        self.spread(values, limit)
        return values

    def spread(self, values: FloatArray, limit: float) -> None:
        """Turn costs of some nodes, infinite elsewhere, into the least costs from there, in place."""
        region_kernels.least_costs(
            self.cells.costs, self.tables, self.table_of, *self.sides, len(self.parts), limit, values, self.lines
        )

    @cached_property
    def lines(self) -> FloatArray:
        """Costs of the intervals of all sides, shape ``(sides, m + 1)``; empty if they are those of the cells."""
        if self.cells.along is None:
            return np.empty((0, 0))
        steps = np.diff(self.parts, prepend=0.0, append=1.0)
        costs = np.empty((len(self.sides[2]), len(steps)))
        sizes = np.broadcast_to(np.diff(self.cells.x), self.sides[0].shape), np.diff(self.cells.y)[:, None]
        for numbers, along, size in zip(self.sides[:2], self.cells.along, sizes, strict=True):
            costs[numbers[numbers >= 0]] = (along * size)[numbers >= 0, None] * steps
        return costs

    def nodes_to(self, values: FloatArray, place: Point) -> IntArray:
        """
        List the nodes of the best way from a place to the source of some costs; none if there is no way.

        Examples
        --------
        >>> from cgla_graph.model.problem import Problem
        >>> points = Points.lay(Arrangement.of(Problem((0, 0), (1, 1))), 1)
        >>> points.places(points.nodes_to(points.costs_from((0.5, 0.5)), (0.0, 0.25))).tolist()
        [[0.0, 0.5]]
        """
        near, first = self.around(place)
        if not len(near) or not math.isfinite(float((first + values[near]).min())):
            return np.empty(0, dtype=np.int64)
        nodes = np.full(self.n_nodes, near[np.argmin(first + values[near])])
        count = region_kernels.descend(
            self.cells.costs, self.tables, self.table_of, *self.sides, len(self.parts), values, self.lines, nodes
        )
        return nodes[:count]

    def sides_of(self, nodes: IntArray) -> tuple[IntArray, IntArray, IntArray]:
        """
        Return the kind of each node's side, 0 for horizontal and 1 for vertical ones, and its row and column.

        Corners have kind -1, and the row and column of their own.
        """
        beyond = nodes - self.n_corners
        on_side = beyond >= 0
        side = np.where(on_side, beyond // max(len(self.parts), 1), 0)
        code = np.where(on_side, self.sides[2][side], 2 * nodes)
        row, column = np.divmod(code >> 1, len(self.cells.x))
        return np.where(on_side, code & 1, -1), row, column

    def least_on_cells(self, values: FloatArray) -> FloatArray:
        """
        Return the least value on the border of each cell, shape ``(rows, columns)``.

        Examples
        --------
        >>> points = Points.lay(Arrangement.laid(np.arange(3.0), np.arange(2.0), np.ones((1, 2))), 1)
        >>> points.least_on_cells(points.positions[:, 0]).tolist()
        [[0.0, 1.0]]
        """
        rows, columns = self.cells.costs.shape
        corners = values[: self.n_corners].reshape(rows + 1, columns + 1)
        least: FloatArray = np.minimum.reduce([corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:]])
        if len(self.parts):
            # (-1 is a side of no cell)
            of_side = np.append(values[self.n_corners :].reshape(-1, len(self.parts)).min(axis=1), math.inf)
            horizontal, vertical, _ = self.sides
            for sides in (horizontal[:-1], horizontal[1:], vertical[:, :-1], vertical[:, 1:]):
                np.minimum(least, of_side[sides], out=least)
        return least


def covered(cells: Arrangement, area: NoFlyArea, off: float = 0.0) -> tuple[BoolArray, BoolArray]:
    """
    Return which cells are inside an area, and which meet its outline up to `off`, shape ``(rows, columns)`` each.

    Examples
    --------
    >>> import shapely
    >>> lines = np.arange(5.0)
    >>> cells = Arrangement.laid(lines, lines, np.ones((4, 4)))
    >>> [found.sum(axis=0).tolist() for found in covered(cells, NoFlyArea(shapely.box(0.5, 0.5, 3.5, 3.5)))]
    [[0, 2, 2, 0], [4, 2, 2, 4]]
    """
    j, i = np.nonzero(met(cells, shapely.get_rings(shapely.get_parts(area.geometry)), 1))
    boxes = shapely.box(cells.x[i] - off, cells.y[j] - off, cells.x[i + 1] + off, cells.y[j + 1] + off)
    edge = shapely.boundary(area.geometry)
    shapely.prepare(edge)
    cut = np.zeros(cells.costs.shape, dtype=np.bool_)
    cut[j, i] = shapely.intersects(edge, boxes)
    # (where no way leads through, it does not matter)
    j, i = np.nonzero(np.isfinite(cells.costs) & ~cut)
    inside = np.zeros(cells.costs.shape, dtype=np.bool_)
    inside[j, i] = area.contains(0.5 * np.column_stack([cells.x[i] + cells.x[i + 1], cells.y[j] + cells.y[j + 1]]))
    return inside, cut


def met(cells: Arrangement, lines: NDArray[np.object_], reach: int) -> BoolArray:
    """
    Return which cells are up to `reach` rows and columns off those that some lines may meet, shape ``(rows, columns)``.

    Examples
    --------
    >>> lines = np.arange(6.0)
    >>> cells = Arrangement.laid(lines, lines, np.ones((5, 5)))
    >>> met(cells, np.array([shapely.LineString([(0.5, 0.5), (1.5, 0.5)])]), 1).sum(axis=1).tolist()
    [3, 3, 0, 0, 0]
    """
    rows, columns = cells.costs.shape
    # (between lines that nearly meet there are cells as thin as rounding: pieces as short are too many)
    step = 0.5 * float(min(np.median(np.diff(cells.x)), np.median(np.diff(cells.y))))
    at, line = shapely.get_coordinates(shapely.segmentize(lines, step), return_index=True)
    # the cells from the lowest to the highest of the two ends of each piece, and their neighbours
    column, row = np.searchsorted(cells.x, at[:, 0]) - 1, np.searchsorted(cells.y, at[:, 1]) - 1
    one = np.nonzero(line[1:] == line[:-1])[0]
    low_row, low_column = np.minimum(row[one], row[one + 1]), np.minimum(column[one], column[one + 1])
    high_row, high_column = np.maximum(row[one], row[one + 1]), np.maximum(column[one], column[one + 1])
    count = np.zeros((rows + 1, columns + 1), dtype=np.int32)
    for up, rows_at in ((1, low_row - reach), (-1, high_row + reach + 1)):
        for right, columns_at in ((1, low_column - reach), (-1, high_column + reach + 1)):
            np.add.at(count, (np.clip(rows_at, 0, rows), np.clip(columns_at, 0, columns)), up * right)
    return np.asarray(count.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0)


def _free(cells: Arrangement, cell: list[int], table: FloatArray, parts: FloatArray, area: NoFlyArea) -> FloatArray:
    """Return the table of a cell without the ways that cross an area."""
    row, column = cell
    low, high = np.array([cells.x[column], cells.y[row]]), np.array([cells.x[column + 1], cells.y[row + 1]])
    at = low + border_points(1.0, 1.0, parts) * (high - low)
    one, other = np.triu_indices(len(at), 1)
    crossing = segments_cross(at[one], at[other], area.kernel_arrays)
    free: FloatArray = table.copy()
    free[one[crossing], other[crossing]] = free[other[crossing], one[crossing]] = math.inf
    return free

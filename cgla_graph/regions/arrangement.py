"""The cells on which the cost of a problem is constant: between the lines of its `nearest` rasters."""

import math
from dataclasses import dataclass, replace

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.model.problem import Problem
from cgla_graph.model.rasters.values import parts_of
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.risk_raster_kernels import NEAR_X

#: Lines nearer than this part of the least cell are one line, and sides of cells that differ by less are equal.
SAME = 1e-9
#: The outer edges of a raster belong to it. Beside them the risk may be less, so that no path is best: lines lie
#: outside of the edges, by this part of a cell, where paths along them have the lesser cost.
BESIDE = 1e-7
#: No line is laid nearer to another one than this part of a cell.
APART = 0.1
#: Different widths of columns times heights of rows, at most: there is a table of distances for each.
MOST_SHAPES = 256
#: Cells of an arrangement, at most, about 50 bytes each while it is searched; more are joined to blocks.
MOST_CELLS = 21_000_000


@dataclass(frozen=True, eq=False)
class Arrangement:
    """
    Rectangles of constant cost that fill the bounds of a problem.

    Lines on which the cost of no cell changes are left out. On a common side of two cells, the lesser cost holds.

    Attributes
    ----------
    x, y
        The lines, ascending, shape ``(columns + 1,)`` and ``(rows + 1,)``, map units.
    costs
        Cost of a unit of length on each cell, shape ``(rows, columns)``, at least 1; infinite inside a no-fly area.
    widths, heights
        The different widths of columns and heights of rows, map units.
    shape_of
        The shape of each cell, shape ``(rows, columns)``: ``height * len(widths) + width``, by their numbers.
    along
        Cost of a unit of length along horizontal and vertical lines, shape ``(rows + 1, columns)`` and ``(rows, columns
        + 1)``, where that may be less than on the cells beside: on lines of several rasters, and on the border of the
        map if it is a line of a raster that goes on beyond. Else None.
    block
        How many cells a side were joined to each of these, with their mean cost, because there are too many; for a
        bound there is one cell then, of the least cost that there may be.
    """

    x: FloatArray
    y: FloatArray
    costs: FloatArray
    widths: FloatArray
    heights: FloatArray
    shape_of: IntArray
    along: tuple[FloatArray, FloatArray] | None = None
    block: int = 1

    @classmethod
    def of(cls, problem: Problem, *, least: int = 1, for_bound: bool = False, joins: bool = True) -> "Arrangement":
        """
        Lay the lines of the rasters over the bounds, and more lines where cells are too large.

        Parameters
        ----------
        problem
            The problem. Where its cost is not constant on cells (`refusal`), it is sampled in their middles.
        least
            No cell is longer than this part of the longer side of the bounds: with 1, lines are those of rasters.
        for_bound
            Whether no path may cost less than over the cells: then lines are on the edges of rasters.
        joins
            Whether lines are left out on which no cost changes.

        Examples
        --------
        >>> from cgla_graph.model.risk import RiskField
        >>> from cgla_graph.model.risk_raster import RasterRisk
        >>> values = [[1, 1, 3], [1, 1, 4]]
        >>> field = RiskField(rasters=[RasterRisk(values, (0, 0, 3, 2), interpolation="nearest")])
        >>> laid = Arrangement.of(Problem((0.5, 0.5), (2.5, 1.5), field, k=10.0, bounds=(0, 0, 4, 2)))
        >>> laid.x.tolist(), laid.y.tolist()
        ([0.0, 2.0, 3.0, 4.0], [0.0, 1.0, 2.0])
        >>> laid.costs.tolist()
        [[11.0, 41.0, 1.0], [11.0, 31.0, 1.0]]
        """
        x, y = (_lines(problem, axis, least, 0.0 if for_bound else BESIDE) for axis in (0, 1))
        if (len(x) - 1) * (len(y) - 1) > MOST_CELLS:
            return _laid_in_parts(problem, x, y, joins=joins and least == 1, for_bound=for_bound)
        found = cls.between(problem, x, y)
        costs, along = found.costs, found.along
        if joins and least == 1 and (along is None or len(problem.field.rasters) == 1):
            kept_x, kept_y = (_changing(costs, axis) for axis in (1, 0))
            if along is not None:
                kept_x |= _changing(along[0][[0, -1]], 1)
                kept_y |= _changing(along[1][:, [0, -1]], 0)
            joined = x[kept_x], y[kept_y]
            if len(_different(np.diff(joined[0]))[0]) * len(_different(np.diff(joined[1]))[0]) <= MOST_SHAPES:
                x, y, costs = *joined, costs[kept_y[:-1]][:, kept_x[:-1]]
                if along is not None:
                    along = along[0][kept_y][:, kept_x[:-1]], along[1][kept_y[:-1]][:, kept_x]
                found = replace(cls.laid(x, y, costs), along=along)
        return found

    @classmethod
    def between(cls, problem: Problem, x: FloatArray, y: FloatArray) -> "Arrangement":
        """
        Lay cells between lines, among which all lines of the rasters are.

        Examples
        --------
        >>> lines = np.array([0.0, 0.5, 1.0])
        >>> Arrangement.between(Problem((0, 0), (1, 1)), lines, lines).costs.tolist()
        [[1.0, 1.0], [1.0, 1.0]]
        """
        costs = _costs(problem, x, y)
        return replace(cls.laid(x, y, costs), along=None if refusal(problem) else _along_lines(problem, x, y, costs))

    @classmethod
    def laid(cls, x: FloatArray, y: FloatArray, costs: FloatArray, block: int = 1) -> "Arrangement":
        """Return the cells between lines."""
        (widths, width), (heights, height) = _different(np.diff(x)), _different(np.diff(y))
        # (kernels are compiled once for each layout of arrays in memory)
        costs = np.ascontiguousarray(costs)
        return cls(x, y, costs, widths, heights, height[:, None] * len(widths) + width, block=block)

    def coarsened(self, times: int) -> "Arrangement":
        """
        Join blocks of cells, with their mean cost.

        Examples
        --------
        >>> lines = np.arange(4.0)
        >>> Arrangement.laid(lines, lines, np.arange(9.0).reshape(3, 3)).coarsened(2).costs.tolist()
        [[2.0, 3.5], [6.5, 8.0]]
        """
        row, column = (np.arange(0, count, times) for count in self.costs.shape)
        areas = np.diff(self.y)[:, None] * np.diff(self.x)

        def sums(values: FloatArray) -> FloatArray:
            return np.asarray(np.add.reduceat(np.add.reduceat(values, row, axis=0), column, axis=1))

        x, y = np.append(self.x[column], self.x[-1]), np.append(self.y[row], self.y[-1])
        return Arrangement.laid(x, y, sums(self.costs * areas) / sums(areas))

    def divided(self, across: int, up: int) -> "Arrangement":
        """
        Divide all cells into equal ones, columns and rows.

        Examples
        --------
        >>> laid = Arrangement.laid(np.arange(3.0), np.arange(2.0), np.array([[1.0, 2.0]])).divided(2, 1)
        >>> laid.x.tolist(), laid.costs.tolist()
        ([0.0, 0.5, 1.0, 1.5, 2.0], [[1.0, 1.0, 2.0, 2.0]])
        """
        x, y = _in_parts(self.x, across), _in_parts(self.y, up)
        return Arrangement.laid(x, y, np.repeat(np.repeat(self.costs, up, axis=0), across, axis=1))

    def with_lines(self, x: FloatArray, y: FloatArray, apart: float = APART) -> "Arrangement":
        """
        Divide cells at further lines, but for those beside others.

        Parameters
        ----------
        x, y
            The lines, map units; those that are outside, or too near to another line, are left out.
        apart
            How far they have to be from other lines, as a part of a cell.

        Examples
        --------
        >>> laid = Arrangement.laid(np.arange(3.0), np.arange(2.0), np.array([[1.0, 2.0]]))
        >>> more = laid.with_lines(np.array([0.5, 1.001]), np.array([]))
        >>> more.x.tolist(), more.costs.tolist()
        ([0.0, 0.5, 1.0, 2.0], [[1.0, 1.0, 2.0]])
        """
        (x, column), (y, row) = (_further(lines, more, apart) for lines, more in ((self.x, x), (self.y, y)))
        costs = self.costs[np.ix_(row[:-1], column[:-1])]
        divided = Arrangement.laid(x, y, costs, self.block)
        if self.along is None:
            return divided
        # (on a line inside of a cell, its cost holds)
        within_x, within_y = ~np.isin(x, self.x), ~np.isin(y, self.y)
        up, across = self.along[0][np.ix_(row, column[:-1])], self.along[1][np.ix_(row[:-1], column)]
        up[within_y] = costs[within_y[:-1]]
        across[:, within_x] = costs[:, within_x[:-1]]
        return replace(divided, along=(up, across))

    def of_few_shapes(self, most: int) -> "Arrangement":
        """
        Round widths and heights until so many shapes are left, at most; lines stay where they are.

        Each size is rounded to the mean of those that are about as long, so that sums over many cells stay right.

        Examples
        --------
        >>> laid = Arrangement.laid(np.array([0.0, 1.0, 3.0, 6.0, 10.0]), np.array([0.0, 1.0]), np.ones((1, 4)))
        >>> laid.widths.tolist(), laid.of_few_shapes(2).widths.tolist(), laid.of_few_shapes(2).shape_of.tolist()
        ([1.0, 2.0, 3.0, 4.0], [1.0, 3.0], [[0, 1, 1, 1]])
        """
        across, up = len(self.widths), len(self.heights)
        if across * up <= most:
            return self
        half = math.isqrt(most)
        (widths, width), (heights, height) = (
            _rounded(np.diff(lines), max(half, most // other)) for lines, other in ((self.x, up), (self.y, across))
        )
        return Arrangement(self.x, self.y, self.costs, widths, heights, height[:, None] * len(widths) + width)

    def without(self, cells: BoolArray) -> "Arrangement":
        """Return an arrangement in which no path enters some cells, shape ``(rows, columns)``."""
        costs = np.where(cells, math.inf, self.costs)
        return replace(self, costs=costs)

    def cells_of(self, place: tuple[float, float]) -> list[tuple[int, int]]:
        """List the cells that a place is in or on the border of, as ``(row, column)``."""
        (columns, rows) = (_touched(lines, at) for lines, at in zip((self.x, self.y), place, strict=True))
        return [(row, column) for row in rows for column in columns if math.isfinite(self.costs[row, column])]


def refusal(problem: Problem) -> str:
    """
    Return why the cost of a problem is not constant on cells; empty if it is.

    Examples
    --------
    >>> refusal(Problem((0, 0), (1, 1)))
    'it takes risk on rasters whose interpolation is nearest; there is no raster'
    """
    field, takes = problem.field, "it takes risk on rasters whose interpolation is nearest"
    if field.every_threat:
        return f"{takes}, and no threats; there are {len(field.every_threat)}"
    if not field.rasters:
        return f"{takes}; there is no raster"
    other = next((raster for raster in field.rasters if raster.interpolation != "nearest"), None)
    return "" if other is None else f"{takes}; one is {other.interpolation}"


def has_cells(problem: Problem) -> bool:
    """
    Tell whether the cost of a problem is constant on the cells of `nearest` rasters, and differs between them.

    Examples
    --------
    >>> has_cells(Problem((0, 0), (1, 1)))
    False
    """
    return problem.k > 0.0 and not refusal(problem)


def _lines(problem: Problem, axis: int, parts: int, beside: float) -> FloatArray:
    """Return the lines across one axis: of the rasters, the bounds, and as many more as cells have to be divided."""
    low, high = problem.bounds[axis], problem.bounds[axis + 2]
    every, least = [np.array([low, high])], high - low
    for raster in problem.field.rasters:
        count, size = raster.shape[1 - axis], raster.cell_size[axis]
        edges = raster.bounds[axis] + np.arange(count + 1) * size
        edges[[0, -1]] = raster.bounds[axis] - beside * size, raster.bounds[axis + 2] + beside * size
        every.append(edges)
        least = min(least, size)
    lines = np.unique(np.concatenate(every))
    # (the bounds stay as they are)
    lines = lines[(lines > low + SAME * least) & (lines < high - SAME * least)]
    apart = np.diff(lines, prepend=-math.inf) > SAME * least
    lines = np.concatenate([[low], lines[apart], [high]])
    if parts == 1:
        return lines
    longest = max(problem.bounds[2] - problem.bounds[0], problem.bounds[3] - problem.bounds[1]) / parts
    times = np.maximum(np.ceil(np.diff(lines) / longest - SAME), 1.0).astype(np.int64)
    number = np.repeat(np.arange(len(times)), times)
    part = (np.arange(len(number)) - np.repeat(np.cumsum(times) - times, times)) / times[number]
    return np.append(lines[number] + part * np.diff(lines)[number], high)


def _laid_in_parts(problem: Problem, x: FloatArray, y: FloatArray, *, joins: bool, for_bound: bool) -> Arrangement:
    """Lay cells of which there are too many to have all costs in memory: equal ones are joined, or else blocks."""
    rows, columns = len(y) - 1, len(x) - 1
    # (along the lines of several rasters, and on the border, costs may be less)
    joins = joins and not (for_bound and (len(problem.field.rasters) > 1 or _on_border(problem, x, y) is not None))
    if joins and (found := _joined(problem, x, y)) is not None:
        return Arrangement.laid(*found)
    times = math.ceil(math.sqrt(rows * columns / MOST_CELLS))
    if for_bound:
        return Arrangement.laid(x[[0, -1]], y[[0, -1]], np.ones((1, 1)), max(rows, columns))
    row, column = np.arange(0, rows, times), np.arange(0, columns, times)
    wide, high = np.append(x[column], x[-1]), np.append(y[row], y[-1])
    laid = np.empty((len(row), len(column)))
    for part in parts_of((len(row), times * columns)):
        first, last = part.start * times, min(part.stop * times, rows)
        some = _costs(problem, x, y[first : last + 1])
        some *= np.diff(y[first : last + 1])[:, None] * np.diff(x)
        sums = np.add.reduceat(np.add.reduceat(some, row[part] - first, axis=0), column, axis=1)
        laid[part] = sums / (np.diff(high)[part, None] * np.diff(wide))
    return Arrangement.laid(wide, high, laid, times)


def _joined(problem: Problem, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return lines and costs without the lines on which no cost changes; None if too many are left."""
    rows, columns = len(y) - 1, len(x) - 1
    kept_x, kept_y = np.zeros(columns + 1, dtype=np.bool_), np.zeros(rows + 1, dtype=np.bool_)
    kept_x[[0, -1]] = kept_y[-1] = True
    found: list[FloatArray] = []
    before = np.full((1, columns), math.nan)
    for part in parts_of((rows, columns)):
        some = _costs(problem, x, y[part.start : part.stop + 1])
        kept_x[1:-1] |= (some[:, 1:] != some[:, :-1]).any(axis=0)
        kept_y[part] = (some != np.concatenate([before, some[:-1]])).any(axis=1)
        found.append(some[kept_y[part]])
        before = some[-1:].copy()
        if (np.count_nonzero(kept_y) - 1) * columns > MOST_CELLS:
            return None
    joined = x[kept_x], y[kept_y]
    few = len(_different(np.diff(joined[0]))[0]) * len(_different(np.diff(joined[1]))[0]) <= MOST_SHAPES
    return (*joined, np.concatenate(found)[:, kept_x[:-1]]) if few else None


def _costs(problem: Problem, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the cost on each cell, in its middle."""
    middles = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
    jumping = [raster for raster in problem.field.rasters if raster.interpolation == "nearest"]
    others = [raster for raster in problem.field.rasters if raster.interpolation != "nearest"]
    risk = np.zeros((len(y) - 1, len(x) - 1))
    if others or problem.field.every_threat:
        grid = np.stack(np.meshgrid(*middles), axis=-1)
        risk = problem.field.with_rasters(others).density(grid.reshape(-1, 2)).reshape(risk.shape)
    for raster in jumping:
        risk += _risk_on(raster, *middles)
    risk *= problem.k
    risk += 1.0
    return risk


def _risk_on(raster: RasterRisk, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the risk of a `nearest` raster at all pairs of coordinates, none of them on its lines."""
    rows, columns = raster.shape
    width, height = raster.cell_size
    column = np.floor((x - raster.bounds[0]) / width).astype(np.int64)
    row = np.floor((y - raster.bounds[1]) / height).astype(np.int64)
    covered = np.nonzero((column >= 0) & (column < columns))[0], np.nonzero((row >= 0) & (row < rows))[0]
    risk = np.zeros((len(y), len(x)))
    risk[np.ix_(covered[1], covered[0])] = raster.cells_at(np.ix_(row[covered[1]], column[covered[0]]))
    return risk


def _along_lines(
    problem: Problem, x: FloatArray, y: FloatArray, costs: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return the costs along lines, on which each raster has its lesser value; None if they are those of cells."""
    middles = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
    border = _on_border(problem, x, y)
    up, across = np.minimum(costs[1:], costs[:-1]), np.minimum(costs[:, 1:], costs[:, :-1])
    lesser = border is not None
    # (two rasters have a line in common)
    if len(problem.field.rasters) > 1:
        low, left = np.zeros(up.shape), np.zeros(across.shape)
        for raster in problem.field.rasters:
            risk = _risk_on(raster, *middles)
            low += np.minimum(risk[1:], risk[:-1])
            left += np.minimum(risk[:, 1:], risk[:, :-1])
        low, left = 1.0 + problem.k * low, 1.0 + problem.k * left
        lesser |= bool((low < up).any() or (left < across).any())
        up, across = np.minimum(up, low), np.minimum(across, left)
    if not lesser:
        return None
    lower, upper, left, right = border or (costs[0], costs[-1], costs[:, 0], costs[:, -1])
    return np.vstack([lower, up, upper]), np.column_stack([left, across, right])


def _on_border(
    problem: Problem, x: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None:
    """
    Return the costs along the border of the map: lower, upper, left, right; None if they are those of cells.

    A border that is a line of a raster, or as near to it as rounding, has the lesser value of the cells on both sides.
    """
    middles = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
    found: list[FloatArray] = []
    lesser = False
    for axis, place in ((1, 0), (1, -1), (0, 0), (0, -1)):
        inside, least = (np.zeros(len(middles[1 - axis])) for _ in range(2))
        for raster in problem.field.rasters:
            here, beyond = (
                _risk_across(raster, axis, at, middles[1 - axis])
                for at in (middles[axis][place], _beside((x, y)[axis][place], raster, axis, 1.0 if place else -1.0))
            )
            inside += here
            least += np.minimum(here, beyond)
        found.append(1.0 + problem.k * least)
        lesser |= bool((found[-1] < 1.0 + problem.k * inside).any())
    return (found[0], found[1], found[2], found[3]) if lesser else None


def _beside(at: float, raster: RasterRisk, axis: int, way: float) -> float:
    """Return a coordinate whose value counts on a border: one beyond it, or inside the raster whose edge it is on."""
    size, first, count = raster.cell_size[axis], raster.bounds[axis], raster.shape[1 - axis]
    near = float(raster.header(0)[NEAR_X + axis])
    place = (at - first) / size
    number = math.floor(place + 2.0 * way * max(near, SAME))
    if -near <= place <= count + near:
        # (the edge belongs to the raster)
        number = min(max(number, 0), count - 1)
    return float(first + (number + 0.5) * size)


def _risk_across(raster: RasterRisk, axis: int, at: float, others: FloatArray) -> FloatArray:
    """Return the risk of a `nearest` raster at one coordinate along an axis, and all of the others."""
    one = np.array([at])
    return _risk_on(raster, one, others)[:, 0] if axis == 0 else _risk_on(raster, others, one)[0]


def _changing(costs: FloatArray, axis: int) -> BoolArray:
    """Return which lines across an axis some cost changes on, the first and last ones included."""
    of = np.moveaxis(costs, axis, 0)
    ends = np.ones(1, dtype=np.bool_)
    return np.concatenate([ends, (of[1:] != of[:-1]).any(axis=1), ends])


def _in_parts(lines: FloatArray, times: int) -> FloatArray:
    """Return lines with others between them."""
    parts = lines[:-1, None] + np.diff(lines)[:, None] * (np.arange(times) / times)
    return np.append(parts.ravel(), lines[-1])


def _further(lines: FloatArray, more: FloatArray, apart: float) -> tuple[FloatArray, IntArray]:
    """Return lines and some of `more` between them, and the number of the last old one up to each."""
    kept = lines.tolist()
    for at in np.sort(more).tolist():
        number = int(np.searchsorted(kept, at))
        if 0 < number < len(kept):
            low, high = kept[number - 1], kept[number]
            step = apart * min(high - low, float(np.diff(lines)[np.searchsorted(lines, at) - 1]))
            if low + step < at < high - step:
                kept.insert(number, at)
    found = np.array(kept)
    return found, np.searchsorted(lines, found, "right") - 1


def _different(sizes: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the different sizes, and the number of each; those that differ by rounding are equal."""
    unit = SAME * float(sizes.min())
    _, first, number = np.unique(np.round(sizes / unit * 0.25), return_index=True, return_inverse=True)
    return sizes[first], number


def _rounded(sizes: FloatArray, most: int) -> tuple[FloatArray, IntArray]:
    """Return means of so many groups of sizes, at most, and the group of each."""
    part = np.minimum((sizes / sizes.max() * most).astype(np.int64), most - 1)
    _, number, count = np.unique(part, return_inverse=True, return_counts=True)
    return np.bincount(number, sizes) / count, number


def _touched(lines: FloatArray, at: float) -> list[int]:
    """List the intervals between lines that a coordinate is in, or at the end of."""
    first = max(int(np.searchsorted(lines, at, "left")) - 1, 0)
    last = min(int(np.searchsorted(lines, at, "right")), len(lines) - 1)
    return list(range(first, last))

"""Runs of cells in the rows of a grid, and the frames around them: what a tube of paths takes up, layer by layer."""

from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.timed.march_kernels import SmallArray

#: The first and the last column (exclusive) of each row: shape ``(rows,)``, or of all layers, ``(layers, rows)``.
Runs: TypeAlias = tuple[IntArray, IntArray]
AnyArray = TypeVar("AnyArray", FloatArray, SmallArray, BoolArray)


class Frame(NamedTuple):
    """
    A box of nodes of a grid: its first row and column, and how many it has.

    Examples
    --------
    >>> frame = Frame.around((np.array([0, 2, 0]), np.array([0, 4, 0])), 1, (3, 9))
    >>> frame, frame.joined(Frame(2, 7, 1, 2)).columns
    (Frame(row=0, column=1, rows=3, columns=4), 8)
    >>> frame.cut(np.ones((1, 1)), Frame(1, 3, 1, 1), fill=0.0).tolist()
    [[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 0.0]]
    """

    row: int
    column: int
    rows: int
    columns: int

    @classmethod
    def around(cls, runs: Runs, by: int, shape: tuple[int, int]) -> "Frame":
        """Return the least frame around the runs of a layer, wider by so many nodes, within a grid of this shape."""
        begin, end = runs
        rows = np.nonzero(begin < end)[0]
        if not len(rows):
            return cls(0, 0, 0, 0)
        low, left = max(int(rows[0]) - by, 0), max(int(begin[rows].min()) - by, 0)
        return cls(low, left, min(int(rows[-1]) + 1 + by, shape[0]) - low, min(int(end.max()) + by, shape[1]) - left)

    @property
    def size(self) -> tuple[int, int]:
        """Shape of its arrays."""
        return self.rows, self.columns

    def of(self, array: AnyArray) -> AnyArray:
        """Return what it has of an array of the whole grid, shape ``(rows, columns, …)``."""
        rows, columns = slice(self.row, self.row + self.rows), slice(self.column, self.column + self.columns)
        return np.ascontiguousarray(array[rows, columns])

    def joined(self, other: "Frame") -> "Frame":
        """Return the least frame that holds both."""
        if not self.rows or not other.rows:
            return other if not self.rows else self
        row, column = min(self.row, other.row), min(self.column, other.column)
        rows = max(self.row + self.rows, other.row + other.rows) - row
        return Frame(row, column, rows, max(self.column + self.columns, other.column + other.columns) - column)

    def cut(self, array: AnyArray, of: "Frame", *, fill: float) -> AnyArray:
        """Return what this frame has of an array, shape ``(rows, columns, …)``, of another one: a filled copy."""
        out = np.full((*self.size, *array.shape[2:]), fill, dtype=array.dtype)
        low, high = max(self.row, of.row), min(self.row + self.rows, of.row + of.rows)
        left, right = max(self.column, of.column), min(self.column + self.columns, of.column + of.columns)
        if low < high and left < right:
            here = slice(low - self.row, high - self.row), slice(left - self.column, right - self.column)
            out[here] = array[low - of.row : high - of.row, left - of.column : right - of.column]
        return out

    def runs(self, runs: Runs) -> Runs:
        """Return the runs of a layer in its own rows and columns."""
        rows = slice(self.row, self.row + self.rows)
        begin, end = (np.clip(each[rows] - self.column, 0, self.columns) for each in runs)
        return begin, end

    def inside(self, runs: Runs) -> BoolArray:
        """Mark the nodes of runs of a layer."""
        begin, end = self.runs(runs)
        columns = np.arange(self.columns)
        return np.asarray((columns >= begin[:, None]) & (columns < end[:, None]))


def in_layer(runs: Runs, n: int) -> Runs:
    """Return the runs of one layer."""
    return runs[0][n], runs[1][n]


def widened(runs: Runs, by: int, shape: tuple[int, int]) -> Runs:
    """Widen runs of each layer along rows and columns, within the grid."""
    columns = shape[1]
    begin, end = (np.asarray(each) for each in runs)
    empty = begin >= end
    low, high = np.where(empty, columns, begin - by), np.where(empty, 0, end + by)
    lows, highs = low.copy(), high.copy()
    for off in range(1, by + 1):
        for one, other in ((slice(off, None), slice(None, -off)), (slice(None, -off), slice(off, None))):
            lows[:, one] = np.minimum(lows[:, one], low[:, other])
            highs[:, one] = np.maximum(highs[:, one], high[:, other])
    lows, highs = np.maximum(lows, 0), np.minimum(highs, columns)
    return np.where(lows < highs, lows, 0), np.where(lows < highs, highs, 0)


def joined(one: Runs, other: Runs) -> Runs:
    """Return the least runs that hold both, in the same rows."""
    first, second = one[0] >= one[1], other[0] >= other[1]
    begin = np.where(first, other[0], np.where(second, one[0], np.minimum(one[0], other[0])))
    return begin, np.where(first, other[1], np.where(second, one[1], np.maximum(one[1], other[1])))


def around_runs(kept: Runs, by: int, shape: tuple[int, int]) -> Runs:
    """Return the nodes that are marched: around the cells of the layer, and of the layers before and after it."""
    begin, end = (np.pad(np.asarray(each), ((1, 1), (0, 0))) for each in kept)
    joint = begin, end
    for shift in (-1, 1):
        moved = np.roll(begin, shift, axis=0), np.roll(end, shift, axis=0)
        joint = joined(joint, moved)
    low, high = widened(joint, by, shape)
    # (two nodes beside each are needed for its derivatives)
    low, high = np.maximum(low, 2), np.minimum(high, shape[1] - 2)
    low[:, :2], high[:, :2], low[:, -2:], high[:, -2:] = 0, 0, 0, 0
    return np.where(low < high, low, 0), np.where(low < high, high, 0)

"""
Sets of cells of a square grid, stored as runs.

A run is a row of an integer array: ``row, first column, last column + 1``. Merged runs are sorted and do not touch.
"""

import numpy as np

from cgla_graph._types import BoolArray, WholeArray


def rectangle(last: tuple[int, int]) -> WholeArray:
    """
    Return the runs of all cells from (0, 0) to `last`, both (column, row).

    Examples
    --------
    >>> rectangle((4, 1)).tolist()
    [[0, 0, 5], [1, 0, 5]]
    """
    rows = np.arange(last[1] + 1)
    return np.column_stack([rows, np.zeros_like(rows), np.full_like(rows, last[0] + 1)])


def count(runs: WholeArray) -> int:
    """
    Count the cells of runs that do not overlap.

    Examples
    --------
    >>> count(rectangle((4, 1)))
    10
    """
    return int((runs[:, 2] - runs[:, 1]).sum())


def merged(runs: WholeArray) -> WholeArray:
    """
    Sort runs and join those that overlap or touch.

    Parameters
    ----------
    runs
        Shape ``(n, 3)``, in any order.

    Examples
    --------
    >>> merged(np.array([[0, 4, 6], [1, 0, 1], [0, 1, 4]])).tolist()
    [[0, 1, 6], [1, 0, 1]]
    """
    if len(runs) == 0:
        return runs
    runs = runs[np.lexsort((runs[:, 1], runs[:, 0]))]
    low, width = runs[:, 1].min(), runs[:, 2].max() - runs[:, 1].min() + 2
    starts = runs[:, 0] * width + runs[:, 1] - low
    ends = np.maximum.accumulate(runs[:, 0] * width + runs[:, 2] - low)
    first = np.nonzero(np.concatenate([[True], starts[1:] > ends[:-1]]))[0]
    last = np.concatenate([first[1:], [len(runs)]]) - 1
    return np.column_stack([runs[first, 0], runs[first, 1], ends[last] - runs[first, 0] * width + low])


def dilated(runs: WholeArray, reach: int) -> WholeArray:
    """
    Widen runs by `reach` cells in every direction, diagonals included; merged.

    Examples
    --------
    >>> dilated(np.array([[5, 7, 8]]), 1).tolist()
    [[4, 6, 9], [5, 6, 9], [6, 6, 9]]
    """
    offsets = np.arange(-reach, reach + 1)
    rows = (runs[:, 0, None] + offsets).ravel()
    spans = np.repeat(runs[:, 1:] + np.array([-reach, reach]), len(offsets), axis=0)
    return merged(np.column_stack([rows, spans]))


def refined(runs: WholeArray, last: tuple[int, int], finer: tuple[int, int]) -> WholeArray:
    """
    Return the cells of a finer grid that touch some cells; merged, and inside the finer grid.

    Cells are centred on nodes. Both grids are over the same bounds, the nodes `last` and `finer` in the same corner.

    Examples
    --------
    >>> refined(np.array([[1, 3, 4]]), (4, 4), (8, 8)).tolist()
    [[1, 5, 8], [2, 5, 8], [3, 5, 8]]
    """
    first_row, last_row = _touched(runs[:, 0], last[1], finer[1])
    first, _ = _touched(runs[:, 1], last[0], finer[0])
    _, final = _touched(runs[:, 2] - 1, last[0], finer[0])
    parts = []
    for offset in range(int((last_row - first_row).max(initial=-1)) + 1):
        here = first_row + offset <= last_row
        parts.append(np.column_stack([first_row + offset, first, final + 1])[here])
    return clipped(merged(np.vstack([np.empty((0, 3), dtype=np.int64), *parts])), finer)


def _touched(index: WholeArray, last: int, finer: int) -> tuple[WholeArray, WholeArray]:
    """Return the first and the last cell of a finer axis that touch each cell of an axis, in whole numbers."""
    # the cell from i - 1/2 to i + 1/2 touches that around j if |j / finer - i / last| is at most half of both widths
    index = index.astype(np.int64)
    low = -((last - (2 * index - 1) * finer) // (2 * last))
    high = ((2 * index + 1) * finer + last) // (2 * last)
    return low, high


def clipped(runs: WholeArray, last: tuple[int, int]) -> WholeArray:
    """
    Drop cells below (0, 0) or beyond `last` (column, row).

    Examples
    --------
    >>> clipped(np.array([[-1, 0, 2], [0, -2, 2], [1, 2, 9]]), (3, 3)).tolist()
    [[0, 0, 2], [1, 2, 4]]
    """
    inside = runs[(runs[:, 0] >= 0) & (runs[:, 0] <= last[1])].copy()
    inside[:, 1] = np.maximum(inside[:, 1], 0)
    inside[:, 2] = np.minimum(inside[:, 2], last[0] + 1)
    return inside[inside[:, 2] > inside[:, 1]]


def cells_of(runs: WholeArray) -> tuple[WholeArray, WholeArray]:
    """
    List the cells of merged runs: columns and rows, shapes ``(n,)``, sorted by row, then column.

    Examples
    --------
    >>> [a.tolist() for a in cells_of(np.array([[0, 1, 3], [2, 0, 1]]))]
    [[1, 2, 0], [0, 0, 2]]
    """
    lengths = runs[:, 2] - runs[:, 1]
    begins = np.cumsum(lengths) - lengths
    columns = np.repeat((runs[:, 1] - begins).astype(np.int32), lengths)
    columns += np.arange(len(columns), dtype=np.int32)
    return columns, np.repeat(runs[:, 0].astype(np.int32), lengths)


def runs_of(columns: WholeArray, rows: WholeArray) -> WholeArray:
    """
    Gather cells into merged runs: the inverse of `cells_of`; cells that are listed twice count once.

    Examples
    --------
    >>> runs_of(np.array([1, 2, 2, 0]), np.array([0, 0, 0, 2])).tolist()
    [[0, 1, 3], [2, 0, 1]]
    """
    return merged(np.column_stack([rows, columns, columns + 1]).astype(np.int64))


def are_in(runs: WholeArray, some: WholeArray) -> BoolArray:
    """
    Return which cells of merged runs are in a subset of them, in the order of `cells_of`.

    Examples
    --------
    >>> are_in(np.array([[0, 1, 5], [2, 0, 1]]), np.array([[0, 2, 4]])).tolist()
    [False, True, True, False, False]
    """
    lengths = runs[:, 2] - runs[:, 1]
    begins = np.cumsum(lengths) - lengths
    low = runs[:, 1].min(initial=0)
    width = runs[:, 2].max(initial=0) - low + 1
    keys, wanted = (some_runs[:, 0] * width + some_runs[:, 1] - low for some_runs in (runs, some))
    within = np.searchsorted(keys, wanted, side="right") - 1
    first = begins[within] + some[:, 1] - runs[within, 1]
    changes = np.zeros(int(lengths.sum()) + 1, dtype=np.int8)
    changes[first] += 1
    changes[first + some[:, 2] - some[:, 1]] -= 1
    return np.cumsum(changes[:-1], dtype=np.int8).astype(np.bool_)

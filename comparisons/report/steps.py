"""Step functions with few points: what a curve of the report keeps of many."""

import numpy as np

from cgla_graph._types import FloatArray, IntArray

#: Most points of a curve of one solver on one scenario, and of one over all scenarios.
MOST_POINTS, MOST_POINTS_OVERALL = 40, 160
_FINEST = 1e-4  # of the spread of the values: below what a screen shows


def thinned(rows: FloatArray, most: int = MOST_POINTS) -> FloatArray:
    """
    Keep the rows where a step function changes by what can be seen.

    Every value that is shown was true at its moment; between two kept rows the curve is off by the slack at most, which
    grows from 1/10000 of the spread until few enough rows are left. The first and the last row stay, and so do those
    where a value becomes finite, unless there are more of these than may stay.

    Parameters
    ----------
    rows
        Shape ``(m, 1 + c)``: a moment, ascending, and `c` values that hold until the next row; they may be infinite.
    most
        How many rows may stay, at least 2.

    Returns
    -------
    rows
        Some of them, shape ``(at most most, 1 + c)``.

    Examples
    --------
    >>> thinned(np.array([[1.0, 9.0], [2.0, 9.0], [3.0, 5.0], [4.0, 5.0]]))
    array([[1., 9.], [3., 5.], [4., 5.]])
    """
    values = rows[:, 1:]
    finite = values[np.isfinite(values)]
    spread = float(np.ptp(finite)) if len(finite) else 0.0
    slack = _FINEST * spread
    kept = _changes(values, slack)
    while len(kept) > most and slack < spread:
        slack *= 2.0
        kept = _changes(values, slack)
    if len(kept) > most:
        kept = kept[np.unique(np.linspace(0, len(kept) - 1, most).round().astype(int))]
    return rows[kept]


def _changes(values: FloatArray, slack: float) -> IntArray:
    """List the first row, the last one, and those with a value in another step of the slack than the row before."""
    if not len(values):
        return np.empty(0, dtype=np.int64)
    levels = np.floor(values / slack) if slack > 0.0 else values
    changed = (levels[1:] != levels[:-1]).any(axis=1)
    changed[-1:] = True
    return np.concatenate([[0], np.nonzero(changed)[0] + 1])

"""What the oracle says of a timed path, and the rows of such paths."""

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr
from cgla_graph._types import FloatArray, IntArray
from cgla_graph._validate import number_array
from cgla_graph.errors import ProblemError
from cgla_graph.motion.trajectory import Trajectory

#: A path in time: rows ``(t, x, y)``, or a `Trajectory`.
Timed: TypeAlias = ArrayLike | Trajectory
#: Times of rows may differ from those of the flight by this part of the time that it takes.
TIME_TOLERANCE = 1e-9
#: A row this near to an event, as a part of the time since departure, counts as at that event.
SNAP = 1e-12


@dataclass(frozen=True)
class TimedEvaluation(ShortRepr):
    """
    The oracle's evaluation of a timed path.

    Attributes
    ----------
    departure, arrival
        Its first and last time.
    air_distance
        The way through the air, ``speed`` times the time in flight. In still air it is the ground distance.
    ground_distance
        The way over the ground, map units.
    waiting
        The time spent waiting.
    risk
        The integral of the risk over the ground distance, or over time (`TimedProblem`).
    cost
        ``air_distance + k * risk``, and the price of waiting.
    clearance
        Least distance to the areas that are closed at the time, map units; infinite without one.
    separation
        Least distance to the trajectories of others, map units; infinite where none is there at the time.
    violations
        Why it is not feasible, one sentence each; empty if it is.
    """

    departure: float
    arrival: float
    air_distance: float
    ground_distance: float
    waiting: float
    risk: float
    cost: float
    clearance: float
    separation: float = math.inf
    violations: tuple[str, ...] = ()

    @property
    def time(self) -> float:
        """From departure to arrival."""
        return self.arrival - self.departure

    @property
    def feasible(self) -> bool:
        """Whether it may be flown: at the speed, inside the bounds, and clear of areas while they are closed."""
        return not self.violations


def timed_rows(trajectory: Timed) -> FloatArray:
    """
    Return the rows of a timed path, or raise `ProblemError` unless their times increase.

    Examples
    --------
    >>> timed_rows(Trajectory([0, 2], [(0, 0), (1, 0)])).tolist()
    [[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]]
    """
    if isinstance(trajectory, Trajectory):
        return np.column_stack([trajectory.times, trajectory.points])
    rows = number_array("trajectory", trajectory)
    if rows.ndim != 2 or rows.shape[1] != 3 or not len(rows):  # noqa: PLR2004 - rows of time and place
        msg = f"trajectory has shape {rows.shape}; give rows (t, x, y), shape (m, 3) with m >= 1"
        raise ProblemError(msg)
    wrong = np.nonzero(~np.isfinite(rows).all(axis=1))[0]
    if len(wrong):
        msg = f"trajectory holds {rows[wrong[0]].tolist()} at row {wrong[0]}; give finite numbers"
        raise ProblemError(msg)
    late = np.nonzero(np.diff(rows[:, 0]) <= 0.0)[0]
    if len(late):
        before, after = rows[late[0], 0], rows[late[0] + 1, 0]
        msg = f"trajectory goes from time {before:g} to {after:g} at row {late[0] + 1}; let times increase"
        raise ProblemError(msg)
    return rows


def snapped(times: FloatArray, events: FloatArray) -> FloatArray:
    """
    Move times that differ from an event by rounding alone to that event.

    Examples
    --------
    >>> snapped(np.array([0.0, 3.0000000000001, 5.0]), np.array([3.0])).tolist()
    [0.0, 3.0, 5.0]
    """
    if not len(events):
        return times
    after = np.searchsorted(events, times).clip(0, len(events) - 1)
    nearest = np.where(
        np.abs(events[after] - times) < np.abs(events[after - 1] - times), events[after], events[after - 1]
    )
    near = np.abs(nearest - times) <= SNAP * (times - times[0]) + 2.0 * np.spacing(np.abs(times))
    moved = np.where(near, nearest, times)
    return moved if (np.diff(moved) > 0.0).all() else times


def split_at(rows: FloatArray, events: FloatArray) -> tuple[FloatArray, IntArray]:
    """
    Split the legs of a timed path at events.

    Parameters
    ----------
    rows
        ``(t, x, y)``, shape ``(m, 3)``.
    events
        Times, rising.

    Returns
    -------
    rows, legs
        All rows, with those at the events inside of legs, shape ``(n + 1, 3)``, and the leg of each of the ``n`` pieces
        between them.

    Examples
    --------
    >>> rows, legs = split_at(np.array([[0.0, 0.0, 0.0], [4.0, 8.0, 0.0], [5.0, 8.0, 0.0]]), np.array([1.0, 9.0]))
    >>> rows.tolist(), legs.tolist()
    ([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0], [4.0, 8.0, 0.0], [5.0, 8.0, 0.0]], [0, 0, 1])
    """
    if len(rows) == 1:
        return rows, np.empty(0, dtype=np.int64)
    times = rows[:, 0]
    every = np.union1d(times, events[(events > times[0]) & (events < times[-1])])
    legs = np.searchsorted(times, every, side="right") - 1
    legs[-1] -= 1
    first, last = rows[legs], rows[legs + 1]
    share = (every - first[:, 0]) / (last[:, 0] - first[:, 0])
    split = np.column_stack([every, first[:, 1:] + share[:, None] * (last[:, 1:] - first[:, 1:])])
    split[-1] = rows[-1]
    return split, legs[:-1]

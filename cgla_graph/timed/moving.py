"""Threats that move, grow and fade as time goes on."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr, counted, shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import fixed, number_array
from cgla_graph.errors import ProblemError
from cgla_graph.model.risk import Threat

T, X, Y, SPREAD, PEAK = range(5)


@dataclass(frozen=True, init=False)
class MovingThreat(ShortRepr):
    """
    A threat that moves along a track: a `Threat` at each time.

    Between two rows of the track, place, spread and peak change linearly in time. Before the first row and after the
    last one, it stands still.

    Parameters
    ----------
    track
        Rows ``(t, x, y)``, shape ``(n, 3)`` with ``n >= 1``: the time and the centre, map units. Times increase
        strictly. One row: it stands still.
    spread, peak
        As of a `Threat`: one number, or one for each row. Peaks are in (0, 1].

    Raises
    ------
    ProblemError
        If the track is no list of rows, times do not increase, or a number is not allowed.

    Examples
    --------
    >>> storm = MovingThreat([(0, 0.2, 0.5), (10, 0.8, 0.5)], spread=0.1, peak=(0.9, 0.5))
    >>> storm.at(5)
    Threat(x=0.5, y=0.5, spread=0.1, peak=0.7)
    """

    track: tuple[tuple[float, float, float], ...]
    spread: float | tuple[float, ...]
    peak: float | tuple[float, ...]

    def __init__(self, track: ArrayLike, spread: ArrayLike, peak: ArrayLike = 1.0) -> None:
        """Check the rows and store them as plain floats."""
        given = number_array("track", track)
        if given.ndim != 2 or given.shape[1] != 3 or not len(given):  # noqa: PLR2004 - rows of time and place
            msg = f"track has shape {given.shape}; give rows (t, x, y), shape (n, 3) with n >= 1"
            raise ProblemError(msg)
        wrong = np.nonzero(~np.isfinite(given).all(axis=1))[0]
        if len(wrong):
            msg = f"track holds {given[wrong[0]].tolist()} at row {wrong[0]}; give finite numbers"
            raise ProblemError(msg)
        late = np.nonzero(np.diff(given[:, T]) <= 0.0)[0]
        if len(late):
            before, after = given[late[0], T], given[late[0] + 1, T]
            msg = f"track goes from time {before:g} to {after:g} at row {late[0] + 1}; let times increase"
            raise ProblemError(msg)
        object.__setattr__(self, "track", tuple(map(tuple, given.tolist())))
        for name, value in (("spread", spread), ("peak", peak)):
            object.__setattr__(self, name, _for_each_row(name, value, len(given)))
        for t, x, y, wide, high in self.rows.tolist():
            if Threat(x, y, wide, high).peak > 1.0:
                msg = f"peak is {high:g} at time {t:g}; the peak of a moving threat is in (0, 1]"
                raise ProblemError(msg)

    @cached_property
    def rows(self) -> FloatArray:
        """Time, place, spread and peak of each row, shape ``(n, 5)``, read-only."""
        rows = np.empty((len(self.track), 5))
        rows[:, :SPREAD], rows[:, SPREAD], rows[:, PEAK] = self.track, self.spread, self.peak
        return fixed(rows)

    @property
    def times(self) -> FloatArray:
        """The times at which its motion may change, shape ``(n,)``; none if it stands still."""
        return self.rows[:, T] if len(self.track) > 1 else self.rows[:0, T]

    def at(self, time: float) -> Threat:
        """Return the threat at a time."""
        x, y, spread, peak = (float(np.interp(time, self.rows[:, T], self.rows[:, i])) for i in (X, Y, SPREAD, PEAK))
        return Threat(x, y, spread, peak)


def _for_each_row(name: str, value: ArrayLike, count: int) -> float | tuple[float, ...]:
    numbers = number_array(name, value)
    if numbers.shape not in {(), (count,)}:
        msg = f"{name} is {shown(value)}; give a number, or one for each of {counted(count, 'row')} of the track"
        raise ProblemError(msg)
    return float(numbers) if numbers.ndim == 0 else tuple(numbers.tolist())


def motion_in_slab(threats: Sequence[MovingThreat], begins: float) -> FloatArray:
    """
    Return the linear motions of threats from a time until the next row of any track.

    Parameters
    ----------
    threats
        Moving threats.
    begins
        The time; it may be minus infinity, when all stand still.

    Returns
    -------
    motions
        Rows ``x, y, vx, vy, spread, spread rate, peak, peak rate`` at `begins`, shape ``(m, 8)``, read-only.

    Examples
    --------
    >>> storm = MovingThreat([(0, 0.2, 0.5), (10, 0.8, 0.5)], spread=0.1, peak=(0.9, 0.5))
    >>> motion_in_slab([storm], 5).round(3).tolist()
    [[0.5, 0.5, 0.06, 0.0, 0.1, 0.0, 0.7, -0.04]]
    """
    motions = np.zeros((len(threats), 8))
    for motion, threat in zip(motions, threats, strict=True):
        rows = threat.rows
        after = int(np.searchsorted(rows[:, T], begins, side="right"))
        before = rows[max(after - 1, 0)]
        motion[::2] = 0.0
        motion[[0, 1, 4, 6]] = before[X:]
        if 0 < after < len(rows):
            rates = (rows[after, X:] - before[X:]) / (rows[after, T] - before[T])
            motion[[2, 3, 5, 7]] = rates
            motion[[0, 1, 4, 6]] += rates * (begins - before[T])
    return fixed(motions)

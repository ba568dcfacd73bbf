r"""
Tolls: prices of time near a place, by which bounds of teams see that flights keep apart.

**Statement.** Two flights at ``x_1`` and ``x_2`` that keep a distance of `d` pay for ``psi_i = max(1 - (x_i - a)^T M_i
(x_i - a), 0)`` each. If ``M_1^-1 + M_2^-1 <= d^2 I``, the sum of both is at most 1, wherever the centre `a` is: of all
places with ``x_1 - x_2 = y``, the sum of the quadratic forms is least ``y^T (M_1^-1 + M_2^-1)^-1 y``, at least ``|y|^2
/ d^2``. With ``M_i = 2 I / d^2`` this holds for any number of flights: the squared distances from `a` of ``n`` places
sum up to at least ``sum over pairs |x_i - x_j|^2 / n >= (n - 1) d^2 / 2``, and so their ``psi`` to at most ``n - (n -
1)``. The centre may move. With any price ``p(t) >= 0``, the flights pay at most the integral of ``p`` together. A
flight pays from its departure to its arrival alone. Around a flight that is given, ``M_1 = I / d^2`` with its place as
the centre: who keeps apart pays nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cgla_graph._text import ShortRepr
from cgla_graph._types import FloatArray
from cgla_graph._validate import fixed
from cgla_graph.motion.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Toll(ShortRepr):
    """
    A price of a unit of time near a place, for one flight.

    Attributes
    ----------
    centre
        How the centre moves.
    prices
        At the times of `centre`, shape ``(n,)``: they change linearly between them. The first and the last are 0.
    shape
        ``M_xx, M_xy, M_yy``: the flight pays ``p max(1 - r^T M r, 0)`` at ``r`` from the centre.

    Examples
    --------
    >>> toll = Toll(Trajectory([0, 1, 2], [(0.5, 0.5)] * 3), np.array([0.0, 2.0, 0.0]), (4.0, 0.0, 4.0))
    >>> round(toll.most, 9), round(toll.paid(Trajectory([0, 2], [(0.25, 0.5)] * 2)), 9)
    (2.0, 1.5)
    """

    centre: Trajectory
    prices: FloatArray
    shape: tuple[float, float, float]

    @property
    def most(self) -> float:
        """What flights that keep apart pay together, at most: the integral of the price."""
        return float(np.trapezoid(self.prices, self.centre.times)) * (1.0 + 1e-12)

    def paid(self, flight: Trajectory) -> float:
        """
        Return what a flight pays.

        Where it pays, the price is a cubic polynomial of the time, for which Simpson's rule is exact.
        """
        times = self.centre.times
        t = np.unique(np.append(flight.times, np.clip(times, flight.begins, flight.ends)))
        price = np.interp(t, times, self.prices)
        away = (flight.positions(t) - self.centre.positions(t)).T
        by, away = np.diff(away), away[:, :-1]
        # (as a part ``s`` of the way to the next time, the form is ``c + 2 b s + a s^2``)
        (xx, xy, yy) = self.shape
        a, b, c = (
            xx * p[0] * q[0] + xy * (p[0] * q[1] + p[1] * q[0]) + yy * p[1] * q[1]
            for p, q in ((by, by), (by, away), (away, away))
        )
        a = np.maximum(a, 1e-30)
        root = np.sqrt(np.maximum(b * b - a * (c - 1.0), 0.0))
        first, last = np.clip((-b - root) / a, 0.0, 1.0), np.clip((-b + root) / a, 0.0, 1.0)
        total = 0.0
        for share, weight in ((0.0, 1.0), (0.5, 4.0), (1.0, 1.0)):
            s = first + share * (last - first)
            here = (price[:-1] + s * np.diff(price)) * np.maximum(1.0 - (c + 2.0 * b * s + a * s * s), 0.0)
            total += weight / 6.0 * float((here * (last - first) * np.diff(t)).sum())
        return total


def tolls_from(tolls: Sequence[Toll], begins: float) -> FloatArray:
    """
    Return the linear motions of tolls from a time until the next row of any.

    Returns
    -------
    motions
        Rows ``x, y, vx, vy, M_xx, M_xy, M_yy, p`` and the rate of ``p`` at `begins`, shape ``(m, 9)``, read-only.
    """
    motions = np.zeros((len(tolls), 9))
    for motion, toll in zip(motions, tolls, strict=True):
        times, rows = toll.centre.times, np.column_stack([toll.centre.points, toll.prices])
        motion[4:7] = toll.shape
        motion[[0, 1, 7]] = [np.interp(begins, times, column) for column in rows.T]
        after = int(np.searchsorted(times, begins, side="right"))
        if 0 < after < len(times):
            motion[[2, 3, 8]] = np.diff(rows[after - 1 : after + 1], axis=0)[0] / np.diff(times)[after - 1]
    return fixed(motions)

"""Wind that changes from place to place and in time, and how fast an aircraft gets on over the ground in it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr
from cgla_graph._types import Bounds, FloatArray
from cgla_graph._validate import bounds_box, fixed, number_array, point_array
from cgla_graph.errors import ProblemError
from cgla_graph.timed import wind_kernels


@dataclass(frozen=True, init=False, eq=False)
class Wind(ShortRepr):
    """
    Wind on a grid in space and time: bilinear between the nodes, linear from one time to the next.

    Beyond the bounds it is that at the nearest place, before the first time and after the last one that at the nearest
    time.

    Parameters
    ----------
    u, v
        Where the air goes, east and north, at nodes from border to border, map units per unit of time: shape ``(rows,
        columns)``, or ``(times, rows, columns)``. Rows go from south to north, columns from west to east.
    bounds
        ``(x_min, y_min, x_max, y_max)`` of the nodes, map units.
    times
        The times of the grids, increasing, shape ``(times,)``; None: one grid, which holds at all times.

    Raises
    ------
    ProblemError
        If the shapes do not fit each other, a number is not finite, or times do not increase.

    Examples
    --------
    >>> wind = Wind([[[0.0, 2.0]], [[0.0, 4.0]]], np.zeros((2, 1, 2)), (0, 0, 1, 1), times=[0, 10])
    >>> wind.at((0.5, 0.5), 5).tolist()
    [1.5, 0.0]
    """

    u: FloatArray
    v: FloatArray
    bounds: Bounds
    times: FloatArray

    def __init__(self, u: ArrayLike, v: ArrayLike, bounds: Bounds, times: ArrayLike | None = None) -> None:
        """Check the arrays and store read-only copies."""
        east, north = (number_array(name, value).copy() for name, value in (("u", u), ("v", v)))
        when = number_array("times", [0.0] if times is None else times).copy()
        if times is None and east.ndim == 2:  # noqa: PLR2004 - rows and columns
            east, north = east[None], north[None]
        if east.ndim != 3 or 0 in east.shape or east.shape != north.shape or when.shape != east.shape[:1]:  # noqa: PLR2004
            msg = (
                f"u has shape {np.shape(east)}, v {np.shape(north)}, times {when.shape}; give u and v of one shape "
                "(times, rows, columns), or (rows, columns) without times"
            )
            raise ProblemError(msg)
        for name, array in (("u", east), ("v", north), ("times", when)):
            if not np.isfinite(array).all():
                msg = f"{name} holds {array[~np.isfinite(array)][0]}; give finite numbers"
                raise ProblemError(msg)
        if (np.diff(when) <= 0.0).any():
            msg = f"times go from {when[:-1][np.diff(when) <= 0.0][0]:g} back, or stay; let them increase"
            raise ProblemError(msg)
        for name, array in (("u", east), ("v", north), ("times", when)):
            object.__setattr__(self, name, fixed(array))
        object.__setattr__(self, "bounds", bounds_box(bounds))

    @classmethod
    def of(cls, u: float, v: float) -> "Wind":
        """Return the wind that is the same everywhere and always."""
        return cls([[u]], [[v]], (0.0, 0.0, 1.0, 1.0))

    @property
    def is_constant(self) -> bool:
        """Whether it is the same everywhere and always."""
        return bool((self.u == self.u[0, 0, 0]).all() and (self.v == self.v[0, 0, 0]).all())

    @property
    def constant(self) -> tuple[float, float]:
        """The wind at the first node, at first."""
        return float(self.u[0, 0, 0]), float(self.v[0, 0, 0])

    @property
    def mean(self) -> tuple[float, float]:
        """The middle between the least and the greatest components."""
        u, v = (0.5 * float(each.min()) + 0.5 * float(each.max()) for each in (self.u, self.v))
        return u, v

    @property
    def gusts(self) -> float:
        """By how much it differs from the mean anywhere, at most."""
        u, v = self.mean
        return float(np.hypot(self.u - u, self.v - v).max())

    @property
    def reversed(self) -> "Wind":
        """The wind backwards in time: times change their sign, and so does where the air goes."""
        return Wind(-self.u[::-1], -self.v[::-1], self.bounds, -self.times[::-1])

    @property
    def changes(self) -> list[float]:
        """The times at which its change in time changes; none if it is the same at all times."""
        return self.times.tolist() if len(self.times) > 1 else []

    @property
    def arrays(self) -> wind_kernels.WindArrays:
        """The wind as kernels take it."""
        x_min, y_min, x_max, y_max = self.bounds
        _, rows, columns = self.u.shape
        steps = (x_max - x_min) / max(columns - 1, 1), (y_max - y_min) / max(rows - 1, 1)
        return self.u, self.v, self.times, fixed(np.array([x_min, y_min, *steps]))

    def at(self, points: ArrayLike, time: float) -> FloatArray:
        """
        Evaluate the wind at a time.

        Parameters
        ----------
        points
            Shape ``(..., 2)``, map units.
        time
            One time for all points.

        Returns
        -------
        wind
            ``(u, v)``, shape ``(..., 2)``.
        """
        where = point_array("points", points)
        out = np.empty(where.shape)
        wind_kernels.winds_at(fixed(where.reshape(-1, 2)), float(time), self.arrays, out.reshape(-1, 2))
        return out


def ground_speeds(steps: FloatArray, wind: tuple[float, float], speed: float) -> FloatArray:
    """
    Return the speeds over the ground along straight legs in constant wind, with the nose held into the wind.

    Parameters
    ----------
    steps
        From the start of each leg to its end, shape ``(n, 2)``, none of them 0.
    wind
        ``(u, v)``: where the air goes, map units per unit of time.
    speed
        Airspeed.

    Returns
    -------
    speeds
        Shape ``(n,)``: the faster one, if the wind allows two; NaN or negative if the wind is too strong.

    Examples
    --------
    >>> ground_speeds(np.array([[1.0, 0.0], [0.0, 2.0]]), (3.0, 0.0), 5.0).tolist()
    [8.0, 4.0]
    """
    along = steps / np.hypot(*steps.T)[:, None]
    across = along[:, 0] * wind[1] - along[:, 1] * wind[0]
    with np.errstate(invalid="ignore"):
        speeds: FloatArray = along @ np.array(wind) + np.sqrt(speed**2 - across**2)
    return speeds

"""Trajectories of UAVs in space and time, and the closest approach of two of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._types import FloatArray, IntArray, Point
from cgla_graph._validate import finite_number, number_array, point_array, positive_number
from cgla_graph.errors import ProblemError
from cgla_graph.motion import trajectory_kernels
from cgla_graph.motion.trajectory_kernels import NO_DISC, Disc


@dataclass(frozen=True, eq=False)
class Trajectory:
    """
    Piecewise linear motion from a first to a last time.

    It exists from its first time to its last, both included: a UAV that arrives is removed.

    Parameters
    ----------
    times
        Shape ``(m,)`` with ``m >= 1``, ticks, strictly increasing.
    points
        Positions at those times, shape ``(m, 2)``, map units. Between two equal points it waits.

    Raises
    ------
    ProblemError
        If the arrays are malformed, do not fit each other, or the times do not increase.

    Examples
    --------
    >>> motion = Trajectory([0, 4, 5], [(0, 0), (2, 0), (2, 0)])
    >>> motion.at(1), motion.at(4.5), motion.length
    ((0.5, 0.0), (2.0, 0.0), 2.0)
    """

    times: FloatArray
    points: FloatArray

    def __init__(self, times: ArrayLike, points: ArrayLike) -> None:
        """Check both arrays and store read-only copies."""
        when, where = number_array("times", times).copy(), point_array("points", points).copy()
        if when.ndim != 1 or not len(when) or where.shape != (len(when), 2):
            msg = f"times have shape {when.shape}, points {where.shape}; give shapes (m,) and (m, 2) with m >= 1"
            raise ProblemError(msg)
        wrong = np.nonzero(~(np.isfinite(when) & (np.diff(when, prepend=-np.inf) > 0.0)))[0]
        if len(wrong):
            msg = f"times[{wrong[0]}] is {when[wrong[0]]:g}; times must be finite and strictly increase"
            raise ProblemError(msg)
        self._keep(when, where)

    def _keep(self, times: FloatArray, points: FloatArray) -> None:
        for name, array in (("times", times), ("points", points)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def _of(cls, times: FloatArray, points: FloatArray) -> "Trajectory":
        """Make a trajectory of valid new arrays, without copy or check: a mission makes thousands."""
        made = object.__new__(cls)
        made._keep(times, points)
        return made

    @classmethod
    def along(cls, path: ArrayLike, start_time: float, step: float) -> "Trajectory":
        """
        Fly along a polyline at constant speed.

        Parameters
        ----------
        path
            Waypoints, shape ``(m, 2)`` with ``m >= 1``, map units. Parts of no length take no time and are left out.
        start_time
            Start of the flight, ticks.
        step
            Map units flown in a tick, above 0.

        Returns
        -------
        trajectory
            From the first waypoint to the last; a path of one point has one time.

        Raises
        ------
        ProblemError
            If the path is empty or malformed, `start_time` is not finite or `step` not above 0.

        Examples
        --------
        >>> Trajectory.along([(0, 0), (3, 0), (3, 0), (3, 1)], start_time=2, step=0.5).times.tolist()
        [2.0, 8.0, 10.0]
        """
        waypoints = point_array("path", path)
        if waypoints.ndim != 2 or not len(waypoints):  # noqa: PLR2004 - a list of points
            msg = f"path has shape {waypoints.shape}; give at least one waypoint, shape (m, 2)"
            raise ProblemError(msg)
        flown = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(waypoints, axis=0).T))])
        times = finite_number("start_time", start_time) + flown / positive_number("step", step)
        # the last of several waypoints at one time counts, but the first waypoint of all stays
        kept = np.append(np.diff(times) > 0.0, True)
        points = waypoints[kept]
        if len(points) > 1:
            points[0] = waypoints[0]
        return cls(times[kept], points)

    @property
    def begins(self) -> float:
        """The first time, ticks."""
        return float(self.times[0])

    @property
    def ends(self) -> float:
        """The last time, ticks."""
        return float(self.times[-1])

    @property
    def start(self) -> Point:
        """The first point, map units."""
        return float(self.points[0, 0]), float(self.points[0, 1])

    @property
    def goal(self) -> Point:
        """The last point, map units."""
        return float(self.points[-1, 0]), float(self.points[-1, 1])

    @cached_property
    def length(self) -> float:
        """The length flown, map units; waiting adds none."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())

    @property
    def waits(self) -> list[tuple[Point, float]]:
        """The points where it waits, map units, and the durations, ticks, in order of time."""
        durations = np.diff(self.times)
        still = np.nonzero((np.diff(self.points, axis=0) == 0.0).all(axis=1))[0]
        return [((float(self.points[i, 0]), float(self.points[i, 1])), float(durations[i])) for i in still]

    def at(self, time: float) -> Point:
        """
        Return the position at `time`, map units.

        Raises
        ------
        ProblemError
            If `time` is before its first time or after its last.
        """
        if not self.begins <= time <= self.ends:
            msg = f"time {time} is outside the trajectory's; give one from {self.begins:g} to {self.ends:g}"
            raise ProblemError(msg)
        piece = trajectory_kernels.piece_at(self.times, time)
        return trajectory_kernels.position(self.times, self.points, piece, time)

    def positions(self, times: ArrayLike) -> FloatArray:
        """
        Return the positions at `times`, shape ``(n, 2)``; the start before its first time, the goal after its last.

        Examples
        --------
        >>> Trajectory([0, 4], [(0, 0), (2, 0)]).positions([-1, 1, 9]).tolist()
        [[0.0, 0.0], [0.5, 0.0], [2.0, 0.0]]
        """
        when = number_array("times", times)
        return np.column_stack([np.interp(when, self.times, axis) for axis in self.points.T])

    def part(self, first: float, last: float) -> "Trajectory | None":
        """
        Return the motion between `first` and `last`, ticks, as far as it exists; None outside its times.

        Examples
        --------
        >>> part = Trajectory([0, 2, 4], [(0, 0), (2, 0), (2, 2)]).part(1, 9)
        >>> part.times.tolist(), part.points.tolist()
        ([1.0, 2.0, 4.0], [[1.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
        """
        low, high = max(float(first), self.begins), min(float(last), self.ends)
        if not low <= high:
            return None
        if low == high:
            return self._of(np.array([low]), np.array([self.at(low)]))
        inner = (self.times > low) & (self.times < high)
        times = np.concatenate([[low], self.times[inner], [high]])
        return self._of(times, np.vstack([self.at(low), self.points[inner], self.at(high)]))

    def shifted(self, by: float) -> "Trajectory":
        """
        Return the motion delayed by `by` ticks; of waypoints that rounding puts at one time, the last one stays.

        Raises
        ------
        ProblemError
            If `by` is no finite number.

        Examples
        --------
        >>> Trajectory([0, 1], [(0, 0), (1, 0)]).shifted(2).times.tolist()
        [2.0, 3.0]
        """
        return self._at_times(self.times + finite_number("by", by))

    def paced(self, factor: float) -> "Trajectory":
        """
        Return the motion with times multiplied by `factor`, above 0; equal times as in `shifted`.

        Raises
        ------
        ProblemError
            If `factor` is not above 0.

        Examples
        --------
        >>> Trajectory([2, 3], [(0, 0), (1, 0)]).paced(0.5).times.tolist()
        [1.0, 1.5]
        """
        return self._at_times(self.times * positive_number("factor", factor))

    def _at_times(self, times: FloatArray) -> "Trajectory":
        kept = np.append(np.diff(times) > 0.0, True)
        return self._of(times[kept], self.points[kept])


@dataclass(frozen=True)
class Approach:
    """
    The closest approach of two motions.

    Attributes
    ----------
    distance
        The least distance, map units.
    time
        The first time of that distance, ticks.
    where
        The midpoint between the two at that time, map units.
    """

    distance: float
    time: float
    where: Point


def least_distance(a: Trajectory, b: Trajectory, *, outside: tuple[Disc, Disc] | None = None) -> tuple[float, float]:
    """
    Return the least distance of two motions over all times when both exist, and its first time.

    As `closest_approach`, without the place; missions compute it a hundred times for each approach they report.

    Returns
    -------
    distance, time
        Map units and ticks; infinity and NaN if no time counts.

    Examples
    --------
    >>> least_distance(Trajectory([0, 2], [(0, 0), (2, 0)]), Trajectory([0, 2], [(1, 1), (1, 1)]))
    (1.0, 1.0)
    """
    mine, theirs = outside or (NO_DISC, NO_DISC)
    return trajectory_kernels.closest(a.times, a.points, b.times, b.points, mine, theirs)


def least_distances(motions: Sequence[Trajectory], discs: Sequence[Disc], pairs: IntArray) -> FloatArray:
    """
    Return the least distances of many pairs of motions at once, as `least_distance` returns them.

    Parameters
    ----------
    motions, discs
        The motions, and the terminal disc of each.
    pairs
        The numbers of two motions each, shape ``(p, 2)``.

    Returns
    -------
    distances
        Shape ``(p,)``, map units; infinity where no time counts.

    Examples
    --------
    >>> east, still = Trajectory([0, 2], [(0, 0), (2, 0)]), Trajectory([0, 2], [(1, 1), (1, 1)])
    >>> least_distances([east, still], [NO_DISC, NO_DISC], np.array([[0, 1], [1, 1]])).tolist()
    [1.0, 0.0]
    """
    out = np.empty(len(pairs))
    if len(pairs):
        times = np.concatenate([motion.times for motion in motions])
        points = np.vstack([motion.points for motion in motions])
        ends = np.cumsum([0, *(len(motion.times) for motion in motions)])
        round_goals = np.array([(*disc.centre, disc.radius) for disc in discs])
        trajectory_kernels.closest_of_pairs(times, points, ends, round_goals, pairs, out)
    return out


def closest_approach(a: Trajectory, b: Trajectory, *, outside: tuple[Disc, Disc] | None = None) -> Approach | None:
    """
    Return the least distance of two motions over all times, not only whole ticks, when both exist.

    While neither passes a waypoint, their difference moves along a straight segment, whose point nearest to the origin
    has a closed form.

    Parameters
    ----------
    a, b
        The two motions.
    outside
        The terminal discs of `a` and of `b`: times when **both** are in their own disc do not count, so that two UAVs
        with one goal may gather there. The distance of an arriving UAV to one that passes by still counts.

    Returns
    -------
    approach
        The first of the least distances; None if no time counts. The distance at the beginning and at the end of the
        exempt time counts as well, as the limit of distances that count.

    Examples
    --------
    >>> east = Trajectory([0, 10], [(0, 0), (10, 0)])
    >>> north = Trajectory([0, 10], [(5, -7), (5, 3)])
    >>> closest_approach(east, north)
    Approach(distance=1.4142, time=6.0, where=(5.5, -0.5))
    >>> closest_approach(east, Trajectory([11, 20], [(5, 0), (5, 0)])) is None
    True
    """
    distance, time = least_distance(a, b, outside=outside)
    if math.isinf(distance):
        return None
    (ax, ay), (bx, by) = a.at(time), b.at(time)
    return Approach(distance, time, (0.5 * (ax + bx), 0.5 * (ay + by)))

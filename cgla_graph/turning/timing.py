"""The flight time of a curve at constant airspeed in a constant wind."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ellipeinc

from cgla_graph._text import ShortRepr
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import non_negative_number, point, positive_number
from cgla_graph.errors import ProblemError
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.curve_kernels import N_COLUMNS, RADIUS, TURN, X0, X1, Y0, Y1


@dataclass(frozen=True)
class Timing(ShortRepr):
    """
    Flight time of a curve, with ground speeds and energy.

    Attributes
    ----------
    seconds
        Time from start to goal.
    slowest, fastest
        Least and greatest ground speed on the way, map units a second.
    energy
        Watt-hours; NaN without a power.
    still_air_radius
        Radius of the turns, map units, that the aircraft must be able to fly in still air to stay on the curve in the
        wind: infinite without arcs. At a fixed bank, a turn with the wind behind is wider over ground.
    """

    seconds: float
    slowest: float
    fastest: float
    energy: float = math.nan
    still_air_radius: float = math.inf


def timed(curve: Curve, airspeed: float, *, wind: Point = (0.0, 0.0), power: float | None = None) -> Timing:
    r"""
    Return the flight time of a curve at constant airspeed, with a heading that corrects for the wind.

    Where the curve has the direction ``u``, a unit vector, the ground speed is ``g = w . u + sqrt(v^2 - (w x u)^2)``.
    As ``1 / g = (sqrt(v^2 - (w x u)^2) - w . u) / (v^2 - |w|^2)``, the time over a line is elementary and that over an
    arc an elliptic integral of the second kind: both are exact.

    Parameters
    ----------
    curve
        The curve.
    airspeed
        ``v``, map units a second (m/s on a map in longitude and latitude), above 0.
    wind
        ``w``, the velocity of the air, ``(x, y)`` or east and north, map units a second; slower than the airspeed.
    power
        Power of the aircraft at that airspeed, watts; None: no energy.

    Raises
    ------
    ProblemError
        If a number is out of range, or the wind is as fast as the aircraft.

    Examples
    --------
    A return flight takes longer in any wind.

    >>> there = Curve(np.array([[0, 0, 100, 0, 0, 0, 0, 0]]))
    >>> back = Curve(np.array([[100, 0, 0, 0, 0, 0, 0, 0]]))
    >>> [timed(way, 10, wind=(6, 0)).seconds for way in (there, back)]
    [6.25, 25.0]
    >>> timed(there, 10, power=180).energy
    0.5
    """
    speed = positive_number("airspeed", airspeed)
    east, north = point("wind", wind)
    blows = math.hypot(east, north)
    if blows >= speed:
        msg = (
            f"the wind is {blows:.6g} fast, the airspeed {speed:g}: against it the aircraft stands still or is blown "
            "back; give a greater airspeed, or wait for less wind"
        )
        raise ProblemError(msg)
    watts = math.nan if power is None else non_negative_number("power", power)
    rows = curve.pieces
    if not len(rows):
        return Timing(0.0, speed, speed, 0.0 * watts)
    # angles are measured from the wind's direction
    along = math.atan2(north, east)
    begin = curve.headings(np.arange(len(rows)), np.zeros(len(rows))) - along
    arc = rows[:, RADIUS] > 0.0
    end = begin + np.where(arc, rows[:, TURN], 0.0)
    ratio = (blows / speed) ** 2
    elliptic = (ellipeinc(end, ratio) - ellipeinc(begin, ratio)) * rows[:, RADIUS] * np.sign(rows[:, TURN])
    straight = curve.lengths * np.sqrt(1.0 - ratio * np.sin(begin) ** 2)
    drift = east * (rows[:, X1] - rows[:, X0]) + north * (rows[:, Y1] - rows[:, Y0])
    seconds = (speed * np.where(arc, elliptic, straight) - drift) / (speed**2 - blows**2)
    total = float(seconds.sum())
    slowest, fastest = _speeds(begin, end, speed, blows)
    tightest = min(
        (
            radius / _widening(_speeds(one, other, speed, blows)[1], speed, blows)
            for radius, one, other in zip(rows[arc, RADIUS], begin[arc, None], end[arc, None], strict=True)
        ),
        default=math.inf,
    )
    return Timing(total, slowest, fastest, watts * total / 3600.0, float(tightest))


def radius_over_ground(turn_radius: float, airspeed: float, wind: Point) -> float:
    """
    Return the greatest radius over ground of turns at the bank that gives `turn_radius` in still air.

    With the wind behind, the ground speed is the greatest, and the radius grows with its square: paths with this turn
    radius can be flown in the wind in all directions.

    Parameters
    ----------
    turn_radius
        Radius in still air, map units, above 0.
    airspeed, wind
        As of `timed`.

    Raises
    ------
    ProblemError
        As `timed` raises it.

    Examples
    --------
    >>> round(radius_over_ground(60, 18, (8, 0)), 1)
    125.2
    """
    timed(Curve(), airspeed, wind=wind)
    return positive_number("turn_radius", turn_radius) * (1.0 + math.hypot(*wind) / airspeed) ** 2


def _widening(ground_speed: float, speed: float, blows: float) -> float:
    """
    Return the ratio of the radius of a turn over ground to that in still air, at the same bank.

    The bank accelerates the aircraft across its heading ``h``. With the ground velocity ``g u = v h + w``, the
    curvature is ``a (v + w . h) / g^3`` and that in still air ``a / v^2``; ``w . h = (g^2 - v^2 - |w|^2) / 2 v``.
    """
    ahead = (ground_speed**2 - speed**2 - blows**2) / (2.0 * speed)
    return ground_speed**3 / (speed**2 * (speed + ahead))


def _speeds(begin: FloatArray, end: FloatArray, speed: float, blows: float) -> tuple[float, float]:
    """Return the least and the greatest ground speed; it falls with the angle to the wind, up to a half turn."""
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    angles = np.concatenate([low, high])
    with_wind = bool((np.ceil(low / (2.0 * math.pi)) <= high / (2.0 * math.pi)).any())
    against = bool((np.ceil((low - math.pi) / (2.0 * math.pi)) <= (high - math.pi) / (2.0 * math.pi)).any())
    speeds = blows * np.cos(angles) + np.sqrt(speed**2 - (blows * np.sin(angles)) ** 2)
    slowest = speed - blows if against else float(speeds.min())
    return slowest, speed + blows if with_wind else float(speeds.max())


def ground_speeds(steps: FloatArray, airspeed: float, wind: Point = (0.0, 0.0)) -> FloatArray:
    """
    Return the ground speeds along straight steps, by the wind triangle; 0 where the wind does not allow the step.

    Parameters
    ----------
    steps
        Steps east and north (x and y), map units, shape ``(n, 2)``.
    airspeed, wind
        As of `timed`; here the wind may be as fast as the aircraft, which then flies some ways only.

    Returns
    -------
    speeds
        Map units a second, shape ``(n,)``: ``g = w . u + sqrt(v^2 - (w x u)^2)`` along the unit vector ``u`` of a step;
        the airspeed for a step of length 0.

    Raises
    ------
    ProblemError
        If the airspeed is not above 0, or the wind is no pair of numbers.

    Examples
    --------
    >>> ways = np.array([(100.0, 0.0), (-100.0, 0.0), (0.0, 100.0)])
    >>> ground_speeds(ways, 10, wind=(6, 0)).tolist(), ground_speeds(ways, 10, wind=(26, 0)).tolist()
    ([16.0, 4.0, 8.0], [36.0, 0.0, 0.0])
    """
    speed = positive_number("airspeed", airspeed)
    east, north = point("wind", wind)
    lengths = np.hypot(*steps.T)
    long = np.where(lengths > 0.0, lengths, 1.0)
    across = (east * steps[:, 1] - north * steps[:, 0]) / long
    ahead = (steps @ np.array([east, north])) / long
    # (a square root of below 0: the wind across the step is faster than the aircraft)
    square = speed**2 - across**2
    speeds = np.maximum(ahead + np.sqrt(np.maximum(square, 0.0)), 0.0)
    return np.where(lengths > 0.0, np.where(square > 0.0, speeds, 0.0), speed)


def times_along(points: FloatArray, airspeed: float, wind: Point = (0.0, 0.0)) -> FloatArray:
    """
    Return the times at which the waypoints of a polyline are reached, ``(m,)``, seconds (errors as `timed`).

    Examples
    --------
    >>> times_along(np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 0.0]]), 10, wind=(6, 0)).tolist()
    [0.0, 6.25, 31.25]
    """
    timed(Curve(np.zeros((0, N_COLUMNS))), airspeed, wind=wind)
    steps = np.diff(points, axis=0)
    seconds = np.hypot(*steps.T) / ground_speeds(steps, airspeed, wind)
    return np.concatenate([[0.0], np.cumsum(seconds)])

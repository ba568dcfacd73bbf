"""Longitudes and latitudes along the axes of a map whose units are metres, its scale and its north."""

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph.model.earth import FARTHEST, LocalProjection, geodesic_length

Ticks: TypeAlias = list[tuple[float, str]]

#: Latitude from which on there is no north, and a step towards north, degrees.
POLE, NEAR = 89.99, 0.001
#: Digits of a label, at most; steps between labels, times a power of ten; and labels of an axis, about.
DIGITS, STEPS, LABELS = 6, (1.0, 2.0, 2.5, 5.0, 10.0), 6


def degree_text(value: float, letters: str, step: float) -> str:
    """
    Write a longitude or latitude with as many digits as steps of `step` need.

    Examples
    --------
    >>> degree_text(24.5, "EW", 0.5), degree_text(-60.0, "NS", 1.0), degree_text(180.0, "EW", 1.0)
    ('24.5° E', '60° S', '180°')
    """
    value = (value + 180.0) % 360.0 - 180.0 if letters == "EW" else value
    digits = next((n for n in range(DIGITS) if math.isclose(step * 10**n, round(step * 10**n), abs_tol=1e-6)), DIGITS)
    number = f"{abs(value):.{digits}f}"
    # (the antimeridian is neither east nor west)
    is_neither = float(number) == 0.0 or (letters == "EW" and float(number) == 180.0)  # noqa: PLR2004
    return f"{number}°" if is_neither else f"{number}° {letters[value < 0.0]}"


def degree_ticks(projection: LocalProjection, bounds: Bounds) -> tuple[Ticks, Ticks]:
    """
    Return places and labels of longitudes along the lower edge of a map, and of latitudes along its left edge.

    Parameters
    ----------
    projection
        The projection of the map.
    bounds
        The edges of the map, metres.

    Returns
    -------
    x, y
        Places, metres, and their labels.

    Raises
    ------
    ProblemError
        If a corner is farther away than any place of the Earth.

    Examples
    --------
    >>> x, y = degree_ticks(LocalProjection(24.5, 60.0), (-50_000.0, -50_000.0, 50_000.0, 50_000.0))
    >>> [label for _, label in x], round(y[1][0])
    (['24.0° E', '24.5° E', '25.0° E'], -21946)
    """
    x_min, y_min, x_max, y_max = bounds
    found: list[Ticks] = []
    for side, letters in enumerate(("EW", "NS")):
        low, high = ((x_min, x_max), (y_min, y_max))[side]
        along = np.linspace(low, high, 129)
        edge = np.column_stack([along, np.full(129, y_min)] if side == 0 else [np.full(129, x_min), along])
        degrees = projection.inverse(edge)[:, side]
        if side == 0:
            # across the antimeridian, longitudes go on beyond 180
            degrees = projection.longitude + (degrees - projection.longitude + 180.0) % 360.0 - 180.0
        first, last = float(degrees.min()), float(degrees.max())
        rough = max((last - first) / LABELS, 10.0**-DIGITS)
        unit = 10.0 ** math.floor(math.log10(rough))
        step = unit * next(one for one in STEPS if one * unit >= rough * (1.0 - 1e-9))
        values = step * np.arange(math.ceil(first / step), math.floor(last / step) + 1)
        ticks = [
            (at, degree_text(one, letters, step)) for one in values.tolist() for at in _places(one, degrees, along)
        ]
        found.append(sorted(ticks))
    return found[0], found[1]


def _places(value: float, degrees: FloatArray, along: FloatArray) -> list[float]:
    """Return where a side has a value: near a pole more than once."""
    away = degrees - value
    here, there = away[:-1], away[1:]
    # (a step of half the Earth is the antimeridian's)
    meets = (here * there < 0.0) & (np.abs(here - there) < 180.0)  # noqa: PLR2004
    share = here[meets] / (here - there)[meets]
    crossed = along[:-1][meets] + share * np.diff(along)[meets]
    places: list[float] = np.concatenate([crossed, along[away == 0.0]]).tolist()
    return places


class Compass(NamedTuple):
    """
    Scale and north in the middle of a map.

    Attributes
    ----------
    metres
        Metres on the Earth per metre of the map, from left to right.
    spread
        How much that differs over the map, at most, relative to the middle.
    north
        Direction of north, degrees clockwise from the upper side; None at a pole.
    turn
        How much that differs over the map, at most, degrees.
    """

    metres: float
    spread: float
    north: float | None
    turn: float


def compass(projection: LocalProjection, bounds: Bounds) -> Compass:
    """
    Return scale and north in the middle of a map in degrees, and how much both differ elsewhere.

    Parameters
    ----------
    projection
        The projection of the map.
    bounds
        The edges of the map, metres.

    Examples
    --------
    >>> found = compass(LocalProjection(24.5, 60.0), (0.0, -50_000.0, 100_000.0, 50_000.0))
    >>> f"{found.metres:.5f} {found.spread:.0e} {found.north:.2f} {found.turn:.2f}"
    '1.00000 1e-05 -0.78 0.80'
    """
    low, high = np.reshape(np.array(bounds), (2, 2))
    step = 1e-4 * float((high - low).max())
    shares = np.array([(0.5, 0.5), *((x, y) for x in (0.0, 0.5, 1.0) for y in (0.0, 0.5, 1.0))])
    points = low + shares * (high - low)
    # (corners of a map of the whole Earth are no places of it)
    points = points[np.hypot(*points.T) <= FARTHEST - 2.0 * step]
    if not len(points):
        return Compass(1.0, 0.0, None, 0.0)
    scales, norths = [], []
    for x, y in points.tolist():
        left, right, here = projection.inverse([(x - step, y), (x + step, y), (x, y)]).tolist()
        scales.append(geodesic_length((left[0], left[1]), (right[0], right[1])) / (2.0 * step))
        norths.append(_north(projection, (x, y), (here[0], here[1])))
    known = [one for one in norths if one is not None]
    apart = [] if norths[0] is None else [abs((one - norths[0] + 180.0) % 360.0 - 180.0) for one in known]
    spread = max(abs(one / scales[0] - 1.0) for one in scales)
    return Compass(scales[0], spread, norths[0], max(apart, default=0.0))


def _north(projection: LocalProjection, point: Point, place: Point) -> float | None:
    """Return the direction of north at a point, degrees clockwise from the upper side; None at a pole."""
    longitude, latitude = place
    if abs(latitude) > POLE:
        return None
    east, north = (projection.forward((longitude, latitude + NEAR)) - np.array(point)).tolist()
    return math.degrees(math.atan2(east, north))

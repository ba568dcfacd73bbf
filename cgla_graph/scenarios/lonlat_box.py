"""Boxes in longitude and latitude: the bounds of a map in degrees, and the points inside them."""

from collections.abc import Iterable, Sequence

import numpy as np

from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph._validate import four_numbers
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import geodesic_length, wrapped

#: Starts and goals widen a map that has no bounds of its own by this much at most, metres.
NEAR = 100_000.0
#: Margin of a box around points on each side, relative to the box of the points.
MARGIN = 0.05
#: Rounding error of a turn of 360 degrees, degrees: 0.1 millimetres.
ROUNDING = 1e-9


def box_of(bounds: Sequence[float]) -> Bounds:
    """
    Check bounds in degrees; across the antimeridian, the east bound becomes greater than 180.

    Parameters
    ----------
    bounds
        West, south, east, north, degrees. West greater than east means a box across the antimeridian (RFC 7946, section
        5.2).

    Returns
    -------
    box
        West less than east.

    Raises
    ------
    ProblemError
        If a bound is no number or out of range, or the box has no inside.

    Examples
    --------
    >>> box_of((178, -20, -178, -16))
    (178.0, -20.0, 182.0, -16.0)
    """
    west, south, east, north = four_numbers("bounds", bounds)
    for corner in ((west, south), (east, north)):
        _require_place("a corner of the bounds", corner, "give bounds as west, south, east, north")
    if west == east or south >= north:
        msg = f"bounds {(west, south, east, north)} are empty; south < north and west != east must hold"
        raise ProblemError(msg)
    return west, south, east + 360.0 * (east < west), north


def bounds_of(box: Bounds) -> Bounds:
    """
    Return bounds in -180 to 180 degrees, west greater than east across the antimeridian: the inverse of `box_of`.

    Examples
    --------
    >>> bounds_of((178.0, -20.0, 182.0, -16.0))
    (178.0, -20.0, -178.0, -16.0)
    """
    west, east = wrapped(np.array([box[0], box[2]])).tolist()
    return west, box[1], east, box[3]


def box_around(points: FloatArray) -> Bounds:
    """
    Return a box around points with a margin of 5 % on each side; it crosses the antimeridian where that is narrower.

    Parameters
    ----------
    points
        Longitudes and latitudes, degrees, shape ``(n, 2)``.

    Returns
    -------
    box
        West, south, east, north, degrees.

    Examples
    --------
    >>> box_around(np.array([[24.0, 60.0], [25.0, 60.5]]))
    (23.95, 59.975, 25.05, 60.525)
    >>> box_around(np.array([[179.0, 0.0], [-179.0, 1.0]]))
    (178.9, -0.05, 181.1, 1.05)
    """
    around = points.copy()
    around[:, 0] %= 360.0
    if np.ptp(around[:, 0]) < np.ptp(points[:, 0]):
        points = around
    (west, south), (east, north) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    margin_x, margin_y = MARGIN * (east - west), MARGIN * (north - south)
    least, most = (0.0, 360.0) if east > 180.0 else (-180.0, 180.0)  # noqa: PLR2004 - degrees
    return (
        max(west - margin_x, least),
        max(south - margin_y, -90.0),
        min(east + margin_x, most),
        min(north + margin_y, 90.0),
    )


def require_inside(name: str, place: Point, box: Bounds) -> None:
    """
    Check that a start or goal is inside the given bounds of a map.

    Raises
    ------
    ProblemError
        If it is outside; the message gives the distance, and asks for the longitude first if that would help.

    Examples
    --------
    >>> require_inside("start", (24.9, 60.2), (24.0, 60.0, 25.0, 61.0))
    """
    swapped = _swapped(place, box)
    _require_place(name, place, swapped)
    if not contains(box, place):
        msg = (
            f"{name} {place} is outside the bounds {_shown(box)}, by {_kilometres(distance_to(box, place))}; "
            f"{swapped or 'move it, or widen the bounds'}"
        )
        raise ProblemError(msg)


def widened(box: Bounds, ends: Iterable[tuple[str, Point]]) -> Bounds:
    """
    Widen a box around areas, so that starts and goals near it are inside.

    Parameters
    ----------
    box
        The result of `box_around`.
    ends
        Names and positions of starts and goals, degrees.

    Returns
    -------
    box
        With the ends inside or on its border.

    Raises
    ------
    ProblemError
        If one of them is farther from the box than `NEAR`, or would be inside with latitude and longitude swapped: the
        message gives the distance, and asks for the longitude first if that would help.

    Examples
    --------
    >>> widened((24.0, 60.0, 25.0, 61.0), [("start", (24.5, 60.5)), ("goal", (25.5, 61.5))])
    (24.0, 60.0, 25.5, 61.5)
    """
    west, south, east, north = box
    for name, place in ends:
        swapped = _swapped(place, box)
        _require_place(name, place, swapped)
        if contains(box, place):
            continue
        distance = distance_to(box, place)
        if swapped or distance > NEAR:
            remedy = "move it, or ask for a wider map: bounds in a TOML file, --bounds on the command line"
            msg = f"{name} {place} is {_kilometres(distance)} from the map {_shown(box)}; {swapped or remedy}"
            raise ProblemError(msg)
        longitude = _nearest_turn(box, place)
        west, east = min(west, longitude), max(east, longitude)
        south, north = min(south, place[1]), max(north, place[1])
    turn = 360.0 * (west < -180.0)  # noqa: PLR2004 - degrees
    return west + turn, south, east + turn, north


def require_unswapped(name: str, place: Point, box: Bounds, reach: float) -> None:
    """
    Check that latitude and longitude of a threat are not swapped.

    Parameters
    ----------
    name, place
        Name and position of the threat, degrees.
    box
        The map.
    reach
        The distance to which its risk counts, metres.

    Raises
    ------
    ProblemError
        If it does not reach the map, but would be on it with latitude and longitude swapped.

    Examples
    --------
    >>> require_unswapped("threat", (24.9, 60.2), (24.0, 60.0, 25.0, 61.0), 1e3)
    """
    swapped = _swapped(place, box)
    _require_place(name, place, swapped)
    if swapped and (distance := distance_to(box, place)) > reach:
        msg = f"{name} {place} is {_kilometres(distance)} from the map {_shown(box)}; {swapped}"
        raise ProblemError(msg)


def contains(box: Bounds, place: Point) -> bool:
    """
    Return whether a point is inside a box or on its border; longitudes may differ by 360 degrees.

    Examples
    --------
    >>> contains((178.0, -20.0, 182.0, -16.0), (-179.0, -18.0))
    True
    """
    west, south, east, north = box
    return south - ROUNDING <= place[1] <= north + ROUNDING and any(
        west - ROUNDING <= longitude <= east + ROUNDING for longitude in _turns(place)
    )


def distance_to(box: Bounds, place: Point) -> float:
    """
    Return the distance from a point to the nearest point of a box at its own longitude or latitude, metres.

    Examples
    --------
    >>> round(distance_to((24.0, 60.0, 25.0, 61.0), (24.5, 59.0)) / 1e3)
    111
    """
    west, south, east, north = box
    latitude = min(max(place[1], south), north)
    nearest = wrapped(np.array([min(max(longitude, west), east) for longitude in _turns(place)])).tolist()
    return min(geodesic_length(place, (longitude, latitude)) for longitude in nearest)


def _turns(place: Point) -> tuple[float, float, float]:
    return place[0], place[0] + 360.0, place[0] - 360.0


def _nearest_turn(box: Bounds, place: Point) -> float:
    """Return the longitude of a point at the turn that is nearest to the box."""
    west, _, east, _ = box
    return min(_turns(place), key=lambda longitude: max(west - longitude, longitude - east))


def _swapped(place: Point, box: Bounds) -> str:
    """Ask for the longitude first if a point is off the map, and on it with swapped coordinates; else return ""."""
    other = place[1], place[0]
    if not _is_place(other) or contains(box, place):
        return ""
    if contains(box, other):
        return f"longitude first? {other} is on the map"
    # a point that is far away, and near the map when swapped, was swapped as well
    if (not _is_place(place) or distance_to(box, place) > NEAR) and distance_to(box, other) <= NEAR:
        return f"longitude first? {other} is {_kilometres(distance_to(box, other))} from the map"
    return ""


def _is_place(place: Point) -> bool:
    """Return whether longitude and latitude are in range."""
    return abs(place[0]) <= 180.0 and abs(place[1]) <= 90.0  # noqa: PLR2004 - degrees


def _require_place(name: str, place: Point, remedy: str) -> None:
    """Raise a `ProblemError` unless a point is a place on the Earth."""
    if not _is_place(place):
        msg = (
            f"{name} {place} is no place on the Earth: longitude must be in [-180, 180] and latitude in [-90, 90]; "
            f"{remedy or 'give degrees, longitude first'}"
        )
        raise ProblemError(msg)


def _kilometres(metres: float) -> str:
    return f"{metres / 1e3:,.0f} km" if metres >= 1e4 else f"{metres / 1e3:.2g} km"  # noqa: PLR2004 - two digits


def _shown(box: Bounds) -> str:
    """Format a box to about a metre, as (west, south, east, north)."""
    return str(tuple(round(side, 5) for side in bounds_of(box)))

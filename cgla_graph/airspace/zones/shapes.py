"""Shapes of zones in degrees: rings, polygons around circles, and areas across the antimeridian."""

import math
from collections.abc import Sequence
from itertools import chain
from typing import Any, TypeAlias

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.earth import geodesic_lengths, geodesic_points
from cgla_graph.untrusted.files import fault

AreaShape: TypeAlias = Polygon | MultiPolygon

SHORTEST_RING = 4
#: Least number of corners of the polygon around a circle, and its circumradius divided by the radius.
CORNERS, BEYOND = 72, 1.001
#: Greatest radius of a circle, metres, and corners of its polygon, at most.
WIDEST, MOST_CORNERS = 500_000.0, 5000
#: First tolerance of simplifying outlines, metres, and reach of the result beyond the outline divided by the tolerance.
LEAST_TOLERANCE, WIDENED = 0.5, 3.0
#: Points per edge at which the polygon around a circle is checked, and their least distance divided by the radius.
#: Between these points, an edge of a polygon of 72 corners comes nearer by at most 15 millionths of the radius.
CHECKED, INSIDE = 8, 1.00002


def ring_of(value: object, where: str, *, closed: bool = True) -> FloatArray:
    """
    Return the corners of a ring as they are written, the last one equal to the first, degrees, shape ``(n, 2)``.

    Parameters
    ----------
    value
        Lists of longitude, latitude and possibly height, which is dropped.
    where
        Name of the ring in errors.
    closed
        Whether the last corner must equal the first.

    Raises
    ------
    FileFormatError
        If it is not a list of positions, has fewer than 3 corners, is open, or a coordinate is out of range.

    Examples
    --------
    >>> ring_of([[6, 49, 120], [7, 49], [7, 50], [6, 49]], "a ring").tolist()
    [[6.0, 49.0], [7.0, 49.0], [7.0, 50.0], [6.0, 49.0]]
    """
    points = _positions(value, where)
    if not closed and len(points) and (points[0] != points[-1]).any():
        points = np.concatenate([points, points[:1]])
    if len(points) < SHORTEST_RING:
        fault(where, f"it has {len(points)} positions", f"give at least {SHORTEST_RING}, the last equal to the first")
    if (points[0] != points[-1]).any():
        wrong = f"it is open: it begins at {points[0].tolist()} and ends at {points[-1].tolist()}"
        fault(where, wrong, "repeat the first position at the end")
    return points


def _positions(value: object, where: str) -> FloatArray:
    """Return longitudes and latitudes of a list of positions, all in range."""
    if not isinstance(value, list) or not value:
        fault(where, f"it is {short(value)}", "give a list of positions [longitude, latitude]")
    points = positions_of(value)
    if points is None:
        for index, position in enumerate(value):
            _require_position(position, f"{where}[{index}]")
        fault(where, f"it is {short(value)}", "give a list of positions [longitude, latitude]")
    return points


def positions_of(value: list[Any]) -> FloatArray | None:
    """
    Return a list of positions, possibly millions, as an array; None if any of them is not valid.

    Examples
    --------
    >>> positions_of([[24, 60.5, 120], [25, 60]])
    array([[24. , 60.5], [25. , 60. ]])
    >>> positions_of([[24, "60"]]), positions_of([[241, 60]])
    (None, None)
    """
    if set(map(type, value)) != {list} or min(map(len, value)) < 2:  # noqa: PLR2004 - longitude and latitude
        return None
    if len(set(map(len, value))) > 1:
        value = [position[:2] for position in value]
    if not set(map(type, chain.from_iterable(value))) <= {int, float}:
        return None
    try:
        points = np.array(value, dtype=np.float64)[:, :2]
    except OverflowError:
        return None
    return np.ascontiguousarray(points) if bool((np.abs(points) <= (180.0, 90.0)).all()) else None


def _require_position(position: object, where: str) -> None:
    """Check that a position has a longitude and a latitude in range."""
    if not isinstance(position, list) or len(position) < 2:  # noqa: PLR2004 - longitude and latitude
        fault(where, f"it is {short(position)}", "give [longitude, latitude]")
    for word, number, most in zip(("longitude", "latitude"), position, (180, 90), strict=False):
        if type(number) not in {int, float} or not -most <= number <= most:
            fault(where, f"its {word} is {short(number)}", f"give degrees in [-{most}, {most}], longitude first")


def unwrapped(points: FloatArray, where: str) -> FloatArray:
    """
    Continue longitudes beyond 180 degrees if a ring crosses the antimeridian: each edge takes the shorter direction.

    Raises
    ------
    FileFormatError
        If an edge spans exactly 180 degrees, or the ring goes around a pole.

    Examples
    --------
    >>> unwrapped(np.array([[-179.0, 0.0], [179.0, 0.0], [179.0, 1.0], [-179.0, 0.0]]), "a ring")[:, 0].tolist()
    [181.0, 179.0, 179.0, 181.0]
    """
    steps = np.diff(points[:, 0])
    if bool((np.abs(steps) < 180.0).all()):  # noqa: PLR2004 - degrees
        return points
    if bool((np.abs(steps) == 180.0).any()):  # noqa: PLR2004
        index = int(np.argmax(np.abs(steps) == 180.0))  # noqa: PLR2004
        remedy = "add corners, so that its direction is clear"
        fault(f"{where}[{index}]", "an edge spans 180 degrees of longitude", remedy)
    turns = np.concatenate([[0.0], -360.0 * np.cumsum(np.sign(steps) * (np.abs(steps) > 180.0))])  # noqa: PLR2004
    if turns[-1] != 0.0:
        fault(where, "it goes around a pole", "cut it along a meridian")
    turned = points.copy()
    turned[:, 0] += turns
    # east of 180 degrees rather than west of -180
    turned[:, 0] += 360.0 * (turned[:, 0].min() < -180.0)  # noqa: PLR2004
    return turned


def joined(areas: Sequence[AreaShape]) -> AreaShape:
    """
    Return the union of areas; areas that were cut along the antimeridian are joined.

    Examples
    --------
    >>> cut = [shapely.box(179, 0, 180, 1), shapely.box(-180, 0, -179, 1)]
    >>> joined(cut).bounds
    (179.0, 0.0, 181.0, 1.0)
    """
    if len(areas) == 1:
        return areas[0]
    if are_split(areas):
        areas = [shifted(area, 360.0) if area.bounds[0] < 0.0 else area for area in areas]
    union = shapely.union_all(areas)
    return union if isinstance(union, Polygon | MultiPolygon) else areas[0]


def are_split(areas: Sequence[AreaShape]) -> bool:
    """
    Return whether areas are parts of one area across the antimeridian, on both sides of it.

    Examples
    --------
    >>> east, west = shapely.box(179, 0, 180, 1), shapely.box(-180, 0, -179, 1)
    >>> are_split([east, west]), are_split([west])
    (True, False)
    """
    least, most = min(area.bounds[0] for area in areas), max(area.bounds[2] for area in areas)
    return least < 0.0 and (most > 180.0 or (least == -180.0 and most == 180.0))  # noqa: PLR2004 - degrees


def shifted(area: AreaShape, degrees: float) -> AreaShape:
    """
    Return an area shifted in longitude.

    Examples
    --------
    >>> shifted(shapely.box(-180, 0, -179, 1), 360.0).bounds
    (180.0, 0.0, 181.0, 1.0)
    """
    return shapely.transform(area, lambda points: np.column_stack([points[:, 0] + degrees, points[:, 1]]))


def circle_of(centre: object, radius: object, where: str, keys: tuple[str, str]) -> Polygon:
    """
    Return a polygon around all points whose geodesic distance from a centre is at most a radius.

    Its edges, straight in longitude and latitude, are outside the circle by up to 0.1 % of the radius.

    Parameters
    ----------
    centre
        A list of longitude and latitude, degrees.
    radius
        Metres, above 0, at most 500 km.
    where
        Name of the circle in errors.
    keys
        Names of centre and radius in errors.

    Raises
    ------
    FileFormatError
        If either is not valid, or the circle is too near to a pole.

    Examples
    --------
    >>> circle = circle_of([25.0, 60.0], 1000.0, "a zone", ("center", "radius"))
    >>> bounds = circle.bounds
    >>> len(circle.exterior.coords), round((bounds[3] - bounds[1]) * 111_420)
    (73, 2002)
    """
    _require_position(centre, f"{where}: {keys[0]}")
    longitude, latitude = centre[:2]  # type: ignore[index]
    if type(radius) not in {int, float} or not 0.0 < radius <= WIDEST:  # type: ignore[operator]
        wrong = f"it is {short(radius)}"
        fault(f"{where}: {keys[1]}", wrong, f"give metres, above 0 and at most {WIDEST:g}")
    metres = float(radius)  # type: ignore[arg-type]
    place = (float(longitude), float(latitude))
    corners = CORNERS
    while corners <= MOST_CORNERS:
        azimuths = np.linspace(360.0, 0.0, corners + 1)
        azimuths[-1] = azimuths[0]
        ring = geodesic_points(place, azimuths, metres * BEYOND)
        ring[-1] = ring[0]
        ring = unwrapped(ring, f"{where}: the circle")
        parts = np.arange(CHECKED)[:, None, None] / CHECKED
        along = (ring[:-1] + parts * np.diff(ring, axis=0)).reshape(-1, 2)
        if geodesic_lengths(place, along).min() >= metres * INSIDE:
            return Polygon(ring)
        corners *= 2
    return fault(where, "its circle is too near to a pole", "give a polygon")


def part_near(area: AreaShape, box: Bounds) -> AreaShape | None:
    """
    Return the part of an area in a box, with longitudes shifted to the box; None if there is none.

    Parameters
    ----------
    area
        The area, degrees.
    box
        West, south, east, north, degrees; west less than east, which may be beyond 180 degrees.

    Examples
    --------
    >>> part_near(shapely.box(-180, 0, -170, 1), (178.0, -1.0, 182.0, 2.0)).bounds
    (180.0, 0.0, 182.0, 1.0)
    >>> part_near(shapely.box(0, 0, 1, 1), (178.0, -1.0, 182.0, 2.0))
    """
    found: list[AreaShape] = []
    west, south, east, north = area.bounds
    if box[0] <= west and east <= box[2] and box[1] <= south and north <= box[3]:
        return area
    for turn in (-360.0, 0.0, 360.0):
        if west + turn > box[2] or east + turn < box[0] or south > box[3] or north < box[1]:
            continue
        here = shifted(area, turn) if turn else area
        inside = box[0] <= west + turn and east + turn <= box[2] and box[1] <= south and north <= box[3]
        # (cutting an area with millions of corners may make it invalid by a rounding, so areas inside are not cut)
        cut: BaseGeometry = here if inside else shapely.intersection(here, shapely.box(*box))
        found += [part for part in shapely.get_parts(cut).tolist() if isinstance(part, Polygon) and part.area > 0.0]
    return joined(found) if found else None


def with_fewer_corners(area: AreaShape, most: int, reach: float) -> tuple[AreaShape, float]:
    """
    Return an area with fewer corners around another: it may grow, but never shrinks.

    The outline is simplified (Douglas and Peucker) with tolerances that double until it has few corners, and then
    widened by their sum, so that the result contains the given area.

    Parameters
    ----------
    area
        The area, map units.
    most
        Wanted number of corners.
    reach
        Distance that the result may reach beyond the area, map units.

    Returns
    -------
    area, beyond
        The area, and the greatest distance that it reaches beyond, map units; 0 if it is unchanged.

    Examples
    --------
    >>> circle = shapely.Point(0, 0).buffer(1000.0, quad_segs=5000)
    >>> fewer, beyond = with_fewer_corners(circle, 100, 50.0)
    >>> len(fewer.exterior.coords) <= 100, fewer.contains(circle), beyond
    (True, True, 10.5)
    """
    simple, tolerance, off = area, LEAST_TOLERANCE, 0.0
    while shapely.get_num_coordinates(simple) > most and WIDENED * (off + tolerance) <= reach:
        simple = shapely.simplify(simple, tolerance)
        off += tolerance
        tolerance *= 2.0
    around = _around(area, simple, off)
    return around, 0.0 if around is area else WIDENED * off


def _around(area: AreaShape, simple: AreaShape, off: float) -> AreaShape:
    """
    Return an area with fewer corners around another, or the area itself if there is none.

    An outline stays within the tolerance of its simplified outline; so after several steps, the parts that the
    simplified area lost are within the sum of all tolerances.
    """
    if simple is area:
        return area
    grown = shapely.buffer(simple, 1.01 * off, join_style="mitre", mitre_limit=1.5)
    shapely.prepare(grown)
    fewer = shapely.get_num_coordinates(grown) < shapely.get_num_coordinates(area)
    return grown if fewer and grown.is_valid and grown.contains(area) else area


def short(value: object) -> str:
    """
    Describe an invalid value in a few words.

    Examples
    --------
    >>> short([[1, 2]] * 1000), short("x" * 1000)[-6:], short(None)
    ('a list of 1000', "xxxx…'", 'null')
    """
    if isinstance(value, list | dict) and len(value) > 4:  # noqa: PLR2004 - short enough to read
        return f"{'a list' if isinstance(value, list) else 'an object'} of {len(value)}"
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "an object"
    if value is None or isinstance(value, bool):
        return str(value).lower().replace("none", "null")
    if isinstance(value, float) and not math.isfinite(value):
        return "a number that is not finite"
    try:
        text = " ".join(repr(value).split())
    except ValueError:
        # (raised for integers of more than 4300 digits)
        return "a number of thousands of digits"
    return text if len(text) <= 60 else f"{text[:58]}…{text[-1]}"  # noqa: PLR2004 - one line

"""Areas around a flight on the map and on the Earth: never narrower than asked for, and hardly wider."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import DIGITS, POLAR_RADIUS, LocalProjection, geodesic_curves

#: Corners of a quarter of a circle; a polygon around the circle is wider by 1/3300.
ROUND: Final = 32
#: By how much areas on the Earth are wider, because their edges are straight in longitude and latitude, metres.
EDGE: Final = 0.05
#: Longest edge, and farthest latitude of an area in degrees.
_LONGEST, _FARTHEST_LATITUDE = 5_000.0, 85.0
#: Grid of the corners of areas on the map, metres.
_GRID: Final = 1e-3
#: A geodesic this near to the straight leg counts as it, metres: `EDGE` is more than edges in degrees need.
_SAME: Final = 0.1 * EDGE
#: Legs on the Earth are followed along the geodesic at so many points.
_POINTS: Final = 9


def flown_lines(routes: Sequence[FloatArray], projection: LocalProjection | None) -> BaseGeometry:
    """
    Return the lines of a flight on the map: its legs, straight on the map and along the geodesics of the Earth.

    Parameters
    ----------
    routes
        Places that are flown to in order, shape ``(m, 2)`` with ``m >= 1``, map units.
    projection
        Projection of the map; None in the plane.

    Examples
    --------
    >>> flown_lines([np.array([(0.0, 0.0), (3.0, 4.0)])], None).length
    5.0
    """
    parts: list[BaseGeometry] = []
    for places in routes:
        route = places[np.concatenate([[True], (np.diff(places, axis=0) != 0.0).any(axis=1)])]
        parts.append(shapely.LineString(route) if len(route) > 1 else shapely.Point(route[0]))
        if projection is not None and len(route) > 1:
            shares = np.linspace(0, 1, _POINTS)
            curves = geodesic_curves(route[:-1], route[1:], projection, shares)
            straight = route[:-1, None] + shares[:, None] * (route[1:] - route[:-1])[:, None]
            # (buffers of two lines that all but coincide take seconds)
            apart = np.hypot(*(curves - straight).transpose(2, 0, 1)).max(axis=1) > _SAME
            parts += [shapely.LineString(curve) for curve in curves[apart]]
    return shapely.union_all(parts) if len(parts) > 1 else parts[0]


def around(lines: BaseGeometry, distance: float, projection: LocalProjection | None) -> BaseGeometry:
    """
    Return an area that contains every place within a distance of some lines.

    On the Earth, it is wider by the stretch of the map (`LocalProjection.stretch`) and by 5 cm.

    Parameters
    ----------
    lines
        On the map.
    distance
        Metres on the Earth, or map units in the plane; above 0.
    projection
        Projection of the map; None in the plane.

    Examples
    --------
    >>> round(around(shapely.Point(0, 0), 100.0, None).area / 100.0**2, 4)
    3.1422
    """
    reach = distance / math.cos(math.pi / (4.0 * ROUND))
    if projection is not None:
        far = float(np.hypot(*shapely.get_coordinates(lines).T).max())
        stretch = projection.stretch(far + 2.0 * distance)
        if not math.isfinite(stretch):
            away = f"{(far + distance) / 1e3:.4g} km from the middle of its map"
            msg = f"the volumes reach {away}, too far for a flat map; check the numbers, or cut the flight into parts"
            raise ProblemError(msg)
        reach = reach * stretch + EDGE
    return lines.buffer(reach, quad_segs=ROUND)


def in_degrees(
    area: BaseGeometry, projection: LocalProjection, *, within: float = 0.8 * EDGE
) -> Polygon | MultiPolygon:
    """
    Return an area of the map in longitude and latitude; longitudes go on beyond 180 degrees.

    Straight edges of the map bend; corners are added until they are within a distance.

    Parameters
    ----------
    area
        On the map.
    projection
        Projection of the map.
    within
        The distance, metres.

    Raises
    ------
    ProblemError
        If it reaches beyond 85 degrees of latitude, where edges straight in degrees mean little.

    Examples
    --------
    >>> area = around(shapely.Point(0, 0), 1000.0, LocalProjection(25.0, 60.0))
    >>> [round(side, 4) for side in in_degrees(area, LocalProjection(25.0, 60.0)).bounds]
    [24.9821, 59.991, 25.0179, 60.009]
    """
    corners = shapely.get_coordinates(area)
    latitude = float(np.abs(projection.inverse(corners)[:, 1]).max())
    if latitude > _FARTHEST_LATITUDE:
        msg = f"an area reaches to {latitude:.4g} degrees of latitude; volumes are written up to {_FARTHEST_LATITUDE:g}"
        raise ProblemError(msg)
    # an edge of the map bends away from the geodesic by less than its distance from the origin says
    bend = (math.tan(math.radians(latitude)) + float(np.hypot(*corners.T).max()) / POLAR_RADIUS) / POLAR_RADIUS
    longest = min(math.sqrt(8.0 * within / bend), _LONGEST)

    def degrees(metres: FloatArray) -> FloatArray:
        found = projection.inverse(metres)
        found[:, 0] += 360.0 * np.round((projection.longitude - found[:, 0]) / 360.0)
        return np.round(found, DIGITS)

    turned = shapely.transform(shapely.segmentize(_tidied(area), longest), degrees)
    parts = [part for part in shapely.get_parts(shapely.make_valid(turned)).tolist() if isinstance(part, Polygon)]
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def _tidied(area: BaseGeometry) -> BaseGeometry:
    """Return an area without holes narrower than 20 cm, on a grid of a millimetre: roundings keep it valid."""
    parts = []
    for part in shapely.get_parts(area).tolist():
        holes = [ring for ring in part.interiors if not Polygon(ring).buffer(-2.0 * EDGE).is_empty]
        parts.append(Polygon(part.exterior, holes))
    return shapely.set_precision(shapely.union_all(parts), _GRID)


def cut_at_antimeridian(area: Polygon | MultiPolygon) -> list[Polygon]:
    """
    Return the polygons of an area in degrees, with all longitudes from -180 to 180 (RFC 7946, section 3.1.9).

    Examples
    --------
    >>> [part.bounds for part in cut_at_antimeridian(shapely.box(179, 0, 181, 1))]
    [(-180.0, 0.0, -179.0, 1.0), (179.0, 0.0, 180.0, 1.0)]
    """
    found: list[Polygon] = []
    for turn in (-360.0, 0.0, 360.0):
        shifted = shapely.transform(area, partial(np.add, (turn, 0.0)))
        west, _, east, _ = shifted.bounds
        if west > 180.0 or east < -180.0:  # noqa: PLR2004 - degrees
            continue
        whole = west >= -180.0 and east <= 180.0  # noqa: PLR2004
        here = shifted if whole else shapely.intersection(shifted, shapely.box(-180.0, -90.0, 180.0, 90.0))
        found += [part for part in shapely.get_parts(here).tolist() if isinstance(part, Polygon) and part.area > 0.0]
    return found


def inner_outlines(
    area: BaseGeometry, within: float, projection: LocalProjection
) -> tuple[list[FloatArray], list[FloatArray]]:
    """
    Return outlines with few corners, none of them outside of an area, degrees: of its parts, and of its holes.

    Parameters
    ----------
    area
        On the map.
    within
        The outlines are inside of the area by at most four times this, metres.
    projection
        Projection of the map.

    Returns
    -------
    parts, holes
        Corners of each, shape ``(n, 2)``, without the first one again at the end.

    Examples
    --------
    >>> disc = around(shapely.Point(0, 0), 100.0, LocalProjection(25.0, 60.0))
    >>> parts, holes = inner_outlines(disc, 1.0, LocalProjection(25.0, 60.0))
    >>> len(parts), len(parts[0]) < 40, holes
    (1, True, [])
    """
    inner = shapely.simplify(shapely.buffer(area, -2.0 * within, quad_segs=ROUND), within)
    parts, holes = [], []
    for part in cut_at_antimeridian(in_degrees(inner, projection, within=within)):
        parts.append(np.asarray(part.exterior.coords)[:-1])
        holes += [np.asarray(ring.coords)[:-1] for ring in part.interiors]
    return parts, holes

"""Maps of the Earth: the projection from degrees to metres, its distortion, and geodesics."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Self, TypeVar

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import at_most_percent
from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph._validate import four_numbers, point_array
from cgla_graph.errors import ProblemError
from cgla_graph.model.clearance import joined_with, stretches
from cgla_graph.model.no_fly import polygons_of

if TYPE_CHECKING:
    import pyproj

#: Straight edges in longitude and latitude bend when projected; points this close keep them within a metre.
EDGE_DEGREES = 0.05
EDGE_METRES = 1.0

#: Digits of degrees in output: a tenth of a millimetre.
DIGITS = 9

#: The longitudes of an area across the antimeridian go on beyond 180 degrees, up to this.
MOST_LONGITUDE = 540.0

GeometryT = TypeVar("GeometryT", bound=BaseGeometry)

# Half a meridian of WGS84 (20 003 931.46 m), rounded up: no two points of the Earth are farther apart.
FARTHEST = 20_003_932.0
# From the centre of WGS84 to a pole, metres; one over its square is the greatest curvature, that at the equator.
POLAR_RADIUS = 6_356_752.314245
# Least length of a degree of latitude, metres; and a latitude beyond which a box contains all meridians.
LEAST_DEGREE, NEAR_POLE = 110_500.0, 85.0
# Bound of the error of geodesics' lengths and end points, metres (they are off by 15 nanometres).
GEODESIC_ERROR = 1e-6
# Radians; below this, a series of two terms is exact to the last digit.
SMALL_ANGLE = 1e-3


@dataclass(frozen=True)
class LocalProjection:
    """
    The azimuthal equidistant projection of WGS84 around an origin.

    Distances and directions from the origin are exact, and so is the scale along every line through it.
    Across such lines the map is stretched: by at most 0.0042 % at 100 km from the origin (4 m in 100 km)
    and 0.038 % at 300 km, at every latitude (it grows with the square of the distance; see `stretch`).

    Parameters
    ----------
    longitude
        Longitude of the origin, degrees east, in [-180, 180].
    latitude
        Latitude of the origin, degrees north, in [-90, 90].

    Raises
    ------
    ProblemError
        If a coordinate of the origin is no number, not finite or out of range.

    Examples
    --------
    A degree of latitude is longer near the pole than at the equator, because the Earth is flattened:

    >>> north = LocalProjection(longitude=25.0, latitude=60.0).forward([25.0, 61.0])
    >>> equator = LocalProjection(longitude=25.0, latitude=0.0).forward([25.0, 1.0])
    >>> round(float(north[1])), round(float(equator[1]))
    (111421, 110574)
    """

    longitude: float
    latitude: float

    def __post_init__(self) -> None:
        """Check the origin and keep it as plain floats."""
        origin = _degrees((self.longitude, self.latitude), "origin")
        if origin.shape != (2,):
            message = (
                f"the origin of a projection is one longitude and one latitude, "
                f"got an array of shape {origin.shape}: pass two numbers"
            )
            raise ProblemError(message)
        object.__setattr__(self, "longitude", float(origin[0]))
        object.__setattr__(self, "latitude", float(origin[1]))

    @classmethod
    def centred_on(cls, lonlat_bounds: Bounds) -> Self:
        """
        Return the projection whose origin is the middle of some bounds.

        Parameters
        ----------
        lonlat_bounds
            West, south, east, north, degrees: what ``shapely.total_bounds`` gives. West greater than east
            means a box across the antimeridian (RFC 7946, section 5.2).

        Raises
        ------
        ProblemError
            If a bound is not finite or out of range, or south is greater than north.

        Examples
        --------
        >>> LocalProjection.centred_on((20.0, 59.0, 30.0, 61.0))
        LocalProjection(longitude=25.0, latitude=60.0)
        >>> LocalProjection.centred_on((178.0, -20.0, -178.0, -16.0))
        LocalProjection(longitude=180.0, latitude=-18.0)
        """
        if len(lonlat_bounds) != 4:  # noqa: PLR2004 - four sides
            message = (
                f"bounds are (west, south, east, north), got {len(lonlat_bounds)} numbers: pass four numbers, degrees"
            )
            raise ProblemError(message)
        corners = _degrees((lonlat_bounds[:2], lonlat_bounds[2:]), "bounds")
        (west, south), (east, north) = corners.tolist()
        if south > north:
            message = (
                f"bounds have south {south!r} greater than north {north!r}: "
                f"give them as (west, south, east, north), degrees"
            )
            raise ProblemError(message)
        middle = 0.5 * (west + east + (360.0 if west > east else 0.0))
        return cls(
            longitude=middle - 360.0 if middle > 180.0 else middle,  # noqa: PLR2004
            latitude=0.5 * (south + north),
        )

    @classmethod
    def between(cls, start: Point, goal: Point) -> Self:
        """
        Return the projection whose origin is halfway between two points, on the geodesic that joins them.

        That geodesic is straight on the plane, and as long as on the Earth.

        Parameters
        ----------
        start, goal
            Longitude and latitude of each, degrees.

        Raises
        ------
        ProblemError
            If a coordinate is no number, not finite or out of range.

        Examples
        --------
        >>> middle = LocalProjection.between((24.0, 60.0), (26.0, 60.0))
        >>> round(middle.longitude, 6), round(middle.latitude, 4)
        (25.0, 60.0038)
        """
        (west, south), (east, north) = _degrees((start, goal), "the ends").tolist()
        azimuth, _, distance = _geod().inv(west, south, east, north)
        longitude, latitude, _ = _geod().fwd(west, south, azimuth, 0.5 * distance)
        return cls(longitude=longitude, latitude=latitude)

    def stretch(self, distance: float) -> float:
        """
        Bound the ratio of a line's length on the plane to its length on the Earth.

        On the Earth, ``distance = r`` from the origin, a step across the line from the origin is ``m(r) / r`` times as
        long as on the plane, where ``m`` is the reduced length of geodesics: ``m'' = -K m``, ``m(0) = 0``,
        ``m'(0) = 1``, with the Gaussian curvature ``K`` of the ellipsoid. A step along that line is as long as on the
        plane. On WGS84, ``0 < K <= 1 / b^2`` with the polar radius ``b`` (equality holds at the equator), so that by
        Sturm's comparison ``b sin(r / b) <= m(r) <= r`` as long as ``r < pi b``. The scale is thus between 1 and
        ``(r / b) / sin(r / b)``, which grows with ``r``, at every latitude and in every direction.

        Parameters
        ----------
        distance
            Greatest distance of the line from the origin, metres.

        Returns
        -------
        stretch
            At least 1; infinite where there is no bound, near the point opposite to the origin and beyond it.

        Examples
        --------
        >>> projection = LocalProjection(25.0, 60.0)
        >>> [f"{projection.stretch(metres) - 1.0:.2e}" for metres in (0.0, 1e5, 3e5)]
        ['0.00e+00', '4.12e-05', '3.71e-04']
        """
        scale = float(self.scale(np.array(distance)))
        return 1.0 / scale if scale > 0.0 else math.inf

    def scale(self, distance: FloatArray) -> FloatArray:
        """
        Bound the ratio of a line's length on the Earth to its length on the plane from below: one over `stretch`.

        Parameters
        ----------
        distance
            Greatest distance of the line from the origin, metres, any shape.

        Returns
        -------
        scale
            Between 0 and 1, the same shape.

        Examples
        --------
        >>> LocalProjection(25.0, 60.0).scale(np.array([0.0, 1e5, 2.5e6])).round(5).tolist()
        [1.0, 0.99996, 0.97442]
        """
        # (numpy's sinc is of pi times its argument)
        return np.asarray(
            np.where(distance < math.pi * POLAR_RADIUS, np.sinc(distance / (math.pi * POLAR_RADIUS)), 0.0)
        )

    def scale_gradient(self, metres: FloatArray) -> FloatArray:
        """Return the gradient of `scale` at points, per metre, shapes ``(n, 2)``."""
        away = np.hypot(*metres.T)
        angle = away / POLAR_RADIUS
        small = angle < SMALL_ANGLE
        safe = np.where(small, 1.0, angle)
        # (cos x - sin x / x) / x^2, whose difference is only rounding at small angles
        slope = np.where(small, angle**2 / 30.0 - 1.0 / 3.0, (np.cos(safe) - np.sin(safe) / safe) / safe**2)
        return np.asarray(metres * (slope / POLAR_RADIUS**2)[:, None])

    def least_length(self, start: Point, goal: Point) -> float:
        """
        Return the length of the geodesic between two points given in metres: no line on the Earth is shorter.

        Examples
        --------
        >>> round(LocalProjection(25.0, 60.0).least_length((-1e6, 1e6), (1e6, 1e6)))
        1991770
        """
        ends = (tuple(end) for end in self.inverse((start, goal)).tolist())
        return max(0.0, geodesic_length(*ends) - GEODESIC_ERROR)

    def bound_on_earth(self, bound: float, start: Point, goal: Point, bounds: Bounds) -> float:
        """
        Turn a lower bound of the cost of every path on the plane into one of every path on the Earth.

        If a line stays within ``r`` of the origin, its length on the Earth and the integral of a risk along it are at
        least ``1 / stretch(r)`` times those on the plane. A path that goes farther is at least as long as the way from
        the start out to ``r`` and back to the goal, as distances from the origin are exact; with ``r = (bound + |start|
        + |goal|) / 2`` this length is the bound itself. No path goes farther out than the corners of the bounds, and no
        path is shorter than the geodesic that joins its ends.

        Parameters
        ----------
        bound
            Bound of ``length + k * risk``, metres, with a risk of at least 0; values that are not finite are returned.
        start, goal
            The ends, metres.
        bounds
            No path leaves these, metres.

        Returns
        -------
        bound
            Metres on the Earth.

        Examples
        --------
        >>> around = LocalProjection.between((24.94, 60.17), (23.76, 61.5))
        >>> start, goal = around.forward([(24.94, 60.17), (23.76, 61.5)]).tolist()
        >>> straight = math.dist(start, goal)
        >>> bounds = (-2e5, -2e5, 2e5, 2e5)
        >>> [round(around.bound_on_earth(length, start, goal, bounds), 3) for length in (straight, 1.1 * straight)]
        [161490.12, 177618.066]
        """
        if not math.isfinite(bound) or bound <= 0.0:
            return bound
        x_min, y_min, x_max, y_max = bounds
        corner = math.hypot(max(-x_min, x_max), max(-y_min, y_max))
        reach = 0.5 * (bound + math.hypot(*start) + math.hypot(*goal))
        lowered = max(0.0, bound / self.stretch(min(reach, corner)) - GEODESIC_ERROR)
        return max(lowered, self.least_length(start, goal))

    def note(self, paths: Iterable[FloatArray]) -> str:
        """Return a note of how much lengths on this plane exceed those on the Earth; see `distortion_note`."""
        stretch = max((self.stretch(float(np.hypot(*path.T).max(initial=0.0))) for path in paths), default=1.0)
        much = at_most_percent(stretch - 1.0)
        return f"lengths exceed those on the Earth by at most {much}; lower bounds allow for that"

    def forward(self, lonlat: ArrayLike) -> FloatArray:
        """
        Return the metres of points given in degrees.

        Parameters
        ----------
        lonlat
            Longitude in [-180, 180] and latitude in [-90, 90] of every point, shape (..., 2), degrees.

        Returns
        -------
        metres
            East and north of the origin, shape (..., 2).

        Raises
        ------
        ProblemError
            If the last axis is not 2 long, or a coordinate is no number, not finite or out of range.

        Examples
        --------
        >>> LocalProjection(25.0, 60.0).forward([[25.0, 60.0], [26.0, 60.0]]).round(1)
        array([[    0. ,     0. ],
               [55797.9,   421.7]])
        """
        points = _degrees(lonlat, "lonlat")
        flat = points.reshape(-1, 2)
        origin = np.broadcast_to((self.longitude, self.latitude), flat.shape)
        azimuth, _, distance = _geod().inv(origin[:, 0], origin[:, 1], flat[:, 0], flat[:, 1])
        angle = np.radians(azimuth)
        east_north = np.stack([distance * np.sin(angle), distance * np.cos(angle)], axis=-1)
        return east_north.reshape(points.shape)

    def inverse(self, metres: ArrayLike) -> FloatArray:
        """
        Return the degrees of points given in metres: the inverse of `forward`.

        Parameters
        ----------
        metres
            Metres east and north of the origin, shape (..., 2).

        Returns
        -------
        lonlat
            Longitude in [-180, 180] and latitude in [-90, 90], shape (..., 2), degrees.

        Raises
        ------
        ProblemError
            If the last axis is not 2 long, a coordinate is no number or not finite, or a point is farther
            from the origin than half of a meridian (20 003 932 m).

        Examples
        --------
        >>> projection = LocalProjection(25.0, 60.0)
        >>> projection.inverse(projection.forward([24.5, 60.25]))
        array([24.5 , 60.25])
        """
        points = point_array("metres", metres)
        flat = points.reshape(-1, 2)
        distance = np.hypot(flat[:, 0], flat[:, 1])
        if np.any(distance > FARTHEST):
            message = (
                f"metres holds {flat[np.argmax(distance)].tolist()}; no place on the Earth is farther than "
                f"{FARTHEST:.0f} metres: pass metres that come from forward()"
            )
            raise ProblemError(message)
        origin = np.broadcast_to((self.longitude, self.latitude), flat.shape)
        azimuth = np.degrees(np.arctan2(flat[:, 0], flat[:, 1]))
        longitude, latitude, _ = _geod().fwd(origin[:, 0], origin[:, 1], azimuth, distance)
        return np.stack([longitude, latitude], axis=-1).reshape(points.shape)


def project_area(area: GeometryT, projection: LocalProjection) -> GeometryT:
    """
    Project a lon/lat polygon to metres, its straight edges included.

    Parameters
    ----------
    area
        Longitudes may go on beyond 180 degrees, so that an area across the antimeridian is in one piece.
    projection
        The projection.

    Returns
    -------
    area
        In metres.

    Raises
    ------
    ProblemError
        As `require_area` raises it.

    Examples
    --------
    >>> box = shapely.box(24, 60, 25, 61)
    >>> round(project_area(box, LocalProjection.centred_on(box.bounds)).area / 1e9, 1)
    6.1
    """

    def metres(degrees: FloatArray) -> FloatArray:
        return projection.forward(np.column_stack([wrapped(degrees[:, 0]), degrees[:, 1]]))

    require_area(area)
    return shapely.transform(shapely.segmentize(area, EDGE_DEGREES), metres)


def project_on_map(area: BaseGeometry, box: Bounds, projection: LocalProjection) -> BaseGeometry:
    """
    Project a lon/lat polygon to metres; where it closes the border of a map, it goes on beyond the map's bounds.

    The sides of the map bend when projected, and its bounds are a box around them: an area that ends on a side would
    leave a passage.

    Parameters
    ----------
    area
        As `project_area` takes it.
    box
        The bounds of the map, degrees.
    projection
        The projection.

    Raises
    ------
    ProblemError
        As `project_area`.

    Examples
    --------
    >>> box = (24.0, 60.0, 25.0, 61.0)
    >>> projection = LocalProjection.centred_on(box)
    >>> wall = project_on_map(shapely.box(24.4, 60.5, 24.5, 61.0), box, projection)
    >>> wall.bounds[3] > projected_bounds(box, projection)[3]
    True
    """
    require_area(area)
    meets = _sides_met(area, box)
    if not meets:
        return project_area(area, projection)
    west, _, east, _ = box
    reach = _beyond(box, projection)
    boxes = [closing for one in meets for closing in stretches(area, one, reach=reach)]
    wide = min(reach, max(0.5 * (360.0 - east + west), 0.0))
    room = shapely.union_all([shapely.box(one[0] - wide, -90.0, one[2] + wide, 90.0) for one in meets])
    closings = [one for one in shapely.get_parts(shapely.union_all(boxes) & room) if isinstance(one, Polygon)]
    return project_area(joined_with(area, closings), projection)


def is_closed_by_border(area: BaseGeometry, closed: BaseGeometry, lonlat: Point, place: Point) -> bool:
    """
    Return whether a place is closed only because an area meets the border of its map there.

    Parameters
    ----------
    area, closed
        The area, degrees; and what `project_on_map` makes of it, metres.
    lonlat, place
        The place, degrees and metres.

    Examples
    --------
    >>> box, area = (24.0, 60.0, 25.0, 61.0), shapely.box(24.4, 60.5, 24.6, 61.0)
    >>> around = LocalProjection.centred_on(box)
    >>> closed = project_on_map(area, box, around)
    >>> places = [(24.5, 61.0), (24.5, 60.9), (24.3, 61.0)]
    >>> [is_closed_by_border(area, closed, place, tuple(around.forward(place))) for place in places]
    [True, False, False]
    """
    turned = [shapely.Point(lonlat[0] + turn, lonlat[1]) for turn in (0.0, 360.0, -360.0)]
    parts, given = shapely.get_parts(closed), shapely.get_parts(area)
    is_closed = bool(shapely.contains_properly(parts, shapely.Point(place)).any())
    return is_closed and not any(shapely.contains_properly(given, point).any() for point in turned)


def _sides_met(area: BaseGeometry, box: Bounds) -> list[Bounds]:
    """Return a map's bounds, degrees, turned to where an area meets its border."""
    west, south, east, north = box
    turned = [(west + turn, south, east + turn, north) for turn in (0.0, 360.0, -360.0)]
    return [one for one in turned if stretches(area, one)]


def _beyond(box: Bounds, projection: LocalProjection) -> float:
    """Return how far the bounds of a map in metres reach beyond its bounds in degrees, and a little more, degrees."""
    rim = shapely.get_coordinates(shapely.box(*projected_bounds(box, projection)).exterior.segmentize(1e5))
    far = np.hypot(*rim.T)
    degrees = projection.inverse(rim * np.minimum(1.0, FARTHEST / np.maximum(far, 1.0))[:, None])
    degrees[:, 0] += 360.0 * np.round((0.5 * (box[0] + box[2]) - degrees[:, 0]) / 360.0)
    over = np.concatenate([np.subtract(box[:2], degrees), np.subtract(degrees, box[2:])])
    return 1.1 * float(over.max(initial=0.0)) + EDGE_DEGREES


def require_area(area: BaseGeometry) -> None:
    """
    Check an area in degrees, before it is projected, so that errors are in degrees.

    Raises
    ------
    ProblemError
        If a coordinate is not finite or out of range, or it is no polygon, or an invalid one.

    Examples
    --------
    >>> require_area(shapely.box(179, 60, 181, 61))
    """
    for polygon in polygons_of(area):
        require_degrees("the area", shapely.get_coordinates(polygon))


def require_degrees(name: str, corners: FloatArray) -> None:
    """
    Check the corners of an area in degrees: longitudes may go on across the antimeridian, but not beyond 540.

    Parameters
    ----------
    name
        The name of the area in the message.
    corners
        Longitude and latitude of each, shape ``(n, 2)``.

    Raises
    ------
    ProblemError
        If a coordinate is not finite or out of range.

    Examples
    --------
    >>> require_degrees("a zone", np.array([[179.0, 60.0], [181.0, 60.0], [180.0, 61.0]]))
    """
    wrong = ~(np.abs(corners) <= (MOST_LONGITUDE, 90.0)).all(axis=1)
    if wrong.any():
        msg = (
            f"{name} has a corner at {tuple(corners[wrong][0].tolist())}; longitude must be in [-180, 180] (across the "
            f"antimeridian, up to {MOST_LONGITUDE:g}) and latitude in [-90, 90]: give degrees, longitude first"
        )
        raise ProblemError(msg)


def places_around(place: Point, distance: float) -> FloatArray:
    """
    Return the points at a distance east, north, west and south of a point, degrees, shape ``(4, 2)``.

    Parameters
    ----------
    place
        Longitude and latitude, degrees.
    distance
        Metres; a quarter of the way around the Earth at most.

    Examples
    --------
    >>> places_around((25.0, 60.0), 55_800.0).round(2).tolist()
    [[26.0, 60.0], [25.0, 60.5], [24.0, 60.0], [25.0, 59.5]]
    """
    return geodesic_points(place, np.array([90.0, 0.0, -90.0, 180.0]), min(distance, 0.5 * FARTHEST))


def box_around(place: Point, distance: float) -> Bounds:
    """
    Return a box in degrees, west, south, east, north, that contains all places within a distance of a place, metres.

    Examples
    --------
    >>> [round(side, 3) for side in box_around((25.0, 60.0), 55_250.0)]
    [23.985, 59.5, 26.015, 60.5]
    """
    x, y = place
    high = distance / LEAST_DEGREE
    if abs(y) + high >= NEAR_POLE:
        return x - 180.0, -90.0, x + 180.0, 90.0
    wide = min(180.0, high / math.cos(math.radians(abs(y) + high)))
    return x - wide, y - high, x + wide, y + high


def geodesic_length(start: Point, goal: Point) -> float:
    """
    Return the length of the shortest line on WGS84 between two points given in degrees, metres.

    Examples
    --------
    >>> round(geodesic_length((24.94, 60.17), (23.76, 61.50)), 3)
    161490.12
    """
    return float(_geod().inv(*start, *goal)[2])


def geodesic_between(starts: FloatArray, ends: FloatArray, share: float) -> FloatArray:
    """
    Return the points at a share of the way along geodesics on WGS84, degrees, shape ``(n, 2)``.

    Parameters
    ----------
    starts, ends
        Their ends, degrees, shape ``(n, 2)`` each.
    share
        0 for the starts, 1 for the ends.

    Examples
    --------
    >>> geodesic_between(np.array([[24.0, 60.0]]), np.array([[26.0, 60.0]]), 0.5).round(4).tolist()
    [[25.0, 60.0038]]
    """
    azimuth, _, distance = _geod().inv(starts[:, 0], starts[:, 1], ends[:, 0], ends[:, 1])
    longitude, latitude, _ = _geod().fwd(starts[:, 0], starts[:, 1], azimuth, share * distance)
    return np.column_stack([longitude, latitude])


def geodesic_curves(
    starts: FloatArray, ends: FloatArray, projection: LocalProjection, shares: FloatArray
) -> FloatArray:
    """
    Return points of the geodesics between the ends of legs, map units, shape ``(n, k, 2)``.

    Parameters
    ----------
    starts, ends
        Ends of the legs, map units, shape ``(n, 2)`` each.
    projection
        Projection of the map.
    shares
        Where on each, shape ``(k,)``: 0 for the starts, 1 for the ends.

    Examples
    --------
    >>> west, east = np.array([[-50_000.0, 0.0]]), np.array([[50_000.0, 0.0]])
    >>> geodesic_curves(west, east, LocalProjection(25.0, 60.0), np.array([0.5])).round(3).tolist()
    [[[0.0, 0.0]]]
    """
    first, last = projection.inverse(starts), projection.inverse(ends)
    return np.stack([projection.forward(geodesic_between(first, last, share)) for share in shares.tolist()], axis=1)


def geodesic_steps(lonlat: FloatArray) -> FloatArray:
    """
    Return the steps between places in order, metres east and north, shape ``(m - 1, 2)``.

    Each is as long as the geodesic, in its direction halfway.

    Parameters
    ----------
    lonlat
        Longitudes and latitudes, degrees, shape ``(m, 2)``.

    Examples
    --------
    >>> geodesic_steps(np.array([[24.0, 60.0], [26.0, 60.0], [26.0, 61.0]])).round().tolist()
    [[111596.0, 0.0], [0.0, 111421.0]]
    """
    if len(lonlat) < 2:  # noqa: PLR2004 - two ends
        return np.zeros((0, 2))
    middles = geodesic_between(lonlat[:-1], lonlat[1:], 0.5)
    lengths = _geod().inv(*lonlat[:-1].T, *lonlat[1:].T)[2]
    angles = np.radians(_geod().inv(*middles.T, *lonlat[1:].T)[0])
    return np.asarray(lengths[:, None] * np.column_stack([np.sin(angles), np.cos(angles)]))


def geodesic_points(place: Point, azimuths: FloatArray, distance: float) -> FloatArray:
    """
    Return the points at a distance from a point of the Earth in some directions, degrees, shape ``(n, 2)``.

    Parameters
    ----------
    place
        Longitude and latitude, degrees.
    azimuths
        Clockwise from north, degrees, shape ``(n,)``.
    distance
        Metres.

    Examples
    --------
    >>> geodesic_points((25.0, 60.0), np.array([0.0, 90.0]), 55_800.0).round(2).tolist()
    [[25.0, 60.5], [26.0, 60.0]]
    """
    many = np.ones(len(azimuths))
    longitude, latitude, _ = _geod().fwd(place[0] * many, place[1] * many, azimuths, distance * many)
    return np.column_stack([longitude, latitude])


def geodesic_lengths(place: Point, points: FloatArray) -> FloatArray:
    """
    Return the distances of points from a point on WGS84, metres; longitudes may go on beyond 180 degrees.

    Examples
    --------
    >>> geodesic_lengths((179.0, 0.0), np.array([[181.0, 0.0], [179.0, 1.0]])).round().tolist()
    [222639.0, 110574.0]
    """
    many = np.ones(len(points))
    return np.asarray(_geod().inv(place[0] * many, place[1] * many, wrapped(points[:, 0]), points[:, 1])[2])


def degrees_of(path: FloatArray, projection: LocalProjection) -> FloatArray:
    """
    Return waypoints in longitude and latitude, rounded to a tenth of a millimetre.

    Examples
    --------
    >>> degrees_of(np.zeros((1, 2)), LocalProjection(24.0, 60.0)).tolist()
    [[24.0, 60.0]]
    """
    return np.round(projection.inverse(path), DIGITS)


def distortion_note(projection: LocalProjection | None, paths: Iterable[FloatArray]) -> str:
    """
    Return a note of how much lengths on a flat map exceed those on the Earth along paths; empty in the plane.

    Examples
    --------
    >>> distortion_note(LocalProjection(24.0, 60.0), [np.array([(0.0, 0.0), (3e4, 4e4)])])
    'lengths exceed those on the Earth by at most 0.0011 %; lower bounds allow for that'
    """
    return "" if projection is None else projection.note(paths)


def wrapped(longitude: FloatArray) -> FloatArray:
    """
    Bring longitudes into -180 to 180 degrees; those in that range stay the same to the last bit.

    Examples
    --------
    >>> wrapped(np.array([180.0, 181.5])).tolist()
    [180.0, -178.5]
    """
    return np.where(np.abs(longitude) <= 180.0, longitude, (longitude + 180.0) % 360.0 - 180.0)  # noqa: PLR2004


def projected_bounds(box: Bounds, projection: LocalProjection) -> Bounds:
    """
    Return the smallest box in metres around a box of longitudes and latitudes, widened by a metre.

    The sides bend when projected: between the points laid on them they bulge by up to a metre. West greater than east
    means a box across the antimeridian (RFC 7946, section 5.2).

    Raises
    ------
    ProblemError
        If a bound is not finite or out of range, or the box is empty.

    Examples
    --------
    >>> box = (24.0, 60.0, 25.0, 61.0)
    >>> [round(side / 1e3, 1) for side in projected_bounds(box, LocalProjection.centred_on(box))]
    [-27.9, -55.7, 27.9, 55.8]
    """
    west, south, east, north = four_numbers("bounds", box)
    require_degrees("the box of the bounds", np.array([(west, south), (east, north)]))
    east += 360.0 * (east < west)
    if not (west < east <= west + 360.0 and south < north):
        msg = (
            f"bounds {(west, south, east, north)} are no box; give west, south, east, north with south < north, "
            "west != east and at most 360 degrees between them"
        )
        raise ProblemError(msg)
    box = west, south, east, north
    west, south, east, north = project_area(shapely.box(*box), projection).bounds
    return west - EDGE_METRES, south - EDGE_METRES, east + EDGE_METRES, north + EDGE_METRES


@cache
def _geod() -> "pyproj.Geod":
    """Return the geodesics of WGS84."""
    # PROJ's own "aeqd" uses the same geodesics, but maps all points within 0.6 mm of the origin to the origin.
    import pyproj  # noqa: PLC0415 - slow to import, and most problems need no map

    return pyproj.Geod(ellps="WGS84")


def _degrees(values: ArrayLike, name: str) -> FloatArray:
    """Return longitudes and latitudes in range, shape (..., 2), degrees, or raise `ProblemError`."""
    points = point_array(name, values)
    wrong = np.argwhere((np.abs(points) > (180.0, 90.0)).any(axis=-1))
    if len(wrong):
        where = tuple(int(i) for i in wrong[0])
        message = (
            f"{name} holds {points[where].tolist()} at index {where or 0}; longitude must be in [-180, 180] and "
            f"latitude in [-90, 90]: give degrees, longitude first"
        )
        raise ProblemError(message)
    return points

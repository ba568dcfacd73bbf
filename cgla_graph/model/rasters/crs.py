"""Coordinate reference systems of files: places on the Earth, and whether their plane is true to lengths."""

import math
import re
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import at_most_percent, cut, shown
from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph._validate import number_array, point_array
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import GEODESIC_ERROR, LocalProjection, geodesic_length, wrapped

if TYPE_CHECKING:
    import pyproj

#: Characters of a text that names a system (WKT), at most.
LONGEST_TEXT = 100_000
#: By how much lengths and areas on a plane may differ from those on the Earth.
TOLERANCE = 0.01
#: Points a side of the grid on which scales are measured, and metres to each side of a point.
SIDE, STEP = 17, 500.0
#: One over the flattening of WGS84 and GRS80, of which systems without a datum are within metres of WGS84, and 0 of
#: spheres, whose latitudes are by custom those of WGS84.
MODERN = (298.257223563, 298.257222101, 0.0)
#: Degrees by which places may differ that are the same.
SAME, ALIKE = 1e-10, 1e-6
#: Names of systems that have none.
UNNAMED = ("unknown", "unnamed", "undefined")
#: Accuracy of a shift of datum that is said, metres.
SAID = 5.0


class RasterWarning(UserWarning):
    """A raster, or places on it, were read in a way that the caller did not ask for."""


@dataclass(frozen=True)
class CoordinateSystem:
    """
    The coordinates of a file, and their longitude and latitude on WGS84.

    Attributes
    ----------
    wkt
        Its definition, horizontal.
    name
        Its name for messages.
    area
        West, south, east, north of the file, degrees, for which the shift of the datum was chosen; None for any.
    accuracy
        Of that shift, metres: 0 on WGS84, infinite where the datum has no name.

    Examples
    --------
    >>> system = CoordinateSystem.of_code("EPSG:32635")
    >>> system.name, system.lonlat([[500_000.0, 6_651_411.19]]).round(6).tolist()
    ('WGS 84 / UTM zone 35N', [[27.0, 60.0]])
    """

    wkt: str
    name: str
    area: Bounds | None = None
    accuracy: float = 0.0

    @classmethod
    def of_code(cls, text: str, bounds: Bounds | None = None) -> "CoordinateSystem":
        """
        Return the system that a code (``EPSG:3067``, ``ESRI:54009``) or a definition (WKT) names.

        Parameters
        ----------
        text
            The code or the definition.
        bounds
            Of a map in it; None for any.

        Raises
        ------
        ProblemError
            If the text names no system on the Earth, or one on a datum that is not known.

        Examples
        --------
        >>> CoordinateSystem.of_code("EPSG:27700", (530e3, 180e3, 531e3, 181e3)).accuracy
        2.0
        """
        import pyproj  # noqa: PLC0415 - slow to import

        system = None
        if len(text) <= LONGEST_TEXT:
            try:
                code = re.fullmatch(r"\s*(EPSG|ESRI|OGC):(\w{1,8})\s*", text, re.IGNORECASE | re.ASCII)
                system = pyproj.CRS.from_authority(*code.groups()) if code else pyproj.CRS.from_wkt(text.strip())
            except (pyproj.exceptions.ProjError, ValueError):
                system = None
        if system is None:
            msg = f"{shown(text)} names no coordinate reference system; give a code of EPSG or ESRI, or WKT"
            raise ProblemError(msg)
        if system.is_compound:
            # heights do not move places
            system = system.sub_crs_list[0]
        if len(system.axis_info) > 2 and not system.is_bound:  # noqa: PLR2004 - with a height
            system = system.to_2d()
        name = cut(system.name, 60) if system.name not in UNNAMED else _unnamed(system)
        if not (system.is_projected or system.is_geographic):
            msg = f"{name} is no system of places on the Earth's surface; give a projected or geographic one"
            raise ProblemError(msg)
        found = cls(system.to_wkt(), name)
        area = None if bounds is None else found.degrees_around(bounds)
        if area is not None and area[2] - area[0] <= 180.0:  # noqa: PLR2004 - half of the Earth
            found = cls(found.wkt, name, area)
        _require_datum(system, found)
        return cls(found.wkt, name, found.area, _accuracy(_shift(found.wkt, found.area)))

    @property
    def is_wgs84(self) -> bool:
        """Whether its coordinates are longitude and latitude on WGS84, to a hundredth of a millimetre."""
        places = np.array([(-120.0, -50.0), (0.0, 0.0), (25.0, 60.0), (170.0, 10.0)])
        return bool((np.abs(self.lonlat(places) - places) < SAME).all())

    def lonlat(self, points: ArrayLike) -> FloatArray:
        """Return longitudes, -180 to 180, and latitudes of points, shape ``(n, 2)``; NaN where there is no place."""
        return _moved(_shift(self.wkt, self.area), number_array("points", points), inverse=False)

    def points(self, lonlat: ArrayLike) -> FloatArray:
        """Return the coordinates of longitudes and latitudes, shape ``(n, 2)``; NaN where there are none."""
        return _moved(_shift(self.wkt, self.area), number_array("lonlat", lonlat), inverse=True)

    def degrees_around(self, bounds: Bounds) -> Bounds | None:
        """
        Return the box in degrees around bounds, across the antimeridian beyond 180; None where they leave the Earth.

        Examples
        --------
        >>> box = CoordinateSystem.of_code("EPSG:32635").degrees_around((4e5, 6.6e6, 6e5, 6.7e6))
        >>> [round(side, 2) for side in box]
        [25.18, 59.53, 28.82, 60.44]
        """
        degrees = self.lonlat(_grid(bounds, 33).reshape(-1, 2))
        if not np.isfinite(degrees).all():
            return None
        # the turn by which each is nearest to the middle of the grid
        middle = degrees[len(degrees) // 2, 0]
        degrees[:, 0] += 360.0 * np.round((middle - degrees[:, 0]) / 360.0)
        (west, south), (east, north) = degrees.min(axis=0).tolist(), degrees.max(axis=0).tolist()
        return west, south, east, north

    def is_same(self, other: "CoordinateSystem", bounds: Bounds) -> bool:
        """Return whether both give the same places over bounds, to a tenth of a metre."""
        corners = np.reshape(bounds, (2, 2))
        return bool((np.abs(self.lonlat(corners) - other.lonlat(corners)) < ALIKE).all())

    def is_invertible(self, bounds: Bounds) -> bool:
        """Return whether all points of a grid over bounds are places on the Earth, and each its own."""
        x_min, y_min, x_max, y_max = bounds
        tolerance = 1e-4 * max(x_max - x_min, y_max - y_min) + 1e-8 * max(map(abs, bounds))
        grid = _grid(bounds, 33).reshape(-1, 2)
        again = self.points(self.lonlat(grid))
        return bool(np.isfinite(again).all() and (np.abs(again - grid) <= tolerance).all())

    @property
    def datum_note(self) -> str:
        """A note on a datum other than WGS84; empty if the difference is small."""
        if math.isinf(self.accuracy):
            return (
                f"how far the datum of {self.name} is from WGS84 is not known; its latitudes are taken as those there"
            )
        if self.accuracy > SAID:
            return f"the datum of {self.name} is shifted to WGS84, right to {self.accuracy:g} m"
        return ""


@dataclass(frozen=True)
class Scale:
    """
    The scale of a plane over its bounds: coordinates per metre on the Earth, along the axes of Tissot's ellipse.

    Attributes
    ----------
    least, greatest
        Of lengths.
    least_area, greatest_area
        Of areas.
    """

    least: float = 0.0
    greatest: float = math.inf
    least_area: float = 0.0
    greatest_area: float = math.inf

    @classmethod
    def over(cls, system: CoordinateSystem, bounds: Bounds) -> "Scale":
        """
        Measure it on a grid, and allow for what bends between its points.

        Examples
        --------
        >>> moll = CoordinateSystem.of_code("ESRI:54009")
        >>> x, y = moll.points([[25.0, 60.0]])[0].tolist()
        >>> Scale.over(moll, (x, y, x + 1.0, y + 1.0)).text
        '0.81 to 1.23 times'
        """
        grid = _grid(bounds, SIDE)
        least, greatest = scales(system, grid.reshape(-1, 2)).T.reshape(2, SIDE, SIDE)
        if not (np.isfinite(least).all() and system.is_invertible(bounds)):
            return cls()

        def ends(values: FloatArray) -> tuple[float, float]:
            bends = [float(np.abs(np.diff(values, 2, axis=axis)).max()) for axis in (0, 1)]
            more = 0.25 * sum(bends) + 1e-9 * float(values.max())
            return float(values.min()) - more, float(values.max()) + more

        areas = ends(least * greatest)
        return cls(ends(least)[0], ends(greatest)[1], *areas)

    @property
    def is_true(self) -> bool:
        """Whether lengths and areas are those on the Earth within 1 %, in metres."""
        least, greatest = min(self.least, self.least_area), max(self.greatest, self.greatest_area)
        return least >= 1.0 - TOLERANCE and greatest <= 1.0 + TOLERANCE

    @property
    def text(self) -> str:
        """By how much a length in coordinates differs from metres on the Earth."""
        if not math.isfinite(self.greatest):
            return "some places have none"
        return f"{self.least:.2f} to {self.greatest:.2f} times"


def scales(system: CoordinateSystem, points: FloatArray) -> FloatArray:
    """
    Return the least and the greatest scale at points, shape ``(n, 2)`` each: coordinates per metre; NaN for no place.

    Examples
    --------
    >>> utm = CoordinateSystem.of_code("EPSG:32635")
    >>> scales(utm, np.array([[500_000.0, 6_651_411.0]])).round(6).tolist()
    [[0.9996, 0.9996]]
    """
    lonlat = system.lonlat(points)
    valid = np.asarray(np.isfinite(lonlat).all(axis=1))
    places = np.where(valid[:, None], lonlat, 0.0)
    ahead = [system.points(_step(places, azimuth)) for azimuth in (90.0, 0.0)]
    behind = [system.points(_step(places, azimuth)) for azimuth in (-90.0, 180.0)]
    slopes = np.stack([(one - other) / (2.0 * STEP) for one, other in zip(ahead, behind, strict=True)], axis=-1)
    valid &= np.isfinite(slopes).all(axis=(1, 2))
    axes = np.linalg.svd(np.where(valid[:, None, None], slopes, 0.0), compute_uv=False)
    return np.where(valid[:, None], axes[:, ::-1], np.nan)


@dataclass(frozen=True)
class CrsPlane(LocalProjection):
    """
    The plane of a coordinate reference system over a map, where it is true within 1 %.

    Its lengths are taken as they are. Each is at most `greatest` times that on the Earth, so that a lower bound on the
    plane, divided by that, holds on the Earth.

    Attributes
    ----------
    longitude, latitude
        The middle of the map, degrees.
    system
        The system.
    least, greatest
        Scale of lengths over the map: coordinates per metre.
    bounds
        Of the map, in the coordinates of the system.

    Examples
    --------
    >>> plane = CrsPlane.over(CoordinateSystem.of_code("EPSG:32635"), (480e3, 6.6e6, 520e3, 6.64e6))
    >>> plane.inverse((500e3, 6_620e3)).round(3).tolist(), round(plane.greatest, 5)
    ([27.0, 59.718], 0.9996)
    """

    system: CoordinateSystem
    least: float
    greatest: float
    bounds: Bounds

    @classmethod
    def over(cls, system: CoordinateSystem, bounds: Bounds) -> "CrsPlane":
        """
        Return the plane of a system over the bounds of a map.

        Raises
        ------
        ProblemError
            If its lengths or areas differ from those on the Earth by more than 1 %.
        """
        scale = Scale.over(system, bounds)
        if not scale.is_true:
            msg = (
                f"the plane of {system.name} over {bounds} is not true: its lengths are {scale.text} those on the Earth"
                f', and {TOLERANCE:.0%} is allowed; lay the map in degrees (coordinates = "lonlat")'
            )
            raise ProblemError(msg)
        x_min, y_min, x_max, y_max = bounds
        ((longitude, latitude),) = system.lonlat([(0.5 * (x_min + x_max), 0.5 * (y_min + y_max))]).tolist()
        return cls(longitude, latitude, system, scale.least, scale.greatest, bounds)

    def stretch(self, distance: float) -> float:  # noqa: ARG002 - the same all over the map
        """Bound the ratio of a line's length on the plane to its length on the Earth, and to that on the plane."""
        return max(1.0, self.greatest)

    def scale(self, distance: FloatArray) -> FloatArray:
        """Return one over `stretch`, in the shape of `distance`."""
        return np.full(np.shape(distance), 1.0 / self.stretch(0.0))

    def scale_gradient(self, metres: FloatArray) -> FloatArray:
        """Return the gradient of `scale`, 0, shape ``(n, 2)``."""
        return np.zeros_like(metres)

    def least_length(self, start: Point, goal: Point) -> float:
        """Return a length that no line between two points undercuts, neither on the plane nor on the Earth."""
        ends = (tuple(end) for end in self.inverse((start, goal)).tolist())
        return max(0.0, min(geodesic_length(*ends) - GEODESIC_ERROR, math.dist(start, goal)))

    def bound_on_earth(self, bound: float, start: Point, goal: Point, bounds: Bounds) -> float:  # noqa: ARG002 - as there
        """Turn a lower bound on the plane into one on both, as `LocalProjection.bound_on_earth`."""
        if not math.isfinite(bound) or bound <= 0.0:
            return bound
        return max(bound / self.stretch(0.0), self.least_length(start, goal))

    def note(self, paths: Iterable[FloatArray]) -> str:  # noqa: ARG002 - the same all over the map
        """Return a note of how much its lengths differ from those on the Earth."""
        over = [text for text in (_off(self.greatest - 1.0, "exceed"), _off(1.0 - self.least, "fall short of")) if text]
        return f"lengths on the plane of {self.system.name} {' and '.join(over)}; lower bounds allow for that"

    def forward(self, lonlat: ArrayLike) -> FloatArray:
        """Return the coordinates of points in degrees, shape ``(..., 2)``; one that has none is an error."""
        return self._converted(lonlat, "lonlat", self.system.points)

    def inverse(self, metres: ArrayLike) -> FloatArray:
        """Return the longitudes and latitudes of points, shape ``(..., 2)``; one that has none is an error."""
        return self._converted(metres, "metres", self.system.lonlat)

    def _converted(self, values: ArrayLike, name: str, convert: Callable[[FloatArray], FloatArray]) -> FloatArray:
        points = point_array(name, values)
        flat = points.reshape(-1, 2)
        found = convert(flat)
        lost = ~np.isfinite(found).all(axis=1)
        if lost.any():
            msg = f"{name} holds {flat[lost][0].tolist()}, which is no place on the map of {self.system.name}; move it"
            raise ProblemError(msg)
        return found.reshape(points.shape)


class _Placed(Protocol):
    """A raster, which may be on the plane of a system."""

    @property
    def system(self) -> CoordinateSystem | None: ...


def plane_of(projection: LocalProjection | None, rasters: Sequence[_Placed], bounds: Bounds) -> LocalProjection | None:
    """
    Return the projection of a map: the given one, or that of its rasters' system; None if there is none.

    Raises
    ------
    ProblemError
        If rasters are on different planes, or on another one than the map, or the plane is not true over the bounds.
    """
    systems = {raster.system: raster.system for raster in rasters if raster.system is not None}
    own = projection.system if isinstance(projection, CrsPlane) else None
    first = own or next(iter(systems), None)
    if first is None:
        return projection
    others = [one for one in systems if not one.is_same(first, bounds)]
    if others or (projection is not None and own is None):
        other = f"that of {others[0].name}" if others else "one around an origin"
        msg = (
            f"a raster or the map is on the plane of {first.name}, and another one on {other}; lay all rasters on one "
            "(RasterRisk.from_file(file, projection=problem.projection))"
        )
        raise ProblemError(msg)
    if isinstance(projection, CrsPlane) and _contains(projection.bounds, bounds):
        return projection
    return CrsPlane.over(first, bounds)


def _contains(box: Bounds, other: Bounds) -> bool:
    return box[0] <= other[0] and box[1] <= other[1] and other[2] <= box[2] and other[3] <= box[3]


def _unnamed(system: "pyproj.CRS") -> str:
    """Return a name for a system without one."""
    if system.source_crs is not None:
        # (with a shift to WGS84)
        system = system.source_crs
    operation = system.coordinate_operation
    ellipsoid = "" if system.ellipsoid is None else f", {system.ellipsoid.name}"
    return f"{'unnamed system' if operation is None else operation.method_name}{ellipsoid}"


def _off(ratio: float, verb: str) -> str:
    """Return by how much lengths are off; empty if they are not."""
    return f"{verb} those on the Earth by at most {at_most_percent(ratio)}" if ratio > 1e-8 else ""  # noqa: PLR2004


def _grid(bounds: Bounds, side: int) -> FloatArray:
    """Return points over bounds, shape ``(side, side, 2)``."""
    x_min, y_min, x_max, y_max = bounds
    return np.stack(np.meshgrid(np.linspace(x_min, x_max, side), np.linspace(y_min, y_max, side)), axis=-1)


def _step(places: FloatArray, azimuth: float) -> FloatArray:
    """Return the places a step away, degrees."""
    from cgla_graph.model.earth import _geod  # noqa: PLC0415

    many = np.ones(len(places))
    lon, lat, _ = _geod().fwd(places[:, 0], places[:, 1], azimuth * many, STEP * many)
    return np.column_stack([lon, lat])


def _moved(transformer: "pyproj.Transformer", points: FloatArray, *, inverse: bool) -> FloatArray:
    x, y = transformer.transform(points[:, 0], points[:, 1], direction="INVERSE" if inverse else "FORWARD")
    moved = np.column_stack([x, y])
    moved[~np.isfinite(moved).all(axis=1)] = np.nan
    if not inverse:
        moved[:, 0] = wrapped(moved[:, 0])
    return moved


@cache
def _shift(wkt: str, area: Bounds | None) -> "pyproj.Transformer":
    """Return the most accurate transformation to WGS84 that needs no file of a grid, for an area."""
    import pyproj  # noqa: PLC0415 - slow to import
    from pyproj.transformer import AreaOfInterest, TransformerGroup  # noqa: PLC0415

    around = None
    if area is not None:
        west, east = wrapped(np.array([area[0], area[2]])).tolist()
        around = AreaOfInterest(west, max(area[1], -90.0), east, min(area[3], 90.0))
    with warnings.catch_warnings():
        # the accuracy says it
        warnings.simplefilter("ignore")
        try:
            group = TransformerGroup(pyproj.CRS.from_wkt(wkt), "EPSG:4326", always_xy=True, area_of_interest=around)
        except pyproj.exceptions.ProjError:
            group = None
    if group is None or not group.transformers:
        msg = f"no transformation to WGS84 is known of {cut(wkt, 60)}; warp it to EPSG:4326"
        raise ProblemError(msg)
    return group.transformers[0]


def _accuracy(transformer: "pyproj.Transformer") -> float:
    if transformer.accuracy >= 0.0:
        return float(transformer.accuracy)
    return math.inf if "Ballpark" in transformer.description else 0.0


def _require_datum(system: "pyproj.CRS", found: CoordinateSystem) -> None:
    """Refuse a datum that may be hundreds of metres off WGS84, and nothing says by how much."""
    ellipsoid = system.ellipsoid
    if ellipsoid is None or min(abs(ellipsoid.inverse_flattening - one) for one in MODERN) < 1e-6:  # noqa: PLR2004
        return
    if "Ballpark" in _shift(found.wkt, found.area).description:
        here = "" if found.area is None else " here"
        msg = (
            f"how far the datum of {found.name} (ellipsoid {ellipsoid.name}) is from WGS84 is not known{here}: places "
            "may be off by hundreds of metres; give the system that the file is in (gdal_edit.py -a_srs EPSG:… FILE)"
        )
        raise ProblemError(msg)

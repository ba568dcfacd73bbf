"""Flight geography, contingency volume and ground risk buffer around a path or a flight plan."""

import itertools
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import NoneType
from typing import Any, Final, TypeAlias

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._display import Plottable
from cgla_graph._text import figure, shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import instance, non_negative_number
from cgla_graph.airspace.flight_plans.fence import Fence, FenceShape
from cgla_graph.airspace.flight_plans.formats import read_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Reference, Waypoint
from cgla_graph.airspace.terrain.straight import straight_above_ground
from cgla_graph.airspace.volumes.dimensions import Dimensions, VolumeSettings
from cgla_graph.airspace.volumes.files import VolumeArea, write_areas
from cgla_graph.airspace.volumes.flight_heights import NOT_COVERED, above_ground
from cgla_graph.airspace.volumes.ground_risk_class import Density, GroundRiskClass, density_under, intrinsic_class
from cgla_graph.airspace.volumes.outlines import around, flown_lines, in_degrees, inner_outlines
from cgla_graph.airspace.zones.ground import Ground, read_ground
from cgla_graph.errors import PlanError, ProblemError
from cgla_graph.model.earth import LocalProjection, wrapped
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.solution import Solution
from cgla_graph.turning.flyable import Flyable
from cgla_graph.untrusted.files import FilePath

Flown: TypeAlias = Solution | FlightPlan | FilePath | ArrayLike

#: The volumes, from the inside to the outside: each contains those before it.
NAMES: Final = ("flight geography", "contingency volume", "ground risk buffer")
#: A fence is inside of its volume by at most this part of half the width of the flight geography.
_FENCE: Final = 0.05


@dataclass(frozen=True)
class PeopleBelow:
    """
    People below the volumes.

    Attributes
    ----------
    operational
        Greatest density under flight geography and contingency volume.
    buffer
        Greatest density under the ground risk buffer around them.
    ground_risk_class
        The intrinsic ground risk class, by the greater of both.
    """

    operational: Density
    buffer: Density
    ground_risk_class: GroundRiskClass

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {
            "operational_volume": self.operational.document(),
            "ground_risk_buffer": self.buffer.document(),
            "intrinsic_ground_risk_class": self.ground_risk_class.document(),
        }


@dataclass(frozen=True, eq=False)
class Volumes(Plottable):
    """
    Flight geography, contingency volume and ground risk buffer; each area contains those before it.

    Attributes
    ----------
    name
        Name of the flight.
    settings, dimensions
        The facts that were given, and widths and heights that follow.
    shapes
        The areas of flight geography, contingency volume and ground risk buffer on the map, map units.
    lines
        The path on the map.
    projection
        Projection of the map; None in the plane.
    remarks
        Assumptions.
    """

    name: str
    settings: VolumeSettings
    dimensions: Dimensions
    shapes: tuple[BaseGeometry, BaseGeometry, BaseGeometry] = field(repr=False)
    lines: BaseGeometry = field(repr=False)
    projection: LocalProjection | None = None
    remarks: tuple[str, ...] = ()

    @property
    def flight_geography(self) -> BaseGeometry:
        """The area of the flight geography: degrees (longitudes go on beyond 180), or map units in the plane."""
        return self._placed(0)

    @property
    def contingency(self) -> BaseGeometry:
        """The area of flight geography and contingency volume, in the same coordinates."""
        return self._placed(1)

    @property
    def ground_risk_buffer(self) -> BaseGeometry:
        """The area of all three, in the same coordinates."""
        return self._placed(2)

    def _placed(self, index: int) -> BaseGeometry:
        shape = self.shapes[index]
        return shape if self.projection is None else in_degrees(shape, self.projection)

    @property
    def placed(self) -> dict[str, BaseGeometry]:
        """The three areas by name, in the same coordinates."""
        return {name: self._placed(index) for index, name in enumerate(NAMES)}

    @property
    def tops(self) -> tuple[float, float, float]:
        """Greatest height of each above ground, metres; the ground risk buffer is on the ground."""
        return self.dimensions.geography_top, self.dimensions.contingency_top, 0.0

    def people_below(
        self, people: RasterRisk | None, *, without_data: float | None = None, controlled: bool = False
    ) -> PeopleBelow:
        """
        Return the greatest densities of people below the volumes, and the intrinsic ground risk class.

        Parameters
        ----------
        people
            People per km2, on the map of these volumes; None if unknown.
        without_data
            People per km2 outside of the raster, as 0 over the sea, and in cells without data instead of what they
            stand for (`nodata`); None if unknown outside.
        controlled
            Whether all of it is a controlled ground area, without people who are not involved.

        Examples
        --------
        >>> flight = volumes([(24.0, 60.0), (24.1, 60.0)], height=60, speed=15, dimension=0.8, pitch=30)
        >>> print(flight.people_below(None).ground_risk_class.value)
        None
        """
        _, operational, whole = self.shapes
        densities = [
            density_under(area, people, without_data=without_data)
            for area in (operational, whole.difference(operational), whole)
        ]
        found = intrinsic_class(
            densities[2], dimension=self.settings.dimension, speed=self.settings.speed, controlled=controlled
        )
        return PeopleBelow(densities[0], densities[1], found)

    def fence(self, which: str = "flight geography") -> tuple[Fence, ...]:
        """
        Return a fence for a plan (`cgla_graph.FlightPlan`): stay inside of a volume.

        It is inside of the volume by a little, so that it has few corners.

        Parameters
        ----------
        which
            ``flight geography``, where contingency procedures begin (the autopilot's action at the fence is one); or
            ``contingency volume``, where emergency procedures begin, for a fence that ends the flight.

        Raises
        ------
        ProblemError
            If there is no such volume, or the map is in the plane.

        Examples
        --------
        >>> flight = volumes([(24.0, 60.0), (24.1, 60.0)], height=60, speed=15, dimension=0.8, pitch=30)
        >>> [(rule.name, rule.inclusion) for rule in flight.fence()]
        [('flight geography', True)]
        """
        if which not in NAMES[:2]:
            msg = f"a fence around {shown(which)} is not known; choose one of {', '.join(NAMES[:2])}"
            raise ProblemError(msg)
        if self.projection is None:
            msg = "fences are in longitude and latitude, and this map is in the plane"
            raise ProblemError(msg)
        within = _FENCE * self.dimensions.half_width / 4.0
        parts, holes = inner_outlines(self.shapes[NAMES.index(which)], within, self.projection)
        rules = [Fence(which, inclusion=True, shapes=tuple(map(_shape, parts)))]
        return (*rules, *(Fence(f"hole of the {which}", inclusion=False, shapes=(_shape(hole),)) for hole in holes))

    def lines_of_text(self) -> dict[str, str]:
        """Return widths and heights in words, by volume."""
        size = self.dimensions
        above = "m above ground"
        return {
            NAMES[0]: f"{figure(size.half_width, 4)} m on both sides, up to {figure(size.geography_top, 4)} {above}",
            NAMES[1]: f"{figure(size.contingency, 4)} m more, up to {figure(size.contingency_top, 4)} {above}",
            NAMES[2]: f"{figure(size.buffer, 4)} m more ({self.settings.buffer})",
        }

    def notes(self) -> list[str]:
        """Return assumptions and open points."""
        return [*self.remarks, *self.settings.notes]

    def document(self) -> dict[str, Any]:
        """Return dimensions, settings and areas as JSON."""
        return {
            "name": self.name,
            "dimensions": dict(vars(self.dimensions)),
            "settings": self.settings.document(),
            "assumptions": self.settings.assumptions(),
            "notes": self.notes(),
            "coordinates": "plane" if self.projection is None else "lonlat",
            "areas": {name: area.__geo_interface__ for name, area in self.placed.items()},
        }

    def save(self, path: FilePath) -> Path:
        """
        Write the volumes as ``.kml`` or ``.geojson``; the file is replaced as a whole or not at all.

        Raises
        ------
        OutputError
            If the ending is another one, the map is in the plane, or the file cannot be written.
        """
        areas = [] if self.projection is None else self.areas
        return write_areas(self.name, [*self.settings.assumptions(), *self.notes()], areas, path)

    @property
    def areas(self) -> list[VolumeArea]:
        """The three areas as they are written to files."""
        said = self.lines_of_text()
        bottoms_and_tops = zip(NAMES, self.placed.values(), self.tops, strict=True)
        return [VolumeArea(name, area, top, said[name]) for name, area, top in bottoms_and_tops]


def _shape(corners: FloatArray) -> FenceShape:
    return FenceShape(tuple((float(x), float(y)) for x, y in corners))


def volumes(
    flight: Flown,
    settings: VolumeSettings | None = None,
    *,
    height: float | None = None,
    altitude: float | None = None,
    above: Reference = "home",
    ground: Ground | FilePath | None = None,
    projection: LocalProjection | None = None,
    name: str = "",
    arc_tolerance: float | None = None,
    **facts: Any,  # noqa: ANN401 - those of VolumeSettings
) -> Volumes:
    """
    Build flight geography, contingency volume and ground risk buffer around a path or a flight plan.

    Parameters
    ----------
    flight
        A solution with a path, a flight plan or its file, or longitudes and latitudes, degrees, shape ``(m, 2)``. The
        corners that a plan lets the autopilot cut are inside.
    settings
        Facts about the aircraft; None: from `facts`.
    height
        Greatest height of the flight above ground, metres; None: from the altitudes.
    altitude, above
        Altitude of a solution, metres above ``home``, ``ground`` or ``sea``. A plan has its own.
    ground
        Elevations, or the file of a raster of them. Without them, heights above home count as heights above ground, and
        a remark says so. With them, legs of a plan above ground count as flown straight as well.
    projection
        Projection of the map of a plan or of degrees; None for one around it.
    name
        Name of the flight; empty for that of the plan.
    arc_tolerance
        Of a flyable solution: as `Flyable.waypoints`, whose straight legs the volumes contain as well.
    **facts
        Arguments of `VolumeSettings`: `speed` and `dimension`, and `pitch` or `roll`.

    Returns
    -------
    volumes
        The areas, on the Earth never narrower than the dimensions say.

    Raises
    ------
    ProblemError
        If a number is out of range or missing, there is no path, or the height above ground is not known.
    PlanError
        If a plan does not say everywhere where it flies.

    Examples
    --------
    >>> flight = volumes([(24.0, 60.0), (24.1, 60.0)], height=60, speed=15, dimension=0.8, pitch=30)
    >>> [round(reach, 1) for reach in flight.dimensions.reaches]
    [16.0, 57.9, 145.4]
    """
    instance("settings", settings, (VolumeSettings, NoneType), "VolumeSettings(speed=…, dimension=…, pitch=…)")
    instance("ground", ground, (Ground, str, os.PathLike, NoneType), "elevations, or the file of a raster of them")
    instance("projection", projection, (LocalProjection, NoneType), "a LocalProjection")
    instance("name", name, str, "a text")
    if settings is None:
        settings = _settings(facts)
    elif facts:
        msg = f"settings and {', '.join(facts)} are both given; change the settings (dataclasses.replace)"
        raise ProblemError(msg)
    flown = _placed(flight, projection, altitude, above, name, arc_tolerance)
    operational = flown.around(settings.half_width + settings.contingency)
    remarks: tuple[str, ...] = ()
    if height is None:
        elevations = read_ground(ground) if isinstance(ground, str | os.PathLike) else ground
        under = None if flown.projection is None else in_degrees(operational, flown.projection)
        height, remarks = above_ground(flown.plan, under, elevations)
        if elevations is not None and flown.projection is not None and not isinstance(flight, Solution):
            height = max(height, straight_above_ground(flown.plan, elevations, flown.projection))
            if math.isinf(height):
                raise ProblemError(NOT_COVERED)
    size = settings.dimensions(non_negative_number("height", height))
    inner = flown.around(size.reaches[0])
    operational = operational.union(inner)
    shapes = inner, operational, flown.around(size.reaches[2]).union(operational)
    return Volumes(flown.name or "flight", settings, size, shapes, flown.lines, flown.projection, remarks)


def _settings(facts: dict[str, Any]) -> VolumeSettings:
    for fact in ("speed", "dimension"):
        if fact not in facts:
            words = {"speed": "greatest speed over ground, m/s", "dimension": "characteristic dimension, metres"}
            msg = f"{fact} is missing; give the {words[fact]}"
            raise ProblemError(msg)
    known = VolumeSettings.__dataclass_fields__
    unknown = sorted(set(facts) - set(known))
    if unknown:
        msg = f"{', '.join(unknown)} is no fact about the aircraft; known: {', '.join(known)}"
        raise ProblemError(msg)
    return VolumeSettings(**facts)


@dataclass(frozen=True)
class _Placed:
    """A flight on its map: routes of places, for each place the radius within which it is passed, and its plan."""

    routes: Sequence[FloatArray]
    plan: FlightPlan
    projection: LocalProjection | None
    name: str
    reaches: Sequence[float] = ()
    cuts: Sequence[float] = ()

    def around(self, distance: float) -> BaseGeometry:
        """Return the area within a distance of all places that may be flown through, map units."""
        area = around(self.lines, distance, self.projection)
        area = shapely.union_all([area, *(around(one, distance, self.projection) for one in self.corners)])
        if not any(self.reaches):
            return area
        discs = [
            around(shapely.Point(place), distance + reach, self.projection)
            for place, reach in zip(self.routes[0], self.reaches, strict=True)
        ]
        pairs = enumerate(itertools.pairwise(discs))
        legs = [shapely.union(*pair).convex_hull for leg, pair in pairs if any(self.reaches[leg : leg + 2])]
        return shapely.union_all([area, *discs, *legs])

    @property
    def corners(self) -> list[BaseGeometry]:
        """Areas flown over if corners are cut: from a distance before each waypoint straight to the next one."""
        route, found = self.routes[0], []
        for number, cut in enumerate(self.cuts):
            if cut > 0.0 and 0 < number < len(route) - 1:
                before, here, after = route[number - 1 : number + 2]
                share = min(1.0, cut / max(float(np.hypot(*(here - before))), cut))
                found.append(shapely.MultiPoint([here + share * (before - here), here, after]).convex_hull)
        return found

    @property
    def lines(self) -> BaseGeometry:
        """The path on the map."""
        return flown_lines(self.routes, self.projection)


def _placed(
    flight: Flown,
    projection: LocalProjection | None,
    altitude: float | None,
    above: Reference,
    name: str,
    arc_tolerance: float | None,
) -> _Placed:
    """Put a flight on its map."""
    if isinstance(flight, Solution):
        if not flight.status.has_path or not len(flight.path):
            msg = f"there is no path to lay volumes around: {flight.status.value}"
            raise ProblemError(msg)
        routes = [flight.path]
        if isinstance(flight, Flyable):
            routes.append(flight.waypoints(arc_tolerance)[0])
        if flight.projection is None:
            points = flight.path[:1].tolist()
            plan = FlightPlan(tuple(Waypoint(x, y, altitude, above) for x, y in points), coordinates="plane")
        else:
            plan = FlightPlan.along(flight.lonlat, altitude=altitude, reference=above)
        return _Placed(routes, plan, flight.projection, name)
    if altitude is not None:
        msg = "altitude is for solutions; give height, metres above ground"
        raise ProblemError(msg)
    plan, name = _plan_of(flight, name)
    flown = plan.flown
    if plan.coordinates == "plane":
        route, projection = flown, None
    else:
        projection = _middle(flown) if projection is None else projection
        route = projection.forward(flown)
    before = len(route) - len(plan.waypoints)
    reaches, cuts = (
        [0.0] * before + [getattr(one, name) for one in plan.waypoints] for name in ("reach", "acceptance")
    )
    return _Placed([route], plan, projection, name, reaches, cuts)


def _plan_of(flight: FlightPlan | FilePath | ArrayLike, name: str) -> tuple[FlightPlan, str]:
    """Return the plan of a file or of waypoints, which says everywhere where it flies, and its name."""
    if isinstance(flight, str | os.PathLike):
        plan = read_plan(flight)
        name = name or plan.name or Path(flight).stem
    elif isinstance(flight, FlightPlan):
        plan, name = flight, name or flight.name
    else:
        plan = FlightPlan.along(flight)
    if plan.unknown:
        msg = f"{name}: the plan does not say everywhere where it flies: {plan.unknown[0]}"
        raise PlanError(msg)
    return plan, name


def _middle(lonlat: FloatArray) -> LocalProjection:
    """Return a projection around the middle of places, also across the antimeridian."""
    from_first = wrapped(lonlat[:, 0] - lonlat[0, 0])
    east = float(lonlat[0, 0] + 0.5 * (from_first.min() + from_first.max()))
    north = 0.5 * float(lonlat[:, 1].min() + lonlat[:, 1].max())
    return LocalProjection(float(wrapped(np.array(east))), north)

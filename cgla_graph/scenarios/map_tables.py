"""Maps in TOML files: their tables, conversion to map units, and errors."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
import shapely
from pydantic import AfterValidator, Field, ValidationError
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import shown
from cgla_graph._types import Bounds, Point
from cgla_graph.airspace.terrain.area import NAME as TERRAIN
from cgla_graph.airspace.zones.account import ZoneRecord
from cgla_graph.airspace.zones.applying import OUTSIDE
from cgla_graph.airspace.zones.geojson import Area
from cgla_graph.airspace.zones.timed_zones import timed_areas
from cgla_graph.errors import ProblemError, ScenarioError
from cgla_graph.model.clearance import ROUNDING, closed_area, on_closed_border
from cgla_graph.model.earth import (
    LocalProjection,
    geodesic_length,
    is_closed_by_border,
    places_around,
    project_on_map,
    projected_bounds,
)
from cgla_graph.model.failure_model import FailureModel, Unit
from cgla_graph.model.lattice import Lattice, LatticeKind
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.rasters.crs import CoordinateSystem, CrsPlane
from cgla_graph.model.rasters.place import Kind
from cgla_graph.model.rasters.projection import cells_in_metres
from cgla_graph.model.rasters.reading import RasterCells, read_cells
from cgla_graph.model.rasters.values import MOST_CELLS
from cgla_graph.model.risk import Reading, Threat
from cgla_graph.model.risk_raster import Interpolation, Origin, RasterRisk, laid_out
from cgla_graph.scenarios.area_tables import (
    MapZones,
    NoFlyTable,
    Pair,
    Table,
    applied_zones,
    area_record,
    drawn_area,
    seen_box,
)
from cgla_graph.scenarios.drawing import Stream, drawn_threats
from cgla_graph.scenarios.geojson import read_areas
from cgla_graph.scenarios.lonlat_box import bounds_of, box_around, box_of, require_inside, require_unswapped, widened
from cgla_graph.scenarios.table_faults import faults
from cgla_graph.scenarios.terrain_tables import MapTerrain
from cgla_graph.scenarios.text_files import scenario_errors
from cgla_graph.timed.timed_area import TimedArea
from cgla_graph.untrusted.numbers import parse_float

#: Spreads around the centre of a threat that a box around threats holds, so that there is room to fly around it; and
#: spreads beyond which its risk does not count.
SEEN, FELT = 3.0, 8.0
#: Least distance around ends on a map of zones, metres.
NEAREST = 2000.0


def _rising(pair: list[float]) -> list[float]:
    """Check an interval of positive numbers."""
    if not 0.0 < pair[0] <= pair[1]:
        msg = "give the least and the greatest, both above 0"
        raise ValueError(msg)
    return pair


Range = Annotated[Pair, AfterValidator(_rising)]


class ThreatTable(Table):
    """One threat: its centre, with spread and peak or with the sigma of Eq. 1 in one of its readings."""

    x: float
    y: float
    spread: float | None = Field(None, gt=0, description="standard deviation, map units")
    peak: float = Field(1.0, gt=0, description="risk per unit length at the centre")
    sigma: float | None = Field(None, gt=0, description="sigma of Eq. 1, instead of spread and peak")
    reading: Reading = Field("membership", description="how Eq. 1 is read")

    def build(self, x: float, y: float) -> Threat:
        """Return the threat with its centre at ``(x, y)``, map units."""
        if (self.spread is None) == (self.sigma is None):
            msg = "a threat needs either spread (and peak) or sigma (and reading)"
            raise ValueError(msg)
        if self.sigma is not None:
            return Threat.from_eq1(x, y, self.sigma, reading=self.reading)
        return Threat(x, y, spread=self.spread or 0.0, peak=self.peak)

    def spread_of(self) -> float:
        """Return the spread, map units, given directly or by sigma."""
        return self.build(0.0, 0.0).spread


class RandomThreatsTable(Table):
    """Threats drawn evenly over the bounds, from a seed."""

    count: int = Field(ge=1, le=10_000)
    seed: int = Field(ge=0)
    spread: Range = Field(description="least and greatest spread, map units")
    peak: Range = Field([1.0, 1.0], description="least and greatest peak")
    clear: float = Field(0.0, ge=0, description="least distance of a centre from any start and goal, map units")

    def build(self, bounds: Bounds, ends: list[Point]) -> list[Threat]:
        """Draw the threats."""
        stream = Stream(self.seed)
        return drawn_threats(stream, self.count, bounds, self.spread, self.peak, clear=self.clear, ends=ends)


class GroundRiskTable(Table):
    """An aircraft that fails above people."""

    failures_per_hour: float = Field(gt=0, description="losses of control that end in a crash, per flight hour")
    speed: float = Field(gt=0, description="ground speed, metres per second")
    lethal_area: float | None = Field(None, gt=0, description="where people are hit, square metres")
    dimension: float | None = Field(
        None, gt=0, description="characteristic dimension, metres: the lethal area is that of SORA 2.5, Annex F"
    )
    fatality: float = Field(1.0, gt=0, le=1, description="probability that a person who is hit dies")

    def build(self) -> FailureModel:
        """Return the model."""
        return FailureModel.of_aircraft(**dict(self))


class RasterTable(Table):
    """Risk on a grid of cells, in a file beside this one."""

    file: str = Field(min_length=1, description="path of a .tif, .asc, .csv, .csv.gz, .npy or .npz, from this file")
    kind: Kind = Field("density", description="count: values are people of whole cells, and divided by their areas")
    scale: float = Field(1.0, gt=0, description="factor from densities to risk per unit length")
    unit: Unit | None = Field(
        None,
        description="of densities of people on a map in metres (counts are people of cells), for any scale; "
        "or fatalities/m: risk in expected fatalities per metre",
    )
    ground_risk: GroundRiskTable | None = Field(
        None, description="the aircraft that fails above the people: risk is in expected fatalities per metre"
    )
    interpolation: Interpolation = "bilinear"
    origin: Origin = Field("upper", description="where row 0 is, of a .csv, .npy or .npz")
    nodata: float | None = Field(
        None, ge=0, description="value of cells without data, in the file's units (default: they are refused)"
    )
    bounds: Annotated[list[float], Field(min_length=4, max_length=4)] | None = Field(
        None, description="x_min, y_min, x_max, y_max of a file that does not say them (.csv, .npy, .npz)"
    )
    covers: str | None = Field(
        None, description="area that the cells say something of, if less than their bounds: WKT, map units (plane maps)"
    )
    peaks: str | None = Field(
        None, description="path of the greatest value that each cell meets, like file, if values are means (plane maps)"
    )


class LatticeTable(Table):
    """The lattice of graph solvers."""

    resolution: int | Annotated[list[int], Field(min_length=2, max_length=2)] = Field(
        default=20, description="points a side"
    )
    kind: LatticeKind = "closed"

    def build(self, bounds: Bounds) -> Lattice:
        """Return the lattice over the bounds."""
        given = self.resolution
        return Lattice((given[0], given[1]) if isinstance(given, list) else given, bounds=bounds, kind=self.kind)


class MapTable(Table):
    """The map in a file."""

    title: str = ""
    notes: str = ""
    coordinates: Literal["plane", "lonlat"] = Field(
        "plane", description="lonlat: points are degrees, all lengths (spread, clear, …) are metres"
    )
    projection_origin: Pair | None = Field(
        default=None,
        description="longitude and latitude of the point that a map in metres is laid out around: of lonlat, default: "
        "the middle of the map or of its one path; of a plane, where on the Earth it is, if it is anywhere",
    )
    crs: str | None = Field(
        default=None,
        description="coordinate reference system of a plane map in metres: a code, as EPSG:32635, or WKT (default: "
        "that of its rasters, if they name one)",
    )
    bounds: Annotated[list[float], Field(min_length=4, max_length=4)] | None = Field(
        None,
        description="x_min, y_min, x_max, y_max (default: 0, 0, 1, 1, or the rasters'; of lonlat: around no-fly "
        "areas, threats and rasters)",
    )
    improper: bool = Field(default=False, description="allow peaks above 1, to study the effects")
    threats: list[ThreatTable] = Field(default_factory=list)
    random_threats: RandomThreatsTable | None = None
    rasters: list[RasterTable] = Field(default_factory=list)
    no_fly: NoFlyTable = Field(default_factory=NoFlyTable)
    lattice: LatticeTable = Field(default_factory=LatticeTable)

    def ends(self) -> list[tuple[str, Point]]:
        """Name all starts and goals that the file writes out, in its own coordinates."""
        return []

    def journey(self) -> tuple[Point, Point] | None:
        """Return start and goal of a file with one path to plan, in its own coordinates; else None."""
        return None

    def flight_times(self) -> tuple[datetime, datetime] | None:
        """Return the moment of time 0, and how long zones are followed as they close and open; None: they stay."""
        return None


@dataclass(frozen=True)
class MapBuilder:
    """
    Converter of a checked table to map units.

    Attributes
    ----------
    table
        The table.
    folder
        Where relative paths in it start.
    homes
        Places of take-off, in the file's coordinates; None for the start of a file with one path.

    Examples
    --------
    >>> MapBuilder(MapTable(), Path()).bounds
    (0.0, 0.0, 1.0, 1.0)
    """

    table: MapTable
    folder: Path
    homes: Sequence[Point] | None = None
    _read: dict[str, list[Area]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def is_plane(self) -> bool:
        """Whether the file's coordinates are map units."""
        return self.table.coordinates == "plane"

    @cached_property
    def box(self) -> Bounds:
        """
        The bounds in the file's own coordinates.

        Without bounds in the file, a map in degrees gets a box around its no-fly areas, threats and rasters, widened to
        starts and goals that are near.
        """
        given = self.table.bounds
        if self.is_plane:
            west, south, east, north = given or self._around_rasters() or (0.0, 0.0, 1.0, 1.0)
            return west, south, east, north
        areas = shapely.get_coordinates(self._own_shapes)
        if given is not None:
            box = box_of(given)
            self._check_threats(box)
            for name, place in self.table.ends():
                require_inside(name, place, box)
            return box
        if len(areas):
            self._check_threats(box_around(areas))
        threats = [places_around((one.x, one.y), SEEN * one.spread_of()) for one in self.table.threats]
        corners = [np.reshape(cells.degrees, (2, 2)) for cells in self.cells]
        points = np.concatenate([areas, *threats, *corners])
        if not len(points) and (self.table.no_fly.zones or self.table.no_fly.ground) and self.table.ends():
            return self._around_journey()
        if not len(points):
            msg = "there is nothing to lay bounds around; add bounds = [west, south, east, north], degrees"
            raise ValueError(msg)
        return widened(box_around(points), self.table.ends())

    def _around_journey(self) -> Bounds:
        """Return a box around all ends: every path at most 2.2 times as long as the way between them is inside."""
        ends = [place for _, place in self.table.ends()]
        far = max(NEAREST, *(geodesic_length(one, other) for one in ends for other in ends))
        return box_around(np.concatenate([places_around(place, far) for place in ends]))

    def _around_rasters(self) -> Bounds | None:
        """Return the box around all rasters of a map in the plane, if there are any."""
        if not self.cells:
            return None
        every = np.array([cells.bounds for cells in self.cells])
        west, south = every[:, :2].min(axis=0).tolist()
        east, north = every[:, 2:].max(axis=0).tolist()
        return west, south, east, north

    def _check_threats(self, box: Bounds) -> None:
        for number, one in enumerate(self.table.threats):
            require_unswapped(f"threats.{number}", (one.x, one.y), box, FELT * one.spread_of())

    @cached_property
    def projection(self) -> LocalProjection | None:
        """
        The projection of a lon/lat map; None for a map in the plane.

        Without an origin in the file, it is centred between start and goal of a single path, where it distorts that
        path least, and on the middle of the bounds for several paths.
        """
        if self.is_plane:
            return None
        # points outside the map are reported first
        box, journey = self.box, self.table.journey()
        if self.table.projection_origin is not None:
            return self._written_projection
        return LocalProjection.centred_on(bounds_of(box)) if journey is None else LocalProjection.between(*journey)

    @property
    def on_earth(self) -> LocalProjection | None:
        """The projection of longitude and latitude to map units; None if the map has no place on the Earth."""
        if not self.is_plane:
            return self.projection
        if self.system is None:
            return self._written_projection
        if self.table.projection_origin is not None:
            msg = f"projection_origin and the system ({self.system.name}) both say where the map is; leave out one"
            raise ValueError(msg)
        return CrsPlane.over(self.system, self.bounds)

    @cached_property
    def system(self) -> CoordinateSystem | None:
        """
        The coordinate reference system of a map in the plane: that of the file, or of its rasters; None if none is.

        Raises
        ------
        ValueError
            If they differ.
        """
        if not self.is_plane:
            if self.table.crs is not None:
                msg = 'crs is for maps in the plane; leave it out, or coordinates = "lonlat"'
                raise ValueError(msg)
            return None
        named = [(f"rasters.{number}", cells.system) for number, cells in enumerate(self.cells)]
        if self.table.crs is not None:
            named.insert(0, ("crs", CoordinateSystem.of_code(self.table.crs, self.box)))
        known = [(name, system) for name, system in named if system is not None]
        for name, system in known[1:]:
            if not system.is_same(known[0][1], self.box):
                msg = (
                    f"{known[0][0]} is in {known[0][1].name}, and {name} in {system.name}; warp one of them (gdalwarp "
                    '-t_srs), or lay the map in degrees (coordinates = "lonlat")'
                )
                raise ValueError(msg)
        return known[0][1] if known else None

    @cached_property
    def _written_projection(self) -> LocalProjection | None:
        """The projection around the origin in the file; None if it gives none."""
        given = self.table.projection_origin
        if given is None:
            return None
        with scenario_errors("projection_origin"):
            return LocalProjection(*given)

    def point(self, pair: list[float]) -> Point:
        """Return a point in map units."""
        x, y = pair
        if self.projection is None:
            return x, y
        east, north = self.projection.forward((x, y)).tolist()
        return east, north

    def end(self, name: str, pair: list[float]) -> Point:
        """Return a start or goal in map units, checked in the file's own units."""
        if not self.is_plane:
            require_inside(name, (pair[0], pair[1]), self.box)
        if self.terrain is not None:
            self.terrain.require_above(name, (pair[0], pair[1]), self.point(pair))
        return self.point(pair)

    @cached_property
    def bounds(self) -> Bounds:
        """The bounds in map units: for lon/lat, the least box around them."""
        return self.box if self.projection is None else projected_bounds(self.box, self.projection)

    def shapes(self, rings: Mapping[str, list[list[float]]], files: Sequence[str], key: str) -> list[BaseGeometry]:
        """Return polygons of rings, by their keys, and of GeoJSON files, unprojected; `key` is the key of the files."""
        areas: list[BaseGeometry] = [drawn_area(at, ring, lonlat=not self.is_plane) for at, ring in rings.items()]
        for name in files:
            if self.is_plane:
                msg = f'{key} {shown(name)} holds longitudes and latitudes; set coordinates = "lonlat"'
                raise ValueError(msg)
            areas += [area.polygon for area in self._areas_in(name)]
        return areas

    def _areas_in(self, name: str) -> list[Area]:
        """Read the areas of a GeoJSON file, once."""
        if name not in self._read:
            self._read[name] = read_areas(self.folder / name)
        return self._read[name]

    def require_outside(self, name: str, pair: Point, clearance: float) -> None:
        """
        Check that a start or goal keeps the clearance from every area; the message repeats the values as written.

        Raises
        ------
        ProblemError
            If it does not; the message names the area.
        """
        here = shapely.Point(self.point(list(pair)))
        unit = "" if self.is_plane else " m"
        # (areas come first, as errors in their files are raised there)
        for number, (shape, area) in enumerate(zip(self.projected_no_fly, self._places_of_areas(), strict=True)):
            if self._is_closed_by_border(number, pair, (here.x, here.y)):
                raise ProblemError(on_closed_border(name, tuple(pair), f"the no-fly area {area}"))
            if shapely.contains_properly(shape, here):
                msg = f"{name} {tuple(pair)} is inside the no-fly area {area}; move it to its boundary or outside"
                raise ProblemError(msg)
            away = float(shapely.distance(shape, here))
            if away < clearance - self._rounding:
                msg = (
                    f"{name} {tuple(pair)} is {away:.6g}{unit} from the no-fly area {area}, and the clearance is "
                    f"{clearance:g}{unit}; move it, or lower the clearance"
                )
                raise ProblemError(msg)
        self.require_column(name, (here.x, here.y), clearance, pair)

    def _is_closed_by_border(self, number: int, pair: Point, place: Point) -> bool:
        """Return whether a place is closed only because an area meets the border of the map there."""
        closed = self.projected_no_fly[number]
        if self.is_plane:
            joined = closed_area(closed, self.bounds)
            if joined is closed:
                return False
            return bool(NoFlyArea(joined).contains(place)) and not NoFlyArea(closed).contains(place)
        zones = [] if self.zones is None else [one.area for one in self.zones.applied.closed if one.area is not None]
        given_areas = [*self._own_shapes, *zones]
        return number < len(given_areas) and is_closed_by_border(given_areas[number], closed, pair, place)

    def require_column(self, name: str, place: Point, clearance: float, written: Point | None = None) -> None:
        """
        Check that a flight can take off or land at a place, in map units and as `written`, through all zones below it.

        Raises
        ------
        ProblemError
            If it cannot; the message names the zone and its layer.
        """
        columns = None if self.zones is None else self.zones.columns
        if columns is None:
            return
        if wrong := columns.fault(name, place, clearance, written=written, closed=self._closed):
            raise ProblemError(wrong)

    @cached_property
    def _closed(self) -> BaseGeometry | None:
        return self.no_fly()

    @property
    def _rounding(self) -> float:
        """Rounding error of a distance, map units: an end may be nearer to an area than the clearance by this."""
        x_min, y_min, x_max, y_max = self.bounds
        return ROUNDING * max(x_max - x_min, y_max - y_min)

    def areas(
        self, rings: Mapping[str, list[list[float]]], files: Sequence[str] = (), key: str = "geojson"
    ) -> list[BaseGeometry]:
        """Return polygons as `shapes` does, in map units."""
        return self._projected(self.shapes(rings, files, key))

    def _projected(self, shapes: list[BaseGeometry]) -> list[BaseGeometry]:
        projection = self.projection
        return shapes if projection is None else [project_on_map(shape, self.box, projection) for shape in shapes]

    @cached_property
    def _own_shapes(self) -> list[BaseGeometry]:
        """All no-fly areas but zones, in the file's own coordinates."""
        given = self.table.no_fly
        rings = self.shapes({f"no_fly.polygons.{number}": ring for number, ring in enumerate(given.polygons)}, [], "")
        areas = [
            drawn_area(f"no_fly.areas.{number}", area.outline, area.holes, lonlat=not self.is_plane)
            for number, area in enumerate(given.areas)
        ]
        return [*rings, *areas, *self.shapes({}, given.geojson, "no_fly.geojson")]

    @cached_property
    def no_fly_names(self) -> list[str]:
        """The name of each no-fly area: its key in this file, or its name in its own file."""
        given = self.table.no_fly
        written = [f"no_fly.polygons.{number}" for number in range(len(given.polygons))]
        written += [area.name or f"no_fly.areas.{number}" for number, area in enumerate(given.areas)]
        zones = [] if self.zones is None else [one.zone.label for one in self.zones.applied.closed]
        named = [area.name for name in given.geojson for area in self._areas_in(name)]
        return [*written, *named, *zones, *[TERRAIN for _ in self._terrain_shapes]]

    def _places_of_areas(self) -> list[str]:
        """Return the name of each no-fly area for messages, with the file that it is in, if that is another one."""
        given = self.table.no_fly
        files = [""] * (len(given.polygons) + len(given.areas))
        files += [name for name in given.geojson for _ in self._areas_in(name)]
        files += [] if self.zones is None else [one.zone.file for one in self.zones.applied.closed]
        files += [given.ground or "" for _ in self._terrain_shapes]
        # (names of folders tell files of the same name apart)
        paths = {Path(file).name: set[Path]() for file in files}
        for file in files:
            paths[Path(file).name].add((self.folder / file).absolute())
        short = {file: Path(file).name if len(paths[Path(file).name]) == 1 else file for file in files}
        named = zip(map(shown, self.no_fly_names), files, strict=True)
        return [f"{area} of {short[file]}" if file else area for area, file in named]

    @cached_property
    def zones(self) -> MapZones | None:
        """
        The verdict on each zone on this map; None if there are no files of zones.

        Raises
        ------
        FileFormatError
            If one of them cannot be read, or their settings are malformed.
        """
        given = self.table.no_fly
        if not given.zones:
            return None
        if self.is_plane:
            msg = f'no_fly.zones {shown(given.zones[0])} holds longitudes and latitudes; set coordinates = "lonlat"'
            raise ValueError(msg)
        projection, clearance = self.projection, getattr(self.table, "clearance", 0.0)
        assert projection is not None  # noqa: S101 - it is a map in degrees
        times, changing = self.table.flight_times(), list[TimedArea]()
        of_all_times = given if times is None else given.model_copy(update={"at": None})
        applied = applied_zones(of_all_times, self.folder).within(seen_box(projection, self.bounds, clearance))
        if times is not None:
            applied, changing = timed_areas(applied, projection, since=times[0], until=times[1])
        ends = [self.point(list(place)) for _, place in self.table.ends()]
        return replace(MapZones.of(applied, projection, self.box, ends, clearance), changing=changing)

    @property
    def area_records(self) -> list[ZoneRecord]:
        """The records of the no-fly areas that are no zones: they are closed at all heights and times."""
        given = self.table.no_fly
        found = [area_record(name) for name in self.no_fly_names[: len(given.polygons) + len(given.areas)]]
        for file, area in ((str(self.folder / name), one) for name in given.geojson for one in self._areas_in(name)):
            found.append(area_record(area.name, area.identifier, area.kind, file))
        x_min, y_min, x_max, y_max = self.bounds
        box = shapely.box(x_min, y_min, x_max, y_max)
        here = shapely.intersects(np.array(self.projected_no_fly[: len(found)], dtype=object), box)
        return [
            one if is_here else replace(one, state="left out", reason=OUTSIDE)
            for one, is_here in zip(found, here.tolist(), strict=True)
        ]

    @property
    def named_areas(self) -> list[tuple[str, BaseGeometry]]:
        """The no-fly areas that have a name in this file or in their own, map units."""
        given = zip(self.no_fly_names, self.projected_no_fly, strict=True)
        unnamed = re.compile(r"no_fly\.(polygons|areas)\.\d+|area \d+")
        named = {area.name for area in self.table.no_fly.areas if area.name}
        return [(name, shape) for name, shape in given if name in named or not unnamed.fullmatch(name)]

    @cached_property
    def projected_no_fly(self) -> list[BaseGeometry]:
        """All no-fly areas in map units; zones of very many corners are simplified to areas that contain them."""
        areas = self._projected(self._own_shapes)
        return [*areas, *([] if self.zones is None else self.zones.areas), *self._terrain_shapes]

    @property
    def _terrain_shapes(self) -> list[BaseGeometry]:
        return [] if self.terrain is None or self.terrain.shape is None else [self.terrain.shape]

    @cached_property
    def terrain(self) -> MapTerrain | None:
        """
        The terrain on this map; None without a raster of elevations.

        Raises
        ------
        ProblemError
            If a setting of it is malformed, or makes no sense without another one.
        FileFormatError
            If the raster cannot be read.
        """
        given, projection = self.table.no_fly, self.projection
        if projection is None:
            if given.ground is not None:
                msg = f'no_fly.ground {shown(given.ground)} holds longitudes and latitudes; set coordinates = "lonlat"'
                raise ValueError(msg)
            return None
        journey = self.table.journey()
        homes = self.homes if self.homes is not None or journey is None else journey[:1]
        ends = [self.point(list(place)) for _, place in self.table.ends()]
        clearance = getattr(self.table, "clearance", 0.0)
        return MapTerrain.of(given, self.folder, projection, self.box, ends, homes, clearance)

    def no_fly(self) -> BaseGeometry | None:
        """Return all no-fly areas in map units."""
        areas = self.projected_no_fly
        return shapely.GeometryCollection(areas) if areas else None

    @cached_property
    def cells(self) -> list[RasterCells]:
        """The rasters' cells, in the file's own coordinates."""
        found = []
        for number, entry in enumerate(self.table.rasters):
            given = entry.bounds
            box: Bounds | None = None if given is None else (given[0], given[1], given[2], given[3])
            with scenario_errors(f"rasters.{number}"):
                cells = read_cells(
                    self.folder / entry.file,
                    most=MOST_CELLS,
                    bounds=box,
                    coordinates=self.table.coordinates,
                    is_default="coordinates" not in self.table.model_fields_set,
                    origin=entry.origin,
                )
            found.append(cells)
        return found

    def rasters(self) -> list[RasterRisk]:
        """
        Return the rasters in map units.

        Raises
        ------
        ScenarioError
            If a file cannot be read, is malformed, or lies outside the bounds.
        """
        return [self._raster(number, entry) for number, entry in enumerate(self.table.rasters)]

    def _raster(self, number: int, entry: RasterTable) -> RasterRisk:
        """Return one raster in map units."""
        file = self.folder / entry.file
        with scenario_errors(f"rasters.{number}"):
            laid = cells_in_metres(self.cells[number], kind=entry.kind, nodata=entry.nodata, projection=self.projection)
            raster = laid_out(
                laid,
                entry.kind,
                entry.nodata,
                unit=entry.unit,
                interpolation=entry.interpolation,
                scale=entry.scale,
            )
            if entry.covers is not None or entry.peaks is not None:
                raster = self._with_origins(raster, entry)
            if entry.ground_risk is not None:
                raster = raster.flown_over_by(entry.ground_risk.build())
        west, south, east, north = self.bounds
        x_min, y_min, x_max, y_max = raster.bounds
        if x_max <= west or east <= x_min or y_max <= south or north <= y_min:
            own = self.cells[number].bounds if self.is_plane else self.cells[number].degrees
            msg = f"rasters.{number}: {file} lies at {own}, outside the bounds {self.box}; correct either"
            raise ScenarioError(msg)
        return raster

    def _with_origins(self, raster: RasterRisk, entry: RasterTable) -> RasterRisk:
        """Return a raster with the metadata of its file."""
        if not self.is_plane:
            msg = "covers and peaks are for maps in the plane, as cg.write_scenario writes them; leave them out"
            raise ValueError(msg)
        try:
            covers = None if entry.covers is None else shapely.from_wkt(entry.covers)
        except shapely.errors.GEOSException as error:
            msg = f"covers is {shown(entry.covers)}, which is no WKT of an area; leave it out, or write the file again"
            raise ValueError(msg) from error
        peaks = None
        if entry.peaks is not None:
            file = self.folder / entry.peaks
            peaks = read_cells(file, most=MOST_CELLS, bounds=raster.bounds, origin=entry.origin).values
        return RasterRisk(raster.values, raster.bounds, **{**raster.settings, "covers": covers, "peaks": peaks})

    def threats(self) -> list[Threat]:
        """Return the threats in map units: those in the file, then the random ones."""
        return [entry.build(*self.point([entry.x, entry.y])) for entry in [*self.table.threats, *self.drawn()]]

    def drawn(self) -> list[ThreatTable]:
        """
        Draw the random threats, in the file's own coordinates, clear of all starts and goals in it.

        On a map in degrees they are drawn around the middle of the bounds, so that other ends do not move them.
        """
        random, bounds = self.table.random_threats, self.box
        if random is None:
            return []
        ends = [place for _, place in self.table.ends()]
        if self.is_plane:
            threats = random.build(bounds, ends)
            places = [(threat.x, threat.y) for threat in threats]
        else:
            plane = LocalProjection.centred_on(bounds_of(bounds))
            threats = random.build(projected_bounds(bounds, plane), [(x, y) for x, y in map(plane.forward, ends)])
            places = [(x, y) for x, y in plane.inverse([(threat.x, threat.y) for threat in threats]).tolist()]
        return [
            ThreatTable.model_validate({"x": x, "y": y, "spread": threat.spread, "peak": threat.peak})
            for (x, y), threat in zip(places, threats, strict=True)
        ]

    def lattice(self) -> Lattice:
        """Return the lattice."""
        return self.table.lattice.build(self.bounds)


AnyTable = TypeVar("AnyTable", bound=Table)


def read_table(text: str, kind: type[AnyTable], *, place: str, command: str) -> AnyTable:
    r"""
    Read a TOML text into its table.

    Parameters
    ----------
    text
        The text.
    kind
        The table of the whole file.
    place
        The name of the file in error messages.
    command
        The command that prints the schema of such files.

    Raises
    ------
    ScenarioError
        If the text is no TOML, a key is unknown or missing, or a value has the wrong type; the message names the
        key's path, the value and the remedy.

    Examples
    --------
    >>> read_table("kind = 'upper'", LatticeTable, place="mine.toml", command="cgla scenarios --schema").resolution
    20
    """
    try:
        document = tomllib.loads(text, parse_float=parse_float)
    except (ValueError, RecursionError) as error:
        msg = f"{place}: not TOML that can be read: {error}"
        raise ScenarioError(msg) from error
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        msg = f"{place}: {faults(error, kind, command)}"
        raise ScenarioError(msg) from error

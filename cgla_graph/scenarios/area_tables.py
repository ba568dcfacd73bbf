"""No-fly areas in TOML files: polygons, GeoJSON files, and zones projected onto the plane of the map."""

import os
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, cast

import numpy as np
import shapely
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import shown
from cgla_graph._types import BoolArray, Bounds, Point
from cgla_graph.airspace.zones.account import ZoneAccount, ZoneRecord
from cgla_graph.airspace.zones.applying import Applied
from cgla_graph.airspace.zones.columns import Columns
from cgla_graph.airspace.zones.ground import read_ground
from cgla_graph.airspace.zones.heights import Altitude
from cgla_graph.airspace.zones.reading import is_geojson, read_zones
from cgla_graph.airspace.zones.rings import directed_rings
from cgla_graph.airspace.zones.shapes import AreaShape, with_fewer_corners
from cgla_graph.airspace.zones.zone import GROUND, UNLIMITED, Limits
from cgla_graph.errors import FileFormatError
from cgla_graph.model.earth import LocalProjection, project_on_map, projected_bounds, require_degrees
from cgla_graph.model.no_fly import require_valid
from cgla_graph.scenarios.table_faults import faults
from cgla_graph.timed.timed_area import TimedArea

#: Settings of terrain, which count without zones.
OF_TERRAIN = ("altitude", "ground", "terrain_clearance", "terrain_altitude")
#: Margin around a map in which zones count, relative to its longer side; latitude above which every meridian may be
#: near.
SEEN_MARGIN, MOST_LATITUDE = 0.02, 85.0
#: Corners of a simplified zone, about, and how far it may reach beyond the zone, relative to the map's longer side.
MOST_CORNERS, MOST_BEYOND = 1000, 0.002


def _one_line(text: str) -> str:
    """Refuse line ends and control characters, which could steer a terminal."""
    if any(unicodedata.category(letter) in _CONTROL for letter in text):
        msg = "give one line, without line ends and control characters"
        raise ValueError(msg)
    return text


#: Categories of Unicode: control characters, and ends of lines and paragraphs.
_CONTROL = ("Cc", "Zl", "Zp")
Line: TypeAlias = Annotated[str, AfterValidator(_one_line)]


class Table(BaseModel):
    """A table of a file: no unknown keys, no conversion of types, no infinite numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def is_table(value: object) -> str:
    """Choose the member of a union of a table and a plain value, so that only its own faults are reported."""
    return "=table" if isinstance(value, dict | Table) else "=plain"


Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
Ring = Annotated[list[Pair], Field(min_length=3)]


class AreaTable(Table):
    """A no-fly area that has a name, or holes."""

    name: str = Field(default="", description="its name in pictures and messages")
    outline: Ring = Field(description="ring of corners, closed or not")
    holes: list[Ring] = Field(default_factory=list, description="rings of corners inside, where one may fly")


def _flown(altitude: float | str) -> float | str:
    """Check an altitude, also where there are no zones."""
    Altitude.of(altitude)
    return altitude


class NoFlyTable(Table):
    """No-fly areas: polygons written here, and files beside this one: GeoJSON, or zones that authorities publish."""

    polygons: list[Ring] = Field(default_factory=list, description="rings of corners, closed or not")
    areas: list[AreaTable] = Field(default_factory=list, description="polygons with names, or with holes")
    geojson: list[str] = Field(default_factory=list, description="paths of GeoJSON files (lon/lat), from this file")
    zones: list[str] = Field(
        default_factory=list,
        description="paths of files of zones (lon/lat), from this file: ED-269, ED-318, KML, KMZ, GeoJSON",
    )
    altitude: Annotated[float | str, AfterValidator(_flown)] | None = Field(
        default=None,
        description="of the flight, metres above ground, or as '450 AMSL': which layers of zones count (default: all)",
    )
    at: datetime | str | None = Field(
        default=None, description="when the flight is, with its zone: which zones apply (default: all)"
    )
    treat: dict[str, Literal["closed", "open"]] = Field(
        default_factory=dict, description="which kinds of zones are closed and which open, as REQ_AUTHORISATION"
    )
    lines: Literal["closed", "open"] = Field(
        default="open", description="whether the insides of closed lines in files of zones are closed"
    )
    vertical_clearance: float = Field(
        default=0.0, ge=0, description="metres by which floors and ceilings of zones are widened"
    )
    ground: str | None = Field(
        default=None,
        description="path of a raster of elevations (lon/lat): terrain is closed, and heights above ground and sea "
        "are compared",
    )
    terrain_clearance: float | None = Field(
        default=None, ge=0, description="least height above the ground, metres (default: 30); with ground and altitude"
    )
    terrain_altitude: float | str | None = Field(
        default=None, description="of the flight above terrain, as altitude is written (default: altitude)"
    )


def drawn_area(name: str, outline: Sequence[Sequence[float]], holes: Sequence[Any] = (), *, lonlat: bool) -> Polygon:
    """
    Return the polygon of rings that are written in a file.

    In degrees, each edge takes the shorter way around the Earth, so that a ring may cross the antimeridian.

    Parameters
    ----------
    name
        The key of the area, for messages.
    outline, holes
        Rings of corners, closed or not.
    lonlat
        Whether the corners are degrees.

    Raises
    ------
    ProblemError, FileFormatError
        If a corner is out of range, or the polygon is invalid: a ring crosses itself or encloses nothing.

    Examples
    --------
    >>> drawn_area("no_fly.polygons.0", [[179, 0], [-179, 0], [-179, 1]], lonlat=True).bounds
    (179.0, 0.0, 181.0, 1.0)
    """
    rings = [np.array([*ring, *ring[: int(ring[0] != ring[-1])]], dtype=np.float64) for ring in (outline, *holes)]
    if lonlat:
        for ring in rings:
            require_degrees(name, ring)
        rings = directed_rings(rings, name)
    polygon = Polygon(rings[0], rings[1:])
    require_valid(name, polygon)
    return polygon


def applied_zones(table: NoFlyTable, folder: Path) -> Applied:
    """
    Read the zone files of a table and find which zones are closed at its altitude and time.

    Raises
    ------
    FileFormatError
        If a file cannot be read, or altitude, time or a kind of zone is malformed.
    """
    ground = None if table.ground is None else read_ground(folder / table.ground)
    zones = read_zones([folder / name for name in table.zones])
    return zones.apply(
        altitude=table.altitude,
        at=table.at,
        treat=table.treat,
        ground=ground,
        lines=table.lines,
        vertical_clearance=table.vertical_clearance,
    )


def with_files(table: NoFlyTable, files: Sequence[str | Path], settings: Mapping[str, object]) -> NoFlyTable:
    """
    Add files of areas, and settings of zones, to a table.

    Parameters
    ----------
    table
        The table; it stays as it is.
    files
        GeoJSON files, or files of zones; if any of them is of zones or has lines, all count as zones.
    settings
        Values of other keys, which replace those of the table.

    Raises
    ------
    FileFormatError
        If a file cannot be read, or a setting is not valid.
    """
    allowed = [name for name in NoFlyTable.model_fields if name not in {"polygons", "areas", "geojson", "zones"}]
    for key in settings:
        if key not in allowed:
            msg = f"zones have no setting {shown(key)}; give some of {', '.join(allowed)}"
            raise FileFormatError(msg)
    paths = [str(Path(file).absolute()) for file in files]
    if isinstance(ground := settings.get("ground"), str | os.PathLike):
        settings = {**settings, "ground": str(Path(ground).absolute())}
    kept = table.model_dump(exclude_unset=True)
    # (missing files and invalid names are reported when they are read)
    if not table.zones and all(not os.path.isfile(path) or is_geojson(path) for path in paths):  # noqa: PTH113
        changes = {"geojson": [*table.geojson, *paths]}
    else:
        changes = {"geojson": [], "zones": [*table.geojson, *table.zones, *paths]} if paths else {}
    try:
        return NoFlyTable.model_validate({**kept, **changes, **settings})
    except ValidationError as error:
        raise FileFormatError(faults(error, NoFlyTable)) from error


def area_record(name: str, identifier: str = "", kind: str = "", file: str = "") -> ZoneRecord:
    """
    Return the record of a no-fly area that is no zone: it is closed at all heights and times.

    Examples
    --------
    >>> area_record("harbour", "FI-7", "danger area", "areas.geojson").label
    'FI-7 (harbour)'
    """
    label = (identifier, name) if identifier else (name, "")
    limits = str(Limits(GROUND, UNLIMITED))
    return ZoneRecord(file, *label, kind or "UNCLASSIFIED", "closed", "UNCLASSIFIED", limits)


@dataclass(frozen=True)
class MapZones:
    """
    Zones on a map.

    Attributes
    ----------
    applied
        The verdict on each zone, its shape cut to the surroundings of the map.
    areas
        The closed zones, metres; one of very many corners is replaced by an area of fewer corners that contains it.
    beyond
        How far each of these replacements reaches beyond its zone, metres.
    columns
        The layers that count only where a flight takes off or lands; None at all heights.
    changing
        Zones that close and open while the flight is under way, metres and seconds.
    """

    applied: Applied
    areas: Sequence[BaseGeometry]
    beyond: Sequence[float]
    columns: Columns | None = None
    changing: Sequence[TimedArea] = ()

    @classmethod
    def of(
        cls, applied: Applied, projection: LocalProjection, box: Bounds, ends: Sequence[Point], clearance: float
    ) -> "MapZones":
        """
        Project zones onto the plane of a map.

        Parameters
        ----------
        applied
            The verdict on each zone.
        projection
            The projection of the map.
        box
            The bounds of the map, degrees.
        ends
            Starts and goals, metres: one that keeps the clearance from a zone keeps it from the simplified zone.
        clearance
            How far paths have to stay from zones, metres.
        """
        bounds = projected_bounds(box, projection)
        closed = [project_on_map(one.area, box, projection) for one in applied.closed if one.area is not None]
        simple = [simplified(cast("AreaShape", area), bounds, ends, clearance) for area in closed]
        beyond = [far for _, far in simple if far]
        return cls(applied, [area for area, _ in simple], beyond, applied.columns(projection))

    def account(self) -> ZoneAccount:
        """Return the account of each zone, and the simplifications made."""
        account = self.applied.account()
        if not self.beyond:
            return account
        few = f"{len(self.beyond)} outline{'s' * (len(self.beyond) > 1)} of more than {MOST_CORNERS} corners"
        remark = f"{few}: simplified, and up to {max(self.beyond):g} m beyond what the files say"
        return replace(account, remarks=(*account.remarks, remark))


def simplified(area: AreaShape, bounds: Bounds, ends: Sequence[Point], clearance: float) -> tuple[BaseGeometry, float]:
    """Return an area with few corners, unless that closes an end, and how far it reaches beyond the area, metres."""
    reach = MOST_BEYOND * max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    fewer, beyond = with_fewer_corners(area, MOST_CORNERS, reach)
    places = shapely.points(np.reshape(np.array(ends, dtype=np.float64), (-1, 2)))

    def closed(shape: BaseGeometry) -> BoolArray:
        return np.asarray((shapely.distance(shape, places) < clearance) | shapely.contains_properly(shape, places))

    return (fewer, beyond) if beyond and np.array_equal(closed(fewer), closed(area)) else (area, 0.0)


def seen_box(projection: LocalProjection, bounds: Bounds, clearance: float) -> Bounds:
    """
    Return a box in degrees around the bounds on a plane, widened by the margin and the clearance.

    Examples
    --------
    >>> box = seen_box(LocalProjection(25.0, 60.0), (-1000.0, -1000.0, 1000.0, 1000.0), 0.0)
    >>> [round(side, 3) for side in box]
    [24.981, 59.991, 25.019, 60.009]
    """
    x_min, y_min, x_max, y_max = bounds
    margin = SEEN_MARGIN * max(x_max - x_min, y_max - y_min) + clearance
    corners = shapely.box(x_min - margin, y_min - margin, x_max + margin, y_max + margin)
    rim = shapely.get_coordinates(shapely.segmentize(corners.exterior, 0.01 * corners.length))
    reach = float(np.hypot(rim[:, 0], rim[:, 1]).max())
    if abs(projection.latitude) + reach / 110_000.0 >= MOST_LATITUDE:
        # a pole may be inside, and all meridians
        return projection.longitude - 180.0, -90.0, projection.longitude + 180.0, 90.0
    degrees = projection.inverse(rim)
    degrees[:, 0] += 360.0 * np.round((projection.longitude - degrees[:, 0]) / 360.0)
    (west, south), (east, north) = degrees.min(axis=0).tolist(), degrees.max(axis=0).tolist()
    return west, south, east, north


def ends_of(uavs: Iterable[Any]) -> list[tuple[str, Point]]:
    """Name the starts and goals of tables of UAVs."""
    return [
        (f"uavs.{number}.{name}", (x, y))
        for number, uav in enumerate(uavs)
        for name, (x, y) in (("start", uav.start), ("goal", uav.goal))
    ]

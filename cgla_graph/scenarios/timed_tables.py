"""Keys of scenario files in which the map changes in time."""

from datetime import datetime, timedelta
from typing import Annotated, Any, Literal, TypeAlias

import shapely
from pydantic import Discriminator, Field, Tag

from cgla_graph._text import shown
from cgla_graph._types import Point
from cgla_graph.airspace.zones.applying import moment_of_zones
from cgla_graph.airspace.zones.timed_zones import LONGEST
from cgla_graph.errors import ProblemError
from cgla_graph.model.risk import RiskField
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.scenarios.area_tables import Line, Pair, Ring, Table, is_table
from cgla_graph.scenarios.map_tables import MapBuilder, MapTable, RasterTable, ThreatTable
from cgla_graph.scenarios.text_files import scenario_errors
from cgla_graph.timed.moving import MovingThreat
from cgla_graph.timed.timed_area import TimedArea
from cgla_graph.timed.wind import Wind

Numbers: TypeAlias = Annotated[list[float], Field(min_length=1)]
Rows: TypeAlias = Annotated[list[Annotated[list[float], Field(min_length=3, max_length=3)]], Field(min_length=1)]


class MovingTable(Table):
    """A threat that moves along a track."""

    track: Rows = Field(
        description="rows [time, x, y], times increasing: straight on between them, at rest before and after"
    )
    spread: float | Numbers = Field(description="standard deviation, map units: a number, or one for each row")
    peak: float | Numbers = Field(
        default=1.0, description="risk per unit length at the centre: a number, or one for each row"
    )

    def build(self, ground: MapBuilder) -> MovingThreat:
        """Return the threat in map units."""
        return MovingThreat(_placed(self.track, ground), self.spread, self.peak)


class OtherTable(Table):
    """Another aircraft, to keep away from."""

    track: Rows = Field(
        description="rows [time, x, y], times increasing: straight on between them, gone before and after"
    )

    def build(self, ground: MapBuilder) -> Trajectory:
        """Return its flight in map units."""
        rows = _placed(self.track, ground)
        return Trajectory([row[0] for row in rows], [row[1:] for row in rows])


def _placed(track: Rows, ground: MapBuilder) -> list[tuple[float, float, float]]:
    return [(time, *ground.point([x, y])) for time, x, y in track]


class ClosingTable(Table):
    """A no-fly area that closes or opens: a polygon in this file, or a GeoJSON file beside it."""

    polygon: Ring | None = Field(default=None, description="corners, closed or not")
    geojson: str | None = Field(default=None, description="path of a GeoJSON file (lon/lat), from this file")
    appears: float = Field(default=0.0, description="when it closes")
    vanishes: float | None = Field(default=None, description="when it opens again (default: never)")

    def build(self, ground: MapBuilder) -> TimedArea:
        """Return the area in map units."""
        if (self.polygon is None) == (self.geojson is None):
            msg = "an area needs either polygon or geojson"
            raise ProblemError(msg)
        rings = {} if self.polygon is None else {"polygon": self.polygon}
        areas = ground.areas(rings, [] if self.geojson is None else [self.geojson])
        whole = areas[0] if len(areas) == 1 else shapely.GeometryCollection(areas)
        return TimedArea(whole, self.appears, self.vanishes)


class HourTable(Table):
    """The risk that stands still, from a time on: it replaces that of the file."""

    since: float = Field(description="the time from which it counts")
    threats: list[ThreatTable] = Field(default_factory=list)
    rasters: list[RasterTable] = Field(default_factory=list)

    def build(self, ground: MapBuilder) -> tuple[float, RiskField]:
        """Return the time and the field."""
        changes = {"threats": self.threats, "rasters": self.rasters, "random_threats": None, "bounds": list(ground.box)}
        there = MapBuilder(ground.table.model_copy(update=changes), ground.folder, ground.homes)
        return self.since, RiskField(there.threats(), rasters=there.rasters())


class WindTable(Table):
    """Wind at nodes from border to border of the map: rows from south to north, for each time."""

    u: list[list[Numbers]] = Field(description="where the air goes, to the east: of each time, rows of numbers")
    v: list[list[Numbers]] = Field(description="the same to the north")
    times: Numbers | None = Field(
        default=None, description="the times, increasing (default: there is one grid, for all times)"
    )


class TeamTable(Table):
    """A UAV of a team."""

    name: Line = Field(min_length=1)
    start: Pair
    goal: Pair
    speed: float | None = Field(default=None, gt=0, description="its airspeed (default: that of the file)")
    departure: float | Pair | None = Field(
        default=None, description="when it departs: a time, or the first and last of a window (default: as the file)"
    )


class TimedTable(MapTable):
    """A map that may change in time; times are in any unit, the speed is in map units for each of these."""

    speed: float | None = Field(
        default=None, gt=0, description="airspeed, map units per unit of time (metres on lonlat)"
    )
    departure: float | Pair = Field(
        default=0.0, description="when the path begins: a time, or the first and last of a window"
    )
    waiting: float | None = Field(
        default=None, gt=0, description="price of a unit of time spent waiting (default: no waiting)"
    )
    latest: float | None = Field(default=None, description="the latest arrival (default: any)")
    wind: (
        Annotated[Annotated[Pair, Tag("=plain")] | Annotated[WindTable, Tag("=table")], Discriminator(is_table)] | None
    ) = Field(default=None, description="where the air goes, [u, v], map units per unit of time")
    risk_per: Literal["ground", "time"] = Field(
        default="ground", description="risk is gathered over the ground, or over time"
    )
    moving: list[MovingTable] = Field(default_factory=list)
    timed_areas: list[ClosingTable] = Field(default_factory=list)
    hours: list[HourTable] = Field(default_factory=list)
    uavs: list[TeamTable] = Field(default_factory=list, description="a team, instead of start and goal")
    others: list[OtherTable] = Field(default_factory=list)
    separation: float | None = Field(
        default=None, gt=0, description="least distance between the UAVs of a team, and from others, map units"
    )

    def flight_times(self) -> tuple[datetime, datetime] | None:
        """Return the moment of time 0, that of the zones (`at`), and a day after the last departure, or the latest."""
        if self.speed is None or self.no_fly.at is None:
            return None
        since = moment_of_zones(self.no_fly.at)
        departures = [self.departure, *(uav.departure for uav in self.uavs if uav.departure is not None)]
        last = max(one[1] if isinstance(one, list) else one for one in departures)
        seconds = max(last, 0.0) + 86_400.0 if self.latest is None else max(self.latest, 1.0)
        return since, since + min(timedelta(seconds=min(seconds, 1e9)), LONGEST)


def settings_in_time(table: TimedTable, ground: MapBuilder) -> dict[str, Any]:
    """
    Return the settings of `TimedProblem` beyond those of a `Problem`; none if the file has no speed.

    Raises
    ------
    ValueError, CglaError
        If one of them is malformed, or needs a speed.
    """
    if table.speed is None:
        in_time = [key for key in TimedTable.model_fields if key not in MapTable.model_fields]
        given = next((key for key in in_time if key in table.model_fields_set), None)
        if given is not None:
            msg = f"{given} is there, but no speed; add speed = …, in map units per unit of time"
            raise ValueError(msg)
        return {}
    wind: Any = table.wind
    if isinstance(wind, WindTable):
        with scenario_errors("wind"):
            wind = Wind(wind.u, wind.v, ground.bounds, wind.times or [0.0])
    built: dict[str, list[Any]] = {"moving": [], "timed_areas": [], "hours": [], "others": []}
    for key, parts in built.items():
        for number, entry in enumerate(getattr(table, key)):
            with scenario_errors(f"{key}.{number}"):
                parts.append(entry.build(ground))
    return {
        "speed": table.speed,
        "moving": built["moving"],
        "areas": [*built["timed_areas"], *(() if ground.zones is None else ground.zones.changing)],
        "fields": built["hours"],
        "others": built["others"],
        "separation": table.separation or 0.0,
        "departure": _departure(table.departure),
        "wind": tuple(wind) if isinstance(wind, list) else wind,
        "waiting": table.waiting,
        "latest": table.latest,
        "risk_per": table.risk_per,
    }


def _departure(given: float | Pair) -> float | tuple[float, ...]:
    return tuple(given) if isinstance(given, list) else given


def team_of(table: TimedTable, ground: MapBuilder) -> dict[str, tuple[Point, Point, dict[str, Any]]]:
    """
    Return the start, the goal and the own settings of each UAV of a team, by its name; none without a team.

    Raises
    ------
    ValueError, CglaError
        If two have one name, an end is not on the map, or there is no separation.
    """
    team: dict[str, tuple[Point, Point, dict[str, Any]]] = {}
    if bool(table.uavs or table.others) != (table.separation is not None):
        msg = "separation is the least distance between uavs, and from others; give it with these, and not alone"
        raise ValueError(msg)
    for number, uav in enumerate(table.uavs):
        if uav.name in team:
            msg = f"uavs.{number}.name is {shown(uav.name)}, as another one's; give each its own"
            raise ValueError(msg)
        own: dict[str, Any] = {} if uav.speed is None else {"speed": uav.speed}
        own |= {} if uav.departure is None else {"departure": _departure(uav.departure)}
        start, goal = (ground.end(f"uavs.{number}.{end}", getattr(uav, end)) for end in ("start", "goal"))
        team[uav.name] = start, goal, own
    return team

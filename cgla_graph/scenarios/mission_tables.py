"""Tables of mission files."""

from collections.abc import Iterable
from math import dist
from typing import Annotated, Any, Literal, TypeAlias

import shapely
from pydantic import Discriminator, Field, Tag

from cgla_graph._types import Point
from cgla_graph.airspace.zones.columns import Columns
from cgla_graph.fusion.fusion import Fusion, Integral
from cgla_graph.mission.rules import Avoidance, Exclude, KnowledgeRule, Meeting, Movement, Replan, Start, Update
from cgla_graph.mission.uav import COLOUR
from cgla_graph.mission.virtual_obstacle import Placement, Zones
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.clearance import widened
from cgla_graph.scenarios.area_tables import Line, Pair, Ring, Table, ends_of, is_table
from cgla_graph.scenarios.drawing import MOST_MISSES, Stream
from cgla_graph.scenarios.map_tables import MapTable, ThreatTable
from cgla_graph.timed.timed_area import union_of

#: The solver of files that name none.
SOLVER = "cgla"


class UavSettings(Table):
    """Settings of UAVs: at the top of the file, of one UAV, or of all UAVs of a variant."""

    detection_radius: float | None = Field(None, gt=0, description="the paper's OR, map units")
    step: float | None = Field(None, gt=0, description="distance flown in a tick, map units (default: 0.4 units)")
    k: float | None = Field(None, ge=0, description="risk weight: cost = length + k * risk")
    safe_distance: float | None = Field(None, gt=0, description="the paper's SD, map units (default: half of OR)")

    def given(self) -> dict[str, Any]:
        """Return the settings that the file gives."""
        every = {name: getattr(self, name) for name in UavSettings.model_fields}
        return {name: value for name, value in every.items() if value is not None}


class UavTable(UavSettings):
    """One UAV."""

    name: Line = Field(min_length=1)
    start: Pair
    goal: Pair
    departs: int = Field(0, ge=0, description="tick of take-off")
    colour: str | None = Field(None, pattern=f"^{COLOUR}$", description='in pictures, as "#0072B2"')


class RandomUavsTable(Table):
    """UAVs drawn evenly over the bounds from a seed, with the settings at the top of the file."""

    count: int = Field(ge=1, le=1000)
    seed: int = Field(ge=0)
    least_length: float = Field(0.0, ge=0, description="least distance from start to goal, map units")
    clear: float = Field(
        0.0, ge=0, description="least distance of starts and goals from any threat's centre, map units"
    )
    apart: float | None = Field(
        None, ge=0, description="least distance between starts, and between goals, map units (default: safe_distance)"
    )
    prefix: Line = Field("u", min_length=1, description="names are the prefix and a number")

    def build(
        self,
        world: World,
        ends: Iterable[tuple[Point, Point]],
        safe_distance: float,
        clearance: float,
        columns: Columns | None = None,
    ) -> list[tuple[str, Point, Point]]:
        """
        Draw names, starts and goals: clear of threats, `clearance` away from all areas, apart from each other.

        Zones below the flight, in `columns`, count as areas, because it takes off and lands there. The places also stay
        apart from `ends`, the starts and goals of other UAVs: by `apart`, or else by `safe_distance`.
        """
        stream = Stream(self.seed)
        apart = safe_distance if self.apart is None else self.apart
        timed = [item.threat for item in world.timed if isinstance(item, TimedThreat)]
        centres = [(threat.x, threat.y) for threat in (*world.field.threats, *timed)]
        closed = union_of(world.no_fly, world.polygons.values())
        if closed is not None and clearance > 0.0:
            closed = widened(closed, clearance)
        x_min, y_min, x_max, y_max = world.bounds

        def is_free(spot: Point, others: Iterable[Point]) -> bool:
            return (
                all(dist(spot, centre) >= self.clear for centre in centres)
                and all(dist(spot, other) >= apart for other in others)
                and (closed is None or not bool(shapely.intersects_xy(closed, *spot)))
                and (columns is None or not columns.met(spot, clearance, closed=world.no_fly))
            )

        taken, misses = list(ends), 0
        drawn: list[tuple[str, Point, Point]] = []
        while len(drawn) < self.count:
            start, goal = ((stream.between(x_min, x_max), stream.between(y_min, y_max)) for _ in range(2))
            if (
                dist(start, goal) >= self.least_length
                and is_free(start, (other for other, _ in taken))
                and is_free(goal, (other for _, other in taken))
            ):
                taken.append((start, goal))
                drawn.append((f"{self.prefix}{len(drawn) + 1:0{len(str(self.count))}d}", start, goal))
                misses = 0
            elif (misses := misses + 1) > MOST_MISSES:
                msg = (
                    f"random_uavs: no room for UAV {len(drawn) + 1} of {self.count}; "
                    "lower least_length, clear or apart, or draw fewer"
                )
                raise ValueError(msg)
        return drawn


Tick: TypeAlias = Annotated[int, Field(ge=0)]
Move: TypeAlias = Annotated[list[int | float], Field(min_length=3, max_length=3)]


class TimedThreatTable(ThreatTable):
    """A threat that appears, moves or vanishes."""

    appears: Tick = Field(0, description="first tick when it is there")
    vanishes: Tick | None = Field(None, description="first tick when it is gone")
    moves: list[Move] = Field(default_factory=list, description="[tick, x, y]: from that tick on its centre is there")


class TimedAreaTable(Table):
    """A no-fly area that appears or vanishes: a polygon in this file, or a GeoJSON file beside it."""

    polygon: Ring | None = Field(None, description="corners, closed or not")
    geojson: str | None = Field(None, description="path of a GeoJSON file (lon/lat), from this file")
    appears: Tick = Field(0, description="first tick when it is there")
    vanishes: Tick | None = Field(None, description="first tick when it is gone")


class SharingTable(Table):
    """Radio range, delay and loss of messages between UAVs."""

    radius: float | None = Field(None, gt=0, description="radio range, map units (default: everybody hears everybody)")
    delay: int = Field(0, ge=0, description="ticks that a message takes")
    loss: float = Field(0.0, ge=0, lt=1, description="chance that a message is lost")
    seed: int = Field(0, ge=0, description="of the losses")


class VirtualObstacleTable(Table):
    """The two-zone rule of Section 5.2.1."""

    stepnum: int = Field(3, ge=0, description="steps of 0.4 units that the obstacle is ahead")
    spread: float | None = Field(None, gt=0, description="standard deviation, map units (default: 0.4 units)")
    peak: float = Field(1.0, gt=0, le=1, description="risk per unit length at its centre")
    placement: Placement = "replace"
    zones: Zones = "two"


class FlySettings(Table):
    """The settings of `Mission`, with the same defaults."""

    solver: str = Field(SOLVER, min_length=1, description="a solver, with settings as NAME:A=1:B=2")
    sharing: Annotated[
        Annotated[Literal["none", "global"], Tag("=plain")] | Annotated[SharingTable, Tag("=table")],
        Discriminator(is_table),
    ] = "global"
    virtual_obstacle: Annotated[
        Annotated[bool, Tag("=plain")] | Annotated[VirtualObstacleTable, Tag("=table")], Discriminator(is_table)
    ] = False
    avoidance: Avoidance = "none"
    fusion: Fusion = "union"
    integral: Integral = "exact"
    knowledge: KnowledgeRule = "sensed"
    replan: Replan = "change"
    exclude: Exclude = "none"
    movement: Movement = "step"
    start: Start = "exact"
    update: Update = "simultaneous"
    arrival_radius: float = Field(0.0, ge=0, description="map units around the goal that count as arrived")
    collision_distance: float | None = Field(None, ge=0, description="closer is a collision, map units")
    collisions: Meeting = "end"
    terminal_radius: float | None = Field(None, ge=0, description="of the discs around goals, map units")
    max_ticks: int | None = Field(None, ge=1)
    incremental: bool = True
    clearance: float = Field(
        0.0, ge=0, description="how far plans stay from the no-fly areas that a UAV knows, map units"
    )

    def chosen(self) -> dict[str, Any]:
        """Return the settings of `Mission` that the file gives, by name."""
        return {name: getattr(self, name) for name in FlySettings.model_fields if name in self.model_fields_set}


class VariantTable(FlySettings, UavSettings):
    """A variant of the mission: other settings of ``[fly]``, or of all UAVs."""

    name: Line = Field(min_length=1)


class MissionTable(MapTable, UavSettings):
    """A mission file."""

    title: Line = ""
    scenario: str | None = Field(
        None, description="take the map of a shipped scenario, or of a .toml beside this file, instead of one here"
    )
    uavs: list[UavTable] = Field(default_factory=list)
    random_uavs: RandomUavsTable | None = None
    timed_threats: list[TimedThreatTable] = Field(default_factory=list)
    timed_areas: list[TimedAreaTable] = Field(default_factory=list)
    fly: FlySettings | None = None
    variants: list[VariantTable] = Field(default_factory=list)

    @property
    def clearance(self) -> float:
        """The greatest clearance of any variant that the file itself gives, map units."""
        return max((one.clearance for one in (self.fly, *self.variants) if one is not None), default=0.0)

    def with_clearance(self, clearance: float) -> "MissionTable":
        """Return the table with one clearance for all variants."""
        changes = {"clearance": clearance}
        fly = (self.fly or FlySettings.model_validate({})).model_copy(update=changes)
        variants = [one.model_copy(update=changes) for one in self.variants]
        return self.model_copy(update={"fly": fly, "variants": variants})

    def ends(self) -> list[tuple[str, Point]]:
        """Name the starts and goals of the UAVs that the file writes out, in its own coordinates."""
        return ends_of(self.uavs)

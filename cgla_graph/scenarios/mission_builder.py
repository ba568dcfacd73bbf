"""Construction of worlds, UAVs and settings from the table of a mission file."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import shapely

from cgla_graph._text import shown
from cgla_graph._validate import error_context
from cgla_graph.errors import ScenarioError
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.mission.world import Timed, TimedThreat, World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.area_tables import with_files
from cgla_graph.scenarios.map_tables import MapBuilder, MapTable
from cgla_graph.scenarios.mission_tables import SOLVER, MissionTable, SharingTable, VirtualObstacleTable
from cgla_graph.scenarios.scenario import ScenarioTable, open_table
from cgla_graph.timed.timed_area import TimedArea

#: Keys that a mission on a scenario's map may not set.
OF_THE_MAP = (
    "coordinates", "projection_origin", "crs", "bounds", "improper", "threats", "random_threats", "rasters", "no_fly"
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Variant:
    """
    One way to fly the mission of a file.

    Attributes
    ----------
    uavs
        The UAVs.
    solver
        The text that names the solver, such as ``cgla`` or ``hybrid:seed=1``.
    settings
        All other settings of `Mission` that differ from its defaults, by name.
    """

    uavs: Sequence[Uav]
    solver: str
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class MissionBuilder:
    """Converter of a checked mission table to map units."""

    table: MissionTable
    folder: Path
    terrain: Mapping[str, object] = field(default_factory=dict)

    @cached_property
    def ground(self) -> MapBuilder:
        """The map: the scenario's, if the file names one, else its own."""
        drawn = self.table.random_uavs is not None
        homes = None if drawn else [(one.start[0], one.start[1]) for one in self.table.uavs]
        own: tuple[MapTable, Path] = (self.table, self.folder) if self._brought is None else self._brought
        table, folder = own
        if self.terrain:
            table = table.model_copy(update={"no_fly": with_files(table.no_fly, (), self.terrain)})
        if self._brought is None:
            return MapBuilder(table, folder, homes)
        # zones count up to the greatest clearance of any variant
        return MapBuilder(table.model_copy(update={"clearance": self.clearance}), folder, homes)

    @cached_property
    def _brought(self) -> tuple[ScenarioTable, Path] | None:
        """The scenario that the file names, and the folder of its own files."""
        name = self.table.scenario
        if name is None:
            return None
        for key in OF_THE_MAP:
            if key in self.table.model_fields_set:
                brings = f"scenario {shown(name)} brings the map"
                msg = f"{key}: {brings}; leave out {key}, or scenario and write the whole map"
                raise ValueError(msg)
        is_file = name.lower().endswith(".toml")
        path = self.folder / name if is_file else Path(name)
        if not name or (path.suffix and not is_file):
            msg = f"scenario is {shown(name)}; give the name of a shipped scenario, or a .toml beside this file"
            raise ValueError(msg)
        with error_context("scenario"):
            table = open_table(str(path))
            if table.speed is not None:
                msg = f"{path} changes in time; write timed_threats and timed_areas into the mission, and the map"
                raise ScenarioError(msg)
            return table, path.parent

    @cached_property
    def scenario(self) -> ScenarioTable | None:
        """The scenario that brings the map, if there is one."""
        return None if self._brought is None else self._brought[0]

    @property
    def clearance(self) -> float:
        """The greatest clearance of any variant, map units."""
        every = [{**self.common, **variant.chosen()} for variant in self.table.variants] or [self.common]
        greatest: float = max(settings.get("clearance", 0.0) for settings in every)
        return greatest

    @cached_property
    def common(self) -> dict[str, Any]:
        """The settings of the mission that variants may change."""
        given = 0.0 if self.scenario is None else self.scenario.clearance
        # (a clearance of 0 is not set, so that missions of studies begun earlier stay equal)
        of_scenario = {"clearance": given} if given > 0.0 else {}
        return {**of_scenario, **({} if self.table.fly is None else self.table.fly.chosen())}

    @cached_property
    def defaults(self) -> dict[str, Any]:
        """The settings of UAVs that do not set them themselves."""
        of_scenario = {} if self.scenario is None else {"k": self.scenario.k}
        return {**of_scenario, **self.table.given()}

    @cached_property
    def written_uavs(self) -> list[dict[str, Any]]:
        """The settings of each UAV that the file writes out."""
        return [
            {
                **self.defaults,
                **entry.given(),
                "name": entry.name,
                "start": self.ground.end(f"uavs.{number}.start", entry.start),
                "goal": self.ground.end(f"uavs.{number}.goal", entry.goal),
                "departs": entry.departs,
                "colour": entry.colour,
            }
            for number, entry in enumerate(self.table.uavs)
        ]

    def world(self) -> World:
        """Return the world."""
        # a UAV outside the map is reported first
        _ = self.written_uavs
        # a scenario keeps its threats: the drawn ones keep clear of its own start and goal
        with nullcontext() if self.scenario is None else error_context(f"scenario {shown(self.table.scenario)}"):
            threats, rasters = self.ground.threats(), self.ground.rasters()
            field = RiskField(threats, rasters=rasters, improper=self.ground.table.improper)
            bounds, no_fly = self.ground.bounds, self.ground.no_fly()
        timed = [*self.timed_threats(), *self.timed_areas()]
        return World(field, bounds=bounds, no_fly=no_fly, timed=timed)

    def timed_threats(self) -> Iterator[Timed]:
        """Build the threats that come, move or go."""
        for number, entry in enumerate(self.table.timed_threats):
            with error_context(f"timed_threats.{number}"):
                threat = entry.build(*self.ground.point([entry.x, entry.y]))
                # a peak that is too high is reported here, with the number of the threat in the file
                RiskField([threat], improper=self.ground.table.improper)
                moves = [(tick, *self.ground.point([x, y])) for tick, x, y in entry.moves]
                yield TimedThreat(threat, entry.appears, entry.vanishes, moves)  # type: ignore[arg-type]

    def timed_areas(self) -> Iterator[Timed]:
        """Build the areas that come or go."""
        for number, entry in enumerate(self.table.timed_areas):
            with error_context(f"timed_areas.{number}"):
                if (entry.polygon is None) == (entry.geojson is None):
                    msg = "an area needs either polygon or geojson"
                    raise ValueError(msg)
                rings = {} if entry.polygon is None else {"polygon": entry.polygon}
                files = [] if entry.geojson is None else [entry.geojson]
                areas = self.ground.areas(rings, files)
                yield TimedArea(
                    areas[0] if len(areas) == 1 else shapely.GeometryCollection(areas), entry.appears, entry.vanishes
                )

    def uavs(self, world: World) -> list[dict[str, Any]]:
        """Return the settings of all UAVs, those written first."""
        every = list(self.written_uavs)
        if self.table.random_uavs is not None:
            ends = [(uav["start"], uav["goal"]) for uav in every]
            safe = self.defaults.get("safe_distance", 0.5 * self.defaults.get("detection_radius", 0.0))
            zones = self.ground.zones
            columns = None if zones is None else zones.columns
            drawn = self.table.random_uavs.build(world, ends, safe, self.clearance, columns)
            every += [{**self.defaults, "name": name, "start": start, "goal": goal} for name, start, goal in drawn]
        if not every:
            msg = "a mission needs at least one UAV; add [[uavs]] with name, start and goal, or [random_uavs]"
            raise ValueError(msg)
        return every

    def variants(self, world: World) -> dict[str, Variant]:
        """Return the variants, each with its own UAVs; a file without any has one, named ``""``."""
        uavs = self.uavs(world)
        if not self.table.variants:
            return {"": self._variant(uavs, {}, self.common)}
        variants: dict[str, Variant] = {}
        for number, entry in enumerate(self.table.variants):
            if entry.name in variants:
                name = shown(entry.name)
                msg = f"variants.{number}.name: two variants are called {name}; give each a name of its own"
                raise ValueError(msg)
            with error_context(f"variant {shown(entry.name)}"):
                variants[entry.name] = self._variant(uavs, entry.given(), {**self.common, **entry.chosen()})
        return variants

    def _variant(self, uavs: list[dict[str, Any]], overrides: dict[str, Any], chosen: dict[str, Any]) -> Variant:
        """Return a variant; its UAVs take off and land outside of zones at the clearance of the variant."""
        ground, clearance = self.ground, chosen.get("clearance", 0.0)
        for uav in uavs:
            for end in ("start", "goal"):
                ground.require_column(f"UAV {uav['name']}: {end}", uav[end], clearance)
        return _variant(uavs, overrides, chosen)

    def lattice(self) -> Lattice:
        """Return the lattice: the file's own, even on the map of a scenario."""
        own = "lattice" in self.table.model_fields_set
        return (self.table if own else self.ground.table).lattice.build(self.ground.bounds)


def _variant(uavs: list[dict[str, Any]], overrides: dict[str, Any], chosen: dict[str, Any]) -> Variant:
    """Put UAVs and settings together."""
    built = []
    for uav in uavs:
        settings = {**uav, **overrides}
        if "detection_radius" not in settings:
            msg = (
                f"UAV {uav['name']}: detection_radius is needed; write it there, or once for all at the top of the file"
            )
            raise ValueError(msg)
        built.append(Uav(**settings))
    settings = {name: _setting(value) for name, value in chosen.items()}
    return Variant(tuple(built), settings.pop("solver", SOLVER), settings)


def _setting(value: Any) -> Any:  # noqa: ANN401 - of any setting
    """Return a setting as `Mission` takes it."""
    if isinstance(value, SharingTable):
        return Sharing(**value.model_dump())
    if isinstance(value, VirtualObstacleTable):
        return VirtualObstacle(**value.model_dump())
    return value

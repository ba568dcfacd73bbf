"""Scenarios: problems in TOML files, shipped or the user's own."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import NoneType
from typing import Any

from pydantic import Field, model_validator
from shapely.geometry.base import BaseGeometry

from cgla_graph._display import Plottable
from cgla_graph._text import shown
from cgla_graph._types import Bounds, Point
from cgla_graph._validate import file_path, four_numbers, instance, items, non_negative_number, point
from cgla_graph.airspace.terrain.area import TerrainArea
from cgla_graph.airspace.zones.account import ZoneAccount, ZoneRecord
from cgla_graph.airspace.zones.columns import Columns
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.rasters.ends import MapEnds
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.area_tables import Pair, ends_of, with_files
from cgla_graph.scenarios.map_tables import MapBuilder, read_table
from cgla_graph.scenarios.shipped import SCENARIOS, is_mission_text, shipped_scenario
from cgla_graph.scenarios.text_files import read_text, scenario_errors
from cgla_graph.scenarios.timed_tables import TimedTable, settings_in_time, team_of
from cgla_graph.timed.timed_problem import TimedProblem

#: The command that prints the schema of scenario files.
SCHEMA = "cgla scenarios --schema"


@dataclass(frozen=True, eq=False)
class Scenario(Plottable):
    """
    A problem with a name, a lattice, and settings of solvers for comparisons.

    Attributes
    ----------
    name, title
        A short name for tables and files, and a title of one line.
    problem
        The problem, in map units (metres where `projection` is set).
    lattice
        The lattice that graph solvers plan on.
    settings
        Settings of solvers, by the solver's name, that suit this scenario.
    y_down
        Whether y grows downwards, as in grid maps; pictures follow.
    notes
        Where the values come from.
    zones
        The verdict on every zone of the files that it names; None if it names none.
    areas
        Names and shapes of the no-fly areas that have a name in their file, map units; pictures show the names.
    area_records
        Records of the no-fly areas that are no zones, for lists: file, identifier, name, kind, state and reason.
    terrain
        Which cells of a raster of elevations are closed; None without one.
    columns
        Layers of zones below the altitude of the flight, which count where it takes off and lands; None without any
        zones, or where these count at all heights.

    in_time
        Settings of a `TimedProblem` beyond those of the problem, if the map changes in time: see `timed`.
    uavs
        Start, goal and own settings of each UAV of a team, by its name: see `team`. The problem is that of the first.

    Raises
    ------
    ScenarioError
        If the flight takes off or lands inside of a zone below it, or nearer to one than the clearance.

    Examples
    --------
    >>> load_scenario("paper").problem.k
    10.0
    """

    name: str
    title: str
    problem: Problem
    lattice: Lattice
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    y_down: bool = False
    notes: str = ""
    areas: Sequence[tuple[str, BaseGeometry]] = field(default=(), repr=False)
    zones: ZoneAccount | None = field(default=None, repr=False)
    area_records: Sequence[ZoneRecord] = field(default=(), repr=False)
    columns: Columns | None = field(default=None, repr=False)
    terrain: TerrainArea | None = field(default=None, repr=False)
    in_time: Mapping[str, Any] = field(default_factory=dict, repr=False)
    uavs: Mapping[str, tuple[Point, Point, Mapping[str, Any]]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        """Keep the areas as they are, and check that the flight takes off and lands outside of zones below it."""
        object.__setattr__(self, "areas", tuple(self.areas))
        object.__setattr__(self, "area_records", tuple(self.area_records))
        problem, columns = self.problem, self.columns
        for name, end in (("start", problem.start), ("goal", problem.goal)):
            if columns and (wrong := columns.fault(name, end, problem.clearance, closed=problem.no_fly)):
                raise ScenarioError(wrong)

    @property
    def full_title(self) -> str:
        """Name and title in one line."""
        return f"{self.name}: {self.title}" if self.title else self.name

    @cached_property
    def timed(self) -> TimedProblem | None:
        """The problem in space and time, of which `problem` is the part that stands still; None if it is all."""
        return TimedProblem.of(self.problem, **self.in_time) if self.in_time else None

    @cached_property
    def team(self) -> Mapping[str, TimedProblem]:
        """The problem of each UAV of a team, by its name, as `cgla_graph.solve_team` takes them; empty without one."""
        return {
            name: TimedProblem.of(replace(self.problem, start=start, goal=goal), **{**self.in_time, **own})
            for name, (start, goal, own) in self.uavs.items()
        }

    @property
    def projection(self) -> LocalProjection | None:
        """How longitude and latitude became metres; None for a map in the plane."""
        return self.problem.projection


#: What `load_scenario` takes.
NAME = "the name of a scenario, or the path of a file"


def as_scenario(given: object, name: str) -> Scenario:
    """
    Return a scenario unchanged, wrap a problem under a name, or load a scenario by name or path.

    Raises
    ------
    ScenarioError
        If `given` is of another type, or cannot be loaded.

    Examples
    --------
    >>> as_scenario(Problem((0, 0), (1, 1)), "mine").name, as_scenario("paper", "any").name
    ('mine', 'paper')
    """
    if isinstance(given, Scenario):
        return given
    if isinstance(given, Problem):
        return Scenario(name, "", given, Lattice(20, bounds=given.bounds))
    if isinstance(given, str | Path):
        return load_scenario(given)
    msg = f"a scenario is {shown(given)}; give a Scenario, a Problem, or the name or path of one"
    raise ScenarioError(msg)


class ScenarioTable(TimedTable):
    """A scenario file."""

    start: Pair
    goal: Pair
    k: float = Field(ge=0, description="risk weight: cost = length + k * risk")
    clearance: float = Field(0.0, ge=0, description="how far paths have to stay from no-fly areas, map units")
    solvers: dict[str, dict[str, int | float | str | bool]] = Field(
        default_factory=dict, description="settings of solvers that suit this scenario"
    )

    @model_validator(mode="before")
    @classmethod
    def _with_ends(cls, given: Any) -> Any:  # noqa: ANN401 - what the file holds
        """Take the ends of the first UAV of a team as those of the map."""
        uavs = given.get("uavs") if isinstance(given, dict) else None
        if not isinstance(uavs, list) or not uavs or not isinstance(uavs[0], dict):
            return given
        for key in ("start", "goal"):
            if key in given:
                msg = f"{key} is there beside uavs, which have their own; leave it out"
                raise ValueError(msg)
        return {**given, **{key: uavs[0][key] for key in ("start", "goal") if key in uavs[0]}}

    def ends(self) -> list[tuple[str, Point]]:
        """Name starts and goals, in the file's own coordinates."""
        if self.uavs:
            return ends_of(self.uavs)
        return list(zip(("start", "goal"), self.journey(), strict=True))

    def journey(self) -> tuple[Point, Point]:
        """Return start and goal, in the file's own coordinates."""
        return (self.start[0], self.start[1]), (self.goal[0], self.goal[1])


def schema() -> dict[str, Any]:
    """Return the JSON schema of scenario files."""
    found = ScenarioTable.model_json_schema()
    return {**found, "required": ["k"], "anyOf": [{"required": ["start", "goal"]}, {"required": ["uavs"]}]}


def scenario_from_toml(text: str, name: str, *, folder: Path | None = None, where: str | None = None) -> Scenario:
    r"""
    Build a scenario from the text of a TOML file.

    Parameters
    ----------
    text
        The file's text.
    name
        Name of the scenario.
    folder
        Where relative paths in it start; the current folder if left out.
    where
        What error messages call the file.

    Returns
    -------
    scenario
        The scenario.

    Raises
    ------
    ScenarioError
        If the text is no TOML, a key is unknown, a value has the wrong type or the problem is malformed; the message
        names the key's path and the remedy.

    Examples
    --------
    >>> scenario_from_toml("start = [0, 0]\ngoal = [1, 1]\nk = 3", "mine").problem.k
    3.0
    """
    place = where or name
    return scenario_of(read_table(text, ScenarioTable, place=place, command=SCHEMA), folder or Path(), name, place)


def shipped() -> list[str]:
    """
    List the scenarios that the toolkit ships, the paper's map first.

    Examples
    --------
    >>> shipped()[0]
    'paper'
    """
    return SCENARIOS.names()


def load_scenario(
    name: str | Path,
    *,
    start: Point | None = None,
    goal: Point | None = None,
    bounds: Bounds | None = None,
    clearance: float | None = None,
    no_fly: str | Path | Sequence[str | Path] = (),
    zones: Mapping[str, object] | None = None,
) -> Scenario:
    """
    Load a shipped scenario by name, or a scenario file by path.

    Parameters
    ----------
    name
        The name or the path.
    start, goal, bounds
        Replacements for the file's own, in its coordinates (degrees where it holds longitudes and latitudes). Random
        threats stay where they are.
    clearance
        Replacement for the file's own: how far every path has to stay from no-fly areas, map units.
    no_fly
        Files of more no-fly areas, on a map in longitude and latitude: GeoJSON, or zones.
    zones
        Replacements for the file's settings of zones: altitude, at, treat, ground, lines, vertical_clearance.

    Raises
    ------
    ScenarioError
        If there is no such scenario (the message offers the nearest names), the file is malformed, or start or goal is
        not on the map.

    Examples
    --------
    >>> load_scenario("paper").problem.goal
    (0.9, 0.9)
    """
    path, table = file_path("name", name, ScenarioError, NAME), open_table(name)
    if table.uavs and (start or goal):
        msg = f"{path}: the UAVs of this file have ends of their own; change them there"
        raise ScenarioError(msg)
    try:
        changes: dict[str, Any] = {
            key: list(check(key, given))
            for key, check, given in (("start", point, start), ("goal", point, goal), ("bounds", four_numbers, bounds))
            if given is not None
        }
        if clearance is not None:
            changes["clearance"] = non_negative_number("clearance", clearance)
    except CglaError as error:
        msg = f"{path}: {error}"
        raise ScenarioError(msg) from error
    instance("zones", zones, (Mapping, NoneType), "settings by name, as {'altitude': '80'}", ScenarioError)
    more: Any = no_fly
    if isinstance(more, str | os.PathLike):
        more = (more,)
    more = () if more is None else items("no_fly", more, "a list of files", ScenarioError)
    files = [file_path("a file of no_fly", one, ScenarioError) for one in more]
    if files or zones:
        # (files given here start at the current folder, those of the table at its own)
        with scenario_errors(path):
            changes["no_fly"] = with_files(table.no_fly, files, zones or {})
    return scenario_of(table, path.parent, path.stem, str(path), changes)


def open_table(name: str | Path) -> ScenarioTable:
    """
    Read the table of a shipped scenario by name, or of a scenario file by path.

    Raises
    ------
    ScenarioError
        If there is no such scenario, or the file is malformed.

    Examples
    --------
    >>> open_table("paper").start
    [0.1, 0.1]
    """
    path = file_path("name", name, ScenarioError, NAME)
    is_file = path.suffix.lower() == ".toml"
    text = read_text(path, str(path), "a TOML file") if is_file else shipped_scenario(str(name))
    if is_file and is_mission_text(text):
        msg = f"{path} is a mission, not a scenario, as it has UAVs; cgla fly {path} flies it"
        raise ScenarioError(msg)
    return read_table(text, ScenarioTable, place=str(path), command=SCHEMA)


def scenario_of(
    table: ScenarioTable, folder: Path, name: str, place: str, changes: Mapping[str, Any] | None = None
) -> Scenario:
    """
    Build the scenario of a checked table, with `changes` of its keys; error messages call its file `place`.

    Examples
    --------
    >>> table = ScenarioTable(start=[0.0, 0.0], goal=[1.0, 1.0], k=3.0)
    >>> scenario_of(table, Path(), "mine", "mine.toml").problem.k
    3.0
    """
    try:
        if changes:
            # (random threats are drawn on the unchanged map)
            threats = [*table.threats, *MapBuilder(table, folder).drawn()]
            table = table.model_copy(update={"threats": threats, "random_threats": None, **changes})
        builder = MapBuilder(table, folder)
        if builder.system is not None:
            # (the ends may be in degrees)
            given = MapEnds(*table.journey())
            ends = given.read(builder.system, builder.box, in_degrees=False, name=name)
            if ends != given:
                table = table.model_copy(update={"start": list(ends.start), "goal": list(ends.goal)})
                builder = MapBuilder(table, folder)
        start, goal = (builder.end(name, list(place)) for name, place in table.ends()[:2])
        for name_of_end, typed in table.ends():
            builder.require_outside(name_of_end, typed, table.clearance)
        problem = Problem(
            start=start,
            goal=goal,
            field=RiskField(builder.threats(), rasters=builder.rasters(), improper=table.improper),
            k=table.k,
            bounds=builder.bounds,
            no_fly=builder.no_fly(),
            clearance=table.clearance,
            projection=builder.on_earth,
        )
        lattice = builder.lattice()
        in_time = settings_in_time(table, builder)
        _ = TimedProblem.of(problem, **in_time) if in_time else None
        uavs = team_of(table, builder)
    except (ValueError, CglaError) as error:
        msg = f"{place}: {error}"
        raise ScenarioError(msg) from error
    scenario = Scenario(
        name=name,
        title=table.title,
        problem=problem,
        lattice=lattice,
        settings=table.solvers,
        notes=table.notes,
        areas=builder.named_areas,
        zones=None if builder.zones is None else builder.zones.account(),
        area_records=builder.area_records,
        columns=None if builder.zones is None else builder.zones.columns,
        terrain=None if builder.terrain is None else builder.terrain.area,
        in_time=in_time,
        uavs=uavs,
    )
    with scenario_errors(place):
        _ = scenario.team
    return scenario

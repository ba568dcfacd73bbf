"""Missions in TOML files, shipped or the user's own: UAVs on a map, in one or more variants."""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgla_graph._display import Plottable
from cgla_graph._text import shown
from cgla_graph._validate import error_context, file_path, non_negative_number
from cgla_graph.airspace.terrain.area import TerrainArea
from cgla_graph.airspace.zones.account import ZoneAccount
from cgla_graph.airspace.zones.columns import Columns
from cgla_graph.errors import MissionError
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.world import World
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.lattice import Lattice
from cgla_graph.scenarios.map_tables import read_table
from cgla_graph.scenarios.mission_builder import MissionBuilder, Variant
from cgla_graph.scenarios.mission_tables import MissionTable
from cgla_graph.scenarios.scenario import ScenarioTable
from cgla_graph.scenarios.shipped import MISSIONS, is_timed_text, shipped_mission
from cgla_graph.scenarios.text_files import read_text

#: The command that prints the schema of mission files.
SCHEMA = "cgla missions --schema"


@dataclass(frozen=True, eq=False)
class MissionFile(Plottable):
    """
    The content of a mission file: the world, the UAVs and the rules they fly by.

    Attributes
    ----------
    name, title
        A short name for tables and files, and a title of one line.
    world
        The truth, in map units (metres where `projection` is set).
    lattice
        The lattice that graph solvers plan on.
    variants
        The variants by name; a file without ``[[variants]]`` has one, named ``""``.
    projection
        How longitude and latitude became metres; None for a map in the plane.
    notes
        Where the values come from.
    where
        What error messages call the file.
    terrain
        The cells that are too high, if it has elevations.
    zones
        The verdict on every zone of the files that it names; None if it names none.
    columns
        The zones below the flight, which count where it takes off and lands.

    Examples
    --------
    >>> list(load_mission("fig8").variants)
    ['without virtual obstacles', 'with virtual obstacles']
    """

    name: str
    title: str
    world: World
    lattice: Lattice
    variants: Mapping[str, Variant]
    projection: LocalProjection | None = None
    notes: str = ""
    where: str = ""
    terrain: TerrainArea | None = None
    zones: ZoneAccount | None = None
    columns: Columns | None = None

    @property
    def full_title(self) -> str:
        """Name and title in one line."""
        return f"{self.name}: {self.title}" if self.title else self.name

    def missions(self, build_solver: Callable[[str], Any], *, solver: str | None = None) -> dict[str, Mission]:
        """
        Build the mission of each variant.

        Parameters
        ----------
        build_solver
            Makes a solver of the text that names it; `cgla_graph.solvers.get` will do for plain names.
        solver
            Such a text, to be used instead of those in the file.

        Returns
        -------
        missions
            By the variant's name, in the order of the file.

        Raises
        ------
        MissionError
            If a mission is malformed, or the file names a solver that cannot be built.
        CglaError
            The errors of `build_solver` for the `solver` given here.

        Examples
        --------
        >>> from cgla_graph.solvers import get
        >>> mission = load_mission("fig8").missions(get)["with virtual obstacles"]
        >>> [uav.name for uav in mission.uavs], mission.virtual_obstacle.stepnum
        (['a', 'b'], 3)
        """
        given = None if solver is None else build_solver(solver)
        missions = {}
        for name, variant in self.variants.items():
            place = f"{self.where}: variant {shown(name)}" if name else self.where
            with error_context(f"{place}: solver"):
                built = build_solver(variant.solver) if given is None else given
            with error_context(place):
                missions[name] = Mission(self.world, variant.uavs, built, resolution=self.lattice, **variant.settings)
        return missions


def mission_schema() -> dict[str, Any]:
    """Return the JSON schema of mission files."""
    return MissionTable.model_json_schema()


def mission_from_toml(
    text: str,
    name: str,
    *,
    folder: Path | None = None,
    where: str | None = None,
    clearance: float | None = None,
    terrain: Mapping[str, object] | None = None,
) -> MissionFile:
    r"""
    Build a mission file from the text of a TOML file.

    Parameters
    ----------
    text
        The file's text.
    name
        Name of the mission.
    folder
        Where relative paths in it start; the current folder if left out.
    where
        What error messages call the file.
    clearance
        How far plans of all variants stay from no-fly areas, map units; None for the file's own.
    terrain
        Settings of terrain instead of the file's: ground, terrain_clearance, terrain_altitude, as in ``[no_fly]``.

    Returns
    -------
    file
        World, UAVs and settings; `MissionFile.missions` checks the rest.

    Raises
    ------
    MissionError
        If the text is no TOML, a key is unknown, a value has the wrong type, the world or a UAV is malformed, or it
        takes the map of a scenario that is not there; the message names the key's path and the remedy.

    Examples
    --------
    >>> text = "detection_radius = 0.2\n[[uavs]]\nname = 'a'\nstart = [0.1, 0.1]\ngoal = [0.9, 0.9]"
    >>> mission_from_toml(text, "mine").variants[""].uavs[0].safe_distance
    0.1
    """
    place = where or name
    if is_timed_text(text):
        msg = f"{place} has a speed, and is a map that changes in time, no mission; cgla plan {place} plans on it"
        raise MissionError(msg)
    with error_context():
        table = read_table(text, MissionTable, place=place, command=SCHEMA)
        if clearance is not None:
            table = table.with_clearance(non_negative_number("clearance", clearance))
    with error_context(place):
        builder = MissionBuilder(table, folder or Path(), terrain or {})
        world = builder.world()
        return MissionFile(
            name=name,
            title=table.title,
            world=world,
            lattice=builder.lattice(),
            variants=builder.variants(world),
            projection=builder.ground.on_earth,
            notes=table.notes,
            where=place,
            terrain=None if builder.ground.terrain is None else builder.ground.terrain.area,
            zones=None if builder.ground.zones is None else builder.ground.zones.account(),
            columns=None if builder.ground.zones is None else builder.ground.zones.columns,
        )


def shipped_missions() -> list[str]:
    """
    List the missions that the toolkit ships: the paper's figures first, in their order.

    Examples
    --------
    >>> shipped_missions()[:2]
    ['fig4', 'fig5']
    """
    return MISSIONS.names()


def load_mission(
    name: str | Path, *, clearance: float | None = None, terrain: Mapping[str, object] | None = None
) -> MissionFile:
    """
    Load a shipped mission by name, or a mission file by path.

    Parameters
    ----------
    name
        The name or the path.
    clearance
        How far plans of all variants stay from no-fly areas, map units; None for the file's own.
    terrain
        Settings of terrain instead of the file's: ground, terrain_clearance, terrain_altitude, as in ``[no_fly]``.

    Raises
    ------
    MissionError
        If there is no such mission (the message offers the nearest names), the file cannot be read or is malformed, or
        the clearance is not a number of at least 0.

    Examples
    --------
    >>> len(load_mission("swarm").variants[""].uavs)
    20
    """
    path = file_path("name", name, MissionError, "the name of a mission, or the path of a file")
    if path.suffix.lower() != ".toml":
        return mission_from_toml(shipped_mission(str(name)), str(name), clearance=clearance, terrain=terrain)
    with error_context():
        text = read_text(path, str(path), "a TOML file")
    return mission_from_toml(text, path.stem, folder=path.parent, where=str(path), clearance=clearance, terrain=terrain)


def is_mission_file(spec: str | Path) -> bool:
    """
    Return whether a name or file is a mission's, by its content.

    Returns
    -------
    is_mission
        True for the name of a shipped mission, and for a TOML file with a key that only missions have. False for a
        file that cannot be read.

    Examples
    --------
    >>> is_mission_file("fig8"), is_mission_file("paper")
    (True, False)
    """
    path = Path(spec)
    if path.suffix.lower() != ".toml":
        return str(spec) in shipped_missions()
    try:
        document = tomllib.loads(read_text(path, str(path), "a TOML file"))
    except (ValueError, RecursionError):
        return False
    own = {"uavs", *(MissionTable.model_fields.keys() - ScenarioTable.model_fields.keys())}
    return "speed" not in document and not own.isdisjoint(document)

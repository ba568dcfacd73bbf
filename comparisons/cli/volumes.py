"""Options of volumes: lay them around a planned path or a checked plan (`cgla_graph.airspace.volumes`)."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.fence import Fence
from cgla_graph.airspace.flight_plans.plan import Reference
from cgla_graph.airspace.volumes.dimensions import GUIDANCE, VolumeSettings
from cgla_graph.airspace.volumes.files import check_ending
from cgla_graph.airspace.volumes.report import VolumeReport, volume_report
from cgla_graph.airspace.volumes.volumes import Volumes, volumes
from cgla_graph.comparisons import files
from cgla_graph.comparisons.cli.options import (
    ExportOptions,
    GroundRiskOptions,
    VolumeOptions,
    ZoneOptions,
    reference_of,
)
from cgla_graph.errors import CglaError

if TYPE_CHECKING:
    from cgla_graph.airspace.plan_check.plan_map import NamedMap
    from cgla_graph.airspace.plan_check.result import PlanCheck
    from cgla_graph.comparisons.cli.flyable import Flying
    from cgla_graph.comparisons.study.runner import Run
    from cgla_graph.scenarios.scenario import Scenario

#: Values of --fence, and the volumes that they name.
FENCES = {"geography": "flight geography", "contingency": "contingency volume", "none": ""}
#: Options whose fact has another name in Python.
_NAMES = {
    "geography_width": "width", "max_wind": "wind", "parachute_time": "opening_time", "parachute_rate": "descent_rate"
}  # fmt: skip
_FACTS = (
    "dimension", "pitch", "roll", "geography_width", "contingency_width", "contingency_height", "buffer", "glide_ratio",
    "parachute_time", "parachute_rate", "max_wind", "gnss_error", "position_error", "map_error", "height_error",
    "reaction_time", "acceptance_radius",
)  # fmt: skip


@dataclass(frozen=True)
class Laying:
    """
    How volumes are laid, and the files to which they are written.

    Attributes
    ----------
    settings
        Facts about the aircraft.
    options
        The options.
    zones
        Options of zones, by which closed areas count.
    """

    settings: VolumeSettings
    options: VolumeOptions
    zones: ZoneOptions

    @property
    def targets(self) -> Sequence[Path]:
        """The files."""
        return list(dict.fromkeys(self.options.volumes or ()))

    def check_map(self, scenario: "Scenario") -> None:
        """
        Check that the map of a scenario is in degrees, if there is a file to write.

        Raises
        ------
        CglaError
            If it is in the plane.
        """
        if self.targets and scenario.projection is None:
            msg = f"--volumes {self.targets[0]}: {scenario.name} is a map in the plane; volumes are written in degrees"
            raise CglaError(msg)

    def around_run(
        self, run: "Run", scenario: "Scenario", export: ExportOptions, flying: "Flying | None"
    ) -> "Laid | None":
        """
        Lay volumes around the path of a run, and hold them against the map and the zones of its files.

        Parameters
        ----------
        run
            The run; None is returned if it has no path.
        scenario
            The map, without areas that a limit of the density closes.
        export, flying
            Altitude of the flight, and tolerance of its arcs.

        Raises
        ------
        CglaError
            If the height of the flight is not known, or a file cannot be read.
        """
        if not run.solution.status.has_path:
            return None
        laid = volumes(
            run.solution,
            self.settings,
            height=self.options.flight_height,
            altitude=self._altitude(export),
            above=_above(export),
            ground=self.zones.ground,
            name=scenario.name,
            arc_tolerance=None if flying is None else flying.tolerance,
        )
        of_zones = () if scenario.zones is None else tuple(dict.fromkeys(one.file for one in scenario.zones.records))
        return self._laid(laid, scenario, of_zones)

    def _altitude(self, export: ExportOptions) -> float | None:
        """Return the greatest altitude: an exported plan follows the ground within a tolerance."""
        if export.altitude is None or not export.export or self.zones.ground is None or _above(export) != "ground":
            return export.altitude
        from cgla_graph.airspace.terrain.following import TERRAIN_TOLERANCE

        given = export.terrain_tolerance
        return export.altitude + (TERRAIN_TOLERANCE if given is None else given)

    def around_plan(self, checked: "PlanCheck", zones: Sequence[Path]) -> "Laid":
        """
        Lay volumes around a checked plan, and hold them against its map and zones.

        Raises
        ------
        CglaError
            If the height of the flight is not known, or the plan does not say everywhere where it flies.
        """
        laid = volumes(
            checked.plan,
            self.settings,
            height=self.options.flight_height,
            ground=self.zones.ground,
            projection=checked.on.problem.projection,
            name=checked.plan.name or Path(checked.file).stem,
        )
        return self._laid(laid, checked.on.source, tuple(map(str, zones)))

    def _laid(self, laid: Volumes, on: "NamedMap", zones: Sequence[str]) -> "Laid":
        counted = self.zones.settings()
        report = volume_report(
            laid,
            on,
            zones=zones,
            **{name: counted[name] for name in ("at", "treat", "lines", "ground")},
            without_data=self.options.people_without_data,
            controlled=self.options.controlled_ground,
        )
        return Laid(report, on, self.targets, FENCES[self.options.fence or "geography"])


@dataclass(frozen=True)
class Laid:
    """
    Volumes around a flight, and what becomes of them.

    Attributes
    ----------
    report
        The volumes, held against people and areas.
    on
        Their map.
    targets
        Files to which they are written.
    fenced
        The volume of which exported plans get a fence; empty for none.
    """

    report: VolumeReport
    on: "NamedMap"
    targets: Sequence[Path]
    fenced: str

    def lines(self) -> dict[str, str]:
        """Return the printed lines."""
        volumes = self.report.volumes
        assumed = "; ".join((*volumes.settings.assumptions(), *volumes.notes()))
        return {**self.report.lines(), "assumed": f"{assumed} ({GUIDANCE})"}

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return self.report.document()

    def fence(self) -> tuple[Fence, ...]:
        """Return the fence of exported plans; empty if there is none."""
        volumes = self.report.volumes
        return volumes.fence(self.fenced) if self.fenced and volumes.projection is not None else ()

    def write(self, folder: Path | None, formats: Sequence[str]) -> list[list[Path]]:
        """Write the picture into a folder, ``NAME-volumes.*``, and the volumes to all files, in groups by folder."""
        written = [[self.report.volumes.save(target)] for target in self.targets]
        if folder is None:
            return written
        from cgla_graph.plots import pictures
        from cgla_graph.plots.volumes import volumes_figure

        name = self.on.name
        stem = folder / files.file_stem(f"{self.report.volumes.name}-volumes", set())
        figure = volumes_figure(self.report.volumes, self.on.problem, name=name, areas=self.on.areas)
        return [pictures.save_all(figure, stem, formats), *written]


def _above(export: ExportOptions) -> Reference:
    """Return the reference of the altitude: that of exported plans, else that of zones."""
    return reference_of(export.above, usual="home" if export.export else "ground")


def with_corridor(
    ground: GroundRiskOptions, options: VolumeOptions, zones: ZoneOptions, export: ExportOptions
) -> GroundRiskOptions:
    """
    Return the options of ground risk with the corridor of the volumes.

    Raises
    ------
    CglaError
        If there is no limit of the density, another corridor, or the height of the flight is not known.

    Examples
    --------
    >>> options = VolumeOptions(dimension=0.8, max_speed=15.0, pitch=30.0, flight_height=60.0, corridor_of_volumes=True)
    >>> with_corridor(GroundRiskOptions(max_density=500.0), options, ZoneOptions(), ExportOptions()).corridor
    291.84
    """
    if ground.max_density is None or ground.corridor is not None:
        msg = "--corridor-of-volumes is the corridor of --max-density; give that, and no --corridor"
        raise CglaError(msg)
    settings = read_laying(options, zones, export).settings
    height = export.altitude if options.flight_height is None else options.flight_height
    return dataclasses.replace(ground, corridor=settings.dimensions(height or 0.0).corridor)


def read_laying(options: VolumeOptions, zones: ZoneOptions, export: ExportOptions | None = None) -> Laying:
    """
    Read the options of volumes, before any work is done.

    Parameters
    ----------
    options, zones
        Options of volumes and zones.
    export
        Options with the altitude of a flight that is yet to be planned; None for a plan.

    Raises
    ------
    CglaError
        If a number is out of range or missing, or the ending of a file is not known.

    Examples
    --------
    >>> laying = read_laying(VolumeOptions(dimension=0.8, speed=15.0, pitch=30.0), ZoneOptions())
    >>> laying.settings.half_width
    16.0
    """
    if export is None and options.corridor_of_volumes:
        msg = "--corridor-of-volumes is for planning a path; leave it out"
        raise CglaError(msg)
    for target in options.volumes or ():
        check_ending(target)
        files.make_folder(target.parent)
    if options.fence not in {None, *FENCES}:
        msg = f"--fence is {shown(options.fence)}; give one of {', '.join(FENCES)}"
        raise CglaError(msg)
    speed = options.speed if options.max_speed is None else options.max_speed
    if speed is None or options.dimension is None:
        needed = "--dimension D, metres" if options.dimension is None else "--max-speed V, m/s (or --speed)"
        msg = f"volumes need a fact about the aircraft; give {needed}"
        raise CglaError(msg)
    if export is not None and export.altitude is None and options.flight_height is None:
        msg = "volumes need the height of the flight; give --altitude M (or --flight-height M, above ground)"
        raise CglaError(msg)
    facts = {_NAMES.get(name, name): getattr(options, name) for name in _FACTS}
    return Laying(VolumeSettings(speed=speed, **{k: v for k, v in facts.items() if v is not None}), options, zones)

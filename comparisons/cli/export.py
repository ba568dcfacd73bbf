"""Option ``--export``: write a path as a flight plan (`cgla_graph.airspace.flight_plans`)."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from shapely.geometry.base import BaseGeometry

from cgla_graph._text import listed, shown
from cgla_graph._types import FloatArray
from cgla_graph.airspace.flight_plans.fence import Fence
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Reference
from cgla_graph.airspace.flight_plans.vehicles import AUTOPILOTS, VEHICLES, Autopilot, Vehicle, for_vehicle
from cgla_graph.airspace.zones.account import ZoneAccount
from cgla_graph.airspace.zones.heights import REFERENCES, Altitude
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.cli.options import ExportOptions
from cgla_graph.errors import CglaError, OutputError
from cgla_graph.model.earth import degrees_of
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from cgla_graph.airspace.plan_check.plan_map import NamedMap
    from cgla_graph.airspace.terrain.area import TerrainArea
    from cgla_graph.airspace.zones.columns import Columns
    from cgla_graph.comparisons.study.mission_run import MissionRun, MissionSpec
    from cgla_graph.scenarios.mission_file import MissionFile

Word = TypeVar("Word", bound=str)

#: Suffix of the line of a default tolerance.
DEFAULT: Final = " (default tolerance: ours; --terrain-tolerance M gives another)"
#: Autopilots need an altitude.
_AUTOPILOTS = (".plan", ".waypoints")


@dataclass(frozen=True)
class Exported:
    """
    Files of a plan, and why the plan is not clean.

    Attributes
    ----------
    files
        The files.
    faults
        The verdicts of `cgla_graph.check` on the map of the path; none for a clean plan.
    """

    files: Sequence[Path] = ()
    faults: tuple[str, ...] = ()

    def lines(self) -> dict[str, str]:
        """Return the line to print; none for a clean plan."""
        return {"exported": "; ".join(self.faults)} if self.faults else {}

    def document(self) -> dict[str, object]:
        """Return the verdict as JSON."""
        return {"is_clean": not self.faults, "verdict": [*self.faults]}


@dataclass(frozen=True)
class Export:
    """
    Files to which a path is written, with altitude and speed of the flight.

    Attributes
    ----------
    targets
        The files; their endings select the format.
    altitude
        Metres above `above`; None if left to the aircraft.
    above
        ``"home"``, ``"ground"`` or ``"sea"``.
    speed
        Metres per second; None if left to the aircraft.
    vehicle, autopilot
        The aircraft; None for a multirotor, or a fixed wing if turns have a radius.
    terrain_tolerance
        Greatest deviation of straight legs from an altitude above ground, metres, where elevations are known; None for
        the default.
    """

    targets: Sequence[Path] = ()
    altitude: float | None = None
    above: Reference = "home"
    speed: float | None = None
    vehicle: Vehicle | None = None
    autopilot: Autopilot = "any"
    terrain_tolerance: float | None = None

    def check_map(self, scenario: "Scenario | MissionSpec") -> None:
        """
        Check that the map of a scenario or mission is in degrees, if there is a file to export.

        Raises
        ------
        OutputError
            If it is in the plane.
        """
        if self.targets and scenario.projection is None:
            msg = (
                f"--export {self.targets[0]}: {scenario.name} is a map in the plane, but plans are in longitude and "
                "latitude: leave it out (--out writes x and y), or use a map in degrees"
            )
            raise OutputError(msg)

    def check_altitude(self, zones: ZoneAccount | None) -> None:
        """
        Check that plans are written for the altitude at which the zones of a mission count.

        Raises
        ------
        OutputError
            If they are for another one, at which other zones may be closed.
        """
        if not self.targets or zones is None or not zones.altitude or self.altitude is None:
            return
        flight = Altitude.of(zones.altitude)
        same = {REFERENCES[flight.reference], *(("home",) if flight.reference == "AGL" else ())}
        if self.altitude != flight.metres or self.above not in same:
            above = "" if self.above in {"home", "ground"} else "the "
            msg = (
                f"--altitude {self.altitude:g} is above {above}{self.above}, but the zones of the mission count at "
                f"{flight}: give that altitude, or change it in the file (no_fly.altitude)"
            )
            raise OutputError(msg)

    def write(
        self,
        scenario: Scenario,
        solution: Solution,
        *,
        arc_tolerance: float | None = None,
        fence: Sequence[Fence] = (),
    ) -> "Exported":
        """
        Write a path to all target files; nothing if there is no path.

        Arcs become waypoints within a tolerance, metres, which is printed and becomes part of the plan's name. Only
        ``.plan`` has the fence. The plan is checked on the map of the path, because it flies more than that: the slopes
        of a fixed wing, chords of arcs, and straight legs above ground.

        Raises
        ------
        CglaError
            If a file cannot hold the plan (then none is written), or cannot be written.
        """
        if not self.targets or not solution.status.has_path:
            return Exported()
        from cgla_graph.airspace.flight_plans.formats import text_of_plan
        from cgla_graph.turning.flyable import Flyable

        lonlat, name, usual = solution.lonlat, scenario.name, VEHICLES[0]
        if isinstance(solution, Flyable) and solution.projection is not None:
            waypoints, within = solution.waypoints(arc_tolerance)
            lonlat = degrees_of(waypoints, solution.projection)
            said = f"turns of {solution.turn_radius:g} m or more, within {within:.3g} m"
            name, usual = f"{name}: {said}", "fixed-wing"
            console.say(f"exported waypoints: {len(waypoints)}; {said} of the arcs")
        plan = self._plan(lonlat, name, usual, scenario.terrain)
        for remark in plan.remarks:
            console.say(f"exported plan: {remark}")
        fenced = dataclasses.replace(plan, fence=tuple(fence))
        plans = [fenced if target.suffix.lower() == ".plan" else plan for target in self.targets]
        texts = [text_of_plan(one, str(target)) for one, target in zip(plans, self.targets, strict=True)]
        written = [files.write_text(target, text) for target, text in zip(self.targets, texts, strict=True)]
        return Exported(written, self._faults(plan, scenario))

    def _faults(self, plan: FlightPlan, on: "NamedMap") -> tuple[str, ...]:
        """Return why a plan is not clean on its own map; none if it has no altitude that could be compared."""
        if self.altitude is None:
            return ()
        from cgla_graph.airspace.plan_check.check import check

        checked = check(plan, on, tolerance=None)
        if checked.is_clean:
            return ()
        names = dict.fromkeys(checked.on.areas[one.area].name for one in checked.crossings.found)
        return (*checked.verdict, *((f"it meets {listed(list(names))}",) if names else ()))

    def write_flights(self, flights: "Sequence[MissionRun]", opened: "MissionFile") -> Exported:
        """
        Write the path of each UAV to ``NAME-UAV.plan``, or with several variants to ``NAME-VARIANT-UAV.plan``.

        Parameters
        ----------
        flights
            Flights on maps in degrees. UAVs that did not arrive are left out, because their plans cannot be flown.
        opened
            The mission, whose terrain plans above ground follow; each plan is checked on its map, as by `write`.

        Raises
        ------
        CglaError
            If a file cannot hold the plan (then none is written), or cannot be written.
        """
        from cgla_graph.airspace.flight_plans.formats import text_of_plan
        from cgla_graph.mission.records import MissionStatus

        plans: list[tuple[str, FlightPlan]] = []
        faults: list[str] = []
        taken: set[str] = set()
        for flown in flights if self.targets else ():
            for uav in flown.flight.uavs.values():
                if uav.status is not MissionStatus.ARRIVED or flown.projection is None:
                    continue
                label = f"{flown.variant} {uav.name}" if len(flights) > 1 else uav.name
                lonlat = degrees_of(uav.path, flown.projection)
                plan = self._plan(lonlat, f"{flown.name} {label}", terrain=opened.terrain)
                faults += [f"{label}: {one}" for one in self._faults(plan, _MissionMap(opened, uav.path))]
                plans.append((files.file_stem(label, taken), plan))
        texts = []
        for target in self.targets:
            for stem, plan in plans:
                file = target.with_name(f"{target.stem}-{stem}{target.suffix}")
                texts.append((file, text_of_plan(plan, str(file))))
        return Exported([files.write_text(file, text) for file, text in texts], tuple(faults))

    def _plan(
        self,
        lonlat: FloatArray,
        name: str,
        usual: Vehicle = "multirotor",
        terrain: "TerrainArea | None" = None,
    ) -> FlightPlan:
        """Return the plan of a path; one above ground follows it where elevations are known."""
        plan = FlightPlan.along(lonlat, altitude=self.altitude, reference=self.above, speed=self.speed, name=name)
        ground = None if terrain is None else terrain.ground
        if ground is None and self.terrain_tolerance is not None:
            msg = f"--terrain-tolerance {self.terrain_tolerance:g} needs elevations: give --ground FILE.tif"
            raise CglaError(msg)
        if self.above == "ground" and self.altitude is not None and terrain is not None and ground is not None:
            from cgla_graph.airspace.terrain.following import follow_terrain

            kept = terrain.clearance
            found = follow_terrain(plan, ground, tolerance=self.terrain_tolerance, clearance=kept)
            console.say(f"exported plan: {found.summary()}{'' if self.terrain_tolerance else DEFAULT}")
            plan = found.plan
        return for_vehicle(plan, self.vehicle or usual, self.autopilot)


@dataclass(frozen=True)
class _MissionMap:
    """The map of a mission, on which the plan of a UAV is checked."""

    opened: "MissionFile"
    path: FloatArray
    areas: tuple[tuple[str, BaseGeometry], ...] = ()

    @property
    def name(self) -> str:
        return self.opened.name

    @property
    def title(self) -> str:
        return self.opened.title

    @property
    def zones(self) -> ZoneAccount | None:
        return self.opened.zones

    @property
    def columns(self) -> "Columns | None":
        return self.opened.columns

    @property
    def terrain(self) -> "TerrainArea | None":
        return self.opened.terrain

    @property
    def problem(self) -> Problem:
        world, ((x, y), (east, north)) = self.opened.world, self.path[[0, -1]].tolist()
        on_earth = self.opened.projection
        return Problem((x, y), (east, north), bounds=world.bounds, no_fly=world.no_fly, projection=on_earth)


def read_export(export: ExportOptions, *, zones: bool = False) -> Export:
    """
    Read the options of flight plans to write, before any work is done.

    On maps with `zones`, the altitude also selects the zones that count, even if no plan is written.

    Raises
    ------
    CglaError
        If an ending is not known, a number is out of range, the file of an autopilot has no altitude, or an option is
        given without a file.

    Examples
    --------
    >>> read_export(ExportOptions([Path("mine.plan")], altitude=80.0, speed=12.0)).above
    'home'
    """
    targets, altitude = list(dict.fromkeys(export.export or ())), export.altitude
    for target in targets:
        from cgla_graph.airspace.flight_plans.formats import WRITTEN

        kind = target.suffix.lower()
        if kind not in WRITTEN:
            msg = f"--export {target}: plans have no such format; give a file that ends in {', '.join(WRITTEN)}"
            raise CglaError(msg)
        if kind in _AUTOPILOTS and altitude is None:
            msg = f"--export {target}: an autopilot needs an altitude; give --altitude M, metres above home"
            raise CglaError(msg)
        files.make_folder(target.parent)
    of_zones = {"--altitude": altitude, "--above": export.above}
    of_plans = {
        "--terrain-tolerance": export.terrain_tolerance,
        "--speed": export.speed,
        "--vehicle": export.vehicle,
        "--autopilot": export.autopilot,
    }
    for option, value in {**of_zones, **of_plans}.items():
        if value is not None and not targets and not (zones and option in of_zones):
            msg = f"{option} needs a plan to write: give its file (--export NAME.plan), or leave {option} out"
            raise CglaError(msg)
    reference = export.reference
    # check the numbers before the work
    FlightPlan.along([(0.0, 0.0)], altitude=altitude, reference=reference, speed=export.speed)
    vehicle = None if export.vehicle is None else _word("--vehicle", export.vehicle, VEHICLES)
    autopilot = AUTOPILOTS[0] if export.autopilot is None else _word("--autopilot", export.autopilot, AUTOPILOTS)
    tolerance = export.terrain_tolerance
    if tolerance is not None and reference != "ground":
        msg = f"--terrain-tolerance {tolerance:g} is of plans above ground: add --above ground, or leave it out"
        raise CglaError(msg)
    return Export(targets, altitude, reference, export.speed, vehicle, autopilot, tolerance)


def _word(option: str, given: str, allowed: Sequence[Word]) -> Word:
    """Return a given word, which has to be one of the allowed ones."""
    found = next((one for one in allowed if one == given.strip().lower()), None)
    if found is None:
        msg = f"{option} is {shown(given)}; give one of {', '.join(allowed)}"
        raise CglaError(msg)
    return found

"""What ``--export`` writes: a path as the plan of a ground station or a viewer (`cgla_graph.airspace.flight_plans`)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Reference, Waypoint
from cgla_graph.comparisons import console, files
from cgla_graph.errors import CglaError, OutputError
from cgla_graph.model.path_file import degrees_of
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from cgla_graph.comparisons.study.mission_run import MissionRun, MissionSpec

#: What ``--above`` may say; nobody flies above the ellipsoid.
ABOVE: tuple[Reference, ...] = tuple(one for one in get_args(Reference) if one != "ellipsoid")
#: Autopilots need an altitude.
_AUTOPILOTS = (".plan", ".waypoints")


@dataclass(frozen=True)
class Export:
    """
    The files that a path is written to, and how it is to be flown.

    Attributes
    ----------
    targets
        The files; their endings say in which format.
    altitude
        Metres above what `above` says; None where it is left open.
    above
        ``"home"``, ``"ground"`` or ``"sea"``.
    speed
        Metres a second; None where it is left open.
    """

    targets: Sequence[Path] = ()
    altitude: float | None = None
    above: Reference = "home"
    speed: float | None = None


def read_export(
    targets: Sequence[Path] | None,
    altitude: float | None,
    above: str | None,
    speed: float | None,
    *,
    zones: bool = False,
) -> Export:
    """
    Read ``--export``, ``--altitude``, ``--above`` and ``--speed``, before any work is done.

    Where there are `zones`, the altitude chooses which of them count, whether a plan is written or not.

    Raises
    ------
    CglaError
        If an ending is not known, a number is out of range, an autopilot's file lacks an altitude, or something is said
        of a file that is not asked for.

    Examples
    --------
    >>> read_export([Path("mine.plan")], 80.0, None, 12.0).above
    'home'
    """
    asked = list(dict.fromkeys(targets or ()))
    if asked:
        from cgla_graph.airspace.flight_plans.formats import WRITTEN
    for target in asked:
        kind = target.suffix.lower()
        if kind not in WRITTEN:
            msg = f"--export {target}: no plan is written so; give a file that ends in {', '.join(WRITTEN)}"
            raise CglaError(msg)
        if kind in _AUTOPILOTS and altitude is None:
            msg = f"--export {target}: an autopilot needs an altitude; give --altitude M, metres above home"
            raise CglaError(msg)
        files.make_folder(target.parent)
    given = {"--altitude": altitude, "--above": above, "--speed": speed}
    for option, value in given.items():
        if value is not None and not asked and not (zones and option != "--speed"):
            msg = f"{option} is about the plan that is written: give its file (--export NAME.plan), or leave this out"
            raise CglaError(msg)
    if above is not None and above not in ABOVE:
        msg = f"--above is {shown(above)}; give one of {', '.join(ABOVE)}"
        raise CglaError(msg)
    reference: Reference = next((one for one in ABOVE if one == above), "home")
    # what is out of range is told before the work
    Waypoint(0.0, 0.0, altitude, reference, speed)
    return Export(asked, altitude, reference, speed)


def check_map(asked: Export, scenario: "Scenario | MissionSpec") -> None:
    """
    Check that the map of a scenario or mission has longitudes and latitudes, if something is to be exported of it.

    Raises
    ------
    OutputError
        If it has none.
    """
    if asked.targets and scenario.projection is None:
        msg = (
            f"--export {asked.targets[0]}: {scenario.name} is a map in the plane, and plans are in longitude and "
            "latitude: leave it out (--out writes x and y), or take a map in degrees"
        )
        raise OutputError(msg)


def write_export(
    asked: Export, scenario: Scenario, solution: Solution, *, arc_tolerance: float | None = None
) -> list[Path]:
    """
    Write a path to all files that are asked for; nothing if it is no path.

    Arcs become waypoints within a tolerance, metres, that is told and is part of the plan's name.

    Raises
    ------
    CglaError
        If a file cannot hold the plan (then none is written), or cannot be written.
    """
    if not asked.targets or not solution.status.has_path:
        return []
    from cgla_graph.airspace.flight_plans.formats import text_of_plan
    from cgla_graph.turning.flyable import Flyable

    lonlat, name = solution.lonlat, scenario.name
    if isinstance(solution, Flyable) and solution.projection is not None:
        waypoints, within = solution.waypoints(arc_tolerance)
        lonlat = degrees_of(waypoints, solution.projection)
        said = f"turns of {solution.turn_radius:g} m or more, within {within:.3g} m"
        name = f"{name}: {said}"
        console.say(f"exported waypoints: {len(waypoints)}; {said} of the arcs")
    plan = FlightPlan.along(lonlat, altitude=asked.altitude, reference=asked.above, speed=asked.speed, name=name)
    texts = [text_of_plan(plan, str(target)) for target in asked.targets]
    return [files.write_text(target, text) for target, text in zip(asked.targets, texts, strict=True)]


def write_flights(asked: Export, flights: "Sequence[MissionRun]") -> list[Path]:
    """
    Write what the UAVs of missions flew, a file each: ``NAME-UAV.plan``; of several variants ``NAME-VARIANT-UAV.plan``.

    Parameters
    ----------
    asked
        What is asked for.
    flights
        On maps in longitude and latitude. Those who did not arrive have no plan that could be flown, and are left out.

    Raises
    ------
    CglaError
        If a file cannot hold the plan (then none is written), or cannot be written.
    """
    from cgla_graph.airspace.flight_plans.formats import text_of_plan
    from cgla_graph.mission.records import MissionStatus

    plans: list[tuple[str, FlightPlan]] = []
    taken: set[str] = set()
    for flown in flights if asked.targets else ():
        for uav in flown.flight.uavs.values():
            if uav.status is not MissionStatus.ARRIVED or flown.projection is None:
                continue
            label = f"{flown.variant} {uav.name}" if len(flights) > 1 else uav.name
            lonlat = degrees_of(uav.path, flown.projection)
            how = {"altitude": asked.altitude, "reference": asked.above, "speed": asked.speed}
            plan = FlightPlan.along(lonlat, **how, name=f"{flown.name} {label}")  # type: ignore[arg-type]
            plans.append((files.file_stem(label, taken), plan))
    texts = []
    for target in asked.targets:
        for stem, plan in plans:
            file = target.with_name(f"{target.stem}-{stem}{target.suffix}")
            texts.append((file, text_of_plan(plan, str(file))))
    return [files.write_text(file, text) for file, text in texts]

"""Check a plan leg by leg, and prove how much better any plan could be."""

import dataclasses
import math
import os
from collections.abc import Mapping, Sequence
from datetime import datetime
from types import NoneType
from typing import Any, cast

import numpy as np
import shapely
from numpy.typing import ArrayLike

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import instance, items, point_array, positive_number
from cgla_graph.airspace.endurance.aircraft import Aircraft
from cgla_graph.airspace.endurance.flight_time import FlightTime, flight_time
from cgla_graph.airspace.flight_plans.crossings import crossings_of
from cgla_graph.airspace.flight_plans.formats import read_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Waypoint
from cgla_graph.airspace.plan_check.bracket import blocked_end, bracket, through_waypoints
from cgla_graph.airspace.plan_check.one_altitude import OF_THE_MAP, flies_higher
from cgla_graph.airspace.plan_check.plan_map import NamedMap, PlainMap, PlanMap, put_on_map
from cgla_graph.airspace.plan_check.result import PlanCheck
from cgla_graph.airspace.terrain.following import TERRAIN_TOLERANCE
from cgla_graph.airspace.terrain.legs import legs_above_ground
from cgla_graph.airspace.terrain.straight import straight_above_ground
from cgla_graph.airspace.zones.applying import Lines, Zones
from cgla_graph.airspace.zones.ground import Ground, read_ground
from cgla_graph.airspace.zones.heights import Altitude
from cgla_graph.airspace.zones.reading import read_zones
from cgla_graph.certificate.certificate import MAX_CELLS
from cgla_graph.errors import CglaError, ProblemError
from cgla_graph.model.earth import geodesic_curves
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.people.exposure import exposure
from cgla_graph.untrusted.files import FilePath

#: Default width of the bracket of the best possible cost, as a ratio.
TOLERANCE = 0.01
#: Default number of legs for which a bound is proven, at most; for others, the straight line is the bound.
MOST_PROVEN = 16
#: Shares of the length of a leg at which its distance from the geodesic is measured.
_SHARES = np.array([0.25, 0.5, 0.75])


def check(
    plan: FlightPlan | FilePath | ArrayLike,
    on: Problem | NamedMap | None = None,
    *,
    zones: Zones | FilePath | Sequence[FilePath] = (),
    altitude: str | float | Altitude | None = None,
    at: str | datetime | None = None,
    treat: Mapping[str, str] | None = None,
    lines: Lines | None = None,
    vertical_clearance: float | None = None,
    ground: Ground | FilePath | None = None,
    terrain_clearance: float | None = None,
    return_altitude: float | None = None,
    loiter_radius: float | None = None,
    home: tuple[float, ...] | None = None,
    acceptance_radius: float | None = None,
    k: float | None = None,
    clearance: float | None = None,
    corridor: float | None = None,
    max_density: float | None = None,
    target: float | None = None,
    tolerance: float | None = TOLERANCE,
    through: int = MOST_PROVEN,
    max_cells: int = MAX_CELLS,
    aircraft: Aircraft | None = None,
) -> PlanCheck:
    """
    Check a flight plan leg by leg, and prove how much better any plan could be.

    Parameters
    ----------
    plan
        A plan, the file of one (`cgla_graph.read_plan`), or waypoints, shape ``(m, 2)``: longitude and latitude,
        degrees, or x and y where the map is in a plane.
    on
        The map: a problem or a scenario. None: only zones, on a map around the plan so wide that the bound holds for
        all paths.
    zones
        The result of `cgla_graph.read_zones`, or files that it reads.
    altitude
        Altitude at which zones count, metres above ground, or as ``"450 AMSL"``. None: the plan's own altitudes are
        compared with floors and ceilings, leg by leg. Where the plan takes off and lands, zones count from the ground
        up.
    at, treat, lines, vertical_clearance
        As in `cgla_graph.airspace.zones.applying.Zones.apply`.
    ground
        Elevations, or the file of a raster of them, metres above sea level: every leg has to stay above the ground, and
        heights above ground are compared with heights above sea or home.
    terrain_clearance
        Least height of legs above the ground, metres; None for 30 m
        (`cgla_graph.airspace.terrain.area.TERRAIN_CLEARANCE`). Only with `ground`.
    return_altitude, loiter_radius, home, acceptance_radius
        What the file of a plan may leave open, as in `cgla_graph.read_plan`. Only for plans that are files.
    k, clearance
        Risk weight and clearance instead of the map's own; 0 without a map.
    corridor, max_density, target
        Limits on the people below the plan, as in `cgla_graph.exposure`; the map needs rasters.
    tolerance
        Wanted width of the proven bracket of the least cost, as a ratio; None for no proof.
    through
        Legs, at most, for which the bound of plans through the same waypoints is proven.
    max_cells
        Cells of a grid of a proof, at most, about 300 bytes each.
    aircraft
        For time and energy of the flight (`cgla_graph.flight_time`): a plan that the wind does not allow, or whose
        battery does not last, as far as is known, is not clean. None for none.

    Returns
    -------
    check
        Legs, crossings and verdict. `PlanCheck.best` brackets the least cost of a clean plan between the same ends,
        `PlanCheck.through` bounds that of a clean plan through the same waypoints.

    Raises
    ------
    CglaError
        If a file, a zone or a setting is malformed, there is nothing to check the plan against, or the plan and the
        map are not in the same coordinates.

    Examples
    --------
    >>> import shapely
    >>> tower = Problem((0, 0), (10, 0), bounds=(-5, -5, 15, 15), no_fly=shapely.box(4, -1, 5, 2))
    >>> straight = check([(0, 0), (10, 0)], tower)
    >>> straight.verdict, straight.crossings.found[0].inside
    (['not clean: 1 leg crosses 1 area'], 1.0)
    >>> around = check([(0, 0), (4, -1), (5, -1), (10, 0)], tower)
    >>> around.is_clean, around.most_to_gain < 0.01
    (True, True)
    """
    if tolerance is not None:
        positive_number("tolerance", tolerance)
    if not isinstance(cast("object", through), int) or through < 0:
        msg = f"through is {shown(through)}; give how many legs are proven at most, 0 or more"
        raise ProblemError(msg)
    instance("aircraft", aircraft, (Aircraft, NoneType), "Aircraft(speed=…)")
    if on is not None and not hasattr(on, "areas"):
        instance("on", on, Problem, problem_wanted)
    given = {
        "return_altitude": return_altitude,
        "loiter_radius": loiter_radius,
        "home": home,
        "acceptance_radius": acceptance_radius,
    }
    held, name = _plan_of(plan, on, given)
    listed: Any = zones
    if not isinstance(listed, Zones | str | os.PathLike):
        listed = items("zones", () if listed is None else listed, "files of zones, or the result of read_zones")
    has_zones = not isinstance(listed, tuple) or bool(listed)
    if on is None and not has_zones and not held.fence and ground is None:
        msg = f"{name}: there is nothing to check it against; give zones, elevations (ground), or a map (on)"
        raise CglaError(msg)
    # (an aircraft climbs to the altitude)
    of_zones = {"altitude": altitude if aircraft is None else None, "at": at, "treat": treat, "lines": lines}
    of_zones["vertical_clearance"] = vertical_clearance
    has_ground = ground is not None or getattr(on, "terrain", None) is not None
    _require_meaning(of_zones, terrain_clearance, has_zones=has_zones, has_ground=has_ground)
    elevations = read_ground(ground) if isinstance(ground, str | os.PathLike) else ground
    applied = None
    if has_zones:
        read = listed if isinstance(listed, Zones) else read_zones(listed)
        applied = read.apply(
            altitude=altitude,
            at=at,
            treat=treat,
            ground=elevations,
            lines=lines or "open",
            vertical_clearance=vertical_clearance or 0.0,
        )
    changes = {setting: value for setting, value in (("k", k), ("clearance", clearance)) if value is not None}
    source = PlainMap("map", "", on) if isinstance(on, Problem) else on
    placed = put_on_map(held, name, source, applied, changes, ground=elevations)
    higher = _higher(held, placed, elevations, given=altitude is not None)
    placed = dataclasses.replace(placed, unknown=higher)
    checked = _legs_of(held, name, placed)
    checked = dataclasses.replace(checked, flight=_flight(held, aircraft, altitude))
    checked = _above(checked, elevations, terrain_clearance, altitude)
    asked = {"corridor": corridor, "max_density": max_density, "target": target}
    checked = _above_people(checked, asked)
    return checked if tolerance is None else _above_people(_with_proofs(checked, tolerance, through, max_cells), asked)


def _above_people(checked: PlanCheck, asked: Mapping[str, float | None]) -> PlanCheck:
    """Measure what the plan means for people, with what its bracket proves; without rasters, nothing may be asked."""
    problem, given = checked.on.problem, {name: value for name, value in asked.items() if value is not None}
    if not problem.field.rasters:
        if given:
            msg = f"{next(iter(given))} needs a map with a raster of people; give one (on)"
            raise ProblemError(msg)
        return checked
    if checked.exposure is not None and checked.best is None:
        return checked
    bound = math.nan if checked.best is None else checked.best.lower_bound
    return dataclasses.replace(checked, exposure=exposure(problem, checked.on.route, lower_bound=bound, **given))


def _require_meaning(
    of_zones: Mapping[str, object], terrain_clearance: float | None, *, has_zones: bool, has_ground: bool
) -> None:
    """Refuse settings of zones without zones, and of terrain without elevations."""
    if terrain_clearance is not None and not has_ground:
        msg = f"terrain_clearance is {terrain_clearance:g}, and there are no elevations; give their file (ground)"
        raise CglaError(msg)
    for setting, value in of_zones.items():
        if value is not None and not has_zones and not (setting == "altitude" and has_ground):
            msg = f"{setting} needs zones; give their files (zones)"
            raise CglaError(msg)


def _plan_of(
    plan: FlightPlan | FilePath | ArrayLike, on: Problem | NamedMap | None, given: Mapping[str, Any]
) -> tuple[FlightPlan, str]:
    """Return the plan and its name; waypoints are in the coordinates of the map."""
    if isinstance(plan, str | os.PathLike):
        return read_plan(plan, **given), os.fspath(plan)
    for setting, value in given.items():
        if value is not None:
            msg = f"{setting} is for reading the file of a plan; give the file, or pass it to read_plan"
            raise ProblemError(msg)
    if isinstance(plan, FlightPlan):
        return plan, plan.name or "plan"
    places = point_array("plan", plan)
    if places.ndim != 2 or not len(places):  # noqa: PLR2004 - a list of points
        msg = f"plan has the shape {places.shape}; give one row per waypoint, shape (m, 2), m at least 1"
        raise ProblemError(msg)
    problem = on if on is None or isinstance(on, Problem) else on.problem
    on_earth = problem is None or problem.projection is not None
    waypoints = tuple(Waypoint(x, y) for x, y in places.tolist())
    return FlightPlan(waypoints, coordinates="lonlat" if on_earth else "plane"), "plan"


def _flight(plan: FlightPlan, aircraft: Aircraft | None, altitude: str | float | Altitude | None) -> FlightTime | None:
    """Return the time of a flight; one altitude is that of a plan without altitudes, if it is above the ground."""
    if aircraft is None:
        return None
    one = None if altitude is None else Altitude.of(altitude)
    is_above_ground = one is not None and one.reference in {"AGL", "HOME"}
    return flight_time(plan, aircraft=aircraft, altitude=one.metres if one is not None and is_above_ground else None)


def _higher(plan: FlightPlan, on: PlanMap, ground: Ground | None, *, given: bool) -> tuple[str, ...]:
    """Return why zones at one altitude, given or that of the map, do not decide about a plan."""
    columns = getattr(on.source, "columns", None)
    flights = (on.flight, None if columns is None else columns.flight)
    remedies = ("leave --altitude out" if given else OF_THE_MAP, OF_THE_MAP)
    pairs = [(flight, remedy) for flight, remedy in zip(flights, remedies, strict=True) if flight is not None]
    said = [wrong for flight, remedy in pairs if (wrong := flies_higher(plan, flight, remedy))]
    own, projection = getattr(on.source, "terrain", None), on.problem.projection
    ground = own.ground if ground is None and own is not None else ground
    if pairs and not said and ground is not None and projection is not None:
        highest = straight_above_ground(plan, ground, projection)
        for flight, remedy in pairs:
            if flight.reference == "AGL" and flight.metres + TERRAIN_TOLERANCE < highest < math.inf:
                said.append(
                    f"flown straight between its waypoints, it is up to {highest:.4g} m above the ground, and zones "
                    f"were held against {flight.metres:g} m AGL alone: {remedy}"
                )
    return tuple(dict.fromkeys(said))


def _above(
    checked: PlanCheck, ground: Ground | None, clearance: float | None, altitude: str | float | Altitude | None
) -> PlanCheck:
    """Add the heights of the legs above the ground, whose elevations are given or those of the map."""
    on = checked.on
    own = getattr(on.source, "terrain", None)
    if ground is None and own is not None:
        ground, altitude = own.ground, own.altitude if altitude is None else altitude
        clearance = own.clearance if clearance is None and not own.is_default else clearance
    if ground is None:
        return checked
    flight = None if altitude is None else Altitude.of(altitude)
    projection = on.problem.projection
    if projection is None:
        msg = f"elevations are in longitude and latitude, and the map {on.name} is in the plane; leave them out"
        raise CglaError(msg)
    legs = legs_above_ground(checked.plan, on.stops, on.route, projection, ground, clearance=clearance, altitude=flight)
    return dataclasses.replace(checked, terrain=legs)


def _legs_of(plan: FlightPlan, name: str, on: PlanMap) -> PlanCheck:
    """Check each leg: its crossings and its cost."""
    route = on.route
    starts, ends = (route, route) if len(route) == 1 else (route[:-1], route[1:])
    return PlanCheck(
        name,
        plan,
        on,
        lengths=np.hypot(*(ends - starts).T),
        risks=np.asarray(on.problem.field.line_integral(starts, ends)),
        crossings=crossings_of(
            route,
            on.closed,
            rounding=on.rounding,
            radii=on.radii([one.loiter_radius for one in plan.waypoints]).tolist(),
            reaches=on.radii([one.reach for one in plan.waypoints]).tolist(),
            cuts=on.radii([one.acceptance for one in plan.waypoints]).tolist(),
            heights=on.heights,
            required=on.problem.clearance,
        ),
        gaps=_gaps(on, starts, ends),
    )


def _with_proofs(checked: PlanCheck, tolerance: float, most_legs: int, max_cells: int) -> PlanCheck:
    """Prove how much better a plan could be."""
    on = checked.on
    if len(on.route) > 2:  # noqa: PLR2004 - one leg
        costs = checked.lengths + checked.k * checked.risks
        through = through_waypoints(on, costs, checked.faulty, tolerance, most_legs)
        checked = dataclasses.replace(checked, through=through)
    if (on.route[0] == on.route[-1]).all():
        return dataclasses.replace(checked, no_best="it ends where it begins: the cheapest plan is to stay there")
    if blocked := blocked_end(on) or checked.blocked_column:
        return dataclasses.replace(checked, no_best=blocked)
    try:
        best = bracket(on, tolerance, max_cells, is_clean=checked.is_straight)
    except ProblemError as error:
        return dataclasses.replace(checked, no_best=str(error))
    if checked.terrain is not None:
        # (the cheaper plan that is known may be too near to the ground)
        best = dataclasses.replace(best, upper_bound=math.inf)
    return dataclasses.replace(checked, best=best)


def _gaps(on: PlanMap, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the distance of each leg from the geodesic between its ends, map units."""
    projection = on.problem.projection
    if projection is None:
        return np.zeros(len(starts))
    curves = geodesic_curves(starts, ends, projection, _SHARES)
    lines = shapely.linestrings(np.stack([starts, ends], axis=1)[:, None])
    return np.asarray(np.max(shapely.distance(lines, shapely.points(curves)), axis=1))

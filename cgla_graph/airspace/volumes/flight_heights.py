"""The greatest height of a flight above the ground, from its altitudes and elevations."""

import itertools
import math
from dataclasses import replace

import numpy as np

from cgla_graph._text import figure
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Waypoint
from cgla_graph.airspace.terrain.straight import straight_leg
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import height_offset
from cgla_graph.airspace.zones.shapes import AreaShape
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import LocalProjection

_REFERENCES = {"home": "HOME", "ground": "AGL", "sea": "AMSL", "ellipsoid": "WGS84"}
_NOT_COVERED = "the elevations do not cover all of the ground under the flight; give height, metres above ground"
_GIVE = "give height, metres above ground, or elevations (ground)"


def above_ground(plan: FlightPlan, under: AreaShape | None, ground: Ground | None) -> tuple[float, tuple[str, ...]]:
    """
    Return the greatest height of a plan above the ground under it, metres, and what was assumed.

    Parameters
    ----------
    plan
        The plan.
    under
        The area whose ground counts, degrees; None in the plane.
    ground
        Elevations. Without them, the ground counts as flat where altitudes are above home.

    Raises
    ------
    ProblemError
        If the plan has no altitudes, or they cannot be compared with the ground.

    Examples
    --------
    >>> above_ground(FlightPlan.along([(24.0, 60.0)], altitude=80, reference="ground"), None, None)
    (80.0, ())
    """
    if any(one.altitude is None for one in plan.waypoints):
        msg = "the plan does not say how high it flies; give height, metres above ground"
        raise ProblemError(msg)
    below = None
    if ground is not None and under is not None:
        below = ground.range_over(under)
        if below is None:
            raise ProblemError(_NOT_COVERED)
    home = _home(plan, ground, below)
    # (a landing is on the ground)
    flown = [one for one in plan.waypoints if one.role != "landing"]
    heights = [_height(one, below, home) for one in flown]
    flat: tuple[str, ...] = ()
    if below is None and any(one.reference == "home" for one in flown):
        flat = ("heights above home count as heights above ground: the ground is taken for flat; elevations say more",)
    if below is not None:
        flat = (f"the ground under the flight is {figure(below[0], 5)} to {figure(below[1], 5)} m above the sea",)
    return max(0.0, *heights), flat


def straight_above_ground(plan: FlightPlan, ground: Ground, projection: LocalProjection) -> float:
    """
    Return the greatest height above the ground of legs above ground that are flown straight, metres; 0 without any.

    An autopilot without elevations flies straight from waypoint to waypoint, high above a valley.

    Parameters
    ----------
    plan
        The plan.
    ground
        Elevations.
    projection
        Projection of its map.

    Raises
    ------
    ProblemError
        If the ground below a leg is not known.

    Examples
    --------
    >>> ground = Ground(np.array([[300.0, 0.0, 0.0, 300.0]]), (24.0, 60.0, 24.04, 60.01))
    >>> plan = FlightPlan.along([(24.005, 60.005), (24.035, 60.005)], altitude=80, reference="ground")
    >>> round(straight_above_ground(plan, ground, LocalProjection(24.02, 60.005)))
    380
    """
    # (from home at the altitude of the first waypoint, to a landing at that of the one before)
    first = plan.waypoints[0]
    home = [] if plan.home is None else [replace(first, x=plan.home.x, y=plan.home.y, role="waypoint")]
    highest = 0.0
    for one, after in itertools.pairwise([*home, *plan.waypoints]):
        end = one if after.role == "landing" else after
        ends = np.array([(one.x, one.y), (after.x, after.y)])
        if {one.reference, end.reference} != {"ground"} or (ends[0] == ends[1]).all():
            continue
        line = straight_leg(projection.forward(ends), projection, ground, max(one.reach, after.reach))
        heights = float(one.altitude or 0.0), float(end.altitude or 0.0)
        highest = max(highest, float(line.above_ground(heights)[1].max()))
    if not math.isfinite(highest):
        raise ProblemError(_NOT_COVERED)
    return highest


def _home(plan: FlightPlan, ground: Ground | None, below: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return the least and the greatest height of home above the sea; None if unknown."""
    place = plan.home or plan.waypoints[0]
    if plan.home is not None and plan.home.altitude:
        return plan.home.altitude, plan.home.altitude
    here = None if ground is None else ground.range_in((place.x, place.y, place.x, place.y))
    return here or below


def _height(one: Waypoint, below: tuple[float, float] | None, home: tuple[float, float] | None) -> float:
    """Return the greatest height of a waypoint above the ground."""
    altitude = float(one.altitude or 0.0)
    if one.reference == "home" and below is None:
        return altitude
    more = height_offset(_REFERENCES[one.reference], "AGL", below, home)
    if more is None:
        msg = f"it flies {altitude:g} m above {one.reference}, and the ground is not known; {_GIVE}"
        raise ProblemError(msg)
    return altitude + more[1]

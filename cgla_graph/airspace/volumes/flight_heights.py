"""The greatest height of a flight above the ground, from its altitudes and elevations."""

from cgla_graph._text import figure
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Waypoint
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import ABOVE, height_offset
from cgla_graph.airspace.zones.shapes import AreaShape
from cgla_graph.errors import ProblemError

NOT_COVERED = "the elevations do not cover all of the ground under the flight; give height, metres above ground"
_GIVE = "give height, metres above ground, or elevations (ground)"


def above_ground(plan: FlightPlan, under: AreaShape | None, ground: Ground | None) -> tuple[float, tuple[str, ...]]:
    """
    Return the greatest height of a plan above the ground under it, metres, and the assumptions.

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
            raise ProblemError(NOT_COVERED)
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
    more = height_offset(ABOVE[one.reference], "AGL", below, home)
    if more is None:
        msg = f"it flies {altitude:g} m above {one.reference}, and the ground is not known; {_GIVE}"
        raise ProblemError(msg)
    return altitude + more[1]

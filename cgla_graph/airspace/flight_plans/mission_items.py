"""Mission items of MAVLink that fly a plan."""

import math

from cgla_graph.airspace.flight_plans.mavlink import (
    CHANGE_SPEED,
    FRAME_OF,
    GROUNDSPEED,
    LAND,
    LOITER_TIME,
    LOITER_TURNS,
    MISSION_FRAME,
    PASSES,
    PAYLOAD_PLACE,
    TAKE_OFF,
    USUAL_SPEED,
    VTOL_LAND,
    VTOL_TAKE_OFF,
    WAYPOINT,
    Item,
)
from cgla_graph.airspace.flight_plans.mavlink_commands import DELAY, LAND_START
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Waypoint, fault
from cgla_graph.airspace.flight_plans.vehicles import FIXED_WING, VTOLS


def items_of(plan: FlightPlan, where: str) -> list[Item]:
    """
    Return the mission that flies a plan, named `where` in messages.

    The inverse of `cgla_graph.airspace.flight_plans.mavlink.plan_of`.

    Raises
    ------
    PlanError
        If the plan has no longitudes and latitudes, or a waypoint is at 0, 0 (which autopilots read as no place), has
        no altitude, or has one above the ellipsoid (which autopilots do not support).

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.0), (24.1, 60.1)], altitude=80, speed=15)
    >>> [item.command for item in items_of(plan, "mine.plan")]
    [22, 178, 16, 16, 21]
    """
    if plan.coordinates != "lonlat":
        fault(where, "the plan is in a plane", "only one with longitudes and latitudes can be flown")
    items: list[Item] = []
    speed: float | None = None
    for index, one in enumerate(plan.waypoints):
        if one.speed != speed:
            value = USUAL_SPEED if one.speed is None else one.speed
            numbers = (float(GROUNDSPEED), value, -1.0, 0.0, 0.0, 0.0, 0.0)
            items.append(Item(f"waypoint {index}", MISSION_FRAME, CHANGE_SPEED, numbers))
            speed = one.speed
        if (one.x, one.y) == (0.0, 0.0):
            fault(f"{where}: waypoint {index}", "it is at 0, 0, which some autopilots read as no place", "move it")
        if one.reference not in FRAME_OF:
            wrong = "its altitude is above the ellipsoid"
            fault(f"{where}: waypoint {index}", wrong, "give it above home, ground or sea")
        is_approach = index == len(plan.waypoints) - 2 and plan.waypoints[-1].role == "landing"
        if plan.vehicle == FIXED_WING and is_approach and one.role == "waypoint":
            items.append(Item(f"waypoint {index}", MISSION_FRAME, LAND_START, (0.0,) * 7))
        items.append(_item(one, f"{where}: waypoint {index}", is_vtol=plan.vehicle in VTOLS))
        if one.stay > 0.0 and items[-1].command not in {WAYPOINT, LOITER_TIME, LAND, VTOL_LAND}:
            numbers = (one.stay, -1.0, -1.0, -1.0, 0.0, 0.0, 0.0)
            items.append(Item(f"waypoint {index}", MISSION_FRAME, DELAY, numbers))
    return items


def _item(one: Waypoint, where: str, *, is_vtol: bool) -> Item:
    """Return the item that flies to a waypoint."""
    command = {"take-off": TAKE_OFF, "landing": LAND, "waypoint": WAYPOINT, "touch-down": PAYLOAD_PLACE}[one.role]
    numbers = [0.0, 0.0, 0.0, math.nan]
    if is_vtol and command == TAKE_OFF:
        # (it heads for the next waypoint when it begins to fly forward)
        command, numbers[1] = VTOL_TAKE_OFF, 1.0
    elif is_vtol and command == LAND:
        command = VTOL_LAND
    if one.pass_radius > 0.0:
        if one.role != "waypoint" or one.loiter_radius > 0.0:
            fault(where, "it has a circle or a role, and is passed at a distance", "only other waypoints can be")
        numbers[PASSES[0]] = one.pass_radius
    if one.loiter_radius > 0.0:
        if one.role != "waypoint":
            fault(where, f"a {one.role} has a circle", "only a waypoint can have one")
        numbers[2] = one.loiter_radius
        # (once around if the plan does not say how long)
        timed = one.stay > 0.0 and one.turns == 0.0
        command, numbers[0] = (LOITER_TIME, one.stay) if timed else (LOITER_TURNS, one.turns or 1.0)
    elif one.role == "waypoint":
        numbers[0] = one.stay
    if one.altitude is None:
        fault(where, "it has no altitude", "give all of them one (--altitude M), as an autopilot needs it")
    return Item(where, FRAME_OF[one.reference], command, (*numbers, one.y, one.x, one.altitude))

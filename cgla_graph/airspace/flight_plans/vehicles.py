"""Kinds of aircraft that a plan is for: how they take off and land, and their numbers in files of autopilots."""

import math
from dataclasses import replace
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from cgla_graph._text import shown
from cgla_graph._validate import is_one_of
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Waypoint, fault
from cgla_graph.errors import PlanError
from cgla_graph.model.earth import geodesic_between, geodesic_length

Vehicle: TypeAlias = Literal["multirotor", "helicopter", "fixed-wing", "vtol"]
Autopilot: TypeAlias = Literal["any", "ardupilot", "px4"]

VEHICLES: Final[tuple[Vehicle, ...]] = get_args(Vehicle)
AUTOPILOTS: Final[tuple[Autopilot, ...]] = get_args(Autopilot)
#: MAV_TYPE: a quadrotor (which stands for all multirotors, as in QGroundControl), a VTOL with fixed rotors; all VTOLs.
MAV_TYPE: Final[dict[Vehicle, int]] = {"multirotor": 2, "helicopter": 4, "fixed-wing": 1, "vtol": 22}
FIXED_WING, VTOLS = MAV_TYPE["fixed-wing"], range(19, 26)
#: MAV_AUTOPILOT_GENERIC, _ARDUPILOTMEGA and _PX4.
MAV_AUTOPILOT: Final[dict[Autopilot, int]] = {"any": 0, "ardupilot": 3, "px4": 12}
#: Slope of climbs and descents of a fixed wing: 40 m on 300 m, as QGroundControl's landing pattern has by default; and
#: the height below which it does not turn, metres.
SLOPE, LOW = 40.0 / 300.0, 40.0


def for_vehicle(plan: FlightPlan, vehicle: Vehicle = "multirotor", autopilot: Autopilot = "any") -> FlightPlan:
    """
    Return a plan for a kind of aircraft.

    A multirotor, a helicopter and a VTOL take off and land vertically. A fixed wing climbs along the first leg and
    descends along the last one, by 40 m on 300 m, straight between the ground and 40 m (as the landing pattern of
    QGroundControl by default). Where a leg is too short for that, or its altitude is above the sea, the plan has no
    take-off and no landing, and a remark says why. A plan without altitudes stays as it is.

    Parameters
    ----------
    plan
        A plan as `FlightPlan.along` makes it: take-off at its start, landing at its end.
    vehicle, autopilot
        The aircraft, and its autopilot.

    Raises
    ------
    PlanError
        If a word is none of these.

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.0), (24.1, 60.1)], altitude=80)
    >>> plane = for_vehicle(plan, "fixed-wing")
    >>> for one in plane.waypoints:
    ...     print(f"{one.role} {one.x:.3f} {one.y:.3f} {one.altitude:g}")
    take-off 24.011 60.000 80
    waypoint 24.100 60.000 80
    waypoint 24.100 60.095 80
    landing 24.100 60.100 0
    """
    for name, word, allowed in (("vehicle", vehicle, VEHICLES), ("autopilot", autopilot, AUTOPILOTS)):
        if not is_one_of(word, allowed):
            fault(name, f"it is {shown(word)}", f"give one of {', '.join(allowed)}")
    named = replace(plan, vehicle=MAV_TYPE[vehicle], autopilot=MAV_AUTOPILOT[autopilot])
    has_heights = all(one.altitude is not None for one in plan.waypoints)
    if vehicle != "fixed-wing" or not has_heights or plan.waypoints[-1].role != "landing":
        return named
    try:
        return replace(named, waypoints=_sloped(plan))
    except PlanError as error:
        first, *others = plan.waypoints[:-1] if len(plan.waypoints) > 2 else plan.waypoints[:1]  # noqa: PLR2004 - no leg
        remark = f"without take-off and landing, which the ground station has to add: {error}"
        flown = (replace(first, role="waypoint"), *others)
        return replace(named, waypoints=flown, remarks=(*plan.remarks, remark))


def _sloped(plan: FlightPlan) -> tuple[Waypoint, ...]:
    """Return the waypoints of a plan whose first leg climbs and whose last one descends."""
    first, *middle, landing = plan.waypoints
    if not middle:
        fault(
            "the plan", "it has no leg", "a fixed wing takes off and lands along one: give another goal (or --vehicle)"
        )
    if {first.reference, middle[-1].reference} & {"sea", "ellipsoid"}:
        wrong = "its altitude is above the sea, and a fixed wing climbs and descends along a slope above the ground"
        fault("the plan", wrong, "give an altitude above home or ground (--above)")
    ends = [(first, middle[0]), (landing, middle[-2] if len(middle) > 1 else first)]
    share = 0.5 if len(middle) == 1 else 1.0
    sloped = []
    for (near, far), after, verb in zip(ends, (middle[0], middle[-1]), ("climb to", "descend from"), strict=True):
        high = after.altitude or 0.0
        length = geodesic_length((near.x, near.y), (far.x, far.y))
        reach, least = share * length, min(LOW, high) / SLOPE
        if reach < least or (share < 1.0 and reach < high / SLOPE):
            needed = (least if share == 1.0 else high / SLOPE) / share
            wrong = f"its {'first' if near is first else 'last'} leg is {length:.0f} m long, and a fixed wing"
            remedy = f"needs {math.ceil(needed)} m to {verb} {min(LOW, high) if share == 1.0 else high:g} m"
            fault("the plan", f"{wrong} {remedy}", "give another start or goal (or --vehicle)")
        along = min(high / SLOPE, reach)
        x, y = geodesic_between(np.array([(near.x, near.y)]), np.array([(far.x, far.y)]), along / length)[0].tolist()
        at_end = along == length
        place = (far.x, far.y) if at_end else (x, y)
        sloped.append((replace(after, x=place[0], y=place[1], altitude=min(high, SLOPE * along)), at_end))
    (climbed, ends_climb), (approach, begins_descent) = sloped
    take_off = replace(climbed, role="take-off", speed=first.speed)
    between = middle[int(ends_climb) : -1]
    kept = between[:-1] if begins_descent and between else between
    return (take_off, *kept, approach, landing)

"""What a flight plan says of the time of its flight: steps, climbs, circles and stays."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph._validate import positive_number
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Reference, Waypoint
from cgla_graph.airspace.flight_plans.vehicles import FIXED_WING
from cgla_graph.model.earth import geodesic_steps

_ON_GROUND: Final = {"touch-down", "landing"}
#: Why climbs are not known, in messages.
NO_ALTITUDE: Final = "climb and descent: the altitude above the ground is not known; give --altitude M, above home"
TERRAIN: Final = "climbs on the way: above the ground, which rises and falls; an altitude above home makes them known"


@dataclass(frozen=True)
class Stops:
    """
    Steps of a flight, and what happens at their ends.

    Attributes
    ----------
    steps
        East and north (x and y), metres (map units), shape ``(n, 2)``; 0 for a climb in one place.
    commanded
        Ground speed that the plan commands for each step, shape ``(n,)``; infinite if it commands none.
    climbs
        Change of height on each step, metres, shape ``(n,)``.
    names
        The waypoint at which each step ends, for messages.
    upright
        Heights that are climbed and descended besides: to the first place, at touch-downs, from the last place.
    circles
        Radius, number of turns and commanded ground speed (infinite if there is none) of circles.
    staying
        Stays, seconds.
    unknown
        Why climbs, circles or stays are not known: a sentence each.
    unknown_in_wind
        Why speeds are not known where there is wind.
    """

    steps: FloatArray
    commanded: FloatArray
    climbs: FloatArray
    names: tuple[str, ...] = ()
    upright: tuple[float, float] = (0.0, 0.0)
    circles: tuple[tuple[float, float, float], ...] = ()
    staying: float = 0.0
    unknown: tuple[str, ...] = ()
    unknown_in_wind: tuple[str, ...] = ()


def stops_of_path(
    steps: FloatArray, altitude: float | None, above: Reference = "home", ground_speed: float | None = None
) -> Stops:
    """
    Return the steps of a path at one altitude, with a climb at its start and a descent at its end.

    Parameters
    ----------
    steps
        East and north (x and y), metres (map units), shape ``(n, 2)``.
    altitude
        Metres above both ends; None if unknown.
    above
        Reference of the altitude: ``"home"``, or ``"ground"``, over which climbs on the way are not known. Heights
        above other things say nothing of the climb.
    ground_speed
        Commanded speed, metres (map units) per second; None for none.

    Raises
    ------
    ProblemError
        If the speed is not above 0.

    Examples
    --------
    >>> stops_of_path(np.array([[3.0, 4.0]]), 80.0).upright
    (80.0, 80.0)
    """
    n = len(steps)
    names = tuple(f"waypoint {index + 2}" for index in range(n))
    high, unknown = _level(altitude if above in {"home", "ground"} else None)
    if above == "ground" and n and not unknown:
        unknown = (TERRAIN,)
    speed = math.inf if ground_speed is None else positive_number("ground_speed", ground_speed)
    return Stops(steps, np.full(n, speed), np.zeros(n), names, high, unknown=unknown)


def _level(altitude: float | None) -> tuple[tuple[float, float], tuple[str, ...]]:
    """Return climb and descent of a flight at one altitude, and why they are not known."""
    return ((0.0, 0.0), (NO_ALTITUDE,)) if altitude is None else ((altitude, altitude), ())


def stops_of_plan(plan: FlightPlan, altitude: float | None = None) -> Stops:
    """
    Return the steps of a plan, and what it says of climbs, circles and stays.

    Parameters
    ----------
    plan
        The plan.
    altitude
        For a plan without altitudes: metres above take-off and landing.

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.0, 60.01)], altitude=80, speed=10)
    >>> stops = stops_of_plan(plan)
    >>> np.hypot(*stops.steps.T).round(1).tolist(), stops.climbs.tolist(), stops.upright
    ([1114.1, 0.0], [0.0, -80.0], (80.0, 0.0))
    """
    reader = _Reader(plan)
    flown = plan.flown
    steps = geodesic_steps(flown) if plan.coordinates == "lonlat" else np.diff(flown, axis=0)
    ways = plan.waypoints[len(plan.waypoints) - len(steps) :]
    if all(one.altitude is None or one.role in _ON_GROUND for one in plan.waypoints):
        (reader.up, reader.down), unknown = _level(altitude)
        reader.unknown += unknown
        climbs = np.zeros(len(steps))
    else:
        climbs = reader.climbs(steps)
    circles = reader.circles()
    return Stops(
        steps,
        np.array([math.inf if one.speed is None else one.speed for one in ways]),
        climbs,
        tuple(f"waypoint {len(plan.waypoints) - len(steps) + index + 1}" for index in range(len(steps))),
        (reader.up, reader.down),
        circles,
        sum(one.stay for one in plan.waypoints),
        (*reader.unknown, *plan.untimed, *plan.unknown),
        plan.untimed_in_wind,
    )


class _Reader:
    """Climbs and circles of a plan, and what it leaves open of them."""

    def __init__(self, plan: FlightPlan) -> None:
        self.plan = plan
        self.up = self.down = 0.0
        self.unknown: list[str] = []

    def climbs(self, steps: FloatArray) -> FloatArray:
        """
        Return the climb on each step; the climb to the first place and those of touch-downs are added up apart.

        An aircraft that hovers climbs above home before it leaves, and descends above its landing, which takes longer
        than to climb on the way, as a fixed wing does.
        """
        plan, hovers = self.plan, self.plan.vehicle != FIXED_WING
        from_ground = plan.home is not None or plan.waypoints[0].role == "take-off"
        before: Waypoint | None = None
        found = []
        # the first waypoint is at home, or there is a step from home to it
        lone = len(plan.waypoints) - len(steps)
        for index, one in enumerate(plan.waypoints):
            name = f"waypoint {index + 1}"
            step = 0.0 if index < lone else float(np.hypot(*steps[index - lone]))
            if before is None:
                climb = self._height(one, f"to {name}") if from_ground else 0.0
                if not from_ground:
                    self.unknown.append("the climb to its first waypoint: the plan has no take-off")
            else:
                climb = self._change(before, one, step, name)
            if step > 0.0 and hovers and (before is None or one.role == "landing"):
                self.up += max(climb, 0.0)
                self.down += max(-climb, 0.0)
                climb = 0.0
            if index < lone:
                self.up += max(climb, 0.0)
            else:
                found.append(climb)
            if one.role == "touch-down":
                self.up += max(self._height(one, f"at {name}"), 0.0)
                self.down += max(self._height(one, ""), 0.0)
                if one.stay == 0.0:
                    self.unknown.append(f"{name}: how long it stays on the ground")
            before = one
        if plan.waypoints[-1].role != "landing":
            self.unknown.append("the way down: the plan has no landing")
        return np.array(found)

    def _change(self, before: Waypoint, one: Waypoint, step: float, name: str) -> float:
        """Return the change of height between two waypoints, 0 if it is not known."""
        if one.role == "landing":
            return -self._height(before, f"to {name}")
        if before.altitude is not None and one.altitude is not None:
            if one.reference == before.reference and (one.reference != "ground" or step == 0.0):
                return one.altitude - before.altitude
            heights = self._above_home(before), self._above_home(one)
            if heights[0] is not None and heights[1] is not None:
                return heights[1] - heights[0]
            if one.reference == before.reference == "ground":
                self.unknown.append(TERRAIN)
                return one.altitude - before.altitude
        self.unknown.append(f"the climb to {name}: its altitudes cannot be compared")
        return 0.0

    def _above_home(self, one: Waypoint) -> float | None:
        home = None if self.plan.home is None else self.plan.home.altitude
        if one.altitude is None or one.reference == "home":
            return one.altitude
        # (files of autopilots write 0 m for an unknown height)
        return one.altitude - home if one.reference == "sea" and home else None

    def _height(self, one: Waypoint, where: str) -> float:
        """Return the height above the ground of the take-off or landing, 0 if it is not known."""
        height = one.altitude if one.reference == "ground" else self._above_home(one)
        if height is None and where:
            self.unknown.append(f"the climb {where}: its altitude above the ground is not known")
        return height or 0.0

    def circles(self) -> tuple[tuple[float, float, float], ...]:
        """Return radius, turns and commanded speed of the circles."""
        found = []
        for index, one in enumerate(self.plan.waypoints):
            if one.turns > 0.0 and one.loiter_radius > 0.0:
                found.append((one.loiter_radius, one.turns, math.inf if one.speed is None else one.speed))
            elif one.turns > 0.0:
                self.unknown.append(f"waypoint {index + 1}: the radius of its circle")
            elif one.loiter_radius > 0.0 and one.stay == 0.0:
                self.unknown.append(f"waypoint {index + 1}: how long it circles")
        return tuple(found)

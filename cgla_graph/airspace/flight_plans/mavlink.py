"""Mission items of MAVLink: those that fly to a place, those that do not, and those that are not supported."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.airspace.flight_plans.fence import Fence
from cgla_graph.airspace.flight_plans.given import GIVE_HOME, Given
from cgla_graph.airspace.flight_plans.mavlink_commands import DELAY, LAND_START, STILL, UNSUPPORTED
from cgla_graph.airspace.flight_plans.plan import (
    FlightPlan,
    Home,
    Reference,
    Role,
    Waypoint,
    check_place,
    fault,
    first_remarks,
    located,
)
from cgla_graph.airspace.flight_plans.vehicles import FIXED_WING, VTOLS
from cgla_graph.model.earth import wrapped

#: Commands (MAV_CMD) that fly to a place.
WAYPOINT, LOITER_UNLIMITED, LOITER_TURNS, LOITER_TIME, RETURN, LAND, TAKE_OFF = 16, 17, 18, 19, 20, 21, 22
LOITER_TO_ALTITUDE, SPLINE, VTOL_TAKE_OFF, VTOL_LAND, PAYLOAD_PLACE = 31, 82, 84, 85, 94
CHANGE_SPEED = 178
_FLOWN: Final[dict[int, Role]] = {
    WAYPOINT: "waypoint",
    LOITER_UNLIMITED: "waypoint",
    LOITER_TURNS: "waypoint",
    LOITER_TIME: "waypoint",
    LOITER_TO_ALTITUDE: "waypoint",
    SPLINE: "waypoint",
    PAYLOAD_PLACE: "touch-down",
    TAKE_OFF: "take-off",
    VTOL_TAKE_OFF: "take-off",
    LAND: "landing",
    VTOL_LAND: "landing",
}
#: Which parameter of a command, counted from 0, is the radius of the circle that it flies.
_RADIUS: Final = {LOITER_UNLIMITED: 2, LOITER_TURNS: 2, LOITER_TIME: 2, LOITER_TO_ALTITUDE: 1}
#: Parameters of a waypoint, counted from 0, within which the aircraft passes it: to accept it, and to pass it by.
PASSES: Final = (1, 2)
#: Turns that are none, radians.
_STRAIGHT: Final = 1e-3
#: Option of a VTOL's landing (NAV_VTOL_LAND_OPTIONS): it descends as a fixed wing.
_FORWARD_DESCENT: Final = 1.0
#: Headings of the transition of a VTOL's take-off (VTOL_TRANSITION_HEADING) that do not lead to the next waypoint.
_OTHER_HEADINGS: Final = {2.0, 3.0, 4.0}
#: MAV_AUTOPILOT_ARDUPILOTMEGA.
_ARDUPILOT: Final = 3
#: Frames (MAV_FRAME) of places on the Earth, and the references of their altitudes.
FRAMES: Final[dict[int, Reference]] = {0: "sea", 5: "sea", 3: "home", 6: "home", 10: "ground", 11: "ground"}
#: The frame that is written for each reference of altitudes.
FRAME_OF: Final[dict[Reference, int]] = {"sea": 0, "home": 3, "ground": 10}
#: The frame of commands that have no place.
MISSION_FRAME = 2
_LAST_FRAME = 21
#: Types of MAV_CMD_DO_CHANGE_SPEED for forward flight: speed through the air, and over the ground.
AIRSPEED, GROUNDSPEED = 0, 1
#: Its values for "as before" and for the aircraft's own speed.
_SAME_SPEED, USUAL_SPEED = -1.0, -2.0


@dataclass(frozen=True)
class Item:
    """
    One item of a mission.

    Attributes
    ----------
    where
        Name of the item in messages.
    frame, command
        Numbers of MAV_FRAME and MAV_CMD.
    numbers
        Its seven parameters; NaN for those that are left to the aircraft. The last three are latitude, longitude and
        altitude if the command has a place.
    reference
        Reference of the altitude, if the file gives it in another way than by the frame.
    continues
        Whether the aircraft flies on by itself after the item (``autoContinue``).
    doubt
        Why its height is not known; empty if it is.
    """

    where: str
    frame: int
    command: int
    numbers: tuple[float, ...]
    reference: Reference | None = None
    continues: bool = True
    doubt: str = ""


def plan_of(
    items: Sequence[Item],
    home: Home | None,
    name: str,
    remarks: Sequence[str] = (),
    *,
    given: Given | None = None,
    fence: Sequence[Fence] = (),
    has_rally_points: bool = False,
    vehicle: object = None,
    autopilot: object = None,
) -> FlightPlan:
    """
    Return the plan of a mission.

    Parameters
    ----------
    items
        The items, in order of flight.
    home
        Where the mission starts, if the file says so.
    name
        Name of the plan.
    remarks
        Remarks that precede those of the items.
    given
        What the user says of the flight.
    fence
        The fence of the plan.
    has_rally_points
        Whether the aircraft may return to another place than home.
    vehicle, autopilot
        Numbers of MAV_TYPE and MAV_AUTOPILOT, if the file says them.

    Raises
    ------
    PlanError
        If the command or frame of an item is not known, or does not determine where the aircraft flies.

    Examples
    --------
    >>> item = Item("item 1", 3, WAYPOINT, (0.0, 0.0, 0.0, math.nan, 60.17, 24.94, 80.0))
    >>> plan = plan_of([item], None, "mine")
    >>> plan.waypoints[0].altitude, plan.unknown[0][:15]
    (80.0, 'home is not set')
    """
    given = given or Given()
    home = given.home_of(home)
    reader = _Reader(home, list(remarks), given, vehicle, autopilot)
    if has_rally_points:
        reader.elsewhere.append("the rally points")
    if given.home is not None:
        reader.remarks.append(f"home is at longitude {given.home[0]:g}, latitude {given.home[1]:g}, as given")
    for item in items:
        reader.take(item)
    if not reader.waypoints:
        fault("the mission", "it has no item that flies to a place", "give at least one waypoint")
    reader.turn()
    unknown = reader.unknown
    if home is None:
        unknown.insert(0, f"home is not set: the file does not say where the aircraft comes from; {GIVE_HOME}")
    return FlightPlan(
        tuple(reader.waypoints),
        home,
        name,
        remarks=tuple(first_remarks(reader.remarks)),
        unknown=tuple(unknown),
        fence=tuple(fence),
        vehicle=vehicle if type(vehicle) is int else None,
        autopilot=autopilot if type(autopilot) is int else None,
        untimed=tuple(reader.untimed),
        untimed_in_wind=tuple(reader.untimed_in_wind),
    )


class _Reader:
    """State of reading a mission: the waypoints so far, the speed, and the item that ended the flight."""

    def __init__(self, home: Home | None, remarks: list[str], given: Given, vehicle: object, autopilot: object) -> None:
        self.home, self.remarks, self.given, self.vehicle = home, remarks, given, vehicle
        self.circles_home = vehicle == FIXED_WING or (type(vehicle) is int and vehicle in VTOLS)
        #: the height of a return, metres above home, and its source
        self.climb = given.climbs_to(is_ardupilot_plane=self.circles_home and autopilot == _ARDUPILOT)
        self.waypoints: list[Waypoint] = []
        self.unknown: list[str] = []
        self.untimed: list[str] = []
        self.untimed_in_wind: list[str] = []
        self.speed: float | None = None
        #: the part of the mission that ended the flight, or empty
        self.ended_by = ""
        #: places to which the aircraft may return instead of home
        self.elsewhere: list[str] = []
        #: items of the waypoints, by their numbers, whose distance the file leaves to the autopilot
        self.left_open: dict[int, str] = {}
        self.autopilot = autopilot

    def take(self, item: Item) -> None:
        if not 0 <= item.frame <= _LAST_FRAME:
            fault(item.where, f"its frame is {item.frame}", f"MAV_FRAME has 0 to {_LAST_FRAME}")
        if item.command == LAND_START:
            self.elsewhere.append("the start of the landing (DO_LAND_START)")
        if item.command == DELAY and self._delay(item):
            return
        if item.command in STILL:
            named = f"{STILL[item.command]} (command {item.command})"
            self.remarks.append(f"{item.where}: {named} does not fly to a place: left out")
            return
        if item.command == CHANGE_SPEED:
            self._change_speed(item)
            return
        if item.command != RETURN and item.command not in _FLOWN:
            named = UNSUPPORTED.get(item.command, "not known")
            remedy = "the file does not determine where it flies: take it out"
            fault(item.where, f"command {item.command} is {named}", remedy)
        if self.ended_by:
            fault(item.where, f"it flies on after {self.ended_by}", "a plan ends there: split the file in two")
        if item.command == RETURN:
            self._return(item)
        else:
            self._fly(item)

    def _delay(self, item: Item) -> bool:
        """Stay at the last waypoint; return False before the take-off, where the aircraft is on the ground."""
        if not self.waypoints or self.ended_by:
            return False
        seconds, last = item.numbers[0], self.waypoints[-1]
        if self.circles_home and last.role == "waypoint":
            last = replace(last, loiter_radius=max(last.loiter_radius, self._own_radius(item)))
            self.waypoints[-1] = last
        if seconds >= 0.0:
            with located(item.where):
                self.waypoints[-1] = replace(last, stay=last.stay + seconds)
        else:
            self.untimed.append(f"{item.where}: it stays until a time of day")
        return True

    def _change_speed(self, item: Item) -> None:
        """Change the speed of the next waypoints, if the item sets that of forward flight."""
        kind, speed = item.numbers[0], item.numbers[1]
        if kind not in {AIRSPEED, GROUNDSPEED}:
            self.remarks.append(f"{item.where}: a speed of type {kind:g} is not that of forward flight: left out")
        elif speed > 0.0:
            if kind == AIRSPEED:
                self.remarks.append(f"{item.where}: {speed:g} m/s is through the air; taken as over the ground")
                self.untimed_in_wind.append(
                    f"{item.where}: the speed over the ground, as it says {speed:g} m/s in the air"
                )
            # (a waypoint checks the range of its speed)
            self.speed = Waypoint(0.0, 0.0, speed=speed).speed
        elif speed == USUAL_SPEED:
            self.speed = None
        elif speed != _SAME_SPEED:
            fault(item.where, f"the speed is {speed:g}", "give one above 0 m/s, -1 (as before) or -2 (as usual)")

    def _return(self, item: Item) -> None:
        self.ended_by = "the return to home"
        if self.elsewhere:
            where = " or ".join(self.elsewhere)
            self.unknown.append(f"{item.where}: it returns home, or to {where}, as the aircraft is set: take one out")
        if self.home is None:
            self.unknown.append(f"{item.where}: it returns home, and the file does not say where that is; {GIVE_HOME}")
            return
        self.remarks.append(
            f"{item.where}: it climbs to {self.climb[1]}; the return is taken as straight, and as the landing"
        )
        self.waypoints += self._climb()
        if self.circles_home and (radius := self._own_radius(item)):
            last = self.waypoints[-1] if self.waypoints else Waypoint(self.home.x, self.home.y)
            above = Waypoint(self.home.x, self.home.y, last.altitude, last.reference, self.speed, loiter_radius=radius)
            self.waypoints.append(above)
        self.waypoints.append(Waypoint(self.home.x, self.home.y, 0.0, "home", self.speed, "landing"))

    def _climb(self) -> list[Waypoint]:
        """Return the waypoint above the last one to which the aircraft climbs before it returns, if it has to."""
        if not self.waypoints:
            return []
        last = self.waypoints[-1]
        height: float | None = self.climb[0]
        known = self.home is not None and self.home.altitude
        if last.reference == "sea" and known and height is not None:
            height += known
        elif last.reference != "home":
            # neither is known to be above the other
            height = None
        if last.altitude is None:
            height = None
        elif height is not None and height <= last.altitude:
            return []
        return [Waypoint(last.x, last.y, height, last.reference, self.speed)]

    def _fly(self, item: Item) -> None:
        if item.frame not in FRAMES:
            allowed = "a place on the Earth is in one of " + ", ".join(map(str, sorted(FRAMES)))
            fault(item.where, f"command {item.command} is in frame {item.frame}", allowed)
        role = _FLOWN[item.command]
        if role == "take-off" and self.waypoints:
            fault(item.where, "it takes off in flight", "a plan takes off once, first: split the file in two")
        place = self._place(item)
        if place is None:
            self.unknown.append(f"{item.where}: it is at home, and the file does not say where that is; {GIVE_HOME}")
            return
        self._note_shape(item)
        altitude = item.numbers[6]
        known = None if math.isnan(altitude) else altitude
        reference = item.reference or FRAMES[item.frame]
        radii = self._radius(item), self._pass_radius(item)
        with located(item.where):
            if item.command == LOITER_TO_ALTITUDE and radii[0] == 0.0 and self.waypoints:
                # (it hovers: it may go there at either altitude)
                last = self.waypoints[-1]
                self.waypoints.append(Waypoint(*place, last.altitude, last.reference, self.speed))
            self.waypoints.append(Waypoint(*place, known, reference, self.speed, role, *radii, *self._time_there(item)))
        if role == "landing":
            self.ended_by = "the landing"
        elif item.command == LOITER_UNLIMITED:
            self.ended_by = "circling without an end"

    def _note_shape(self, item: Item) -> None:
        """Note why an item leaves open where the aircraft flies to it or from it."""
        if item.doubt:
            self.unknown.append(f"{item.where}: {item.doubt}; save it again in QGroundControl")
        if item.command == TAKE_OFF and self.vehicle == FIXED_WING and not self._has_place(item):
            wrong = "a take-off without a place, and the aircraft does not climb vertically"
            self.unknown.append(f"{item.where}: {wrong}; give its latitude and longitude")
        if item.command == SPLINE:
            self.unknown.append(
                f"{item.where}: a spline waypoint, to and from which it flies curves; fly straight there"
            )
        if item.command == VTOL_TAKE_OFF and item.numbers[1] in _OTHER_HEADINGS:
            wrong = "its transition does not head for the next waypoint, and the file does not say how far it goes"
            self.unknown.append(f"{item.where}: {wrong}; give 1 as its parameter 2")
        if item.command == VTOL_LAND and item.numbers[0] == _FORWARD_DESCENT:
            wrong = "it descends in forward flight, on a pattern that is the aircraft's own"
            self.unknown.append(f"{item.where}: {wrong}; give 0 as its parameter 1, and the way down as waypoints")

    def _place(self, item: Item) -> tuple[float, float] | None:
        """Return where an item flies to; take-offs and landings may have no place of their own. None if not known."""
        latitude, longitude = item.numbers[4], item.numbers[5]
        if self._has_place(item):
            return check_place(item.where, longitude, latitude)
        is_open = math.isnan(latitude) and math.isnan(longitude)
        if _FLOWN[item.command] in {"waypoint", "touch-down"}:
            at = "no place" if is_open else "the place 0, 0, which some autopilots read as none"
            fault(item.where, f"it has {at}", "give its latitude and longitude")
        if self.waypoints:
            return self.waypoints[-1].x, self.waypoints[-1].y
        return None if self.home is None else (self.home.x, self.home.y)

    @staticmethod
    def _has_place(item: Item) -> bool:
        place = item.numbers[4], item.numbers[5]
        return not (math.isnan(place[0]) and math.isnan(place[1])) and place != (0.0, 0.0)

    def _radius(self, item: Item) -> float:
        """Return the radius of the circle that an item flies, 0 for none."""
        if item.command not in _RADIUS:
            return self._waits(item) if not item.continues else 0.0
        # (below 0, the circle is flown counter-clockwise)
        radius = abs(item.numbers[_RADIUS[item.command]])
        return radius if radius > 0.0 else self._own_radius(item)

    def _waits(self, item: Item) -> float:
        """Return the radius of the circle that it flies while it waits to be told to go on; 0 if it hovers."""
        if _FLOWN[item.command] != "waypoint":
            return 0.0
        if self.circles_home:
            return self._own_radius(item)
        self.remarks.append(f"{item.where}: it waits there for a command to continue (autoContinue is false)")
        return 0.0

    def _own_radius(self, item: Item) -> float:
        """Return the given radius of a circle that the file leaves to the aircraft; 0 if it hovers."""
        own = "circles of the aircraft's own radius, which the file does not say"
        if self.given.loiter_radius is None:
            remedy = "give it there, or --loiter-radius M (0 for an aircraft that hovers)"
            self.unknown.append(f"{item.where}: it may fly {own}; {remedy}")
            return 0.0
        self.remarks.append(f"{item.where}: it may fly {own}: {self.given.loiter_radius:g} m, as given")
        return self.given.loiter_radius

    def _time_there(self, item: Item) -> tuple[float, float]:
        """Return how often the circle of an item is flown (0 if it does not say), and how long it stays, seconds."""
        first = item.numbers[0]
        known = 0.0 if math.isnan(first) else abs(first)
        if item.command == LOITER_UNLIMITED:
            self.untimed.append(f"{item.where}: it circles without an end")
        if item.command == LOITER_TURNS:
            return known, 0.0
        return 0.0, known if item.command in {WAYPOINT, SPLINE, LOITER_TIME} else 0.0

    def _pass_radius(self, item: Item) -> float:
        """Return the distance at which a waypoint may be passed, 0 if it is flown over."""
        if _FLOWN[item.command] == "take-off":
            self.left_open[0] = item.where
        if item.command != WAYPOINT:
            return 0.0
        known = [abs(item.numbers[index]) for index in PASSES if not math.isnan(item.numbers[index])]
        radius = max(known, default=0.0)
        if radius == 0.0 and self.given.acceptance_radius is None:
            self.left_open[len(self.waypoints)] = item.where
        elif radius == 0.0:
            return self.given.acceptance_radius or 0.0
        else:
            self.remarks.append(f"{item.where}: its parameters 2 and 3 let it pass the waypoint at up to {radius:g} m")
        return radius

    def turn(self) -> None:
        """Say how far from their waypoints corners may be cut, where the file leaves it to the autopilot."""
        before = [] if self.home is None else [(self.home.x, self.home.y)]
        places = np.array([*before, *((one.x, one.y) for one in self.waypoints)])
        open_at = [
            number for number in (np.flatnonzero(turning(places)) - len(before)).tolist() if number in self.left_open
        ]
        if not open_at:
            return
        first = self.left_open[open_at[0]]
        where = f"{first} and {len(open_at) - 1} more" if len(open_at) > 1 else first
        given = self.given.acceptance_radius
        if given is not None:
            # (only a take-off is left open then)
            self.waypoints[0] = replace(self.waypoints[0], acceptance=given)
            return
        if self.circles_home:
            wrong = "the aircraft turns there on an arc, and the file does not say how far from the waypoint"
            remedy = "give that distance (parameter 2), or --acceptance-radius M"
            self.unknown.append(f"{where}: {wrong}; {remedy}")
            return
        radius, source = Given.turns_at(self.autopilot)
        early = "it may turn to the next waypoint early, and cut the corner"
        self.remarks.append(f"{where}: {early}: within {source}")
        for number in open_at:
            self.waypoints[number] = replace(self.waypoints[number], acceptance=radius)


def turning(lonlat: FloatArray) -> BoolArray:
    """
    Return at which of some places a route turns, shape ``(m,)``; nowhere at its ends, and where it stays in a place.

    Parameters
    ----------
    lonlat
        Places, shape ``(m, 2)``, degrees.

    Examples
    --------
    >>> turning(np.array([(24.0, 60.0), (24.1, 60.0), (24.1, 60.0), (24.1, 60.1), (24.1, 60.2)])).tolist()
    [False, True, True, False, False]
    """
    found = np.zeros(len(lonlat), dtype=bool)
    # places in a row that are equal are one
    group = np.concatenate([[0], np.cumsum((lonlat[1:] != lonlat[:-1]).any(axis=1))])
    places = lonlat[np.unique(group, return_index=True)[1]]
    if len(places) < 3:  # noqa: PLR2004 - two legs
        return found
    steps = np.diff(places, axis=0)
    steps[:, 0] = wrapped(steps[:, 0]) * np.cos(np.radians(0.5 * (places[1:, 1] + places[:-1, 1])))
    angles = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs(np.angle(np.exp(1j * np.diff(angles)))) > _STRAIGHT
    found[:] = np.concatenate([[False], turns, [False]])[group]
    return found

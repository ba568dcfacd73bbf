"""Tags of waypoints in files for viewers: altitude, role, speed and radius under one set of names."""

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Final, cast

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.plan import (
    Coordinates,
    FlightPlan,
    Home,
    Reference,
    Role,
    Waypoint,
    check_place,
    decimal,
    fault,
    located,
)
from cgla_graph.untrusted.numbers import plain_numbers

#: The role of home.
HOME: Final = "home"
#: Names of the tags, in the order in which they are written.
ROLE, ALTITUDE, REFERENCE, SPEED = "role", "altitude", "altitude_reference", "speed"
RADIUS, PASS_RADIUS, TURNS, STAY = "loiter_radius", "pass_radius", "turns", "stay"
NAMES: Final = (ROLE, ALTITUDE, REFERENCE, SPEED, RADIUS, PASS_RADIUS, TURNS, STAY)
#: Characters of a number, at most: the least double has 1077.
_LONGEST = 1200


def tags_of(one: Waypoint | Home) -> dict[str, str | float]:
    """
    Return the tags of a waypoint or home: all its data except its place.

    Examples
    --------
    >>> tags_of(Waypoint(24.0, 60.0, altitude=80.0))
    {'role': 'waypoint', 'altitude': 80.0, 'altitude_reference': 'home'}
    """
    if isinstance(one, Home):
        height: dict[str, str | float] = {} if one.altitude is None else {ALTITUDE: one.altitude, REFERENCE: "sea"}
        return {ROLE: HOME, **height}
    found: dict[str, str | float] = {ROLE: one.role}
    if one.altitude is not None:
        found[ALTITUDE] = one.altitude
    # (the reference is kept even without an altitude)
    found[REFERENCE] = one.reference
    if one.speed is not None:
        found[SPEED] = one.speed
    # (files for viewers have no autopilot whose default acceptance would count)
    numbers = {RADIUS: one.loiter_radius, PASS_RADIUS: max(one.pass_radius, one.acceptance)}
    numbers |= {TURNS: one.turns, STAY: one.stay}
    return {**found, **{name: value for name, value in numbers.items() if value}}


def text_tags(one: Waypoint | Home) -> dict[str, str]:
    """
    Return the tags of a waypoint or home as text.

    Examples
    --------
    >>> text_tags(Home(24.0, 60.0, 12.5))
    {'role': 'home', 'altitude': '12.5', 'altitude_reference': 'sea'}
    """
    return {name: value if isinstance(value, str) else decimal(value) for name, value in tags_of(one).items()}


def of_line(tags: Mapping[str, object]) -> dict[str, object]:
    """
    Return the tags of a line that are those of each of its waypoints: all but the role.

    Examples
    --------
    >>> of_line({"name": "mine", "role": "route", "altitude": 80})
    {'altitude': 80}
    """
    return {name: value for name, value in tags.items() if name in NAMES and name != ROLE}


def waypoint_of(place: tuple[float, float], tags: Mapping[str, object], where: str) -> Waypoint | Home:
    """
    Return the waypoint or home of a place and its tags.

    Parameters
    ----------
    place
        Longitude and latitude, degrees, or x and y.
    tags
        As `tags_of` returns them; numbers may be text. All are optional, and other names are ignored.
    where
        Name of the place in messages.

    Raises
    ------
    PlanError
        If a number is out of range, or a word is not known.

    Examples
    --------
    >>> waypoint_of((24.0, 60.0), {"role": "home", "altitude": "12"}, "row 1")
    Home(x=24.0, y=60.0, altitude=12.0)
    """
    named = (name for name in NAMES if name not in {ROLE, REFERENCE})
    numbers = {name: number_of(tags.get(name), f"{where}: {name}") for name in named}
    role = word_of(tags.get(ROLE), f"{where}: {ROLE}") or "waypoint"
    reference = word_of(tags.get(REFERENCE), f"{where}: {REFERENCE}")
    with located(where):
        if role == HOME:
            if reference not in {"", "sea"} and numbers[ALTITUDE] is not None:
                fault(REFERENCE, f"that of home is {reference}", "the altitude of home is above the sea")
            return Home(*place, numbers[ALTITUDE])
        return Waypoint(
            *place,
            numbers[ALTITUDE],
            cast("Reference", reference or "home"),
            numbers[SPEED],
            cast("Role", role),
            *(numbers[name] or 0.0 for name in (RADIUS, PASS_RADIUS, TURNS, STAY)),
        )


def word_of(value: object, where: str) -> str:
    """
    Return a word in lower case without surrounding blanks; empty for None.

    Examples
    --------
    >>> word_of(" Take-off ", "row 1"), word_of(None, "row 1")
    ('take-off', '')
    """
    if value is None:
        return ""
    if not isinstance(value, str):
        fault(where, f"it is {str(value)[:60]}", "give a word")
    return value.strip().lower()


def number_of(value: object, where: str) -> float | None:
    """
    Return a finite number, or None for None and blank text.

    Examples
    --------
    >>> number_of("12.5", "row 1"), number_of("", "row 1"), number_of(None, "row 1")
    (12.5, None, None)
    """
    if value is None or (isinstance(value, str) and not value.strip()):
        return None
    number = math.nan
    is_short = not isinstance(value, str) or len(value) <= _LONGEST
    if isinstance(value, str | int | float) and not isinstance(value, bool) and is_short:
        with suppress(ValueError, OverflowError):
            number = float(plain_numbers([value.strip()])[0]) if isinstance(value, str) else float(value)
    if not math.isfinite(number):
        fault(where, f"it is {shown(str(value))}", "give a finite number")
    return number


def place_of(parts: Sequence[object], where: str, *, in_plane: bool = False) -> tuple[float, float]:
    """
    Return longitude and latitude, or x and y in a plane, from two numbers or texts.

    Examples
    --------
    >>> place_of(["24.9", 60.2], "row 1")
    (24.9, 60.2)
    """
    x, y = (number_of(part, where) for part in parts)
    if in_plane and (x is None or y is None):
        fault(where, f"it is {shown(list(parts))}", "a waypoint has an x and a y")
    place = math.nan if x is None else x, math.nan if y is None else y
    return place if in_plane else check_place(where, *place)


def assemble_plan(
    found: Iterable[Waypoint | Home],
    name: str,
    remarks: Sequence[str],
    where: str,
    coordinates: Coordinates = "lonlat",
    unknown: Sequence[str] = (),
) -> FlightPlan:
    """
    Make a plan of waypoints and at most one home among them.

    Raises
    ------
    PlanError
        If there is a second home, no waypoint, or too many.
    """
    waypoints: list[Waypoint] = []
    home: Home | None = None
    for one in found:
        if isinstance(one, Waypoint):
            waypoints.append(one)
        elif home is None:
            home = one
        else:
            fault(where, "it has a second home", "a plan has one")
    with located(where):
        return FlightPlan(tuple(waypoints), home, name, coordinates, tuple(remarks), tuple(unknown))

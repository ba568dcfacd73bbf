"""
Columns of tables of waypoints: their names, with units, and those of Litchi's missions.

Litchi (a ground station for DJI's aircraft) writes ``altitude(m)``, ``altitudemode``, ``speed(m/s)``,
``curvesize(m)``, the distance from a waypoint at which a rounded turn begins, and ``actiontype1`` with
``actionparam1`` (and further ones): 0 is a stay, milliseconds.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.plan import Home, Waypoint, decimal, fault
from cgla_graph.airspace.flight_plans.tagged_waypoints import (
    ALTITUDE,
    PASS_RADIUS,
    RADIUS,
    REFERENCE,
    ROLE,
    SPEED,
    STAY,
    number_of,
)
from cgla_graph.model.earth import geodesic_length

#: The column that holds the size of a turn, and the one that holds the reference of altitudes, in Litchi's files.
CURVE, MODE = "curvesize", "altitudemode"
#: Columns of actions of Litchi's waypoints, and the number of the action that is a stay.
_ACTION, _ACTION_VALUE, _STAY = "actiontype", "actionparam", 0.0
_MODES: Final = {0.0: "home", 1.0: "ground"}
#: Other names of columns.
_SAME: Final = {"lon": "longitude", "lng": "longitude", "lat": "latitude", "alt": ALTITUDE}
#: A name and its unit: ``altitude(m)``, ``speed [m/s]``, ``altitude_ft``, ``longitude(deg)``.
_UNIT: Final = re.compile(
    r"([a-z_]+?)\s*(?:[(\[]\s*([^()\[\]]*?)\s*[)\]]|_(m|ft|feet|metres|meters|mps|kmh|mph|kn|kt))"
)
_METRE: Final = {"m": 1.0, "metre": 1.0, "metres": 1.0, "meter": 1.0, "meters": 1.0}
_FOOT: Final = {"ft": 0.3048, "feet": 0.3048, "foot": 0.3048}
_SPEEDS: Final = {
    **dict.fromkeys(("m/s", "mps", "ms-1"), 1.0),
    **dict.fromkeys(("km/h", "kmh", "kph"), 1.0 / 3.6),
    **dict.fromkeys(("mph",), 0.44704),
    **dict.fromkeys(("kn", "kt", "kts", "knots"), 1852.0 / 3600.0),
}
_DEGREES: Final = dict.fromkeys(("deg", "degree", "degrees", "\N{DEGREE SIGN}"), 1.0)
#: Factors of the units of each column.
_UNITS: Final[dict[str, dict[str, float]]] = {
    **dict.fromkeys((ALTITUDE, RADIUS, PASS_RADIUS, CURVE), _METRE | _FOOT),
    SPEED: _SPEEDS,
    **dict.fromkeys(("longitude", "latitude"), _DEGREES),
    **dict.fromkeys(("x", "y"), _METRE),
}
_ONCE: Final = {*_UNITS, MODE, REFERENCE, ROLE}
#: Parts of names of columns that are about the shape of the flight, and values that mean straight legs.
SHAPES: Final = (
    *("curve", "corner", "spline", "damping", "radius", "turnmode", "turn_mode", "turntype", "turn_type", "turn type"),
    *("command", "cmd", "loiter", "orbit", "circle", "flightmode", "flight_mode", "waypoint_type", "waypointtype"),
)
_WAYPOINTS: Final = {"16", "16.0", "waypoint", "nav_waypoint", "mav_cmd_nav_waypoint"}
_STRAIGHT: Final = {"", "0", "0.0", "false", "none", "no", *_WAYPOINTS}
#: Parts of names of columns that are about the reference of altitudes.
_HEIGHTS: Final = ("frame", "datum", "alt_type", "alttype", "altitude_type", "altitudetype", "altmode", "alt_mode")
#: What an aircraft does, in a column of any name: a plan says it by its roles and radii.
_DONE: Final = {
    *("rtl", "rth", "return", "return_to_launch", "return to launch", "return to home", "return_to_home", "go home"),
    *("land", "landing", "takeoff", "take off", "take_off", "vtol_takeoff", "vtol_land"),
    *("loiter", "loiter_time", "loiter_turns", "loiter_unlim", "orbit", "circle", "spline", "spline_waypoint"),
}


class Columns:
    """
    Columns of a table.

    Parameters
    ----------
    heads
        Their names, as the first line has them.
    where
        Name of the file in messages.

    Raises
    ------
    PlanError
        If a column has a unit that is not known.

    Examples
    --------
    >>> columns = Columns(["Latitude", "longitude", "altitude(ft)"], "a.csv")
    >>> columns.of_row(["60.1", "24.9", "100"], "line 2")["altitude"]
    '30.48'
    """

    def __init__(self, heads: Sequence[str], where: str) -> None:
        self.heads: list[str] = []
        self.factors: dict[str, float] = {}
        for head in (cell.strip().lower().lstrip("\N{ZERO WIDTH NO-BREAK SPACE}") for cell in heads):
            name, factor = _read_head(head, where)
            if name in self.heads and name in _ONCE:
                fault(where, f"its first line names the column {name} twice", "leave one of them out")
            self.heads.append(name)
            self.factors.setdefault(name, factor)
        self.numbers = {head: index for index, head in reversed([*enumerate(self.heads)])}

    def others(self, known: Sequence[str]) -> list[str]:
        """Return the columns that are not known."""
        return [head for head in self.heads if head and head not in {*known, CURVE, MODE}]

    def of_row(self, cells: Sequence[str], where: str) -> dict[str, str]:
        """
        Return the cells of a row by the names of their columns, in metres and metres per second.

        Raises
        ------
        PlanError
            If a cell that has a unit, or the mode of an altitude, is malformed.
        """
        row = {name: cells[index] for name, index in self.numbers.items() if index < len(cells)}
        for name, factor in self.factors.items():
            value = number_of(row.get(name), f"{where}: {name}") if factor != 1.0 else None
            if value is not None:
                row[name] = decimal(factor * value)
        if MODE in row:
            mode = number_of(row[MODE], f"{where}: {MODE}")
            if mode is not None and mode not in _MODES:
                fault(f"{where}: {MODE}", f"it is {mode:g}", "0 is above home and 1 above the ground")
            row.setdefault(REFERENCE, _MODES[mode] if mode is not None else "")
            # (of Litchi, a speed of 0 is that of the mission)
            if number_of(row.get(SPEED), f"{where}: {SPEED}") == 0.0:
                row[SPEED] = ""
        stays = [self._stay(row, name, where) for name in row if name.startswith(_ACTION)]
        if any(stays):
            row[STAY] = decimal(sum(stays))
        return row

    @staticmethod
    def _stay(row: Mapping[str, str], name: str, where: str) -> float:
        """Return the seconds of an action, 0 if it is no stay."""
        if number_of(row[name], f"{where}: {name}") != _STAY:
            return 0.0
        value = name.replace(_ACTION, _ACTION_VALUE)
        return (number_of(row.get(value), f"{where}: {value}") or 0.0) / 1000.0

    def curve_of(self, row: Mapping[str, str], where: str) -> float:
        """Return the size of the turn at a waypoint, metres; 0 for none."""
        size = number_of(row.get(CURVE), f"{where}: {CURVE}") or 0.0
        if size < 0.0:
            fault(f"{where}: {CURVE}", f"it is {size:g}", "give metres, 0 or more")
        return size

    def unknown_shape(self, row: Mapping[str, str], known: Sequence[str], where: str) -> str:
        """Return why a row leaves open where the aircraft flies: a column about its shape that is not known."""
        for name in self.others(known):
            value = row.get(name, "").strip()
            if value.lower().removeprefix("mav_cmd_").removeprefix("nav_") in _DONE:
                return f"{where}: {name} is {shown(value)}, which is not read; give a column {ROLE} or {RADIUS}"
            if (
                any(part in name for part in _HEIGHTS)
                and value
                and row.get(ALTITUDE, "").strip()
                and REFERENCE not in row
            ):
                return f"{where}: {name} is {shown(value)}, which is not read; give {REFERENCE} (home, ground, sea)"
            if any(part in name for part in SHAPES) and value.lower() not in _STRAIGHT:
                return (
                    f"{where}: {name} is {shown(value)}, which is not known; fly straight there, or give {PASS_RADIUS}"
                )
        return ""


def _read_head(head: str, where: str) -> tuple[str, float]:
    """Return the name of a column, and the factor of its unit."""
    parts = _UNIT.fullmatch(head)
    name, unit = (head, "") if parts is None else (parts[1], parts[2] or parts[3] or "")
    name = _SAME.get(name, name)
    if name not in _UNITS or not unit:
        return _SAME.get(head, name if not unit else head), 1.0
    if unit not in _UNITS[name]:
        fault(where, f"the unit of the column {shown(head)} is not known", f"give one of {', '.join(_UNITS[name])}")
    return name, _UNITS[name][unit]


def with_curves(
    found: Sequence[tuple[Waypoint | Home, float]],
) -> list[Waypoint | Home]:
    """
    Return waypoints that are passed at the distance of their turns.

    A turn of size ``s`` is an arc of that radius, or begins and ends at that distance on the legs. An arc that turns by
    an angle ``a`` begins ``s tan(a / 2)`` before the waypoint. It is taken as passed at the greater distance, but no
    farther than the next waypoints.

    Parameters
    ----------
    found
        Waypoints, and the sizes of their turns, metres.

    Examples
    --------
    >>> row = [(Waypoint(24.0, 60.0), 0.0), (Waypoint(24.1, 60.0), 30.0), (Waypoint(24.2, 60.0), 0.0)]
    >>> [one.pass_radius for one in with_curves(row)]
    [0.0, 30.0, 0.0]
    """
    turned: list[Waypoint | Home] = []
    flown = [one for one, _ in found if isinstance(one, Waypoint)]
    number = 0
    for one, size in found:
        if isinstance(one, Home):
            turned.append(one)
            continue
        if size > 0.0 and 0 < number < len(flown) - 1:
            reach = _reach(size, flown[number - 1 : number + 2])
            one = replace(one, pass_radius=max(reach, one.pass_radius))  # noqa: PLW2901 - the same waypoint
        turned.append(one)
        number += 1
    return turned


def _reach(size: float, three: Sequence[Waypoint]) -> float:
    """Return how far before and after the second of three waypoints a turn reaches, metres."""
    before, here, after = ((one.x, one.y) for one in three)
    legs = geodesic_length(before, here), geodesic_length(here, after)
    east = math.cos(math.radians(here[1]))
    first = math.atan2(here[1] - before[1], east * (here[0] - before[0]))
    second = math.atan2(after[1] - here[1], east * (after[0] - here[0]))
    turn = abs(math.remainder(second - first, 2.0 * math.pi))
    arc = size * math.tan(min(0.5 * turn, 0.4999 * math.pi))
    return max(size, min(arc, max(legs)))

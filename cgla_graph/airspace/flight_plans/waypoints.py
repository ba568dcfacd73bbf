"""Waypoint files of MAVLink ground stations (``.waypoints``): ``QGC WPL 110``, a mission item a line."""

import math
from typing import Final

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.mavlink import WAYPOINT, Item, items_of, plan_of
from cgla_graph.airspace.flight_plans.plan import MOST_WAYPOINTS, FlightPlan, Home, check_place, decimal, fault, located

#: What the first line says. Of version 110 the first item is home, of version 120 there is none.
SIGNATURE: Final = "QGC WPL"
_WITH_HOME, _WITHOUT_HOME = "110", "120"
#: index, current, frame, command, seven parameters, autocontinue
_COLUMNS = 12
#: Items of a file, at most: some waypoints have one that flies nowhere.
_MOST_ITEMS = 2 * MOST_WAYPOINTS
#: Digits of a whole number, and characters of any number, at most: the least double has 1077.
_MOST_DIGITS, _LONGEST = 9, 1200
_GLOBAL_FRAME = 0


def read_text(text: str, where: str) -> FlightPlan:
    r"""
    Return the plan of a file's text.

    Parameters
    ----------
    text
        Columns with tabs or blanks between them; lines that begin with ``#`` are left out.
    where
        What messages call the file.

    Raises
    ------
    PlanError
        If it is malformed, or holds what cannot be told.

    Examples
    --------
    >>> lines = ["QGC WPL 110", "0 1 0 16 0 0 0 0 60.0 24.0 12 1", "1 0 3 16 0 0 0 0 60.1 24.1 80 1"]
    >>> plan = read_text("\n".join(lines), "mine.waypoints")
    >>> plan.home, plan.waypoints[0].altitude
    (Home(x=24.0, y=60.0, altitude=12.0), 80.0)
    """
    with located(where):
        return _read(text.splitlines())


def _read(lines: list[str]) -> FlightPlan:
    """Return the plan of a file's lines; errors say which of them is wrong."""
    head = lines[0].split() if lines else []
    if head[:2] != SIGNATURE.split() or len(head) != 3 or head[2] not in {_WITH_HOME, _WITHOUT_HOME}:  # noqa: PLR2004
        said = shown(lines[0].strip()) if lines else "missing"
        fault("line 1", f"it is {said}", f"'{SIGNATURE} {_WITH_HOME}' is read, and {_WITHOUT_HOME}")
    rows = [_item(line, f"line {number}", len_so_far) for len_so_far, (number, line) in enumerate(_filled(lines))]
    home = None
    if head[2] == _WITH_HOME and rows:
        first = rows.pop(0)
        home = _home(first)
    return plan_of(rows, home, "")


def _filled(lines: list[str]) -> list[tuple[int, str]]:
    numbered = enumerate(lines[1:], start=2)
    return [(number, line) for number, line in numbered if line.strip() and not line.lstrip().startswith("#")]


def _item(line: str, where: str, before: int) -> Item:
    if before > _MOST_ITEMS:
        fault(where, f"it is item {before} of the file", f"at most {_MOST_ITEMS} are read")
    cells = line.split()
    if len(cells) != _COLUMNS:
        fault(where, f"it has {len(cells)} columns", f"an item has {_COLUMNS}, with a tab between two of them")
    index, _, frame, command, _ = (_whole(cell, where) for cell in (*cells[:4], cells[-1]))
    if index != before:
        fault(where, f"its index is {index}", f"items are numbered from 0, so that it has to be {before}")
    return Item(where, frame, command, tuple(_number(cell, where) for cell in cells[4:-1]))


def _whole(cell: str, where: str) -> int:
    digits = cell.removeprefix("-")
    if len(digits) > _MOST_DIGITS or not (digits.isascii() and digits.isdigit()):
        fault(where, f"it holds {shown(cell)}", "index, current, frame, command and autocontinue are whole numbers")
    return int(cell)


def _number(cell: str, where: str) -> float:
    try:
        number = float(cell) if "_" not in cell and len(cell) <= _LONGEST else math.inf
    except ValueError:
        number = math.inf
    if math.isinf(number):
        fault(where, f"it holds {shown(cell)}", "parameters are finite numbers, or nan for what is left open")
    return number


def _home(item: Item) -> Home | None:
    """Return the home that the first item says; 0, 0 stands for one that was not set."""
    latitude, longitude, altitude = item.numbers[4:]
    # Mission Planner writes command 0
    if item.command not in {0, WAYPOINT}:
        fault(item.where, f"the home is an item with command {item.command}", f"it has {WAYPOINT}: put a home first")
    if (latitude, longitude) == (0.0, 0.0):
        return None
    known = item.frame == _GLOBAL_FRAME and not math.isnan(altitude)
    return Home(*check_place(item.where, longitude, latitude), altitude if known else None)


def write(plan: FlightPlan, where: str) -> str:
    """
    Write a plan; its name is no part of such files.

    Parameters
    ----------
    plan
        The plan. Without a home, its first waypoint is that; a home whose height is not known is at 0 m.
    where
        What messages call the file.

    Raises
    ------
    PlanError
        If an autopilot cannot fly it (see `cgla_graph.airspace.flight_plans.mavlink.items_of`).

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.1)], altitude=80)
    >>> print(write(plan, "mine.waypoints").expandtabs(1), end="")
    QGC WPL 110
    0 1 0 16 0 0 0 0 60 24 0 1
    1 0 3 22 0 0 0 0 60 24 80 1
    2 0 3 16 0 0 0 0 60.1 24.1 80 1
    3 0 3 21 0 0 0 0 60.1 24.1 0 1
    """
    first = plan.waypoints[0]
    home = plan.home or Home(first.x, first.y)
    start = (0.0, 0.0, 0.0, 0.0, home.y, home.x, home.altitude or 0.0)
    items = [Item(where, _GLOBAL_FRAME, WAYPOINT, start), *items_of(plan, where)]
    lines = [f"{SIGNATURE} {_WITH_HOME}"]
    for index, item in enumerate(items):
        # the heading, which is left to the aircraft, is 0 here: not every ground station reads nan
        numbers = [decimal(0.0 if math.isnan(value) else value) for value in item.numbers]
        lines.append("\t".join([str(index), str(int(index == 0)), str(item.frame), str(item.command), *numbers, "1"]))
    return "\n".join(lines) + "\n"

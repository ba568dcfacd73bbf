"""Waypoint files of MAVLink ground stations (``.waypoints``, ``QGC WPL 110``): one mission item per line."""

import math
from typing import Final

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.given import Given
from cgla_graph.airspace.flight_plans.mavlink import WAYPOINT, Item, plan_of
from cgla_graph.airspace.flight_plans.mission_items import items_of
from cgla_graph.airspace.flight_plans.plan import MOST_WAYPOINTS, FlightPlan, Home, check_place, decimal, fault, located
from cgla_graph.untrusted.numbers import plain_numbers

#: Start of the first line. In version 110 the first item is home; version 120 has no home.
SIGNATURE: Final = "QGC WPL"
_WITH_HOME, _WITHOUT_HOME = "110", "120"
#: index, current, frame, command, seven parameters, autocontinue
_COLUMNS = 12
#: Items of a file, at most: a waypoint may have a second item that does not fly to a place.
_MOST_ITEMS = 2 * MOST_WAYPOINTS
#: Digits of a whole number, and characters of any number, at most: the least double has 1077.
_MOST_DIGITS, _LONGEST = 9, 1200
_GLOBAL_FRAME = 0


def read_text(text: str, where: str, given: Given | None = None) -> FlightPlan:
    r"""
    Return the plan of the text of a file, named `where` in messages, and flown as `given` says.

    Columns are separated by tabs or spaces; lines that begin with ``#`` are left out.

    Raises
    ------
    PlanError
        If it is malformed, or does not determine where the aircraft flies.

    Examples
    --------
    >>> lines = ["QGC WPL 110", "0 1 0 16 0 0 0 0 60.0 24.0 12 1", "1 0 3 16 0 0 0 0 60.1 24.1 80 1"]
    >>> plan = read_text("\n".join(lines), "mine.waypoints")
    >>> plan.home, plan.waypoints[0].altitude
    (Home(x=24.0, y=60.0, altitude=12.0), 80.0)
    """
    with located(where):
        return _read(text.splitlines(), given)


def _read(lines: list[str], given: Given | None) -> FlightPlan:
    """Return the plan of a file's lines; errors name the line."""
    head = lines[0].split() if lines else []
    if head[:2] != SIGNATURE.split() or len(head) != 3 or head[2] not in {_WITH_HOME, _WITHOUT_HOME}:  # noqa: PLR2004
        said = shown(lines[0].strip()) if lines else "missing"
        fault("line 1", f"it is {said}", f"'{SIGNATURE} {_WITH_HOME}' is read, and {_WITHOUT_HOME}")
    numbered = enumerate(lines[1:], start=2)
    filled = [(number, line) for number, line in numbered if line.strip() and not line.lstrip().startswith("#")]
    rows = [_item(line, f"line {number}", index) for index, (number, line) in enumerate(filled)]
    home = _home(rows.pop(0)) if head[2] == _WITH_HOME and rows else None
    return plan_of(rows, home, "", given=given)


def _item(line: str, where: str, before: int) -> Item:
    if before > _MOST_ITEMS:
        fault(where, f"it is item {before} of the file", f"at most {_MOST_ITEMS} are read")
    cells = line.split()
    if len(cells) != _COLUMNS:
        fault(where, f"it has {len(cells)} columns", f"an item has {_COLUMNS}, with a tab between two of them")
    index, _, frame, command, continues = (_whole(cell, where) for cell in (*cells[:4], cells[-1]))
    if index != before:
        fault(where, f"its index is {index}", f"items are numbered from 0, so that it has to be {before}")
    return Item(where, frame, command, tuple(_number(cell, where) for cell in cells[4:-1]), continues=continues != 0)


def _whole(cell: str, where: str) -> int:
    digits = cell.removeprefix("-")
    if len(digits) > _MOST_DIGITS or not (digits.isascii() and digits.isdigit()):
        fault(where, f"it holds {shown(cell)}", "index, current, frame, command and autocontinue are whole numbers")
    return int(cell)


def _number(cell: str, where: str) -> float:
    try:
        number = float(plain_numbers([cell])[0]) if len(cell) <= _LONGEST else math.inf
    except ValueError:
        number = math.inf
    if math.isinf(number):
        fault(where, f"it holds {shown(cell)}", "parameters are finite numbers, or nan for open values")
    return number


def _home(item: Item) -> Home | None:
    """Return the home of the first item; None at 0, 0, which stands for a home that was not set."""
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
    Write a plan to a file named `where` in messages; such files have no name of the plan.

    Without a home, the first waypoint is the home; a home of unknown height is at 0 m.

    Raises
    ------
    PlanError
        If an autopilot cannot fly it (see `cgla_graph.airspace.flight_plans.mission_items.items_of`).

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
        # a heading that is left to the aircraft is written as 0: not every ground station reads nan
        numbers = [decimal(0.0 if math.isnan(value) else value) for value in item.numbers]
        lines.append("\t".join([str(index), str(int(index == 0)), str(item.frame), str(item.command), *numbers, "1"]))
    return "\n".join(lines) + "\n"

"""Plans as tables (``.csv``), one waypoint per row: as `Solution.save` writes them, or with altitudes."""

import csv
import io
from collections.abc import Iterator, Sequence
from typing import Final

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Waypoint, decimal, fault, few_read
from cgla_graph.airspace.flight_plans.tagged_waypoints import (
    NAMES,
    assemble_plan,
    place_of,
    tags_of,
    text_tags,
    waypoint_of,
)

#: Other names of columns.
_SAME: Final = {"lon": "longitude", "lng": "longitude", "lat": "latitude", "alt": "altitude"}
_DEGREES, _PLANE = ("longitude", "latitude"), ("x", "y")


def read_text(text: str, where: str) -> FlightPlan:
    r"""
    Return the plan of a table.

    Parameters
    ----------
    text
        Its first line names the columns: ``longitude`` and ``latitude``, degrees (or ``lon`` and ``lat``), else ``x``
        and ``y``, map units; the columns `NAMES` are optional.
    where
        Name of the file in messages.

    Raises
    ------
    PlanError
        If it is malformed.

    Examples
    --------
    >>> read_text("x,y,longitude,latitude\n0.0,0.0,24.0,60.0\n", "path.csv").lonlat.tolist()
    [[24.0, 60.0]]
    """
    rows = _rows(text, where)
    heads = [_SAME.get(head, head) for head in (cell.strip().lower() for cell in next(rows, (0, []))[1])]
    pair = next((pair for pair in (_DEGREES, _PLANE) if set(pair) <= set(heads)), None)
    if pair is None:
        said = f"its first line is {shown(','.join(heads))}" if heads else "it is empty"
        fault(where, said, "the first line names the columns, longitude,latitude or x,y among them")
    columns = {head: index for index, head in reversed([*enumerate(heads)])}
    known = {*_DEGREES, *_PLANE, *NAMES}
    others = [head for head in heads if head and head not in known]
    remarks = [f"columns that are not part of a plan, left out: {', '.join(others)[:200]}"] if others else []
    found = (_waypoint(cells, columns, pair, f"{where}: line {number}") for number, cells in rows)
    return assemble_plan(found, "", remarks, where, coordinates="lonlat" if pair == _DEGREES else "plane")


def _rows(text: str, where: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the numbers and cells of the lines that are not blank."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        filled = (cells for cells in reader if any(cell.strip() for cell in cells))
        for number, cells in enumerate(filled):
            few_read(number, where)
            yield reader.line_num, cells
    except csv.Error as error:
        fault(f"{where}: line {reader.line_num}", f"it is no CSV ({error})", "write numbers with commas between them")


def _waypoint(cells: Sequence[str], columns: dict[str, int], pair: tuple[str, str], where: str) -> Waypoint | Home:
    said = {name: cells[index] for name, index in columns.items() if index < len(cells)}
    return waypoint_of(place_of([said.get(name) for name in pair], where, in_plane=pair == _PLANE), said, where)


def write(plan: FlightPlan) -> str:
    """
    Write a plan as a table; such files have no name of the plan.

    Examples
    --------
    >>> print(write(FlightPlan((Waypoint(24.0, 60.0), Waypoint(24.1, 60.1, 80.0, speed=12.0)))), end="")
    longitude,latitude,role,altitude,altitude_reference,speed
    24,60,waypoint,,home,
    24.1,60.1,waypoint,80,home,12
    """
    found = plan.marks
    used = {name for one in found for name in tags_of(one)}
    names = [name for name in NAMES if name in used]
    pair = _DEGREES if plan.coordinates == "lonlat" else _PLANE
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*pair, *names])
    for one in found:
        tags = text_tags(one)
        writer.writerow([decimal(one.x), decimal(one.y), *(tags.get(name, "") for name in names)])
    return text.getvalue()

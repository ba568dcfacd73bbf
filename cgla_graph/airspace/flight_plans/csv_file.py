"""Plans as tables (``.csv``), one waypoint per row: as `Solution.save` writes them, or with altitudes."""

import csv
import io
from collections.abc import Iterator

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.csv_columns import Columns, with_curves
from cgla_graph.airspace.flight_plans.plan import (
    Coordinates,
    FlightPlan,
    Home,
    Waypoint,
    decimal,
    fault,
    few_read,
    first_remarks,
)
from cgla_graph.airspace.flight_plans.tagged_waypoints import (
    NAMES,
    assemble_plan,
    place_of,
    tags_of,
    text_tags,
    waypoint_of,
)

_DEGREES, _PLANE = ("longitude", "latitude"), ("x", "y")


def read_text(text: str, where: str) -> FlightPlan:
    r"""
    Return the plan of a table.

    Parameters
    ----------
    text
        Its first line names the columns: ``longitude`` and ``latitude``, degrees (or ``lon`` and ``lat``), else ``x``
        and ``y``, map units; the columns `NAMES` are optional, also with units (``altitude(ft)``), and those of Litchi
        are known (`cgla_graph.airspace.flight_plans.csv_columns`).
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
    columns = Columns(next(rows, (0, []))[1], where)
    heads = columns.heads
    pair = next((pair for pair in (_DEGREES, _PLANE) if set(pair) <= set(heads)), None)
    if pair is None:
        said = f"its first line is {shown(','.join(heads))}" if heads else "it is empty"
        fault(where, said, "the first line names the columns, longitude,latitude or x,y among them")
    known = (*_DEGREES, *_PLANE, *NAMES)
    others = columns.others(known)
    remarks = [f"columns that are not part of a plan, left out: {', '.join(others)[:200]}"] if others else []
    found: list[tuple[Waypoint | Home, float]] = []
    unknown: list[str] = []
    for number, cells in rows:
        place = f"{where}: line {number}"
        row = columns.of_row(cells, place)
        at = place_of([row.get(name) for name in pair], place, in_plane=pair == _PLANE)
        found.append((waypoint_of(at, row, place), columns.curve_of(row, place)))
        unknown += filter(None, [columns.unknown_shape(row, known, f"line {number}")])
    curved = sum(size > 0.0 for _, size in found)
    if curved:
        remarks.append(f"{curved} waypoints with rounded turns: each is passed within the size of its turn")
    coordinates: Coordinates = "lonlat" if pair == _DEGREES else "plane"
    if curved and coordinates == "plane":
        fault(where, "its turns are in metres, and its places in x and y", "give longitude and latitude")
    return assemble_plan(with_curves(found), "", remarks, where, coordinates, tuple(first_remarks(unknown)))


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

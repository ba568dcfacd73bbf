"""Paths as ``Solution.save`` writes them to ``.json``, and as ``cgla plan --json`` prints them."""

from collections.abc import Mapping
from typing import Any

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.plan import MOST_WAYPOINTS, FlightPlan, Waypoint, fault
from cgla_graph.airspace.flight_plans.tagged_waypoints import assembled, number_of, place_of

#: Where such files have degrees, and map units.
KEYS = ("path_lonlat", "path")


def read_document(document: Mapping[str, Any], where: str) -> FlightPlan:
    """
    Return the plan of a document: the degrees in it, or map units where it has none.

    Raises
    ------
    PlanError
        If it is malformed.

    Examples
    --------
    >>> read_document({"path": [[0.0, 0.5], [1.0, 1.0]]}, "path.json").coordinates
    'plane'
    """
    key = next(key for key in KEYS if key in document)
    rows = document[key]
    if not isinstance(rows, list) or len(rows) > MOST_WAYPOINTS:
        fault(where, f"its {key} is {shown(rows)}", f"give a list of at most {MOST_WAYPOINTS} pairs of numbers")
    in_degrees = key == KEYS[0]
    found = (_waypoint(row, f"{where}: {key}, {index}", in_degrees=in_degrees) for index, row in enumerate(rows))
    return assembled(found, "", (), where, coordinates="lonlat" if in_degrees else "plane")


def _waypoint(row: object, where: str, *, in_degrees: bool) -> Waypoint:
    if not isinstance(row, list) or len(row) != 2 or any(isinstance(value, str) for value in row):  # noqa: PLR2004
        fault(where, f"it is {shown(row)}", "a waypoint is two numbers")
    if in_degrees:
        return Waypoint(*place_of(row, where))
    x, y = (number_of(value, where) for value in row)
    if x is None or y is None:
        fault(where, f"it is {shown(row)}", "a waypoint is two numbers")
    return Waypoint(x, y)

"""Landing patterns of QGroundControl's plan files (``fwLandingPattern``, ``vtolLandingPattern``), as simple items."""

import math
from collections.abc import Mapping
from typing import Any, Final

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.mavlink import (
    FRAME_OF,
    LAND,
    LOITER_TO_ALTITUDE,
    MISSION_FRAME,
    VTOL_LAND,
    WAYPOINT,
    Item,
)
from cgla_graph.airspace.flight_plans.mavlink_commands import LAND_START
from cgla_graph.airspace.flight_plans.plan import MOST_RADIUS, Reference, fault, finite

#: The command that lands, by the type of the complex item.
PATTERNS: Final = {"fwLandingPattern": LAND, "vtolLandingPattern": VTOL_LAND}
_COORDINATE = 3


def pattern_items(pattern: Mapping[str, Any], where: str) -> list[Item]:
    """
    Return the items that QGroundControl sends for a landing pattern: approach with or without a circle, and landing.

    Parameters
    ----------
    pattern
        The complex item. Its type is one of `PATTERNS`.
    where
        Its name in messages.

    Raises
    ------
    PlanError
        If a field is missing or malformed.

    Examples
    --------
    >>> pattern = {"complexItemType": "fwLandingPattern", "altitudesAreRelative": True, "useLoiterToAlt": True,
    ...            "landingApproachCoordinate": [60.0, 24.0, 40.0], "landCoordinate": [60.01, 24.0, 0.0],
    ...            "loiterRadius": 75, "loiterClockwise": True}
    >>> [item.command for item in pattern_items(pattern, "item 3")]
    [189, 31, 21]
    """
    approach, landing = (
        _coordinate(next((pattern[key] for key in keys if key in pattern), None), f"{where}: {keys[0]}")
        for keys in (("landingApproachCoordinate", "loiterCoordinate"), ("landCoordinate",))
    )
    frames = [FRAME_OF[_reference(pattern, key, where)] for key in ("loiterAltitudeRelative", "landAltitudeRelative")]
    items = [Item(where, MISSION_FRAME, LAND_START, (0.0,) * 7)]
    # (files of before this field always have the circle)
    if pattern.get("useLoiterToAlt", True):
        radius = finite(f"{where}: loiterRadius", pattern.get("loiterRadius"), -MOST_RADIUS, MOST_RADIUS, " m")
        items.append(Item(where, frames[0], LOITER_TO_ALTITUDE, (1.0, radius, 0.0, 1.0, *approach)))
    else:
        items.append(Item(where, frames[0], WAYPOINT, (0.0, 0.0, 0.0, math.nan, *approach)))
    command = PATTERNS[str(pattern.get("complexItemType"))]
    return [*items, Item(where, frames[1], command, (0.0, 0.0, 0.0, math.nan, *landing))]


def _coordinate(value: object, where: str) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != _COORDINATE:
        fault(where, f"it is {shown(value)}", "give [latitude, longitude, altitude]")
    return tuple(finite(where, part, -1e6, 1e6) for part in value)


def _reference(pattern: Mapping[str, Any], old: str, where: str) -> Reference:
    """Return the reference of an altitude; files of version 1 have a field for each."""
    relative = pattern.get("altitudesAreRelative", pattern.get(old))
    if not isinstance(relative, bool):
        fault(
            where, f"its altitudesAreRelative is {shown(relative)}", "it is true (above home) or false (above the sea)"
        )
    return "home" if relative else "sea"

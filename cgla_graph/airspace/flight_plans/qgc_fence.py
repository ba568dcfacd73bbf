"""The fence of a plan file of QGroundControl (``geoFence``, version 2), read and written."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.fence import Fence, FenceShape
from cgla_graph.airspace.flight_plans.plan import MOST_RADIUS, check_place, fault, finite

#: The version that is read and written.
VERSION: Final = 2
#: MAV_AUTOPILOT_PX4, which asks for one of the inclusions; others may ask for all of them.
_PX4: Final = 12
_LEAST_CORNERS = 3
#: Keys that have no area: the place of the return, and limits that are parameters of the autopilot.
_NO_AREAS: Final = {"version", "circles", "polygons", "breachReturn"}


def read_fence(table: Mapping[str, Any], firmware: object, where: str) -> tuple[Fence, ...]:
    """
    Return the rules of a fence.

    PX4 asks that the aircraft is inside one of the inclusions; of other autopilots, each inclusion is a rule.

    Parameters
    ----------
    table
        The object ``geoFence``.
    firmware
        ``firmwareType`` of the mission.
    where
        Its name in messages.

    Raises
    ------
    PlanError
        If it is malformed, or of a version that is not documented.

    Examples
    --------
    >>> circle = {"center": [60.0, 24.0], "radius": 500}
    >>> table = {"circles": [{"circle": circle, "inclusion": False}], "polygons": [], "version": 2}
    >>> read_fence(table, 12, "geoFence")[0].name
    "exclusion 1 of the plan's fence"
    """
    entries = {part: table.get(part, []) for part in ("polygons", "circles")}
    for part, listed in entries.items():
        if not isinstance(listed, list):
            fault(where, f"the {part} of its geoFence are {shown(listed)}", "they are a list")
    others = sorted(key for key in table if key not in _NO_AREAS and table[key])
    if others or (any(entries.values()) and table.get("version", VERSION) != VERSION):
        wrong = f"its geoFence has the version {shown(table.get('version'))} and the keys {shown(sorted(table))}"
        fault(where, wrong, f"polygons and circles of version {VERSION} are read: save it again in QGroundControl")
    shapes: dict[bool, list[FenceShape]] = {True: [], False: []}
    for part, listed in entries.items():
        for number, entry in enumerate(listed, start=1):
            place = f"{where}: {part[:-1]} {number} of its geoFence"
            inclusion = entry.get("inclusion") if isinstance(entry, dict) else None
            if not isinstance(inclusion, bool):
                fault(place, f"it is {shown(entry)}", "it is an object whose inclusion is true or false")
            shapes[inclusion].append(_polygon(entry, place) if part == "polygons" else _circle(entry, place))
    inside = [tuple(shapes[True])] if firmware == _PX4 and shapes[True] else [(shape,) for shape in shapes[True]]
    rules = [(True, one) for one in inside] + [(False, (one,)) for one in shapes[False]]
    return tuple(Fence(_named(rules, index), inclusion, one) for index, (inclusion, one) in enumerate(rules))


def _named(rules: Sequence[tuple[bool, tuple[FenceShape, ...]]], index: int) -> str:
    inclusion = rules[index][0]
    number = 1 + sum(one[0] is inclusion for one in rules[:index])
    return f"{'inclusion' if inclusion else 'exclusion'} {number} of the plan's fence"


def _polygon(entry: Mapping[str, Any], where: str) -> FenceShape:
    corners = entry.get("polygon")
    if not isinstance(corners, list) or len(corners) < _LEAST_CORNERS:
        fault(where, f"its corners are {shown(corners)}", f"give {_LEAST_CORNERS} or more of [latitude, longitude]")
    found = tuple(_place(corner, where) for corner in corners)
    return FenceShape(found[:-1] if found[0] == found[-1] and len(found) > _LEAST_CORNERS else found)


def _circle(entry: Mapping[str, Any], where: str) -> FenceShape:
    circle = entry.get("circle")
    if not isinstance(circle, dict):
        fault(where, f"it is {shown(circle)}", "give its center and radius")
    radius = finite(f"{where}: radius", circle.get("radius"), 0.0, MOST_RADIUS, " m")
    if radius == 0.0:
        fault(where, "its radius is 0", "give metres, above 0")
    return FenceShape((_place(circle.get("center"), where),), radius)


def _place(value: object, where: str) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) < 2:  # noqa: PLR2004 - a pair
        fault(where, f"one of its places is {shown(value)}", "give [latitude, longitude]")
    latitude, longitude = (finite(where, part, -360.0, 360.0) for part in value[:2])
    return check_place(where, longitude, latitude)


def fence_document(fence: Sequence[Fence]) -> dict[str, Any]:
    """
    Return a fence as QGroundControl writes it.

    Examples
    --------
    >>> fence_document(())
    {'circles': [], 'polygons': [], 'version': 2}
    """
    document: dict[str, Any] = {"circles": [], "polygons": [], "version": VERSION}
    for rule in fence:
        for shape in rule.shapes:
            places = [[y, x] for x, y in shape.corners]
            entry: dict[str, Any] = {"inclusion": rule.inclusion, "version": 1}
            if shape.is_circle:
                document["circles"].append({"circle": {"center": places[0], "radius": shape.radius}, **entry})
            else:
                document["polygons"].append({**entry, "polygon": places})
    return document

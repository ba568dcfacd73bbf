"""
Plan files of QGroundControl (``.plan``), in JSON, as its developer guide documents them.

Simple items are read, also those inside surveys and corridor scans, landing patterns and the fence; other items that
fly are an error.
"""

import json
import math
import sys
from collections.abc import Iterator, Mapping
from typing import Any, Final

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.given import Given
from cgla_graph.airspace.flight_plans.landing_patterns import PATTERNS, pattern_items
from cgla_graph.airspace.flight_plans.mavlink import FRAMES, Item, plan_of
from cgla_graph.airspace.flight_plans.mission_items import items_of
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Reference, check_place, fault, located
from cgla_graph.airspace.flight_plans.qgc_fence import fence_document, read_fence

#: Altitude modes of QGroundControl (AltMode) by the reference of the altitude.
_ALTITUDE_MODES: Final[dict[Reference, int]] = {"home": 1, "sea": 2, "ground": 4}
#: The altitude mode of a mission whose items have different modes.
_MIXED = 0
#: Frames of the altitude modes, of this enumeration and of the one of before version 4, in which 1 is above the sea.
_FRAMES_OF_MODES: Final = {1: {0, 3, 5, 6}, 2: {0, 5}, 3: {0, 5}, 4: {10, 11}}
#: Difference of heights that are the same, metres.
_SAME_HEIGHT: Final = 0.01
#: The altitude mode of an item above the ground whose parameter is the altitude above the sea.
_ABOVE_TERRAIN = 3
#: MAV_AUTOPILOT_GENERIC and MAV_TYPE_QUADROTOR: any autopilot, and a vehicle that takes off and lands vertically.
_FIRMWARE, _VEHICLE = 0, 2
#: Speeds that the file needs if the plan has none (m/s): QGroundControl's defaults.
_CRUISE, _HOVER = 15.0, 5.0
_PARAMETERS = 7
#: Key of the simple items inside a complex item.
_TRANSECTS = "TransectStyleComplexItem"


def read_document(document: Mapping[str, Any], where: str, given: Given | None = None) -> FlightPlan:
    """
    Return the plan of a parsed file, named `where` in messages, and flown as `given` says.

    Raises
    ------
    PlanError
        If it is malformed, of a version that is not documented, or does not determine where the aircraft flies.

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.1)], altitude=80)
    >>> read_document(json.loads(write(plan, "mine.plan")), "mine.plan").waypoints == plan.waypoints
    True
    """
    with located(where):
        return _read(document, given)


def _read(document: Mapping[str, Any], given: Given | None) -> FlightPlan:
    """Return the plan of a document; errors name the part of it."""
    where = "the plan"
    if document.get("fileType") != "Plan":
        fault(where, f"its fileType is {shown(document.get('fileType'))}", "that of a plan is 'Plan'")
    _version(document, 1, where)
    mission = document.get("mission")
    if not isinstance(mission, dict):
        fault(where, f"its mission is {shown(mission)}", "a plan has an object there")
    _version(mission, 2, "mission")
    fence, rally = (_table(document, key, where) for key in ("geoFence", "rallyPoints"))
    rules = read_fence(fence, mission.get("firmwareType"), where)
    points = rally.get("points", [])
    if not isinstance(points, list):
        fault(where, f"the points of its rallyPoints are {shown(points)}", "they are a list")
    remarks = ["geoFence: the place of the return after a breach: left out"] if fence.get("breachReturn") else []
    remarks += [f"rallyPoints: {len(points)} points: not flown, left out"] if points else []
    home = _home(mission.get("plannedHomePosition"), "mission: plannedHomePosition")
    items = mission.get("items")
    if not isinstance(items, list):
        fault("mission", f"its items are {shown(items)}", "a mission has a list of them")
    name = document.get("name", "")
    found: list[Item] = []
    for number, item in enumerate(items, start=1):
        found += _items(item, f"item {number}", remarks)
    name = name if isinstance(name, str) else ""
    return plan_of(
        found,
        home,
        name,
        remarks,
        given=given,
        fence=rules,
        has_rally_points=bool(points),
        vehicle=mission.get("vehicleType"),
        autopilot=mission.get("firmwareType"),
    )


def _version(table: Mapping[str, Any], wanted: int, where: str) -> None:
    version = table.get("version")
    if isinstance(version, bool) or version != wanted:
        fault(where, f"its version is {shown(version)}", f"version {wanted} is read")


def _table(document: Mapping[str, Any], key: str, where: str) -> Mapping[str, Any]:
    table = document.get(key, {})
    if not isinstance(table, dict):
        fault(where, f"its {key} is {shown(table)}", "it is an object, or left out")
    return table


def _home(value: object, where: str) -> Home | None:
    """Return the home of a mission; None at 0, 0, which stands for a home that was not set."""
    if not isinstance(value, list) or len(value) not in {2, 3}:
        fault(where, f"it is {shown(value)}", "give [latitude, longitude, altitude]")
    latitude, longitude, *altitude = (_number(part, where, can_be_open=False) for part in value)
    place = check_place(where, longitude, latitude)
    return None if place == (0.0, 0.0) else Home(*place, *altitude)


def _items(item: object, where: str, remarks: list[str]) -> Iterator[Item]:
    """Yield the simple items of an item."""
    if not isinstance(item, dict):
        fault(where, f"it is {shown(item)}", "an item is an object")
    kind = item.get("type")
    if kind == "SimpleItem":
        yield _simple(item, where)
        return
    if kind != "ComplexItem":
        fault(where, f"its type is {shown(kind)}", "it is SimpleItem or ComplexItem")
    what, inner = item.get("complexItemType"), item.get(_TRANSECTS)
    if isinstance(what, str) and what in PATTERNS:
        yield from pattern_items(item, where)
        return
    inside = inner.get("Items") if isinstance(inner, dict) else None
    if not isinstance(inside, list) or not inside:
        wrong = f"the file does not contain the simple items of its complex item of type {shown(what)}"
        fault(where, wrong, "turn it into simple items")
    remarks.append(f"{where}: a complex item ({shown(what)}), read as the {len(inside)} simple ones in it")
    for number, part in enumerate(inside, start=1):
        if not isinstance(part, dict) or part.get("type") != "SimpleItem":
            fault(f"{where}.{number}", f"it is {shown(part)}", "items in a complex one are simple ones")
        yield _simple(part, f"{where}.{number}")


def _simple(item: Mapping[str, Any], where: str) -> Item:
    frame, command = (_whole(item.get(key), f"{where}: {key}") for key in ("frame", "command"))
    numbers = item.get("params")
    if not isinstance(numbers, list) or len(numbers) != _PARAMETERS:
        fault(where, f"its params are {shown(numbers)}", f"they are {_PARAMETERS} numbers, null for open values")
    parameters = [_number(value, f"{where}: params", can_be_open=True) for value in numbers]
    reference: Reference | None = None
    if frame in FRAMES and math.isnan(parameters[-1]) and item.get("AltitudeMode") == _ABOVE_TERRAIN:
        parameters[-1] = _number(item.get("Altitude"), f"{where}: Altitude", can_be_open=True)
        reference = "ground"
    continues = item.get("autoContinue") is not False
    doubt = _other_height(item, frame, parameters[-1]) if frame in FRAMES and reference is None else ""
    return Item(where, frame, command, tuple(parameters), reference, continues, doubt)


def _other_height(item: Mapping[str, Any], frame: int, height: float) -> str:
    """
    Return why the height of an item is not known: QGroundControl's own fields say another one than its parameters.

    QGroundControl takes its own fields, other readers take the parameters.
    """
    mode = item.get("AltitudeMode")
    if type(mode) is int and frame not in _FRAMES_OF_MODES.get(mode, FRAMES):
        return f"its AltitudeMode is {mode}, which is not that of its frame, {frame}"
    said = [item.get(key) for key in ("Altitude", "AMSLAltAboveTerrain")]
    # (whole numbers in JSON may be greater than any float)
    known = [
        float(one) if abs(one) <= sys.float_info.max else math.inf
        for one in said
        if isinstance(one, int | float) and not isinstance(one, bool)
    ]
    if known and not math.isnan(height) and not any(abs(one - height) <= _SAME_HEIGHT for one in known):
        return f"its Altitude is {known[0]:g}, and that of its params is {height:g}"
    return ""


def _whole(value: object, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        fault(where, f"it is {shown(value)}", "it is a whole number")
    return value


def _number(value: object, where: str, *, can_be_open: bool) -> float:
    if value is None and can_be_open:
        return math.nan
    try:
        number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        fault(where, f"one of them is {shown(value)}", "give a finite number")
    return number


def write(plan: FlightPlan, where: str) -> str:
    """
    Write a plan as QGroundControl does, one key a line, to a file named `where` in messages.

    Without a home, the first waypoint is the home; a home of unknown height is at 0 m.

    Raises
    ------
    PlanError
        If an autopilot cannot fly it (see `cgla_graph.airspace.flight_plans.mission_items.items_of`).
    """
    items = items_of(plan, where)
    first = plan.waypoints[0]
    home = plan.home or Home(first.x, first.y)
    references = {one.reference for one in plan.waypoints}
    speed = next((one.speed for one in plan.waypoints if one.speed is not None), None)
    mission = {
        "cruiseSpeed": speed or _CRUISE,
        "firmwareType": _FIRMWARE if plan.autopilot is None else plan.autopilot,
        "globalPlanAltitudeMode": _ALTITUDE_MODES[references.pop()] if len(references) == 1 else _MIXED,
        "hoverSpeed": speed or _HOVER,
        "items": [_document(item, number) for number, item in enumerate(items, start=1)],
        "plannedHomePosition": [home.y, home.x, home.altitude or 0.0],
        "vehicleType": _VEHICLE if plan.vehicle is None else plan.vehicle,
        "version": 2,
    }
    document: dict[str, Any] = {
        "fileType": "Plan",
        "geoFence": fence_document(plan.fence),
        "groundStation": "QGroundControl",
        "mission": mission,
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }
    if plan.name:
        document["name"] = plan.name
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=4) + "\n"


def _document(item: Item, number: int) -> dict[str, Any]:
    """Return an item as the file has it."""
    altitude = {}
    if item.frame in FRAMES:
        mode = _ALTITUDE_MODES[FRAMES[item.frame]]
        altitude = {"AMSLAltAboveTerrain": None, "Altitude": item.numbers[-1], "AltitudeMode": mode}
    return {
        **altitude,
        "autoContinue": True,
        "command": item.command,
        "doJumpId": number,
        "frame": item.frame,
        "params": [None if math.isnan(value) else value for value in item.numbers],
        "type": "SimpleItem",
    }

"""
Plans as GeoJSON (RFC 7946): the route as a line, and each waypoint as a point with properties.

In GeoJSON, the third number of a position is a height above the ellipsoid. Only such altitudes are written into
positions; other altitudes are properties.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Waypoint, fault, few_read
from cgla_graph.airspace.flight_plans.tagged_waypoints import (
    ALTITUDE,
    REFERENCE,
    ROLE,
    assemble_plan,
    number_of,
    of_line,
    place_of,
    tags_of,
    waypoint_of,
)

_LEAST, _MOST = 2, 3


def read_document(document: Mapping[str, Any], where: str) -> FlightPlan:
    """
    Return the plan of a FeatureCollection, a Feature or a geometry, named `where` in messages.

    It is that of its points if these have roles, else of its only line, else of its points.

    Raises
    ------
    PlanError
        If it is malformed, or has several lines that could be the route.

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.1)], altitude=80, name="mine")
    >>> read_document(json.loads(write(plan)), "mine.geojson") == plan
    True
    """
    lines: list[tuple[str, list[Waypoint]]] = []
    points: list[Waypoint | Home] = []
    remarks: list[str] = []
    has_roles = False
    for index, (geometry, tags) in enumerate(_features(document, where)):
        place = f"{where}: feature {index}"
        kind = geometry.get("type") if isinstance(geometry, Mapping) else None
        coordinates = geometry.get("coordinates") if isinstance(geometry, Mapping) else None
        if kind == "Point":
            has_roles = has_roles or ROLE in tags
            points.append(_point(coordinates, tags, place))
            few_read(len(points), where)
        elif kind == "LineString":
            name = tags.get("name")
            lines.append((name if isinstance(name, str) else "", _line(coordinates, tags, place)))
        elif kind == "MultiLineString" and isinstance(coordinates, list) and len(coordinates) == 1:
            lines.append(("", _line(coordinates[0], tags, place)))
        elif kind in ("Polygon", "MultiPolygon"):
            remarks.append(f"feature {index}: a {kind} is not flown: left out")
        else:
            fault(place, f"its geometry is {shown(kind or geometry)}", "a plan has points and one line")
    plan = choose_plan(lines, points, has_roles=has_roles, remarks=remarks, where=where)
    name = document.get("name")
    return plan.renamed(name) if name and isinstance(name, str) else plan


def choose_plan(
    lines: Sequence[tuple[str, list[Waypoint]]],
    points: Sequence[Waypoint | Home],
    *,
    has_roles: bool,
    remarks: Sequence[str],
    where: str,
    unknown: Sequence[str] = (),
) -> FlightPlan:
    """
    Return the plan of the lines and points of a file for viewers.

    Parameters
    ----------
    lines
        Name and waypoints of each line.
    points
        The points, in the order of the file.
    has_roles
        Whether a point has a role: then the points are the plan, and the line only shows it.
    remarks, where, unknown
        As of `assemble_plan`.

    Raises
    ------
    PlanError
        If there is more than one line, or the line differs from the points.
    """
    if len(lines) > 1:
        named = ", ".join(name or "one without a name" for name, _ in lines[:4])
        fault(where, f"it has {len(lines)} lines ({named[:120]})", "a plan is one line: keep the one that is flown")
    name, line = lines[0] if lines else ("", [])
    flown = [one for one in points if isinstance(one, Waypoint)]
    if has_roles and line and [(one.x, one.y) for one in line] != [(one.x, one.y) for one in flown]:
        fault(where, "its line and its points are different routes", "change both, or leave one of them out")
    if line and not has_roles:
        more = [f"{len(points)} points beside the line: not flown, left out"] if points else []
        return assemble_plan(line, name, [*remarks, *more], where, unknown=unknown)
    return assemble_plan(points, "" if has_roles else name, remarks, where, unknown=unknown)


def _features(document: Mapping[str, Any], where: str) -> Iterator[tuple[Any, Mapping[str, Any]]]:
    """Yield each geometry and its properties."""
    kind = document.get("type")
    features = document.get("features") if kind == "FeatureCollection" else [document]
    if not isinstance(features, list):
        fault(where, f"its features are {shown(features)}", "a FeatureCollection has a list of them")
    for index, feature in enumerate(features):
        if not isinstance(feature, dict) or (kind == "FeatureCollection" and feature.get("type") != "Feature"):
            fault(f"{where}: feature {index}", f"it is {shown(feature)}", "write an object of type 'Feature'")
        if feature.get("type") != "Feature":
            yield feature, {}
            return
        tags = feature.get("properties")
        if not isinstance(tags, dict | None):
            fault(f"{where}: feature {index}", f"its properties are {shown(tags)}", "write an object, or null")
        yield feature.get("geometry"), tags or {}


def _line(coordinates: object, tags: Mapping[str, Any], where: str) -> list[Waypoint]:
    """Return the waypoints of a line, whose tags are those of each."""
    if not isinstance(coordinates, list):
        fault(where, f"its coordinates are {shown(coordinates)}", "a line has a list of positions")
    few_read(len(coordinates), where)
    tags = of_line(tags)
    found = [_point(position, tags, f"{where}, position {index}") for index, position in enumerate(coordinates)]
    return [one for one in found if isinstance(one, Waypoint)]


def _point(position: object, tags: Mapping[str, Any], where: str) -> Waypoint | Home:
    if not isinstance(position, list) or not _LEAST <= len(position) <= _MOST:
        fault(where, f"it is {shown(position)}", "a position is [longitude, latitude] or [longitude, latitude, height]")
    if any(isinstance(value, str) for value in position):
        fault(where, f"it is {shown(position)}", "a position consists of numbers")
    place = place_of(position[:2], where)
    if len(position) == _MOST and ALTITUDE not in tags:
        height = number_of(position[2], where)
        if str(tags.get(ROLE, "")).lower() != "home":
            tags = {**tags, ALTITUDE: height, REFERENCE: "ellipsoid"}
    return waypoint_of(place, tags, where)


def write(plan: FlightPlan) -> str:
    """Write a plan with longitudes and latitudes as GeoJSON."""
    line = [_position(one) for one in plan.waypoints]
    route = {"name": plan.name, ROLE: "route"}
    # a line needs two positions
    features = [_feature({"type": "LineString", "coordinates": line}, route)] if len(line) > 1 else []
    features += [_feature({"type": "Point", "coordinates": _position(one)}, tags_of(one)) for one in plan.marks]
    document: dict[str, Any] = {"type": "FeatureCollection", "name": plan.name, "features": features}
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def _position(one: Waypoint | Home) -> list[float]:
    is_height = isinstance(one, Waypoint) and one.reference == "ellipsoid" and one.altitude is not None
    return [one.x, one.y, one.altitude] if is_height else [one.x, one.y]  # type: ignore[list-item]


def _feature(geometry: Mapping[str, Any], tags: Mapping[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "properties": dict(tags), "geometry": geometry}

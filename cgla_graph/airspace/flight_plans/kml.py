"""
Plans as KML: the route as a line, and each waypoint as a point with extended data.

KML has altitudes above the ground and above the sea. Altitudes above home are shown as if above the ground; the
extended data of each point state that they are above home.
"""

from collections.abc import Iterator, Mapping
from typing import Final
from xml.etree.ElementTree import Element
from xml.sax.saxutils import escape, quoteattr

from cgla_graph._text import shown
from cgla_graph.airspace.flight_plans.geojson import choose_plan
from cgla_graph.airspace.flight_plans.plan import (
    FlightPlan,
    Home,
    Reference,
    Waypoint,
    decimal,
    fault,
    few_read,
    few_written,
)
from cgla_graph.airspace.flight_plans.tagged_waypoints import (
    ALTITUDE,
    NAMES,
    REFERENCE,
    ROLE,
    number_of,
    of_line,
    place_of,
    text_tags,
    waypoint_of,
)
from cgla_graph.untrusted.xml_files import child_text, tag_of

#: Altitude modes of KML and the references of altitudes; with the mode "clampToGround", altitudes are ignored.
_MODES: Final[dict[Reference, str]] = {"home": "relativeToGround", "ground": "relativeToGround", "sea": "absolute"}
_REFERENCES: Final[dict[str, Reference]] = {"relativeToGround": "ground", "absolute": "sea"}
_ON_GROUND: Final = "clampToGround"
#: Geometries that contain others, geometries that are not flown, and other elements of a map.
_GROUPS, _AREAS = {"MultiGeometry"}, {"Polygon", "LinearRing", "Model"}
_TRACKS = {"Track", "MultiTrack"}
_OTHERS = {"NetworkLink", "GroundOverlay", "ScreenOverlay", "PhotoOverlay", "Tour"}
_LEAST, _MOST = 2, 3
#: Part of the namespace of DJI's missions, and why these do not say where the aircraft flies.
_WPML: Final = "/wpmz/"
_DJI: Final = (
    "a mission of DJI (WPML), whose heights, turns and return are not read; save its waypoints with altitudes as CSV, "
    "with the distance at which each is passed (pass_radius)"
)
#: Waypoints that are written, at most: larger files would exceed the limit of the reader.
_MOST_WRITTEN: Final = 50_000


def read_tree(root: Element, where: str) -> FlightPlan:
    """
    Return the plan of a KML document, named `where` in messages.

    It is that of its points if these have roles, else of its only line, else of its points.

    Raises
    ------
    PlanError
        If it is malformed, or has several lines that could be the route.

    Examples
    --------
    >>> from cgla_graph.untrusted.xml_files import xml_of
    >>> line = "<Placemark><LineString><coordinates>24,60,80 24.1,60.1,80</coordinates></LineString></Placemark>"
    >>> read_tree(xml_of(f"<kml>{line}</kml>".encode(), "mine.kml"), "mine.kml").lonlat.tolist()
    [[24.0, 60.0], [24.1, 60.1]]
    """
    lines: list[tuple[str, list[Waypoint]]] = []
    points: list[Waypoint | Home] = []
    remarks: list[str] = []
    has_roles = _has_roles(root)
    number = 0
    unknown = [_DJI] if any(_WPML in str(element.tag) for element in root.iter()) else []
    for element in root.iter():
        kind = tag_of(element)
        if kind in _OTHERS:
            remarks.append(f"a {kind} is not flown: left out")
        if kind != "Placemark":
            continue
        number += 1
        name, tags = child_text(element, "name"), _tags(element)
        place = f"{where}: placemark {number}" + (f" ({shown(name)})" if name else "")
        for geometry in _geometries(element):
            shape = tag_of(geometry)
            if shape == "Point":
                found = _waypoints(geometry, tags, place)
                if len(found) != 1:
                    fault(place, f"its point has {len(found)} positions", "a point has one")
                points += found
            elif shape == "LineString":
                said = None if has_roles else of_line(tags)
                lines.append((name, [one for one in _waypoints(geometry, said, place) if isinstance(one, Waypoint)]))
            elif shape in _TRACKS:
                fault(place, f"it is a {shape}", "a plan is a LineString or Points: save the track as a path")
            else:
                remarks.append(f"placemark {number}: a {shape} is not flown: left out")
    few_read(len(points), where)
    plan = choose_plan(lines, points, has_roles=has_roles, remarks=remarks, where=where, unknown=unknown)
    title = next((child_text(one, "name") for one in root.iter() if tag_of(one) == "Document"), "")
    return plan.renamed(title or plan.name)


def _has_roles(root: Element) -> bool:
    """Return whether a point has a role: then the points are the plan, and the line only shows it."""
    placemarks = (one for one in root.iter() if tag_of(one) == "Placemark")
    return any(ROLE in _tags(one) and any(tag_of(part) == "Point" for part in _geometries(one)) for one in placemarks)


def _geometries(element: Element) -> Iterator[Element]:
    """Yield the geometries of a placemark, also those inside groups."""
    for child in element:
        kind = tag_of(child)
        if kind in _GROUPS:
            yield from _geometries(child)
        elif kind in {"Point", "LineString", *_AREAS, *_TRACKS}:
            yield child


def _tags(element: Element) -> dict[str, str]:
    """Return the extended data of a placemark, by name."""
    tags = {}
    for data in (child for part in element if tag_of(part) == "ExtendedData" for child in part):
        name = data.get("name")
        if tag_of(data) == "Data" and name in NAMES:
            tags[name] = child_text(data, "value")
    return tags


def _waypoints(geometry: Element, tags: Mapping[str, object] | None, where: str) -> list[Waypoint | Home]:
    """Return the positions of a geometry; without tags, one that only shows the points: its altitudes do not count."""
    mode = child_text(geometry, "altitudeMode") or _ON_GROUND
    if mode not in {_ON_GROUND, "clampToSeaFloor", *_REFERENCES}:
        fault(where, f"its altitudeMode is {shown(mode)}", f"{_ON_GROUND}, relativeToGround and absolute are read")
    offset = child_text(geometry, "altitudeOffset")
    if offset and number_of(offset, f"{where}: altitudeOffset"):
        fault(where, f"its altitudeOffset is {shown(offset)}", "add it to the altitudes, and leave it out")
    found = [child for child in geometry if tag_of(child) == "coordinates"]
    places = (found[0].text or "").split() if len(found) == 1 else []
    if not places:
        fault(where, "it has no coordinates", "write longitude,latitude,altitude with spaces between positions")
    few_read(len(places), where)
    waypoints = []
    for text in places:
        parts = text.split(",")
        if not _LEAST <= len(parts) <= _MOST or not all(parts):
            fault(where, f"its coordinates have {shown(text)}", "a position is longitude,latitude,altitude, no blanks")
        said = tags or {}
        if mode in _REFERENCES and len(parts) == _MOST and ALTITUDE not in said:
            height = number_of(parts[2], f"{where}: {ALTITUDE}")
            said = said if tags is None else {**said, ALTITUDE: height, REFERENCE: _REFERENCES[mode]}
        waypoints.append(waypoint_of(place_of(parts[:2], where), said, where))
    return waypoints


def write(plan: FlightPlan) -> str:
    """
    Write a plan with longitudes and latitudes as KML 2.2.

    Raises
    ------
    PlanError
        If it has too many waypoints.

    Examples
    --------
    >>> text = write(FlightPlan.along([(24.0, 60.0), (24.1, 60.1)], altitude=80))
    >>> "<coordinates>24,60,80 24.1,60.1,80 24.1,60.1,0</coordinates>" in text
    True
    """
    few_written(len(plan.waypoints), _MOST_WRITTEN, "KML")
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<kml xmlns="http://www.opengis.net/kml/2.2">', "<Document>"]
    if plan.name:
        lines.append(f"<name>{escape(plan.name)}</name>")
    modes = {_mode(one) for one in plan.waypoints}
    mode = modes.pop() if len(modes) == 1 else _ON_GROUND
    if len(plan.waypoints) > 1:
        along = " ".join(_position(one, mode) for one in plan.waypoints)
        lines += [
            "<Placemark>",
            "<name>route</name>",
            f"<LineString><tessellate>1</tessellate><altitudeMode>{mode}</altitudeMode>",
            f"<coordinates>{along}</coordinates></LineString>",
            "</Placemark>",
        ]
    lines += ["<Folder>", "<name>waypoints</name>"]
    for number, one in enumerate(plan.marks, start=0 if plan.home else 1):
        name = "home" if isinstance(one, Home) else str(number)
        lines += ["<Placemark>", f"<name>{name}</name>", "<ExtendedData>"]
        lines += [f"<Data name={quoteattr(tag)}><value>{said}</value></Data>" for tag, said in text_tags(one).items()]
        own = _mode(one)
        lines += [
            "</ExtendedData>",
            f"<Point><altitudeMode>{own}</altitudeMode><coordinates>{_position(one, own)}</coordinates></Point>",
            "</Placemark>",
        ]
    return "\n".join([*lines, "</Folder>", "</Document>", "</kml>"]) + "\n"


def _mode(one: Waypoint | Home) -> str:
    """Return the altitude mode of a waypoint; "clampToGround" without an altitude or with one that KML cannot state."""
    if one.altitude is None:
        return _ON_GROUND
    return _MODES["sea"] if isinstance(one, Home) else _MODES.get(one.reference, _ON_GROUND)


def _position(one: Waypoint | Home, mode: str) -> str:
    parts = [one.x, one.y] if mode == _ON_GROUND or one.altitude is None else [one.x, one.y, one.altitude]
    return ",".join(map(decimal, parts))

"""Plans as GPX 1.1: a route, and home as a waypoint; data that GPX has no element for are extensions."""

from typing import Final
from xml.etree.ElementTree import Element
from xml.sax.saxutils import escape

from cgla_graph.airspace.flight_plans.plan import (
    FlightPlan,
    Home,
    Waypoint,
    decimal,
    fault,
    few_read,
    few_written,
)
from cgla_graph.airspace.flight_plans.tagged_waypoints import (
    ALTITUDE,
    HOME,
    NAMES,
    REFERENCE,
    ROLE,
    assemble_plan,
    place_of,
    text_tags,
    waypoint_of,
)
from cgla_graph.untrusted.xml_files import child_text, tag_of

#: The namespace of our extensions.
NAMESPACE: Final = "urn:cgla-graph:plan:1"
#: Waypoints that are written, at most: larger files would exceed the limit of the reader.
_MOST_WRITTEN: Final = 100_000


def read_tree(root: Element, where: str) -> FlightPlan:
    """
    Return the plan of a GPX document, named `where` in messages: its only route, else its only track, else waypoints.

    An elevation without a reference is above the sea.

    Raises
    ------
    PlanError
        If it is malformed, or has several routes or tracks.

    Examples
    --------
    >>> from cgla_graph.untrusted.xml_files import xml_of
    >>> route = '<rte><rtept lat="60" lon="24"><ele>80</ele></rtept></rte>'
    >>> read_tree(xml_of(f"<gpx>{route}</gpx>".encode(), "mine.gpx"), "mine.gpx").waypoints[0].reference
    'sea'
    """
    parts: dict[str, list[Element]] = {"wpt": [], "rte": [], "trk": []}
    for child in root:
        if tag_of(child) in parts:
            parts[tag_of(child)].append(child)
    few_read(len(parts["wpt"]), where)
    segments = [part for track in parts["trk"] for part in track if tag_of(part) == "trkseg"]
    remarks: list[str] = []
    marks = [_waypoint(one, f"{where}: waypoint {index}") for index, one in enumerate(parts["wpt"])]
    home = [one for one in marks if isinstance(one, Home)]
    kind, routes = ("rte", parts["rte"]) if parts["rte"] else ("trk", segments)
    if len(routes) > 1:
        several = f"it has {len(routes)} {'routes' if kind == 'rte' else 'tracks, or pieces of them'}"
        fault(where, several, "a plan is one: keep the one that is flown")
    if kind == "rte" and segments:
        remarks.append(f"{len(segments)} tracks beside the route: not flown, left out")
    if routes:
        beside = len(marks) - len(home)
        remarks += [f"{beside} waypoints beside the route: not flown, left out"] if beside else []
        tag = "rtept" if kind == "rte" else "trkpt"
        points = [one for one in routes[0] if tag_of(one) == tag]
        few_read(len(points), where)
        marks = [*home, *(_waypoint(one, f"{where}: {tag} {index}") for index, one in enumerate(points))]
    named = routes[0] if kind == "rte" and routes else parts["trk"][0] if parts["trk"] else None
    metadata = next((one for one in root if tag_of(one) == "metadata"), None)
    name = "" if named is None else child_text(named, "name")
    return assemble_plan(marks, name or ("" if metadata is None else child_text(metadata, "name")), remarks, where)


def _waypoint(point: Element, where: str) -> Waypoint | Home:
    place = place_of([point.get("lon"), point.get("lat")], where)
    own = f"{{{NAMESPACE}}}"
    tags = {
        child.tag.removeprefix(own): (child.text or "").strip()
        for part in point
        if tag_of(part) == "extensions"
        for child in part
        if child.tag.startswith(own) and child.tag.removeprefix(own) in NAMES
    }
    elevation = child_text(point, "ele")
    if elevation and ALTITUDE not in tags:
        tags |= {ALTITUDE: elevation, REFERENCE: tags.get(REFERENCE, "sea")}
    return waypoint_of(place, tags, where)


def write(plan: FlightPlan) -> str:
    """
    Write a plan with longitudes and latitudes as GPX 1.1; extensions name the references of elevations.

    Raises
    ------
    PlanError
        If it has too many waypoints.

    Examples
    --------
    >>> text = write(FlightPlan.along([(24.0, 60.0), (24.1, 60.1)], altitude=80))
    >>> '<rtept lat="60.1" lon="24.1"><ele>80</ele>' in text
    True
    """
    few_written(len(plan.waypoints), _MOST_WRITTEN, "GPX")
    name = f"<name>{escape(plan.name)}</name>" if plan.name else ""
    head = (
        f'<gpx version="1.1" creator="cgla-graph" xmlns="http://www.topografix.com/GPX/1/1" xmlns:cgla="{NAMESPACE}">'
    )
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', head]
    lines += [f"<metadata>{name}</metadata>"] if name else []
    lines += [_point(plan.home, "wpt", HOME)] if plan.home else []
    lines += [f"<rte>{name}"]
    lines += [_point(one, "rtept", str(number)) for number, one in enumerate(plan.waypoints, start=1)]
    return "\n".join([*lines, "</rte>", "</gpx>"]) + "\n"


def _point(one: Waypoint | Home, tag: str, name: str) -> str:
    elevation = "" if one.altitude is None else f"<ele>{decimal(one.altitude)}</ele>"
    tags = text_tags(one)
    said = "".join(f"<cgla:{key}>{value}</cgla:{key}>" for key, value in tags.items())
    place = f'lat="{decimal(one.y)}" lon="{decimal(one.x)}"'
    middle = f"<name>{name}</name><type>{tags[ROLE]}</type><extensions>{said}</extensions>"
    return f"<{tag} {place}>{elevation}{middle}</{tag}>"

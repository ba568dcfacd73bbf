"""Reader of areas in KML: a zone for each placemark with polygons; other geometries are listed."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from cgla_graph._text import shown
from cgla_graph.airspace.zones.closed_lines import enclosed, no_areas
from cgla_graph.airspace.zones.rings import polygon_of
from cgla_graph.airspace.zones.shapes import AreaShape, ring_of, short
from cgla_graph.airspace.zones.zone import Layer, NoArea, Zone
from cgla_graph.errors import FileFormatError
from cgla_graph.untrusted.files import fault
from cgla_graph.untrusted.numbers import plain_numbers
from cgla_graph.untrusted.xml_files import child_text, tag_of

#: Elements that contain placemarks, and elements of a map that are not areas.
FOLDERS = {"kml", "Document", "Folder"}
PICTURES = {"GroundOverlay", "PhotoOverlay", "ScreenOverlay", "Tour"}
#: Geometries that have no area.
LINES = {"Point", "LineString", "LinearRing", "Model", "Track", "MultiTrack"}
#: Lines that may enclose an area.
CLOSABLE = {"LineString", "LinearRing"}
#: Elements of polygons.
OUTLINES = {"Polygon", "outerBoundaryIs", "innerBoundaryIs", "coordinates"}


def read_root(root: Element, file: str) -> tuple[list[Zone], list[NoArea]]:
    """
    Return the polygons of a document, named `file` in errors, one zone a placemark, and its other parts.

    Raises
    ------
    FileFormatError
        If a polygon is not valid or the document links to another file; the message names the placemark.

    Examples
    --------
    >>> from cgla_graph.untrusted.xml_files import xml_of
    >>> ring = "<LinearRing><coordinates>6,49 7,49 7,50</coordinates></LinearRing>"
    >>> polygon = f"<Polygon><outerBoundaryIs>{ring}</outerBoundaryIs></Polygon>"
    >>> text = f"<kml><Placemark><name>harbour</name>{polygon}</Placemark></kml>"
    >>> zones, others = read_root(xml_of(text.encode(), "zones.kml"), "zones.kml")
    >>> zones[0].label, len(others)
    ('harbour', 0)
    """
    zones: list[Zone] = []
    others: list[NoArea] = []
    for index, (feature, kind) in enumerate(_features(root, file)):
        name = " ".join((child_text(feature, "name") or feature.get("id") or f"placemark {index}").split())
        where = f"{file}: {shown(name)}"
        if kind == "NetworkLink":
            link = next((one.text or "" for one in feature.iter() if tag_of(one) == "href"), "")
            fault(where, f"its areas are in another file, {shown(link.strip())}", "save that one, and give it")
        if kind in PICTURES:
            others.append(NoArea(name, f"a {kind}, not an area", file))
            continue
        polygons, lines = _geometries(feature, where)
        message = child_text(feature, "description")
        if polygons:
            found = [_polygon(one, f"{where}: Polygon {number}") for number, one in enumerate(polygons)]
            layers = tuple(Layer(area, remark=remark) for area, remark in found)
            zones.append(Zone(name, "", "UNCLASSIFIED", layers, file=file, message=message))
        named = [(tag_of(one), f"{where}: {tag_of(one)} {number}", one) for number, one in enumerate(lines)]
        others += no_areas(name, [(kind, _enclosed(one, at)) for kind, at, one in named], file, message)
        if not polygons and not lines:
            others.append(NoArea(name, "it has no geometry", file))
    if not zones and not others:
        fault(file, "it has no placemark", "give a map with areas, or leave the file out")
    return zones, others


def _features(root: Element, file: str) -> Iterator[tuple[Element, str]]:
    """Yield the placemarks, links and pictures in all folders, in order."""
    stack = [root]
    while stack:
        element = stack.pop()
        kind = tag_of(element)
        if kind in FOLDERS:
            stack.extend(reversed(element))
        elif kind in {"Placemark", "NetworkLink", *PICTURES}:
            yield element, kind
        elif kind in {"Update", "NetworkLinkControl"}:
            fault(file, f"it has a <{kind}>, which changes other files", "save the map as one file")
        elif any(tag_of(one) in {"Placemark", "NetworkLink"} for one in element.iter()):
            fault(file, f"it has placemarks in a <{kind[:60]}>", "put them into a <Document> or a <Folder>")
        elif any(tag_of(one) in {"Polygon", *CLOSABLE} for one in element.iter()):
            fault(file, f"it has polygons or lines in a <{kind[:60]}>", "put them into a <Placemark>")


def _enclosed(line: Element, where: str) -> Layer | None:
    """Return what a line encloses; None if that is nothing."""
    if tag_of(line) not in CLOSABLE:
        return None
    try:
        positions = _positions(line, where)
    except FileFormatError:
        return None
    return enclosed(positions, where, is_ring=tag_of(line) == "LinearRing")


def _geometries(feature: Element, where: str) -> tuple[list[Element], list[Element]]:
    """Return the polygons of a placemark, and its other geometries."""
    polygons, lines = [], []
    stack = list(reversed(feature))
    while stack:
        element = stack.pop()
        kind = tag_of(element)
        if kind == "MultiGeometry":
            stack.extend(reversed(element))
        elif kind == "Polygon":
            polygons.append(element)
        elif kind in LINES:
            lines.append(element)
        elif any(tag_of(one) in OUTLINES for one in element.iter()):
            fault(where, f"it has a <{kind[:60]}> outside of a polygon", "put it into a <Polygon>")
    return polygons, lines


def _polygon(polygon: Element, where: str) -> tuple[AreaShape, str]:
    """Read a polygon: its outer boundary, then its holes."""
    outer, inner = (
        [ring for one in polygon if tag_of(one) == kind for ring in one if tag_of(ring) == "LinearRing"]
        for kind in ("outerBoundaryIs", "innerBoundaryIs")
    )
    if len(outer) != 1:
        fault(f"{where}: outerBoundaryIs", f"it has {len(outer)} rings", "give one <LinearRing>")
    named = [(ring, f"{where}: ring {number}") for number, ring in enumerate([*outer, *inner])]
    return polygon_of([ring_of(_positions(ring, name), name, closed=False) for ring, name in named], where)


def _positions(ring: Element, where: str) -> list[list[float]]:
    """Return the positions of a ring."""
    where = f"{where}: coordinates"
    positions = [word.split(",") for word in child_text(ring, "coordinates").split()]
    remedy = "give longitude,latitude with spaces between positions, none behind commas"
    if not positions:
        fault(where, "there are none", remedy)
    bad = next((one for one in positions if len(one) not in (2, 3)), None)
    if bad is not None:
        fault(where, f"one is {short(','.join(bad))}", remedy)
    try:
        flat = plain_numbers([number for position in positions for number in position[:2]])
    except ValueError as error:
        fault(where, f"one is no number ({str(error)[:100]})", "give degrees")
    return flat.reshape(-1, 2).tolist()

"""KML: the polygons of placemarks, plain or in an archive; what is no polygon is listed."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np

from cgla_graph._text import shown
from cgla_graph.airspace.zones.shapes import AreaShape, polygon_of, ring_of, short
from cgla_graph.airspace.zones.zone import Layer, NoArea, Zone
from cgla_graph.untrusted.files import fault
from cgla_graph.untrusted.xml_files import child_text, tag_of

#: What holds placemarks, and what is drawn on a map without being an area.
FOLDERS = {"kml", "Document", "Folder"}
PICTURES = {"GroundOverlay", "PhotoOverlay", "ScreenOverlay", "Tour"}
#: Geometries that have no area.
LINES = {"Point", "LineString", "LinearRing", "Model", "Track", "MultiTrack"}
#: What is inside of areas alone, or is one.
OUTLINES = {"Polygon", "outerBoundaryIs", "innerBoundaryIs", "coordinates"}


def read_root(root: Element, file: str) -> tuple[list[Zone], list[NoArea]]:
    """
    Return the polygons of a document, a zone for each placemark, and whatever else is on the map.

    Parameters
    ----------
    root
        The element ``kml``.
    file
        What errors call it.

    Raises
    ------
    FileFormatError
        If a polygon is not understood; the message names the placemark. So it is where areas are in another file that
        is linked.

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
        if polygons:
            found = [_polygon(one, f"{where}: Polygon {number}") for number, one in enumerate(polygons)]
            layers = tuple(Layer(area, remark=remark) for area, remark in found)
            zones.append(Zone(name, "", "UNCLASSIFIED", layers, file=file, message=child_text(feature, "description")))
        others += [NoArea(name, f"a {line}, not an area", file) for line in dict.fromkeys(lines)]
        if not polygons and not lines:
            others.append(NoArea(name, "it has no geometry", file))
    return zones, others


def _features(root: Element, file: str) -> Iterator[tuple[Element, str]]:
    """Go through what folders hold, in their order."""
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


def _geometries(feature: Element, where: str) -> tuple[list[Element], list[str]]:
    """Return the polygons of a placemark, and the kinds of its other geometries."""
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
            lines.append(kind)
        elif any(tag_of(one) in OUTLINES for one in element.iter()):
            fault(where, f"it has a <{kind[:60]}> outside of a polygon", "put it into a <Polygon>")
    return polygons, lines


def _polygon(polygon: Element, where: str) -> tuple[AreaShape, str]:
    """Read a polygon: its outer boundary, then its holes."""
    outer = [
        ring for one in polygon if tag_of(one) == "outerBoundaryIs" for ring in one if tag_of(ring) == "LinearRing"
    ]
    inner = [
        ring for one in polygon if tag_of(one) == "innerBoundaryIs" for ring in one if tag_of(ring) == "LinearRing"
    ]
    if len(outer) != 1:
        fault(f"{where}: outerBoundaryIs", f"it has {len(outer)} rings", "give one <LinearRing>")
    rings = [_ring(ring, f"{where}: ring {number}") for number, ring in enumerate([*outer, *inner])]
    return polygon_of(
        [ring_of(ring, f"{where}: ring {number}", closed=False) for number, ring in enumerate(rings)], where
    )


def _ring(ring: Element, where: str) -> list[list[float]]:
    """Return the positions of a ring."""
    text = child_text(ring, "coordinates")
    positions = [word.split(",") for word in text.split()]
    if not positions:
        fault(f"{where}: coordinates", "there are none", "give longitude,latitude with blanks between positions")
    if min(map(len, positions)) < 2 or max(map(len, positions)) > 3:  # noqa: PLR2004 - with a height, or without
        bad = next(one for one in positions if not 2 <= len(one) <= 3)  # noqa: PLR2004
        wrong = f"one is {short(','.join(bad))}"
        fault(
            f"{where}: coordinates", wrong, "give longitude,latitude with blanks between positions, none behind commas"
        )
    try:
        flat = np.array([number for position in positions for number in position[:2]], dtype=np.float64)
    except ValueError as error:
        fault(f"{where}: coordinates", f"one is no number ({str(error)[:100]})", "give degrees")
    return flat.reshape(-1, 2).tolist()

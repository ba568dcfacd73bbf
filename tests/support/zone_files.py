"""Small files of zones, in all formats that are read: nothing in them is anywhere."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

#: Files that authorities publish, where they are at hand.
PUBLISHED = Path(__file__).resolve().parents[3] / "shared" / "data" / "geozones"
SQUARE = [[6.0, 49.0], [6.2, 49.0], [6.2, 49.2], [6.0, 49.2], [6.0, 49.0]]
HOLE = [[6.05, 49.05], [6.15, 49.05], [6.15, 49.15], [6.05, 49.05]]
ALWAYS: list[dict[str, Any]] = [{"permanent": "YES"}]
NIGHTS = {"day": ["FRI"], "startTime": "22:00Z", "endTime": "06:00Z"}


def volume(**changes: object) -> dict[str, Any]:
    """Return a volume of ED-269: 0 to 120 m above ground, unless it is changed."""
    made: dict[str, Any] = {
        "uomDimensions": "M",
        "lowerLimit": 0,
        "lowerVerticalReference": "AGL",
        "upperLimit": 120,
        "upperVerticalReference": "AGL",
        "horizontalProjection": {"type": "Polygon", "coordinates": [SQUARE, HOLE]},
    }
    return {**made, **changes}


def ed269(*volumes: dict[str, Any], **changes: object) -> dict[str, Any]:
    """Return a document of ED-269 with one zone."""
    zone = {
        "identifier": "A-1",
        "country": "XXX",
        "name": "Castle",
        "type": "COMMON",
        "restriction": "PROHIBITED",
        "reason": ["SENSITIVE"],
        "applicability": ALWAYS,
        "zoneAuthority": [{"name": "Castle office", "email": "castle@example.com", "purpose": "AUTHORIZATION"}],
        "geometry": list(volumes) or [volume()],
    }
    return {"title": "zones", "features": [{**zone, **changes}]}


def layer(**changes: object) -> dict[str, Any]:
    """Return a layer of ED-318: 0 to 400 feet above ground, unless it is changed."""
    made: dict[str, Any] = {"uom": "ft", "lower": 0, "lowerReference": "AGL", "upper": 400, "upperReference": "AGL"}
    return {**made, **changes}


def ed318(geometry: dict[str, Any] | None = None, **changes: object) -> dict[str, Any]:
    """Return a document of ED-318 with one zone."""
    polygon = {"type": "Polygon", "coordinates": [SQUARE, HOLE], "layer": layer()}
    properties = {
        "identifier": "B-2",
        "country": "XXX",
        "name": [{"text": "Burg", "lang": "de-DE"}, {"text": "Castle", "lang": "en-GB"}],
        "type": "REQ_AUTHORIZATION",
        "variant": "COMMON",
        "zoneAuthority": [{"purpose": "AUTHORIZATION", "name": [{"text": "Castle office"}]}],
        **changes,
    }
    feature = {"type": "Feature", "geometry": geometry or polygon, "properties": properties}
    return {"type": "FeatureCollection", "metadata": {"validFrom": "2026-01-01T00:00:00Z"}, "features": [feature]}


def circle(longitude: float, latitude: float, radius: float) -> dict[str, Any]:
    """Return a circle of ED-318."""
    extent = {"subType": "Circle", "radius": radius}
    return {"type": "Point", "coordinates": [longitude, latitude], "extent": extent, "layer": layer()}


def geojson(*rings: list[list[float]]) -> dict[str, Any]:
    """Return a document of GeoJSON with one area."""
    geometry = {"type": "Polygon", "coordinates": list(rings or (SQUARE, HOLE))}
    return {"type": "Feature", "properties": {"name": "Castle"}, "geometry": geometry}


def kml(*placemarks: str) -> bytes:
    """Return a document of KML; without placemarks, with a polygon that has a hole, two more, a point and a line."""
    castle = f"<Placemark id='c'><name>Castle</name>{polygon(SQUARE, HOLE)}</Placemark>"
    both = f"<Placemark><MultiGeometry>{polygon(SQUARE)}{polygon(HOLE[:-1])}</MultiGeometry></Placemark>"
    point = "<Placemark><name>tower</name><Point><coordinates>6,49</coordinates></Point></Placemark>"
    line = "<Placemark><name>road</name><LineString><coordinates>6,49 7,49</coordinates></LineString></Placemark>"
    content = "".join(placemarks) or f"<Folder>{castle}<Folder>{both}</Folder></Folder>{point}{line}"
    text = f'<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>{content}</Document></kml>'
    return text.encode()


def polygon(border: list[list[float]], *holes: list[list[float]]) -> str:
    """Return a polygon of KML."""
    rings = [
        "<LinearRing><coordinates>" + " ".join(f"{x},{y},0" for x, y in ring) + "</coordinates></LinearRing>"
        for ring in (border, *holes)
    ]
    inner = "".join(f"<innerBoundaryIs>{ring}</innerBoundaryIs>" for ring in rings[1:])
    return f"<Polygon><outerBoundaryIs>{rings[0]}</outerBoundaryIs>{inner}</Polygon>"


def kmz(content: bytes) -> bytes:
    """Return an archive with a KML file."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("doc.kml", content)
    return stream.getvalue()


def data_of(document: object) -> bytes:
    """Return the bytes of a document."""
    return document if isinstance(document, bytes) else json.dumps(document).encode()

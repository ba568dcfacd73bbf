"""Reader of areas in GeoJSON (RFC 7946)."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn, TypeAlias

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph.airspace.zones.closed_lines import enclosed, no_areas
from cgla_graph.airspace.zones.rings import directed_rings
from cgla_graph.airspace.zones.shapes import are_split, joined, positions_of
from cgla_graph.airspace.zones.zone import Layer, NoArea, label_of
from cgla_graph.errors import FileFormatError
from cgla_graph.untrusted.files import read_bytes
from cgla_graph.untrusted.json_files import json_of
from cgla_graph.untrusted.json_maps import refuse_esri, require_wgs84

Position: TypeAlias = tuple[float, float]

GEOMETRIES = (
    "Point",
    "MultiPoint",
    "LineString",
    "MultiLineString",
    "Polygon",
    "MultiPolygon",
    "GeometryCollection",
)
POLYGONS, LINES = ("Polygon", "MultiPolygon"), ("LineString", "MultiLineString")
SHORTEST_RING = 4
#: Properties that name an area, in order of preference; case is ignored.
NAMES = ("name", "title", "designator", "ident", "label", "identifier", "id")
#: Properties that identify an area, and those that say its kind in the words of the file.
IDENTIFIERS = ("identifier", "designator", "ident", "localid", "code", "id")
KINDS = ("restriction", "kind", "type", "category", "class")


@dataclass(frozen=True)
class Area:
    """
    A named area of the Earth.

    Parameters
    ----------
    name
        Its name in the file.
    polygon
        The area, longitude and latitude in degrees.
    identifier, kind
        What the file calls it and its kind, by one of `IDENTIFIERS` and `KINDS`; empty if it does not.

    Examples
    --------
    >>> Area("test range", shapely.box(24.0, 60.0, 25.0, 61.0)).polygon.bounds
    (24.0, 60.0, 25.0, 61.0)
    """

    name: str
    polygon: Polygon | MultiPolygon
    identifier: str = ""
    kind: str = ""


def read_areas(path: str | os.PathLike[str]) -> list[Area]:
    """
    Read the areas of a GeoJSON file: a FeatureCollection, a Feature, or a geometry alone.

    Every geometry must be a Polygon or a MultiPolygon, or a collection of these; holes are kept, heights are dropped,
    and the direction of a ring does not matter. An area is named by the property ``name`` (or one of `NAMES`), else by
    the ``id`` of its feature, else ``area <index>``. Features, polygons, rings and positions are counted from 0.

    Parameters
    ----------
    path
        The file, UTF-8, longitude before latitude, degrees (WGS84).

    Raises
    ------
    FileFormatError
        If the file is missing, unreadable, not UTF-8 or not JSON; if it is not GeoJSON or has no feature; if a
        geometry is null or of another type; if a ring is open or shorter than 4 positions; if a coordinate is not a
        number, not finite or out of range; if a polygon is invalid (for example, crosses itself).

    Examples
    --------
    >>> import json, tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "triangle.json")
    ...     triangle = [[[24, 60], [25, 60], [25, 61], [24, 60]]]
    ...     _ = file.write_text(json.dumps({"type": "Polygon", "coordinates": triangle}))
    ...     areas = read_areas(file)
    >>> areas[0].name, areas[0].polygon.area
    ('area 0', 0.5)
    """
    file = repr(os.fspath(path))
    document = json_of(read_bytes(path, file), file)
    refuse_esri(document, file)
    require_wgs84(document, file)
    return areas_of(document, file)


def areas_of(document: object, file: str) -> list[Area]:
    """
    Return the areas of a parsed GeoJSON file, named `file` in errors; the errors are those of `read_areas`.

    Examples
    --------
    >>> triangle = [[[24, 60], [25, 60], [25, 61], [24, 60]]]
    >>> areas_of({"type": "Polygon", "coordinates": triangle}, "areas.geojson")[0].name
    'area 0'
    """
    areas, lines = features_of(document, file)
    if lines:
        remedy = "make closed lines polygons, or name the file among the zones, which list lines and can close them"
        _fail(f"{file}: {shown(lines[0].label)} is {lines[0].reason}", "Polygon or MultiPolygon", remedy)
    return areas


def features_of(document: object, file: str) -> tuple[list[Area], list[NoArea]]:
    """
    Return the areas of a parsed GeoJSON file, named `file` in errors, and its lines, which may be closed.

    Raises
    ------
    FileFormatError
        As in `read_areas`, except for lines.

    Examples
    --------
    >>> line = {"type": "LineString", "coordinates": [[24, 60], [25, 60], [25, 61], [24, 60]]}
    >>> features_of(line, "areas.geojson")[1][0].reason
    'a closed LineString, not an area'
    """
    areas: list[Area] = []
    others: list[NoArea] = []
    for index, feature in enumerate(_features(document, file)):
        _read(feature, index, file, areas, others)
    return areas, others


def _features(document: object, file: str) -> list[object]:
    """Return the features of a document; a geometry alone counts as a feature without properties."""
    kind = document.get("type") if isinstance(document, dict) else None
    if not isinstance(document, dict) or kind not in ("FeatureCollection", "Feature", *GEOMETRIES):
        found = f"its type is {shown(kind)}" if isinstance(document, dict) else "it is no JSON object"
        allowed = "FeatureCollection, Feature, Polygon or MultiPolygon"
        _fail(f"{file}: not GeoJSON, {found}", allowed, "export the areas as GeoJSON")
    if kind == "Feature":
        return [document]
    if kind != "FeatureCollection":
        return [{"type": "Feature", "geometry": document}]
    features = document.get("features")
    if not isinstance(features, list) or not features:
        wrong = f"{file}: the FeatureCollection has features {shown(features)}"
        _fail(wrong, "a list of at least one", "add an area, or leave the file out")
    return features


def _read(feature: object, index: int, file: str, areas: list[Area], others: list[NoArea]) -> None:
    """Add the area and the lines of one feature."""
    where = f"{file}: feature {index}"
    if not isinstance(feature, dict) or feature.get("type") != "Feature":
        short = shown(feature.get("type") if isinstance(feature, dict) else feature)
        found = f"has the type {short}" if isinstance(feature, dict) else f"is {short}"
        _fail(f"{where} {found}", "in features, only an object of type 'Feature'", "wrap it in one")
    properties = feature.get("properties")
    if not isinstance(properties, dict | None):
        _fail(f"{where} has properties {shown(properties)}", "an object or null", "write {}")
    own = {str(key).lower(): value for key, value in (properties or {}).items()}
    name = _first(*(own.get(key) for key in NAMES), feature.get("id"))
    where = f"{where} ({shown(name)})" if name else where
    identifier = _first(*(own.get(key) for key in IDENTIFIERS), feature.get("id"))
    polygons: list[Polygon | MultiPolygon] = []
    lines: list[tuple[str, Layer | None]] = []
    parts = list(_simple(feature.get("geometry"), where))
    for number, (kind, coordinates) in enumerate(parts):
        at = where if len(parts) == 1 else f"{where}, geometry {number}"
        if kind in LINES:
            lines += [(LINES[0], enclosed(line, at)) for line in _lines(kind, coordinates, at)]
        else:
            polygons.append(_geometry(kind, coordinates, at))
    if polygons:
        kind = _first(*(own.get(key) for key in KINDS))
        areas.append(Area(name or f"area {index}", joined(polygons), identifier, kind))
    others += no_areas(label_of(identifier or name or f"area {index}", name), lines, file)


def _simple(geometry: object, where: str) -> Iterator[tuple[str, object]]:
    """Yield type and coordinates of a geometry, or of those in a collection, which may be nested."""
    if not isinstance(geometry, dict):
        found = "no geometry (null)" if geometry is None else f"the geometry {shown(geometry)}"
        _fail(f"{where} has {found}", "Polygon or MultiPolygon", "draw the area, or drop the feature")
    kind = geometry.get("type")
    if kind == "GeometryCollection":
        for number, part in enumerate(_list(geometry.get("geometries"), where, "geometries")):
            yield from _simple(part, f"{where}, geometry {number}")
    elif isinstance(kind, str) and kind in {*POLYGONS, *LINES}:
        yield kind, geometry.get("coordinates")
    else:
        remedy = "drop it, or buffer points into polygons"
        _fail(f"{where} is of type {shown(kind)}", "Polygon or MultiPolygon", remedy)


def _lines(kind: str, coordinates: object, where: str) -> list[list[object]]:
    """Return the positions of each line."""
    listed = [coordinates] if kind == LINES[0] else _list(coordinates, where, "lines")
    lines = [_list(line, where, "positions") for line in listed]
    for line in lines:
        if positions_of(line) is None:
            for index, one in enumerate(line):
                position_of(one, f"{where}, position {index}")
    return lines


def _first(*values: object) -> str:
    """Return the first value that is a text or a whole number, as a text; empty if there is none."""
    texts = (str(value) for value in values if isinstance(value, str | int) and not isinstance(value, bool))
    return next((text for text in texts if text.strip()), "")


def _geometry(kind: str, coordinates: object, where: str) -> Polygon | MultiPolygon:
    """Return a valid polygon or several."""
    if kind == "Polygon":
        area: Polygon | MultiPolygon = _polygon(coordinates, where)
    else:
        parts = enumerate(_list(coordinates, where, "polygons"))
        polygons = [_polygon(part, f"{where}, polygon {index}") for index, part in parts]
        area = joined(polygons) if are_split(polygons) else MultiPolygon(polygons)
    if not area.is_valid:
        reason = shapely.is_valid_reason(area).replace("[", " at [")
        wrong = f"{where} is no valid area: {reason} (longitude latitude)"
        remedy = "redraw it there, with holes inside the first ring, and other outlines as polygons of their own"
        _fail(wrong, "only an area whose rings do not cross or overlap", remedy)
    return area


def _polygon(rings: object, where: str) -> Polygon:
    """Return a polygon: the first ring is its border, the others are holes."""
    read = [_ring(ring, f"{where}, ring {index}") for index, ring in enumerate(_list(rings, where, "rings"))]
    border, *holes = directed_rings(read, where)
    return Polygon(border, holes)


def _ring(ring: object, where: str) -> FloatArray:
    """Return the positions of a closed ring."""
    listed = _list(ring, where, "positions")
    points = positions_of(listed)
    if points is None:
        points = np.array([position_of(one, f"{where}, position {index}") for index, one in enumerate(listed)])
    if len(points) < SHORTEST_RING:
        allowed = f"at least {SHORTEST_RING}, the last equal to the first,"
        _fail(f"{where} has {len(points)} positions", allowed, "add corners, or drop the ring")
    if (points[0] != points[-1]).any():
        wrong = f"{where} is open: it begins at {tuple(points[0].tolist())} and ends at {tuple(points[-1].tolist())}"
        _fail(wrong, "only a closed ring", "repeat the first position at the end")
    return points


def position_of(position: object, where: str) -> Position:
    """
    Return longitude and latitude of a position, both in range; a height is dropped.

    Raises
    ------
    FileFormatError
        If it is not a valid position; the message begins with `where`.

    Examples
    --------
    >>> position_of([24, 60, 120], "a position")
    (24.0, 60.0)
    """
    if not isinstance(position, list) or len(position) < 2:  # noqa: PLR2004 - longitude and latitude
        _fail(f"{where} is {shown(position)}", "[longitude, latitude]", "write two numbers")
    for value, word, most in zip(position, ("longitude", "latitude"), (180, 90), strict=False):
        # A bool is an int in Python, but not a number in JSON. NaN fails the comparison.
        if isinstance(value, bool) or not isinstance(value, int | float) or not -most <= value <= most:
            wrong = f"{where} has the {word} {shown(value)}"
            _fail(wrong, f"a number in [-{most}, {most}]", "give degrees (WGS84), longitude first")
    return float(position[0]), float(position[1])


def _list(value: object, where: str, what: str) -> list[object]:
    """Return a list that is not empty."""
    if not isinstance(value, list) or not value:
        _fail(f"{where} has {shown(value)} for its {what}", "a list of at least one", f"write its {what}, or drop it")
    return value


def _fail(wrong: str, allowed: str, remedy: str) -> NoReturn:
    """Raise an error of one line: the fault and its place, the allowed values, and the remedy."""
    msg = f"{wrong}; {allowed} is allowed: {remedy}"
    raise FileFormatError(" ".join(msg.split()))

"""GeoJSON (RFC 7946): areas to read, a planned path to write."""

import json
import math
import os
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry import MultiPolygon, Polygon

from cgla_graph.errors import ScenarioError
from cgla_graph.scenarios.text_files import fail, read_text

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
SHORTEST_RING = 4
#: Properties that name an area, the first that is there; capitals do not matter.
NAMES = ("name", "title", "designator", "ident", "label", "id")


@dataclass(frozen=True)
class Area:
    """
    A named area of the Earth.

    Parameters
    ----------
    name
        What the file calls it.
    polygon
        The area, longitude and latitude in degrees.

    Examples
    --------
    >>> Area("test range", shapely.box(24.0, 60.0, 25.0, 61.0)).polygon.bounds
    (24.0, 60.0, 25.0, 61.0)
    """

    name: str
    polygon: Polygon | MultiPolygon


def read_areas(path: str | os.PathLike[str]) -> list[Area]:
    """
    Read the areas of a GeoJSON file: a FeatureCollection, a Feature, or a geometry alone.

    Every geometry must be a Polygon or a MultiPolygon; holes are kept, heights are dropped, and the
    direction of a ring does not matter. An area is named by the property ``name`` (or one of `NAMES`), else by
    the ``id`` of its feature, else ``area <index>``. Features, polygons, rings and positions are counted from 0.

    Parameters
    ----------
    path
        The file, UTF-8, longitude before latitude, degrees (WGS84).

    Raises
    ------
    ScenarioError
        If the file is missing, unreadable, not UTF-8 or not JSON; if it is no GeoJSON or has no feature; if a
        geometry is null or of another type; if a ring is open or shorter than 4 positions; if a coordinate is
        no number, not finite or out of range; if a polygon is invalid (it crosses itself, say).

    Examples
    --------
    >>> import tempfile
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
    features = _features(_document(path, file), file)
    return [_area(feature, index, file) for index, feature in enumerate(features)]


def line_feature_collection(path_lonlat: ArrayLike, properties: Mapping[str, object]) -> dict[str, object]:
    """
    Return a path as a GeoJSON FeatureCollection of one LineString, ready for ``json.dump``.

    A path of one point becomes a Point, because a LineString needs two. Numbers of numpy become plain
    numbers, and numbers that are not finite become null, because JSON has none. A path across the
    antimeridian is written as it is, not cut in two.

    Parameters
    ----------
    path_lonlat
        The points of the path, shape (m, 2), m at least 1: longitude and latitude in degrees.
    properties
        What to say of the path: text, numbers, truth values, None, and lists and mappings of these.

    Raises
    ------
    ScenarioError
        If the path has another shape, or a coordinate is no number, not finite or out of range; if a property
        is of a kind that JSON cannot hold.

    Examples
    --------
    >>> line = line_feature_collection([[24.0, 60.0], [25.0, 60.5]], {"cost": 3.5, "gap": math.nan})
    >>> line["features"][0]["geometry"]
    {'type': 'LineString', 'coordinates': [[24.0, 60.0], [25.0, 60.5]]}
    >>> line["features"][0]["properties"]
    {'cost': 3.5, 'gap': None}
    """
    try:
        points = np.asarray(path_lonlat, dtype=np.float64)
    except (TypeError, ValueError) as error:
        message = f"the path is not an array of numbers ({error}): pass longitudes and latitudes, shape (m, 2)"
        raise ScenarioError(" ".join(message.split())) from error
    if points.ndim != 2 or points.shape[0] < 1 or points.shape[1] != 2:  # noqa: PLR2004 - (m, 2)
        fail(f"the path has shape {points.shape}", "(m, 2) with m at least 1", "pass one row a point")
    line = [list(_position(position, f"the path: position {index}")) for index, position in enumerate(points.tolist())]
    geometry = (
        {"type": "LineString", "coordinates": line} if len(line) > 1 else {"type": "Point", "coordinates": line[0]}
    )
    plain = {str(key): _plain(value, f"property {reprlib.repr(key)}") for key, value in properties.items()}
    feature = {"type": "Feature", "properties": plain, "geometry": geometry}
    return {"type": "FeatureCollection", "features": [feature]}


def _document(path: str | os.PathLike[str], file: str) -> object:
    """Return what a JSON file holds."""
    text = read_text(path, file, "a GeoJSON file")
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        message = f"{file}, line {error.lineno}, column {error.colno}: not JSON ({error.msg}): correct it there"
    except (ValueError, RecursionError) as error:
        remedy = "remove numbers of thousands of digits and deep nesting"
        message = f"{file}: not JSON that can be read ({error}): {remedy}"
    raise ScenarioError(" ".join(message.split()))


def _features(document: object, file: str) -> list[object]:
    """Return the features of a document; a geometry alone counts as a feature without properties."""
    kind = document.get("type") if isinstance(document, dict) else None
    if not isinstance(document, dict) or kind not in ("FeatureCollection", "Feature", *GEOMETRIES):
        found = f"its type is {reprlib.repr(kind)}" if isinstance(document, dict) else "it is no JSON object"
        allowed = "FeatureCollection, Feature, Polygon or MultiPolygon"
        fail(f"{file}: not GeoJSON, {found}", allowed, "export the areas as GeoJSON")
    if kind == "Feature":
        return [document]
    if kind != "FeatureCollection":
        return [{"type": "Feature", "geometry": document}]
    features = document.get("features")
    if not isinstance(features, list) or not features:
        wrong = f"{file}: the FeatureCollection has features {reprlib.repr(features)}"
        fail(wrong, "a list of at least one", "add an area, or leave the file out")
    return features


def _area(feature: object, index: int, file: str) -> Area:
    """Return the area of one feature."""
    where = f"{file}: feature {index}"
    if not isinstance(feature, dict) or feature.get("type") != "Feature":
        short = reprlib.repr(feature.get("type") if isinstance(feature, dict) else feature)
        found = f"has the type {short}" if isinstance(feature, dict) else f"is {short}"
        fail(f"{where} {found}", "in features, only an object of type 'Feature'", "wrap it in one")
    properties = feature.get("properties")
    if not isinstance(properties, dict | None):
        fail(f"{where} has properties {reprlib.repr(properties)}", "an object or null", "write {}")
    own = {str(key).lower(): value for key, value in (properties or {}).items()}
    for name in (*(own.get(key) for key in NAMES), feature.get("id")):
        if isinstance(name, str | int) and str(name).strip():
            return Area(str(name), _geometry(feature.get("geometry"), f"{where} ({reprlib.repr(str(name))})"))
    return Area(f"area {index}", _geometry(feature.get("geometry"), where))


def _geometry(geometry: object, where: str) -> Polygon | MultiPolygon:
    """Return a valid polygon or several."""
    if not isinstance(geometry, dict):
        found = "no geometry (null)" if geometry is None else f"the geometry {reprlib.repr(geometry)}"
        fail(f"{where} has {found}", "Polygon or MultiPolygon", "draw the area, or drop the feature")
    kind = geometry.get("type")
    if kind not in ("Polygon", "MultiPolygon"):
        remedy = "drop it, buffer points and lines into polygons, and split a collection into features"
        fail(f"{where} is of type {reprlib.repr(kind)}", "Polygon or MultiPolygon", remedy)
    coordinates = geometry.get("coordinates")
    if kind == "Polygon":
        area: Polygon | MultiPolygon = _polygon(coordinates, where)
    else:
        parts = enumerate(_list(coordinates, where, "polygons"))
        area = MultiPolygon([_polygon(part, f"{where}, polygon {index}") for index, part in parts])
    if not area.is_valid:
        reason = shapely.is_valid_reason(area).replace("[", " at [")
        wrong = f"{where} is no valid area: {reason} (longitude latitude)"
        remedy = "redraw it there, or repair the file with shapely.make_valid"
        fail(wrong, "only an area whose rings do not cross or overlap", remedy)
    return area


def _polygon(rings: object, where: str) -> Polygon:
    """Return a polygon: the first ring is its border, the others are holes."""
    border, *holes = [_ring(ring, f"{where}, ring {index}") for index, ring in enumerate(_list(rings, where, "rings"))]
    return Polygon(border, holes)


def _ring(ring: object, where: str) -> list[Position]:
    """Return the positions of a closed ring."""
    positions = [
        _position(position, f"{where}, position {index}")
        for index, position in enumerate(_list(ring, where, "positions"))
    ]
    if len(positions) < SHORTEST_RING:
        allowed = f"at least {SHORTEST_RING}, the last equal to the first,"
        fail(f"{where} has {len(positions)} positions", allowed, "add corners, or drop the ring")
    if positions[0] != positions[-1]:
        wrong = f"{where} is open: it begins at {positions[0]} and ends at {positions[-1]}"
        fail(wrong, "only a closed ring", "repeat the first position at the end")
    return positions


def _position(position: object, where: str) -> Position:
    """Return longitude and latitude, both in range; a height behind them is dropped."""
    if not isinstance(position, list) or len(position) < 2:  # noqa: PLR2004 - longitude and latitude
        fail(f"{where} is {reprlib.repr(position)}", "[longitude, latitude]", "write two numbers")
    for value, word, most in zip(position, ("longitude", "latitude"), (180, 90), strict=False):
        # A truth value is an int to Python, but no number to JSON. NaN fails the comparison.
        if isinstance(value, bool) or not isinstance(value, int | float) or not -most <= value <= most:
            wrong = f"{where} has the {word} {reprlib.repr(value)}"
            fail(wrong, f"a number in [-{most}, {most}]", "give degrees (WGS84), longitude first")
    return float(position[0]), float(position[1])


def _list(value: object, where: str, what: str) -> list[object]:
    """Return a list that is not empty."""
    if not isinstance(value, list) or not value:
        fail(
            f"{where} has {reprlib.repr(value)} for its {what}",
            "a list of at least one",
            f"write its {what}, or drop it",
        )
    return value


def _plain(value: object, where: str) -> object:
    """Return a value that JSON can hold."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str | int | None):
        return value
    if isinstance(value, Mapping):
        return {str(key): _plain(item, where) for key, item in value.items()}
    if not isinstance(value, list | tuple):
        allowed = "only text, numbers, truth values, None, lists or mappings of these"
        fail(f"{where} holds the type {type(value).__name__}", allowed, "convert it")
    return [_plain(item, where) for item in value]

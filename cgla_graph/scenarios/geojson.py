"""GeoJSON (RFC 7946): a reader of areas and a writer of planned paths."""

import math
import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import shown
from cgla_graph._validate import number_array
from cgla_graph.airspace.zones import geojson
from cgla_graph.airspace.zones.geojson import Area, position_of
from cgla_graph.errors import FileFormatError, ProblemError, ScenarioError
from cgla_graph.scenarios.text_files import fail


def read_areas(path: str | os.PathLike[str]) -> list[Area]:
    """
    Read the areas of a GeoJSON file, as `cgla_graph.airspace.zones.geojson.read_areas` does.

    Raises
    ------
    ScenarioError
        If anything is wrong with the file.
    """
    try:
        return geojson.read_areas(path)
    except FileFormatError as error:
        raise ScenarioError(str(error)) from error


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
        Properties of the path: text, numbers, truth values, None, and lists and mappings of these.

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
        points = number_array("the path", path_lonlat)
    except ProblemError as error:
        msg = f"{error}: longitudes and latitudes, shape (m, 2)"
        raise ScenarioError(msg) from error
    if points.ndim != 2 or points.shape[0] < 1 or points.shape[1] != 2:  # noqa: PLR2004 - (m, 2)
        fail(f"the path has shape {points.shape}", "(m, 2) with m at least 1", "pass one row a point")
    try:
        line = [list(position_of(one, f"the path: position {index}")) for index, one in enumerate(points.tolist())]
    except FileFormatError as error:
        raise ScenarioError(str(error)) from error
    geometry = (
        {"type": "LineString", "coordinates": line} if len(line) > 1 else {"type": "Point", "coordinates": line[0]}
    )
    plain = {str(key): _plain(value, f"property {shown(key)}") for key, value in properties.items()}
    feature = {"type": "Feature", "properties": plain, "geometry": geometry}
    return {"type": "FeatureCollection", "features": [feature]}


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

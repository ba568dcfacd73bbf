"""Maps in JSON: the datum of their coordinates, and the format of ArcGIS, which is neither GeoJSON nor ED-269."""

import re
from collections.abc import Iterator

from cgla_graph._text import shown
from cgla_graph.untrusted.files import fault

#: EPSG codes of degrees on WGS84, or on a datum within a metre or two of it.
WGS84 = (4326, 4979, 4258, 4269)
#: Names of a system of coordinates: a code of EPSG as word, URN or address, and degrees of OGC, longitude first.
_CODE = re.compile(r"(?:.*[^a-z0-9])?EPSG(?:\.xml)?[:/#]+(?:[0-9.]*[:/])?(\d{4,6})", re.IGNORECASE | re.ASCII)
_CRS84 = re.compile(r"(?:.*[^a-z0-9])?OGC[:/]+(?:[0-9.]*[:/])?CRS84h?|CRS:?84h?|WGS ?84", re.IGNORECASE | re.ASCII)
_REMEDY = "convert it to longitude and latitude on WGS84 (ogr2ogr -t_srs EPSG:4326)"
#: Geometries of ArcGIS by a key that no other format has.
_RINGS = {"rings", "paths", "curveRings", "curvePaths"}


def require_wgs84(document: object, file: str) -> None:
    """
    Check that parsed GeoJSON, named `file` in errors, has no coordinates but degrees on WGS84.

    RFC 7946 has only these. Its predecessor of 2008 had the member ``crs`` at any level, which files still have.

    Raises
    ------
    FileFormatError
        If ``crs`` is another system, unknown (null) or a link.

    Examples
    --------
    >>> crs = {"type": "name", "properties": {"name": "EPSG:4301"}}
    >>> require_wgs84({"type": "FeatureCollection", "crs": crs, "features": []}, "tokyo.geojson")
    Traceback (most recent call last):
        ...
    cgla_graph.errors.FileFormatError: tokyo.geojson: its coordinates (crs) are those of 'EPSG:4301', not degrees on
    WGS84; convert it to longitude and latitude on WGS84 (ogr2ogr -t_srs EPSG:4326)
    """
    for one, where in _objects(document, file):
        if "crs" in one:
            name = _name_of(one["crs"])
            if name is None:
                fault(where, f"its system of coordinates (crs) is {shown(one['crs'])}, which names none", _REMEDY)
            code = _CODE.fullmatch(name)
            if not (int(code[1]) in WGS84 if code else _CRS84.fullmatch(name)):
                fault(where, f"its coordinates (crs) are those of {shown(name)}, not degrees on WGS84", _REMEDY)


def _objects(document: object, file: str) -> Iterator[tuple[dict[str, object], str]]:
    """Yield a document, its features, their geometries, and the parts of these, with names."""
    stack = [(document, file)]
    while stack:
        one, where = stack.pop()
        if isinstance(one, dict):
            yield one, where
            stack.append((one.get("geometry"), where))
            for key in ("features", "geometries"):
                listed = one.get(key)
                word = {"features": "feature", "geometries": "geometry"}[key]
                if isinstance(listed, list):
                    stack += [(part, f"{where}: {word} {index}") for index, part in enumerate(listed)]


def _name_of(crs: object) -> str | None:
    """Return the name of a system of coordinates, as the members of 2008 and of older files have it."""
    if isinstance(crs, str):
        return crs.strip()
    properties = crs.get("properties") if isinstance(crs, dict) else None
    if not isinstance(crs, dict) or not isinstance(properties, dict):
        return None
    name, code = properties.get("name"), properties.get("code")
    if isinstance(name, str):
        return name.strip()
    is_code = isinstance(code, int | str) and str(crs.get("type")).upper() == "EPSG"
    return f"EPSG:{code}" if is_code else None


def refuse_esri(document: object, file: str) -> None:
    """
    Refuse the JSON of ArcGIS, whose features have ``attributes`` and ``rings``.

    Raises
    ------
    FileFormatError
        If it is one; the message says how to get GeoJSON instead.

    Examples
    --------
    >>> refuse_esri({"geometryType": "esriGeometryPolygon", "features": []}, "zones.json")
    Traceback (most recent call last):
        ...
    cgla_graph.errors.FileFormatError: zones.json: it is Esri JSON, the own format of ArcGIS, which is not read; ask its
    server for GeoJSON (f=geojson instead of f=json), or convert it (ogr2ogr zones.geojson FILE)
    """
    if is_esri(document):
        remedy = "ask its server for GeoJSON (f=geojson instead of f=json), or convert it (ogr2ogr zones.geojson FILE)"
        fault(file, "it is Esri JSON, the own format of ArcGIS, which is not read", remedy)


def is_esri(document: object) -> bool:
    """
    Return whether a document is JSON of ArcGIS: a set of features, a list of them, a feature or a geometry.

    Examples
    --------
    >>> is_esri([{"attributes": {"NAME": "harbour"}, "geometry": {"rings": []}}]), is_esri({"features": []})
    (True, False)
    """
    if isinstance(document, list):
        return any(_is_esri_feature(one) for one in document)
    if not isinstance(document, dict) or isinstance(document.get("type"), str):
        return False
    if str(document.get("geometryType", "")).startswith("esri") or "featureCollection" in document:
        return True
    features = document.get("features")
    listed = features if isinstance(features, list) else [document]
    return any(_is_esri_feature(one) for one in listed)


def _is_esri_feature(one: object) -> bool:
    """Return whether an object is a feature or a geometry of ArcGIS."""
    if not isinstance(one, dict) or isinstance(one.get("type"), str):
        return False
    geometry = one.get("geometry")
    inside = geometry if isinstance(geometry, dict) else one
    return "attributes" in one or bool(inside.keys() & _RINGS) or "spatialReference" in inside

"""Maps in JSON of another datum or format are refused, by readers of zones, areas and plans."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from zone_files import data_of, ed318, geojson

import cgla_graph as cg
from cgla_graph.airspace.zones.geojson import read_areas
from cgla_graph.errors import FileFormatError
from cgla_graph.untrusted.json_maps import WGS84, is_esri, require_wgs84

LINE = {"type": "LineString", "coordinates": [[139.0, 35.0], [139.1, 35.1]]}
PLAN = {"type": "Feature", "properties": {}, "geometry": LINE}


def named(name: object) -> dict[str, Any]:
    """Return a system of coordinates as GeoJSON of 2008 has it."""
    return {"type": "name", "properties": {"name": name}}


def doors(tmp_path: Path) -> list[tuple[Callable[[Path], object], dict[str, Any]]]:
    """Return each reader with a document that it reads."""
    return [(cg.read_zones, geojson()), (cg.read_zones, ed318()), (read_areas, geojson()), (cg.read_plan, PLAN)]


SPELLINGS = ("EPSG:{}", "urn:ogc:def:crs:EPSG::{}", "urn:ogc:def:crs:EPSG:6.9:{}", "epsg:{}")
ADDRESSES = ("http://www.opengis.net/def/crs/EPSG/0/{}", "http://www.opengis.net/gml/srs/epsg.xml#{}")


@pytest.mark.parametrize("code", [*WGS84, 4301, 4230, 4267, 4277, 3857, 25832, 2056])
def test_coordinates_of_another_datum_are_refused(code: int, tmp_path: Path) -> None:
    """At any level of the file, in any spelling of the code, by every reader."""
    path = tmp_path / "map.json"
    for read, document in doors(tmp_path):
        for spelling in (*SPELLINGS, *ADDRESSES):
            path.write_bytes(data_of({**document, "crs": named(spelling.format(code))}))
            if code in WGS84:
                read(path)
            else:
                with pytest.raises(FileFormatError, match=f"{code}', not degrees on WGS84; convert"):
                    read(path)
    collection = {"type": "FeatureCollection", "features": [geojson()]}
    for level in ("feature", "geometry"):
        deep: Any = json.loads(json.dumps(collection))
        feature = deep["features"][0]
        (feature if level == "feature" else feature["geometry"])["crs"] = {"type": "EPSG", "properties": {"code": code}}
        path.write_bytes(data_of(deep))
        if code not in WGS84:
            with pytest.raises(FileFormatError, match=f"feature 0: its coordinates .*{code}"):
                cg.read_zones(path)


NAMES = [
    "urn:ogc:def:crs:OGC:1.3:CRS84",
    "OGC:CRS84",
    "urn:ogc:def:crs:OGC::CRS84h",
    "http://www.opengis.net/def/crs/OGC/1.3/CRS84",
    "WGS 84",
]
UNKNOWN: list[object] = [None, {}, 5, {"type": "link", "properties": {"href": "a.prj"}}, named(None), named(" ")]


@pytest.mark.parametrize("name", NAMES)
def test_names_of_degrees_on_wgs84(name: str) -> None:
    require_wgs84({"crs": named(name)}, "mine")


@pytest.mark.parametrize("crs", UNKNOWN)
def test_unknown_coordinates_are_refused(crs: object, tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    for read, document in doors(tmp_path):
        path.write_bytes(data_of({**document, "crs": crs}))
        with pytest.raises(FileFormatError, match="coordinates"):
            read(path)


RINGS = {"rings": [[[6, 49], [7, 49], [7, 50], [6, 49]]]}
ESRI = {
    "a query": {"geometryType": "esriGeometryPolygon", "features": [{"attributes": {"N": 1}, "geometry": RINGS}]},
    "no geometry type": {"features": [{"attributes": {"N": 1}, "geometry": RINGS}]},
    "no attributes": {"features": [{"geometry": RINGS}]},
    "no features": {"displayFieldName": "N", "geometryType": "esriGeometryPoint", "features": []},
    "points": {"features": [{"attributes": {}, "geometry": {"x": 6.0, "y": 49.0}}], "spatialReference": {"wkid": 4326}},
    "a list": [{"attributes": {"N": 1}, "geometry": RINGS}],
    "a feature": {"attributes": {"N": 1}, "geometry": RINGS},
    "a geometry": {**RINGS, "spatialReference": {"wkid": 102100}},
    "a point": {"x": 6.0, "y": 49.0, "spatialReference": {"wkid": 4326}},
    "points without attributes": {
        "features": [{"geometry": {"x": 6.0, "y": 49.0, "spatialReference": {"wkid": 4326}}}]
    },
    "a layer": {"featureCollection": {"layers": [{"featureSet": {"features": []}}]}},
    "curves": {"features": [{"geometry": {"curveRings": [[[6, 49], {"c": [[7, 49], [7, 50]]}]]}}]},
    "lines": {"features": [{"attributes": {}, "geometry": {"paths": [[[6, 49], [7, 49]]]}}]},
}


@pytest.mark.parametrize("kind", ESRI)
def test_esri_json_is_told_from_other_formats(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    path.write_bytes(json.dumps(ESRI[kind]).encode())
    # (a list is no plan in any format)
    for read in (cg.read_zones, read_areas, *([] if isinstance(ESRI[kind], list) else [cg.read_plan])):
        with pytest.raises(FileFormatError, match=r"it is Esri JSON.*f=geojson"):
            read(path)
    assert not any(is_esri(document) for document in (geojson(), ed318(), {"features": [{"identifier": "A"}]}))

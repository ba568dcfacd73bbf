"""Published files of zones and areas against a reader of a few lines, by shapely and pyproj alone."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import shapely
from pyproj import Geod
from zone_files import HOLE, PUBLISHED, SQUARE, circle, data_of, ed269, ed318, geojson, layer, volume

import cgla_graph as cg
from cgla_graph.errors import FileFormatError

EARTH = Geod(ellps="WGS84")
AIRSPACE = PUBLISHED.with_name("airspace")
FILES = [*sorted(PUBLISHED.glob("*.json")), *sorted(AIRSPACE.glob("*.geojson"))]
FEET = {"FT": 0.3048, "M": 1.0}
#: Small files of the same shapes, for a clone without the published ones.
OWN = {
    "ED-269": ed269(
        volume(uomDimensions="FT", lowerLimit=500, upperLimit=1500),
        volume(horizontalProjection={"type": "Circle", "center": [6.5, 49.5], "radius": 800}),
    ),
    "ED-318": ed318({"type": "GeometryCollection", "geometries": [
        circle(6.5, 49.5, 800), {"type": "MultiPolygon", "coordinates": [[SQUARE, HOLE]], "layer": layer(lower=200)},
    ]}),
    "GeoJSON": geojson(),
}  # fmt: skip


def metres2(area: Any) -> float:  # noqa: ANN401 - of shapely
    """Return the area on the ellipsoid, of parts with holes."""
    return sum(
        abs(EARTH.geometry_area_perimeter(shapely.Polygon(part.exterior))[0])
        - sum(abs(EARTH.geometry_area_perimeter(shapely.Polygon(hole))[0]) for hole in part.interiors)
        for part in shapely.get_parts(area).tolist()
    )


def around(centre: list[float], radius: float) -> Any:  # noqa: ANN401 - of shapely
    """Return a geodesic circle."""
    bearings = range(0, 360, 2)
    longitudes, latitudes, _ = EARTH.fwd([centre[0]] * 180, [centre[1]] * 180, list(bearings), [radius] * 180)
    return shapely.Polygon(list(zip(longitudes, latitudes, strict=True)))


def parts_of(feature: dict[str, Any]) -> Iterator[tuple[Any, bool, float, float]]:
    """Yield shape, whether it is a circle, floor and ceiling in metres, of each layer of a feature."""
    geometry = feature["geometry"]
    if isinstance(geometry, list):
        for one in geometry:
            unit, shape = FEET[one["uomDimensions"].upper()], one["horizontalProjection"]
            low, high = (one.get(key) for key in ("lowerLimit", "upperLimit"))
            high = None if high is not None and high >= 99_999 else high
            if shape["type"] == "Circle":
                yield around(shape["center"], shape["radius"]), True, unit * (low or 0), unit * (high or float("inf"))
            else:
                first, *holes = shape["coordinates"]
                yield shapely.Polygon(first, holes), False, unit * (low or 0), unit * (high or float("inf"))
        return
    for one in geometry.get("geometries", [geometry]):
        table = one.get("layer") or {"uom": "m"}
        unit = FEET[table["uom"].upper()]
        low, high = unit * (table.get("lower") or 0), unit * (table.get("upper") or float("inf"))
        if one["type"] == "Point":
            yield around(one["coordinates"], one["extent"]["radius"]), True, low, high
        else:
            plain = {"type": one["type"], "coordinates": one["coordinates"]}
            yield shapely.from_geojson(json.dumps(plain)), False, low, high


@pytest.mark.parametrize("source", [*OWN, *FILES], ids=lambda one: getattr(one, "name", one))
def test_counts_areas_and_heights_are_those_of_another_reader(source: str | Path, tmp_path: Path) -> None:
    path = source if isinstance(source, Path) else tmp_path / "own.json"
    if not isinstance(source, Path):
        path.write_bytes(data_of(OWN[source]))
    if "Invalid" in path.name:
        with pytest.raises(FileFormatError):
            cg.read_zones(path)
        return
    document = json.loads(path.read_bytes().decode("utf-8-sig"))
    features = document.get("features", [document])
    zones = cg.read_zones(path)
    assert len(zones.zones) == len(features)
    assert not zones.no_areas
    for zone, feature in zip(zones, features, strict=True):
        parts = list(parts_of(feature))
        assert len(zone.layers) == len(parts)
        for one, (shape, is_circle, low, high) in zip(zone.layers, parts, strict=True):
            most = 1.004 if is_circle else 1.0 + 1e-9
            assert metres2(shape) * (1.0 - 1e-9) <= metres2(one.area) <= metres2(shape) * most
            assert is_circle or one.area.symmetric_difference(shape).area == 0.0
            assert (one.lower.metres, one.upper.metres) == (pytest.approx(low), pytest.approx(high))
    # all that is closed is closed by the files' own words
    closed = {one.identifier for one in zones.apply().account().records if one.state == "closed"}
    words = [one.get("restriction") or (one.get("properties") or {}).get("type") for one in features]
    assert len(closed) == len({zone.identifier for zone in zones}) - words.count("NO_RESTRICTION")

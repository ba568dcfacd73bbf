"""GeoJSON: reading of areas and writing of planned paths."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from map_files import AREAS, name_of
from numpy.typing import ArrayLike

from cgla_graph.errors import ScenarioError
from cgla_graph.model.earth import LocalProjection, project_area
from cgla_graph.scenarios.geojson import line_feature_collection, read_areas

#: How many areas files have, and the name of the first.
CONTENTS = {
    "danger_areas": (14, "Danger area 1"),
    "finland_controlled": (28, "Helsinki-Vantaa CTR N"),
    "finland_restricted": (51, "Loviisa"),
}
SQUARE = [[24.0, 60.0], [25.0, 60.0], [25.0, 61.0], [24.0, 61.0], [24.0, 60.0]]
HOLE = [[24.2, 60.2], [24.4, 60.2], [24.4, 60.4], [24.2, 60.2]]
AWAY = [[30.0, 60.0], [31.0, 60.0], [31.0, 61.0], [30.0, 60.0]]


def polygon(*rings: object) -> dict[str, object]:
    return {"type": "Polygon", "coordinates": list(rings)}


def feature(geometry: object, **members: object) -> dict[str, object]:
    return {"type": "Feature", "properties": None, "geometry": geometry, **members}


def collection(*features: object) -> dict[str, object]:
    return {"type": "FeatureCollection", "features": list(features)}


def only_feature(path: ArrayLike, properties: dict[str, object]) -> dict[str, object]:
    features = line_feature_collection(path, properties)["features"]
    assert isinstance(features, list)
    assert len(features) == 1
    return dict(features[0])


def written(folder: Path, document: object) -> Path:
    path = folder / "areas.geojson"
    path.write_text(document if isinstance(document, str) else json.dumps(document), encoding="utf-8")
    return path


def message_of(path: Path) -> str:
    with pytest.raises(ScenarioError) as caught:
        read_areas(path)
    message = str(caught.value)
    assert message.startswith(repr(str(path)))
    assert "\n" not in message
    return message


@pytest.mark.parametrize(
    "document",
    [polygon(SQUARE, HOLE), feature(polygon(SQUARE, HOLE)), collection(feature(polygon(SQUARE, HOLE)))],
)
def test_geometry_feature_and_collection_read_alike(tmp_path: Path, document: object) -> None:
    (area,) = read_areas(written(tmp_path, document))
    assert area.name == "area 0"
    assert area.polygon.area == pytest.approx(0.98, rel=1e-12)
    assert isinstance(area.polygon, shapely.Polygon)
    assert len(area.polygon.interiors) == 1


def test_several_polygons_with_heights_and_either_direction(tmp_path: Path) -> None:
    high = [[*position, 120.0] for position in reversed(SQUARE)]
    document = {"type": "MultiPolygon", "coordinates": [[high], [AWAY]]}
    (area,) = read_areas(written(tmp_path, document))
    assert isinstance(area.polygon, shapely.MultiPolygon)
    assert area.polygon.area == pytest.approx(1.5, rel=1e-12)
    assert not area.polygon.has_z


def test_names(tmp_path: Path) -> None:
    named = [
        feature(polygon(SQUARE), properties={"name": "MÄKILUOTO"}, id=7),
        feature(polygon(SQUARE), properties={"name": " "}, id=7),
        feature(polygon(SQUARE), properties={"name": None}),
        feature(polygon(SQUARE), properties={"name": "two\nlines"}),
    ]
    # a byte order mark is skipped
    areas = read_areas(written(tmp_path, "\ufeff" + json.dumps(collection(*named))))
    assert [area.name for area in areas] == ["MÄKILUOTO", "7", "area 2", "two\nlines"]


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ('{"type":\n  nonsense}', ": line 2, column 3: not JSON"),
        ("", ": line 1, column 1: not JSON"),
        ("[" * 100_000, "nested more than 64 deep"),
        ('{"type": ' + "9" * 5000 + "}", "not JSON that can be read"),
        ([], "not GeoJSON, it is no JSON object"),
        ({"type": "Topology"}, "not GeoJSON, its type is 'Topology'"),
        ({"type": ["Polygon"]}, "not GeoJSON, its type is ['Polygon']"),
        (collection(), "has features []; a list of at least one"),
        (collection(feature(polygon(SQUARE)), 5), "feature 1 is 5"),
        (collection(polygon(SQUARE)), "feature 0 has the type 'Polygon'; in features, only"),
        (feature(polygon(SQUARE), properties=[1]), "feature 0 has properties [1]"),
        (feature(None, properties={"name": "a\nb"}), r"feature 0 ('a\nb') has no geometry"),
        (feature("square"), "feature 0 has the geometry 'square'"),
        (
            collection(feature(polygon(SQUARE)), feature({"type": "Point", "coordinates": [1, 2]})),
            "feature 1 is of type 'Point'; Polygon or MultiPolygon is allowed: drop it",
        ),
        (feature({"type": {}, "coordinates": []}), "feature 0 is of type {}"),
        (polygon(), "feature 0 has [] for its rings"),
        ({"type": "MultiPolygon", "coordinates": []}, "feature 0 has [] for its polygons"),
        ({"type": "MultiPolygon", "coordinates": [[]]}, "feature 0, polygon 0 has [] for its rings"),
        (polygon(SQUARE, []), "ring 1 has [] for its positions"),
        (polygon([[1, 2], [2, 2], [1, 2]]), "ring 0 has 3 positions; at least 4"),
        (polygon(SQUARE[:-1]), "ring 0 is open: it begins at (24.0, 60.0) and ends at (24.0, 61.0)"),
        (polygon(SQUARE, [*HOLE[:-1], [24.2, 60.3]]), "ring 1 is open"),
        (polygon([[24.0, 60.0], [25.0], SQUARE[0]]), "position 1 is [25.0]"),
        (polygon([[24.0, 60.0], 3]), "position 1 is 3"),
        (polygon([["24", 60.0]]), "position 0 has the longitude '24'"),
        (polygon([[True, 60.0]]), "position 0 has the longitude True"),
        (polygon([[math.nan, 60.0]]), "it has NaN, which is not JSON"),
        (polygon([[24.0, -math.inf]]), "it has -Infinity, which is not JSON"),
        (polygon([[10**400, 60.0]]), "position 0 has the longitude 1000"),
        (polygon([[180.5, 60.0]]), "longitude 180.5; a number in [-180, 180]"),
        (polygon([[24.0, -90.5]]), "latitude -90.5; a number in [-90, 90]"),
    ],
)
def test_malformed_files(tmp_path: Path, document: object, words: str) -> None:
    assert words in message_of(written(tmp_path, document))


def test_ring_that_crosses_itself_names_the_place(tmp_path: Path) -> None:
    bow = [[24.0, 60.0], [25.0, 61.0], [25.0, 60.0], [24.0, 61.0], [24.0, 60.0]]
    document = collection(feature(polygon(SQUARE)), feature(polygon(bow), properties={"name": "bow"}))
    message = message_of(written(tmp_path, document))
    assert "feature 1 ('bow') is no valid area: Self-intersection at [24.5 60.5]" in message


def test_hole_outside_and_flat_ring_and_overlap_are_invalid(tmp_path: Path) -> None:
    flat = [[24.0, 60.0], [25.0, 60.0], [24.5, 60.0], [24.0, 60.0]]
    overlap = {"type": "MultiPolygon", "coordinates": [[SQUARE], [SQUARE]]}
    for document in (polygon(SQUARE, AWAY), polygon(flat), polygon([[24.0, 60.0]] * 4), overlap):
        assert "is no valid area: " in message_of(written(tmp_path, document))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    assert "there is no such file" in message_of(tmp_path / "none.geojson")
    assert "it is a directory" in message_of(tmp_path)
    latin = tmp_path / "latin.geojson"
    latin.write_bytes('{"name": "MÄKI"}'.encode("latin-1"))
    assert "byte 11 is not UTF-8" in message_of(latin)
    assert "there is no such file" in message_of(Path("no\0name"))


def test_line_can_be_read_back_from_json() -> None:
    path = np.array([[24.0, 60.0], [24.5, 60.25], [25.0, 60.0]])
    before = path.copy()
    document = json.loads(json.dumps(line_feature_collection(path, {"cost": 2.5}), allow_nan=False))
    assert document["type"] == "FeatureCollection"
    (line,) = document["features"]
    assert line["type"] == "Feature"
    assert line["properties"] == {"cost": 2.5}
    assert line["geometry"] == {"type": "LineString", "coordinates": before.tolist()}
    np.testing.assert_array_equal(path, before)


@given(
    st.dictionaries(
        st.text(max_size=5),
        st.recursive(
            st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
            lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
            max_leaves=5,
        ),
        max_size=3,
    )
)
def test_any_plain_properties_become_strict_json(properties: dict[str, object]) -> None:
    text = json.dumps(line_feature_collection([[1.0, 2.0]], properties), allow_nan=False)
    assert json.loads(text)["features"][0]["properties"].keys() == properties.keys()


def test_properties_of_numpy_become_plain_and_one_point_a_point() -> None:
    properties = {
        "a": np.float64(1.5),
        "b": np.int64(3),
        "c": np.array([1.0, np.nan]),
        "d": np.bool_(1),
        "e": (1, None),
    }
    only = only_feature([[1, 2]], properties)
    assert only["geometry"] == {"type": "Point", "coordinates": [1.0, 2.0]}
    assert only["properties"] == {"a": 1.5, "b": 3, "c": [1.0, None], "d": True, "e": [1, None]}


@pytest.mark.parametrize(
    ("path", "properties", "words"),
    [
        (np.zeros((0, 2)), {}, "shape (0, 2)"),
        ([[1.0, 2.0, 3.0]], {}, "shape (1, 3)"),
        ([["a", "b"]], {}, "not an array of numbers"),
        ([[math.nan, 0.0]], {}, "position 0 has the longitude nan"),
        ([[0.0, 0.0]], {"when": object()}, "property 'when' holds the type object"),
    ],
)
def test_malformed_lines(path: object, properties: dict[str, object], words: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        line_feature_collection(path, properties)  # type: ignore[arg-type]
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("file", AREAS, ids=name_of)
def test_airspace_reads_cleanly_and_stays_valid_in_metres(file: Path) -> None:
    areas = read_areas(file)
    count, first = CONTENTS[name_of(file)]
    assert len(areas) == count
    assert areas[0].name == first
    together = shapely.union_all([area.polygon for area in areas])
    west, south, east, north = together.bounds
    assert 19.0 < west < east < 32.0
    assert 59.0 < south < north < 71.0
    projection = LocalProjection.centred_on(together.bounds)
    assert all(project_area(area.polygon, projection).is_valid for area in areas)

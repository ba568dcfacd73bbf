"""Closed lines of KML and GeoJSON: counted and named, and closed if that is asked for, through every door."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from command_line import Call, caller
from zone_files import HOLE, SQUARE, data_of, kml, kmz, polygon

import cgla_graph as cg
from cgla_graph.airspace.zones.reading import zones_of
from cgla_graph.errors import FileFormatError

AREA = shapely.Polygon(SQUARE)


def line(name: str, ring: list[list[float]], kind: str = "LineString") -> str:
    """Return a placemark with a line."""
    positions = " ".join(f"{x},{y},0" for x, y in ring)
    return f"<Placemark><name>{name}</name><{kind}><coordinates>{positions}</coordinates></{kind}></Placemark>"


def feature(geometry: dict[str, Any], **properties: object) -> dict[str, Any]:
    """Return a feature of GeoJSON."""
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def lines(*rings: Any, kind: str = "LineString") -> dict[str, Any]:  # noqa: ANN401 - positions
    """Return a geometry of GeoJSON: one line, or several."""
    return {"type": kind, "coordinates": rings[0] if kind == "LineString" else list(rings)}


def collection(*parts: dict[str, Any]) -> dict[str, Any]:
    """Return a collection of geometries."""
    return {"type": "GeometryCollection", "geometries": list(parts)}


ALMOST = [*SQUARE[:-1], [SQUARE[0][0] + 5e-7, SQUARE[0][1]]]


INSIDE = line("CTR", SQUARE).replace("<LineS", "<MultiGeometry><LineS").replace("</Place", "</MultiGeometry></Place")
CLOSED = [
    (line("CTR", SQUARE), "LineString"),
    (line("CTR", ALMOST), "LineString"),
    (line("CTR", SQUARE, "LinearRing"), "LinearRing"),
    (line("CTR", SQUARE[:-1], "LinearRing"), "LinearRing"),
    (INSIDE, "LineString"),
]


#: The same line in GeoJSON, with and without heights and more numbers.
FEATURES = [
    lines(SQUARE),
    lines(ALMOST),
    lines([[*place, 120.0, 7] for place in SQUARE]),
    lines([SQUARE[0], *[[*place, 120.0] for place in SQUARE[1:]]]),
    lines(SQUARE, kind="MultiLineString"),
    collection(collection(lines(SQUARE))),
]


@pytest.mark.parametrize(
    ("files", "kind"),
    [
        *(((kml(placemark), kmz(kml(placemark))), kind) for placemark, kind in CLOSED),
        *(((data_of(feature(one, name="CTR")), data_of(feature(one, id="CTR"))), "LineString") for one in FEATURES),
    ],
)
def test_a_closed_line_is_named_and_may_be_closed(files: tuple[bytes, ...], kind: str) -> None:
    for data in files:
        zones = zones_of(data, "mine")
        account = zones.apply().account()
        assert account.summary() == f"1 zone: 1 left out (1 a closed {kind}, not an area)"
        assert account.notes() == [
            "mine: 1 closed line (CTR) left out; lines = closed (--lines closed) closes their insides"
        ]
        applied = zones.apply(lines="closed")
        assert [(one.identifier, one.kind, one.state) for one in applied.account().records] == [
            ("CTR", "UNCLASSIFIED", "closed")
        ]
        assert applied.account().notes() == []
        (area,) = (one.area for one in applied.closed)
        assert area is not None
        assert area.symmetric_difference(AREA).area < 1e-6
        assert zones.apply(lines="closed", treat={"UNCLASSIFIED": "open"}).closed == []


@pytest.mark.parametrize(
    "ring", [SQUARE[:-1], [[6.0, 49.0], [6.2, 49.0], [6.0, 49.0]], [[6.0, 49.0], [6.2, 49.0], [6.1, 49.0], [6.0, 49.0]]]
)
def test_other_lines_enclose_nothing(ring: list[list[float]]) -> None:
    for data in (kml(line("road", ring)), data_of(feature(lines(ring), name="road"))):
        zones = zones_of(data, "mine")
        assert zones.apply(lines="closed").account().summary() == "1 zone: 1 left out (1 a LineString, not an area)"
        assert zones.apply().account().notes() == []


def test_features_of_several_geometries_are_read_as_a_whole() -> None:
    area = {"type": "Polygon", "coordinates": [HOLE]}
    apart = [[x + 1.0, y] for x, y in SQUARE]
    document = feature(collection(area, collection(lines(SQUARE, kind="MultiLineString"), lines(apart[:-1]))), name="A")
    zones = zones_of(data_of(document), "mine")
    assert zones.apply().account().summary() == (
        "3 zones: 1 closed (1 UNCLASSIFIED), "
        "2 left out (1 a closed LineString, not an area, 1 a LineString, not an area)"
    )
    assert zones.zones[0].layers[0].area.equals(shapely.Polygon(HOLE))
    closed = zones.apply(lines="closed").closed
    assert shapely.union_all([one.area for one in closed]).symmetric_difference(AREA).area < 1e-9
    two = feature(collection(area, {"type": "MultiPolygon", "coordinates": [[apart], [SQUARE]]}))
    assert zones_of(data_of(two), "mine").apply().closed[0].area.area == pytest.approx(2.0 * AREA.area)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("geometry", "said"),
    [
        (lines([[6.0, 49.0], [206.0, 49.0]]), "feature 0, position 1 has the longitude 206.0"),
        (lines([]), "feature 0 has [] for its positions"),
        ({"type": "MultiLineString", "coordinates": []}, "has [] for its lines"),
        (collection(), "has [] for its geometries"),
        (collection(lines(SQUARE), {"type": "Point", "coordinates": [6, 49]}), "geometry 1 is of type 'Point'"),
        (
            collection(collection({"type": "MultiPoint", "coordinates": [[6, 49]]})),
            "geometry 0 is of type 'MultiPoint'",
        ),
        (collection(lines(SQUARE), {"type": "Circle", "center": [6, 49], "radius": 500}), "is of type 'Circle'"),
    ],
)
def test_lines_and_collections_of_geojson_that_are_refused(geometry: dict[str, Any], said: str) -> None:
    with pytest.raises(FileFormatError, match=re.escape(said)):
        zones_of(data_of(feature(geometry)), "mine")


def test_no_fly_areas_of_scenarios_are_no_lines(tmp_path: Path) -> None:
    (tmp_path / "lines.geojson").write_bytes(data_of(feature(lines(SQUARE), name="CTR")))
    text = 'coordinates = "lonlat"\nstart = [5.9, 49.1]\ngoal = [6.3, 49.1]\nk = 0\n'
    text += '[no_fly]\ngeojson = ["lines.geojson"]\n'
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(cg.errors.ScenarioError, match=r"'CTR' is a closed LineString, not an area; .* among the zones"):
        cg.load_scenario(str(tmp_path / "mine.toml"))


def test_a_line_may_end_on_the_other_side_of_the_antimeridian() -> None:
    ring = [[180.0, 49.0], [-179.8, 49.0], [-179.8, 49.2], [-180.0, 49.0]]
    for data in (kml(line("CTR", ring)), data_of(feature(lines(ring), name="CTR"))):
        (verdict,) = zones_of(data, "mine").apply(lines="closed").closed
        assert verdict.area is not None
        assert verdict.area.area == pytest.approx(0.02)


def test_of_a_line_that_crosses_itself_very_often_the_hull_is_closed() -> None:
    corners = np.random.default_rng(1).uniform((6.0, 49.0), (7.0, 50.0), (3000, 2))
    ring = [*corners.tolist(), corners[0].tolist()]
    for data in (kml(line("CTR", ring)), data_of(feature(lines(ring), name="CTR"))):
        (verdict,) = zones_of(data, "mine").apply(lines="closed").closed
        assert "convex hull" in verdict.remark
        assert verdict.area is not None
        assert verdict.area.equals(shapely.MultiPoint(corners).convex_hull)


def test_many_are_counted_and_few_are_named() -> None:
    marks = [line(f"A{number}", [[x + number, y] for x, y in SQUARE]) for number in range(12)]
    broken = line("broken", SQUARE).replace("6.0,49.0", "6.0;49.0")
    zones = zones_of(kml(*marks, broken, f"<Placemark><name>P</name>{polygon(SQUARE)}</Placemark>"), "mine")
    (note,) = zones.apply().account().notes()
    assert note.startswith("mine: 12 closed lines (A0, A1, A2, A3, A4, …) left out")
    assert zones.apply(lines="closed").account().count("closed") == 13
    # those outside of the map are not named
    (note,) = zones.apply().within((5.0, 48.0, 7.5, 50.0)).account().notes()
    assert note.startswith("mine: 2 closed lines (A0, A1) left out")
    with pytest.raises(FileFormatError, match="lines is 'shut'; give closed"):
        zones.apply(lines="shut")  # type: ignore[arg-type]


@pytest.fixture(params=["lines.kml", "lines.geojson"])
def call(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Call:
    """Call the command line in a folder with a closed line around a hole."""
    (tmp_path / "lines.kml").write_bytes(kml(line("CTR", SQUARE), line("CTR 2", HOLE)))
    features = [feature(lines(SQUARE), name="CTR"), feature(lines(HOLE), name="CTR 2")]
    (tmp_path / "lines.geojson").write_bytes(data_of({"type": "FeatureCollection", "features": features}))
    text = 'coordinates = "lonlat"\nstart = [5.9, 49.1]\ngoal = [6.3, 49.1]\nk = 0\n[no_fly]\n'
    text += f'zones = ["{request.param}"]\n'
    (tmp_path / "bare.toml").write_text(f"bounds = [5.8, 48.8, 6.4, 49.3]\n{text.partition('[no_fly]')[0]}")
    (tmp_path / "mine.toml").write_text(text)
    (tmp_path / "shut.toml").write_text(text + 'lines = "closed"\n')
    cg.write_plan(cg.FlightPlan.along([(5.9, 49.1), (6.3, 49.1)]), tmp_path / "mine.gpx")
    called = caller(tmp_path, monkeypatch, capfd)
    return lambda *words: called(*(request.param if word == "lines.kml" else word for word in words))


def test_every_door_closes_lines(call: Call, tmp_path: Path) -> None:
    quick = ("--start", "5.9,49.1", "--goal", "6.3,49.1", "--no-certificate", "--solver", "visibility-graph", "--json")
    lengths = []
    for words in (
        ("plan", "lines.kml", *quick),
        ("plan", "mine.toml", *quick),
        ("plan", "lines.kml", *quick, "--lines", "closed"),
        ("plan", "bare.toml", "--no-fly", "lines.kml", *quick, "--lines", "closed"),
        ("plan", "mine.toml", *quick, "--lines", "closed"),
        ("plan", "shut.toml", *quick),
    ):
        answer = call(*words)
        assert answer.code == 0, answer.err
        document = answer.document()
        (account,) = document["zones"].values()
        assert (account["closed"], len(account["notes"])) == ((2, 0) if len(lengths) > 1 else (0, 1))
        lengths.append(json.loads(json.dumps(document))["length"])
    assert lengths[0] == lengths[1]
    assert min(lengths[2:]) > 1.05 * lengths[0]
    assert call("check", "mine.gpx", "--zones", "lines.kml", "--no-certificate").code == 0
    assert call("check", "mine.gpx", "--zones", "lines.kml", "--no-certificate", "--lines", "closed").code == 1
    assert call("plan", "lines.kml", *quick, "--lines", "shut").code == 2
    for name in ("lines.kml", "lines.geojson"):
        about = {"zones": tmp_path / name, "tolerance": None}
        assert not cg.check(tmp_path / "mine.gpx", lines="closed", **about).is_clean
        assert cg.check(tmp_path / "mine.gpx", **about).is_clean


def test_checks_and_missions_name_them_as_well(call: Call, tmp_path: Path) -> None:
    """On a scenario or a mission that names the files, the lines were left out without a word."""
    note = "2 closed lines (CTR, CTR 2) left out"
    cg.write_plan(cg.FlightPlan.along([(5.95, 49.1), (6.25, 49.1)]), tmp_path / "short.gpx")
    answer = call("check", "short.gpx", "mine.toml", "--no-certificate")
    assert answer.code == 0, answer.err
    assert note in answer.out
    (account,) = call("check", "short.gpx", "mine.toml", "--no-certificate", "--json").document()["zones"].values()
    assert note in account["notes"][0]
    shut = call("check", "short.gpx", "shut.toml", "--no-certificate")
    assert (shut.code, note in shut.out) == (1, False)
    # with zones beside the map, both are named
    (tmp_path / "more.kml").write_bytes(kml(line("TMZ", [[x + 0.01, y] for x, y in SQUARE])))
    both = call("check", "short.gpx", "mine.toml", "more.kml", "--no-certificate")
    assert both.code == 0
    assert "1 closed line (TMZ) left out" in both.out
    assert note in both.out
    text = (tmp_path / "mine.toml").read_text().replace("start = [5.9, 49.1]\ngoal = [6.3, 49.1]\n", "")
    uavs = 'uavs = [{name = "a", start = [5.9, 49.1], goal = [6.3, 49.1]}]\n[lattice]\nresolution = 3\n'
    head = f"bounds = [5.8, 48.8, 6.5, 49.6]\ndetection_radius = 5000\nsafe_distance = 100\n{uavs}"
    (tmp_path / "fleet.toml").write_text(text.replace("[no_fly]", f"{head}[no_fly]"))
    answer = call("fly", "fleet.toml", "--no-value")
    assert answer.code == 0, answer.err
    assert note in answer.out
    (account,) = call("fly", "fleet.toml", "--no-value", "--json").document()["zones"].values()
    assert note in account["notes"][0]

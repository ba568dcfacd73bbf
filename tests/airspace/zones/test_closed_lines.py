"""Closed lines of KML: counted and named, and closed if that is asked for, through every door."""

import json
from pathlib import Path

import pytest
import shapely
from command_line import Call, caller
from zone_files import HOLE, SQUARE, kml, kmz, polygon

import cgla_graph as cg
from cgla_graph.airspace.zones.reading import zones_of
from cgla_graph.errors import FileFormatError

AREA = shapely.Polygon(SQUARE)


def line(name: str, ring: list[list[float]], kind: str = "LineString") -> str:
    """Return a placemark with a line."""
    positions = " ".join(f"{x},{y},0" for x, y in ring)
    return f"<Placemark><name>{name}</name><{kind}><coordinates>{positions}</coordinates></{kind}></Placemark>"


ALMOST = [*SQUARE[:-1], [SQUARE[0][0] + 5e-7, SQUARE[0][1]]]


INSIDE = line("CTR", SQUARE).replace("<LineS", "<MultiGeometry><LineS").replace("</Place", "</MultiGeometry></Place")
CLOSED = [
    (line("CTR", SQUARE), "LineString"),
    (line("CTR", ALMOST), "LineString"),
    (line("CTR", SQUARE, "LinearRing"), "LinearRing"),
    (line("CTR", SQUARE[:-1], "LinearRing"), "LinearRing"),
    (INSIDE, "LineString"),
]


@pytest.mark.parametrize(("placemark", "kind"), CLOSED)
def test_a_closed_line_is_named_and_may_be_closed(placemark: str, kind: str) -> None:
    for data in (kml(placemark), kmz(kml(placemark))):
        zones = zones_of(data, "mine")
        account = zones.apply().account()
        assert account.summary() == f"1 zone: 1 left out (1 a closed {kind}, not an area)"
        assert account.notes() == [
            "mine: 1 closed line (CTR) left out; lines = closed (--lines closed) closes what they enclose"
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
    zones = zones_of(kml(line("road", ring)), "mine")
    assert zones.apply(lines="closed").account().summary() == "1 zone: 1 left out (1 a LineString, not an area)"
    assert zones.apply().account().notes() == []


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


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """Call the command line in a folder with a closed line around a hole."""
    (tmp_path / "lines.kml").write_bytes(kml(line("CTR", SQUARE), line("CTR 2", HOLE)))
    text = 'coordinates = "lonlat"\nstart = [5.9, 49.1]\ngoal = [6.3, 49.1]\nk = 0\n[no_fly]\nzones = ["lines.kml"]\n'
    (tmp_path / "mine.toml").write_text(text)
    (tmp_path / "shut.toml").write_text(text + 'lines = "closed"\n')
    cg.write_plan(cg.FlightPlan.along([(5.9, 49.1), (6.3, 49.1)]), tmp_path / "mine.gpx")
    return caller(tmp_path, monkeypatch, capfd)


def test_every_door_closes_lines(call: Call, tmp_path: Path) -> None:
    quick = ("--start", "5.9,49.1", "--goal", "6.3,49.1", "--no-certificate", "--solver", "visibility-graph", "--json")
    lengths = []
    for words in (
        ("plan", "lines.kml", *quick),
        ("plan", "mine.toml", *quick),
        ("plan", "lines.kml", *quick, "--lines", "closed"),
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
    assert not cg.check(tmp_path / "mine.gpx", zones=tmp_path / "lines.kml", lines="closed", tolerance=None).is_clean
    assert cg.check(tmp_path / "mine.gpx", zones=tmp_path / "lines.kml", tolerance=None).is_clean

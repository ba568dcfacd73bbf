"""Zones on the command line: closed, open and left out, and the list of them."""

import csv
import json
from pathlib import Path

import pytest
from command_line import Call, caller
from zone_files import circle, data_of, ed269, ed318, geojson, kml, volume

import cgla_graph as cg

ENDS = ("--start", "5.9,49.1", "--goal", "6.3,49.1")
QUICK = (*ENDS, "--no-certificate", "--solver", "visibility-graph")


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """Call the command line in a folder with files of zones."""
    high = ed269(volume(upperLimit=300, upperVerticalReference="AMSL"), identifier="A-9", restriction="CONDITIONAL")
    far = ed318(circle(20.0, 60.0, 500.0))
    for name, document in {"castle.json": ed269(), "high.json": high, "far.json": far, "map.kml": kml()}.items():
        (tmp_path / name).write_bytes(data_of(document))
    (tmp_path / "areas.geojson").write_bytes(data_of(geojson()))
    return caller(tmp_path, monkeypatch, capfd)


def test_a_plan_reports_every_zone(call: Call) -> None:
    files = ("castle.json", "high.json", "far.json", "map.kml")
    answer = call("plan", *files, *QUICK, "--altitude", 100, "--treat", "PROHIBITED=open")
    assert answer.code == 0, answer.err
    zones, note, *_ = answer.out.splitlines()
    assert zones == (
        "zones      7 zones: 3 closed (2 UNCLASSIFIED, 1 CONDITIONAL), 1 open (1 PROHIBITED), 3 left out "
        "(1 outside the map, 1 a Point, not an area, 1 a LineString, not an area)"
    )
    assert note.startswith("note       A-9: closed because heights above different things cannot be compared")
    answer = call("plan", *files, *QUICK, "--altitude", 301, "--above", "sea", "--json")
    (account,) = answer.document()["zones"].values()
    assert (account["count"], account["closed"], account["open"], account["left_out"]) == (7, 3, 1, 3)
    assert len(account["list"]) == 7
    assert [one["reason"] for one in account["list"] if one["state"] == "open"] == ["not at this altitude"]


def test_the_list_of_zones(call: Call, tmp_path: Path) -> None:
    """All commands that plan write it as CSV and JSON."""
    assert call("plan", "castle.json", "far.json", *QUICK, "--zones-list", "out/zones.csv").code == 0
    with (tmp_path / "out" / "zones.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["identifier"], row["state"], row["reason"]) for row in rows] == [
        ("A-1", "closed", "PROHIBITED"),
        ("B-2", "left out", "outside the map"),
    ]
    assert rows[0]["authority"] == "Castle office, castle@example.com"
    how = ("castle.json", *ENDS, "--zones-list", "zones.json", "--json")
    for words in (
        ("compare", *how, "--solvers", "visibility-graph", "--no-certificate"),
        ("pareto", *how, "--solver", "visibility-graph"),
        ("certify", *how, "--tolerance", "0.5"),
    ):
        answer = call(*words)
        assert answer.code == 0, answer.err
        assert answer.document()["zones"]["castle"]["closed"] == 1
        (listed,) = json.loads((tmp_path / "zones.json").read_text(encoding="utf-8"))["zones"]
        assert (listed["scenario"], listed["identifier"]) == ("castle", "A-1")
        (tmp_path / "zones.json").unlink()


def rows_of(file: Path) -> list[tuple[str, ...]]:
    """Return file, identifier, name, kind, state and reason of each row of a list."""
    with file.open(encoding="utf-8", newline="") as stream:
        keys = ("file", "identifier", "name", "kind", "state", "reason")
        return [
            tuple(Path(row[key]).name if key == "file" else row[key] for key in keys) for row in csv.DictReader(stream)
        ]


def test_areas_that_are_no_zones_are_listed(call: Call, tmp_path: Path) -> None:
    ring = [[6.2, 49.3], [6.3, 49.3], [6.3, 49.4], [6.2, 49.3]]
    far = [[x + 5.0, y] for x, y in ring]
    features = [
        {"type": "Feature", "properties": said, "geometry": {"type": "Polygon", "coordinates": [corners]}}
        for said, corners in (({"designator": "D7", "title": "range", "type": "danger"}, ring), ({}, far))
    ]
    (tmp_path / "more.json").write_bytes(data_of({"type": "FeatureCollection", "features": features}))
    bounds = ("--bounds", "5.8,48.9,6.4,49.5")
    plain = [
        ("areas.geojson", "Castle", "", "UNCLASSIFIED", "closed", "UNCLASSIFIED"),
        ("more.json", "D7", "range", "danger", "closed", "UNCLASSIFIED"),
        ("more.json", "area 1", "", "UNCLASSIFIED", "left out", "outside the map"),
    ]
    answer = call("plan", "areas.geojson", "more.json", *QUICK, *bounds, "--zones-list", "z.csv")
    assert answer.code == 0, answer.err
    assert rows_of(tmp_path / "z.csv") == plain
    assert answer.out.startswith("zones      3 zones: 2 closed (2 UNCLASSIFIED), 1 left out (1 outside the map)")
    answer = call("plan", "areas.geojson", "more.json", *QUICK, *bounds, "--zones-list", "z.csv", "--json")
    (account,) = answer.document()["zones"].values()
    assert [(one["identifier"], one["state"]) for one in account["list"]] == [(row[1], row[4]) for row in plain]
    # the list of a check is the same, and so is that of a file that names them
    call("plan", "areas.geojson", *QUICK, "--export", "mine.gpx")
    assert call("check", "mine.gpx", "areas.geojson", "--no-certificate", "--zones-list", "c.csv").code == 0
    assert rows_of(tmp_path / "c.csv") == plain[:1]
    head = 'coordinates = "lonlat"\nstart = [5.9, 49.1]\ngoal = [6.3, 49.1]\nk = 0\nbounds = [5.8, 48.9, 6.4, 49.5]\n'
    areas = '[no_fly]\ngeojson = ["areas.geojson", "more.json"]\npolygons = [[[6.0, 49.3], [6.1, 49.3], [6.1, 49.4]]]\n'
    (tmp_path / "mine.toml").write_text(f'{head}{areas}areas = [{{name = "yard", outline = {[*ring[:3]]}}}]\n')
    own = [("", name, "", "UNCLASSIFIED", "closed", "UNCLASSIFIED") for name in ("no_fly.polygons.0", "yard")]
    quick = ("--no-certificate", "--solver", "visibility-graph")
    for words in (("plan", *quick), ("compare", "--solvers", "visibility-graph", "--no-certificate")):
        answer = call(words[0], "mine.toml", *words[1:], "--zones-list", "z.csv")
        assert answer.code == 0, answer.err
        assert rows_of(tmp_path / "z.csv") == [*own, *plain]
    answer = call("check", "mine.gpx", "mine.toml", "--no-certificate", "--zones-list", "c.csv")
    assert answer.code == 0, answer.err
    assert rows_of(tmp_path / "c.csv") == [*own, *plain]
    assert [one.state for one in cg.load_scenario(str(tmp_path / "mine.toml")).area_records] == ["closed"] * 4 + [
        "left out"
    ]
    assert call("plan", "mine.toml", "castle.json", *quick, "--zones-list", "z.csv").code == 0
    assert {row[4] for row in rows_of(tmp_path / "z.csv") if row[0] == "castle.json"} == {"closed"}
    assert len(rows_of(tmp_path / "z.csv")) == 6


def test_an_altitude_is_of_zones_and_of_plans(call: Call, tmp_path: Path) -> None:
    answer = call("plan", "castle.json", *QUICK, "--altitude", 130, "--export", "castle.plan")
    assert answer.code == 0, answer.err
    assert "1 open (1 not at this altitude)" in answer.out
    assert "above ground for zones, above home in plans" in answer.out
    assert (tmp_path / "castle.plan").is_file()
    # areas without heights count at any altitude
    assert call("plan", "areas.geojson", *QUICK, "--altitude", 130, "--export", "areas.plan").code == 0


def test_zones_count_from_the_ground_up_at_take_off_and_landing(call: Call, tmp_path: Path) -> None:
    """All commands that plan refuse an end inside a zone below the flight; a plan that takes off there is not clean."""
    ends = ("--start", "6.02,49.1", "--goal", "6.3,49.1", "--altitude", 130)
    said = "take-off between the ground and 130 m AGL goes through the no-fly area 'A-1 (Castle)' of castle.json"
    for command in ("plan", "compare", "certify", "pareto"):
        call(command, "castle.json", *ends).refused(said)
    call("plan", "castle.json", *ends, "--export", "mine.plan").refused(said, "0 m AGL to 120 m AGL")
    assert not (tmp_path / "mine.plan").exists()
    (tmp_path / "mine.csv").write_text("longitude,latitude\n6.3,49.1\n6.02,49.1\n", encoding="utf-8")
    checked = ("check", "mine.csv", "castle.json", "--no-certificate", "--altitude", 130)
    answer = call(*checked)
    assert answer.code == 1
    assert (
        "not clean: its landing at 6.020000,49.100000 goes through A-1 (Castle) at 0 m AGL to 120 m AGL" in answer.out
    )
    taken = "(taken as: takes off at its first waypoint and lands at its last one)"
    rule = "zones count at 130 m AGL, and from the ground up where it takes off and lands"
    assert f"{rule} {taken}" in answer.out
    assert call(*checked, "--treat", "PROHIBITED=open").code == 0


def test_the_clearance_says_what_it_is_about(call: Call, tmp_path: Path) -> None:
    rule = "horizontal, from zones closed at 121 m AGL, and from the ground up to it at take-off and landing"
    how = ("castle.json", *QUICK, "--altitude", 121, "--clearance", 200)
    answer = call("plan", *how, "--export", "mine.plan")
    assert f"no no-fly area, required: at least 200 m ({rule}; vertical clearance 0 m)" in answer.out
    wide = call("plan", *how, "--vertical-clearance", 30, "--json").document()
    assert wide["zones"]["castle"]["vertical_clearance"] == 30.0
    assert wide["length"] > 1.01 * call("plan", *how, "--json").document()["length"]
    checked = ("check", "mine.plan", "castle.json", "--altitude", 121, "--clearance", 200, "--no-certificate")
    assert call(*checked).code == 0
    answer = call(*checked, "--vertical-clearance", 30)
    assert answer.code == 1
    assert "vertical clearance 30 m)" in answer.out
    # areas without heights are closed at all of them, and so with any vertical clearance
    assert call("plan", "areas.geojson", *QUICK, "--vertical-clearance", 30).code == 0
    assert call("check", "mine.plan", "areas.geojson", "--vertical-clearance", 30, "--no-certificate").code == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("castle.json", *QUICK, "--altitude=-5"), "altitude: it is -5 m above home, below the ground"),
        (("castle.json", *QUICK, "--altitude=-5", "--above", "ground"), "altitude: it is -5 m above ground"),
        (("castle.json", *QUICK, "--vertical-clearance", "-3"), "vertical_clearance: give at least 0"),
        (("paper", "--vertical-clearance", "3"), "paper has no zones: leave out --vertical-clearance"),
        (("castle.json", *QUICK, "--treat", "PROHIBITED"), "--treat is 'PROHIBITED'; give KIND=closed"),
        (("castle.json", *QUICK, "--treat", "ALL=open"), "treat has 'ALL'; kinds of zones are PROHIBITED"),
        (("castle.json", *QUICK, "--at", "2026-08-01T12:00"), "with its zone"),
        (("castle.json", *QUICK, "--altitude", "3", "--above", "moon"), "--above is 'moon'"),
        (("castle.json", *QUICK, "--ground", "none.tif"), "no such file"),
        (("castle.json", *QUICK, "--zones-list", "zones.txt"), "ends in .csv or .json"),
        (("castle.json", "paper", *QUICK), "holds longitudes and latitudes"),
        (("castle.json", "paper", "maze", *QUICK), "paper and maze are maps"),
        (("areas.geojson", *QUICK, "--at", "2026-08-01T12:00Z"), "areas.geojson has no zones: leave out --at"),
        (("areas.geojson", *QUICK, "--altitude", "80", "--zones-list", "z.csv"), "--altitude needs a plan to write"),
        (("paper", "--zones-list", "z.csv"), "there are no zones or no-fly areas on the map"),
        (("paper", "--treat", "PROHIBITED=open"), "paper has no zones"),
        (("none.kml", *QUICK), "none.kml: there is no such file"),
    ],
)
def test_wrong_options_are_one_line(call: Call, words: tuple[str, ...], said: str) -> None:
    call("plan", *words).refused(said)

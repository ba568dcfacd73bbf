"""`cgla plan --export`: plans for ground stations and viewers."""

import json
from pathlib import Path

import pytest
from command_line import Call
from zone_files import data_of, ed269, volume

import cgla_graph as cg
from cgla_graph.airspace.flight_plans.formats import read_plan

AREA = [[[24.8, 60.1], [25.1, 60.1], [25.1, 60.2], [24.8, 60.2], [24.8, 60.1]]]
QUICK = ("--solver", "visibility-graph", "--no-certificate", "--start", "24.7,60.12", "--goal", "25.2,60.15")
KINDS = (".plan", ".waypoints", ".kml", ".gpx", ".geojson", ".csv")


#: Below a flight at 80 m, beside the column of its start at 24.7, and below the climb of a fixed wing there.
LOW = {"type": "Circle", "center": [24.705, 60.12], "radius": 60}
FILES = {
    "areas.geojson": json.dumps({"type": "Polygon", "coordinates": AREA}),
    "low.json": json.dumps(ed269(volume(upperLimit=35, horizontalProjection=LOW))),
}


def test_a_path_is_written_to_be_flown(cgla: Call, tmp_path: Path) -> None:
    targets = [f"out/mine{kind}" for kind in KINDS]
    words = [word for target in targets for word in ("--export", target)]
    flight = ("--altitude", 80, "--above", "ground", "--speed", 12)
    answer = cgla("plan", "areas.geojson", *QUICK, *words, *flight, "--json")
    assert answer.code == 0
    found = answer.document()
    assert found["files"] == targets
    path = found["path_lonlat"]
    assert len(path) > 2
    for target in targets:
        plan = read_plan(tmp_path / target)
        # the landing is where the last leg ends
        assert plan.lonlat.tolist() == [*path, path[-1]]
        assert [one.role for one in plan.waypoints] == ["take-off", *["waypoint"] * (len(path) - 1), "landing"]
        assert {(one.altitude, one.reference) for one in plan.waypoints[:-1]} == {(80.0, "ground")}
        assert {one.speed for one in plan.waypoints[1:]} == {12.0}
        assert plan.home is not None
        assert [plan.home.x, plan.home.y] == path[0]
    assert {file.name for file in (tmp_path / "out").iterdir()} == {f"mine{kind}" for kind in KINDS}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--export", "mine.plan"], ("altitude",)),
        (["--export", "mine.doc"], (".plan", "mine.doc")),
        (["--export", "mine.kml", "--altitude", "nan"], ("altitude", "nan")),
        (["--export", "mine.kml", "--altitude=-5"], ("altitude", "-5 m above home")),
        (["--export", "mine.kml", "--altitude=-5", "--above", "ground"], ("altitude", "-5 m above ground")),
        (["--export", "mine.kml", "--altitude=-600", "--above", "sea"], ("altitude", "at least -500 m")),
        (["--export", "mine.kml", "--speed", "0"], ("speed",)),
        (["--export", "mine.kml", "--above", "clouds"], ("--above", "clouds", "home")),
        (["--altitude", "80"], ("--altitude", "--export")),
    ],
)
def test_wrong_options_are_refused_before_the_work(
    cgla: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], said: tuple[str, ...]
) -> None:
    def work(*_: object) -> None:
        pytest.fail("there was work")

    monkeypatch.setattr(cg.comparisons.study.runner, "compare", work)
    cgla("plan", "areas.geojson", *QUICK, *words).refused(*said)
    assert {file.name for file in tmp_path.iterdir()} == FILES.keys()


def test_maps_in_the_plane_have_no_plans(cgla: Call, tmp_path: Path) -> None:
    cgla("plan", "paper", "--export", "mine.kml").refused("plane", "longitude")
    assert not (tmp_path / "mine.kml").exists()


def test_paths_of_uavs_are_written(cgla: Call, tmp_path: Path) -> None:
    mission = """
coordinates = "lonlat"
bounds = [24.6, 60.0, 25.3, 60.3]
k = 1
detection_radius = 5000
safe_distance = 100
uavs = [
    { name = "one", start = [24.7, 60.1], goal = [25.2, 60.1] },
    { name = "two", start = [24.7, 60.2], goal = [25.2, 60.2] },
]
[lattice]
resolution = 5
"""
    (tmp_path / "mission.toml").write_text(mission, encoding="utf-8")
    answer = cgla("fly", "mission.toml", "--no-value", "--export", "out/mine.plan", "--altitude", 60, "--json")
    assert answer.code == 0
    found = answer.document()
    assert found["files"] == ["out/mine-one.plan", "out/mine-two.plan"]
    for uav in found["flights"][0]["uavs"]:
        plan = read_plan(tmp_path / f"out/mine-{uav['name']}.plan")
        assert plan.lonlat[:-1].tolist() == [pytest.approx(place, abs=1e-9) for place in uav["path_lonlat"]]
        assert {one.altitude for one in plan.waypoints[:-1]} == {60.0}
    cgla("fly", "swap", "--export", "mine.kml").refused("plane")
    # plans at another altitude than that of the zones may fly into others
    (tmp_path / "zones.json").write_bytes(data_of(ed269()))
    zoned = mission + '[no_fly]\nzones = ["zones.json"]\naltitude = 130\n'
    (tmp_path / "zoned.toml").write_text(zoned, encoding="utf-8")
    how = ("fly", "zoned.toml", "--no-value", "--export", "mine.plan", "--altitude")
    cgla(*how, 60).refused("the zones of the mission count at 130 m AGL", "no_fly.altitude")
    cgla(*how, 130, "--above", "sea").refused("is above the sea")
    assert cgla(*how, 130).code == 0


def test_without_a_path_nothing_is_written(cgla: Call, tmp_path: Path) -> None:
    """A straight line through the area is no plan."""
    words = [word if word != "visibility-graph" else "straight-line" for word in QUICK]
    answer = cgla("plan", "areas.geojson", *words, "--export", "mine.kml")
    assert answer.code == 1
    assert not (tmp_path / "mine.kml").exists()


@pytest.mark.parametrize(("vehicle", "clean"), [("multirotor", True), ("vtol", True), ("fixed-wing", False)])
def test_a_slope_through_a_low_zone_is_said_when_it_is_written(cgla: Call, vehicle: str, clean: bool) -> None:
    ends = ("--start", "24.7,60.12", "--goal", "24.76,60.12", *QUICK[:3])
    plan = ("plan", "low.json", *ends, "--altitude", 80, "--vehicle", vehicle, "--export", "a.plan", "--json")
    made = cgla(*plan)
    assert made.code == (0 if clean else 1)
    assert made.document()["exported"]["is_clean"] is clean
    checked = cgla("check", "a.plan", "--zones", "low.json", "--altitude", 80, "--no-certificate")
    assert checked.code == made.code
    if not clean:
        assert "exported   not clean: 1 leg crosses 1 area; it meets" in cgla(*plan[:-1]).out


@pytest.mark.parametrize(("vehicle", "code"), [("multirotor", 0), ("fixed-wing", 1)])
def test_plans_of_a_mission_are_checked_as_well(cgla: Call, tmp_path: Path, vehicle: str, code: int) -> None:
    text = """coordinates = "lonlat"
k = 0
bounds = [24.69, 60.11, 24.77, 60.13]
detection_radius = 5000.0
step = 2000.0
no_fly = { zones = ["low.json"], altitude = 80 }
uavs = [{ name = "a", start = [24.7, 60.12], goal = [24.76, 60.12] }]
"""
    (tmp_path / "slope.toml").write_text(text, encoding="utf-8")
    words = ("fly", "slope.toml", "--no-value", "--altitude", 80, "--vehicle", vehicle, "--export", "a.plan")
    flown = cgla(*words)
    assert flown.code == code, flown.err
    assert ("exported   a: not clean: 1 leg crosses 1 area" in flown.out) is bool(code)
    assert cgla(*words, "--json").document()["exported"]["is_clean"] is not bool(code)
    assert (tmp_path / "a-a.plan").exists()

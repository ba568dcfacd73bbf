"""`--ground`, `--terrain-clearance`, `--terrain-tolerance` and `--altitudes` on the command line."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Call
from zone_files import ed269, volume

from cgla_graph.airspace.flight_plans.formats import read_plan
from cgla_graph.comparisons.study import options
from cgla_graph.solvers import solving

BOX = (24.0, 60.0, 24.06, 60.02)
MAP = """coordinates = "lonlat"
start = [24.004, 60.01]
goal = [24.056, 60.01]
k = 0
bounds = [24.001, 60.001, 24.059, 60.019]
"""


def hill() -> str:
    """Return an ESRI grid of a hill of 300 m in the middle of the map."""
    y, x = np.mgrid[:20, :30]
    values = 300.0 * np.exp(-(((x - 14.5) / 3.0) ** 2 + ((y - 9.5) / 2.0) ** 2))
    rows = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in values)
    return f"ncols 30\nnrows 20\nxllcorner 24\nyllcorner 60\ndx 0.002\ndy 0.001\n{rows}\n"


SQUARE = [[24.02, 60.0], [24.04, 60.0], [24.04, 60.012], [24.02, 60.012], [24.02, 60.0]]
LAYER = volume(upperLimit=100, horizontalProjection={"type": "Polygon", "coordinates": [SQUARE]})
FILES = {"map.toml": MAP, "hill.asc": hill(), "zones.json": json.dumps(ed269(LAYER))}
FILES["a.csv"] = "longitude,latitude\n24.01,60.01\n24.05,60.01\n"
QUICK = ("--solver", "visibility-graph", "--no-certificate")


def flights(above: str) -> tuple[str, ...]:
    return (
        "plan",
        "map.toml",
        "--ground",
        "hill.asc",
        "--altitude",
        "80",
        *QUICK,
        *(("--above", above) if above else ()),
    )


@pytest.mark.parametrize(("above", "closed"), [("sea", True), ("home", True), ("ground", False), ("", True)])
def test_an_exported_plan_is_clean_over_the_same_ground(cgla: Call, above: str, closed: bool) -> None:
    answer = cgla(*flights(above), "--export", "mine.plan", "--json")

    assert answer.code == 0, answer.err
    document = answer.document()["terrain"]["map"]
    assert document["clearance"] == 30.0
    assert document["clearance_is_default"]
    assert (document["closed"] > 0) is closed
    checked = cgla("check", "mine.plan", "--ground", "hill.asc", "--no-certificate", "--json")
    assert checked.code == 0, checked.out
    assert checked.document()["terrain"]["least"] >= 30.0
    higher = ("--terrain-clearance", "200", "--no-certificate")
    assert cgla("check", "mine.plan", "--ground", "hill.asc", *higher).code == 1


def test_the_default_clearance_and_its_source_are_printed(cgla: Call) -> None:
    assert "30 m above the ground (default: TERRAIN_OFS_MAX of ArduPilot" in cgla(*flights("sea")).out
    assert "50 m above the ground (as given)" in cgla(*flights("sea"), "--terrain-clearance", "50").out
    assert "not compared, as the flight has no altitude" in cgla("plan", "map.toml", "--ground", "hill.asc", *QUICK).out


def test_a_plan_above_ground_gets_waypoints_within_a_tolerance(cgla: Call, tmp_path: Path) -> None:
    few = cgla(*flights("ground"), "--export", "few.plan", "--terrain-tolerance", "40")
    many = cgla(*flights("ground"), "--export", "many.plan")

    assert "straight legs stay within 40 m" in few.err
    assert "straight legs stay within 10 m of the altitude, and 30 m above the ground (default" in many.err
    assert 3 < len(read_plan(tmp_path / "few.plan").waypoints) < len(read_plan(tmp_path / "many.plan").waypoints)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("plan", "map.toml", "--terrain-clearance", "50"), "there is no raster of elevations; give one"),
        (("plan", "map.toml", "--ground", "hill.asc", "--terrain-clearance", "50"), "the flight has no altitude"),
        ((*flights("ground"), "--terrain-tolerance", "5"), "--terrain-tolerance needs a plan to write"),
        ((*flights("sea"), "--terrain-tolerance", "5", "--export", "a.plan"), "is of plans above ground"),
        ((*flights("ground"), "--terrain-tolerance", "0", "--export", "a.plan"), "tolerance is 0"),
        (("plan", "map.toml", *QUICK, "--altitude", "9", "--above", "ground", "--ground", "hill.asc"), "fly higher"),
        (
            (*flights("sea"), "--via", "24.03,60.01"),
            "place 1 (24.03, 60.01) is in the terrain of the map: a flight at 80",
        ),
        ((*flights("sea"), "--altitudes", "60,80"), "--altitudes and --altitude are both given"),
        (("plan", "map.toml", "--altitudes", "60,80"), "no zones and no elevations"),
        (("plan", "map.toml", "--altitudes", "60,high"), "give numbers of metres"),
        (("plan", "map.toml", "--altitudes=-5,80"), "altitude is -5 m above ground"),
        (("plan", "map.toml", "--altitudes", "60,80", "--max-risk", "1"), "--altitudes and --max-risk"),
        (("check", "a.csv", "--terrain-clearance", "9", "--zones", "zones.json"), "there are no elevations"),
        (("check", "a.csv", "--terrain-clearance", "9", "--risk", "hill.asc"), "--terrain-clearance needs"),
    ],
)
def test_senseless_options_are_refused(cgla: Call, words: tuple[str, ...], said: str) -> None:
    answer = cgla(*words)

    assert answer.code == 2
    assert said in answer.err


def test_the_best_of_several_altitudes_is_planned_told_and_exported(cgla: Call, tmp_path: Path) -> None:
    words = (
        "plan",
        "map.toml",
        "--ground",
        "hill.asc",
        "--above",
        "sea",
        "--export",
        "best.plan",
        "--tolerance",
        "0.05",
    )
    answer = cgla(*words, "--altitudes", "60,20,340,80", "--json")

    assert answer.code == 0, answer.err
    found = answer.document()["altitudes"]
    assert found["best"] == 340.0
    assert found["reference"] == "AMSL"
    assert [one["altitude"] for one in found["paths"]] == [60.0, 20.0, 340.0, 80.0]
    assert found["paths"][1]["no_path"]
    assert "is in the terrain of hill.asc" in found["paths"][1]["message"]
    assert found["lower_bound"] == min(one["lower_bound"] for one in found["paths"] if one["lower_bound"])
    assert answer.document()["cost"] == min(one["cost"] for one in found["paths"] if one["cost"])
    assert {one.altitude for one in read_plan(tmp_path / "best.plan").waypoints[:-1]} == {340.0}
    told = cgla(*words, "--altitudes", "60,80").out
    assert "best       80 m AMSL: no path at one of these altitudes costs less than" in told


def test_the_best_altitude_is_planned_once(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    solved, opened = [], []
    solve, load = solving.solve, options.open_scenarios
    monkeypatch.setattr(solving, "solve", lambda *args, **more: solved.append(args) or solve(*args, **more))
    monkeypatch.setattr(options, "open_scenarios", lambda *args, **more: opened.append(args) or load(*args, **more))
    words = ("plan", "map.toml", "--no-fly", "zones.json", "--solver", "visibility-graph", "--json")

    assert cgla(*words, "--altitudes", "80,120").document()["cost"]
    assert (len(solved), len(opened)) == (2, 2)


def test_altitudes_say_which_zones_are_closed_at_some_of_them(cgla: Call) -> None:
    words = ("plan", "map.toml", "--no-fly", "zones.json", "--solver", "visibility-graph", "--json")
    answer = cgla(*words, "--altitudes", "80,120")

    assert [one["closed_here"] for one in answer.document()["altitudes"]["paths"]] == [["A-1 (Castle)"], []]
    assert answer.document()["altitudes"]["best"] == 120.0


def test_plans_of_a_mission_follow_the_ground(cgla: Call, tmp_path: Path) -> None:
    uav = "[[uavs]]\nname = 'a'\nstart = [24.004, 60.01]\ngoal = [24.056, 60.01]\n"
    head = MAP.partition("start")[0] + "bounds = [24.001, 60.001, 24.059, 60.019]\ndetection_radius = 300\nstep = 300\n"
    (tmp_path / "mission.toml").write_text(head + uav)
    fly = ("fly", "mission.toml", "--no-value", "--ground", "hill.asc", "--altitude", "80")
    for above, closed in (("ground", False), ("sea", True), ("home", True)):
        answer = cgla(*fly, "--above", above, "--export", f"{above}.plan", "--json")
        assert answer.code == 0, answer.err
        assert (answer.document()["terrain"]["closed"] > 0) is closed
        assert cgla("check", f"{above}-a.plan", "--ground", "hill.asc", "--no-certificate").code == 0
    assert "in the terrain" in cgla(*fly, "--above", "sea", "--export", "x.plan", "--terrain-clearance", "300").err

"""`cgla plan --turn-radius`: lines and arcs, how long they take, and how they are exported."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import shapely
from command_line import Call

from cgla_graph.airspace.flight_plans.formats import read_plan
from cgla_graph.turning.curve import Curve

AREA = [[[24.8, 60.1], [25.1, 60.1], [25.1, 60.2], [24.8, 60.2], [24.8, 60.1]]]
QUICK = ("--solver", "visibility-graph", "--no-certificate", "--start", "24.7,60.12", "--goal", "25.2,60.15")


FILES = {"areas.geojson": json.dumps({"type": "Polygon", "coordinates": AREA})}


def test_a_flyable_path_is_printed_drawn_and_exported(cgla: Call, tmp_path: Path) -> None:
    curves = ("--turn-radius", 1000, "--start-heading", 0, "--arc-tolerance", 5)
    flight = ("--speed", 20, "--wind", "-5,3", "--power", 720, "--altitude", 80)
    files = ("--export", "mine.kml", "--export", "mine.waypoints", "--profile", "profile.csv", "--out", "out")
    answer = cgla("plan", "areas.geojson", *QUICK, *curves, *flight, *files, "--json")
    assert answer.code == 0
    found = answer.document()
    told = found["flyable"]
    curve = Curve(np.array(told["pieces"]))
    assert told["turn_radius"] == told["least_radius"] == 1000.0
    assert found["cost"] == pytest.approx(curve.length)
    assert np.degrees(curve.headings(np.array([0]), np.array([0.0]))) == pytest.approx([90.0], abs=1e-3)
    assert told["energy_wh"] == pytest.approx(720.0 * told["flight_seconds"] / 3600.0)
    # exported waypoints lead around the area, at most 5 m from the curve
    plan = read_plan(tmp_path / "mine.kml")
    assert plan.name == "areas: turns of 1000 m or more, within 5 m"
    assert "within 5 m of the arcs" in answer.err
    assert not shapely.LineString(plan.lonlat).relate_pattern(shapely.Polygon(AREA[0]), "T********")
    assert plan.lonlat.tolist() == read_plan(tmp_path / "mine.waypoints").lonlat.tolist()
    assert len(plan.waypoints) < len(found["path"])
    # the profile ends when the flight does
    rows = list(csv.DictReader((tmp_path / "profile.csv").read_text(encoding="utf-8").splitlines()))
    assert float(rows[-1]["seconds"]) == pytest.approx(told["flight_seconds"], rel=1e-4)
    assert {"areas-visibility-graph-flyable.csv", "areas-visibility-graph-flyable.png"} < {
        file.name for file in (tmp_path / "out").iterdir()
    }


def test_without_room_to_turn_the_exit_code_is_1(cgla: Call) -> None:
    answer = cgla("plan", "maze", "--solver", "visibility-graph", "--no-certificate", "--turn-radius", 0.3)
    assert answer.code == 1
    assert "no curve of turn radius 0.3 was found: the search came as far as (0." in answer.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--start-heading", "90"], ("--start-heading", "--turn-radius")),
        (["--turn-radius", "-1"], ("--turn-radius is -1", "above 0")),
        (["--turn-radius", "1", "--goal-heading", "nan"], ("--goal-heading is nan",)),
        (["--turn-radius", "1", "--wind", "3,4"], ("--wind", "--speed")),
        (["--turn-radius", "1", "--speed", "9", "--wind", "3"], ("--wind is '3'", "EAST,NORTH")),
        (["--turn-radius", "1", "--speed", "5", "--wind", "3,4"], ("the wind is 5 fast", "airspeed 5")),
        (["--turn-radius", "1", "--max-risk", "1"], ("--turn-radius", "--max-risk")),
    ],
)
def test_contradicting_options_are_refused(cgla: Call, words: list[str], said: tuple[str, ...]) -> None:
    cgla("plan", "maze", *words).refused(*said)

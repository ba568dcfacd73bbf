"""Variants of files that leave open where an aircraft flies: none is clean, and none is read as another flight."""

import json
from pathlib import Path
from typing import Any

import pytest
from test_unknown_is_not_clean import EAST, FAR, WEST, checked, flat, item, plan_file, volume

from cgla_graph.airspace.flight_plans.formats import plan_of_bytes
from cgla_graph.errors import PlanError

#: A layer from 60 to 70 m above the place where the aircraft changes its height.
ABOVE = volume((990, -10, 1010, 10), 60.0, 70.0)
STOP: dict[str, Any] = {"autoContinue": False}


@pytest.mark.parametrize(("first", "last"), [(50, 100), (100, 50)])
def test_a_hovering_aircraft_changes_its_height_above_the_place(tmp_path: Path, first: float, last: float) -> None:
    """NAV_LOITER_TO_ALT with a circle of no radius, as the user says."""
    data = plan_file(item(16, (-1000, 0), first), item(31, (1000, 0), last, 1, 0))
    assert not checked(tmp_path, data, ABOVE, ground=flat(tmp_path), loiter_radius=0).is_clean
    apart = volume((990, -10, 1010, 10), 110.0, 120.0)
    assert checked(tmp_path, data, apart, ground=flat(tmp_path), loiter_radius=0).is_clean


@pytest.mark.parametrize(
    ("data", "said"),
    [
        # a fixed wing circles where it waits
        (plan_file(WEST, item(16, (0, 0), 50) | STOP, EAST, vehicleType=1), "circles of the aircraft's own radius"),
        (plan_file(WEST, EAST, item(93, None, 0, 10), vehicleType=1), "circles of the aircraft's own radius"),
        # it takes off to a place, and turns there
        (plan_file(item(22, (0, 0), 50), item(16, (0, 1000), 50), vehicleType=1), "turns there on an arc"),
        (plan_file(WEST, item(85, (1000, 0), 0, 1, 0), vehicleType=22), "descends in forward flight"),
    ],
)
def test_what_a_fixed_wing_does_of_its_own_is_not_known(tmp_path: Path, data: bytes, said: str) -> None:
    assert said in checked(tmp_path, data, FAR).verdict[0]


@pytest.mark.parametrize(
    ("frame", "fields", "said"),
    [
        (3, {"AltitudeMode": 1, "Altitude": 65}, "its Altitude is 65, and that of its params is 50"),
        (0, {"AltitudeMode": 2, "Altitude": 65, "AMSLAltAboveTerrain": None}, "its Altitude is 65"),
        (3, {"AltitudeMode": 2, "Altitude": 50}, "its AltitudeMode is 2, which is not that of its frame, 3"),
        (3, {"AltitudeMode": 4, "Altitude": 50}, "its AltitudeMode is 4"),
        (10, {"AltitudeMode": 1, "Altitude": 50}, "its AltitudeMode is 1"),
        (0, {"AltitudeMode": 3, "Altitude": 80, "AMSLAltAboveTerrain": 60}, "its Altitude is 80"),
        (3, {"AltitudeMode": 1, "Altitude": 50.001}, ""),
        (3, {"AltitudeMode": 0, "Altitude": 50}, ""),
        (0, {"AltitudeMode": 1, "Altitude": 50}, ""),
        (0, {"AltitudeMode": 3, "Altitude": 20, "AMSLAltAboveTerrain": 50}, ""),
        (10, {"AltitudeMode": 4, "Altitude": 50, "AMSLAltAboveTerrain": None}, ""),
        (3, {"AltitudeMode": 1, "Altitude": None}, ""),
    ],
)
def test_two_heights_of_one_item_are_not_known(tmp_path: Path, frame: int, fields: dict[str, Any], said: str) -> None:
    """QGroundControl takes its own fields, and other readers the parameters."""
    data = plan_file(WEST | {"frame": frame}, EAST | {"frame": frame} | fields)
    found = checked(tmp_path, data, FAR)
    assert found.is_clean is not bool(said)
    assert said in found.verdict[0]


def test_the_same_is_known_of_a_multirotor_or_if_it_is_given(tmp_path: Path) -> None:
    waits = checked(tmp_path, plan_file(WEST, item(16, (0, 0), 50) | STOP, EAST), FAR)
    assert waits.is_clean
    assert "item 2: it waits there for a command to continue (autoContinue is false)" in waits.plan.remarks
    assert checked(tmp_path, plan_file(WEST, EAST, item(93, None, 0, 10)), FAR).is_clean
    plane = plan_file(WEST, item(16, (0, 0), 50) | STOP, EAST, vehicleType=1)
    assert checked(tmp_path, plane, FAR, loiter_radius=80).is_clean
    assert not checked(tmp_path, plane, volume((-10, 70, 10, 90)), loiter_radius=80).is_clean
    late = plan_file(WEST, EAST, item(93, None, 0, 10), vehicleType=1)
    assert not checked(tmp_path, late, volume((990, 70, 1010, 90)), loiter_radius=80).is_clean
    turns = plan_file(item(22, (0, 0), 50), item(16, (0, 1000), 50), vehicleType=1)
    assert checked(tmp_path, turns, FAR, acceptance_radius=90).is_clean
    assert not checked(tmp_path, turns, volume((-50, 35, -40, 45)), acceptance_radius=90).is_clean
    assert checked(tmp_path, turns, volume((-50, 35, -40, 45)), acceptance_radius=20).is_clean
    assert checked(tmp_path, plan_file(WEST, item(85, (1000, 0), 0, 0, 0), vehicleType=22), FAR).is_clean
    rows = "QGC WPL 110\n0 1 0 16 0 0 0 0 60 24 12 1\n1 0 3 16 0 0 0 0 60.1 24 50 0\n"
    assert "it waits there" in plan_of_bytes(rows.encode(), "a.waypoints").remarks[0]


@pytest.mark.parametrize(
    ("head", "cell", "said"),
    [
        ("command", "18", "command is '18'"),
        ("Cmd", "MAV_CMD_NAV_LOITER_TURNS", "cmd is"),
        ("type", "RTL", "type is 'RTL'"),
        ("action", "Land", "action is 'Land'"),
        ("mode", "orbit", "give a column role or loiter_radius"),
        ("loiter turns", "2", "loiter turns is '2'"),
        ("frame", "0", "give altitude_reference"),
        ("vertical datum", "EGM96", "give altitude_reference"),
        ("alt_mode", "AGL", "give altitude_reference"),
        ("turn type", "banked", "turn type is 'banked'"),
    ],
)
def test_columns_about_the_flight_that_are_not_read_are_not_clean(head: str, cell: str, said: str) -> None:
    """In any column that other programs write; the same column may be about straight legs, or empty."""
    table = "lat,lon,alt,{}\n60,24,50,\n60.1,24,50,{}\n"
    plan = plan_of_bytes(table.format(head, cell).encode(), "a.csv")
    assert said in plan.unknown[0]
    assert plan.unknown[0].startswith("line 3: ")
    assert not plan_of_bytes(table.format(head, "").encode(), "a.csv").unknown
    for word in ("photo", "waypoint", "16") if head in {"command", "type", "action"} else ():
        assert bool(plan_of_bytes(table.format(head, word).encode(), "a.csv").unknown) is (
            head == "command" and word == "photo"
        )


@pytest.mark.parametrize(
    "head", ["lat,lon,alt,alt", "lat,lon,latitude,alt", "lat,lon,altitude(m),altitude(ft)", "lat,lon,alt,speed,speed"]
)
def test_a_column_is_named_once(head: str) -> None:
    row = ",".join(["60", "24", "50", "70", "9"][: len(head.split(","))])
    with pytest.raises(PlanError, match=r"its first line names the column [a-z]+ twice"):
        plan_of_bytes(f"{head}\n{row}\n".encode(), "a.csv")


def test_tags_of_a_line_are_those_of_its_waypoints() -> None:
    """The distance at which a line passes its corners was left out without a word."""
    tags = {"pass_radius": 50, "altitude": 80, "altitude_reference": "sea", "name": "A", "role": "route"}
    along = [[24.0, 60.0], [24.1, 60.0]]
    feature = {"type": "Feature", "properties": tags, "geometry": {"type": "LineString", "coordinates": along}}
    data = "".join(f"<Data name='{name}'><value>{value}</value></Data>" for name, value in tags.items())
    line = "<LineString><coordinates>24,60 24.1,60</coordinates></LineString>"
    kml = f"<kml><Placemark><name>A</name><ExtendedData>{data}</ExtendedData>{line}</Placemark></kml>"
    several = {**feature, "geometry": {"type": "MultiLineString", "coordinates": [along]}}
    for text in (json.dumps(feature), json.dumps(several), kml):
        plan = plan_of_bytes(text.encode(), "a")
        assert [(one.pass_radius, one.altitude, one.reference) for one in plan.waypoints] == [(50.0, 80.0, "sea")] * 2

"""Files of plans: our readers and other libraries read back what we write, field by field."""

import json
import math
from pathlib import Path
from typing import Any

import fastkml
import gpxpy
import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from plan_files import FILES, flight_plans, mine
from pymavlink import mavwp
from strategies import few, usual

import cgla_graph as cg
from cgla_graph.airspace.flight_plans.formats import plan_of_bytes, read_plan, text_of_plan, write_plan
from cgla_graph.airspace.flight_plans.mavlink import FRAMES
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Waypoint
from cgla_graph.errors import OutputError, PlanError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.solution import Solution, Status


def again(plan: FlightPlan, kind: str) -> FlightPlan:
    return plan_of_bytes(text_of_plan(plan, f"plan{kind}").encode(), f"plan{kind}")


# read by our own readers


#: Ends at or below the place of take-off, or on ground below it: viewers show such heights as if above the ground.
START = Waypoint(24.0, 60.0, 0.0)
LOW_ENDS = (
    FlightPlan((START, Waypoint(24.1, 60.0, -1.0, role="landing"))),
    FlightPlan((START, Waypoint(24.1, 60.0, -1.0))),
    FlightPlan((START, Waypoint(24.1, 60.0, -5.0, "ground", role="touch-down"), Waypoint(24.2, 60.0, 5.0, "ground"))),
    FlightPlan((START, Waypoint(24.1, 60.0, -5.0, "ground", role="landing")), Home(24.0, 60.0)),
)


@usual
@given(flight_plans(autopilot=False))
@example(LOW_ENDS[0])
@example(LOW_ENDS[1])
@example(LOW_ENDS[2])
@example(LOW_ENDS[3])
def test_files_for_viewers_read_back_to_the_last_bit(plan: FlightPlan) -> None:
    for kind in (".kml", ".gpx", ".geojson"):
        assert again(plan, kind) == plan
        assert again(plan, kind).remarks == ()
    assert again(plan, ".csv") == plan.renamed("")


@usual
@given(flight_plans(autopilot=True))
def test_files_for_autopilots_read_back_to_the_last_bit(plan: FlightPlan) -> None:
    assert again(plan, ".plan") == plan
    assert again(plan, ".waypoints") == plan.renamed("")


def test_what_solutions_save_is_read(tmp_path: Path) -> None:
    projection = LocalProjection(24.0, 60.0)
    path = np.array([[0.0, 0.5], [1000.0, 1000.0], [3000.0, -20.0]])
    on_earth, in_plane = (Solution(Status.FOUND, path=path, projection=which) for which in (projection, None))
    for kind in ("csv", "json", "geojson"):
        plan = read_plan(on_earth.save(tmp_path / f"path.{kind}"))
        assert plan.lonlat.tolist() == on_earth.lonlat.tolist()
    for kind in ("csv", "json"):
        plan = read_plan(in_plane.save(tmp_path / f"plane.{kind}"))
        assert (plan.coordinates, plan.points.tolist()) == ("plane", path.tolist())
    with pytest.raises(PlanError, match="plane"):
        _ = plan.lonlat
    with pytest.raises(PlanError, match=r"only \.csv"):
        write_plan(plan, tmp_path / "plane.kml")


def test_nothing_half_written_is_left(tmp_path: Path) -> None:
    for name, error in (("plan.txt", OutputError), ("no/plan.kml", OutputError)):
        with pytest.raises(error):
            write_plan(mine(), tmp_path / name)
    with pytest.raises(PlanError, match="--altitude"):
        write_plan(FlightPlan((Waypoint(24.0, 60.0),)), tmp_path / "plan.plan")
    assert list(tmp_path.iterdir()) == []


# read by other libraries


def test_gpxpy_reads_what_is_written() -> None:
    read = gpxpy.parse(FILES[".gpx"])
    (route,) = read.routes
    plan = mine()
    assert (read.name, route.name) == (plan.name, plan.name)
    assert [(p.longitude, p.latitude, p.elevation, p.type) for p in route.points] == [
        (one.x, one.y, one.altitude, one.role) for one in plan.waypoints
    ]
    assert [(p.longitude, p.latitude, p.elevation, p.name) for p in read.waypoints] == [(24.94, 60.17, 14.25, "home")]


@few
@given(flight_plans(autopilot=True))
def test_pymavlink_reads_what_is_written(tmp_path_factory: pytest.TempPathFactory, plan: FlightPlan) -> None:
    """Its messages have the numbers of the file."""
    file = write_plan(plan, tmp_path_factory.mktemp("plan") / "mine.waypoints")
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(file)) > len(plan.waypoints)
    home = plan.home
    assert home is not None
    first, *items = [loader.item(index) for index in range(loader.count())]
    assert (first.seq, first.x, first.y, first.z) == (0, home.y, home.x, home.altitude)
    flown = [item for item in items if item.command not in {178, 93}]
    assert [(item.y, item.x, item.z) for item in flown] == [(one.x, one.y, one.altitude) for one in plan.waypoints]
    assert [FRAMES[item.frame] for item in flown] == [one.reference for one in plan.waypoints]
    assert [item.seq for item in items] == list(range(1, len(items) + 1))
    assert all(item.autocontinue for item in items)


def test_fastkml_reads_what_is_written() -> None:
    document = fastkml.KML.from_string(FILES[".kml"].decode().partition("\n")[2])
    (top,) = document.features
    route, folder = sorted(top.features, key=lambda part: part.name)
    plan = mine()
    assert top.name == plan.name
    assert np.array(route.geometry.coords)[:, :2].tolist() == plan.lonlat.tolist()
    home, *points = folder.features
    assert home.geometry.coords == ((24.94, 60.17, 14.25),)
    assert [point.geometry.coords[0] for point in points] == [(one.x, one.y, one.altitude) for one in plan.waypoints]
    said = [{data.name: data.value for data in point.extended_data.elements} for point in points]
    assert [one["role"] for one in said] == [one.role for one in plan.waypoints]
    assert [one["altitude_reference"] for one in said] == [one.reference for one in plan.waypoints]


def test_shapely_reads_what_is_written() -> None:
    document = json.loads(FILES[".geojson"])
    line, *points = [shapely.geometry.shape(feature["geometry"]) for feature in document["features"]]
    assert shapely.get_coordinates(line).tolist() == mine().lonlat.tolist()
    assert shapely.get_coordinates(points[1:]).tolist() == mine().lonlat.tolist()
    assert [feature["properties"].get("speed") for feature in document["features"][2:]] == [None, 12.0, 12.0, 9.5]
    # the third number of a position would be a height above the ellipsoid
    assert not any(point.has_z for point in points)


# the documented format of QGroundControl


#: Keys of each object in its developer guide, with their values or types.
DOCUMENTED: dict[str, dict[str, Any]] = {
    "file": {
        "fileType": "Plan",
        "groundStation": str,
        "mission": dict,
        "version": 1,
        "geoFence": dict,
        "rallyPoints": dict,
    },
    "mission": {
        "cruiseSpeed": float,
        "firmwareType": int,
        "globalPlanAltitudeMode": int,
        "hoverSpeed": float,
        "items": list,
        "plannedHomePosition": list,
        "vehicleType": int,
        "version": 2,
    },
    "item": {
        "autoContinue": bool,
        "command": int,
        "doJumpId": int,
        "frame": int,
        "params": list,
        "type": "SimpleItem",
    },
}  # fmt: skip


def hold(found: dict[str, Any], documented: dict[str, Any]) -> None:
    for key, wanted in documented.items():
        assert type(found[key]) is wanted if isinstance(wanted, type) else found[key] == wanted, key


def test_plan_files_are_as_documented() -> None:
    document = json.loads(FILES[".plan"])
    hold(document, DOCUMENTED["file"])
    assert document["geoFence"] == {"circles": [], "polygons": [], "version": 2}
    assert document["rallyPoints"] == {"points": [], "version": 2}
    mission = document["mission"]
    hold(mission, DOCUMENTED["mission"])
    assert mission["plannedHomePosition"] == [60.17, 24.94, 14.25]
    items = mission["items"]
    for number, item in enumerate(items, start=1):
        hold(item, DOCUMENTED["item"])
        assert (item["doJumpId"], len(item["params"])) == (number, 7)
        # "must be double or null", the reader of QGroundControl says
        assert all(value is None or isinstance(value, float) for value in item["params"])
    assert [(item["command"], item["frame"]) for item in items] == [
        (22, 3), (178, 2), (16, 3), (18, 0), (178, 2), (21, 3),
    ]  # fmt: skip
    assert items[0]["params"] == [0.0, 0.0, 0.0, None, 60.17, 24.94, 80.0]
    assert (items[0]["Altitude"], items[0]["AltitudeMode"], items[0]["AMSLAltAboveTerrain"]) == (80.0, 1, None)
    assert items[1]["params"] == [1.0, 12.0, -1.0, 0.0, 0.0, 0.0, 0.0]
    # once around, with a radius of 60 m
    assert items[3]["params"][:3] == [2.0, 0.0, 60.0]
    assert (items[3]["AltitudeMode"], mission["globalPlanAltitudeMode"]) == (2, 0)


# files that others write


def item(command: int, *numbers: float | None, frame: int = 3, **more: object) -> dict[str, Any]:
    parameters = [*numbers, *([None] * (7 - len(numbers)))] if len(numbers) != 3 else [0, 0, 0, None, *numbers]
    return {
        "type": "SimpleItem",
        "command": command,
        "frame": frame,
        "params": parameters,
        "autoContinue": True,
        **more,
    }


def plan_file(*items: object, **more: object) -> bytes:
    mission = {"version": 2, "items": list(items), "plannedHomePosition": [60.0, 24.0, 12.0], "firmwareType": 12}
    return json.dumps({"fileType": "Plan", "version": 1, "mission": mission | more}).encode()


def test_surveys_and_items_that_do_not_fly_give_remarks() -> None:
    transects = {"Items": [item(16, 60.1, 24.1, 50), item(206, 25.0), item(16, 60.2, 24.1, 50)], "version": 1}
    survey = {"type": "ComplexItem", "complexItemType": "survey", "TransectStyleComplexItem": transects}
    plan = plan_of_bytes(plan_file(item(22, None, None, 30), survey, item(203), item(20, frame=2)), "survey.plan")
    assert plan.lonlat.tolist() == [[24.0, 60.0], [24.1, 60.1], [24.1, 60.2], [24.1, 60.2], [24.0, 60.0]]
    assert [one.role for one in plan.waypoints] == ["take-off", "waypoint", "waypoint", "waypoint", "landing"]
    said = "\n".join(plan.remarks)
    for words in (
        "survey",
        "CAM_TRIGG",
        "DIGICAM",
        "60 m above home, PX4's default",
        "item 2.1 and 1 more: it may turn",
    ):
        assert words in said
    assert len(plan.remarks) == 5


def test_circles_speeds_and_curves_are_read() -> None:
    items = [item(17, 0, 0, -80.0, None, 60.1, 24.1, 50.0), item(178, 1, 10, -1, 0, 0, 0, 0, frame=2)]
    plan = plan_of_bytes(plan_file(*reversed(items)), "circle.plan")
    assert (plan.waypoints[0].loiter_radius, plan.waypoints[0].speed) == (80.0, 10.0)
    assert plan_of_bytes(plan_file(item(82, 60.1, 24.1, 50)), "spline.plan").unknown


def test_waypoints_of_mission_planner_are_read() -> None:
    lines = ["QGC WPL 110", "0\t1\t0\t0\t0\t0\t0\t0\t60.0\t24.0\t30.5\t1", "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t50\t1",
             "2\t0\t10\t16\t0\t0\t0\t0\t60.1\t24.1\t50\t1", "3\t0\t3\t21\t0\t0\t0\t0\t0\t0\t0\t1"]  # fmt: skip
    plan = plan_of_bytes("\r\n".join(lines).encode(), "mission.txt")
    assert plan.home is not None
    assert plan.home.altitude == 30.5
    # take-off at home, landing where it is
    assert plan.lonlat.tolist() == [[24.0, 60.0], [24.1, 60.1], [24.1, 60.1]]
    assert [one.reference for one in plan.waypoints] == ["home", "ground", "home"]


def test_kml_gpx_and_geojson_of_others_are_read() -> None:
    kml = (
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document><name>tour</name><Placemark><Point><coordinates>'
        "1,2</coordinates></Point></Placemark><Placemark><MultiGeometry><LineString><altitudeMode>absolute"
        "</altitudeMode><coordinates>\n 24,60,80\n 24.1,60.1,85 </coordinates></LineString></MultiGeometry></Placemark>"
        "</Document></kml>"
    )
    plan = plan_of_bytes(kml.encode(), "tour.kml")
    assert [(one.x, one.altitude, one.reference) for one in plan.waypoints] == [
        (24.0, 80.0, "sea"),
        (24.1, 85.0, "sea"),
    ]
    assert (plan.name, len(plan.remarks)) == ("tour", 1)
    gpx = '<gpx><trk><trkseg><trkpt lat="60" lon="24"/><trkpt lat="61" lon="24"/></trkseg></trk></gpx>'
    assert plan_of_bytes(gpx.encode(), "track.gpx").lonlat.tolist() == [[24.0, 60.0], [24.0, 61.0]]
    line = {"type": "LineString", "coordinates": [[24.0, 60.0, 100.0], [24.1, 60.0, 120.0]]}
    read = plan_of_bytes(json.dumps(line).encode(), "line.geojson")
    assert [(one.altitude, one.reference) for one in read.waypoints] == [(100.0, "ellipsoid"), (120.0, "ellipsoid")]


# refused files


WPL = "QGC WPL 110\n0 1 0 16 0 0 0 0 60 24 12 1\n"
LINE = "<Placemark><LineString><coordinates>1,2 3,4</coordinates></LineString></Placemark>"
REFUSED: dict[str, tuple[bytes, str]] = {
    "unknown command": (plan_file(item(16, 60.1, 24.1, 50), item(31000, 60.1, 24.1, 50)), "item 2: command 31000"),
    "a jump": (plan_file(item(16, 60.1, 24.1, 50), item(177, 1, 2)), "DO_JUMP"),
    "unknown frame": (plan_file(item(16, 60.1, 24.1, 50, frame=99)), "frame is 99"),
    "a frame of no place": (plan_file(item(16, 60.1, 24.1, 50, frame=1)), "frame 1"),
    "a structure scan": (plan_file({"type": "ComplexItem", "complexItemType": "StructureScan"}), "StructureScan"),
    "another version": (json.dumps({"fileType": "Plan", "version": 2, "mission": {}}).encode(), "version"),
    "no mission": (b'{"fileType": "Plan", "version": 1}', "mission"),
    "six parameters": (plan_file({**item(16, 60.1, 24.1, 50), "params": [0] * 6}), "params"),
    "a text for a number": (plan_file(item(16, 60.1, 24.1, "high")), "high"),  # type: ignore[arg-type]
    "NaN": (plan_file(item(16, 60.1, 24.1, math.nan)), "NaN"),
    "huge altitude": (plan_file(item(16, 60.1, 24.1, 1e9)), "altitude"),
    "latitude and longitude swapped": (plan_file(item(16, 124.1, 60.1, 50)), "latitude 124.1"),
    "0, 0": (plan_file(item(16, 0, 0, 50)), "0, 0"),
    "flying after landing": (plan_file(item(21, 60.1, 24.1, 0), item(16, 60.1, 24.1, 50)), "after the landing"),
    "taking off in flight": (plan_file(item(16, 60.1, 24.1, 50), item(22, 60.1, 24.1, 50)), "takes off"),
    "nothing": (plan_file(), "no item"),
    "WPL of another version": (b"QGC WPL 100\n", "QGC WPL 110"),
    "WPL without items": (WPL.encode(), "no item"),
    "WPL with eleven columns": (f"{WPL}1 0 3 16 0 0 0 0 60 24 12\n".encode(), "11 columns"),
    "WPL out of order": (f"{WPL}7 0 3 16 0 0 0 0 60 24 12 1\n".encode(), "index is 7"),
    "WPL with infinity": (f"{WPL}1 0 3 16 0 0 0 0 60 24 inf 1\n".encode(), "inf"),
    "WPL with an unknown command": (f"{WPL}1 0 3 16.5 0 0 0 0 60 24 1 1\n".encode(), "16.5"),
    "two lines": (f"<kml>{LINE}{LINE}</kml>".encode(), "2 lines"),
    "blanks in a position": (
        b"<kml><Placemark><LineString><coordinates>1, 2 3, 4</coordinates></LineString></Placemark></kml>",
        "'1,'",
    ),
    "two routes": (b"<gpx><rte><rtept lat='1' lon='2'/></rte><rte/></gpx>", "2 routes"),
    "no latitude": (b"<gpx><rte><rtept lon='2'/></rte></gpx>", "latitude"),
    "other XML": (b"<html/>", "<html>"),
    "an entity": (b"<!DOCTYPE gpx [<!ENTITY a 'b'>]><gpx/>", "entities"),
    "other JSON": (b'{"a": 1}', "keys"),
    "a list": (b"[1, 2]", "no JSON object"),
    "GeoJSON of areas": (b'{"type": "FeatureCollection", "features": []}', "no waypoint"),
    "other CSV": (b"a,b\n1,2\n", "names the columns"),
    "a gap in a CSV": (b"longitude,latitude\n24,\n", "line 2"),
    "nothing at all": (b"", "it is empty"),
    "a landing in the middle": (b"lon,lat,role\n1,2,landing\n1,3,\n", "only the last"),
    "a word that is no role": (b"lon,lat,role\n1,2,dance\n", "dance"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_unsupported_content_is_refused_in_one_line(case: str) -> None:
    data, words = REFUSED[case]
    with pytest.raises(PlanError if case not in {"NaN", "an entity"} else cg.CglaError) as refused:
        plan_of_bytes(data, "theirs.plan")
    said = str(refused.value)
    assert said.startswith("theirs.plan")
    assert words in said
    assert "\n" not in said
    assert len(said) < 400


def test_line_and_points_of_one_file_agree() -> None:
    """A line that was moved in a viewer without its points is refused."""
    text = FILES[".kml"].replace(b"24.96,60.18", b"24.97,60.18", 1)
    with pytest.raises(PlanError, match="different routes"):
        plan_of_bytes(text, "moved.kml")


def test_a_line_that_is_flown_is_not_below_the_ground() -> None:
    """Altitudes of a line are left out only where points with roles are the plan; they have to be numbers still."""
    text = text_of_plan(LOW_ENDS[0], "low.kml").encode()
    for wrong, words in ((text.replace(b"role", b"colour"), "below the ground"), (text.replace(b",-1", b",x"), "'x'")):
        with pytest.raises(PlanError, match=words):
            plan_of_bytes(wrong, "low.kml")


@few
@given(flight_plans(autopilot=False))
def test_plans_that_an_autopilot_cannot_fly_are_refused(plan: FlightPlan) -> None:
    assume(any(one.altitude is None or one.reference == "ellipsoid" for one in plan.waypoints))
    for kind in (".plan", ".waypoints"):
        with pytest.raises(PlanError, match=r"waypoint \d+: its? "):
            text_of_plan(plan, f"plan{kind}")

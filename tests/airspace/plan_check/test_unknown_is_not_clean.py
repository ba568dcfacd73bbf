"""A plan is clean only if its file says everywhere where the aircraft flies."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

import cgla_graph as cg
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea
from cgla_graph.airspace.flight_plans.crossings import crossings_of
from cgla_graph.airspace.flight_plans.formats import WRITTEN, plan_of_bytes, read_plan, text_of_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Waypoint
from cgla_graph.airspace.plan_check.check import check
from cgla_graph.airspace.plan_check.result import PlanCheck
from cgla_graph.errors import CglaError, PlanError
from cgla_graph.model.earth import LocalProjection

#: The middle of the map; places are metres to the east and to the north of it.
HERE = LocalProjection(24.0, 60.0)


def at(east: float, north: float) -> list[float]:
    """Return latitude and longitude."""
    longitude, latitude = HERE.inverse((east, north)).tolist()
    return [latitude, longitude]


def item(command: int, place: tuple[float, float] | None, height: float | None, *first: float | None) -> dict[str, Any]:
    numbers = [*first, *[0.0] * (4 - len(first)), *([0.0, 0.0] if place is None else at(*place)), height]
    return {"type": "SimpleItem", "command": command, "frame": 3, "params": numbers, "autoContinue": True}


def plan_file(*items: object, home: object = None, **more: object) -> bytes:
    """Return a plan from home 1000 m west of the middle."""
    mission = {"version": 2, "items": list(items), "plannedHomePosition": home or [*at(-1000, 0), 12.0]}
    mission |= {key: more.pop(key) for key in ("firmwareType", "vehicleType") if key in more}
    return json.dumps({"fileType": "Plan", "version": 1, "mission": mission, **more}).encode()


def volume(box: tuple[float, float, float, float], low: float = 0.0, high: float | None = None) -> dict[str, Any]:
    west, south, east, north = box
    corners = [(west, south), (east, south), (east, north), (west, north), (west, south)]
    ring = [at(*corner)[::-1] for corner in corners]
    limits = {"lowerLimit": low, "lowerVerticalReference": "AGL", "upperVerticalReference": "AGL", "uomDimensions": "M"}
    limits |= {} if high is None else {"upperLimit": high}
    return {**limits, "horizontalProjection": {"type": "Polygon", "coordinates": [ring]}}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path


def checked(folder: Path, data: bytes, *volumes: dict[str, Any], **settings: Any) -> PlanCheck:  # noqa: ANN401 - of check
    feature = {
        "identifier": "Z", "name": "Z", "country": "FIN", "type": "COMMON", "restriction": "PROHIBITED",
        "applicability": [{"permanent": "YES"}], "zoneAuthority": [], "geometry": list(volumes),
    }  # fmt: skip
    (folder / "zones.json").write_text(json.dumps({"features": [feature] if volumes else []}), encoding="utf-8")
    (folder / "a.plan").write_bytes(data)
    return check(folder / "a.plan", zones=folder / "zones.json", tolerance=None, **settings)


def flat(folder: Path) -> Path:
    """Write elevations of 12 m everywhere."""
    file = folder / "ground.asc"
    rows = "12 12 12 12 12 12 12 12 12\n" * 9
    file.write_text(f"ncols 9\nnrows 9\nxllcorner 23\nyllcorner 59\ncellsize 0.25\n{rows}")
    return file


FAR = volume((5000, 5000, 6000, 6000))


def north(first: float) -> dict[str, Any]:
    """Return a wall so many metres north of the way."""
    return volume((-3000, first, 3000, first + 500))


WEST, EAST = item(16, (-1000, 0), 50), item(16, (1000, 0), 50)


# circles


@pytest.mark.parametrize("command", [17, 18, 19, 31])
@pytest.mark.parametrize("radius", [0.0, None])
def test_a_circle_without_a_radius_is_not_clean(folder: Path, command: int, radius: float | None) -> None:
    place = 1 if command == 31 else 2
    circle = item(command, (0, 0), 50, *(radius if index == place else 1.0 for index in range(4)))
    data = plan_file(WEST, circle)
    found = checked(folder, data, FAR)
    assert not found.is_clean
    assert "--loiter-radius" in found.verdict[0]
    assert found.document()["unknown"]
    for given_radius, clean in ((0.0, True), (80.0, True), (120.0, False)):
        known = checked(folder, data, north(100.0), loiter_radius=given_radius)
        assert known.is_clean is clean


def test_circles_are_left_along_tangents_and_keep_the_clearance(folder: Path) -> None:
    """The zone is beyond the circle, but beside the leg that leaves it."""
    data = plan_file(WEST, item(18, (0, 0), 50, 1, 0, 200), item(16, (4000, 0), 50))
    beside = volume((600, 120, 700, 180))
    found = checked(folder, data, beside)
    assert found.verdict == ["not clean: 1 leg may reach into an area beside the straight line"]
    assert [(one.leg, one.is_beside) for one in found.crossings.found] == [(1, True)]
    # 50 m off the circle
    assert checked(folder, data, north(250.0)).is_clean
    near = checked(folder, data, north(250.0), clearance=60.0)
    assert not near.is_clean
    assert near.clearance == pytest.approx(50.0, abs=2.0)
    assert checked(folder, data, north(250.0), clearance=40.0).is_clean


def test_a_plan_of_one_place_may_be_a_circle(folder: Path) -> None:
    data = plan_file(item(18, (0, 0), 50, 1, 0, 200), home=[*at(0, 0), 12.0])
    assert not checked(folder, data, north(100.0)).is_clean
    found = checked(folder, data, north(300.0))
    assert found.is_clean
    assert found.clearance == pytest.approx(100.0, abs=2.0)


# waypoints that are passed at a distance


@pytest.mark.parametrize("parameter", [1, 2])
@pytest.mark.parametrize("radius", [200.0, -200.0])
def test_a_waypoint_passed_at_a_distance_reaches_as_far(folder: Path, parameter: int, radius: float) -> None:
    passed = item(16, (0, 0), 50, *(radius if index == parameter else 0.0 for index in range(4)))
    data = plan_file(WEST, passed, EAST)
    assert read_plan_of(data).waypoints[1].pass_radius == 200.0
    assert not checked(folder, data, north(100.0)).is_clean
    assert checked(folder, data, north(210.0)).is_clean
    assert not checked(folder, data, north(210.0), clearance=20.0).is_clean
    # the corner is cut: an area on the inner side, nearer than the distance
    corner = plan_file(WEST, passed, item(16, (0, -1000), 50))
    assert not checked(folder, corner, volume((-60, -60, -40, -40))).is_clean
    assert checked(folder, corner, volume((-400, -400, -300, -300))).is_clean


def test_heights_near_a_passed_waypoint_are_those_of_its_neighbours(folder: Path) -> None:
    passed = item(16, (0, 0), 50, 0, 0, 200)
    high = volume((-100, 50, 100, 150), 80.0, 120.0)
    level, climb = (plan_file(WEST, passed, item(16, (1000, 0), height)) for height in (50, 150))
    ground = flat(folder)
    assert checked(folder, level, high, ground=ground).is_clean
    assert not checked(folder, climb, high, ground=ground).is_clean


@few
@given(st.integers(0, 2**31))
def test_what_is_flown_within_the_distance_is_in_the_hull(seed: int) -> None:
    """Fly from anywhere near a waypoint to anywhere near the next: what is met is reported, and no more than nearby."""
    rng = np.random.default_rng(seed)
    route = np.cumsum(rng.uniform(-1000.0, 1000.0, (4, 2)), axis=0)
    reaches = (rng.uniform(0.0, 300.0, 4) * rng.integers(0, 2, 4)).tolist()
    low = rng.uniform(-1500.0, 1500.0, (5, 2))
    areas = [ClosedArea(str(n), shapely.box(x, y, x + 300.0, y + 300.0)) for n, (x, y) in enumerate(low.tolist())]
    found = crossings_of(route, areas, reaches=reaches)
    reported = {(one.leg, one.area) for one in found.found}
    for leg in range(3):
        for _ in range(20):
            angles, shares = rng.uniform(0.0, 2.0 * math.pi, 2), np.sqrt(rng.uniform(0.0, 1.0, 2))
            ends = [
                route[leg + n] + reaches[leg + n] * shares[n] * np.array([math.cos(angles[n]), math.sin(angles[n])])
                for n in (0, 1)
            ]
            line = shapely.LineString(ends)
            for number, area in enumerate(areas):
                if shapely.intersection(line, area.shape).length > 1e-6:
                    assert (leg, number) in reported
                assert found.clearances[leg] <= shapely.distance(line, area.shape) + 1e-6
    straight = [shapely.LineString(route[leg : leg + 2]) for leg in range(3)]
    for leg, number in reported:
        assert shapely.distance(straight[leg], areas[number].shape) <= max(reaches[leg : leg + 2]) * 1.001


# the return to home


def test_a_return_climbs_first(folder: Path) -> None:
    """Above the last waypoint, 50 m above home, there is a layer from 55 to 70 m above the ground."""
    layer = volume((900, -100, 1100, 100), 55.0, 70.0)
    ground = flat(folder)
    data = plan_file(WEST, EAST, item(20, None, 0.0))
    found = checked(folder, data, layer, ground=ground)
    assert not found.is_clean
    assert any("60 m above home" in remark and "RTL_RETURN_ALT" in remark for remark in found.plan.remarks)
    assert checked(folder, data, layer, ground=ground, return_altitude=52).is_clean
    assert not checked(folder, data, layer, ground=ground, return_altitude=100).is_clean
    # zones at one height say nothing of a climb above it
    assert "goes up to 60 m" in checked(folder, data, FAR, altitude=50).verdict[0]
    assert checked(folder, data, FAR, altitude=60).is_clean


def test_returns_to_places_that_are_not_known_are_not_clean(folder: Path) -> None:
    back = item(20, None, 0.0)
    rally = {"rallyPoints": {"version": 2, "points": [[*at(500, 500), 30]]}}
    for data, said in (
        (plan_file(WEST, back, **rally), "rally points"),
        (plan_file(WEST, item(189, None, 0.0), back), "DO_LAND_START"),
        (plan_file(WEST, back, vehicleType=1), "circles"),
        (plan_file(WEST, back, vehicleType=22, firmwareType=12), "circles"),
        (plan_file(WEST, back, home=[0, 0, 0]), "returns home"),
        (plan_file(item(22, None, 30.0), WEST, vehicleType=1), "vertically"),
        (plan_file(item(84, (0, 0), 30.0, 0, 3), WEST), "transition"),
        (plan_file(WEST, item(82, (0, 0), 50)), "spline"),
    ):
        found = checked(folder, data, FAR)
        assert not found.is_clean
        assert said in "; ".join(found.verdict)
    plane = plan_file(WEST, back, vehicleType=1, firmwareType=3)
    known = checked(folder, plane, FAR, loiter_radius=60)
    assert known.is_clean
    assert [(one.altitude, one.loiter_radius) for one in known.plan.waypoints] == [
        (50.0, 0.0), (100.0, 0.0), (100.0, 60.0), (0.0, 0.0),
    ]  # fmt: skip
    assert checked(folder, plan_file(WEST, back), FAR).is_clean


# home


@pytest.mark.parametrize("home", [[0, 0, 0], [0.0, 0.0, 30.5], [0, 0]])
def test_a_home_that_is_not_set_is_not_on_the_equator(folder: Path, home: list[float]) -> None:
    data = plan_file(WEST, EAST, home=home)
    found = checked(folder, data, FAR)
    assert found.length == pytest.approx(2000.0, rel=1e-4)
    assert not found.is_clean
    assert "--home LON,LAT" in found.verdict[0]
    latitude, longitude = at(-1000, -500)
    known = checked(folder, data, FAR, home=(longitude, latitude))
    assert known.is_clean
    assert known.length == pytest.approx(2500.0, rel=1e-4)
    lines = ["QGC WPL 110", "0 1 0 16 0 0 0 0 0 0 0 1", "1 0 3 16 0 0 0 0 60.1 24.1 50 1"]
    assert "home is not set" in plan_of_bytes("\n".join(lines).encode(), "a.waypoints").unknown[0]
    with pytest.raises(CglaError, match="read_plan"):
        check([(24.0, 60.0), (24.1, 60.0)], zones=folder / "zones.json", home=(24.0, 60.0))
    for wrong in ((24.0,), (24.0, 95.0), ("a", 1.0), (math.nan, 1.0)):
        with pytest.raises(PlanError, match=r"home|latitude"):
            read_plan(folder / "a.plan", home=wrong)  # type: ignore[arg-type]


# a payload's place


def test_a_payload_is_placed_on_the_ground(folder: Path) -> None:
    low = volume((-100, -100, 100, 100), 0.0, 20.0)
    ground = flat(folder)
    for command, clean in ((16, True), (94, False)):
        # (home is on the ground, so that its leg is not over the zone)
        data = plan_file(WEST, item(command, (0, 0), 50), EAST)
        assert checked(folder, data, low, ground=ground).is_clean is clean
    plan = read_plan_of(data)
    assert [one.role for one in plan.waypoints] == ["waypoint", "touch-down", "waypoint"]
    for kind in WRITTEN:
        assert plan_of_bytes(text_of_plan(plan, f"a{kind}").encode(), "again").waypoints == plan.waypoints


# conversions


def read_plan_of(data: bytes) -> FlightPlan:
    return plan_of_bytes(data, "a.plan")


@pytest.mark.parametrize("kind", WRITTEN)
def test_another_file_does_not_make_a_plan_known(kind: str) -> None:
    for plan in (read_plan_of(plan_file(WEST, item(82, (0, 0), 50))), read_plan_of(plan_file(WEST, home=[0, 0, 0]))):
        with pytest.raises(PlanError, match="does not say everywhere"):
            text_of_plan(plan, f"a{kind}")
    passed = FlightPlan(
        (Waypoint(24.0, 60.0, 50.0), Waypoint(24.1, 60.0, 50.0, pass_radius=40.0)), Home(24.0, 60.0, 12.0)
    )
    assert plan_of_bytes(text_of_plan(passed, f"a{kind}").encode(), "again").waypoints == passed.waypoints


LITCHI = (
    "latitude,longitude,altitude(m),heading(deg),curvesize(m),rotationdir,gimbalmode,gimbalpitchangle,actiontype1,"
    "actionparam1,altitudemode,speed(m/s),poi_latitude,poi_longitude,poi_altitude(m),poi_altitudemode\n"
)


def litchi(*rows: tuple[tuple[float, float], float, float, int, float]) -> bytes:
    lines = (
        f"{at(*place)[0]},{at(*place)[1]},{height},90,{curve},0,0,0,-1,0,{mode},{speed},0,0,0,0"
        for place, height, curve, mode, speed in rows
    )
    return (LITCHI + "\n".join(lines)).encode()


def test_missions_of_litchi_are_read_with_their_heights_and_turns(folder: Path) -> None:
    rows = ((-1000, 0), 40, 0, 1, 0), ((0, 0), 50, 100, 1, 7.5), ((0, -1000), 60, 0, 0, 7.5)
    plan = plan_of_bytes(litchi(*rows), "litchi.csv")
    assert [(one.altitude, one.reference, one.speed) for one in plan.waypoints] == [
        (40.0, "ground", None), (50.0, "ground", 7.5), (60.0, "home", 7.5),
    ]  # fmt: skip
    # a turn by a right angle begins at its size, or at its radius, before the waypoint
    assert [round(one.pass_radius) for one in plan.waypoints] == [0, 100, 0]
    assert not checked(folder, litchi(*rows), volume((-40, -40, -20, -20))).is_clean
    straight = [(place, height, 0.0, mode, speed) for place, height, _, mode, speed in rows]
    assert checked(folder, litchi(*straight), volume((-40, -40, -20, -20))).is_clean
    back = rows[0], rows[1], ((-1000, 100), 60, 0, 0, 7.5)
    assert plan_of_bytes(litchi(*back), "litchi.csv").waypoints[1].pass_radius > 1000.0


@pytest.mark.parametrize(
    ("heads", "row", "altitude", "speed"),
    [
        ("altitude(ft),speed(mph)", "100,10", 30.48, 4.4704),
        ("altitude [m],speed [km/h]", "100,36", 100.0, 10.0),
        ("alt_ft,speed_kn", "1000,100", 304.8, 51.4444),
        ("Altitude (feet),Speed (knots)", "1000,100", 304.8, 51.4444),
        ("alt,speed", "80,12", 80.0, 12.0),
    ],
)
def test_units_of_columns_are_converted(heads: str, row: str, altitude: float, speed: float) -> None:
    (one,) = plan_of_bytes(f"longitude,latitude,{heads}\n24,60,{row}\n".encode(), "a.csv").waypoints
    assert (one.altitude, one.speed) == (pytest.approx(altitude), pytest.approx(speed, rel=1e-5))


def test_columns_that_leave_the_flight_open_are_not_clean() -> None:
    head = "longitude,latitude"
    for name, value, known in (("cornerradius", "5", False), ("turnmode", "coordinated", False), ("curve", "0", True)):
        plan = plan_of_bytes(f"{head},{name}\n24,60,{value}\n24.1,60,{value}\n".encode(), "a.csv")
        assert (plan.unknown == ()) is known
    with pytest.raises(PlanError, match="unit"):
        plan_of_bytes(f"{head},altitude(fathoms)\n24,60,5\n".encode(), "a.csv")
    with pytest.raises(PlanError, match="altitudemode"):
        plan_of_bytes(f"{head},altitudemode\n24,60,7\n".encode(), "a.csv")


def test_files_of_viewers_that_leave_the_flight_open_are_refused_or_not_clean() -> None:
    line = "<LineString>{}<coordinates>24,60,80 24.1,60,80</coordinates></LineString>"
    kml = "<kml xmlns:gx='urn:gx' xmlns:wpml='http://www.dji.com/wpmz/1.0.2'><Document>{}<Placemark>{}</Placemark></Document></kml>"
    dji = kml.format("<wpml:author>x</wpml:author>", line.format(""))
    assert "DJI" in plan_of_bytes(dji.encode(), "a.kml").unknown[0]
    assert not plan_of_bytes(kml.format("", line.format("")).encode(), "a.kml").unknown
    with pytest.raises(PlanError, match="altitudeOffset"):
        plan_of_bytes(kml.format("", line.format("<gx:altitudeOffset>40</gx:altitudeOffset>")).encode(), "a.kml")


def test_paths_of_problems_are_not_read_from_plans_that_are_not_straight(folder: Path) -> None:
    projection = LocalProjection(24.0, 60.0)
    problem = cg.Problem((-1000, 0), (0, 0), bounds=(-2000, -2000, 2000, 2000), projection=projection)
    for last in (item(82, (0, 0), 50), item(18, (0, 0), 50, 1, 0, 200), item(16, (0, 0), 50, 0, 200)):
        (folder / "a.plan").write_bytes(plan_file(WEST, last))
        with pytest.raises(CglaError, match="not flown straight"):
            cg.read_path(folder / "a.plan", problem)
    rows = ((-1000, 0), 40, 0, 1, 0), ((-500, 500), 50, 30, 1, 7.5), ((0, 0), 60, 0, 0, 7.5)
    (folder / "a.csv").write_bytes(litchi(*rows))
    with pytest.raises(CglaError, match="not flown straight"):
        cg.read_path(folder / "a.csv", problem)
    (folder / "a.csv").write_bytes(litchi(rows[0], ((-500, 500), 50, 0, 1, 7.5), rows[2]))
    assert len(cg.read_path(folder / "a.csv", problem)) == 3


# landing patterns


def pattern(kind: str = "fwLandingPattern", **more: object) -> dict[str, Any]:
    return {
        "type": "ComplexItem", "complexItemType": kind, "version": 2, "altitudesAreRelative": True,
        "landingApproachCoordinate": [*at(1000, 0), 40.0], "landCoordinate": [*at(0, 0), 0.0],
        "loiterRadius": 75.0, "loiterClockwise": True, "useLoiterToAlt": True, **more,
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["fwLandingPattern", "vtolLandingPattern"])
def test_landing_patterns_are_read_and_checked(folder: Path, kind: str) -> None:
    data = plan_file(WEST, pattern(kind))
    plan = read_plan_of(data)
    assert [(one.role, one.altitude, one.loiter_radius) for one in plan.waypoints] == [
        ("waypoint", 50.0, 0.0), ("waypoint", 40.0, 75.0), ("landing", 0.0, 0.0),
    ]  # fmt: skip
    assert checked(folder, data, north(80.0)).is_clean
    assert not checked(folder, data, volume((900, 60, 1100, 90))).is_clean
    # the glide to the ground
    ground = flat(folder)
    assert not checked(folder, data, volume((400, -10, 500, 10), 0.0, 30.0), ground=ground).is_clean
    # no circle; one whose radius is not known; heights above the sea; files of version 1
    through = read_plan_of(plan_file(WEST, pattern(kind, useLoiterToAlt=False)))
    assert through.waypoints[1].loiter_radius == 0.0
    assert not checked(folder, plan_file(WEST, pattern(kind, loiterRadius=0)), FAR).is_clean
    assert read_plan_of(plan_file(WEST, pattern(kind, altitudesAreRelative=False))).waypoints[1].reference == "sea"
    old = pattern(kind, version=1, loiterAltitudeRelative=True, landAltitudeRelative=True)
    old["loiterCoordinate"] = old.pop("landingApproachCoordinate")
    del old["altitudesAreRelative"], old["useLoiterToAlt"]
    assert read_plan_of(plan_file(WEST, old)).waypoints == plan.waypoints
    for key in ("landCoordinate", "loiterRadius", "altitudesAreRelative", "landingApproachCoordinate"):
        wrong = pattern(kind)
        del wrong[key]
        with pytest.raises(PlanError, match=key):
            read_plan_of(plan_file(WEST, wrong))


# the plan's own fence


def fenced(*shapes: dict[str, Any], **more: object) -> bytes:
    fence: dict[str, Any] = {"version": 2, "polygons": [], "circles": []}
    for shape in shapes:
        fence["circles" if "circle" in shape else "polygons"].append(shape)
    return plan_file(WEST, EAST, geoFence=fence, **more)


def box(west: float, south: float, east: float, north_: float, *, inclusion: bool) -> dict[str, Any]:
    corners = [(west, south), (east, south), (east, north_), (west, north_)]
    return {"inclusion": inclusion, "polygon": [at(*corner) for corner in corners], "version": 1}


def disc(x: float, y: float, radius: float, *, inclusion: bool) -> dict[str, Any]:
    return {"inclusion": inclusion, "circle": {"center": at(x, y), "radius": radius}, "version": 1}


@pytest.mark.parametrize(
    ("shapes", "clean"),
    [
        ([box(-1100, -100, 1100, 100, inclusion=True)], True),
        ([box(-1100, -100, 900, 100, inclusion=True)], False),
        ([box(-100, -100, 100, 100, inclusion=False)], False),
        ([box(-100, 50, 100, 100, inclusion=False)], True),
        ([disc(0, 0, 1100, inclusion=True)], True),
        ([disc(0, 0, 999, inclusion=True)], False),
        ([disc(0, 100, 99, inclusion=False)], True),
        ([disc(0, 100, 101, inclusion=False)], False),
        ([box(-1100, -100, 1100, 100, inclusion=True), disc(0, 0, 10, inclusion=False)], False),
    ],
)
def test_the_fence_of_a_plan_is_checked(folder: Path, shapes: list[dict[str, Any]], clean: bool) -> None:
    data = fenced(*shapes)
    found = checked(folder, data, FAR)
    assert found.is_clean is clean
    assert all("fence" in found.on.areas[one.area].name for one in found.crossings.found)
    # without zones
    assert check(folder / "a.plan", tolerance=None).is_clean is clean
    plan = read_plan_of(data)
    assert plan_of_bytes(text_of_plan(plan, "again.plan").encode(), "again.plan").fence == plan.fence


def test_a_fence_is_not_lost_in_another_file() -> None:
    plan = read_plan_of(fenced(disc(0, 0, 1100, inclusion=True)))
    for kind in set(WRITTEN) - {".plan"}:
        with pytest.raises(PlanError, match="fence"):
            text_of_plan(plan, f"a{kind}")


def test_inclusions_are_rules_of_the_autopilot(folder: Path) -> None:
    """PX4 asks for one of the inclusions, others for each."""
    halves = box(-1100, -100, 100, 100, inclusion=True), box(-100, -100, 1100, 100, inclusion=True)
    assert checked(folder, fenced(*halves, firmwareType=12), FAR).is_clean
    assert not checked(folder, fenced(*halves, firmwareType=3), FAR).is_clean
    assert not checked(folder, fenced(*halves), FAR).is_clean


@pytest.mark.parametrize(
    "fence",
    [
        {"version": 2, "polygons": [{"polygon": []}]},
        {"version": 2, "polygons": [{"polygon": [[60, 24], [60, 25]], "inclusion": True}]},
        {"version": 2, "circles": [{"circle": {"center": [60, 24], "radius": 0}, "inclusion": True}]},
        {"version": 2, "circles": [{"circle": {"center": [60], "radius": 5}, "inclusion": True}]},
        {"version": 1, "polygons": [{"polygon": [[60, 24], [60, 25], [61, 25]], "inclusion": True}]},
        {"version": 1, "polygon": [[60, 24], [60, 25], [61, 25]]},
        {"version": 2, "polygons": 3},
    ],
)
def test_fences_that_are_not_understood_are_refused(fence: dict[str, Any]) -> None:
    with pytest.raises(PlanError, match="geoFence"):
        read_plan_of(plan_file(WEST, EAST, geoFence=fence))


def test_a_fence_that_crosses_itself_is_refused(folder: Path) -> None:
    bow = {"inclusion": True, "polygon": [at(-500, -500), at(500, 500), at(500, -500), at(-500, 500)], "version": 1}
    with pytest.raises(PlanError, match="cross itself"):
        checked(folder, fenced(bow), FAR)


# start equal to goal


@pytest.mark.parametrize(
    "places", [[(24.0, 60.0)], [(24.0, 60.0), (24.0, 60.0)], [(24.0, 60.0), (24.1, 60.0), (24.0, 60.0)]]
)
def test_every_plan_lands(places: list[tuple[float, float]]) -> None:
    plan = FlightPlan.along(places, altitude=80)
    assert (plan.waypoints[0].role, plan.waypoints[-1].role) == ("take-off", "landing")
    assert plan_of_bytes(text_of_plan(plan, "a.plan").encode(), "a.plan").waypoints == plan.waypoints

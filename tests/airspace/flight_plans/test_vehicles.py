"""Plans for kinds of aircraft: numbers of vehicle and autopilot, take-offs, and landings."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Call, caller

import cgla_graph as cg
from cgla_graph.airspace.flight_plans.formats import plan_of_bytes, text_of_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.airspace.flight_plans.vehicles import AUTOPILOTS, MAV_TYPE, SLOPE, VEHICLES, for_vehicle
from cgla_graph.errors import PlanError
from cgla_graph.model.earth import geodesic_length

#: Legs of 5.6, 11.1 and 5.6 km.
PLACES = [(24.0, 60.0), (24.1, 60.0), (24.1, 60.1), (24.2, 60.1)]


def document(plan: FlightPlan) -> dict[str, Any]:
    """Return the mission of the file that QGroundControl reads."""
    mission: dict[str, Any] = json.loads(text_of_plan(plan, "a.plan"))["mission"]
    return mission


@pytest.mark.parametrize(
    ("vehicle", "number", "commands"),
    [
        ("multirotor", 2, [22, 16, 16, 16, 21]),
        ("helicopter", 4, [22, 16, 16, 16, 21]),
        ("vtol", 22, [84, 16, 16, 16, 85]),
        ("fixed-wing", 1, [22, 16, 16, 189, 16, 21]),
    ],
)
def test_the_file_says_what_was_planned(vehicle: Any, number: int, commands: list[int]) -> None:  # noqa: ANN401 - a word
    plan = FlightPlan.along(PLACES, altitude=80)
    for autopilot, firmware in zip(AUTOPILOTS, (0, 3, 12), strict=True):
        mission = document(for_vehicle(plan, vehicle, autopilot))
        assert (mission["vehicleType"], mission["firmwareType"]) == (number, firmware)
        assert [item["command"] for item in mission["items"]] == commands
        read = plan_of_bytes(text_of_plan(for_vehicle(plan, vehicle, autopilot), "a.plan").encode(), "a.plan")
        assert (read.vehicle, read.autopilot) == (number, firmware)
        # a plan that was read keeps its aircraft (turns of a fixed wing are not known)
        assert document(replace(read, unknown=())) == mission
        assert read.waypoints == for_vehicle(plan, vehicle).waypoints
    assert document(plan)["vehicleType"] == 2
    assert document(for_vehicle(plan, "vtol"))["items"][0]["params"][1] == 1.0


@pytest.mark.parametrize("altitude", [10, 40, 80, 500])
def test_a_fixed_wing_climbs_and_descends_along_its_legs(altitude: float) -> None:
    plan = for_vehicle(FlightPlan.along(PLACES, altitude=altitude), "fixed-wing")
    assert [one.role for one in plan.waypoints] == ["take-off", *["waypoint"] * 3, "landing"]
    for near, far in ((plan.waypoints[0], PLACES[0]), (plan.waypoints[-2], PLACES[-1])):
        length = geodesic_length((near.x, near.y), far)
        assert near.altitude == pytest.approx(SLOPE * length, rel=1e-6)
    assert plan.points[1:3].tolist() == [list(one) for one in PLACES[1:3]]
    # they are on the legs
    assert plan.waypoints[0].y == pytest.approx(60.0, abs=1e-5)
    assert plan.waypoints[-2].y == pytest.approx(60.1, abs=1e-5)


@pytest.mark.parametrize(
    ("metres", "altitude", "slopes"),
    [(700, 80, False), (1210, 80, True), (599, 40, False), (601, 40, True), (150, 10, True), (149, 10, False)],
)
def test_a_single_leg_is_long_enough_or_there_is_no_take_off(metres: float, altitude: float, slopes: bool) -> None:
    goal = (24.0, 60.0 + metres / 111_412.0)
    plan = for_vehicle(FlightPlan.along([(24.0, 60.0), goal], altitude=altitude), "fixed-wing")
    if slopes:
        assert [one.role for one in plan.waypoints] == ["take-off", "waypoint", "landing"]
        assert plan.remarks == ()
        return
    assert [(one.role, one.altitude) for one in plan.waypoints] == [("waypoint", altitude)] * 2
    (remark,) = plan.remarks
    assert "without take-off and landing" in remark
    assert f"a fixed wing needs {round(2 * altitude / SLOPE)} m to climb to {altitude} m" in remark
    assert [item["command"] for item in document(plan)["items"]] == [16, 16]


def test_short_legs_low_over_the_ground_are_straight() -> None:
    """Below 40 m it does not turn; above, it may go on climbing beyond the first leg."""
    for first, last, slopes in ((310, 310, True), (290, 900, False), (900, 290, False)):
        north = np.cumsum([0.0, first, 3000.0, last]) / 111_412.0
        places = [(24.0 + 0.02 * (number // 2), 60.0 + y) for number, y in enumerate(north)]
        places[2] = (places[1][0], places[2][1])
        places[3] = (places[2][0], places[3][1])
        plan = for_vehicle(FlightPlan.along(places, altitude=80), "fixed-wing")
        assert (plan.waypoints[-1].role == "landing") is slopes
        if slopes:
            assert [one.altitude for one in plan.waypoints][:1] == [pytest.approx(310 * SLOPE, rel=1e-3)]
            assert len(plan.waypoints) == 3


def test_other_plans_of_a_fixed_wing() -> None:
    high = for_vehicle(FlightPlan.along(PLACES, altitude=300, reference="sea"), "fixed-wing")
    assert "above the sea" in high.remarks[0]
    none = for_vehicle(FlightPlan.along(PLACES[:1], altitude=30), "fixed-wing")
    assert [one.role for one in none.waypoints] == ["waypoint"]
    still = FlightPlan.along(PLACES)
    assert for_vehicle(still, "fixed-wing").waypoints == still.waypoints
    for word in ("plane", 1, None):
        with pytest.raises(PlanError, match="vehicle: it is"):
            for_vehicle(still, word)  # type: ignore[arg-type]
    with pytest.raises(PlanError, match="autopilot: it is"):
        for_vehicle(still, "vtol", "inav")  # type: ignore[arg-type]
    assert set(MAV_TYPE) == set(VEHICLES)


def test_a_plan_of_ours_for_a_fixed_wing_is_checked(tmp_path: Path) -> None:
    """Its corners are arcs, of which the file says nothing."""
    ring = [[23.0, 59.0], [23.1, 59.0], [23.1, 59.1], [23.0, 59.0]]
    (tmp_path / "far.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    for vehicle in ("fixed-wing", "vtol"):
        cg.write_plan(for_vehicle(FlightPlan.along(PLACES, altitude=80), vehicle), tmp_path / "a.plan")
        about = {"zones": tmp_path / "far.geojson", "tolerance": None}
        assert "turns there on an arc" in cg.check(tmp_path / "a.plan", **about).verdict[0]
        assert cg.check(tmp_path / "a.plan", acceptance_radius=90, **about).is_clean


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """Call the command line in a folder with an area."""
    ring = [[24.8, 60.1], [25.1, 60.1], [25.1, 60.2], [24.8, 60.2], [24.8, 60.1]]
    (tmp_path / "areas.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    return caller(tmp_path, monkeypatch, capfd)


@pytest.mark.slow
def test_options_of_the_aircraft(call: Call, tmp_path: Path) -> None:
    quick = ("plan", "areas.geojson", "--start", "24.7,60.12", "--goal", "25.2,60.15", "--no-certificate")
    quick = (*quick, "--solver", "visibility-graph", "--export", "a.plan", "--altitude", 80)
    turns = ("--turn-radius", 300, "--clearance", 50)
    for words, numbers, said in (
        ((), (2, 0), ""),
        (("--vehicle", "vtol", "--autopilot", "px4"), (22, 12), ""),
        (("--vehicle", "Fixed-Wing", "--autopilot", "ArduPilot"), (1, 3), ""),
        (turns, (1, 0), ""),
        ((*turns, "--vehicle", "multirotor"), (2, 0), ""),
        ((*turns, "--start-heading", 0), (1, 0), "without take-off and landing"),
        (("--vehicle", "fixed-wing", "--above", "sea"), (1, 0), "above the sea"),
    ):
        answer = call(*quick, *words)
        assert answer.code == 0, answer.err
        assert said in answer.err
        mission = json.loads((tmp_path / "a.plan").read_text())["mission"]
        assert (mission["vehicleType"], mission["firmwareType"]) == numbers
        assert ([item["command"] for item in mission["items"]][-1] == 16) is bool(said)
    call(*quick, "--vehicle", "glider").refused("--vehicle is 'glider'", "multirotor, helicopter, fixed-wing, vtol")
    call(*quick, "--autopilot", "inav").refused("--autopilot is 'inav'", "any, ardupilot, px4")
    call("plan", "areas.geojson", "--vehicle", "vtol").refused("--vehicle needs a plan to write")

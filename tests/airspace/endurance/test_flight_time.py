"""Time and energy of flights, against sums made by hand and the wind triangle."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from plan_files import flight_plans
from strategies import usual

import cgla_graph as cg
from cgla_graph.airspace.endurance.aircraft import Aircraft
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Waypoint
from cgla_graph.errors import CglaError
from cgla_graph.model.earth import geodesic_length
from cgla_graph.turning.timing import ground_speeds

angles, winds = st.floats(-3.2, 3.2), st.floats(0.0, 30.0)
HOME = Home(24.0, 60.0, 12.0)
#: A flight of which all is known.
KNOWN = FlightPlan(
    (
        Waypoint(24.0, 60.0, 80.0, role="take-off"),
        Waypoint(24.0, 60.05, 80.0, stay=30.0),
        Waypoint(24.1, 60.05, 122.0, "sea", 9.0, loiter_radius=100.0, turns=2.0),
        Waypoint(24.1, 60.0, 0.0, role="landing"),
    ),
    HOME,
)
DRONE = {"speed": 12.0, "power": 300.0, "climb_rate": 3.0, "descent_rate": 2.0}


@usual
@given(airspeed=st.floats(1.0, 30.0), blows=winds, bearing=angles, heading=angles)
def test_ground_speed_closes_the_wind_triangle(airspeed: float, blows: float, bearing: float, heading: float) -> None:
    """Without the wind, the airspeed is left; a speed of 0 means that no speed closes it."""
    along = np.array([math.cos(heading), math.sin(heading)])
    wind = blows * np.array([math.cos(bearing), math.sin(bearing)])
    speed = float(ground_speeds(1e3 * along[None], airspeed, tuple(wind.tolist()))[0])
    roots = np.roots([1.0, -2.0 * wind @ along, wind @ wind - airspeed**2])
    possible = [root.real for root in roots if abs(root.imag) < 1e-9 and root.real > 1e-6]
    if speed > 1e-6:
        assert np.hypot(*(speed * along - wind)) == pytest.approx(airspeed, rel=1e-9)
        assert speed == pytest.approx(max(possible), rel=1e-6)
    else:
        assert not possible or min(possible) < 1e-3


@usual
@given(blows=st.floats(0.0, 11.9), angle=st.floats(0.0, 3.1), more=st.floats(0.01, 1.0))
def test_energy_grows_as_the_wind_turns_against_the_leg(blows: float, angle: float, more: float) -> None:
    ends = [(0.0, 0.0), (5000.0, 0.0)]
    there, later = (
        cg.flight_time(ends, speed=12, wind=(blows * math.cos(a), blows * math.sin(a)), power=300, altitude=0)
        for a in (angle, min(angle + more, math.pi))
    )
    assert there.energy <= later.energy * (1.0 + 1e-12)
    # a return flight takes longest in wind
    back = cg.flight_time([*ends, ends[0]], speed=12, wind=later.aircraft.wind, altitude=0)
    assert back.seconds >= 2.0 * 5000.0 / 12.0 - 1e-9


def test_a_plan_is_summed_up_as_by_hand() -> None:
    first, second, third = (
        geodesic_length(one, other)
        for one, other in (((24.0, 60.0), (24.0, 60.05)), ((24.0, 60.05), (24.1, 60.05)), ((24.1, 60.05), (24.1, 60.0)))
    )
    found = cg.flight_time(KNOWN, **DRONE)
    # 80 m up; 30 m up on the way at 9 m/s; 110 m down above the landing
    by_hand = 80 / 3 + first / 12 + 30 + second / 9 + 2 * 2 * math.pi * 100 / 9 + third / 12 + 110 / 2
    assert found.seconds == pytest.approx(by_hand, rel=1e-9)
    assert found.energy == pytest.approx(300 * by_hand / 3600)
    assert (found.unknown, len(found.legs)) == ((), 3)
    # a descent of a fixed wing, on the last leg, that takes longer than the way
    plane = dataclasses.replace(KNOWN, vehicle=1)
    assert cg.flight_time(plane, **DRONE).seconds == pytest.approx(by_hand - 110 / 2)
    steep = cg.flight_time(plane, **{**DRONE, "descent_rate": 0.1})
    assert steep.seconds == pytest.approx(by_hand - 110 / 2 - third / 12 + 110 / 0.1)


@pytest.mark.slow
@usual
@given(heading=angles, blows=st.floats(0.0, 11.0), bearing=angles)
def test_paths_take_the_time_of_the_same_curve(heading: float, blows: float, bearing: float) -> None:
    """A polyline and the same lines as a flyable path."""
    problem = cg.Problem((0, 0), (900 * math.cos(heading), 900 * math.sin(heading)), bounds=(-1e3, -1e3, 1e3, 1e3))
    flown = {"speed": 12.0, "wind": (blows * math.cos(bearing), blows * math.sin(bearing))}
    straight = cg.solve(problem, "straight-line")
    curve = straight.flyable(50.0)
    assert cg.flight_time(straight, **flown).least_seconds == pytest.approx(
        cg.flight_time(curve, **flown).least_seconds
    )
    assert curve.timed(12.0, wind=flown["wind"]).seconds == pytest.approx(cg.flight_time(curve, **flown).legs.sum())


@usual
@given(battery=st.floats(1.0, 500.0), reserve=st.floats(0.0, 0.99))
def test_a_battery_lasts_if_what_may_be_used_is_enough(battery: float, reserve: float) -> None:
    found = cg.flight_time(KNOWN, **DRONE, battery=battery, reserve=reserve)
    assume(abs(found.energy - battery * (1 - reserve)) > 1e-6)
    assert found.within_battery is (found.energy < battery * (1 - reserve))
    assert bool(found.faults) is not found.within_battery


def changed(index: int, **values: object) -> FlightPlan:
    waypoints = list(KNOWN.waypoints)
    waypoints[index] = dataclasses.replace(waypoints[index], **values)
    return dataclasses.replace(KNOWN, waypoints=tuple(waypoints))


@pytest.mark.parametrize(
    ("plan", "drone", "said"),
    [
        (KNOWN, {"climb_rate": None}, "the climb of 110 m: give --climb-rate"),
        (KNOWN, {"descent_rate": None}, "the descent of 110 m: give --descent-rate"),
        (KNOWN, {"speed": None}, "the speed of 2 legs: give --speed"),
        (changed(1, altitude=None), {}, "the climb to waypoint 2"),
        (changed(1, altitude=None), {}, "the climb to waypoint 3"),
        (changed(1, reference="ground"), {}, "the climb to waypoint 2"),
        (changed(1, reference="ellipsoid"), {}, "the climb to waypoint 2"),
        (changed(2, turns=0.0), {}, "waypoint 3: how long it circles"),
        (changed(2, loiter_radius=0.0), {}, "waypoint 3: the radius of its circle"),
        (changed(1, role="touch-down"), {}, ""),
        (
            changed(2, role="touch-down", loiter_radius=0.0, turns=0.0),
            {},
            "waypoint 3: how long it stays on the ground",
        ),
        (dataclasses.replace(KNOWN, home=Home(24.0, 60.0)), {}, "the climb to waypoint 3"),
        (dataclasses.replace(KNOWN, waypoints=KNOWN.waypoints[:-1]), {}, "the way down: the plan has no landing"),
        (dataclasses.replace(KNOWN, home=None, waypoints=KNOWN.waypoints[1:]), {}, "the plan has no take-off"),
        (dataclasses.replace(KNOWN, unknown=("a spline",)), {}, "a spline"),
        (dataclasses.replace(KNOWN, untimed=("it waits",)), {}, "it waits"),
        (FlightPlan((Waypoint(24.0, 60.0), Waypoint(24.1, 60.0)), HOME), {}, "the altitude above the ground is not"),
    ],
)
def test_what_is_not_known_is_never_zero_nor_enough(
    plan: FlightPlan, drone: dict[str, float | None], said: str
) -> None:
    """The numbers are least ones then, and no battery is said to last."""
    known = {**DRONE, **drone}
    found = cg.flight_time(plan, **known, battery=1e6)
    assert found.within_battery is (None if said else True)
    assert any(said in one for one in (*found.unknown, ""))
    if said:
        assert math.isnan(found.seconds)
        assert math.isnan(found.energy)
        assert found.document()["seconds"] is None
        assert "whether the battery lasts is not known" in found.faults[0]
        assert found.least_seconds > 0.0
        assert "at least" in found.lines()["flight"]
        # over the limit by the known part alone
        assert cg.flight_time(plan, **known, battery=1.0).within_battery is False


def test_a_wind_that_does_not_allow_a_leg_is_named() -> None:
    found = cg.flight_time(
        [(0, 0), (500, 0), (500, 0), (0, 0)], speed=5, wind=(8, 0), power=100, battery=1e6, altitude=0
    )
    assert found.legs.tolist() == [500 / 13, math.inf]
    assert not found.is_possible
    assert found.within_battery is False
    assert found.faults == ["the wind of 8 does not allow 1 leg (to waypoint 4) at an airspeed of 5"]
    # it flies downwind, but neither circles nor climbs in one place
    assert cg.flight_time([(0, 0), (500, 0)], speed=5, wind=(8, 0), altitude=0).is_possible
    assert not cg.flight_time([(0, 0), (500, 0)], speed=5, wind=(8, 0), altitude=50, climb_rate=2).is_possible
    assert not cg.flight_time(changed(1, stay=0.0), **DRONE, wind=(0, 12)).is_possible


def test_circles_take_longer_in_wind() -> None:
    calm, windy = (cg.flight_time(KNOWN, **{**DRONE, "speed": 8.0}, wind=wind).circling for wind in ((0, 0), (5, 0)))
    assert calm == pytest.approx(2 * 2 * math.pi * 100 / 8)
    assert windy > calm


def test_nothing_flown_takes_no_time() -> None:
    found = cg.flight_time([(3, 4)], speed=5, wind=(3, 3), power=10, altitude=0)
    assert (found.seconds, found.energy, found.faults) == (0.0, 0.0, [])
    assert found.lines()["flight"].startswith("0.0 s")


MISSION = [
    "QGC WPL 110",
    "0 1 0 16 0 0 0 0 60.0 24.0 12 1",
    "1 0 3 22 0 0 0 0 60.0 24.0 80 1",
    "2 0 3 16 20 0 0 0 60.01 24.0 80 1",
    "3 0 2 93 15 -1 -1 -1 0 0 0 1",
    "4 0 3 18 3 0 50 0 60.02 24.0 80 1",
    "5 0 3 19 40 0 50 0 60.03 24.0 80 1",
    "6 0 3 21 0 0 0 0 60.03 24.0 0 1",
]


def test_stays_and_circles_of_missions_count(tmp_path: Path) -> None:
    file = tmp_path / "mine.waypoints"
    file.write_text("\n".join(MISSION))
    found = cg.flight_time(file, **DRONE)
    assert (found.staying, found.unknown) == (75.0, ())
    assert found.circling == pytest.approx(3 * 2 * math.pi * 50 / 12)
    for line, said in (
        ("3 0 2 93 -1 12 0 0 0 0 0 1", "it stays until a time of day"),
        ("3 0 3 31 0 50 0 0 60.01 24.0 90 1", "waypoint 3: how long it circles"),
    ):
        file.write_text("\n".join([*MISSION[:4], line, *MISSION[5:]]))
        assert any(said in one for one in cg.flight_time(file, **DRONE).unknown)
    file.write_text("\n".join([*MISSION[:6], "5 0 3 17 0 0 50 0 60.03 24.0 80 1"]))
    assert any("circles without an end" in one for one in cg.flight_time(file, **DRONE).unknown)


def test_a_commanded_airspeed_is_not_known_over_the_ground_in_wind(tmp_path: Path) -> None:
    file = tmp_path / "mine.waypoints"
    file.write_text("\n".join([*MISSION[:4], "3 0 2 178 0 9 -1 0 0 0 0 1", *MISSION[5:]]))
    assert cg.flight_time(file, **DRONE).unknown == ()
    assert any("9 m/s in the air" in one for one in cg.flight_time(file, **DRONE, wind=(0, 3)).unknown)


def test_stays_of_litchi_count(tmp_path: Path) -> None:
    file = tmp_path / "mine.csv"
    head = "latitude,longitude,altitude(m),actiontype1,actionparam1,actiontype2,actionparam2"
    rows = ["60.0,24.0,80,0,2500,-1,0", "60.01,24.0,80,1,900,0,4000", "60.02,24.0,80,-1,0,5,-90"]
    file.write_text("\n".join([head, *rows]))
    assert cg.flight_time(file, **DRONE).staying == 6.5


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ({"speed": 0.0}, "speed is 0"),
        ({"speed": 1e9}, "speed is 1e+09"),
        ({"speed": "12"}, "speed is '12'"),
        ({"wind": (1.0, 2.0)}, "--speed V"),
        ({"speed": 1.0, "wind": (1.0,)}, "wind"),
        ({"speed": 1.0, "power": -5.0}, "power is -5"),
        ({"power": 5.0, "battery": 0.0}, "battery is 0"),
        ({"battery": 90.0}, "--power W"),
        ({"power": 5.0, "battery": 90.0, "reserve": 20.0}, "0.2 for 20 %"),
        ({"power": 5.0, "battery": 90.0, "reserve": 1.0}, "reserve is 1"),
        ({"power": 5.0, "battery": 90.0, "reserve": math.nan}, "reserve is nan"),
        ({"power": 5.0, "reserve": 0.1}, "--battery WH"),
        ({"speed": 1.0, "climb_rate": 0.0}, "climb_rate is 0"),
    ],
)
def test_nonsense_is_refused(numbers: dict[str, object], said: str) -> None:
    with pytest.raises(CglaError, match=said.replace("+", r"\+")):
        Aircraft(**numbers)
    with pytest.raises(CglaError, match="altitude is -3"):
        cg.flight_time([(0, 0), (1, 1)], speed=1.0, altitude=-3.0)
    below_the_sea = cg.flight_time([(0, 0), (1, 1)], speed=1.0, altitude=-3.0, above="sea")
    assert "the altitude above the ground is not known" in below_the_sea.unknown[0]


def test_a_checked_plan_is_clean_only_if_the_battery_lasts() -> None:
    problem = cg.Problem.in_degrees((24.0, 60.0), (24.1, 60.0), bounds=(23.9, 59.9, 24.2, 60.2))
    for drone, clean in (
        ({}, True),
        ({"battery": 200.0}, True),
        ({"battery": 20.0}, False),
        ({"battery": 200.0, "climb_rate": None}, False),
        ({"wind": (0.0, 13.0)}, False),
    ):
        found = cg.check(KNOWN, problem, aircraft=Aircraft(**{**DRONE, **drone}), tolerance=None)
        assert found.is_clean is clean, drone
        assert ("clean" in found.verdict) is clean
        assert found.document()["flight"]["aircraft"]["power"] == 300.0
    # a plan without altitudes climbs to the one that is given
    bare = FlightPlan((Waypoint(24.0, 60.0), Waypoint(24.1, 60.0)))
    drone = Aircraft(**DRONE, battery=200.0)
    assert not cg.check(bare, problem, aircraft=drone, tolerance=None).is_clean
    high = cg.check(bare, problem, aircraft=drone, altitude=60, tolerance=None)
    assert high.is_clean
    assert high.flight is not None
    assert high.flight.climbing == 60 / 3 + 60 / 2


@usual
@given(
    plan=flight_plans(autopilot=False),
    rates=st.booleans(),
    blows=st.floats(0.0, 15.0),
    bearing=angles,
    battery=st.floats(0.1, 1e6),
)
def test_any_plan_has_a_time_or_a_reason(
    plan: FlightPlan, rates: bool, blows: float, bearing: float, battery: float
) -> None:
    drone = {**DRONE, "wind": (blows * math.cos(bearing), blows * math.sin(bearing)), "battery": battery}
    drone |= {} if rates else {"climb_rate": None, "descent_rate": None}
    found = cg.flight_time(plan, **drone)
    json.dumps(found.document(), allow_nan=False)
    assert found.least_seconds >= sum(one.stay for one in plan.waypoints)
    assert (found.legs >= 0.0).all()
    assert math.isnan(found.seconds) is bool(found.unknown)
    assert found.within_battery is not True or (not found.unknown and found.is_possible)
    assert bool(found.faults) is (found.within_battery is not True)
    assert all("\n" not in line for line in found.lines().values())
    # more battery never harms, and more wind never makes a leg possible that calm air does not
    more = cg.flight_time(plan, **{**drone, "battery": 2.0 * battery})
    assert found.within_battery is not True or more.within_battery is True
    assert cg.flight_time(plan, **{**drone, "wind": (0.0, 0.0)}).is_possible


@pytest.mark.parametrize(("vehicle", "apart"), [(None, True), (2, True), (22, True), (1, False)])
def test_aircraft_that_hover_climb_at_home_and_descend_above_it(vehicle: int | None, apart: bool) -> None:
    """As a return to home does: up, straight, and then down."""
    home = Home(24.0, 60.0)
    out = Waypoint(24.0, 60.01, 60.0, role="take-off")
    back = Waypoint(24.0, 60.0, 0.0, role="landing")
    plan = FlightPlan((out, back), home, vehicle=vehicle)
    level = cg.flight_time(plan, speed=15, climb_rate=1e4, descent_rate=1e4)
    found = cg.flight_time(plan, speed=15, climb_rate=3, descent_rate=2)
    assert found.seconds == pytest.approx(level.seconds + (20.0 + 30.0) * apart, abs=0.05)
    assert found.climbing == pytest.approx(50.0 * apart, abs=0.05)

"""Corners that autopilots cut by their own acceptance radius, which files leave open."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea
from cgla_graph.airspace.flight_plans.crossings import crossings_of
from cgla_graph.airspace.flight_plans.formats import plan_of_bytes, text_of_plan
from cgla_graph.airspace.flight_plans.mavlink import turning
from cgla_graph.airspace.plan_check.result import PlanCheck
from cgla_graph.errors import PlanError
from cgla_graph.model.earth import LocalProjection

HERE = LocalProjection(24.0, 60.0)
#: Metres east and north: home, a corner, and the end. Inside the corner, there may be a pillar.
ROUTE = [(-1000.0, 0.0), (0.0, 0.0), (0.0, 1000.0)]


def place(east: float, north: float) -> list[float]:
    """Return latitude and longitude."""
    longitude, latitude = HERE.inverse((east, north)).tolist()
    return [latitude, longitude]


def plan_file(
    *places: tuple[float, float], command: int = 16, more: tuple[float | None, ...] = (0.0, 0.0, 0.0), **mission: int
) -> bytes:
    """Return a plan of QGroundControl, with the numbers before the places of all items."""
    items = [
        {"type": "SimpleItem", "command": command, "frame": 3, "params": [*more, None, *place(*one), 50.0]}
        for one in places
    ]
    table = {"version": 2, "items": items, "plannedHomePosition": [*place(-1000, 0), 12.0], **mission}
    return json.dumps({"fileType": "Plan", "version": 1, "mission": table}).encode()


def pillar(folder: Path, near: float) -> Path:
    """Write a zone inside the corner of the route: a square that is so far from the corner, along the diagonal."""
    middle = near / math.sqrt(2.0) + 0.5
    corners = [(-middle + x, middle + y) for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5))]
    ring = [place(*corner)[::-1] for corner in corners]
    file = folder / "pillar.geojson"
    file.write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    return file


def checked(folder: Path, data: bytes, near: float, name: str = "a.plan", **settings: Any) -> PlanCheck:  # noqa: ANN401 - of check
    (folder / name).write_bytes(data)
    return cg.check(folder / name, zones=pillar(folder, near), tolerance=None, **settings)


@pytest.mark.parametrize(
    ("mission", "reach", "source"),
    [
        ({}, 10.0, "NAV_ACC_RAD"),
        ({"firmwareType": 12, "vehicleType": 2}, 10.0, "NAV_ACC_RAD"),
        ({"firmwareType": 0, "vehicleType": 14}, 10.0, "NAV_ACC_RAD"),
        ({"firmwareType": 3, "vehicleType": 2}, 2.0, "WPNAV_RADIUS"),
    ],
)
def test_a_corner_is_cut_by_the_default_of_the_autopilot(
    tmp_path: Path, mission: dict[str, int], reach: float, source: str
) -> None:
    data = plan_file(*ROUTE[1:], **mission)
    # (it flies from a place that far before the corner to the end, along the long side of a flat triangle)
    inside, outside = 1.3 * reach, 1.45 * reach
    found = checked(tmp_path, data, inside)
    assert "where the corner before is cut" in found.verdict[0]
    assert [(one.leg, one.is_beside) for one in found.crossings.found] == [(1, True)]
    assert any(source in remark and f"{reach:g} m" in remark for remark in found.plan.remarks)
    # (the clearance is that of the plan as it is drawn)
    assert found.clearance == pytest.approx(inside / math.sqrt(2.0), rel=1e-3)
    assert checked(tmp_path, data, outside).is_clean
    assert checked(tmp_path, data, inside, acceptance_radius=0).is_clean
    # one that is given is held against the clearance as well
    assert not checked(tmp_path, data, 30.0, acceptance_radius=40).is_clean
    assert checked(tmp_path, data, 60.0, acceptance_radius=40, clearance=2.0).is_clean
    assert not checked(tmp_path, data, 60.0, acceptance_radius=40, clearance=5.0).is_clean


def test_only_corners_are_cut(tmp_path: Path) -> None:
    """A route that does not turn, a waypoint with a distance of its own, and files without an autopilot."""
    straight = plan_file((0.0, 0.0), (1000.0, 0.0))
    assert plan_of_bytes(straight, "a.plan").remarks == ()
    own = plan_of_bytes(plan_file(*ROUTE[1:], more=(0.0, 4.0, 0.0)), "a.plan")
    assert [(one.pass_radius, one.acceptance) for one in own.waypoints] == [(4.0, 0.0), (4.0, 0.0)]
    given = plan_of_bytes(plan_file(*ROUTE[1:], more=(0.0, None, 0.0)), "a.plan")
    assert [one.acceptance for one in given.waypoints] == [10.0, 0.0]
    # it stops where it waits
    assert (
        plan_of_bytes(plan_file(*ROUTE[1:], command=19, more=(5.0, 0.0, 60.0)), "a.plan").waypoints[0].acceptance == 0
    )
    drawn = cg.FlightPlan.along([HERE.inverse(one) for one in ROUTE], altitude=50)
    for kind in (".csv", ".kml", ".gpx", ".geojson"):
        assert checked(tmp_path, text_of_plan(drawn, f"a{kind}").encode(), 5.0, f"a{kind}").is_clean
    for kind in (".plan", ".waypoints"):
        text = text_of_plan(drawn, f"a{kind}").encode()
        assert not checked(tmp_path, text, 5.0, f"a{kind}").is_clean
        assert plan_of_bytes(text, f"a{kind}").waypoints == drawn.waypoints
        # what files for autopilots leave open, files for viewers have to say
        read = plan_of_bytes(text, f"a{kind}")
        assert not checked(tmp_path, text_of_plan(read, "b.csv").encode(), 5.0, "b.csv").is_clean
        assert plan_of_bytes(text_of_plan(read, "c.plan").encode(), "c.plan").waypoints == drawn.waypoints


@pytest.mark.parametrize("vehicle", [1, 19, 20, 22, 25])
def test_turns_of_a_fixed_wing_are_not_known(tmp_path: Path, vehicle: int) -> None:
    for firmware in (0, 3, 12):
        data = plan_file(*ROUTE[1:], vehicleType=vehicle, firmwareType=firmware)
        found = checked(tmp_path, data, 500.0)
        assert "the aircraft turns there on an arc" in found.verdict[0]
        assert "--acceptance-radius M" in found.verdict[0]
        assert checked(tmp_path, data, 500.0, acceptance_radius=90).is_clean
        assert not checked(tmp_path, data, 80.0, acceptance_radius=90).is_clean
    own = plan_file(*ROUTE[1:], vehicleType=vehicle, more=(0.0, 90.0, 0.0))
    assert checked(tmp_path, own, 500.0).is_clean
    straight = plan_file((0.0, 0.0), (1000.0, 0.0), vehicleType=vehicle)
    assert checked(tmp_path, straight, 500.0).is_clean


def test_numbers_that_are_no_distance_are_refused(tmp_path: Path) -> None:
    for value in (-1, math.nan, 2e6, "10"):
        with pytest.raises(PlanError, match="acceptance_radius: it is"):
            checked(tmp_path, plan_file(*ROUTE[1:]), 500.0, acceptance_radius=value)


def flown(route: FloatArray, cuts: list[float], turns: np.random.Generator) -> list[tuple[int, FloatArray]]:
    """Fly a route: straight at a waypoint, and within its distance on to the next one, from any place on the way."""
    here, found = route[0], []
    for number in range(1, len(route)):
        goal = route[number]
        way = float(np.hypot(*(goal - here)))
        cut = cuts[number] if number < len(route) - 1 else 0.0
        # (places within the distance: it may turn at any of them)
        last = here + (goal - here) * max(1.0 - turns.choice([1.0, turns.random()]) * cut / way, 0.0)
        found += [(number - 1, here + share * (last - here)) for share in np.linspace(0.0, 1.0, 9)]
        here = last
    return found


@pytest.mark.parametrize("step", [60.0, 25.0, 8.0])
def test_what_is_flown_is_in_the_legs_or_their_cut_corners(step: float) -> None:
    """A pin at any place of such a flight is met, also where legs are shorter than the distances."""
    rng = np.random.default_rng(int(step))
    for _ in range(12):
        route = np.cumsum(rng.uniform(-step, step, (6, 2)), axis=0)
        cuts = [0.0, *rng.choice([0.0, 5.0, 20.0], 4).tolist(), 0.0]
        places = flown(route, cuts, rng)
        # (the places where it turns are the farthest from the legs)
        for leg, spot in [*places[8::9], places[rng.integers(len(places))]]:
            pin = ClosedArea("pin", shapely.box(*(spot - 0.01), *(spot + 0.01)))
            found = crossings_of(route, [pin], rounding=1e-6, cuts=cuts)
            assert {*found.legs.tolist(), *found.beside.tolist()}, (leg, spot)
        everything = ClosedArea("all", shapely.box(-1e4, -1e4, 1e4, 1e4))
        assert all(cuts[leg] > 0.0 for leg in crossings_of(route, [everything], cuts=cuts).beside.tolist())


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_corner_that_is_cut_leads_to_another_side_of_the_next_one(side: float) -> None:
    """From 20 m before the first corner, it comes within 20 m of the second one beside the leg between them."""
    route = np.array([(-100.0, 0.0), (0.0, 0.0), (0.0, 60.0), (-100.0, 60.0)]) * (1.0, side)
    first, goal, last = np.array((-20.0, 0.0)), np.array((0.0, 60.0)), np.array((-100.0, 60.0))
    turned = goal - 20.0 * (goal - first) / np.hypot(*(goal - first))
    for share in (0.1, 0.25, 0.5):
        spot = (turned + share * (last - turned)) * (1.0, side)
        pin = ClosedArea("pin", shapely.box(*(spot - 0.005), *(spot + 0.005)))
        assert crossings_of(route, [pin], rounding=1e-6, cuts=[0.0, 20.0, 20.0, 0.0]).beside.tolist() == [2]


def test_the_outer_side_of_a_corner_is_not_flown_through() -> None:
    route = np.array(ROUTE)
    for outside in (shapely.box(0.05, -9.0, 9.0, 9.0), shapely.box(-9.0, -9.0, 9.0, -0.05)):
        assert not len(crossings_of(route, [ClosedArea("outside", outside)], cuts=[0.0, 50.0, 0.0]).beside)


def test_turns_are_those_of_directions() -> None:
    route = np.array([(179.9, 0.0), (-179.9, 0.0), (-179.7, 0.0), (-179.7, 0.1), (-179.7, 0.1), (-179.7, 0.0)])
    assert turning(route).tolist() == [False, False, True, True, True, False]
    assert turning(route[:1]).tolist() == [False]
    assert turning(route[[0, 0, 0]]).tolist() == [False] * 3

"""Comparison of a plan's altitudes with floors and ceilings, leg by leg."""

import json
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from mutations import damaged, damaged_json, tried
from scipy.ndimage import map_coordinates
from strategies import examples, few
from zone_files import data_of, ed269, volume

from cgla_graph._types import FloatArray
from cgla_graph.airspace.flight_plans import simultaneous_areas
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea
from cgla_graph.airspace.flight_plans.crossings import crossings_of
from cgla_graph.airspace.flight_plans.formats import plan_of_bytes, text_of_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Reference, Waypoint
from cgla_graph.airspace.flight_plans.profile import profile_of
from cgla_graph.airspace.plan_check.check import check
from cgla_graph.airspace.plan_check.plan_heights import PlanHeights
from cgla_graph.airspace.plan_check.result import PlanCheck
from cgla_graph.airspace.zones.applying import Zones
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.zone import Layer, Limit, Limits, Zone
from cgla_graph.errors import CglaError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.testing.strategies import seeds

Check: TypeAlias = Callable[..., PlanCheck]

#: From west to east through the zone, which is between these longitudes.
WEST, EAST, LOW, HIGH = 5.9, 6.3, 6.0, 6.2
SQUARE = [[LOW, 49.0], [HIGH, 49.0], [HIGH, 49.2], [LOW, 49.2], [LOW, 49.0]]


def zone(lower: float, below: str, upper: float | None, above: str, **more: object) -> dict[str, Any]:
    projection = {"type": "Polygon", "coordinates": [SQUARE]}
    return volume(
        lowerLimit=lower,
        lowerVerticalReference=below,
        upperLimit=upper,
        upperVerticalReference=above,
        **{"horizontalProjection": projection, **more},
    )


def through(
    first: float | None, last: float | None, reference: Reference = "ground", home: Home | None = None
) -> FlightPlan:
    ends = ((WEST, first), (EAST, last))
    return FlightPlan(tuple(Waypoint(x, 49.1, height, reference) for x, height in ends), home)


@pytest.fixture
def checked(tmp_path: Path) -> Check:
    def of_volumes(
        plan: FlightPlan, *volumes: dict[str, Any], tolerance: float | None = None, ground: str | None = None
    ) -> PlanCheck:
        path = tmp_path / "zones.json"
        path.write_bytes(data_of(ed269(*volumes)))
        return check(plan, zones=path, tolerance=tolerance, ground=ground)

    return of_volumes


def longitudes(found: PlanCheck) -> list[list[float]]:
    document = json.loads(json.dumps(found.document()))
    return [[one["entry_lonlat"][0], one["exit_lonlat"][0]] for one in document["crossings"]]


@pytest.mark.parametrize(
    ("first", "last", "expected"),
    [
        # between 50 and 150 m, the middle of the leg is at 100 m
        (50.0, 150.0, [LOW, 6.1]),
        (150.0, 50.0, [6.1, HIGH]),
        (100.0, 100.0, [LOW, HIGH]),
        (20.0, 20.0, [LOW, HIGH]),
        (100.001, 100.001, None),
        (19.999, 19.0, None),
        # above the ceiling until it is past the zone
        (1000.0, 100.0, None),
    ],
)
def test_a_leg_crosses_where_it_is_inside_and_within_the_limits(
    checked: Check, first: float, last: float, expected: list[float] | None
) -> None:
    found = checked(through(first, last), zone(20, "AGL", 100, "AGL"))
    assert longitudes(found) == ([] if expected is None else [pytest.approx(expected, abs=1e-5)])
    assert found.is_clean is (expected is None)
    assert found.on.heights.notes() == []
    # infinite if the zone does not count at all
    if first < 1000.0:
        assert found.crossings.clearances[0] == (math.inf if expected is None else 0.0)


@pytest.mark.parametrize(
    ("plan", "limits", "clean", "note"),
    [
        (through(80, 80, "home"), (0, "AGL", 120, "AGL"), False, "--ground"),
        (through(500, 500, "home"), (0, "AGL", 120, "AGL"), False, "--ground"),
        (through(500, 500, "sea"), (0, "AGL", 120, "AGL"), False, "--ground"),
        (through(80, 80, "home", home=Home(WEST, 49.1, 350.0)), (0, "AGL", 400, "AMSL"), True, ""),
        (through(40, 40, "home", home=Home(WEST, 49.1, 350.0)), (0, "AGL", 400, "AMSL"), False, ""),
        # files write 0 m for an unknown height
        (through(80, 80, "home", home=Home(WEST, 49.1, 0.0)), (0, "AGL", 40, "AMSL"), False, "the height of home"),
        (through(None, None), (0, "AGL", 120, "AGL"), False, None),
        (through(500, None), (0, "AGL", 120, "AGL"), False, "has no altitude there"),
        # the geoid is known to 100 m
        (through(600, 600, "ellipsoid"), (0, "AGL", 400, "AMSL"), True, ""),
        (through(450, 450, "ellipsoid"), (0, "AGL", 400, "AMSL"), False, ""),
        (through(400, 400, "ellipsoid"), (450, "AMSL", None, "AGL"), False, ""),
        (through(300, 300, "ellipsoid"), (450, "AMSL", None, "AGL"), True, ""),
        # one limit that can be compared may prove the zone open, but not closed
        (through(80, 80), (0, "AMSL", 50, "AGL"), True, ""),
        (through(80, 80), (0, "AMSL", 90, "AGL"), False, "--ground"),
        (through(500, 500), (0, "AGL", None, "AGL"), False, None),
    ],
)
def test_zones_that_cannot_be_compared_are_closed_with_a_note(
    checked: Check, plan: FlightPlan, limits: tuple[float, str, float | None, str], clean: bool, note: str | None
) -> None:
    found = checked(plan, zone(*limits))
    assert found.is_clean is clean
    assert longitudes(found) == ([] if clean else [pytest.approx([LOW, HIGH], abs=1e-5)])
    notes = [] if found.on.heights is None else found.on.heights.notes()
    assert len(notes) == bool(note)
    assert all(note in one and "\n" not in one for one in notes)


def test_legs_of_other_heights_cross_other_layers(checked: Check) -> None:
    """Each layer of a zone counts at its own heights and over its own area, also for climbs and landings."""
    east = {"type": "Polygon", "coordinates": [[[x + 0.1, y] if x < 6.1 else [x, y] for x, y in SQUARE]]}
    layers = zone(0, "AGL", 50, "AGL"), zone(50, "AGL", 200, "AGL", horizontalProjection=east)
    assert longitudes(checked(through(100, 100), *layers)) == [pytest.approx([6.1, HIGH], abs=1e-5)]
    assert longitudes(checked(through(30, 30), *layers)) == [pytest.approx([LOW, HIGH], abs=1e-5)]
    assert checked(through(50, 50), *layers).verdict == ["not clean: 1 leg crosses 1 area"]
    # a vertical climb inside the zone, then a leg above it: only the climb is inside; it takes off where it begins
    places = [(6.05, 49.1), (6.05, 49.3)]
    for home in (None, Home(6.05, 49.1)):
        plan = FlightPlan(tuple(Waypoint(x, y, 100.0, "ground") for x, y in places), home)
        found = checked(plan, *layers)
        assert [one.is_upright for one in found.crossings.found] == [True]
        way = "its take-off at 6.050000,49.100000 goes through A-1 (Castle) at 0 m AGL to 50 m AGL"
        assert found.verdict == [f"not clean: {way}"]
    # a landing may glide all the way from 100 m
    landing = FlightPlan((*plan.waypoints[::-1], Waypoint(6.3, 49.1, 0.0, "home", role="landing")))
    assert not checked(landing, *layers).is_clean


def test_the_best_plan_is_one_at_its_heights(checked: Check) -> None:
    """A zone below the plan is crossed straight; a zone at its heights is flown around."""
    over, under = (checked(through(height, height), zone(0, "AGL", 100, "AGL"), tolerance=0.01) for height in (150, 80))
    assert over.is_clean
    assert 0.999 * over.cost < over.best.lower_bound <= over.cost
    assert under.best.lower_bound > 1.1 * under.cost
    # a climb may be above the zone all the way
    climb = checked(through(80, 150), zone(0, "AGL", 100, "AGL"), tolerance=0.01)
    assert not climb.is_clean
    assert climb.best.lower_bound <= climb.cost


def test_elevations_resolve_heights_along_the_leg(checked: Check, tmp_path: Path) -> None:
    """300 m in the west, 400 m in the east: 480 m above the sea is 180 m above the ground, then 80 m."""
    rows = "\n".join(" ".join(["300"] * 20 + ["400"] * 40) for _ in range(10))
    raster = tmp_path / "ground.asc"
    raster.write_text(f"ncols 60\nnrows 10\nxllcorner 5.8\nyllcorner 49.05\ncellsize 0.01\n{rows}\n")
    # (the edge of the step is at longitude 6.0; a cell and its neighbours count)
    east = {"type": "Polygon", "coordinates": [[[x - 0.08, y] for x, y in SQUARE]]}
    limits = zone(0, "AGL", 120, "AGL", horizontalProjection=east)
    found = checked(through(480, 480, "sea"), limits, ground=str(raster))
    ((first, last),) = longitudes(found)
    assert 5.96 < first <= 6.0
    assert last == pytest.approx(6.12, abs=1e-4)
    assert found.on.heights.notes() == []
    assert checked(through(530, 530, "sea"), limits, ground=str(raster)).is_clean
    # home is 300 m above the sea, as the raster says
    home = Home(WEST, 49.1)
    assert longitudes(checked(through(180, 180, "home", home=home), limits, ground=str(raster)))[0][1] > 6.1
    assert checked(through(240, 240, "home", home=home), limits, ground=str(raster)).is_clean
    # where the raster has no data, elevations are unknown
    raster.write_text(raster.read_text().replace("400 400\n", "400 -9999\n").replace("cellsize 0.01", "cellsize 0.003"))
    assert "has data there" in checked(through(530, 530, "sea"), limits, ground=str(raster)).on.heights.notes()[0]


def flight(seed: int) -> tuple[PlanHeights, list[ClosedArea], Ground]:
    """Return a zigzag with altitudes over boxes with floors and ceilings, some of them side by side, and hills."""
    rng = np.random.default_rng(seed)
    projection = LocalProjection(6.0, 49.0)
    (west, south), (east, north) = projection.inverse([(-9000.0, -9000.0), (9000.0, 9000.0)]).tolist()
    ground = Ground(100.0 * rng.integers(0, 4, (12, 12)).astype(float), (west, south, east, north))
    places = rng.integers(-7, 8, (int(rng.integers(2, 6)), 2)) * 1000.0
    places = places[np.concatenate([[True], (places[1:] != places[:-1]).any(axis=1)])]
    reference = ["ground", "sea", "home"][rng.integers(3)]
    heights = rng.integers(0, 8, len(places)) * 50.0
    plan = FlightPlan(
        tuple(
            Waypoint(x, y, height, reference)  # type: ignore[arg-type]
            for (x, y), height in zip(projection.inverse(places).tolist(), heights.tolist(), strict=True)
        )
    )
    areas, limits = [], []
    for number in range(int(rng.integers(1, 5))):
        x, y = rng.integers(-7, 5, 2) * 1000.0
        areas.append(ClosedArea(str(number), shapely.box(x, y, x + 3000.0, y + 3000.0)))
        low, high = np.sort(rng.integers(0, 8, 2) * 50.0).tolist()
        references = ["AGL", "AMSL"]
        limits.append(
            Limits(Limit(low, references[rng.integers(2)]), Limit(high, references[rng.integers(2)]))  # type: ignore[arg-type]
        )
    boxes = np.array([one.shape.bounds for one in areas])
    stops = tuple(range(1, len(places) + 1))
    with_ground = ground if rng.random() < 0.5 else None
    return PlanHeights(plan, stops, limits, with_ground, places, boxes, projection), areas, ground


def above_the_sea(ground: Ground, lonlat: FloatArray) -> FloatArray:
    """Return elevations linear between centres of cells (scipy)."""
    west, _, _, north = ground.bounds
    at = [(north - lonlat[:, 1]) / ground.cell[1] - 0.5, (lonlat[:, 0] - west) / ground.cell[0] - 0.5]
    return np.asarray(map_coordinates(ground.values, at, order=1, mode="nearest"))


def straight(heights: PlanHeights, ground: Ground, leg: int, shares: FloatArray) -> dict[str, FloatArray]:
    """Return heights above sea and ground of the straight line between the highest ends of a leg above ground."""
    start, end = heights.route[[leg, min(leg + 1, len(heights.route) - 1)]]
    lonlat = heights.projection.inverse(start + shares[:, None] * (end - start))
    levels = above_the_sea(ground, heights.projection.inverse([start, end])) + heights.profile.legs[leg].high
    sea = levels[0] + shares * (levels[1] - levels[0])
    return {"AMSL": sea, "AGL": sea - above_the_sea(ground, lonlat)}


@few
@given(seeds)
# one place, and a straight leg that is higher above a valley than at its ends
@example(234500)
@example(324)
def test_wherever_it_is_inside_and_within_the_limits_it_crosses(seed: int) -> None:
    """
    Sample places with their own elevation; where references are equal, it crosses nowhere else.

    Over known elevations, legs above ground follow the ground or are straight: it crosses where either is inside. An
    area beside a place at its heights is no nearer than the clearance of the leg says.
    """
    heights, areas, ground = flight(seed)
    required = 1500.0
    crossings = crossings_of(heights.route, areas, heights=heights, required=required)
    west, _, _, north = ground.bounds
    for leg, profile in enumerate(heights.profile.legs):
        start, end = heights.route[[leg, min(leg + 1, len(heights.route) - 1)]]
        may_be_straight = profile.reference == "ground" and heights.ground is not None
        for share in np.linspace(0.003, 0.997, 60).tolist():
            place = start + share * (end - start)
            longitude, latitude = heights.projection.inverse(place).tolist()
            wide, high = ground.cell
            here = float(ground.values[int((north - latitude) / high), int((longitude - west) / wide)])
            above = {"ground": here, "sea": 0.0, "home": 150.0}[str(profile.reference)]
            # (a leg from or to the ground is anywhere below)
            least, most = (here if math.isinf(height) else height + above for height in profile.at(share))
            is_free = math.isinf(profile.lowest)
            own = straight(heights, ground, leg, np.array([share]))
            # (straight legs count in pieces of at most 200 m, by bounds of their heights)
            about = np.clip(share + np.linspace(-200.0, 200.0, 21) / max(math.dist(start, end), 1.0), 0.0, 1.0)
            near = straight(heights, ground, leg, about)
            far = math.dist(place, start)
            for number, area in enumerate(areas):
                limits = heights.limits[number]
                assert limits is not None
                lower, upper = limits.lower, limits.upper
                floor, ceiling = (one.metres + here * (one.reference == "AGL") for one in (lower, upper))
                inside = shapely.contains_xy(area.shape, *place)
                is_in = [
                    one
                    for one in crossings.found
                    if (one.leg, one.area) == (leg, number)
                    and math.dist(one.entry, start) - 1e-6 <= far <= math.dist(one.exit, start) + 1e-6
                ]
                below = own[upper.reference][0] <= upper.metres or (is_free and ceiling >= here)
                within = below and own[lower.reference][0] >= lower.metres
                if (floor <= most and least <= ceiling) or (may_be_straight and within):
                    assert is_in or not inside
                    away = float(area.shape.distance(shapely.Point(place)))
                    assert crossings.clearances[leg] <= away + 1e-6 or away >= required
                same = {one.reference for one, _ in limits.bounded} <= {
                    {"ground": "AGL", "sea": "AMSL"}.get(str(profile.reference))
                }
                if same and is_in:
                    edge = 1.0 + abs(profile.high[0] - profile.high[1]) * 1e-3
                    assert inside or area.shape.distance(shapely.Point(place)) < 1e-6
                    flown = near[lower.reference]
                    reaches = (is_free or flown.min() - 10.0 <= upper.metres) and flown.max() + 10.0 >= lower.metres
                    follows = floor - edge <= most and least <= ceiling + edge
                    assert follows or lower.metres <= 0.0 or (may_be_straight and reaches)


@pytest.mark.parametrize("reach", [0.0, 50.0])
@pytest.mark.parametrize(
    ("reference", "limits", "least", "clean"),
    [
        # at 20 m above the west end of the leg, 50 m is reached 126 m before the zone, flying on at 142 m in the east
        ("sea", (0, "AGL", 50, "AGL"), 300.0, False),
        ("sea", (0, "AMSL", 350, "AMSL"), 300.0, False),
        ("ground", (0, "AMSL", 350, "AMSL"), 0.0, False),
        # far above, far below
        ("sea", (0, "AGL", 50, "AGL"), 400.0, True),
        ("ground", (0, "AMSL", 350, "AMSL"), 100.0, True),
        ("ground", (0, "AGL", 50, "AGL"), 100.0, True),
        ("sea", (500, "AGL", 600, "AGL"), 300.0, True),
        ("home", (0, "AGL", 50, "AGL"), 100.0, True),
        ("home", (0, "AGL", 50, "AGL"), 0.0, False),
    ],
)
def test_a_clearance_is_kept_from_areas_at_the_heights_of_the_leg_beside_them(
    reference: Reference, limits: tuple[float, str, float, str], least: float, reach: float, *, clean: bool
) -> None:
    """Known elevations count up to the clearance from an area, on the leg's way there and where it passes beside."""
    layer = Layer(shapely.box(6.0, 49.0, 6.2, 49.2), Limit(*limits[:2]), Limit(*limits[2:]))  # type: ignore[arg-type]
    zones = Zones((Zone("A", "", "PROHIBITED", (layer,)),))
    ground = Ground(np.full((60, 60), 300.0), (5.7, 48.7, 6.5, 49.5))
    for y in (49.1, 49.2005):
        places = ((5.8, 60.0), (5.9, 20.0), (6.3, 142.1), (6.4, 142.0))
        found = (Waypoint(x, y, least + height, reference, pass_radius=reach * (x > 6.2)) for x, height in places)
        plan = FlightPlan(tuple(found), Home(5.8, y, 300.0))
        checked = check(
            plan, zones=zones, ground=ground, terrain_clearance=0.0, clearance=300.0 + 2.0 * reach, tolerance=None
        )
        assert checked.is_clean is clean, (y, checked.verdict)


def test_two_areas_side_by_side_leave_no_way_at_heights_of_both() -> None:
    left, right = shapely.box(-1000, 0, 0, 1000), shapely.box(0, 0, 1000, 1000)
    areas = [ClosedArea("left", left), ClosedArea("right", right)]
    projection = LocalProjection(6.0, 49.0)
    route = np.array([(0.0, -500.0), (0.0, 1500.0)])
    ends = projection.inverse(route).tolist()
    for height, crosses in ((40.0, True), (80.0, False), (120.0, False)):
        plan = FlightPlan(tuple(Waypoint(x, y, height, "ground") for x, y in ends))
        limits = [Limits(Limit(0.0, "AGL"), Limit(top, "AGL")) for top in (50.0, 100.0)]
        boxes = np.array([one.shape.bounds for one in areas])
        heights = PlanHeights(plan, (1, 2), limits, None, route, boxes, projection)
        found = crossings_of(route, areas, heights=heights)
        assert found.legs.tolist() == [0] * crosses
        assert found.clearances.tolist() == [math.inf if height == 120.0 else 0.0]


def test_heights_are_those_between_waypoints() -> None:
    points = [(24.0, 50.0, "waypoint"), (24.1, 100.0, "waypoint"), (24.1, 60.0, "waypoint"), (24.2, 0.0, "landing")]
    plan = FlightPlan(tuple(Waypoint(x, 60.0, z, role=role) for x, z, role in points), Home(23.9, 60.0))  # type: ignore[arg-type]
    profile = profile_of(plan, (0, 1, 2, 4))
    assert [one.at(0.5) for one in profile.legs] == [(-math.inf, 50.0), (75.0, 75.0), (-math.inf, 60.0)]
    spans = [None if one is None else (one.lowest, one.highest) for one in profile.places]
    assert spans == [None, None, (60.0, 100.0), (-math.inf, 60.0)]
    circle = FlightPlan((Waypoint(24.0, 60.0, 50.0), Waypoint(24.1, 60.0, 90.0, loiter_radius=80.0)))
    assert [(one.lowest, one.highest) for one in profile_of(circle, (1, 2)).legs] == [(50.0, 90.0)]
    mixed = FlightPlan((Waypoint(24.0, 60.0, 50.0), Waypoint(24.1, 60.0, 90.0, "sea")))
    assert profile_of(mixed, (1, 2)).legs[0].reference is None


def test_too_many_areas_to_compare_are_closed_with_a_note(checked: Check, monkeypatch: pytest.MonkeyPatch) -> None:
    layers = zone(0, "AGL", 50, "AGL"), zone(50, "AGL", 90, "AGL")
    assert checked(through(100, 100), *layers).is_clean
    for limit in ("MOST_PAIRS", "MOST_BUILT"):
        with monkeypatch.context() as context:
            context.setattr(simultaneous_areas, limit, 1)
            found = checked(through(100, 80), *layers)
            assert longitudes(found)[0] == pytest.approx([LOW, HIGH], abs=1e-5)
            assert found.on.heights is not None
            assert "all areas on it" in found.on.heights.notes()[0]


@examples(10)
@given(seed=seeds)
@example(seed=250000)
def test_damaged_zones_and_plans_are_checked_or_refused(seed: int) -> None:
    """The check is complete, or its error is one line."""
    zones = ed269(zone(20, "AGL", 100, "AMSL"), zone(0, "AGL", 400, "AGL", uomDimensions="FT"))
    plan_text = text_of_plan(through(50, 150, "home", Home(WEST, 49.1, 300.0)), "a.plan")
    texts = {"zones": data_of(zones), "plan": plan_text.encode()}

    def checked_or_refused(data: bytes) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "zones.json")
            path.write_bytes(data if which == "zones" else texts["zones"])
            plan = plan_of_bytes(data if which == "plan" else texts["plan"], "mine.plan")
            found = check(plan, zones=path, tolerance=None)
            json.dumps(found.document(), allow_nan=False)
            assert found.is_clean == (found.verdict[0][:5] == "clean")

    for which in ("zones", "plan"):
        documents = [change(texts[which], 9 * seed + n) for n in range(3) for change in (damaged, damaged_json)]
        tried(checked_or_refused, CglaError, documents)

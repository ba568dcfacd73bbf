"""Volumes around flights: their formulas, their size on the Earth, their files, and the people below them."""

import itertools
import json
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pyproj
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from shapely.geometry import shape
from strategies import few

import cgla_graph as cg
from cgla_graph.airspace.plan_check.plan_map import PlainMap
from cgla_graph.airspace.volumes.dimensions import VolumeSettings
from cgla_graph.airspace.volumes.ground_risk_class import COLUMNS, Density, density_under, intrinsic_class
from cgla_graph.airspace.volumes.held_against import touched_areas
from cgla_graph.airspace.zones.applying import Zones
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.zone import Layer, Limit, Zone
from cgla_graph.errors import CglaError, OutputError, PlanError, ProblemError
from cgla_graph.model.risk_raster import Origin

GEOD = pyproj.Geod(ellps="WGS84")
COPTER = {"speed": 15.0, "dimension": 0.8, "pitch": 30.0}


# cases of a published set of tests for the LBA's guidance, revisions 1.8 and 1.9: half widths of contingency volume and
# ground risk buffer from the middle, for a flight geography whose top is given
@pytest.mark.parametrize(
    ("facts", "half", "top", "contingency", "buffer"),
    [
        (
            {"speed": 10, "dimension": 1.5, "pitch": 45, "height_error": 1, "buffer": "ballistic"},
            25, 100, 47.0968, 95.865,
        ),
        ({"speed": 20, "dimension": 3.6, "roll": 30}, 25, 110, 122.6239, 264.6563),
        (
            {"speed": 20, "dimension": 3.6, "roll": 30, "height_error": 1, "buffer": "glide", "glide_ratio": 15},
            25, 110, 122.6239, 2181.1101,
        ),
        ({"speed": 15, "dimension": 2.5, "pitch": 25, "height_error": 1}, 25, 90, 71.593, 185.8108),
        (
            {"speed": 25, "dimension": 4.5, "roll": 40, "height_error": 1, "buffer": "parachute", "opening_time": 1.5,
             "wind": 5, "descent_rate": 3},
            50, 120, 157.9272, 458.1158,
        ),
    ],
)  # fmt: skip
def test_dimensions_are_those_of_the_guidance(
    facts: dict[str, Any], half: float, top: float, contingency: float, buffer: float
) -> None:
    chosen = VolumeSettings(width=2 * half, **facts)
    size = chosen.dimensions(top - chosen.geography_above)
    assert size.reaches == pytest.approx((half, contingency, buffer), abs=1e-3)


def test_ballistic_buffer_is_a_fall_without_drag() -> None:
    """One step of a simulation at a time."""
    facts = VolumeSettings(speed=12.0, dimension=2.0, pitch=30.0, buffer="ballistic")
    height, fallen, away, step = 80.0, 0.0, 0.0, 1e-4
    rate = 0.0
    while fallen < height:
        rate += 9.81 * step
        fallen += rate * step
        away += 12.0 * step
    assert facts.buffer_width(height) == pytest.approx(away + 1.0, abs=0.05)


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"speed": 15}, "dimension is missing"),
        ({"dimension": 1}, "speed is missing"),
        ({"speed": 15, "dimension": 1}, "give pitch"),
        ({"speed": 15, "dimension": 1, "pitch": 30, "roll": 30}, "pitch, roll is given"),
        ({"speed": 15, "dimension": 1, "pitch": 90}, "below 90"),
        ({"speed": -15, "dimension": 1, "pitch": 30}, "speed"),
        ({"speed": math.nan, "dimension": 1, "pitch": 30}, "speed"),
        ({"speed": 15, "dimension": 1, "contingency_width": 30}, "both contingency_width and contingency_height"),
        ({"speed": 15, "dimension": 1, "pitch": 30, "buffer": "glide"}, "needs glide_ratio"),
        ({"speed": 15, "dimension": 1, "pitch": 30, "glide_ratio": 5}, "has no glide_ratio"),
        ({"speed": 15, "dimension": 1, "pitch": 30, "buffer": "2:1"}, "buffer"),
        ({"speed": 15, "dimension": 1, "roll": 30, "buffer": "ballistic"}, "for multirotors"),
        ({"speed": 15, "dimension": 1, "pitch": 30, "width": 2.9}, "at least 3 m"),
        (
            {"speed": 15, "dimension": 1, "pitch": 30, "buffer": "parachute", "opening_time": 1, "descent_rate": 5,
             "wind": 2},
            "at least 3 m/s",
        ),
        ({"speed": 15, "dimension": 1, "pitch": 30, "weight": 3}, "weight is no fact"),
    ],
)  # fmt: skip
def test_nonsense_is_refused_with_a_remedy(facts: dict[str, Any], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        cg.volumes([(24, 60), (24.1, 60)], height=60, **facts)


ROUTES = st.tuples(
    st.floats(-180, 180),
    st.floats(-75, 75),
    st.lists(st.tuples(st.floats(-0.3, 0.3), st.floats(-0.2, 0.2)), min_size=1, max_size=4),
)


def _route(longitude: float, latitude: float, steps: list[tuple[float, float]]) -> np.ndarray:
    places = np.cumsum([(longitude, latitude), *steps], axis=0)
    places[:, 0] = (places[:, 0] + 180.0) % 360.0 - 180.0
    return places


@few
@example((32.0, 12.08203125, [(0.23366391356633914, -0.1734312059185606), (0.0, 0.1015625), (0.0, 0.171875)]), 0.0)
@example((0.0, 3.5, [(0.125, 0.15625), (0.0, 0.15625)]), 0.0)
@given(ROUTES, st.floats(0, 300))
def test_volumes_contain_each_other_and_all_that_is_near_on_the_earth(drawn: tuple[Any, ...], height: float) -> None:
    places = _route(*drawn)
    found = cg.volumes(places, height=height, **COPTER)
    inner, middle, outer = found.flight_geography, found.contingency, found.ground_risk_buffer
    assert middle.buffer(1e-9).contains(inner)
    assert outer.buffer(1e-9).contains(middle)
    assert all(one.is_valid for one in (inner, middle, outer))
    random = np.random.default_rng(1)
    for area, reach in zip((inner, middle, outer), found.dimensions.reaches, strict=True):
        middle_longitude = 0.5 * (area.bounds[0] + area.bounds[2])
        for first, last in itertools.pairwise(places):
            azimuth, _, length = GEOD.inv(*first, *last)
            for share in random.random(4):
                x, y, back = GEOD.fwd(*first, azimuth, share * length)
                del back
                east, north, _ = GEOD.fwd(x, y, random.random() * 360.0, reach)
                east += 360.0 * round((middle_longitude - east) / 360.0)
                assert area.contains(shapely.Point(east, north))


@pytest.mark.parametrize("step", [(0.05, 0.03), (-0.1, 0.0)])
@pytest.mark.parametrize("latitude", [-65.0, 12.5, 75.0])
def test_volumes_are_hardly_wider_than_asked_for(latitude: float, step: tuple[float, float]) -> None:
    first, last = (24.0, latitude), (24.0 + step[0], latitude + step[1])
    found = cg.volumes([first, last], height=80, **COPTER)
    azimuth, _, length = GEOD.inv(*first, *last)
    along = np.linspace(0.0, length, 2000)
    many = np.ones(len(along))
    line = GEOD.fwd(first[0] * many, first[1] * many, azimuth * many, along)[:2]
    for area, reach in zip(found.placed.values(), found.dimensions.reaches, strict=True):
        for east, north in shapely.get_coordinates(area)[::7]:
            away = GEOD.inv(east * many, north * many, *line)[2].min()
            assert reach <= away <= reach * 1.001 + 0.12 + 5.0 / reach


def test_buffer_grows_with_the_height() -> None:
    found = [cg.volumes([(24, 60), (24.1, 60)], height=height, **COPTER) for height in (0, 50, 99)]
    areas = [one.ground_risk_buffer.area for one in found]
    assert areas == sorted(areas)
    assert len(set(areas)) == 3


def test_heights_above_the_ground_follow_from_elevations() -> None:
    """In a valley, a flight 80 m above home is higher above the ground."""
    plan = cg.FlightPlan.along([(24.005, 60.005), (24.095, 60.005)], altitude=80)
    cells = np.array([[100.0] * 5 + [30.0] * 5])
    ground = Ground(cells, (24.0, 60.0, 24.1, 60.01))
    flat = cg.volumes(plan, **COPTER)
    assert flat.dimensions.altitude == 80.0
    assert "flat" in flat.notes()[0]
    over = cg.volumes(plan, ground=ground, **COPTER)
    assert over.dimensions.altitude == 150.0
    assert over.dimensions.buffer > flat.dimensions.buffer + 69.0
    with pytest.raises(ProblemError, match="do not cover"):
        cg.volumes(plan, ground=Ground(cells, (24.0, 60.0, 24.05, 60.01)), **COPTER)
    sea = cg.FlightPlan.along([(24.005, 60.005), (24.095, 60.005)], altitude=180, reference="sea")
    with pytest.raises(ProblemError, match="ground is not known"):
        cg.volumes(sea, **COPTER)
    assert cg.volumes(sea, ground=ground, **COPTER).dimensions.altitude == 150.0


def test_what_is_not_known_is_an_error() -> None:
    bare = cg.FlightPlan((cg.Waypoint(24, 60), cg.Waypoint(24.1, 60)))
    with pytest.raises(ProblemError, match="give height"):
        cg.volumes(bare, **COPTER)
    with pytest.raises(ProblemError, match="give height"):
        cg.volumes([(24, 60), (24.1, 60)], **COPTER)
    unknown = cg.FlightPlan((cg.Waypoint(24, 60, 80),), unknown=("it circles somewhere",))
    with pytest.raises(PlanError, match="circles somewhere"):
        cg.volumes(unknown, **COPTER)
    with pytest.raises(ProblemError, match="no path"):
        cg.volumes(cg.Solution(cg.Status.NO_PATH), altitude=80, **COPTER)


def test_circles_and_waypoints_passed_at_a_distance_are_inside() -> None:
    plan = cg.FlightPlan((cg.Waypoint(24, 60, 80), cg.Waypoint(24.02, 60, 80, loiter_radius=300)))
    found = cg.volumes(plan, **COPTER).flight_geography
    for azimuth in range(0, 360, 15):
        east, north, _ = GEOD.fwd(24.02, 60, azimuth, 300.0)
        assert found.contains(shapely.Point(east, north))
    # on its way to the circle it flies beside the straight line
    assert found.contains(shapely.Point(24.01, 60.0012))


@pytest.mark.parametrize(
    ("facts", "half"),
    [({}, 16.0), ({"dimension": 12.0}, 18.0), ({"width": 3.0}, 1.5), ({"acceptance_radius": 0.0}, 6.0)],
)
def test_flight_geography_is_as_wide_as_the_errors_of_the_position(facts: dict[str, Any], half: float) -> None:
    settings = VolumeSettings(**{**COPTER, **facts})
    assert settings.half_width == half
    assert bool(settings.notes) is (half == 1.5)


def test_corners_that_an_autopilot_may_cut_are_inside() -> None:
    """It may turn 200 m before the corner, straight to the next waypoint."""
    plan = cg.FlightPlan(
        (cg.Waypoint(24, 60, 80), cg.Waypoint(24.02, 60, 80, acceptance=200), cg.Waypoint(24.02, 60.01, 80))
    )
    found = cg.volumes(plan, **COPTER)
    turn = GEOD.fwd(24.02, 60, 270, 200.0)[:2]
    assert found.flight_geography.contains(shapely.LineString([turn, (24.02, 60.01)]).buffer(1e-5))


@pytest.mark.parametrize("start", [24.0, 179.97, -180.0])
def test_files_say_the_same_to_independent_readers(tmp_path: Path, start: float) -> None:
    turned = (start + 0.06 + 180.0) % 360.0 - 180.0
    found = cg.volumes([(start, 60.0), (turned, 60.02)], height=80, width=20, **COPTER)
    geojson = json.loads(found.save(tmp_path / "mine.geojson").read_text())
    kml = ET.parse(found.save(tmp_path / "mine.kml"))  # noqa: S314 - ours
    assert [one["properties"]["name"] for one in geojson["features"]] == [
        "flight geography", "contingency volume", "ground risk buffer",
    ]  # fmt: skip
    tops = [one["properties"]["upper"] for one in geojson["features"]]
    assert tops == [found.dimensions.geography_top, found.dimensions.contingency_top, 0.0]
    space = {"k": "http://www.opengis.net/kml/2.2"}
    marks = {one.findtext("k:name", namespaces=space): one for one in kml.iterfind(".//k:Placemark", space)}
    zones = {one.label: one for one in cg.read_zones(tmp_path / "mine.kml").zones}
    for feature, area in zip(geojson["features"], found.placed.values(), strict=True):
        written = shape(feature["geometry"])
        assert written.is_valid
        assert np.abs(shapely.get_coordinates(written)[:, 0]).max() <= 180.0
        parts = [shapely.transform(area, lambda at, by=turn: at + (by, 0.0)) for turn in (-360, 0, 360)]  # noqa: RUF005
        assert written.difference(shapely.union_all(parts)).area < 1e-12
        assert written.area == pytest.approx(area.area, rel=1e-9)
        mark = marks[feature["properties"]["name"]]
        corners = [one.split(",") for text in mark.iterfind(".//k:coordinates", space) for one in text.text.split()]
        assert len(corners) == len(shapely.get_coordinates(written))
        upper = feature["properties"]["upper"]
        assert {float(one[2]) for one in corners if len(one) > 2} == ({upper} if upper else set())
        read = zones[feature["properties"]["name"]].layers
        assert sum(one.area.area for one in read) == pytest.approx(area.area, rel=1e-6)


def test_fence_is_read_back_and_inside_of_its_volume(tmp_path: Path) -> None:
    # a ring: the flight geography has a hole
    places = [(24, 60), (24.02, 60), (24.02, 60.01), (24, 60.01), (24, 60)]
    plan = cg.FlightPlan.along(places, altitude=80)
    found = cg.volumes(plan, width=40, **COPTER)
    for which, area in zip(("flight geography", "contingency volume"), found.placed.values(), strict=False):
        fenced = cg.FlightPlan(plan.waypoints, plan.home, fence=found.fence(which))
        read = cg.read_plan(cg.write_plan(fenced, tmp_path / "mine.plan"))
        document = json.loads((tmp_path / "mine.plan").read_text())["geoFence"]
        assert [one["inclusion"] for one in document["polygons"]] == [True, False]
        inclusion, hole = (shapely.Polygon(one.shapes[0].corners) for one in read.fence)
        assert area.contains(inclusion.difference(hole))
        assert len(inclusion.exterior.coords) < 80
        assert cg.check(read).is_clean
    with pytest.raises(ProblemError, match="choose one of"):
        found.fence("ground risk buffer")


def test_areas_that_the_contingency_volume_touches_are_named() -> None:
    found = cg.volumes([(24, 60), (24.1, 60)], height=60, **COPTER)
    reach = found.dimensions.reaches[1]
    _, north, _ = GEOD.fwd(24.05, 60, 0, reach - 1.0)
    _, beyond, _ = GEOD.fwd(24.05, 60, 0, reach + 3.0)

    def zone(name: str, south: float, **limits: Limit) -> Zone:
        return Zone(name, "", "PROHIBITED", (Layer(shapely.box(24.04, south, 24.06, 60.1), **limits),))

    top = found.dimensions.contingency_top
    zones = Zones(
        (
            zone("near", north),
            zone("far", beyond),
            zone("over it", north, lower=Limit(top + 1.0, "AGL")),
            zone("in the contingency volume", north, lower=Limit(top - 1.0, "AGL")),
            zone("above the sea", north, lower=Limit(900.0, "AMSL")),
        )
    )
    ground = Ground(np.full((2, 2), 100.0), (23.9, 59.9, 24.2, 60.2))
    names = [one.name for one in touched_areas(found, zones=zones)]
    assert names == ["near", "in the contingency volume", "above the sea"]
    assert [one.name for one in touched_areas(found, zones=zones, ground=ground)] == names[:2]


def test_areas_of_a_map_count_too() -> None:
    problem = cg.Problem((0, 0), (1000, 0), bounds=(-500, -500, 1500, 500), no_fly=shapely.box(400, 30, 600, 90))
    found = cg.volumes(cg.solve(problem, "straight-line"), altitude=60, **COPTER)
    assert [str(one) for one in touched_areas(found, PlainMap("map", "", problem))] == ["no-fly area 0"]


def test_volumes_in_the_plane_have_exact_sizes_and_no_files(tmp_path: Path) -> None:
    problem = cg.Problem((0, 0), (1000, 0), bounds=(-500, -500, 1500, 500))
    found = cg.volumes(cg.solve(problem, "straight-line"), height=60, **COPTER)
    for area, reach in zip(found.placed.values(), found.dimensions.reaches, strict=True):
        assert area.bounds[3] == pytest.approx(reach, rel=4e-4)
        assert area.contains(shapely.LineString([(0, 0), (1000, 0)]).buffer(0.999999 * reach, 500))
    with pytest.raises(OutputError, match="in the plane"):
        found.save(tmp_path / "mine.kml")
    with pytest.raises(ProblemError, match="in the plane"):
        found.fence()
    with pytest.raises(OutputError, match="ends in"):
        found.save(tmp_path / "mine.shp")


@given(
    st.lists(st.lists(st.one_of(st.floats(0, 1e5), st.just(math.nan)), min_size=4, max_size=4), min_size=3, max_size=3),
    st.floats(-20, 110), st.floats(-20, 90), st.floats(0.1, 40), st.sampled_from(["upper", "lower"]),
)  # fmt: skip
def test_density_is_that_of_the_cells_touched(
    values: list[list[float]], x: float, y: float, radius: float, origin: Origin
) -> None:
    cells = np.array(values)
    if np.isnan(cells).all():
        return
    raster = cg.RasterRisk(cells, bounds=(0, 0, 100, 75), nodata=7.0, origin=origin)
    area = shapely.Point(x, y).buffer(radius)
    upright = cells[::-1] if origin == "upper" else cells
    boxes = [(shapely.box(25 * j, 25 * i, 25 * j + 25, 25 * i + 25), upright[i, j]) for i in range(3) for j in range(4)]
    touched = [value for box, value in boxes if box.intersects(area)]
    stands = [7.0 if math.isnan(value) else value for value in touched]
    found = density_under(area, raster)
    outside = not shapely.box(0, 0, 100, 75).covers(area)
    has_gaps = any(map(math.isnan, touched))
    assert (found.is_known, found.filled) == (not outside, 7.0 if has_gaps else None)
    assert found.greatest == pytest.approx(max(stands, default=math.nan), nan_ok=True)
    assert ("cells without data count as 7" in str(found)) is has_gaps
    filled = density_under(area, raster, without_data=50.0)
    assert filled.is_known
    given = [50.0 if math.isnan(value) else value for value in touched]
    assert filled.greatest == max([*given, *([50.0] if outside else [])])


def test_classes_are_those_of_the_table() -> None:
    """Row by row, at the ends of each band and of each column."""
    expected: list[list[int | None]] = [[2, 3, 4, 5, 6], [3, 4, 5, 6, 7], [4, 5, 6, 7, 8], [5, 6, 7, 8, 9]]
    expected += [[6, 7, 8, 9, 10], [7, 8, None, None, None]]
    bands = [(0.0, 4.999), (5.0, 49.999), (50.0, 499.9), (500.0, 4999.0), (5000.0, 49_999.0), (50_000.0, 1e6)]
    for row, band in zip(expected, bands, strict=True):
        for density in band:
            found = [intrinsic_class(Density(density), dimension=wide, speed=fast).value for wide, fast in COLUMNS]
            assert found == row
    kept = [intrinsic_class(Density(9e9), dimension=wide, speed=fast, controlled=True) for wide, fast in COLUMNS]
    assert [one.value for one in kept] == [1, 1, 2, 3, 3]
    # the first column in which both fit
    assert intrinsic_class(Density(1.0), dimension=0.5, speed=25.1).value == 3
    assert intrinsic_class(Density(1.0), dimension=1.01, speed=5).value == 3
    beyond = intrinsic_class(Density(1.0), dimension=41, speed=5)
    assert beyond.value is None
    assert "ends at 40 m" in str(beyond)


def test_unknown_density_is_never_a_class() -> None:
    problem = cg.Problem((0, 0), (1000, 0), bounds=(-500, -500, 1500, 500))
    found = cg.volumes(cg.solve(problem, "straight-line"), height=60, **COPTER)
    missing = np.full((10, 20), 3.0)
    missing[5, 3] = np.nan
    for people in (
        None,
        cg.RasterRisk(missing, (-500, -500, 1500, 500), nodata=0.0, covers=shapely.box(-500, -500, 900, 500)),
        cg.RasterRisk(np.full((10, 20), 3.0), (-500, -500, 1050, 500)),
    ):
        below = found.people_below(people)
        assert below.ground_risk_class.value is None
        assert "not known" in str(below.ground_risk_class)
        assert below.document()["intrinsic_ground_risk_class"]["value"] is None
    whole = cg.RasterRisk(np.full((10, 20), 3.0), (-500, -500, 1500, 500))
    assert found.people_below(whole).ground_risk_class.value == 2
    town = np.full((100, 200), 3.0)
    town[:, 159] = 700.0  # under the ground risk buffer beyond the goal only
    below = found.people_below(cg.RasterRisk(town, (-500, -500, 1500, 500)))
    assert (below.operational.greatest, below.buffer.greatest) == (3.0, 700.0)
    assert below.ground_risk_class.value == 5


def test_beyond_the_data_of_a_raster_in_degrees_is_unknown(tmp_path: Path) -> None:
    """In metres, the raster is narrower in the north: beyond its edge, there are no data."""
    np.savetxt(tmp_path / "people.csv", np.full((40, 40), 1000.0), delimiter=",")
    people = cg.RasterRisk.from_file(
        tmp_path / "people.csv", bounds=(20, 60, 24, 64), coordinates="lonlat", unit="people/km2"
    )
    x_min, _, _, y_max = people.bounds
    assert not density_under(shapely.Point(x_min + 3000, y_max - 3000).buffer(100), people).is_known
    inside = density_under(shapely.Point(0, 0).buffer(100), people)
    assert inside.is_known
    assert inside.greatest == pytest.approx(1000.0, rel=0.01)
    edge = density_under(shapely.Point(x_min + 14_500, y_max - 60_000).buffer(5), people)
    assert not edge.is_known or edge.greatest > 990.0


def test_settings_are_given_once() -> None:
    facts = VolumeSettings(**COPTER)
    again = cg.volumes([(24, 60)], facts, height=60)
    assert again.dimensions == cg.volumes([(24, 60)], height=60, **COPTER).dimensions
    with pytest.raises(CglaError, match="both given"):
        cg.volumes([(24, 60)], facts, height=60, speed=3)


def test_a_plan_above_ground_is_as_high_as_its_straight_legs() -> None:
    ground = Ground(np.array([[300.0, 300.0, 0.0, 0.0, 0.0, 0.0, 300.0, 300.0]]), (24.0, 60.0, 24.08, 60.02))
    plan = cg.FlightPlan.along([(24.005, 60.01), (24.075, 60.01)], altitude=80, reference="ground")
    size = {"speed": 15, "dimension": 0.8, "pitch": 30}
    assert cg.volumes(plan, **size).dimensions.altitude == 80.0
    assert cg.volumes(plan, ground=ground, **size).dimensions.altitude == pytest.approx(380.0, abs=0.1)
    flat = Ground(np.full((1, 8), 9.0), ground.bounds)
    assert cg.volumes(plan, ground=flat, **size).dimensions.altitude == pytest.approx(80.0, abs=1e-6)

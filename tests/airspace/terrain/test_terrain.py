"""Terrain as a no-fly area, heights of legs above the ground, and both together: a plan around a hill is clean."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from pyproj import Geod
from scipy.ndimage import map_coordinates
from strategies import few, seeds

import cgla_graph as cg
from cgla_graph._types import Bounds, FloatArray
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Reference, Waypoint
from cgla_graph.airspace.plan_check.check import check
from cgla_graph.airspace.terrain.area import terrain_area
from cgla_graph.airspace.terrain.legs import LegsAboveGround
from cgla_graph.airspace.zones.applying import Zones
from cgla_graph.airspace.zones.ground import Ground, read_ground
from cgla_graph.errors import CglaError, ProblemError

#: A raster of 30 by 20 cells, about 110 by 110 m each.
BOX: Bounds = (24.0, 60.0, 24.06, 60.02)
SHAPE = (20, 30)
#: Samples of a leg.
FINE = 4001
ELLIPSOID = Geod(ellps="WGS84")


def random_ground(seed: int, *, unknown: float = 0.0, high: float = 200.0, west: float = 24.0) -> Ground:
    random = np.random.default_rng(seed)
    values = random.uniform(0.0, high, SHAPE)
    values[random.uniform(size=SHAPE) < unknown] = np.nan
    return Ground(values, (west, 60.0, west + 0.06, 60.02))


def write_asc(file: Path, values: FloatArray, box: Bounds) -> Path:
    size = (box[2] - box[0]) / values.shape[1], (box[3] - box[1]) / values.shape[0]
    head = f"ncols {values.shape[1]}\nnrows {values.shape[0]}\nxllcorner {box[0]}\nyllcorner {box[1]}\n"
    rows = "\n".join(" ".join(map(repr, row)) for row in np.where(np.isnan(values), -9999.0, values).tolist())
    file.write_text(f"{head}dx {size[0]}\ndy {size[1]}\nnodata_value -9999\n{rows}\n")
    return file


def cells_of(ground: Ground, lonlat: FloatArray) -> FloatArray:
    """Return rows and columns of places, counted between centres."""
    west, _, _, north = ground.bounds
    return np.array([(north - lonlat[:, 1]) / ground.cell[1] - 0.5, (lonlat[:, 0] - west) / ground.cell[0] - 0.5])


def around(ground: Ground, lonlat: FloatArray) -> FloatArray:
    """Return the greatest elevation of each place's cell and its neighbours, NaN where one is unknown."""
    rows, columns = np.floor(cells_of(ground, lonlat) + 0.5).astype(int)
    found = []
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        seen = ground.values[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        inside = 0 <= row < SHAPE[0] and 0 <= column < SHAPE[1]
        found.append(seen.max() if inside else math.nan)
    return np.array(found)


def between(ground: Ground, lonlat: FloatArray) -> FloatArray:
    """Return elevations linear between centres (scipy)."""
    return np.asarray(map_coordinates(ground.values, cells_of(ground, lonlat), order=1, mode="nearest"))


def around_rounded(ground: Ground, lonlat: FloatArray) -> FloatArray:
    """Return the least of `around` at places up to 11 mm away: at the edge of cells, the cells of either side count."""
    aside = 0.011 / np.array([111_000.0 * math.cos(math.radians(60.0)), 111_000.0])
    shifts = aside * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
    return np.asarray(np.min([around(ground, lonlat + shift) for shift in shifts], axis=0))


def line(plan: FlightPlan, leg: int) -> FloatArray:
    """Return fine samples of a leg on the ellipsoid (pyproj); straight in degrees, they would be decimetres off."""
    (x, y), after = plan.points[leg : leg + 2].tolist()
    azimuth, _, length = ELLIPSOID.inv(x, y, *after)
    found = ELLIPSOID.fwd([x] * FINE, [y] * FINE, [azimuth] * FINE, np.linspace(0.0, length, FINE))
    return np.column_stack(found[:2])


def terrain_of(plan: FlightPlan, ground: Ground, **settings: object) -> LegsAboveGround:
    found = check(plan, ground=ground, tolerance=None, **settings).terrain  # type: ignore[arg-type]
    assert found is not None
    return found


@given(seeds, st.floats(20.0, 260.0), st.floats(0.0, 60.0))
def test_a_cell_is_closed_if_a_flight_is_not_above_it_and_its_neighbours(seed: int, height: float, keep: float) -> None:
    ground = random_ground(seed, unknown=0.05)
    box = (23.99, 59.995, 24.05, 60.015)
    area = terrain_area(ground, f"{height} AMSL", box, clearance=keep)
    places = np.random.default_rng(seed).uniform(box[:2], box[2:], (300, 2))
    below = around(ground, places)

    closed = np.isnan(below) | (below + keep > height)

    assert (shapely.intersects_xy(area.shape, places) == closed).all() if area.shape else not closed.any()
    assert area.outside


@pytest.mark.parametrize(("altitude", "lowest"), [("80 AMSL", 80.0), ("80 WGS84", -28.0), ("80 HOME", 90.0)])
def test_heights_above_anything_count_by_the_least_they_may_be_above_the_sea(altitude: str, lowest: float) -> None:
    ground = Ground(np.full(SHAPE, 10.0), BOX)

    assert terrain_area(ground, altitude, BOX, homes=[(24.03, 60.01)]).lowest == lowest


def test_a_flight_above_ground_closes_nothing_but_has_to_be_above_the_clearance() -> None:
    ground = random_ground(0)
    assert terrain_area(ground, 80, BOX).shape is None
    with pytest.raises(ProblemError, match="20 m above ground, and the terrain clearance is 30 m"):
        terrain_area(ground, 20, BOX)
    with pytest.raises(ProblemError, match="elevation of home is not known"):
        terrain_area(ground, "80 HOME", BOX)
    with pytest.raises(ProblemError, match="terrain_clearance"):
        terrain_area(ground, 80, BOX, clearance=-1.0)


@few
@given(seeds, st.sampled_from(["sea", "ground", "home", "ellipsoid"]))
@example(2020, "sea")
@example(0, "ground")
def test_the_height_of_a_leg_is_that_of_fine_samples(seed: int, reference: Reference) -> None:
    random = np.random.default_rng(seed)
    ground = random_ground(seed)
    ends = random.uniform((24.001, 60.001), (24.059, 60.019), (2, 2))
    heights = random.uniform(100.0, 400.0, 2)
    plan = FlightPlan(
        tuple(Waypoint(x, y, height, reference) for (x, y), height in zip(ends.tolist(), heights, strict=True)),
        Home(*ends[0], 50.0) if reference == "home" else None,
    )
    found = terrain_of(plan, ground)
    lonlat = line(plan, 0)
    flown = np.linspace(*heights, FINE)
    if reference == "ground":
        level = between(ground, lonlat)
        straight = np.linspace(*(level[[0, -1]] + heights), FINE) - level
        least = min(straight.min(), heights.min())
        assert found.least[0] == pytest.approx(least, abs=0.5)
        assert found.least[0] <= least + 1e-3
        return
    home = min(50.0, float(np.nanmin(ground.values))) if reference == "home" else 0.0
    lowest = flown + {"sea": 0.0, "ellipsoid": -108.0, "home": home}[reference]
    assert (
        found.least[0]
        <= (flown + {"sea": 0.0, "ellipsoid": -108.0, "home": 50.0}[reference] - around_rounded(ground, lonlat)).min()
        + 1e-3
    )
    if reference != "home":
        # (a sample in a corner may be missed)
        assert found.least[0] >= (lowest - np.nanmax(ground.values)).min()


@few
@given(seeds)
def test_a_plan_along_the_border_of_closed_cells_is_clean(seed: int) -> None:
    values = np.random.default_rng(seed).choice([0.0, 100.0], SHAPE, p=[0.9, 0.1])
    ground = Ground(values, BOX)
    area = terrain_area(ground, "120 AMSL", BOX).shape
    assert area is not None
    tested = 0
    for ring in shapely.get_rings(shapely.get_parts(area)).tolist():
        corners = np.array(ring.coords)
        for ends in np.stack([corners[:-1], corners[1:]], axis=1)[:2]:
            # (a longer line would be a centimetre off a parallel)
            most = min(0.99, 0.005 / np.abs(ends[1] - ends[0]).max())
            first, last = (ends[0] + share * (ends[1] - ends[0]) for share in (0.01, most))
            if np.isclose(ends[0], ends[1]).any() and not np.isin(np.round(ends, 9), BOX).any():
                plan = FlightPlan(tuple(Waypoint(x, y, 120.0, "sea") for x, y in (first.tolist(), last.tolist())))
                assert check(plan, ground=ground, tolerance=None).is_clean
                tested += 1
    assert tested


def test_a_ridge_narrower_than_a_leg_is_seen() -> None:
    values = np.zeros(SHAPE)
    values[:, 15] = 300.0
    plan = FlightPlan(tuple(Waypoint(x, 60.01, 80.0, "sea") for x in (24.001, 24.059)))

    found = check(plan, ground=Ground(values, BOX))

    assert not found.is_clean
    assert found.terrain is not None
    assert found.terrain.least.tolist() == [-220.0]
    assert found.legs[0].number == 1
    assert found.document()["legs"][0]["above_ground"] == -220.0
    assert found.document()["terrain"]["low"] == [1]


@pytest.mark.parametrize("reference", ["sea", "ground"])
def test_what_is_not_known_is_not_clean(reference: Reference) -> None:
    values = np.zeros(SHAPE)
    values[10, 15] = np.nan
    over = FlightPlan(tuple(Waypoint(x, 60.0095, 80.0, reference) for x in (24.001, 24.059)))
    beyond = FlightPlan(tuple(Waypoint(x, 60.004, 80.0, reference) for x in (24.001, 24.08)))
    for plan in (over, beyond):
        found = check(plan, ground=Ground(values, BOX), tolerance=None)
        assert not found.is_clean
        assert "no elevation is known there: give a raster" in found.verdict[0]


def test_a_plan_without_altitudes_is_not_clean_over_terrain_unless_one_is_given() -> None:
    ground = Ground(np.zeros(SHAPE), BOX)
    places = [(24.01, 60.01), (24.05, 60.01)]

    assert "the plan has no altitude there: give its altitude" in check(places, ground=ground).verdict[0]
    assert check(places, ground=ground, altitude="80 AMSL").is_clean
    assert not check(places, ground=ground, altitude="20 AMSL").is_clean
    assert check(places, ground=ground, altitude=80).is_clean
    assert not check(places, ground=ground, altitude=20).is_clean
    assert check(places, ground=ground, altitude=20, terrain_clearance=15).is_clean
    with pytest.raises(CglaError, match="there are no elevations"):
        check(places, zones=ZONES, terrain_clearance=15)


ZONES = Zones(())


def test_own_altitudes_count_above_terrain_even_where_one_is_given_for_zones() -> None:
    ground = Ground(np.zeros(SHAPE), BOX)
    plan = FlightPlan(tuple(Waypoint(x, 60.01, 10.0, "sea") for x in (24.01, 24.05)))

    assert not check(plan, ground=ground, altitude="80 AMSL").is_clean


def test_circles_and_waypoints_passed_at_a_distance_count_the_ground_beside_the_leg() -> None:
    values = np.zeros(SHAPE)
    values[4, 15] = 300.0
    ground = Ground(values, BOX)
    plan = FlightPlan(tuple(Waypoint(x, 60.01, 80.0, "sea") for x in (24.01, 24.031, 24.05)))
    assert check(plan, ground=ground, tolerance=None).is_clean
    for reach in ({"loiter_radius": 700.0}, {"pass_radius": 700.0}):
        middle = dataclasses.replace(plan.waypoints[1], **reach)
        wide = dataclasses.replace(plan, waypoints=(plan.waypoints[0], middle, plan.waypoints[2]))
        found = terrain_of(wide, ground)
        assert found.low.any()


def test_a_plan_that_goes_down_above_one_place_is_too_low_there() -> None:
    ground = Ground(np.zeros(SHAPE), BOX)
    heights = [(24.01, 80.0), (24.03, 80.0), (24.03, 10.0), (24.03, 80.0), (24.05, 80.0)]
    plan = FlightPlan(tuple(Waypoint(x, 60.01, high, "sea") for x, high in heights))

    assert terrain_of(plan, ground).least.tolist() == [10.0, 80.0]


def test_a_climb_from_home_may_be_straight_and_must_not_meet_a_ridge_below_the_altitude() -> None:
    values = np.zeros(SHAPE)
    ground = Ground(values, BOX)
    plan = FlightPlan((Waypoint(24.05, 60.01, 100.0, "home"),), Home(24.005, 60.01))
    assert terrain_of(plan, ground).least.tolist() == [100.0]
    values[:, 10] = 60.0
    found = terrain_of(plan, Ground(values, BOX))
    assert found.low.tolist() == [True]


@pytest.mark.parametrize("west", [179.97, -180.03])
def test_terrain_counts_across_the_antimeridian(west: float) -> None:
    values = np.zeros(SHAPE)
    values[:, 20] = 300.0
    ground = Ground(values, (west, 60.0, west + 0.06, 60.02))
    plan = FlightPlan((Waypoint(179.975, 60.01, 80.0, "sea"), Waypoint(-179.975, 60.01, 80.0, "sea")))

    assert terrain_of(plan, ground).least.tolist() == [-220.0]
    # (the antimeridian is not where pieces of these legs end)
    for reference in ("sea", "ground"):
        ends = (Waypoint(179.97531, 60.003, 80.0, reference), Waypoint(-179.99317, 60.0021, 80.0, reference))
        found = terrain_of(FlightPlan(ends), ground)
        assert (found.least.tolist(), found.reasons) == ([80.0], ("",))
    area = terrain_area(ground, "80 AMSL", (179.971, 60.001, 180.029, 60.019))
    assert area.shape is not None
    assert area.shape.bounds == pytest.approx((180.008, 60.001, 180.014, 60.019))


def test_a_raster_around_the_earth_has_no_edge_at_the_antimeridian() -> None:
    values = np.zeros((18, 36))
    values[9, 0] = 300.0
    ground = Ground(values, (-180.0, -90.0, 180.0, 90.0))

    area = terrain_area(ground, "80 AMSL", (160.0, -20.0, 200.0, 20.0))
    assert area.shape is not None
    assert area.shape.bounds == (170.0, -20.0, 200.0, 10.0)
    assert not area.outside


MAP = """
coordinates = "lonlat"
start = [24.004, 60.01]
goal = [24.056, 60.01]
k = 0
bounds = [24.001, 60.001, 24.059, 60.019]
"""


@pytest.fixture
def hill(tmp_path: Path) -> Path:
    """Write a hill of 300 m in the middle of the map, and the map."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    write_asc(tmp_path / "hill.asc", 300.0 * np.exp(-(((x - 14.5) / 3.0) ** 2 + ((y - 9.5) / 2.0) ** 2)), BOX)
    (tmp_path / "map.toml").write_text(MAP)
    return tmp_path


@pytest.mark.parametrize("altitude", ["80 AMSL", "80 HOME", "150 WGS84"])
def test_a_path_around_a_hill_is_clean_as_a_plan_with_the_proof_of_its_map(hill: Path, altitude: str) -> None:
    around = cg.load_scenario(hill / "map.toml", zones={"ground": hill / "hill.asc", "altitude": altitude})

    found = cg.solve(around.problem, "hybrid", tolerance=0.01)

    assert around.terrain is not None
    assert around.terrain.closed > 0
    assert found.lower_bound > math.dist(around.problem.start, around.problem.goal)
    metres, reference = altitude.split()
    words: dict[str, Reference] = {"AMSL": "sea", "HOME": "home", "WGS84": "ellipsoid"}
    plan = FlightPlan.along(found.lonlat, altitude=float(metres), reference=words[reference])
    assert check(plan, ground=read_ground(hill / "hill.asc"), tolerance=None).is_clean
    ends = found.lonlat[[0, -1]]
    flat = FlightPlan.along(ends, altitude=float(metres), reference=words[reference])
    assert not check(flat, ground=hill / "hill.asc", tolerance=None).is_clean


def test_settings_of_terrain_that_make_no_sense_are_refused(hill: Path) -> None:
    for settings, words in (
        ({"terrain_clearance": 30.0}, "there is no raster of elevations; give one"),
        ({"terrain_clearance": 30.0, "ground": hill / "hill.asc"}, "the flight has no altitude; give one"),
        ({"altitude": "20 AMSL", "ground": hill / "hill.asc"}, "start .* is in the terrain of hill.asc"),
        ({"altitude": 20, "ground": hill / "hill.asc"}, "the terrain clearance is 30 m; fly higher"),
    ):
        with pytest.raises(CglaError, match=words):
            cg.load_scenario(hill / "map.toml", zones=settings)


def test_the_uavs_of_a_mission_fly_around_terrain(hill: Path) -> None:
    uavs = "".join(
        f"[[uavs]]\nname = '{name}'\nstart = {start}\ngoal = {goal}\n"
        for name, start, goal in (("a", [24.004, 60.01], [24.056, 60.01]), ("b", [24.03, 60.002], [24.03, 60.018]))
    )
    head = MAP.partition("start")[0] + "bounds = [24.001, 60.001, 24.059, 60.019]\ndetection_radius = 300\nstep = 200\n"
    (hill / "mission.toml").write_text(
        f"{head}{uavs}[no_fly]\nground = 'hill.asc'\naltitude = '80 HOME'\nterrain_clearance = 40\n"
    )
    opened = cg.load_mission(hill / "mission.toml")
    lower = cg.load_mission(hill / "mission.toml", terrain={"terrain_altitude": "60 AMSL"})

    assert opened.terrain is not None
    assert lower.terrain is not None
    assert lower.world.no_fly.area > opened.world.no_fly.area > 0.0
    flight = opened.missions(cg.solvers.get)[""].fly()
    assert flight.all_arrived
    for uav in flight.uavs.values():
        plan = FlightPlan.along(opened.projection.inverse(uav.path), altitude=80.0)
        assert check(plan, ground=hill / "hill.asc", terrain_clearance=40, tolerance=None).is_clean


def test_a_cut_corner_meets_a_tower_that_the_legs_do_not() -> None:
    values = np.zeros(SHAPE)
    values[8, 12] = 300.0
    ground = Ground(values, BOX)
    corner = ((24.010, 60.0065), (24.0305, 60.0065), (24.0305, 60.018))
    points = [Waypoint(x, y, 80.0, "sea") for x, y in corner]
    plan = FlightPlan(tuple(points))
    cut = dataclasses.replace(plan, waypoints=(points[0], dataclasses.replace(points[1], acceptance=600.0), points[2]))

    assert terrain_of(plan, ground).least.tolist() == [80.0, 80.0]
    assert terrain_of(cut, ground).low.tolist() == [False, True]


def test_the_elevations_of_a_map_hold_for_plans_that_are_checked_on_it(hill: Path) -> None:
    (hill / "map.toml").write_text(
        f"{MAP}[no_fly]\nground = 'hill.asc'\naltitude = '400 AMSL'\nterrain_clearance = 40\n"
    )
    on = cg.load_scenario(hill / "map.toml")
    places = [(24.004, 60.01), (24.056, 60.01)]

    # above the altitude of the map, and below it
    for altitude, clean in ((400.0, True), (310.0, False), (80.0, False)):
        found = check(FlightPlan.along(places, altitude=altitude, reference="sea"), on, tolerance=None)
        assert found.is_clean is clean
        assert found.terrain is not None
        assert found.terrain.clearance == 40.0
    assert check(places, on, tolerance=None).is_clean
    assert not check(places, on, terrain_clearance=150.0, tolerance=None).is_clean

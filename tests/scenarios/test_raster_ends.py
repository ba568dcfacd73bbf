"""Scenarios over rasters in any coordinates: ends in degrees or the raster's own, and bounds that hold on the Earth."""

import json
import warnings
from pathlib import Path

import numpy as np
import pyproj
import pytest
from raster_files import geotiff, laid_at

import cgla_graph as cg
from cgla_graph.comparisons.live.draft import LiveMap
from cgla_graph.comparisons.study.documents import scenario_document, scenario_from
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.model.rasters.crs import CrsPlane, RasterWarning
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.scenario import Scenario, load_scenario
from cgla_graph.scenarios.writing import write_scenario

pytest.importorskip("rasterio")
START, GOAL = (24.92, 59.97), (25.09, 60.04)
GEOD = pyproj.Geod(ellps="WGS84")


def opened(path: Path, **how: object) -> Scenario:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RasterWarning)
        (scenario,) = open_scenarios(str(path), **{"start": START, "goal": GOAL, **how})  # type: ignore[arg-type]
    return scenario


def own(crs: str, *places: tuple[float, float]) -> list[tuple[float, float]]:
    there = pyproj.Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    return [there.transform(*place) for place in places]


@pytest.mark.parametrize("crs", ["EPSG:32635", "EPSG:3067", "EPSG:3857", "ESRI:54009", "EPSG:32630", "EPSG:3395"])
def test_ends_are_read_in_either_coordinates(crs: str, tmp_path: Path) -> None:
    """The same way, as long as the geodesic, and a bound that is below it."""
    file, _ = laid_at(tmp_path / "a.tif", crs, 25.0, 60.0, half=18e3)
    start, goal = own(crs, START, GOAL)
    expected = GEOD.inv(*START, *GOAL)[2]
    for ends in ({}, {"start": start, "goal": goal}):
        problem = opened(file, k=0.0, **ends).problem
        assert problem.projection is not None
        assert problem.projection.inverse([problem.start, problem.goal]) == pytest.approx(np.array([START, GOAL]))
        straight = problem.evaluate([problem.start, problem.goal])
        assert straight.length == pytest.approx(expected, rel=1e-3)
        proven = cg.lower_bound(problem).lower_bound
        assert 0.99 * expected < proven <= min(expected, straight.length)
        assert isinstance(problem.projection, CrsPlane) is (crs in {"EPSG:32635", "EPSG:3067"})


def test_the_reading_is_said(tmp_path: Path) -> None:
    file, _ = laid_at(tmp_path / "a.tif", "EPSG:32635", 25.0, 60.0)
    with pytest.warns(RasterWarning, match=r"a\.tif: start and goal are read as longitude and latitude"):
        list(open_scenarios(str(file), start=START, goal=GOAL))
    with pytest.raises(ScenarioError, match=r"outside of the raster, which lies at .* in longitude and latitude; give"):
        opened(file, start=(24.0, 60.0))
    (start,) = own("EPSG:32635", START)
    with pytest.raises(ScenarioError, match=r"goal .* outside"):
        opened(file, start=start, goal=(380e3, 6.0e6))
    # a system whose origin is within the raster, and small: both readings are possible
    local = "+proj=tmerc +lat_0=1 +lon_0=1 +ellps=WGS84"
    geotiff(tmp_path / "b.tif", np.ones((20, 20)), -2e5, 2e5, 2e4, local)
    with pytest.raises(ScenarioError, match="in longitude and latitude; warp it to one of them"):
        opened(tmp_path / "b.tif", start=(0.5, 0.5), goal=(1.5, 1.5))


def test_bounds_follow_the_ends(tmp_path: Path) -> None:
    file, _ = laid_at(tmp_path / "a.tif", "EPSG:32635", 25.0, 60.0)
    problem = opened(file, bounds=(24.9, 59.95, 25.1, 60.05)).problem
    west, south, east, north = problem.bounds
    for x, y in own("EPSG:32635", (24.9, 59.95), (25.1, 59.95), (25.1, 60.05), (24.9, 60.05)):
        assert west - 1e-6 <= x <= east + 1e-6
        assert south - 1e-6 <= y <= north + 1e-6
    with pytest.raises(ScenarioError, match="give both in degrees"):
        opened(file, bounds=(380e3, 6.64e6, 396e3, 6.66e6))


def test_zones_lie_over_any_raster(tmp_path: Path) -> None:
    ring = [[24.98, 59.98], [25.02, 59.98], [25.02, 60.02], [24.98, 60.02], [24.98, 59.98]]
    (tmp_path / "areas.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    areas = []
    for crs in ("EPSG:32635", "EPSG:3857", "EPSG:4326"):
        file, _ = laid_at(tmp_path / "a.tif", crs, 25.0, 60.0, half=18e3)
        start, goal = own(crs, START, GOAL)
        problem = opened(file, start=start, goal=goal, no_fly=[tmp_path / "areas.geojson"]).problem
        assert not problem.evaluate([problem.start, problem.goal]).feasible
        areas.append(problem.model.area.geometry.area)
    assert areas == pytest.approx([areas[0]] * 3, rel=1e-6)


def test_files_hold_the_plane(tmp_path: Path) -> None:
    """A scenario, written and read, and the document that workers get, are on the same place of the Earth."""
    file, _ = laid_at(tmp_path / "a.tif", "EPSG:32635", 25.0, 60.0)
    scenario = opened(file)
    again = load_scenario(write_scenario(scenario, tmp_path / "again.toml"))
    copied = scenario_from(scenario_document(scenario))
    for other in (again, copied):
        assert isinstance(other.projection, CrsPlane)
        assert other.projection.inverse(scenario.problem.goal) == pytest.approx(np.array(GOAL))
        assert other.projection.greatest == pytest.approx(scenario.projection.greatest)  # type: ignore[union-attr]
    assert copied.projection == scenario.projection


def test_what_a_raster_says_nothing_of_stays_unknown_in_a_written_file(tmp_path: Path) -> None:
    """Laid from Mollweide, it lies askew: its corners and its greatest densities are kept."""
    file, _ = laid_at(tmp_path / "a.tif", "ESRI:54009", 25.0, 60.0)
    scenario = opened(file)
    (raster,) = scenario.problem.field.rasters
    assert raster.covers is not None
    assert raster.peaks is not None
    (again,) = load_scenario(write_scenario(scenario, tmp_path / "again.toml")).problem.field.rasters
    assert again.covers is not None
    assert again.covers.equals(raster.covers)
    np.testing.assert_array_equal(again.highest, raster.highest)
    np.testing.assert_array_equal(again.cells, raster.cells)
    text = (tmp_path / "again.toml").read_text(encoding="utf-8")
    (tmp_path / "bad.toml").write_text(text.replace('covers = "POLYGON', 'covers = "POLYGOON'), encoding="utf-8")
    with pytest.raises(CglaError, match="no WKT of an area"):
        load_scenario(tmp_path / "bad.toml")


def test_files_name_rasters_in_any_coordinates(tmp_path: Path) -> None:
    laid_at(tmp_path / "utm.tif", "EPSG:32635", 25.0, 60.0)
    laid_at(tmp_path / "mercator.tif", "EPSG:3857", 25.0, 60.0, half=16e3)
    laid_at(tmp_path / "next.tif", "EPSG:32636", 25.0, 60.0)
    degrees = f'coordinates = "lonlat"\nstart = {list(START)}\ngoal = {list(GOAL)}\nk = 1\n'
    both = "".join(f'[[rasters]]\nfile = "{name}.tif"\n' for name in ("utm", "mercator"))
    (tmp_path / "a.toml").write_text(degrees + both)
    field = load_scenario(tmp_path / "a.toml").problem.field
    assert [raster.density((0.0, 0.0)) for raster in field.rasters] == pytest.approx([4.3] * 2, rel=0.05)
    (tmp_path / "b.toml").write_text(degrees.split("\n", 1)[1] + both)
    with pytest.raises(ScenarioError, match=r'rasters.1: .*no metres.*coordinates = "lonlat"'):
        load_scenario(tmp_path / "b.toml")
    plane = degrees.split("\n", 1)[1] + '[[rasters]]\nfile = "utm.tif"\n'
    (tmp_path / "c.toml").write_text(plane)
    with pytest.warns(RasterWarning, match="read as longitude"):
        assert isinstance(load_scenario(tmp_path / "c.toml").projection, CrsPlane)
    (tmp_path / "d.toml").write_text(plane + '[[rasters]]\nfile = "next.tif"\n')
    with pytest.raises(ScenarioError, match=r"rasters.0 is in .*35N, and rasters.1 in .*36N; warp one"):
        load_scenario(tmp_path / "d.toml")
    (tmp_path / "e.toml").write_text("projection_origin = [25, 60]\n" + plane)
    with pytest.warns(RasterWarning), pytest.raises(ScenarioError, match="both say where the map is"):
        load_scenario(tmp_path / "e.toml")
    (start, goal) = own("EPSG:32635", START, GOAL)
    (tmp_path / "f.toml").write_text(
        f'crs = "EPSG:32635"\nbounds = [37e4, 664e4, 40e4, 667e4]\nstart = {list(start)}\ngoal = {list(goal)}\nk = 1\n'
    )
    assert load_scenario(tmp_path / "f.toml").projection.inverse(start) == pytest.approx(np.array(START))  # type: ignore[union-attr]


def test_the_page_shows_the_coordinates_of_a_plane(tmp_path: Path) -> None:
    """It knows no other projection than that around an origin."""
    laid_at(tmp_path / "utm.tif", "EPSG:32635", 25.0, 60.0)
    (tmp_path / "a.toml").write_text(
        f'start = {list(START)}\ngoal = {list(GOAL)}\nk = 1\n[[rasters]]\nfile = "utm.tif"\n'
    )
    with pytest.warns(RasterWarning):
        live = LiveMap.open(str(tmp_path / "a.toml"))
    assert live.document["origin"] is None
    assert not live.document["degrees"]
    assert live.document["unit"] == "m"
    assert live.first.start == pytest.approx(own("EPSG:32635", START)[0])


def test_missions_fly_over_planes(tmp_path: Path) -> None:
    laid_at(tmp_path / "utm.tif", "EPSG:32635", 25.0, 60.0)
    start, goal = own("EPSG:32635", START, GOAL)
    text = f'detection_radius = 500\nk = 1\nuavs = [{{name = "a", start = {list(start)}, goal = {list(goal)}}}]\n'
    (tmp_path / "m.toml").write_text(text + '[[rasters]]\nfile = "utm.tif"\n')
    assert isinstance(load_mission(tmp_path / "m.toml").projection, CrsPlane)

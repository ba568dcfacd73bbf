"""Rasters of scenario and mission files, and rasters that are scenarios by themselves."""

import json
from pathlib import Path

import numpy as np
import pytest

from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.scenarios.loading import open_scenarios, raster_scenario
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.scenario import load_scenario, scenario_from_toml, schema

ASC = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 20\ncellsize 10\n1 2 3\n4 5 6\n"
PLANE = 'start = [12, 22]\ngoal = [38, 38]\nk = 3\n[[rasters]]\nfile = "a.asc"\n'
LONLAT = """
coordinates = "lonlat"
start = [24.91, 60.11]
goal = [25.09, 60.19]
k = 3
[[rasters]]
file = "a.npy"
kind = "count"
bounds = [24.9, 60.1, 25.1, 60.2]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a.asc").write_text(ASC)
    np.save(tmp_path / "a.npy", np.arange(12.0).reshape(3, 4))
    return tmp_path


def test_a_map_in_the_plane_takes_in_its_raster(folder: Path) -> None:
    problem = scenario_from_toml(PLANE, "mine", folder=folder).problem
    assert problem.field.rasters == (RasterRisk([[1, 2, 3], [4, 5, 6]], (10, 20, 40, 40)),)
    assert problem.bounds == (10.0, 20.0, 40.0, 40.0)
    text = (
        PLANE.replace("[[", "threats = [{x = 20, y = 30, spread = 1}]\n[[") + "scale = 2.0\ninterpolation = 'nearest'"
    )
    field = scenario_from_toml(text, "mine", folder=folder).problem.field
    assert len(field.threats) == 1
    assert field.rasters[0].greatest == 12.0
    assert field.rasters[0].interpolation == "nearest"


def test_a_map_in_degrees_takes_in_its_raster(folder: Path) -> None:
    scenario = scenario_from_toml(LONLAT, "mine", folder=folder)
    (raster,) = scenario.problem.field.rasters
    width, height = raster.cell_size
    assert raster.cells.sum() * width * height == pytest.approx(66.0, rel=1e-9)
    assert scenario.projection is not None
    west, south, east, north = scenario.problem.bounds
    for x, y in scenario.projection.forward([(24.9, 60.1), (25.1, 60.2)]).tolist():
        assert west < x < east
        assert south < y < north


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        (("a.asc", "b.asc"), "rasters.0: .*no such file"),
        (("k = 3", "k = 3\nbounds = [10, 0, 40, 20]"), "rasters.0: .*outside the bounds"),
        (('"a.asc"', '"a.asc"\nkind = "people"'), "rasters.0.kind"),
        (('"a.asc"', '"a.asc"\nscale = 0'), "rasters.0.scale"),
        (('"a.asc"', '"a.asc"\nsize = 0'), "rasters.0.size: unknown key"),
        (('"a.asc"', '"a.asc"\nbounds = [0, 0, 1, 1]'), "leave out bounds"),
        (("start = [12, 22]", "start = [12, 2]"), "start"),
    ],
)
def test_faults_name_the_key(folder: Path, change: tuple[str, str], wrong: str) -> None:
    with pytest.raises(ScenarioError, match=wrong) as caught:
        scenario_from_toml(PLANE.replace(*change), "mine", folder=folder)
    assert "\n" not in str(caught.value)


def test_the_schema_knows_rasters() -> None:
    assert "RasterTable" in json.dumps(schema()["properties"]["rasters"])


def test_a_raster_is_a_scenario(folder: Path) -> None:
    (scenario,) = open_scenarios(str(folder / "a.asc"), start=(12, 22), goal=(38, 38))
    assert scenario.problem.k == 1.0
    (folder / "s.toml").write_text(PLANE)
    assert load_scenario(folder / "s.toml").problem.field == scenario.problem.field
    with pytest.raises(ScenarioError, match="a raster has no ends"):
        list(open_scenarios(str(folder / "a.asc")))
    with pytest.raises(ScenarioError, match="no such file"):
        raster_scenario(folder / "none.tif", start=(0, 0), goal=(1, 1))


def test_no_fly_areas_stand_beside_a_raster(folder: Path) -> None:
    ring = [[24.95, 60.12], [25.0, 60.12], [25.0, 60.17], [24.95, 60.12]]
    (folder / "areas.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    scenario = raster_scenario(
        folder / "a.npy",
        start=(24.91, 60.11),
        goal=(25.09, 60.19),
        bounds=(24.9, 60.1, 25.1, 60.2),
        k=7.0,
        no_fly=[folder / "areas.geojson"],
        settings={"kind": "count"},
    )
    assert scenario.problem.k == 7.0
    assert scenario.problem.no_fly is not None
    with pytest.raises(ScenarioError, match="kind"):
        raster_scenario(folder / "a.asc", start=(12, 22), goal=(38, 38), settings={"kind": "people"})


def test_missions_know_rasters_from_the_start(folder: Path) -> None:
    text = 'detection_radius = 5\nk = 1\nuavs = [{name = "a", start = [12, 22], goal = [38, 38]}]\n'
    (folder / "own.toml").write_text(text + '[[rasters]]\nfile = "a.asc"\n')
    (folder / "s.toml").write_text(PLANE)
    (folder / "by-name.toml").write_text('scenario = "s.toml"\n' + text)
    for name in ("own.toml", "by-name.toml"):
        assert len(load_mission(folder / name).world.field.rasters) == 1
    (folder / "both.toml").write_text('scenario = "s.toml"\n' + text + '[[rasters]]\nfile = "a.asc"\n')
    with pytest.raises(CglaError, match="rasters: scenario"):
        load_mission(folder / "both.toml")

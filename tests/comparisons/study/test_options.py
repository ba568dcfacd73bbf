"""Maps with changes: rasters with their options, and other risk weights."""

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from zone_files import data_of, ed269

from cgla_graph.comparisons.live.draft import LiveMap
from cgla_graph.comparisons.study.options import MapOptions, open_one
from cgla_graph.comparisons.study.study_file import read_study
from cgla_graph.errors import CglaError
from cgla_graph.scenarios.scenario import Scenario

ASC = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 20\ncellsize 10\nNODATA_value -9\n1 2 -9\n4 5 6\n"
ENDS = {"start": "12,22", "goal": "38,38"}


def open_map(spec: str | list[str], **changes: Any) -> Scenario:  # noqa: ANN401 - fields of MapOptions
    return open_one("plan", spec, MapOptions(**changes))


@pytest.fixture
def file(tmp_path: Path) -> str:
    (tmp_path / "a.asc").write_text(ASC)
    return str(tmp_path / "a.asc")


def test_a_raster_with_all_of_its_options(file: str) -> None:
    raster = {"kind": "count", "scale": 50.0, "nodata": 0.0, "interpolation": "nearest"}
    scenario = open_map(file, **ENDS, k=4.0, raster=raster, resolution=7, bounds="5,15,45,45")
    problem = scenario.problem
    assert (problem.k, problem.bounds, scenario.lattice.shape) == (4.0, (5.0, 15.0, 45.0, 45.0), (7, 7))
    assert problem.field.rasters[0].greatest == pytest.approx(3.0)


def test_any_map_takes_another_weight() -> None:
    assert open_map("paper", k=0.0).problem.k == 0.0
    assert open_map("paper").problem.k == 10.0


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({"k": None}, "give --k"),
        ({"k": -1.0}, "--k is -1"),
        ({"start": None}, "has no ends"),
        ({"start": "1"}, "--start is '1'; give two numbers, X,Y"),
        ({"raster": {"kind": "people", "nodata": 0.0}}, "kind: choose 'density' or 'count' .it is 'people'."),
        ({"raster": {"scale": 0.0}}, "scale"),
        ({}, "no data"),
    ],
)
def test_faults(file: str, changes: dict[str, object], wrong: str) -> None:
    with pytest.raises(CglaError, match=wrong):
        open_map(file, **{**ENDS, "k": 4.0, **changes})


def test_options_of_rasters_are_for_rasters() -> None:
    with pytest.raises(CglaError, match=r"paper is no raster .* leave out --kind"):
        open_map("paper", raster={"kind": "count"})
    with pytest.raises(CglaError, match=r"no_fly.geojson .* holds longitudes and latitudes"):
        open_map("paper", no_fly=[Path("areas.geojson")])


def test_a_raster_in_degrees_without_saying_so(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", [[1.0, 2.0], [3.0, 4.0]])
    said = {"start": "24.9,60.1", "goal": "24.6,60.3", "bounds": "24,60,25,60.5", "k": 2.0}
    spec = str(tmp_path / "a.npy")
    upper, lower = (
        open_map(spec, **said, raster={"coordinates": "lonlat", "origin": origin}) for origin in ("upper", "lower")
    )
    assert upper.projection is not None
    middle = [
        scenario.problem.field.density(scenario.projection.forward((24.25, 60.375))) for scenario in (upper, lower)
    ]
    assert [round(float(value)) for value in middle] == [1, 3]
    with pytest.raises(CglaError, match=r"coordinates.* 'metres'"):
        open_map(spec, **said, raster={"coordinates": "metres"})


def ring(west: float) -> str:
    corners = [[west, 60.0], [west + 0.1, 60.0], [west + 0.1, 60.1], [west, 60.1], [west, 60.0]]
    return json.dumps({"type": "Polygon", "coordinates": [corners]})


def test_several_geojson_files_are_one_map(tmp_path: Path) -> None:
    files = [tmp_path / f"{number}.geojson" for number in range(3)]
    for number, file in enumerate(files):
        file.write_text(ring(24.0 + 0.2 * number))
    joined = open_map([str(file) for file in files], clearance=250.0)
    beside = open_map(str(files[0]), no_fly=files[1:], clearance=250.0)
    assert joined.problem == beside.problem
    assert (len(joined.problem.area.geometry.geoms), joined.problem.clearance) == (3, 250.0)
    assert joined.title == "3 no-fly areas of 0.geojson, 1.geojson, 2.geojson"
    with pytest.raises(CglaError, match=r"takes one map .*: paper and maze are maps"):
        open_map([str(files[0]), "paper", "maze"])
    with pytest.raises(CglaError, match=r"paper: no_fly\.geojson .* holds longitudes and latitudes"):
        open_map([str(files[0]), "paper"])


def test_the_order_of_files_does_not_matter(tmp_path: Path) -> None:
    """A scenario is the map, wherever it stands; an error names the file that the area is in."""
    files = [tmp_path / "areas.geojson", tmp_path / "castle.json", tmp_path / "mine.toml"]
    files[0].write_text(ring(24.0))
    files[1].write_bytes(data_of(ed269()))
    ends = "start = [23.9, 60.05]\ngoal = [24.2, 60.05]\nk = 0\nbounds = [5, 48, 25, 61]"
    files[2].write_text(f'coordinates = "lonlat"\n{ends}')
    found = [open_map([str(file) for file in order]) for order in itertools.permutations(files)]
    assert {(one.name, one.problem.start, one.problem.bounds) for one in found} == {
        ("mine", found[0].problem.start, found[0].problem.bounds)
    }
    assert all(one.problem.area.geometry.equals(found[0].problem.area.geometry) for one in found)
    assert len(found[0].problem.area.geometry.geoms) == 2
    for order in itertools.permutations(map(str, files[:2])):
        with pytest.raises(CglaError, match=r"inside the no-fly area 'area 0' of areas\.geojson"):
            open_map([*order], start="24.05,60.05", goal="24.2,60.05")
        with pytest.raises(CglaError, match=r"inside the no-fly area 'A-1 .Castle.' of castle\.json"):
            open_map([*order], start="6.01,49.01", goal="6.3,49.1")
        with pytest.raises(CglaError, match=r"mine\.toml: start .* 'A-1 .Castle.' of castle\.json"):
            open_map([*order, str(files[2])], start="6.01,49.01")


def test_errors_name_the_file_of_the_area(tmp_path: Path) -> None:
    """Each of several files of plain areas, and the folders of files of the same name."""
    folders = [tmp_path / name for name in ("east", "west")]
    for folder, west in zip(folders, (25.0, 24.0), strict=True):
        folder.mkdir()
        (folder / "areas.geojson").write_text(ring(west))
        (tmp_path / f"{folder.name}.geojson").write_text(ring(west))
    plain = [str(tmp_path / f"{folder.name}.geojson") for folder in folders]
    same = [str(folder / "areas.geojson") for folder in folders]
    for files in (plain, same):
        for order in itertools.permutations(files):
            said = []
            for start in ("25.05,60.05", "24.05,60.05"):
                with pytest.raises(CglaError) as told:
                    open_map([*order], start=start, goal="24.7,60.05")
                said.append(str(told.value).partition(" of ")[2].partition(";")[0])
            assert len({*said}) == 2
            assert [Path(one).name for one in said] == [Path(one).name for one in files]


def test_errors_name_k_only_where_it_is(tmp_path: Path) -> None:
    """The page and files of studies have no --k."""
    people = tmp_path / "people.asc"
    people.write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n3 4\n")
    with pytest.raises(CglaError, match="has no risk weight; give --k K"):
        open_map(str(people))
    study = tmp_path / "study.toml"
    study.write_text(f'scenarios = ["{people}"]\n')
    for opened in (lambda: LiveMap.open(str(people)), lambda: read_study(study)):
        with pytest.raises(CglaError, match="no risk weight; write a scenario file") as told:
            opened()
        assert "--k" not in str(told.value)


@pytest.mark.parametrize("spec", ["maze", "small.map"])
def test_any_map_takes_a_clearance(spec: str, tmp_path: Path) -> None:
    (tmp_path / "small.map").write_text("type octile\nheight 4\nwidth 4\nmap\n....\n.@@.\n....\n....\n")
    path = spec if spec == "maze" else str(tmp_path / spec)
    assert open_map(path, clearance=0.01).problem.clearance == 0.01
    with pytest.raises(CglaError, match="--clearance is -1"):
        open_map(path, clearance=-1.0)
    with pytest.raises(CglaError, match=r"from the no-fly area.*, and the clearance is 3"):
        open_map(path, clearance=3.0)

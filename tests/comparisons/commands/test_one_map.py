"""Maps of the command line: rasters with their options, and other risk weights."""

from pathlib import Path

import pytest

from cgla_graph.comparisons.commands.one_map import open_map
from cgla_graph.errors import CglaError

ASC = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 20\ncellsize 10\nNODATA_value -9\n1 2 -9\n4 5 6\n"
ENDS = {"start": "12,22", "goal": "38,38"}


@pytest.fixture
def file(tmp_path: Path) -> str:
    (tmp_path / "a.asc").write_text(ASC)
    return str(tmp_path / "a.asc")


def test_a_raster_with_all_of_its_options(file: str) -> None:
    raster = {"kind": "count", "scale": 50.0, "nodata": 0.0, "interpolation": "nearest"}
    scenario = open_map("plan", file, **ENDS, k=4.0, raster=raster, resolution=7, bounds="5,15,45,45")
    problem = scenario.problem
    assert (problem.k, problem.bounds, scenario.lattice.shape) == (4.0, (5.0, 15.0, 45.0, 45.0), (7, 7))
    assert problem.field.rasters[0].greatest == pytest.approx(3.0)


def test_any_map_takes_another_weight() -> None:
    assert open_map("plan", "paper", k=0.0).problem.k == 0.0
    assert open_map("plan", "paper").problem.k == 10.0


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({"k": None}, "give --k"),
        ({"k": -1.0}, "--k is -1"),
        ({"start": None}, "has no ends"),
        ({"start": "1"}, "--start is '1'; give 2 numbers, X,Y"),
        ({"raster": {"kind": "people", "nodata": 0.0}}, "kind is 'people'"),
        ({"raster": {"scale": 0.0}}, "scale"),
        ({}, "no data"),
    ],
)
def test_faults(file: str, changes: dict[str, object], wrong: str) -> None:
    with pytest.raises(CglaError, match=wrong):
        open_map("plan", file, **{**ENDS, "k": 4.0, **changes})


def test_options_of_rasters_are_for_rasters() -> None:
    with pytest.raises(CglaError, match=r"paper is no raster .* leave out --kind"):
        open_map("plan", "paper", raster={"kind": "count"})
    with pytest.raises(CglaError, match="leave out --no-fly"):
        open_map("plan", "paper", no_fly=Path("areas.geojson"))

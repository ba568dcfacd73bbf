"""Paths that are saved from Python: by the ending of the file, with degrees where these are known."""

import json
from pathlib import Path

import numpy as np
import pytest

import cgla_graph as cg
from cgla_graph.errors import OutputError, ProblemError
from cgla_graph.model.earth import LocalProjection

PLACE = LocalProjection(24.0, 60.0)
PATH = np.array([[0.0, 0.0], [1000.0, 2000.0], [3000.0, 2500.0]])


@pytest.fixture
def found() -> cg.Solution:
    problem = cg.Problem((0, 0), (3000, 2500), bounds=(0, 0, 3000, 3000), projection=PLACE)
    return problem.judge(cg.Solution(cg.Status.FOUND, path=PATH, cost=problem.evaluate(PATH).cost, solver="mine"))


def test_every_form_holds_the_path(found: cg.Solution, tmp_path: Path) -> None:
    table = np.loadtxt(found.save(tmp_path / "a.csv"), delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table[:, :2], PATH)
    np.testing.assert_allclose(PLACE.forward(table[:, 2:]), PATH, atol=2e-4)
    (feature,) = json.loads(found.save(tmp_path / "a.geojson").read_text())["features"]
    assert feature["geometry"]["coordinates"] == found.lonlat.tolist() == table[:, 2:].tolist()
    assert feature["properties"]["lower_bound"] is None
    document = json.loads(found.save(str(tmp_path / "a.json")).read_text())
    assert (document["path"], document["path_lonlat"]) == (PATH.tolist(), found.lonlat.tolist())
    assert document["cost"] == found.cost
    # no tail of binary fractions
    assert max(len(repr(number)) for number in found.lonlat.ravel().tolist()) <= len("24.123456789")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.csv", "a.geojson", "a.json"]


def test_scenarios_and_every_solver_know_where_they_are() -> None:
    finland = cg.load_scenario("finland")
    found = cg.solve(finland.problem, "cgla", resolution=12)
    np.testing.assert_allclose(found.lonlat[0], (22.95, 59.85))
    with pytest.raises(ProblemError, match="the map is in the plane"):
        _ = cg.solve(cg.Problem((0, 0), (1, 1)), "straight-line").lonlat


@pytest.mark.parametrize(
    ("name", "given", "said"),
    [
        ("a.kml", cg.Solution(cg.Status.FOUND, path=PATH), "ends in .csv, .geojson, .json"),
        ("a.csv", cg.Solution(cg.Status.NO_PATH), "there is no path to write: no-path"),
        ("a.geojson", cg.Solution(cg.Status.FOUND, path=PATH), "no longitudes and latitudes"),
        ("none/a.csv", cg.Solution(cg.Status.FOUND, path=PATH), "cannot be written"),
    ],
)
def test_faults(name: str, given: cg.Solution, said: str, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=said):
        given.save(tmp_path / name)
    assert not list(tmp_path.iterdir())

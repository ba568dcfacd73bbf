"""`plan --max-density`, `plan` with prices, and `pareto --corridor`."""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Call

import cgla_graph as cg

TOWN = [[50.0, 400.0, 50.0], [50.0, 3000.0, 900.0], [50.0, 800.0, 50.0]]
ENDS = ["--start", "500,5500", "--goal", "5500,500"]


@pytest.fixture
def town(tmp_path: Path) -> str:
    np.save(tmp_path / "town.npy", np.array(TOWN))
    return "town.npy"


def planned(cgla: Call, town: str, *more: str) -> Any:  # noqa: ANN401 - JSON
    return cgla("plan", town, "--bounds", "0,0,6000,6000", *ENDS, *more, "--json").document()


def test_a_plan_stays_below_a_density(cgla: Call, town: str) -> None:
    free = planned(cgla, town, "--k", "0")
    limited = planned(cgla, town, "--k", "0", "--max-density", "800", "--corridor", "200")
    field = cg.RiskField(rasters=[cg.RasterRisk(TOWN, (0, 0, 6000, 6000))])
    problem = cg.Problem((500, 5500), (5500, 500), field, bounds=(0, 0, 6000, 6000))
    wanted = cg.solve(cg.below_density(problem, 800.0, corridor=200.0), "hybrid", tolerance=None)
    assert limited["cost"] == pytest.approx(wanted.cost, rel=1e-6)
    assert free["cost"] < limited["cost"]


def test_a_proof_of_no_path_is_printed_and_an_exit_status(cgla: Call, town: str) -> None:
    call = cgla("plan", town, "--bounds", "0,0,6000,6000", *ENDS, "--k", 0, "--max-density", 300, "--json")
    assert call.code == 1
    document = call.document()
    assert document["status"] == "no-path"
    assert "proven: no path stays below" in document["message"]


def test_prices_make_the_weight(cgla: Call, town: str) -> None:
    aircraft = ["--unit", "people/km2", "--failures-per-hour", "1e-3", "--speed", "20", "--lethal-area", "6.5"]
    by_price = planned(cgla, town, *aircraft, "--prevented-fatality", "2e6", "--metre-price", "0.01")
    by_weight = planned(cgla, town, *aircraft, "--k", "2e8")
    assert by_price["cost"] == by_weight["cost"]


def test_a_front_over_densities(cgla: Call, town: str, tmp_path: Path) -> None:
    document = cgla(
        "pareto", town, "--bounds", "0,0,6000,6000", *ENDS, "--k", "0", "--corridor", "200", "--out", "out", "--json"
    ).document()
    levels = [point["max_density"] for point in document["points"]]
    assert levels == [400.0, 800.0, 900.0, 3000.0]
    assert document["points"][0]["no_path"]
    costs = [point["cost"] for point in document["points"] if point["cost"] is not None]
    assert costs == sorted(costs, reverse=True)
    with (tmp_path / "out" / next(iter((tmp_path / "out").glob("*-density.csv"))).name).open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["max_density"]) for row in rows] == levels
    shown = cgla("pareto", town, "--bounds", "0,0,6000,6000", *ENDS, "--k", "0", "--corridor", "200").out
    assert "proven: no path" in shown


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--k", "1", "--corridor", "5"], "--corridor 5 without --max-density"),
        (["--k", "1", "--max-density", "-1"], "level is -1"),
        (["--k", "1", "--max-density", "10"], "no path stays below"),
        (["--k", "1", "--prevented-fatality", "5", "--metre-price", "1"], "both given"),
        (["--metre-price", "1"], "go together"),
        (["--metre-price", "0", "--prevented-fatality", "5"], "metre is 0"),
    ],
)
def test_contradicting_options_are_one_line(cgla: Call, town: str, options: list[str], message: str) -> None:
    cgla("plan", town, "--bounds", "0,0,6000,6000", *ENDS, *options).refused(message)

"""People on the ground on the command line: one model of failures, one unit of a limit, by every door."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Call

import cgla_graph as cg
from cgla_graph.comparisons.report.maps import map_document
from cgla_graph.scenarios.scenario import as_scenario

#: People per km2 of cells of 2 km, and the same as counts of cells.
TOWN = np.array([[50.0, 400.0, 50.0], [50.0, 3000.0, 900.0], [50.0, 800.0, 50.0]])
ASC = "ncols 3\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 2000\n"
ENDS = ("--start", "500,5500", "--goal", "5500,500")
AIRCRAFT = ("--failures-per-hour", 1e-3, "--speed", 20, "--dimension", 1)
PRICES = ("--prevented-fatality", 2e6, "--metre-price", 0.01)
QUICK = ("--no-certificate",)
FACTOR = 1e-3 / 3600 / 20 * 6.5 / 1e6
SCENARIO = """
start = [500, 5500]
goal = [5500, 500]
k = 1e8
[[rasters]]
file = "{file}"
{more}
ground_risk = {{ failures_per_hour = 1e-3, speed = 20, dimension = 0.9 }}
"""


@pytest.fixture(autouse=True)
def files(tmp_path: Path) -> None:
    """Write the town in several ways."""
    rows = lambda values: "\n".join(" ".join(f"{value:.17g}" for value in row) for row in values)  # noqa: E731
    np.save(tmp_path / "density.npy", TOWN)
    (tmp_path / "count.asc").write_text(ASC + rows(TOWN * 4.0))
    (tmp_path / "density.asc").write_text(ASC + rows(TOWN))
    (tmp_path / "square.asc").write_text(ASC + rows(TOWN / 1e6))
    (tmp_path / "risk.asc").write_text(ASC + rows(TOWN * FACTOR))
    (tmp_path / "count.toml").write_text(SCENARIO.format(file="count.asc", more='kind = "count"'))
    (tmp_path / "density.toml").write_text(SCENARIO.format(file="density.asc", more='unit = "people/km2"'))


#: One town by every door: the map and its options.
DOORS: dict[str, tuple[object, ...]] = {
    "npy": ("density.npy", "--bounds", "0,0,6000,6000", *ENDS, "--unit", "people/km2", *AIRCRAFT, "--k", 1e8),
    "counts": ("count.asc", *ENDS, "--kind", "count", *AIRCRAFT, "--k", 1e8),
    "densities": ("density.asc", *ENDS, "--unit", "people/km2", *AIRCRAFT, "--k", 1e8),
    "per m2": ("square.asc", *ENDS, "--unit", "people/m2", *AIRCRAFT, "--k", 1e8),
    "file of counts": ("count.toml",),
    "file of densities": ("density.toml",),
}


@pytest.mark.parametrize("door", DOORS)
def test_every_door_has_the_same_numbers(door: str, cgla: Call) -> None:
    asked = ("--max-density", 800, "--corridor", 200, "--target", 1e-6)
    document = cgla("plan", *DOORS[door], *asked, *QUICK, "--json").document()
    raster = cg.RasterRisk(TOWN, (0, 0, 6000, 6000))
    risk = cg.ground_risk(raster, unit="people/km2", failures_per_hour=1e-3, speed=20, lethal_area=6.5)
    problem = cg.Problem((500, 5500), (5500, 500), cg.RiskField(rasters=[risk]), 1e8, raster.bounds)
    limited = cg.below_density(problem, 800.0, corridor=200.0)
    found = cg.solve(limited, "hybrid", tolerance=None)
    below, numbers = document["ground"], cg.exposure(limited, found.path, corridor=200, max_density=800, target=1e-6)
    assert document["cost"] == pytest.approx(found.cost, rel=1e-9)
    assert below["fatalities_per_flight"] == pytest.approx(document["risk"]) == pytest.approx(numbers.fatalities)
    assert below["fatalities_per_hour"] == pytest.approx(numbers.per_hour)
    assert below["people_on_map"] == pytest.approx(TOWN.sum() * 4.0)
    assert (below["greatest_density"], below["density_unit"]) == (pytest.approx(800.0), "people/km2")
    assert (below["max_density"], below["meets_max_density"], below["meets_target"]) == (800.0, True, False)
    assert below["model"]["lethal_area"] == 6.5


def test_what_is_printed_has_units_and_sources(cgla: Call) -> None:
    shown = cgla("plan", *DOORS["counts"][:-2], *PRICES, "--max-density", 5000, "--target", 1e-9).out
    for words in (
        "expected fatalities\n",
        "21,400 on the map; up to",
        "people/km2 under the path, limit 5000",
        "expected per flight",
        "per flight hour",
        "lethal area 6.5 m2 (SORA 2.5, Annex F: up to 1 m of characteristic dimension)",
        "fatality 1 (the worst case)",
        "missed: at most 1e-09 expected fatalities per flight hour; proven: every allowed path that meets it is",
        "proven: every allowed path at most as long as this one has at least",
        "the limit of 5000 people/km2 limits nothing, as no cell of the map is above 3000",
        "clearance  no no-fly area\n",
    ):
        assert words in shown, shown
    plain = cgla("plan", "density.asc", *ENDS, "--k", 0.01, *QUICK).out
    assert "in the raster's own unit x length" in plain
    assert "if they are people, say so" in plain
    counted = cgla("plan", "count.asc", *ENDS, "--kind", "count", "--k", 1e3, *QUICK).out
    assert "in people/m2 x m" in counted
    assert "21,400 on the map" in counted


@pytest.mark.parametrize(("command", "scale"), [("plan", "1"), ("plan", "4.514e-7"), ("certify", "4.514e-7")])
def test_no_scale_gets_into_a_limit(command: str, scale: str, cgla: Call) -> None:
    """A limit was compared with scaled values, in silence: 0.0005 and 500 both limited nothing."""
    counts = ("count.asc", *ENDS, "--kind", "count", "--scale", scale, "--k", 1.0, "--corridor", 200)
    quick = QUICK if command == "plan" else ("--tolerance", 0.5)
    cgla(command, *counts, "--max-density", 0.0005, *quick).refused("above 0.0005 people/km2", "in another unit")
    document = cgla(command, *counts, "--max-density", 800, *quick, "--json").document()
    assert document["ground"]["greatest_density"] == pytest.approx(800.0)
    assert document["ground"]["notes"] == []


def test_the_front_of_limits_is_in_people_per_km2(cgla: Call) -> None:
    counts = ("count.asc", *ENDS, "--kind", "count", "--scale", 4.514e-7, "--k", 0, "--corridor", 200)
    document = cgla("pareto", *counts, "--json").document()
    assert [point["max_density"] for point in document["points"]] == pytest.approx([400.0, 800.0, 900.0, 3000.0])
    assert document["density_unit"] == "people/km2"
    assert "is above it, in people/km2" in " ".join(cgla("pareto", *counts).out.split())


REFUSED: list[tuple[tuple[object, ...], tuple[str, ...]]] = [
    (("density.asc", *ENDS, *PRICES), ("needs expected fatalities", "--failures-per-hour", "--unit fatalities/m")),
    (("count.asc", *ENDS, "--kind", "count", *PRICES), ("needs expected fatalities", "people/m2 x m")),
    (("paper", *PRICES), ("needs expected fatalities", "units of threats")),
    (("density.asc", *ENDS, *AIRCRAFT, "--k", 1), ("21,400,000,000 with", "5,350 with --kind count", "21,400 with")),
    (("density.asc", *ENDS, *AIRCRAFT, "--k", 1, "--kind", "density"), ("5,350 with --kind count",)),
    (("count.asc", *ENDS, *AIRCRAFT, "--kind", "count", "--scale", 2, "--k", 1), ("second factor",)),
    (("count.asc", *ENDS, "--kind", "count", "--unit", "people/km2", "--k", 1), ("leave out one",)),
    (("density.asc", *ENDS, "--scale", 1e-6, "--k", 1, "--max-density", 5), ("a scale of 1e-06 and no people",)),
    (("density.asc", *ENDS, "--unit", "people", "--k", 1), ("unit", "people/km2")),
    (("count.asc", *ENDS, "--kind", "count", "--k", 1, "--target", 1e-6), ("target", "--failures-per-hour")),
    (("count.asc", *ENDS, "--kind", "count", "--k", 1, *AIRCRAFT[:4]), ("lethal_area and dimension are missing",)),
    (("count.asc", *ENDS, "--kind", "count", "--k", 1, *AIRCRAFT[:2], *AIRCRAFT[4:]), ("speed of the aircraft",)),
    (
        ("count.asc", *ENDS, "--kind", "count", "--k", 1, "--lethal-area", 5, *AIRCRAFT[2:]),
        ("failures_per_hour of the aircraft",),
    ),
    (("count.toml", *AIRCRAFT), ("already",)),
    (("paper", *AIRCRAFT), ("no raster of people",)),
]


@pytest.mark.parametrize(("words", "said"), REFUSED)
def test_what_has_no_meaning_is_refused(words: tuple[object, ...], said: tuple[str, ...], cgla: Call) -> None:
    cgla("plan", *words).refused(*said)


def test_fatalities_per_metre_have_prices(cgla: Call) -> None:
    document = cgla("plan", "risk.asc", *ENDS, "--unit", "fatalities/m", *PRICES, *QUICK, "--json").document()
    by_model = cgla("plan", *DOORS["counts"][:-2], *PRICES, *QUICK, "--json").document()
    assert document["cost"] == pytest.approx(by_model["cost"], rel=1e-9)
    assert document["ground"]["fatalities_per_flight"] == document["risk"]


SLOW = [pytest.param(door, marks=pytest.mark.slow) for door in ("npy", "file of counts")]


@pytest.mark.parametrize("door", ["counts", *SLOW])
def test_a_check_of_a_plan(door: str, cgla: Call, tmp_path: Path) -> None:
    (tmp_path / "plan.csv").write_text("x,y\n500,5500\n5500,500\n")
    spec, *words = [one for one in DOORS[door] if one not in {*ENDS, "--k", 1e8}]
    asked = ("--max-density", 500, "--corridor", 200, "--target", 1e-9)

    def checked(*more: object) -> Any:  # noqa: ANN401 - JSON
        return cgla("check", "plan.csv", spec, *words, *more, "--json", "--k", 1e10, "--tolerance", 0.02)

    clean = checked().document()
    assert clean["clean"]
    assert clean["ground"]["greatest_density"] == pytest.approx(3000.0)
    assert clean["ground"]["fatalities_per_flight"] == pytest.approx(clean["risk"])
    assert 0.0 < clean["ground"]["least_fatalities_at_this_length"] <= clean["risk"]
    answer = checked(*asked)
    assert answer.code == 1
    found = answer.document()
    assert found["verdict"][0].startswith(
        "not clean: the greatest density under the corridor is 3000 people/km2, above"
    )
    assert "above the target of 1e-09" in found["verdict"][1]
    assert math.isfinite(found["ground"]["least_length_for_target"])
    cgla("check", "plan.csv", "paper", "--target", 1e-6).refused("needs the aircraft")


def test_comparisons_take_the_aircraft(cgla: Call) -> None:
    words = ("--solvers", "straight-line", "--json", *QUICK)
    rows = cgla("compare", *DOORS["counts"], *words).document()
    assert "risk in expected fatalities" in " ".join(cgla("compare", *DOORS["counts"], *words[:2], *QUICK).out.split())
    by_file = cgla("compare", "count.toml", *words).document()
    risks = [one["runs"][0]["risk"] if "runs" in one else one["rows"][0]["risk"] for one in (rows, by_file)]
    assert risks[0] == pytest.approx(risks[1])
    assert risks[0] < 1e-5


MISSION = """
k = 1e9
bounds = [0, 0, 6000, 6000]
lattice = { resolution = 6 }
[[rasters]]
file = "count.asc"
kind = "count"
ground_risk = { failures_per_hour = 1e-3, speed = 20, dimension = 1 }
[[uavs]]
name = "a"
start = [500, 5500]
goal = [5500, 500]
detection_radius = 900
"""


@pytest.mark.slow
def test_a_mission_has_the_same_model(cgla: Call, tmp_path: Path) -> None:
    (tmp_path / "mission.toml").write_text(MISSION)
    (uav,) = cgla("fly", "mission.toml", "--no-value", "--json").document()["flights"][0]["uavs"]
    shown = " ".join(cgla("fly", "mission.toml", "--no-value").out.split())
    assert "risk: in expected fatalities" in shown
    rate = uav["risk"] / (uav["length"] / 20 / 3600)
    assert f"a: {uav['risk']:.3e} expected fatalities, {rate:.3e} per flight hour at 20 m/s" in shown
    (tmp_path / "mission.toml").write_text(MISSION.replace('"count"', '"count"\nscale = 2.0'))
    cgla("fly", "mission.toml").refused("mission.toml: rasters.0", "second factor")


def test_reports_name_the_unit_of_risk(tmp_path: Path) -> None:
    for file, label in (
        ("count.toml", "expected fatalities per metre"),
        ("density.toml", "expected fatalities per metre"),
    ):
        shown = map_document(cg.load_scenario(tmp_path / file))
        assert shown["risk"]["label"] == label
    people = cg.RasterRisk(TOWN, (0, 0, 6000, 6000), unit="people/km2")
    problem = cg.Problem((500, 5500), (5500, 500), cg.RiskField(rasters=[people]), bounds=people.bounds)
    assert map_document(as_scenario(problem, "town"))["risk"]["label"] == "risk per unit length (people/km2)"


#: A population raster in degrees, people per cell, that is not in a clone of this repository.
ARUBA = Path(__file__).resolve().parents[4] / "shared/data/ground_risk/aruba_worldpop_2020.tif"


@pytest.fixture
def island(tmp_path: Path) -> tuple[str, str, str]:
    """Return an island in degrees, people per cell, with cells without data around it, and two places on it."""
    values = np.random.default_rng(8).integers(1, 60, (24, 30)).astype(float)
    values[:2] = values[-2:] = values[:, :2] = values[:, -2:] = -9999.0
    head = "ncols 30\nnrows 24\nxllcorner -70.1\nyllcorner 12.4\ncellsize 0.005\nNODATA_value -9999\n"
    (tmp_path / "island.asc").write_text(head + "\n".join(" ".join(map(str, row)) for row in values.tolist()))
    return "island.asc", "-70.07,12.43", "-69.98,12.49"


@pytest.mark.slow
def test_an_island_in_degrees_from_counts_to_a_plan(island: tuple[str, str, str], cgla: Call, tmp_path: Path) -> None:
    file, start, goal = island
    counts = (file, f"--start={start}", f"--goal={goal}", "--coordinates", "lonlat", "--kind", "count", "--nodata", 0)
    words = (*AIRCRAFT, *PRICES, "--max-density", 180, "--corridor", 100, "--target", 1e-4)
    document = cgla(
        "plan", *counts, *words, "--altitude", 80, "--export", "island.plan", "--tolerance", 0.02, "--json"
    ).document()
    values = np.loadtxt(tmp_path / file, skiprows=6)
    below = document["ground"]
    assert below["people_on_map"] == pytest.approx(values[values > 0].sum())
    # 59 people on a cell of 0.543 by 0.553 km
    assert 150.0 < below["greatest_density"] <= 180.0
    assert (below["without_data"], below["length_outside"]) == (0.0, 0.0)
    assert below["meets_target"]
    assert (tmp_path / "island.plan").exists()
    scaled = cgla(
        "plan", *counts, "--scale", 4.514e-7, "--k", 1e8, "--max-density", 180, "--corridor", 100, *QUICK, "--json"
    ).document()
    assert scaled["ground"]["greatest_density"] <= 180.0
    checked = cgla(
        "check", "island.plan", "--risk", *counts[:1], *counts[3:], *AIRCRAFT, "--max-density", 180, "--corridor", 99,
        "--target", 1e-4, "--no-certificate", "--json",
    ).document()  # fmt: skip
    assert checked["ground"]["fatalities_per_flight"] == pytest.approx(below["fatalities_per_flight"], rel=1e-3)
    assert checked["ground"]["meets_max_density"]


@pytest.mark.slow
@pytest.mark.skipif(not ARUBA.is_file(), reason="needs ../shared/data/ground_risk")
def test_aruba(cgla: Call) -> None:
    ends = ("--nodata", 0, "--start=-70.05,12.60", "--goal=-69.90,12.43")
    counts = (ARUBA, *ends, "--kind", "count", "--corridor", 400, *QUICK)
    limited = cgla("plan", *counts, "--scale", 4.514e-7, "--k", 1e8, "--max-density", 5000, "--json").document()
    below = limited["ground"]
    assert (round(below["people_on_map"]), below["notes"]) == (106_766, [])
    assert 3000.0 < below["greatest_density"] <= 5000.0
    cgla("plan", *counts, "--scale", 4.514e-7, "--k", 1e8, "--max-density", 0.0005).refused("in another unit?")
    nothing = cgla("plan", *counts, "--scale", 4.514e-7, "--k", 1e8, "--max-density", 20_000).out
    assert "limits nothing" in nothing
    cgla("plan", ARUBA, *ends, *AIRCRAFT, "--k", 1).refused("106,766 with --kind count", "891,510,786 with --unit")
    cgla("plan", *counts[:7], *PRICES).refused("needs expected fatalities")

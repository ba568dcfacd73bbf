"""`cgla certify`: the bracket that it prints, the paths that it reads, its files, its picture, and what it refuses."""

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import oracles
import pytest
import shapely
from command_line import Answer, Call
from figures import assert_tidy
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

import cgla_graph as cg
from cgla_graph.certificate.certificate import Grid
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.cli.certify import certified
from cgla_graph.comparisons.plots.runs import certificate_of_run
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables import certificate as words
from cgla_graph.eikonal import cell_runs
from cgla_graph.model.solution import Solution, Status
from cgla_graph.plots.pictures import save
from cgla_graph.scenarios.scenario import Scenario, load_scenario

SMALL = """
start = [0.1, 0.2]
goal = [0.9, 0.7]
k = 5.0
threats = [{ x = 0.5, y = 0.5, spread = 0.1 }]
[lattice]
resolution = 6
"""
AREA = "[no_fly]\npolygons = [[[0.45, -0.1], [0.55, -0.1], [0.55, TOP], [0.45, TOP]]]\n"
FREE = SMALL.replace("threats = [{ x = 0.5, y = 0.5, spread = 0.1 }]", "")
FILES = {
    "small.toml": SMALL,
    "free.toml": FREE,
    "wall.toml": SMALL.split("[lattice]", maxsplit=1)[0] + AREA.replace("TOP", "0.6"),
    "shut.toml": SMALL.split("[lattice]", maxsplit=1)[0] + AREA.replace("TOP", "1.1"),
    "improper.toml": "improper = true\n" + SMALL.replace("spread = 0.1", "spread = 0.1, peak = 1.5"),
}


def lines_of(answer: Answer) -> dict[str, str]:
    return {line[:10].strip(): line[11:] for line in answer.out.splitlines() if not line.startswith(("│", "┃"))}


def write_path(name: str, path: Any, heads: str = "x,y") -> None:  # noqa: ANN401 - any rows
    Path(name).write_text("\n".join([heads, *(",".join(map(str, row)) for row in path)]) + "\n", encoding="utf-8")


# printed lines and JSON


def test_certify_prints_the_bracket(cgla: Call) -> None:
    answer = cgla("certify", "small.toml", "--tolerance", "0.0003")
    assert (answer.code, answer.err) == (0, "")
    problem = load_scenario("small.toml").problem
    path = cg.solve(problem, cg.solvers.get("hybrid", tolerance=None)).path
    proof = cg.lower_bound(problem, 0.0003, path=path)
    table = [line.strip("│").split("│") for line in answer.out.splitlines() if line.startswith("│")]
    assert len(table) == len(proof.grids) >= 2
    for row, grid in zip(table, proof.grids, strict=True):
        step, spacing, cells, lower, upper, gap = (cell.strip() for cell in row)
        assert step == f"1/{max(grid.last)}"
        assert float(spacing) == pytest.approx(grid.spacing, rel=5e-3)
        assert int(cells.replace(",", "")) == len(cell_runs.cells_of(grid.runs)[0])
        assert grid.lower_bound * (1 - 1e-5) < float(lower) <= grid.lower_bound
        assert float(upper) == pytest.approx(grid.upper_bound, rel=1e-6)
        assert 0.0 <= float(gap.split()[0]) - 100 * (grid.upper_bound / grid.lower_bound - 1.0) < 0.01 + 1e-12
    said = lines_of(answer)
    assert said["path"].startswith("hybrid: cost ")
    words = said["proven"].replace(";", "").split()
    assert float(words[5]) == pytest.approx(proof.lower_bound, rel=1e-8)
    assert float(words[9].strip(",")) == pytest.approx(proof.upper_bound, rel=1e-8)
    assert said["ended"].startswith("the gap is within the tolerance (")


def test_certify_as_json(cgla: Call, tmp_path: Path) -> None:
    answer = cgla("certify", "small.toml", "--out", "out", "--json")
    assert (answer.code, answer.err) == (0, "")
    found = answer.document()
    proof, grids = found["certificate"], found["grids"]
    assert (found["scenario"], found["solver"], found["status"]) == ("small", "hybrid", "found")
    assert {key: type(value) for key, value in proof.items()} == {
        "scenario": str,
        "lower_bound": float,
        "upper_bound": float,
        "gap": float,
        "tolerance": float,
        "reached": bool,
        "spacing": float,
        "cells": int,
        "proof": str,
        "seconds": float,
        "message": str,
    }
    # the numbers are those of the path in the document
    judged = load_scenario("small.toml").problem.evaluate(found["path"])
    assert judged.feasible
    assert proof["upper_bound"] == found["cost"] == judged.cost
    assert found["lower_bound"] == proof["lower_bound"] == grids[-1]["lower_bound"]
    assert found["gap"] == proof["gap"] == judged.cost / proof["lower_bound"] - 1.0
    # the bracket gets tighter while the step of the grid halves
    assert all(tuple(grid) == words.COLUMNS for grid in grids)
    lower = [grid["lower_bound"] for grid in grids]
    assert lower == sorted(lower)
    assert lower[-1] <= judged.cost
    assert [grid["fraction"] for grid in grids] == [2.0 ** -(7 + i) for i in range(len(grids))]
    # the files hold the same
    assert found["files"] == [f"out/small-hybrid-certificate.{kind}" for kind in ("csv", "png", "svg")]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {Path(name).name for name in found["files"]}
    with (tmp_path / "out" / "small-hybrid-certificate.csv").open(encoding="utf-8") as file:
        table = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    assert table == grids


@pytest.mark.slow
def test_more_cells_prove_more(cgla: Call) -> None:
    short = cgla("certify", "wall.toml", "--tolerance", "1e-6", "--max-cells", "16384")
    assert short.code == 0
    assert "--max-cells N allows more" in lines_of(short)["ended"]
    few, more = (
        cgla("certify", "wall.toml", "--tolerance", "1e-6", "--max-cells", most, "--json").document()["certificate"]
        for most in (16384, 60000)
    )
    assert not few["reached"]
    assert few["lower_bound"] < more["lower_bound"] <= more["upper_bound"] == few["upper_bound"]


# paths from files


def test_certify_a_path_of_plan(cgla: Call) -> None:
    plan = cgla("plan", "small.toml", "--solver", "cgla", "--out", "out", "--no-certificate", "--json").document()
    found = cgla("certify", "small.toml", "--path", "out/small-cgla.csv", "--json").document()
    assert (found["solver"], found["path"]) == ("small-cgla.csv", plan["path"])
    assert found["cost"] == plan["cost"] == found["certificate"]["upper_bound"]
    best = cgla("certify", "small.toml", "--json").document()
    # a coarse lattice's path is worse, and the bound says so
    assert best["gap"] <= 0.001 < found["gap"] <= plan["cost"] / best["certificate"]["lower_bound"] - 1.0 + 0.1
    assert found["certificate"]["lower_bound"] <= best["cost"]


def test_certify_a_flight_plan(cgla: Call) -> None:
    scenario = load_scenario("finland")
    path = cg.solve(scenario.problem, "cgla", resolution=8).path
    assert scenario.projection is not None
    plan = cg.FlightPlan.along(scenario.projection.inverse(path), altitude=80)
    for name in ("mine.plan", "mine.kml"):
        cg.write_plan(plan, name)
        np.testing.assert_allclose(cg.read_path(Path(name), scenario.problem), path, atol=1e-3)
    cgla("certify", "small.toml", "--path", "mine.plan").refused("longitude", "x and y")


def test_certify_other_ends(cgla: Call) -> None:
    words = ("--start", "0.1,0.9", "--goal", "0.9,0.1")
    write_path("mine.csv", [(0.1, 0.9), (0.2, 0.1), (0.9, 0.1)])
    found = cgla("certify", "small.toml", "--path", "mine.csv", *words, "--json").document()
    assert (found["path"][0], found["path"][-1]) == ([0.1, 0.9], [0.9, 0.1])
    assert cgla("certify", "small.toml", "--path", "mine.csv").code == 2


def test_a_path_on_a_lonlat_map(cgla: Call) -> None:
    scenario = load_scenario("finland")
    path = cg.solve(scenario.problem, "cgla", resolution=8).path
    Path("both.csv").write_text(files.path_csv(scenario, Solution(Status.FOUND, path=path)), encoding="utf-8")
    with Path("both.csv").open(encoding="utf-8") as file:
        table = [(row["longitude"], row["latitude"]) for row in csv.DictReader(file)]
    write_path("lonlat.csv", table, "Longitude, Latitude")
    np.testing.assert_array_equal(cg.read_path(Path("both.csv"), scenario.problem), path)
    read = cg.read_path(Path("lonlat.csv"), scenario.problem)
    np.testing.assert_allclose(read, path, atol=1e-3)
    assert tuple(read[0]) == scenario.problem.start
    assert tuple(read[-1]) == scenario.problem.goal
    answer = cgla("certify", "finland", "--path", "lonlat.csv", "--tolerance", "0.1")
    assert answer.code == 0
    assert " m; this one costs " in lines_of(answer)["proven"]


INSIDE = st.floats(0.0, 1.0, width=64)


@given(arrays(np.float64, st.tuples(st.integers(0, 9), st.just(2)), elements=INSIDE))
def test_read_path_inverts_path_csv(tmp_path_factory: pytest.TempPathFactory, inner: np.ndarray) -> None:
    scenario = load_scenario("paper")
    path = np.vstack([scenario.problem.start, inner, scenario.problem.goal])
    file = tmp_path_factory.getbasetemp() / "waypoints.csv"
    file.write_text(files.path_csv(scenario, Solution(Status.FOUND, path=path)), encoding="utf-8")
    np.testing.assert_array_equal(cg.read_path(file, scenario.problem), path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "it is empty; the first line has to name the columns x,y"),
        ("a,b\n1,2\n", "the first line says 'a,b'"),
        ("longitude,latitude\n1,2\n", "the first line says 'longitude,latitude'"),
        ("x,y\n", "there are no waypoints"),
        ("x,y\n0.1,0.2\n\n0.5\n", "line 4 holds '0.5,'; a waypoint is two finite numbers"),
        ("x,y\n0.1,high\n", "line 2 holds '0.1,high'"),
        ("x,y\n0.1,nan\n", "line 2 holds '0.1,nan'"),
        ("x,y\n0.2,0.2\n0.9,0.7\n", "the path starts at (0.2, 0.2) instead of (0.1, 0.2)"),
        ("x,y\n0.1,0.2\n0.9,0.8\n", "the path ends at (0.9, 0.8) instead of (0.9, 0.7)"),
        ("x,y\n0.9,0.7\n0.1,0.2\n", "the path starts at (0.9, 0.7)"),
        ("x,y\n0.1,0.2\n0.5,1.2\n0.9,0.7\n", "not feasible: waypoint 1 leaves the bounds"),
        ("x,y\n0.1,0.2\n0.9,0.7\n", "not feasible: segment 0 crosses the no-fly area"),
        ('x,y\n0.1,0.2\n0.5,"1\n', "line 3 is no CSV (unexpected end of data)"),
        ("x,y\n0.1,0.2\n" + "1" * 200_000 + ",1\n", "line 3 is no CSV"),
    ],
)
def test_a_file_without_a_fit_path(cgla: Call, text: str, said: str) -> None:
    Path("mine.csv").write_text(text, encoding="utf-8")
    cgla("certify", "wall.toml", "--path", "mine.csv", "--out", "out").refused("cgla: mine.csv: ", said)
    assert not list(Path("out").iterdir())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere"], "nowhere"),
        (["small.toml", "--path", "none.csv"], "none.csv: there is no such file"),
        (["small.toml", "--path", "."], "cannot be read"),
        (["small.toml", "--tolerance", "0"], "--tolerance is 0; it must be above 0"),
        (["small.toml", "--tolerance", "nan"], "--tolerance is nan"),
        (["small.toml", "--max-cells", "99"], "--max-cells is 99; give at least 16384"),
        (["small.toml", "--start", "2,2"], "outside the bounds"),
        (["small.toml", "--resolution", "1"], "resolution is 1"),
        ([], "missing argument"),
    ],
)
def test_certify_refuses_wrong_input(cgla: Call, words: list[str], said: str) -> None:
    cgla("certify", *words).refused(said)


def test_ends_off_by_rounding_are_put_in_place(cgla: Call) -> None:
    write_path("near.csv", [(0.1000004, 0.2), (0.2, 0.9), (0.9, 0.6999996)])
    write_path("exact.csv", [(0.1, 0.2), (0.2, 0.9), (0.9, 0.7)])
    near, exact = (cg.read_path(name, load_scenario("small.toml").problem) for name in ("near.csv", "exact.csv"))
    np.testing.assert_array_equal(near, exact)


# no path, no bound, no grid


@pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.ImproperFieldWarning")
@pytest.mark.parametrize(
    ("name", "code", "proven", "n_grids"),
    [
        ("shut.toml", 1, "there is no path inside the bounds", 1),
        ("improper.toml", 1, "nothing is proven", 0),
        ("free.toml", 0, "no path costs less than 0.943398113; this one costs 0.943398113, at most 0.01 % more", 0),
    ],
)
def test_cases_without_a_bracket(cgla: Call, name: str, code: int, proven: str, n_grids: int) -> None:
    answer = cgla("certify", name, "--out", "out")
    assert (answer.code, answer.err) == (code, "")
    assert lines_of(answer)["proven"].startswith(proven)
    found = cgla("certify", name, "--json").document()
    assert len(found["grids"]) == n_grids
    assert bool(found["path"]) == (code == 0)
    assert (found["certificate"]["lower_bound"] is None) == (code == 1)
    assert Path(f"out/{Path(name).stem}-hybrid-certificate.png").read_bytes().startswith(b"\x89PNG")


def test_from_a_point_to_itself(cgla: Call) -> None:
    found = cgla("certify", "small.toml", "--goal", "0.1,0.2", "--json", "--out", "out").document()
    assert (found["cost"], found["gap"], found["certificate"]["lower_bound"]) == (0.0, 0.0, 0.0)


# the picture


@pytest.fixture(scope="module")
def run() -> Run:
    """Return a run on a map that is not square, with a wall and room left and right of it."""
    field = cg.RiskField([cg.Threat(x=1.0, y=0.5, spread=0.1)])
    wall = shapely.box(0.9, -0.1, 1.1, 0.4)
    problem = cg.Problem((0.1, 0.2), (1.8, 0.3), field, k=5.0, bounds=(0.0, 0.0, 2.0, 1.0), no_fly=wall)
    return certified(Scenario("wide", "", problem, cg.Lattice(8, bounds=problem.bounds)), tolerance=1e-4)


def grids_of(run: Run) -> tuple[Grid, ...]:
    assert run.certificate is not None
    return run.certificate.grids


@pytest.mark.slow
@pytest.mark.parametrize("height", [0.7, 1.0, 4.0])
def test_nothing_overlaps(run: Run, height: float) -> None:
    problem = replace(run.scenario.problem, bounds=(0.0, 0.0, 2.0, height))
    long = replace(run.scenario, problem=problem, title="a title of many words " * 8, name="a-name" * 8)
    assert_tidy(certificate_of_run(certified(long, tolerance=0.02)))


def tubes_of(figure: Figure) -> list[PathPatch]:
    """Return the outlines of tubes, coarse to fine."""
    return [patch for patch in figure.axes[0].patches if isinstance(patch, PathPatch) and patch.get_zorder() == 1.6]


def test_tubes_are_the_cells_of_the_grids(run: Run) -> None:
    figure, grids = certificate_of_run(run), grids_of(run)
    tubes = tubes_of(figure)
    assert len(tubes) == len(grids) - 1 >= 2
    random = np.random.default_rng(1)
    points = random.uniform((0.0, 0.0), (2.0, 1.0), size=(2000, 2))
    for tube, grid in zip(tubes, grids[1:], strict=True):
        nodes = np.round(points / (2.0, 1.0) * grid.last).astype(np.int64)
        inside = np.array(oracles.are_in(nodes[:, 0], nodes[:, 1], grid.runs))
        assert 0 < inside.sum() < len(points)
        np.testing.assert_array_equal(tube.get_path().contains_points(points), inside)
        # no better path leaves the tube, nor does the path itself
        assert tube.get_path().contains_points(run.solution.path, radius=1e-9).all()


def test_the_bracket_is_the_certificates(run: Run) -> None:
    figure, grids = certificate_of_run(run), grids_of(run)
    axes = figure.axes[-1]
    upper, lower = axes.lines
    cells = [max(grid.last) for grid in grids]
    for line, side in ((upper, "upper_bound"), (lower, "lower_bound")):
        np.testing.assert_array_equal(line.get_xdata(), cells)
        np.testing.assert_array_equal(line.get_ydata(), [getattr(grid, side) for grid in grids])
    assert axes.get_xscale() == "log"
    assert words.at_most(words.proof_of(run).gap) in axes.texts[-1].get_text()


@pytest.mark.slow
def test_the_same_run_gives_the_same_picture(run: Run, tmp_path: Path) -> None:
    for kind in ("png", "svg"):
        first, second = (save(certificate_of_run(run), tmp_path / f"{i}.{kind}").read_bytes() for i in range(2))
        assert first == second


def test_a_bound_without_a_path_is_drawn(run: Run) -> None:
    """While no path is known, there is a lower bound and no upper one."""
    proof = words.proof_of(run)
    grids = tuple(replace(grid, upper_bound=math.inf) for grid in proof.grids)
    blind = replace(proof, upper_bound=math.inf, grids=grids)
    figure = certificate_of_run(replace(run, solution=Solution(Status.NO_PATH), certificate=blind))
    assert len(figure.axes[-1].lines[0].get_xdata()) == 0
    assert figure.texts[-1].get_text().endswith("no path is known")


def test_a_run_without_a_certificate_is_refused(run: Run) -> None:
    with pytest.raises(cg.CglaError, match="has no certificate"):
        certificate_of_run(replace(run, certificate=None))


# the corridor


@pytest.mark.slow
def test_certify_tells_of_the_corridor(cgla: Call) -> None:
    words = ("certify", "free.toml", "--tolerance", "0.02")
    answer = cgla(*words, "--within", "10%", "--out", "out")
    assert (answer.code, answer.err) == (0, "")
    said = lines_of(answer)
    assert said["corridor"].startswith("every path within 10 % of the best possible stays in ")
    assert said["ways"] == "1"
    names = {file.name for file in Path("out").iterdir() if "corridor" in file.name}
    assert names == {f"free-hybrid-corridor.{ending}" for ending in ("geojson", "csv", "png", "svg")}
    found = cgla(*words, "--within", "0.1", "--json").document()["corridor"]
    own = cg.lower_bound(load_scenario("free.toml").problem, 0.02).corridor(0.1).document()
    assert {key: value for key, value in found.items() if key != "seconds"} == {
        key: value for key, value in own.items() if key != "seconds"
    }


def test_certify_of_a_map_without_a_path_has_an_empty_corridor(cgla: Call) -> None:
    answer = cgla("certify", "shut.toml", "--within", "1%")
    assert answer.code == console.MISSING
    assert lines_of(answer)["corridor"].endswith("stays in none of the map")


@pytest.mark.parametrize("share", ["-1%", "x", "nan", "%", "inf"])
def test_certify_refuses_shares_that_are_none(cgla: Call, share: str) -> None:
    answer = cgla("certify", "small.toml", f"--within={share}")
    assert answer.code == 2
    assert "give a percentage such as 1%" in answer.err
    cgla("certify", "small.toml", "--within", "5").refused("'5', which may be 5 % or 500 %", "with a percent sign")

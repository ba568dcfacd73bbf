"""A command prints what Python answers: the same numbers, to the last digit, for every kind of map."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from command_line import Call, caller

import cgla_graph as cg
from cgla_graph.model.solution import Solution

ENDS = "start = [1, 1]\ngoal = [9, 8]\nk = 20\nbounds = [0, 0, 10, 10]\n"
THREATS = "threats = [{ x = 4, y = 4, spread = 1.0, peak = 0.8 }, { x = 7, y = 3, spread = 0.8 }]\n"
MAPS = {
    "threats": ENDS + THREATS,
    "walls": ENDS + "[no_fly]\npolygons = [[[3, 2], [5, 2], [5, 9], [3, 9]], [[6, 0], [7, 0], [7, 6], [6, 6]]]\n",
    "raster": ENDS + "[[rasters]]\nfile = 'cells.npy'\nbounds = [0, 0, 10, 10]\ninterpolation = 'bilinear'\n",
    "degrees": (
        "coordinates = 'lonlat'\nbounds = [-12, 57, 12, 71]\nstart = [-8, 60]\ngoal = [8, 60]\nk = 3\n"
        "threats = [{ x = 0, y = 67, spread = 90000 }]\n"
        "[no_fly]\npolygons = [[[-4, 56], [4, 56], [4, 64], [-4, 64]]]\n"
    ),
}
every_map = pytest.mark.parametrize("name", MAPS)


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """Call the command line in a folder with a map of every kind."""
    for name, text in MAPS.items():
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    np.save(tmp_path / "cells.npy", np.random.default_rng(1).uniform(0.0, 0.5, (4, 4)))
    (tmp_path / "roads.csv").write_text("a,b,2\nb,c,1\na,c,5\nc,d,3\n", encoding="utf-8")
    return caller(tmp_path, monkeypatch, capfd)


def agrees(document: dict[str, Any], solution: Solution) -> None:
    """Check all numbers of a path."""
    for name in ("cost", "length", "risk", "lower_bound", "gap", "clearance"):
        value = getattr(solution, name)
        assert document[name] == (value if math.isfinite(value) else None), name
    assert document["path"] == solution.path.tolist()
    assert (document["status"], document["waypoints"]) == (solution.status.label, len(solution.path))


def certified(document: dict[str, Any], proof: cg.Certificate) -> None:
    """Check all numbers of a proof."""
    for name in ("lower_bound", "upper_bound", "gap", "tolerance", "reached", "spacing", "cells", "message"):
        assert document["certificate"][name] == getattr(proof, name), name


@every_map
def test_a_plan_is_what_solve_and_lower_bound_say(cgla: Call, name: str) -> None:
    document = cgla("plan", f"{name}.toml", "--json").document()
    problem = cg.load_scenario(f"{name}.toml").problem
    best = cg.solve(problem)
    agrees(document, best)
    certified(document, best.certificate)
    certified(document, cg.lower_bound(problem, path=best.path))


@every_map
def test_the_path_of_another_solver_is_held_against_the_same_bound(cgla: Call, name: str) -> None:
    document = cgla("plan", f"{name}.toml", "--solver", "cgla", "--tolerance", "0.02", "--json").document()
    scenario = cg.load_scenario(f"{name}.toml")
    found = cg.solve(scenario.problem, "cgla", resolution=scenario.lattice)
    proof = cg.lower_bound(scenario.problem, 0.02, path=found.path)
    certified(document, proof)
    assert (document["cost"], document["lower_bound"]) == (found.cost, proof.lower_bound)
    assert document["gap"] == found.cost / proof.lower_bound - 1.0


@every_map
def test_certify_is_lower_bound(cgla: Call, name: str) -> None:
    document = cgla("certify", f"{name}.toml", "--tolerance", "0.02", "--json").document()
    problem = cg.load_scenario(f"{name}.toml").problem
    proof = cg.lower_bound(problem, 0.02, path=cg.solve(problem, tolerance=None).path)
    certified(document, proof)
    assert [grid["lower_bound"] for grid in document["grids"]] == [grid.lower_bound for grid in proof.grids]


@every_map
def test_without_a_proof_both_have_the_path_alone(cgla: Call, name: str) -> None:
    document = cgla("plan", f"{name}.toml", "--no-certificate", "--json").document()
    agrees(document, cg.solve(cg.load_scenario(f"{name}.toml").problem, tolerance=None))
    assert document["certificate"] is None


@pytest.mark.parametrize("name", ["threats", "degrees"])
def test_a_front_is_what_pareto_says(cgla: Call, name: str) -> None:
    document = cgla("pareto", f"{name}.toml", "--solver", "cgla", "--json").document()
    scenario = cg.load_scenario(f"{name}.toml")
    front = cg.pareto(scenario.problem, solver="cgla", resolution=scenario.lattice)
    assert document["error"] == front.error
    assert [(one["k"], one["cost"], one["path"]) for one in document["points"]] == [
        (point.k, point.cost, point.path.tolist()) for point in front
    ]


@pytest.mark.parametrize(
    ("option", "plan"), [("--max-risk", cg.plan_within_risk), ("--max-length", cg.plan_within_length)]
)
def test_a_budget_is_planned_for_as_in_python(cgla: Call, option: str, plan: Callable[..., Any]) -> None:
    budget = {"--max-risk": 20_000.0, "--max-length": 1_400_000.0}[option]
    words = ("plan", "degrees.toml", option, budget, "--tolerance", "0.02", "--json")
    document = cgla(*words).document()
    found = plan(cg.load_scenario("degrees.toml").problem, budget, tolerance=0.02)
    agrees(document, found.solution)
    assert document["within"]["dual_bound"] == found.dual_bound
    assert document["within"]["duality_gap"] == found.gap


def test_turns_are_those_of_flyable(cgla: Call) -> None:
    document = cgla("plan", "walls.toml", "--turn-radius", "0.4", "--json").document()
    agrees(document, cg.flyable(cg.solve(cg.load_scenario("walls.toml").problem), 0.4))


def test_a_graph_is_planned_on_as_in_python(cgla: Call) -> None:
    document = cgla("graph", "plan", "roads.csv", "--from", "a", "--to", "d", "--json").document()
    (row,) = document["runs"]
    roads = nx.Graph()
    roads.add_weighted_edges_from([("a", "b", 2), ("b", "c", 1), ("a", "c", 5), ("c", "d", 3)])
    found = cg.solve(cg.GraphProblem(cg.GeometricGraph.from_networkx(roads), "a", "d"))
    assert (row["cost"], row["path"], row["status"]) == (found.cost, list(found.nodes), found.status.label)


def test_a_mission_is_flown_as_in_python(cgla: Call) -> None:
    document = cgla("fly", "fig9", "--json").document()
    for flight, mission in zip(
        document["flights"], cg.load_mission("fig9").missions(cg.solvers.get).values(), strict=True
    ):
        found = mission.fly()
        uavs = {uav["name"]: (uav["cost"], uav["length"], uav["risk"]) for uav in flight["uavs"]}
        assert uavs == {name: (one.cost, one.length, one.risk) for name, one in found.uavs.items()}

"""Commands print what Python answers: the same numbers, for every kind of map."""

from pathlib import Path
from typing import Any

import networkx as nx
import pytest
from command_line import Call

import cgla_graph as cg
from cgla_graph.comparisons.study.options import MapOptions, open_one
from cgla_graph.scenarios.scenario import Scenario

ASC = "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n0 5 0 0\n0 5 0 0\n0 0 0 1\n"
ROOM = "type octile\nheight 4\nwidth 5\nmap\n.....\n..@..\n..@..\n.....\n"
#: A map of each kind: in the plane, with walls, in degrees, a raster, a grid.
MAPS: dict[str, tuple[str, dict[str, Any]]] = {
    "plane": ("one-threat", {}),
    "walls": ("thin-wall", {}),
    "degrees": ("bay.toml", {"k": 50.0}),
    "raster": ("risk.asc", {"start": "0.5,0.5", "goal": "3.5,2.5", "k": 2.0}),
    "grid": ("room.map", {"start": "0.5,1.5", "goal": "4.5,1.5"}),
}
LOOSE = ("--tolerance", 0.05)
BAY = """
coordinates = "lonlat"
bounds = [24.0, 60.0, 25.0, 60.5]
start = [24.1, 60.2]
goal = [24.9, 60.3]
k = 5
threats = [{ x = 24.6, y = 60.25, spread = 3000 }]
no_fly = { polygons = [[[24.3, 60.0], [24.4, 60.0], [24.4, 60.3], [24.3, 60.3]]] }
lattice = { resolution = 12 }
"""
FILES = {"risk.asc": ASC, "room.map": ROOM, "bay.toml": BAY}


def opened(kind: str) -> tuple[Scenario, list[object]]:
    """Open a map as the command does; return also how it is named there."""
    spec, changes = MAPS[kind]
    words = [word for name, value in changes.items() for word in (f"--{name}", value)]
    return open_one("plan", spec, MapOptions(**changes)), [spec, *words]


def lasting(document: dict[str, Any]) -> dict[str, Any]:
    """Leave out what differs from run to run: times."""
    return {key: value for key, value in document.items() if "seconds" not in key}


@pytest.mark.parametrize("solver", ["hybrid", "cgla"])
@pytest.mark.parametrize("kind", MAPS)
def test_a_plan(kind: str, solver: str, cgla: Call) -> None:
    scenario, words = opened(kind)
    document = cgla("plan", *words, "--solver", solver, *LOOSE, "--json").document()
    settings = {"tolerance": 0.05} if solver == "hybrid" else {"resolution": scenario.lattice}
    found = cg.solve(scenario.problem, solver, **settings)
    proof = cg.lower_bound(scenario.problem, 0.05, path=found.path)
    numbers = found.cost, found.length, found.risk, proof.lower_bound, found.path.tolist()
    assert tuple(document[key] for key in ("cost", "length", "risk", "lower_bound", "path")) == numbers
    assert document["gap"] == found.cost / proof.lower_bound - 1.0 == proof.gap
    # there was no budget
    assert "within" not in document
    assert lasting(document["certificate"]) == {"scenario": scenario.name, **lasting(proof.document())}


@pytest.mark.parametrize("kind", MAPS)
def test_a_certificate(kind: str, cgla: Call) -> None:
    scenario, words = opened(kind)
    document = cgla("certify", *words, *LOOSE, "--json").document()
    found = cg.solve(scenario.problem, "hybrid", tolerance=None)
    proof = cg.lower_bound(scenario.problem, 0.05, path=found.path)
    assert lasting(document["certificate"]) == {"scenario": scenario.name, **lasting(proof.document())}
    assert document["path"] == found.path.tolist()


@pytest.mark.parametrize("kind", ["plane", "walls", pytest.param("raster", marks=pytest.mark.slow)])
def test_a_front(kind: str, cgla: Call) -> None:
    scenario, words = opened(kind)
    document = cgla("pareto", *words, "--solver", "cgla", "--json").document()
    found = cg.pareto(scenario.problem, solver="cgla", resolution=scenario.lattice).document()
    assert {key: document[key] for key in found} == found


def test_a_plan_within_a_budget(cgla: Call) -> None:
    scenario, words = opened("plane")
    document = cgla("plan", *words, "--solver", "cgla", "--max-length", 1.3, "--json").document()
    found = cg.plan_within_length(scenario.problem, 1.3, solver="cgla", resolution=scenario.lattice)
    assert document["within"] == found.document()
    assert document["path"] == found.solution.path.tolist()


@pytest.mark.parametrize(("kind", "solver"), [("plane", "hybrid"), ("degrees", "cgla")])
def test_the_tolerance_is_the_same_unless_said(kind: str, solver: str, cgla: Call) -> None:
    scenario, words = opened(kind)
    document = cgla("plan", *words, "--solver", solver, "--json").document()
    found = cg.solve(scenario.problem, solver, **({} if solver == "hybrid" else {"resolution": scenario.lattice}))
    assert document["lower_bound"] == cg.lower_bound(scenario.problem, path=found.path).lower_bound
    if solver == "hybrid":
        assert (document["lower_bound"], document["gap"]) == (found.lower_bound, found.gap)


@pytest.mark.slow
def test_a_budget_on_the_earth(cgla: Call) -> None:
    scenario, words = opened("degrees")
    document = cgla("plan", *words, "--max-length", 5.2e4, *LOOSE, "--json").document()
    found = cg.plan_within_length(scenario.problem, 5.2e4, tolerance=0.05)
    assert document["within"] == found.document()
    assert document["path"] == found.solution.path.tolist()


@pytest.mark.parametrize("flight", [{}, {"speed": 2.0, "power": 100.0}])
def test_turns(flight: dict[str, float], cgla: Call) -> None:
    scenario, words = opened("walls")
    more = [word for name, value in flight.items() for word in (f"--{name}", value)]
    document = cgla("plan", *words, "--turn-radius", 0.02, "--goal-heading", 90, *more, *LOOSE, "--json").document()
    found = cg.flyable(cg.solve(scenario.problem, tolerance=0.05), 0.02, goal_heading=90.0)
    assert (document["cost"], document["lower_bound"], document["gap"]) == (found.cost, found.lower_bound, found.gap)
    assert document["flyable"] == found.document(flight.get("speed"), power=flight.get("power"))


def test_flight_times(cgla: Call) -> None:
    scenario, words = opened("degrees")
    numbers = {"speed": 20.0, "power": 300.0, "climb_rate": 3.0, "descent_rate": 2.0}
    more = [word for name, value in numbers.items() for word in (f"--{name.replace('_', '-')}", value)]
    altitude = {"battery": 9000, "altitude": 80}
    more += [word for name, value in altitude.items() for word in (f"--{name}", value)]
    document = cgla("plan", *words, *more, "--wind", "3,-4", *LOOSE, "--json").document()
    found = cg.flight_time(cg.solve(scenario.problem, tolerance=0.05), **numbers, **altitude, wind=(3, -4))
    assert document["flight"] == found.document()
    assert found.within_battery is True
    # a plan commands the speed over the ground
    exported = cgla("plan", *words, *more, "--wind", "3,-4", *LOOSE, "--export", "mine.plan", "--json").document()
    plan = cg.read_plan("mine.plan")
    same = cg.flight_time(plan, **numbers, battery=9000, wind=(3, -4))
    assert exported["flight"]["seconds"] == pytest.approx(same.seconds, rel=1e-4)
    assert exported["flight"]["seconds"] > document["flight"]["seconds"]


def test_a_graph(cgla: Call) -> None:
    roads: nx.Graph[str] = nx.Graph()
    roads.add_weighted_edges_from([("a", "b", 2.0), ("b", "c", 1.0), ("a", "c", 5.0)])
    Path("roads.csv").write_text("".join(f"{u},{v},{w}\n" for u, v, w in roads.edges(data="weight")), encoding="utf-8")
    (row,) = cgla("graph", "plan", "roads.csv", "--from", "a", "--to", "c", "--json").document()["runs"]
    found = cg.solve(cg.GraphProblem(cg.GeometricGraph.from_networkx(roads), "a", "c"))
    assert (row["cost"], row["path"], row["status"]) == (found.cost, list(found.nodes), found.status.label)


@pytest.mark.parametrize("mission", ["fig9", "swap", "finland-popup"])
def test_a_mission(mission: str, cgla: Call) -> None:
    flights = cgla("fly", mission, "--no-value", "--json").document()["flights"]
    missions = cg.load_mission(mission).missions(cg.solvers.get).values()
    for printed, flown in zip(flights, (one.fly() for one in missions), strict=True):
        found = flown.document()
        for uav, same in zip(found.pop("uavs"), printed["uavs"], strict=True):
            assert lasting({key: same[key] for key in uav}) == lasting(uav)
        assert {key: printed[key] for key in found} == found


def test_limits_of_the_density(cgla: Call) -> None:
    scenario, words = opened("raster")
    document = cgla("pareto", *words, "--corridor", 0.2, "--json").document()
    front = cg.density_front(scenario.problem, corridor=0.2, tolerance=None)
    assert document["points"] == [point.document() for point in front]

"""Arguments of the wrong type, and answers of solvers that are none: one line each that names the remedy."""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import igraph
import networkx as nx
import numpy as np
import pytest
import rustworkx
import scipy.sparse
import shapely

import cgla_graph as cg
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.errors import CglaError, ProblemError, SolverFaultError
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.checks import check_solver
from cgla_graph.solvers.exact.cgla import Cgla

THREAT = cg.Threat(0.5, 0.5, 0.1)
FIELD = cg.RiskField([THREAT])
RASTER = cg.RasterRisk([[1.0, 2.0]], (0, 0, 1, 1))
PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.9), FIELD, k=1.0)
ON_RASTER = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(rasters=[RASTER]), k=1.0)
ON_PEOPLE, ON_FATALITIES = (
    cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(rasters=[cg.RasterRisk([[1.0, 2.0]], (0, 0, 1, 1), unit=unit)]))
    for unit in ("people/km2", "fatalities/m")
)
ON_FLOWN = cg.flown_over(ON_PEOPLE, failures_per_hour=1.0, speed=1.0, lethal_area=1.0)
ROADS: "nx.DiGraph[str]" = nx.DiGraph([("a", "b", {"weight": 1.0}), ("b", "c", {"weight": 1.0})])
GRAPH = cg.GeometricGraph.from_matrix(
    [[0, 1, 5], [1, 0, 1], [5, 1, 0]], labels="abc", positions=[(0, 0), (1, 0), (1, 1)]
)
ON_GRAPH = cg.GraphProblem(GRAPH, "a", "c")
STRAIGHT = PROBLEM.judge(cg.Solution(cg.Status.FOUND, path=np.array([(0.1, 0.1), (0.9, 0.9)])))
MATRIX = cg.cost_matrix(GRAPH, "c")
LATTICE = cg.Lattice(3, bounds=(0, 0, 1, 1))
PLAN = cg.FlightPlan.along([(24.0, 60.0), (24.1, 60.0)], altitude=80)
ABOVE_GROUND = cg.FlightPlan.along([(24.1, 60.1), (24.2, 60.1)], altitude=80, reference="ground")
GROUND = Ground(np.zeros((9, 9)), (24.0, 60.0, 25.0, 61.0))
TIMED = cg.TimedProblem((0.1, 0.1), (0.9, 0.9), FIELD, speed=1.0)
UAV = cg.Uav("u", (0.1, 0.1), (0.9, 0.9), 0.2, step=0.05)

#: What beginners give, and what fuzzers give.
WRONG: dict[str, Any] = {
    "None": None, "a name": "x", "an int": 7, "a float": 1.5, "nan": float("nan"), "a list": [1], "lists": [[1]],
    "a dict": {"a": 1}, "a file": Path("no.toml"), "a networkx graph": ROADS, "an array": np.zeros((2, 2)),
    "a sparse array": scipy.sparse.csr_array(np.eye(2)), "a problem": PROBLEM, "a graph problem": ON_GRAPH,
    "a graph": GRAPH, "a solution": STRAIGHT, "a class": Cgla, "a solver": Cgla(), "an object": object(),
    "a scenario": cg.load_scenario("paper"), "a geometry": shapely.box(0, 0, 1, 1), "a function": len, "bytes": b"x",
    "a cost matrix": MATRIX, "a plan": PLAN, "complex": 1j, "a set": {1}, "true": True,
}  # fmt: skip

#: Calls that work, each argument by its name; those that take long are made with few wrong arguments.
CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Threat": (cg.Threat, {"x": 0.5, "y": 0.5, "spread": 0.1, "peak": 0.9}),
    "RiskField": (cg.RiskField, {"threats": [THREAT], "rasters": []}),
    "RasterRisk": (
        cg.RasterRisk,
        {"values": [[1.0]], "bounds": (0, 0, 1, 1), "interpolation": "nearest", "origin": "upper", "scale": 1.0,
         "nodata": 0.0},
    ),
    "from_file": (cg.RasterRisk.from_file, {"path": "a.csv", "bounds": (0, 0, 1, 1), "kind": "density", "nodata": 0.0}),
    "UncertainField": (cg.UncertainField, {"scenarios": [FIELD, FIELD], "probabilities": [0.5, 0.5], "sampler": None}),
    "sample_field": (
        cg.sample_field,
        {"problem": PROBLEM, "count": 2, "place": 0.1, "spread": 0.1, "peak": 0.1, "rasters": None,
         "probabilities": None, "seed": 0},
    ),
    "read_scenarios": (cg.read_scenarios, {"files": "no.toml", "problem": PROBLEM}),
    "NoFlyArea": (cg.NoFlyArea, {"geometry": shapely.box(0, 0, 1, 1)}),
    "CostModel": (cg.CostModel, {"field": FIELD, "k": 1.0, "no_fly": None}),
    "Problem": (
        cg.Problem,
        {"start": (0.1, 0.1), "goal": (0.9, 0.9), "field": FIELD, "k": 1.0, "bounds": (0, 0, 1, 1), "no_fly": None,
         "clearance": 0.0, "projection": None},
    ),
    "in_degrees": (
        cg.Problem.in_degrees,
        {"start": (24, 60), "goal": (25, 60), "bounds": (23, 59, 26, 61), "threats": [], "rasters": [], "k": 1.0,
         "no_fly": None, "clearance": 0.0, "projection": None},
    ),
    "on_lattice": (PROBLEM.on_lattice, {"resolution": 3, "extra": ()}),
    "on_eight_connected": (PROBLEM.on_eight_connected, {"resolution": 3, "corner_rule": "touch"}),
    "evaluate": (PROBLEM.evaluate, {"path": [(0.1, 0.1), (0.9, 0.9)]}),
    "judge": (PROBLEM.judge, {"solution": STRAIGHT}),
    "judge on a graph": (ON_GRAPH.judge, {"solution": cg.Solution(cg.Status.FOUND, nodes="abc")}),
    "evaluate on a graph": (ON_GRAPH.evaluate, {"nodes": ["a", "b"]}),
    "GraphProblem": (cg.GraphProblem, {"graph": GRAPH, "source": "a", "target": "c"}),
    "Lattice": (cg.Lattice, {"resolution": 3, "bounds": (0, 0, 1, 1), "kind": "closed"}),
    "complete": (cg.GeometricGraph.complete, {"points": [(0, 0), (1, 1)], "field": FIELD, "k": 1.0, "extra": ()}),
    "eight_connected": (
        cg.GeometricGraph.eight_connected,
        {"lattice": LATTICE, "field": FIELD, "k": 1.0, "no_fly": None, "extra": (), "corner_rule": "touch"},
    ),
    "from_networkx": (cg.GeometricGraph.from_networkx, {"graph": ROADS, "weight": "weight", "pos": "pos"}),
    "from_igraph": (cg.GeometricGraph.from_igraph, {"graph": igraph.Graph(2)}),
    "from_rustworkx": (cg.GeometricGraph.from_rustworkx, {"graph": rustworkx.generators.empty_graph(2)}),
    "from_matrix": (
        cg.GeometricGraph.from_matrix, {"matrix": [[0, 1], [1, 0]], "labels": "ab", "positions": [(0, 0), (1, 1)]},
    ),
    "from_sparse": (
        cg.GeometricGraph.from_sparse,
        {"matrix": scipy.sparse.csr_array(np.eye(2)), "directed": True, "labels": "ab", "positions": [(0, 0), (1, 1)]},
    ),
    "index_of": (GRAPH.index_of, {"node": "a"}),
    "node_at": (GRAPH.node_at, {"place": (0, 0)}),
    "weight": (GRAPH.weight, {"tail": 0, "head": 1}),
    "weights_from": (GRAPH.weights_from, {"index": 0}),
    "weights_to": (GRAPH.weights_to, {"index": 0}),
    "under": (GRAPH.under, {"model": PROBLEM.model}),
    "cost_matrix": (
        cg.cost_matrix,
        {"graph": GRAPH, "target": "c", "source": "a", "schedule": "label-setting", "order": None, "seed": None},
    ),
    "value": (MATRIX.value, {"node": "a"}),
    "path_from": (MATRIX.path_from, {"node": "a"}),
    "check_theorem_1": (cg.check_theorem_1, {"graph": GRAPH, "target": "c", "source": "a", "matrix": None}),
    "solve": (
        cg.solve,
        {"problem": PROBLEM, "solver": "dijkstra", "resolution": 3, "on": None, "refine": False, "isolated": False},
    ),
    "solve under an objective": (
        cg.solve, {"problem": PROBLEM, "solver": "dijkstra", "resolution": 3, "objective": "cvar", "alpha": 0.5},
    ),
    "solve on a graph": (cg.solve, {"problem": ON_GRAPH, "solver": "cgla"}),
    "lower_bound": (cg.lower_bound, {"problem": None, "tolerance": 0.5, "path": STRAIGHT.path, "max_cells": 20_000}),
    "save_proof": (
        cg.save_proof,
        {"problem": PROBLEM, "file": "one.proof", "path": STRAIGHT.path, "tolerance": 0.9, "known": 9.0, "bound": 0.1},
    ),
    "verify_proof": (cg.verify_proof, {"file": "one.proof", "problem": PROBLEM}),
    "pareto": (
        cg.pareto,
        {"problem": None, "solver": "cgla", "resolution": 3, "max_points": 3, "k_max": None, "proven": False,
         "budgets": ()},
    ),
    "plan_within_risk": (cg.plan_within_risk, {"problem": None, "max_risk": 1.0, "solver": "cgla", "resolution": 3}),
    "plan_within_length": (cg.plan_within_length, {"problem": None, "max_length": 3.0, "solver": "cgla"}),
    "plan_within_energy": (
        cg.plan_within_energy,
        {"problem": None, "max_energy": 3.0, "aircraft": cg.Aircraft(1.0, power=9.0), "solver": "cgla"},
    ),
    "tour": (
        cg.tour,
        {"problem": PROBLEM, "places": [(0.5, 0.5)], "order": "best", "solver": "straight-line", "resolution": 3,
         "tolerance": None, "refine": False},
    ),
    "Map": (cg.Map, {"problem": PROBLEM}),
    "read_pairs": (cg.read_pairs, {"file": "pairs.csv", "problem": PROBLEM}),
    "Map.solve": (
        cg.Map(PROBLEM).solve,
        {"starts": [PROBLEM.goal], "goals": None, "names": None, "tolerance": 0.5},
    ),
    "Map.isochrones": (cg.Map(PROBLEM).isochrones, {"costs": [0.2], "goal": None, "steps": 16}),
    "below_density": (cg.below_density, {"problem": ON_RASTER, "level": 3.0, "corridor": 0.0}),
    "density_front": (cg.density_front, {"problem": None, "solver": "straight-line", "levels": [3.0], "corridor": 0.0}),
    "ground_risk": (
        cg.ground_risk,
        {"people": RASTER, "unit": "people/km2", "failures_per_hour": 1.0, "speed": 1.0, "lethal_area": 1.0,
         "fatality": 1.0},
    ),
    "FailureModel": (cg.FailureModel, {"failures_per_hour": 1.0, "speed": 1.0, "lethal_area": 1.0, "fatality": 1.0}),
    "people_of": (cg.people_of, {"problem": None}),
    "flown_over": (
        cg.flown_over,
        {"problem": ON_PEOPLE, "failures_per_hour": 1.0, "speed": 1.0, "lethal_area": 1.0, "fatality": 1.0},
    ),
    "at_prices": (cg.at_prices, {"problem": ON_FATALITIES, "prevented_fatality": 1.0, "metre": 1.0}),
    "exposure": (
        cg.exposure,
        {"problem": ON_FLOWN, "path": [(0.1, 0.1)], "corridor": 0.0, "max_density": 3.0, "target": 1.0},
    ),
    "risk_weight": (cg.risk_weight, {"prevented_fatality": 1.0, "metre": 1.0}),
    "flyable": (cg.flyable, {"solution": None, "turn_radius": 0.1, "start_heading": None, "goal_heading": None}),
    "save": (STRAIGHT.save, {"file": "out.csv"}),
    "animate": (cg.animate, {"flight": None}),
    "progress": (cg.progress, {"on": False}),
    "read_path": (cg.read_path, {"file": "path.csv", "problem": PROBLEM}),
    "read_plan": (cg.read_plan, {"path": "no.plan"}),
    "write_plan": (cg.write_plan, {"plan": PLAN, "path": "out.plan"}),
    "read_zones": (cg.read_zones, {"files": "no.json"}),
    "load_scenario": (
        cg.load_scenario,
        {"name": "paper", "start": None, "goal": None, "bounds": None, "clearance": None, "no_fly": (), "zones": None},
    ),
    "load_mission": (cg.load_mission, {"name": "none", "clearance": None}),
    "write_scenario": (cg.write_scenario, {"scenario": PROBLEM, "path": "out.toml", "title": None, "overwrite": True}),
    "check": (
        cg.check,
        {"plan": STRAIGHT.path, "on": PROBLEM, "zones": (), "altitude": None, "at": None, "treat": None, "ground": None,
         "k": None, "clearance": None, "tolerance": None, "through": 1, "aircraft": None},
    ),
    "Aircraft": (
        cg.Aircraft,
        {"speed": 9.0, "wind": (0, 0), "power": 9.0, "battery": 9.0, "reserve": 0.1, "climb_rate": 9.0,
         "descent_rate": 9.0},
    ),
    "flight_time": (
        cg.flight_time,
        {"flight": STRAIGHT, "aircraft": None, "speed": 9.0, "wind": (0, 0), "power": 9.0, "battery": 9.0,
         "reserve": 0.1, "climb_rate": 9.0, "descent_rate": 9.0, "altitude": 9.0, "above": "home",
         "ground_speed": 9.0},
    ),
    "footprint_density": (
        cg.footprint_density, {"people": RASTER, "radius": 0.1, "ahead": 0.0, "outside": 0.0},
    ),
    "volumes": (
        cg.volumes,
        {"flight": STRAIGHT, "settings": None, "height": 60.0, "altitude": None, "above": "home", "ground": None,
         "projection": None, "name": "", "arc_tolerance": None, "speed": 9.0, "dimension": 1.0, "pitch": 30.0},
    ),
    "VolumeSettings": (
        cg.VolumeSettings,
        {"speed": 9.0, "dimension": 1.0, "pitch": 30.0, "roll": None, "width": None, "gnss_error": 3.0,
         "reaction_time": 1.0, "buffer": "1:1", "contingency_width": None},
    ),
    "best_altitude": (
        cg.best_altitude,
        {"open_at": lambda _: PROBLEM, "altitudes": [60.0], "solver": "straight-line", "tolerance": None},
    ),
    "read_ground": (cg.read_ground, {"path": "no.tif"}),
    "terrain_area": (
        cg.terrain_area,
        {"ground": GROUND, "altitude": 80.0, "box": (24.0, 60.0, 25.0, 61.0), "clearance": 30.0, "homes": None,
         "map_box": None},
    ),
    "follow_terrain": (
        cg.follow_terrain, {"plan": ABOVE_GROUND, "ground": GROUND, "tolerance": 10.0, "clearance": 30.0},
    ),
    "FlightPlan": (
        cg.FlightPlan, {"waypoints": PLAN.waypoints, "home": None, "name": "", "coordinates": "lonlat"},
    ),
    "along": (cg.FlightPlan.along, {"lonlat": [(24.0, 60.0)], "altitude": None, "reference": "home", "speed": None}),
    "Waypoint": (
        cg.Waypoint,
        {"x": 1.0, "y": 1.0, "altitude": None, "reference": "home", "speed": None, "role": "waypoint",
         "loiter_radius": 0.0, "turns": 0.0, "stay": 0.0},
    ),
    "Uav": (
        cg.Uav,
        {"name": "u", "start": (0.1, 0.1), "goal": (0.9, 0.9), "detection_radius": 0.2, "step": 0.05, "k": 1.0,
         "safe_distance": None, "departs": 0, "colour": None},
    ),
    "World": (cg.World, {"field": FIELD, "bounds": (0, 0, 1, 1), "no_fly": None, "timed": ()}),
    "TimedThreat": (cg.TimedThreat, {"threat": THREAT, "appears": 0, "vanishes": None, "moves": ()}),
    "MovingThreat": (cg.MovingThreat, {"track": [(0, 0, 0), (1, 1, 1)], "spread": 0.1, "peak": (0.5, 1.0)}),
    "TimedProblem": (
        cg.TimedProblem,
        {"start": (0.1, 0.1), "goal": (0.9, 0.9), "field": FIELD, "moving": (), "areas": (), "speed": 1.0, "k": 1.0,
         "bounds": (0, 0, 1, 1), "departure": (0, 1), "wind": (0, 0), "no_fly": None, "fields": [(1, FIELD)],
         "waiting": 1.0, "latest": 9, "clearance": 0.0, "risk_per": "time", "projection": None,
         "others": [], "separation": 0.0},
    ),
    "Wind": (cg.Wind, {"u": [[1.0, 2.0]], "v": [[0.0, 0.0]], "bounds": (0, 0, 1, 1), "times": None}),
    "TimedProblem.evaluate": (TIMED.evaluate, {"trajectory": [(0, 0, 0), (1, 1, 0)]}),
    "TimedProblem.fly": (TIMED.fly, {"path": [(0, 0), (1, 0)], "departure": 0.0}),
    "solve_team": (
        cg.solve_team,
        {"problems": [TIMED], "separation": 0.1, "nodes": 1000, "orders": 1, "seed": 0, "tolerance": None,
         "max_cells": 1000},
    ),
    "TimedArea": (cg.TimedArea, {"polygon": shapely.box(0, 0, 1, 1), "appears": 0, "vanishes": None}),
    "Sharing": (cg.Sharing, {"is_on": True, "radius": None, "delay": 0, "loss": 0.0, "seed": 0}),
    "VirtualObstacle": (cg.VirtualObstacle, {"stepnum": 3, "spread": None, "placement": "replace", "zones": "two"}),
    "Mission": (
        cg.Mission,
        {"world": cg.World(FIELD), "uavs": [UAV], "solver": Cgla(), "resolution": 3, "sharing": "global",
         "virtual_obstacle": None, "replan": "change", "arrival_radius": 0.0, "max_ticks": None, "clearance": 0.0},
    ),
    "get": (cg.solvers.get, {"name": "cgla"}),
    "names": (cg.solvers.names, {"installed": True}),
    "Solution": (cg.Solution, {"status": cg.Status.FOUND}),
    "density": (FIELD.density, {"points": [(0, 0)]}),
    "line_integral": (FIELD.line_integral, {"starts": [(0, 0)], "ends": [(1, 1)]}),
    "area_above": (RASTER.area_above, {"level": 1.0, "buffer": 0.0}),
    "scaled": (RASTER.scaled, {"factor": 1.0}),
}  # fmt: skip


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in {"flyable", "save_proof"} else n for n in CALLS]
)
def test_a_wrong_argument_has_one_line_that_names_the_remedy(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    call, arguments = CALLS[name]
    refused = 0
    for argument in arguments:
        for kind, value in WRONG.items():
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    call(**{**arguments, argument: value})
            except CglaError as error:
                refused += 1
                message = str(error)
                assert "\n" not in message, f"{argument}: {kind}: {message}"
                assert any(mark in message for mark in ("; ", ": ")), f"{argument}: {kind}: {message}"
            except Exception as error:  # noqa: BLE001 - which is what the test looks for
                pytest.fail(f"{argument}: {kind}: {type(error).__name__}: {error}")
    assert refused


def test_every_public_function_is_called() -> None:
    """Only those that take anything, and classes that the library makes, are left out."""
    called = {call for call, _ in CALLS.values()} | {
        cg.plot,
        cg.Certificate,
        cg.Corridor,
        cg.CostMatrix,
        cg.Evaluation,
        cg.Flight,
        cg.TimedEvaluation,
        cg.TimedPlan,
        cg.TimedCertificate,
        cg.TeamPlan,
    }
    kinds = (cg.Scenario, cg.Status, cg.MissionStatus, cg.CglaError, cg.GeometricGraph)
    # (a test of old names may have imported a module named like a function)
    public = [one for one in (getattr(cg, name) for name in cg.__all__) if not isinstance(one, ModuleType)]
    assert [one for one in public if callable(one) and one not in called and one not in kinds] == []


@pytest.mark.parametrize(
    "kind",
    [
        kind
        for kind in WRONG
        if kind
        not in {"a problem", "a graph problem", "a graph", "a solution", "a cost matrix", "a plan", "a scenario"}
    ],
)
def test_things_without_a_picture_are_named(kind: str) -> None:
    with pytest.raises(CglaError, match="; give"):
        cg.plot(WRONG[kind])


FIRST_HOUR: dict[str, tuple[Callable[[], Any], str]] = {
    "a graph of networkx": (lambda: cg.GraphProblem(ROADS, "a", "b"), r"a DiGraph; give GeometricGraph.from_networkx"),  # type: ignore[arg-type]
    "its matrix": (lambda: cg.cost_matrix(ROADS, "a"), r"a DiGraph; give GeometricGraph.from_networkx\(graph\)"),  # type: ignore[arg-type]
    "its theorem": (lambda: cg.check_theorem_1(ROADS, "a"), "from_networkx"),  # type: ignore[arg-type]
    "an igraph": (lambda: cg.cost_matrix(igraph.Graph(2), 0), "from_igraph"),  # type: ignore[arg-type]
    "a rustworkx": (lambda: cg.cost_matrix(rustworkx.PyGraph(), 0), "from_rustworkx"),  # type: ignore[arg-type]
    "an array": (lambda: cg.cost_matrix(np.eye(2), 0), "an ndarray; give GeometricGraph.from_matrix"),  # type: ignore[arg-type]
    "a csr": (lambda: cg.cost_matrix(scipy.sparse.csr_array(np.eye(2)), 0), "from_sparse"),  # type: ignore[arg-type]
    "a graph problem": (lambda: cg.cost_matrix(ON_GRAPH, "c"), "as problem.graph"),  # type: ignore[arg-type]
    "a problem": (lambda: cg.cost_matrix(PROBLEM, "c"), "on_lattice"),  # type: ignore[arg-type]
    "a sparse matrix": (lambda: cg.GeometricGraph.from_matrix(scipy.sparse.csr_array(np.eye(2))), "from_sparse"),
    "a graph as matrix": (lambda: cg.GeometricGraph.from_matrix(ROADS), "from_networkx"),  # type: ignore[arg-type]
    "a label for an index": (lambda: GRAPH.weights_from("a"), r"node index 'a' .* graph.index_of\(node\)"),  # type: ignore[arg-type]
    "a class": (lambda: cg.solve(PROBLEM, Cgla), r"the class Cgla; give an instance, as Cgla\(\)"),  # type: ignore[arg-type]
    "settings in the name": (lambda: cg.solve(PROBLEM, "rrt-star:seed=1"), "are arguments: 'rrt-star', seed=1"),
    "a scenario": (lambda: cg.solve(cg.load_scenario("paper")), "give its problem, as scenario.problem"),  # type: ignore[arg-type]
    "its name": (lambda: cg.solve("paper"), r"load_scenario\(name\).problem"),  # type: ignore[arg-type]
    "a networkx graph to solve": (lambda: cg.solve(ROADS), r"GraphProblem\(GeometricGraph.from_networkx"),  # type: ignore[arg-type]
    "a graph to solve": (lambda: cg.solve(GRAPH), r"GraphProblem\(graph, source, target\)"),  # type: ignore[arg-type]
    "swapped": (lambda: cg.solve("cgla", PROBLEM), "solver is a Problem; give a name"),  # type: ignore[arg-type]
    "no points": (lambda: PROBLEM.in_bounds("ab"), "points is not an array of numbers"),  # type: ignore[arg-type]
    "no name": (lambda: cg.load_scenario(PROBLEM), "a Problem; give the name of a scenario, or the path"),  # type: ignore[arg-type]
    "no mission": (lambda: cg.load_mission(None), "None; give the name of a mission, or the path"),  # type: ignore[arg-type]
    "swapped nodes": (lambda: cg.GraphProblem("a", "b", GRAPH), "graph is 'a'; give a GeometricGraph"),  # type: ignore[arg-type]
    "a class to get": (lambda: cg.solvers.get(Cgla), "the class Cgla; give a text"),  # type: ignore[arg-type]
    "a class for pareto": (lambda: cg.pareto(PROBLEM, solver=Cgla), r"as Cgla\(\)"),  # type: ignore[arg-type]
    "a class to check": (lambda: check_solver(Cgla), r"as Cgla\(\)"),  # type: ignore[arg-type]
    "a path to fly": (lambda: cg.flyable(STRAIGHT.path, 0.1), r"an ndarray; give a solution, as solve\(problem\)"),  # type: ignore[arg-type]
}  # fmt: skip


@pytest.mark.parametrize("mistake", FIRST_HOUR)
def test_mistakes_of_the_first_hour_name_their_remedy(mistake: str) -> None:
    call, says = FIRST_HOUR[mistake]
    with pytest.raises(CglaError, match=says):
        call()


def test_a_wrong_index_is_an_index_error_too() -> None:
    for index in (3, -1, "a", 1.0, None):
        with pytest.raises(IndexError, match="is not in 0 to 2"):
            GRAPH.weights_from(index)  # type: ignore[arg-type]
    assert GRAPH.weights_from(np.int32(2)).tolist() == [5.0, 1.0, 0.0]  # type: ignore[arg-type]


@dataclass(frozen=True)
class Mine:
    """A solver that answers whatever a test wants."""

    give: Callable[[], Any]
    traits: ClassVar[Traits] = Traits("mine", "a solver of mine", domain="plane")

    def solve(self, problem: cg.Problem) -> Any:  # noqa: ANN401, ARG002 - answers anything
        """Answer."""
        return self.give()


@dataclass(frozen=True)
class OnGraph(Mine):
    """The same on graphs."""

    traits: ClassVar[Traits] = Traits("mine", "a solver of mine", domain="graph")


PATH = [(0.1, 0.1), (0.9, 0.9)]


def _nodes(**given: Any) -> cg.Solution:  # noqa: ANN401 - anything
    return cg.Solution(cg.Status.FOUND, **given)


@pytest.mark.parametrize("path", [PATH, tuple(PATH), np.array(PATH), np.array(PATH, dtype=">f8")])
@pytest.mark.parametrize("cost", [{}, {"cost": None}, {"cost": np.float64("inf")}])
def test_the_oracle_knows_a_cost_that_is_left_out(path: Any, cost: dict[str, Any]) -> None:  # noqa: ANN401 - any form
    found = cg.solve(PROBLEM, Mine(lambda: _nodes(path=path, **cost)))
    assert (found.status, found.cost) == (cg.Status.FOUND, PROBLEM.evaluate(PATH).cost)
    assert isinstance(found.path, np.ndarray)


@pytest.mark.parametrize("nodes", ["abc", list("abc"), np.array(list("abc"))])
def test_the_graph_knows_a_cost_that_is_left_out(nodes: Any) -> None:  # noqa: ANN401 - any form
    found = cg.solve(ON_GRAPH, OnGraph(lambda: _nodes(nodes=nodes)))
    assert (found.status, found.cost, found.nodes) == (cg.Status.FOUND, 2.0, ("a", "b", "c"))
    assert {type(node) for node in found.nodes} == {str}
    drawn: Iterator[str] = iter("abc")
    assert cg.solve(ON_GRAPH, OnGraph(lambda: _nodes(nodes=drawn))).cost == 2.0


@pytest.mark.parametrize(
    "answer",
    [
        None,
        PATH,
        (PATH, 1.0),
        np.array(PATH),
        {"path": PATH},
        "found",
        iter(PATH),
        cg.Status.FOUND,
        cg.Solution,
        PROBLEM,
        1.0,
    ],
)
@pytest.mark.parametrize(("solver", "problem"), [(Mine, PROBLEM), (OnGraph, ON_GRAPH)])
def test_answers_that_are_no_solution_are_faults(answer: object, solver: type[Mine], problem: cg.Problem) -> None:
    with pytest.raises(
        SolverFaultError, match=r"mine answers with .*; have its solve return a Solution, as Solution\(Sta"
    ):
        cg.solve(problem, solver(lambda: answer))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"path": None}, "shape"),
        ({"path": "ab"}, "numbers"),
        ({"path": [1.0, 2.0, 3.0]}, "shape"),
        ({"path": [[0.1, 0.1], [0.9]]}, "numbers"),
        ({"path": (one for one in PATH)}, "numbers"),
        ({"path": [[0.1, 0.1], [float("nan"), 0.9]]}, "finite"),
        ({"path": np.ma.masked_greater(PATH, 0.5)}, "masked"),
        ({"path": PATH[::-1]}, "not start and goal"),
        ({"path": PATH, "cost": "1"}, "'1', the oracle"),
        ({"path": PATH, "cost": float("nan")}, "nan, the oracle"),
        ({"path": PATH, "cost": 0.5}, "0.5, the oracle"),
        ({"path": PATH, "cost": [1.0]}, "the oracle"),
        ({}, "at least one waypoint"),
    ],
)
def test_wrong_paths_fail(given: dict[str, Any], says: str) -> None:
    found = cg.solve(PROBLEM, Mine(lambda: _nodes(**given)))
    assert found.status is cg.Status.FAILED
    assert says in found.message


@pytest.mark.parametrize("nodes", [None, 5, [], [["a"], ["c"]], "ab", "xc", np.array([["a", "c"]]), [0, 2], [None]])
def test_wrong_nodes_fail(nodes: Any) -> None:  # noqa: ANN401 - anything
    found = cg.solve(ON_GRAPH, OnGraph(lambda: _nodes(nodes=nodes)))
    assert found.status is cg.Status.FAILED
    assert found.message


@pytest.mark.parametrize(
    ("status", "says"), [("found", "give Status.FOUND"), ("no-path", "Status.NO_PATH"), (1, "as Status.F")]
)
def test_a_status_is_no_text(status: Any, says: str) -> None:  # noqa: ANN401 - anything
    with pytest.raises(ProblemError, match=says):
        cg.solve(PROBLEM, Mine(lambda: cg.Solution(status, path=np.array(PATH))))


@pytest.mark.parametrize("name", ["build_seconds", "certificate_seconds", "evaluations"])
def test_times_and_counts_are_numbers(name: str) -> None:
    with pytest.raises(SolverFaultError, match=f"{name} = None; give a number, or leave it out"):
        cg.solve(PROBLEM, Mine(lambda: _nodes(path=PATH, **{name: None})))

"""Whatever is passed to a public function, the message that refuses it is one short line."""

import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, cast

import networkx as nx
import numpy as np
import pytest
import shapely

import cgla_graph as cg

#: Characters of a message, at most, and what may be told besides: how many solvers there are is not up to the value.
MOST, SOLVERS = 300, ", ".join(cg.solvers.names(installed=False))


class Wordy:
    """An object that says a lot of itself."""

    def __repr__(self) -> str:
        """Fill pages."""
        return "Wordy(\n" + "word " * 2000 + "\n)"

    __str__ = __repr__


#: What is passed for each argument in turn: none of it fits a line.
HUGE: dict[str, object] = {
    "text": "first line\nsecond line: " + "word" * 2000,
    "array": np.linspace(0.0, 1.0, 900).reshape(30, 30),
    "list": [[0.123456789, "text"] * 3] * 500,
    "names": ["name\n" * 200] * 5,
    "dictionary": {f"key {number}": "value " * 100 for number in range(500)},
    "one key": {"word\n" * 2000: 5},
    "set": frozenset(range(5000)),
    "number": 10**2000,
    "bytes": b"\n" * 5000,
    "polygon": shapely.Point(0.5, 0.5).buffer(0.2, 500),
    "object": Wordy(),
    "path": Path("folder/" * 300 + "file\n.toml"),
    "pair": ("word " * 1000, Wordy()),
}


def risk_field(threats: object, rasters: object = (), improper: object = False) -> object:
    return cg.RiskField(cast("Any", threats), rasters=cast("Any", rasters), improper=cast("Any", improper))


def compare(scenarios: object, entrants: object, n_seeds: object = 1, tolerance: object = None) -> object:
    known = [cg.comparisons.Entrant.parse(one) for one in cast("Any", entrants)]
    given: Any = (scenarios, known, n_seeds)
    return next(cg.comparisons.compare(*given, tolerance=cast("Any", tolerance)))


@cache
def calls() -> dict[str, tuple[Callable[..., object], dict[str, Any]]]:
    """Return public functions and classes, each with arguments that are right."""
    threat = cg.Threat(0.5, 0.5, 0.1, 0.5)
    field = cg.RiskField([threat])
    ends: dict[str, Any] = {"start": (0.1, 0.1), "goal": (0.9, 0.9)}
    problem = cg.Problem(**ends, field=field, k=3.0)
    lattice = cg.Lattice(4, bounds=(0, 0, 1, 1))
    graph = cg.GeometricGraph.complete(lattice, field, 3.0)
    net: nx.Graph[int] = nx.Graph()
    net.add_node(0, pos=(0.0, 0.0))
    net.add_node(1, pos=(1.0, 0.0))
    net.add_edge(0, 1, weight=1.0)
    matrix = [[0.0, 1.0], [1.0, 0.0]]
    raster = cg.RasterRisk(np.ones((3, 3)), (0, 0, 1, 1))
    world, solver = cg.World(field), cg.solvers.get("dijkstra")
    uav = cg.Uav("one", (0.1, 0.1), (0.9, 0.9), detection_radius=0.3)
    plan = cg.FlightPlan((cg.Waypoint(24.0, 60.0), cg.Waypoint(25.0, 60.0)))
    coarse = {"problem": problem, "solver": "dijkstra", "resolution": 3}
    made: dict[str, tuple[Callable[..., object], dict[str, Any]]] = {
        "Threat": (cg.Threat, {"x": 0, "y": 0, "spread": 1, "peak": 0.5}),
        "Threat.from_eq1": (cg.Threat.from_eq1, {"x": 0, "y": 0, "sigma": 1}),
        "RiskField": (risk_field, {"threats": [threat]}),
        "RiskField.density": (field.density, {"points": [(0, 0)]}),
        "RiskField.gradient": (field.gradient, {"points": [(0, 0)]}),
        "RiskField.line_integral": (field.line_integral, {"starts": (0, 0), "ends": (1, 1)}),
        "RasterRisk": (cg.RasterRisk, {"values": np.ones((3, 3)), "bounds": (0, 0, 1, 1)}),
        "RasterRisk.from_file": (cg.RasterRisk.from_file, {"path": "no.npy"}),
        "CostModel": (cg.CostModel, {"field": field, "k": 1.0}),
        "NoFlyArea": (cg.NoFlyArea, {"geometry": None}),
        "Problem": (cg.Problem, {**ends, "field": field, "k": 3.0}),
        "Problem.evaluate": (problem.evaluate, {"path": [(0.1, 0.1), (0.9, 0.9)]}),
        "Problem.on_lattice": (problem.on_lattice, {"resolution": 3}),
        "Lattice": (cg.Lattice, {"resolution": 3, "bounds": (0, 0, 1, 1)}),
        "GraphProblem": (cg.GraphProblem, {"graph": graph, "source": 0, "target": 1}),
        "GeometricGraph.complete": (cg.GeometricGraph.complete, {"points": lattice, "field": field, "k": 3.0}),
        "GeometricGraph.eight_connected": (cg.GeometricGraph.eight_connected, {"lattice": lattice}),
        "GeometricGraph.from_matrix": (cg.GeometricGraph.from_matrix, {"matrix": matrix}),
        "GeometricGraph.from_scipy": (cg.GeometricGraph.from_scipy, {"matrix": matrix}),
        "GeometricGraph.from_sparse": (cg.GeometricGraph.from_sparse, {"matrix": matrix}),
        "GeometricGraph.from_networkx": (cg.GeometricGraph.from_networkx, {"graph": net}),
        "GeometricGraph.weights_from": (graph.weights_from, {"node": 0}),
        "cost_matrix": (cg.cost_matrix, {"graph": graph, "target": 0}),
        "solve": (cg.solve, coarse),
        "lower_bound": (cg.lower_bound, {"problem": problem, "tolerance": 0.5}),
        "pareto": (cg.pareto, {**coarse, "max_points": 3}),
        "plan_within_risk": (cg.plan_within_risk, {**coarse, "max_risk": 1.0, "tolerance": None}),
        "plan_within_length": (cg.plan_within_length, {**coarse, "max_length": 2.0, "tolerance": None}),
        "below_density": (cg.below_density, {"problem": problem, "level": 0.4}),
        "density_front": (cg.density_front, {"problem": problem, "solver": "dijkstra", "levels": 2}),
        "ground_risk": (
            cg.ground_risk,
            {"people": raster, "unit": "people/km2", "failures_per_hour": 1e-5, "speed": 20.0, "lethal_area": 5.0},
        ),
        "risk_weight": (cg.risk_weight, {"prevented_fatality": 1e6, "metre": 1.0}),
        "TimedThreat": (cg.TimedThreat, {"threat": threat}),
        "TimedArea": (cg.TimedArea, {"polygon": shapely.box(0, 0, 1, 1)}),
        "Uav": (cg.Uav, {"name": "one", **ends, "detection_radius": 0.3}),
        "Sharing": (cg.Sharing, {}),
        "Sharing.parse": (cg.Sharing.parse, {"value": "global"}),
        "VirtualObstacle": (cg.VirtualObstacle, {}),
        "VirtualObstacle.parse": (cg.VirtualObstacle.parse, {"value": True}),
        "World": (cg.World, {"field": field}),
        "Mission": (cg.Mission, {"world": world, "uavs": [uav], "solver": solver, "resolution": 3}),
        "load_scenario": (cg.load_scenario, {"name": "paper"}),
        "load_mission": (cg.load_mission, {"name": "swarm"}),
        "read_zones": (cg.read_zones, {"files": "no.json"}),
        "read_plan": (cg.read_plan, {"path": "no.plan"}),
        "footprint_density": (cg.footprint_density, {"people": raster, "radius": 0.1, "outside": 0.0}),
        "volumes": (cg.volumes, {"flight": plan, "height": 60.0, "speed": 9.0, "dimension": 1.0, "pitch": 30.0}),
        "VolumeSettings": (cg.VolumeSettings, {"speed": 9.0, "dimension": 1.0, "pitch": 30.0}),
        "write_plan": (cg.write_plan, {"plan": plan, "path": "no.there/plan"}),
        "FlightPlan": (cg.FlightPlan, {"waypoints": plan.waypoints}),
        "FlightPlan.along": (cg.FlightPlan.along, {"lonlat": [(24, 60), (25, 60)]}),
        "Waypoint": (cg.Waypoint, {"x": 24.0, "y": 60.0}),
        "progress": (cg.progress, {"on": True}),
        "solvers.get": (cg.solvers.get, {"name": "cgla"}),
        "solvers.missing": (cg.solvers.missing, {"name": "cgla"}),
        "solvers.traits": (cg.solvers.traits, {"name": "cgla"}),
        "Study": (cg.comparisons.Study, {"scenarios": ["paper"], "entrants": ["cgla"]}),
        "Entrant": (cg.comparisons.Entrant, {"label": "a", "name": "cgla"}),
        "Entrant.parse": (cg.comparisons.Entrant.parse, {"text": "cgla"}),
        "load": (cg.comparisons.load, {"folder": "nowhere"}),
        "compare": (compare, {"scenarios": [cg.load_scenario("one-threat")], "entrants": ["straight-line"]}),
        "conform": (cg.comparisons.conform, {"command": "no-such-planner"}),
    }
    return made


def check(call: Callable[..., object], arguments: dict[str, Any]) -> None:
    """Make a call that may fail, and see what it says then."""
    try:
        call(**arguments)
    except Exception as error:  # noqa: BLE001 - whatever it is
        text = str(error).replace(SOLVERS, "")
        assert len(text) <= MOST, f"{len(text)} characters: {text[:600]}"
        assert "\n" not in text, text


def test_what_calls_say_of_their_arguments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for call, right in calls().values():
        for argument, kind in inspect.signature(call).parameters.items():
            if kind.kind is not kind.VAR_KEYWORD:
                for value in HUGE.values():
                    check(call, {**right, argument: value})


def test_what_solvers_say_of_their_settings() -> None:
    for name in cg.solvers.names():
        for setting in inspect.signature(type(cg.solvers.get(name))).parameters:
            for value in HUGE.values():
                check(cg.solvers.get, {"name": name, setting: value})

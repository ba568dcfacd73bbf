"""
CGLA Graph: risk-aware path planning over complete geometric graphs.

The names below are the toolkit's face. They are imported when first used, so that `import cgla_graph` and
``cgla --help`` cost next to nothing.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cgla_graph import comparisons as comparisons
    from cgla_graph import solvers as solvers
    from cgla_graph.certificate import Certificate as Certificate
    from cgla_graph.certificate import lower_bound as lower_bound
    from cgla_graph.cgla_matrix import CostMatrix as CostMatrix
    from cgla_graph.cgla_matrix import cost_matrix as cost_matrix
    from cgla_graph.cost_model import CostModel as CostModel
    from cgla_graph.errors import CglaError as CglaError
    from cgla_graph.flight import Flight as Flight
    from cgla_graph.flight import MissionStatus as MissionStatus
    from cgla_graph.graph import GeometricGraph as GeometricGraph
    from cgla_graph.lattice import Lattice as Lattice
    from cgla_graph.mission import Mission as Mission
    from cgla_graph.mission_file import load_mission as load_mission
    from cgla_graph.no_fly import NoFlyArea as NoFlyArea
    from cgla_graph.problem import Evaluation as Evaluation
    from cgla_graph.problem import GraphProblem as GraphProblem
    from cgla_graph.problem import Problem as Problem
    from cgla_graph.risk import RiskField as RiskField
    from cgla_graph.risk import Threat as Threat
    from cgla_graph.scenario import Scenario as Scenario
    from cgla_graph.scenario import load_scenario as load_scenario
    from cgla_graph.sharing import Sharing as Sharing
    from cgla_graph.solution import Solution as Solution
    from cgla_graph.solution import Status as Status
    from cgla_graph.solvers.bridge import solve as solve
    from cgla_graph.solvers.trade_off import pareto as pareto
    from cgla_graph.solvers.within import plan_within_length as plan_within_length
    from cgla_graph.solvers.within import plan_within_risk as plan_within_risk
    from cgla_graph.uav import Uav as Uav
    from cgla_graph.virtual_obstacle import VirtualObstacle as VirtualObstacle
    from cgla_graph.world import TimedArea as TimedArea
    from cgla_graph.world import TimedThreat as TimedThreat
    from cgla_graph.world import World as World

__version__ = "0.1.0"

_HOMES = {
    "Certificate": "certificate",
    "CglaError": "errors",
    "CostMatrix": "cgla_matrix",
    "CostModel": "cost_model",
    "Evaluation": "problem",
    "Flight": "flight",
    "GeometricGraph": "graph",
    "GraphProblem": "problem",
    "Lattice": "lattice",
    "Mission": "mission",
    "MissionStatus": "flight",
    "NoFlyArea": "no_fly",
    "Problem": "problem",
    "RiskField": "risk",
    "Scenario": "scenario",
    "Sharing": "sharing",
    "Solution": "solution",
    "Status": "solution",
    "Threat": "risk",
    "TimedArea": "world",
    "TimedThreat": "world",
    "Uav": "uav",
    "VirtualObstacle": "virtual_obstacle",
    "World": "world",
    "cost_matrix": "cgla_matrix",
    "load_mission": "mission_file",
    "load_scenario": "scenario",
    "lower_bound": "certificate",
    "pareto": "solvers.trade_off",
    "plan_within_length": "solvers.within",
    "plan_within_risk": "solvers.within",
    "solve": "solvers.bridge",
}

__all__ = [*sorted(_HOMES), "comparisons", "solvers"]  # noqa: PLE0604 - strings, all of them


def __getattr__(name: str) -> Any:  # noqa: ANN401 - any of the names above
    """Import a name when it is first used (PEP 562)."""
    if name in _HOMES:
        value = getattr(importlib.import_module(f"cgla_graph.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    if name in {"solvers", "comparisons"}:
        return importlib.import_module(f"cgla_graph.{name}")
    msg = f"module 'cgla_graph' has no attribute {name!r}"
    raise AttributeError(msg)


def __dir__() -> list[str]:
    """List the face, imported or not."""
    return sorted([*__all__, "__version__"])

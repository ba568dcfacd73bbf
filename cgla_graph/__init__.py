"""
CGLA Graph: risk-aware path planning over complete geometric graphs.

The names below are the toolkit's face. They are imported when first used, so that `import cgla_graph` and
``cgla --help`` cost next to nothing.
"""

import importlib
from typing import TYPE_CHECKING, Any

from cgla_graph import _display

if TYPE_CHECKING:
    from cgla_graph import comparisons as comparisons
    from cgla_graph import solvers as solvers
    from cgla_graph._progress import progress as progress
    from cgla_graph.airspace.flight_plans.formats import read_plan as read_plan
    from cgla_graph.airspace.flight_plans.formats import write_plan as write_plan
    from cgla_graph.airspace.flight_plans.plan import FlightPlan as FlightPlan
    from cgla_graph.airspace.flight_plans.plan import Waypoint as Waypoint
    from cgla_graph.airspace.zones.reading import read_zones as read_zones
    from cgla_graph.certificate.certificate import Certificate as Certificate
    from cgla_graph.comparisons.plots.drawing import animate as animate
    from cgla_graph.comparisons.plots.drawing import plot as plot
    from cgla_graph.cost_to_go.cost_matrix import CostMatrix as CostMatrix
    from cgla_graph.cost_to_go.cost_matrix import cost_matrix as cost_matrix
    from cgla_graph.cost_to_go.theorem_1 import check_theorem_1 as check_theorem_1
    from cgla_graph.errors import CglaError as CglaError
    from cgla_graph.mission.mission import Mission as Mission
    from cgla_graph.mission.records import Flight as Flight
    from cgla_graph.mission.records import MissionStatus as MissionStatus
    from cgla_graph.mission.sharing import Sharing as Sharing
    from cgla_graph.mission.uav import Uav as Uav
    from cgla_graph.mission.virtual_obstacle import VirtualObstacle as VirtualObstacle
    from cgla_graph.mission.world import TimedArea as TimedArea
    from cgla_graph.mission.world import TimedThreat as TimedThreat
    from cgla_graph.mission.world import World as World
    from cgla_graph.model.cost_model import CostModel as CostModel
    from cgla_graph.model.graph import GeometricGraph as GeometricGraph
    from cgla_graph.model.ground_risk import ground_risk as ground_risk
    from cgla_graph.model.ground_risk import risk_weight as risk_weight
    from cgla_graph.model.lattice import Lattice as Lattice
    from cgla_graph.model.no_fly import NoFlyArea as NoFlyArea
    from cgla_graph.model.problem import Evaluation as Evaluation
    from cgla_graph.model.problem import GraphProblem as GraphProblem
    from cgla_graph.model.problem import Problem as Problem
    from cgla_graph.model.risk import RiskField as RiskField
    from cgla_graph.model.risk import Threat as Threat
    from cgla_graph.model.risk_raster import RasterRisk as RasterRisk
    from cgla_graph.model.solution import Solution as Solution
    from cgla_graph.model.solution import Status as Status
    from cgla_graph.scenarios.mission_file import load_mission as load_mission
    from cgla_graph.scenarios.scenario import Scenario as Scenario
    from cgla_graph.scenarios.scenario import load_scenario as load_scenario
    from cgla_graph.scenarios.writing import write_scenario as write_scenario
    from cgla_graph.solvers.solving import lower_bound as lower_bound
    from cgla_graph.solvers.solving import solve as solve
    from cgla_graph.solvers.trade_off.constrained import plan_within_length as plan_within_length
    from cgla_graph.solvers.trade_off.constrained import plan_within_risk as plan_within_risk
    from cgla_graph.solvers.trade_off.density import below_density as below_density
    from cgla_graph.solvers.trade_off.density import density_front as density_front
    from cgla_graph.solvers.trade_off.pareto import pareto as pareto
    from cgla_graph.turning.flyable import flyable as flyable

__version__ = "0.1.0"

_HOMES = {
    "Certificate": "certificate.certificate",
    "CglaError": "errors",
    "CostMatrix": "cost_to_go.cost_matrix",
    "CostModel": "model.cost_model",
    "Evaluation": "model.problem",
    "Flight": "mission.records",
    "FlightPlan": "airspace.flight_plans.plan",
    "GeometricGraph": "model.graph",
    "GraphProblem": "model.problem",
    "Lattice": "model.lattice",
    "Mission": "mission.mission",
    "MissionStatus": "mission.records",
    "NoFlyArea": "model.no_fly",
    "Problem": "model.problem",
    "RasterRisk": "model.risk_raster",
    "RiskField": "model.risk",
    "Scenario": "scenarios.scenario",
    "Sharing": "mission.sharing",
    "Solution": "model.solution",
    "Status": "model.solution",
    "Threat": "model.risk",
    "TimedArea": "mission.world",
    "TimedThreat": "mission.world",
    "Uav": "mission.uav",
    "VirtualObstacle": "mission.virtual_obstacle",
    "Waypoint": "airspace.flight_plans.plan",
    "World": "mission.world",
    "animate": "comparisons.plots.drawing",
    "below_density": "solvers.trade_off.density",
    "check_theorem_1": "cost_to_go.theorem_1",
    "cost_matrix": "cost_to_go.cost_matrix",
    "density_front": "solvers.trade_off.density",
    "flyable": "turning.flyable",
    "ground_risk": "model.ground_risk",
    "load_mission": "scenarios.mission_file",
    "load_scenario": "scenarios.scenario",
    "lower_bound": "solvers.solving",
    "pareto": "solvers.trade_off.pareto",
    "plan_within_length": "solvers.trade_off.constrained",
    "plan_within_risk": "solvers.trade_off.constrained",
    "plot": "comparisons.plots.drawing",
    "progress": "_progress",
    "read_plan": "airspace.flight_plans.formats",
    "read_zones": "airspace.zones.reading",
    "risk_weight": "model.ground_risk",
    "solve": "solvers.solving",
    "write_plan": "airspace.flight_plans.formats",
    "write_scenario": "scenarios.writing",
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


_INTERNAL = {"html": "comparisons.plots.notebook"}


def _import_for_objects(name: str) -> Any:  # noqa: ANN401 - a function
    """Import what objects call that stand below it, as `Problem.plot` calls `plot`."""
    if name in _INTERNAL:
        return getattr(importlib.import_module(f"cgla_graph.{_INTERNAL[name]}"), name)
    return __getattr__(name)


_display.set_importer(_import_for_objects)


def __dir__() -> list[str]:
    """List the face, imported or not."""
    return sorted([*__all__, "__version__"])

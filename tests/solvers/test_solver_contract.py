"""Every solver keeps the contract, and the checks of the contract can fail."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest
from quick_solvers import QUICK

import cgla_graph as cg
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, Solution, Status, TracePoint
from cgla_graph.model.solver import Traits
from cgla_graph.solvers import registry
from cgla_graph.solvers.checks import check_solver
from cgla_graph.solvers.continuous.straight_line import StraightLine
from cgla_graph.solvers.exact.cgla import Cgla

VARIANTS = [
    *[(name, QUICK.get(name, {})) for name in registry.names(installed=False)],
    ("cgla", {"schedule": "synchronous"}),
    ("cgla", {"schedule": "sweeps"}),
    ("cgla", {"early_stop": False}),
    ("rrt-star", {"iterations": 100, "seed": 7, "rewire_factor": 0.5}),
    ("rrt-star", {"iterations": None, "evaluations": 5_000}),
    ("bit-star", {"iterations": None, "evaluations": 1000, "samples_per_batch": 50}),
    ("prm-star", {"milestones": None, "evaluations": 5_000, "seed": 0, "radius_factor": 0.8}),
    ("eight-direction", {"resolution": 15, "corner_rule": "both-free"}),
]


@pytest.mark.parametrize(("name", "settings"), VARIANTS, ids=str)
def test_every_solver_keeps_the_contract(name: str, settings: dict[str, Any]) -> None:
    if (missing := registry.missing(name)) is not None:
        pytest.skip(missing)
    check_solver(cg.solvers.get(name, **settings))


@pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.ImproperFieldWarning")
@pytest.mark.parametrize("name", registry.names())
def test_only_solvers_that_need_no_positive_weights_get_others(name: str) -> None:
    threats = [cg.Threat(0.5, 0.5, 0.1, peak=4.0), cg.Threat(0.55, 0.5, 0.1, peak=4.0)]
    field = cg.RiskField(threats, improper=True)
    # a planner that plans its first steps has taken the problem
    settings = {"max_steps": 10} if name == "milp" else QUICK.get(name, {})
    solver = cg.solvers.get(name, **settings)
    answer = cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=10.0), solver)
    refused = (answer.status, answer.message) == (Status.UNSUPPORTED, NEGATIVE_WEIGHTS)
    # these ask another solver
    assert refused == (solver.traits.needs_positive or name in {"eight-direction", "refine"})
    # staying where one is may cost more than a round trip through risk below 0
    stays = cg.solve(cg.Problem((0.1, 0.1), (0.1, 0.1), field, k=10.0), solver)
    assert stays.status is not Status.OPTIMAL
    assert not stays.lower_bound <= stays.cost


@dataclass(frozen=True)
class Broken:
    """A graph solver that goes wrong in one way."""

    fault: str

    traits: ClassVar[Traits] = Traits("broken", "wrong in one way", domain="graph", exact=True)

    def solve(self, problem: GraphProblem) -> Solution:
        answer = Cgla().solve(problem)
        if self.fault == "direct edge":
            nodes = tuple(dict.fromkeys((problem.source, problem.target)))
            return Solution(Status.OPTIMAL, nodes=nodes, cost=problem.evaluate(nodes))
        if self.fault == "lies":
            return Solution(answer.status, nodes=answer.nodes, cost=answer.cost * 0.9)
        if self.fault == "stops short":
            return Solution(answer.status, nodes=answer.nodes[:-1], cost=answer.cost)
        if self.fault == "gives up":
            return Solution(Status.NOT_FOUND)
        if self.fault == "writes":
            matrix = problem.graph.weight_matrix()
            matrix.flags.writeable = True
            matrix += 1.0
            return answer
        return Solution(answer.status, nodes=answer.nodes[::-1], cost=answer.cost)


@pytest.mark.parametrize("fault", ["direct edge", "lies", "stops short", "gives up", "writes", "runs backwards"])
def test_a_broken_graph_solver_is_caught(fault: str) -> None:
    with pytest.raises(AssertionError, match="broken"):
        check_solver(Broken(fault))


@dataclass(frozen=True)
class BrokenPlane:
    """A solver of the plane that goes wrong in one way."""

    fault: str

    traits: ClassVar[Traits] = Traits("broken", "wrong in one way", domain="plane", anytime=True)

    def solve(self, problem: cg.Problem) -> Solution:
        answer = StraightLine().solve(problem)
        if self.fault == "rising trace":
            trace = (TracePoint(0, 0, answer.cost), TracePoint(1, 1, answer.cost + 1), TracePoint(2, 2, answer.cost))
            return Solution(answer.status, path=answer.path, cost=answer.cost, trace=trace)
        if self.fault == "differs":
            middle = np.random.default_rng().random((1, 2))
            path = np.vstack([answer.path[:1], middle, answer.path[-1:]])
            return Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost)
        return answer


@pytest.mark.parametrize("fault", ["rising trace", "differs", "no trace, through walls"])
def test_a_broken_plane_solver_is_caught(fault: str) -> None:
    with pytest.raises(AssertionError, match="broken"):
        check_solver(BrokenPlane(fault))


@dataclass(frozen=True)
class Blindfolded:
    """A solver of the plane that forgets about rasters, or says less of them than it should."""

    traits: ClassVar[Traits] = Traits("broken", "sees no rasters", domain="plane")

    def solve(self, problem: cg.Problem) -> Solution:
        known = cg.Problem(
            problem.start, problem.goal, cg.RiskField(problem.field.threats), problem.k, problem.bounds, problem.no_fly
        )
        found = cg.solve(known, "lazy-theta-star", resolution=15)
        cost = problem.evaluate(found.path).cost if found.status.has_path else found.cost
        return Solution(found.status, path=found.path, cost=cost, message=found.message)


def test_a_solver_that_ignores_rasters_is_caught() -> None:
    with pytest.raises(AssertionError, match=r"broken: saves .* around a threat, .* around it as a raster"):
        check_solver(Blindfolded())


def test_a_solver_that_says_that_it_sees_no_rasters_keeps_the_contract() -> None:
    @dataclass(frozen=True)
    class Honest(Blindfolded):
        traits: ClassVar[Traits] = Traits("honest", "sees no rasters, and says so", domain="plane", rasters=False)

    check_solver(Honest())


def test_the_straight_line_bounds_every_path_from_below() -> None:
    field = cg.RiskField([cg.Threat(0.5, 0.5, spread=0.1)])
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=10.0)
    line = cg.solve(problem, "straight-line")
    assert line.gap == pytest.approx(line.cost / line.length - 1.0)
    for name in ("cgla", "eight-direction"):
        assert cg.solve(problem, name).cost >= line.lower_bound
    detour = np.linspace(problem.start, problem.goal, 1001)
    assert cg.Problem(problem.start, problem.goal).evaluate(detour).cost >= line.lower_bound

"""Incremental planning for a UAV of a mission: its solver, on its knowledge, repairing the last cost matrix."""

import dataclasses
from collections import Counter
from collections.abc import Hashable
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.cost_to_go.repair import lazy_cost_matrix, linked, repair, reweigh, with_node
from cgla_graph.errors import CglaError
from cgla_graph.fusion.fusion import fused_graph
from cgla_graph.fusion.raster_search import RasterGuide
from cgla_graph.isolation.outcome import failure_by, one_line
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.uav import Uav
from cgla_graph.model.adjacency import Node
from cgla_graph.model.cost_model import CostModel, indexed_area
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import FULL_UP_TO, GraphProblem, Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Remarks, StepByStep, Traits, next_move, run, trivial_solution

#: Bends of a smaller angle, in radians, are rounding.
IN_LINE = 1e-9
#: Rounding of the length of a step, relative to it.
ROUNDING = 1e-9
#: Whether a flight ends with the exception if a solver lacks a package or a file; else it goes on without a plan.
ends_by_environment: ContextVar[bool] = ContextVar("ends_by_environment", default=False)


@runtime_checkable
class CostMatrixReader(Protocol):
    """A graph solver that reads its path off a given cost matrix."""

    traits: ClassVar[Traits]

    def read(self, problem: GraphProblem, matrix: CostMatrix) -> Solution:
        """Return the path from the problem's source to the target of the matrix."""
        ...


@dataclass(frozen=True, eq=False)
class Situation:
    """
    The input of a plan.

    Attributes
    ----------
    position
        The position of the UAV, map units.
    field
        The known threats.
    no_fly
        The known areas, widened by the clearance.
    obstacles
        Virtual obstacles, for this plan only.
    fields
        The known threats that each UAV saw, the ``F^j`` of Eq. 5; only other fusions than the union need them.
    excluded
        Lattice points that the plan may not use.
    """

    position: Point
    field: RiskField
    no_fly: BaseGeometry | None = None
    obstacles: tuple[Threat, ...] = ()
    fields: tuple[RiskField, ...] = ()
    excluded: frozenset[int] = frozenset()


@dataclass(eq=False)
class Replanner:
    """
    Planner of one UAV, which keeps the cost matrix of its last plan, or the weighted graph for solvers that need it.

    Both leave out virtual obstacles and starts between lattice points, which change with every plan.

    Attributes
    ----------
    mission, uav
        The rules, and the UAV.
    memory
        The memory of a solver that decides step by step.
    counts
        The counts of a solver that decides step by step.
    """

    mission: Rules
    uav: Uav
    _matrix: CostMatrix | None = field(default=None, repr=False)
    _graph: GeometricGraph | None = field(default=None, repr=False)
    _guide: RasterGuide | None = field(default=None, repr=False)
    memory: Hashable = None
    counts: Counter[str] = field(default_factory=Counter)

    @property
    def stepper(self) -> StepByStep | None:
        """The solver, if it decides step by step; None where the rules need plans that are whole paths."""
        mission = self.mission
        whole = mission.avoidance != "none" or mission.movement != "step" or mission.replan == "never"
        return mission.solver if isinstance(mission.solver, StepByStep) and not whole else None

    @property
    def remark(self) -> str:
        """The remark of a solver that decides step by step on the flight so far; may be empty."""
        solver = self.mission.solver
        return solver.remark(self.counts) if self.stepper is not None and isinstance(solver, Remarks) else ""

    def plan(self, situation: Situation) -> Solution:
        """
        Plan from the position of the UAV to its goal, on its knowledge.

        Returns
        -------
        solution
            Evaluated by the oracle on the known map. If there is no path, or the solver raises, the status says so.
        """
        area = indexed_area(situation.no_fly)
        if area.contains(situation.position):
            return Solution(Status.NO_PATH, message="a no-fly area came up around it")
        if area.contains(self.uav.goal):
            clearance = self.mission.clearance
            nearer = f", or nearer to one than the clearance {clearance:g}" if clearance > 0.0 else ""
            return Solution(Status.NO_PATH, message=f"its goal {self.uav.goal} is inside a no-fly area now{nearer}")
        try:
            problem = self.problem(situation)
            if (stepper := self.stepper) is not None:
                return self._step(problem, stepper)
            return self._judged(problem, self._solve(problem, situation))
        except Exception as error:
            if ends_by_environment.get() and failure_by(error).is_environment:
                raise
            return Solution(Status.FAILED, message=str(error) if isinstance(error, CglaError) else one_line(error))

    @property
    def _is_fused(self) -> bool:
        """Whether weights are another reading of Eq. 5 than the cost model's."""
        return self.mission.fusion != "union" or self.mission.integral != "exact"

    @property
    def _is_rastered(self) -> bool:
        """Whether weights are the cost model's but for the raster sums."""
        mission = self.mission
        return mission.integral == "raster" and mission.fusion == "union" and mission.exclude == "none"

    def _judged(self, problem: Problem, solution: Solution) -> Solution:
        if not self._is_fused:
            return problem.judge(solution)
        if not solution.status.has_path:
            return solution
        # the weights are another reading of Eq. 5: the oracle gives the cost, not the solver
        cost = problem.evaluate(solution.path).cost
        return problem.judge(dataclasses.replace(solution, cost=cost, status=Status.FOUND))

    def problem(self, situation: Situation) -> Problem:
        """
        Return the problem on the UAV's knowledge.

        Raises
        ------
        ProblemError
            If it is in a no-fly area, or its goal is.
        """
        known = situation.field.with_threats(situation.obstacles) if situation.obstacles else situation.field
        return Problem(
            situation.position,
            self.uav.goal,
            field=known,
            k=self.uav.k,
            bounds=self.mission.world.bounds,
            no_fly=situation.no_fly,
        )

    def matrix(self, situation: Situation) -> CostMatrix:
        """
        Return G towards the goal on the union of all known maps, repaired from the last one.

        Virtual obstacles are added for this plan only.
        """
        known = CostModel(situation.field, self.uav.k, situation.no_fly)
        if self._matrix is None or not self.mission.incremental:
            graph = self._complete(known, self.uav.goal)
            self._matrix = lazy_cost_matrix(graph, graph.node_at(self.uav.goal))
        elif self._matrix.graph.model != known:
            self._matrix = repair(self._matrix, known)
        if not situation.obstacles:
            return self._matrix
        return repair(self._matrix, dataclasses.replace(known, field=known.field.with_threats(situation.obstacles)))

    def _solve(self, problem: Problem, situation: Situation) -> Solution:
        if problem.start == problem.goal:
            return trivial_solution(problem, self.mission.solver.traits.name)
        solver = self.mission.solver
        if solver.traits.domain == "plane":
            return run(solver, problem, self.mission.lattice)
        # a solver in another process is sent the graph, not the matrix
        reader = solver if isinstance(solver, CostMatrixReader) and not solver.traits.isolated else None
        plain = not self._is_fused and self.mission.exclude == "none" and problem.field.is_proper
        if plain and reader is not None:
            if (
                self.mission.lattice.n_points > FULL_UP_TO
                and solver.traits.lazy
                and getattr(solver, "early_stop", True)
            ):
                answer = self._solve_restricted(problem)
                # where nothing can be restricted, all of G is repaired
                if answer.status is not Status.UNSUPPORTED:
                    return answer
            return self._read(problem, situation, reader)
        if self._is_rastered and self.mission.incremental and reader is not None:
            return self._read_raster(problem, situation, reader)
        return self._solve_on_graph(problem, situation)

    def _step(self, problem: Problem, stepper: StepByStep) -> Solution:
        """Ask for one step, and check that it is feasible and no longer than the UAV's step."""
        step = self.mission.step_of(self.uav)
        move = next_move(stepper, problem, self.memory, step)
        self.memory = move.memory
        self.counts.update(move.counts)
        if move.stuck:
            return Solution(Status.STUCK, message=move.stuck)
        judged = problem.evaluate(move.path)
        if tuple(move.path[0]) != problem.start or not judged.feasible or judged.length > step * (1.0 + ROUNDING):
            reason = "; ".join(judged.violations) or f"from {problem.start}, it is {judged.length:g} long"
            return Solution(Status.FAILED, message=f"the step does not stand up to the oracle: {reason}")
        return Solution(Status.FOUND, path=move.path, cost=judged.cost, length=judged.length, risk=judged.risk)

    def _complete(self, model: CostModel, *extra: Point) -> GeometricGraph:
        """Return the complete graph over the mission's lattice and some more points."""
        return GeometricGraph.complete(self.mission.lattice, model.field, model.k, no_fly=model.no_fly, extra=extra)

    def _solve_restricted(self, problem: Problem) -> Solution:
        """Plan with a solver that reads weights on demand, on a graph too large to repair all of G."""
        first = self._first(problem)
        graph = self._complete(problem.model, self.uav.goal, first)
        on = GraphProblem(graph, graph.node_at(first), graph.node_at(self.uav.goal))
        return self._from(problem, run(self.mission.solver, on), graph)

    def _read(self, problem: Problem, situation: Situation, solver: CostMatrixReader) -> Solution:
        """Read the path off the cost matrix."""
        first = self._first(problem)
        if self.mission.incremental:
            matrix, node = linked(self.matrix(situation), first)
        else:
            graph = self._complete(problem.model, self.uav.goal, first)
            graph = graph.with_weights_held()
            matrix, node = cost_matrix(graph, graph.node_at(self.uav.goal)), graph.node_at(first)
        answer = solver.read(GraphProblem(matrix.graph, node, matrix.graph.labels[matrix.target]), matrix)
        return self._from(problem, answer, matrix.graph)

    def _read_raster(self, problem: Problem, situation: Situation, solver: CostMatrixReader) -> Solution:
        """Read the path off the part of the cost matrix that matters under raster weights."""
        known = CostModel(situation.field, self.uav.k, situation.no_fly)
        if self._guide is None:
            bounds = self.mission.world.bounds
            self._guide = RasterGuide.lay(self.mission.lattice, known, self.uav.goal, bounds=bounds)
        self._guide = self._guide.knowing(known)
        matrix, node = self._guide.plan(self._first(problem), situation.obstacles)
        target = matrix.graph.labels[matrix.target]
        return self._from(problem, solver.read(GraphProblem(matrix.graph, node, target), matrix), matrix.graph)

    def _solve_on_graph(self, problem: Problem, situation: Situation) -> Solution:
        """Give the solver a graph with all its weights."""
        graph, source = self._weighed(problem, situation)
        target = graph.node_at(self.uav.goal)
        if situation.excluded:
            graph = _without(graph, situation.excluded - {source, target})
        on = GraphProblem(graph, source, target)
        return self._from(problem, run(self.mission.solver, on), graph)

    def _weighed(self, problem: Problem, situation: Situation) -> tuple[GeometricGraph, Node]:
        """Return the graph with all its weights, updated from the last one, and the node to plan from."""
        mission, first = self.mission, self._first(problem)
        if self._is_fused:
            fields = [one.with_threats(situation.obstacles) for one in situation.fields or (RiskField(),)]
            graph = fused_graph(
                mission.lattice,
                fields,
                self.uav.k,
                no_fly=situation.no_fly,
                extra=(self.uav.goal, first),
                fusion=mission.fusion,
                integral=mission.integral,
            )
            return graph, graph.node_at(first)
        known = CostModel(situation.field, self.uav.k, situation.no_fly)
        if self._graph is None or not mission.incremental:
            self._graph = self._complete(known, self.uav.goal).with_weights_held()
        elif self._graph.model != known:
            self._graph = reweigh(self._graph, known)
        graph = self._graph if not situation.obstacles else reweigh(self._graph, problem.model)
        return with_node(graph, first)

    def _first(self, problem: Problem) -> Point:
        """Return the first node of a plan: the position of the UAV, or the lattice point nearest to it (E18)."""
        if self.mission.start == "exact":
            return problem.start
        lattice = self.mission.lattice
        x, y = lattice.points[lattice.nearest(problem.start)].tolist()
        return problem.start if problem.model.area.contains((x, y)) else (x, y)

    def _from(self, problem: Problem, answer: Solution, graph: GeometricGraph) -> Solution:
        """Turn nodes into waypoints that begin at the UAV, and count the way to a snapped start."""
        if not answer.status.has_path or graph.positions is None:
            return answer
        path = graph.positions[[graph.index_of(node) for node in answer.nodes]]
        if tuple(path[0]) == problem.start:
            return dataclasses.replace(answer, path=path)
        # the path skips the snapped point, as in the paper's code, unless an area is in the way; only bends count, as
        # rounding decides which points in line a path names
        bends = _bends(path)
        for rest in (bends[1:], bends):
            bent = np.vstack([problem.start, rest])
            evaluation = problem.evaluate(bent)
            if len(rest) and evaluation.feasible:
                return dataclasses.replace(answer, status=Status.FOUND, path=bent, cost=evaluation.cost, nodes=())
        return dataclasses.replace(answer, status=Status.NO_PATH, message="the nearest lattice point is out of reach")


def _bends(path: FloatArray) -> FloatArray:
    """Leave out the waypoints in line with their neighbours."""
    before, after = np.diff(path[:-1], axis=0), np.diff(path[1:], axis=0)
    turn = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    kept = turn > IN_LINE * np.hypot(*before.T) * np.hypot(*after.T)
    return path[np.concatenate([[True], kept, [True]])] if len(path) > 1 else path


def _without(graph: GeometricGraph, nodes: "frozenset[Node]") -> GeometricGraph:
    """Return a dense graph in which no edge leads to some nodes."""
    weights = graph.weight_matrix().copy()
    gone = [graph.index_of(node) for node in nodes]
    weights[gone, :] = np.inf
    weights[:, gone] = np.inf
    weights[gone, gone] = 0.0
    return GeometricGraph.from_matrix(weights, positions=graph.positions)

"""The path of the least objective on a graph: weighted sums bound it, and labels with all costs find the optimum."""

import dataclasses
import heapq
import math
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np
from scipy.sparse.csgraph import dijkstra

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Solver, run
from cgla_graph.model.uncertain.field import UncertainField
from cgla_graph.model.uncertain.tail_mean import TailMean
from cgla_graph.solvers.uncertain.bundle import level_of

#: Weights of all pairs in all scenarios, at most: 400 MB.
MOST_WEIGHTS = 50_000_000
#: Labels that are followed, and steps of the ascent, at most.
MOST_LABELS, MOST_STEPS = 20_000, 60
#: Relative rounding of sums along a path.
ROUNDING = 1e-12


@dataclass
class FoundOnGraph:
    """
    What a search found.

    Attributes
    ----------
    answer
        The first answer of the solver.
    nodes, path
        The best path; empty without one.
    weights
        Of the scenarios in the best bound.
    bound, weighted_bound
        Of the objective of all paths on the graph: with the search of labels, and by weighted sums alone. NaN where
        the solver is not exact and there is no search.
    is_optimal
        Whether the search ended.
    message
        What was done.
    """

    answer: Solution
    nodes: tuple[object, ...] = ()
    path: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    weights: FloatArray = field(default_factory=lambda: np.empty(0))
    bound: float = math.nan
    weighted_bound: float = math.nan
    is_optimal: bool = False
    message: str = ""


class GraphSearch:
    """
    Searches a graph for the path of the least objective.

    First, an ascent over weights of the scenarios, whose weighted graphs the solver solves. Its best weights bound the
    objective of all paths. Then a search by labels closes the gap: a label is a path to a node with its cost in each
    scenario. It is followed if the greatest, over the weights tried, of its weighted cost and the weighted cost-to-go
    is below the best known objective, and if no other label at its node costs less in all scenarios. If labels run out,
    the path is the optimum; after `MOST_LABELS`, the least such number of the labels that are left is the bound.

    Parameters
    ----------
    problem
        On the graph of a lattice.
    uncertain
        The scenarios.
    tail
        The objective.
    solver
        A graph solver.

    Raises
    ------
    ProblemError
        If the graph is so large that its weights in all scenarios would not be held.
    """

    def __init__(self, problem: GraphProblem, uncertain: UncertainField, tail: TailMean, solver: Solver) -> None:
        self.problem, self.uncertain, self.tail, self.solver = problem, uncertain, tail, solver
        graph, model = problem.graph, problem.graph.model
        needed = graph.n_nodes**2 * len(uncertain.scenarios)
        if model is None or needed > MOST_WEIGHTS:
            msg = (
                f"{graph.n_nodes} nodes in {len(uncertain.scenarios)} scenarios have {needed:,} weights; at most "
                f"{MOST_WEIGHTS:,} are held: lower the resolution, take fewer scenarios, or use hybrid"
            )
            raise ProblemError(msg)
        known: dict[int, FloatArray] = {}
        self.costs = np.empty((len(uncertain.scenarios), graph.n_nodes, graph.n_nodes))
        first: dict[object, int] = {}
        for number, one in enumerate(uncertain.scenarios):
            same = first.setdefault(one, number)
            if same not in known:
                known[same] = graph.under(CostModel(one, model.k, model.no_fly)).weight_matrix()
            self.costs[number] = known[same]
        self.ends = graph.index_of(problem.source), graph.index_of(problem.target)
        self.paths: dict[tuple[int, ...], FloatArray] = {}

    def run(self) -> FoundOnGraph:
        """Ascend, then search by labels."""
        weights = self.tail.inside([float(chance) for chance in self.uncertain.weights])
        answer = self._solved(weights)
        found = FoundOnGraph(answer, weights=weights)
        if not self.paths:
            found.bound = math.inf if answer.status is Status.NO_PATH else math.nan
            return found
        best, known, tried = weights, -math.inf, [weights]
        for _ in range(MOST_STEPS):
            value = self._least(weights)
            best, known = (weights, value) if value > known else (best, known)
            promised, weights, _ = level_of(np.array(list(self.paths.values())), self.tail, best, 1.0, known)
            upper = min(map(self.tail.of, self.paths.values()))
            if promised <= known * (1.0 + ROUNDING) or upper <= known * (1.0 + ROUNDING):
                break
            before = len(self.paths)
            self._solved(weights)
            tried.append(weights)
            if len(self.paths) == before and self._least(weights) >= promised * (1.0 - ROUNDING):
                best, known = weights, self._least(weights)
                break
        exact = self.solver.traits.exact
        found.weighted_bound = (1.0 - ROUNDING) * float(self._to_go(best)[1][self.ends[0]]) if exact else math.nan
        found.weights = best
        if exact:
            found.bound, found.is_optimal, labels = self._labelled([best, *tried[-3:]], found.weighted_bound)
            found.message = f"{labels} labels after {len(tried)} weighted graphs"
        nodes = min(self.paths, key=lambda one: self.tail.of(self.paths[one]))
        graph = self.problem.graph
        found.nodes = tuple(graph.labels[node] for node in nodes)
        if graph.positions is not None:
            found.path = graph.positions[list(nodes)]
        return found

    def _mixed(self, weights: FloatArray) -> FloatArray:
        """Weigh all pairs under weights of scenarios."""
        mixed = np.where(np.isfinite(self.costs[0]), 0.0, np.inf)
        for weight, costs in zip(weights.tolist(), self.costs, strict=True):
            if weight > 0.0:
                mixed += weight * costs
        return np.asarray(mixed)

    def _solved(self, weights: FloatArray) -> Solution:
        """Solve the graph under weights, and keep the path."""
        graph = GeometricGraph.from_matrix(self._mixed(weights), positions=self.problem.graph.positions)
        answer = run(self.solver, GraphProblem(graph, *self.ends))
        if answer.status.has_path:
            nodes = tuple(graph.index_of(node) for node in answer.nodes)
            tails, heads = list(nodes[:-1]), list(nodes[1:])
            self.paths[nodes] = self.costs[:, tails, heads].sum(axis=1)
        return dataclasses.replace(answer, nodes=())

    def _least(self, weights: FloatArray) -> float:
        return min(float(costs @ weights) for costs in self.paths.values())

    def _to_go(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the weighted graph, and the weighted cost from each node to the target."""
        mixed = self._mixed(weights)
        # (csgraph takes a zero for no edge)
        search: Any = dijkstra
        held = np.where(np.isfinite(mixed), np.maximum(mixed, 1e-300), 0.0)
        np.fill_diagonal(held, 0.0)
        return mixed, np.asarray(search(held.T, indices=self.ends[1]))

    def _labelled(self, chosen: list[FloatArray], known: float) -> tuple[float, bool, int]:
        """Search by labels; return the bound, whether it ended, and how many labels were followed."""
        source, target = self.ends
        several = [self._to_go(weights) for weights in chosen]
        mixed, to_go = np.stack([one[0] for one in several]), np.stack([one[1] for one in several])
        upper = min(map(self.tail.of, self.paths.values()))
        order = count()
        start = np.zeros(len(self.costs))
        queue: list[tuple[float, int, int, FloatArray, tuple[int, ...]]] = [
            (float(to_go[:, source].max()), next(order), source, start, (source,))
        ]
        closed: dict[int, list[FloatArray]] = {}
        followed = 0
        while queue:
            promised, _, node, costs, path = heapq.heappop(queue)
            if promised >= upper * (1.0 - ROUNDING):
                break
            if any((other <= costs).all() for other in closed.get(node, [])):
                continue
            if followed == MOST_LABELS:
                return max(known, min(promised, upper) * (1.0 - ROUNDING)), False, followed
            followed += 1
            closed.setdefault(node, []).append(costs)
            so_far = np.array([weights @ costs for weights in chosen])
            promise = (so_far[:, None] + mixed[:, node] + to_go).max(axis=0)
            heads: IntArray = np.flatnonzero(promise < upper * (1.0 - ROUNDING))
            for head in heads.tolist():
                if head in path:
                    continue
                further, longer = costs + self.costs[:, node, head], (*path, head)
                if head != target:
                    heapq.heappush(queue, (float(promise[head]), next(order), head, further, longer))
                elif self.tail.of(further) < upper:
                    self.paths[longer] = further
                    upper = self.tail.of(further)
        return max(known, upper * (1.0 - ROUNDING)), True, followed

"""Dijkstra's algorithm of scipy, over the same weights."""

import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.shortest_paths import least_cost_tree, path_to


@dataclass(frozen=True)
class Dijkstra:
    """
    `scipy.sparse.csgraph.dijkstra`: the independent reference for every exact graph solver.

    Examples
    --------
    >>> from cgla_graph.model.graph import GeometricGraph
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> Dijkstra().solve(GraphProblem(chain, 0, 2)).cost
    2.0
    """

    traits: ClassVar[Traits] = Traits(
        "dijkstra", "scipy.sparse.csgraph.dijkstra", domain="graph", exact=True, needs_positive=True
    )

    def solve(self, problem: GraphProblem) -> Solution:
        """Run scipy's Dijkstra from the source and walk back; handing the weights over is reported as time to build."""
        graph = problem.graph
        began = time.perf_counter()
        weights = graph.to_csgraph()
        build_seconds = time.perf_counter() - began
        source, target = graph.index_of(problem.source), graph.index_of(problem.target)
        costs, before = least_cost_tree(weights, source)
        if not np.isfinite(costs[target]):
            return Solution(Status.NO_PATH, build_seconds=build_seconds)
        nodes = tuple(graph.labels[i] for i in path_to(target, before))
        return Solution(Status.OPTIMAL, nodes=nodes, cost=float(costs[target]), build_seconds=build_seconds)

"""Dijkstra's algorithm of scipy, over the same weights."""

import time
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.sparse import csgraph

from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits


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
        # the stubs of scipy know neither sparse arrays here nor the shape of what comes back
        search: Any = csgraph.dijkstra
        costs, before = search(weights, indices=source, return_predecessors=True)
        if not np.isfinite(costs[target]):
            return Solution(Status.NO_PATH, build_seconds=build_seconds)
        indices = [target]
        while indices[-1] != source:
            indices.append(int(before[indices[-1]]))
        nodes = tuple(graph.labels[i] for i in reversed(indices))
        return Solution(Status.OPTIMAL, nodes=nodes, cost=float(costs[target]), build_seconds=build_seconds)

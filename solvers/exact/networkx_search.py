"""Dijkstra's algorithm and A* of networkx, over the same weights."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import networkx as nx

from cgla_graph.model.adjacency import Node
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits

#: A networkx graph takes about a kilobyte an edge; beyond this it is no use.
MAX_EDGES = 4_000_000


@dataclass(frozen=True)
class NetworkxDijkstra:
    """
    `networkx.dijkstra_path`: slow and plain, a second independent reference.

    Examples
    --------
    >>> from cgla_graph.model.graph import GeometricGraph
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> NetworkxDijkstra().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    traits: ClassVar[Traits] = Traits(
        "networkx", "networkx.dijkstra_path", domain="graph", exact=True, needs_positive=True
    )

    def solve(self, problem: GraphProblem) -> Solution:
        """Hand the graph over, which is reported as time to build, and search."""
        return _search(problem, lambda graph: nx.dijkstra_path(graph, problem.source, problem.target))


@dataclass(frozen=True)
class NetworkxAstar:
    """
    `networkx.astar_path` with the straight line to the target as heuristic.

    The heuristic is admissible and consistent where every weight is at least the length of its edge, as Eq. 5's are;
    on a graph whose weights came from elsewhere, or without positions, it is 0.

    Examples
    --------
    >>> from cgla_graph.model.graph import GeometricGraph
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> NetworkxAstar().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    traits: ClassVar[Traits] = Traits(
        "networkx-astar",
        "networkx.astar_path, straight-line heuristic",
        domain="graph",
        exact=True,
        needs_positive=True,
    )

    def solve(self, problem: GraphProblem) -> Solution:
        """Hand the graph over, which is reported as time to build, and search."""
        graph, positions = problem.graph, problem.graph.positions
        guided = positions is not None and graph.model is not None and graph.model.field.is_probability
        spots = dict(zip(graph.labels, positions.tolist(), strict=True)) if guided and positions is not None else {}

        def straight_line(node: Node, goal: Node) -> float:
            return math.dist(spots[node], spots[goal])

        heuristic = straight_line if guided else None
        return _search(problem, lambda g: nx.astar_path(g, problem.source, problem.target, heuristic))


def _search(problem: GraphProblem, find: "Callable[[nx.Graph[Any]], Sequence[Node]]") -> Solution:
    # of a graph that is not weighed yet, counting the edges would weigh it
    graph = problem.graph
    n_edges = graph.n_pairs if graph.is_implicit else graph.n_edges
    if n_edges > MAX_EDGES:
        return Solution(Status.UNSUPPORTED, message=f"{n_edges} edges; networkx takes {MAX_EDGES} here")
    began = time.perf_counter()
    searched = graph.to_networkx()
    build_seconds = time.perf_counter() - began
    try:
        nodes = tuple(find(searched))
    except nx.NetworkXNoPath:
        return Solution(Status.NO_PATH, build_seconds=build_seconds)
    return Solution(Status.OPTIMAL, nodes=nodes, cost=problem.evaluate(nodes), build_seconds=build_seconds)

"""Dijkstra's algorithm and A* of networkx, over the same weights."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import networkx as nx

from cgla_graph.model.adjacency import Node
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import library_traits
from cgla_graph.solvers.exact.library_search import search

#: Measured; an edge is a dictionary in a dictionary.
BYTES_AN_EDGE = 1000


@dataclass(frozen=True)
class NetworkxDijkstra:
    """
    `networkx.dijkstra_path`: slow and plain, a second independent reference.

    Examples
    --------
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> NetworkxDijkstra().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    traits: ClassVar[Traits] = library_traits("networkx", "networkx.dijkstra_path")

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
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> NetworkxAstar().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    traits: ClassVar[Traits] = library_traits("networkx-astar", "networkx.astar_path, straight-line heuristic")

    def solve(self, problem: GraphProblem) -> Solution:
        """Hand the graph over, which is reported as time to build, and search."""
        graph, positions = problem.graph, problem.graph.positions
        guided = positions is not None and graph.model is not None and graph.model.field.is_proper
        spots = dict(zip(graph.labels, positions.tolist(), strict=True)) if guided and positions is not None else {}

        def straight_line(node: Node, goal: Node) -> float:
            return math.dist(spots[node], spots[goal])

        heuristic = straight_line if guided else None
        return _search(problem, lambda g: nx.astar_path(g, problem.source, problem.target, heuristic))


def _search(problem: GraphProblem, find: "Callable[[nx.Graph[Any]], Sequence[Node]]") -> Solution:
    def found(graph: "nx.Graph[Any]", _source: int, _target: int) -> list[int]:
        try:
            return [problem.graph.index_of(node) for node in find(graph)]
        except nx.NetworkXNoPath:
            return []

    return search(problem, "networkx", BYTES_AN_EDGE, GeometricGraph.to_networkx, found)

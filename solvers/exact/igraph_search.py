"""Dijkstra's algorithm of igraph, over the same weights."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import library_traits
from cgla_graph.solvers.exact.library_search import edge_list, search

#: Measured on sparse graphs, whose edges and weights pass through Python; dense ones take half.
BYTES_AN_EDGE = 200


@dataclass(frozen=True)
class Igraph:
    """
    `igraph.Graph.get_shortest_path`, by Dijkstra's algorithm: compiled, on a graph of igraph's own.

    Examples
    --------
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> Igraph().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    traits: ClassVar[Traits] = library_traits("igraph", "igraph.Graph.get_shortest_path", "igraph")

    def solve(self, problem: GraphProblem) -> Solution:
        """Hand the graph over, which is reported as time to build, and search."""
        return search(problem, "igraph", BYTES_AN_EDGE, _built, _found)


def _built(graph: GeometricGraph) -> tuple[Any, list[float]]:
    import igraph  # noqa: PLC0415 - optional

    n = graph.n_nodes
    if graph.is_sparse:
        tails, heads, weights = edge_list(graph)
        return igraph.Graph(n=n, edges=zip(tails, heads, strict=True), directed=graph.directed), weights
    # a complete graph is made without a list of edges, ten times faster; its order of edges is that of the matrix. A
    # missing edge costs infinity: a path takes one only where there is no other
    kept = ~np.eye(n, dtype=np.bool_) if graph.directed else np.triu(np.ones((n, n), dtype=np.bool_), 1)
    return igraph.Graph.Full(n, directed=graph.directed), graph.weight_matrix()[kept].tolist()


def _found(handed: tuple[Any, list[float]], source: int, target: int) -> Sequence[int]:
    graph, weights = handed
    with warnings.catch_warnings():
        # igraph also warns that the target cannot be reached
        warnings.simplefilter("ignore", RuntimeWarning)
        path: list[int] = graph.get_shortest_path(source, target, weights=weights, algorithm="dijkstra")
    return path

"""Dijkstra's algorithm of rustworkx, over the same weights."""

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

#: Measured on sparse graphs, whose edges and weights pass through Python; dense ones take a third.
BYTES_AN_EDGE = 200


@dataclass(frozen=True)
class Rustworkx:
    """
    `rustworkx.dijkstra_shortest_paths`, up to the target: compiled, but weights stay Python numbers.

    Examples
    --------
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> Rustworkx().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    traits: ClassVar[Traits] = library_traits("rustworkx", "rustworkx.dijkstra_shortest_paths", "rustworkx")

    def solve(self, problem: GraphProblem) -> Solution:
        """Hand the graph over, which is reported as time to build, and search."""
        return search(problem, "rustworkx", BYTES_AN_EDGE, _built, _found)


def _built(graph: GeometricGraph) -> Any:  # noqa: ANN401 - a graph of either kind
    import rustworkx  # noqa: PLC0415 - optional

    kind: Any = rustworkx.PyDiGraph if graph.directed else rustworkx.PyGraph
    if not graph.is_sparse:
        # without a null value, an edge of weight 0 is none
        return kind.from_adjacency_matrix(graph.weight_matrix(), null_value=np.inf)
    tails, heads, weights = edge_list(graph)
    built = kind(node_count_hint=graph.n_nodes, edge_count_hint=len(weights))
    built.add_nodes_from(range(graph.n_nodes))
    built.extend_from_weighted_edge_list(zip(tails, heads, weights, strict=True))
    return built


def _found(graph: Any, source: int, target: int) -> Sequence[int]:  # noqa: ANN401 - a graph of either kind
    import rustworkx  # noqa: PLC0415 - optional

    paths = rustworkx.dijkstra_shortest_paths(graph, source, target=target, weight_fn=float)
    # the one to the target, or none
    return next(iter(paths.values()), [])

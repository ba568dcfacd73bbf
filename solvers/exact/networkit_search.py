"""Dijkstra's algorithm of NetworKit, over the same weights."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import library_traits
from cgla_graph.solvers.exact.library_search import search

#: Measured; NetworKit stores an undirected edge twice, and wants the indices with 64 bits.
BYTES_AN_EDGE = 100


@dataclass(frozen=True)
class Networkit:
    """
    `networkit.distance.Dijkstra`, up to the target: compiled, on a graph of NetworKit's own.

    Examples
    --------
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> Networkit().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    traits: ClassVar[Traits] = library_traits("networkit", "networkit.distance.Dijkstra", "networkit")

    def solve(self, problem: GraphProblem) -> Solution:
        """Hand the graph over, which is reported as time to build, and search."""
        return search(problem, "NetworKit", BYTES_AN_EDGE, _built, _found)


def _built(graph: GeometricGraph) -> Any:  # noqa: ANN401 - NetworKit has no type hints
    import networkit  # noqa: PLC0415 - optional

    # several threads add edges in an order of their own each time, by which ties would be broken; one is no slower
    threads = networkit.getMaxNumberOfThreads()
    networkit.setNumberOfThreads(1)
    try:
        # its other constructors add edge by edge; stored zeros are edges here
        return networkit.GraphFromCsr(graph.to_csgraph(), directed=graph.directed, weighted=True)
    finally:
        networkit.setNumberOfThreads(threads)


def _found(graph: Any, source: int, target: int) -> Sequence[int]:  # noqa: ANN401 - NetworKit has no type hints
    import networkit  # noqa: PLC0415 - optional

    run = networkit.distance.Dijkstra(graph, source, storePaths=True, storeNodesSortedByDistance=False, target=target)
    run.run()
    path: list[int] = run.getPath(target)
    return path

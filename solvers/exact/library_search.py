"""Search by a graph library, which gets a graph of its own; all but the search is time to build."""

import time
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution, Status

Handed = TypeVar("Handed")

#: Memory that a library's graph may take, in bytes.
MOST_BYTES = 4_000_000_000


def search(
    problem: GraphProblem,
    library: str,
    bytes_an_edge: int,
    build: Callable[[GeometricGraph], Handed],
    find: Callable[[Handed, int, int], Sequence[int]],
) -> Solution:
    """
    Hand the graph to a library and have it searched, unless it takes too much memory there.

    Parameters
    ----------
    problem
        The problem to solve.
    library
        Its name.
    bytes_an_edge
        Memory an edge takes at the peak of building.
    build
        Makes the library's graph; node ``i`` there is the node of index ``i``.
    find
        Given that graph and the indices of source and target, which differ: the indices along a least-cost path, none
        if there is no path.

    Returns
    -------
    solution
        Optimal, or no path; unsupported for a graph that is too large.
    """
    graph = problem.graph
    began = time.perf_counter()
    # of a graph that is not weighed yet, counting the edges would weigh it
    n_edges = graph.n_pairs if graph.is_implicit else graph.n_edges
    most = MOST_BYTES // bytes_an_edge
    if n_edges > most:
        return Solution(Status.UNSUPPORTED, message=f"{n_edges} edges; {library} takes {most} here")
    handed = build(graph)
    build_seconds = time.perf_counter() - began
    source, target = graph.index_of(problem.source), graph.index_of(problem.target)
    # some libraries know no path from a node to itself
    indices = [source] if source == target else find(handed, source, target)
    # millions of edges take as long to free as the search; that is part of having a graph of one's own
    began = time.perf_counter()
    del handed
    build_seconds += time.perf_counter() - began
    nodes = tuple(graph.labels[i] for i in indices)
    cost = problem.evaluate(nodes) if nodes else np.inf
    if not np.isfinite(cost):
        return Solution(Status.NO_PATH, build_seconds=build_seconds)
    return Solution(Status.OPTIMAL, nodes=nodes, cost=cost, build_seconds=build_seconds)


def edge_list(graph: GeometricGraph) -> tuple[list[int], list[int], list[float]]:
    """
    List the edges as tails, heads and weights, those of an undirected graph once.

    Examples
    --------
    >>> edge_list(GeometricGraph.from_matrix([[0, 3], [3, 0]]))
    ([0], [1], [3.0])
    """
    entries = graph.to_csgraph().tocoo()
    tails, heads = entries.coords
    kept = slice(None) if graph.directed else tails < heads
    return tails[kept].tolist(), heads[kept].tolist(), entries.data[kept].tolist()

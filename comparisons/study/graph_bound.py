"""The proven bound on a graph: the least cost itself, by one search backwards from a target, for all sources."""

import math
import time
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import FULL_UP_TO, GraphProblem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS
from cgla_graph.model.weights import beyond_holding


class Held(NamedTuple):
    """A graph with its weights in memory, where they are affordable, and the time to weigh it, seconds."""

    graph: GeometricGraph
    seconds: float


class Search(NamedTuple):
    """Least costs to one target and the next node on the way there, shape ``(n,)``; below 0 where there is none."""

    values: FloatArray
    next_nodes: IntArray
    seconds: float


@lru_cache(maxsize=2)
def held(graph: GeometricGraph) -> Held:
    """
    Weigh a graph once for all its pairs.

    Examples
    --------
    >>> graph = GeometricGraph.from_matrix([[0, 1], [1, 0]])
    >>> held(graph).graph is graph
    True
    """
    began = time.perf_counter()
    made = graph.with_weights_held() if graph.n_nodes <= FULL_UP_TO else graph
    return Held(made, time.perf_counter() - began if made is not graph else 0.0)


def certify_on_graph(problem: GraphProblem, tolerance: float) -> Certificate:
    """
    Prove the least cost between two nodes by Dijkstra's algorithm (scipy).

    The search starts at the target and finds the least costs of all sources at once; it is made once for all pairs with
    this target. Its whole time is that of each certificate, and no solver's.

    Parameters
    ----------
    problem
        The graph and its two nodes.
    tolerance
        As asked for; the bound is exact up to rounding.

    Returns
    -------
    certificate
        Its bounds are the least cost, infinite where there is no path. No bound, and the reason, where a weight is
        below 0 or a graph does not fit into memory.

    Raises
    ------
    GraphError
        If weights add up to more than the largest float.

    Examples
    --------
    >>> graph = GeometricGraph.from_matrix([[0, 2, 9], [2, 0, 1], [9, 1, 0]], labels="abc")
    >>> certify_on_graph(GraphProblem(graph, "a", "c"), 0.005).lower_bound
    3.0
    """
    graph = held(problem.graph).graph
    why = beyond_holding(graph.n_nodes) if graph.is_implicit else ""
    if not why and graph.has_negative_weights:
        why = NEGATIVE_WEIGHTS
    if why:
        return _certificate(math.nan, math.inf, tolerance, f"a proof needs {why}" if graph.is_implicit else why, 0.0)
    found = _search(graph, graph.index_of(problem.target))
    node = graph.index_of(problem.source)
    if not math.isfinite(found.values[node]):
        problem.reject_overflow()
        return _certificate(math.inf, math.inf, tolerance, "no path leads from source to target", found.seconds)
    nodes = [node]
    while found.next_nodes[nodes[-1]] >= 0:
        nodes.append(int(found.next_nodes[nodes[-1]]))
    # added up as the oracle adds costs up, so that equal paths have equal costs
    cost = problem.evaluate([graph.labels[one] for one in nodes])
    return _certificate(cost, cost, tolerance, "least cost, by a search backwards from the target", found.seconds)


@lru_cache(maxsize=8)
def _search(graph: GeometricGraph, target: int) -> Search:
    began = time.perf_counter()
    rows = graph.to_csgraph()
    backwards = scipy.sparse.csr_array(rows.T) if graph.directed else rows
    search: Any = scipy.sparse.csgraph.dijkstra
    values, before = search(backwards, indices=target, return_predecessors=True)
    return Search(values, np.asarray(before), time.perf_counter() - began)


def _certificate(low: float, high: float, tolerance: float, message: str, seconds: float) -> Certificate:
    return Certificate(
        lower_bound=low,
        upper_bound=high,
        tolerance=tolerance,
        spacing=0.0,
        cells=0,
        message=message,
        seconds=seconds,
    )

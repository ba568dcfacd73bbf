"""Random graphs for checks of the cost matrix, and its least costs by scipy."""

import math
from typing import Any

import numpy as np
from scipy.sparse import csgraph

from cgla_graph._types import FloatArray
from cgla_graph.cost_to_go.theorem_1 import zero_diagonal
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.scenarios.random_map import random_scenario

#: Relative excess that is fairly near to a tie; random weights do not come nearer by chance.
TIED = 1e-9


def random_graph(rng: np.random.Generator, most: int = 25) -> GeometricGraph:
    """Draw a graph: any positive weights, directed, some edges missing; or points in the plane under Eq. 5."""
    n = int(rng.integers(2, most))
    if rng.random() < 0.5:  # noqa: PLR2004 - half of each kind
        weights = rng.random((n, n)) + 1e-6
        weights[rng.random((n, n)) < rng.random() * 0.6] = np.inf
        return GeometricGraph.from_matrix(weights)
    points, field = rng.random((n, 2)), random_scenario(int(rng.integers(2**31))).problem.field
    return GeometricGraph.complete(points, field, k=float(rng.uniform(0.0, 100.0)))


def least_costs(graph: GeometricGraph, target: int) -> FloatArray:
    """Return G by scipy's Dijkstra."""
    # rows of ours lead to the target, scipy's lead away from it
    edges = csgraph.csgraph_from_dense(zero_diagonal(graph).T, null_value=np.inf)
    # the stubs of scipy know no sparse arrays here
    search: Any = csgraph.dijkstra
    found: FloatArray = search(edges, indices=target)
    return found


def runs_in_circle(weights: FloatArray, values: FloatArray, node: int, target: int) -> bool:
    """Walk along the least A + G over nodes that have a value; tell whether one comes twice."""
    seen: set[int] = set()
    while node != target and node not in seen and math.isfinite(values[node]):
        seen.add(node)
        offers = weights[node] + values
        offers[node] = np.inf
        node = int(np.argmin(offers))
    return node in seen

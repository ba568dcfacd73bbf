"""Graphs, their weights and targets for the tests of Theorem 1, and schedules by short names."""

import numpy as np
from hypothesis import strategies as st

from cgla_graph._types import FloatArray
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.weights import DenseWeights
from cgla_graph.testing.strategies import (
    weight_matrices,
)


def close(found: FloatArray, expected: FloatArray) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=0.0)


def sweeps(graph: GeometricGraph, target: int, n_sweeps: int) -> CostMatrix:
    """Take every node in turn, again and again."""
    return cost_matrix(graph, target, schedule="given", order=list(range(graph.n_nodes)) * n_sweeps)


def given_order(graph: GeometricGraph, target: int, order: list[int]) -> CostMatrix:
    return cost_matrix(graph, target, schedule="given", order=order)


def walk(matrix: CostMatrix, node: int) -> list[int]:
    """Return the path from a node as indices."""
    return [matrix.graph.index_of(label) for label in matrix.path_from(node)]


def unchecked(weights: FloatArray) -> GeometricGraph:
    """Build a graph past the checks, with weights that Theorem 1 does not allow."""
    return GeometricGraph(range(len(weights)), directed=True, weights=DenseWeights(np.array(weights, dtype=np.float64)))


@st.composite
def cases(
    draw: st.DrawFn, weights: st.SearchStrategy[FloatArray] | None = None
) -> tuple[GeometricGraph, FloatArray, int]:
    """Draw a graph, held densely or sparsely, its weights and a target."""
    matrix = draw(weight_matrices() if weights is None else weights)
    graph = GeometricGraph.from_matrix(matrix)
    if draw(st.booleans()):
        graph = GeometricGraph.from_sparse(graph.to_csgraph(), directed=graph.directed)
    return graph, matrix, draw(st.integers(0, len(matrix) - 1))


Case = tuple[GeometricGraph, FloatArray, int]

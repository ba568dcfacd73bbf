"""Least-cost trees on sparse graphs: as cheap as those of scipy, and no harm where costs make no sense."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse
from scipy.sparse import csgraph
from strategies import examples

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.solvers.continuous.roadmap_kernels import grow_tree
from cgla_graph.testing import strategies as drawn


def tree(matrix: FloatArray) -> tuple[FloatArray, IntArray]:
    """Grow the tree from node 0 of a dense matrix of costs, where infinity is no edge."""
    n = len(matrix)
    tails, heads = np.nonzero(np.isfinite(matrix))
    starts = np.concatenate([[0], np.cumsum(np.bincount(tails, minlength=n))])
    values, before = np.full(n, np.inf), np.full(n, -1)
    grow_tree(starts, heads, matrix[tails, heads], 0, values, before)
    return values, before


@given(st.one_of(drawn.weight_matrices(), drawn.whole_weights(0)))
@examples(60)
def test_trees_cost_as_little_as_those_of_scipy(matrix: FloatArray) -> None:
    values, before = tree(matrix)
    (tails, heads), n = np.nonzero(np.isfinite(matrix)), len(matrix)
    # (of a dense matrix, scipy takes zeros for no edges)
    edges = sparse.csr_array((matrix[tails, heads], (tails, heads)), shape=(n, n))
    assert values == pytest.approx(np.asarray(csgraph.dijkstra(edges, indices=0)), rel=1e-14)
    assert before[0] == -1
    for node in range(1, n):
        assert (before[node] < 0) == np.isinf(values[node])
        if before[node] >= 0:
            assert values[node] == values[before[node]] + matrix[before[node], node]


@given(drawn.weight_matrices(elements=st.floats(-3.0, 3.0)))
@examples(30)
def test_with_costs_below_nothing_it_ends_and_finds_ways(matrix: FloatArray) -> None:
    values, before = tree(matrix)
    assert (np.isfinite(values) == np.isfinite(tree(np.where(np.isfinite(matrix), 1.0, np.inf))[0])).all()
    for node in np.flatnonzero(before >= 0).tolist():
        ancestors = [node]
        while before[ancestors[-1]] >= 0 and len(ancestors) <= len(matrix):
            ancestors.append(int(before[ancestors[-1]]))
        assert ancestors[-1] == 0

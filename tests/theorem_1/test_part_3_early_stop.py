"""Theorem 1 (3): the source comes into Delta_k, and the search may stop there (Step 2)."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import (
    path_cost,
)
from strategies import fast, usual
from theorem_cases import Case, cases, given_order, walk

from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.testing.strategies import (
    weight_matrices,
    whole_weights,
)


@fast
@given(cases(st.one_of(whole_weights(), whole_weights(0), weight_matrices())))
def test_an_early_stop_finds_the_final_value_and_path(case: Case) -> None:
    graph, weights, target = case
    full = cost_matrix(graph, target)
    for source in range(graph.n_nodes):
        early = cost_matrix(graph, target, source=source)
        assert early.values[source] == full.values[source]
        assert early.order.tolist() == full.order[: early.rounds].tolist()
        assert (early.values[early.order] == full.values[early.order]).all()
        path = walk(early, source)
        if math.isinf(full.values[source]):
            assert path == []
            assert early.rounds == full.rounds
            continue
        assert path_cost(weights, path) == pytest.approx(full.values[source], rel=1e-12)
        # it stops in the very round in which the source enters Delta
        sets = [set(delta.tolist()) for delta in full.delta_sets]
        assert source in sets[early.rounds]
        assert all(source not in delta for delta in sets[: early.rounds])
        assert source not in early.order
        assert not early.converged
        assert [set(delta.tolist()) for delta in early.delta_sets] == sets[: early.rounds]


def test_before_the_source_enters_delta_its_value_may_be_wrong() -> None:
    graph = GeometricGraph.from_matrix([[0, 9, 1], [9, 0, 1], [1, 1, 0]])
    assert cost_matrix(graph, 0).delta_sets[2].tolist() == [1]
    assert given_order(graph, 0, [0]).value(1) == 9.0
    assert cost_matrix(graph, 0, source=1).value(1) == 2.0


@usual
@given(cases())
def test_the_source_may_be_the_target(case: Case) -> None:
    graph, _, target = case
    matrix = cost_matrix(graph, target, source=target)
    assert (matrix.value(target), matrix.rounds) == (0.0, 0)
    assert matrix.path_from(target) == [target]

"""Schedules of the p_r: how many rounds each takes, and which orders are not enough (C11)."""

import numpy as np
import pytest
from hypothesis import given
from oracles import (
    least_costs,
    least_hops,
)
from strategies import fast
from theorem_cases import Case, cases, close, given_order, sweeps

from cgla_graph._types import Bounds
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.testing.strategies import (
    whole_weights,
)

UNIT: Bounds = (0.0, 0.0, 1.0, 1.0)


@fast
@given(cases(whole_weights()))
def test_synchronous_rounds_are_the_hops_of_the_longest_shortest_path(case: Case) -> None:
    graph, weights, target = case
    matrix = cost_matrix(graph, target, schedule="synchronous")
    hops = least_hops(weights, target)
    assert matrix.rounds == max(hops.values()) <= graph.n_nodes - 1
    for node, count in hops.items():
        assert len(matrix.path_from(node)) == count + 1


def test_a_synchronous_round_uses_the_values_of_the_round_before() -> None:
    # Node 1 improves node 2 in the second round; node 3 hears of it in the third.
    weights = np.array([[0, 9, 9, 9], [1, 0, 9, 9], [7, 1, 0, 9], [np.inf, np.inf, 1, 0]])
    graph = GeometricGraph.from_matrix(weights)
    matrix = cost_matrix(graph, 0, schedule="synchronous")
    assert (matrix.rounds, matrix.value(3)) == (3, 3.0)
    assert sweeps(graph, 0, 1).value(3) == 3.0


@fast
@given(cases(whole_weights()))
def test_as_many_sweeps_as_hops_are_enough(case: Case) -> None:
    graph, weights, target = case
    n_sweeps = max(1, *least_hops(weights, target).values())
    assert (sweeps(graph, target, n_sweeps).values == least_costs(weights, target)).all()


def test_a_chain_against_the_order_needs_a_sweep_for_each_hop() -> None:
    n = 8
    weights = np.full((n, n), np.inf)
    for i in range(n - 1):
        weights[i, i + 1] = weights[i + 1, i] = 1.0
    np.fill_diagonal(weights, 0.0)
    graph = GeometricGraph.from_matrix(weights)
    assert not np.isfinite(sweeps(graph, n - 1, n - 2).values).all()
    assert np.isfinite(sweeps(graph, n - 1, n - 1).values).all()
    assert cost_matrix(graph, 0, schedule="synchronous").rounds == n - 1


@pytest.mark.parametrize("seed", range(3))
def test_a_single_pass_in_random_order_leaves_most_nodes_suboptimal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    field = RiskField([Threat(x, y, spread=0.06) for x, y in rng.random((8, 2)).tolist()])
    graph = GeometricGraph.complete(Lattice(9, bounds=UNIT), field, k=50.0).with_weights_held()
    final = cost_matrix(graph, graph.n_nodes - 1)
    draws = rng.integers(0, graph.n_nodes, graph.n_nodes).tolist()
    single = given_order(graph, graph.n_nodes - 1, draws)
    assert not single.converged
    assert (single.values > final.values * (1.0 + 1e-9)).mean() > 0.5
    enough = given_order(graph, graph.n_nodes - 1, rng.integers(0, graph.n_nodes, 100 * graph.n_nodes).tolist())
    close(enough.values, final.values)


def test_a_pivot_that_is_never_chosen_keeps_values_wrong() -> None:
    # C11: arbitrary p_r need not converge, however many.
    graph = GeometricGraph.from_matrix([[0, 9, 1], [9, 0, 1], [1, 1, 0]])
    matrix = given_order(graph, 0, [0, 1] * 1000)
    assert matrix.value(1) == 9.0
    assert not matrix.converged
    assert matrix.residual() == 7.0

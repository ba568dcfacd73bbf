"""Theorem 1 (2): a node that has served as p_r out of Delta_k keeps its value."""

import numpy as np
from hypothesis import given
from oracles import (
    delta_rounds,
    least_costs,
)
from strategies import fast
from theorem_cases import Case, cases, given_order

from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.graph import GeometricGraph


@fast
@given(cases())
def test_settled_values_are_final(case: Case) -> None:
    graph, _, target = case
    full = cost_matrix(graph, target)
    order = full.order.tolist()
    for end in range(len(order)):
        partial = given_order(graph, target, order[:end]).values
        settled = order[: end + 1]  # the node that is about to be settled as well
        assert (partial[settled] == full.values[settled]).all()
        assert (partial >= full.values).all()


def test_settling_the_unsettled_node_of_most_value_freezes_wrong_values() -> None:
    weights = np.array([[0, 9, 9], [1, 0, 9], [9, 1, 0]], dtype=float)
    _, frozen = delta_rounds(weights, 0, choose=max)
    assert frozen[2] == 9.0 > least_costs(weights, 0)[2]
    _, right = delta_rounds(weights, 0)
    assert right[2] == cost_matrix(GeometricGraph.from_matrix(weights), 0).value(2) == 2.0

"""Lemma 1: no round of Eq. 9 raises a value, and no value falls below the least cost."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from oracles import (
    apply_eq9,
    least_costs,
)
from strategies import fast, pivots, usual
from theorem_cases import Case, cases, given_order

from cgla_graph.cost_to_go.cost_matrix import Schedule, cost_matrix


@fast
@given(cases(), st.data())
def test_lemma_1_values_never_rise_and_never_fall_below_the_optimum(case: Case, data: st.DataObject) -> None:
    graph, weights, target = case
    order = data.draw(pivots(graph.n_nodes, 20))
    best = least_costs(weights, target)
    before = given_order(graph, target, []).values
    for end in range(len(order) + 1):
        matrix = given_order(graph, target, order[:end])
        assert (matrix.values <= before).all()
        assert (matrix.values >= best * (1.0 - 1e-12)).all()
        assert (matrix.values == apply_eq9(weights, target, order[:end])).all()
        before = matrix.values


@fast
@given(cases())
def test_the_first_round_gives_the_weights_to_the_target(case: Case) -> None:
    graph, weights, target = case
    assert (given_order(graph, target, [target]).values == weights[:, target]).all()


@usual
@given(cases(), st.sampled_from(["label-setting", "synchronous", "random"]), st.integers(0, 2**63 - 1))
def test_the_history_leads_from_nothing_to_the_values(case: Case, schedule: Schedule, seed: int) -> None:
    graph, weights, target = case
    matrix = cost_matrix(graph, target, schedule=schedule, seed=None if schedule == "synchronous" else seed)
    history = matrix.history()
    assert history.shape == (matrix.rounds + 1, graph.n_nodes)
    np.testing.assert_array_equal(history[0], np.where(np.arange(graph.n_nodes) == target, 0.0, np.inf))
    np.testing.assert_array_equal(history[-1], matrix.values)
    # Lemma 1: no value ever rises
    assert (history[1:] <= history[:-1]).all()
    if schedule != "synchronous":
        for before, after, node in zip(history, history[1:], matrix.order.tolist(), strict=False):
            assert (after <= weights[:, node] + before[node]).all() or schedule == "label-setting"
            assert (after >= np.minimum(before, weights[:, node] + before[node])).all()

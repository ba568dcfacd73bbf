"""The sets Delta_k of Eqs 10-12, ties in them, and Remark 1: ties have nothing to do with ties of paths."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import (
    delta_rounds,
    optimal_paths,
)
from strategies import fast, usual
from theorem_cases import Case, cases, close

from cgla_graph._types import Bounds
from cgla_graph.cost_to_go.cost_matrix import Schedule, cost_matrix
from cgla_graph.errors import GraphError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.testing.strategies import (
    weight_matrices,
    whole_weights,
)

UNIT: Bounds = (0.0, 0.0, 1.0, 1.0)


@fast
@given(cases(st.one_of(whole_weights(), whole_weights(0), weight_matrices())))
def test_delta_sets_are_those_of_eqs_10_to_12(case: Case) -> None:
    graph, weights, target = case
    matrix = cost_matrix(graph, target)
    expected, frozen = delta_rounds(weights, target)
    assert [set(delta.tolist()) for delta in matrix.delta_sets] == expected
    assert matrix.delta_sets[0].tolist() == [target] or (weights[:, target] == 0.0).any() or len(expected) == 1
    assert {i: matrix.values[i] for i in frozen} == frozen
    assert all(node in delta for node, delta in zip(matrix.order.tolist(), matrix.delta_sets, strict=True))
    assert all(node == delta.min() for node, delta in zip(matrix.order.tolist(), matrix.delta_sets, strict=True))


def test_a_weighed_graph_has_the_same_delta_sets() -> None:
    graph = GeometricGraph.complete(Lattice(20, bounds=UNIT))
    matrix = cost_matrix(graph, 210)
    weighed = cost_matrix(graph.with_weights_held(), 210)
    assert (weighed.values == matrix.values).all()
    assert [delta.tolist() for delta in weighed.delta_sets] == [delta.tolist() for delta in matrix.delta_sets]
    assert all(node in delta for node, delta in zip(matrix.order.tolist(), matrix.delta_sets, strict=True))
    assert matrix.residual() == 0.0


@usual
@given(cases(), st.integers(0, 2**63 - 1))
def test_ties_of_delta_are_drawn_by_the_seed(case: Case, seed: int) -> None:
    graph, _, target = case
    drawn, again = (cost_matrix(graph, target, seed=seed) for _ in range(2))
    assert drawn.order.tolist() == again.order.tolist()
    assert all(node in delta for node, delta in zip(drawn.order.tolist(), drawn.delta_sets, strict=True))
    close(drawn.values, cost_matrix(graph, target).values)


def test_of_a_tie_every_element_is_drawn() -> None:
    star = GeometricGraph.from_matrix(np.ones((5, 5)))
    assert {int(cost_matrix(star, 0, seed=seed).order[1]) for seed in range(40)} == {1, 2, 3, 4}
    assert cost_matrix(star, 0).order.tolist() == [0, 1, 2, 3, 4]


def test_a_tie_in_delta_beside_a_unique_path() -> None:
    # A star: both leaves of the target are in one Delta, yet each has one way only.
    star = np.full((4, 4), np.inf)
    for i, j, w in [(0, 1, 1.0), (0, 2, 1.0), (1, 3, 1.0)]:
        star[i, j] = star[j, i] = w
    np.fill_diagonal(star, 0.0)
    sets = cost_matrix(GeometricGraph.from_matrix(star), 0).delta_sets
    assert [1, 2] in [delta.tolist() for delta in sets]
    assert optimal_paths(star, 3, 0) == [(3, 1, 0)]


def test_two_optimal_paths_without_a_tie_in_delta() -> None:
    # A diamond s - a - t (1 + 3) and s - b - t (2 + 2).
    s, a, b, t = range(4)
    diamond = np.full((4, 4), np.inf)
    for i, j, w in [(s, a, 1.0), (a, t, 3.0), (s, b, 2.0), (b, t, 2.0)]:
        diamond[i, j] = diamond[j, i] = w
    np.fill_diagonal(diamond, 0.0)
    matrix = cost_matrix(GeometricGraph.from_matrix(diamond), t)
    assert [len(delta) for delta in matrix.delta_sets] == [1, 1, 1, 1]
    assert optimal_paths(diamond, s, t) == [(s, a, t), (s, b, t)]
    assert tuple(matrix.path_from(s)) in optimal_paths(diamond, s, t)


@pytest.mark.parametrize("schedule", ["synchronous", "given"])
def test_other_schedules_have_no_delta_sets(schedule: Schedule) -> None:
    order = [0] if schedule == "given" else None
    matrix = cost_matrix(GeometricGraph.from_matrix([[0, 1], [1, 0]]), 0, schedule=schedule, order=order)
    with pytest.raises(GraphError, match=f"the {schedule} schedule has no Delta sets"):
        _ = matrix.delta_sets

"""
Theorem 1 (1): whatever the order of the p_r, and after n rounds of label setting, G is the least cost to the target.

Each property has a case where its assumption is broken, in `test_where_it_fails.py`.
"""

import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import (
    least_costs,
    least_costs_networkx,
    path_cost,
)
from strategies import fast, off_lattice_points, pivots, usual
from theorem_cases import Case, cases, close, given_order, sweeps, walk

from cgla_graph._types import FloatArray, Point
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField
from cgla_graph.testing.strategies import (
    fields,
    lattices,
    networks,
    polygons,
    risk_weights,
    weight_matrices,
    whole_weights,
)


def check_every_schedule(graph: GeometricGraph, weights: FloatArray, target: int) -> None:
    expected = least_costs(weights, target)
    close(least_costs_networkx(weights, target), expected)
    for matrix in (
        cost_matrix(graph, target),
        cost_matrix(graph, target, schedule="synchronous"),
        cost_matrix(graph, target, seed=7),
        cost_matrix(graph, target, schedule="random", seed=7),
        sweeps(graph, target, graph.n_nodes + 1),
    ):
        close(matrix.values, expected)
        assert matrix.residual() == 0.0
        assert matrix.converged
        for node in range(graph.n_nodes):
            path = walk(matrix, node)
            if math.isinf(expected[node]):
                assert path == []
                assert matrix.successors[node] == -1
            else:
                assert (path[0], path[-1]) == (node, target)
                assert len(set(path)) == len(path)
                assert path_cost(weights, path) == pytest.approx(expected[node], rel=1e-12)


#: Weights that are equal but for the last bits: what a comparison with a margin takes for ties.
NEAR_TIES = [value for base in (1.0, 2.0) for value in (np.nextafter(base, 0.0), base, np.nextafter(base, 3.0))]


@usual
@given(st.integers(3, 12), st.data())
def test_near_ties_are_no_ties(n: int, data: st.DataObject) -> None:
    entries = data.draw(st.lists(st.sampled_from(NEAR_TIES), min_size=n * n, max_size=n * n))
    weights = np.reshape(entries, (n, n)) * (1.0 - np.eye(n))
    graph, target = GeometricGraph.from_matrix(weights), data.draw(st.integers(0, n - 1))
    matrix = cost_matrix(graph, target)
    # a sum of floats never falls when a term grows, so that all schedules end at the same floats
    for other in (
        cost_matrix(graph, target, schedule="synchronous"),
        cost_matrix(graph, target, schedule="random", seed=3),
        cost_matrix(graph.from_sparse(graph.to_csgraph()), target, seed=3),
    ):
        np.testing.assert_array_equal(other.values, matrix.values)
    assert matrix.residual() == 0.0
    assert (np.diff(matrix.values[matrix.order]) >= 0.0).all()
    for node, delta in zip(matrix.order.tolist(), matrix.delta_sets, strict=True):
        assert (matrix.values[delta] == matrix.values[node]).all()
    # an early stop waits for the source itself, not for a node that is almost as near
    for source in range(n):
        first = next(number for number, delta in enumerate(matrix.delta_sets) if source in delta)
        for held in (graph, graph.from_sparse(graph.to_csgraph())):
            early = cost_matrix(held, target, source=source)
            assert (early.rounds, early.values[source]) == (first, matrix.values[source])


@fast
@given(cases())
def test_every_schedule_finds_the_least_costs(case: Case) -> None:
    check_every_schedule(*case)


@usual
@given(cases(weight_matrices(max_nodes=30, edge=0.15)))
def test_nodes_that_cannot_reach_the_target_stay_infinite(case: Case) -> None:
    check_every_schedule(*case)


@usual
@given(cases(weight_matrices(elements=st.sampled_from([0.0, 0.0, 1.0, 2.0]))))
def test_zero_weights_converge_as_well(case: Case) -> None:
    check_every_schedule(*case)


@usual
@given(lattices(unit=True, max_side=5), fields(0, 4), risk_weights, off_lattice_points(), st.data(), st.booleans())
def test_lattices_with_threats_find_the_least_costs(
    lattice: Lattice, field: RiskField, k: float, extra: list[Point], data: st.DataObject, eight: bool
) -> None:
    make = GeometricGraph.eight_connected if eight else GeometricGraph.complete
    graph = make(lattice, field, k, extra=extra)
    target = data.draw(st.integers(0, graph.n_nodes - 1))
    implicit = cost_matrix(graph, target)
    weights = graph.weight_matrix()
    check_every_schedule(graph, weights, target)
    np.testing.assert_allclose(implicit.values, least_costs(weights, target), rtol=0.0, atol=1e-11 * (1.0 + k))


@usual
@given(polygons(), fields(0, 2), st.data())
def test_areas_cut_nodes_off(area: object, field: RiskField, data: st.DataObject) -> None:
    graph = GeometricGraph.complete(Lattice(5, bounds=(0, 0, 4, 4)), field, 3.0, no_fly=area)  # type: ignore[arg-type]
    weights = graph.weight_matrix()
    check_every_schedule(graph, weights, data.draw(st.integers(0, graph.n_nodes - 1)))


@usual
@given(networks())
def test_any_networkx_graph_agrees_with_networkx(graph: "nx.Graph[object]") -> None:
    mine = GeometricGraph.from_networkx(graph)
    heavy = [
        edge[: 3 if graph.is_multigraph() else 2] for edge in graph.edges if math.isinf(graph.edges[edge]["weight"])
    ]
    finite = graph.copy()
    finite.remove_edges_from(heavy)
    backwards = finite.reverse() if finite.is_directed() else finite
    for target in graph:
        expected = nx.single_source_dijkstra_path_length(backwards, target)
        matrix = cost_matrix(mine, target)
        assert {v: matrix.value(v) for v in graph if math.isfinite(matrix.value(v))} == pytest.approx(expected)


@fast
@given(cases())
def test_label_setting_takes_at_most_n_rounds(case: Case) -> None:
    graph, weights, target = case
    matrix = cost_matrix(graph, target)
    reached = np.isfinite(least_costs(weights, target))
    assert matrix.rounds == len(matrix.order) == reached.sum() <= graph.n_nodes
    assert sorted(matrix.order.tolist()) == np.nonzero(reached)[0].tolist()
    assert (np.diff(matrix.values[matrix.order]) >= 0.0).all()


@usual
@given(cases())
def test_the_last_pivot_is_not_needed(case: Case) -> None:
    graph, weights, target = case
    order = cost_matrix(graph, target).order.tolist()
    close(given_order(graph, target, order[:-1] or [target]).values, least_costs(weights, target))


@fast
@given(cases(), st.data())
def test_a_given_order_that_says_converged_is_a_fixed_point(case: Case, data: st.DataObject) -> None:
    graph, weights, target = case
    order = data.draw(pivots(graph.n_nodes))
    matrix = given_order(graph, target, order)
    assert matrix.order.tolist() == order[: matrix.rounds]
    if matrix.converged:
        assert matrix.residual() == 0.0
        close(matrix.values, least_costs(weights, target))
        # its rounds are just enough
        assert given_order(graph, target, order[: matrix.rounds]).converged
        assert not given_order(graph, target, order[: matrix.rounds - 1]).converged
    elif matrix.residual() > 0.0:
        assert matrix.rounds == len(order)


@usual
@given(cases(weight_matrices(edge=1.0)))
def test_symmetric_weights_cost_the_same_there_and_back(case: Case) -> None:
    _, weights, target = case
    graph = GeometricGraph.from_matrix(np.maximum(weights, weights.T))
    there = cost_matrix(graph, target).values
    back = [cost_matrix(graph, source).value(target) for source in range(graph.n_nodes)]
    close(there, np.array(back))


@fast
@given(cases(st.one_of(weight_matrices(), whole_weights(0))), st.data())
def test_descent_never_runs_in_a_circle_even_before_convergence(case: Case, data: st.DataObject) -> None:
    graph, weights, target = case
    matrix = given_order(graph, target, data.draw(pivots(graph.n_nodes)))
    for node in range(graph.n_nodes):
        path = walk(matrix, node)
        assert bool(path) == bool(np.isfinite(matrix.values[node]))
        if path:
            assert len(set(path)) == len(path)
            assert path[-1] == target
            # values further on may have fallen since
            assert path_cost(weights, path) <= matrix.values[node] * (1.0 + 1e-12)

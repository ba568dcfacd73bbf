"""
CGLA's cost matrix: Lemma 1, Theorem 1 and what the paper says besides, over random weights.

Whole weights are used where a property speaks of ties, because their sums are exact. Every property has a case
where its assumption is broken, so that it is seen to fail.
"""

import itertools
import math

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from oracles import (
    apply_eq9,
    delta_rounds,
    least_costs,
    least_costs_networkx,
    least_hops,
    octile,
    optimal_paths,
    path_cost,
)
from strategies import (
    crowds,
    fast,
    few,
    fields,
    lattices,
    networks,
    off_lattice_points,
    pivots,
    points,
    polygons,
    risk_weights,
    threats,
    usual,
    weight_matrices,
    whole_weights,
)

from cgla_graph._types import Bounds, FloatArray, IntArray, Point
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, Schedule, cost_matrix
from cgla_graph.errors import GraphError, NodeNotFoundError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.model.weights import DenseWeights

UNIT: Bounds = (0.0, 0.0, 1.0, 1.0)


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


# Theorem 1 (1): every schedule converges to the least costs, in finitely many rounds


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


# Lemma 1, the invariants, and Theorem 1 (2)


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


@fast
@given(cases())
def test_the_first_round_gives_the_weights_to_the_target(case: Case) -> None:
    graph, weights, target = case
    assert (given_order(graph, target, [target]).values == weights[:, target]).all()


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


def test_negative_weights_freeze_wrong_values() -> None:
    # Node 1 is settled at 1; the way over node 2 would cost 2 - 5.
    weights = np.array([[0, 9, 9], [1, 0, -5], [2, 9, 0]], dtype=float)
    graph = unchecked(weights)
    assert cost_matrix(graph, 0).value(1) == 1.0
    assert cost_matrix(graph, 0).residual() > 0.0
    synchronous = cost_matrix(graph, 0, schedule="synchronous")
    assert synchronous.value(1) == -3.0
    assert synchronous.converged


# The sets Delta_k (Eqs 10-12)


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


def test_a_weighed_graph_has_the_same_delta_sets() -> None:
    graph = GeometricGraph.complete(Lattice(20, bounds=UNIT))
    matrix = cost_matrix(graph, 210)
    weighed = cost_matrix(graph.with_weights_held(), 210)
    assert (weighed.values == matrix.values).all()
    assert [delta.tolist() for delta in weighed.delta_sets] == [delta.tolist() for delta in matrix.delta_sets]
    assert all(node in delta for node, delta in zip(matrix.order.tolist(), matrix.delta_sets, strict=True))
    assert matrix.residual() == 0.0


def test_before_the_source_enters_delta_its_value_may_be_wrong() -> None:
    graph = GeometricGraph.from_matrix([[0, 9, 1], [9, 0, 1], [1, 1, 0]])
    assert cost_matrix(graph, 0).delta_sets[2].tolist() == [1]
    assert given_order(graph, 0, [0]).value(1) == 9.0
    assert cost_matrix(graph, 0, source=1).value(1) == 2.0


# Remark 1 (C16): ties in Delta have nothing to do with ties of paths


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


# Schedules: how many rounds (C11)


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


# Greedy descent (C15)


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


def test_negative_weights_run_in_a_circle() -> None:
    # C13: each round makes the pair cheaper, without end.
    weights = np.array([[0, 9, 9], [1, 0, -2], [9, -2, 0]], dtype=float)
    graph = unchecked(weights)
    synchronous = cost_matrix(graph, 0, schedule="synchronous")
    assert not synchronous.converged
    assert synchronous.residual() > 0.0
    with pytest.raises(GraphError, match=r"cycle.*negative weights"):
        synchronous.path_from(1)
    few, many = sweeps(graph, 0, 5), sweeps(graph, 0, 50)
    assert many.value(1) < few.value(1) < 0.0


def test_eq1_as_printed_breaks_theorem_1() -> None:
    # C5: two overlapping threats that peak above 1 make weights negative.
    near = [Threat.from_eq1(x, 0.5, 0.05, reading="literal") for x in (0.5, 0.55)]
    with pytest.warns(ImproperFieldWarning):
        field = RiskField(near, improper=True)
    graph = GeometricGraph.complete(Lattice(5, bounds=UNIT), field, k=10.0)
    assert graph.weight_matrix().min() < 0.0
    settled = cost_matrix(graph, 0)
    assert settled.residual() > 0.0
    assert not settled.converged
    assert not cost_matrix(graph, 0, schedule="synchronous").converged


# Small cases


def test_a_single_node() -> None:
    for graph in (GeometricGraph.from_matrix([[0.0]]), GeometricGraph.complete([(0.0, 0.0)])):
        for schedule in ("label-setting", "synchronous"):
            matrix = cost_matrix(graph, 0, schedule=schedule)
            assert matrix.values.tolist() == [0.0]
            assert matrix.path_from(0) == [0]
            assert matrix.converged
        assert cost_matrix(graph, 0).delta_sets[0].tolist() == [0]


@usual
@given(cases())
def test_the_source_may_be_the_target(case: Case) -> None:
    graph, _, target = case
    matrix = cost_matrix(graph, target, source=target)
    assert (matrix.value(target), matrix.rounds) == (0.0, 0)
    assert matrix.path_from(target) == [target]


def test_a_node_that_is_cut_off_has_no_path() -> None:
    graph = GeometricGraph.from_matrix([[0, 1, np.inf], [1, 0, np.inf], [np.inf, np.inf, 0]], labels="abc")
    for source in (None, "c"):
        matrix = cost_matrix(graph, "a", source=source)
        assert matrix.path_from("c") == []
        assert matrix.value("c") == math.inf
        assert matrix.residual() == 0.0


def test_labels_are_spoken_everywhere() -> None:
    names = [("a", 1), "b", frozenset({2})]
    graph = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]], labels=names)
    matrix = cost_matrix(graph, names[2], source=names[0])
    assert matrix.path_from(names[0]) == names
    assert matrix.value(names[0]) == 2.0
    assert cost_matrix(graph, names[2], schedule="given", order=[names[2], names[1]]).value(names[0]) == 2.0


def test_answers_are_read_only() -> None:
    matrix = cost_matrix(GeometricGraph.from_matrix([[0, 1], [1, 0]]), 0)
    for array in (matrix.values, matrix.successors, matrix.order):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


@pytest.mark.parametrize("order", [[0, 1, 2], (0, 1, 2), range(3), iter([0, 1, 2])])
def test_an_order_is_any_iterable(order: list[int]) -> None:
    graph = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    assert cost_matrix(graph, 0, schedule="given", order=order).value(2) == 2.0


@pytest.mark.parametrize("order", [np.array([0, 1, 2]), np.array([0])])
def test_an_order_may_be_an_array_such_as_that_of_another_matrix(order: IntArray) -> None:
    graph = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    found = cost_matrix(graph, 0, schedule="given", order=order)
    assert (found.values == given_order(graph, 0, order.tolist()).values).all()


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"schedule": "greedy"}, "'greedy'; choose one of label-setting, synchronous, random, given"),
        ({"schedule": "random"}, "'random' needs a seed"),
        ({"schedule": "synchronous", "seed": 1}, "'synchronous' with seed=1"),
        ({"seed": -1}, "seed is -1; give a whole number"),
        ({"schedule": "given"}, "an order goes with 'given'"),
        ({"order": [0]}, "an order goes with 'given'"),
        ({"schedule": "synchronous", "order": []}, "an order goes with 'given'"),
        ({"schedule": "synchronous", "source": 0}, "cannot stop early at source 0"),
        ({"schedule": "given", "order": [0], "source": 1}, "cannot stop early at source 1"),
    ],
)
def test_settings_that_do_not_fit_are_refused(settings: dict[str, object], words: str) -> None:
    with pytest.raises(GraphError, match=words):
        cost_matrix(GeometricGraph.from_matrix([[0, 1], [1, 0]]), 0, **settings)  # type: ignore[arg-type]


def test_nodes_that_are_not_there_are_named() -> None:
    graph = GeometricGraph.from_matrix([[0, 1], [1, 0]], labels="ab")
    with pytest.raises(NodeNotFoundError, match="'c'"):
        cost_matrix(graph, "c")
    with pytest.raises(NodeNotFoundError, match="'c'"):
        cost_matrix(graph, "a", source="c")
    with pytest.raises(NodeNotFoundError, match="0"):
        cost_matrix(graph, "a", schedule="given", order=[0])
    with pytest.raises(NodeNotFoundError, match="'c'"):
        cost_matrix(graph, "a").path_from("c")
    with pytest.raises(NodeNotFoundError, match="'c'"):
        cost_matrix(graph, "a").value("c")


@pytest.mark.parametrize("schedule", ["synchronous", "given"])
def test_other_schedules_have_no_delta_sets(schedule: Schedule) -> None:
    order = [0] if schedule == "given" else None
    matrix = cost_matrix(GeometricGraph.from_matrix([[0, 1], [1, 0]]), 0, schedule=schedule, order=order)
    with pytest.raises(GraphError, match=f"the {schedule} schedule has no Delta sets"):
        _ = matrix.delta_sets


# Lattices: what more nodes, more edges, more threats and more k do


@usual
@given(cases(weight_matrices(edge=1.0)))
def test_symmetric_weights_cost_the_same_there_and_back(case: Case) -> None:
    _, weights, target = case
    graph = GeometricGraph.from_matrix(np.maximum(weights, weights.T))
    there = cost_matrix(graph, target).values
    back = [cost_matrix(graph, source).value(target) for source in range(graph.n_nodes)]
    close(there, np.array(back))


def test_a_one_way_street_costs_more_one_way() -> None:
    graph = GeometricGraph.from_matrix([[0, 1], [5, 0]])
    assert (cost_matrix(graph, 1).value(0), cost_matrix(graph, 0).value(1)) == (1.0, 5.0)


@usual
@given(lattices(max_side=5, unit=True), crowds(20), risk_weights, off_lattice_points(2))
def test_complete_costs_at_most_as_much_as_eight_connected(
    lattice: Lattice, field: RiskField, k: float, extra: list[Point]
) -> None:
    graphs = [
        make(lattice, field, k, extra=extra).with_weights_held()
        for make in (GeometricGraph.complete, GeometricGraph.eight_connected)
    ]
    complete, eight = (cost_matrix(graph, graph.n_nodes - 1).values for graph in graphs)
    assert (complete <= eight + 1e-10 * (1.0 + k)).all()


@usual
@given(st.integers(2, 6), st.data())
def test_eight_directions_cost_the_octile_distance(n: int, data: st.DataObject) -> None:
    lattice = Lattice(n, bounds=(0, 0, n - 1, n - 1))
    target = data.draw(st.integers(0, lattice.n_points - 1))
    straight = cost_matrix(GeometricGraph.complete(lattice), target).values
    eight = cost_matrix(GeometricGraph.eight_connected(lattice), target).values
    steps = [(i % n - target % n, i // n - target // n) for i in range(lattice.n_points)]
    np.testing.assert_allclose(straight, [math.hypot(*step) for step in steps], rtol=1e-12)
    np.testing.assert_allclose(eight, [octile(step) for step in steps], rtol=1e-12)
    assert (straight <= eight * (1.0 + 1e-12)).all()
    assert (eight <= straight / math.cos(math.pi / 8) * (1.0 + 1e-12)).all()


def solve(problem: Problem, n: int) -> tuple[float, float, float]:
    """Return cost, length and risk of the optimum on a closed lattice of n points a side."""
    on_graph = problem.on_lattice(n).with_weights_held()
    matrix = cost_matrix(on_graph.graph, on_graph.target, source=on_graph.source)
    assert on_graph.graph.positions is not None
    found = problem.evaluate(on_graph.graph.positions[np.array(matrix.path_from(on_graph.source), dtype=np.int64)])
    assert found.cost == pytest.approx(matrix.value(on_graph.source), rel=1e-9, abs=1e-9)
    return found.cost, found.length, found.risk


# Start and goal are corners: nodes of every closed lattice.
corners = st.sampled_from([(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])


@usual
@given(crowds(12), risk_weights, st.integers(2, 5), corners, corners)
def test_a_nested_lattice_never_costs_more(field: RiskField, k: float, n: int, start: Point, goal: Point) -> None:
    problem = Problem(start, goal, field, k)
    assert solve(problem, 2 * n - 1)[0] <= solve(problem, n)[0] + 1e-10 * (1.0 + k)


def test_a_lattice_that_is_not_nested_may_cost_more() -> None:
    # Above the peak of the hill lies a node of 3 and of 5 points a side, but none of 4.
    hill = shapely.Polygon([(0.3, -1.0), (0.7, -1.0), (0.5, 0.99)])
    problem = Problem((0.0, 0.0), (1.0, 0.0), no_fly=hill)
    of_3, of_4, of_5 = (solve(problem, n)[0] for n in (3, 4, 5))
    assert of_5 <= of_3 < of_4 - 0.1


@usual
@given(fields(0, 8), threats(), risk_weights, points, points)
def test_one_more_threat_never_lowers_the_optimum(
    field: RiskField, more: Threat, k: float, start: Point, goal: Point
) -> None:
    assume(max(abs(start[0] - goal[0]), abs(start[1] - goal[1])) > 1e-8)
    before = solve(Problem(start, goal, field, k), 5)[0]
    after = solve(Problem(start, goal, field.with_threats([more]), k), 5)[0]
    assert after >= before - 1e-10 * (1.0 + k)


def test_one_more_improper_threat_may_lower_the_optimum() -> None:
    high = [Threat(0.5, 0.5, spread=0.2, peak=3.0)] * 2
    costs = []
    for n in (1, 2):
        with pytest.warns(ImproperFieldWarning):
            field = RiskField(high[:n], improper=True)
        graph = GeometricGraph.complete([(0.4, 0.5), (0.6, 0.5)], field, 1.0)
        costs.append(graph.weights_from(0)[1])
    assert costs[1] < costs[0]


@few
@given(crowds(12), st.lists(st.integers(0, 200), min_size=2, max_size=5, unique=True), corners, corners)
def test_more_k_never_raises_the_risk_nor_shortens_the_path(
    field: RiskField, ks: list[int], start: Point, goal: Point
) -> None:
    # The exchange argument; equal costs within 1e-9 may be exchanged, and steps of k are at least 1.
    found = [solve(Problem(start, goal, field, float(k)), 6) for k in sorted(ks)]
    for k, (less, more) in zip(sorted(ks), itertools.pairwise(found), strict=False):
        assert more[0] >= less[0] - 1e-9
        assert more[2] <= less[2] + 1e-9
        assert more[1] >= less[1] - 1e-9 * (1.0 + k)


def test_a_bare_matrix_is_refused_with_the_remedy() -> None:
    with pytest.raises(GraphError, match="from_matrix"):
        cost_matrix(np.ones((3, 3)), target=0)  # type: ignore[arg-type]

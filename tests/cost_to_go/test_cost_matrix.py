"""
CGLA's cost matrix: Lemma 1, Theorem 1 and what the paper says besides, over random weights.

Whole weights are used where a property speaks of ties, because their sums are exact. Every property has a case
where its assumption is broken, so that it is seen to fail.
"""

import itertools
import math
from collections.abc import Callable
from typing import Any

import networkx as nx
import numpy as np
import oracles
import pytest
import shapely
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import fast, few, usual

from cgla_graph._types import Bounds, FloatArray, Point
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
    matrix = draw(strategies.weight_matrices() if weights is None else weights)
    graph = GeometricGraph.from_matrix(matrix)
    if draw(st.booleans()):
        graph = GeometricGraph.from_sparse(graph.to_csgraph(), directed=graph.directed)
    return graph, matrix, draw(st.integers(0, len(matrix) - 1))


Case = tuple[GeometricGraph, FloatArray, int]


# Theorem 1 (1): every schedule converges to the least costs, in finitely many rounds


def check_every_schedule(graph: GeometricGraph, weights: FloatArray, target: int) -> None:
    expected = oracles.least_costs(weights, target)
    close(oracles.least_costs_networkx(weights, target), expected)
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
                assert oracles.path_cost(weights, path) == pytest.approx(expected[node], rel=1e-12)


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
@given(
    cases(
        st.one_of(
            strategies.weight_matrices(),
            strategies.weight_matrices(max_nodes=30, edge=0.15),
            strategies.weight_matrices(elements=st.sampled_from([0.0, 0.0, 1.0, 2.0])),
        )
    )
)
def test_every_schedule_finds_the_least_costs(case: Case) -> None:
    """Of zero weights too, and infinity where a node cannot reach the target."""
    check_every_schedule(*case)


@usual
@given(
    strategies.lattices(unit=True, max_side=5),
    strategies.polygons(),
    strategies.fields(0, 4),
    strategies.risk_weights,
    strategies.off_lattice_points(),
    st.data(),
)
def test_lattices_with_threats_and_areas_find_the_least_costs(
    lattice: Lattice, area: shapely.MultiPolygon, field: RiskField, k: float, extra: list[Point], data: st.DataObject
) -> None:
    make = data.draw(st.sampled_from([GeometricGraph.eight_connected, GeometricGraph.complete]))
    area = shapely.affinity.scale(area, 0.25, 0.25, origin=(0.0, 0.0)) if data.draw(st.booleans()) else None
    graph = make(lattice, field, k, extra=extra, no_fly=area)
    target = data.draw(st.integers(0, graph.n_nodes - 1))
    implicit = cost_matrix(graph, target)
    weights = graph.weight_matrix()
    check_every_schedule(graph, weights, target)
    np.testing.assert_allclose(implicit.values, oracles.least_costs(weights, target), rtol=0.0, atol=1e-11 * (1.0 + k))


@fast
@given(cases())
def test_label_setting_takes_at_most_n_rounds(case: Case) -> None:
    graph, weights, target = case
    matrix, best = cost_matrix(graph, target), oracles.least_costs(weights, target)
    order = matrix.order.tolist()
    assert matrix.rounds == len(order) == np.isfinite(best).sum() <= graph.n_nodes
    assert sorted(order) == np.nonzero(np.isfinite(best))[0].tolist()
    assert (np.diff(matrix.values[matrix.order]) >= 0.0).all()
    # the last pivot is not needed
    close(given_order(graph, target, order[:-1] or [target]).values, best)


# Lemma 1, the invariants, and Theorem 1 (2)


@fast
@given(cases(), st.data())
def test_lemma_1_values_never_rise_and_never_fall_below_the_optimum(case: Case, data: st.DataObject) -> None:
    graph, weights, target = case
    order = data.draw(strategies.pivots(graph.n_nodes, 20))
    best = oracles.least_costs(weights, target)
    before = given_order(graph, target, []).values
    for end in range(len(order) + 1):
        matrix = given_order(graph, target, order[:end])
        assert (matrix.values <= before).all()
        assert (matrix.values >= best * (1.0 - 1e-12)).all()
        assert (matrix.values == oracles.apply_eq9(weights, target, order[:end])).all()
        before = matrix.values


@fast
@given(cases(), st.data())
def test_a_given_order_that_says_converged_is_a_fixed_point(case: Case, data: st.DataObject) -> None:
    graph, weights, target = case
    order = data.draw(strategies.pivots(graph.n_nodes))
    matrix = given_order(graph, target, order)
    assert matrix.order.tolist() == order[: matrix.rounds]
    if matrix.converged:
        assert matrix.residual() == 0.0
        close(matrix.values, oracles.least_costs(weights, target))
        # its rounds are just enough
        assert given_order(graph, target, order[: matrix.rounds]).converged
        assert not given_order(graph, target, order[: matrix.rounds - 1]).converged
    elif matrix.residual() > 0.0:
        assert matrix.rounds == len(order)


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
    _, frozen = oracles.delta_rounds(weights, 0, choose=max)
    assert frozen[2] == 9.0 > oracles.least_costs(weights, 0)[2]
    _, right = oracles.delta_rounds(weights, 0)
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
@given(cases(st.one_of(strategies.whole_weights(), strategies.whole_weights(0), strategies.weight_matrices())))
def test_delta_sets_are_those_of_eqs_10_to_12(case: Case) -> None:
    graph, weights, target = case
    matrix = cost_matrix(graph, target)
    expected, frozen = oracles.delta_rounds(weights, target)
    assert [set(delta.tolist()) for delta in matrix.delta_sets] == expected
    assert matrix.delta_sets[0].tolist() == [target] or (weights[:, target] == 0.0).any() or len(expected) == 1
    assert {i: matrix.values[i] for i in frozen} == frozen
    assert all(node in delta for node, delta in zip(matrix.order.tolist(), matrix.delta_sets, strict=True))
    assert all(node == delta.min() for node, delta in zip(matrix.order.tolist(), matrix.delta_sets, strict=True))


@fast
@given(cases(st.one_of(strategies.whole_weights(), strategies.whole_weights(0), strategies.weight_matrices())))
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
        assert oracles.path_cost(weights, path) == pytest.approx(full.values[source], rel=1e-12)
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


# Schedules: how many rounds (C11)


@fast
@given(cases(strategies.whole_weights()))
def test_synchronous_rounds_are_the_hops_of_the_longest_shortest_path(case: Case) -> None:
    graph, weights, target = case
    matrix = cost_matrix(graph, target, schedule="synchronous")
    hops = oracles.least_hops(weights, target)
    assert matrix.rounds == max(hops.values()) <= graph.n_nodes - 1
    for node, count in hops.items():
        assert len(matrix.path_from(node)) == count + 1


def test_a_chain_against_the_order_needs_a_sweep_for_each_hop() -> None:
    n = 8
    chain: nx.Graph[int] = nx.path_graph(n)
    nx.set_edge_attributes(chain, 1.0, "weight")
    graph = GeometricGraph.from_networkx(chain)
    assert not np.isfinite(sweeps(graph, n - 1, n - 2).values).all()
    assert np.isfinite(sweeps(graph, n - 1, n - 1).values).all()
    # along it, one sweep is enough, and as many rounds that use the values of the round before
    assert sweeps(graph, 0, 1).value(n - 1) == n - 1
    assert cost_matrix(graph, 0, schedule="synchronous").rounds == n - 1


# Greedy descent (C15)


@fast
@given(cases(st.one_of(strategies.weight_matrices(), strategies.whole_weights(0))), st.data())
def test_descent_never_runs_in_a_circle_even_before_convergence(case: Case, data: st.DataObject) -> None:
    graph, weights, target = case
    matrix = given_order(graph, target, data.draw(strategies.pivots(graph.n_nodes)))
    for node in range(graph.n_nodes):
        path = walk(matrix, node)
        assert bool(path) == bool(np.isfinite(matrix.values[node]))
        if path:
            assert len(set(path)) == len(path)
            assert path[-1] == target
            # values further on may have fallen since
            assert oracles.path_cost(weights, path) <= matrix.values[node] * (1.0 + 1e-12)


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


@pytest.mark.parametrize("make", [list, tuple, iter, np.array])
@pytest.mark.parametrize("pivots", [[0, 1, 2], [0]])
def test_an_order_is_any_iterable(make: Callable[[list[int]], list[int]], pivots: list[int]) -> None:
    graph = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    assert given_order(graph, 0, make(pivots)).value(2) == (2.0 if len(pivots) > 1 else 9.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"schedule": "greedy"}, "'greedy'; choose one of label-setting, synchronous, random, given"),
        ({"schedule": "random"}, "'random' needs a seed"),
        ({"schedule": "synchronous", "seed": 1}, "'synchronous' with seed=1"),
        ({"seed": -1}, "seed is -1; give a whole number"),
        ({"schedule": "given"}, "an order goes with 'given'"),
        ({"order": ["a"]}, "an order goes with 'given'"),
        ({"schedule": "synchronous", "order": []}, "an order goes with 'given'"),
        ({"schedule": "synchronous", "source": "a"}, "cannot stop early at source 'a'"),
        ({"schedule": "given", "order": ["a"], "source": "b"}, "cannot stop early at source 'b'"),
        ({"graph": np.ones((3, 3))}, "from_matrix"),
        ({"target": "c"}, "'c'"),
        ({"source": "c"}, "'c'"),
        ({"schedule": "given", "order": [0]}, "0"),
    ],
)
def test_settings_that_do_not_fit_are_refused(settings: dict[str, Any], words: str) -> None:
    graph = GeometricGraph.from_matrix([[0, 1], [1, 0]], labels="ab")
    with pytest.raises((GraphError, NodeNotFoundError), match=words):
        cost_matrix(**{"graph": graph, "target": "a", **settings})
    for ask in (cost_matrix(graph, "a").path_from, cost_matrix(graph, "a").value):
        with pytest.raises(NodeNotFoundError, match="'c'"):
            ask("c")
    for matrix in (cost_matrix(graph, "a", schedule="synchronous"), given_order(graph, "a", ["a"])):
        with pytest.raises(GraphError, match=f"the {matrix.schedule} schedule has no Delta sets"):
            _ = matrix.delta_sets


# Lattices: what more nodes, more edges, more threats and more k do


@usual
@given(st.integers(2, 6), st.data())
def test_eight_directions_cost_the_octile_distance(n: int, data: st.DataObject) -> None:
    lattice = Lattice(n, bounds=(0, 0, n - 1, n - 1))
    target = data.draw(st.integers(0, lattice.n_points - 1))
    straight = cost_matrix(GeometricGraph.complete(lattice), target).values
    eight = cost_matrix(GeometricGraph.eight_connected(lattice), target).values
    steps = [(i % n - target % n, i // n - target // n) for i in range(lattice.n_points)]
    np.testing.assert_allclose(straight, [math.hypot(*step) for step in steps], rtol=1e-12)
    np.testing.assert_allclose(eight, [oracles.octile(step) for step in steps], rtol=1e-12)
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


@few
@given(strategies.crowds(12), st.lists(st.integers(0, 200), min_size=2, max_size=5, unique=True), corners, corners)
def test_more_k_never_raises_the_risk_nor_shortens_the_path(
    field: RiskField, ks: list[int], start: Point, goal: Point
) -> None:
    # The exchange argument; equal costs within 1e-9 may be exchanged, and steps of k are at least 1.
    found = [solve(Problem(start, goal, field, float(k)), 6) for k in sorted(ks)]
    for k, (less, more) in zip(sorted(ks), itertools.pairwise(found), strict=False):
        assert more[0] >= less[0] - 1e-9
        assert more[2] <= less[2] + 1e-9
        assert more[1] >= less[1] - 1e-9 * (1.0 + k)

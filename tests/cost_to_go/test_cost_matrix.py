"""CGLA's cost matrix: small cases, refusals, and what more nodes, edges, threats and k do to the least costs."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from oracles import (
    octile,
)
from strategies import few, off_lattice_points, usual
from theorem_cases import given_order

from cgla_graph._types import IntArray, Point
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.errors import GraphError, NodeNotFoundError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.testing.strategies import (
    crowds,
    fields,
    lattices,
    points,
    risk_weights,
    threats,
)


def test_a_single_node() -> None:
    for graph in (GeometricGraph.from_matrix([[0.0]]), GeometricGraph.complete([(0.0, 0.0)])):
        for schedule in ("label-setting", "synchronous"):
            matrix = cost_matrix(graph, 0, schedule=schedule)
            assert matrix.values.tolist() == [0.0]
            assert matrix.path_from(0) == [0]
            assert matrix.converged
        assert cost_matrix(graph, 0).delta_sets[0].tolist() == [0]


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


#: Start and goal are corners: nodes of every closed lattice.
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

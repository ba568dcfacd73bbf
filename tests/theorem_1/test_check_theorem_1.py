"""Lemma 1 and Theorem 1 checked on graphs: they hold on good ones, and each part fails with a witness on others."""

import dataclasses
from collections.abc import Hashable, Iterator
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse
from strategies import usual

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.cost_to_go import theorem_1
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.cost_to_go.theorem_1 import Statement, TheoremCheck, check_theorem_1
from cgla_graph.errors import GraphError, NodeNotFoundError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.weights import SparseWeights
from cgla_graph.testing.strategies import networks, weight_matrices, whole_weights

CHAIN = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]], labels="abc")


def by_name(checked: TheoremCheck) -> dict[str, Statement]:
    return {one.name.partition(":")[0]: one for one in checked.statements}


def failed(checked: TheoremCheck) -> dict[str, Statement]:
    return {name: one for name, one in by_name(checked).items() if one.needed and one.holds is False}


def below_zero(weights: list[list[float]], labels: str) -> GeometricGraph:
    rows = sparse.csr_array(np.array(weights))
    return GeometricGraph(list(labels), directed=True, weights=SparseWeights(rows))


@usual
@given(
    weights=st.one_of(weight_matrices(max_nodes=8), whole_weights(0), whole_weights(1)),
    drawn=st.tuples(st.integers(0, 7), st.integers(0, 7)),
    named=st.booleans(),
)
def test_theorem_1_holds_on_any_graph_of_such_weights(weights: FloatArray, drawn: tuple[int, int], named: bool) -> None:
    n = len(weights)
    target, source = (node % n for node in drawn)
    graph = GeometricGraph.from_matrix(weights)

    checked = check_theorem_1(graph, target, source if named else None)
    holds = {name: one.holds for name, one in by_name(checked).items()}

    ways = graph.to_networkx()
    least = nx.single_source_dijkstra_path_length(ways.reverse() if graph.directed else ways, target)
    assert holds["weights at least 0"]
    assert holds["symmetric"] == np.array_equal(weights, weights.T)
    assert holds["every node reaches the target"] == (len(least) == n)
    every = weights
    for _ in range(n + 1):
        every = np.minimum(every, np.min(every[:, :, None] + every[None, :, :], axis=1))
    edges = np.isfinite(weights)
    assert holds["triangle inequality"] == bool((weights[edges] <= every[edges] * (1 + 1e-9)).all())
    assert holds["Lemma 1"]
    assert holds["Theorem 1 (1)"]
    assert holds["Theorem 1 (2)"]
    assert holds["Theorem 1 (3)"] == (not named or source in least)
    assert all((one.holds is False) == bool(one.witness) for one in checked.statements)
    matrix = cost_matrix(graph, target)
    assert list(checked.delta_sizes) == [len(delta) for delta in matrix.delta_sets]
    if named and source in least:
        first = next(k for k, delta in enumerate(matrix.delta_sets, start=1) if source in delta)
        assert f"in round {first:,} of {matrix.rounds:,}" in by_name(checked)["Theorem 1 (3)"].says


@usual
@given(graph=networks())
def test_any_labels_will_do(graph: "nx.Graph[Hashable]") -> None:
    ours = GeometricGraph.from_networkx(graph)
    for node in graph:
        checked = check_theorem_1(ours, node)
        assert checked.target == node
        assert failed(checked).keys() <= {"every node reaches the target"}
        assert all("\n" not in one.says for one in checked.statements)


def test_edges_that_are_not_as_assumed_are_named() -> None:
    """The witness is the very edge, or a node that cannot reach the target."""
    graph = GeometricGraph.from_matrix(
        [[0, 1, 9, np.inf], [1, 0, 1, np.inf], [9, 1, 0, np.inf], [2, np.inf, np.inf, 0]], labels="abcd"
    )
    found = by_name(check_theorem_1(graph, "d"))
    assert found["symmetric"].witness == ("d", "a")
    assert found["triangle inequality"].witness == ("a", "c")
    assert found["every node reaches the target"].witness == ("a",)
    assert not check_theorem_1(graph, "d").all_hold
    assert check_theorem_1(CHAIN, "c").all_hold
    assert "a → c has weight 9, another way 2 (not needed)" in str(check_theorem_1(CHAIN, "c"))


def test_with_weights_below_0_parts_fail_and_say_where() -> None:
    """From b to the target costs 1, by way of c -3: b has served before c lowers it."""
    graph = below_zero([[0, 1, 0, 0], [0, 0, -5, 1], [0, 0, 0, 2], [0, 0, 0, 0]], "abct")
    checked = check_theorem_1(graph, "t")
    found = failed(checked)
    assert found.keys() == {"weights at least 0", "Theorem 1 (1)", "Theorem 1 (2)", "Theorem 1 (3)"}
    assert found["weights at least 0"].witness == ("b", "c")
    assert (found["Theorem 1 (2)"].witness, found["Theorem 1 (2)"].round) == (("b",), 4)
    assert found["Theorem 1 (1)"].witness[0] in {"a", "b"}
    assert found["Theorem 1 (3)"].witness == ("b",)
    assert by_name(checked)["Lemma 1"].holds
    assert by_name(check_theorem_1(graph, "t", "b"))["Theorem 1 (3)"].holds is False
    assert checked.matrix is not None
    assert not checked.matrix.converged
    # a circle that costs less than nothing has no least costs: Eq. 9 lowers one of its ends again
    circle = failed(check_theorem_1(below_zero([[0, 1, 0], [-2, 0, 1], [0, 0, 0]], "abt"), "t"))
    assert "a cycle costs less than 0" in circle["Theorem 1 (1)"].says
    assert set(circle["Theorem 1 (1)"].witness) == {"a", "b"}
    # without a circle, and settled in the right order, all but the assumption holds
    line = check_theorem_1(below_zero([[0, -1], [0, 0]], "at"), "t")
    assert failed(line).keys() == {"weights at least 0"}


def test_an_improper_field_is_checked() -> None:
    """Two peaks of 3 that overlap make F negative."""
    with pytest.warns(UserWarning, match="peak"):
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.2, 3.0), cg.Threat(0.5, 0.5, 0.2, 3.0)], improper=True)
    graph = GeometricGraph.complete([(0.0, 0.0), (0.5, 0.5), (1.0, 1.0), (0.5, 0.4)], field, k=10.0)
    assert graph.has_negative_weights
    assert {"weights at least 0", "Theorem 1 (1)"} <= failed(check_theorem_1(graph, 0)).keys()


@pytest.mark.parametrize(
    ("changes", "source", "name", "witness", "number"),
    [
        ({"order": [2, 0, 1]}, None, "Theorem 1 (2)", ("a",), 3),
        ({"order": [2, 0, 1]}, None, "Theorem 1 (3)", ("a",), 0),
        ({"order": [2, 0, 1]}, "a", "Theorem 1 (3)", ("a",), 0),
        ({"values": [2.0, 1.5, 0.0]}, None, "Theorem 1 (1)", ("b",), 0),
        ({"values": [np.inf, 1.0, 0.0]}, None, "Theorem 1 (1)", ("a",), 0),
        ({"order": [2, 1], "rounds": 2}, None, "Theorem 1 (1)", (), 0),
    ],
)
def test_a_wrong_cost_matrix_is_seen(
    changes: dict[str, Any], source: str | None, name: str, witness: tuple[str, ...], number: int
) -> None:
    wrong = {key: np.array(value) if isinstance(value, list) else value for key, value in changes.items()}
    matrix = dataclasses.replace(cost_matrix(CHAIN, "c"), **wrong)
    found = failed(check_theorem_1(CHAIN, "c", source, matrix=matrix))
    assert (found[name].witness, found[name].round) == (witness, number)


def test_rounds_that_raise_a_value_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    eq_9 = theorem_1.eq_9

    def forgetful(weights: FloatArray, target: int, pivots: list[int]) -> Iterator[FloatArray]:
        for number, values in enumerate(eq_9(weights, target, pivots)):
            yield values + number

    monkeypatch.setattr(theorem_1, "eq_9", forgetful)
    found = failed(check_theorem_1(CHAIN, "c"))
    assert (found["Lemma 1"].witness, found["Lemma 1"].round) == (("c",), 1)
    assert found["Theorem 1 (3)"].holds is False


def test_larger_graphs_are_checked_as_far_as_that_goes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(theorem_1, "MOST_STEPPED", 2)
    half = check_theorem_1(CHAIN, "c", "a")
    assert [one.holds for one in half.statements[4:]] == [None, True, None, True]
    assert "a in round 3 of 3" in half.statements[-1].says
    assert check_theorem_1(CHAIN, "c").statements[-1].holds is None
    monkeypatch.setattr(theorem_1, "MOST_SETTLED", 2)
    none = check_theorem_1(CHAIN, "c", "a")
    assert [one.holds for one in none.statements[4:]] == [None] * 4
    assert none.all_hold
    monkeypatch.setattr(theorem_1, "MOST_BELOW_ZERO", 1)
    assert "below 0" in check_theorem_1(below_zero([[0, -1], [0, 0]], "at"), "t").statements[-1].says
    monkeypatch.setattr(theorem_1, "MOST_SEARCHED", 1)
    many = check_theorem_1(GeometricGraph.from_matrix(np.full((30, 30), 1.0)), 0)
    assert "of the edges from 20 nodes, drawn at random" in many.statements[3].says


def test_what_cannot_be_checked_is_refused() -> None:
    with pytest.raises(GraphError, match="from_networkx"):
        check_theorem_1(nx.path_graph(3), 0)  # type: ignore[arg-type]
    for ends in (("x",), ("a", "x")):
        with pytest.raises(NodeNotFoundError):
            check_theorem_1(CHAIN, *ends)
    for matrix in (cost_matrix(CHAIN, "a"), cost_matrix(CHAIN, "c", schedule="synchronous")):
        with pytest.raises(GraphError, match="matrix"):
            check_theorem_1(CHAIN, "c", matrix=matrix)

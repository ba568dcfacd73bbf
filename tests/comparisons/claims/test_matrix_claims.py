"""The claims about the cost matrix: their answers, and that a broken matrix, graph or flight ends the check."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Answer, Finding
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.panel.settings import KINDS
from cgla_graph.comparisons.claims.paper import matrix_claims, path_claims
from cgla_graph.comparisons.claims.paper.random_graphs import least_costs, random_graph
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.cost_to_go.theorem_1 import eq_9
from cgla_graph.model.graph import GeometricGraph

QUICK = Evidence(Scale(quick=True))
CHECKS = {claim.id: claim.check for claim in catalogue.claims().values()}


@pytest.fixture(autouse=True)
def _few_kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take maps of one kind where a check goes through all kinds."""
    for module in (matrix_claims, path_claims):
        monkeypatch.setattr(module, "KINDS", KINDS[:1])


def _answers(found: Finding) -> dict[str, str]:
    return {row.statement: row.answer.label for row in found.rows}


@pytest.mark.parametrize(
    ("claim", "expected"),
    [
        (
            "C8",
            {
                "G never rises": "holds",
                "G is at least the least cost": "holds",
                "the first round gives A(., p_t)": "holds",
            },
        ),
        ("C11", {"G converges, and settled values stay": "depends", "the printed proof is complete": "fails"}),
        ("C12", {"p_s comes into Delta_k, at its least cost": "holds"}),
        ("C13", {"weights must not be below 0": "holds", "weights must not be 0": "depends"}),
        ("C24", {"it cannot be used directly": "depends", "it is exhaustive": "depends"}),
        ("C14", {"no path has a lower J": "depends"}),
        ("C15", {"the walk along least A + G arrives": "holds"}),
        ("C16", {"a tie in Delta_k means several best paths": "fails"}),
    ],
)
def test_answers(claim: str, expected: dict[str, str]) -> None:
    found = CHECKS[claim](QUICK)
    assert _answers(found) == expected
    assert set(found.counterexamples) <= set(counterexamples.names())
    for row in found.rows:
        assert row.where or row.answer is not Answer.DEPENDS
        assert row.why


def test_the_numbers_of_merged_claims_stay() -> None:
    assert [claim.id for claim in catalogue.chosen(["C9", "C10"])] == ["C8"]


def test_dynamic_programming_flies_as_cgla_on_each_map_and_tick() -> None:
    # three flights on one map
    assert matrix_claims._flown_alike(QUICK) == "3 of 3"


def test_random_choices_of_pivots_need_many_times_as_many() -> None:
    size, wrong = matrix_claims._random_pivots(QUICK)
    least, _, greatest = size.removeprefix("random: ").split()[:3]
    assert 4.0 < float(least) <= float(greatest) < 40.0
    assert 0.4 < wrong < 1.0


def test_eq_9_is_the_least_of_old_and_new() -> None:
    weights = np.array([[0.0, 1.0, 9.0], [1.0, 0.0, 1.0], [9.0, 1.0, 0.0]])
    assert [values.tolist() for values in eq_9(weights, 2, [2, 1])] == [
        [np.inf, np.inf, 0.0],
        [9.0, 1.0, 0.0],
        [2.0, 1.0, 0.0],
    ]


def test_least_costs_are_those_of_all_paths() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        graph = random_graph(rng, most=6)
        target = int(rng.integers(graph.n_nodes))
        each = [min(path_claims._all_costs(graph.weight_matrix(), node, target)) for node in range(graph.n_nodes)]
        assert least_costs(graph, target) == pytest.approx(each, rel=1e-12)


def test_random_graphs_are_of_both_sorts() -> None:
    rng = np.random.default_rng(1)
    graphs = [random_graph(rng) for _ in range(40)]
    assert {graph.directed for graph in graphs} == {True, False}
    assert any(np.isinf(graph.weight_matrix()).any() for graph in graphs)
    assert all((graph.weight_matrix()[~np.eye(graph.n_nodes, dtype=bool)] > 0.0).all() for graph in graphs)


def _changed(change: Callable[[CostMatrix], Any]) -> Callable[..., CostMatrix]:
    """Compute a cost matrix, and change it."""

    def broken(*args: Any, **kwargs: Any) -> CostMatrix:  # noqa: ANN401 - as `cost_matrix`
        matrix = cost_matrix(*args, **kwargs)
        return dataclasses.replace(matrix, **change(matrix))

    return broken


@pytest.mark.parametrize(
    ("claim", "change", "message"),
    [
        ("C8", lambda matrix: {"values": matrix.values * (1.0 + 1e-6)}, "not the paper's"),
        ("C8", lambda matrix: {"order": matrix.order[::-1]}, "Delta_0"),
        ("C11", lambda matrix: {"values": matrix.values * (1.0 - 1e-9)}, "not scipy's Dijkstra"),
        ("C11", lambda matrix: {"order": matrix.order[::-1]}, "not in Delta_k"),
        ("C11", lambda matrix: {"rounds": matrix.rounds + 1}, "settled no node"),
        ("C12", lambda matrix: {"values": matrix.values * matrix.rounds}, "another value at the source"),
        ("C13", lambda matrix: {"values": matrix.values + 1e-9 * (matrix.values > 0)}, "n rounds are not enough"),
        ("C15", lambda matrix: {"successors": np.where(matrix.successors < 0, -1, 0)}, "cycle|elsewhere"),
        ("C24", lambda matrix: {"values": matrix.values + (matrix.schedule == "synchronous")}, "differ"),
    ],
)
def test_a_broken_matrix_ends_the_check(
    claim: str, change: Callable[[CostMatrix], Any], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (matrix_claims, path_claims):
        monkeypatch.setattr(module, "cost_matrix", _changed(change))
    monkeypatch.setattr(matrix_claims, "_flown_alike", lambda _: "")
    with pytest.raises((AssertionError, ValueError), match=message):
        CHECKS[claim](QUICK)


def test_an_early_stop_too_early_ends_the_check(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that stops when the source gets its first finite value, and not when it is in Delta_k."""

    def hasty(graph: GeometricGraph, target: int, source: int | None = None) -> CostMatrix:
        matrix = cost_matrix(graph, target)
        if source is None:
            return matrix
        values = next(values for values in matrix.history() if np.isfinite(values[source]))
        return dataclasses.replace(matrix, values=values)

    monkeypatch.setattr(matrix_claims, "cost_matrix", hasty)
    with pytest.raises((AssertionError, StopIteration), match="another value at the source"):
        CHECKS["C12"](QUICK)


@pytest.mark.parametrize(
    ("claim", "name", "edge", "weight", "message"),
    [
        ("C11", "theorem-1-proof.json", (0, 2), 30, "no value falls"),
        ("C11", "theorem-1-proof.json", (1, 2), 0.5, "round 2 of the stored graph changes a value"),
        ("C11", "theorem-1-proof.json", (3, 4), 50, "reaches t"),
        ("C13", "zero-weights.json", (0, 1), 0.5, "runs in no circle"),
        ("C15", "against-the-direction.json", (0, 1), 2.5, "runs in no circle"),
    ],
)
def test_a_stored_graph_that_shows_nothing_is_noticed(
    claim: str, name: str, edge: tuple[int, int], weight: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = counterexamples.document

    def changed(asked: str) -> dict[str, Any]:
        read = document(asked)
        if asked == name:
            read["weights"][edge[0]][edge[1]] = read["weights"][edge[1]][edge[0]] = weight
        return read

    monkeypatch.setattr(counterexamples, "document", changed)
    with pytest.raises(AssertionError, match=message):
        CHECKS[claim](Evidence(Scale(maps=1)))


@pytest.mark.parametrize(("claim", "name"), [("C11", matrix_claims.MAP), ("C13", "printed-peaks.toml")])
def test_a_stored_map_that_shows_nothing_is_noticed(claim: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without threats the straight line is best, so that no node is needed and no weight is below 0."""
    scenario = counterexamples.scenario

    def emptied(asked: str) -> Any:  # noqa: ANN401 - a scenario
        read = scenario(asked)
        assert asked == name
        return dataclasses.replace(read, problem=dataclasses.replace(read.problem, field=None))

    monkeypatch.setattr(counterexamples, "scenario", emptied)
    with pytest.raises(AssertionError, match=r"no value falls|G stops falling"):
        CHECKS[claim](Evidence(Scale(maps=1)))


def test_flights_that_differ_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    alike = matrix_claims._are_alike

    def moved(first: Any, second: Any) -> bool:  # noqa: ANN401 - flights
        return alike(first, dataclasses.replace(second, trace=second.trace + 1e-9))

    monkeypatch.setattr(matrix_claims, "_are_alike", moved)
    assert matrix_claims._flown_alike(QUICK) == "0 of 3"
    with pytest.raises(AssertionError, match="the stored flights differ"):
        CHECKS["C24"](QUICK)


@pytest.mark.parametrize(("factor", "message"), [(1.01, "below the least cost"), (-1.0, "is below 0")])
def test_a_least_cost_that_g_goes_below_is_noticed(
    factor: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(matrix_claims, "least_costs", lambda *given: least_costs(*given) * factor)
    with pytest.raises(AssertionError, match=message):
        CHECKS["C8"](QUICK)


def test_the_steps_of_the_proof_are_asserted() -> None:
    """A run that takes another p_r than one of Delta_k, on a graph on which that makes no other values."""
    chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 8], [9, 8, 0]])
    right = cost_matrix(chain, 2)
    matrix_claims._assert_proof(right, right.values)
    wrong = dataclasses.replace(right, order=np.array([2, 0, 1]))
    with pytest.raises(AssertionError, match="not in Delta_k"):
        matrix_claims._assert_proof(wrong, right.values)
    with pytest.raises(AssertionError, match="not at its least cost"):
        matrix_claims._assert_proof(right, right.values * 0.5)
    astray = dataclasses.replace(right, successors=np.array([2, 0, -1]))
    with pytest.raises(AssertionError, match="has not served"):
        matrix_claims._assert_proof(astray, right.values)

"""The claims about the cost matrix and the paths read off it: their verdicts, and that a broken matrix has none."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.paper import matrix_claims, path_claims
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.cost_to_go.theorem_1 import eq_9
from cgla_graph.model.graph import GeometricGraph

QUICK = Evidence(Scale(quick=True))
CHECKS = {claim.id: claim.check for claim in catalogue.claims().values()}


def test_the_optimum_is_that_of_the_lattice_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Evidence, "instances", lambda *_: 2)
    found = CHECKS["C14"](QUICK)
    assert found.headline == (
        "proved by the cost J, on the lattice, of what is known; refuted by the cost J, in the plane; "
        "refuted by length and risk, whatever K"
    )


@pytest.mark.slow
def test_dynamic_programming_flies_as_cgla_on_each_map_and_tick() -> None:
    rows = CHECKS["C24"](QUICK).tables[0].rows
    assert {(row[1], row[3]) for row in rows} == {("change", 1.0), ("tick", 1.0)}
    assert len(rows) == 4


@pytest.mark.slow
def test_random_choices_of_pivots_need_many_times_as_many() -> None:
    rows = CHECKS["C11"](QUICK).tables[1].rows
    assert [row[0] for row in rows] == [8, 10, 12, 15]
    for _, wrong, median, low, high, *_ in rows:
        assert isinstance(wrong, float)
        assert isinstance(median, float)
        assert wrong > 0.4
        assert 4.0 < low <= median <= high < 40.0


def _changed(change: Callable[[CostMatrix], Any]) -> Callable[..., CostMatrix]:
    """Compute a cost matrix, and change it."""

    def broken(*args: Any, **kwargs: Any) -> CostMatrix:  # noqa: ANN401 - as `cost_matrix`
        matrix = cost_matrix(*args, **kwargs)
        return dataclasses.replace(matrix, **change(matrix))

    return broken


@pytest.mark.slow
@pytest.mark.parametrize(
    ("claim", "change"),
    [
        ("C8", lambda matrix: {"values": matrix.values * (1.0 + 1e-6)}),
        ("C10", lambda matrix: {"order": matrix.order[::-1]}),
        ("C11", lambda matrix: {"values": matrix.values * (1.0 - 1e-9)}),
        ("C11", lambda matrix: {"order": matrix.order[::-1]}),
        ("C11", lambda matrix: {"rounds": matrix.rounds + 1}),
        ("C12", lambda matrix: {"values": matrix.values * matrix.rounds}),
        ("C13", lambda matrix: {"values": matrix.values + 1e-9 * (matrix.values > 0)}),
        ("C24", lambda matrix: {"values": matrix.values + (matrix.schedule == "synchronous")}),
    ],
)
def test_a_broken_matrix_has_no_verdict(
    claim: str, change: Callable[[CostMatrix], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (matrix_claims, path_claims):
        monkeypatch.setattr(module, "cost_matrix", _changed(change))
    with pytest.raises(AssertionError):
        CHECKS[claim](QUICK)


def test_graphs_that_show_nothing_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = counterexamples.graph
    other = {"remark-1-star.json": "remark-1-diamond.json", "remark-1-diamond.json": "remark-1-star.json"}
    monkeypatch.setattr(counterexamples, "graph", lambda name: graph(other.get(name, "remark-1-diamond.json")))
    with pytest.raises(AssertionError, match="the star has no Delta set of two"):
        CHECKS["C16"](QUICK)


@pytest.mark.parametrize(
    ("claim", "name", "edge", "weight", "message"),
    [
        ("C11", "pivot-left-out.json", (0, 2), 2, "does not need a"),
        ("C11", "theorem-1-proof.json", (0, 2), 30, "does not settle|does not fall"),
        ("C11", "theorem-1-proof.json", (0, 1), 7, "round 2 of the stored graph changes a value"),
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
        CHECKS[claim](Evidence(Scale(maps=2)))


def test_flights_that_differ_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    flown = matrix_claims.fly_alone_variants
    monkeypatch.setattr(
        matrix_claims,
        "fly_alone_variants",
        lambda file: {
            name: dataclasses.replace(flight, trace=flight.trace + (name == "Dijkstra") * 1e-3)
            for name, flight in flown(file).items()
        },
    )
    with pytest.raises(AssertionError, match="the stored flights differ"):
        CHECKS["C24"](QUICK)


def test_a_least_cost_that_g_goes_below_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    least = matrix_claims.least_costs
    monkeypatch.setattr(matrix_claims, "least_costs", lambda *given: least(*given) * 1.01)
    with pytest.raises(AssertionError, match="below the least cost"):
        CHECKS["C9"](QUICK)


def test_the_steps_of_the_proof_are_asserted() -> None:
    """A run that takes another p_r than one of Delta_k, on a graph on which that makes no other values."""
    chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 8], [9, 8, 0]])
    right = cost_matrix(chain, 2)
    matrix_claims._assert_proof(right, right.values)
    wrong = dataclasses.replace(right, order=np.array([2, 0, 1]))
    with pytest.raises(AssertionError, match="not in Delta_k"):
        matrix_claims._assert_proof(wrong, right.values)


def test_the_middle_of_three_paths_is_best_for_no_weight(monkeypatch: pytest.MonkeyPatch) -> None:
    document = counterexamples.document("unsupported-pair.json")
    assert path_claims._unsupported_is_missed()
    # with less risk on it, some weight asks for it
    document["risk"][0][2] = document["risk"][2][4] = 0.05
    monkeypatch.setattr(counterexamples, "document", lambda _: document)
    assert not path_claims._unsupported_is_missed()


def test_eq_9_is_the_least_of_old_and_new() -> None:
    weights = np.array([[0.0, 1.0, 9.0], [1.0, 0.0, 1.0], [9.0, 1.0, 0.0]])
    assert [values.tolist() for values in eq_9(weights, 2, [2, 1])] == [
        [np.inf, np.inf, 0.0],
        [9.0, 1.0, 0.0],
        [2.0, 1.0, 0.0],
    ]

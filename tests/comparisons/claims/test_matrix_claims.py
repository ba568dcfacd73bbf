"""The claims about the cost matrix: their answers, and that a broken matrix, graph or flight ends the check."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Answer
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.panel.settings import KINDS
from cgla_graph.comparisons.claims.paper import matrix_claims, path_claims
from cgla_graph.comparisons.claims.paper.random_graphs import least_costs
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix

QUICK = Evidence(Scale(quick=True))
CHECKS = {claim.id: claim.check for claim in catalogue.claims().values()}


@pytest.fixture(autouse=True)
def _few_kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take maps of one kind where a check goes through all kinds."""
    for module in (matrix_claims, path_claims):
        monkeypatch.setattr(module, "KINDS", KINDS[:1])


@pytest.mark.parametrize(
    ("claim", "expected"),
    [
        ("C8", "holds holds holds"),
        ("C11", "depends fails"),
        ("C12", "holds"),
        ("C13", "holds depends"),
        ("C24", "depends depends"),
        ("C14", "depends"),
        ("C15", "holds"),
        ("C16", "fails"),
    ],
)
def test_answers(claim: str, expected: str) -> None:
    found = CHECKS[claim](QUICK)
    assert " ".join(row.answer.label for row in found.rows) == expected
    assert set(found.counterexamples) <= set(counterexamples.names())
    for row in found.rows:
        assert row.where or row.answer is not Answer.DEPENDS
        assert row.why


def test_dynamic_programming_flies_as_cgla_on_each_map_and_tick() -> None:
    # three flights on one map
    assert matrix_claims._flown_alike(QUICK) == "3 of 3"


def test_random_choices_of_pivots_need_many_times_as_many() -> None:
    size, wrong = matrix_claims._random_pivots(QUICK)
    least, _, greatest = size.removeprefix("random: ").split()[:3]
    assert 4.0 < float(least) <= float(greatest) < 40.0
    assert 0.4 < wrong < 1.0


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

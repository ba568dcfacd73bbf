"""The checks of C20 to C23, C36 and C55: counters against plain ones, and broken programs that do not pass."""

import itertools
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from strategies import seeds, usual

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Answer, Finding, Row
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel import complexity
from cgla_graph.comparisons.claims.panel.settings import FACTORS, KINDS, seeds_of
from cgla_graph.comparisons.claims.paper import complexity_claims as claims
from cgla_graph.comparisons.claims.paper import direction_claims
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario


def levels(maps: int) -> list[dict[str, Any]]:
    """Return the levels of so many maps of each kind."""
    return [{**kind._asdict(), "map": seed} for kind in KINDS for seed in seeds_of(kind, 3, maps)]


@cache
def samples(maps: int) -> dict[str, Samples]:
    """Fabricate samples, with differences from map to map that are small beside those that are meant."""
    rng = np.random.default_rng(1)

    def near(value: float) -> float:
        return value * float(rng.uniform(0.99, 1.01))

    plans: list[Record] = []
    for one, k, n in itertools.product(levels(maps), FACTORS["k"], complexity.SIZES):
        few = k < 200.0
        found = {"rounds_over_n": near(n), "edges_over_n": 0.4 if few else 0.7, "below_half": few}
        share = {"weighed_share": near(0.01)} if n == 20 else {}
        plans.append({**one, "k": k, "n": n, "planner": "cgla", "sharpest": near(30.0), **found, **share})
        plans.append({**one, "k": k, "n": n, "planner": "eight-direction", "sharpest": 45.0})
    flights = [
        {**one, "radius": r, "k": k, "planning": word, "exponent": power, "off_middle": abs(power - 4.5)}
        for one, r, k in itertools.product(levels(maps), FACTORS["radius"], FACTORS["k"])
        for word, power in (("every move", near(4.8)), ("on change", near(3.8)))
    ]
    changes = [
        {**one, "k": k, "changed": near(0.4 if one["threats"] == 10 else 0.7), "crossed": 0.3}
        for one, k in itertools.product(levels(maps), FACTORS["k"])
    ]
    plain = [one for one in levels(maps) if one["threats"] == 10 and one["spread"] == "narrow"]
    passages = [
        {**one, "passage": passage, "n": n, "planner": planner, "found": planner == "cgla" or passage == "wide"}
        for one, passage, n in itertools.product(plain, ("wide", "passage 0.025"), complexity.SIZES)
        for planner in ("cgla", "eight-direction")
    ]
    tables = {"plans": plans, "flight-operations": flights, "new-threat": changes, "passages": passages}
    return {name: Samples(records) for name, records in tables.items()}


@cache
def full(claim: str) -> Finding:
    return check(claim, 40)


def check(claim: str, maps: int = 2) -> Finding:
    return catalogue.claims()[claim].check(Evidence(Scale(quick=True), samples(maps)))


@pytest.mark.parametrize(
    ("claim", "answers"),
    [
        ("C20", "depends, fails"),
        ("C21", "holds, fails, fails, depends"),
        ("C22", "holds, holds, fails"),
        ("C23", "holds, depends, holds"),
        ("C55", "depends, holds, holds"),
    ],
)
def test_rows_follow_the_samples(claim: str, answers: str) -> None:
    rows = full(claim).rows
    assert ", ".join(row.answer.label for row in rows) == answers
    assert all(row.size or row.answer is Answer.HOLDS for row in rows)


def row(claim: str, statement: str) -> Row:
    (found,) = [one for one in full(claim).rows if statement in one.statement]
    return found


def test_rows_name_where_a_statement_fails_and_how_large_it_is() -> None:
    assert "fails at" in row("C21", "0.5 N, as edges (bar set later)").where
    assert "fails at 30 threats" in row("C23", "half change").where
    assert row("C55", "plans are found").where == "holds, but open at wide"
    assert row("C55", "plans are found").size == "0 % against 100 %, through 0.025"
    assert row("C22", "on every move").size.startswith("exponent 4.8")
    assert row("C22", "something is seen").size.startswith("exponent 3.8")
    assert row("C20", "most weights").size.endswith("% of all")


@usual
@given(seeds)
def test_counted_label_setting_is_that_of_the_toolkit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 20))
    # few different weights: ties
    weights = rng.integers(1, 6, (n, n)).astype(float) if rng.random() < 0.5 else rng.random((n, n)) + 1e-6
    np.fill_diagonal(weights, 0.0)
    target, source = rng.choice(n, 2, replace=False).tolist()
    counted = claims.counted_label_setting(weights, target, source)
    early = cost_matrix(GeometricGraph.from_matrix(weights), target, source=source)
    assert counted.value == pytest.approx(early.value(source), rel=1e-12)
    assert counted.rounds == early.rounds
    assert counted.relaxations == complexity.relaxation_count(n, early.rounds)


def wrong_weights(model: CostModel, *ends: Any, weights: Any = CostModel.weights) -> Any:  # noqa: ANN401 - of the model
    return weights(model, *ends) + 1e-9


NEAR = Scenario("near", "", Problem((0.9, 0.9), (1.0, 1.0)), Lattice(20, bounds=(0, 0, 1, 1)))
WITHIN = claims.segments_within


@pytest.mark.parametrize(
    ("claim", "module", "name", "broken", "message"),
    [
        ("C20", claims, "pair_count", lambda nodes: nodes * nodes // 2, "does not have"),
        ("C20", CostModel, "weights", wrong_weights, "off its own integral"),
        ("C20", claims, "sample_count", lambda n: n * (n**2 - 1) * (7 * n**2 + 1) // 30, "not as the formula says"),
        ("C21", claims, "relaxation_count", lambda nodes, rounds: nodes * rounds, "as the formula has it"),
        ("C21", claims, "rounds_until", lambda matrix, _: len(matrix.values), "in another round"),
        ("C21", counterexamples, "scenario", lambda _: NEAR, "on the stored map"),
        ("C23", claims, "reweigh", lambda graph, _: graph, "an update is not the matrix from scratch"),
        ("C23", claims, "segments_within", lambda *args: WITHIN(*args[:2], 0.5 * args[2]), "out of the threat's reach"),
        ("C55", direction_claims, "neighbour_count", lambda n: 4 * n * n, "pairs of neighbours"),
        ("C55", direction_claims, "pair_count", lambda _: 10**6, "are not fewer"),
    ],
)
def test_what_is_broken_does_not_pass(
    monkeypatch: pytest.MonkeyPatch, claim: str, module: object, name: str, broken: object, message: str
) -> None:
    monkeypatch.setattr(module, name, broken)
    with pytest.raises(AssertionError, match=message):
        check(claim)


def test_uses_of_eq_9_on_edges_twice_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def twice(weights: FloatArray, target: int, source: int) -> claims.Counted:
        counted = claims.counted_label_setting(weights, target, source)
        return counted._replace(relaxations=100 * counted.relaxations + 100)

    monkeypatch.setattr(direction_claims, "counted_label_setting", twice)
    with pytest.raises(AssertionError, match=r"Eq\. 9 is used"):
        check("C55")


@pytest.mark.parametrize(("seconds", "way"), [(0.2, "the other way round"), (3.0, "in the same direction")])
def test_c36_says_which_takes_less(monkeypatch: pytest.MonkeyPatch, seconds: float, way: str) -> None:
    answer = Solution(Status.FOUND, evaluations=1482)
    monkeypatch.setattr(claims, "_timed", lambda name: (1.0 if name == "cgla" else seconds, answer))
    (found,) = check("C36").rows
    assert found.answer is Answer.NOT_REPRODUCED
    assert found.size == f"Q-Learning / CGLA: {seconds:.1g}"
    assert found.why.startswith(way)


def test_c36_times_both_planners() -> None:
    (found,) = check("C36").rows
    assert "79,800 weights for its plan, Q-Learning 1,482" in found.why

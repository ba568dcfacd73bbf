"""The checks of C20 to C23, C36 and C47: their verdicts, their counters, and that broken programs do not get them."""

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from strategies import few, seeds, usual

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Table, Verdict
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.paper import complexity_claims as claims
from cgla_graph.comparisons.claims.paper import operation_counts, time_claims
from cgla_graph.comparisons.statistics.intervals import Estimate
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario

BY_ID = catalogue.claims()


def check(claim: str, maps: int = 8) -> Finding:
    return BY_ID[claim].check(Evidence(Scale(maps=maps)))


@pytest.mark.parametrize("n", range(2, 7))
def test_formulas_count_what_is_there(n: int) -> None:
    pairs = list(itertools.combinations(itertools.product(range(n), repeat=2), 2))
    apart = [(abs(a - c), abs(b - d)) for (a, b), (c, d) in pairs]
    assert operation_counts.pair_count(n * n) == len(pairs)
    assert operation_counts.integral_count(n) == sum(math.gcd(*one) == 1 for one in apart)
    assert operation_counts.sample_count(n) == sum(max(one) for one in apart)


@usual
@given(seeds)
def test_counted_label_setting_is_that_of_the_toolkit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 20))
    # few different weights: ties
    weights = rng.integers(1, 6, (n, n)).astype(float) if rng.random() < 0.5 else rng.random((n, n)) + 1e-6
    np.fill_diagonal(weights, 0.0)
    target, source = rng.choice(n, 2, replace=False).tolist()
    counted = operation_counts.counted_label_setting(weights, target, source)
    graph = GeometricGraph.from_matrix(weights)
    early = cost_matrix(graph, target, source=source)
    assert math.isclose(counted.value, early.value(source), rel_tol=1e-12)
    assert counted.rounds == early.rounds
    assert counted.relaxations == operation_counts.relaxation_count(n, early.rounds)


@few
@given(seeds)
def test_a_flight_plans_on_change_no_more_than_on_every_move(seed: int) -> None:
    rng = np.random.default_rng(seed)
    threats = [Threat(*rng.uniform(0.25, 0.75, 2).tolist(), spread=0.04) for _ in range(int(rng.integers(0, 4)))]
    n = int(rng.integers(5, 11))
    counts = operation_counts.count_flight(RiskField(threats), k=10.0, n=n)
    assert counts is not None
    least, nodes = operation_counts.pair_count(n * n), n * n + 2
    assert counts.plans * least <= counts.on_change <= counts.every_move
    most = operation_counts.pair_count(nodes) + operation_counts.relaxation_count(nodes, nodes)
    assert counts.moves * least <= counts.every_move <= counts.moves * most
    assert 1 <= counts.plans <= counts.moves
    assert 0 < counts.rounds < nodes


@few
@given(seeds)
def test_segments_within_are_those_that_shapely_finds(seed: int) -> None:
    shapely = pytest.importorskip("shapely")
    rng = np.random.default_rng(seed)
    lattice = Lattice(5, bounds=(0, 0, 1, 1))
    threat, radius = Threat(*rng.random(2).tolist(), spread=0.1), float(rng.uniform(0.05, 0.5))
    points = np.asarray(lattice.points)
    lines = shapely.linestrings([points[list(pair)] for pair in itertools.combinations(range(len(points)), 2)])
    apart = shapely.distance(lines, shapely.Point(threat.x, threat.y))
    clear = np.abs(apart - radius) > 1e-12
    found = claims.segments_within(lattice, threat, radius) != 0.0
    assert (found == (apart <= radius))[clear].all()


def test_a_wrong_number_of_pairs_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "pair_count", lambda nodes: nodes * nodes // 2)
    with pytest.raises(AssertionError, match="does not have"):
        check("C20")


def test_weights_that_are_no_integrals_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    weights = CostModel.weights
    monkeypatch.setattr(CostModel, "weights", lambda *args: weights(*args) + 1e-9)
    with pytest.raises(AssertionError, match="off its own integral"):
        check("C20")


def test_wrong_counters_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "relaxation_count", lambda nodes, rounds: nodes * rounds)
    with pytest.raises(AssertionError, match="as the formula has it"):
        check("C21")


def test_a_stored_map_with_few_rounds_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    near = Scenario("near", "", Problem((0.9, 0.9), (1.0, 1.0)), Lattice(20, bounds=(0, 0, 1, 1)))
    monkeypatch.setattr(counterexamples, "scenario", lambda _: near)
    with pytest.raises(AssertionError, match="on the stored map"):
        check("C21")


def test_an_update_that_changes_nothing_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "reweigh", lambda graph, _: graph)
    with pytest.raises(AssertionError, match="an update is not the matrix from scratch"):
        check("C23")


def test_a_reach_that_is_too_short_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    within = claims.segments_within
    monkeypatch.setattr(claims, "segments_within", lambda *args: within(args[0], args[1], 0.5 * args[2]))
    with pytest.raises(AssertionError, match="out of the threat's reach changed"):
        check("C23")


def world(rng: np.random.Generator, every: float, change: float, maps: int = 20) -> list[str]:
    """Return the verdicts on flights whose operations grow with these exponents, more or less."""
    exponents: dict[str, Any] = {"every_move": rng.normal(every, 0.1, maps), "on_change": rng.normal(change, 0.1, maps)}
    finding = claims.judge_c22(exponents, np.ones((maps, 2)), 0)
    assert [part.verdict for part in finding.parts[:2]] == [Verdict.PROVED, Verdict.PROVED]
    return [part.verdict.label for part in finding.parts[2:]]


def test_exponents_between_four_and_five_are_told_from_others() -> None:
    rng = np.random.default_rng(1)
    assert world(rng, 4.9, 4.0) == ["supported", "supported"]
    for _ in range(10):
        assert world(rng, 6.0, 4.0) == ["contradicted", "supported"]
        assert world(rng, 4.9, 3.0) == ["supported", "contradicted"]
        assert world(rng, 5.1, 4.2)[0] == "undecided"
    assert world(rng, 4.9, 4.0, maps=3) == ["undecided", "undecided"]


def test_flights_that_take_more_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def dear(_: RiskField, *, k: float, n: int) -> operation_counts.FlightCounts:
        return operation_counts.FlightCounts(n, 2, k * n, n**6, n**4)

    monkeypatch.setattr(claims, "count_flight", dear)
    assert [part.verdict for part in check("C22").parts[2:]] == [Verdict.CONTRADICTED, Verdict.SUPPORTED]


@pytest.mark.parametrize(
    ("share", "maps", "verdicts"),
    [
        (0.3, 200, ["refuted", "refuted", "supported", "supported"]),
        (0.7, 200, ["refuted", "refuted", "supported", "contradicted"]),
        (2.5, 200, ["refuted", "refuted", "contradicted", "contradicted"]),
        (0.3, 9, ["refuted", "refuted", "undecided", "undecided"]),
    ],
)
def test_edges_of_paths_are_held_against_n(share: float, maps: int, verdicts: list[str]) -> None:
    edges = {n: np.full(maps, share * n) for n in claims.PLAN_SIZES}
    finding = claims.judge_c21(np.full(maps, 0.9), edges, [], (398, 400), Estimate(2.0, 1.9, 2.1))
    assert [part.verdict.label for part in finding.parts[1:]] == verdicts
    assert [part.verdict.label for part in finding.beside] == verdicts[-1:] * 3
    assert finding.parts[-1].condition.endswith("N = 20")


@pytest.mark.parametrize(
    ("share", "maps", "verdicts"),
    [
        (0.05, 40, ["supported"] * 4),
        (0.3, 40, ["supported"] * 2 + ["contradicted"] * 2),
        (0.7, 40, ["contradicted"] * 4),
        (0.05, 4, ["undecided"] * 4),
    ],
)
def test_few_changed_weights_are_told_from_many(share: float, maps: int, verdicts: list[str]) -> None:
    shares = np.random.default_rng(1).normal(share, 0.01, maps).tolist()
    changed = dict.fromkeys(claims.CHANGES, shares)
    finding = claims.judge_c23(changed, {"crossed": shares, "G": shares}, 7.8, 1e-3, Table("", (), ()))
    assert [part.verdict.label for part in finding.parts] == ["proved", *verdicts]


def test_a_restricted_search_that_misses_the_optimum_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    real = claims.restricted_optimum
    monkeypatch.setattr(claims, "RESTRICTED_SIZES", (8, 12, 16))
    part, table = claims._restricted_counts(Evidence(Scale(maps=20)))
    assert [row[0] for row in table.rows] == [8, 12, 16]
    assert all(row[4] <= row[3] <= row[1] for row in table.rows)
    assert part.verdict is Verdict.REFUTED
    monkeypatch.setattr(claims, "restricted_optimum", lambda on: dataclasses.replace(real(on), cost=1.0))
    with pytest.raises(AssertionError, match="is not the optimum"):
        claims._restricted_counts(Evidence(Scale(maps=20)))


def times(rng: np.random.Generator, growth: float) -> np.ndarray[Any, Any]:
    """Return seconds of 40 maps that grow with N by a power of it, and differ by chance."""
    sizes = np.array(time_claims.TIMED_SIZES, dtype=float)
    return (sizes / 20.0) ** growth * rng.lognormal(0.0, 0.3, (40, len(sizes)))


def judged(seconds: np.ndarray[Any, Any]) -> Verdict:
    operations, clock = time_claims.judge_c47(seconds).parts
    assert operations.verdict is Verdict.PROVED
    return clock.verdict


def test_times_that_grow_are_told_from_those_that_do_not() -> None:
    rng = np.random.default_rng(2)
    assert judged(times(rng, 4.0)) is Verdict.SUPPORTED
    assert judged(times(rng, -4.0)) is Verdict.CONTRADICTED
    assert judged(times(rng, 4.0)[:5]) is Verdict.UNDECIDED
    none = [judged(times(rng, 0.0)) for _ in range(100)]
    assert none.count(Verdict.SUPPORTED) <= 5
    assert none.count(Verdict.UNDECIDED) >= 85


def test_c47_times_the_plans_of_each_size(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        time_claims, "_timed", lambda problem, solver, n: (n**4 * (1.0 + problem.field.threats[0].x), solver)
    )
    finding = check("C47")
    assert finding.parts[1].verdict is Verdict.SUPPORTED
    assert [round(float(row[3]), 6) for row in finding.tables[0].rows] == [
        round((20 / 15) ** 4, 6),
        round((25 / 20) ** 4, 6),
    ]
    monkeypatch.setattr(time_claims, "relaxation_count", lambda *_: 7)
    with pytest.raises(AssertionError, match="a count does not grow"):
        check("C47")


def test_updates_that_are_not_told_are_noticed() -> None:
    assert time_claims._updates(Solution(Status.FOUND, message="8000 episodes, 55 updates")) == 55
    with pytest.raises(AssertionError, match="does not say how many updates"):
        time_claims._updates(Solution(Status.FOUND, message="learnt"))

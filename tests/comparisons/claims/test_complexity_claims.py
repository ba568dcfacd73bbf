"""The checks of C20 to C23, C36 and C55, and the records that they read: against plain programs and broken ones."""

import itertools
import math
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from strategies import few, usual

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Answer, Finding, Row
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel import complexity
from cgla_graph.comparisons.claims.panel.flights import fly, paper_lattice
from cgla_graph.comparisons.claims.panel.settings import BOUNDS, FACTORS, KINDS, START, PanelMap, seeds_of
from cgla_graph.comparisons.claims.paper import complexity_claims as claims
from cgla_graph.comparisons.claims.paper import direction_claims
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import solve
from cgla_graph.testing.strategies import seeds


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


def twice(*given: Any) -> claims.Counted:  # noqa: ANN401 - as `counted_label_setting`
    counted = claims.counted_label_setting(*given)
    return counted._replace(relaxations=100 * counted.relaxations + 100)


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
        ("C55", direction_claims, "counted_label_setting", twice, r"Eq\. 9 is used"),
        ("C55", direction_claims, "pair_count", lambda _: 10**6, "are not fewer"),
    ],
)
def test_what_is_broken_does_not_pass(
    monkeypatch: pytest.MonkeyPatch, claim: str, module: object, name: str, broken: object, message: str
) -> None:
    monkeypatch.setattr(module, name, broken)
    with pytest.raises(AssertionError, match=message):
        check(claim)


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


MAP = PanelMap(seeds_of(KINDS[3], 9, 1)[0])


def of(records: Sequence[Record], **case: object) -> Record:
    (found,) = [one for one in records if all(one.get(name) == value for name, value in case.items())]
    return found


def test_plans_are_those_of_the_full_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(complexity, "SIZES", (10, 20))
    records = complexity.plans.sample(MAP)
    for n, k in itertools.product((10, 20), FACTORS["k"]):
        on = MAP.problem(k).on_lattice(paper_lattice(n)).with_weights_held()
        early = cost_matrix(on.graph, on.target, source=on.source)
        path = np.asarray(solve(MAP.problem(k), "cgla", resolution=paper_lattice(n)).path)
        found, eight = (of(records, n=n, k=k, planner=name) for name in ("cgla", "eight-direction"))
        # points that tie with the source may have served before it
        assert 0 <= early.rounds - found["rounds_over_n"] * n < 2
        straight = shapely.LineString(path).simplify(1e-9)
        assert math.isclose(found["edges_over_n"] * n, len(straight.coords) - 1)
        assert found["below"] == (len(straight.coords) - 1 < n)
        assert found["below_half"] == (len(straight.coords) - 1 < n / 2)
        assert 0.0 < found["sharpest"] <= found["turning"]
        assert math.isclose(eight["turning"] % 45.0, 0.0, abs_tol=1e-6) or k > 0.0
        assert ("weighed_share" in found) == (n == 20)


@few
@given(seeds)
def test_turns_add_up_to_those_of_headings(seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = rng.integers(0, 6, (int(rng.integers(2, 9)), 2)).astype(float)
    path = path[np.concatenate([[True], np.any(np.diff(path, axis=0) != 0.0, axis=1)])]
    ways = [complex(*way) for way in np.diff(path, axis=0)]
    expected = [abs(math.degrees(np.angle(after / before))) for before, after in itertools.pairwise(ways)]
    np.testing.assert_allclose(complexity.turns(path), [one for one in expected if one > 1e-6], atol=1e-9)


def test_a_flight_is_counted_as_if_each_move_were_planned_anew() -> None:
    n = 9
    flown = fly({"a": START}, MAP.field, MAP.goal, n=n, step=0.4 / n, k=50.0, radius=0.1).uavs["a"]
    counts = complexity.count_flight(flown, n)
    every, change = 0, 0
    for tick in range(flown.departed, flown.ended):
        threats = RiskField(list(flown.knowledge_at(tick).threats.values()))
        place = flown.position_at(tick) or START
        extra = tuple(dict.fromkeys((MAP.goal, place)))
        graph = GeometricGraph.complete(paper_lattice(n), threats, 50.0, extra=extra).with_weights_held()
        values = cost_matrix(graph, graph.node_at(MAP.goal)).values
        rounds = int((values < values[graph.index_of(graph.node_at(place))]).sum())
        work = graph.n_pairs + sum(graph.n_nodes - 1 - done for done in range(rounds))
        every, change = every + work, change + work * (tick in flown.replans)
    assert counts["on change"] == change > 0
    # a point between two others may tie with one of them: Delta_k has both, or one by rounding
    assert math.isclose(counts["every move"], every, rel_tol=1e-3)


def test_changed_weights_are_those_that_differ() -> None:
    *known, seen = MAP.field.threats
    found = of(complexity.new_threat.sample(MAP), k=50.0, varied="N 10")
    points = np.asarray(paper_lattice(10).points)
    ends = np.array(list(itertools.combinations(range(100), 2)))
    weights = [CostModel(RiskField(of), 50.0).weights(*points[ends.T]) for of in (known, MAP.field.threats)]
    assert math.isclose(found["changed_much"], np.mean(np.abs(weights[1] - weights[0]) > 1e-3), abs_tol=1e-3)
    apart = shapely.distance(shapely.linestrings(points[ends]), shapely.Point(seen.x, seen.y))
    assert math.isclose(found["crossed"], np.mean(apart <= 4.0 * seen.spread))
    assert found["changed"] > found["changed_much"]


@pytest.mark.parametrize("width", complexity.PASSAGES)
def test_a_wall_leaves_one_passage_of_its_width(width: float) -> None:
    for seed in seeds_of(KINDS[0], 9, 20):
        map_ = PanelMap(seed)
        wall, box = complexity.wall(map_, width), shapely.box(*BOUNDS)
        first, second = wall.geoms
        assert math.isclose(first.distance(second), width, rel_tol=1e-9)
        # closed up, it parts the map, with start and goal on different sides
        sides = box.difference(wall.convex_hull.buffer(1e-9)).geoms
        (near,) = [side for side in sides if side.covers(shapely.Point(START))]
        assert not near.covers(shapely.Point(map_.goal))


def test_plans_past_passages_are_never_found_in_eight_directions_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(complexity, "SIZES", (10,))
    for seed in seeds_of(KINDS[0], 9, 3):
        records = complexity.passages.sample(PanelMap(seed))
        assert len(records) == 4 * 3 * 2
        for any_way, eight in zip(records[::2], records[1::2], strict=True):
            assert (any_way["planner"], eight["planner"]) == ("cgla", "eight-direction")
            assert any_way["found"] >= eight["found"]

"""Records of what plans and flights take, held against plain programs."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import given
from strategies import few, seeds

from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel import complexity
from cgla_graph.comparisons.claims.panel.flights import BOUNDS, fly, paper_lattice
from cgla_graph.comparisons.claims.panel.settings import FACTORS, KINDS, START, PanelMap, seeds_of
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.risk import RiskField
from cgla_graph.solvers import solve

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


def test_each_level_of_radius_and_k_is_flown_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(complexity, "FLIGHT_SIZES", (5, 6))
    asked = []
    for seed in seeds_of(KINDS[1], 9, 3):
        records = [one for one in complexity.flight_operations.sample(PanelMap(seed)) if not one["varied"]]
        asked += [(one["radius"], one["k"]) for one in records if one["planning"] == "on change"]
        assert sorted(one["k"] for one in records) == sorted(2 * FACTORS["k"])
    assert sorted(asked) == sorted(itertools.product(FACTORS["radius"], FACTORS["k"]))


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

"""The experiments with teams: their records against flights and sums of their own."""

import math
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims.panel import one_matrix, teams
from cgla_graph.comparisons.claims.panel.one_matrix import DELAYS, fly_on_one_matrix
from cgla_graph.comparisons.claims.panel.settings import FACTORS, KINDS, PANEL, RULES, START, PanelMap, seeds_of
from cgla_graph.comparisons.claims.panel.teams import (
    FEW_THREATS,
    OBSTACLE_SPREADS,
    SAFE_DISTANCES,
    SECOND_STARTS,
    SIDE,
    STEPNUMS,
    clear_field,
    fly_two,
    fraction,
    half,
    kept_apart,
)
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.solvers import get

#: A map of the paper's kind, from which rules are varied, and one with a goal aside, from which they are not.
PAPER, ASIDE = (PanelMap(seeds_of(KINDS[number], 7, 1)[0]) for number in (0, 1))
BOUNDS = (0.0, 0.0, 1.0, 1.0)


def flown(map_: PanelMap, second: tuple[float, float], *, k: float, radius: float, **rules: Any) -> Flight:  # noqa: ANN401
    """Fly two UAVs by a mission of the test's own."""
    safe = rules.pop("safe_distance", 0.05)
    ends = {"a": START, "b": second}
    uavs = [Uav(name, at, map_.goal, radius, step=0.02, k=k, safe_distance=safe) for name, at in ends.items()]
    return Mission(
        World(clear_field(map_, rules.pop("count", map_.kind.threats)), bounds=BOUNDS),
        uavs,
        get("cgla"),
        resolution=Lattice(20, bounds=BOUNDS, kind="upper"),
        arrival_radius=0.025,
        collisions="record",
        max_ticks=500,
        **rules,
    ).fly()


def nearest(flight: Flight) -> float:
    """Return how near two UAVs come at ticks, while not both are within 0.06 of their goal."""
    a, b = (one.trace for one in flight.uavs.values())
    goal = np.array(flight.uavs["a"].uav.goal)
    pairs = list(zip(a, b, strict=False))
    return min(math.dist(p, q) for p, q in pairs if max(math.dist(p, goal), math.dist(q, goal)) > 0.06)


def integrated(flight: Flight) -> float:
    """Return the risk of both UAVs by the midpoint rule on pieces of a thousandth."""
    total = 0.0
    for one in flight.uavs.values():
        for p, q in pairwise(one.trace):
            middles = p + (q - p) * ((np.arange(20) + 0.5) / 20.0)[:, None]
            total += math.dist(p, q) * float(flight.mission.world.field.density(middles).mean())
    return total


def test_threats_keep_off_all_starts_and_fewer_are_the_first_ones() -> None:
    for kind in KINDS:
        map_ = PanelMap(seeds_of(kind, 7, 1)[0])
        field = clear_field(map_, kind.threats)
        assert len(field) == kind.threats
        away = [math.dist((one.x, one.y), at) for one in field.threats for at in (START, *SECOND_STARTS.values())]
        assert min(away) >= 0.12
        assert clear_field(map_, 5).threats == field.threats[:5]


def test_all_levels_of_two_factors_meet() -> None:
    levels = {**FACTORS, "obstacle_spread": OBSTACLE_SPREADS, "safe_distance": SAFE_DISTANCES}
    cells = [{**kind._asdict(), **case} for index, kind in enumerate(half(PANEL)) for case in fraction(index)]
    for a, b in combinations(levels, 2):
        assert {(cell[a], cell[b]) for cell in cells} == set(product(levels[a], levels[b]))


def test_records_of_sharing_are_sums_of_flights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(teams, "cells", lambda *_, **__: [{"radius": 0.2, "k": 50.0}])
    records = teams.sharing_flights.sample(ASIDE)
    assert len(records) == 4
    for record in records:
        second = SECOND_STARTS[record["formation"]]
        flight = flown(ASIDE, second, k=50.0, radius=0.2, sharing=record["sharing"])
        length = sum(math.dist(p, q) for one in flight.uavs.values() for p, q in pairwise(one.trace))
        assert record["length"] == pytest.approx(length, abs=1e-9)
        assert record["risk"] == pytest.approx(integrated(flight), rel=1e-2, abs=1e-6)
        assert record["cost"] == pytest.approx(record["length"] + 50.0 * record["risk"], abs=1e-9)
        assert record["separation"] == pytest.approx(nearest(flight), abs=0.02)
    assert len({record["length"] for record in records if record["formation"] == SIDE}) == 2


@pytest.mark.slow
def test_obstacles_are_flown_for_all_stepnums_or_need_not_be(monkeypatch: pytest.MonkeyPatch) -> None:
    """A flight that stands for all stepnums is the one that would be flown."""
    cases = [{**fraction(0)[0], "k": 50.0}, {**fraction(0)[2], "k": 10.0, "radius": 0.15}]
    monkeypatch.setattr(teams, "fraction", lambda *_: cases)
    made: list[int] = []
    monkeypatch.setattr(teams, "kept_apart", lambda *of, **rules: made.append(of[2]) or kept_apart(*of, **rules))
    for map_ in (PAPER, PanelMap(seeds_of(KINDS[0], 7, 2)[1])):
        records = teams.obstacle_flights.sample(map_)
        assert len(records) == 2 * (1 + len(STEPNUMS))
        for record in records:
            case = {name: record[name] for name in ("k", "radius")}
            if record["stepnum"] == "none":
                flight, bare = flown(map_, (0.1, 0.25), **case, sharing="none"), record
                assert "avoided" not in record
            else:
                rule = VirtualObstacle(stepnum=record["stepnum"], spread=record["obstacle_spread"])
                safe = min(record["safe_distance"], 0.9 * record["radius"])
                settings: dict[str, Any] = {"safe_distance": safe, "virtual_obstacle": rule, "sharing": "none"}
                flight = flown(map_, (0.1, 0.25), **case, **settings)
                assert record["avoided"] == ((not record["collided"]) if bare["collided"] else None)
            assert record["separation"] == min(pair.distance for pair in flight.separations)
            assert record["collided"] == (record["separation"] < 0.03)
    # some flights stood for others
    assert len(made) < 2 * 2 * len(STEPNUMS)


@pytest.mark.slow
def test_few_threats_work_if_both_arrive_apart() -> None:
    records = teams.few_threats.sample(ASIDE)
    assert [record["few_threats"] for record in records] == [count for count in FEW_THREATS for _ in range(4)]
    (rule,) = {record["varied"] for record in records if record["varied"]}
    names = {f"{name} {value}": {name: value} for name, value in RULES.items()}
    record = next(one for one in records if one["varied"] == rule and one["few_threats"] == 7)
    obstacle = VirtualObstacle(stepnum=3, spread=record["obstacle_spread"])
    case = {"k": record["k"], "radius": record["radius"], "safe_distance": record["safe_distance"], "count": 7}
    flight = flown(ASIDE, (0.1, 0.25), **case, virtual_obstacle=obstacle, sharing="global", **names[rule])
    assert record["ticks"] == flight.ticks
    assert record["works"] == (flight.all_arrived and flight.least_separation >= 0.03)


@pytest.mark.parametrize("delay", [0, 3])
def test_on_one_matrix_all_know_what_any_has_seen_so_long_ago(delay: int) -> None:
    flight = fly_on_one_matrix(fly_two(PAPER, PAPER.field, k=50.0, radius=0.2).mission, delay)
    first: dict[int, int] = {}
    for one in flight.uavs.values():
        for tick, position in enumerate(one.trace[:-1], start=one.departed):
            for number, threat in enumerate(PAPER.field.threats):
                if math.dist(position, (threat.x, threat.y)) <= 0.2:
                    first[number] = min(tick, first.get(number, tick))
    assert flight.all_arrived
    assert first
    for one in flight.uavs.values():
        for tick in range(one.departed, one.ended):
            known = {number for number, seen in first.items() if seen + delay <= tick}
            assert set(one.knowledge_at(tick).threats) == known


def test_records_of_one_matrix_pair_the_two_at_each_delay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(one_matrix, "fraction", lambda *_: fraction(0)[:1])
    records = one_matrix.one_matrix.sample(PAPER)
    assert [(record["delay"], record["matrices"]) for record in records] == list(product(DELAYS, ("each", "one")))
    flight = flown(PAPER, (0.1, 0.25), k=10.0, radius=0.1, sharing=Sharing(delay=5))
    each = next(record for record in records if (record["delay"], record["matrices"]) == (5, "each"))
    assert each["length"] == pytest.approx(sum(one.length for one in flight.uavs.values()), abs=1e-9)

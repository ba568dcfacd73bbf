"""The table of Q-Learning: its records, computed again by other means."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import networkx as nx
import numpy as np
import pytest

from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel import learners as table
from cgla_graph.comparisons.claims.panel.flights import ARRIVAL_RADIUS, BOUNDS, STEP
from cgla_graph.comparisons.claims.panel.settings import BASE_KINDS, FACTORS, START, PanelMap, seeds_of
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.solvers.grid.q_learning import QLearning
from cgla_graph.solvers.grid.value_iteration import decision_process, greedy, value_iteration

MAP = PanelMap(seeds_of(BASE_KINDS[2], 5, 1)[0])
LATTICE = Lattice(20, bounds=BOUNDS, kind="upper")


@cache
def records() -> Sequence[Record]:
    """Measure on one map, with one K and one radius, both of its base cell."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(table, "FACTORS", {**FACTORS, "k": (10.0,), "radius": (0.4,)})
        patch.setattr(table, "GAMMAS", (0.5, 0.95))
        patch.setattr(table, "FLOWN_GAMMAS", (0.95,))
        return table.learners.sample(MAP)


def of(**case: object) -> list[Record]:
    return [record for record in records() if all(record[name] == value for name, value in case.items())]


def test_every_case_is_measured_once() -> None:
    names = ("mode", "gamma", "reward", "k", "radius", "varied")
    cases = [tuple(record.get(name) for name in names) for record in records()]
    assert len(cases) == len(set(cases))
    counts = {mode: len(of(mode=mode)) for mode in ("needed", "known", "flown")}
    assert counts == {"needed": 3 * 3, "known": (2 * 3 + 1) * 3, "flown": 3 * 3 + 2}


def test_least_rewards_are_enough_and_less_is_not() -> None:
    process = decision_process(MAP.problem(10.0).on_eight_connected(LATTICE))
    graph = process.on.graph.to_networkx()
    cost = nx.dijkstra_path_length(graph, process.on.source, process.on.target)
    for record in of(mode="needed", varied=""):
        gamma = float(record["gamma"].removeprefix("gamma "))
        assert record["cost"] == pytest.approx(cost, rel=1e-12)
        assert record["ratio"] == pytest.approx(record["least"] / cost, rel=1e-12)
        for factor, reaches in ((1.001, True), (0.999, record["least"] == 0.0)):
            rewarded = replace(process, target_reward=factor * record["least"])
            way = greedy(rewarded, value_iteration(rewarded, gamma=gamma).moves)
            assert (way.states[-1] == process.target) == reaches


def test_what_is_learned_is_no_better_than_the_optimum() -> None:
    for record in of(mode="known"):
        assert record["excess"] is None or record["excess"] >= -1e-12
        assert record["as_good"] == (record["arrived"] and record["excess"] <= 0.01)
    (undiscounted,) = of(mode="known", gamma="gamma 1", varied="")
    assert undiscounted["excess"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("varied", "settings", "replan"),
    [("", {}, "change"), ("alpha 0.1", {"alpha": 0.1}, "change"), ("replan tick", {}, "tick")],
)
def test_flights_are_those_of_a_mission(varied: str, settings: dict[str, float], replan: str) -> None:
    (record,) = of(mode="flown", gamma="gamma 0.95", reward="reward 100", varied=varied)
    uav = Uav("a", START, MAP.goal, 0.4, step=STEP, k=10.0)
    solver = QLearning(gamma=0.95, target_reward=100.0, **settings)
    world = World(MAP.field, bounds=BOUNDS)
    rules = {"resolution": LATTICE, "arrival_radius": ARRIVAL_RADIUS, "max_ticks": 500, "replan": replan}
    path = np.asarray(Mission(world, [uav], solver, **rules).fly().uavs["a"].path)
    length = math.fsum(np.hypot(*np.diff(path, axis=0).T))
    risk = math.fsum(MAP.field.line_integral(path[:-1], path[1:]))
    assert [record["length"], record["risk"]] == pytest.approx([length, risk], rel=1e-9)
    assert record["cost"] == pytest.approx(length + 10.0 * risk, rel=1e-9)

"""Q-Learning: the checks of C25 and C53, and the table that they read, computed again by other means."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import product

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from strategies import few

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Answer
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel import learners as table
from cgla_graph.comparisons.claims.panel.flights import ARRIVAL_RADIUS, STEP, Flights
from cgla_graph.comparisons.claims.panel.learners import GAMMAS, UNDISCOUNTED, _needed, discount_name
from cgla_graph.comparisons.claims.panel.settings import BASE_KINDS, BOUNDS, FACTORS, KINDS, START, PanelMap, seeds_of
from cgla_graph.comparisons.claims.paper import learning_claims as claims
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.grid.q_learning import QLearning
from cgla_graph.solvers.grid.value_iteration import decision_process, greedy, least_target_reward, value_iteration
from cgla_graph.testing.strategies import seeds

SEED = seeds_of(KINDS[5], 9, 1)[0]


@few
@given(seeds)
def test_the_formula_is_what_bisection_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lattice = Lattice(int(rng.integers(3, 7)), bounds=(0, 0, 1, 1))
    start, goal = (tuple(one) for one in lattice.points[rng.choice(lattice.n_points, 2, replace=False)].tolist())
    field = random_scenario(seed, threats=3, spread=(0.05, 0.4), start=start, goal=goal).problem.field
    problem = Problem(start, goal, field=field, k=float(10.0 ** rng.uniform(0, 2)))
    gamma = float(rng.uniform(0.4, 0.98))
    process = decision_process(problem.on_eight_connected(lattice))
    reward = claims.least_reward_by_formula(process, gamma)
    found = least_target_reward(problem, gamma=gamma, resolution=lattice)
    assert math.isclose(reward, found, rel_tol=1e-6, abs_tol=1e-6)


@pytest.mark.parametrize("gamma", [None, 0.8, UNDISCOUNTED])
def test_measured_rewards_are_those_of_the_formula(gamma: float | None) -> None:
    records = [{**one, "map": SEED} for one in _needed(Flights(PanelMap(SEED)), 50.0)]
    if gamma is None:
        assert claims.require_formula(records, [PanelMap(SEED)]) == len(GAMMAS) + 1
        return
    (wrong,) = (one for one in records if one["gamma"] == discount_name(gamma))
    with pytest.raises(AssertionError, match="by the formula"):
        claims.require_formula([{**wrong, "least": 1.001 * wrong["least"] + 0.001}], [PanelMap(SEED)])


def test_a_reward_without_risk_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "least_target_reward", lambda *_args, **_settings: 1.0)
    with pytest.raises(AssertionError, match="without risk 1 is needed"):
        claims.require_formula([], [PanelMap(SEED)])


@pytest.mark.parametrize(
    ("name", "message"), [(claims.NEEDLESS, "a reward of .* is needed"), (claims.FALLING, "the reward does not fall")]
)
def test_stored_maps_that_show_nothing_are_noticed(monkeypatch: pytest.MonkeyPatch, name: str, message: str) -> None:
    other = {claims.NEEDLESS: claims.FALLING, claims.FALLING: claims.NEEDLESS}
    scenario = counterexamples.scenario
    monkeypatch.setattr(counterexamples, "scenario", lambda asked: scenario(other[asked] if asked == name else asked))
    with pytest.raises(AssertionError, match=message):
        claims.stored_rewards()


def made_up(times: float, excess: float, maps: int = 80) -> Samples:
    rng = np.random.default_rng(1)
    records: list[Record] = []
    for seed, k, gamma in product(seeds_of(KINDS[0], 2, maps), (10.0, 50.0), (0.8, 0.95, UNDISCOUNTED)):
        ratio = times * rng.uniform(0.9, 1.1) if gamma < UNDISCOUNTED else 0.0
        case = {**PanelMap(seed).levels, "k": k, "gamma": discount_name(gamma), "varied": ""}
        records.append({**case, "mode": "needed", "ratio": ratio, "least": ratio})
        good = excess <= 0.01 or gamma == UNDISCOUNTED
        records.append({**case, "mode": "known", "reward": "reward 3", "as_good": good})
    return Samples(records)


@pytest.mark.parametrize(("times", "expected"), [(30.0, "holds"), (8.0, "fails"), (0.0, "fails"), (10.0, "open")])
def test_very_large_rewards_are_told_from_others(times: float, expected: str) -> None:
    assert claims.needed_rewards(made_up(times, 0.0)).answer.label == expected


@pytest.mark.parametrize(("excess", "expected"), [(0.0, Answer.HOLDS), (0.05, Answer.FAILS)])
def test_gamma_1_has_a_row_of_its_own(excess: float, expected: Answer) -> None:
    assert [one.answer for one in claims.learned_well(made_up(1.0, excess))] == [expected, Answer.HOLDS]


def test_checks_run_on_a_few_maps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "require_formula", lambda *_: 7)
    evidence = Evidence(Scale(maps=1, quick=True), {"learners": made_up(1.0, 0.05, maps=1)})
    finding = claims._check_c25.check(evidence)
    assert finding.counterexamples == (claims.NEEDLESS, claims.FALLING)
    assert [row.answer for row in finding.rows] == [Answer.FAILS, Answer.OPEN]
    assert claims._check_c53.check(evidence).answers == (Answer.OPEN,)


MAP = PanelMap(seeds_of(BASE_KINDS[2], 5, 1)[0])
LATTICE = Lattice(20, bounds=BOUNDS, kind="upper")


@cache
def records() -> Sequence[Record]:
    """Measure on one map, with one K and one radius, both of its base cell."""
    with pytest.MonkeyPatch.context() as patch:
        for name, levels in {"k": (10.0,), "radius": (0.4,)}.items():
            patch.setitem(FACTORS, name, levels)  # type: ignore[arg-type]
        patch.setattr(table, "GAMMAS", (0.5, 0.95))
        patch.setattr(table, "FLOWN_GAMMAS", (0.95,))
        return table.learners.sample(MAP)


def of(**case: object) -> list[Record]:
    return [record for record in records() if all(record[name] == value for name, value in case.items())]


@pytest.mark.slow
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

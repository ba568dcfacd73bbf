"""The checks of C25 and C53: the formula of the least reward, and that broken programs are noticed."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from strategies import few, seeds

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Answer
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel.flights import Flights
from cgla_graph.comparisons.claims.panel.learners import GAMMAS, UNDISCOUNTED, _needed, discount_name
from cgla_graph.comparisons.claims.panel.settings import KINDS, PanelMap, seeds_of
from cgla_graph.comparisons.claims.paper import learning_claims as claims
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.grid.value_iteration import decision_process, least_target_reward

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
        assert claims.require_formula(records, [SEED]) == len(GAMMAS) + 1
        return
    (wrong,) = (one for one in records if one["gamma"] == discount_name(gamma))
    with pytest.raises(AssertionError, match="by the formula"):
        claims.require_formula([{**wrong, "least": 1.001 * wrong["least"] + 0.001}], [SEED])


def test_a_reward_without_risk_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "least_target_reward", lambda *_args, **_settings: 1.0)
    with pytest.raises(AssertionError, match="without risk 1 is needed"):
        claims.require_formula([], [SEED])


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
    evidence = Evidence(Scale(maps=1, quick=True), {"learners": made_up(1.0, 0.05, maps=3)})
    finding = claims._check_c25.check(evidence)
    assert finding.counterexamples == (claims.NEEDLESS, claims.FALLING)
    assert [row.answer for row in finding.rows] == [Answer.FAILS, Answer.OPEN]
    assert claims._check_c53.check(evidence).answers == (Answer.OPEN,)

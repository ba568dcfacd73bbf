"""The check of C25: its verdict, its formula for the least reward, and that broken programs do not get it."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from strategies import few, seeds

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Verdict
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.paper import learning_claims as claims
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.solvers.grid.value_iteration import decision_process, greedy, least_target_reward, value_iteration

FEW = Evidence(Scale(maps=2))
CLAIM = catalogue.claims()["C25"]


def test_verdict() -> None:
    finding = CLAIM.check(FEW)
    assert finding.verdict is Verdict.REFUTED
    assert finding.counterexample in counterexamples.names()
    verdicts = [part.verdict for part in finding.parts]
    assert verdicts == [Verdict.PROVED, Verdict.PROVED, Verdict.NOT_SUPPORTED, Verdict.REFUTED]


@few
@given(seeds)
def test_the_formula_is_what_bisection_finds(seed: int) -> None:
    """On maps far from the paper's: few points, broad threats, any discount."""
    rng = np.random.default_rng(seed)
    lattice = Lattice(int(rng.integers(3, 7)), bounds=(0, 0, 1, 1))
    start, goal = np.asarray(lattice.points)[rng.choice(lattice.n_points, 2, replace=False)].tolist()
    threats = [
        Threat(*rng.random(2).tolist(), spread=float(rng.uniform(0.05, 0.4)), peak=float(rng.uniform(0.2, 1.0)))
        for _ in range(int(rng.integers(1, 6)))
    ]
    problem = Problem(tuple(start), tuple(goal), field=RiskField(threats), k=float(10.0 ** rng.uniform(0, 2)))
    gamma = float(rng.uniform(0.4, 0.98))
    process = decision_process(problem.on_eight_connected(lattice))
    reward = claims.least_reward_by_formula(process, gamma)
    found = least_target_reward(problem, gamma=gamma, resolution=lattice)
    assert math.isclose(reward, found, rel_tol=1e-6, abs_tol=1e-6)
    for factor, reaches in ((1.001, True), (0.999, False)):
        rewarded = dataclasses.replace(process, target_reward=factor * reward)
        way = greedy(rewarded, value_iteration(rewarded, gamma=gamma).moves)
        # where none is needed, less is not too little
        assert (way.states[-1] == process.target) == (reaches or reward == 0.0)


def test_another_least_reward_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    formula = claims.least_reward_by_formula
    monkeypatch.setattr(claims, "least_reward_by_formula", lambda *args: 1.001 * formula(*args))
    with pytest.raises(AssertionError, match="by the formula"):
        CLAIM.check(FEW)


def test_a_reward_without_discount_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    least = claims.least_target_reward

    def wrong(problem: Problem, *, gamma: float, resolution: Lattice) -> float:
        # the stored maps are checked before
        stored = len(problem.field) != 10
        return least(problem, gamma=gamma, resolution=resolution) if stored else 1.0

    monkeypatch.setattr(claims, "least_target_reward", wrong)
    with pytest.raises(AssertionError, match="without discount a reward of 1 was needed"):
        CLAIM.check(FEW)


@pytest.mark.parametrize(
    ("name", "message"), [(claims.NEEDLESS, "a reward of .* is needed"), (claims.FALLING, "the reward does not fall")]
)
def test_stored_maps_that_show_nothing_are_noticed(monkeypatch: pytest.MonkeyPatch, name: str, message: str) -> None:
    other = {claims.NEEDLESS: claims.FALLING, claims.FALLING: claims.NEEDLESS}
    scenario = counterexamples.scenario
    monkeypatch.setattr(counterexamples, "scenario", lambda asked: scenario(other[asked] if asked == name else asked))
    with pytest.raises(AssertionError, match=message):
        CLAIM.check(FEW)


@pytest.mark.parametrize(
    ("times", "verdict"), [(30.0, Verdict.SUPPORTED), (8.0, Verdict.NOT_SUPPORTED), (0.0, Verdict.NOT_SUPPORTED)]
)
def test_very_large_rewards_are_told_from_others(times: float, verdict: Verdict) -> None:
    rng = np.random.default_rng(1)
    costs = rng.uniform(1.0, 2.0, (20, len(claims.WEIGHTS)))
    rewards = times * costs[:, None, :] * rng.uniform(0.9, 1.1, (20, len(claims.DISCOUNTS), 1))
    assert claims.judge_c25(rewards, costs, [3.0, 2.0, 1.0]).parts[2].verdict is verdict

"""The checks of C25 and C53: their verdicts, and that broken programs do not get them."""

import dataclasses
import math
from collections.abc import Mapping
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from strategies import few, seeds

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Verdict
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.paper import learning_claims as claims
from cgla_graph.comparisons.claims.paper.learners import LEARNERS, UNDISCOUNTED
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.solvers.grid.value_iteration import decision_process, greedy, least_target_reward, value_iteration

FEW = Evidence(Scale(maps=2))
CLAIM = catalogue.claims()["C25"]


@pytest.mark.slow
def test_verdict() -> None:
    finding = CLAIM.check(FEW)
    assert finding.counterexample in counterexamples.names()
    assert [part.verdict for part in finding.parts[:3]] == [Verdict.PROVED, Verdict.REFUTED, Verdict.REFUTED]
    # two maps decide no test of ranks
    assert finding.parts[-1].verdict is Verdict.UNDECIDED
    assert [part.verdict for part in finding.beside] == [Verdict.PROVED, Verdict.REFUTED]


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
    ("times", "maps", "large", "needed"),
    [
        (30.0, 80, Verdict.SUPPORTED, Verdict.SUPPORTED),
        (8.0, 80, Verdict.CONTRADICTED, Verdict.SUPPORTED),
        (0.0, 80, Verdict.CONTRADICTED, Verdict.CONTRADICTED),
        (10.0, 80, Verdict.UNDECIDED, Verdict.SUPPORTED),
        (30.0, 20, Verdict.SUPPORTED, Verdict.UNDECIDED),
        (30.0, 5, Verdict.UNDECIDED, Verdict.UNDECIDED),
    ],
)
def test_very_large_rewards_are_told_from_others(times: float, maps: int, large: Verdict, needed: Verdict) -> None:
    rng = np.random.default_rng(1)
    costs = rng.uniform(1.0, 2.0, (maps, len(claims.WEIGHTS)))
    rewards = times * costs[:, None, :] * rng.uniform(0.9, 1.1, (maps, len(claims.DISCOUNTS), 1))
    finding = claims.judge_c25(rewards, costs, [3.0, 2.0, 1.0])
    assert finding.parts[-1].verdict is large
    assert {part.verdict for part in finding.parts[3:-1]} == {needed}


@pytest.mark.parametrize(
    ("excess", "arrived", "maps", "expected"),
    [
        (0.0, 1.0, 200, Verdict.SUPPORTED),
        (0.05, 1.0, 200, Verdict.CONTRADICTED),
        (0.0, 0.8, 200, Verdict.CONTRADICTED),
        (0.0, 1.0, 40, Verdict.UNDECIDED),
    ],
)
def test_training_claim_tells_worlds_apart(excess: float, arrived: float, maps: int, expected: Verdict) -> None:
    finding = trained(dict.fromkeys(LEARNERS, excess), arrived, maps)
    assert finding.verdicts == (expected,)
    assert finding.parts[0].condition == "for every gamma and reward"


def test_each_learner_has_its_own_verdict() -> None:
    finding = trained({name: 0.0 if name == UNDISCOUNTED else 0.5 for name in LEARNERS}, 1.0, 80)
    found = {part.condition: part.verdict for part in finding.parts}
    assert found.pop("for gamma = 1") is Verdict.SUPPORTED
    assert list(found.values()) == [Verdict.CONTRADICTED]


def trained(excess: Mapping[str, float], arrived: float, maps: int) -> Finding:
    """Check C53 in a world in which full training leaves so much, and less training more."""
    rng = np.random.default_rng(1)
    records = []
    for number, name, share in product(range(maps), LEARNERS, claims.TRAINING):
        there = bool(rng.random() < arrived)
        far = excess[name] if share == claims.TRAINING[-1] else 0.1
        case = {"map": number, "learner": name, "share": share}
        records.append({**case, "arrived": there, "excess": far if there else None})
    return catalogue.claims()["C53"].check(Evidence(samples={"training": Samples(records)}))


def test_training_never_beats_the_optimum() -> None:
    for seed in range(2):
        excess = [one["excess"] for one in claims.training.sample(seed)]
        assert len(excess) == len(LEARNERS) * len(claims.TRAINING)
        assert all(one is None or one >= -1e-12 for one in excess)

"""The check of C34: Q-Learning and A2D against CGLA in worlds where the answer is known."""

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Answer
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel.flights import setup_name
from cgla_graph.comparisons.claims.panel.learners import discount_name, flying_learners, reward_name
from cgla_graph.comparisons.claims.panel.settings import KINDS, PanelMap, seeds_of
from cgla_graph.comparisons.claims.panel.single_uav import CGLA, CONSTANTS, EIGHT
from cgla_graph.comparisons.claims.paper import rival_claims as claims


def world(*, learner: float, eight: float = 1.0, others: float = 1.0, maps: int = 20) -> Mapping[str, Samples]:
    rng = np.random.default_rng(1)
    panel: list[Record] = []
    learned: list[Record] = []
    planners = {CGLA: 1.0, EIGHT: eight, **dict.fromkeys(claims.OTHERS.values(), others)}
    for seed, radius, k in product(seeds_of(KINDS[0], 2, maps), (0.1, 0.2), (10.0, 50.0)):
        case = {**PanelMap(seed).levels, "mode": "flown", "radius": radius, "k": k, "varied": ""}
        risk = rng.lognormal()

        def measured(factor: float, risk: float = risk) -> dict[str, Any]:
            risk *= factor * rng.lognormal(0.0, 0.01)
            return {"arrived": True, "risk": risk, "length": 1.2 * factor**0.1, "cost": 1.2 + risk}

        panel += [{**case, "planner": setup_name(of), **measured(factor)} for of, factor in planners.items()]
        for gamma, reward in flying_learners():
            names = {"planner": "q-learning", "gamma": discount_name(gamma), "reward": reward_name(reward)}
            learned.append({**case, **names, **measured(learner)})
    return {"single-uav": Samples(panel), "learners": Samples(learned)}


@pytest.mark.parametrize(
    ("factors", "expected"),
    [  # Q-Learning's risk, that over BCV and A2D, the cause, gamma = 1, A2D's risk, CGLA's cost and length
        ({"learner": 4.0, "eight": 3.0, "others": 2.0}, "holds holds holds holds holds holds holds"),
        ({"learner": 4.0, "eight": 1.1, "others": 9.0}, "holds fails fails holds holds holds holds"),
        ({"learner": 0.4, "eight": 0.5, "others": 0.2}, "fails holds fails fails fails fails fails"),
        ({"learner": 4.0, "others": 2.0, "maps": 5}, "open open open open open open open"),
    ],
)
def test_worlds_are_told_apart(factors: dict[str, Any], expected: str) -> None:
    found = claims.judged_flights(world(**factors))
    assert [one.answer.label for one in found] == expected.split()


def test_causes_are_the_factors_that_were_put_in() -> None:
    samples = world(learner=6.0, eight=2.0)
    found = claims.causes(samples)
    for side, factor in (("directions", 2.0), ("rest", 3.0)):
        assert np.median([one["risk"] for one in found.where(side=side)]) == pytest.approx(factor, rel=0.02)
    lost = Samples([{**one, "risk": None} for one in samples["learners"].records])
    assert {one["risk"] for one in claims.causes({**samples, "learners": lost}).where(side="rest")} == {None}


def test_varied_settings_stand_beside_usual_flights_of_the_other_side() -> None:
    def flights(*names: tuple[str, str, float]) -> Samples:
        case = {"map": 1, "mode": "flown", "radius": 0.1, "k": 10.0}
        return Samples([{**case, "planner": planner, "varied": varied, "n": n} for planner, varied, n in names])

    theirs = setup_name(CONSTANTS[-1][1])
    panel = flights(("cgla", "", 1), ("cgla", "replan tick", 2), ("cgla", "start snapped", 3), ("cgla", theirs, 9))
    learned = flights(("q-learning", "", 4), ("q-learning", "replan tick", 5), ("q-learning", "alpha 0.1", 6))
    pairs = claims.together(claims.flights_of(learned), claims.flights_of(panel, CGLA))
    assert {varied: tuple(one["n"] for one in pair) for varied, pair in pairs} == {
        "": (4, 1),
        "replan tick": (5, 2),
        "alpha 0.1": (6, 1),
        "start snapped": (4, 3),
    }


def test_maps_that_show_nothing_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = counterexamples.scenario("no-target-reward.toml")
    monkeypatch.setattr(counterexamples, "scenario", lambda _: scenario)
    with pytest.raises(AssertionError, match="no longer more than ten times the risk"):
        claims.risky_in_eight_directions()
    monkeypatch.setattr(claims, "ENORMOUS", 0.1)
    with pytest.raises(AssertionError, match="are the fewest"):
        claims.fewest_moves()


def test_the_check_runs_on_a_few_maps() -> None:
    finding = claims._check_c34.check(Evidence(samples=world(learner=4.0, maps=2)))
    assert finding.counterexamples == (claims.LONGER, claims.RISKY)
    assert finding.answers == (Answer.FAILS, Answer.OPEN)
    assert finding.rows[-1].size == "x 1.22"

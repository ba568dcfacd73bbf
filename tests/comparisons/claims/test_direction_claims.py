"""C34, A2D's and Q-Learning's risk and its causes: on worlds where the answer is known, and on real maps."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS, RADII
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.paper import direction_claims as claims
from cgla_graph.comparisons.claims.paper.flights import K, fly_alone, measures
from cgla_graph.comparisons.claims.paper.learners import LEARNERS, UNDISCOUNTED
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import solve

CLAIM = catalogue.claims()["C34"]
MAPS = 25
A2D, RISKIER, RISKIEST, BECAUSE = "A2D's", "Q-Learning's risk > CGLA's", "all others'", "because of"


def flights(risks: dict[str, float], *, others: float = 1.0, maps: int = MAPS) -> list[Record]:
    """Make up flights: planners have so many times the risk of CGLA, those that are not named `others` times."""
    rng = np.random.default_rng(1)
    records: list[Record] = []
    for number in range(maps):
        for name in (*LEARNERS, *claims.OTHERS):
            for cell in CELLS if name == claims.CGLA else [{"radius": radius} for radius in RADII]:
                factor = 1.0 if name == claims.CGLA else risks.get(name, others)
                risk = factor * rng.lognormal(0.0, 0.3)
                numbers = {"risk_sum": risk, "length": 1.2, "max_risk": 0.1}
                records.append({"map": number, "planner": name, **cell, "arrived": True, **numbers})
    return records


def plans(*, directions: float, objective: float, training: float, discount: float = 1.0) -> list[Record]:
    """Make up risk sums with given effects."""
    rng = np.random.default_rng(1)
    records: list[Record] = []
    for number in range(MAPS):
        base = rng.lognormal(0.0, 1.0)
        arms = [
            ("any", K, "exact", 1.0),
            ("eight", K, "exact", directions),
            ("eight", 0.0, "exact", directions * objective),
            ("eight", K, UNDISCOUNTED, directions * training),
        ]
        arms += [("eight", K, name, directions * training * discount) for name in LEARNERS if name != UNDISCOUNTED]
        for directed, k, method, factor in arms:
            risk = base * factor * rng.lognormal(0.0, 0.1)
            records.append({"map": number, "directions": directed, "k": k, "method": method, "risk_sum": risk})
    return records


def check(risks: dict[str, float], *, maps: int = MAPS, others: float = 1.0, **effects: float) -> Finding:
    """Check C34 in a made-up world."""
    effects = {"directions": 3.0, "objective": 1.0, "training": 1.0, **effects}
    samples = {
        "q-learning-gamma": Samples(flights(risks, others=others, maps=maps)),
        "directions": Samples(plans(**effects)),
    }
    return CLAIM.check(Evidence(samples=samples))


def verdicts(finding: Finding, statement: str) -> set[Verdict]:
    return {part.verdict for part in finding.parts if statement in part.statement}


def test_a_claim_that_holds_is_supported() -> None:
    finding = check(dict.fromkeys(LEARNERS, 4.0), others=2.0)
    assert finding.verdicts == (Verdict.SUPPORTED,)
    assert {part.verdict for part in finding.beside} == {Verdict.REFUTED, Verdict.PROVED}


def test_the_opposite_is_contradicted() -> None:
    finding = check(dict.fromkeys(LEARNERS, 0.4), others=0.6, directions=1.0, objective=4.0)
    assert finding.verdicts == (Verdict.CONTRADICTED,)


def test_no_effect_shows_nothing() -> None:
    finding = check({}, directions=1.0)
    assert Verdict.SUPPORTED not in finding.verdicts
    assert verdicts(finding, A2D) == {Verdict.UNDECIDED}


def test_few_maps_decide_nothing() -> None:
    finding = check(dict.fromkeys(LEARNERS, 4.0), others=2.0, maps=5)
    for statement in (A2D, RISKIER, RISKIEST):
        assert verdicts(finding, statement) == {Verdict.UNDECIDED}
    assert "1 more maps could show" in finding.parts[0].result


def test_one_planner_that_is_riskier_is_enough_to_contradict() -> None:
    finding = check({**dict.fromkeys(LEARNERS, 4.0), claims.FBCRI: 9.0})
    assert verdicts(finding, RISKIER) == {Verdict.SUPPORTED}
    assert verdicts(finding, RISKIEST) == {Verdict.CONTRADICTED}


def test_a_learner_of_its_own_kind_has_its_own_verdict() -> None:
    finding = check({claims.BLIND: 9.0, UNDISCOUNTED: 0.5}, others=2.0)
    found = {part.condition: part.verdict for part in finding.parts if part.statement.endswith(RISKIEST)}
    assert found["for gamma = 0.95 with reward 100"] is Verdict.SUPPORTED
    (other,) = (condition for condition, verdict in found.items() if verdict is Verdict.CONTRADICTED)
    assert "gamma = 1" in other


@pytest.mark.parametrize("cause", ["objective", "training", "discount"])
def test_causes_are_told_apart(cause: str) -> None:
    finding = check({}, **{"directions": 1.5, cause: 4.0})
    found = {part.condition: part.verdict for part in finding.parts if BECAUSE in part.statement}
    undiscounted = {verdict for condition, verdict in found.items() if UNDISCOUNTED in condition}
    if cause == "discount":
        assert undiscounted == {Verdict.SUPPORTED}
        assert Verdict.CONTRADICTED in found.values()
    else:
        assert set(found.values()) == {Verdict.CONTRADICTED}


@few
@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.floats(0.1, 10.0))
def test_factorial_finds_the_effects_that_were_put_in(
    directions: float, objective: float, training: float, discount: float
) -> None:
    put_in = {"directions": directions, "objective": objective, "training": training}
    effects = claims.factorial(Samples(plans(**put_in, discount=discount)))
    for name, values in effects.items():
        assert np.median(values) == pytest.approx(math.log(put_in.get(name, discount)), abs=0.15)


def test_factorial_leaves_out_maps_without_a_way() -> None:
    records = [dict(record) for record in plans(directions=2.0, objective=2.0, training=2.0)]
    records[3]["risk_sum"] = None
    assert {len(values) for values in claims.factorial(Samples(records)).values()} == {MAPS - 1}


def test_a_map_that_shows_nothing_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    other = counterexamples.scenario("no-target-reward.toml")
    monkeypatch.setattr(counterexamples, "scenario", lambda _: other)
    with pytest.raises(AssertionError, match="no longer more than ten times the risk"):
        claims.risky_in_eight_directions()


def test_a_reward_that_is_too_small_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "ENORMOUS", 3.0)
    with pytest.raises(AssertionError, match="are the fewest"):
        claims.fewest_moves()


def test_plans_obey_what_is_known() -> None:
    for seed in range(3):
        found = {(one["directions"], one["k"], one["method"]): one for one in claims.directions.sample(seed)}
        best = found["eight", K, "exact"]
        assert found["any", K, "exact"]["cost"] <= best["cost"] * (1.0 + 1e-12)
        assert all(best["cost"] <= found["eight", K, name]["cost"] * (1.0 + 1e-12) for name in LEARNERS)
        assert found["eight", K, claims.BLIND]["length"] == pytest.approx(0.8 * math.sqrt(2.0))


@pytest.mark.slow
def test_real_flights_are_one_a_cell_and_do_not_depend_on_when_plans_are_made() -> None:
    samples = Samples([{"map": 7, **record} for record in claims.q_learning_gamma.sample(7)])
    for name, other in product(LEARNERS, claims.OTHERS):
        assert len(claims.riskier(samples, name, other)) == (len(CELLS) if other == claims.CGLA else len(RADII))
    field = random_scenario(7, k=K).problem.field
    for name, solver in claims._rivals().items():
        flights = [measures(fly_alone(field, k=K, solver=solver, replan=replan)) for replan in ("change", "tick")]
        assert flights[0]["arrived"] == flights[1]["arrived"], name
        if flights[0]["arrived"] and not (name in LEARNERS and LEARNERS[name][0] < 1.0):
            assert flights[0]["risk_sum"] == pytest.approx(flights[1]["risk_sum"], rel=1e-6), name


def test_the_stored_map_costs_little_more() -> None:
    problem = counterexamples.scenario(claims.RISKY).problem
    costs = [solve(problem, name, resolution=20).cost for name in ("eight-direction", "cgla")]
    assert 1.0 < costs[0] / costs[1] < 1.0824

"""The claims about the model of risk: their answers, and that a broken model has none."""

import dataclasses

import numpy as np
import pytest
import shapely

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Answer, Claim
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.paper import model_claims
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.risk import Reading, RiskField, Threat

QUICK = Evidence(Scale(quick=True))
CHECKS = {claim.id: claim.check for claim in vars(model_claims).values() if isinstance(claim, Claim)}


@pytest.mark.parametrize(
    ("claim", "answers", "holds", "fails"),
    [
        ("C1", [Answer.DEPENDS], "if no peak exceeds 1", "with the peak of Eq. 1 as printed"),
        ("C3", [Answer.DEPENDS] * 2, "if F itself is set to 1", "as f >> 1 in Eq. 2"),
        ("C4", [Answer.DEPENDS], "as printed for sigma of 0.05 to 0.2", "up to 0.01"),
        ("C6", [Answer.HOLDS], "", ""),
        ("C7", [Answer.DEPENDS], "for F of all that is known", "as Eq. 5 is printed"),
    ],
)
def test_an_answer_is_given_with_its_condition(claim: str, answers: list[Answer], holds: str, fails: str) -> None:
    rows = CHECKS[claim](QUICK).rows
    assert [row.answer for row in rows] == answers
    assert not holds or f"holds {holds}" in rows[0].where
    assert not fails or f"fails {fails}" in rows[0].where


def test_the_membership_reading_alone_is_a_probability() -> None:
    rows = CHECKS["C1"](QUICK).tables[0].rows
    assert [row[0] for row in rows] == ["membership", "literal", "sigma2", "gauss2d"]
    usual, *others = np.array([row[3:] for row in rows], dtype=float)
    assert (usual == 0.0).all()
    assert all(outside > 0.9 and negative > 0.0 for outside, negative in others)


def test_a_field_that_adds_instead_of_combining_has_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    def added(self: RiskField, points: object) -> object:
        where = np.asarray(points, dtype=float)
        return sum(
            t.peak * np.exp(-((where - (t.x, t.y)) ** 2).sum(axis=-1) / (2.0 * t.spread**2)) for t in self.threats
        )

    monkeypatch.setattr(RiskField, "density", added)
    with pytest.raises(AssertionError, match=r"although no peak is above 1|the rise of F"):
        CHECKS["C1"](QUICK)


def test_weights_that_are_broken_have_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    weights = CostModel.weights
    monkeypatch.setattr(CostModel, "weights", lambda self, a, b: weights(self, a, b) - 0.2)
    with pytest.raises(AssertionError, match="not positive"):
        CHECKS["C1"](QUICK)
    monkeypatch.setattr(CostModel, "weights", lambda self, a, b: weights(self, a, b) + 1e-9 * np.asarray(a)[:, 0])
    with pytest.raises(AssertionError, match="there and back"):
        CHECKS["C6"](QUICK)
    monkeypatch.setattr(CostModel, "weights", lambda self, a, b: weights(self, a, b) ** 1.01)
    with pytest.raises(AssertionError, match="the parts of a segment"):
        CHECKS["C7"](QUICK)


@pytest.mark.parametrize(("factor", "message"), [(1.1, r"outside \[1, 20\]"), (0.5, "less than ten times as much")])
def test_ratios_that_no_integral_gives_have_no_answer(
    factor: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    weighed, lengths = model_claims.weights_from_origin, np.hypot(*model_claims.paper_lattice().points.T)

    def broken(reading: Reading, sigma: float) -> tuple[FloatArray, FloatArray]:
        low, high = weighed(reading, sigma)
        return low, lengths + factor * (high - lengths)

    monkeypatch.setattr(model_claims, "weights_from_origin", broken)
    with pytest.raises(AssertionError, match=message):
        CHECKS["C4"](QUICK)


@pytest.mark.parametrize("claim", CHECKS)
def test_a_stored_map_that_shows_nothing_is_noticed(claim: str, monkeypatch: pytest.MonkeyPatch) -> None:
    stored = counterexamples.scenario("one-sided-sum.toml")
    harmless = dataclasses.replace(
        stored.problem, start=(0.1, 0.5), goal=(0.9, 0.5), field=RiskField([Threat(0.5, 0.5, 0.1)])
    )
    changed = dataclasses.replace(stored, problem=harmless)
    monkeypatch.setattr(counterexamples, "scenario", lambda _: changed)
    with pytest.raises(AssertionError, match="the stored map does not show"):
        CHECKS[claim](QUICK)


def test_a_no_fly_area_with_a_way_around_it_shows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = counterexamples.scenario
    wall = scenario("no-fly-wall.toml")
    problem = dataclasses.replace(wall.problem, no_fly=shapely.box(0.45, 0, 0.55, 0.8))
    stored = {"no-fly-wall.toml": dataclasses.replace(wall, problem=problem)}
    monkeypatch.setattr(counterexamples, "scenario", lambda name: stored.get(name) or scenario(name))
    with pytest.raises(AssertionError, match="the stored map has a way around"):
        CHECKS["C3"](QUICK)


@pytest.mark.slow
def test_a_wall_is_crossed_up_to_a_value_that_its_thickness_gives(monkeypatch: pytest.MonkeyPatch) -> None:
    # of zero thickness, the way around over (0.5, 0.9) is two legs of 0.4 by 0.8
    around = 2.0 * float(np.hypot(0.4, 0.8)) - 0.8
    assert model_claims._least_value(0.001) == pytest.approx(around / (10.0 * 0.001), rel=0.03)
    best = model_claims._best
    monkeypatch.setattr(model_claims, "_best", lambda *given: (1.1 * best(*given)[0], best(*given)[1]))
    with pytest.raises(AssertionError, match="the least value of F is another one"):
        model_claims._least_value(0.01)

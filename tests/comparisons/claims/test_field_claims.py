"""The claims about the model: their verdicts, and that a broken model has none."""

import dataclasses

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.risk import RiskField, Threat

QUICK = Evidence(Scale(quick=True))
CHECKS = {claim.id: claim.check for claim in catalogue.claims().values()}


def test_the_membership_reading_alone_is_a_probability() -> None:
    rows = CHECKS["C1"](QUICK).tables[0].rows
    assert [row[0] for row in rows] == ["membership", "literal", "sigma2", "gauss2d"]
    shares = [row[3] for row in rows]
    assert shares[0] == 0.0
    assert all(isinstance(share, float) and share > 0.9 for share in shares[1:])


def test_a_field_that_adds_instead_of_combining_has_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    def added(self: RiskField, points: object) -> object:
        where = np.asarray(points, dtype=float)
        return sum(
            t.peak * np.exp(-((where - (t.x, t.y)) ** 2).sum(axis=-1) / (2.0 * t.spread**2)) for t in self.threats
        )

    monkeypatch.setattr(RiskField, "density", added)
    for claim in ("C1", "C2"):
        with pytest.raises(AssertionError):
            CHECKS[claim](QUICK)


def test_weights_that_are_broken_have_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    weights, matrix = CostModel.weights, CostModel.matrix
    monkeypatch.setattr(CostModel, "weights", lambda self, a, b: weights(self, a, b) + 1e-9 * np.asarray(a)[:, 0])
    with pytest.raises(AssertionError, match="there and back"):
        CHECKS["C6"](QUICK)
    monkeypatch.setattr(CostModel, "weights", lambda self, a, b: weights(self, a, b) ** 1.01)
    with pytest.raises(AssertionError, match="the parts of a segment"):
        CHECKS["C7"](QUICK)
    monkeypatch.setattr(CostModel, "matrix", lambda *given: matrix(*given) - 0.2)
    with pytest.raises(AssertionError, match="not positive"):
        CHECKS["C5"](QUICK)


def test_a_stored_map_that_shows_nothing_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    stored = counterexamples.scenario("printed-peaks.toml")
    harmless = RiskField([Threat(0.5, 0.5, 0.1)])
    changed = dataclasses.replace(stored, problem=dataclasses.replace(stored.problem, field=harmless))
    monkeypatch.setattr(counterexamples, "scenario", lambda _: changed)
    for claim in ("C1", "C2", "C3", "C5"):
        with pytest.raises(AssertionError, match="the stored map does not show"):
            CHECKS[claim](QUICK)

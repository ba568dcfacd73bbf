"""The claims about the model: their verdicts, and that a broken model has none."""

import dataclasses

import numpy as np
import pytest
import shapely

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


@pytest.mark.parametrize("claim", ["C1", "C2", "C3", "C4", "C5", "C6", "C7"])
def test_a_stored_map_that_shows_nothing_is_noticed(claim: str, monkeypatch: pytest.MonkeyPatch) -> None:
    stored = counterexamples.scenario("one-sided-sum.toml")
    harmless = dataclasses.replace(
        stored.problem, start=(0.1, 0.5), goal=(0.9, 0.5), field=RiskField([Threat(0.5, 0.5, 0.1)])
    )
    changed = dataclasses.replace(stored, problem=harmless)
    monkeypatch.setattr(counterexamples, "scenario", lambda _: changed)
    with pytest.raises(AssertionError, match="the stored map does not show"):
        CHECKS[claim](QUICK)


PROPER, PRINTED = "proved if no peak exceeds 1", "refuted as Eq. 1 is printed"


@pytest.mark.parametrize(
    ("claim", "headline"),
    [
        ("C1", f"{PROPER}; {PRINTED}"),
        ("C2", f"{PROPER}; {PRINTED}"),
        (
            "C3",
            (
                "F a probability, weights positive: refuted as a value f >> 1 in Eq. 2; "
                "F a probability, weights positive: proved if F itself is set, to 1; "
                "weights positive: proved if F itself is set, to any value; "
                "no best path crosses: refuted for one finite value on all maps; "
                "no best path crosses: proved from some value on, on a lattice with a way around"
            ),
        ),
        (
            "C4",
            (
                "proved as Eq. 1 is printed, for sigma of 0.05 to 0.2; refuted for peak 1 and sigma up to 0.1; "
                "not testable for peak 1 and broader threats (sigma = 0.2)"
            ),
        ),
        ("C5", f"{PROPER}; {PRINTED}"),
        ("C6", "proved as printed, an integral; refuted for sums over one end of each part"),
        (
            "C7",
            (
                "proved for one UAV; proved for several UAVs, if F is of all that they know together; "
                "refuted as Eq. 5 is printed, its maximum over several UAVs"
            ),
        ),
        ("C26", "proved"),
        ("C27", "not testable"),
    ],
)
def test_what_holds_under_a_condition_is_said_with_it(claim: str, headline: str) -> None:
    assert CHECKS[claim](Evidence(Scale(maps=8))).rulings == tuple(headline.split("; "))


def test_the_thinner_a_no_fly_area_the_greater_its_value_has_to_be() -> None:
    rows = CHECKS["C3"](QUICK).tables[0].rows
    products = [float(str(width)) * float(str(value)) for width, value in rows]
    # the way around costs 1 more, which K = 10 times value times thickness has to exceed
    assert products == pytest.approx([0.0989] * 3, rel=0.03)


def test_a_no_fly_area_with_a_way_around_it_shows_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = counterexamples.scenario
    wall = scenario("no-fly-wall.toml")
    open_wall = dataclasses.replace(
        wall, problem=dataclasses.replace(wall.problem, no_fly=shapely.box(0.45, 0, 0.55, 0.8))
    )
    monkeypatch.setattr(
        counterexamples, "scenario", lambda name: open_wall if name == "no-fly-wall.toml" else scenario(name)
    )
    with pytest.raises(AssertionError, match="the stored map has a way around"):
        CHECKS["C3"](QUICK)

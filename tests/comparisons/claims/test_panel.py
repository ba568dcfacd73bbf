"""The panel: maps of each kind, cells, varied settings, and what is measured in them."""

from itertools import pairwise, product

import numpy as np
import pytest
from scipy.integrate import quad

from cgla_graph.comparisons.claims.claim import Answer, Basis, Row
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel.flights import RIM, fly, length_at_rim
from cgla_graph.comparisons.claims.panel.settings import (
    BASES,
    FACTORS,
    GOALS,
    KINDS,
    MAPS,
    MAPS_A_KIND,
    RULES,
    SPREADS,
    START,
    PanelMap,
    cells,
    seeds_of,
)
from cgla_graph.comparisons.claims.panel.single_uav import CONSTANTS, FLOWN, single_uav
from cgla_graph.comparisons.claims.paper import bcv_claims, direction_claims, weight_claims
from cgla_graph.comparisons.claims.rule import VARIED


@pytest.fixture(scope="module")
def records() -> list[Record]:
    """Measure on one map of the first kind, which has a base cell."""
    return list(single_uav.sample(PanelMap(3_000_000)))


def test_maps_are_of_their_kind_and_no_two_studies_share_one() -> None:
    seeds = {seed for study in (1, 2) for kind in KINDS for seed in seeds_of(kind, study, MAPS)}
    assert len(seeds) == 2 * len(KINDS) * MAPS
    assert MAPS < MAPS_A_KIND
    for kind in KINDS:
        one = PanelMap(seeds_of(kind, 1, 3)[2])
        assert one.kind == kind
        threats = one.field.threats
        assert len(threats) == kind.threats
        low, high = SPREADS[kind.spread]
        assert all(low <= threat.spread <= high for threat in threats)
        assert one.goal == GOALS[kind.goal]


@pytest.mark.slow
def test_every_cell_is_flown_once_by_every_planner(records: list[Record]) -> None:
    flown = [(one["planner"], one["radius"], one["k"]) for one in records if one["mode"] == "flown" and not one[VARIED]]
    assert len(flown) == len(set(flown)) == len(FLOWN) * len(cells("radius", "k"))
    # a planner without K flies once, and costs by K
    bcv = Samples(records).where(planner="bcv-style", radius=FACTORS["radius"][0], mode="flown", **{VARIED: ""})
    assert len({(one["length"], one["risk"]) for one in bcv}) == 1
    assert all(one["cost"] == pytest.approx(one["length"] + one["k"] * one["risk"]) for one in bcv)


def test_a_varied_setting_has_both_sides_of_each_pair(records: list[Record]) -> None:
    varied = {}
    for one in records:
        if one.get(VARIED):
            varied.setdefault((one[VARIED], one["k"]), set()).add(one["planner"])
            assert one["radius"] == BASES[0]["radius"]
    rules = {f"{name} {value}" for name, value in RULES.items()}
    assert len(varied) == (len(rules) + len(CONSTANTS)) * len(FACTORS["k"])
    for (name, _), planners in varied.items():
        assert "cgla" in planners
        assert len(planners) == (len(FLOWN) if name in rules else 2)


def test_measurements_are_those_of_an_independent_integration(records: list[Record]) -> None:
    """Along the flown path, by quadrature of the field as the paper defines it."""
    one = PanelMap(3_000_000)
    case = {"mode": "flown", "planner": "cgla", "radius": 0.2, "k": 50.0, VARIED: ""}
    (record,) = Samples(records).where(**case)
    flight = fly({"a": START}, one.field, one.goal, k=50.0, radius=0.2).uavs["a"]
    path = np.asarray(flight.path)

    def density(x: float, y: float) -> float:
        safe = [1.0 - np.exp(-((x - t.x) ** 2 + (y - t.y) ** 2) / (2.0 * t.spread**2)) for t in one.field.threats]
        return float(1.0 - np.prod(safe))

    risk = length = rim = exposed = 0.0
    for (x, y), (u, v) in pairwise(path):
        size = float(np.hypot(u - x, v - y))
        length += size
        risk += size * quad(lambda t: density(x + t * (u - x), y + t * (v - y)), 0.0, 1.0, epsabs=1e-12)[0]  # noqa: B023
        spots = [density(x + t * (u - x), y + t * (v - y)) for t in (np.arange(200) + 0.5) / 200.0]
        rim += size * float(np.mean(np.array(spots) > RIM))
        exposed += size * float(np.mean(np.array(spots) > 0.1))
    assert record["length"] == pytest.approx(length, rel=1e-12)
    assert record["risk"] == pytest.approx(risk, rel=1e-8, abs=1e-10)
    assert record["cost"] == pytest.approx(length + 50.0 * risk, rel=1e-9)
    assert record["rim"] == pytest.approx(rim, abs=2e-3)
    assert record["exposure"] == pytest.approx(exposed, abs=2e-3)
    assert length_at_rim(one.field, path) == record["rim"]


def fabricated(risk: float, length: float) -> Samples:
    """Make records in which CGLA with more K has less risk, and others are so many times as risky and as long."""
    rng, found = np.random.default_rng(1), []
    others = {"eight-direction": 1.0, **dict.fromkeys(("bcv-style", "bcv-style, risk_aversion 0"), 1.0)}
    for kind, number in product(KINDS, range(20)):
        for cell in cells("radius", "k"):
            for planner in ("cgla", *others):
                mine = planner == "cgla"
                noise = 1.0 + 0.01 * rng.random()
                found.append(
                    {
                        **kind._asdict(),
                        "map": MAPS_A_KIND * KINDS.index(kind) + number,
                        **cell,
                        "planner": planner,
                        "mode": "flown",
                        VARIED: "",
                        "arrived": mine or number % 2 == 0,
                        "risk": (1.0 if mine else risk) * noise / cell["k"],
                        "max_risk": noise / cell["k"],
                        "exposure": 0.1 if mine else 0.2 * noise,
                        "length": (1.0 if mine else length) * noise * cell["k"] ** 0.05,
                        "cost": (1.0 if mine else risk) * noise,
                    }
                )
        found += [{**one, "mode": "known"} for one in found if one["map"] == found[-1]["map"] and one["radius"] == 0.1]
    return Samples(found)


@pytest.mark.slow
def test_bcv_style_is_stuck_where_cgla_arrives() -> None:
    assert bcv_claims.stuck_row().answer is Answer.HOLDS


@pytest.mark.slow
def test_claims_about_single_uavs_read_the_panel(monkeypatch: pytest.MonkeyPatch) -> None:
    stuck = Row("can get stuck where CGLA arrives", Answer.HOLDS, Basis.COUNTEREXAMPLE)
    monkeypatch.setattr(bcv_claims, "stuck_row", lambda _: stuck)
    evidence = Evidence(Scale(maps=4, quick=True), {"single-uav": fabricated(3.0, 0.97)})
    c32 = {row.statement: row for row in bcv_claims._check_c32.check(evidence).rows}
    assert c32["less risk (length only)"].answer.label == "holds"
    assert c32["less risk (length only)"].size.startswith("x 0.33")
    assert c32["shorter (length only)"].answer.label == "fails"
    assert c32["length within 10% (length only)"].answer.label == "holds"
    c26 = {row.statement: row.answer.label for row in direction_claims._check_c26.check(evidence).rows}
    assert c26["risk: greater in flight"] == "holds"
    assert c26["length: greater in flight"] == "fails"
    c28 = {row.statement: row.answer.label for row in weight_claims._check_c28.check(evidence).rows}
    assert c28["less risk in flight, K = 50 against 10"] == "holds"
    assert c28["less risk in flight on every map"] == "fails"
    assert [row.answer.label for row in bcv_claims._check_c33.check(evidence).rows] == ["holds"] * 5


def test_optima_that_break_the_exchange_argument_are_found() -> None:
    optima = np.array([weight_claims.optima_over_k(PanelMap(seed).problem(1.0)) for seed in (0, 1)])
    risk, length, cost = np.moveaxis(optima, 2, 0)
    weight_claims.require_exchange(risk, length, cost)
    for broken in ((risk[:, ::-1], length, cost), (risk, length[:, ::-1], cost), (risk, length, cost**3)):
        with pytest.raises(AssertionError, match="exchange argument"):
            weight_claims.require_exchange(*broken)

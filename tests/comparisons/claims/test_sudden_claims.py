"""The checks of C37 and C38: their answers on samples of known truth, and what is measured of sudden threats."""

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy import integrate

import cgla_graph as cg
from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.claim import Answer, Finding
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel import sudden
from cgla_graph.comparisons.claims.panel.settings import FACTORS, PANEL, PanelMap, seeds_of
from cgla_graph.comparisons.claims.paper import sudden_claims as claims
from cgla_graph.mission.records import UavFlight
from cgla_graph.model.risk import Threat

BY_ID = catalogue.claims()
MAPS = 24


def sample(risks: dict[float, float], met: float = 0.2, *, arrived: bool = True) -> Samples:
    """Return flights on which greater K have `risks` times the risk of K = 10, by radius, and less is met ahead."""
    rng = np.random.default_rng(1)
    records: list[dict[str, Any]] = []
    for kind in sudden.sudden_threats.kinds(PANEL):
        for seed in seeds_of(kind, 1, MAPS):
            levels = {**PanelMap(seed).levels, "varied": "", "arrived": arrived}
            for (radius, ratio), high in product(risks.items(), sudden.HIGH_KS):
                cell = {**levels, "event": "Fig. 6", "radius": radius, "high": high}
                values = rng.uniform(0.9, 1.1, 2).tolist()
                records.append({**cell, "k": sudden.LOW_K, "risk": 1.0, "length": 1.0})
                records.append({**cell, "k": high, "risk": ratio * values[0], "length": 1.5 * values[1]})
            for radius, k, ahead in product(risks, FACTORS["k"], sudden.SPREADS_AHEAD):
                cell = {**levels, "event": "ahead", "radius": radius, "k": k, "ahead": ahead}
                value = float(rng.uniform(0.9, 1.1))
                records += [{**cell, "evades": True, "met": met * value}, {**cell, "evades": False, "met": 1.0}]
    return Samples(records)


def check(claim: str, found: Samples) -> Finding:
    return BY_ID[claim].check(Evidence(samples={"sudden-threats": found}))


def test_c37_turns_round_where_the_sample_does() -> None:
    risk, length = check("C37", sample(dict.fromkeys(FACTORS["radius"], 0.7))).rows
    assert [risk.answer, length.answer] == [Answer.HOLDS, Answer.HOLDS]
    assert (risk.printed, length.printed) == ("x 0.774", "x 1.05")
    risk, length = check("C37", sample({0.1: 1.5, 0.2: 0.7, 0.4: 0.6})).rows
    assert [risk.answer, length.answer] == [Answer.DEPENDS, Answer.HOLDS]
    assert "fails at OR 0.1" in risk.where


def test_c38_fails_on_top_of_the_uav_and_holds_ahead() -> None:
    found = sample(dict.fromkeys(FACTORS["radius"], 1.0))
    low, ahead, arrives = check("C38", found).rows
    assert [low.answer, ahead.answer, arrives.answer] == [Answer.FAILS, Answer.HOLDS, Answer.DEPENDS]
    assert float(ahead.size.split()[1]) == pytest.approx(0.2, abs=0.01)
    assert arrives.where == "as C17"
    assert check("C38", sample(dict.fromkeys(FACTORS["radius"], 1.0), met=2.0)).rows[1].answer is Answer.FAILS


def test_a_uav_that_does_not_arrive_is_noticed() -> None:
    with pytest.raises(AssertionError, match="did not arrive"):
        check("C38", sample(dict.fromkeys(FACTORS["radius"], 1.0), arrived=False))


def test_a_bound_above_the_stored_risk_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "half_crossing", lambda spread, distance: 2.0 * spread + 0.0 * distance)
    with pytest.raises(AssertionError, match="no longer shows a threat on top"):
        claims.require_on_top()


def test_half_a_crossing_is_its_integral() -> None:
    expected, _ = integrate.quad(lambda r: math.exp(-0.5 * (r / 0.07) ** 2), 0.0, 0.15)
    assert claims.half_crossing(0.07, 0.15) == pytest.approx(expected, rel=1e-9)


def path_integral(threat: Threat, flight: UavFlight) -> float:
    """Recompute the risk of a threat after the first tick, by the trapezoid rule on fine pieces of the path."""
    total = 0.0
    for a, b in zip(flight.path[flight.times > 0.5], flight.path[flight.times > 0.5][1:], strict=False):
        spots = np.linspace(a, b, 400)
        squares = ((spots - (threat.x, threat.y)) ** 2).sum(axis=1)
        total += float(np.trapezoid(np.exp(-0.5 * squares / threat.spread**2))) * math.dist(a, b) / 399
    return total


def test_a_map_has_each_case_once_with_what_is_recomputed(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, levels in {"k": (10.0,), "radius": (0.2,)}.items():
        monkeypatch.setitem(FACTORS, name, levels)  # type: ignore[arg-type]
    flown = []

    def fly(*given: Any, **settings: Any) -> Any:  # noqa: ANN401 - as `fly` takes them
        flight = real(*given, **settings)
        flown.append((flight.uavs["a"], [one.threat for one in settings["timed"]]))
        return flight

    real = sudden.fly
    monkeypatch.setattr(sudden, "fly", fly)
    map_ = PanelMap(96_000_000)
    records = sudden.sudden_threats.sample(map_)
    names = ("event", "varied", "radius", "high", "k", "ahead", "evades")
    cases = [tuple(one.get(name) for name in names) for one in records]
    # one cell and three rules with two flights for each greater K; three distances, evaded or not
    assert len(set(cases)) == len(cases) == 4 * 2 * 3 + 3 * 2

    ahead = [one for one in records if one["event"] == "ahead"]
    undisturbed = flown[4][0]
    east, north = undisturbed.trace[1] - undisturbed.trace[0]
    for (flight, (threat,)), evades, flies_on in zip(flown[5:8], ahead[::2], ahead[1::2], strict=True):
        apart = np.subtract((threat.x, threat.y), undisturbed.trace[1])
        assert math.hypot(*apart) == pytest.approx(evades["ahead"] * threat.spread)
        assert math.atan2(apart[1], apart[0]) == pytest.approx(math.atan2(north, east))
        assert (evades["evades"], flies_on["evades"]) == (True, False)
        assert evades["met"] == pytest.approx(path_integral(threat, flight), rel=1e-4, abs=1e-9)
        assert flies_on["met"] == pytest.approx(path_integral(threat, undisturbed), rel=1e-4, abs=1e-9)
    assert records[0]["risk"] == flown[0][0].risk
    assert [(one["high"], one["k"]) for one in records[:2]] == [(50.0, 10.0), (50.0, 50.0)]
    (threat,) = flown[0][1]
    assert (threat.x, threat.y, threat.spread) == (0.6, 0.5, pytest.approx(0.0375))


def test_what_is_flown_past_the_threat_of_fig_6_is_held_against_a_proof() -> None:
    table = claims.against_full_knowledge()
    assert [row[0] for row in table.rows] == ["10", "100"]
    for (problem, flown), row in zip(claims.fig_6_in_time(), table.rows, strict=True):
        assert row[1] == pytest.approx(
            problem.k * problem.evaluate(flown).risk + problem.evaluate(flown).ground_distance
        )
        assert flown[-1, 0] == pytest.approx(problem.evaluate(flown).ground_distance / 0.02)
    assert [row[5] for row in table.rows] == [pytest.approx(1.126, abs=1e-3), pytest.approx(1.433, abs=1e-3)]


@pytest.mark.slow
def test_the_costs_of_those_who_know_of_the_threat_are_proven() -> None:
    for problem, _ in claims.fig_6_in_time():
        best, least = claims.KNOWING[problem.k]
        plan = cg.solve(problem, tolerance=0.02, max_cells=1_000_000)
        assert plan.lower_bound >= least
        assert plan.cost <= best

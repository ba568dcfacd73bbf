"""The checks of C39, C41, C42, C45 and C48 in worlds where their answers are known."""

from collections.abc import Callable, Mapping
from itertools import product
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Answer, Finding
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.panel.one_matrix import DELAYS
from cgla_graph.comparisons.claims.panel.settings import KINDS, cells
from cgla_graph.comparisons.claims.panel.teams import FEW_THREATS, HALF, SECOND_STARTS, SIDE, STEPNUMS, fraction
from cgla_graph.comparisons.claims.paper import obstacle_claims, sharing_claims
from cgla_graph.solvers import get

#: How often something happens, or by which factor, in a case.
World: TypeAlias = Callable[[Mapping[str, Any]], float]
MAPS = 20


def happening(often: World, measure: str, kinds: tuple[Any, ...], own: list[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Draw how often something happens on maps of some kinds, in their three settings with settings of one's own."""
    rng = np.random.default_rng(0)
    return [
        {"map": MAPS * number + map_, **case, measure: bool(rng.random() < often(case))}
        for number, kind in enumerate(kinds)
        for setting, one in product(fraction(number % 4), own)
        for case in [{**kind._asdict(), **setting, "varied": "", **one}]
        for map_ in range(MAPS)
    ]


def obstacles(often: World) -> Samples:
    """Return a world in which two UAVs collide so often, and obstacles end all conflicts if seldom with 3 steps."""
    own = [{"stepnum": stepnum} for stepnum in ("none", *STEPNUMS)]
    records = happening(often, "collided", HALF, own)
    return Samples([{**record, "avoided": not record["collided"]} for record in records])


def greater(factor: World, own: list[Mapping[str, Any]], kinds: tuple[Any, ...] = HALF) -> Samples:
    """Return a world in which sums over two UAVs are so many times as great in some cases."""
    rng, records = np.random.default_rng(0), []
    for number, kind in enumerate(kinds):
        settings = cells("radius", "k") if kinds == KINDS else fraction(number)
        for map_, setting, one in product(range(15), settings, own):
            case = {**kind._asdict(), **setting, "varied": "", **one}
            value = float(factor(case) * rng.uniform(0.99, 1.01))
            records.append({"map": MAPS * number + map_, **case, "risk": value, "length": value, "cost": value})
    return Samples(records)


def check(claim: str, samples: Samples) -> Finding:
    found = catalogue.claims()[claim]
    return found.check(Evidence(Scale(quick=True), dict.fromkeys(found.experiments, samples)))


def answers(finding: Finding) -> list[Answer]:
    return [row.answer for row in finding.rows]


HOLDS, FAILS, DEPENDS, UNTESTABLE = Answer.HOLDS, Answer.FAILS, Answer.DEPENDS, Answer.NOT_TESTABLE


def test_three_steps_ahead_are_held_against_none_and_five() -> None:
    best = check("C39", obstacles(lambda case: 0.05 if case["stepnum"] == 3 else 0.9))
    worst = check("C39", obstacles(lambda case: 0.9 if case["stepnum"] == 3 else 0.05))
    assert (answers(best), answers(worst)) == ([HOLDS] * 2, [FAILS] * 2)
    assert "% against" in best.rows[0].size
    wide = check(
        "C39", obstacles(lambda case: 0.9 if case["stepnum"] != 3 and case["obstacle_spread"] < 0.05 else 0.05)
    )
    assert answers(wide) == [DEPENDS] * 2
    assert all("obstacle spread 0.05" in row.where for row in wide.rows)


def test_obstacles_avoid_conflicts_or_cause_them(monkeypatch: pytest.MonkeyPatch) -> None:
    words = obstacle_claims.pairs_that_collide()
    monkeypatch.setattr(obstacle_claims, "pairs_that_collide", lambda: words)
    good = check("C41", obstacles(lambda case: 0.9 if case["stepnum"] == "none" else 0.05))
    bad = check("C41", obstacles(lambda case: 0.05 if case["stepnum"] == "none" else 0.9))
    assert answers(good) == [FAILS, HOLDS, HOLDS, UNTESTABLE]
    assert answers(bad) == [FAILS, FAILS, FAILS, UNTESTABLE]


def test_few_threats_are_nearly_always_passed_or_not() -> None:
    own = [{"few_threats": count} for count in FEW_THREATS]
    finding = check("C48", Samples(happening(lambda case: float(case["few_threats"] == 5), "works", KINDS, own)))
    assert answers(finding) == [HOLDS, FAILS]


def test_sharing_helps_where_the_formation_lets_it() -> None:
    own = [{"formation": one, "sharing": sharing} for one in SECOND_STARTS for sharing in ("none", "global")]
    helped = greater(lambda case: 0.8 if case["sharing"] == "global" else 1.0, own, KINDS)
    assert answers(check("C42", helped)) == [HOLDS, HOLDS, HOLDS, FAILS]
    beside = greater(lambda case: 0.8 if (case["sharing"], case["formation"]) == ("global", SIDE) else 1.0, own, KINDS)
    finding = check("C42", beside)
    assert answers(finding) == [DEPENDS, DEPENDS, DEPENDS, FAILS]
    assert "from two corners" in finding.rows[0].where


@pytest.mark.parametrize(("factor", "answer"), [(1.3, HOLDS), (0.7, FAILS)])
def test_one_matrix_costs_more_or_less(factor: float, answer: Answer) -> None:
    own = [{"matrices": one, "delay": delay} for one in ("one", "each") for delay in DELAYS]
    finding = check("C45", greater(lambda case: factor if case["matrices"] == "one" else 1.0, own))
    assert answers(finding) == [answer, HOLDS, UNTESTABLE]


def test_counterexamples_that_show_nothing_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    real = counterexamples.mission

    def turned(name: str) -> SimpleNamespace:
        found = real(name).missions(get)
        return SimpleNamespace(missions=lambda _: dict(zip(found, reversed(found.values()), strict=True)))

    monkeypatch.setattr(counterexamples, "mission", turned)
    with pytest.raises(AssertionError, match="no longer hurts"):
        sharing_claims.factors_of_harm()
    with pytest.raises(AssertionError, match="collide without"):
        obstacle_claims.pairs_that_collide()


def test_one_matrix_that_is_late_is_not_taken_for_one_that_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    real = sharing_claims.fly_on_one_matrix
    monkeypatch.setattr(sharing_claims, "fly_on_one_matrix", lambda mission, _: real(mission, 2))
    with pytest.raises(AssertionError, match="flies another way on one matrix"):
        sharing_claims.require_same_at_once(7_000_000, 3)

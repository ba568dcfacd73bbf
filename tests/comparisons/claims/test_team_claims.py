"""The checks of C39, C41, C42, C44, C45 and C48 in worlds where their answers are known, and flights of three UAVs."""

import math
from collections.abc import Callable, Mapping
from itertools import product
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Answer, Finding
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.panel import company as panel
from cgla_graph.comparisons.claims.panel import flights
from cgla_graph.comparisons.claims.panel.flights import setup_name
from cgla_graph.comparisons.claims.panel.one_matrix import DELAYS
from cgla_graph.comparisons.claims.panel.settings import (
    BASE_KINDS,
    FACTORS,
    KINDS,
    PANEL,
    STARTS,
    PanelMap,
    cells,
    seeds_of,
)
from cgla_graph.comparisons.claims.panel.teams import FEW_THREATS, SECOND_STARTS, SIDE, STEPNUMS, fraction, half
from cgla_graph.comparisons.claims.paper import obstacle_claims, sharing_claims
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.solvers import get

#: How often something happens, or by which factor, in a case.
Often: TypeAlias = Callable[[Mapping[str, Any]], float]
MAPS = 20


def happening(often: Often, measure: str, kinds: tuple[Any, ...], own: list[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Draw how often something happens on maps of some kinds, in their three settings with settings of one's own."""
    rng = np.random.default_rng(0)
    return [
        {"map": MAPS * number + map_, **case, measure: bool(rng.random() < often(case))}
        for number, kind in enumerate(kinds)
        for setting, one in product(fraction(number % 4), own)
        for case in [{**kind._asdict(), **setting, "varied": "", **one}]
        for map_ in range(MAPS)
    ]


HALF = tuple(half(PANEL))


def obstacles(often: Often) -> Samples:
    """Return a world in which two UAVs collide so often, and obstacles end all conflicts if seldom with 3 steps."""
    own = [{"stepnum": stepnum} for stepnum in ("none", *STEPNUMS)]
    records = happening(often, "collided", HALF, own)
    return Samples([{**record, "avoided": not record["collided"]} for record in records])


def greater(factor: Often, own: list[Mapping[str, Any]], kinds: tuple[Any, ...] = HALF) -> Samples:
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


@pytest.mark.slow
def test_stored_pairs_collide_with_obstacles_only() -> None:
    assert len(obstacle_claims.pairs_that_collide().split("; ")) == len(obstacle_claims.COUNTEREXAMPLES)


def test_obstacles_avoid_conflicts_or_cause_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(obstacle_claims, "pairs_that_collide", lambda: "0.01 apart, 0.1 without")
    good = check("C41", obstacles(lambda case: 0.9 if case["stepnum"] == "none" else 0.05))
    bad = check("C41", obstacles(lambda case: 0.05 if case["stepnum"] == "none" else 0.9))
    assert answers(good) == [FAILS, HOLDS, HOLDS, UNTESTABLE]
    assert answers(bad) == [FAILS, FAILS, FAILS, UNTESTABLE]


def test_few_threats_are_nearly_always_passed_or_not() -> None:
    own = [{"few_threats": count} for count in FEW_THREATS]
    finding = check("C48", Samples(happening(lambda case: float(case["few_threats"] == 5), "works", KINDS, own)))
    assert answers(finding) == [HOLDS, FAILS]


@pytest.mark.slow
def test_sharing_helps_where_the_formation_lets_it(monkeypatch: pytest.MonkeyPatch) -> None:
    harm = sharing_claims.factors_of_harm()
    monkeypatch.setattr(sharing_claims, "factors_of_harm", lambda: harm)
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


#: A map on which sub-goals of CPVS-style depend on K.
BASE = PanelMap(seeds_of(BASE_KINDS[1], 77, 1)[0])


@pytest.fixture(scope="module")
def samples() -> Samples:
    with pytest.MonkeyPatch.context() as patch:
        for name, levels in {"radius": (0.1,), "k": (10.0, 200.0)}.items():
            patch.setitem(FACTORS, name, levels)  # type: ignore[arg-type]
        patch.setattr(flights, "RULES", {"start": "snapped"})
        patch.setattr(panel, "CONSTANTS", panel.CONSTANTS[2:3] + panel.CONSTANTS[-1:])
        return Samples(panel.company.sample(BASE))


@pytest.mark.slow
def test_each_case_is_there_once_with_both_sides_of_varied_ones(samples: Samples) -> None:
    names = ("planner", "k", "varied", "uav")
    assert len(samples.records) == len(samples.cases(*names))
    varied = {record["varied"] for record in samples.records} - {""}
    assert varied == {"start snapped", "fbcri-style, tolerance 0.001", "cpvs-style, onward False"}
    for setting in varied:
        assert len({record["planner"] for record in samples.where(varied=setting)}) >= 2


@pytest.mark.parametrize(
    ("planner", "settings", "rules", "varied"),
    [
        ("cgla", {}, {}, ""),
        ("cgla", {}, {"start": "snapped"}, "start snapped"),
        ("fbcri-style", {"tolerance": 0.001}, {}, "fbcri-style, tolerance 0.001"),
        ("cpvs-style", {}, {}, ""),
        ("cpvs-style", {"onward": False}, {}, "cpvs-style, onward False"),
    ],
)
def test_records_are_those_of_a_mission_made_by_hand(
    samples: Samples, planner: str, settings: dict[str, Any], rules: dict[str, Any], varied: str
) -> None:
    near = [one for one in BASE.field.threats if min(math.dist((one.x, one.y), start) for start in STARTS) < 0.12]
    field = panel.without_those_at_starts(BASE.field)
    assert {*field.threats} == {*BASE.field.threats} - {*near}
    uavs = [Uav(f"UAV {i + 1}", STARTS[i], (0.9, 0.9), 0.1, step=0.02, k=200.0) for i in range(3)]
    lattice = Lattice(20, bounds=(0.0, 0.0, 1.0, 1.0), kind="upper")
    flight = Mission(
        World(field, bounds=(0.0, 0.0, 1.0, 1.0)),
        uavs,
        get(planner, **settings),
        resolution=lattice,
        arrival_radius=0.025,
        collisions="record",
        **rules,
    ).fly()
    for name, one in flight.uavs.items():
        path = np.asarray(one.path)
        (record,) = samples.where(planner=planner, k=200.0, varied=varied, uav=name)
        ends = np.linspace(path[:-1], path[1:], 41)
        steps = np.hypot(*np.diff(path, axis=0).T)
        risk = float((field.density(0.5 * (ends[:-1] + ends[1:])).mean(axis=0) * steps).sum())
        assert record["length"] == pytest.approx(steps.sum())
        assert record["risk"] == pytest.approx(risk, rel=1e-3, abs=1e-9)
        assert record["cost"] == pytest.approx(record["length"] + 200.0 * record["risk"])


def made_up(cgla: float, maps: int = 20) -> Finding:
    """Check C44 where CGLA's numbers are so many times those of the others."""
    rng = np.random.default_rng(1)
    records: list[dict[str, Any]] = []
    for number in range(maps):
        for uav in panel.UAVS:
            for planner in map(setup_name, panel.COMPANY):
                factor = (cgla if planner == "cgla" else 1.0) * float(rng.uniform(0.99, 1.01))
                case = {"map": number, "uav": uav, "planner": planner, "k": 10.0, "varied": ""}
                records.append({**case, "length": factor, "risk": factor, "cost": factor})
    return catalogue.claims()["C44"].check(Evidence(samples={"company": Samples(records)}))


@pytest.mark.parametrize(("cgla", "answer"), [(0.8, Answer.HOLDS), (1.2, Answer.FAILS)])
def test_statements_are_about_cgla(cgla: float, answer: Answer) -> None:
    finding = made_up(cgla)
    assert finding.answers == (answer,)
    assert len(finding.rows) == 5
    assert made_up(cgla, maps=4).answers == (Answer.OPEN,)


def test_printed_ratios_are_the_paper_s() -> None:
    printed = {one.text: one.printed for one in sharing_claims.statements()}
    assert printed["shorter than CPVS-style"] == "0.989, 0.671, 0.628"
    assert printed["less risk than FBCRI-style"] == "0.0593, 0.183, 0.0898"
    assert printed["less cost than CPVS-style"] == ""

"""The checks of C39, C40, C41 and C48: worlds where a claim holds, where the opposite does, and where nothing is."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np
import pytest
from figures import assert_tidy
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from strategies import examples

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.artefact import Picture
from cgla_graph.comparisons.claims.claim import Claim, Finding, Part, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS, MAIN, MOSTLY, holds, shares
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.figures import team_figures
from cgla_graph.comparisons.claims.paper import obstacle_claims
from cgla_graph.comparisons.claims.paper.flights import fly_two, fly_variants, team_measures
from cgla_graph.comparisons.claims.paper.obstacle_claims import (
    COUNTEREXAMPLES,
    FEW_SETTINGS,
    FEW_THREATS,
    KS,
    NO_OBSTACLE,
    PAPER_STEPNUMS,
    SPREADS,
    STEPNUMS,
    levels,
    settings,
)
from cgla_graph.mission.records import Flight
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import random_scenario

CLAIMS = {one.id: one for one in vars(obstacle_claims).values() if isinstance(one, Claim)}
#: How often something happens, by stepnum.
Effects: TypeAlias = Mapping[Any, float]


def flown(rates: Effects | Callable[[Mapping[str, Any]], Effects], *, maps: int = 50, seed: int = 0) -> Samples:
    """Return a world in which two UAVs collide that often, by stepnum; the rates may hang on the setting."""
    rng = np.random.default_rng(seed)
    rates_of = rates if callable(rates) else lambda _: rates
    bare = [*({**cell, "k": 20} for cell in CELLS), *({**MAIN, "k": k} for k in KS if k != 20)]
    cases: list[Mapping[str, Any]] = [{**case, "stepnum": NO_OBSTACLE} for case in bare]
    for spread in SPREADS:
        for case in settings(spread):
            main = case == {**MAIN, "k": 20, "safe_distance": 0.1, "spread": spread}
            cases += [{**case, "stepnum": stepnum} for stepnum in (STEPNUMS if main else PAPER_STEPNUMS)]
    return Samples(
        [
            {
                "map": number,
                **case,
                "collided": bool(rng.random() < rates_of(case).get(case["stepnum"], 0.3)),
                "from_meeting": float(rng.random()),
                "livelock": False,
                "arrived": True,
            }
            for number in range(maps)
            for case in cases
        ]
    )


def few(rate: float, *, maps: int = 200, seed: int = 0, seven: float | None = None) -> Samples:
    """Return a world in which two UAVs arrive without a collision that often; among seven threats, maybe another."""
    rng = np.random.default_rng(seed)
    often = {5: rate, 7: rate if seven is None else seven}
    return Samples(
        [
            {"map": number, **case, "threats": m, "arrived": True, "collided": bool(rng.random() >= often[m])}
            for number in range(maps)
            for m in FEW_THREATS
            for case in FEW_SETTINGS
        ]
    )


def remembered(*names: str) -> Callable[..., Flight]:
    """Return what flies two UAVs once for equal values of some settings."""
    flights: dict[tuple[Any, ...], Flight] = {}

    def fly(field: RiskField, **case: Any) -> Flight:  # noqa: ANN401 - as there
        key = (field, *(case.get(name) for name in names))
        if key not in flights:
            flights[key] = fly_two(field, **case)
        return flights[key]

    return fly


def check(claim: str, samples: Samples) -> Finding:
    found = CLAIMS[claim]
    return found.check(Evidence(Scale(maps=6), dict.fromkeys(found.experiments, samples)))


def verdicts(parts: tuple[Part, ...], words: str) -> list[Verdict]:
    """Return the verdicts of a statement, one for each condition."""
    return [one.verdict for one in parts if words in one.statement]


U_SHAPE = {NO_OBSTACLE: 0.6, 0: 0.6, 1: 0.3, 2: 0.1, 3: 0.02, 4: 0.1, 5: 0.6, 6: 0.7, 8: 0.8}
RISING = {stepnum: 0.05 + 0.1 * stepnum for stepnum in STEPNUMS}
REVERSED = {NO_OBSTACLE: 0.1, 0: 0.0, 3: 0.5, 5: 0.1}
SUPPORTED, CONTRADICTED, UNDECIDED = Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.UNDECIDED


@pytest.fixture(autouse=True)
def patterns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fig. 7 is flown in one test only."""
    monkeypatch.setattr(obstacle_claims, "_pattern_of_fig7", lambda _: (True, False, True))


@pytest.mark.parametrize(
    ("world", "five", "zero"),
    [
        (U_SHAPE, SUPPORTED, SUPPORTED),
        (RISING, UNDECIDED, CONTRADICTED),
        (REVERSED, CONTRADICTED, CONTRADICTED),
    ],
)
def test_three_steps_are_held_against_five_and_none(world: Effects, five: Verdict, zero: Verdict) -> None:
    parts = check("C39", flown(world, maps=60)).parts
    assert [one.condition for one in parts] == 2 * list(levels())
    assert verdicts(parts, "5 more than 3") == [five] * 4
    assert verdicts(parts, "0 more than 3") == [zero] * 4


@pytest.mark.slow
def test_where_stepnum_changes_nothing_few_samples_say_that_it_does() -> None:
    """One test in twenty errs in each direction; that all cells err alike is rarer."""
    found = [part.verdict for seed in range(6) for part in check("C39", flown({}, maps=40, seed=seed)).parts]
    assert found.count(SUPPORTED) <= 1
    assert found.count(CONTRADICTED) <= len(found) // 10


@pytest.mark.parametrize("changed", [{"k": 50}, {"replan": "tick"}])
def test_neither_k_nor_the_cell_may_decide(changed: Mapping[str, Any]) -> None:
    """Where a setting shows the opposite, no verdict of its spread or SD hides it."""

    def rates(case: Mapping[str, Any]) -> Effects:
        return REVERSED if changed.items() <= case.items() else U_SHAPE

    found = verdicts(check("C39", flown(rates, maps=60)).parts, "0 more than 3")
    hit = [any(changed.items() <= case.items() for case in cases) for cases in levels().values()]
    assert found == [CONTRADICTED if one else SUPPORTED for one in hit]
    assert any(hit)


def test_what_hangs_on_the_spread_is_said_of_the_spread() -> None:
    world = flown(lambda case: {**U_SHAPE, 0: 0.0, 3: 0.5, 5: 0.5} if case.get("spread") == SPREADS[0] else U_SHAPE)
    parts = check("C39", world).parts
    assert verdicts(parts, "0 more than 3") == [CONTRADICTED, SUPPORTED, SUPPORTED, CONTRADICTED]


def test_few_maps_decide_nothing_and_say_how_many_more_are_needed() -> None:
    parts = check("C39", flown({**U_SHAPE, 0: 1.0, 3: 0.0, 5: 1.0}, maps=5)).parts
    assert {one.verdict for one in parts} == {UNDECIDED}
    assert all("1 more maps" in one.result for one in parts)


def test_a_minimum_inside_is_told_from_one_at_an_end() -> None:
    upside_down = {stepnum: 0.9 - U_SHAPE[stepnum] for stepnum in STEPNUMS}
    for rates, verdict in ((U_SHAPE, SUPPORTED), ({}, UNDECIDED), (RISING, UNDECIDED), (upside_down, CONTRADICTED)):
        assert obstacle_claims._curve_part(flown(rates), SPREADS[1]).verdict is verdict


def test_what_is_on_our_selected_map_is_no_verdict() -> None:
    assert check("C39", flown({}, maps=3)).beside[0].verdict is Verdict.NOT_TESTABLE
    finding = check("C40", flown({}, maps=3))
    assert finding.parts[0].verdict is Verdict.NOT_TESTABLE
    assert all("fig8" not in part.result for part in finding.parts)


@pytest.mark.slow
def test_conflicts_are_avoided_if_most_are() -> None:
    everybody = {NO_OBSTACLE: 1.0}
    for rate, verdict in ((0.02, SUPPORTED), (0.5, UNDECIDED), (0.95, CONTRADICTED)):
        parts = check("C40", flown({**everybody, 3: rate})).parts
        assert verdicts(parts, "avoid each other") == [verdict] * 4
    nobody = check("C40", flown({NO_OBSTACLE: 0.0, 3: 0.0})).parts
    assert verdicts(nobody, "avoid each other") == [UNDECIDED] * 4
    assert all(not one.effect for one in nobody)


@pytest.mark.slow
def test_obstacles_do_not_prevent_all_collisions_but_may_prevent_most() -> None:
    for rates, verdict in ((U_SHAPE, SUPPORTED), ({}, UNDECIDED), (REVERSED, CONTRADICTED)):
        finding = check("C41", flown(rates))
        assert verdicts(finding.parts, "always") == [Verdict.REFUTED]
        assert verdicts(finding.parts, "more without than with") == [verdict] * 4
        assert finding.counterexample in counterexamples.names()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "spread"), list(zip(COUNTEREXAMPLES, SPREADS, strict=True)))
def test_each_spread_has_a_counterexample(name: str, spread: float) -> None:
    file = counterexamples.mission(name)
    flights = fly_variants(file)
    rule = flights["with virtual obstacles"].mission.virtual_obstacle
    assert rule is not None
    assert (rule.stepnum, rule.spread) == (3, spread)
    apart = [flights[f"{words} virtual obstacles"].least_separation for words in ("without", "with")]
    assert apart[1] < 0.03 < apart[0]


def test_conflicts_are_counted_as_they_are() -> None:
    case = settings(SPREADS[0])[0]
    bare = {name: case[name] for name in ("k", *MAIN)}
    world = [
        {"map": number, **of, "stepnum": stepnum, "collided": collided, "livelock": False}
        for number, pair in enumerate([(True, False), (True, True), (False, True), (False, False), (True, False)])
        for of, stepnum, collided in zip((bare, case), (NO_OBSTACLE, 3), pair, strict=True)
    ]
    assert obstacle_claims._conflicts(Samples(world), case) == (5, 3, 2, 1, 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("world", "found"),
    [
        (lambda: few(1.0), [SUPPORTED, SUPPORTED]),
        (lambda: few(1.0, seven=0.7), [SUPPORTED, CONTRADICTED]),
        (lambda: few(0.95), [UNDECIDED, UNDECIDED]),
        # too few maps to say so
        (lambda: few(1.0, maps=50), [UNDECIDED, UNDECIDED]),
    ],
)
def test_the_method_works_if_nearly_all_flights_do(world: Callable[[], Samples], found: list[Verdict]) -> None:
    parts = check("C48", world()).parts
    assert [one.condition for one in parts] == ["at SD 0.1", "at SD 0.06"] * 2
    assert [one.verdict for one in parts] == [found[0], found[0], found[1], found[1]]


@pytest.mark.slow
def test_where_there_is_no_effect_none_is_found() -> None:
    wrong = 0
    for seed in range(6):
        parts = check("C39", flown({}, maps=20, seed=seed)).parts
        wrong += sum(one.verdict is not UNDECIDED for one in parts)
    # eight parts each, and the opposite comes out of one in forty
    assert wrong <= 4


def test_a_share_at_the_border_is_not_above_it() -> None:
    rng = np.random.default_rng(0)
    tables = [shares({cell: (rng.random(200) < MOSTLY).astype(float) for cell in range(6)}) for _ in range(100)]
    # each of six at the full level: all of them together next to never
    assert sum(all(holds(one) for one in table) for table in tables) == 0
    assert sum(holds(one) for table in tables for one in table) <= 45


@pytest.mark.slow
def test_the_shipped_fig7_shows_what_the_paper_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    assert obstacle_claims._pattern_of_fig7(MAIN) == (True, False, True)


@examples(20)
@given(st.integers(3, 9))
def test_the_quadratic_contrast_sees_no_line(n: int) -> None:
    weights = obstacle_claims.quadratic_contrast(tuple(range(n)))
    x = np.arange(n, dtype=float)
    assert weights @ (3.0 + 2.0 * x) == pytest.approx(0.0, abs=1e-12)
    assert weights @ (x - x.mean()) ** 2 > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [5, 12])
def test_flights_that_are_not_flown_again_would_be_the_same(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    field = random_scenario(seed).problem.field
    flown_once = remembered("k", "spread", "safe_distance", "stepnum", *MAIN)
    monkeypatch.setattr(obstacle_claims, "fly_two", flown_once)
    for spread in (SPREADS[0], SPREADS[2]):
        cases = [case for case in settings(spread) if case["k"] == 20 and MAIN.items() <= case.items()]
        records = obstacle_claims._fly_group(field, cases)
        assert len(records) == len(STEPNUMS) + len(PAPER_STEPNUMS)
        # what the group did not fly is flown here
        for record in records:
            case = {name: record[name] for name in ("k", "spread", "safe_distance", "stepnum", *MAIN)}
            assert record == {**case, **team_measures(flown_once(field, **case))}


@pytest.mark.slow
def test_experiments_measure_every_setting_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(obstacle_claims, "CELLS", CELLS[1:2])
    monkeypatch.setattr(obstacle_claims, "FEW_SETTINGS", FEW_SETTINGS[:2])
    # what is measured is of no account here: one flight does for all spreads and stepnums
    monkeypatch.setattr(obstacle_claims, "fly_two", remembered("k", "safe_distance", "sharing", *MAIN))
    records = obstacle_claims.sample_stepnum.sample(5)
    names = ("integral", "radius", "replan", "k", "spread", "safe_distance", "stepnum")
    assert len({tuple(record.get(name) for name in names) for record in records}) == len(records)
    assert len(records) == 3 + 3 * (8 + 3 * 3)
    assert len(obstacle_claims.sample_few_threats.sample(5)) == 4


def test_the_curve_is_drawn_of_the_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    figures: list[Figure] = []

    def kept(figure: Figure, caption: str) -> Picture:
        figures.append(figure)
        return Picture(caption, b"", b"")

    monkeypatch.setattr(team_figures, "picture", kept)
    samples = flown(U_SHAPE, maps=8)
    made = team_figures._fig_a3.made_from(Evidence(Scale(maps=8), {"stepnum": samples}))
    assert isinstance(made, Picture)
    assert "8 random maps" in made.caption
    (figure,) = figures
    assert_tidy(figure)
    (axes,) = figure.axes
    for number, spread in enumerate(SPREADS):
        known = {"spread": spread, "k": 20, "safe_distance": 0.1, **MAIN}
        rates = [samples.column("collided", stepnum=one, **known).mean() for one in STEPNUMS]
        assert list(axes.lines[number + 1].get_ydata()) == pytest.approx(rates)


def test_a_mission_that_does_not_end_has_no_sums() -> None:
    locked = fly_variants(counterexamples.mission("c19-livelock.toml"))["with virtual obstacles"]
    found = team_measures(locked)
    assert (found["arrived"], found["livelock"], found["cost"]) == (False, True, None)
    assert found["separation"] > 0.0

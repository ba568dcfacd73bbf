"""The checks of C39 to C43, C45, C48, C49 and C51: worlds where a claim holds, where it fails, and where nothing is."""

import dataclasses
from collections.abc import Callable, Mapping
from itertools import product
from typing import Any, TypeAlias

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Verdict, supported
from cgla_graph.comparisons.claims.contrasts import CELLS, MOSTLY, all_hold, shares
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.paper import convergence_claims, obstacle_claims, sharing_claims
from cgla_graph.comparisons.claims.paper.flights import fly_two, fly_variants, team_measures
from cgla_graph.comparisons.claims.paper.obstacle_claims import FEW_THREATS, NO_OBSTACLE, STEPNUMS
from cgla_graph.comparisons.claims.paper.sharing_claims import SHARING_KS, sharings
from cgla_graph.mission.records import Event, Flight
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.simulation import Simulation
from cgla_graph.scenarios.random_map import random_scenario

BY_ID = catalogue.claims()
#: What is multiplied, or how often something happens, by the arm of an experiment.
Effects: TypeAlias = Mapping[Any, float]


def shared(risk: Effects, length: Effects, *, maps: int = 30, seed: int = 0) -> Samples:
    """Return a world in which ways of sharing multiply risk and length; each flight has noise of its own."""
    rng = np.random.default_rng(seed)
    records = []
    for number, cell, k in product(range(maps), CELLS, SHARING_KS):
        for name in [*sharings(0), "unreachable"]:
            noise = np.exp(rng.normal(0.0, 0.1, 2))
            values = {"risk_sum": risk.get(name, 1.0) * noise[0], "length": length.get(name, 1.0) * noise[1]}
            values["cost"] = values["length"] + values["risk_sum"]
            records.append({"map": number, **cell, "k": k, "sharing": name, **values})
    return Samples(records)


def flown(rates: Effects, *, maps: int = 50, seed: int = 0) -> Samples:
    """Return a world in which two UAVs collide that often, by stepnum."""
    rng = np.random.default_rng(seed)
    return Samples(
        [
            {
                "map": number,
                **cell,
                "stepnum": stepnum,
                "collided": bool(rng.random() < rates.get(stepnum, 0.3)),
                "from_meeting": float(rng.random()),
                "livelock": False,
                "arrived": True,
            }
            for number, cell, stepnum in product(range(maps), CELLS, (NO_OBSTACLE, *STEPNUMS))
        ]
    )


def few(rate: float, *, maps: int = 200, seed: int = 0) -> Samples:
    """Return a world in which two UAVs arrive without a collision that often."""
    rng = np.random.default_rng(seed)
    return Samples(
        [
            {"map": number, **cell, "threats": threats, "arrived": True, "collided": bool(rng.random() >= rate)}
            for number, cell, threats in product(range(maps), CELLS, FEW_THREATS)
        ]
    )


def check(claim: str, samples: Samples | None = None) -> Finding:
    """Check a claim on samples, with as few instances of its own as there can be."""
    found = BY_ID[claim]
    drawn = {} if samples is None else dict.fromkeys(found.experiments, samples)
    return found.check(Evidence(Scale(maps=6), drawn))


def part(finding: Finding, words: str) -> Verdict:
    (found,) = [one for one in finding.parts if words in one.statement]
    return found.verdict


GOOD = {"global": 0.8, "unreachable": 3.0}
U_SHAPE = {NO_OBSTACLE: 0.5, 0: 0.6, 1: 0.3, 2: 0.1, 3: 0.02, 4: 0.1, 5: 0.6, 6: 0.7, 8: 0.8}
RISING = {stepnum: 0.05 + 0.1 * stepnum for stepnum in STEPNUMS}


@pytest.fixture(autouse=True)
def patterns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fig. 7 is flown in one test only."""
    monkeypatch.setattr(obstacle_claims, "_pattern_of_fig7", lambda *_: (True, False, True))


def test_sharing_must_help_with_both_risk_and_length() -> None:
    finding = check("C42", shared(GOOD, {}))
    assert finding.verdict is Verdict.NOT_SUPPORTED
    assert part(finding, "lowers the risk") is Verdict.SUPPORTED
    assert part(finding, "shortens") is Verdict.NOT_SUPPORTED
    assert part(finding, "never hurts") is Verdict.REFUTED


def test_sharing_must_help_in_every_cell() -> None:
    world = shared(GOOD, GOOD)
    lost = [
        {**record, "risk_sum": 1.0} if (record["integral"], record["radius"]) == ("raster", 0.22) else record
        for record in world.records
    ]
    assert check("C42", Samples(lost)).verdict is Verdict.NOT_SUPPORTED


SHARING = [
    (lambda: shared(GOOD, GOOD), True),
    (lambda: shared({}, {}), False),
    (lambda: shared({"global": 1.3}, {"global": 1.3}), False),
]
#: Worlds in which a claim holds, or does not.
WORLDS: dict[str, list[tuple[Callable[[], Samples], bool]]] = {
    "C42": SHARING,
    "C51": SHARING,
    "C45": [*SHARING[:2], (lambda: shared({"unreachable": 0.5}, {"unreachable": 0.5}), False)],
    # rising: better than 5, but not than 0
    "C39": [(lambda: flown(U_SHAPE), True), (lambda: flown({}), False), (lambda: flown(RISING), False)],
    "C40": [(lambda: flown(U_SHAPE), True), (lambda: flown({}), False)],
    # too few maps to say so
    "C48": [(lambda: few(1.0), True), (lambda: few(0.93), False), (lambda: few(1.0, maps=50), False)],
}


@pytest.mark.parametrize(
    "claim", [pytest.param(one, marks=[pytest.mark.slow] if one in {"C42", "C51", "C40"} else []) for one in WORLDS]
)
def test_worlds_are_told_apart(claim: str) -> None:
    for world, holds in WORLDS[claim]:
        assert check(claim, world()).verdict is supported(holds)


def test_a_minimum_inside_is_told_from_one_at_an_end() -> None:
    words = "minimum between its ends (exact"
    assert part(check("C39", flown(U_SHAPE)), words) is Verdict.SUPPORTED
    for rates in ({}, RISING, {stepnum: 0.9 - U_SHAPE[stepnum] for stepnum in STEPNUMS}):
        assert part(check("C39", flown(rates)), words) is Verdict.NOT_SUPPORTED


@pytest.mark.slow
def test_obstacles_do_not_prevent_all_collisions_but_may_prevent_most() -> None:
    for rates, verdict in ((U_SHAPE, Verdict.SUPPORTED), ({}, Verdict.NOT_SUPPORTED)):
        finding = check("C41", flown(rates))
        assert finding.verdict is Verdict.REFUTED
        assert part(finding, "less often") is verdict


def test_conflicts_are_counted_as_they_are() -> None:
    world = [
        {"map": number, **cell, "stepnum": stepnum, "collided": collided, "livelock": False}
        for cell in CELLS
        for number, pair in enumerate([(True, False), (True, True), (False, True), (False, False), (True, False)])
        for stepnum, collided in zip((NO_OBSTACLE, 3), pair, strict=True)
    ]
    assert obstacle_claims._conflicts(Samples(world)) == [(5, 3, 2, 1, 0)] * 6


def _holds(claim: str, samples: Samples) -> bool:
    """Look at the rule alone: flights of stored files do not depend on the sample."""
    if claim == "C42":
        return all_hold(sharing_claims.effects_of_sharing(samples, "risk_sum"))
    if claim == "C40":
        return any(one.holds for one in obstacle_claims.avoided(samples))
    return check(claim, samples).verdict is Verdict.SUPPORTED


@pytest.mark.parametrize(
    ("claim", "world"),
    [
        ("C42", lambda seed: shared({}, {}, maps=15, seed=seed)),
        ("C45", lambda seed: shared({}, {}, maps=15, seed=seed)),
        ("C40", lambda seed: flown({}, maps=20, seed=seed)),
    ],
)
def test_where_there_is_no_effect_none_is_found(claim: str, world: Callable[[int], Samples]) -> None:
    assert sum(_holds(claim, world(seed)) for seed in range(20)) <= 1


def test_a_share_at_the_border_is_not_above_it() -> None:
    rng = np.random.default_rng(0)
    tables = [shares({cell: (rng.random(200) < MOSTLY).astype(float) for cell in range(6)}) for _ in range(100)]
    assert sum(any(one.holds for one in table) for table in tables) <= 8


@pytest.mark.slow
def test_the_shipped_fig7_shows_what_the_paper_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    assert obstacle_claims._pattern_of_fig7("exact", 0.2) == (True, False, True)


@examples(20)
@given(st.integers(3, 9))
def test_the_quadratic_contrast_sees_no_line(n: int) -> None:
    weights = obstacle_claims.quadratic_contrast(tuple(range(n)))
    x = np.arange(n, dtype=float)
    assert weights @ (3.0 + 2.0 * x) == pytest.approx(0.0, abs=1e-12)
    assert weights @ (x - x.mean()) ** 2 > 0.0


def test_flights_that_nobody_shares_are_no_union() -> None:
    flight = fly_two(random_scenario(1).problem.field, sharing="none")
    with pytest.raises(AssertionError, match="all have seen"):
        sharing_claims.require_union(flight)
    late = fly_two(random_scenario(1).problem.field, sharing=Sharing(delay=5))
    with pytest.raises(AssertionError, match="all have seen"):
        sharing_claims.require_union(late)


def test_a_uav_that_sees_too_far_or_too_little_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    sense = Simulation._sense

    def seeing(factor: float) -> Flight:
        def broken(simulation: Simulation, pilot: Any) -> None:  # noqa: ANN401 - a Pilot
            true = pilot.uav
            pilot.uav = dataclasses.replace(true, detection_radius=factor * true.detection_radius, safe_distance=0.01)
            sense(simulation, pilot)
            pilot.uav = true

        monkeypatch.setattr(Simulation, "_sense", broken)
        return fly_two(random_scenario(1).problem.field)

    with pytest.raises(AssertionError, match="with a radius of"):
        sharing_claims.require_seen_within_radius(seeing(1.3))
    with pytest.raises(AssertionError, match="does not know of"):
        sharing_claims.require_seen_within_radius(seeing(0.7))


def test_knowing_what_nobody_saw_is_noticed() -> None:
    flight = fly_two(random_scenario(1).problem.field, sharing="none")
    blind = tuple(event for event in flight.events if not (event.kind == "detected" and event.uav == "a"))
    assert any(isinstance(event, Event) for event in blind)
    with pytest.raises(AssertionError, match="which nobody saw"):
        sharing_claims.require_seen_within_radius(dataclasses.replace(flight, events=blind))


@pytest.mark.slow
def test_experiments_measure_the_same_again_in_every_case(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (sharing_claims, obstacle_claims):
        monkeypatch.setattr(module, "CELLS", CELLS[1:2])
    monkeypatch.setattr(convergence_claims, "RADII", (0.2,))
    counts = {"sharing": len(sharings(5)) + 3, "stepnum": len(STEPNUMS) + 1, "exclusion": 4, "few-threats": 2}
    for name, count in counts.items():
        experiment = catalogue.experiments()[name]
        records = experiment.sample(5)
        assert len(records) == count
        if name == "sharing":
            assert records == experiment.sample(5)
            # nobody who sees nothing flies another way than straight on
            assert records[6 - 1]["length"] == pytest.approx(0.8 * 2**0.5 + (0.8**2 + 0.65**2) ** 0.5, abs=0.06)


def test_a_mission_that_does_not_end_has_no_sums() -> None:
    locked = fly_variants(counterexamples.mission("c19-livelock.toml"))["with virtual obstacles"]
    found = team_measures(locked)
    assert (found["arrived"], found["livelock"], found["cost"]) == (False, True, None)
    assert found["separation"] > 0.0

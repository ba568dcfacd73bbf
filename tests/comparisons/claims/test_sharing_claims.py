"""The checks of C42, C43, C45, C49, C51: worlds where a claim holds, where the opposite does, where nothing is."""

import dataclasses
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, TypeAlias

import numpy as np
import pytest

from cgla_graph.comparisons.claims.claim import Claim, Finding, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS, judged
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.paper import one_matrix_claims, sharing_claims
from cgla_graph.comparisons.claims.paper.flights import fly_two
from cgla_graph.comparisons.claims.paper.one_matrix_claims import DELAYS, MATRIX_CELLS, fly_on_one_matrix
from cgla_graph.comparisons.claims.paper.sharing_claims import SHARING_KS
from cgla_graph.mission.records import Event, Flight
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.simulation import Simulation
from cgla_graph.scenarios.random_map import random_scenario

CLAIMS = {
    one.id: one
    for module in (sharing_claims, one_matrix_claims)
    for one in vars(module).values()
    if isinstance(one, Claim)
}
#: What is multiplied by a way of sharing: ``global``, ``each`` or ``one`` (late), or ``one`` with a delay.
Effects: TypeAlias = Mapping[Any, float]
PROVED, REFUTED, SUPPORTED, CONTRADICTED, UNDECIDED = (
    Verdict.PROVED,
    Verdict.REFUTED,
    Verdict.SUPPORTED,
    Verdict.CONTRADICTED,
    Verdict.UNDECIDED,
)


def shared(risk: Effects, length: Effects, *, maps: int = 30, seed: int = 0) -> Samples:
    """Return a world in which ways of sharing multiply risk and length; each flight has noise of its own."""
    rng = np.random.default_rng(seed)
    records: list[dict[str, Any]] = []

    def fly(case: Mapping[str, Any]) -> None:
        noise = np.exp(rng.normal(0.0, 0.1, 2))
        ways = [case["sharing"], (case["sharing"], case.get("delay"))]
        factors = [float(np.prod([effects.get(way, 1.0) for way in ways])) for effects in (risk, length)]
        values = {"risk_sum": factors[0] * noise[0], "length": factors[1] * noise[1]}
        records.append({**case, **values, "cost": values["length"] + values["risk_sum"]})

    for number, cell in product(range(maps), CELLS):
        for k, sharing in product(SHARING_KS, ("none", "global")):
            fly({"map": number, **cell, "k": k, "sharing": sharing})
        if cell in MATRIX_CELLS:
            for sharing, delay in product(("each", "one"), DELAYS):
                fly({"map": number, **cell, "k": 20, "sharing": sharing, "delay": delay})
            fly({"map": number, **cell, "k": 20, "sharing": "unreachable"})
    return Samples(records)


def check(claim: str, samples: Samples | None = None) -> Finding:
    """Check a claim on samples, with as few instances of its own as there can be."""
    found = CLAIMS[claim]
    drawn = {} if samples is None else dict.fromkeys(found.experiments, samples)
    return found.check(Evidence(Scale(maps=6), drawn))


def verdicts(finding: Finding) -> list[Verdict]:
    return [part.verdict for part in finding.parts]


LESS, MORE = {"global": 0.8}, {"global": 1.25}


@pytest.mark.parametrize(
    ("risk", "length", "found"),
    [
        (LESS, LESS, [SUPPORTED, SUPPORTED]),
        (LESS, {}, [SUPPORTED, UNDECIDED]),
        (LESS, MORE, [SUPPORTED, CONTRADICTED]),
        (MORE, MORE, [CONTRADICTED, CONTRADICTED]),
        ({}, {}, [UNDECIDED, UNDECIDED]),
    ],
)
def test_sharing_saves_risk_or_length_or_both(risk: Effects, length: Effects, found: Sequence[Verdict]) -> None:
    assert verdicts(check("C42", shared(risk, length))) == [*found, REFUTED]


def test_sharing_must_help_in_every_cell() -> None:
    lost = [
        {**record, "risk_sum": 1.0} if (record["integral"], record["radius"]) == ("raster", 0.22) else record
        for record in shared(LESS, LESS).records
    ]
    finding = check("C42", Samples(lost))
    assert verdicts(finding) == [UNDECIDED, SUPPORTED, REFUTED]
    assert "in 20 of 24 cells" in finding.parts[0].result


def test_few_maps_do_not_show_that_sharing_helps() -> None:
    few = check("C42", shared(LESS, LESS, maps=4))
    assert verdicts(few) == [UNDECIDED, UNDECIDED, REFUTED]
    assert "2 more maps" in few.parts[0].result


def test_what_sharing_saves_stands_beside_the_papers_own() -> None:
    risk, length, _ = check("C42", shared(LESS, {"global": 0.9})).parts
    assert (risk.printed, length.printed) == ("45.2 % less, on one map", "14.8 % less, on one map")
    assert all(f"K = {k}: " in part.effect for k in SHARING_KS for part in (risk, length))


def test_a_counterexample_that_shows_nothing_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    real = sharing_claims.fly_variants
    monkeypatch.setattr(
        sharing_claims,
        "fly_variants",
        lambda file: dict(zip(real(file), reversed(real(file).values()), strict=True)),
    )
    with pytest.raises(AssertionError, match="no longer hurts"):
        check("C42", shared({}, {}, maps=6))
    with pytest.raises(AssertionError, match="no longer makes both"):
        check("C51", shared({}, {}, maps=6))


@pytest.mark.parametrize(
    ("effects", "found"),
    [
        ({"one": 1.3}, [SUPPORTED] * 3),
        ({"one": 0.8}, [CONTRADICTED] * 3),
        ({}, [UNDECIDED] * 3),
        # better or worse: it hangs on the delay
        ({("one", 2): 0.8, ("one", 10): 2.0}, [CONTRADICTED, UNDECIDED, SUPPORTED]),
        # both are bad, so neither is better
        ({"one": 1.5, "each": 1.5}, [UNDECIDED] * 3),
    ],
)
def test_a_matrix_each_is_better_or_not_for_each_delay(effects: Effects, found: Sequence[Verdict]) -> None:
    finding = check("C45", shared(effects, effects))
    assert verdicts(finding) == [Verdict.NOT_TESTABLE, *found, PROVED]
    assert [part.condition for part in finding.parts[1:4]] == [f"if reports take {delay} ticks" for delay in DELAYS]


@pytest.mark.slow
def test_a_matrix_out_of_reach_is_no_evidence() -> None:
    for factor in (0.3, 1.0, 5.0):
        world = shared({"unreachable": factor}, {"unreachable": factor}, maps=8)
        assert check("C45", world).parts[0].verdict is Verdict.NOT_TESTABLE


def test_where_there_is_no_effect_none_is_found() -> None:
    found = {"C42": 0, "C45": 0}
    for seed in range(20):
        world = shared({}, {}, maps=15, seed=seed)
        found["C42"] += judged(sharing_claims.effects_of_sharing(world, "risk_sum")[20]) is not UNDECIDED
        found["C45"] += judged(one_matrix_claims.one_against_each(world, "cost", 5)) is not UNDECIDED
    assert max(found.values()) <= 2


def test_what_can_be_is_shown_by_one_map_whatever_is_so_on_others() -> None:
    for effects, verdict in ((LESS, SUPPORTED), (MORE, CONTRADICTED)):
        finding = check("C51", shared(effects, effects))
        assert verdicts(finding) == [PROVED, PROVED]
        assert [part.verdict for part in finding.beside] == [verdict, verdict]


# --- one matrix -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("delay", [0, 3])
def test_on_one_matrix_all_know_what_anybody_has_seen_so_long_ago(delay: int) -> None:
    alone = fly_two(random_scenario(1).problem.field)
    flight = fly_on_one_matrix(alone.mission, delay)
    assert flight.all_arrived
    threats = {number: (one.x, one.y) for number, one in enumerate(flight.mission.world.field.threats)}
    first: dict[int, int] = {}
    for one in flight.uavs.values():
        for tick, position in enumerate(one.trace[:-1], start=one.departed):
            for number, place in threats.items():
                if np.hypot(*np.subtract(position, place)) <= one.uav.detection_radius:
                    first[number] = min(tick, first.get(number, tick))
    for one in flight.uavs.values():
        for tick in range(one.departed, one.ended):
            known = {number for number, seen in first.items() if seen + delay <= tick}
            assert set(one.knowledge_at(tick).threats) == known
    assert any(one.knowledge_at(one.ended - 1).threats for one in flight.uavs.values())


def test_a_matrix_that_hears_nothing_in_time_sends_all_straight_on() -> None:
    flight = fly_on_one_matrix(fly_two(random_scenario(1).problem.field).mission, 1000)
    straight = 0.8 * 2**0.5 + (0.8**2 + 0.65**2) ** 0.5
    assert sum(one.length for one in flight.uavs.values()) == pytest.approx(straight, abs=0.06)


def test_one_matrix_that_is_late_is_not_taken_for_one_that_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(one_matrix_claims, "fly_on_one_matrix", lambda mission, _: fly_on_one_matrix(mission, 2))
    with pytest.raises(AssertionError, match="flies another way on one matrix"):
        check("C45", shared({}, {}, maps=6))


# --- who knows what -------------------------------------------------------------------------------------------------


def test_what_is_shared_is_the_union_of_what_is_seen() -> None:
    assert verdicts(check("C43")) == [PROVED]
    for sharing in (Sharing(is_on=False), Sharing(delay=5)):
        flight = fly_two(random_scenario(1).problem.field, sharing=sharing)
        with pytest.raises(AssertionError, match="all have seen"):
            sharing_claims.require_union(flight)


def test_threats_are_known_within_the_radius() -> None:
    assert verdicts(check("C49")) == [PROVED, PROVED]


def test_a_uav_that_sees_too_far_or_too_little_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    sense = Simulation._sense

    def seeing(factor: float) -> Flight:
        def broken(simulation: Simulation, agent: Any) -> None:  # noqa: ANN401 - an Agent
            true = agent.uav
            agent.uav = dataclasses.replace(true, detection_radius=factor * true.detection_radius, safe_distance=0.01)
            sense(simulation, agent)
            agent.uav = true

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
def test_the_experiment_measures_each_case_once_and_the_same_again(monkeypatch: pytest.MonkeyPatch) -> None:
    cells = (CELLS[1], CELLS[7])
    assert [cell["replan"] for cell in cells] == ["change", "tick"]
    monkeypatch.setattr(sharing_claims, "CELLS", cells)
    records = sharing_claims.sample_sharing.sample(5)
    names = ("integral", "radius", "replan", "k", "sharing", "delay")
    assert len({tuple(record.get(name) for name in names) for record in records}) == len(records)
    # with and without for each cell and K; for one K, on change, each delay twice, and out of reach
    assert len(records) == 2 * 2 * len(SHARING_KS) + 2 * len(DELAYS) + 1
    assert records == sharing_claims.sample_sharing.sample(5)

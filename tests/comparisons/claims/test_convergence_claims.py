"""The checks of C17, C18, C19 and C54: their verdicts, and that broken programs do not get them."""

import dataclasses
from itertools import product
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Table, Verdict
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.paper import convergence_claims as claims
from cgla_graph.comparisons.claims.paper.convergence_claims import EXCLUSIONS, same_trace
from cgla_graph.mission.records import Livelock, UavFlight
from cgla_graph.mission.simulation import Simulation
from cgla_graph.solvers import get

BY_ID = catalogue.claims()


def excluded(share: float, maps: int = 40) -> Samples:
    """Return a world in which exclusion changes that share of flights."""
    return Samples(
        [
            {"map": i, "movement": movement, "radius": radius, "exclude": exclude, "differs": i < share * maps}
            for i in range(maps)
            for movement in ("step", "vertex")
            for radius in (0.18, 0.2, 0.22)
            for exclude in EXCLUSIONS
        ]
    )


def evidence(*, instances: int = 4, samples: Samples | None = None) -> Evidence:
    """Return evidence for fast checks; instances are those of checks that make 200 for 200 maps."""
    return Evidence(Scale(maps=instances), {"exclusion": samples or excluded(0.1)})


def check(claim: str, **settings: Any) -> Finding:  # noqa: ANN401 - passed on
    return BY_ID[claim].check(evidence(**settings))


def test_a_bound_that_is_too_small_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(claims.MOVES_BETWEEN, "none", 0)
    with pytest.raises(AssertionError, match="the proof allows 0"):
        check("C17")


def test_a_uav_that_stops_falling_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A UAV that plans, but is put back to where it was, does not get cheaper."""

    class LeaderboardRow(Simulation):
        def advance(self) -> None:
            before = [agent.position for agent in self._agents]
            super().advance()
            if self.tick == 5:
                for agent, position in zip(self._agents, before, strict=True):
                    agent.position = position

    mission = claims._mission(np.random.default_rng(3))
    with monkeypatch.context() as patched:
        patched.setattr("cgla_graph.mission.simulation.Simulation", LeaderboardRow)
        with pytest.raises(AssertionError, match="the cost to go went from"):
            claims._require_falling_cost(mission)
    claims._require_falling_cost(mission)


@pytest.mark.parametrize(
    ("share", "maps", "verdict"),
    [
        (0.0, 100, Verdict.SUPPORTED),
        (0.05, 200, Verdict.UNDECIDED),
        (0.25, 100, Verdict.CONTRADICTED),
        (0.0, 8, Verdict.UNDECIDED),
    ],
)
def test_how_often_exclusion_matters_is_what_the_sample_says(share: float, maps: int, verdict: Verdict) -> None:
    finding = check("C18", samples=excluded(share, maps))
    assert [part.verdict for part in finding.parts] == [Verdict.PROVED, Verdict.REFUTED, verdict]
    assert [part.verdict for part in finding.beside] == [verdict]
    assert [row[2] for table in finding.tables for row in table.rows] == [1.0 - share] * 12


def test_c17_has_a_verdict_for_each_kind_of_threat() -> None:
    assert [part.ruling for part in check("C17").parts] == [
        "arrives: proved with static threats",
        "arrives: refuted with virtual obstacles",
    ]


def stuck(shares: dict[float, float], *, paper: float = 0.0, maps: int = 200) -> Samples:
    """Return a world in which two that change places are stuck on these shares of maps, by spread."""
    return Samples(
        [
            {
                "map": i,
                "course": course,
                "spread": spread,
                "n": n,
                "jitter": jitter,
                "livelock": i < share * maps,
                "arrived": i >= share * maps,
            }
            for i, course, spread, n, jitter in product(
                range(maps), claims.COURSES, claims.OBSTACLE_SPREADS, claims.LIVELOCK_SIZES, claims.JITTERS
            )
            if course != claims.NO_THREATS or jitter
            for share in [paper if course == claims.PAPER else shares[spread]]
        ]
    )


def judged(samples: Samples) -> list[str]:
    finding = claims.judge_c19(samples, Livelock(12, 2), Table("", (), ()))
    assert [part.verdict for part in finding.parts[:2]] == [Verdict.PROVED, Verdict.REFUTED]
    return [part.verdict.label for part in finding.parts[2:]]


def test_rare_livelocks_are_told_from_frequent_ones() -> None:
    frequent = {0.02: 0.0, 0.03: 0.05, 0.05: 0.2}
    assert judged(stuck(frequent)) == ["supported", "undecided", "contradicted", "supported"]
    assert judged(stuck(frequent, maps=4)) == ["undecided"] * 4
    assert judged(stuck(dict.fromkeys(frequent, 0.0), paper=0.3))[-1] == "contradicted"


@pytest.mark.slow
def test_livelocks_are_sampled_in_each_case_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "LIVELOCK_SIZES", (12,))
    records = claims.sample_livelocks.sample(7)
    cases = [(one["course"], one["spread"], one["jitter"]) for one in records]
    assert len(set(cases)) == len(cases) == 15
    assert records == claims.sample_livelocks.sample(7)


def test_two_flights_are_the_same_up_to_rounding() -> None:
    missions = counterexamples.mission(claims.EXCLUSION).missions(get)
    free, bound = (mission.fly().uavs["a"] for mission in missions.values())
    nearly = dataclasses.replace(free, trace=free.trace + 1e-9)
    assert same_trace(free, free)
    assert same_trace(free, nearly)
    assert not same_trace(free, bound)
    assert claims._turns_back(free, bound) == (1, (0.1, 0.1))
    with pytest.raises(AssertionError, match="not Step 5"):
        claims._turns_back(bound, free)
    assert not same_trace(free, dataclasses.replace(free, trace=free.trace + 1e-3))


def test_weights_that_do_not_come_back_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert check("C54").headline == (
        "weights change at random: refuted as Eqs 1, 2 and 5 define them · nobody is caught: refuted with virtual "
        "obstacles; proved with static threats"
    )
    monkeypatch.setattr(UavFlight, "obstacles_at", lambda _, tick: (tick,))
    with pytest.raises(AssertionError, match="by other weights after a period"):
        check("C54")
    monkeypatch.setattr(UavFlight, "obstacles_at", lambda *_: ())
    with pytest.raises(AssertionError, match="do not change at all"):
        check("C54")


@pytest.mark.slow
def test_the_exclusion_experiment_measures_every_case(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "RADII", (0.2,))
    assert len(catalogue.experiments()["exclusion"].sample(5)) == 4

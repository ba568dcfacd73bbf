"""The checks of C17, C18, C19 and C54: their verdicts, and that broken programs do not get them."""

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Finding
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.paper import convergence_claims as claims
from cgla_graph.comparisons.claims.paper.convergence_claims import EXCLUSIONS, same_trace
from cgla_graph.comparisons.claims.paper.flights import fly_two
from cgla_graph.mission.simulation import Simulation
from cgla_graph.model.risk import RiskField
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


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_how_often_exclusion_matters_is_what_the_sample_says(share: float) -> None:
    found = claims._how_often_different(excluded(share))
    assert [one.rate for *_, one in found] == [share] * 12
    assert all(one.interval.low <= share <= one.interval.high for *_, one in found)


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


def test_flights_that_differ_between_processes_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "HASH_SEEDS", (1,))
    monkeypatch.setattr(claims, "_digest_elsewhere", lambda *_: "0" * 64)
    with pytest.raises(AssertionError, match="of another process"):
        check("C54")


def test_a_checksum_tells_flights_apart() -> None:
    flight = fly_two(RiskField())
    moved = {name: dataclasses.replace(one, trace=np.nextafter(one.trace, 2.0)) for name, one in flight.uavs.items()}
    assert claims.digest([dataclasses.replace(flight, uavs=moved)]) != claims.digest([flight])


def test_more_maps_are_more_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    flown: list[int] = []

    def digest_of(seeds: Iterable[int]) -> str:
        flown.extend(seeds)
        return ""

    monkeypatch.setattr(claims, "digest_of", digest_of)
    monkeypatch.setattr(claims, "_digest_elsewhere", lambda *_: "")
    BY_ID["C54"].check(Evidence(Scale(maps=200, seed=2)))
    assert flown == list(range(2_000_000, 2_000_020))

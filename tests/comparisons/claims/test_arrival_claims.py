"""The checks of C17, C18 and C19: broken programs do not pass them, and records of flights are right."""

import dataclasses
import math
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Answer, Finding
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.panel import arrivals
from cgla_graph.comparisons.claims.panel.settings import FACTORS, KINDS, PANEL, START, PanelMap, seeds_of
from cgla_graph.comparisons.claims.paper import arrival_claims as claims
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.simulation import Simulation
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.solvers import get

BY_ID = catalogue.claims()
MAPS = 24


def starts(stuck: float = 0.0, *, start: str = "snapped") -> Samples:
    """Return flights of which a share is stuck, where plans begin as named."""
    cases = [(n, radius, k) for n, radii in arrivals.SIZES.items() for radius, k in product(radii, FACTORS["k"])]
    return Samples(
        [
            {
                **PanelMap(seed).levels,
                **dict(zip(("n", "radius", "k"), case, strict=True)),
                "start": begins,
                "arrived": begins != start or i >= stuck * MAPS,
            }
            for kind in KINDS
            for i, seed in enumerate(seeds_of(kind, 1, MAPS))
            for case in cases
            for begins in arrivals.PLANS_BEGIN
        ]
    )


def pairs(stuck: dict[float, float]) -> Samples:
    """Return flights of two UAVs of which these shares are stuck, by the spread of virtual obstacles."""
    return Samples(
        [
            {**PanelMap(seed).levels, "course": course, "obstacle": spread, "n": n, "arrived": i >= share * MAPS}
            for kind in arrivals.exclusion.kinds(PANEL)
            for i, seed in enumerate(seeds_of(kind, 1, MAPS))
            for course, (spread, share), n in product(arrivals.COURSES, stuck.items(), arrivals.PAIR_SIZES)
        ]
    )


def check(claim: str, **samples: Samples) -> Finding:
    named = {name.replace("_", "-"): sample for name, sample in samples.items()}
    return BY_ID[claim].check(Evidence(Scale(maps=2), named))


def mission(**rules: Any) -> Mission:  # noqa: ANN401 - of a mission
    return dataclasses.replace(claims._mission(np.random.default_rng(3)), **rules)


@pytest.mark.slow
def test_c17_names_where_uavs_arrive_and_what_is_stuck() -> None:
    finding = check("C17", starts_of_plans=starts(0.25))
    (row,) = finding.rows
    assert (row.answer, row.where) == (Answer.DEPENDS, claims.ARRIVES_WHERE)
    assert row.size == "25 to 25 % stuck from lattice points"
    assert finding.counterexamples == (claims.SNAPPED, claims.LIVELOCK)


@pytest.mark.slow
def test_a_uav_that_plans_from_where_it_is_and_is_stuck_is_noticed() -> None:
    with pytest.raises(AssertionError, match="did not arrive on the panel"):
        check("C17", starts_of_plans=starts(0.1, start="exact"))


def test_a_bound_that_is_too_small_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(claims.MOVES_BETWEEN, "none", 0)
    with pytest.raises(AssertionError, match="the proof allows 0"):
        claims.require_bounded_moves(mission(movement="vertex"))


def test_a_uav_that_plans_without_need_is_noticed() -> None:
    claims.require_few_plans(mission(replan="change"))
    with pytest.raises(AssertionError, match="plans after"):
        claims.require_few_plans(mission())


def test_a_uav_that_stops_falling_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A UAV that plans, but is put back to where it was, does not get cheaper."""

    class PutBack(Simulation):
        def advance(self) -> None:
            before = [agent.position for agent in self._agents]
            super().advance()
            if self.tick == 5:
                for agent, position in zip(self._agents, before, strict=True):
                    agent.position = position

    with monkeypatch.context() as patched:
        patched.setattr("cgla_graph.mission.simulation.Simulation", PutBack)
        with pytest.raises(AssertionError, match="the cost to go went from"):
            claims.require_falling_cost(mission())
    claims.require_falling_cost(mission())


def test_plans_from_lattice_points_break_the_argument() -> None:
    """The step of the proof is about plans that begin where the UAV is: it is false of the others."""
    stored = counterexamples.mission(claims.SNAPPED).missions(get)
    claims.require_falling_cost(stored["from where the UAV is"])
    claims.require_few_plans(stored["from the nearest lattice point, only where something new is seen"])
    with pytest.raises(AssertionError, match="flies in circles"):
        claims.require_falling_cost(stored["from the nearest lattice point"])


@pytest.mark.slow
def test_a_stored_livelock_that_arrives_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert [flight.livelock is not None for flight in claims.stored_livelocks()] == [True, True]
    file = counterexamples.mission(claims.SNAPPED)
    cured = {
        name: dataclasses.replace(one, settings={**one.settings, "start": "exact"})
        for name, one in file.variants.items()
    }
    monkeypatch.setattr(counterexamples, "mission", lambda _: dataclasses.replace(file, variants=cured))
    with pytest.raises(AssertionError, match=f"{claims.SNAPPED} no longer ends in a livelock"):
        claims.stored_livelocks()


def test_c18_holds_with_all_known_and_fails_in_flight() -> None:
    records = [{"map": i, "differs": i < 3} for i in range(20)]
    (row,) = check("C18", exclusion=Samples(records)).rows
    assert (row.answer, row.size) == (Answer.DEPENDS, "15 % of flights differ")


def test_a_path_that_needs_the_point_before_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """If leaving a point out made the way from the next one dearer, the argument would be wrong."""
    assert claims.require_same_without_previous(np.random.default_rng(1)) > 0
    solve = claims.cost_matrix

    def dearer(graph: GeometricGraph, target: int) -> Any:  # noqa: ANN401 - a cost matrix
        matrix = solve(graph, target)
        whole = math.isqrt(graph.n_nodes) ** 2 == graph.n_nodes
        return matrix if whole else SimpleNamespace(value=lambda node: 1.01 * matrix.value(node))

    monkeypatch.setattr(claims, "cost_matrix", dearer)
    with pytest.raises(AssertionError, match="without the point before"):
        claims.require_same_without_previous(np.random.default_rng(1))


def test_two_flights_are_the_same_up_to_rounding() -> None:
    missions = counterexamples.mission(claims.EXCLUSION).missions(get)
    free, bound = (one.fly().uavs["a"] for one in missions.values())
    assert arrivals.same_trace(free, dataclasses.replace(free, trace=free.trace + 1e-9))
    assert not arrivals.same_trace(free, bound)
    assert not arrivals.same_trace(free, dataclasses.replace(free, trace=free.trace + 1e-3))
    assert claims.turns_back(free, bound) == (1, (0.1, 0.1))
    with pytest.raises(AssertionError, match="not Step 5"):
        claims.turns_back(bound, free)


@pytest.mark.slow
def test_rare_livelocks_are_told_from_frequent_ones() -> None:
    finding = check("C19", starts_of_plans=starts(), pairs_apart=pairs({0.02: 0.0, 0.05: 0.5}))
    never, single, two = finding.rows
    assert [row.answer for row in finding.rows] == [Answer.DEPENDS, Answer.HOLDS, Answer.DEPENDS]
    assert never.where == "as C17"
    assert single.size == "100 % of flights arrive"
    assert two.where.startswith("holds at obstacle spread 0.02; fails at")


@pytest.mark.slow
def test_flights_of_a_map_are_those_that_records_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrivals, "SIZES", {10: (0.2,)})
    (seed,) = seeds_of(KINDS[4], 99, 1)
    map_ = PanelMap(seed)
    records = arrivals.starts_of_plans.sample(map_)
    cases = [(one["n"], one["radius"], one["k"], one["start"]) for one in records]
    assert len(set(cases)) == len(cases) == len(FACTORS["k"]) * 2
    lattice = Lattice(10, bounds=(0.0, 0.0, 1.0, 1.0), kind="upper")
    for one in records:
        flight = Mission(
            World(map_.field, bounds=lattice.bounds),
            [Uav("a", START, map_.goal, 0.2, step=0.02, k=one["k"])],
            get("cgla"),
            lattice,
            arrival_radius=0.025,
            replan="tick",
            start=one["start"],
        ).fly()
        assert (one["arrived"], one["livelock"]) == (flight.all_arrived, flight.livelock is not None)
        assert one["ticks"] == flight.ticks
    # on this map of thirty narrow threats, both ends are seen
    assert {one["livelock"] for one in records} == {True, False}


@pytest.mark.slow
def test_exclusion_and_pairs_are_measured_in_each_case_once(monkeypatch: pytest.MonkeyPatch) -> None:
    (one,) = arrivals.exclusion.sample(PanelMap(96_000_001))
    assert (one["differs"], one["arrived"]) == (False, True)
    monkeypatch.setattr(arrivals, "PAIR_SIZES", (12,))
    records = arrivals.pairs_apart.sample(PanelMap(96_000_001))
    cases = [(record["course"], record["obstacle"], record["n"], record["varied"]) for record in records]
    assert len(set(cases)) == len(cases) == 4 + len(arrivals.VARIED_PAIRS)
    flight = arrivals.fly_pair(PanelMap(96_000_001).field, arrivals.SWAPPED, 0.05, 12, radius=0.2, k=200.0)
    assert records[cases.index((arrivals.SWAPPED, 0.05, 12, "K = 200"))]["ticks"] == flight.ticks

"""What many UAVs share, meet and see, against plain loops over all pairs."""

import dataclasses
import math
from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, fast, few

import cgla_graph as cg
from cgla_graph._types import Point
from cgla_graph.mission.agent import Agent
from cgla_graph.mission.belief import Belief, Report, sightings
from cgla_graph.mission.encounters import Encounters
from cgla_graph.mission.event_log import EventLog, Learned
from cgla_graph.mission.records import Event
from cgla_graph.mission.sharing import Radio, Sharing
from cgla_graph.mission.simulation import Simulation
from cgla_graph.mission.world import TimedArea, TimedThreat, World
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.motion.trajectory import Trajectory, closest_approach
from cgla_graph.motion.trajectory_kernels import Disc
from cgla_graph.testing.strategies import seeds

PLACES = [Threat(0.1 * i, 0.5, 0.05) for i in range(4)]


def believed(journal: list[Report]) -> dict[tuple[str, int], Threat | None]:
    """Return what some reports amount to, by the definition."""
    found = {}
    for thing in sorted({report.thing for report in journal}, key=lambda one: (one[0] == "area", one[1])):
        seen = [report for report in journal if report.thing == thing and report.is_there]
        if not seen:
            continue
        newest = max(seen, key=lambda one: (one.tick, -one.origin, repr(one.content)))
        gone = (one.tick for one in journal if (one.thing, one.content) == (thing, newest.content) and not one.is_there)
        if not any(tick > newest.tick for tick in gone):
            found[thing] = newest.content
    return found


class PlainRadio:
    """Every UAV sends all that it knows to every other one, one pair after the other."""

    def __init__(self, sharing: Sharing) -> None:
        self.sharing = sharing
        self.under_way: list[tuple[int, int, int, list[Report]]] = []

    def exchange(self, tick: int, journals: dict[int, list[Report]], positions: list[Point]) -> list[tuple[int, ...]]:
        numbers = list(journals)
        heard = self.sharing.heard(tick, np.array(positions).reshape(-1, 2))
        for i, sender in enumerate(numbers):
            for j, receiver in enumerate(numbers):
                if heard[i, j]:
                    self.under_way.append((tick + self.sharing.delay, sender, receiver, journals[sender].copy()))
        learned = []
        for _, sender, receiver, reports in [message for message in self.under_way if message[0] <= tick]:
            new = [report for report in reports if report not in journals.get(receiver, reports)]
            if new:
                journals[receiver] += new
                learned.append((receiver, sender, tuple(new)))
        self.under_way = [message for message in self.under_way if message[0] > tick]
        return learned


@examples(60)
@given(seeds, st.sampled_from([None, 0.3, 0.7]), st.integers(0, 3), st.sampled_from([0.0, 0.4]), st.booleans())
def test_what_is_learned_is_what_a_loop_over_all_pairs_delivers(
    seed: int, radius: float | None, delay: int, loss: float, together: bool
) -> None:
    rng = np.random.default_rng(seed)
    sharing = Sharing(radius=radius, delay=delay, loss=loss, seed=seed % 7)
    radio, plain = Radio(sharing), PlainRadio(sharing)
    numbers = rng.choice(20, rng.integers(1, 7), replace=False).tolist()
    beliefs = {number: Belief(radio.log if together else None) for number in numbers}
    journals: dict[int, list[Report]] = {number: [] for number in numbers}
    for tick in range(8):
        for number in list(beliefs):
            if rng.random() < 0.1 and len(beliefs) > 1:
                # it arrived
                del beliefs[number], journals[number]
                continue
            seen = [
                Report(("threat", int(i)), PLACES[rng.integers(4)], bool(rng.random() < 0.8), tick, number)
                for i in rng.choice(5, rng.integers(0, 3), replace=False)
            ]
            if rng.random() < 0.2:
                seen.append(Report(("area", 1), None, bool(rng.random() < 0.5), tick, number))
            journals[number] += [report for report in seen if report not in journals[number]]
            beliefs[number].hear(seen)
        positions = [tuple(spot) for spot in rng.random((len(beliefs), 2)).tolist()]
        learned = radio.exchange(tick, beliefs, positions)
        assert [(one, other, tuple(new)) for one, other, new in learned] == plain.exchange(tick, journals, positions)
        differ = any(set(one) != set(journals[min(journals)]) for one in journals.values())
        assert radio.can_teach(beliefs) == (bool(radio.under_way) or differ)
        for number, belief in beliefs.items():
            assert belief.journal == journals[number]
            assert list(belief.things.items()) == list(believed(journals[number]).items())


@examples(40)
@given(seeds, st.sampled_from([0.0, 0.05, 0.3]), st.sampled_from([0.0, 0.2]))
def test_separations_and_collisions_are_those_of_all_pairs(seed: int, collision: float, terminal: float) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    discs = [Disc((*rng.random(2).tolist(),), terminal) for _ in range(n)]
    encounters = Encounters([f"u{i}" for i in range(n)], discs, collision)
    spots = rng.random((n, 2))
    best: dict[tuple[int, int], tuple[float, ...]] = {}
    touching: set[tuple[int, int]] = set()
    for tick in range(6):
        legs = {}
        for i in np.flatnonzero(rng.random(n) < 0.8).tolist():
            times = [tick, *np.sort(tick + rng.random(rng.integers(0, 3))).tolist(), tick + 1]
            legs[i] = Trajectory(times, np.vstack([spots[i], spots[i] + 0.1 * rng.normal(size=(len(times) - 1, 2))]))
            spots[i] = legs[i].goal
        collided = {}
        for i, j in combinations(legs, 2):
            found = closest_approach(legs[i], legs[j], outside=(discs[i], discs[j]))
            if found is None:
                continue
            if found.distance < best.get((i, j), (math.inf,))[0]:
                best[i, j] = found.distance, found.time, *found.where
            if found.distance < collision:
                collided[i, j] = found, (i, j) not in touching
        assert encounters.measure(legs) == collided
        touching = set(collided)
    for pair in encounters.separations:
        at = int(pair.first[1:]), int(pair.second[1:])
        assert (pair.distance, pair.time, *pair.where) == pytest.approx(
            best.get(at, (math.inf, *[math.nan] * 3)), rel=0, abs=0, nan_ok=True
        )
    assert len(encounters.separations) == n * (n - 1) // 2


def test_uavs_that_never_fly_meet_nowhere() -> None:
    (pair,) = Encounters(["a", "b"], [Disc((0.0, 0.0), 0.1)] * 2, 0.1).separations
    assert (pair.distance, math.isnan(pair.time)) == (math.inf, True)
    uavs = [cg.Uav(name, (0.1, y), (0.9, y), 0.2) for name, y in (("a", 0.1), ("b", 0.9))]
    flight = cg.Mission(cg.World(), uavs, cg.solvers.get("cgla"), resolution=3).simulate().flight(interrupted=True)
    assert (flight.least_separation, len(flight.separations), flight.closest) == (math.inf, 1, None)


@fast
@given(seeds, st.sampled_from([0.1, 0.25, math.inf]), st.integers(1, 3), st.integers(0, 4))
def test_what_is_seen_is_what_a_loop_over_all_things_measures(
    seed: int, radius: float, n_points: int, tick: int
) -> None:
    rng = np.random.default_rng(seed)
    # on a coarse grid, so that some are on the rim
    spots = rng.integers(0, 9, (12 + n_points, 2)) * 0.125
    timed = [
        *(TimedThreat(Threat(*spot, 0.1), appears=int(rng.integers(3)), vanishes=4) for spot in spots[:3]),
        *(TimedArea(shapely.box(*spot, *(spot + 0.1)), appears=int(rng.integers(4))) for spot in spots[3:6]),
    ]
    world = World(RiskField([Threat(*spot, 0.1) for spot in spots[6:12]]), timed=timed)
    belief, seen_from = Belief(), spots[12:]
    belief.hear(sightings(world, max(tick - 2, 0), Belief(), rng.random((1, 2)), 0.4, 0))
    there = {("threat", i): threat for i, threat in world.threats_at(tick).items()}
    there |= dict.fromkeys([("area", i) for i in world.areas_at(tick)])
    looking = shapely.Point(*seen_from[0]) if n_points == 1 else shapely.LineString(seen_from)
    expected = []
    for is_there, mine, other in ((False, belief.things, there), (True, there, belief.things)):
        for thing, content in mine.items():
            place = world.polygons[thing[1]] if content is None else shapely.Point(content.x, content.y)
            if (thing, content) not in other.items() and shapely.distance(looking, place) <= radius:
                expected.append(Report(thing, content, is_there, tick, 7))
    assert sightings(world, tick, belief, seen_from, radius, 7) == expected


@few
@given(seeds, st.booleans(), st.sampled_from(["simultaneous", "sequential"]))
def test_a_flight_is_the_same_where_every_pair_is_looked_at(seed: int, obstacles: bool, update: str) -> None:
    rng = np.random.default_rng(seed)
    starts = [tuple(spot) for spot in (0.1 + 0.8 * rng.random((5, 2))).tolist()]
    uavs = [
        cg.Uav(f"u{i}", start, (0.5, 0.1 + 0.2 * i), 0.3, safe_distance=0.15, departs=3 * i, k=5.0)
        for i, start in enumerate(starts)
    ]
    world = cg.World(cg.RiskField([Threat(*spot, 0.08) for spot in rng.random((4, 2)).tolist()]))
    rules = {"virtual_obstacle": obstacles, "update": update, "collisions": "record", "max_ticks": 60}
    mission = cg.Mission(world, uavs, cg.solvers.get("cgla"), resolution=6, **rules)  # type: ignore[arg-type]

    def plain(self: Simulation, agent: Agent, _: float) -> list[Agent]:
        return [other for other in self._agents if other.in_air and other is not agent]

    flight = mission.fly()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Simulation, "_near", plain)
        twin = mission.fly()
    assert flight.events == twin.events
    for one, other in zip(flight.uavs.values(), twin.uavs.values(), strict=True):
        assert np.array_equal(one.path, other.path)
        assert one.obstacles == other.obstacles


def test_a_log_of_messages_reads_like_the_list_of_its_events() -> None:
    told = [Report(("area" if i % 2 else "threat", i), None, i < 2, tick=i, origin=i % 2) for i in range(4)]
    log, names = EventLog(), ["a", "b"]
    entries = [Event(0, "departed", "a"), Learned(1, "a", "b", told, names), Event(1, "planned", "a")]
    for entry in [*entries, Learned(2, "b", "a", told[:1], names)]:
        log.append(entry)
    plain = list(log)
    assert [event.detail.get("area", event.detail.get("threat")) for event in plain[1:5]] == [0, 1, 2, 3]
    assert plain[2].document() == {
        "tick": 1, "kind": "learned", "uav": "a",
        "area": 1, "source": "b", "origin": "b", "seen": 1, "is_there": True,
    }  # fmt: skip
    assert len(log) == len(plain) == 7
    assert [log[i] for i in range(-7, 7)] == plain * 2
    assert (log[2:5], log[::-2]) == (tuple(plain[2:5]), tuple(plain[::-2]))
    assert log == plain
    assert log == tuple(plain)
    assert log == log.copy()
    assert log != plain[:-1]
    assert log != [*plain[:-1], dataclasses.replace(plain[-1], tick=9)]
    kept = log.without(1, "a", ("planned", "departed"))
    assert list(kept) == [event for event in plain if event.kind != "planned"]
    with pytest.raises(IndexError):
        log[7]

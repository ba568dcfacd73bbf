"""Beliefs, sensing and sharing of UAVs."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import fast, usual

from cgla_graph.errors import MissionError
from cgla_graph.mission.belief import Belief, Report, sightings
from cgla_graph.mission.sharing import Radio, Sharing
from cgla_graph.mission.world import TimedArea, TimedThreat, World
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.testing.strategies import seeds

PLACES = [Threat(0.1 * i, 0.5, 0.05) for i in range(4)]
reports = st.builds(
    Report,
    st.tuples(st.just("threat"), st.integers(0, 2)),
    st.sampled_from(PLACES),
    st.booleans(),
    st.integers(0, 6),
    st.integers(0, 2),
)


@fast
@given(st.lists(reports, max_size=12), st.randoms(use_true_random=False))
def test_beliefs_do_not_depend_on_the_order_of_reports(heard: list[Report], random: object) -> None:
    one, other = Belief(), Belief()
    one.hear(heard)
    mixed = list(heard)
    random.shuffle(mixed)  # type: ignore[attr-defined]
    for report in mixed:
        other.hear([report])
    assert one.threats == other.threats
    assert list(one.threats) == sorted(one.threats)
    assert set(one.journal) == set(heard)
    assert len(one.journal) == len(set(heard))


@fast
@given(st.lists(reports, max_size=12))
def test_the_newest_sighting_counts_unless_a_later_report_refutes_it(heard: list[Report]) -> None:
    belief = Belief()
    belief.hear(heard)
    for number in range(3):
        about = [report for report in heard if report.thing == ("threat", number)]
        newest = max((report.tick for report in about if report.is_there), default=-1)
        candidates = [report.content for report in about if report.is_there and report.tick == newest]
        standing = [
            content
            for content in candidates
            if not any(not no.is_there and no.content == content and no.tick > newest for no in about)
        ]
        # (of two places on one tick, either may be the one that counts)
        assert belief.threats.get(number) in (standing if len(standing) == len(candidates) > 0 else [None, *standing])


def test_an_absence_refutes_the_place_where_the_threat_was_believed_and_no_other() -> None:
    one, other = Belief(), Belief()
    # a place that the threat has left is not believed in again
    for tick, place, is_there in [(0, PLACES[0], True), (4, PLACES[1], True), (14, PLACES[1], False)]:
        one.hear([Report(("threat", 0), place, is_there=is_there, tick=tick, origin=0)])
    for tick, place, is_there in [(5, PLACES[1], True), (9, PLACES[0], False)]:
        other.hear([Report(("threat", 0), place, is_there=is_there, tick=tick, origin=0)])
    assert (dict(one.threats), dict(other.threats)) == ({}, {0: PLACES[1]})


def test_the_fields_of_eq_5_hold_the_sightings_of_each_uav() -> None:
    belief = Belief()
    sighted = [(0, 0, 1, True), (2, 0, 1, True), (1, 2, 0, True), (2, 2, 0, True), (0, 4, 0, False)]
    for i, tick, origin, is_there in sighted:
        belief.hear([Report(("threat", i), PLACES[i], is_there=is_there, tick=tick, origin=origin)])
    assert [field.threats for field in belief.fields_by_origin()] == [(PLACES[1], PLACES[2]), (PLACES[2],)]


def test_a_uav_sees_things_within_its_radius_and_their_absence() -> None:
    world = World(
        RiskField([Threat(0.5, 0.5, 0.1)]),
        timed=[TimedThreat(Threat(0.2, 0.5, 0.1), vanishes=5), TimedArea(shapely.box(0.3, 0.6, 0.4, 0.7), 2, 5)],
    )
    here, belief = np.array([[0.3, 0.5]]), Belief()

    def look(tick: int, radius: float = 0.15) -> list[tuple[tuple[str, int], bool]]:
        return [(new.thing, new.is_there) for new in belief.hear(sightings(world, tick, belief, here, radius, 0))]

    assert look(0) == [(("threat", 1), True)]
    assert look(1) == []
    assert look(2) == [(("area", 1), True)]
    assert look(3, radius=0.2) == [(("threat", 0), True)]
    assert look(6, radius=0.05) == []
    assert look(6) == [(("threat", 1), False), (("area", 1), False)]
    assert (dict(belief.threats), belief.areas) == ({0: world.field.threats[0]}, frozenset())


def test_the_rim_of_the_radius_belongs_to_it_and_a_leg_is_looked_along() -> None:
    world = World(RiskField([Threat(0.5, 0.25, 0.1)]))
    at = np.array([[0.5, 0.0]])
    assert len(sightings(world, 0, Belief(), at, 0.25, 0)) == 1
    assert sightings(world, 0, Belief(), at, math.nextafter(0.25, 0), 0) == []
    leg = np.array([[0.0, 0.0], [1.0, 0.0]])
    assert len(sightings(world, 0, Belief(), leg, 0.25, 0)) == 1
    assert sightings(world, 0, Belief(), leg[:1], 0.25, 0) == []


def exchange_until(sharing: Sharing, positions: list[tuple[float, float]], ticks: int) -> list[list[int]]:
    """Give UAV 0 a report; return the numbers of the UAVs that know it after each tick."""
    beliefs = {number: Belief() for number in range(len(positions))}
    beliefs[0].hear([Report(("threat", 0), PLACES[0], is_there=True, tick=0, origin=0)])
    radio, known = Radio(sharing), []
    for tick in range(ticks):
        radio.exchange(tick, beliefs, positions)
        known.append([number for number, belief in beliefs.items() if belief.journal])
    return known


CHAIN = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]


@pytest.mark.parametrize(
    ("sharing", "known"),
    [
        (Sharing(is_on=False), [[0], [0], [0], [0]]),
        (Sharing(), [[0, 1, 2]] * 4),
        (Sharing(delay=2), [[0], [0], [0, 1, 2], [0, 1, 2]]),
        (Sharing(radius=1.0), [[0, 1], [0, 1, 2], [0, 1, 2], [0, 1, 2]]),
        # reports that arrive at tick 1 are passed on from tick 2 on
        (Sharing(radius=1.0, delay=1), [[0], [0, 1], [0, 1], [0, 1, 2]]),
        (Sharing(radius=0.5), [[0]] * 4),
    ],
)
def test_knowledge_spreads_as_far_and_as_fast_as_the_radio_carries(sharing: Sharing, known: list[list[int]]) -> None:
    assert exchange_until(sharing, CHAIN, 4) == known


@usual
@given(seeds, st.floats(0.1, 0.9))
def test_lost_messages_are_sent_again_and_the_seed_says_which_are_lost(seed: int, loss: float) -> None:
    sharing = Sharing(loss=loss, seed=seed)
    runs = [exchange_until(sharing, CHAIN, 200) for _ in range(2)]
    assert runs[0] == runs[1]
    assert runs[0][-1] == [0, 1, 2]
    heard = np.mean([sharing.heard(tick, np.zeros((10, 2))).sum() / 90.0 for tick in range(50)])
    assert heard == pytest.approx(1.0 - loss, abs=0.05)


def test_uavs_that_have_left_neither_send_nor_hear() -> None:
    beliefs = {number: Belief() for number in range(3)}
    beliefs[0].hear([Report(("threat", 0), PLACES[0], is_there=True, tick=0, origin=0)])
    radio = Radio(Sharing(delay=1))
    assert radio.exchange(0, beliefs, CHAIN) == []
    del beliefs[2]
    learned = radio.exchange(1, beliefs, CHAIN[:2])
    assert [(receiver, sender) for receiver, sender, _ in learned] == [(1, 0)]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"radius": 0.0}, "radius is 0"),
        ({"delay": 0.5}, "delay is 0.5"),
        ({"loss": 1.0}, "loss is 1; it must be at least 0 and below 1"),
        ({"seed": -1}, "seed is -1"),
        ({"is_on": 1}, "is_on is 1"),
    ],
)
def test_malformed_sharing_is_refused_by_name(settings: dict[str, object], words: str) -> None:
    with pytest.raises(MissionError) as caught:
        Sharing(**settings)  # type: ignore[arg-type]
    assert words in str(caught.value)
    with pytest.raises(MissionError, match="some"):
        Sharing.parse("some")

"""Worlds of missions: threats and areas at each tick."""

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import fast

from cgla_graph.errors import MissionError, ProblemError
from cgla_graph.mission.world import TimedArea, TimedThreat, World
from cgla_graph.model.risk import RiskField, Threat

SPOT = Threat(0.5, 0.5, 0.1)
BOX = shapely.box(0.2, 0.2, 0.4, 0.4)
ticks = st.integers(0, 12)


@fast
@given(st.lists(st.tuples(ticks, st.one_of(st.none(), ticks)), max_size=4), ticks)
def test_things_exist_from_when_they_appear_until_they_vanish(lives: list[tuple[int, int | None]], tick: int) -> None:
    lives = [(first, last) for first, last in lives if last is None or last > first]
    threats = [TimedThreat(Threat(i, 0, 1), first, last) for i, (first, last) in enumerate(lives)]
    areas = [TimedArea(shapely.box(i, 0, i + 0.5, 1), first, last) for i, (first, last) in enumerate(lives)]
    world = World(RiskField([SPOT]), timed=[*threats, *areas])
    there = [i for i, (first, last) in enumerate(lives) if first <= tick and (last is None or tick < last)]
    assert dict(world.threats_at(tick)) == {0: SPOT, **{1 + i: threats[i].threat for i in there}}
    assert list(world.areas_at(tick)) == [len(lives) + i for i in there]
    assert world.field_at(tick).threats == tuple(world.threats_at(tick).values())


def test_a_threat_is_where_it_last_moved_to() -> None:
    threat = TimedThreat(SPOT, appears=2, vanishes=9, moves=[(4, 0.1, 0.2), (7, 0.3, 0.4)])
    assert [threat.at(tick) for tick in (1, 9, 50)] == [None] * 3
    places = [(there.x, there.y) for tick in (2, 3, 4, 6, 7, 8) if (there := threat.at(tick))]
    assert places == [(0.5, 0.5)] * 2 + [(0.1, 0.2)] * 2 + [(0.3, 0.4)] * 2
    world = World(timed=[threat])
    assert world.changes == (2, 4, 7, 9)


def test_the_field_that_is_always_there_is_the_same_object_at_every_tick() -> None:
    world = World(RiskField([SPOT]), timed=[TimedArea(BOX, 3, 5)])
    assert world.field_at(0) is world.field_at(4) is world.field


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: TimedThreat("here"), "timed threat holds 'here'"),  # type: ignore[arg-type]
        (lambda: TimedThreat(SPOT, appears=-1), "appears is -1"),
        (lambda: TimedThreat(SPOT, appears=5, vanishes=5), "vanishes at tick 5"),
        (lambda: TimedThreat(SPOT, moves=[(3, 0, 0), (3, 1, 1)]), "let the ticks of moves rise"),
        (lambda: TimedThreat(SPOT, moves=[(3, 0)]), "give (tick, x, y)"),  # type: ignore[list-item]
        (lambda: TimedThreat(SPOT, moves=[(3, 0, float("nan"))]), "finite"),
        (lambda: TimedThreat(SPOT, moves=None), "moves are None"),  # type: ignore[arg-type]
        (lambda: TimedArea(shapely.Point(0, 0)), "a timed area"),
        (lambda: TimedArea(shapely.Polygon()), "polygon with an inside"),
        (lambda: TimedArea(BOX, vanishes=0), "vanishes at 0"),
        (lambda: World("field"), "give a RiskField"),  # type: ignore[arg-type]
        (lambda: World(timed=[SPOT]), "give a TimedThreat or a TimedArea"),  # type: ignore[list-item]
        (lambda: World(timed=5), "give a list"),  # type: ignore[arg-type]
        (lambda: World(timed=[TimedThreat(Threat(0, 0, 1, peak=2.0))]), "peak 2"),
    ],
)
def test_malformed_parts_are_refused_by_name(build: object, words: str) -> None:
    with pytest.raises((MissionError, ProblemError)) as caught:
        build()  # type: ignore[operator]
    assert words in str(caught.value)

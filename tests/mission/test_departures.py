"""Take-offs wait until the start is free, and a delayed departure is recorded as one."""

from collections.abc import Sequence
from typing import Any

import pytest
import shapely

from cgla_graph.errors import MissionError
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus
from cgla_graph.mission.rules import Avoidance
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import TimedArea, World
from cgla_graph.model.problem import Problem
from cgla_graph.motion.space_time import SpaceTimeStatus, plan_in_space_time
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.solvers import get

EVERY: tuple[Avoidance, ...] = ("none", "prioritized")
SAFE = 0.1
#: A corridor of one UAV's width, closed at its east end.
CORRIDOR = shapely.unary_union([shapely.box(-1, -1, 2, 0.45), shapely.box(-1, 0.55, 2, 2), shapely.box(0.85, 0, 2, 1)])


def uav(
    name: str, start: tuple[float, float], goal: tuple[float, float], departs: int = 0, step: float | None = None
) -> Uav:
    return Uav(name, start, goal, 0.3, step, safe_distance=SAFE, departs=departs)


def flown(uavs: Sequence[Uav], world: World | None = None, **settings: Any) -> Flight:  # noqa: ANN401 - settings of missions
    return Mission(world or World(), uavs, get("cgla"), resolution=10, **settings).fly()


def delays(flight: Flight, name: str) -> list[tuple[int, str]]:
    """List when a UAV began to wait for something, and for what."""
    return [(event.tick, event.hindrance) for event in flight.events if event.kind == "delayed" and event.uav == name]


@pytest.mark.parametrize("avoidance", EVERY)
@pytest.mark.parametrize("goal", [(0.9, 0.5), (0.5, 0.5), (0.55, 0.5)], ids=["passes", "lands there", "lands beside"])
@pytest.mark.parametrize("offset", [0.0, 0.06])
def test_a_uav_waits_until_no_other_is_near_its_start(
    avoidance: Avoidance, goal: tuple[float, float], offset: float
) -> None:
    passing, late = uav("passing", (0.1, 0.5), goal), uav("late", (0.5, 0.5 + offset), (0.5, 0.9), 9)
    flight = flown([passing, late], avoidance=avoidance)
    other, one = flight.uavs["passing"], flight.uavs["late"]

    assert flight.all_arrived
    assert one.departed - 9 == one.delayed > 0
    assert flight.least_separation >= SAFE
    assert delays(flight, "late")[0] == (9, f"UAV passing is {(0.04**2 + offset**2) ** 0.5:.3g} from its start")
    # it left as soon as it could
    before = other.position_at(one.departed - 1)
    assert before is not None
    assert ((before[0] - 0.5) ** 2 + (before[1] - 0.5 - offset) ** 2) ** 0.5 < SAFE
    assert [event.tick for event in flight.events if event.kind == "departed"] == [0, one.departed]


@pytest.mark.parametrize("avoidance", EVERY)
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 3, 0, 2)])
def test_a_chain_leaves_one_start_one_after_the_other(avoidance: Avoidance, order: Sequence[int]) -> None:
    goals = [(0.9, 0.9), (0.9, 0.1), (0.1, 0.9), (0.9, 0.5)]
    team = [uav(f"u{number}", (0.1, 0.1), goals[number], number) for number in order]
    flight = flown(team, avoidance=avoidance)

    assert flight.all_arrived
    assert flight.least_separation >= SAFE
    departed = [flight.uavs[f"u{number}"].departed for number in range(4)]
    assert departed[0] == 0
    assert len(set(departed)) == 4


@pytest.mark.parametrize("avoidance", EVERY)
def test_equal_starts_at_one_tick_are_refused_with_the_remedy(avoidance: Avoidance) -> None:
    with pytest.raises(MissionError, match=r"UAVs a and b start 0 apart.*let one depart later"):
        flown([uav("a", (0.1, 0.1), (0.9, 0.9)), uav("b", (0.1, 0.1), (0.9, 0.1))], avoidance=avoidance)


def test_a_start_that_others_landed_on_is_free() -> None:
    team = [uav("first", (0.1, 0.5), (0.5, 0.5)), uav("late", (0.5, 0.5), (0.9, 0.5), 30)]
    assert flown(team, avoidance="prioritized").uavs["late"].delayed == 0


@pytest.mark.parametrize("avoidance", EVERY)
def test_an_area_over_the_start_of_a_uav_that_waits_delays_it_further(avoidance: Avoidance) -> None:
    world = World(timed=[TimedArea(shapely.box(0.45, 0.45, 0.55, 0.55), 12, 40)])
    team = [uav("passing", (0.1, 0.5), (0.9, 0.5)), uav("late", (0.5, 0.5), (0.5, 0.9), 9)]
    flight = flown(team, world, avoidance=avoidance)

    assert flight.all_arrived
    assert flight.uavs["late"].departed == 40
    assert delays(flight, "late")[1:] == [(12, "area 0 is closed over its start")]


def test_an_area_that_closes_the_border_at_the_start_delays_it_too() -> None:
    world = World(timed=[TimedArea(shapely.box(0.45, 0.0, 0.55, 0.1), 12, 40)])
    team = [uav("passing", (0.1, 0.0), (0.9, 0.0)), uav("late", (0.5, 0.0), (0.5, 0.4), 9)]
    flight = flown(team, world)

    assert flight.uavs["late"].departed == 40
    assert delays(flight, "late")[1:] == [(12, "area 0 is closed over its start")]


@pytest.mark.parametrize("avoidance", EVERY)
def test_who_is_on_a_start_that_never_gets_free_is_said(avoidance: Avoidance) -> None:
    team = [uav("slow", (0.5, 0.5), (0.5, 0.52), step=1e-3), uav("late", (0.5, 0.5), (0.9, 0.5), 1)]
    late = flown(team, avoidance=avoidance, max_ticks=10).uavs["late"]

    assert (late.status, late.took_off, late.delayed) == (MissionStatus.OUT_OF_TICKS, False, 9)
    assert late.message == "10 ticks are over; it never took off: UAV slow is 0.009 from its start"


def test_a_uav_without_a_safe_plan_waits_on_the_ground() -> None:
    team = [uav("in", (0.1, 0.5), (0.75, 0.5)), uav("out", (0.7, 0.5), (0.1, 0.5), 3)]
    flight = flown(team, World(no_fly=CORRIDOR), avoidance="prioritized")

    assert flight.all_arrived
    assert flight.uavs["out"].departed == flight.uavs["in"].ended
    assert delays(flight, "out")[0][1].startswith("no plan keeps the safe distance from in: ")
    departures = [(event.uav, event.tick) for event in flight.events if event.kind == "departed"]
    assert departures == [("in", 0), ("out", flight.uavs["out"].departed)]
    assert len(flight.uavs["out"].trace) == flight.uavs["out"].ended - flight.uavs["out"].departed + 1


def test_a_uav_that_has_no_path_at_all_does_not_wait() -> None:
    team = [uav("a", (0.1, 0.1), (0.9, 0.9)), uav("b", (0.1, 0.9), (0.9, 0.1), 2)]
    walled = World(no_fly=shapely.box(0.8, -1, 0.85, 2))
    flight = flown(team, walled, avoidance="prioritized")
    assert {one.status for one in flight.uavs.values()} == {MissionStatus.NO_PATH}


def test_messages_name_the_others() -> None:
    problem = Problem((0, 0), (1, 1))
    graph = problem.on_lattice(5)
    from cgla_graph.cost_to_go.cost_matrix import cost_matrix  # noqa: PLC0415

    matrix = cost_matrix(graph.graph, graph.target)
    near = [(Trajectory([0, 9], [(0, 0.01), (1, 0)]), 0.1)]
    for names, word in (((), "trajectory 0"), (("UAV a",), "UAV a")):
        plan = plan_in_space_time(problem, matrix, near, start_time=0, step=0.1, latest=50, names=names)
        assert plan.status is SpaceTimeStatus.TOO_CLOSE
        assert plan.message == f"at tick 0 {word} is 0.01 away, not 0.1"

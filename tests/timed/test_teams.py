"""Teams whose flights keep apart."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph.errors import ProblemError
from cgla_graph.motion.trajectory import Trajectory

THREAT = cg.RiskField([cg.Threat(0.4, 0.55, 0.1, 0.5)])


def flight(start: tuple[float, float], goal: tuple[float, float], **changes: object) -> cg.TimedProblem:
    return cg.TimedProblem(start, goal, speed=1.0, **changes)  # type: ignore[arg-type]


def planned(problems: list[cg.TimedProblem], separation: float = 0.1, **settings: object) -> cg.TeamPlan:
    return cg.solve_team(problems, separation, **{"nodes": 2_000, "tolerance": None, **settings})  # type: ignore[arg-type]


def sampled_distance(a: cg.TimedPlan, b: cg.TimedPlan) -> float:
    """Return the least distance at many times when both fly, without the library's closest approach."""
    first, last = max(a.departure, b.departure), min(a.arrival, b.arrival)
    if first > last:
        return math.inf
    times = np.linspace(first, last, 4000)
    places = [[np.interp(times, one.trajectory[:, 0], one.path[:, i]) for i in (0, 1)] for one in (a, b)]
    return float(np.hypot(*np.subtract(*places)).min())


@pytest.mark.slow
def test_both_share_the_detour() -> None:
    """If one alone made way, as in each order that is not polite, the team would cost 1.6248."""
    west_east = flight((0.1, 0.5), (0.9, 0.5)), flight((0.9, 0.5), (0.1, 0.5))
    team = planned(list(west_east), tolerance=0.01)
    assert team.lower_bound == pytest.approx(1.6, rel=1e-8)
    # each is off by half of the separation: twice 2 (r / 2)^2 / 0.8
    assert 1.6 < team.cost < 1.6135
    assert 0.0 < team.gap < 0.0085
    assert team.least_distance >= 0.1


@examples(4)
@given(st.integers(0, 999))
def test_flights_of_a_team_keep_apart(seed: int) -> None:
    """A team whose flights ignore those planned before fails in the oracle."""
    rng = np.random.default_rng(seed)
    angles = rng.uniform(0.0, math.tau) + math.tau / 3.0 * np.arange(3)
    ends = 0.5 + 0.4 * np.column_stack([np.cos(angles), np.sin(angles)])
    problems = [flight(tuple(end), tuple(1.0 - end), field=THREAT, k=2.0) for end in ends]
    team = planned(problems, 0.06, orders=1)
    assert team.status.label == "found"
    assert team.least_distance >= 0.06 * (1.0 - 1e-9)
    for a, b in itertools.combinations(team.plans, 2):
        assert sampled_distance(a, b) >= 0.06 * (1.0 - 1e-6)
    for problem, plan, alone in zip(problems, team.plans, team.alone, strict=True):
        seen = problem.evaluate(plan.trajectory)
        assert seen.feasible
        assert seen.cost == plan.cost >= alone.cost * (1.0 - 1e-3)
        assert len(plan.problem.others) == 2
    assert team.cost == sum(plan.cost for plan in team.plans)


def test_who_may_depart_later_does() -> None:
    """Both depart from one place, and one has a window: nothing is lost."""
    start, goals = (0.1, 0.5), [(0.9, 0.3), (0.9, 0.7)]
    team = planned([flight(start, goals[0], departure=(0.0, 2.0)), flight(start, goals[1])])
    assert team.status.has_path
    assert team.cost == pytest.approx(2.0 * math.hypot(0.8, 0.2), rel=1e-3)
    again = planned([flight(start, goals[0], departure=(0.0, 2.0)), flight(start, goals[1])])
    assert all(np.array_equal(a.trajectory, b.trajectory) for a, b in zip(team.plans, again.plans, strict=True))


def test_without_a_team_it_says_so() -> None:
    both = planned([flight((0.1, 0.5), (0.9, 0.5)), flight((0.1, 0.5), (0.5, 0.9))], orders=1)
    assert (both.status.label, both.plans, both.cost) == ("not-found", (), math.inf)
    assert "some may exist" in both.message
    late = planned([flight((0.1, 0.5), (0.9, 0.5)), flight((0.1, 0.1), (0.9, 0.1), latest=0.5)])
    assert not late.status.has_path
    assert late.message.startswith("UAV 1 has no flight of its own")


def test_others_of_a_flight_are_evaded_too() -> None:
    passing = Trajectory([0, 0.8], [(0.5, 0.9), (0.5, 0.1)])
    alone = planned([flight((0.1, 0.5), (0.9, 0.5), others=[passing], separation=0.1)])
    assert alone.plans[0].problem.evaluate(alone.plans[0].trajectory).separation >= 0.1
    with pytest.raises(ProblemError, match=r"problem 0 keeps 0.1 from others, and the team 0.2"):
        planned([flight((0.1, 0.5), (0.9, 0.5), others=[passing], separation=0.1)], 0.2)
    with pytest.raises(ProblemError, match="problems is empty"):
        planned([])

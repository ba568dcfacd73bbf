"""Flights that keep away from the trajectories of others."""

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.solvers.timed.charting import chart_of
from cgla_graph.solvers.timed.passing import _tolls, with_others
from cgla_graph.solvers.timed.solving_timed import bound_in_time
from cgla_graph.solvers.timed.timed_kernels import flight_cost
from cgla_graph.timed.space_time_proof import timed_lower_bound

WEST, EAST = (0.1, 0.5), (0.9, 0.5)


def level(**changes: object) -> cg.TimedProblem:
    """Make a flight of 0.8 time units from west to east."""
    return cg.TimedProblem(WEST, EAST, speed=1.0, **{"separation": 0.1, **changes})  # type: ignore[arg-type]


def planned(problem: cg.TimedProblem) -> cg.TimedPlan:
    return cg.solve(problem, nodes=4_000, tolerance=None)


def random_others(seed: int, count: int) -> list[Trajectory]:
    """Make zigzags that begin and end at any time, and one aircraft that is there at one moment."""
    rng = np.random.default_rng(seed)
    made = [Trajectory([0.4], [(0.5, 0.5)])]
    for _ in range(count):
        times = rng.uniform(0.0, 0.3) + np.arange(4) * rng.uniform(0.1, 0.5)
        made.append(Trajectory(times, rng.random((4, 2))))
    return made


@examples(20)
@given(st.integers(0, 99), st.sampled_from([None, (0.3, -0.2)]), st.sampled_from([None, 0.7]))
def test_penalty_has_its_gradient(seed: int, wind: tuple[float, float] | None, price: float | None) -> None:
    """A gradient without the terms of the times would fail in each case."""
    problem = level(others=random_others(seed, 3), wind=wind, waiting=price)
    chart = chart_of(problem, 9.0)
    rng = np.random.default_rng(seed)
    points = np.linspace(WEST, EAST, 6) + rng.normal(0.0, 0.03, (6, 2))
    waits = rng.uniform(0.01, 0.1, 6) * (price is not None)
    waits[-1] = 0.0
    slopes, unused = np.empty((2, 6, 3))

    def cost(change: np.ndarray, departure: float = 0.05) -> float:
        return flight_cost(chart, points + change[:, :2], waits + change[:, 2], departure, 50.0, 0.05, unused)[0]

    total, by_departure = flight_cost(chart, points, waits, 0.05, 50.0, 0.05, slopes)
    none = np.zeros((6, 3))
    h = 1e-7
    assert by_departure == pytest.approx((cost(none, 0.05 + h) - cost(none, 0.05 - h)) / (2 * h), abs=1e-5)
    for i, j in np.ndindex(6, 2 if price is None else 3):
        if (i, j) != (5, 2):
            change = none.copy()
            change[i, j] = h
            assert slopes[i, j] == pytest.approx((cost(change) - cost(-change)) / (2 * h), abs=1e-5)
    assert total >= flight_cost(chart, points, waits, 0.05, 0.0, 0.0, unused)[0]


@pytest.mark.parametrize("separation", [0.03, 0.1])
def test_costs_next_to_one_that_stands_are_exact(separation: float) -> None:
    """A planner without discs finds none of these flights."""
    in_the_middle = level(others=[Trajectory([0, 9], [(0.5, 0.5), (0.5, 0.5)])], separation=separation)
    tangents = 2.0 * math.sqrt(0.16 - separation**2) + 2.0 * separation * math.asin(separation / 0.4)
    assert tangents * (1.0 - 1e-9) <= planned(in_the_middle).cost <= tangents * (1.0 + 1e-3)
    # the goal is free from 1.6 on
    at_goal = level(others=[Trajectory([0, 1.6], [EAST, EAST])], separation=separation)
    assert planned(at_goal).cost == pytest.approx(1.6 + separation, rel=2e-3)
    waited = planned(dataclasses.replace(at_goal, waiting=0.3)).cost
    assert waited == pytest.approx(0.8 + 0.3 * (0.8 + separation), rel=1e-3)


@pytest.mark.slow
def test_traffic_is_evaded_and_what_passes_elsewhere_is_not() -> None:
    problem = level(others=[Trajectory([0, 0.8], [EAST, WEST])])
    head_on = planned(problem)
    crossing = planned(level(others=[Trajectory([0, 0.8], [(0.5, 0.1), (0.5, 0.9)])]))
    later = planned(level(others=[Trajectory([0.5, 1.3], [(0.2, 0.1), (0.2, 0.9)])]))
    # both about 2 r^2 / 0.8, as measured with 500 000 nodes
    assert 0.8 < head_on.cost < 0.826
    assert 0.8 < crossing.cost < 0.838
    assert later.cost == pytest.approx(0.8, rel=1e-9)
    assert np.array_equal(head_on.trajectory, planned(problem).trajectory)


THREAT = cg.RiskField([cg.Threat(0.4, 0.55, 0.1, 0.5)])


@cache
def proven_alone() -> float:
    """Bound the cost of flights without others."""
    return cg.lower_bound(level(field=THREAT, k=2.0), tolerance=0.05).lower_bound


@examples(12)
@given(st.integers(0, 999), st.sampled_from([0.04, 0.12]), st.sampled_from([None, (0.0, 0.5)]))
def test_no_flight_that_comes_too_near_is_returned(
    seed: int, separation: float, window: tuple[float, float] | None
) -> None:
    """A planner whose bending does not ask the oracle returns flights that come too near, which then fail."""
    problem = level(field=THREAT, k=2.0, departure=window or 0.0, others=random_others(seed, 3), separation=separation)
    plan = planned(problem)
    assert plan.status.label in {"found", "not-found"}
    if plan.status.has_path:
        seen = problem.evaluate(plan.trajectory)
        assert seen.feasible
        assert seen.separation >= separation * (1.0 - 1e-9)
        assert plan.cost >= proven_alone()


def test_start_that_is_held_is_not_found_and_said() -> None:
    plan = planned(level(others=[Trajectory([0, 1], [WEST, WEST])]))
    assert (plan.status.label, plan.cost) == ("not-found", math.inf)
    assert "one may exist" in plan.message
    assert planned(level(others=[Trajectory([0, 1], [WEST, WEST])], departure=(0, 2))).cost == pytest.approx(0.8)


@given(st.integers(0, 10**6))
def test_flights_that_keep_apart_pay_no_tolls_around_others(seed: int) -> None:
    """The twin: tolls for twice the separation."""
    rng = np.random.default_rng(seed)
    problem = level(others=random_others(seed, 3)[1:])
    path = np.linspace(WEST, EAST, 6)
    path[1:-1] += rng.normal(0.0, 0.1, (4, 2))
    rows = problem.fly(path)
    motion = Trajectory(rows[:, 0], rows[:, 1:])
    separation = problem.evaluate(rows).separation
    assume(separation < math.inf)
    kept = dataclasses.replace(problem, separation=separation)
    tolls = list(_tolls(kept, Trajectory([0.0, 0.8], [WEST, EAST])))
    assert sum(toll.paid(motion) for toll in tolls) <= 1e-15
    too_wide = list(_tolls(dataclasses.replace(problem, separation=2.0 * separation), motion))
    assert sum(toll.paid(motion) for toll in too_wide) > 0.0


def test_a_bound_says_where_it_leaves_others_out() -> None:
    head_on = [Trajectory([0, 0.8], [EAST, WEST])]
    turning = cg.Wind([[[0.0, 0.1]]], [[[0.0, 0.0]]], (0, 0, 1, 1))
    for wind, words in ((None, "tolls around others prove no more"), (turning, "others are left out")):
        problem = level(others=head_on, wind=wind)
        proof = bound_in_time(problem, problem.fly([WEST, (0.5, 0.65), EAST]), 1e-3, 100)
        assert proof.message.endswith(words)


@pytest.mark.parametrize("cells", [20_000, pytest.param(300_000, marks=pytest.mark.slow)])
def test_a_bound_counts_what_evading_costs(cells: int) -> None:
    """Alone, it costs 0.8; head on, 0.825."""
    problem = level(others=[Trajectory([0, 0.8], [EAST, WEST])])
    plan = planned(problem)
    alone = planned(level())
    without = timed_lower_bound(level(), alone.trajectory, tolerance=2e-3)
    proof = with_others(problem, plan, alone, dataclasses.replace(without, upper_bound=plan.cost), cells)
    assert without.lower_bound <= 0.8
    assert plan.cost * (0.995 if cells > 20_000 else 0.985) < proof.lower_bound <= plan.cost
    rng, bumps = np.random.default_rng(0), np.sin(np.linspace(0.0, math.pi, len(plan.path)))[:, None]
    for _ in range(300):
        seen = problem.evaluate(problem.fly(plan.path + bumps * rng.normal(0.0, rng.choice([1e-3, 0.03]), 2)))
        assert not seen.feasible or seen.cost >= proof.lower_bound

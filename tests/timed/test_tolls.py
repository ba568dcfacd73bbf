"""Tolls: flights that keep apart pay no more than their integrals, and bounds with them are bounds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.motion.trajectory import Trajectory, least_distance
from cgla_graph.solvers.timed.tolling import _forms
from cgla_graph.timed.floor_kernels import toll_floor
from cgla_graph.timed.space_time_proof import timed_lower_bound
from cgla_graph.timed.timed_problem import tolled
from cgla_graph.timed.tolls import Toll, tolls_from

EAST = cg.TimedProblem((0.1, 0.5), (0.9, 0.5), speed=1.0)
WEST = cg.TimedProblem((0.9, 0.5), (0.1, 0.5), speed=1.0)


def flight(rng: np.random.Generator) -> Trajectory:
    """Draw a flight through the middle of the map, at other times and speeds each."""
    points = 0.5 + rng.uniform(-0.15, 0.15, (4, 2))
    return Trajectory(np.cumsum(rng.uniform(0.02, 0.4, 4)), points)


def toll(rng: np.random.Generator, shape: FloatArray) -> Toll:
    """Draw the place and price of a toll in the middle of the map."""
    times = np.cumsum(rng.uniform(0.05, 0.3, 4))
    centre, prices = Trajectory(times, 0.5 + rng.uniform(-0.05, 0.05, (4, 2))), rng.uniform(0.1, 2.0, 4)
    prices[[0, -1]] = 0.0
    return Toll(centre, prices, (shape[0, 0], shape[0, 1], shape[1, 1]))


def most_paid(seed: int, wider: float) -> float:
    """Return the greatest part of the integral that separated teams pay, with discs that are wider than theirs."""
    rng, most, tried = np.random.default_rng(seed), 0.0, 0
    while tried < 60:
        team = [flight(rng) for _ in range(int(rng.integers(2, 5)))]
        apart = min(least_distance(a, b)[0] for i, a in enumerate(team) for b in team[:i])
        # (most drawn teams are too close to be of use)
        if not 0.02 < apart < math.inf:
            continue
        tried += 1
        any_number = np.eye(2) * 2.0 / (wider * apart) ** 2
        shapes = [(any_number,) * len(team), *_forms(*rng.normal(size=(2, 2)), wider * apart)]
        for shape in shapes:
            state = rng.bit_generator.state
            parts = []
            for form in shape:
                rng.bit_generator.state = state
                parts.append(toll(rng, form))
            paid = sum(part.paid(motion) for part, motion in zip(parts, team, strict=False))
            most = max(most, paid / parts[0].most)
    return most


@examples(4)
@given(st.integers(0, 10**6))
def test_flights_that_keep_apart_pay_no_more_than_the_integral(seed: int) -> None:
    assert most_paid(seed, 1.0) <= 1.0


def test_flights_closer_than_that_pay_more() -> None:
    """The twin: tolls for twice the separation; and their integral counts, without which nothing is paid back."""
    assert most_paid(1, 2.0) > 1.0
    assert most_paid(1, 1.0) > 0.5


@given(st.integers(0, 10**6))
def test_what_a_flight_pays_is_the_integral(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion, one = flight(rng), toll(rng, np.array([[90.0, 20.0], [20.0, 60.0]]))
    t = np.linspace(motion.begins, motion.ends, 40_001)
    x, y = (motion.positions(t) - one.centre.positions(t)).T
    inside = np.maximum(1.0 - 90.0 * x * x - 40.0 * x * y - 60.0 * y * y, 0.0)
    price = np.interp(t, one.centre.times, one.prices)
    assert one.paid(motion) == pytest.approx(np.trapezoid(price * inside, t), abs=1e-5)


@given(st.integers(0, 10**6))
def test_floors_of_tolls_are_below_them(seed: int) -> None:
    """At sampled places and times of a cell; without the bound of the bend, it fails."""
    rng = np.random.default_rng(seed)
    tolls = [toll(rng, np.array([[90.0, 20.0], [20.0, 60.0]])) for _ in range(2)]
    knots = np.unique(np.concatenate([one.centre.times for one in tolls]))
    n = int(rng.integers(0, len(knots) - 1))
    half_time, half = 0.4 * (knots[n + 1] - knots[n]) * rng.random(), 0.02 * rng.random()
    middle, (x, y) = 0.5 * (knots[n] + knots[n + 1]), 0.5 + rng.uniform(-0.15, 0.15, 2)
    floor = np.empty(4)
    toll_floor(x, y, math.sqrt(2.0) * half, half_time, tolls_from(tolls, middle), floor)
    for dx, dy, dt in rng.uniform(-1.0, 1.0, (50, 3)) * [half, half, half_time]:
        motions = tolls_from(tolls, middle + dt)
        rx, ry = x + dx - motions[:, 0], y + dy - motions[:, 1]
        here = motions[:, 7] * np.maximum(1.0 - 90.0 * rx * rx - 40.0 * rx * ry - 60.0 * ry * ry, 0.0)
        assert floor[0] + floor[1] * dx + floor[2] * dy + floor[3] * dt <= here.sum() + 1e-12


def test_no_flight_pays_less_than_the_bound_with_tolls() -> None:
    """The straight flight pays 0.0115 of them, and no other one much less; without tolls, it costs 0.8."""
    centre = Trajectory([0.35, 0.4, 0.45], [(0.5, 0.5)] * 3)
    problem = tolled(EAST, [Toll(centre, np.array([0.0, 0.25, 0.0]), (200.0, 0.0, 200.0))])
    straight = problem.fly([problem.start, problem.goal])
    assert problem.evaluate(straight).cost == pytest.approx(0.8 + 0.0125 * (1.0 - 200.0 * 0.05**2 / 6.0))
    found = timed_lower_bound(problem, straight, tolerance=1e-3, max_cells=30_000)
    assert found.lower_bound > 0.808
    rng, bumps = np.random.default_rng(0), np.sin(np.linspace(0.0, math.pi, 40))[:, None]
    path = np.linspace(problem.start, problem.goal, 40)
    for _ in range(300):
        cost = problem.evaluate(problem.fly(path + bumps * rng.normal(0.0, 0.05, 2))).cost
        assert cost >= found.lower_bound


@pytest.mark.slow
@pytest.mark.parametrize(("team", "least"), [([EAST, WEST], 0.65), (
    [EAST, cg.TimedProblem((0.5, 0.1), (0.5, 0.9), speed=1.0)], 0.35,
)])  # fmt: skip
def test_a_team_knows_what_keeping_apart_costs(team: list[cg.TimedProblem], least: float) -> None:
    """Alone, each costs 0.8; most of what they lose head on is proven, and a part where they cross."""
    plan = cg.solve_team(team, 0.1, nodes=20_000, tolerance=1e-3, max_cells=100_000)
    assert plan.alone_bound == pytest.approx(1.6, rel=1e-8)
    assert 1.6 + least * (plan.cost - 1.6) < plan.lower_bound == plan.apart < plan.cost
    # (a gap that is small enough without them asks for no tolls)
    again = cg.solve_team(team, 0.1, nodes=20_000, tolerance=0.05)
    assert math.isnan(again.apart)
    assert again.lower_bound == again.alone_bound

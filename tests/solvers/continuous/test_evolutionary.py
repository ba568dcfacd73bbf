"""The evolutionary planner: its curves against scipy, its answers against the oracle, its rules one by one."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline
from strategies import few, usual

import cgla_graph as cg
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.continuous.evolutionary import Evolutionary, _Curves, _is_better, basis, curvature
from cgla_graph.testing.strategies import fields, points, seeds

QUICK: dict[str, Any] = {"generations": 25, "segments": 24, "population": 20}


@usual
@given(st.integers(2, 12), st.integers(2, 80))
def test_a_curve_is_a_weighted_mean_of_its_controls(n_controls: int, n_points: int) -> None:
    weights = basis(n_controls, n_points)
    assert weights.shape == (n_points, n_controls)
    assert (weights >= 0.0).all()
    assert np.allclose(weights.sum(axis=1), 1.0)
    assert weights[0].tolist() == [1.0, *[0.0] * (n_controls - 1)]
    assert weights[-1].tolist() == [*[0.0] * (n_controls - 1), 1.0]


@pytest.mark.parametrize("derivative", [1, 2])
def test_derivatives_are_those_of_the_curve(derivative: int) -> None:
    controls = np.random.default_rng(1).random((7, 2))
    at = np.linspace(0.0, 1.0, 4001)
    curve = make_interp_spline(at, basis(7, 4001) @ controls, k=3)
    assert np.allclose(
        curve(at[5:-5], nu=derivative), (basis(7, 4001, derivative=derivative) @ controls)[5:-5], atol=2e-2
    )


@usual
@given(st.floats(0.01, 100.0), st.floats(0.1, 10.0), st.floats(0.0, 6.0))
def test_a_circle_is_curved_by_one_over_its_radius(radius: float, speed: float, angle: float) -> None:
    outward = np.array([math.cos(angle), math.sin(angle)])
    velocity = speed * np.array([-outward[1], outward[0]])
    assert float(curvature(velocity, -(speed**2) / radius * outward)) == pytest.approx(1.0 / radius)
    assert math.isinf(float(curvature(np.zeros(2), outward)))


@usual
@given(fields(), points, points, seeds)
def test_ratings_are_the_costs_of_the_oracle(
    field: cg.RiskField, start: tuple[float, float], goal: tuple[float, float], seed: int
) -> None:
    problem = cg.Problem(start, goal, field, 10.0)
    curves = _Curves(problem, 3, 16, 0.0)
    genes = np.random.default_rng(seed).random((4, 6))
    for path, (crossed, bent, cost) in zip(curves.points(genes), curves.rate(genes), strict=True):
        judged = problem.evaluate(path)
        assert judged.feasible
        assert (crossed, bent) == (0.0, 0.0)
        assert cost == pytest.approx(judged.cost)


@usual
@given(seeds)
def test_a_curve_is_rated_by_its_length_in_areas(seed: int) -> None:
    wall = shapely.box(0.3, 0.2, 0.6, 0.8)
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=wall)
    curves = _Curves(problem, 3, 16, 0.0)
    genes = np.random.default_rng(seed).random((4, 6))
    for path, (crossed, _, cost) in zip(curves.points(genes), curves.rate(genes), strict=True):
        assert crossed == pytest.approx(shapely.LineString(path).intersection(wall).length)
        assert math.isfinite(cost) == problem.evaluate(path).feasible == (crossed == 0.0)


def test_what_must_not_be_comes_before_the_cost() -> None:
    best_first = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.1, 0.5], [0.1, 0.0, 0.1], [0.1, 0.2, 0.1]])
    for i, row in enumerate(best_first):
        assert _is_better(np.tile(row, (5, 1)), best_first).tolist() == [i <= j for j in range(5)]


@few
@given(seeds, st.integers(0, 2))
def test_answers_stand_up_to_the_oracle(seed: int, areas: int) -> None:
    problem = random_scenario(seed, threats=3, areas=areas).problem
    answer = cg.solve(problem, Evolutionary(**QUICK, seed=seed % 100))
    if not answer.status.has_path:
        assert answer.status is Status.NOT_FOUND
        assert "crosses" in answer.message
        return
    assert problem.evaluate(answer.path).feasible
    straight = problem.evaluate([problem.start, problem.goal])
    # the straight line is in the first generation
    assert not straight.feasible or answer.cost <= straight.cost * (1.0 + 1e-9)


@pytest.mark.slow
def test_it_comes_near_the_optimum_around_one_threat() -> None:
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), 10.0)
    best = cg.solve(problem, "fast-marching").cost
    costs = [cg.solve(problem, Evolutionary(seed=seed)).cost for seed in range(3)]
    assert best * (1.0 - 1e-3) <= min(costs) <= max(costs) <= 1.01 * best


def test_more_generations_never_cost_more() -> None:
    problem = random_scenario(5).problem
    costs = [Evolutionary(generations=n, population=20, segments=24).solve(problem).cost for n in (1, 10, 40)]
    assert costs == sorted(costs, reverse=True)
    assert costs[0] > costs[-1]


def test_without_risk_it_stops_at_the_straight_line() -> None:
    answer = Evolutionary().solve(cg.Problem((0.1, 0.1), (0.9, 0.8)))
    assert answer.cost == pytest.approx(math.hypot(0.8, 0.7))
    assert answer.evaluations == 40 * 64


def test_the_turn_radius_is_kept() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.5, 0.5, 0.05)]), 50.0)
    settings: dict[str, Any] = {"control_points": 4, "generations": 80}
    answers = [Evolutionary(**settings, turn_radius=radius).solve(problem) for radius in (0.0, 0.5)]
    sharpest = []
    for answer in answers:
        # the circle through three neighbours
        a, b, c = answer.path[:-2], answer.path[1:-1], answer.path[2:]
        area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        sides = np.hypot(*(b - a).T) * np.hypot(*(c - b).T) * np.hypot(*(c - a).T)
        sharpest.append(float((sides / (2.0 * area)).min()))
    assert sharpest[0] < 0.4
    assert sharpest[1] > 0.48
    assert answers[0].cost <= answers[1].cost


def test_a_turn_that_cannot_be_made_is_said() -> None:
    wall = shapely.box(0.45, 0.0, 0.55, 0.9)
    problem = cg.Problem((0.3, 0.1), (0.7, 0.1), no_fly=wall)
    assert Evolutionary(**QUICK).solve(problem).status is Status.FOUND
    answer = Evolutionary(**QUICK, turn_radius=5.0).solve(problem)
    assert answer.status is Status.NOT_FOUND
    assert answer.message.startswith("the best curve of 25 generations turns too tightly, by ")


@pytest.mark.parametrize("budget", [{"evaluations": 5000}, {"generations": 3}])
def test_the_budget_ends_the_run(budget: dict[str, int]) -> None:
    answer = Evolutionary(**{"generations": None, **budget}).solve(random_scenario(5).problem)
    assert answer.evaluations == 40 * 64 * {"evaluations": 2, "generations": 4}[next(iter(budget))]

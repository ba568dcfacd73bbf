"""Fast marching: its paths approach the optimum, around walls of any direction."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, few

import cgla_graph as cg
from cgla_graph.scenarios.scenario import load_scenario, shipped
from cgla_graph.solvers.continuous.fast_marching import least_change
from cgla_graph.testing.strategies import fields, points


def excess(problem: cg.Problem, cells: int, order: int, best: float) -> float:
    return cg.solve(problem, "fast-marching", cells=cells, order=order).cost / best - 1.0


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_it_comes_within_a_percent_of_the_best_known(name: str) -> None:
    problem = load_scenario(name).problem
    best = cg.solve(problem, "hybrid", tolerance=None).cost
    found = cg.solve(problem, "fast-marching", cells=512)
    assert found.status is cg.Status.FOUND
    assert best * (1 - 1e-6) <= found.cost <= best * 1.01


def test_its_error_falls_with_the_spacing() -> None:
    """On a smooth map, by half at least when the cells double; order 2 is nearer than order 1 from the start."""
    field = cg.RiskField([cg.Threat(0.5, 0.45, spread=0.12, peak=0.8)])
    problem = cg.Problem((0.1, 0.13), (0.9, 0.81), field, k=10.0)
    best = cg.solve(problem, "hybrid", tolerance=None).cost
    errors = {order: [excess(problem, cells, order, best) for cells in (64, 128, 256, 512)] for order in (1, 2)}
    assert errors[2][0] < errors[1][0] < 0.01
    for order in (1, 2):
        rates = np.log2(np.divide(errors[order][:-1], errors[order][1:]))
        assert rates.mean() > 0.7, (order, errors)


@pytest.mark.parametrize("order", [1, 2])
def test_around_a_wall_it_goes_through_the_very_corner(order: int) -> None:
    problem = cg.Problem((0.2, 0.2), (0.8, 0.2), no_fly=shapely.box(0.45, -0.1, 0.55, 0.6))
    answer = cg.solve(problem, "fast-marching", cells=128, order=order)
    assert answer.cost == pytest.approx(2.0 * math.hypot(0.25, 0.4) + 0.1, rel=1e-3)
    assert problem.evaluate(answer.path).feasible


def test_a_wall_thinner_than_a_cell_stands() -> None:
    problem = cg.Problem((0.2, 0.5), (0.8, 0.5), no_fly=shapely.box(0.4999, 0.1, 0.5001, 0.9))
    answer = cg.solve(problem, "fast-marching", cells=100)
    assert answer.cost == pytest.approx(2.0 * math.hypot(0.3, 0.4), rel=1e-2)


def test_a_start_between_two_ways_takes_one_of_them() -> None:
    """The fronts meet in the start itself; staying on the ridge would lead through the threat."""
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.5, 0.5, spread=0.1)]), k=30.0)
    best = cg.solve(problem, "hybrid", tolerance=None).cost
    assert excess(problem, 256, 2, best) < 2e-3


@few
@given(fields(max_threats=3), points, points, st.floats(0.0, 30.0))
def test_it_stays_inside_and_above_the_bound(
    field: cg.RiskField, start: cg.Problem, goal: cg.Problem, k: float
) -> None:
    problem = cg.Problem(start, goal, field, k=k)
    answer = cg.solve(problem, "fast-marching", cells=64)
    if answer.status.has_path:
        assert answer.cost >= math.dist(problem.start, problem.goal) * (1 - 1e-12)


def test_an_elongated_map() -> None:
    problem = cg.Problem((1.0, 0.5), (99.0, 1.5), cg.RiskField([cg.Threat(50, 1, 0.5)]), k=2.0, bounds=(0, 0, 100, 2))
    best = cg.solve(problem, "hybrid", tolerance=None).cost
    assert excess(problem, 1024, 2, best) < 0.01


@pytest.mark.parametrize(
    ("shape", "grid"), [(None, 256 * 256), ((10, 10), 260 * 260), ((300, 600), 300 * 600), ((90, 9000), 2048 * 20)]
)
def test_over_a_raster_cells_are_as_fine_as_its_own(shape: tuple[int, int] | None, grid: int) -> None:
    bounds = (0.0, 0.0, 1.0, 1.0) if shape is None else (0.0, 0.0, 0.1 * shape[1], 0.1 * shape[0])
    rasters = [] if shape is None else [cg.RasterRisk(np.ones(shape), bounds)]
    problem = cg.Problem(bounds[:2], bounds[2:], cg.RiskField(rasters=rasters), k=1.0, bounds=bounds)
    answer = cg.solve(problem, "fast-marching")
    assert answer.evaluations == pytest.approx(grid, rel=0.3)
    assert answer.cost == pytest.approx((2.0 if rasters else 1.0) * answer.length, rel=1e-9)


@given(st.floats(0.01, 1.0), st.floats(0.01, 1.0), st.floats(1e-3, 1e5))
@examples(50)
def test_no_threat_changes_the_cost_sooner(spread: float, peak: float, k: float) -> None:
    problem = cg.Problem((0, 0), (1, 1), cg.RiskField([cg.Threat(0.0, 0.0, spread, peak)]), k=k)
    away = np.linspace(0.0, 8.0 * spread, 4001)
    cost = 1.0 + k * problem.field.density(np.column_stack([away, np.zeros_like(away)]))
    assert np.abs(np.diff(np.log(cost))).max() <= (away[1] - away[0]) / least_change(problem)


def test_that_cells_are_few_for_the_cost_is_said() -> None:
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.03, 0.9)])
    steep, gentle = (cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=k) for k in (1000.0, 1.0))
    said = "the cost may change e-fold within 2.1 cells: with more `cells`, the path may cost less"
    assert cg.solve(steep, "fast-marching").message == said
    assert cg.solve(gentle, "fast-marching").message == ""
    assert cg.solve(steep, "fast-marching", cells=400).message == ""

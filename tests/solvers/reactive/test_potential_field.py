"""The potential field: every step goes downhill, and where no step does, it says that the forces cancel."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from scipy.optimize import brentq
from strategies import usual

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.solvers.reactive.potential_field import PotentialField
from cgla_graph.solvers.reactive.step_by_step import Surroundings
from cgla_graph.testing.strategies import points, problems


def potential(problem: cg.Problem, path: FloatArray, solver: PotentialField) -> FloatArray:
    """Compute U anew, point by point, from the formula in the docstring."""
    x_min, y_min, x_max, y_max = problem.bounds
    side = min(x_max - x_min, y_max - y_min)
    levels = []
    for x, y in path.tolist():
        survival = 1.0
        for threat in problem.field.threats:
            square = (x - threat.x) ** 2 + (y - threat.y) ** 2
            survival *= 1.0 - threat.peak * math.exp(-square / (2.0 * threat.spread**2))
        level = math.dist((x, y), problem.goal) + solver.risk_gain * side * (1.0 - survival)
        reach = solver.area_reach * side
        for polygon in getattr(problem.model.area.geometry, "geoms", [problem.model.area.geometry]):
            if not polygon.is_empty:
                near = max(polygon.distance(shapely.Point(x, y)), 1e-3 * reach)
                level += 0.5 * solver.area_gain * reach * max(reach / near - 1.0, 0.0) ** 2
        levels.append(level)
    return np.array(levels)


@usual
@given(problems())
def test_every_step_lowers_the_potential_and_may_be_flown(problem: cg.Problem) -> None:
    solver = PotentialField()
    answer = cg.solve(problem, solver)
    assert answer.status in {cg.Status.OPTIMAL, cg.Status.FOUND, cg.Status.STUCK}, answer.message
    if answer.status.has_path:
        # the last step goes straight to the goal, against any potential
        assert (np.diff(potential(problem, answer.path[:-1], solver)) < 1e-12).all()


@usual
@given(problems(), points)
def test_the_force_is_the_slope_of_the_potential(problem: cg.Problem, spot: tuple[float, float]) -> None:
    solver, around, here = PotentialField(), Surroundings(problem, 0.02), np.array(spot)
    tiny = 1e-7
    parts = shapely.get_parts(problem.model.area.geometry)
    # where the potential has a kink, or is so steep that differences say nothing, there is no slope to compare with
    if math.dist(spot, problem.goal) < 0.01 or (shapely.distance(parts, shapely.Point(spot)) < 0.005).any():
        return
    ahead = [potential(problem, here + tiny * np.array([axis, -axis]), solver) for axis in np.eye(2)]
    slope = np.array([(more - less) / (2.0 * tiny) for more, less in ahead])
    assert solver.force(around, here) == pytest.approx(-slope, rel=1e-3, abs=1e-3)
    assert solver.potential(around, here[None]) == pytest.approx(potential(problem, here[None], solver))


def stuck_at(answer: cg.Solution) -> tuple[float, ...]:
    """Return where a planner stopped because the forces cancel."""
    assert answer.status is cg.Status.STUCK
    assert "the forces cancel: a local minimum" in answer.message
    return tuple(float(part) for part in answer.message.split("(")[1].split(")")[0].split(", "))


@pytest.mark.parametrize("scale", [1.0, 5000.0])
@pytest.mark.parametrize(("spread", "gain"), [(0.05, 0.2), (0.08, 0.3), (0.03, 0.1)])
def test_in_front_of_a_threat_it_stops_where_the_slope_balances_the_pull(
    spread: float, gain: float, scale: float
) -> None:
    field = cg.RiskField([cg.Threat(0.5 * scale, 0.5 * scale, spread * scale)])
    ends = (0.1 * scale, 0.5 * scale), (0.9 * scale, 0.5 * scale)
    problem = cg.Problem(*ends, field, k=10.0, bounds=(0, 0, scale, scale))
    answer = PotentialField(risk_gain=gain).solve(problem)
    balance = brentq(lambda d: gain * d / spread**2 * math.exp(-(d**2) / (2 * spread**2)) - 1.0, spread, 6 * spread)
    assert stuck_at(answer) == pytest.approx((scale * (0.5 - balance), scale * 0.5), abs=scale * 2e-4)


def test_in_front_of_a_wall_it_stops_where_the_repulsion_balances_the_pull() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.5, 0.2, 0.6, 0.8))
    answer = PotentialField(area_gain=0.1, area_reach=0.05).solve(problem)
    ratio = brentq(lambda r: 0.1 * (r - 1.0) * r**2 - 1.0, 1.0, 10.0)
    assert stuck_at(answer) == pytest.approx((0.5 - 0.05 / ratio, 0.5), abs=2e-4)


def test_too_weak_a_threat_is_run_over() -> None:
    """Below ``gain * peak / spread * exp(-1/2) = 1`` the pull wins everywhere on the line."""
    weakest = 0.05 / 0.2 * math.exp(0.5)
    for factor, status in ((0.98, cg.Status.FOUND), (1.02, cg.Status.STUCK)):
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.05, peak=factor * weakest)])
        assert PotentialField(risk_gain=0.2).solve(cg.Problem((0.1, 0.5), (0.9, 0.5), field)).status is status


def test_without_gains_it_flies_straight_and_ends_at_walls() -> None:
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1)])
    blind = PotentialField(risk_gain=0, area_gain=0)
    free = cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.8), field, k=10.0), blind)
    assert free.length == pytest.approx(math.hypot(0.8, 0.7), rel=1e-12)
    walled = blind.solve(cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.5, 0.2, 0.6, 0.8)))
    assert stuck_at(walled)[1] == 0.5


def test_it_slides_along_the_bounds() -> None:
    """A threat pushes it out of the map; the bounds hold it, and it goes on along them."""
    problem = cg.Problem((0.1, 0.05), (0.9, 0.05), cg.RiskField([cg.Threat(0.5, 0.11, 0.05)]), k=10.0)
    answer = cg.solve(problem, "potential-field")
    assert answer.status is cg.Status.FOUND
    assert answer.path[:, 1].min() == 0.0

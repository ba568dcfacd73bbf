"""Flights through moving risk: their gradient, their march, and what the planner promises."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import cgla_graph as cg
from cgla_graph.errors import SolverSettingError, UnknownSolverError
from cgla_graph.solvers.timed.charting import chart_of, grid_for
from cgla_graph.solvers.timed.march_kernels import Ends, cubic, march
from cgla_graph.solvers.timed.timed_kernels import flight_cost, flight_times, leg_time

START, GOAL = (0.1, 0.1), (0.9, 0.9)


def storms(seed: int, count: int = 5, drift: float = 0.4) -> list[cg.MovingThreat]:
    """Make threats that move straight on for 4 time units, and grow."""
    rng = np.random.default_rng(seed)
    made = []
    for place, velocity in zip(rng.random((count, 2)), rng.uniform(-drift, drift, (count, 2)), strict=True):
        track = [(t, *(place + t * velocity)) for t in (0.0, 4.0)]
        made.append(cg.MovingThreat(track, tuple(rng.uniform(0.05, 0.12, 2)), tuple(rng.uniform(0.4, 1.0, 2))))
    return made


def problem_of(seed: int, **changes: object) -> cg.TimedProblem:
    """Make a problem from corner to corner."""
    usual = {"moving": storms(seed), "k": 10.0, "speed": 1.0, **changes}
    return cg.TimedProblem(START, GOAL, cg.RiskField([cg.Threat(0.3, 0.6, 0.1, 0.5)]), **usual)  # type: ignore[arg-type]


WINDS = st.sampled_from([None, (0.3, -0.2)])


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 99), WINDS, st.sampled_from(["ground", "time"]), st.sampled_from([None, 0.7]))
def test_cost_of_a_flight_is_the_oracle_s_and_has_its_gradient(
    seed: int, wind: tuple[float, float] | None, per: str, price: float | None
) -> None:
    """Without the terms of the times (say, `later = 0`), the differences would not agree."""
    gate = cg.TimedArea(shapely.box(0.3, 0.3, 0.6, 0.5), 0.31, 0.77)
    problem = problem_of(seed, wind=wind, risk_per=per, waiting=price, areas=[gate], fields=[(0.5, cg.RiskField())])
    chart = chart_of(problem, 9.0)
    rng = np.random.default_rng(seed)
    points = np.linspace(START, GOAL, 6) + rng.normal(0.0, 0.03, (6, 2))
    waits = rng.uniform(0.01, 0.1, 6) * (price is not None)
    waits[-1] = 0.0
    slopes, unused = np.empty((2, 6, 3))
    free, _ = flight_cost(chart, points, waits, 0.05, 0.0, 0.0, slopes)
    times = flight_times(chart, points, waits, 0.05)
    rows = [(t, *at) for t, wait, at in zip(times, waits, points, strict=True) for t in {t, t + wait}]
    assert free == pytest.approx(problem.evaluate(sorted(rows)).cost, rel=1e-8)
    _, by_departure = flight_cost(chart, points, waits, 0.05, 0.0, 0.0, slopes)

    def cost(points: np.ndarray, waits: np.ndarray, departure: float) -> float:
        return flight_cost(chart, points, waits, departure, 0.0, 0.0, unused)[0]

    h = 1e-6
    steps = (cost(points, waits, 0.05 + h) - cost(points, waits, 0.05 - h)) / (2 * h)
    assert by_departure == pytest.approx(steps, abs=1e-6)
    for i, j in itertools.product(range(6), range(2 if price is None else 3)):
        if (i, j) == (5, 2):
            continue
        change = np.zeros((6, 3))
        change[i, j] = h
        high, low = (cost(points + s * change[:, :2], waits + s * change[:, 2], 0.05) for s in (1, -1))
        assert slopes[i, j] == pytest.approx((high - low) / (2 * h), abs=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_in_wind_that_changes_times_close_in_on_those_of_the_oracle_and_slopes_are_theirs(seed: int) -> None:
    """With the wind in the middle of each leg alone, four times as many legs are but sixteen times as good."""
    rng = np.random.default_rng(seed)
    wind = cg.Wind(*rng.uniform(-0.3, 0.3, (2, 2, 2, 2)), (0, 0, 1, 1), (0.0, 3.0))
    problem = problem_of(seed, wind=wind, moving=(), k=2.0, risk_per=["ground", "time"][seed % 2])
    chart, off = chart_of(problem, 9.0), []
    for count in (4, 16):
        points = np.linspace(START, GOAL, count + 1)
        points[:, 1] += 0.1 * np.sin(np.linspace(0.0, math.pi, count + 1))
        exact = problem.fly(points, 0.05)
        off.append(abs(flight_times(chart, points, np.zeros(count + 1), 0.05)[-1] - exact[-1, 0]))
        slopes, unused = np.empty((2, count + 1, 3))
        cost, late = flight_cost(chart, points, np.zeros(count + 1), 0.05, 0.0, 0.0, slopes)
    assert off[1] < off[0] / 64.0
    assert off[1] < 1e-6
    assert cost == pytest.approx(problem.evaluate(exact).cost, rel=1e-4)

    def costs(points: np.ndarray, departure: float) -> float:
        return flight_cost(chart, points, np.zeros(len(points)), departure, 0.0, 0.0, unused)[0]

    h = 1e-5
    assert late == pytest.approx((costs(points, 0.05 + h) - costs(points, 0.05 - h)) / (2 * h), abs=1e-5)
    for i, j in itertools.product((1, 7, 15), range(2)):
        change = np.zeros_like(points)
        change[i, j] = h
        steps = (costs(points + change, 0.05) - costs(points - change, 0.05)) / (2 * h)
        assert slopes[i, j] == pytest.approx(steps, abs=1e-5)


def test_tiny_legs_that_take_no_time_cost_nothing() -> None:
    chart = chart_of(cg.TimedProblem((0, 0), (1, 1), speed=1.0), 9.0)
    points = np.array([(0, 0), (1e-30, 0), (1, 1)], dtype=float)
    assert flight_cost(chart, points, np.zeros(3), 0.5, 0.0, 0.0, np.empty((3, 3)))[0] == pytest.approx(math.sqrt(2))


def test_march_converges_to_the_exact_time_in_wind() -> None:
    """At least with order 1 near the goal's tip; a march that ignores the wind misses by a tenth."""
    problem = cg.TimedProblem(START, GOAL, speed=1.0, wind=(0.3, -0.2))
    chart = chart_of(problem, 9.0)
    exact = leg_time(chart, 0.8, 0.8)
    errors = []
    for nodes in (4_000, 64_000):
        grid = grid_for(problem, chart, 1.4, nodes)
        ends = Ends(*GOAL, -math.inf, math.inf, *START, 0.0, 1.4)
        first = march(chart, grid, ends, 1.0)[0]
        errors.append(abs(cubic(first, (START[0] - grid.x) / grid.h, (START[1] - grid.y) / grid.h) - exact))
    assert errors[1] < 0.03
    assert errors[1] < 0.8 * errors[0]


def test_plan_is_the_oracle_s_and_no_neighbour_is_better() -> None:
    problem = problem_of(3)
    plan = cg.solve(problem, nodes=30_000, tolerance=None)
    assert plan.status.has_path
    seen = problem.evaluate(plan.trajectory)
    assert (plan.cost, plan.arrival, plan.risk) == (seen.cost, seen.arrival, seen.risk)
    assert seen.feasible
    rng = np.random.default_rng(0)
    for size in (1e-3, 1e-2, 1e-1):
        for _ in range(20):
            bump = np.sin(np.linspace(0.0, math.pi, len(plan.path)))[:, None] * rng.normal(0.0, size, 2)
            other = problem.evaluate(problem.fly(plan.path + bump))
            assert not other.feasible or other.cost > plan.cost * (1.0 - 1e-6)
    assert np.array_equal(plan.trajectory, cg.solve(problem, nodes=30_000, tolerance=None).trajectory)


def test_nothing_that_moves_is_planned_as_in_the_plane() -> None:
    still = cg.Problem(START, GOAL, cg.RiskField([cg.Threat(0.5, 0.52, 0.1, 0.9), cg.Threat(0.7, 0.4, 0.1)]), k=10.0)
    timed = cg.TimedProblem(START, GOAL, still.field, k=10.0, speed=0.5)
    assert cg.solve(timed, nodes=30_000, tolerance=None).cost == pytest.approx(
        cg.solve(still, tolerance=None).cost, rel=1e-4
    )


def test_window_is_no_worse_than_its_departures_and_shows_them() -> None:
    problem = problem_of(0, departure=(0.0, 1.0))
    plan = cg.solve(problem, nodes=30_000, tolerance=None)
    fixed = [cg.solve(dataclasses.replace(problem, departure=t), nodes=30_000, tolerance=None).cost for t in (0.0, 1.0)]
    assert plan.cost <= min(fixed) * (1.0 + 1e-4)
    assert 0.0 <= plan.departure <= 1.0
    times, costs = plan.departures.T
    assert (times[0], times[-1]) == (0.0, 1.0)
    # (a march whose nodes are left out as soon as they idle wears away from its last departures)
    assert np.isfinite(costs).all()
    assert costs[-1] == pytest.approx(fixed[1], rel=0.01)
    assert np.interp(plan.departure, times, costs) == pytest.approx(plan.cost, rel=0.05)
    assert costs[0] == pytest.approx(fixed[0], rel=0.05)


def test_gate_that_opens_is_waited_for() -> None:
    gate = cg.TimedArea(shapely.box(0.4, -1, 0.6, 2), appears=0, vanishes=2.0)
    problem = cg.TimedProblem((0.1, 0.5), (0.9, 0.5), areas=[gate], speed=1.0)
    circled = cg.solve(problem, nodes=4_000, tolerance=None)
    waited = cg.solve(dataclasses.replace(problem, waiting=0.5), nodes=4_000, tolerance=None)
    late = cg.solve(dataclasses.replace(problem, departure=(0.0, 3.0)), nodes=4_000, tolerance=None)
    # at the gate at time 2, then 0.5 to the goal
    assert circled.cost == pytest.approx(2.5, rel=2e-3)
    assert waited.cost == pytest.approx(0.8 + 0.5 * 1.7, rel=2e-3)
    assert late.cost == pytest.approx(0.8, rel=1e-6)


@pytest.mark.slow
def test_goal_inside_of_an_area_is_reached_once_it_opens() -> None:
    gate = cg.TimedArea(shapely.box(0.7, 0.3, 1.0, 0.7), appears=0, vanishes=2.0)
    problem = cg.TimedProblem((0.1, 0.5), (0.9, 0.5), areas=[gate], speed=1.0, waiting=0.5)
    plan = cg.solve(problem, nodes=30_000, tolerance=None)
    # at the border at time 2, then 0.2 to the goal
    assert plan.cost == pytest.approx(0.8 + 0.5 * 1.4, rel=2e-3)


def test_a_flight_along_an_outline_is_found_whatever_rounding_does() -> None:
    """Waypoints in the middle of a leg along an edge are inside of the area by rounding, or not."""
    rhombus = shapely.Polygon([(0.3, 0.5), (0.5, 0.3), (0.7, 0.5), (0.5, 0.7)])
    problem = cg.TimedProblem((0.08, 0.1), (0.92, 0.88), areas=[cg.TimedArea(rhombus, 0, 9)], speed=1)
    around = cg.Problem((0.08, 0.1), (0.92, 0.88), no_fly=rhombus)
    plan = cg.solve(problem, nodes=5_000, tolerance=None)
    assert plan.status.label == "found"
    assert plan.cost <= cg.solve(around).cost * (1.0 + 1e-9)


def test_closed_for_good_and_too_late_are_not_found() -> None:
    closed = cg.TimedArea(shapely.box(0.4, -1, 0.6, 2), appears=0.1)
    problem = cg.TimedProblem((0.1, 0.5), (0.9, 0.5), areas=[closed], speed=1.0, latest=1.5)
    plan = cg.solve(problem, nodes=4_000, tolerance=None)
    assert (plan.status.label, plan.cost) == ("not-found", math.inf)
    late = cg.TimedProblem((0.1, 0.5), (0.9, 0.5), speed=1.0, latest=0.7)
    assert not cg.solve(late, nodes=4_000, tolerance=None).status.has_path


def test_wrong_settings_are_named() -> None:
    problem = problem_of(0)
    with pytest.raises(UnknownSolverError, match="space-time"):
        cg.solve(problem, solver="dijkstra")
    with pytest.raises(SolverSettingError, match="has no setting 'refine'"):
        cg.solve(problem, refine=True)
    with pytest.raises(ValueError, match="nodes is 5"):
        cg.solve(problem, nodes=5)


def test_wind_that_changes_is_judged_as_it_is() -> None:
    wind = cg.Wind([[0.0, 0.2], [0.0, 0.2]], [[0.1, 0.0], [0.1, 0.0]], (0, 0, 1, 1))
    problem = problem_of(1, wind=wind)
    plan = cg.solve(problem, nodes=4_000, tolerance=None)
    assert plan.status.has_path
    assert problem.evaluate(plan.trajectory).cost == plan.cost < problem.evaluate(problem.fly([START, GOAL])).cost

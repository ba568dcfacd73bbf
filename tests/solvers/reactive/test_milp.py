"""The MILP planner: its program against brute force, its obstacles against the model, its paths against the oracle."""

import math
import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import shapely
from hypothesis import given
from strategies import examples, few

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.reactive.milp import Milp
from cgla_graph.solvers.reactive.milp_map import NEGLIGIBLE, corner_graph, obstacles_of, threat_obstacle
from cgla_graph.solvers.reactive.milp_model import FACETS, SHADOW, Horizon, KeepOut, best_plan
from cgla_graph.testing.strategies import polygons, seeds

LOW, HIGH = np.array([-0.5, -0.5]), np.array([0.5, 0.5])
PLACES = np.array([[0.15, 0.0], [0.14, 0.06], [0.14, -0.06]])


def keep_out(model: cg.CostModel, origin: tuple[float, float]) -> KeepOut:
    (obstacle,) = obstacles_of(model)
    return obstacle.keep_out(np.array(origin), 1.0)


def shadow_lengths(steps: FloatArray) -> FloatArray:
    angles = 2.0 * math.pi * np.arange(FACETS) / FACETS
    return np.asarray((steps @ np.stack([np.cos(angles), np.sin(angles)])).max(axis=-1))


def brute_force(horizon: Horizon, spacing: float) -> float:
    """Try every bend of two legs on a grid, and every place, by the definition of the program."""
    (obstacle,) = horizon.obstacles
    side = np.arange(-0.1, 0.2 + 1e-9, spacing)
    bends = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    best = math.inf
    for place, to_go in zip(horizon.places, horizon.costs_to_go, strict=True):
        cost = np.full(len(bends), to_go)
        for start, end in ((np.zeros_like(bends), bends), (bends, np.broadcast_to(place, bends.shape))):
            length = shadow_lengths(end - start)
            beyond = np.minimum(obstacle.beyond(start), obstacle.beyond(end)).max(axis=1)
            depth = np.maximum(-beyond, 0.0)
            price = np.zeros(len(bends))
            for thickness, rate in obstacle.layers:
                price += rate * np.minimum(depth, thickness)
                depth = np.maximum(depth - thickness, 0.0)
            allowed = (length <= horizon.reach * SHADOW) & (obstacle.is_soft | (beyond >= 1e-5))
            cost = np.where(allowed, cost + length + price * horizon.reach, np.inf)
        best = min(best, float(cost.min()))
    return best


@pytest.mark.parametrize("kind", ["threat", "area"])
@pytest.mark.parametrize("aside", [-0.02, 0.0, 0.013])
def test_the_program_equals_brute_force_on_a_grid(kind: str, aside: float) -> None:
    field = cg.RiskField([cg.Threat(0.07, aside, 0.02)])
    wall = shapely.box(0.05, aside - 0.03, 0.09, aside + 0.03)
    model = cg.CostModel(field, 10.0) if kind == "threat" else cg.CostModel(no_fly=wall)
    costs = np.hypot(*(np.array([0.4, 0.0]) - PLACES).T)
    horizon = Horizon(2, 0.1, LOW, HIGH, [keep_out(model, (0.0, 0.0))], PLACES, costs)
    plan = best_plan(horizon, gap=1e-9, nodes=100_000)
    on_grid = brute_force(horizon, 0.0025)

    assert plan is not None
    assert plan.objective <= on_grid + 1e-6
    # half a cell aside changes two lengths by half a diagonal each, and a depth at the steepest price
    steepest = max([rate for _, rate in horizon.obstacles[0].layers], default=0.0)
    assert plan.objective >= on_grid - 0.0025 * math.sqrt(0.5) * 2.0 * (1.0 + steepest * horizon.reach)


def test_no_leg_cuts_a_corner() -> None:
    wall = keep_out(cg.CostModel(no_fly=shapely.box(0.04, -0.2, 0.06, 0.01)), (0.0, 0.0))
    plan = best_plan(Horizon(3, 0.06, LOW, HIGH, [wall], PLACES[:1], np.zeros(1)), gap=1e-6, nodes=1000)
    assert plan is not None
    both = np.minimum(wall.beyond(plan.points[:-1]), wall.beyond(plan.points[1:]))
    assert (both.max(axis=1) >= 0.0).all()
    assert (np.hypot(*np.diff(plan.points, axis=0).T) <= 0.06 * (1.0 + 1e-6)).all()


def test_without_a_way_there_is_no_plan() -> None:
    wall = keep_out(cg.CostModel(no_fly=shapely.box(0.04, -0.9, 0.06, 0.9)), (0.0, 0.0))
    assert best_plan(Horizon(3, 0.06, LOW, HIGH, [wall], PLACES, np.zeros(3)), gap=0.01, nodes=1000) is None


@pytest.mark.parametrize(("k", "peak"), list(product([0.15, 1.0, 10.0, 200.0], [1.0, 0.8])))
def test_a_threat_costs_no_more_than_it_does_but_by_its_rim(k: float, peak: float) -> None:
    obstacle = threat_obstacle(cg.Threat(0.0, 0.0, 0.1, peak), k)
    assert obstacle is not None
    thick, prices = obstacle.layers.T
    assert (np.diff(prices) > 0.0).all()
    radius = float(thick.sum())
    assert k * peak * math.exp(-0.5 * (radius / 0.1) ** 2) == pytest.approx(NEGLIGIBLE)
    assert float(thick @ prices) == pytest.approx(k * peak - NEGLIGIBLE)
    away = np.linspace(0.0, radius, 200)
    inner = np.concatenate([[0.0], np.cumsum(thick)])
    worth = np.interp(radius - away, inner, np.concatenate([[0.0], np.cumsum(thick * prices)]))
    truth = k * peak * np.exp(-0.5 * (away / 0.1) ** 2) - NEGLIGIBLE
    # chords of the convex part lie above it, the line to the centre lies below
    assert (np.abs(worth - truth) <= 0.13 * k * peak).all()


@few
@given(polygons())
def test_parts_of_areas_are_convex_and_make_up_the_areas(area: shapely.MultiPolygon) -> None:
    parts = [shapely.Polygon(obstacle.corners) for obstacle in obstacles_of(cg.CostModel(no_fly=area))]
    assert all(part.exterior.is_ccw and part.convex_hull.area == pytest.approx(part.area) for part in parts)
    assert sum(part.area for part in parts) == pytest.approx(area.area)
    assert shapely.union_all(parts).symmetric_difference(area).area <= 1e-9


def test_the_cost_to_go_is_the_shortest_way_around() -> None:
    wall = shapely.box(0.4, 0.0, 0.6, 0.8)
    graph = corner_graph(cg.CostModel(no_fly=wall), (0.0, 0.0, 1.0, 1.0), (0.9, 0.1))
    from_start = graph.onward(cg.CostModel(no_fly=wall), np.array([[0.1, 0.1]]))[0]
    assert from_start.min() == pytest.approx(2.0 * math.hypot(0.3, 0.7) + 0.2, abs=1e-4)
    route = graph.route(int(np.argmin(from_start)))
    assert route[-1].tolist() == [0.9, 0.1]
    assert len(route) == 3


@examples(6)
@given(seeds)
def test_paths_stand_up_to_the_oracle(seed: int) -> None:
    problem = random_scenario(seed, threats=2, areas=2).problem
    answer = cg.solve(problem, Milp())
    if not answer.status.has_path:
        assert answer.status is Status.STUCK
        return
    assert problem.evaluate(answer.path).feasible
    assert (np.hypot(*np.diff(answer.path, axis=0).T) <= 0.02 * (1.0 + 1e-9)).all()


def test_less_risk_for_more_k() -> None:
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.08)])
    risks = [cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.9), field, k), Milp()).risk for k in (0.0, 1.0, 10.0, 100.0)]
    assert risks == sorted(risks, reverse=True)
    assert risks[0] > 0.19
    assert risks[-1] < 0.01


def test_it_leaves_a_threat_that_it_begins_in() -> None:
    field = cg.RiskField([cg.Threat(0.2, 0.2, 0.08)])
    answer = cg.solve(cg.Problem((0.2, 0.2), (0.9, 0.9), field, 50.0), Milp())
    assert answer.status is Status.FOUND


def test_where_the_program_has_no_plan_the_graph_of_corners_leads_on(monkeypatch: pytest.MonkeyPatch) -> None:
    wall = shapely.box(0.4, 0.0, 0.6, 0.8)
    problem = cg.Problem((0.1, 0.1), (0.9, 0.1), no_fly=wall)
    monkeypatch.setattr("cgla_graph.solvers.reactive.milp.best_plan", lambda *_, **__: None)
    assert cg.solve(problem, Milp()).cost == pytest.approx(2.0 * math.hypot(0.3, 0.7) + 0.2, abs=1e-4)


def test_in_a_mission_it_plans_again_when_a_threat_comes_up() -> None:
    problem = random_scenario(1, threats=4).problem
    world = cg.World(problem.field, problem.bounds)
    uav = cg.Uav("a", problem.start, problem.goal, 0.2, k=10.0)
    flight = cg.Mission(world, [uav], Milp()).fly().uavs["a"]
    assert flight.status.label == "arrived"
    straight = problem.evaluate([problem.start, problem.goal])
    assert flight.length + 10.0 * flight.risk <= straight.cost


@pytest.mark.parametrize("in_mission", [False, True])
def test_a_run_says_how_many_plans_are_not_the_programs(in_mission: bool) -> None:
    crowded, solver = random_scenario(5, threats=25).problem, Milp(legs=5, nodes=1)
    uav = cg.Uav("a", crowded.start, crowded.goal, 2.0, k=10.0)
    remarks = []
    for problem in (crowded, replace(crowded, field=cg.RiskField())):
        mission = cg.Mission(cg.World(problem.field, problem.bounds), [uav], solver, max_ticks=30)
        remarks.append(mission.fly().uavs["a"].remark if in_mission else solver.solve(problem).message)
    counts = re.fullmatch(r"(\d+) of (\d+) plans follow the graph of corners: the program found none .*", remarks[0])
    assert counts is not None
    # more plans than the one of a single tick
    assert 0 < int(counts[1]) <= int(counts[2])
    assert int(counts[2]) > 1
    assert remarks[1] == ""

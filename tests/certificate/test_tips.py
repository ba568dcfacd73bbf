"""What the cost to an end is at least near it: the formula, the closer look, and what both take from a bound."""

import math
from dataclasses import replace

import numpy as np
import oracles
import pytest
import strategies
from hypothesis import example, given
from hypothesis import strategies as st
from levels import SEVERAL, plain_level, whole

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate import certificate_kernels
from cgla_graph.certificate.subsolution import Block, Level
from cgla_graph.certificate.tips import EndFormula, EndGrid
from cgla_graph.testing import strategies as drawn

ROUNDING = 1e-9


@given(st.one_of(drawn.fields(), drawn.crowds(20)), drawn.risk_weights, drawn.seeds)
@strategies.usual
def test_no_way_to_an_end_is_cheaper_than_its_tip(field: cg.RiskField, k: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    around = rng.choice([(t.x, t.y) for t in field.threats]) if len(field) and rng.random() < 0.5 else rng.random(2)
    end, rim = np.clip(around, 0.0, 1.0), 10.0 ** rng.uniform(-4.0, -0.5)
    problem = cg.Problem((end[0], end[1]), (end[0], end[1]), field, k)
    tip = EndFormula.at(problem, problem.goal, rim)
    angle, r = rng.uniform(0.0, 2.0 * math.pi, 40), rim * rng.random(40)
    away = np.column_stack([r * np.cos(angle), r * np.sin(angle)])
    # the inequality itself, by central differences
    hair = 1e-6 * rim
    slopes = [(tip.costs(away + step) - tip.costs(away - step)) / (2.0 * hair) for step in hair * np.eye(2)]
    cost = 1.0 + k * oracles.density(field.threats, end + away)
    far = r > 1e-3 * rim
    assert (np.hypot(*slopes)[far] <= cost[far] * (1.0 + 1e-6)).all()
    assert 1.0 <= tip.least_cost <= cost.min() * (1.0 + ROUNDING)
    # ways to the end: straight, or by points that may be far away
    for d, bound in zip(away[:10], tip.costs(away[:10]), strict=True):
        for middle in (np.empty((0, 2)), end + rng.normal(size=(2, 2)) * rng.choice([0.5, 2.0, 5.0]) * rim):
            way = np.vstack([end + d, middle, end])
            assert bound <= problem.evaluate(way).cost * (1.0 + ROUNDING)


def test_the_tip_is_of_third_order() -> None:
    loss = []
    for rim in (0.008, 0.004, 0.002, 0.001):
        problem = cg.Problem((0.4, 0.45), (0.4, 0.45), SEVERAL, 10.0)
        angle = np.linspace(0.0, 6.0, 20)
        away = rim * np.column_stack([np.cos(angle), np.sin(angle)])
        straight = [problem.evaluate([problem.goal, np.array(problem.goal) + d]).cost for d in away]
        loss.append(float(np.max(straight - EndFormula.at(problem, problem.goal, rim).costs(away))))
    assert 2.7 < oracles.rate(loss) < 3.5


def test_a_block_is_wide_where_the_cost_is_even_on_all_sides() -> None:
    even = cg.Problem((0.2, 0.2), (0.8, 0.8), cg.RiskField([cg.Threat(0.6, 0.9, 0.03)]), 10.0)
    beside = replace(even, field=cg.RiskField([cg.Threat(0.3, 0.2, 0.03)]))
    wide, narrow = (Block.around(whole(one, 128), one.start).reach for one in (even, beside))
    assert narrow <= 4
    assert wide >= 3 * narrow


def rim_points(reach: int) -> FloatArray:
    """List points of the rim of a block, in spacings from its middle."""
    share = np.linspace(-1.0, 1.0, 400) * (reach + 0.5)
    side = np.full(400, reach + 0.5)
    pairs = (share, side), (share, -side), (side, share), (-side, share)
    return np.vstack([np.column_stack(pair) for pair in pairs]) * (1.0 - 1e-12)


def spline_at(level: Level, block: Block, u: FloatArray, values: FloatArray) -> FloatArray:
    """Evaluate a spline on the rim of a block, on the cells inside."""
    mesh, middle = level.mesh, np.array(block.centre)
    cells = np.clip(np.rint(u), np.maximum(middle - block.reach, 0), np.minimum(middle + block.reach, mesh.last))
    # the cells of a whole grid, row by row
    pieces = (cells[:, 1] * (mesh.last[0] + 1) + cells[:, 0]).astype(int)
    known = mesh.controls[pieces], mesh.columns[pieces], mesh.rows[pieces]
    return oracles.spline(known, (0.0, 0.0), (1.0, 1.0), u, values)


@given(drawn.fields(), drawn.risk_weights, drawn.seeds)
@strategies.few
def test_the_rim_of_a_block_is_bounded(field: cg.RiskField, k: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    level = plain_level(field, k, (24, 24))
    problem, mesh = level.problem, level.mesh
    end = rng.uniform(0.3, 0.7, 2)
    block = Block.around(level, (end[0], end[1]))
    values = np.append(np.hypot(*(mesh.node_points - end).T) + 0.1 * rng.random(mesh.n_nodes), math.inf)
    every = np.ones(len(mesh.columns), dtype=bool)
    found = certificate_kernels.rim_excess(
        values, mesh.kernel_mesh, every, (end[0], end[1]), block.centre, block.reach, block.formula.numbers
    )
    u = rim_points(block.reach) + block.centre
    excess = spline_at(level, block, u, values) - block.formula.costs(mesh.origin + u * mesh.spacing - end)
    assert excess.max() <= found + 1e-9
    assert problem.k == k


# A closer look


def steep_end(seed: int) -> cg.Problem:
    """Draw a map whose goal is on the slope of a narrow threat: the cost there doubles within a cell or two."""
    rng = np.random.default_rng(seed)
    threats = [cg.Threat(*rng.uniform(0.2, 0.8, 2), spread=rng.uniform(0.02, 0.1)) for _ in range(rng.integers(1, 12))]
    near = threats[0]
    turn, away = rng.uniform(0.0, 2.0 * math.pi), near.spread * rng.uniform(0.0, 3.0)
    x, y = np.clip([near.x + away * math.cos(turn), near.y + away * math.sin(turn)], 0.05, 0.95).tolist()
    return cg.Problem((0.05, 0.05), (x, y), cg.RiskField(threats), k=10.0 ** rng.uniform(1.0, 3.0))


def block_of(problem: cg.Problem, cells: int, worth: float = 1e-4) -> tuple[Level, Block]:
    level = whole(problem, cells, worth)
    return level, level.goal_block


def check_near(problem: cg.Problem, seed: int) -> None:
    """Hold the bound of a box against ways to the goal from points on the rim of the block, and beyond."""
    rng = np.random.default_rng(seed)
    level, block = block_of(problem, 64)
    assert block.end_grid is not None
    rim = (block.reach + 1) * math.hypot(*level.mesh.spacing)
    turn, r = rng.uniform(0.0, 2.0 * math.pi, 3), rim * rng.uniform(0.5, 2.4, 3)
    points = np.clip(problem.goal + np.column_stack([r * np.cos(turn), r * np.sin(turn)]), 0.0, 1.0)
    for point, bound in zip(points, block.end_grid.costs(points), strict=True):
        start = float(point[0]), float(point[1])
        best = cg.solve(cg.Problem(start, problem.goal, problem.field, problem.k), "hybrid", tolerance=None, points=200)
        assert bound <= best.cost * (1.0 + ROUNDING)
        for middle in (np.empty((0, 2)), problem.goal + rng.normal(size=(2, 2)) * rng.choice([0.5, 2.0, 5.0]) * rim):
            way = np.vstack([point, np.clip(middle, 0.0, 1.0), problem.goal])
            assert bound <= problem.evaluate(way).cost * (1.0 + ROUNDING)


@given(drawn.seeds)
@example(4263375)
@strategies.few
def test_no_way_to_an_end_is_cheaper_than_a_closer_look(seed: int) -> None:
    check_near(steep_end(seed), seed)


def behind_a_wall() -> cg.Problem:
    """Lay a ridge of risk beside the goal that ends outside of the box: from behind it, the best way leaves the box."""
    ridge = [cg.Threat(0.56, 0.5 + 0.02 * i, spread=0.02) for i in range(-10, 11)]
    return cg.Problem((0.05, 0.05), (0.5, 0.5), cg.RiskField(ridge), k=200.0)


def test_ways_that_leave_the_box_are_no_cheaper_either(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = behind_a_wall()
    _, block = block_of(problem, 64)
    assert block.end_grid is not None
    behind = np.array([0.64, 0.5])
    round_it = problem.evaluate([behind, (0.64, 0.8), (0.5, 0.8), problem.goal]).cost
    assert block.end_grid.costs(behind[None])[0] <= round_it
    # without the cap, the box says that the only way leads over the ridge
    monkeypatch.setattr(EndGrid, "kernel_box", property(lambda self: (*kernel_box(self)[:5], math.inf)))
    assert block.end_grid.costs(behind[None])[0] > round_it


kernel_box = EndGrid.kernel_box.fget  # type: ignore[attr-defined]


@pytest.mark.slow
def test_a_closer_look_keeps_what_the_formula_loses() -> None:
    kept = []
    for seed in range(12):
        problem = steep_end(seed)
        plain, close = (block_of(problem, 128, worth)[0].bound(to_goal=True, aim=1e-3) for worth in (math.inf, 1e-4))
        cost = cg.solve(problem, "hybrid", tolerance=None).cost
        assert plain is not None
        assert close is not None
        assert close.bound <= cost * (1.0 + ROUNDING)
        kept.append((plain.bound / cost, close.bound / cost))
    plain_kept, close_kept = np.array(kept).T
    assert (close_kept >= plain_kept - 0.01).all()
    assert (close_kept - plain_kept).max() > 0.1


@pytest.mark.slow
def test_long_maps_with_steep_ends_are_proven_on_few_cells() -> None:
    threats = [cg.Threat(1.0 * i + 0.5, 0.5 + 0.3 * (-1) ** i, spread=0.15) for i in range(14)]
    problem = cg.Problem((0.4, 0.6), (13.3, 0.3), cg.RiskField(threats), k=150.0, bounds=(0, 0, 14, 1))
    path = cg.solve(problem, "hybrid", tolerance=None).path
    found = cg.lower_bound(problem, 0.005, path=path, max_cells=400_000)
    assert found.reached


@given(drawn.seeds, st.booleans())
@example(seed=172734103, capped=False)
@strategies.few
def test_the_rim_of_a_block_is_bounded_by_a_box(seed: int, capped: bool) -> None:
    rng = np.random.default_rng(seed)
    problem = steep_end(seed)
    level, block = block_of(problem, 64)
    near, mesh = block.end_grid, level.mesh
    assert near is not None
    values = np.append(np.hypot(*(mesh.node_points - problem.goal).T) + 0.1 * rng.random(mesh.n_nodes), math.inf)
    near = EndGrid(near.mesh, near.values, near.cap if capped else math.inf, near.blind)
    found = replace(block, end_grid=near).excess(level, values)
    u = rim_points(block.reach) + block.centre
    points = np.array(mesh.origin) + u * mesh.spacing
    inside = ((points > 0.0) & (points < 1.0)).all(axis=1)
    excess = spline_at(level, block, u, values)[inside] - near.costs(points[inside])
    assert excess.max() <= found + 1e-9
    # and not by far more than is needed
    assert found <= excess.max() + 0.1 * (1.0 + abs(excess).max())

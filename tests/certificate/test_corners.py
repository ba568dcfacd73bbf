"""
Blocks around corners: no way through one costs less than the proof says, and with them bounds are of higher order.

The oracle is the cost of paths: straight, over corners, and refined.
"""

import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import oracles
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st
from levels import missing, whole
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate import corner_kernels
from cgla_graph.certificate.corners import Corner, links_of, walls_inside
from cgla_graph.eikonal.marching import costs_to_go
from cgla_graph.eikonal.mesh import SplineMesh
from cgla_graph.errors import CglaError
from cgla_graph.refine.refine import refine_path
from cgla_graph.testing import strategies as drawn

#: More than any way of these maps costs.
HIGH = np.full(3, 1e3)


def around_corner(seed: int) -> cg.Problem:
    """Draw a wedge, blunt or sharp, or a thin wall, with its tip near the middle, and risk around it."""
    rng = np.random.default_rng(seed)
    tip, turn = rng.uniform(0.42, 0.58, 2), rng.uniform(0.0, 2.0 * math.pi)
    half = rng.choice([0.01, rng.uniform(0.1, 1.4)])
    sides = [turn - half, turn + half]
    if half == 0.01:
        along, across = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
        width = rng.uniform(0.002, 0.03) * across
        points = [tip, tip + 0.3 * along, tip + 0.3 * along + width, tip + width]
    else:
        points = [tip, *(tip + rng.uniform(0.2, 0.3) * np.array([math.cos(a), math.sin(a)]) for a in sides)]
    threats = [
        cg.Threat(*rng.normal(tip, 0.1 * rng.integers(3)), spread=rng.uniform(0.1, 0.6), peak=rng.uniform(0.1, 1.0))
        for _ in range(rng.integers(4))
    ]
    k = float(rng.choice([0.0, 1.0, 10.0, 100.0]))
    return cg.Problem((0.02, 0.02), (0.98, 0.98), cg.RiskField(threats), k, no_fly=shapely.Polygon(points))


def place_of(corner: Corner, mesh: SplineMesh) -> FloatArray:
    """Return where the corner is."""
    cell = np.array([mesh.columns[corner.rim[0]], mesh.rows[corner.rim[0]]])
    return np.asarray(mesh.origin + (cell + corner.places[0, :2]) * mesh.spacing - corner.lines[0, :2])


def least_cost(problem: cg.Problem, a: FloatArray, b: FloatArray, vertices: FloatArray) -> float:
    """Return the cost of the cheapest way from one point to the other that comes to mind."""
    between = [[], *([vertex] for vertex in vertices), *map(list, itertools.permutations(vertices, 2))]
    ways = [np.array([a, *bends, b]) for bends in between]
    try:
        here = cg.Problem(tuple(a), tuple(b), problem.field, problem.k, no_fly=problem.no_fly, bounds=problem.bounds)
    except CglaError:
        return math.inf
    feasible = [way for way in ways if here.evaluate(way).feasible]
    if not feasible:
        return math.inf
    best = min(feasible, key=lambda way: here.evaluate(way).cost)
    refined = refine_path(here, best).path
    return min(here.evaluate(way).cost for way in (best, refined) if len(way))


def at(part: FloatArray, t: float, curve: FloatArray) -> FloatArray:
    """Return a single point of a part of the rim as kernels take it."""
    out = np.empty(7)
    corner_kernels.cut(part, curve, t, t, out)
    return out


def check_ways(seed: int, cells: int) -> int:
    """Compare what ways have to cost with what some do; return over how many pairs."""
    problem = around_corner(seed)
    level, rng = whole(problem, cells), np.random.default_rng(seed)
    compared = 0
    for corner in level.corners:
        place = place_of(corner, level.mesh)
        for i, j in rng.integers(len(corner.lines), size=(12, 2)):
            # what falls so far is above all
            one, two = at(corner.lines[i], rng.random(), HIGH), at(corner.lines[j], rng.random(), 0.0 * HIGH)
            said = HIGH[0] - corner_kernels.excess_over(one, two, corner.vertices, corner.walls, corner.numbers)
            cost = least_cost(problem, place + one[:2], place + two[:2], place + corner.vertices)
            # (a difference of numbers as great as HIGH)
            assert said <= cost * (1.0 + 1e-9) + 8.0 * np.spacing(HIGH[0])
            compared += 1
    return compared


@given(drawn.seeds, st.sampled_from([96, 160, 300]))
@example(19132, 96)
@examples(30)
def test_no_way_between_points_of_a_rim_costs_less_than_it_has_to(seed: int, cells: int) -> None:
    check_ways(seed, cells)


def bends_for_nothing(*_: object) -> float:
    return 0.0


def no_line_is_free(*_: object) -> bool:
    return True


@pytest.mark.parametrize(
    ("name", "broken"), [("bent", bends_for_nothing), ("is_blocked", no_line_is_free), ("leg", None)]
)
def test_a_charge_without_one_of_its_steps_is_caught(
    name: str, broken: Callable[..., Any] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for each in ("excess_over", "over_bend", "leg", "bent", "highest", "is_blocked", "cut"):
        monkeypatch.setattr(corner_kernels, each, getattr(corner_kernels, each).py_func)
    leg = corner_kernels.leg

    def longer(*arguments: Any) -> tuple[float, ...]:  # noqa: ANN401 - those of the kernel
        *linear, constant = leg(*arguments)
        return (*(1.01 * one for one in linear), constant)

    assert sum(check_ways(seed, 96) for seed in range(6)) > 20
    monkeypatch.setattr(corner_kernels, name, broken or longer)
    with pytest.raises(AssertionError):
        check_all(range(60))


def check_all(seeds: Iterable[int]) -> None:
    for seed in seeds:
        check_ways(seed, 96)


@given(drawn.seeds)
@examples(20)
def test_a_charge_is_the_greatest_excess_on_the_rim(seed: int) -> None:
    problem = around_corner(seed)
    level, rng = whole(problem, 96), np.random.default_rng(seed)
    assume(level.corners)
    corner = level.corners[0]
    # as steep as ways are expensive, about, and a little more
    slope = corner.numbers[corner_kernels.COST] * rng.uniform(0.9, 1.02)
    turn = rng.uniform(0.0, 2.0 * math.pi)
    heights = slope * level.mesh.node_points @ (math.cos(turn), math.sin(turn))
    values = np.append(heights, math.inf)
    charge = corner.charge(values, level.mesh)
    curves = np.empty((len(corner.rim), 3))
    corner_kernels.curves(corner.places, corner.rim, level.mesh.controls, values, curves)
    points = [at(*line, curve) for line, curve in some_points(corner, curves, rng)]
    worst = max(
        corner_kernels.excess_over(one, two, corner.vertices, corner.walls, corner.numbers)
        for one in points
        for two in points
    )
    assert worst <= charge
    if math.isfinite(charge):
        assert charge <= 1.03 * max(worst, 0.0) + 0.02 * slope * min(level.mesh.spacing)


def some_points(
    corner: Corner, curves: FloatArray, rng: np.random.Generator
) -> list[tuple[tuple[FloatArray, float], FloatArray]]:
    return [
        ((corner.lines[i], float(t)), curves[i]) for i in range(len(corner.lines)) for t in (0.0, rng.random(), 1.0)
    ]


def fan_errors(cells: int, *, bends: bool) -> tuple[float, float]:
    """Solve for the costs above a wall, where they are known; return the least and greatest error, in spacings."""
    left, right, wall = np.array([0.452, 0.517]), np.array([0.552, 0.517]), shapely.box(0.452, -0.1, 0.552, 0.517)
    problem = cg.Problem((0.93, 0.2), (0.07, 0.31), no_fly=wall)
    level = whole(problem, cells)
    assert len(level.corners) == 2
    mesh, goal = level.mesh, np.array(problem.goal)
    links, radius = links_of(mesh, level.corners if bends else []), 4.5 * max(mesh.spacing)
    times = costs_to_go(problem, mesh, problem.goal, mesh.ends[1], level.costs, radius=radius, links=links)
    points = mesh.node_points
    # right of the wall and below its end, all ways bend twice
    behind = (points > (right[0] + 0.05, 0.0)).all(axis=1) & (points < (1.0, 0.45)).all(axis=1)
    to_goal = math.dist(goal, left) + math.dist(left, right) + np.hypot(*(points - right).T)
    errors = cells * (times[:-1] - to_goal)[behind]
    return float(errors.min()), float(errors.max())


@pytest.mark.parametrize("cells", [100, 200, 400])
def test_fronts_bend_around_corners_and_do_not_cut_them(cells: int) -> None:
    least, most = fan_errors(cells, bends=True)
    assert -0.5 < least < most < 0.5
    # without, they cut each by a cell
    assert fan_errors(cells, bends=False)[0] < -2.0


@pytest.mark.slow
@pytest.mark.parametrize(("name", "cells"), [("maze", 1_500_000), ("thin-wall", 1_500_000), ("finland", 1_500_000)])
def test_shipped_maps_with_areas_are_proven_to_a_twentieth_of_a_percent(name: str, cells: int) -> None:
    proof = cg.lower_bound(cg.load_scenario(name).problem, 5e-4, max_cells=cells)
    assert proof.reached, proof.message


@pytest.mark.slow
def test_around_corners_bounds_are_of_higher_order() -> None:
    problem = cg.load_scenario("maze").problem
    loss = missing(problem, cg.solve(problem, "visibility-graph").cost, 128, 256, 512, aim=1e-5)
    assert 0.0 < loss[-1] < 0.0012
    assert oracles.rate(loss) > 1.25


def test_slivers_have_no_walls_inside() -> None:
    """Of one without an area, but valid; `shapely.clip_by_rect` fails on it."""
    sliver = shapely.Polygon([(0.64, 0.38), (0.6, 0.3), (0.5, 0.1)])
    assert walls_inside(sliver, np.array([0.5, 0.1]), 0.165728151840597, 1e-3).shape == (0, 4)
    square = shapely.union(sliver, shapely.box(0.0, 0.0, 0.5, 0.5))
    assert walls_inside(square, np.array([0.5, 0.1]), 0.05, 1e-3).shape == (4, 4)

"""No path through a cell costs less than the bound of that cell, on maps of all kinds."""

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import a_part_of, examples
from test_certificate import good_path, maps, raster_maps, some_paths

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate.through import Through, bottleneck, bounds_through, grids_through
from cgla_graph.errors import CglaError, ProblemError
from cgla_graph.testing import strategies as drawn

ROUNDING = 1e-9
THREAT = cg.RiskField([cg.Threat(0.5, 0.5, spread=0.1, peak=0.9)])
BOX = cg.Problem((0.1, 0.5), (0.9, 0.5), THREAT, 5.0, no_fly=shapely.box(0.45, 0.3, 0.55, 0.8))


def maps_in_degrees(seed: int) -> cg.Problem:
    """Draw a map of the Earth, up to ten degrees high, with boxes in half of them."""
    rng = np.random.default_rng(seed)
    low, size = rng.uniform((-170.0, -65.0), (160.0, 65.0)), 10.0 ** rng.uniform(-2.0, 1.0)
    bounds = (float(low[0]), float(low[1]), float(low[0] + 1.5 * size), float(low[1] + size))
    places = [(float(x), float(y)) for x, y in rng.uniform(bounds[:2], bounds[2:], (10, 2))]
    spread = size * 1e5 * 10.0 ** rng.uniform(-1.5, -0.3)
    threats = [cg.Threat(*place, spread=spread, peak=0.8) for place in places[: rng.integers(0, 5)]]
    boxes = [shapely.box(x, y, x + 0.3 * size, y + 0.2 * size) for x, y in places[5:7]] if seed % 2 else []
    k = float(rng.choice([0.0, 1.0, 20.0]))
    try:
        return cg.Problem.in_degrees(
            places[8], places[9], bounds=bounds, threats=threats, k=k, no_fly=shapely.union_all(boxes)
        )
    except CglaError:
        return maps_in_degrees(seed + 1)


def maps_with_clearance(seed: int) -> cg.Problem:
    problem = maps(seed)
    sides = np.subtract(problem.bounds[2:], problem.bounds[:2])
    try:
        return replace(problem, clearance=float(10.0 ** np.random.default_rng(seed).uniform(-3, -1.5) * sides.min()))
    except CglaError:
        return maps_with_clearance(seed + 1)


DRAWS = [maps, raster_maps, maps_in_degrees, maps_with_clearance]


def best_through(problem: cg.Problem, place: FloatArray) -> list[FloatArray]:
    """Join good paths from the start to a place and from there to the goal."""
    at = (float(place[0]), float(place[1]))
    try:
        parts = [good_path(replace(problem, goal=at), 7), good_path(replace(problem, start=at), 7)]
    except CglaError:
        return []
    return [] if parts[0] is None or parts[1] is None else [np.vstack([parts[0], parts[1][1:]])]


def highest_on(found: Through, path: FloatArray) -> float:
    """Return the greatest bound of the cells that a path touches."""
    step = max(0.3 * min(found.spacing), float(np.hypot(*np.diff(path, axis=0).T).sum()) / 5000.0)
    points = shapely.get_coordinates(shapely.segmentize(shapely.LineString(path), step) if step > 0.0 else path)
    columns, rows = np.rint((points - found.problem.bounds[:2]) / found.spacing).astype(int).T
    return float(found.on_cells()[rows, columns].max())


def check_through(problem: cg.Problem, seed: int, *, scale: float = 1.0, through: int = 2) -> int:
    """Hold the bounds of a grid, and of refined ones, against many paths; return how many."""
    rng = np.random.default_rng(seed)
    paths = some_paths(problem, rng)
    for place in rng.uniform(problem.bounds[:2], problem.bounds[2:], (through, 2)):
        paths += best_through(problem, place)
    judged = [(path, problem.evaluate(path)) for path in paths]
    costs = [(path, one.cost) for path, one in judged if one.feasible]
    if not costs:
        return 0
    best, least = min(costs, key=lambda one: one[1])
    held = None if seed % 2 else best
    sides = np.subtract(problem.bounds[2:], problem.bounds[:2])
    columns, rows = (max(8, round(rng.choice([20, 40, 64]) * side)) for side in (sides / sides.max()).tolist())
    whole = bounds_through(problem, last=(columns, rows), path=held)
    limit = least * float(rng.choice([1.0, 1.01, 1.3]))
    grids = itertools.islice(grids_through(problem, limit=limit, path=held, max_cells=20_000), 2)
    tubes = (grid.through for grid in grids)
    assert scale * bottleneck(whole.on_cells(), problem.bounds, problem.start, problem.goal) <= least * (1.0 + ROUNDING)
    for found in [whole, *tubes]:
        assert scale * found.lower_bound <= least * (1.0 + ROUNDING)
        for path, cost in costs:
            assert scale * highest_on(found, path) <= cost * (1.0 + ROUNDING)
    return len(costs)


@pytest.mark.slow
@given(st.sampled_from(DRAWS), drawn.seeds)
@examples(6)
def test_no_path_costs_less_than_the_bound_of_a_cell_that_it_touches(
    draw: Callable[[int], cg.Problem], seed: int
) -> None:
    check_through(draw(seed), seed)


@pytest.mark.slow
def test_no_path_of_thousands_costs_less_than_the_bound_of_a_cell_that_it_touches() -> None:
    seeds = a_part_of(range(120))
    assert sum(check_through(DRAWS[seed % 4](seed), seed, through=6) for seed in seeds) > 5 * len(seeds)


def test_bounds_that_are_too_high_by_a_hundredth_are_caught() -> None:
    assert check_through(BOX, 4) > 0
    with pytest.raises(AssertionError):
        check_through(BOX, 4, scale=1.01)


def test_without_risk_the_bound_is_the_way_over_the_cell() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5))
    found = bounds_through(problem, last=(200, 200))
    middles = np.column_stack([found.columns, found.rows]) / 200.0
    ways = sum(np.hypot(*(middles - end).T) for end in (problem.start, problem.goal))
    # (half a cell off at most, on the side that is nearer to both)
    assert (found.least <= ways).all()
    assert (found.least >= ways - 2.0 * 0.0025 * (math.sqrt(2.0) + ROUNDING)).all()


def test_cells_that_are_not_listed_cost_the_limit() -> None:
    found = bounds_through(BOX, limit=1.2, max_cells=20_000)
    on_cells = found.on_cells()
    assert on_cells.max() == 1.2
    assert (on_cells < 1.2).sum() == len(np.unique(np.column_stack([found.rows, found.columns]), axis=0))
    assert found.lower_bound <= found.least.min() < found.upper_bound < 1.2
    assert found.path is not None
    assert not found.path.flags.writeable


def test_the_cells_of_the_best_path_are_listed_on_every_grid() -> None:
    best = bounds_through(BOX, last=(64, 64)).upper_bound
    for grid in grids_through(BOX, limit=best * (1.0 + ROUNDING), max_cells=60_000):
        found = grid.through
        assert found.path is not None
        assert highest_on(found, found.path) < found.limit


def test_a_goal_that_is_walled_in_costs_infinity() -> None:
    ring = shapely.Point(0.9, 0.5).buffer(0.08).difference(shapely.Point(0.9, 0.5).buffer(0.04))
    found = bounds_through(replace(BOX, no_fly=ring), last=(100, 100))
    assert math.isinf(found.lower_bound)
    assert np.isinf(found.on_cells()).all()


def test_a_chain_over_corners_is_a_chain() -> None:
    least = np.array([[1.0, 9.0, 9.0], [9.0, 2.0, 9.0], [9.0, 9.0, 1.5]])
    assert bottleneck(least, (0, 0, 2, 2), (0, 0), (2, 2)) == 2.0
    assert math.isinf(bottleneck(np.where(least > 2.0, math.inf, least), (0, 0, 2, 2), (0, 2), (2, 2)))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"tolerance": 0.0}, "tolerance"),
        ({"last": (500, 500), "max_cells": 1000}, "max_cells is 1000"),
        ({"path": [(0.1, 0.5), (0.9, 0.5)]}, "not feasible"),
        ({"path": [(0.1, 0.5), (0.2, 0.5)]}, "has to join"),
    ],
)
def test_what_makes_no_sense_is_refused(settings: dict[str, object], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        bounds_through(BOX, **settings)  # type: ignore[arg-type]


def test_an_end_outside_is_refused() -> None:
    with pytest.raises(ProblemError, match="outside the bounds"):
        bottleneck(np.zeros((3, 3)), (0, 0, 2, 2), (0, 0), (3, 0))

"""Proofs of a ten-thousandth and closer: what a bound loses on a grid, at ends, beside walls, and around corners."""

import math

import pytest
import shapely
import shapely.affinity

import cgla_graph as cg
from tests.support import precise_maps
from tests.support.levels import whole

TURNED_BOX = shapely.affinity.rotate(shapely.box(0.35, 0.3, 0.65, 0.6), 17.0)


def lost(problem: cg.Problem, cells: int, best: float) -> float:
    """Return the part of the best cost that a bound on a grid of the whole map misses."""
    path = cg.solve(problem, tolerance=None).path
    found = whole(problem, cells, 1e-6 * best, path).bound(to_goal=True, aim=5e-6, charge=True, known=best)
    assert found is not None
    assert found.bound <= best
    return 1.0 - found.bound / best


def test_along_a_straight_slanted_wall_no_cell_is_steep_for_its_steps() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=TURNED_BOX)
    corner = max(shapely.get_coordinates(TURNED_BOX).tolist(), key=lambda point: point[1])
    assert lost(problem, 512, math.dist(problem.start, corner) + math.dist(corner, problem.goal)) < 5e-4


def test_where_the_cost_is_even_blocks_around_ends_are_wide() -> None:
    assert lost(cg.Problem((0.1, 0.5), (0.9, 0.5)), 256, 0.8) < 1.5e-4


def test_corners_far_from_the_path_are_not_charged_for() -> None:
    boxes = [shapely.box(0.3 + 0.1 * i, 0.6, 0.35 + 0.1 * i, 0.65) for i in range(4)]
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.union_all(boxes))
    assert len(whole(problem, 512).corners) > 0
    assert not whole(problem, 512, 1e-6, cg.solve(problem, tolerance=None).path).corners


@pytest.mark.parametrize("seed", [5, 6, 10])
def test_random_maps_with_areas_are_proven_to_a_ten_thousandth(seed: int) -> None:
    problem = precise_maps.drawn(seed)
    assert cg.lower_bound(problem, 1e-4).reached

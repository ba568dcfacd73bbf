"""Plans along a border of the map that an area closes."""

import math

import pytest
import shapely
from shapely.geometry.base import BaseGeometry

import cgla_graph as cg

WALL = shapely.box(0.45, 0.0, 0.55, 1.0)
TIP = shapely.Polygon([(0.4, 0.5), (0.6, 0.5), (0.5, 1.0)])
PLAN = [(0.1, 0.5), (0.1, 1.0), (0.9, 1.0), (0.9, 0.5)]


@pytest.mark.parametrize("area", [WALL, TIP, shapely.box(0.45, 0.2, 0.55, 1.0 - 1e-12)])
def test_a_leg_along_a_closed_stretch_crosses(area: BaseGeometry) -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=area)
    checked = cg.check(PLAN, problem, tolerance=None)
    assert checked.verdict == ["not clean: 1 leg crosses 1 area"]
    assert [one.leg for one in checked.crossings.found] == [1]
    assert checked.on.areas[0].shape is area
    lower = [(x, 1.0 - y) for x, y in PLAN]
    assert cg.check(lower, problem, tolerance=None).is_clean is (area is not WALL)


@pytest.mark.parametrize("first", [shapely.box(0.2, 0.0, 0.5, 0.3), shapely.box(0.2, -0.3, 0.5, 0.3)])
def test_a_plan_between_two_areas_and_the_border_where_all_meet_crosses(first: BaseGeometry) -> None:
    second = shapely.Polygon([(0.5, 0.0), (0.8, 0.3), (0.7, 0.6)])
    problem = cg.Problem((0.5, 0.2), (0.9, 0.0), no_fly=shapely.MultiPolygon([first, second]))
    plan = [(0.5, 0.2), (0.5, 0.0), (0.9, 0.0)]
    assert not problem.evaluate(plan).feasible
    assert not cg.check(plan, problem, tolerance=None).is_clean
    around = cg.solve(problem, "visibility-graph").path
    assert cg.check(around, problem, tolerance=None).is_clean


def test_no_clean_plan_passes_a_closed_border() -> None:
    checked = cg.check(PLAN, cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=WALL))
    assert checked.best is not None
    assert checked.best.lower_bound == math.inf

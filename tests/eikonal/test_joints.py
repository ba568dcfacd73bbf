"""Fronts past the ends of walls: there, nodes are beside more nodes than four neighbours, and times must not jump."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
import strategies
from hypothesis import given
from hypothesis import strategies as st
from shapely import affinity

from cgla_graph._types import FloatArray, Point
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import costs_to_go, node_costs
from cgla_graph.eikonal.mesh import NO_PAIRS, SplineMesh, joints_of
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.testing import strategies as drawn

BOX = shapely.box(0.0, 0.0, 1.0, 1.0)
#: A wall that ends on the border of the map, which it closes.
WALL = shapely.Polygon([(0.61, 0.17), (1.0, 0.09), (1.0, 0.08), (0.61, 0.16)])


def laid(area: shapely.Geometry, goal: Point, last: tuple[int, int]) -> tuple[Problem, SplineMesh]:
    start = next(p for p in ((0.01, 0.01), (0.01, 0.99), (0.99, 0.01)) if not area.contains(shapely.Point(p)))
    problem = Problem(start, goal, RiskField([Threat(0.5, 0.5, 0.2, 0.8)]), k=10.0, bounds=(0, 0, 1, 1), no_fly=area)
    runs = cell_runs.rectangle(last)
    return problem, SplineMesh.build(problem.bounds, last, runs, problem.model.area, [start, goal])


def jump(problem: Problem, mesh: SplineMesh) -> float:
    """Return the greatest difference between two nodes that one piece has side by side, in their cost and distance."""
    cost: FloatArray = node_costs(problem, mesh)
    times = costs_to_go(problem, mesh, problem.goal, mesh.ends[1], cost, radius=3.0 * max(mesh.spacing))
    around = mesh.controls.reshape(-1, 3, 3)
    worst = 0.0
    for axis, step in ((1, mesh.spacing[1]), (2, mesh.spacing[0])):
        one, other = np.moveaxis(around, axis, 0)[:-1].ravel(), np.moveaxis(around, axis, 0)[1:].ravel()
        inside = ~mesh.outside[one] & ~mesh.outside[other] & np.isfinite(times[one]) & np.isfinite(times[other])
        one, other = one[inside], other[inside]
        steep = np.abs(times[one] - times[other]) / (np.maximum(cost[one], cost[other]) * step)
        worst = max(worst, float(steep.max(initial=0.0)))
    return worst


#: A difference of second order steps a third further than its cost, where the one before did.
MOST = 1.5


@st.composite
def walled(draw: st.DrawFn) -> tuple[shapely.Geometry, Point, tuple[int, int]]:
    """Draw walls and boxes that end at the rim of the map or on each other, a goal outside, and a grid."""
    rng = np.random.default_rng(draw(drawn.seeds))
    parts = []
    for _ in range(draw(st.integers(1, 6))):
        size = rng.uniform(0.05, 0.7)
        shape = shapely.box(-size, -size * rng.choice([1e-6, 0.02, 0.3]), size, 0.0)
        parts.append(affinity.translate(affinity.rotate(shape, rng.uniform(0.0, 180.0)), *rng.uniform(0.0, 1.0, 2)))
    area = shapely.union_all(parts).intersection(BOX)
    points = rng.uniform(0.0, 1.0, (64, 2))
    free = points[~shapely.contains_xy(area, points)]
    ends = [(0.01, 0.01), (0.01, 0.99), (0.99, 0.01)]
    if not len(free) or all(area.contains(shapely.Point(end)) for end in ends):
        area = WALL
        free = np.array([[0.3, 0.3]])
    return area, (float(free[0, 0]), float(free[0, 1])), draw(st.sampled_from([(48, 48), (64, 24), (17, 40)]))


@given(walled())
@strategies.usual
def test_times_do_not_jump_where_a_spline_is_continuous(drawn: tuple[shapely.Geometry, Point, tuple[int, int]]) -> None:
    assert jump(*laid(*drawn)) <= MOST


def test_without_joints_times_jump() -> None:
    """The property can tell: a front that only goes to neighbours reaches nodes beside a wall from the wrong side."""
    problem, mesh = laid(WALL, (0.81, 0.16), (48, 48))
    assert len(mesh.joints[1])
    assert jump(problem, mesh) <= MOST
    assert jump(problem, replace(mesh, joints=joints_of(NO_PAIRS, mesh.spacing, mesh.n_nodes))) > MOST


@pytest.mark.slow
@given(walled())
@strategies.usual
def test_every_joint_is_listed(drawn: tuple[shapely.Geometry, Point, tuple[int, int]]) -> None:
    _, mesh = laid(*drawn)
    known = mesh.neighbours.astype(np.int64)
    joints = set()
    around = mesh.controls.astype(np.int64).reshape(-1, 3, 3)
    for axis, step, there, back in ((1, mesh.spacing[1], 3, 2), (2, mesh.spacing[0], 1, 0)):
        turned = np.moveaxis(around, axis, 0)
        one, other = turned[:-1].ravel(), turned[1:].ravel()
        apart = (known[one, there] != other) | (known[other, back] != one)
        for a, b in ((one, other), (other, one)):
            joints |= {(i, j, step) for i, j in zip(a[apart].tolist(), b[apart].tolist(), strict=True)}
    first, node, other_node, length = mesh.joints
    listed = list(zip(node.tolist(), other_node.tolist(), length.tolist(), strict=True))
    assert set(listed) == joints
    assert len(listed) == len(joints)
    assert all(node[first[i]] == i and (first[i] == 0 or node[first[i] - 1] != i) for i in node)

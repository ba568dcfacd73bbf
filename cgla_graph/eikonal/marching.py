"""Costs-to-go over a mesh: the eikonal equation ``|grad T| = 1 + k F`` by fast marching, and its steepest descent."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import MultiPoint
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, FloatArray, Point, WholeArray
from cgla_graph.eikonal import front_kernels, marching_kernels
from cgla_graph.eikonal.marching_kernels import Bends, Joints
from cgla_graph.eikonal.mesh import SplineMesh, corners, places_in
from cgla_graph.model import graph_kernels
from cgla_graph.model.problem import Problem

#: Steps of a descent, at most, and how many of its points are kept where it has to be led around corners.
MOST_STEPS, MOST_WAYPOINTS = 200_000, 250
#: Most corners that a descent is led around. Of more, only those that stand out in squares are used; the squares get
#: wider, as parts of the reach within which corners count, until the corners are few enough.
MOST_CORNERS, SQUARES = 600, (0.125, 0.25, 0.5, 1.0, 2.0)


class Links(NamedTuple):
    """The neighbours and joints of nodes, and the corners that paths bend around (see `marching_kernels`)."""

    neighbours: WholeArray
    joints: Joints
    bends: Bends


class Sight(NamedTuple):
    """
    Nodes in sight of a corner of an area, the costs of the straight lines to it, and the nodes from which paths come.

    Behind a corner, costs-to-go bend like one over the distance to it, and differences are wrong by first order in the
    spacing. The straight lines from nodes to the corner have exact costs.
    """

    nodes: WholeArray
    costs: FloatArray
    enter: BoolArray

    def part(self, nodes: WholeArray) -> "Sight":
        """Leave out all but some nodes of the mesh, which are numbered anew."""
        found = places_in(nodes, self.nodes)
        there = found >= 0
        return Sight(found[there], self.costs[there], self.enter[there])


def bends_of(sights: Sequence[Sight], n_nodes: int) -> Bends:
    """
    Lay out the nodes in sight of each corner as `march` takes them.

    Examples
    --------
    >>> sight = Sight(np.array([2, 0, 3]), np.array([0.1, 0.2, 0.3]), np.array([True, True, False]))
    >>> first_entry, *_ = bends_of([sight], 4)
    >>> first_entry.tolist()
    [0, -1, 1, -1, -1]
    """
    counts = [len(sight.nodes) for sight in sights]
    first_node = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    node = np.concatenate([np.empty(0), *(sight.nodes for sight in sights)]).astype(np.int32)
    cost = np.concatenate([np.empty(0), *(sight.costs for sight in sights)])
    bend = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    enter = np.concatenate([np.empty(0, dtype=np.bool_), *(sight.enter for sight in sights)])
    order = np.flatnonzero(enter)[np.argsort(node[enter], kind="stable")]
    first_entry = np.full(n_nodes + 1, -1, dtype=np.int32)
    # of equal nodes, the first
    first_entry[node[order][::-1]] = np.arange(len(order), dtype=np.int32)[::-1]
    return first_entry, node[order], bend[order], cost[order], first_node, node, cost


def node_costs(problem: Problem, mesh: SplineMesh) -> FloatArray:
    """Return the cost of a unit of length ``1 + k F`` at each node, shape ``(n,)``."""
    return 1.0 + problem.k * problem.field.density(mesh.node_points)


def costs_to_go(
    problem: Problem,
    mesh: SplineMesh,
    source: Point,
    piece: int,
    cost: FloatArray,
    *,
    radius: float,
    second: bool = True,
    start_factor: float = 1.0,
    first: Callable[[FloatArray], FloatArray] | None = None,
    links: Links | None = None,
) -> FloatArray:
    """
    Solve the eikonal equation from a source by fast marching.

    Parameters
    ----------
    problem
        Its field and area give the costs of straight lines near the source.
    mesh
        The mesh; nodes just outside the bounds mirror those inside.
    source, piece
        The point where ``T = 0``, and its piece of the mesh; without a piece (-1), no node is reached.
    cost
        Cost of a unit of length at each node, shape ``(n,)``.
    radius
        Nodes within this distance of the source, in its sight, begin with the exact cost of the straight line, map
        units.
    second
        Whether to use differences of second order where they are possible.
    start_factor
        Factor of those first costs.
    first
        Function from points, shape ``(m, 2)``, to the costs that those nodes begin with instead, shape ``(m,)``; nodes
        with infinite cost do not begin.
    links
        The links of nodes, instead of those of the mesh.

    Returns
    -------
    times
        The least cost from each node to the source, shape ``(n + 1,)``: infinite where there is no path, and at index
        n.
    """
    n = mesh.n_nodes
    if piece < 0:
        return np.full(n + 1, np.inf)
    times, state = np.full(n + 1, np.inf), np.zeros(n + 1, dtype=np.int8)
    # nodes that count as done, at infinite cost, are not updated
    state[:n][mesh.outside] = marching_kernels.DONE
    padded = np.append(cost, 1.0)
    area = problem.model.area.kernel_arrays
    front_kernels.begin_disc(mesh.controls[piece], mesh.kernel_nodes, source, radius, area, state)
    begun = np.flatnonzero(state == marching_kernels.SEED)
    near = mesh.node_points[begun]
    times[begun] = start_factor * (straight_costs(problem, near, source) if first is None else first(near))
    state[begun[np.isinf(times[begun])]] = marching_kernels.FAR
    march(mesh, times, state, padded, links or Links(mesh.neighbours, mesh.joints, bends_of([], n)), second=second)
    front_kernels.mirror(mesh.kernel_nodes, mesh.last, times)
    return times


def straight_costs(problem: Problem, points: FloatArray, source: Point | FloatArray) -> FloatArray:
    """Return the costs of straight lines from points, shape ``(n, 2)``, to a point, ignoring areas, shape ``(n,)``."""
    risk = problem.field.line_integral(points, source) if problem.k > 0.0 else 0.0
    # (costs beyond the largest float are infinite)
    with np.errstate(over="ignore"):
        return np.asarray(np.hypot(*(points - source).T) + problem.k * risk)


def march(
    mesh: SplineMesh, times: FloatArray, state: WholeArray, cost: FloatArray, links: Links, *, second: bool = True
) -> None:
    """Complete times of arrival, in place; arrays as `marching_kernels.march` takes them, shapes ``(n + 1,)``."""
    neighbours, joints, bends = links
    rest = cost, neighbours, mesh.beside_wall, mesh.spacing, second, joints, bends
    marching_kernels.march(times, state, *rest)
    while mesh.has_walls and front_kernels.bridge(mesh.controls, cost, mesh.spacing, times, state):
        marching_kernels.march(times, state, *rest)


def descent(problem: Problem, mesh: SplineMesh, times: FloatArray, *, radius: float) -> FloatArray:
    """
    Follow costs-to-go down from the start of a problem to its goal.

    Parameters
    ----------
    problem
        The problem whose bounds and area the mesh covers.
    mesh
        Its first end is the start.
    times
        Costs to the goal, up to a constant, shape ``(n + 1,)`` (`costs_to_go`).
    radius
        Distance from the goal, in spacings, within which the last step leads straight to it.

    Returns
    -------
    path
        Waypoints a spacing apart, shape ``(m, 2)``, map units. Where they cut corners of the area, it is the best
        polyline through them and the corners nearby. Empty if the descent does not reach the goal.
    """
    piece = mesh.ends[0]
    if piece < 0 or not np.isfinite(times[mesh.controls[piece]]).all():
        return np.empty((0, 2))
    piece_of = np.full(mesh.n_nodes, -1, dtype=np.int32)
    piece_of[mesh.controls[:, 4]] = np.arange(len(mesh.controls), dtype=np.int32)
    # no descent is longer than one through every cell
    path = np.empty((min(2 * len(mesh.controls), MOST_STEPS), 2))
    origin, spacing = np.array(mesh.origin), np.array(mesh.spacing)
    first, end = ((np.array(point) - origin) / spacing for point in (problem.start, problem.goal))
    pieces = (mesh.controls, mesh.columns, mesh.rows, piece_of)
    count = marching_kernels.descend(
        (first[0], first[1]), piece, (end[0], end[1]), radius, mesh.last, times, pieces, mesh.neighbours, path
    )
    if count < 0:
        return np.empty((0, 2))
    # rounding may put a point on the rim of the map just outside
    inside = np.clip(origin + spacing * path[1:count], origin, problem.bounds[2:])
    found = np.vstack([problem.start, inside, problem.goal])
    if problem.model.area.crosses(found[:-1], found[1:]).any():
        return around_corners(problem, found, 4.0 * max(mesh.spacing))
    return found


def around_corners(problem: Problem, path: FloatArray, reach: float) -> FloatArray:
    """
    Find the best polyline through points of a path and the corners within `reach` of it, or else all corners.

    The polyline need not be the best path of the map.

    Parameters
    ----------
    problem
        The problem.
    path
        Waypoints from its start to its goal, shape ``(m, 2)``, map units; it may cross the area.
    reach
        Distance from the path, map units.

    Returns
    -------
    path
        Shape ``(k, 2)``, map units; empty if there is no such polyline.

    Examples
    --------
    >>> problem = Problem((0, 0), (1, 0), bounds=(0, -1, 1, 1), no_fly=shapely.box(0.4, -0.3, 0.6, 0.3))
    >>> around_corners(problem, np.array([problem.start, problem.goal]), 0.4).tolist()
    [[0.0, 0.0], [0.4, -0.3], [0.6, -0.3], [1.0, 0.0]]
    """
    area = problem.model.area
    step = max(1, len(path) // MOST_WAYPOINTS)
    some = path[1:-1][::step]
    every = corners(area, problem.bounds)
    beside_path = _outstanding(every, path, reach, area.geometry)
    # a wall too thin for the mesh is far from its corners
    for beside in (beside_path, every[:MOST_WAYPOINTS]):
        points = np.vstack([path[:1], some[~area.contains(some)], beside, path[-1:]])
        goal = len(points) - 1
        costs, successors, order = np.full(len(points), np.inf), *np.full((2, len(points)), -1)
        costs[goal] = 0.0
        graph_kernels.label_setting(problem.model.matrix(points), goal, 0, costs, successors, order)
        if np.isfinite(costs[0]):
            nodes = [0]
            while nodes[-1] != goal:
                nodes.append(int(successors[nodes[-1]]))
            return points[nodes]
    return np.empty((0, 2))


def _outstanding(every: FloatArray, path: FloatArray, reach: float, geometry: BaseGeometry) -> FloatArray:
    """
    Choose corners near a path: of many, those that stand out, as the weights of all pairs of 10^4 take minutes.

    Of the corners of a ring in a square, those of their convex hull are kept: a path that passes all of them on one
    side does not bend at the others. Paths through gaps of a ring that are narrower than a square may be lost.
    """
    if not len(every):
        return every
    from scipy.spatial import cKDTree  # noqa: PLC0415 - slow to import, and needed beside walls alone

    tree = cKDTree(path)
    near = every[np.isfinite(tree.query(every, distance_upper_bound=reach)[0])]
    if len(near) <= MOST_CORNERS:
        return near
    rings = shapely.get_rings(shapely.get_parts(geometry))
    points, ring = shapely.get_coordinates(rings, return_index=True)
    # (a complex number is a point)
    chosen = np.isin(points @ (1.0, 1.0j), near @ (1.0, 1.0j))
    points, ring = points[chosen], ring[chosen]
    for side in reach * np.array(SQUARES):
        squares = np.column_stack([ring, np.floor((points - points.min(axis=0)) / side)])
        _, group = np.unique(squares, axis=0, return_inverse=True)
        order = np.argsort(group, kind="stable")
        parts = np.split(points[order], np.flatnonzero(np.diff(group[order])) + 1)
        hulls = [MultiPoint(part).convex_hull for part in parts]
        kept = np.unique(shapely.get_coordinates(hulls), axis=0)
        if len(kept) <= MOST_CORNERS:
            return kept
    # many small areas: take the nearest corners
    return np.asarray(kept[np.argsort(tree.query(kept)[0], kind="stable")[:MOST_CORNERS]])

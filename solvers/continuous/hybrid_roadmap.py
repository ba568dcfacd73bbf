"""The graph that `hybrid` searches: a lattice with many directions, and the corners of the no-fly area."""

import math
from dataclasses import dataclass

import numpy as np
import shapely

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.solvers.continuous.roadmap_kernels import grow_tree

#: Up to so many corners, start and goal included, every pair is joined; beyond, each with its nearest.
ALL_PAIRS_UP_TO = 150
#: Up to so many corners, the triangulation is a constrained one.
CONSTRAINED_UP_TO = 20_000
#: So many corners is each joined with, where there are more.
NEAREST = 12


@dataclass(frozen=True, eq=False)
class Roadmap:
    """
    A sparse graph over the bounds.

    Attributes
    ----------
    positions
        The nodes, shape ``(n, 2)``, map units: start, goal, corners of the no-fly area, lattice points.
    starts, heads, costs
        The free edges, each both ways: those that leave node ``i`` are from ``starts[i]`` up to ``starts[i + 1]``, lead
        to `heads` and cost `costs` by Eq. 5, map units.
    spacing
        Distance between lattice points, the greater one of both sides, map units.
    evaluations
        Segments weighed.
    """

    positions: FloatArray
    starts: IntArray
    heads: IntArray
    costs: FloatArray
    spacing: float
    evaluations: int

    def tree(self, root: int) -> tuple[FloatArray, IntArray]:
        """Return the least cost from a root to each node, map units, and the node before it, or -1; both ``(n,)``."""
        values, before = np.full(len(self.positions), np.inf), np.full(len(self.positions), -1)
        grow_tree(self.starts, self.heads, self.costs, root, values, before)
        return values, before


def lay(problem: Problem, points: int, radius: int) -> Roadmap:
    """
    Lay a lattice of about `points` nodes over the bounds, and join nodes nearby where the segment is free.

    A lattice point is joined with those that are up to `radius` steps off along each side, in every direction once:
    with 3 there are 32 directions, and no straight line is more than 1.3 % shorter than the best way over lattice
    points; with 4 there are 48 (0.7 %). Start, goal and corners are joined with the lattice points around them and with
    each other. A constrained Delaunay triangulation of the free space (Chew, Algorithmica 4, 1989) joins the corners
    through passages of any width.

    Parameters
    ----------
    problem
        The problem.
    points
        How many lattice points, about.
    radius
        Longest step, in lattice spacings along each side.

    Returns
    -------
    roadmap
        Node 0 is the start, node 1 the goal.
    """
    lattice = Lattice(_even_sides(problem, points), bounds=problem.bounds)
    corners, triangulated = _triangulation(problem)
    special = np.vstack([problem.start, problem.goal, corners])
    n_special = len(special)
    positions = np.ascontiguousarray(np.vstack([special, lattice.points]))
    pairs = [
        n_special + _stencil(lattice, radius),
        _around(special, lattice, radius if n_special <= ALL_PAIRS_UP_TO else 1),
        _among(special),
        triangulated,
    ]
    edges = np.sort(np.concatenate(pairs), axis=1)
    edges = edges[np.unique(edges[:, 0] * len(positions) + edges[:, 1], return_index=True)[1]]
    tails, heads = edges[edges[:, 0] != edges[:, 1]].T
    costs = problem.model.weights(positions[tails], positions[heads])
    free = np.isfinite(costs)
    tails, heads, costs = tails[free], heads[free], costs[free]
    tails, heads, costs = np.concatenate([tails, heads]), np.concatenate([heads, tails]), np.concatenate([costs, costs])
    order = np.argsort(tails, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(tails, minlength=len(positions)))])
    return Roadmap(positions, starts, heads[order], costs[order], max(lattice.spacing), len(free))


def _even_sides(problem: Problem, points: int) -> tuple[int, int]:
    """Return the sides of a lattice of about so many points, about as far apart along both sides."""
    x_min, y_min, x_max, y_max = problem.bounds
    columns = math.sqrt(points * (x_max - x_min) / (y_max - y_min))
    # a long and thin map still gets some points across
    columns = min(max(columns, 5.0), points / 5.0)
    return max(2, round(columns)), max(2, round(points / columns))


def _stencil(lattice: Lattice, radius: int) -> IntArray:
    """Join lattice points in every direction that is up to `radius` steps long; pairs of indices, shape ``(e, 2)``."""
    nx, ny = lattice.shape
    index = np.arange(nx * ny).reshape(ny, nx)
    pairs = []
    for dy in range(radius + 1):
        for dx in range(-radius, radius + 1):
            if math.gcd(dx, dy) == 1 and (dy > 0 or dx > 0) and abs(dx) < nx and dy < ny:
                left, right = max(0, -dx), nx - max(0, dx)
                tails = index[: ny - dy, left:right]
                heads = index[dy:, left + dx : right + dx]
                pairs.append(np.column_stack([tails.ravel(), heads.ravel()]))
    return np.concatenate(pairs)


def _around(special: FloatArray, lattice: Lattice, steps: int) -> IntArray:
    """Join each special point with the lattice points up to so many steps around it."""
    nx, ny = lattice.shape
    cell = np.floor((special - lattice.bounds[:2]) / lattice.spacing).astype(np.int64)
    window = np.arange(1 - steps, steps + 1)
    columns = cell[:, 0, None, None] + window[None, None, :]
    rows = cell[:, 1, None, None] + window[None, :, None]
    inside = (columns >= 0) & (columns < nx) & (rows >= 0) & (rows < ny)
    number = np.broadcast_to(np.arange(len(special))[:, None, None], inside.shape)
    index = len(special) + columns + rows * nx
    return np.column_stack([number[inside], index[inside]])


def _among(special: FloatArray) -> IntArray:
    """Join the special points with each other: all, or each with its nearest; start and goal in any case."""
    n = len(special)
    if n <= ALL_PAIRS_UP_TO:
        return np.column_stack(np.triu_indices(n, 1))
    from scipy.spatial import KDTree  # noqa: PLC0415 - slow to import, and rarely needed

    near = np.asarray(KDTree(special).query(special, k=NEAREST + 1)[1])[:, 1:]
    return np.vstack([[0, 1], np.column_stack([np.repeat(np.arange(n), NEAREST), near.ravel()])])


def _triangulation(problem: Problem) -> tuple[FloatArray, IntArray]:
    """
    Triangulate the free space.

    Returns its corners, shape ``(c, 2)``, map units, and the edges of the triangles, which also join start (0) and goal
    (1) with the corners of theirs; corner ``i`` is node ``2 + i``, shape ``(e, 2)``.
    """
    if problem.model.area.is_empty:
        return np.empty((0, 2)), np.empty((0, 2), dtype=np.int64)
    area = problem.model.area.geometry
    if shapely.get_num_coordinates(area) > CONSTRAINED_UP_TO:
        return _unconstrained(problem)
    free = shapely.box(*problem.bounds).difference(area)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(free))
    rings = shapely.get_coordinates(triangles).reshape(-1, 4, 2)[:, :3]
    corners, number = np.unique(rings.reshape(-1, 2), axis=0, return_inverse=True)
    number = 2 + number.reshape(-1, 3)
    edges = [number[:, :2], number[:, 1:], number[:, ::2]]
    ends = shapely.points([problem.start, problem.goal])
    reach = 1e-9 * math.dist(problem.bounds[:2], problem.bounds[2:])
    end, triangle = shapely.STRtree(triangles).query(ends, predicate="dwithin", distance=reach)
    edges.append(np.column_stack([np.repeat(end, 3), number[triangle].ravel()]))
    return corners, np.concatenate(edges)


def _unconstrained(problem: Problem) -> tuple[FloatArray, IntArray]:
    """
    Triangulate the corners of very many polygons without regard to their edges, which takes far less time.

    The polygons' own edges are added; edges through polygons fall out when they are weighed. Returns what
    `_triangulation` returns, without its promise of a way through every passage.
    """
    ends = problem.model.area.edges[:, :4].reshape(-1, 2)
    corners, number = np.unique(ends, axis=0, return_inverse=True)
    sides = 2 + number.reshape(-1, 2)
    inside = (corners >= problem.bounds[:2]).all(axis=1) & (corners <= problem.bounds[2:]).all(axis=1)
    new = np.concatenate([[0, 1], np.where(inside, 1 + np.cumsum(inside), -1)])
    sides = new[sides]
    corners = corners[inside]
    from scipy.spatial import Delaunay  # noqa: PLC0415 - slow to import, and rarely needed

    triangles = Delaunay(np.vstack([problem.start, problem.goal, corners])).simplices.astype(np.int64)
    return corners, np.concatenate([sides[(sides >= 0).all(axis=1)], *(triangles[:, [i, i - 1]] for i in range(3))])

"""A path along a Voronoi diagram, as far from the threats as possible, which an elastic chain then relaxes."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.spatial import Voronoi

from cgla_graph._types import BoolArray, Bounds, FloatArray, IntArray
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Positive, Settings, Whole
from cgla_graph.solvers.geometric.elastic import relaxed
from cgla_graph.solvers.geometry import around_circle
from cgla_graph.solvers.shortest_paths import least_cost_tree, path_to

#: Points closer than this, relative to the map's diagonal, are one point.
SAME = 1e-9
#: Sites farther from the middle of the map than this many diagonals do not shape its diagram.
NEARBY = 2.0
#: Helpers are so many diagonals away: farther from everywhere on the map than any site, so that all edges on the map
#: are those of the sites alone, and none of them is infinite.
HELPERS, HELPERS_AT = 8, 8.0
#: Times that the boundaries of no-fly areas are sampled twice as densely before the answer is that there is no way.
FINER = 3


@dataclass(frozen=True)
class VoronoiRoadmap(Settings):
    """
    The cheapest way along a Voronoi diagram of the threats, drawn straight by an elastic chain of virtual masses.

    **Public.** Bortoff (ACC 2000) plans in two steps: a graph search over the Voronoi diagram of the radars, whose
    edges are equally far from the two nearest of them; then a chain of virtual masses, joined by springs and pushed
    by forces from the radars, is integrated until it rests. **Our design.** The sites are the centres of the threats
    and points along the boundaries of no-fly areas; edges end at the border of the map, which is an edge itself, so
    that one threat can be passed as well. Edges weigh what they cost (Eq. 5) and are gone where they cross an area.
    Start and goal are joined to their nearest vertices in sight. The chain feels the refractive index of the cost
    instead of a radar's fourth power (`elastic`), so that its rest is a locally best path. Without
    any site the path is straight. No code was available: this is in the style of the original, not the original.

    **Known failures.** Equally far is not cheapest: edges know neither spread nor peak, so that the search may choose
    the wrong side of a threat, which the chain cannot mend; it finds the best path near the one that it is given.
    Around no-fly areas the chain sticks where a mass touches them. Channels narrower than the finest sampling of
    their walls are missed.

    `Solution.evaluations` counts the segments weighed, and the points of ``F`` that the chain asked for.

    Attributes
    ----------
    joined
        Vertices that start and goal are joined to, 1 to 1000.
    masses
        Masses of the chain between start and goal, at least, up to 10000; 0: no chain, the path keeps to the diagram.
    spacing
        Between points along the boundaries of no-fly areas, relative to the shorter side of the map, above 0; halved
        up to three times where there is no way.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    Between two threats the way leads along their bisector.

    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> field = RiskField([Threat(0.5, 0.3, spread=0.1), Threat(0.5, 0.7, spread=0.1)])
    >>> path = VoronoiRoadmap(masses=0).solve(Problem((0.0, 0.2), (1.0, 0.6), field, k=1.0)).path
    >>> path.tolist()
    [[0.0, 0.2], [0.0, 0.5], [1.0, 0.5], [1.0, 0.6]]
    """

    joined: Annotated[int, Whole(1, 1000)] = 3
    masses: Annotated[int, Whole(0, 10_000)] = 50
    spacing: Positive = 0.02

    traits: ClassVar[Traits] = Traits(
        "voronoi",
        "along the Voronoi diagram, then an elastic chain (Bortoff)",
        domain="plane",
        complete=False,
        needs_positive=True,
        rasters=False,
    )

    def solve(self, problem: Problem) -> Solution:
        """Search the diagram, then relax the path."""
        spacing, weighed = self.spacing * problem.shorter_side, 0
        for _ in range(1 + FINER):
            sites = _sites(problem, spacing)
            if not len(sites):
                path = np.array([problem.start, problem.goal])
                break
            path, segments = self._search(problem, sites)
            weighed += segments
            if len(path) or problem.model.area.is_empty:
                break
            spacing /= 2.0
        if not len(path):
            message = f"no way along the diagram, the no-fly areas sampled every {2.0 * spacing:.4g}"
            return Solution(Status.NOT_FOUND, evaluations=weighed, message=message)
        if self.masses:
            rest = relaxed(problem, path, masses=self.masses)
            path, weighed = rest.path, weighed + rest.evaluations
        return Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost, evaluations=weighed)

    def _search(self, problem: Problem, sites: FloatArray) -> tuple[FloatArray, int]:
        """Return the cheapest way along the diagram, empty if there is none, and how many segments were weighed."""
        vertices, edges = voronoi_edges(sites, problem.bounds)
        points = np.vstack([problem.start, problem.goal, vertices])
        edges = edges + 2
        weights = problem.model.weights(points[edges[:, 0]], points[edges[:, 1]])
        for end in (0, 1):
            near = np.column_stack([np.full(len(vertices), end), np.arange(2, len(points))])
            costs = problem.model.weights(points[near[:, 0]], points[near[:, 1]])
            distance = np.where(np.isfinite(costs), np.hypot(*(vertices - points[end]).T), math.inf)
            nearest = np.argsort(distance, kind="stable")[: self.joined]
            edges = np.vstack([edges, near[nearest]])
            weights = np.concatenate([weights, costs[nearest]])
        weighed = len(weights) + 2 * (len(vertices) - self.joined)
        return points[_cheapest(edges, weights, len(points))], weighed


def voronoi_edges(sites: FloatArray, bounds: Bounds) -> tuple[FloatArray, IntArray]:
    """
    Draw the Voronoi diagram of some sites on a map, and the border of the map.

    Parameters
    ----------
    sites
        Shape ``(n, 2)`` with ``n >= 1``, map units; they may lie outside the bounds, or twice in one place.
    bounds
        Of the map.

    Returns
    -------
    vertices, edges
        Shape ``(v, 2)``, map units, all inside the bounds, and the pairs of vertices that are joined, ``(e, 2)``. The
        border is cut into edges where the diagram meets it.

    Examples
    --------
    One site has all of the map for itself.

    >>> vertices, edges = voronoi_edges(np.array([[0.3, 0.4]]), (0.0, 0.0, 2.0, 1.0))
    >>> vertices.tolist()
    [[0.0, 0.0], [0.0, 1.0], [2.0, 0.0], [2.0, 1.0]]
    >>> len(edges)
    4
    """
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    scale = float(np.hypot(*(high - low)))
    middle, half = (low + high) / 2.0, (high - low) / (2.0 * scale)
    scaled = (sites - middle) / scale
    _, first = np.unique(np.round(scaled / SAME), axis=0, return_index=True)
    helpers = HELPERS_AT * around_circle(HELPERS, first=0.5)
    diagram = Voronoi(np.vstack([scaled[np.sort(first)], helpers]))
    ridges = np.array(diagram.ridge_vertices)
    ridges = ridges[(ridges >= 0).all(axis=1)]
    starts, ends = _clipped(diagram.vertices[ridges[:, 0]], diagram.vertices[ridges[:, 1]], half)
    corners = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    inner = np.vstack([starts, ends, corners])
    border = inner[_around(inner, half)]
    points = np.vstack([starts, border, ends, np.roll(border, -1, axis=0)])
    on_map = np.where(np.abs(points) >= half - SAME, np.where(points > 0.0, high, low), middle + scale * points)
    vertices, number = np.unique(np.clip(on_map, low, high), axis=0, return_inverse=True)
    pairs = np.sort(number.reshape(2, -1).T, axis=1)
    return vertices, np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def _clipped(starts: FloatArray, ends: FloatArray, half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut segments off at a box around the origin (Liang and Barsky 1984), without those outside."""
    along = ends - starts
    with np.errstate(divide="ignore", invalid="ignore"):
        # where a segment meets the two sides of each axis; one that runs along an axis meets none
        first, second = (-half - starts) / along, (half - starts) / along
    still = along == 0.0
    beyond = still & (np.abs(starts) > half)
    enter = np.where(still, -math.inf, np.minimum(first, second)).max(axis=1)
    leave = np.where(still, math.inf, np.maximum(first, second)).min(axis=1)
    enter, leave = np.maximum(enter, 0.0), np.minimum(leave, 1.0)
    kept = (enter < leave) & ~beyond.any(axis=1)
    # an end inside stays what it is, to the last bit, so that edges keep their common vertices
    cut_starts = np.where(enter[:, None] > 0.0, starts + enter[:, None] * along, starts)
    cut_ends = np.where(leave[:, None] < 1.0, starts + leave[:, None] * along, ends)
    return cut_starts[kept], cut_ends[kept]


def _around(points: FloatArray, half: FloatArray) -> IntArray:
    """Return which points are on the border of a box around the origin, in their order along it."""
    (x, y), (width, height) = points.T, half
    # distances from the sides below, right, above and left, and the place along each
    gaps = np.abs(np.column_stack([y + height, width - x, height - y, x + width]))
    along = np.column_stack([x + width, y + height, width - x, height - y])
    before = np.cumsum([0.0, 2.0 * width, 2.0 * height, 2.0 * width])
    side = gaps.argmin(axis=1)
    rows = np.arange(len(points))
    place = np.where(gaps[rows, side] <= SAME, before[side] + along[rows, side], math.inf)
    order = np.argsort(place, kind="stable")
    return order[np.isfinite(place[order])]


def _sites(problem: Problem, spacing: float) -> FloatArray:
    """Collect the centres of threats near the map, and points along the boundaries of no-fly areas on it."""
    low, high = np.array(problem.bounds[:2]), np.array(problem.bounds[2:])
    centres = np.array([(threat.x, threat.y) for threat in problem.field.threats]).reshape(-1, 2)
    reach = NEARBY * np.hypot(*(high - low))
    centres = centres[np.hypot(*(centres - (low + high) / 2.0).T) <= reach]
    boundary = shapely.intersection(shapely.boundary(problem.model.area.geometry), shapely.box(*problem.bounds))
    walls = shapely.get_coordinates(shapely.segmentize(boundary, spacing))
    return np.vstack([centres, walls])


def _cheapest(edges: IntArray, weights: FloatArray, n_nodes: int) -> IntArray:
    """Return the nodes of the cheapest way from node 0 to node 1; none if there is none."""
    open_: BoolArray = np.isfinite(weights)
    # a sparse matrix adds up duplicates, but each edge comes once; it takes a weight of 0 for no edge
    weights = np.maximum(weights[open_], np.finfo(np.float64).tiny)
    graph = csr_array((weights, (edges[open_, 0], edges[open_, 1])), shape=(n_nodes, n_nodes))
    costs, before = least_cost_tree(graph, 0, directed=False)
    return np.array(path_to(1, before) if np.isfinite(costs[1]) else [], dtype=np.int64)

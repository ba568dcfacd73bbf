"""The MILP planner's model of a map: convex obstacles, and the graph of their corners."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from scipy import sparse

from cgla_graph._types import Bounds, FloatArray, IntArray, Point
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.risk import Threat
from cgla_graph.solvers.geometry import around_circle
from cgla_graph.solvers.reactive.milp_model import MARGIN, KeepOut
from cgla_graph.solvers.shortest_paths import least_cost_tree, path_to

#: Sides of the polygon that stands for a threat.
SIDES = 8
#: A threat ends where it adds this much to the cost of a unit of length.
NEGLIGIBLE = 0.1
#: Spreads from the centre at which the line from a Gaussian's peak touches it: ``1 + d^2 = exp(d^2 / 2)``.
TANGENT = 1.5852010653


@dataclass(frozen=True, eq=False)
class Obstacle:
    """
    A convex obstacle on the map.

    Attributes
    ----------
    corners
        Counterclockwise, shape ``(m, 2)``, map units.
    layers
        Of a threat, shape ``(l, 2)``: as in `KeepOut`, in map units and cost per map unit; empty: a no-fly area.
    """

    corners: FloatArray
    layers: FloatArray

    def counts(self, low: FloatArray, high: FloatArray) -> bool:
        """
        Tell whether the program has to know it: it is hard, or a threat on the map that is no speck.

        Into a threat as narrow as the program's tolerance it may go for nothing.

        Parameters
        ----------
        low, high
            Corners of the bounds, shape ``(2,)``, map units.
        """
        if not len(self.layers):
            return True
        least, most = self.corners.min(axis=0), self.corners.max(axis=0)
        is_on_map = (most > low).all() and (least < high).all()
        return bool(is_on_map and (most - least).min() > 2.0 * MARGIN * (high - low).min())

    def keep_out(self, origin: FloatArray, unit: float) -> KeepOut:
        """Return the half-planes beyond its sides, relative to a point, shape ``(2,)``, and in a unit of length."""
        corners = (self.corners - origin) / unit
        along = np.roll(corners, -1, axis=0) - corners
        normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
        layers = self.layers * (1.0 / unit, unit)
        return KeepOut(normals, (normals * corners).sum(axis=1), layers)


def threat_obstacle(threat: Threat, k: float) -> Obstacle | None:
    """
    Return the octagon around a threat, or None if the threat is negligible.

    Its layers are chords of ``k F`` over the distance from the centre: one from the centre to where it touches the
    Gaussian, two from there to the rim. So they rise inwards, as a linear program needs it.

    Examples
    --------
    >>> octagon = threat_obstacle(Threat(0.5, 0.5, 0.1), k=10.0)
    >>> len(octagon.corners), octagon.layers.round(3).tolist()
    (8, [[0.072, 8.193], [0.072, 29.702], [0.159, 45.126]])
    >>> threat_obstacle(Threat(0.5, 0.5, 0.1), k=0.1) is None
    True
    """
    highest = k * threat.peak
    if highest <= NEGLIGIBLE:
        return None
    radius = math.sqrt(2.0 * math.log(highest / NEGLIGIBLE))
    breaks = [radius, 0.5 * (radius + TANGENT), TANGENT, 0.0] if radius > TANGENT else [radius, 0.0]
    at = np.array(breaks)
    thick = -np.diff(at) * threat.spread
    prices = np.diff(highest * np.exp(-0.5 * at**2)) / thick
    out = radius * threat.spread / math.cos(math.pi / SIDES)
    corners = (threat.x, threat.y) + out * around_circle(SIDES, first=0.5)
    return Obstacle(corners, np.column_stack([thick, prices]))


@lru_cache(maxsize=4)
def obstacles_of(model: CostModel) -> tuple[Obstacle, ...]:
    """
    Return the threats of a map that count, and its no-fly areas in convex parts: themselves, or triangles.

    Examples
    --------
    >>> corner = shapely.Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    >>> len(obstacles_of(CostModel(no_fly=corner)))
    4
    """
    threats = [threat_obstacle(threat, model.k) for threat in model.field.threats]
    parts: list[shapely.Polygon] = []
    for polygon in shapely.get_parts(model.area.geometry):
        is_convex = not polygon.interiors and polygon.convex_hull.area <= polygon.area * (1.0 + MARGIN**2)
        pieces = [polygon] if is_convex else shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
        parts.extend(pieces)
    hard = [Obstacle(shapely.get_coordinates(shapely.orient_polygons(part))[:-1], np.empty((0, 2))) for part in parts]
    return *(threat for threat in threats if threat is not None), *hard


@dataclass(frozen=True, eq=False)
class CornerGraph:
    """
    Costs to go to the goal from the corners of obstacles, along a graph that joins them all.

    Attributes
    ----------
    places
        The goal, and the corners, shape ``(n, 2)``, map units.
    costs_to_go
        Least cost from there to the goal, shape ``(n,)``, map units; infinite where there is no way.
    next_places
        The place after each on the best path to the goal, shape ``(n,)``; below 0 where there is none.
    """

    places: FloatArray
    costs_to_go: FloatArray
    next_places: IntArray

    def onward(self, model: CostModel, points: FloatArray) -> FloatArray:
        """
        Return the costs to go to the goal by way of each place.

        Parameters
        ----------
        model
            What a segment costs.
        points
            From where, shape ``(m, 2)``, map units.

        Returns
        -------
        costs
            Shape ``(m, n)``, map units; infinite where there is no way.
        """
        n = len(self.places)
        starts, ends = np.repeat(points, n, axis=0), np.tile(self.places, (len(points), 1))
        return segment_weights(model, starts, ends).reshape(-1, n) + self.costs_to_go

    def route(self, place: int) -> FloatArray:
        """Return the way from a place to the goal, shape ``(m, 2)``, map units, both included."""
        return self.places[path_to(place, self.next_places)[::-1]]


@lru_cache(maxsize=4)
def corner_graph(model: CostModel, bounds: Bounds, goal: Point) -> CornerGraph:
    """
    Join the goal and the corners of all threats and no-fly areas, weighed by Eq. 5, and search from the goal.

    Corners of no-fly areas are a hair outside of them, so that paths along the graph do not touch them.

    Parameters
    ----------
    model
        What a segment costs.
    bounds
        Corners outside of them are left out.
    goal
        Inside the bounds.

    Examples
    --------
    >>> graph = corner_graph(CostModel(no_fly=shapely.box(1, 0, 2, 5)), (0, 0, 9, 9), (3.0, 2.0))
    >>> len(graph.places), graph.costs_to_go.round(2).tolist()
    (3, [0.0, 4.16, 3.16])
    """
    low, high = np.reshape(bounds, (2, 2))
    margin = MARGIN * float((high - low).min())
    soft = [obstacle.corners for obstacle in obstacles_of(model) if len(obstacle.layers)]
    corners = np.vstack([*soft, _outer_corners(model, margin), np.empty((0, 2))])
    corners = corners[(corners >= low).all(axis=1) & (corners <= high).all(axis=1)]
    corners = np.unique(corners[~model.area.contains(corners) & (corners != goal).any(axis=1)], axis=0)
    places = np.vstack([goal, corners])
    tails, heads = np.triu_indices(len(places), k=1)
    weights = segment_weights(model, places[tails], places[heads])
    free = np.isfinite(weights)
    matrix = sparse.csr_array((weights[free], (tails[free], heads[free])), shape=(len(places), len(places)))
    return CornerGraph(places, *least_cost_tree(matrix, 0, directed=False))


def segment_weights(model: CostModel, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """
    Weigh segments by Eq. 5, none of them below its length, so that peaks above 1 break nothing.

    Parameters
    ----------
    model
        What a segment costs.
    starts, ends
        Shape ``(n, 2)`` each, map units.

    Returns
    -------
    weights
        Shape ``(n,)``, map units; infinite where a segment crosses a no-fly area.
    """
    return np.maximum(model.weights(starts, ends), np.hypot(*(ends - starts).T))


def _outer_corners(model: CostModel, margin: float) -> FloatArray:
    """Return the corners that a path can go around, this far outside of the no-fly areas, shape ``(c, 2)``."""
    if model.area.is_empty:
        return np.empty((0, 2))
    wider = shapely.buffer(model.area.geometry, margin, join_style="mitre")
    return NoFlyArea(wider).convex_corners()

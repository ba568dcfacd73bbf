"""
The cost of a unit of length on the cells of a mesh: proven bounds, and the cost that the equation is solved for.

On a map of the Earth, a unit of the plane counts with its length on the Earth (`scale_at`).
"""

import math
from typing import TypeVar

import numpy as np
import shapely

from cgla_graph._threads import in_parts
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.certificate import certificate_kernels
from cgla_graph.certificate.certificate_kernels import COST, DROP, LEAST, SLOPE_X, SLOPE_Y
from cgla_graph.eikonal.mesh import SplineMesh
from cgla_graph.model.earth import GEODESIC_ERROR, POLAR_RADIUS, LocalProjection
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk_raster import raster_array

#: Least scale that the equation is solved with; only places beyond the map, where nothing is proven, are below it.
LEAST_TO_SOLVE_FOR = 1e-3
#: On a map so large that its least scale is below this, only the geodesic is a bound.
LEAST_SCALE = 0.05
#: There is no bound where rounding would lower it by more than this factor.
LEAST_SHRINK = 0.99
BoundT = TypeVar("BoundT", float, FloatArray)


def cost_bounds(problem: Problem, mesh: SplineMesh) -> FloatArray:
    """Bound the cost on each piece from below, or on each quarter of it, as `certificate_kernels` takes it."""
    parts = certificate_kernels.QUARTERS if problem.field.rasters else 1
    bounds = np.empty((len(mesh.columns), parts, 5))
    rasters = problem.field.raster_array

    def fill(part: slice) -> None:
        cells = mesh.columns[part], mesh.rows[part], mesh.origin, mesh.spacing
        certificate_kernels.cost_bounds(*cells, problem.k, problem.field.mixed_table, bounds[part])
        if rasters is not None:
            certificate_kernels.add_rasters(*cells, problem.bounds, problem.k, rasters, bounds[part])
        if problem.projection is not None:
            middles = np.column_stack([mesh.columns[part], mesh.rows[part]]) * np.array(mesh.spacing) + mesh.origin
            lower_by_scale(problem.projection, middles, 0.5 * math.hypot(*mesh.spacing), bounds[part])

    in_parts(fill, len(bounds))
    return bounds


def costs_to_solve_for(problem: Problem, mesh: SplineMesh, bounds: FloatArray) -> FloatArray:
    """
    Return the cost of a unit of length at each node, shape ``(n,)``; where it jumps, the least nearby.

    Without rasters, `bounds` know it in the middle of each piece (`cost_bounds`).

    A spline through a solution takes a cell or two to get steeper where the cost jumps up. These have to be cells of
    the higher cost: a node takes the least value of nearest rasters on all cells whose spline it is part of. The loss
    is a strip of one and a half cells along the jump.

    Fronts pass through nodes inside areas, beside the outline. These nodes get the cost of the outline: where paths are
    pressed against a wall, the cost may be lower inside, and fronts along the wall would come too early.
    """
    field, costs, asked = problem.field, np.empty(mesh.n_nodes), np.ones(mesh.n_nodes, dtype=np.bool_)
    if not field.rasters:
        known = bounds[:, 0, COST]
        costs[mesh.controls[:, 4]] = known if problem.projection is None else np.maximum(known, LEAST_TO_SOLVE_FOR)
        asked[mesh.controls[:, 4]] = False
    inside = _inside(problem, mesh)
    asked[inside] = True
    (nodes,) = np.nonzero(asked)
    points = mesh.node_points[nodes]
    if len(inside):
        outline = problem.model.area.geometry.boundary
        shapely.prepare(outline)
        within = np.searchsorted(nodes, inside)
        nearest = shapely.shortest_line(outline, shapely.points(points[within]))
        points[within] = np.clip(shapely.get_coordinates(nearest)[::2], *np.reshape(problem.bounds, (2, 2)))
    jumping = [raster for raster in field.rasters if raster.interpolation == "nearest"]
    bilinear = [raster for raster in field.rasters if raster.interpolation == "bilinear"]
    smooth = field.with_rasters(bilinear).for_weight(problem.k)
    ranges = np.zeros((len(nodes), 2))
    if jumping:
        reach = 1.5 * mesh.spacing[0], 1.5 * mesh.spacing[1]
        certificate_kernels.range_around(points, reach, problem.bounds, raster_array(jumping), ranges)
    least = ranges[:, 0]

    def fill(part: slice) -> None:
        risk = smooth.density(points[part]) + least[part]
        costs[nodes[part]] = (1.0 + problem.k * risk) * scale_at(problem, points[part])

    in_parts(fill, len(nodes))
    return costs


def greatest_costs(problem: Problem, middles: FloatArray, reach: tuple[float, float]) -> FloatArray:
    """
    Bound the cost of a unit of length from above on rectangles, as far as they are inside the bounds.

    The risk of a threat is greatest where it is nearest, and that of several grows with each of them. Of an
    `UncertainField`, the risk of all threats at once bounds that of each scenario.

    Parameters
    ----------
    problem
        The problem, whose field is proper.
    middles
        Of the rectangles, inside the bounds, shape ``(n, 2)``, map units.
    reach
        Half of their sides, map units.

    Returns
    -------
    costs
        Shape ``(n,)``; on a map of the Earth, those of a unit of the plane.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0), (1, 1), RiskField([Threat(0.5, 0.5, spread=0.1)]), k=10.0)
    >>> greatest_costs(problem, np.array([(0.5, 0.4), (0.0, 0.0)]), (0.1, 0.1)).round(3).tolist()
    [11.0, 1.0]
    """
    none, ranges = np.ones(len(middles)), np.zeros((len(middles), 2))
    for threat in problem.field.every_threat:
        away = np.maximum(np.abs(middles - (threat.x, threat.y)) - reach, 0.0)
        none *= 1.0 - threat.peak * np.exp(-0.5 * ((away / threat.spread) ** 2).sum(axis=1))
    if problem.field.raster_array is not None:
        certificate_kernels.range_around(middles, reach, problem.bounds, problem.field.raster_array, ranges)
    most = 1.0 + problem.k * (1.0 - np.maximum(none, 0.0) + ranges[:, 1])
    return np.asarray(most * (1.0 + 2.0 * rounding(problem)))


def scale_at(problem: Problem, points: FloatArray) -> FloatArray | float:
    """
    Return the scale at points, shape ``(n, 2)``, to solve equations for: shape ``(n,)``, or 1 on a map in the plane.

    Examples
    --------
    >>> around = Problem((0, 0), (1e6, 0), bounds=(0, 0, 1e6, 1e6), projection=LocalProjection(25.0, 60.0))
    >>> scale_at(around, np.array([[0.0, 0.0], [1e6, 0.0]])).round(4).tolist()
    [1.0, 0.9959]
    """
    if problem.projection is None:
        return 1.0
    return np.maximum(problem.projection.scale(np.hypot(*points.T)), LEAST_TO_SOLVE_FOR)


def least_scale(problem: Problem, reach: float | None = None) -> float:
    """Return the least scale within `reach` of the origin, map units, or on the whole map; 1 in the plane."""
    if problem.projection is None:
        return 1.0
    if reach is None:
        x_min, y_min, x_max, y_max = problem.bounds
        reach = math.hypot(max(-x_min, x_max), max(-y_min, y_max))
    return float(problem.projection.scale(np.array(reach)))


def rounding(problem: Problem) -> float:
    """
    Bound the relative rounding errors of a bound.

    Each inequality is checked with some ten operations, and ``k F`` is off by a few ulps of ``k`` times the greatest
    ``F`` for each threat, while ``c >= 1``. The risk of rasters is off by a few ulps of itself, and so of the cost. A
    scale is off by a few ulps of 1, where ``c`` is at least the scale.
    """
    of_rasters = 16.0 * len(problem.field.rasters)
    in_plane = float(2.0**-50 * (16.0 + of_rasters + problem.k * problem.field.rounding))
    return in_plane if problem.projection is None else (in_plane + 2.0**-46) / max(least_scale(problem), LEAST_SCALE)


def is_provable(problem: Problem) -> bool:
    """
    Return whether a grid may prove more than a straight line: neither rounding nor the scale of the map is in the way.

    Examples
    --------
    >>> is_provable(Problem((0, 0), (1, 1), k=10.0))
    True
    """
    return 1.0 - rounding(problem) >= LEAST_SHRINK and least_scale(problem) >= LEAST_SCALE


def geodesic_error(problem: Problem) -> float:
    """
    Return by how much a length on the Earth may be off, map units; 0 in the plane.

    Examples
    --------
    >>> geodesic_error(Problem((0, 0), (1, 1)))
    0.0
    """
    return 0.0 if problem.projection is None else GEODESIC_ERROR


def proven(problem: Problem, bound: BoundT, surfaces: int = 1) -> BoundT:
    """
    Return what remains of a bound when rounding and errors of lengths on the Earth are taken off.

    Parameters
    ----------
    problem
        The problem.
    bound
        Of the cost, as computed from surfaces, map units.
    surfaces
        How many surfaces it is a sum of.

    Examples
    --------
    >>> 1.0 - 1e-12 < proven(Problem((0, 0), (1, 1)), 1.0) < 1.0
    True
    """
    return bound * (1.0 - rounding(problem)) - surfaces * geodesic_error(problem)


def needed_for(problem: Problem, cost: float, surfaces: int = 1) -> float:
    """
    Return the bound of which this cost remains when rounding and errors on the Earth are taken off (`proven`).

    Examples
    --------
    >>> problem = Problem((0, 0), (1, 1))
    >>> 1.0 < needed_for(problem, 1.0) < 1.0 + 1e-12
    True
    >>> proven(problem, needed_for(problem, 0.3)) >= 0.3
    True
    """
    # (a few ulps more, so that it is not missed by rounding)
    return (cost + surfaces * geodesic_error(problem)) / (1.0 - rounding(problem)) * (1.0 + 2.0**-50)


def lower_by_scale(projection: LocalProjection, middles: FloatArray, reach: float, bounds: FloatArray) -> None:
    """
    Turn bounds of the cost on cells into bounds of the cost times the scale, in place.

    On a cell, ``c >= c_l - drop``, where ``c_l`` is linear. The scale ``s = sin(x) / x`` with ``x = |p| / b``
    (`LocalProjection.scale`) is at least ``s_l - reach^2 / (6 b^2)``: no second derivative of ``sin(x) / x``, the mean
    of ``cos(t x)`` over ``t`` from 0 to 1, exceeds 1/3. The product is at least ``c_0 s_0 + (c_0 grad s + s_0 grad c) .
    d`` less a bound of the other terms.

    Parameters
    ----------
    projection
        Of the map.
    middles
        Middles of the cells, which the linear functions are relative to, shape ``(n, 2)``, map units.
    reach
        Greatest distance of a point of a cell from its middle, map units.
    bounds
        As `certificate_kernels.cost_bounds` writes them, shape ``(n, parts, 5)``.
    """
    away = np.hypot(*middles.T)
    scale, slopes = projection.scale(away), projection.scale_gradient(middles)
    steep = np.hypot(*slopes.T)
    bend = reach**2 / (6.0 * POLAR_RADIUS**2)
    most, least = scale + steep * reach, projection.scale(away + reach)
    cost, slope_x, slope_y = (bounds[:, :, column].copy() for column in (COST, SLOPE_X, SLOPE_Y))
    slope = np.hypot(slope_x, slope_y)
    lost = bend * np.maximum(cost + slope * reach, 0.0) + steep[:, None] * slope * reach**2
    bounds[:, :, COST] = scale[:, None] * cost
    bounds[:, :, SLOPE_X] = scale[:, None] * slope_x + slopes[:, :1] * cost
    bounds[:, :, SLOPE_Y] = scale[:, None] * slope_y + slopes[:, 1:] * cost
    bounds[:, :, DROP] = most[:, None] * np.maximum(bounds[:, :, DROP], 0.0) + lost
    bounds[:, :, LEAST] *= least[:, None]
    # on a cell so large that the linear function is no bound of the scale
    bounds[scale - steep * reach < bend, :, :LEAST] = 0.0


def _inside(problem: Problem, mesh: SplineMesh) -> WholeArray:
    """List the nodes inside the area that a piece outside has."""
    if problem.model.area.is_empty:
        return np.empty(0, dtype=np.int64)
    nodes = np.unique(mesh.controls[mesh.is_cut])
    return np.asarray(nodes[problem.model.area.contains(mesh.node_points[nodes])])

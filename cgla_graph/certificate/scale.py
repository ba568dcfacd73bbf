"""The local scale of a map of the Earth: proven bounds of the cost of a unit of length on the plane."""

import math

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.certificate.certificate_kernels import COST, DROP, LEAST, SLOPE_X, SLOPE_Y
from cgla_graph.model.earth import POLAR_RADIUS, LocalProjection
from cgla_graph.model.problem import Problem

#: Least scale that the equation is solved with; only places beyond the map, where nothing is proven, are below it.
LEAST_TO_SOLVE_FOR = 1e-3


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

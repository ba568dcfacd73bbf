"""
Lower bounds of the cost to an end from points near it, where no spline follows the tip of the costs-to-go.

`EndFormula` is a formula, of third order where the cost is smooth on the scale of the block around the end. Where the
cost is not smooth, `EndGrid` is a proven bound on a finer grid over a box around the end, whose own tip is smaller.

**Paths that leave the box** on their way to the end enter it for the last time at a point of its border. From there
they cost at least the bound of the finer grid at that point. So no path from inside costs less than the smaller of its
own bound and the least bound on the border (`EndGrid.cap`). The optimum enters where the cost is low, so that the
border does not lower its bound.
"""

import math
from dataclasses import dataclass

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.certificate import certificate_kernels
from cgla_graph.certificate.costs import least_scale, lower_by_scale
from cgla_graph.eikonal.mesh import SplineMesh, bezier_values
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk_raster_kernels import raster_floor


@dataclass(frozen=True, eq=False)
class EndFormula:
    """
    Lower bound of the cost to an end from points near it, by a formula.

    Let ``c >= c_0 + g . d - H r^2 / 2`` at ``d`` from the end, where ``r = |d| <= R``, and let ``L`` be the least of
    that. Then ``psi = c_0 r + r (g . d) / 2 - beta r^3 / 3`` with ``beta = H / 2 + gamma`` and ``gamma = |g|^2 / (4
    L)`` has ``|grad psi| <= c`` on the disc if ``|g| R <= 2 L``: the part of its gradient along ``d`` is ``c_0 + g .
    d - beta r^2``, the other at most ``|g| r / 2``, and ``|g|^2 / 4 + gamma^2 r^2 <= 2 gamma L``. A path that leaves
    the disc on its way to the end costs at least ``L (R - r)`` up to the rim, and at least the least psi on the rim
    after it has entered the disc for the last time. Where that sum is less than psi, or the condition fails,
    ``psi = L r``, which holds for any path.

    Attributes
    ----------
    numbers
        ``c_0, g_x, g_y, beta``.
    least_cost
        ``L``.
    """

    numbers: FloatArray
    least_cost: float

    @classmethod
    def at(cls, problem: Problem, end: Point, rim: float) -> "EndFormula":
        """Bound the cost to an end from points up to `rim` away, map units."""
        *_, constant = bounds_on_disc(problem, end, rim)
        best, high = cls(np.array([constant, 0.0, 0.0, 0.0]), constant), constant * rim
        for radius in (2.0 * rim, 1.5 * rim):
            cost, gx, gy, drop, _ = bounds_on_disc(problem, end, radius)
            slope = math.hypot(gx, gy)
            least = cost - slope * radius - drop
            if not (least > 0.0 and slope * radius <= 2.0 * least):
                continue
            beta = drop / radius**2 + slope**2 / (4.0 * least)
            last_way = cost * radius - 0.5 * slope * radius**2 - beta * radius**3 / 3.0
            # on the rim, without the slope, which adds as much on one side as it takes away on the other
            level = cost * rim - beta * rim**3 / 3.0
            if last_way + least * (radius - rim) >= cost * rim + 0.5 * slope * rim**2 and level > high:
                floor = least_scale(problem, math.hypot(*end) + radius)
                best, high = cls(np.array([cost, gx, gy, beta]), max(least, floor)), level
        return best

    def costs(self, away: FloatArray) -> FloatArray:
        """Bound the cost to the end from points up to the rim, `away` from it, shape ``(n, 2)``: shape ``(n,)``."""
        cost, gx, gy, beta = self.numbers
        r = np.hypot(*away.T)
        return np.asarray(cost * r + 0.5 * r * (away @ (gx, gy)) - beta * r**3 / 3.0)


@dataclass(frozen=True, eq=False)
class EndGrid:
    """
    Proven lower bound of the cost to an end from a box around it, on a finer grid without areas.

    Attributes
    ----------
    mesh
        Of all cells of the box.
    values
        Control values of the spline, shape ``(n + 1,)``.
    cap
        No path to the end from the border of the box, or across it, costs less.
    blind
        Points up to this distance from the end, map units along x and y, may be in the block around it, where the
        spline is no bound.
    """

    mesh: SplineMesh
    values: FloatArray
    cap: float
    blind: tuple[float, float]

    @classmethod
    def of(cls, mesh: SplineMesh, values: FloatArray, reach: int, leaves: tuple[bool, bool, bool, bool]) -> "EndGrid":
        """
        Find the cap of a spline over a box; `leaves` says which sides (west, south, east, north) paths may cross.

        Coordinates are rounded by some ulps; the spline is lowered by the change that this makes.
        """
        around = values[mesh.controls].reshape(-1, 3, 3)
        slope = sum(float(np.abs(np.diff(around, axis=axis)).max()) / mesh.spacing[2 - axis] for axis in (1, 2))
        far = max(abs(mesh.origin[axis]) + mesh.last[axis] * mesh.spacing[axis] for axis in range(2))
        lowered = values - 2.0**-49 * far * slope
        sides = mesh.columns == 0, mesh.rows == 0, mesh.columns == mesh.last[0], mesh.rows == mesh.last[1]
        border = np.any([side for side, open_ in zip(sides, leaves, strict=True) if open_], axis=0)
        cap = float(bezier_values(lowered, mesh.controls[border]).min(initial=math.inf))
        blind = (reach + 2) * mesh.spacing[0], (reach + 2) * mesh.spacing[1]
        return cls(mesh, lowered, cap, blind)

    @property
    def kernel_box(self) -> certificate_kernels.Box:
        """The box as kernels take it."""
        mesh = self.mesh
        return mesh.controls, mesh.last, mesh.origin, mesh.spacing, self.values, self.cap

    def costs(self, points: FloatArray) -> FloatArray:
        """Bound the cost to the end from points of the box, shape ``(n, 2)``: shape ``(n,)``, map units."""
        found = np.empty(len(points))
        certificate_kernels.box_values(points, self.kernel_box, found)
        return found


def bounds_on_disc(problem: Problem, end: Point, radius: float) -> tuple[float, float, float, float, float]:
    """Bound the cost on a disc by a paraboloid, with cost, slopes and drop, and by a number."""
    bounds, middle = np.empty((1, 1, 5)), np.zeros(1, dtype=np.int32)
    # half the diagonal of this cell is the radius
    cell = (math.sqrt(2.0) * radius, math.sqrt(2.0) * radius)
    certificate_kernels.cost_bounds(middle, middle, end, cell, problem.k, problem.field.mixed_table, bounds)
    cost, gx, gy, drop, least = bounds[0, 0].tolist()
    least = max(cost - math.hypot(gx, gy) * radius - drop, least)
    if problem.field.raster_array is not None:
        x_min, y_min, x_max, y_max = problem.bounds
        low = max(end[0] - radius, x_min), max(end[1] - radius, y_min)
        high = min(end[0] + radius, x_max), min(end[1] + radius, y_max)
        found = raster_floor(low, high, *end, problem.field.raster_array)
        value, slope_x, slope_y, lost, floor = (problem.k * one for one in found)
        # a raster may fall below its linear function by `lost`, everywhere and so at the end too
        cost, gx, gy, least = cost + value - lost, gx + slope_x, gy + slope_y, least + floor
    if problem.projection is not None:
        bounds[0, 0] = cost, gx, gy, drop, least
        lower_by_scale(problem.projection, np.array([end]), radius, bounds)
        cost, gx, gy, drop, least = bounds[0, 0].tolist()
        least = max(cost - math.hypot(gx, gy) * radius - drop, least)
    return cost, gx, gy, drop, least

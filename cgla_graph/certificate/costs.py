"""
The cost of a unit of length on the cells of a mesh: proven bounds, and the cost that the equation is solved for.

On a map of the Earth, a unit of the plane counts with its length on the Earth (`scale`).
"""

import math

import numpy as np
import shapely

from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.certificate import certificate_kernels
from cgla_graph.certificate.scale import LEAST_TO_SOLVE_FOR, lower_by_scale, scale_at
from cgla_graph.eikonal.mesh import SplineMesh
from cgla_graph.model.cost_model import in_parts
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_raster import raster_array


def cost_bounds(problem: Problem, mesh: SplineMesh) -> FloatArray:
    """Bound the cost on each piece from below, or on each quarter of it, as `certificate_kernels` takes it."""
    parts = certificate_kernels.QUARTERS if problem.field.rasters else 1
    bounds = np.empty((len(mesh.columns), parts, 5))
    rasters = problem.field.raster_array

    def fill(part: slice) -> None:
        cells = mesh.columns[part], mesh.rows[part], mesh.origin, mesh.spacing
        certificate_kernels.cost_bounds(*cells, problem.k, problem.field.table, bounds[part])
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
        known = bounds[:, 0, certificate_kernels.COST]
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
    smooth = RiskField(
        field.threats, rasters=[raster for raster in field.rasters if raster.interpolation == "bilinear"]
    ).for_weight(problem.k)
    least = np.zeros(len(nodes))
    if jumping:
        reach = 1.5 * mesh.spacing[0], 1.5 * mesh.spacing[1]
        certificate_kernels.least_around(points, reach, problem.bounds, raster_array(jumping), least)

    def fill(part: slice) -> None:
        risk = smooth.density(points[part]) + least[part]
        costs[nodes[part]] = (1.0 + problem.k * risk) * scale_at(problem, points[part])

    in_parts(fill, len(nodes))
    return costs


def _inside(problem: Problem, mesh: SplineMesh) -> WholeArray:
    """List the nodes inside the area that a piece outside has."""
    if problem.model.area.is_empty:
        return np.empty(0, dtype=np.int64)
    nodes = np.unique(mesh.controls[mesh.is_cut])
    return np.asarray(nodes[problem.model.area.contains(mesh.node_points[nodes])])

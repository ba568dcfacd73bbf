"""Proven bounds of the cost of clean plans: between the ends of a plan, and through its waypoints."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, Bounds, FloatArray
from cgla_graph.airspace.plan_check.plan_map import WIDER, PlanMap, least_outside, wide_bounds, widened
from cgla_graph.certificate.certificate import Certificate, prove
from cgla_graph.errors import ProblemError
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.problem import Problem

#: Areas with more corners are simplified for the bracket, by this part of the map's longer side.
MOST_CORNERS, _COARSE = 5000, 5e-4
#: Corners of all areas up to which bounds of legs are proven.
_MOST_LEG_CORNERS = 20_000
#: Cells of the grids of a leg, at most.
_LEG_CELLS = 400_000
#: Legs up to which each straight line is measured on the Earth by itself.
_MOST_GEODESICS = 5000
#: Map units, beyond every map.
_FAR = 1e30
#: Excess of a leg's cost over its straight line up to which it needs no proof, as a part of the tolerance.
_NEGLIGIBLE = 0.1


@dataclass(frozen=True)
class Through:
    """
    Lower bound of the cost of every clean plan through the same waypoints.

    Attributes
    ----------
    lower_bound
        The sum of the bounds of the legs, map units.
    legs, proven, wanting
        Number of legs, of legs with a proven bound, and of legs whose bound is only their straight line although they
        cost more.
    message
        Why there is no such plan or no bound; empty if there is one.
    """

    lower_bound: float
    legs: int
    proven: int
    wanting: int
    message: str = ""


def blocked_end(on: PlanMap) -> str:
    """Return why no plan between the same ends can be clean, if an end is outside the map or in an area; else empty."""
    problem = on.problem
    for what, index in (("begins", 0), ("ends", -1)):
        place = shapely.Point(on.route[index])
        if on.has_bounds and not problem.in_bounds(on.route[index]):
            return f"it {what} outside the map, as every plan between its ends"
        for area in on.walls:
            if shapely.contains_properly(area.shape, place):
                return f"it {what} inside {area.name}, as every plan between its ends"
            if shapely.distance(area.shape, place) < problem.clearance:
                return f"it {what} nearer to {area.name} than the clearance, as every plan between its ends"
    return ""


def bracket(on: PlanMap, tolerance: float, max_cells: int, *, is_clean: bool) -> Certificate:
    """
    Bracket the least cost of a clean plan between the same ends.

    Raises
    ------
    ProblemError
        If an end is outside the map or in an area.
    """
    route, problem = on.route, on.problem
    if on.has_bounds:
        return _bracket_within(on, problem.bounds, tolerance, max_cells, is_clean=is_clean)
    for factor in WIDER:
        bounds = widened(problem.bounds, factor)
        proof = _bracket_within(on, bounds, tolerance, max_cells, is_clean=is_clean)
        # a path that leaves the box around the plan is at least this long, so that the bound holds for all paths
        outside = _on_earth(on, least_outside(route[0], route[-1], bounds), route[[0, -1]])
        if proof.lower_bound <= outside:
            break
    return dataclasses.replace(proof, lower_bound=min(proof.lower_bound, outside))


def _bracket_within(
    on: PlanMap,
    bounds: Bounds,
    tolerance: float,
    max_cells: int,
    *,
    is_clean: bool,
    leg: int | None = None,
) -> Certificate:
    """
    Bracket the least cost of paths within bounds between the ends of the plan, or of a leg.

    If the plan is clean, the proof begins with its path; for a clean leg, the gap is measured against that leg.
    """
    route = on.route if leg is None else on.route[leg : leg + 2]
    first, last = ((float(x), float(y)) for x, y in route[[0, -1]])
    box = shapely.box(*bounds)
    near = [one.shape for one in on.walls if shapely.intersects(box, one.shape)]
    no_fly = shapely.GeometryCollection(near) if near else None
    problem = dataclasses.replace(on.problem, start=first, goal=last, bounds=bounds, no_fly=no_fly)
    if no_fly is None or shapely.get_num_coordinates(no_fly) <= MOST_CORNERS:
        path = route if is_clean and problem.evaluate(route).feasible else None
        return prove(problem, path, tolerance=tolerance, max_cells=max_cells, keeps_path=leg is not None)
    return _coarse_bracket(problem, no_fly, tolerance, max_cells)


def _coarse_bracket(problem: Problem, no_fly: BaseGeometry, tolerance: float, max_cells: int) -> Certificate:
    """
    Bracket the same cost if areas have very many corners: below with smaller areas, above with larger ones.

    A path that avoids an area avoids every smaller area inside, so that a lower bound with these holds here. A path
    that avoids a larger area around it avoids the area.
    """
    x_min, y_min, x_max, y_max = problem.bounds
    step = _COARSE * max(x_max - x_min, y_max - y_min)
    inner, outer = (_simple(no_fly, sign * step, step) for sign in (-1.0, 1.0))
    proof = prove(dataclasses.replace(problem, no_fly=inner), tolerance=tolerance, max_cells=max_cells)
    upper, path = math.inf, None
    try:
        around = dataclasses.replace(problem, no_fly=outer)
        found = prove(around, tolerance=10.0 * tolerance, max_cells=max_cells)
        upper, path = found.upper_bound, found.path
    except ProblemError:
        # an end is nearer to an area than the step
        pass
    return dataclasses.replace(proof, upper_bound=max(upper, proof.lower_bound), path=path)


def _simple(area: BaseGeometry, wider: float, step: float) -> BaseGeometry:
    """Return an area with fewer corners: inside the given one if `wider` is negative, else around it."""
    moved = shapely.buffer(NoFlyArea(area).geometry, wider, quad_segs=2)
    # arcs of two chords per right angle keep cos(pi / 8) = 0.92 of the distance, and simplifying moves lines by less
    return shapely.simplify(moved, 0.9 * step)


def through_waypoints(on: PlanMap, costs: FloatArray, faulty: BoolArray, tolerance: float, most: int) -> Through:
    """
    Bound the cost of every clean plan through the waypoints of a plan, in their order.

    The bound is a sum over legs. Each leg costs at least the length of its straight line. For legs that cost much more
    or are not clean, a better bound is proven, the costliest first.

    Parameters
    ----------
    on
        The plan on its map.
    costs, faulty
        Costs of the legs, map units, and whether each is not clean, shape ``(n,)``.
    tolerance
        Wanted gap of the bound of a leg, as a ratio.
    most
        Legs with a proven bound, at most.
    """
    problem, route = on.problem, on.route
    if not problem.field.is_proper:
        return Through(math.nan, len(costs), 0, 0, "there is no bound for fields with peaks above 1")
    area = NoFlyArea(shapely.GeometryCollection([one.shape for one in on.walls]))
    inside = np.nonzero(np.asarray(area.contains(route)))[0] if not area.is_empty else np.zeros(0)
    if len(inside):
        stop = on.stops[int(inside[0])]
        return Through(math.nan, len(costs), 0, 0, f"{f'waypoint {stop}' if stop else 'home'} is inside an area")
    bounds = _line_bounds(on)
    gain = np.where(faulty, math.inf, costs - bounds * (1.0 + _NEGLIGIBLE * tolerance))
    wanting = [leg for leg in np.argsort(-gain, kind="stable").tolist() if gain[leg] > 0.0]
    corners = sum(int(shapely.get_num_coordinates(one.shape)) for one in on.walls)
    # (proofs around outlines of 10^5 corners take a minute each: there, straight lines must suffice)
    chosen = wanting[:most] if corners <= _MOST_LEG_CORNERS else []
    for leg in chosen:
        try:
            found = _prove_leg(on, leg, tolerance, is_clean=not faulty[leg])
        except ProblemError as error:
            return Through(math.nan, len(costs), 0, 0, f"leg {leg + 1}: {error}")
        if math.isinf(found):
            return Through(found, len(costs), 0, 0, f"proven: no clean path joins the ends of leg {leg + 1}")
        bounds[leg] = max(bounds[leg], found)
    # (sums are rounded)
    total = math.fsum(bounds.tolist()) * (1.0 - 2.0**-50)
    return Through(total, len(costs), len(chosen), len(wanting) - len(chosen))


def _line_bounds(on: PlanMap) -> FloatArray:
    """Bound the cost of each leg by the length of the straight line between its ends."""
    projection = on.problem.projection
    lengths: FloatArray = np.hypot(*np.diff(on.route, axis=0).T)
    if projection is None:
        return lengths
    if len(lengths) <= _MOST_GEODESICS:
        return np.array([_on_earth(on, length, on.route[leg : leg + 2]) for leg, length in enumerate(lengths.tolist())])
    away = np.hypot(*on.route.T)
    reach = float((0.5 * (lengths + away[:-1] + away[1:])).max())
    return np.asarray(lengths / projection.stretch(reach))


def _on_earth(on: PlanMap, bound: float, ends: FloatArray) -> float:
    """Convert a bound of the cost between two places on the plane to one on the Earth."""
    if on.problem.projection is None:
        return bound
    first, last = ((float(x), float(y)) for x, y in ends)
    return on.problem.projection.bound_on_earth(bound, first, last, on.limits)


def _prove_leg(on: PlanMap, leg: int, tolerance: float, *, is_clean: bool) -> float:
    """Prove a lower bound of the cost of every clean path between the ends of a leg, map units."""
    route = on.route[leg : leg + 2]
    limits = on.limits
    bound = outside = 0.0
    for factor in WIDER[:2]:
        box = widened(wide_bounds(route, math.dist(*route)), factor)
        inner = (max(box[0], limits[0]), max(box[1], limits[1]), min(box[2], limits[2]), min(box[3], limits[3]))
        proof = _bracket_within(on, inner, tolerance, _LEG_CELLS, leg=leg, is_clean=is_clean)
        outside = _on_earth(on, _outside(route, inner, limits), route)
        bound = proof.lower_bound
        if bound <= outside:
            break
    return min(bound, outside)


def _outside(route: FloatArray, inner: Bounds, limits: Bounds) -> float:
    """Return the least length of a path between two places that leaves a box by a side that is not the map's."""
    nearest = math.inf
    for side in range(4):
        if inner[side] != limits[side]:
            box = [-_FAR, -_FAR, _FAR, _FAR]
            box[side] = inner[side]
            nearest = min(nearest, least_outside(route[0], route[1], (box[0], box[1], box[2], box[3])))
    return nearest

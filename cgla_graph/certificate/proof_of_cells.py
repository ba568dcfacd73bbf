"""
Files of proofs over cells of constant cost: values at points on borders, for the part of `check_proof` on cells.

The values are those of `regions.bound`, on the cells of `cell_proof`, in whole numbers. Lines between cells become
strips that hold the lines of all rasters that are as near as rounding.
"""

import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, WholeArray
from cgla_graph.certificate import check_proof as checker
from cgla_graph.certificate.cell_proof import CellProof
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk_raster_kernels import NEAR_X
from cgla_graph.regions import bound
from cgla_graph.regions.arrangement import SAME

#: Whole numbers are steps of so many tolerances times the least interval. Values are lowered by so many tolerances, so
#: that these steps, and sizes of cells of one shape that differ, make none too steep; by more if the checker refuses.
STEP, LESS = 1.0 / 128.0, (1.0 / 40.0, 1.0 / 8.0, 1.0)
#: Cells inside of areas, and their neighbours, corners included.
AROUND = np.ones((3, 3), dtype=np.bool_)
#: Lines as near as this part of the least cell belong to one strip; start and goal as near as this part of a cell.
NEAR, NEAR_END = 4.0 * SAME, 1e-4
#: Cells and points of the largest grid of a spline that this may take the place of.
MAX_CELLS = 1_000_000
#: Paths along lines are moved by up to so many ulps.
BESIDE = 2
#: A level has to close so much of the gap, or no further one is made.
LEAST_GAIN = 0.1


class Store(Protocol):
    """The arrays of a proof file."""

    def add(self, array: Any, name: str) -> str:  # noqa: ANN401 - arrays of any numbers
        """Keep an array; return its name in the file."""

    def array(self, name: str, kind: str, axes: int) -> Any:  # noqa: ANN401 - as the checker's reader
        """Return an array as the checker reads it."""


def describe_cells(
    problem: Problem, checked: checker.Problem, archive: Store, tolerance: float, cost: float
) -> tuple[dict[str, Any], float, bool] | None:
    """
    Describe points on cells until the bound is within a tolerance of a cost.

    Parameters
    ----------
    problem, checked
        The problem without clearance, and as the checker takes it.
    archive
        What takes the arrays.
    tolerance
        Part of the bound.
    cost
        Cost of a known path, map units; infinite without one.

    Returns
    -------
    described, bound, is_loose
        For the file; the bound, map units, at most the cost; and whether an area cuts cells, so that a spline may prove
        more. None where the cost is not constant on cells, or the checker refuses them.
    """
    proof = CellProof.begin(problem, MAX_CELLS)
    if proof is None:
        return None
    try:
        writer = _CellWriter.begin(problem, checked, archive, proof, tolerance)
    except checker.Refused:
        return None
    if apart := writer.apart():
        return {**writer.lines, "limit": None, "levels": [apart]}, math.inf, False
    best, levels = 0.0, []
    while (level := writer.level(cost)) is not None:
        described, found, needed = level
        levels.append(described)
        before, best = best, min(max(best, found), cost)
        if not best * (1.0 + tolerance) < cost < math.inf or cost - best > (1.0 - LEAST_GAIN) * (cost - before):
            break
        proof.cells = proof.cells.without(~needed)
        if proof.finer((cost / best - 1.0) / tolerance):
            break
    limit = cost if math.isfinite(cost) else None
    return ({**writer.lines, "limit": limit, "levels": levels}, best, proof.loose) if levels else None


@dataclass(frozen=True, eq=False)
class _CellWriter:
    """What describes levels of points on cells."""

    problem: Problem
    archive: Store
    proof: CellProof
    lines: dict[str, Any]
    cells: checker.Cells
    tolerance: float

    @classmethod
    def begin(
        cls, problem: Problem, checked: checker.Problem, archive: Store, proof: CellProof, tolerance: float
    ) -> "_CellWriter":
        """Describe the lines, and take the costs and the closed cells that the checker finds."""
        least = min(float(np.diff(lines).min()) for lines in (proof.cells.x, proof.cells.y))
        # (start and goal are corners of cells)
        x, y = np.array([problem.start, problem.goal]).T
        proof.cells = proof.cells.with_lines(x, y, NEAR_END)
        lines = proof.cells.x, proof.cells.y
        strips = [_strips(problem, checked, axis, of, NEAR * least) for axis, of in enumerate(lines)]
        described = {name: archive.add(lines, name) for name, lines in zip("xy", strips, strict=True)}
        cells = checker.Cells(described, archive.array, checked)
        inside = cells.costs[1::2, 1::2]
        costs = np.where(cells.closed, math.inf, inside)
        above, right = np.pad(inside, ((1, 1), (0, 0)), mode="edge"), np.pad(inside, ((0, 0), (1, 1)), mode="edge")
        beside = np.minimum(above[1:], above[:-1]), np.minimum(right[:, 1:], right[:, :-1])
        along = np.minimum(cells.costs[::2, 1::2], beside[0]), np.minimum(cells.costs[1::2, ::2], beside[1])
        is_lesser = any((one < other).any() for one, other in zip(along, beside, strict=True))
        proof.cells = replace(proof.cells, costs=costs, along=along if is_lesser else None)
        return cls(problem, archive, proof, described, cells, tolerance)

    def net(self, parts: FloatArray) -> tuple[dict[str, Any], checker.Net]:
        """Describe points on the sides of the open cells."""
        return {"parts": self.archive.add(parts, "parts")}, checker.Net(parts, self.cells, self.proof.is_open)

    def apart(self) -> dict[str, Any]:
        """Describe values that tell the start from the goal if no cells that touch lead from one to the other."""
        from scipy import ndimage  # noqa: PLC0415 - slow to import, and few proofs are over cells

        part, _ = ndimage.label(self.proof.is_open, AROUND)
        start, goal = (
            {int(part[cell]) for cell in self.proof.cells.cells_of(end)}
            for end in (self.problem.start, self.problem.goal)
        )
        if start & goal:
            return {}
        described, net = self.net(np.empty(0))
        numbers = np.zeros(net.count, dtype=np.int64)
        numbers[net.points(slice(None))[~np.isin(part[net.rows, net.columns], list(goal))]] = 1
        values = self.values(numbers, 0)
        is_flat = checker.Heights(values, self.archive.array, net).is_flat
        return described | {"to_goal": values} if is_flat else {}

    def level(self, cost: float) -> tuple[dict[str, Any], float, BoolArray] | None:
        """Describe values at points; return also the bound, and the cells that a path of less than a cost may enter."""
        points = bound.lay(self.proof.cells, self.proof.m)
        if points is None:
            return None
        described, net = self.net(points.parts)
        # (values are those at corners, at points on horizontal sides, and at those on vertical ones)
        held, inner = checker.with_border(net.is_open), np.arange(len(points.parts))
        is_held, corners = held[::2, ::2].ravel(), net.first[::2, ::2][held[::2, ::2]]
        sides = [net.first[some][held[some]][:, None] + inner for some in (np.s_[::2, 1::2], np.s_[1::2, ::2])]
        places = np.concatenate([corners, *map(np.ravel, sides)])
        reach = 1.01 * cost if math.isfinite(cost) else math.inf
        best, total = 0.0, np.zeros(net.count)
        ends = self.problem.goal, self.problem.start
        for name, end, number in (("to_goal", ends[0], 1), ("to_start", ends[1], 0)):
            values = bound.values_to(points, end, reach)
            in_order = np.empty(net.count)
            in_order[places] = np.append(values[: points.n_corners][is_held], values[points.n_corners :])
            found = self.heights(in_order, net, number)
            if found is None:
                return None
            described[name], above = found
            best, total = max(best, float(above[net.ends[1 - number]])), checker.down(total + above)
        return described, best, net.least(total) < cost

    def heights(self, values: FloatArray, net: checker.Net, end: int) -> tuple[dict[str, Any], FloatArray] | None:
        """Describe values at points as high as the checker takes them, and above the end's; None if it takes none."""
        least = float(np.diff(net.parts).min()) * min(float(size.min()) for size in self.cells.sizes)
        exponent = -math.floor(math.log2(least * self.tolerance * STEP))
        for less in LESS:
            numbers = np.rint(np.ldexp(values / (1.0 + less * self.tolerance), exponent)).astype(np.int64)
            described = self.values(numbers, exponent)
            try:
                found = checker.Heights(described, self.archive.array, net)
            except checker.Refused:
                continue
            return described, (found.whole - found.whole[net.ends[end]]) * found.unit
        return None

    def values(self, numbers: WholeArray, exponent: int) -> dict[str, Any]:
        """Describe whole numbers as values."""
        return {"exponent": exponent, "values": self.archive.add(np.diff(numbers, prepend=0), "values")}


def beside_lines(path: FloatArray, checked: checker.Problem) -> FloatArray:
    """
    Move parts of a path along lines of `nearest` rasters to the side on which they cost least.

    Such a line is mostly no float: a path along it is beside it by rounding, and the checker takes that exactly.

    Parameters
    ----------
    path
        Waypoints, shape ``(n, 2)``, map units.
    checked
        The problem as the checker takes it.

    Returns
    -------
    path
        Waypoints, of which some are moved by up to `BESIDE` ulps, shape ``(m, 2)``, map units; the path as it is if a
        moved one would cross an area.
    """
    moved = [path[:1]]
    for begin, end in pairwise(path):
        level = [axis for axis in range(2) if begin[axis] == end[axis] and _is_near_line(checked, axis, begin[axis])]
        # (a waypoint alone is on no line)
        moved += [_cheapest(checked, level[0], begin, end)] if len(level) == 1 else []
        moved.append(end[None])
    every = np.concatenate(moved)
    found: FloatArray = every[np.append(True, (np.diff(every, axis=0) != 0.0).any(axis=1))]
    try:
        checker.check_free(checked, found)
    except checker.Refused:
        return path
    return found


def _is_near_line(checked: checker.Problem, axis: int, at: float) -> bool:
    """Return whether a line of a raster is next to a coordinate, and not on it."""
    low, high = at - BESIDE * math.ulp(at), at + BESIDE * math.ulp(at)
    near = [raster.knots[axis][bisect_left(raster.knots[axis], low) :][:1] for raster in checked.rasters]
    return any(place[0] <= high and place[0] != at for place in near if place)


def _cheapest(checked: checker.Problem, axis: int, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Return a way from begin to end beside a line: on each part between lines, on the cheapest side of it."""
    low, high = sorted((float(begin[1 - axis]), float(end[1 - axis])))
    cuts = {low, high}
    for raster in checked.rasters:
        places = raster.knots[1 - axis]
        cuts |= {float(one) for one in places[bisect_right(places, low) : bisect_left(places, high)]}
    order = sorted(cuts, reverse=bool(begin[1 - axis] > end[1 - axis]))
    at, found = float(begin[axis]), []
    sides = [at, *(at + n * math.ulp(at) for n in range(-BESIDE, BESIDE + 1) if n)]
    sides = [one for one in sides if checked.bounds[axis] <= one <= checked.bounds[axis + 2]]
    for one, other in pairwise(order):
        middle = (Fraction(one) + Fraction(other)) / 2
        points = [[Fraction(side), middle] if axis == 0 else [middle, Fraction(side)] for side in sides]
        risks = [_risk(checked, point) for point in points]
        best = sides[risks.index(min(risks))]
        found += [(best, one), (best, other)]
    return np.asarray(np.array(found)[:, [axis, 1 - axis]])


def _risk(checked: checker.Problem, point: list[Fraction]) -> Fraction:
    """Return the risk of rasters at a point, as the checker takes it."""
    return sum((raster.exact([point], point)[0] for raster in checked.rasters), Fraction(0))


def _strips(problem: Problem, checked: checker.Problem, axis: int, lines: FloatArray, near: float) -> FloatArray:
    """
    Return strips around lines, shape ``(n, 2)``, that hold the lines of rasters nearby.

    They are as wide as what this library counts as on a line: no path costs less than the bound by its measure, either.
    """
    held: list[tuple[float, float]] = []
    for raster, as_checked in zip(problem.field.rasters, checked.rasters, strict=True):
        off = 8.0 * float(raster.header(0)[NEAR_X + axis]) * raster.cell_size[axis]
        first, *inner, last = as_checked.knots[axis]
        held += [(float(place), float(place)) for place in (first, last)]
        held += [(_beside(place, -math.inf) - off, _beside(place, math.inf) + off) for place in inner]
    low, high = np.array(sorted(held)).T
    near += float((high - low).max())
    first_held, last_held = np.searchsorted(low, [lines - near, lines + near])
    strips = np.column_stack([lines, lines])
    for n in np.flatnonzero(first_held < last_held).tolist():
        some = slice(int(first_held[n]), int(last_held[n]))
        strips[n] = min(float(low[some].min()), lines[n]), max(float(high[some].max()), lines[n])
    for at in (problem.start[axis], problem.goal[axis]):
        n = int(np.abs(lines - at).argmin())
        strips[n] = min(strips[n, 0], at), max(strips[n, 1], at)
    return strips


def _beside(place: Fraction, way: float) -> float:
    """Return the next float of a number in one direction; itself, if it is one."""
    near = float(place)
    if (near > place) == (way < 0.0) and near != place:
        return math.nextafter(near, way)
    return near

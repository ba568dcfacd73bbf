"""
Files that hold a proof: the surfaces of a bound, grid by grid, for `check_proof`.

The surfaces are those of `subsolution`, in whole numbers, and scaled as the checker's own measure of their slopes asks
for. Blocks have surfaces inside, on grids `FINER` times as fine, instead of formulas. The bound of a file is what the
checker finds; it may be less than the solver's, which knows more rules.
"""

import bz2
import io
import json
import math
import os
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import shapely
from numpy.typing import ArrayLike

from cgla_graph._files import write_files
from cgla_graph._text import place
from cgla_graph._types import BoolArray, FloatArray, Point, WholeArray
from cgla_graph._validate import file_path, instance, non_negative_number, point_array, positive_number, real_number
from cgla_graph.certificate import certificate_kernels
from cgla_graph.certificate import check_proof as checker
from cgla_graph.certificate.corners import LEAST_REACH, CornerBlock, corners_of, links_of
from cgla_graph.certificate.costs import cost_bounds, costs_to_solve_for
from cgla_graph.certificate.finer import seeds_beyond
from cgla_graph.certificate.proof_of_cells import beside_lines, describe_cells
from cgla_graph.certificate.proof_target import ON_EARTH, is_on_earth, proof_target, require_provable
from cgla_graph.certificate.subsolution import Level, Subsolution, first_grid, least_loss
from cgla_graph.eikonal import cell_runs, marching_kernels
from cgla_graph.eikonal.marching import march
from cgla_graph.eikonal.mesh import SplineMesh
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem, problem_wanted

#: Columns or rows of a rectangle of cells: the first ones and those after the last, west, east, south, north.
Rectangle: TypeAlias = list[int]
#: Grids inside blocks are so many times as fine, an odd number, and go so many levels deep.
FINER, AROUND_ENDS, AROUND_CORNERS = 5, 3, 2
#: Differences of control values are along rows, 1, or along rows and columns, 2, which takes a fourth less.
AXES = 2
#: A step of control values, in spacings times the tolerance, and boxes of a grid, at most.
STEP, MOST_BOXES = 1.0 / 24.0, 1_000_000
#: Around a corner: cells beyond a box from which the front starts, sub-cells, rounds, and the slope from which another
#: round is made. On a grid inside a block, further blocks are as small as they may be.
BEYOND, SUB_CELLS, ROUNDS, STEEP = 2, 200_000, 6, 1.002
#: Pieces that may be charged for have slopes from this on; and surfaces are scaled by a little more than their slopes.
NEARLY_STEEP, MORE = 0.9, 1.0 + 1e-7
#: Sides of boxes beyond the map are so many cells away from it.
FAR = 1 << 40
#: Grids have cells that are so many floats wide, at least, and a map that is narrower than so many is too narrow.
LEAST_FLOATS, FEW_FLOATS = 16.0, 1e5
#: The gap of a file is at most so many times that of a bound that is given, or so much of the tolerance.
TIMES_GAP, LEAST_TOLERANCE = 1.3, 0.1
#: What surfaces stand for where no way leads to their end, in heights.
UNREACHED = 4.0


class Proven(checker.Result):
    """What a proof file proves, as the checker finds it, and in `note` what of it is not checked; empty: nothing."""

    note: str


def save_proof(
    problem: Problem,
    file: str | os.PathLike[str],
    path: ArrayLike | None = None,
    *,
    tolerance: float = 1e-3,
    known: float = math.inf,
    bound: float = 0.0,
) -> Proven:
    """
    Prove a lower bound of the cost of all paths, and write the proof to a file.

    Parameters
    ----------
    problem
        The problem; a clearance counts as areas that are wider by that much.
    file
        Its name. ``check_proof.py``, a program that needs NumPy alone, checks it. A proof that is there is replaced.
    path
        A feasible path from start to goal to go into the file, shape ``(n, 2)``, map units. None: no path.
    tolerance
        Refine the grid until the cost of the path is at most so much above the bound, as a part of it.
    known
        Cost of a better path, if one is known, map units: no bound comes closer to `path` than that.
    bound
        A bound that is proven without a file, map units, such as that of a certificate: the grid is refined until the
        gap of the file is at most 1.3 times as wide as with that, or a tenth of the tolerance.

    Returns
    -------
    result
        What the file proves, as the checker finds it. ``lower``: no path costs less; infinite if there is none.
        ``upper``: `path` costs at most this; infinite without one. ``problem``: a digest of the problem. ``note``: on a
        map in degrees, what is not checked.

    Raises
    ------
    ProblemError
        If the problem has no bound, the path is not feasible, or no proof was found that fits such a file.
    OutputError
        If the file cannot be written, or another file than a proof has that name.

    Examples
    --------
    >>> import tempfile
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, 0.55, 0.1)]), k=10.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = np.array([(0.1, 0.5), (0.5, 0.2), (0.9, 0.5)])
    ...     found = save_proof(problem, f"{folder}/one.proof", path, tolerance=0.2)
    >>> 0.8 < found["lower"] < found["upper"] < 2.0
    True
    """
    instance("problem", problem, Problem, problem_wanted)
    name, wanted = proof_target(file), positive_number("tolerance", tolerance)
    require_provable(problem.field, problem.start, problem.goal)
    best = positive_number("known", known) if real_number(known) != math.inf else math.inf
    proven = non_negative_number("bound", bound) if real_number(bound) != math.inf else math.inf
    archive = Archive()
    described = describe_problem(problem.relaxed(), archive)
    waypoints, cost = None, best
    if path is not None:
        waypoints = point_array("path", path)
        found = problem.evaluate(waypoints)
        if found.violations:
            msg = f"the path is not feasible: {found.violations[0]}; give a feasible one, or none"
            raise ProblemError(msg)
        cost = min(found.cost, best)
    if 0.0 < proven < cost:
        wanted = min(wanted, max(TIMES_GAP * (cost / proven - 1.0), LEAST_TOLERANCE * wanted))
    writer = _Writer(problem.relaxed(), archive, checker.Problem(described, archive.array, math.inf), wanted)
    try:
        argument, lower = writer.argument(cost, waypoints)
        whole: dict[str, Any] = {
            "format": checker.FORMAT, "version": checker.VERSION, "problem": described, **argument,
            "lower": lower if math.isfinite(lower) else None,
        }  # fmt: skip
        upper = math.inf
        if waypoints is not None:
            is_on_cells = any(one.interpolation == "nearest" for one in problem.field.rasters)
            held = beside_lines(waypoints, writer.checked) if is_on_cells else waypoints
            whole["path"] = archive.add(held, "path")
            with np.errstate(all="ignore"):
                upper = checker.upper_bound(writer.checked, held)
        # (what the checker finds on the way is the bound: the file is not checked once more)
        result = checker.Result(lower=lower, upper=upper, problem=checker.digest(described, archive.array))
    except checker.Refused as error:
        remedy = "`certify` without a file may know a bound"
        if (floats := writer.floats_across()) < FEW_FLOATS:
            remedy = f"the map is only {floats:.3g} floats wide: move it closer to (0, 0)"
        msg = f"no proof of this problem fits into a file: {error}; {remedy}"
        raise ProblemError(msg) from error
    write_files({name: archive.packed(whole)})
    return {**result, "note": ON_EARTH if problem.projection is not None else ""}


def verify_proof(
    file: str | os.PathLike[str], problem: Problem | None = None, *, most_work: float = checker.MOST_WORK
) -> Proven:
    """
    Check a proof file, by the program that needs nothing of this library.

    Parameters
    ----------
    file
        Its name.
    problem
        A problem that has to be the one of the file, apart from the path. None: any.
    most_work
        Numbers that are computed, at most: a file that asks for more is refused before that is done. The default is
        some minutes; proofs of the maps that come with the library take a tenth of it.

    Returns
    -------
    result
        ``lower``: no path costs less; infinite if there is none. ``upper``: the path of the file costs at most this;
        infinite without a path. ``problem``: a digest of the problem. ``note``: on a map in degrees, what is not
        checked.

    Raises
    ------
    ProblemError
        If the file does not prove what it claims, or is about another problem; the message says the first fault.

    Examples
    --------
    >>> verify_proof("pyproject.toml")
    Traceback (most recent call last):
        ...
    cgla_graph.errors.ProblemError: pyproject.toml: refused: the file is not a proof: BadZipFile: File is not a zip file
    """
    name, most = file_path("file", file), positive_number("most_work", most_work)
    try:
        result = checker.check(name, most)
    except checker.Refused as error:
        msg = f"{place(name)}: refused: {error}"
        raise ProblemError(msg) from error
    if problem is not None:
        instance("problem", problem, Problem, problem_wanted)
        if problem_digest(problem) != result["problem"]:
            msg = f"{place(name)}: the proof is true, but about another problem; give the map that it was made for"
            raise ProblemError(msg)
    return {**result, "note": ON_EARTH if is_on_earth(name) else ""}


def problem_digest(problem: Problem) -> str:
    """
    Return the digest of a problem in proof files.

    Examples
    --------
    >>> problem_digest(Problem((0.1, 0.5), (0.9, 0.5))) == problem_digest(Problem((0.1, 0.5), (0.9, 0.5), k=1.0))
    False
    """
    archive = Archive()
    return checker.digest(describe_problem(problem.relaxed(), archive), archive.array)


class Archive:
    """The arrays of a proof file, by name."""

    def __init__(self) -> None:
        self.arrays: dict[str, Any] = {}

    def add(self, array: Any, name: str) -> str:  # noqa: ANN401 - arrays of any numbers
        """Keep an array; return its name in the file."""
        full = f"{len(self.arrays):04d}-{name}.npy.bz2"
        self.arrays[full] = np.asarray(array)
        return full

    def array(self, name: str, kind: str, axes: int) -> Any:  # noqa: ANN401 - as the checker's reader
        """Return an array as the checker reads it from a file; `axes` is not looked at."""
        del axes
        return self.arrays[name].astype(np.float64 if kind == "f" else np.int64)

    def packed(self, described: dict[str, Any]) -> bytes:
        """Return a file with all arrays that a description names."""
        text, stream = json.dumps(described, sort_keys=True), io.BytesIO()
        with zipfile.ZipFile(stream, "w") as file:
            # (a fixed date: the same proof is the same file)
            file.writestr(zipfile.ZipInfo("proof.json"), text, zipfile.ZIP_DEFLATED)
            for name, array in self.arrays.items():
                if f'"{name}"' not in text:
                    continue
                kinds: list[Any] = [np.int8, np.int16, np.int32, np.int64] if array.dtype.kind in "iu" else [np.float64]
                most = int(np.abs(array).max(initial=0)) if array.dtype.kind in "iu" else 0
                kind = next(one for one in kinds if one is np.float64 or most <= np.iinfo(one).max)
                data = io.BytesIO()
                np.lib.format.write_array(data, np.ascontiguousarray(array, dtype=kind))
                packed = bz2.compress(data.getvalue()) if name.endswith(".bz2") else data.getvalue()
                file.writestr(zipfile.ZipInfo(name), packed)
        return stream.getvalue()


def describe_problem(problem: Problem, archive: Archive) -> dict[str, Any]:
    """Describe a problem without clearance, as a proof file does."""
    threats = np.array([[one.x, one.y, one.spread, one.peak] for one in problem.field.threats]).reshape(-1, 4)
    rings = shapely.get_rings(shapely.get_parts(problem.model.area.geometry))
    return {
        "start": list(problem.start),
        "goal": list(problem.goal),
        "bounds": list(problem.bounds),
        "k": problem.k,
        "threats": archive.add(threats, "threats"),
        "rasters": [
            {
                "values": archive.add(
                    one.scale * (one.values[::-1] if one.origin == "upper" else one.values), "raster"
                ),
                "bounds": list(one.bounds),
                "interpolation": one.interpolation,
            }
            for one in problem.field.rasters
        ],
        "rings": [archive.add(shapely.get_coordinates(ring)[:-1], "ring") for ring in rings],
        "on_earth": problem.projection is not None,
    }


@dataclass(frozen=True, eq=False)
class _Sheet:
    """
    A grid as the checker lays it, and the mesh that its surfaces are on.

    `nodes` are those of the mesh for each control value of the grid, where node (0, 0) of the mesh is at `shift`.
    `boxes` are those around blocks, by the cells of these: both surfaces have the same.
    """

    grid: checker.Grid
    mesh: SplineMesh
    nodes: WholeArray
    shift: tuple[int, int]
    boxes: "dict[tuple[int, ...], _Box]" = field(default_factory=dict)

    @classmethod
    def on(cls, mesh: SplineMesh, grid: checker.Grid, shift: tuple[int, int] = (0, 0)) -> "_Sheet":
        """Find the pieces of a mesh that a grid has."""
        columns, rows = grid.columns - shift[0], grid.rows - shift[1]
        cells, place, labels, first_piece = mesh.sub_cells
        width = mesh.last[0] + 1
        keys = mesh.rows.astype(np.int64) * width + mesh.columns
        cell = cells[np.searchsorted(keys, rows * width + columns)]
        # the first square of each piece
        half = grid.parts // 2
        u = grid.sides[0] - grid.columns * grid.parts + half
        v = grid.sides[2] - grid.rows * grid.parts + half
        cut = place[cell] >= 0
        label = np.zeros(len(columns), dtype=np.int64)
        label[cut] = labels[place[cell[cut]], v[cut], u[cut]]
        nodes = np.empty(grid.controls.max(initial=-1) + 1, dtype=np.int64)
        nodes[grid.controls] = mesh.controls[first_piece[cell] + label]
        return cls(grid, mesh, nodes, shift)

    def holds(self, rectangles: Sequence[Rectangle]) -> BoolArray:
        """Return which pieces of the file are in rectangles."""
        found = np.zeros(len(self.grid.columns), dtype=np.bool_)
        for rectangle in rectangles:
            found |= self.grid.within(*rectangle)
        return found


@dataclass(frozen=True, eq=False)
class _Box:
    """A finer grid over a box around a block: its `cells` on the map, the pieces in it, blocks, and costs."""

    sheet: _Sheet
    cells: Rectangle
    keep: BoolArray
    corners: Sequence[CornerBlock]
    bounds: FloatArray
    costs: FloatArray


#: Describes the blocks inside of a surface, from its control values.
_Blocks: TypeAlias = Callable[[FloatArray], list[dict[str, Any]]]


@dataclass(frozen=True, eq=False)
class _Writer:
    """What describes surfaces: a problem without clearance, as it is and as the checker takes it."""

    problem: Problem
    archive: Archive
    checked: checker.Problem
    tolerance: float

    def argument(self, cost: float, path: FloatArray | None) -> tuple[dict[str, Any], float]:
        """Describe points on cells where the cost is constant on them, or grids; return the bound as well."""
        found = describe_cells(self.problem, self.checked, self.archive, self.tolerance, cost)
        if found is None:
            return self.grids(cost, path)
        cells, bound, is_loose = found
        # (an area cuts cells, which the values on their borders do not see)
        if is_loose and not cost <= bound * (1.0 + self.tolerance):
            grids, best = self.grids(cost, path)
            if best > bound:
                return grids, best
        return {"cells": cells}, bound

    def grids(self, cost: float, path: FloatArray | None) -> tuple[dict[str, Any], float]:
        """Describe grids until the bound is within the tolerance of a cost; return the bound as well."""
        problem, best = self.problem, 0.0
        described: list[dict[str, Any]] = []
        whole = {"grids": described, "limit": cost if math.isfinite(cost) else None}
        last, kept = first_grid(problem), np.empty(0, dtype=np.bool_)
        grid: checker.Grid | None = None
        runs = cell_runs.rectangle(last)
        while True:
            most = min(cost, 2.0 * best) if best > 0.0 else cost
            worth = 0.05 * max(self.tolerance * best, most - best) if math.isfinite(most) else math.inf
            level = Level.lay(problem, last, runs, worth, path, widest=1.0)
            parts = parts_of(level.mesh)
            one: dict[str, Any] = {"parts": parts} if described else {"last": list(last), "parts": parts}
            if grid is None:
                grid = checker.Grid.over(self.checked, list(last), parts, [0, last[0] + 1, 0, last[1] + 1])
            else:
                grid = grid.finer(kept, parts)
            sheet = _Sheet.on(level.mesh, grid)
            found = level.both(
                0.05 * self.tolerance, charge=True, known=cost, wanted=cost / (1.0 + 0.5 * self.tolerance)
            )
            if found is None:
                described.append(one)
                if grid.leads():
                    # (by cells that almost touch)
                    described.pop()
                    return whole, best
                return whole, math.inf if len(described) == 1 else cost
            surfaces, bound = self.both(level, sheet, found, cost)
            described.append(one | {name: surfaces[name][0] for name in surfaces})
            best = max(best, bound)
            if not best * (1.0 + self.tolerance) < cost < math.inf:
                return whole, best
            finer = 2 * last[0], 2 * last[1]
            kept = checker.kept(surfaces["to_goal"][1], surfaces["to_start"][1], cost)
            columns, rows = grid.columns[kept].astype(np.int32), grid.rows[kept].astype(np.int32)
            runs = cell_runs.clipped(cell_runs.refined(cell_runs.runs_of(columns, rows), last, finer), finer)
            boxes = cell_runs.count(runs) * (len(grid.costs) // len(grid.columns))
            if boxes > MOST_BOXES or self.floats_across() < LEAST_FLOATS * max(finer):
                return whole, best
            last = finer

    def both(
        self, level: Level, sheet: _Sheet, found: Sequence[Subsolution], cost: float
    ) -> tuple[dict[str, tuple[dict[str, Any], checker.Surface]], float]:
        """
        Describe surfaces to both ends on a grid; one alone if its bound is within the tolerance of a cost.

        The one that the solver finds better comes first. The second result is the greater bound, at most the cost.
        """
        problem, best = self.problem, 0.0
        surfaces: dict[str, tuple[dict[str, Any], checker.Surface]] = {}
        ways = ("to_goal", level.goal_block, problem.start), ("to_start", level.start_block, problem.goal)
        for (name, block, other), bound in sorted(zip(ways, found, strict=True), key=lambda pair: -pair[1].bound):
            cells = _around(block.centre, level.reach)
            held = {"cells": cells, "inside": self.around_end(sheet, cells, block.end, AROUND_ENDS)}
            places = [_rectangle(level.mesh, corner, (0, 0)) for corner in bound.corners]
            inside = partial(self.around_corners, sheet, places, AROUND_CORNERS)
            described = self.surface(sheet, bound.values, bound.bound, held, places, inside)
            surface = checker.Surface(described, self.archive.array, sheet.grid, block.end)
            surfaces[name] = described, surface
            best = max(best, min(cost, surface.bound(other)))
            if cost <= best * (1.0 + self.tolerance):
                return {name: surfaces[name]}, best
        return surfaces, best

    def floats_across(self) -> float:
        """Return about how many floats there are along the longer side of the map."""
        x_min, y_min, x_max, y_max = self.problem.bounds
        return max(x_max - x_min, y_max - y_min) / math.ulp(max(map(abs, self.problem.bounds)))

    def surface(
        self,
        sheet: _Sheet,
        values: FloatArray,
        height: float,
        around_end: dict[str, Any] | None,
        places: Sequence[Rectangle] = (),
        inside: _Blocks = lambda _: [],
    ) -> dict[str, Any]:
        """
        Describe a spline, scaled so that it loses least.

        `height` is about the greatest difference of values that matters. There are blocks `around_end` and at `places`;
        once the values are known, `inside` describes the latter.
        """
        exponent = -math.floor(math.log2(min(sheet.mesh.spacing) * self.tolerance * STEP))
        finite = np.where(np.isfinite(values[:-1]), values[:-1], UNREACHED * height)

        def described(scale: float, blocks: list[dict[str, Any]]) -> dict[str, Any]:
            numbers = np.rint(np.ldexp(finite[sheet.nodes] / scale, exponent)).astype(np.int64)
            steps = self.archive.add(differences(numbers, sheet.grid, AXES), "values")
            return {"exponent": exponent, "values": steps, "axes": AXES, "blocks": blocks}

        tried = checker.Surface(described(1.0, []), self.archive.array, sheet.grid, None)
        rectangles = [*places, around_end["cells"]] if around_end else places
        steepness = np.where(sheet.holds(rectangles), 0.0, tried.steepness)
        scale = _least_loss(tried, steepness, height)
        held = {"end": around_end} if around_end else {}
        return described(scale, inside(np.append(finite / scale, math.inf))) | held

    def around_end(self, outer: _Sheet, cells: Rectangle, end: Point, levels: int) -> dict[str, Any]:
        """Describe a surface around an end, without areas, for a block of an outer grid."""
        last, low, high = _box(outer, cells, max(3, (cells[1] - cells[0]) * 3 // 5))
        bounds, count = self.bounds(last, low, high), (high[0] - low[0], high[1] - low[1])
        corner = max(((x, y) for x in bounds[::2] for y in bounds[1::2]), key=lambda point: math.dist(point, end))
        problem = replace(self.problem, start=corner, goal=end, bounds=bounds, no_fly=None, clearance=0.0)
        level = Level.lay(problem, count, cell_runs.rectangle(count), widest=1.0)
        found = level.bound(to_goal=True, aim=1e-3 * self.tolerance, charge=True)
        if found is None:
            msg = "no way leads to an end on a grid around it: there is no proof for a file"
            raise ProblemError(msg)
        # (half of the outermost cells is outside of the bounds of the mesh)
        first = [one + (one > 0) for one in low]
        final = [one - (one < most) for one, most in zip(high, last, strict=True)]
        box = _as_far([first[0], final[0] + 1, first[1], final[1] + 1], last)
        sheet = _Sheet.on(level.mesh, outer.grid.inside_block(FINER, 0, box), low)
        centre = level.goal_block.centre[0] + low[0], level.goal_block.centre[1] + low[1]
        block: dict[str, Any] = {"cells": _around(centre, level.reach)}
        if levels > 1 and self.floats_across() >= LEAST_FLOATS * FINER * max(last):
            block["inside"] = self.around_end(sheet, block["cells"], end, levels - 1)
        height = float(np.max(found.values[:-1], where=np.isfinite(found.values[:-1]), initial=0.0))
        surface = self.surface(sheet, found.values, height, block)
        return {"finer": FINER, "parts": 0, "box": box, "surface": surface}

    def around_corners(
        self, outer: _Sheet, places: Sequence[Rectangle], levels: int, values: FloatArray
    ) -> list[dict[str, Any]]:
        """Describe blocks around corners of an outer grid, on which a surface has such values."""
        return [{"cells": cells, "inside": self.around_corner(outer, cells, levels, values)} for cells in places]

    def around_corner(self, outer: _Sheet, cells: Rectangle, levels: int, values: FloatArray) -> dict[str, Any]:
        """Describe a surface around corners, which begins with the outer one beyond the box, for a block of it."""
        if tuple(cells) not in outer.boxes:
            outer.boxes[tuple(cells)] = self.box_around(outer, cells, levels, values)
        box = outer.boxes[tuple(cells)]
        sheet, spline = box.sheet, self.solved(outer, box, values)
        known = spline[:-1][np.isfinite(spline[:-1])]
        base, height = (float(known.min()), float(np.ptp(known))) if len(known) else (0.0, 0.0)
        places = [_rectangle(sheet.mesh, one, sheet.shift) for one in box.corners]
        inside = partial(self.around_corners, sheet, places, levels - 1)
        surface = self.surface(sheet, spline - base, height, None, places, inside)
        return {"finer": FINER, "parts": parts_of(sheet.mesh), "box": box.cells, "surface": surface}

    def box_around(self, outer: _Sheet, cells: Rectangle, levels: int, values: FloatArray) -> _Box:
        """
        Lay a finer grid over a box around a block of an outer grid, and further blocks on it.

        A way that leaves the box has to cost what the outer surface falls by on the block, if a margin can be so wide.
        """
        problem, wide, held = self.problem, cells[1] - cells[0], outer.holds([cells])
        known = values[outer.nodes[outer.grid.controls[held]]]
        twice = 2.0 * min(outer.mesh.spacing) * float(outer.grid.costs.reshape(-1, len(held), 9)[:, held].min())
        needed = np.ptp(known[np.isfinite(known)]) / twice if np.isfinite(known).any() else 0.0
        last, low, high = _box(outer, cells, max(wide // 2 + 3, min(math.ceil(needed) + 1, wide + 3)))
        first = max(low[0] - BEYOND, 0), max(low[1] - BEYOND, 0)
        final = min(high[0] + BEYOND, last[0]), min(high[1] + BEYOND, last[1])
        count = final[0] - first[0], final[1] - first[1]
        runs, area = cell_runs.rectangle(count), problem.model.area
        mesh = SplineMesh.build(self.bounds(last, first, final), count, runs, area, [], most_sub_cells=SUB_CELLS)
        columns, rows = mesh.columns + first[0], mesh.rows + first[1]
        away = np.minimum.reduce([columns - low[0], high[0] - columns, rows - low[1], high[1] - rows])
        keep = (away >= 0) & mesh.matters
        box = _as_far([low[0], high[0] + 1, low[1], high[1] + 1], last)
        sheet = _Sheet.on(mesh, outer.grid.inside_block(FINER, parts_of(mesh), box), first)
        is_finer = levels > 1 and self.floats_across() >= LEAST_FLOATS * FINER * max(last)
        laid = corners_of(problem, mesh, LEAST_REACH, [])[0] if is_finer else []
        # (further blocks need a box of their own inside this one, and are not across the rim)
        west, east, south, north = (FINER * one - FINER // 2 for one in cells)
        within = (columns >= west) & (columns < east) & (rows >= south) & (rows < north)
        beside = (columns >= west - 1) & (columns <= east) & (rows >= south - 1) & (rows <= north) & ~within
        free = (away >= FINER) & ~beside
        bounds = cost_bounds(problem, mesh)
        costs = costs_to_solve_for(problem, mesh, bounds)
        return _Box(sheet, box, keep, [one for one in laid if free[one.pieces].all()], bounds, costs)

    def solved(self, outer: _Sheet, box: _Box, values: FloatArray) -> FloatArray:
        """Solve the equation from values of an outer surface beyond a box, with lower costs where it gets too steep."""
        mesh, costs = box.sheet.mesh, box.costs.copy()
        nodes, pieces, weights = seeds_beyond(outer.mesh, mesh, ~box.keep)
        begin = (values[outer.mesh.controls[pieces]] * weights).sum(axis=1)
        checked = box.keep.copy()
        for corner in box.corners:
            checked[corner.pieces] = False
        links, n, known = links_of(mesh, box.corners), mesh.n_nodes, np.isfinite(begin)
        floors, steep, times = np.zeros(len(mesh.columns)), np.empty(len(mesh.columns)), np.full(n + 1, np.inf)
        for _ in range(ROUNDS):
            times, state = np.full(n + 1, np.inf), np.zeros(n + 1, dtype=np.int8)
            state[:n][mesh.outside] = marching_kernels.DONE
            times[nodes[known]] = begin[known]
            state[nodes[known]] = marching_kernels.TRIAL
            march(mesh, times, state, np.append(costs, 1.0), links)
            steepest = certificate_kernels.steepness(times, mesh.kernel_mesh, mesh.outlines, checked, box.bounds, steep)
            if not STEEP < steepest < math.inf:
                break
            certificate_kernels.soften(steep, mesh.controls, floors, costs)
        return times

    def bounds(
        self, last: tuple[int, int], low: tuple[int, int], high: tuple[int, int]
    ) -> tuple[float, float, float, float]:
        """Return the places of two nodes of a grid over the map."""
        x_min, y_min, x_max, y_max = self.problem.bounds
        (west, east), (south, north) = (
            [
                least + one * ((most - least) / last[axis]) if one < last[axis] else most
                for one in (low[axis], high[axis])
            ]
            for axis, (least, most) in enumerate(((x_min, x_max), (y_min, y_max)))
        )
        return west, south, east, north


def differences(numbers: WholeArray, grid: checker.Grid, axes: int) -> WholeArray:
    """Return the second differences of control values along rows, and along columns for two axes."""
    steps = np.diff(numbers, 2, prepend=[0, 0])
    if axes == 2:  # noqa: PLR2004 - rows and columns
        order = checker.by_columns(grid)
        steps[order] = np.diff(steps[order], 2, prepend=[0, 0])
    return steps


def parts_of(mesh: SplineMesh) -> int:
    """Return how many squares are along the side of a cell, 0 where no area cuts one."""
    return mesh.sub_cells[2].shape[1] if mesh.has_walls else 0


def _around(centre: tuple[int, int], reach: int) -> Rectangle:
    """Return the rectangle of the cells within reach of one."""
    return [centre[0] - reach, centre[0] + reach + 1, centre[1] - reach, centre[1] + reach + 1]


def _rectangle(mesh: SplineMesh, block: CornerBlock, shift: tuple[int, int]) -> Rectangle:
    """Return the rectangle of the cells of a block."""
    columns, rows = mesh.columns[block.pieces] + shift[0], mesh.rows[block.pieces] + shift[1]
    return [int(columns.min()), int(columns.max()) + 1, int(rows.min()), int(rows.max()) + 1]


def _box(outer: _Sheet, cells: Rectangle, margin: int) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int]]:
    """Return the last node of a finer grid over the map, and the first and last node of a box around a rectangle."""
    last = FINER * outer.grid.last[0], FINER * outer.grid.last[1]
    low, high = (
        tuple(
            min(max(FINER * (cells[2 * axis + end] - end + sign * margin) + sign * (FINER // 2), 0), last[axis])
            for axis in range(2)
        )
        for end, sign in ((0, -1), (1, 1))
    )
    return last, (low[0], low[1]), (high[0], high[1])


def _as_far(box: Rectangle, last: tuple[int, int]) -> Rectangle:
    """Return a box whose sides at the border of the map are so far beyond that no way pays for leaving there."""
    return [side if 0 < side <= last[n // 2] else (FAR if n % 2 else -FAR) for n, side in enumerate(box)]


def _least_loss(surface: checker.Surface, steepness: FloatArray, height: float) -> float:
    """Choose what a surface is divided by: what stays too steep is charged for, by the change on each cell."""
    (above,) = np.nonzero(steepness > NEARLY_STEEP)
    if not len(above):
        return 1.0
    # (pieces with the same function count once)
    _, first, same = np.unique(surface.grid.controls[above], axis=0, return_index=True, return_inverse=True)
    steepest = np.zeros(len(first))
    np.maximum.at(steepest, same, steepness[above])
    spans = np.ptp(checker.bezier(surface.controls[above[first]]).reshape(-1, 9), axis=1) * surface.unit
    order = np.argsort(steepest)[::-1]
    return least_loss(steepest[order], spans[order], height)[0] * MORE

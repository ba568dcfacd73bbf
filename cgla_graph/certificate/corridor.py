"""
The corridor of near-optimal paths: polygons that contain every path within a given part of the optimum.

**Statement.** Let ``U`` be the cost of a known path. No path costs less than the optimum, and the optimum is at most
``U``: a path within ``delta`` of it costs at most ``(1 + delta) U``. It passes no place through which every path costs
more (`through`). What is left of the map after that contains **every** such path. Finer grids leave less of it, until
the area settles.

**What is certain.** The corridor also holds places through which no such path leads, as a bound is not the cost. Where
a path is *shown* that costs at most ``(1 + delta) L``, with the proven lower bound ``L``, the path is within delta of
the optimum for certain. Such paths are sought through as many places as possible: down the bounds to both ends from
there, refined where that costs too much. Their cost is that of `Problem.evaluate`.

**Ways** around the holes of the corridor are in `ways`.

On a map in degrees, bounds count on the Earth, and costs of paths on the plane are at least those: both statements hold
there too.
"""

import math
import time
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._display import Plottable
from cgla_graph._text import at_most, json_number
from cgla_graph._types import BoolArray, Bounds, FloatArray, Point, WholeArray
from cgla_graph._validate import non_negative_number, whole_number
from cgla_graph.certificate.through import GridThrough, grids_through
from cgla_graph.certificate.ways import Way, Ways, ways_of
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import descent
from cgla_graph.errors import CglaError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, TOLERANCE
from cgla_graph.refine.refine import refine_path

#: Cells of a grid, at most, by default.
MOST_CELLS = 250_000
#: Grids end once the area falls by at most this part with the last one.
SETTLED = 0.02
#: Cells along the longer side of the map on which places are shown; tries to show a path; waypoints of one, at most.
SHOWN, TRIES, POINTS = 100, 80, 128
#: A path that costs more than wanted is refined if it costs at most so many times as much.
REFINED = 1.05
#: Rounding of places, relative to the longer side of the map: polygons are wider by it.
WIDER = 1e-9
#: Ways that are listed, at most, by default.
MOST_WAYS = 16


@dataclass(frozen=True, eq=False)
class Corridor(Plottable):
    """
    Polygons that contain every path within a part of the optimum, and the ways that lead through them.

    Attributes
    ----------
    delta
        Paths of at most ``1 + delta`` times the cost of the optimum are meant.
    outer
        Contains every such path, map units. Empty where there is no path.
    inner
        Cells of a grid inside `outer`: through each of them, a path leads that is within delta for certain. Empty if
        no path is.
    shown
        These paths: waypoints, shape ``(n, 2)`` each.
    limit
        No path through a place outside `outer` costs less than this.
    lower_bound, upper_bound
        The bracket of the optimum: proven, and the cost of `path`.
    path
        The best path known; None if none is.
    areas
        Area of the corridor on each grid, coarse to fine, map units squared, areas that are closed included.
    ways
        The ways around the holes of the corridor.
    message
        Why it ended, in one line.
    seconds
        Time that it took.
    problem
        The problem.
    """

    delta: float
    outer: BaseGeometry
    inner: BaseGeometry
    shown: tuple[FloatArray, ...]
    limit: float
    lower_bound: float
    upper_bound: float
    path: FloatArray | None
    areas: tuple[float, ...]
    ways: Ways
    message: str
    seconds: float
    problem: Problem = field(repr=False)

    @property
    def moved(self) -> float:
        """By which part the area fell with the last grid; NaN with fewer than two."""
        return 1.0 - self.areas[-1] / self.areas[-2] if len(self.areas) > 1 else math.nan

    @property
    def is_settled(self) -> bool:
        """Whether the area hardly changed with the last grid."""
        return self.moved <= SETTLED

    @cached_property
    def share(self) -> float:
        """The part of the map's area that the corridor has."""
        x_min, y_min, x_max, y_max = self.problem.bounds
        return float(self.outer.area / ((x_max - x_min) * (y_max - y_min)))

    def ways_text(self) -> str:
        """Say in a line how many ways there are."""
        known, undecided = len(self.ways.known), len(self.ways.undecided)
        if not known:
            return "none" if self.outer.is_empty else "none is known"
        least = "at least " if self.ways.has_more or undecided else ""
        left = f"; {undecided} more are not excluded" if undecided else ""
        return f"{least}{known}{left}"

    def document(self) -> dict[str, Any]:
        """Return the numbers as JSON, without polygons and paths."""
        return {
            "delta": self.delta,
            "limit": json_number(self.limit),
            "lower_bound": json_number(self.lower_bound),
            "upper_bound": json_number(self.upper_bound),
            "area": json_number(self.outer.area),
            "share_of_map": json_number(self.share),
            "certain_area": json_number(self.inner.area),
            "moved": json_number(self.moved),
            "settled": bool(self.is_settled),
            "ways": [way.document() for way in self.ways.known],
            "undecided_ways": [way.document() for way in self.ways.undecided],
            "has_more_ways": self.ways.has_more,
            "message": self.message,
            "seconds": json_number(self.seconds),
        }


def corridor_around(
    problem: Problem,
    path: FloatArray | None,
    lower_bound: float,
    delta: float,
    *,
    max_cells: int = MOST_CELLS,
    most_ways: int = MOST_WAYS,
) -> Corridor:
    """
    Find the corridor of all paths within a part of the optimum; `Certificate.corridor` gives path and bound.

    Parameters
    ----------
    problem
        The problem; its no-fly area counts, and its clearance.
    path
        A feasible path, the better the narrower the corridor, shape ``(n, 2)``; None if none is known.
    lower_bound
        A proven bound of all paths; infinite if there is none.
    delta
        At least 0.
    max_cells
        Cells of a grid, at most.
    most_ways
        Ways that are listed, at most: 1 to 1000.

    Returns
    -------
    corridor
        All of the map where nothing is known that rules out a part of it; its message says so.

    Raises
    ------
    ProblemError
        If delta is negative or not finite, `most_ways` is out of range, or the path is not feasible.

    Examples
    --------
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5))
    >>> found = corridor_around(problem, np.array([[0.1, 0.5], [0.9, 0.5]]), 0.8, 0.02, max_cells=50_000)
    >>> len(found.ways.known), bool(found.outer.area > math.pi * 0.4 * 1.02 * 0.4 * math.sqrt(1.02**2 - 1.0))
    (1, True)
    """
    began = time.perf_counter()
    delta = non_negative_number("delta", delta)
    most_ways = whole_number("most_ways", most_ways, at_least=1, at_most=1000)
    if math.isinf(lower_bound):
        return _without_grids(problem, delta, lower_bound, shapely.Polygon(), "there is no path")
    if not problem.field.is_proper or math.isnan(lower_bound):
        why = f"no bound, so that no place is ruled out: {NEGATIVE_WEIGHTS}"
        return _without_grids(problem, delta, math.nan, free_map(problem), why)
    if problem.start == problem.goal:
        here = shapely.buffer(shapely.Point(problem.start), _wider(problem))
        stays = np.array([problem.start])
        one = _without_grids(problem, delta, 0.0, here, "start and goal are the same place: to stay costs nothing")
        ways = Ways((Way(stays, 0.0, 0.0, ()),), (), False, np.empty((0, 2)))  # noqa: FBT003 - as its fields are
        return replace(one, limit=0.0, upper_bound=0.0, path=stays, ways=ways)
    limit = math.inf
    if path is not None:
        # rounded up, so that no path within delta is lost to rounding
        limit = math.nextafter((1.0 + delta) * problem.evaluate(path).cost * (1.0 + 2.0**-50), math.inf)
    grid, areas, why = _settled(problem, path, limit, delta, max_cells)
    if grid is None:
        return _without_grids(problem, delta, lower_bound, free_map(problem), why)
    through = grid.through
    if through.path is None:
        return _without_grids(problem, delta, max(lower_bound, through.lower_bound), free_map(problem), why)
    best = max(lower_bound, through.lower_bound)
    outer = outer_of(problem, through.last, cell_runs.runs_of(through.columns, through.rows))
    shown, inner = _Shown.of(problem, grid, (1.0 + delta) * best).found(through.path, through.upper_bound)
    ways = ways_of(problem, grid, outer, limit, best, [through.path, *shown], most_ways)
    return Corridor(
        delta=delta,
        outer=outer,
        inner=shapely.intersection(inner, outer),
        shown=tuple(shown),
        limit=limit,
        lower_bound=best,
        upper_bound=through.upper_bound,
        path=through.path,
        areas=tuple(areas),
        ways=ways,
        message=why if shown else f"{why}; no path is within delta for certain: the gap of the best one is greater",
        seconds=time.perf_counter() - began,
        problem=problem,
    )


def _settled(
    problem: Problem, path: FloatArray | None, limit: float, delta: float, max_cells: int
) -> tuple[GridThrough | None, list[float], str]:
    """Refine grids until the area of the corridor settles; return the last, all areas, and why it ended."""
    laid: GridThrough | None = None
    areas: list[float] = []
    if path is None:
        return None, areas, "no path is known, so that no place is ruled out"
    # (cells at the limit itself are inside)
    above = math.nextafter(limit, math.inf)
    tolerance = max(min(TOLERANCE, 0.1 * delta), 1e-6)
    for laid in grids_through(problem, limit=above, path=path, tolerance=tolerance, max_cells=max_cells):
        cells = np.unique(np.column_stack([laid.through.rows, laid.through.columns]), axis=0)
        areas.append(len(cells) * math.prod(laid.through.spacing))
        if len(areas) > 1 and 1.0 - areas[-1] / areas[-2] <= SETTLED:
            return laid, areas, f"the area has settled: it fell by {at_most(1.0 - areas[-1] / areas[-2])}"
    if laid is None:
        return None, areas, f"the first grid has more than the {max_cells} cells allowed: no place is ruled out"
    fell = f"; the area still fell by {at_most(1.0 - areas[-1] / areas[-2])} with the last" if len(areas) > 1 else ""
    return laid, areas, f"the next grid would need more than the {max_cells} cells allowed{fell}"


def _without_grids(problem: Problem, delta: float, bound: float, outer: BaseGeometry, message: str) -> Corridor:
    """Return a corridor that is all of the map, or nothing."""
    ways = Ways((), (), not outer.is_empty, np.empty((0, 2)))
    return Corridor(
        delta, outer, shapely.Polygon(), (), math.inf, bound, math.inf, None, (), ways, message, 0.0, problem
    )


def _wider(problem: Problem) -> float:
    """Return by how much polygons are wider than cells, map units."""
    x_min, y_min, x_max, y_max = problem.bounds
    return max(WIDER * max(x_max - x_min, y_max - y_min), 4.0 * float(np.spacing(np.abs(problem.bounds).max())))


def free_map(problem: Problem) -> BaseGeometry:
    """
    Return the map without its areas, which are narrower by rounding.

    Examples
    --------
    >>> free_map(Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.4, 0.0, 0.6, 0.5))).area.__round__(6)
    0.9
    """
    area = problem.relaxed().model.area
    whole = shapely.box(*problem.bounds)
    if area.is_empty:
        return whole
    return shapely.difference(whole, shapely.buffer(area.geometry, -_wider(problem), join_style="mitre"))


def cells_outline(bounds: Bounds, last: tuple[int, int], runs: WholeArray) -> BaseGeometry:
    """
    Return cells of a grid as polygons, as far as they are inside the bounds.

    Parameters
    ----------
    bounds
        Of the map.
    last
        Column and row of the last node of the grid.
    runs
        The cells (`cell_runs`).

    Examples
    --------
    >>> cells_outline((0, 0, 1, 1), (4, 4), np.array([[0, 0, 3], [1, 1, 2]])).area
    0.140625
    """
    low, high = np.reshape(bounds, (2, 2))
    steps = (high - low) / np.array(last)
    rows, first, end = runs.T
    boxes = shapely.box(
        low[0] + (first - 0.5) * steps[0],
        low[1] + (rows - 0.5) * steps[1],
        low[0] + (end - 0.5) * steps[0],
        low[1] + (rows + 0.5) * steps[1],
    )
    return shapely.intersection(shapely.union_all(boxes), shapely.box(*bounds))


def outer_of(problem: Problem, last: tuple[int, int], runs: WholeArray) -> BaseGeometry:
    """
    Return cells of a grid as polygons without areas; cells that touch in a corner are joined.

    Examples
    --------
    >>> outer_of(Problem((0.1, 0.5), (0.9, 0.5)), (4, 4), np.array([[0, 0, 3], [1, 1, 2]])).area.__round__(6)
    0.140625
    """
    wide = shapely.buffer(cells_outline(problem.bounds, last, runs), _wider(problem), join_style="mitre")
    return shapely.intersection(wide, free_map(problem))


@dataclass(eq=False)
class _Shown:
    """Places through which a path is shown that costs at most `most`, on a coarse grid."""

    problem: Problem
    grid: GridThrough
    most: float
    last: tuple[int, int]
    spacing: FloatArray
    #: The least bound in each coarse cell, and the piece that has it, shapes ``(rows, columns)``.
    least: FloatArray
    piece: WholeArray
    covered: BoolArray

    @classmethod
    def of(cls, problem: Problem, grid: GridThrough, most: float) -> "_Shown":
        """Lay the coarse grid."""
        through, mesh = grid.through, grid.level.mesh
        times = max(math.ceil(max(through.last) / SHOWN), 1)
        last = -(-through.last[0] // times), -(-through.last[1] // times)
        low, high = np.reshape(problem.bounds, (2, 2))
        spacing = (high - low) / np.array(last)
        pieces = grid.pieces
        at = np.rint((mesh.node_points[mesh.controls[pieces, 4]] - low) / spacing).astype(np.int64)
        order = np.argsort(-through.least, kind="stable")
        least, piece = np.full((last[1] + 1, last[0] + 1), math.inf), np.full((last[1] + 1, last[0] + 1), -1)
        # (of equal places, the last one counts)
        least[at[order, 1], at[order, 0]] = through.least[order]
        piece[at[order, 1], at[order, 0]] = pieces[order]
        return cls(problem, grid, most, last, spacing, least, piece, np.zeros(least.shape, dtype=np.bool_))

    def found(self, path: FloatArray, cost: float) -> tuple[list[FloatArray], BaseGeometry]:
        """Show paths through as many cells as possible; return them, and the cells."""
        from scipy import ndimage  # noqa: PLC0415 - slow to import, and few proofs need it

        shown: list[FloatArray] = []
        if cost <= self.most:
            shown.append(path)
            self._cover(path)
        missed = ~(self.least <= self.most)
        for _ in range(TRIES if shown and self.grid.bounds else 0):
            away = np.where(missed | self.covered, 0.0, ndimage.distance_transform_edt(~(self.covered | missed)))
            row, column = np.unravel_index(int(np.argmax(away)), away.shape)
            if away[row, column] == 0.0:
                break
            one = self._through(int(self.piece[row, column]))
            if one is not None:
                shown.append(one)
                self._cover(one)
            # also if the path misses the middle of the cell
            missed[row, column] = True
        rows, columns = np.nonzero(self.covered)
        return shown, cells_outline(self.problem.bounds, self.last, cell_runs.runs_of(columns, rows))

    def _cover(self, path: FloatArray) -> None:
        """Mark the cells that a path passes."""
        points = shapely.get_coordinates(shapely.segmentize(shapely.LineString(path), 0.2 * float(self.spacing.min())))
        columns, rows = np.rint((points - self.problem.bounds[:2]) / self.spacing).astype(np.int64).T
        self.covered[rows, columns] = True

    def _through(self, piece: int) -> FloatArray | None:
        """Find a path over a piece that costs little enough; None if none is found."""
        problem, mesh, bounds = self.problem, self.grid.level.mesh, self.grid.bounds
        x, y = np.clip(mesh.node_points[mesh.controls[piece, 4]], problem.bounds[:2], problem.bounds[2:]).tolist()
        if bounds is None:
            return None
        parts: list[FloatArray] = []
        for end, index, surface in ((problem.start, 0, bounds[1]), (problem.goal, 1, bounds[0])):
            part = self._down((x, y), end, (piece, mesh.ends[index]), surface.values)
            if part is None:
                return None
            parts.append(part)
        path = np.vstack([parts[0][::-1], parts[1][1:]])
        judged = problem.evaluate(path)
        if judged.feasible and self.most < judged.cost <= REFINED * self.most:
            refined = [refine_path(problem, part, tolerance=1e-5, max_points=POINTS).path for part in parts]
            path = np.vstack([refined[0][::-1], refined[1][1:]])
            judged = problem.evaluate(path)
        return path if judged.feasible and judged.cost <= self.most else None

    def _down(self, at: Point, end: Point, pieces: tuple[int, int], values: FloatArray) -> FloatArray | None:
        """Descend bounds of the cost to an end from a place; None if that leads nowhere."""
        if at == end:
            return np.array([at, end])
        level = self.grid.level
        try:
            there = replace(self.problem, start=at, goal=end)
        except CglaError:
            # (the middle of a cell may be inside an area)
            return None
        part = descent(there, replace(level.mesh, ends=pieces), values, radius=level.reach + 1.0)
        return part if len(part) else None

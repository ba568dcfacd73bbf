"""
The proof over cells of constant cost (`regions.bound`), refined: few points on all borders, more in the tube.

On rasters read as `nearest`, the cost is constant on cells. There values at points on the borders of cells bound the
cost of all paths more closely than a spline, which cannot follow the jumps. The gap falls with the square of the number
of points. Cells through which every path costs more than a known one are left out before more points are laid.
"""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import shapely

from cgla_graph._types import BoolArray, FloatArray, WholeArray
from cgla_graph.eikonal import cell_runs
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.regions import bound
from cgla_graph.regions.arrangement import Arrangement, has_cells
from cgla_graph.regions.bound import Rounding
from cgla_graph.regions.points import covered
from cgla_graph.regions.walls import Walls, tips

#: Points of a side in the first round, by how many cells there are at most; and in the last round, at most.
POINTS, MOST_POINTS = {4_000: 15, 40_000: 7, 10**9: 3}, 63
#: Long cells are divided if there are no more than these afterwards.
LONG_CELLS = 40_000
#: Fewer points are of no use.
LEAST_POINTS = 2
#: A round has so many times as many points as the one before, at least and at most; it aims at this part of the gap.
LEAST_TIMES, MOST_TIMES, AIMED_AT = 1.3, 2.1, 0.75
#: Nodes that take as much memory as one cell of a spline.
NODES_A_CELL = 12
#: The gap is expected to fall at least with this power of the number of points; and gaps, above which another path is
#: sought, times that power of the number of points.
ORDER, USUAL_GAP = 1.5, 0.6
#: Corners of areas through which lines are laid, at most, and how far inside of them, as a part of the least cell.
MOST_TIPS, DEPTH = 12, 1e-3
#: Cells that areas cut, at most: while there are more, paths lead through.
MOST_CUT = 4_000
#: A round has to close so much of the gap, or the next one is not made.
WORTH = 0.2
#: Picture elements along each side of a tube.
PICTURE = 300


@dataclass(eq=False)
class CellProof:
    """
    One round of a proof over cells.

    Attributes
    ----------
    problem
        The problem, without clearance.
    cells
        The cells that better paths may enter; the others have infinite cost.
    rounding
        What covers the rounding.
    m
        Points of a side.
    most
        Nodes, at most.
    is_last
        Whether the round is expected to be good enough.
    cut
        Which cells areas cut; None if there are no areas.
    """

    problem: Problem
    cells: Arrangement
    rounding: Rounding
    m: int
    most: int
    cut: BoolArray | None = None
    is_last: bool = False
    _walls: Walls | None = None

    @classmethod
    def begin(
        cls, problem: Problem, max_cells: int, near: FloatArray | None = None, *, joins: bool = True
    ) -> "CellProof | None":
        """
        Prepare the first round; None where the cost is not constant on cells, or there are too many of them.

        Parameters
        ----------
        problem
            The problem, without clearance.
        max_cells
            As `cgla_graph.certificate.certificate.prove` takes it.
        near
            A path near which lines of cells go through corners of areas, shape ``(m, 2)``; None: there are none.
        joins
            Whether lines are left out on which no cost changes.
        """
        if problem.projection is not None or not has_cells(problem):
            return None
        cells = Arrangement.of(problem, for_bound=True, joins=joins)
        if cells.block > 1:
            return None
        rounding = Rounding.of(problem, cells)
        most = NODES_A_CELL * max_cells
        wide, high = (float(np.median(np.diff(lines))) for lines in (cells.x, cells.y))
        # (in long cells, the points of the short sides are too many, and those of the long sides too few)
        if cells.along is None:
            most_parts = max(LONG_CELLS // cells.costs.size, 1)
            cells = cells.divided(*(min(max(round(of), 1), most_parts) for of in (wide / high, high / wide)))
        area, cut = problem.model.area, None
        if not area.is_empty:
            if near is not None:
                depth = DEPTH * min(float(np.diff(lines).min()) for lines in (cells.x, cells.y))
                # (a path of one point too)
                way = shapely.LineString(np.vstack([near, near[-1:]]))
                cells = cells.with_lines(*tips(area, depth, way, MOST_TIPS).T)
                rounding = Rounding.of(problem, cells)
            # (a line beside an outline, as near as rounding, has the lesser cost: also that of a cell inside)
            inside, cut = covered(cells, area, rounding.apart)
            cells = cells.without(inside)
        m = next(m for few, m in POINTS.items() if cells.costs.size <= few)
        first = cls(problem, cells, rounding, m, most, cut)
        if first.nodes(m) > most:
            first.m = int(m * most / first.nodes(m))
        return first if rounding.share < 1.0 and first.m >= LEAST_POINTS else None

    @property
    def loose(self) -> bool:
        """Whether more is lost than by few points, as an area cuts cells."""
        return self.cut is not None and bool(self.cut.any())

    @property
    def walls(self) -> Walls | None:
        """What areas leave free of the cells that they cut; None if there are none, or still too many."""
        if self._walls is None and self.cut is not None:
            left = self.cut & self.is_open
            if 0 < np.count_nonzero(left) <= MOST_CUT:
                self._walls = Walls.of(self.cells, left, self.problem.model.area, self.rounding.apart)
        return self._walls

    @property
    def is_open(self) -> BoolArray:
        """Which cells better paths may enter, shape ``(rows, columns)``."""
        return np.isfinite(self.cells.costs)

    @property
    def spacing(self) -> float:
        """Mean distance of points on the sides of most cells, map units."""
        sides = np.median(np.diff(self.cells.x)), np.median(np.diff(self.cells.y))
        return float(max(sides)) / (self.m + 1)

    def nodes(self, m: int) -> int:
        """Return how many nodes `m` points a side make, at most."""
        rows, columns = self.cells.costs.shape
        count = int(np.count_nonzero(self.is_open))
        return int((rows + 1) * (columns + 1) + m * min(4 * count, 2 * count + rows + columns))

    def bounds(self, limit: float, wanted: float) -> tuple[float, Callable[[float], None] | None]:
        """
        Bound the cost of all paths.

        Parameters
        ----------
        limit
            Cost of a known path; no bound is above it.
        wanted
            A bound that is good enough.

        Returns
        -------
        bound, keep
            The bound; and a function that leaves out the cells through which no path costs less than a number. None if
            the bound is good enough.
        """
        problem = self.problem
        points = bound.lay(self.cells, self.m, self.walls)
        if points is None:
            return 0.0, None
        costs = bound.least_cost_at(self.cells, problem.start) + bound.least_cost_at(self.cells, problem.goal)
        # (what rounding takes off must not be missing)
        reach = limit + 2.0 * (limit - self.rounding.below(limit, costs)) if limit < math.inf else limit
        with ThreadPoolExecutor(1) as thread:
            other = None if self.is_last else thread.submit(bound.values_to, points, problem.start, reach)
            to_goal = bound.values_to(points, problem.goal, reach)
            found = bound.bound_at(points, to_goal, problem.start, problem.goal)
            best = min(max(self.rounding.below(found, costs), 0.0), limit)
            if best >= wanted:
                return best, None
            to_start = bound.values_to(points, problem.start, reach) if other is None else other.result()
        found = bound.bound_at(points, to_start, problem.goal, problem.start)
        best = max(best, min(self.rounding.below(found, costs), limit))
        if best >= wanted:
            return best, None
        through = points.least_on_cells(to_goal + to_start)
        return best, partial(self._keep, through, costs)

    def _keep(self, through: FloatArray, costs: float, limit: float) -> None:
        """Leave out the cells through which no path costs less than a limit."""
        if not limit < math.inf:
            return
        gone = (1.0 - self.rounding.share) * through - self.rounding.apart * costs > limit
        for end in (self.problem.start, self.problem.goal):
            for cell in self.cells.cells_of(end):
                gone[cell] = False
        self.cells = self.cells.without(gone)

    def finer(self, excess: float) -> str:
        """
        Lay more points; return why there are no more of them, or nothing.

        Parameters
        ----------
        excess
            The gap, as a multiple of the one that is wanted.
        """
        if self.m >= MOST_POINTS:
            return f"there are {self.m} points on each side of a cell, and no more are laid"
        times = (excess / AIMED_AT) ** (1.0 / ORDER)
        m = min(math.ceil(self.m * min(max(times, LEAST_TIMES), MOST_TIMES)), MOST_POINTS)
        self.is_last = times <= MOST_TIMES
        if (needed := self.nodes(m)) > self.most:
            m = int(m * self.most / needed)
            if m < LEAST_TIMES * self.m:
                return f"the next points on cells would be {needed} nodes, of {self.most} allowed"
        self.m = m
        return ""

    def runs(self) -> tuple[tuple[int, int], WholeArray]:
        """Return the last node of a coarse grid and the runs of its cells that cover the open cells, for pictures."""
        rows, columns = self.cells.costs.shape
        last = min(columns, PICTURE), min(rows, PICTURE)
        mask = np.zeros((last[1] + 2, last[0] + 2), dtype=np.int64)
        at = []
        for lines, count in ((self.cells.x, last[0]), (self.cells.y, last[1])):
            node = np.floor((lines - lines[0]) / (lines[-1] - lines[0]) * count + 0.5).astype(np.int64)
            at.append((node[:-1], node[1:] + 1))
        j, i = np.nonzero(self.is_open)
        for right, column in ((1, at[0][0][i]), (-1, at[0][1][i])):
            for up, row in ((1, at[1][0][j]), (-1, at[1][1][j])):
                np.add.at(mask, (row, column), up * right)
        marked_rows, marked_columns = np.nonzero(mask.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0)
        return last, cell_runs.runs_of(marked_columns, marked_rows)


@cache
def load_kernels() -> None:
    """
    Compile or load the kernels, once in a process.

    Examples
    --------
    >>> load_kernels()
    """
    field = RiskField(rasters=[RasterRisk([[0.0, 1.0], [2.0, 0.0]], (0, 0, 1, 1), interpolation="nearest")])
    small = CellProof.begin(Problem((0.1, 0.1), (0.9, 0.9), field, k=1.0), 10**6)
    if small is not None:
        small.m = 1
        small.bounds(math.inf, math.inf)
    # (rasters on the same cells)
    twice = RiskField(
        rasters=[*field.rasters, RasterRisk([[1.0, 0.0], [0.0, 2.0]], (0, 0, 1, 1), interpolation="nearest")]
    )
    lined = CellProof.begin(Problem((0.1, 0.1), (0.9, 0.9), twice, k=1.0), 10**6)
    if lined is not None:
        lined.bounds(math.inf, math.inf)

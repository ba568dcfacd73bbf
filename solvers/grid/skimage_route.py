"""The cheapest path over cells by scikit-image, a usual tool for raster costs."""

import math
import time
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
import shapely

from cgla_graph._types import BoolArray, FloatArray, IntArray, Point
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Settings, Whole

#: Cells along the longer side, where there is no raster, and at most.
CELLS, MOST_CELLS = 256, 4096
#: Cells are taken this much smaller than they are: an area that ends on their edge does not touch them.
ASIDE = 1e-9
#: Start and goal are joined to a cell at most so many cells from their own.
REACH = 4
#: A route whose diagonal moves graze areas is searched again without their cells, so many times.
RETRIES = 50

Cell: TypeAlias = tuple[int, int]


@dataclass(frozen=True)
class SkimageRoute(Settings):
    """
    The route of least sum from cell to cell: `skimage.graph.route_through_array`.

    The map is cut into cells, each of which costs ``1 + k F`` at its centre for each unit of length. With ``geometric``
    that is scikit-image's ``MCP_Geometric``, which `route_through_array` calls: a move costs its length times the mean
    of its two cells. Without, it is ``MCP``: the sum of the cells passed, independent of the length of a move, so that
    diagonal ones are too cheap. The path through the cells' centres is judged by the exact cost.

    Cells that no-fly areas touch are impassable. Start and goal are joined to their cells' centres, or to the nearest
    passable one in plain sight.

    **Known failures.** As on any grid of eight directions, in free space the route is up to 8.24 % longer than the
    straight line (with four, 41 %), on cells of any size. Risk is seen at centres only. Gaps narrower than two cells
    are closed.

    `Solution.evaluations` counts the cells.

    Attributes
    ----------
    cells
        Along the longer side of the bounds, 2 to 4096; None: as large as those of the finest raster, else 256.
    fully_connected
        Whether there are diagonal moves.
    geometric
        Whether the length of a move counts.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    In free space it makes one bend.

    >>> round(SkimageRoute(cells=3).solve(Problem((0.5, 0.5), (2.5, 1.5), bounds=(0, 0, 3, 3))).cost, 4)
    2.4142
    """

    cells: Annotated[int, Whole(2, MOST_CELLS)] | None = None
    fully_connected: bool = True
    geometric: bool = True

    traits: ClassVar[Traits] = Traits(
        "skimage-route",
        "scikit-image's route through an array of costs",
        domain="plane",
        complete=False,
        needs=("skimage",),
        needs_positive=True,
    )

    def solve(self, problem: Problem) -> Solution:
        """Weigh the cells, which is reported as time to build, and search them."""
        began = time.perf_counter()
        grid = Grid(problem, self._shape(problem))
        ends = [grid.cell_in_sight(end) for end in (problem.start, problem.goal)]
        built = time.perf_counter() - began
        message = f"no-fly areas close the {grid.shape[0]} x {grid.shape[1]} cells between start and goal"
        if (start := ends[0]) is not None and (goal := ends[1]) is not None:
            for _ in range(RETRIES):
                route = self._route(grid, start, goal)
                if not len(route):
                    break
                path = np.vstack([problem.start, grid.centres(route), problem.goal])
                crossing = problem.model.area.crosses(path[:-1], path[1:])[1:-1]
                if not crossing.any():
                    path = path[np.append(True, (np.diff(path, axis=0) != 0.0).any(axis=1))]
                    cost = problem.evaluate(path).cost
                    return Solution(
                        Status.FOUND, path=path, cost=cost, build_seconds=built, evaluations=grid.costs.size
                    )
                grid.close(route[1:][crossing], start, goal)
        return Solution(Status.NOT_FOUND, build_seconds=built, evaluations=grid.costs.size, message=message)

    def _shape(self, problem: Problem) -> tuple[int, int]:
        """Return how many rows and columns there are."""
        x_min, y_min, x_max, y_max = problem.bounds
        width, height = x_max - x_min, y_max - y_min
        cells = self.cells
        if cells is None and problem.field.rasters:
            finest = [min(sizes) for sizes in zip(*(r.cell_size for r in problem.field.rasters), strict=True)]
            shape = max(1.0, height / finest[1]), max(1.0, width / finest[0])
            larger = max(1.0, max(shape) / MOST_CELLS)
            return max(1, round(shape[0] / larger)), max(1, round(shape[1] / larger))
        spacing = max(width, height) / (CELLS if cells is None else cells)
        return max(1, round(height / spacing)), max(1, round(width / spacing))

    def _route(self, grid: "Grid", start: Cell, goal: Cell) -> IntArray:
        """Search the cells; return those passed, shape ``(m, 2)``, empty if there is no way."""
        from skimage import graph  # noqa: PLC0415 - optional, and slow to load

        # as `route_through_array`, for cells that may be wider than high
        kind: Any = graph.MCP_Geometric if self.geometric else graph.MCP
        search = kind(grid.costs, fully_connected=self.fully_connected, sampling=grid.sampling)
        reached, _ = search.find_costs([start], [goal])
        if not math.isfinite(reached[goal]):
            return np.empty((0, 2), dtype=np.int64)
        return np.array(search.traceback(goal), dtype=np.int64)


class Grid:
    """
    A map in cells.

    Attributes
    ----------
    shape
        Rows, from `y_min`, and columns.
    costs
        Of a unit of length in each cell, shape ``(rows, columns)``; -1: impassable.
    sampling
        Height and width of a cell over its height.

    Examples
    --------
    >>> grid = Grid(Problem((0.1, 0.1), (0.9, 0.9), no_fly=shapely.box(0.5, 0, 1, 0.5)), (2, 2))
    >>> grid.costs.tolist()
    [[1.0, -1.0], [1.0, 1.0]]
    """

    def __init__(self, problem: Problem, shape: tuple[int, int]) -> None:
        """Weigh all cells at their centres."""
        x_min, y_min, x_max, y_max = problem.bounds
        self.problem, self.shape = problem, shape
        self._low = np.array([y_min, x_min])
        self._size = np.array([(y_max - y_min) / shape[0], (x_max - x_min) / shape[1]])
        self.sampling = (1.0, float(self._size[1] / self._size[0]))
        self.costs = np.empty(shape)
        for row in range(shape[0]):
            centres = self.centres(np.column_stack([np.full(shape[1], row), np.arange(shape[1])]))
            self.costs[row] = 1.0 + problem.k * problem.field.density(centres)
        self.costs[self._touched()] = -1.0

    def centres(self, cells: IntArray) -> FloatArray:
        """Return the middles of cells, shape ``(n, 2)`` to ``(n, 2)``: rows and columns to map units."""
        centres: FloatArray = (self._low + (cells + 0.5) * self._size)[:, ::-1]
        return centres

    def cell_in_sight(self, place: Point) -> Cell | None:
        """Return the nearest passable cell whose centre can be flown to straight; None if there is none near."""
        own = np.floor((np.array(place)[::-1] - self._low) / self._size).astype(np.int64)
        own = np.clip(own, 0, np.array(self.shape) - 1)
        low, high = np.maximum(own - REACH, 0), np.minimum(own + REACH + 1, self.shape)
        near = low + np.argwhere(self.costs[low[0] : high[0], low[1] : high[1]] >= 0.0)
        centres = self.centres(near)
        near = near[~self.problem.model.area.crosses(np.broadcast_to(place, centres.shape), centres)]
        if not len(near):
            return None
        away = np.hypot(*(self.centres(near) - place).T)
        # its own cell first, wherever in the cell it is
        away[(near == own).all(axis=1)] = -1.0
        row, column = near[int(away.argmin())].tolist()
        return row, column

    def close(self, cells: IntArray, *but: Cell) -> None:
        """Make cells impassable, shape ``(n, 2)``, but some."""
        kept = [self.costs[cell] for cell in but]
        self.costs[tuple(cells.T)] = -1.0
        for cell, cost in zip(but, kept, strict=True):
            self.costs[cell] = cost

    def _touched(self) -> BoolArray:
        """Tell which cells no-fly areas touch: blocks of cells are halved until they are cells, or all in or out."""
        touched = np.zeros(self.shape, dtype=np.bool_)
        area = self.problem.model.area.geometry
        shapely.prepare(area)
        size = 1 << (max(self.shape) - 1).bit_length()
        blocks = np.zeros((1, 2), dtype=np.int64)
        while len(blocks) and not area.is_empty:
            ends = np.minimum(blocks + size, self.shape)
            low, high = (self._low + corner * self._size for corner in (blocks + ASIDE, ends - ASIDE))
            boxes = shapely.box(low[:, 1], low[:, 0], high[:, 1], high[:, 0])
            near = shapely.intersects(area, boxes)
            full = near & ((size == 1) | shapely.contains_properly(area, boxes))
            for (row, column), (last_row, last_column) in zip(blocks[full].tolist(), ends[full].tolist(), strict=True):
                touched[row:last_row, column:last_column] = True
            size //= 2
            blocks = blocks[near & ~full]
            quarters = np.array([(0, 0), (0, size), (size, 0), (size, size)])
            blocks = (blocks[:, None] + quarters).reshape(-1, 2)
            blocks = blocks[(blocks < self.shape).all(axis=1)]
        return touched

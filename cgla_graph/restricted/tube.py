"""The tube of a graph's optimum: grids with proven bounds from both ends, refined where a cheap path may pass."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, IntArray, WholeArray
from cgla_graph.certificate.costs import proven
from cgla_graph.certificate.subsolution import Level, Subsolution, finer_grid, first_grid
from cgla_graph.certificate.through import kept
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import descent
from cgla_graph.model.problem import Problem
from cgla_graph.restricted import restricted_kernels

#: Cells of a mesh, at most: 3 GB with all else, where the lattice has 4000 points a side.
MOST_CELLS = 5_000_000


@dataclass(frozen=True, eq=False)
class Tube:
    """
    One grid, and its proven bounds.

    Attributes
    ----------
    problem
        The problem in the plane between the ends of the graph's path.
    level
        The grid.
    from_start, to_goal
        The bounds of the cost from the start, and to the goal.
    """

    problem: Problem
    level: Level
    from_start: Subsolution
    to_goal: Subsolution

    @classmethod
    def lay(cls, problem: Problem, last: tuple[int, int], runs: WholeArray, aim: float) -> "Tube | None":
        """Solve the equation from both ends on some cells; None if no path joins the ends over them."""
        level = Level.lay(problem, last, runs)
        both = level.both(aim)
        return None if both is None else cls(problem, level, from_start=both[1], to_goal=both[0])

    @classmethod
    def first(cls, problem: Problem, aim: float) -> "Tube | None":
        """Lay the first grid, over all of the bounds."""
        last = first_grid(problem)
        return cls.lay(problem, last, cell_runs.rectangle(last), aim)

    @property
    def bound(self) -> float:
        """The proven bound of the cost of every path."""
        return proven(self.problem, max(self.from_start.bound, self.to_goal.bound))

    @property
    def rim(self) -> float:
        """Radius of the blocks around the ends, map units, inside which differences of bounds are no bounds."""
        return (self.level.reach + 1) * math.hypot(*self.level.mesh.spacing)

    def kept(self, upper: float) -> WholeArray:
        """Return the runs of the cells that a path of at most this cost may pass."""
        return kept(self.level, self.to_goal, self.from_start, upper)

    def finer(self, upper: float) -> tuple[tuple[int, int], WholeArray]:
        """Return the last node and the cells of the next grid; they may still be too many."""
        return finer_grid(self.problem, self.level.mesh.last, self.kept(upper), 2.0, MOST_CELLS)

    def path(self) -> FloatArray:
        """Follow the bound down from the start to the goal; empty if the descent fails."""
        return descent(self.problem, self.level.mesh, self.to_goal.values, radius=self.level.reach + 1.0)

    def bounds_at(self, points: FloatArray, *, to_goal: bool) -> tuple[FloatArray, FloatArray]:
        """
        Bound the cost between points and one of the ends.

        Returns
        -------
        least, most
            Shape ``(n,)`` each: a bound, and the value to subtract from the bound at another point (see `restricted`).
            Infinite outside the tube.
        """
        mesh = self.level.mesh
        block = self.level.goal_block if to_goal else self.level.start_block
        end = self.problem.goal if to_goal else self.problem.start
        least, most = np.empty(len(points)), np.empty(len(points))
        restricted_kernels.spline_bounds(
            points,
            end,
            (self.to_goal if to_goal else self.from_start).values,
            mesh.kernel_mesh,
            self._row_starts,
            mesh.last,
            mesh.matters,
            block.holds,
            block.formula.least_cost,
            least,
            most,
        )
        return proven(self.problem, least), most

    def cells(self, upper: float, reach: int) -> BoolArray:
        """Mark the cells of the grid within `reach` of those that a cheap path may pass, shape ``(columns, rows)``."""
        last = self.level.mesh.last
        found = np.zeros((last[0] + 1, last[1] + 1), dtype=np.bool_)
        columns, rows = cell_runs.cells_of(cell_runs.clipped(self.kept(upper), last))
        restricted_kernels.widen(columns.astype(np.int64), rows.astype(np.int64), reach, found)
        return found

    @cached_property
    def _row_starts(self) -> IntArray:
        """The first piece of each row of cells, and at last the number of pieces."""
        mesh = self.level.mesh
        return np.searchsorted(mesh.rows, np.arange(mesh.last[1] + 2))

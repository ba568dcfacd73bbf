"""
Bounds of the cost to one goal from many starts, over cells of constant cost.

On rasters read as `nearest`, values at points on the borders of cells (`regions.bound`) bound the cost from everywhere
to the goal. They are charged for nothing, so one search is enough for all starts; another, over points without lowered
lengths, has the paths.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, Point
from cgla_graph.certificate.cell_proof import MOST_POINTS, CellProof
from cgla_graph.model.problem import Problem
from cgla_graph.regions import bound
from cgla_graph.regions.paths import cells_of
from cgla_graph.regions.points import Points

#: Points of a side, and how many times as many there are in the next round.
POINTS, TIMES = 15, 2


@dataclass(eq=False)
class CellSurface:
    """
    Values that bound the cost to one goal from everywhere, and values of paths.

    Attributes
    ----------
    problem
        The problem whose paths are judged.
    proof
        Cells and rounding; its number of points a side is that of the next round.
    goal
        The goal.
    n_solves
        How many times the values were solved for; those of paths are not counted.
    """

    problem: Problem
    proof: CellProof
    goal: Point
    n_solves: int = 0
    _bounds: "tuple[Points, FloatArray] | None" = field(default=None, repr=False)
    _paths: "tuple[Points, FloatArray] | None" = field(default=None, repr=False)

    @classmethod
    def towards(cls, problem: Problem, goal: Point, max_cells: int) -> "CellSurface | None":
        """Prepare the values to a goal; None where the cost is not constant on cells, or there are too many."""
        proof = CellProof.begin(problem.relaxed(), max_cells)
        if proof is None:
            return None
        most = max(m for m in range(proof.m, max(POINTS, proof.m) + 1) if proof.nodes(m) <= proof.most)
        proof.m = most
        return cls(problem, proof, goal)

    def solve(self) -> bool:
        """Solve for the values, over more points than before; return whether still more may be of use."""
        proof = self.proof
        if self.n_solves:
            proof.m = min(TIMES * proof.m + 1, MOST_POINTS)
        points = bound.lay(proof.cells, proof.m, proof.walls)
        self.n_solves += 1
        if points is not None:
            self._bounds = points, bound.values_to(points, self.goal)
        laid = Points.lay(cells_of(self.problem), proof.m, self.problem.model.area)
        self._paths = laid, laid.costs_from(self.goal)
        return points is not None and proof.nodes(min(TIMES * proof.m + 1, MOST_POINTS)) <= proof.most

    def states(self, points: FloatArray) -> tuple[BoolArray, BoolArray]:
        """Tell which points nothing is known about, and from which there is no path: none of either is known."""
        return np.zeros(len(points), dtype=np.bool_), np.zeros(len(points), dtype=np.bool_)

    def paths(self, starts: FloatArray) -> Iterator[FloatArray]:
        """Give the best way over points from each start, shape ``(m, 2)``, map units; empty where there is none."""
        for start in starts:
            straight = np.array([start, self.goal])
            free = [] if self.problem.evaluate(straight).violations else [straight]
            if self._paths is not None:
                laid, costs = self._paths
                nodes = laid.nodes_to(costs, (float(start[0]), float(start[1])))
                free += [np.vstack([start, laid.places(nodes), self.goal])] if len(nodes) else []
            yield min(free, key=lambda path: self.problem.evaluate(path).cost, default=np.empty((0, 2)))

    def bounds(self, points: FloatArray, costs: FloatArray) -> FloatArray:
        """Bound the cost of all paths from points to the goal, shape ``(n,)``; no bound is above `costs`."""
        if self._bounds is None:
            return np.zeros(len(points))
        laid, values = self._bounds
        cells, rounding = self.proof.cells, self.proof.rounding
        at_goal = bound.least_cost_at(cells, self.goal)
        found = np.zeros(len(points))
        for n, point in enumerate(map(tuple, points.tolist())):
            least = bound.bound_at(laid, values, point, self.goal)
            found[n] = rounding.below(least, at_goal + bound.least_cost_at(cells, point))
        return np.maximum(np.minimum(found, costs), 0.0)

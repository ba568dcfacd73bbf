"""
Bounds of all paths through places under several weights of `nearest` rasters at once, and the bound that they leave.

Under weights of the scenarios, `S` and `T` bound the costs from a place to start and goal (`regions.bound`), so that no
path through the place has a lower objective than ``S + T`` there. Cells and points are the same under all weights. On
an interval between neighbours the sum is linear, and nowhere below the lesser of its ends. The greatest such number
over the weights bounds each path that meets the interval.

**Chains.** A path is cut where it leaves one cell for the next: at a place of their common side, or in a common corner.
So it gives a chain of cells, from one that the start is in or on to one of the goal. Each step costs at least the least
number of the intervals of the side, or the number of the corner. Each path has at least the greatest number of its
chain, and all paths have at least the least of these over all chains. Cells through which no path is below a known one
are left out of chains. (Chains pass cells that an area cuts from any side to any other one.)
"""

import math
from bisect import bisect_left
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cgla_graph._types import FloatArray, IntArray, Point
from cgla_graph.certificate.cell_proof import MOST_POINTS, CellProof
from cgla_graph.model.problem import Problem
from cgla_graph.regions import bound
from cgla_graph.regions.arrangement import Arrangement
from cgla_graph.regions.bound import Rounding
from cgla_graph.regions.points import Points

#: Points of a side for paths, by how many nodes there are at most.
WAY_POINTS = {15: 100_000, 7: 200_000, 3: 10**9}


@dataclass(eq=False)
class CellCut:
    """
    Bounds of all paths through the sides and corners of cells, the greatest under the weights so far.

    Attributes
    ----------
    proof
        Cells on which the cost is constant in all scenarios, and the number of points of a side.
    points
        The points; costs are those of the mean.
    of_sides, of_corners
        Bounds of all paths that meet each interval of a side, shape ``(sides, m + 1)``, and each corner, map units.
    of_cells
        Bounds of all paths through each cell, shape ``(rows, columns)``, map units; infinite where none leads.
    lower_bound
        The best bound of all paths under one set of weights, map units.
    """

    proof: CellProof
    points: Points
    lower_bound: float = 0.0
    of_sides: FloatArray = field(init=False)
    of_corners: FloatArray = field(init=False)
    of_cells: FloatArray = field(init=False)

    @classmethod
    def begin(cls, problem: Problem, max_cells: int, near: FloatArray | None = None) -> "CellCut | None":
        """Prepare cells and points; None where there is no proof over cells (`CellProof.begin`)."""
        proof = CellProof.begin(problem.relaxed(), max_cells, near, joins=False)
        points = None if proof is None else bound.lay(proof.cells, proof.m, proof.walls)
        return None if proof is None or points is None else cls(proof, points)

    def __post_init__(self) -> None:
        """Begin without bounds."""
        self.of_sides = np.full((len(self.points.sides[2]), self.proof.m + 1), -math.inf)
        self.of_corners = np.full(self.points.n_corners, -math.inf)
        self.of_cells = np.where(self.proof.is_open, -math.inf, math.inf)

    def add(self, weighted: Problem, limit: float) -> float:
        """
        Bound all paths under one more set of weights; return the bound.

        Parameters
        ----------
        weighted
            The problem with the weighted field.
        limit
            The objective of a known path, map units; no bound is above it.
        """
        problem = weighted.relaxed()
        points, rounding = over(self.points, problem), Rounding.of(problem, self.proof.cells)
        # (lines of scenarios without weight are lines too)
        common = self.proof.rounding
        rounding = Rounding(max(rounding.share, common.share), max(rounding.apart, common.apart))
        start, goal = problem.start, problem.goal
        costs = bound.least_cost_at(points.cells, start) + bound.least_cost_at(points.cells, goal)
        reach = limit + 2.0 * (limit - rounding.below(limit, costs))
        to_goal, to_start = (bound.values_to(points, end, reach) for end in (goal, start))
        least = max(bound.bound_at(points, to_goal, start, goal), bound.bound_at(points, to_start, goal, start))
        least = min(rounding.below(least, costs), limit)
        self.lower_bound = max(self.lower_bound, least)
        sums = (1.0 - rounding.share) * (to_goal + to_start) - rounding.apart * costs
        corner, kind = np.divmod(points.sides[2], 2)
        corners, inner = sums[: points.n_corners], sums[points.n_corners :].reshape(len(corner), -1)
        last = corners[np.where(kind == 0, corner + 1, corner + len(points.cells.x))]
        along = np.column_stack([corners[corner], inner, last])
        np.maximum(self.of_sides, np.minimum(along[:, 1:], along[:, :-1]), out=self.of_sides)
        np.maximum(self.of_corners, corners, out=self.of_corners)
        np.maximum(self.of_cells, points.least_on_cells(sums), out=self.of_cells, where=self.proof.is_open)
        return least

    def narrowest(self) -> tuple[float, Point]:
        """
        Return the least, over all chains, of the greatest number on the chain, and the place of that number.

        It is infinite if there is no chain, and minus infinity if start and goal are in one cell.
        """
        cells = self.proof.cells
        horizontal, vertical, _ = self.points.sides
        number = np.arange(cells.costs.size).reshape(cells.costs.shape)
        of_sides = self.of_sides.min(axis=1, initial=math.inf)
        inner = np.arange(self.points.n_corners).reshape(len(cells.y), -1)[1:-1, 1:-1]
        steps = [
            (number[:-1], number[1:], horizontal[1:-1], of_sides),
            (number[:, :-1], number[:, 1:], vertical[:, 1:-1], of_sides),
            (number[:-1, :-1], number[1:, 1:], inner, self.of_corners),
            (number[:-1, 1:], number[1:, :-1], inner, self.of_corners),
        ]
        pairs = np.concatenate([np.stack([one.ravel(), other.ravel()]) for one, other, *_ in steps], axis=1)
        values = np.concatenate([least[at].ravel() for *_, at, least in steps])
        is_open = self.proof.is_open.ravel()[pairs].all(axis=0)
        problem, columns = self.proof.problem, cells.costs.shape[1]
        starts, goals = (
            [row * columns + column for row, column in cells.cells_of(end)] for end in (problem.start, problem.goal)
        )
        found = least_greatest(pairs[:, is_open], values[is_open], starts, goals)
        return found, self._place_of(found)

    def _place_of(self, value: float) -> Point:
        """Return the middle of an interval that has a number, or else the corner."""
        m = self.proof.m
        side, number = divmod(int(np.argmax(self.of_sides == value)), m + 1)
        if self.of_sides[side, number] != value:
            nodes = np.array([np.argmax(self.of_corners == value)])
        else:
            corner, kind = divmod(int(self.points.sides[2][side]), 2)
            first, last = self.points.n_corners + side * m, corner + (1, len(self.points.cells.x))[kind]
            nodes = np.array([corner, *range(first, first + m), last])[number : number + 2]
        x, y = self.points.places(nodes).mean(axis=0).tolist()
        return x, y

    def finer(self, limit: float) -> "CellCut | None":
        """Leave out cells through which no path is below a limit, and lay more points; None if there are too many."""
        gone = self.of_cells > limit
        for end in (self.proof.problem.start, self.proof.problem.goal):
            for cell in self.proof.cells.cells_of(end):
                gone[cell] = False
        proof = replace(self.proof, cells=self.proof.cells.without(gone), m=min(2 * self.proof.m + 1, MOST_POINTS))
        if proof.m == self.proof.m or proof.nodes(proof.m) > proof.most:
            return None
        points = bound.lay(proof.cells, proof.m, proof.walls)
        return None if points is None else CellCut(proof, points, self.lower_bound)


def over(points: Points, problem: Problem) -> Points:
    """Return the same points with the costs of another problem."""
    cells = points.cells
    costs = Arrangement.between(problem, cells.x, cells.y).without(~np.isfinite(cells.costs))
    return replace(points, cells=replace(costs, widths=cells.widths, heights=cells.heights, shape_of=cells.shape_of))


def least_greatest(pairs: IntArray, values: FloatArray, starts: list[int], goals: list[int]) -> float:
    """
    Return the least, over all chains from a start to a goal, of the greatest value on the chain.

    Parameters
    ----------
    pairs, values
        The steps, shape ``(2, n)``, and their values, shape ``(n,)``.
    starts, goals
        The ends of chains.

    Examples
    --------
    >>> least_greatest(np.array([[0, 1, 0], [1, 2, 2]]), np.array([1.0, 3.0, 4.0]), [0], [2])
    3.0
    """
    if set(starts) & set(goals):
        return -math.inf
    order, count = np.append(np.unique(values), math.inf), 1 + int(max(pairs.max(initial=0), *starts, *goals))

    def joined(value: float) -> bool:
        kept = pairs[:, values <= value]
        graph = coo_array((np.ones(kept.shape[1], dtype=np.int8), kept), shape=(count, count))
        piece = connected_components(graph, directed=False)[1]
        return not set(piece[starts].tolist()).isdisjoint(piece[goals].tolist())

    return float(order[bisect_left(order[:-1], x=True, key=joined)])


class WaysThrough:
    """
    The best paths through places under several weights, over points on the same cells.

    Parameters
    ----------
    problem
        With an `UncertainField`.
    cells
        Cells on which the cost is constant in all scenarios.
    """

    def __init__(self, problem: Problem, cells: Arrangement) -> None:
        self.problem = problem
        m = next(m for m, most in WAY_POINTS.items() if 2 * m * cells.costs.size <= most)
        self.points = Points.lay(cells, m, problem.model.area)
        self.known: list[tuple[Points, FloatArray, FloatArray]] = []

    def add(self, weighted: Problem) -> None:
        """Search under one more set of weights."""
        points = over(self.points, weighted)
        self.known.append((points, points.costs_from(weighted.start), points.costs_from(weighted.goal)))

    def halves(self, place: Point) -> tuple[list[FloatArray], list[FloatArray]]:
        """Return the best ways from the start to a place, and from there to the goal."""
        first, second = [], []
        for points, from_start, from_goal in self.known:
            back, on = points.nodes_to(from_start, place), points.nodes_to(from_goal, place)
            if len(back):
                first.append(np.vstack([self.problem.start, points.places(back[::-1]), place]))
            if len(on):
                second.append(np.vstack([place, points.places(on), self.problem.goal]))
        return first, second

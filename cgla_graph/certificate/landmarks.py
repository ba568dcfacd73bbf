"""
Proofs for any pair of points on a map: in tubes where paths may run, by bounds of the cost to a few landmarks.

The landmarks are places on the rim of the map, the same for all pairs (as in ALT: Goldberg and Harrelson, SODA 2005).

**Claim.** Let ``phi`` be a spline with ``|grad phi| <= c`` outside of the block around its landmark (`subsolution`),
and ``m`` its greatest value on this block. Let ``psi`` be ``m`` on the block and the greater of ``phi`` and ``m``
elsewhere: it is continuous, and nowhere steeper than ``c``. So each path between ``x`` and ``y`` costs at least
``|psi(x) - psi(y)|``, and a path from ``s`` to ``g`` through ``x`` at least the sum of two such differences; each may
be that of another landmark. Nothing is charged for, as differences of charged surfaces bound nothing.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from threading import Lock

import numpy as np

from cgla_graph._types import FloatArray, Point, WholeArray
from cgla_graph.certificate.certificate import Certificate, improved
from cgla_graph.certificate.costs import is_provable, proven
from cgla_graph.certificate.subsolution import Level, first_grid
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import costs_to_go, descent
from cgla_graph.eikonal.mesh import bezier_values
from cgla_graph.model.problem import Problem
from cgla_graph.refine.refine import refine_path
from cgla_graph.regions.arrangement import has_cells
from cgla_graph.regions.paths import least_path

#: How many landmarks there are.
COUNT = 16
#: The equation is solved again for a landmark while that gains more than this part of the bound.
AIM = 0.01
#: Tubes have about so many cells, on the nearest of a few grids that all of them share: cells along its longer side.
CELLS, SHARED = 12_000, (160, 256, 384)
#: A tube that many starts share counts as at least this part of the map.
LEAST_SHARE = 0.1
#: Cells along the longer side of the grid that proofs of single problems begin with, and how many of these problems
#: landmarks are laid for, at least.
COARSE, MANY = 96, 8
#: Paths are refined until finer waypoints gain less than this part of the tolerance, with so many waypoints at most.
REFINED, MOST_WAYPOINTS = 0.05, 64
#: Differences of heights are rounded by less than this part of the greatest numbers.
ROUNDING = 2.0**-46
#: Threads lay landmarks and shared grids one by one. (A lock in each `Ground` could not be pickled.)
_LAYING = Lock()


@dataclass(frozen=True, eq=False)
class Landmarks:
    """
    Heights of a map over several landmarks: their differences bound the cost between any two places.

    Attributes
    ----------
    level
        The grid; its problem is without clearance.
    low, high
        Least and greatest height on each piece of the grid, shape ``(landmarks, m)``, map units; minus and plus
        infinity where nothing is known.
    """

    level: Level
    low: FloatArray
    high: FloatArray

    @classmethod
    def lay(cls, level: Level) -> "Landmarks":
        """Solve for the heights over all landmarks that the start or goal of the problem of a grid can reach."""
        heights = [found for place in around(level.problem) if (found := _heights(level, place)) is not None]
        none = np.empty((0, 2, len(level.mesh.columns)))
        low, high = np.moveaxis(np.array(heights) if heights else none, 1, 0)
        return cls(level, low, high)

    def kept(self, starts: FloatArray, goal: Point, costs: FloatArray) -> WholeArray:
        """List the cells (`cell_runs`) through which a path from a start to a goal may cost less than its cost."""
        mesh, to_goal = self.level.mesh, self.bounds_from(goal)
        keep = np.zeros(len(to_goal), dtype=np.bool_)
        for (x, y), cost in zip(starts.tolist(), costs.tolist(), strict=True):
            keep |= ~(proven(self.level.problem, self.bounds_from((x, y)) + to_goal, surfaces=2) >= cost)
        return cell_runs.runs_of(mesh.columns[keep], mesh.rows[keep])

    def bounds_from(self, point: Point) -> FloatArray:
        """Bound the cost between a point and each piece, shape ``(m,)``, map units."""
        (at,) = self.level.mesh.pieces_at(np.array([point])).tolist()
        least = np.zeros(self.low.shape[1])
        for low, high in zip(self.low, self.high, strict=True) if at >= 0 else ():
            np.maximum(least, np.maximum(low - high[at], low[at] - high), out=least)
        return least


def around(problem: Problem) -> FloatArray:
    """
    Return places on the rim of the map, at equal distances, without those in the no-fly area, shape ``(n, 2)``.

    Examples
    --------
    >>> around(Problem((0, 0), (1, 1)))[:3].tolist()
    [[0.125, 0.0], [0.375, 0.0], [0.625, 0.0]]
    """
    x_min, y_min, x_max, y_max = problem.bounds
    corners = np.array([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max), (x_min, y_min)])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    at = (np.arange(COUNT) + 0.5) / COUNT * along[-1]
    places = np.column_stack([np.interp(at, along, corners[:, axis]) for axis in range(2)])
    return np.asarray(places[~problem.model.area.contains(places)])


def _heights(level: Level, place: FloatArray) -> FloatArray | None:
    """Return least and greatest heights over a landmark, shape ``(2, m)``; None if no way leads there."""
    goal: Point = (float(place[0]), float(place[1]))
    start = max(level.problem.start, level.problem.goal, key=lambda end: math.dist(end, goal))
    ends = tuple(level.mesh.pieces_at(np.array([start, goal])).tolist())
    problem = replace(level.problem, start=start, goal=goal)
    towards = replace(level, problem=problem, mesh=replace(level.mesh, ends=ends))
    found = towards.bound(to_goal=True, aim=AIM)
    if found is None:
        return None
    values = bezier_values(found.values, level.mesh.controls)
    both = np.stack([values.min(axis=(1, 2)), values.max(axis=(1, 2))])
    both = np.maximum(both, both[1, towards.goal_block.holds].max())
    known = np.isfinite(both).all(axis=0)
    greatest = float(np.abs(both[:, known]).max(initial=0.0))
    blur = ROUNDING * (greatest + (1.0 + problem.k) * level.mesh.farthest)
    return np.where(known, both + np.array([[-blur], [blur]]), np.array([[-math.inf], [math.inf]]))


@dataclass(frozen=True, eq=False)
class Ground:
    """
    What the surfaces to all goals on one map have in common: the grid, and the cost on its cells.

    Attributes
    ----------
    problem
        The problem whose paths are judged.
    level
        The grid; its problem is without clearance.
    piece_of
        The piece in whose middle each node is, or -1, shape ``(n,)``.
    shared
        Finer grids over all of the map, by their cells along the longer side, laid when a tube asks for them.
    """

    problem: Problem
    level: Level
    piece_of: WholeArray
    shared: dict[int, Level] = field(default_factory=dict, repr=False)

    @classmethod
    def lay(cls, problem: Problem, steps: int) -> "Ground | None":
        """Lay a grid with about so many cells along the longer side; None where no grid proves anything."""
        if not problem.field.is_proper or not is_provable(problem):
            return None
        last = first_grid(problem, steps)
        return cls._on(problem, last, cell_runs.rectangle(last))

    @classmethod
    def _on(cls, problem: Problem, last: tuple[int, int], runs: WholeArray) -> "Ground":
        level = Level.lay(problem.relaxed(), last, runs, widest=1.0)
        piece_of = np.full(level.mesh.n_nodes, -1, dtype=np.int32)
        piece_of[level.mesh.controls[:, 4]] = np.arange(len(level.mesh.controls), dtype=np.int32)
        return cls(problem, level, piece_of)

    def within(self, starts: FloatArray, goal: Point, costs: FloatArray, cells: int) -> "Ground":
        """Lay a grid of about so many cells where a path from a start to a goal may cost less than its cost."""
        kept, share = self._kept(starts, goal, costs)
        last = first_grid(self.problem, round(math.sqrt(cells / max(share, LEAST_SHARE))))
        return self._on(self.problem, last, cell_runs.refined(kept, self.level.mesh.last, last))

    def _kept(self, starts: FloatArray, goal: Point, costs: FloatArray) -> tuple[WholeArray, float]:
        """Return the cells of `Landmarks.kept`, and which part of the map they are, one cell at least."""
        with _LAYING:
            landmarks = self.landmarks
        kept, (columns, rows) = landmarks.kept(starts, goal, costs), self.level.mesh.last
        return kept, max(cell_runs.count(kept), 1) / ((columns + 1) * (rows + 1))

    @cached_property
    def landmarks(self) -> Landmarks:
        """Heights of the map, which bound the cost between any two places; laid when a tube asks for them."""
        return Landmarks.lay(self.level)

    def proof(
        self, problem: Problem, tolerance: float, path: FloatArray | None = None, *, in_tube: bool = True
    ) -> Certificate | None:
        """
        Prove how good a path of a problem on this map is; the proof may find a better one.

        Parameters
        ----------
        problem
            The problem: that of the map with other ends.
        tolerance
            As `cgla_graph.lower_bound` takes it.
        path
            A feasible path, shape ``(n, 2)``. None, or an empty one: search over cells of constant cost if there are
            any, and descend the costs-to-go of this grid if not.
        in_tube
            Whether to begin in a tube from the landmarks, which pays for many problems, but not over such cells.

        Returns
        -------
        certificate
            None where no path is known.
        """
        over_cells = has_cells(problem)
        if path is None or not len(path):
            path = least_path(problem).path if over_cells else refined(problem, self._descent(problem), tolerance)
        judged = problem.evaluate(path) if len(path) else None
        if judged is None or not judged.feasible:
            return None
        if not in_tube or over_cells:
            return improved(problem, path, tolerance)[0]
        whole, kept = self.tube(problem, judged.cost)
        return improved(problem, path, tolerance, (whole.mesh.last, kept), whole)[0]

    def tube(self, problem: Problem, cost: float) -> tuple[Level, WholeArray]:
        """
        Return a grid over all of the map, and its cells through which a path may cost less than some cost.

        Parameters
        ----------
        problem
            A problem on this map.
        cost
            Map units.

        Returns
        -------
        whole, runs
            The grid, which other problems share, and the cells (`cell_runs`).
        """
        kept, share = self._kept(np.array([problem.start]), problem.goal, np.array([cost]))
        steps = min(SHARED, key=lambda one: abs(math.log(one**2 * share / CELLS)))
        with _LAYING:
            if steps not in self.shared:
                last = first_grid(self.problem, steps)
                self.shared[steps] = Level.lay(self.level.problem, last, cell_runs.rectangle(last))
        whole = self.shared[steps]
        return whole, cell_runs.refined(kept, self.level.mesh.last, whole.mesh.last)

    def _descent(self, problem: Problem) -> FloatArray:
        """Descend the costs-to-go of a problem on this map: waypoints, shape ``(n, 2)``; empty if no way leads down."""
        mesh, level = self.level.mesh, self.level
        start, goal = mesh.pieces_at(np.array([problem.start, problem.goal])).tolist()
        radius = (level.reach + 1.5) * math.hypot(*mesh.spacing)
        times = costs_to_go(problem, mesh, problem.goal, goal, level.costs, radius=radius)
        return descent(problem, replace(mesh, ends=(start, goal)), times, radius=level.reach + 1.0)


def refined(problem: Problem, path: FloatArray, tolerance: float) -> FloatArray:
    """
    Refine a path as closely as a gap needs it, unless it is empty.

    Examples
    --------
    >>> refined(Problem((0, 0), (1, 1)), np.array([(0, 0), (0, 1), (1, 1)]), 0.01).tolist()
    [[0.0, 0.0], [1.0, 1.0]]
    """
    if not len(path):
        return path
    return refine_path(problem, path, tolerance=REFINED * tolerance, max_points=MOST_WAYPOINTS).path

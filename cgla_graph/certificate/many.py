"""
Bounds of the cost to one goal from many starts, by one surface over the whole map.

The surface is the spline of `subsolution`, on one grid without a tube. There a few steep cells and the blocks around
corners of areas lower the bound of every path by a charge each. Of many starts, each is charged only for the cells
that a path from it can meet if it costs less than a known one (`many_kernels.bounds_from`):

**Claim.** Let a path from ``x`` cost less than ``U``, and let it meet charged places of a set ``Q`` alone, whose
charges add up to ``C``. Then it costs at least ``phi(x) - C``, and from any point ``y`` on, at least ``phi(y) - C``:
the proof of `subsolution` charges a path for the places that it meets, and the rest of a path meets no more than all of
it. Up to ``y`` it costs at least the least cost of a unit of length times ``|x - y|``. So it meets no place in which
``|x - y| + phi(y) - C`` is at least ``U`` everywhere, and ``Q`` may be taken without these. This begins with all
places. In the end, every path costs at least the lesser of ``U`` and ``phi(x) - C``.

**Steep cells.** Each is charged by its own steepness ``s``: by ``1 - 1 / s`` times the change of ``phi`` on it. Take
the steepest cell that a path meets, and the part of the path between its first entry at ``a`` and its last exit at
``b``. Outside of blocks it costs at least ``(phi(a) - phi(b)) / s``, as nothing is steeper. Go on with the rest of the
path and the next cell, whose steepness is ``t``. The part between its first entry and its last exit may hold parts that
were taken before. Such a part, with a fall of ``d`` and a charge of ``q``, costs at least ``max(0, d - q) >= d / t -
q``, and the others cost at least their fall over ``t``; so the charges before are paid once, and this cell's is as
said. It is the same for the blocks around corners.

The cost is lowered where the spline is too steep, and the surface solved again: three times at most.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from cgla_graph._types import BoolArray, FloatArray, Point, WholeArray
from cgla_graph.certificate import certificate_kernels, many_kernels
from cgla_graph.certificate.corners import CornerBlock, corners_of, links_of
from cgla_graph.certificate.costs import least_scale, needed_for, proven
from cgla_graph.certificate.landmarks import Ground
from cgla_graph.certificate.subsolution import ROUNDING, Block, Level, Subsolution
from cgla_graph.certificate.through import costs_to_end, in_corner
from cgla_graph.eikonal.marching import MOST_STEPS, around_corners, costs_to_go, descent
from cgla_graph.eikonal.marching_kernels import spline_value
from cgla_graph.eikonal.mesh import NO_CELL, bezier_values

#: Times that a surface is solved, at most.
MOST_SOLVES = 3
#: Steep cells are charged in squares of so many cells along each side.
SQUARE = 8
#: A descent is thinned out by this part of a spacing.
THINNED = 0.05
#: Corners within so many spacings of a descent are those that it may be led around.
BESIDE = 4.0
#: A descent that crosses areas is led around them from so many waypoints before to so many after.
LED = 6


@dataclass(eq=False)
class _Solved:
    """
    One surface: control values, and what it is charged for.

    Attributes
    ----------
    values
        Control values, shape ``(n + 1,)``, map units.
    excess
        By how much they are above the cost to the goal, somewhere on the rim of its block.
    boxes, lowest, charges
        The places that are charged for, as `many_kernels.bounds_from` takes them.
    """

    values: FloatArray
    excess: float
    boxes: FloatArray
    lowest: FloatArray
    charges: FloatArray


@dataclass(eq=False)
class GoalSurface:
    """
    Surfaces that bound the cost to one goal from everywhere.

    Attributes
    ----------
    ground
        The grid.
    goal
        The goal.
    block
        The cells around it in which the surfaces bound nothing.
    corners
        Blocks around corners of areas.
    solved
        The surfaces so far.
    """

    ground: Ground
    goal: Point
    level: Level
    block: Block
    corners: Sequence[CornerBlock]
    costs: FloatArray
    solved: list[_Solved] = field(default_factory=list)

    @classmethod
    def towards(cls, ground: Ground, goal: Point, farthest: Point, worth: float) -> "GoalSurface":
        """
        Prepare the surfaces to a goal.

        Parameters
        ----------
        ground
            The grid.
        goal
            The goal.
        farthest
            The start that is farthest away.
        worth
            A finer grid is laid around the goal where more than this would be lost there, map units.
        """
        closed = replace(ground.level.problem, start=farthest, goal=goal)
        level = replace(ground.level, problem=closed, worth=worth)
        block = level.goal_block
        found, _ = corners_of(closed, level.mesh, level.reach, [(*block.centre, block.reach)])
        return cls(ground, goal, level, block, found, level.costs.copy())

    @property
    def n_solves(self) -> int:
        """How many times the surface was solved."""
        return len(self.solved)

    def solve(self) -> bool:
        """Solve the equation, with lower costs where the last surface is too steep; return whether this one is."""
        mesh, block, level = self.level.mesh, self.block, self.level
        steep = np.empty(len(mesh.columns))
        piece = int(mesh.pieces_at(np.array([self.goal]))[0])
        radius = (block.reach + 1.5) * math.hypot(*mesh.spacing)
        near = np.hypot(*(mesh.node_points - self.goal).T) <= radius
        times = costs_to_go(
            level.problem,
            mesh,
            self.goal,
            piece,
            self.costs,
            radius=radius,
            start_factor=float((self.costs[near] / level.costs[near]).min()),
            first=lambda points: np.where(block.is_around(level, points), block.costs(points), math.inf),
            links=links_of(mesh, self.corners),
        )
        charges = [corner.charge(times, mesh) for corner in self.corners]
        kept = [number for number, one in enumerate(charges) if one < math.inf]
        self.corners, charges = [self.corners[n] for n in kept], [charges[n] for n in kept]
        checked = mesh.matters & ~block.holds
        for corner in self.corners:
            checked[corner.pieces] = False
        steepest = certificate_kernels.steepness(times, mesh.kernel_mesh, mesh.outlines, checked, level.bounds, steep)
        self.solved.append(self._charged(times, steep, charges))
        certificate_kernels.soften(steep, mesh.controls, np.zeros(len(steep)), self.costs)
        return steepest > 1.0

    def _charged(self, times: FloatArray, steep: FloatArray, charges: Sequence[float]) -> _Solved:
        """Find the places that a surface is charged for: squares with steep cells, and blocks around corners."""
        mesh = self.level.mesh
        above = np.flatnonzero(steep > 1.0)
        values = bezier_values(times, mesh.controls[above])
        low, high = values.min(axis=(1, 2)), values.max(axis=(1, 2))
        # (a cell that is reached in part may be anything)
        known = np.isfinite(values).all(axis=(1, 2)) & np.isfinite(steep[above])
        charge = np.full(len(above), math.inf)
        charge[known] = (1.0 - 1.0 / steep[above][known]) * (high[known] - low[known]) * (1.0 + ROUNDING)
        wide = mesh.last[0] // SQUARE + 1
        places = mesh.rows[above].astype(np.int64) // SQUARE * wide + mesh.columns[above] // SQUARE
        squares, square = np.unique(places, return_inverse=True)
        count = len(squares)
        boxes, lowest = np.empty((count + len(charges), 4)), np.full(count + len(charges), math.inf)
        cells = np.column_stack([mesh.columns[above], mesh.rows[above]])
        boxes[:, :2], boxes[:, 2:] = math.inf, -math.inf
        np.minimum.at(boxes[:, :2], square, cells - 0.5)
        np.maximum.at(boxes[:, 2:], square, cells + 0.5)
        np.minimum.at(lowest, square, low)
        every = np.concatenate([np.bincount(square, charge, count), charges])
        for number, corner in enumerate(self.corners, start=count):
            inside = np.column_stack([mesh.columns[corner.pieces], mesh.rows[corner.pieces]])
            boxes[number] = *(inside.min(axis=0) - 0.5), *(inside.max(axis=0) + 0.5)
            lowest[number] = corner.least(times, mesh)
        boxes = np.tile(mesh.origin, 2) + boxes * np.tile(mesh.spacing, 2)
        # (coordinates are rounded by some ulps)
        blur = 2.0**-48 * mesh.farthest
        boxes[:, :2] -= blur
        boxes[:, 2:] += blur
        return _Solved(times, self.block.excess(self.level, times), boxes, lowest, every)

    def states(self, points: FloatArray) -> tuple[BoolArray, BoolArray]:
        """
        Tell which points the surfaces say nothing about, and from which no way leads to the goal.

        Parameters
        ----------
        points
            Shape ``(n, 2)``, map units.

        Returns
        -------
        silent
            Whether it is in the block of the goal, or on no cell: a proof of its own is needed; shape ``(n,)``.
        apart
            Whether there is no path from there, as the last surface proves; shape ``(n,)``.
        """
        mesh = self.level.mesh
        pieces = mesh.pieces_at(points)
        silent = (pieces < 0) | self.block.holds[pieces]
        return silent, (pieces >= 0) & np.isinf(self.solved[-1].values[mesh.controls[pieces]]).all(axis=1)

    def paths(self, starts: FloatArray) -> Iterator[FloatArray]:
        """
        Follow the first surface, whose cost is not lowered, down from points to the goal.

        Parameters
        ----------
        starts
            Shape ``(n, 2)``, map units.

        Yields
        ------
        path
            Waypoints, shape ``(m, 2)``, map units; empty if none is found. It need not be feasible.
        """
        mesh, values = self.level.mesh, self.solved[0].values
        room = np.empty((min(2 * len(mesh.controls), MOST_STEPS), 2))
        pieces = mesh.pieces_at(starts)
        reached = (pieces >= 0) & np.isfinite(values[mesh.controls[pieces]]).all(axis=1)
        for start, piece, can in zip(starts.tolist(), pieces.tolist(), reached.tolist(), strict=True):
            yield self._path((start[0], start[1]), piece, values, room) if can else np.empty((0, 2))

    def _path(self, start: Point, piece: int, values: FloatArray, room: FloatArray) -> FloatArray:
        """Follow a surface down from a point on a piece."""
        mesh, problem = self.level.mesh, self.level.problem
        origin, spacing = np.array(mesh.origin), np.array(mesh.spacing)
        first, end = ((np.array(point) - origin) / spacing for point in (start, self.goal))
        pieces = (mesh.controls, mesh.columns, mesh.rows, self.ground.piece_of)
        ends = (first[0], first[1]), piece, (end[0], end[1]), self.level.reach + 1.0
        count = many_kernels.follow(*ends, mesh.last, values, pieces, room)
        if count < 0:
            asked = replace(problem, start=start)
            return descent(asked, replace(mesh, ends=(piece, NO_CELL)), values, radius=self.level.reach + 1.0)
        # rounding may put a point on the rim of the map just outside
        inside = np.clip(origin + spacing * room[1:count], origin, problem.bounds[2:])
        path = np.vstack([start, inside, self.goal])
        tolerance = THINNED * min(mesh.spacing)
        thin = shapely.get_coordinates(shapely.simplify(shapely.LineString(path), tolerance, preserve_topology=False))
        area = self.ground.problem.model.area
        crossed = np.flatnonzero(area.crosses(thin[:-1], thin[1:]))
        if not len(crossed):
            return np.asarray(thin)
        if not area.crosses(path[:-1], path[1:]).any():
            return path
        # (the part that crosses areas is led around them if it can be, or else the whole)
        free = np.flatnonzero(~area.contains(thin))
        first = int(free[free <= max(int(crossed[0]) - LED, 0)].max(initial=0))
        last = int(free[free >= min(int(crossed[-1]) + 1 + LED, len(thin) - 1)].min(initial=len(thin) - 1))
        for one, other in dict.fromkeys([(first, last), (0, len(thin) - 1)]):
            led = around_corners(self.ground.problem, thin[one : other + 1], BESIDE * max(spacing))
            if len(led):
                return np.vstack([thin[:one], led, thin[other + 1 :]])
        return np.empty((0, 2))

    def bounds(self, points: FloatArray, costs: FloatArray) -> FloatArray:
        """
        Bound the cost of all paths from points to the goal, by the last surface.

        Parameters
        ----------
        points
            Shape ``(n, 2)``, map units.
        costs
            Of a known path from each point, or any number: no bound is above it; shape ``(n,)``.

        Returns
        -------
        bounds
            Shape ``(n,)``, map units; 0 where nothing is proven.
        """
        least, one = least_scale(self.level.problem), self.solved[-1]
        best = np.zeros(len(points))
        (known,) = np.nonzero(~self.states(points)[0])
        pieces = self.level.mesh.pieces_at(points[known])
        if math.isfinite(one.excess):
            heights, found = self._heights(one, pieces, points[known]) - one.excess, np.empty(len(known))
            places = one.boxes, one.lowest - one.excess, one.charges
            many_kernels.bounds_from(points[known], heights, costs[known], least, *places, found)
            best[known] = found
        best = proven(self.level.problem, best)
        return np.maximum(np.minimum(best, costs), 0.0)

    def _heights(self, one: _Solved, pieces: WholeArray, points: FloatArray) -> FloatArray:
        """Return a surface at points; inside the block of a corner, its bound on the whole piece."""
        mesh = self.level.mesh
        at = (points - np.array(mesh.origin)) / np.array(mesh.spacing)
        heights = np.empty(len(points))
        for n, piece in enumerate(pieces.tolist()):
            u, v = at[n, 0] - int(mesh.columns[piece]), at[n, 1] - int(mesh.rows[piece])
            heights[n] = spline_value(mesh.controls[piece], u, v, one.values)
        for corner in self.corners:
            inside = np.isin(pieces, corner.pieces)
            if inside.any():
                of_piece = dict(zip(corner.pieces.tolist(), in_corner(self.level, corner, one.values), strict=True))
                heights[inside] = [of_piece[piece] for piece in pieces[inside].tolist()]
        return heights

    def heights(self) -> FloatArray:
        """
        Bound the last surface from below on each piece of the grid, shape ``(m,)``, map units, before charges.

        It is infinite where no way leads to the goal, and minus infinity where nothing is known.
        """
        mesh, one = self.level.mesh, self.solved[-1]
        least = costs_to_end(self.level, Subsolution(0.0, one.values - one.excess, self.corners), self.block)
        reached = np.isfinite(one.values[mesh.controls])
        odd = reached.any(axis=1) & ~reached.all(axis=1) & ~self.block.holds
        odd[[*(piece for corner in self.corners for piece in corner.pieces.tolist())]] = False
        return np.where(odd, -math.inf, least)

    def may_cost_less(self, heights: FloatArray, cost: float) -> BoolArray:
        """
        Tell from which pieces of the grid a path to the goal may cost less than some cost: shape ``(m,)``.

        Parameters
        ----------
        heights
            As `heights` returns them.
        cost
            Map units.
        """
        mesh, one = self.level.mesh, self.solved[-1]
        least, half = least_scale(self.level.problem), 0.5 * math.hypot(*mesh.spacing)
        limit = needed_for(self.level.problem, cost) * (1.0 + ROUNDING)
        (near,) = np.nonzero(~(heights >= limit + one.charges.sum()))
        found = np.empty(len(near))
        middles = mesh.node_points[mesh.controls[near, 4]]
        # (no point of a piece is further from its middle)
        places = one.boxes, one.lowest - one.excess - least * half * (1.0 + ROUNDING), one.charges
        many_kernels.bounds_from(middles, heights[near], np.full(len(near), limit), least, *places, found)
        may = np.zeros(len(heights), dtype=np.bool_)
        may[near] = ~(found >= limit)
        return may

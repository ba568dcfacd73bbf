"""
Blocks of cells around corners of no-fly areas, where no spline follows the costs-to-go.

Behind a corner paths fan out, and costs-to-go bend like one over the distance to it: a spline is too steep there, by
first order in the spacing. So the inequality of `subsolution` is not required in a block around the corner. A path
that first enters it at ``a`` and leaves it for the last time at ``b`` costs at least ``D(a, b)`` in between, and the
bound is lowered by the greatest ``phi(a) - phi(b) - D(a, b)`` of all pairs on the rim, the charge of the block. As with
cells that stay too steep, there is one charge a block: after ``b``, the path does not meet it again.

**The least cost between two points.** On the disc ``|x| <= R`` around the corner let ``c >= c_q = c_l - H |x|^2 / 2``
with ``c_l = c_0 + g . x``, let ``L > 0`` be at most ``c_q``, and ``G`` at least its slope. Follow a path inside the
disc, from ``b`` on, and unroll a string: a polyline ``P`` from ``b`` to the current point of the path, which gets a
new bend, at a corner of an area, when its last part would meet the area. While the length ``l`` of the string keeps
``gamma l^2 <= L``, where ``gamma = G^2 / (4 L)``, the number ``f = int_P c_q - gamma l^3 / 3`` rises by at most ``c`` a
unit of length: the part of its gradient along the string is ``c_q - gamma l^2``, the other is at most ``l G / 2``, and
a new bend changes nothing. The string is never longer than the path. So

- a path to ``a`` that is no longer than ``l_1`` costs at least ``int_P c_q - gamma l_1^3 / 3`` for such a polyline. It
  is straight only where a straight line crosses no area, and its bends are at corners of areas. The same is true of
  ``c_l`` with no areas around: all of ``P``, or all between its first bend and its last, may be replaced by a straight
  line, for another ``gamma l_1^3 / 3``. And ``c_q`` is less than ``c_l`` by at most ``H m^2 / 2`` where ``m = (|a| +
  |b| + l_1) / 2``: no such path gets farther away from the corner;
- a longer path costs at least ``L l_1``. With ``l_1 = l_0 C / L``, where ``C`` is at least ``c_l`` between points of
  the block, this is no less than ``C l_0``;
- a path that leaves the disc costs at least ``L (2 R - |a| - |b|)``, which is more, if ``R`` is large enough.

``D`` is the least of these: with ``l_0 = |a - b|`` for the straight line; and where that crosses a wall, with ``l_0 =
|a| + |b|`` and some more, over the cheapest one or two bends in sight of ``a`` and of ``b``.

**The front** is led around the corner as well: it does not pass between nodes with a wall in between, and a node in
sight of the corner reaches all others in its sight by way of the corner.

**Where the cost changes too much** for that, a finer grid bounds the cost of paths (`finer`).
"""

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, FloatArray, WholeArray
from cgla_graph.certificate import corner_kernels
from cgla_graph.certificate.costs import scale_at
from cgla_graph.certificate.tips import bounds_on_disc
from cgla_graph.eikonal.marching import Links, Sight, bends_of, straight_costs
from cgla_graph.eikonal.mesh import NO_CELL, SHARP, MeshPart, SplineMesh, angles_of, places_in
from cgla_graph.model.problem import Problem

#: Cells from the middle of a block to its rim, at least; walls and corners of areas that a block takes into account,
#: at most.
LEAST_REACH, MOST_WALLS, MOST_VERTICES = 3, 32, 8
#: Cells between the rims of two blocks, at least; between the known path and a block, at most.
APART, NEAR_PATH = 2, 16
#: Blocks on a grid, at most; an area of more edges has none.
MOST_BLOCKS, MOST_EDGES = 200, 20_000
#: The greatest cost of a block over the least: where the ratio is greater, there is no block. The disc on which the
#: cost is bounded is `DISC` times as wide as the rim.
MOST_RATIO = 1.5
DISC = 1.0 + MOST_RATIO
#: Layers of nodes behind walls that a spline in front of them depends on.
LAYERS = 2
#: Corners at least so many cells from the rim are inside.
INSIDE = 2.5
#: In spacings times the cost: about how much a block saves for each radian that paths turn, and how much is lost beside
#: a block whose rim is a cell away.
SAVED, LOST_BESIDE = 0.45, 0.3
#: Charges below this, in spacings times the cost, count as equal; walls are this many sub-cells inside their areas.
LEAST_CHARGE, DEEP = 0.01, 2.0
#: Rounding of a charge, relative to the values.
ROUNDING = 2.0**-44
#: Marks a joint in `CornerBlock.cuts`, where 0 to 3 are the sides of a node.
JOINT = 4


@dataclass(frozen=True, eq=False)
class CornerBlock(ABC):
    """
    A block of cells around a corner.

    Attributes
    ----------
    pieces
        The pieces of the mesh inside, shape ``(m,)``.
    cuts
        Nodes and sides on which they have no neighbour, because a wall is between, shape ``(t, 2)``; and the joints
        inside, with the side `JOINT`: they may lead to nodes that stand for the other side of a wall.
    sights
        Nodes in sight of each corner inside.
    rim, places
        Parts of the rim: their pieces, and where they begin and end, in spacings from the middle of the cell, shapes
        ``(s,)`` and ``(s, 4)``.
    """

    pieces: WholeArray
    cuts: WholeArray
    sights: Sequence[Sight]
    rim: WholeArray
    places: FloatArray

    @abstractmethod
    def charge(self, values: FloatArray, mesh: SplineMesh) -> float:
        """Return by how much a bound from a spline has to be lowered for this block; infinity if it does not pay."""

    def least(self, values: FloatArray, mesh: SplineMesh) -> float:
        """Bound a spline from below on the rim."""
        return float(values[mesh.controls[self.rim]].min())


@dataclass(frozen=True, eq=False)
class Corner(CornerBlock):
    """
    A block where the cost changes little; coordinates are relative to the corner, map units.

    Attributes
    ----------
    lines
        Where the parts of the rim begin and end, shape ``(s, 4)``.
    vertices
        Corners of areas that paths may bend around, shape ``(v, 2)``.
    walls
        Lines inside areas, shape ``(w, 4)``.
    numbers
        Bounds of the cost (`corner_kernels`).
    turn
        By how much paths may have to turn in it, rad.
    spacing
        The smaller step of the grid.
    """

    lines: FloatArray
    vertices: FloatArray
    walls: FloatArray
    numbers: FloatArray
    turn: float
    spacing: float

    @property
    def worth(self) -> float:
        """About how much the block saves, map units: with a greater charge, it does not pay."""
        return SAVED * self.turn * self.spacing * float(self.numbers[corner_kernels.COST])

    def charge(self, values: FloatArray, mesh: SplineMesh) -> float:
        """Return by how much a bound from a spline has to be lowered for this block; infinity if more than `worth`."""
        curves = np.empty((len(self.rim), 3))
        corner_kernels.curves(self.places, self.rim, mesh.controls, values, curves)
        reached = np.isfinite(curves).all(axis=1)
        curves[~reached] = math.inf
        least = LEAST_CHARGE * self.spacing * float(self.numbers[corner_kernels.COST])
        found = corner_kernels.charge(self.lines, curves, self.vertices, self.walls, self.numbers, least, self.worth)
        # coordinates are rounded by some ulps
        size = np.abs(curves[reached]).max(initial=0.0) + mesh.farthest * self.numbers[corner_kernels.MOST]
        return float(found + ROUNDING * size)


class BendingPath(NamedTuple):
    """A path around whose bends a block is laid where the bound would lose more than `worth`, map units."""

    path: shapely.LineString
    worth: float


class SteepCorner(NamedTuple):
    """
    A corner where the cost changes too much for a `Corner`.

    `block` holds the pieces within `reach` cells of the middle of the cell `centre`, cuts and sights; the block does
    not pay if its charge is more than `worth`, map units.
    """

    block: tuple[WholeArray, WholeArray, Sequence[Sight]]
    centre: tuple[int, int]
    reach: int
    worth: float


@cache
def load_kernels() -> None:
    """
    Compile or load the kernels, once in a process.

    Examples
    --------
    >>> load_kernels()
    """
    line, curve, numbers = np.zeros((1, 4)), np.zeros((1, 3)), np.ones(8)
    corner_kernels.curves(line, np.zeros(1, dtype=np.int32), np.zeros((1, 9), dtype=np.int32), np.zeros(1), curve)
    corner_kernels.charge(line, curve, line[:, :2], line, numbers, 0.0, 0.0)
    corner_kernels.bent(0.0, 0.0, numbers)


def links_of(mesh: SplineMesh, corners: Sequence[CornerBlock]) -> Links:
    """Return the links of nodes with which a front is led around some corners."""
    neighbours, (first, one, other, lengths) = mesh.neighbours, mesh.joints
    if corners:
        neighbours, lengths = neighbours.copy(), lengths.copy()
        nodes, sides = np.concatenate([corner.cuts for corner in corners]).T
        beside = sides != JOINT
        neighbours[nodes[beside], sides[beside]] = mesh.n_nodes
        lengths[nodes[~beside]] = math.inf
    sights = [sight for corner in corners for sight in corner.sights]
    return Links(neighbours, (first, one, other, lengths), bends_of(sights, mesh.n_nodes))


def corners_of(
    problem: Problem,
    mesh: SplineMesh,
    reach: int,
    taken: Sequence[tuple[int, int, int]],
    bent: BendingPath | None = None,
    of_whole: "tuple[WholeCorners, MeshPart] | None" = None,
) -> tuple[list[Corner], list[SteepCorner]]:
    """
    Lay blocks around the sharp corners of an area, where they pay.

    Parameters
    ----------
    problem
        The problem.
    mesh
        Of the grid.
    reach
        Cells from the middle of a block to its rim, at most.
    taken
        Columns and rows in the middle of other blocks, and their reach; no block may touch them.
    bent
        A path: around its bends, blocks are laid where the cost is steep too, and none far from it. None: no such
        blocks, and others everywhere.
    of_whole
        Blocks that are laid already on a mesh of which this one is a part; None: none are.

    Returns
    -------
    found
        Blocks that are ready to use.
    steep
        Blocks that still need a finer grid (`finer`).
    """
    edges = problem.model.area.edges
    if not 0 < len(edges) <= MOST_EDGES:
        return [], []
    sharp = sharp_corners(edges)
    grid = _Grid(problem, mesh, *corners_that_stick_out(edges), bent)
    lay = grid.lay if of_whole is None else partial(of_whole[0].part, of_whole[1])
    found: list[Corner] = []
    steep: list[SteepCorner] = []
    centres = list(taken)
    # (far corners are no whole numbers of cells)
    places = np.rint((sharp - mesh.origin) / mesh.spacing)
    inside = np.flatnonzero(np.minimum(places, mesh.last - places).min(axis=1) > LEAST_REACH)
    inside = inside[mesh.pieces_at(sharp[inside]) != NO_CELL]
    if bent is not None:
        # each block is charged for, also where no good path comes
        beside = (reach + NEAR_PATH) * math.hypot(*mesh.spacing)
        inside = inside[shapely.dwithin(bent.path, shapely.points(sharp[inside]), beside)]
    for corner, (column, row) in zip(sharp[inside], places[inside].astype(np.int64).tolist(), strict=True):
        beside = min((max(abs(column - i), abs(row - j)) - other for i, j, other in centres), default=math.inf)
        room = min(beside - APART, column - 1, row - 1, mesh.last[0] - column - 1, mesh.last[1] - row - 1)
        if (laid := lay(corner, (column, row), int(min(reach, room)))) is not None:
            found.append(laid[0])
            centres.append((column, row, laid[1]))
        elif room >= LEAST_REACH and (left := grid.steep(corner, (column, row), int(room))) is not None:
            steep.append(left)
            centres.append((column, row, left.reach))
        if len(found) + len(steep) == MOST_BLOCKS:
            break
    return found, steep


def sharp_corners(edges: FloatArray) -> FloatArray:
    """List the corners of an area around which there may be blocks, shape ``(n, 2)``."""
    angles = angles_of(edges)
    return np.unique(edges[(angles > 0.0) & (angles < math.pi - SHARP), :2], axis=0)


def corners_that_stick_out(edges: FloatArray) -> tuple[FloatArray, WholeArray | FloatArray]:
    """List the corners that paths may bend around, shape ``(n, 2)``, and by how much, rad."""
    angles = angles_of(edges)
    convex, which = np.unique(edges[angles >= 0.0, :2], axis=0, return_inverse=True)
    return convex, np.bincount(which, weights=math.pi - angles[angles >= 0.0])


@dataclass(frozen=True, eq=False)
class _Grid:
    """A grid on which blocks are laid, and the corners of the area."""

    problem: Problem
    mesh: SplineMesh
    convex: FloatArray
    turns: WholeArray | FloatArray
    bent: BendingPath | None

    @cached_property
    def bends(self) -> BoolArray:
        """Whether the path bends around each of the corners that stick out."""
        if self.bent is None:
            return np.zeros(len(self.convex), dtype=np.bool_)
        return np.asarray(
            shapely.distance(shapely.points(self.convex), self.bent.path) <= math.hypot(*self.mesh.spacing)
        )

    def rim(self, reach: int) -> float:
        """Bound how far the rim of a block is from its corner, map units."""
        return (reach + 1) * math.hypot(*self.mesh.spacing)

    def pieces_around(self, centre: tuple[int, int], reach: int) -> tuple[WholeArray, WholeArray]:
        """List the pieces of the cells within reach, and how many cells they are away."""
        rows = np.arange(centre[1] - reach, centre[1] + reach + 1, dtype=np.int64) * (self.mesh.last[0] + 3) + centre[0]
        first, last = (np.searchsorted(self.mesh.keys, rows + off) for off in (-reach, reach + 1))
        found = np.concatenate([np.arange(*pair) for pair in zip(first, last, strict=True)])
        columns, lines = self.mesh.columns[found] - centre[0], self.mesh.rows[found] - centre[1]
        return found, np.maximum(np.abs(columns), np.abs(lines))

    def lay(self, corner: FloatArray, centre: tuple[int, int], most: int) -> tuple[Corner, int] | None:
        """Lay the block around a corner that pays most, if any does; return it and its reach."""
        chosen = self.choose(corner, centre, most)
        if chosen is None:
            return None
        reach, numbers, turn = chosen
        mesh, disc = self.mesh, DISC * self.rim(reach)
        around, away = self.pieces_around(centre, reach + 1)
        on_rim = around[(away == reach) & mesh.matters[around]]
        vertices = self.convex[np.hypot(*(self.convex - corner).T) <= disc]
        if not len(on_rim) or len(vertices) > MOST_VERTICES:
            return None
        rim, places = rim_of(mesh, on_rim, centre, reach)
        middles = np.tile(np.column_stack([mesh.columns[rim], mesh.rows[rim]]), 2)
        lines = np.tile(mesh.origin - corner, 2) + np.tile(mesh.spacing, 2) * (middles + places)
        walls = walls_inside(self.problem.model.area.geometry, corner, disc, DEEP * max(mesh.spacing) / mesh.parts)
        pieces, cuts, sights = self.block(centre, reach, vertices, 0.5 * disc)
        facts = vertices - corner, walls, numbers, turn, min(mesh.spacing)
        return Corner(pieces, cuts, sights, rim, places, lines, *facts), reach

    def steep(self, corner: FloatArray, centre: tuple[int, int], room: int) -> SteepCorner | None:
        """
        Lay the smallest block around a corner that a path bends around, if the bound loses enough there.

        Other bends so near that there is no room for a block of their own share this one.
        """
        if self.bent is None or not self.bends[(self.convex == corner).all(axis=1)].any():
            return None
        cells = np.abs((self.convex - self.mesh.origin) / self.mesh.spacing - centre).max(axis=1)
        close = cells[self.bends & (cells > LEAST_REACH - INSIDE) & (cells < 2 * LEAST_REACH + APART)]
        reach = min(math.ceil(close.max(initial=0.0) + INSIDE), room) if len(close) else LEAST_REACH
        inside = cells <= reach - INSIDE
        turn = min(float(self.turns[inside & self.bends].sum()), turn_of(self.bent.path, corner, self.rim(reach)))
        cost = 1.0 + self.problem.k * float(self.problem.field.density(corner[None])[0])
        lost = SAVED * turn * min(self.mesh.spacing) * cost
        if not lost > self.bent.worth:
            return None
        block = self.block(centre, reach, self.convex[inside], self.rim(reach))
        return SteepCorner(block, centre, reach, lost)

    def block(
        self, centre: tuple[int, int], reach: int, vertices: FloatArray, radius: float
    ) -> tuple[WholeArray, WholeArray, list[Sight]]:
        """Return pieces, cuts and sights of a block; nodes within the radius of a corner inside may be in its sight."""
        mesh = self.mesh
        around, away = self.pieces_around(centre, reach + 1)
        nodes = np.unique(mesh.controls[around])
        points = self.mesh.node_points[nodes]
        proper = np.isin(nodes, proper_nodes(mesh, around)) & ~self.problem.model.area.crosses(points, points)
        sights = [
            self.in_sight(vertex, around, nodes, proper, radius)
            for vertex in vertices
            if (np.abs((vertex - mesh.origin) / mesh.spacing - centre) <= reach - INSIDE).all()
        ]
        far = np.abs(np.column_stack([mesh.node_columns[nodes], mesh.node_rows[nodes]]) - centre).max(axis=1)
        # (all nodes that no piece outside has: meshes do not resolve the tip of a needle, and fronts would pass it)
        cuts = np.concatenate([self.behind_walls(nodes[far < reach]), self.cut_joints(nodes)])
        return around[away <= reach], cuts, sights

    def choose(self, corner: FloatArray, centre: tuple[int, int], most: int) -> tuple[int, FloatArray, float] | None:
        """Choose the reach with the least loss; return it, the bounds of the cost, and the turn."""
        spacing = min(self.mesh.spacing)
        away = np.hypot(*(self.convex - corner).T)
        cells = np.abs((self.convex - self.mesh.origin) / self.mesh.spacing - centre).max(axis=1)
        best: tuple[int, FloatArray, float] | None = None
        least = math.inf
        for reach in range(LEAST_REACH, most + 1):
            rim, inside = self.rim(reach), cells <= reach - INSIDE
            numbers = cost_around(self.problem, corner, rim, 2.0 * float(away[inside].max(initial=0.0)))
            if numbers is None:
                continue
            off, cost = 2.0 * rim + numbers[corner_kernels.SPAN], spacing * float(numbers[corner_kernels.COST])
            turn, beside = (float(self.turns[some].sum()) for some in (inside, (cells < reach + 2.0) & ~inside))
            lost = corner_kernels.bent(off, off, numbers) + (LOST_BESIDE / reach + SAVED * beside) * cost
            if lost < min(least, SAVED * turn * cost):
                best, least = (reach, numbers, turn), lost
        return best

    def in_sight(
        self, vertex: FloatArray, pieces: WholeArray, nodes: WholeArray, proper: BoolArray, radius: float
    ) -> Sight:
        """
        Choose the nodes of some pieces in sight of a corner of an area, and compute the costs of the straight lines.

        Nodes of pieces behind walls are reached as well, so that a spline follows the fan up to the walls. But no path
        comes from these nodes, as they have no values there.
        """
        mesh, area = self.mesh, self.problem.model.area
        points = self.mesh.node_points[nodes]
        close = np.hypot(*(points - vertex).T) <= radius
        seen = close & proper & ~area.crosses(points, np.broadcast_to(vertex, points.shape))
        behind = seen
        for _ in range(LAYERS):
            beside = pieces[np.isin(mesh.controls[pieces, 4], nodes[behind])]
            behind = behind | (close & ~proper & np.isin(nodes, mesh.controls[beside]))
        at = points[behind]
        return Sight(nodes[behind], straight_costs(self.problem, at, vertex) * scale_at(self.problem, at), seen[behind])

    def cut_joints(self, nodes: WholeArray) -> WholeArray:
        """List the joints of some nodes as cuts."""
        _, one, other, _ = self.mesh.joints
        joints = np.flatnonzero(np.isin(one, nodes) | np.isin(other, nodes))
        return np.column_stack([joints, np.full(len(joints), JOINT)])

    def behind_walls(self, nodes: WholeArray) -> WholeArray:
        """List nodes and sides whose neighbour is behind a wall, and these neighbours and their sides."""
        neighbours, n = self.mesh.neighbours, self.mesh.n_nodes
        found = [np.empty((0, 2), dtype=np.int64)]
        for side, opposite in enumerate((1, 0, 3, 2)):
            first = nodes[neighbours[nodes, side] < n].astype(np.int64)
            second = neighbours[first, side].astype(np.int64)
            behind = self.problem.model.area.crosses(self.mesh.node_points[first], self.mesh.node_points[second])
            mutual = behind & (neighbours[second, opposite] == first)
            found.append(np.column_stack([first[behind], np.full(int(behind.sum()), side)]))
            found.append(np.column_stack([second[mutual], np.full(int(mutual.sum()), opposite)]))
        return np.concatenate(found)


def turn_of(path: shapely.LineString, point: FloatArray, radius: float) -> float:
    """
    Return by how much a path turns on a disc, left and right, rad.

    Examples
    --------
    >>> path = shapely.LineString([(0, 0), (2, 0), (2, 3), (9, 3)])
    >>> turn_of(path, np.array([2.0, 0.0]), radius=1.0) / math.pi
    0.5
    """
    inside = shapely.get_parts(path.intersection(shapely.Point(point).buffer(radius)))
    steps = [np.diff(shapely.get_coordinates(one), axis=0) for one in inside]
    return float(sum(np.abs(np.diff(np.unwrap(np.arctan2(*step.T)))).sum() for step in steps))


class WholeCorners:
    """
    Blocks around corners on a mesh of the whole map, laid once for all of its parts.

    Parameters
    ----------
    problem
        A problem on the map.
    mesh
        The mesh.
    """

    def __init__(self, problem: Problem, mesh: SplineMesh) -> None:
        self.grid = _Grid(problem, mesh, *corners_that_stick_out(problem.model.area.edges), None)
        self.laid: dict[tuple[float, float, int], tuple[Corner, int] | None] = {}

    def part(self, part: MeshPart, corner: FloatArray, centre: tuple[int, int], most: int) -> tuple[Corner, int] | None:
        """Lay a block as `_Grid.lay` does, on a part of the mesh."""
        key = float(corner[0]), float(corner[1]), most
        if key not in self.laid:
            self.laid[key] = self.grid.lay(corner, centre, most)
        laid = self.laid[key]
        if laid is None:
            return None
        block = laid[0]
        pieces, rim = places_in(part.pieces, block.pieces), places_in(part.pieces, block.rim)
        on_rim = (rim >= 0) & part.mesh.matters[rim]
        if not on_rim.any():
            return None
        numbers, sides = block.cuts.T
        cut = np.where(sides == JOINT, places_in(part.joints, numbers), places_in(part.nodes, numbers))
        return replace(
            block,
            pieces=pieces[pieces >= 0],
            cuts=np.column_stack([cut, sides])[cut >= 0],
            sights=[sight.part(part.nodes) for sight in block.sights],
            rim=rim[on_rim].astype(block.rim.dtype),
            places=block.places[on_rim],
            lines=block.lines[on_rim],
        ), laid[1]


def proper_nodes(mesh: SplineMesh, pieces: WholeArray) -> WholeArray:
    """List the nodes in the middle of pieces that are free there."""
    free = [mesh.free_parts(int(piece)) for piece in pieces]
    # the sub-cell in the middle, or the four that meet there
    middles = [slice((len(parts) - 1) // 2, len(parts) // 2 + 1) for parts in free]
    are_free = [bool(parts[middle, middle].any()) for parts, middle in zip(free, middles, strict=True)]
    return np.asarray(mesh.controls[pieces[np.array(are_free, dtype=np.bool_)], 4])


def cost_around(problem: Problem, corner: FloatArray, rim: float, span: float) -> FloatArray | None:
    """
    Bound the cost around a corner for a block with such a rim; None where it changes too much.

    Paths around the corners inside are longer by `span` at most, or do not count.

    Returns
    -------
    numbers
        As `corner_kernels` takes them.
    """
    disc = DISC * rim
    cost, gx, gy, drop, _ = bounds_on_disc(problem, (float(corner[0]), float(corner[1])), disc)
    slope, bend = math.hypot(gx, gy), 2.0 * drop / disc**2
    least, most, steepest = cost - slope * disc - drop, cost + slope * rim, slope + bend * disc
    # the greatest length of a string that counts; paths that are longer, or leave the disc, cost more
    length = (2.0 * rim + span) * most / least if least > 0.0 else math.inf
    if not (length <= 2.0 * MOST_RATIO * rim and steepest * length <= 2.0 * least):
        return None
    return np.array([cost, gx, gy, bend, steepest**2 / (4.0 * least), most / least, most, span])


def rim_of(mesh: SplineMesh, pieces: WholeArray, centre: tuple[int, int], reach: int) -> tuple[WholeArray, FloatArray]:
    """
    List the parts of the rim of a block that its outermost pieces have.

    Returns
    -------
    owners
        The piece of each part, shape ``(s,)``.
    places
        Where it begins and ends, in spacings from the middle of its cell, shape ``(s, 4)``.
    """
    owners, places = [], []
    for piece in pieces:
        off = int(mesh.columns[piece]) - centre[0], int(mesh.rows[piece]) - centre[1]
        free = mesh.free_parts(int(piece))
        for axis, sign in itertools.product((0, 1), (-1, 1)):
            if off[axis] != sign * reach:
                continue
            edge = 0 if sign < 0 else -1
            line: BoolArray = free[:, edge] if axis == 0 else free[edge]
            jumps = np.flatnonzero(np.diff(np.concatenate([[0], line.astype(np.int8), [0]]))) / len(line) - 0.5
            for begin, end in jumps.reshape(-1, 2).tolist():
                owners.append(int(piece))
                side = 0.5 * sign
                places.append((side, begin, side, end) if axis == 0 else (begin, side, end, side))
    return np.array(owners, dtype=np.int32), np.array(places, dtype=np.float64).reshape(-1, 4)


def walls_inside(geometry: BaseGeometry, corner: FloatArray, disc: float, depth: float) -> FloatArray:
    """List lines inside an area at a depth below its outline, near a corner and relative to it, shape ``(w, 4)``."""
    x, y = corner.tolist()
    # (the part cut off is more of the inside; `shapely.clip_by_rect` is faster, but fails on slivers)
    near = shapely.intersection(geometry, shapely.box(x - disc, y - disc, x + disc, y + disc))
    inner = near.buffer(-depth, join_style="mitre")
    rings = [shapely.get_coordinates(ring) - corner for ring in shapely.get_rings(shapely.get_parts(inner))]
    lines = np.concatenate([np.empty((0, 4)), *(np.hstack([ring[:-1], ring[1:]]) for ring in rings)])
    return np.ascontiguousarray(lines[:MOST_WALLS])

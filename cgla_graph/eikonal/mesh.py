"""The mesh of a biquadratic spline over part of a map, cut open along no-fly areas."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely

from cgla_graph._threads import in_parts
from cgla_graph._types import BoolArray, Bounds, FloatArray, Point, WholeArray
from cgla_graph.eikonal import cell_runs, mesh_kernels
from cgla_graph.eikonal.marching_kernels import Joints, Mesh, Nodes
from cgla_graph.eikonal.mesh_kernels import Outlines
from cgla_graph.model.no_fly import NoFlyArea

#: Sub-cells along the longer side of the bounds that separate the pieces of a cell, where memory allows.
SUB_CELLS = 32_768
#: Sub-cells in all, unless that would leave fewer than so many along the side of a cell.
MOST_SUB_CELLS, FEWEST_PARTS = 3_000_000, 4
#: Walls thinner than `LEAKS` sub-cells may leak. For thin walls there are up to `FINER_SIDE` times as many sub-cells
#: along the side and `MORE` times as many in all; for tips, which may be so thin for half a cell at most,
#: `MORE_AT_TIPS` times.
LEAKS, FINER_SIDE, MORE, MORE_AT_TIPS = 4.0, 16, 16, 4
#: Default number of further cells around those that matter, which keep errors at the rim of the mesh away.
HALO = 8
#: Stand for a piece where there is none.
NO_CELL, IN_AREA = -1, -2
#: The pairs of a mesh without joints.
NO_PAIRS: WholeArray = np.empty((0, 3), dtype=np.uint32)
#: A corner turns by more than this, rad, and nodes are near it within so many cells.
SHARP, NEAR_CORNER = math.radians(15.0), 3.0


@dataclass(frozen=True, eq=False)
class SplineMesh:
    """
    Cells of a square grid, their pieces outside a no-fly area, and the nodes that hold the spline's control values.

    The cell of a node is the rectangle of one spacing around it. Where edges of the area cut a cell, its pieces have
    control values of their own, which they share with the pieces of neighbouring cells that they touch. So a spline
    is continuous wherever a path may go, and may jump across walls of any width. Pieces are separated on a finer
    raster, whose sub-cells count as free where an edge meets them: this may join separate pieces, but never separates
    a connected piece.

    Attributes
    ----------
    origin
        ``(x, y)`` of node (0, 0), map units.
    spacing
        Distances of neighbouring nodes along x and y, map units.
    last
        Column and row of the last node inside the bounds; nodes at -1, or one beyond, are just outside.
    columns, rows
        Column and row of the cell of each piece, shapes ``(m,)``.
    matters
        Whether the cell of a piece was asked for (True) or belongs to the halo, shape ``(m,)``.
    controls
        The nodes around each piece, row by row from the south-west, shape ``(m, 9)``.
    node_columns, node_rows
        Column and row of each node, shapes ``(n,)``; on both sides of a wall, several nodes may be at one place.
    neighbours
        Neighbours of each node, shape ``(n + 1, 4)`` (see `marching_kernels`).
    joints
        Nodes that a piece has side by side and that are not neighbours of each other (see `marching_kernels`).
    beside_wall
        Direction of the wall, without signs, beside each node that lacks a neighbour; -1 for other nodes, and near
        corners, as a front must not be led across the wall there. Shape ``(n + 1, 2)``.
    ends
        The pieces that hold the points asked for; -1 where there is none.
    parts
        Sub-cells along the side of a cell, which separate the pieces of a cell that an edge meets.
    sub_cells
        The cell of each piece, the table of each cell or -1, the tables of labels, and the first piece of each cell
        (see `free_parts`).
    outlines
        The box around each piece, inside the bounds, and strips of those that an edge meets (`mesh_kernels.Outlines`).
    """

    origin: Point
    spacing: tuple[float, float]
    last: tuple[int, int]
    columns: WholeArray
    rows: WholeArray
    matters: BoolArray
    controls: WholeArray
    node_columns: WholeArray
    node_rows: WholeArray
    neighbours: WholeArray
    joints: Joints
    beside_wall: FloatArray
    ends: tuple[int, ...]
    parts: int
    sub_cells: tuple[WholeArray, WholeArray, WholeArray, WholeArray]
    outlines: Outlines

    @classmethod
    def build(
        cls,
        bounds: Bounds,
        last: tuple[int, int],
        runs: WholeArray,
        area: NoFlyArea,
        ends: Sequence[Point],
        halo: int = HALO,
        most_sub_cells: int = MOST_SUB_CELLS,
    ) -> "SplineMesh":
        """
        Build the mesh of some cells.

        Parameters
        ----------
        bounds
            Node (0, 0) and node `last` are their corners.
        last
            Column and row of the last node.
        runs
            The cells that matter (see `cell_runs`), merged, inside the bounds.
        area
            No-fly area; cells inside it are left out.
        ends
            Points outside the area.
        halo
            Further cells around those that matter.
        most_sub_cells
            Sub-cells in all, unless that would leave fewer than a few in a cell.
        """
        origin = bounds[:2]
        spacing = ((bounds[2] - bounds[0]) / last[0], (bounds[3] - bounds[1]) / last[1])
        wide = cell_runs.clipped(cell_runs.dilated(runs, halo), last)
        (columns, rows), matters = cell_runs.cells_of(wide), cell_runs.are_in(wide, runs)
        place, counts, labels = _cut_open((columns, rows, origin, spacing), bounds, last, area, most_sub_cells)
        parts = labels.shape[1]
        first_piece = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        near = mesh_kernels.around(columns, rows)
        slots = mesh_kernels.join_pieces(near, place, first_piece)
        if len(labels):
            mesh_kernels.join_cut_pieces(near, place, labels, first_piece, slots)
        mesh_kernels.find_roots(slots)
        # distances to everything around take a lot of memory
        del near
        pieces = np.repeat(np.arange(len(columns), dtype=np.int32), counts)
        columns, rows, matters = columns[pieces], rows[pieces], matters[pieces]
        owners = mesh_kernels.number_nodes(slots, columns, rows)
        controls, n_nodes = slots.reshape(-1, 9), len(owners)
        node_columns, node_rows = columns[owners // 9] + owners % 3 - 1, rows[owners // 9] + owners % 9 // 3 - 1
        neighbours = mesh_kernels.connect(controls, n_nodes)
        outlines = outlines_of(columns, rows, last, sub_cells := (pieces, place, labels, first_piece))
        beside_wall = _beside_wall(neighbours, node_columns, node_rows, area, origin, spacing)
        pairs = np.unique(mesh_kernels.joints(controls, neighbours), axis=0) if len(labels) else NO_PAIRS
        nodes = node_columns, node_rows, neighbours, joints_of(pairs, spacing, n_nodes), beside_wall
        mesh = cls(origin, spacing, last, columns, rows, matters, controls, *nodes, (), parts, sub_cells, outlines)
        found = mesh.pieces_at(np.reshape(ends, (-1, 2)).astype(np.float64))
        return replace(mesh, ends=tuple(np.maximum(found, NO_CELL).tolist()))

    def part(self, runs: WholeArray, ends: Sequence[Point], halo: int = HALO) -> "MeshPart":
        """
        Return the mesh of some of its cells, about as `build` would make it.

        Parameters
        ----------
        runs
            The cells that matter, among those of this mesh that matter; merged.
        ends
            Points outside the area.
        halo
            Further cells around them, as far as this mesh has them.
        """
        kept = self._pieces_on(cell_runs.clipped(cell_runs.dilated(runs, halo), self.last))
        columns, rows = self.columns[kept], self.rows[kept]
        matters = np.zeros(len(self.rows), dtype=np.bool_)
        matters[self._pieces_on(runs)] = True
        # pieces, nodes, joints and cells are numbered anew (`take` is several times as fast as an index)
        used, controls = np.zeros(self.n_nodes + 1, dtype=np.bool_), self.controls.take(kept, axis=0)
        used[controls] = True
        nodes = np.flatnonzero(used)
        number = np.full(self.n_nodes + 1, len(nodes), dtype=self.controls.dtype)
        number[nodes] = np.arange(len(nodes))
        with_none = np.append(nodes, self.n_nodes)
        cells, place, labels, _ = self.sub_cells
        first_piece = np.flatnonzero(np.diff(cells[kept], prepend=-1)).astype(np.int32)
        cell = np.repeat(np.arange(len(first_piece), dtype=np.int32), np.diff(first_piece, append=len(kept)))
        sub_cells = cell, place[cells[kept[first_piece]]], labels, np.append(first_piece, np.int32(len(kept)))
        _, *apart, length = self.joints
        held = np.flatnonzero(used[apart[0]] & used[apart[1]])
        one, other = (number[some[held]].astype(some.dtype) for some in apart)
        parts, boxes, first_strip, strips = self.outlines
        mesh = replace(
            self,
            columns=columns,
            rows=rows,
            matters=(matters & self.matters)[kept],
            controls=number.take(controls),
            node_columns=self.node_columns[nodes],
            node_rows=self.node_rows[nodes],
            neighbours=number.take(self.neighbours.take(with_none, axis=0)).astype(self.neighbours.dtype),
            joints=_laid_out(one, other, length[held], len(nodes)),
            beside_wall=self.beside_wall.take(with_none, axis=0),
            sub_cells=sub_cells,
            outlines=(parts, boxes.take(kept, axis=0), first_strip[kept], strips),
        )
        found = mesh.pieces_at(np.reshape(ends, (-1, 2)).astype(np.float64))
        return MeshPart(replace(mesh, ends=tuple(np.maximum(found, NO_CELL).tolist())), kept, nodes, held)

    @property
    def kernel_mesh(self) -> Mesh:
        """The pieces as kernels take them."""
        return self.controls, self.columns, self.rows, self.origin, self.spacing

    @property
    def kernel_nodes(self) -> Nodes:
        """The nodes as kernels take them."""
        return self.node_columns, self.node_rows, self.neighbours, self.origin, self.spacing

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.node_columns)

    @cached_property
    def node_points(self) -> FloatArray:
        """Coordinates of the nodes, read-only, shape ``(n, 2)``, map units."""
        points = np.empty((self.n_nodes, 2))
        for axis, index in enumerate((self.node_columns, self.node_rows)):
            np.multiply(index, self.spacing[axis], out=points[:, axis])
        points += self.origin
        points.flags.writeable = False
        return points

    @cached_property
    def keys(self) -> WholeArray:
        """Rising numbers of the cells of pieces, which are in order row by row, shape ``(m,)``."""
        return np.asarray(self.rows.astype(np.int64) * (self.last[0] + 3) + self.columns)

    def _pieces_on(self, runs: WholeArray) -> WholeArray:
        """List the pieces on some cells (`cell_runs`) inside the bounds, in order, shape ``(k,)``."""
        ends = np.searchsorted(self.keys, runs[:, :1] * (self.last[0] + 3) + runs[:, 1:])
        return cell_runs.cells_of(np.column_stack([runs[:, 0], ends]))[0]

    def pieces_at(self, points: FloatArray) -> WholeArray:
        """
        Find the piece at each point, shape ``(k, 2)``, map units: shape ``(k,)``.

        It is `NO_CELL` where the mesh has no cell, or a cell inside the area, and `IN_AREA` where the point of a cut
        cell is in the area.
        """
        cells, place, labels, first_piece = self.sub_cells
        at = (points - np.array(self.origin)) / np.array(self.spacing)
        nodes = np.rint(at).astype(np.int64)
        # the half of a cell on the rim beyond the bounds counts as inside the area
        low, high = np.where(nodes == 0, self.parts // 2, 0), np.where(nodes == self.last, self.parts // 2, self.parts)
        parts = np.clip(((at - nodes + 0.5) * self.parts).astype(np.int64), low, high - 1)
        keys, asked = self.keys, nodes[:, 1] * (self.last[0] + 3) + nodes[:, 0]
        first = np.minimum(np.searchsorted(keys, asked), len(keys) - 1)
        cell = cells[first]
        label = np.zeros(len(points), dtype=np.int64)
        cut = place[cell] >= 0
        label[cut] = labels[place[cell[cut]], parts[cut, 1], parts[cut, 0]]
        found = np.where(label >= 0, first_piece[cell] + label, IN_AREA)
        return np.where(keys[first] == asked, found, NO_CELL)

    def free_parts(self, piece: int) -> BoolArray:
        """Return which sub-cells of its cell belong to a piece, shape ``(parts, parts)``; ``(1, 1)`` if all do."""
        pieces, place, labels, first_piece = self.sub_cells
        cell = pieces[piece]
        if place[cell] < 0:
            return np.ones((1, 1), dtype=np.bool_)
        return np.asarray(labels[place[cell]] == piece - first_piece[cell])

    @property
    def is_cut(self) -> BoolArray:
        """Whether an edge of the area meets the cell of each piece, shape ``(m,)``."""
        pieces, place, _, _ = self.sub_cells
        return np.asarray(place[pieces] >= 0)

    @property
    def farthest(self) -> float:
        """The greatest coordinate of the bounds, in magnitude, map units."""
        low, sides = np.array(self.origin), np.array(self.last) * self.spacing
        return float(np.abs([low, low + sides]).max())

    @property
    def has_walls(self) -> bool:
        """Whether an edge of the area meets any cell."""
        return len(self.sub_cells[2]) > 0

    @property
    def outside(self) -> BoolArray:
        """Whether each node is just outside the bounds, shape ``(n,)``."""
        below = (self.node_columns < 0) | (self.node_rows < 0)
        return below | (self.node_columns > self.last[0]) | (self.node_rows > self.last[1])


class MeshPart(NamedTuple):
    """Part of a mesh, and which pieces, nodes and joints of the mesh are its own, in ascending order."""

    mesh: SplineMesh
    pieces: WholeArray
    nodes: WholeArray
    joints: WholeArray


def places_in(kept: WholeArray, asked: WholeArray) -> WholeArray:
    """
    Return where numbers are in an ascending list of some of them, or -1.

    Examples
    --------
    >>> places_in(np.array([1, 3]), np.array([3, 2, 1, 4])).tolist()
    [1, -1, 0, -1]
    """
    at = np.searchsorted(kept, asked)
    return np.where(np.append(kept, -1)[at] == asked, at, -1)


def _cut_open(
    cells: tuple[WholeArray, WholeArray, Point, Point],
    bounds: Bounds,
    last: tuple[int, int],
    area: NoFlyArea,
    most_sub_cells: int,
) -> tuple[WholeArray, WholeArray, WholeArray]:
    """
    Separate the pieces of the cells that edges of an area meet.

    `cells` are columns and rows, shapes ``(n,)``, origin and spacing. Returns the table of each cell, or -1; how many
    pieces it has, 0 inside the area; and the tables, shape ``(t, parts, parts)``: the label of each sub-cell, or -1
    inside the area.
    """
    columns, rows, origin, spacing = cells
    n_cells = len(columns)
    place, counts = np.full(n_cells, -1, dtype=np.int32), np.ones(n_cells, dtype=np.int32)
    if area.is_empty:
        return place, counts, np.empty((0, 2, 2), dtype=np.int16)
    edges, arrays = area.edges, area.kernel_arrays
    row_starts = np.searchsorted(rows, np.arange(rows[0], rows[-1] + 2))
    # a millionth of a cell, and some ulps of the coordinates
    farthest = max(float(np.abs(bounds).max()), float(np.abs(edges).max()))
    margin = 1e-6 + 2.0**-47 * farthest / min(spacing)
    whole = np.zeros((n_cells, 1, 1), dtype=np.int8)
    grid = columns, rows, row_starts, origin, spacing
    mesh_kernels.mark_edges(grid, np.arange(n_cells, dtype=np.int32), 1, edges, margin, whole)
    met = whole[:, 0, 0] == mesh_kernels.MET
    counts[mesh_kernels.inside_cells(grid, met, arrays)] = 0
    (cut,) = np.nonzero(met)
    place[cut] = np.arange(len(cut))
    # (an area may have no width at all where it was joined with the rim)
    thinnest = max(min(area.thinnest, width_at_rim(edges, bounds)), 1e-100)
    along = min(max(SUB_CELLS, LEAKS * max(last) * max(spacing) / thinnest), FINER_SIDE * SUB_CELLS)
    for_walls = math.ceil(along / max(last)), 1 if along == SUB_CELLS else MORE
    for_tips = math.ceil(2.0 * LEAKS / least_angle(edges, bounds)), MORE_AT_TIPS
    room = most_sub_cells / max(len(cut), 1)
    wanted = max(min(parts, int(math.sqrt(times * room))) for parts, times in (for_walls, for_tips))
    # an even number, so that the rim of the map runs between sub-cells
    parts = 2 * (max(wanted, FEWEST_PARTS) // 2)
    kinds = np.zeros((len(cut), parts, parts), dtype=np.int8)
    mesh_kernels.mark_edges(grid, place, parts, edges, margin, kinds)
    labels = np.empty(kinds.shape, dtype=np.int16)

    def fill(part: slice) -> None:
        some = columns[cut[part]], rows[cut[part]]
        mesh_kernels.sub_cells(some, origin, spacing, last, arrays, kinds[part])
        counts[cut[part]] = mesh_kernels.label_pieces(kinds[part], labels[part])

    in_parts(fill, len(cut), size=parts * parts)
    return place, counts, labels


def outlines_of(
    columns: WholeArray,
    rows: WholeArray,
    last: tuple[int, int],
    sub_cells: tuple[WholeArray, WholeArray, WholeArray, WholeArray],
) -> Outlines:
    """
    Find the box around each piece, and cut it into strips where an edge meets its cell.

    `columns` and `rows` are those of the pieces; `sub_cells` are as a `SplineMesh` has them.
    """
    cells, place, labels, _ = sub_cells
    parts = labels.shape[1]
    boxes, first_strip = np.empty((len(columns), 4), dtype=np.int16), np.full(len(columns), -1, dtype=np.int32)
    boxes[:] = 0, 0, parts, parts
    for axis, index in enumerate((columns, rows)):
        boxes[np.flatnonzero(index == 0), axis] = parts // 2
        boxes[np.flatnonzero(index == last[axis]), axis + 2] = parts // 2
    cut = np.flatnonzero(place[cells] >= 0) if len(labels) else np.empty(0, dtype=np.int64)
    first_strip[cut] = mesh_kernels.STRIPS * np.arange(len(cut))
    strips = np.empty((mesh_kernels.STRIPS * len(cut), 4), dtype=np.int16)
    if len(cut):
        mesh_kernels.cut_outlines(parts, sub_cells, boxes, first_strip, strips)
    return parts, boxes, first_strip, strips


def joints_of(pairs: WholeArray, spacing: tuple[float, float], n_nodes: int) -> Joints:
    """Lay out sorted pairs of nodes and the axis along which they are apart as `marching_kernels.march` takes them."""
    one, other, axis = np.ascontiguousarray(pairs.T)
    return _laid_out(one, other, np.array(spacing)[axis], n_nodes)


def _laid_out(one: WholeArray, other: WholeArray, length: FloatArray, n_nodes: int) -> Joints:
    """Find the first entry of each node in a list of joints, which is in the order of the nodes."""
    first = np.full(n_nodes + 1 if len(one) else 0, -1, dtype=np.int32)
    # of equal nodes, the first
    first[one[::-1]] = np.arange(len(one), dtype=np.int32)[::-1]
    return first, one, other, length


def _beside_wall(
    neighbours: WholeArray, columns: WholeArray, rows: WholeArray, area: NoFlyArea, origin: Point, spacing: Point
) -> FloatArray:
    """Return the direction of the wall beside each node that lacks a neighbour and is not near a sharp corner."""
    found = np.full((len(neighbours), 2), -1.0)
    (lacking,) = np.nonzero((neighbours[:-1] == len(columns)).any(axis=1))
    edges = area.edges
    if len(lacking) and len(edges):
        places = np.column_stack([columns[lacking], rows[lacking]]).astype(np.float64)
        far = _away_from(places, (_sharp_corners(area) - origin) / spacing)
        lacking, places = lacking[far], places[far]
        lines = shapely.STRtree(np.asarray(shapely.linestrings(edges[:, :4].reshape(-1, 2, 2))))
        nearest = lines.nearest(shapely.points(places * spacing + origin))
        step = edges[nearest, 2:4] - edges[nearest, :2]
        found[lacking] = np.abs(step) / np.hypot(*step.T)[:, None]
    return found


def _away_from(places: FloatArray, corners: FloatArray) -> BoolArray:
    """Return which places are not near corners, in spacings."""
    if not len(corners):
        return np.ones(len(places), dtype=np.bool_)
    from scipy.spatial import cKDTree  # noqa: PLC0415 - slow to import, and needed beside walls alone

    return np.isinf(cKDTree(corners).query(places, distance_upper_bound=NEAR_CORNER)[0])


def _sharp_corners(area: NoFlyArea) -> FloatArray:
    """List the corners of an area where its outline turns by more than `SHARP`, shape ``(m, 2)``."""
    found = [np.empty((0, 2))]
    for ring in shapely.get_rings(shapely.get_parts(area.geometry)):
        points = shapely.get_coordinates(ring)[:-1]
        before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
        turns = np.arctan2(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1))
        found.append(points[np.abs(turns) > SHARP])
    return np.concatenate(found)


def width_at_rim(edges: FloatArray, bounds: Bounds) -> float:
    """
    Return the least width of an area where it meets the rim of the map, map units; infinite if it does not.

    A wall that is wide elsewhere may taper off beyond the rim. The width is measured across the wall. `edges` are those
    of the area (`NoFlyArea.edges`).
    """
    least = math.inf
    for side, at in enumerate(bounds):
        across, along = edges[:, side % 2 : 4 : 2], edges[:, 1 - side % 2 : 4 : 2]
        (meets,) = np.nonzero((across[:, 0] < at) != (across[:, 1] < at))
        (begin, end), (low, high) = across[meets].T, along[meets].T
        places = low + (at - begin) / (end - begin) * (high - low)
        slants = np.abs(end - begin) / np.hypot(end - begin, high - low)
        order = np.argsort(places)
        # from one to the next is inside, then outside
        inside = np.clip(places[order], bounds[1 - side % 2], bounds[3 - side % 2]).reshape(-1, 2)
        widths = (inside[:, 1] - inside[:, 0]) * slants[order].reshape(-1, 2).min(axis=1)
        least = min(least, float(widths[widths > 0.0].min(initial=math.inf)))
    return least


def angles_of(edges: FloatArray) -> FloatArray:
    """
    Return the angle of an area where each of its edges begins, rad, shape ``(n,)``: above 0 where it sticks out.

    `edges` are those of the area (`NoFlyArea.edges`).
    """
    out, back = edges[:, 2:4] - edges[:, :2], edges[:, 4:6] - edges[:, :2]
    cross = out[:, 0] * back[:, 1] - out[:, 1] * back[:, 0]
    return np.asarray(np.arctan2(cross, (out * back).sum(axis=1)))


def least_angle(edges: FloatArray, bounds: Bounds) -> float:
    """Return the least angle of the corners that stick out from an area inside some bounds; infinite without any."""
    angles = angles_of(edges)
    inside = ((edges[:, :2] >= bounds[:2]) & (edges[:, :2] <= bounds[2:])).all(axis=1)
    return float(angles[inside & (angles > 0.0)].min(initial=math.inf))


def bezier_values(values: FloatArray, controls: WholeArray) -> FloatArray:
    """Return the Bézier control values of a spline on pieces with such controls (`SplineMesh`), shape ``(m, 3, 3)``."""
    at = values[controls].reshape(-1, 3, 3)
    return np.asarray(0.25 * (at[:, 1:2, 1:2] + at[:, 1:2, :] + at[:, :, 1:2] + at))


def corners(area: NoFlyArea, bounds: Bounds) -> FloatArray:
    """List the distinct corners of an area inside some bounds, shape ``(m, 2)``, map units."""
    points = np.unique(shapely.get_coordinates(area.geometry), axis=0)
    inside = ((points >= bounds[:2]) & (points <= bounds[2:])).all(axis=1)
    return np.asarray(points[inside])

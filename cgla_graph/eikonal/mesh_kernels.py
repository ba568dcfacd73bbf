"""
Compiled kernels that build a spline mesh: the cells that polygons meet, their pieces, and what those share.

Cells are squares around the nodes of a grid, listed by row, then column. Places 0 to 8 around a cell are itself and its
neighbours, row by row from the south-west; place 4 is the cell itself.
"""

import math
from typing import Final, TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, WholeArray
from cgla_graph.model.array_kernels import doubled_rows
from cgla_graph.model.no_fly_kernels import AreaArrays, point_inside

#: What a sub-cell may be: free, inside the area, or met by an edge, which counts as free.
FREE, INSIDE, MET = range(3)
#: Columns and rows of the cells; where the cells of each row begin, from the first row on, and end; origin and spacing.
Grid: TypeAlias = tuple[WholeArray, WholeArray, WholeArray, tuple[float, float], tuple[float, float]]
MOST_PIECES: Final = 250
#: What pieces of cells are like. Sub-cells along the side of a cell, an even number. The box around each piece, shape
#: ``(m, 4)``: columns and rows of sub-cells, from and to (left, bottom, right, top); of cells on the rim of the map,
#: only the half inside the bounds counts. The row of the first strip of each piece, or -1 if no edge meets its cell.
#: Strips, shape ``(s, 4)``: boxes around the parts of a piece in some rows of sub-cells each, from bottom to top, empty
#: where the piece has no part.
Outlines: TypeAlias = tuple[int, WholeArray, WholeArray, WholeArray]
#: Strips of a piece.
STRIPS: Final = 8
#: Cells along the side of the squares in whose order nodes are numbered.
TILE: Final = 8


@kernel
def around(columns: WholeArray, rows: WholeArray) -> WholeArray:
    """Find the cells around each cell, shape ``(n, 9)``; -1 where there is none."""
    n = columns.shape[0]
    near = np.full((n, 9), -1, dtype=np.int32)
    below = 0
    for p in range(n):
        near[p, 4] = p
        if p > 0 and rows[p - 1] == rows[p] and columns[p - 1] == columns[p] - 1:
            near[p, 3] = p - 1
            near[p - 1, 5] = p
        while rows[below] < rows[p] - 1 or (rows[below] == rows[p] - 1 and columns[below] < columns[p] - 1):
            below += 1
        q = below
        while rows[q] == rows[p] - 1 and columns[q] <= columns[p] + 1:
            place = columns[q] - columns[p] + 1
            near[p, place] = q
            near[q, 8 - place] = p
            q += 1
    return near


@kernel
def edge_rows(
    edge: FloatArray, origin: tuple[float, float], spacing: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Return an edge ``ax, ay, bx, by`` in units of the spacing, the lower end first."""
    ax = (edge[0] - origin[0]) / spacing[0]
    ay = (edge[1] - origin[1]) / spacing[1]
    bx = (edge[2] - origin[0]) / spacing[0]
    by = (edge[3] - origin[1]) / spacing[1]
    if ay > by:
        return bx, by, ax, ay
    return ax, ay, bx, by


@kernel
def reach_in_row(ax: float, ay: float, bx: float, by: float, low: float, high: float) -> tuple[float, float]:
    """Return least and greatest x of the part of an edge between two heights, the lower end of the edge first."""
    left = ax
    right = bx
    if by > ay:
        left = ax + min(max((low - ay) / (by - ay), 0.0), 1.0) * (bx - ax)
        right = ax + min(max((high - ay) / (by - ay), 0.0), 1.0) * (bx - ax)
    return min(left, right), max(left, right)


@kernel
def mark_edges(grid: Grid, place: WholeArray, parts: int, edges: FloatArray, margin: float, kinds: WholeArray) -> None:
    """
    Divide cells into ``parts * parts`` sub-cells, and mark those that an edge of a polygon meets as `MET`.

    Sub-cells are taken for larger than they are by `margin` sides of a cell, so that rounding only ever marks too many.

    `place` is the row of each cell in `kinds`, shape ``(t, parts, parts)``, or -1; `edges` are those of the area
    (`NoFlyArea.edges`), map units.
    """
    columns, rows, row_starts, origin, spacing = grid
    first_row = rows[0]
    half = 0.5 + margin
    for e in range(edges.shape[0]):
        ax, ay, bx, by = edge_rows(edges[e], origin, spacing)
        # (compared as floats: far corners are no whole numbers of cells)
        low = math.ceil(max(ay - half, float(first_row)))
        high = math.floor(min(by + half, float(first_row + row_starts.shape[0] - 2)))
        for row in range(low, high + 1):
            start = row_starts[row - first_row]
            stop = row_starts[row - first_row + 1]
            for part in range(parts):
                bottom = row - 0.5 + part / parts - margin
                top = row - 0.5 + (part + 1) / parts + margin
                if top < ay or bottom > by:
                    continue
                left, right = reach_in_row(ax, ay, bx, by, bottom, top)
                i = start
                above = stop
                while i < above:
                    middle = (i + above) // 2
                    if columns[middle] < left - half:
                        i = middle + 1
                    else:
                        above = middle
                while i < stop and columns[i] <= right + half:
                    if place[i] >= 0:
                        base = columns[i] - 0.5
                        first = math.floor(min(max((left - base - margin) * parts, 0.0), parts - 1.0))
                        last = math.floor(min((right - base + margin) * parts, parts - 1.0))
                        for s in range(first, last + 1):
                            kinds[place[i], part, s] = MET
                    i += 1


@kernel
def inside_cells(grid: Grid, met: BoolArray, area: AreaArrays) -> BoolArray:
    """Mark the cells that lie inside the area: no edge meets them, and their node is inside; shape ``(n,)``."""
    columns, rows, _, origin, spacing = grid
    out = np.zeros(columns.shape[0], dtype=np.bool_)
    for p in range(columns.shape[0]):
        if met[p]:
            continue
        beside = p > 0 and rows[p - 1] == rows[p] and columns[p - 1] == columns[p] - 1 and not met[p - 1]
        x = origin[0] + spacing[0] * columns[p]
        y = origin[1] + spacing[1] * rows[p]
        # no edge between this cell and the one before
        out[p] = out[p - 1] if beside else point_inside(x, y, area)
    return out


@kernel
def sub_cells(
    cells: tuple[WholeArray, WholeArray],
    origin: tuple[float, float],
    spacing: tuple[float, float],
    rim: tuple[int, int],
    area: AreaArrays,
    kinds: WholeArray,
) -> None:
    """
    Say what the sub-cells of some cells are that no edge meets (`mark_edges`).

    Parameters
    ----------
    cells
        Their columns and rows, shapes ``(t,)``.
    origin, spacing
        Of the grid.
    rim
        The last column and row inside the bounds.
    area
        The area.
    kinds
        Shape ``(t, parts, parts)``, `parts` even: `FREE` for sub-cells that no edge meets. Overwritten.
    """
    columns, rows = cells
    parts = kinds.shape[1]
    for p in range(columns.shape[0]):
        for part in range(parts):
            y = origin[1] + spacing[1] * (rows[p] - 0.5 + (part + 0.5) / parts)
            before = MET
            for s in range(parts):
                if kinds[p, part, s] != MET:
                    if before == MET and part > 0:
                        # no edge between this one and the one below
                        before = kinds[p, part - 1, s]
                    if before == MET:
                        x = origin[0] + spacing[0] * (columns[p] - 0.5 + (s + 0.5) / parts)
                        before = INSIDE if point_inside(x, y, area) else FREE
                    kinds[p, part, s] = before
                else:
                    before = MET
        if 0 < columns[p] < rim[0] and 0 < rows[p] < rim[1]:
            continue
        # beyond the bounds is as good as inside the area: no way leads around a wall out there
        for part in range(parts):
            for s in range(parts):
                west = columns[p] == 0 and s < parts // 2
                east = columns[p] == rim[0] and s >= parts // 2
                south = rows[p] == 0 and part < parts // 2
                north = rows[p] == rim[1] and part >= parts // 2
                if west or east or south or north:
                    kinds[p, part, s] = INSIDE


@kernel
def root(parents: WholeArray, i: int) -> int:
    """Find the representative of a slot, halving the way there."""
    while parents[i] != i:
        parents[i] = parents[parents[i]]
        i = parents[i]
    return i


@kernel
def label_pieces(kinds: WholeArray, labels: WholeArray) -> WholeArray:
    """
    Label the connected pieces of each cell's free sub-cells, corners included; return how many each cell has.

    `labels`, like `kinds` of shape ``(t, parts, parts)``, is -1 inside the area. Beyond `MOST_PIECES`, pieces of a
    cell count as one, which joins separate pieces, but never separates a piece.
    """
    n_cells, parts = kinds.shape[0], kinds.shape[1]
    counts = np.zeros(n_cells, dtype=np.int32)
    # runs of free sub-cells, row by row: columns from and to; those that touch share a root
    most = parts * (parts // 2 + 1)
    starts, stops = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.int32)
    roots, label_of = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.int32)
    rows = np.empty(parts + 1, dtype=np.int32)
    for t in range(n_cells):
        n = int(np.int64(0))
        for i in range(parts):
            rows[i] = n
            below = rows[i - 1] if i > 0 else n
            j = int(np.int64(0))
            while j < parts:
                if kinds[t, i, j] == INSIDE:
                    j += 1
                    continue
                starts[n] = j
                while j < parts and kinds[t, i, j] != INSIDE:
                    j += 1
                stops[n] = j
                roots[n] = n
                while below < rows[i] and stops[below] < starts[n]:
                    below += 1
                touching = below
                while touching < rows[i] and starts[touching] <= j:
                    one, other = root(roots, n), root(roots, touching)
                    roots[max(one, other)] = min(one, other)
                    touching += 1
                n += 1
        rows[parts] = n
        found = int(np.int64(0))
        for r in range(n):
            if roots[r] == r:
                label_of[r] = min(found, MOST_PIECES - 1)
                found += 1
            else:
                label_of[r] = label_of[root(roots, r)]
        counts[t] = min(found, MOST_PIECES)
        for i in range(parts):
            for j in range(parts):
                labels[t, i, j] = -1
            for r in range(rows[i], rows[i + 1]):
                for j in range(starts[r], stops[r]):
                    labels[t, i, j] = label_of[r]
    return counts


@kernel
def cut_outlines(
    parts: int,
    sub_cells: tuple[WholeArray, WholeArray, WholeArray, WholeArray],
    boxes: WholeArray,
    first_strip: WholeArray,
    strips: WholeArray,
) -> None:
    """
    Shrink the boxes of the pieces that an edge meets to their free sub-cells, and write their strips (`Outlines`).

    `sub_cells` are as a `SplineMesh` has them.
    """
    cells, place, labels, first_piece = sub_cells
    for p in range(boxes.shape[0]):
        if first_strip[p] < 0:
            continue
        table, label = place[cells[p]], p - first_piece[cells[p]]
        west, south, east, north = parts, parts, 0, 0
        for number in range(STRIPS):
            left, bottom, right, top = parts, parts, 0, 0
            for i in range(number * parts // STRIPS, (number + 1) * parts // STRIPS):
                for j in range(parts):
                    if labels[table, i, j] == label:
                        left, right = min(left, j), max(right, j + 1)
                        bottom, top = min(bottom, i), i + 1
            strip = first_strip[p] + number
            strips[strip, 0], strips[strip, 2] = max(boxes[p, 0], left), min(boxes[p, 2], right)
            strips[strip, 1], strips[strip, 3] = max(boxes[p, 1], bottom), min(boxes[p, 3], top)
            west, south, east, north = min(west, left), min(south, bottom), max(east, right), max(north, top)
        boxes[p, 0], boxes[p, 2] = max(boxes[p, 0], west), min(boxes[p, 2], east)
        boxes[p, 1], boxes[p, 3] = max(boxes[p, 1], south), min(boxes[p, 3], north)


@kernel
def share(p: int, q: int, dx: int, dy: int, parents: WholeArray) -> None:
    """Unite the slots that two pieces have in common, the cell of `q` being ``(dx, dy)`` from that of `p`."""
    for b in range(3):
        for a in range(3):
            if 0 <= a + dx < 3 and 0 <= b + dy < 3:
                first = root(parents, 9 * p + 3 * (b + dy) + a + dx)
                second = root(parents, 9 * q + 3 * b + a)
                if first < second:
                    parents[second] = first
                elif second < first:
                    parents[first] = second


@kernel
def label_at(cell: int, i: int, j: int, place: WholeArray, labels: WholeArray) -> int:
    """Return the number of the piece of a cell at sub-cell ``(i, j)``; a cell that no edge meets is one piece."""
    return 0 if place[cell] < 0 else int(labels[place[cell], i, j])


@kernel
def join_pieces(near: WholeArray, place: WholeArray, first_piece: WholeArray) -> WholeArray:
    """
    Unite the slots of neighbouring cells that no edge meets; return the parent of each slot (see `root`).

    A piece has nine slots: the control values of the spline on it. Pieces of neighbouring cells that touch, be it in
    a corner, are on the same side of the polygons there and share the slots at the places that they have in common;
    pieces apart do not, so that the spline may jump from one side of a wall to the other. Shape ``(9 pieces,)``; what
    edges meet is left to `join_cut_pieces`.
    """
    n = near.shape[0]
    parents: WholeArray = np.empty(9 * int(first_piece[n]), dtype=np.int32)
    for slot in range(parents.shape[0]):
        parents[slot] = slot
    plain = np.empty(n, dtype=np.bool_)
    for p in range(n):
        plain[p] = place[p] < 0 and first_piece[p + 1] > first_piece[p]
    deep = np.ones(n, dtype=np.bool_)
    for p in range(n):
        for o in range(9):
            q = near[p, o]
            if q < 0 or not plain[q]:
                deep[p] = False
            elif plain[p]:
                # plain cells side by side always touch: the slot is the middle of the other
                parents[9 * first_piece[p] + o] = 9 * first_piece[q] + 4
    for p in range(n):
        for o in range(5, 9):
            q = int(np.int64(near[p, o]))
            if q >= 0 and plain[p] and plain[q] and not (deep[p] and deep[q]):
                # (casts keep calls of one kernel alike, which is compiled anew for other types and for constants)
                share(int(np.int64(first_piece[p])), int(np.int64(first_piece[q])), o % 3 - 1, o // 3 - 1, parents)
    return parents


@kernel
def join_cut_pieces(
    near: WholeArray, place: WholeArray, labels: WholeArray, first_piece: WholeArray, parents: WholeArray
) -> None:
    """Unite the slots of pieces that touch, of neighbouring cells one of which an edge meets (see `join_pieces`)."""
    parts = labels.shape[1]
    start, end = int(np.int64(0)), parts - 1
    for p in range(near.shape[0]):
        for o in range(5, 9):
            q = int(np.int64(near[p, o]))
            if q < 0 or (place[p] < 0 and place[q] < 0):
                continue
            if first_piece[p] == first_piece[p + 1] or first_piece[q] == first_piece[q + 1]:
                continue
            dx = o % 3 - 1
            dy = o // 3 - 1
            if dx != 0 and dy != 0:
                j = end if dx > 0 else start
                mine = label_at(p, end, j, place, labels)
                other = label_at(q, start, end - j, place, labels)
                if mine >= 0 and other >= 0:
                    share(first_piece[p] + mine, first_piece[q] + other, dx, dy, parents)
                continue
            last_mine = -1
            last_other = -1
            for i in range(parts):
                for k in range(max(i - 1, 0), min(i + 2, parts)):
                    if dy == 0:
                        mine = label_at(p, i, end, place, labels)
                        other = label_at(q, k, start, place, labels)
                    else:
                        mine = label_at(p, end, i, place, labels)
                        other = label_at(q, start, k, place, labels)
                    if mine >= 0 and other >= 0 and (mine != last_mine or other != last_other):
                        share(first_piece[p] + mine, first_piece[q] + other, dx, dy, parents)
                        last_mine = mine
                        last_other = other


@kernel
def find_roots(parents: WholeArray) -> None:
    """Give each slot its representative."""
    for slot in range(parents.shape[0]):
        parents[slot] = root(parents, slot)


@kernel
def number_nodes(slots: WholeArray, columns: WholeArray, rows: WholeArray) -> WholeArray:
    """
    Give numbers to the nodes that pieces share, square by square of `TILE` cells.

    So nodes that are near on the map are near in memory, and a front across many rows of a large grid waits less.

    Parameters
    ----------
    slots
        The representative of each slot of a piece (`find_roots`), shape ``(9 pieces,)``. Overwritten with the numbers.
    columns, rows
        Of the cell of each piece, row by row, shape ``(pieces,)``.

    Returns
    -------
    representatives
        Of each node its slot, shape ``(nodes,)``.
    """
    n_pieces = columns.shape[0]
    n, last = int(np.int64(0)), int(np.int64(0))
    for piece in range(n_pieces):
        last = max(last, columns[piece] // TILE)
        for slot in range(9 * piece, 9 * piece + 9):
            n += slots[slot] == slot
    representatives = np.empty(n, dtype=np.int32)
    following = np.empty(last + 1, dtype=np.int32)
    n, begin = int(np.int64(0)), int(np.int64(0))
    while begin < n_pieces:
        # the squares of a band of rows: how many nodes each has, then the number of its first, and of its next
        for tile in range(last + 1):
            following[tile] = 0
        end = begin
        while end < n_pieces and rows[end] // TILE == rows[begin] // TILE:
            for slot in range(9 * end, 9 * end + 9):
                following[columns[end] // TILE] += slots[slot] == slot
            end += 1
        for tile in range(last + 1):
            count = following[tile]
            following[tile] = n
            n += count
        for piece in range(begin, end):
            for slot in range(9 * piece, 9 * piece + 9):
                if slots[slot] == slot:
                    node = following[columns[piece] // TILE]
                    following[columns[piece] // TILE] = node + 1
                    representatives[node] = slot
                    # below 0: a number, and no slot
                    slots[slot] = -1 - node
        begin = end
    for slot in range(slots.shape[0]):
        if slots[slot] >= 0:
            slots[slot] = slots[slots[slot]]
    for slot in range(slots.shape[0]):
        slots[slot] = -1 - slots[slot]
    return representatives


@kernel
def connect(controls: WholeArray, n_nodes: int) -> WholeArray:
    """
    Find the neighbours of each node among the slots of the pieces (see `marching_kernels`), shape ``(n + 1, 4)``.

    Where the slots of two pieces differ, as at the end of a thin wall, the first piece wins.
    """
    # indices without a sign need no look at whether they count from the end
    neighbours: WholeArray = np.full((n_nodes + 1, 4), n_nodes, dtype=np.uint32)
    for c in range(controls.shape[0]):
        for b in range(3):
            for a in range(3):
                here = controls[c, 3 * b + a]
                if a < 2:
                    east = controls[c, 3 * b + a + 1]
                    if neighbours[here, 1] == n_nodes:
                        neighbours[here, 1] = east
                    if neighbours[east, 0] == n_nodes:
                        neighbours[east, 0] = here
                if b < 2:
                    north = controls[c, 3 * b + a + 3]
                    if neighbours[here, 3] == n_nodes:
                        neighbours[here, 3] = north
                    if neighbours[north, 2] == n_nodes:
                        neighbours[north, 2] = here
    return neighbours


@kernel
def joints(controls: WholeArray, neighbours: WholeArray) -> WholeArray:
    """
    List the nodes that a piece has side by side and that are not neighbours of each other, both ways, shape ``(t, 3)``.

    At the end of a thin wall, a node has one neighbour on each side, and nodes on both sides of the wall are beside it.
    The third number is 0 for nodes beside each other along x, else 1; a pair may be listed several times.
    """
    found: WholeArray = np.empty((16, 3), dtype=np.uint32)
    n = int(np.int64(0))
    for c in range(controls.shape[0]):
        for axis in range(2):
            for i in range(6):
                at = 3 * (i // 2) + i % 2 if axis == 0 else i
                one = controls[c, at]
                other = controls[c, at + (1 if axis == 0 else 3)]
                if neighbours[one, 2 * axis + 1] == other and neighbours[other, 2 * axis] == one:
                    continue
                if n + 2 > found.shape[0]:
                    found = doubled_rows(found)
                for k in range(2):
                    found[n + k, 0] = one if k == 0 else other
                    found[n + k, 1] = other if k == 0 else one
                    found[n + k, 2] = axis
                n += 2
    return found[:n]

"""
Exact predicates of no-fly areas, compiled: a segment against polygons, with no tolerance.

Every kernel takes the area as one tuple of three arrays (``NoFlyArea.kernel_arrays``):

``frame`` : (7,)
    ``xmin, ymin, xmax, ymax`` of the area, slabs per map unit, height of a slab, slack of a slab's borders
    (map units). The bounds of an empty area are ``inf, inf, -inf, -inf``, which no segment meets.
``slab_starts`` : (slabs + 1,)
    Slab ``s`` owns the rows ``slab_starts[s]`` to ``slab_starts[s + 1]`` of ``rows``.
``rows`` : (entries, 8), map units
    One edge ``a -> b`` in one slab, interior on its left: ``ax, ay, bx, by, cx, cy``, its least x, and the
    greatest x of this and all earlier rows of the slab. ``c`` is the far end of the first edge
    counter-clockwise of ``a -> b`` around ``a``, so that ``b, a, c`` bound one interior sector. In a slab,
    rows are sorted by least x.

The signs are exact for coordinates that are 0 or between 1e-120 and 1e120 in magnitude: outside, the products
of the exact arithmetic overflow or underflow.
"""

from typing import Final, TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray

AreaArrays: TypeAlias = tuple[FloatArray, IntArray, FloatArray]

# Shewchuk 1997, "Adaptive precision floating-point arithmetic", ccwerrboundA = (3 + 16 u) u with u = 2**-53.
FILTER: Final = 3.3306690738754716e-16
SPLITTER: Final = 134217729.0  # 2**27 + 1
# Some ulps of slack for the x at which a segment passes a slab's border: more looks at a few edges in vain.
SLACK: Final = 1e-14


@kernel
def two_product(a: float, b: float) -> tuple[float, float]:
    """
    Return the rounded product and its exact rounding error (Dekker).

    Examples
    --------
    >>> high, low = two_product(1 + 2**-30, 1 - 2**-30)
    >>> (high, low) == (1.0, -(2**-60))
    True
    """
    product = a * b
    c = SPLITTER * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = SPLITTER * b
    b_high = c - (c - b)
    b_low = b - b_high
    return product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


@kernel
def difference_error(a: float, b: float, difference: float) -> float:
    """
    Return the exact rounding error of ``difference = a - b`` (Knuth).

    Examples
    --------
    >>> difference_error(1.0, 2.0**-60, 1.0) == -(2.0**-60)
    True
    """
    b_virtual = a - difference
    a_virtual = difference + b_virtual
    return (a - a_virtual) + (b_virtual - b)


@kernel
def expansion_sign(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """
    Return the sign of the orientation determinant, from its six exact products.

    Examples
    --------
    >>> expansion_sign(0.0, 0.0, 3.0, 1e-17, 1.0, 1.0)
    1
    """
    left = (ax, -ax, -cx, -ay, ay, cy)
    right = (by, cy, by, bx, cx, bx)
    expansion = np.zeros(12)
    size = 0
    for i in range(6):
        for part in two_product(left[i], right[i]):
            carry = part
            for j in range(size):
                total = carry + expansion[j]
                virtual = total - carry
                expansion[j] = (carry - (total - virtual)) + (expansion[j] - virtual)
                carry = total
            expansion[size] = carry
            size += 1
    for i in range(11, -1, -1):
        if expansion[i] != 0.0:
            return 1 if expansion[i] > 0.0 else -1
    return 0


@kernel
def orientation(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """
    Return 1 where ``c`` is strictly left of ``a -> b``, -1 where strictly right, 0 where exactly in line.

    Examples
    --------
    >>> orientation(0.0, 0.0, 1.0, 1.0, 0.1, 0.1), orientation(0.0, 0.0, 1.0, 1.0, 0.1, 0.1 + 2**-56)
    (0, 1)
    """
    dx_a = ax - cx
    dy_b = by - cy
    dy_a = ay - cy
    dx_b = bx - cx
    left = dx_a * dy_b
    right = dy_a * dx_b
    determinant = left - right
    bound = FILTER * (abs(left) + abs(right))
    if determinant > bound:
        return 1
    if determinant < -bound:
        return -1
    if (
        difference_error(ax, cx, dx_a) != 0.0
        or difference_error(by, cy, dy_b) != 0.0
        or difference_error(ay, cy, dy_a) != 0.0
        or difference_error(bx, cx, dx_b) != 0.0
    ):
        return expansion_sign(ax, ay, bx, by, cx, cy)
    # Exact differences (grids, small integers): rounding keeps order, so the two exact products compare first
    # by their rounded values and then by their errors.
    left, left_error = two_product(dx_a, dy_b)
    right, right_error = two_product(dy_a, dx_b)
    if left == right:
        left, right = left_error, right_error
    return 1 if left > right else (-1 if left < right else 0)


@kernel
def in_sector(vx: float, vy: float, nx: float, ny: float, cx: float, cy: float, x: float, y: float) -> bool:
    """
    Tell whether ``v -> (x, y)`` is strictly in the sector from ``v -> n`` counter-clockwise to ``v -> c``.

    Examples
    --------
    >>> in_sector(0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 3.0), in_sector(0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 2.0, 0.0)
    (True, False)
    """
    left_of_outgoing = orientation(vx, vy, nx, ny, x, y) > 0
    left_of_incoming = orientation(cx, cy, vx, vy, x, y) > 0
    if orientation(cx, cy, vx, vy, nx, ny) > 0:
        return left_of_outgoing and left_of_incoming
    return left_of_outgoing or left_of_incoming


@kernel
def slab_of(y: float, frame: FloatArray, slabs: int) -> int:
    """
    Return the slab of height ``y``, never falling in ``y``, so that two ranges of y that meet share a slab.

    Examples
    --------
    >>> slab_of(0.5, np.array([0.0, 0.0, 1.0, 1.0, 4.0, 0.25, 0.0]), 4)
    2
    """
    return int(min(max((y - frame[1]) * frame[4], 0.0), slabs - 1.0))


@kernel
def first_row(x: float, low: int, high: int, rows: FloatArray) -> int:
    """
    Return the first row in ``low .. high`` of a slab that may reach ``x``; ``high`` where none does.

    Examples
    --------
    >>> first_row(2.0, 0, 2, np.array([[0.0] * 7 + [1.0], [0.0] * 7 + [3.0]]))
    1
    """
    while low < high:
        middle = (low + high) // 2
        if rows[middle, 7] < x:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def point_inside(x: float, y: float, area: AreaArrays) -> bool:
    """
    Tell whether a point is strictly inside the area: exact ray casting, along the slab's shorter side.

    Examples
    --------
    >>> from shapely import box
    >>> from cgla_graph.model.no_fly import NoFlyArea
    >>> area = NoFlyArea(box(0, 0, 1, 1)).kernel_arrays
    >>> point_inside(0.5, 0.5, area), point_inside(0.5, 1.0, area)
    (True, False)
    """
    frame, slab_starts, rows = area
    if x <= frame[0] or x >= frame[2] or y <= frame[1] or y >= frame[3]:
        return False
    slab = slab_of(y, frame, slab_starts.shape[0] - 1)
    start = slab_starts[slab]
    stop = slab_starts[slab + 1]
    reach = first_row(x, start, stop, rows)
    side = 1  # the ray runs right, and so meets the edges that have the point on their left, seen upwards
    if reach - start < stop - reach:
        side = -1
    else:
        start = reach
    inside = False
    for i in range(start, stop):
        if side < 0 and rows[i, 6] > x:
            break
        ax, ay, bx, by = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]
        if (ay > y) == (by > y):
            # No crossing of the ray, but the point may lie on a level edge or an upper end.
            level = ay == y and by == y and min(ax, bx) <= x <= max(ax, bx)
            if level or (ay == y and ax == x) or (by == y and bx == x):
                return False
            continue
        turn = orientation(ax, ay, bx, by, x, y)
        if turn == 0:
            return False
        if turn * side > 0 if by > ay else turn * side < 0:
            inside = not inside
    return inside


@kernel
def on_open_edge(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
    """
    Tell whether a point that is in line with ``a`` and ``b`` lies strictly between them.

    Examples
    --------
    >>> on_open_edge(0.0, 0.0, 2.0, 2.0, 1.0, 1.0), on_open_edge(0.0, 0.0, 2.0, 2.0, 2.0, 2.0)
    (True, False)
    """
    return (min(ax, bx) < x < max(ax, bx)) if ax != bx else (min(ay, by) < y < max(ay, by))


@kernel
def segment_crosses(x1: float, y1: float, x2: float, y2: float, area: AreaArrays) -> bool:
    """
    Tell whether the segment from ``(x1, y1)`` to ``(x2, y2)`` meets the interior; finite, map units.

    Where the segment properly crosses no edge, each interior piece of it begins at its first end or at a
    contact with the boundary: a vertex on the segment, or its first end on an edge. So it is enough to look
    from every contact towards the second end, and to test the first end.

    Examples
    --------
    >>> from shapely import box
    >>> from cgla_graph.model.no_fly import NoFlyArea
    >>> area = NoFlyArea(box(0, 0, 1, 1)).kernel_arrays
    >>> segment_crosses(-1.0, 0.0, 2.0, 0.0, area), segment_crosses(-1.0, 0.0, 2.0, 0.1, area)
    (False, True)
    """
    frame, slab_starts, rows = area
    low_x, high_x = min(x1, x2), max(x1, x2)
    low_y, high_y = min(y1, y2), max(y1, y2)
    # The interior lies strictly inside the bounds, so that touching them is no crossing either.
    if high_x <= frame[0] or low_x >= frame[2] or high_y <= frame[1] or low_y >= frame[3]:
        return False
    if x1 == x2 and y1 == y2:
        return point_inside(x1, y1, area)
    slabs = slab_starts.shape[0] - 1
    first = slab_of(low_y, frame, slabs)
    last = slab_of(high_y, frame, slabs)
    slack = SLACK * (abs(x1) + abs(x2))
    for slab in range(first, last + 1):
        left, right = low_x, high_x
        if first != last:
            # Only the piece of the segment in this slab, or a little more, can meet the slab's edges there.
            bottom = max(low_y, frame[1] + slab * frame[5] - frame[6])
            top = min(high_y, frame[1] + (slab + 1) * frame[5] + frame[6])
            x_bottom = x1 + (bottom - y1) / (y2 - y1) * (x2 - x1)
            x_top = x1 + (top - y1) / (y2 - y1) * (x2 - x1)
            left = max(low_x, min(x_bottom, x_top) - slack)
            right = min(high_x, max(x_bottom, x_top) + slack)
        stop = slab_starts[slab + 1]
        for i in range(first_row(left, slab_starts[slab], stop, rows), stop):
            if rows[i, 6] > right:
                break
            ax, ay, bx, by = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]
            if max(ax, bx) < left or max(ay, by) < low_y or min(ay, by) > high_y:
                continue
            side_1 = orientation(ax, ay, bx, by, x1, y1)
            side_2 = orientation(ax, ay, bx, by, x2, y2)
            if side_1 * side_2 > 0:
                continue
            side_a = orientation(x1, y1, x2, y2, ax, ay)
            side_b = orientation(x1, y1, x2, y2, bx, by)
            if side_a * side_b > 0:
                continue
            if side_1 * side_2 < 0 and side_a * side_b < 0:
                return True
            if side_1 == 0 and side_2 > 0 and on_open_edge(ax, ay, bx, by, x1, y1):
                return True
            # The far end b is the near end of the next edge, which is seen as well.
            on_segment = side_a == 0 and low_x <= ax <= high_x and low_y <= ay <= high_y
            if on_segment and in_sector(ax, ay, bx, by, rows[i, 4], rows[i, 5], x2, y2):
                return True
    return point_inside(x1, y1, area)


@kernel
def segments_cross(starts: FloatArray, ends: FloatArray, area: AreaArrays) -> BoolArray:
    """
    Tell of many segments, ``(n, 2)`` starts and ends in map units, whether each meets the interior; ``(n,)``.

    Examples
    --------
    >>> from shapely import box
    >>> from cgla_graph.model.no_fly import NoFlyArea
    >>> area = NoFlyArea(box(0, 0, 1, 1)).kernel_arrays
    >>> segments_cross(np.array([[-1.0, 0.5]]), np.array([[2.0, 0.5]]), area)
    array([ True])
    """
    result = np.empty(starts.shape[0], dtype=np.bool_)
    for i in range(starts.shape[0]):
        result[i] = segment_crosses(starts[i, 0], starts[i, 1], ends[i, 0], ends[i, 1], area)
    return result


@kernel
def in_line(a: FloatArray, b: FloatArray, c: FloatArray) -> BoolArray:
    """
    Tell of many triples, ``(n, 2)`` points each in map units, whether they are exactly in line; ``(n,)``.

    Examples
    --------
    >>> in_line(np.array([[0.0, 0.0]]), np.array([[1.0, 3.0]]), np.array([[2.0, 6.0]]))
    array([ True])
    """
    result = np.empty(a.shape[0], dtype=np.bool_)
    for i in range(a.shape[0]):
        result[i] = orientation(a[i, 0], a[i, 1], b[i, 0], b[i, 1], c[i, 0], c[i, 1]) == 0
    return result


@kernel
def pair_sectors(edges: FloatArray, order: IntArray) -> None:
    """
    Give every edge the counter-clockwise bound of the sector on its left, at vertices that rings share.

    ``edges`` is ``(n, 6)``, map units: ``ax, ay, bx, by`` and the start of the edge before it in its ring,
    which is overwritten where several edges start at one vertex. ``order`` is ``(n,)``: the edges sorted so
    that those which start at one vertex follow each other.

    Examples
    --------
    >>> edges = np.array([[0, 0, 1, 0, -1, 0], [0, 0, -1, 0, 0, 1]], dtype=float)
    >>> pair_sectors(edges, np.arange(2))
    >>> edges[:, 4:]
    array([[ 0.,  1.],
           [-1.,  0.]])
    """
    n = order.shape[0]
    start = 0
    while start < n:
        vx, vy = edges[order[start], 0], edges[order[start], 1]
        stop = start + 1
        while stop < n and edges[order[stop], 0] == vx and edges[order[stop], 1] == vy:
            stop += 1
        if stop - start > 1:
            ends = np.empty((stop - start, 2))
            for i in range(start, stop):
                ends[i - start, 0] = edges[order[i], 4]
                ends[i - start, 1] = edges[order[i], 5]
            for i in range(start, stop):
                edge = edges[order[i]]
                best_turn = -2
                for x, y in ends:
                    turn = orientation(vx, vy, edge[2], edge[3], x, y)
                    nearer = turn == best_turn and orientation(vx, vy, x, y, edge[4], edge[5]) > 0
                    # Counter-clockwise from the edge come first its left, then its back, then its right.
                    if best_turn == -2 or turn > best_turn or nearer:
                        best_turn = turn
                        edge[4], edge[5] = x, y
        start = stop

"""
Compiled kernels of a proof over points on borders: how far lengths of pairs are lowered, and a check of values.

**Statement.** Let `W` have values at the points of the borders and be linear in between. Let ``I`` and ``J`` be
intervals between neighbours on two sides of a cell of cost ``c``, ``p = (1 - s) v_0 + s v_1`` on ``I`` and ``q = (1 -
t) w_0 + t w_1`` on ``J``. Then ``W(p) - W(q)`` is the mean of the four ``W(v_i) - W(w_j)`` with weights ``a_i b_j``.
If each of them is at most ``c |v_i - w_j| (1 - r)``, it is at most ``c (1 - r) g(s, t)``, where ``g`` is the same
mean of ``|v_i - w_j|``. So it is at most ``c |p - q|`` if ``(1 - r) g <= |p - q|`` on the whole unit square.

**Enclosure of r.** ``f(s, t) = |p - q|`` is convex: on a box of the unit square it is at least its tangent plane
``l`` in the middle. ``l - (1 - r) g`` is bilinear there, so that it is least at a corner of the box: ``r`` is the
greatest of ``1 - l / g`` over the corners of all boxes. Intervals that meet in a corner of the cell, where ``f`` and
``g`` are 0, need no boxes: with ``a = |v_1|`` and ``b = |w_1|`` from there, ``g <= s a + t b <= sqrt(2) f``, so that
``r = 1 - 1 / sqrt(2)``. Points of the same side need ``|W(v) - W(w)| <= c |v - w|`` for neighbours only.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.regions.region_kernels import ends_of, side_of

#: 1 - 1 / sqrt(2), rounded up; and what covers the rounding of one number of the table. (Between points of a side is at
#: least a 600th of it, so that differences of places have relative errors below 1000 ulps.)
AT_CORNER, ROUNDED = 0.29289321881345260, 1e-12


@kernel
def lowering(points: FloatArray, intervals: WholeArray, boxes: int, out: FloatArray) -> None:
    """Write the greatest `r` over the pairs of intervals, rows ``(first, last, side)``, that hold a pair of points."""
    for i in range(intervals.shape[0]):
        a0, a1 = int(intervals[i, 0]), int(intervals[i, 1])
        for j in range(i):
            if intervals[i, 2] == intervals[j, 2]:
                continue
            b0, b1 = int(intervals[j, 0]), int(intervals[j, 1])
            meet = (a0 - b0) * (a0 - b1) * (a1 - b0) * (a1 - b1) == 0
            r = AT_CORNER if meet else _enclosed(points, a0, a1, b0, b1, boxes)
            for v in (a0, a1):
                for w in (b0, b1):
                    if v != w:
                        out[v, w] = max(out[v, w], r)
                        out[w, v] = out[v, w]


@kernel
def _enclosed(points: FloatArray, a0: int, a1: int, b0: int, b1: int, boxes: int) -> float:
    """Bound `r` of two intervals that do not meet; 1 where they are too long for their distance."""
    ux, uy = points[a1, 0] - points[a0, 0], points[a1, 1] - points[a0, 1]
    vx, vy = points[b1, 0] - points[b0, 0], points[b1, 1] - points[b0, 1]
    x, y = points[a0, 0] - points[b0, 0], points[a0, 1] - points[b0, 1]
    d00, d10 = math.hypot(x, y), math.hypot(x + ux, y + uy)
    d01, d11 = math.hypot(x - vx, y - vy), math.hypot(x + ux - vx, y + uy - vy)
    sizes = abs(ux) + abs(uy) + abs(vx) + abs(vy)
    worst = 0.0
    for m in range(boxes):
        for n in range(boxes):
            s, t = (m + 0.5) / boxes, (n + 0.5) / boxes
            px, py = x + s * ux - t * vx, y + s * uy - t * vy
            f = math.hypot(px, py)
            by_s, by_t = (px * ux + py * uy) / f, -(px * vx + py * vy) / f
            # (the tangent plane cancels where intervals are long)
            off = ROUNDED * (f + sizes)
            for up in range(2):
                for right in range(2):
                    s1, t1 = (m + right) / boxes, (n + up) / boxes
                    tangent = f + by_s * (s1 - s) + by_t * (t1 - t) - off
                    mean = (1.0 - s1) * ((1.0 - t1) * d00 + t1 * d01) + s1 * ((1.0 - t1) * d10 + t1 * d11)
                    # (a division takes as long as all else)
                    if tangent < (1.0 - worst) * mean:
                        worst = 1.0 - tangent / mean
    return min(worst + ROUNDED, 1.0)


@kernel
def steepest(
    costs: FloatArray,
    tables: FloatArray,
    table_of: WholeArray,
    horizontal: WholeArray,
    vertical: WholeArray,
    m: int,
    values: FloatArray,
) -> float:
    """
    Return the greatest ratio of a difference of values to the cost of its pair, over all pairs of a cell's border.

    It is at least 1; infinite or NaN if a pair without length differs, or a value is no number.
    """
    rows, columns = costs.shape
    n_corners = (rows + 1) * (columns + 1)
    size = 4 + 4 * m
    nodes: WholeArray = np.empty(size, dtype=np.int64)
    here = np.empty(size)
    worst = 1.0
    for j in range(rows):
        for i in range(columns):
            cost = costs[j, i]
            if cost == math.inf:
                continue
            corner = j * (columns + 1) + i
            for b in range(4):
                nodes[b] = corner + (b & 1) + (b >> 1) * (columns + 1)
            for q in range(4):
                first = n_corners + side_of(j, i, q, horizontal, vertical) * m
                for p in range(m):
                    nodes[4 + q * m + p] = first + p
            for b in range(size):
                here[b] = values[nodes[b]]
            table = tables[table_of[j, i]]
            for a in range(size):
                for b in range(a):
                    apart, most = abs(here[a] - here[b]), cost * table[a, b]
                    # (also if one is no number)
                    if not apart <= worst * most:
                        worst = apart / most if most > 0.0 else math.inf
                        if not worst < math.inf:
                            return worst
    return worst


@kernel
def steepest_along(
    lines: FloatArray, horizontal: WholeArray, vertical: WholeArray, m: int, values: FloatArray
) -> float:
    """Return the greatest ratio of a difference of values to the cost of its interval of a line, as `steepest` does."""
    worst = 1.0
    for kind in (1, 2):
        sides = horizontal if kind == 1 else vertical
        for j in range(sides.shape[0]):
            for i in range(sides.shape[1]):
                if sides[j, i] < 0:
                    continue
                for number in range(m + 1):
                    one, other = ends_of(kind, j, i, number, horizontal, vertical, m)
                    apart, most = abs(values[one] - values[other]), lines[sides[j, i], number]
                    if not apart <= worst * most:
                        worst = apart / most if most > 0.0 else math.inf
                        if not worst < math.inf:
                            return worst
    return worst

"""
Compiled kernels of risk on rasters: density, gradient, line integral, and the least and greatest on a rectangle.

All rasters of a field are one array: `HEADER` numbers of each, then their values one after the other. Places are
measured in cells, from the first grid line on: ``u = (x - x_first) / width``. Between lines ``i`` and ``i + 1``, and
lines ``j`` and ``j + 1``, is one **patch**. A raster read as ``nearest`` has a patch for each cell, on which it is
constant. One read as ``bilinear`` has its lines through the centres of cells, one more on each side that repeats the
outermost values, and is bilinear on each patch; the outer half of the outer patches is not used.

**Line integrals are exact.** A segment is cut where it crosses lines. On a piece, the density is constant, or a
quadratic polynomial, for which Simpson's rule is exact.

**On a line** between two patches of a nearest raster, the density is the lesser of the two values: so a path along the
edge of a risky cell costs no more than paths beside it, and a least-cost path exists (the cost is lower
semicontinuous). The outer edges belong to the raster. A place counts as on a line if rounding may have put it off.
"""

import math
from typing import TypeAlias

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray

#: First grid line, size of a cell, patches along each axis, where its values begin, values in a row, whether it is
#: bilinear, the margin of the outer patches that is not used, what counts as on a line, in cells, and the factor from
#: values to risk.
X_FIRST, Y_FIRST, WIDTH, HEIGHT, COLUMNS, ROWS, OFFSET, IN_ROW, BILINEAR, MARGIN, NEAR_X, NEAR_Y, FACTOR = range(13)
HEADER = 13

#: The headers of all rasters, and all values, shape ``(n,)``: one array, as every array that is
#: handed on costs time. None if there is none: that is another type, for which kernels are compiled without what is
#: below.
Rasters: TypeAlias = FloatArray | None


@kernel
def _count(rasters: FloatArray) -> int:
    """Return how many there are: the values of the first begin after the last header."""
    return int(rasters[OFFSET]) // HEADER


@kernel
def _patch(u: float, count: int) -> int:
    """Return the patch that a place is in, the upper one on a line."""
    return min(max(math.floor(u), 0), count - 1)


@kernel
def _bilinear(u: float, v: float, i: int, j: int, first: int, in_row: int, values: FloatArray) -> float:
    """Interpolate on patch ``(i, j)``."""
    a, b = u - i, v - j
    at = first + j * in_row + i
    low = values[at] * (1.0 - a) + values[at + 1] * a
    high = values[at + in_row] * (1.0 - a) + values[at + in_row + 1] * a
    between: float = low * (1.0 - b) + high * b
    return between


@kernel
def _least_touching(u: float, v: float, head: FloatArray, values: FloatArray) -> float:
    """Return the least value of the cells of a nearest raster that a place touches."""
    columns, rows, first, in_row = int(head[COLUMNS]), int(head[ROWS]), int(head[OFFSET]), int(head[IN_ROW])
    least = math.inf
    for j in range(_patch(v - head[NEAR_Y], rows), _patch(v + head[NEAR_Y], rows) + 1):
        for i in range(_patch(u - head[NEAR_X], columns), _patch(u + head[NEAR_X], columns) + 1):
            least = min(least, values[first + j * in_row + i])
    return least


@kernel
def _is_inside(u: float, v: float, head: FloatArray) -> bool:
    """Tell whether a place is inside a raster, or on its edge."""
    margin = head[MARGIN]
    return bool(
        margin - head[NEAR_X] <= u <= head[COLUMNS] - margin + head[NEAR_X]
        and margin - head[NEAR_Y] <= v <= head[ROWS] - margin + head[NEAR_Y]
    )


@kernel
def density_at(x: float, y: float, rasters: Rasters) -> float:
    """Sum the densities of all rasters at one place; outside its bounds a raster has none."""
    if rasters is None:
        return 0.0
    total = 0.0
    for r in range(_count(rasters)):
        head = rasters[HEADER * r : HEADER * (r + 1)]
        u = (x - head[X_FIRST]) / head[WIDTH]
        v = (y - head[Y_FIRST]) / head[HEIGHT]
        if not _is_inside(u, v, head):
            continue
        if head[BILINEAR] > 0.0:
            i, j = _patch(u, int(head[COLUMNS])), _patch(v, int(head[ROWS]))
            total += head[FACTOR] * _bilinear(u, v, i, j, int(head[OFFSET]), int(head[IN_ROW]), rasters)
        else:
            total += head[FACTOR] * _least_touching(u, v, head, rasters)
    return total


@kernel
def add_densities(points: FloatArray, rasters: FloatArray, out: FloatArray) -> None:
    """Add the densities at `points`, shape ``(n, 2)``, to `out`, shape ``(n,)``."""
    for n in range(points.shape[0]):
        out[n] += density_at(points[n, 0], points[n, 1], rasters)


@kernel
def gradient_at(x: float, y: float, rasters: Rasters) -> tuple[float, float]:
    """Sum the gradients of all rasters at one place: on a line, that of the patch right of and above it."""
    if rasters is None:
        return 0.0, 0.0
    gx, gy = 0.0, 0.0
    for r in range(_count(rasters)):
        head = rasters[HEADER * r : HEADER * (r + 1)]
        u = (x - head[X_FIRST]) / head[WIDTH]
        v = (y - head[Y_FIRST]) / head[HEIGHT]
        if head[BILINEAR] > 0.0 and _is_inside(u, v, head):
            i, j, in_row = _patch(u, int(head[COLUMNS])), _patch(v, int(head[ROWS])), int(head[IN_ROW])
            at = int(head[OFFSET]) + j * in_row + i
            a, b = u - i, v - j
            right = (rasters[at + 1] - rasters[at]) * (1.0 - b) + (rasters[at + in_row + 1] - rasters[at + in_row]) * b
            up = (rasters[at + in_row] - rasters[at]) * (1.0 - a) + (rasters[at + in_row + 1] - rasters[at + 1]) * a
            gx += head[FACTOR] * right / head[WIDTH]
            gy += head[FACTOR] * up / head[HEIGHT]
    return gx, gy


@kernel
def add_gradients(points: FloatArray, rasters: FloatArray, out: FloatArray) -> None:
    """Add the gradients at `points` to `out`, both of shape ``(n, 2)``."""
    for n in range(points.shape[0]):
        gx, gy = gradient_at(points[n, 0], points[n, 1], rasters)
        out[n, 0] += gx
        out[n, 1] += gy


@kernel
def _clipped(start: float, step: float, low: float, high: float) -> tuple[float, float]:
    """Return from which part to which part of a segment ``start + t step``, t in [0, 1], is between two numbers."""
    if step == 0.0:
        return (0.0, 1.0) if low <= start <= high else (1.0, 0.0)
    first, last = (low - start) / step, (high - start) / step
    if first > last:
        first, last = last, first
    return max(first, 0.0), min(last, 1.0)


@kernel
def _on_line(u: float, step: float, near: float) -> bool:
    """Tell whether a segment runs along a grid line."""
    line = math.floor(u + 0.5)
    return abs(u - line) <= near and abs(u + step - line) <= near


@kernel
def _entered(u: float, step: float, t: float, count: int) -> tuple[int, int, float]:
    """Return the patch that a segment is in from `t` on, its direction, and where it meets the next line."""
    at = u + t * step
    if step > 0.0:
        patch = _patch(at, count)
        return patch, 1, (patch + 1 - u) / step
    if step < 0.0:
        patch = min(max(math.ceil(at) - 1, 0), count - 1)
        return patch, -1, (patch - u) / step
    return _patch(at, count), 0, math.inf


@kernel
def _along(u: float, du: float, v: float, dv: float, head: FloatArray, values: FloatArray) -> float:
    """Average one raster over the segment from ``(u, v)`` to ``(u + du, v + dv)``; outside, it counts as 0."""
    margin, near_x, near_y = head[MARGIN], head[NEAR_X], head[NEAR_Y]
    columns, rows = int(head[COLUMNS]), int(head[ROWS])
    first_x, last_x = _clipped(u, du, margin - near_x, columns - margin + near_x)
    first_y, last_y = _clipped(v, dv, margin - near_y, rows - margin + near_y)
    t, end = max(first_x, first_y), min(last_x, last_y)
    if not t < end:
        return 0.0
    i, to_right, next_x = _entered(u, du, t, columns)
    j, upward, next_y = _entered(v, dv, t, rows)
    first, in_row = int(head[OFFSET]), int(head[IN_ROW])
    bilinear = head[BILINEAR] > 0.0
    # along a line between two columns or rows of cells, the lesser value counts
    along_x, along_y = not bilinear and _on_line(u, du, near_x), not bilinear and _on_line(v, dv, near_y)
    total = 0.0
    before = _bilinear(u + t * du, v + t * dv, i, j, first, in_row, values) if bilinear else 0.0
    while True:
        after = min(next_x, next_y, end)
        if after > t:
            if bilinear:
                middle = 0.5 * (t + after)
                here = _bilinear(u + middle * du, v + middle * dv, i, j, first, in_row, values)
                there = _bilinear(u + after * du, v + after * dv, i, j, first, in_row, values)
                total += (after - t) * (before + 4.0 * here + there) / 6.0
                before = there
            elif along_x or along_y:
                middle = 0.5 * (t + after)
                total += (after - t) * _least_touching(u + middle * du, v + middle * dv, head, values)
            else:
                total += (after - t) * values[first + j * in_row + i]
            t = after
        if t >= end:
            return total
        if next_x <= t:
            i += to_right
            next_x = (i + 1 - u) / du if to_right > 0 else (i - u) / du
            # (rounding at the outer edge)
            if i < 0 or i >= columns:
                i, next_x = min(max(i, 0), columns - 1), math.inf
        if next_y <= t:
            j += upward
            next_y = (j + 1 - v) / dv if upward > 0 else (j - v) / dv
            if j < 0 or j >= rows:
                j, next_y = min(max(j, 0), rows - 1), math.inf


@kernel
def raster_risk(x1: float, y1: float, x2: float, y2: float, rasters: Rasters) -> float:
    """Integrate all rasters over a segment: exact up to rounding."""
    if rasters is None:
        return 0.0
    mean = 0.0
    for r in range(_count(rasters)):
        head = rasters[HEADER * r : HEADER * (r + 1)]
        u = (x1 - head[X_FIRST]) / head[WIDTH]
        v = (y1 - head[Y_FIRST]) / head[HEIGHT]
        du = (x2 - head[X_FIRST]) / head[WIDTH] - u
        dv = (y2 - head[Y_FIRST]) / head[HEIGHT] - v
        mean += head[FACTOR] * _along(u, du, v, dv, head, rasters)
    return math.hypot(x2 - x1, y2 - y1) * mean


@kernel
def raster_moments(
    x1: float, y1: float, ux: float, uy: float, length: float, rasters: Rasters
) -> tuple[float, float, float]:
    """
    Integrate ``F``, ``dF/dn`` and ``(s / L) dF/dn`` over a segment from ``(x1, y1)`` along ``u``, ``n`` on its left.

    Where ``F`` jumps by ``J`` across a line with normal ``e``, ``dF/dn`` has a part ``J (n . e) / (u . e)`` at that
    place: turning the segment moves the crossing.
    """
    if rasters is None:
        return 0.0, 0.0, 0.0
    risk, slope, lever = 0.0, 0.0, 0.0
    for r in range(_count(rasters)):
        head = rasters[HEADER * r : HEADER * (r + 1)]
        width, height = head[WIDTH], head[HEIGHT]
        u = (x1 - head[X_FIRST]) / width
        v = (y1 - head[Y_FIRST]) / height
        du, dv = ux * length / width, uy * length / height
        margin, near_x, near_y = head[MARGIN], head[NEAR_X], head[NEAR_Y]
        columns, rows = int(head[COLUMNS]), int(head[ROWS])
        first_x, last_x = _clipped(u, du, margin - near_x, columns - margin + near_x)
        first_y, last_y = _clipped(v, dv, margin - near_y, rows - margin + near_y)
        t, end = max(first_x, first_y), min(last_x, last_y)
        if not t < end:
            continue
        i, to_right, next_x = _entered(u, du, t, columns)
        j, upward, next_y = _entered(v, dv, t, rows)
        first, in_row = int(head[OFFSET]), int(head[IN_ROW])
        bilinear, factor = head[BILINEAR] > 0.0, head[FACTOR]
        along_x, along_y = not bilinear and _on_line(u, du, near_x), not bilinear and _on_line(v, dv, near_y)
        # what turning to the left moves a crossing by, of lines across x and across y
        shift_x = -uy / ux if to_right != 0 else 0.0
        shift_y = ux / uy if upward != 0 else 0.0
        # a jump from outside, and onto each patch after that
        before, shift = 0.0, 0.0
        if t > 0.0:
            shift = shift_x if first_x >= first_y else shift_y
        while True:
            after = min(next_x, next_y, end)
            if after > t:
                middle, share = 0.5 * (t + after), (after - t) * length
                at = first + j * in_row + i
                if bilinear:
                    start = _bilinear(u + t * du, v + t * dv, i, j, first, in_row, rasters)
                    here = _bilinear(u + middle * du, v + middle * dv, i, j, first, in_row, rasters)
                    there = _bilinear(u + after * du, v + after * dv, i, j, first, in_row, rasters)
                    mean = (start + 4.0 * here + there) / 6.0
                    low, high = rasters[at + 1] - rasters[at], rasters[at + in_row + 1] - rasters[at + in_row]
                    left, right = rasters[at + in_row] - rasters[at], rasters[at + in_row + 1] - rasters[at + 1]
                    # across the segment, the slope is linear along it
                    steep = (ux / height) * (left + (u + t * du - i) * (right - left))
                    steep -= (uy / width) * (low + (v + t * dv - j) * (high - low))
                    bend = (ux * du / height) * (right - left) - (uy * dv / width) * (high - low)
                    size = after - t
                    slope += factor * share * (steep + 0.5 * bend * size)
                    lever += factor * share * (steep * middle + bend * size * (0.5 * t + size / 3.0))
                else:
                    mean = rasters[at]
                    if along_x or along_y:
                        mean = _least_touching(u + middle * du, v + middle * dv, head, rasters)
                    start, there = mean, mean
                slope += factor * (start - before) * shift
                lever += factor * (start - before) * shift * t
                risk += factor * share * mean
                before, shift = there, 0.0
                t = after
            if t >= end:
                if t < 1.0:
                    shift = shift_x if last_x <= last_y else shift_y
                    slope -= factor * before * shift
                    lever -= factor * before * shift * t
                break
            if next_x <= t:
                i += to_right
                shift = shift_x
                next_x = (i + 1 - u) / du if to_right > 0 else (i - u) / du
                if i < 0 or i >= columns:
                    i, next_x = min(max(i, 0), columns - 1), math.inf
            if next_y <= t:
                j += upward
                shift = shift_y
                next_y = (j + 1 - v) / dv if upward > 0 else (j - v) / dv
                if j < 0 or j >= rows:
                    j, next_y = min(max(j, 0), rows - 1), math.inf
    return risk, slope, lever


@kernel
def raster_floor(
    low: tuple[float, float], high: tuple[float, float], x: float, y: float, rasters: FloatArray
) -> tuple[float, float, float, float, float]:
    """
    Bound all rasters from below on the rectangle between two corners: by a number, and by a linear function.

    ``F(p) >= least`` and ``F(p) >= value + slope . (p - (x, y)) - drop`` for all ``p`` in the rectangle, which holds
    ``(x, y)``. The slopes are those of central differences across the rectangle. A linear function exceeds a bilinear
    one the most at a corner of a patch's part in the rectangle, so that the drop is exact. A nearest raster, and one
    of whose outside the rectangle has a part, is bounded by its least value.

    Returns
    -------
    value, slope_x, slope_y, drop, least
        Sums over all rasters, risk per unit length (slopes: per squared unit length).
    """
    value, slope_x, slope_y, drop, least = 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(_count(rasters)):
        head = rasters[HEADER * r : HEADER * (r + 1)]
        margin, columns, rows = head[MARGIN], int(head[COLUMNS]), int(head[ROWS])
        # (the stored places may be off by some ulps)
        near_x, near_y = 4.0 * head[NEAR_X], 4.0 * head[NEAR_Y]
        u_low = (low[0] - head[X_FIRST]) / head[WIDTH]
        u_high = (high[0] - head[X_FIRST]) / head[WIDTH]
        v_low = (low[1] - head[Y_FIRST]) / head[HEIGHT]
        v_high = (high[1] - head[Y_FIRST]) / head[HEIGHT]
        if not (
            u_low >= margin - near_x
            and u_high <= columns - margin + near_x
            and v_low >= margin - near_y
            and v_high <= rows - margin + near_y
        ):
            continue
        u_low, u_high = max(u_low - near_x, margin), min(u_high + near_x, columns - margin)
        v_low, v_high = max(v_low - near_y, margin), min(v_high + near_y, rows - margin)
        first, in_row = int(head[OFFSET]), int(head[IN_ROW])
        i_low, i_high = _patch(u_low, columns), _patch(u_high, columns)
        j_low, j_high = _patch(v_low, rows), _patch(v_high, rows)
        here = math.inf
        if head[BILINEAR] == 0.0:
            for j in range(j_low, j_high + 1):
                for i in range(i_low, i_high + 1):
                    here = min(here, rasters[first + j * in_row + i])
            value += head[FACTOR] * here
            least += head[FACTOR] * here
            continue
        u = min(max((x - head[X_FIRST]) / head[WIDTH], u_low), u_high)
        v = min(max((y - head[Y_FIRST]) / head[HEIGHT], v_low), v_high)
        i, j = _patch(u, columns), _patch(v, rows)
        middle = _bilinear(u, v, i, j, first, in_row, rasters)
        right = _bilinear(u_high, v, i_high, j, first, in_row, rasters)
        left = _bilinear(u_low, v, i_low, j, first, in_row, rasters)
        upper = _bilinear(u, v_high, i, j_high, first, in_row, rasters)
        lower = _bilinear(u, v_low, i, j_low, first, in_row, rasters)
        steep_x, steep_y = (right - left) / (u_high - u_low), (upper - lower) / (v_high - v_low)
        worst = 0.0
        for b in range(j_low, j_high + 2):
            vb = min(max(float(b), v_low), v_high)
            for a in range(i_low, i_high + 2):
                ua = min(max(float(a), u_low), u_high)
                at = _bilinear(ua, vb, min(a, i_high), min(b, j_high), first, in_row, rasters)
                here = min(here, at)
                worst = max(worst, middle + steep_x * (ua - u) + steep_y * (vb - v) - at)
        factor = head[FACTOR]
        value += factor * middle
        slope_x += factor * steep_x / head[WIDTH]
        slope_y += factor * steep_y / head[HEIGHT]
        drop += factor * worst
        least += factor * here
    return value, slope_x, slope_y, drop, least


@kernel
def raster_range(low: tuple[float, float], high: tuple[float, float], rasters: Rasters) -> tuple[float, float]:
    """Bound all rasters from below and from above on the rectangle between two corners."""
    if rasters is None:
        return 0.0, 0.0
    least, greatest = 0.0, 0.0
    for r in range(_count(rasters)):
        head = rasters[HEADER * r : HEADER * (r + 1)]
        margin, columns, rows = head[MARGIN], int(head[COLUMNS]), int(head[ROWS])
        near_x, near_y = 4.0 * head[NEAR_X], 4.0 * head[NEAR_Y]
        u_low = (low[0] - head[X_FIRST]) / head[WIDTH] - near_x
        u_high = (high[0] - head[X_FIRST]) / head[WIDTH] + near_x
        v_low = (low[1] - head[Y_FIRST]) / head[HEIGHT] - near_y
        v_high = (high[1] - head[Y_FIRST]) / head[HEIGHT] + near_y
        if u_high < margin or u_low > columns - margin or v_high < margin or v_low > rows - margin:
            continue
        # values at the lines around
        more = 2 if head[BILINEAR] > 0.0 else 1
        smallest, largest = math.inf, 0.0
        for j in range(_patch(v_low, rows), _patch(v_high, rows) + more):
            for i in range(_patch(u_low, columns), _patch(u_high, columns) + more):
                here = rasters[int(head[OFFSET]) + j * int(head[IN_ROW]) + i]
                smallest, largest = min(smallest, here), max(largest, here)
        inside = (
            u_low >= margin - 2.0 * near_x
            and u_high <= columns - margin + 2.0 * near_x
            and v_low >= margin - 2.0 * near_y
            and v_high <= rows - margin + 2.0 * near_y
        )
        least += head[FACTOR] * smallest if inside else 0.0
        greatest += head[FACTOR] * largest
    return least, greatest

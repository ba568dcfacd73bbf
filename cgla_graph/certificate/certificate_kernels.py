"""
Compiled kernels of the certificate: the least cost on a cell, and how steep a spline of costs-to-go is against it.

The values at the nodes of a mesh are the control values of a biquadratic B-spline ``phi``. On a cell, ``phi`` depends
on the 3 x 3 values around, and its gradient has a Bézier form with 3 x 3 control vectors ``v_ab``, which are means of
differences of neighbours. As the length of a vector is convex, ``|grad phi| <= sum B_ab |v_ab|`` with the Bernstein
polynomials ``B_ab``; and ``c >= sum B_ab c_ab``, where the ``c_ab`` are values of a linear lower bound of the cost on
the cell. So the greatest ``|v_ab| / c_ab`` bounds ``|grad phi| / c`` on the whole cell, and is too large by second
order in the spacing only.

Beside a slanted wall, along which a path may run because it costs less the closer it is, some ``c_ab`` are those of
places inside the wall: too low, by first order in the spacing. There the bound is that of strips of the cell's free
part, an eighth of the cell high.
"""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray, WholeArray
from cgla_graph.eikonal.marching_kernels import Mesh, spline_value
from cgla_graph.eikonal.mesh_kernels import STRIPS, Outlines
from cgla_graph.model.risk_kernels import (
    BLOCK,
    END,
    LOG_CUTOFF,
    LOG_PEAK,
    OF_ONE,
    PRECISION,
    WEIGHT,
    X,
    Y,
    deeper_of,
    threats_near,
)
from cgla_graph.model.risk_raster_kernels import Rasters, raster_floor, raster_range

#: A spline over all cells of a box, row by row: controls of its pieces, last node, origin, spacing, control values; and
#: the cap of its values (`tips.EndGrid`).
Box: TypeAlias = tuple[WholeArray, tuple[int, int], tuple[float, float], tuple[float, float], FloatArray, float]
#: Parts of a cell with rasters: lines of theirs may pass its middle.
QUARTERS = 4
#: Columns of the cost bounds: cost at the node, its slopes, how far it may fall below that linear function on the cell,
#: and what the cost is at least there.
COST, SLOPE_X, SLOPE_Y, DROP, LEAST = range(5)
#: Threats above the exponential of this are looked at first: strong ones.
LOG_STRONG = -3.0
#: Where ``prod(1 - f_i)`` is below that, faint threats are not looked at.
SATURATED = 1e-10
#: Rounding of the control values on part of a cell, relative to the greatest of the whole.
NARROWED = 2.0**-49
#: No node's cost is lowered below this: however steep a piece is, it stays above 0.
LEAST_COST = 1e-100


@kernel
def cost_bounds(
    columns: WholeArray,
    rows: WholeArray,
    origin: tuple[float, float],
    spacing: tuple[float, float],
    k: float,
    table: FloatArray,
    out: FloatArray,
) -> None:
    """
    Bound the cost ``c = 1 + k F`` from below on the cell of each node: ``c(p + d) >= cost + slope . d - drop``.

    ``F`` is that of threats (`_risk_on_cell`). Those left out lower the cost by less than 1e-12 k, or 1e-10 of it.
    `out` has shape ``(n, 1, 5)``, or ``(n, 4, 5)`` for four quarters with the same bound, to add rasters to.
    """
    hx, hy = spacing
    delta = 0.5 * math.hypot(hx, hy)
    near = np.empty(table.shape[0], dtype=np.int64)
    count = 0
    for p in range(columns.shape[0]):
        if p % BLOCK == 0:
            left, right, bottom, top = math.inf, -math.inf, math.inf, -math.inf
            for q in range(p, min(p + BLOCK, columns.shape[0])):
                left = min(left, origin[0] + hx * columns[q])
                right = max(right, origin[0] + hx * columns[q])
                bottom = min(bottom, origin[1] + hy * rows[q])
                top = max(top, origin[1] + hy * rows[q])
            count = threats_near((left, bottom), (right, top), table, near)
        x = origin[0] + hx * columns[p]
        y = origin[1] + hy * rows[p]
        if table.shape[1] == OF_ONE:
            risk, gx, gy, bend, least = _risk_on_cell(x, y, delta, table, near[:count])
        else:
            risk, gx, gy, bend, least = _mixed_on_cell(x, y, delta, table, near[:count])
        # the stored place of the node is off by some ulps of its coordinates
        drop = k * (0.5 * delta * delta * bend + 2.0**-50 * (abs(x * gx) + abs(y * gy)))
        for part in range(out.shape[1]):
            bound = out[p, part]
            bound[COST], bound[SLOPE_X], bound[SLOPE_Y] = 1.0 + k * risk, k * gx, k * gy
            bound[DROP], bound[LEAST] = drop, 1.0 + k * least


@kernel
def _risk_on_cell(
    x: float, y: float, delta: float, table: FloatArray, near: IntArray
) -> tuple[float, float, float, float, float]:
    """
    Describe the risk ``F = 1 - prod(1 - f_i)`` of the threats `near` on a cell, half of whose diagonal is `delta`.

    Where strong threats make ``prod(1 - f_i)`` small, faint ones hardly change it and are left out. That can only lower
    ``F``, on all of the cell.

    On the cell ``f_i(p + d) = f_i exp(-q_i (r_i . d + d^2 / 2))``, with ``q_i = 1 / s_i^2``. As ``exp(x) >= 1 + x``,
    ``1 - f_i <= u_i = 1 - f_i + f_i q_i (r_i . d + d^2 / 2)`` there.

    Returns
    -------
    risk
        ``F`` at the middle ``(x, y)``.
    gx, gy
        The gradient of ``F`` there.
    bend
        ``F`` falls below its tangent at the middle by at most half of this times ``d^2``. By the product rule, no
        eigenvalue of the Hessian of ``prod u_i`` is above ``sum f_i q_i prod_j u_j`` without `i`, and ``sum |grad u_i|
        |grad u_j| prod_k u_k`` without `i` and `j`.
    least
        What ``F`` is at least, anywhere on the cell.
    """
    slopes, squares, shares = 0.0, 0.0, 0.0
    # (1 - clear and 1 - most are added up as such: of weak threats, differences from 1 would leave little)
    gx, gy, clear, most, risk, least = 0.0, 0.0, 1.0, 1.0, 0.0, 0.0
    # the greatest that u_i are on the cell: the two least ones, and the product of the others
    first, second, rest = math.inf, math.inf, 1.0
    above, below = LOG_STRONG, math.inf
    for _ in range(2):
        for i in near:
            dx = x - table[i, X]
            dy = y - table[i, Y]
            r2 = dx * dx + dy * dy
            q = table[i, PRECISION]
            exponent = table[i, LOG_PEAK] - 0.5 * q * r2
            if not above < exponent <= below:
                continue
            value = math.exp(exponent)
            r = math.sqrt(r2)
            share = value * q
            slope = share * (r + delta)
            shares += share
            slopes += slope
            squares += slope * slope
            factor = 1.0 - value + share * delta * (r + 0.5 * delta)
            if factor < first:
                first, factor = factor, first
            if factor < second:
                second, factor = factor, second
            if factor < math.inf:
                rest *= factor
            # the product rule as in `risk_kernels.gradient`
            gx = gx * (1.0 - value) - clear * q * dx * value
            gy = gy * (1.0 - value) - clear * q * dy * value
            risk += clear * value
            clear *= 1.0 - value
            # 1 + g + g^2 >= exp(g) up to g = 1
            growth = delta * (r + delta) * q
            growth = 1.0 + growth + growth * growth if growth < 1.0 else math.exp(min(growth, 700.0))
            value /= growth
            least += most * value
            most *= 1.0 - value
        if most <= SATURATED:
            break
        above, below = LOG_CUTOFF - deeper_of(table) - math.log(max(table.shape[0], 1) * most), LOG_STRONG
    bend = rest * ((second if second < math.inf else 1.0) * shares + slopes * slopes - squares)
    # (where squares are beyond the greatest number there is, nothing is known)
    return risk, gx, gy, math.inf if math.isnan(bend) else bend, least


@kernel
def _mixed_on_cell(
    x: float, y: float, delta: float, table: FloatArray, near: IntArray
) -> tuple[float, float, float, float, float]:
    """Describe the risk of a mixture on a cell: the weighted sum of what `_risk_on_cell` says of each group."""
    risk, gx, gy, bend, least = 0.0, 0.0, 0.0, 0.0, 0.0
    first = 0
    while first < near.shape[0]:
        weight, end = table[near[first], WEIGHT], table[near[first], END]
        last = first + 1
        # (rows near are in the table's order)
        while last < near.shape[0] and near[last] < end:
            last += 1
        value, slope_x, slope_y, bends, floor = _risk_on_cell(x, y, delta, table, near[first:last])
        risk += weight * value
        gx += weight * slope_x
        gy += weight * slope_y
        bend += weight * bends
        least += weight * floor
        first = last
    return risk, gx, gy, bend, least


@kernel
def add_rasters(
    columns: WholeArray,
    rows: WholeArray,
    origin: tuple[float, float],
    spacing: tuple[float, float],
    bounds: tuple[float, float, float, float],
    k: float,
    rasters: FloatArray,
    out: FloatArray,
) -> None:
    """
    Add the bound of rasters to that of threats, on the part of each node's cell that is inside `bounds`.

    Each quarter of the cell has one (see `raster_floor`): 0 to 3, lower before upper, left before right. `out` has
    shape ``(n, 4, 5)``.
    """
    for p in range(columns.shape[0]):
        x = origin[0] + spacing[0] * columns[p]
        y = origin[1] + spacing[1] * rows[p]
        for part in range(QUARTERS):
            x_side, y_side = 0.5 * spacing[0] * (2 * (part % 2) - 1), 0.5 * spacing[1] * (2 * (part // 2) - 1)
            low = max(min(x, x + x_side), bounds[0]), max(min(y, y + y_side), bounds[1])
            high = min(max(x, x + x_side), bounds[2]), min(max(y, y + y_side), bounds[3])
            # (a quarter outside the map is not looked at)
            if low[0] < high[0] and low[1] < high[1]:
                value, slope_x, slope_y, drop, least = raster_floor(low, high, x, y, rasters)
                bound = out[p, part]
                bound[COST] += k * value
                bound[SLOPE_X] += k * slope_x
                bound[SLOPE_Y] += k * slope_y
                bound[DROP] += k * drop
                bound[LEAST] += k * least


@kernel
def range_around(
    points: FloatArray,
    reach: tuple[float, float],
    bounds: tuple[float, float, float, float],
    rasters: Rasters,
    out: FloatArray,
) -> None:
    """Bound rasters within `reach` of points inside the bounds, from below and from above; all shapes ``(n, 2)``."""
    for n in range(points.shape[0]):
        x = min(max(points[n, 0], bounds[0]), bounds[2])
        y = min(max(points[n, 1], bounds[1]), bounds[3])
        low = max(x - reach[0], bounds[0]), max(y - reach[1], bounds[1])
        high = min(x + reach[0], bounds[2]), min(y + reach[1], bounds[3])
        out[n, 0], out[n, 1] = raster_range(low, high, rasters)


@kernel
def narrow(values: FloatArray, axis: int, low: float, high: float) -> None:
    """Turn ``(3, 3)`` Bézier control values on [0, 1] along an axis into those on ``[low, high]``, part of it."""
    # (for a transposed array, this would be compiled once more)
    i, j = 1 - axis, axis
    for a in range(3):
        x, y = a * j, a * i
        first, middle, last = values[x, y], values[x + i, y + j], values[x + 2 * i, y + 2 * j]
        begin = (1.0 - low) * first + low * middle
        then = (1.0 - low) * middle + low * last
        values[x, y] = (1.0 - low) * begin + low * then
        values[x + i, y + j] = (1.0 - high) * begin + high * then
        values[x + 2 * i, y + 2 * j] = (1.0 - high) * ((1.0 - high) * first + high * middle) + high * (
            (1.0 - high) * middle + high * last
        )


@kernel
def _gradients(u: FloatArray, spacing: tuple[float, float], vx: FloatArray, vy: FloatArray) -> None:
    """Write the control vectors of a spline's gradient to `vx` and `vy`; its control values are `u`, all ``(3, 3)``."""
    hx, hy = spacing
    for side in range(2):
        low = (u[0, side + 1] - u[0, side]) / hx
        middle = (u[1, side + 1] - u[1, side]) / hx
        high = (u[2, side + 1] - u[2, side]) / hx
        vx[0, 2 * side] = 0.5 * (low + middle)
        vx[1, 2 * side] = middle
        vx[2, 2 * side] = 0.5 * (middle + high)
        low = (u[side + 1, 0] - u[side, 0]) / hy
        middle = (u[side + 1, 1] - u[side, 1]) / hy
        high = (u[side + 1, 2] - u[side, 2]) / hy
        vy[2 * side, 0] = 0.5 * (low + middle)
        vy[2 * side, 1] = middle
        vy[2 * side, 2] = 0.5 * (middle + high)
    for i in range(3):
        vx[i, 1] = 0.5 * (vx[i, 0] + vx[i, 2])
        vy[1, i] = 0.5 * (vy[0, i] + vy[2, i])


@kernel
def _worst(
    vx: FloatArray,
    vy: FloatArray,
    x_part: tuple[float, float],
    y_part: tuple[float, float],
    spacing: tuple[float, float],
    bound: FloatArray,
) -> float:
    """
    Bound the square of ``|grad phi| / c`` on part of a cell, from and to so many spacings from its lower left corner.

    `vx` and `vy` are the control vectors of all of it, shape ``(3, 3)``, which are changed; `bound` is a row of
    `cost_bounds`.
    """
    hx, hy = spacing
    blur = 0.0
    if x_part[0] > 0.0 or x_part[1] < 1.0 or y_part[0] > 0.0 or y_part[1] < 1.0:
        # the part is rounded like the steepest of the whole
        for o in range(9):
            blur = max(blur, abs(vx[o // 3, o % 3]), abs(vy[o // 3, o % 3]))
        blur *= NARROWED
        # (not once for each axis by its number: for a constant, a kernel is compiled anew)
        for axis in range(1, -1, -1):
            low, high = x_part if axis == 1 else y_part
            narrow(vx, axis, low, high)
            narrow(vy, axis, low, high)
    worst = 0.0
    steepest = 0.0
    lowest = math.inf
    for b in range(3):
        y = y_part[0] + 0.5 * b * (y_part[1] - y_part[0]) - 0.5
        for a in range(3):
            x = x_part[0] + 0.5 * a * (x_part[1] - x_part[0]) - 0.5
            least = bound[COST] - bound[DROP] + x * hx * bound[SLOPE_X] + y * hy * bound[SLOPE_Y]
            steep_x = abs(vx[b, a]) + blur
            steep_y = abs(vy[b, a]) + blur
            steep = steep_x * steep_x + steep_y * steep_y
            steepest = max(steepest, steep)
            lowest = min(lowest, least)
            worst = max(worst, steep / max(least * abs(least), 1e-100))
    # a constant bound serves as well
    lowest = max(lowest, bound[LEAST])
    square: float = min(worst, steepest / (lowest * lowest))
    return square


@kernel
def steepness(
    values: FloatArray,
    mesh: Mesh,
    outlines: Outlines,
    checked: BoolArray,
    bounds: FloatArray,
    out: FloatArray,
) -> float:
    """
    Bound ``|grad phi| / c`` on each checked piece, and return the greatest; 0 where it does not matter.

    A piece that no way leads to, all of whose values are infinite, counts as 0. `bounds` are the `cost_bounds` of the
    pieces, or of their quarters. Only the box around each piece counts, and if that is too steep, the strips of it
    (`SplineMesh.outlines`): where paths follow a wall or the rim of the map, it costs less beyond.
    """
    controls, _, _, _, spacing = mesh
    parts, boxes, first_strip, strips = outlines
    part = 1.0 / parts
    u = np.empty((3, 3))
    vx = np.empty((3, 3))
    vy = np.empty((3, 3))
    greatest = 0.0
    for p in range(controls.shape[0]):
        out[p] = 0.0
        if not checked[p]:
            continue
        finite = 0
        for o in range(9):
            u[o // 3, o % 3] = values[controls[p, o]]
            if u[o // 3, o % 3] < math.inf:
                finite += 1
        if finite < 9:
            if finite > 0:
                out[p] = math.inf
                greatest = math.inf
            continue
        left, bottom = boxes[p, 0] * part, boxes[p, 1] * part
        right, top = boxes[p, 2] * part, boxes[p, 3] * part
        in_box, worst = math.inf, 0.0
        # the box, then the strips, in one loop: what a kernel calls is compiled once more for each call
        for turn in range(1 + STRIPS):
            for quarter in range(bounds.shape[1]):
                x_part, y_part = (left, right), (bottom, top)
                if bounds.shape[1] == QUARTERS:
                    x_part = max(left, 0.5 * (quarter % 2)), min(right, 0.5 + 0.5 * (quarter % 2))
                    y_part = max(bottom, 0.5 * (quarter // 2)), min(top, 0.5 + 0.5 * (quarter // 2))
                if x_part[0] < x_part[1] and y_part[0] < y_part[1]:
                    _gradients(u, spacing, vx, vy)
                    worst = max(worst, _worst(vx, vy, x_part, y_part, spacing, bounds[p, quarter]))
            if first_strip[p] < 0 or (turn == 0 and worst <= 1.0):
                break
            if turn == 0:
                in_box, worst = worst, 0.0
            if turn < STRIPS:
                row = first_strip[p] + turn
                left, bottom = strips[row, 0] * part, strips[row, 1] * part
                right, top = strips[row, 2] * part, strips[row, 3] * part
        out[p] = math.sqrt(min(in_box, worst))
        greatest = max(greatest, out[p])
    return greatest


@kernel
def soften(steep: FloatArray, controls: WholeArray, floors: FloatArray, costs: FloatArray) -> None:
    """
    Lower the costs of the nodes around each piece that is too steep, by the worst of their pieces.

    No piece lowers a node below its own floor, shape ``(m,)``: where the spline of a piece of low cost is steep because
    of nodes on the slope beside it, these come down, and the piece, along which paths may run, keeps its cost.
    """
    before = costs.copy()
    for p in range(controls.shape[0]):
        if 1.0 < steep[p] < math.inf:
            for o in range(9):
                q = controls[p, o]
                costs[q] = min(costs[q], max(before[q] / steep[p], min(before[q], floors[p]), LEAST_COST))


@kernel
def cone(dx: float, dy: float, tip: FloatArray) -> tuple[float, float, float]:
    """
    Evaluate ``psi = c r + r (g . d) / 2 - beta r^3 / 3`` at ``d``, where ``r = |d|``, and its gradient.

    `tip` holds ``c, g_x, g_y, beta``. Near its tip, psi is the cost to the source to third order, from below
    (`tips.EndFormula`).
    """
    r = math.hypot(dx, dy)
    along = tip[1] * dx + tip[2] * dy
    value = tip[0] * r + 0.5 * r * along - tip[3] * r * r * r / 3.0
    radial = (tip[0] + 0.5 * along) / r - tip[3] * r
    return value, radial * dx + 0.5 * r * tip[1], radial * dy + 0.5 * r * tip[2]


@kernel
def rim_excess(
    values: FloatArray,
    mesh: Mesh,
    checked: BoolArray,
    source: tuple[float, float],
    centre: tuple[int, int],
    reach: int,
    tip: FloatArray,
) -> float:
    """
    Bound ``phi - psi`` from above over the rim of the block of cells around the source (`cone`).

    The block holds the cells up to `reach` columns and rows from `centre`. On an edge of the rim, psi is above its
    tangent at the middle, less what its second derivative along the edge, at least ``-3 |g| / 2 - 3 beta r``, can
    take away; and ``phi`` less a linear function is below the greatest of its Bézier control values.
    """
    controls, columns, rows, origin, spacing = mesh
    worst = -math.inf
    slope = math.hypot(tip[1], tip[2])
    for p in range(columns.shape[0]):
        di = columns[p] - centre[0]
        dj = rows[p] - centre[1]
        # (a piece that no way leads to has no finite value)
        if max(abs(di), abs(dj)) != reach or not checked[p] or values[controls[p, 4]] == math.inf:
            continue
        for side in range(4):
            across = side < 2
            sign = 1 if side % 2 else -1
            if (di if across else dj) != sign * reach:
                continue
            mx = origin[0] + spacing[0] * columns[p] - source[0]
            my = origin[1] + spacing[1] * rows[p] - source[1]
            if across:
                mx += 0.5 * sign * spacing[0]
            else:
                my += 0.5 * sign * spacing[1]
            height, gx, gy = cone(mx, my, tip)
            half = 0.5 * (spacing[1] if across else spacing[0])
            bend = 1.5 * slope + 3.0 * tip[3] * (math.hypot(mx, my) + half)
            for step in range(-1, 2):
                a = 1 + sign if across else 1 + step
                b = 1 + step if across else 1 + sign
                value = 0.25 * (
                    values[controls[p, 4]]
                    + values[controls[p, 3 + a]]
                    + values[controls[p, 3 * b + 1]]
                    + values[controls[p, 3 * b + a]]
                )
                tangent = height + step * half * (gy if across else gx)
                worst = max(worst, value - tangent + 0.5 * half * half * bend)
    return worst


@kernel
def box_at(x: float, y: float, column: int, row: int, box: Box) -> float:
    """Evaluate the spline over a box on one of its cells, without its cap."""
    controls, last, origin, spacing, values, _ = box
    u = (x - origin[0]) / spacing[0] - column
    v = (y - origin[1]) / spacing[1] - row
    return spline_value(controls[row * (last[0] + 1) + column], u, v, values)


@kernel
def box_cell(at: float, low: float, step: float, last: int) -> int:
    """Return the column or row of a box that holds a coordinate, or the nearest."""
    return min(max(math.floor((at - low) / step + 0.5), 0), last)


@kernel
def box_values(points: FloatArray, box: Box, out: FloatArray) -> None:
    """Evaluate the spline over a box, or its cap if that is less, at points, shape ``(n, 2)``."""
    _, last, origin, spacing, _, cap = box
    for n in range(points.shape[0]):
        x = min(max(points[n, 0], origin[0]), origin[0] + last[0] * spacing[0])
        y = min(max(points[n, 1], origin[1]), origin[1] + last[1] * spacing[1])
        column = box_cell(x, origin[0], spacing[0], last[0])
        row = box_cell(y, origin[1], spacing[1], last[1])
        out[n] = min(box_at(x, y, column, row, box), cap)


@kernel
def box_excess(
    values: FloatArray, mesh: Mesh, checked: BoolArray, centre: tuple[int, int], reach: int, box: Box
) -> float:
    """
    Bound ``phi - psi`` over the rim of a block, as `rim_excess`, where ``psi`` is the lesser of a box's spline and cap.

    Both splines are quadratic on what an edge of the rim and a cell of the box have in common, so that three values
    give the Bézier control values of their difference.
    """
    controls, columns, rows, origin, spacing = mesh
    _, last, low, step, _, cap = box
    worst = -math.inf
    phi = np.empty(3)
    gap = np.empty(3)
    for p in range(columns.shape[0]):
        di = columns[p] - centre[0]
        dj = rows[p] - centre[1]
        if max(abs(di), abs(dj)) != reach or not checked[p] or values[controls[p, 4]] == math.inf:
            continue
        for side in range(4):
            # 0 and 1: the edges to the west and the east, along y
            along = 1 if side < 2 else 0
            sign = 1 if side % 2 else -1
            if (di if along == 1 else dj) != sign * reach:
                continue
            across = 1 - along
            fixed = origin[across] + spacing[across] * ((columns[p] if along == 1 else rows[p]) + 0.5 * sign)
            middle = origin[along] + spacing[along] * (rows[p] if along == 1 else columns[p])
            # (paths stay inside the map, and the box with them)
            if not low[across] <= fixed <= low[across] + last[across] * step[across]:
                continue
            begin = max(middle - 0.5 * spacing[along], low[along])
            end = min(middle + 0.5 * spacing[along], low[along] + last[along] * step[along])
            line = box_cell(fixed, low[across], step[across], last[across])
            first = box_cell(begin, low[along], step[along], last[along])
            for cell in range(first, box_cell(end, low[along], step[along], last[along]) + 1):
                a = begin if cell == first else low[along] + (cell - 0.5) * step[along]
                b = min(end, low[along] + (cell + 0.5) * step[along])
                for i in range(3):
                    at = a + 0.5 * i * (b - a)
                    x, y = (fixed, at) if along == 1 else (at, fixed)
                    column, row = (line, cell) if along == 1 else (cell, line)
                    u = (x - origin[0]) / spacing[0] - columns[p]
                    v = (y - origin[1]) / spacing[1] - rows[p]
                    phi[i] = spline_value(controls[p], u, v, values)
                    gap[i] = phi[i] - box_at(x, y, column, row, box)
                worst = max(worst, gap[0], 2.0 * gap[1] - 0.5 * (gap[0] + gap[2]), gap[2])
                worst = max(worst, max(phi[0], 2.0 * phi[1] - 0.5 * (phi[0] + phi[2]), phi[2]) - cap)
    return worst


@kernel
def least_sums(first: FloatArray, second: FloatArray, controls: WholeArray, out: FloatArray) -> None:
    """Bound the sum of two splines on pieces from below, by its least control value: -infinity if it is undefined."""
    u = np.empty((3, 3))
    for p in range(controls.shape[0]):
        for o in range(9):
            q = controls[p, o]
            u[o // 3, o % 3] = first[q] + second[q]
        least = math.inf
        for b in range(3):
            for a in range(3):
                value = 0.25 * (u[1, 1] + u[1, a] + u[b, 1] + u[b, a])
                least = min(least, value) if value == value else -math.inf  # noqa: PLR0124 - not a number
                if least == -math.inf:
                    break
            if least == -math.inf:
                break
        out[p] = least

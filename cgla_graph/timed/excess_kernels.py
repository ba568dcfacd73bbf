r"""
Compiled kernels that prove: by how much a spline through time falls faster than the cost, and what a path owes for it.

The control values of a layer are those of a quadratic B-spline in ``x``, ``y`` and ``t``. On a cell, ``W_t`` and ``grad
W`` have Bernstein forms with ``3 x 3 x 3`` control values each, raised to the same degree. What a path may lose, ``-
W_t - wind . grad W + v |grad W|``, is convex in them, and the cost is at least a linear function with control values of
its own. So the greatest difference at the 27 places bounds the difference on the whole cell.
"""

import math

import numpy as np

from cgla_graph._kernel import inlined, kernel
from cgla_graph._types import BoolArray, FloatArray, WholeArray
from cgla_graph.timed.floor_kernels import moving_floor, toll_floor
from cgla_graph.timed.march_kernels import STEEPEST, WALL, Flow, SmallArray, burden, travel_time

#: Bound of the relative rounding of what is lost.
ROUNDED = 2.0**-46
#: Bound of the rounding of control values of a part of a cell, and of their differences, relative to the greatest.
CUT = 2.0**-45
#: No cost is lowered by more than this factor, less 1, at once.
MOST_SOFTER = 4.0


@kernel
def _gradients(u: FloatArray, steps: tuple[float, float], gx: FloatArray, gy: FloatArray) -> None:
    """Write the control vectors of the gradient of a biquadratic spline with control values `u`, all ``(3, 3)``."""
    for side in range(2):
        low = (u[0, side + 1] - u[0, side]) / steps[0]
        middle = (u[1, side + 1] - u[1, side]) / steps[0]
        high = (u[2, side + 1] - u[2, side]) / steps[0]
        gx[0, 2 * side], gx[1, 2 * side], gx[2, 2 * side] = 0.5 * (low + middle), middle, 0.5 * (middle + high)
        low = (u[side + 1, 0] - u[side, 0]) / steps[1]
        middle = (u[side + 1, 1] - u[side, 1]) / steps[1]
        high = (u[side + 1, 2] - u[side, 2]) / steps[1]
        gy[2 * side, 0], gy[2 * side, 1], gy[2 * side, 2] = 0.5 * (low + middle), middle, 0.5 * (middle + high)
    for i in range(3):
        gx[i, 1] = 0.5 * (gx[i, 0] + gx[i, 2])
        gy[1, i] = 0.5 * (gy[0, i] + gy[2, i])


@inlined
def _inner(place: float, half: float, low: float, high: float) -> tuple[float, float]:
    """Return middle and half of the part of a cell between two borders, in halves of the cell."""
    begins, ends = max((low - place) / half - 1e-9, -1.0), min((high - place) / half + 1e-9, 1.0)
    # (a narrower part is not worth its rounding)
    begins = min(begins, ends - 0.01)
    return 0.5 * (begins + ends), 0.5 * (ends - begins)


@kernel
def _cut(u: FloatArray, at: tuple[float, float], width: tuple[float, float]) -> None:
    """Replace control values ``(3, 3)`` of a cell by those of a part of it: of a cell as wide as that part."""
    for axis in range(2):
        begins, ends = 0.5 * (1.0 + at[axis] - width[axis]), 0.5 * (1.0 + at[axis] + width[axis])
        for n in range(3):
            row = u[n] if axis == 0 else u[:, n]
            middle = row[1]
            first, last = 0.5 * (row[0] + middle), 0.5 * (middle + row[2])
            # (Bernstein values of the part, by blossoms)
            one, other = first + begins * (middle - first), middle + begins * (last - middle)
            low, between = one + begins * (other - one), one + ends * (other - one)
            one, other = first + ends * (middle - first), middle + ends * (last - middle)
            high = one + ends * (other - one)
            row[0], row[1], row[2] = 2.0 * low - between, between, 2.0 * high - between


@kernel
def in_time(
    layers: tuple[FloatArray, FloatArray, FloatArray],
    durations: tuple[float, float, float],
    j: int,
    i: int,
    values: FloatArray,
    slopes: FloatArray,
) -> None:
    """
    Write the Bernstein form in time of the control values around a node, and of their derivative by time.

    Both have shape ``(3, 3, 3)``: time, row, column. A layer belongs to the middle of its duration.
    """
    before, here, after = durations
    early, late = here / (before + here), here / (here + after)
    for b in range(3):
        for a in range(3):
            first, middle, last = layers[0][j + b - 1, i + a - 1], layers[1][j + b - 1, i + a - 1], 0.0
            last = layers[2][j + b - 1, i + a - 1]
            values[0, b, a] = early * first + (1.0 - early) * middle
            values[1, b, a] = middle
            values[2, b, a] = (1.0 - late) * middle + late * last
            slopes[0, b, a] = 2.0 * (middle - first) / (before + here)
            slopes[2, b, a] = 2.0 * (last - middle) / (here + after)
            slopes[1, b, a] = 0.5 * (slopes[0, b, a] + slopes[2, b, a])


@kernel
def _bent(slopes: FloatArray, turn: FloatArray) -> float:
    """
    Bound what a linear wind times a slope exceeds the wind times the slope at their control places, all 27.

    With the weights ``B_i`` of a place, the mean of the ``w_i`` is the wind there. So the difference is ``sum B_i (w(x)
    - w_i) . (p_i - p)`` for any ``p``, and along each axis the root mean square of ``w(x) - w_i`` is at most
    ``sqrt(1/2)`` times the change from the middle to the border.
    """
    far = 0.0
    for s in range(3):
        for b in range(3):
            for a in range(3):
                px, py = slopes[s, b, a, 0] - slopes[1, 1, 1, 0], slopes[s, b, a, 1] - slopes[1, 1, 1, 1]
                far = max(far, math.hypot(px, py))
    total = 0.0
    for axis in range(3):
        total += math.hypot(turn[axis, 0], turn[axis, 1])
    return math.sqrt(0.5) * total * far * (1.0 + 2.0**-40)


@kernel
def _of_the_part(
    values: FloatArray, slopes: FloatArray, at: tuple[float, float], width: tuple[float, float], weight: float
) -> float:
    """
    Replace the forms of a cell (`in_time`) by those of a part of it, and bound what rounding may change.

    Returns
    -------
    blur
        Where differences of values count with the weight, and slopes with 1.
    """
    blur = weight * np.abs(values).max() + np.abs(slopes).max()
    for s in range(3):
        _cut(values[s], at, width)
        _cut(slopes[s], at, width)
    return float(CUT * blur)


@inlined
def _loss(
    px: float, py: float, rate: float, risk: float, v: float, air: Flow, wind: float, by_ground: bool
) -> tuple[float, float, float, float]:
    """
    Return what a path may lose at most in a unit of time, what it pays at least, and the slope that wind counts with.

    Parameters
    ----------
    px, py, rate
        Slopes by place and by time.
    risk
        Times its weight, by time or by distance.
    v
        Airspeed.
    air, wind
        The wind there, as `march_kernels.Flow`, and its greatest speed.
    by_ground
        Whether risk counts by the distance over a ground that the air moves over.
    """
    fast, wx, wy, per_time, _ = air
    lost = ROUNDED * (abs(rate) + (fast + wind) * math.sqrt(px * px + py * py)) - rate
    if not by_ground:
        paid = v + (risk if per_time else v * risk)
        return lost + fast * math.sqrt(px * px + py * py) - wx * px - wy * py, paid, px, py
    burdened = max(risk, 0.0)
    ux, uy = burden(px, py, burdened, air)
    px, py = px + burdened * ux, py + burdened * uy
    lost += fast * math.sqrt(px * px + py * py) - wx * px - wy * py + ROUNDED * (fast + wind) * burdened
    # (below 0, a floor counts with the greatest ground speed)
    return lost, v + (fast + wind) * min(risk, 0.0), px, py


@kernel
def layer_excess(
    layers: tuple[FloatArray, FloatArray, FloatArray],
    durations: tuple[float, float, float],
    begin: WholeArray,
    end: WholeArray,
    skipped: BoolArray,
    bounds: tuple[float, float, float, float],
    place: tuple[float, float, float],
    k: float,
    threats: FloatArray,
    tolls: FloatArray,
    still: FloatArray,
    winds: FloatArray,
    flow: Flow,
    excess: SmallArray,
    least: SmallArray,
) -> None:
    """
    Bound by how much a spline falls faster than the cost on the cells of one layer.

    Parameters
    ----------
    layers, durations
        Control values of the layer before, of this one and of the next, and how long each is.
    begin, end
        The cells of each row.
    skipped
        Cells that no path enters, or where the spline need not be a bound: their excess is 0.
    bounds
        Of the map: of cells at the border, only the part inside counts.
    place
        Place of the first node, and the distance of neighbours.
    k
        Risk weight.
    threats
        At the middle of the layer's time (`floor_kernels`).
    tolls
        Likewise. A path pays them on any heading, so that they count as a rise of the spline.
    still
        Floors of rasters, shape ``(rows, columns, 5)``, or ``(0, 0, 5)`` without any.
    winds
        The wind on each cell, as `wind_kernels.winds_within` writes it, or ``(0, 0, 9)`` in constant wind. A path may
        get on faster by what it differs from a linear one.
    flow
        See `march_kernels.Flow`.
    excess
        Cost per unit of time, at most so much too steep; negative where it is not. Rounded up.
    least
        What the cost of a unit of time is at least. Rounded down.
    """
    v, wx, wy, per_time, price = flow
    changes = winds.shape[0] > 0
    by_ground = (changes or wx != 0.0 or wy != 0.0) and not per_time
    fast, wind, air = v, math.hypot(wx, wy), flow
    half, reach = 0.5 * place[2], 0.5 * place[2] * (1.0 + 2.0**-40)
    half_time = 0.5 * durations[1] * (1.0 + 2.0**-40)
    values, slopes = np.empty((3, 3, 3)), np.empty((3, 3, 3))
    gx, gy, steepened = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3, 3, 2))
    floor, turn, toll = np.empty(6), np.zeros((3, 2)), np.zeros(4)
    near = np.empty((threats.shape[0], threats.shape[1]))
    scale = 1.0 if per_time else v
    for j in range(excess.shape[0]):
        if begin[j] >= end[j]:
            continue
        y = place[1] + j * place[2]
        at_y, high = _inner(y, half, bounds[1], bounds[3])
        count = 0
        for m in range(threats.shape[0]):
            if abs(y - threats[m, 1]) < 9.0 * threats[m, 4]:
                near[count] = threats[m]
                count += 1
        for i in range(begin[j], end[j]):
            if skipped[j, i]:
                excess[j, i], least[j, i] = 0.0, 0.0
                continue
            x = place[0] + i * place[2]
            at_x, wide = _inner(x, half, bounds[0], bounds[2])
            part = math.sqrt(wide * wide + high * high)
            moving_floor(x + half * at_x, y + half * at_y, reach * part, half_time, near[:count], floor)
            toll_floor(x + half * at_x, y + half * at_y, reach * part, half_time, tolls, toll)
            if still.shape[0]:
                floor[0] += still[j, i, 0] + half * (at_x * still[j, i, 1] + at_y * still[j, i, 2])
                floor[1] += still[j, i, 1]
                floor[2] += still[j, i, 2]
                floor[4] += still[j, i, 3]
                floor[5] += still[j, i, 4]
            if changes:
                east, north, fast = winds[j, i, 0], winds[j, i, 1], v + winds[j, i, 2]
                turn[:] = winds[j, i, 3:].reshape(3, 2)
                wind = math.hypot(east, north) + np.abs(turn).sum()
            in_time(layers, durations, j, i, values, slopes)
            worst, steepest, lowest, blur, known = -math.inf, -math.inf, math.inf, 0.0, 0.0
            if wide < 1.0 or high < 1.0:
                weight = (fast + wind) / (half * min(wide, high))
                blur = _of_the_part(values, slopes, (at_x, at_y), (wide, high), weight)
            for s in range(3):
                _gradients(values[s], (place[2] * wide, place[2] * high), gx, gy)
                for b in range(3):
                    for a in range(3):
                        rate = 0.25 * (slopes[s, 1, 1] + slopes[s, 1, a] + slopes[s, b, 1] + slopes[s, b, a])
                        rate += toll[0] + half * ((a - 1) * wide * toll[1] + (b - 1) * high * toll[2])
                        rate += (s - 1) * half_time * toll[3]
                        risk = floor[0] + half * ((a - 1) * wide * floor[1] + (b - 1) * high * floor[2])
                        risk = k * (risk + (s - 1) * half_time * floor[3] - floor[4])
                        if changes:
                            along, across = at_x + (a - 1) * wide, at_y + (b - 1) * high
                            wx = east + along * turn[0, 0] + across * turn[1, 0] + (s - 1) * turn[2, 0]
                            wy = north + along * turn[0, 1] + across * turn[1, 1] + (s - 1) * turn[2, 1]
                            air = (fast, wx, wy, per_time, price)
                        lost, cost, px, py = _loss(gx[b, a], gy[b, a], rate, risk, v, air, wind, by_ground)
                        lost += blur
                        steepened[s, b, a, 0], steepened[s, b, a, 1] = px, py
                        worst = max(worst, lost - cost)
                        known += lost
                        steepest = max(steepest, lost)
                        lowest = min(lowest, cost)
                        if price < math.inf:
                            # waiting: nothing but time goes on
                            idle = blur - rate + ROUNDED * abs(rate)
                            worst = max(worst, idle - price - scale * risk)
                            steepest = max(steepest, idle + v - price)
                            lowest = min(lowest, price + scale * risk)
            if changes:
                bent = _bent(steepened, turn)
                worst, steepest = worst + bent, steepest + bent
            # a constant bound of the risk serves as well
            constant = v if by_ground else v + scale * k * floor[5]
            if steepest - constant < worst:
                worst, lowest = steepest - constant, constant
                if price < math.inf:
                    lowest = min(lowest, constant - v + price)
            # (what is not a number is too steep without bound)
            if not known < math.inf:
                worst = math.inf
            excess[j, i] = worst * (1.0 + 2.0**-22) if worst > 0.0 else worst * (1.0 - 2.0**-22)
            least[j, i] = lowest - 2.0**-22 * abs(lowest)


@kernel
def steepness(excess: SmallArray, least: SmallArray, begin: WholeArray, end: WholeArray, out: SmallArray) -> None:
    """
    Raise `out` at the nodes around each cell of a layer that is too steep to what is lost there over the cost.

    Parameters
    ----------
    excess, least
        As `layer_excess` writes them.
    begin, end
        The cells of each row.
    out
        Shape ``(rows, columns)``.
    """
    for j in range(excess.shape[0]):
        for i in range(begin[j], end[j]):
            if 0.0 < excess[j, i] < math.inf:
                ratio = 1.0 + excess[j, i] / max(least[j, i], excess[j, i] / MOST_SOFTER)
                for b in range(max(j - 1, 0), min(j + 2, excess.shape[0])):
                    for a in range(max(i - 1, 0), min(i + 2, excess.shape[1])):
                        out[b, a] = max(out[b, a], ratio)


@kernel
def widest(
    values: FloatArray, begin: WholeArray, end: WholeArray, reach: int, shift: tuple[int, int], out: FloatArray
) -> None:
    """
    Write the greatest value within so many cells along x and y, among the cells of `begin` and `end`, or 0.

    Row and column 0 of `values` are those of `shift` in `out`.
    """
    rows, columns = out.shape
    along = np.zeros((values.shape[0], columns))
    for j in range(values.shape[0]):
        for i in range(begin[j], end[j]):
            if values[j, i] > 0.0:
                for a in range(max(i + shift[1] - reach, 0), min(i + shift[1] + reach + 1, columns)):
                    along[j, a] = max(along[j, a], values[j, i])
    out[:] = 0.0
    for j in range(values.shape[0]):
        for b in range(max(j + shift[0] - reach, 0), min(j + shift[0] + reach + 1, rows)):
            for i in range(columns):
                out[b, i] = max(out[b, i], along[j, i])


@kernel
def charge(
    excess: SmallArray,
    least: SmallArray,
    begin: WholeArray,
    end: WholeArray,
    reach: int,
    duration: float,
    scales: FloatArray,
    later: FloatArray,
    later_begin: WholeArray,
    later_end: WholeArray,
    shift: tuple[int, int],
    debts: FloatArray,
) -> None:
    """
    Add what a path may owe within one layer to what it may owe in the layers after it.

    With the spline multiplied by a scale ``a <= 1``, a cell's excess is at most ``a`` times its own, less ``1 - a``
    times the least cost. Within the layer, a path meets only cells within `reach` of the one where it begins.

    Parameters
    ----------
    excess, least
        As `layer_excess` writes them.
    begin, end
        The cells of each row.
    reach
        In cells.
    duration
        Of the layer.
    scales
        Shape ``(m,)``.
    later, later_begin, later_end
        What a path may owe from the next layer on, shape ``(m, …, …)``, and its cells.
    shift
        Row and column of the first of those cells, counted from the first ones of this layer.
    debts
        What it may owe from this layer on, shape ``(m, rows, columns)``.
    """
    rows, columns = excess.shape
    owed, most, after = np.zeros((rows, columns)), np.empty((rows, columns)), np.empty((rows, columns))
    for m in range(scales.shape[0]):
        for j in range(rows):
            for i in range(begin[j], end[j]):
                owed[j, i] = scales[m] * excess[j, i] - (1.0 - scales[m]) * least[j, i]
        widest(owed, begin, end, reach, (0, 0), most)
        widest(later[m], later_begin, later_end, reach, shift, after)
        for j in range(rows):
            for i in range(columns):
                debts[m, j, i] = (after[j, i] + duration * most[j, i]) * (1.0 + 2.0**-50)


@kernel
def least_of_layer(
    layers: tuple[FloatArray, FloatArray, FloatArray],
    durations: tuple[float, float, float],
    begin: WholeArray,
    end: WholeArray,
    out: FloatArray,
) -> None:
    """Bound a spline from below on the cells of one layer: by its least Bernstein value."""
    values, slopes = np.empty((3, 3, 3)), np.empty((3, 3, 3))
    for j in range(1, out.shape[0] - 1):
        for i in range(begin[j], end[j]):
            in_time(layers, durations, j, i, values, slopes)
            least = math.inf
            for s in range(3):
                u = values[s]
                for b in range(3):
                    for a in range(3):
                        least = min(least, 0.25 * (u[1, 1] + u[1, a] + u[b, 1] + u[b, a]))
            out[j, i] = least - 2.0**-48 * abs(least)


@kernel
def tangent(dx: float, dy: float, price: FloatArray) -> tuple[float, float, float]:
    """
    Return the value and the slope by the place of a bound of the cost of ways to an end (`march_kernels.near_end`).

    For the part with the least time, the slope is that of a linear lower bound: no way ``d`` takes less time than ``p .
    d`` if ``wind . p + v |p| <= 1``.
    """
    v, wx, wy = price[5], price[6], price[7]
    r = math.hypot(dx, dy)
    if r == 0.0:
        return 0.0, 0.0, 0.0
    along, cubic = price[2] * dx + price[3] * dy, price[4] * r
    value = r * (price[1] - 0.5 * along - cubic * r / 3.0)
    share = (price[1] - 0.5 * along) / r - cubic
    sx, sy = -share * dx + 0.5 * r * price[2], -share * dy + 0.5 * r * price[3]
    if price[0] > 0.0:
        time = travel_time(dx, dy, v, wx, wy)
        ux, uy = dx - wx * time, dy - wy * time
        size = wx * ux + wy * uy + v * math.hypot(ux, uy)
        if time < math.inf and size > 0.0:
            part = price[0] / size * (1.0 - 2.0**-44)
            value += part * (ux * dx + uy * dy)
            sx, sy = sx - part * ux, sy - part * uy
    return value, sx, sy


@kernel
def rim_excess(
    layers: tuple[FloatArray, FloatArray, FloatArray],
    durations: tuple[float, float, float],
    block: tuple[int, int, int],
    off: tuple[float, float],
    step: float,
    price: FloatArray,
    most: float,
    early: float,
    closed: BoolArray,
    begin: WholeArray,
    end: WholeArray,
) -> float:
    """
    Bound by how much a spline exceeds the cost to an end on the rim of its block, within one layer.

    On a face of a cell, that cost is above its tangent in the middle, less what its second derivative can take away,
    which is at least ``- 3 |g| / 2 - 3 beta r`` in any direction. The spline less a linear function is below the
    greatest of its Bernstein values.

    Parameters
    ----------
    layers, durations
        As of `layer_excess`.
    block, off, step, price
        As of `march_kernels.around_end`; the cost to the end is at least that, or `most` if that is less.
    most
        See above.
    early
        Paths enter the block at the beginning of this layer too, and pay at least that from there; infinite: they do
        not.
    closed, begin, end
        Cells that no path enters, and those of each row that count.
    """
    values, slopes = np.empty((3, 3, 3)), np.empty((3, 3, 3))
    column, row, reach = block
    first = early < math.inf
    worst = -math.inf
    steep = math.hypot(price[2], price[3])
    for j in range(row - reach, row + reach + 1):
        for i in range(column - reach, column + reach + 1):
            west, east, south, north = i == column - reach, i == column + reach, j == row - reach, j == row + reach
            if closed[j, i] or not (first or west or east or south or north):
                continue
            if not begin[j] <= i < end[j]:
                continue
            in_time(layers, durations, j, i, values, slopes)
            for side in range(5):
                if (side == 0 and not west) or (side == 1 and not east) or (side == 2 and not south):
                    continue
                if (side == 3 and not north) or (side == 4 and not first):
                    continue
                x = i - column + 0.5 * ((side == 1) - (side == 0))
                y = j - row + 0.5 * ((side == 3) - (side == 2))
                dx, dy = off[0] - x * step, off[1] - y * step
                middle, sx, sy = tangent(dx, dy, price)
                half = step * (math.sqrt(0.5) if side == 4 else 0.5)
                lost = 0.5 * half * half * (1.5 * steep + 3.0 * price[4] * (math.hypot(dx, dy) + half))
                for s in range(3):
                    if side == 4 and s > 0:
                        break
                    u = values[s]
                    for b in range(3):
                        if (side == 2 and b != 0) or (side == 3 and b != 2):
                            continue
                        for a in range(3):
                            if (side == 0 and a != 0) or (side == 1 and a != 2):
                                continue
                            value = 0.25 * (u[1, 1] + u[1, a] + u[b, 1] + u[b, a])
                            px = (i - column + 0.5 * (a - 1) - x) * step
                            py = (j - row + 0.5 * (b - 1) - y) * step
                            bound = middle + sx * px + sy * py - lost
                            over = max(value - bound, value - most)
                            if side == 4:
                                over = min(over, value - early)
                            worst = max(worst, over)
    return worst + 2.0**-44 * (abs(worst) + abs(most))


@kernel
def prolong(
    before: FloatArray,
    after: FloatArray,
    late: float,
    coarse_place: tuple[float, float, float],
    place: tuple[float, float, float],
    begin: WholeArray,
    end: WholeArray,
    out: FloatArray,
) -> None:
    """
    Interpolate the values of a coarser grid between two of its layers, at the nodes of each row from `begin` to `end`.

    Parameters
    ----------
    before, after
        Values of both layers, shape ``(rows, columns)``; NaN where they are not known.
    late
        The share of the latter one.
    coarse_place, place
        Place of the first node, and the step, of both grids.
    begin, end
        See above.
    out
        Shape ``(rows, columns)``; `WALL` where nothing is known.
    """
    x0, y0, h = coarse_place
    if before.shape[0] < 2 or before.shape[1] < 2:
        return
    for j in range(out.shape[0]):
        if begin[j] >= end[j]:
            continue
        v = (place[1] + j * place[2] - y0) / h
        b = min(max(math.floor(v), 0), before.shape[0] - 2)
        v = min(max(v - b, 0.0), 1.0)
        for i in range(begin[j], end[j]):
            u = (place[0] + i * place[2] - x0) / h
            a = min(max(math.floor(u), 0), before.shape[1] - 2)
            u = min(max(u - a, 0.0), 1.0)
            total, known = 0.0, 0.0
            for corner in range(8):
                q, p = b + corner // 2 % 2, a + corner % 2
                weight = (late if corner // 4 else 1.0 - late) * (v if corner // 2 % 2 else 1.0 - v)
                weight *= u if corner % 2 else 1.0 - u
                value = after[q, p] if corner // 4 else before[q, p]
                if weight > 0.0 and value < STEEPEST:
                    known += weight
                    total += weight * value
            # (beside the last known values, and walls, they go on)
            out[j, i] = min(total / known, WALL) if known > 0.0 else WALL


@kernel
def keep(
    here: tuple[FloatArray, FloatArray],
    debts: tuple[SmallArray, SmallArray],
    blocks: tuple[BoolArray, BoolArray],
    closed: BoolArray,
    begin: WholeArray,
    end: WholeArray,
    scales: tuple[float, float],
    shifts: tuple[float, float],
    limit: float,
    first: WholeArray,
    last: WholeArray,
) -> None:
    """
    Narrow the cells of each row of a layer to those between the first and the last where a path may cost less.

    Parameters
    ----------
    here
        Least values of both surfaces on the cells.
    debts
        What paths may owe from there, and up to there.
    blocks
        Cells where either surface is no bound and counts as 0.
    closed
        Cells that no path enters.
    begin, end
        The cells of each row.
    scales, shifts
        Both surfaces are multiplied by the scale, then lowered by the shift.
    limit
        The cost.
    first, last
        The new cells of each row.
    """
    for j in range(begin.shape[0]):
        first[j], last[j] = 0, 0
        for i in range(begin[j], end[j]):
            if closed[j, i]:
                continue
            total = 0.0
            if not blocks[0][j, i]:
                total += max(scales[0] * here[0][j, i] - shifts[0] - debts[0][j, i], 0.0)
            if not blocks[1][j, i]:
                total += max(scales[1] * here[1][j, i] - shifts[1] - debts[1][j, i], 0.0)
            # (a sum that is undefined is no reason to leave a cell out)
            if not total >= limit:
                if last[j] == 0:
                    first[j] = i
                last[j] = i + 1

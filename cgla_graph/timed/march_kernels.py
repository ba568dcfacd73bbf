r"""
Compiled kernels that march costs-to-go through time: not proven, but of second order and more where they are smooth.

With the time ``s`` that is left, ``W_s + v |grad W| - wind . grad W = v + k r``: fronts that come from the goal. The
derivatives are those of a weighted scheme of third order (WENO, Jiang and Peng 2000) on the side that fronts come from
(Godunov), and time is stepped by Heun's method. Values of `WALL` and more are those of places from where no path leads
on; no derivative uses them.
"""

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgla_graph._kernel import inlined, kernel
from cgla_graph._types import BoolArray, FloatArray, WholeArray

#: The cost-to-go where no path leads on.
WALL = 1e30
#: Steeper than this is no slope, but the side of a wall.
STEEPEST = 1e20
#: Of half the size, where a few digits are enough.
SmallArray: TypeAlias = NDArray[np.float32]
#: Speed, wind, whether risk counts per unit of time, and the price of waiting (infinite: none).
Flow: TypeAlias = tuple[float, float, float, bool, float]
#: Turns of the search for the best heading where risk counts by the ground distance, and one that ends it.
TURNS, LEAST_TURN = 4, 1e-7
#: One heading is enough where slopes on both sides of a node differ by no more than this part, and the velocity is so
#: far off the axes, in airspeeds.
ALIKE, OFF_AXES = 0.2, 0.2


@inlined
def _slope(a: float, b: float, c: float, d: float) -> float:
    """Return the derivative at the third of four values, times the step, from the side of the first."""
    first, second, third = b - a, c - b, d - c
    if abs(first) > STEEPEST:
        # beside a wall, no more than half as much again as the step itself
        most = 0.5 * abs(second)
        return second + min(max(0.5 * (third - second), -most), most)
    one, other = second - first, third - second
    least = 1e-14 * (second * second + third * third) + 1e-280
    ratio = (least + one * one) / (least + other * other)
    weight = 1.0 / (1.0 + 2.0 * ratio * ratio)
    return 0.5 * (second * (1.0 + 2.0 * weight) + third * (1.0 - weight) - weight * first)


@kernel
def travel_time(dx: float, dy: float, v: float, wx: float, wy: float) -> float:
    """Return the least time in which a way is flown in constant wind, without risk; infinite if it is too strong."""
    d2 = dx * dx + dy * dy
    if d2 == 0.0:
        return 0.0
    along = dx * wx + dy * wy
    excess = v * v - wx * wx - wy * wy
    root = along * along + excess * d2
    if root < 0.0:
        return math.inf
    # (the form without cancellation)
    slow = along + math.sqrt(root)
    return d2 / slow if slow > 0.0 else math.inf


@inlined
def _best_course(gx: float, gy: float, risk: float, v: float, wx: float, wy: float) -> tuple[float, float]:
    """Return the velocity ``g = w + v e`` over ground of least ``risk |g| + grad . g``, for a gradient other than 0."""
    # (by Newton's method over the heading, from straight down)
    steep = math.hypot(gx, gy)
    ex, ey = -gx / steep, -gy / steep
    if risk > 0.0:
        for _ in range(TURNS):
            ax, ay = wx + v * ex, wy + v * ey
            speed = math.hypot(ax, ay)
            if speed == 0.0:
                break
            across = wy * ex - wx * ey
            slope = risk * across / speed + gy * ex - gx * ey
            bend = -risk / speed * (wx * ex + wy * ey + v * across * across / (speed * speed)) - gx * ex - gy * ey
            turn = min(max(-slope / bend, -1.0), 1.0) if bend > 0.0 else 0.0
            if abs(turn) < LEAST_TURN:
                break
            ex, ey = ex - turn * ey, ey + turn * ex
            size = math.hypot(ex, ey)
            ex, ey = ex / size, ey / size
    return wx + v * ex, wy + v * ey


@inlined
def _descent(west: float, east: float, south: float, north: float, risk: float, flow: Flow) -> float:
    """
    Return the least ``risk |g| + g . grad`` over all velocities ``g``, with the derivatives on the side it leads to.

    Never more than 0 where the wind allows to stay in one place. As each velocity takes the values that it meets, the
    least of them is monotone in all values, whatever their slopes.
    """
    v, wx, wy, _, _ = flow
    best = 0.0 if wx * wx + wy * wy <= v * v else math.inf
    # (where both sides nearly agree, and the best velocity is well off the axes, no other one meets other values)
    px, py = 0.5 * (west + east), 0.5 * (south + north)
    if abs(west - east) + abs(south - north) < ALIKE * (abs(px) + abs(py)) and px * px + py * py > risk * risk:
        ax, ay = _best_course(px, py, risk, v, wx, wy)
        if min(abs(ax), abs(ay)) > OFF_AXES * v:
            px, py = east if ax > 0.0 else west, north if ay > 0.0 else south
            return min(best, risk * math.hypot(ax, ay) + ax * px + ay * py)
    for side in range(2):
        # along an axis
        px = east if side else -west
        py = north if side else -south
        sign = 1.0 if side else -1.0
        if risk + px < 0.0 and abs(wy) <= v:
            speed = sign * wx + math.sqrt(v * v - wy * wy)
            best = min(best, (risk + px) * max(speed, 0.0))
        if risk + py < 0.0 and abs(wx) <= v:
            speed = sign * wy + math.sqrt(v * v - wx * wx)
            best = min(best, (risk + py) * max(speed, 0.0))
    for corner in range(4):
        px = east if corner % 2 else west
        py = north if corner // 2 else south
        if max(abs(px), abs(py)) > STEEPEST or px * px + py * py <= risk * risk:
            continue
        ax, ay = _best_course(px, py, risk, v, wx, wy)
        if (ax > 0.0) == (corner % 2 == 1) and (ay > 0.0) == (corner // 2 == 1):
            best = min(best, risk * math.hypot(ax, ay) + ax * px + ay * py)
    return best


@kernel
def burden(gx: float, gy: float, risk: float, flow: Flow) -> tuple[float, float]:
    """
    Return a direction ``u``, at most of length 1, so that risk by the ground distance counts as a gradient ``risk u``.

    For every ``|u| <= 1`` and each heading, ``|g| >= u . g`` for the ground speed ``g``; with ``u`` along the best
    ``g``, nothing is lost.
    """
    v, wx, wy, _, _ = flow
    steep = math.hypot(gx, gy)
    if steep == 0.0:
        return 0.0, 0.0
    if (wx == 0.0 and wy == 0.0) or (steep <= risk and wx * wx + wy * wy <= v * v):
        # (the least of ``v |q| - wind . q`` is at ``q = 0``, if that is within reach)
        share = -(1.0 - 2.0**-50) / max(steep, risk)
        return share * gx, share * gy
    ax, ay = _best_course(gx, gy, risk, v, wx, wy)
    speed = math.hypot(ax, ay)
    if speed == 0.0:
        return 0.0, 0.0
    # (a trifle shorter than 1, whatever the rounding)
    return ax / speed * (1.0 - 2.0**-50), ay / speed * (1.0 - 2.0**-50)


@kernel
def fall(
    values: FloatArray,
    risks: FloatArray,
    factors: FloatArray,
    winds: FloatArray,
    begin: WholeArray,
    end: WholeArray,
    step: float,
    flow: Flow,
    out: FloatArray,
) -> None:
    """
    Write the derivative of the costs-to-go by the time left at the nodes of one layer to `out`.

    Parameters
    ----------
    values
        Costs-to-go, shape ``(rows, columns)``.
    risks
        ``k F`` at the nodes.
    factors
        What the cost is multiplied by there.
    winds
        The wind there, and by how much it may be stronger, as in the first of the ``(rows, columns, 9)`` numbers of
        `wind_kernels.winds_within`. Or ``(0, 0, 9)``, in constant wind.
    begin, end
        The nodes of each row, two or more away from the rim.
    step
        Between neighbours, map units.
    flow
        See `Flow`.
    out
        As `values`.
    """
    v, wx, wy, per_time, price = flow
    changes = winds.shape[0] > 0
    windy = changes or wx != 0.0 or wy != 0.0
    air = flow
    for j in range(2, values.shape[0] - 2):
        for i in range(begin[j], end[j]):
            here = values[j, i]
            if changes:
                air = (v + winds[j, i, 2], winds[j, i, 0], winds[j, i, 1], per_time, price)
            west = _slope(values[j, i - 2], values[j, i - 1], here, values[j, i + 1]) / step
            east = -_slope(values[j, i + 2], values[j, i + 1], here, values[j, i - 1]) / step
            south = _slope(values[j - 2, i], values[j - 1, i], here, values[j + 1, i]) / step
            north = -_slope(values[j + 2, i], values[j + 1, i], here, values[j - 1, i]) / step
            risk = factors[j, i] * risks[j, i]
            rate = factors[j, i] * v + risk * (1.0 if per_time else 0.0 if windy else v)
            if windy:
                descent = _descent(west, east, south, north, 0.0 if per_time else risk, air)
                rate = rate + descent if descent < math.inf else 0.0
            else:
                gx = max(west, -east, 0.0)
                gy = max(south, -north, 0.0)
                rate -= v * math.sqrt(gx * gx + gy * gy)
            if price < math.inf:
                rate = min(rate, factors[j, i] * price + (risk if per_time else v * risk))
            out[j, i] = rate


@kernel
def near_end(dx: float, dy: float, price: FloatArray) -> float:
    """
    Bound the cost of a way to an end: ``a T + c r + r (g . d) / 2 - beta r^3 / 3`` from ``d`` off the end.

    `dx` and `dy` are the way to the end, ``-d``; ``T`` is the least time that it takes (`travel_time`) with the speed
    ``v`` in the wind ``w``. `price` holds ``a, c, g, beta, v, w``, shape ``(8,)``.
    """
    r = math.hypot(dx, dy)
    cost = r * (price[1] - 0.5 * (price[2] * dx + price[3] * dy) - price[4] * r * r / 3.0)
    if price[0] > 0.0:
        cost += price[0] * travel_time(dx, dy, price[5], price[6], price[7])
    return float(cost)


@kernel
def around_end(
    values: FloatArray,
    block: tuple[int, int, int],
    off: tuple[float, float],
    step: float,
    price: FloatArray,
) -> None:
    """
    Set the nodes of a block around an end to the cost of their way to it (`near_end`).

    `block` holds column and row of its middle and its reach, `off` the way from its middle to the end.
    """
    column, row, reach = block
    rows, columns = values.shape
    for j in range(max(row - reach, 0), min(row + reach + 1, rows)):
        for i in range(max(column - reach, 0), min(column + reach + 1, columns)):
            cost = near_end(off[0] - (i - column) * step, off[1] - (j - row) * step, price)
            values[j, i] = min(cost, WALL)


@inlined
def _enter(
    values: FloatArray, risk: FloatArray, walls: BoolArray, runs: tuple[WholeArray, WholeArray], step: float
) -> None:
    """Set nodes from where no path led on, and are walls no more, to a step more than their least neighbour."""
    fresh = [(0, 0, 0.0) for _ in range(0)]
    for j in range(2, values.shape[0] - 2):
        for i in range(runs[0][j], runs[1][j]):
            if values[j, i] > STEEPEST and not walls[j, i]:
                near = min(values[j, i - 1], values[j, i + 1], values[j - 1, i], values[j + 1, i])
                if near < STEEPEST:
                    fresh.append((j, i, near + step * (1.0 + risk[j, i])))
    for j, i, value in fresh:
        values[j, i] = value


@kernel
def advance(
    values: FloatArray,
    rates: FloatArray,
    risks: tuple[FloatArray, FloatArray],
    factors: tuple[SmallArray, SmallArray],
    winds: tuple[FloatArray, FloatArray],
    runs: tuple[WholeArray, WholeArray],
    walls: BoolArray,
    block: tuple[int, int, int],
    off: tuple[float, float],
    prices: FloatArray,
    step: float,
    duration: float,
    turns: int,
    flow: Flow,
) -> None:
    """
    March the costs-to-go by one layer, in place.

    Parameters
    ----------
    values
        At the later layer: of the nodes that are marched and of two around each.
    rates
        How fast the values of the nodes around change, by the time left.
    risks, factors, winds
        As of `fall`, at the later layer and at this one.
    runs
        First and last column (exclusive) of each row that is marched, shape ``(rows,)``.
    walls
        Nodes from where no path leads on.
    block, off
        As of `around_end`; with a reach below 0, there is none.
    prices
        As of `around_end`, at the later layer and at this one, shape ``(2, 8)``.
    step
        Between neighbours, map units.
    duration
        Between the layers.
    turns
        Steps of time.
    flow
        See `Flow`.
    """
    begin, end = runs
    rows, columns = values.shape
    now, then = np.zeros((rows, columns)), np.zeros((rows, columns))
    risk, factor = np.empty((rows, columns)), np.empty((rows, columns))
    middle, air = np.empty((rows, columns)), np.zeros_like(winds[0])
    part = duration / turns
    for turn in range(turns):
        for half in range(2):
            share = (turn + half) / turns
            for j in range(rows):
                for i in range(begin[j], end[j]):
                    risk[j, i] = (1.0 - share) * risks[0][j, i] + share * risks[1][j, i]
                    factor[j, i] = (1.0 - share) * factors[0][j, i] + share * factors[1][j, i]
                    if air.size:
                        for c in range(3):
                            air[j, i, c] = (1.0 - share) * winds[0][j, i, c] + share * winds[1][j, i, c]
            later = share if half == 1 else (turn + 1) / turns
            price = (1.0 - later) * prices[0] + later * prices[1]
            if half == 0:
                _enter(values, risk, walls, runs, step)
                fall(values, risk, factor, air, begin, end, step, flow, now)
                for j in range(rows):
                    for i in range(columns):
                        if begin[j] <= i < end[j]:
                            middle[j, i] = WALL if walls[j, i] else min(values[j, i] + part * now[j, i], WALL)
                        else:
                            middle[j, i] = values[j, i] + part * rates[j, i]
                if block[2] >= 0:
                    around_end(middle, block, off, step, price)
            else:
                fall(middle, risk, factor, air, begin, end, step, flow, then)
                for j in range(rows):
                    for i in range(columns):
                        if begin[j] <= i < end[j]:
                            new = values[j, i] + 0.5 * part * (now[j, i] + then[j, i])
                            values[j, i] = WALL if walls[j, i] else min(new, WALL)
                        else:
                            values[j, i] = middle[j, i]
                if block[2] >= 0:
                    around_end(values, block, off, step, price)

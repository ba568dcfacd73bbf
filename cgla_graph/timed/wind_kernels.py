"""
Compiled kernels of wind on a grid: how long a straight leg takes in it, and which risk is gathered on the way.

Along a leg with direction ``e``, the place changes as ``ds/dt = w . e + sqrt(v^2 - (w x e)^2)``. The time at each place
follows from ``dt/ds``, by collocation in the nodes of Gauss, on panels that end where a row or column of nodes is
crossed, and are halved until time and risk agree with those of their halves.
"""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.model.risk_kernels import LOG_PEAK, PRECISION, SPREAD, Field, X, Y
from cgla_graph.model.risk_raster_kernels import density_at
from cgla_graph.timed.leg_kernels import VX, VY, WIDE, WIDE_RATE, moving_risk_at

#: Components of the wind, shape ``(times, rows, columns)``; times; ``x`` and ``y`` of the first node, and the steps.
WindArrays: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray]

N_NODES = 12
#: Time and risk of a panel agree with those of its halves to within these parts of those of a whole leg in still air.
AGREE = 1e-13
#: Panels are no shorter than this part of the leg.
SHORTEST = 1e-9


def _collocation() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return nodes on [0, 1], weights, and the matrix that integrates from 0 to each node."""
    nodes, weights = np.polynomial.legendre.leggauss(N_NODES)
    at_nodes = np.polynomial.legendre.legvander(nodes, N_NODES)
    integrals = np.empty((N_NODES, N_NODES))
    for order in range(N_NODES):
        # (the integral of P_n is (P_{n+1} - P_{n-1}) / (2n + 1), that of P_0 is x + 1)
        below = at_nodes[:, order - 1] if order else -np.ones(N_NODES)
        integrals[:, order] = (at_nodes[:, order + 1] - below) / (2 * order + 1)
    expansion = (at_nodes[:, :N_NODES] * weights[:, None] * (np.arange(N_NODES) + 0.5)).T
    return 0.5 * (nodes + 1.0), 0.5 * weights, np.ascontiguousarray(0.5 * integrals @ expansion)


NODES, WEIGHTS, PRIMITIVE = _collocation()


@kernel
def _cell(value: float, count: int) -> tuple[int, float]:
    """Return the cell of a place on an axis of so many nodes, and the share of it; clipped to the axis."""
    if count == 1:
        return 0, 0.0
    inside = min(max(value, 0.0), count - 1.0)
    cell = min(int(inside), count - 2)
    return cell, inside - cell


@kernel
def _between(values: FloatArray, i: int, a: float, j: int, b: float) -> float:
    """Interpolate one component at one time."""
    right, above = min(i + 1, values.shape[1] - 1), min(j + 1, values.shape[0] - 1)
    low = (1.0 - a) * values[j, i] + a * values[j, right]
    high = (1.0 - a) * values[above, i] + a * values[above, right]
    between: float = (1.0 - b) * low + b * high
    return between


@kernel
def _lines(low: float, high: float, first: float, spacing: float, count: int) -> tuple[int, int]:
    """Return the rows or columns of nodes between two places: the first, and the one after the last."""
    if count == 1:
        return 0, 0
    begin = min(max((low - first) / spacing, -1.0), float(count))
    end = min(max((high - first) / spacing, -1.0), float(count))
    after = max(math.floor(begin) + 1, 0)
    return after, max(min(math.ceil(end), count), after)


@kernel
def wind_at(x: float, y: float, t: float, wind: WindArrays) -> tuple[float, float]:
    """Evaluate the wind at a place and time."""
    u, v, times, nodes = wind
    i, a = _cell((x - nodes[0]) / nodes[2], u.shape[2])
    j, b = _cell((y - nodes[1]) / nodes[3], u.shape[1])
    n, c = 0, 0.0
    if times.shape[0] > 1:
        n = min(max(np.searchsorted(times, t, side="right") - 1, 0), times.shape[0] - 2)
        c = min(max((t - times[n]) / (times[n + 1] - times[n]), 0.0), 1.0)
    east, north = _between(u[n], i, a, j, b), _between(v[n], i, a, j, b)
    if c > 0.0:
        east = (1.0 - c) * east + c * _between(u[n + 1], i, a, j, b)
        north = (1.0 - c) * north + c * _between(v[n + 1], i, a, j, b)
    return east, north


@kernel
def winds_at(points: FloatArray, t: float, wind: WindArrays, out: FloatArray) -> None:
    """Write the wind at `points`, shape ``(n, 2)``, to `out`, shape ``(n, 2)``."""
    for n in range(points.shape[0]):
        out[n, 0], out[n, 1] = wind_at(points[n, 0], points[n, 1], t, wind)


@kernel
def wind_within(
    low: tuple[float, float], high: tuple[float, float], times: tuple[float, float], wind: WindArrays, out: FloatArray
) -> None:
    """
    Write a linear wind in a box in space and time, and by how much the wind differs from it there, at most.

    Between the lines of its grid, the wind is linear along each axis: the difference is greatest at a corner.

    Parameters
    ----------
    low, high, times, wind
        Corners of the box, its first and last time, and the wind.
    out
        Shape ``(9,)``: the wind in the middle, the greatest difference, and by how much the linear wind changes from
        the middle to the borders, along `x`, `y` and `t`.
    """
    u, _, hours, nodes = wind
    x, y, t = 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (times[0] + times[1])
    east, north = wind_at(x, y, t, wind)
    for axis in range(3):
        here = (high[0] if axis == 0 else x, high[1] if axis == 1 else y, times[1] if axis == 2 else t)
        there = (low[0] if axis == 0 else x, low[1] if axis == 1 else y, times[0] if axis == 2 else t)
        one, other = wind_at(here[0], here[1], here[2], wind), wind_at(there[0], there[1], there[2], wind)
        out[3 + 2 * axis], out[4 + 2 * axis] = 0.5 * (one[0] - other[0]), 0.5 * (one[1] - other[1])
    worst = 0.0
    columns = _lines(low[0], high[0], nodes[0], nodes[2], u.shape[2])
    rows = _lines(low[1], high[1], nodes[1], nodes[3], u.shape[1])
    first = np.searchsorted(hours, times[0], side="right")
    last = np.searchsorted(hours, times[1], side="left") if hours.shape[0] > 1 else first - 1
    for n in range(first - 1, last + 1):
        when = times[0] if n < first else times[1] if n == last else hours[n]
        c = 2.0 * (when - t) / (times[1] - times[0])
        for j in range(rows[0] - 1, rows[1] + 1):
            py = low[1] if j < rows[0] else high[1] if j == rows[1] else nodes[1] + j * nodes[3]
            b = 2.0 * (py - y) / (high[1] - low[1])
            for i in range(columns[0] - 1, columns[1] + 1):
                px = low[0] if i < columns[0] else high[0] if i == columns[1] else nodes[0] + i * nodes[2]
                a = 2.0 * (px - x) / (high[0] - low[0])
                wx, wy = wind_at(px, py, when, wind)
                wx -= east + a * out[3] + b * out[5] + c * out[7]
                wy -= north + a * out[4] + b * out[6] + c * out[8]
                worst = max(worst, math.hypot(wx, wy))
    out[0], out[1], out[2] = east, north, worst * (1.0 + 2.0**-40)
    rounding = 2.0**-40 * (abs(out[0]) + abs(out[1]) + np.abs(out[3:]).sum())
    out[2] += rounding


@kernel
def winds_within(
    begin: WholeArray,
    end: WholeArray,
    place: tuple[float, float, float],
    times: tuple[float, float],
    wind: WindArrays,
    out: FloatArray,
) -> None:
    """
    Write the linear wind in cells and by how much the wind differs from it (`wind_within`), ``(rows, columns, 9)``.

    `begin` and `end` are the cells of each row, `place` that of the first one and the step.
    """
    half = 0.5 * place[2]
    for j in range(out.shape[0]):
        y = place[1] + j * place[2]
        for i in range(begin[j], end[j]):
            x = place[0] + i * place[2]
            wind_within((x - half, y - half), (x + half, y + half), times, wind, out[j, i])


@kernel
def speed_along(x: float, y: float, t: float, ex: float, ey: float, speed: float, wind: WindArrays) -> float:
    """Return the speed over the ground in a direction, the faster one; -1 if the wind does not allow it."""
    east, north = wind_at(x, y, t, wind)
    across = ex * north - ey * east
    if abs(across) > speed:
        return -1.0
    return east * ex + north * ey + math.sqrt(speed * speed - across * across)


@kernel
def _risk_at(x: float, y: float, after: float, moving: FloatArray, field: Field, with_rasters: bool) -> float:
    """Evaluate the risk at a place, some time after a slab begins."""
    clear, risk = 1.0, 0.0
    table = field[0]
    for i in range(table.shape[0]):
        dx, dy = x - table[i, X], y - table[i, Y]
        f = math.exp(table[i, LOG_PEAK] - 0.5 * table[i, PRECISION] * (dx * dx + dy * dy))
        risk += f * clear
        clear *= 1.0 - f
    for i in range(moving.shape[0]):
        f = moving_risk_at(after, x, y, (0.0, 0.0, 1.0), moving, i)
        risk += f * clear
        clear *= 1.0 - f
    return risk + density_at(x, y, field[3]) if with_rasters else risk


@kernel
def _panel(
    leg: FloatArray,
    panel: tuple[float, float],
    since: tuple[float, float],
    speed: float,
    wind: WindArrays,
    moving: FloatArray,
    field: Field,
    per_time: bool,
) -> tuple[float, float]:
    """
    Return how long a panel takes, infinite if the wind does not allow it, and its risk.

    `leg` is a place and a direction, `panel` the distance from there and the length, `since` the times when the panel
    and the slab begin.
    """
    x, y, ex, ey = leg[0] + panel[0] * leg[2], leg[1] + panel[0] * leg[3], leg[2], leg[3]
    h = panel[1]
    after, paces = np.zeros(N_NODES), np.empty(N_NODES)
    for _ in range(40):
        for i in range(N_NODES):
            s = h * NODES[i]
            pace = speed_along(x + s * ex, y + s * ey, since[0] + after[i], ex, ey, speed, wind)
            if pace <= 0.0:
                return math.inf, 0.0
            paces[i] = 1.0 / pace
        change = 0.0
        for i in range(N_NODES):
            value = 0.0
            for j in range(N_NODES):
                value += PRIMITIVE[i, j] * paces[j]
            change = max(change, abs(h * value - after[i]))
            after[i] = h * value
        if wind[2].shape[0] == 1 or change <= 1e-15 * after[N_NODES - 1]:
            break
    taken, risk = 0.0, 0.0
    for i in range(N_NODES):
        s = h * NODES[i]
        taken += WEIGHTS[i] * paces[i]
        here = _risk_at(x + s * ex, y + s * ey, since[0] + after[i] - since[1], moving, field, per_time)
        risk += WEIGHTS[i] * here * (paces[i] if per_time else 1.0)
    return h * taken, h * risk


@kernel
def _next_line(place: float, step: float, first: float, spacing: float, count: int) -> float:
    """Return how far it is along a line to the next row or column of nodes, at a step along the axis for each unit."""
    if step == 0.0 or count == 1:
        return math.inf
    at = (place - first) / spacing
    line = math.floor(at + 1e-9) + 1.0 if step > 0.0 else math.ceil(at - 1e-9) - 1.0
    line = max(line, 0.0) if step > 0.0 else min(line, count - 1.0)
    return (line - at) * spacing / step if 0.0 <= line <= count - 1.0 else math.inf


@kernel
def advance(
    leg: FloatArray,
    progress: FloatArray,
    until: tuple[float, float],
    slab_begins: float,
    speed: float,
    wind: WindArrays,
    moving: FloatArray,
    field: Field,
    per_time: bool,
) -> None:
    """
    Fly along a straight leg until it ends, or a slab does.

    Parameters
    ----------
    leg
        Where it begins, and its direction: ``x, y, ex, ey``.
    progress
        Distance from there, time and risk, which are brought up to date; the time becomes infinite if the wind is too
        strong. Risk of rasters counts only `per_time`.
    until
        The length of the leg, and when the slab ends.
    slab_begins
        When the slab begins.
    speed, wind
        Airspeed, and the wind.
    moving, field
        The threats that move, when the slab begins, and the risk that stands still.
    per_time
        Whether risk is integrated over time, or else over the distance.
    """
    length, ends = until
    u, _, _, nodes = wind
    still_air = length / speed
    widest = length
    for i in range(field[0].shape[0]):
        widest = min(widest, 4.0 * field[0][i, SPREAD])
    for i in range(moving.shape[0]):
        rate = math.hypot(moving[i, VX], moving[i, VY]) + 8.0 * abs(moving[i, WIDE_RATE])
        spread = moving[i, WIDE]
        if moving[i, WIDE_RATE] < 0.0:
            spread += (ends - slab_begins) * moving[i, WIDE_RATE]
        widest = min(widest, 4.0 * spread / (1.0 + rate / speed))
    h = widest
    while progress[0] < length and progress[1] < ends:
        s, t = progress[0], progress[1]
        x, y = leg[0] + s * leg[2], leg[1] + s * leg[3]
        h = min(2.0 * h, widest, length - s)
        h = min(h, _next_line(x, leg[2], nodes[0], nodes[2], u.shape[2]))
        h = min(h, _next_line(y, leg[3], nodes[1], nodes[3], u.shape[1]))
        snap = False
        while True:
            since = (t, slab_begins)
            whole, risk = _panel(leg, (s, h), since, speed, wind, moving, field, per_time)
            first, risk_1 = _panel(leg, (s, 0.5 * h), since, speed, wind, moving, field, per_time)
            since = (t + first, slab_begins)
            second, risk_2 = _panel(leg, (s + 0.5 * h, 0.5 * h), since, speed, wind, moving, field, per_time)
            if not math.isfinite(first + second):
                # (the wind may be too strong only farther on: after the slab)
                if h > SHORTEST * length:
                    h *= 0.5
                    continue
                progress[1] = math.inf
                return
            off = abs(whole - first - second) / still_air
            off = max(off, abs(risk - risk_1 - risk_2) / (still_air if per_time else length))
            if off > AGREE and h > SHORTEST * length:
                h *= 0.5
                continue
            beyond = t + first + second - ends
            if beyond > 1e-15 * abs(ends) + 1e-14 * (ends - t) and not snap:
                h = max(h * (ends - t) / (first + second), 0.0)
                if beyond < 1e-9 * (first + second):
                    # (as near as rounding allows)
                    snap = True
                continue
            break
        progress[0] = s + h if s + h < length * (1.0 - 1e-15) else length
        progress[1] = ends if snap or (ends < math.inf and beyond >= -1e-14 * (ends - t)) else t + first + second
        progress[2] += risk_1 + risk_2

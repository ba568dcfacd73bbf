"""
Compiled kernels of the march in space and time: a semi-Lagrangian scheme of second order, and its traces.

At each node of a layer the best heading is sought: the cost of a straight step to the next layer, by the trapezoidal
rule, plus the value there, which is interpolated by cubics and clipped between the corners of its cell, so that kinks
make no new minima. Close to the goal a straight flight is weighed instead, because the value has a tip there. The same
kernel marches backwards from the goal and forwards from the start (`sign` 1 and -1).
"""

import math
from typing import Final, NamedTuple

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.solvers.timed.disc_kernels import close_nodes, is_in_disc
from cgla_graph.solvers.timed.timed_kernels import Chart, leg_time, risk_at, time_of, wind_near

#: Values from this on mean that a node is closed or not reached.
FAR: Final = 1e30
#: Headings that are compared, and steps within which straight flights to the goal are weighed.
HEADINGS: Final = 12
SHOT: Final = 3.0
TURN: Final = 2.0 * math.pi / HEADINGS
_COS, _SIN = np.cos(TURN * np.arange(HEADINGS)), np.sin(TURN * np.arange(HEADINGS))


class Grid(NamedTuple):
    """
    A grid in space and time.

    Attributes
    ----------
    x, y, h, nx, ny
        Its corner, step and number of nodes.
    times, slabs
        Times of layers, rising, and the slab between each layer and the next.
    blocked
        Whether a node is closed in a slab, shape ``(slabs, ny, nx)``.
    """

    x: float
    y: float
    h: float
    nx: int
    ny: int
    times: FloatArray
    slabs: IntArray
    blocked: BoolArray


class Ends(NamedTuple):
    """
    Where a march begins (`x`, `y`, at times from `first` to `last`), where it must lead, and what is worth a look.

    Attributes
    ----------
    far_x, far_y, far_first
        The other end, and from when on the march passes there.
    most
        Nodes through which even straight flights without risk cost more are left out.
    """

    x: float
    y: float
    first: float
    last: float
    far_x: float
    far_y: float
    far_first: float
    most: float


@kernel
def layer_risk(chart: Chart, grid: Grid, s: int, t: float, out: FloatArray) -> None:
    """Fill `out` ``(ny, nx)`` with the density of risk at a time of slab `s`."""
    for j in range(grid.ny):
        for i in range(grid.nx):
            out[j, i] = risk_at(chart, s, grid.x + i * grid.h, grid.y + j * grid.h, t)[0]


@kernel
def linear(values: FloatArray, u: float, v: float) -> float:
    """Interpolate bilinearly over the corners that are not closed; `FAR` if they weigh less than half."""
    ny, nx = values.shape
    if u < 0.0 or v < 0.0 or u > nx - 1.0 or v > ny - 1.0:
        return FAR
    i, j = min(int(u), nx - 2), min(int(v), ny - 2)
    a, b = u - i, v - j
    total, weight = 0.0, 0.0
    w = (1.0 - a) * (1.0 - b)
    if values[j, i] < FAR:
        total += w * values[j, i]
        weight += w
    w = a * (1.0 - b)
    if values[j, i + 1] < FAR:
        total += w * values[j, i + 1]
        weight += w
    w = (1.0 - a) * b
    if values[j + 1, i] < FAR:
        total += w * values[j + 1, i]
        weight += w
    w = a * b
    if values[j + 1, i + 1] < FAR:
        total += w * values[j + 1, i + 1]
        weight += w
    return total / weight if weight >= 0.5 else FAR


@kernel
def _cubic4(p: float, q: float, r: float, s: float, a: float) -> float:
    return q + 0.5 * a * (r - p + a * (2.0 * p - 5.0 * q + 4.0 * r - s + a * (3.0 * (q - r) + s - p)))


@kernel
def _row(row: FloatArray, i: int, a: float) -> float:
    """Interpolate in a row; above `FAR` or not a number where a node is closed."""
    return _cubic4(row[i - 1], row[i], row[i + 1], row[i + 2], a)


@kernel
def cubic(values: FloatArray, u: float, v: float) -> float:
    """Interpolate by cubics, clipped between the corners of the cell; bilinearly at borders and closed nodes."""
    ny, nx = values.shape
    i, j = int(u), int(v)
    if u < 1.0 or v < 1.0 or i + 2 >= nx or j + 2 >= ny:
        return linear(values, u, v)
    for m in range(-1, 3):
        if max(values[j - 1, i + m], values[j, i + m], values[j + 1, i + m], values[j + 2, i + m]) >= FAR:
            return linear(values, u, v)
    a, b = u - i, v - j
    below, above = values[j], values[j + 1]
    low = min(below[i], below[i + 1], above[i], above[i + 1])
    high = max(below[i], below[i + 1], above[i], above[i + 1])
    value = _cubic4(_row(values[j - 1], i, a), _row(below, i, a), _row(above, i, a), _row(values[j + 2], i, a), b)
    return float(min(max(value, low), high))


@kernel
def _sight(chart: Chart, grid: Grid, s: int, x: float, y: float, t: float, dx: float, dy: float, span: float) -> bool:
    """Whether no closed node is next to a straight flight that lasts for `span`, below 0 back in time, and no disc."""
    n = int(2.0 * math.hypot(dx, dy) / grid.h) + 1
    for m in range(n):
        part = (m + 0.5) / n
        u, v = (x + dx * part - grid.x) / grid.h, (y + dy * part - grid.y) / grid.h
        i, j = min(max(int(u + 0.5), 0), grid.nx - 1), min(max(int(v + 0.5), 0), grid.ny - 1)
        if grid.blocked[s, j, i] or is_in_disc(chart.discs, x + dx * part, y + dy * part, t + span * part):
            return False
    return True


@kernel
def _shot(chart: Chart, grid: Grid, ends: Ends, sign: float, s: int, x: float, y: float, t: float, dt: float) -> float:
    """Return the cost of a straight flight between a point and the end of a march; `FAR` if it is not close."""
    dx, dy = ends.x - x, ends.y - y
    span = time_of(chart, x, y, t, dx, dy, sign)
    if not span <= SHOT * dt:
        return FAR
    landing = t + sign * span
    slack = 0.0
    if sign < 0.0 and landing > ends.last:
        # it departs at the last time and circles here until `t`
        slack = landing - ends.last
        if slack > SHOT * dt:
            return FAR
    elif landing < ends.first or landing > ends.last:
        return FAR
    if not _sight(chart, grid, s, x, y, t, dx, dy, sign * span):
        return FAR
    rate = 1.0 if chart.per_time else chart.speed
    if not chart.per_time and span > 0.0:
        rate = math.hypot(dx, dy) / span
    total = 0.0
    for n in range(3):
        f, _, _ = risk_at(chart, s, x + 0.5 * n * dx, y + 0.5 * n * dy, t + sign * 0.5 * n * span)
        total += f * (4.0 if n == 1 else 1.0) / 6.0
        if n == 0:
            slack *= chart.speed * (1.0 + chart.k * f)
    return chart.speed * span + chart.k * rate * total * span + slack


@kernel
def _step(
    chart: Chart,
    grid: Grid,
    ahead: FloatArray,
    risk_ahead: FloatArray,
    sign: float,
    x: float,
    y: float,
    f: float,
    dt: float,
    wind: tuple[float, float],
    angle: float,
) -> tuple[float, float, float]:
    """Return the value of a step at a heading, and where it ends."""
    gx = chart.speed * math.cos(angle) + wind[0]
    gy = chart.speed * math.sin(angle) + wind[1]
    rate = 1.0 if chart.per_time else math.hypot(gx, gy)
    xx, yy = x + sign * gx * dt, y + sign * gy * dt
    u, v = (xx - grid.x) / grid.h, (yy - grid.y) / grid.h
    value = cubic(ahead, u, v) if u >= 0.0 and v >= 0.0 else FAR
    if value >= FAR:
        return FAR, xx, yy
    g = linear(risk_ahead, u, v)
    return value + chart.speed * dt + 0.5 * chart.k * rate * dt * (f + g), xx, yy


@kernel
def best_step(
    chart: Chart,
    grid: Grid,
    ahead: FloatArray,
    risk_ahead: FloatArray,
    sign: float,
    x: float,
    y: float,
    f: float,
    dt: float,
    wind: tuple[float, float],
    guess: float,
) -> tuple[float, float, float]:
    """Return the least value over all headings, and where that step ends; `guess`: a heading that may be good."""
    best, middle = FAR, guess
    for n in range(-1, HEADINGS):
        angle = guess if n < 0 else n * TURN
        gx = chart.speed * (math.cos(guess) if n < 0 else _COS[n]) + wind[0]
        gy = chart.speed * (math.sin(guess) if n < 0 else _SIN[n]) + wind[1]
        u, v = (x + sign * gx * dt - grid.x) / grid.h, (y + sign * gy * dt - grid.y) / grid.h
        value = linear(ahead, u, v)
        if value < FAR:
            rate = 1.0 if chart.per_time else math.hypot(gx, gy)
            value += 0.5 * chart.k * rate * dt * linear(risk_ahead, u, v)
            if value < best:
                best, middle = value, angle
    if best >= FAR:
        return FAR, x, y
    width = 0.5 * TURN if middle != guess else 0.25 * TURN
    low, xx, yy = _step(chart, grid, ahead, risk_ahead, sign, x, y, f, dt, wind, middle)
    for _ in range(2):
        left, lx, ly = _step(chart, grid, ahead, risk_ahead, sign, x, y, f, dt, wind, middle - width)
        right, rx, ry = _step(chart, grid, ahead, risk_ahead, sign, x, y, f, dt, wind, middle + width)
        bend = left - 2.0 * low + right
        if left < low and left <= right:
            low, xx, yy, middle = left, lx, ly, middle - width
        elif right < low:
            low, xx, yy, middle = right, rx, ry, middle + width
        elif bend > 0.0 and left < FAR and right < FAR:
            shift = 0.5 * (left - right) / bend * width
            value, sx, sy = _step(chart, grid, ahead, risk_ahead, sign, x, y, f, dt, wind, middle + shift)
            if value < low:
                low, xx, yy, middle = value, sx, sy, middle + shift
        width *= 0.25
    # circling: drifts with the wind
    ux, uy = x + sign * wind[0] * dt, y + sign * wind[1] * dt
    value = cubic(ahead, max((ux - grid.x) / grid.h, 0.0), max((uy - grid.y) / grid.h, 0.0))
    if value < FAR:
        rate = 1.0 if chart.per_time else max(chart.speed, math.hypot(wind[0], wind[1]))
        value += chart.speed * dt + chart.k * rate * dt * f
        if value < low - 1e-12 * abs(low):
            low, xx, yy = value, ux, uy
    if chart.price < math.inf:
        value = cubic(ahead, (x - grid.x) / grid.h, (y - grid.y) / grid.h)
        if value < FAR:
            value += dt * (chart.price + chart.k * f * (1.0 if chart.per_time else chart.speed))
            if value < low - 1e-12 * abs(low):
                low, xx, yy = value, x, y
    return low, xx, yy


@kernel
def _downhill(values: FloatArray, i: int, j: int, sign: float) -> float:
    """Return the heading against the slope of the values at a node."""
    ny, nx = values.shape
    left, right = values[j, max(i - 1, 0)], values[j, min(i + 1, nx - 1)]
    low, high = values[max(j - 1, 0), i], values[min(j + 1, ny - 1), i]
    if max(left, right, low, high) >= FAR:
        return 0.0
    return math.atan2(sign * (low - high), sign * (left - right))


@kernel
def march(chart: Chart, grid: Grid, ends: Ends, sign: float) -> FloatArray:
    """
    Return the least cost from each node and time to the goal (`sign` 1), or from the start to it (-1).

    Returns
    -------
    values
        Shape ``(layers, ny, nx)``; at least `FAR`: closed, not reached, or left out.
    """
    n = grid.times.shape[0]
    values = np.full((n, grid.ny, grid.nx), 2.0 * FAR)
    risk, risk_ahead = np.empty((grid.ny, grid.nx)), np.empty((grid.ny, grid.nx))
    shut = np.zeros((grid.ny, grid.nx), dtype=np.bool_)
    for number in range(n):
        layer = n - 1 - number if sign > 0.0 else number
        t = grid.times[layer]
        before = layer if sign > 0.0 else layer - 1
        s = grid.slabs[min(max(before, 0), n - 2)]
        here = grid.slabs[min(layer, n - 2)]
        dt = grid.times[1] - grid.times[0]
        if number > 0:
            dt = abs(grid.times[layer + int(sign)] - t)
            layer_risk(chart, grid, s, t, risk)
            if chart.grid_of.max() >= 0 or number == 1:
                layer_risk(chart, grid, s, grid.times[layer + int(sign)], risk_ahead)
        first = ends.far_first if sign > 0.0 else ends.first
        close_nodes(chart.discs, (grid.x, grid.y, grid.h), t, (ends.x, ends.y, ends.far_x, ends.far_y), shut)
        for j in range(grid.ny):
            for i in range(grid.nx):
                if grid.blocked[here, j, i] or grid.blocked[s, j, i] or shut[j, i]:
                    continue
                x, y = grid.x + i * grid.h, grid.y + j * grid.h
                # straight flights between it and the two ends, without risk
                far = leg_time(chart, sign * (x - ends.far_x), sign * (y - ends.far_y))
                near = leg_time(chart, sign * (ends.x - x), sign * (ends.y - y))
                since = far if sign > 0.0 else near
                if since > t - first + (3.0 if sign > 0.0 else 0.5) * dt:
                    # (interpolation would reach it too early)
                    continue
                # (what idles is kept: interpolation would wear away an edge that moves as fast as the aircraft)
                if chart.speed * (far + near - 3.0 * dt) > ends.most:
                    continue
                if number == 0:
                    if sign > 0.0 and t + near <= ends.last:
                        values[layer, j, i] = chart.speed * near
                    continue
                best = _shot(chart, grid, ends, sign, s, x, y, t, dt)
                ahead = values[layer + int(sign)]
                guess = _downhill(ahead, i, j, sign)
                wind = wind_near(chart, x, y, t + sign * 0.5 * dt)
                value, _, _ = best_step(chart, grid, ahead, risk_ahead, sign, x, y, risk[j, i], dt, wind, guess)
                values[layer, j, i] = min(best, value) if min(best, value) < FAR else 2.0 * FAR
        risk, risk_ahead = risk_ahead, risk
    return values


@kernel
def trace(
    chart: Chart, grid: Grid, ends: Ends, sign: float, values: FloatArray, layer: int, x: float, y: float
) -> FloatArray:
    """Follow the best steps from a point of a layer to the end of a march; rows ``(t, x, y)``."""
    n = grid.times.shape[0]
    rows = np.empty((n + 2, 3))
    rows[0, 0], rows[0, 1], rows[0, 2] = grid.times[layer], x, y
    size = 1
    far = np.empty((grid.ny, grid.nx))
    while 0 <= layer + int(sign) < n:
        t, s = grid.times[layer], grid.slabs[layer if sign > 0.0 else layer - 1]
        ahead = layer + int(sign)
        dt = abs(grid.times[ahead] - t)
        shot = _shot(chart, grid, ends, sign, s, x, y, t, dt)
        layer_risk(chart, grid, s, grid.times[ahead], far)
        f, _, _ = risk_at(chart, s, x, y, t)
        i = min(max(int((x - grid.x) / grid.h + 0.5), 0), grid.nx - 1)
        j = min(max(int((y - grid.y) / grid.h + 0.5), 0), grid.ny - 1)
        guess = _downhill(values[ahead], i, j, sign)
        wind = wind_near(chart, x, y, t + sign * 0.5 * dt)
        value, xx, yy = best_step(chart, grid, values[ahead], far, sign, x, y, f, dt, wind, guess)
        if shot < FAR and shot <= value * (1.0 + 1e-6):
            break
        if value >= FAR:
            return rows[:0]
        x, y, layer = xx, yy, ahead
        rows[size, 0], rows[size, 1], rows[size, 2] = grid.times[layer], x, y
        size += 1
    t = rows[size - 1, 0]
    rows[size, 0] = t + sign * time_of(chart, x, y, t, ends.x - x, ends.y - y, sign)
    rows[size, 1], rows[size, 2] = ends.x, ends.y
    return rows[: size + 1]

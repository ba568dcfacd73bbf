"""
Compiled kernels of flights through moving risk: the cost of a leg with its gradient, and that of a whole flight.

A flight is a list of waypoints; the times follow from the speed. In absolute time, the edges of slabs stay where they
are while waypoints move. So the derivative of a leg's cost
``J = integral of c(x(t), t) from t0 to t1`` needs no derivative in time and no terms of jumps:
``dJ = c(x(t1), t1) dt1 - c(x(t0), t0) dt0 + integral of grad c . dx(t)``.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.solvers.timed.disc_kernels import Discs, pressure
from cgla_graph.timed.march_kernels import travel_time
from cgla_graph.timed.wind_kernels import WindArrays, speed_along, wind_at

#: Columns of a slab's table of threats: at the slab's start, and their rates.
X, Y, VX, VY, SPREAD, SPREAD_RATE, PEAK, PEAK_RATE = range(8)
#: A threat is not felt beyond so many spreads; the widest panel of the quadrature, in spreads of the nearest threat.
REACH, PANEL = 7.5, 1.0
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_NODES, _WEIGHTS = 0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS
N_NODES: Final = 6
#: Where the wind changes: the distance of the two nodes of Gauss on a leg of length 1, how often times are mended,
#: and the step of slopes, as a part of the leg.
PAIR, TURNS, NUDGE = 1.0 / math.sqrt(3.0), 3, 1e-5
#: ``1 - f`` is not taken below this, where it divides.
LEAST_KEPT = 1e-12


class Chart(NamedTuple):
    """
    A timed problem as arrays.

    Attributes
    ----------
    edges
        Times at which something changes its law, rising, shape ``(m + 1,)``; the last law holds on.
    first, threats
        Rows of the threats of slab ``s``: ``threats[first[s] : first[s + 1]]``, as `timed_problem` lists them.
    grids, corner, step, grid_of
        Static risk that is no sum of threats, sampled: shape ``(g, ny, nx)``, the corner, the steps, and the grid of
        each slab; -1: none.
    rings, ring_starts, ring_area, boxes, closed
        Outlines of areas, end to end; the area of each ring; the box of each area; whether area ``a`` is in force in
        slab ``s``: ``closed[s, a]``.
    speed, k, per_time
        Airspeed, risk weight, and whether risk counts per time.
    wind_x, wind_y, gusts, winds
        The wind, or the mean of one that changes; by how much that differs from its mean, at most, and the wind on its
        grid.
    price, latest
        The price of a unit of time spent waiting, infinite where it cannot wait, and the latest arrival.
    discs
        What moves with others, and may not be entered.
    """

    edges: FloatArray
    first: IntArray
    threats: FloatArray
    grids: FloatArray
    corner: FloatArray
    step: FloatArray
    grid_of: IntArray
    rings: FloatArray
    ring_starts: IntArray
    ring_area: IntArray
    boxes: FloatArray
    closed: BoolArray
    speed: float
    k: float
    per_time: bool
    wind_x: float
    wind_y: float
    gusts: float
    winds: WindArrays
    price: float
    latest: float
    discs: Discs


@kernel
def slab_of(edges: FloatArray, t: float) -> int:
    """Return the slab that holds a time: the later one at an edge, the first before all, the last after all."""
    low, high = 0, edges.shape[0] - 2
    while low < high:
        middle = (low + high + 1) >> 1
        if edges[middle] <= t:
            low = middle
        else:
            high = middle - 1
    return low


@kernel
def _grid_risk(chart: Chart, number: int, x: float, y: float) -> tuple[float, float, float]:
    """Interpolate sampled risk and its gradient bilinearly."""
    grid = chart.grids[number]
    u = min(max((x - chart.corner[0]) / chart.step[0], 0.0), grid.shape[1] - 1.0)
    v = min(max((y - chart.corner[1]) / chart.step[1], 0.0), grid.shape[0] - 1.0)
    i, j = min(int(u), grid.shape[1] - 2), min(int(v), grid.shape[0] - 2)
    a, b = u - i, v - j
    f00, f10, f01, f11 = grid[j, i], grid[j, i + 1], grid[j + 1, i], grid[j + 1, i + 1]
    value = (1.0 - b) * ((1.0 - a) * f00 + a * f10) + b * ((1.0 - a) * f01 + a * f11)
    gx = ((1.0 - b) * (f10 - f00) + b * (f11 - f01)) / chart.step[0]
    gy = ((1.0 - a) * (f01 - f00) + a * (f11 - f10)) / chart.step[1]
    return value, gx, gy


@kernel
def risk_at(chart: Chart, s: int, x: float, y: float, t: float) -> tuple[float, float, float]:
    """Return the density of risk and its gradient at a point and a time of slab `s`."""
    since = max(t - chart.edges[s], 0.0)
    kept, gx, gy = 1.0, 0.0, 0.0
    still, sx, sy = 0.0, 0.0, 0.0
    if chart.grid_of[s] >= 0:
        still, sx, sy = _grid_risk(chart, chart.grid_of[s], x, y)
    for i in range(chart.first[s], chart.first[s + 1]):
        row = chart.threats[i]
        dx = x - row[X] - row[VX] * since
        dy = y - row[Y] - row[VY] * since
        spread = row[SPREAD] + row[SPREAD_RATE] * since
        inverse = 1.0 / (spread * spread)
        q = (dx * dx + dy * dy) * inverse
        if q > REACH * REACH:
            continue
        f = (row[PEAK] + row[PEAK_RATE] * since) * math.exp(-0.5 * q)
        left = max(1.0 - f, LEAST_KEPT)
        kept *= left
        slope = -f * inverse / left
        gx += slope * dx
        gy += slope * dy
    return still + 1.0 - kept, sx + kept * gx, sy + kept * gy


@kernel
def leg_time(chart: Chart, dx: float, dy: float) -> float:
    """Return the time of a straight leg at full air speed, at least; infinite against a wind that is too strong."""
    return travel_time(dx, dy, chart.speed + chart.gusts, chart.wind_x, chart.wind_y)


@kernel
def wind_near(chart: Chart, x: float, y: float, t: float) -> tuple[float, float]:
    """Return the wind at a place and time."""
    return wind_at(x, y, t, chart.winds) if chart.gusts > 0.0 else (chart.wind_x, chart.wind_y)


@kernel
def time_of(chart: Chart, x: float, y: float, t: float, dx: float, dy: float, sign: float) -> float:
    """
    Return the time of a straight flight from a place at a time, or to it from ``(dx, dy)`` off (`sign` -1).

    Infinite against a wind that is too strong. Where the wind changes, to about fourth order in the length.
    """
    if chart.gusts == 0.0:
        return leg_time(chart, sign * dx, sign * dy)
    length = math.hypot(dx, dy)
    if length == 0.0:
        return 0.0
    ex, ey = sign * dx / length, sign * dy / length
    low, high, early, late = 0.5 - 0.5 * PAIR, 0.5 + 0.5 * PAIR, 0.0, 0.0
    for _ in range(TURNS):
        first = speed_along(x + low * dx, y + low * dy, t + sign * early, ex, ey, chart.speed, chart.winds)
        second = speed_along(x + high * dx, y + high * dy, t + sign * late, ex, ey, chart.speed, chart.winds)
        if first <= 0.0 or second <= 0.0:
            return math.inf
        span = 0.5 * length * (1.0 / first + 1.0 / second)
        # (the pace is linear through both nodes)
        bend = length * (1.0 / second - 1.0 / first) * (1.0 - PAIR * PAIR) / (8.0 * PAIR)
        early, late = low * span - bend, high * span - bend
    return span


@kernel
def _nearest_edge(chart: Chart, area: int, x: float, y: float) -> tuple[float, float, float]:
    """Return the signed distance to an area's border, below 0 inside, and its gradient."""
    nearest, nx, ny, inside = math.inf, 0.0, 0.0, False
    for ring in range(chart.ring_area.shape[0]):
        if chart.ring_area[ring] != area:
            continue
        for i in range(chart.ring_starts[ring], chart.ring_starts[ring + 1] - 1):
            ax, ay = chart.rings[i, 0], chart.rings[i, 1]
            bx, by = chart.rings[i + 1, 0], chart.rings[i + 1, 1]
            if (ay > y) != (by > y) and x < (bx - ax) * (y - ay) / (by - ay) + ax:
                inside = not inside
            ex, ey = bx - ax, by - ay
            u = ((x - ax) * ex + (y - ay) * ey) / max(ex * ex + ey * ey, 1e-300)
            u = min(max(u, 0.0), 1.0)
            dx, dy = x - ax - u * ex, y - ay - u * ey
            d = math.hypot(dx, dy)
            if d < nearest:
                nearest, nx, ny = d, dx, dy
    if nearest == 0.0:
        return 0.0, 0.0, 0.0
    sign = -1.0 if inside else 1.0
    return sign * nearest, sign * nx / nearest, sign * ny / nearest


@kernel
def depth_at(chart: Chart, s: int, x: float, y: float, margin: float) -> tuple[float, float, float]:
    """Return the sum of squared depths in closed areas that are wider by `margin`, and its gradient."""
    total, gx, gy = 0.0, 0.0, 0.0
    for area in range(chart.boxes.shape[0]):
        box = chart.boxes[area]
        if not chart.closed[s, area]:
            continue
        if x < box[0] - margin or y < box[1] - margin or x > box[2] + margin or y > box[3] + margin:
            continue
        away, nx, ny = _nearest_edge(chart, area, x, y)
        deep = margin - away
        if deep > 0.0:
            total += deep * deep
            gx -= 2.0 * deep * nx
            gy -= 2.0 * deep * ny
    return total, gx, gy


@kernel
def _panels(chart: Chart, s: int, p: FloatArray, g: FloatArray, t: float, last: float) -> int:
    """Return the number of panels for a piece of a leg, from position `p` with ground velocity `g`."""
    most, since, span = 1.0, t - chart.edges[s], last - t
    for i in range(chart.first[s], chart.first[s + 1]):
        row = chart.threats[i]
        # relative motion, and the nearest approach of the straight relative path
        rx, ry = p[0] - row[X] - row[VX] * since, p[1] - row[Y] - row[VY] * since
        vx, vy = g[0] - row[VX], g[1] - row[VY]
        speed2 = vx * vx + vy * vy
        u = min(max(-(rx * vx + ry * vy) / max(speed2, 1e-300), 0.0), span)
        low = row[SPREAD] + row[SPREAD_RATE] * since
        high = low + row[SPREAD_RATE] * span
        wide, narrow = max(low, high), min(low, high)
        if math.hypot(rx + u * vx, ry + u * vy) < REACH * wide:
            most = max(most, (math.sqrt(speed2) + abs(row[SPREAD_RATE])) * span / (PANEL * narrow))
    if chart.grid_of[s] >= 0:
        most = max(most, math.hypot(g[0] / chart.step[0], g[1] / chart.step[1]) * span)
    return math.ceil(min(most, 4096.0))


@kernel
def leg_cost(
    chart: Chart, p: FloatArray, q: FloatArray, t0: float, t1: float, weight: float, margin: float, out: FloatArray
) -> float:
    """
    Return the cost of a leg from `p` at `t0` to `q` at `t1`, with a penalty for being inside closed areas.

    Parameters
    ----------
    weight, margin
        Penalty of a squared depth and time unit, and how much wider than they are areas count; 0: no penalty.
    out
        Shape ``(6,)``: the derivatives by ``p``, ``q``, ``t0`` and ``t1``, while each of the others is held.
    """
    out[:] = 0.0
    span = t1 - t0
    if not span > 0.0:
        return 0.0
    g = np.array([(q[0] - p[0]) / span, (q[1] - p[1]) / span])
    ground = math.hypot(g[0], g[1])
    hovers = ground == 0.0
    rate = 1.0 if chart.per_time else (chart.speed if hovers else ground)
    total, of_rate = 0.0, 0.0
    s = slab_of(chart.edges, t0)
    last_slab = chart.edges.shape[0] - 2
    t = t0
    here = np.empty(2)
    jumps = 0.0
    while t < t1:
        end = t1 if s == last_slab else min(chart.edges[s + 1], t1)
        here[0], here[1] = p[0] + g[0] * (t - t0), p[1] + g[1] * (t - t0)
        n = _panels(chart, s, here, g, t, end)
        width = (end - t) / n
        for panel in range(n):
            for node in range(N_NODES):
                now = t + (panel + _NODES[node]) * width
                w = _WEIGHTS[node] * width
                u = (now - t0) / span
                x, y = p[0] + u * (q[0] - p[0]), p[1] + u * (q[1] - p[1])
                f, fx, fy = risk_at(chart, s, x, y, now)
                cost = chart.k * rate * f
                gx, gy = chart.k * rate * fx, chart.k * rate * fy
                of_rate += w * chart.k * f
                if weight > 0.0:
                    deep, dx, dy = depth_at(chart, s, x, y, margin)
                    cost += weight * deep
                    gx += weight * dx
                    gy += weight * dy
                total += w * cost
                # by p and q at fixed times
                out[0] += w * gx * (1.0 - u)
                out[1] += w * gy * (1.0 - u)
                out[2] += w * gx * u
                out[3] += w * gy * u
                # by t0 and t1: x(t) = p + (t - t0) (q - p) / (t1 - t0)
                out[4] -= w * (gx * g[0] + gy * g[1]) * (1.0 - u)
                out[5] -= w * (gx * g[0] + gy * g[1]) * u
        t = end
        s = min(s + 1, last_slab)
    # the ends of the time
    for side in range(2):
        now = t0 if side == 0 else t1
        x, y = (p[0], p[1]) if side == 0 else (q[0], q[1])
        at = slab_of(chart.edges, now)
        if side == 1 and at > 0 and chart.edges[at] == now:
            at -= 1
        f, _, _ = risk_at(chart, at, x, y, now)
        jumps = chart.k * rate * f
        if weight > 0.0:
            deep, _, _ = depth_at(chart, at, x, y, margin)
            jumps += weight * deep
        out[4 + side] += jumps if side == 1 else -jumps
    if not chart.per_time and not hovers:
        # the rate is the ground speed |q - p| / (t1 - t0)
        ex, ey = g[0] / ground, g[1] / ground
        out[0] -= of_rate * ex / span
        out[1] -= of_rate * ey / span
        out[2] += of_rate * ex / span
        out[3] += of_rate * ey / span
        out[4] += of_rate * ground / span
        out[5] -= of_rate * ground / span
    return total


@kernel
def flight_times(chart: Chart, points: FloatArray, waits: FloatArray, departure: float) -> FloatArray:
    """
    Return the times of arrival at waypoints that are left after `waits` at full airspeed, shape ``(m,)``.

    They are infinite where the wind is too strong.
    """
    times = np.empty(points.shape[0])
    times[0] = departure
    for i in range(points.shape[0] - 1):
        left = times[i] + waits[i]
        step_x, step_y = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        times[i + 1] = left + time_of(chart, points[i, 0], points[i, 1], left, step_x, step_y, 1.0)
    return times


@kernel
def _slopes_of_time(chart: Chart, p: FloatArray, dx: float, dy: float, t: float, span: float, out: FloatArray) -> None:
    """Write the derivatives of the time of a leg from `p` at `t` by its two ends and by `t`, shape ``(5,)``."""
    if chart.gusts == 0.0:
        # |d - w T| = v T
        ax, ay = dx - chart.wind_x * span, dy - chart.wind_y * span
        below = chart.speed * chart.speed * span + chart.wind_x * ax + chart.wind_y * ay
        out[0], out[1], out[2], out[3], out[4] = -ax / below, -ay / below, ax / below, ay / below, 0.0
        return
    by = NUDGE * math.hypot(dx, dy)
    for number in range(5):
        change = 0.0
        for side in range(2):
            off = by if side == 0 else -by
            # moving the first end changes the way as well
            x, y = p[0] + (off if number == 0 else 0.0), p[1] + (off if number == 1 else 0.0)
            ax = dx + (off if number == 2 else -off if number == 0 else 0.0)
            ay = dy + (off if number == 3 else -off if number == 1 else 0.0)
            when = t + (off / chart.speed if number == 4 else 0.0)
            change += (0.5 if side == 0 else -0.5) * time_of(chart, x, y, when, ax, ay, 1.0)
        out[number] = change / (by / chart.speed if number == 4 else by)


@kernel
def flight_cost(
    chart: Chart,
    points: FloatArray,
    waits: FloatArray,
    departure: float,
    weight: float,
    margin: float,
    slopes: FloatArray,
) -> tuple[float, float]:
    """
    Return the cost of a flight, with penalties, and its derivative by the departure.

    Parameters
    ----------
    chart
        The timed problem.
    points, waits, departure
        Waypoints ``(m, 2)``, the time spent waiting at each, and the departure.
    weight, margin
        As `leg_cost` takes them; the weight counts for arrivals after the latest one and for discs too.
    slopes
        Shape ``(m, 3)``: takes the derivatives by the waypoints and by the waits.
    """
    m = points.shape[0]
    times = flight_times(chart, points, waits, departure)
    slopes[:] = 0.0
    if not times[m - 1] < math.inf:
        return math.inf, 0.0
    late = max(times[m - 1] - chart.latest, 0.0)
    total = weight * late * late
    # the derivative of all that follows by the time at which it begins
    later = 2.0 * weight * late
    out, longer = np.empty(6), np.zeros(5)
    # (a depth counts once and not for as long as it lasts)
    pressing = weight * margin / chart.speed if chart.discs.starts.shape[0] > 1 else 0.0
    for i in range(m - 2, -1, -1):
        p, q = points[i], points[i + 1]
        left = times[i] + waits[i]
        dx, dy = q[0] - p[0], q[1] - p[1]
        span = times[i + 1] - left
        # (a tiny leg takes no time)
        if span > 0.0:
            total += chart.speed * span + leg_cost(chart, p, q, left, times[i + 1], weight, margin, out)
            if pressing > 0.0:
                total += pressure(chart.discs, p, q, left, times[i + 1], pressing, margin, out)
            _slopes_of_time(chart, p, dx, dy, left, span, longer)
            by_span = chart.speed + out[5] + later
            slopes[i, 0] += out[0] + by_span * longer[0]
            slopes[i, 1] += out[1] + by_span * longer[1]
            slopes[i + 1, 0] += out[2] + by_span * longer[2]
            slopes[i + 1, 1] += out[3] + by_span * longer[3]
            later += out[5] + out[4] + by_span * longer[4]
        slopes[i, 2] = math.inf
        if chart.price < math.inf:
            if waits[i] > 0.0:
                total += chart.price * waits[i] + leg_cost(chart, p, p, times[i], left, weight, margin, out)
            else:
                # as of a wait that begins
                s = slab_of(chart.edges, left)
                f, _, _ = risk_at(chart, s, p[0], p[1], left)
                out[:4] = 0.0
                out[5] = chart.k * f * (1.0 if chart.per_time else chart.speed)
                out[5] += weight * depth_at(chart, s, p[0], p[1], margin)[0] if weight > 0.0 else 0.0
                out[4] = -out[5]
            if pressing > 0.0:
                total += pressure(chart.discs, p, p, times[i], left, pressing, margin, out)
            slopes[i, 0] += out[0] + out[2]
            slopes[i, 1] += out[1] + out[3]
            slopes[i, 2] = chart.price + out[5] + later
            later += out[5] + out[4]
    return total, later

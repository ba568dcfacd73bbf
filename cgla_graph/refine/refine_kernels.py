"""
Compiled kernels of path refinement: cost with its gradient, its minimum over shifts of the waypoints, and shortcuts.

The gradient rests on two facts about ``R(a, b)``, the integral of ``F`` over the segment from ``a`` to ``b`` with unit
direction ``u`` and normal ``n``. Moving ``b`` along ``u`` adds a piece of path at ``b``, so that ``dR/db . u = F(b)``.
Moving ``b`` along ``n`` turns the segment about ``a``: the point at distance ``s`` from ``a`` moves by ``s / L`` of it,
so that ``dR/db . n`` is the integral of ``(s / L) dF/dn``. For ``a`` it is ``-F(a)`` and the integral of
``(1 - s / L) dF/dn``.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.model.graph_kernels import Model
from cgla_graph.model.no_fly_kernels import segment_crosses
from cgla_graph.model.risk_kernels import (
    _NODES,
    _WEIGHTS,
    AT,
    END,
    HIGH,
    LEFT,
    LOG2_E,
    LOG_AMPLITUDE,
    LOG_PEAK,
    LOW,
    N_NODES,
    OF_ONE,
    PRECISION,
    PRECISION_AT,
    REACH2,
    SPREAD,
    WEIGHT,
    Field,
    X,
    Y,
    deeper_of,
    exp2,
    fma,
    panel_end,
    panel_widths,
    segment_cost,
    segment_risk,
    threats_in_reach,
)
from cgla_graph.model.risk_raster_kernels import density_at, raster_moments

#: Threats from which on shortcuts are weighed by strong threats first, and what a strong threat is above.
CROWD, STRONG = 12, 0.1


@kernel
def threats_at(x: float, y: float, table: FloatArray) -> float:
    """Evaluate ``F`` at one point, without the threats that are out of reach."""
    risk = 0.0
    for i in range(table.shape[0]):
        dx = x - table[i, X]
        dy = y - table[i, Y]
        squared = dx * dx + dy * dy
        if squared < table[i, REACH2]:
            risk += math.exp(table[i, LOG_PEAK] - 0.5 * table[i, PRECISION] * squared) * (1.0 - risk)
    return risk


@kernel
def _moments(
    x1: float, y1: float, ux: float, uy: float, length: float, table: FloatArray, scratch: FloatArray
) -> tuple[float, float, float]:
    """
    Integrate ``F``, ``dF/dn`` and ``(s / L) dF/dn`` over a segment, ``n`` on its left.

    By 16-point Gauss-Legendre on the panels of `risk_kernels`, a little narrower, because the slope of a threat varies
    faster than the threat.
    """
    here, change, active = scratch[0], scratch[1], scratch[2:]
    m = threats_in_reach(x1, y1, ux, uy, length, table, active)
    risk, slope, lever = 0.0, 0.0, 0.0
    panel_widths(m, length, 0.76, deeper_of(table), active)
    start = 0.0
    while start < length and m > 0:
        end, any_here = panel_end(start, length, m, active)
        if not any_here:
            start = end
            continue
        half = 0.5 * (end - start)
        middle = 0.5 * (end + start)
        for k in range(N_NODES):
            here[k] = 0.0
            change[k] = 0.0
        for i in range(m):
            if active[i, LOW] < end and active[i, HIGH] > start:
                off = middle - active[i, AT]
                bits = -0.5 * LOG2_E * active[i, PRECISION_AT]
                offset = LOG2_E * active[i, LOG_AMPLITUDE]
                # the slope across the segment of exp(-precision d^2 / 2) is this times itself, all along it
                steep = active[i, PRECISION_AT] * active[i, LEFT]
                for k in range(N_NODES):
                    d = fma(half, _NODES[k], off)
                    f = exp2(fma(bits * d, d, offset))
                    # the product rule as in `risk_kernels.gradient`
                    clear = 1.0 - here[k]
                    change[k] = change[k] * (1.0 - f) - clear * steep * f
                    here[k] = fma(f, clear, here[k])
        for k in range(N_NODES):
            weight = half * _WEIGHTS[k]
            risk += weight * here[k]
            slope -= weight * change[k]
            lever -= weight * change[k] * ((middle + half * _NODES[k]) / length)
        start = end
    return risk, slope, lever


@kernel
def _mixed_density(x: float, y: float, table: FloatArray) -> float:
    """Evaluate a mixture at one point: `threats_at`, summed over its groups."""
    risk, start = 0.0, 0
    while start < table.shape[0]:
        end = int(table[start, END])
        risk += table[start, WEIGHT] * threats_at(x, y, table[start:end])
        start = end
    return risk


@kernel
def _mixed_moments(
    x1: float, y1: float, ux: float, uy: float, length: float, table: FloatArray, scratch: FloatArray
) -> tuple[float, float, float]:
    """Integrate a mixture and its slopes over a segment: `_moments`, summed over its groups."""
    risk, slope, lever, start = 0.0, 0.0, 0.0, 0
    while start < table.shape[0]:
        end, weight = int(table[start, END]), table[start, WEIGHT]
        of_group = _moments(x1, y1, ux, uy, length, table[start:end], scratch)
        risk += weight * of_group[0]
        slope += weight * of_group[1]
        lever += weight * of_group[2]
        start = end
    return risk, slope, lever


@kernel
def cost_and_gradient(points: FloatArray, k: float, field: Field, gradient: FloatArray) -> float:
    """
    Cost a polyline and write the derivative of its cost by every waypoint to `gradient`, both ``(m, 2)``.

    Where two waypoints coincide, the length between them has no derivative; it counts as 0.
    """
    table, rasters = field[0], field[3]
    n = points.shape[0]
    scratch = np.empty((table.shape[0] + 2, N_NODES))
    cost = 0.0
    gradient[:] = 0.0
    mixed = table.shape[1] > OF_ONE
    x, y = points[0, 0], points[0, 1]
    density = 0.0
    if k > 0.0:
        density = (_mixed_density(x, y, table) if mixed else threats_at(x, y, table)) + density_at(x, y, rasters)
    for i in range(n - 1):
        dx = points[i + 1, 0] - points[i, 0]
        dy = points[i + 1, 1] - points[i, 1]
        length = math.hypot(dx, dy)
        if length == 0.0:
            continue
        ux, uy = dx / length, dy / length
        cost += length
        first_along, second_along, first_across, second_across = -1.0, 1.0, 0.0, 0.0
        if k > 0.0:
            x, y = points[i, 0], points[i, 1]
            if mixed:
                risk, slope, lever = _mixed_moments(x, y, ux, uy, length, table, scratch)
            else:
                risk, slope, lever = _moments(x, y, ux, uy, length, table, scratch)
            more, steeper, heavier = raster_moments(x, y, ux, uy, length, rasters)
            risk, slope, lever = risk + more, slope + steeper, lever + heavier
            cost += k * risk
            first_along -= k * density
            x, y = points[i + 1, 0], points[i + 1, 1]
            density = (_mixed_density(x, y, table) if mixed else threats_at(x, y, table)) + density_at(x, y, rasters)
            second_along += k * density
            first_across, second_across = k * (slope - lever), k * lever
        gradient[i, 0] += first_along * ux - first_across * uy
        gradient[i, 1] += first_along * uy + first_across * ux
        gradient[i + 1, 0] += second_along * ux - second_across * uy
        gradient[i + 1, 1] += second_along * uy + second_across * ux
    return cost


@kernel
def _shifted_cost(
    points: FloatArray,
    directions: FloatArray,
    shifts: FloatArray,
    unit: float,
    k: float,
    field: Field,
    work: FloatArray,
    slope: FloatArray,
) -> float:
    """
    Cost a polyline whose waypoints are shifted along `directions`, and write the derivative by every shift to `slope`.

    Shifts and cost are in units of `unit`. `work` has shape ``(2, m, 2)``.
    """
    moved, by_point = work[0], work[1]
    for i in range(points.shape[0]):
        moved[i, 0] = points[i, 0] + unit * shifts[i] * directions[i, 0]
        moved[i, 1] = points[i, 1] + unit * shifts[i] * directions[i, 1]
    cost = cost_and_gradient(moved, k, field, by_point)
    for i in range(points.shape[0]):
        slope[i] = by_point[i, 0] * directions[i, 0] + by_point[i, 1] * directions[i, 1]
    return cost / unit


@kernel
def newton_step(
    diagonal: FloatArray, beside: FloatArray, damping: float, slope: FloatArray, free: BoolArray, step: FloatArray
) -> bool:
    """
    Solve ``(H + damping I) step = -slope`` for the free shifts, ``H`` tridiagonal; False unless positive definite.

    `beside` holds ``H[i, i + 1]``; the shifts that are not free do not move.
    """
    n = diagonal.shape[0]
    pivots = np.empty(n)
    for i in range(n):
        pivots[i] = diagonal[i] + damping if free[i] else 1.0
        step[i] = -slope[i] if free[i] else 0.0
        if i > 0 and free[i] and free[i - 1]:
            factor = beside[i - 1] / pivots[i - 1]
            pivots[i] -= factor * beside[i - 1]
            step[i] -= factor * step[i - 1]
        if free[i] and pivots[i] <= 1e-10 * (abs(diagonal[i]) + damping):
            return False
    for i in range(n - 1, -1, -1):
        step[i] /= pivots[i]
        if i > 0 and free[i] and free[i - 1]:
            step[i - 1] -= beside[i - 1] * step[i]
    return True


@kernel
def minimise(
    points: FloatArray,
    directions: FloatArray,
    room: FloatArray,
    unit: float,
    k: float,
    field: Field,
    iterations: int,
    shifts: FloatArray,
) -> int:
    """
    Shift waypoints along their transversals so that the path costs least; return how many segments were weighed.

    A projected Newton method (Bertsekas, SIAM J. Control Optim. 20(2), 1982), damped as by Levenberg and Marquardt. A
    waypoint's cost depends on its two neighbours alone, so the Hessian is tridiagonal: three differences of the exact
    gradient give all of it, and a step costs no more than a few looks at the path, however many waypoints there are.

    Parameters
    ----------
    points, directions
        Waypoints and unit vectors, shape ``(m, 2)``.
    room
        How far each waypoint may go against and along its direction, shape ``(m, 2)``.
    unit
        A length to measure shifts by: the spacing of the waypoints.
    k, field
        Risk weight and field.
    iterations
        Steps, at most.
    shifts
        Where to begin and, on return, the answer, shape ``(m,)``, in units of `unit`.
    """
    n = points.shape[0]
    work = np.empty((2, n, 2))
    slope, other, step, trial, diagonal = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    beside = np.empty(n)
    free = np.empty(n, dtype=np.bool_)
    difference = 1e-6
    cost = _shifted_cost(points, directions, shifts, unit, k, field, work, slope)
    looks = 1
    damping = 0.0
    for _ in range(iterations):
        steepest = 0.0
        for i in range(n):
            back, ahead = -room[i, 0] / unit, room[i, 1] / unit
            free[i] = back < ahead and not (shifts[i] <= back and slope[i] > 0.0)
            free[i] = free[i] and not (shifts[i] >= ahead and slope[i] < 0.0)
            if free[i]:
                steepest = max(steepest, abs(slope[i]))
        if steepest < 1e-9:
            break
        beside[:] = 0.0
        for colour in range(3):
            for i in range(n):
                trial[i] = shifts[i] + (difference if i % 3 == colour else 0.0)
            _shifted_cost(points, directions, trial, unit, k, field, work, other)
            for i in range(colour, n, 3):
                diagonal[i] = (other[i] - slope[i]) / difference
                if i > 0:
                    beside[i - 1] += 0.5 * (other[i - 1] - slope[i - 1]) / difference
                if i < n - 1:
                    beside[i] += 0.5 * (other[i + 1] - slope[i + 1]) / difference
        looks += 3
        scale = 0.0
        for i in range(n):
            scale = max(scale, abs(diagonal[i]))
        gain = -1.0
        while damping < 1e9 * scale:
            if newton_step(diagonal, beside, damping, slope, free, step):
                promised = 0.0
                for i in range(n):
                    trial[i] = min(max(shifts[i] + step[i], -room[i, 0] / unit), room[i, 1] / unit)
                    promised += slope[i] * (shifts[i] - trial[i])
                candidate = _shifted_cost(points, directions, trial, unit, k, field, work, other)
                looks += 1
                gain = cost - candidate
                if gain > 1e-4 * promised and gain > 0.0:
                    break
                gain = -1.0
                # bounds may turn a step uphill, then more damping helps; one that promises nothing is the end
                if 0.0 <= promised < 1e-13 * cost:
                    break
            damping = max(8.0 * damping, 1e-3 * scale)
        if gain <= 0.0:
            break
        damping = 0.1 * damping if damping > 1e-6 * scale else 0.0
        for i in range(n):
            shifts[i] = trial[i]
            slope[i] = other[i]
        cost = candidate
        if gain < 1e-12 * cost:
            break
    n_weighed: int = looks * (n - 1)
    return n_weighed


@kernel
def _strong(field: Field) -> Field:
    """Return a field that counts threats only as far as they are above `STRONG`: it is nowhere riskier."""
    table = field[0].copy()
    for i in range(table.shape[0]):
        log_ratio = max(table[i, LOG_PEAK] - math.log(STRONG), 0.0)
        table[i, REACH2] = 2.0 * table[i, SPREAD] * table[i, SPREAD] * log_ratio
    return table, field[1], field[2], field[3]


@kernel
def shortcut(points: FloatArray, model: Model, stride: int, kept: BoolArray) -> int:
    """
    Find the least-cost path over the complete graph of a path's own waypoints, in their order (dynamic programming).

    `kept`, shape ``(m,)``, marks a feasible path, first and last point included; the other points are there to be
    used. On return it marks the best path. Of the points of the path, shortcuts lead from and to every `stride`-th. One
    that costs the same as several segments replaces them. Returns how many segments were weighed.

    In a crowd, strong threats alone already make most shortcuts too expensive.
    """
    k, field, area = model
    crowd = field[0].shape[0] >= CROWD
    strong = _strong(field) if crowd else field
    n = points.shape[0]
    values = np.full(n, math.inf)
    before = np.full(n, -1)
    hops = np.zeros(n, dtype=np.int64)
    onward = np.full(n, -1)
    step = np.zeros(n)
    values[0] = 0.0
    evaluations = 0
    last = 0
    for j in range(1, n):
        if kept[j]:
            step[last] = segment_cost(points[last, 0], points[last, 1], points[j, 0], points[j, 1], k, field)
            values[j] = values[last] + step[last]
            hops[j] = hops[last] + 1
            before[j] = last
            onward[last] = j
            last = j
            evaluations += 1
    slack = 1e-14 * values[n - 1]
    # (integrals over fewer threats are rounded otherwise)
    margin = 1e-9 * values[n - 1]
    for i in range(n - 1):
        if values[i] == math.inf:
            continue
        j = onward[i]
        if j >= 0 and (values[i] + step[i] < values[j] or (values[i] + step[i] == values[j] and hops[i] + 1 < hops[j])):
            values[j] = values[i] + step[i]
            before[j] = i
            hops[j] = hops[i] + 1
        if kept[i] and i % stride:
            continue
        for j in range(i + 1, n):
            if kept[j] and j % stride and j < n - 1:
                continue
            length = math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
            if values[i] + length > values[j] + slack:
                continue
            evaluations += 1
            x, y, next_x, next_y = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
            cost = length
            if k > 0.0:
                most = (values[j] - values[i] - length + margin) / k
                if crowd and segment_risk(x, y, next_x, next_y, strong, most) > most:
                    continue
                cost += k * segment_risk(x, y, next_x, next_y, field, most)
            cost += values[i]
            better = cost < values[j] - slack or (cost <= values[j] + slack and hops[i] + 1 < hops[j])
            if better and not segment_crosses(x, y, next_x, next_y, area):
                values[j] = cost
                before[j] = i
                hops[j] = hops[i] + 1
    kept[:] = False
    node = n - 1
    while node >= 0:
        kept[node] = True
        node = before[node]
    return evaluations


@kernel
def without_idle(points: FloatArray, model: Model, slack: float, kept: BoolArray) -> int:
    """
    Mark in `kept`, shape ``(m,)``, the waypoints that a path needs: those that save more than `slack`.

    Looks at one waypoint after the other, between the last one kept and the next. Returns how many segments were
    weighed.
    """
    k, field, area = model
    kept[:] = True
    n = points.shape[0]
    if n <= 2:
        return 0
    last = 0
    cost = segment_cost(points[0, 0], points[0, 1], points[1, 0], points[1, 1], k, field)
    for i in range(1, n - 1):
        x, y, next_x, next_y = points[last, 0], points[last, 1], points[i + 1, 0], points[i + 1, 1]
        onward = segment_cost(points[i, 0], points[i, 1], next_x, next_y, k, field)
        direct = segment_cost(x, y, next_x, next_y, k, field)
        if direct <= cost + onward + slack and not segment_crosses(x, y, next_x, next_y, area):
            kept[i] = False
            cost = direct
        else:
            last = i
            cost = onward
    n_weighed: int = 2 * n - 3
    return n_weighed

"""
Compiled kernels of rounded polylines: at every waypoint but the ends an arc of one radius, tangent to both segments.

Such a curve is given by its waypoints ``v_0 … v_n`` alone. Where the polyline turns by ``a``, the arc begins and ends
``t = R tan(|a| / 2)`` from the waypoint, so that the curve exists if every segment is at least as long as the parts
that the arcs at its two ends take. Every curve of lines and arcs of radius ``R``, each below a half turn, has this
form, and curves whose curvature is at most ``1 / R`` are limits of such curves.

**The barrier.** The objective is the cost plus ``mu * sum(phi(d / reach))`` over the distances of pieces from the edges
of areas and from the bounds, and over the remaining lengths of segments between arcs; ``phi(x) = x - 1 - log(x)`` below
1, and 0 above. It is infinite where the curve is infeasible, by the exact tests of `curve_kernels`, so that a descent
from a feasible curve stays feasible. As ``mu`` tends to 0, the minimum tends to that of the cost.

The gradient is exact but for the jumps of rasters that are not interpolated, by the reverse chain rule: from the points
of a piece to where it begins, its heading and its turn, and from these to the waypoints.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.graph_kernels import Model
from cgla_graph.model.no_fly_kernels import AreaArrays, first_row, slab_of
from cgla_graph.refine.refine_kernels import cost_and_gradient
from cgla_graph.turning.curve_kernels import (
    CX,
    CY,
    RADIUS,
    TURN,
    X0,
    X1,
    Y0,
    Y1,
    arc_box,
    density_and_gradient,
    in_box,
    nearest,
    piece_crosses,
    within_turn,
)

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
#: Panels of the quadrature along one arc, at most, while it is bent.
MOST_PANELS = 12

#: Columns of `turns`, one row a waypoint: heading and unit vectors before and after it, turn, length that the arc
#: takes.
HEADING, U0X, U0Y, U1X, U1Y, ANGLE, TAKEN = range(7)


@kernel
def phi(x: float) -> float:
    """Evaluate the barrier, for ``x > 0``."""
    return x - 1.0 - math.log(x) if x < 1.0 else 0.0


@kernel
def slope_of_phi(x: float) -> float:
    """Evaluate its derivative."""
    return 1.0 - 1.0 / x if x < 1.0 else 0.0


@kernel
def rounded(points: FloatArray, radius: float, turns: FloatArray, pieces: FloatArray) -> float:
    """
    Round a polyline, shape ``(n, 2)`` with ``n >= 2``.

    `turns` gets a row for each waypoint, shape ``(n, 7)``; `pieces` gets the curve, shape ``(2 n - 3, 8)``: line, arc,
    line, …, line. Returns the least remaining length of a segment between its arcs: below 0 there is no such curve.
    """
    n = points.shape[0]
    for i in range(1, n - 1):
        ax, ay = points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
        bx, by = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        a, b = math.hypot(ax, ay), math.hypot(bx, by)
        if a == 0.0 or b == 0.0:
            return -math.inf
        angle = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
        turns[i, HEADING] = math.atan2(ay, ax)
        turns[i, U0X], turns[i, U0Y], turns[i, U1X], turns[i, U1Y] = ax / a, ay / a, bx / b, by / b
        turns[i, ANGLE] = angle
        turns[i, TAKEN] = radius * math.tan(0.5 * abs(angle))
    turns[0, TAKEN] = 0.0
    turns[n - 1, TAKEN] = 0.0
    least = math.inf
    for i in range(n - 1):
        long = math.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
        least = min(least, long - turns[i, TAKEN] - turns[i + 1, TAKEN])
    for i in range(n - 1):
        line = pieces[2 * i]
        line[:] = 0.0
        line[X0], line[Y0] = points[i, 0], points[i, 1]
        line[X1], line[Y1] = points[i + 1, 0], points[i + 1, 1]
    for i in range(1, n - 1):
        before, arc, after = pieces[2 * i - 2], pieces[2 * i - 1], pieces[2 * i]
        taken, angle = turns[i, TAKEN], turns[i, ANGLE]
        arc[X0], arc[Y0] = points[i, 0] - taken * turns[i, U0X], points[i, 1] - taken * turns[i, U0Y]
        arc[X1], arc[Y1] = points[i, 0] + taken * turns[i, U1X], points[i, 1] + taken * turns[i, U1Y]
        side = radius if angle >= 0.0 else -radius
        arc[CX], arc[CY] = arc[X0] - side * turns[i, U0Y], arc[Y0] + side * turns[i, U0X]
        arc[RADIUS], arc[TURN] = radius, angle
        before[X1], before[Y1] = arc[X0], arc[Y0]
        after[X0], after[Y0] = arc[X1], arc[Y1]
    return least


@kernel
def _pull(i: int, piece: FloatArray, turns: FloatArray, share: float, gx: float, gy: float, back: FloatArray) -> None:
    """Pass the derivative by a point of the arc at waypoint `i` on to its beginning, heading and turn."""
    ux, uy = turns[i, U0X], turns[i, U0Y]
    bend = (1.0 if piece[TURN] >= 0.0 else -1.0) / piece[RADIUS]
    angle = share * piece[TURN]
    sine, rest = math.sin(angle) / bend, (1.0 - math.cos(angle)) / bend
    cosine = math.cos(angle)
    back[i, 0] += gx
    back[i, 1] += gy
    # turning the heading by h turns the arc about its beginning
    back[i, 4] += gx * (-uy * sine - ux * rest) + gy * (ux * sine - uy * rest)
    along_x, along_y = ux * cosine - uy * math.sin(angle), uy * cosine + ux * math.sin(angle)
    back[i, 5] += (gx * along_x + gy * along_y) * share / bend


@kernel
def _arc_cost(
    i: int, piece: FloatArray, turns: FloatArray, k: float, model: Model, panel: float, back: FloatArray
) -> float:
    """Cost the arc at waypoint `i`, and pass its derivative on."""
    field = model[1]
    sign = 1.0 if piece[TURN] >= 0.0 else -1.0
    radius = float(piece[RADIUS])
    long = radius * abs(piece[TURN])
    back[i, 5] += sign * radius
    if k == 0.0 or long == 0.0:
        return float(long)
    parts = min(MOST_PANELS, 1 + int(long / panel))
    begin = math.atan2(piece[Y0] - piece[CY], piece[X0] - piece[CX])
    mean = 0.0
    for part in range(parts):
        for j in range(_NODES.shape[0]):
            share = (part + 0.5 * (1.0 + _NODES[j])) / parts
            weight = 0.5 * _WEIGHTS[j] / parts
            angle = begin + share * piece[TURN]
            x, y = piece[CX] + radius * math.cos(angle), piece[CY] + radius * math.sin(angle)
            density, gx, gy = density_and_gradient(x, y, field[0], field[3])
            mean += weight * density
            if gx != 0.0 or gy != 0.0:
                _pull(i, piece, turns, share, k * long * weight * gx, k * long * weight * gy, back)
    back[i, 5] += sign * radius * k * mean
    return float(long * (1.0 + k * mean))


@kernel
def _push(
    number: int, share: float, gx: float, gy: float, pieces: FloatArray, turns: FloatArray, back: FloatArray
) -> None:
    """Pass the derivative by a point of any piece on."""
    if number % 2 == 1:
        _pull((number + 1) // 2, pieces[number], turns, share, gx, gy, back)
        return
    i = number // 2
    # a line leads from the end of one arc to the beginning of the next; start and goal stay
    back[i, 2] += (1.0 - share) * gx
    back[i, 3] += (1.0 - share) * gy
    back[i + 1, 0] += share * gx
    back[i + 1, 1] += share * gy


@kernel
def _area_barrier(
    pieces: FloatArray, turns: FloatArray, area: AreaArrays, reach: float, mu: float, back: FloatArray
) -> float:
    """Add up the barrier of the edges that are near, and pass its derivative on."""
    frame, slab_starts, rows = area
    slabs = slab_starts.shape[0] - 1
    total = 0.0
    last = pieces.shape[0] - 1
    for number in range(pieces.shape[0]):
        piece = pieces[number]
        low_x, low_y, high_x, high_y = arc_box(piece)
        if (
            low_x - reach >= frame[2]
            or high_x + reach <= frame[0]
            or low_y - reach >= frame[3]
            or high_y + reach <= frame[1]
        ):
            continue
        first = slab_of(low_y - reach, frame, slabs)
        for slab in range(first, slab_of(high_y + reach, frame, slabs) + 1):
            stop = slab_starts[slab + 1]
            for j in range(first_row(low_x - reach, slab_starts[slab], stop, rows), stop):
                if rows[j, 6] >= high_x + reach:
                    break
                ax, ay, bx, by = rows[j, 0], rows[j, 1], rows[j, 2], rows[j, 3]
                dx = max(low_x - max(ax, bx), min(ax, bx) - high_x, 0.0)
                dy = max(low_y - max(ay, by), min(ay, by) - high_y, 0.0)
                # (an edge counts in the first slab of these that it is in)
                if dx * dx + dy * dy >= reach * reach or max(first, slab_of(min(ay, by), frame, slabs)) != slab:
                    continue
                d, share, qx, qy = nearest(piece, ax, ay, bx, by)
                # start and goal may be on an edge, and do not move
                if d >= reach or (number == 0 and share <= 0.0) or (number == last and share >= 1.0):
                    continue
                if d <= 0.0:
                    return math.inf
                total += mu * phi(d / reach)
                pull = mu * slope_of_phi(d / reach) / reach
                x, y = _place(piece, share)
                _push(number, share, pull * (x - qx) / d, pull * (y - qy) / d, pieces, turns, back)
    return total


@kernel
def _place(piece: FloatArray, share: float) -> tuple[float, float]:
    if piece[RADIUS] == 0.0:
        return piece[X0] + share * (piece[X1] - piece[X0]), piece[Y0] + share * (piece[Y1] - piece[Y0])
    angle = math.atan2(piece[Y0] - piece[CY], piece[X0] - piece[CX]) + share * piece[TURN]
    return piece[CX] + piece[RADIUS] * math.cos(angle), piece[CY] + piece[RADIUS] * math.sin(angle)


@kernel
def _bounds_barrier(
    pieces: FloatArray, turns: FloatArray, bounds: Bounds, reach: float, mu: float, back: FloatArray
) -> float:
    """Add up the barrier of the four sides for every arc, at its extreme point; lines are between arcs."""
    total = 0.0
    for number in range(1, pieces.shape[0], 2):
        piece = pieces[number]
        low_x, low_y, high_x, high_y = arc_box(piece)
        begin = math.atan2(piece[Y0] - piece[CY], piece[X0] - piece[CX])
        for side in range(4):
            room = (low_x - bounds[0], low_y - bounds[1], bounds[2] - high_x, bounds[3] - high_y)[side]
            if room >= reach:
                continue
            if room <= 0.0:
                return math.inf
            angle = (math.pi, 1.5 * math.pi, 0.0, 0.5 * math.pi)[side]
            inward_x, inward_y = -math.cos(angle), -math.sin(angle)
            share = within_turn(angle, begin, piece[TURN])
            if share > 1.0:
                first = piece[X0] * inward_x + piece[Y0] * inward_y
                second = piece[X1] * inward_x + piece[Y1] * inward_y
                share = 0.0 if first < second else 1.0
            total += mu * phi(room / reach)
            pull = mu * slope_of_phi(room / reach) / reach
            _push(number, share, pull * inward_x, pull * inward_y, pieces, turns, back)
    return total


@kernel
def _gathered(points: FloatArray, turns: FloatArray, radius: float, back: FloatArray, gradient: FloatArray) -> None:
    """Turn derivatives by the arcs' ends, headings, turns and shares of segments into those by waypoints."""
    for i in range(1, points.shape[0] - 1):
        ux, uy, wx, wy = turns[i, U0X], turns[i, U0Y], turns[i, U1X], turns[i, U1Y]
        taken, angle = turns[i, TAKEN], turns[i, ANGLE]
        by_taken = back[i, 6] - (back[i, 0] * ux + back[i, 1] * uy) + (back[i, 2] * wx + back[i, 3] * wy)
        by_heading = back[i, 4] - taken * (back[i, 1] * ux - back[i, 0] * uy)
        by_next = taken * (back[i, 3] * wx - back[i, 2] * wy)
        cosine = math.cos(0.5 * angle)
        by_angle = back[i, 5] + by_taken * (0.5 if angle >= 0.0 else -0.5) * radius / (cosine * cosine)
        by_heading -= by_angle
        by_next += by_angle
        gradient[i, 0] += back[i, 0] + back[i, 2]
        gradient[i, 1] += back[i, 1] + back[i, 3]
        a = math.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
        b = math.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
        for j, factor, nx, ny in ((0, by_heading / a, -uy, ux), (1, by_next / b, -wy, wx)):
            gradient[i + j, 0] += factor * nx
            gradient[i + j, 1] += factor * ny
            gradient[i - 1 + j, 0] -= factor * nx
            gradient[i - 1 + j, 1] -= factor * ny


@kernel
def barrier(
    points: FloatArray,
    radius: float,
    model: Model,
    bounds: Bounds,
    reaches: tuple[float, float, float, float],
    mu: float,
    held: FloatArray,
    gradient: FloatArray,
) -> float:
    """
    Evaluate cost plus barrier of a rounded polyline and its derivative by every waypoint.

    Parameters
    ----------
    points
        Waypoints, shape ``(n, 2)`` with ``n >= 3``, map units.
    radius
        Of all arcs.
    model, bounds
        Cost, area and box; infeasible curves cost infinity.
    reaches
        Reach of the barrier of the area and the box, reach of that of remaining lengths of segments, widest panel of
        the quadrature, and least length of the line at an end whose heading is given.
    mu
        Weight of the barrier, map units.
    held
        Where the curve leads at its start and at its goal, unit vectors, shape ``(2, 2)``; zero where it may lead
        anywhere.
    gradient
        On return the derivative, shape ``(n, 2)``; that of the ends is left out.
    """
    n = points.shape[0]
    k, field, area = model
    turns = np.empty((n, 7))
    pieces = np.empty((2 * n - 3, 8))
    gradient[:] = 0.0
    if rounded(points, radius, turns, pieces) <= 0.0:
        return math.inf
    leads = np.zeros(n - 1)
    for end in range(2):
        if held[end, 0] != 0.0 or held[end, 1] != 0.0:
            # (of a line that is too short, rounding takes the heading)
            i = end * (n - 2)
            dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
            leads[i] = reaches[3]
            if dx * held[end, 0] + dy * held[end, 1] - turns[i, TAKEN] - turns[i + 1, TAKEN] <= reaches[3]:
                return math.inf
    for i in range(pieces.shape[0]):
        if not in_box(pieces[i], bounds, 0.0):
            return math.inf
        if piece_crosses(pieces[i], area):
            return math.inf
    # derivatives by an arc's beginning, its end, heading, turn, and what it takes of its segments
    back = np.zeros((n, 7))
    total = 0.0
    ends, slope = np.empty((2, 2)), np.empty((2, 2))
    for i in range(n - 1):
        line = pieces[2 * i]
        ends[0, 0], ends[0, 1], ends[1, 0], ends[1, 1] = line[X0], line[Y0], line[X1], line[Y1]
        total += cost_and_gradient(ends, k, field, slope)
        for j in range(2):
            back[i, 2 + j] += slope[0, j]
            back[i + 1, j] += slope[1, j]
        if i > 0:
            total += _arc_cost(i, pieces[2 * i - 1], turns, k, model, reaches[2], back)
    if mu > 0.0:
        total += _area_barrier(pieces, turns, area, reaches[0], mu, back)
        total += _bounds_barrier(pieces, turns, bounds, reaches[0], mu, back)
        for i in range(n - 1):
            dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
            long = math.hypot(dx, dy)
            left = (long - turns[i, TAKEN] - turns[i + 1, TAKEN] - leads[i]) / reaches[1]
            total += mu * phi(left)
            pull = mu * slope_of_phi(left) / reaches[1]
            back[i, 6] -= pull
            back[i + 1, 6] -= pull
            for j, step in ((0, dx), (1, dy)):
                gradient[i + 1, j] += pull * step / long
                gradient[i, j] -= pull * step / long
    _gathered(points, turns, radius, back, gradient)
    gradient[0] = 0.0
    gradient[n - 1] = 0.0
    return total

"""Compiled kernels of flights that keep away from others: the discs around those, closed on grids, and pressed on."""

import math
from typing import Final, NamedTuple

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray

#: Legs that come nearer to another than this part of its disc evade it to the left.
HEAD_ON: Final = 1e-9


class Discs(NamedTuple):
    """
    Discs that move with others.

    Attributes
    ----------
    rows, starts
        Their trajectories ``(t, x, y)``, end to end; that of number `n` begins at row ``starts[n]``. Before its first
        time and after its last one, it is not there.
    radii
        Of each, map units.
    """

    rows: FloatArray
    starts: IntArray
    radii: FloatArray


@kernel
def _piece(discs: Discs, number: int, t: float) -> int:
    """Return the last row of a trajectory that is not after a time; at least its first, at most its last but one."""
    low, high = discs.starts[number], max(discs.starts[number + 1] - 2, discs.starts[number])
    while low < high:
        middle = (low + high + 1) >> 1
        if discs.rows[middle, 0] <= t:
            low = middle
        else:
            high = middle - 1
    return int(low)


@kernel
def _motion(discs: Discs, number: int, piece: int) -> tuple[float, float, float]:
    """Return when a piece of a trajectory ends, and its velocity; a single row ends when it begins."""
    if piece + 1 >= discs.starts[number + 1]:
        return discs.rows[piece, 0], 0.0, 0.0
    span = discs.rows[piece + 1, 0] - discs.rows[piece, 0]
    vx = (discs.rows[piece + 1, 1] - discs.rows[piece, 1]) / span
    vy = (discs.rows[piece + 1, 2] - discs.rows[piece, 2]) / span
    return discs.rows[piece + 1, 0], vx, vy


@kernel
def _place(discs: Discs, number: int, t: float) -> tuple[bool, float, float]:
    """Return whether a disc is there at a time, and where."""
    if not discs.rows[discs.starts[number], 0] <= t <= discs.rows[discs.starts[number + 1] - 1, 0]:
        return False, 0.0, 0.0
    piece = _piece(discs, number, t)
    _, vx, vy = _motion(discs, number, piece)
    since = t - discs.rows[piece, 0]
    return True, discs.rows[piece, 1] + since * vx, discs.rows[piece, 2] + since * vy


@kernel
def is_in_disc(discs: Discs, x: float, y: float, t: float) -> bool:
    """Whether a place is inside of a disc at a time."""
    for number in range(discs.starts.shape[0] - 1):
        is_there, cx, cy = _place(discs, number, t)
        if is_there and math.hypot(x - cx, y - cy) < discs.radii[number]:
            return True
    return False


@kernel
def close_nodes(
    discs: Discs, corner: tuple[float, float, float], t: float, ends: tuple[float, float, float, float], shut: BoolArray
) -> None:
    """
    Mark the nodes ``(ny, nx)`` of a grid that are inside of discs at a time, or whose cells meet one.

    Parameters
    ----------
    discs
        The discs.
    corner
        The grid's corner, and its step.
    t
        The time.
    ends
        Two places near which only nodes inside are closed.
    shut
        Takes the answer.
    """
    x, y, h = corner
    ny, nx = shut.shape
    shut[:] = False
    for number in range(discs.starts.shape[0] - 1):
        is_there, cx, cy = _place(discs, number, t)
        if not is_there:
            continue
        u, v = (cx - x) / h, (cy - y) / h
        # (in the corner of four cells, nodes are farther away than half a step)
        wide = max(discs.radii[number] / h, 0.25) + 0.5
        for j in range(max(math.ceil(v - wide), 0), min(math.floor(v + wide), ny - 1) + 1):
            for i in range(max(math.ceil(u - wide), 0), min(math.floor(u + wide), nx - 1) + 1):
                px, py = x + i * h, y + j * h
                nearest = min(math.hypot(px - ends[0], py - ends[1]), math.hypot(px - ends[2], py - ends[3]))
                if math.hypot(i - u, j - v) < (discs.radii[number] / h if nearest < 2.0 * h else wide):
                    shut[j, i] = True


@kernel
def pressure(
    discs: Discs, p: FloatArray, q: FloatArray, t0: float, t1: float, weight: float, margin: float, out: FloatArray
) -> float:
    """
    Return the penalty of a leg that comes too near to others: weight times squared depths, each at its deepest moment.

    Parameters
    ----------
    discs
        The discs, which count as wider by `margin`.
    p, q, t0, t1
        Where and when the leg begins and ends; it may take no time.
    weight, margin
        Penalty of a squared depth, and by how much wider the discs are.
    out
        Shape ``(6,)``: the derivatives by ``p``, ``q``, ``t0`` and ``t1`` are added to it.
    """
    total, span = 0.0, t1 - t0
    gx = (q[0] - p[0]) / span if span > 0.0 else 0.0
    gy = (q[1] - p[1]) / span if span > 0.0 else 0.0
    for number in range(discs.starts.shape[0] - 1):
        begins = max(t0, discs.rows[discs.starts[number], 0])
        ends = min(t1, discs.rows[discs.starts[number + 1] - 1, 0])
        if not begins <= ends:
            continue
        wide = discs.radii[number] + margin
        least, when = wide, begins
        nx, ny, ox, oy = 0.0, 0.0, 0.0, 0.0
        piece, t = _piece(discs, number, begins), begins
        while True:
            stop, vx, vy = _motion(discs, number, piece)
            last = min(stop, ends)
            # from the other to the leg, when this stretch begins
            since = t - discs.rows[piece, 0]
            dx = p[0] + (t - t0) * gx - discs.rows[piece, 1] - since * vx
            dy = p[1] + (t - t0) * gy - discs.rows[piece, 2] - since * vy
            rx, ry = gx - vx, gy - vy
            speed2 = rx * rx + ry * ry
            after = 0.0
            if speed2 > 0.0:
                after = min(max(-(dx * rx + dy * ry) / speed2, 0.0), max(last - t, 0.0))
            dx += after * rx
            dy += after * ry
            away = math.hypot(dx, dy)
            if away < least:
                least, when, ox, oy = away, t + after, vx, vy
                if away > HEAD_ON * wide:
                    nx, ny = dx / away, dy / away
                elif speed2 > 0.0:
                    nx, ny = -ry / math.sqrt(speed2), rx / math.sqrt(speed2)
                else:
                    nx, ny = 1.0, 0.0
            if last >= ends or piece + 2 >= discs.starts[number + 1]:
                break
            t = last
            piece += 1
        if least >= wide:
            continue
        deep = wide - least
        total += weight * deep * deep
        by = -2.0 * weight * deep
        u = (when - t0) / span if span > 0.0 else 0.0
        out[0] += by * nx * (1.0 - u)
        out[1] += by * ny * (1.0 - u)
        out[2] += by * nx * u
        out[3] += by * ny * u
        # the moment stays while the ends of time move, unless it is one of them
        along = nx * gx + ny * gy
        out[4] -= by * along * (1.0 - u)
        out[5] -= by * along * u
        closing = along - nx * ox - ny * oy
        if when == t1 and (span > 0.0 or closing < 0.0):
            out[5] += by * closing
        elif when == t0:
            out[4] += by * closing
    return total

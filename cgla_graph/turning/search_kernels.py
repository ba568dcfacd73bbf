"""
Compiled kernels of a search over poses: which way round, and with which turns, before the curve is bent.

A* over poses ``(x, y, heading)``, one for each cell and sector of headings, as Hybrid A* does
(Dolgov, Thrun, Montemerlo, Diebel, Int. J. Robot. Res. 29(5), 2010). Steps are arcs, to either side and with the radius
or twice that, and lines; every step is tested and weighed along itself. The cost to the goal is estimated by the
costs-to-go of a grid, where turning costs nothing. From poses on the way, Dubins' curves to the goal are tried.
"""

import heapq
import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.array_kernels import doubled_rows
from cgla_graph.model.no_fly_kernels import AreaArrays, segment_crosses
from cgla_graph.turning.curve_kernels import (
    CX,
    CY,
    RADIUS,
    TURN,
    X0,
    X1,
    Y0,
    Y1,
    in_box,
    piece_crosses,
    piece_length,
    place,
)
from cgla_graph.turning.dubins_kernels import N_WORDS, word_parts, word_pieces

#: Sectors of headings, and curvatures of steps, in parts of the tightest.
SECTORS = 64
BENDS = np.array([0.0, 1.0, -1.0, 0.5, -0.5])
_TURN = 2.0 * math.pi
#: Of a pose: where it is, where it came from, how it bent, its cost, how long its step was.
AT_X, AT_Y, AT_HEADING, FROM, BEND, COST, STEP = range(7)

#: The map of a search: cells along x and y, bounds, cost per length in the middle of each cell, area.
Map = tuple[int, int, Bounds, FloatArray, AreaArrays]


@kernel
def _cell(x: float, y: float, columns: int, rows: int, bounds: Bounds) -> tuple[int, int]:
    i = int((x - bounds[0]) / (bounds[2] - bounds[0]) * columns)
    j = int((y - bounds[1]) / (bounds[3] - bounds[1]) * rows)
    return min(max(i, 0), columns - 1), min(max(j, 0), rows - 1)


@kernel
def _price(x: float, y: float, columns: int, rows: int, bounds: Bounds, prices: FloatArray) -> float:
    """Interpolate the cost per length between the middles of cells."""
    u = (x - bounds[0]) / (bounds[2] - bounds[0]) * columns - 0.5
    v = (y - bounds[1]) / (bounds[3] - bounds[1]) * rows - 0.5
    i, j = min(max(int(u), 0), columns - 2), min(max(int(v), 0), rows - 2)
    a, b = min(max(u - i, 0.0), 1.0), min(max(v - j, 0.0), 1.0)
    low = prices[j, i] * (1.0 - a) + prices[j, i + 1] * a
    high = prices[j + 1, i] * (1.0 - a) + prices[j + 1, i + 1] * a
    between: float = low * (1.0 - b) + high * b
    return between


@kernel
def _piece_price(piece: FloatArray, spacing: float, on: Map) -> float:
    """Weigh a piece by the prices at points along it."""
    long = piece_length(piece)
    parts = 1 + int(long / (0.75 * spacing))
    total = 0.0
    for i in range(parts):
        x, y = place(piece, (i + 0.5) / parts)
        total += _price(x, y, on[0], on[1], on[2], on[3])
    return long * total / parts


@kernel
def costs_to_go(goal: tuple[float, float], on: Map) -> FloatArray:
    """Return the cost from the middle of every cell to the goal along the grid, shape ``(rows, columns)``."""
    columns, rows, bounds, prices, area = on
    wide, high = (bounds[2] - bounds[0]) / columns, (bounds[3] - bounds[1]) / rows
    values = np.full((rows, columns), math.inf)
    queue = [(0.0, 0, 0)]
    queue.pop()
    gi, gj = _cell(goal[0], goal[1], columns, rows, bounds)
    # (the goal may see its neighbours where a wall is between it and the middle of its own cell)
    for j in range(max(gj - 2, 0), min(gj + 3, rows)):
        for i in range(max(gi - 2, 0), min(gi + 3, columns)):
            x, y = bounds[0] + (i + 0.5) * wide, bounds[1] + (j + 0.5) * high
            if not segment_crosses(goal[0], goal[1], x, y, area):
                values[j, i] = math.hypot(x - goal[0], y - goal[1]) * prices[j, i]
                heapq.heappush(queue, (values[j, i], i, j))
    while len(queue) > 0:
        value, i, j = heapq.heappop(queue)
        if value > values[j, i]:
            continue
        x, y = bounds[0] + (i + 0.5) * wide, bounds[1] + (j + 0.5) * high
        for dj in range(-2, 3):
            for di in range(-2, 3):
                # steps to 16 neighbours: those that do not pass over another one
                if (di == 0 and dj == 0) or (abs(di) != 1 and abs(dj) != 1 and max(abs(di), abs(dj)) > 1):
                    continue
                ni, nj = i + di, j + dj
                if not (0 <= ni < columns and 0 <= nj < rows):
                    continue
                long = math.hypot(di * wide, dj * high)
                other = value + 0.5 * long * (prices[j, i] + prices[nj, ni])
                if other < values[nj, ni] and not segment_crosses(x, y, x + di * wide, y + dj * high, area):
                    values[nj, ni] = other
                    heapq.heappush(queue, (other, ni, nj))
    # of cells whose middle is closed, a part may be open
    for _ in range(2):
        before = values.copy()
        for j in range(rows):
            for i in range(columns):
                if before[j, i] == math.inf:
                    around = before[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2]
                    values[j, i] = around.min()
    return values


@kernel
def _step(pose: FloatArray, bend: float, long: float, radius: float, piece: FloatArray) -> tuple[float, float, float]:
    """Write the piece that a step is, and return the pose after it."""
    x, y, heading = pose[AT_X], pose[AT_Y], pose[AT_HEADING]
    piece[X0], piece[Y0] = x, y
    if bend == 0.0:
        piece[CX], piece[CY], piece[RADIUS], piece[TURN] = 0.0, 0.0, 0.0, 0.0
        x, y = x + long * math.cos(heading), y + long * math.sin(heading)
    else:
        side = radius / bend
        piece[CX], piece[CY] = x - side * math.sin(heading), y + side * math.cos(heading)
        piece[RADIUS], piece[TURN] = abs(side), long / side
        heading += long / side
        x, y = piece[CX] + side * math.sin(heading), piece[CY] - side * math.cos(heading)
    piece[X1], piece[Y1] = x, y
    return x, y, heading


@kernel
def shot(
    pose: tuple[float, float, float],
    goal: tuple[float, float, float],
    free: bool,
    radius: float,
    spacing: float,
    on: Map,
    most: float,
    out: FloatArray,
) -> tuple[float, int]:
    """
    Try Dubins' curves from a pose to the goal, of any heading if it is `free`; return the best one's cost and pieces.

    Only those below `most` count; the pieces are written to `out`, shape ``(3, 8)``.
    """
    best, n_best = most, 0
    pieces = np.empty((3, 8))
    if free:
        for side in (1.0, -1.0):
            # turn until the goal is straight ahead
            cx, cy = pose[0] - side * radius * math.sin(pose[2]), pose[1] + side * radius * math.cos(pose[2])
            away = math.hypot(goal[0] - cx, goal[1] - cy)
            if away <= radius:
                continue
            bearing = math.atan2(goal[1] - cy, goal[0] - cx)
            heading = bearing + side * math.asin(radius / away)
            turn = side * (heading - pose[2])
            turn -= _TURN * math.floor(turn / _TURN)
            start = np.array([pose[0], pose[1], pose[2]])
            x, y, _ = _step(start, side, max(radius * turn, 1e-12 * radius), radius, pieces[0])
            pieces[1, X0], pieces[1, Y0], pieces[1, X1], pieces[1, Y1] = x, y, goal[0], goal[1]
            pieces[1, CX], pieces[1, CY], pieces[1, RADIUS], pieces[1, TURN] = 0.0, 0.0, 0.0, 0.0
            cost = _cost_of(pieces, 2, spacing, on, best)
            if cost < best:
                best, n_best = cost, 2
                out[:2] = pieces[:2]
        return best, n_best
    for word in range(N_WORDS):
        parts = word_parts(pose, goal, radius, word)
        if radius * (parts[0] + parts[1] + parts[2]) >= best:
            continue
        n = word_pieces(pose, goal, radius, word, pieces)
        if n < 1:
            continue
        cost = _cost_of(pieces, n, spacing, on, best)
        if cost < best:
            best, n_best = cost, n
            out[:n] = pieces[:n]
    return best, n_best


@kernel
def _cost_of(pieces: FloatArray, n: int, spacing: float, on: Map, most: float) -> float:
    """Weigh pieces; infinity where they may not be flown, or come to more than `most`."""
    total = 0.0
    for i in range(n):
        total += piece_length(pieces[i])
    if total >= most:
        return math.inf
    for i in range(n):
        if not in_box(pieces[i], on[2], 0.0) or piece_crosses(pieces[i], on[4]):
            return math.inf
    total = 0.0
    for i in range(n):
        total += _piece_price(pieces[i], spacing, on)
    return total


@kernel
def search(
    start: tuple[float, float, float],
    goal: tuple[float, float, float],
    free: tuple[bool, bool],
    radius: float,
    on: Map,
    most_poses: int,
) -> tuple[FloatArray, FloatArray, float, int]:
    """
    Search for a curve from start to goal.

    Parameters
    ----------
    start, goal
        ``(x, y, heading)``, radians; the heading counts unless it is `free`.
    free
        Whether the headings at start and goal may be any.
    radius
        Of the tightest arcs.
    on
        The map.
    most_poses
        Poses that are kept, at most.

    Returns
    -------
    pieces
        The curve, shape ``(n, 8)``; empty if there is none.
    nearest
        ``(x, y, heading, cost-to-go)`` of the pose that came nearest to the goal.
    cost
        Of the curve, about.
    n_poses
        Poses that were kept.
    """
    columns, rows, bounds, _, area = on
    spacing = min((bounds[2] - bounds[0]) / columns, (bounds[3] - bounds[1]) / rows)
    to_go = costs_to_go((goal[0], goal[1]), on)
    poses = np.empty((1024, 7))
    known = np.full((rows, columns, SECTORS), math.inf)
    closed = np.zeros((rows, columns, SECTORS), dtype=np.bool_)
    queue = [(0.0, 0)]
    queue.pop()
    n_poses = 0
    nearest = np.array([start[0], start[1], start[2], math.inf])
    for sector in range(SECTORS if free[0] else 1):
        heading = _TURN * sector / SECTORS if free[0] else start[2]
        i, j = _cell(start[0], start[1], columns, rows, bounds)
        poses[n_poses, :] = 0.0
        poses[n_poses, AT_X], poses[n_poses, AT_Y], poses[n_poses, AT_HEADING] = start[0], start[1], heading
        poses[n_poses, FROM] = -1.0
        heapq.heappush(queue, (0.0, n_poses))
        n_poses += 1
    piece, tail, best_tail = np.empty(8), np.empty((3, 8)), np.empty((3, 8))
    best, n_best, best_pose = math.inf, 0, -1
    popped = 0
    while len(queue) > 0:
        priority, number = heapq.heappop(queue)
        if priority >= best:
            break
        pose = poses[number].copy()
        i, j = _cell(pose[AT_X], pose[AT_Y], columns, rows, bounds)
        sector = math.floor(pose[AT_HEADING] / _TURN * SECTORS + 0.5) % SECTORS
        if pose[FROM] >= 0.0:
            if closed[j, i, sector]:
                continue
            closed[j, i, sector] = True
        left = to_go[j, i]
        if left < nearest[3]:
            nearest[0], nearest[1], nearest[2], nearest[3] = pose[AT_X], pose[AT_Y], pose[AT_HEADING], left
        # the nearer, the more often a curve to the goal is tried
        far = math.hypot(goal[0] - pose[AT_X], goal[1] - pose[AT_Y])
        if popped % (1 + int(far / (4.0 * radius + 4.0 * spacing))) == 0 or pose[FROM] < 0.0:
            here = (pose[AT_X], pose[AT_Y], pose[AT_HEADING])
            cost, n = shot(here, goal, free[1], radius, spacing, on, best - pose[COST], tail)
            if n > 0:
                best, n_best, best_pose = pose[COST] + cost, n, number
                best_tail[:] = tail
        popped += 1
        # (a step leaves its cell)
        long = 1.5 * spacing
        for bend in BENDS:
            x, y, heading = _step(pose, bend, long, radius, piece)
            if not in_box(piece, bounds, 0.0):
                continue
            i, j = _cell(x, y, columns, rows, bounds)
            sector = math.floor(heading / _TURN * SECTORS + 0.5) % SECTORS
            if closed[j, i, sector]:
                continue
            cost = pose[COST] + _piece_price(piece, spacing, on)
            if cost >= known[j, i, sector] or to_go[j, i] == math.inf or cost + to_go[j, i] >= best:
                continue
            if piece_crosses(piece, area):
                continue
            known[j, i, sector] = cost
            if n_poses == poses.shape[0]:
                poses = doubled_rows(poses)
            poses[n_poses, AT_X], poses[n_poses, AT_Y], poses[n_poses, AT_HEADING] = x, y, heading
            poses[n_poses, FROM], poses[n_poses, BEND], poses[n_poses, COST] = number, bend, cost
            poses[n_poses, STEP] = long
            heapq.heappush(queue, (cost + to_go[j, i], n_poses))
            n_poses += 1
        if n_poses >= most_poses:
            break
    if best_pose < 0:
        return np.empty((0, 8)), nearest, best, n_poses
    n = 0
    number = best_pose
    while poses[number, FROM] >= 0.0:
        number = int(poses[number, FROM])
        n += 1
    pieces = np.empty((n + n_best, 8))
    pieces[n:] = best_tail[:n_best]
    number = best_pose
    while n > 0:
        n -= 1
        origin = int(poses[number, FROM])
        _step(poses[origin], poses[number, BEND], poses[number, STEP], radius, pieces[n])
        number = origin
    return pieces, nearest, best, n_poses

"""
Compiled kernels of the eikonal equation ``|grad T| = c`` on a mesh: fast marching with a heap, and steepest descent.

The nodes of a mesh (`cgla_graph.eikonal.mesh`) know their four neighbours: row ``p`` of ``neighbours``, shape
``(n + 1, 4)``, holds the numbers of the nodes to the west, east, south and north of node ``p``. Number ``n`` stands
for "no node there" and is its own neighbour; its value is infinite. So no kernel asks whether a neighbour exists.

A kernel is compiled anew for arguments of other types, and for constants that are handed over. Casts such as
``int(np.int64(0))``, which numba takes for a number of that type, keep calls of one kernel alike.
"""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.eikonal.queue_kernels import (
    BUCKETS,
    NONE,
    begin_round,
    bucket_of,
    drop_first,
    grown,
    next_bucket,
    open_bucket,
    push,
    put_off,
)

#: Controls, columns and rows of the pieces of a mesh; origin and spacing of its grid.
Mesh: TypeAlias = tuple[WholeArray, WholeArray, WholeArray, tuple[float, float], tuple[float, float]]
#: Columns, rows and neighbours of the nodes of a mesh; origin and spacing of its grid.
Nodes: TypeAlias = tuple[WholeArray, WholeArray, WholeArray, tuple[float, float], tuple[float, float]]
#: Controls, columns and rows of the pieces of a mesh, and the piece in whose middle each node is.
Pieces: TypeAlias = tuple[WholeArray, WholeArray, WholeArray, WholeArray]
#: Points beside the mesh that ways may lead over (`marching.bends_of`): per node the number of its first entry, or -1;
#: entries in the order of their nodes: node, bend, and the cost between; per bend its first entry in a second list in
#: the order of bends, and of that list the nodes and costs.
Bends: TypeAlias = tuple[WholeArray, WholeArray, WholeArray, FloatArray, WholeArray, WholeArray, FloatArray]
#: Nodes that a piece has side by side and that are not neighbours of each other (`mesh_kernels.joints`): per node the
#: number of its first entry, or -1; entries in the order of their nodes: node, other node, and the distance.
Joints: TypeAlias = tuple[WholeArray, WholeArray, WholeArray, FloatArray]
#: States of a node: see `march`.
FAR, TRIAL, DONE, SEED = range(4)


@kernel
def past_corner(
    q: int,
    here: float,
    final: FloatArray,
    neighbours: WholeArray,
    spacing: tuple[float, float],
    time: float,
    along: FloatArray,
) -> float:
    """
    Return the time at a node beside a wall, if a front that comes past a diagonal neighbour is there before `time`.

    The steps of a slanted wall take away the neighbour that a front along it comes from. Its slope along that axis is
    then known from the neighbour along the other one and the node beside that, and the other part follows; a front from
    further round comes over the diagonal. No time is below that of the neighbour.

    Along a wall, the way over the diagonal is a detour, whose steps would make a spline steep beside the wall. There
    the slope is that from the neighbour to the one beyond, but at least that of a front along the wall, whose direction
    is `along`: no front comes out of the wall.
    """
    n = final.shape[0] - 1
    for x_side in range(2):
        for y_side in range(2, 4):
            a = neighbours[q, x_side]
            b = neighbours[q, y_side]
            if (a == n) == (b == n):
                continue
            axis = 0 if a == n else 1
            near = final[b if axis == 0 else a]
            corner = final[neighbours[b, x_side] if axis == 0 else neighbours[a, y_side]]
            if near == math.inf or near < corner:
                continue
            step = spacing[axis]
            other = spacing[1 - axis]
            slope = (near - corner) / step
            rest = here * here - slope * slope
            over = corner + here * math.hypot(step, other)
            if rest > 0.0 and slope * other <= math.sqrt(rest) * step:
                time = min(time, near + other * math.sqrt(rest))
            elif over >= near:
                beyond = final[neighbours[b, y_side] if axis == 0 else neighbours[a, x_side]]
                if beyond <= near:
                    over = min(over, near + max(near - beyond, here * along[1 - axis] * other))
                time = min(time, over)
    return time


@kernel
def march(
    times: FloatArray,
    state: WholeArray,
    cost: FloatArray,
    neighbours: WholeArray,
    beside_wall: FloatArray,
    spacing: tuple[float, float],
    second: bool,
    joints: Joints,
    bends: Bends,
) -> None:
    """
    Complete the times of arrival by fast marching (Tsitsiklis 1995; Sethian 1996).

    The time at a node solves the upwind equation of Godunov's scheme. A difference of first order is centred half a
    step upwind, and the cost is taken where the differences are centred, so that those of first order do less harm.

    Parameters
    ----------
    times
        Shape ``(n + 1,)``: given unless `state` is `FAR`, else infinite. Overwritten.
    state
        Shape ``(n + 1,)``. The front starts from nodes that are `TRIAL`, whose times may still fall, or `SEED`, whose
        times are final; `DONE` ones are left alone. The last is `FAR`. Overwritten.
    cost
        Cost of a unit of length at each node, above 0, shape ``(n + 1,)``.
    neighbours
        Shape ``(n + 1, 4)``.
    beside_wall
        Direction of the wall beside each node that the front may come to past a diagonal neighbour (`past_corner`),
        without signs; below 0 elsewhere. Shape ``(n + 1, 2)``.
    spacing
        Steps of the grid along x and y.
    second
        Whether to use differences of second order where they can be had.
    joints
        Where a front goes on from a node beside its four neighbours. Without them, it would come there later, or from
        elsewhere, and times would jump. An infinite distance is no joint.
    bends
        Where ways lead from nodes to nodes at known costs.
    """
    hx, hy = spacing
    first_joint, joint_node, joint_other, joint_length = joints
    n_joints = joint_node.shape[0]
    n = times.shape[0] - 1
    first_entry, entry_node, entry_bend, entry_cost, first_node, bend_node, bend_cost = bends
    n_entries = entry_node.shape[0]
    bend_times = np.full(first_node.shape[0], math.inf)
    # by order of the differences along x and y: weights of the two axes, and one over their sum
    weights = np.empty((4, 3))
    for kind in range(4):
        weights[kind, 0] = (1.0 if kind < 2 else 2.25) / (hx * hx)
        weights[kind, 1] = (1.0 if kind % 2 == 0 else 2.25) / (hy * hy)
        weights[kind, 2] = 1.0 / (weights[kind, 0] + weights[kind, 1])
    final = np.empty(n + 1)
    total = 0.0
    for p in range(n + 1):
        final[p] = times[p] if state[p] == DONE else math.inf
        total += 1.0 / cost[p]
    speed = total / (n + 1)
    step = min(hx, hy)
    # what one node may put into the queue at once
    burst = 8 + n_joints + bend_node.shape[0]
    room = 4096 + 2 * burst
    keys = np.full(room, math.inf)
    items: WholeArray = np.empty(room, dtype=np.uint32)
    heads: WholeArray = np.full(BUCKETS + 1, NONE, dtype=np.uint32)
    entries: WholeArray = np.empty((room, 2), dtype=np.uint32)
    for i in range(room):
        entries[i, 1] = i + 1
    free, size, waiting = int(np.int64(0)), int(np.int64(0)), int(np.int64(0))
    # all wait for the first round
    current = int(np.int64(BUCKETS - 1))
    begin = per_time = 0.0
    for p in range(n):
        if state[p] == TRIAL or state[p] == SEED:
            if waiting + burst > room:
                keys, items, entries, free = grown(keys, items, entries, free)
                room *= 2
            free = put_off(int(np.uint32(p)), int(np.int64(BUCKETS)), free, heads, entries)
            waiting += 1
    while size + waiting > 0:
        # (in the loop inside, the arrays stay the same: their references need not be counted)
        if size + waiting + burst > room:
            keys, items, entries, free = grown(keys, items, entries, free)
            room *= 2
        while 0 < size + waiting <= room - burst:
            if size == 0:
                current = next_bucket(current, heads)
                if current == BUCKETS:
                    current = int(np.int64(0))
                    begin, per_time = begin_round(speed, step, times, final, cost, heads, entries)
                size, waiting, free = open_bucket(current, waiting, free, times, final, keys, items, heads, entries)
                continue
            p = items[0]
            size = drop_first(keys, items, size)
            if state[p] == DONE:
                continue
            state[p] = DONE
            final[p] = times[p]
            entry = np.int64(first_entry[p]) if n_entries > 0 else int(np.int64(-1))
            while 0 <= entry < n_entries and entry_node[entry] == p:
                there = times[p] + entry_cost[entry]
                bend = entry_bend[entry]
                if there < bend_times[bend]:
                    bend_times[bend] = there
                    for beyond in range(first_node[bend], first_node[bend + 1]):
                        q = int(np.uint32(bend_node[beyond]))
                        time = there + bend_cost[beyond]
                        if state[q] <= TRIAL and time < times[q]:
                            times[q] = time
                            bucket = bucket_of(time, begin, per_time)
                            if bucket <= current:
                                size = push(keys, items, size, time, q)
                            else:
                                free = put_off(q, bucket, free, heads, entries)
                                waiting += 1
                entry += 1
            side = int(np.int64(0))
            joint = np.int64(first_joint[p]) if n_joints > 0 else int(np.int64(-1))
            while True:
                straight = math.inf
                if side < 4:
                    q = neighbours[p, side]
                    side += 1
                elif 0 <= joint < n_joints and joint_node[joint] == p:
                    q = joint_other[joint]
                    straight = times[p] + 0.5 * (cost[p] + cost[q]) * joint_length[joint]
                    joint += 1
                    if straight == math.inf:
                        continue
                else:
                    break
                if state[q] > TRIAL:
                    continue
                # the upwind difference along each axis: it is of second order where two finished nodes in a row fall
                # towards the front (Sethian 1999)
                x_near, other = neighbours[q, 0], neighbours[q, 1]
                x_beyond = neighbours[x_near, 0]
                if final[other] < final[x_near]:
                    x_near, x_beyond = other, neighbours[other, 1]
                y_near, other = neighbours[q, 2], neighbours[q, 3]
                y_beyond = neighbours[y_near, 2]
                if final[other] < final[y_near]:
                    y_near, y_beyond = other, neighbours[other, 3]
                x_value, y_value = final[x_near], final[y_near]
                x_second = second and x_value < math.inf and final[x_beyond] <= x_value
                y_second = second and y_value < math.inf and final[y_beyond] <= y_value
                tx = (4.0 * x_value - final[x_beyond]) * (1.0 / 3.0) if x_second else x_value
                ty = (4.0 * y_value - final[y_beyond]) * (1.0 / 3.0) if y_second else y_value
                here = cost[q]
                x_shift = 0.0 if x_second else 0.5 * (cost[x_near] - here)
                y_shift = 0.0 if y_second else 0.5 * (cost[y_near] - here)
                time = math.inf
                if x_value < math.inf and y_value < math.inf:
                    kind = (2 if x_second else 0) + (1 if y_second else 0)
                    a = weights[kind, 0]
                    b = weights[kind, 1]
                    inverse = weights[kind, 2]
                    centred = max(here + x_shift + y_shift, min(here + 2.0 * x_shift, here + 2.0 * y_shift, here))
                    difference = (tx - ty) * inverse
                    rest = centred * centred * inverse - a * b * difference * difference
                    if rest >= 0.0:
                        time = (a * tx + b * ty) * inverse + math.sqrt(rest)
                        if not (time >= x_value and time >= y_value):
                            time = math.inf
                if time == math.inf:
                    if x_value < math.inf:
                        time = max(tx + (here + x_shift) * (hx * 2.0 / 3.0 if x_second else hx), x_value)
                    if y_value < math.inf:
                        time = min(time, max(ty + (here + y_shift) * (hy * 2.0 / 3.0 if y_second else hy), y_value))
                if beside_wall[q, 0] >= 0.0:
                    time = past_corner(q, here, final, neighbours, spacing, time, beside_wall[q])
                time = min(time, straight)
                if time < times[q]:
                    bucket = bucket_of(time, begin, per_time)
                    if bucket <= current:
                        size = push(keys, items, size, time, q)
                    elif bucket_of(times[q], begin, per_time) != bucket or times[q] == math.inf:
                        free = put_off(q, bucket, free, heads, entries)
                        waiting += 1
                    times[q] = time


@kernel
def spline_value(controls: WholeArray, u: float, v: float, values: FloatArray) -> float:
    """Evaluate a spline on a piece at ``(u, v)``, in spacings from the middle of its cell, each within 1/2."""
    total = 0.0
    for o in range(9):
        a = o % 3
        b = o // 3
        wx = 0.75 - u * u if a == 1 else 0.5 * (0.5 + (a - 1) * u) ** 2
        wy = 0.75 - v * v if b == 1 else 0.5 * (0.5 + (b - 1) * v) ** 2
        total += wx * wy * values[controls[o]]
    return total


@kernel
def look(u: float, v: float, piece: int, last: tuple[int, int], values: FloatArray, mesh: Pieces) -> tuple[float, int]:
    """
    Return the value of a spline at ``(u, v)``, at most a cell away from a piece, and the piece there.

    Places are in spacings from node (0, 0). The value is infinite inside an area or outside the bounds.
    """
    controls, columns, rows, piece_of = mesh
    if not (0.0 <= u <= last[0] and 0.0 <= v <= last[1]):
        return math.inf, -1
    dx = min(max(math.floor(u + 0.5) - columns[piece], -1), 1)
    dy = min(max(math.floor(v + 0.5) - rows[piece], -1), 1)
    there = piece if dx == 0 and dy == 0 else piece_of[controls[piece, 4 + dx + 3 * dy]]
    if there < 0:
        return math.inf, -1
    return spline_value(controls[there], u - columns[there], v - rows[there], values), there


@kernel
def walk(
    u: float, v: float, piece: int, turn: float, steps: int, last: tuple[int, int], values: FloatArray, mesh: Pieces
) -> float:
    """Walk some spacings straight on; return the value of the spline there, infinite if the way is not free."""
    value = math.inf
    for _ in range(steps):
        u += math.cos(turn)
        v += math.sin(turn)
        value, piece = look(u, v, piece, last, values, mesh)
        if piece < 0:
            return math.inf
    return value


@kernel
def downhill(
    u: float, v: float, piece: int, steps: int, last: tuple[int, int], values: FloatArray, mesh: Pieces
) -> tuple[float, float]:
    """Return the direction of the lowest point of a spline so many spacings away, an angle, and its value."""
    best = math.inf
    angle = 0.0
    for direction in range(32):
        turn = direction * (math.pi / 16.0)
        value = walk(u, v, piece, turn, steps, last, values, mesh)
        if value < best:
            best = value
            angle = turn
    width = math.pi / 32.0
    for _ in range(8):
        for side in range(-1, 2, 2):
            turn = angle + side * width
            value = walk(u, v, piece, turn, steps, last, values, mesh)
            if value < best:
                best = value
                angle = turn
                break
        width *= 0.5
    return angle, best


@kernel
def descend(
    start: tuple[float, float],
    piece: int,
    goal: tuple[float, float],
    radius: float,
    last: tuple[int, int],
    values: FloatArray,
    mesh: Pieces,
    neighbours: WholeArray,
    path: FloatArray,
) -> int:
    """
    Go down a spline of costs-to-go, always to the lowest point a spacing away, to within `radius` of the goal.

    The first steps look further ahead, so that a start on a ridge, where fronts met, is left to one side.

    Parameters
    ----------
    start, piece
        Where to start, in spacings from node (0, 0), and the piece of the mesh there.
    goal, radius
        Where to end, in spacings.
    last
        Column and row of the last node inside the bounds.
    values
        Control values of the spline.
    mesh
        Controls, columns and rows of the pieces (`SplineMesh`), and the piece in whose middle each node is, or -1.
    neighbours
        Of each node.
    path
        Points are written here, shape ``(m, 2)``, in spacings.

    Returns
    -------
    count
        How many points were written; -1 if it got stuck or `path` is full.
    """
    controls, columns, rows, piece_of = mesh
    u, v = start
    for count in range(path.shape[0]):
        path[count, 0] = u
        path[count, 1] = v
        if (u - goal[0]) ** 2 + (v - goal[1]) ** 2 <= radius * radius:
            return count + 1
        steps = max(8 - count, 1)
        here = spline_value(controls[piece], u - columns[piece], v - rows[piece], values)
        angle, best = downhill(u, v, piece, steps, last, values, mesh)
        if not best < here and steps > 1:
            angle, best = downhill(u, v, piece, min(steps, 1), last, values, mesh)
        if best < here:
            u += math.cos(angle)
            v += math.sin(angle)
            _, piece = look(u, v, piece, last, values, mesh)
            continue
        # beside an area the spline may have no way down: on to the best node beside, over those inside the area
        q = np.int64(controls[piece, 4])
        while True:
            lowest = values[q]
            onward = q
            for side in range(4):
                if values[neighbours[q, side]] < lowest:
                    lowest = values[neighbours[q, side]]
                    onward = np.int64(neighbours[q, side])
            if onward == q:
                return -1
            q = onward
            if piece_of[q] >= 0:
                break
        piece = piece_of[q]
        u = float(columns[piece])
        v = float(rows[piece])
    return -1

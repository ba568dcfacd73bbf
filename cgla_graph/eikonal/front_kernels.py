"""
Compiled kernels for all that happens to a front but marching.

It starts from the nodes in sight of a source, is led around corners of areas that the mesh does not resolve, and is
mirrored at the bounds.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.eikonal.marching_kernels import FAR, SEED, TRIAL, Nodes
from cgla_graph.model.no_fly_kernels import AreaArrays, segment_crosses


@kernel
def begin_disc(
    middle: WholeArray,
    nodes: Nodes,
    source: tuple[float, float],
    radius: float,
    area: AreaArrays,
    state: WholeArray,
) -> None:
    """
    Make the nodes near the source `SEED`.

    These are the nodes of the source's piece, `middle`, and all that are joined to them within the radius and in sight
    of the source. Nodes at the same places on the other side of a wall are not.
    """
    node_columns, node_rows, neighbours, origin, spacing = nodes
    n = node_columns.shape[0]
    stack = np.empty(n + 9, dtype=np.int32)
    size = 0
    for o in range(9):
        if state[middle[o]] == FAR:
            stack[size] = middle[o]
            size += 1
            state[middle[o]] = SEED
    while size > 0:
        size -= 1
        p = stack[size]
        for side in range(4):
            q = neighbours[p, side]
            if q == n or state[q] != FAR:
                continue
            x = origin[0] + spacing[0] * node_columns[q]
            y = origin[1] + spacing[1] * node_rows[q]
            near = (x - source[0]) ** 2 + (y - source[1]) ** 2 <= radius * radius
            if near and not segment_crosses(x, y, source[0], source[1], area):
                state[q] = SEED
                stack[size] = q
                size += 1


@kernel
def mirror(nodes: Nodes, last: tuple[int, int], values: FloatArray) -> None:
    """
    Mirror values at the bounds, to the nodes just outside: first west and east, then the others.

    So the spline is level across the bounds, where a path that follows them needs it to be: there, costs-to-go rise
    like a root of the distance, which no straight or higher continuation follows.
    """
    node_columns, node_rows, neighbours, _, _ = nodes
    for turn in range(2):
        for p in range(node_columns.shape[0]):
            column, row = node_columns[p], node_rows[p]
            side = -1
            if turn == 0 and 0 <= row <= last[1]:
                side = 1 if column < 0 else (0 if column > last[0] else -1)
            elif turn == 1:
                side = 3 if row < 0 else (2 if row > last[1] else -1)
            if side >= 0:
                near = neighbours[p, side]
                beyond = values[neighbours[near, side]]
                values[p] = beyond if beyond < math.inf else values[near]


@kernel
def bridge(
    controls: WholeArray, cost: FloatArray, spacing: tuple[float, float], times: FloatArray, state: WholeArray
) -> int:
    """
    Begin the nodes that no neighbour leads to, though a piece does, and return how many.

    At the end of a thin wall a node has one neighbour to the north, but pieces on either side have nodes of their own
    there.
    """
    found = 0
    for p in range(controls.shape[0]):
        for o in range(9):
            here = controls[p, o]
            if state[here] != FAR:
                continue
            for way in range(4):
                a = o % 3 + (1 if way == 0 else (-1 if way == 1 else 0))
                b = o // 3 + (1 if way == 2 else (-1 if way == 3 else 0))
                if 0 <= a < 3 and 0 <= b < 3:
                    time = times[controls[p, 3 * b + a]] + cost[here] * (spacing[0] if way < 2 else spacing[1])
                    if time < times[here]:
                        times[here] = time
                        found += 1
    for p in range(state.shape[0]):
        if state[p] == FAR and times[p] < math.inf:
            state[p] = TRIAL
    return found

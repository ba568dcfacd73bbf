"""
Compiled search of Lazy Theta*: A* over the 8-connected lattice whose parents may be any node in sight.

A node's key is ``g`` plus the straight distance to the goal, which bounds the cost from below. ``g`` is either
exact or, while the node is **pending**, a bound: the cost of the parent's own parent plus the straight distance
from there. A pending node that is popped is weighed by Eq. 5 and pushed again with its exact key; only exact nodes
are expanded. So no node is closed at more than its least cost over the 8-connected lattice: of a least-cost path to
it, the first open node has a key of at most that cost plus the distance to the goal.
"""

import heapq
import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.model.graph_kernels import Model
from cgla_graph.model.no_fly_kernels import segment_crosses
from cgla_graph.model.risk_kernels import segment_cost

#: Nodes, shape ``(n, 2)``, map units; columns and rows of the lattice that the first of them are; which of these are
#: free, of length 0 where a segment may touch corners; and what a segment costs.
Ground: TypeAlias = tuple[FloatArray, int, int, BoolArray, Model]


@kernel
def squeezes(i: int, j: int, width: int, free: BoolArray) -> bool:
    """
    Tell whether a segment between two lattice nodes passes a corner where a cell beside it is not free.

    A cell is the box around a lattice point, half a step to each side. A segment meets their corners exactly if
    both steps ``(a, b)`` between neighbouring lattice points on it are odd: half-way between the two points.

    Examples
    --------
    >>> free = np.array([True, False, True, True])
    >>> squeezes(0, 3, 2, free), squeezes(0, 2, 2, free)
    (True, False)
    """
    x, y = i % width, i // width
    across, up = j % width - x, j // width - y
    a, b = abs(across), abs(up)
    while b:
        a, b = b, a % b
    if a == 0 or not ((across // a) & 1 and (up // a) & 1):
        return False
    step_x, step_y = across // a, up // a
    side_x = 1 if step_x > 0 else -1
    side_y = 1 if step_y > 0 else -1
    x += (step_x - side_x) // 2
    y += (step_y - side_y) // 2
    for _ in range(a):
        if not (free[x + side_x + y * width] and free[x + (y + side_y) * width]):
            return True
        x += step_x
        y += step_y
    return False


@kernel
def neighbours(node: int, width: int, height: int, links: IntArray, out: IntArray) -> int:
    """
    Write the neighbours of a node to `out` and return how many there are.

    `links` holds the pairs of nodes, shape ``(m, 2)``, that join the nodes beyond the lattice to the corners of their
    cells and to each other.
    """
    n = 0
    if node < width * height:
        x, y = node % width, node // width
        for dy in range(-1, 2):
            for dx in range(-1, 2):
                if (dx or dy) and 0 <= x + dx < width and 0 <= y + dy < height:
                    out[n] = node + dx + dy * width
                    n += 1
    for m in range(links.shape[0]):
        if links[m, 0] == node or links[m, 1] == node:
            out[n] = links[m, 0] + links[m, 1] - node
            n += 1
    return n


@kernel
def sight_cost(i: int, j: int, most: float, ground: Ground) -> float:
    """Weigh the segment between two nodes by Eq. 5: infinite if it may not be flown, or costs `most` or more."""
    positions, width, _, free, model = ground
    k, field, area = model
    x1, y1 = positions[i, 0], positions[i, 1]
    x2, y2 = positions[j, 0], positions[j, 1]
    cost = segment_cost(x1, y1, x2, y2, k, field)
    # the cheapest test first
    if cost >= most or (max(i, j) < free.shape[0] and squeezes(i, j, width, free)):
        return math.inf
    return math.inf if segment_crosses(x1, y1, x2, y2, area) else cost


@kernel
def search(
    ground: Ground,
    links: IntArray,
    usable: BoolArray,
    source: int,
    target: int,
    values: FloatArray,
    parents: IntArray,
) -> tuple[int, int]:
    """
    Search from `source` until `target` is closed; return the segments weighed and the nodes expanded.

    `usable`, shape ``(n,)``, says which nodes a path may visit; `links` is as in `neighbours`. `values`, shape
    ``(n,)``, must be infinite on entry; afterwards ``values[target]`` is the cost, or still infinite, and `parents`,
    shape ``(n,)``, leads from `target` back to `source`.
    """
    positions, width, height, _, _ = ground
    goal_x, goal_y = positions[target, 0], positions[target, 1]
    bounds = np.full(positions.shape[0], np.inf)
    keys = np.full(positions.shape[0], np.inf)
    stamps = np.full(positions.shape[0], -1)
    weighed = np.zeros(positions.shape[0], dtype=np.int64)
    near = np.empty(8 + links.shape[0], dtype=np.int64)
    candidates = np.empty(2 * near.shape[0], dtype=np.int64)
    candidate_bounds = np.empty(2 * near.shape[0])
    values[source] = 0.0
    parents[source] = source
    keys[source] = math.hypot(goal_x - positions[source, 0], goal_y - positions[source, 1])
    heap = [(keys[source], keys[source], source)]
    n_weighed = 0
    n_closed = 0
    while heap:
        key, left, node = heapq.heappop(heap)
        if stamps[node] >= 0 or key > keys[node]:
            continue
        x, y = positions[node, 0], positions[node, 1]
        if bounds[node] < values[node]:
            # pending: weigh what the neighbours closed since the last time offer, the most promising first
            n = 0
            for m in range(neighbours(node, width, height, links, near)):
                if stamps[near[m]] >= weighed[node]:
                    candidates[n] = parents[near[m]]
                    candidates[n + 1] = near[m]
                    n += 2
            for c in range(n):
                p = candidates[c]
                candidate_bounds[c] = values[p] + math.hypot(x - positions[p, 0], y - positions[p, 1])
            while n > 0:
                best = np.argmin(candidate_bounds[:n])
                p = candidates[best]
                if candidate_bounds[best] >= values[node]:
                    break
                value = values[p] + sight_cost(p, node, values[node] - values[p], ground)
                n_weighed += 1
                if value < values[node]:
                    values[node] = value
                    parents[node] = p
                kept = 0
                for c in range(n):
                    if candidates[c] != p:
                        candidates[kept] = candidates[c]
                        candidate_bounds[kept] = candidate_bounds[c]
                        kept += 1
                n = kept
            weighed[node] = n_closed
            bounds[node] = np.inf
            keys[node] = values[node] + left
            if keys[node] > key:
                if values[node] < np.inf:
                    heapq.heappush(heap, (keys[node], left, node))
                continue
        stamps[node] = n_closed
        n_closed += 1
        if node == target:
            break
        p = parents[node]
        for m in range(neighbours(node, width, height, links, near)):
            other = near[m]
            if stamps[other] >= 0 or not usable[other]:
                continue
            ox, oy = positions[other, 0], positions[other, 1]
            bound = values[p] + math.hypot(ox - positions[p, 0], oy - positions[p, 1])
            if bound < values[other] and bound < bounds[other]:
                bounds[other] = bound
                rest = math.hypot(goal_x - ox, goal_y - oy)
                if bound + rest < keys[other]:
                    keys[other] = bound + rest
                    heapq.heappush(heap, (keys[other], rest, other))
    return n_weighed, n_closed


@kernel
def straighten(nodes: IntArray, ground: Ground, values: FloatArray, parents: IntArray) -> int:
    """
    Find the least-cost path that visits some of `nodes` in their order, the first and the last among them.

    Writes costs from the first to `values` and the place before each, in `nodes`, to `parents`, both of the length of
    `nodes`; returns the segments weighed.
    """
    positions = ground[0]
    n_weighed = 0
    values[0] = 0.0
    for i in range(1, nodes.shape[0]):
        values[i] = math.inf
        x, y = positions[nodes[i], 0], positions[nodes[i], 1]
        # from the nearest on: it is the one that the search found a way from
        for j in range(i - 1, -1, -1):
            bound = values[j] + math.hypot(x - positions[nodes[j], 0], y - positions[nodes[j], 1])
            if bound < values[i]:
                value = values[j] + sight_cost(nodes[j], nodes[i], values[i] - values[j], ground)
                n_weighed += 1
                if value < values[i]:
                    values[i] = value
                    parents[i] = j
    return n_weighed

"""
Compiled kernels of the search in space and time: A* over pairs of node and time of arrival.

A state is such a pair, with the cost of the moves that lead to it. Its moves are to fly straight to another node, or to
wait one tick. They are tried in order of ``f``, cost so far plus cost of the move plus least cost from there without
others, and each is tested for conflicts only when its turn comes. A state holds its place in the sorted list of its
node's edges, so that the heap holds two entries a state, not one an edge (partial expansion), and the list is sorted,
and its edges weighed, only as far as a state has come.
"""

import math
from typing import Final, NamedTuple, TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.cost_to_go.bound_kernels import ULPS, least_risk, risk_error
from cgla_graph.model.array_kernels import doubled, doubled_rows
from cgla_graph.model.graph_kernels import Model, pair_weight
from cgla_graph.motion.trajectory_kernels import NO_DISC, closest

#: Two arrivals at a node closer in time than this, ticks, are one: rounding sets them apart.
SAME_TIME: Final = 1e-9
#: How a search ends: at the goal, with nothing left to try, or at the limit of expansions.
ARRIVED, EXHAUSTED, LIMIT = range(3)
#: Columns of a search's table of states.
NODE, PARENT, BEFORE, CURSOR = range(4)
TIME, COST = range(2)

#: The motions of the others end to end: where each begins (and the last ends), times, points, the distances to keep.
Motions: TypeAlias = tuple[IntArray, FloatArray, FloatArray, FloatArray]


class Map(NamedTuple):
    """
    What a search moves over: the nodes, what an edge costs, what a tick of waiting costs.

    Attributes
    ----------
    positions
        Shape ``(n, 2)``, map units.
    usable
        Shape ``(n,)``: whether a node may be used.
    weights
        Weights between the first nodes, shape ``(n, n)`` or ``(n - 1, n - 1)``; ``(0, 0)``: computed when needed.
    width, height
        Shape of the lattice that the first nodes are; 0 for none.
    model
        What a segment costs.
    to_goal
        Shape ``(n,)``: least cost from each node to the goal, map units.
    waiting
        Shape ``(n,)``: cost of a tick of waiting, map units.
    start, goal
        Two nodes. A start that `weights` does not know is the last node, joined to all others by Eq. 5.
    """

    positions: FloatArray
    usable: BoolArray
    weights: FloatArray
    width: int
    height: int
    model: Model
    to_goal: FloatArray
    waiting: FloatArray
    start: int
    goal: int


class Limits(NamedTuple):
    """
    When a search begins and where it ends.

    Attributes
    ----------
    start_time, latest
        The goal must be reached by the latest time, ticks.
    step
        Map units flown a tick.
    window
        Arrivals at a node closer in time than this, ticks, count as one; the cheaper is kept.
    max_expansions
        States whose moves are tried, at most.
    """

    start_time: float
    latest: float
    step: float
    window: float
    max_expansions: int


@kernel
def goes_first(key: float, item: int, other_key: float, other_item: int) -> bool:
    """Whether an entry leaves the heap before another: least key first, then the greater (newer) item."""
    return key < other_key or (key == other_key and item > other_item)


@kernel
def push(keys: FloatArray, items: IntArray, size: int, key: float, item: int) -> int:
    """Add an entry to a binary heap of `size` entries; return the new size."""
    i = size
    while i > 0:
        parent = (i - 1) >> 1
        if not goes_first(key, item, keys[parent], items[parent]):
            break
        keys[i] = keys[parent]
        items[i] = items[parent]
        i = parent
    keys[i] = key
    items[i] = item
    return size + 1


@kernel
def drop_first(keys: FloatArray, items: IntArray, size: int) -> int:
    """Take the entry at place 0 out of a binary heap of `size` entries; return the new size."""
    size -= 1
    key = keys[size]
    item = items[size]
    i = 0
    while True:
        child = 2 * i + 1
        if child >= size:
            break
        if child + 1 < size and goes_first(keys[child + 1], items[child + 1], keys[child], items[child]):
            child += 1
        if not goes_first(keys[child], items[child], key, item):
            break
        keys[i] = keys[child]
        items[i] = items[child]
        i = child
    keys[i] = key
    items[i] = item
    return size


@kernel
def too_near(times: FloatArray, points: FloatArray, others: Motions) -> bool:
    """Whether a motion comes nearer to one of the others than is to be kept, at any time when both are there."""
    first, other_times, other_points, keep = others
    for i in range(keep.shape[0]):
        low, high = first[i], first[i + 1]
        distance, _ = closest(times, points, other_times[low:high], other_points[low:high], NO_DISC, NO_DISC)
        if distance < keep[i]:
            return True
    return False


@kernel
def list_edges(area: Map, node: int, keys: FloatArray, items: IntArray) -> int:
    """
    Put the edges of a node into a heap, by a lower bound of the cost to the goal along each; return how many.

    An item is the node that the edge leads to, plus `n` for each step that its key is nearer to the truth.
    """
    n = area.positions.shape[0]
    known = area.weights.shape[0]
    x, y = area.positions[node, 0], area.positions[node, 1]
    size = 0
    for j in range(n):
        if j != node and area.usable[j] and area.to_goal[j] < math.inf:
            if node < known and j < known:
                size = push(keys, items, size, area.weights[node, j] + area.to_goal[j], j + 2 * n)
            else:
                length = math.hypot(area.positions[j, 0] - x, area.positions[j, 1] - y)
                size = push(keys, items, size, length * (1.0 - ULPS) + area.to_goal[j], j)
    return size


@kernel
def sort_next(area: Map, node: int, keys: FloatArray, items: IntArray, size: int, near: FloatArray) -> int:
    """
    Move the edge of least cost to the goal out of the heap, to the place that it leaves free behind its last entry.

    Weights are integrals, and dear: only those are computed whose bounds, by length first and by single threats then,
    do not show that they are greater. Returns the new size of the heap.
    """
    n = area.positions.shape[0]
    k, field, _ = area.model
    table = field[0]
    x, y = area.positions[node, 0], area.positions[node, 1]
    while True:
        key = keys[0]
        item = items[0]
        size = drop_first(keys, items, size)
        if item >= 2 * n or key == math.inf:
            keys[size] = key
            items[size] = item % n
            return size
        j = item % n
        if item < n and k > 0.0 and table.shape[0] > 0:
            tx, ty = area.positions[j, 0], area.positions[j, 1]
            risk, _ = least_risk(x, y, tx, ty, table, near, math.inf, 0)
            error = k * risk_error(table) + ULPS * key
            size = push(keys, items, size, max(key, key + k * risk * (1.0 - ULPS) - error), item + n)
        else:
            weight = pair_weight(area.positions, area.width, area.height, node, j, area.model)
            size = push(keys, items, size, weight + area.to_goal[j], j + 2 * n)


@kernel
def search(area: Map, limits: Limits, others: Motions) -> tuple[int, int, int, float, FloatArray, IntArray]:
    """
    Find a way from the start to the goal that keeps its distance from all others.

    Returns
    -------
    outcome
        `ARRIVED`, `EXHAUSTED` or `LIMIT`.
    state
        The state at the goal, or -1.
    n_expansions
        States whose moves were tried.
    bound
        No way over these moves costs less, map units; infinite: there is none.
    moments
        Time and cost of each state, shape ``(states, 2)``.
    states
        Node, state before, and two more columns of each state, shape ``(states, 4)``.

    Notes
    -----
    Long, because each of its steps may find an array full and put a longer one in its place.
    """
    n = area.positions.shape[0]
    moments = np.empty((256, 2))
    states = np.empty((256, 4), dtype=np.int64)
    heap_keys = np.empty(512)
    heap_items = np.empty(512, dtype=np.int64)
    # the edges of the nodes that were expanded, sorted as far as needed; of those not yet, the slot is -1
    slots = np.full(n, -1, dtype=np.int64)
    edge_keys = np.empty((16, n))
    edge_items = np.empty((16, n), dtype=np.int64)
    n_edges = np.empty(16, dtype=np.int64)
    n_left = np.empty(16, dtype=np.int64)
    n_slots = 0
    near = np.empty((area.model[1][0].shape[0] + 1, 3))
    # the last state reached at each node; BEFORE leads to those before it
    reached = np.full(n, -1, dtype=np.int64)
    times = np.empty(2)
    points = np.empty((2, 2))
    gx, gy = area.positions[area.goal, 0], area.positions[area.goal, 1]
    bound = math.inf

    moments[0, TIME] = limits.start_time
    moments[0, COST] = 0.0
    states[0, NODE] = area.start
    states[0, PARENT] = -1
    states[0, BEFORE] = -1
    states[0, CURSOR] = -1
    reached[area.start] = 0
    n_states = 1
    n_expansions = 0
    # an odd item is a state's next edge, an even one its waiting
    size = push(heap_keys, heap_items, 0, area.to_goal[area.start], 1)
    while size > 0:
        f = heap_keys[0]
        item = heap_items[0]
        size = drop_first(heap_keys, heap_items, size)
        state = item >> 1
        node = states[state, NODE]
        cost = moments[state, COST]
        if size + 3 > heap_keys.shape[0]:
            heap_keys, heap_items = doubled(heap_keys), doubled(heap_items)
        if item & 1:
            slot = slots[node]
            cursor = states[state, CURSOR]
            if cursor < 0:
                if n_expansions >= limits.max_expansions:
                    return LIMIT, -1, n_expansions, min(bound, f), moments, states
                n_expansions += 1
                if slot < 0:
                    if n_slots == n_edges.shape[0]:
                        edge_keys, edge_items = doubled_rows(edge_keys), doubled_rows(edge_items)
                        n_edges, n_left = doubled(n_edges), doubled(n_left)
                    slot = n_slots
                    n_slots += 1
                    slots[node] = slot
                    n_edges[slot] = list_edges(area, node, edge_keys[slot], edge_items[slot])
                    n_left[slot] = n_edges[slot]
                wait = cost + area.waiting[node] + area.to_goal[node]
                size = push(heap_keys, heap_items, size, wait, item - 1)
            # sorted edges stand behind the heap of those that are left, the first one last
            after = n_edges[slot] - 1 - (cursor + 1)
            states[state, CURSOR] = cursor + 1
            if after >= 0:
                if after < n_left[slot]:
                    n_left[slot] = sort_next(area, node, edge_keys[slot], edge_items[slot], n_left[slot], near)
                if edge_keys[slot, after] < math.inf:
                    size = push(heap_keys, heap_items, size, cost + edge_keys[slot, after], item)
            if cursor < 0:
                continue
            target = edge_items[slot, after + 1]
            new_cost = cost + (edge_keys[slot, after + 1] - area.to_goal[target])
        else:
            target = node
            new_cost = cost + area.waiting[node]
        x, y = area.positions[node, 0], area.positions[node, 1]
        tx, ty = area.positions[target, 0], area.positions[target, 1]
        time = moments[state, TIME]
        duration = 1.0 if target == node else math.hypot(tx - x, ty - y) / limits.step
        new_time = time + duration
        if new_time + math.hypot(gx - tx, gy - ty) / limits.step > limits.latest + SAME_TIME or new_time == time:
            continue
        # whoever reached the node before did so at no more cost: the heap gives the least f first
        apart = math.inf
        other = reached[target]
        while other >= 0:
            apart = min(apart, abs(moments[other, TIME] - new_time))
            other = states[other, BEFORE]
        if apart <= SAME_TIME or (apart < limits.window and bound < math.inf):
            continue
        times[0], times[1] = time, new_time
        points[0, 0], points[0, 1], points[1, 0], points[1, 1] = x, y, tx, ty
        if too_near(times, points, others):
            continue
        if apart < limits.window:
            # the first that is left out without proof that it cannot be better: from here on, less is known
            bound = f
            continue
        if n_states == states.shape[0]:
            moments, states = doubled_rows(moments), doubled_rows(states)
        moments[n_states, TIME] = new_time
        moments[n_states, COST] = new_cost
        states[n_states, NODE] = target
        states[n_states, PARENT] = state
        states[n_states, BEFORE] = reached[target]
        states[n_states, CURSOR] = -1
        reached[target] = n_states
        if target == area.goal:
            return ARRIVED, n_states, n_expansions, min(bound, new_cost), moments, states
        size = push(heap_keys, heap_items, size, new_cost + area.to_goal[target], 2 * n_states + 1)
        n_states += 1
    return EXHAUSTED, -1, n_expansions, bound, moments, states

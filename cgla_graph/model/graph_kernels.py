"""
Compiled kernels of graphs: Eq. 5 for many segments at once, and the rounds of Eq. 9.

A model is what a segment costs: the tuple of `k`, the risk field and the no-fly area. A segment that crosses the
area weighs infinity, which is how every kernel says that there is no edge.
"""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.model.no_fly_kernels import AreaArrays, segment_crosses
from cgla_graph.model.risk_kernels import Field, segment_cost

#: What a segment costs: k, the risk field, the no-fly area.
Model: TypeAlias = tuple[float, Field, AreaArrays]
#: Columns that are summed together: so many of all rows fit the cache.
BAND = 32


@kernel
def stride(i: int, j: int, width: int, height: int) -> int:
    """Return the greatest common divisor of the steps between two lattice nodes; 1 where one is off the lattice."""
    if i >= width * height or j >= width * height:
        return 1
    a = abs(j % width - i % width)
    b = abs(j // width - i // width)
    while b:
        a, b = b, a % b
    return a


@kernel
def pair_cost(positions: FloatArray, width: int, height: int, i: int, j: int, k: float, field: Field) -> float:
    """
    Evaluate Eq. 5 between two nodes of the complete graph, wherever the no-fly area is; 0 for a node and itself.

    The first ``width * height`` positions are a lattice. A segment through further lattice nodes is added up from its
    parts, as `complete_sums` does it, so that every kernel gives the same float.
    """
    low, high = min(i, j), max(i, j)
    if low == high:
        return 0.0
    # between lattice nodes, equal steps along the segment are equal steps of the index
    step = (high - low) // stride(low, high, width, height)
    total = 0.0
    for end in range(high, low, -step):
        a, b = end - step, end
        total = segment_cost(positions[a, 0], positions[a, 1], positions[b, 0], positions[b, 1], k, field) + total
    return total


@kernel
def pair_weight(positions: FloatArray, width: int, height: int, i: int, j: int, model: Model) -> float:
    """Weigh the pair of two nodes of the complete graph, as `complete_row` does: infinity if the segment crosses."""
    k, field, area = model
    if i != j and segment_crosses(positions[i, 0], positions[i, 1], positions[j, 0], positions[j, 1], area):
        return math.inf
    return pair_cost(positions, width, height, i, j, k, field)


@kernel
def complete_row(positions: FloatArray, width: int, height: int, node: int, model: Model, out: FloatArray) -> None:
    """Write the weights between `node` and every node of the complete graph to `out`, shape ``(n,)``."""
    k, field, area = model
    for j in range(positions.shape[0]):
        out[j] = math.inf
        if j == node or not segment_crosses(
            positions[node, 0], positions[node, 1], positions[j, 0], positions[j, 1], area
        ):
            out[j] = pair_cost(positions, width, height, node, j, k, field)


@kernel
def complete_share(
    positions: FloatArray, width: int, height: int, model: Model, first: int, step: int, out: FloatArray
) -> None:
    """
    Cost the pairs that join no third lattice node, for the rows `first`, ``first + step``, …: a share of the work.

    The first ``width * height`` positions are a lattice. A segment through further lattice nodes is the sum of its
    parts (Eq. 5 is additive along a line), 39 % of all pairs; `complete_sums` adds them up.
    """
    k, field, _ = model
    n = positions.shape[0]
    for i in range(first, n, step):
        x, y = positions[i, 0], positions[i, 1]
        for j in range(i + 1, n):
            if stride(i, j, width, height) == 1:
                out[i, j] = segment_cost(x, y, positions[j, 0], positions[j, 1], k, field)


@kernel
def complete_sums(width: int, height: int, first: int, step: int, out: FloatArray) -> None:
    """
    Complete what `complete_share` began: pairs through further lattice nodes, the other triangle, the diagonal.

    For a share of the columns, those numbered `first`, ``first + step``, … in `BAND` each: no sum needs any other.
    """
    n = out.shape[0]
    for start in range(first * BAND, n, step * BAND):
        stop = min(start + BAND, n)
        for i in range(stop - 1, -1, -1):
            for j in range(max(i + 1, start), stop):
                parts = stride(i, j, width, height)
                if parts > 1:
                    # the nodes between have higher numbers than i; the first part goes through none
                    between = i + (j - i) // parts
                    out[i, j] = out[i, between] + out[between, j]
        for i in range(stop):
            for j in range(max(i + 1, start), stop):
                out[j, i] = out[i, j]
        for j in range(start, stop):
            out[j, j] = 0.0


@kernel
def complete_crossings(positions: FloatArray, area: AreaArrays, first: int, step: int, out: FloatArray) -> None:
    """
    Take away the pairs whose segment crosses the area, for a share of the rows.

    Every segment is tested whole: its parts between lattice nodes are not in line to the last bit.
    """
    n = positions.shape[0]
    for i in range(first, n, step):
        x, y = positions[i, 0], positions[i, 1]
        for j in range(i + 1, n):
            if segment_crosses(x, y, positions[j, 0], positions[j, 1], area):
                out[i, j] = math.inf
                out[j, i] = math.inf


@kernel
def settle(row: FloatArray, node: int, values: FloatArray, successors: IntArray, settled: BoolArray) -> int:
    """
    Settle `node`, apply Eq. 9 with it to all unsettled nodes, and return the unsettled node of least value.

    `row` holds ``A(p_i, node)`` for every ``p_i``. Returns -1 if no unsettled node has a finite value. Of several
    least nodes the one of lowest index is returned.
    """
    settled[node] = True
    base = values[node]
    best = math.inf
    nearest = -1
    for i in range(values.shape[0]):
        if not settled[i]:
            cost = row[i] + base
            if cost < values[i]:
                values[i] = cost
                successors[i] = node
            if values[i] < best:
                best = values[i]
                nearest = i
    return nearest


@kernel
def label_setting(
    weights_to: FloatArray,
    target: int,
    source: int,
    values: FloatArray,
    successors: IntArray,
    order: IntArray,
) -> int:
    """
    Run Eq. 9 with ``p_r`` taken from Delta_k each round (Eqs 10-12), and return the number of rounds.

    `weights_to` holds ``A(p_i, p_r)`` in row ``r``; `values` starts at infinity but 0 at the target. Ends when the
    source is in Delta_k (Step 2), or, for `source` -1, when no unsettled node can be reached. `order` gets the
    nodes in the order of settling.
    """
    settled = np.zeros(values.shape[0], dtype=np.bool_)
    node = target
    n_rounds = 0
    while node >= 0 and not (source >= 0 and values[node] == values[source]):
        order[n_rounds] = node
        n_rounds += 1
        node = settle(weights_to[node], node, values, successors, settled)
    return n_rounds


@kernel
def relax(
    row: FloatArray, node: int, base: float, values: FloatArray, successors: IntArray, changed: BoolArray
) -> bool:
    """
    Apply Eq. 9 with ``p_r = node`` of value `base` to every other node; mark and say what changed.

    `row` holds ``A(p_i, node)`` for every ``p_i``.
    """
    any_change = False
    for i in range(values.shape[0]):
        cost = row[i] + base
        if cost < values[i] and i != node:
            values[i] = cost
            successors[i] = node
            changed[i] = True
            any_change = True
    return any_change

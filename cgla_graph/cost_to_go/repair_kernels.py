"""
Compiled kernels of incremental planning: label setting that weighs a pair of nodes only where it may matter.

A pair is bounded from below (`bound_kernels`) by its length, by single threats, and where an old cost matrix ``H`` is
known by the triangle inequality ``A_old(i, r) >= H(i) - H(r)``, less what threats that are gone took away at most. All
bounds allow for rounding and for the error of the integrals.

A segment through further lattice nodes is the sum of its parts, so that a way along the parts costs the same: it is
weighed only where the no-fly area takes away a part but not the whole (the parts are not in line to the last bit).
"""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.cost_to_go.bound_kernels import ULPS, gone_risk, in_boxes, in_reach, least_risk, risk_error
from cgla_graph.model.graph_kernels import Model, pair_weight, stride
from cgla_graph.model.no_fly_kernels import point_inside, segment_crosses

#: Lower bounds of pairs that wait for each node; where there are more, the most promising one is weighed at once.
ROOM = 12

#: Nodes of a complete graph: positions, width and height of the lattice that the first of them are (0, 0: none), and,
#: shape ``(width, height)``, whether a step of so many columns and rows passes no third lattice node.
Nodes: TypeAlias = tuple[FloatArray, int, int, BoolArray]
#: The cost matrix and model before the change: H, ``min(1, k / k_old)``, k_old, the table of the threats that are gone,
#: the error of the old weights, and the boxes of no-fly polygons that are gone, shape ``(b, 4)``.
Before: TypeAlias = tuple[FloatArray, float, float, FloatArray, float, FloatArray]


@kernel
def carry(
    nodes: Nodes,
    model: Model,
    order: IntArray,
    old: FloatArray,
    successors: IntArray,
    everything: bool,
    changed: FloatArray,
    redrawn: bool,
    values: FloatArray,
    edges: FloatArray,
) -> None:
    """
    Carry new weights down an old tree: an upper bound of every value, the cost of the old path under the new model.

    Nodes come in `order`, each after its successor. Edges out of reach of the `changed` threats keep their weight
    unless `everything` is touched; where the no-fly area was `redrawn`, every edge is tested against it. A node whose
    path kept its weights keeps its value to the last bit. `edges` gets the weights of the edges that were weighed
    again, else NaN.
    """
    positions, width, height, _ = nodes
    values[:] = math.inf
    edges[:] = math.nan
    for i in order:
        s = successors[i]
        if s < 0:
            values[i] = old[i]
            continue
        if values[s] == math.inf:
            continue
        x1, y1, x2, y2 = positions[i, 0], positions[i, 1], positions[s, 0], positions[s, 1]
        touched = everything or values[s] != old[s] or in_reach(x1, y1, x2, y2, changed)
        if touched:
            edges[i] = pair_weight(positions, width, height, i, s, model)
            values[i] = edges[i] + values[s]
        elif redrawn and segment_crosses(x1, y1, x2, y2, model[2]):
            edges[i] = math.inf
        else:
            values[i] = old[i]


@kernel
def borrow(
    nodes: Nodes,
    model: Model,
    order: IntArray,
    old: FloatArray,
    grown: bool,
    values: FloatArray,
    edges: FloatArray,
    successors: IntArray,
) -> None:
    """
    Lower the bounds that `carry` left: a node tries the successors of its eight neighbours on the lattice.

    Where weights have only `grown`, only the nodes whose bound rose do. It costs a weight or two a node, and saves
    label setting most of the pairs that would pass against values far too high.
    """
    positions, width, height, _ = nodes
    k, field, _ = model
    table = field[0]
    error = k * risk_error(table)
    near = np.empty((table.shape[0] + 1, 3))
    hint = 0
    for i in order:
        if i >= width * height or (grown and values[i] == old[i]):
            continue
        x1, y1 = positions[i, 0], positions[i, 1]
        for row in range(max(i // width - 1, 0), min(i // width + 2, height)):
            for column in range(max(i % width - 1, 0), min(i % width + 2, width)):
                s = successors[column + row * width]
                if s < 0 or s == i or s == successors[i]:
                    continue
                x2, y2 = positions[s, 0], positions[s, 1]
                length = math.sqrt((x2 - x1) * (x2 - x1) + (y2 - y1) * (y2 - y1)) * (1.0 - ULPS)
                key = length + values[s]
                if key < values[i] and k > 0.0 and table.shape[0]:
                    enough = (values[i] - key + error) / k
                    risk, hint = least_risk(x1, y1, x2, y2, table, near, enough, hint)
                    key += k * risk - error
                if key < values[i]:
                    weight = pair_weight(positions, width, height, i, s, model)
                    if weight + values[s] < values[i]:
                        values[i] = weight + values[s]
                        successors[i] = s
                        edges[i] = weight


@kernel
def _is_sum(nodes: Nodes, model: Model, i: int, r: int) -> bool:
    """Tell whether a way along the lattice nodes between two nodes costs the same as the segment itself."""
    positions, width, height, _ = nodes
    area = model[2]
    parts = stride(i, r, width, height)
    if parts == 1:
        return False
    between = i + (r - i) // parts
    x, y = positions[between, 0], positions[between, 1]
    return not (
        segment_crosses(positions[i, 0], positions[i, 1], x, y, area)
        or segment_crosses(x, y, positions[r, 0], positions[r, 1], area)
    )


@kernel
def _triangle(
    x1: float, y1: float, x2: float, y2: float, i: int, r: int, value: float, before: Before, error: float
) -> float:
    """Bound ``A(i, r) + value`` from below, where ``value`` is G of r, by the matrix and model before."""
    old, shrink, k_old, gone, old_error, opened = before
    if opened.shape[0] and in_boxes(x1, y1, x2, y2, opened):
        return 0.0
    if old[i] == math.inf:
        # no reached node could be seen from here before, and what hid them is still there
        return math.inf if old[r] < math.inf else 0.0
    if old[r] == math.inf:
        return 0.0
    lost = 0.0
    if gone.shape[0] and in_reach(x1, y1, x2, y2, gone):
        lost = k_old * (gone_risk(x1, y1, x2, y2, gone) + old_error) + error
    elif shrink == 1.0:
        # values that moved alike need no allowance: Eq. 9 held for the very same weights or lesser ones
        return float(old[i] + (value - old[r]))
    return float(shrink * (old[i] - old[r] - lost) + value - ULPS * (old[i] + value))


@kernel
def _lowest(tops: FloatArray, nodes_at: IntArray, n_open: int) -> int:
    """Return the slot of the least key; of several, that of the lowest node."""
    a, b, c, d = math.inf, math.inf, math.inf, math.inf
    # four minima in turn: one alone would wait for itself
    for quad in range(n_open // 4):
        a = min(a, tops[4 * quad])
        b = min(b, tops[4 * quad + 1])
        c = min(c, tops[4 * quad + 2])
        d = min(d, tops[4 * quad + 3])
    for slot in range(n_open - n_open % 4, n_open):
        a = min(a, tops[slot])
    best = min(a, b, c, d)
    lowest = -1
    for slot in range(n_open):
        if tops[slot] == best and (lowest < 0 or nodes_at[slot] < nodes_at[lowest]):
            lowest = slot
    return lowest


@kernel
def settle_lazily(
    nodes: Nodes,
    model: Model,
    before: Before,
    final: IntArray,
    edges: FloatArray,
    values: FloatArray,
    successors: IntArray,
    order: IntArray,
) -> tuple[int, int]:
    """
    Run Eq. 9 by label setting on a complete graph, and weigh only the pairs that may lower a value.

    Parameters
    ----------
    nodes, model
        The graph.
    before
        What an old cost matrix says; with H = 0 everywhere and a box around everything it says nothing.
    final
        Nodes whose value cannot fall any more, in the order of their values.
    edges
        Weights of the edges to the given successors where they are known, else NaN, shape ``(n,)``.
    values, successors
        Upper bounds of G with a path each; G and its paths on return, shapes ``(n,)``.
    order
        Gets the nodes in the order of settling, shape ``(n,)``.

    Returns
    -------
    settled, weighed
        Numbers of nodes settled and of pairs weighed.

    Notes
    -----
    A pair waits with a lower bound of the value that it offers. The least of all values and bounds comes next: a value
    is final then, and a bound is replaced by the exact value. So a pair is weighed only if its bound is below the final
    value of its node, or if more than `ROOM` pairs wait for the node.

    It is long because the innermost loop works on some twenty arrays, which its parts would have to pass to each other.
    """
    positions, width, height, coprime = nodes
    old, shrink, _, gone, _, opened = before
    k, field, area = model
    table = field[0]
    n = positions.shape[0]
    n_lattice = width * height
    error = k * risk_error(table)
    grown = gone.shape[0] == 0 and opened.shape[0] == 0 and shrink == 1.0
    risky = k > 0.0 and table.shape[0] > 0
    walled = area[2].shape[0] > 0
    tree = successors.copy()
    near = np.empty((table.shape[0] + 1, 3))
    hints = np.zeros(n, dtype=np.int64)
    # of lattice nodes; a division for each pair would cost as much as a bound
    columns, rows = np.empty(n_lattice, dtype=np.int64), np.empty(n_lattice, dtype=np.int64)
    for i in range(n_lattice):
        columns[i], rows[i] = i % width, i // width
    # the pairs that wait for each node
    keys = np.empty((n, ROOM))
    heads = np.empty((n, ROOM), dtype=np.int64)
    n_waiting = np.zeros(n, dtype=np.int64)
    # the open nodes, in slots without gaps
    settled = np.zeros(n, dtype=np.bool_)
    for i in final:
        settled[i] = True
    if walled:
        for i in range(n):
            # no segment leads out of the area
            settled[i] |= values[i] == math.inf and point_inside(positions[i, 0], positions[i, 1], area)
    at = np.flatnonzero(~settled)
    n_open = at.shape[0]
    x, y, tops, limits = positions[at, 0], positions[at, 1], values[at], values[at]
    rises = limits - old[at]
    passing = np.empty(n_open, dtype=np.int64)
    n_settled = 0
    n_final = 0
    n_weighed = 0
    while True:
        slot = _lowest(tops, at, n_open)
        best = tops[slot] if slot >= 0 else math.inf
        if n_final < final.shape[0] and values[final[n_final]] <= best:
            node = final[n_final]
            n_final += 1
        elif best < math.inf:
            node = at[slot]
            if best < values[node]:
                n_weighed += 1
                tops[slot] = _weigh_first(nodes, model, node, keys, heads, n_waiting, values, successors)
                limits[slot] = values[node]
                rises[slot] = values[node] - old[node]
                continue
            n_open -= 1
            for column in (x, y, tops, limits, rises):
                column[slot] = column[n_open]
            at[slot] = at[n_open]
        else:
            return n_settled, n_weighed
        order[n_settled] = node
        n_settled += 1
        value = values[node]
        rise = value - old[node]
        x2, y2 = positions[node, 0], positions[node, 1]
        # Most pairs end here, and so without branches: by their length, and by the triangle inequality where weights
        # only grew. (Where a comparison meets a NaN, from a node that was not reached before, the pair passes.)
        n_passing = 0
        for slot in range(n_open):
            dx, dy = x[slot] - x2, y[slot] - y2
            short = math.sqrt(dx * dx + dy * dy) * (1.0 - ULPS) + value < limits[slot]
            passing[n_passing] = slot
            n_passing += short and not (grown and rise >= rises[slot])
        for passed in range(n_passing):
            slot = passing[passed]
            i = at[slot]
            if tree[i] == node and not math.isnan(edges[i]):
                offer = edges[i] + value
                if offer < values[i]:
                    values[i] = offer
                    successors[i] = node
                    limits[slot] = offer
                    rises[slot] = offer - old[i]
                    tops[slot] = min(tops[slot], offer)
                continue
            if (
                i < n_lattice
                and node < n_lattice
                and not coprime[abs(columns[node] - columns[i]), abs(rows[node] - rows[i])]
                and (not walled or _is_sum(nodes, model, i, node))
            ):
                continue
            x1, y1 = x[slot], y[slot]
            dx, dy = x1 - x2, y1 - y2
            length = math.sqrt(dx * dx + dy * dy) * (1.0 - ULPS)
            key = length + value
            if grown and not math.isnan(rise):
                key = max(key, old[i] + rise)
            elif not grown:
                key = max(key, _triangle(x1, y1, x2, y2, i, node, value, before, error))
            if not key < limits[slot]:
                continue
            if risky:
                enough = (limits[slot] - value - length + error) / k * (1.0 + ULPS)
                risk, hints[i] = least_risk(x1, y1, x2, y2, table, near, enough, hints[i])
                key = max(key, length + (k * risk * (1.0 - ULPS) - error) + value)
            while key < values[i] and n_waiting[i] == ROOM:
                n_weighed += 1
                tops[slot] = _weigh_first(nodes, model, i, keys, heads, n_waiting, values, successors)
                limits[slot] = values[i]
                rises[slot] = values[i] - old[i]
            if key < values[i]:
                keys[i, n_waiting[i]] = key
                heads[i, n_waiting[i]] = node
                n_waiting[i] += 1
                tops[slot] = min(tops[slot], key)


@kernel
def _weigh_first(
    nodes: Nodes,
    model: Model,
    node: int,
    keys: FloatArray,
    heads: IntArray,
    n_waiting: IntArray,
    values: FloatArray,
    successors: IntArray,
) -> float:
    """
    Weigh the most promising pair that waits for `node`, and drop those that cannot lower its value any more.

    Returns the least of the node's value and the bounds that still wait.
    """
    positions, width, height, _ = nodes
    first = 0
    for slot in range(1, n_waiting[node]):
        if keys[node, slot] < keys[node, first] or (
            keys[node, slot] == keys[node, first] and heads[node, slot] < heads[node, first]
        ):
            first = slot
    head = heads[node, first]
    keys[node, first] = math.inf
    offer = pair_weight(positions, width, height, node, head, model) + values[head]
    if offer < values[node]:
        values[node] = offer
        successors[node] = head
    least = float(values[node])
    kept = 0
    for slot in range(n_waiting[node]):
        if keys[node, slot] < values[node]:
            keys[node, kept] = keys[node, slot]
            heads[node, kept] = heads[node, slot]
            least = min(least, keys[node, kept])
            kept += 1
    n_waiting[node] = kept
    return least


@kernel
def link(nodes: Nodes, values: FloatArray, model: Model) -> tuple[float, int]:
    """
    Return ``min_j A(p, j) + G(j)`` for the last node ``p``, and the ``j`` of lowest bound that attains it, or -1.

    `values` is G of all nodes but the last, shape ``(n - 1,)``. Nodes are taken in the order of their bounds: length
    first, then the risk of single threats, then the weight.
    """
    positions, width, height, _ = nodes
    k, field, _ = model
    table = field[0]
    n = values.shape[0]
    x, y = positions[n, 0], positions[n, 1]
    error = k * risk_error(table)
    near = np.empty((table.shape[0] + 1, 3))
    keys = np.empty(n)
    for j in range(n):
        dx, dy = positions[j, 0] - x, positions[j, 1] - y
        keys[j] = math.sqrt(dx * dx + dy * dy) * (1.0 - ULPS) + values[j]
    bounded = np.zeros(n, dtype=np.bool_)
    best = math.inf
    successor = -1
    hint = 0
    while True:
        j = int(np.argmin(keys))
        if not keys[j] < best:
            return best, successor
        x2, y2 = positions[j, 0], positions[j, 1]
        if bounded[j] or k == 0.0 or table.shape[0] == 0:
            keys[j] = math.inf
            offer = pair_weight(positions, width, height, n, j, model) + values[j]
            if offer < best:
                best = offer
                successor = j
        else:
            bounded[j] = True
            enough = (best - keys[j] + error) / k * (1.0 + ULPS)
            risk, hint = least_risk(x, y, x2, y2, table, near, enough, hint)
            keys[j] = max(keys[j], keys[j] + (k * risk * (1.0 - ULPS) - error) - ULPS * keys[j])

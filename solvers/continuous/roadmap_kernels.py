"""Compiled kernel of least-cost trees on a sparse graph."""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, IntArray, WholeArray
from cgla_graph.eikonal.queue_kernels import drop_first, push


@kernel
def grow_tree(
    starts: IntArray, heads: IntArray, costs: FloatArray, root: int, values: FloatArray, before: IntArray
) -> None:
    """
    Find the least costs from a root to all nodes (Dijkstra 1959).

    Parameters
    ----------
    starts, heads, costs
        The edges that leave node ``i`` are those from ``starts[i]`` up to ``starts[i + 1]``: the nodes that they lead
        to, and their costs, at least 0 (with others, what is found are costs of some ways).
    root
        A node.
    values, before
        The least cost to each node, and the node before it on the way, shape ``(n,)``: infinite and -1 when called,
        and on return where no way leads.

    Examples
    --------
    >>> values, before = np.full(3, np.inf), np.full(3, -1)
    >>> grow_tree(np.array([0, 2, 3, 3]), np.array([1, 2, 2]), np.array([1.0, 5.0, 2.0]), 0, values, before)
    >>> values.tolist(), before.tolist()
    ([0.0, 1.0, 3.0], [-1, 0, 1])
    """
    done = np.zeros(values.shape[0], dtype=np.bool_)
    # an edge puts its end into the queue once at most; and a heap looks at keys beyond its last one
    room = costs.shape[0] + 8
    keys = np.full(room, math.inf)
    items: WholeArray = np.empty(room, dtype=np.uint32)
    values[root], keys[0], items[0] = 0.0, 0.0, root
    size = int(np.int64(1))
    while size > 0:
        key = keys[0]
        node = items[0]
        size = drop_first(keys, items, size)
        if done[node]:
            # there was a better way
            continue
        done[node] = True
        for edge in range(starts[node], starts[node + 1]):
            head = heads[edge]
            value = key + costs[edge]
            if value < values[head] and not done[head]:
                values[head] = value
                before[head] = node
                size = push(keys, items, size, value, int(np.uint32(head)))

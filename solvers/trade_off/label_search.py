"""Constrained shortest paths on a graph of two weights, which no single risk weight finds."""

import heapq
import math
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.solvers.shortest_paths import least_cost_tree, path_to

#: Labels are given up beyond this many: the search may need exponentially many.
MOST_LABELS = 200_000


@dataclass(frozen=True)
class ConstrainedPath:
    """
    Result of a search.

    Attributes
    ----------
    nodes
        The path's nodes; empty if none is lighter than the known path.
    bound
        Proven: no path within the budget weighs less, except the known one.
    finished
        Whether the search ended because nothing better is left.
    """

    nodes: tuple[int, ...]
    bound: float
    finished: bool


def constrained_path(
    weights: FloatArray,
    uses: FloatArray,
    ends: tuple[int, int],
    budget: float,
    *,
    price: float,
    known: float = math.inf,
    max_labels: int = MOST_LABELS,
) -> ConstrainedPath:
    """
    Find the lightest path whose use keeps a budget, by label setting (Dumitrescu, Boland, Networks 42(3), 2003).

    A label is a way from the source: its weight and its use. It is dropped where another label of the node is as good
    in both, or where weight, use, or ``weight + price * use``, with the least value from there to the target added,
    exceeds the known path or the budget. The labels are taken in the order of that last sum, the Lagrangian bound, so
    that the first one left always bounds the answer from below.

    Parameters
    ----------
    weights, uses
        Of all pairs of nodes, shape ``(n, n)`` each, symmetric and at least 0; where either is infinite is no edge.
    ends
        Source and target.
    budget
        The most that a path may use, at least 0.
    price
        Lagrange multiplier of the use, at least 0: the better it prices the budget, the fewer labels.
    known
        Weight of the best path known; only a lighter one is looked for.
    max_labels
        Stop after this many.

    Returns
    -------
    found
        The path and the proof.

    Examples
    --------
    >>> inf = math.inf
    >>> weights = np.array([[0, 1, 4], [1, 0, 1], [4, 1, 0]])
    >>> uses = np.array([[0, 5, 1], [5, 0, 5], [1, 5, 0]])
    >>> constrained_path(weights, uses, (0, 2), budget=9, price=0.1).nodes
    (0, 2)
    """
    source, target = ends
    edges = np.isfinite(weights) & np.isfinite(uses)
    rest = [_least_values(edges, values, target) for values in (weights, uses, weights + price * uses)]
    offset = price * budget
    # for sums in another order
    room = budget * (1.0 + 1e-14)
    #: of each label, its node and the label before it
    nodes, before = [source], [-1]
    kept: list[list[tuple[float, float]]] = [[] for _ in weights]
    heap = [(float(rest[2][source]) - offset, 0, 0.0, 0.0)]
    if rest[1][source] > room:
        return ConstrainedPath((), math.inf, finished=True)
    while heap:
        bound, label, weight, use = heapq.heappop(heap)
        node = nodes[label]
        if bound >= known:
            break
        if node == target:
            return ConstrainedPath(tuple(nodes[i] for i in path_to(label, before)), weight, finished=True)
        if any(w <= weight and u <= use for w, u in kept[node]):
            continue
        if len(nodes) > max_labels:
            return ConstrainedPath((), bound, finished=False)
        kept[node].append((weight, use))
        to_weights, to_uses = weight + weights[node], use + uses[node]
        bounds = np.maximum(to_weights + price * to_uses + rest[2] - offset, to_weights + rest[0])
        allowed = (bounds < known) & (to_uses + rest[1] <= room)
        allowed[node] = False
        for other in np.nonzero(allowed)[0].tolist():
            w, u = float(to_weights[other]), float(to_uses[other])
            if not any(a <= w and b <= u for a, b in kept[other]):
                heapq.heappush(heap, (max(bound, float(bounds[other])), len(nodes), w, u))
                nodes.append(other)
                before.append(label)
    return ConstrainedPath((), known, finished=True)


def _least_values(edges: BoolArray, values: FloatArray, target: int) -> FloatArray:
    """Add up `values` along the edges to the target: the least sums, shape ``(n,)``; infinite where there is no way."""
    tails, heads = np.nonzero(edges)
    starts = np.concatenate([[0], np.cumsum(edges.sum(axis=1))])
    # built by hand, as edges without value are edges too
    graph = sparse.csr_array((values[tails, heads].astype(np.float64), heads, starts), shape=edges.shape)
    return least_cost_tree(graph, target)[0]

"""
Corners of areas that paths bend around, in addition to the nodes of a mesh.

Behind a corner, costs-to-go bend like one over the distance to it, and differences are wrong by first order in the
spacing. The straight lines from nodes to the corner have exact costs.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, WholeArray
from cgla_graph.eikonal.marching_kernels import Bends


class Sight(NamedTuple):
    """Nodes in sight of a corner, the costs of the straight lines to it, and the nodes from which paths come."""

    nodes: WholeArray
    costs: FloatArray
    enter: BoolArray


def bends_of(sights: Sequence[Sight], n_nodes: int) -> Bends:
    """
    Lay out the nodes in sight of each corner as `march` takes them.

    Examples
    --------
    >>> sight = Sight(np.array([2, 0, 3]), np.array([0.1, 0.2, 0.3]), np.array([True, True, False]))
    >>> first_entry, *_ = bends_of([sight], 4)
    >>> first_entry.tolist()
    [0, -1, 1, -1, -1]
    """
    counts = [len(sight.nodes) for sight in sights]
    first_node = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    node = np.concatenate([np.empty(0), *(sight.nodes for sight in sights)]).astype(np.int32)
    cost = np.concatenate([np.empty(0), *(sight.costs for sight in sights)])
    bend = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    enter = np.concatenate([np.empty(0, dtype=np.bool_), *(sight.enter for sight in sights)])
    order = np.flatnonzero(enter)[np.argsort(node[enter], kind="stable")]
    first_entry = np.full(n_nodes + 1, -1, dtype=np.int32)
    # of equal nodes, the first
    first_entry[node[order][::-1]] = np.arange(len(order), dtype=np.int32)[::-1]
    return first_entry, node[order], bend[order], cost[order], first_node, node, cost

"""Trees of least costs by scipy, and the paths in them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cgla_graph._types import FloatArray, IntArray

if TYPE_CHECKING:
    from scipy import sparse


def least_cost_tree(matrix: "sparse.csr_array", root: int, *, directed: bool = True) -> tuple[FloatArray, IntArray]:
    """
    Return the least cost from a root to each node, infinite where there is no path, and the node before it.

    Parameters
    ----------
    matrix
        Weights of the edges, shape ``(n, n)``, at least 0.
    root
        A node.
    directed
        Whether edges lead one way only.

    Returns
    -------
    costs, before
        Shape ``(n,)`` each; negative before the root, and where there is no path.

    Examples
    --------
    >>> from scipy import sparse
    >>> chain = sparse.csr_array(np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 3.0], [0.0, 0.0, 0.0]]))
    >>> costs, before = least_cost_tree(chain, 0)
    >>> costs.tolist(), path_to(2, before)
    ([0.0, 2.0, 5.0], [0, 1, 2])
    """
    # (it takes a tenth of a second to import, which walks in trees need not wait for)
    from scipy.sparse import csgraph  # noqa: PLC0415

    # the stubs of scipy know neither sparse arrays here nor the shapes of the answer
    search: Any = csgraph.dijkstra
    costs, before = search(matrix, directed=directed, indices=root, return_predecessors=True)
    return np.asarray(costs), np.asarray(before)


def path_to(node: int, before: "Sequence[int] | IntArray") -> list[int]:
    """
    List the nodes of a tree from its root to a node.

    Parameters
    ----------
    node
        The last node of the path.
    before
        The node before each, negative before the root, shape ``(n,)``.

    Examples
    --------
    >>> path_to(3, [-1, 0, 0, 2])
    [0, 2, 3]
    """
    nodes = []
    while node >= 0:
        nodes.append(node)
        node = int(before[node])
    return nodes[::-1]

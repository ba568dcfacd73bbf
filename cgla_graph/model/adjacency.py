"""Lists of edges and the sparse matrices made of them, for `GeometricGraph`'s constructors."""

import math
from collections.abc import Hashable, Sequence
from typing import Any, Literal, NoReturn, TypeAlias, cast

import numpy as np
import scipy  # (its modules are imported when they are first used: hints that name them are in quotes)
from numpy.typing import NDArray

from cgla_graph._text import shown
from cgla_graph._types import FloatArray, IntArray
from cgla_graph._validate import is_masked, point_array, real_number
from cgla_graph.errors import GraphError
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.lattice import Lattice

Node: TypeAlias = Hashable
CornerRule: TypeAlias = Literal["touch", "both-free"]

#: Stands for the weight of an edge that has none.
MISSING = object()


def label_text(label: Node) -> str:
    r"""
    Return a node's label as one line of printable text.

    Examples
    --------
    >>> label_text("a b"), label_text((1, 2)), label_text("two\nlines")
    ('a b', '(1, 2)', "'two\\nlines'")
    """
    text = str(label)
    return text if text.isprintable() and text else repr(text)


def eight_neighbours(lattice: Lattice, model: CostModel, corner_rule: CornerRule) -> tuple[IntArray, IntArray]:
    """List each pair of neighbours once, as two arrays of indices."""
    nx_, ny = lattice.shape
    index = np.arange(nx_ * ny).reshape(ny, nx_)
    pairs = [
        (index[:, :-1], index[:, 1:]),
        (index[:-1, :], index[1:, :]),
        (index[:-1, :-1], index[1:, 1:]),
        (index[:-1, 1:], index[1:, :-1]),
    ]
    if corner_rule == "both-free":
        free = ~model.area.contains(lattice.points).reshape(ny, nx_)
        rising = free[:-1, 1:] & free[1:, :-1]
        falling = free[:-1, :-1] & free[1:, 1:]
        pairs[2] = (pairs[2][0][rising], pairs[2][1][rising])
        pairs[3] = (pairs[3][0][falling], pairs[3][1][falling])
    return (
        np.concatenate([tail.ravel() for tail, _ in pairs]),
        np.concatenate([head.ravel() for _, head in pairs]),
    )


def cell_corners(lattice: Lattice, positions: FloatArray) -> tuple[IntArray, IntArray]:
    """Join each node beyond the lattice to the corners of its cell, and to the other such nodes of that cell."""
    n = lattice.n_points
    nx_, ny = lattice.shape
    steps = (positions[n:] - lattice.points[0]) / lattice.spacing
    cells = np.clip(np.floor(steps).astype(np.int64), 0, np.array([nx_ - 2, ny - 2]))
    tails: list[int] = []
    heads: list[int] = []
    for number, (column, row) in enumerate(cells.tolist()):
        corner = column + row * nx_
        mates = [n + other for other in range(number) if (cells[other] == cells[number]).all()]
        near = [corner, corner + 1, corner + nx_, corner + nx_ + 1, *mates]
        tails += near
        heads += [n + number] * len(near)
    return np.array(tails, dtype=np.int64), np.array(heads, dtype=np.int64)


def compressed(
    tails: IntArray, heads: IntArray, weights: FloatArray, n_nodes: int, *, mirrored: bool
) -> "scipy.sparse.csr_array":
    """
    Store the finite edges row by row; `mirrored` adds the reverse of each.

    This is the one rule for parallel edges, from any library, matrix or file: the lightest counts. A weight of -0.0 is
    stored as 0.0: libraries take its sign for that of a negative weight.
    """
    finite = np.isfinite(weights)
    tails, heads, weights = tails[finite], heads[finite], weights[finite] + 0.0
    if mirrored:
        tails, heads = np.concatenate([tails, heads]), np.concatenate([heads, tails])
        weights = np.concatenate([weights, weights])
    order = np.lexsort((weights, heads, tails))
    tails, heads, weights = tails[order], heads[order], weights[order]
    first = np.ones(len(tails), dtype=bool)
    first[1:] = (tails[1:] != tails[:-1]) | (heads[1:] != heads[:-1])
    starts = np.concatenate([[0], np.cumsum(np.bincount(tails[first], minlength=n_nodes))])
    return scipy.sparse.csr_array((weights[first], heads[first], starts), shape=(n_nodes, n_nodes))


def matrix_entries(matrix: Any) -> tuple[IntArray, IntArray, NDArray[Any], tuple[int, ...]]:  # noqa: ANN401 - scipy's
    """
    List all stored entries of a sparse matrix, zeros and repeated ones too: rows, columns, values and the shape.

    scipy adds up entries of one place when it converts a matrix. Here the entries stay apart, and `compressed`
    keeps the lightest.

    Raises
    ------
    ValueError, TypeError
        If it is no sparse matrix, or a row or a column is outside of it.

    Examples
    --------
    >>> twice = scipy.sparse.coo_array(([2.0, 3.0], ([0, 0], [1, 1])), shape=(2, 2))
    >>> matrix_entries(twice)[2].tolist()
    [2.0, 3.0]
    """
    if hasattr(matrix, "indptr"):
        # the indices may have been changed since the matrix was made; the check is made of another one, as it may prune
        matrix = type(matrix)((matrix.data, matrix.indices, matrix.indptr), shape=matrix.shape)
        matrix.check_format(full_check=True)
    given = scipy.sparse.coo_array(matrix)
    for axis, size in zip(given.coords, given.shape, strict=True):
        if len(axis) and not 0 <= axis.min() <= axis.max() < size:
            msg = f"index {axis.min() if axis.min() < 0 else axis.max()} is outside of the shape {given.shape}"
            raise ValueError(msg)
    places = [np.asarray(axis, dtype=np.int64) for axis in given.coords]
    return places[0], places[-1], given.data, given.shape


def node_positions(labels: Sequence[Node], spots: list[object], pos: str, *, needed: bool) -> FloatArray | None:
    """Read the nodes' positions, shape ``(n, 2)``; None if a node has none and they are not `needed`."""
    missing = [label for label, spot in zip(labels, spots, strict=True) if spot is None]
    if missing and needed:
        what = f"node {shown(missing[0])} has no attribute {shown(pos)}"
        msg = f"{what}; weight=None weighs segments, so every node needs (x, y)"
        raise GraphError(msg)
    return None if missing or not spots else point_array("positions", cast("Any", spots))


def edge_weight(u: Node, v: Node, given: object, weight: str) -> float:
    """Read one edge's weight, at least 0 (infinity, or a masked weight: no edge)."""
    if given is MISSING:
        what = f"edge {shown(u)} - {shown(v)} has no attribute {shown(weight)}"
        msg = f"{what}; name the attribute, or pass weight=None for Eq. 5"
        raise GraphError(msg)
    value = math.inf if is_masked(given) else real_number(given)
    if not value >= 0.0:
        reject_weight(u, v, given)
    return value


def reject_weight(u: Node, v: Node, weight: object) -> NoReturn:
    """Raise the error of a weight that Theorem 1 does not allow."""
    what = f"edge {shown(u)} - {shown(v)} has weight {shown(weight)}"
    msg = f"{what}; weights must be at least 0 (Theorem 1), infinity means no edge"
    raise GraphError(msg)

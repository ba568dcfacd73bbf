"""
Compiled kernels that make room in arrays.

They stand in for assignments of slices and for `np.concatenate`, which take numba a second to compile wherever they are
used.
"""

from typing import TypeVar

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, IntArray, WholeArray

ArrayT = TypeVar("ArrayT", FloatArray, IntArray, WholeArray)


@kernel
def doubled(values: ArrayT) -> ArrayT:
    """
    Return an array that begins with `values`, shape ``(n,)``, and has room for as many more.

    Examples
    --------
    >>> doubled(np.array([1.0, 2.0]))[:2], len(doubled(np.ones(3)))
    (array([1., 2.]), 6)
    """
    more = np.empty(2 * values.shape[0], values.dtype)
    for i in range(values.shape[0]):
        more[i] = values[i]
    return more


@kernel
def doubled_rows(rows: ArrayT) -> ArrayT:
    """
    Return an array that begins with `rows`, shape ``(n, m)``, and has room for as many more.

    Examples
    --------
    >>> doubled_rows(np.array([[1.0, 2.0]]))[:1], doubled_rows(np.ones((3, 2))).shape
    (array([[1., 2.]]), (6, 2))
    """
    more = np.empty((2 * rows.shape[0], rows.shape[1]), rows.dtype)
    for i in range(rows.shape[0]):
        for j in range(rows.shape[1]):
            more[i, j] = rows[i, j]
    return more

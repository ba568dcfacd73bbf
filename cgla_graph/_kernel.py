"""The one decorator of compiled kernels."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """
    Compile a numeric function with numba and keep the machine code on disk.

    Numba ships no type hints, so this keeps the hints of the function it is given. Floats are IEEE: no
    fast-math, because kernels promise exact predicates and error bounds.

    Numba keeps a kernel for as long as its **own** file stays the same, also when a kernel that it calls from another
    file changes. An installation writes all files anew; whoever edits kernels in place deletes the kept code, or sets
    ``NUMBA_CACHE_DIR`` to another folder, as the Makefile does.

    Examples
    --------
    >>> from cgla_graph.risk_kernels import erf
    >>> erf(0.5)
    0.5204998778
    """
    return cast("Callable[P, R]", numba.njit(cache=True, nogil=True)(function))

"""
Proven bounds of the least cost under every risk weight, from proofs under some of them.

For one path, ``length + k * risk`` is a straight line in `k` that does not fall. So the least cost of all paths,
``L(k)``, is concave and does not fall: between two weights it is at least the chord of proven bounds, and beyond the
last one at least the last bound. A chord that is continued beyond its ends is above a concave function, and no bound.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr
from cgla_graph._types import FloatArray
from cgla_graph._validate import number_array

#: Interpolated bounds are lowered by this ratio, for their rounding.
LOWERED = 2.0**-46


@dataclass(frozen=True, eq=False)
class WeightBounds(ShortRepr):
    """
    Proven lower bounds of the least cost under some risk weights, and so under all.

    Attributes
    ----------
    weights
        Risk weights of the proofs, ascending, shape ``(n,)``.
    bounds
        No path costs less under that weight, map units, shape ``(n,)``. Infinite if there is no path at all.

    Examples
    --------
    >>> proven = WeightBounds(np.array([0.0, 2.0, 10.0]), np.array([1.0, 1.5, 1.8]))
    >>> proven.at(np.array([0.0, 1.0, 6.0, 99.0])).round(6).tolist()
    [1.0, 1.25, 1.65, 1.8]
    """

    weights: FloatArray
    bounds: FloatArray

    @cached_property
    def _known(self) -> tuple[FloatArray, FloatArray]:
        """Weights from 0 on, and the best bounds of the same weight or a lesser one."""
        known = ~np.isnan(self.bounds)
        weights, values = self.weights[known], np.maximum.accumulate(self.bounds[known])
        if len(weights) and weights[0] > 0.0:
            # (no path costs less than nothing)
            weights, values = np.concatenate([[0.0], weights]), np.concatenate([[0.0], values])
        return weights, values

    @cached_property
    def _corners(self) -> tuple[FloatArray, FloatArray]:
        """Weights and values of the corners of the least concave function above the bounds that does not fall."""
        weights, values = self._known
        kept: list[int] = []
        for i in range(len(weights)):
            while len(kept) > 1 and not _is_above(*weights[[*kept[-2:], i]], *values[[*kept[-2:], i]]):
                kept.pop()
            kept.append(i)
        return weights[kept], values[kept]

    @property
    def corners(self) -> FloatArray:
        """Weights at which the bound has a corner, ascending, shape ``(m,)``; it is linear in between."""
        return self._corners[0]

    def at(self, k: ArrayLike) -> FloatArray:
        """
        Bound the least cost under risk weights of at least 0: chords of a concave function; NaN if nothing is proven.

        Parameters
        ----------
        k
            Risk weights, any shape.

        Returns
        -------
        bounds
            Map units, the same shape; at the weights of the proofs at least their bounds.
        """
        asked = number_array("k", k)
        if (self.bounds == math.inf).any():
            # (no risk weight opens a way)
            return np.full(asked.shape, math.inf)
        weights, values = self._known
        if not len(weights):
            return np.full(asked.shape, math.nan)
        with np.errstate(over="ignore", invalid="ignore"):
            between = np.interp(asked, *self._corners) * (1.0 - LOWERED)
        # (the slope between two of the least weights is no float)
        between = np.where(np.isfinite(between), between, 0.0)
        # (the bound of a lesser weight is one as well, and is not rounded)
        return np.asarray(np.maximum(between, values[np.searchsorted(weights, asked, side="right") - 1]))


def _is_above(k0: float, k1: float, k2: float, v0: float, v1: float, v2: float) -> bool:
    """Whether the middle one of three points is above the chord of the others."""
    return bool((v1 - v0) * (k2 - k0) > (v2 - v0) * (k1 - k0))

"""Ranks and tails of distributions, as `scipy.stats` has them, which takes half a second to import."""

import numpy as np
import scipy

from cgla_graph._types import FloatArray


def average_ranks(values: FloatArray) -> FloatArray:
    """
    Rank values from 1; equal ones share their mean, as `scipy.stats.rankdata` does.

    Parameters
    ----------
    values
        Shape ``(k,)``, or ``(k, n)`` to rank each of `n` columns; no NaN.

    Returns
    -------
    ranks
        Of the same shape.

    Examples
    --------
    >>> average_ranks(np.array([3.0, np.inf, 1.0, 3.0]))
    array([2.5, 4. , 1. , 2.5])
    """
    if values.ndim > 1:
        ranks = np.empty(values.shape)
        for column, own in zip(values.T, ranks.T, strict=True):
            own[:] = average_ranks(column)
        return ranks
    ordered = np.sort(values)
    found: FloatArray = (np.searchsorted(ordered, values) + np.searchsorted(ordered, values, side="right") + 1) / 2.0
    return found


def median_rank(tail: float, n: int) -> int:
    """
    Return the least number of heads, of `n` tosses, that so many or fewer come up with a probability of `tail` or more.

    Examples
    --------
    >>> [median_rank(0.025, n) for n in (5, 6, 20)]
    [0, 1, 6]
    """
    heads = int(np.ceil(scipy.special.bdtrik(tail, n, 0.5)))
    return heads - 1 if heads and scipy.special.bdtr(heads - 1, n, 0.5) >= tail else heads


def heads_test(heads: int, n: int) -> float:
    """
    Return the two-sided p-value of a number of heads in `n` tosses of a fair coin.

    Examples
    --------
    >>> heads_test(0, 6), heads_test(3, 6)
    (0.03125, 1.0)
    """
    return min(1.0, 2.0 * float(scipy.special.bdtr(min(heads, n - heads), n, 0.5)))


def chi_square_tail(value: float, degrees: int) -> float:
    """
    Return the probability that a chi-square of some degrees of freedom is greater than a value.

    Examples
    --------
    >>> round(chi_square_tail(3.841, 1), 4)
    0.05
    """
    return float(scipy.special.chdtrc(degrees, value))

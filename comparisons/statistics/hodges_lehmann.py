"""Hodges and Lehmann's estimate: by how much paired values differ, and an interval, from the Walsh averages."""

import math
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import scipy

from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph._validate import number_array
from cgla_graph.comparisons.statistics.intervals import CONFIDENCE, Estimate

#: Up to this many differences the distribution of the signed-rank sum is exact, as in `scipy.stats.wilcoxon`.
EXACT = 50
#: Up to this many averages are sorted; among more, the wanted one is selected without sorting.
_FEW = 200_000


def hodges_lehmann(differences: Sequence[float]) -> Estimate:
    r"""
    Estimate the centre of paired differences, with an interval that assumes only that they are symmetric about it.

    The estimate is the median of the :math:`n(n+1)/2` Walsh averages :math:`(d_i + d_j)/2, i \le j`. The interval
    goes from the :math:`r`-th least to the :math:`r`-th greatest of them, with the greatest :math:`r` for which
    :math:`2 P(T < r)` is at most 5 %, where :math:`T` is Wilcoxon's signed-rank sum (Hollander, Wolfe,
    Chicken, "Nonparametric Statistical Methods", 3rd ed., 2014, sections 3.2 and 3.3): so it contains zero just if the
    signed-rank test does not reject it, if no two differences are equal in size; with ties its coverage is a little
    higher than stated. Up to `EXACT` differences the distribution of :math:`T` is exact, beyond it is normal.

    Parameters
    ----------
    differences
        At least one. Infinite ones count as greater than any number, all alike, so that an infinite gain and an
        infinite loss average to 0.

    Returns
    -------
    estimate
        Minus to plus infinity for an interval where there are too few differences: below 6.

    Raises
    ------
    ValueError
        If there is no difference, or one is NaN.

    Examples
    --------
    >>> hodges_lehmann([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    Estimate(median=3.5, low=1.0, high=6.0)
    >>> hodges_lehmann([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, math.inf]).high
    inf
    """
    ordered = np.sort(number_array("differences", differences))
    if ordered.ndim != 1 or not ordered.size or np.isnan(ordered).any():
        msg = f"the differences are {list(differences)[:5]} ...; give a flat list of at least one number and no NaN"
        raise ValueError(msg)
    n = len(ordered)
    rank = walsh_rank(n)
    # an eighth of each leaves room for a number that stands for infinity, without overflow
    sizes = np.abs(ordered[np.isfinite(ordered)]) / 8.0
    most = float(np.max(sizes, initial=0.0)) or 1.0
    eighths = np.clip(ordered / 8.0, -4.0 * most, 4.0 * most)

    def at(place: int) -> float:
        average = 4.0 * _select(eighths, place)
        return math.copysign(math.inf, average) if abs(average) > 8.0 * most else average

    n_pairs = n * (n + 1) // 2
    lower, upper = at((n_pairs + 1) // 2), at(n_pairs // 2 + 1)
    middle = lower if lower == upper else _halfway(lower, upper)
    if not rank:
        return Estimate(middle, -math.inf, math.inf)
    return Estimate(middle, at(rank), at(n_pairs + 1 - rank))


def walsh_rank(n: int) -> int:
    """
    Choose which Walsh average of `n` differences, from the least and from the greatest, ends the interval.

    0 if even the least and the greatest average give too narrow an interval.

    Examples
    --------
    >>> [walsh_rank(n) for n in (5, 6, 10, 20)]
    [0, 1, 9, 53]
    """
    tail = (1.0 - CONFIDENCE) / 2.0
    if n <= EXACT:
        return int(np.searchsorted(np.cumsum(signed_rank_distribution(n)), tail, side="right"))
    spread = math.sqrt(n * (n + 1) * (2 * n + 1) / 24.0)
    return max(0, math.floor(n * (n + 1) / 4.0 + scipy.special.ndtri(tail) * spread))


@lru_cache(maxsize=EXACT)
def signed_rank_distribution(n: int) -> FloatArray:
    """
    Return the distribution of Wilcoxon's signed-rank sum, from 0, of `n` differences symmetric about 0, without ties.

    Examples
    --------
    >>> signed_rank_distribution(2)
    array([0.25, 0.25, 0.25, 0.25])
    """
    probabilities = subset_sums(np.arange(1, n + 1))
    probabilities.setflags(write=False)
    return probabilities


def subset_sums(parts: IntArray) -> FloatArray:
    """
    Return the distribution of the sum, from 0, of a random subset of whole numbers, each kept with probability 1/2.

    Examples
    --------
    >>> subset_sums(np.array([1, 1]))
    array([0.25, 0.5 , 0.25])
    """
    probabilities = np.zeros(int(np.sum(parts)) + 1)
    probabilities[0] = 1.0
    reach = 1
    for part in parts.tolist():
        before = probabilities[:reach].copy()
        probabilities[:reach] *= 0.5
        probabilities[part : part + reach] += 0.5 * before
        reach += part
    return probabilities


def _halfway(lower: float, upper: float) -> float:
    """Return the mean of two middle values; of two opposite infinities it is 0."""
    return 0.0 if math.isinf(lower) and math.isinf(upper) else lower / 2.0 + upper / 2.0


def _select(ordered: FloatArray, rank: int) -> float:
    """
    Return the sum of two values, each with itself and all later ones, that is the `rank`-th least of all.

    Row ``i`` holds the sums of value ``i`` with the values from ``i`` on, in ascending order. While there are many,
    those on one side of a pivot are dropped, row by row (Johnson, Mizoguchi, SIAM J. Comput. 7(2), 1978).
    """
    n = len(ordered)
    rows = np.arange(n)
    first, last = rows.copy(), np.full(n, n)
    while (sizes := last - first).sum() > _FEW:
        pivot = _pivot(ordered, first, sizes)
        below = _ends(ordered, first, last, lambda sums: sums < pivot)  # noqa: B023 - called at once
        up_to = _ends(ordered, below, last, lambda sums: sums <= pivot)  # noqa: B023 - the same
        if rank <= (below - rows).sum():
            last = below
        elif rank > (up_to - rows).sum():
            first = up_to
        else:
            return pivot
    left = np.repeat(rows, sizes)
    starts = np.repeat(np.cumsum(sizes) - sizes - first, sizes)
    sums = ordered[left] + ordered[np.arange(len(left)) - starts]
    place = rank - 1 - int((first - rows).sum())
    return float(np.partition(sums, place)[place])


def _ends(
    ordered: FloatArray, first: IntArray, last: IntArray, is_before: Callable[[FloatArray], BoolArray]
) -> IntArray:
    """Find the end of the sums before a pivot in every row; the sums themselves are bisected, so rounding agrees."""
    low, high = first.copy(), last.copy()
    while (is_open := low < high).any():
        middle = (low + high) // 2
        before = is_before(ordered + ordered[np.minimum(middle, len(ordered) - 1)])
        low = np.where(is_open & before, middle + 1, low)
        high = np.where(is_open & ~before, middle, high)
    return low


def _pivot(ordered: FloatArray, first: IntArray, sizes: IntArray) -> float:
    """Return the weighted median of the rows' medians: at least a quarter of all sums is on either side."""
    rows = np.flatnonzero(sizes)
    medians = ordered[rows] + ordered[first[rows] + sizes[rows] // 2]
    order = np.argsort(medians)
    heaped = np.cumsum(sizes[rows][order])
    return float(medians[order[np.searchsorted(heaped, heaped[-1] / 2.0)]])

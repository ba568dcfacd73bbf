"""
Statistics of claims: each takes plain numbers, and answers with an effect, its interval and a p-value.

A claim that speaks of a direction is tested in that direction, but its p-value is two-sided: what goes the other way as
clearly is said as clearly. Pairs of which a value is missing (NaN) are left out.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from cgla_graph._types import FloatArray
from cgla_graph._validate import number_array, unmasked
from cgla_graph.comparisons.statistics.hodges_lehmann import hodges_lehmann
from cgla_graph.comparisons.statistics.intervals import CONFIDENCE, Estimate, Interval, success_interval
from cgla_graph.comparisons.statistics.paired import mcnemar, signed_rank


@dataclass(frozen=True)
class Shift:
    """
    By how much paired values differ.

    Attributes
    ----------
    n
        Pairs of which no value is missing.
    shift
        Hodges-Lehmann estimate of first minus second, with its interval; of `log_shift`, of first over second.
    effect
        Matched-pairs rank-biserial correlation: 1 where the first is greater everywhere, -1 where it is less.
    p
        Of Wilcoxon's signed-rank test, two-sided (zeros split).
    typical
        The estimate before any exponential: 0 where a typical pair does not differ, whatever the test says.
    """

    n: int
    shift: Estimate
    effect: float
    p: float
    typical: float = math.nan


def paired_shift(first: ArrayLike, second: ArrayLike) -> Shift:
    """
    Compare paired values, NaN where there is none, by their differences.

    Examples
    --------
    >>> shift = paired_shift([2.0, 3, 4, 5, 6, 7, 8], [1.0, 2, 3, 4, 5, 6, 7])
    >>> shift.shift.median, shift.effect, shift.p
    (1.0, 1.0, 0.015625)
    """
    differences = np.subtract(*_pairs(first, second)).tolist()
    if not differences:
        return Shift(0, Estimate(math.nan, -math.inf, math.inf), 0.0, 1.0)
    test = signed_rank(differences)
    shift = hodges_lehmann(differences)
    return Shift(len(differences), shift, test.effect, test.p, shift.median)


def log_shift(first: ArrayLike, second: ArrayLike) -> Shift:
    """
    Compare paired positive values by their ratios: `Shift.shift` is first over second.

    Examples
    --------
    >>> log_shift([2.0, 4, 6, 8, 10, 12], [1.0, 2, 3, 4, 5, 6]).shift.median.__round__(9)
    2.0
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        found = paired_shift(np.log(number_array("first", first)), np.log(number_array("second", second)))
    with np.errstate(over="ignore"):
        ratio = Estimate(*(float(np.exp(end)) for end in found.shift))
    return replace(found, shift=ratio)


@dataclass(frozen=True)
class Proportion:
    """
    How often something happens.

    Attributes
    ----------
    count, n
        How often, of how many.
    interval
        Of Clopper and Pearson, 95 %.
    """

    count: int
    n: int
    interval: Interval

    @property
    def rate(self) -> float:
        """The share; NaN of nothing."""
        return self.count / self.n if self.n else math.nan


def proportion(happened: ArrayLike) -> Proportion:
    """
    Count truths; NaN is left out.

    Examples
    --------
    >>> found = proportion([1.0, 1.0, 0.0, float("nan")])
    >>> found.count, found.n, round(found.interval.low, 3)
    (2, 3, 0.094)
    """
    values = _finite(happened)
    count, n = int((values != 0.0).sum()), len(values)
    return Proportion(count, n, success_interval(count, n) if n else Interval(0.0, 1.0))


def paired_rates(first: ArrayLike, second: ArrayLike) -> tuple[Proportion, Proportion, float]:
    """
    Compare how often two paired things happen: both rates, and the p-value of McNemar's exact test.

    Examples
    --------
    >>> paired_rates([1, 1, 1, 1, 1, 1], [0, 0, 0, 0, 0, 0])[2]
    0.03125
    """
    a, b = (values != 0.0 for values in _pairs(first, second))
    return proportion(a), proportion(b), mcnemar(int((a & ~b).sum()), int((~a & b).sum()))


def at_least(happened: ArrayLike, share: float) -> float:
    """
    Return the p-value that something happens with at most this probability: small where it happens more often.

    Examples
    --------
    >>> round(at_least([1.0] * 100, 0.95), 4)
    0.0059
    """
    return _binomial(happened, share, "greater")


def at_most(happened: ArrayLike, share: float) -> float:
    """
    Return the p-value that something happens with at least this probability: small where it happens less often.

    Examples
    --------
    >>> at_most([1.0] * 80 + [0.0] * 20, 0.95) < 1e-6
    True
    """
    return _binomial(happened, share, "less")


def equivalence(differences: ArrayLike, margin: float) -> float:
    """
    Return the p-value of two one-sided signed-rank tests that the shift is beyond `margin`, either way.

    Small where the differences are shown to lie around less than the margin (TOST; Schuirmann 1987, here by ranks).

    Examples
    --------
    >>> equivalence([0.01, -0.02, 0.03, 0.0, 0.02, -0.01, 0.015], 0.5) < 0.05
    True
    """
    values = _finite(differences)
    if not len(values):
        return 1.0
    p_values = []
    for shifted in (values + margin, margin - values):
        test = signed_rank(shifted.tolist())
        p_values.append(test.p / 2.0 if test.effect > 0.0 else 1.0 - test.p / 2.0)
    return max(p_values)


def cochran(happened: FloatArray) -> float:
    """
    Return the p-value of Cochran's Q, that several paired things happen equally often: Friedman's test of 0 and 1.

    Parameters
    ----------
    happened
        Shape ``(maps, treatments)``, at least three treatments; maps with a NaN are left out.

    Examples
    --------
    >>> round(cochran(np.array([[1, 0, 0], [1, 0, 0], [1, 1, 0], [1, 0, 0], [1, 0, 1]])), 4)
    0.0408
    """
    kept = np.asarray(unmasked("the series", happened), dtype=np.float64)
    kept = (kept[np.isfinite(kept).all(axis=1)] != 0.0).astype(np.float64)
    if not len(kept) or (kept == kept[:, :1]).all():
        return 1.0
    return float(stats.friedmanchisquare(*kept.T).pvalue)


def median(values: ArrayLike) -> float:
    """
    Return the median of what is there; NaN of nothing.

    Examples
    --------
    >>> median([3.0, float("nan"), 1.0])
    2.0
    """
    kept = _finite(values)
    return float(np.median(kept)) if len(kept) else math.nan


def power_law(sizes: Sequence[float], counts: Sequence[float]) -> Estimate:
    """
    Fit ``count = a * size ** exponent`` through logarithms: the exponent, with its 95 % interval (Student's t).

    Examples
    --------
    >>> round(power_law([1, 2, 4, 8], [3, 12, 48, 192]).median, 9)
    2.0
    """
    x, y = np.log(number_array("sizes", sizes)), np.log(number_array("counts", counts))
    fit = stats.linregress(x, y)
    reach = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, len(x) - 2)) * float(fit.stderr)
    return Estimate(float(fit.slope), float(fit.slope) - reach, float(fit.slope) + reach)


def bootstrapped(values: ArrayLike, *, seed: int) -> Estimate:
    """
    Return the median with its BCa bootstrap interval (Efron 1987; `scipy.stats.bootstrap`).

    Examples
    --------
    >>> bootstrapped(np.arange(1.0, 102.0), seed=1).median
    51.0
    """
    kept = _finite(values)
    if len(kept) <= 1:
        return Estimate(float(kept[0]) if len(kept) else math.nan, -math.inf, math.inf)
    if (kept == kept[0]).all():
        # nothing to draw from
        return Estimate(*[float(kept[0])] * 3)
    random = np.random.default_rng(seed)
    with warnings.catch_warnings(), np.errstate(invalid="ignore"):
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)
        found = stats.bootstrap((kept,), np.median, method="BCa", n_resamples=2000, rng=random, vectorized=True)
    low, high = found.confidence_interval
    if not math.isfinite(low) or not math.isfinite(high):
        # nearly all values are tied, and the acceleration is 0 / 0
        low, high = np.percentile(found.bootstrap_distribution, [2.5, 97.5])
    return Estimate(float(np.median(kept)), float(low), float(high))


def _binomial(happened: ArrayLike, share: float, alternative: Literal["greater", "less"]) -> float:
    """Return the p-value of the exact test of a share, on one side; 1 of nothing."""
    values = _finite(happened)
    if not len(values):
        return 1.0
    return float(stats.binomtest(int((values != 0.0).sum()), len(values), share, alternative=alternative).pvalue)


def _finite(values: ArrayLike) -> FloatArray:
    """Leave out what is missing."""
    found = np.asarray(unmasked("the series", values), dtype=np.float64)
    return found[np.isfinite(found)]


def _pairs(first: ArrayLike, second: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Leave out the pairs of which one value is missing."""
    a, b = (np.asarray(unmasked("the series", one), dtype=np.float64) for one in (first, second))
    both = np.isfinite(a) & np.isfinite(b)
    return a[both], b[both]

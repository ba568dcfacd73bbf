"""
Statements about flights as data: what is compared, and the test of one.

A test takes a score for each map. Cells of the panel share maps, so where several are pooled each map still counts
once: with the mean of its scores, or, of shares, with one of them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from scipy import stats

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.panel.settings import FACTORS, Case
from cgla_graph.comparisons.statistics.hodges_lehmann import hodges_lehmann
from cgla_graph.comparisons.statistics.intervals import CONFIDENCE, Estimate, success_interval
from cgla_graph.comparisons.statistics.paired import mcnemar, signed_rank

#: Risks below this are as good as none; logarithms need a least value. Line integrals are not more exact.
LEAST = 1e-9
#: Half the width of a 95 % interval of the normal distribution.
_TWO_SIDED = float(stats.norm.ppf((1.0 + CONFIDENCE) / 2.0))


class Sign(NamedTuple):
    """
    What a test says.

    Attributes
    ----------
    p, n
        The p-value, small where what `direction` says is shown; maps.
    direction
        1 as stated, -1 the opposite, 0 neither.
    """

    p: float
    direction: int
    n: int


class Method(Protocol):
    """How two measurements of a map are held against each other."""

    def score(self, first: float, second: float) -> float:
        """Return what one map says of the statement, above 0 where the first value is the greater one."""
        ...

    def pooled(self, scores: Sequence[float], number: int) -> float:  # noqa: ARG002 - for those that draw
        """Return what a map says that has scores in several cells, their mean; `number` tells maps apart."""
        return math.fsum(scores) / len(scores)

    def tested(self, scores: FloatArray) -> Sign:
        """Test that the first value is the greater one, on scores of different maps, shape ``(n,)``."""
        ...

    def size(self, first: FloatArray, second: FloatArray) -> float:
        """Return how large the effect is, of paired values."""
        ...

    def estimate(self, scores: FloatArray) -> Estimate:
        """Return how large the effect is, of scores of different maps, at least one, with its 95 % interval."""
        ...


@dataclass(frozen=True)
class Shift(Method):
    """
    Wilcoxon's signed ranks of paired values, two-sided.

    Attributes
    ----------
    ratio
        Compare logarithms, of values of at least `LEAST`, and give the ratio as the size; else differences.
    margin
        Compare with that much more than the second value, as ``0.1`` for a tenth; only of ratios.

    Examples
    --------
    >>> test = Shift()
    >>> scores = np.array([test.score(2.0 + i, 1.0 + i / 2) for i in range(8)])
    >>> test.tested(scores), round(test.size(np.full(8, 2.0), np.full(8, 1.0)), 9)
    (Sign(p=0.0078125, direction=1, n=8), 2.0)
    """

    ratio: bool = True
    margin: float = 0.0

    def score(self, first: float, second: float) -> float:
        """Return the difference, of logarithms if ratios are compared."""
        if not self.ratio:
            return first - second
        return _log_ratio(first, second) - math.log1p(self.margin)

    def tested(self, scores: FloatArray) -> Sign:
        """Test that scores are around something above 0."""
        if not len(scores):
            return Sign(1.0, 0, 0)
        found = signed_rank(scores.tolist())
        # where most maps do not differ, a test may still say that they do
        direction = 0 if np.median(scores) == 0.0 and _centre(scores) == 0.0 else int(np.sign(found.effect))
        return Sign(found.p, direction, len(scores))

    def size(self, first: FloatArray, second: FloatArray) -> float:
        """Return the Hodges-Lehmann estimate: of the ratio, or of the difference."""
        centre = _centre(np.array([self.score(*pair) for pair in zip(first, second, strict=True)]))
        return (1.0 + self.margin) * math.exp(centre) if self.ratio else centre

    def estimate(self, scores: FloatArray) -> Estimate:
        """Return the Hodges-Lehmann estimate, with the interval that belongs to the test."""
        found = hodges_lehmann(scores.tolist())
        return Estimate(*((1.0 + self.margin) * np.exp(found)).tolist()) if self.ratio else found


@dataclass(frozen=True)
class Rate(Method):
    """A sign test of how often two paired things happen: McNemar's exact test, two-sided."""

    def score(self, first: float, second: float) -> float:
        """Return 1 if only the first happens, -1 if only the second does."""
        return first - second

    def tested(self, scores: FloatArray) -> Sign:
        """Count on how many maps the first happens more often, and on how many the second."""
        more, less = int((scores > 0.0).sum()), int((scores < 0.0).sum())
        return Sign(mcnemar(more, less), int(np.sign(more - less)), len(scores))

    def size(self, first: FloatArray, second: FloatArray) -> float:
        """Return the difference of the rates."""
        return float(first.mean() - second.mean()) if len(first) else math.nan

    def estimate(self, scores: FloatArray) -> Estimate:
        """Return the difference of the rates, with the interval of Agresti and Min (Stat. Med. 24(5), 2005)."""
        # half a map is added to each of the four outcomes of a pair
        n = len(scores) + 2
        centre, squares = float(scores.sum()) / n, float((scores**2).sum()) + 1.0
        reach = _TWO_SIDED * math.sqrt(squares - n * centre**2) / n
        return Estimate(float(scores.mean()), max(-1.0, centre - reach), min(1.0, centre + reach))


@dataclass(frozen=True)
class Share(Method):
    """
    An exact binomial test of how often something happens: the first value is 1 or 0, the second is the bar.

    Where cells are pooled, a map counts with one of them, drawn by its seed: shares of maps stay independent.

    Attributes
    ----------
    bar
        The share to be exceeded.
    """

    bar: float

    def score(self, first: float, second: float) -> float:  # noqa: ARG002 - of the protocol
        """Return whether it happens."""
        return first

    def pooled(self, scores: Sequence[float], number: int) -> float:
        """Return one of the scores."""
        return scores[int(np.random.default_rng(number).integers(len(scores)))]

    def tested(self, scores: FloatArray) -> Sign:
        """Test that the share is above the bar, or below."""
        n, count = len(scores), int((scores != 0.0).sum())
        if not n or count / n == self.bar:
            return Sign(1.0, 0, n)
        above = count / n > self.bar
        p = stats.binomtest(count, n, self.bar, alternative="greater" if above else "less").pvalue
        return Sign(float(p), 1 if above else -1, n)

    def size(self, first: FloatArray, second: FloatArray) -> float:  # noqa: ARG002 - of the protocol
        """Return the share."""
        return float((first != 0.0).mean()) if len(first) else math.nan

    def estimate(self, scores: FloatArray) -> Estimate:
        """Return the share, with the exact interval."""
        count, n = int((scores != 0.0).sum()), len(scores)
        return Estimate(count / n, *success_interval(count, n))


@dataclass(frozen=True)
class Within(Method):
    """
    Two one-sided signed-rank tests that the ratio of paired values is within a margin of 1 (Schuirmann 1987, by ranks).

    Attributes
    ----------
    margin
        ``0.1`` is for ratios of 0.9 to 1.1, taken alike in both directions of the logarithm.
    """

    margin: float

    def score(self, first: float, second: float) -> float:
        """Return the logarithm of the ratio."""
        return _log_ratio(first, second)

    def tested(self, scores: FloatArray) -> Sign:
        """Test that scores are around something within the margin, or beyond it."""
        if not len(scores):
            return Sign(1.0, 0, 0)
        reach = math.log1p(self.margin)
        sides = [signed_rank((reach - sign * scores).tolist()) for sign in (1.0, -1.0)]
        one_sided = [side.p / 2.0 if side.effect > 0.0 else 1.0 - side.p / 2.0 for side in sides]
        if abs(_centre(scores)) <= reach:
            return Sign(max(one_sided), 1, len(scores))
        return Sign(1.0 - max(one_sided), -1, len(scores))

    def size(self, first: FloatArray, second: FloatArray) -> float:
        """Return the Hodges-Lehmann estimate of the ratio."""
        return Shift().size(first, second)

    def estimate(self, scores: FloatArray) -> Estimate:
        """Return the Hodges-Lehmann estimate of the ratio, with its interval."""
        return Shift().estimate(scores)


def _log_ratio(first: float, second: float) -> float:
    return math.log(max(first, LEAST) / max(second, LEAST))


def _centre(scores: FloatArray) -> float:
    """Return the Hodges-Lehmann estimate; NaN of nothing."""
    return hodges_lehmann(scores.tolist()).median if len(scores) else math.nan


@dataclass(frozen=True)
class Statement:
    """
    One assertion about flights: that a measurement is greater, or less, in one case than in another.

    Attributes
    ----------
    text, measure
        The assertion in a few words, and the measurement.
    first, second
        The case that it is about, and the one that it is compared with, or a number.
    less, test
        Whether the first is said to be less, else it is said to be greater; how it is tested.
    factors
        Names of the settings over which its records run, those of the panel and others: a cell is a combination of
        their levels, of those that there are.
    where
        What restricts the panel: settings that all of its records have.
    size
        How to write a size, with ``{}`` for its range over the cells: ``{} of BCV-style's``. ``{} %`` is for shares,
        ``{} % more`` and ``{} % less`` are for ratios, and ``{first} % against {second} %`` is for two rates.
    printed
        How large it is in the paper.
    """

    text: str
    measure: str
    first: Case
    second: Case | float
    less: bool = True
    test: Method = field(default_factory=Shift)
    factors: tuple[str, ...] = tuple(FACTORS)
    where: Case = field(default_factory=dict)
    size: str = "x {}"
    printed: str = ""

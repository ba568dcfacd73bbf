"""
Contrasts: a claim about flights is held against several readings of the paper, its cells, and holds if it does in all.

Online flights are chaotic: one and the same map goes from a short flight to a long one because of a slightly different
line integral or detection radius. So each contrast is measured for both readings of the integral (E20) and for
detection radii within 10 % of the paper's, and Holm's adjustment is made over all contrasts of a table.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product
from typing import Any, Literal, TypeAlias

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Part, Table, Verdict, supported
from cgla_graph.comparisons.claims.evidence import Samples
from cgla_graph.comparisons.claims.inference import (
    Proportion,
    Shift,
    at_least,
    log_shift,
    paired_rates,
    paired_shift,
    proportion,
)
from cgla_graph.comparisons.numbers import json_number
from cgla_graph.comparisons.statistics.paired import holm

#: Below this an adjusted p-value counts.
ALPHA = 0.05
#: Line integrals: exact, and the raster sum of E20.
INTEGRALS: tuple[Literal["exact", "raster"], ...] = ("exact", "raster")
#: Detection radii, map units: OR = 0.2, and 10 % less and more.
RADII = (0.18, 0.2, 0.22)
#: What a case is called by.
Case: TypeAlias = Mapping[str, Any]
#: All cells of an online claim.
CELLS: tuple[Case, ...] = tuple(
    {"integral": integral, "radius": radius} for integral, radius in product(INTEGRALS, RADII)
)
#: The rule of all statistical claims that say which of two things is greater; said before any map was looked at.
RULE = (
    "Rule, set before the sample was drawn: supported if in every row the p-value, adjusted by Holm over this table, "
    "is below 0.05 and the effect goes in the claimed direction; else not supported."
)
#: How often something has to happen that is said to happen as a rule.
MOSTLY = 0.95
SHARE_RULE = (
    f"Rule, set before the sample was drawn: supported if in every row the share is shown to be above {MOSTLY:g} "
    "(exact binomial test, p below 0.05 after Holm over this table); else not supported."
)
#: Risks below this are as good as none; logarithms need a least value. Line integrals are not more exact.
LEAST = 1e-9


@dataclass(frozen=True)
class Contrast:
    """
    One paired comparison in one cell.

    Attributes
    ----------
    what
        What is compared, in words: the first value is claimed to be greater.
    case
        The cell.
    shift
        First over second (of logarithms), or first minus second.
    p_holm
        The p-value, adjusted to its table.
    """

    what: str
    case: Case
    shift: Shift
    p_holm: float

    @property
    def holds(self) -> bool:
        """Whether the first value is shown to be greater."""
        return self.p_holm < ALPHA and self.shift.effect > 0.0


def contrast(
    samples: Samples,
    what: str,
    measure: str,
    greater: Case,
    less: Case,
    cell: Case,
    *,
    ratio: bool = True,
    name: Case | None = None,
) -> Contrast:
    """
    Compare one measurement between two cases in a cell.

    Parameters
    ----------
    samples
        The sample.
    what
        In words.
    measure
        Name of the measurement.
    greater, less
        The case in which it is claimed to be greater, and the other one.
    cell
        What both cases share.
    ratio
        Compare ratios (of values that are at least `LEAST`), else differences.
    name
        What to call the cell, if not by what both cases share.

    Examples
    --------
    >>> records = [{"map": i, "k": k, "risk": 0.01 * (i + 1) / k} for i in range(8) for k in (1, 2)]
    >>> found = contrast(Samples(records), "risk falls", "risk", {"k": 1}, {"k": 2}, {})
    >>> found.shift.shift.median.__round__(9), found.holds
    (2.0, True)
    """
    first, second = (samples.column(measure, **cell, **case) for case in (greater, less))
    shift = log_shift(np.maximum(first, LEAST), np.maximum(second, LEAST)) if ratio else paired_shift(first, second)
    return Contrast(what, cell if name is None else name, shift, shift.p)


def in_cells(
    samples: Samples, what: str, measure: str, greater: Case, less: Case, cells: Sequence[Case] = CELLS
) -> list[Contrast]:
    """Compare one measurement between two cases in several cells; not adjusted yet."""
    return [contrast(samples, what, measure, greater, less, cell) for cell in cells]


def adjusted(contrasts: Sequence[Contrast]) -> list[Contrast]:
    """Adjust the p-values of a table by Holm's method."""
    p_values = holm([one.shift.p for one in contrasts])
    return [replace(one, p_holm=p) for one, p in zip(contrasts, p_values, strict=True)]


def adjusted_together(*groups: Sequence[Contrast]) -> list[list[Contrast]]:
    """Adjust the p-values of a table that consists of several groups, and return it group by group."""
    found = iter(adjusted([one for group in groups for one in group]))
    return [list(islice(found, len(group))) for group in groups]


def all_hold(contrasts: "Sequence[Contrast | RateContrast]") -> bool:
    """Whether there are contrasts, and every one is shown to go as claimed."""
    return bool(contrasts) and all(one.holds for one in contrasts)


def supported_by(contrasts: "Sequence[Contrast | RateContrast]") -> Verdict:
    """Return the verdict of what is claimed to be so in every one of some contrasts."""
    return supported(all_hold(contrasts))


def tally(contrasts: Sequence[Contrast]) -> str:
    """
    Say in how many cells a contrast holds, and between which values its shift lies.

    Examples
    --------
    >>> tally([])
    'in 0 of 0 cells'
    """
    words = f"in {sum(one.holds for one in contrasts)} of {len(contrasts)} cells"
    if not contrasts:
        return words
    shifts = [one.shift.shift.median for one in contrasts]
    effects = [one.shift.effect for one in contrasts]
    return f"{words} ({span(shifts)}; rank-biserial effect {span(effects)})"


def span(values: Sequence[float], form: str = ".3g") -> str:
    """
    Write between which values several lie; one, where they are all written alike.

    Examples
    --------
    >>> span([0.1, 0.25]), span([0.5, 0.5], ".0%")
    ('0.1 to 0.25', '50%')
    """
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f"{low} to {high}"


def contrast_part(statement: str, contrasts: Sequence[Contrast]) -> Part:
    """Say of a part of a claim what its contrasts show."""
    return Part(statement, supported_by(contrasts), tally(contrasts))


def contrast_table(title: str, contrasts: Sequence[Contrast], note: str = RULE) -> Table:
    """Make a table of contrasts, one row each."""
    columns = ("first > second", "cell", "pairs", "shift", "95 % from", "to", "effect", "p (Holm)")
    rows = [
        (one.what, cell_name(one.case), one.shift.n, *finite(*one.shift.shift), one.shift.effect, one.p_holm)
        for one in contrasts
    ]
    return Table(title, columns, rows, note)


def finite(*values: float) -> tuple[float | None, ...]:
    """
    Return numbers for a table, None for what is unknown or has no bound.

    Examples
    --------
    >>> finite(1.0, float("inf"), float("nan"))
    (1.0, None, None)
    """
    return tuple(json_number(value) for value in values)


def cell_name(case: Case) -> str:
    """
    Write a cell in a word or two.

    Examples
    --------
    >>> cell_name({"integral": "exact", "radius": 0.2})
    'exact, OR 0.2'
    """
    words = {"radius": "OR {}", "k": "K = {}", "threats": "M = {}"}
    return ", ".join(words.get(name, "{}").format(value) for name, value in case.items()) or "all"


@dataclass(frozen=True)
class RateContrast:
    """
    How often two paired things happen, in one cell.

    Attributes
    ----------
    what
        What is compared, in words: the first is claimed to happen more often.
    case
        The cell.
    first, second
        The rates.
    n
        Pairs.
    p_holm
        Of McNemar's exact test, adjusted to its table.
    """

    what: str
    case: Case
    first: float
    second: float
    n: int
    p_holm: float

    @property
    def holds(self) -> bool:
        """Whether the first is shown to happen more often."""
        return self.p_holm < ALPHA and self.first > self.second


def rate_contrasts(pairs: Sequence[tuple[str, Case, FloatArray, FloatArray]]) -> list[RateContrast]:
    """
    Compare pairs of things that happen or not, adjusted to each other.

    Parameters
    ----------
    pairs
        What is compared in words, the cell, and what happened: 1, 0, or NaN for what is missing.

    Examples
    --------
    >>> rate_contrasts([("always > never", {}, np.ones(9), np.zeros(9))])[0].holds
    True
    """
    found = [(what, case, *paired_rates(first, second)) for what, case, first, second in pairs]
    p_values = holm([p for *_, p in found])
    return [
        RateContrast(what, case, first.rate, second.rate, first.n, p)
        for (what, case, first, second, _), p in zip(found, p_values, strict=True)
    ]


def rate_table(title: str, contrasts: Sequence[RateContrast], note: str = RULE) -> Table:
    """Make a table of rates, one row each."""
    columns = ("first > second", "cell", "pairs", "first", "second", "p (Holm)")
    rows = [(one.what, cell_name(one.case), one.n, *finite(one.first, one.second), one.p_holm) for one in contrasts]
    return Table(title, columns, rows, note)


@dataclass(frozen=True)
class Share:
    """
    How often something happens in one case.

    Attributes
    ----------
    case
        In a word or two, or its number.
    found
        How often.
    p_holm
        That it is no more than asked for, adjusted to its table.
    """

    case: str | float
    found: Proportion
    p_holm: float

    @property
    def holds(self) -> bool:
        """Whether it is shown to happen more often than is asked for."""
        return self.p_holm < ALPHA

    @property
    def row(self) -> tuple[str | float, int, float, float, float]:
        """Case, maps, share and its interval, as tables begin with them."""
        return self.case, self.found.n, self.found.rate, *self.found.interval


def shares(happened: Mapping[Any, FloatArray], least: float = MOSTLY) -> list[Share]:
    """
    Test in several cases whether something happens more often than `least`, adjusted to each other.

    Parameters
    ----------
    happened
        By case: 1, 0, or NaN for what is missing.

    Examples
    --------
    >>> [one.holds for one in shares({"always": np.ones(200), "mostly": np.arange(200) % 20 > 0})]
    [True, False]
    """
    p_values = holm([at_least(one, least) for one in happened.values()])
    return [Share(case, proportion(one), p) for (case, one), p in zip(happened.items(), p_values, strict=True)]

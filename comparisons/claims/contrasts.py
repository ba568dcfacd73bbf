"""
Contrasts: a claim about flights is held against several readings of the paper, its cells, and holds if it does in all.

Online flights are chaotic: one and the same map goes from a short flight to a long one because of a slightly different
line integral or detection radius. So each contrast is measured for both readings of the integral (E20), for detection
radii within 10 % of the paper's, and with a plan on every tick, as the paper's Steps 4 and 5 have it, or only when
something new is seen (E18). That it holds in every cell is an intersection-union test (Berger 1982): each cell is
tested at the full level, and no adjustment for their number is due. That the opposite holds in some cell is a union,
so those p-values are adjusted by Holm's method.
"""

import math
from collections.abc import Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from itertools import chain, product
from typing import Any, Literal, Protocol, TypeAlias, TypeVar

import numpy as np

from cgla_graph._text import json_number
from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Part, Table, Verdict
from cgla_graph.comparisons.claims.evidence import Samples
from cgla_graph.comparisons.claims.inference import (
    Proportion,
    Shift,
    at_least,
    at_most,
    log_shift,
    paired_rates,
    paired_shift,
    proportion,
)
from cgla_graph.comparisons.statistics.intervals import Estimate
from cgla_graph.comparisons.statistics.paired import holm

#: Below this a p-value counts.
ALPHA = 0.05
#: Line integrals: exact, and the raster sum of E20.
INTEGRALS: tuple[Literal["exact", "raster"], ...] = ("exact", "raster")
#: Detection radii, map units: OR = 0.2, and 10 % less and more.
RADII = (0.18, 0.2, 0.22)
#: When a UAV plans again: when it sees something new, or on every tick (Steps 4 and 5).
REPLANS: tuple[Literal["change", "tick"], ...] = ("change", "tick")
T = TypeVar("T")
#: What a case is called by.
Case: TypeAlias = Mapping[str, Any]
#: All cells of an online claim.
CELLS: tuple[Case, ...] = tuple(
    {"integral": integral, "radius": radius, "replan": replan}
    for replan, integral, radius in product(REPLANS, INTEGRALS, RADII)
)
#: The cell of the toolkit's own readings, of which curves and figures are.
MAIN: Case = {"integral": "exact", "radius": 0.2, "replan": "change"}
#: The rule of all statistical claims that say which of two things is greater; said before any map was looked at.
RULE = (
    "Rule, set before the sample was drawn: supported if in every row p is below 0.05 and the effect goes in the "
    "claimed direction; contradicted if in some row it goes the other way, with p below 0.05 after Holm over the rows; "
    "else undecided."
)
#: How often something has to happen that is said to happen as a rule.
MOSTLY = 0.95
SHARE_RULE = (
    f"Rule, set before the sample was drawn: supported if in every row the share is shown to be above {MOSTLY:g} "
    "(exact binomial test, p below 0.05); contradicted if in some row it is shown to be below (Holm over the rows); "
    "else undecided."
)
#: Risks below this are as good as none; logarithms need a least value. Line integrals are not more exact.
LEAST = 1e-9
#: The level of a quick check, which is to say nothing that the full one does not: few maps err more often.
QUICK_ALPHA = 0.01
#: The level of the check that runs.
LEVEL: ContextVar[float] = ContextVar("LEVEL", default=ALPHA)


def fewest_pairs() -> int:
    """
    Return how many pairs that differ two-sided signed ranks, and McNemar's test, need to show anything.

    Examples
    --------
    >>> fewest_pairs()
    6
    """
    return math.floor(1.0 - math.log2(LEVEL.get())) + 1


class CellTest(Protocol):
    """A test in one cell: its p-value, which way it points (1 as claimed, -1 the other way), and its size."""

    @property
    def p(self) -> float:
        """The p-value, not adjusted."""
        ...

    @property
    def direction(self) -> int:
        """1 as claimed, -1 the other way, 0 neither."""
        ...

    @property
    def missing(self) -> int:
        """How many more maps it takes before p can be below `LEVEL` at all."""
        ...


def holds(test: CellTest) -> bool:
    """Tell whether a test shows what is claimed."""
    return test.p < LEVEL.get() and test.direction > 0


def opposes(test: CellTest) -> bool:
    """Tell whether a test shows the opposite of what is claimed; among several tests, before any adjustment."""
    return test.p < LEVEL.get() and test.direction < 0


def judged(tests: Sequence[CellTest]) -> Verdict:
    """
    Return the verdict of what is claimed to be so in every one of some cells.

    Supported if each test shows it; contradicted if some test shows the opposite, which is adjusted by Holm's method as
    it takes one only; else undecided.

    Examples
    --------
    >>> judged([]).label
    'undecided'
    """
    if tests and all(holds(test) for test in tests):
        return Verdict.SUPPORTED
    against = holm([test.p if test.direction < 0 else 1.0 for test in tests])
    return Verdict.CONTRADICTED if any(p < LEVEL.get() for p in against) else Verdict.UNDECIDED


def shown(tests: Sequence[CellTest]) -> str:
    """
    Say in how many cells a claim is shown, in how many the opposite, and whether more maps could change it.

    Examples
    --------
    >>> shown([])
    'in 0 of 0 cells'
    """
    words = f"in {sum(holds(test) for test in tests)} of {len(tests)} cell{'s' if len(tests) != 1 else ''}"
    opposite = sum(opposes(test) for test in tests)
    if opposite:
        words += f", the opposite in {opposite}"
    more = max((test.missing for test in tests), default=0)
    return words + (f", which {more} more maps could show at the earliest" if more else "")


def judged_part(
    statement: str, tests: Sequence[CellTest], *, effect: str = "", printed: str = "", condition: str = ""
) -> Part:
    """Say of a part of a claim what its tests show in all cells."""
    return Part(statement, judged(tests), f"shown {shown(tests)}", condition + split(tests), effect, printed)


def split(tests: Sequence[CellTest]) -> str:
    """Say what belongs to the condition of what some cells contradict and others show; empty if none do both."""
    found = sum(holds(test) for test in tests)
    if not found or judged(tests) is not Verdict.CONTRADICTED:
        return ""
    opposite = sum(opposes(test) for test in tests)
    return f" (in {opposite} of {len(tests)} cells; {found} show it)"


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
    """

    what: str
    case: Case
    shift: Shift

    @property
    def p(self) -> float:
        """Of Wilcoxon's signed ranks, two-sided."""
        return self.shift.p

    @property
    def direction(self) -> int:
        """1 where the first value is greater, -1 where it is less; 0 where a typical pair does not differ."""
        return 0 if self.shift.typical == 0.0 else int(np.sign(self.shift.effect))

    @property
    def missing(self) -> int:
        """How many more maps it takes at least."""
        return max(0, fewest_pairs() - self.shift.n)


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
    >>> found.shift.shift.median.__round__(9), holds(found)
    (2.0, True)
    """
    first, second = (samples.column(measure, **cell, **case) for case in (greater, less))
    shift = log_shift(np.maximum(first, LEAST), np.maximum(second, LEAST)) if ratio else paired_shift(first, second)
    return Contrast(what, cell if name is None else name, shift)


def together(groups: Mapping[Any, Sequence[T]]) -> list[T]:
    """
    Put the tests of several groups into one list: what is claimed of each has to hold in all.

    Examples
    --------
    >>> together({"K = 10": [1, 2], "K = 50": [3]})
    [1, 2, 3]
    """
    return list(chain.from_iterable(groups.values()))


def in_cells(
    samples: Samples, what: str, measure: str, greater: Case, less: Case, cells: Sequence[Case] = CELLS
) -> list[Contrast]:
    """Compare one measurement between two cases in several cells."""
    return [contrast(samples, what, measure, greater, less, cell) for cell in cells]


def tally(contrasts: Sequence[Contrast]) -> str:
    """
    Say in how many cells a contrast is shown, and between which values its shift lies.

    Examples
    --------
    >>> tally([])
    'in 0 of 0 cells'
    """
    if not contrasts:
        return shown(contrasts)
    effects = [one.shift.effect for one in contrasts]
    return f"{shown(contrasts)} ({sizes(contrasts)}; rank-biserial effect {span(effects)})"


def sizes(contrasts: Sequence[Contrast]) -> str:
    """Say between which values the shifts of several cells lie, and how far their intervals reach in all."""
    shifts = [one.shift.shift for one in contrasts]
    low, high = min(one.low for one in shifts), max(one.high for one in shifts)
    return f"{span([one.median for one in shifts])}, 95 % within {low:.3g} to {high:.3g}"


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


def contrast_part(statement: str, contrasts: Sequence[Contrast], *, printed: str = "", condition: str = "") -> Part:
    """Say of a part of a claim what its contrasts show, and how large they are."""
    effect = sizes(contrasts) if contrasts else ""
    said = condition + split(contrasts)
    return Part(statement, judged(contrasts), f"shown {tally(contrasts)}", said, effect, printed)


def contrast_table(title: str, contrasts: Sequence[Contrast], note: str = RULE) -> Table:
    """Make a table of contrasts, one row each."""
    columns = ("first > second", "cell", "pairs", "shift", "95 % from", "to", "effect", "p")
    rows = [
        (one.what, cell_name(one.case), one.shift.n, *finite(*one.shift.shift), one.shift.effect, one.p)
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
    >>> cell_name({"integral": "exact", "radius": 0.2, "replan": "tick"})
    'exact, OR 0.2, every tick'
    """
    words = {"radius": "OR {}", "k": "K = {}", "threats": "M = {}"}
    # that plans are made on change is the usual, and not said
    said = {name: "every tick" if value == "tick" else value for name, value in case.items() if value != "change"}
    return ", ".join(words.get(name, "{}").format(value) for name, value in said.items()) or "all"


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
    p
        Of McNemar's exact test.
    """

    what: str
    case: Case
    first: float
    second: float
    n: int
    p: float

    @property
    def direction(self) -> int:
        """1 where the first happens more often, -1 where less."""
        return int(np.sign(self.first - self.second)) if self.n else 0

    @property
    def missing(self) -> int:
        """How many more maps it takes at least."""
        return max(0, fewest_pairs() - self.n)


def rate_contrast(what: str, case: Case, first: FloatArray, second: FloatArray) -> RateContrast:
    """
    Compare how often two paired things happen: 1, 0, or NaN for what is missing.

    Examples
    --------
    >>> holds(rate_contrast("always > never", {}, np.ones(9), np.zeros(9)))
    True
    """
    one, other, p = paired_rates(first, second)
    return RateContrast(what, case, one.rate, other.rate, one.n, p)


def rate_part(statement: str, contrasts: Sequence[RateContrast], *, printed: str = "", condition: str = "") -> Part:
    """Say of a part of a claim what its rates show, and how large they are."""
    first, second = (span([getattr(one, which) for one in contrasts], ".3g") for which in ("first", "second"))
    return judged_part(statement, contrasts, effect=f"{first} against {second}", printed=printed, condition=condition)


def rate_table(title: str, contrasts: Sequence[RateContrast], note: str = RULE) -> Table:
    """Make a table of rates, one row each."""
    columns = ("first > second", "cell", "pairs", "first", "second", "p")
    rows = [(one.what, cell_name(one.case), one.n, *finite(one.first, one.second), one.p) for one in contrasts]
    return Table(title, columns, rows, note)


@dataclass(frozen=True)
class Share:
    """
    How often something happens in one case, held against how often it should.

    Attributes
    ----------
    case
        In a word or two, or its number.
    found
        How often.
    least
        How often it should, at least.
    p
        That it happens no more often than `least`, or no less often: of the side on which it is.
    missing
        How many more maps it would take, if it happened on all of them, to show it.
    """

    case: str | float
    found: Proportion
    least: float
    p: float
    missing: int

    @property
    def direction(self) -> int:
        """1 where it happens more often than asked for, -1 where less."""
        return int(np.sign(self.found.rate - self.least)) if self.found.n else 0

    @property
    def row(self) -> tuple[str | float, int, float, float, float]:
        """Case, maps, share and its interval, as tables begin with them."""
        return self.case, self.found.n, self.found.rate, *self.found.interval


def shares(happened: Mapping[Any, FloatArray], least: float = MOSTLY) -> list[Share]:
    """
    Test in several cases whether something happens more often than `least`, or less often.

    Parameters
    ----------
    happened
        By case: 1, 0, or NaN for what is missing.

    Examples
    --------
    >>> found = shares({"always": np.ones(200), "mostly": np.arange(200) % 20 > 0, "few maps": np.ones(8)})
    >>> [(holds(one), one.missing) for one in found]
    [(True, 0), (False, 0), (False, 51)]
    """
    # so many out of so many are the fewest that can show it
    fewest = int(np.ceil(np.log(LEVEL.get()) / np.log(least)))
    found = []
    for case, one in happened.items():
        rate = proportion(one)
        p = (at_most if rate.rate < least else at_least)(one, least)
        found.append(Share(case, rate, least, p, max(0, fewest - rate.n)))
    return found


def share_part(statement: str, found: Sequence[Share], *, printed: str = "", condition: str = "") -> Part:
    """Say of a part of a claim how often it happens."""
    low, high = min(one.found.interval.low for one in found), max(one.found.interval.high for one in found)
    effect = f"{span([one.found.rate for one in found], '.3g')}, 95 % within {low:.3g} to {high:.3g}"
    return judged_part(statement, found, effect=effect, printed=printed, condition=condition)


def share_table(title: str, found: Sequence[Share], note: str = SHARE_RULE) -> Table:
    """Make a table of shares, one row each."""
    columns = ("case", "maps", "share", "95 % from", "to", "p")
    return Table(title, columns, [(*one.row, one.p) for one in found], note)


def beyond(estimate: Estimate, bound: float) -> Verdict:
    """
    Return the verdict of a claim that something is greater than a bound: where its interval lies.

    Examples
    --------
    >>> [beyond(Estimate(2.0, 1.5, high), 1.8).label for high in (2.5, 1.7)]
    ['undecided', 'contradicted']
    """
    if estimate.low > bound:
        return Verdict.SUPPORTED
    return Verdict.CONTRADICTED if estimate.high < bound else Verdict.UNDECIDED

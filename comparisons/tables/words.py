"""Numbers and names as tables, the report and files for LaTeX write them: the same words everywhere."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from cgla_graph.comparisons.statistics.intervals import Estimate, Interval
from cgla_graph.comparisons.statistics.told_apart import fewest_instances, least_p
from cgla_graph.comparisons.tables.tables import figure

#: What stands for what is not known.
DASH = "-"
_SMALLEST_P = 0.001
_MOST_NAMES = 6


class Cell(NamedTuple):
    """
    What one cell of a table says.

    Attributes
    ----------
    value
        The figure.
    interval
        The interval that belongs to it; empty without one.
    """

    value: str
    interval: str = ""

    @property
    def lines(self) -> str:
        """The interval in a second line."""
        return "\n".join(part for part in self if part)


def estimate_cell(found: Estimate, write: Callable[[float], str], *, least: float = -math.inf) -> Cell:
    """
    Write a median and its interval; no interval of too few values, nor of too few that ever get there.

    Parameters
    ----------
    found
        The median; a dash if that is NaN.
    write
        How a number is written, infinity among them.
    least
        The least that there can be: an interval from there to infinity says nothing.

    Examples
    --------
    >>> estimate_cell(Estimate(1.0, 0.5, 2.0), "{:.1f} s".format)
    Cell(value='1.0 s', interval='0.5 to 2.0 s')
    >>> estimate_cell(Estimate(1.0, 0.0, math.inf), ratio, least=0.0)
    Cell(value='1.0000', interval='')
    >>> estimate_cell(Estimate(math.inf, math.inf, math.inf), or_never("{:.1f} s".format))
    Cell(value='never', interval='')
    """
    if math.isnan(found.median):
        return Cell(DASH)
    if math.isinf(found.low) or (found.low <= least and math.isinf(found.high)):
        return Cell(write(found.median))
    return Cell(write(found.median), span(write(found.low), write(found.high)))


def rate_cell(n_found: int, n: int, rate: Interval) -> Cell:
    """
    Write how many of some runs succeeded, and the interval of their rate; one run has none.

    Examples
    --------
    >>> rate_cell(3, 4, Interval(0.19, 0.99))
    Cell(value='3/4', interval='19 to 99 %')
    """
    return Cell(f"{n_found:,}/{n:,}", f"{100 * rate.low:.0f} to {100 * rate.high:.0f} %" if n > 1 else "")


def span(low: str, high: str) -> str:
    """
    Write an interval of two written numbers; a unit that both have stands once.

    Examples
    --------
    >>> span("1 ms", "2 ms"), span("1 ms", "2 s"), span("1", "2")
    ('1 to 2 ms', '1 ms to 2 s', '1 to 2')
    """
    number, _, unit = low.rpartition(" ")
    shared = number and unit == high.rpartition(" ")[2]
    return f"{number if shared else low} to {high}"


def ratio(value: float) -> str:
    """
    Write a ratio of costs or times.

    Examples
    --------
    >>> ratio(1.01), ratio(math.inf)
    ('1.0100', '∞')
    """
    return figure(value, 5) if value < math.inf else "∞"


def p_value(p: float) -> str:
    """
    Write a p-value with the digits that matter.

    Examples
    --------
    >>> p_value(0.2), p_value(0.0314), p_value(1e-9)
    ('0.20', '0.031', '< 0.001')
    """
    if p < _SMALLEST_P:
        return f"< {_SMALLEST_P}"
    return f"{p:.2f}" if p >= 0.1 else f"{p:.2g}"  # noqa: PLR2004 - digits that matter


def p_equals(p: float) -> str:
    """
    Write a p-value as a sentence has it.

    Examples
    --------
    >>> p_equals(0.2), p_equals(1e-9)
    ('p = 0.20', 'p < 0.001')
    """
    return f"p {p_value(p)}" if p < _SMALLEST_P else f"p = {p_value(p)}"


def too_few_note(n_scenarios: int, n_solvers: int) -> str:
    """
    Say how many scenarios it takes to tell solvers apart; empty where there are as many.

    Parameters
    ----------
    n_scenarios, n_solvers
        How many there are.

    Examples
    --------
    >>> too_few_note(6, 5)
    '6 scenarios cannot tell 5 solvers apart: after Holm for 10 pairs no p is below 0.31; it takes 9 scenarios or more'
    >>> too_few_note(9, 5), too_few_note(1, 1)
    ('', '')
    """
    if n_solvers < 2 or not 0 < n_scenarios < fewest_instances(n_solvers):  # noqa: PLR2004 - one differs from none
        return ""
    pairs = counted(math.comb(n_solvers, 2), "pair")
    least = f"after Holm for {pairs} no p is below {p_value(least_p(n_scenarios, n_solvers))}"
    here = f"{counted(n_scenarios, 'scenario')} cannot tell {n_solvers} solvers apart"
    return f"{here}: {least}; it takes {fewest_instances(n_solvers)} scenarios or more"


def or_never(write: Callable[[float], str]) -> Callable[[float], str]:
    """
    Let a function that writes a number write "never" for infinity.

    Examples
    --------
    >>> or_never("{:.0f} s".format)(math.inf)
    'never'
    """
    return lambda value: write(value) if value < math.inf else "never"


def counted(number: int, word: str) -> str:
    """
    Write how many there are.

    Examples
    --------
    >>> counted(1, "run"), counted(1200, "run")
    ('1 run', '1,200 runs')
    """
    return f"{number:,} {word}" if number == 1 else f"{number:,} {word}s"


def listed(names: Sequence[str], most: int = _MOST_NAMES) -> str:
    """
    Join names for a sentence; of many, the first.

    Examples
    --------
    >>> listed(["a", "b", "c"]), listed(["a", "b", "c"], 2)
    ('a, b and c', 'a, b and 1 more')
    """
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)

"""Formats of numbers, cells and intervals, shared by the terminal, files, pictures and the report."""

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

from cgla_graph._text import DASH, figure

_SMALLEST_P = 0.001


def rounded(value: float, digits: int = 5) -> float | None:
    """
    Round to significant digits for JSON; None for NaN and infinity; whole ones lose their point.

    Examples
    --------
    >>> rounded(0.123456), rounded(2.0), rounded(math.nan)
    (0.12346, 2, None)
    """
    if not math.isfinite(value):
        return None
    short = float(f"{value:.{digits}g}")
    return int(short) if short.is_integer() and abs(short) < 10**digits else short


def rounded_all(values: Iterable[float], digits: int = 5) -> list[float | None]:
    """
    Round several numbers (see `rounded`).

    Examples
    --------
    >>> rounded_all([1234.5678, math.inf, 3.0])
    [1234.6, None, 3]
    """
    return [rounded(float(value), digits) for value in values]


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


class Cell(NamedTuple):
    """
    One cell of a table.

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


def estimate_cell(
    estimate: tuple[float, float, float], write: Callable[[float], str], *, least: float = -math.inf
) -> Cell:
    """
    Write a median and its interval; no interval of too few values, nor of too few that ever get there.

    Parameters
    ----------
    estimate
        The median, a dash if it is NaN, and the ends of its interval.
    write
        Writes a number, which may be infinite.
    least
        The least that there can be: an interval from there to infinity says nothing.

    Examples
    --------
    >>> estimate_cell((1.0, 0.5, 2.0), "{:.1f} s".format)
    Cell(value='1.0 s', interval='0.5 to 2.0 s')
    >>> estimate_cell((1.0, 0.0, math.inf), ratio, least=0.0)
    Cell(value='1.0000', interval='')
    >>> estimate_cell((math.inf, math.inf, math.inf), or_never("{:.1f} s".format))
    Cell(value='never', interval='')
    """
    median, low, high = estimate
    if math.isnan(median):
        return Cell(DASH)
    if math.isinf(low) or (low <= least and math.isinf(high)):
        return Cell(write(median))
    return Cell(write(median), span(write(low), write(high)))


def rate_cell(n_found: int, n: int, rate: tuple[float, float]) -> Cell:
    """
    Write how many of some runs succeeded, and the interval of their rate; one run has none.

    Examples
    --------
    >>> rate_cell(3, 4, (0.19, 0.99))
    Cell(value='3/4', interval='19 to 99 %')
    """
    low, high = rate
    return Cell(f"{n_found:,}/{n:,}", f"{100 * low:.0f} to {100 * high:.0f} %" if n > 1 else "")


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


def or_never(write: Callable[[float], str]) -> Callable[[float], str]:
    """
    Let a function that writes a number write "never" for infinity.

    Examples
    --------
    >>> or_never("{:.0f} s".format)(math.inf)
    'never'
    """
    return lambda value: write(value) if value < math.inf else "never"

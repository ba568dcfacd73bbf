"""Shared checks of a mission's parts: the place of a fault, and ticks."""

from collections.abc import Iterator
from contextlib import contextmanager

from cgla_graph._validate import whole_number
from cgla_graph.errors import CglaError, MissionError

#: Larger ticks are refused.
MOST_TICKS = 1_000_000


@contextmanager
def error_context(place: str = "") -> Iterator[None]:
    """
    Turn errors into a `MissionError` that names the place.

    Examples
    --------
    >>> with error_context("UAV a"):
    ...     whole_tick("departs", -1)
    Traceback (most recent call last):
    cgla_graph.errors.MissionError: UAV a: departs is -1; give a whole number from 0 to 1000000
    """
    try:
        yield
    except (ValueError, CglaError) as error:
        msg = f"{place}: {error}" if place else str(error)
        raise MissionError(msg) from error


def whole_tick(name: str, value: object, *, at_least: int = 0) -> int:
    """Return a tick, or raise `MissionError` unless it is a whole number in range."""
    with error_context():
        return whole_number(name, value, at_least=at_least, at_most=MOST_TICKS)

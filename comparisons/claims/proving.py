"""Assertions of checks: one that fails ends the check, and the claim has no verdict."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat


def require(holds: object, message: str) -> None:
    """
    Raise with the message unless `holds`; an assert would vanish under ``python -O``.

    Raises
    ------
    AssertionError
        If it does not hold.

    Examples
    --------
    >>> require(1 + 1 == 2, "sums are wrong")
    """
    if not holds:
        raise AssertionError(message)


@contextmanager
def improper_allowed() -> Iterator[None]:
    """Build fields with peaks above 1 without a warning: they are here to show what breaks."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImproperFieldWarning)
        yield


def improper_field(threats: list[Threat]) -> RiskField:
    """Build a field that may have peaks above 1."""
    with improper_allowed():
        return RiskField(threats, improper=True)

"""An experiment: what is measured on each of many random maps, for one or more claims."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

#: One measurement: plain names with numbers, words, truth values or None (unknown, or not finite).
Record: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True)
class Experiment:
    """
    What is measured on a map.

    Attributes
    ----------
    name
        Kebab-case.
    sample
        Measures on the map of a seed, in all its cases: a list of records, each with the entries that name its case
        (such as ``integral``, ``radius``, ``k``) and those that are measured. At top level of its module; the same
        seed gives the same records.
    quick
        On how many maps with ``--quick``.
    share
        On what share of ``--maps``: below 1 where a map takes long, and then the report says so.

    Examples
    --------
    >>> Experiment("squares", lambda seed: [{"value": seed**2}], quick=3).maps(200, quick=False)
    200
    """

    name: str
    sample: Callable[[int], Sequence[Record]]
    quick: int = 8
    share: float = 1.0

    def maps(self, asked: int, *, quick: bool) -> int:
        """Return on how many maps it is made, if so many are asked for."""
        return min(self.quick, asked) if quick else max(1, round(self.share * asked))


def experiment(
    name: str, *, quick: int = 8, share: float = 1.0
) -> Callable[[Callable[[int], Sequence[Record]]], Experiment]:
    """
    Make an experiment of the function that measures on a map, which stands below; what is given is as of `Experiment`.

    Examples
    --------
    >>> @experiment("squares", quick=3)
    ... def squares(seed: int) -> list[Record]:
    ...     return [{"value": seed**2}]
    >>> squares.sample(4)
    [{'value': 16}]
    """
    return lambda sample: Experiment(name, sample, quick, share)

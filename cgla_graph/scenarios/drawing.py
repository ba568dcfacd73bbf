"""Random numbers and threats from a seed, the same on every machine."""

from collections.abc import Iterable, Sequence

import numpy as np

from cgla_graph._types import Bounds, Point
from cgla_graph.errors import ScenarioError
from cgla_graph.model.risk import Threat

#: Rejected draws in a row after which there counts as no room.
MOST_MISSES = 10_000


class Stream:
    """
    Numbers from a seed, the same on every machine and with every version of NumPy.

    NumPy promises that the integers of PCG64 and of SeedSequence never change, but not so the floats that a Generator
    makes of them; they are made here, by steps that IEEE 754 rounds alike everywhere.

    Parameters
    ----------
    seed
        At least 0.
    purpose
        Streams of one seed with different purposes are independent.

    Examples
    --------
    >>> stream = Stream(17)
    >>> [round(stream.between(2.0, 3.0), 3) for _ in range(3)]
    [2.845, 2.161, 2.558]
    """

    def __init__(self, seed: int, *purpose: int) -> None:
        self._words = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=purpose))

    def between(self, low: float, high: float) -> float:
        """Draw evenly from ``[low, high)``; `low` if both are the same."""
        return low + (high - low) * ((int(self._words.random_raw()) >> 11) * 2.0**-53)


def drawn_threats(
    stream: Stream,
    count: int,
    bounds: Bounds,
    spread: Sequence[float],
    peak: Sequence[float],
    *,
    clear: float,
    ends: Sequence[Point],
) -> list[Threat]:
    """
    Draw threats evenly over some bounds.

    Parameters
    ----------
    stream
        The source of random numbers; each draw takes four.
    count
        How many threats.
    bounds
        The box of their centres, map units.
    spread, peak
        Least and greatest value.
    clear
        Least distance of a centre from every start and goal, map units.
    ends
        The starts and goals, map units.

    Raises
    ------
    ScenarioError
        If there is no room.

    Examples
    --------
    >>> len(drawn_threats(Stream(1), 3, (0, 0, 1, 1), (0.1, 0.2), (1.0, 1.0), clear=0.5, ends=[(0.1, 0.1)]))
    3
    """
    found: list[Threat] = []
    misses = 0
    while len(found) < count:
        x, y = stream.between(bounds[0], bounds[2]), stream.between(bounds[1], bounds[3])
        numbers = stream.between(*spread), stream.between(*peak)
        if are_apart((x, y), ends, clear):
            found.append(Threat(x, y, *numbers))
            misses = 0
        elif (misses := misses + 1) > MOST_MISSES:
            msg = f"no room for a threat at least {clear:g} from start and goal; lower clear"
            raise ScenarioError(msg)
    return found


def are_apart(spot: Point, others: Iterable[Point], least: float) -> bool:
    """
    Return whether a point is at least `least` away from all others.

    Examples
    --------
    >>> are_apart((0.0, 0.0), [(3.0, 4.0)], 5.0)
    True
    """
    # by products, as a hypotenuse is not rounded alike on every machine
    return all((spot[0] - x) * (spot[0] - x) + (spot[1] - y) * (spot[1] - y) >= least * least for x, y in others)

"""
The numbers that the paper prints, as data: Tables 1 to 5 and two times, each with its place.

Lengths are in a unit that the paper does not name. Risks of BCV, A2D and Q-Learning are, it says, those of their
original papers: other maps, other measures. Where a ratio with one stands beside ours, it says that it is quoted.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from cgla_graph._types import Point
from cgla_graph.comparisons.claims.paper.flights import GOAL, START

#: The unit that fits most lengths: 160 a side, 3.2 a step of 0.02.
WORKING_SCALE = 160.0
#: Where the way of Table 2 begins: where the sudden threat is, which is all that is said.
SUDDEN: Point = (0.6, 0.5)
#: Where three UAVs begin (Section 5.2).
STARTS: tuple[Point, ...] = ((0.1, 0.1), (0.15, 0.45), (0.225, 0.7))


@dataclass(frozen=True)
class PaperValue:
    """
    A row of one of the paper's tables.

    Attributes
    ----------
    place
        The table.
    method
        What flew, with its K where that is said.
    risk, length
        As printed; NaN where nothing is.
    start
        Where the flight began, as far as it is said.
    own_risk
        Whether the risk was measured by the authors: not quoted from another paper.

    Examples
    --------
    >>> TABLE_1[3].method, TABLE_1[3].risk, TABLE_1[3].length
    ('CGLA, K = 10', 2.4318, 243.0)
    """

    place: str
    method: str
    risk: float
    length: float
    start: Point
    own_risk: bool = True

    @property
    def straight(self) -> float:
        """The straight line from start to goal, sides of the map."""
        return math.dist(self.start, GOAL)

    @property
    def printed(self) -> dict[str, float]:
        """What is printed: ``risk sum``, ``length``, or both."""
        numbers = {"risk sum": self.risk, "length": self.length}
        return {name: number for name, number in numbers.items() if not math.isnan(number)}

    def is_less(self, other: "PaperValue") -> bool:
        """Whether it has less risk and less length than another row; both have to be printed."""
        return self.risk < other.risk and self.length < other.length

    @property
    def greatest_scale(self) -> float:
        """
        The most units a side of the map can have: no path is shorter than the straight line.

        Examples
        --------
        >>> round(TABLE_1[2].greatest_scale, 1)
        181.0
        """
        return self.length / self.straight


#: Section 5.1: ways from (0.1, 0.1) to (0.9, 0.9).
TABLE_1 = (
    PaperValue("Table 1", "BCV", 10.1658, 256.0, START, own_risk=False),
    PaperValue("Table 1", "A2D", 24.3638, 431.0, START, own_risk=False),
    PaperValue("Table 1", "Q-Learning", 27.7908, 204.8, START, own_risk=False),
    PaperValue("Table 1", "CGLA, K = 10", 2.4318, 243.0, START),
    PaperValue("Table 1", "CGLA, K = 50", 0.6356, 298.6, START),
    PaperValue("Table 1", "CGLA, K = 200", 0.1387, 273.2, START),
)
#: Section 5.1: what is left of the way after a sudden threat.
TABLE_2 = (
    PaperValue("Table 2", "CGLA, K = 10", 1.9896, 105.0, SUDDEN),
    PaperValue("Table 2", "CGLA, K = 100", 1.5393, 110.0, SUDDEN),
)
#: Section 5.2: the UAV that profits from what the other one sees.
TABLE_3 = (
    PaperValue("Table 3", "CGLA, without sharing", 0.9825, 281.6, START),
    PaperValue("Table 3", "CGLA, with sharing", 0.5383, 240.0, START),
)
#: Section 5.2: three UAVs, in the order of `STARTS`; risks (Table 4) and lengths (Table 5).
TABLE_4 = tuple(
    PaperValue("Table 4", f"{method}, UAV {number + 1}", risk, math.nan, STARTS[number])
    for method, risks in {"FBCRI": (3.5326, 4.5282, 4.5576), "CGLA": (0.2096, 0.8282, 0.4095)}.items()
    for number, risk in enumerate(risks)
)
TABLE_5 = tuple(
    PaperValue("Table 5", f"{method}, UAV {number + 1}", math.nan, length, STARTS[number])
    for method, lengths in {
        "FBCRI": (195.0, 244.0, 211.0),
        "CPVS": (188.0, 234.0, 199.0),
        "CGLA": (186.0, 157.0, 125.0),
    }.items()
    for number, length in enumerate(lengths)
)
TABLES = (*TABLE_1, *TABLE_2, *TABLE_3, *TABLE_4, *TABLE_5)


class Times(NamedTuple):
    """Seconds of CGLA and of Q-Learning on the same map (Section 5.1, "2.9 GHz 2 CPU")."""

    cgla: float
    q_learning: float

    @property
    def ratio(self) -> float:
        """How many times as long Q-Learning takes."""
        return self.q_learning / self.cgla


TIMES = Times(cgla=7.636752, q_learning=26.4662)


def value(place: str, method: str) -> PaperValue:
    """
    Return a row; `KeyError` if there is none.

    Examples
    --------
    >>> value("Table 5", "CGLA, UAV 3").length
    125.0
    """
    for row in TABLES:
        if (row.place, row.method) == (place, method):
            return row
    msg = f"{place} has no row {method!r}"
    raise KeyError(msg)


def rows_with_length() -> list[PaperValue]:
    """
    List the rows that print a length, those that allow the least units a side of the map first.

    Examples
    --------
    >>> tightest = rows_with_length()[0]
    >>> tightest.place, tightest.method, round(tightest.greatest_scale, 1)
    ('Table 5', 'CGLA, UAV 1', 164.4)
    """
    return sorted((row for row in TABLES if row.length > 0.0), key=lambda row: row.greatest_scale)

"""
Numbers that the paper prints: Tables 1 to 5 and two times.

Lengths are in a unit that the paper does not name. The paper says that the risks of BCV, A2D and Q-Learning are those
of their original papers: other maps, other measures (`PaperValue.own_risk`).
"""

import math
from typing import NamedTuple

#: The unit that fits most lengths: 160 a side, 3.2 a step of 0.02.
WORKING_SCALE = 160.0


class PaperValue(NamedTuple):
    """
    A row of one of the paper's tables: its place, the planner, risk and length as printed, NaN where nothing is.

    ``own_risk`` says whether the authors measured the risk; else it is quoted from another paper.

    Examples
    --------
    >>> value("Table 1", "CGLA, K = 10").risk
    2.4318
    """

    place: str
    method: str
    risk: float = math.nan
    length: float = math.nan
    own_risk: bool = True


#: Risks (Table 4) and lengths (Table 5) of three UAVs.
_RISKS = {"FBCRI": (3.5326, 4.5282, 4.5576), "CGLA": (0.2096, 0.8282, 0.4095)}
_LENGTHS = {"FBCRI": (195.0, 244.0, 211.0), "CPVS": (188.0, 234.0, 199.0), "CGLA": (186.0, 157.0, 125.0)}
TABLES = (
    # Section 5.1: from (0.1, 0.1) to (0.9, 0.9)
    PaperValue("Table 1", "BCV", 10.1658, 256.0, own_risk=False),
    PaperValue("Table 1", "A2D", 24.3638, 431.0, own_risk=False),
    PaperValue("Table 1", "Q-Learning", 27.7908, 204.8, own_risk=False),
    PaperValue("Table 1", "CGLA, K = 10", 2.4318, 243.0),
    PaperValue("Table 1", "CGLA, K = 50", 0.6356, 298.6),
    PaperValue("Table 1", "CGLA, K = 200", 0.1387, 273.2),
    # what is left of the way after a sudden threat
    PaperValue("Table 2", "CGLA, K = 10", 1.9896, 105.0),
    PaperValue("Table 2", "CGLA, K = 100", 1.5393, 110.0),
    # Section 5.2: the UAV that profits from what the other one sees
    PaperValue("Table 3", "CGLA, without sharing", 0.9825, 281.6),
    PaperValue("Table 3", "CGLA, with sharing", 0.5383, 240.0),
    *(PaperValue("Table 4", f"{of}, UAV {i + 1}", risks[i]) for of, risks in _RISKS.items() for i in range(3)),
    *(PaperValue("Table 5", f"{of}, UAV {i + 1}", length=far[i]) for of, far in _LENGTHS.items() for i in range(3)),
)


class Times(NamedTuple):
    """Seconds that planning takes on the map of Fig. 7 (Section 5.1, "2.9 GHz 2 CPU")."""

    cgla: float
    q_learning: float


TIMES = Times(cgla=7.636752, q_learning=26.4662)


def value(place: str, method: str) -> PaperValue:
    """Return a row; `KeyError` if there is none."""
    return {(row.place, row.method): row for row in TABLES}[place, method]

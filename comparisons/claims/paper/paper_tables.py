"""
The paper's Tables 1 to 5, remade: each printed number, ours where there is one, and what the two have in common.

One rule decides. A printed number and ours are comparable where they measure the same in the same situation: no row is,
since the paper prints none of its maps. Where the measure is the same, ours from a reconstructed map stands beside it,
and the row says what differs. Where not even the measure is, ours is left out.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum

from cgla_graph.comparisons.claims.artefact import Artefact, Comparison, TableRow
from cgla_graph.comparisons.claims.claim import require
from cgla_graph.comparisons.claims.paper.figure_page import SELECTED
from cgla_graph.comparisons.claims.paper.printed_values import (
    TABLE_1,
    TABLE_2,
    TABLE_3,
    TABLE_4,
    TABLE_5,
    WORKING_SCALE,
    PaperValue,
)
from cgla_graph.comparisons.claims.paper.routes import Way, Ways, arrived, escape, fly, of_weights, planned

#: Planners in the style of the paper's, by its names for them.
STYLES: Mapping[str, str] = {"CGLA": "cgla", "FBCRI": "fbcri-style", "CPVS": "cpvs-style"}
_TEAM = (
    "Starts, goal and K = 10 are the paper's; the map of five threats is ours. FBCRI and CPVS are not public: ours are "
    "planners in their style. Online, the three share what they see and keep apart by virtual obstacles; offline, each "
    "plans alone with the whole map known."
)


class Reason(Enum):
    """
    Why a printed number and ours are not comparable; the value is the sentence.

    Examples
    --------
    >>> Reason.QUOTED_RISK.same_measure, Reason.OTHER_MAP.same_measure
    (False, True)
    """

    OTHER_MAP = "another map, as the paper's is not printed; F summed over steps of 0.02, the reading that fits it (E5)"
    OTHER_UNIT = (
        f"another map, and the paper's unit is not printed: ours at {WORKING_SCALE:g} a side, a working reading"
    )
    OTHER_PLANNER = "another map, and ours is of a planner in its style; F summed over steps of 0.02 (E5)"
    OTHER_PLANNER_AND_UNIT = (
        f"another map, and ours is of a planner in its style, at {WORKING_SCALE:g} a side, a working reading"
    )
    QUOTED_RISK = "quoted from its own paper: another measure on another map, so ours is left out"
    QUOTED_LENGTH = "quoted from its own paper, and re-scaled by a factor that is not printed: ours is left out"

    @property
    def same_measure(self) -> bool:
        """Whether the two measure the same, if in different situations."""
        return self not in {Reason.QUOTED_RISK, Reason.QUOTED_LENGTH}


def reason(row: PaperValue, quantity: str) -> Reason:
    """
    Say what keeps a printed number and ours from being comparable.

    Parameters
    ----------
    row
        Of the paper's table.
    quantity
        ``risk sum`` or ``length``.

    Examples
    --------
    >>> [reason(row, "risk sum").name for row in (TABLE_1[0], TABLE_1[3])]
    ['QUOTED_RISK', 'OTHER_MAP']
    """
    is_risk = quantity == "risk sum"
    if not row.own_risk:
        return Reason.QUOTED_RISK if is_risk else Reason.QUOTED_LENGTH
    if row.method.startswith("CGLA"):
        return Reason.OTHER_MAP if is_risk else Reason.OTHER_UNIT
    return Reason.OTHER_PLANNER if is_risk else Reason.OTHER_PLANNER_AND_UNIT


def rows(table: Sequence[PaperValue], ours: Mapping[str, Ways]) -> list[TableRow]:
    """
    Put ours beside the printed numbers of a table, where that does not mislead.

    Parameters
    ----------
    table
        The paper's rows.
    ours
        Our ways, by the paper's name of the method; of those that are quoted none is taken.

    Raises
    ------
    KeyError
        If there is none for a method that was not quoted.
    """
    return [made for row in table for made in _rows(row, ours)]


def _rows(row: PaperValue, ours: Mapping[str, Ways]) -> Iterator[TableRow]:
    for quantity, printed in (("risk sum", row.risk), ("length", row.length)):
        if math.isnan(printed):
            continue
        why = reason(row, quantity)
        offline = online = None
        if why.same_measure:
            way = ours[row.method]
            online = _measured(way.online, quantity)
            offline = None if way.offline is None else _measured(way.offline, quantity)
        yield TableRow(row.method, quantity, printed, offline, online, comparable=False, why=why.value)


def _measured(way: Way, quantity: str) -> float:
    """Return risk sum or length, the latter in the working reading of the paper's unit."""
    return way.risk_sum if quantity == "risk sum" else way.length * WORKING_SCALE


def table_1() -> Comparison:
    """Fill Table 1: one UAV."""
    found = of_weights([10.0, 50.0, 200.0])
    _, k50, k200 = found
    risks = [way.online.risk_sum for way in found]
    require(risks == sorted(risks, reverse=True), "Table 1: risk does not fall with K")
    require(k200.online.length < k50.online.length, "Table 1: K = 200 flies farther than K = 50")
    return Comparison(
        "One UAV from (0.1, 0.1) to (0.9, 0.9). In the paper risk falls with K, and K = 200 is shorter than K = 50, "
        "which no optima with full information can be. So it is in our flights, and not offline. " + SELECTED,
        rows(TABLE_1, {f"CGLA, {way.label}": way for way in found}),
    )


def table_2() -> Comparison:
    """Fill Table 2: a sudden threat."""
    found = escape().ways
    low, high = (way.online for way in found)
    require(high.length > low.length and high.risk_sum < low.risk_sum, "Table 2: K = 100 is not longer and safer")
    return Comparison(
        "The way that is left when a threat appears at (0.6, 0.5). Where the UAV is then is not printed: ours is at "
        "(0.5, 0.4). In both K = 100 is longer and less risky than K = 10. Map, spread and radius are ours.",
        rows(TABLE_2, {f"CGLA, {way.label}": way for way in found}),
    )


def table_3() -> Comparison:
    """Fill Table 3: with and without sharing."""
    ours = {}
    for view in fly("fig9"):
        flight = view.flight.uavs["a"]
        best = planned(view.mission.world.field_at(0), k=flight.uav.k, start=flight.uav.start)
        ours[f"CGLA, {view.variant}"] = Ways(view.variant, best, arrived(flight))
    return Comparison(
        "The UAV that profits from what the other one sees. With the whole map known there is nothing to share: "
        "one way stands in both rows. Two threats, starts and goal are the paper's; all else, K = 70 too, is ours.",
        rows(TABLE_3, ours),
    )


def table_4() -> Comparison:
    """Fill Table 4: risks of three UAVs."""
    return Comparison(f"Risk of three UAVs. {_TEAM}", rows(TABLE_4, _team(TABLE_4)))


def table_5() -> Comparison:
    """Fill Table 5: lengths of three UAVs."""
    return Comparison(f"Length of the ways of three UAVs. {_TEAM}", rows(TABLE_5, _team(TABLE_5)))


def _team(table: Sequence[PaperValue]) -> dict[str, Ways]:
    """Fly the mission of Fig. 10 with each method of a table; plan each UAV's way with the whole map known."""
    ours = {}
    for method in dict.fromkeys(row.method.split(",")[0] for row in table):
        solver = STYLES[method]
        (view,) = fly("fig10", solver=solver)
        field = view.mission.world.field_at(0)
        for name, flight in view.flight.uavs.items():
            best = planned(field, k=flight.uav.k, start=flight.uav.start, solver=solver)
            label = f"{method}, UAV {name}"
            ours[label] = Ways(label, best, arrived(flight))
    return ours


ARTEFACTS: tuple[Artefact, ...] = (
    Artefact("table-1", "Table 1", "one UAV: CGLA, BCV, A2D and Q-Learning", table_1),
    Artefact("table-2", "Table 2", "a sudden threat", table_2),
    Artefact("table-3", "Table 3", "with and without sharing", table_3),
    Artefact("table-4", "Table 4", "risk of three UAVs", table_4),
    Artefact("table-5", "Table 5", "length of the ways of three UAVs", table_5),
)

"""
The paper's Tables 1 to 5, remade: each printed number, ours where there is one, and what the two have in common.

One rule decides. A printed number and ours are comparable where they measure the same in the same situation: no row is,
since the paper prints none of its maps. Where the measure is the same, ours from a reconstructed map stands beside it,
and the row says what differs. Where not even the measure is, ours is left out of the row. What our planners in the
style of those do on our map stands in a table of its own, with nothing of the paper's in it.
"""

from collections.abc import Mapping, Sequence
from enum import Enum

from cgla_graph.comparisons.claims.artefact import Comparison, TableRow, artefact
from cgla_graph.comparisons.claims.claim import require
from cgla_graph.comparisons.claims.figures.figure_page import SELECTED
from cgla_graph.comparisons.claims.paper.printed_values import (
    TABLE_1,
    TABLE_2,
    TABLE_3,
    TABLE_4,
    TABLE_5,
    WORKING_SCALE,
    PaperValue,
)
from cgla_graph.comparisons.claims.paper.routes import Route, Routes, escape, fly, for_weights, of_flight
from cgla_graph.comparisons.claims.paper.sweeps import TABLE_1_SETUPS, on_paper_map

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
    Say what keeps a printed number, ``risk sum`` or ``length``, and ours from being comparable.

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


def rows(table: Sequence[PaperValue], ours: Mapping[str, Routes]) -> list[TableRow]:
    """
    Put ours beside the printed numbers of a table, where that does not mislead.

    Raises
    ------
    KeyError
        If there are no routes of ours, by the paper's name of the method, for one that was not quoted.
    """
    found = []
    printed = [(row, quantity) for row in table for quantity in row.printed]
    for row, quantity in printed:
        why = reason(row, quantity)
        offline = online = None
        if why.same_measure:
            offline, online = (
                _measured(route, quantity) for route in (ours[row.method].offline, ours[row.method].online)
            )
        found.append(
            TableRow(row.method, quantity, row.printed[quantity], offline, online, comparable=False, why=why.value)
        )
    return found


def _measured(route: Route | None, quantity: str) -> float | None:
    """Return risk sum or length, the latter in the working reading of the paper's unit."""
    if route is None:
        return None
    return route.risk_sum if quantity == "risk sum" else route.length * WORKING_SCALE


@artefact("Table 1", "one UAV: CGLA, BCV, A2D and Q-Learning")
def _table_1() -> Comparison:
    found = for_weights([10.0, 50.0, 200.0])
    k10, k50, k200 = (one.online for one in found)
    require(k10.risk_sum >= k50.risk_sum >= k200.risk_sum, "Table 1: risk does not fall with K")
    require(k200.length < k50.length, "Table 1: K = 200 flies farther than K = 50")
    return Comparison(
        "One UAV from (0.1, 0.1) to (0.9, 0.9). In the paper risk falls with K, and K = 200 is shorter than K = 50, "
        "which no optima with full information can be. So it is in our flights, and not offline. Below it are flights "
        "and plans of ours alone: nothing there is comparable with the rows of BCV, A2D and Q-Learning. " + SELECTED,
        rows(TABLE_1, {f"CGLA, {one.label}": one for one in found}),
        (on_paper_map(TABLE_1_SETUPS),),
    )


@artefact("Table 2", "a sudden threat")
def _table_2() -> Comparison:
    found = escape().routes
    low, high = (one.online for one in found)
    require(high.length > low.length and high.risk_sum < low.risk_sum, "Table 2: K = 100 is not longer and safer")
    return Comparison(
        "The way that is left when a threat appears at (0.6, 0.5). Where the UAV is then is not printed: ours is at "
        "(0.5, 0.4). In both K = 100 is longer and less risky than K = 10. Map, spread and radius are ours.",
        rows(TABLE_2, {f"CGLA, {one.label}": one for one in found}),
    )


@artefact("Table 3", "with and without sharing")
def _table_3() -> Comparison:
    return Comparison(
        "The UAV that profits from what the other one sees. With the whole map known there is nothing to share: "
        "one way stands in both rows. Two threats, starts and goal are the paper's; all else, K = 70 too, is ours.",
        rows(TABLE_3, {f"CGLA, {run.variant}": of_flight(run.variant, run, "a") for run in fly("fig9")}),
    )


@artefact("Table 4", "risk of three UAVs")
def _table_4() -> Comparison:
    return Comparison(f"Risk of three UAVs. {_TEAM}", rows(TABLE_4, _team(TABLE_4)))


@artefact("Table 5", "length of the ways of three UAVs")
def _table_5() -> Comparison:
    return Comparison(f"Length of the ways of three UAVs. {_TEAM}", rows(TABLE_5, _team(TABLE_5)))


def _team(table: Sequence[PaperValue]) -> dict[str, Routes]:
    """Fly the mission of Fig. 10 with each method of a table; plan each UAV's route with the whole map known."""
    ours = {}
    for method in dict.fromkeys(row.method.split(",")[0] for row in table):
        (run,) = fly("fig10", solver=STYLES[method])
        for name in run.flight.uavs:
            label = f"{method}, UAV {name}"
            ours[label] = of_flight(label, run, name, solver=STYLES[method])
    return ours

"""
The paper's Tables 1 to 5, remade: each printed number beside ours.

No printed number and ours are comparable, since the paper prints none of its maps. Where the measure is the same, ours
from a reconstructed map stands beside it, and the row says what differs; of a number that the paper quotes from
another paper even the measure differs, and ours is left out.
"""

from collections.abc import Mapping, Sequence

from cgla_graph.comparisons.claims.artefact import Content, artefact
from cgla_graph.comparisons.claims.claim import Entry, Table
from cgla_graph.comparisons.claims.figures.figure_page import SELECTED
from cgla_graph.comparisons.claims.paper.printed_values import TABLES, WORKING_SCALE, PaperValue
from cgla_graph.comparisons.claims.paper.routes import Route, Routes, escape, for_weights, of_flight, runs_of

#: Planners in the style of the paper's, by its names for them.
STYLES: Mapping[str, str] = {"CGLA": "cgla", "FBCRI": "fbcri-style", "CPVS": "cpvs-style"}
_TEAM = (
    "Starts, goal and K = 10 are the paper's; the map of five threats is ours. FBCRI and CPVS are not public: ours are "
    "planners in their style. Flown, the three share what they see and keep apart by virtual obstacles; with all "
    "known, each plans alone."
)
_COLUMNS = ("method", "quantity", "paper", "ours, all known", "ours, flown", "what differs")


def difference(row: PaperValue, quantity: str) -> str:
    """Say what differs between a printed number, ``risk sum`` or ``length``, and ours."""
    if not row.own_risk:
        same = "another measure on another map" if quantity == "risk sum" else "re-scaled by a factor not printed"
        return f"quoted from its own paper: {same}, so ours is left out"
    words = ["another map"]
    if not row.method.startswith("CGLA"):
        words.append("a planner in its style")
    if quantity == "risk sum":
        words.append("F summed over steps of 0.02 (E5)")
    else:
        words.append(f"unit not printed, ours at {WORKING_SCALE:g} a side")
    return ", ".join(words)


def remade(place: str, ours: Mapping[str, Routes]) -> Table:
    """
    Put ours beside the printed numbers of a table, where that does not mislead.

    Raises
    ------
    KeyError
        If there are no routes of ours, by the paper's name of the method, for one that was not quoted.
    """
    rows: list[Sequence[Entry]] = []
    for row in (one for one in TABLES if one.place == place):
        for quantity, printed in (("risk sum", row.risk), ("length", row.length)):
            if printed == printed:  # noqa: PLR0124 - NaN is not printed
                own = (ours[row.method].offline, ours[row.method].online) if row.own_risk else (None, None)
                sizes = [None if one is None else _measured(one, quantity) for one in own]
                rows.append((row.method, quantity, f"{printed:.9g}", *sizes, difference(row, quantity)))
    return Table(f"{place}, remade", _COLUMNS, rows)


def _measured(route: Route, quantity: str) -> float:
    """Return risk sum or length, the latter in the working reading of the paper's unit."""
    return route.risk_sum if quantity == "risk sum" else route.length * WORKING_SCALE


@artefact("Table 1", "one UAV: CGLA, BCV, A2D and Q-Learning")
def _table_1() -> Content:
    found = for_weights()
    caption = (
        "One UAV from (0.1, 0.1) to (0.9, 0.9). In the paper risk falls with K, and K = 200 is shorter than K = 50, "
        f"which no optima with full information can be. {SELECTED}"
    )
    return Content(caption, table=remade("Table 1", {f"CGLA, {one.label}": one for one in found}))


@artefact("Table 2", "a sudden threat")
def _table_2() -> Content:
    caption = (
        "The way that is left when a threat appears at (0.6, 0.5). Where the UAV is then is not printed: ours is at "
        "(0.5, 0.4). Map, spread and radius are ours."
    )
    return Content(caption, table=remade("Table 2", {f"CGLA, {one.label}": one for one in escape().routes}))


@artefact("Table 3", "with and without sharing")
def _table_3() -> Content:
    caption = (
        "The UAV that profits from what the other one sees. With the whole map known there is nothing to share: one "
        "way stands in both rows. Two threats, starts and goal are the paper's; all else, K = 70 too, is ours."
    )
    ours = {f"CGLA, {run.variant}": of_flight(run.variant, run, "a") for run in runs_of("fig9")}
    return Content(caption, table=remade("Table 3", ours))


@artefact("Table 4", "risk of three UAVs")
def _table_4() -> Content:
    return Content(f"Risk of three UAVs. {_TEAM}", table=remade("Table 4", _team("FBCRI", "CGLA")))


@artefact("Table 5", "length of the ways of three UAVs")
def _table_5() -> Content:
    return Content(f"Lengths of three UAVs. {_TEAM}", table=remade("Table 5", _team("FBCRI", "CPVS", "CGLA")))


def _team(*methods: str) -> dict[str, Routes]:
    """Fly the mission of Fig. 10 with each method; plan each UAV's route with the whole map known."""
    ours = {}
    for method in methods:
        (run,) = runs_of("fig10", solver=STYLES[method])
        for name in run.flight.uavs:
            label = f"{method}, UAV {name}"
            ours[label] = of_flight(label, run, name, solver=STYLES[method])
    return ours

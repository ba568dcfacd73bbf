"""The table of sudden threats: flights on which a threat comes up a step after the start, near the UAV."""

from typing import Any

import numpy as np

from cgla_graph._types import Point
from cgla_graph.comparisons.claims.experiment import Record, experiment, on_diagonal
from cgla_graph.comparisons.claims.panel.flights import flight_measures, fly
from cgla_graph.comparisons.claims.panel.settings import RULES, SPREADS, Panel, PanelMap
from cgla_graph.mission.records import MissionStatus, UavFlight
from cgla_graph.mission.world import TimedThreat
from cgla_graph.model.risk import RiskField, Threat

#: Where the UAV begins and where the threat of Fig. 6 comes up, map units. Where the UAV is then, the paper does not
#: say: here a step from its start, 0.12 away.
POPUP_START: Point = (0.5, 0.4)
POPUP: Point = (0.6, 0.5)
#: The tick on which threats come up.
APPEARS = 1
#: The lesser risk weight of Table 2, and those that it is compared with; the paper's is 100.
LOW_K = 10.0
HIGH_KS = (50.0, 100.0, 200.0)
#: How many spreads ahead of the UAV other threats come up.
SPREADS_AHEAD = (1.0, 2.0, 3.0)


def weights_of(panel: Panel) -> tuple[float, tuple[float, ...]]:
    """Return the least risk weight, and those that it is compared with."""
    low, *high = panel.levels("k", (LOW_K, *HIGH_KS))
    return low, tuple(high)


@experiment("sudden-threats", kinds=on_diagonal)
def sudden_threats(map_: PanelMap) -> list[Record]:
    """Have a threat come up at (0.6, 0.5), as in Fig. 6, or straight ahead; it is as broad as the map's threats are."""
    field = map_.drawn(start=POPUP_START)
    spread = sum(SPREADS[map_.kind.spread]) / 2.0
    fig_6 = Threat(*POPUP, spread)
    records: list[Record] = []
    for radius in map_.panel.levels("radius"):
        records += _weights_compared(map_, field, fig_6, {"radius": radius})
        for k in map_.panel.levels("k"):
            records += _ahead(map_, field, spread, radius, k)
    for base in map_.bases:
        for name, value in RULES.items():
            cell = {"radius": base["radius"], "varied": f"{name} {value}"}
            records += _weights_compared(map_, field, fig_6, cell, **{name: value})
    return [{**map_.levels, **record} for record in records]


def _weights_compared(
    map_: PanelMap,
    field: RiskField,
    threat: Threat,
    cell: Record,
    **rules: Any,  # noqa: ANN401 - as `Mission` takes them
) -> list[Record]:
    """Fly under the lesser risk weight and under each greater one: two records for each pair."""
    low, greater = weights_of(map_.panel)
    flown = {k: _fly(map_, field, k, cell["radius"], threat, **rules) for k in (low, *greater)}
    return [
        {"event": "Fig. 6", "varied": "", **cell, "high": high, "k": k, **flight_measures(flown[k], k)}
        for high, k in ((high, k) for high in greater for k in (low, high))
    ]


def _ahead(map_: PanelMap, field: RiskField, spread: float, radius: float, k: float) -> list[Record]:
    """Compare how much is met of threats straight ahead with what is met if the flight goes on as without them."""
    undisturbed = _fly(map_, field, k, radius)
    records: list[Record] = []
    for ahead in SPREADS_AHEAD:
        threat = straight_ahead(undisturbed, ahead, spread)
        cell = {"event": "ahead", "varied": "", "radius": radius, "k": k, "ahead": ahead}
        for evades, flight in ((True, _fly(map_, field, k, radius, threat)), (False, undisturbed)):
            arrived = flight.status is MissionStatus.ARRIVED
            met = risk_of(threat, flight) if arrived else None
            records.append({**cell, "evades": evades, "arrived": arrived, "met": met})
    return records


def _fly(
    map_: PanelMap,
    field: RiskField,
    k: float,
    radius: float,
    threat: Threat | None = None,
    **rules: Any,  # noqa: ANN401 - as `Mission` takes them
) -> UavFlight:
    timed = [TimedThreat(threat, appears=APPEARS)] if threat else []
    return fly({"a": POPUP_START}, field, map_.goal, k=k, radius=radius, timed=timed, **rules).uavs["a"]


def straight_ahead(flight: UavFlight, ahead: float, spread: float) -> Threat:
    """Place a threat so many spreads ahead of where a UAV is when threats come up; `spread` in map units."""
    before, at = flight.trace[APPEARS - 1 : APPEARS + 1]
    heading = (at - before) / np.hypot(*(at - before))
    x, y = (at + ahead * spread * heading).tolist()
    return Threat(x, y, spread)


def risk_of(threat: Threat, flight: UavFlight) -> float:
    """Return the line integral of one threat along a flight from the tick on which threats come up."""
    rest = flight.path[flight.times >= APPEARS - 1e-9]
    return float(RiskField([threat]).line_integral(rest[:-1], rest[1:]).sum())

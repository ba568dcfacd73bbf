"""The table of single UAVs: CGLA, the paper's rivals and eight directions, planned with all known and flown."""

from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import CGLA, Flights, Setup, settings_of, setup, setup_name
from cgla_graph.comparisons.claims.panel.settings import PanelMap

EIGHT = setup("eight-direction")
#: BCV as the paper describes it, with nothing but the length in its objective, and with the toolkit's risk aversion.
BCV, BCV_AVERSE = setup("bcv-style", risk_aversion=0.0), setup("bcv-style")
A2D = setup("a2d-style")
#: Planners that weigh risk by K.
HEED_K = (CGLA, EIGHT)
#: Planners that fly in every cell.
FLOWN: tuple[Setup, ...] = (CGLA, EIGHT, BCV, BCV_AVERSE, A2D)
#: Constants of planners that are ours, varied one at a time: what each stands for in records, with the planner's name
#: in all cells.
CONSTANTS: tuple[tuple[Setup, Setup], ...] = (
    *((BCV, setup("bcv-style", risk_aversion=0.0, avoid_spreads=value)) for value in (2.0, 4.0, 5.0)),
    *((BCV_AVERSE, setup("bcv-style", avoid_spreads=value)) for value in (2.0, 4.0, 5.0)),
    *((A2D, setup("a2d-style", threshold=value)) for value in (0.03, 0.01)),
)


@experiment("single-uav")
def single_uav(map_: PanelMap) -> list[Record]:
    """Plan with all known, fly in all cells of a map, and vary rules and constants from its base cells, for all K."""
    flights = Flights(map_)
    records: list[Record] = [
        {"mode": "known", "planner": of[0], "k": k, **flights.planned(of, k)}
        for of in HEED_K
        for k in map_.panel.levels("k")
    ]
    for one in settings_of(map_, FLOWN, CONSTANTS):
        cell = {"radius": one.radius, "k": one.k}
        measured = flights.flown(one.flown, heeds_k=one.of in HEED_K, **cell, **one.rules)
        records.append({"mode": "flown", "planner": setup_name(one.of), **cell, "varied": one.varied, **measured})
    return [{**map_.levels, **record} for record in records]

"""The table of single UAVs: CGLA, the paper's rivals and eight directions, planned with all known and flown."""

from itertools import product
from typing import Any

from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import Flights, Setup, setup, setup_name
from cgla_graph.comparisons.claims.panel.settings import FACTORS, RULES, Case, PanelMap

CGLA = setup("cgla")
EIGHT = setup("eight-direction")
#: BCV as the paper describes it, with nothing but the length in its objective, and with the toolkit's risk aversion.
BCV, BCV_AVERSE = setup("bcv-style", risk_aversion=0.0), setup("bcv-style")
A2D, FBCRI, CPVS = setup("a2d-style"), setup("fbcri-style"), setup("cpvs-style")
#: Planners that weigh risk by K.
HEED_K = (CGLA, EIGHT)
#: Planners that fly in every cell.
FLOWN: tuple[Setup, ...] = (CGLA, EIGHT, BCV, BCV_AVERSE, A2D, FBCRI, CPVS)
#: Constants of planners that are ours, varied one at a time: what each stands for in records, with the planner's name
#: in all cells.
CONSTANTS: tuple[tuple[Setup, Setup], ...] = (
    *((BCV, setup("bcv-style", risk_aversion=0.0, avoid_spreads=value)) for value in (2.0, 4.0, 5.0)),
    *((BCV_AVERSE, setup("bcv-style", avoid_spreads=value)) for value in (2.0, 4.0, 5.0)),
    *((A2D, setup("a2d-style", threshold=value)) for value in (0.03, 0.01)),
    *((FBCRI, setup("fbcri-style", tolerance=value)) for value in (0.1, 0.005, 0.001)),
    *((CPVS, setup("cpvs-style", tolerance=value)) for value in (0.1, 0.005, 0.001)),
)


@experiment("single-uav")
def single_uav(map_: PanelMap) -> list[Record]:
    """Plan with all known, fly in all cells of a map, and vary rules and constants from its base cells, for all K."""
    flights = Flights(map_)
    records: list[Record] = [
        {"mode": "known", "planner": of[0], "k": k, **flights.planned(of, k)} for of in HEED_K for k in FACTORS["k"]
    ]
    for radius in FACTORS["radius"]:
        for k in FACTORS["k"]:
            records += [_flown(flights, of, of, {"radius": radius, "k": k}) for of in FLOWN]
    for base, k in product(map_.bases, FACTORS["k"]):
        cell = {"radius": base["radius"], "k": k}
        for name, value in RULES.items():
            records += [_flown(flights, of, of, cell, f"{name} {value}", **{name: value}) for of in FLOWN]
        for of, changed in CONSTANTS:
            pair = ((CGLA, CGLA), (of, changed))
            records += [_flown(flights, one, flown, cell, setup_name(changed)) for one, flown in pair]
    return [{**map_.levels, **record} for record in records]


def _flown(flights: Flights, of: Setup, flown: Setup, cell: Case, varied: str = "", **rules: Any) -> Record:  # noqa: ANN401
    """Fly a planner in a cell, in varied settings that are recorded beside it."""
    heeds_k = of in HEED_K
    # only a graph solver weighs segments, and has nearest points to begin from
    rules = rules if of == CGLA else {}
    measured = flights.flown(flown, heeds_k=heeds_k, **cell, **rules)
    return {"mode": "flown", "planner": setup_name(of), **cell, "varied": varied, **measured}

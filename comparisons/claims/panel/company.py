"""Three UAVs that share what they see (Section 5.2): CGLA, FBCRI-style and CPVS-style."""

import math
from itertools import product
from typing import Any

from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import MAX_TICKS, Setup, flight_measures, fly, setup, setup_name
from cgla_graph.comparisons.claims.panel.settings import FACTORS, RULES, STARTS, PanelMap
from cgla_graph.comparisons.claims.panel.single_uav import CGLA, CPVS, FBCRI
from cgla_graph.mission.records import Flight
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import CLEAR
from cgla_graph.solvers import get

COMPANY: tuple[Setup, ...] = (CGLA, FBCRI, CPVS)
#: UAVs by name, with where they begin.
UAVS = {f"UAV {number}": start for number, start in enumerate(STARTS, 1)}
#: Constants of planners that are ours, varied one at a time; the tolerance is 0.02 otherwise.
CONSTANTS: tuple[tuple[Setup, Setup], ...] = (
    *((of, setup(of[0], tolerance=value)) for of in (FBCRI, CPVS) for value in (0.1, 0.005, 0.001)),
    (CPVS, setup("cpvs-style", onward=False)),
)


@experiment("company", share=0.35)
def company(map_: PanelMap) -> list[Record]:
    """Fly three UAVs in all cells of a map, and vary rules and constants from its base cells, for all K."""
    team = _Team(map_)
    records: list[Record] = []
    for radius, k in product(FACTORS["radius"], FACTORS["k"]):
        for of in COMPANY:
            records += team.records(of, of, radius, k)
    for base, k in product(map_.bases, FACTORS["k"]):
        radius = base["radius"]
        for name, value in RULES.items():
            for of in COMPANY:
                records += team.records(of, of, radius, k, f"{name} {value}", **{name: value})
        for of, changed in CONSTANTS:
            for one, flown in ((CGLA, CGLA), (of, changed)):
                records += team.records(one, flown, radius, k, setup_name(changed))
    return records


def without_those_at_starts(threats: RiskField) -> RiskField:
    """Leave out threats that are as near to one of the starts as none of a random map is to its own."""
    return RiskField(
        threat for threat in threats.threats if all(math.dist((threat.x, threat.y), start) >= CLEAR for start in STARTS)
    )


class _Team:
    """Flights of three UAVs on a map; each is flown once."""

    def __init__(self, map_: PanelMap) -> None:
        self._map, self._threats = map_, without_those_at_starts(map_.field)
        self._flown: dict[Any, Flight] = {}

    def records(self, of: Setup, flown: Setup, radius: float, k: float, varied: str = "", **rules: Any) -> list[Record]:  # noqa: ANN401
        """Fly a planner, in varied settings that are recorded beside it; a record for each UAV."""
        # only a graph solver weighs segments, and has nearest points to begin from; FBCRI-style weighs nothing by K
        rules = rules if of == CGLA else {}
        key = (flown, radius, None if of == FBCRI else k, tuple(rules.items()))
        if key not in self._flown:
            limits = {"max_ticks": MAX_TICKS, "collisions": "record", **rules}
            solver = get(flown[0], **dict(flown[1]))
            self._flown[key] = fly(UAVS, self._threats, self._map.goal, solver, k=k, radius=radius, **limits)
        case = {**self._map.levels, "planner": setup_name(of), "radius": radius, "k": k, "varied": varied}
        return [{**case, "uav": uav, **flight_measures(one, k)} for uav, one in self._flown[key].uavs.items()]

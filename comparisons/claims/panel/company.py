"""Three UAVs that share what they see (Section 5.2): CGLA, FBCRI-style and CPVS-style."""

import math
from typing import Any

from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import (
    CGLA,
    MAX_TICKS,
    Flown,
    Setup,
    flight_measures,
    fly,
    settings_of,
    setup,
    setup_name,
)
from cgla_graph.comparisons.claims.panel.settings import STARTS, PanelMap
from cgla_graph.mission.records import Flight
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import CLEAR
from cgla_graph.solvers import get

FBCRI, CPVS = setup("fbcri-style"), setup("cpvs-style")
COMPANY: tuple[Setup, ...] = (CGLA, FBCRI, CPVS)
#: UAVs by name, with where they begin.
UAVS = {f"UAV {number}": start for number, start in enumerate(STARTS, 1)}
#: Without virtual obstacles SD decides nothing, but a large one would keep UAVs on the ground, map units.
SAFE_DISTANCE = 0.2
#: Constants of planners that are ours, varied one at a time; the tolerance is 0.02 otherwise.
CONSTANTS: tuple[tuple[Setup, Setup], ...] = (
    *((of, setup(of[0], tolerance=value)) for of in (FBCRI, CPVS) for value in (0.1, 0.005, 0.001)),
    (CPVS, setup("cpvs-style", onward=False)),
)


@experiment("company", share=0.35)
def company(map_: PanelMap) -> list[Record]:
    """Fly three UAVs in all cells of a map, and vary rules and constants from its base cells, for all K."""
    team = _Team(map_)
    return [record for one in settings_of(map_, COMPANY, CONSTANTS) for record in team.records(one)]


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

    def records(self, one: Flown) -> list[Record]:
        """Fly a planner in a cell or in varied settings; a record for each UAV."""
        # FBCRI-style weighs nothing by K
        key = (one.flown, one.radius, None if one.of == FBCRI else one.k, tuple(one.rules.items()))
        if key not in self._flown:
            limits = {"max_ticks": MAX_TICKS, "collisions": "record", **one.rules}
            solver = get(one.flown[0], **dict(one.flown[1]))
            how = {"k": one.k, "radius": one.radius, "safe_distance": min(0.5 * one.radius, SAFE_DISTANCE), **limits}
            self._flown[key] = fly(UAVS, self._threats, self._map.goal, solver, **how)
        case = {"planner": setup_name(one.of), "radius": one.radius, "k": one.k, "varied": one.varied}
        flights = self._flown[key].uavs.items()
        return [{**self._map.levels, **case, "uav": uav, **flight_measures(of, one.k)} for uav, of in flights]

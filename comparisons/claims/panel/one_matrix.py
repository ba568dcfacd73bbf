"""The table of one matrix for all UAVs against a matrix each, where what is seen is told late."""

from itertools import product

import numpy as np

from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import team_measures
from cgla_graph.comparisons.claims.panel.settings import PanelMap
from cgla_graph.comparisons.claims.panel.teams import clear_field, fly_two, fraction, half, varied
from cgla_graph.mission.agent import Agent
from cgla_graph.mission.belief import Belief, Report, sightings
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.simulation import Simulation

#: Ticks from a sighting to the plans of others, or of all on one matrix: in 10, a UAV flies 0.2.
DELAYS = (2, 5, 10)


class OneMatrix(Simulation):
    """
    A mission in which all UAVs plan on one matrix, which hears late of what they see.

    A UAV has sensors, but no matrix of its own: what it sees counts in its plans only when the matrix has it.

    Parameters
    ----------
    mission
        The mission; its rule of sharing does not matter.
    delay
        Ticks from a sighting to the plans.
    """

    def __init__(self, mission: Rules, delay: int) -> None:
        super().__init__(mission)
        self._delay = delay
        self._seen = Belief()
        self._under_way: list[tuple[int, list[Report]]] = []

    def _sense(self, agent: Agent) -> None:
        radius, position = agent.uav.detection_radius, np.array([agent.position])
        seen = sightings(self.mission.world, self.tick, self._seen, position, radius, agent.number)
        self._under_way.append((self.tick + self._delay, self._seen.hear(seen)))

    def _share(self) -> None:
        for due, reports in self._under_way:
            if due == self.tick:
                for agent in self._agents:
                    agent.belief.hear(reports)
        super()._share()


def fly_on_one_matrix(mission: Rules, delay: int) -> Flight:
    """Fly a mission on one matrix for all UAVs, which they reach with a delay."""
    simulation = OneMatrix(mission, delay)
    while not simulation.is_over:
        simulation.advance()
    return simulation.flight()


@experiment("one-matrix", kinds=half, share=0.5)
def one_matrix(map_: PanelMap) -> list[Record]:
    """Fly on one matrix and on a matrix each, in some cells of a map; vary rules where it has a base cell."""
    threats = clear_field(map_, map_.kind.threats)
    records: list[Record] = []
    settings = fraction(half(map_.panel).index(map_.kind), map_.panel)
    met = dict.fromkeys((case["radius"], case["k"]) for case in settings)
    cases = [{"radius": radius, "k": k} for radius, k in met]
    for (case, rules, name), delay in product(varied(map_, cases), DELAYS):
        each = fly_two(map_, threats, sharing=Sharing(delay=delay), **case, **rules)
        of = {**map_.levels, **case, "varied": name, "delay": delay}
        for matrices, flight in {"each": each, "one": fly_on_one_matrix(each.mission, delay)}.items():
            records.append({**of, "matrices": matrices, **team_measures(flight)})
    return records

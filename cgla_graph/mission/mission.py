"""A mission: UAVs that see only what is near, tell each other, keep their distance and plan again on the way."""

from collections.abc import Callable
from dataclasses import dataclass

from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.simulation import Simulation, fly


@dataclass(frozen=True, eq=False)
class Mission(Rules):
    """
    UAVs, the world they fly in, and the rules, ready to be flown.

    All settings are those of `Rules`: ``world, uavs, solver, resolution, sharing, fusion, integral, knowledge,
    virtual_obstacle, avoidance, replan, exclude, movement, start, update, arrival_radius, collision_distance,
    collisions, terminal_radius, max_ticks, incremental``.

    Raises
    ------
    MissionError
        As `Rules` does, if a setting is malformed or two do not go together.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> from cgla_graph.solvers import get
    >>> from cgla_graph.mission.uav import Uav
    >>> from cgla_graph.mission.world import World
    >>> world = World(RiskField([Threat(0.5, 0.5, 0.1)]), bounds=(0, 0, 1, 1))
    >>> uav = Uav("a", start=(0.1, 0.1), goal=(0.9, 0.9), detection_radius=0.2)
    >>> flight = Mission(world, [uav], get("cgla"), resolution=20).fly()
    >>> flight.uavs["a"].status.label, flight.uavs["a"].length > 0.8 * 2**0.5
    ('arrived', True)
    """

    def simulate(self) -> Simulation:
        """Return the mission at tick 0, to be flown tick by tick."""
        return Simulation(self)

    def fly(self, watch: Callable[[int], None] | None = None) -> Flight:
        """
        Fly the mission to its end.

        Parameters
        ----------
        watch
            Called with each tick that is done.

        Returns
        -------
        flight
            What it came to. Same mission, same flight: all but the seconds of planning.
        """
        return fly(self, watch)

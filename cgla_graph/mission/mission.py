"""Mission: UAVs with limited sensing that share what they see, keep their distance and replan on the way."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from cgla_graph._text import shown
from cgla_graph._validate import non_negative_number
from cgla_graph.errors import MissionError
from cgla_graph.fusion.fusion import Fusion, Integral
from cgla_graph.mission import rules
from cgla_graph.mission.checks import check
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.simulation import Simulation, fly
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.validate import error_context, whole_tick
from cgla_graph.mission.virtual_obstacle import UNITS_A_STEP, VirtualObstacle
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solver import Solver


@dataclass(frozen=True, eq=False, init=False)
class Mission(Rules):
    """
    UAVs, the world they fly in, and the rules, ready to be flown.

    All settings are those of `Rules`. They are read and checked once, and kept in full: a `Sharing` instead of
    ``"none"``, map units instead of None. So `dataclasses.replace` keeps `collision_distance`, `terminal_radius` and
    `max_ticks`; where a new map or lattice needs others, replace them by None as well.

    Raises
    ------
    MissionError
        If a setting is malformed, or two do not go together.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> from cgla_graph.solvers import get
    >>> world = World(RiskField([Threat(0.5, 0.5, 0.1)]), bounds=(0, 0, 1, 1))
    >>> uav = Uav("a", start=(0.1, 0.1), goal=(0.9, 0.9), detection_radius=0.2)
    >>> mission = Mission(world, [uav], get("cgla"), resolution=20)
    >>> mission.unit, mission.collision_distance
    (0.05, 0.03)
    >>> flight = mission.fly()
    >>> flight.uavs["a"].status.label, flight.uavs["a"].length > 0.8 * 2**0.5
    ('arrived', True)
    """

    def __init__(
        self,
        world: World,
        uavs: Sequence[Uav],
        solver: Solver,
        resolution: "int | tuple[int, int] | Lattice" = 20,
        sharing: Sharing | Literal["none", "global"] = "global",
        fusion: Fusion = "union",
        integral: Integral = "exact",
        knowledge: rules.KnowledgeRule = "sensed",
        virtual_obstacle: VirtualObstacle | bool | None = None,
        avoidance: rules.Avoidance = "none",
        replan: rules.Replan = "change",
        exclude: rules.Exclude = "none",
        movement: rules.Movement = "step",
        start: rules.Start = "exact",
        update: rules.Update = "simultaneous",
        arrival_radius: float = 0.0,
        collision_distance: float | None = None,
        collisions: rules.Meeting = "end",
        terminal_radius: float | None = None,
        max_ticks: int | None = None,
        incremental: bool = True,
        clearance: float = 0.0,
    ) -> None:
        """Read everything and check it once, so that no tick has to."""
        if not isinstance(world, World):
            msg = f"world is {shown(world)}; give a World"
            raise MissionError(msg)
        # as it is frozen, its attributes are set from behind
        keep = self.__dict__.update
        keep(world=world, uavs=_team(uavs), solver=solver, resolution=resolution)
        keep(sharing=Sharing.parse(sharing), virtual_obstacle=VirtualObstacle.parse(virtual_obstacle))
        keep(fusion=fusion, integral=integral, knowledge=knowledge, avoidance=avoidance, replan=replan)
        keep(exclude=exclude, movement=movement, start=start, update=update, collisions=collisions)
        near = 0.6 * self.unit if collision_distance is None else collision_distance
        terminal = 1.2 * self.unit if terminal_radius is None else terminal_radius
        with error_context():
            keep(clearance=non_negative_number("clearance", clearance))
            keep(arrival_radius=non_negative_number("arrival_radius", arrival_radius))
            keep(collision_distance=non_negative_number("collision_distance", near))
            keep(terminal_radius=non_negative_number("terminal_radius", terminal))
        keep(incremental=incremental)
        check(self)
        keep(max_ticks=self._enough_ticks() if max_ticks is None else whole_tick("max_ticks", max_ticks, at_least=1))

    def _enough_ticks(self) -> int:
        """Return a tick by which everybody has flown twenty times the way around the map."""
        # a long step saves no ticks: a UAV that has to turn often, or goes from vertex to vertex, needs as many
        step = min([UNITS_A_STEP * self.unit, *(self.step_of(uav) for uav in self.uavs)])
        begins = max([*self.world.changes, *(uav.departs for uav in self.uavs), 0])
        return begins + int(20.0 * self.way_around / step)

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


def _team(uavs: object) -> tuple[Uav, ...]:
    if not isinstance(uavs, Iterable) or isinstance(uavs, str):
        msg = f"uavs are {shown(uavs)}; give a list of Uav"
        raise MissionError(msg)
    team = tuple(uavs)
    for uav in team:
        if not isinstance(uav, Uav):
            msg = f"{shown(uav)} is no UAV; give Uav(name, start, goal, detection_radius, …)"
            raise MissionError(msg)
    return team

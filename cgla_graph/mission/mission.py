"""Missions of UAVs with limited sensing that share sightings, keep their distance and replan in flight."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import dist
from typing import Any, Literal, get_args, get_origin, get_type_hints

from cgla_graph._text import shown
from cgla_graph._validate import MOST_TICKS, clearance_of, error_context, non_negative_number, whole_tick
from cgla_graph.errors import MissionError
from cgla_graph.fusion.fusion import Fusion, Integral
from cgla_graph.mission import rules
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import LEAST_GAMMA, Rules
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.simulation import Simulation, fly
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import UNITS_A_STEP, VirtualObstacle
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solver import Solver
from cgla_graph.timed.timed_area import union_of

#: Most lattice points: a plan over 200 x 200 takes seconds.
MOST_POINTS = 40_000
#: The allowed words of each setting that has some.
CHOICES = {name: get_args(kind) for name, kind in get_type_hints(Rules).items() if get_origin(kind) is Literal}
#: Settings that only graph solvers can change, with the value that all other solvers need.
OF_GRAPHS = {"fusion": "union", "integral": "exact", "exclude": "none", "start": "exact"}
#: Settings that planning in space and time cannot change.
OF_SPACE_TIME = {
    **OF_GRAPHS,
    "movement": "step",
    "update": "simultaneous",
    "arrival_radius": 0.0,
    "virtual_obstacle": None,
}


def check(rules: Rules) -> None:
    """
    Check all settings of a mission.

    Raises
    ------
    MissionError
        If an option is unknown, a UAV's start or goal is outside the bounds, in a no-fly area or nearer to one than the
        clearance, two UAVs share a name or start closer than their safe distance, or two settings cannot be combined.
    """
    _check_options(rules)
    _check_uavs(rules)
    _check_solver(rules)
    _check_steps(rules)
    _check_obstacles(rules)
    if rules.avoidance != "none":
        _check_avoidance(rules)


def _check_options(rules: Rules) -> None:
    """Refuse unknown options."""
    for name, allowed in CHOICES.items():
        given = getattr(rules, name)
        if not (isinstance(given, str) and given in allowed):
            msg = f"unknown {name} {shown(given)}; choose one of {', '.join(allowed)}"
            raise MissionError(msg)
    if not isinstance(rules.incremental, bool):
        msg = f"incremental is {shown(rules.incremental)}; give True or False"
        raise MissionError(msg)


def _check_uavs(rules: Rules) -> None:
    """Refuse UAVs with equal names or with an invalid start."""
    names = [uav.name for uav in rules.uavs]
    if not names:
        msg = "a mission needs at least one UAV; give Uav(name, start, goal, detection_radius, …)"
        raise MissionError(msg)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        msg = f"two UAVs are called {shown(twice[0])}; give each a name of its own"
        raise MissionError(msg)
    world = rules.world
    for uav in rules.uavs:
        closed = union_of(world.no_fly, world.areas_at(uav.departs).values())
        with error_context(f"UAV {uav.name}"):
            Problem(uav.start, uav.goal, bounds=world.bounds, no_fly=world.no_fly, clearance=rules.clearance)
            Problem(uav.start, uav.start, bounds=world.bounds, no_fly=closed, clearance=rules.clearance)
    for a, b in combinations(rules.uavs, 2):
        apart, safe = dist(a.start, b.start), max(a.safe_distance, b.safe_distance)
        if a.departs == b.departs and apart < safe:
            msg = (
                f"UAVs {a.name} and {b.name} start {apart:g} apart, closer than the safe distance {safe:g}; "
                "move one, lower safe_distance, or let one depart later"
            )
            raise MissionError(msg)


def _check_solver(rules: Rules) -> None:
    """Refuse objects that are not solvers, and settings that the solver lacks."""
    solver = rules.solver
    domain = getattr(getattr(solver, "traits", None), "domain", None)
    # a class has the attributes of its instances, but no settings
    is_solver = not isinstance(solver, type) and callable(getattr(solver, "solve", None))
    if not is_solver or domain not in {"graph", "plane"}:
        msg = f'solver is {shown(solver)}; give a solver, such as cgla_graph.solvers.get("cgla")'
        raise MissionError(msg)
    changed = _changed(rules, OF_GRAPHS)
    if changed and domain != "graph":
        setting = f"{changed[0]}={getattr(rules, changed[0])!r}"
        msg = f"{setting} needs a graph solver, {solver.traits.name} plans in the plane"
        raise MissionError(msg)
    if (rules.fusion, rules.integral) != ("union", "exact"):
        reading = f"fusion={rules.fusion!r} with integral={rules.integral!r}"
        _check_probability(rules, reading)
        if rules.world.field.rasters:
            msg = f"the world has rasters, and {reading} is about threats alone; leave both settings as they are"
            raise MissionError(msg)


def _check_steps(rules: Rules) -> None:
    """Refuse a lattice with other bounds than the map or too many points, and steps too small to make progress."""
    lattice, on_lattice = rules.lattice, rules.solver.traits.domain == "graph" or rules.avoidance != "none"
    if on_lattice and lattice.n_points > MOST_POINTS:
        msg = (
            f"the lattice has {lattice.n_points} points; a mission plans dozens of times on a complete graph, "
            f"over at most {MOST_POINTS}: lower the resolution"
        )
        raise MissionError(msg)
    if lattice.bounds != rules.world.bounds:
        msg = f"the lattice lies over {lattice.bounds}, the world over {rules.world.bounds}; give both one box"
        raise MissionError(msg)
    for uav in rules.uavs:
        if rules.way_around / rules.step_of(uav) > MOST_TICKS:
            msg = f"UAV {uav.name}: step is {rules.step_of(uav):g}, which takes more than {MOST_TICKS} ticks; raise it"
            raise MissionError(msg)


def _check_obstacles(rules: Rules) -> None:
    """Refuse safe distances that leave virtual obstacles no room."""
    for uav in rules.uavs:
        gamma = uav.safe_distance / uav.detection_radius
        if rules.virtual_obstacle is not None and gamma <= LEAST_GAMMA:
            msg = (
                f"UAV {uav.name}: safe_distance / detection_radius is {gamma:g}; "
                f"virtual obstacles need more than {LEAST_GAMMA:g}: raise safe_distance"
            )
            raise MissionError(msg)


def _check_avoidance(rules: Rules) -> None:
    """Refuse settings that planning in space and time cannot keep or be combined with."""
    avoidance = f"avoidance={rules.avoidance!r}"
    _check_probability(rules, avoidance)
    below = [uav.name for uav in rules.uavs if uav.safe_distance < rules.collision_distance]
    if rules.collisions == "end" and len(below) > 1:
        msg = (
            f"UAVs {below[0]} and {below[1]}: both safe distances are below the collision distance "
            f"{rules.collision_distance:g}, so {avoidance} would let them collide; raise one"
        )
        raise MissionError(msg)
    changed = _changed(rules, OF_SPACE_TIME)
    if changed:
        msg = f"{avoidance} plans in space and time, which {changed[0]} cannot be combined with"
        raise MissionError(msg)


def _check_probability(rules: Rules, what: str) -> None:
    if not rules.world.is_proper:
        msg = f"{what} needs a world without peaks above 1; lower them"
        raise MissionError(msg)


def _changed(rules: Rules, defaults: dict[str, Any]) -> list[str]:
    """List the settings that differ from their defaults."""
    return [name for name, default in defaults.items() if getattr(rules, name) != default]


@dataclass(frozen=True, eq=False, init=False)
class Mission(Rules):
    """
    UAVs, their world and the rules, ready to be flown.

    The settings are those of `Rules`. They are read and checked once, and kept in full: a `Sharing` instead of
    ``"none"``, map units instead of None. So `dataclasses.replace` keeps `collision_distance`, `terminal_radius` and
    `max_ticks`; if a new map or lattice needs others, replace them by None as well.

    Raises
    ------
    MissionError
        If a setting is malformed, or two cannot be combined.

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
        """Read and check all settings once."""
        if not isinstance(world, World):
            msg = f"world is {shown(world)}; give a World"
            raise MissionError(msg)
        # (a frozen dataclass refuses assignments)
        keep = self.__dict__.update
        keep(world=world, uavs=_team(uavs), solver=solver, resolution=resolution)
        keep(sharing=Sharing.parse(sharing), virtual_obstacle=VirtualObstacle.parse(virtual_obstacle))
        keep(fusion=fusion, integral=integral, knowledge=knowledge, avoidance=avoidance, replan=replan)
        keep(exclude=exclude, movement=movement, start=start, update=update, collisions=collisions)
        near = 0.6 * self.unit if collision_distance is None else collision_distance
        terminal = 1.2 * self.unit if terminal_radius is None else terminal_radius
        with error_context():
            keep(clearance=clearance_of(clearance))
            keep(arrival_radius=non_negative_number("arrival_radius", arrival_radius))
            keep(collision_distance=non_negative_number("collision_distance", near))
            keep(terminal_radius=non_negative_number("terminal_radius", terminal))
        keep(incremental=incremental)
        check(self)
        keep(max_ticks=self._enough_ticks() if max_ticks is None else whole_tick("max_ticks", max_ticks, at_least=1))

    def _enough_ticks(self) -> int:
        """Return a tick by which every UAV can have flown twenty times the perimeter of the map."""
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
            Called after each tick, with its number.

        Returns
        -------
        flight
            The flight. The same mission gives the same flight, except for the seconds of planning.
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

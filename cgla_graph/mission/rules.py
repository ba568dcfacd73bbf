"""What decides a mission: the world, the UAVs, what plans, and the rules that they follow; all of it checked once."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import dist
from typing import Any, Literal, TypeAlias, cast, get_args

from cgla_graph._validate import non_negative_number
from cgla_graph.errors import MissionError, ProblemError
from cgla_graph.fusion.fusion import Fusion, Integral
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import UNITS_A_STEP, VirtualObstacle
from cgla_graph.mission.world import MOST_TICKS, World, union_of, whole_tick
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem

#: The paper asks that the safe distance is more than this much of the detection radius (Section 4.1).
LEAST_GAMMA = 0.1

#: A lattice of 200 x 200 takes seconds a plan.
MOST_POINTS = 40_000

Replan: TypeAlias = Literal["change", "tick"]
Exclude: TypeAlias = Literal["none", "last", "all"]
Movement: TypeAlias = Literal["step", "vertex"]
Start: TypeAlias = Literal["exact", "snapped"]
Update: TypeAlias = Literal["simultaneous", "sequential"]
Avoidance: TypeAlias = Literal["none", "prioritized"]
Meeting: TypeAlias = Literal["end", "record"]
KnowledgeRule: TypeAlias = Literal["sensed", "all"]


@dataclass(frozen=True, eq=False)
class Rules:
    """
    UAVs, the world they fly in, and the rules: everything that decides the flight.

    Attributes
    ----------
    world
        The truth.
    uavs
        One or more. Where an order matters, it is this one.
    solver
        What plans: any graph or plane solver, such as ``cg.solvers.get("cgla")``. One that reads cost matrices
        (``cgla``) gets G repaired after each change instead of computed anew.
    resolution
        Points a side of a closed lattice over the bounds, or a `Lattice`.
    sharing
        ``"global"``, ``"none"``, or a `Sharing` with radius, delay and loss.
    fusion
        How a UAV puts together what several have seen (E6, E7): ``union`` of the threats; ``max_integral``, the
        greatest of the integrals, Eq. 5 to the letter; ``integral_max``, the integral of the greatest; ``riskiest``.
    integral
        ``exact``, or the ``raster`` sum of E20.
    knowledge
        ``sensed``: nothing but the chart (bounds, `World.no_fly`) is known at first. ``all``: everybody always knows
        the world as it is.
    virtual_obstacle
        A `VirtualObstacle`, True for its defaults; None: UAVs ignore each other.
    avoidance
        ``none``, or ``prioritized``: each UAV plans in space and time around what the others are going to fly, so that
        no two are ever closer than the greater of their safe distances. A UAV that finds no such plan keeps its last
        one, which is safe; without one it does not take off.
    replan
        ``change``: when what it knows has changed. ``tick``: on every tick.
    exclude
        Nodes that a new plan may not use (E17): ``none``, the ``last`` one visited, ``all`` visited.
    movement
        ``step``: so much of the path a tick (E16). ``vertex``: to the next waypoint, however far, seeing along the way.
    start
        ``exact``: a plan starts where the UAV is. ``snapped``: at the lattice point nearest to it (E18).
    update
        ``simultaneous``: all move at once. ``sequential``: one after the other, seeing where those before have moved.
    arrival_radius
        Map units around the goal that count as arrived; 0: the goal itself. (The paper's code: half a unit.)
    collision_distance
        Closer than this is a collision, map units; None: 0.6 units.
    collisions
        ``end``: both UAVs end there. ``record``: they fly on.
    terminal_radius
        Of the discs around goals, map units; a pair of which both are in the disc of their own goal is not counted
        as near; None: 1.2 units.
    max_ticks
        When to stop; None: enough for a flight of twenty times the way around the map.
    incremental
        False: every plan is computed from scratch, for comparison: the same plans, but for which of the points in line
        they name.

    Raises
    ------
    MissionError
        If a part is malformed, a UAV's start or goal is outside the bounds or in a no-fly area, two UAVs share a name,
        or two start closer than their safe distance.

    Examples
    --------
    >>> from cgla_graph.solvers import get
    >>> uav = Uav("a", start=(0.1, 0.1), goal=(0.9, 0.9), detection_radius=0.2)
    >>> Rules(World(), [uav], get("cgla"), resolution=20).unit
    0.05
    """

    world: World
    uavs: Sequence[Uav]
    solver: Any
    resolution: "int | tuple[int, int] | Lattice" = 20
    sharing: Sharing | Literal["none", "global"] = "global"
    fusion: Fusion = "union"
    integral: Integral = "exact"
    knowledge: KnowledgeRule = "sensed"
    virtual_obstacle: VirtualObstacle | bool | None = None
    avoidance: Avoidance = "none"
    replan: Replan = "change"
    exclude: Exclude = "none"
    movement: Movement = "step"
    start: Start = "exact"
    update: Update = "simultaneous"
    arrival_radius: float = 0.0
    collision_distance: float | None = None
    collisions: Meeting = "end"
    terminal_radius: float | None = None
    max_ticks: int | None = None
    incremental: bool = True

    def __post_init__(self) -> None:
        """Check everything once, so that no tick has to."""
        if not isinstance(self.world, World):
            msg = f"world is {self.world!r}; give a World"
            raise MissionError(msg)
        self._check_uavs()
        self._check_options()
        for name in ("arrival_radius", "collision_distance", "terminal_radius"):
            value = getattr(self, name)
            if value is not None or name == "arrival_radius":
                try:
                    object.__setattr__(self, name, non_negative_number(name, value))
                except ProblemError as error:
                    raise MissionError(str(error)) from error
        if self.max_ticks is not None:
            whole_tick("max_ticks", self.max_ticks, at_least=1)
        _ = self.shares, self.lattice, self.obstacles
        self._check_solver()
        self._check_steps()
        self._check_safety()

    def _check_uavs(self) -> None:
        if not isinstance(cast("object", self.uavs), Iterable) or isinstance(self.uavs, str):
            msg = f"uavs are {self.uavs!r}; give a list of Uav"
            raise MissionError(msg)
        object.__setattr__(self, "uavs", tuple(self.uavs))
        for uav in self.uavs:
            if not isinstance(uav, Uav):
                msg = f"{uav!r} is no UAV; give Uav(name, start, goal, detection_radius, …)"
                raise MissionError(msg)
        if not self.uavs:
            msg = "a mission needs at least one UAV; give Uav(name, start, goal, detection_radius, …)"
            raise MissionError(msg)
        names = [uav.name for uav in self.uavs]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            msg = f"two UAVs are called {twice[0]!r}; give each a name of its own"
            raise MissionError(msg)
        for uav in self.uavs:
            closed = union_of(self.world.no_fly, self.world.areas_at(uav.departs).values())
            try:
                Problem(uav.start, uav.goal, bounds=self.world.bounds, no_fly=self.world.no_fly)
                Problem(uav.start, uav.start, bounds=self.world.bounds, no_fly=closed)
            except ProblemError as error:
                msg = f"UAV {uav.name}: {error}"
                raise MissionError(msg) from error
        for a, b in combinations(self.uavs, 2):
            apart, safe = dist(a.start, b.start), max(a.safe, b.safe)
            if a.departs == b.departs and apart < safe:
                msg = (
                    f"UAVs {a.name} and {b.name} start {apart:g} apart, closer than the safe distance {safe:g}; "
                    "move one, lower safe_distance, or let one depart later"
                )
                raise MissionError(msg)

    def _check_options(self) -> None:
        choices = {
            "fusion": Fusion,
            "integral": Integral,
            "knowledge": KnowledgeRule,
            "avoidance": Avoidance,
            "replan": Replan,
            "exclude": Exclude,
            "movement": Movement,
            "start": Start,
            "update": Update,
            "collisions": Meeting,
        }
        for name, alias in choices.items():
            allowed = get_args(alias)
            given = getattr(self, name)
            if not (isinstance(given, str) and given in allowed):
                msg = f"unknown {name} {given!r}; choose one of {', '.join(allowed)}"
                raise MissionError(msg)
        if not isinstance(self.incremental, bool):
            msg = f"incremental is {self.incremental!r}; give True or False"
            raise MissionError(msg)

    def _check_solver(self) -> None:
        domain = getattr(getattr(self.solver, "traits", None), "domain", None)
        # a class has the attributes of its instances, but no settings
        is_solver = not isinstance(self.solver, type) and callable(getattr(self.solver, "solve", None))
        if not is_solver or domain not in {"graph", "plane"}:
            msg = f'solver is {self.solver!r}; give a solver, such as cgla_graph.solvers.get("cgla")'
            raise MissionError(msg)
        needs_graph = {"fusion": "union", "integral": "exact", "exclude": "none", "start": "exact"}
        for name, default in needs_graph.items():
            if getattr(self, name) != default and domain != "graph":
                msg = (
                    f"{name}={getattr(self, name)!r} needs a graph solver, {self.solver.traits.name} plans in the plane"
                )
                raise MissionError(msg)
        if (self.fusion, self.integral) != ("union", "exact") and not self.world.is_probability:
            reading = f"fusion={self.fusion!r} with integral={self.integral!r}"
            msg = f"{reading} needs a world without peaks above 1; lower them"
            raise MissionError(msg)

    def _check_steps(self) -> None:
        """Refuse a lattice beside the map or too fine to plan on, and steps so small that nobody gets anywhere."""
        on_lattice = self.solver.traits.domain == "graph" or self.avoidance != "none"
        if on_lattice and self.lattice.n_points > MOST_POINTS:
            msg = (
                f"the lattice has {self.lattice.n_points} points; a mission plans dozens of times on a complete graph, "
                f"over at most {MOST_POINTS}: lower the resolution"
            )
            raise MissionError(msg)
        if self.lattice.bounds != self.world.bounds:
            msg = f"the lattice lies over {self.lattice.bounds}, the world over {self.world.bounds}; give both one box"
            raise MissionError(msg)
        for uav in self.uavs:
            if self._around / self.step_of(uav) > MOST_TICKS:
                msg = (
                    f"UAV {uav.name}: step is {self.step_of(uav):g}, which takes more than {MOST_TICKS} ticks; raise it"
                )
                raise MissionError(msg)

    def _check_safety(self) -> None:
        if self.obstacles is not None:
            for uav in self.uavs:
                if uav.safe / uav.detection_radius <= LEAST_GAMMA:
                    msg = (
                        f"UAV {uav.name}: safe_distance / detection_radius is {uav.safe / uav.detection_radius:g}; "
                        f"virtual obstacles need more than {LEAST_GAMMA:g}: raise safe_distance"
                    )
                    raise MissionError(msg)
        if self.avoidance == "none":
            return
        if not self.world.is_probability:
            msg = f"avoidance={self.avoidance!r} needs a world without peaks above 1; lower them"
            raise MissionError(msg)
        below = [uav for uav in self.uavs if uav.safe < self.collision_at]
        if self.collisions == "end" and len(below) > 1:
            msg = (
                f"UAVs {below[0].name} and {below[1].name}: both safe distances are below the collision distance "
                f"{self.collision_at:g}, so avoidance={self.avoidance!r} would let them collide; raise one"
            )
            raise MissionError(msg)
        alone = {
            "fusion": "union",
            "integral": "exact",
            "exclude": "none",
            "movement": "step",
            "start": "exact",
            "update": "simultaneous",
            "arrival_radius": 0.0,
            "obstacles": None,
        }
        for name, default in alone.items():
            if getattr(self, name) != default:
                shown = "virtual_obstacle" if name == "obstacles" else name
                msg = f"avoidance={self.avoidance!r} plans in space and time, which {shown} cannot be combined with"
                raise MissionError(msg)

    @cached_property
    def shares(self) -> Sharing:
        """The rules of sharing."""
        return Sharing.parse(self.sharing)

    @cached_property
    def obstacles(self) -> VirtualObstacle | None:
        """The rule of virtual obstacles, if there is one."""
        given = self.virtual_obstacle
        if given is None or isinstance(given, VirtualObstacle):
            return given
        if isinstance(given, bool):
            return VirtualObstacle() if given else None
        msg = f"virtual_obstacle is {given!r}; give a VirtualObstacle, or True for its defaults"
        raise MissionError(msg)

    @cached_property
    def lattice(self) -> Lattice:
        """The lattice of graph solvers."""
        if isinstance(self.resolution, Lattice):
            return self.resolution
        return Lattice(self.resolution, bounds=self.world.bounds)

    @property
    def unit(self) -> float:
        """The paper's 1/N: a side of the map over the lattice points on it, the lesser of the two, map units."""
        x_min, y_min, x_max, y_max = self.world.bounds
        columns, rows = self.lattice.shape
        return min((x_max - x_min) / columns, (y_max - y_min) / rows)

    def step_of(self, uav: Uav) -> float:
        """Return what a UAV flies in a tick, map units."""
        return UNITS_A_STEP * self.unit if uav.step is None else uav.step

    @property
    def collision_at(self) -> float:
        """The collision distance, map units."""
        return 0.6 * self.unit if self.collision_distance is None else self.collision_distance

    @property
    def terminal_at(self) -> float:
        """The radius of terminal discs, map units."""
        return 1.2 * self.unit if self.terminal_radius is None else self.terminal_radius

    @property
    def last_tick(self) -> int:
        """The tick at which the mission stops at the latest."""
        if self.max_ticks is not None:
            return self.max_ticks
        # a long step saves no ticks: a UAV that has to turn often, or goes from vertex to vertex, needs as many
        step = min([UNITS_A_STEP * self.unit, *(self.step_of(uav) for uav in self.uavs)])
        begins = max([*self.world.changes, *(uav.departs for uav in self.uavs), 0])
        return begins + int(20.0 * self._around / step)

    @property
    def _around(self) -> float:
        """The way around the map, map units."""
        x_min, y_min, x_max, y_max = self.world.bounds
        return 2.0 * (x_max - x_min + y_max - y_min)

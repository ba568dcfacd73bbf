"""What decides a mission: the world, the UAVs, what plans, and the rules that they follow, each said once."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias

from cgla_graph._display import Plottable
from cgla_graph.fusion.fusion import Fusion, Integral
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import UNITS_A_STEP, VirtualObstacle
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solver import Solver

#: The paper asks that the safe distance is more than this much of the detection radius (Section 4.1).
LEAST_GAMMA = 0.1

Replan: TypeAlias = Literal["change", "tick", "never"]
Exclude: TypeAlias = Literal["none", "last", "all"]
Movement: TypeAlias = Literal["step", "vertex"]
Start: TypeAlias = Literal["exact", "snapped"]
Update: TypeAlias = Literal["simultaneous", "sequential"]
Avoidance: TypeAlias = Literal["none", "prioritized"]
Meeting: TypeAlias = Literal["end", "record"]
KnowledgeRule: TypeAlias = Literal["sensed", "all"]


@dataclass(frozen=True, eq=False, init=False)
class Rules(Plottable):
    """
    UAVs, the world they fly in, and the rules: everything that decides the flight, as `cgla_graph.Mission` reads it.

    A default that depends on the map is in units: a unit is a side of the map over the lattice points on it.

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
        Who hears whom; given as ``"global"``, ``"none"``, or a `Sharing` with radius, delay and loss.
    fusion
        How a UAV puts together what several have seen (E6, E7): ``union`` of the threats; ``max_integral``, the
        greatest of the integrals, Eq. 5 to the letter; ``integral_max``, the integral of the greatest; ``riskiest``.
    integral
        ``exact``, or the ``raster`` sum of E20.
    knowledge
        ``sensed``: nothing but the chart (bounds, `World.no_fly`) is known at first. ``all``: everybody always knows
        the world as it is.
    virtual_obstacle
        How they plan around each other; None: they do not. Given as True: a `VirtualObstacle` with its defaults.
    avoidance
        ``none``, or ``prioritized``: each UAV plans in space and time around what the others are going to fly, so that
        no two are ever closer than the greater of their safe distances. A UAV that finds no such plan keeps its last
        one, which is safe; without one it does not take off.
    replan
        ``change``: when what it knows has changed. ``tick``: on every tick. ``never``: the first plan is flown whatever
        comes up; where its next step would enter an area that is known by then, the flight ends.
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
        Closer than this is a collision, map units; given as None: 0.6 units.
    collisions
        ``end``: both UAVs end there. ``record``: they fly on.
    terminal_radius
        Of the discs around goals, map units; a pair of which both are in the disc of their own goal is not counted
        as near; given as None: 1.2 units.
    max_ticks
        When to stop; given as None: enough for a flight of twenty times the way around the map.
    incremental
        False: every plan is computed from scratch, for comparison: the same plans, but for which of the points in line
        they name.
    clearance
        How far plans stay from the no-fly areas that the UAV knows, map units: as that of a `Problem`. An area that it
        is already nearer to when it plans counts with half of it, or a quarter, …, the most that leaves the UAV
        outside. Seeing, and entering an area, go by the outline itself.
    """

    world: World
    uavs: Sequence[Uav]
    solver: Solver
    resolution: "int | tuple[int, int] | Lattice"
    sharing: Sharing
    fusion: Fusion
    integral: Integral
    knowledge: KnowledgeRule
    virtual_obstacle: VirtualObstacle | None
    avoidance: Avoidance
    replan: Replan
    exclude: Exclude
    movement: Movement
    start: Start
    update: Update
    arrival_radius: float
    collision_distance: float
    collisions: Meeting
    terminal_radius: float
    max_ticks: int
    incremental: bool
    clearance: float

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

    @property
    def way_around(self) -> float:
        """The way around the map, map units."""
        x_min, y_min, x_max, y_max = self.world.bounds
        return 2.0 * (x_max - x_min + y_max - y_min)

    def step_of(self, uav: Uav) -> float:
        """Return what a UAV flies in a tick, map units."""
        return UNITS_A_STEP * self.unit if uav.step is None else uav.step

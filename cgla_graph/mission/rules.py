"""Rules of a mission: all settings that decide the flight."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Literal, TypeAlias

from cgla_graph._display import Plottable
from cgla_graph._text import plain_json
from cgla_graph.fusion.fusion import Fusion, Integral
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import UNITS_A_STEP, VirtualObstacle
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solver import Solver

#: Least ratio of safe distance to detection radius in the paper (Section 4.1); the ratio must be above it.
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
    World, UAVs, solver and rules: all settings that decide the flight of a `cgla_graph.Mission`.

    Defaults that depend on the map are in units: a unit is a side of the map over the lattice points on it.

    Attributes
    ----------
    world
        The truth.
    uavs
        One or more. Rules that depend on an order use this one.
    solver
        The planner: any graph or plane solver, such as ``cg.solvers.get("cgla")``. For one that reads cost matrices
        (``cgla``), G is repaired after each change instead of computed anew.
    resolution
        Points a side of a closed lattice over the bounds, or a `Lattice`.
    sharing
        Which UAVs hear each other; given as ``"global"``, ``"none"``, or a `Sharing` with radius, delay and loss.
    fusion
        How a UAV combines the sightings of several (E6, E7): ``union`` of the threats; ``max_integral``, the greatest
        of the integrals, Eq. 5 to the letter; ``integral_max``, the integral of the greatest field; ``riskiest``, the
        field of the greatest total.
    integral
        ``exact``, or the ``raster`` sum of E20.
    knowledge
        ``sensed``: only the chart (bounds, `World.no_fly`) is known at first. ``all``: every UAV always knows the true
        world.
    virtual_obstacle
        How UAVs plan around each other; None: they do not. Given as True: a `VirtualObstacle` with its defaults.
    avoidance
        ``none``, or ``prioritized``: each UAV plans in space and time around the committed motions of the others, so
        that no two are ever closer than the greater of their safe distances. A UAV that finds no such plan keeps its
        last one, which is safe; without one it waits on the ground.
    replan
        ``change``: a UAV plans again when its knowledge has changed. ``tick``: on every tick. ``never``: it flies its
        first plan; the flight ends before a step into a known area.
    exclude
        Nodes that a new plan may not use (E17): ``none``, the ``last`` one visited, ``all`` visited.
    movement
        ``step``: a UAV flies one step a tick (E16). ``vertex``: it flies to the next waypoint, at any distance, and
        sees along the way.
    start
        ``exact``: a plan starts at the position of the UAV. ``snapped``: at the lattice point nearest to it (E18).
    update
        ``simultaneous``: all move at once. ``sequential``: one after the other, and each sees the moves before its own.
    arrival_radius
        Map units around the goal that count as arrived; 0: the goal itself. (The paper's code: half a unit.)
    collision_distance
        Closer than this is a collision, map units; given as None: 0.6 units.
    collisions
        ``end``: the flights of both UAVs end. ``record``: they fly on.
    terminal_radius
        Radius of the discs around goals, map units: the distance of two UAVs does not count while both are in the disc
        of their own goal; given as None: 1.2 units.
    max_ticks
        The last tick; given as None: enough for a flight of twenty times the perimeter of the map.
    incremental
        False: every plan is computed from scratch, for comparison: the plans are the same, except that they may name
        other points in line.
    clearance
        How far plans stay from the no-fly areas that the UAV knows, map units, as in a `Problem`. For an area that is
        nearer than this when the UAV plans, half of the clearance counts, or a quarter, …, the most that leaves the UAV
        outside. Sensing, and entering an area, go by the outline itself.
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
        """The perimeter of the map, map units."""
        x_min, y_min, x_max, y_max = self.world.bounds
        return 2.0 * (x_max - x_min + y_max - y_min)

    def step_of(self, uav: Uav) -> float:
        """Return the length that a UAV flies in a tick, map units."""
        return UNITS_A_STEP * self.unit if uav.step is None else uav.step

    def document(self) -> dict[str, Any]:
        """Return the settings of the mission but world, UAVs and solver as JSON, those left at their defaults too."""
        left = ("world", "uavs", "solver", "resolution")
        settings = {one.name: getattr(self, one.name) for one in fields(self) if one.name not in left}
        settings["sharing"] = settings.pop("sharing") if self.sharing.is_on else None
        settings["virtual_obstacle"] = settings.pop("virtual_obstacle")
        lattice = {"shape": self.lattice.shape, "kind": self.lattice.kind}
        found: dict[str, Any] = plain_json({**settings, "lattice": lattice})
        return found

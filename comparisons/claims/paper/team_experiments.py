"""What is measured on random maps: two UAVs that share or not, that keep apart or not, and Step 5's exclusion."""

import math
from itertools import product
from typing import Any, Literal, TypeAlias

import numpy as np

from cgla_graph._types import Point
from cgla_graph.comparisons.claims.contrasts import CELLS, RADII
from cgla_graph.comparisons.claims.experiment import Experiment
from cgla_graph.comparisons.claims.paper.flights import (
    ARRIVAL_RADIUS,
    BOUNDS,
    GOAL,
    RADIUS,
    START,
    STEP,
    measures,
    paper_lattice,
)
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, UavFlight
from cgla_graph.mission.rules import Exclude, Movement
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.mission.world import World
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get

Integral: TypeAlias = Literal["exact", "raster"]

#: Where the second UAV begins (Fig. 8), map units.
SECOND_START: Point = (0.1, 0.25)
#: Where Fig. 8 shows the two collide, map units.
MEETING: Point = (0.5, 0.7)
#: The paper's SD and the distance that counts as a collision are not printed; these are ours (E21, E25), map units.
SAFE_DISTANCE = 0.1
COLLISION_DISTANCE = 0.03
#: Standard deviation of a virtual obstacle (E23), map units: one step.
OBSTACLE_SPREAD = STEP
#: The paper's stepnum: the best of its Fig. 7.
STEPNUM = 3
#: The look-aheads of the curve, and those of Fig. 7; -1 stands for no virtual obstacle.
NO_OBSTACLE = -1
STEPNUMS = (0, 1, 2, 3, 4, 5, 6, 8)
PAPER_STEPNUMS = (0, 3, 5)
#: Risk weight of missions with virtual obstacles: the paper does not print one.
K = 20
#: Risk weights of the comparison with and without sharing.
SHARING_KS = (20, 70)
#: Risk weight of Step 5's exclusion: at a higher one flights replan more often on ways that turn back.
EXCLUSION_K = 50
#: What else Step 5 may exclude.
EXCLUSIONS: tuple[Exclude, ...] = ("last", "all")
#: By which moves (E16).
MOVEMENTS: tuple[Movement, ...] = ("step", "vertex")
#: How many threats there are in the paper's Fig. 12.
FEW_THREATS = (5, 7)
#: Four times the longest flights seen; who is still flying then does not arrive.
MAX_TICKS = 500
#: How far apart two positions of equal flights may be, map units: rounding only.
SAME_PLACE = 1e-6
#: A UAV whose detection radius is this sees nothing: what it plans on is as old as its take-off.
BLIND = 1e-6


def fly_two(
    field: RiskField,
    *,
    k: float = K,
    integral: Integral = "exact",
    radius: float = RADIUS,
    sharing: Sharing | Literal["none", "global"] = "none",
    stepnum: int | None = None,
) -> Flight:
    """
    Fly the paper's two UAVs: same speed, same goal, starts of Fig. 8.

    Parameters
    ----------
    field
        The true threats, unknown at first.
    k
        Risk weight of both.
    integral
        Of the planners' weights.
    radius
        Detection radius, map units.
    sharing
        Who tells whom.
    stepnum
        How many steps ahead a virtual obstacle is; None: there is none.

    Examples
    --------
    >>> fly_two(RiskField([])).all_arrived
    True
    """
    safe = min(SAFE_DISTANCE, radius / 2.0)
    uavs = [
        Uav(name, start=start, goal=GOAL, detection_radius=radius, step=STEP, k=k, safe_distance=safe)
        for name, start in (("a", START), ("b", SECOND_START))
    ]
    mission = Mission(
        World(field, bounds=BOUNDS),
        uavs,
        get("cgla"),
        resolution=paper_lattice(),
        sharing=sharing,
        integral=integral,
        virtual_obstacle=None if stepnum is None else VirtualObstacle(stepnum=stepnum, spread=OBSTACLE_SPREAD),
        arrival_radius=ARRIVAL_RADIUS,
        collision_distance=COLLISION_DISTANCE,
        collisions="record",
        max_ticks=MAX_TICKS,
    )
    return mission.fly()


def team_measures(flight: Flight) -> dict[str, Any]:
    """
    Return what is measured of a mission: sums over its UAVs, and how near they came to each other.

    The sums are missing unless all arrived (see `flights.measures`). How near they came is measured in any case.
    """
    each = [measures(one) for one in flight.uavs.values()]
    names = ("length", "risk", "risk_sum", "cost", "exposure")
    nearest = min(flight.separations, key=lambda pair: pair.distance)
    return {
        "arrived": flight.all_arrived,
        **{name: math.fsum(one[name] for one in each) if flight.all_arrived else None for name in names},
        "replans": sum(one["replans"] for one in each),
        "ticks": flight.ticks,
        "livelock": flight.livelock is not None,
        "separation": nearest.distance,
        "collided": nearest.distance < COLLISION_DISTANCE,
        "from_meeting": math.dist(nearest.where, MEETING),
    }


def sharings(seed: int) -> dict[str, Sharing | Literal["none", "global"]]:
    """
    Return the ways in which two UAVs with a matrix each communicate.

    Examples
    --------
    >>> list(sharings(1))
    ['none', 'global', 'radius', 'loss', 'delay']
    """
    return {
        "none": "none",
        "global": "global",
        "radius": Sharing(radius=RADIUS),
        "loss": Sharing(loss=0.9, seed=seed),
        "delay": Sharing(delay=10),
    }


def sample_sharing(seed: int) -> list[dict[str, Any]]:
    """Fly with and without sharing; for one K also with a poor radio, and with one matrix that nobody can reach."""
    field = random_scenario(seed).problem.field
    records = []
    for cell, k in product(CELLS, SHARING_KS):
        integral, radius = cell["integral"], cell["radius"]
        ways = sharings(seed)
        if k != K:
            ways = {name: ways[name] for name in ("none", "global")}
        for name, sharing in ways.items():
            flight = fly_two(field, k=k, integral=integral, radius=radius, sharing=sharing)
            records.append({**cell, "k": k, "sharing": name, **team_measures(flight)})
        if k == K:
            # a matrix kept elsewhere, out of reach from take-off on: no sighting gets into it
            flight = fly_two(field, k=k, integral=integral, radius=BLIND)
            records.append({**cell, "k": k, "sharing": "unreachable", **team_measures(flight)})
    return records


def sample_stepnum(seed: int) -> list[dict[str, Any]]:
    """Fly without a virtual obstacle and with one so many steps ahead: at OR = 0.2 all, else those of Fig. 7."""
    field = random_scenario(seed).problem.field
    records = []
    for cell in CELLS:
        for stepnum in (NO_OBSTACLE, *(STEPNUMS if cell["radius"] == RADIUS else PAPER_STEPNUMS)):
            ahead = None if stepnum == NO_OBSTACLE else stepnum
            flight = fly_two(field, integral=cell["integral"], radius=cell["radius"], stepnum=ahead)
            records.append({**cell, "stepnum": stepnum, **team_measures(flight)})
    return records


def fly_excluding(
    field: RiskField,
    exclude: Exclude,
    *,
    movement: Movement = "step",
    radius: float = RADIUS,
    k: float = EXCLUSION_K,
) -> UavFlight:
    """
    Fly one UAV that plans anew on every tick, as the paper's Step 5 does, without the points that it excludes.

    Parameters
    ----------
    field
        The true threats, unknown at first.
    exclude
        ``none``, the ``last`` lattice point, or ``all`` so far (E17).
    movement
        By a ``step`` of 0.02 a tick, or from lattice point to lattice point, ``vertex`` (E16).
    radius, k
        As of `fly_two`.

    Examples
    --------
    >>> fly_excluding(RiskField([]), "last").status.label
    'arrived'
    """
    uav = Uav("a", start=START, goal=GOAL, detection_radius=radius, step=STEP, k=k)
    mission = Mission(
        World(field, bounds=BOUNDS),
        [uav],
        get("cgla"),
        resolution=paper_lattice(),
        replan="tick",
        exclude=exclude,
        movement=movement,
        # plans from scratch name the same ones of points in line, whether any are excluded; in steps it does not matter
        incremental=movement == "step",
        arrival_radius=ARRIVAL_RADIUS,
        max_ticks=MAX_TICKS,
    )
    return mission.fly().uavs["a"]


def same_trace(one: UavFlight, other: UavFlight) -> bool:
    """Return whether two UAVs were in the same place on every tick, but for rounding."""
    return one.trace.shape == other.trace.shape and bool((np.abs(one.trace - other.trace) <= SAME_PLACE).all())


def sample_exclusion(seed: int) -> list[dict[str, Any]]:
    """Fly without exclusion, and compare with Step 5's and with that of all points visited; exact integrals only."""
    field = random_scenario(seed).problem.field
    records = []
    for movement, radius in product(MOVEMENTS, RADII):
        free = fly_excluding(field, "none", movement=movement, radius=radius)
        for exclude in EXCLUSIONS:
            bound = fly_excluding(field, exclude, movement=movement, radius=radius)
            record = {"integral": "exact", "movement": movement, "radius": radius, "exclude": exclude}
            records.append({**record, "differs": not same_trace(free, bound), **measures(bound)})
    return records


def sample_few_threats(seed: int) -> list[dict[str, Any]]:
    """Fly two UAVs that share and keep apart by virtual obstacles, among five and seven threats, as Fig. 12 does."""
    records = []
    for threats in FEW_THREATS:
        field = random_scenario(seed, threats=threats).problem.field
        for cell in CELLS:
            integral, radius = cell["integral"], cell["radius"]
            flight = fly_two(field, integral=integral, radius=radius, sharing="global", stepnum=STEPNUM)
            records.append({**cell, "threats": threats, **team_measures(flight)})
    return records


EXPERIMENTS = (
    Experiment("sharing", "two UAVs with and without sharing, K = 20 and 70, and with a poor radio", sample_sharing),
    Experiment(
        "stepnum", "two UAVs without virtual obstacles, and with them so many steps ahead", sample_stepnum, quick=6
    ),
    Experiment("exclusion", "one UAV with and without Step 5's exclusion", sample_exclusion, quick=6, share=0.5),
    Experiment("few-threats", "two UAVs among five and seven threats, with virtual obstacles", sample_few_threats),
)

"""Flights that could fail to arrive: plans on every tick, Step 5's exclusion, and virtual obstacles."""

import math
from itertools import product
from typing import Any

import numpy as np

from cgla_graph._types import Point
from cgla_graph.comparisons.claims.experiment import Record, experiment, on_diagonal
from cgla_graph.comparisons.claims.panel.flights import MAX_TICKS, N, fly
from cgla_graph.comparisons.claims.panel.settings import FACTORS, START, PanelMap
from cgla_graph.mission.records import Flight, UavFlight
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.model.risk import RiskField

#: Points a side, and detection radii of each, map units: all radii on the lattice whose flights are cheap.
SIZES = {10: FACTORS["radius"], 20: (0.2,)}
#: Where plans begin (E18): where the UAV is, or at the lattice point nearest to it.
PLANS_BEGIN = ("exact", "snapped")
#: Risk weight of flights with Step 5's exclusion: the paper's greatest, as small ones rarely plan to turn back.
EXCLUSION_K = 200.0
#: How far apart two positions of equal flights may be, map units: rounding only.
SAME_PLACE = 1e-6
#: Detection radius and risk weight of flights, where they are not varied.
RADIUS, K = 0.2, 50.0
SWAPPED, SIDE_BY_SIDE = "places changed", "side by side"
#: Where two UAVs fly from and to, map units.
COURSES: dict[str, tuple[tuple[Point, Point], tuple[Point, Point]]] = {
    SWAPPED: ((START, (0.9, 0.9)), ((0.9, 0.9), START)),
    SIDE_BY_SIDE: ((START, (0.9, 0.9)), ((0.1, 0.25), (0.9, 0.9))),
}
#: Spreads of virtual obstacles, map units: a step (E23), and the stored livelock's.
OBSTACLE_SPREADS = (0.02, 0.05)
#: Points a side: of the stored livelock, and the paper's.
PAIR_SIZES = (12, N)
#: Steps from a UAV to its virtual obstacle: the best of Fig. 7.
STEPNUM = 3
#: The safe distance is at most this share of the distance between two starts.
MOST_OF_GAP = 0.9
#: Settings of pairs that are varied one at a time from the stored livelock's.
VARIED_PAIRS = {"K = 10": (0.2, 10.0), "K = 200": (0.2, 200.0), "OR 0.1": (0.1, K), "OR 0.4": (0.4, K)}


@experiment("starts-of-plans")
def starts_of_plans(map_: PanelMap) -> list[Record]:
    """Fly with a plan on every tick that begins where the UAV is, and with one that begins at a lattice point."""
    records: list[Record] = []
    for n, radii in SIZES.items():
        levels = map_.panel.levels
        for radius, k, start in product(levels("radius", radii), levels("k"), PLANS_BEGIN):
            # no limit of ticks but the mission's: a flight that repeats its state ends at once
            flight = fly({"a": START}, map_.field, map_.goal, k=k, radius=radius, n=n, replan="tick", start=start)
            records.append({**map_.levels, "n": n, "radius": radius, "k": k, "start": start, **ending(flight)})
    return records


def ending(flight: Flight) -> Record:
    """Return how a mission ends."""
    return {"arrived": flight.all_arrived, "livelock": flight.livelock is not None, "ticks": flight.ticks}


@experiment("exclusion", kinds=on_diagonal)
def exclusion(map_: PanelMap) -> list[Record]:
    """Fly from lattice point to lattice point with Step 5's exclusion and without, and compare the flights."""
    # plans from scratch name the same points of those in line, whether any are excluded
    how: dict[str, Any] = {"replan": "tick", "movement": "vertex", "incremental": False}
    levels = map_.panel.levels
    records: list[Record] = []
    for radius, k in product(levels("radius", (RADIUS,)), levels("k", (EXCLUSION_K,))):
        free, bound = (
            fly({"a": START}, map_.field, map_.goal, k=k, radius=radius, exclude=exclude, **how)
            for exclude in ("none", "last")
        )
        differs = not same_trace(free.uavs["a"], bound.uavs["a"])
        records.append({**map_.levels, "radius": radius, "k": k, "differs": differs, **ending(bound)})
    return records


def same_trace(one: UavFlight, other: UavFlight) -> bool:
    """Return whether two UAVs were in the same place on every tick, but for rounding."""
    return one.trace.shape == other.trace.shape and bool((np.abs(one.trace - other.trace) <= SAME_PLACE).all())


@experiment("pairs-apart", kinds=on_diagonal)
def pairs_apart(map_: PanelMap) -> list[Record]:
    """Fly two UAVs that keep apart by virtual obstacles, and vary K and sight from the stored livelock's settings."""
    panel = map_.panel
    settings = (("",), panel.levels("radius", (RADIUS,)), panel.levels("k", (K,)))
    cases = list(product(COURSES, OBSTACLE_SPREADS, PAIR_SIZES, *settings))
    if not panel.own:
        cases += [(SWAPPED, OBSTACLE_SPREADS[-1], PAIR_SIZES[0], varied, *how) for varied, how in VARIED_PAIRS.items()]
    return [
        {
            **map_.levels,
            "course": course,
            "obstacle": obstacle,
            "n": n,
            "radius": radius,
            "k": k,
            "varied": varied,
            **ending(fly_pair(map_.field, course, obstacle, n, radius=radius, k=k)),
        }
        for course, obstacle, n, varied, radius, k in cases
    ]


def fly_pair(
    threats: RiskField, course: str, obstacle: float, n: int, *, radius: float = RADIUS, k: float = K
) -> Flight:
    """
    Fly two UAVs that keep apart by virtual obstacles.

    Parameters
    ----------
    threats
        Unknown at first.
    course
        Where they fly, of `COURSES`.
    obstacle
        Spread of a virtual obstacle, map units.
    n
        Points a side of the lattice.
    radius
        Detection radius, map units; the safe distance is half of it, and less than the starts are apart.
    k
        Risk weight.

    Examples
    --------
    >>> ending(fly_pair(RiskField(), SIDE_BY_SIDE, 0.02, 12))["arrived"]
    True
    """
    starts, goals = (dict(zip("ab", places, strict=True)) for places in zip(*COURSES[course], strict=True))
    apart: dict[str, Any] = {
        "safe_distance": min(0.5 * radius, MOST_OF_GAP * math.dist(*starts.values())),
        "virtual_obstacle": VirtualObstacle(stepnum=STEPNUM, spread=obstacle),
        "collisions": "record",
        "max_ticks": MAX_TICKS,
    }
    return fly(starts, threats, goals, k=k, radius=radius, n=n, **apart)

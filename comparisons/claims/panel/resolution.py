"""Plans and flights on lattices of several sizes (Fig. 11): how far apart the paths are, and what they cost."""

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any, NamedTuple

import shapely

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import MAX_TICKS, fly, paper_lattice
from cgla_graph.comparisons.claims.panel.settings import FACTORS, RULES, START, PanelMap
from cgla_graph.mission.records import MissionStatus
from cgla_graph.solvers import solve

#: Points a side, and the paper's K.
SIZES = (15, 20, 25)
K = 40.0
#: K of plans with all known. Flights have the paper's; the panel's are varied from the base cells.
KNOWN_K = tuple(sorted({K, *FACTORS["k"]}))
#: Paths are compared at points no farther apart than this, map units.
FINE = 0.01
#: Paths that are never more than two cells of the coarsest lattice apart are nearly the same.
SAME_WITHIN = 2.0 / min(SIZES)


class Way(NamedTuple):
    """
    A plan or flight on one lattice.

    Attributes
    ----------
    arrived
        Whether it ends at the goal.
    path
        Waypoints, shape ``(m, 2)``, map units.
    cost
        Length and K times risk, map units.
    """

    arrived: bool
    path: FloatArray
    cost: float


@experiment("resolution")
def resolution(map_: PanelMap) -> list[Record]:
    """Plan a map with all known, fly it at all radii, and vary rules and K from its base cells."""
    levels = map_.panel.levels
    records: list[Record] = [{"mode": "known", "k": k, **compared(_planned(map_, k))} for k in levels("k", KNOWN_K)]
    records += [_flown(map_, radius, k) for radius, k in product(levels("radius"), levels("k", (K,)))]
    for base in map_.bases:
        radius = base["radius"]
        records += [_flown(map_, radius, K, f"{name} {value}", **{name: value}) for name, value in RULES.items()]
        records += [_flown(map_, radius, k, f"K = {k:g}") for k in FACTORS["k"]]
    return [{**map_.levels, **record} for record in records]


def _planned(map_: PanelMap, k: float) -> list[Way]:
    found = [solve(map_.problem(k), "cgla", resolution=paper_lattice(n)) for n in SIZES]
    return [Way(one.status.has_path, one.path, one.cost) for one in found]


def _flown(map_: PanelMap, radius: float, k: float = K, varied: str = "", **rules: Any) -> Record:  # noqa: ANN401
    ways = []
    for n in SIZES:
        flight = fly({"a": START}, map_.field, map_.goal, k=k, radius=radius, n=n, max_ticks=MAX_TICKS, **rules)
        one = flight.uavs["a"]
        ways.append(Way(one.status is MissionStatus.ARRIVED, one.path, one.length + k * one.risk))
    return {"mode": "flown", "radius": radius, "k": k, "varied": varied, **compared(ways)}


def compared(ways: Sequence[Way]) -> dict[str, Any]:
    """
    Compare ways between the same two points.

    If only some arrive, they are not the same. If none arrives, nothing is known.

    Returns
    -------
    measured
        ``distance``, the greatest of any two, and ``cost_ratio``, the greatest cost over the least, if all arrive;
        ``same``, whether the distance is within `SAME_WITHIN`.

    Examples
    --------
    >>> import numpy as np
    >>> straight = Way(True, np.array([[0.0, 0.0], [1.0, 0.0]]), 1.0)
    >>> compared([straight, straight._replace(cost=1.5)])
    {'distance': 0.0, 'same': True, 'cost_ratio': 1.5}
    >>> compared([straight, straight._replace(arrived=False)])["same"]
    False
    """
    if not all(way.arrived for way in ways):
        return {"distance": None, "same": False if any(way.arrived for way in ways) else None, "cost_ratio": None}
    distance, costs = farthest_pair([way.path for way in ways]), [way.cost for way in ways]
    return {"distance": distance, "same": distance <= SAME_WITHIN, "cost_ratio": max(costs) / min(costs)}


def farthest_pair(paths: Sequence[FloatArray]) -> float:
    """
    Return the greatest discrete Fréchet distance of any two paths, each cut into pieces of at most `FINE`.

    Parameters
    ----------
    paths
        Waypoints, shape ``(m, 2)`` each, map units.

    Examples
    --------
    >>> import numpy as np
    >>> farthest_pair([np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 0.25], [1.0, 0.25]])])
    0.25
    """
    lines = [shapely.segmentize(shapely.LineString(path), FINE) for path in paths]
    return max(float(shapely.frechet_distance(a, b)) for a, b in combinations(lines, 2))

"""What a UAV sees: things within its detection radius, and that some are not where it believed them to be."""

import math

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.belief import Belief, Report
from cgla_graph.mission.world import World


def sightings(
    world: World, tick: int, belief: Belief, seen_from: FloatArray, radius: float, origin: int
) -> list[Report]:
    """
    Return what is new to a UAV of what it sees.

    Parameters
    ----------
    world, tick
        The truth, and when.
    belief
        What it believed before.
    seen_from
        Where it is, or the waypoints that it looks along, shape ``(m, 2)`` with ``m >= 1``, map units.
    radius
        A threat is seen when its centre is so near, an area when any part of it is, map units. So is the absence of one
        that is believed in.
    origin
        The number of the UAV.

    Returns
    -------
    reports
        What is missing first, in the order of the numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> world = World(RiskField([Threat(0.5, 0.5, 0.1), Threat(0.9, 0.9, 0.1)]))
    >>> [report.thing for report in sightings(world, 0, Belief(), np.array([[0.4, 0.4]]), 0.2, origin=0)]
    [('threat', 0)]
    """
    threats, areas = world.threats_at(tick), world.areas_at(tick)
    gone_threats = [
        Report(("threat", number), believed, is_there=False, tick=tick, origin=origin)
        for number, believed in belief.threats.items()
        if threats.get(number) != believed and _from(seen_from, (believed.x, believed.y)) <= radius
    ]
    gone_areas = [
        Report(("area", number), None, is_there=False, tick=tick, origin=origin)
        for number in sorted(belief.areas - areas.keys())
        if _from_area(seen_from, world.timed_area(number)) <= radius
    ]
    new_threats = [
        Report(("threat", number), threat, is_there=True, tick=tick, origin=origin)
        for number, threat in threats.items()
        if belief.threats.get(number) != threat and _from(seen_from, (threat.x, threat.y)) <= radius
    ]
    new_areas = [
        Report(("area", number), None, is_there=True, tick=tick, origin=origin)
        for number, area in areas.items()
        if number not in belief.areas and _from_area(seen_from, area) <= radius
    ]
    return [*gone_threats, *gone_areas, *new_threats, *new_areas]


def _from(seen_from: FloatArray, place: Point) -> float:
    """Return how near a place is to the waypoints, or to the way along them."""
    return math.dist(seen_from[0], place) if len(seen_from) == 1 else _from_area(seen_from, shapely.Point(place))


def _from_area(seen_from: FloatArray, area: BaseGeometry) -> float:
    looking = shapely.LineString(seen_from) if len(seen_from) > 1 else shapely.Point(seen_from[0])
    return float(shapely.distance(looking, area))

"""What a UAV sees: things within its detection radius, and that some are not where it believed them to be."""

import math

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.belief import Belief, Report, Thing
from cgla_graph.mission.world import World
from cgla_graph.model.risk import Threat


def sightings(
    world: World, tick: int, belief: Belief, seen_from: FloatArray, radius: float, origin: int
) -> list[Report]:
    """
    Return the things that a UAV sees and did not know.

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
        Vanished things first; threats before areas, in the order of their numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> world = World(RiskField([Threat(0.5, 0.5, 0.1), Threat(0.9, 0.9, 0.1)]))
    >>> [report.thing for report in sightings(world, 0, Belief(), np.array([[0.4, 0.4]]), 0.2, origin=0)]
    [('threat', 0)]
    """
    there: dict[Thing, Threat | None] = {("threat", number): at for number, at in world.threats_at(tick).items()}
    there |= {("area", number): None for number in world.areas_at(tick)}

    def is_seen(thing: Thing, content: Threat | None) -> bool:
        if content is None:
            return _from_area(seen_from, world.polygons[thing[1]]) <= radius
        return _from(seen_from, (content.x, content.y)) <= radius

    return [
        Report(thing, content, is_there=is_there, tick=tick, origin=origin)
        for is_there, things, others in ((False, belief.things, there), (True, there, belief.things))
        for thing, content in things.items()
        if (thing, content) not in others.items() and is_seen(thing, content)
    ]


def _from(seen_from: FloatArray, place: Point) -> float:
    """Return how near a place is to the waypoints, or to the way along them."""
    return math.dist(seen_from[0], place) if len(seen_from) == 1 else _from_area(seen_from, shapely.Point(place))


def _from_area(seen_from: FloatArray, area: BaseGeometry) -> float:
    looking = shapely.LineString(seen_from) if len(seen_from) > 1 else shapely.Point(seen_from[0])
    return float(shapely.distance(looking, area))

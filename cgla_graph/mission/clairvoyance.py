"""What a UAV must pay that knows the whole world and is alone in it: what flights of teams are compared with."""

from cgla_graph._types import Point
from cgla_graph.certificate.certificate import prove
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.problem import Problem


def least_cost_alone(world: World, start: Point, goal: Point, k: float, tolerance: float) -> float:
    """
    Bound from below what any flight from start to goal costs, however much its UAV knows, and at any speed.

    Risk counts that is there at every tick: the world's field, and timed threats from tick 0 on that neither move nor
    vanish. Areas of the chart count, timed ones do not.

    Parameters
    ----------
    world
        The truth.
    start, goal
        The ends of the flight, map units.
    k
        The UAV's risk weight.
    tolerance
        As `cgla_graph.lower_bound` takes it.

    Returns
    -------
    bound
        Map units; NaN for fields with peaks above 1, of which nothing is proven.

    Examples
    --------
    >>> 0.79 < least_cost_alone(World(), (0.1, 0.1), (0.9, 0.1), 10.0, 0.01) <= 0.8
    True
    """
    if not world.is_proper:
        return float("nan")
    lasting = [
        one.threat
        for one in world.timed
        if isinstance(one, TimedThreat) and one.appears == 0 and one.vanishes is None and not one.moves
    ]
    field = world.field.with_threats(lasting) if lasting else world.field
    return prove(
        Problem(start, goal, field, k, bounds=world.bounds, no_fly=world.no_fly), tolerance=tolerance
    ).lower_bound

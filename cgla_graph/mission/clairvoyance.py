"""What UAVs must pay that know the whole world and are alone in it: what flights of teams are compared with."""

from collections import Counter
from collections.abc import Mapping

from cgla_graph._threads import side_by_side
from cgla_graph._types import Point
from cgla_graph.certificate.certificate import load_kernels, prove
from cgla_graph.certificate.landmarks import COARSE, MANY, Ground
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import Problem


def least_costs_alone(
    world: World, flights: Mapping[str, tuple[Point, Point, float]], tolerance: float
) -> dict[str, float]:
    """
    Bound from below what any flight from start to goal costs, however much its UAV knows, and at any speed.

    Risk counts that is there at every tick: the world's field, and timed threats from tick 0 on that neither move nor
    vanish. Areas of the chart count, timed ones do not.

    Parameters
    ----------
    world
        The truth.
    flights
        Start and goal of each flight by name, map units, and the UAV's risk weight.
    tolerance
        As `cgla_graph.lower_bound` takes it.

    Returns
    -------
    bounds
        By name, map units; NaN for fields with peaks above 1, of which nothing is proven.

    Examples
    --------
    >>> found = least_costs_alone(World(), {"a": ((0.1, 0.1), (0.9, 0.1), 10.0)}, 0.01)
    >>> 0.79 < found["a"] <= 0.8
    True
    """
    if not world.is_proper:
        return dict.fromkeys(flights, float("nan"))
    lasting = [
        one.threat
        for one in world.timed
        if isinstance(one, TimedThreat) and one.appears == 0 and one.vanishes is None and not one.moves
    ]
    field = world.field.with_threats(lasting) if lasting else world.field
    problems = {
        name: Problem(start, goal, field, k, bounds=world.bounds, no_fly=world.no_fly)
        for name, (start, goal, k) in flights.items()
    }
    alike, first = Counter(one.k for one in problems.values()), {one.k: one for one in reversed(problems.values())}
    shared = {k: Ground.lay(one, COARSE) for k, one in first.items() if alike[k] >= MANY}

    def least(problem: Problem) -> float:
        ground = shared.get(problem.k)
        proof = None if ground is None else ground.proof(problem, tolerance)
        proof = proof if proof is not None and proof.reached else prove(problem, tolerance=tolerance)
        return proof.lower_bound

    # (each of several threads would load them)
    for problem in first.values():
        load_kernels(MapKind.of(problem.model))
    return dict(zip(problems, side_by_side(least, list(problems.values())), strict=True))

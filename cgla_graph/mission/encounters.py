"""How near UAVs come to each other: the least separation of each pair, and collisions."""

import dataclasses
import math
from collections.abc import Mapping
from itertools import combinations

from cgla_graph.mission.records import Separation
from cgla_graph.motion.trajectory import Approach, Trajectory, closest_approach
from cgla_graph.motion.trajectory_kernels import Disc


class Encounters:
    """
    The separations of one mission, measured tick by tick over all times between.

    Parameters
    ----------
    names
        Of the UAVs, by their number.
    goals
        Their terminal discs: while both of a pair are in their own, their distance does not count.
    collision_distance
        Closer than this is a collision, map units.

    Attributes
    ----------
    separations
        The least so far, by the numbers of a pair.
    """

    def __init__(self, names: list[str], goals: list[Disc], collision_distance: float) -> None:
        self.separations: dict[tuple[int, int], Separation] = {
            (i, j): Separation(math.inf, math.nan, (math.nan, math.nan), first=names[i], second=names[j])
            for i, j in combinations(range(len(names)), 2)
        }
        self._goals = goals
        self._collision_distance = collision_distance
        self._touching: set[tuple[int, int]] = set()

    def measure(self, legs: Mapping[int, Trajectory]) -> dict[tuple[int, int], tuple[Approach, bool]]:
        """
        Measure one tick.

        Parameters
        ----------
        legs
            What each UAV in the air flew on the tick, by its number, rising.

        Returns
        -------
        collisions
            By the numbers of a pair: the approach, and whether it has just begun.
        """
        collisions = {}
        for pair in combinations(legs, 2):
            one, other = legs[pair[0]], legs[pair[1]]
            matters = max(self.separations[pair].distance, self._collision_distance)
            approach = None
            if math.dist(one.start, other.start) - one.length - other.length <= matters:
                approach = closest_approach(one, other, outside=(self._goals[pair[0]], self._goals[pair[1]]))
            if approach is not None and approach.distance < self.separations[pair].distance:
                self.separations[pair] = dataclasses.replace(self.separations[pair], **vars(approach))
            if approach is None or approach.distance >= self._collision_distance:
                self._touching.discard(pair)
            else:
                collisions[pair] = approach, pair not in self._touching
                self._touching.add(pair)
        return collisions

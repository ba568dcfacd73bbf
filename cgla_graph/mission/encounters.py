"""How near UAVs come to each other: the least separation of each pair, and collisions."""

import math
from collections.abc import Mapping
from itertools import combinations
from typing import cast

import numpy as np

from cgla_graph.mission.records import Separation
from cgla_graph.motion.trajectory import Approach, Trajectory, closest_approach, least_distance
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
    """

    def __init__(self, names: list[str], goals: list[Disc], collision_distance: float) -> None:
        self._names = names
        self._goals = goals
        self._collision_distance = collision_distance
        self._least = np.full((len(names), len(names)), math.inf)
        self._nearest: dict[tuple[int, int], tuple[Trajectory, Trajectory]] = {}
        self._touching: set[tuple[int, int]] = set()

    @property
    def separations(self) -> tuple[Separation, ...]:
        """The least so far, pair by pair."""
        never = Approach(math.inf, math.nan, (math.nan, math.nan))
        found = {pair: self._approach(pair, *legs) for pair, legs in self._nearest.items()}
        return tuple(
            Separation(**vars(found.get((i, j), never)), first=self._names[i], second=self._names[j])
            for i, j in combinations(range(len(self._names)), 2)
        )

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
        numbers = list(legs)
        starts = np.array([leg.start for leg in legs.values()]).reshape(-1, 2)
        lengths = np.array([leg.length for leg in legs.values()])
        # nothing of interest comes of motions that are too far from each other, which are most of many
        matters = np.maximum(self._least[np.ix_(numbers, numbers)], self._collision_distance)
        apart = np.hypot(*(starts[:, None] - starts).T) - lengths[:, None] - lengths
        collisions = {}
        for first, second in np.argwhere(np.triu(apart <= matters, 1)).tolist():
            pair = i, j = numbers[first], numbers[second]
            distance, _ = least_distance(legs[i], legs[j], outside=(self._goals[i], self._goals[j]))
            if distance < self._least[pair]:
                self._least[i, j] = self._least[j, i] = distance
                self._nearest[pair] = legs[i], legs[j]
            if distance < self._collision_distance:
                collisions[pair] = self._approach(pair, legs[i], legs[j]), pair not in self._touching
        self._touching = set(collisions)
        return collisions

    def _approach(self, pair: tuple[int, int], first: Trajectory, second: Trajectory) -> Approach:
        # (there is one: these two were near each other)
        return cast("Approach", closest_approach(first, second, outside=(self._goals[pair[0]], self._goals[pair[1]])))

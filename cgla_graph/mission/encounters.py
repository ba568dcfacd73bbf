"""Separations of the UAVs of a mission, and their collisions."""

import math
from collections.abc import Mapping
from itertools import combinations
from typing import cast

import numpy as np

from cgla_graph.mission.records import Separation
from cgla_graph.motion.trajectory import Approach, Trajectory, closest_approach, least_distances
from cgla_graph.motion.trajectory_kernels import Disc


class Encounters:
    """
    The separations of one mission, measured tick by tick over all times between.

    Parameters
    ----------
    names
        The names of the UAVs, in the order of their numbers.
    goals
        Their terminal discs: while both UAVs of a pair are in their own, their distance does not count.
    collision_distance
        Closer than this is a collision, map units.
    """

    def __init__(self, names: list[str], goals: list[Disc], collision_distance: float) -> None:
        self._names = names
        self._goals = goals
        self._collision_distance = collision_distance
        self._least = np.full((len(names), len(names)), math.inf)
        # the tick at which each pair was nearest, and the motions on those ticks
        self._nearest = np.full((len(names), len(names)), -1)
        self._legs: list[Mapping[int, Trajectory]] = []
        self._touching: set[tuple[int, int]] = set()

    @property
    def separations(self) -> tuple[Separation, ...]:
        """The least separation of each pair so far."""
        never = Approach(math.inf, math.nan, (math.nan, math.nan))
        ticks = self._nearest.tolist()
        found = []
        for i, j in combinations(range(len(self._names)), 2):
            tick = ticks[i][j]
            best = never if tick < 0 else self._approach((i, j), self._legs[tick][i], self._legs[tick][j])
            found.append(Separation(best.distance, best.time, best.where, first=self._names[i], second=self._names[j]))
        return tuple(found)

    def measure(self, legs: Mapping[int, Trajectory]) -> dict[tuple[int, int], tuple[Approach, bool]]:
        """
        Measure one tick.

        Parameters
        ----------
        legs
            The motion of each UAV in the air on the tick, by its number, rising.

        Returns
        -------
        collisions
            By the numbers of a pair: the approach, and whether the collision begins on this tick.
        """
        self._legs.append(legs)
        numbers, motions = np.array(list(legs), dtype=np.int64), list(legs.values())
        starts = np.array([leg.start for leg in motions]).reshape(-1, 2)
        lengths = np.array([leg.length for leg in motions])
        # most pairs are too far apart to matter
        matters = np.maximum(self._least[np.ix_(numbers, numbers)], self._collision_distance)
        apart = np.hypot(*(starts[:, None] - starts).T) - lengths[:, None] - lengths
        pairs = np.argwhere(np.triu(apart <= matters, 1))
        distances = least_distances(motions, [self._goals[number] for number in legs], pairs)
        rows, columns = numbers[pairs].T
        nearer = distances < self._least[rows, columns]
        for i, j in ((rows[nearer], columns[nearer]), (columns[nearer], rows[nearer])):
            self._least[i, j] = distances[nearer]
            self._nearest[i, j] = len(self._legs) - 1
        collisions = {}
        for i, j in numbers[pairs[distances < self._collision_distance]].tolist():
            collisions[i, j] = self._approach((i, j), legs[i], legs[j]), (i, j) not in self._touching
        self._touching = set(collisions)
        return collisions

    def _approach(self, pair: tuple[int, int], first: Trajectory, second: Trajectory) -> Approach:
        # (not None: these two were near each other)
        return cast("Approach", closest_approach(first, second, outside=(self._goals[pair[0]], self._goals[pair[1]])))

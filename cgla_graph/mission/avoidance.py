"""Keeping UAVs apart for sure: plans around what all others are committed to fly."""

import dataclasses

from cgla_graph.cost_to_go.cost_matrix import CostMatrix
from cgla_graph.mission.virtual_obstacle import UNITS_A_STEP
from cgla_graph.model.problem import Problem
from cgla_graph.motion.space_time import MARGIN, Others, SpaceTimePlan, plan_in_space_time
from cgla_graph.motion.trajectory import Trajectory, least_distance


def stays_clear(motion: Trajectory, others: Others) -> bool:
    """
    Return whether a motion keeps its distance from all others, with room for rounding later on.

    Examples
    --------
    >>> east, west = Trajectory([0, 1], [(0, 0), (1, 0)]), Trajectory([0, 1], [(1, 0.5), (0, 0.5)])
    >>> stays_clear(east, [(west, 0.4)]), stays_clear(east, [(west, 0.6)])
    (True, False)
    """
    return all(least_distance(motion, other)[0] >= safe * (1.0 + MARGIN) for other, safe in others)


def plan_around(
    problem: Problem, matrix: CostMatrix, others: Others, tick: int, step: float, unit: float
) -> SpaceTimePlan:
    """
    Search in space and time until all others are gone and a detour after that is flown.

    The search waits in ticks and tells arrivals apart in ticks. Here it runs on a clock that goes with the speed, one
    tick for 0.4 units, so that its work does not depend on how finely a mission divides its time.

    Parameters
    ----------
    problem, matrix
        As `plan_in_space_time` takes them.
    others
        What the others are going to fly, on the mission's clock.
    tick
        Now.
    step
        Map units flown in a tick.
    unit
        The paper's 1/N, map units.

    Returns
    -------
    plan
        Its trajectory begins at time 0.
    """
    stride = UNITS_A_STEP * unit
    pace = step / stride
    crowd = [(motion.paced(pace), safe) for motion, safe in others]
    now = tick * pace
    x_min, y_min, x_max, y_max = problem.bounds
    detour = 2.0 * (x_max - x_min + y_max - y_min) / stride
    latest = max([now, *(motion.ends for motion, _ in crowd)]) + detour
    found = plan_in_space_time(problem, matrix, crowd, start_time=now, step=stride, latest=latest)
    if found.trajectory is None:
        return found
    return dataclasses.replace(found, trajectory=found.trajectory.shifted(-now).paced(1.0 / pace))

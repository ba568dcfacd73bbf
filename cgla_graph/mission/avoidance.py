"""Guaranteed separation: plans around the committed motions of all other UAVs."""

import dataclasses
from collections.abc import Sequence

from cgla_graph.cost_to_go.cost_matrix import CostMatrix
from cgla_graph.mission.virtual_obstacle import UNITS_A_STEP
from cgla_graph.model.problem import Problem
from cgla_graph.motion.space_time import MARGIN, Others, SpaceTimePlan, plan_in_space_time
from cgla_graph.motion.trajectory import Trajectory, least_distance


def stays_clear(motion: Trajectory, others: Others) -> bool:
    """
    Return whether a motion keeps its distance from all others, with a margin for rounding.

    Examples
    --------
    >>> east, west = Trajectory([0, 1], [(0, 0), (1, 0)]), Trajectory([0, 1], [(1, 0.5), (0, 0.5)])
    >>> stays_clear(east, [(west, 0.4)]), stays_clear(east, [(west, 0.6)])
    (True, False)
    """
    return all(least_distance(motion, other)[0] >= safe * (1.0 + MARGIN) for other, safe in others)


def plan_around(
    problem: Problem, matrix: CostMatrix, others: Others, tick: int, step: float, unit: float, names: Sequence[str] = ()
) -> SpaceTimePlan:
    """
    Search in space and time until all others are gone, and a detour longer.

    The search waits in ticks and distinguishes arrivals by ticks. Here its clock has one tick for 0.4 units flown, so
    that its work does not depend on the step of the mission.

    Parameters
    ----------
    problem, matrix
        As `plan_in_space_time` takes them.
    others
        The committed motions of the others, on the mission's clock, and the distances to keep.
    tick
        The current tick.
    step
        Map units flown in a tick.
    unit
        The paper's 1/N, map units.
    names
        What messages call the others.

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
    found = plan_in_space_time(problem, matrix, crowd, start_time=now, step=stride, latest=latest, names=names)
    if found.trajectory is None:
        return found
    return dataclasses.replace(found, trajectory=found.trajectory.shifted(-now).paced(1.0 / pace))

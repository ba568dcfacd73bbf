"""
The peer of flyable paths: RRT* in OMPL's Dubins space, with the same cost and the same exact tests of arcs.

``python tests/support/dubins_rrt_star.py [MAP …]`` prints how it compares on the shipped maps, at radii of
1, 3 and 10 % of the side, in twenty times the time. It is told where the flyable path leads at its ends, which was free
to choose.
"""

import math
import sys
import time
from itertools import pairwise
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

import cgla_graph as cg
from cgla_graph._kernel import kernel
from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.graph_kernels import Model
from cgla_graph.model.problem import Problem
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.turning.curve_kernels import in_box, piece_crosses, piece_length, piece_risk
from cgla_graph.turning.dubins_kernels import shortest, word_pieces

Pose = tuple[float, float, float]
MAPS = ("paper", "corridor", "fifty-threats", "finland", "gap-in-wall", "maze", "one-threat", "thin-wall", "trap")


@kernel
def motion_cost(start: Pose, goal: Pose, radius: float, model: Model, pieces: FloatArray) -> float:
    """Cost the shortest word between two poses."""
    word, _ = shortest(start, goal, radius)
    n = word_pieces(start, goal, radius, word, pieces)
    total = 0.0
    for i in range(n):
        total += piece_length(pieces[i])
        if model[0] > 0.0:
            total += model[0] * piece_risk(pieces[i], model[1])
    return total


@kernel
def motion_is_free(start: Pose, goal: Pose, radius: float, model: Model, bounds: Bounds, pieces: FloatArray) -> bool:
    """Tell whether the shortest word between two poses may be flown."""
    word, _ = shortest(start, goal, radius)
    n = word_pieces(start, goal, radius, word, pieces)
    free = True
    for i in range(n):
        free = free and in_box(pieces[i], bounds, 0.0) and not piece_crosses(pieces[i], model[2])
    return free


def rrt_star(problem: Problem, radius: float, start: Pose, goal: Pose, seconds: float, seed: int = 1) -> float:
    """Return the cost that RRT* reaches in so many seconds; infinite if it finds no path."""
    ou.setLogLevel(ou.LOG_NONE)
    ou.RNG.setSeed(seed)
    space = ob.DubinsStateSpace(radius)
    box = ob.RealVectorBounds(2)
    for axis in range(2):
        box.setLow(axis, problem.bounds[axis])
        box.setHigh(axis, problem.bounds[axis + 2])
    space.setBounds(box)
    information = ob.SpaceInformation(space)
    model, pieces = problem.model.kernel_model(), np.zeros((3, 8))

    def pose(state: Any) -> Pose:  # noqa: ANN401 - OMPL has no hints
        return state.getX(), state.getY(), state.getYaw()

    class Objective(ob.OptimizationObjective):  # type: ignore[misc, name-defined]
        def motionCost(self, first: Any, second: Any) -> Any:  # noqa: ANN401, N802
            return ob.Cost(motion_cost(pose(first), pose(second), radius, model, pieces))

    class Validator(ob.MotionValidator):  # type: ignore[misc, name-defined]
        def checkMotion(self, first: Any, second: Any) -> bool:  # noqa: ANN401, N802
            return motion_is_free(pose(first), pose(second), radius, model, problem.bounds, pieces)

    information.setStateValidityChecker(lambda state: not problem.model.area.contains(pose(state)[:2]))
    validator = Validator(information)
    information.setMotionValidator(validator)
    information.setup()
    ends = []
    for x, y, yaw in (start, goal):
        state = information.allocState()
        state.setX(x)
        state.setY(y)
        state.setYaw(yaw)
        ends.append(state)
    definition = ob.ProblemDefinition(information)
    definition.setStartAndGoalStates(*ends, 1e-9)
    objective = Objective(information)
    definition.setOptimizationObjective(objective)
    planner = og.RRTstar(information)
    planner.setProblemDefinition(definition)
    planner.setup()
    status = planner.solve(ob.timedPlannerTerminationCondition(seconds))
    if not definition.hasExactSolution():
        return math.inf
    del status
    states = [pose(state) for state in definition.getSolutionPath().getStates()]
    return sum(motion_cost(first, second, radius, model, pieces) for first, second in pairwise(states))


def main(names: list[str]) -> None:
    """Print a row a map and radius."""
    print(f"{'map':14} {'R':>6} {'flyable':>12} {'gap':>8} {'s':>6} {'RRT*':>12} {'s':>6} {'ratio':>7}")
    for name in names:
        problem = load_scenario(name).problem
        solution = cg.solve(problem)
        side = max(problem.bounds[2] - problem.bounds[0], problem.bounds[3] - problem.bounds[1])
        solution.flyable(0.05 * side)
        for share in (0.01, 0.03, 0.1):
            began = time.perf_counter()
            found = solution.flyable(share * side)
            seconds = time.perf_counter() - began
            curve = found.curve
            last = len(curve.pieces) - 1
            yaws = curve.headings(np.array([0, last]), np.array([0.0, 1.0]))
            ends = (*problem.start, float(yaws[0])), (*problem.goal, float(yaws[1]))
            rrt_star(problem, share * side, *ends, 0.1)
            peer = rrt_star(problem, share * side, *ends, 20.0 * seconds)
            print(
                f"{name:14} {share:6.0%} {found.cost:12.6g} {found.gap:8.2%} {seconds:6.2f} {peer:12.6g} "
                f"{20.0 * seconds:6.1f} {peer / found.cost:7.4f}",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:] or list(MAPS))

"""
A problem in the terms of OMPL: one space, one exact cost, one exact check of motions.

OMPL's own integral objectives ignore what Python overrides, its default check of motions samples (and jumps thin
walls), and its path simplifiers ignore the objective; none of them is used. Every OMPL object must be built after
the seed is set and must not outlive the function that uses it.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ompl import base as ob
from ompl import util as ou

from cgla_graph import risk_kernels
from cgla_graph.no_fly_kernels import point_inside, segment_crosses
from cgla_graph.problem import Problem
from cgla_graph.solution import TracePoint


class SegmentCost(ob.OptimizationObjective):  # type: ignore[misc]
    """Eq. 5 as an OMPL objective, counting how often it is asked."""

    def __init__(self, si: Any, problem: Problem) -> None:  # noqa: ANN401 - OMPL has no type hints
        """Keep the kernel's view of the problem."""
        super().__init__(si)
        self.k = problem.k
        self.field = problem.field.kernel_field()
        self.evaluations = 0

    def stateCost(self, state: Any) -> Any:  # noqa: ANN401, ARG002, N802 - OMPL's name
        """Return 0: all cost is on the way."""
        return ob.Cost(0.0)

    def motionCost(self, first: Any, second: Any) -> Any:  # noqa: ANN401, N802 - OMPL's name
        """Return Eq. 5 of the segment."""
        self.evaluations += 1
        return ob.Cost(risk_kernels.segment_cost(first[0], first[1], second[0], second[1], self.k, self.field))

    def motionCostHeuristic(self, first: Any, second: Any) -> Any:  # noqa: ANN401, N802 - OMPL's name
        """Return the length of the segment, which no cost undercuts."""
        return ob.Cost(((first[0] - second[0]) ** 2 + (first[1] - second[1]) ** 2) ** 0.5)


class ExactMotion(ob.MotionValidator):  # type: ignore[misc]
    """The exact test of a segment against the no-fly area."""

    def __init__(self, si: Any, problem: Problem) -> None:  # noqa: ANN401 - OMPL has no type hints
        """Keep the kernel's view of the area."""
        super().__init__(si)
        self.area = problem.model.area.kernel_arrays

    def checkMotion(self, first: Any, second: Any) -> bool:  # noqa: ANN401, N802 - OMPL's name
        """Say whether the segment stays out of the area."""
        return not segment_crosses(first[0], first[1], second[0], second[1], self.area)


@dataclass
class Budget:
    """
    A termination condition that counts, so that the same seed gives the same path on a machine of any speed.

    Attributes
    ----------
    limit
        Polls before it ends the run.
    best_cost
        Reads the best cost so far; None where the planner has none.
    """

    limit: int
    evaluations: Callable[[], int]
    best_cost: Callable[[], float]
    polls: int = 0
    trace: list[TracePoint] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)

    def __call__(self) -> bool:
        """Record an improvement, and say whether the budget is used up."""
        cost = self.best_cost()
        if cost < (self.trace[-1].cost if self.trace else float("inf")):
            self.trace.append(TracePoint(time.perf_counter() - self.began, self.evaluations(), cost))
        self.polls += 1
        return self.polls > self.limit


def space_information(problem: Problem, seed: int) -> Any:  # noqa: ANN401 - OMPL has no type hints
    """Seed OMPL and build its view of bounds and no-fly area; log messages are off."""
    ou.setLogLevel(ou.LOG_NONE)
    ou.RNG.setSeed(seed)
    space = ob.RealVectorStateSpace(2)
    box = ob.RealVectorBounds(2)
    for axis in range(2):
        box.setLow(axis, problem.bounds[axis])
        box.setHigh(axis, problem.bounds[axis + 2])
    space.setBounds(box)
    si = ob.SpaceInformation(space)
    area = problem.model.area.kernel_arrays
    if problem.model.area.is_empty:
        si.setStateValidityChecker(ob.AllValidStateValidityChecker(si))
    else:
        si.setStateValidityChecker(lambda state: not point_inside(state[0], state[1], area))
    si.setMotionValidator(ExactMotion(si, problem))
    si.setup()
    return si


def definition(problem: Problem, si: Any, objective: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
    """Build OMPL's problem definition from start, goal and objective."""
    pdef = ob.ProblemDefinition(si)
    ends = []
    for x, y in (problem.start, problem.goal):
        state = si.allocState()
        state[0], state[1] = x, y
        ends.append(state)
    pdef.setStartAndGoalStates(ends[0], ends[1])
    pdef.setOptimizationObjective(objective)
    return pdef

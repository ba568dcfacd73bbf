"""
OMPL's view of a problem: one space, one exact cost, one exact check of motions.

OMPL's own integral objectives ignore what Python overrides, its default check of motions samples (and jumps thin
walls), and its path simplifiers ignore the objective; none of them is used. Its informed sampler adds a cost-to-go
that Python cannot set: see `SegmentCost`. Every OMPL object must be built after the seed is set and must not outlive
the function that uses it.
"""

import math
import sys
from itertools import pairwise
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import util as ou

from cgla_graph._types import FloatArray
from cgla_graph.model import risk_kernels
from cgla_graph.model.no_fly_kernels import point_inside, segment_crosses
from cgla_graph.model.problem import Problem
from cgla_graph.solvers.budget import BudgetSpentError, Meter

#: After so many states in a row inside no-fly areas, the map counts as having no free place.
MAX_REJECTIONS = 100_000
#: A search may ask for so many lower bounds of costs for each segment that it weighs, and for so many more in all.
BOUNDS_A_SEGMENT, MORE_BOUNDS = 5, 500_000
#: One that compares bounds before it weighs, for so many for each segment, and more for each sample of a batch.
BOUNDS_A_COMPARED_SEGMENT, BOUNDS_A_SAMPLE = 2000, 100
#: Rounding of sums of costs, as a share of the greatest of them.
ROUNDING = 1e-12


class SegmentCost(ob.OptimizationObjective):  # type: ignore[misc]
    """
    Eq. 5 as an OMPL objective; every cost is charged to the budget, and refused once that is spent.

    Its exceptions pass through OMPL to the caller of the planner.

    Lower bounds of costs are lengths: risk is at least 0. Only an improper field may be negative, but not below ``1 -
    prod(max(1, peak - 1))``. The bounds stay below the costs by more than rounding.

    OMPL's informed sampler (of Informed RRT*, SORRT* and BIT*) draws states until a bound of the way over one, from the
    start to the goal, is below the best cost. For it, OMPL adds the bound from the start to the state and a cost-to-go,
    which is 0, because Python cannot set it: nearly all of the map would pass, and BIT* would refuse states nearer to
    the start than the goal is. So the bound of the whole way is returned when the sampler asks. It asks from the start
    of the problem definition, and planners from their own copy of it: `mark_sampler` tells one from the other.

    Some planners draw samples until they have some whose lower bound is below the best cost, without asking whether
    they have to stop. Where hardly any sample is, they would never end: so requests for bounds are counted as well.
    """

    def __init__(self, si: Any, problem: Problem, meter: Meter) -> None:  # noqa: ANN401 - OMPL has no type hints
        """Keep the kernel's view of the problem."""
        super().__init__(si)
        self.asked = 0
        self.most_asked, self.for_a_segment = MORE_BOUNDS, BOUNDS_A_SEGMENT
        self.k = problem.k
        self.field = problem.field.kernel_field(mixed=True)
        self.meter = meter
        self.start, self.goal = problem.start, problem.goal
        # the product in Eq. 2 is between this and its negative
        product = math.prod(max(1.0, threat.peak - 1.0) for threat in problem.field.every_threat)
        # each unit of length costs from `least` to `greatest`
        self.least = max(0.0, 1.0 + problem.k * (1.0 - product))
        greatest = 1.0 + problem.k * (1.0 + product + sum(raster.greatest for raster in problem.field.rasters))
        x_min, y_min, x_max, y_max = problem.bounds
        self.slack = ROUNDING * greatest * math.hypot(x_max - x_min, y_max - y_min)

    def stateCost(self, state: Any) -> Any:  # noqa: ANN401, ARG002, N802 - OMPL's name
        """Return 0: all cost is on the way."""
        return ob.Cost(0.0)

    def motionCost(self, first: Any, second: Any) -> Any:  # noqa: ANN401, N802 - OMPL's name
        """Return Eq. 5 of the segment."""
        self.meter.charge()
        self.asked = max(0, self.asked - self.for_a_segment)
        cost = risk_kernels.segment_cost(first[0], first[1], second[0], second[1], self.k, self.field)
        # RRT* would crash the process, BIT* would never end
        if not cost >= 0.0:
            msg = f"a segment costs {cost}; OMPL's planners need costs of at least 0"
            raise ArithmeticError(msg)
        return ob.Cost(cost)

    def total(self, path: FloatArray) -> float:
        """Add up the costs of a path's segments as OMPL gets them, shape ``(m, 2)``; charges no evaluations."""
        return sum(
            risk_kernels.segment_cost(x1, y1, x2, y2, self.k, self.field)
            for (x1, y1), (x2, y2) in pairwise(path.tolist())
        )

    def motionCostHeuristic(self, first: Any, second: Any) -> Any:  # noqa: ANN401, N802 - OMPL's name
        """Return a lower bound of the segment's cost; to OMPL's sampler, one of the whole way over the second state."""
        self.count()
        x, y = second[0], second[1]
        if math.isnan(first[0]):
            length = math.dist(self.start, (x, y)) + math.dist((x, y), self.goal)
        else:
            length = math.hypot(first[0] - x, first[1] - y)
        return ob.Cost(max(0.0, self.least * length - self.slack))

    def count(self) -> None:
        """
        Count one request for a bound.

        Raises
        ------
        BudgetSpentError
            If the time is up, or there are too many such requests.
        """
        self.meter.check_time()
        self.asked += 1
        if self.asked > self.most_asked:
            msg = f"{self.asked} lower bounds left hardly a segment to weigh"
            raise BudgetSpentError(msg)


class PruningCost(SegmentCost):
    """
    Eq. 5 for planners that prune and sample by lower bounds: a straight line ends the search.

    BIT* compares costs and bounds exactly. Where only free space is ahead, they are the same up to rounding: without
    the slack of the bounds, BIT* would prune a vertex of its best path, and crash when asked for that path.
    """

    def __init__(self, si: Any, problem: Problem, meter: Meter, samples_per_batch: int = 0) -> None:  # noqa: ANN401 - OMPL has no type hints
        """Allow for the bounds of a batch of samples, if the planner searches by them (0: it does not)."""
        super().__init__(si, problem, meter)
        if samples_per_batch:
            self.for_a_segment = BOUNDS_A_COMPARED_SEGMENT
            self.most_asked += BOUNDS_A_SAMPLE * samples_per_batch
        straight = self.least * math.dist(problem.start, problem.goal)
        # costs have to be below it, also those of 0
        self.setCostThreshold(ob.Cost(max(straight * (1.0 + ROUNDING), sys.float_info.min)))


class ExactMotion(ob.MotionValidator):  # type: ignore[misc]
    """The exact test of a segment against the no-fly area."""

    def __init__(self, si: Any, problem: Problem, meter: Meter) -> None:  # noqa: ANN401 - OMPL has no type hints
        """Keep the kernel's view of the area."""
        super().__init__(si)
        self.area = problem.model.area.kernel_arrays
        self.meter = meter

    def checkMotion(self, first: Any, second: Any) -> bool:  # noqa: ANN401, N802 - OMPL's name
        """Say whether the segment stays out of the area."""
        self.meter.check_time()
        return not segment_crosses(first[0], first[1], second[0], second[1], self.area)


class ExactState:
    """The exact test of a point against the no-fly area; gives up on maps that have hardly a free place."""

    def __init__(self, problem: Problem, meter: Meter) -> None:
        """Keep the kernel's view of the area."""
        self.area = problem.model.area.kernel_arrays
        self.meter = meter
        self.rejections = 0

    def __call__(self, state: Any) -> bool:  # noqa: ANN401 - OMPL has no type hints
        """Say whether the state is outside the area, or on its boundary."""
        self.meter.check_time()
        if not point_inside(state[0], state[1], self.area):
            self.rejections = 0
            return True
        self.rejections += 1
        if self.rejections >= MAX_REJECTIONS:
            msg = f"{MAX_REJECTIONS} samples in a row were inside the no-fly area"
            raise BudgetSpentError(msg)
        return False


def space_information(problem: Problem, seed: int, meter: Meter) -> Any:  # noqa: ANN401 - OMPL has no type hints
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
    if problem.model.area.is_empty:
        si.setStateValidityChecker(ob.AllValidStateValidityChecker(si))
    else:
        si.setStateValidityChecker(ExactState(problem, meter))
    si.setMotionValidator(ExactMotion(si, problem, meter))
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


def mark_sampler(si: Any, pdef: Any) -> None:  # noqa: ANN401 - OMPL has no type hints
    """Let OMPL's sampler ask for bounds from NaN; planners must have taken their copy of the start before."""
    marker = si.allocState()
    marker[0] = marker[1] = math.nan
    pdef.clearStartStates()
    pdef.addStartState(marker)


def waypoints(problem: Problem, pdef: Any) -> FloatArray:  # noqa: ANN401 - OMPL has no type hints
    """Copy the path of a problem definition, shape ``(m, 2)``, map units."""
    path: FloatArray = np.array([(state[0], state[1]) for state in pdef.getSolutionPath().getStates()])
    # OMPL's own bounds have a tolerance of one rounding
    x_min, y_min, x_max, y_max = problem.bounds
    return np.minimum(np.maximum(path, (x_min, y_min)), (x_max, y_max))

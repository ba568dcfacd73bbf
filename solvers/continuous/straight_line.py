"""The straight line from start to goal: the shortest path, blind to risk and to no-fly areas."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits


@dataclass(frozen=True)
class StraightLine:
    """
    The straight line: no other path is shorter, so its length bounds every cost from below.

    Examples
    --------
    >>> solution = StraightLine().solve(Problem(start=(0.1, 0.1), goal=(0.9, 0.1)))
    >>> round(solution.cost, 12)
    0.8
    """

    traits: ClassVar[Traits] = Traits(
        "straight-line", "start to goal, blind to risk", domain="plane", no_fly=False, proves=True
    )

    def solve(self, problem: Problem) -> Solution:
        """Return the line; the oracle says whether it may be flown."""
        path = np.array([problem.start, problem.goal])
        found = problem.evaluate(path)
        # a bound needs risk of at least 0; a trillionth less covers the rounding of longer sums
        bound = found.length * (1.0 - 1e-12) if problem.field.is_proper else np.nan
        return Solution(Status.FOUND, path=path, cost=found.cost, lower_bound=bound)

"""A budget of risk or of length, and paths that are changed until they use it up."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.model.problem import Evaluation, Problem
from cgla_graph.model.solution import Solution
from cgla_graph.refine.refine import refine_path
from cgla_graph.solvers.trade_off.front import ROUNDING

#: Weights that a path is refined under: their greatest ratio to the one that prices the budget, and their number.
MOST_SHIFT, SHIFTS = 64.0, 12
#: Halvings on the way from a path that keeps the budget towards one that does not.
HALVINGS = 30


@dataclass(frozen=True)
class Budget:
    """
    A limit of risk, under which length is made small, or of length, under which risk is.

    Attributes
    ----------
    limited
        What is limited.
    amount
        The limit.

    Examples
    --------
    >>> round(Budget("risk", 2.0).bound(10.0, k=3.0), 6)
    4.0
    """

    limited: Literal["risk", "length"]
    amount: float

    @property
    def on_risk(self) -> bool:
        """Whether risk is limited."""
        return self.limited == "risk"

    @property
    def room(self) -> float:
        """The limit as it is kept and proven: the same path may differ by rounding from solve to solve."""
        return self.amount * (1.0 + ROUNDING)

    def keeps(self, path: Solution | Evaluation) -> bool:
        """Whether a path keeps the limit, up to rounding."""
        return (path.risk if self.on_risk else path.length) <= self.room

    def value(self, path: Solution | Evaluation) -> float:
        """Return the value to minimise."""
        return path.length if self.on_risk else path.risk

    def bound(self, cost: float, k: float) -> float:
        """Bound the value to minimise from below, where no path costs less than `cost` under the weight `k`."""
        if self.on_risk:
            return cost - k * self.room
        return (cost - self.room) / k if k > 0.0 else 0.0


def refined(problem: Problem, budget: Budget, kept: Solution, k: float) -> Solution:
    """Refine a path under the weight that uses the budget up, found by bisection of its logarithm from `k` on."""
    best, broken = kept, None
    low, high = k / MOST_SHIFT, k * MOST_SHIFT
    for _ in range(SHIFTS):
        middle = math.sqrt(low * high)
        path = refine_path(dataclasses.replace(problem, k=middle), kept.path, tolerance=1e-5).path
        judged = problem.evaluate(path)
        found = dataclasses.replace(kept, path=path, length=judged.length, risk=judged.risk)
        if not budget.keeps(found):
            broken = found
        elif budget.value(found) < budget.value(best):
            best = found
        low, high = (low, middle) if budget.keeps(found) == budget.on_risk else (middle, high)
    return best if broken is None else bent(problem, budget, best, broken)


def bent(problem: Problem, budget: Budget, kept: Solution, broken: Solution) -> Solution:
    """
    Bend a path that keeps the budget towards one that does not, as far as the budget goes.

    An obstacle or a threat between the two limits how far that is.
    """
    shares = [_shares(path.path) for path in (kept, broken)]
    at = np.union1d(*shares)
    ends = [
        np.column_stack([np.interp(at, share, axis) for axis in path.path.T])
        for share, path in zip(shares, (kept, broken), strict=True)
    ]
    best, low, high = kept, 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        path = (1.0 - middle) * ends[0] + middle * ends[1]
        path[0], path[-1] = problem.start, problem.goal
        judged = problem.evaluate(path)
        fits = judged.feasible and budget.keeps(judged)
        low, high = (middle, high) if fits else (low, middle)
        if fits and budget.value(judged) < budget.value(best):
            best = dataclasses.replace(kept, path=path, length=judged.length, risk=judged.risk)
    return best


def _shares(path: FloatArray) -> FloatArray:
    """How far along a path each waypoint is, from 0 to 1, shape ``(m,)``."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    return np.asarray(along / along[-1])

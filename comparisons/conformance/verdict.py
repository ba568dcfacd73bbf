"""Verdicts on answers, by the oracle and by proven bounds."""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from cgla_graph._text import ShortRepr
from cgla_graph._types import FloatArray
from cgla_graph.comparisons.conformance.documents import AnswerDocument
from cgla_graph.comparisons.conformance.suite import Instance
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import BOUND_TOLERANCE

#: Allowed distance of a path's ends from start and goal, relative to the map's longer side, for rounded numbers.
END_TOLERANCE = 1e-6
#: Relative difference between a planner's own cost and the oracle's from which a message reports it.
COST_TOLERANCE = 1e-6


class Verdict(Enum):
    """
    The verdict on an answer; the value is the sentence.

    Examples
    --------
    >>> Verdict.NO_PATH.label, Verdict.NO_PATH.is_right
    ('no-path', True)
    """

    FEASIBLE = "the path is feasible"
    NO_PATH = "it found no path, and there is none"
    MISSED = "it found no path, but there is one"
    WRONG = "the answer is wrong"
    MALFORMED = "its output is no answer"
    TIMED_OUT = "it took longer than it may"
    OUT_OF_MEMORY = "it needed more memory than it may take"
    CRASHED = "it ended with an error"
    CONTRADICTION = "a path contradicts a proven bound: this is a fault of the suite, not of the planner"

    @property
    def label(self) -> str:
        """The short form for tables and files."""
        return self.name.lower().replace("_", "-")

    @property
    def is_right(self) -> bool:
        """Whether the answer is right."""
        return self in {Verdict.FEASIBLE, Verdict.NO_PATH}


@dataclass(frozen=True)
class Result(ShortRepr):
    """
    The result of one instance.

    Attributes
    ----------
    instance
        The instance.
    verdict
        The verdict.
    message
        One sentence on the fault or on an implausible value; else empty.
    seconds
        Wall-clock time of the planner; NaN if unknown.
    cost, length, risk
        Of its path, by the oracle; NaN without a feasible path.
    waypoints
        Of its path.
    """

    instance: Instance
    verdict: Verdict
    message: str = ""
    seconds: float = math.nan
    cost: float = math.nan
    length: float = math.nan
    risk: float = math.nan
    waypoints: int = 0

    @property
    def gap(self) -> float:
        """At most this much more than the best possible, ``cost / lower_bound - 1``; NaN without a path."""
        lower = self.instance.lower_bound
        return math.nan if lower is None or math.isnan(self.cost) else max(0.0, self.cost / lower - 1.0)

    @property
    def excess(self) -> float:
        """The excess over the best path known, ``cost / upper_bound - 1``: a lower bound on the loss."""
        upper = self.instance.upper_bound
        return math.nan if upper is None or math.isnan(self.cost) else self.cost / upper - 1.0


def judged(instance: Instance, answer: AnswerDocument, seconds: float = math.nan) -> Result:
    """
    Judge an answer.

    Examples
    --------
    >>> from cgla_graph.comparisons.conformance.documents import read_answer
    >>> from cgla_graph.comparisons.conformance.suite import chosen
    >>> straight = judged(chosen(["walls-corner"])[0], read_answer('{"path": [[0.05, 0.5], [0.95, 0.5]]}'))
    >>> straight.verdict.label, straight.message
    ('wrong', 'the path crosses a no-fly area between waypoints 0 (0.05, 0.5) and 1 (0.95, 0.5)')
    """
    if answer.path is None:
        verdict = Verdict.MISSED if instance.has_path else Verdict.NO_PATH
        return Result(instance, verdict, verdict.value if instance.has_path else "", seconds)
    problem = instance.problem.build()
    path = np.array(answer.path, dtype=np.float64)
    if fault := _fault(problem, path):
        return Result(instance, Verdict.WRONG, fault, seconds)
    found = problem.evaluate(path)
    verdict, message = _claims(instance, answer, found.cost)
    # numbers of a wrong answer do not count
    numbers = () if verdict is Verdict.WRONG else (found.cost, found.length, found.risk, len(path))
    return Result(instance, verdict, message, seconds, *numbers)


def _claims(instance: Instance, answer: AnswerDocument, cost: float) -> tuple[Verdict, str]:
    """Compare a feasible path's cost with proven bounds, and the planner's own numbers with its cost."""
    lower, upper = instance.lower_bound, instance.upper_bound
    if lower is None or upper is None:
        return Verdict.CONTRADICTION, f"a path costs {cost:.9g} where it is proven that there is none"
    if cost < lower * (1.0 - BOUND_TOLERANCE):
        return Verdict.CONTRADICTION, f"the path costs {cost:.9g}; it is proven that none costs less than {lower:.9g}"
    best = min(cost, upper)
    if answer.lower_bound is not None and answer.lower_bound > best * (1.0 + BOUND_TOLERANCE):
        return Verdict.WRONG, f"it says that no path costs less than {answer.lower_bound:.9g}; one costs {best:.9g}"
    if answer.cost is not None and not abs(answer.cost - cost) <= COST_TOLERANCE * cost + 1e-12:
        return Verdict.FEASIBLE, f"it says that its path costs {answer.cost:.9g}; it costs {cost:.9g}"
    return Verdict.FEASIBLE, ""


def _fault(problem: Problem, path: FloatArray) -> str:
    """Return why a path is infeasible, in one sentence; empty if feasible. Its ends are corrected within tolerance."""
    x_min, y_min, x_max, y_max = problem.bounds
    allowed = END_TOLERANCE * max(x_max - x_min, y_max - y_min)
    for what, index, end in (("starts", 0, problem.start), ("ends", -1, problem.goal)):
        if math.dist(path[index], end) > allowed:
            return f"the path {what} at {_at(path[index])} instead of {_at(end)}"
        path[index] = end
    if len(path) == 1 and problem.start != problem.goal:
        return "the path has one waypoint; give start and goal at least"
    outside = np.flatnonzero(~problem.in_bounds(path))
    if len(outside):
        number = int(outside[0])
        return f"the path leaves the bounds at waypoint {number} {_at(path[number])}"
    crossing = np.flatnonzero(problem.model.area.crosses(path[:-1], path[1:]))
    if len(crossing):
        number = int(crossing[0])
        ends = f"{number} {_at(path[number])} and {number + 1} {_at(path[number + 1])}"
        return f"the path crosses a no-fly area between waypoints {ends}"
    return "; ".join(problem.evaluate(path).violations)


def _at(point: FloatArray | tuple[float, float]) -> str:
    return f"({point[0]:.9g}, {point[1]:.9g})"

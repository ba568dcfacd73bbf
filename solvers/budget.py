"""Budgets of anytime solvers, the meter of a run, and its best path so far."""

import math
import time
from dataclasses import dataclass, field, replace
from typing import ClassVar

from numpy.typing import ArrayLike

from cgla_graph._validate import number_array
from cgla_graph.errors import SolverSettingError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.solvers.base import Settings


class BudgetSpentError(Exception):
    """The budget ran out in the middle of a planner's step; raised to stop the planner, never leaves a solver."""


@dataclass(frozen=True)
class Budget:
    """
    The limits of a run; the one that is reached first ends it.

    Attributes
    ----------
    iterations
        Steps of the algorithm (some solvers count samples or milestones instead); None: no limit.
    seconds
        Time since the solver started; None: no limit. With it, a seed no longer gives the same path each time.
    evaluations
        Segments weighed by Eq. 5; None: no limit.

    Examples
    --------
    >>> meter = Budget(iterations=2).start()
    >>> meter.iterations = 2
    >>> meter.spent
    '2 iterations'
    """

    iterations: int | None = None
    seconds: float | None = None
    evaluations: int | None = None

    def start(self) -> "Meter":
        """Start the clock."""
        return Meter(self)


class Budgeted(Settings):
    """
    Base of anytime solvers: `seconds`, `evaluations` and the `counted` setting are limits, and one has to be set.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.
    """

    #: The setting that limits the steps of the algorithm.
    counted: ClassVar[str] = "iterations"

    def __post_init__(self) -> None:
        """Check the settings."""
        super().__post_init__()
        if self.budget == Budget():
            msg = f"{self.traits.name}: the run would never end; set {self.counted}, seconds or evaluations"
            raise SolverSettingError(msg)

    @property
    def budget(self) -> Budget:
        """The limits of a run."""
        return Budget(*(getattr(self, name) for name in (self.counted, "seconds", "evaluations")))


@dataclass
class Meter:
    """
    Meter of a run: what it has used of its budget.

    Attributes
    ----------
    budget
        Its limits.
    iterations, evaluations
        As in `Budget`.
    began
        When it started, by `time.perf_counter`.

    Examples
    --------
    >>> meter = Budget(evaluations=1).start()
    >>> meter.charge()
    >>> meter.charge()
    Traceback (most recent call last):
    cgla_graph.solvers.budget.BudgetSpentError: 1 evaluations
    """

    budget: Budget
    iterations: int = 0
    evaluations: int = 0
    began: float = field(default_factory=time.perf_counter)

    def __post_init__(self) -> None:
        """Turn "no limit" into infinity."""
        limits = self.budget
        self.max_iterations = math.inf if limits.iterations is None else limits.iterations
        self.max_evaluations = math.inf if limits.evaluations is None else limits.evaluations
        self.deadline = math.inf if limits.seconds is None else self.began + limits.seconds

    @property
    def seconds(self) -> float:
        """Time since the start."""
        return time.perf_counter() - self.began

    @property
    def late(self) -> bool:
        """Whether the time is up; the clock is only read where there is a limit."""
        return self.deadline < math.inf and time.perf_counter() >= self.deadline

    @property
    def spent(self) -> str:
        """The limit that has been reached, in words; empty if none has."""
        if self.iterations >= self.max_iterations:
            return f"{self.budget.iterations} iterations"
        if self.evaluations >= self.max_evaluations:
            return f"{self.budget.evaluations} evaluations"
        return f"{self.budget.seconds:g} s" if self.late else ""

    def charge(self) -> None:
        """
        Count one evaluation, before it is made.

        Raises
        ------
        BudgetSpentError
            If that would be one too many, or the time is up.
        """
        if self.evaluations >= self.max_evaluations or self.late:
            raise BudgetSpentError(self.spent)
        self.evaluations += 1

    def check_time(self) -> None:
        """
        Check that there is time left.

        Raises
        ------
        BudgetSpentError
            If the time is up.
        """
        if self.late:
            raise BudgetSpentError(self.spent)


@dataclass
class Incumbent:
    """
    The best path of a run so far, as the oracle sees it, and how its cost fell.

    Attributes
    ----------
    problem
        Its oracle judges every path.
    meter
        Gives the time of each path.
    best
        The solver's own answer that holds the best path.
    cost
        The oracle's cost of that path; infinite before the first.
    trace
        One point for each improvement.
    refused
        The last answer that the oracle rejected; None if there was none.

    Examples
    --------
    >>> problem = Problem((0.0, 0.0), (1.0, 0.0))
    >>> incumbent = Incumbent(problem, Budget(iterations=1).start())
    >>> for y in (0.5, 0.9, 0.0):
    ...     path = [(0.0, 0.0), (0.5, y), (1.0, 0.0)]
    ...     incumbent.offer(path, problem.evaluate(path).cost)
    >>> [round(point.cost, 3) for point in incumbent.trace]
    [1.414, 1.0]
    """

    problem: Problem
    meter: Meter
    best: Solution = field(default_factory=lambda: Solution(Status.NOT_FOUND))
    cost: float = math.inf
    trace: list[TracePoint] = field(default_factory=list)
    refused: Solution | None = None

    def offer(self, path: ArrayLike, cost: float) -> None:
        """
        Take a path if it is better than all before.

        Parameters
        ----------
        path
            Waypoints from start to goal, shape ``(m, 2)``, map units.
        cost
            Its cost by the solver. A path that the oracle rejects becomes the answer, so that the run fails.
        """
        seconds = self.meter.seconds
        claimed = Solution(Status.FOUND, path=number_array("path", path), cost=cost)
        judged = self.problem.judge(claimed)
        if not judged.status.has_path:
            self.refused = claimed
        elif judged.cost < self.cost:
            self.best, self.cost = claimed, judged.cost
            self.trace.append(TracePoint(seconds, self.meter.evaluations, judged.cost))

    def solution(self, message: str = "") -> Solution:
        """
        Return the best path with its trace.

        Parameters
        ----------
        message
            The reason if there is no path; by default, the limit that was reached.
        """
        answer = replace(self.refused or self.best, evaluations=self.meter.evaluations)
        if not answer.status.has_path:
            return replace(answer, message=message or self.meter.spent)
        return replace(answer, trace=tuple(self.trace))

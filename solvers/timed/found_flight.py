"""What a search in space and time found."""

from dataclasses import dataclass, field

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.model.solution import Status
from cgla_graph.timed.timed_problem import TimedProblem


@dataclass
class FoundFlight:
    """
    What a search found.

    Attributes
    ----------
    status
        How it ended.
    rows
        The flight, ``(t, x, y)``; empty without one.
    departures
        Least costs by departure, about: ``(t, cost)``.
    evaluations, classes
        Flights whose cost was computed, and classes of ways that were compared.
    message
        What was done, in one line.
    """

    status: Status
    rows: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    departures: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    evaluations: int = 0
    classes: int = 0
    message: str = ""


def arrived(problem: TimedProblem) -> FoundFlight:
    """Return the flight of no length of a problem whose start is its goal."""
    rows = np.array([[problem.departures[0], *problem.start]])
    feasible = problem.evaluate(rows).feasible
    return FoundFlight(Status.FOUND if feasible else Status.INFEASIBLE, rows)

"""What a run may take before it is killed, and what it becomes then."""

import math
from dataclasses import dataclass

from cgla_graph.comparisons.workers.pool import Failure, Outcome
from cgla_graph.model.solution import Status

#: How long a worker may take on top of a run's time limit, to compile kernels for the first time and to load them.
PREPARATION = 600.0

_STATUS = {
    Failure.TIMED_OUT: Status.TIMED_OUT,
    Failure.OUT_OF_MEMORY: Status.OUT_OF_MEMORY,
    Failure.CRASHED: Status.CRASHED,
    Failure.RAISED: Status.FAILED,
}


@dataclass(frozen=True)
class Limits:
    """
    What a run may take before it is killed.

    Attributes
    ----------
    seconds
        Time, of building the graph and solving; above 0.
    megabytes
        Memory on top of what the process holds before the run, in units of 2**20 bytes; above 0.

    Examples
    --------
    >>> Limits(seconds=60.0).megabytes
    4096.0
    """

    seconds: float = 600.0
    megabytes: float = 4096.0

    def spent_memory(self, message: str) -> str:
        """Say that a run was stopped at its memory limit, if it had one."""
        return (
            f"stopped at {self.megabytes:g} MB of memory, the limit of a run: {message}"
            if self.megabytes < math.inf
            else message
        )


#: What does not limit anything: for runs in the user's own process, which no limit may kill.
NO_LIMITS = Limits(math.inf, math.inf)


def lost(outcome: Outcome, limits: Limits) -> tuple[Status, str]:
    """
    Say what became of a run that told nothing, and why.

    Parameters
    ----------
    outcome
        With a failure.
    limits
        Those that it ran under.

    Raises
    ------
    ValueError
        If it did not fail.

    Examples
    --------
    >>> lost(Outcome(failure=Failure.TIMED_OUT), Limits(seconds=2.0))[1]
    'stopped after 2 s, the limit of a run'
    """
    if outcome.failure is None:
        msg = "the outcome is no failure; take its value"
        raise ValueError(msg)
    message = outcome.message
    if outcome.failure is Failure.TIMED_OUT:
        message = f"stopped after {limits.seconds:g} s, the limit of a run"
    elif outcome.failure is Failure.OUT_OF_MEMORY:
        message = limits.spent_memory(message)
    return _STATUS[outcome.failure], message

"""Outcome of a call in another process: its value, or its failure."""

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

from cgla_graph._text import remark
from cgla_graph.errors import UnknownSolverError, WorkerError

#: Characters of an exception's text in which its first line is looked for.
MOST_LOOKED_AT = 10_000


class Failure(Enum):
    """Kinds of failure of a call."""

    TIMED_OUT = "it took longer than it may"
    OUT_OF_MEMORY = "it needed more memory than it may take"
    CRASHED = "its process died"
    RAISED = "it raised an exception"
    NOT_MADE = "it could not be made"
    LOST = "the process that made it was lost"

    @property
    def is_environment(self) -> bool:
        """Whether it says nothing of the call itself, which may be made again when its environment is mended."""
        return self in {Failure.NOT_MADE, Failure.LOST}


@dataclass(frozen=True)
class Outcome:
    """
    Value or failure of a call.

    Attributes
    ----------
    value
        Return value of the function; None if it failed.
    failure
        Kind of failure; None if there is a value.
    message
        Description of the failure, in one line.

    Examples
    --------
    >>> Outcome(failure=Failure.CRASHED, message="its process died of SIGSEGV").failure.value
    'its process died'
    """

    value: Any = None
    failure: Failure | None = None
    message: str = ""


class Reply(NamedTuple):
    """Answer of a worker to a call: the pickled value, or a failure."""

    body: bytes = b""
    failure: Failure | None = None
    message: str = ""
    #: whether the call may have side effects that would disturb the next one
    dirty: bool = False

    def outcome(self) -> Outcome:
        """Read the value."""
        if self.failure is not None:
            return Outcome(None, self.failure, self.message)
        try:
            return Outcome(pickle.loads(self.body))  # noqa: S301 - from a process that this one started
        except Exception as error:  # noqa: BLE001 - a value may be anything
            return Outcome(None, Failure.NOT_MADE, f"its return value cannot be read: {one_line(error)}")


def packed(function: Callable[..., Any], args: tuple[Any, ...]) -> bytes | Outcome:
    """Pickle a call, classes that workers cannot import by value; if it cannot be pickled, return the failure."""
    import cloudpickle  # noqa: PLC0415 - slow to import, and rarely needed

    try:
        return bytes(cloudpickle.dumps((function, args), pickle.HIGHEST_PROTOCOL))
    except Exception as error:  # noqa: BLE001 - arguments may be anything
        return Outcome(None, Failure.NOT_MADE, f"its arguments cannot be sent: {one_line(error)}")


def failure_by(error: BaseException) -> Failure:
    """
    Tell what a call does from what its environment does, by the exception that it raised.

    A module or a solver that is missing, a file, device or connection that fails and lost workers are the
    environment's; a `TimeoutError` is the call's own.

    Examples
    --------
    >>> failure_by(FileNotFoundError()).is_environment, failure_by(ValueError()).is_environment
    (True, False)
    """
    if isinstance(error, MemoryError):
        return Failure.OUT_OF_MEMORY
    is_system = isinstance(error, OSError) and not isinstance(error, TimeoutError)
    outside = is_system or isinstance(error, ImportError | UnknownSolverError | WorkerError)
    return Failure.NOT_MADE if outside else Failure.RAISED


def one_line(error: BaseException) -> str:
    r"""
    Describe an exception in one line, printable and not too long.

    Examples
    --------
    >>> one_line(ValueError("bad\nworse"))
    'ValueError: bad'
    """
    try:
        text = str(error)
    except Exception:  # noqa: BLE001 - the exception may be broken itself
        text = ""
    # (of a text of any size, the first line is looked for at its beginning)
    first = next(iter(text[:MOST_LOOKED_AT].splitlines()), "")
    return remark(f"{type(error).__name__}: {first}" if first else type(error).__name__)

"""
What a call may take, how the kernel holds it to that, and what became of a call that did not end well.

Time after which the process dies, and memory that it does not get: `limited` sets both around the part that counts.
"""

import math
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import Any

from cgla_graph.model.solution import Status

#: Limits of a process; Windows has none.
_resource: Any = None
with suppress(ImportError):
    _resource = import_module("resource")

MEGABYTE = 2**20

_PROCESS = Path("/proc/self")
#: What makes the kernel forget the peak of a process's memory (man 5 proc).
_FORGET_PEAK = "5"
#: Whether this process may be killed; it may not where it is the user's own.
_expendable = False
#: Where the parent reads until when the body may take (a number that both see, `time.monotonic`; 0: no limit now).
_deadline: Any = None


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

    def at_least(self, other: "Limits") -> "Limits":
        """Return the wider of both limits."""
        return Limits(max(self.seconds, other.seconds), max(self.megabytes, other.megabytes))

    def spent_memory(self, message: str) -> str:
        """Say that a run was stopped at its memory limit, if it had one."""
        return (
            f"stopped at {self.megabytes:g} MB of memory, the limit of a run: {message}"
            if self.megabytes < math.inf
            else message
        )


#: What does not limit anything: for runs in the user's own process, which no limit may kill.
NO_LIMITS = Limits(math.inf, math.inf)


class Failure(Enum):
    """Why a call has no value."""

    TIMED_OUT = "it took longer than it may"
    OUT_OF_MEMORY = "it needed more memory than it may take"
    CRASHED = "its process died"
    RAISED = "it raised an exception"


_STATUS = {
    Failure.TIMED_OUT: Status.TIMED_OUT,
    Failure.OUT_OF_MEMORY: Status.OUT_OF_MEMORY,
    Failure.CRASHED: Status.CRASHED,
    Failure.RAISED: Status.FAILED,
}


@dataclass(frozen=True)
class Outcome:
    """
    What came of a call.

    Attributes
    ----------
    value
        What the function returned; None where it failed.
    failure
        Why there is no value; None where there is one.
    message
        What is known of the failure, in one line.

    Examples
    --------
    >>> Outcome(failure=Failure.CRASHED, message="its process died of SIGSEGV").failure.value
    'its process died'
    """

    value: Any = None
    failure: Failure | None = None
    message: str = ""


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


@dataclass(eq=False)
class Usage:
    """
    What the body of `limited` took.

    Attributes
    ----------
    megabytes
        Its peak of resident memory on top of what the process held before, in units of 2**20 bytes; known once it has
        ended, and NaN where the system does not tell.
    """

    megabytes: float = math.nan


def set_expendable(deadline: Any) -> None:  # noqa: ANN401 - a number in shared memory
    """Let `limited` kill this process from now on: it is a worker, whose parent watches the deadline."""
    global _expendable, _deadline
    _expendable, _deadline = True, deadline
    if _resource is not None:
        # crashes are expected: no file of the whole memory for each
        _resource.setrlimit(_resource.RLIMIT_CORE, (0, 0))


@contextmanager
def limited(seconds: float, megabytes: float) -> Iterator[Usage]:
    """
    Limit what the body takes: to be used by a function that a worker calls, around the part that counts.

    Out of time, the process dies there and then, by an alarm whose default action is the kernel's, even if the body is
    stuck in compiled code, holds Python's lock, or has lost the process that asked for it. A body that takes the alarm
    for itself, or stops the process, is killed a moment later from outside. Out of memory, allocations
    fail: Python raises MemoryError, C++ throws ``std::bad_alloc``. Memory counts when it is asked for, used or not,
    and includes the stacks of threads.

    Outside of a worker nothing is limited, only measured; as is on systems that have no such alarm (Windows) or limit
    (macOS).

    Parameters
    ----------
    seconds
        Time by the wall clock, above 0; infinity for no limit.
    megabytes
        Memory on top of what the process holds, in units of 2**20 bytes, above 0; infinity for no limit.

    Yields
    ------
    usage
        What the body took.

    Raises
    ------
    ValueError
        If a limit is not above 0.
    RuntimeError
        If the body of a limit sets another: there is one alarm a process.

    Examples
    --------
    >>> with limited(seconds=60.0, megabytes=1024.0) as usage:
    ...     total = sum(range(1000))
    >>> total, usage.megabytes < 1024.0 or math.isnan(usage.megabytes)
    (499500, True)
    """
    if not (seconds > 0.0 and megabytes > 0.0):
        msg = f"limits are {seconds} s and {megabytes} megabytes; give numbers above 0"
        raise ValueError(msg)
    usage = Usage()
    with _memory_limit(megabytes):
        held = _resident_from_now()
        try:
            with _alarm(seconds):
                yield usage
        finally:
            usage.megabytes = max(0.0, _status("VmHWM") - held) / MEGABYTE


@contextmanager
def _alarm(seconds: float) -> Iterator[None]:
    """Let the kernel kill this process if the body takes longer."""
    if not _expendable or not hasattr(signal, "setitimer") or math.isinf(seconds):
        yield
        return
    if signal.getitimer(signal.ITIMER_REAL)[0]:
        msg = "a limit within a limit: there is one alarm a process; limit the outer or the inner part"
        raise RuntimeError(msg)
    before = signal.signal(signal.SIGALRM, signal.SIG_DFL)
    # the clock counts microseconds, and 0 would stop it
    signal.setitimer(signal.ITIMER_REAL, max(seconds, 1e-6))
    _deadline.value = time.monotonic() + seconds
    try:
        yield
    finally:
        _deadline.value = 0.0
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _memory_limit(megabytes: float) -> Iterator[None]:
    """Let allocations of the body fail beyond so much memory on top of what the process has."""
    held = _status("VmData")
    if not _expendable or _resource is None or not math.isfinite(held + megabytes):
        yield
        return
    # private memory that can be written: unlike the address space, no file that is mapped and no library counts
    before, most = _resource.getrlimit(_resource.RLIMIT_DATA)
    limit = int(held + megabytes * MEGABYTE)
    limits = [limit, *(one for one in (before, most) if one != _resource.RLIM_INFINITY)]
    _resource.setrlimit(_resource.RLIMIT_DATA, (min(limits), most))
    try:
        yield
    finally:
        _resource.setrlimit(_resource.RLIMIT_DATA, (before, most))


def _resident_from_now() -> float:
    """Start to measure the peak of resident memory; return what is resident now, in bytes (NaN: not known)."""
    with suppress(OSError):
        (_PROCESS / "clear_refs").write_text(_FORGET_PEAK, encoding="ascii")
        return _status("VmRSS")
    return math.nan


def _status(name: str) -> float:
    """Read a figure of this process's memory, in bytes; NaN where the system does not tell."""
    with suppress(OSError):
        descriptor = os.open(_PROCESS / "status", os.O_RDONLY)
        try:
            lines = os.read(descriptor, 2**14).decode("ascii", "replace").splitlines()
        finally:
            os.close(descriptor)
        for line in lines:
            if line.startswith(f"{name}:"):
                return float(line.split()[1]) * 1024.0
    return math.nan

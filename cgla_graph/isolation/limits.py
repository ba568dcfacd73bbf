"""
Limits of a call, which the kernel keeps.

Time after which the process dies, and memory that it does not get: `limited` sets both around the part that counts.
"""

import math
import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

#: Limits of a process; Windows has none.
_resource: Any = None
with suppress(ImportError):
    _resource = import_module("resource")

MEGABYTE = 2**20
#: How long a worker may take on top of a time limit, to load kernels or to compile them for the first time, in seconds.
PREPARATION = 600.0

_PROCESS = Path("/proc/self")
#: What makes the kernel forget the peak of a process's memory (man 5 proc).
_FORGET_PEAK = "5"
#: In a process that may be killed, a worker: tells its parent how many seconds the body may take (0: no limit now).
_tell: Callable[[float], None] | None = None


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


def set_expendable(tell: Callable[[float], None]) -> None:
    """Let `limited` kill this process from now on: it is a worker, whose parent is told of its limits."""
    global _tell  # noqa: PLW0603 - a property of the process
    _tell = tell
    if _resource is not None:
        # crashes are expected: no file of the whole memory for each
        _resource.setrlimit(_resource.RLIMIT_CORE, (0, 0))


def is_expendable() -> bool:
    """
    Tell whether this process may be killed: a worker, and not the user's own.

    Examples
    --------
    >>> is_expendable()
    False
    """
    return _tell is not None


@contextmanager
def limited(seconds: float, megabytes: float) -> Iterator[Usage]:
    """
    Limit what the body takes: to be used by a function that a worker calls, around the part that counts.

    Out of time, the process dies there and then, by an alarm whose default action is the kernel's, even if the body is
    stuck in compiled code, holds Python's lock, or has lost the process that asked for it. A body that takes the alarm
    for itself, or stops the process, is killed a moment later from outside. Out of memory, allocations
    fail: Python raises MemoryError, C++ throws ``std::bad_alloc``. Memory counts when it is asked for, used or not,
    and includes the stacks of threads.

    Outside of a worker nothing is limited, only measured. Systems without such an alarm (Windows)
    have the parent watch the time; those without such a limit (macOS) only measure memory.

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
            with limited_time(seconds):
                yield usage
        finally:
            usage.megabytes = max(0.0, _status("VmHWM") - held) / MEGABYTE


@contextmanager
def limited_time(seconds: float) -> Iterator[None]:
    """
    Let the kernel kill this process if the body takes longer; as `limited`, but memory is neither limited nor measured.

    Examples
    --------
    >>> with limited_time(60.0):
    ...     sum(range(1000))
    499500
    """
    if _tell is None or math.isinf(seconds):
        yield
        return
    with _timer(seconds) if hasattr(signal, "setitimer") else nullcontext():
        _tell(seconds)
        try:
            yield
        finally:
            _tell(0.0)


@contextmanager
def _timer(seconds: float) -> Iterator[None]:
    """Set the alarm, and take it away at the end."""
    if signal.getitimer(signal.ITIMER_REAL)[0]:
        msg = "a limit within a limit: there is one alarm a process; limit the outer or the inner part"
        raise RuntimeError(msg)
    before = signal.signal(signal.SIGALRM, signal.SIG_DFL)
    # the clock counts microseconds, and 0 would stop it
    signal.setitimer(signal.ITIMER_REAL, max(seconds, 1e-6))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def _memory_limit(megabytes: float) -> Iterator[None]:
    """Let allocations of the body fail beyond so much memory on top of what the process has."""
    held = _status("VmData")
    if _tell is None or _resource is None or not math.isfinite(held + megabytes):
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

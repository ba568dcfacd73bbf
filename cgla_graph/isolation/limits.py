"""
Limits of time and memory of a call, which the kernel enforces.

`limited` sets both limits around the part of a call that counts.
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
#: Seconds that a worker may take on top of a time limit, to load kernels or to compile them for the first time.
PREPARATION = 600.0

_PROCESS = Path("/proc/self")
#: Command that resets the peak of a process's memory (man 5 proc).
_FORGET_PEAK = "5"
#: In a worker: sends the parent the seconds that the body may take (0: no limit now); None in other processes.
_tell: Callable[[float], None] | None = None


@dataclass(frozen=True)
class Limits:
    """
    Limits of a run, beyond which it is killed.

    Attributes
    ----------
    seconds
        Time for building the graph and solving; above 0.
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
        """Return the message of a run that was stopped at its memory limit, if it had one."""
        return (
            f"stopped at {self.megabytes:g} MB of memory, the limit of a run: {message}"
            if self.megabytes < math.inf
            else message
        )


#: No limits, for runs in the user's own process.
NO_LIMITS = Limits(math.inf, math.inf)


@dataclass(eq=False)
class Usage:
    """
    Memory that the body of `limited` took.

    Attributes
    ----------
    megabytes
        Its peak of resident memory on top of that of the process before, in units of 2**20 bytes; NaN before the body
        has ended and on systems that do not report it.
    """

    megabytes: float = math.nan


def set_expendable(tell: Callable[[float], None]) -> None:
    """Mark this process as a worker, which `limited` may kill; `tell` sends limits to its parent."""
    global _tell  # noqa: PLW0603 - a property of the process
    _tell = tell
    if _resource is not None:
        # (crashes are expected: write no core dumps)
        _resource.setrlimit(_resource.RLIMIT_CORE, (0, 0))


def is_expendable() -> bool:
    """
    Return whether this process may be killed: a worker, not the user's own process.

    Examples
    --------
    >>> is_expendable()
    False
    """
    return _tell is not None


@contextmanager
def limited(seconds: float, megabytes: float) -> Iterator[Usage]:
    """
    Limit time and memory of the body, in a function that a worker calls.

    Out of time, the process dies at once by an alarm of the kernel, even if the body is stuck in compiled code, holds
    Python's lock, or its parent has died. A body that handles the alarm itself, or stops the process, is killed a
    moment later by the parent. Out of memory, allocations fail: Python raises MemoryError, C++ throws
    ``std::bad_alloc``. Memory counts when it is allocated, used or not, and includes the stacks of threads.

    Outside a worker, memory is only measured and nothing is limited. On systems without such an alarm (Windows), the
    parent watches the time; on systems without such a memory limit (macOS), memory is only measured.

    Parameters
    ----------
    seconds
        Time by the wall clock, above 0; infinity for no limit.
    megabytes
        Memory on top of what the process holds, in units of 2**20 bytes, above 0; infinity for no limit.

    Yields
    ------
    usage
        Memory of the body.

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
    Let the kernel kill this process if the body takes longer: `limited` without memory.

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
    """Set the alarm for the body."""
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
    """Let allocations of the body fail beyond so much memory on top of that of the process."""
    held = _status("VmData")
    if _tell is None or _resource is None or not math.isfinite(held + megabytes):
        yield
        return
    # (private writable memory: unlike the address space, it does not count mapped files and libraries)
    before, most = _resource.getrlimit(_resource.RLIMIT_DATA)
    limit = int(held + megabytes * MEGABYTE)
    limits = [limit, *(one for one in (before, most) if one != _resource.RLIM_INFINITY)]
    _resource.setrlimit(_resource.RLIMIT_DATA, (min(limits), most))
    try:
        yield
    finally:
        _resource.setrlimit(_resource.RLIMIT_DATA, (before, most))


def _resident_from_now() -> float:
    """Reset the peak of resident memory; return the resident memory now, in bytes (NaN: unknown)."""
    with suppress(OSError):
        (_PROCESS / "clear_refs").write_text(_FORGET_PEAK, encoding="ascii")
        return _status("VmRSS")
    return math.nan


def _status(name: str) -> float:
    """Read a figure of this process's memory, in bytes; NaN on systems that do not report it."""
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

"""Ctrl-C at any moment: a `KeyboardInterrupt` where it can be caught, and the exit status 130."""

import _thread
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

#: Exit status after Ctrl-C.
INTERRUPTED = 130
#: Seconds until an interrupt that could not be raised is tried again, and for which it waits for an import or LLVM.
AGAIN, LONGEST = 0.02, 10.0
#: Parts of file names of code in which nothing is raised: Python's import system; numba's bridge to LLVM, whose objects
#: may free memory twice if they are left half made; numba's lock, which another thread would wait for for ever; and
#: our own way to machine code, which is short.
_DELICATE = "<frozen importlib", f"{os.sep}llvmlite{os.sep}", f"{os.sep}compiler_lock.py", f"{os.sep}_machine_code.py"

#: When the interrupt that waits was made, 0 if there is none; and whether any was raised.
_since, _is_raised = 0.0, False


def is_interrupt(error: BaseException | None) -> bool:
    """
    Tell whether Ctrl-C is the cause of an exception: Python 3.11 makes a RuntimeError of it in ``__set_name__``.

    Examples
    --------
    >>> try:
    ...     raise RuntimeError("Error calling __set_name__") from KeyboardInterrupt()
    ... except RuntimeError as error:
    ...     is_interrupt(error)
    True
    >>> is_interrupt(RuntimeError())
    False
    """
    found: list[BaseException | None] = [error]
    seen: set[int] = set()
    while found:
        one = found.pop()
        if isinstance(one, KeyboardInterrupt):
            return True
        if one is not None and id(one) not in seen:
            seen.add(id(one))
            found += [one.__cause__, one.__context__, *getattr(one, "exceptions", ())]
    return False


@contextmanager
def held() -> Iterator[None]:
    """
    Raise `KeyboardInterrupt` on Ctrl-C while the body runs, but not where it would be lost.

    Modules of other packages do not bear an interrupt while they are imported: compiled ones print it and raise an
    ImportError, others leave half a module. So it is raised once the import is done. An interrupt that Python could
    only print (in a destructor or a callback of compiled code) is raised a moment later.
    """
    handler, hook = signal.getsignal(signal.SIGINT), sys.unraisablehook
    # (a program of another kind may ignore signals or handle them itself, and only its main thread receives them)
    if handler is not signal.default_int_handler or threading.current_thread() is not threading.main_thread():
        yield
        return

    def unraisable(lost: Any) -> None:  # noqa: ANN401 - as Python's own hook
        if is_interrupt(lost.exc_value):
            _try_again()
        elif not _is_raised:
            # (later, destructors fail of objects that the interrupt left half made)
            hook(lost)

    global _is_raised  # noqa: PLW0603 - handlers take no arguments of ours
    _is_raised = False
    signal.signal(signal.SIGINT, _raise_where_safe)
    sys.unraisablehook = unraisable
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        sys.unraisablehook = hook


def leave_at_once() -> None:
    """End the process on Ctrl-C from now on, without cleaning up: all that is left is to exit."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: os._exit(INTERRUPTED))


def _raise_where_safe(number: int, frame: FrameType | None) -> None:
    """Raise `KeyboardInterrupt`, unless delicate code is running, as an import: then try again soon."""
    global _since, _is_raised  # noqa: PLW0603 - handlers take no arguments of ours
    del number
    now = time.monotonic()
    _since = _since or now
    if now - _since < LONGEST and _is_delicate(frame):
        _try_again()
        return
    _since, _is_raised = 0.0, True
    raise KeyboardInterrupt


def _is_delicate(frame: FrameType | None) -> bool:
    while frame is not None:
        if any(part in frame.f_code.co_filename for part in _DELICATE):
            return True
        frame = frame.f_back
    return False


def _try_again() -> None:
    """Interrupt the main thread once more, soon."""

    def later() -> None:
        time.sleep(AGAIN)
        _thread.interrupt_main()

    # (not threading.Thread: a handler must not wait for a lock that the interrupted code holds)
    _thread.start_new_thread(later, ())

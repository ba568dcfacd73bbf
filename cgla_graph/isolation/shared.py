"""Worker processes that a program shares: one for the calls of a module, started at the first of them."""

import os
import threading
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

from cgla_graph.isolation.outcome import Outcome

if TYPE_CHECKING:
    from cgla_graph.isolation.process import WorkerProcess

#: Held while a worker works.
_working = threading.Lock()


def call_apart(
    function: Callable[..., Any],
    args: tuple[Any, ...],
    seconds: float,
    tell: Callable[[str, str], None] | None = None,
) -> Outcome:
    """
    Call an importable function in the worker of its module, as `WorkerProcess.make` does, one call at a time.

    Examples
    --------
    >>> import math
    >>> call_apart(math.sqrt, (16.0,), seconds=60.0).value
    4.0
    """
    with _working:
        return _worker(function.__module__).make(function, args, seconds, tell)


@cache
def _worker(module: str) -> "WorkerProcess":
    from cgla_graph.isolation.process import WorkerProcess  # noqa: PLC0415 - slow to import, and rarely needed

    return WorkerProcess([module])


def _forget_workers() -> None:
    """Let a forked copy of this process start workers of its own."""
    global _working  # noqa: PLW0603 - it may have been held
    _worker.cache_clear()
    _working = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_workers)

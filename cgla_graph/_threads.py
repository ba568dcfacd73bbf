"""Threads that share out work: kernels, SciPy and GEOS let other threads run."""

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

#: Below this many nodes, threads cost more than they save.
THREADED_FROM = 200
#: So many tasks at most run side by side: more would wait for Python.
MOST_THREADS = 4

_thread = threading.local()
T = TypeVar("T")
R = TypeVar("R")


def n_cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def side_by_side(task: Callable[[T], R], items: Sequence[T]) -> Iterator[R]:
    """
    Run a task for each of some items, in threads that do not share out their own work; return the results in order.

    A single item stays in this thread, where its work is shared out.

    Examples
    --------
    >>> list(side_by_side(lambda number: (number, stays_alone()), range(2)))
    [(0, True), (1, True)]
    """
    if len(items) <= 1:
        yield from map(task, items)
        return
    most = min(n_cores(), MOST_THREADS)
    with ThreadPoolExecutor(most, initializer=lambda: setattr(_thread, "alone", True)) as pool:
        yield from pool.map(task, items)


def stays_alone() -> bool:
    """Return whether this thread is one of `side_by_side`."""
    return getattr(_thread, "alone", False)


def share_out(task: Callable[[int, int], None], n_items: int) -> None:
    """
    Run a task on all cores: ``task(first, step)`` for the items `first`, ``first + step``, …, one thread each.

    Few items (below `THREADED_FROM`) stay in this thread, and so do all items of a thread of `side_by_side`.

    Examples
    --------
    >>> share_out(lambda first, step: print(first, step), n_items=10)
    0 1
    """
    step = n_cores() if n_items >= THREADED_FROM and not stays_alone() else 1
    if step == 1:
        task(0, 1)
        return
    with ThreadPoolExecutor(step) as pool:
        list(pool.map(lambda first: task(first, step), range(step)))


def in_parts(task: Callable[[slice], None], n_items: int, *, size: int = 1) -> None:
    """
    Run a task on all cores: ``task(part)`` for consecutive items, one thread each.

    Little work (below ten times `THREADED_FROM` items of size 1) stays in this thread.

    Examples
    --------
    >>> in_parts(lambda part: print(part), n_items=10)
    slice(0, 10, None)
    """
    share_out(
        lambda first, step: task(slice(first * n_items // step, (first + 1) * n_items // step)),
        n_items=n_items * size // 10,
    )

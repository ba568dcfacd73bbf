"""
A pool of worker processes: a call that hangs, crashes or runs out of memory is an outcome, and the others go on.

Each call has two limits. The function itself sets the inner one, `limited`, around the part that is measured; the
operating system enforces it even after the parent has died. The outer one replaces a worker that died or is late (see
`cgla_graph.isolation.process`).
"""

import os
import queue
import threading
from collections.abc import Callable, Generator, Hashable, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any, NamedTuple, TypeAlias

from cgla_graph.isolation.outcome import Outcome, failure_by, one_line
from cgla_graph.isolation.process import WorkerProcess

#: Calls that wait for each worker, so that it stays busy while the caller handles an outcome.
AHEAD = 1


class Call(NamedTuple):
    """
    A call for another process.

    Attributes
    ----------
    key
        The caller's name for it.
    function
        From a module that the other process can import.
    args
        Its arguments, which can be pickled.
    """

    key: Hashable
    function: Callable[..., Any]
    args: tuple[Any, ...] = ()


#: Called whenever a worker can take a call; returns None if there is none at the moment.
NextCall: TypeAlias = Callable[[], Call | None]
_Asked: TypeAlias = "queue.SimpleQueue[Call | None]"
_Ended: TypeAlias = "queue.SimpleQueue[tuple[Call, Outcome | BaseException]]"


def isolated(
    next_call: NextCall, *, workers: int, seconds: float, preload: Sequence[str] = ()
) -> Generator[tuple[Call, Outcome]]:
    """
    Make calls in worker processes, several at a time, and yield each outcome as soon as it is known.

    A worker that dies is replaced, and so is one whose call left threads or processes behind. Each worker is bound to
    its share of this process's cores, so that no call slows another down. Their output goes to standard error. All
    workers end with the iteration, and when this process dies.

    Parameters
    ----------
    next_call
        Returns the next call. It is asked whenever a worker can take one (at most one runs and one waits, so that calls
        start in this order). After None it is asked again when the next call has ended.
    workers
        Number of processes, at least 1.
    seconds
        Wall-clock time after which a call is killed that no `limited` has stopped, above 0.
    preload
        Modules to load before the first call. They are loaded once for all workers; in later iterations each worker
        loads modules that are new.

    Yields
    ------
    call, outcome
        As calls end, until none is running and `next_call` returns None.

    Raises
    ------
    WorkerError
        If workers do not start.
    ValueError
        If `workers` or `seconds` is too small.

    Examples
    --------
    >>> import math
    >>> calls = [Call("root", math.sqrt, (16.0,)), Call("no root", math.sqrt, (-1.0,))]
    >>> waiting = iter(calls)
    >>> for call, outcome in isolated(lambda: next(waiting, None), workers=1, seconds=60.0):
    ...     print(call.key, outcome.value, outcome.message)
    root 4.0
    no root None ValueError: math domain error
    """
    if workers < 1 or not seconds > 0.0:
        msg = f"workers is {workers} and seconds {seconds}; give at least 1 worker and more than 0 seconds"
        raise ValueError(msg)
    asked: _Asked = queue.SimpleQueue()
    ended: _Ended = queue.SimpleQueue()
    processes = [WorkerProcess(preload, cores) for cores in shares(workers)]
    # daemon threads: a program that ends early does not wait for them
    given = [(process, asked, ended, seconds) for process in processes]
    threads = [threading.Thread(target=_serve, args=each, daemon=True) for each in given]
    for thread in threads:
        thread.start()
    n_under_way = 0
    try:
        while True:
            while n_under_way < workers * (1 + AHEAD) and (call := next_call()) is not None:
                asked.put(call)
                n_under_way += 1
            if not n_under_way:
                return
            yield _next(ended)
            n_under_way -= 1
    finally:
        for process in processes:
            asked.put(None)
            process.stop()
        for process, thread in zip(processes, threads, strict=True):
            process.join()
            thread.join()


def _serve(process: WorkerProcess, asked: _Asked, ended: _Ended, seconds: float) -> None:
    """Pass calls to a worker process, one after the other."""
    while (call := asked.get()) is not None:
        try:
            ended.put((call, process.make(call.function, call.args, seconds)))
        except CancelledError:
            return
        except BaseException as error:  # noqa: BLE001 - `_next` raises it
            ended.put((call, error))


def _next(ended: _Ended) -> tuple[Call, Outcome]:
    """Wait for the next call to end."""
    while True:
        # in steps: on Windows, Ctrl-C does not interrupt a wait
        with suppress(queue.Empty):
            call, outcome = ended.get(timeout=0.5)
            break
    if isinstance(outcome, BaseException):
        raise outcome
    return call, outcome


def here(next_call: NextCall) -> Generator[tuple[Call, Outcome]]:
    """
    Make calls in this process, one after the other and without isolation, for debugging.

    Yields
    ------
    call, outcome
        As calls end.

    Examples
    --------
    >>> import math
    >>> waiting = iter([Call("root", math.sqrt, (16.0,))])
    >>> [outcome.value for call, outcome in here(lambda: next(waiting, None))]
    [4.0]
    """
    while (call := next_call()) is not None:
        try:
            outcome = Outcome(call.function(*call.args))
        except (Exception, SystemExit) as error:  # noqa: BLE001 - as in a worker, except Ctrl-C
            outcome = Outcome(None, failure_by(error), one_line(error))
        yield call, outcome


def shares(workers: int) -> list[Sequence[int] | None]:
    """
    Divide this process's cores into equal shares, so that times compare; None where the system cannot bind cores.

    Examples
    --------
    >>> [cores is None or len(cores) > 0 for cores in shares(3)]
    [True, True, True]
    """
    if not hasattr(os, "sched_getaffinity"):
        return [None] * workers
    cores = sorted(os.sched_getaffinity(0))
    size = max(1, len(cores) // workers)
    return [[cores[(worker * size + core) % len(cores)] for core in range(size)] for worker in range(workers)]

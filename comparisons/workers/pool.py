"""
Calls in processes of their own: one that hangs, crashes or eats memory is an outcome, and the others go on.

Two limits stand around a call. The inner one, `limited`, is set by the function
itself around the part that counts: the kernel keeps it, even when the parent has died.
The outer one notices that a worker died or is late, and replaces it (see `process`).
"""

import os
import queue
import threading
from collections.abc import Callable, Generator, Hashable, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any, NamedTuple, TypeAlias

from cgla_graph.isolation.outcome import Failure, Outcome, one_line
from cgla_graph.isolation.process import WorkerProcess

#: How many calls wait for each worker, so that it has something to do while the caller is busy with an outcome.
AHEAD = 1


class Call(NamedTuple):
    """
    A call to be made elsewhere.

    Attributes
    ----------
    key
        By which the caller knows it again.
    function
        Of a module that the other process can import.
    args
        What it is called with; they can be pickled.
    """

    key: Hashable
    function: Callable[..., Any]
    args: tuple[Any, ...] = ()


#: Asked whenever a worker can take more; answers None if there is nothing to do right now.
NextCall: TypeAlias = Callable[[], Call | None]
_Asked: TypeAlias = "queue.SimpleQueue[Call | None]"
_Ended: TypeAlias = "queue.SimpleQueue[tuple[Call, Outcome | BaseException]]"


def isolated(
    next_call: NextCall, *, workers: int, seconds: float, preload: Sequence[str] = ()
) -> Generator[tuple[Call, Outcome]]:
    """
    Make calls in worker processes, several at a time, and hand on what comes of each as soon as it ends.

    A worker that dies is replaced, and so is one whose call left threads or processes behind. Workers share the cores
    of this process out evenly and stay on theirs, so that no call slows another down. What they print goes to standard
    error. All end with the iteration, and when this process dies.

    Parameters
    ----------
    next_call
        Asked for a call whenever a worker can take one more (at most one runs and one waits, so that they are begun in
        the order in which they are asked for). After None it is asked again when the next call has ended.
    workers
        How many processes, at least 1.
    seconds
        When to give up a call that no `limited` has stopped, above 0: time by the wall clock from its start.
    preload
        Modules to be loaded before the first call. They are loaded once for all workers, but not again for the workers
        of a later iteration, which load what is new each on their own.

    Yields
    ------
    call, outcome
        As calls end. It is over when none is under way and `next_call` says None.

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
    # daemons: a program that ends in the middle must not wait for them
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
    """Hand calls to a worker process, one after the other."""
    while (call := asked.get()) is not None:
        try:
            ended.put((call, process.make(call.function, call.args, seconds)))
        except CancelledError:
            return
        except BaseException as error:  # noqa: BLE001 - raised where outcomes are waited for
            ended.put((call, error))


def _next(ended: _Ended) -> tuple[Call, Outcome]:
    """Wait for the next call to end."""
    while True:
        # in steps, as Ctrl-C does not break into a wait on Windows
        with suppress(queue.Empty):
            call, outcome = ended.get(timeout=0.5)
            break
    if isinstance(outcome, BaseException):
        raise outcome
    return call, outcome


def here(next_call: NextCall) -> Generator[tuple[Call, Outcome]]:
    """
    Make calls in this process, one after the other, without any isolation: for debugging.

    Parameters
    ----------
    next_call
        As `isolated` has it.

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
        except MemoryError as error:
            outcome = Outcome(None, Failure.OUT_OF_MEMORY, one_line(error))
        except (Exception, SystemExit) as error:  # noqa: BLE001 - as in a worker; but the user's Ctrl-C ends it all
            outcome = Outcome(None, Failure.RAISED, one_line(error))
        yield call, outcome


def shares(workers: int) -> list[Sequence[int] | None]:
    """
    Share the cores of this process out: as many for each worker, so that times compare; None where none can be chosen.

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

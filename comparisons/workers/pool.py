"""
Calls in processes of their own: one that hangs, crashes or eats memory is an outcome, and the others go on.

Nothing here knows what is called. Two fences stand around a call. The inner one, `limited`, is set by the function
itself around the part that counts: limits that the kernel keeps, whatever the code does and however its parent died.
The outer one notices that a worker died or is late, and replaces it (see `process`).
"""

import os
import pickle
import queue
import threading
from collections.abc import Callable, Generator, Hashable, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import Any, NamedTuple, TypeAlias

from cgla_graph.isolation.outcome import Failure, Outcome, Reply, one_line
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
    pool = _Pool([WorkerProcess(preload, cores) for cores in shares(workers)], seconds)
    try:
        while True:
            while pool.n_under_way < workers * (1 + AHEAD) and (call := next_call()) is not None:
                pool.begin(call)
            if not pool.n_under_way:
                return
            yield pool.ended()
    finally:
        pool.dismiss()


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


def packed(call: Call) -> bytes | Outcome:
    """Pickle a call; one that cannot be sent is an outcome, too."""
    try:
        return pickle.dumps((call.function, call.args), pickle.HIGHEST_PROTOCOL)
    except Exception as error:  # noqa: BLE001 - arguments may be anything
        return Outcome(None, Failure.RAISED, f"what it is called with cannot be sent: {one_line(error)}")


class _Pool:
    """Threads, each of which hands calls to one worker process and waits for it."""

    def __init__(self, workers: Sequence[WorkerProcess], seconds: float) -> None:
        self.n_under_way = 0
        self._workers = workers
        self._seconds = seconds
        self._waiting: queue.SimpleQueue[tuple[Call, bytes] | None] = queue.SimpleQueue()
        self._ended: queue.SimpleQueue[tuple[Call, Outcome | Reply | BaseException]] = queue.SimpleQueue()
        # daemons: a program that ends in the middle must not wait for them
        self._threads = [threading.Thread(target=self._serve, args=(worker,), daemon=True) for worker in workers]
        for thread in self._threads:
            thread.start()

    def begin(self, call: Call) -> None:
        """Put a call at the end of the line."""
        self.n_under_way += 1
        payload = packed(call)
        if isinstance(payload, Outcome):
            self._ended.put((call, payload))
        else:
            self._waiting.put((call, payload))

    def ended(self) -> tuple[Call, Outcome]:
        """Wait for the next call to end."""
        while True:
            # in steps, as Ctrl-C does not break into a wait on Windows
            with suppress(queue.Empty):
                call, answer = self._ended.get(timeout=0.5)
                break
        self.n_under_way -= 1
        if isinstance(answer, BaseException):
            raise answer
        return call, answer if isinstance(answer, Outcome) else answer.outcome()

    def dismiss(self) -> None:
        """End everything, whatever is under way."""
        for _ in self._threads:
            self._waiting.put(None)
        for worker in self._workers:
            worker.stop()
        for worker in self._workers:
            worker.join()
        for thread in self._threads:
            thread.join()

    def _serve(self, worker: WorkerProcess) -> None:
        while (item := self._waiting.get()) is not None:
            call, payload = item
            try:
                self._ended.put((call, worker.run(payload, self._seconds)))
            except CancelledError:
                return
            except BaseException as error:  # noqa: BLE001 - told by `ended`
                self._ended.put((call, error))

"""
Calls on a running Dask cluster, each in a process of its own.

Dask schedules calls and repeats those of lost machines. Killing one of its workers loses all that the worker holds, so
Dask's workers make no call themselves: each of their threads uses a worker process of ours.
"""

import socket
import threading
import uuid
from collections import defaultdict
from collections.abc import Generator, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from importlib import import_module
from typing import Any

from cgla_graph.comparisons.workers.pool import AHEAD, Call, NextCall
from cgla_graph.errors import WorkerError
from cgla_graph.isolation.outcome import Failure, Outcome, Reply, one_line, packed
from cgla_graph.isolation.process import WorkerProcess

#: Seconds that a scheduler may take to answer.
CONNECT_SECONDS = 10.0


def spread(
    next_call: NextCall, *, scheduler: str, seconds: float, preload: Sequence[str] = ()
) -> Generator[tuple[Call, Outcome]]:
    """
    Make calls on a Dask cluster, and yield each outcome as soon as it is known.

    All machines need the same version of this package and of the packages that calls use. Machines may come and go:
    calls of a lost machine start again on another one, and a call that ends several machines has crashed. Without
    machines, calls wait. Other programs on the cluster are not affected.

    Parameters
    ----------
    next_call
        As `cgla_graph.comparisons.workers.pool.isolated` has it; it is asked for two calls a thread of the cluster.
    scheduler
        Address of the scheduler, as ``tcp://127.0.0.1:8786`` or ``127.0.0.1:8786``.
    seconds
        Wall-clock time after which a call is killed that no `limited` has stopped, above 0.
    preload
        Modules to load before the first call.

    Yields
    ------
    call, outcome
        As calls end, until none is running and `next_call` returns None.

    Raises
    ------
    WorkerError
        If Dask is not installed, the scheduler cannot be reached or is lost, or its machines lack what they need.
    """
    dask = _dask()
    client = _connect(dask, scheduler)
    study = uuid.uuid4().hex
    under_way: dict[str, tuple[Call, Any]] = {}
    ended = dask.as_completed(loop=client.loop)
    try:
        while True:
            capacity = _capacity(client)
            while len(under_way) < capacity and (call := next_call()) is not None:
                payload = packed(call.function, call.args)
                if isinstance(payload, Outcome):
                    yield call, payload
                    continue
                future = client.submit(_run, study, payload, seconds, tuple(preload), key=f"cgla-{uuid.uuid4().hex}")
                under_way[future.key] = call, future
                ended.add(future)
            if not under_way:
                return
            call, future = under_way.pop(next(ended).key)
            yield call, _outcome(dask, future)
    except (CancelledError, OSError) as error:
        msg = f"the Dask scheduler at {scheduler!r} is lost ({type(error).__name__}); start one, and go on (--resume)"
        raise WorkerError(msg) from error
    finally:
        _dismiss(dask, client, scheduler, study, [future for _, future in under_way.values()])


def _dask() -> Any:  # noqa: ANN401 - a module that has no types
    """Import `distributed`, the package of Dask's clusters."""
    try:
        return import_module("distributed")
    except ImportError as error:
        msg = f"a Dask cluster needs a package that is not there ({error}): pip install 'cgla-graph[distributed]'"
        raise WorkerError(msg) from error


def _connect(dask: Any, scheduler: str) -> Any:  # noqa: ANN401 - a module and a client that have no types
    try:
        _ring(dask, scheduler)
        return dask.Client(scheduler, timeout=CONNECT_SECONDS, set_as_default=False, name="cgla")
    except (OSError, ValueError, TypeError, ImportError) as error:
        remedy = "`dask scheduler` starts one and says where"
        msg = f"no Dask scheduler answers at {scheduler!r} ({one_line(error)}); {remedy}"
        raise WorkerError(msg) from error


def _ring(dask: Any, scheduler: str) -> None:  # noqa: ANN401 - a module that has no types
    """Fail at once if there is no scheduler; Dask's client would try again and again."""
    with socket.create_connection(dask.comm.get_address_host_port(scheduler), CONNECT_SECONDS) as line:
        # a scheduler speaks first, except over TLS; with any other server the client would wait without end
        if dask.comm.parse_address(scheduler)[0] == "tcp" and not line.recv(1):
            msg = "it hangs up"
            raise OSError(msg)


def _capacity(client: Any) -> int:  # noqa: ANN401 - a client that has no types
    """Count the calls that may be queued at once; at least one, because some clusters grow with their work."""
    n_threads: int = sum(client.nthreads().values())
    return max(1, n_threads * (1 + AHEAD))


def _outcome(dask: Any, future: Any) -> Outcome:  # noqa: ANN401 - a module and a future that have no types
    """Read the outcome of a call; calls raise nothing, so exceptions are the cluster's."""
    try:
        reply: Reply = future.result()
        return reply.outcome()
    except dask.KilledWorker as error:
        n_lost = error.allowed_failures + 1
        return Outcome(None, Failure.CRASHED, f"{n_lost} workers of the cluster died of it, one after the other")
    except (CancelledError, OSError, WorkerError):
        raise
    except Exception as error:
        msg = f"the workers of the Dask cluster lack what this program has; install the same there ({one_line(error)})"
        raise WorkerError(msg) from error


def _dismiss(dask: Any, client: Any, scheduler: str, study: str, futures: Sequence[Any]) -> None:  # noqa: ANN401 - a module and a client that have no types
    """Cancel calls and end the processes of this study, if the cluster can still be reached."""
    with suppress(Exception):
        if client.status == "running":
            # the client would wait for a scheduler whose loss it has not noticed
            _ring(dask, scheduler)
            client.cancel(list(futures))
            client.run(_leave, study, on_error="ignore")
    with suppress(Exception):
        client.close(timeout=CONNECT_SECONDS)


# ---- in a worker of the cluster ----


class _Processes:
    """The worker processes of one study in a Dask worker, one per thread that has made a call."""

    def __init__(self) -> None:
        self.all: list[WorkerProcess] = []
        self.free: list[WorkerProcess] = []
        self.over = False


_STOPPED = Reply(failure=Failure.CRASHED, message="its study was stopped")
_lock = threading.Lock()
_processes: defaultdict[str, _Processes] = defaultdict(_Processes)


def _run(study: str, call: bytes, seconds: float, preload: tuple[str, ...]) -> Reply:
    """Make a call in a worker process of ours."""
    with _lock:
        mine = _processes[study]
        if not mine.over and not mine.free:
            mine.free.append(WorkerProcess(preload))
            mine.all.append(mine.free[-1])
        worker = mine.free.pop() if mine.free and not mine.over else None
    if worker is None:
        return _STOPPED
    try:
        return worker.run(call, seconds)
    except CancelledError:
        return _STOPPED
    finally:
        with _lock:
            mine.free.append(worker)


def _leave(study: str) -> None:
    """End all processes of a study in this Dask worker; later calls of it fail."""
    with _lock:
        _processes[study].over = True
        workers = list(_processes[study].all)
    for worker in workers:
        worker.stop()
    for worker in workers:
        worker.join()

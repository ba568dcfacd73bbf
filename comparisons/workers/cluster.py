"""
Calls on a running Dask cluster, each in a process of its own.

Dask schedules calls and repeats those of lost machines. Killing one of its workers loses all that the worker holds, so
Dask's workers make no call themselves: each of their threads uses a worker process of ours.
"""

import asyncio
import importlib.metadata
import queue
import socket
import threading
import time
import uuid
import warnings
from collections import defaultdict
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from importlib import import_module
from typing import Any

from cgla_graph._text import listed
from cgla_graph.comparisons.workers.environment import MISSING, differences, needed_by
from cgla_graph.comparisons.workers.pool import AHEAD, Call, NextCall
from cgla_graph.errors import WorkerError
from cgla_graph.isolation.outcome import Failure, Outcome, Reply, one_line, packed
from cgla_graph.isolation.process import WorkerProcess

#: Seconds that a scheduler may take to answer.
CONNECT_SECONDS = 10.0
#: Seconds that a scheduler may be without workers, and until that is said.
WORKER_SECONDS, QUIET_SECONDS = 30.0, 3.0
#: Seconds between two looks at workers while no call ends.
GLANCE = 1.0


def spread(
    next_call: NextCall, *, scheduler: str, seconds: float, preload: Sequence[str] = (), solvers: Sequence[str] = ()
) -> Generator[tuple[Call, Outcome]]:
    """
    Make calls on a Dask cluster, and yield each outcome as soon as it is known.

    All machines need the same Python and the same versions of this package, of the packages that results depend on and
    of plug-in solvers; this is checked before the first call, and on machines that come later. Machines may come and
    go: calls of a lost machine start again on another one; if several machines are lost with a call, it is not made.
    Calls wait for a machine for half a minute, which a warning says. Other programs on the cluster are not affected.

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
    solvers
        Names of the solvers that calls use.

    Yields
    ------
    call, outcome
        As calls end, until none is running and `next_call` returns None.

    Raises
    ------
    WorkerError
        If Dask is not installed, the scheduler cannot be reached, has no workers or is lost, or workers lack what
        they need.
    """
    dask = _dask()
    client = _connect(dask, scheduler)
    study, wanted = uuid.uuid4().hex, needed_by(solvers)
    under_way: dict[str, tuple[Call, Any]] = {}
    ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
    try:
        _check_workers(client, scheduler, study, wanted)
        while True:
            capacity = _capacity(client)
            while len(under_way) < capacity and (call := next_call()) is not None:
                payload = packed(call.function, call.args)
                if isinstance(payload, Outcome):
                    yield call, payload
                    continue
                arguments = (study, wanted, payload, seconds, tuple(preload))
                future = client.submit(_run, *arguments, key=f"cgla-{uuid.uuid4().hex}")
                under_way[future.key] = call, future
                future.add_done_callback(ended.put)
            if not under_way:
                return
            call, future = under_way.pop(_next(client, scheduler, ended).key)
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


def _check_workers(client: Any, scheduler: str, study: str, wanted: Mapping[str, str]) -> None:  # noqa: ANN401 - a client that has no types
    """Wait for workers, and check that they have what this program has."""
    if not client.nthreads():
        # (clusters that grow with their work need some)
        asked = client.submit(socket.gethostname, pure=False)
        _await_workers(client, scheduler, time.monotonic())
        del asked
    own, lacking = wanted["cgla-graph"], {}
    if own != MISSING:
        # (functions of this package can be sent only to workers that have it)
        there = client.run(importlib.metadata.version, "cgla-graph", on_error="return")
        lacking = {where: f"cgla-graph {_text(one)} (wanted: {own!r})" for where, one in there.items() if one != own}
    if not lacking:
        there = client.run(_lacking_text, study, dict(wanted), on_error="return")
        lacking = {where: _text(one) for where, one in there.items() if one}
    if lacking:
        said = [f"{where}: {why}" for where, why in lacking.items()]
        msg = f"workers of the Dask cluster differ from this program ({listed(said, 2)}); install the same there"
        raise WorkerError(msg)


def _text(answer: object) -> str:
    """Return what a worker answered, which may be an exception."""
    return one_line(answer) if isinstance(answer, BaseException) else str(answer)


def _await_workers(client: Any, scheduler: str, since: float) -> None:  # noqa: ANN401 - the same
    """Wait until the cluster has a worker; it has had none since a moment."""
    is_said = False
    while not client.nthreads():
        waited = time.monotonic() - since
        if waited > WORKER_SECONDS:
            msg = f"the Dask scheduler at {scheduler!r} has no workers; `dask worker {scheduler}` starts one"
            raise WorkerError(msg)
        if waited > QUIET_SECONDS and not is_said:
            left = WORKER_SECONDS - waited
            warnings.warn(f"the Dask scheduler has no workers; waiting up to {left:.0f} s for one", stacklevel=2)
            is_said = True
        time.sleep(min(GLANCE, WORKER_SECONDS / 10.0))


def _next(client: Any, scheduler: str, ended: "queue.SimpleQueue[Any]") -> Any:  # noqa: ANN401 - the same
    """Wait for the next call to end, as long as there are workers."""
    while True:
        began = time.monotonic()
        with suppress(queue.Empty):
            return ended.get(timeout=GLANCE)
        if client.status == "running" and not client.nthreads():
            _await_workers(client, scheduler, began)


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
        said = f"{n_lost} workers of the cluster were lost while they made it, one after the other; see their logs"
        return Outcome(None, Failure.LOST, said)
    except (CancelledError, OSError, WorkerError):
        raise
    except Exception as error:
        msg = f"the workers of the Dask cluster lack packages; install them ({one_line(error)})"
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
        #: how this machine differs from the program; None before that is known
        self.lacking: str | None = None


_STOPPED = Reply(failure=Failure.LOST, message="its study was stopped")
_lock = threading.Lock()
_processes: defaultdict[str, _Processes] = defaultdict(_Processes)


async def _lacking_text(study: str, wanted: Mapping[str, str]) -> str:
    """Say how this machine differs from the program, without keeping Dask's worker from its own work."""
    return await asyncio.to_thread(_lacking, study, wanted)


def _lacking(study: str, wanted: Mapping[str, str]) -> str:
    """Say how this machine differs from the program; it is looked at once."""
    mine = _processes[study]
    if mine.lacking is None:
        mine.lacking = differences(wanted)
    return mine.lacking


def _run(study: str, wanted: Mapping[str, str], call: bytes, seconds: float, preload: tuple[str, ...]) -> Reply:
    """Make a call in a worker process of ours."""
    if lacking := _lacking(study, wanted):
        return Reply(failure=Failure.NOT_MADE, message=lacking)
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
    except (OSError, WorkerError) as error:
        return Reply(failure=Failure.NOT_MADE, message=f"on {socket.gethostname()}: {one_line(error)}")
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

"""A worker process: calls are made there one after the other, and one that is lost is replaced."""

import ctypes
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing import connection
from typing import Any, NamedTuple

from pebble import ProcessExpired, ProcessPool

from cgla_graph.comparisons.workers.limits import Failure, Outcome, set_expendable
from cgla_graph.errors import WorkerError
from cgla_graph.model import isolated

#: How long a worker may take to start, in seconds, before it is given up.
START_SECONDS = 120.0
#: How many workers in a row may be lost before they took up their call.
STARTS = 3
#: How long a call may outlive its own limit before it is killed from here, and how often that is looked at, in seconds.
GRACE, GLANCE = 1.0, 0.5

# A fork of a process that has loaded everything is there in no time, and has none of this process's threads and locks.
_METHOD = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
_CONTEXT = multiprocessing.get_context(_METHOD)
_POSIX = os.name == "posix"
#: What stands for the exit code 0, which pebble takes for a worker that has done its work.
_LEFT_QUIETLY = 1 << 16
_HINTS = {
    "SIGABRT": ", as compiled code does that finds no memory",
    "SIGKILL": ", which may mean that memory ran out",
}
#: A call that anybody survives.
_NOTHING = pickle.dumps((bool, ()))
_starting = threading.Lock()
#: Whether this process, a worker, is to be replaced after the call that is under way.
_used_up = False
#: Of prctl: which signal a process gets when its parent dies.
_PR_SET_PDEATHSIG = 1


class Reply(NamedTuple):
    """What came of a call: its value, pickled, or a failure."""

    body: bytes = b""
    failure: Failure | None = None
    message: str = ""
    #: whether something may be left of it that would disturb the calls after it
    dirty: bool = False

    def outcome(self) -> Outcome:
        """Read what a worker sent."""
        if self.failure is not None:
            return Outcome(None, self.failure, self.message)
        try:
            return Outcome(pickle.loads(self.body))  # noqa: S301 - from a process that this one started
        except Exception as error:  # noqa: BLE001 - a value may be anything
            return Outcome(None, Failure.RAISED, f"what it returned cannot be read: {one_line(error)}")


class WorkerProcess:
    """
    One worker process, which is started when first used, and replaced when it is lost.

    Parameters
    ----------
    preload
        Modules to be loaded before the first call.
    cores
        Where the worker may run; None for anywhere.
    """

    def __init__(self, preload: Iterable[str] = (), cores: Collection[int] | None = None) -> None:
        self._preload = tuple(preload)
        self._cores = None if cores is None else frozenset(cores)
        self._lock = threading.Lock()
        self._stopped = False
        self._discarded = False
        self._future: Future[Reply] | None = None
        self._deadline = _CONTEXT.Value("d", 0.0, lock=False)
        self._context, self._pool = self._open()

    def run(self, call: bytes, seconds: float) -> Reply:
        """
        Make a call, and wait for what comes of it.

        Parameters
        ----------
        call
            Function and arguments, pickled.
        seconds
            When to give it up, above 0.

        Raises
        ------
        WorkerError
            If workers do not start.
        CancelledError
            If it is stopped meanwhile.
        """
        for _ in range(STARTS):
            try:
                future = self._submit(call, seconds)
                reply = self._watched(future, seconds + START_SECONDS)
            except ProcessExpired as error:
                reply = _exit_reason(error.exitcode)
                if reply.failure is Failure.CRASHED:
                    # it may have died in the middle of what it was sending
                    self._discard()
                return reply
            except TimeoutError:
                if not future.done():
                    # not even pebble knows of it: whatever is stuck, a new pool is not
                    taken_up = future.running()
                    self._discard()
                    if not taken_up:
                        continue
                return Reply(failure=Failure.TIMED_OUT, message=f"stopped after {seconds:g} s")
            except BrokenProcessPool:
                # the worker died before it took the call up
                self._discard()
                continue
            if reply.dirty:
                self._discard()
            return reply
        if call != _NOTHING and self.run(_NOTHING, START_SECONDS).failure is None:
            # workers do start: it is this call that they do not survive
            return Reply(failure=Failure.CRASHED, message="its process died, and its connection with it")
        msg = (
            f"{STARTS} worker processes in a row died while they started; what they wrote to standard error says why "
            "(a script that starts workers has to keep its own work under `if __name__ == '__main__':`)"
        )
        raise WorkerError(msg)

    def _watched(self, future: Future[Reply], seconds: float) -> Reply:
        """Wait for a call, but no longer than its own limit allows: the alarm of that may have been disarmed."""
        latest = time.monotonic() + seconds
        while True:
            try:
                return future.result(GLANCE)
            except TimeoutError:
                now, deadline = time.monotonic(), self._deadline.value
                if future.done():
                    return future.result()
                if now > latest:
                    raise
                if deadline and now > deadline + GRACE:
                    self._discard()
                    return Reply(
                        failure=Failure.TIMED_OUT, message="killed after its time limit, which it had disarmed"
                    )

    def stop(self) -> None:
        """End the worker and whatever it started, and give up the call that is under way; start nothing from now on."""
        with self._lock:
            self._stopped = True
            if self._future is not None:
                self._future.cancel()
            self._pool.stop()  # type: ignore[no-untyped-call]
            self._context.sweep()

    def join(self) -> None:
        """Wait until a stopped worker is gone."""
        self._pool.join()

    def _open(self) -> tuple["_Context", ProcessPool]:
        context = _Context()
        pool = ProcessPool(
            1, initializer=_begin, initargs=(self._preload, self._cores, self._deadline), context=context
        )
        return context, pool

    def _submit(self, call: bytes, seconds: float) -> Future[Reply]:
        with self._lock:
            if self._stopped:
                raise CancelledError
            _ensure_server(self._preload, self._cores)
            # a pool whose worker dies between two calls is of no use any more
            if self._discarded or not self._pool.active:
                self._pool.stop()  # type: ignore[no-untyped-call]
                self._pool.join()
                self._context, self._pool = self._open()
                self._discarded = False
            # that of a worker which died of it
            self._deadline.value = 0.0
            try:
                self._future = self._pool.schedule(_reply, (call,), timeout=seconds)
            except RuntimeError as error:
                # it died this very moment
                raise BrokenProcessPool from error
            return self._future

    def _discard(self) -> None:
        """Kill the worker with all that it started; the next call gets a new one."""
        with self._lock:
            self._discarded = True
            self._context.sweep()


class _Worker(_CONTEXT.Process):  # type: ignore[name-defined, misc]
    """A worker process, seen from its parent."""

    def start(self) -> None:
        """Start it, and let its end be read by one thread only: a second reader finds nothing, and makes it 255."""
        super().start()
        popen: Any = self._popen
        if _METHOD != "forkserver":
            return
        read, reading = popen.poll, threading.Lock()

        def poll(flag: int = os.WNOHANG) -> int | None:
            if flag != os.WNOHANG:
                connection.wait([popen.sentinel])
            with reading:
                code: int | None = read(os.WNOHANG)
            return code

        popen.poll = poll

    @property
    def exitcode(self) -> int | None:
        """Tell pebble of every end: it waits for ever for the answer of a worker that left with the code 0."""
        code: int | None = super().exitcode
        return _LEFT_QUIETLY if code == 0 else code


class _Context:
    """Where pebble gets its processes from: multiprocessing's own context, which clears up after each worker."""

    def __init__(self) -> None:
        self._worker: _Worker | None = None

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever multiprocessing has
        return getattr(_CONTEXT, name)

    def Process(self, **how: Any) -> _Worker:  # noqa: ANN401, N802 - as multiprocessing's
        """Make a worker; the one before is gone, but maybe not what it started."""
        self.sweep()
        self._worker = _Worker(**how)
        return self._worker

    def sweep(self) -> None:
        """Kill the worker, and all that it started."""
        if self._worker is None or self._worker.pid is None:
            return
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._worker.pid, signal.SIGKILL)


def _ensure_server(preload: Collection[str], cores: Collection[int] | None) -> None:
    """
    Start what workers are forked from, if it does not run yet.

    Libraries count the cores when they are loaded, to know how many threads to start. They are loaded there: so it
    gets as many cores as each worker. An interrupt from the keyboard reaches it while it loads; it shall not die of it.
    """
    if _METHOD != "forkserver":
        return
    from multiprocessing import forkserver, resource_tracker  # noqa: PLC0415 - not on every system

    with _starting:
        # the server's own first step, which would let interrupts through again
        resource_tracker.ensure_running()
        multiprocessing.set_forkserver_preload(["__main__", *preload])
        with _on_cores(cores), _interrupts_held():
            forkserver.ensure_running()


@contextmanager
def _on_cores(cores: Collection[int] | None) -> Iterator[None]:
    """Keep this thread on some cores for a moment; processes that it starts stay there."""
    if cores is None or not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back for a moment; processes that this thread starts never hear of it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _exit_reason(code: int) -> Reply:
    """Say what a process died of, given its exit code."""
    if code == _LEFT_QUIETLY:
        return Reply(failure=Failure.CRASHED, message="its process left with the exit code 0")
    if code >= 0:
        return Reply(failure=Failure.CRASHED, message=f"its process left with the exit code {code}")
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    if name == "SIGALRM":
        return Reply(failure=Failure.TIMED_OUT, message="stopped at its time limit")
    return Reply(failure=Failure.CRASHED, message=f"its process died of {name}{_HINTS.get(name, '')}")


# ---- in the worker ----


def _begin(preload: Iterable[str], cores: Collection[int] | None, deadline: Any) -> None:  # noqa: ANN401 - shared memory
    """Make a process a worker."""
    if _POSIX:
        # A session of its own, so that Ctrl-C passes it by, and whatever it starts can be found and killed with it.
        os.setsid()
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        # pebble's own handler needs the interpreter, which a call may hold for ever
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if cores is not None and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, cores)
    # standard output is the parent's, for results
    with suppress(OSError):
        os.dup2(2, 1)
    sys.stdout = sys.stderr
    threading.Thread(target=_die_with_parent, name="die with parent", daemon=True).start()
    if _METHOD == "forkserver" and sys.platform == "linux":
        # the same where a call has stopped this process: the server, its parent, dies with the one that asks for calls
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, int(signal.SIGKILL))
    set_expendable(deadline)
    isolated.run_here()
    for module in preload:
        # what is wrong with it is told by the call that needs it
        with suppress(Exception):
            import_module(module)


def _die_with_parent() -> None:
    """End with the process that asks for calls, however that ended: nobody waits for the answer any more."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        if _POSIX:
            os.killpg(0, signal.SIGKILL)
        os._exit(1)


def _reply(call: bytes) -> Reply:
    """Make a call. Nothing but plain bytes and words leaves this process: those can always be sent and read."""
    process, threads = os.getpid(), threading.active_count()
    if hasattr(signal, "setitimer"):
        # an alarm that the call before has set would go off in this one
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    reply = make_call(call)
    if os.getpid() != process:
        # a fork that came back from the call: one of the two is enough
        os._exit(1)
    return reply._replace(dirty=_used_up or threading.active_count() > threads or _has_children())


def use_up() -> None:
    """
    Have this worker replaced after the call that is under way.

    For calls of code that may leave anything behind: another folder, other signals, closed files, changed modules.
    Outside of a worker it does nothing.
    """
    global _used_up  # noqa: PLW0603 - a property of the process
    _used_up = True


def _has_children() -> bool:
    """Tell whether this process has children, alive or not waited for."""
    if not hasattr(os, "waitid"):
        return bool(multiprocessing.active_children())
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return False
    return True


def make_call(call: bytes) -> Reply:
    """Make a call, given function and arguments, pickled; whatever it raises becomes a failure."""
    try:
        function: Callable[..., Any]
        function, args = pickle.loads(call)  # noqa: S301 - from the process that started this one
        return Reply(pickle.dumps(function(*args), pickle.HIGHEST_PROTOCOL))
    except MemoryError as error:
        return Reply(failure=Failure.OUT_OF_MEMORY, message=one_line(error))
    except BaseException as error:  # noqa: BLE001 - whatever a call does, the next one is made
        return Reply(failure=Failure.RAISED, message=one_line(error))


def one_line(error: BaseException) -> str:
    r"""
    Say in one line what was raised.

    Examples
    --------
    >>> one_line(ValueError("bad\nworse"))
    'ValueError: bad'
    """
    try:
        text = str(error)
    except Exception:  # noqa: BLE001 - an exception may be as broken as what raised it
        text = ""
    first = next(iter(text.splitlines()), "")
    return f"{type(error).__name__}: {first}" if first else type(error).__name__

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
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing import connection
from typing import Any, NamedTuple

from cgla_graph.comparisons.workers.limits import Failure, Outcome, set_expendable
from cgla_graph.errors import WorkerError
from cgla_graph.model import isolated

#: How long a worker may take to start, in seconds, before it is given up.
START_SECONDS = 120.0
#: How many workers in a row may be lost before they take up their call.
STARTS = 3
#: How long a call may outlive its own limit before it is killed from here, and how often that is looked at, in seconds.
GRACE, GLANCE = 1.0, 0.5

# A fork of a process that has loaded everything is there in no time, and has none of this process's threads and locks.
_METHOD = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
_CONTEXT: Any = multiprocessing.get_context(_METHOD)
_POSIX = os.name == "posix"
_HINTS = {
    "SIGABRT": ", as compiled code does that finds no memory",
    "SIGKILL": ", which may mean that memory ran out",
}
#: Held while a process starts, or its exit code is read: two readers would take it from each other.
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

    It answers each call twice: when it has taken it up, and with what came of it.

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
        #: held while the process is another one
        self._changing = threading.Lock()
        self._stopped = False
        self._process: Any = None
        self._line: Any = None
        self._deadline = _CONTEXT.Value("d", 0.0, lock=False)

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
            # that of a call which the process before died of
            self._deadline.value = 0.0
            if self._is_ready() and self._takes_up(call):
                reply = self._answer(seconds)
                if self._stopped:
                    raise CancelledError
                if reply.dirty:
                    self._end()
                return reply
            self._end()
        msg = (
            f"{STARTS} worker processes in a row died while they started; what they wrote to standard error says why "
            "(a script that starts workers has to keep its own work under `if __name__ == '__main__':`)"
        )
        raise WorkerError(msg)

    def _is_ready(self) -> bool:
        """Start the process unless it runs; tell whether it waits for a call."""
        with self._changing:
            if self._stopped:
                raise CancelledError
            if self._process is not None and not connection.wait([self._process.sentinel], 0.0):
                return True
            self._sweep()
            _ensure_server(self._preload, self._cores)
            self._line, theirs = _CONTEXT.Pipe()
            how = (self._preload, self._cores, self._deadline)
            self._process = _CONTEXT.Process(target=_work, args=(theirs, _begin, how), daemon=True)
            with _starting:
                self._process.start()
            theirs.close()
        with suppress(TimeoutError):
            return self._word(START_SECONDS) is not None
        return False

    def _takes_up(self, call: bytes) -> bool:
        """Hand a call over; a process that died before it has nothing to do with it."""
        with suppress(OSError, TimeoutError):
            self._line.send_bytes(call)
            return self._word(START_SECONDS) is not None
        return False

    def _answer(self, seconds: float) -> Reply:
        """Wait for what comes of the call that is under way."""
        try:
            word = self._word(seconds)
        except _DisarmedError:
            self._end()
            return Reply(failure=Failure.TIMED_OUT, message="killed after its time limit, which it had disarmed")
        except TimeoutError:
            self._end()
            return Reply(failure=Failure.TIMED_OUT, message=f"stopped after {seconds:g} s")
        if word is None:
            # one that is about to end by itself tells why
            connection.wait([self._process.sentinel], GRACE)
            return _exit_reason(self._end())
        try:
            return Reply(*pickle.loads(word))  # noqa: S301 - bytes and words, from a process that this one started
        except Exception as error:  # noqa: BLE001 - a call may have written into the line
            self._end()
            return Reply(failure=Failure.CRASHED, message=f"its process cannot be understood: {one_line(error)}")

    def _word(self, seconds: float) -> bytes | None:
        """Wait for what the process says next; None if it dies, or its end of the line is closed."""
        latest = time.monotonic() + seconds
        while True:
            ready = connection.wait([self._line, self._process.sentinel], GLANCE)
            if self._process.sentinel in ready:
                # what it has started may keep the line open
                self._kill()
            if ready:
                try:
                    return self._line.recv_bytes() if self._line.poll() else None
                except (EOFError, OSError):
                    return None
            now, deadline = time.monotonic(), self._deadline.value
            if deadline and now > deadline + GRACE:
                # the alarm that should have ended it was taken away
                raise _DisarmedError
            if now > latest:
                raise TimeoutError

    def stop(self) -> None:
        """End the worker and whatever it started, and give up the call that is under way; start nothing from now on."""
        with self._changing:
            self._stopped = True
            self._kill()

    def join(self) -> None:
        """Wait until a stopped worker is gone."""
        process = self._process
        if process is not None:
            connection.wait([process.sentinel], START_SECONDS)

    def _end(self) -> int:
        """End the worker, and return its exit code; the next call gets a new one."""
        with self._changing:
            return self._sweep()

    def _sweep(self) -> int:
        """Clear up after the worker, if there is one, and return its exit code."""
        process = self._process
        if process is None:
            return 0
        self._kill()
        connection.wait([process.sentinel], START_SECONDS)
        with _starting:
            code: int | None = process.exitcode
        self._line.close()
        self._process = None
        return code or 0

    def _kill(self) -> None:
        """Kill the worker, and all that it started."""
        if self._process is None or self._process.pid is None:
            return
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        if not connection.wait([self._process.sentinel], 0.0):
            # it may not have a session of its own yet
            with suppress(ProcessLookupError, PermissionError):
                self._process.kill()


class _DisarmedError(Exception):
    """A call has outlived its own limit."""


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
        multiprocessing.set_forkserver_preload(["__main__", __name__, *preload])
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


def _work(line: Any, begin: Callable[..., None], how: tuple[Any, ...]) -> None:  # noqa: ANN401 - one end of a pipe
    """Make calls, one after the other, as long as there are any."""
    begin(*how)
    line.send_bytes(b"ready")
    while True:
        try:
            call = line.recv_bytes()
        except (EOFError, OSError):
            return
        line.send_bytes(b"taken up")
        line.send_bytes(pickle.dumps(tuple(_reply(call))))


def _begin(preload: Iterable[str], cores: Collection[int] | None, deadline: Any) -> None:  # noqa: ANN401 - shared memory
    """Make a process a worker."""
    # calls may have processes of their own: those end with this one's session
    multiprocessing.current_process().daemon = False
    if _POSIX:
        # A session of its own, so that Ctrl-C passes it by, and whatever it starts can be found and killed with it.
        os.setsid()
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
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

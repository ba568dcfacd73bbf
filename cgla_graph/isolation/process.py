"""A worker process that makes calls one after the other, and is replaced if it is lost."""

import atexit
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterable
from concurrent.futures import CancelledError
from contextlib import suppress
from multiprocessing import connection, get_context, reduction, spawn
from typing import Any, NamedTuple

from cgla_graph import _progress
from cgla_graph.errors import WorkerError
from cgla_graph.isolation import worker
from cgla_graph.isolation.outcome import Failure, Outcome, Reply, one_line, packed

#: Seconds that a worker may take to start.
START_SECONDS = 600.0
#: Workers in a row that may be lost before they begin a call.
STARTS = 3
#: Seconds for a server to tell that a worker has ended, and to end itself.
PATIENCE = 60.0
#: Seconds after its own limit until a call is killed from here, and between two checks of that.
GRACE, GLANCE = 1.0, 0.5

#: Program of a server: it sets the module search path first, so that it imports the same modules as this process.
_BOOT = (
    "import sys; sys.path[:] = sys.argv[2].split('\\n'); "
    "from cgla_graph.isolation.worker import serve; serve(int(sys.argv[1]))"
)
_HINTS = {
    "SIGABRT": ", as compiled code does when it runs out of memory",
    "SIGKILL": ", which may mean that memory ran out",
}
#: Signals by which others end a process: the system when memory runs out, an administrator, a batch system.
_FROM_OUTSIDE = {"SIGKILL", "SIGTERM", "SIGHUP", "SIGINT", "SIGPWR"}
#: Whether workers are forked from a server that has loaded all modules; on Windows each is started anew.
_forks = hasattr(os, "fork")


class WorkerProcess:
    """
    One worker process, which is started at the first call and replaced if it is lost.

    Only on Windows, the program needs a guard (``if __name__ == "__main__":``).

    Parameters
    ----------
    preload
        Modules to load before the first call.
    cores
        Cores on which the worker may run; None for all.

    Examples
    --------
    >>> import math
    >>> process = WorkerProcess()
    >>> process.make(math.sqrt, (16.0,), seconds=60.0).value
    4.0
    >>> process.stop()
    """

    def __init__(self, preload: Iterable[str] = (), cores: Collection[int] | None = None) -> None:
        self._preload = tuple(preload)
        self._cores = None if cores is None else frozenset(cores)
        #: held while the process is another one
        self._changing = threading.Lock()
        self._stopped = False
        self._process: _Process | None = None

    def make(
        self,
        function: Callable[..., Any],
        args: tuple[Any, ...],
        seconds: float,
        tell: Callable[[str, str], None] | None = None,
    ) -> Outcome:
        """Call an importable function in the worker, as `run` does; function and arguments are pickled here."""
        call = packed(function, args)
        return call if isinstance(call, Outcome) else self.run(call, seconds, tell).outcome()

    def run(self, call: bytes, seconds: float, tell: Callable[[str, str], None] | None = None) -> Reply:
        """
        Make a call and wait for its end. An interrupt of the wait (Ctrl-C) ends the worker.

        Parameters
        ----------
        call
            Function and arguments, pickled.
        seconds
            Seconds after which the call is given up, above 0.
        tell
            Receives the progress of the call: its activity, and how far it is.

        Raises
        ------
        WorkerError
            If workers do not start.
        CancelledError
            If `stop` is called meanwhile.
        """
        for _ in range(STARTS):
            try:
                process = self._ready()
                reply = None if process is None else process.answer(call, seconds, tell)
            except BaseException:
                # the worker may still send its reply to this call, which must not answer the next one
                self._end()
                raise
            if self._stopped:
                raise CancelledError
            if reply is None or reply.dirty:
                self._end()
            if reply is not None:
                return reply
        msg = f"{STARTS} worker processes in a row died while they started; see their messages on standard error" + (
            "" if _forks else " (a script has to keep its own work under `if __name__ == '__main__':`)"
        )
        raise WorkerError(msg)

    def _ready(self) -> "_Process | None":
        """Return the process, started if needed; None if it dies at its start."""
        with self._changing:
            if self._stopped:
                raise CancelledError
            if self._process is not None and self._process.is_alive():
                return self._process
            self._sweep()
            self._process = process = (_forked if _forks else _spawned)(self._preload, self._cores)
        return process if process is not None and process.is_ready() else None

    def stop(self) -> None:
        """End the worker and all its descendants, and cancel the current call; start no worker from now on."""
        with self._changing:
            self._stopped = True
            if self._process is not None:
                self._process.kill()

    def join(self) -> None:
        """Wait until a stopped worker has ended."""
        process = self._process
        if process is not None:
            connection.wait([process.sentinel], START_SECONDS)

    def _end(self) -> None:
        """End the worker; the next call gets a new one."""
        with self._changing:
            self._sweep()

    def _sweep(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            connection.wait([process.sentinel], START_SECONDS)
            process.close()


class _Process:
    """A running worker: the pipe to it, and a handle that becomes readable when it has died."""

    def __init__(self, pid: int, line: Any, sentinel: Any, exit_code: Callable[[], int]) -> None:  # noqa: ANN401 - pipes
        self.sentinel = sentinel
        self._pid, self._line, self._exit_code = pid, line, exit_code
        self._tell: Callable[[str, str], None] = _ignore
        #: end of the time limit of the current part of a call; 0 for no limit
        self._deadline = 0.0

    def is_alive(self) -> bool:
        return not connection.wait([self.sentinel], 0.0)

    def is_ready(self) -> bool:
        """Wait until it accepts calls."""
        with suppress(TimeoutError):
            return self._word(START_SECONDS) is not None
        return False

    def answer(self, call: bytes, seconds: float, tell: Callable[[str, str], None] | None) -> Reply | None:
        """Make a call and wait for its end; None if the process died before the call began."""
        self._deadline, self._tell = 0.0, tell or _ignore
        begun = None
        with suppress(OSError, TimeoutError):
            self._line.send((sys.path, call))
            begun = self._word(START_SECONDS)
        if begun is None:
            return None
        try:
            word = self._word(seconds)
        except TimeoutError as error:
            return _lost(Failure.TIMED_OUT, str(error))
        except Exception as error:  # noqa: BLE001 - a call may have written into the line
            return _lost(Failure.CRASHED, f"the reply of its process cannot be read: {one_line(error)}")
        return self._end() if word is None else Reply(*word)

    def _end(self) -> Reply:
        """Return why it died; wait a moment, so that a process that is ending by itself gets its own exit code."""
        ended = connection.wait([self.sentinel], GRACE)
        self.kill()
        code = self._exit_code()
        if code >= 0:
            return _lost(Failure.CRASHED, f"its process left with the exit code {code}")
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = f"signal {-code}"
        if name == "SIGALRM":
            return _lost(Failure.TIMED_OUT, "stopped at its time limit")
        # (only of a process that was forked is it known that it was not killed here)
        failure = Failure.LOST if _forks and ended and name in _FROM_OUTSIDE else Failure.CRASHED
        return _lost(failure, f"its process died of {name}{_HINTS.get(name, '')}")

    def _word(self, seconds: float) -> tuple[Any, ...] | None:
        """Wait for the next message of the process; None if it dies, or its end of the pipe is closed."""
        latest = time.monotonic() + seconds
        while True:
            ready = connection.wait([self._line, self.sentinel], GLANCE)
            now, heard = time.monotonic(), self._line in ready
            if self.sentinel in ready:
                # its children may keep the pipe open
                self.kill()
                heard = self._line.poll()
            if ready:
                try:
                    kind, *words = self._line.recv() if heard else ("died",)
                except (EOFError, OSError):
                    return None
                if kind == "limit":
                    self._deadline = now + words[0] if words[0] else 0.0
                elif kind == "compiling":
                    _progress.compiling()
                elif kind == "progress":
                    self._tell(*words)
                else:
                    return None if kind == "died" else tuple(words)
            elif self._deadline and now > self._deadline + GRACE:
                msg = "killed after its time limit, which it had disarmed"
                raise TimeoutError(msg)
            elif now > latest:
                msg = f"stopped after {seconds:g} s"
                raise TimeoutError(msg)

    def kill(self) -> None:
        """Kill the process and its session."""
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._pid, signal.SIGKILL)
        if self.is_alive():
            # (it may not have a session of its own yet)
            with suppress(ProcessLookupError, PermissionError):
                os.kill(self._pid, getattr(signal, "SIGKILL", signal.SIGTERM))

    def close(self) -> None:
        self._line.close()


def _ignore(_: str, __: str) -> None:
    """Take progress that is not shown."""


def _lost(failure: Failure, message: str) -> Reply:
    return Reply(failure=failure, message=message, dirty=True)


# ---- starting a worker ----


class _Server(NamedTuple):
    """A process from which workers are forked, and the pipe to it."""

    process: subprocess.Popen[bytes]
    line: Any

    def end(self) -> None:
        """End the server and its workers."""
        self.line.close()
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            # (the kernel kills its workers with it)
            self.process.kill()
            self.process.wait()


#: Servers by the number of cores that their libraries use.
_servers: dict[int | None, _Server] = {}
#: Held while a server starts a worker.
_asking = threading.Lock()


def _forked(preload: tuple[str, ...], cores: frozenset[int] | None) -> _Process | None:
    """Let a server fork a worker; None if the server dies."""
    line, theirs = connection.Pipe()
    report, their_report = connection.Pipe(duplex=False)
    with _asking:
        n_cores = os.cpu_count() if cores is None else len(cores)
        server = _servers.get(n_cores) or _servers.setdefault(n_cores, _started_server())
        try:
            server.line.send((sys.path, preload, cores))
            for each in (theirs, their_report):
                reduction.send_handle(server.line, each.fileno(), server.process.pid)
                each.close()
            pid = _received(report, START_SECONDS)
        except BaseException as error:
            # (also for Ctrl-C: the server would take the rest of this request for the next one)
            server.process.kill()
            _servers.pop(n_cores).end()
            if isinstance(error, EOFError | OSError):
                return None
            raise

    def exit_code() -> int:
        try:
            return int(_received(report, PATIENCE))
        except (EOFError, OSError):
            # the server was killed, and its workers with it, or hangs
            return -int(signal.SIGKILL)

    return _Process(pid, line, report, exit_code)


def _received(report: Any, seconds: float) -> Any:  # noqa: ANN401 - what the server sends
    """Wait for a word of a server; raise TimeoutError if there is none."""
    if not report.poll(seconds):
        raise TimeoutError
    return report.recv()


def _started_server() -> _Server:
    """Start a server in a session of its own, which Ctrl-C does not reach."""
    line, theirs = connection.Pipe()
    command = [os.fsdecode(spawn.get_executable()), "-c", _BOOT, str(theirs.fileno()), "\n".join(sys.path)]
    how: Any = {"stdin": subprocess.DEVNULL, "pass_fds": [theirs.fileno()], "start_new_session": True}
    try:
        return _Server(subprocess.Popen(command, **how), line)  # noqa: S603 - ours
    except OSError as error:
        msg = f"a process for calls that may crash does not start: {error}"
        raise WorkerError(msg) from error
    finally:
        theirs.close()


def _spawned(preload: tuple[str, ...], cores: frozenset[int] | None) -> _Process:
    """Start a worker as a new process, on systems without fork."""
    line, theirs = connection.Pipe()
    process = get_context("spawn").Process(target=worker.work, args=(theirs, sys.path, preload, cores), daemon=True)
    process.start()
    theirs.close()

    def exit_code() -> int:
        # (it may have closed its files, and not have ended yet)
        process.join()
        return -int(signal.SIGKILL) if process.exitcode is None else process.exitcode

    return _Process(process.pid or 0, line, process.sentinel, exit_code)


def _end_servers() -> None:
    while _servers:
        _servers.popitem()[1].end()


def _forget_servers() -> None:
    """Forget the servers in a fork of this process: they are children of its parent."""
    global _asking  # noqa: PLW0603 - it may have been held
    _asking = threading.Lock()
    while _servers:
        server = _servers.popitem()[1]
        server.line.close()
        # (no need to wait for it here)
        server.process.returncode = 0


atexit.register(_end_servers)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_servers)

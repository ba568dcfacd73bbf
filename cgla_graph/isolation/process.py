"""A worker process: calls are made there one after the other, and one that is lost is replaced."""

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

from cgla_graph.errors import WorkerError
from cgla_graph.isolation import worker
from cgla_graph.isolation.outcome import Failure, Outcome, Reply, one_line, packed

#: How long a worker may take to start, in seconds, before it is given up.
START_SECONDS = 600.0
#: How many workers in a row may be lost before they take up their call.
STARTS = 3
#: How long a call may outlive its own limit before it is killed from here, and how often that is looked at, in seconds.
GRACE, GLANCE = 1.0, 0.5

#: What a server runs: the folders first, as those of the user's program are where our modules are.
_BOOT = (
    "import sys; sys.path[:] = sys.argv[2].split('\\n'); "
    "from cgla_graph.isolation.worker import serve; serve(int(sys.argv[1]))"
)
_HINTS = {
    "SIGABRT": ", as compiled code does that finds no memory",
    "SIGKILL": ", which may mean that memory ran out",
}
#: Whether workers are forked from a server that has loaded everything; on Windows each is started anew.
_forks = hasattr(os, "fork")


class WorkerProcess:
    """
    One worker process, which is started when first used, and replaced when it is lost.

    It needs no guard (``if __name__ == "__main__":``) in the program, but on Windows.

    Parameters
    ----------
    preload
        Modules to be loaded before the first call.
    cores
        Where the worker may run; None for anywhere.

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
        """Call a function of a module that the other process can import, as `run` does; both are pickled here."""
        call = packed(function, args)
        return call if isinstance(call, Outcome) else self.run(call, seconds, tell).outcome()

    def run(self, call: bytes, seconds: float, tell: Callable[[str, str], None] | None = None) -> Reply:
        """
        Make a call, and wait for its end. What interrupts the wait (Ctrl-C) ends the worker.

        Parameters
        ----------
        call
            Function and arguments, pickled.
        seconds
            When to give it up, above 0.
        tell
            Gets the progress of the call: what it does, and how far it is.

        Raises
        ------
        WorkerError
            If workers do not start.
        CancelledError
            If it is stopped meanwhile.
        """
        for _ in range(STARTS):
            try:
                process = self._ready()
                reply = None if process is None else process.answer(call, seconds, tell)
            except BaseException:
                # what comes next from there would be the answer to this
                self._end()
                raise
            if self._stopped:
                raise CancelledError
            if reply is None or reply.dirty:
                self._end()
            if reply is not None:
                return reply
        msg = (
            f"{STARTS} worker processes in a row died while they started; what they wrote to standard error says why"
            + ("" if _forks else " (a script has to keep its own work under `if __name__ == '__main__':`)")
        )
        raise WorkerError(msg)

    def _ready(self) -> "_Process | None":
        """Start the process unless it waits for a call; None if it dies of that."""
        with self._changing:
            if self._stopped:
                raise CancelledError
            if self._process is not None and self._process.is_alive():
                return self._process
            self._sweep()
            self._process = process = (_forked if _forks else _spawned)(self._preload, self._cores)
        return process if process is not None and process.is_ready() else None

    def stop(self) -> None:
        """End the worker and all that it started, and give up the call that is under way; start nothing from now on."""
        with self._changing:
            self._stopped = True
            if self._process is not None:
                self._process.kill()

    def join(self) -> None:
        """Wait until a stopped worker is gone."""
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
    """A process that works, as seen from here: its line, and what becomes readable when it has died."""

    def __init__(self, pid: int, line: Any, sentinel: Any, exit_code: Callable[[], int]) -> None:  # noqa: ANN401 - pipes
        self.sentinel = sentinel
        self._pid, self._line, self._exit_code = pid, line, exit_code
        self._tell: Callable[[str, str], None] | None = None
        #: until when the part of the call that is limited may take; 0: no limit now
        self._deadline = 0.0

    def is_alive(self) -> bool:
        return not connection.wait([self.sentinel], 0.0)

    def is_ready(self) -> bool:
        """Wait until it takes calls."""
        with suppress(TimeoutError):
            return self._word(START_SECONDS) is not None
        return False

    def answer(self, call: bytes, seconds: float, tell: Callable[[str, str], None] | None) -> Reply | None:
        """Make a call, and wait for its end; None if the process died before: the call has nothing to do with that."""
        self._deadline, self._tell = 0.0, tell
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
            return _lost(Failure.CRASHED, f"its process cannot be understood: {one_line(error)}")
        return self._end() if word is None else Reply(*word)

    def _end(self) -> Reply:
        """Say what it died of; one that is about to end by itself tells why."""
        connection.wait([self.sentinel], GRACE)
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
        return _lost(Failure.CRASHED, f"its process died of {name}{_HINTS.get(name, '')}")

    def _word(self, seconds: float) -> tuple[Any, ...] | None:
        """Wait for what the process says next; None if it dies, or its end of the line is closed."""
        latest = time.monotonic() + seconds
        while True:
            ready = connection.wait([self._line, self.sentinel], GLANCE)
            now, heard = time.monotonic(), self._line in ready
            if self.sentinel in ready:
                # what it has started may keep the line open
                self.kill()
                heard = self._line.poll()
            if ready:
                try:
                    kind, *words = self._line.recv() if heard else ("died",)
                except (EOFError, OSError):
                    return None
                if kind == "limit":
                    self._deadline = now + words[0] if words[0] else 0.0
                elif kind == "progress":
                    if self._tell is not None:
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
        """Kill it, and all that it started."""
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._pid, signal.SIGKILL)
        if self.is_alive():
            # it may not have a session of its own yet
            with suppress(ProcessLookupError, PermissionError):
                os.kill(self._pid, getattr(signal, "SIGKILL", signal.SIGTERM))

    def close(self) -> None:
        self._line.close()


def _lost(failure: Failure, message: str) -> Reply:
    return Reply(failure=failure, message=message, dirty=True)


# ---- how it is started ----


class _Server(NamedTuple):
    """A process that workers are forked from, and the line to it."""

    process: subprocess.Popen[bytes]
    line: Any

    def end(self) -> None:
        """Let it end, and its workers with it."""
        self.line.close()
        self.process.wait()


#: Servers by the number of cores that their libraries have counted.
_servers: dict[int | None, _Server] = {}
#: Held while a server is asked for a worker.
_asking = threading.Lock()


def _forked(preload: tuple[str, ...], cores: frozenset[int] | None) -> _Process | None:
    """Have a server fork a worker; None if the server dies of that."""
    line, theirs = connection.Pipe()
    report, told = connection.Pipe(duplex=False)
    with _asking:
        n_cores = os.cpu_count() if cores is None else len(cores)
        server = _servers.get(n_cores) or _servers.setdefault(n_cores, _started_server())
        try:
            server.line.send((sys.path, preload, cores))
            for each in (theirs, told):
                reduction.send_handle(server.line, each.fileno(), server.process.pid)
                each.close()
            pid = report.recv()
        except BaseException as error:
            # also Ctrl-C: the rest of the request would be taken for the next one
            server.process.kill()
            _servers.pop(n_cores).end()
            if isinstance(error, EOFError | OSError):
                return None
            raise

    def exit_code() -> int:
        try:
            return int(report.recv())
        except (EOFError, OSError):
            # the server was killed, and its workers with it
            return -int(signal.SIGKILL)

    return _Process(pid, line, report, exit_code)


def _started_server() -> _Server:
    """Start a server, out of reach of Ctrl-C."""
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
    """Start a worker anew, where there is no fork."""
    line, theirs = connection.Pipe()
    process = get_context("spawn").Process(target=worker.work, args=(theirs, sys.path, preload, cores), daemon=True)
    process.start()
    theirs.close()
    return _Process(process.pid or 0, line, process.sentinel, lambda: process.exitcode or 0)


def _end_servers() -> None:
    while _servers:
        _servers.popitem()[1].end()


def _forget_servers() -> None:
    """Begin anew in a copy of this process: the servers are its parent's children."""
    global _asking  # noqa: PLW0603 - it may have been held
    _asking = threading.Lock()
    while _servers:
        server = _servers.popitem()[1]
        server.line.close()
        # this process does not have to wait for it
        server.process.returncode = 0


atexit.register(_end_servers)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_servers)

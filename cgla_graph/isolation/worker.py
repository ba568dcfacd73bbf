"""
Server that forks workers, and the workers, which make calls.

The server has loaded all modules and has none of the program's threads and locks, so that it forks a worker in
milliseconds. It kills its workers and all their descendants when the program ends for any reason.
"""

import ctypes
import os
import pickle
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Collection, Iterable
from contextlib import suppress
from importlib import import_module
from multiprocessing import active_children, connection, reduction
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

from cgla_graph import _progress
from cgla_graph.isolation.limits import set_expendable
from cgla_graph.isolation.outcome import Failure, Reply, failure_by, one_line

#: One end of a pipe.
Line: TypeAlias = Any
#: Seconds between two messages of progress.
EVERY = 0.1
#: Option of prctl: the signal that a process gets when its parent dies.
_PR_SET_PDEATHSIG = 1
#: Option of prctl: orphaned descendants become children of this process.
_PR_SET_CHILD_SUBREAPER = 36
#: The children of a process's only thread.
_CHILDREN = Path(f"/proc/self/task/{os.getpid()}/children")
#: Whether this worker is to be replaced after the current call.
_used_up = False


# ---- the server ----


def serve(descriptor: int) -> NoReturn:
    """
    Fork a worker for each request on a pipe, until that is closed.

    A request is the search path, the modules to load and the cores, then two descriptors: of the worker's pipe, and of
    a pipe on which the server sends the worker's process id and, later, its exit code.
    """
    control: Line = connection.Connection(descriptor)
    _ask_kernel(_PR_SET_CHILD_SUBREAPER, 1)
    _print_to_standard_error()
    ended, noticed = os.pipe()
    for end in (ended, noticed):
        os.set_blocking(end, False)
    signal.set_wakeup_fd(noticed)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    workers: dict[int, Line] = {}
    try:
        while True:
            for ready in connection.wait([control, ended]):
                if ready is control:
                    _fork(control, workers, (ended, noticed))
                else:
                    os.read(ended, 4096)
                    _report(workers)
    except (EOFError, OSError):
        pass
    finally:
        for pid in workers:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(pid, signal.SIGKILL)
        _kill_children()
        os._exit(0)


def _fork(control: Line, workers: dict[int, Line], descriptors: tuple[int, int]) -> None:
    """Start the worker of the next request."""
    path, preload, cores = control.recv()
    line, report = (connection.Connection(reduction.recv_handle(control)) for _ in range(2))
    _set_up(path, preload, cores)
    with warnings.catch_warnings():
        # (libraries may have threads in the server, which no worker needs)
        warnings.simplefilter("ignore")
        pid = os.fork()
    if pid == 0:
        try:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for each in (control, report, *workers.values()):
                each.close()
            for descriptor in descriptors:
                os.close(descriptor)
            # (works even if a call has stopped this process)
            _ask_kernel(_PR_SET_PDEATHSIG, int(signal.SIGKILL))
            work(line, path, (), cores)
        finally:
            os._exit(1)
    line.close()
    workers[pid] = report
    # (the program may have closed the pipe)
    with suppress(OSError):
        report.send(pid)


def _report(workers: dict[int, Line]) -> None:
    """Send the exit codes of workers that have died, after their descendants are killed."""
    ended = [(pid, status) for pid, status in (os.waitpid(pid, os.WNOHANG) for pid in workers) if pid]
    _kill_children(workers)
    for pid, status in ended:
        with suppress(OSError), workers.pop(pid) as report:
            report.send(os.waitstatus_to_exitcode(status))


def _kill_children(but: Collection[int] = ()) -> None:
    """Kill all children of this process except some; descendants of dead workers are among them."""
    # (children may start new ones meanwhile)
    for _ in range(100):
        left: list[int] = []
        # (systems that do not list children do not adopt orphans either)
        with suppress(OSError):
            left = [int(pid) for pid in _CHILDREN.read_text(encoding="ascii").split() if int(pid) not in but]
        for pid in left:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
            with suppress(ChildProcessError):
                os.waitpid(pid, 0)
        if not left:
            return


def _ask_kernel(option: int, value: int) -> None:
    """Set an option of this process, on Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value)


# ---- a worker ----


def work(line: Line, path: Iterable[str], preload: Iterable[str], cores: Collection[int] | None) -> None:
    """Make calls, one after the other, until the pipe is closed."""
    if hasattr(os, "setsid"):
        # (processes that a call starts are in this session, and are killed with it)
        os.setsid()
    # (on Windows, Ctrl-C reaches all processes; only the program handles it)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _ask_kernel(_PR_SET_CHILD_SUBREAPER, 1)
    _print_to_standard_error()
    _set_up(path, preload, cores)
    speaking = threading.Lock()

    def say(*words: Any) -> None:  # noqa: ANN401 - of each kind of message
        with speaking, suppress(OSError):
            line.send(words)

    set_expendable(lambda seconds: say("limit", seconds))
    _progress.relay(_seldom(lambda what, text: say("progress", what, text)))
    _progress.when_compiling(lambda: say("compiling"))
    say("ready")
    while True:
        try:
            path, call = line.recv()
        except (EOFError, OSError):
            os._exit(0)
        sys.path[:] = path
        say("begun")
        line.send(("reply", *_reply(call)))


def _set_up(path: Iterable[str], preload: Iterable[str], cores: Collection[int] | None) -> None:
    """Restrict this process to some cores, then load modules: libraries count the cores when they are loaded."""
    if cores is not None and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, cores)
    sys.path[:] = path
    for module in preload:
        # (the call that needs the module reports the error)
        with suppress(Exception):
            import_module(module)


def _print_to_standard_error() -> None:
    """Redirect standard output to standard error, because the program's standard output is for results."""
    with suppress(OSError):
        os.dup2(2, 1)
    sys.stdout = sys.stderr


def _seldom(say: Callable[[str, str], None]) -> Callable[[str, str], None]:
    """Pass on progress at most once in `EVERY` seconds."""
    latest = -EVERY

    def say_seldom(what: str, text: str) -> None:
        nonlocal latest
        if time.monotonic() - latest >= EVERY:
            latest = time.monotonic()
            say(what, text)

    return say_seldom


def _reply(call: bytes) -> Reply:
    """Make a call, and reply with plain bytes and text only, which can always be sent and read."""
    process, threads = os.getpid(), threading.active_count()
    if hasattr(signal, "setitimer"):
        # cancel an alarm that a previous call may have set
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    reply = make_call(call)
    if os.getpid() != process:
        # the call forked this process and both returned: end the child
        os._exit(1)
    return reply._replace(dirty=_used_up or threading.active_count() > threads or _has_children())


def make_call(call: bytes) -> Reply:
    """Make a call, given function and arguments, pickled; an exception becomes a failure."""
    try:
        function: Callable[..., Any]
        function, args = pickle.loads(call)  # noqa: S301 - from the process that started this one
    except BaseException as error:  # noqa: BLE001 - the next call is made in any case
        return Reply(failure=Failure.NOT_MADE, message=one_line(error))
    try:
        return Reply(pickle.dumps(function(*args), pickle.HIGHEST_PROTOCOL))
    except BaseException as error:  # noqa: BLE001 - the same
        return Reply(failure=failure_by(error), message=one_line(error))


def use_up() -> None:
    """
    Let this worker be replaced after the current call.

    For calls with side effects on the process: a changed folder, signals, closed files, changed modules. Outside a
    worker it does nothing.
    """
    global _used_up  # noqa: PLW0603 - a property of the process
    _used_up = True


def _has_children() -> bool:
    """Return whether this process has children, alive or zombies."""
    if not hasattr(os, "waitid"):
        return bool(active_children())
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return False
    return True

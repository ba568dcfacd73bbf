"""
Solvers that may crash or hang run in a process of their own, so that the user's process lives.

One helper process serves a program. It is started by the first run that needs it, which takes about a second, and kept
for the next; a run then takes a millisecond more than here. After a crash it is replaced.
"""

import atexit
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib import import_module
from multiprocessing import spawn
from typing import IO, Any, NoReturn

from cgla_graph.errors import SolverSettingError, WorkerError
from cgla_graph.model import risk_kernels
from cgla_graph.model.no_fly_kernels import point_inside, segment_crosses
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.small_problem import MapKind, load_oracle, small_problem
from cgla_graph.model.solution import Solution, Status

#: How long a run may take that was not told, by a setting ``seconds``, how long it may take; in seconds.
LONGEST = 600.0
#: By how much a run may exceed its setting ``seconds``: so many seconds, and such a share of it.
GRACE, GRACE_SHARE = 2.0, 0.1
#: How long the process may take to start, which includes compiling kernels for the first time, in seconds.
STARTING = 600.0

#: What the process is told to do: the folders first, as those of the user's program are where our modules are.
_BOOT = "import sys; sys.path[:] = sys.argv[1].split('\\n'); from cgla_graph.model.isolated import serve; serve()"
#: Bytes that say how long a message is.
_LENGTH = 8
#: Whether this process may be lost anyway.
_expendable = False


def run(solver: Any, problem: Problem | GraphProblem) -> tuple[Solution, float]:  # noqa: ANN401 - of either kind
    """
    Run a solver, in a process of its own if its traits ask for that.

    Parameters
    ----------
    solver
        Of either domain; one with the trait ``isolated`` is sent to the other process, as is the problem.
    problem
        What it solves.

    Returns
    -------
    answer, seconds
        What the solver returned, and how long it took by its own process's clock. Of a run that took its process down
        the answer is a `Solution` with the status ``CRASHED``, and of one that did not end in time, ``TIMED_OUT``.

    Raises
    ------
    SolverSettingError
        If solver and problem cannot be sent.
    WorkerError
        If the process does not start.

    Examples
    --------
    >>> from cgla_graph.solvers.continuous.straight_line import StraightLine
    >>> answer, seconds = run(StraightLine(), Problem((0, 0), (1, 1)))
    >>> answer.status.label, seconds < 60.0
    ('found', True)
    """
    if _expendable or not getattr(solver.traits, "isolated", False):
        return _timed(solver, problem)
    try:
        request = pickle.dumps((sys.path, pickle.dumps((solver, problem), pickle.HIGHEST_PROTOCOL)))
    except Exception as error:
        raise _cannot_be_sent(solver.traits.name, error) from error
    return _helper.run(solver, request)


def limit_of(solver: Any) -> float:  # noqa: ANN401 - of either kind
    """
    Return how long an isolated solver's run may take, in seconds: what it was told, and some grace; else `LONGEST`.

    Examples
    --------
    >>> from cgla_graph.solvers import get
    >>> limit_of(get("bit-star", seconds=10)), limit_of(get("bit-star", iterations=100))
    (13.0, 600.0)
    """
    seconds = getattr(solver, "seconds", None)
    return LONGEST if seconds is None else min((1.0 + GRACE_SHARE) * seconds + GRACE, threading.TIMEOUT_MAX)


def run_here() -> None:
    """Have all solvers run in this process from now on: it is a worker's, whose loss somebody else takes care of."""
    global _expendable  # noqa: PLW0603 - a property of the process
    _expendable = True


def _timed(solver: Any, problem: Problem | GraphProblem) -> tuple[Solution, float]:  # noqa: ANN401 - of either kind
    began = time.perf_counter()
    answer = solver.solve(problem)
    return answer, time.perf_counter() - began


def _cannot_be_sent(name: str, error: BaseException) -> SolverSettingError:
    msg = (
        f"{name} runs in a process of its own, to which it and its problem cannot be sent "
        f"({type(error).__name__}: {error}); define their classes in a module that can be imported"
    )
    return SolverSettingError(msg)


class _Helper:
    """The process beside this one."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None

    def run(self, solver: Any, request: bytes) -> tuple[Solution, float]:  # noqa: ANN401 - of either kind
        """Have a solver run there; one at a time."""
        limit = limit_of(solver)
        with self._lock:
            process = self._started()
            began = time.perf_counter()
            reply, in_time = None, False
            try:
                reply, in_time = _exchange(process, request, limit)
            finally:
                # after Ctrl-C too: what comes next from there would be the answer to this
                if reply is None or not in_time:
                    self.end()
            waited = time.perf_counter() - began
        if reply is None:
            return _lost(solver, limit, _end_of(process) if in_time else ""), waited
        answer, error = pickle.loads(reply)  # noqa: S301 - from the process that was started here
        if error is not None:
            raise error
        return answer  # type: ignore[no-any-return]

    def end(self) -> None:
        """End the process; the next run gets a new one."""
        process, self._process = self._process, None
        if process is not None:
            _end(process)

    def forget(self) -> None:
        """Let go of the process: it is the parent's, of which this process is a copy."""
        if self._process is not None:
            _close(self._process)
            # nobody has to wait for it here
            self._process.returncode = 0

    def _started(self) -> "subprocess.Popen[bytes]":
        if self._process is not None and self._process.poll() is None:
            return self._process
        self.end()
        command = [os.fsdecode(spawn.get_executable()), "-c", _BOOT, "\n".join(sys.path)]
        try:
            process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)  # noqa: S603 - ours
        except OSError as error:
            msg = f"a process for solvers that may crash does not start: {error}"
            raise WorkerError(msg) from error
        ready = None
        try:
            ready, _ = _exchange(process, None, STARTING)
        finally:
            if ready is None:
                _end(process)
        if ready is None:
            msg = f"a process for solvers that may crash {_end_of(process)} as it started; standard error says why"
            raise WorkerError(msg)
        self._process = process
        return process


def _lost(solver: Any, limit: float, end: str) -> Solution:  # noqa: ANN401 - of either kind
    """Say what became of a run that told nothing: how its process ended, or that it was stopped."""
    remedy = "try another seed or solver" if solver.traits.seeded else "try another solver"
    if end:
        return Solution(Status.CRASHED, message=f"its process {end}, and this one goes on; {remedy}")
    seconds = getattr(solver, "seconds", None)
    told = "the most without a setting `seconds`" if seconds is None else f"for it did not end after its {seconds:g} s"
    return Solution(Status.TIMED_OUT, message=f"stopped after {limit:g} s, {told}; {remedy}")


def _exchange(process: "subprocess.Popen[bytes]", request: bytes | None, seconds: float) -> tuple[bytes | None, bool]:
    """Send a request and wait for the reply, None if there will be none; say whether it was left to end by itself."""
    stopped = threading.Event()

    def stop() -> None:
        stopped.set()
        process.kill()

    timer = threading.Timer(seconds, stop)
    timer.daemon = True
    timer.start()
    reply = None
    try:
        # a process that is gone takes nothing
        with suppress(BrokenPipeError):
            if request is not None:
                _send(_pipe(process.stdin), request)
            reply = _received(_pipe(process.stdout))
    finally:
        timer.cancel()
    # from now on it kills nothing any more
    timer.join()
    return reply, not stopped.is_set()


def _end(process: "subprocess.Popen[bytes]") -> None:
    process.kill()
    process.wait()
    _close(process)


def _end_of(process: "subprocess.Popen[bytes]") -> str:
    """Say what a process died of."""
    code = process.returncode
    if code >= 0:
        return f"left with the exit code {code}"
    with suppress(ValueError):
        return f"died of {signal.Signals(-code).name}"
    return f"died of signal {-code}"


def _close(process: "subprocess.Popen[bytes]") -> None:
    for pipe in (process.stdin, process.stdout):
        with suppress(OSError):
            _pipe(pipe).close()


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    """Tell type checkers that a pipe is there."""
    if pipe is None:
        msg = "a process without pipes"
        raise TypeError(msg)
    return pipe


def _send(pipe: IO[bytes], message: bytes) -> None:
    """Write a message after its length; pipes take it in pieces."""
    left = memoryview(len(message).to_bytes(_LENGTH, "little") + message)
    while left:
        left = left[pipe.write(left) :]


def _received(pipe: IO[bytes]) -> bytes | None:
    """Read a message, or None where the other end is closed."""
    length = _read(pipe, _LENGTH)
    return None if length is None else _read(pipe, int.from_bytes(length, "little"))


def _read(pipe: IO[bytes], count: int) -> bytes | None:
    pieces = []
    while count:
        piece = pipe.read(min(count, 2**20))
        if not piece:
            return None
        pieces.append(piece)
        count -= len(piece)
    return b"".join(pieces)


_helper = _Helper()


def _forget_helper() -> None:
    """Begin anew in a copy of this process, which has neither its threads nor its children."""
    global _helper  # noqa: PLW0603 - one a process
    _helper.forget()
    _helper = _Helper()


atexit.register(lambda: _helper.end())  # noqa: PLW0108 - the one of then
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_helper)


# ---- in the other process ----


def serve() -> NoReturn:
    """Run solvers for the process that started this one, and end with it."""
    # Ctrl-C reaches all processes of a terminal; the other one decides
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests, replies = open(os.dup(0), "rb", buffering=0), open(os.dup(1), "wb", buffering=0)  # noqa: PTH123, SIM115
    _part_with_pipes()
    with suppress(ImportError, ValueError, OSError):
        # crashes are expected: no file of the whole memory for each
        resource: Any = import_module("resource")
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    run_here()
    waiting: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, waiting.put), daemon=True).start()
    _warm_up(MapKind())
    _send(replies, b"")
    while True:
        _send(replies, _reply(waiting.get()))


def _part_with_pipes() -> None:
    """Make standard input empty and standard output the standard error: what solvers print is no answer."""
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    try:
        os.dup2(2, 1)
    except OSError:
        os.dup2(nothing, 1)
    # line by line: what waits in a buffer is lost with this process
    sys.stdout = sys.stderr


def _listen(requests: IO[bytes], put: Callable[[bytes], None]) -> NoReturn:
    """Take requests as they come, also in the middle of a run: so it is noticed when nobody waits for it any more."""
    while (request := _received(requests)) is not None:
        put(request)
    os._exit(0)


@cache
def _warm_up(kind: MapKind) -> None:
    """Load the compiled kernels, so that no run is charged for that."""
    problem = small_problem(kind)
    risk_kernels.segment_cost(0.0, 0.0, 1.0, 1.0, 1.0, problem.field.kernel_field())
    segment_crosses(0.0, 0.0, 1.0, 1.0, problem.model.area.kernel_arrays)
    point_inside(0.0, 0.0, problem.model.area.kernel_arrays)
    load_oracle(kind)


def _reply(request: bytes) -> bytes:
    """Run what was sent; return its answer, or what it raised."""
    try:
        folders, parcel = pickle.loads(request)  # noqa: S301 - from the process that started this one
        sys.path[:] = folders
        solver, problem = pickle.loads(parcel)  # noqa: S301 - from the process that started this one
    except Exception as error:  # noqa: BLE001 - told to the one who sent it
        return _told(_cannot_be_sent("the solver", error))
    try:
        # no run is charged for what it needs to be loaded, either
        for package in solver.traits.needs:
            import_module(package)
        _warm_up(MapKind.of(problem.graph.model if isinstance(problem, GraphProblem) else problem.model))
        return pickle.dumps((_timed(solver, problem), None), pickle.HIGHEST_PROTOCOL)
    except BaseException as error:  # noqa: BLE001 - whatever a run does, the next one is made
        error.add_note(f"In the solver's own process:\n{''.join(traceback.format_exception(error))}")
        return _told(error)


def _told(error: BaseException) -> bytes:
    """Put an exception into a message; one that cannot be sent becomes words."""
    try:
        reply = pickle.dumps((None, error))
        pickle.loads(reply)  # noqa: S301 - what was just written
    except Exception:  # noqa: BLE001 - exceptions may be of any make
        return pickle.dumps((None, RuntimeError(f"{type(error).__name__}: {error}")))
    return reply

"""A planner as a command: it gets a text on its standard input, and nothing that it does harms anybody else."""

import math
import os
import selectors
import signal
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import IO

from cgla_graph.isolation.limits import Limits, is_expendable, limited
from cgla_graph.isolation.worker import use_up

#: Of standard output, a planner may write so much; of standard error, so much of the end is kept. Bytes.
MOST_OUTPUT, MOST_COMPLAINT = 4 * 2**20, 4096
#: How long its last words may be on their way when it has ended, and until it is killed from outside. Seconds.
LAST_WORDS, GRACE = 0.2, 5.0
_CHUNK = 65536
#: Of prctl: orphans of a process's family become its children.
_PR_SET_CHILD_SUBREAPER = 36


class End(Enum):
    """How a command ended."""

    DONE = "it ended"
    TIMED_OUT = "it took longer than it may"
    TOO_MUCH = "it wrote more than it may"
    NOT_STARTED = "it could not be started"


@dataclass(frozen=True)
class Spoken:
    """
    What a command said.

    Attributes
    ----------
    end
        How it ended.
    code
        Its exit code; below 0 the signal that it died of.
    output
        Its standard output.
    complaint
        The last line of its standard error.
    seconds
        From its start until it ended.
    """

    end: End
    code: int
    output: bytes
    complaint: str
    seconds: float


def ask(command: Sequence[str], text: str, folder: str, environment: Mapping[str, str], limits: Limits) -> Spoken:
    """
    Run a command on a text: to be called in a worker process.

    The input is a file, so that a command that never reads it keeps nobody waiting. It runs in a group of its own; that
    group is killed when the command has ended or its time is up, and on Linux everything else that it has started as
    well, sessions of their own included. The memory that each of its processes may take is limited by the system.

    Parameters
    ----------
    command
        Program and arguments.
    text
        What it reads.
    folder, environment
        Where it runs.
    limits
        Time and memory.

    Examples
    --------
    >>> here = str(Path.cwd())
    >>> ask(["cat"], "hello", here, os.environ, Limits(seconds=10.0)).output
    b'hello'
    """
    use_up()
    _adopt_orphans()
    with tempfile.TemporaryFile() as problem:
        problem.write(text.encode())
        problem.seek(0)
        with limited(limits.seconds + GRACE, limits.megabytes):
            began = time.perf_counter()
            try:
                process = subprocess.Popen(  # noqa: S603 - the user's own command
                    command,
                    stdin=problem,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    cwd=folder,
                    env=dict(environment),
                    process_group=0 if os.name == "posix" else None,
                )
            except OSError as error:
                return Spoken(End.NOT_STARTED, 0, b"", error.strerror or str(error), math.nan)
            try:
                listener = _Listener(process)
                end = listener.listen(began + limits.seconds)
                seconds = time.perf_counter() - began
            finally:
                _kill(process)
    return Spoken(end, process.returncode, bytes(listener.output), listener.last_line, seconds)


class _Listener:
    """Reads what a process writes, up to a limit."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.output, self._complaint = bytearray(), bytearray()
        self._process = process
        self._selector = selectors.DefaultSelector()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                os.set_blocking(stream.fileno(), False)
                self._selector.register(stream, selectors.EVENT_READ)

    def listen(self, deadline: float) -> End:
        """Read until the process has ended; what it has started may keep the pipes open."""
        ended = math.inf
        while True:
            now = time.perf_counter()
            if now >= deadline and math.isinf(ended):
                return End.TIMED_OUT
            if now >= ended or not (self._selector.get_map() or math.isinf(ended)):
                return End.DONE
            if not self._selector.get_map():
                # it has closed both, and goes on
                with suppress(subprocess.TimeoutExpired):
                    self._process.wait(max(0.0, deadline - now))
            else:
                for key, _ in self._selector.select(min(0.02, deadline - now) if math.isinf(ended) else ended - now):
                    self._read(key.fileobj)  # type: ignore[arg-type]
            if len(self.output) > MOST_OUTPUT:
                return End.TOO_MUCH
            if math.isinf(ended) and self._process.poll() is not None:
                ended = time.perf_counter() + LAST_WORDS

    def _read(self, stream: IO[bytes]) -> None:
        try:
            data = os.read(stream.fileno(), _CHUNK)
        except BlockingIOError:
            return
        if not data:
            self._selector.unregister(stream)
        elif stream is self._process.stdout:
            self.output += data
        else:
            self._complaint = (self._complaint + data)[-MOST_COMPLAINT:]

    @property
    def last_line(self) -> str:
        """The last line that is not empty."""
        lines = self._complaint.decode("utf-8", "replace").split("\n")
        return next((" ".join(line.split()) for line in reversed(lines) if line.strip()), "")


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a process, its group, and whatever else came of it."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.wait()
    for stream in (process.stdout, process.stderr):
        if stream is not None:
            stream.close()
    if not is_expendable():
        return
    # some start new ones while others are killed
    for _ in range(100):
        if not (left := _children()):
            return
        for pid in left:
            with suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
            with suppress(ChildProcessError):
                os.waitpid(pid, 0)


def _adopt_orphans() -> None:
    """Become the parent of what a killed child has left behind, where the system (Linux) has that."""
    if not is_expendable():
        return
    import ctypes  # noqa: PLC0415 - not everywhere

    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1)


def _children() -> list[int]:
    """List the children of this process; none where the system does not tell."""
    found = []
    with suppress(OSError):
        for task in Path("/proc/self/task").iterdir():
            found += [int(pid) for pid in (task / "children").read_text(encoding="ascii").split()]
    return found

"""A planner as a command: it reads a text on its standard input, and can harm no other process."""

import math
import os
import signal
import subprocess
import tempfile
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from typing import Any

from cgla_graph.isolation.limits import Limits, limited
from cgla_graph.isolation.worker import use_up

#: Of standard output, a planner may write so much; of standard error, so much of the end is kept. Bytes.
MOST_OUTPUT, MOST_COMPLAINT = 4 * 2**20, 4096
#: How long its last words may be on their way when it has ended, and until it is killed from outside. Seconds.
LAST_WORDS, GRACE = 0.2, 5.0
_CHUNK = 65536


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

    The input is a file, so that a command may leave it unread. It runs in a group of its own; that
    group is killed when the command has ended or its time is up, and with the worker, on Linux, everything else that it
    has started, sessions of their own included. The system limits the memory of each of its processes.

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
    >>> ask(["cat"], "hello", os.getcwd(), os.environ, Limits(seconds=10.0)).output
    b'hello'
    """
    use_up()
    with tempfile.TemporaryFile() as problem, limited(limits.seconds + GRACE, limits.megabytes):
        problem.write(text.encode())
        problem.seek(0)
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
        listener = _Listener(process, limits.seconds)
        try:
            process.wait()
            seconds = time.perf_counter() - began
        finally:
            listener.stop()
    return Spoken(listener.end, process.returncode, bytes(listener.output), listener.last_line, seconds)


class _Listener:
    """Reads what a process writes, and kills it when it writes or takes too much."""

    def __init__(self, process: "subprocess.Popen[bytes]", seconds: float) -> None:
        self.end, self.output, self._complaint = End.DONE, bytearray(), bytearray()
        self._process = process
        self._timer = threading.Timer(min(seconds, threading.TIMEOUT_MAX), self._kill, [End.TIMED_OUT])
        self._readers = [
            threading.Thread(target=self._hear, args=[stream], daemon=True)
            for stream in (process.stdout, process.stderr)
        ]
        for thread in (self._timer, *self._readers):
            thread.start()

    def stop(self) -> None:
        """Hear the last words; what the process has started may keep its pipes open."""
        self._timer.cancel()
        latest = time.monotonic() + LAST_WORDS
        for thread in self._readers:
            thread.join(max(0.0, latest - time.monotonic()))
        self._kill(self.end)

    def _hear(self, stream: Any) -> None:  # noqa: ANN401 - one end of a pipe
        with stream:
            while data := stream.read1(_CHUNK):
                if stream is self._process.stderr:
                    self._complaint = (self._complaint + data)[-MOST_COMPLAINT:]
                    continue
                self.output += data
                if len(self.output) > MOST_OUTPUT:
                    self._kill(End.TOO_MUCH)
                    return

    def _kill(self, end: End) -> None:
        """Kill the process and its group; the worker and all else that came of it are killed with this call's end."""
        self.end = end
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.kill()

    @property
    def last_line(self) -> str:
        """The last line that is not empty."""
        lines = self._complaint.decode("utf-8", "replace").split("\n")
        return next((" ".join(line.split()) for line in reversed(lines) if line.strip()), "")

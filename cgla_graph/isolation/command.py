"""Run an external planner as a command with limits: a text on its standard input, an answer on its standard output."""

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

#: Bytes of standard output that a command may write, and bytes at the end of its standard error that are kept.
MOST_OUTPUT, MOST_COMPLAINT = 4 * 2**20, 4096
#: Seconds to wait for output in the pipes after a command has ended, and until it is killed from outside.
DRAIN, GRACE = 0.2, 5.0
_CHUNK = 65536


class End(Enum):
    """How a command ended."""

    DONE = "it ended"
    TIMED_OUT = "it took longer than it may"
    TOO_MUCH = "it wrote more than it may"
    NOT_STARTED = "it could not be started"


@dataclass(frozen=True)
class CommandResult:
    """
    The result of a command.

    Attributes
    ----------
    end
        How it ended.
    code
        Its exit code; below 0 the signal that killed it.
    output
        Its standard output.
    complaint
        The last line of its standard error.
    seconds
        Time from its start to its end.
    """

    end: End
    code: int
    output: bytes
    complaint: str
    seconds: float


def run_command(
    command: Sequence[str], text: str, folder: str, environment: Mapping[str, str], limits: Limits
) -> CommandResult:
    """
    Run a command on a text, in a worker process.

    The input is a file, so that a command may leave it unread. The command has a process group of its own, which is
    killed when the command has ended or its time is up. On Linux, all its other descendants are killed with the worker,
    even in sessions of their own. The system limits the memory of each process.

    Parameters
    ----------
    command
        Program and arguments.
    text
        Text on standard input.
    folder, environment
        Working folder and environment variables.
    limits
        Limits of time and memory.

    Examples
    --------
    >>> run_command(["cat"], "hello", os.getcwd(), os.environ, Limits(seconds=10.0)).output
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
            return CommandResult(End.NOT_STARTED, 0, b"", error.strerror or str(error), math.nan)
        listener = _Listener(process, limits.seconds)
        try:
            process.wait()
            seconds = time.perf_counter() - began
        finally:
            listener.stop()
    return CommandResult(listener.end, process.returncode, bytes(listener.output), listener.last_line, seconds)


class _Listener:
    """Reader of the output of a process, which kills the process beyond its limits of time and output."""

    def __init__(self, process: "subprocess.Popen[bytes]", seconds: float) -> None:
        self.end, self.output, self._complaint = End.DONE, bytearray(), bytearray()
        self._process = process
        self._timer = threading.Timer(min(seconds, threading.TIMEOUT_MAX), self._kill, [End.TIMED_OUT])
        self._readers = [
            threading.Thread(target=self._read, args=[stream], daemon=True)
            for stream in (process.stdout, process.stderr)
        ]
        for thread in (self._timer, *self._readers):
            thread.start()

    def stop(self) -> None:
        """Read the rest of the output, for a limited time: children of the process may keep its pipes open."""
        self._timer.cancel()
        latest = time.monotonic() + DRAIN
        for thread in self._readers:
            thread.join(max(0.0, latest - time.monotonic()))
        self._kill(self.end)

    def _read(self, stream: Any) -> None:  # noqa: ANN401 - one end of a pipe
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
        """Kill the process and its group; other descendants are killed with the worker at the end of the call."""
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

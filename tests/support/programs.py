"""Programs that tests start: they end with the test, whatever it finds."""

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any


@contextmanager
def program(words: Sequence[object], **how: Any) -> Iterator["subprocess.Popen[str]"]:  # noqa: ANN401 - as Popen
    """
    Start a program, and kill it, and a session of its own, after the body.

    The context of `subprocess.Popen` waits for ever, also for a program that was too slow for a limit of the body.
    """
    running: subprocess.Popen[str] = subprocess.Popen([*map(str, words)], text=True, **how)
    try:
        yield running
    except BaseException:
        _kill(running, how)
        raise
    finally:
        try:
            running.wait(60.0)
        finally:
            _kill(running, how)
            for stream in (running.stdin, running.stdout, running.stderr):
                if stream is not None:
                    stream.close()


def _kill(running: "subprocess.Popen[str]", how: dict[str, Any]) -> None:
    with suppress(ProcessLookupError, PermissionError):
        if how.get("start_new_session"):
            os.killpg(running.pid, signal.SIGKILL)
    running.kill()
    running.wait()

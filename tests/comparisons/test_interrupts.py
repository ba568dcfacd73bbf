"""Ctrl-C at any moment: one line, the exit status 130, and nothing half done."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import Call, without_compiling
from programs import program
from strategies import a_part_of

from cgla_graph.comparisons.interrupts import is_interrupt
from cgla_graph.comparisons.study.store import load

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
#: The program, which says when it is ready for signals: an interrupt before that is Python's own to report.
PROGRAM = """
from contextlib import contextmanager
from cgla_graph.comparisons import __main__ as program
from cgla_graph.comparisons import interrupts

held = interrupts.held

@contextmanager
def said():
    with held():
        print("ready", flush=True)
        yield

interrupts.held = said
program.main()
"""


def wait() -> None:
    """Wait for an interrupt."""
    latest = time.monotonic() + 20.0
    while time.monotonic() < latest:
        time.sleep(0.001)


def while_importing(folder: Path) -> None:
    (folder / "slowly.py").write_text(
        "import signal\nsignal.raise_signal(signal.SIGINT)\n"
        "try:\n    import time; time.sleep(0.1)\nexcept KeyboardInterrupt:\n    raise ImportError('failed to import')\n"
    )
    import slowly  # type: ignore[import-not-found]  # noqa: F401, PLC0415 - it is there now

    wait()


def while_a_class_is_made(_: Path) -> None:
    class Interrupting:
        def __set_name__(self, owner: type, name: str) -> None:
            signal.raise_signal(signal.SIGINT)

    type("Made", (), {"attribute": Interrupting()})


def in_a_destructor(_: Path) -> None:
    class Interrupting:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGINT)

    Interrupting()
    wait()


def in_another_error(_: Path) -> None:
    try:
        signal.raise_signal(signal.SIGINT)
    finally:
        msg = "cleaning up failed"
        raise ValueError(msg)


@pytest.mark.parametrize("moment", [while_importing, while_a_class_is_made, in_a_destructor, in_another_error])
def test_an_interrupt_is_one_line_at_any_moment(
    moment: Callable[[Path], None],
    cgla: Call,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("cgla_graph.comparisons.study.options.open_scenarios", lambda *_, **__: moment(tmp_path))
    before = signal.getsignal(signal.SIGINT), sys.unraisablehook
    answer = cgla("plan", "paper")
    assert (answer.code, answer.out, answer.err) == (130, "", "cgla: interrupted\n")
    assert (signal.getsignal(signal.SIGINT), sys.unraisablehook) == before


def test_an_interrupt_is_found_in_groups_and_circles_end() -> None:
    group = BaseExceptionGroup("several", [ValueError(), KeyboardInterrupt()])
    assert is_interrupt(group)
    first, second = ValueError(), ValueError()
    first.__context__, second.__context__ = second, first
    assert not is_interrupt(first)


def interrupted(words: list[str], seconds: float, folder: Path) -> tuple[int, str]:
    """Interrupt a command and its process group some time after its start; return its status and its messages."""
    with program(
        [sys.executable, "-c", PROGRAM, *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    ) as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "ready\n"
        time.sleep(seconds)
        os.killpg(running.pid, signal.SIGINT)
        _, said = running.communicate(timeout=60)
    return running.returncode, said


@pytest.mark.slow
@pytest.mark.parametrize("seconds", a_part_of([0.0, 0.05, 0.2, 0.7, 1.2, 0.4]))
@pytest.mark.parametrize(
    "words",
    [["plan", "one-threat", "--solver", "dijkstra"], ["fly", "swap"], ["scenarios"]],
    ids=lambda words: words[0],
)
def test_commands_end_with_130_after_an_interrupt_at_many_moments(
    words: list[str], seconds: float, tmp_path: Path
) -> None:
    code, said = interrupted(words, seconds, tmp_path)
    assert code in {130, 0}
    assert "Traceback" not in said
    assert "ignored" not in said
    if code == 130:
        # (as the process ends, there is nothing left to say)
        assert said.count("cgla: interrupted") <= 1
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.slow
@pytest.mark.parametrize("seconds", [0.8, 2.4])
def test_an_interrupted_comparison_goes_on(seconds: float, tmp_path: Path) -> None:
    words = ["compare", "one-threat", "--solvers", "dijkstra,cgla", "--seeds", "2", "--out", "out"]
    code, said = interrupted(words, seconds, tmp_path)
    assert "Traceback" not in said
    again = [*words, "--resume"] if (tmp_path / "out" / "study.jsonl").exists() else words
    if code == 130:
        words = [sys.executable, "-c", PROGRAM, *again]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.returncode, without_compiling(done.stderr)) == (0, "")
    assert load(tmp_path / "out").is_complete

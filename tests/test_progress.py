"""Progress is shown on terminals and in notebooks, after a second, and cleared at the end."""

import io
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from programs import program

import cgla_graph as cg
from cgla_graph import _progress
from cgla_graph._progress import say_above, showing, waiting
from cgla_graph.isolation.process import WorkerProcess

#: Seconds before progress is shown, and a longer time, in these tests.
QUIET, LONG = 0.03, 0.3
#: What empties a line of a terminal.
CLEAR = "\x1b[2K"


class Terminal(io.StringIO):
    """A terminal that keeps all that was written to it."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[Terminal]:
    """Make standard error a terminal; check that no thread is left and the line is empty at the end."""
    stream = Terminal()
    # (pytest puts its own in the place of the real one)
    monkeypatch.setattr(_progress, "sys", SimpleNamespace(stderr=stream, modules=sys.modules))
    monkeypatch.setattr(_progress, "QUIET", QUIET)
    monkeypatch.setattr(_progress, "EVERY", 0.02)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "100")
    before = set(threading.enumerate())
    yield stream
    assert set(threading.enumerate()) == before
    assert stream.getvalue().endswith(CLEAR) or not stream.getvalue()


def until(terminal: Terminal, words: str) -> None:
    """Wait for words to be shown."""
    latest = time.monotonic() + 60.0
    while words not in terminal.getvalue() and time.monotonic() < latest:
        time.sleep(0.005)
    assert words in terminal.getvalue()


def test_short_work_shows_nothing(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    # (a busy machine may be slow)
    monkeypatch.setattr(_progress, "QUIET", 20.0)
    with showing("short"):
        time.sleep(LONG)
    assert terminal.getvalue() == ""


def test_calls_inside_of_others_have_no_line_of_their_own(terminal: Terminal) -> None:
    with showing("study", total=7) as tell:
        tell("first")
        with showing("proof") as tell_inside:
            tell_inside("gap 3 %")
            until(terminal, "study: first: proof: gap 3 %")
        tell("second", 5)
        until(terminal, "study: second")
    assert all("study: " in line for line in terminal.getvalue().split(CLEAR) if "0:00" in line)
    assert "1/7" in terminal.getvalue()
    assert "5/7" in terminal.getvalue()


def test_words_stand_above_the_line(terminal: Terminal) -> None:
    with showing("long"):
        until(terminal, "long")
        say_above("words [/] of 3 m")
        until(terminal, "words [/] of 3 m\n")
    say_above("later")
    assert terminal.getvalue().endswith("later\n")
    terminal.write(CLEAR)


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_it_ends_with_an_error(terminal: Terminal, error: type[BaseException]) -> None:
    def fail() -> None:
        with showing("long"):
            until(terminal, "long")
            raise error

    with pytest.raises(error):
        fail()
    with showing("next"):
        until(terminal, "next")


def test_the_line_is_gone_while_a_result_is_used(terminal: Terminal) -> None:
    def results() -> Iterator[str]:
        yield "first"
        until(terminal, "1/2")
        yield "second"

    for _ in waiting("study", results(), total=2):
        assert terminal.getvalue().endswith(CLEAR) or not terminal.getvalue()
        assert threading.active_count() == 1 or "cgla-progress" not in {one.name for one in threading.enumerate()}
        time.sleep(2.0 * QUIET)


def test_it_is_switched_off(terminal: Terminal) -> None:
    cg.progress(on=False)
    try:
        with showing("long"):
            time.sleep(LONG)
    finally:
        cg.progress(on=True)
    assert terminal.getvalue() == ""
    with pytest.raises(cg.CglaError, match="on is 'off'; give True"):
        cg.progress("off")  # type: ignore[arg-type]


def test_other_threads_and_dumb_terminals_show_nothing(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    def work() -> None:
        with showing("elsewhere"):
            time.sleep(LONG)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    monkeypatch.setenv("TERM", "dumb")
    work()
    assert terminal.getvalue() == ""


def test_the_compiling_of_kernels_is_shown(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_progress._State, "n_compiling", 1)
    with showing("planning"):
        until(terminal, "planning: compiling kernels, once after an installation")


def test_a_notebook_shows_it_under_the_cell(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []

    def display(data: dict[str, str], *, raw: bool, display_id: bool) -> Any:  # noqa: ANN401 - IPython's handle
        assert raw
        assert display_id
        shown.append(data["text/plain"])
        return SimpleNamespace(update=lambda data, raw: shown.append(data["text/plain"]) if raw else None)

    kernel = SimpleNamespace(kernel=object())
    fake = SimpleNamespace(get_ipython=lambda: kernel, display=SimpleNamespace(display=display))
    monkeypatch.setitem(sys.modules, "IPython", fake)
    with showing("flight", total=3) as tell:
        tell("tick 4")
        latest = time.monotonic() + 60.0
        while len(shown) < 3 and time.monotonic() < latest:
            time.sleep(0.005)
    assert terminal.getvalue() == ""
    assert (shown[0], shown[-1]) == ("", "")
    assert all("1/3" in line and line.endswith("flight: tick 4") and "\x1b" not in line for line in shown[1:-1])
    assert len(shown) > 3


#: A script that proves and flies, and shows progress at once.
CALLS = """
import threading
import cgla_graph as cg
from cgla_graph import _progress
_progress.QUIET, _progress.EVERY = 0.0, 0.001
problem = cg.load_scenario("paper").problem
cg.solve(problem)
cg.pareto(problem, solver="cgla", resolution=9)
cg.load_mission("fig8").missions(cg.solvers.get).popitem()[1].fly()
print([thread.name for thread in threading.enumerate()])
"""
ALONE = "['MainThread']"


@pytest.mark.slow
def test_nothing_is_written_to_a_pipe() -> None:
    done = subprocess.run([sys.executable, "-c", CALLS], capture_output=True, text=True, check=True, timeout=60)
    assert (done.stdout.strip(), done.stderr) == (ALONE, "")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_a_pseudo_terminal_sees_plans_fronts_and_flights() -> None:
    import pty  # noqa: PLC0415 - not on every system

    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120"}
    with program([sys.executable, "-c", CALLS], stdout=theirs, stderr=theirs, env=environment):
        os.close(theirs)
        written = b""
        # the end is an error on Linux, and nothing elsewhere
        try:
            while part := os.read(ours, 65536):
                written += part
        except OSError:
            pass
        os.close(ours)
    text = written.decode()
    for words in ("planning with hybrid: proof", "front of length against risk: ", "flight: tick "):
        assert words in text, text[-2000:]
    assert text.rpartition(CLEAR)[2].strip() == ALONE


def test_compiling_is_announced_once_also_from_a_worker() -> None:
    said: list[str] = []
    _progress.when_compiling(lambda: said.append("compiling"))
    process = WorkerProcess()
    for _ in range(2):
        assert process.make(_progress.compiling, (), seconds=60.0).failure is None
    process.stop()
    _progress.compiling()
    assert said == ["compiling"]

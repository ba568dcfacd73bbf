"""Isolated calls: everything that a call does is an outcome, the others go on, and nothing is left behind."""

import importlib
import math
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, closing
from pathlib import Path
from types import ModuleType
from typing import Any

import awkward_calls
import pytest
from awkward_calls import alive, until
from hypothesis import given
from hypothesis import strategies as st
from programs import program

from cgla_graph.comparisons.workers.pool import Call, NextCall, here, isolated, shares
from cgla_graph.isolation import process
from cgla_graph.isolation.limits import limited
from cgla_graph.isolation.outcome import Failure, Outcome

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="looks at processes as Linux has them")


@pytest.fixture(scope="module")
def awkward(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """Install the functions that are called."""
    with pytest.MonkeyPatch.context() as patch:
        awkward_calls.install(tmp_path_factory.mktemp("awkward"), patch)
        yield importlib.import_module("awkward")


def one_by_one(calls: Sequence[Call]) -> NextCall:
    left = iter(calls)
    return lambda: next(left, None)


def ends(*calls: tuple[Any, ...], workers: int = 1, seconds: float = 60.0) -> list[Outcome]:
    """Make calls, given as function and arguments; return their outcomes in the order of the calls."""
    asked = [Call(number, function, args) for number, (function, *args) in enumerate(calls)]  # type: ignore[arg-type]
    found = {call.key: outcome for call, outcome in isolated(one_by_one(asked), workers=workers, seconds=seconds)}
    assert found.keys() == set(range(len(calls)))
    return [found[number] for number in range(len(calls))]


def gone(pid: int, seconds: float = 3.0) -> bool:
    return until(lambda: not alive(pid), seconds)


@pytest.mark.slow
def test_whatever_a_call_does_is_an_outcome(awkward: ModuleType) -> None:
    expected = [
        ((awkward.hang_limited, 0.2), Failure.TIMED_OUT, "limit"),
        ((awkward.hang_deaf, 0.2), Failure.TIMED_OUT, "limit"),
        ((awkward.eat, 100.0), Failure.OUT_OF_MEMORY, "Unable to allocate"),
        ((awkward.eat_in_c, 100.0), Failure.CRASHED, "SIGABRT, as compiled code does when it runs out of memory"),
        ((awkward.leave, 0), Failure.CRASHED, "exit code 0"),
        ((awkward.leave, 3), Failure.CRASHED, "exit code 3"),
        ((awkward.segfault,), Failure.CRASHED, "SIGSEGV"),
        ((awkward.die_of, signal.SIGKILL), Failure.LOST, "SIGKILL, which may mean that memory ran out"),
        ((awkward.die_of, signal.SIGTERM), Failure.LOST, "SIGTERM"),
        ((awkward.die_of, signal.SIGRTMIN + 3), Failure.CRASHED, f"signal {signal.SIGRTMIN + 3}"),
        # it ends by itself, or is killed because it no longer answers
        ((awkward.close_all,), Failure.CRASHED, "its process "),
        ((awkward.raises, ValueError, "bad\nworse"), Failure.RAISED, "ValueError: bad"),
        ((awkward.raises, ValueError), Failure.RAISED, "ValueError"),
        ((awkward.raises, SystemExit, 0), Failure.RAISED, "SystemExit: 0"),
        ((awkward.raises, KeyboardInterrupt), Failure.RAISED, "KeyboardInterrupt"),
        ((awkward.raises, TimeoutError, "mine"), Failure.RAISED, "TimeoutError: mine"),
        ((awkward.raises, RecursionError), Failure.RAISED, "RecursionError"),
        ((awkward.raises, ModuleNotFoundError, "mine"), Failure.NOT_MADE, "ModuleNotFoundError: mine"),
        ((awkward.raises, FileNotFoundError, "mine"), Failure.NOT_MADE, "FileNotFoundError: mine"),
        ((awkward.raises, MemoryError), Failure.OUT_OF_MEMORY, "MemoryError"),
        ((awkward.raises_base,), Failure.RAISED, "BaseException: bare"),
        ((awkward.raises, "pickle", "me"), Failure.RAISED, "Unpicklable: me"),
        ((awkward.raises, "speak"), Failure.RAISED, "Unspeakable"),
        ((awkward.no_pickle,), Failure.RAISED, "pickle"),
        ((awkward.no_reading,), Failure.NOT_MADE, "cannot be read: RuntimeError: not readable"),
        ((awkward.square, threading.Lock()), Failure.NOT_MADE, "cannot be sent"),
        ((awkward.square,), Failure.RAISED, "TypeError"),
        ((awkward.nested,), Failure.RAISED, "a limit within a limit"),
    ]
    calls: list[tuple[Any, ...]] = []
    for number, (call, _, _) in enumerate(expected):
        calls += [call, (awkward.square, number)]
    outcomes = ends(*calls, workers=2)
    for number, (call, failure, words) in enumerate(expected):
        outcome = outcomes[2 * number]
        assert (outcome.value, outcome.failure) == (None, failure), (call, outcome)
        assert words in outcome.message, (call, outcome)
        assert len(outcome.message.splitlines()) == 1
        assert outcomes[2 * number + 1] == Outcome(number * number)


@pytest.mark.slow
def test_workers_without_a_fork(awkward: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process, "_forks", False)
    first, crashed, closed, again = ends((awkward.where,), (awkward.leave, 3), (awkward.close_all,), (awkward.where,))
    assert crashed == Outcome(None, Failure.CRASHED, "its process left with the exit code 3")
    # its files are closed before it ends
    assert (closed.failure, "exit code 0" in closed.message) == (Failure.CRASHED, False)
    assert len({os.getpid(), first.value, again.value}) == 3
    assert gone(again.value)


@pytest.mark.slow
def test_a_call_without_limits_is_stopped(awkward: ModuleType) -> None:
    outcomes = ends((awkward.nap, 10**6), (awkward.hang,), workers=2, seconds=1.0)
    assert outcomes == [Outcome(None, Failure.TIMED_OUT, "stopped after 1 s")] * 2


@pytest.mark.slow
def test_outcomes_come_as_they_end_and_calls_begin_in_order(tmp_path: Path, awkward: ModuleType) -> None:
    note = str(tmp_path / "note")
    slow = Call("slow", awkward.wait_for, (note,))
    rest = [*(Call(n, awkward.where) for n in range(5)), Call(5, awkward.nap_noted, (note, 0.1))]
    keys = [call.key for call, _ in isolated(one_by_one([slow, *rest]), workers=2, seconds=60.0)]
    assert keys[:5] == [0, 1, 2, 3, 4]
    keys = [call.key for call, _ in isolated(one_by_one([slow, *rest]), workers=1, seconds=60.0)]
    assert keys == ["slow", 0, 1, 2, 3, 4, 5]


@pytest.mark.slow
def test_workers_stay_and_share_the_cores(awkward: ModuleType) -> None:
    pids = [outcome.value for outcome in ends(*[(awkward.where,)] * 20)]
    assert len(set(pids)) == 1
    have = sorted(os.sched_getaffinity(0))
    for workers in (1, 2):
        found = [outcome.value for outcome in ends(*[(awkward.cores,)] * 40, workers=workers)]
        places = {tuple(cores) for cores, _ in found}
        assert places <= {tuple(sorted(share)) for share in shares(workers) if share is not None}
        assert {count for _, count in found} == {max(1, len(have) // workers)}
    assert sorted(os.sched_getaffinity(0)) == have


@given(workers=st.integers(1, 300))
def test_shares_are_equal_and_apart(workers: int) -> None:
    have = os.sched_getaffinity(0)
    found = [set(share or ()) for share in shares(workers)]
    assert len(found) == workers
    assert {len(share) for share in found} == {max(1, len(have) // workers)}
    assert set.union(*found) <= have
    if workers <= len(have):
        assert sum(map(len, found)) == len(set.union(*found))
    else:
        # as many on each core, but for one
        counts = [sum(core in share for share in found) for core in have]
        assert max(counts) - min(counts) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("megabytes", [60.0, 150.0])
def test_memory_of_the_body_is_measured_and_limited_there_only(megabytes: float, awkward: ModuleType) -> None:
    for outcome in ends((awkward.use, megabytes), (awkward.use, megabytes)):
        peak, free = outcome.value
        assert peak == pytest.approx(megabytes, abs=3.0)
        assert free == 4.0 * megabytes * 2**17


def test_a_limit_ends_with_its_body(awkward: ModuleType) -> None:
    before, inside, after = ends((awkward.aftermath, 60.0))[0].value
    assert before == after
    assert inside[0]
    assert not after[0]
    assert inside[2][0] < 2**40
    assert inside[2][1] == before[2][1]


@pytest.mark.slow
def test_nothing_is_limited_here() -> None:
    # in the user's own process nothing is limited, only measured (in a new one: what tests leave behind counts, too)
    measuring = "with limited(1e-6, 1e-6) as usage: block = b'x' * (50 * 2**20)\nprint(usage.megabytes)"
    code = f"from cgla_graph.isolation.limits import limited\n{measuring}"
    measured = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert float(measured) == pytest.approx(50.0, abs=3.0)
    for seconds, megabytes in [(0.0, 1.0), (1.0, -1.0), (math.nan, 1.0), (1.0, math.nan)]:
        with pytest.raises(ValueError, match="above 0"), limited(seconds, megabytes):
            pass


@pytest.mark.slow
def test_an_alarm_that_a_call_leaves_does_not_go_off_in_the_next(awkward: ModuleType) -> None:
    assert [outcome.failure for outcome in ends((awkward.arm,), (awkward.nap, 0.6))] == [None, None]


@pytest.mark.slow
def test_what_a_call_leaves_behind_goes_with_its_worker(tmp_path: Path, awkward: ModuleType) -> None:
    note = tmp_path / "child"
    first, thread, second, child, third, forked, crashed = ends(
        (awkward.where,),
        (awkward.leave_thread,),
        (awkward.where,),
        (awkward.leave_child,),
        (awkward.where,),
        (awkward.fork_back,),
        (awkward.leave_child, str(note)),
    )
    assert first.value == thread.value
    assert len({first.value, second.value, third.value}) == 3
    assert (forked.value, crashed.failure) == (True, Failure.CRASHED)
    for pid in (first.value, second.value, third.value, child.value, int(note.read_text())):
        assert gone(pid)


def test_an_iteration_that_is_left_leaves_nothing(awkward: ModuleType) -> None:
    calls = [Call("pid", awkward.where), Call("hang", awkward.hang), Call("hang too", awkward.hang)]
    with closing(isolated(one_by_one(calls), workers=1, seconds=60.0)) as running:  # type: ignore[type-var]
        _, outcome = next(running)
        assert alive(outcome.value)
        began = time.monotonic()
    assert time.monotonic() - began < 60.0
    assert gone(outcome.value)


@pytest.mark.parametrize(("workers", "seconds"), [(0, 1.0), (-1, 1.0), (1, 0.0), (1, math.nan)])
def test_too_little_is_refused(workers: int, seconds: float) -> None:
    with pytest.raises(ValueError, match="at least 1 worker"):
        next(isolated(lambda: None, workers=workers, seconds=seconds))


def test_here_isolates_nothing(awkward: ModuleType) -> None:
    calls = [
        Call("pid", awkward.where),
        Call("exit", awkward.raises, (SystemExit, 3)),
        Call("memory", awkward.raises, (MemoryError,)),
        Call("error", awkward.raises, (ValueError, "bad")),
        Call("stop", awkward.raises, (KeyboardInterrupt,)),
    ]
    running = here(one_by_one(calls))
    found = [next(running)[1] for _ in range(4)]
    assert found[0] == Outcome(os.getpid())
    kinds = [Failure.RAISED, Failure.OUT_OF_MEMORY, Failure.RAISED]
    assert [outcome.failure for outcome in found[1:]] == kinds
    with pytest.raises(KeyboardInterrupt):
        next(running)


# ---- the program that asks, and how it ends ----

PROGRAM = """
import sys, importlib
from cgla_graph.comparisons.workers.pool import Call, isolated

def main():
    import awkward
    names = iter(sys.argv[1:])
    def next_call():
        name, *args = next(names, "").split(":")
        return Call(name, getattr(awkward, name), tuple(args)) if name else None
    for call, outcome in isolated(next_call, workers=2, seconds=60.0, preload=["loaded_once"]):
        print(call.key, outcome.value, outcome.failure, flush=True)
"""


@pytest.fixture
def script(awkward: ModuleType, tmp_path: Path) -> Path:
    """Write a program that calls what its arguments name, in two workers, and a module that tells when it is loaded."""
    (tmp_path / "loaded_once.py").write_text(
        f"import os\nwith open({str(tmp_path / 'loaded')!r}, 'a') as file: file.write('x')\n", encoding="utf-8"
    )
    file = tmp_path / "script.py"
    file.write_text(PROGRAM + 'if __name__ == "__main__":\n    main()\n', encoding="utf-8")
    return file


def started(script: Path, *words: str) -> AbstractContextManager[subprocess.Popen[str]]:
    path = os.pathsep.join([os.environ["PYTHONPATH"], str(script.parent)])
    return program(
        [sys.executable, str(script), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,
    )


def ran(script: Path, *words: str) -> tuple[str, str]:
    """Run the program to its end; return what it wrote to standard output and standard error."""
    with started(script, *words) as running:
        out, err = running.communicate(timeout=60.0)
    assert running.returncode == 0
    return out, err


@pytest.mark.slow
def test_modules_are_loaded_once_for_all_workers(script: Path, tmp_path: Path) -> None:
    out, err = ran(script, *["where"] * 3, "leave_thread", *["where"] * 20)
    assert err == ""
    assert len({line.split()[1] for line in out.splitlines()}) >= 2
    assert (tmp_path / "loaded").read_text() == "x"


@pytest.mark.slow
def test_what_a_call_prints_goes_to_standard_error(script: Path) -> None:
    out, err = ran(script, "talk")
    assert out == "talk said None\n"
    assert "printed by a call" in err
    assert "written by a call" in err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("send", "number"),
    [
        (os.killpg, signal.SIGINT),
        *((os.kill, number) for number in (signal.SIGINT, signal.SIGKILL, signal.SIGTERM, signal.SIGHUP)),
    ],
)
def test_workers_end_with_the_program(
    send: Callable[[int, int], None], number: signal.Signals, script: Path, tmp_path: Path
) -> None:
    """Ctrl-C reaches all processes or the program alone; compiled code in a worker holds the interpreter's lock."""
    folder = tmp_path / "workers"
    folder.mkdir()
    note = tmp_path / "hung"
    with started(script, f"note:{folder}", f"hang:{note}", "where", "where") as running:
        assert until(lambda: any(folder.iterdir()) and note.exists() and bool(note.read_text()), 60.0)
        pids = [int(file.name) for file in folder.iterdir()] + [int(note.read_text())]
        send(running.pid, number)
        _, err = running.communicate(timeout=20.0)
    assert running.returncode == -number
    assert err.count("Traceback") == (number == signal.SIGINT)
    assert all(gone(pid) for pid in pids)


@pytest.mark.slow
def test_ctrl_c_while_workers_start(script: Path, tmp_path: Path) -> None:
    """What they are forked from is loading modules then, and must not die of it with a word of its own."""
    loaded = tmp_path / "loaded"
    with (tmp_path / "loaded_once.py").open("a", encoding="utf-8") as file:
        file.write("import time\ntime.sleep(1.0)\n")
    with started(script, "where") as running:
        assert until(loaded.exists, 60.0)
        os.killpg(running.pid, signal.SIGINT)
        _, err = running.communicate(timeout=20.0)
    assert running.returncode == -signal.SIGINT
    assert err.count("KeyboardInterrupt") == 1


@pytest.mark.slow
def test_a_script_needs_no_guard(script: Path) -> None:
    script.write_text(PROGRAM + "main()\n", encoding="utf-8")
    out, err = ran(script, "where")
    assert (out.count("where"), err) == (1, "")

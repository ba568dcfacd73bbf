"""Solvers in a process of their own: whatever they do there, the user's process gets an answer, and lives."""

# ruff: noqa: ANN401 - settings of any solver, and programs of any kind

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from awkward_calls import alive, until
from awkward_solvers import Awkward, Endless, Own

import cgla_graph as cg
from cgla_graph import _progress
from cgla_graph._text import MOST_OF_MESSAGE
from cgla_graph.errors import ProblemError, SolverFaultError, SolverSettingError, WorkerError
from cgla_graph.isolation import process, shared
from cgla_graph.isolation.process import WorkerProcess
from cgla_graph.model import isolated
from cgla_graph.model.solution import MOST_TRACE, MOST_WAYPOINTS, Solution, Status
from cgla_graph.solvers import registry

PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.9), no_fly=shapely.box(0.4, 0.0, 0.6, 0.3))


def process_of(answer: Solution) -> int:
    assert answer.status is Status.FOUND, answer.message
    return int(answer.message.split()[0])


def solve(does: str = "", **settings: Any) -> Solution:
    return cg.solve(PROBLEM, Awkward(does, **settings))


# runs that end well


def test_a_process_of_its_own_is_kept() -> None:
    first = process_of(solve())
    assert first != os.getpid()
    assert process_of(solve()) == first


def test_a_solver_of_the_user_runs_here_unless_it_is_isolated() -> None:
    assert process_of(cg.solve(PROBLEM, Own())) == os.getpid()
    assert process_of(cg.solve(PROBLEM, Own(), isolated=True)) == process_of(solve())
    with pytest.raises(SolverSettingError, match="isolated is 1; give True or False"):
        cg.solve(PROBLEM, Own(), isolated=1)  # type: ignore[arg-type]


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("does", ["change", "change cells"])
def test_a_solver_that_changes_its_problem_is_named(does: str, apart: bool) -> None:
    raster = cg.RasterRisk([[0.1, 0.2], [0.0, 0.1]], bounds=(0.0, 0.0, 1.0, 1.0))
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(rasters=[raster]), k=1.0)
    with pytest.raises(SolverFaultError, match=r"^own changed its problem \((k|.*cells)\); have"):
        cg.solve(problem, Own(does), isolated=apart)


def test_an_answer_that_is_no_solution_is_named() -> None:
    with pytest.raises(SolverFaultError, match="own answers with a NoneType; have its solve return a Solution"):
        cg.solve(PROBLEM, Own("say nothing"))


def test_a_worker_runs_them_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolated, "is_expendable", lambda: True)
    assert process_of(solve()) == os.getpid()


OMPL = {
    "rrt-star": {"iterations": 100},
    "informed-rrt-star": {"iterations": 100},
    "sorrt-star": {"iterations": 100},
    "bit-star": {"iterations": 400},
    "fmt-star": {"samples": 100},
    "bfmt-star": {"samples": 100},
    "ompl-prm-star": {"milestones": 100},
}


@pytest.mark.ompl
@pytest.mark.parametrize("name", OMPL)
def test_the_answer_is_the_same_there(name: str) -> None:
    pytest.importorskip("ompl")
    assert registry.traits(name).isolated
    solver = registry.get(name, seed=3, **OMPL[name])
    there, here = cg.solve(PROBLEM, solver), PROBLEM.judge(solver.solve(PROBLEM))  # type: ignore[arg-type]
    assert there.status is here.status
    assert np.array_equal(there.path, here.path)
    assert (there.cost, there.evaluations, there.message) == (here.cost, here.evaluations, here.message)
    assert [(at.evaluations, at.cost) for at in there.trace] == [(at.evaluations, at.cost) for at in here.trace]


def test_threads_get_their_own_answers() -> None:
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda number: solve(number=number), range(40)))
    assert [answer.message.split()[1] for answer in answers] == [str(number) for number in range(40)]
    assert len({process_of(answer) for answer in answers}) == 1


def test_its_standard_input_is_empty() -> None:
    first = process_of(solve())
    assert process_of(solve("ask")) == first


def test_its_progress_is_told_here(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[tuple[str, str]] = []
    monkeypatch.setattr(_progress, "tell_inside", lambda what, text: said.append((what, text)))
    assert process_of(solve("progress"))
    assert said == [("counting", "one")]


def test_large_problems_and_answers_pass() -> None:
    extra = np.arange(10**6, dtype=np.float64)
    assert process_of(solve(extra=extra)) == process_of(solve())


# runs that do not


def test_a_run_that_crashes_or_hangs_has_an_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolated, "GRACE", 0.1)
    crashed = solve("crash")
    assert (crashed.status, crashed.solver, crashed.path.size) == (Status.CRASHED, "awkward", 0)
    assert crashed.message == "its process died of SIGSEGV, and this one goes on; try another solver"
    late = solve("hang", seconds=0.1)
    assert (late.status, late.message) == (
        Status.TIMED_OUT,
        "stopped after 0.21 s, for it did not end after its 0.1 s; try another solver",
    )
    assert late.seconds == pytest.approx(0.21)
    # without the time to start another process
    began = time.perf_counter()
    assert 0.1 <= solve("nap").seconds < time.perf_counter() - began


def test_a_run_without_seconds_is_stopped_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolated, "LONGEST", 0.2)
    assert "stopped after 0.2 s, the most without a setting `seconds`" in solve("sleep").message


@pytest.mark.slow
def test_a_worker_that_died_between_two_runs_is_replaced() -> None:
    assert "left with the exit code 3" in solve("leave").message
    first = process_of(solve())
    os.kill(first, signal.SIGKILL)
    assert until(lambda: not alive(first))
    assert process_of(solve()) != first


def test_what_it_raises_is_raised_here() -> None:
    first = process_of(solve())
    with pytest.raises(ProblemError) as caught:
        solve("raise")
    assert str(caught.value) == "not this problem"
    assert "awkward_solvers.py" in caught.value.__notes__[0]
    with pytest.raises(RuntimeError, match="UnsendableError: stuck there"):
        solve("raise what cannot be sent")
    # what would end this program does not
    with pytest.raises(RuntimeError, match="SystemExit: away"):
        solve("exit")
    assert process_of(solve()) == first


def unreadable() -> None:
    """Be called where a request is read."""
    msg = "not here"
    raise ImportError(msg)


class Unreadable:
    """Can be sent, but not read."""

    def __reduce__(self) -> Any:
        """Be made of a call."""
        return unreadable, ()


def test_a_class_that_no_module_has_is_sent_by_value() -> None:
    @dataclass(frozen=True)
    class Local(Awkward):
        pass

    assert cg.solve(PROBLEM, Local()).status.has_path


def test_what_cannot_be_sent_is_refused() -> None:
    with pytest.raises(SolverSettingError, match=r"awkward runs in .* cannot be sent.*; keep only"):
        solve(extra=threading.Lock())
    with pytest.raises(SolverSettingError, match="not here"):
        solve(extra=Unreadable())


@pytest.mark.parametrize("program", ["false", "no such program"])
def test_a_process_that_does_not_start_is_an_error(program: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared, "_worker", lambda _: WorkerProcess())
    monkeypatch.setattr(process, "_servers", {})
    monkeypatch.setattr(process.spawn, "get_executable", lambda: program)
    with pytest.raises(WorkerError, match=r"in a row died|does not start"):
        solve()


def test_an_interrupt_ends_the_run() -> None:
    first = process_of(solve())
    with pytest.raises(KeyboardInterrupt):
        solve("interrupt", number=os.getpid())
    assert until(lambda: not alive(first))
    assert process_of(solve()) != first


def test_a_mission_survives_its_solver() -> None:
    uav = cg.Uav("a", (0.1, 0.1), (0.9, 0.9), detection_radius=0.2)
    flight = cg.Mission(cg.World(), [uav], Awkward("crash")).fly()
    assert "its process died of SIGSEGV" in flight.uavs["a"].message


# the process and its parent


@pytest.fixture
def script(tmp_path: Path) -> Iterator[Any]:
    """Run a program of a few lines, which begins with a solve."""
    started: list[subprocess.Popen[str]] = []

    def run(lines: str) -> "subprocess.Popen[str]":
        file = tmp_path / "program.py"
        file.write_text(
            "import os, sys, time\nimport cgla_graph as cg\nfrom awkward_solvers import Awkward\n"
            "problem = cg.Problem((0, 0), (1, 1))\n"
            "def pid(does=''):\n    return int(cg.solve(problem, Awkward(does)).message.split()[0])\n"
            f"print(pid(), flush=True)\n{lines}\n",
            encoding="utf-8",
        )
        paths = os.pathsep.join(map(str, (Path(__file__).parents[1] / "support", os.environ.get("PYTHONPATH", ""))))
        program = subprocess.Popen(
            [sys.executable, "-W", "error", str(file)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # (unset if empty: what is printed has to arrive without)
            env={**os.environ, "PYTHONPATH": paths, "PYTHONUNBUFFERED": ""},
        )
        started.append(program)
        return program

    yield run
    for program in started:
        program.kill()
        program.communicate(timeout=60)


@pytest.mark.slow
@pytest.mark.parametrize("end", ["", "os._exit(0)"])
def test_it_ends_with_its_parent(end: str, script: Any) -> None:
    running = script(end)
    other = int(running.stdout.readline())
    assert running.communicate(timeout=60) == ("", "")
    assert until(lambda: not alive(other))


@pytest.mark.slow
def test_a_copy_of_the_process_gets_another_one(script: Any) -> None:
    program = """
if os.fork() == 0:
    print(pid(), flush=True)
    sys.exit()
os.wait()
print(pid(), flush=True)
"""
    out, errors = script(program).communicate(timeout=60)
    first, of_the_copy, again = map(int, out.split())
    assert (again, errors) == (first, "")
    assert of_the_copy != first
    assert until(lambda: not alive(of_the_copy))


@pytest.mark.slow
def test_daemonic_workers_have_one_each(script: Any) -> None:
    program = """
from multiprocessing import get_context
with get_context("fork").Pool(2) as pool:
    print(*pool.map(pid, ["nap", "nap"], chunksize=1), flush=True)
"""
    out, errors = script(program).communicate(timeout=60)
    processes = {*map(int, out.split())}
    assert (len(processes), errors) == (3, "")
    assert until(lambda: not any(map(alive, processes)))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no server")
def test_a_module_that_never_loads_ends_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "loads_for_ever.py").write_text("import time\ntime.sleep(600.0)\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(process, "START_SECONDS", 0.2)
    hangs = WorkerProcess(["loads_for_ever"])
    with pytest.raises(WorkerError, match="3 worker processes in a row died while they started"):
        hangs.make(abs, (-1,), seconds=60.0)
    monkeypatch.undo()
    assert WorkerProcess().make(abs, (-1,), seconds=60.0).value == 1


# answers without an end


@pytest.mark.parametrize("what", ["path", "list", "wide", "nodes"])
def test_an_endless_path_is_a_failure(what: str) -> None:
    answer = cg.solve(PROBLEM, Endless(what=what))
    assert (answer.status, len(answer.path), len(answer.nodes)) == (Status.FAILED, 0, 0)
    assert f"its path has {3 * MOST_WAYPOINTS:,} waypoints; at most {MOST_WAYPOINTS:,} are taken" in answer.message


def test_of_an_endless_trace_or_message_the_ends_are_kept() -> None:
    answer = cg.solve(PROBLEM, Endless(what="trace"))
    assert (answer.status, len(answer.trace)) == (Status.FOUND, MOST_TRACE)
    said = cg.solve(PROBLEM, Endless(what="message")).message
    assert (said[:9], len(said), "…" in said) == ("\\x1b[2J l", MOST_OF_MESSAGE, True)
    without = cg.solve(PROBLEM, Endless(what="no path"))
    assert (without.status, len(without.path)) == (Status.NOT_FOUND, 0)


def test_no_endless_answer_leaves_the_solvers_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The user's process would have to hold it."""
    sent: list[int] = []
    own = isolated.pickle.loads
    monkeypatch.setattr(isolated.pickle, "loads", lambda data: (sent.append(len(data)), own(data))[1])
    for what in ("path", "list", "nodes", "message"):
        cg.solve(PROBLEM, Endless(what=what), isolated=True)
    with pytest.raises(RuntimeError, match="ValueError: long"):
        cg.solve(PROBLEM, Endless(what="raises"), isolated=True)
    assert len(sent) >= 5
    assert max(sent) < 10**5


def test_an_answer_with_endless_fields_of_its_own_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(isolated, "MOST_OF_ANSWER", 2**20)
    assert isolated._checked(Own(), b"1" * 2**20)
    with pytest.raises(SolverFaultError, match="takes 3 MB; at most 1 MB are taken"):
        isolated._checked(Own(), b"1" * 3 * 2**20)

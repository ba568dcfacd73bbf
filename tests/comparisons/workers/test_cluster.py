"""Calls on a Dask cluster: a real scheduler and real workers on this machine, some of which are killed."""

import importlib.util
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Hashable, Iterable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from types import ModuleType
from typing import Any

import awkward_calls
import plug_ins
import pytest
from awkward_calls import alive, until

from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.execution import run_study
from cgla_graph.comparisons.study.store import StudyStore, load
from cgla_graph.comparisons.study.study import Cell, Study
from cgla_graph.comparisons.workers import cluster
from cgla_graph.comparisons.workers.cluster import CONNECT_SECONDS, spread
from cgla_graph.comparisons.workers.environment import needed_by
from cgla_graph.comparisons.workers.pool import Call, NextCall, isolated
from cgla_graph.errors import CglaError, WorkerError
from cgla_graph.isolation.outcome import Failure, Outcome
from cgla_graph.scenarios.random_map import random_scenario

needs_dask = pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="Dask is not installed")
pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="looks at processes as Linux has them")


@pytest.fixture(scope="module")
def awkward(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """Install the functions that are called."""
    with pytest.MonkeyPatch.context() as patch:
        awkward_calls.install(tmp_path_factory.mktemp("awkward"), patch)
        yield importlib.import_module("awkward")


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
        return port


@contextmanager
def dask(folder: Path, *words: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a part of Dask; what it logs is for whom the test fails."""
    settings = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}
    program = [sys.executable, "-m", "dask", *words, "--no-dashboard"]
    with (folder / f"{words[0]}.log").open("ab") as log:
        part = subprocess.Popen(program, stdout=log, stderr=log, env={**os.environ, **settings}, cwd=folder)
    try:
        yield part
    finally:
        part.kill()
        part.wait(20.0)


class Cluster(ExitStack):
    """A scheduler and its workers, on free ports of this machine."""

    def __init__(self, folder: Path, n_workers: int) -> None:
        super().__init__()
        with ExitStack() as parts:
            port = free_port()
            self.address = f"127.0.0.1:{port}"
            host = ["--host", "127.0.0.1", "--port", str(port)]
            self.scheduler = parts.enter_context(dask(folder, "scheduler", *host))
            options = ["--nthreads", "1", "--death-timeout", "60", "--local-directory", str(folder)]
            words = ["worker", self.address, *options]
            self.workers = [parts.enter_context(dask(folder, *words)) for _ in range(n_workers)]
            assert until(lambda: answers(port), 60.0)
            self.wait(n_workers)
            self.push(parts.pop_all())

    def wait(self, n_workers: int) -> None:
        """Wait for workers."""
        with distributed().Client(self.address, set_as_default=False, timeout=60.0) as client:
            client.wait_for_workers(n_workers, timeout=60.0)


def distributed() -> Any:  # noqa: ANN401 - a module without types
    return importlib.import_module("distributed")


def answers(port: int) -> bool:
    with socket.socket() as one:
        return one.connect_ex(("127.0.0.1", port)) == 0


def one_by_one(calls: Sequence[Call]) -> NextCall:
    left = iter(calls)
    return lambda: next(left, None)


def outcomes(ended: Iterable[tuple[Call, Outcome]]) -> dict[Hashable, Outcome]:
    """Collect outcomes, each of which comes once."""
    found: dict[Hashable, Outcome] = {}
    for call, outcome in ended:
        assert call.key not in found
        found[call.key] = outcome
    return found


@pytest.mark.slow
@needs_dask
def test_outcomes_are_those_of_this_machine_though_a_worker_is_killed(awkward: ModuleType, tmp_path: Path) -> None:
    note = tmp_path / "note"
    calls = [
        Call("leave", awkward.leave, (0,)),
        Call("segfault", awkward.segfault),
        Call("hang", awkward.hang_limited, (0.3,)),
        Call("eat", awkward.eat, (100.0,)),
        Call("raises", awkward.raises, (ValueError, "bad")),
        Call("no pickle", awkward.no_pickle),
        Call("not sent", awkward.square, (threading.Lock(),)),
        *(Call(number, awkward.square, (number,)) for number in range(60)),
        *(Call(f"slow {number}", awkward.nap_noted, (str(note), 1.0)) for number in range(4)),
        *(Call(number, awkward.square, (number,)) for number in range(60, 120)),
    ]
    with Cluster(tmp_path, 2) as machines:

        def kill_one() -> None:
            """Kill one of two workers, both of which are busy."""
            assert until(lambda: note.exists() and note.read_text().count("begun") == 2, 60.0)
            machines.workers[0].kill()

        killer = threading.Thread(target=kill_one)
        killer.start()
        found = outcomes(spread(one_by_one(calls), scheduler=machines.address, seconds=60.0))
        killer.join()
        assert machines.workers[0].wait(10.0) == -signal.SIGKILL
    # lost calls were started again
    assert note.read_text().count("begun") > 4
    assert found == outcomes(isolated(one_by_one(calls), workers=2, seconds=60.0))


@pytest.mark.slow
@needs_dask
def test_a_study_is_the_same_on_a_cluster_that_loses_a_worker(tmp_path: Path) -> None:
    scenarios = [random_scenario(seed, resolution=12) for seed in range(3)]
    names = ("cgla", "straight-line", "prm-star:milestones=150")
    entrants = [Entrant.parse(name) for name in names]
    study = Study(scenarios, entrants, range(1, 7), tolerance=0.05)
    local = {Cell(run.scenario.name, run.solver, run.seed): run for run in run_study(study, workers=0)}
    (tmp_path / "dask").mkdir()
    with Cluster(tmp_path / "dask", 2) as parts, StudyStore.create(tmp_path, study) as store:
        far = []
        for run in run_study(study, store=store, scheduler=parts.address):
            far.append(run)
            if len(far) == 5:
                parts.workers[0].send_signal(signal.SIGKILL)
        assert len(far) == len(local) == 3 * (2 + 6)
        assert parts.workers[1].poll() is None
    for run in load(tmp_path).runs:
        other = local[Cell(run.scenario.name, run.solver, run.seed)]
        assert run.solution.path.tolist() == other.solution.path.tolist()
        assert (run.solution.status, run.solution.cost) == (other.solution.status, other.solution.cost)
        assert run.solution.lower_bound == other.solution.lower_bound


@pytest.mark.slow
@needs_dask
@pytest.mark.filterwarnings("ignore:the Dask scheduler has no workers")
def test_a_call_that_loses_workers_is_not_made_and_a_study_leaves_nothing(awkward: ModuleType, tmp_path: Path) -> None:
    calls = [
        Call("child", awkward.leave_child),
        Call("pid", awkward.where),
        # two workers of Dask, one after the other, as `ALLOWED_FAILURES` is 1
        Call("worker", awkward.kill_parent),
        Call("after", awkward.where),
    ]
    with Cluster(tmp_path, 1) as machines:
        found = outcomes(spread(one_by_one(calls), scheduler=machines.address, seconds=60.0))
        assert found["worker"].failure is Failure.LOST
        assert found["worker"].message.startswith("2 workers of the cluster were lost while they made it")
        pids = [found[key].value for key in ("child", "pid", "after")]
        assert all(until(lambda pid=pid: not alive(pid)) for pid in pids)  # type: ignore[misc]
        machines.wait(1)
        # closing the iteration early stops running calls
        note = tmp_path / "hung"
        hang = [Call("pid", awkward.where), Call("hang", awkward.hang, (str(note),))]
        with closing(spread(one_by_one(hang), scheduler=machines.address, seconds=60.0)) as ended:  # type: ignore[type-var]
            next(ended)
            assert until(lambda: note.exists() and bool(note.read_text()))
        assert until(lambda: not alive(int(note.read_text())))


@pytest.mark.slow
@needs_dask
def test_a_scheduler_that_is_lost_is_told(awkward: ModuleType, tmp_path: Path) -> None:
    calls = [Call("pid", awkward.where), Call("nap", awkward.nap, (1000.0,))]
    with Cluster(tmp_path, 1) as machines:
        ended = spread(one_by_one(calls), scheduler=machines.address, seconds=60.0)
        next(ended)
        machines.scheduler.kill()
        began = time.monotonic()
        with pytest.raises(WorkerError, match=f"the Dask scheduler at '{machines.address}' is lost") as told:
            next(ended)
        assert time.monotonic() - began < CONNECT_SECONDS, "nobody waits for what is gone"
        assert len(str(told.value).splitlines()) == 1


@needs_dask
@pytest.mark.parametrize("address", ["127.0.0.1:1", "nonsense", "", "foo://bar:1", "no.such.host.invalid:8786"])
def test_no_scheduler_is_one_clear_line_at_once(address: str) -> None:
    began = time.monotonic()
    with pytest.raises(WorkerError, match=re.escape(f"no Dask scheduler answers at {address!r}")) as told:
        next(spread(lambda: None, scheduler=address, seconds=1.0))
    assert len(str(told.value).splitlines()) == 1
    assert time.monotonic() - began < 8.0


@needs_dask
def test_something_else_that_listens_is_no_scheduler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as other:
        address = f"127.0.0.1:{other.getsockname()[1]}"
        with pytest.raises(WorkerError, match="no Dask scheduler answers"):
            next(spread(lambda: None, scheduler=address, seconds=1.0))


def test_without_dask_the_remedy_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(CglaError, match=re.escape("pip install 'cgla-graph[distributed]'")):
        next(spread(lambda: None, scheduler="127.0.0.1:8786", seconds=1.0))


class OddCluster:
    """Stands for a client whose workers answer what they are told to."""

    def __init__(self, n_workers: int, *answers: object) -> None:
        self.n_workers, self.answers, self.asked = n_workers, list(answers), 0

    def nthreads(self) -> dict[str, int]:
        return dict.fromkeys(range(self.n_workers), 1)  # type: ignore[arg-type]

    def submit(self, *_: object, **__: object) -> None:
        self.asked += 1

    def run(self, *_: object, **__: object) -> dict[str, object]:
        return {"tcp://a": self.answers.pop(0)}


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        (["0.0.1"], "cgla-graph 0.0.1 (wanted: "),
        ([PackageNotFoundError("cgla-graph")], "PackageNotFoundError"),
        ([None, "host has numpy 1.0 (wanted: '2.0')"], "host has numpy 1.0"),
        ([None, ModuleNotFoundError("no module")], "ModuleNotFoundError: no module"),
    ],
)
def test_workers_that_differ_are_an_error_before_the_first_call(answers: list[object], words: str) -> None:
    wanted = needed_by(["cgla"])
    own = [answer or wanted["cgla-graph"] for answer in answers]
    with pytest.raises(WorkerError, match=re.escape(words)) as told:
        cluster._check_workers(OddCluster(1, *own), "here", "study", wanted)
    assert "tcp://a" in str(told.value)
    assert "install the same there" in str(told.value)


def test_a_scheduler_without_workers_is_an_error_after_a_wait_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "WORKER_SECONDS", 0.2)
    monkeypatch.setattr(cluster, "QUIET_SECONDS", 0.0)
    empty = OddCluster(0)
    with (
        pytest.warns(UserWarning, match="no workers; waiting up to"),
        pytest.raises(WorkerError, match="'here' has no workers; `dask worker here` starts one"),
    ):
        cluster._check_workers(empty, "here", "study", needed_by([]))
    # clusters that grow with their work were given some
    assert empty.asked == 1


def test_a_worker_that_differs_makes_no_call() -> None:
    reply = cluster._run("other", {"numpy": "0.1"}, b"", 1.0, ())
    assert reply.failure is Failure.NOT_MADE
    assert "(wanted: '0.1')" in reply.message


@pytest.mark.slow
@needs_dask
def test_a_study_with_a_plug_in_is_not_begun_on_workers_without_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the plug-in there, it is complete."""
    site = plug_ins.install(tmp_path, monkeypatch)
    study = Study([random_scenario(1, resolution=6)], [Entrant.parse("honest")], tolerance=None)
    monkeypatch.delenv("PYTHONPATH")
    with Cluster(tmp_path, 1) as parts, StudyStore.create(tmp_path, study) as store:
        with pytest.raises(WorkerError, match=r"solver honest none \(wanted: 'odd-solvers 1.0'\)"):
            list(run_study(study, store=store, scheduler=parts.address))
        assert not load(tmp_path).runs
    monkeypatch.setenv("PYTHONPATH", str(site))
    with Cluster(tmp_path, 1) as parts, StudyStore.resume(tmp_path, study) as store:
        (run,) = run_study(study, store=store, scheduler=parts.address)
    assert run.solution.status.label == "found"
    assert load(tmp_path).is_complete

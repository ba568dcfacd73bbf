"""Executing studies: every cell becomes a run for every solver, and no cell runs twice."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import plug_ins
import pytest

from cgla_graph.comparisons.study import execution
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.execution import run_study
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.comparisons.study.store import StudyStore, load
from cgla_graph.comparisons.study.study import Study
from cgla_graph.errors import WorkerError
from cgla_graph.isolation.limits import Limits
from cgla_graph.isolation.outcome import Outcome
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.scenario import Scenario, load_scenario, scenario_from_toml

SMALL = """start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 5.0\nthreats = [{ x = 0.5, y = 0.5, spread = 0.1 }]
[lattice]\nresolution = 6\n"""
#: What each solver that misbehaves ends as, and a word of its message.
ENDS = {
    "sleeps": ("timed-out", "after 2 s"),
    "hangs": ("timed-out", "after 2 s"),
    "allocates": ("out-of-memory", "300 MB"),
    "leaves": ("crashed", "0"),
    "segfaults": ("crashed", "SIGSEGV"),
    "raises": ("failed", "ValueError: not today"),
    "exits": ("failed", "KeyboardInterrupt"),
    "odd": ("failed", "Local: from"),
    "nan": ("failed", "nan"),
    "lies": ("failed", "0.001"),
    "talks": ("found", ""),
    "gossips": ("found", ""),
    "honest": ("found", ""),
}


def small(name: str = "small") -> Scenario:
    return scenario_from_toml(SMALL, name)


def study(*texts: str, scenarios: list[Scenario] | None = None, **more: object) -> Study:
    chosen = [Entrant.parse(text) for text in texts]
    given: dict[str, object] = {"tolerance": None, **more}
    return Study(scenarios or [small()], chosen, **given)  # type: ignore[arg-type]


def same(one: Run, two: Run) -> None:
    """Check that two runs found the same, however long that took."""
    assert (one.scenario.name, one.solver, one.seed, one.exact) == (two.scenario.name, two.solver, two.seed, two.exact)
    np.testing.assert_array_equal(one.solution.path, two.solution.path)
    assert one.solution.status is two.solution.status
    for name in ("cost", "length", "risk", "clearance", "lower_bound", "evaluations"):
        assert getattr(one.solution, name) == pytest.approx(getattr(two.solution, name), rel=0.0, nan_ok=True), name


@pytest.mark.slow
def test_everything_that_a_solver_does_is_a_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    plug_ins.install(tmp_path, monkeypatch)
    all_of_them = study(*ENDS, limits=Limits(2.0, 300.0))
    runs = {run.solver: run for run in run_study(all_of_them, workers=2)}
    assert runs.keys() == ENDS.keys()
    for name, (status, word) in ENDS.items():
        solution = runs[name].solution
        assert (solution.status.label, word in solution.message) == (status, True), (name, solution.message)
        assert "\n" not in solution.message
        assert math.isfinite(solution.cost) == solution.status.has_path or name in {"nan", "lies"}
    assert runs["sleeps"].solution.seconds == 2.0
    assert capfd.readouterr().out == ""


@pytest.mark.slow
def test_no_solver_leaves_anything_to_another(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plug_ins.install(tmp_path, monkeypatch)
    labels = ("honest", "dirties", "honest:note=again", "cgla", "dirties:note=again", "talks", "prm-star:milestones=50")
    runs = {run.solver: run.solution for run in run_study(study(*labels, seeds=(1,)), workers=1)}
    assert {label for label, answer in runs.items() if not answer.status.has_path} == {"dirties", "dirties:note=again"}
    assert runs["honest"].cost == runs["honest:note=again"].cost > runs["cgla"].cost
    assert runs["dirties"].status is Status.FAILED
    assert runs["dirties"].message == "dirties changed its problem (k); have it work on a copy"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["disarms", "stops"])
def test_a_solver_that_disarms_its_limit_is_stopped(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The next solver begins then; a busy machine may stop it at the same limit."""
    plug_ins.install(tmp_path, monkeypatch)
    tally = tmp_path / "tally"
    asked = study(name, f"counts:note={str(tally)!r}", limits=Limits(1.0, 300.0))
    stopped, after = (run.solution.status for run in run_study(asked, workers=1))
    assert (stopped, len(tally.read_text().splitlines())) == (Status.TIMED_OUT, 1)
    assert after in {Status.FOUND, Status.TIMED_OUT}


@pytest.mark.slow
def test_runs_are_those_of_a_plain_loop() -> None:
    names = ["cgla", "dijkstra", "prm-star:milestones=60", "straight-line", "lazy-theta-star"]
    asked = study(*names, scenarios=[small("a"), load_scenario("one-threat")], tolerance=0.01, seeds=(1, 2))
    loop = list(compare(asked.scenarios, asked.entrants, 2, tolerance=0.01))
    for workers in (0, 1, 2):
        runs = sorted(run_study(asked, workers=workers), key=lambda run: list(asked.cells()).index(_cell(run)))
        assert len(runs) == len(loop) == 12
        for one, two in zip(runs, loop, strict=True):
            same(one, two)
            assert one.certificate is not None
            assert one.certificate.lower_bound == one.solution.lower_bound


def _cell(run: Run) -> tuple[str, str, int | None]:
    return run.scenario.name, run.solver, run.seed


@pytest.mark.slow
def test_workers_work_at_the_same_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plug_ins.install(tmp_path, monkeypatch)
    place = tmp_path / "meeting"
    place.mkdir()
    labels = [f"meets:note={str(place)!r}", f"meets:note={str(place) + '/'!r}"]
    assert {run.solution.status.label for run in run_study(study(*labels), workers=2)} == {"found"}


@pytest.mark.slow
def test_nothing_is_run_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plug_ins.install(tmp_path, monkeypatch)
    tally = tmp_path / "tally"
    names = [small(f"s{number}") for number in range(6)]
    asked = study(f"counts:note={str(tally)!r}", scenarios=names)
    with StudyStore.create(tmp_path, asked, workers=0, command="") as store:
        runs = run_study(asked, store=store, workers=0)
        for _ in range(4):
            next(runs)
        runs.close()  # type: ignore[attr-defined]
    assert len(load(tmp_path).runs) == 4
    with StudyStore.resume(tmp_path, asked, workers=1, command="") as store:
        rest = list(run_study(asked, store=store, workers=1))
    assert len(rest) == 2
    assert len(tally.read_text().splitlines()) == 6
    assert [run.scenario.name for run in load(tmp_path).runs] == [scenario.name for scenario in names]
    assert load(tmp_path).is_complete


@pytest.mark.slow
def test_a_proof_that_fails_leaves_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(execution, "PROOF_LIMITS", Limits(1e-3, 4096.0))
    asked = study("straight-line", tolerance=1e-9, limits=Limits(1e-3, 4096.0))
    (run,) = run_study(asked, workers=1)
    assert run.certificate is not None
    assert math.isnan(run.certificate.lower_bound)
    assert "stopped after 0.001 s" in run.certificate.message


@pytest.mark.slow
def test_a_proof_has_time_where_runs_have_none() -> None:
    (run,) = run_study(study("straight-line", tolerance=0.1, limits=Limits(1e-6, 4096.0)), workers=1)
    assert run.solution.status is Status.TIMED_OUT
    assert run.certificate is not None
    assert run.certificate.lower_bound > 0.0


def test_no_limit_holds_in_the_users_own_process() -> None:
    (run,) = run_study(study("cgla", limits=Limits(1e-6, 1e-6)), workers=0)
    assert run.solution.status is Status.OPTIMAL


def test_an_answer_becomes_plain() -> None:
    trace = (TracePoint(np.float64(1.0), np.int64(2), "no number"),)  # type: ignore[arg-type]
    odd = Solution(Status.FOUND, cost=np.float32(0.5), message="a\nb", trace=trace, evaluations=math.inf)  # type: ignore[arg-type]
    answer = execution.plain(odd)
    assert (type(answer.cost), answer.cost, answer.message, answer.evaluations) == (float, 0.5, "a b", 0)
    assert math.isnan(answer.trace[0].cost)
    assert dataclasses.replace(answer, trace=()).path.shape == (0, 2)


@pytest.mark.parametrize(
    ("error", "workers"),
    [
        ("ModuleNotFoundError('No module named numpyy')", 0),
        ("ImportError('libgone.so cannot be opened')", 0),
        ("FileNotFoundError(2, 'No such file or directory')", 0),
        ("OSError(28, 'No space left on device')", 0),
        ("PermissionError(13, 'Permission denied')", 0),
        pytest.param("OSError(24, 'Too many open files')", 1, marks=pytest.mark.slow),
        # as the system does when memory runs out
        pytest.param("os.kill(os.getpid(), 9)", 1, marks=pytest.mark.slow),
    ],
)
def test_errors_of_the_environment_are_no_results(
    error: str, workers: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are made again, and the other solvers' runs are made in any case."""
    plug_ins.install(tmp_path, monkeypatch)
    file = tmp_path / "file"
    asked = study(f"lacks:note={f'{error}@{file}'!r}", "cgla")
    with StudyStore.create(tmp_path, asked) as store, pytest.raises(WorkerError, match="1 task could not be made"):
        list(run_study(asked, store=store, workers=workers))
    assert [run.solver for run in load(tmp_path).runs] == ["cgla"]
    file.touch()
    with StudyStore.resume(tmp_path, asked) as store:
        (run,) = run_study(asked, store=store, workers=workers)
    assert run.solution.status is Status.FOUND
    assert load(tmp_path).is_complete


@pytest.mark.parametrize(
    "error", ["ValueError(1)", "TimeoutError(2)", "KeyError(3)", "RuntimeError('4')", "Exception()"]
)
def test_errors_of_a_solver_are_results(error: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plug_ins.install(tmp_path, monkeypatch)
    (run,) = run_study(study(f"lacks:note={error!r}"), workers=0)
    assert run.solution.status is Status.FAILED
    assert run.solution.message.startswith(error.partition("(")[0])


def test_a_solver_that_is_missing_on_the_worker_only_is_no_result(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is missing here too has a row that says so."""
    asked = study("straight-line")
    outcome = Outcome(execution.Answer(Solution(Status.UNAVAILABLE, message="needs numpyy"), 1.0, "far"))
    (task,) = execution.study_tasks(asked)
    with pytest.raises(WorkerError, match=r"needs numpyy \(on far\)"):
        task.result(outcome, Limits(), {})
    monkeypatch.setattr(Entrant, "is_available", property(lambda _: False))
    assert task.result(outcome, Limits(), {}).solution.status is Status.UNAVAILABLE


@pytest.mark.parametrize(
    "answer",
    [
        Solution(Status.NOT_FOUND, path="nowhere"),  # type: ignore[arg-type]
        Solution(Status.NOT_FOUND, trace=(lambda: 3,)),  # type: ignore[arg-type]
    ],
)
def test_an_answer_that_makes_no_sense_is_the_solvers(answer: Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(execution.runner, "run", lambda *_: answer)
    (run,) = run_study(study("straight-line"), workers=0)
    assert run.solution.status is Status.FAILED

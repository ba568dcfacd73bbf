"""The store of a study: results are neither lost nor changed."""

import dataclasses
import json
import math
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exact import bits
from hypothesis import given
from hypothesis import strategies as st
from programs import program
from strategies import few
from studies_small import add_run, named, runs_of, small_study, write_study

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.provenance import session as session_here
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.store import FILE, OMPL_FILE, PROOF, StudyStore, load, load_study
from cgla_graph.comparisons.study.study import Cell, Study
from cgla_graph.errors import CglaError, OutputError, StudyError
from cgla_graph.isolation.limits import Limits
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.testing.strategies import seeds as random_seeds

#: Strings from everywhere, lone surrogates of odd file names and NUL included.
texts = st.text(st.characters(codec=None, exclude_categories=()), max_size=12)
counts = st.one_of(st.integers(0, 10**6), st.sampled_from([2**53 + 1, 2**63 - 1, 2**63, 10**400]))


@st.composite
def solutions(draw: st.DrawFn) -> Solution:
    """Draw what workers hand on: any numbers at all, also of paths that may not be flown."""
    rng = np.random.default_rng(draw(random_seeds))
    moments = st.one_of(st.floats(), st.sampled_from([0.1, 0.2, 0.2]))
    return Solution(
        status=draw(st.sampled_from(Status)),
        path=rng.normal(size=(draw(st.integers(0, 4)), 2)),
        cost=draw(st.floats()),
        length=draw(st.floats()),
        risk=draw(st.floats()),
        clearance=draw(st.floats()),
        lower_bound=draw(st.floats()),
        solver=draw(texts),
        seconds=draw(moments),
        build_seconds=draw(st.floats(allow_nan=True)),
        certificate_seconds=draw(st.floats()),
        evaluations=draw(counts),
        trace=tuple(draw(st.lists(st.builds(TracePoint, moments, counts, st.floats()), max_size=4))),
        message=draw(texts),
    )


STUDY = small_study(["first", "second"], ["prm-a", "straight", "prm-b"], title="Any runs")
RUNS = runs_of(STUDY)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "out"


def one_line(error: pytest.ExceptionInfo[CglaError]) -> str:
    text = str(error.value)
    assert "\n" not in text
    return text


def lines_of(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / FILE).read_bytes().splitlines()]


def session_of(folder: Path) -> dict[str, Any]:
    """Return the last session line."""
    return [line for line in lines_of(folder) if line["kind"] == "session"][-1]


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {f"{FILE}.lock"}


# Round trips


@few
@given(
    st.lists(st.tuples(st.integers(0, len(RUNS) - 1), solutions()), max_size=3, unique_by=lambda one: one[0]), st.data()
)
def test_any_runs_survive_to_the_last_bit(answers: list[tuple[int, Solution]], data: st.DataObject) -> None:
    proof = Certificate(1.0, math.inf, 0.1, 0.5, 9, data.draw(texts), 0.1)
    expected = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with StudyStore.create(folder, STUDY) as store:
            store.add((PROOF, "first"), proof)
            for number, (at, answer) in enumerate(answers, start=1):
                how: dict[str, Any] = {
                    "solution": answer,
                    "megabytes": data.draw(st.floats()),
                    "host": data.draw(texts),
                }
                run = dataclasses.replace(RUNS[at], **how)
                certificate = proof if run.scenario.name == "first" else None
                solution = dataclasses.replace(answer, certificate=certificate)
                expected[at] = dataclasses.replace(run, solution=solution, number=number, certificate=certificate)
                assert bits(add_run(store, run)) == bits(expected[at])
            assert store.finished() == {cell_of(run) for run in expected.values()}
        found = load(folder)
    assert [bits(run) for run in found.runs] == [bits(expected[at]) for at in sorted(expected)]


def answers(runs: list[Run]) -> list[object]:
    """Return what runs found; nothing was proven for the store."""
    return [bits(dataclasses.replace(run.solution, certificate=None)) for run in runs]


def cell_of(run: Run) -> Cell:
    return Cell(run.scenario.name, run.solver, run.seed)


def test_runs_come_in_the_order_of_cells_and_share_their_scenarios(folder: Path) -> None:
    with StudyStore.create(folder, STUDY) as store:
        for run in reversed(RUNS):
            add_run(store, run)
    found = load(folder)
    assert [cell_of(run) for run in found.runs] == list(STUDY.cells())
    assert {id(run.scenario) for run in found.runs} == {id(scenario) for scenario in found.scenarios}
    assert found.solvers == ["prm-a", "straight", "prm-b"]
    assert found.n_cells == len(RUNS)
    assert (found.title, found.limits, found.folder) == ("Any runs", STUDY.limits, folder)
    (session,) = found.sessions
    assert dataclasses.replace(session, started="") == dataclasses.replace(session_here(1, workers="1"), started="")


def test_a_study_is_what_was_asked_for(folder: Path) -> None:
    source = 'title = "caf\u00e9"\n'
    asked = dataclasses.replace(STUDY, source=source, tolerance=None, seeds=(7, 2**40), limits=Limits(math.inf, 10.5))
    StudyStore.create(folder, asked, workers=3, command="cgla compare caf\udce9.toml").close()
    again = load_study(folder)
    assert list(again.cells()) == list(asked.cells())
    assert [bits(one) for one in again.entrants] == [bits(one) for one in asked.entrants]
    assert [bits(one) for one in again.scenarios] == [bits(one) for one in asked.scenarios]
    assert (again.title, again.source, again.tolerance, again.limits) == ("Any runs", source, None, asked.limits)
    (session,) = load(folder).sessions
    # characters outside UTF-8 are escaped
    assert (session.workers, session.command, session.source) == ("3", r"cgla compare caf\udce9.toml", source)


def test_scenarios_on_one_map_share_its_area(folder: Path, tmp_path: Path) -> None:
    cells = "\n".join("." * 50 if row % 2 else ".@" * 25 for row in range(50))
    tmp_path.joinpath("big.map").write_text(f"type octile\nheight 50\nwidth 50\nmap\n{cells}\n", encoding="utf-8")
    lines = [f"0\tbig.map\t50\t50\t0\t0\t{x}\t1\t3.0" for x in range(1, 41)]
    tmp_path.joinpath("big.scen").write_text("\n".join(["version 1", *lines]), encoding="utf-8")
    scenarios = list(open_scenarios(str(tmp_path / "big.scen")))
    StudyStore.create(folder, Study(scenarios, [Entrant.parse("straight-line")])).close()
    assert len(session_of(folder)["areas"]) == 1
    again = load(folder).scenarios
    assert [bits(one) for one in again] == [bits(one) for one in scenarios]
    assert len({id(one.problem.no_fly) for one in again}) == 1


def test_scenarios_share_a_raster_and_another_one_differs(folder: Path) -> None:
    def over(value: float, *names: str) -> Study:
        field = RiskField(rasters=[RasterRisk([[1.0, value]], (0, 0, 1, 1))])
        scenarios = [dataclasses.replace(named(name), problem=Problem((0, 0), (1, 1), field)) for name in names]
        return Study(scenarios, [Entrant.parse("straight-line")])

    StudyStore.create(folder, over(2.0, "first", "second")).close()
    assert len(session_of(folder)["rasters"]) == 1
    again = load(folder).scenarios
    assert again[0].problem.field.rasters[0] is again[1].problem.field.rasters[0]
    StudyStore.resume(folder, over(2.0, "first")).close()
    for other in (over(3.0, "first"), Study([named("first")], [Entrant.parse("straight-line")])):
        with pytest.raises(StudyError, match=r"problem\.rasters"):
            StudyStore.resume(folder, other)


def test_odd_names_are_kept(folder: Path) -> None:
    names = [
        "<script>alert(1)</script>",
        "a'b\"c; DROP TABLE runs;--",
        "two\nlines",
        "\U0001f681",
        "caf\udce9",
        "nul\0",
        "",
    ]
    study = small_study(names, [f"prm {name}" for name in names], seeds=[1])
    kept = write_study(folder, study)
    assert [one.name for one in kept.scenarios] == names
    assert kept.solvers == [f"prm {name}" for name in names]
    assert len(kept.runs) == len(names) ** 2
    with StudyStore.resume(folder, study) as store:
        assert store.finished() == set(study.cells())


def test_what_is_not_of_the_study_is_refused(folder: Path) -> None:
    with StudyStore.create(folder, STUDY) as store:
        add_run(store, RUNS[0])
        with pytest.raises(StudyError, match="is there already") as error:
            add_run(store, RUNS[0])
        assert "the run of 'first', 'prm-a', 1" in one_line(error)
        for wrong in ({"seed": 9}, {"solver": "x"}, {"scenario": named("third")}):
            with pytest.raises(StudyError, match="is not part of the study"):
                add_run(store, dataclasses.replace(RUNS[0], **wrong))
        with pytest.raises(StudyError, match="the proof of 'third' is not part"):
            store.add((PROOF, "third"), Certificate(1, 1, 1, 1, 1, "", 0))
    assert len(load(folder).runs) == 1


def test_a_study_that_names_something_twice_is_refused(folder: Path) -> None:
    for study, what in ((small_study(["a", "a"], ["x"]), "scenario"), (small_study(["a"], ["x", "x"]), "entrant")):
        with pytest.raises(StudyError, match=f"more than one {what} of the name"):
            StudyStore.create(folder, study)
        assert not folder.exists()


# Going on


def test_a_study_goes_on_and_grows(folder: Path) -> None:
    write_study(folder, STUDY, first=3)
    grown = small_study(["third", "second", "first"], ["straight", "prm-c", "prm-a"], seeds=(3, 1))
    with StudyStore.resume(folder, grown, workers=4, command="again") as store:
        assert store.finished() == {cell_of(run) for run in RUNS[:3]}
        whole = store.study
        assert [one.name for one in whole.scenarios] == ["third", "second", "first"]
        assert [one.label for one in whole.entrants] == ["straight", "prm-c", "prm-a", "prm-b"]
        assert whole.seeds == (3, 1, 2)
        assert whole.title == "Any runs"
        assert (PROOF, "first") in store
        assert (PROOF, "third") not in store
        for run in runs_of(whole):
            if cell_of(run) not in store.finished():
                add_run(store, run)
    kept = load(folder)
    assert [cell_of(run) for run in kept.runs] == list(whole.cells())
    assert kept.is_complete
    assert [session.command for session in kept.sessions] == ["cgla compare", "again"]
    assert list(load_study(folder).cells()) == list(whole.cells())


def test_a_complete_study_is_no_longer_so_when_it_grows(folder: Path) -> None:
    assert write_study(folder, STUDY).is_complete
    StudyStore.resume(folder, dataclasses.replace(STUDY, seeds=(1, 2, 3))).close()
    kept = load(folder)
    assert not kept.is_complete
    assert (len(kept.runs), kept.n_cells) == (len(RUNS), len(RUNS) + 4)


def test_what_has_become_another_one_is_refused_and_nothing_is_written(folder: Path) -> None:
    write_study(folder, STUDY, first=3)
    before = bits(load(folder).sessions)
    easier = dataclasses.replace(named("first"), problem=dataclasses.replace(named("first").problem, k=1.0))
    other: list[tuple[dict[str, Any], str]] = [
        ({"scenarios": [easier]}, "scenario 'first' is not the one in the study so far: problem.k differ"),
        ({"entrants": [Entrant("straight", "cgla")]}, "entrant 'straight' .* name differ"),
        ({"limits": Limits(1.0, 4096.0)}, "limits of 600 seconds .* this one limits of 1 seconds"),
        ({"tolerance": None}, "a tolerance of 0.1, this one no lower bounds"),
    ]
    for change, words in other:
        with pytest.raises(StudyError, match=words) as error:
            StudyStore.resume(folder, dataclasses.replace(STUDY, **change))
        one_line(error)
    assert bits(load(folder).sessions) == before
    # words about it may change
    titled = dataclasses.replace(named("first"), title="another title", notes="and notes")
    StudyStore.resume(folder, dataclasses.replace(STUDY, scenarios=[titled])).close()


def test_a_solver_that_was_not_installed_and_is_now_is_planned_anew(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(Entrant, "is_available", property(lambda one: one.name != "prm-star"))
        assert write_study(folder, STUDY, first=1).n_cells == 6
        assert load(folder).runs[0].seed is None
    with StudyStore.resume(folder, STUDY) as store:
        for run in RUNS:
            add_run(store, run)
    kept = load(folder)
    # the run without a seed stays, as it took place
    assert len(kept.runs) == kept.n_cells == len(RUNS) + 1


def test_a_second_writer_is_refused(folder: Path) -> None:
    with StudyStore.create(folder, STUDY) as store:
        add_run(store, RUNS[0])
        for start in (StudyStore.resume, StudyStore.create):
            with pytest.raises(OutputError, match="another process writes this study; wait for it") as error:
                start(folder, STUDY)
            one_line(error)
        add_run(store, RUNS[1])
    with StudyStore.resume(folder, STUDY) as store:
        assert len(store.finished()) == 2


def test_an_existing_study_is_kept_unless_it_shall_be_replaced(folder: Path) -> None:
    write_study(folder, STUDY)
    with pytest.raises(OutputError, match=r"--resume.*--overwrite.*--out") as error:
        StudyStore.create(folder, STUDY)
    one_line(error)
    new = small_study(["new"], ["straight"])
    with StudyStore.create(folder, new, overwrite=True) as store:
        assert store.finished() == set()
    assert [one.name for one in load(folder).scenarios] == ["new"]
    assert names_in(folder) == {FILE}


def test_a_failed_replacement_keeps_the_old_study(folder: Path) -> None:
    before = bits(write_study(folder, STUDY).runs)
    odd = dataclasses.replace(STUDY, entrants=[Entrant("odd", "odd", {"x": object()})])
    with pytest.raises(StudyError, match="odd"):
        StudyStore.create(folder, odd, overwrite=True)
    assert bits(load(folder).runs) == before
    assert names_in(folder) == {FILE}


# Killed, full, locked, damaged


WRITER = """
import sys
from pathlib import Path
from studies_small import add_run, runs_of, small_study
from cgla_graph.comparisons.study.store import FILE, StudyStore
from cgla_graph.comparisons.study.study import Cell
folder, n_seeds = Path(sys.argv[1]), int(sys.argv[2])
study = small_study(["first"], ["prm"], seeds=range(n_seeds))
start = StudyStore.resume if (folder / FILE).exists() else StudyStore.create
with start(folder, study) as store:
    for run in runs_of(study):
        if Cell(run.scenario.name, run.solver, run.seed) not in store.finished():
            print(add_run(store, run).seed, flush=True)
"""


def write_in_another_process(folder: Path, n_seeds: int) -> AbstractContextManager["subprocess.Popen[str]"]:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2] / "support")}
    words = [sys.executable, "-c", WRITER, str(folder), str(n_seeds)]
    return program(words, stdout=subprocess.PIPE, env=environment)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_a_kill_loses_nothing_and_the_study_goes_on(folder: Path) -> None:
    n_seeds = 750
    done: set[int] = set()
    for round_ in range(3):
        with write_in_another_process(folder, n_seeds) as writer:
            assert writer.stdout is not None
            for _ in range(random.randrange(1, 200)):  # noqa: S311 - any moment will do
                done.add(int(writer.stdout.readline()))
            if round_ == 0:
                with pytest.raises(OutputError, match="another process writes this study"):
                    StudyStore.resume(folder, small_study(["first"], ["prm"]))
                # a reader is welcome meanwhile
                assert {run.seed for run in load(folder).runs} >= done
            writer.send_signal(signal.SIGKILL)
            done |= {int(line) for line in writer.stdout.read().split("\n")[:-1]}
        kept = {run.seed for run in load(folder).runs}
        # at most one was written and not told yet
        assert kept >= done
        assert len(kept - done) <= 1
        done = {seed for seed in kept if seed is not None}
    assert len(done) < n_seeds
    with write_in_another_process(folder, n_seeds) as writer:
        writer.communicate(timeout=250.0)
    resumed = load(folder)
    assert resumed.is_complete
    assert len(resumed.sessions) == 4
    study = small_study(["first"], ["prm"], seeds=range(n_seeds))
    assert answers(resumed.runs) == answers(runs_of(study))
    assert names_in(folder) == {FILE}


def remount(disk: Path, options: str) -> None:
    mount = shutil.which("mount") or "mount"
    subprocess.run([mount, "-o", f"remount,{options}", str(disk)], check=True, capture_output=True)


def wide(run: Run) -> Run:
    """Return a run with a path of 4096 corners, about 160 KiB."""
    path = np.random.default_rng(run.seed).random((4096, 2))
    return dataclasses.replace(run, solution=dataclasses.replace(run.solution, path=path))


def add_all(store: StudyStore, runs: list[Run]) -> None:
    for run in runs:
        add_run(store, run)


@pytest.mark.slow
def test_a_full_disk_keeps_what_was_written_and_goes_on(tiny_disk: Path) -> None:
    study = small_study(["first"], ["prm"], seeds=range(100))
    (tiny_disk / "big").write_bytes(b"x" * 64 * 1024)
    with pytest.raises(OutputError, match=r"study\.jsonl: cannot be written: No space.*make room, or") as error:
        StudyStore.create(tiny_disk, study)
    one_line(error)
    assert names_in(tiny_disk) == {"big"}
    (tiny_disk / "big").unlink()
    remount(tiny_disk, "size=1m")
    runs = [wide(run) for run in runs_of(study)]
    with StudyStore.create(tiny_disk, study) as store:
        with pytest.raises(OutputError, match=r"study\.jsonl: .*No space.*; finished runs are kept") as error:
            add_all(store, runs)
        one_line(error)
        n_done = len(store.finished())
        assert 0 < n_done < len(runs)
        assert answers(load(tiny_disk).runs) == answers(runs[:n_done])
        remount(tiny_disk, "size=4m")
        add_all(store, runs[n_done:20])
    with StudyStore.resume(tiny_disk, study) as store:
        assert len(store.finished()) == 20
        with pytest.raises(OutputError, match="No space"):
            add_all(store, runs[20:])
        n_done = len(store.finished())
    assert len(load(tiny_disk).runs) == n_done
    remount(tiny_disk, "size=32m")
    with StudyStore.resume(tiny_disk, study) as store:
        add_all(store, runs[n_done:])
    assert load(tiny_disk).is_complete
    assert names_in(tiny_disk) == {FILE}


def test_reading_leaves_nothing_behind(folder: Path) -> None:
    write_study(folder, STUDY)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    load(folder)
    load_study(folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_disk_that_cannot_be_written_is_read(tiny_disk: Path, tmp_path: Path) -> None:
    before = [bits(run) for run in write_study(tmp_path / "source", STUDY).runs]
    remount(tiny_disk, "size=4m")
    shutil.copy(tmp_path / "source" / FILE, tiny_disk)
    remount(tiny_disk, "ro")
    assert [bits(run) for run in load(tiny_disk).runs] == before
    for start in (StudyStore.create, StudyStore.resume):
        with pytest.raises(OutputError, match=r"cannot be written: .*choose another folder") as error:
            start(tiny_disk, STUDY)
        one_line(error)
    remount(tiny_disk, "rw")


@pytest.mark.parametrize("what", [b"{", b'{"kind":"run","key":["first"', b'{"kind":"run"}', b"\xff\x00"])
def test_a_line_that_was_cut_is_no_line_and_cut_off(folder: Path, what: bytes) -> None:
    """As a killed process leaves it, or a full disk."""
    before = [bits(run) for run in write_study(folder, STUDY, first=3).runs]
    with (folder / FILE).open("ab") as file:
        file.write(what)
    assert [bits(run) for run in load(folder).runs] == before
    with StudyStore.resume(folder, STUDY) as store:
        add_run(store, RUNS[3])
    assert [bits(run) for run in load(folder).runs[:3]] == before
    assert [line["kind"] for line in lines_of(folder)[-2:]] == ["session", "run"]


@pytest.mark.parametrize("part", [0.0, 0.02, 0.1, 0.5, 0.9, 0.999])
def test_of_a_file_that_was_cut_what_is_whole_is_read(folder: Path, part: float) -> None:
    whole = [bits(run) for run in write_study(folder, STUDY).runs]
    path = folder / FILE
    data = path.read_bytes()[: int(part * path.stat().st_size)]
    path.write_bytes(data)
    n_runs = data.count(b'\n{"kind":"run"') - (not data.endswith(b"\n"))
    if b'{"kind":"session"' in data and data.count(b"\n") > 1:
        assert [bits(run) for run in load(folder).runs] == whole[:n_runs]
        return
    for start in (lambda: load(folder), lambda: load_study(folder), lambda: StudyStore.resume(folder, STUDY)):
        with pytest.raises(StudyError, match="damaged") as error:
            start()
        one_line(error)
    assert path.read_bytes() == data


#: Every way to open a folder; what cannot be opened is left as it is.
STARTS: list[Callable[[Path], object]] = [
    load,
    load_study,
    lambda folder: StudyStore.resume(folder, STUDY),
    lambda folder: StudyStore.create(folder, STUDY),
    lambda folder: StudyStore.create(folder, STUDY, overwrite=True),
]


@pytest.mark.parametrize(
    ("name", "content", "starts", "words"),
    [
        *((FILE, content, STARTS, r"study\.jsonl: ") for content in (b"some text, " * 100, b'{"precious": 1}\n')),
        (OMPL_FILE, b"SQLite format 3\0", STARTS[:4], r"an earlier cgla-graph \(study\.db.*run the study anew"),
        (FILE, None, STARTS[:3], r"another cgla-graph \(format 2, known 1\)"),
    ],
    ids=["text", "JSON", "of before", "another format"],
)
def test_what_is_no_study_of_this_version_is_refused_and_left_alone(
    folder: Path, name: str, content: bytes | None, starts: list[Callable[[Path], object]], words: str
) -> None:
    if content is None:
        write_study(folder, STUDY)
        content = (folder / FILE).read_bytes().replace(b'"format":1', b'"format":2', 1)
    folder.mkdir(exist_ok=True)
    (folder / name).write_bytes(content)
    for start in starts:
        with pytest.raises(CglaError, match=words) as error:
            start(folder)
        one_line(error)
    assert (folder / name).read_bytes() == content
    assert names_in(folder) == {name}


def _without(name: str) -> Callable[[dict[str, Any]], object]:
    return lambda line: line.pop(name, None)


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("run", _without("kind")),
        ("run", _without("path")),
        ("run", lambda line: line.update(status="BEST")),
        ("run", lambda line: line.update(status=[])),
        ("run", lambda line: line.update(path=[1.0, 2.0, 3.0])),
        ("run", lambda line: line.update(trace=[[1.0]])),
        ("run", lambda line: line.update(key=["first"])),
        ("run", lambda line: line.update(key=["nowhere", "prm-a", 1])),
        ("run", lambda line: line.update(key=[["first"], "prm-a", 1])),
        ("run", lambda line: line.update(settings={"!what": 1})),
        ("session", _without("seconds")),
        ("session", lambda line: line["scenarios"][0].pop("problem")),
        ("session", lambda line: line.update(entrants=[None])),
        ("session", lambda line: line.update(cells=[])),
        ("session", lambda line: line.update(flights=[["fig4"]])),
        ("session", lambda line: line.update(missions=[{}])),
        ("proof", _without("lower_bound")),
    ],
)
def test_content_that_makes_no_sense_is_one_line(
    folder: Path, kind: str, change: Callable[[dict[str, Any]], object]
) -> None:
    write_study(folder, STUDY)
    lines = lines_of(folder)
    change(next(line for line in lines if line["kind"] == kind))
    (folder / FILE).write_text("".join(f"{json.dumps(line)}\n" for line in lines), encoding="utf-8")
    with pytest.raises(StudyError, match=r"damaged|malformed") as error:
        load(folder)
    one_line(error)


@pytest.fixture(scope="module")
def intact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("intact")
    write_study(folder, STUDY)
    return folder / FILE


@few
@given(st.lists(st.tuples(st.integers(0, 2**20), st.integers(0, 255)), min_size=1, max_size=30))
def test_any_changed_bytes_are_read_or_refused_in_one_line(intact: Path, rot: list[tuple[int, int]]) -> None:
    rotten = bytearray(intact.read_bytes())
    for at, byte in rot:
        rotten[at % len(rotten)] = byte
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / FILE).write_bytes(rotten)
        for start in (load, lambda folder: StudyStore.resume(folder, STUDY).close()):
            try:
                start(folder)
            except CglaError as error:
                assert "\n" not in str(error)  # noqa: PT017 - many changed bytes do not matter


def test_where_there_is_no_study(folder: Path) -> None:
    for start in STARTS[:3]:
        with pytest.raises(StudyError, match=r"study\.jsonl: there is no such file; give the folder") as error:
            start(folder)
        one_line(error)
    assert not folder.exists()
    folder.write_text("a file", encoding="utf-8")
    with pytest.raises(StudyError, match="no such file"):
        load(folder)
    with pytest.raises(OutputError):
        StudyStore.create(folder, STUDY)

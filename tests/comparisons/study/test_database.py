"""The database of a study: nothing is lost, nothing is mangled, and others open it."""

import dataclasses
import hashlib
import importlib.util
import math
import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exact import bits
from hypothesis import given
from hypothesis import strategies as st
from strategies import few
from strategies import seeds as random_seeds
from studies_small import found, named, runs_of, small_study, write_study

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study import database as database_module
from cgla_graph.comparisons.study import schema, stored
from cgla_graph.comparisons.study.database import FILE, Database, load, load_study
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.provenance import Revision, provenance
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.study import Cell, Study
from cgla_graph.comparisons.workers.limits import Limits
from cgla_graph.errors import CglaError, OutputError, StudyError
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.scenario import load_scenario

OMPL = importlib.util.find_spec("ompl")
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


def rows(path: Path, query: str) -> list[Any]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(query).fetchall()


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {f"{FILE}.lock"}


# What is written is what is read


@few
@given(
    st.lists(st.tuples(st.integers(0, len(RUNS) - 1), solutions()), max_size=3, unique_by=lambda one: one[0]), st.data()
)
def test_any_runs_survive_to_the_last_bit(answers: list[tuple[int, Solution]], data: st.DataObject) -> None:
    proof = Certificate(1.0, math.inf, 0.1, 0.5, 9, data.draw(texts), 0.1)
    expected = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Database.create(folder, STUDY) as database:
            database.add_certificate("first", proof)
            for number, (at, answer) in enumerate(answers, start=1):
                how: dict[str, Any] = {
                    "solution": answer,
                    "megabytes": data.draw(st.floats()),
                    "host": data.draw(texts),
                }
                run = dataclasses.replace(RUNS[at], **how)
                certificate = proof if run.scenario.name == "first" else None
                expected[at] = dataclasses.replace(run, number=number, certificate=certificate)
                assert bits(database.add(run)) == bits(expected[at])
            assert database.finished() == {cell_of(run) for run in expected.values()}
        found = load(folder)
    assert [bits(run) for run in found.runs] == [bits(expected[at]) for at in sorted(expected)]


def cell_of(run: Run) -> Cell:
    return Cell(run.scenario.name, run.solver, run.seed)


def test_bits_sees_a_difference_in_any_field_of_a_run() -> None:
    run = dataclasses.replace(RUNS[0], solution=dataclasses.replace(found(2.0), trace=(TracePoint(0.1, 2, 3.0),)))
    other: dict[str, Any] = {
        "status": Status.OPTIMAL, "path": np.zeros((2, 2)), "nodes": (1,), "solver": "y", "evaluations": 1,
        "message": "m", "trace": (TracePoint(0.1, 2, 3.0 + 1e-15),),
    }  # fmt: skip
    for field in dataclasses.fields(Solution):
        changed = dataclasses.replace(run.solution, **{field.name: other.get(field.name, -0.0)})
        assert bits(dataclasses.replace(run, solution=changed)) != bits(run), field.name


def test_runs_come_in_the_order_of_cells_and_share_their_scenarios(folder: Path) -> None:
    with Database.create(folder, STUDY) as database:
        for run in reversed(RUNS):
            database.add(run)
    found = load(folder)
    assert [cell_of(run) for run in found.runs] == list(STUDY.cells())
    assert {id(run.scenario) for run in found.runs} == {id(scenario) for scenario in found.scenarios}
    assert found.solvers == ["prm-a", "straight", "prm-b"]
    assert found.n_cells == len(RUNS)
    assert (found.title, found.limits, found.folder) == ("Any runs", STUDY.limits, folder)
    (session,) = found.sessions
    here = provenance()
    assert (session.number, session.version, session.host) == (1, here.version, here.host)
    assert session.git == str(here.revision or "")
    assert session.packages == here.packages


def test_a_study_is_what_was_asked_for(folder: Path) -> None:
    source = 'title = "caf\u00e9"\n'
    asked = dataclasses.replace(STUDY, source=source, tolerance=None, seeds=(7, 2**40), limits=Limits(math.inf, 10.5))
    Database.create(folder, asked, workers=3, command="cgla compare caf\udce9.toml").close()
    again = load_study(folder)
    assert list(again.cells()) == list(asked.cells())
    assert [bits(one) for one in again.entrants] == [bits(one) for one in asked.entrants]
    assert [bits(one) for one in again.scenarios] == [bits(one) for one in asked.scenarios]
    assert (again.title, again.source, again.tolerance, again.limits) == ("Any runs", source, None, asked.limits)
    (session,) = load(folder).sessions
    # what is no UTF-8 is shown
    assert (session.workers, session.command, session.source) == ("3", r"cgla compare caf\udce9.toml", source)


def test_scenarios_on_one_map_share_its_area(folder: Path, tmp_path: Path) -> None:
    cells = "\n".join("." * 50 if row % 2 else ".@" * 25 for row in range(50))
    tmp_path.joinpath("big.map").write_text(f"type octile\nheight 50\nwidth 50\nmap\n{cells}\n", encoding="utf-8")
    lines = [f"0\tbig.map\t50\t50\t0\t0\t{x}\t1\t3.0" for x in range(1, 41)]
    tmp_path.joinpath("big.scen").write_text("\n".join(["version 1", *lines]), encoding="utf-8")
    scenarios = list(open_scenarios(str(tmp_path / "big.scen")))
    Database.create(folder, Study(scenarios, [Entrant.parse("straight-line")])).close()
    assert rows(folder / FILE, "SELECT COUNT(*) FROM areas") == [(1,)]
    again = load(folder).scenarios
    assert [bits(one) for one in again] == [bits(one) for one in scenarios]
    assert len({id(one.problem.no_fly) for one in again}) == 1


def test_odd_names_are_kept_and_shown_as_text(folder: Path) -> None:
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
    shown = [name for (name,) in rows(folder / FILE, "SELECT name FROM experiments ORDER BY id")]
    assert shown == [*names[:4], r"caf\udce9", r"nul\x00", ""]
    with Database.resume(folder, study) as database:
        assert database.finished() == set(study.cells())


def test_what_is_not_of_the_study_is_refused(folder: Path) -> None:
    with Database.create(folder, STUDY) as database:
        database.add(RUNS[0])
        with pytest.raises(StudyError, match="has a run already") as error:
            database.add(RUNS[0])
        assert "'prm-a' on 'first' with seed 1" in one_line(error)
        for wrong in ({"seed": 9}, {"solver": "x"}, {"scenario": named("third")}):
            with pytest.raises(StudyError, match="is not part of the study"):
                database.add(dataclasses.replace(RUNS[0], **wrong))
        with pytest.raises(StudyError, match="no scenario 'third'"):
            database.add_certificate("third", Certificate(1, 1, 1, 1, 1, "", 0))
    assert len(load(folder).runs) == 1


def test_a_cell_is_never_in_it_twice_whoever_writes(folder: Path) -> None:
    """The table itself refuses, also where the seed is None."""
    write_study(folder, STUDY, first=4)
    (straight,) = [run for run in load(folder).runs if run.seed is None][:1]
    with closing(sqlite3.connect(folder / FILE)) as connection:
        (cell,) = connection.execute("SELECT cell FROM answers WHERE run = ?", (straight.number,)).fetchone()
        connection.execute("INSERT INTO runs (experimentid) VALUES (1)")
        with pytest.raises(sqlite3.IntegrityError, match=r"UNIQUE constraint failed: answers\.cell"):
            connection.execute("INSERT INTO answers VALUES (last_insert_rowid(), ?, 1, '{}', '', '')", (cell,))
        with pytest.raises(sqlite3.IntegrityError, match=r"UNIQUE constraint failed: cells\.scenario"):
            connection.execute("INSERT INTO cells SELECT 99, 99, scenario, contender, seed FROM cells LIMIT 1")


def test_a_study_that_names_something_twice_is_refused(folder: Path) -> None:
    for study, what in ((small_study(["a", "a"], ["x"]), "scenario"), (small_study(["a"], ["x", "x"]), "entrant")):
        with pytest.raises(StudyError, match=f"more than one {what} of the name"):
            Database.create(folder, study)
        assert names_in(folder) == set()


# Going on


def test_a_study_goes_on_and_grows(folder: Path) -> None:
    write_study(folder, STUDY, first=3)
    grown = small_study(["third", "second", "first"], ["straight", "prm-c", "prm-a"], seeds=(3, 1))
    with Database.resume(folder, grown, workers=4, command="again") as database:
        assert database.finished() == {cell_of(run) for run in RUNS[:3]}
        whole = database.study
        assert [one.name for one in whole.scenarios] == ["third", "second", "first"]
        assert [one.label for one in whole.entrants] == ["straight", "prm-c", "prm-a", "prm-b"]
        assert whole.seeds == (3, 1, 2)
        assert whole.title == "Any runs"
        assert database.certificates().keys() == {"first", "second"}
        for run in runs_of(whole):
            if cell_of(run) not in database.finished():
                database.add(run)
    kept = load(folder)
    assert [cell_of(run) for run in kept.runs] == list(whole.cells())
    assert kept.is_complete
    assert [session.command for session in kept.sessions] == ["cgla compare", "again"]
    assert list(load_study(folder).cells()) == list(whole.cells())


def test_a_complete_study_is_no_longer_so_when_it_grows(folder: Path) -> None:
    assert write_study(folder, STUDY).is_complete
    Database.resume(folder, dataclasses.replace(STUDY, seeds=(1, 2, 3))).close()
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
            Database.resume(folder, dataclasses.replace(STUDY, **change))
        one_line(error)
    assert bits(load(folder).sessions) == before
    # words about it may change
    titled = dataclasses.replace(named("first"), title="another title", notes="and notes")
    Database.resume(folder, dataclasses.replace(STUDY, scenarios=[titled])).close()


def test_a_solver_that_was_not_installed_and_is_now_is_planned_anew(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(Entrant, "is_available", property(lambda one: one.name != "prm-star"))
        assert write_study(folder, STUDY, first=1).n_cells == 6
        assert load(folder).runs[0].seed is None
    with Database.resume(folder, STUDY) as database:
        for run in RUNS:
            database.add(run)
    kept = load(folder)
    # the run without a seed stays, as it took place
    assert len(kept.runs) == kept.n_cells == len(RUNS) + 1


def test_a_second_writer_is_refused(folder: Path) -> None:
    with Database.create(folder, STUDY) as database:
        database.add(RUNS[0])
        for start in (Database.resume, Database.create):
            with pytest.raises(OutputError, match="another process writes this study; wait for it") as error:
                start(folder, STUDY)
            one_line(error)
        database.add(RUNS[1])
    with Database.resume(folder, STUDY) as database:
        assert len(database.finished()) == 2


def test_an_existing_study_is_kept_unless_it_shall_be_replaced(folder: Path) -> None:
    write_study(folder, STUDY)
    with pytest.raises(OutputError, match=r"--resume.*--overwrite.*--out") as error:
        Database.create(folder, STUDY)
    one_line(error)
    # a log that a killed process left would be taken for the new file's
    folder.joinpath(f"{FILE}-wal").write_bytes(b"old" * 1000)
    new = small_study(["new"], ["straight"])
    with Database.create(folder, new, overwrite=True) as database:
        assert database.finished() == set()
    assert [one.name for one in load(folder).scenarios] == ["new"]
    assert names_in(folder) == {FILE}


def test_a_failed_replacement_keeps_the_old_study(folder: Path) -> None:
    before = bits(write_study(folder, STUDY).runs)
    odd = dataclasses.replace(STUDY, entrants=[Entrant("odd", "odd", {"x": object()})])
    with pytest.raises(StudyError, match="odd"):
        Database.create(folder, odd, overwrite=True)
    assert bits(load(folder).runs) == before
    assert names_in(folder) == {FILE}


@pytest.mark.parametrize("content", [b"some text, " * 100, None])
def test_what_is_no_study_is_never_replaced(folder: Path, content: bytes | None) -> None:
    folder.mkdir()
    path = folder / FILE
    if content is None:
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("CREATE TABLE precious (x)")
    else:
        path.write_bytes(content)
    before = path.read_bytes()
    for start in (
        lambda: Database.create(folder, STUDY, overwrite=True),
        lambda: Database.create(folder, STUDY),
        lambda: Database.resume(folder, STUDY),
        lambda: load(folder),
        lambda: load_study(folder),
    ):
        with pytest.raises(CglaError, match=r"study\.db: ") as error:
            start()
        one_line(error)
    assert path.read_bytes() == before


# Killed, full, locked, damaged


WRITER = """
import sys
from pathlib import Path
from studies_small import runs_of, small_study
from cgla_graph.comparisons.study.database import FILE, Database
from cgla_graph.comparisons.study.study import Cell
folder, n_seeds = Path(sys.argv[1]), int(sys.argv[2])
study = small_study(["first"], ["prm"], seeds=range(n_seeds))
start = Database.resume if (folder / FILE).exists() else Database.create
with start(folder, study) as database:
    for run in runs_of(study):
        if Cell(run.scenario.name, run.solver, run.seed) not in database.finished():
            print(database.add(run).seed, flush=True)
"""


def write_in_another_process(folder: Path, n_seeds: int) -> "subprocess.Popen[str]":
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2] / "support")}
    words = [sys.executable, "-c", WRITER, str(folder), str(n_seeds)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_a_kill_loses_nothing_and_the_study_goes_on(folder: Path) -> None:
    n_seeds = 1500
    done: set[int] = set()
    for round_ in range(3):
        with write_in_another_process(folder, n_seeds) as writer:
            assert writer.stdout is not None
            for _ in range(random.randrange(1, 400)):  # noqa: S311 - any moment will do
                done.add(int(writer.stdout.readline()))
            if round_ == 0:
                with pytest.raises(OutputError, match="another process writes this study"):
                    Database.resume(folder, small_study(["first"], ["prm"]))
                # a reader is welcome meanwhile
                assert {run.seed for run in load(folder).runs} >= done
            writer.send_signal(signal.SIGKILL)
            done |= {int(line) for line in writer.stdout.read().split("\n")[:-1]}
        assert rows_of_a_copy(folder, "PRAGMA integrity_check") == [("ok",)]
        assert rows_of_a_copy(folder, "PRAGMA foreign_key_check") == []
        kept = {run.seed for run in load(folder).runs}
        # at most one was written and not told yet
        assert kept >= done
        assert len(kept - done) <= 1
        done = {seed for seed in kept if seed is not None}
    assert len(done) < n_seeds
    with write_in_another_process(folder, n_seeds) as writer:
        writer.communicate()
    resumed = load(folder)
    assert resumed.is_complete
    assert len(resumed.sessions) == 4
    study = small_study(["first"], ["prm"], seeds=range(n_seeds))
    assert [bits(run.solution) for run in resumed.runs] == [bits(run.solution) for run in runs_of(study)]
    assert names_in(folder) == {FILE}


def rows_of_a_copy(folder: Path, query: str) -> list[Any]:
    """Ask a copy, so that the file stays as the killed process left it."""
    with tempfile.TemporaryDirectory() as name:
        for path in folder.iterdir():
            shutil.copy(path, name)
        return rows(Path(name, FILE), query)


def remount(disk: Path, options: str) -> None:
    mount = shutil.which("mount") or "mount"
    subprocess.run([mount, "-o", f"remount,{options}", str(disk)], check=True, capture_output=True)


def wide(run: Run) -> Run:
    """Return a run with a path of 64 KiB."""
    return dataclasses.replace(run, solution=dataclasses.replace(run.solution, path=np.ones((4096, 2))))


def add_all(database: Database, runs: list[Run]) -> None:
    for run in runs:
        database.add(run)


def test_a_full_disk_keeps_what_was_written_and_goes_on(tiny_disk: Path) -> None:
    study = small_study(["first"], ["prm"], seeds=range(100))
    with pytest.raises(OutputError, match=r"study\.db: cannot be written: .*full") as error:
        Database.create(tiny_disk, study)
    one_line(error)
    assert names_in(tiny_disk) == set()
    remount(tiny_disk, "size=1m")
    runs = [wide(run) for run in runs_of(study)]
    with Database.create(tiny_disk, study) as database:
        with pytest.raises(OutputError, match=r"study\.db: cannot be written: .*full; what was done is kept") as error:
            add_all(database, runs)
        one_line(error)
        n_done = len(database.finished())
        assert 0 < n_done < len(runs)
        assert [bits(run.solution) for run in load(tiny_disk).runs] == [bits(run.solution) for run in runs[:n_done]]
        remount(tiny_disk, "size=4m")
        add_all(database, runs[n_done:20])
    # closing merges the log, for which there may be no room
    with Database.resume(tiny_disk, study) as database:
        assert len(database.finished()) == 20
        with pytest.raises(OutputError, match="full"):
            add_all(database, runs[20:])
        n_done = len(database.finished())
    assert len(load(tiny_disk).runs) == n_done
    remount(tiny_disk, "size=32m")
    with Database.resume(tiny_disk, study) as database:
        add_all(database, runs[n_done:])
    assert load(tiny_disk).is_complete
    assert names_in(tiny_disk) == {FILE}


@pytest.mark.parametrize("state", ["closed", "killed", "killed and copied", "closed with its log"])
def test_a_disk_that_cannot_be_written_is_read(tiny_disk: Path, tmp_path: Path, state: str) -> None:
    source = tmp_path / "source"
    before = [bits(run) for run in write_study(source, STUDY).runs]
    if state != "closed":
        with closing(sqlite3.connect(source / FILE, isolation_level=None)) as connection:
            connection.execute("PRAGMA journal_mode = WAL")
            connection.execute("DELETE FROM answers WHERE run = 2")
            (tmp_path / "copy").mkdir()
            for path in source.glob(f"{FILE}*"):
                if state == "killed" or path.suffix != ".db-shm":
                    shutil.copy(path, tmp_path / "copy")
        # those of this connection are merged and gone
        source = source if state == "closed with its log" else tmp_path / "copy"
        before = [one for number, one in enumerate(before, start=1) if number != 2]
    remount(tiny_disk, "size=4m")
    for path in source.iterdir():
        shutil.copy(path, tiny_disk)
    remount(tiny_disk, "ro")
    assert [bits(run) for run in load(tiny_disk).runs] == before
    for start in (Database.create, Database.resume):
        with pytest.raises(OutputError, match=r"cannot be written: .*choose another folder") as error:
            start(tiny_disk, STUDY)
        one_line(error)
    remount(tiny_disk, "rw")


def test_reading_leaves_nothing_behind(folder: Path) -> None:
    write_study(folder, STUDY)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    load(folder)
    load_study(folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_reading_leaves_what_a_killed_process_left_as_it_is(folder: Path, tmp_path: Path) -> None:
    killed = tmp_path / "killed"
    killed.mkdir()
    with Database.create(folder, STUDY) as database:
        database.add(RUNS[0])
        for path in folder.iterdir():
            shutil.copy(path, killed)
    before = {name: (killed / name).read_bytes() for name in (FILE, f"{FILE}-wal")}
    assert before[f"{FILE}-wal"]
    assert len(load(killed).runs) == 1
    assert {name: (killed / name).read_bytes() for name in before} == before


def test_a_reader_sees_what_is_committed_while_it_is_written(folder: Path) -> None:
    with Database.create(folder, STUDY) as database:
        assert load(folder).runs == []
        for n_done, run in enumerate(RUNS, start=1):
            database.add(run)
            database._connection.execute("BEGIN IMMEDIATE")
            assert len(load(folder).runs) == n_done
            database._connection.execute("ROLLBACK")
    assert names_in(folder) == {FILE}


def test_a_reader_of_one_moment_sees_nothing_of_later_ones(folder: Path) -> None:
    with Database.create(folder, STUDY) as database:
        database.add(RUNS[0])
        with stored.reading(folder / FILE) as connection:
            assert connection.execute("SELECT COUNT(*) FROM answers").fetchone() == (1,)
            database.add(RUNS[1])
            assert connection.execute("SELECT COUNT(*) FROM answers").fetchone() == (1,)


def test_a_reader_at_the_end_does_not_stop_the_writer_from_ending(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stored, "PATIENCE", 0.05)
    database = Database.create(folder, STUDY)
    database.add(RUNS[0])
    with stored.reading(folder / FILE) as connection:
        connection.execute("SELECT * FROM answers").fetchone()
        database.close()
    assert len(load(folder).runs) == 1
    with Database.resume(folder, STUDY) as database:
        assert len(database.finished()) == 1
    assert names_in(folder) == {FILE}


def test_a_locked_database_is_one_line(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stored, "PATIENCE", 0.05)
    write_study(folder, STUDY, first=1)
    with closing(sqlite3.connect(folder / FILE, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        for start in (lambda: load(folder), lambda: Database.resume(folder, STUDY)):
            with pytest.raises(StudyError, match="another program has locked it: close that") as error:
                start()
            one_line(error)
    with (
        Database.resume(folder, STUDY) as database,
        closing(sqlite3.connect(folder / FILE, isolation_level=None)) as other,
    ):
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(OutputError, match="another program has locked it: close that, and go on") as error:
            database.add(RUNS[1])
        one_line(error)
        other.execute("ROLLBACK")
        database.add(RUNS[1])
    assert len(load(folder).runs) == 2


@pytest.mark.parametrize("part", [0.02, 0.1, 0.5, 0.9, 0.999])
def test_a_file_that_was_cut_is_refused_and_left_alone(folder: Path, part: float) -> None:
    write_study(folder, STUDY)
    path = folder / FILE
    data = path.read_bytes()[: int(part * path.stat().st_size)]
    path.write_bytes(data)
    for start in (lambda: load(folder), lambda: load_study(folder), lambda: Database.resume(folder, STUDY)):
        with pytest.raises(StudyError, match="damaged") as error:
            start()
        one_line(error)
    assert path.read_bytes() == data


@pytest.fixture(scope="module")
def intact(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("intact")
    write_study(folder, STUDY)
    return folder / FILE


@few
@given(st.lists(st.tuples(st.integers(0, 2**20), st.integers(0, 255)), min_size=1, max_size=30))
def test_whatever_bytes_rot_there_is_an_answer_or_one_line(intact: Path, rot: list[tuple[int, int]]) -> None:
    rotten = bytearray(intact.read_bytes())
    for at, byte in rot:
        rotten[at % len(rotten)] = byte
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / FILE).write_bytes(rotten)
        for start in (load, lambda folder: Database.resume(folder, STUDY).close()):
            try:
                start(folder)
            except CglaError as error:
                assert "\n" not in str(error)  # noqa: PT017 - many a rotten byte matters to nobody


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE answers SET document = '{' || document",
        "UPDATE answers SET document = '[]'",
        "UPDATE answers SET document = json_set(document, '$.status', 'BEST')",
        "UPDATE answers SET path = x'00'",
        "UPDATE answers SET trace = x'00'",
        "UPDATE answers SET document = x'ff'",
        "UPDATE cells SET seed = 'no ' || id",
        "UPDATE scenarios SET document = json_remove(document, '$.problem')",
        "UPDATE contenders SET document = 'null'",
        "UPDATE sessions SET packages = ''",
        "DELETE FROM study WHERE key = 'seconds'",
        "UPDATE scenarios SET certificate = '{}'",
        "DROP TABLE cells",
    ],
)
def test_content_that_makes_no_sense_is_one_line(folder: Path, change: str) -> None:
    write_study(folder, STUDY)
    with closing(sqlite3.connect(folder / FILE, isolation_level=None)) as connection:
        connection.execute(change)
    with pytest.raises(StudyError, match=r"damaged|malformed") as error:
        load(folder)
    one_line(error)


def test_where_there_is_no_study(folder: Path) -> None:
    for start in (lambda: load(folder), lambda: load_study(folder), lambda: Database.resume(folder, STUDY)):
        with pytest.raises(StudyError, match=r"study\.db: there is no such file; give the folder of a study") as error:
            start()
        one_line(error)
    assert not folder.exists()
    folder.write_text("a file", encoding="utf-8")
    with pytest.raises(StudyError, match="no such file"):
        load(folder)
    with pytest.raises(OutputError):
        Database.create(folder, STUDY)


# Versions


def test_a_change_of_the_tables_needs_a_new_version() -> None:
    """Whoever changes them counts `VERSION` up and writes the migration; then this sum is renewed."""
    digest = hashlib.sha256(" ".join(schema.TABLES.split()).encode()).hexdigest()[:16]
    assert (schema.VERSION, digest) == (1, "77ea85b86fa6376d")


def test_a_newer_file_is_refused_and_left_alone(folder: Path) -> None:
    write_study(folder, STUDY)
    with closing(sqlite3.connect(folder / FILE)) as connection:
        connection.execute(f"PRAGMA user_version = {schema.VERSION + 1}")
    before = (folder / FILE).read_bytes()
    for start in (lambda: load(folder), lambda: load_study(folder), lambda: Database.resume(folder, STUDY)):
        with pytest.raises(StudyError, match=r"written by a newer cgla-graph \(tables 2, known 1\); update") as error:
            start()
        one_line(error)
    assert (folder / FILE).read_bytes() == before


@pytest.fixture
def of_old(folder: Path) -> list[Any]:
    """Make a database of version 0, where answers were called otherwise, and return its runs."""
    runs = [bits(run) for run in write_study(folder, STUDY, first=4).runs]
    with closing(sqlite3.connect(folder / FILE)) as connection:
        connection.execute("ALTER TABLE answers RENAME COLUMN document TO words")
        connection.execute("PRAGMA user_version = 0")
    return runs


def renamed(connection: sqlite3.Connection) -> None:
    connection.execute("ALTER TABLE answers RENAME COLUMN words TO document")


def failing(connection: sqlite3.Connection) -> None:
    renamed(connection)
    msg = "half-way"
    raise sqlite3.OperationalError(msg)


def test_an_older_file_without_a_way_is_refused_and_left_alone(folder: Path, of_old: list[Any]) -> None:
    before = (folder / FILE).read_bytes()
    for start in (lambda: load(folder), lambda: load_study(folder), lambda: Database.resume(folder, STUDY)):
        with pytest.raises(StudyError, match="its tables are of version 0") as error:
            start()
        one_line(error)
    assert (folder / FILE).read_bytes() == before
    assert names_in(folder) == {FILE}


def test_an_older_file_is_read_as_it_is_and_migrated_after_a_copy(
    folder: Path, of_old: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(schema.MIGRATIONS, 0, renamed)
    before = (folder / FILE).read_bytes()
    assert [bits(run) for run in load(folder).runs] == of_old
    assert (folder / FILE).read_bytes() == before
    with Database.resume(folder, STUDY) as database:
        assert len(database.finished()) == 4
        database.add(RUNS[4])
    assert [bits(run) for run in load(folder).runs[:4]] == of_old
    assert rows(folder / FILE, "PRAGMA user_version") == [(schema.VERSION,)]
    assert names_in(folder) == {FILE, f"{FILE}.v0"}
    copy = folder / f"{FILE}.v0"
    assert rows(copy, "PRAGMA user_version") == [(0,)]
    assert len(rows(copy, "SELECT words FROM answers")) == 4


def test_a_migration_that_fails_leaves_the_file_alone(
    folder: Path, of_old: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(schema.MIGRATIONS, 0, renamed)
    with monkeypatch.context() as patch, pytest.raises(OutputError, match="half-way"):  # noqa: PT012 - as it is written
        path, connection = folder / FILE, sqlite3.connect(folder / FILE, isolation_level=None)
        patch.setitem(schema.MIGRATIONS, 0, failing)
        with closing(connection), database_module._writing(path):
            schema.migrate_file(connection, path)
    assert len(rows(folder / FILE, "SELECT words FROM answers")) == 4
    # the copy that was made is not overwritten
    with pytest.raises(OutputError, match=r"study\.db\.v0: is there already") as error:
        Database.resume(folder, STUDY)
    one_line(error)
    (folder / f"{FILE}.v0").unlink()
    Database.resume(folder, STUDY).close()
    assert [bits(run) for run in load(folder).runs] == of_old


# Others open it


BASE = {
    "experiments": "id name totaltime timelimit memorylimit runcount version hostname cpuinfo date seed setup",
    "plannerConfigs": "id name settings",
    "enums": "name value description",
    "runs": "id experimentid plannerid",
    "progress": "runid time",
}


def test_the_five_tables_begin_as_those_of_ompl(folder: Path) -> None:
    write_study(folder, STUDY)
    for table, columns in BASE.items():
        there = [name for _, name, *_ in rows(folder / FILE, f"PRAGMA table_info({table})")]
        assert there[: len(columns.split())] == columns.split()
        if table not in {"runs", "progress"}:
            # OMPL's script inserts without naming columns, and Planner Arena draws no progress where there are more
            assert len(there) == len(columns.split())


def test_what_others_plot(folder: Path) -> None:
    nan, inf = math.nan, math.inf
    trace = (
        TracePoint(0.0, 1, inf), TracePoint(0.25, 2, 9.0), TracePoint(0.25, 3, 8.0), TracePoint(0.5, 5, 7.0),
        TracePoint(nan, 5, 6.5), TracePoint(0.75, 6, 7.5),
    )  # fmt: skip
    path = np.array([(0.1, 0.1), (0.2, 0.2), (0.9, 0.9)])
    good = Solution(
        Status.FOUND, path=path, cost=6.0, length=5.0, risk=0.5, clearance=inf, lower_bound=4.0, seconds=1.0,
        build_seconds=0.5, evaluations=10, trace=trace,
    )  # fmt: skip
    bad = dataclasses.replace(good, status=Status.INFEASIBLE, lower_bound=nan, seconds=nan)
    with Database.create(folder, STUDY) as database:
        database.add(dataclasses.replace(RUNS[0], solution=good, megabytes=12.5))
        database.add(dataclasses.replace(RUNS[2], solution=bad))
        database.add(dataclasses.replace(RUNS[3], solution=Solution(Status.TIMED_OUT, seconds=600.0), megabytes=nan))
    plotted = rows(
        folder / FILE,
        "SELECT name, runs.time, memory, description, solved, correct_solution, solution_length, best_cost, risk, "
        "clearance, lower_bound, gap, seconds, build_seconds, evaluations, waypoints, seed FROM runs "
        "JOIN plannerConfigs ON plannerConfigs.id = plannerid "
        "JOIN (SELECT value, description FROM enums WHERE name = 'status') ON value = status ORDER BY runs.id",
    )
    assert plotted == [
        ("prm-a", 1.5, 12.5, "found", 1, 1, 5.0, 6.0, 0.5, None, 4.0, 0.5, 1.0, 0.5, 10, 3, 1),
        ("straight", None, 1.5, "infeasible", 0, 0, *[None] * 6, None, 0.5, 10, 0, None),
        ("prm-b", 600.0, None, "timed-out", 0, 0, *[None] * 6, 600.0, 0.0, 0, 0, 1),
    ]
    # building counts, a moment has one row, costs do not rise, and the end is there
    expected = [(1, 0.75, 8.0, 3), (1, 1.0, 7.0, 5), (1, 1.25, 7.0, 6), (1, 1.5, 6.0, 10)]
    assert rows(folder / FILE, "SELECT runid, time, best_cost, evaluations FROM progress ORDER BY 1, 2") == expected
    ((total, limit, memory, count, version, seed),) = rows(
        folder / FILE,
        "SELECT totaltime, timelimit, memorylimit, runcount, version, seed FROM experiments WHERE name = 'first'",
    )
    assert (total, limit, memory, count, seed) == (601.5, 600.0, 4096.0, 1, "1, 2")
    assert version == provenance().label


def test_every_status_has_a_number_of_its_own_apart_from_those_of_ompl() -> None:
    assert set(schema.STATUS) == set(Status)
    numbers = [*schema.STATUS.values(), *range(len(schema.OMPL_STATUS))]
    assert len(set(numbers)) == len(numbers)


def test_runs_of_another_version_are_an_experiment_of_their_own(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that Planner Arena compares versions, in the order of their commits."""
    here = provenance()
    runs = iter(RUNS)
    for count, start in ((9, Database.create), (10, Database.resume), (9, Database.resume)):
        origin = dataclasses.replace(here, revision=Revision(f"{count:02}" * 20, count, dirty=False))
        monkeypatch.setattr(database_module, "provenance", lambda origin=origin: origin)
        with start(folder, STUDY) as database:
            database.add(next(runs))
            database.add(next(runs))
    versions = rows(
        folder / FILE,
        "SELECT experiments.name, version, COUNT(*), runcount FROM experiments "
        "JOIN runs ON experimentid = experiments.id GROUP BY experiments.id ORDER BY experiments.id",
    )
    nine, ten = (f"CGLA-Graph {here.version}+{count}.g{f'{count:02}' * 4}{0 if count == 9 else 1}" for count in (9, 10))
    assert versions == [("first", nine, 3, 2), ("second", nine, 1, 1), ("first", ten, 2, 1)]
    assert planner_arena(folder / FILE)["versions"] == [nine, ten]
    assert [run.number for run in load(folder).runs] == [1, 2, 3, 4, 5, 6]


def planner_arena(path: Path) -> dict[str, Any]:
    """Demand what Planner Arena's loader and plots do (plannerarena 1.0, database.py, performance.py, progress.py)."""
    with closing(sqlite3.connect(path)) as connection:
        tables = {}
        for table in BASE:
            cursor = connection.execute(f"SELECT * FROM {table}")  # noqa: S608 - names of this file
            tables[table] = ([column[0].replace("_", " ") for column in cursor.description], cursor.fetchall())
    heads, experiments = tables["experiments"]
    # each column is of one kind, or its table cannot be made; runs and progress are numbers to plot
    for table, (columns, content) in tables.items():
        for at, column in enumerate(columns):
            kinds = {type(row[at]) for row in content} - {type(None)}
            assert len(kinds) <= 1, (table, column)
            if table in {"runs", "progress"}:
                assert kinds <= {int, float}, (table, column)
    parameters = heads[12:]
    # problem_parameter_filter asks progress for each of them, which has none
    assert parameters == []
    versions = {row[heads.index("version")] for row in experiments}
    assert None not in versions

    def version_key(version: str) -> tuple[object, ...]:
        import re  # noqa: PLC0415 - as there

        return tuple(int(part) if part.isdigit() else part for part in re.split(r"(\d+)", version))

    enums = {(name, value): description for name, value, description in tables["enums"][1]}
    run_heads, runs = tables["runs"]
    statuses = [enums["status", row[run_heads.index("status")]] for row in runs if row[3] is not None]
    planners = {key: name for key, name, _ in tables["plannerConfigs"][1]}
    assert all(row[1] in {one[0] for one in experiments} and row[2] in planners for row in runs)
    numbers = {row[0] for row in runs}
    assert all(row[0] in numbers and row[1] is not None for row in tables["progress"][1])
    return {
        "versions": sorted(versions, key=version_key),
        "attributes": run_heads[3:],
        "progress": tables["progress"][0][2:],
        "statuses": statuses,
    }


def test_planner_arena_takes_it(folder: Path) -> None:
    def answers(scenario: str, solver: int, seed: int | None) -> Solution:
        del scenario
        trace = tuple(TracePoint(0.1 * step, step, 5.0 - step) for step in range(3))
        return dataclasses.replace(found(2.0 + solver), trace=trace if seed else (), lower_bound=math.nan)

    write_study(folder, STUDY, answers)
    seen = planner_arena(folder / FILE)
    assert {"time", "memory", "status", "solved", "correct solution", "solution length", "best cost"} <= {
        *seen["attributes"]
    }
    assert seen["progress"] == ["best cost", "evaluations"]
    assert set(seen["statuses"]) == {"found"}
    with closing(sqlite3.connect(folder / FILE)) as connection:
        connection.execute("ALTER TABLE experiments ADD k REAL")
    with pytest.raises(AssertionError):
        planner_arena(folder / FILE)


OMPL_LOG = """
import sys
from ompl import base, geometric, tools
space = base.RealVectorStateSpace(2)
bounds = base.RealVectorBounds(2)
bounds.setLow(0)
bounds.setHigh(1)
space.setBounds(bounds)
setup = geometric.SimpleSetup(space)
setup.setStateValidityChecker(lambda state: True)
start, goal = space.allocState(), space.allocState()
start[0] = start[1] = 0.1
goal[0] = goal[1] = 0.9
setup.setStartAndGoalStates(start, goal)
benchmark = tools.Benchmark(setup, "theirs")
benchmark.addPlanner(geometric.RRTstar(setup.getSpaceInformation()))
request = tools.Request()
request.maxTime, request.maxMem, request.runCount, request.timeBetweenUpdates = 0.1, 1000.0, 2, 0.02
request.displayProgress = False
benchmark.benchmark(request)
benchmark.saveResultsToFile(sys.argv[1])
"""

OMPL_SCRIPT = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("script", sys.argv[1])
script = importlib.util.module_from_spec(spec)
spec.loader.exec_module(script)
script.readBenchmarkLog(sys.argv[2], [sys.argv[3]], False)
script.computeViews(sys.argv[2], False)
script.saveAsMysql(sys.argv[2])
"""


@pytest.mark.ompl
@pytest.mark.skipif(OMPL is None, reason="OMPL is not installed")
def test_ompls_own_script_works_on_it_and_ours_goes_on(folder: Path, tmp_path: Path) -> None:
    assert OMPL is not None
    assert OMPL.origin is not None
    runs = [bits(run) for run in write_study(folder, STUDY, first=6).runs]
    path, log = folder / FILE, tmp_path / "their.log"
    script = Path(OMPL.origin).parent / "_benchmark_statistics.py"
    for words in ([OMPL_LOG, log], [OMPL_SCRIPT, script, path, log]):
        program = [sys.executable, "-c", *map(str, words)]
        # OMPL leaves a log where it runs
        done = subprocess.run(program, capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    # theirs is beside ours, and means what it meant
    mixed = rows(
        path,
        "SELECT experiments.name, enums.description, COUNT(*) FROM runs "
        "JOIN experiments ON experiments.id = experimentid "
        "JOIN enums ON enums.name = 'status' AND value = status GROUP BY 1, 2 ORDER BY 1",
    )
    assert mixed == [("first", "found", 5), ("second", "found", 1), ("theirs", "Exact solution", 2)]
    best = rows(path, "SELECT plannerid, avg_solved FROM bestPlannerConfigsPerExperiment")
    assert (1, 1.0) in best
    dump = path.with_suffix(".mysql").read_text(encoding="utf-8")
    assert dump.count("INSERT INTO runs") == 8
    # and ours is as it was
    assert [bits(run) for run in load(folder).runs] == runs
    with Database.resume(folder, STUDY) as database:
        assert len(database.finished()) == 6
        number = database.add(RUNS[6]).number
    assert number == 9
    assert len(load(folder).runs) == 7


@pytest.mark.ompl
@pytest.mark.skipif(OMPL is None, reason="OMPL is not installed")
def test_the_numbers_of_ompls_outcomes_are_its_own() -> None:
    from ompl import base  # noqa: PLC0415 - where it is installed

    names = ["UNKNOWN", "INVALID_START", "INVALID_GOAL", "UNRECOGNIZED_GOAL_TYPE", "TIMEOUT", "APPROXIMATE_SOLUTION"]
    names += ["EXACT_SOLUTION", "CRASH", "ABORT", "INFEASIBLE"]
    values = [getattr(base.PlannerStatus, name) for name in names]
    assert [int(getattr(value, "value", value)) for value in values] == list(range(len(schema.OMPL_STATUS)))
    for value, description in zip(values, schema.OMPL_STATUS, strict=True):
        # OMPL 2.0 has no words for the last two
        assert base.PlannerStatus(value).asString() in {description, "Unknown status"}


def test_settings_of_a_shipped_scenario_survive(folder: Path) -> None:
    paper = load_scenario("paper")
    study = Study([paper], [Entrant.parse("cgla").with_budget({"seconds": 0.5}).refined()])
    (run,) = runs_of(study)
    run = dataclasses.replace(run, settings={"resolution": paper.lattice, "pair": (1, None), "far": math.inf})
    with Database.create(folder, study) as database:
        database.add(run)
    (again,) = load(folder).runs
    assert bits(again.settings) == bits(run.settings)
    assert load_study(folder).entrants == study.entrants

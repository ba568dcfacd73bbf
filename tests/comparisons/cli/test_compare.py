"""`cgla compare` with study files and `--resume`, and `cgla results`."""

import json
import tomllib
from pathlib import Path

import plug_ins
import pytest
from command_line import Call

from cgla_graph.comparisons.results import study_output
from cgla_graph.comparisons.results.study_run import Settings, read_request
from cgla_graph.comparisons.study.store import load
from cgla_graph.comparisons.study.study_file import study_from_toml

STUDY = """title = "two maps"
scenarios = ["one-threat", {{ generate = "random", seeds = [3], resolution = 8 }}]
solvers = ["cgla", "straight-line", {{ name = "prm-star", label = "few", milestones = 40 }}]
seeds = {seeds}
tolerance = 0.1
"""


FILES = {"study.toml": STUDY.format(seeds=2)}


def cells(folder: str) -> list[tuple[str, str, int | None]]:
    return [(run.scenario.name, run.solver, run.seed) for run in load(Path(folder)).runs]


@pytest.mark.slow
def test_a_study_from_a_file(cgla: Call) -> None:
    answer = cgla("compare", "study.toml", "--out", "out", "--workers", 2)
    assert answer.code == 0
    assert answer.out.count("leaderboard") == 1
    assert "how soon" not in answer.out, "tables of each scenario are for `cgla results`"
    names = ["one-threat", "random-10-threats-3"]
    solvers = [("cgla", None), ("straight-line", None), ("few", 1), ("few", 2)]
    assert cells("out") == [(name, *one) for name in names for one in solvers]
    stored = load(Path("out"))
    assert (stored.title, stored.is_complete, stored.sessions[0].workers) == ("two maps", True, "2")
    assert stored.sessions[0].command == "cgla compare study.toml --out out --workers 2"
    assert not list(Path("out").glob("*.png"))


def test_resuming_makes_only_missing_runs(cgla: Call) -> None:
    cgla("compare", "study.toml", "--out", "out")
    before = {run.number: run.solution.seconds for run in load(Path("out")).runs}
    for words in (["study.toml"], []):
        assert cgla("compare", *words, "--resume", "--out", "out").code == 0
        assert {run.number: run.solution.seconds for run in load(Path("out")).runs} == before
    Path("study.toml").write_text(STUDY.format(seeds=4), encoding="utf-8")
    assert cgla("compare", "study.toml", "--resume", "--out", "out").code == 0
    after = {run.number: run.solution.seconds for run in load(Path("out")).runs}
    assert before.items() <= after.items()
    assert len(after) - len(before) == 2 * 2
    assert [seed for name, solver, seed in cells("out") if (name, solver) == ("one-threat", "few")] == [1, 2, 3, 4]


def test_resuming_another_study_is_refused(cgla: Call) -> None:
    cgla("compare", "study.toml", "--out", "out")
    text = STUDY.format(seeds=2)
    Path("study.toml").write_text(text.replace("milestones = 40", "milestones = 50"), encoding="utf-8")
    cgla("compare", "study.toml", "--resume", "--out", "out").refused("few", "settings differ", "another name")
    assert len(load(Path("out")).scenarios) == 2
    # another k has another name: it joins the study
    Path("study.toml").write_text(text.replace("seeds = [3],", "seeds = [3], k = 3.0,"), encoding="utf-8")
    assert cgla("compare", "study.toml", "--resume", "--out", "out").code == 0
    assert len(load(Path("out")).scenarios) == 3


def test_a_plain_comparison_is_a_study_too(cgla: Call) -> None:
    words = ("compare", "one-threat", "--solvers", "cgla,straight-line", "--no-certificate", "--out", "out")
    assert "how soon" not in cgla(*words, "--pictures", 0).out
    cgla(*words).refused("--resume", "--overwrite")
    more = ("compare", "one-threat", "paper", "--solvers", "cgla,straight-line", "--no-certificate", "--out", "out")
    assert cgla(*more, "--resume", "--pictures", 0).code == 0
    assert [name for name, *_ in cells("out")] == ["one-threat"] * 2 + ["paper"] * 2
    assert cgla("compare", "--resume", "--out", "out").code == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--resume"], ["--resume", "--out DIR"]),
        (["--overwrite"], ["--overwrite", "--out DIR"]),
        (["--resume", "--overwrite", "--out", "out"], ["--resume", "--overwrite", "one of them"]),
        (["--resume", "--out", "nothing"], ["nothing", "study.jsonl"]),
        (["one-threat", "--resume", "--out", "nothing"], ["nothing"]),
        (["study.toml", "paper"], ["study.toml", "paper", "among its scenarios"]),
        (["paper", "study.toml"], ["study.toml", "paper", "among its scenarios"]),
        (["study.toml", "--seeds", "3"], ["--seeds", "study.toml"]),
        (["study.toml", "--solvers", "cgla"], ["--solvers", "study.toml"]),
        (["study.toml", "--budget", "seconds=1"], ["--budget", "study.toml"]),
        (["study.toml", "--no-certificate"], ["--no-certificate", "study.toml"]),
        (["study.toml", "--limits", "seconds=1"], ["--limits", "study.toml"]),
        (["study.toml", "--refine"], ["--refine", "study.toml"]),
        (["study.toml", "--tolerance", "0"], ["--tolerance", "study.toml"]),
        (["study.toml", "--start", "0,0"], ["--start", "study.toml"]),
        (["paper", "--limits", "seconds=0"], ["--limits", "seconds=0", "above 0"]),
        (["paper", "--limits", "memory=many"], ["--limits", "memory=many"]),
        (["paper", "--limits", "minutes=1"], ["--limits", "minutes=1", "seconds=S"]),
        (["paper", "--limits", "seconds=1,seconds=2"], ["--limits", "once"]),
        (["paper", "--workers", "-1"], ["--workers"]),
        (["paper", "--dask", "127.0.0.1:9"], ["127.0.0.1:9"]),
    ],
)
def test_contradicting_options_are_refused(cgla: Call, words: list[str], said: list[str]) -> None:
    cgla("compare", *words).refused(*said)
    assert not Path("out").exists()
    assert not Path("nothing").exists()


def test_the_example_is_a_study_and_the_schema_knows_its_keys(cgla: Call) -> None:
    text = cgla("compare", "--example").out
    assert len(list(study_from_toml(text).cells())) > 50
    assert tomllib.loads(text).keys() <= cgla("compare", "--schema").document()["properties"].keys()


@pytest.mark.slow
def test_looking_up(cgla: Call) -> None:
    cgla("compare", "study.toml", "--out", "out")
    text = cgla("results", "out").out
    assert text.startswith("two maps: 8 of 8 runs, complete")
    assert "Who wins?" in text
    document = cgla("results", "out", "--solver", "few", "--runs", "--json").document()
    assert [row["seed"] for row in document["rows"]] == [1, 2, 1, 2]
    again = cgla("results", "out", "--rerun", 3, "--json")
    assert again.code == 0
    assert json.loads(again.out)["identical"] is True
    assert cgla("results", "out", "--export", "table.csv", "--export", "table.tex").code == 0
    assert Path("table.csv").read_text(encoding="utf-8").count("\n") == 9
    cgla("results", "nowhere").refused("nowhere")
    cgla("results", "out", "--solver", "fow").refused("fow", "few")
    cgla("results", "out", "--rerun", 99).refused("99")


def test_a_study_of_one_map_has_its_tables(cgla: Call) -> None:
    Path("one.toml").write_text('scenarios = ["one-threat"]\nsolvers = ["cgla", "straight-line"]\n', encoding="utf-8")
    text = cgla("compare", "one.toml").out
    assert "one-threat: " in text
    assert "│ straight-line " in text


def test_resuming_a_part_names_the_rest(cgla: Call) -> None:
    words = ("compare", "--solvers", "cgla,straight-line", "--no-certificate", "--out", "out", "--pictures", 0)
    cgla(words[0], "one-threat", "paper", *words[1:])
    part = ("compare", "one-threat", "--solvers", "dijkstra", "--no-certificate", "--out", "out", "--pictures", 0)
    answer = cgla(*part, "--resume")
    assert answer.code == 0
    assert "1 run is left of the study in out: cgla compare --resume --out out goes on" in answer.err
    assert cgla("compare", "--resume", "--out", "out").err == ""
    assert load(Path("out")).is_complete


def test_a_solver_that_was_not_installed_is_tried_again(
    cgla: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plug_ins.install(tmp_path, monkeypatch)
    words = ("compare", "one-threat", "--solvers", "honest,needs", "--no-certificate", "--out", "out", "--pictures", 0)
    cgla(*words, "--seeds", 2)
    assert [run.solution.status.label for run in load(Path("out")).runs] == ["found", "unavailable"]
    (tmp_path / "site" / "a_package_that_is_missing.py").touch()
    assert cgla("compare", "--resume", "--out", "out").code == 0
    assert cells("out") == [("one-threat", "honest", None), ("one-threat", "needs", 1), ("one-threat", "needs", 2)]
    assert {run.solution.status.label for run in load(Path("out")).runs} == {"found"}


def test_runs_that_the_environment_stops_are_an_error_and_are_resumed(
    cgla: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plug_ins.install(tmp_path, monkeypatch)
    file = tmp_path / "file"
    words = ("compare", "one-threat", "--no-certificate", "--out", "out")
    solver = f"lacks:note={f'ModuleNotFoundError(3)@{file}'!r}"
    answer = cgla(*words, "--solvers", f"{solver},straight-line")
    assert answer.code == 1
    assert "1 task could not be made, one-threat" in answer.err
    assert "ModuleNotFoundError: 3" in answer.err
    assert "straight-line" in answer.out
    assert cells("out") == [("one-threat", "straight-line", None)]
    file.touch()
    assert cgla("compare", "--resume", "--out", "out").code == 0
    assert load(Path("out")).is_complete
    # where nothing else is made, there is nothing to show
    assert cgla(*words, "--overwrite", "--solvers", f"lacks:note={'OSError(28)'!r}").code == 2


def test_a_message_cannot_steer_the_terminal(cgla: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plug_ins.install(tmp_path, monkeypatch)
    for words in (("compare", "--solvers", "steers,cgla"), ("plan", "--solver", "steers")):
        text = cgla(words[0], "one-threat", *words[1:], "--no-certificate").out
        assert "\x1b" not in text
        assert "\\x1b[2J" in text


@pytest.mark.slow
def test_without_a_path_no_solver_wins(cgla: Call) -> None:
    words = ("compare", "one-threat", "paper", "--solvers", "cgla,dijkstra", "--limits", "seconds=1e-6")
    text = cgla(*words, "--no-certificate", "--workers", 1).out
    assert "None of 2 solvers found a path on 2 scenarios." in text
    assert "Who wins?" not in text
    tie = cgla("compare", "one-threat", "paper", "--solvers", "cgla,dijkstra", "--no-certificate").out
    assert "Who wins? cgla and dijkstra" in tie


def test_solvers_are_highlighted_by_label_or_name(cgla: Call) -> None:
    del cgla
    labels = ["cgla", "prm-star:milestones=20", "prm-star:milestones=30"]
    asked = read_request(
        Settings(specs=["one-threat"], solvers=f"straight-line,{','.join(labels)}", highlight="prm-star,cgla")
    )
    assert asked.highlighted == set(labels)
    assert read_request(Settings(specs=["study.toml"], highlight="few,cgla")).highlighted == {"few", "cgla"}
    assert read_request(Settings(specs=["study.toml"])).highlighted == set()


def test_highlighted_solvers_stand_out_in_pictures(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = []
    monkeypatch.setattr(study_output, "write_study", lambda _: [])
    monkeypatch.setattr(study_output, "write_all_pictures", lambda *words: drawn.append(words[2:]) or [])
    words = ["one-threat", "--solvers", "straight-line", "--no-certificate", "--highlight", "straight-line"]
    assert cgla("compare", *words, "--out", "out").code == 0
    assert drawn == [(20, {"straight-line"})]


def test_highlighting_a_solver_that_does_not_run_is_refused(cgla: Call) -> None:
    words = ["compare", "one-threat", "--solvers", "cgla,straight-line", "--highlight", "cgla,dijkstra"]
    cgla(*words).refused("--highlight has 'dijkstra'", "not compared", "cgla, straight-line")

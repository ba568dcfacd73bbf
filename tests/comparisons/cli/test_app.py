"""The command line: output, files, exit codes, and answers to wrong input."""

import csv
import importlib.util
import io
import json
import math
import os
import signal
import statistics
import subprocess
import sys
import time
import tomllib
import types
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, ClassVar
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import shapely
from command_line import Call, caller, without_compiling
from map_files import AREAS, name_of
from programs import program

from cgla_graph.comparisons.cli.commands import COMMANDS
from cgla_graph.comparisons.study import options
from cgla_graph.comparisons.study.rows import COLUMNS
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.store import load
from cgla_graph.errors import CglaError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.scenarios.geojson import read_areas
from cgla_graph.scenarios.scenario import load_scenario, schema, shipped
from cgla_graph.scenarios.shipped import shipped_scenario
from cgla_graph.solvers import listing, registry

ENDS = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\n"
SMALL = f"{ENDS}k = 5.0\nthreats = [{{ x = 0.5, y = 0.5, spread = 0.1 }}]\n[lattice]\nresolution = 4\n"
WALL = "[no_fly]\npolygons = [[[0.45, -0.1], [0.55, -0.1], [0.55, 0.8], [0.45, 0.8]]]\n"
SHUT = WALL.replace("0.8", "1.1")
#: Files that every comparison leaves in its folder.
STUDY_FILES = {"study.jsonl", "study.jsonl.lock", "study.db", "report.html", "rows.jsonl", "rows.csv", "summary.csv"}
PROGRAM = [sys.executable, "-m", "cgla_graph.comparisons"]


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """Call the command line in a folder of its own, in this process."""
    # a coarse lower bound is proven at once
    monkeypatch.setattr(options, "TOLERANCE", 0.1)
    return caller(tmp_path, monkeypatch, capfd)


@pytest.fixture
def small(tmp_path: Path) -> Path:
    file = tmp_path / "small.toml"
    file.write_text(SMALL, encoding="utf-8")
    return file


@pytest.fixture
def enter(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[Problem], Any]], str]:
    """Enter a function as a solver into the registry."""

    def put(solve: Callable[[Problem], Any]) -> str:
        class Own:
            traits: ClassVar[Traits] = Traits("own", "a test's own", domain="plane")

            def solve(self, problem: Problem) -> Any:  # noqa: ANN401 - any value of a test
                return solve(problem)

        Own.__dataclass_fields__ = {}  # type: ignore[attr-defined]
        shelf = types.SimpleNamespace(Own=Own)
        monkeypatch.setitem(sys.modules, "shelf_of_a_test", shelf)  # type: ignore[arg-type]
        monkeypatch.setattr(registry, "_BUILT_IN", {**registry._BUILT_IN, "own": "shelf_of_a_test:Own"})
        return "own"

    return put


@pytest.fixture
def pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace pictures by empty files; their content is tested elsewhere."""
    from cgla_graph.comparisons.plots import cost, runs  # noqa: PLC0415 - heavy
    from cgla_graph.plots import pictures  # noqa: PLC0415 - heavy

    monkeypatch.setattr(runs, "map_of_runs", lambda *_: object())
    monkeypatch.setattr(cost, "trace_figure", lambda *_: object())
    monkeypatch.setattr(pictures, "save", lambda _, path: path.touch())


def straight(problem: Problem) -> Solution:
    path = np.array([problem.start, problem.goal])
    return Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost)


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def process(*words: object, **more: Any) -> subprocess.CompletedProcess[str]:  # noqa: ANN401 - as subprocess.run
    done = subprocess.run([*PROGRAM, *map(str, words)], capture_output=True, text=True, check=False, **more)
    done.stderr = without_compiling(done.stderr)
    return done


# Help, and its imports


@pytest.mark.parametrize("words", [[], ["--help"]])
def test_help(cgla: Call, words: list[str]) -> None:
    answer = cgla(*words)
    assert (answer.code, answer.err) == (0, "")
    assert all(command in answer.out for command in ("compare", "plan", "solvers", "scenarios"))


def test_every_command_has_help(cgla: Call) -> None:
    inner = COMMANDS["graph"][1]
    for name in [*(COMMANDS.keys() - {"graph"}), *(f"graph {one}" for one in inner)]:
        answer = cgla(*name.split(), "--help")
        assert (answer.code, answer.err) == (0, ""), name
        assert f" {name} [OPTIONS]" in answer.out


def test_help_lists_options_by_topic(cgla: Call) -> None:
    """Each option is there once; if groups share one, with the first of them."""
    topics: dict[str, list[str]] = {}
    lines = cgla("plan", "--help").out.splitlines()
    for line in lines[lines.index("Arguments:") :]:
        if line.endswith(":") and not line.startswith(" "):
            topics[line] = []
        elif line.startswith("  --"):
            topics[[*topics][-1]].append(line.split()[0])

    flat = [one for options in topics.values() for one in options]
    assert sorted(flat) == sorted(set(flat))
    assert [*topics][:3] == ["Arguments:", "Options:", "The map:"]
    assert "--help" in topics["Options:"]
    assert {"--volumes", "--pitch", "--fence"} <= set(topics["Volumes around a flight:"])
    assert {"--altitude", "--ground"} <= set(topics["Altitude, zones and terrain:"])
    assert {"--speed", "--battery"} <= set(topics["Time, energy and battery:"])
    assert topics["Flight plans to write:"][0] == "--export"


@pytest.mark.parametrize("words", [["--help"], ["plan", "--help"]], ids=" ".join)
def test_help_imports_nothing_heavy(words: list[str]) -> None:
    code = (
        f"import sys; from cgla_graph.comparisons.cli.app import main; sys.argv = {['cgla', *words]!r}\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'numba', 'matplotlib', 'ompl', 'pydantic', 'networkx', 'shapely', 'pyproj'}\n"
        "print('heavy:', sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    # (typer reads the values of a command's options with pydantic)
    assert done.stdout.splitlines()[-1].replace("'pydantic'", "" if words[1:] else "'pydantic'") == "heavy: []"


def test_no_garbage_is_collected_at_the_end() -> None:
    """Exit handlers run in reverse order."""
    code = (
        "import atexit, gc, sys; atexit.register(lambda: print('frozen:', gc.get_freeze_count() > 0))\n"
        "from cgla_graph.comparisons.cli.app import main; sys.argv = ['cgla', '--version']\n"
        "try: main()\n"
        "except SystemExit: print('left:', gc.get_freeze_count(), gc.isenabled())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-2:] == ["left: 0 True", "frozen: True"]


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("ompl") is None, reason="needs ompl")
def test_a_command_that_loads_ompl_ends_without_its_complaints() -> None:
    words = [sys.executable, "-m", "cgla_graph.comparisons", "plan", "one-threat", "--solver", "ompl-prm-star"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "leaked" not in done.stderr
    assert "nanobind" not in done.stderr


def test_a_plan_imports_only_what_it_needs() -> None:
    """Without export, flyable path, picture and walls, their modules are not imported."""
    code = (
        "import sys; from cgla_graph.comparisons.cli.app import main; sys.argv = ['cgla', 'plan', 'one-threat']\n"
        "try: main()\n"
        "except SystemExit as left: print('left:', left.code)\n"
        "rare = {'cgla_graph.turning', 'cgla_graph.mission', 'cgla_graph.airspace.flight_plans.formats', 'filelock',\n"
        "    'cloudpickle', 'ompl', 'cgla_graph.solvers.trade_off', 'networkx', 'matplotlib', 'rich',\n"
        "    'scipy.linalg', 'scipy.sparse', 'scipy.spatial'}\n"
        "print('rare:', sorted(rare & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-2:] == ["left: 0", "rare: []"]


# Lists


def test_solvers(cgla: Call) -> None:
    answer = cgla("solvers")
    assert (answer.code, answer.err) == (0, "")
    assert all(f"│ {name} " in answer.out for name in registry.names(installed=False))
    lines = cgla("solvers", "--json").document()["solvers"]
    assert [line["name"] for line in lines] == registry.names(installed=False)
    assert {"domain", "promises", "settings", "available", "summary"} <= set(lines[0])


@pytest.mark.slow
def test_solvers_without_ompl(cgla: Call, small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listing, "find_spec", lambda name: None if name == "ompl" else object())
    lines = {line["name"]: line["available"] for line in cgla("solvers", "--json").document()["solvers"]}
    lacking = {name for name in lines if "ompl" in registry.traits(name).needs}
    assert "rrt-star" in lacking
    assert all(("ompl" in text) == (name in lacking) for name, text in lines.items())
    answer = cgla("compare", small, "--seeds", 1, "--json")
    states = {row["solver"]: row["status"] for row in answer.document()["rows"]}
    assert answer.code == 0
    assert {states.pop(name) for name in lacking} == {"unavailable"}
    # some are not expected to find their way
    assert set(states.values()) == {"optimal", "found", "stuck"}
    assert not any(registry.traits(name).complete for name, state in states.items() if state == "stuck")
    assert cgla("compare", small, "--solvers", "rrt-star,cgla", "--strict").code == 1
    answer = cgla("plan", small, "--solver", "rrt-star")
    assert (answer.code, "pip install ompl" in answer.out) == (1, True)


def test_solvers_with_a_broken_plug_in(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    point = EntryPoint("broken", "no_such_module_of_anyone:Solver", listing.ENTRY_POINT_GROUP)
    monkeypatch.setattr(listing, "entry_points", lambda **_: [point])
    lines = {line["name"]: line["available"] for line in cgla("solvers", "--json").document()["solvers"]}
    assert "no_such_module_of_anyone" in lines["broken"]


def test_scenarios(cgla: Call) -> None:
    answer = cgla("scenarios")
    assert (answer.code, answer.err) == (0, "")
    assert all(f"│ {name} " in answer.out for name in shipped())
    lines = cgla("scenarios", "--json").document()["scenarios"]
    assert [line["name"] for line in lines] == shipped()
    assert all(line["title"] for line in lines)
    assert cgla("scenarios", "--schema").document() == schema()
    assert cgla("scenarios", "--show", "paper").out == shipped_scenario("paper")
    cgla("scenarios", "--show", "papr").refused("papr", "paper")


# compare


def test_compare_without_a_scenario_takes_the_papers_map(cgla: Call) -> None:
    (row,) = cgla("compare", "--solvers", "straight-line", "--json").document()["rows"]
    assert (row["scenario"], row["solver"], row["seed"]) == ("paper", "straight-line", None)
    assert row["length"] == pytest.approx(0.8 * math.sqrt(2.0))


@pytest.mark.slow
def test_compare_takes_every_solver(cgla: Call, small: Path) -> None:
    answer = cgla("compare", small, "--seeds", 1, "--budget", "seconds=0.2", "--json")
    document = answer.document()
    assert (answer.code, answer.err, document["files"], document["interrupted"]) == (0, "", [], False)
    assert [row["solver"] for row in document["rows"]] == registry.names(installed=False)
    assert all(tuple(row) == COLUMNS for row in document["rows"])
    exact = [row["cost"] for row in document["rows"] if row["excess"] == 0.0]
    assert len(exact) >= 2
    assert exact == pytest.approx([exact[0]] * len(exact), rel=1e-12)


def test_compare_prints_a_table_and_writes_nothing(cgla: Call, small: Path, tmp_path: Path) -> None:
    answer = cgla("compare", small, "--solvers", "cgla, straight-line,cgla")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out.count("│ cgla ") == answer.out.count("│ straight-line ") == 1
    assert names_in(tmp_path) == {small.name}


def test_compare_writes_rows_and_pictures(cgla: Call, small: Path, tmp_path: Path) -> None:
    pytest.importorskip("ompl")
    out = tmp_path / "new" / "folder"
    solvers = "cgla,straight-line,rrt-star:iterations=300"
    document = cgla("compare", small, "--solvers", solvers, "--seeds", 2, "--out", out, "--json").document()
    wanted = {*STUDY_FILES, "traces.jsonl", "small.png", "small.svg", "small-cost.png"}
    assert names_in(out) == wanted
    assert {Path(file).name for file in document["files"]} == wanted - {"study.jsonl.lock"}
    rows = [json.loads(line) for line in (out / "rows.jsonl").read_text(encoding="utf-8").splitlines()]
    assert rows == document["rows"]
    assert [(row["solver"], row["seed"]) for row in rows][2:] == [(solvers.split(",")[2], seed) for seed in (1, 2)]
    with (out / "rows.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert [line["solver"] for line in table] == [row["solver"] for row in rows]
    assert [float(line["cost"]) for line in table] == [row["cost"] for row in rows]
    for picture in out.glob("*.png"):
        assert picture.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert ET.parse(out / "small.svg").getroot().tag == "{http://www.w3.org/2000/svg}svg"  # noqa: S314 - our own file


@pytest.mark.usefixtures("pictures")
def test_compare_says_what_it_wrote(cgla: Call, small: Path, tmp_path: Path) -> None:
    answer = cgla("compare", small, "paper", "--solvers", "cgla", "--out", tmp_path / "out", "--pictures", 1)
    files = "study.jsonl, report.html, study.db, rows.jsonl, rows.csv, summary.csv, small.png"
    assert f"written to {tmp_path / 'out'}: {files}" in answer.out
    assert "first 1 of 2 scenarios" in answer.err
    assert "paper.png" not in names_in(tmp_path / "out")


@pytest.mark.usefixtures("pictures")
def test_compare_replaces_a_study_only_with_overwrite(cgla: Call, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    for solvers in ("cgla,dijkstra,straight-line", "cgla"):
        if out.exists():
            cgla("compare", small, "--solvers", solvers, "--out", out).refused("--resume", "--overwrite")
        cgla("compare", small, "--solvers", solvers, "--out", out, "--overwrite")
        lines = (out / "rows.jsonl").read_text(encoding="utf-8").splitlines()
        assert [json.loads(line)["solver"] for line in lines] == solvers.split(",")
        assert not list(out.glob("*.part")) + list(out.glob(".*"))


@pytest.mark.usefixtures("pictures")
def test_pictures_of_scenarios_do_not_overwrite_each_other(cgla: Call, tmp_path: Path) -> None:
    for name in ("t.toml", "t-cost.toml"):
        (tmp_path / name).write_text(SMALL, encoding="utf-8")
    words = ("compare", "t.toml", "t-cost.toml", "--solvers", "cgla", "--out", "out", "--json")
    written = cgla(*words).document()["files"]
    assert len(set(written)) == len(written)


def test_strict_tells_by_the_exit_code(cgla: Call, tmp_path: Path) -> None:
    file = tmp_path / "shut.toml"
    file.write_text(SMALL + SHUT, encoding="utf-8")
    words = ("compare", file, "--solvers", "cgla,straight-line", "--json")
    for strict, code in (((), 0), (("--strict",), 1)):
        answer = cgla(*words, *strict)
        assert answer.code == code
        assert [row["status"] for row in answer.document()["rows"]] == ["no-path", "infeasible"]
        assert answer.document()["rows"][0]["cost"] is None
    assert cgla("compare", "one-threat", "--solvers", "cgla", "--strict").code == 0


def test_rows_of_a_grid_map(cgla: Call, tmp_path: Path) -> None:
    (tmp_path / "m.map").write_text("type octile\nheight 3\nwidth 3\nmap\n...\n.@.\n...\n")
    (tmp_path / "m.map.scen").write_text("version 1\n" + "0 m.map 3 3 0 0 2 2 4\n" * 3)
    words = ("compare", "m.map.scen:1-2", "--solvers", "eight-direction,cgla", "--json")
    rows = cgla(*words).document()["rows"]
    assert [(row["scenario"], row["solver"]) for row in rows] == [
        (name, solver) for name in ("m:1", "m:2") for solver in ("eight-direction", "cgla")
    ]
    assert [row["cost"] for row in rows[:1]] == [pytest.approx(4.0)]
    cgla("compare", "m.map.scen:3").refused("no row 3", "0 to 2")
    cgla("plan", "m.map.scen").refused("3 rows", "FILE.scen:ROW")


@pytest.mark.slow
def test_real_areas(cgla: Call, tmp_path: Path) -> None:
    solvers = "cgla,eight-direction,straight-line"
    words = ("--solvers", solvers, "--out", tmp_path / "out", "--pictures", 1, "--json")
    document = cgla("compare", *AREAS, *words).document()
    assert {row["status"] for row in document["rows"] if row["solver"] == "cgla"} == {"optimal"}
    first = name_of(AREAS[0])
    assert {f"{first}.png", f"{first}.svg", "rows.csv"} <= names_in(tmp_path / "out")


@pytest.mark.slow
def test_two_processes_find_the_same_rows(small: Path) -> None:
    solvers = "cgla,dijkstra,eight-direction,rrt-star:iterations=300,prm-star:milestones=100"
    answers = []
    for hash_seed in ("1", "2"):
        words = ("compare", small, "--solvers", solvers, "--seeds", 2, "--json")
        done = process(*words, env={**os.environ, "PYTHONHASHSEED": hash_seed})
        assert (done.returncode, done.stderr) == (0, "")
        rows = json.loads(done.stdout)["rows"]
        answers.append([{key: value for key, value in row.items() if "seconds" not in key} for row in rows])
    assert answers[0] == answers[1]
    assert len(answers[0]) >= 5


@pytest.mark.usefixtures("pictures")
def test_scenarios_of_one_name(cgla: Call, tmp_path: Path) -> None:
    for folder, k in (("a", 5.0), ("b", 0.0)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "x.toml").write_text(SMALL.replace("k = 5.0", f"k = {k}"), encoding="utf-8")
    words = ("compare", "a/x.toml", "b/x.toml", "--solvers", "cgla,straight-line", "--out", "out", "--overwrite")
    document = cgla(*words, "--json").document()
    assert [row["excess"] for row in document["rows"] if row["solver"] == "cgla"] == [0.0, 0.0]
    assert len(set(document["files"])) == 6 + 2 * 3
    assert [row["scenario"] for row in document["rows"]] == ["x", "x", "x-2", "x-2"]
    # a table of each, and the leaderboard
    assert cgla(*words).out.count("│ cgla ") == 3


# The lower bound, and how soon solvers get near it


def lines_of(table: str) -> list[list[str]]:
    """Return the cells of the lines of all tables, heads included."""
    rows = [line for line in table.splitlines() if line[:1] in "┃│"]
    return [[cell.strip() for cell in line[1:-1].replace("┃", "│").split("│")] for line in rows]


@pytest.mark.parametrize("name", ["small", "paper", "one-threat"])
def test_the_table_is_sorted_by_the_gap(cgla: Call, small: Path, name: str) -> None:
    words = ("compare", small if name == "small" else name, "--solvers", "straight-line,eight-direction,cgla,dijkstra")
    heads, *lines = lines_of(cgla(*words).out)
    assert heads[:4] == ["solver", "status", "cost", "gap"]
    gaps = [float(line[3].removesuffix(" %")) for line in lines]
    assert gaps == sorted(gaps)
    assert gaps[0] >= 0.0
    document = cgla(*words, "--json").document()
    (proof,) = document["certificates"]
    for row in document["rows"]:
        assert row["gap"] == pytest.approx(row["cost"] / row["lower_bound"] - 1.0)
        assert row["lower_bound"] >= proof["lower_bound"] > 0.0
    assert f"{min(row['gap'] for row in document['rows']):+.2%}".replace("%", " %") in cgla(*words).out


def test_runs_on_the_disk_have_their_gap_at_once(
    cgla: Call, small: Path, tmp_path: Path, enter: Callable[..., str]
) -> None:
    seen: list[Run] = []

    def look(problem: Problem) -> Solution:
        seen.extend(load(tmp_path / "out").runs)
        return straight(problem)

    cgla("compare", small, "--solvers", f"cgla,{enter(look)}", "--out", "out", "--pictures", 0)
    (run,) = seen
    assert run.solution.gap == pytest.approx(run.solution.cost / run.solution.lower_bound - 1.0)


@pytest.mark.parametrize("words", [["--no-certificate"], ["--tolerance", "0"]])
def test_the_lower_bound_can_be_left_out(cgla: Call, small: Path, words: list[str]) -> None:
    document = cgla("compare", small, "--solvers", "cgla", *words, "--json").document()
    (row,) = document["rows"]
    assert (row["lower_bound"], row["gap"], document["certificates"]) == (None, None, [None])
    assert "no lower bound was asked for" in cgla("compare", small, "--solvers", "cgla", *words).out
    assert cgla("plan", small, "--solver", "cgla", *words, "--json").document()["certificate"] is None


def unlucky(problem: Problem) -> Solution:
    return Solution(Status.NOT_FOUND, seconds=0.1)


@pytest.mark.slow
def test_how_soon_stands_in_a_table_a_list_and_a_file(cgla: Call, small: Path, tmp_path: Path) -> None:
    pytest.importorskip("ompl")
    solvers = "cgla,rrt-star:iterations=300,straight-line"
    words = ("compare", small, "--solvers", solvers, "--seeds", 6, "--out", "out", "--pictures", 0, "--overwrite")
    text = cgla(*words).out
    assert "small: how soon" in text
    document = cgla(*words, "--json").document()
    with (tmp_path / "out" / "summary.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))
    assert [line["solver"] for line in table] == solvers.split(",")
    for line, one in zip(table, document["summary"], strict=True):
        assert line == {key: "" if value is None else str(value) for key, value in one.items()}
    rows = [row for row in document["rows"] if row["solver"].startswith("rrt-star")]
    costs = sorted(row["cost"] for row in rows)
    rrt = document["summary"][1]
    assert (rrt["runs"], rrt["paths"], rrt["success"], rrt["success_high"]) == (6, 6, 1.0, 1.0)
    assert (rrt["cost_low"], rrt["cost"], rrt["cost_high"]) == (costs[0], costs[2], costs[5])
    assert rrt["seconds_to_first"] <= statistics.median_low([row["seconds"] for row in rows])
    traces = [json.loads(line) for line in (tmp_path / "out" / "traces.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [(trace["solver"], trace["seed"]) for trace in traces] == [(row["solver"], row["seed"]) for row in rows]
    for trace, row in zip(traces, rows, strict=True):
        assert trace["cost"][-1] == pytest.approx(row["cost"])
        assert len(trace["seconds"]) == len(trace["evaluations"]) == len(trace["cost"])


def test_solvers_that_neither_draw_nor_improve_need_no_second_table(cgla: Call, small: Path, tmp_path: Path) -> None:
    words = ("compare", small, "--solvers", "cgla,straight-line", "--out", "out", "--pictures", 0)
    assert "how soon" not in cgla(*words).out
    assert names_in(tmp_path / "out") == STUDY_FILES


def test_a_run_that_finds_nothing_counts(cgla: Call, small: Path, enter: Callable[..., str]) -> None:
    (one,) = cgla("compare", small, "--solvers", enter(unlucky), "--json").document()["summary"]
    assert (one["runs"], one["paths"], one["success"]) == (1, 0, 0.0)
    assert one["cost"] is one["seconds_to_first"] is one["evaluations_to_first"] is None


@pytest.mark.ompl
def test_a_budget_is_the_same_for_all_and_is_said(cgla: Call, small: Path) -> None:
    pytest.importorskip("ompl")
    words = ("compare", small, "--solvers", "rrt-star,rrt-star:iterations=70,cgla", "--seeds", 1)
    rows = cgla(*words, "--budget", "iterations=50", "--json").document()["rows"]
    by_hand = cgla("compare", small, "--solvers", "rrt-star:iterations=50", "--seeds", 1, "--json").document()["rows"]
    assert rows[0]["evaluations"] == by_hand[0]["evaluations"] < rows[1]["evaluations"]
    text = cgla(*words, "--budget", "seconds=0.05").out
    assert "budget: seconds=0.05, taken by rrt-star, rrt-star:iterations=70" in text


def test_refined_paths_have_labels_of_their_own(cgla: Call, small: Path) -> None:
    words = ("--resolution", 6, "--json")
    plain = cgla("compare", small, "--solvers", "cgla", *words).document()["rows"][0]
    refined = cgla("compare", small, "--solvers", "cgla", "--refine", *words).document()["rows"][0]
    assert (plain["solver"], refined["solver"]) == ("cgla", "cgla+refine")
    assert refined["cost"] < plain["cost"]
    assert cgla("plan", small, "--solver", "cgla", "--refine", *words).document()["cost"] == refined["cost"]


# plan


def test_plan_in_the_plane(cgla: Call, small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    answer = cgla("plan", small, "--solver", "cgla", "--out", out, "--json")
    document = answer.document()
    assert (answer.code, answer.err) == (0, "")
    assert names_in(out) == {"small-cgla.csv", "small-cgla.png"} == {Path(file).name for file in document["files"]}
    problem = load_scenario(small).problem
    assert document["path"][0] == list(problem.start)
    assert document["path"][-1] == list(problem.goal)
    assert document["cost"] == problem.evaluate(document["path"]).cost
    assert "path_lonlat" not in document
    with (out / "small-cgla.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.reader(file))
    assert lines[0] == ["x", "y"]
    assert [[float(part) for part in line] for line in lines[1:]] == document["path"]
    assert (out / "small-cgla.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("pictures")
def test_plan_in_degrees(cgla: Call, tmp_path: Path) -> None:
    words = ("plan", "finland", "--solver", "eight-direction", "--out", tmp_path / "out", "--json")
    document = cgla(*words).document()
    assert names_in(tmp_path / "out") == {f"finland-eight-direction.{ending}" for ending in ("csv", "geojson", "png")}
    geojson = json.loads((tmp_path / "out" / "finland-eight-direction.geojson").read_text(encoding="utf-8"))
    line = geojson["features"][0]["geometry"]["coordinates"]
    assert line == document["path_lonlat"]
    assert line[0] == pytest.approx([22.95, 59.85])
    areas = shapely.union_all(
        [shapely.Polygon(ring) for ring in tomllib.loads(shipped_scenario("finland"))["no_fly"]["polygons"]]
    )
    # as close as projecting the edges of the areas allows
    assert shapely.LineString(line).intersection(areas.buffer(-1e-4)).is_empty


def test_plan_prints_numbers(cgla: Call, small: Path) -> None:
    answer = cgla("plan", small)
    assert (answer.code, answer.err) == (0, "")
    lines = dict(line.split(maxsplit=1) for line in answer.out.splitlines())
    assert lines["scenario"] == "small"
    assert {"solver", "status", "cost", "length", "risk", "clearance", "waypoints", "time"} <= set(lines)
    problem = load_scenario(small).problem
    assert float(lines["cost"]) == pytest.approx(float(lines["length"]) + problem.k * float(lines["risk"]), rel=1e-5)
    gap, _, words = lines["gap"].partition(" %: ")
    assert float(lines["cost"]) / float(lines["bound"]) - 1.0 == pytest.approx(float(gap) / 100.0, abs=6e-5)
    assert "above the proven lower bound" in words


def test_plan_without_a_path(cgla: Call, tmp_path: Path) -> None:
    file = tmp_path / "shut.toml"
    file.write_text(SMALL + SHUT, encoding="utf-8")
    answer = cgla("plan", file, "--solver", "cgla", "--out", tmp_path / "out", "--json")
    document = answer.document()
    assert (answer.code, document["status"], document["path"], document["files"]) == (1, "no-path", [], [])
    assert cgla("plan", file).code == 1


def test_plan_from_another_place(cgla: Call, small: Path) -> None:
    words = ("--solver", "cgla", "--start", "0,1", "--goal", "1.0,0.0", "--resolution", 7, "--json")
    document = cgla("plan", small, *words).document()
    assert (document["path"][0], document["path"][-1]) == ([0.0, 1.0], [1.0, 0.0])
    assert document["evaluations"] == 49 * 48 // 2


def test_negative_coordinates_are_values_not_options(cgla: Call, tmp_path: Path) -> None:
    (tmp_path / "wide.toml").write_text(f"{ENDS}k = 0.0\nbounds = [-2, -2, 2, 2]\n", encoding="utf-8")
    document = cgla("plan", "wide.toml", "--start", "-1,-1", "--goal=-1,1.5", "--json").document()
    assert (document["path"][0], document["path"][-1]) == ([-1.0, -1.0], [-1.0, 1.5])


@pytest.mark.slow
def test_start_equal_to_goal(cgla: Call, small: Path, tmp_path: Path) -> None:
    words = ("--goal", "0.1,0.1", "--seeds", 1, "--out", tmp_path / "out", "--json")
    document = cgla("compare", small, *words).document()
    for row in document["rows"]:
        assert (row["status"], row["cost"], row["length"], row["risk"]) == ("optimal", 0.0, 0.0, 0.0), row["solver"]
    assert {"small.png", "small.svg"} <= names_in(tmp_path / "out")
    words = ("--solver", "cgla", "--goal", "22.95,59.85", "--out", tmp_path / "plan", "--json")
    document = cgla("plan", "finland", *words).document()
    assert (len(document["path"]), document["cost"]) == (1, 0.0)
    assert {"finland-cgla.csv", "finland-cgla.geojson", "finland-cgla.png"} == names_in(tmp_path / "plan")


# Wrong input: one line, exit 2, nothing written

BAD_TOML = {
    "start outside": (SMALL.replace("0.1, 0.1", "2.0, 0.1"), ["start", "outside the bounds"]),
    "goal outside": (SMALL.replace("0.9, 0.9", "0.9, -1.0"), ["goal", "outside the bounds"]),
    "start in an area": (SMALL.replace("0.1, 0.1", "0.5, 0.1") + WALL, ["start", "no-fly"]),
    "goal in an area": (SMALL.replace("0.9, 0.9", "0.5, 0.1") + WALL, ["goal", "no-fly"]),
    "negative k": (SMALL.replace("5.0", "-5.0"), ["k:", "-5.0"]),
    "nan k": (SMALL.replace("5.0", "nan"), ["k:", "nan"]),
    "no spread": (SMALL.replace("spread = 0.1", "spread = 0.0"), ["threats.0.spread", "0.0"]),
    "negative spread": (SMALL.replace("spread = 0.1", "spread = -0.1"), ["threats.0.spread", "-0.1"]),
    "peak above 1": (SMALL.replace("spread = 0.1", "spread = 0.1, peak = 1.5"), ["threat 0", "peak 1.5"]),
    "peak 0": (SMALL.replace("spread = 0.1", "spread = 0.1, peak = 0.0"), ["threats.0.peak"]),
    "resolution 1": (SMALL.replace("resolution = 4", "resolution = 1"), ["resolution is 1", "at least 2"]),
    "unknown key": (SMALL.replace("threats", "treats"), ["treats", "did you mean threats"]),
    "wrong type": (SMALL.replace("5.0", '"5"'), ["k:", "'5'", "number"]),
    "not TOML": ("start = [0.1,", ["not TOML"]),
    "binary": (None, ["utf-8"]),
}


@pytest.mark.parametrize("command", ["compare", "plan"])
@pytest.mark.parametrize("what", BAD_TOML)
def test_bad_scenarios(cgla: Call, tmp_path: Path, command: str, what: str) -> None:
    text, words = BAD_TOML[what]
    file = tmp_path / "bad.toml"
    file.write_bytes(text.encode() if text is not None else bytes(range(256)))
    cgla(command, file, "--out", "out").refused(str(file), *words)
    assert names_in(tmp_path) == {"bad.toml"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["compare", "nowhere.toml"], ["nowhere.toml", "No such file"]),
        (["compare", "nowhere.geojson"], ["nowhere.geojson", "no such file"]),
        (["compare", "nowhere.map"], ["nowhere.map", "no such file"]),
        (["compare", "nowhere.scen:3"], ["nowhere.scen", "no such file"]),
        (["compare", "papr"], ["papr", "did you mean paper"]),
        (["compare", "."], ["unknown scenario"]),
        (["compare", ""], ["unknown scenario"]),
        (["compare", "folder.toml"], ["folder.toml", "directory"]),
        (["compare", "folder.geojson"], ["folder.geojson", "directory"]),
        (["compare", "paper", "--solvers", "cgl"], ["cgl", "did you mean cgla"]),
        (["compare", "paper", "--solvers", "cgla,dijkstraa"], ["dijkstraa", "did you mean dijkstra"]),
        (["compare", "paper", "--solvers", ","], ["--solvers"]),
        (["compare", "paper", "--solvers", "cgla:bogus=1"], ["bogus", "schedule"]),
        (["compare", "paper", "--solvers", "cgla:schedule=bogus"], ["bogus", "sweeps"]),
        (["compare", "paper", "--seeds", "0"], ["--seeds"]),
        (["compare", "paper", "--seeds", "many"], ["--seeds"]),
        (["compare", "paper", "--resolution", "1"], ["resolution is 1"]),
        (["compare", "paper", "papr"], ["papr"]),
        (["compare", "paper", "--budget", "seconds=0"], ["seconds", "'0'", "above 0"]),
        (["compare", "paper", "--budget", "seconds=-1"], ["seconds", "'-1'"]),
        (["compare", "paper", "--budget", "seconds=nan"], ["seconds", "'nan'"]),
        (["compare", "paper", "--budget", "iterations=1.5"], ["iterations", "whole number"]),
        (["compare", "paper", "--budget", "minutes=1"], ["minutes=1", "seconds", "iterations", "evaluations"]),
        (["compare", "paper", "--budget", ""], ["seconds", "iterations", "evaluations"]),
        (["compare", "paper", "--tolerance", "-1"], ["--tolerance is -1", "above 0"]),
        (["compare", "paper", "--tolerance", "nan"], ["--tolerance is nan"]),
        (["compare", "paper", "--tolerance", "tight"], ["invalid value", "--tolerance"]),
        (["plan", "paper", "--tolerance", "inf"], ["--tolerance is inf"]),
        (["plan", "paper", "--solver", "cgl"], ["cgl", "did you mean cgla"]),
        (["plan", "paper", "--start", "1"], ["--start", "'1'", "X,Y"]),
        (["plan", "paper", "--goal", "a,b"], ["--goal", "'a,b'", "X,Y"]),
        (["plan", "paper", "--goal", "0.1,0.2,0.3"], ["--goal", "X,Y"]),
        (["plan", "paper", "--start", "5,5"], ["paper", "start", "outside the bounds"]),
        (["plan", "paper", "--start", "nan,0"], ["start", "nan"]),
        (["plan", "paper:1"], ["paper:1"]),
        (["plan"], ["SCENARIO"]),
        (["plan", "paper", "maze"], ["maze"]),
        (["compare", "--bogus"], ["--bogus"]),
        (["bogus"], ["bogus"]),
    ],
    ids=" ".join,
)
def test_bad_words(cgla: Call, tmp_path: Path, words: list[str], said: list[str]) -> None:
    for name in ("folder.toml", "folder.geojson"):
        (tmp_path / name).mkdir()
    out = ["--out", "out"] if words[0] in {"compare", "plan"} else []
    cgla(*words, *out).refused(*said)
    assert names_in(tmp_path) == {"folder.toml", "folder.geojson"}


def test_a_fault_in_the_last_scenario_is_found_before_any_work(cgla: Call, small: Path, tmp_path: Path) -> None:
    cgla("compare", small, "nowhere.toml", "--out", "out").refused("nowhere.toml")
    assert names_in(tmp_path) == {small.name}


RING = [[24, 60], [25, 61], [25, 60], [24, 61], [24, 60]]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("bad.geojson", json.dumps({"type": "Polygon", "coordinates": [RING]}), "intersection"),
        ("cut.map", "type octile\nheight 3\nwidth 3\nmap\n...\n..", "line 6"),
    ],
)
def test_damaged_maps_are_refused(cgla: Call, tmp_path: Path, name: str, text: str, said: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    cgla("compare", name, "--out", "out").refused(name, said)
    assert names_in(tmp_path) == {name}


@pytest.mark.parametrize("command", ["compare", "plan"])
@pytest.mark.parametrize("below", ["file", "file/sub", "file/sub/sub"])
def test_an_output_folder_that_cannot_be(cgla: Call, small: Path, tmp_path: Path, command: str, below: str) -> None:
    (tmp_path / "file").write_text("mine")
    cgla(command, small, "--out", below).refused(below, "cannot be written", "--out")
    assert (tmp_path / "file").read_text() == "mine"
    assert names_in(tmp_path) == {"file", small.name}


@pytest.mark.parametrize("command", ["compare", "plan"])
def test_names_that_no_file_has_are_refused(cgla: Call, command: str) -> None:
    cgla(command, os.fsdecode(b"\xff.toml")).refused("no such file")
    cgla(command, "a\0b.toml").refused("name")


def test_a_setting_with_a_comma(cgla: Call, small: Path) -> None:
    answer = cgla("compare", small, "--solvers", "cgla,eight-direction:resolution=(3,4)", "--json")
    assert [row["status"] for row in answer.document()["rows"]] == ["optimal", "optimal"]


# Names that are hard to print or to write

ODD = ["ünïcode 漢字", "with  blanks", "[bold]x[bold]", "quo\"te'", "line\nbreak", "-dash", ".dot", "%s {x}", "a,b;c"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ODD)
@pytest.mark.usefixtures("pictures")
def test_odd_names(cgla: Call, tmp_path: Path, name: str) -> None:
    file = tmp_path / f"{name}.toml"
    file.write_text(SMALL, encoding="utf-8")
    out = tmp_path / "out"
    answer = cgla("compare", file, "--solvers", "cgla", "--out", out)
    assert answer.code == 0
    assert all(part in answer.out for part in name.split("\n"))
    document = cgla("compare", file, "--solvers", "cgla", "--out", out, "--overwrite", "--json").document()
    assert document["rows"][0]["scenario"] == name
    (row,) = (json.loads(line) for line in (out / "rows.jsonl").read_text(encoding="utf-8").splitlines())
    assert row["scenario"] == name
    with (out / "rows.csv").open(encoding="utf-8", newline="") as table:
        assert [line["scenario"] for line in csv.DictReader(table)] == [name]
    assert len(names_in(out)) == len(STUDY_FILES) + 3
    document = cgla("plan", file, "--out", tmp_path / "plan", "--json").document()
    assert document["scenario"] == name
    assert len(names_in(tmp_path / "plan")) == 2


def test_rows_of_a_name_that_is_no_utf8(cgla: Call, tmp_path: Path) -> None:
    try:
        (tmp_path / os.fsdecode(b"\xff.toml")).write_text(SMALL, encoding="utf-8")
    except OSError:
        pytest.skip("this file system takes only UTF-8 names")
    assert cgla("compare", os.fsdecode(b"\xff.toml"), "--solvers", "cgla", "--out", "out").code == 0


@pytest.mark.parametrize("command", ["compare", "plan"])
def test_a_terminal_of_few_letters(cgla: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    (tmp_path / "greek.toml").write_text(f'title = "Ω"\n{SMALL}', encoding="utf-8")
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding="latin-1"))
    assert cgla(command, "greek.toml", *(["--solvers", "cgla"] if command == "compare" else [])).code == 0


# Solvers that misbehave


@pytest.mark.parametrize("command", [("compare", "--solvers"), ("plan", "--solver")])
def test_a_solver_that_raises_is_a_row(
    cgla: Call, small: Path, enter: Callable[..., str], command: tuple[str, str]
) -> None:
    name = enter(lambda _: 1 / 0)
    answer = cgla(command[0], small, command[1], name, "--json")
    (row,) = answer.document().get("rows", [answer.document()])
    assert (row["status"], row["cost"], row["message"]) == ("failed", None, "ZeroDivisionError: division by zero")
    assert answer.code == (1 if command[0] == "plan" else 0)
    assert "division by zero" in cgla(command[0], small, command[1], name).out


def test_a_message_with_markup_stands_in_the_table(cgla: Call, small: Path, enter: Callable[..., str]) -> None:
    name = enter(lambda _: Solution(Status.NOT_FOUND, message="[bold]no[/bold] [/] luck"))
    assert "own: [bold]no[/bold] [/] luck" in cgla("compare", small, "--solvers", name).out


def talk(problem: Problem) -> Solution:
    print("hello")
    return straight(problem)


def shout(problem: Problem) -> Solution:
    os.write(1, b"hello\n")
    return straight(problem)


@pytest.mark.parametrize("noise", [talk, shout])
@pytest.mark.parametrize("command", [("compare", "--solvers"), ("plan", "--solver")])
def test_json_stays_json_if_a_solver_prints(
    cgla: Call, small: Path, enter: Callable[..., str], noise: Callable[[Problem], Solution], command: tuple[str, str]
) -> None:
    answer = cgla(command[0], small, command[1], enter(noise), "--json")
    answer.document()
    assert "hello" in answer.err


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(np.array([(0.1, 0.1), (np.nan, 0.5), (0.9, 0.9)]), id="nan"),
        pytest.param([(0.2, 0.2)], id="list"),
    ],
)
def test_plan_with_a_path_that_was_refused(cgla: Call, small: Path, enter: Callable[..., str], path: Any) -> None:  # noqa: ANN401 - that is the point
    name = enter(lambda _: Solution(Status.FOUND, path=path, cost=1.0))
    answer = cgla("plan", small, "--solver", name, "--json")
    assert (answer.code, answer.document()["status"]) == (1, "failed")


def test_a_count_of_numpy_is_a_number(cgla: Call, small: Path, enter: Callable[..., str]) -> None:
    name = enter(lambda p: Solution(Status.FOUND, straight(p).path, cost=straight(p).cost, evaluations=np.int64(7)))  # type: ignore[arg-type]
    (row,) = cgla("compare", small, "--solvers", name, "--json").document()["rows"]
    assert row["evaluations"] == 7


# Interrupts, kills, pipes and disks


def interrupt_second() -> Callable[[Problem], Solution]:
    calls: list[int] = []

    def solve(problem: Problem) -> Solution:
        calls.append(1)
        if len(calls) == 2:
            signal.raise_signal(signal.SIGINT)
        return straight(problem)

    return solve


@pytest.mark.slow
def test_an_interrupt_keeps_finished_runs(cgla: Call, small: Path, enter: Callable[..., str], tmp_path: Path) -> None:
    name = enter(interrupt_second())
    answer = cgla("compare", small, small, small, "--solvers", f"cgla,{name}", "--out", "out", "--json")
    document = answer.document()
    assert (answer.code, document["interrupted"]) == (130, True)
    remedy = "(cgla compare --resume --out out goes on)"
    assert answer.err == f"cgla: interrupted: 3 of 6 runs are done and kept in out {remedy}\n"
    assert names_in(tmp_path / "out") == STUDY_FILES
    rows = [json.loads(line) for line in (tmp_path / "out" / "rows.jsonl").read_text(encoding="utf-8").splitlines()]
    assert rows == document["rows"]
    assert [row["solver"] for row in rows] == ["cgla", name, "cgla"]


@pytest.mark.parametrize("command", ["compare", "plan"])
def test_an_interrupt_at_the_beginning_is_said(cgla: Call, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    monkeypatch.setattr(
        "cgla_graph.comparisons.study.options.open_scenarios", lambda *_, **__: signal.raise_signal(signal.SIGINT)
    )
    answer = cgla(command, "paper")
    assert (answer.code, answer.out) == (130, "")
    assert answer.err == "cgla: interrupted\n"


def n_runs(folder: Path) -> int:
    """Count the runs that are on the disk."""
    with suppress(CglaError):
        return len(load(folder).runs)
    return 0


@pytest.fixture
def busy(small: Path, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a comparison that has two rows on the disk, and whose third never ends."""
    pytest.importorskip("ompl")
    # the short run imports OMPL, which no signal should hit
    solvers = "cgla,rrt-star:iterations=50,rrt-star:iterations=100000000"
    words = ["compare", str(small), "--solvers", solvers, "--seeds", "1", "--out", str(tmp_path / "out")]
    with program([*PROGRAM, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        try:
            while running.poll() is None and n_runs(tmp_path / "out") < 2:
                time.sleep(0.1)
            yield running
        finally:
            running.kill()


@pytest.mark.slow
@pytest.mark.ompl
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_in_the_middle(busy: subprocess.Popen[str], tmp_path: Path) -> None:
    busy.send_signal(signal.SIGINT)
    out, err = busy.communicate(timeout=120)
    assert (busy.returncode, err.count("\n")) == (130, 1)
    assert err.startswith(f"cgla: interrupted: 2 of 3 runs are done and kept in {tmp_path / 'out'} (")
    assert "│ cgla " in out
    assert names_in(tmp_path / "out") == {*STUDY_FILES, "traces.jsonl"}
    lines = (tmp_path / "out" / "rows.jsonl").read_text(encoding="utf-8").splitlines()
    first, second = (json.loads(line) for line in lines)
    assert (first["solver"], first["status"], first["excess"]) == ("cgla", "optimal", 0.0)
    assert (second["solver"], second["seed"]) == ("rrt-star:iterations=50", 1)


@pytest.mark.slow
@pytest.mark.ompl
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_a_kill_leaves_whole_runs_and_no_worker(busy: subprocess.Popen[str], tmp_path: Path) -> None:
    busy.kill()
    busy.communicate(timeout=120)
    assert not {"report.html", "rows.jsonl"} & names_in(tmp_path / "out")
    assert [run.solver for run in load(tmp_path / "out").runs] == ["cgla", "rrt-star:iterations=50"]


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_a_broken_pipe_is_silent_and_no_missing_result() -> None:
    """A pipe without a reader."""
    reading, writing = os.pipe()
    os.close(reading)
    words = [*PROGRAM, "scenarios", "--show", "finland"]
    with os.fdopen(writing, "wb") as pipe:
        done = subprocess.run(words, stdout=pipe, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_standard_output_that_is_full(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    with Path("/dev/full").open("w", encoding="utf-8", buffering=1) as full:
        monkeypatch.setattr(sys, "stdout", full)
        cgla("scenarios", "--show", "paper").refused("No space left")


def test_a_full_disk(cgla: Call, small: Path, tiny_disk: Path) -> None:
    words = ("compare", *[small] * 400, "--solvers", "straight-line", "--no-certificate", "--out", tiny_disk)
    cgla(*words).refused("full", "--out")
    assert names_in(tiny_disk) <= {"study.jsonl.lock"}


IMPROPER = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (3 * 2**30, 3 * 2**30))
from cgla_graph.comparisons.cli.app import main
sys.argv = ["cgla", "compare", sys.argv[1], "--solvers", "dijkstra", "--json"]
main()
"""


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits memory as Linux does")
def test_negative_weights_end_no_process(tmp_path: Path) -> None:
    threats = ", ".join(f"{{ x = 0.5, y = {y}, spread = 0.1, peak = 3.0 }}" for y in (0.5, 0.52))
    file = tmp_path / "improper.toml"
    file.write_text(f"{ENDS}k = 10.0\nimproper = true\nthreats = [{threats}]\n", encoding="utf-8")
    words = [sys.executable, "-W", "ignore", "-c", IMPROPER, str(file)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0
    (row,) = json.loads(done.stdout)["rows"]
    assert row["status"] in {"failed", "unsupported"}


def test_areas_that_were_planned_are_read_back(cgla: Call, tmp_path: Path) -> None:
    area = shapely.box(24.0, 60.0, 24.4, 60.2)
    (tmp_path / "area.geojson").write_text(shapely.to_geojson(area), encoding="utf-8")
    document = cgla("plan", "area.geojson", "--json").document()
    assert read_areas(tmp_path / "area.geojson")[0].polygon.equals(area)
    line = shapely.LineString(document["path_lonlat"])
    assert line.length > 0.4
    assert document["clearance"] >= 0.0
    # edges that are straight in metres bend a little in degrees
    assert line.intersection(area.buffer(-1e-3)).is_empty


@pytest.mark.slow
def test_a_closed_standard_output_is_no_traceback() -> None:
    """As ``cgla scenarios >&-`` in a shell."""
    code = (
        "import sys; sys.argv = ['cgla', 'scenarios']; sys.stdout = None;"
        "from cgla_graph.comparisons.cli.app import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")

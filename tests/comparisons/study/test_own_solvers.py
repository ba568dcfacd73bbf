"""Solvers in files, and instances of people's own classes, take part as registered solvers do."""

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

import cgla_graph as cg
from cgla_graph.comparisons import Study, run_study
from cgla_graph.comparisons.study.documents import entrant_document, entrant_from
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.study_file import study_from_toml
from cgla_graph.errors import CglaError
from cgla_graph.solvers import Traits

FILE = """
import os, sys, time
from dataclasses import dataclass
from typing import ClassVar

import cgla_graph as cg
from cgla_graph.solvers import Traits

print("imported")


def bend(problem, share):
    (x0, y0), (x1, y1) = problem.start, problem.goal
    return (x0 + x1) / 2 - share * (y1 - y0), (y0 + y1) / 2 + share * (x1 - x0)


@dataclass(frozen=True)
class Detour:
    traits: ClassVar[Traits] = Traits("detour", "one bend", domain="plane", no_fly=False)
    tries: int = 20

    def solve(self, problem):
        paths = [[problem.start, bend(problem, i / self.tries - 0.5), problem.goal] for i in range(self.tries)]
        best = min(paths, key=lambda path: problem.evaluate(path).cost)
        return cg.Solution(cg.Status.FOUND, path=best, cost=problem.evaluate(best).cost)


class Dies(Detour):
    def solve(self, problem):
        os._exit(0)


class Sleeps(Detour):
    def solve(self, problem):
        time.sleep(1000)
"""
COST = 1.613  # of Detour with 20 tries on one-threat


@dataclass(frozen=True)
class Bent:
    """Defined in a module that workers can import only by its text."""

    traits: ClassVar[Traits] = Traits("bent", "over a point", domain="plane", no_fly=False)
    over: tuple[float, float] = (0.5, 0.5)

    def solve(self, problem: cg.Problem) -> cg.Solution:
        path = [problem.start, self.over, problem.goal]
        return cg.Solution(cg.Status.FOUND, path=path, cost=problem.evaluate(path).cost)


@pytest.fixture
def detour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "detour.py"
    file.write_text(FILE, encoding="utf-8")
    return file


def test_a_file_takes_part_in_a_process_of_its_own(detour: Path, cgla: Callable[..., Any]) -> None:
    solvers = "cgla,./detour.py:Detour,./detour.py:Detour:tries=2,./detour.py:Dies,detour.py:Sleeps"
    asked = ["compare", "one-threat", "--solvers", solvers, "--limits", "seconds=3", "--no-certificate"]
    rows = {row["solver"]: row for row in cgla(*asked, "--json", "--workers", 1).document()["rows"]}
    assert rows["detour.py:Detour"]["cost"] == pytest.approx(COST, abs=1e-3)
    assert rows["detour.py:Detour:tries=2"]["cost"] > COST
    statuses = {name.rpartition(":")[2]: row["status"] for name, row in rows.items()}
    assert (statuses["Dies"], statuses["Sleeps"]) == ("crashed", "timed-out")


def test_every_door_takes_it(detour: Path, cgla: Callable[..., Any]) -> None:
    problem = cg.load_scenario("one-threat").problem
    assert cg.solve(problem, "./detour.py:Detour", tries=20).cost == pytest.approx(COST, abs=1e-3)
    assert cg.solve(problem, f"{detour}:Dies").status.label == "crashed"
    found = cgla("plan", "one-threat", "--solver", "detour.py:Detour:tries=20", "--json").document()
    assert found["cost"] == pytest.approx(COST, abs=1e-3)
    (detour.parent / "below").mkdir()
    study = study_from_toml(
        'scenarios = ["one-threat"]\nsolvers = ["../detour.py:Detour", {name = "../detour.py:Detour", tries = 3}]',
        detour.parent / "below",
    )
    assert [one.label for one in study.entrants] == ["detour.py:Detour", "detour.py:Detour:tries=3"]


@pytest.mark.slow
def test_its_hash_is_kept_and_a_changed_file_is_another_solver(detour: Path, cgla: Callable[..., Any]) -> None:
    asked = ["compare", "one-threat", "--solvers", "detour.py:Detour", "--no-certificate", "--out", "results"]
    cgla(*asked)
    again = cgla(*asked, "--resume", "--json")
    assert len(again.document()["rows"]) == 1
    # (a process that has not seen the file)
    lines = "import sys\nfrom cgla_graph.comparisons.__main__ import main\nmain()"
    resumed = subprocess.run(
        [sys.executable, "-c", lines, "compare", "--out", "results", "--resume"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert resumed.returncode != 0
    assert "detour.py:Detour: a study does not keep code of your own" in resumed.stderr
    detour.write_text(FILE.replace("tries: int = 20", "tries: int = 21"), encoding="utf-8")
    changed = cgla(*asked, "--resume")
    assert "entrant 'detour.py:Detour' is not the one in the study so far" in changed.err


def test_instances_take_part_with_their_settings() -> None:
    solvers = [Bent(), Bent(over=(0.5, 0.9)), "cgla", cg.solvers.get("cgla", early_stop=False)]
    study = Study(["one-threat"], solvers, tolerance=None)  # type: ignore[list-item]
    labels = [one.label for one in study.entrants]
    assert labels == ["Bent", "Bent:over=(0.5, 0.9)", "cgla", "cgla:early_stop=False"]
    costs = {run.solver: run.solution.cost for run in run_study(study, workers=1)}
    problem = study.scenarios[0].problem
    for label, over in (("Bent", (0.5, 0.5)), ("Bent:over=(0.5, 0.9)", (0.5, 0.9))):
        assert costs[label] == pytest.approx(problem.evaluate([problem.start, over, problem.goal]).cost)
    assert study.entrants[3].is_built_in
    assert not study.entrants[0].is_built_in
    back = entrant_from(entrant_document(study.entrants[1]))
    assert (back.label, back.name) == (study.entrants[1].label, study.entrants[1].name)


@pytest.mark.slow
def test_classes_of_programs_and_notebooks_take_part(tmp_path: Path) -> None:
    program = f"""{FILE.replace('print("imported")', "")}
from cgla_graph.comparisons import Study, run_study
for run in run_study(Study(["one-threat"], [Detour(tries=20), Dies()], tolerance=None), workers=1):
    print(run.solver, run.solution.status.label)
print(cg.solve(cg.load_scenario("one-threat").problem, Dies(), isolated=True).status.label)
"""
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert sorted(found.stdout.split("\n")) == ["", "Detour found", "Dies crashed", "crashed"]


@pytest.mark.parametrize(
    ("text", "name", "says"),
    [
        (None, "none.py:Detour", "no such file"),
        (FILE, "detour.py:Other", "detour.py has no Other; it has bend, Detour, Dies, Sleeps"),
        (FILE, "detour.py:bend", "detour.py: bend is no solver: it has to be a dataclass with traits"),
        (FILE, "detour.py:Detour:attempts=3", "has no setting 'attempts'; it has tries"),
        (FILE, "detour.py:Detour:tries=many", "tries is 'many'; its type is int"),
        ("import no_such_module\n", "detour.py:Detour", "cannot be imported: ModuleNotFoundError"),
        ("raise SystemExit(0)\n", "detour.py:Detour", "cannot be imported: SystemExit"),
        ("class Broken(:\n", "detour.py:Broken", "cannot be imported: SyntaxError"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(detour: Path, text: str | None, name: str, says: str) -> None:
    if text is not None:
        detour.write_text(text, encoding="utf-8")
    with pytest.raises(CglaError) as caught:
        Entrant.parse(name)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_instance_without_known_settings_is_refused() -> None:
    class Plain:
        traits = Traits("plain", "no dataclass", domain="plane")

        def solve(self, problem: cg.Problem) -> cg.Solution:
            return cg.Solution(cg.Status.FOUND, path=[problem.start, problem.goal])

    with pytest.raises(CglaError, match="Plain is no dataclass"):
        Entrant.of(Plain())
    with pytest.raises(CglaError, match="give an instance"):
        Entrant.of(Bent)  # type: ignore[arg-type]


MAPS = """
import cgla_graph as cg

def valley(seed):
    if seed == 13:
        raise ValueError("unlucky")
    return cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.1 * seed, 0.1)]), k=5.0)
"""


def test_study_files_take_patterns_and_functions_of_seeds(tmp_path: Path) -> None:
    (tmp_path / "maps.py").write_text(MAPS, encoding="utf-8")
    for name in ("b", "a"):
        (tmp_path / f"{name}.toml").write_text("start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 1", encoding="utf-8")
    text = 'scenarios = ["*.toml", {generate = "./maps.py:valley", seeds = [3, 7], resolution = 9}]\nsolvers = ["cgla"]'
    study = study_from_toml(text, tmp_path)
    assert [one.name for one in study.scenarios] == ["a", "b", "valley-3", "valley-7"]
    assert study.scenarios[3].problem.field.threats[0].y == pytest.approx(0.7)
    assert study.scenarios[3].lattice.n_points == 81
    for wrong, says in (
        ('["none/*.toml"]', "no file matches 'none/*.toml'"),
        ('[{generate = "./maps.py:hill", seeds = 2}]', "maps.py has no hill; it has valley"),
        ('[{generate = "./maps.py:valley", seeds = [13]}]', "on seed 13: ValueError: unlucky"),
        ('[{generate = "./maps.py:cg", seeds = 1}]', "is no function"),
        ('[{generate = "./maps.py:valley"}]', "seeds"),
    ):
        with pytest.raises(CglaError, match=re.escape(says)):
            study_from_toml(f"scenarios = {wrong}", tmp_path)

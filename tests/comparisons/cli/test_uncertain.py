"""Uncertain risk on the command line: the same numbers as in Python, and what does not go together."""

import dataclasses
import json
from pathlib import Path

import pytest
from command_line import Call

import cgla_graph as cg
from cgla_graph.errors import ScenarioError

MAP = """
start = [0.05, 0.5]
goal = [0.95, 0.5]
k = 8.0
threats = [{ x = 0.5, y = 0.5, spread = 0.1 }]
"""
TWO = """
[[scenarios]]
name = "day"
probability = 0.75
threats = [{ x = 0.5, y = 0.45, spread = 0.1 }]
[[scenarios]]
probability = 0.25
rasters = [{ file = "night.csv", bounds = [0.0, 0.0, 1.0, 1.0] }]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a folder with a map and its scenarios the current one."""
    for name, text in (("map.toml", MAP), ("two.toml", TWO), ("night.csv", "1,2\n3,0\n")):
        (tmp_path / name).write_text(text)
    (tmp_path / "drawn.toml").write_text("[sample]\ncount = 3\nplace = 0.05\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_command_prints_what_python_finds(folder: Path, cgla: Call) -> None:
    """Costs, bound and outlook are those of `cg.solve`; the text names the objective."""
    problem = cg.load_scenario(folder / "map.toml").problem
    field = cg.read_scenarios("two.toml", problem)
    assert field.probabilities == (0.75, 0.25)
    assert [len(one.rasters) for one in field.scenarios] == [0, 1]
    told = json.loads(cgla("plan", "map.toml", "--scenarios", "two.toml", "--objective", "worst", "--json").out)
    found = cg.solve(dataclasses.replace(problem, field=field), objective="worst")
    assert (told["cost"], told["lower_bound"]) == (found.cost, found.lower_bound)
    assert told["uncertain"]["scenario_costs"] == found.costs.tolist()  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", r"neither \[\[scenarios\]\] nor \[sample\]; give one of the two"),
        ("[sample]\nplace = 0.1\n[[scenarios]]\n", "both"),
        ("[sample]\n", "nothing is uncertain"),
        ("adds = true\n[sample]\nplace = 0.1\n", "would count them twice; leave it out"),
        ("[sample]\npeak = 1000.0\n", "sample.peak: give at most 10"),
        ("[[scenarios]]\nprobability = 0.5\n[[scenarios]]\n", "1 of 2 scenarios have a probability"),
        ("[[scenarios]]\nprobability = 0.5\n", "which add up to 0.5"),
        ("coordinates = 'lonlat'\n[[scenarios]]\n", "the map is in the plane"),
        ("[[scenarios]]\nthreats = [{ x = 0.5, y = 0.5 }]\n", "spread"),
        ("[[scenarios]]\nrasters = [{ file = 'no.csv' }]\n", "no.csv"),
        ("[[scenarios]]\nk = 3\n", "unknown key"),
    ],
)
def test_wrong_files_are_refused(folder: Path, text: str, words: str) -> None:
    """The message names the file and the fault."""
    (folder / "wrong.toml").write_text(text)
    with pytest.raises(ScenarioError, match=words):
        cg.read_scenarios("wrong.toml", cg.load_scenario("map.toml").problem)


def test_added_and_drawn_scenarios(folder: Path) -> None:
    """Scenarios replace the map's risk, or are added to it; several files are put together; degrees are named."""
    problem = cg.load_scenario("map.toml").problem
    (folder / "more.toml").write_text("adds = true\n[[scenarios]]\nthreats = [{ x = 0.2, y = 0.2, spread = 0.1 }]\n")
    both = cg.read_scenarios(["more.toml", "more.toml"], problem)
    assert [len(one.threats) for one in both.scenarios] == [2, 2]
    assert cg.read_scenarios("drawn.toml", problem) == cg.sample_field(problem, 3, place=0.05)
    on_earth = cg.Problem.in_degrees((24.0, 60.0), (24.2, 60.0), bounds=(23.9, 59.9, 24.3, 60.1))
    (folder / "earth.toml").write_text("[[scenarios]]\nthreats = [{ x = 24.1, y = 60.0, spread = 500.0 }]\n")
    with pytest.raises(ScenarioError, match="say whether threats are in degrees"):
        cg.read_scenarios("earth.toml", on_earth)
    (folder / "earth.toml").write_text(
        'coordinates = "lonlat"\n[[scenarios]]\nthreats = [{ x = 24.1, y = 60.0, spread = 500.0 }]\n'
    )
    (threat,) = cg.read_scenarios("earth.toml", on_earth).scenarios[0].threats
    assert (threat.x, threat.y) == tuple(on_earth.projection.forward((24.1, 60.0)))  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--objective", "cvar"], "give its scenarios"),
        (["--scenarios", "two.toml", "--pairs", "map.toml"], "--pairs with --scenarios"),
        (["--scenarios", "two.toml", "--objective", "best"], "expected, cvar, worst"),
        (["--scenarios", "two.toml", "--alpha", "0.5"], "--alpha is for --objective cvar"),
        (["--scenarios", "two.toml", "--max-risk", "1"], "--max-risk does not go with"),
        (["--scenarios", "two.toml", "--turn-radius", "0.1"], "--turn-radius does not go with"),
        (["--scenarios", "two.toml", "--objective", "cvar", "--alpha", "2"], "write it with a percent sign"),
        (["--scenarios", "two.toml", "--objective", "cvar", "--alpha", "high"], "such as 1%, or a part"),
        (["--scenarios", "two.toml", "--exceeds", "nan"], "--exceeds is nan"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_options_that_do_not_go_together(options: list[str], words: str, cgla: Call) -> None:
    """One line says which."""
    called = cgla("plan", "map.toml", *options)
    assert called.code == 2
    assert words in called.err


@pytest.mark.slow
def test_solvers_are_compared_under_one_objective(folder: Path, cgla: Call) -> None:
    """Rows are those of `cg.solve`, gaps are to one bound for each alpha, and the paths are drawn."""
    asked = ("compare", "map.toml", "--scenarios", "drawn.toml", "--objective", "cvar", "--alpha", "0,0.9")
    told = json.loads(cgla(*asked, "--solvers", "hybrid,eight-direction", "--out", "results", "--json").out)
    problem = cg.load_scenario("map.toml").problem
    problem = dataclasses.replace(problem, field=cg.read_scenarios("drawn.toml", problem))
    best = cg.solve(problem, objective="cvar", alpha=0.9)
    on_grid = cg.solve(problem, "eight-direction", objective="cvar", alpha=0.9, tolerance=None)
    assert [run["solver"] for run in told["runs"]] == [
        f"{name}, alpha {alpha}" for alpha in ("0", "0.9") for name in ("hybrid", "eight-direction")
    ]
    assert [run["cost"] for run in told["runs"]][2:] == [best.cost, on_grid.cost]
    assert [run["lower_bound"] for run in told["runs"]][2:] == [best.lower_bound] * 2
    assert told["files"] == ["results/map-uncertain.png"]
    for wrong, word in ((["--seeds", "2"], "seeds"), (["--alpha", "0.5,x"], "x"), (["--overwrite"], "overwrite")):
        cgla(*asked[:6], *wrong).refused(word)

"""`cgla plan` of maps that change in time."""

import csv
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from command_line import Call
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.quiver import Quiver
from PIL import Image

import cgla_graph as cg
from cgla_graph.errors import ProblemError, ScenarioError
from cgla_graph.model.solution import Status
from cgla_graph.plots import timed
from cgla_graph.solvers.timed.planning import plan_in_time
from cgla_graph.solvers.timed.teams import solve_team
from cgla_graph.timed.team_plan import TeamPlan
from cgla_graph.timed.timed_plan import TimedPlan

STORM = """
start = [0.1, 0.1]
goal = [0.9, 0.1]
k = 10
speed = 0.5
departure = [0, 2]
[[moving]]
track = [[0, 0.2, 0.8], [3, 0.8, 0.0]]
spread = 0.08
peak = 0.9
[[timed_areas]]
polygon = [[0.45, 0], [0.5, 0], [0.5, 0.9], [0.45, 0.9]]
appears = 0
vanishes = 1.5
"""


@pytest.fixture(autouse=True)
def storm(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """Write the file into the folder of the command, and plan on coarse grids."""
    del cgla
    monkeypatch.setattr(plan_in_time, "__defaults__", (4_000,))
    monkeypatch.setitem(solve_team.__kwdefaults__, "nodes", 4_000)
    Path("storm.toml").write_text(STORM, encoding="utf-8")


def test_the_answer_is_that_of_python_and_written_whole(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timed, "FRAMES", 5)
    found = cgla("plan", "storm.toml", "--out", "out", "--json", "--no-certificate", "--profile", "out/along.csv")
    assert found.code == 0
    document = found.document()
    problem = cg.load_scenario("storm.toml").timed
    assert problem is not None
    seen = problem.evaluate(document["trajectory"])
    assert seen.feasible
    assert [document[name] for name in ("cost", "departure", "risk")] == [seen.cost, seen.departure, seen.risk]
    # what waits for the gate, and what departs at once and dawdles until it opens, cost more
    assert document["cost"] < 0.87
    assert all(cost is None or cost > 0.85 for _, cost in document["departures"])
    names = {Path(file).name for file in document["files"]}
    assert names == {"along.csv"} | {f"storm-space-time.{ending}" for ending in ("csv", "json", "png", "gif")}
    along = list(csv.DictReader(Path("out/along.csv").read_text(encoding="utf-8").splitlines()))
    assert float(along[0]["time"]) == document["departure"]
    assert float(along[-1]["cost"]) == pytest.approx(document["cost"])
    rows = list(csv.reader(Path("out/storm-space-time.csv").read_text(encoding="utf-8").splitlines()))
    np.testing.assert_array_equal(np.array(rows[1:], dtype=float), document["trajectory"])
    with Image.open("out/storm-space-time.gif") as film:
        assert getattr(film, "n_frames", 1) == 5
    assert document["gap"] is None
    Path("calm.toml").write_text(STORM.replace("k = 10", "k = 0"), encoding="utf-8")
    shown = cgla("plan", "calm.toml").out
    assert "the way without risk costs as much" in shown
    assert "0.79999" in shown


@pytest.mark.parametrize(
    "words", [("--max-risk", "1"), ("--solver", "dijkstra"), ("--profile", "a.txt"), ("--proof", "a.proof")]
)
def test_options_that_it_does_not_have_are_refused(cgla: Call, words: tuple[str, str]) -> None:
    answer = cgla("plan", "storm.toml", *words)
    assert answer.code == 2
    assert answer.err.count("\n") == 1
    assert words[0] in answer.err


def test_without_a_flight_it_says_so(cgla: Call) -> None:
    Path("late.toml").write_text(f"latest = 1.0\n{STORM}", encoding="utf-8")
    answer = cgla("plan", "late.toml", "--out", "out", "--no-certificate")
    assert answer.code == 1
    assert "not-found" in answer.out
    assert not list(Path("out").iterdir())


def test_pictures_show_what_there_is_at_each_time() -> None:
    problem = cg.load_scenario("storm.toml").timed
    assert problem is not None
    rows = problem.fly([(0.1, 0.1), (0.9, 0.1)], 1.0)
    curve = np.array([[0.0, 1.2], [1.0, 0.9], [2.0, np.inf]])
    plan = TimedPlan(
        Status.FOUND, rows, cost=1.4, departure=1.0, arrival=float(rows[-1, 0]), departures=curve, problem=problem
    )
    with mpl.rc_context({"backend": "agg"}):
        axes = cg.plot(plan)
        figure = axes.figure
    assert [one.get_title() for one in figure.axes] == [
        "time 1",
        "time 1.8",
        "time 2.6",
        "departs at 1, costs 1.400",
    ]
    # closed at time 1, open at 1.8
    hatched = [any(patch.get_hatch() for patch in one.patches) for one in figure.axes[:3]]
    assert hatched == [True, False, False]
    film = cg.animate(plan, Figure().add_subplot())
    film._draw_was_started = True  # (or matplotlib warns that it was never shown)
    with pytest.raises(ProblemError, match="no flight to draw: not-found"):
        cg.plot(TimedPlan(Status.NOT_FOUND))
    with pytest.raises(ProblemError, match="does not know its problem"):
        cg.animate(TimedPlan(Status.FOUND, rows))


def test_pictures_show_the_wind_of_their_time() -> None:
    wind = cg.Wind([[[0.2, 0.4]], [[-0.4, 0.1]]], [[[0.0, 0.0]], [[0.0, 0.3]]], (0, 0, 1, 0.5), times=[0, 2])
    problem = cg.TimedProblem((0.1, 0.1), (0.9, 0.4), speed=1.0, wind=wind, bounds=(0, 0, 1, 0.5))
    rows = problem.fly([(0.1, 0.1), (0.9, 0.4)])
    plan = TimedPlan(Status.FOUND, rows, cost=1.0, departure=0.0, arrival=float(rows[-1, 0]), problem=problem)
    with mpl.rc_context({"backend": "agg"}):
        figure = cg.plot(plan).figure
    times = [0.0, 0.5 * rows[-1, 0], rows[-1, 0]]
    for axes, time in zip(figure.axes, times, strict=True):
        assert axes.get_title().endswith(", arrows: wind up to 0.4")
        (arrows,) = (one for one in axes.collections if isinstance(one, Quiver))
        places = arrows.get_offsets()
        # (the strongest wind of all times is as long as the arrows are apart)
        apart = np.diff(np.unique(places[:, 0])).min()
        assert np.column_stack([arrows.U, arrows.V]) == pytest.approx(problem.wind_at(places, time) * apart / 0.4)


TEAM = """
k = 2
speed = 1
separation = 0.1
[[uavs]]
name = "east"
start = [0.1, 0.5]
goal = [0.9, 0.5]
[[uavs]]
name = "late"
start = [0.9, 0.5]
goal = [0.1, 0.5]
speed = 2
departure = [0, 1]
"""


def test_a_team_is_planned_drawn_and_written_together(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timed, "FRAMES", 3)
    Path("team.toml").write_text(TEAM, encoding="utf-8")
    answer = cgla("plan", "team.toml", "--out", "out")
    lines = dict(line.split(maxsplit=1) for line in answer.out.splitlines())
    assert "UAV east   costs 0.8" in answer.out
    assert lines["cost"].startswith("1.6")
    assert lines["bound"].startswith("1.59999")
    assert lines["lost"] == "+0.00 % to meetings"
    problems = cg.load_scenario("team.toml").team
    assert [(one.speed, one.departure) for one in problems.values()] == [(1.0, 0.0), (2.0, (0.0, 1.0))]
    rows = list(csv.reader(Path("out/team-team.csv").read_text(encoding="utf-8").splitlines()))
    for name, problem in problems.items():
        assert problem.evaluate([[float(cell) for cell in row[1:]] for row in rows if row[0] == name]).feasible
    with Image.open("out/team-team.gif") as film:
        assert getattr(film, "n_frames", 1) == 3
    refused = cgla("plan", "team.toml", "--start", "0.2,0.2")
    assert (refused.code, "ends of their own" in refused.err) == (2, True)
    refused = cgla("plan", "team.toml", "--profile", "a.csv")
    assert (refused.code, "of one flight" in refused.err) == (2, True)
    assert "cgla plan team.toml" in cgla("fly", "team.toml").err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("separation = 0.1", "", "separation is the least distance between uavs"),
        ('"late"', '"east"', "uavs.1.name is 'east'"),
        ("k = 2", "k = 2\nstart = [0, 0]", "start is there beside uavs"),
        ("[0, 1]", "[1, 0]", "its window ends before it begins"),
        ("goal = [0.1, 0.5]", "goal = [7, 7]", "goal (7.0, 7.0)"),
    ],
)
def test_malformed_teams_are_refused(old: str, new: str, words: str) -> None:
    Path("team.toml").write_text(TEAM.replace(old, new), encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"team.toml: ") as caught:
        cg.load_scenario("team.toml")
    assert words in str(caught.value)


def test_each_uav_of_a_team_is_drawn_while_it_flies() -> None:
    problems = [cg.TimedProblem((0.1, y), (0.9, y), speed=1, departure=0.4 * i) for i, y in enumerate((0.3, 0.7))]
    alone = tuple(cg.solve(problem, nodes=1_000, tolerance=None) for problem in problems)
    team = TeamPlan(Status.FOUND, alone, alone, separation=0.1, names=("a", "b"))
    with mpl.rc_context({"backend": "agg"}):
        shown = cg.plot(team).figure.axes
        middle = cg.plot(team, Figure().add_subplot())
    assert [one.get_title() for one in shown] == ["time 0", "time 0.6", "time 1.2"]
    discs = [[tuple(patch.center) for patch in one.patches if isinstance(patch, Circle)] for one in (*shown, middle)]
    np.testing.assert_allclose(discs[1], [(0.7, 0.3), (0.3, 0.7)], atol=1e-9)
    assert discs[1] == discs[3]
    assert [len(discs[0]), len(discs[2])] == [1, 1]


PASSING = """
start = [0.1, 0.5]
goal = [0.9, 0.5]
k = 2
speed = 1
separation = 0.1
[[others]]
track = [[0.2, 0.9, 0.5], [1.2, -0.1, 0.5]]
"""


def test_others_of_a_file_are_evaded_and_drawn(cgla: Call) -> None:
    Path("passing.toml").write_text(PASSING, encoding="utf-8")
    problem = cg.load_scenario("passing.toml").timed
    assert problem is not None
    answer = cgla("plan", "passing.toml", "--no-certificate")
    lines = dict(line.split(maxsplit=1) for line in answer.out.splitlines())
    assert lines["apart"].startswith("0.1000")
    assert lines["apart"].endswith("; separation 0.1")
    plan = cg.solve(problem, nodes=4_000, tolerance=None)
    with mpl.rc_context({"backend": "agg"}):
        shown = cg.plot(plan).figure.axes
    discs = [[tuple(patch.center) for patch in one.patches if isinstance(patch, Circle)] for one in shown]
    middle = 0.5 * plan.arrival
    assert [len(one) for one in discs] == [1, 2, 2]
    np.testing.assert_allclose(discs[1], [(1.1 - middle, 0.5), plan.at(middle)], atol=1e-9)
    # (beside a team as well, and once)
    problems = [problem, replace(problem, start=(0.1, 0.9), goal=(0.9, 0.9))]
    team = cg.solve_team(problems, 0.1, nodes=1_000, orders=1, tolerance=None)
    with mpl.rc_context({"backend": "agg"}):
        beside = cg.plot(team, Figure().add_subplot())
    assert sum(isinstance(patch, Circle) for patch in beside.patches) == 3
    for old, words in (("separation = 0.1", "separation is the least distance"), ("speed = 1", "others is there")):
        Path("passing.toml").write_text(PASSING.replace(old, ""), encoding="utf-8")
        with pytest.raises(ScenarioError, match=words):
            cg.load_scenario("passing.toml")


def test_solvers_are_compared_as_in_python(cgla: Call) -> None:
    Path("storm.toml").write_text(STORM.replace("departure = [0, 2]", "departure = 0.8"), encoding="utf-8")
    words = ("compare", "storm.toml", "--no-certificate", "--solvers", "space-time-lattice,space-time")
    plans = cgla(*words, "--json").document()["plans"]
    problem = cg.load_scenario("storm.toml").timed
    assert problem is not None
    found = cg.comparisons.compare_in_time(problem, ["space-time-lattice", "space-time"], tolerance=None)
    assert [one["cost"] for one in plans] == [one.cost for one in found]
    assert "space-time-lattice" in cgla(*words).out
    for more in (("--out", "out"), ("--refine",), ("--solvers", "cgla")):
        assert cgla("compare", "storm.toml", *more).code == 2

"""`cgla compare` on missions: the same flight by every solver, with rows that say why where one cannot."""

import csv
import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import plug_ins
import pytest
from command_line import Call, caller
from missions_small import CROSSING, DEGREES

from cgla_graph.comparisons.missions import compare
from cgla_graph.comparisons.report.view import read_state, report_of
from cgla_graph.comparisons.results import study_run
from cgla_graph.comparisons.study import runner
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.flight_run import COLUMNS, ComparedMission, FlightRun
from cgla_graph.comparisons.study.store import load
from cgla_graph.comparisons.study.study import Study, flight_cells
from cgla_graph.comparisons.tables import flights as flight_tables
from cgla_graph.comparisons.workers.tasks import run_tasks
from cgla_graph.errors import CglaError, WorkerError
from cgla_graph.isolation.limits import Limits
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight
from cgla_graph.scenarios.mission_file import MissionFile, load_mission
from cgla_graph.solvers import registry
from cgla_graph.solvers.exact.dijkstra import Dijkstra
from cgla_graph.solvers.solving import solve

#: A rule that only graph solvers can follow.
EXCLUDE = CROSSING.replace('collisions = "record"', 'collisions = "record"\nexclude = "last"')


#: What a comparison of missions leaves in its folder.
MISSION_FILES = {"study.jsonl", "study.jsonl.lock", "report.html", "flights.jsonl", "flights.csv"}


@pytest.fixture
def small(tmp_path: Path) -> MissionFile:
    path = tmp_path / "small.toml"
    path.write_text(CROSSING, encoding="utf-8")
    return load_mission(path)


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """Call the command line in a folder of its own, in this process."""
    for name, text in (("small", CROSSING), ("exclude", EXCLUDE), ("north", DEGREES)):
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    return caller(tmp_path, monkeypatch, capfd)


def flown(folder: str) -> list[dict[str, Any]]:
    """Return what flights came to, but for how long planning took."""
    return [{**flight.row(), "planning_seconds": None} for flight in load(Path(folder)).flights]


def compared(
    missions: list[MissionFile], of: list[Entrant], n_seeds: int = 3, *, workers: int = 0, limits: Limits | None = None
) -> list[FlightRun]:
    """Fly every variant of missions with every entrant."""
    study = Study([], of, range(1, n_seeds + 1), limits=limits or Limits(), missions=missions, mission_entrants=of)
    tasks = compare.flight_tasks(study)
    made = run_tasks(tasks, limits=study.limits, workers=workers, preload=compare.PRELOAD)
    return [flight for _, flight in made]


def entrants(*names: str) -> list[Entrant]:
    return [Entrant.parse(name) for name in names]


def test_a_row_says_what_the_flight_came_to(small: MissionFile) -> None:
    runs = compared([small], entrants("cgla"))
    assert len(runs) == 2
    for run, (variant, mission) in zip(runs, small.missions(registry.get).items(), strict=True):
        flight = mission.fly()
        row = run.row()
        assert tuple(row) == COLUMNS
        assert (row["mission"], row["variant"], row["solver"], row["seed"]) == ("small", variant, "cgla", None)
        assert (row["status"], row["arrived"], row["uavs"], row["message"]) == ("arrived", 2, 2, "")
        assert (row["cost"], row["least_separation"]) == (flight.cost, flight.least_separation)
        assert row["ticks"] == flight.ticks
        assert row["replans"] == sum(len(uav.replans) for uav in flight.uavs.values())
        assert row["planning_seconds"] > 0.0
        assert json.dumps(row, allow_nan=False)


def test_seeds(small: MissionFile) -> None:
    of = entrants("cgla", "prm-star:milestones=60", "prm-star:milestones=60:seed=9")
    alone = dataclasses.replace(small, variants={"alone": small.variants["alone"]})
    runs = compared([alone], of, 2)
    assert [run.seed for run in runs] == [None, 1, 2, 9]
    assert len(list(flight_cells([alone], of, (1, 2)))) == 4
    assert len(list(flight_cells([small], of, (1, 2)))) == 8
    again = [run.row()["cost"] for run in compared([alone], of, 2)]
    assert [run.row()["cost"] for run in runs] == again


@dataclasses.dataclass(frozen=True)
class Angry(Dijkstra):
    """Raises on graphs that are larger than the one it warms up on."""

    def solve(self, problem: Any) -> Any:  # noqa: ANN401 - as its base
        if problem.graph.n_nodes > 30:
            msg = "no\nmore"
            raise RuntimeError(msg)
        return solve(problem, Dijkstra())


def test_a_solver_that_raises_is_a_row(small: MissionFile, monkeypatch: pytest.MonkeyPatch) -> None:
    get = registry.get
    monkeypatch.setattr(registry, "get", lambda name, **how: Angry() if name == "dijkstra" else get(name, **how))
    runs = compared([small], entrants("dijkstra", "cgla"))
    assert [run.status for run in runs] == ["no-path", "arrived"] * 2
    assert runs[0].message == "a: at tick 0: RuntimeError: no"
    assert runs[0].row()["cost"] is None


def test_a_flight_that_raises_is_a_row(small: MissionFile, monkeypatch: pytest.MonkeyPatch) -> None:
    fly = Mission.fly

    def unlucky(self: Mission) -> Flight:
        if self.sharing.is_on and len(self.lattice.points) > 16:
            msg = "no\nmore"
            raise RuntimeError(msg)
        return fly(self)

    monkeypatch.setattr(Mission, "fly", unlucky)
    runs = compared([small], entrants("cgla"))
    assert [(run.status, run.message) for run in runs] == [("arrived", ""), ("failed", "RuntimeError: no")]
    assert runs[1].row()["arrived"] is None
    assert not runs[1].all_arrived


def test_a_solver_that_is_not_installed_is_a_row(small: MissionFile, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "missing", lambda name: "needs luck" if name == "dijkstra" else None)
    runs = compared([small], entrants("dijkstra"))
    assert [(run.status, run.message) for run in runs] == [("unavailable", "needs luck")] * 2


def test_the_usual_pilots_need_nothing_and_are_fast() -> None:
    every = [Entrant.parse(name) for name in registry.names()]
    names = {one.name for one in compare.mission_entrants(every, chosen=False)}
    assert {"cgla", "dijkstra", "hybrid"} <= names
    assert not names & {"networkx", "networkx-astar"}
    assert all(not registry.traits(name).needs for name in names)
    assert compare.mission_entrants(every, chosen=True) == every


def test_missions_are_told_from_maps() -> None:
    maps, missions = study_run.split_specs(["paper", "fig4", "finland", "fig6"])
    assert maps == ["paper", "finland"]
    assert [mission.name for mission in missions] == ["fig4", "fig6"]
    assert study_run.split_specs(["paper"], ["--refine"]) == (["paper"], [])
    with pytest.raises(CglaError, match=r"--refine is for maps, and fig4 is a mission; name refine:base=NAME"):
        study_run.split_specs(["paper", "fig4"], ["--refine"])


# the command


def test_missions_of_one_name_are_told_apart(cgla: Call) -> None:
    for folder, radius in (("one", 0.2), ("two", 0.6)):
        Path(folder).mkdir()
        text = f"detection_radius = {radius}\nuavs = [{{ name = 'a', start = [0.1, 0.1], goal = [0.9, 0.9] }}]\n"
        threat = "threats = [{ x = 0.5, y = 0.5, spread = 0.1 }]\n"
        Path(folder, "mine.toml").write_text(f"{text}{threat}", encoding="utf-8")
    words = ("compare", "one/mine.toml", "two/mine.toml", "one/mine.toml", "--solvers", "cgla")
    rows = cgla(*words, "--json").document()["flights"]
    assert [row["mission"] for row in rows] == ["mine", "mine-2", "mine-3"]
    assert rows[0]["cost"] == rows[2]["cost"] != rows[1]["cost"]
    # a table each, with a line each
    out = cgla(*words).out
    titles = [re.search(rf"^{row['mission']}: .*\n(?:[┏┃┡].*\n)+((?:│.*\n)+)└", out, re.MULTILINE) for row in rows]
    assert [title[1].count("\n") for title in titles if title] == [1, 1, 1]
    assert out.count("│ cgla") == 3


def test_missions_alone(cgla: Call) -> None:
    answer = cgla("compare", "small.toml", "--solvers", "cgla,eight-direction", "--out", "out")
    assert (answer.code, answer.err) == (0, "")
    assert {path.name for path in Path("out").iterdir()} == MISSION_FILES
    lines = [json.loads(line) for line in Path("out/flights.jsonl").read_text(encoding="utf-8").splitlines()]
    with Path("out/flights.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [line["solver"] for line in lines] == ["cgla", "eight-direction"] * 2
    for line, row in zip(lines, rows, strict=True):
        assert tuple(line) == tuple(row) == COLUMNS
        assert {key: "" if value is None else str(value) for key, value in line.items()} == row
    cells = [line for line in answer.out.splitlines() if line.startswith("│")]
    assert len(cells) == 4
    assert answer.out.count("small, alone: two cross") == 1


def test_missions_alone_do_not_warm_up_solvers_for_maps(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "compare", lambda *_, **__: pytest.fail("there is no map"))
    assert cgla("compare", "small.toml", "--solvers", "cgla").code == 0


def test_the_cheapest_stands_first_and_who_did_not_fly_last(small: MissionFile) -> None:
    def like(name: str, arrived: int, cost: float | None, seconds: float = 0.0) -> FlightRun:
        numbers = {"arrived": arrived, "cost": cost, "planning_seconds": seconds}
        return FlightRun("small", "told", name, None, 2, "arrived" if arrived == 2 else "no-path", numbers=numbers)

    runs = [
        FlightRun("small", "told", "failed", None, 2, "failed"),
        like("none", 0, None),
        like("one", 1, None, seconds=9.0),
        like("slow", 2, 1.0, seconds=2.0),
        like("fast", 2, 1.0, seconds=1.0),
    ]
    told = dataclasses.replace(ComparedMission.of(small), variants={"told": 2})
    ((_, _, ordered),) = flight_tables.by_variant([told], runs)
    table = flight_tables.flights_table(told, "told", ordered)
    assert [row[0] for row in table.rows] == ["fast", "slow", "one", "none", "failed"]


def test_maps_and_missions_together(cgla: Call) -> None:
    words = ("compare", "one-threat", "small.toml", "--solvers", "cgla", "--no-certificate", "--pictures", "0")
    answer = cgla(*words, "--json", "--out", "out")
    found = answer.document()
    assert [row["scenario"] for row in found["rows"]] == ["one-threat"]
    assert [(row["mission"], row["variant"]) for row in found["flights"]] == [("small", "alone"), ("small", "told")]
    names = {Path(path).name for path in found["files"]}
    assert {"rows.jsonl", "flights.jsonl", "flights.csv"} <= names
    assert names == {path.name for path in Path("out").iterdir()} - {"study.jsonl.lock"}


def test_a_plane_solver_under_a_rule_of_graphs_says_so(cgla: Call) -> None:
    answer = cgla("compare", "exclude.toml", "--solvers", "cgla,fast-marching")
    assert answer.code == 0
    assert "fast-marching: exclude.toml: variant 'alone': exclude='last' needs a graph solver" in answer.out
    assert cgla("compare", "exclude.toml", "--solvers", "cgla,fast-marching", "--strict").code == 1


def test_a_map_in_degrees(cgla: Call) -> None:
    answer = cgla("compare", "north.toml", "--solvers", "cgla", "--strict")
    assert answer.code == 0
    assert "lengths in m)" in answer.out


@pytest.mark.slow
def test_flights_go_on_where_they_were_stopped(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("compare", "small.toml", "--solvers", "cgla,dijkstra,prm-star:milestones=60", "--seeds", 2, "--out", "out")
    assert cgla(*words).code == 0
    whole = flown("out")
    run, calls = compare._run, iter(range(99))

    def third(*names: Any) -> Any:  # noqa: ANN401 - as `_run`
        if next(calls) == 3:
            raise KeyboardInterrupt
        return run(*names)

    with monkeypatch.context() as patch:
        patch.setattr(compare, "_run", third)
        answer = cgla(*words, "--overwrite")
    assert answer.code == 130
    assert "3 of 8 runs are done and kept in out (cgla compare --resume --out out goes on)" in answer.err
    assert len(Path("out/flights.jsonl").read_text(encoding="utf-8").splitlines()) == 3
    cgla(*words).refused("--resume", "--overwrite")
    made: list[Any] = []
    monkeypatch.setattr(compare, "_run", lambda *names: made.append(names) or run(*names))
    # the mission is found again where it was
    monkeypatch.chdir(Path("out"))
    assert cgla("compare", "--resume", "--out", ".").code == 0
    monkeypatch.chdir(Path(".."))
    assert len(made) == 5
    assert flown("out") == whole


def test_another_mission_of_that_name_is_refused(cgla: Call) -> None:
    cgla("compare", "small.toml", "--solvers", "cgla", "--out", "out")
    path = Path("small.toml")
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("two cross", "another title"), encoding="utf-8")
    assert cgla("compare", "small.toml", "--solvers", "cgla", "--out", "out", "--resume").code == 0
    path.write_text(text.replace("safe_distance = 0.15", "safe_distance = 0.1"), encoding="utf-8")
    for more in (["small.toml", "--solvers", "cgla"], []):
        cgla("compare", *more, "--out", "out", "--resume").refused("mission 'small' is not the one in the study so far")


def test_flights_are_looked_up(cgla: Call) -> None:
    cgla("compare", "small.toml", "one-threat", "--solvers", "cgla,dijkstra", "--pictures", 0, "--out", "out")
    answer = cgla("results", "out")
    assert "2 of 2 runs, 4 of 4 flights, complete" in answer.out
    assert answer.out.count("small, alone: two cross") == 1
    found = cgla("results", "out", "--scenario", "small", "--solver", "dij*", "--json").document()["flights"]
    assert [(row["variant"], row["solver"]) for row in found] == [("alone", "dijkstra"), ("told", "dijkstra")]
    assert cgla("results", "out", "--scenario", "one-threat", "--json").document()["flights"] == []
    cgla("results", "out", "--scenario", "big").refused("unknown scenario 'big'", "small")


def test_the_report_shows_flights(cgla: Call) -> None:
    Path("odd.toml").write_text(CROSSING.replace("two cross", "<script>alert(1)</script>"), encoding="utf-8")
    answer = cgla("compare", "odd.toml", "--solvers", "cgla,straight-line", "--out", "out")
    assert answer.code == 0
    page = Path("out/report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page
    section = page[page.index('<section id="missions"') : page.index('<section id="ranking"')]
    assert section.count("<svg") == 4
    # a line a UAV
    assert section.count("<polyline") == 8
    assert "4 of 4 flights are done" in section
    stored = load(Path("out"))
    for flight in stored.flights:
        assert {track.uav for track in flight.tracks} == {"a", "b"}
        assert flight.tracks[0].path[0] == [0.1, 0.1]
    state = read_state(Path("out"))
    assert (state.runs, state.cells, state.complete) == (4, 4, True)
    assert '"runs":4' in report_of(Path("out")).text


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["small.toml", "--refine"], ["--refine", "small", "refine:base=NAME"]),
        (["small.toml", "--start", "0,0"], ["--start is for maps"]),
        (["paper", "small.toml", "--resolution", "9"], ["--resolution is for maps"]),
        (["small.toml", "--solvers", "cgl"], ["cgl"]),
        (["small.toml", "fig88"], ["fig88"]),
    ],
    ids=" ".join,
)
def test_bad_words(cgla: Call, words: list[str], said: list[str]) -> None:
    cgla("compare", *words, "--out", "out").refused(*said)
    assert not Path("out").exists()


@pytest.mark.slow
def test_flights_in_processes_of_their_own_are_the_same(small: MissionFile) -> None:
    of = [Entrant.parse("cgla"), Entrant.parse("eight-direction")]
    here = {(run.variant, run.solver): run.row() for run in compared([small], of)}
    far = {(run.variant, run.solver): run.row() for run in compared([small], of, workers=2)}
    assert here.keys() == far.keys()
    for key, row in here.items():
        assert {**row, "planning_seconds": 0} == {**far[key], "planning_seconds": 0}


@pytest.mark.slow
def test_a_flight_that_takes_too_long_is_a_row(small: MissionFile) -> None:
    limits = Limits(seconds=1e-3)
    runs = compared([small], [Entrant.parse("cgla")], workers=1, limits=limits)
    assert {run.status for run in runs} == {"timed-out"}
    assert "stopped after 0.001 s" in runs[0].message
    assert not runs[0].all_arrived


def test_a_flight_whose_solver_lacks_a_package_is_no_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One whose solver raises is."""
    plug_ins.install(tmp_path, monkeypatch)
    fig4 = load_mission("fig4")
    lacking, failing = (Entrant.parse(f"lacks:note={error!r}") for error in ("ModuleNotFoundError(1)", "ValueError(2)"))
    study = Study([], [], missions=[fig4], mission_entrants=[lacking, failing])
    made = run_tasks(compare.flight_tasks(study), limits=Limits(), workers=0)
    flights: list[FlightRun] = []
    with pytest.raises(WorkerError, match="ModuleNotFoundError: 1"):
        flights.extend(flight for _, flight in made)
    assert {flight.solver for flight in flights} == {failing.label}
    assert "ValueError: 2" in flights[0].message

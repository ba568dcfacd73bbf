"""The clock of a solver's run starts when its kernels are compiled."""

import subprocess
import sys
from pathlib import Path

import pytest
import shapely
from kept_kernels import kept_but_for

from cgla_graph import _kernel
from cgla_graph.comparisons import console
from cgla_graph.model.cost_model import CostModel, MapKind
from cgla_graph.model.problem import Problem
from cgla_graph.model.small_problem import small_field
from cgla_graph.model.solution import Solution
from cgla_graph.solvers import registry, warm_up
from cgla_graph.solvers.continuous.hybrid import Hybrid

# Compiling is an event of numba's. Nothing is compiled while a run or a proof is timed, though kernels are missing on
# disk.
WATCHED = """
import sys, time
import numba.core.event as events

compiled = []

class Listener(events.Listener):
    def on_start(self, event): compiled.append(time.perf_counter())
    def on_end(self, event): compiled.append(time.perf_counter())

events.register("numba:compile", Listener())
import cgla_graph as cg

problem = cg.load_scenario("one-threat").problem
for solve in (
    lambda: cg.lower_bound(problem, 0.05).seconds,
    lambda: cg.solve(problem, "hybrid", tolerance=None).seconds,
    lambda: cg.solve(problem, "cgla").build_seconds,
):
    compiled.clear()
    solve_began = time.perf_counter()
    seconds = solve()
    ended = time.perf_counter()
    total = ended - solve_began
    # the time that compiling took
    compiling = compiled[-1] - compiled[0] if compiled else 0.0
    print(seconds, total - compiling + 1.0, compiling)
"""


@pytest.mark.slow
def test_no_time_holds_any_compiling(tmp_path: Path) -> None:
    missing = (
        "certificate_kernels.steepness",
        "refine_kernels.minimise",
        "refine_kernels.shortcut",
        "graph_kernels.complete",
    )
    environment = kept_but_for(*missing, at=tmp_path / "kernels")
    done = subprocess.run([sys.executable, "-c", WATCHED], env=environment, capture_output=True, text=True, check=True)
    times = [tuple(map(float, line.split())) for line in done.stdout.splitlines()]
    assert len(times) == 3
    # the first one compiles most
    assert times[0][2] > 1.0
    assert all(seconds < rest for seconds, rest, _ in times)


# Which kernels have been loaded: those that a warm-up loads, and those that the work then needs besides.
LOADED = """
import sys
import cgla_graph as cg
from cgla_graph._kernel import _Kernel
from cgla_graph.certificate.certificate import load_kernels
from cgla_graph.solvers.continuous.hybrid import Hybrid
from cgla_graph.model.cost_model import MapKind
from cgla_graph.solvers.warm_up import warm_up

def loaded():
    modules = [module for name, module in sys.modules.items() if name.endswith("_kernels")]
    kernels = {id(it): it for module in modules for it in vars(module).values() if isinstance(it, _Kernel)}
    return {(it.__module__, it.__name__, types) for it in kernels.values() for types in it._runs}

problem = cg.load_scenario(sys.argv[1]).problem
kind = MapKind.of(problem.model)
warm_up(Hybrid(tolerance=None), kind)
load_kernels(kind)
before = loaded()
path = cg.solve(problem, "hybrid", tolerance=None).path
cg.lower_bound(problem, 0.01, path=path)
of_some = {"add_rasters", "charge", "pair_sectors"}
print(*kind, sorted(loaded() - before), sorted({name for _, name, _ in before} & of_some))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scenario", "loaded"),
    [
        ("paper", "False False [] []"),
        ("thin-wall", "True False [] ['charge', 'pair_sectors']"),
        ("rasters", "False True [] ['add_rasters']"),
    ],
)
def test_what_the_work_needs_is_loaded_before_it(scenario: str, loaded: str, tmp_path: Path) -> None:
    """Kernels that only walls, or only rasters, need are not loaded where there are none."""
    if scenario == "rasters":
        threats, scenario = "threats = [{x = 5, y = 5, spread = 1}]", str(tmp_path / "a.toml")
        rasters = "".join(f"\n[[rasters]]\nfile = 'a.asc'\ninterpolation = '{how}'" for how in ("bilinear", "nearest"))
        Path(scenario).write_text(f"start = [1, 1]\ngoal = [9, 8]\nk = 3\n{threats}{rasters}\n")
        (tmp_path / "a.asc").write_text("ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 5\n0.1 0.2\n0.3 0.1\n")
    done = subprocess.run([sys.executable, "-c", LOADED, scenario], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == loaded


def test_what_was_loaded_for_walls_is_not_taken_for_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solvers do other things on maps without walls: `hybrid` marches over a grid."""
    monkeypatch.setattr(warm_up, "_ready", set())
    runs: list[bool] = []
    own = Hybrid.solve

    def watched(self: Hybrid, problem: Problem) -> Solution:
        runs.append(problem.model.area.is_empty)
        return own(self, problem)

    monkeypatch.setattr(Hybrid, "solve", watched)
    for kind in (MapKind(walls=True), MapKind(), MapKind(walls=True)):
        warm_up.warm_up(Hybrid(tolerance=None), kind)
    assert runs == [False, True]


OF_OTHERS = """
from cgla_graph.model.no_fly_kernels import segments_cross
from cgla_graph.model.risk_kernels import segment_risks
from cgla_graph.model.cost_model import MapKind
from cgla_graph.solvers.warm_up import warm_up

class Own:
    def solve(self, problem):
        print("never run here")

warm_up(Own(), MapKind(walls=True))
print(len(segment_risks._runs), len(segments_cross._runs))
"""


def test_what_evaluates_paths_is_loaded_for_solvers_of_others_too() -> None:
    done = subprocess.run([sys.executable, "-c", OF_OTHERS], capture_output=True, text=True, check=True)
    assert done.stdout == "1 1\n"


@pytest.mark.slow
@pytest.mark.parametrize("kind", [[], ["walls"], ["rasters"]])
def test_the_process_that_compiles_beside_ends_well(kind: list[str]) -> None:
    """It prints nothing."""
    command = [sys.executable, "-c", console._COMPILE, "\n".join(sys.path), *kind]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


WALL, RASTERS = CostModel(no_fly=shapely.box(0, 0, 1, 1)), CostModel(small_field(MapKind(rasters=True)))


class Helper:
    """Stands for the second process, and notes what happens to it."""

    def __init__(self, command: list[str], **_: object) -> None:
        self.kind, self.done = command[4:], list[str]()

    def kill(self) -> None:
        self.done.append("killed")

    def wait(self, _: float) -> None:
        self.done.append("waited for")


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[Helper]:
    """List the second processes that are started, while every kernel is missing."""
    started: list[Helper] = []
    monkeypatch.setattr(subprocess, "Popen", lambda *words, **how: started.append(Helper(*words, **how)) or started[-1])
    monkeypatch.setattr(_kernel, "is_kept", lambda *_: False)
    return started


@pytest.mark.parametrize(
    ("models", "kind"),
    [
        ([], None),
        ([CostModel()], []),
        ([CostModel(), WALL], ["walls"]),
        ([RASTERS], ["rasters"]),
        ([WALL, RASTERS], ["walls", "rasters"]),
    ],
)
def test_the_process_that_compiles_beside_is_one_for_all_maps(
    models: list[CostModel], kind: list[str] | None, started: list[Helper]
) -> None:
    with console.running_solvers(models):
        assert [one.kind for one in started] == ([] if kind is None else [kind])
    assert all(one.done == ["waited for"] for one in started)


@pytest.mark.parametrize(
    ("error", "done"), [(ValueError, ["waited for"]), (KeyboardInterrupt, ["killed", "waited for"])]
)
def test_the_process_that_compiles_beside_is_killed_by_ctrl_c_only(
    error: type[BaseException], done: list[str], started: list[Helper]
) -> None:
    """Kernels that it has compiled half would be missing the next time, too."""
    with pytest.raises(error), console.running_solvers([CostModel()]):
        raise error
    assert [one.done for one in started] == [done]


# Two plans on a graph, for which the processes count that are started.
COUNTED = """
import subprocess, sys
from unittest.mock import Mock
subprocess.Popen = started = Mock()
from cgla_graph.comparisons.cli.app import main
try:
    main()
finally:
    print(started.call_count)
"""


@pytest.mark.parametrize(
    ("missing", "said"),
    [
        (("certificate_kernels.", "corner_kernels."), [0]),
        pytest.param(("graph_kernels.label_setting",), [1, 0], marks=pytest.mark.slow),
    ],
)
def test_compiling_is_announced_on_graphs_if_their_kernels_are_missing(
    missing: tuple[str, ...], said: list[int], tmp_path: Path
) -> None:
    """Kernels of proofs are not needed there; each is compiled in the process that needs it."""
    (tmp_path / "g.csv").write_text("source,target,weight\na,b,1\nb,c,2\n")
    environment = kept_but_for(*missing, at=tmp_path / "kernels")
    words = ["graph", "plan", str(tmp_path / "g.csv"), "--from", "a", "--to", "c"]
    command = [sys.executable, "-c", COUNTED, *words]
    runs = [subprocess.run(command, env=environment, capture_output=True, text=True, check=True) for _ in said]
    assert [run.stderr.count("compiling kernels") for run in runs] == said
    assert [run.stdout.splitlines()[-1] for run in runs] == ["0"] * len(said)


@pytest.mark.parametrize("name", registry.names())
def test_every_solver_is_run_once_and_briefly(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second time does nothing, and solvers that may crash are not run here."""
    monkeypatch.setattr(warm_up, "_ready", set())
    solver = registry.get(name)
    runs: list[object] = []
    own = type(solver).solve

    def watched(self: object, problem: object) -> object:
        runs.append(own(self, problem))
        return runs[-1]

    monkeypatch.setattr(type(solver), "solve", watched)
    for _ in range(2):
        warm_up.warm_up(solver, MapKind(walls=True))
    assert len(runs) == (0 if solver.traits.isolated else 1)


def test_limits_of_a_short_run_are_small_and_other_settings_stay() -> None:
    solver = registry.get("bit-star", iterations=10**8, evaluations=5, seed=3)
    short = warm_up.shortened(solver)
    assert (short.iterations, short.seconds, short.evaluations, short.seed) == (200, 0.5, 5, 3)


@pytest.mark.parametrize(("asked", "short"), [(1e-6, 0.1), (None, None)])
def test_a_narrow_gap_is_not_proven_on_the_small_problem(asked: float | None, short: float | None) -> None:
    # (at 1e-4, its proof among areas took 16 s of CPU time, once in each process)
    assert warm_up.shortened(registry.get("hybrid", tolerance=asked)).tolerance == short

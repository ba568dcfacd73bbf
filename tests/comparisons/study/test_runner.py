"""The runner: entrants, seeds, the shared graph, and solvers that misbehave."""

import dataclasses
import math
import signal
import sys
import types
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import pytest

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study import runner
from cgla_graph.comparisons.study.entrant import Entrant, every_solver
from cgla_graph.comparisons.study.rows import row, rows_of
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.errors import ProblemError
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Solver, Traits
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.scenario import Scenario, load_scenario, scenario_from_toml
from cgla_graph.solvers import listing, registry
from cgla_graph.solvers.continuous.hybrid import Hybrid
from cgla_graph.solvers.solving import solve

SMALL = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 5.0\nthreats = [{ x = 0.5, y = 0.5, spread = 0.1 }]\n"
LATTICE = "[lattice]\nresolution = 6\n"
WALL = "[no_fly]\npolygons = [[[0.45, -0.1], [0.55, -0.1], [0.55, 0.8], [0.45, 0.8]]]\n"
#: Settings that make runs short, where a solver has them.
QUICK = {"iterations": 200, "milestones": 100, "samples": 100}

Enter = Callable[..., str]


def small(name: str = "small", more: str = "") -> Scenario:
    return scenario_from_toml(SMALL + LATTICE + more, name)


def quick(name: str) -> str:
    if name not in registry.names():
        return name
    known = registry.setting_names(registry.solver_class(name))
    return ":".join([name, *(f"{key}={value}" for key, value in QUICK.items() if key in known)])


def entrants(*texts: str) -> list[Entrant]:
    return [Entrant.parse(quick(text)) for text in texts]


def runs_of(scenarios: list[Scenario], *texts: str, seeds: int = 1, tolerance: float | None = None) -> list[Run]:
    return list(compare(scenarios, entrants(*texts), seeds, tolerance=tolerance))


def straight(problem: Problem) -> Solution:
    path = np.array([problem.start, problem.goal])
    return Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost)


@pytest.fixture
def enter(monkeypatch: pytest.MonkeyPatch) -> Enter:
    """Enter a function as a solver into the registry."""
    shelf = types.ModuleType("shelf_of_a_test")
    monkeypatch.setitem(sys.modules, shelf.__name__, shelf)

    def put(solve: Callable[[Any], Any], *, domain: Literal["graph", "plane"] = "plane", **traits: Any) -> str:  # noqa: ANN401 - any trait
        @dataclasses.dataclass(frozen=True)
        class Own:
            traits: ClassVar[Traits] = Traits("own", "a test's own", domain=domain)

            def solve(self, problem: Any) -> Any:  # noqa: ANN401 - what the test wants
                return solve(problem)

        Own.traits = dataclasses.replace(Own.traits, **traits)
        vars(shelf)["Own"] = Own
        monkeypatch.setattr(registry, "_BUILT_IN", {**registry._BUILT_IN, "own": f"{shelf.__name__}:Own"})
        return "own"

    return put


# Order and seeds


def test_runs_come_scenario_by_scenario_with_seeds_from_one() -> None:
    pytest.importorskip("ompl")
    runs = runs_of([small("a"), small("b")], "straight-line", "rrt-star", "cgla", seeds=2)
    label = quick("rrt-star")
    of_one = [("straight-line", None), (label, 1), (label, 2), ("cgla", None)]
    assert [(run.scenario.name, run.solver, run.seed) for run in runs] == [(n, *one) for n in "ab" for one in of_one]


def test_a_seed_of_the_users_own_is_the_only_one() -> None:
    pytest.importorskip("ompl")
    own = runs_of([small()], "rrt-star:iterations=200:seed=2", seeds=3)
    assert [run.seed for run in own] == [2]
    second = runs_of([small()], "rrt-star", seeds=2)[1]
    np.testing.assert_array_equal(own[0].solution.path, second.solution.path)


def test_a_seed_of_the_scenario_counts() -> None:
    pytest.importorskip("ompl")
    own = runs_of([small(more="[solvers.rrt-star]\nseed = 5\n")], "rrt-star")
    users = runs_of([small()], "rrt-star:iterations=200:seed=5")
    np.testing.assert_array_equal(own[0].solution.path, users[0].solution.path)


def test_runs_are_lazy(enter: Enter) -> None:
    calls = []
    name = enter(lambda problem: calls.append(1) or straight(problem))
    runs = compare([small("a"), small("b")], entrants(name), tolerance=None)
    assert calls == []
    next(runs)
    assert calls == [1]


def test_settings_of_the_scenario_are_used_and_those_of_the_user_win() -> None:
    scenario = small(more='[solvers.cgla]\nschedule = "synchronous"\n')
    own, users = runs_of([scenario], "cgla", "cgla:schedule=label-setting")
    assert own.solution.message != users.solution.message, "rounds are counted differently"
    assert own.solution.cost == pytest.approx(users.solution.cost, rel=1e-12)


@pytest.mark.slow
def test_the_same_again() -> None:
    first, second = (runs_of([small()], *registry.names(), seeds=2) for _ in range(2))
    for one, two in zip(first, second, strict=True):
        assert (one.solver, one.seed, one.solution.status) == (two.solver, two.seed, two.solution.status)
        np.testing.assert_array_equal(one.solution.path, two.solution.path)
        assert one.solution.cost == two.solution.cost


# The shared graph


@pytest.fixture
def laid(monkeypatch: pytest.MonkeyPatch) -> list[GraphProblem]:
    """Collect every lattice that is laid for a scenario, the warm-up's left out."""
    found: list[GraphProblem] = []
    lay = Problem.on_lattice

    def on_lattice(problem: Problem, *args: Any, **more: Any) -> GraphProblem:  # noqa: ANN401 - as the method
        answer = lay(problem, *args, **more)
        if answer.graph.n_nodes > 4:
            found.append(answer)
        return answer

    monkeypatch.setattr(Problem, "on_lattice", on_lattice)
    return found


GRAPH_SOLVERS = ["cgla", "dijkstra", "networkx", "networkx-astar"]


@pytest.mark.parametrize("name", ["small", "walled", "paper"])
def test_costs_are_the_same_whether_the_graph_is_shared_or_not(name: str, laid: list[GraphProblem]) -> None:
    scenario = load_scenario("paper") if name == "paper" else small(more=WALL if name == "walled" else "")
    runs = runs_of([scenario], *GRAPH_SOLVERS)
    assert len(laid) == 1
    for run in runs:
        alone = solve(scenario.problem, run.solver, resolution=scenario.lattice)
        assert run.solution.cost == alone.cost
        assert run.solution.evaluations == alone.evaluations
        np.testing.assert_array_equal(run.solution.path, alone.path)
    assert len(laid) == 1 + len(runs)


def test_no_graph_is_laid_for_plane_solvers(laid: list[GraphProblem]) -> None:
    runs_of([small()], "straight-line", "eight-direction")
    assert laid == []


def test_scenarios_that_differ_share_nothing(laid: list[GraphProblem]) -> None:
    scenarios = [small("a"), small("b", WALL), scenario_from_toml(SMALL.replace("5.0", "6.0") + LATTICE, "c")]
    together = runs_of(scenarios, "cgla")
    assert len(laid) == 3
    alone = [runs_of([scenario], "cgla")[0] for scenario in scenarios]
    assert [run.solution.cost for run in together] == [run.solution.cost for run in alone]


def write_rows(folder: Path, ends: list[str]) -> Path:
    (folder / "tiny.map").write_text("type octile\nheight 4\nwidth 5\nmap\n.....\n.@@@.\n.....\n.....\n")
    file = folder / "tiny.map.scen"
    file.write_text("version 1\n" + "".join(f"0 tiny.map 5 4 {end} 1\n" for end in ends))
    return file


def test_rows_of_one_map_share_the_graph(tmp_path: Path, laid: list[GraphProblem]) -> None:
    file = write_rows(tmp_path, ["0 0 4 3", "0 3 4 0", "2 0 2 2", "4 3 0 0"])
    scenarios = list(open_scenarios(str(file)))
    together = runs_of(scenarios, "cgla", "dijkstra")
    assert len(laid) == 1
    for run in together:
        alone = solve(run.scenario.problem, run.solver, resolution=run.scenario.lattice)
        assert run.solution.cost == alone.cost
        problem = run.scenario.problem
        np.testing.assert_array_equal(run.solution.path[[0, -1]], [problem.start, problem.goal])


def test_a_row_off_the_lattice_between_others(tmp_path: Path) -> None:
    file = write_rows(tmp_path, ["0 0 4 3", "0 3 4 0"])
    first, last = open_scenarios(str(file))
    moved = dataclasses.replace(first.problem, start=(0.25, 0.25))
    between = dataclasses.replace(first, name="between", problem=moved)
    for run in runs_of([first, between, last], "cgla"):
        alone = solve(run.scenario.problem, "cgla", resolution=run.scenario.lattice)
        assert run.solution.cost == alone.cost


# Start is goal, and no path


@pytest.mark.slow
def test_start_equal_to_goal_is_an_answer_of_every_solver() -> None:
    scenario = scenario_from_toml(SMALL.replace("0.9, 0.9", "0.1, 0.1") + LATTICE + WALL, "stay")
    for run in runs_of([scenario], *registry.names()):
        solution = run.solution
        assert solution.status.has_path, run.solver
        assert (solution.cost, solution.length, solution.risk) == (0.0, 0.0, 0.0)
        assert solution.path.tolist() == [[0.1, 0.1]]
        assert solution.clearance == pytest.approx(0.35)


def test_start_equal_to_goal_on_a_graph() -> None:
    graph = small().problem.on_lattice(3).graph
    for name in GRAPH_SOLVERS:
        solution = solve(GraphProblem(graph, 4, 4), name)
        assert (solution.status.has_path, solution.cost, list(solution.nodes)) == (True, 0.0, [4])


@pytest.mark.slow
def test_where_no_path_exists_every_solver_says_so() -> None:
    shut = WALL.replace("0.8", "1.1")
    for run in runs_of([small(more=shut)], *registry.names()):
        # only a whole graph can be searched to its end
        whole = not run.seed and registry.traits(run.solution.solver).domain == "graph"
        said = {"no-path"} if whole else {"no-path", "not-found"}
        if not registry.traits(run.solution.solver).complete:
            said.add("stuck")
        assert run.solution.status.label in ({"infeasible"} if run.solver == "straight-line" else said), run.solver
        assert not run.solution.status.has_path
        assert not len(run.solution.path) or run.solver == "straight-line"


# Solvers that misbehave


def raise_lines(_: Problem) -> Solution:
    msg = "one [bold]line[/bold]\nand another"
    raise ValueError(msg)


def raise_own(_: Problem) -> Solution:
    msg = "not like this"
    raise ProblemError(msg)


def with_path(points: Any, cost: float = 1.0) -> Callable[[Problem], Solution]:  # noqa: ANN401 - that is the point
    return lambda _: Solution(Status.FOUND, path=points, cost=cost)


def recurse(problem: Problem) -> Solution:
    return recurse(problem)


THROUGH = [(0.1, 0.1), (0.9, 0.9)]
MISBEHAVIOUR = {
    "raises": (raise_lines, "failed", "ValueError: one [bold]line[/bold]"),
    "raises an error of ours": (raise_own, "failed", "not like this"),
    "divides by zero": (lambda _: 1 / 0, "failed", "ZeroDivisionError"),
    "recurses": (recurse, "failed", "RecursionError"),
    "runs out of memory": (lambda _: np.empty(2**57), "out-of-memory", "allocate"),
    "returns nothing": (lambda _: None, "failed", "NoneType"),
    "returns a number": (lambda _: 3.0, "failed", "float"),
    "lies": (lambda p: dataclasses.replace(straight(p), cost=1e-3), "failed", "0.001"),
    "says nan": (lambda p: dataclasses.replace(straight(p), cost=math.nan), "failed", "nan"),
    "nan in the path": (with_path([(0.1, 0.1), (math.nan, 0.5), (0.9, 0.9)]), "failed", "finite"),
    "infinity in the path": (with_path([(0.1, 0.1), (math.inf, 0.5), (0.9, 0.9)]), "failed", "finite"),
    "an empty path": (with_path(np.empty((0, 2))), "failed", "shape"),
    "three dimensions": (with_path(np.zeros((4, 3))), "failed", "(4, 3)"),
    "a ragged path": (with_path([(0.1, 0.1), (0.9,)]), "failed", "inhomogeneous"),
    "the other way round": (with_path(THROUGH[::-1]), "failed", "start and goal"),
    "elsewhere": (with_path([(0.2, 0.2), (0.9, 0.9)]), "failed", "start and goal"),
    "claims a bound above its cost": (lambda p: dataclasses.replace(straight(p), lower_bound=1e9), "failed", "1e+09"),
    "exits": (lambda _: sys.exit(3), "failed", "SystemExit: 3"),
    "out of bounds": (with_path([(0.1, 0.1), (-5.0, -5.0), (0.9, 0.9)]), "infeasible", "leaves the bounds"),
}


@pytest.mark.parametrize("how", MISBEHAVIOUR)
def test_a_solver_that_misbehaves_is_a_row(how: str, enter: Enter) -> None:
    misbehave, status, words = MISBEHAVIOUR[how]
    bad, good = runs_of([small()], enter(misbehave), "cgla")
    assert (bad.solution.status.label, good.solution.status.label) == (status, "optimal")
    assert words in bad.solution.message
    assert "\n" not in bad.solution.message
    assert row(bad)["status"] == status
    # what it claims to cost is never reported
    assert bad.solution.cost not in {1.0, 1e-3}


@pytest.mark.parametrize("cost", [0.1, 1.0, math.nan])
def test_a_path_through_a_wall_is_infeasible_at_any_claimed_cost(enter: Enter, cost: float) -> None:
    bad, good = runs_of([small(more=WALL)], enter(with_path(THROUGH, cost)), "cgla")
    assert (bad.solution.status.label, good.solution.status.label) == ("infeasible", "optimal")
    assert "crosses the no-fly area" in bad.solution.message


@pytest.mark.parametrize(
    ("nodes", "status", "words"),
    [
        (lambda _: (), "failed", "no nodes"),
        (lambda p: (p.source, 10**9, p.target), "failed", "1000000000 is not in the graph"),
        (lambda p: (p.source, [1], p.target), "failed", "not in the graph"),
        (lambda p: (p.target, p.source), "failed", "the path joins"),
        (lambda p: (p.source, p.target), "infeasible", "an edge that is not there"),
    ],
)
def test_a_graph_solver_that_misbehaves_is_a_row(
    enter: Enter, nodes: Callable[[GraphProblem], Any], status: str, words: str
) -> None:
    name = enter(lambda p: Solution(Status.OPTIMAL, nodes=nodes(p), cost=1.0), domain="graph", exact=True)
    bad, good = runs_of([small(more=WALL)], name, "cgla")
    assert (bad.solution.status.label, good.solution.status.label) == (status, "optimal")
    assert words in bad.solution.message


def test_a_graph_solver_cannot_spoil_the_shared_graph(enter: Enter) -> None:
    def spoil(problem: GraphProblem) -> Solution:
        problem.graph.weight_matrix()[:] = 0.0
        return Solution(Status.NO_PATH)

    bad, good = runs_of([small()], enter(spoil, domain="graph"), "cgla")
    assert (bad.solution.status.label, "read-only" in bad.solution.message) == ("failed", True)
    assert good.solution.cost == runs_of([small()], "cgla")[0].solution.cost


def test_an_interrupt_is_no_failure_of_the_solver(enter: Enter) -> None:
    name = enter(lambda _: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        runs_of([small()], name)


def test_a_warning_of_a_solver_is_no_failure(enter: Enter) -> None:
    name = enter(lambda p: warnings.warn("careful", stacklevel=1) or straight(p))
    with pytest.warns(UserWarning, match="careful"):
        (run,) = runs_of([small()], name)
    assert run.solution.status is Status.FOUND


def test_a_list_is_a_path_like_any_other(enter: Enter) -> None:
    (run,) = runs_of([small()], enter(lambda p: dataclasses.replace(straight(p), path=[p.start, p.goal])))
    assert run.solution.status is Status.FOUND
    assert isinstance(run.solution.path, np.ndarray)


# Missing packages


def test_a_solver_that_lacks_a_package_is_a_row(enter: Enter) -> None:
    name = enter(straight, needs=("no_such_package_of_anyone",))
    bad, good = runs_of([small()], name, "cgla")
    assert (bad.solution.status.label, good.solution.status.label) == ("unavailable", "optimal")
    assert "no_such_package_of_anyone" in bad.solution.message
    assert "pip install" in bad.solution.message


def test_a_plug_in_that_cannot_be_imported_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_BUILT_IN", {"cgla": registry._BUILT_IN["cgla"]})
    point = types.SimpleNamespace(name="broken", value="nowhere:Solver", load=lambda: __import__("nowhere_at_all"))
    monkeypatch.setattr(listing, "entry_points", lambda **_: [point])
    runs = list(compare([small()], every_solver(), 1, tolerance=None))
    assert [run.solution.status.label for run in runs] == ["optimal", "unavailable"]


# The lower bound


Bounds = Callable[[Callable[[Problem], float]], list[Problem]]


@pytest.fixture
def bounds(monkeypatch: pytest.MonkeyPatch) -> Bounds:
    """Replace the proof of lower bounds; what it is asked for is collected."""

    def put(bound: Callable[[Problem], float]) -> list[Problem]:
        asked: list[Problem] = []

        def prove(problem: Problem, _path: object, *, tolerance: float) -> Certificate:
            asked.append(problem)
            return Certificate(bound(problem), 2.0, tolerance, 0.1, 7, "a test's own", 0.1)

        monkeypatch.setattr(runner, "warm_up_proof", lambda _: None)
        monkeypatch.setattr(runner, "prove", prove)
        return asked

    return put


def test_every_run_has_the_bound_of_its_scenario_as_soon_as_it_is_done(bounds: Bounds, enter: Enter) -> None:
    calls: list[int] = []
    asked = bounds(lambda _: 0.5 + len(asked) / 10)
    name = enter(lambda problem: calls.append(len(asked)) or straight(problem))
    scenarios = [small("a"), small("b")]
    runs = compare(scenarios, entrants("cgla", name, "straight-line"), tolerance=0.1)
    for number, run in enumerate(runs):
        where = number // 3
        assert len(asked) == where + 1, "one proof a scenario, before its solvers"
        assert run.certificate is not None
        assert run.certificate.lower_bound == 0.6 + where / 10
        assert run.certificate.tolerance == 0.1
        found = row(run)
        assert found["lower_bound"] >= run.certificate.lower_bound
        assert found["gap"] == pytest.approx(found["cost"] / found["lower_bound"] - 1.0)
    assert asked == [scenario.problem for scenario in scenarios]
    assert calls == [1, 2]


def test_a_bound_can_be_left_out(bounds: Bounds) -> None:
    asked = bounds(lambda _: 1.0)
    (run,) = runs_of([small()], "cgla", tolerance=None)
    assert (asked, run.certificate, row(run)["gap"]) == ([], None, None)


@pytest.mark.parametrize("own", [0.9, 1.1, math.nan])
def test_a_solver_that_claims_more_gets_the_proven_bound(bounds: Bounds, enter: Enter, own: float) -> None:
    bounds(lambda _: 1.0)
    name = enter(lambda p: dataclasses.replace(straight(p), lower_bound=own))
    bad, good = runs_of([small()], name, "cgla", tolerance=0.1)
    assert (bad.solver, bad.solution.lower_bound, good.solution.lower_bound) == (name, 1.0, 1.0)
    assert bad.solution.claimed_bound == pytest.approx(own, nan_ok=True)


def test_a_bound_of_a_graph_is_no_bound_in_the_plane(bounds: Bounds, enter: Enter) -> None:
    def proud(problem: GraphProblem) -> Solution:
        nodes = (problem.source, problem.target)
        cost = problem.evaluate(nodes)
        return Solution(Status.FOUND, nodes=nodes, cost=cost, lower_bound=cost)

    name = enter(proud, domain="graph")
    assert math.isnan(runs_of([small()], name)[0].solution.lower_bound)
    bounds(lambda _: 1.0)
    assert runs_of([small()], name, tolerance=0.1)[0].solution.lower_bound == 1.0


def test_a_path_below_the_bound_is_a_contradiction_that_is_told(bounds: Bounds) -> None:
    bounds(lambda p: p.evaluate([p.start, p.goal]).cost * 0.99)
    good, bad = runs_of([small()], "straight-line", "cgla", tolerance=0.1)
    assert good.solution.status is Status.FOUND
    found = row(bad)
    assert (found["status"], found["gap"]) == ("failed", None)
    assert f"{found['cost']:.9g}" in found["message"]
    assert f"{found['lower_bound']:.9g}" in found["message"]


def test_rounding_is_no_contradiction(bounds: Bounds) -> None:
    bounds(lambda p: p.evaluate([p.start, p.goal]).cost * (1.0 + 1e-12))
    (run,) = runs_of([small()], "straight-line", tolerance=0.1)
    assert run.solution.status is Status.FOUND
    assert run.solution.gap == pytest.approx(0.0, abs=1e-11)


def test_a_proof_of_no_path_contradicts_no_solver_without_one(bounds: Bounds) -> None:
    bounds(lambda _: math.inf)
    shut = small(more=WALL.replace("0.8", "1.1"))
    runs = runs_of([shut], "cgla", "straight-line", tolerance=0.1)
    assert [run.solution.status.label for run in runs] == ["no-path", "infeasible"]
    assert [row(run)["gap"] for run in runs] == [None, None]


def test_where_nothing_can_be_proven_nothing_is_said(bounds: Bounds) -> None:
    bounds(lambda _: math.nan)
    cgla, line = runs_of([small()], "cgla", "straight-line", tolerance=0.1)
    assert row(cgla)["lower_bound"] is None
    assert line.solution.lower_bound == pytest.approx(0.8 * math.sqrt(2.0))


def test_a_proof_that_fails_leaves_no_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "prove", lambda *_, **__: 1 / 0)
    (run,) = runs_of([small()], "cgla", tolerance=0.1)
    assert run.solution.status is Status.OPTIMAL
    assert run.certificate is not None
    assert run.certificate.message == "ZeroDivisionError: division by zero"
    assert math.isnan(run.certificate.lower_bound)


def test_a_real_bound_is_below_every_path() -> None:
    runs = runs_of([small(), small(more=WALL)], "cgla", "eight-direction", "straight-line", tolerance=0.05)
    for run in runs:
        assert run.certificate is not None
        if run.solution.status.has_path:
            assert 0.0 < run.certificate.lower_bound <= run.solution.cost
    assert sum(run.solution.status.has_path for run in runs) == 5


# Budgets and refinement


def test_refined_paths_cost_less_than_those_of_the_lattice() -> None:
    plain = Entrant.parse("cgla")
    before, after = compare([small()], [plain, plain.refined()], tolerance=None)
    assert (before.solver, after.solver) == ("cgla", "cgla+refine")
    assert after.solution.cost < before.solution.cost * 0.999
    assert (before.exact, after.exact) == (True, False)
    assert [line["excess"] < 0.0 for line in rows_of([before, after])] == [False, True]


def test_a_budget_reaches_the_solver() -> None:
    pytest.importorskip("ompl")
    entrant = Entrant.parse("rrt-star").with_budget({"iterations": 50})
    (run,) = compare([small()], [entrant], 1, tolerance=None)
    (own,) = runs_of([small()], "rrt-star:iterations=50")
    np.testing.assert_array_equal(run.solution.path, own.solution.path)
    assert run.solution.evaluations == own.solution.evaluations
    assert run.solver == "rrt-star"


def test_kernels_are_loaded_before_the_first_run(monkeypatch: pytest.MonkeyPatch) -> None:
    warmed: list[tuple[str, MapKind, bool]] = []

    def warm_up(solver: Solver, kind: MapKind, *, refine: bool) -> None:
        warmed.append((solver.traits.name, kind, refine))

    monkeypatch.setattr(runner, "warm_up_solver", warm_up)
    next(compare([small()], [Entrant.parse("cgla"), Entrant.parse("eight-direction").refined()], tolerance=None))
    assert warmed == [("cgla", MapKind(), False), ("eight-direction", MapKind(), True)]


@pytest.mark.parametrize(
    ("solvers", "n_runs"), [("hybrid", 1), ("hybrid:candidates=12", 2), ("hybrid,straight-line", 2)]
)
def test_the_solver_whose_path_is_certified_runs_once_when_alone(
    solvers: str, n_runs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Among others, all solvers run under the same conditions; results and proofs are the same."""
    scenario, solved, own = small(), [], Hybrid.solve
    monkeypatch.setattr(Hybrid, "solve", lambda self, problem: solved.append(problem) or own(self, problem))
    first, *_ = compare([scenario], [Entrant.parse(solver) for solver in solvers.split(",")], tolerance=0.01)
    assert sum(problem is scenario.problem for problem in solved) == n_runs
    certificate = runner.certify(scenario, 0.01)
    assert first.certificate is not None
    assert first.solution.cost == certificate.upper_bound
    assert first.solution.lower_bound == first.certificate.lower_bound == certificate.lower_bound
    assert first.certificate.seconds > first.solution.seconds * (n_runs == 1)


def test_runs_name_their_solver_as_the_user_did() -> None:
    (run,) = runs_of([small()], "cgla:schedule=sweeps")
    assert (run.solver, run.solution.solver, run.exact) == ("cgla:schedule=sweeps", "cgla", True)
    assert Entrant("x", "cgla").settings == {}

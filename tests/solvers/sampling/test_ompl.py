"""OMPL's planners over the exact cost: honest, repeatable, kept in their place, and survived when they break."""

# ruff: noqa: ANN401 - OMPL has no type hints

import itertools
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import quick_solvers
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from quick_solvers import WALLED_IN, quick
from strategies import few, usual

import cgla_graph as cg
from cgla_graph.model import isolated
from cgla_graph.model.solution import Solution, Status
from cgla_graph.solvers import registry
from cgla_graph.solvers.budget import Budget
from cgla_graph.testing.strategies import fields, points

pytest.importorskip("ompl")
pytestmark = pytest.mark.ompl

from ompl import base as ob  # noqa: E402 - only where it is installed
from ompl import geometric as og  # noqa: E402

from cgla_graph.solvers.sampling import ompl_run, ompl_space  # noqa: E402

QUICK = {name: settings for name, settings in quick_solvers.QUICK.items() if registry.traits(name).needs == ("ompl",)}
ANYTIME = [name for name in QUICK if registry.traits(name).anytime]
CHARGED = [name for name in QUICK if name != "ompl-prm-star"]
FIELD = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=0.9), cg.Threat(0.3, 0.7, 0.05)])
PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.9), FIELD, k=10.0)


# what they find


@pytest.mark.parametrize("name", QUICK)
@given(field=fields(max_threats=3), ends=st.tuples(points, points), k=st.floats(0.0, 20.0), seed=st.integers(1, 99))
@few
def test_paths_are_feasible_and_cost_what_the_planner_says(
    name: str, field: cg.RiskField, ends: Any, k: float, seed: int
) -> None:
    assume(math.dist(*ends) > 1e-3)
    area = shapely.box(0.45, 0.1, 0.55, 0.9)
    assume(not any(shapely.contains_xy(area, *end) for end in ends))
    problem = cg.Problem(ends[0], ends[1], field, k=k, no_fly=area)
    with pytest.MonkeyPatch.context() as patch:
        # enough to see that it ends
        patch.setattr(ompl_space, "MORE_BOUNDS", 10_000)
        # the solver's own words, not judged yet
        claimed = quick(name, seed=seed).solve(problem)
    if claimed.status is Status.NOT_FOUND:
        assert claimed.message
        return
    found = problem.evaluate(claimed.path)
    assert claimed.cost == pytest.approx(found.cost, rel=1e-9)
    assert found.feasible
    assert problem.judge(claimed).status is Status.FOUND
    assert found.cost >= math.dist(*ends) * (1.0 - 1e-12)


@pytest.mark.parametrize("name", QUICK)
def test_a_map_without_a_free_place_ends(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ompl_space, "MAX_REJECTIONS", 2000)
    monkeypatch.setattr(isolated, "is_expendable", lambda: True)
    # but for a rim that no sample meets
    problem = cg.Problem((0.0, 0.0), (1.0, 1.0), no_fly=shapely.box(1e-7, 1e-7, 1.0 - 1e-7, 1.0 - 1e-7))
    answer = cg.solve(problem, name, **QUICK[name])
    assert (answer.status, bool(answer.message)) == (Status.NOT_FOUND, True)


# what crashed or hung BIT*, and SORRT*

AREA = shapely.box(0.45, 0.1, 0.55, 0.9)
#: On its best path, a vertex had the goal straight ahead: by one rounding it was pruned, and the path with it.
PRUNED = cg.Problem(
    (0.606770497874356, 0.7903264942297688), (0.03271930130263734, 0.6125200542616873), k=1.847755606931909, no_fly=AREA
)
#: The straight line was found, and one rounding longer than its bound: samples were drawn for something shorter.
CLOSE = cg.Problem(
    (0.11208030307657335, 0.8305439429285276),
    (0.11408249375975721, 0.8272064640647685),
    cg.RiskField([cg.Threat(0.8238325324096715, 0.26420916599488575, 0.15194311428214585, peak=0.8055324363646504)]),
    k=5.8032776669173565,
    no_fly=AREA,
)


@pytest.mark.parametrize("iterations", [600, 1000, 2000])
def test_bit_star_does_not_prune_its_own_path(iterations: int) -> None:
    answer = cg.solve(PRUNED, "bit-star", seed=17, iterations=iterations)
    assert answer.status is Status.FOUND


@given(field=fields(max_threats=2), path=st.lists(points, min_size=2, max_size=6), at=st.integers(0, 4))
@usual
def test_no_way_to_the_goal_costs_less_than_its_bound(field: cg.RiskField, path: list[Any], at: int) -> None:
    # the rest of the path straight ahead, in pieces
    start, goal = path[0], path[-1]
    bend = path[min(at, len(path) - 2)]
    path = [*path[: path.index(bend) + 1], *np.linspace(bend, goal, 7)[1:].tolist()]
    problem = cg.Problem(start, goal, field, k=3.7)
    meter = Budget().start()
    cost = ompl_space.PruningCost(ompl_space.space_information(problem, 1, meter), problem, meter, 1)
    paid = list(itertools.accumulate((cost.motionCost(*ends).value() for ends in pairwise(path)), initial=0.0))
    for way, place in zip(paid, path, strict=True):
        assert way + cost.motionCostHeuristic(place, goal).value() <= paid[-1]


def test_bit_star_ends_with_a_straight_line(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    class Spied(ompl_space.PruningCost):
        def __init__(self, *args: Any, **settings: Any) -> None:
            super().__init__(*args, **settings)
            seen.append(self)

    monkeypatch.setattr(ompl_space, "PruningCost", Spied)
    # here, too, the line is one rounding longer than its bound
    problem = cg.Problem((0.3339874217325205, 0.5593492153752884), (0.3162989835870884, 0.5753013618968911))
    assert quick("bit-star", seed=37).solve(problem).status is Status.FOUND
    assert seen[0].asked < 100


@pytest.mark.parametrize("name", ["bit-star", "sorrt-star"])
def test_a_run_ends_where_nothing_better_can_be_sampled(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ompl_space, "MORE_BOUNDS", 100_000)
    answer = quick(name, seed=12).solve(CLOSE)
    assert answer.status is Status.FOUND
    assert answer.cost == pytest.approx(math.dist(CLOSE.start, CLOSE.goal), rel=1e-3)


@pytest.mark.parametrize("budget", [{"seconds": 0.1}, {"iterations": 10**6}])
@pytest.mark.parametrize("name", ["bit-star", "sorrt-star"])
def test_samples_are_drawn_no_longer_than_the_budget_lasts(
    name: str, budget: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    # hardly a sample of this map is near enough, and the path costs more than its length
    field = cg.RiskField([cg.Threat(0.01, 0.0, 1.0, peak=0.1)])
    problem = cg.Problem((0.0, 0.0), (0.02, 0.0), field, k=1.0, bounds=(0, 0, 100, 100))
    if "seconds" not in budget:
        monkeypatch.setattr(ompl_space, "MORE_BOUNDS", 10_000)
    else:
        monkeypatch.setattr(ompl_space, "MORE_BOUNDS", math.inf)
    began = time.perf_counter()
    answer = registry.get(name, **{"iterations": None, **budget}).solve(problem)
    # (otherwise it would never end)
    assert time.perf_counter() - began < 60.0
    assert answer.status in {Status.FOUND, Status.NOT_FOUND}


# where they sample

#: The ellipse of the first path covers little of the map.
WALL = cg.Problem((4.0, 4.0), (6.0, 6.0), k=0.0, no_fly=shapely.box(4.5, 3.0, 5.5, 5.5), bounds=(0, 0, 10, 10))
#: The area is out of the way; with one, OMPL asks whether samples are free.
THREATENED = cg.Problem(
    (4.0, 4.0),
    (6.0, 6.0),
    cg.RiskField([cg.Threat(5.0, 5.0, 0.4, peak=0.9)]),
    k=5.0,
    no_fly=shapely.box(0.1, 9.0, 0.2, 9.2),
    bounds=(0, 0, 10, 10),
)
INFORMED = ("informed-rrt-star", "sorrt-star", "bit-star")


def shares_outside(
    name: str, problem: cg.Problem, monkeypatch: pytest.MonkeyPatch, **settings: Any
) -> tuple[int, float]:
    """Count the samples after the first path, and return the share of those outside the ellipse of the best cost."""
    seen: list[tuple[float, float, float]] = []
    state = {"best": math.inf, "new": False}

    class Spied(ompl_run.Watch):
        def __call__(self) -> bool:
            state.update(best=self.best_cost(), new=True)
            return super().__call__()

    class Motion(ompl_space.ExactMotion):
        def checkMotion(self, first: Any, second: Any) -> bool:  # noqa: N802 - OMPL's name
            # RRT* begins each iteration with the motion to its sample
            if state["new"] and name != "bit-star":
                seen.append((second[0], second[1], state["best"]))
                state["new"] = False
            return super().checkMotion(first, second)

    class Free(ompl_space.ExactState):
        def __call__(self, place: Any) -> bool:
            if name == "bit-star":
                seen.append((place[0], place[1], state["best"]))
            return super().__call__(place)

    for module, word, double in [
        (ompl_run, "Watch", Spied),
        (ompl_space, "ExactMotion", Motion),
        (ompl_space, "ExactState", Free),
    ]:
        monkeypatch.setattr(module, word, double)
    assert quick(name, **settings).solve(problem).status is Status.FOUND
    later = np.array([sample for sample in seen if sample[2] < math.inf])
    ways = sum(np.hypot(later[:, 0] - x, later[:, 1] - y) for x, y in (problem.start, problem.goal))
    return len(later), float(np.mean(ways > later[:, 2]))


@pytest.mark.parametrize("problem", [WALL, THREATENED])
@pytest.mark.parametrize("name", [*INFORMED, "rrt-star"])
def test_after_the_first_path_samples_may_improve_it(
    name: str, problem: cg.Problem, monkeypatch: pytest.MonkeyPatch
) -> None:
    number, outside = shares_outside(name, problem, monkeypatch, iterations=8000 if name == "bit-star" else 400, seed=3)
    assert number > 200
    # (the ellipse is an eighth of the map at most)
    assert outside == 0.0 if name in INFORMED else outside > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("problem", [WALL, THREATENED])
def test_samples_of_use_give_shorter_paths(problem: cg.Problem) -> None:
    cost = {
        name: np.median([quick(name, iterations=400, seed=seed).solve(problem).cost for seed in range(1, 6)])
        for name in ("rrt-star", "informed-rrt-star", "sorrt-star")
    }
    best = cg.solve(problem, "hybrid").cost
    for name in ("informed-rrt-star", "sorrt-star"):
        assert best <= cost[name] < best + 0.5 * (cost["rrt-star"] - best)


@given(
    path=st.lists(points, min_size=3, max_size=6),
    peaks=st.lists(st.floats(0.1, 4.0), max_size=3),
    k=st.floats(0.0, 50.0),
    data=st.data(),
)
@usual
@pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.ImproperFieldWarning")
def test_no_sample_of_a_path_is_refused_that_costs_less(
    path: list[Any], peaks: list[float], k: float, data: st.DataObject
) -> None:
    assume(path[0] != path[-1])
    threats = [cg.Threat(*data.draw(points), data.draw(st.floats(0.02, 0.5)), peak=peak) for peak in peaks]
    problem = cg.Problem(path[0], path[-1], cg.RiskField(threats, improper=True), k=k)
    meter = Budget().start()
    si = ompl_space.space_information(problem, 1, meter)
    objective = ompl_space.SegmentCost(si, problem, meter)
    costs = [objective.total(np.array(ends)) for ends in pairwise(path)]
    # OMPL gets no other
    assume(all(cost >= 0.0 for cost in costs))
    nowhere = (math.nan, math.nan)
    assert all(objective.motionCostHeuristic(nowhere, place).value() < sum(costs) for place in path[1:-1])
    assert all(
        objective.motionCostHeuristic(*ends).value() <= cost for ends, cost in zip(pairwise(path), costs, strict=True)
    )


@pytest.mark.parametrize("name", ["informed-rrt-star", "sorrt-star"])
def test_nothing_behind_a_threat_is_pruned(name: str) -> None:
    # a straight segment from the start to what is behind the threat costs more than the path around it
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.3, 0.5, 0.1, peak=0.9)]), k=50.0)
    run = {each: quick(each, iterations=300).solve(problem) for each in ("rrt-star", name)}
    # each iteration of either adds a node; the fewer nodes, the fewer neighbours are weighed
    assert run[name].evaluations == run["rrt-star"].evaluations


@pytest.mark.parametrize("name", ["informed-rrt-star", "sorrt-star"])
def test_informed_planners_end_where_hardly_a_sample_is_of_use(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ompl_space, "MORE_BOUNDS", 20_000)
    # the nearer the path is to the straight line, the thinner is the ellipse
    answer = quick(name, iterations=20_000).solve(cg.Problem((0.1, 0.1), (0.9, 0.9)))
    assert answer.evaluations < 100_000
    assert answer.cost == pytest.approx(0.8 * math.sqrt(2.0), rel=1e-4)


def test_informed_rrt_star_ends_with_a_straight_line() -> None:
    problem = cg.Problem((0.4, 0.5), (0.5, 0.5))
    answer = quick("informed-rrt-star", iterations=2000).solve(problem)
    assert answer.cost == pytest.approx(0.1, rel=1e-12)
    assert answer.evaluations < 1000


# the same path again


OTHER_PROCESS = """
import json, sys
import cgla_graph as cg
names = json.loads(sys.argv[1])
field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=0.9), cg.Threat(0.3, 0.7, 0.05)])
problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=10.0)
print(json.dumps({name: cg.solve(problem, name, seed=5, **names[name]).path.tolist() for name in reversed(names)}))
"""


@pytest.mark.slow
def test_a_seed_gives_the_same_path_here_and_in_another_process() -> None:
    # evaluations stop the planners in mid-step, which must not matter either
    budgets = {name: {**QUICK[name], **({"evaluations": 15_000} if name in ANYTIME else {})} for name in QUICK}
    here = {name: cg.solve(PROBLEM, name, seed=5, **budgets[name]).path.tolist() for name in QUICK}
    again = {name: cg.solve(PROBLEM, name, seed=5, **budgets[name]).path.tolist() for name in QUICK}
    assert here == again
    words = [sys.executable, "-c", OTHER_PROCESS, json.dumps(budgets)]
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    done = subprocess.run(words, capture_output=True, text=True, check=True, env=environment)
    assert json.loads(done.stdout) == here
    # nanobind tells at exit of objects that outlived their function
    assert done.stderr == ""


class Deaf(ompl_run.Watch):
    """Never stops the planner for an improvement."""

    def __call__(self) -> bool:
        if self.meter.spent:
            return True
        self.meter.iterations += 1
        return False


@pytest.mark.slow
@pytest.mark.parametrize("name", ANYTIME)
def test_stopping_for_paths_does_not_change_the_search(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    solver = quick(name, iterations=500)
    stopped = solver.solve(PROBLEM)
    monkeypatch.setattr(ompl_run, "Watch", Deaf)
    through = solver.solve(PROBLEM)
    assert np.array_equal(stopped.path, through.path)
    assert (stopped.cost, stopped.evaluations) == (through.cost, through.evaluations)
    # what the last stop saw is where the run through ended
    assert len(stopped.trace) > len(through.trace) == 1
    assert stopped.trace[-1].cost == through.trace[0].cost


@pytest.mark.parametrize("name", ANYTIME)
def test_the_trace_holds_the_costs_of_the_oracle(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    real = ompl_space.waypoints

    def spy(problem: cg.Problem, pdef: Any) -> Any:
        path = real(problem, pdef)
        seen.append(problem.evaluate(path).cost)
        return path

    monkeypatch.setattr(ompl_space, "waypoints", spy)
    answer = quick(name).solve(PROBLEM)
    falls = [cost for i, cost in enumerate(seen) if cost < min(seen[:i], default=math.inf)]
    assert [point.cost for point in answer.trace] == falls
    assert answer.trace[-1].cost == PROBLEM.evaluate(answer.path).cost


# when they break


def broken_cost(monkeypatch: pytest.MonkeyPatch, cost: Callable[..., float]) -> None:
    """Replace the cost of segments that OMPL sees, and nothing that the oracle sees; in this process."""

    class Kernels:
        segment_cost = staticmethod(cost)

    monkeypatch.setattr(ompl_space, "risk_kernels", Kernels)
    monkeypatch.setattr(isolated, "is_expendable", lambda: True)


def raiser(error: BaseException) -> Callable[..., float]:
    def segment_cost(*_: object) -> float:
        raise error

    return segment_cost


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
@pytest.mark.parametrize("name", CHARGED)
def test_what_a_cost_raises_fails_the_run_and_nothing_else(
    name: str, error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    broken_cost(monkeypatch, raiser(error("broken cost")))
    with pytest.raises(error, match="broken cost"):
        quick(name).solve(PROBLEM)
    # the process goes on, with the next run
    monkeypatch.undo()
    assert quick(name).solve(PROBLEM).status is Status.FOUND


@pytest.mark.parametrize("cost", [math.nan, -1.0, -math.inf])
@pytest.mark.parametrize("name", CHARGED)
def test_a_cost_that_would_crash_a_planner_stops_it_first(
    name: str, cost: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken_cost(monkeypatch, lambda *_: cost)
    with pytest.raises(ArithmeticError, match=f"a segment costs {cost}"):
        quick(name).solve(PROBLEM)


@pytest.mark.parametrize("name", CHARGED)
def test_a_planner_that_minimises_something_else_is_caught(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    broken_cost(monkeypatch, lambda x1, y1, x2, y2, *_: 0.5 * math.hypot(x2 - x1, y2 - y1))
    answer = cg.solve(PROBLEM, quick(name))
    assert answer.status is Status.FAILED
    assert "the oracle says" in answer.message


class Planner:
    """A planner of OMPL that goes wrong in one way, with the parts of the interface that are used."""

    def __init__(self, si: Any, fault: str) -> None:
        self.si, self.fault = si, fault
        self.pdef: Any = None

    def setProblemDefinition(self, pdef: Any) -> None:  # noqa: N802 - OMPL's name
        self.pdef = pdef

    def setup(self) -> None:
        pass

    def bestCost(self) -> Any:  # noqa: N802 - OMPL's name
        return ob.Cost(math.inf if self.fault.startswith("asks") else 1.0)

    def solve(self, ptc: Any) -> Any:
        ends = [self.si.allocState() for _ in range(2)]
        for i, end in enumerate(ends):
            end[0], end[1] = 0.1 + 0.8 * i, 0.1
        objective = self.pdef.getOptimizationObjective()
        while self.fault == "asks costs for ever":
            objective.motionCost(*ends)
        while self.fault == "asks motions for ever":
            self.si.checkMotion(*ends)
        while self.fault == "asks states for ever":
            self.si.isValid(ends[0])
        while self.fault == "asks for the end":
            if ptc():
                return ob.PlannerStatus(ob.PlannerStatus.TIMEOUT)
        if self.fault == "gives up":
            return ob.PlannerStatus(ob.PlannerStatus.TIMEOUT)
        path = og.PathGeometric(self.si)
        for end in ends[: 1 if self.fault == "stops short" else 2]:
            path.append(end)
        self.pdef.addSolutionPath(path, False, 0.0, "broken")  # noqa: FBT003 - OMPL's order
        return ob.PlannerStatus(ob.PlannerStatus.EXACT_SOLUTION)


@pytest.mark.parametrize(
    ("fault", "status"),
    [
        ("asks costs for ever", Status.NOT_FOUND),
        ("asks motions for ever", Status.NOT_FOUND),
        ("asks states for ever", Status.NOT_FOUND),
        ("asks for the end", Status.NOT_FOUND),
        ("gives up", Status.NOT_FOUND),
        ("crosses", Status.INFEASIBLE),
        ("stops short", Status.FAILED),
    ],
)
@pytest.mark.parametrize("run", [ompl_run.run_anytime, ompl_run.run_once])
def test_a_broken_planner_neither_hangs_nor_gets_away_with_it(run: Any, fault: str, status: Status) -> None:
    problem = cg.Problem((0.1, 0.1), (0.9, 0.1), no_fly=shapely.box(0.4, 0.0, 0.6, 0.5))
    began = time.perf_counter()
    answer: Solution = run(problem, lambda si: Planner(si, fault), Budget(seconds=0.1), 1)
    assert time.perf_counter() - began < 60.0
    if fault == "crosses":
        # its own cost is right: only the oracle sees the area
        answer = replace(answer, cost=0.8)
    assert problem.judge(answer).status is status
    assert answer.message or status is not Status.NOT_FOUND


def test_an_approximate_path_is_no_path() -> None:
    states = []

    class Spied(og.RRTstar):  # type: ignore[misc]
        def solve(self, ptc: Any) -> Any:
            states.append(super().solve(ptc))
            return states[-1]

    answer = ompl_run.run_anytime(WALLED_IN, Spied, Budget(iterations=300), 1)
    assert states[-1].getStatus() == ob.PlannerStatus.APPROXIMATE_SOLUTION
    assert bool(states[-1])
    assert answer.status is Status.NOT_FOUND

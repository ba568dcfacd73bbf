"""Studies for the tests of the report: a small one of real runs, odd names, and a large one."""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely

import cgla_graph as cg
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.provenance import Session
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.comparisons.study.store import Stored
from cgla_graph.isolation.limits import Limits
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.scenario import Scenario, load_scenario

SESSION = Session(
    number=1,
    started="2026-01-02T03:04:05+00:00",
    version="0.1.0",
    git="abc1234 (dirty)",
    host="lab-7",
    machine="some processor, 2 cores",
    packages={"numpy": "2.0"},
    workers="2",
    command="cgla compare study.toml --out results",
    source='title = "Small"',
)
#: What must appear as text and run nothing.
ODD = """<script>window.hacked=1</script></script><img src=x onerror="window.hacked=1">'"&amp;{{7*7}}\n\u2028🛩 <!--"""


def stored_of(runs: Sequence[Run], *, title: str = "Small study", n_cells: int | None = None) -> Stored:
    """Make a study of some runs, with the numbers that a database gives."""
    numbered = [dataclasses.replace(run, number=number) for number, run in enumerate(runs, start=1)]
    return Stored(
        folder=Path("results/my study"),
        title=title,
        runs=numbered,
        scenarios=list({id(run.scenario): run.scenario for run in runs}.values()),
        solvers=list(dict.fromkeys(run.solver for run in runs)),
        n_cells=len(runs) if n_cells is None else n_cells,
        sessions=[SESSION],
        limits=Limits(),
    )


def small_runs() -> list[Run]:
    """Run four solvers on three shipped scenarios; one crosses a wall on two of them."""
    names = ("cgla", "hybrid", "straight-line", "prm-star:milestones=40")
    scenarios = [load_scenario(name) for name in ("paper", "maze", "trap")]
    problem = dataclasses.replace(scenarios[1].problem, field=cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=1.0)
    lattice = Lattice(9, bounds=problem.bounds)
    scenarios[1] = dataclasses.replace(scenarios[1], problem=problem, lattice=lattice, y_down=True)
    return list(compare(scenarios, [Entrant.parse(name) for name in names], n_seeds=2))


def failing(run: Run, status: Status, message: str) -> Run:
    """Turn a run into one that failed."""
    return dataclasses.replace(run, solution=Solution(status, message=message, seconds=run.solution.seconds))


def odd_runs() -> list[Run]:
    """Give a scenario, a solver and a message names that try to be more than text."""
    runs = []
    for run in compare([load_scenario("one-threat")], [Entrant.parse("straight-line")], n_seeds=1, tolerance=None):
        scenario = dataclasses.replace(run.scenario, name=f"scenario {ODD}", title=f"title {ODD}")
        runs += [
            dataclasses.replace(run, scenario=scenario),
            dataclasses.replace(run, scenario=scenario, solver=f"solver {ODD}"),
            dataclasses.replace(
                failing(run, Status.FAILED, f"message {ODD}"), scenario=scenario, solver=f"\udcff failing {ODD}"
            ),
        ]
    return runs


def large_study(n_scenarios: int = 100, n_solvers: int = 20, n_seeds: int = 10, n_trace: int = 20) -> Stored:
    """Make up a study: maps of their own, paths of 60 waypoints, costs that fall in steps; one run of 50 fails."""
    random = np.random.default_rng(1)
    runs = []
    for place in range(n_scenarios):
        threats = [cg.Threat(random.random(), random.random(), 0.05 + 0.1 * random.random()) for _ in range(8)]
        wall = shapely.Point(0.5, 0.5).buffer(0.1)
        problem = cg.Problem((0.0, 0.0), (1.0, 1.0), cg.RiskField(threats), k=5.0, no_fly=wall)
        scenario = Scenario(f"random-{place:03}", f"random map {place}", problem, Lattice(10, bounds=problem.bounds))
        for solver in range(n_solvers):
            for seed in range(1, n_seeds + 1):
                solution = _made_up(random, 0.02 * solver, n_trace)
                runs.append(Run(scenario, f"solver-{solver}", seed, exact=False, solution=solution))
    return stored_of(runs, title="Large study")


def _made_up(random: np.random.Generator, worse: float, n_trace: int) -> Solution:
    seconds = float(random.lognormal())
    if random.random() < 0.02:
        status = (Status.TIMED_OUT, Status.CRASHED, Status.NOT_FOUND)[int(random.integers(3))]
        return Solution(status, seconds=seconds, message=f"stopped after {seconds:.3f} s", lower_bound=1.4)
    cost = 1.5 + worse + 0.2 * float(random.random())
    times = np.sort(random.random(n_trace)) * seconds
    costs = cost + np.sort(random.random(n_trace))[::-1]
    trace = tuple(TracePoint(float(t), i, float(c)) for i, (t, c) in enumerate(zip(times, costs, strict=True)))
    along = np.linspace(0.0, 1.0, 60)
    path = np.stack([along, along + 0.1 * np.sin(math.pi * along) * random.random(60)], axis=1)
    return Solution(
        Status.FOUND,
        path=path,
        cost=cost,
        length=math.sqrt(2.0),
        risk=0.02,
        lower_bound=1.4,
        seconds=seconds,
        evaluations=1000,
        trace=trace,
    )

"""What is claimed of all paths of a problem, held against the paths that any solver finds."""

import dataclasses
import functools
import math
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple

import numpy as np
import pytest
from random_problems import problem_of

import cgla_graph as cg
from cgla_graph.certificate import certificate, subsolution, verdict
from cgla_graph.model.problem import Evaluation
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Solver
from cgla_graph.solvers.trade_off import budget_use, constrained, front
from cgla_graph.solvers.trade_off.plan_within import PlanWithin

#: Points a side of lattices.
RESOLUTION = 7
#: Cells along a side of the only grid of a proof: a coarse bound is a bound as well.
CELLS = 24
#: Line integrals are exact to about this, of a unit length; sums are rounded.
NEAR = 1e-9
#: Rounding of a length or a risk, relative to the greatest coordinate.
ROUNDED = 1e-14
#: What solvers that find paths where others do not are called with.
HYBRID = cg.solvers.get("hybrid", tolerance=None, points=100, candidates=1)

#: Solvers that are quick enough for many problems, and their settings.
QUICK: dict[str, dict[str, Any]] = {
    **{name: {} for name in ("cgla", "dijkstra", "networkx", "networkx-astar", "igraph", "rustworkx", "networkit")},
    **{name: {} for name in ("eight-direction", "lazy-theta-star", "straight-line", "visibility-graph", "refine")},
    "fast-marching": {"cells": 40},
    "skimage-route": {"cells": 40},
    "weighted-regions": {"points": 3},
    "hybrid": {"tolerance": None, "points": 100, "candidates": 1},
}


class Known(NamedTuple):
    """A path, evaluated by the oracle: who found it, and whether it is one over the lattice."""

    finder: str
    on_lattice: bool
    path: Evaluation


def make_quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let proofs have one coarse grid, and searches for a budget few steps."""
    for module in (certificate, subsolution):
        monkeypatch.setattr(module, "FIRST_CELLS", CELLS)
    for module in (constrained, verdict):
        monkeypatch.setattr(module, "prove", functools.partial(certificate.prove, max_cells=CELLS**2))
    monkeypatch.setattr(constrained, "MOST_SOLVES", 2)
    monkeypatch.setattr(budget_use, "SHIFTS", 1)
    monkeypatch.setattr(budget_use, "HALVINGS", 6)
    monkeypatch.setattr(constrained, "SEEDS_UP_TO", 0)
    monkeypatch.setattr(front, "MOST_GROWTHS", 0)


class Tried(NamedTuple):
    """A problem, the paths that two solvers find, and whether it is proven that there is none."""

    problem: cg.Problem
    known: list[Known]
    closed: bool


@functools.lru_cache(64)
def tried(number: int) -> Tried:
    """Find paths: by `hybrid`, and by an exact solver on the lattice, the shortest, the safest and between."""
    problem = problem_of(number)
    weighted = [dataclasses.replace(problem, k=k) for k in (0.0, problem.k, 1e4)]
    found = [("dijkstra", cg.solve(one, "dijkstra", resolution=RESOLUTION)) for one in weighted]
    known = list(evaluated(problem, [*found, ("hybrid", cg.solve(problem, HYBRID))]))
    return Tried(problem, known, verdict.is_proven_closed(problem))


def evaluated(problem: cg.Problem, found: list[tuple[str, Solution]]) -> Iterator[Known]:
    """Evaluate all paths by the oracle; leave out those that it refuses."""
    for finder, solution in found:
        if len(solution.path):
            path = problem.evaluate(solution.path)
            joined = tuple(solution.path[0].tolist()), tuple(solution.path[-1].tolist())
            if path.feasible and joined == (problem.start, problem.goal):
                yield Known(finder, finder == "dijkstra", path)


def faults_of_solution(problem: cg.Problem, solution: Solution, known: list[Known]) -> Iterator[str]:
    """Name the known paths that a bound of all paths does not hold for."""
    for finder, _, path in known:
        if solution.lower_bound > path.cost * (1.0 + NEAR) + NEAR * problem.k * path.length:
            yield f"bound {solution.lower_bound:.12g}, and a path of {finder} costs {path.cost:.12g}"
    if solution.status.has_path and not math.isnan(solution.lower_bound) and not solution.gap >= -NEAR:
        yield f"a gap of {solution.gap}"
    if solution.message == "the no-fly areas seal the way" and known:
        yield f"says that the way is sealed, and {known[0].finder} finds one"


def faults_of_plan(problem: cg.Problem, plan: PlanWithin, known: list[Known]) -> Iterator[str]:
    """Name what a plan within a budget says and a known path refutes."""
    on_risk = plan.limited == "risk"
    extent = float(np.abs(problem.bounds).max())
    for finder, on_lattice, path in known:
        used, value = (path.risk, path.length) if on_risk else (path.length, path.risk)
        # (integrals and lengths are rounded relative to coordinates)
        if used <= plan.budget * (1.0 - NEAR) - ROUNDED * extent and (plan.scope == "plane" or on_lattice):
            yield from (f"{fault}; {finder} finds one" for fault in _faults_beside(plan, value, NEAR * path.length))
    if plan.scope == "plane" and plan.status is cg.Status.NO_PATH and known:
        yield f"says that no path exists; {known[0].finder} finds one"
    if plan.scope == "plane" and plan.status is cg.Status.OPTIMAL:
        yield "optimal in the plane"
    used = plan.solution.risk if on_risk else plan.solution.length
    if plan.status.has_path and not used <= plan.budget * (1.0 + 1e-12):
        yield f"uses {used:.12g} of {plan.budget:.12g}"


def _faults_beside(plan: PlanWithin, value: float, near: float) -> Iterator[str]:
    """Name what it says beside a path of a value that keeps the budget."""
    if plan.no_path:
        yield f"no path of the {plan.scope} keeps the budget"
    elif plan.lower_bound > value * (1.0 + NEAR) + near:
        yield f"no path of the {plan.scope} is below {plan.lower_bound:.12g}, not {value:.12g}"
    own = plan.solution.length if plan.limited == "risk" else plan.solution.risk
    if plan.status is cg.Status.OPTIMAL and own > value * (1.0 + NEAR) + near:
        yield f"{own:.12g} is optimal, not {value:.12g}"


def draw_budget(rng: np.random.Generator, limited: str, known: list[Known]) -> float:
    """Draw a budget: the use of a known path or a little more, so that this path keeps it; or any."""
    if not known or rng.random() < 0.2:
        return float(10.0 ** rng.uniform(-3.0, 1.0))
    path = known[int(rng.integers(len(known)))].path
    return float((path.risk if limited == "risk" else path.length) * rng.choice([1.0 + 1e-8, 1.0 + 1e-5, 1.01, 1.5]))


def plan_within(problem: cg.Problem, limited: str, budget: float, solver: str | Solver) -> PlanWithin:
    """Plan within a budget of risk or length."""
    plan = cg.plan_within_risk if limited == "risk" else cg.plan_within_length
    return plan(problem, budget, solver=solver, resolution=RESOLUTION, tolerance=0.1)


def faults(number: int, name: str, limited: Literal["risk", "length"], **settings: Any) -> list[str]:  # noqa: ANN401 - settings of solvers
    """Name the claims of a solver about a problem, and about a budget drawn for it, that any known path refutes."""
    if cg.solvers.traits(name).seeded:
        settings["seed"] = 1 + number % 99
    solver = cg.solvers.get(name, **settings)
    problem, known, closed = tried(number)
    answer = cg.solve(problem, solver, resolution=RESOLUTION)
    known = [*known, *evaluated(problem, [(name, answer)])]
    found = list(faults_of_solution(problem, answer, known))
    if closed and known:
        found.append(f"proven closed, and {known[0].finder} finds a path")
    budget = draw_budget(np.random.default_rng(number), limited, known)
    plan = plan_within(problem, limited, budget, solver)
    known += evaluated(problem, [("the plan", plan.solution)])
    found += [f"{limited} at most {budget:.12g}: {fault}" for fault in faults_of_plan(problem, plan, known)]
    return [f"{name} on problem {number}: {fault}" for fault in found]

"""
Any problem through every solver: the process lives, and every status is true.

``CGLA_PROBLEMS=1000 pytest tests/solvers/test_random_problems.py`` takes more. A failure names its problem by a number.
"""

import math
import os
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import quick_solvers
from random_problems import KINDS, problem_of, walled_in

import cgla_graph as cg
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import NO_RASTERS, is_blind_to
from cgla_graph.solvers import registry

#: How many problems.
NUMBER = int(os.environ.get("CGLA_PROBLEMS", "24"))
#: Small budgets: some solvers find nothing, which is to be said.
QUICK: dict[str, dict[str, Any]] = quick_solvers.QUICK | {
    "evolutionary": {"generations": 5},
    "q-learning": {"episodes": 30},
    "hybrid": {"points": 2000, "tolerance": None},
    "fast-marching": {"cells": 40},
}
RESOLUTION = 7
#: Statuses where there is no path, or none was found.
NOTHING = {Status.NO_PATH, Status.NOT_FOUND, Status.STUCK}


def answers(number: int) -> Iterator[tuple[str, Solution]]:
    """Solve a problem with every solver."""
    problem = problem_of(number)
    for name in registry.names():
        settings = dict(QUICK.get(name, {}))
        if registry.traits(name).seeded:
            settings["seed"] = 1 + number % 99
        yield name, cg.solve(problem, name, resolution=RESOLUTION, **settings)


def faults(problem: cg.Problem, found: dict[str, Solution]) -> Iterator[str]:
    """Name the faults of the answers to one problem."""
    reached = [name for name, answer in found.items() if answer.status.has_path]
    bound = max((answer.lower_bound for answer in found.values() if answer.lower_bound > 0.0), default=0.0)
    for name, answer in found.items():
        if answer.solver != name:
            yield f"{name}: calls itself {answer.solver}"
        if answer.status.has_path:
            yield from (f"{name}: {fault}" for fault in faults_of_path(problem, answer, bound))
        elif not is_blind_to(problem, registry.traits(name)):
            yield from (f"{name}: {fault}" for fault in faults_without_path(name, answer))
        if is_blind_to(problem, registry.traits(name)) and answer.message != NO_RASTERS:
            yield f"{name}: {answer.status.label}, though it sees no rasters"
        if name == "visibility-graph" and answer.status is Status.NO_PATH and reached:
            yield f"{name}: says that there is no path, and {', '.join(reached)} found one"
    exact = [answer for name, answer in found.items() if registry.traits(name).exact]
    if len({answer.status for answer in exact}) > 1:
        yield f"exact solvers disagree: {', '.join(answer.status.label for answer in exact)}"
    optima = [answer.cost for answer in exact if answer.status.has_path]
    if optima and not max(optima) <= min(optima) * (1.0 + 1e-9):
        yield f"optima of one lattice differ: {sorted(optima)}"


def faults_without_path(name: str, answer: Solution) -> Iterator[str]:
    """Name the faults of an answer that has no path."""
    status = answer.status
    if not (status in NOTHING or (status is Status.INFEASIBLE and not registry.traits(name).no_fly)):
        yield f"{status.label}: {answer.message}"
    if status in {Status.NOT_FOUND, Status.STUCK} and not answer.message:
        yield f"does not say why it is {status.label}"
    if status in NOTHING and not math.isinf(answer.cost):
        yield f"a cost of {answer.cost} without a path"


def faults_of_path(problem: cg.Problem, answer: Solution, bound: float) -> Iterator[str]:
    """Name the faults of a path."""
    judged = problem.evaluate(answer.path)
    if judged.violations:
        yield f"{answer.status.label}, but {'; '.join(judged.violations)}"
    ends_of_path = tuple(answer.path[0].tolist()), tuple(answer.path[-1].tolist())
    if ends_of_path != (problem.start, problem.goal):
        yield f"joins {ends_of_path}, not {problem.start} and {problem.goal}"
    if not math.isclose(judged.cost, answer.cost, rel_tol=1e-9, abs_tol=1e-12):
        yield f"says a cost of {answer.cost}, which is {judged.cost}"
    if not answer.cost >= bound * (1.0 - 1e-9):
        yield f"costs {answer.cost}, but nothing should cost less than {bound}"
    costs = [moment.cost for moment in answer.trace]
    if costs != sorted(costs, reverse=True) or (costs and not math.isclose(costs[-1], answer.cost, rel_tol=1e-6)):
        yield f"its trace {costs} does not fall to {answer.cost}"


@pytest.mark.slow
@pytest.mark.parametrize("number", range(NUMBER))
@pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.SmallSpreadWarning")
def test_every_status_is_true(number: int) -> None:
    assert list(faults(problem_of(number), dict(answers(number)))) == []


def test_what_is_false_is_seen() -> None:
    problem = problem_of(KINDS.index(walled_in))
    path = np.array([problem.start, problem.goal])
    lie = Solution(Status.FOUND, path=path, cost=1.0, solver="cgla")
    said = list(faults(problem, {"cgla": lie, "dijkstra": Solution(Status.CRASHED, solver="dijkstra")}))
    assert [fault.split(":")[0] for fault in said] == ["cgla", "cgla", "dijkstra", "exact solvers disagree"]

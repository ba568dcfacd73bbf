"""Running a ready solver: what is asked of it, what is kept from it, and who has the last word."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np
import pytest

import cgla_graph as cg
from cgla_graph.errors import SolverSettingError
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, Solution, Status
from cgla_graph.model.solver import Traits, run

PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.1), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=10.0)


def straight(problem: Problem | GraphProblem) -> Solution:
    if isinstance(problem, GraphProblem):
        nodes = (problem.source, problem.target)
        return Solution(Status.FOUND, nodes=nodes, cost=problem.evaluate(nodes))
    path = np.array([problem.start, problem.goal])
    return Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost)


@dataclass(frozen=True)
class Given:
    """A solver that answers what it is told to."""

    answer: Callable[..., Solution] = straight
    resolution: int | None = None

    traits: ClassVar[Traits] = Traits("given", "a test's own", domain="plane")

    def solve(self, problem: Problem | GraphProblem) -> Solution:
        return self.answer(problem)


@dataclass(frozen=True)
class OnGraph(Given):
    """On a graph, with weights of at least 0."""

    traits: ClassVar[Traits] = Traits("on-graph", "a test's own", domain="graph", needs_positive=True)


@dataclass(frozen=True)
class Positive(Given):
    """In the plane, with risk of at least 0."""

    traits: ClassVar[Traits] = Traits("positive", "a test's own", domain="plane", needs_positive=True)


def never(_: Problem | GraphProblem) -> Solution:
    msg = "nobody was to ask"
    raise AssertionError(msg)


def improper(start: tuple[float, float] = (0.1, 0.1)) -> Problem:
    with pytest.warns(ImproperFieldWarning):
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=4.0), cg.Threat(0.55, 0.5, 0.1, peak=4.0)], improper=True)
    return Problem(start, (0.9, 0.1), field, k=10.0)


@pytest.mark.parametrize(("solver", "problem"), [(Given(), PROBLEM.on_lattice(4)), (OnGraph(), PROBLEM)])
def test_a_problem_of_the_other_domain_is_refused(solver: Given, problem: Problem | GraphProblem) -> None:
    with pytest.raises(SolverSettingError, match=r"plans (in the plane|on a graph)"):
        run(solver, problem)


def test_the_answer_is_judged() -> None:
    def lies(problem: Problem) -> Solution:
        return replace(straight(problem), cost=0.1)

    assert run(Given(lies), PROBLEM).status is Status.FAILED
    assert run(Given(), PROBLEM).cost == PROBLEM.evaluate([PROBLEM.start, PROBLEM.goal]).cost


def test_negative_weights_reach_only_who_takes_them() -> None:
    problem = improper()
    for solver, asked in ((Positive(never), problem), (OnGraph(never), problem.on_lattice(6))):
        answer = run(solver, asked)
        assert (answer.status, answer.message) == (Status.UNSUPPORTED, NEGATIVE_WEIGHTS)
    assert run(Given(), problem).status is Status.FOUND
    # no pair of these points is near the threats: the graph has no weight below 0
    graph = cg.GeometricGraph.complete([problem.start, problem.goal], problem.field, problem.k)
    assert run(OnGraph(), GraphProblem(graph, 0, 1)).status is Status.FOUND


def test_staying_needs_no_solver_and_is_the_optimum_where_risk_cannot_be_negative() -> None:
    here = replace(PROBLEM, goal=PROBLEM.start)
    answer = run(Given(never), here)
    assert (answer.status, answer.cost, answer.lower_bound) == (Status.OPTIMAL, 0.0, 0.0)
    answer = run(Given(never), replace(improper(), goal=(0.1, 0.1)))
    assert (answer.status, answer.cost, math.isnan(answer.lower_bound)) == (Status.FOUND, 0.0, True)


def test_an_open_resolution_is_given() -> None:
    seen = []

    @dataclass(frozen=True)
    class Asks(Given):
        def solve(self, problem: Problem | GraphProblem) -> Solution:
            seen.append(self.resolution)
            return straight(problem)

    for own in (None, 7):
        run(Asks(resolution=own), PROBLEM, 12)
    assert seen == [12, 7]


def test_building_and_proving_are_no_solving() -> None:
    def slow(problem: Problem, build_seconds: float) -> Solution:
        time.sleep(0.05)
        return replace(straight(problem), build_seconds=build_seconds, certificate_seconds=0.02)

    assert run(Given(partial(slow, build_seconds=0.0)), PROBLEM).seconds >= 0.03
    # nobody was faster than nothing
    assert run(Given(partial(slow, build_seconds=100.0)), PROBLEM).seconds == 0.0


def test_weighed_pairs_count_as_evaluations() -> None:
    assert run(OnGraph(), PROBLEM.on_lattice(3)).evaluations == PROBLEM.on_lattice(3).graph.n_pairs

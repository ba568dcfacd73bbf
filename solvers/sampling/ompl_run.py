"""
Runs of OMPL's planners within a budget, their paths judged by the oracle while they search.

OMPL can tell Python neither its intermediate paths nor its progress. So an anytime planner is stopped whenever its best
cost has fallen, hands over its path, and goes on where it was; that changes nothing in its search.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ompl import base as ob
from ompl import geometric as og

from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.solvers.budget import Budget, BudgetSpentError, Incumbent, Meter
from cgla_graph.solvers.sampling import ompl_space


def builder(name: str, **settings: object) -> Callable[[Any], Any]:
    """Return a function that builds a planner of `ompl.geometric` from its space information, by names of setters."""

    def build(si: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
        built = getattr(og, name)(si)
        for setting, value in settings.items():
            getattr(built, f"set{setting}")(value)
        return built

    return build


@dataclass
class Watch:
    """
    A termination condition: true when the best cost has fallen, or the budget is spent.

    OMPL asks it before every iteration. It counts, so that the same seed gives the same path on a machine of any
    speed.
    """

    meter: Meter
    best_cost: Callable[[], float]
    known: float = math.inf
    improved: bool = False

    def __call__(self) -> bool:
        """Say whether the planner has to stop."""
        cost = self.best_cost()
        if cost < self.known:
            self.known, self.improved = cost, True
            return True
        if self.meter.spent:
            return True
        self.meter.iterations += 1
        return False


def run_anytime(
    problem: Problem,
    build: Callable[[Any], Any],
    budget: Budget,
    seed: int,
    objective: Callable[[Any, Problem, Meter], Any] = ompl_space.SegmentCost,
) -> Solution:
    """
    Run an anytime planner until its budget is spent, or it says that it can do no better.

    Parameters
    ----------
    problem
        The problem to solve.
    build
        Makes the planner from OMPL's space information.
    budget
        Evaluations are never more than it says; seconds may be exceeded by one call of a planner's own code (OMPL's
        nearest neighbours, between two questions of cost or validity), and by judging one path.
    seed
        From 1 to 2^32 - 1.
    objective
        Makes OMPL's view of the cost from its space information, the problem and the meter.

    Returns
    -------
    solution
        The best path that the oracle saw, with a trace of every improvement.
    """
    meter = budget.start()
    incumbent = Incumbent(problem, meter)
    reason = ""
    try:
        si = ompl_space.space_information(problem, seed, meter)
        pdef = ompl_space.definition(problem, si, objective(si, problem, meter))
        planner = _ready(build(si), pdef)
        # the first call only takes the start and the goal
        planner.solve(ob.plannerAlwaysTerminatingCondition())
        ompl_space.mark_sampler(si, pdef)
        watch = Watch(meter, lambda: float(planner.bestCost().value()))
        watch.improved = True
        while watch.improved:
            watch.improved = False
            # otherwise OMPL would choose among the paths of all stops
            pdef.clearSolutionPaths()
            status = planner.solve(ob.PlannerTerminationCondition(watch))
            # for OMPL an approximate solution is a success; here only a path to the goal counts
            if status.getStatus() == ob.PlannerStatus.EXACT_SOLUTION:
                incumbent.offer(ompl_space.waypoints(problem, pdef), float(planner.bestCost().value()))
            reason = f"OMPL ended it: {status.asString()}"
    except BudgetSpentError as spent:
        reason = str(spent)
    return incumbent.solution(meter.spent or reason)


def run_once(problem: Problem, build: Callable[[Any], Any], budget: Budget, seed: int) -> Solution:
    """Run a planner that finds one path and ends; if the budget is spent before, it has found nothing."""
    meter = budget.start()
    incumbent = Incumbent(problem, meter)
    try:
        si = ompl_space.space_information(problem, seed, meter)
        objective = ompl_space.SegmentCost(si, problem, meter)
        pdef = ompl_space.definition(problem, si, objective)
        planner = _ready(build(si), pdef)
        status = planner.solve(ob.PlannerTerminationCondition(lambda: bool(meter.spent)))
        reason = f"OMPL ended it: {status.asString()}"
        if status.getStatus() == ob.PlannerStatus.EXACT_SOLUTION:
            path = ompl_space.waypoints(problem, pdef)
            incumbent.offer(path, objective.total(path))
    except BudgetSpentError as spent:
        reason = str(spent)
    return incumbent.solution(meter.spent or reason)


def _ready(planner: Any, pdef: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
    planner.setProblemDefinition(pdef)
    planner.setup()
    return planner

"""RRT* of OMPL over the exact segment cost."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cgla_graph._validate import positive_number
from cgla_graph.errors import ProblemError, SolverSettingError
from cgla_graph.problem import Problem
from cgla_graph.solution import NEGATIVE_WEIGHTS, Solution, Status
from cgla_graph.solvers.base import LARGEST_SEED, Traits, whole_setting


@dataclass(frozen=True)
class RrtStar:
    """
    OMPL's RRT* (Karaman, Frazzoli, IJRR 30(7), 2011): an anytime tree that approaches the continuous optimum.

    Attributes
    ----------
    iterations
        Budget; iterations and not seconds, so that a seed gives the same path on every machine.
    seed
        From 1 (OMPL refuses 0) to 2^32 - 1.
    rewire_factor
        Scales the number of neighbours looked at; OMPL's default is 1.1. Below 1 the proof of optimality is void,
        yet more iterations fit into the same time.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> RrtStar(iterations=200, seed=1).solve(problem).status.label
    'found'
    """

    iterations: int = 2000
    seed: int = 1
    rewire_factor: float = 1.1

    traits: ClassVar[Traits] = Traits(
        "rrt-star", "OMPL's RRT* over the same cost", domain="plane", anytime=True, seeded=True, needs=("ompl",)
    )

    def __post_init__(self) -> None:
        """Check the settings."""
        whole_setting("rrt-star", "iterations", self.iterations, at_least=1)
        whole_setting("rrt-star", "seed", self.seed, at_least=1, at_most=LARGEST_SEED)
        try:
            positive_number("rewire_factor", self.rewire_factor)
        except ProblemError as error:
            msg = f"rrt-star: {error}"
            raise SolverSettingError(msg) from error

    def solve(self, problem: Problem) -> Solution:
        """Grow the tree until the budget is used up."""
        if not problem.field.is_probability:
            return Solution(Status.UNSUPPORTED, message=NEGATIVE_WEIGHTS)
        from ompl import base as ob  # noqa: PLC0415 - optional
        from ompl import geometric as og  # noqa: PLC0415 - optional

        from cgla_graph.solvers import ompl_space  # noqa: PLC0415 - needs the optional package

        si = ompl_space.space_information(problem, self.seed)
        objective = ompl_space.SegmentCost(si, problem)
        pdef = ompl_space.definition(problem, si, objective)
        planner = og.RRTstar(si)
        planner.setRewireFactor(self.rewire_factor)
        planner.setProblemDefinition(pdef)
        planner.setup()
        budget = ompl_space.Budget(
            self.iterations, lambda: objective.evaluations, lambda: float(planner.bestCost().value())
        )
        status = planner.solve(ob.PlannerTerminationCondition(budget))
        evaluations = int(objective.evaluations)
        # an approximate solution is true in OMPL's eyes; here only a path to the goal counts
        if status.getStatus() != ob.PlannerStatus.EXACT_SOLUTION:
            return Solution(Status.NOT_FOUND, evaluations=evaluations, message=f"{self.iterations} iterations")
        states = pdef.getSolutionPath().getStates()
        path = np.array([(state[0], state[1]) for state in states])
        cost = float(planner.bestCost().value())
        return Solution(Status.FOUND, path=path, cost=cost, evaluations=evaluations, trace=tuple(budget.trace))

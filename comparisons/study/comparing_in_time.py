"""Solvers of maps that change in time beside each other, against one proven bound."""

import inspect
from collections.abc import Iterable
from dataclasses import replace

from cgla_graph._validate import instance, items, whole_number
from cgla_graph.solvers.timed.solving_timed import TIMED_SOLVERS, proven_in_time, solve_timed
from cgla_graph.timed.space_time_proof import TOLERANCE
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem


def compare_in_time(
    problem: TimedProblem,
    solvers: Iterable[str] | None = None,
    *,
    seeds: int = 1,
    tolerance: float | None = TOLERANCE,
) -> tuple[TimedPlan, ...]:
    """
    Plan with several solvers; the oracle judges all flights alike, and one proof bounds what any could cost.

    Parameters
    ----------
    problem
        A timed problem.
    solvers
        Names of solvers; None: all of them.
    seeds
        How often randomised solvers plan, each time from another seed.
    tolerance
        As `cgla_graph.solve` takes it, for the proof, which is held against the best flight; None: no proof.

    Returns
    -------
    plans
        One for each solver and seed, in their order, all with the same bound.

    Raises
    ------
    CglaError
        If there is no such solver, or a setting is out of range.

    Examples
    --------
    >>> plans = compare_in_time(TimedProblem((0, 0), (1, 0), speed=1.0), ["space-time", "space-time-lattice"])
    >>> [(plan.solver, round(plan.cost, 9), round(plan.gap, 6)) for plan in plans]
    [('space-time', 1.0, 0.0), ('space-time-lattice', 1.0, 0.0)]
    """
    instance("problem", problem, TimedProblem, "TimedProblem(start, goal, …)")
    whole_number("seeds", seeds, at_least=1, at_most=1000)
    plans = []
    for name in TIMED_SOLVERS if solvers is None else items("solvers", solvers, "a list of names of solvers"):
        plan = solve_timed(problem, name, tolerance=None)
        plans.append(plan)
        if "seed" in inspect.signature(TIMED_SOLVERS[name]).parameters:
            for seed in range(1, seeds):
                again = solve_timed(problem, name, tolerance=None, seed=seed)
                plans.append(replace(again, solver=f"{name}:seed={seed}"))
    if tolerance is None or not plans:
        return tuple(plans)
    proven = proven_in_time(problem, min(plans, key=lambda plan: plan.cost), tolerance)
    shared = {"lower_bound": proven.lower_bound, "certificate": proven.certificate}
    return tuple(replace(plan, **shared) for plan in plans)

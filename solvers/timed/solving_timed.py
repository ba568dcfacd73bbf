"""`solve` for timed problems: one answer that the oracle has judged."""

import inspect
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from cgla_graph._progress import showing
from cgla_graph._text import shown
from cgla_graph.errors import SolverSettingError, UnknownSolverError
from cgla_graph.model.solution import Status
from cgla_graph.solvers.timed.found_flight import FoundFlight
from cgla_graph.solvers.timed.passing import with_others
from cgla_graph.solvers.timed.planning import plan_in_time
from cgla_graph.solvers.timed.replanning import replan
from cgla_graph.solvers.timed.space_time_lattice import plan_on_lattice
from cgla_graph.solvers.timed.space_time_rrt_star import plan_by_rrt_star
from cgla_graph.timed.space_time_proof import MOST_CELLS, TOLERANCE, TimedCertificate, check_settings, timed_lower_bound
from cgla_graph.timed.timed_evaluation import Timed, timed_rows
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem

#: The solvers of timed problems by name; the first is the default.
TIMED_SOLVERS: Mapping[str, Callable[..., FoundFlight]] = {
    "space-time": plan_in_time,
    "space-time-lattice": plan_on_lattice,
    "space-time-rrt-star": plan_by_rrt_star,
    "replanning": replan,
}


def solve_timed(
    problem: TimedProblem,
    solver: object = None,
    *,
    tolerance: float | None = TOLERANCE,
    max_cells: int = MOST_CELLS,
    **settings: Any,  # noqa: ANN401
) -> TimedPlan:
    """
    Plan a flight through risk that moves, have the oracle judge it, and prove how good it is.

    Parameters
    ----------
    problem
        A timed problem.
    solver
        A name of `TIMED_SOLVERS`; None: ``space-time``.
    tolerance, max_cells
        As `timed_lower_bound` takes them: the proof takes seconds to a minute. A tolerance of None: no proof.
    **settings
        Settings of that solver.

    Returns
    -------
    plan
        Its numbers are the oracle's. If no flight was found, the status says so.

    Raises
    ------
    UnknownSolverError, SolverSettingError
        If there is no such solver, or a setting is wrong.

    Examples
    --------
    >>> from cgla_graph.timed.moving import MovingThreat
    >>> storm = MovingThreat([(0, 0.5, 0.9), (1, 0.5, 0.1)], spread=0.1)
    >>> problem = TimedProblem((0.1, 0.5), (0.9, 0.5), moving=[storm], k=5.0, speed=0.8)
    >>> plan = solve_timed(problem, nodes=20_000, tolerance=None)
    >>> plan.status.label, bool(plan.cost < problem.evaluate(problem.fly([(0.1, 0.5), (0.9, 0.5)])).cost)
    ('found', True)
    """
    name = next(iter(TIMED_SOLVERS)) if solver is None else solver
    if not isinstance(name, str) or name not in TIMED_SOLVERS:
        msg = f"solver is {shown(solver)}; a timed problem is solved by one of {', '.join(TIMED_SOLVERS)}"
        raise UnknownSolverError(msg)
    plan = TIMED_SOLVERS[name]
    known = [parameter for parameter in inspect.signature(plan).parameters if parameter != "problem"]
    for setting in settings:
        if setting not in known:
            msg = f"{name} has no setting {shown(setting)}; it has tolerance, max_cells, {', '.join(known)}"
            raise SolverSettingError(msg)
    if tolerance is not None:
        check_settings(tolerance, max_cells)
    with showing(f"planning with {name}"):
        began = time.perf_counter()
        found = plan(problem, **settings)
        seconds = time.perf_counter() - began
    answer = judged(problem, found, name, seconds)
    return answer if tolerance is None else proven_in_time(problem, answer, tolerance, max_cells)


def proven_in_time(problem: TimedProblem, plan: TimedPlan, tolerance: float, max_cells: int = MOST_CELLS) -> TimedPlan:
    """Return a plan with a proven bound of the cost of all flights; without a flight, the bound is that of the way."""
    proof = _proof(problem, plan, tolerance, max_cells)
    status = Status.NO_PATH if math.isinf(proof.lower_bound) and not plan.status.has_path else plan.status
    return replace(plan, status=status, lower_bound=proof.lower_bound, certificate=proof)


def _proof(problem: TimedProblem, plan: TimedPlan, tolerance: float, max_cells: int) -> TimedCertificate:
    """
    Bound the cost of all flights.

    Among others, flights without these are bounded first, around the best one, and pay tolls if that is not enough.
    """
    if not problem.others or not plan.status.has_path or problem.constant_wind is None:
        known = plan.trajectory if plan.status.has_path else None
        proof = timed_lower_bound(problem, known, tolerance=tolerance, max_cells=max_cells)
        left_out = bool(problem.others) and not proof.reached
        return replace(proof, message=f"{proof.message}; others are left out") if left_out else proof
    free = replace(problem, others=())
    alone = min(judged(free, plan_in_time(free), plan.solver, 0.0), plan, key=lambda one: one.cost)
    proof = timed_lower_bound(free, alone.trajectory, tolerance=tolerance, max_cells=max_cells)
    return with_others(problem, plan, alone, replace(proof, upper_bound=plan.cost), max_cells)


def bound_in_time(
    problem: TimedProblem, path: Timed | None, tolerance: float | None, max_cells: int | None
) -> TimedCertificate:
    """Bound the cost of all flights, held against a path or that of the default solver (`cgla_graph.lower_bound`)."""
    aim, most = TOLERANCE if tolerance is None else tolerance, MOST_CELLS if max_cells is None else max_cells
    if path is None:
        return _proof(problem, solve_timed(problem, tolerance=None), aim, most)
    plan = judged(problem, FoundFlight(Status.FOUND, timed_rows(path)), "", 0.0)
    if not plan.status.has_path:
        # (it says why)
        return timed_lower_bound(problem, path, tolerance=aim, max_cells=most)
    return _proof(problem, plan, aim, most)


def judged(problem: TimedProblem, found: FoundFlight, name: str, seconds: float) -> TimedPlan:
    """Return what a search found, with the numbers of the oracle."""
    numbers: dict[str, Any] = {"solver": name, "seconds": seconds, "evaluations": found.evaluations}
    numbers |= {"message": found.message, "departures": found.departures, "problem": problem}
    if not found.status.has_path:
        return TimedPlan(found.status, **numbers)
    seen = problem.evaluate(found.rows)
    at_ends = tuple(found.rows[0, 1:]) == problem.start and tuple(found.rows[-1, 1:]) == problem.goal
    if not seen.feasible or not at_ends:
        reason = seen.violations[0] if seen.violations else "it does not lead from start to goal"
        numbers["message"] = f"its flight is not feasible: {reason}"
        return TimedPlan(Status.FAILED, **numbers)
    names = ("cost", "departure", "arrival", "air_distance", "ground_distance", "waiting", "risk", "clearance")
    rows = found.rows.copy()
    rows.flags.writeable = False
    numbers |= {each: float(getattr(seen, each)) for each in names}
    return TimedPlan(found.status, rows, **numbers)

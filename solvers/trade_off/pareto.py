"""
Trade-off between risk and length over all risk weights.

Every path is a point ``(risk, length)``. The paths that have least cost ``length + k * risk`` for some `k` are the
corners of the lower left convex hull of these points, and the least cost itself, as a function of `k`, is concave:
each path bounds it from above by a line, and each exact solve gives one of its values.
"""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cgla_graph._progress import Tell, showing
from cgla_graph._validate import items, non_negative_number, positive_number, truth_value
from cgla_graph.errors import ProblemError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, Status
from cgla_graph.model.solver import Solver
from cgla_graph.solvers.base import Whole
from cgla_graph.solvers.continuous.hybrid import Hybrid
from cgla_graph.solvers.trade_off.constrained import plan_with
from cgla_graph.solvers.trade_off.front import ROUNDING, Front, growing_weights, lower_hull, points_of
from cgla_graph.solvers.trade_off.plan_within import PlanWithin
from cgla_graph.solvers.trade_off.proven_front import ProvenSearch
from cgla_graph.solvers.trade_off.reweighing import Reweighed
from cgla_graph.solvers.trade_off.weight_bounds import WeightBounds

#: How much a front may cost above the best by default, relative to the cost, where no lattice is exact.
TOLERANCE = 1e-3
#: The same where it is proven, and the greatest weight then.
TOLERANCE_OF_PROOF, MOST_WEIGHT = 0.005, 1000.0
#: The front ends where a step lowers the risk by no more than this, relative to the shortest path's.
LEAST_RISK = 1e-3


def pareto(
    problem: Problem,
    *,
    solver: str | Solver | None = None,
    resolution: int | tuple[int, int] | Lattice = 20,
    tolerance: float | None = None,
    max_points: int = 100,
    k_max: float | None = None,
    proven: bool = False,
    budgets: Sequence[float] = (),
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> Front:
    """
    Find the paths that are cheapest under some risk weight: the trade-off between risk and length.

    Two neighbours on the front cost the same under one weight, ``(L2 - L1) / (R1 - R2)``. A solve there finds a path
    between them, or shows that there is none (Aneja, Nair, Management Science 25(1), 1979). The pair comes first
    between which a path could be cheapest, relative to its cost (Cohon, Church, Sheer, Water Resources Research
    15(5), 1979). With an exact graph solver the front is complete for its lattice; with a solver of the plane it holds
    the paths that the solver finds, without those that are cheapest under no weight.

    Parameters
    ----------
    problem
        The map; its own `k` is ignored.
    solver
        A name or a solver; None: `hybrid`.
    resolution
        For solvers that need a lattice, as in `solve`; graph solvers share it.
    tolerance
        End when no path can be cheaper than the front by more than this, relative to its cost. None: 0 with an
        exact graph solver, so that the front is complete; 0.001 with others; 0.005 with `proven`.
    max_points
        End the search between the points once there are this many, at least 2; `Front.error` then bounds the loss.
    k_max
        The greatest weight; None: 1000 with `proven`; else grow it tenfold until that lowers the risk by no more than
        a thousandth of the shortest path's.
    proven
        Whether to prove for every weight from 0 to `k_max` how much cheaper any path inside the bounds of the map may
        be (`Front.bounds`, `Front.gap`). With `hybrid`, the front holds the paths that the proofs find as well; with
        another solver only its own, and `tolerance` is that of the proofs.
    budgets
        With `proven`: budgets of risk. For each, the front has the shortest path within it, and a bound of all such
        paths, as `plan_within_risk` finds them (`Front.budgets`).
    **settings
        Settings of a solver given by name.

    Returns
    -------
    front
        Its points are judged by the oracle. If there is no path, the status says so.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError, SolverSettingError
        If there is no such solver, it cannot run here, or a setting is wrong.
    ProblemError
        If the problem or the resolution is malformed, or a number is out of range.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0.5), (1, 0.5), RiskField([Threat(0.5, 0.5, spread=0.1)]))
    >>> front = pareto(problem, solver="cgla", resolution=5)
    >>> [(round(point.k_low, 2), round(point.length, 3), round(point.risk, 3)) for point in front][:3]
    [(0.0, 1.0, 0.251), (0.55, 1.118, 0.036), (3.66, 1.207, 0.011)]
    """
    truth_value("proven", proven)
    risks = [non_negative_number("budgets", budget) for budget in items("budgets", budgets, "a list of numbers")]
    if proven:
        front, reweighed = _proven(problem, solver, resolution, tolerance, max_points, k_max, settings)
        return dataclasses.replace(front, budgets=tuple(_within(front, reweighed, risk) for risk in risks))
    if risks:
        msg = "budgets are planned with a proof; give proven=True as well, or use plan_within_risk"
        raise ProblemError(msg)
    reweighed = Reweighed(problem, solver, resolution=resolution, **settings)
    if tolerance is None:
        tolerance = 0.0 if reweighed.exact else TOLERANCE
    tolerance = non_negative_number("tolerance", tolerance)
    max_points = Whole(2)("max_points", max_points)
    k_max = None if k_max is None else positive_number("k_max", k_max)
    if not problem.field.is_proper:
        return Front((), Status.UNSUPPORTED, message=NEGATIVE_WEIGHTS)
    with showing("front of length against risk") as tell:
        shortest = reweighed.at(0.0)
        if not shortest.status.has_path:
            return Front((), shortest.status, n_solves=1, message=shortest.message)
        if k_max is not None:
            reweighed.at(k_max)
        else:
            risk = shortest.risk
            for k in growing_weights(shortest):
                before, risk = risk, reweighed.at(k).risk
                if not before - risk > LEAST_RISK * shortest.risk:
                    break
        error = _refine(reweighed, tolerance, max_points, tell)
    status = Status.OPTIMAL if reweighed.exact else Status.FOUND
    k_max = max(reweighed.solved)
    points = points_of(problem, reweighed.solved.items(), k_max)
    return Front(points, status, error, k_max, len(reweighed.solved))


def _proven(
    problem: Problem,
    solver: str | Solver | None,
    resolution: int | tuple[int, int] | Lattice,
    tolerance: float | None,
    max_points: int,
    k_max: float | None,
    settings: dict[str, Any],
) -> tuple[Front, Reweighed]:
    """Find a front, and prove it for all weights up to `k_max`; also return the problem with its solver."""
    wanted = positive_number("tolerance", TOLERANCE_OF_PROOF if tolerance is None else tolerance)
    k_max = positive_number("k_max", MOST_WEIGHT if k_max is None else k_max)
    reweighed = Reweighed(problem, solver, resolution=resolution, **settings)
    own = isinstance(reweighed.solver, Hybrid)
    if isinstance(reweighed.solver, Hybrid):
        # its paths are proven here
        reweighed.solver = dataclasses.replace(reweighed.solver, tolerance=None)
    front, searched = Front((), Status.NOT_FOUND), reweighed
    if not own or not problem.field.is_proper:
        # (with peaks above 1, it says so)
        front = pareto(problem, solver=reweighed.solver, resolution=resolution, max_points=max_points, k_max=k_max)
        searched = Reweighed(problem)
    if not problem.field.is_proper:
        nothing = WeightBounds(np.array([0.0]), np.array([math.nan]))
        return dataclasses.replace(front, k_max=k_max, bounds=nothing), reweighed
    search = ProvenSearch(searched, k_max, wanted, max_points, [(point.k, point.solution) for point in front])
    with showing("proof of a front") as tell:
        search.run(tell)
    bounds = search.bounds
    if own:
        points, shortest = points_of(problem, search.known, k_max), reweighed.at(0.0)
        status, message = (Status.FOUND, "") if points else (shortest.status, shortest.message)
        front = Front(points, status, n_solves=len(reweighed.solved), message=message)
    front = dataclasses.replace(front, k_max=k_max, bounds=bounds)
    if front.points:
        error = front.error if front.status is Status.OPTIMAL else 1.0 - 1.0 / (1.0 + front.gap)
        front = dataclasses.replace(front, error=error, message=search.remark(front.gap))
    elif math.isinf(bounds.at(0.0)):
        closed = "it is proven that no path joins start and goal inside the bounds"
        front = dataclasses.replace(front, status=Status.NO_PATH, message=closed)
    return front, reweighed


def _within(front: Front, reweighed: Reweighed, risk: float) -> PlanWithin:
    """Plan within a budget of risk; where the proofs of the front bound more than the plan's, theirs count."""
    plan = plan_with(reweighed, "risk", risk, TOLERANCE_OF_PROOF)
    by_front = float(front.least_length([risk])[0]) if plan.scope == "plane" else math.nan
    return dataclasses.replace(plan, dual_bound=by_front) if by_front > plan.dual_bound else plan


def _refine(reweighed: Reweighed, tolerance: float, max_points: int, tell: Tell) -> float:
    """Solve between neighbours on the hull, where the least cost is least certain; return the error that is left."""
    while True:
        hull = lower_hull(reweighed.solved.items())
        risk, length = np.array([(solution.risk, solution.length) for _, solution in hull]).T
        if len(hull) == 1:
            return 0.0
        weights = np.array(sorted(reweighed.solved))
        between = -np.diff(length) / np.diff(risk)
        # concave in k: above its chords between the weights solved, below the line of every path
        floor = np.interp(between, weights, (length + np.outer(weights, risk)).min(axis=1))
        errors = 1.0 - floor / (length + np.outer(between, risk)).min(axis=1)
        errors[np.isin(between, weights)] = 0.0
        worst = int(np.argmax(errors))
        if errors[worst] <= max(tolerance, ROUNDING) or len(hull) >= max_points:
            return max(0.0, float(errors[worst]))
        tell(f"{len(hull)} paths, others at most {errors[worst]:.2%} cheaper")
        reweighed.at(float(between[worst]))

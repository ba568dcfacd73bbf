"""`solve` and `lower_bound`: one answer that the oracle has judged, and the proof of how good it is."""

import dataclasses
import math
import time
from functools import partial
from types import NoneType
from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._progress import showing
from cgla_graph._text import shown
from cgla_graph._validate import instance, truth_value
from cgla_graph.errors import ProblemError, SolverSettingError
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import FULL_UP_TO, GraphProblem, Problem, problem_wanted
from cgla_graph.model.solution import TOLERANCE, Solution, Status, TracePoint, is_refuted, refuted
from cgla_graph.model.solver import Solver, run, trivial_solution, with_bounds_of
from cgla_graph.refine.refine import refine_path
from cgla_graph.solvers import registry
from cgla_graph.solvers.warm_up import warm_up, warm_up_restricted
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem

if TYPE_CHECKING:
    from cgla_graph.certificate.certificate import Certificate
    from cgla_graph.solvers.uncertain.outlook import Objective
    from cgla_graph.timed.space_time_proof import TimedCertificate
    from cgla_graph.timed.timed_evaluation import Timed


@overload
def solve(
    problem: TimedProblem,
    solver: str | None = None,
    **settings: Any,  # noqa: ANN401
) -> TimedPlan: ...
@overload
def solve(
    problem: Problem | GraphProblem,
    solver: str | Solver | None = None,
    *,
    resolution: int | tuple[int, int] | Lattice = 20,
    on: GraphProblem | None = None,
    refine: bool = False,
    isolated: bool = False,
    objective: "Objective | None" = None,
    alpha: float | None = None,
    **settings: Any,  # noqa: ANN401
) -> Solution: ...
def solve(
    problem: Problem | GraphProblem | TimedProblem,
    solver: str | Solver | None = None,
    *,
    resolution: int | tuple[int, int] | Lattice = 20,
    on: GraphProblem | None = None,
    refine: bool = False,
    isolated: bool = False,
    objective: "Objective | None" = None,
    alpha: float | None = None,
    **settings: Any,
) -> Solution | TimedPlan:
    """
    Solve a problem and have the oracle judge the answer.

    If the field is an `UncertainField`, the cost is the expected one, unless an objective says otherwise.

    Parameters
    ----------
    problem
        A `Problem` in the plane, which every solver takes, a `GraphProblem`, which graph solvers take, or a
        `TimedProblem`, whose answer is a `TimedPlan`.
    solver
        A name (see `cgla_graph.solvers.names`) or a solver. None: `hybrid` for a `Problem`, `cgla` for a
        `GraphProblem`. A `TimedProblem` has solvers of its own
        (`cgla_graph.solvers.timed.solving_timed.solve_timed`), which take settings alone.
    resolution
        For solvers that need a lattice: points a side, or a `Lattice`.
    on
        The same problem laid on a graph before, to share its weights between graph solvers:
        ``problem.on_lattice(20).with_weights_held()``.
    refine
        Whether to refine the solver's path in the plane (`cgla_graph.refine.refine.refine_path`). The time and the
        evaluations that this takes are added to the solver's.
    isolated
        Whether to run the solver in a process of its own, to which it and the problem are sent, so that it may crash or
        hang. OMPL's, and plug-ins given by name, run there in any case. A solver of yours runs in your process, where
        you can debug it; then the problem is compared with what it was.
    objective
        For uncertain risk: ``expected``, ``cvar`` (the mean cost in the worst ``1 - alpha`` of all cases) or ``worst``
        (the costliest scenario). The answer is then an `UncertainSolution`, which proves the objective. A solver of the
        plane finds candidates under several weights of the scenarios, and these are refined; a graph solver plans on
        its lattice, and an exact one is followed by an exact search. The setting ``tolerance`` is the gap that the
        proof aims at in the plane, 0.01 by default; None: no proof. None: the expected cost, as for any problem.
    alpha
        For ``cvar``: from 0, the expectation, to 1, the worst case; None: 0.9.
    **settings
        Settings of a solver given by name, or of the default one.

    Returns
    -------
    solution
        Its numbers are the oracle's; the time to weigh the graph is apart from the time to solve, and kernels are
        compiled before either is taken. If no path was found, the status says so.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError, SolverSettingError
        If there is no such solver, it cannot run here, or a setting is wrong.
    ProblemError
        If `problem` is no problem, the resolution is malformed, or a `GraphProblem` is to be refined.
    SolverFaultError
        If the solver's answer is no `Solution`, or it changed its problem.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> field = cg.RiskField([cg.Threat(x=0.5, y=0.55, spread=0.1, peak=0.9)])
    >>> problem = cg.Problem(start=(0.1, 0.1), goal=(0.9, 0.9), field=field, k=10.0)
    >>> on_lattice = cg.solve(problem, solver="cgla", resolution=20)
    >>> on_lattice.status.label, bool(on_lattice.cost < problem.evaluate([problem.start, problem.goal]).cost)
    ('optimal', True)
    >>> best = cg.solve(problem)
    >>> best.solver, best.status.label, bool(best.lower_bound <= best.cost < on_lattice.cost)
    ('hybrid', 'found', True)

    Where the threat is, is uncertain; the path is the best in the worse of the two cases.

    >>> elsewhere = cg.RiskField([cg.Threat(x=0.6, y=0.5, spread=0.1, peak=0.9)])
    >>> uncertain = dataclasses.replace(problem, field=cg.UncertainField([field, elsewhere]))
    >>> worst = cg.solve(uncertain, objective="worst")
    >>> bool(worst.lower_bound <= worst.cost == worst.costs.max() < uncertain.field.costs(uncertain, best.path).max())
    True
    """
    if isinstance(problem, TimedProblem):
        from cgla_graph.solvers.timed.solving_timed import solve_timed  # noqa: PLC0415 - rarely needed

        given: dict[str, Any] = {
            "on": on,
            "refine": refine,
            "isolated": isolated,
            "objective": objective,
            "alpha": alpha,
        }
        more: dict[str, Any] = {} if resolution == 20 else {"resolution": resolution}  # noqa: PLR2004 - the default
        return solve_timed(problem, solver, **settings, **more, **{name: one for name, one in given.items() if one})
    if alpha is not None and objective is None:
        msg = f"alpha is {shown(alpha)}, and there is no objective; give objective='cvar'"
        raise ProblemError(msg)
    # (under an objective, it is the proof's, whichever solver finds the paths)
    proof = settings.pop("tolerance", 0.01) if objective is not None else None
    if solver is None:
        solver = "cgla" if isinstance(problem, GraphProblem) else "hybrid"
    chosen = registry.ready(solver, settings)
    instance("problem", problem, (Problem, GraphProblem), partial(problem_wanted, on_graph=True))
    instance("on", on, (GraphProblem, NoneType), "a GraphProblem, as problem.on_lattice(20)")
    for name, switch in (("refine", refine), ("isolated", isolated)):
        truth_value(name, switch, SolverSettingError)
    # (the traits of a plug-in say so, unless it cannot be marked)
    isolated = isolated or (isinstance(solver, str) and not registry.is_built_in(solver))
    if refine and isinstance(problem, GraphProblem):
        msg = "a GraphProblem has only its edges, which no path can leave; give a Problem to refine its path"
        raise ProblemError(msg)
    with showing(f"planning with {chosen.traits.name}"):
        kind = MapKind.of(problem.graph.model if isinstance(problem, GraphProblem) else problem.model)
        warm_up(chosen, kind, refine=refine)
        if objective is not None:
            from cgla_graph.solvers.uncertain.under_objective import solve_under  # noqa: PLC0415 - rarely needed

            options: dict[str, Any] = {
                "resolution": resolution,
                "on": on,
                "refine": refine,
                "isolated": isolated,
                "tolerance": proof,
            }
            return solve_under(problem, chosen, objective, alpha, **options)
        if isinstance(problem, GraphProblem):
            warm_up_restricted(chosen, problem.graph.n_nodes, kind)
            return run(chosen, problem, apart=isolated)
        answer = _solve_in_plane(problem, chosen, resolution, on, isolated)
        return refined(problem, answer) if refine else answer


@overload
def lower_bound(
    problem: TimedProblem, tolerance: float = ..., *, path: "Timed | None" = None, max_cells: int | None = None
) -> "TimedCertificate": ...
@overload
def lower_bound(
    problem: Problem, tolerance: float = ..., *, path: ArrayLike | None = None, max_cells: int | None = None
) -> "Certificate": ...
def lower_bound(
    problem: Problem | TimedProblem,
    tolerance: float | None = None,
    *,
    path: "Timed | None" = None,
    max_cells: int | None = None,
) -> "Certificate | TimedCertificate":
    """
    Bound the cost of every path from below.

    Parameters
    ----------
    problem
        The problem; its no-fly area counts, and its clearance. Of a `TimedProblem`, the bound is a `TimedCertificate`.
    tolerance
        Refine the grid until ``upper_bound / lower_bound - 1`` is at most this; None: 0.005, or 0.01 in time.
    path
        A feasible path from start to goal, shape ``(m, 2)``, that the bound is held against; rows ``(t, x, y)`` of a
        timed problem. None: that of the default solver, or a better one that the proof finds.
    max_cells
        Cells of a grid, at most, about 300 bytes each; None: 2.5 million, fewer beside rasters of more than 20 million
        cells; 1.5 million in time.

    Returns
    -------
    certificate
        The bound, proven whether or not the tolerance was reached; its message says why it ended. For fields with
        peaks above 1 there is no bound: it is NaN. `solve` with `hybrid` proves the same bound of its own path.

    Raises
    ------
    ProblemError
        If the tolerance is not positive, `max_cells` is below 16 384, or the path is not feasible from start to goal.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> field = cg.RiskField([cg.Threat(x=0.5, y=0.5, spread=0.1, peak=0.9)])
    >>> problem = cg.Problem(start=(0.1, 0.1), goal=(0.9, 0.9), field=field, k=10.0)
    >>> certificate = cg.lower_bound(problem)
    >>> certificate.reached, certificate.lower_bound <= certificate.upper_bound
    (True, True)
    >>> best = cg.solve(problem)
    >>> cg.lower_bound(problem, path=best.path).lower_bound == best.lower_bound
    True
    """
    if isinstance(problem, TimedProblem):
        from cgla_graph.solvers.timed.solving_timed import bound_in_time  # noqa: PLC0415 - rarely needed

        return bound_in_time(problem, path, tolerance, max_cells)
    from cgla_graph.certificate import certificate  # noqa: PLC0415 - not needed to solve on a graph

    instance("problem", problem, Problem, problem_wanted)
    tolerance = TOLERANCE if tolerance is None else tolerance
    most = certificate.usual_cells(problem) if max_cells is None else max_cells
    certificate.check_settings(tolerance, most)
    if path is not None:
        return certificate.prove(problem, cast("ArrayLike", path), tolerance=tolerance, max_cells=most)
    found = solve(problem, "hybrid", tolerance=None)
    held = found.path if found.status.has_path else None
    proof = certificate.prove(problem, held, tolerance=tolerance, max_cells=most, keeps_path=False)
    return dataclasses.replace(proof, seconds=proof.seconds + found.total_seconds)


def proven(
    problem: Problem, solution: Solution, tolerance: float = TOLERANCE, *, max_cells: int | None = None
) -> Solution:
    """
    Prove how good a judged answer is: `lower_bound` with its path in hand.

    Parameters
    ----------
    problem
        The problem that was solved.
    solution
        The judged answer; without a path the bound is proven as well.
    tolerance, max_cells
        As `lower_bound` takes them.

    Returns
    -------
    solution
        With the `certificate`, and its bound where that is better than the solver's own. If the solver has proven this
        path under the same tolerance, its own certificate is kept.

    Raises
    ------
    ProblemError
        As `lower_bound`.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> on_lattice = proven(problem, cg.solve(problem, "cgla"))
    >>> bool(on_lattice.lower_bound == on_lattice.certificate.lower_bound < on_lattice.cost)
    True
    """
    own = solution.certificate
    known = own is not None and own.tolerance == tolerance and max_cells is None
    if not (known and np.array_equal(own.path, solution.path)):
        path = solution.path if solution.status.has_path else None
        own = lower_bound(problem, tolerance, path=path, max_cells=max_cells)
        solution = dataclasses.replace(solution, certificate_seconds=own.seconds)
    if math.isfinite(solution.claimed_bound):
        # (the certificate compares the solver's own path)
        solution = refuted(solution, solve(problem, "hybrid", tolerance=None).cost, "that of hybrid")
    return bounded(solution, own)


def bounded(solution: Solution, certificate: "Certificate | None") -> Solution:
    """
    Attach a certificate to an answer, which fails if its path costs less than the bound, or its claim is refuted.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> problem = cg.Problem((0.1, 0.1), (0.9, 0.1))
    >>> straight = cg.solve(problem, "straight-line")
    >>> bounded(straight, cg.lower_bound(problem, path=straight.path)).gap
    0.0
    """
    solution = dataclasses.replace(solution, certificate=certificate)
    if certificate is not None:
        solution = refuted(solution, certificate.upper_bound, "that of the certificate")
    if certificate is None or math.isnan(certificate.lower_bound):
        return solution
    if not solution.lower_bound >= certificate.lower_bound:
        solution = dataclasses.replace(solution, lower_bound=certificate.lower_bound)
    cost = solution.cost
    if solution.status.has_path and is_refuted(cost, certificate.lower_bound):
        message = (
            f"its path costs {cost:.9g}, but the certificate says that none costs less than "
            f"{certificate.lower_bound:.9g}; one of the two is wrong"
        )
        return dataclasses.replace(solution, status=Status.FAILED, message=message)
    return solution


def refined(problem: Problem, solution: Solution, *, tolerance: float = 1e-6, max_points: int = 1000) -> Solution:
    """
    Refine the path of a judged solution, and judge it again.

    Parameters
    ----------
    problem
        The problem that was solved.
    solution
        The judged answer; without a path it is returned unchanged.
    tolerance, max_points
        As `cgla_graph.refine.refine.refine_path` takes them.

    Returns
    -------
    solution
        Never more expensive. Time and evaluations include the refinement's, and so does the trace, if there is one. A
        path that changed has no nodes, and is no optimum of a graph.
    """
    if not solution.status.has_path:
        return solution
    began = time.perf_counter()
    answer = refine_path(problem, solution.path, tolerance=tolerance, max_points=max_points)
    seconds = solution.seconds + time.perf_counter() - began
    evaluations = solution.evaluations + answer.evaluations
    longer = dataclasses.replace(solution, seconds=seconds, evaluations=evaluations)
    if np.array_equal(answer.path, solution.path):
        return dataclasses.replace(longer, message="; ".join(filter(None, [solution.message, answer.message])))
    trace = solution.trace and (
        *solution.trace,
        *(
            TracePoint(solution.seconds + moment.seconds, solution.evaluations + moment.evaluations, moment.cost)
            for moment in answer.trace
            if moment.cost < solution.trace[-1].cost
        ),
    )
    if trace and answer.cost < trace[-1].cost:
        # over rasters, leaving waypoints out at the end may gain more than rounding
        trace = (*trace, TracePoint(seconds, evaluations, answer.cost))
    message = f"refined: {answer.message}"
    found = dataclasses.replace(
        longer, status=Status.FOUND, path=answer.path, nodes=(), cost=answer.cost, trace=trace, message=message
    )
    return with_bounds_of(found, problem.judge(found))


def _solve_in_plane(
    problem: Problem,
    chosen: Solver,
    resolution: int | tuple[int, int] | Lattice,
    on: GraphProblem | None,
    isolated: bool,
) -> Solution:
    if chosen.traits.domain == "plane":
        return run(chosen, problem, resolution, apart=isolated)
    if problem.start == problem.goal:
        return trivial_solution(problem, chosen.traits.name)
    began = time.perf_counter()
    graph_problem = hold_affordable_weights(on or problem.on_lattice(resolution))
    laid = time.perf_counter() - began
    warm_up_restricted(chosen, graph_problem.graph.n_nodes, MapKind.of(problem.model))
    answer = run(chosen, graph_problem, apart=isolated)
    # a bound of the paths on a graph does not hold for those in the plane: the judge drops it
    return problem.judge(dataclasses.replace(answer, build_seconds=laid + answer.build_seconds))


def hold_affordable_weights(problem: GraphProblem) -> GraphProblem:
    """Weigh all pairs of a complete graph if their matrix is affordable; larger graphs weigh rows on request."""
    return problem.with_weights_held() if problem.graph.n_nodes <= FULL_UP_TO else problem

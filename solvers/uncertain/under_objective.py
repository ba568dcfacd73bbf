"""Solve a problem with uncertain risk under an objective, by any solver."""

import dataclasses
import time
from typing import Any, get_args

import numpy as np

from cgla_graph._progress import showing
from cgla_graph._validate import choice, positive_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import Solution, Status, is_refuted
from cgla_graph.model.solver import Solver, run, trivial_solution
from cgla_graph.model.uncertain.field import UncertainField
from cgla_graph.model.uncertain.tail_mean import TailMean
from cgla_graph.solvers.uncertain.on_graph import GraphSearch
from cgla_graph.solvers.uncertain.outlook import Objective, UncertainSolution
from cgla_graph.solvers.uncertain.planning import Search

#: What the mean of the worst costs is taken over where nothing is said.
ALPHA = 0.9


def tail_of(field: UncertainField, objective: Objective, alpha: float | None) -> TailMean:
    """
    Return an objective over the scenarios of a field.

    Raises
    ------
    ProblemError
        If there is no such objective, or alpha does not go with it.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> tail_of(UncertainField([RiskField()]), "worst", None).alpha
    1.0
    """
    choice("objective", objective, get_args(Objective))
    if objective == "cvar":
        return TailMean(field.probabilities, ALPHA if alpha is None else alpha)
    if alpha is not None:
        msg = f"alpha is {alpha}, and the objective {objective} takes none; give objective cvar"
        raise ProblemError(msg)
    return TailMean(field.probabilities, 0.0 if objective == "expected" else 1.0)


def solve_under(
    problem: Problem | GraphProblem,
    solver: Solver,
    objective: Objective,
    alpha: float | None = None,
    *,
    resolution: int | tuple[int, int] | Lattice = 20,
    on: GraphProblem | None = None,
    refine: bool = False,
    isolated: bool = False,
    tolerance: float | None = 0.01,
) -> UncertainSolution:
    """
    Find a path of least expected, mean worst or worst cost, with proof; `cgla_graph.solve` calls it.

    Parameters
    ----------
    problem
        In the plane, or on the graph of a lattice; a certain field is one scenario.
    solver
        Finds the paths of weighted sums of the scenarios.
    objective, alpha
        ``cvar`` takes alpha, the others do not.
    resolution, on, refine, isolated
        As `cgla_graph.solve` takes them.
    tolerance
        The gap to aim at in the plane; None: no proof.

    Returns
    -------
    solution
        Its cost is the objective.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> field = UncertainField([cg.RiskField([cg.Threat(0.5, y, 0.1)]) for y in (0.4, 0.6)])
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), field, k=10.0)
    >>> found = solve_under(problem, cg.solvers.get("dijkstra"), "worst", resolution=5)
    >>> found.status.label, bool(found.cost == found.costs.max())
    ('optimal', True)
    """
    if tolerance is not None:
        positive_number("tolerance", tolerance)
    began = time.perf_counter()
    field = _field_of(problem)
    tail = tail_of(field, objective, alpha)
    if isinstance(problem, GraphProblem) or (solver.traits.domain == "graph" and problem.start != problem.goal):
        laid = problem if isinstance(problem, GraphProblem) else on or problem.on_lattice(resolution)
        on_graph = _on_graph(problem, laid, field, tail, solver, objective, began)
        if isinstance(problem, GraphProblem) or not (refine and on_graph.status.has_path):
            return on_graph
    in_plane = dataclasses.replace(problem, field=field)
    if problem.start == problem.goal:
        stay = trivial_solution(in_plane, solver.traits.name)
        return _answered(in_plane, field, stay, tail, objective, began, lower_bound=stay.lower_bound)
    if "tolerance" in {one.name for one in dataclasses.fields(solver)}:  # type: ignore[arg-type] # solvers are dataclasses
        solver = dataclasses.replace(solver, tolerance=None)  # type: ignore[type-var] # (its own proofs are of others)

    def find(weighted: Problem) -> Solution:
        if solver.traits.domain == "graph":
            return weighted.judge(Solution(Status.FOUND, path=on_graph.path, solver=solver.traits.name))
        return run(solver, weighted, resolution, apart=isolated)

    search = Search(in_plane, tail, find, tolerance)
    named = {"expected": "expected cost", "worst": "worst cost", "cvar": f"mean of the worst {1.0 - tail.alpha:.3g}"}
    with showing(f"planning for the {named[objective]}"):
        found = search.run()
    answer = found.answer
    if len(found.path):
        answer = dataclasses.replace(answer, status=Status.FOUND, path=found.path, nodes=(), message=found.message)
    elif found.bound == np.inf:
        answer = dataclasses.replace(answer, status=Status.NO_PATH)
    numbers = {
        "lower_bound": found.bound, "weighted_bound": found.weighted_bound, "least_weighted": found.least_weighted,
        "weights": found.weights,
    }  # fmt: skip
    return _answered(in_plane, field, answer, tail, objective, began, solver=solver.traits.name, **numbers)


def _field_of(problem: Problem | GraphProblem) -> UncertainField:
    """Return the scenarios of a problem; a certain field is one."""
    if isinstance(problem, GraphProblem):
        model = problem.graph.model
        if model is None:
            msg = "the graph has weights of its own and no scenarios; give a Problem, or problem.on_lattice(20)"
            raise ProblemError(msg)
        field = model.field
    else:
        field = problem.field
    if isinstance(field, UncertainField):
        return field
    return UncertainField([field])


def _on_graph(
    problem: Problem | GraphProblem,
    laid: GraphProblem,
    field: UncertainField,
    tail: TailMean,
    solver: Solver,
    objective: Objective,
    began: float,
) -> UncertainSolution:
    """Search the graph, exactly where it is small, and tell of the path as of one in the plane."""
    build = time.perf_counter() - began
    found = GraphSearch(laid, field, tail, solver).run()
    answer = dataclasses.replace(found.answer, build_seconds=build)
    # a bound of the paths on a graph does not hold for those in the plane
    bound = found.bound if isinstance(problem, GraphProblem) else np.nan
    status = Status.OPTIMAL if found.is_optimal else Status.FOUND
    if not found.nodes:
        return _answered(problem, field, answer, tail, objective, began, lower_bound=bound)
    answer = dataclasses.replace(answer, status=status, path=found.path, nodes=found.nodes, message=found.message)
    numbers: dict[str, Any] = {"weights": found.weights, "least_weighted": found.weighted_bound}
    return _answered(
        problem,
        field,
        answer,
        tail,
        objective,
        began,
        lower_bound=bound,
        weighted_bound=found.weighted_bound,
        **numbers,
    )


def _answered(
    problem: Problem | GraphProblem,
    field: UncertainField,
    answer: Solution,
    tail: TailMean,
    objective: Objective,
    began: float,
    *,
    solver: str = "",
    **numbers: Any,  # noqa: ANN401 - attributes of the solution
) -> UncertainSolution:
    """Judge a path by the oracle, and tell its costs in all scenarios."""
    # (the judge compares the solver's cost with the expectation)
    plain = dataclasses.replace(answer, cost=np.inf, lower_bound=np.nan, claimed_bound=np.nan, certificate=None)
    judged = problem.judge(plain)
    named = {one.name: getattr(judged, one.name) for one in dataclasses.fields(Solution)}
    named |= {"solver": solver or answer.solver, "seconds": time.perf_counter() - began - answer.build_seconds}
    costs, sampler = np.empty(0), field.sampler
    if judged.status.has_path and len(judged.path):
        k = problem.k if isinstance(problem, Problem) else problem.graph.model.k  # type: ignore[union-attr] # it has one
        risks = field.risks(judged.path)
        costs = judged.length + k * risks
        named["cost"] = tail.of(costs)
        named["risk"] = float(tail.weights(costs) @ risks)
    bound = numbers.pop("lower_bound", np.nan)
    known = {"objective": objective, "alpha": tail.alpha, "probabilities": field.probabilities, "sampler": sampler}
    return held_against(UncertainSolution(**{**named, **known, **numbers}, costs=costs), bound)


def held_against(solution: UncertainSolution, bound: float) -> UncertainSolution:
    """
    Compare an answer with a proven bound of its objective; it fails if its path costs less.

    Examples
    --------
    >>> held_against(UncertainSolution(Status.FOUND, cost=1.0), 2.0).status.label
    'failed'
    """
    cost = solution.cost
    if solution.status.has_path and is_refuted(cost, bound):
        words = f"its path costs {cost:.9g}, but a proof says that none costs less than {bound:.9g}"
        solution = dataclasses.replace(solution, status=Status.FAILED, message=f"{words}; one of the two is wrong")
    return dataclasses.replace(solution, lower_bound=min(bound, cost) if bound <= cost * (1.0 + 1e-9) else bound)

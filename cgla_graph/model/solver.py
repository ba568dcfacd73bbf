"""The solver contract: solvers, their traits, solvers that plan step by step, and how to run a solver."""

import dataclasses
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, Protocol, TypeAlias, cast, runtime_checkable

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.errors import SolverSettingError
from cgla_graph.isolation.outcome import Outcome
from cgla_graph.model import isolated
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, Solution, Status
from cgla_graph.model.weights import beyond_holding

#: Message of `run` for a solver without the trait `rasters`.
NO_RASTERS = "it uses only the positions of threats, and does not see risk on rasters; hybrid and fast-marching do"


@dataclass(frozen=True)
class Traits:
    """
    Properties and promises of a solver, which the contract checks test.

    Attributes
    ----------
    name
        Its name in the registry, kebab-case.
    summary
        One line for `cgla solvers`.
    domain
        ``graph``: takes a `GraphProblem`; ``plane``: takes a `Problem`.
    exact
        Whether its path always has least cost on the graph it is given (graph solvers).
    anytime
        Whether it records its best cost over time in `Solution.trace`.
    seeded
        Whether it draws random numbers; then it has a setting ``seed``, and the same seed gives the same path.
    no_fly
        Whether it plans around no-fly areas; if not, its path may be infeasible.
    complete
        Whether it is expected to find a path if there is one, given time; if not, it may get stuck, and reports how.
    needs
        Packages beyond those that the toolkit always has.
    needs_positive
        Whether it needs the assumption of Theorem 1: no weight below 0 on a graph, no peak above 1 in the plane. Where
        that does not hold, `run` answers "unsupported" and does not call the solver.
    lazy
        Whether it weighs only the pairs of an implicit graph that it needs, and counts them. Other solvers weigh all
        pairs, and do not run on graphs of more than `cgla_graph.model.weights.MOST_HELD` nodes.
    isolated
        Whether it runs foreign code that may crash or hang; plug-ins that the registry builds have this trait. Then it
        runs in a process of its own, to which it and its problem are sent: their classes have to be in modules. It is
        stopped when it exceeds its setting ``seconds`` by a tenth and 2 s, or after 600 s without such a setting.
    rasters
        Whether it takes risk on rasters (plane solvers; a graph solver gets only weights). A solver that reasons about
        the places of threats ignores rasters: `run` answers "unsupported" and does not call it.
    proves
        Whether the lower bounds of its answers are proven, for its domain. Only solvers of this package are believed:
        the bounds of others are claims (`Solution.claimed_bound`).

    Examples
    --------
    >>> Traits("mine", "a solver of mine", domain="plane").seeded
    False
    """

    name: str
    summary: str
    domain: Literal["graph", "plane"]
    exact: bool = False
    anytime: bool = False
    seeded: bool = False
    no_fly: bool = True
    complete: bool = True
    needs: tuple[str, ...] = ()
    needs_positive: bool = False
    lazy: bool = False
    isolated: bool = False
    rasters: bool = True
    proves: bool = False


@runtime_checkable
class GraphSolver(Protocol):
    """A frozen dataclass of settings that plans on a graph, using only nodes and weights."""

    traits: ClassVar[Traits]

    def solve(self, problem: GraphProblem) -> Solution:
        """Return status, nodes and cost; `run` adds the other numbers."""
        ...


@runtime_checkable
class PlaneSolver(Protocol):
    """A frozen dataclass of settings that plans in the plane."""

    traits: ClassVar[Traits]

    def solve(self, problem: Problem) -> Solution:
        """Return status, waypoints and cost; `run` adds the other numbers."""
        ...


Solver: TypeAlias = GraphSolver | PlaneSolver


@dataclass(frozen=True, eq=False)
class Move:
    """
    A solver's decision for one step.

    Attributes
    ----------
    path
        Waypoints from the UAV's position on, shape ``(m, 2)``, map units, together no longer than a step. The last step
        may be shorter and end at the goal.
    memory
        State of the solver that is passed to its next step.
    stuck
        Why there is no further step, in one line; empty where there is one.
    counts
        Counters that are summed over a flight, for a solver that `Remarks` on it.
    """

    path: FloatArray
    memory: Hashable
    stuck: str = ""
    counts: Mapping[str, int] = field(default_factory=dict)


@runtime_checkable
class Remarks(Protocol):
    """A solver that plans step by step and makes a remark on a whole flight from its counters."""

    def remark(self, counts: Mapping[str, int]) -> str:
        """Return a remark of one line; may be empty."""
        ...


@runtime_checkable
class StepByStep(Protocol):
    """A plane solver that decides one step of a mission each tick, from the knowledge of its UAV at that tick."""

    traits: ClassVar[Traits]

    def move(self, problem: Problem, memory: Hashable | None, step: float) -> Move:
        """
        Decide one step.

        Parameters
        ----------
        problem
            The known map; its start is the UAV's position.
        memory
            Memory of the last move; None before the first.
        step
            Length of the step, map units.
        """
        ...


def run(
    solver: Solver,
    problem: Problem | GraphProblem,
    resolution: int | tuple[int, int] | Lattice | None = None,
    *,
    apart: bool = False,
) -> Solution:
    """
    Run a solver on a problem of its domain, and judge its answer by the oracle.

    Parameters
    ----------
    solver
        The solver.
    problem
        A `GraphProblem` for a graph solver, a `Problem` for a plane solver.
    resolution
        For a plane solver whose setting ``resolution`` is None: points a side, or a `Lattice`.
    apart
        Whether it runs in a process of its own; a solver with the trait ``isolated`` always does.

    Returns
    -------
    solution
        The judged answer. If start and goal are the same, no solver is called. A solver that needs positive weights
        does not get negative ones, and a solver that ignores rasters gets none. `seconds` is the time to solve, without
        the solver's own times to build and to certify. A bound of a solver that is not of this package is a claim; the
        optimum that an exact solver of this package finds is a proven bound of its graph.

    Raises
    ------
    SolverSettingError
        If the solver does not take such a problem.
    SolverFaultError
        If its answer is no `Solution`, or a solver that is not of this package changes its problem.

    Examples
    --------
    >>> from cgla_graph.solvers.exact.dijkstra import Dijkstra
    >>> problem = Problem((0.0, 0.0), (1.0, 1.0))
    >>> round(run(Dijkstra(), problem.on_lattice(5)).cost, 4)
    1.4142
    """
    traits, on_graph = solver.traits, isinstance(problem, GraphProblem)
    if on_graph != (traits.domain == "graph"):
        wanted = (
            "on a graph; give it a GraphProblem" if not on_graph else "in the plane, not on a graph; give a Problem"
        )
        msg = f"{traits.name} plans {wanted}"
        raise SolverSettingError(msg)
    if isinstance(problem, GraphProblem) and problem.graph.is_implicit:
        # a weight below 0 is only found once all weights are known
        to_check = traits.needs_positive and not problem.graph.has_proper_field
        too_much = beyond_holding(problem.graph.n_nodes)
        if too_much and not traits.lazy:
            return Solution(Status.UNSUPPORTED, solver=traits.name, message=f"it needs {too_much}; cgla does not")
        if too_much and to_check:
            message = f"with peaks above 1, it needs {too_much}"
            return Solution(Status.UNSUPPORTED, solver=traits.name, message=message)
        problem = problem.with_weights_held() if to_check else problem
    if traits.needs_positive and has_negative_weights(problem):
        return Solution(Status.UNSUPPORTED, solver=traits.name, message=NEGATIVE_WEIGHTS)
    if isinstance(problem, Problem) and is_blind_to(problem, traits):
        return Solution(Status.UNSUPPORTED, solver=traits.name, message=NO_RASTERS)
    if isinstance(problem, Problem) and problem.start == problem.goal:
        return trivial_solution(problem, traits.name)
    if isinstance(problem, Problem) and getattr(solver, "resolution", 0) is None:
        apart = apart or traits.isolated
        solver = dataclasses.replace(cast("Any", solver), resolution=resolution)
    answer, seconds = isolated.run(solver, problem, apart=apart)
    solving = max(0.0, seconds - answer.build_seconds - answer.certificate_seconds)
    answer = dataclasses.replace(answer, solver=traits.name, seconds=solving)
    if isinstance(problem, GraphProblem) and not (traits.lazy and problem.graph.is_implicit):
        answer = dataclasses.replace(answer, evaluations=problem.graph.n_pairs + answer.evaluations)
    return _judged(solver, problem, answer)


def _judged(solver: Solver, problem: Problem | GraphProblem, answer: Solution) -> Solution:
    """Judge an answer; of its bounds, believe those of solvers of this package."""
    traits, ours = solver.traits, isolated.is_ours(solver)
    if ours and not traits.proves:
        answer = dataclasses.replace(answer, lower_bound=np.nan)
    answer = _on_earth(problem, answer) if ours else answer
    # (without its certificate, a bound is a claim, which is compared with the path)
    judged = problem.judge(dataclasses.replace(answer, certificate=None))
    if not ours:
        return judged
    if isinstance(problem, GraphProblem) and traits.exact and judged.status is Status.OPTIMAL:
        return dataclasses.replace(judged, lower_bound=judged.cost)
    return with_bounds_of(answer, judged) if traits.proves else judged


def with_bounds_of(answer: Solution, judged: Solution) -> Solution:
    """
    Give a judged answer its bounds back, which the judge took for claims; a failed one gets none.

    Examples
    --------
    >>> problem = Problem((0.0, 0.0), (1.0, 0.0))
    >>> answer = Solution(Status.FOUND, path=np.array([(0, 0), (1, 0)]), cost=1.0, lower_bound=0.5)
    >>> judged = problem.judge(answer)
    >>> judged.gap, with_bounds_of(answer, judged).gap
    (nan, 1.0)
    """
    if judged.status is Status.FAILED:
        return judged
    names = "lower_bound", "claimed_bound", "certificate"
    return dataclasses.replace(judged, **{name: getattr(answer, name) for name in names})


def _on_earth(problem: Problem | GraphProblem, answer: Solution) -> Solution:
    """Turn a bound without a certificate, which a solver has proven on the plane, into one on the Earth."""
    if isinstance(problem, GraphProblem) or problem.projection is None or answer.certificate is not None:
        return answer
    around = problem.start, problem.goal, problem.bounds
    return dataclasses.replace(answer, lower_bound=problem.projection.bound_on_earth(answer.lower_bound, *around))


def next_move(solver: StepByStep, problem: Problem, memory: Hashable | None, step: float) -> Move:
    """
    Ask a solver for one step, in the process in which `run` runs it; if that process is lost, the solver is stuck.

    Examples
    --------
    >>> from cgla_graph.solvers.reactive.bcv_style import BcvStyle
    >>> next_move(BcvStyle(), Problem((0.1, 0.1), (0.9, 0.9)), None, 0.1).path.shape
    (2, 2)
    """
    answer, _ = isolated.made(solver, "move", (problem, memory, step))
    if isinstance(answer, Outcome):
        return Move(np.array([problem.start]), memory, stuck=isolated.why_lost(solver, answer))
    return answer  # type: ignore[no-any-return]


def has_negative_weights(problem: Problem | GraphProblem) -> bool:
    """Return whether Theorem 1's assumption fails: a weight below 0 on a graph, a peak above 1 in the plane."""
    if isinstance(problem, GraphProblem):
        return problem.graph.has_negative_weights
    return not problem.field.is_proper


def is_blind_to(problem: Problem, traits: Traits) -> bool:
    """
    Return whether a problem has risk on rasters that a solver ignores.

    Examples
    --------
    >>> is_blind_to(Problem((0, 0), (1, 1)), Traits("mine", "a solver of mine", domain="plane", rasters=False))
    False
    """
    return bool(problem.field.rasters) and not traits.rasters


def trivial_solution(problem: Problem, solver: str) -> Solution:
    """Answer a problem whose start is its goal: staying is optimal, unless risk may be below 0."""
    known = problem.field.is_proper
    answer = Solution(
        Status.OPTIMAL if known else Status.FOUND, path=np.array([problem.start]), cost=0.0, solver=solver
    )
    return dataclasses.replace(problem.judge(answer), lower_bound=0.0 if known else np.nan)

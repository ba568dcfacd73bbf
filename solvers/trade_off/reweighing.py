"""One problem solved under many risk weights, as the trade-off tools need it."""

import dataclasses
from typing import Any, cast

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph._validate import instance
from cgla_graph.errors import CglaError
from cgla_graph.isolation.outcome import one_line
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.isolated import is_ours
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem, problem_wanted
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Solver
from cgla_graph.solvers import registry
from cgla_graph.solvers.solving import solve

#: Up to this many nodes, length and risk of all pairs are kept apart, so that a weight costs one sum (two matrices of
#: 72 MB); larger lattices are weighed anew for each risk weight.
MATRICES_UP_TO = 3000
#: A risk weight so great that length is lost in rounding.
RISK_ALONE = 2.0**60


class Reweighed:
    """
    A problem, and a solver that answers it under any risk weight.

    A graph solver plans on one lattice, laid once. Length and risk of all pairs are weighed once as well, as
    ``weights(k) = lengths + k * risks``.

    Parameters
    ----------
    problem
        The problem; its own `k` is ignored.
    solver
        A name or a solver; None: `hybrid`.
    resolution
        For solvers that need a lattice, as in `solve`.
    settings
        Settings of a solver given by name.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError, SolverSettingError
        If there is no such solver, it cannot run here, or a setting is wrong.
    ProblemError
        If `problem` is no `Problem`, or the resolution is malformed.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0.5), (1, 0.5), RiskField([Threat(0.5, 0.5, spread=0.1)]))
    >>> reweighed = Reweighed(problem, "cgla", resolution=5)
    >>> [round(reweighed.at(k).length, 3) for k in (0.0, 100.0)]
    [1.0, 1.414]
    """

    def __init__(
        self,
        problem: Problem,
        solver: str | Solver | None = None,
        *,
        resolution: int | tuple[int, int] | Lattice = 20,
        **settings: Any,  # noqa: ANN401 - each solver has settings of its own
    ) -> None:
        instance("problem", problem, Problem, problem_wanted)
        self.problem = problem
        if solver is None:
            # its own proof of each path would cost more than the path
            solver, settings = "hybrid", {"tolerance": None, **settings}
        self.solver = registry.ready(solver, settings)
        self.solved: dict[float, Solution] = {}
        self.resolution = resolution
        self._on: GraphProblem | None = None
        self._lengths, self._risks = np.empty((0, 0)), np.empty((0, 0))
        # start equal to goal needs no lattice
        if self.solver.traits.domain == "graph" and problem.start != problem.goal:
            self._on = problem.on_lattice(resolution)
            if self._on.graph.n_nodes <= MATRICES_UP_TO:
                self._lengths, self._risks = _matrices(problem, self._on.graph)

    @property
    def exact(self) -> bool:
        """Whether each answer has least cost on the one lattice that all share: promises of plug-ins do not count."""
        traits = self.solver.traits
        return traits.domain == "graph" and traits.exact and is_ours(self.solver)

    @property
    def on_lattice(self) -> GraphProblem | None:
        """The problem laid on the shared lattice; None for solvers of the plane."""
        return self._on

    @property
    def matrices(self) -> tuple[FloatArray, FloatArray] | None:
        """
        Length and risk of all pairs, shape ``(n, n)`` each; None where they are not kept.

        The length is infinite where a segment crosses the no-fly area.
        """
        return (self._lengths, self._risks) if self._lengths.size else None

    def at(self, k: float) -> Solution:
        """Solve under the risk weight `k`, at least 0; the oracle has judged the answer under that weight."""
        if k not in self.solved:
            self.solved[k] = self._solve(dataclasses.replace(self.problem, k=k))
        return self.solved[k]

    def least_risk(self) -> Solution | None:
        """Solve for risk alone, however long, judged under the problem's own weight; None without `matrices`."""
        if self._on is None or not self._lengths.size:
            return None
        weights = np.where(np.isfinite(self._lengths), self._risks, np.inf)
        answer = self._on_graph(weights)
        if not answer.status.has_path:
            return answer
        return self.problem.judge(dataclasses.replace(answer, cost=self.problem.evaluate(answer.path).cost))

    def _on_graph(self, weights: FloatArray) -> Solution:
        """Solve on the shared lattice under other weights, shape ``(n, n)``."""
        on = cast("GraphProblem", self._on)
        graph = GeometricGraph.from_matrix(weights, positions=on.graph.positions)
        return solve_or_fail(GraphProblem(graph, on.source, on.target), self.solver)

    def _solve(self, problem: Problem) -> Solution:
        if self._on is None:
            return solve_or_fail(problem, self.solver, resolution=self.resolution)
        if not self._lengths.size or not problem.field.is_proper:
            return solve_or_fail(problem, self.solver, on=problem.on_lattice(self.resolution))
        return problem.judge(self._on_graph(self._lengths + problem.k * self._risks))


def solve_or_fail(problem: Problem | GraphProblem, solver: Solver, **how: Any) -> Solution:  # noqa: ANN401 - as `solve` takes them
    """
    Solve; an error of a solver in a process of its own is a failed answer, that of a solver in this one is raised.

    Examples
    --------
    >>> solve_or_fail(Problem((0, 0), (1, 1)), registry.get("straight-line")).status.label
    'found'
    """
    try:
        return solve(problem, solver, **how)
    except CglaError:
        raise
    except Exception as error:
        if not solver.traits.isolated:
            raise
        return Solution(Status.FAILED, solver=solver.traits.name, message=one_line(error))


def _matrices(problem: Problem, graph: GeometricGraph) -> tuple[FloatArray, FloatArray]:
    """Weigh all pairs by length alone, and by risk alone."""
    lengths, heavy = (
        graph.under(CostModel(problem.field, k, problem.model.no_fly)).weight_matrix() for k in (0.0, RISK_ALONE)
    )
    flyable = np.isfinite(lengths)
    risks = np.zeros_like(lengths)
    np.subtract(heavy, lengths, out=risks, where=flyable)
    # rounding may leave a trace below 0 where there is no risk
    np.maximum(risks / RISK_ALONE, 0.0, out=risks)
    for matrix in (lengths, risks):
        matrix.flags.writeable = False
    return lengths, risks

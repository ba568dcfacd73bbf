"""CGLA: the paper's cost matrix, then greedy descent from the start."""

import itertools
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.errors import SolverSettingError
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits


@dataclass(frozen=True)
class Cgla:
    """
    The cooperative and geometric learning algorithm's planner (Zhang, Mao, Liu, Liu, Automatica 50(3), 2014).

    Attributes
    ----------
    schedule
        How Eq. 9 chooses ``p_r``: ``label-setting`` takes it from Delta_k (the paper's proof), ``synchronous`` all at
        once, ``sweeps`` one node after the other in the order of their indices, again and again until nothing changes.
    early_stop
        Stop when the start is in Delta_k (Step 2); only label setting does.

    Raises
    ------
    SolverSettingError
        If the schedule is unknown, or `early_stop` is no truth value.

    Examples
    --------
    >>> from cgla_graph.model.graph import GeometricGraph
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> Cgla().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    schedule: Literal["label-setting", "synchronous", "sweeps"] = "label-setting"
    early_stop: bool = True

    traits: ClassVar[Traits] = Traits(
        "cgla", "the paper's cost matrix (Eq. 9)", domain="graph", exact=True, needs_positive=True
    )

    def __post_init__(self) -> None:
        """Check the settings."""
        allowed = get_args(Cgla.__annotations__["schedule"])
        if self.schedule not in allowed:
            msg = f"cgla: unknown schedule {self.schedule!r}; choose one of {', '.join(allowed)}"
            raise SolverSettingError(msg)
        if not isinstance(self.early_stop, bool):
            msg = f"cgla: early_stop is {self.early_stop!r}; give True or False"
            raise SolverSettingError(msg)

    def solve(self, problem: GraphProblem) -> Solution:
        """Compute the cost matrix and read the path off it."""
        graph = problem.graph
        if self.schedule == "label-setting":
            source = problem.source if self.early_stop else None
            matrix = cost_matrix(graph, problem.target, source=source)
        elif self.schedule == "synchronous":
            matrix = cost_matrix(graph, problem.target, schedule="synchronous")
        else:
            # n sweeps are enough for weights of at least 0: each settles one more edge of every least-cost path
            sweeps = itertools.chain.from_iterable(itertools.repeat(graph.labels, graph.n_nodes))
            matrix = cost_matrix(graph, problem.target, schedule="given", order=sweeps)
        return self.read(problem, matrix)

    def read(self, problem: GraphProblem, matrix: CostMatrix) -> Solution:
        """Read the path off a cost matrix towards the problem's target, which a mission may have repaired."""
        nodes = matrix.path_from(problem.source)
        if not nodes:
            return Solution(Status.NO_PATH)
        message = f"{matrix.rounds} rounds"
        return Solution(Status.OPTIMAL, nodes=tuple(nodes), cost=matrix.value(problem.source), message=message)

"""CGLA: the paper's cost matrix, then greedy descent from the start."""

import itertools
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.model.problem import FULL_UP_TO, GraphProblem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.model.weights import beyond_holding
from cgla_graph.restricted.restricted import Restricted, can_restrict, restricted_optimum
from cgla_graph.solvers.base import Positive, Settings


@dataclass(frozen=True)
class Cgla(Settings):
    """
    The cooperative and geometric learning algorithm's planner (Zhang, Mao, Liu, Liu, Automatica 50(3), 2014).

    A complete lattice graph with more than 6,000 nodes is not weighed as a whole: the cost matrix is restricted
    to what can be part of the optimum, which stays exact (`cgla_graph.restricted`).

    Attributes
    ----------
    schedule
        How Eq. 9 chooses ``p_r``: ``label-setting`` takes it from Delta_k (the paper's proof), ``synchronous`` all at
        once, ``sweeps`` one node after the other in the order of their indices, again and again until nothing changes.
    early_stop
        Stop when the start is in Delta_k (Step 2); only label setting does.
    time_limit
        Of the search on lattices of more than 6,000 nodes, in seconds; None: no limit. When it ends the
        search, the answer is the best path so far, with a proven bound of the optimum instead of a claim. Smaller
        graphs are weighed as a whole, without a limit.

    Raises
    ------
    SolverSettingError
        If the schedule is unknown, `early_stop` is no truth value, or `time_limit` is not above 0.

    Examples
    --------
    >>> from cgla_graph.model.graph import GeometricGraph
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> Cgla().solve(GraphProblem(chain, 0, 2)).nodes
    (0, 1, 2)
    """

    schedule: Literal["label-setting", "synchronous", "sweeps"] = "label-setting"
    early_stop: bool = True
    time_limit: Positive | None = None

    traits: ClassVar[Traits] = Traits(
        "cgla",
        "the paper's cost matrix (Eq. 9)",
        domain="graph",
        exact=True,
        needs_positive=True,
        lazy=True,
        proves=True,
    )

    def solve(self, problem: GraphProblem) -> Solution:
        """Compute the cost matrix and read the path off it."""
        graph, reason = problem.graph, "it needs"
        if self.early_stop and graph.n_nodes > FULL_UP_TO and can_restrict(graph):
            found = restricted_optimum(problem, seconds=self.time_limit)
            if found is not None:
                return _restricted_answer(problem, found)
            reason = "no path was found that limits the search (k too great, or gaps too narrow); without one it needs"
        if graph.is_implicit and (too_much := beyond_holding(graph.n_nodes)):
            return Solution(Status.UNSUPPORTED, message=f"{reason} {too_much}")
        if self.schedule == "label-setting":
            source = problem.source if self.early_stop else None
            matrix = cost_matrix(graph, problem.target, source=source)
        elif self.schedule == "synchronous":
            matrix = cost_matrix(graph, problem.target, schedule="synchronous")
        else:
            # n sweeps are enough for weights of at least 0: each settles one more edge of every least-cost path
            sweeps = itertools.chain.from_iterable(itertools.repeat(graph.labels, graph.n_nodes))
            matrix = cost_matrix(graph, problem.target, schedule="given", order=sweeps)
        # an implicit graph computes all of its rows
        evaluations = graph.n_pairs if graph.is_implicit else 0
        return replace(self.read(problem, matrix), evaluations=evaluations)

    def read(self, problem: GraphProblem, matrix: CostMatrix) -> Solution:
        """Read the path off a cost matrix towards the problem's target, which a mission may have repaired."""
        nodes = matrix.path_from(problem.source)
        if not nodes:
            return Solution(Status.NO_PATH)
        message = f"{matrix.rounds} rounds"
        if problem.graph.n_nodes > FULL_UP_TO and not problem.graph.has_proper_field:
            message += "; all pairs were weighed, since peaks above 1 allow no bounds"
        return Solution(Status.OPTIMAL, nodes=tuple(nodes), cost=matrix.value(problem.source), message=message)


def _restricted_answer(problem: GraphProblem, found: Restricted) -> Solution:
    """Make the answer of a restricted cost matrix; its message says how much of the graph was used."""
    graph, integrated = problem.graph, found.counts.get("integrated", 0)
    if not len(found.nodes):
        if found.is_optimum:
            return Solution(Status.NO_PATH, evaluations=integrated)
        return Solution(
            Status.NOT_FOUND,
            evaluations=integrated,
            message="no path of the lattice was found within the time limit; give more time",
        )
    nodes = tuple(graph.labels[index] for index in found.nodes.tolist())
    # the restricted matrix adds up the same weights in another order
    cost = problem.evaluate(nodes)
    if not found.is_optimum:
        return Solution(
            Status.FOUND,
            nodes=nodes,
            cost=cost,
            lower_bound=found.bound,
            evaluations=integrated,
            message=f"stopped at the time limit, on a path at most {cost / found.bound - 1.0:.2g} above the optimum",
        )
    message = (
        f"{len(found.order)} rounds; {len(found.kept)} of {graph.n_nodes} nodes kept, "
        f"{integrated} of {graph.n_pairs} pairs weighed: the others are proven to be no part of the optimum"
    )
    return Solution(Status.OPTIMAL, nodes=nodes, cost=cost, evaluations=integrated, message=message)

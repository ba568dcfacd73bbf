"""PRM* of OMPL: its roadmap, weighed by the exact segment cost."""

import time
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
from scipy import sparse

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import OmplSeed, Positive, Settings, Whole, ompl_traits
from cgla_graph.solvers.budget import Budget, BudgetSpentError
from cgla_graph.solvers.exact.dijkstra import Dijkstra


@dataclass(frozen=True)
class OmplPrmStar(Settings):
    """
    OMPL's PRM* (Karaman, Frazzoli, IJRR 30(7), 2011): a random roadmap, then its exact optimum.

    Which milestones are joined does not depend on the cost. So OMPL grows the roadmap with its own length objective
    (`PRMstar.solve` deadlocks with an objective written in Python), and its edges are weighed here.

    Attributes
    ----------
    milestones
        Size of the roadmap, start and goal included.
    seconds
        Stops the growth of the roadmap, which is then weighed and searched as it is; None: no limit. Once it does, the
        same seed may give another path each time.
    seed
        From 1 (OMPL refuses 0) to 2^32 - 1.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> OmplPrmStar(milestones=200, seed=1).solve(problem).status.label
    'found'
    """

    milestones: Annotated[int, Whole(2)] = 2000
    seconds: Positive | None = None
    seed: OmplSeed = 1

    traits: ClassVar[Traits] = ompl_traits("ompl-prm-star", "OMPL's PRM* roadmap over the same cost")

    def solve(self, problem: Problem) -> Solution:
        """Grow the roadmap, weigh its edges, and search it."""
        began = time.perf_counter()
        try:
            positions, tails, heads, source, target = self._roadmap(problem)
        except BudgetSpentError as spent:
            return Solution(Status.NOT_FOUND, message=str(spent))
        if source is None or target is None:
            return Solution(Status.NOT_FOUND, message="OMPL could not place start and goal")
        weights = problem.model.weights(positions[tails], positions[heads])
        joined = np.isfinite(weights)
        matrix = sparse.coo_array(
            (weights[joined], (tails[joined], heads[joined])), shape=(len(positions), len(positions))
        )
        graph = GeometricGraph.from_sparse(matrix, directed=False, positions=positions)
        build_seconds = time.perf_counter() - began
        answer = Dijkstra().solve(GraphProblem(graph, source, target))
        found = answer.status.has_path
        return Solution(
            Status.FOUND if found else Status.NOT_FOUND,
            path=positions[[graph.index_of(node) for node in answer.nodes]],
            cost=answer.cost,
            build_seconds=build_seconds,
            evaluations=len(weights),
            message="" if found else f"{len(positions)} milestones do not join start and goal",
        )

    def _roadmap(self, problem: Problem) -> tuple[FloatArray, IntArray, IntArray, int | None, int | None]:
        """Return milestones, shape ``(n, 2)``, the joined pairs as two arrays, and the nodes of start and goal."""
        from ompl import base as ob  # noqa: PLC0415 - optional
        from ompl import geometric as og  # noqa: PLC0415 - optional

        from cgla_graph.solvers.sampling import ompl_space  # noqa: PLC0415 - needs the optional package

        meter = Budget(seconds=self.seconds).start()
        # `PRMstar.solve` aborts the process if a callback raises: without a budget these never do
        si = ompl_space.space_information(problem, self.seed, Budget().start())
        pdef = ompl_space.definition(problem, si, ob.PathLengthOptimizationObjective(si))
        planner = og.PRMstar(si)
        planner.setProblemDefinition(pdef)
        planner.setup()
        # the first call only inserts start and goal
        planner.solve(ob.plannerAlwaysTerminatingCondition())
        full = ob.PlannerTerminationCondition(lambda: planner.milestoneCount() >= self.milestones or meter.late)
        planner.growRoadmapPtc(full)
        data: Any = ob.PlannerData(si)
        planner.getPlannerData(data)
        states = [data.getVertex(i).getState() for i in range(data.numVertices())]
        positions = np.array([(state[0], state[1]) for state in states]).reshape(-1, 2)
        edges = sorted({(min(i, j), max(i, j)) for i in range(len(states)) for j in data.getEdges(i)})
        tails, heads = np.array(edges, dtype=np.int64).reshape(-1, 2).T
        if not data.numStartVertices() or not data.numGoalVertices():
            return positions, tails, heads, None, None
        return positions, tails, heads, int(data.getStartIndex(0)), int(data.getGoalIndex(0))

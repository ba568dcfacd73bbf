"""The best path on the 8-connected lattice, the best that Q-Learning's eight moves can reach."""

import time
from dataclasses import dataclass
from typing import ClassVar

from cgla_graph.model.adjacency import CornerRule
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits, run
from cgla_graph.solvers.base import Resolution, Settings
from cgla_graph.solvers.exact.dijkstra import Dijkstra


@dataclass(frozen=True)
class EightDirection(Settings):
    """
    Least cost over moves to the eight neighbours of a lattice point.

    In free space, between points of a lattice of equal spacing along both sides, its path is at most 1.0824 times as
    long as the straight line (``1 / cos(pi / 8)``), at every resolution; with unequal spacing, up to 1.4142 times.
    Start and goal off the lattice are joined to the corners of their cell.

    Attributes
    ----------
    resolution
        Points a side of a closed lattice, or a `Lattice`; None: that of `solve`, else 20.
    corner_rule
        ``touch``: a diagonal move may touch a corner of a no-fly area; ``both-free``: both lattice points beside it
        must be outside, the rule of grid benchmarks.

    Raises
    ------
    SolverSettingError
        If the resolution is below 2 or the rule is unknown.

    Examples
    --------
    >>> problem = Problem(start=(0, 0), goal=(1, 0.5))
    >>> round(EightDirection(resolution=3).solve(problem).cost, 4)
    1.2071
    """

    resolution: Resolution | None = None
    corner_rule: CornerRule = "touch"

    traits: ClassVar[Traits] = Traits("eight-direction", "optimum of the 8-connected lattice", domain="plane")

    def solve(self, problem: Problem) -> Solution:
        """Lay the lattice, which is reported as time to build, and search it."""
        began = time.perf_counter()
        on = problem.on_eight_connected(self.resolution or 20, corner_rule=self.corner_rule)
        laid = time.perf_counter() - began
        answer = run(Dijkstra(), on)
        return Solution(
            answer.status,
            path=answer.path,
            nodes=answer.nodes,
            cost=answer.cost,
            build_seconds=laid + answer.build_seconds,
            evaluations=on.graph.n_pairs,
            message=answer.message,
        )

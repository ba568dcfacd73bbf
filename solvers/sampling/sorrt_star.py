"""SORRT* of OMPL over the exact segment cost."""

from dataclasses import dataclass
from typing import Any, ClassVar

from cgla_graph.model.solver import Traits
from cgla_graph.solvers.sampling.rrt_star import RrtStar


@dataclass(frozen=True)
class SorrtStar(RrtStar):
    """
    OMPL's SORRT* (Gammell, Srinivasa, Barfoot, ICRA 2015): Informed RRT* that takes its samples sorted.

    It draws batches and goes through each in the order of the length of the way over the sample, so that the samples
    which may help most come first.

    Attributes
    ----------
    iterations, seconds, evaluations, seed, rewire_factor
        As for `RrtStar`. SORRT* also ends when as good as nothing near enough is left to sample.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> SorrtStar(iterations=200, seed=1).solve(problem).status.label
    'found'
    """

    traits: ClassVar[Traits] = Traits(
        "sorrt-star",
        "OMPL's SORRT* over the same cost",
        domain="plane",
        anytime=True,
        seeded=True,
        needs=("ompl",),
        isolated=True,
        needs_positive=True,
    )

    def _planner(self, si: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
        from ompl import geometric as og  # noqa: PLC0415 - optional

        planner = og.SORRTstar(si)
        planner.setRewireFactor(self.rewire_factor)
        return planner

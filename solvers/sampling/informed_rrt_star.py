"""Informed RRT* of OMPL over the exact segment cost."""

from dataclasses import dataclass
from typing import Any, ClassVar

from cgla_graph.model.solver import Traits
from cgla_graph.solvers.sampling.rrt_star import RrtStar


@dataclass(frozen=True)
class InformedRrtStar(RrtStar):
    """
    OMPL's Informed RRT* (Gammell, Srinivasa, Barfoot, IROS 2014): RRT* that samples where a better path may be.

    Once it has a path of cost ``c``, it samples in the ellipse with foci at start and goal whose points lie on paths of
    length at most ``c``. Where risk makes the cost far greater than the length, the ellipse covers the map and nothing
    is gained.

    Attributes
    ----------
    iterations, seconds, evaluations, seed, rewire_factor
        As for `RrtStar`.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> InformedRrtStar(iterations=200, seed=1).solve(problem).status.label
    'found'
    """

    traits: ClassVar[Traits] = Traits(
        "informed-rrt-star",
        "OMPL's Informed RRT* over the same cost",
        domain="plane",
        anytime=True,
        seeded=True,
        needs=("ompl",),
        isolated=True,
        needs_positive=True,
    )

    def _planner(self, si: Any) -> Any:  # noqa: ANN401 - OMPL has no type hints
        from ompl import geometric as og  # noqa: PLC0415 - optional

        planner = og.InformedRRTstar(si)
        planner.setRewireFactor(self.rewire_factor)
        return planner

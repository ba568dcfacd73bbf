"""Weighted regions: the least-cost path over cells of constant cost, by points on their borders."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.regions.paths import least_path
from cgla_graph.solvers.base import Settings, Whole


@dataclass(frozen=True)
class WeightedRegions(Settings):
    """
    Searches points on the borders of cells, on each of which the cost is constant, as `nearest` rasters have it.

    Best paths are straight inside of such cells and bend on their borders by Snell's law (Mitchell and Papadimitriou,
    Journal of the ACM 38, 1991). Points on the sides of cells, denser towards corners, are joined with all points of
    the same cell (Aleksandrov, Maheshwari, Sack, Journal of the ACM 52, 2005). The best path over them (Dijkstra 1959)
    is moved along the sides until it costs least, and then refined (`cgla_graph.refine.refine.refine_path`).

    On very large maps, a search over blocks of cells comes first, and points are laid on the cells of the best blocks.

    Where the cost is not constant on cells, because there are threats or `bilinear` rasters, it is sampled in the
    middles of cells, and the message says so. No-fly areas cut the ways that cross them; a passage that is narrower
    than the points are apart may be missed.

    `Solution.evaluations` counts the nodes of the search and the segments weighed by the refinement.

    Attributes
    ----------
    points
        Points inside each side of a cell; None: from 31 on few cells to 3 on very many.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> field = RiskField(rasters=[RasterRisk([[0, 3, 0], [0, 9, 0]], (0, 0, 3, 2), interpolation="nearest")])
    >>> problem = Problem((0.5, 0.5), (2.5, 0.5), field, k=1.0, bounds=(0, 0, 3, 2))
    >>> round(WeightedRegions().solve(problem).cost, 4)
    5.4142
    """

    points: Annotated[int, Whole(1, 64)] | None = None

    traits: ClassVar[Traits] = Traits(
        "weighted-regions",
        "best path over cells of constant cost, by points on their borders",
        domain="plane",
        complete=False,
        needs_positive=True,
    )

    def solve(self, problem: Problem) -> Solution:
        """Search, move and refine."""
        found = least_path(problem, self.points)
        evaluations = found.nodes + found.evaluations
        if not len(found.path):
            message = f"no way over the points of {found.message}"
            return Solution(Status.NOT_FOUND, evaluations=evaluations, message=message)
        cost = problem.evaluate(found.path).cost
        return Solution(Status.FOUND, path=found.path, cost=cost, evaluations=evaluations, message=found.message)

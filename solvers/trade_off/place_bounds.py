"""
Proven bounds of all paths through each place under every risk weight, and the tubes that they leave.

For each place, the least cost of all paths through it is concave in the weight and does not fall, as that of all paths
is (`weight_bounds`). So between two weights it is at least the chord of two bounds, and beyond the last one at least
the last. No path that costs less than a known one leaves the places where the chord is below that cost: a proof under
a weight between others needs no grid over the whole map.
"""

import itertools
import math
from bisect import bisect_right
from dataclasses import dataclass, field, replace

import numpy as np

from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.certificate.subsolution import first_grid
from cgla_graph.certificate.through import Through, grids_through, straight_through
from cgla_graph.eikonal import cell_runs
from cgla_graph.model.problem import Problem
from cgla_graph.solvers.trade_off.weight_bounds import LOWERED

#: Grids are refined until the gap is at most this, or more than that part of the last one: then the path may be a bad
#: one.
CLOSE, STUCK = 0.015, 0.7
#: Cells that are closer than this part of a cell touch.
TOUCHING = 1e-9


@dataclass(eq=False)
class PlaceBounds:
    """
    Bounds of all paths through each cell of the first grid of a map.

    Attributes
    ----------
    problem
        The map; its own `k` is ignored.
    known
        Bounds by weight, shape ``(rows, columns)``, map units; infinite where no path leads. Under weight 0 they are
        straight lines at first.
    """

    problem: Problem
    known: dict[float, FloatArray] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        """Bound the length of all paths by straight lines."""
        self.last = first_grid(self.problem)
        self.known[0.0] = np.maximum(straight_through(self.problem, self.last), 0.0)

    def lay(self, k: float, path: FloatArray, cost: float, max_cells: int) -> Through | None:
        """
        Solve for the bounds under a weight, on finer grids until they are close; return those on the last one.

        A finer grid covers the places through which a path may cost less than the given one. Its bounds count for the
        cells of the first grid that it touches. None where the first grid has too many cells.
        """
        weighted, through = replace(self.problem, k=k), None
        limit, gap = math.nextafter(cost, math.inf), math.inf
        for grid in grids_through(weighted, limit=limit, path=path, tolerance=CLOSE, max_cells=max_cells):
            mesh = grid.level.mesh
            if through is None:
                found = np.full((self.last[1] + 1, self.last[0] + 1), math.inf)
                inside = mesh.matters
                np.minimum.at(found, (mesh.rows[inside], mesh.columns[inside]), grid.least[inside])
            else:
                found = np.maximum(found, self._on_first(grid.through))
            through = grid.through
            self.known[k] = found
            before, gap = gap, cost / through.lower_bound - 1.0
            if gap <= CLOSE or gap > STUCK * before:
                break
        return through

    def _on_first(self, through: Through) -> FloatArray:
        """Return the least bound of a finer grid on each cell of the first one that its cells touch."""
        found = np.full((self.last[1] + 1, self.last[0] + 1), through.limit)
        ends = [
            [
                np.floor((cells + side) * (last / finer) + 0.5 + math.copysign(TOUCHING, side))
                .astype(np.int64)
                .clip(0, last)
                for side in (-0.5, 0.5)
            ]
            for cells, last, finer in zip(
                (through.rows, through.columns), self.last[::-1], through.last[::-1], strict=True
            )
        ]
        for rows, columns in itertools.product(*ends):
            np.minimum.at(found, (rows, columns), through.least)
        return found

    def at(self, k: float) -> FloatArray:
        """Bound all paths through each cell under a weight, shape ``(rows, columns)``."""
        weights = sorted(self.known)
        above = bisect_right(weights, k)
        low = weights[above - 1]
        if above == len(weights) or low == k:
            return self.known[low]
        high = weights[above]
        part = (k - low) / (high - low)
        # (where there is no path under one weight, there is none under the other)
        return np.asarray(((1.0 - part) * self.known[low] + part * self.known[high]) * (1.0 - LOWERED))

    def cells(self, k: float, cost: float) -> WholeArray:
        """Return the runs of the cells (`cell_runs`) through which a path may cost less than some cost."""
        rows, columns = np.nonzero(~(self.at(k) >= cost))
        return cell_runs.runs_of(columns, rows)

"""
Lower bounds of the length of all paths within a budget of risk, and of the risk of all within a budget of length.

Under a weight `k`, a path of risk at most `R` costs ``length + k * risk``, so that it is at least ``L(k) - k R`` long,
where ``L(k)`` is the least cost of all paths. The greatest of these bounds, over all `k`, is that of Lagrangian
duality: it knows the convex hull of all paths alone, and leaves a gap where two classes of paths are best on both sides
of the budget, and neither in between.

**The cut.** Let ``M_k(x)`` bound the cost of all paths through the place ``x`` (`through`). A path within the budget
that passes through ``x`` is at least ``max over k of M_k(x) - k R`` long, and the weight may be another one at each
place: on the way of one class, it is the weight that is best for that class. Each path has to pass somewhere: on a
chain of touching cells from start to goal, it is at least as long as the greatest of these numbers, so that the least
over all chains bounds all paths (`through.bottleneck`).

A budget of length has the same proof, with ``(M_k(x) - budget) / k``.
"""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.certificate.subsolution import first_grid, next_grid
from cgla_graph.certificate.through import bottleneck, bounds_through
from cgla_graph.model.problem import Problem
from cgla_graph.refine.refine import refine_path

#: How many times as fine as the first grid the grids are, and how many weights each may have.
TIMES, MOST_WEIGHTS = (2.0, 4.0), (12, 8)
#: Neighbouring weights differ by at least this factor; beyond the first and the last one, the next is this much apart.
CLOSEST, FARTHER = 1.1, 3.0
#: A grid ends after so many weights that raise the bound by less than a part of the tolerance.
IN_VAIN, WORTH = 4, 0.05
#: Rounding of the numbers of a cell, relative to the greatest term.
ROUNDING = 2.0**-48


@dataclass(frozen=True, eq=False)
class Cut:
    """
    A proven bound of all paths within a budget.

    Attributes
    ----------
    lower_bound
        No path within the budget has less length (map units) or risk.
    weights
        The risk weights whose bounds prove it, shape ``(n,)``.
    last
        Column and row of the last node of the grid.
    """

    lower_bound: float
    weights: FloatArray
    last: tuple[int, int]


def cut_within(
    problem: Problem,
    limited: Literal["risk", "length"],
    budget: float,
    value: float,
    k: float,
    paths: Sequence[FloatArray],
    *,
    tolerance: float = 0.01,
) -> Cut:
    """
    Bound all paths within a budget from below, by the best weight at each place.

    Parameters
    ----------
    problem
        The problem; its own `k` is ignored. Its field has no peaks above 1.
    limited
        What the budget limits: ``risk``, so that length is bounded, or ``length``, so that risk is.
    budget
        The most that a path may use, at least 0.
    value
        Length or risk of a known path within the budget: no more is proven.
    k
        The weight to begin with, above 0: the one of the best dual bound.
    paths
        Feasible paths from start to goal, with few or many risks, that help to close places; shape ``(n, 2)`` each.
    tolerance
        End when the known path is this close to the bound, as a ratio.

    Returns
    -------
    cut
        The bound, and the weights that prove it; on a map in degrees, for lengths and risks on the Earth.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, 0.5, 0.1)]))
    >>> around = np.array([(0.1, 0.5), (0.5, 0.7), (0.9, 0.5)])
    >>> judged = problem.evaluate(around)
    >>> found = cut_within(problem, "risk", judged.risk, judged.length, 1.0, [around], tolerance=0.05)
    >>> bool(0.8 < found.lower_bound <= judged.length)
    True
    """
    best: Cut | None = None
    # (the best weights of two classes of paths are on both sides of the one under which they cost the same)
    weights = [k, FARTHER * k, k / FARTHER]
    for times, most in zip(TIMES, MOST_WEIGHTS, strict=True):
        grid = _Grid(problem, limited, budget, value, paths, next_grid(problem, first_grid(problem), times))
        found = grid.search(weights, most, tolerance)
        weights = found.weights.tolist()
        best = found if best is None or found.lower_bound > best.lower_bound else best
        if value <= best.lower_bound * (1.0 + tolerance):
            break
    return best or Cut(0.0, np.array([k]), (0, 0))


class _Grid:
    """The bounds under several weights on the cells of one grid."""

    def __init__(
        self,
        problem: Problem,
        limited: Literal["risk", "length"],
        budget: float,
        value: float,
        paths: Sequence[FloatArray],
        last: tuple[int, int],
    ) -> None:
        self.problem, self.limited, self.budget, self.value = problem, limited, budget, value
        self.paths, self.last = list(paths), last
        #: What all paths through each cell need at least, by weight, shape ``(rows, columns)`` each.
        self.cells: dict[float, FloatArray] = {}

    def search(self, weights: Sequence[float], most: int, tolerance: float) -> Cut:
        """Add weights, first the given ones, then those that may raise the bound where it is attained."""
        waiting, raised = list(weights), {}
        bound, vain, all_cells = -math.inf, 0, np.full((self.last[1] + 1, self.last[0] + 1), -math.inf)
        while len(self.cells) < most and vain < IN_VAIN and not self.value <= bound * (1.0 + tolerance):
            k = waiting.pop(0) if waiting else self._another(all_cells, bound)
            if math.isnan(k):
                break
            self.cells[k] = self._needed(k)
            all_cells = np.maximum(all_cells, self.cells[k])
            before, bound = bound, bottleneck(all_cells, self.problem.bounds, self.problem.start, self.problem.goal)
            raised[k] = bound - before
            vain = 0 if bound > before + WORTH * tolerance * self.value else vain + 1
        # (the next grid begins with those that gained most)
        order = sorted(raised, key=lambda k: -raised[k])
        return Cut(max(bound, 0.0), np.array(order), self.last)

    def _needed(self, k: float) -> FloatArray:
        """Bound what all paths within the budget through each cell need, by one weight: shape ``(rows, columns)``."""
        problem, on_risk = dataclasses.replace(self.problem, k=k), self.limited == "risk"
        limit = self.value + k * self.budget if on_risk else self.budget + k * self.value
        path = min(self.paths, key=lambda path: problem.evaluate(path).cost, default=None)
        if path is not None:
            path = refine_path(problem, path, tolerance=1e-4).path
            self.paths.append(path)
        least = bounds_through(problem, limit=limit, last=self.last, path=path).on_cells()
        spent = k * self.budget if on_risk else self.budget
        found = least - spent - ROUNDING * (least + spent)
        return found if on_risk else np.asarray(found / k)

    def _another(self, cells: FloatArray, bound: float) -> float:
        """
        Choose the weight that may raise the number of the cell where the bound is attained; NaN if none is left.

        That number is concave in the weight: its greatest value is next to the best weight so far.
        """
        row, column = np.argwhere(cells == bound)[0]
        weights = np.array(sorted(self.cells))
        values = np.array([self.cells[k][row, column] for k in weights])
        if self.limited == "length":
            # (concave, like the cost, before the division)
            values = values * weights
        ends = np.concatenate([[weights[0] / FARTHER], weights, [weights[-1] * FARTHER]])
        sides = []
        for i, (low, high) in enumerate(itertools.pairwise(ends)):
            k = math.sqrt(low * high) if 0 < i < len(weights) else (low if i == 0 else high)
            # the chords beside the interval are above a concave function in it
            above = [
                values[a] + (values[b] - values[a]) * (k - weights[a]) / (weights[b] - weights[a])
                for a, b in ((i - 2, i - 1), (i, i + 1))
                if a >= 0 and b < len(weights)
            ]
            if high >= CLOSEST**2 * low:
                most = min(above, default=math.inf)
                sides.append((most / k if self.limited == "length" else most, k))
        most, k = max(sides, default=(-math.inf, math.nan))
        return float(k) if most > bound else math.nan

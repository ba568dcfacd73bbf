"""
The front of length against risk: its paths, the range of risk weights of each, and proven bounds.

Every path is a point ``(risk, length)``. The paths that have least cost ``length + k * risk`` for some `k` are the
corners of the lower left convex hull of these points.
"""

import dataclasses
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr, json_number
from cgla_graph._types import FloatArray
from cgla_graph._validate import non_negative_number, number_array
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Evaluation, Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.solvers.trade_off.plan_within import PlanWithin
from cgla_graph.solvers.trade_off.weight_bounds import WeightBounds

#: Relative differences of length and risk below this are rounding.
ROUNDING = 1e-12
#: Risk per unit length below this is none: line integrals are not more exact.
NO_RISK = 1e-10
#: Factor of the risk weight on the way to the end of least risk, and the most steps.
GROWTH, MOST_GROWTHS = 10.0, 6


class _Path(Protocol):
    """A path with a length and a risk."""

    @property
    def length(self) -> float: ...

    @property
    def risk(self) -> float: ...


@dataclass(frozen=True, eq=False)
class FrontPoint(ShortRepr):
    """
    A path of the front, and the risk weights for which no other found path is cheaper.

    Attributes
    ----------
    k_low, k_high
        The range of weights; the last path's `k_high` is infinite if it has no risk, else the greatest weight tried.
    k
        A weight in that range: the one that the path was found with, if it is in the range.
    solution
        The path, judged under that weight.
    """

    k_low: float
    k_high: float
    k: float
    solution: Solution

    @property
    def length(self) -> float:
        """Its length, map units."""
        return self.solution.length

    @property
    def risk(self) -> float:
        """The line integral of the risk field along it."""
        return self.solution.risk

    @property
    def cost(self) -> float:
        """``length + k * risk``, map units."""
        return self.solution.cost

    @property
    def path(self) -> FloatArray:
        """Its waypoints, shape ``(m, 2)``, map units."""
        return self.solution.path

    def document(self) -> dict[str, Any]:
        """Return it as JSON; a range of weights without end has no `k_high`."""
        return {
            "k_low": self.k_low,
            "k_high": json_number(self.k_high),
            "k": self.k,
            "length": self.length,
            "risk": self.risk,
            "cost": self.cost,
            "waypoints": len(self.path),
            "path": self.path.tolist(),
        }


@dataclass(frozen=True, eq=False)
class Front(ShortRepr):
    """
    The front: along `points`, risk falls, and length and risk weight rise.

    Attributes
    ----------
    points
        From the shortest path on; empty if none was found.
    status
        ``OPTIMAL``: no path on the shared lattice is cheaper under any weight from 0 to `k_max`, but for `error`;
        ``FOUND``: a solver without such a promise found these; else the reason why there is none.
    error
        The most that a path not among `points` may be cheaper, relative to the cost, under any weight from 0 to
        `k_max`. Proven for ``OPTIMAL``; for ``FOUND`` it takes the solver's paths for optimal.
    k_max
        The greatest weight tried.
    n_solves
        Solver runs it took.
    message
        The reason if there is no path, or why a front is not proven as closely as asked for.
    bounds
        Proven bounds of the cost of every path inside the bounds of the map, under all risk weights; None if none were
        asked for.
    budgets
        The shortest paths within some budgets of risk, and the bounds of all such paths.
    """

    points: tuple[FrontPoint, ...]
    status: Status
    error: float = math.inf
    k_max: float = 0.0
    n_solves: int = 0
    message: str = ""
    bounds: WeightBounds | None = None
    budgets: tuple[PlanWithin, ...] = ()

    def __len__(self) -> int:
        """Count the points."""
        return len(self.points)

    def __iter__(self) -> Iterator[FrontPoint]:
        """Go from the shortest path to the one of least risk."""
        return iter(self.points)

    def at(self, k: float) -> FrontPoint:
        """
        Return the cheapest path under a weight; beyond `k_max`, the one of least risk.

        Raises
        ------
        ProblemError
            If the front is empty, or `k` is no number of at least 0.
        """
        weight = non_negative_number("k", k)
        if not self.points:
            msg = f"the front is empty ({self.status.value}); there is no path to choose"
            raise ProblemError(msg)
        return next((point for point in self.points if weight <= point.k_high), self.points[-1])

    def lower_bound(self, k: float) -> float:
        """
        Return the proven bound under a weight, also beyond `k_max`: no path costs less, map units.

        NaN if nothing is proven, infinite if it is proven that there is no path.

        Raises
        ------
        ProblemError
            If `k` is no number of at least 0.
        """
        weight = non_negative_number("k", k)
        return math.nan if self.bounds is None else float(self.bounds.at(weight))

    def gap_at(self, k: float) -> float:
        """
        Return the most that the cheapest path of the front may cost above the best one under a weight, as a ratio.

        NaN if nothing is proven, infinite without a path.

        Raises
        ------
        ProblemError
            If `k` is no number of at least 0.
        """
        return float(gaps(self.points, self.bounds, np.array([non_negative_number("k", k)]))[0])

    @property
    def worst_k(self) -> float:
        """The weight up to `k_max` under which `gap_at` is greatest; NaN if nothing is proven."""
        return worst_weight(self.points, self.bounds, self.k_max)[0]

    @property
    def gap(self) -> float:
        """The greatest `gap_at` under any weight from 0 to `k_max`; NaN if nothing is proven."""
        return worst_weight(self.points, self.bounds, self.k_max)[1]

    def document(self) -> dict[str, Any]:
        """Return all of it as JSON: the knee as the number of its point; numbers that are not finite are None."""
        proven = {} if self.bounds is None else {"proven": self._proven(self.bounds)}
        return {
            "status": self.status.label,
            "message": self.message,
            "error": json_number(self.error),
            "k_max": json_number(self.k_max),
            "solves": self.n_solves,
            "knee": None if self.knee is None else self.points.index(self.knee),
            **proven,
            **({"budgets": [_within(plan) for plan in self.budgets]} if self.budgets else {}),
            "points": [{**point.document(), **self._proven_of(point)} for point in self],
        }

    def gap_of(self, point: FrontPoint) -> float:
        """Return the greatest `gap_at` under the weights of a point, up to `k_max`; NaN if nothing is proven."""
        return worst_weight(self.points, self.bounds, min(point.k_high, self.k_max), point.k_low)[1]

    def least_length(self, risks: ArrayLike) -> FloatArray:
        """
        Bound the length of all paths of at most some risk: ``max over k of L(k) - k * risk``.

        Parameters
        ----------
        risks
            Budgets of risk, shape ``(n,)``.

        Returns
        -------
        lengths
            Proven: no path of at most that risk is shorter, map units, shape ``(n,)``; NaN if nothing is proven.
        """
        budgets = number_array("risks", risks)
        if self.bounds is None:
            return np.full(budgets.shape, math.nan)
        ks = self.bounds.corners
        return np.asarray((self.bounds.at(ks) - budgets[..., None] * (1.0 + ROUNDING) * ks).max(axis=-1, initial=0.0))

    def _proven_of(self, point: FrontPoint) -> dict[str, Any]:
        """Return what is proven of a point as JSON."""
        if self.bounds is None:
            return {}
        return {"lower_bound": json_number(self.lower_bound(point.k)), "gap": json_number(self.gap_of(point))}

    def _proven(self, bounds: WeightBounds) -> dict[str, Any]:
        """Return the proofs as JSON."""
        return {
            "gap": json_number(self.gap),
            "worst_k": json_number(self.worst_k),
            "no_path": bool((bounds.bounds == math.inf).any()),
            "proofs": [
                {"k": k, "lower_bound": json_number(bound)}
                for k, bound in zip(bounds.weights.tolist(), bounds.bounds.tolist(), strict=True)
            ],
        }

    @property
    def knee(self) -> FrontPoint | None:
        """
        The point farthest below the straight line between the two ends, both axes scaled to 1 (Das, 1999).

        From there on, less risk costs more than its share of length. None for less than three points.
        """
        if len(self.points) < 3:  # noqa: PLR2004 - two ends and one between
            return None
        risk, length = np.array([(point.risk, point.length) for point in self.points]).T
        depth = 1.0 - (risk - risk[-1]) / (risk[0] - risk[-1]) - (length - length[0]) / (length[-1] - length[0])
        return self.points[int(np.argmax(depth))]


def _within(plan: PlanWithin) -> dict[str, Any]:
    """Return a plan within a budget as JSON, without its path."""
    numbers = {name: json_number(getattr(plan.solution, name)) for name in ("length", "risk")}
    return {"status": plan.status.label, **numbers, **plan.document(), "message": plan.message}


def gaps(paths: Sequence[_Path], bounds: WeightBounds | None, weights: FloatArray) -> FloatArray:
    """Return the gap between the cheapest path and the bound under each weight, shape ``(n,)``; NaN without a bound."""
    if bounds is None:
        return np.full(len(weights), math.nan)
    proven = bounds.at(weights)
    lines = np.array([(path.length, path.risk) for path in paths]).reshape(-1, 2)
    costs = (lines[:, 0] + np.outer(weights, lines[:, 1])).min(axis=1, initial=math.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        above = costs / proven - 1.0
    # (without a path, infinite; where both are 0 or infinite, 0)
    return np.where(np.isnan(proven), math.nan, np.where(costs <= proven, 0.0, above))


def worst_weight(
    paths: Sequence[_Path], bounds: WeightBounds | None, high: float, low: float = 0.0
) -> tuple[float, float]:
    """
    Return the weight from `low` to `high` under which the gap is greatest, and that gap; NaN without a bound.

    The paths are those of a hull, from the shortest on. The cheapest one costs ``length + k * risk``, and the bound is
    linear between its corners. Where both are linear in `k`, their ratio has its extremes at the ends, so that corners
    of the two are all that is compared.
    """
    if bounds is None:
        return math.nan, math.nan
    turns = [chord_weight(short, safe) for short, safe in pairwise(paths)]
    weights = np.unique(np.concatenate([[low, high], bounds.corners, turns]))
    weights = weights[(weights >= low) & (weights <= high)]
    found = gaps(paths, bounds, weights)
    worst = int(np.argmax(found))
    return float(weights[worst]), float(found[worst])


def is_risk_free(solution: Solution | Evaluation) -> bool:
    """Whether there is no more risk along a path than line integrals may be wrong by."""
    return solution.risk <= NO_RISK * solution.length


def growing_weights(shortest: Solution | Evaluation) -> Iterator[float]:
    """Yield risk weights to look for little risk with, from where the shortest path's risk counts as its length."""
    if not is_risk_free(shortest):
        yield from (shortest.length / shortest.risk * GROWTH**i for i in range(MOST_GROWTHS + 1))


def lower_hull(solved: Iterable[tuple[float, Solution]]) -> list[tuple[float, Solution]]:
    """
    Return the paths that are cheapest under some weight, each with the least weight it was found with.

    Length rises along them and risk falls, both by more than rounding; a path on the line between two others is left
    out.
    """
    hull: list[tuple[float, Solution]] = []
    for k, now in sorted(
        ((k, found) for k, found in solved if found.status.has_path),
        key=lambda pair: (pair[1].length, pair[1].risk, pair[0]),
    ):
        if hull and now.risk >= hull[-1][1].risk - ROUNDING * hull[0][1].risk:
            continue
        if hull and now.length <= hull[-1][1].length * (1.0 + ROUNDING):
            hull.pop()
        while len(hull) > 1 and not _is_corner(hull[-2][1], hull[-1][1], now):
            hull.pop()
        hull.append((k, now))
    return hull


def _is_corner(short: Solution, between: Solution, safe: Solution) -> bool:
    """Whether a path is cheaper than two others where these cost the same, by more than rounding."""
    k = chord_weight(short, safe)
    return between.length + k * between.risk < (short.length + k * short.risk) * (1.0 - ROUNDING)


def chord_weight(short: _Path, safe: _Path) -> float:
    """Return the weight under which two paths cost the same; the first is shorter and has more risk."""
    return (safe.length - short.length) / (short.risk - safe.risk)


def points_of(problem: Problem, solved: Iterable[tuple[float, Solution]], k_max: float) -> tuple[FrontPoint, ...]:
    """Give every path of the hull its range of weights, and its cost under one of them."""
    hull = lower_hull(solved)
    if not hull:
        return ()
    # a solver that is not exact may have found a path that only pays beyond
    breaks = [0.0, *(k for k in (chord_weight(a, b) for (_, a), (_, b) in pairwise(hull)) if k < k_max)]
    hull = hull[: len(breaks)]
    breaks.append(math.inf if is_risk_free(hull[-1][1]) else k_max)
    found = []
    for (k, solution), low, high in zip(hull, breaks[:-1], breaks[1:], strict=True):
        weight = min(max(k, low), high)
        judged = dataclasses.replace(problem, k=weight).judge(
            dataclasses.replace(solution, cost=solution.length + weight * solution.risk)
        )
        found.append(FrontPoint(low, high, weight, judged))
    return tuple(found)

"""
Trade-off between risk and length over all risk weights.

Every path is a point ``(risk, length)``. The paths that have least cost ``length + k * risk`` for some `k` are the
corners of the lower left convex hull of these points, and the least cost itself, as a function of `k`, is concave:
each path bounds it from above by a line, and each exact solve gives one of its values.
"""

import dataclasses
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from cgla_graph._progress import Tell, showing
from cgla_graph._text import ShortRepr, json_number
from cgla_graph._types import FloatArray
from cgla_graph._validate import non_negative_number, positive_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Evaluation, Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, Solution, Status
from cgla_graph.model.solver import Solver
from cgla_graph.solvers.base import Whole
from cgla_graph.solvers.trade_off.reweighing import Reweighed

#: Relative differences of length and risk below this are rounding.
ROUNDING = 1e-12
#: Risk per unit length below this is none: line integrals are not more exact.
NO_RISK = 1e-10
#: How much a front may cost above the best by default, relative to the cost, where no lattice is exact.
TOLERANCE = 1e-3
#: Factor of the risk weight on the way to the end of least risk, and the most steps.
GROWTH, MOST_GROWTHS = 10.0, 6
#: The front ends where a step lowers the risk by no more than this, relative to the shortest path's.
LEAST_RISK = 1e-3


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
        The reason if there is no path.
    """

    points: tuple[FrontPoint, ...]
    status: Status
    error: float = math.inf
    k_max: float = 0.0
    n_solves: int = 0
    message: str = ""

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

    def document(self) -> dict[str, Any]:
        """Return all of it as JSON: the knee as the number of its point; numbers that are not finite are None."""
        return {
            "status": self.status.label,
            "message": self.message,
            "error": json_number(self.error),
            "k_max": json_number(self.k_max),
            "solves": self.n_solves,
            "knee": None if self.knee is None else self.points.index(self.knee),
            "points": [point.document() for point in self],
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


def pareto(
    problem: Problem,
    *,
    solver: str | Solver | None = None,
    resolution: int | tuple[int, int] | Lattice = 20,
    tolerance: float | None = None,
    max_points: int = 100,
    k_max: float | None = None,
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> Front:
    """
    Find the paths that are cheapest under some risk weight: the trade-off between risk and length.

    Two neighbours on the front cost the same under one weight, ``(L2 - L1) / (R1 - R2)``. A solve there finds a path
    between them, or shows that there is none (Aneja, Nair, Management Science 25(1), 1979). The pair comes first
    between which a path could be cheapest, relative to its cost (Cohon, Church, Sheer, Water Resources Research
    15(5), 1979). With an exact graph solver the front is complete for its lattice; with a solver of the plane it holds
    the paths that the solver finds, without those that are cheapest under no weight.

    Parameters
    ----------
    problem
        The map; its own `k` is ignored.
    solver
        A name or a solver; None: `hybrid`.
    resolution
        For solvers that need a lattice, as in `solve`; graph solvers share it.
    tolerance
        End when no path can be cheaper than the front by more than this, relative to its cost. None: 0 with an
        exact graph solver, so that the front is complete; 0.001 with others.
    max_points
        End the search between the points once there are this many, at least 2; `Front.error` then bounds the loss.
    k_max
        The greatest weight; None: grow it tenfold until that lowers the risk by no more than a thousandth of the
        shortest path's.
    **settings
        Settings of a solver given by name.

    Returns
    -------
    front
        Its points are judged by the oracle. If there is no path, the status says so.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError, SolverSettingError
        If there is no such solver, it cannot run here, or a setting is wrong.
    ProblemError
        If the problem or the resolution is malformed, or a number is out of range.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0.5), (1, 0.5), RiskField([Threat(0.5, 0.5, spread=0.1)]))
    >>> front = pareto(problem, solver="cgla", resolution=5)
    >>> [(round(point.k_low, 2), round(point.length, 3), round(point.risk, 3)) for point in front][:3]
    [(0.0, 1.0, 0.251), (0.55, 1.118, 0.036), (3.66, 1.207, 0.011)]
    """
    reweighed = Reweighed(problem, solver, resolution=resolution, **settings)
    if tolerance is None:
        tolerance = 0.0 if reweighed.exact else TOLERANCE
    tolerance = non_negative_number("tolerance", tolerance)
    max_points = Whole(2)("max_points", max_points)
    k_max = None if k_max is None else positive_number("k_max", k_max)
    if not problem.field.is_proper:
        return Front((), Status.UNSUPPORTED, message=NEGATIVE_WEIGHTS)
    with showing("front of length against risk") as tell:
        shortest = reweighed.at(0.0)
        if not shortest.status.has_path:
            return Front((), shortest.status, n_solves=1, message=shortest.message)
        if k_max is not None:
            reweighed.at(k_max)
        else:
            risk = shortest.risk
            for k in growing_weights(shortest):
                before, risk = risk, reweighed.at(k).risk
                if not before - risk > LEAST_RISK * shortest.risk:
                    break
        error = _refine(reweighed, tolerance, max_points, tell)
    status = Status.OPTIMAL if reweighed.exact else Status.FOUND
    return Front(_points(reweighed), status, error, max(reweighed.solved), len(reweighed.solved))


def is_risk_free(solution: Solution | Evaluation) -> bool:
    """Whether there is no more risk along a path than line integrals may be wrong by."""
    return solution.risk <= NO_RISK * solution.length


def growing_weights(shortest: Solution | Evaluation) -> Iterator[float]:
    """Yield risk weights to look for little risk with, from where the shortest path's risk counts as its length."""
    if not is_risk_free(shortest):
        yield from (shortest.length / shortest.risk * GROWTH**i for i in range(MOST_GROWTHS + 1))


def _refine(reweighed: Reweighed, tolerance: float, max_points: int, tell: Tell) -> float:
    """Solve between neighbours on the hull, where the least cost is least certain; return the error that is left."""
    while True:
        hull = lower_hull(reweighed.solved.items())
        risk, length = np.array([(solution.risk, solution.length) for _, solution in hull]).T
        if len(hull) == 1:
            return 0.0
        weights = np.array(sorted(reweighed.solved))
        between = -np.diff(length) / np.diff(risk)
        # concave in k: above its chords between the weights solved, below the line of every path
        floor = np.interp(between, weights, (length + np.outer(weights, risk)).min(axis=1))
        errors = 1.0 - floor / (length + np.outer(between, risk)).min(axis=1)
        errors[np.isin(between, weights)] = 0.0
        worst = int(np.argmax(errors))
        if errors[worst] <= max(tolerance, ROUNDING) or len(hull) >= max_points:
            return max(0.0, float(errors[worst]))
        tell(f"{len(hull)} paths, others at most {errors[worst]:.2%} cheaper")
        reweighed.at(float(between[worst]))


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


def chord_weight(short: Solution, safe: Solution) -> float:
    """Return the weight under which two paths cost the same; the first is shorter and has more risk."""
    return (safe.length - short.length) / (short.risk - safe.risk)


def _points(reweighed: Reweighed) -> tuple[FrontPoint, ...]:
    """Give every path of the hull its range of weights, and its cost under one of them."""
    hull = lower_hull(reweighed.solved.items())
    k_max = max(reweighed.solved)
    # a solver that is not exact may have found a path that only pays beyond
    breaks = [0.0, *(k for k in (chord_weight(a, b) for (_, a), (_, b) in pairwise(hull)) if k < k_max)]
    hull = hull[: len(breaks)]
    breaks.append(math.inf if is_risk_free(hull[-1][1]) else k_max)
    found = []
    for (k, solution), low, high in zip(hull, breaks[:-1], breaks[1:], strict=True):
        weight = min(max(k, low), high)
        judged = dataclasses.replace(reweighed.problem, k=weight).judge(
            dataclasses.replace(solution, cost=solution.length + weight * solution.risk)
        )
        found.append(FrontPoint(low, high, weight, judged))
    return tuple(found)

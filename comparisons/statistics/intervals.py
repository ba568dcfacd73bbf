"""
Statistics of runs over seeds that assume no distribution: medians, their intervals, success rates, times to a target.

A run that misses its target counts as infinite. Leaving it out would flatter solvers that fail often.
"""

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
import scipy

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.statistics.distributions import median_rank
from cgla_graph.model.solution import Solution

#: Confidence of every interval.
CONFIDENCE = 0.95
#: Below this many runs, no interval of a median has that confidence.
FEWEST_RUNS = 6
#: Costs within this of a target, relative to it, reach it: rounding.
SAME_COST = 1e-12


class Interval(NamedTuple):
    """
    From `low` to `high`, both included.

    Examples
    --------
    >>> Interval(0.0, 1.0).high
    1.0
    """

    low: float
    high: float


class Estimate(NamedTuple):
    """A median and its interval (see `median_interval`)."""

    median: float
    low: float
    high: float


class Hit(NamedTuple):
    """Seconds (with the building of the graph) and evaluations until a run reached a target; infinite if never."""

    seconds: float
    evaluations: float


@cache
def interval_ranks(n: int) -> tuple[int, int] | None:
    r"""
    Return the ranks of two order statistics between which the median of a distribution lies.

    Each of `n` independent values is below the median with probability 1/2. So the median is outside
    :math:`[x_{(r)}, x_{(n+1-r)}]` with probability :math:`2 \sum_{i<r} \binom{n}{i} / 2^n` at most, for every
    distribution (with equality for continuous ones, less with ties). The greatest allowed `r` is
    taken (David, Nagaraja, "Order Statistics", 3rd ed., 2003, section 7.1), as `scipy.stats.quantile_test` does.

    Parameters
    ----------
    n
        Number of values, at least 0.

    Returns
    -------
    ranks
        From 1, in ascending order; None where even the least and the greatest value are too close together: below
        `FEWEST_RUNS` values.

    Examples
    --------
    >>> interval_ranks(5), interval_ranks(6), interval_ranks(20)
    (None, (1, 6), (6, 15))
    """
    rank = median_rank((1.0 - CONFIDENCE) / 2.0, n) if n else 0
    return (rank, n + 1 - rank) if rank else None


def median_interval(values: Sequence[float]) -> Interval:
    """
    Return an interval that covers the median of the distribution with at least 95 % confidence.

    Its ends are two of the independent values, which may be infinite. Too few values give minus to plus infinity.

    Examples
    --------
    >>> median_interval([3, 1, 2, 5, 4, math.inf])
    Interval(low=1, high=inf)
    >>> median_interval([3, 1, 2])
    Interval(low=-inf, high=inf)
    """
    ranks = interval_ranks(len(values))
    if ranks is None:
        return Interval(-math.inf, math.inf)
    ordered = sorted(values)
    return Interval(ordered[ranks[0] - 1], ordered[ranks[1] - 1])


def estimate(values: Sequence[float]) -> Estimate:
    """
    Return the median, the lower one of two middle values, with its interval.

    The lower one is the result of an actual run, and is finite if at least half of the runs are. If a value is NaN, all
    numbers are NaN.

    Raises
    ------
    statistics.StatisticsError
        If there is no value.

    Examples
    --------
    >>> estimate([1.0, math.inf, 2.0, math.inf])
    Estimate(median=2.0, low=-inf, high=inf)
    """
    if any(math.isnan(value) for value in values):
        return Estimate(math.nan, math.nan, math.nan)
    return Estimate(statistics.median_low(values), *median_interval(values))


def success_interval(successes: int, n: int) -> Interval:
    """
    Return the 95 % interval of a success rate by Clopper and Pearson (Biometrika 26(4), 1934).

    It covers any rate with at least this confidence.

    Raises
    ------
    ValueError
        If the counts are out of range.

    Examples
    --------
    >>> low, high = success_interval(10, 10)
    >>> round(low, 4), high
    (0.6915, 1.0)
    """
    if not 0 <= successes <= n or n < 1:
        msg = f"{successes} successes of {n} runs; give at least one run, and no more successes than runs"
        raise ValueError(msg)
    tail = (1.0 - CONFIDENCE) / 2.0
    # a closed form: scipy's binomtest searches for the ends, which is slow for tables of thousands of rates
    low = 0.0 if successes == 0 else float(scipy.special.betaincinv(successes, n - successes + 1, tail))
    high = 1.0 if successes == n else float(scipy.special.betaincinv(successes + 1, n - successes, 1.0 - tail))
    return Interval(low, high)


def progress(solution: Solution) -> FloatArray:
    """
    Return the best cost over time, as a step function.

    Parameters
    ----------
    solution
        A judged answer. Without a trace, it reaches its cost at its end. Costs in the trace below the oracle's cost of
        the path are raised to it.

    Returns
    -------
    steps
        Shape ``(m, 3)``, rows of seconds (the building of the graph included), evaluations and cost (finite), none
        of which rises in cost. The last row is the end of the run. No rows without a feasible path.

    Examples
    --------
    >>> from cgla_graph.model.solution import Status, TracePoint
    >>> trace = (TracePoint(0.1, 5, math.inf), TracePoint(0.2, 10, 3.0))
    >>> progress(Solution(Status.FOUND, cost=2.0, seconds=1.0, build_seconds=1.0, evaluations=50, trace=trace))
    array([[ 1.2, 10. ,  3. ],
           [ 2. , 50. ,  2. ]])
    """
    if not solution.status.has_path:
        return np.empty((0, 3))
    trace = [point for point in solution.trace if math.isfinite(point.cost + point.seconds)]
    points = [(point.seconds, point.evaluations, point.cost) for point in trace]
    ends = [(solution.seconds, solution.evaluations), *((seconds, count) for seconds, count, _ in points)]
    # the clock of a solver may run a little beyond the one that stopped it
    points.append((*(max(column) for column in zip(*ends, strict=True)), solution.cost))
    steps = np.array(sorted(points, key=lambda point: point[0]), dtype=np.float64)
    steps[:, 2] = np.minimum.accumulate(np.maximum(steps[:, 2], solution.cost))
    steps[:, 0] += solution.build_seconds
    return steps


def to_target(solution: Solution, cost: float = math.inf) -> Hit:
    """
    Return when a run first had a path of at most this cost.

    Parameters
    ----------
    solution
        A judged answer (see `progress`).
    cost
        The target; infinite for the first path, NaN if the target is unknown.

    Returns
    -------
    hit
        Infinite if it never reached the target; NaN for an unknown target.

    Examples
    --------
    >>> from cgla_graph.model.solution import Status
    >>> to_target(Solution(Status.FOUND, cost=2.0, seconds=1.0, evaluations=7), 2.5)
    Hit(seconds=1.0, evaluations=7.0)
    >>> to_target(Solution(Status.NOT_FOUND, seconds=1.0), 2.5)
    Hit(seconds=inf, evaluations=inf)
    """
    if math.isnan(cost):
        return Hit(math.nan, math.nan)
    steps = progress(solution)
    there = np.nonzero(steps[:, 2] <= cost + SAME_COST * abs(cost) if math.isfinite(cost) else steps[:, 2] < cost)[0]
    if not len(there):
        return Hit(math.inf, math.inf)
    return Hit(float(steps[there[0], 0]), float(steps[there[0], 1]))


def path_cost(solution: Solution) -> float:
    """
    Return the cost of a run's path; infinity without a feasible path.

    Examples
    --------
    >>> from cgla_graph.model.solution import Status
    >>> path_cost(Solution(Status.INFEASIBLE, cost=1.0))
    inf
    """
    return float(solution.cost) if solution.status.has_path else math.inf


@dataclass(frozen=True, eq=False)
class Curve:
    """
    Best costs over time of one solver's runs, as step functions: each row holds until the next.

    Attributes
    ----------
    seconds
        When one of the runs improved or ended, shape ``(m,)``, ascending; building the graph counts.
    median, low, high
        Best cost so far at those moments, shape ``(m,)``, map units; infinite where too few runs have a path.
    n_runs
        Number of runs.
    is_interval
        Whether the band is the 95 % interval of the median; else it goes from the least to the greatest.
    """

    seconds: FloatArray
    median: FloatArray
    low: FloatArray
    high: FloatArray
    n_runs: int
    is_interval: bool


def median_curve(solutions: Sequence[Solution]) -> Curve:
    """
    Compute the median (the lower one of two middle values) of runs at every moment, and its 95 % interval.

    Before its first path a run has infinite cost; after its end it keeps its cost.

    Parameters
    ----------
    solutions
        One solver's answers on one problem, at least one.

    Returns
    -------
    curve
        Without rows where no run found a path.

    Examples
    --------
    >>> from cgla_graph.model.solution import Status
    >>> runs = [Solution(Status.FOUND, cost=cost, seconds=cost) for cost in (1.0, 2.0, 3.0)]
    >>> curve = median_curve([*runs, Solution(Status.NOT_FOUND)])
    >>> curve.seconds, curve.median, curve.high
    (array([1., 2., 3.]), array([inf,  1.,  1.]), array([inf, inf, inf]))
    """
    all_steps = [progress(solution) for solution in solutions]
    seconds = np.unique(np.concatenate([steps[:, 0] for steps in all_steps]))
    costs = np.sort([_at(steps, seconds) for steps in all_steps], axis=0)
    n_runs = len(all_steps)
    ranks = interval_ranks(n_runs)
    least, greatest = ranks or (1, n_runs)
    return Curve(
        seconds=seconds,
        median=costs[(n_runs - 1) // 2],
        low=costs[least - 1],
        high=costs[greatest - 1],
        n_runs=n_runs,
        is_interval=ranks is not None,
    )


def _at(steps: FloatArray, seconds: FloatArray) -> FloatArray:
    """Return the best cost of one run at some moments."""
    costs = np.concatenate([[np.inf], steps[:, 2]])
    return costs[np.searchsorted(steps[:, 0], seconds, side="right")]

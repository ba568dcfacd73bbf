"""Profiles: the share of runs with a path over time, and of instances within a factor of the best cost."""

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.statistics.intervals import CONFIDENCE, path_cost, to_target
from cgla_graph.comparisons.statistics.paired import cost_table, same_cost
from cgla_graph.comparisons.study.rows import by_scenario, by_solver, scenario_bound
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Solution, Status


class StepFunction(NamedTuple):
    """
    A share that rises in steps; it is 0 before the first.

    Attributes
    ----------
    at
        Places where it rises, shape ``(m,)``, strictly ascending.
    share
        Its value from there on, shape ``(m,)``, from 0 to 1.
    """

    at: FloatArray
    share: FloatArray


@dataclass(frozen=True, eq=False)
class SuccessCurve:
    """
    Share of runs that have a path, over time.

    Attributes
    ----------
    seconds
        Times at which runs found their first paths, shape ``(m,)``, strictly ascending; building the graph counts.
    rate
        Share of all runs that have a path at that time, shape ``(m,)``.
    low, high
        A band that holds the whole curve of the solver's true rates with 95 % confidence, at all times at once, shape
        ``(m,)``; it is constant until the next moment.
    """

    seconds: FloatArray
    rate: FloatArray
    low: FloatArray
    high: FloatArray


def success_curve(solutions: Sequence[Solution]) -> SuccessCurve:
    """
    Return the rate of runs with a path over time, with a band for the whole curve.

    The band is that of Kolmogorov: his statistic's exact 95 % quantile above and below the rate. It holds for any
    distribution of times, also if some runs never find a path.

    Parameters
    ----------
    solutions
        Answers of one solver, judged; independent runs, at least one.

    Returns
    -------
    curve
        Without moments if no run found a path.

    Raises
    ------
    ValueError
        If there is no run.

    Examples
    --------
    >>> from cgla_graph.model.solution import Status
    >>> runs = [Solution(Status.FOUND, cost=1.0, seconds=float(s)) for s in (1, 2, 2)]
    >>> curve = success_curve([*runs, Solution(Status.NOT_FOUND, seconds=9.0)])
    >>> curve.seconds, curve.rate
    (array([1., 2.]), array([0.25, 0.75]))
    """
    if not solutions:
        msg = "there are no runs; a success rate needs at least one"
        raise ValueError(msg)
    first = [to_target(solution).seconds for solution in solutions]
    curve = _shares(np.array(first), len(solutions))
    width = _band_width(len(solutions))
    return SuccessCurve(
        seconds=curve.at,
        rate=curve.share,
        low=np.maximum(curve.share - width, 0.0),
        high=np.minimum(curve.share + width, 1.0),
    )


@lru_cache
def _band_width(n: int) -> float:
    """Return the quantile of Kolmogorov's statistic of `n` values. It is slow, and the same for most solvers."""
    return float(scipy.stats.kstwo.ppf(CONFIDENCE, n))


def performance_profile(costs: Mapping[str, Sequence[float]]) -> dict[str, StepFunction]:
    """
    Return the share of instances that each solver answers within a factor of the best solver's cost, by the factor.

    At 1 it is the share of instances on which a solver is best or ties; far to the right, the share with a path
    (Dolan, More, Mathematical Programming 91(2), 2002). The factor is relative to the best solver that takes part,
    so removing a third solver can change the order of two others (Gould, Scott, ACM TOMS 43(2), 2016).

    Parameters
    ----------
    costs
        One cost an instance for each solver, or one time; the instances in the same order. Infinite without a path:
        such an instance counts, and is within no factor.

    Returns
    -------
    profiles
        By solver, over factors from 1. Where the best cost is 0 or below, only those equal to it are within a factor.

    Raises
    ------
    ValueError
        If the costs are not equally many, or one is NaN.

    Examples
    --------
    >>> profiles = performance_profile({"a": [1.0, 2.0], "b": [2.0, math.inf]})
    >>> profiles["b"]
    StepFunction(at=array([2.]), share=array([0.5]))
    """
    table = cost_table(costs)
    if not table:
        return {}
    best = np.min(list(table.values()), axis=0)
    return {solver: _shares(_factors(values, best), len(values)) for solver, values in table.items()}


def _factors(costs: FloatArray, best: FloatArray) -> FloatArray:
    factors = np.full(len(costs), np.inf)
    proper = np.isfinite(costs) & (best > 0.0)
    with np.errstate(over="ignore"):
        factors[proper] = costs[proper] / best[proper]
    factors[np.isfinite(costs) & same_cost(costs, best)] = 1.0
    return factors


def _shares(values: FloatArray, n: int) -> StepFunction:
    """Return the share of `n` values that are at most x, as a function of x; infinite values never are."""
    at, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    return StepFunction(at, np.cumsum(counts) / max(n, 1))


def able(runs: Sequence[Run]) -> list[Run]:
    """
    Leave out the runs that solvers could not make where they were, as without a package: they say nothing of them.

    Examples
    --------
    >>> able([])
    []
    """
    return [run for run in runs if run.solution.status is not Status.UNAVAILABLE]


def shared_scenarios(runs: Sequence[Run]) -> list[dict[str, list[Run]]]:
    """
    List the scenarios that every solver has run, so that all solvers are measured on the same scenarios.

    While a study goes on, the others are left out: a run that has not been made is no failure.

    Parameters
    ----------
    runs
        Of any scenarios and solvers.

    Returns
    -------
    scenarios
        In order; for each, the runs by solver, the solvers in the order of their first runs.

    Examples
    --------
    >>> shared_scenarios([])
    []
    """
    able_runs = able(runs)
    solvers = list(by_solver(able_runs))
    groups = [by_solver(group) for group in by_scenario(able_runs)]
    return [{solver: group[solver] for solver in solvers} for group in groups if len(group) == len(solvers)]


def instance_costs(runs: Sequence[Run]) -> dict[str, list[float]]:
    """
    Reduce the runs of every solver on every scenario to one cost: the median over its seeds.

    Of two middle runs the cheaper one counts; a run without a path has infinite cost.

    Returns
    -------
    costs
        By solver, one for each of `shared_scenarios`, in order.

    Examples
    --------
    >>> from cgla_graph.comparisons.study.entrant import Entrant
    >>> from cgla_graph.comparisons.study.runner import compare
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> runs = list(compare([load_scenario("one-threat")], [Entrant.parse("straight-line")], tolerance=None))
    >>> {solver: [round(cost, 3) for cost in costs] for solver, costs in instance_costs(runs).items()}
    {'straight-line': [3.921]}
    """
    shared = shared_scenarios(runs)
    return {
        solver: [statistics.median_low([path_cost(run.solution) for run in group[solver]]) for group in shared]
        for solver in by_solver(able(runs))
    }


def instance_times(runs: Sequence[Run], percent: float) -> dict[str, list[float]]:
    """
    Reduce the runs of every solver on every scenario to one time until its cost is near the scenario's lower bound.

    Parameters
    ----------
    runs
        Of any scenarios and solvers.
    percent
        The greatest gap that counts as near.

    Returns
    -------
    times
        By solver, one for each of `shared_scenarios`: the median over the seeds (of two middle ones the shorter), in
        seconds, building the graph included; infinite if never. Scenarios without a finite bound, 0 or above, are left
        out.

    Examples
    --------
    >>> instance_times([], 5.0)
    {}
    """
    targets = []
    for group in shared_scenarios(runs):
        bound = finite_bound(group)
        if not math.isnan(bound):
            targets.append((group, (1.0 + percent / 100.0) * bound))
    return {
        solver: [
            statistics.median_low([to_target(run.solution, target).seconds for run in group[solver]])
            for group, target in targets
        ]
        for solver in by_solver(able(runs))
    }


def finite_bound(group: Mapping[str, Sequence[Run]]) -> float:
    """
    Return the lower bound from which a scenario's gaps are measured; NaN without one.

    Infinity (the bound of a scenario without a path) and bounds below 0 give no gap.
    """
    bound = scenario_bound([run for runs in group.values() for run in runs])
    return bound if 0.0 <= bound < math.inf else math.nan

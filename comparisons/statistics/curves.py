"""Curves: the median of several runs' best costs at every moment, and a band around it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.statistics.intervals import interval_ranks, progress
from cgla_graph.model.solution import Solution


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
        How many runs there were.
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
    Take the median (the lower one of two middle values) of runs at every moment, and its 95 % interval.

    Before its first path a run is infinitely costly, also if it never finds one; after its end it keeps its cost.

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

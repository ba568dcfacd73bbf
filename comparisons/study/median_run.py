"""Which of a solver's several seeds is shown: the median run, the same one in tables, pictures and the report."""

import math
from collections.abc import Sequence

from cgla_graph.comparisons.statistics.intervals import path_cost
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Status


def median_run(runs: Sequence[Run]) -> Run:
    """
    Return the run that stands for a solver on a scenario: the median one by cost, of two middle ones the cheaper.

    Paths count before paths that may not be flown, and those before no path at all: a failure is worse than any cost,
    so that what is shown is neither the luckiest run nor flattered by leaving failures out.

    Parameters
    ----------
    runs
        One solver's runs on one scenario, at least one, in any order.

    Returns
    -------
    run
        One of them, whatever their order; of equally costly ones the middle one by seed.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> from cgla_graph.model.solution import Solution
    >>> answers = [Solution(Status.NOT_FOUND), *(Solution(Status.FOUND, cost=cost) for cost in (3.0, 1.0, 2.0))]
    >>> runs = [Run(load_scenario("paper"), "a", seed, False, answer) for seed, answer in enumerate(answers)]
    >>> median_run(runs).solution.cost
    2.0
    """
    return sorted(runs, key=_worth)[(len(runs) - 1) // 2]


def _worth(run: Run) -> tuple[float, bool, float, int]:
    """Return what sorts runs, the best first."""
    is_infeasible = run.solution.status is Status.INFEASIBLE
    cost = float(run.solution.cost) if is_infeasible and not math.isnan(run.solution.cost) else math.inf
    return path_cost(run.solution), not is_infeasible, cost, -1 if run.seed is None else run.seed


def seeds_note(n_runs: int, n_found: int) -> str:
    """
    Say which run of how many is shown, to follow a number; empty for a single one, and where none found a path.

    Parameters
    ----------
    n_runs, n_found
        How many runs there were, and how many of them found a path.

    Examples
    --------
    >>> seeds_note(3, 3), seeds_note(3, 2), seeds_note(1, 1)
    (' (median of 3)', ' (median of 3, 2 found)', '')
    """
    if n_runs == 1 or not n_found:
        return ""
    return f" (median of {n_runs})" if n_found == n_runs else f" (median of {n_runs}, {n_found} found)"

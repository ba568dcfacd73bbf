"""Rows: what a comparison's runs become in tables and files."""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cgla_graph.comparisons.runner import Run
from cgla_graph.solution import Solution, Status

#: The columns of files, in order.
COLUMNS = (
    "scenario",
    "solver",
    "seed",
    "status",
    "cost",
    "excess",
    "length",
    "risk",
    "clearance",
    "lower_bound",
    "gap",
    "seconds",
    "build_seconds",
    "evaluations",
    "waypoints",
    "message",
)


def row(run: Run, best_exact: float = math.nan) -> dict[str, Any]:
    """
    Turn a run into a flat row; numbers that do not exist are None.

    Parameters
    ----------
    run
        The run.
    best_exact
        The lattice optimum of its scenario (see `best_exact`), which `excess` is relative to.

    Returns
    -------
    row
        One value for each of `COLUMNS`; lengths in map units, times in seconds.
    """
    solution = run.solution
    # a path that may not be flown is no match for one that may
    excess = excess_over(solution.cost, best_exact) if solution.status.is_path else math.nan
    return {
        "scenario": run.scenario.name,
        "solver": run.solver,
        "seed": run.seed,
        "status": solution.status.label,
        "cost": _number(solution.cost),
        "excess": _number(excess),
        "length": _number(solution.length),
        "risk": _number(solution.risk),
        "clearance": _number(solution.clearance),
        "lower_bound": _number(solution.lower_bound),
        "gap": _number(solution.gap),
        "seconds": _number(solution.seconds),
        "build_seconds": _number(solution.build_seconds),
        "evaluations": int(solution.evaluations) if math.isfinite(solution.evaluations) else None,
        "waypoints": np.size(solution.path, 0) if solution.status.is_path else 0,
        "message": str(solution.message),
    }


def rows_of(runs: Sequence[Run]) -> list[dict[str, Any]]:
    """Turn the runs of any scenarios into rows."""
    best = {id(group[0].scenario): best_exact(group) for group in by_scenario(runs)}
    return [row(run, best[id(run.scenario)]) for run in runs]


def by_scenario(runs: Iterable[Run]) -> list[list[Run]]:
    """Group runs by their scenario, in order; scenarios of the same name stay apart."""
    groups: dict[int, list[Run]] = {}
    for run in runs:
        groups.setdefault(id(run.scenario), []).append(run)
    return list(groups.values())


def best_exact(runs: Iterable[Run]) -> float:
    """Return the least cost that an exact graph solver found: the optimum of the lattice; NaN without one."""
    costs = [run.solution.cost for run in runs if run.exact and run.solution.status.is_path]
    return min(costs, default=math.nan)


def excess_over(cost: float, best: float) -> float:
    """
    Return by how much `cost` is above `best`, relative to it.

    Examples
    --------
    >>> round(excess_over(1.1, 1.0), 3), excess_over(0.0, 0.0)
    (0.1, 0.0)
    """
    if best == 0.0:
        return 0.0 if cost == 0.0 else math.inf
    return cost / best - 1.0


@dataclass(frozen=True)
class Summary:
    """
    One solver's runs on one scenario, of all its seeds.

    Attributes
    ----------
    solver
        The contender's label.
    status
        The common status, or how many of the runs found a path.
    n_paths
        How many of the runs found a path.
    cost, length, risk, clearance
        Of the run of median cost (the lower of two middle ones); a run without a path counts as infinitely costly.
    seconds, build_seconds, evaluations
        Medians over the runs.
    excess
        Of the median cost over the lattice optimum; NaN without one.
    spread
        Greatest minus least cost over the seeds, relative to the least; NaN for a single run.
    message
        The first message.
    """

    solver: str
    status: str
    n_paths: int
    cost: float
    excess: float
    length: float
    risk: float
    clearance: float
    seconds: float
    build_seconds: float
    evaluations: float
    spread: float
    message: str


def summaries(runs: Sequence[Run]) -> list[Summary]:
    """Summarise the runs of one scenario, a solver each, cheapest first."""
    groups: dict[str, list[Run]] = {}
    for run in runs:
        groups.setdefault(run.solver, []).append(run)
    best = best_exact(runs)
    found = [_summary(solver, group, best) for solver, group in groups.items()]
    # what found no path that may be flown comes last, whatever its path would cost
    return sorted(found, key=lambda summary: (summary.n_paths == 0, summary.cost))


def _summary(solver: str, runs: Sequence[Run], best: float) -> Summary:
    solutions = [run.solution for run in runs]
    labels = {solution.status.label for solution in solutions}
    n_paths = sum(solution.status.is_path for solution in solutions)
    costs = [solution.cost if solution.status.is_path else math.inf for solution in solutions]
    if n_paths == 0:
        # of a solver that found nothing that may be flown, the table shows what its path would cost
        costs = [solution.cost for solution in solutions]
    # the numbers of one run, so that cost = length + k * risk holds in every line
    cost = statistics.median_low(costs)
    typical = solutions[costs.index(cost)] if math.isfinite(cost) else Solution(Status.NOT_FOUND)
    spread = max(costs) / min(costs) - 1.0 if len(costs) > 1 and 0.0 < min(costs) < math.inf else math.nan
    return Summary(
        solver=solver,
        status=labels.pop() if len(labels) == 1 else f"found {n_paths}/{len(solutions)}",
        n_paths=n_paths,
        cost=cost,
        excess=excess_over(cost, best) if n_paths else math.nan,
        length=typical.length,
        risk=typical.risk,
        clearance=typical.clearance,
        seconds=statistics.median(solution.seconds for solution in solutions),
        build_seconds=statistics.median(solution.build_seconds for solution in solutions),
        evaluations=statistics.median(solution.evaluations for solution in solutions),
        spread=spread,
        message=next((str(solution.message) for solution in solutions if solution.message), ""),
    )


def _number(value: float) -> float | None:
    """JSON knows neither NaN nor infinity."""
    return float(value) if math.isfinite(value) else None

"""Rows: what a comparison's runs become in tables and files."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from cgla_graph.comparisons.numbers import json_number
from cgla_graph.comparisons.statistics.intervals import path_cost
from cgla_graph.comparisons.study.columns import COMPARED, RunColumn, excess_over
from cgla_graph.comparisons.study.median_run import median_run
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Solution, Status

#: The columns of files, in order.
COLUMNS = tuple(column.key for column in COMPARED)


def row(run: Run, best_exact: float = math.nan, columns: Sequence[RunColumn] = COMPARED) -> dict[str, Any]:
    """
    Turn a run into a flat row; numbers that do not exist are None.

    Parameters
    ----------
    run
        The run.
    best_exact
        The lattice optimum of its scenario (see `best_exact`), which `excess` is relative to.
    columns
        What to say of it.

    Returns
    -------
    row
        One value for each of the columns; lengths in map units, times in seconds.
    """
    return {column.key: _cell(column, run, best_exact) for column in columns}


def _cell(column: RunColumn, run: Run, best_exact: float) -> str | float | None:
    value = column.value(run, best_exact)
    match column.kind:
        case "word":
            return str(value)
        case "flag":
            return bool(value)
        case "whole":
            # a seed may be greater than any float
            return int(value) if isinstance(value, int) or (value is not None and math.isfinite(value)) else None
        case "number":
            return json_number(value)


def trace_row(run: Run) -> dict[str, Any]:
    """
    Turn the trace of a run into a row: lists of seconds since the solver started, evaluations and costs.

    What was built before that took `build_seconds`. The cost is None before the first path.
    """
    trace = run.solution.trace
    return {
        "scenario": run.scenario.name,
        "solver": run.solver,
        "seed": run.seed,
        "build_seconds": json_number(run.solution.build_seconds),
        "seconds": [json_number(point.seconds) for point in trace],
        "evaluations": [int(point.evaluations) for point in trace],
        "cost": [json_number(point.cost) for point in trace],
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


def by_solver(runs: Iterable[Run]) -> dict[str, list[Run]]:
    """Group the runs of one scenario by their solver, in order."""
    groups: dict[str, list[Run]] = {}
    for run in runs:
        groups.setdefault(run.solver, []).append(run)
    return groups


def scenario_bound(runs: Iterable[Run]) -> float:
    """
    Return the lower bound of one scenario's cost: the certificate's, else the best that a solver proved, else NaN.

    The certificate comes first, so that one number measures all solvers.
    """
    runs = list(runs)
    certified = [run.certificate.lower_bound for run in runs if run.certificate is not None]
    proven = [run.solution.lower_bound for run in runs if run.solution.status.has_path]
    for bounds in (certified, proven):
        known = [bound for bound in bounds if not math.isnan(bound)]
        if known:
            return max(known)
    return math.nan


def best_exact(runs: Iterable[Run]) -> float:
    """Return the least cost that an exact graph solver found: the optimum of the lattice; NaN without one."""
    costs = [run.solution.cost for run in runs if run.exact and run.solution.status.has_path]
    return min(costs, default=math.nan)


@dataclass(frozen=True)
class Summary:
    """
    One solver's runs on one scenario, of all its seeds: the numbers of its median run (see `median_run`).

    Attributes
    ----------
    solver
        The entrant's label.
    status
        The common status, or how many of the runs found a path.
    n_paths
        How many of the runs found a path.
    cost, length, risk, clearance
        Of its path. The cost is infinite and the others NaN where the median run has none that may be flown; of a
        solver that found none in any run, they are those of the path that may not.
    seconds, build_seconds, evaluations
        What the run took.
    gap
        See `Solution.gap`; NaN without a lower bound or a path.
    excess
        Of the cost over the lattice optimum; NaN without one.
    spread
        Greatest minus least cost over the seeds, relative to the least; NaN for a single run.
    message
        The first message.
    """

    solver: str
    status: str
    n_paths: int
    cost: float
    gap: float
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
    """
    Summarise the runs of one scenario, a solver each: least gap first, of equal gaps the one that took less time.

    Where some gaps are not known, least cost first. What found no path that may be flown comes last.
    """
    best = best_exact(runs)
    found = [_summary(solver, group, best) for solver, group in by_solver(runs).items()]
    known = all(math.isfinite(summary.gap) for summary in found if summary.n_paths)

    def place(summary: Summary) -> tuple[bool, float, float]:
        # optima that differ by rounding are equal
        measure = round(summary.gap, 9) if known and summary.n_paths else float(f"{summary.cost:.9g}")
        return summary.n_paths == 0, measure, summary.seconds + summary.build_seconds

    return sorted(found, key=place)


def _summary(solver: str, runs: Sequence[Run], best: float) -> Summary:
    solutions = [run.solution for run in runs]
    labels = {solution.status.label for solution in solutions}
    n_paths = sum(solution.status.has_path for solution in solutions)
    median = median_run(runs).solution
    # of a solver that found nothing that may be flown, the table shows what its path would cost
    costs = [path_cost(solution) if n_paths else solution.cost for solution in solutions]
    cost = path_cost(median) if n_paths else median.cost
    path = median if math.isfinite(cost) else Solution(Status.NOT_FOUND)
    spread = max(costs) / min(costs) - 1.0 if len(costs) > 1 and 0.0 < min(costs) < math.inf else math.nan
    return Summary(
        solver=solver,
        status=labels.pop() if len(labels) == 1 else f"found {n_paths}/{len(solutions)}",
        n_paths=n_paths,
        cost=cost,
        gap=path.gap if n_paths else math.nan,
        excess=excess_over(cost, best) if n_paths else math.nan,
        length=path.length,
        risk=path.risk,
        clearance=path.clearance,
        seconds=median.seconds,
        build_seconds=median.build_seconds,
        evaluations=median.evaluations,
        spread=spread,
        message=next((str(solution.message) for solution in solutions if solution.message), ""),
    )

"""Columns and rows of runs for tables, files and the report, and the median run that stands for a solver."""

import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from cgla_graph._text import duration, figure, json_number, rounded_down
from cgla_graph.comparisons.statistics.intervals import path_cost
from cgla_graph.comparisons.study.metric import Measure
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.earth import degrees_of
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.graphs.graph_scenario import GraphScenario

Kind: TypeAlias = Literal["word", "whole", "number", "flag"]
Format: TypeAlias = Literal[
    "name", "status", "message", "plain", "count", "figure", "percent", "time", "time-if-any", "memory"
]


class RunColumn(NamedTuple):
    """
    One column of the tables of runs.

    Attributes
    ----------
    key
        Its name in files.
    kind
        Type of its values; a missing whole number is None, a missing number NaN or infinite.
    value
        Computes the value from a run and the lattice optimum of its scenario (NaN where unknown, as in the tables of
        the terminal and the report).
    head
        Title in tables; a column without one appears in files only. Words other than names and the status appear in
        the report only, because a terminal has no room for them.
    format
        Format in tables.
    digits
        Significant digits in tables, for ``figure`` and ``memory``.
    kept
        Significant digits of a number in the report, enough to sort by.
    spare
        Order in which a narrow terminal drops columns, the least first; None: never.
    """

    key: str
    kind: Kind
    value: Callable[[Run, float], Any]
    head: str = ""
    format: Format = "plain"
    digits: int = 3
    kept: int = 5
    spare: int | None = 0


def excess_over(cost: float, best: float) -> float:
    """
    Return by how much `cost` is above `best`, relative to it.

    Examples
    --------
    >>> round(excess_over(1.1, 1.0), 3), excess_over(0.0, 0.0), excess_over(1.0, 0.0)
    (0.1, 0.0, inf)
    """
    if best == 0.0:
        return 0.0 if cost == 0.0 else math.inf
    return cost / best - 1.0


def _excess(run: Run, best_exact: float) -> float:
    # infeasible paths have no excess
    return excess_over(run.solution.cost, best_exact) if run.solution.status.has_path else math.nan


def _gap(run: Run, _: float) -> float:
    return run.solution.gap if run.solution.status.has_path else math.nan


def _waypoints(run: Run, _: float) -> int:
    if isinstance(run.scenario, GraphScenario):
        return len(run.solution.nodes) if run.solution.status.has_path else 0
    return np.size(run.solution.path, 0) if run.solution.status.has_path else 0


def _end(run: Run, which: str) -> str:
    return str(getattr(run.scenario.problem, which)) if isinstance(run.scenario, GraphScenario) else ""


def _nodes(run: Run, _: float) -> str:
    on_graph = isinstance(run.scenario, GraphScenario)
    return json.dumps([str(node) for node in run.solution.nodes], ensure_ascii=False) if on_graph else ""


def _settings(run: Run, _: float) -> str:
    return json.dumps({key: _plain(value) for key, value in run.settings.items()}, ensure_ascii=False)


def _plain(value: Any) -> Any:  # noqa: ANN401 - a solver's setting may be anything
    """Return a setting as a JSON value; values of other types become text."""
    finite = not isinstance(value, float) or math.isfinite(value)
    return value if isinstance(value, (bool, int, float, str, type(None))) and finite else str(value)


def _measured(name: str) -> Callable[[Run, float], float]:
    return lambda run, _: run.measure(name)


def metric_columns(runs: Iterable[Run]) -> list[RunColumn]:
    """Return a column for each metric of these runs."""
    known = {one.name: one.head for run in runs for one in run.measures}
    return [RunColumn(name, "number", _measured(name), head, "figure", 4) for name, head in known.items()]


#: Columns of runs between two nodes of a graph: the texts of labels, of the path's nodes as a JSON list.
_ON_GRAPH = (
    RunColumn("from", "word", lambda run, _: _end(run, "source")),
    RunColumn("to", "word", lambda run, _: _end(run, "target")),
    RunColumn("nodes", "word", _nodes),
)


def graph_columns(runs: Iterable[Run]) -> Sequence[RunColumn]:
    """Return the columns of runs on graphs, where one of these runs is."""
    return _ON_GRAPH if any(isinstance(run.scenario, GraphScenario) for run in runs) else ()


_NUMBER = RunColumn("number", "whole", lambda run, _: run.number, "number", spare=None)
#: Columns of every comparison, in the order of its files.
COMPARED = (
    RunColumn("scenario", "word", lambda run, _: run.scenario.name, "scenario", "name", spare=10),
    RunColumn("solver", "word", lambda run, _: run.solver, "solver", "name", spare=None),
    RunColumn("seed", "whole", lambda run, _: run.seed, "seed", spare=7),
    RunColumn("status", "word", lambda run, _: run.solution.status.label, "status", "status", spare=None),
    RunColumn("cost", "number", lambda run, _: run.solution.cost, "cost", "figure", 6, kept=8, spare=None),
    RunColumn("excess", "number", _excess),
    RunColumn("length", "number", lambda run, _: run.solution.length, "length", "figure", 6, kept=6, spare=6),
    RunColumn("risk", "number", lambda run, _: run.solution.risk, "risk", "figure", 4, spare=5),
    RunColumn("clearance", "number", lambda run, _: run.solution.clearance, "clearance", "figure", 3, spare=2),
    RunColumn("lower_bound", "number", lambda run, _: run.solution.lower_bound),
    RunColumn("claimed_bound", "number", lambda run, _: run.solution.claimed_bound),
    RunColumn("gap", "number", _gap, "gap", "percent", spare=9),
    RunColumn("seconds", "number", lambda run, _: run.solution.seconds, "time", "time", spare=8),
    RunColumn("build_seconds", "number", lambda run, _: run.solution.build_seconds, "build", "time-if-any", spare=4),
    RunColumn("evaluations", "whole", lambda run, _: run.solution.evaluations, "evaluations", "count", spare=3),
    RunColumn("waypoints", "whole", _waypoints),
    RunColumn("message", "word", lambda run, _: run.solution.message, "message", "message"),
)
#: Columns of a study, in the order of its exports.
EXPORTED = (
    _NUMBER,
    *COMPARED,
    RunColumn("settings", "word", _settings),
    RunColumn("megabytes", "number", lambda run, _: run.megabytes, "memory", "memory", spare=1),
    RunColumn("host", "word", lambda run, _: run.host),
    RunColumn("exact", "flag", lambda run, _: run.exact),
)
_CLEARANCE = next(place for place, column in enumerate(COMPARED) if column.key == "clearance")


def compared(runs: Sequence[Run]) -> list[RunColumn]:
    """Return the columns of a comparison of these runs: `COMPARED`, metrics after the clearance; those of graphs."""
    behind = COMPARED[_CLEARANCE + 1 :]
    return [*COMPARED[: _CLEARANCE + 1], *metric_columns(runs), *behind, *graph_columns(runs)]


def exported(runs: Sequence[Run]) -> list[RunColumn]:
    """Return the columns of exports of these runs: `EXPORTED`, their metrics, and those of graphs."""
    return [*EXPORTED, *metric_columns(runs), *graph_columns(runs)]


#: The first columns of tables; other numbers follow, then other words, which are widest.
_FIRST = ("number", "scenario", "solver", "seed", "status", "cost", "gap")


def shown(runs: Sequence[Run]) -> list[RunColumn]:
    """Return the columns of tables of these runs, in order."""
    return sorted(
        (column for column in exported(runs) if column.head),
        key=lambda one: (_FIRST.index(one.key) if one.key in _FIRST else len(_FIRST), one.kind == "word"),
    )


def median_run(runs: Sequence[Run]) -> Run:
    """
    Return the run that stands for a solver on a scenario: the median one by cost, of two middle ones the cheaper.

    Feasible paths rank before infeasible ones, and those before runs without a path: a failure ranks below any cost,
    so the shown run is neither the luckiest one nor better because failures are left out.

    Parameters
    ----------
    runs
        One solver's runs on one scenario, at least one, in any order.

    Returns
    -------
    run
        One of them, in any order of the runs; of equally costly ones the middle one by seed.

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
        Number of runs, and of those that found a path.

    Examples
    --------
    >>> seeds_note(3, 3), seeds_note(3, 2), seeds_note(1, 1)
    (' (median of 3)', ' (median of 3, 2 found)', '')
    """
    if n_runs == 1 or not n_found:
        return ""
    return f" (median of {n_runs})" if n_found == n_runs else f" (median of {n_runs}, {n_found} found)"


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
        Its columns.

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

    The graph was built before, in `build_seconds`. The cost is None before the first path.
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
    columns = compared(runs)
    return [row(run, best[id(run.scenario)], columns) for run in runs]


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

    The certificate comes first, so that one number measures all solvers. Claimed bounds are no bounds.
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
    n_runs, n_paths
        Number of runs, and of those that found a path.
    cost, length, risk, clearance
        Numbers of its path. Without a feasible path in the median run the cost is infinite and the others are NaN; if
        no run has one, they are those of the infeasible path.
    seconds, build_seconds, evaluations
        Effort of the run.
    gap
        See `Solution.gap`; NaN without a lower bound or a path.
    excess
        Of the cost over the lattice optimum; NaN without one.
    spread
        Greatest minus least cost over the seeds, relative to the least; NaN for a single run.
    message
        The first message.
    measures
        The metrics of its path.
    """

    solver: str
    status: str
    n_runs: int
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
    measures: Sequence[Measure] = ()


def summaries(runs: Sequence[Run]) -> list[Summary]:
    """
    Summarise the runs of one scenario by solver, the least gap first, then the least time.

    If a gap is unknown, the least cost comes first. Solvers without a feasible path come last.
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
    # without a feasible path the table shows the cost of the infeasible one
    costs = [path_cost(solution) if n_paths else solution.cost for solution in solutions]
    cost = path_cost(median) if n_paths else median.cost
    path = median if math.isfinite(cost) else Solution(Status.NOT_FOUND)
    spread = max(costs) / min(costs) - 1.0 if len(costs) > 1 and 0.0 < min(costs) < math.inf else math.nan
    return Summary(
        solver=solver,
        status=labels.pop() if len(labels) == 1 else f"found {n_paths}/{len(solutions)}",
        n_runs=len(solutions),
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
        measures=median_run(runs).measures,
    )


def bound_note(runs: Sequence[Run], unit: str = "") -> str:
    """Return one line that states the bound behind the gaps; empty if none is known and none was asked for."""
    bound = scenario_bound(runs)
    proof = next((run.certificate for run in runs if run.certificate is not None), None)
    if proof is None:
        known = f"how far above the lower bound {rounded_down(bound, 6)}{unit} that a solver proved"
        return "" if math.isnan(bound) else known
    if math.isnan(proof.lower_bound):
        return f"not known, as no lower bound could be proven: {proof.message}"
    if math.isinf(proof.lower_bound):
        return f"none, as it is proven that there is no path: {proof.message}"
    step = f"points on cells every {proof.spacing:.3g}" if proof.proof == "cells" else f"grid step {proof.spacing:.3g}"
    grid = f"{step}{unit}, " if proof.spacing > 0.0 else ""
    missed = "" if proof.reached else f"; not as tight as asked for: {proof.message}"
    return (
        f"how far above the proven lower bound {rounded_down(bound, 6)}{unit} ({grid}{duration(proof.seconds)}){missed}"
    )


def claims_note(runs: Iterable[Run], unit: str = "") -> str:
    """
    Say which bounds solvers claim, in one line; empty where none does.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> claims_note([Run(load_scenario("paper"), "mine", 1, False, Solution(Status.FOUND, claimed_bound=1.5))])
    'claimed by mine, not proven: no path costs less than 1.50000'
    """
    claims: dict[str, float] = {}
    for run in runs:
        if math.isfinite(run.solution.claimed_bound):
            claims[run.solver] = max(run.solution.claimed_bound, claims.get(run.solver, -math.inf))
    return "; ".join(
        f"claimed by {name}, not proven: no path costs less than {figure(claim, 6)}{unit}"
        for name, claim in claims.items()
    )


def certificate_document(run: Run) -> dict[str, Any] | None:
    """Return the certificate of a run's scenario as JSON; None without one."""
    proof = run.certificate
    return None if proof is None else {"scenario": run.scenario.name, **proof.document()}


def plan_document(run: Run) -> dict[str, Any]:
    """Return one path as JSON: its row, waypoints (in degrees too on such maps) and certificate."""
    scenario, path = run.on_map, run.solution.path
    projection = scenario.projection
    in_degrees = {} if projection is None or not len(path) else {"path_lonlat": degrees_of(path, projection).tolist()}
    return {
        **row(run),
        "path": path.tolist(),
        **in_degrees,
        "certificate": certificate_document(run),
        "stretch": json_number(scenario.problem.stretch(run.solution.path)),
    }

"""The data of the page: maps, median paths, curves and all runs as one JSON document, each name once."""

import math
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.comparisons.numbers import rounded, rounded_all
from cgla_graph.comparisons.report.graphs import frame_of, graph_document, shortened
from cgla_graph.comparisons.report.maps import Bounded, map_document, map_key, path_steps, steps_of
from cgla_graph.comparisons.statistics.intervals import Estimate, estimate, median_curve, path_cost, to_target
from cgla_graph.comparisons.study.rows import by_solver, claims_note, median_run, row, scenario_bound, shown
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Solution, Status
from cgla_graph.people.units import risk_unit
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario
from cgla_graph.scenarios.scenario import Scenario

#: Most points of a curve of one solver on one scenario, and of one over all scenarios.
MOST_POINTS, MOST_POINTS_OVERALL = 40, 160
_FINEST = 1e-4  # of the spread of the values: below what a screen shows
_COST_DIGITS = 8


def scenarios_document(
    groups: Sequence[Sequence[Run]], solvers: Sequence[str], proofs: Mapping[str, Mapping[str, Any]] | None = None
) -> dict[str, Any]:
    """
    Describe the scenarios: what each looks like, and what each solver did there.

    Parameters
    ----------
    groups
        The runs, a group a scenario.
    solvers
        All labels; documents name a solver by its place here.
    proofs
        The proof files of brackets, by scenario; None for none.

    Returns
    -------
    document
        ``scenarios`` and ``maps``; scenarios with the same map share it.
    """
    places = {label: number for number, label in enumerate(solvers)}
    keys: dict[str, int] = {}
    maps: list[dict[str, Any]] = []
    scenarios = []
    for runs in groups:
        scenario = runs[0].scenario
        # (pairs of one graph share the object)
        key = map_key(scenario) if isinstance(scenario, Scenario) else f"graph {id(scenario.problem.graph)}"
        if key not in keys:
            keys[key] = len(maps)
            maps.append(
                map_document(scenario) if isinstance(scenario, Scenario) else graph_document(scenario.problem.graph)
            )
        in_file = (proofs or {}).get(scenario.name)
        link = {} if in_file is None else {"proof_file": {**in_file, "href": quote(in_file["href"])}}
        scenarios.append({**_scenario(scenario, runs, places, keys[key]), **link})
    return {"scenarios": scenarios, "maps": maps}


def _scenario(scenario: AnyScenario, runs: Sequence[Run], places: dict[str, int], number: int) -> dict[str, Any]:
    bound = scenario_bound(runs)
    frame: Bounded | None
    if isinstance(scenario, GraphScenario):
        problem = scenario.problem
        frame, unit, k, risk = frame_of(problem.graph), "", None, ""
        nodes = [problem.graph.index_of(node) for node in (problem.source, problem.target)]
        ends = np.empty((0, 2)) if problem.graph.positions is None else problem.graph.positions[nodes]
    else:
        frame, unit = scenario.problem, "m" if scenario.projection else "map units"
        k, risk = scenario.problem.k, risk_unit(scenario.problem.field)
        ends = np.array([scenario.problem.start, scenario.problem.goal])
    proof = next((run.certificate for run in runs if run.certificate is not None), None)
    return {
        "name": scenario.name,
        "title": scenario.title,
        "map": number,
        "on_graph": isinstance(scenario, GraphScenario),
        "unit": unit,
        "k": k,
        "unit_of_risk": risk,
        "bound": rounded(bound, _COST_DIGITS),
        "unsolvable": math.isinf(bound),
        "proof": "" if proof is None else proof.message,
        "claims": claims_note(runs),
        "ends": [] if frame is None else steps_of(ends, frame),
        "cells": [_cell(frame, places[label], group) for label, group in by_solver(runs).items()],
    }


def _cell(frame: Bounded | None, place: int, runs: Sequence[Run]) -> dict[str, Any]:
    """Say what one solver did on one scenario: its median run, how confident that is, and its cost over time."""
    solutions = [run.solution for run in runs]
    costs = [path_cost(solution) for solution in solutions]
    median = estimate(costs)
    typical = median_run(runs)
    solution = typical.solution
    return {
        "solver": place,
        "runs": len(runs),
        "paths": sum(solution.status.has_path for solution in solutions),
        "status": solution.status.label,
        "message": solution.message,
        "cost": ends_of(median),
        "gap": rounded(solution.gap) if solution.status.has_path else None,
        "length": rounded(solution.length),
        "risk": rounded(solution.risk),
        "clearance": rounded(solution.clearance),
        "seconds": rounded(solution.total_seconds),
        "first": ends_of(estimate([to_target(one).seconds for one in solutions])),
        "number": typical.number,
        "path": path_steps(solution.path, frame) if frame is not None and _is_drawn(solution) else [],
        "nodes": shortened(solution.nodes) if solution.status.has_path else "",
        "curve": _curve(solutions),
    }


def _is_drawn(solution: Solution) -> bool:
    return (solution.status.has_path or solution.status is Status.INFEASIBLE) and len(solution.path) > 0


def ends_of(found: Estimate) -> list[float | None]:
    """Return a median and its interval for the page: None for "never" and for "no end"."""
    return rounded_all(found, _COST_DIGITS)


def _curve(solutions: Sequence[Solution]) -> dict[str, Any] | None:
    """Return the median cost over time with its band; None without a path. An end of the band may be missing."""
    curve = median_curve(solutions)
    if not len(curve.seconds):
        return None
    rows = thinned(np.column_stack([curve.seconds, curve.median, curve.low, curve.high]))
    document: dict[str, Any] = {"seconds": rounded_all(rows[:, 0], 4), "median": rounded_all(rows[:, 1])}
    if len(solutions) > 1:
        document |= {"low": rounded_all(rows[:, 2]), "high": rounded_all(rows[:, 3]), "interval": curve.is_interval}
    return document


def columns_document(runs: Sequence[Run] = ()) -> list[dict[str, Any]]:
    """
    Describe the columns of the table of runs, in order: where it finds them, their titles, and how they are written.

    Examples
    --------
    >>> columns_document()[5]
    {'key': 'cost', 'head': 'cost', 'kind': 'number', 'format': 'figure', 'digits': 6}
    """
    names = ("key", "head", "kind", "format", "digits")
    columns = [{name: getattr(column, name) for name in names} for column in shown(runs)]
    return [column | {"head": "#"} if column["key"] == "number" else column for column in columns]


def rows_document(runs: Sequence[Run], scenarios: Sequence[str], solvers: Sequence[str]) -> dict[str, Any]:
    """
    Turn the runs into columns.

    Parameters
    ----------
    runs
        All runs, in order.
    scenarios, solvers
        Names; the columns of these names hold places in these lists.

    Returns
    -------
    document
        One list a column, None for NaN and infinity. Columns of words hold places: that of the status in
        `statuses_document`, others in the lists of ``words``.
    """
    known = {"scenario": scenarios, "solver": solvers, "status": [status.label for status in Status]}
    columns = shown(runs)
    rows = [row(run, columns=columns) for run in runs]
    document: dict[str, Any] = {"words": {}}
    for column in columns:
        values = [one[column.key] for one in rows]
        if column.kind == "word":
            words = known.get(column.key) or list(dict.fromkeys(values))
            places = {word: place for place, word in enumerate(words)}
            values = [places[word] for word in values]
            if column.key not in known:
                document["words"][column.key] = words
        elif column.kind == "number":
            values = [None if value is None else rounded(value, column.kept) for value in values]
        document[column.key] = values
    return document


def statuses_document() -> list[dict[str, Any]]:
    """List how a run may end: the short word, the sentence, and whether there is a path."""
    return [{"label": one.label, "sentence": one.value, "is_path": one.has_path} for one in Status]


def rerun_command(folder: Path) -> str:
    """
    Return the command that runs one row again, without the row's number.

    Examples
    --------
    >>> rerun_command(Path("my study"))
    "cgla results 'my study' --rerun"
    """
    return f"cgla results {shlex.quote(str(folder))} --rerun"


def thinned(rows: FloatArray, most: int = MOST_POINTS) -> FloatArray:
    """
    Keep the rows where a step function changes by what can be seen.

    Every value that is shown was true at its moment; between two kept rows the curve is off by the slack at most, which
    grows from 1/10000 of the spread until few enough rows are left. The first and the last row stay, and so do those
    where a value becomes finite, unless there are more of these than may stay.

    Parameters
    ----------
    rows
        Shape ``(m, 1 + c)``: a moment, ascending, and `c` values that hold until the next row; they may be infinite.
    most
        Most rows to keep, at least 2.

    Returns
    -------
    rows
        Some of them, shape ``(at most most, 1 + c)``.

    Examples
    --------
    >>> thinned(np.array([[1.0, 9.0], [2.0, 9.0], [3.0, 5.0], [4.0, 5.0]]))
    array([[1., 9.], [3., 5.], [4., 5.]])
    """
    values = rows[:, 1:]
    finite = values[np.isfinite(values)]
    spread = float(np.ptp(finite)) if len(finite) else 0.0
    slack = _FINEST * spread
    kept = _changes(values, slack)
    while len(kept) > most and slack < spread:
        slack *= 2.0
        kept = _changes(values, slack)
    if len(kept) > most:
        kept = kept[np.unique(np.linspace(0, len(kept) - 1, most).round().astype(int))]
    return rows[kept]


def _changes(values: FloatArray, slack: float) -> IntArray:
    """List the first row, the last one, and those with a value in another step of the slack than the row before."""
    if not len(values):
        return np.empty(0, dtype=np.int64)
    levels = np.floor(values / slack) if slack > 0.0 else values
    changed = (levels[1:] != levels[:-1]).any(axis=1)
    changed[-1:] = True
    return np.concatenate([[0], np.nonzero(changed)[0] + 1])

"""What the page knows: maps, median paths, curves and all runs, as one JSON document with names said once."""

import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph.comparisons.curves import median_curve
from cgla_graph.comparisons.profiles import path_cost
from cgla_graph.comparisons.report.maps import map_document, map_key, path_steps, steps_of
from cgla_graph.comparisons.report.steps import rounded, rounded_all, thinned
from cgla_graph.comparisons.rows import by_solver, scenario_bound
from cgla_graph.comparisons.runner import Run
from cgla_graph.comparisons.statistics import Estimate, estimate, to_target
from cgla_graph.scenario import Scenario
from cgla_graph.solution import Solution, Status

_ROW_DIGITS = 8  # of costs in the table, so that sorting sees what differs


def scenarios_document(groups: Sequence[Sequence[Run]], solvers: Sequence[str]) -> dict[str, Any]:
    """
    Describe the scenarios: what each looks like, and what each solver did there.

    Parameters
    ----------
    groups
        The runs, a group a scenario.
    solvers
        All labels; documents name a solver by its place here.

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
        key = map_key(scenario)
        if key not in keys:
            keys[key] = len(maps)
            maps.append(map_document(scenario))
        scenarios.append(_scenario(scenario, runs, places, keys[key]))
    return {"scenarios": scenarios, "maps": maps}


def _scenario(scenario: Scenario, runs: Sequence[Run], places: dict[str, int], number: int) -> dict[str, Any]:
    problem, bound = scenario.problem, scenario_bound(runs)
    proof = next((run.certificate for run in runs if run.certificate is not None), None)
    return {
        "name": scenario.name,
        "title": scenario.title,
        "map": number,
        "unit": "m" if scenario.projection else "map units",
        "k": problem.k,
        "bound": rounded(bound, _ROW_DIGITS),
        "unsolvable": math.isinf(bound),
        "proof": "" if proof is None else proof.message,
        "ends": steps_of(np.array([problem.start, problem.goal]), problem),
        "cells": [_cell(scenario, places[label], group) for label, group in by_solver(runs).items()],
    }


def _cell(scenario: Scenario, place: int, runs: Sequence[Run]) -> dict[str, Any]:
    """Say what one solver did on one scenario: its median run, how sure that is, and its cost over time."""
    solutions = [run.solution for run in runs]
    costs = [path_cost(solution) for solution in solutions]
    median = estimate(costs)
    typical = typical_run(runs)
    solution = typical.solution
    return {
        "solver": place,
        "runs": len(runs),
        "paths": sum(solution.status.is_path for solution in solutions),
        "status": solution.status.label,
        "message": solution.message,
        "cost": ends_of(median),
        "gap": rounded(solution.gap) if solution.status.is_path else None,
        "length": rounded(solution.length),
        "risk": rounded(solution.risk),
        "clearance": rounded(solution.clearance),
        "seconds": rounded(solution.seconds + solution.build_seconds),
        "first": ends_of(estimate([to_target(one).seconds for one in solutions])),
        "number": typical.number,
        "path": path_steps(solution.path, scenario.problem) if _is_drawn(solution) else [],
        "curve": _curve(solutions),
    }


def _is_drawn(solution: Solution) -> bool:
    return (solution.status.is_path or solution.status is Status.INFEASIBLE) and len(solution.path) > 0


def typical_run(runs: Sequence[Run]) -> Run:
    """
    Choose the run that stands for all seeds: the lower of the two middle ones by cost.

    Where most runs found no path that may be flown, it is one of those that did not: an infeasible one, if there is
    one, else the first.
    """
    ordered = sorted(runs, key=lambda run: (path_cost(run.solution), run.solution.status is not Status.INFEASIBLE))
    middle = ordered[(len(ordered) - 1) // 2]
    if middle.solution.status.is_path:
        return middle
    return next(run for run in ordered if not run.solution.status.is_path)


def ends_of(found: Estimate) -> list[float | None]:
    """Return a median and its interval for the page: None for "never" and for "no end"."""
    return rounded_all(found, _ROW_DIGITS)


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


def rows_document(runs: Sequence[Run], scenarios: Sequence[str], solvers: Sequence[str]) -> dict[str, Any]:
    """
    Turn the runs into columns.

    Parameters
    ----------
    runs
        All runs, in order.
    scenarios, solvers
        Names; the columns of these names hold places in these lists. So does ``message``, in ``messages``.

    Returns
    -------
    document
        One list a column, None for what is no number.
    """
    scenario_places = {name: number for number, name in enumerate(scenarios)}
    solver_places = {label: number for number, label in enumerate(solvers)}
    status_places = {status: number for number, status in enumerate(Status)}
    messages: dict[str, int] = {"": 0}
    solutions = [run.solution for run in runs]
    return {
        "number": [run.number for run in runs],
        "scenario": [scenario_places[run.scenario.name] for run in runs],
        "solver": [solver_places[run.solver] for run in runs],
        "seed": [run.seed for run in runs],
        "status": [status_places[one.status] for one in solutions],
        "cost": [rounded(one.cost, _ROW_DIGITS) for one in solutions],
        "gap": [rounded(one.gap) if one.status.is_path else None for one in solutions],
        "length": rounded_all([one.length for one in solutions], 6),
        "risk": rounded_all([one.risk for one in solutions]),
        "clearance": rounded_all([one.clearance for one in solutions]),
        "seconds": rounded_all([one.seconds for one in solutions]),
        "build": rounded_all([one.build_seconds for one in solutions]),
        "evaluations": [rounded(one.evaluations, 12) for one in solutions],
        "megabytes": rounded_all([run.megabytes for run in runs]),
        "message": [messages.setdefault(str(one.message), len(messages)) for one in solutions],
        "messages": list(messages),
    }


def statuses_document() -> list[dict[str, Any]]:
    """List how a run may end: the short word, the sentence, and whether there is a path."""
    return [{"label": one.label, "sentence": one.value, "is_path": one.is_path} for one in Status]


def rerun_command(folder: Path) -> str:
    """
    Return the command that runs one row again, without the row's number.

    Examples
    --------
    >>> rerun_command(Path("my study"))
    "cgla results 'my study' --rerun"
    """
    return f"cgla results {shlex.quote(str(folder))} --rerun"

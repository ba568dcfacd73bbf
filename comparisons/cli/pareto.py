"""What the commands `pareto` and `plan --max-risk` compute, print and write."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.cli import output
from cgla_graph.comparisons.numbers import distortion_note, figure, json_number, percent, rounded_down
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.errors import CglaError
from cgla_graph.model.path_file import degrees_of
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import registry
from cgla_graph.solvers.trade_off.constrained import PlanWithin, plan_within_length, plan_within_risk
from cgla_graph.solvers.trade_off.pareto import Front, pareto

#: The columns of the waypoints of a front.
PATH_COLUMNS = ("path", "x", "y", "longitude", "latitude")
#: The columns of `pareto.csv`: a point's range of weights (empty: without end), and the path's numbers.
COLUMNS = ("k_low", "k_high", "k", "length", "risk", "cost", "waypoints")


def front_of(scenario: Scenario, entrant: Entrant) -> Front:
    """Compute the front of a scenario, on its own lattice and with the settings that suit it."""
    solver = registry.get(entrant.name, **entrant.settings_on(scenario))
    return pareto(scenario.problem, solver=solver, resolution=scenario.lattice)


def plan_of(
    scenario: Scenario,
    entrant: Entrant,
    max_risk: float | None,
    max_length: float | None,
    tolerance: float | None = 0.01,
) -> PlanWithin:
    """
    Plan within the one budget that is given.

    Raises
    ------
    CglaError
        If both are given, or the budget is no number of at least 0, or the path is to be refined.
    """
    if max_risk is not None and max_length is not None:
        msg = "--max-risk and --max-length are both given; limit one, and the other is made small"
        raise CglaError(msg)
    if entrant.refine:
        msg = f"--refine may break the budget; plan with --solver refine:base={entrant.name} instead"
        raise CglaError(msg)
    solver = registry.get(entrant.name, **entrant.settings_on(scenario))
    plan, budget = (plan_within_length, max_length) if max_risk is None else (plan_within_risk, max_risk)
    return plan(scenario.problem, budget or 0.0, solver=solver, resolution=scenario.lattice, tolerance=tolerance)


def run_of(scenario: Scenario, entrant: Entrant, solution: Solution) -> Run:
    """Make a run of a plan, for rows and pictures."""
    return Run(scenario, entrant.label, None, exact=False, solution=solution)


def print_front(scenario: Scenario, entrant: Entrant, front: Front) -> None:
    """Print a front as a table, or why there is none."""
    if not front.points:
        status = f"{front.status.label}: {front.status.value}"
        output.print_lines(
            {"scenario": scenario.full_title, "solver": entrant.label, "status": status, "remark": front.message}
        )
        return
    console.out_table(front_table(scenario, entrant, front))


def front_table(scenario: Scenario, entrant: Entrant, front: Front) -> FittedTable:
    """Show a front: a line a path, the shortest first; the knee has a star."""
    unit = "m" if scenario.projection else "map units"
    title = f"{scenario.full_title} ({entrant.label}, lengths in {unit})"
    heads = ("k from", "to", "length", "longer", "risk", "less risk", "knee")
    first = front.points[0]
    rows: list[Sequence[str]] = [
        [
            figure(point.k_low, 4),
            "any" if math.isinf(point.k_high) else figure(point.k_high, 4),
            figure(point.length, 6),
            percent(point.length / first.length - 1.0) if first.length else "-",
            figure(point.risk, 4),
            percent(point.risk / first.risk - 1.0) if first.risk else "-",
            "*" if point is front.knee else "",
        ]
        for point in front
    ]
    what = "proven on the lattice" if front.status.label == "optimal" else "as far as the solver finds paths"
    note = (
        f"{len(front)} paths by {front.n_solves} solves, k up to {figure(front.k_max, 4)}; between them, no path is "
        f"cheaper by more than {100.0 * front.error:.2g} %: {what}"
    )
    flat = distortion_note(scenario.problem, [point.path for point in front])
    notes = [note, flat] if flat else [note]
    return FittedTable(title, (), heads, ("less risk", "longer", "knee"), notes, rows)


def front_document(scenario: Scenario, entrant: Entrant, front: Front) -> dict[str, Any]:
    """Return a front as JSON; a range of weights without end has no `k_high`."""
    knee = front.knee
    return {
        "scenario": scenario.name,
        "solver": entrant.label,
        "status": front.status.label,
        "message": front.message,
        "error": json_number(front.error),
        "k_max": json_number(front.k_max),
        "solves": front.n_solves,
        "knee": None if knee is None else front.points.index(knee),
        "points": [
            {**row, "path": point.path.tolist()} for row, point in zip(front_rows(front), front.points, strict=True)
        ],
    }


def front_rows(front: Front) -> list[dict[str, Any]]:
    """Turn the points of a front into rows with `COLUMNS`; lengths in map units."""
    return [
        {
            "k_low": point.k_low,
            "k_high": json_number(point.k_high),
            "k": point.k,
            "length": point.length,
            "risk": point.risk,
            "cost": point.cost,
            "waypoints": len(point.path),
        }
        for point in front
    ]


def write_front(
    folder: Path, scenario: Scenario, entrant: Entrant, front: Front, formats: Sequence[str] = ("png",)
) -> list[Path]:
    """
    Write a front: ``NAME-SOLVER-pareto.csv``, a row a path, their waypoints (``-pareto-paths.csv``), and a picture.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    from cgla_graph.comparisons.plots.pareto import pareto_figure
    from cgla_graph.plots import pictures

    stem = output.stem_of(folder, scenario, entrant.label, "pareto")
    return [
        files.write_text(stem.with_name(f"{stem.name}.csv"), files.csv_text(front_rows(front), COLUMNS)),
        files.write_text(stem.with_name(f"{stem.name}-paths.csv"), _waypoints(scenario, front)),
        *pictures.save_all(pareto_figure(scenario, front), stem, formats),
    ]


def _waypoints(scenario: Scenario, front: Front) -> str:
    """Write the waypoints of all paths as CSV, each with the number of its row in the table of paths, from 1."""
    columns = PATH_COLUMNS if scenario.projection else PATH_COLUMNS[:3]
    rows: list[dict[str, Any]] = []
    for number, point in enumerate(front, start=1):
        table = np.column_stack(
            [point.path, *([degrees_of(point.path, scenario.projection)] if scenario.projection else [])]
        )
        rows += [dict(zip(columns, (number, *line), strict=True)) for line in table.tolist()]
    return files.csv_text(rows, columns)


def within_document(plan: PlanWithin) -> dict[str, Any]:
    """Return what is proven of a plan within a budget as JSON."""
    return {
        "limited": plan.limited,
        "budget": plan.budget,
        "k": json_number(plan.k),
        "dual_bound": json_number(plan.dual_bound),
        "duality_gap": json_number(plan.gap),
        "scope": plan.scope,
        "solves": plan.n_solves,
    }


def print_within(scenario: Scenario, plan: PlanWithin) -> None:
    """Print what is proven of a plan within a budget, a line each."""
    on_risk = plan.limited == "risk"
    units = ["", " m" if scenario.projection else ""]
    unit, other_unit = units if on_risk else units[::-1]
    whom = "on the lattice" if plan.scope == "lattice" else "inside the bounds"
    best = "shorter" if on_risk else "of less risk"
    bound = f"{rounded_down(plan.dual_bound, 9)}{other_unit}: no path {whom} within the budget is {best}"
    lines = {
        "budget": f"{plan.limited} at most {plan.budget:g}{unit}",
        "weight": "risk alone" if math.isinf(plan.k) else f"k = {figure(plan.k, 6)} prices the budget",
        "dual bound": f"none: no path {whom} keeps the budget" if math.isinf(plan.dual_bound) else bound,
        "gap": f"{percent(plan.gap)}: duality gap" if plan.status.has_path else "",
    }
    if not math.isnan(plan.dual_bound):
        output.print_lines(lines)

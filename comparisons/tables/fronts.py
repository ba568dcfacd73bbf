"""Fronts as tables: length against risk, and cost against a limit of the density."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from cgla_graph._text import DASH, at_most, counted, figure, percent, rounded_down
from cgla_graph.comparisons import files
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.model.earth import degrees_of, distortion_note
from cgla_graph.people.below import held_against
from cgla_graph.people.units import risk_unit
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers.trade_off.density import DensityPoint
from cgla_graph.solvers.trade_off.front import Front

#: The columns of the waypoints of a front.
PATH_COLUMNS = ("path", "x", "y", "longitude", "latitude")
#: The columns of `pareto.csv`: a point's range of weights (empty: without end), and the path's numbers.
COLUMNS = ("k_low", "k_high", "k", "length", "risk", "cost", "waypoints")
#: Further columns of a front with a proof: the bound under `k`, and the greatest gap from `k_low` to `k_high`.
PROVEN_COLUMNS = ("lower_bound", "gap")
#: The columns of the budgets of a front: of each the path's length and risk, and the bounds of the length.
BUDGET_COLUMNS = ("budget", "status", "length", "risk", "k", "dual_bound", "cut_bound", "lower_bound", "gap")
#: The columns of `density.csv`: the limit, whether a path was found or there is proven to be none, and its numbers.
DENSITY_COLUMNS = ("max_density", "status", "no_path", "cost", "length", "risk", "gap")


def front_table(scenario: Scenario, entrant: Entrant, front: Front) -> FittedTable:
    """Show a front: a line a path, the shortest first; the knee has a star."""
    unit = "m" if scenario.projection else "map units"
    title = f"{scenario.full_title} ({entrant.label}, lengths in {unit})"
    proven = front.bounds is not None
    heads = ("k from", "to", "length", "longer", "risk", "less risk", *(["gap"] if proven else []), "knee")
    first = front.points[0]
    rows: list[Sequence[str]] = [
        [
            figure(point.k_low, 4),
            "any" if math.isinf(point.k_high) else figure(point.k_high, 4),
            figure(point.length, 6),
            percent(point.length / first.length - 1.0) if first.length else "-",
            figure(point.risk, 4),
            percent(point.risk / first.risk - 1.0) if first.risk else "-",
            *([at_most(front.gap_of(point))] if proven else []),
            "*" if point is front.knee else "",
        ]
        for point in front
    ]
    flat = distortion_note(scenario.projection, [point.path for point in front])
    unit_of_risk = risk_unit(scenario.problem.field)
    notes = [
        proven_note(front) if proven else _note(front),
        *([f"risk in {unit_of_risk}"] if unit_of_risk else []),
        *([flat] if flat else []),
    ]
    return FittedTable(title, (), heads, ("less risk", "longer", "knee", "gap"), notes, rows)


def _note(front: Front) -> str:
    """State in one sentence how good a front without a proof is."""
    what = "proven on the lattice" if front.status.label == "optimal" else "if the solver's paths are the best"
    solves = f"{len(front)} paths by {front.n_solves} solves, k up to {figure(front.k_max, 4)}"
    return f"{solves}; between them, no path is cheaper by more than {100.0 * front.error:.2g} %: {what}"


def budgets_table(scenario: Scenario, front: Front) -> FittedTable:
    """Show the shortest paths within budgets of risk, and the bounds of all such paths, a line a budget."""
    unit = "m" if scenario.projection else "map units"
    rows: list[Sequence[str]] = []
    for plan in front.budgets:
        found, bounds = plan.solution, (plan.dual_bound, plan.cut_bound)
        shown = [figure(found.length, 6), figure(found.risk, 4)] if plan.status.has_path else [DASH] * 2
        proven = [rounded_down(bound, 6) if math.isfinite(bound) else DASH for bound in bounds]
        rows.append([figure(plan.budget, 4), *shown, *proven, "no path" if plan.no_path else at_most(plan.gap)])
    heads = ("risk at most", "length", "risk", "dual bound", "cut bound", "gap")
    note = "no path within the budget is shorter than the greater bound; the cut has the best k at each place"
    return FittedTable(
        f"the shortest within a budget (lengths in {unit})", (), heads, ("risk", "dual bound"), [note], rows
    )


def proven_note(front: Front) -> str:
    """
    State in one sentence what is proven of a front.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> proven_note(cg.pareto(cg.Problem((0, 0), (1, 0)), proven=True))
    '1 path; for every k from 0 to 1000, the cheapest one costs at most 0.00 % more than the best possible: 1 proof'
    """
    proofs = counted(0 if front.bounds is None else len(front.bounds.weights), "proof")
    what = f"for every k from 0 to {figure(front.k_max, 4)}, the cheapest one costs at most {at_most(front.gap)} more"
    said = f"{counted(len(front), 'path')}; {what} than the best possible: {proofs}"
    return "; ".join(filter(None, [said, front.message]))


def density_table(scenario: Scenario, entrant: Entrant, corridor: float, front: Sequence[DensityPoint]) -> FittedTable:
    """Show a front, a line a limit, the lowest first."""
    unit = "m" if scenario.projection else "map units"
    title = f"{scenario.full_title} ({entrant.label}, corridor {corridor:g} wide, lengths in {unit})"
    rows: list[Sequence[str]] = []
    for point in front:
        found = point.solution
        has_path = found.status.has_path
        status = "proven: no path" if point.no_path else found.status.label
        numbers = [figure(found.cost, 6), figure(found.length, 6), figure(found.risk, 4), percent(found.gap)]
        rows.append([status, figure(point.level, 4), *(numbers if has_path else ["-"] * 4)])
    heads = ("at most", "cost", "length", "risk", "gap")
    what = f"in {held_against(scenario.problem)[1]}; risk in {risk_unit(scenario.problem.field)}"
    note = f"at most: no cell within half the corridor is above it, {what}"
    return FittedTable(title, ("status",), heads, ("risk", "gap"), [note], rows)


def csv_of_documents(documents: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> str:
    """Write some keys of JSON documents as CSV."""
    return files.csv_text([{key: one[key] for key in columns} for one in documents], columns)


def waypoints_csv(scenario: Scenario, front: Front) -> str:
    """Write the waypoints of all paths as CSV, each with the number of its row in the table of paths, from 1."""
    columns = PATH_COLUMNS if scenario.projection else PATH_COLUMNS[:3]
    rows: list[dict[str, Any]] = []
    for number, point in enumerate(front, start=1):
        table = np.column_stack(
            [point.path, *([degrees_of(point.path, scenario.projection)] if scenario.projection else [])]
        )
        rows += [dict(zip(columns, (number, *line), strict=True)) for line in table.tolist()]
    return files.csv_text(rows, columns)

"""What `pareto --corridor` computes, prints and writes: the cost of each limit of the density under a corridor."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from cgla_graph.comparisons import files
from cgla_graph.comparisons.cli import output
from cgla_graph.comparisons.numbers import figure, json_number, percent
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import registry
from cgla_graph.solvers.trade_off.density import DensityPoint, density_front, is_proven_closed

#: The columns of `density.csv`: the limit, whether a path was found or there is proven to be none, and its numbers.
COLUMNS = ("max_density", "status", "no_path", "cost", "length", "risk", "gap")


def front_of(scenario: Scenario, entrant: Entrant, corridor: float) -> list[DensityPoint]:
    """Compute the front of a scenario with the settings that suit it."""
    solver = registry.get(entrant.name, **entrant.settings_on(scenario))
    return density_front(scenario.problem, corridor=corridor, solver=solver)


def with_proof(run: Run) -> Run:
    """Return a run that found no path under a limit with the proof that there is none, where there is one."""
    if run.solution.status.has_path or not is_proven_closed(run.scenario.problem):
        return run
    message = "proven: no path stays below the density, not even one that touches the cells above it"
    return dataclasses.replace(run, solution=dataclasses.replace(run.solution, status=Status.NO_PATH, message=message))


def front_table(scenario: Scenario, entrant: Entrant, corridor: float, front: Sequence[DensityPoint]) -> FittedTable:
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
    note = "at most: no cell of a raster within half the corridor is above it, in the raster's unit"
    return FittedTable(title, ("status",), heads, ("risk", "gap"), [note], rows)


def front_rows(front: Sequence[DensityPoint]) -> list[dict[str, Any]]:
    """Return the front as rows of `COLUMNS`."""
    return [
        {
            "max_density": point.level,
            "status": point.solution.status.label,
            "no_path": point.no_path,
            "cost": json_number(point.solution.cost),
            "length": json_number(point.solution.length),
            "risk": json_number(point.solution.risk),
            "gap": json_number(point.solution.gap),
        }
        for point in front
    ]


def front_document(
    scenario: Scenario, entrant: Entrant, corridor: float, front: Sequence[DensityPoint]
) -> dict[str, Any]:
    """Return the front as JSON."""
    points = [
        {**row, "path": point.solution.path.tolist()} for row, point in zip(front_rows(front), front, strict=True)
    ]
    return {"scenario": scenario.name, "solver": entrant.label, "corridor": corridor, "points": points}


def write_front(folder: Path, scenario: Scenario, entrant: Entrant, front: Sequence[DensityPoint]) -> list[Path]:
    """
    Write a front: ``NAME-SOLVER-density.csv``.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    stem = output.stem_of(folder, scenario, entrant.label, "density")
    return [files.write_text(stem.with_name(f"{stem.name}.csv"), files.csv_text(front_rows(front), COLUMNS))]

"""Certificates in words and as a table: how the bracket closed, grid by grid."""

from collections.abc import Callable
from typing import Any

from cgla_graph._text import at_most, figure, json_number, rounded_down
from cgla_graph.certificate.certificate import Certificate, Grid
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.errors import CglaError
from cgla_graph.model.solution import gap_between

#: The columns of `certificate.csv`, one row a grid: its step in map units and as a fraction of the longer side.
COLUMNS = ("spacing", "fraction", "cells", "lower_bound", "upper_bound", "gap")


def proof_of(run: Run) -> Certificate:
    """
    Return the certificate of a run.

    Raises
    ------
    CglaError
        If it has none.
    """
    if run.certificate is None:
        msg = f"{run.scenario.name}: the run of {run.solver} has no certificate"
        raise CglaError(msg)
    return run.certificate


def certificate_table(run: Run) -> FittedTable:
    """Show how the bracket closed: a line a grid, coarse to fine."""
    unit = "m" if run.scenario.projection else "map units"
    columns: dict[str, Callable[[Grid], str]] = {
        "grid step": lambda grid: f"1/{grid.steps}",
        f"in {unit}": lambda grid: figure(grid.spacing, 3),
        "cells": lambda grid: f"{grid.cells:,}",
        "lower bound": lambda grid: rounded_down(grid.lower_bound, 7),
        "upper bound": lambda grid: figure(grid.upper_bound, 7),
        "gap at most": lambda grid: at_most(gap_between(grid.upper_bound, grid.lower_bound)),
    }
    proof = proof_of(run)
    of_points = ", mean distance of points on cells" if proof.proof == "cells" else ""
    notes = (
        f"grid step: as a part of the map's longer side{of_points}",
        "cells: the tube, which no better path leaves",
    )
    return FittedTable.of("", proof.grids, {}, columns, (f"in {unit}", "cells"), notes)


def grid_rows(proof: Certificate) -> list[dict[str, Any]]:
    """Turn the grids of a certificate into rows with `COLUMNS`; numbers that do not exist are None."""
    return [
        {
            "spacing": grid.spacing,
            "fraction": 1.0 / grid.steps,
            "cells": grid.cells,
            "lower_bound": json_number(grid.lower_bound),
            "upper_bound": json_number(grid.upper_bound),
            "gap": json_number(gap_between(grid.upper_bound, grid.lower_bound)),
        }
        for grid in proof.grids
    ]

"""What the command `certify` computes, prints and writes: a path, and the bracket that closed around the optimum."""

import csv
import dataclasses
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph._types import FloatArray, WholeArray
from cgla_graph._validate import positive_number
from cgla_graph.certificate.certificate import MAX_CELLS, Certificate, Grid, lower_bound
from cgla_graph.certificate.subsolution import FIRST_CELLS
from cgla_graph.comparisons import earth, files, output, rows, terminal
from cgla_graph.comparisons.contender import Contender
from cgla_graph.comparisons.fitted_table import FittedTable
from cgla_graph.comparisons.rows import json_number
from cgla_graph.comparisons.runner import Run
from cgla_graph.comparisons.tables import duration, figure, rounded_down
from cgla_graph.errors import CglaError, ProblemError, ScenarioError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.projection import LocalProjection
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.scenarios.text_files import read_text
from cgla_graph.solvers import registry
from cgla_graph.solvers.solving import solve

#: The solver whose path the bound is held against unless a file gives one.
SOLVER = "hybrid"
#: Start and goal in a file may be off by this, relative to the longer side of the map, as rounded coordinates are.
END_TOLERANCE = 1e-6
#: The columns of `certificate.csv`, one row a grid: its step in map units and as a fraction of the longer side.
COLUMNS = ("spacing", "fraction", "cells", "lower_bound", "upper_bound", "gap")


def certify(
    scenario: Scenario, file: Path | None = None, *, tolerance: float = 0.001, max_cells: int = MAX_CELLS
) -> Run:
    """
    Prove how far a path is from the best possible.

    Parameters
    ----------
    scenario
        The map.
    file
        Waypoints, as `read_path` takes them; None: the path of `SOLVER`.
    tolerance, max_cells
        As `cgla_graph.certificate.certificate.lower_bound` takes them.

    Returns
    -------
    run
        The path, named after its file or solver, with its certificate. Without a path the bound holds all the same.
        That of a map in longitude and latitude holds on the Earth (see `Scenario.bound_on_earth`).

    Raises
    ------
    CglaError
        If a setting is out of range, or the file is not there, malformed, or holds no feasible path from start to goal.
    """
    positive_number("--tolerance", tolerance)
    if max_cells < FIRST_CELLS**2:
        msg = f"--max-cells is {max_cells}; give at least {FIRST_CELLS**2}, the cells of the first grid"
        raise CglaError(msg)
    problem = scenario.problem
    if file is None:
        settings = Contender.parse(SOLVER).settings_on(scenario)
        solution = solve(problem, registry.get(SOLVER, **settings), resolution=scenario.lattice)
    else:
        solution = _judged(problem, read_path(file, scenario), str(file))
    held = solution.path if solution.status.is_path else None
    on_plane = earth.plane_tolerance(scenario, tolerance, solution.cost)
    found = lower_bound(problem, on_plane, path=held, max_cells=max_cells)
    proof = earth.certificate_on_earth(scenario, found, tolerance)
    # what a solver says of its own path gives way to the proof that was asked for
    bounded = dataclasses.replace(solution, lower_bound=proof.lower_bound, certificate_seconds=proof.seconds)
    return Run(scenario, SOLVER if file is None else file.name, None, exact=False, solution=bounded, certificate=proof)


def _judged(problem: Problem, path: FloatArray, name: str) -> Solution:
    """Have the oracle judge the path of a file."""
    solution = problem.judge(Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost))
    if not solution.status.is_path:
        msg = f"{name}: the path is not feasible: {solution.message}; give one that may be flown"
        raise ScenarioError(msg)
    return solution


def read_path(file: Path, scenario: Scenario) -> FloatArray:
    """
    Read the waypoints of a path, as `cgla_graph.comparisons.files.path_csv` writes them.

    Parameters
    ----------
    file
        CSV with the columns ``x`` and ``y``, map units; or on a lon/lat map without these, ``longitude`` and
        ``latitude``, degrees. Other columns are ignored.
    scenario
        The map.

    Returns
    -------
    path
        Shape ``(m, 2)``, map units. Ends that differ from start and goal by rounding (`END_TOLERANCE`) become them.

    Raises
    ------
    ScenarioError
        If the file is not there, lacks a column, holds something else than numbers, or does not join start and goal.
    """
    name = str(file)
    # a reader of CSV splits the lines itself
    reader = csv.reader(io.StringIO(read_text(file, name, "a CSV file of waypoints"), newline=""), strict=True)
    try:
        lines = [(reader.line_num, line) for line in reader if line]
    except csv.Error as error:
        msg = f"{name}: line {reader.line_num} is no CSV ({error}); give a file such as cgla plan --out writes"
        raise ScenarioError(msg) from error
    heads = [head.strip().lower() for head in lines[0][1]] if lines else []
    wanted = _columns(heads, scenario.projection, name)
    places = [_numbers(line, [heads.index(column) for column in wanted], f"{name}: line {n}") for n, line in lines[1:]]
    if not places:
        msg = f"{name}: there are no waypoints below the line {','.join(heads)}; give start, goal and what is between"
        raise ScenarioError(msg)
    path = np.array(places)
    if wanted[0] != "x" and scenario.projection is not None:
        try:
            path = scenario.projection.forward(path)
        except ProblemError as error:
            msg = f"{name}: {error}"
            raise ScenarioError(msg) from error
    return _joined(path, scenario.problem, name)


def _columns(heads: list[str], projection: LocalProjection | None, name: str) -> tuple[str, str]:
    """Choose the two columns that hold the points."""
    pairs = [("x", "y")] if projection is None else [("x", "y"), ("longitude", "latitude")]
    for pair in pairs:
        if set(pair) <= set(heads):
            return pair
    got = f"the first line says {','.join(heads)[:60]!r}" if heads else "it is empty"
    allowed = " or ".join(",".join(pair) for pair in pairs)
    msg = f"{name}: {got}; the first line has to name the columns {allowed}, as cgla plan --out writes them"
    raise ScenarioError(msg)


def _numbers(line: list[str], places: list[int], where: str) -> list[float]:
    cells = [line[place].strip() if place < len(line) else "" for place in places]
    try:
        numbers = [float(cell) for cell in cells]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        msg = f"{where} holds {','.join(cells)[:60]!r}; a waypoint is two finite numbers"
        raise ScenarioError(msg)
    return numbers


def _joined(path: FloatArray, problem: Problem, name: str) -> FloatArray:
    """Put the ends of a path on start and goal, which they may miss by rounding only."""
    x_min, y_min, x_max, y_max = problem.bounds
    allowed = END_TOLERANCE * max(x_max - x_min, y_max - y_min)
    joined = path.copy()
    for what, index, end in (("starts", 0, problem.start), ("ends", -1, problem.goal)):
        if math.dist(path[index], end) > allowed:
            at = "({:.9g}, {:.9g})"
            msg = (
                f"{name}: the path {what} at {at.format(*path[index])} instead of {at.format(*end)}; give a path of "
                "this scenario, or move its ends with --start and --goal"
            )
            raise ScenarioError(msg)
        joined[index] = end
    return joined


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


def at_most(ratio: float) -> str:
    """
    Write a ratio as a percentage that is never below it.

    Examples
    --------
    >>> at_most(0.00057287), at_most(0.0), at_most(1e-9)
    ('0.06 %', '0.00 %', '0.01 %')
    """
    return f"{math.ceil(1e4 * ratio) / 1e2:.2f} %" if math.isfinite(ratio) else "-"


def verdict(run: Run, *, digits: int = 9, scale: float = 1.0, unit: str = "") -> str:
    """
    Say in one sentence what is proven.

    Parameters
    ----------
    run
        With a certificate.
    digits
        Significant digits of costs.
    scale, unit
        What costs are multiplied with, and what follows them.
    """
    proof = proof_of(run)
    if math.isnan(proof.lower_bound):
        return "nothing is proven"
    if math.isinf(proof.lower_bound):
        return "there is no path inside the bounds"
    bound = f"no path costs less than {rounded_down(proof.lower_bound * scale, digits)}{unit}"
    if math.isinf(proof.upper_bound):
        return f"{bound}; no path is known"
    which = "this one" if run.solution.status.is_path else "the best that the proof knows"
    cost = f"{figure(proof.upper_bound * scale, digits)}{unit}"
    return f"{bound}; {which} costs {cost}, at most {at_most(proof.gap)} more than the best possible"


def is_done(run: Run) -> bool:
    """Say whether there is a path, and a bound that it is held against."""
    proof = proof_of(run)
    return math.isfinite(proof.upper_bound) and not math.isnan(proof.lower_bound)


def print_certificate(run: Run) -> None:
    """Print the path, a line a grid, and what is proven."""
    scenario, solution, proof = run.scenario, run.solution, proof_of(run)
    unit = " m" if scenario.projection else ""
    numbers = f"cost {figure(solution.cost, 9)}{unit}, length {figure(solution.length, 9)}{unit}, "
    numbers += f"risk {figure(solution.risk, 6)}, {len(solution.path)} waypoints"
    none = f"{solution.status.label}: {solution.message or solution.status.value}"
    _print_line("scenario", f"{scenario.full_title} (k = {scenario.problem.k:g})")
    _print_line("path", f"{run.solver}: {numbers if solution.status.is_path else none}")
    if proof.grids:
        terminal.out_table(certificate_table(run))
    remedy = "; --max-cells N allows more" if "allowed" in proof.message else ""
    _print_line("proven", verdict(run, unit=unit))
    if note := earth.distortion_note(scenario, [solution.path]):
        _print_line("flat map", note)
    _print_line("ended", f"{proof.message}{remedy} ({duration(proof.seconds)})")


def _print_line(key: str, text: str) -> None:
    terminal.out(f"{key:10} {text}\n")


def certificate_table(run: Run) -> FittedTable:
    """Show how the bracket closed: a line a grid, coarse to fine."""
    unit = "m" if run.scenario.projection else "map units"
    heads = ("grid step", f"in {unit}", "cells", "lower bound", "upper bound", "gap")
    rows: list[Sequence[str]] = [
        [
            f"1/{max(grid.last)}",
            figure(grid.spacing, 3),
            f"{n_cells(grid.runs):,}",
            rounded_down(grid.lower_bound, 7),
            figure(grid.upper_bound, 7),
            at_most(_gap(grid)),
        ]
        for grid in proof_of(run).grids
    ]
    notes = ("grid step: as a part of the map's longer side", "cells: the tube, which no better path leaves")
    return FittedTable("", (), heads, (heads[1], heads[2]), notes, rows)


def _gap(grid: Grid) -> float:
    """Return how far apart the two bounds of a grid are; infinite where one is missing."""
    if grid.lower_bound == grid.upper_bound:
        return 0.0
    return grid.upper_bound / grid.lower_bound - 1.0 if grid.lower_bound > 0.0 else math.inf


def n_cells(runs: WholeArray) -> int:
    """Count the cells of merged runs, shape ``(n, 3)`` (see `cgla_graph.eikonal.cell_runs`)."""
    return int((runs[:, 2] - runs[:, 1]).sum())


def grid_rows(proof: Certificate) -> list[dict[str, Any]]:
    """Turn the grids of a certificate into rows with `COLUMNS`; numbers that do not exist are None."""
    return [
        {
            "spacing": grid.spacing,
            "fraction": 1.0 / max(grid.last),
            "cells": n_cells(grid.runs),
            "lower_bound": json_number(grid.lower_bound),
            "upper_bound": json_number(grid.upper_bound),
            "gap": json_number(_gap(grid)),
        }
        for grid in proof.grids
    ]


def certificate_document(run: Run) -> dict[str, Any]:
    """Return a certified path as JSON: its row, its waypoints, what is proven, and each grid."""
    return {
        **rows.row(run),
        "path": run.solution.path.tolist() if run.solution.status.is_path else [],
        "certificate": output.certificate_document(run),
        "stretch": json_number(run.scenario.stretch(run.solution.path)),
        "grids": grid_rows(proof_of(run)),
    }


def write_certificate(folder: Path, run: Run) -> list[Path]:
    """
    Write `certificate.csv`, a row a grid, and the picture, `certificate.png` and `certificate.svg`.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    from cgla_graph.comparisons import plots  # noqa: PLC0415 - matplotlib only where something is drawn
    from cgla_graph.comparisons.plot_certificate import certificate_figure  # noqa: PLC0415 - the same

    written = [files.write_text(folder / "certificate.csv", files.csv_text(grid_rows(proof_of(run)), COLUMNS))]
    drawn = certificate_figure(run)
    return [*written, *(plots.save(drawn, folder / f"certificate.{kind}") for kind in ("png", "svg"))]

"""What the command `certify` computes, prints and writes: a path, and the bracket that closed around the optimum."""

import csv
import dataclasses
import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import positive_number
from cgla_graph.airspace.flight_plans.formats import read_plan
from cgla_graph.certificate.certificate import MAX_CELLS
from cgla_graph.certificate.subsolution import FIRST_CELLS
from cgla_graph.certificate.verdict import verdict
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.cli import output
from cgla_graph.comparisons.numbers import distortion_note, duration, figure
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.certificate import COLUMNS, certificate_table, grid_rows, proof_of
from cgla_graph.errors import CglaError, ProblemError, ScenarioError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.scenarios.text_files import read_text
from cgla_graph.solvers import registry
from cgla_graph.solvers.solving import lower_bound, solve

#: The solver whose path the bound is held against unless a file gives one.
SOLVER = "hybrid"
#: Start and goal in a file may be off by this, relative to the longer side of the map, as rounded coordinates are.
END_TOLERANCE = 1e-6
#: Endings of flight plans; CSV is read with all that it knows of the map.
PLANS = (".plan", ".waypoints", ".kml", ".kmz", ".gpx", ".geojson", ".json")


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
        As `cgla_graph.lower_bound` takes them.

    Returns
    -------
    run
        The path, named after its file or solver, with its certificate. Without a path the bound holds all the same.
        That of a map in longitude and latitude holds on the Earth.

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
        settings = Entrant.parse(SOLVER).settings_on(scenario)
        solution = solve(problem, registry.get(SOLVER, **settings), resolution=scenario.lattice)
    else:
        solution = _judged(problem, read_path(file, scenario), str(file))
    held = solution.path if solution.status.has_path else None
    proof = lower_bound(problem, tolerance, path=held, max_cells=max_cells)
    # what a solver says of its own path gives way to the proof that was asked for
    bounded = dataclasses.replace(solution, lower_bound=proof.lower_bound, certificate_seconds=proof.seconds)
    return Run(scenario, SOLVER if file is None else file.name, None, exact=False, solution=bounded, certificate=proof)


def _judged(problem: Problem, path: FloatArray, name: str) -> Solution:
    """Have the oracle judge the path of a file."""
    solution = problem.judge(Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost))
    if not solution.status.has_path:
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
        ``latitude``, degrees. Other columns are ignored. Or a flight plan in another format, on a lon/lat map.
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
    if file.suffix.lower() in PLANS:
        return _joined(_of_plan(file, scenario), scenario.problem, name)
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


def _of_plan(file: Path, scenario: Scenario) -> FloatArray:
    """Read the waypoints of a flight plan, map units."""
    plan = read_plan(file)
    if (scenario.projection is None) is (plan.coordinates == "lonlat"):
        kinds = "x and y", "longitude and latitude"
        here, there = kinds if scenario.projection is None else reversed(kinds)
        msg = f"{file}: the plan is in {there}, and the map {scenario.name} in {here}; give one of the same coordinates"
        raise ScenarioError(msg)
    points = plan.points if scenario.projection is None else scenario.projection.forward(plan.points)
    # the landing is where the last leg ends
    kept = np.concatenate([[True], (points[1:] != points[:-1]).any(axis=1)])
    return np.asarray(points[kept])


def _columns(heads: list[str], projection: LocalProjection | None, name: str) -> tuple[str, str]:
    """Choose the two columns that hold the points."""
    pairs = [("x", "y")] if projection is None else [("x", "y"), ("longitude", "latitude")]
    for pair in pairs:
        if set(pair) <= set(heads):
            return pair
    got = f"the first line says {shown(','.join(heads))}" if heads else "it is empty"
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
        msg = f"{where} holds {shown(','.join(cells))}; a waypoint is two finite numbers"
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
    output.print_lines({
        "scenario": f"{scenario.full_title} (k = {scenario.problem.k:g})",
        "path": f"{run.solver}: {numbers if solution.status.has_path else none}",
    })  # fmt: skip
    if proof.grids:
        console.out_table(certificate_table(run))
    remedy = "; --max-cells N allows more" if "allowed" in proof.message else ""
    output.print_lines({
        "proven": verdict(proof, with_path=solution.status.has_path, unit=unit),
        "flat map": distortion_note(scenario.problem, [solution.path]),
        "ended": f"{proof.message}{remedy} ({duration(proof.seconds)})",
    })  # fmt: skip


def certificate_document(run: Run) -> dict[str, Any]:
    """Return a certified path as JSON: what `plan_document` says, and each grid."""
    return {**output.plan_document(run), "grids": grid_rows(proof_of(run))}


def write_certificate(folder: Path, run: Run, formats: Sequence[str] = ("png", "svg")) -> list[Path]:
    """
    Write ``NAME-SOLVER-certificate.csv``, a row a grid, and the picture.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    from cgla_graph.comparisons.plots.runs import certificate_of_run
    from cgla_graph.plots import pictures

    stem = output.stem_of(folder, run.scenario, run.solver.removesuffix(".csv"), "certificate")
    table = files.csv_text(grid_rows(proof_of(run)), COLUMNS)
    written = [files.write_text(stem.with_name(f"{stem.name}.csv"), table)]
    return [*written, *pictures.save_all(certificate_of_run(run), stem, formats)]

"""The commands `certify` and `verify`: a proven bracket around the least cost of any path, and the check of proofs."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    AircraftOptions,
    GroundRiskOptions,
    MapOptions,
    OutputOptions,
    RasterOptions,
    ScenarioArg,
    ZoneOptions,
    map_changes,
    open_map,
    option,
)

if TYPE_CHECKING:
    from cgla_graph.certificate.corridor import Corridor
    from cgla_graph.comparisons.study.runner import Run
    from cgla_graph.scenarios.scenario import Scenario

#: Numbers that are computed for a file, at most: some minutes (`check_proof.MOST_WORK`, which is imported late).
MOST_WORK = 1e10


def certify(
    scenario: ScenarioArg,
    output: OutputOptions,
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions,
    ground: GroundRiskOptions,
    path: Annotated[
        Path | None, option("--path FILE", "a path, as plan --out or --export writes it (default: hybrid's)")
    ] = None,
    tolerance: Annotated[float, option("--tolerance R", "wanted gap")] = 0.001,
    max_cells: Annotated[int, option("--max-cells N", "cells of a grid, at most; about 300 bytes each")] = 2_500_000,
    within: Annotated[
        str | None, option("--within P%", "polygons that contain every path within so much of the best possible")
    ] = None,
    write: Annotated[
        Path | None, option("--write FILE", "write the proof, for cgla verify and other checkers", "--proof")
    ] = None,
) -> None:
    """
    Prove how far a path is from the best possible.

    Prints a bracket of the least cost of any path, for each grid until it is tight; with --out, writes it and a
    picture (NAME-SOLVER-certificate.*). With --path, the path may be that of any planner. With --within 1%, also the
    corridor of all paths that cost at most 1 % more than the best possible, and the ways through it
    (NAME-SOLVER-corridor.*).
    """
    from cgla_graph.certificate.corridor import MOST_CELLS
    from cgla_graph.comparisons.cli import ground as on_ground
    from cgla_graph.comparisons.study.proofs import check_provable, proof_of_run, read_proof
    from cgla_graph.comparisons.study.rows import plan_document
    from cgla_graph.comparisons.tables.certificate import grid_rows, proof_of

    write = read_proof("--write", write, {})
    k = on_ground.price_of_risk(maps.k, ground)
    _, opened = on_ground.asked_of(open_map("certify", scenario, maps, zones, raster, aircraft, k=k), ground)
    check_provable("--write", write, opened.problem.field, opened.problem.start, opened.problem.goal)
    kinds, folder = output.pictures("png", "svg"), output.folder()
    zoned = zones.report([opened], as_json=output.as_json)
    delta = None if within is None else share_of(within)
    with console.running_solvers([opened.problem.model]):
        run = certified(opened, path, tolerance=tolerance, max_cells=max_cells)
        corridor = None if delta is None else proof_of(run).corridor(delta, max_cells=min(max_cells, MOST_CELLS))
    proof = proof_of(run)
    people = on_ground.exposed(run, ground)
    written = _written(folder, run, kinds) if folder else []
    if folder and corridor is not None:
        written += _written_corridor(folder, run, corridor, kinds)
    in_file = None if write is None else proof_of_run(write, run, tolerance)
    if output.as_json:
        below = {} if people is None else {"ground": people.document()}
        files = [str(file) for file in [*written, *(() if in_file is None else in_file.files)]]
        below |= {} if in_file is None else {"proof_file": in_file.document()}
        below |= {} if corridor is None else {"corridor": corridor.document()}
        console.out_json({**plan_document(run), "grids": grid_rows(proof), "files": files, **below, **zoned})
    else:
        _print(run, {} if people is None else people.lines())
        if corridor is not None:
            _print_corridor(run, corridor)
        console.out_lines({} if in_file is None else in_file.lines())
        console.out_files([*written, *(() if in_file is None else in_file.files)])
    is_missing = not math.isfinite(proof.upper_bound) or math.isnan(proof.lower_bound)
    if is_missing or (in_file is not None and in_file.found is None):
        raise typer.Exit(console.MISSING)


def certified(
    scenario: "Scenario", file: Path | None = None, *, tolerance: float = 0.001, max_cells: int = 2_500_000
) -> "Run":
    """
    Bound the path of a file, or of the `hybrid` solver, by `cgla_graph.lower_bound`.

    Raises
    ------
    CglaError
        If a setting is out of range, or the file is missing, malformed, or has no feasible path from start to goal.
    """
    from cgla_graph._validate import positive_number
    from cgla_graph.certificate.subsolution import FIRST_CELLS
    from cgla_graph.comparisons.study.entrant import Entrant
    from cgla_graph.comparisons.study.runner import Run
    from cgla_graph.errors import CglaError, ScenarioError
    from cgla_graph.model.solution import Solution, Status
    from cgla_graph.scenarios.path_reading import read_path
    from cgla_graph.solvers.solving import lower_bound, solve

    positive_number("--tolerance", tolerance)
    if max_cells < FIRST_CELLS**2:
        msg = f"--max-cells is {max_cells}; give at least {FIRST_CELLS**2}, the number of cells of the first grid"
        raise CglaError(msg)
    problem = scenario.problem
    if file is None:
        solution = solve(problem, "hybrid", **Entrant.parse("hybrid").settings_on(scenario))
    else:
        path = read_path(file, problem)
        solution = problem.judge(Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost))
        if not solution.status.has_path:
            msg = f"{file}: the path is not feasible: {solution.message}; give a feasible one"
            raise ScenarioError(msg)
    held = solution.path if solution.status.has_path else None
    proof = lower_bound(problem, tolerance, path=held, max_cells=max_cells)
    # this proof replaces the solver's own
    bounded = dataclasses.replace(solution, lower_bound=proof.lower_bound, certificate_seconds=proof.seconds)
    name = "hybrid" if file is None else file.name
    return Run(scenario, name, None, exact=False, solution=bounded, certificate=proof)


def share_of(text: str, name: str = "--within") -> float:
    """
    Read a part of one: ``1%``, ``1 %`` or ``0.01``.

    Raises
    ------
    CglaError
        If it is something else, or above 1 without a percent sign: 5 may mean 5 % or 500 %.

    Examples
    --------
    >>> share_of("1%"), share_of("0.01"), share_of("0")
    (0.01, 0.01, 0.0)
    """
    from cgla_graph.errors import CglaError

    number = text.strip().removesuffix("%")
    in_percent = number != text.strip()
    try:
        share = float(number) / (100.0 if in_percent else 1.0)
    except ValueError:
        share = math.nan
    if not 0.0 <= share < math.inf:
        msg = f"{name} is {text!r}; give a percentage such as 1%, or a part such as 0.01"
        raise CglaError(msg)
    if share > 1.0 and not in_percent:
        msg = f"{name} is {text!r}, which may be {share:g} % or {100.0 * share:g} %; write it with a percent sign"
        raise CglaError(msg)
    return share


def _print_corridor(run: "Run", corridor: "Corridor") -> None:
    """Print the size of a corridor, and a table of its ways."""
    from cgla_graph._text import at_most, figure, percent, rounded_down
    from cgla_graph.comparisons.tables.fitted_table import FittedTable

    unit = " m" if run.on_map.projection else ""
    share = "none of the map" if corridor.outer.is_empty else f"{at_most(corridor.share)} of the map"
    part = corridor.inner.area / (corridor.outer.area or math.nan)
    certain = f"; paths certainly within it pass {100.0 * part:.0f} % of that"
    console.out_lines({
        "corridor": f"every path within {100.0 * corridor.delta:g} % of the best possible stays in {share}"
        + (certain if corridor.shown else ""),
        "settled": corridor.message,
        "ways": corridor.ways_text(),
    })  # fmt: skip
    ways = (*corridor.ways.known, *corridor.ways.undecided)
    if len(ways) > 1:
        columns = {
            "way": lambda way: str(ways.index(way) + 1),
            f"cost{unit and ' in m'}": lambda way: figure(way.cost, 7),
            "than the best": lambda way: percent(way.cost / corridor.upper_bound - 1.0),
            "at least": lambda way: rounded_down(way.lower_bound, 7),
            "passes": lambda way: way.passes,
        }
        notes = ("passes: on which side of each hole of the corridor, above is at greater y",)
        console.out_table(FittedTable.of("", ways, {}, columns, ("at least",), notes))


def _written_corridor(folder: Path, run: "Run", corridor: "Corridor", formats: Sequence[str]) -> list[Path]:
    """Write ``NAME-SOLVER-corridor.geojson``, ``.kml`` on a map in degrees, ``.csv`` with the ways, and the picture."""
    from cgla_graph.certificate.corridor_files import save_corridor
    from cgla_graph.comparisons import files
    from cgla_graph.plots import pictures
    from cgla_graph.plots.corridor import corridor_figure
    from cgla_graph.plots.scene import TitledProblem

    stem = files.stem_of(folder, run.on_map, run.solver.removesuffix(".csv"), "corridor")
    endings = (".geojson", ".csv", *((".kml",) if corridor.problem.projection else ()))
    written = [save_corridor(corridor, stem.with_name(stem.name + one), run.on_map.name) for one in endings]
    return [*written, *pictures.save_all(corridor_figure(TitledProblem.of(run.on_map), corridor), stem, formats)]


def _print(run: "Run", more: Mapping[str, str]) -> None:
    """Print the path, a table of the grids, the proof, and `more` lines."""
    from cgla_graph._text import duration, figure
    from cgla_graph.certificate.verdict import verdict
    from cgla_graph.comparisons.tables.certificate import certificate_table, proof_of
    from cgla_graph.model.earth import distortion_note
    from cgla_graph.people.units import risk_text

    scenario, solution, proof = run.on_map, run.solution, proof_of(run)
    unit = " m" if scenario.projection else ""
    numbers = f"cost {figure(solution.cost, 9)}{unit}, length {figure(solution.length, 9)}{unit}, "
    risk = risk_text(solution.risk, scenario.problem.field, 6)
    numbers += f"risk {risk}, {len(solution.path)} waypoints"
    none = f"{solution.status.label}: {solution.message or solution.status.value}"
    console.out_lines({
        "scenario": f"{scenario.full_title} (k = {scenario.problem.k:g})",
        "path": f"{run.solver}: {numbers if solution.status.has_path else none}",
    })  # fmt: skip
    if proof.grids:
        console.out_table(certificate_table(run))
    remedy = "; --max-cells N allows more" if "allowed" in proof.message else ""
    console.out_lines({
        "proven": verdict(proof, with_path=solution.status.has_path, unit=unit),
        "flat map": distortion_note(scenario.projection, [solution.path]),
        **more,
        "ended": f"{proof.message}{remedy} ({duration(proof.seconds)})",
    })  # fmt: skip


def _written(folder: Path, run: "Run", formats: Sequence[str]) -> list[Path]:
    """Write ``NAME-SOLVER-certificate.csv``, one row per grid, and the picture."""
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.plots.runs import certificate_of_run
    from cgla_graph.comparisons.tables.certificate import COLUMNS, grid_rows, proof_of
    from cgla_graph.plots import pictures

    stem = files.stem_of(folder, run.on_map, run.solver.removesuffix(".csv"), "certificate")
    table = files.csv_text(grid_rows(proof_of(run)), COLUMNS)
    written = [files.write_text(stem.with_name(f"{stem.name}.csv"), table)]
    return [*written, *pictures.save_all(certificate_of_run(run), stem, formats)]


def verify(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="proofs that --write or --proof of a command has written")
    ],
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions,
    ground: GroundRiskOptions,
    of_map: Annotated[
        list[str] | None, option("--map MAP", "the map that the proof has to be about; options of the map change it")
    ] = None,
    most_work: Annotated[
        float, option("--most-work N", "refuse files that ask for more numbers to be computed")
    ] = MOST_WORK,
    as_json: Annotated[bool, option("--json", "one JSON document")] = False,
) -> None:
    """
    Check proofs: no path costs less than the bound, and the path of the file no more than its own.

    The check needs nothing but the file. Exit code 1 if one of the files does not prove what it claims.
    """
    from cgla_graph.certificate.proof_file import verify_proof
    from cgla_graph.comparisons.cli import ground as on_ground
    from cgla_graph.comparisons.study.proofs import ProofLine
    from cgla_graph.errors import CglaError, ProblemError

    asked = [f"--{name.replace('_', '-')}" for name, value in vars(ground).items() if value is not None]
    changes = [*map_changes(maps, zones, raster, aircraft).given, *asked]
    changes += ["--zones-list"] if zones.zones_list else []
    if changes and not of_map:
        msg = f"{changes[0]} is about a map; give it (--map MAP)"
        raise CglaError(msg)
    problem = None
    if of_map:
        k = on_ground.price_of_risk(maps.k, ground)
        _, opened = on_ground.asked_of(open_map("verify", of_map, maps, zones, raster, aircraft, k=k), ground)
        problem = opened.problem
        if zones.zones_list is not None:
            zones.report([opened], as_json=True)
    results: list[ProofLine] = []
    for file in files:
        try:
            results.append(ProofLine(file, verify_proof(file, problem, most_work=most_work)))
        except ProblemError as error:
            results.append(ProofLine(file, fault=str(error)))
        if not as_json:
            console.out_lines({"verified" if results[-1].found else "refused": results[-1].text()})
    if as_json:
        console.out_json({"proofs": [one.document() for one in results]})
    if not all(one.found for one in results):
        raise typer.Exit(console.MISSING)

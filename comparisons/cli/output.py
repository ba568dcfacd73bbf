"""What the command `plan` prints and writes: one path, and what is proven of it."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.numbers import duration, figure, json_number, percent, rounded_down
from cgla_graph.comparisons.study.rows import bound_note, certificate_document, row
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.earth import degrees_of, distortion_note
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.scenario import Scenario


def write_plan(folder: Path, run: Run, formats: Sequence[str] = ("png",)) -> list[Path]:
    """Write one path: waypoints, GeoJSON on lon/lat maps, a picture in some formats (errors as `write_rows`)."""
    from cgla_graph.comparisons.plots.runs import map_of_runs
    from cgla_graph.plots import pictures

    stem = stem_of(folder, run.scenario, run.solver)
    written = [files.write_text(stem.with_name(stem.name + ".csv"), files.path_csv(run.scenario, run.solution))]
    if run.scenario.projection is not None:
        geojson = files.path_geojson(run.scenario, run.solution)
        written.append(files.write_text(stem.with_name(stem.name + ".geojson"), geojson))
    return [*written, *pictures.save_all(map_of_runs([run]), stem, formats)]


def stem_of(folder: Path, scenario: Scenario, solver: str, what: str = "") -> Path:
    """
    Return what the files of a command begin with: no two commands, maps or solvers share it.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> stem_of(Path("out"), load_scenario("paper"), "prm-star:milestones=100+refine", "pareto").name
    'paper-prm-star-milestones-100-refine-pareto'
    """
    return folder / files.file_stem("-".join(filter(None, (scenario.name, solver, what))), set())


def print_plan(run: Run, more: Mapping[str, str] | None = None) -> None:
    """Print a path's numbers, a line each, and `more` lines of that kind."""
    scenario, solution = run.scenario, run.solution
    unit = " m" if scenario.projection else ""
    note = bound_note([run], unit)
    clearance = "no no-fly area" if scenario.problem.no_fly is None else figure(solution.clearance, 6) + unit
    if scenario.problem.clearance > 0.0:
        clearance += f", of at least {scenario.problem.clearance:g}{unit} asked for"
    lines = {
        "scenario": scenario.full_title,
        "solver": run.solver,
        "status": f"{solution.status.label}: {solution.status.value}"
        if solution.status is not Status.OPTIMAL
        else "optimal on its lattice: no path over its points costs less",
        "cost": figure(solution.cost, 9) + unit,
        "bound": rounded_down(solution.lower_bound, 9) + unit if math.isfinite(solution.lower_bound) else "",
        "gap": f"{percent(solution.gap)}: {note}" if note and solution.status.has_path else "",
        "length": figure(solution.length, 9) + unit,
        "risk": figure(solution.risk, 6),
        "k": f"{scenario.problem.k:g}",
        "clearance": clearance,
        "flat map": distortion_note(scenario.projection, [solution.path]) if solution.status.has_path else "",
        **(more or {}),
        "waypoints": str(len(solution.path)),
        "time": f"{duration(solution.seconds)}, and {duration(solution.build_seconds)} to weigh the graph",
        "remark": solution.message,
    }
    console.out_lines(lines)


def plan_document(run: Run) -> dict[str, Any]:
    """Return one path as JSON: its row, its waypoints (in degrees too, if the map has them), and what is proven."""
    projection, path = run.scenario.projection, run.solution.path
    in_degrees = {} if projection is None or not len(path) else {"path_lonlat": degrees_of(path, projection).tolist()}
    return {
        **row(run),
        "path": path.tolist(),
        **in_degrees,
        "certificate": certificate_document(run),
        "stretch": json_number(run.scenario.problem.stretch(run.solution.path)),
    }

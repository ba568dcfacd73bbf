"""What the commands `compare` and `plan` print, and the files that they write."""

import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.leaderboard.performance import PERFORMANCE_COLUMNS, performances
from cgla_graph.comparisons.numbers import duration, figure, json_number, percent, rounded_down
from cgla_graph.comparisons.results.ompl_database import ompl_database
from cgla_graph.comparisons.study import earth
from cgla_graph.comparisons.study.entrant import Entrant, budget_note
from cgla_graph.comparisons.study.flight_run import COLUMNS as FLIGHT_COLUMNS
from cgla_graph.comparisons.study.rows import COLUMNS, by_scenario, row, rows_of, trace_row
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.store import OMPL_FILE, Stored
from cgla_graph.comparisons.tables.tables import bound_note, comparison_table, performance_table


def print_comparison(runs: Sequence[Run], entrants: Sequence[Entrant]) -> None:
    """Print the tables of each scenario: how good, and how soon where there is more than one answer to that."""
    note = budget_note(entrants)
    for group in by_scenario(runs):
        scenario = group[0].scenario
        flat = earth.distortion_note(scenario, [run.solution.path for run in group])
        console.out_table(comparison_table(scenario, group, notes=[line for line in (flat, note) if line]))
        if any(run.seed is not None or run.solution.trace for run in group):
            console.out_table(performance_table(performances(group)))


def write_study(stored: Stored) -> list[Path]:
    """
    Write beside the runs of a study what is made of them: the report; rows (JSON Lines, CSV), what they amount to, the
    traces that there are and OMPL's database of runs on maps; and rows of flights.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """  # noqa: D205 - a list is no one line
    from cgla_graph.comparisons.report.page import write_report  # noqa: PLC0415 - loads plotly

    folder, runs = stored.folder, stored.runs
    written = [write_report(stored, folder / "report.html")]
    if stored.scenarios:
        table = rows_of(runs)
        found = [one.document() for group in by_scenario(runs) for one in performances(group)]
        written += [
            files.write_bytes(folder / OMPL_FILE, ompl_database(stored, runs)),
            *_write_rows(folder, "rows", table, COLUMNS),
            files.write_text(folder / "summary.csv", files.csv_text(found, PERFORMANCE_COLUMNS)),
        ]
        traces = [trace_row(run) for run in runs if run.solution.trace]
        if traces:
            written.append(files.write_text(folder / "traces.jsonl", files.json_lines(traces)))
    if stored.missions:
        written += _write_rows(folder, "flights", [flight.row() for flight in stored.flights], FLIGHT_COLUMNS)
    return written


def _write_rows(folder: Path, name: str, table: Sequence[dict[str, Any]], columns: Sequence[str]) -> list[Path]:
    return [
        files.write_text(folder / f"{name}.jsonl", files.json_lines(table)),
        files.write_text(folder / f"{name}.csv", files.csv_text(table, columns)),
    ]


def write_all_pictures(folder: Path, runs: Sequence[Run], most: int, named: Collection[str] = ()) -> list[Path]:
    """Write the pictures of at most so many scenarios; named solvers are in colour (errors as `write_study`)."""
    taken: set[str] = set()
    groups = by_scenario(runs)
    written: list[Path] = []
    for group in groups[:most]:
        written += _write_pictures(folder / files.file_stem(group[0].scenario.name, taken), group, named)
    if 0 < most < len(groups):
        console.say(f"pictures of the first {most} of {len(groups)} scenarios; --pictures N draws more")
    return written


def _write_pictures(stem: Path, runs: Sequence[Run], named: Collection[str]) -> list[Path]:
    from cgla_graph.comparisons.plots import pictures  # noqa: PLC0415 - matplotlib only where something is drawn

    scenario = runs[0].scenario
    drawn = pictures.map_figure(scenario, runs, named)
    written = []
    for suffix in (".png", ".svg"):
        written.append(stem.with_name(stem.name + suffix))
        pictures.save(drawn, written[-1])
    trace = pictures.trace_figure(scenario, runs, named)
    if trace is not None:
        written.append(stem.with_name(stem.name + "-cost.png"))
        pictures.save(trace, written[-1])
    return written


def write_plan(folder: Path, run: Run) -> list[Path]:
    """Write one path: waypoints, GeoJSON on lon/lat maps, a picture (errors as `write_rows`)."""
    from cgla_graph.comparisons.plots import pictures  # noqa: PLC0415 - matplotlib only where something is drawn

    stem = folder / files.file_stem(f"{run.scenario.name}-{run.solution.solver}", set())
    written = [files.write_text(stem.with_name(stem.name + ".csv"), files.path_csv(run.scenario, run.solution))]
    if run.scenario.projection is not None:
        geojson = files.path_geojson(run.scenario, run.solution)
        written.append(files.write_text(stem.with_name(stem.name + ".geojson"), geojson))
    written.append(stem.with_name(stem.name + ".png"))
    pictures.save(pictures.map_figure(run.scenario, [run]), written[-1])
    return written


def print_plan(run: Run) -> None:
    """Print a path's numbers, a line each."""
    scenario, solution = run.scenario, run.solution
    unit = " m" if scenario.projection else ""
    gap = percent(solution.gap) if solution.status.has_path else "-"
    note = bound_note([run], unit)
    lines = {
        "scenario": scenario.full_title,
        "solver": run.solver,
        "status": f"{solution.status.label}: {solution.status.value}",
        "cost": figure(solution.cost, 9) + unit,
        "bound": rounded_down(solution.lower_bound, 9) + unit if math.isfinite(solution.lower_bound) else "",
        "gap": f"{gap}: {note}" if note else "",
        "length": figure(solution.length, 9) + unit,
        "risk": figure(solution.risk, 6),
        "clearance": "no no-fly area" if scenario.problem.no_fly is None else figure(solution.clearance, 6) + unit,
        "flat map": earth.distortion_note(scenario, [solution.path]) if solution.status.has_path else "",
        "waypoints": str(len(solution.path)),
        "time": f"{duration(solution.seconds)}, and {duration(solution.build_seconds)} to weigh the graph",
        "remark": solution.message,
    }
    print_lines(lines)


def print_lines(lines: Mapping[str, str]) -> None:
    """Print what there is to say under each key, a line each."""
    for key, text in lines.items():
        if text:
            console.out(f"{key:10} {text}\n")


def plan_document(run: Run) -> dict[str, Any]:
    """Return one path as JSON: its row, its waypoints, and what is proven."""
    return {
        **row(run),
        "path": run.solution.path.tolist(),
        "certificate": certificate_document(run),
        "stretch": json_number(run.scenario.stretch(run.solution.path)),
    }


def certificate_document(run: Run) -> dict[str, Any] | None:
    """Return what is proven of a run's scenario as JSON, None where that was not asked for."""
    proof = run.certificate
    if proof is None:
        return None
    return {
        "scenario": run.scenario.name,
        "lower_bound": json_number(proof.lower_bound),
        "upper_bound": json_number(proof.upper_bound),
        "gap": json_number(proof.gap),
        "tolerance": proof.tolerance,
        "reached": bool(proof.reached),
        "spacing": json_number(proof.spacing),
        "cells": int(proof.cells),
        "seconds": json_number(proof.seconds),
        "message": str(proof.message),
    }

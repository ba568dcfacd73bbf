"""What the command `plan` prints and writes: one path, and what is proven of it."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.numbers import duration, figure, json_number, percent, rounded_down
from cgla_graph.comparisons.study import earth
from cgla_graph.comparisons.study.rows import row
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.bound_note import bound_note


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

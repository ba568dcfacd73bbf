"""The command `results`: what a study found, what changed since another one, one row once more, and exports."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cgla_graph._text import counted, listed, plain_json
from cgla_graph.comparisons import console
from cgla_graph.comparisons.leaderboard.leaderboard import LeaderboardRow, failed, leaderboard_of
from cgla_graph.comparisons.leaderboard.regression import Regression, regression
from cgla_graph.comparisons.results import exports
from cgla_graph.comparisons.results.filters import Filters
from cgla_graph.comparisons.results.rerun import Rerun, rerun_table
from cgla_graph.comparisons.results.rerun import rerun as run_again
from cgla_graph.comparisons.results.tables import (
    failure_lines,
    leaderboard_table,
    overview_lines,
    regression_table,
    runs_table,
    solver_table,
    summary_line,
)
from cgla_graph.comparisons.study.flight_run import FlightRun
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.sampling import independence_note
from cgla_graph.comparisons.study.store import Stored, load
from cgla_graph.comparisons.tables.flights import print_flights
from cgla_graph.comparisons.tables.overview import overview
from cgla_graph.errors import CglaError

#: Tables of single solvers are shown up to so many lines, unless solvers are asked for by name.
MOST_LINES = 120


@dataclass(frozen=True, eq=False)
class Results:
    """
    What `cgla results` has to say.

    Attributes
    ----------
    stored
        The study.
    runs, flights
        Those that pass the filters.
    filters
        The runs that were left out.
    leaderboard
        None where the filters leave runs out by how they ended: the rest says nothing of the solvers.
    regression, old
        The changes against another study, and that study; None unless asked for.
    rerun
        A row run again, where that was asked for.
    lists_runs
        Whether single runs are listed.
    written
        Files.
    """

    stored: Stored
    runs: Sequence[Run]
    filters: Filters = field(default_factory=Filters)
    leaderboard: Sequence[LeaderboardRow] | None = None
    regression: Regression | None = None
    old: Stored | None = None
    rerun: Rerun | None = None
    lists_runs: bool = False
    written: Sequence[Path] = ()
    flights: Sequence[FlightRun] = ()


def look_up(
    folder: Path,
    *,
    scenario: str | None = None,
    solver: str | None = None,
    status: str | None = None,
    seed: int | None = None,
    runs: bool = False,
    against: Path | None = None,
    rerun: int | None = None,
    export: Sequence[Path] = (),
) -> Results:
    """
    Do what the options of `cgla results` say, and print nothing.

    Parameters
    ----------
    folder
        Of the study.
    scenario, solver, status, seed
        Conditions on runs (see `Filters.read`).
    runs
        Whether to list single runs.
    against
        Folder of an older study to compare with.
    rerun
        Number of a run to run again.
    export
        Files to write (see `exports.export`).

    Raises
    ------
    CglaError
        If options contradict each other, a name is not in the study, a study cannot be read, or a file cannot be
        written.
    """
    filters = Filters.read(scenario, solver, status, seed)
    _check(filters, runs=runs, against=against, rerun=rerun, export=export)
    exports.check_targets(export, folder)
    stored = load(folder)
    if rerun is not None:
        return Results(stored, [], rerun=run_again(stored, rerun))
    old = None if against is None else load(against)
    studies = [stored] if old is None else [stored, old]
    kept = filters.of(stored.runs, *_known(studies))
    flights = filters.of_flights(stored.flights)
    found = Results(stored, kept, filters, lists_runs=runs or filters.statuses is not None, flights=flights)
    if old is not None:
        # a name that only one of both has is no fault: what does not pair is named
        changes = regression(filters.of(old.runs, *_known(studies)), kept)
        found = dataclasses.replace(found, old=old, regression=changes)
    elif filters.statuses is None:
        found = dataclasses.replace(found, leaderboard=leaderboard_of(kept))
    return dataclasses.replace(found, written=[exports.export(target, stored, kept) for target in export])


def _known(studies: Sequence[Stored]) -> tuple[list[str], list[str], list[int | None]]:
    """List the names of scenarios, missions and solvers of studies, and their seeds."""
    scenarios = dict.fromkeys(one.name for study in studies for one in study.scenarios)
    missions = dict.fromkeys(one.name for study in studies for one in study.missions)
    solvers = dict.fromkeys(solver for study in studies for solver in study.solvers)
    seeds = [one.seed for study in studies for one in study.runs] + [
        one.seed for study in studies for one in study.flights
    ]
    return [*scenarios, *missions], list(solvers), seeds


def _check(filters: Filters, *, runs: bool, against: Path | None, rerun: int | None, export: Sequence[Path]) -> None:
    """Refuse options that contradict each other."""
    if rerun is not None and (filters.is_on or runs or against is not None or export):
        msg = "--rerun takes one row and no other option but --json; leave the others out"
        raise CglaError(msg)
    if filters.statuses is None:
        return
    needs_all = "--against" if against is not None else next((f"--export {one}" for one in export if _is_tex(one)), "")
    if needs_all:
        msg = f"{needs_all} compares solvers by all their runs, those that failed too; leave out --status"
        raise CglaError(msg)


def _is_tex(target: Path) -> bool:
    return target.suffix.lower() == ".tex"


def print_results(found: Results) -> None:
    """Print tables and lines on standard output (errors as `console.out`)."""
    if found.rerun is not None:
        console.out_table(rerun_table(found.rerun))
        return
    for line in _heading(found):
        console.out(f"{line}\n")
    if found.regression is not None:
        _print_regression(found, found.regression)
    elif not found.stored.n_cells and found.stored.missions:
        # it only flies missions
        pass
    elif found.leaderboard is None:
        console.out("no leaderboard: of runs picked by how they ended, nothing can be said of solvers\n")
    else:
        _print_leaderboard(found, found.leaderboard)
    if found.lists_runs and found.runs:
        console.out_table(runs_table(found.runs))
    if found.regression is None:
        _print_lines("failures", failure_lines(found.runs))
        print_flights(found.stored.missions, found.flights)
    for path in found.written:
        console.out(f"written: {path}\n")


def _heading(found: Results) -> list[str]:
    stored = found.stored
    state = "complete" if stored.is_complete else "not complete yet"
    counts = [(len(stored.runs), stored.n_cells, "runs"), (len(stored.flights), stored.n_flights, "flights")]
    done = ", ".join(f"{n:,} of {total:,} {what}" for n, total, what in counts if total) or "nothing to run"
    lines = [f"{stored.title or stored.folder}: {done}, {state}"]
    if stored.sessions:
        last = stored.sessions[-1]
        git = f", git {last.revision}" if last.git else ""
        lines.append(f"last session: {last.started}, cgla-graph {last.version}{git}, on {last.host}")
    if found.filters.is_on:
        lines.append(f"{found.filters.note()}: {counted(len(found.runs), 'run')}")
    return lines


def _print_leaderboard(found: Results, ranked: Sequence[LeaderboardRow]) -> None:
    if not ranked:
        console.out("no runs yet\n" if not found.filters.is_on else "no run is left\n")
        return
    by_name = found.filters.solvers is not None
    n_lines = len({(run.scenario.name, run.solver) for run in found.runs})
    print_leaderboard(found.runs, ranked)
    if by_name or n_lines <= MOST_LINES:
        console.out_table(solver_table(found.runs))
    else:
        console.out(f"{n_lines} lines, scenario by scenario, are not shown; --solver NAME shows those of one solver\n")


def print_leaderboard(runs: Sequence[Run], ranked: Sequence[LeaderboardRow]) -> None:
    """Print who wins, by how much, how sure that is, and where each solver fails (errors as `console.out`)."""
    console.out_table(leaderboard_table(ranked))
    scenarios = {run.scenario.name: run.scenario for run in runs}
    said = overview(ranked, len(scenarios), independence_note(list(scenarios.values())))
    unable = sorted({run.solver for run in runs} - {row.solver for row in ranked})
    left_out = [f"not ranked, as they could not run: {listed(unable)}"] if unable else []
    _print_lines("", [*left_out, *overview_lines(said)])


def _print_regression(found: Results, changes: Regression) -> None:
    old = found.old.folder if found.old is not None else ""
    console.out_table(regression_table(f"{found.stored.folder} (new) against {old} (old)", changes))
    _print_lines("", [summary_line(changes)] if changes.changes else [])


def _print_lines(title: str, lines: Sequence[str]) -> None:
    if lines:
        console.out("".join(f"{line}\n" for line in ([f"{title}:"] if title else []) + [*lines]))


def document(found: Results) -> dict[str, Any]:
    """
    Return the results as one JSON document.

    Numbers that JSON does not know are None: infinite ones (never, no end) and unknown ones.
    """
    stored = found.stored
    if found.rerun is not None:
        return found.rerun.document()
    return {
        "title": stored.title,
        "folder": str(stored.folder),
        "runs": len(stored.runs),
        "cells": stored.n_cells,
        "complete": stored.is_complete,
        "sessions": plain_json(stored.sessions),
        "filters": plain_json(found.filters),
        "kept": len(found.runs),
        "standings": None if found.leaderboard is None else plain_json(found.leaderboard),
        "against": None if found.old is None else str(found.old.folder),
        "regression": None if found.regression is None else plain_json(found.regression),
        "failures": exports.run_rows(failed(found.runs), stored.runs),
        "rows": exports.run_rows(found.runs, stored.runs) if found.lists_runs else None,
        "flights": [flight.row() for flight in found.flights],
        "files": [str(path) for path in found.written],
    }

"""What `cgla results` prints of a study: standings, a table a solver, single runs, and failures."""

import math
from collections.abc import Iterator, Sequence

from cgla_graph.comparisons.failures import FailureGroup, failure_groups
from cgla_graph.comparisons.fitted_table import FittedTable
from cgla_graph.comparisons.overview import Overview
from cgla_graph.comparisons.rows import Summary, by_scenario, summaries
from cgla_graph.comparisons.runner import Run
from cgla_graph.comparisons.standing_columns import SPARE, standing_cells, standing_heads, standing_notes
from cgla_graph.comparisons.standings import Standing
from cgla_graph.comparisons.tables import duration, figure, percent
from cgla_graph.comparisons.words import DASH, counted, listed
from cgla_graph.solution import Status

#: So many messages of a solver are shown for each way to fail.
_MOST_MESSAGES = 3

_SOLVER_HEADS = ("runs", "cost", "gap", "length", "risk", "clearance", "time", "build", "seed spread")
_SOLVER_SPARE = ("clearance", "build", "seed spread", "risk", "length", "runs", "time", "gap")
_RUN_HEADS = ("seed", "cost", "gap", "length", "risk", "clearance", "time", "build", "evaluations", "memory")
_RUN_SPARE = ("memory", "clearance", "evaluations", "build", "risk", "length", "seed", "time", "gap", "scenario")


def overview_lines(said: Overview) -> list[str]:
    """Say in a few lines who wins, by how much, how sure that is, and where each solver fails, as the report does."""
    answers = [line for one in said.answers for line in (f"{one.question} {one.figure}", f"    {one.words}")]
    return [line for line in (said.headline, *answers, said.caution) if line]


def standings_table(title: str, found: Sequence[Standing]) -> FittedTable:
    """Show who wins: a line a solver, the best first."""
    heads = standing_heads()
    rows: list[Sequence[str]] = [standing_cells(one) for one in found]
    return FittedTable(title, heads[:1], heads[1:], SPARE, standing_notes(found), rows)


def solver_tables(runs: Sequence[Run]) -> Iterator[FittedTable]:
    """Show each solver in a table of its own: a line a scenario."""
    tables: dict[str, list[tuple[str, int, Summary]]] = {}
    for group in by_scenario(runs):
        counts: dict[str, int] = {}
        for run in group:
            counts[run.solver] = counts.get(run.solver, 0) + 1
        for summary in summaries(group):
            lines = tables.setdefault(summary.solver, [])
            lines.append((group[0].scenario.name, counts[summary.solver], summary))
    for solver in dict.fromkeys(run.solver for run in runs):
        rows: list[Sequence[str]] = [_scenario_cells(*line) for line in tables[solver]]
        yield FittedTable(solver, ("scenario", "status"), _SOLVER_HEADS, _SOLVER_SPARE, rows=rows)


def _scenario_cells(scenario: str, n_runs: int, summary: Summary) -> list[str]:
    return [
        scenario,
        summary.status,
        f"{summary.n_paths}/{n_runs}",
        figure(summary.cost, 6),
        percent(summary.gap),
        figure(summary.length, 6),
        figure(summary.risk, 4),
        figure(summary.clearance, 3),
        duration(summary.seconds),
        duration(summary.build_seconds) if summary.build_seconds else "-",
        percent(summary.spread),
    ]


def runs_table(title: str, runs: Sequence[Run]) -> FittedTable:
    """Show single runs: a line each, with the number that ``--rerun`` takes."""
    rows: list[Sequence[str]] = [_run_cells(run) for run in runs]
    left = ("number", "scenario", "solver", "status")
    notes = ["number: cgla results DIR --rerun NUMBER runs it again"]
    return FittedTable(title, left, _RUN_HEADS, _RUN_SPARE, notes, rows)


def _run_cells(run: Run) -> list[str]:
    solution = run.solution
    return [
        "-" if run.number is None else str(run.number),
        run.scenario.name,
        run.solver,
        solution.status.label,
        "-" if run.seed is None else str(run.seed),
        figure(solution.cost, 6),
        percent(solution.gap) if solution.status.is_path else "-",
        figure(solution.length, 6),
        figure(solution.risk, 4),
        figure(solution.clearance, 3),
        _time(solution.seconds),
        _time(solution.build_seconds) if solution.build_seconds else "-",
        f"{solution.evaluations:,.0f}" if math.isfinite(solution.evaluations) else "-",
        f"{figure(run.megabytes, 3)} MiB" if math.isfinite(run.megabytes) else "-",
    ]


def failure_lines(runs: Sequence[Run]) -> list[str]:
    """Name the runs without a path, grouped by solver and status; messages that differ by numbers only stand once."""
    ways: dict[tuple[str, Status], list[FailureGroup]] = {}
    for group in failure_groups(runs):
        ways.setdefault((group.solver, group.status), []).append(group)
    lines = []
    for (solver, status), groups in ways.items():
        lines += [_failure_line(group) for group in groups[:_MOST_MESSAGES]]
        rest = sum(len(group.runs) for group in groups[_MOST_MESSAGES:])
        if rest:
            lines.append(f"{solver}: {status.label} in {rest:,} more, with other messages (--json has them all)")
    return lines


def _failure_line(group: FailureGroup) -> str:
    number = group.runs[0].number
    again = "" if number is None else f" (--rerun {number})"
    where = f"{counted(len(group.runs), 'run')} on {listed(group.scenarios)}"
    return f"{group.solver}: {group.status.label} in {where}{again}{f': {group.message}' if group.message else ''}"


def _time(seconds: float) -> str:
    return duration(seconds) if math.isfinite(seconds) else DASH

"""What `cgla results` prints of a study: leaderboard, a table a solver, single runs, and failures."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cgla_graph.comparisons.leaderboard.failures import FailureGroup, failure_groups
from cgla_graph.comparisons.leaderboard.leaderboard import LeaderboardRow
from cgla_graph.comparisons.numbers import DASH, counted, duration, figure, listed, percent
from cgla_graph.comparisons.study.rows import SHOWN, Format, RunColumn, Summary, by_scenario, row, summaries
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.comparisons.tables.leaderboard_columns import (
    SPARE,
    leaderboard_cells,
    leaderboard_heads,
    leaderboard_notes,
)
from cgla_graph.comparisons.tables.overview import Overview
from cgla_graph.model.solution import Status

#: So many messages of a solver are shown for each way to fail.
_MOST_MESSAGES = 3

_SOLVER_HEADS = ("runs", "cost", "gap", "length", "risk", "clearance", "time", "build", "seed spread")
_SOLVER_SPARE = ("clearance", "build", "seed spread", "risk", "length", "runs", "time", "gap")
#: The columns of single runs that stand on the left.
_RUN_LEFT = ("number", "scenario", "solver", "status")
#: How the numbers of single runs are written, from the value and its significant digits.
_WRITE: Mapping[Format, Callable[[float, int], str]] = {
    "plain": lambda value, _: str(value),
    "count": lambda value, _: f"{value:,.0f}",
    "figure": figure,
    "percent": lambda value, _: percent(value),
    "time": lambda value, _: duration(value),
    "time-if-any": lambda value, _: duration(value) if value else DASH,
    "memory": lambda value, digits: f"{figure(value, digits)} MiB",
}


def overview_lines(said: Overview) -> list[str]:
    """Say in a few lines who wins, by how much, how sure that is, and where each solver fails, as the report does."""
    answers = [line for one in said.answers for line in (f"{one.question} {one.figure}", f"    {one.words}")]
    return [line for line in (said.headline, *answers, said.caution) if line]


def leaderboard_table(title: str, found: Sequence[LeaderboardRow]) -> FittedTable:
    """Show who wins: a line a solver, the best first."""
    heads = leaderboard_heads()
    rows: list[Sequence[str]] = [leaderboard_cells(one) for one in found]
    return FittedTable(title, heads[:1], heads[1:], SPARE, leaderboard_notes(found), rows)


def solver_table(runs: Sequence[Run]) -> FittedTable:
    """Show each solver on each scenario: a line each, those of one solver together."""
    lines: dict[str, list[Sequence[str]]] = {}
    for group in by_scenario(runs):
        counts: dict[str, int] = {}
        for run in group:
            counts[run.solver] = counts.get(run.solver, 0) + 1
        for summary in summaries(group):
            cells = _scenario_cells(group[0].scenario.name, counts[summary.solver], summary)
            lines.setdefault(summary.solver, []).append([summary.solver, *cells])
    rows = [line for solver in dict.fromkeys(run.solver for run in runs) for line in lines[solver]]
    words = ("solver", "scenario", "status")
    return FittedTable("scenario by scenario", words, _SOLVER_HEADS, _SOLVER_SPARE, rows=rows)


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
    left = [column for column in SHOWN if column.key in _RUN_LEFT]
    right = [column for column in SHOWN if column.key not in _RUN_LEFT and column.kind != "word"]
    shown = [*left, *right]
    spare = sorted((column for column in shown if column.spare is not None), key=lambda column: column.spare or 0)
    return FittedTable(
        title,
        [column.head for column in left],
        [column.head for column in right],
        [column.head for column in spare],
        ["number: cgla results DIR --rerun NUMBER runs it again"],
        [_run_cells(run, shown) for run in runs],
    )


def _run_cells(run: Run, columns: Sequence[RunColumn]) -> list[str]:
    values = zip(columns, row(run, columns=columns).values(), strict=True)
    return [_run_cell(column, value) for column, value in values]


def _run_cell(column: RunColumn, value: Any) -> str:  # noqa: ANN401 - what files hold of it
    if column.kind == "word":
        return str(value)
    return DASH if value is None else _WRITE[column.format](value, column.digits)


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

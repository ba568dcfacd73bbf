"""Tables of `cgla results`: leaderboard, a table a solver, single runs, and failures."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cgla_graph._text import DASH, counted, duration, figure, listed, percent
from cgla_graph.comparisons.leaderboard.leaderboard import FailureGroup, LeaderboardRow, failure_groups
from cgla_graph.comparisons.leaderboard.regression import SIGNIFICANT, Change, Regression, RunKey, Verdict
from cgla_graph.comparisons.numbers import estimate_cell, p_value, ratio
from cgla_graph.comparisons.study.rows import Format, RunColumn, by_scenario, row, shown, summaries
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.comparisons.tables.leaderboard_columns import (
    SPARE,
    leaderboard_cells,
    leaderboard_heads,
    leaderboard_notes,
)
from cgla_graph.comparisons.tables.overview import Overview
from cgla_graph.comparisons.tables.tables import SUMMARY_COLUMNS, measured_cells
from cgla_graph.model.solution import Status

#: So many messages of a solver are shown for each way to fail.
_MOST_MESSAGES = 3

_SOLVER_SPARE = ("clearance", "build", "seed spread", "risk", "length", "runs", "time", "gap")
#: The columns of single runs that stand on the left.
_RUN_LEFT = ("number", "scenario", "solver", "status")
#: Formats of numbers of single runs: functions of the value and its significant digits.
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


def leaderboard_table(found: Sequence[LeaderboardRow]) -> FittedTable:
    """Show who wins: a line a solver, the best first."""
    heads = leaderboard_heads(found)
    rows: list[Sequence[str]] = [leaderboard_cells(one) for one in found]
    return FittedTable("leaderboard", heads[:1], heads[1:], SPARE, leaderboard_notes(found), rows)


def solver_table(runs: Sequence[Run]) -> FittedTable:
    """Show each solver on each scenario: a line each, those of one solver together."""
    found = [(group[0].scenario.name, one) for group in by_scenario(runs) for one in summaries(group)]
    order = list(dict.fromkeys(run.solver for run in runs))
    heads = ("runs", "cost", "gap", "length", "risk", "clearance", "time", "build", "seed spread")
    words = ("solver", "scenario", "status")
    rows: list[Sequence[str]] = [
        [one.solver, scenario, one.status, *(SUMMARY_COLUMNS[head](one) for head in heads), *measured_cells(one)]
        for scenario, one in sorted(found, key=lambda named: order.index(named[1].solver))
    ]
    metrics = [one.head for one in found[0][1].measures] if found else []
    return FittedTable("scenario by scenario", words, (*heads, *metrics), _SOLVER_SPARE, rows=rows)


def runs_table(runs: Sequence[Run]) -> FittedTable:
    """Show single runs: a line each, with the number that ``--rerun`` takes."""
    columns = shown(runs)
    left = [column for column in columns if column.key in _RUN_LEFT]
    right = [column for column in columns if column.key not in _RUN_LEFT and column.kind != "word"]
    both = [*left, *right]
    spare = sorted((column for column in both if column.spare is not None), key=lambda column: column.spare or 0)
    return FittedTable(
        "runs",
        [column.head for column in left],
        [column.head for column in right],
        [column.head for column in spare],
        ["number: cgla results DIR --rerun NUMBER runs it again"],
        [
            [_run_cell(column, value) for column, value in zip(both, row(run, columns=both).values(), strict=True)]
            for run in runs
        ],
    )


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


_CHANGE_SPARE = (
    *("p time", "equal", "cheaper", "more expensive", "p paths", "found", "time ratio", "lost", "pairs", "p cost"),
)
_WORDS = {
    Verdict.IDENTICAL: "identical",
    Verdict.BETTER: "better",
    Verdict.WORSE: "worse",
    Verdict.SAME: "no difference shown",
}
_CHANGE_COLUMNS: Mapping[str, Callable[[Change], str]] = {
    "pairs": lambda change: str(change.n),
    "cost ratio": lambda change: estimate_cell(change.cost.ratio, ratio, least=0.0).lines,
    "p cost": lambda change: p_value(change.cost.p_holm),
    "cheaper": lambda change: str(change.cost.wins),
    "more expensive": lambda change: str(change.cost.losses),
    "equal": lambda change: str(change.cost.ties),
    "found": lambda change: str(change.cost.only_solver),
    "lost": lambda change: str(change.cost.only_reference),
    "p paths": lambda change: p_value(change.cost.p_success),
    "time ratio": lambda change: estimate_cell(change.seconds.ratio, ratio, least=0.0).lines,
    "p time": lambda change: p_value(change.seconds.p_holm),
}
_NOTES = (
    "cost ratio, time ratio: new over old, run by run (Hodges-Lehmann), with 95 % intervals; below 1 is better",
    "p cost, p time: Wilcoxon's signed ranks, after Holm; times of other or busier machines differ by themselves",
    "found, lost: runs with a path only in the new study, only in the old one; p paths: McNemar, exact, not adjusted",
)


def regression_table(title: str, found: Regression) -> FittedTable:
    """Show what changed: a line a solver, and below what could not be paired."""
    notes = [*(_NOTES if found.changes else ["no run is in both studies"]), *_unpaired_lines(found)]
    words = {"solver": lambda change: change.solver, "verdict": lambda change: _WORDS[change.verdict]}
    return FittedTable.of(title, found.changes, words, _CHANGE_COLUMNS, _CHANGE_SPARE, notes)


def _unpaired_lines(found: Regression) -> list[str]:
    """Name what could not be paired, and whose settings changed."""
    lines = []
    settings = [change.solver for change in found.changes if change.settings_differ]
    if settings:
        lines.append(f"run with other settings than before: {listed(settings)}")
    if found.changed_scenarios:
        lines.append(f"not paired, as the scenario is another one now: {listed(found.changed_scenarios)}")
    for which, keys in (("old", found.only_old), ("new", found.only_new)):
        if keys:
            where = f"{counted(len(keys), 'run')}: {_where(keys)}"
            lines.append(f"not paired, as only the {which} study has them: {where}")
    return lines


def _where(keys: Sequence[RunKey]) -> str:
    """Name the runs that have no like, whole solvers in one word."""
    scenarios: dict[str, dict[str, None]] = {}
    for key in keys:
        scenarios.setdefault(key.solver, {})[key.scenario] = None
    return listed([f"{solver} on {listed(list(names), 3)}" for solver, names in scenarios.items()])


def summary_line(found: Regression) -> str:
    """Say in one line how many solvers became better, worse, or neither."""
    counts = {verdict: sum(change.verdict is verdict for change in found.changes) for verdict in Verdict}
    parts = [f"{count} {_WORDS[verdict]}" for verdict, count in counts.items() if count]
    return f"solvers: {', '.join(parts)} (of {len(found.changes)}; a difference is p < {SIGNIFICANT:g} after Holm)"

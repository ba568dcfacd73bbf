"""The columns of a table of leaderboard, said once: the terminal, LaTeX and the report all show these."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

from cgla_graph._text import DASH, counted, duration, figure, percent
from cgla_graph.comparisons.leaderboard.leaderboard import NEAR_PERCENT, LeaderboardRow, MetricStanding
from cgla_graph.comparisons.numbers import Cell, estimate_cell, or_never, p_value, rate_cell, ratio
from cgla_graph.comparisons.statistics.intervals import FEWEST_RUNS
from cgla_graph.comparisons.statistics.ranking import too_few_note


class Column(NamedTuple):
    """
    A column of numbers, a line a solver.

    Attributes
    ----------
    head
        Its title.
    explained
        Its meaning, in a few words.
    cell
        Writes the cell of one solver.
    """

    head: str
    explained: str
    cell: Callable[[LeaderboardRow], Cell]


def _cost_ratio(one: LeaderboardRow) -> Cell:
    return Cell(DASH) if one.versus_best is None else estimate_cell(one.versus_best.ratio, ratio, least=0.0)


#: In order; beside them stands the solver.
COLUMNS = (
    Column(
        "average rank",
        "by the median cost on each scenario, 1 is best; a run without a path is infinitely costly",
        lambda one: Cell(figure(one.average_rank, 3)),
    ),
    Column(
        "cheapest on",
        "scenarios with the cheapest path, alone or jointly",
        lambda one: Cell(f"{one.wins}/{one.n_instances}"),
    ),
    Column(
        "gap",
        "median over the scenarios of how far the cost is above the proven lower bound",
        lambda one: estimate_cell(one.gap, or_never(percent)),
    ),
    Column(
        "success",
        "runs with a path, or that say rightly that there is none; the interval by Clopper and Pearson",
        lambda one: rate_cell(one.n_answers, one.n_runs, one.success),
    ),
    Column(
        f"to {NEAR_PERCENT} %",
        "median time to that gap, building the graph included",
        lambda one: estimate_cell(one.seconds_to_near, or_never(duration)),
    ),
    Column(
        "cost ratio",
        "to the first solver, scenario by scenario (Hodges-Lehmann); its interval is of that pair alone",
        _cost_ratio,
    ),
    Column(
        "p",
        "Wilcoxon's signed ranks against the first solver, after Holm for all pairs",
        lambda one: Cell(DASH if one.versus_best is None else p_value(one.versus_best.p_holm)),
    ),
    Column(
        "failed",
        "runs without a path that may be flown, where it is not proven that there is none",
        lambda one: Cell(f"{sum(one.failures.values()):,}" if one.failures else DASH),
    ),
)
#: Heads of columns that a narrow table drops, in order.
SPARE = ("p", f"to {NEAR_PERCENT} %", "cheapest on", "failed", "cost ratio", "success", "gap")


def columns_of(found: Sequence[LeaderboardRow]) -> list[Column]:
    """Return the columns of a leaderboard: `COLUMNS`, and two of each metric."""
    return [*COLUMNS, *(column for one in (found[0].metrics if found else ()) for column in _metric_columns(one))]


def _metric_columns(metric: MetricStanding) -> tuple[Column, Column]:
    def own(one: LeaderboardRow) -> MetricStanding:
        return next(other for other in one.metrics if other.measure.name == metric.measure.name)

    said = metric.measure
    return (
        Column(
            said.head,
            f"median over the scenarios of the metric {said.name}, of the median run; {said.better} is better",
            lambda one: estimate_cell(own(one).estimate, lambda value: figure(value, 4)),
        ),
        Column(
            f"rank by {said.name}",
            "average rank by that metric, 1 is best; without a path a solver ranks last",
            lambda one: Cell(figure(own(one).average_rank, 3)),
        ),
    )


def _missing_notes(found: Sequence[LeaderboardRow]) -> list[str]:
    """Say of each metric that has no value on some paths on how many, and where the reason stands."""
    n_paths = sum(one.n_paths for one in found)
    counts = Counter({one.measure.name: 0 for row in found for one in row.metrics})
    for row in found:
        counts.update({one.measure.name: one.n_missing for one in row.metrics})
    return [
        f"{name}: the metric has no value on {n_missing:,} of {counted(n_paths, 'path')}; it failed or "
        f"returned NaN, as the message of the run says (rows.csv of --out; the runs in the report)"
        for name, n_missing in counts.items()
        if n_missing
    ]


def leaderboard_heads(found: Sequence[LeaderboardRow]) -> tuple[str, ...]:
    """Return the heads of the columns, the solver's first."""
    return "solver", *(column.head for column in columns_of(found))


def leaderboard_cells(one: LeaderboardRow) -> list[str]:
    """Return what a table says of a solver, a cell for each head; intervals stand in a second line."""
    return [one.solver, *(column.cell(one).lines for column in columns_of([one]))]


def leaderboard_notes(found: Sequence[LeaderboardRow]) -> list[str]:
    """Explain the columns, a line each, and the intervals."""
    notes = [f"{column.head}: {column.explained}" for column in columns_of(found)]
    notes += _missing_notes(found)
    notes.append("below: 95 % intervals, of medians and ratios free of any distribution")
    n_instances = found[0].n_instances if found else 0
    if note := too_few_note(n_instances, len(found)):
        notes.append(f"p: {note}")
    if 0 < n_instances < FEWEST_RUNS:
        notes.append(f"intervals over scenarios need at least {FEWEST_RUNS} of them")
    return notes

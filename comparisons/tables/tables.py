"""Tables for the terminal."""

import math
from collections.abc import Sequence

from cgla_graph.comparisons.leaderboard.performance import TARGET_PERCENTS, Performance
from cgla_graph.comparisons.numbers import (
    DASH,
    duration,
    estimate_cell,
    figure,
    or_never,
    percent,
    rate_cell,
    rounded_down,
)
from cgla_graph.comparisons.statistics.intervals import FEWEST_RUNS
from cgla_graph.comparisons.study.rows import Summary, summaries
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.bound_note import bound_note
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.scenarios.scenario import Scenario

#: What a narrow terminal does without of `comparison_table`, the first first.
_SPARE = ("evaluations", "clearance", "seed spread", "build", "excess", "risk", "length", "time", "gap")


def comparison_table(scenario: Scenario, runs: Sequence[Run], notes: Sequence[str] = ()) -> FittedTable:
    """Show one scenario: a line a solver, the least gap first; below, what the columns say, and `notes`."""
    unit = "m" if scenario.projection else "map units"
    title = f"{scenario.full_title} (k = {scenario.problem.k:g}, lengths in {unit})"
    heads = ("cost", "gap", "excess", "length", "risk", "clearance", "time", "build", "evaluations", "seed spread")
    found = summaries(runs)
    rows: list[Sequence[str]] = [_cells(summary) for summary in found]
    remarks = [f"{one.solver}: {one.message}" for one in found if one.message and not _is_quiet(one)]
    explained = [
        f"gap: {bound_note(runs) or 'not known, as no lower bound was asked for'}",
        "excess: over the best exact optimum on the lattice; time: to solve; build: to weigh and hand over the graph",
        "evaluations: pairs of points whose cost was asked for",
        "of several seeds: the median run; seed spread: how much more the most expensive costs than the cheapest",
    ]
    return FittedTable(title, ("solver", "status"), heads, _SPARE, [*explained, *notes, *remarks], rows)


def performance_table(found: Sequence[Performance]) -> FittedTable:
    """Show how soon the solvers of one scenario get how far: a line a solver, the cheapest first."""
    first = found[0]
    soon = [f"to {share} %" for share in TARGET_PERCENTS]
    evaluations = f"evaluations {soon[-1]}"
    heads = ["runs", "success", "to first path", *soon, evaluations, "median cost"]
    # how many runs there were stands in success, too
    spare = (evaluations, "runs", *soon[:-1], "success", "to first path", soon[-1])
    rows: list[Sequence[str]] = []
    # optima that differ by rounding are equal
    for one in sorted(found, key=lambda one: (float(f"{one.cost.median:.9g}"), one.seconds[0].median)):
        cells = [
            one.solver,
            str(one.n_runs),
            rate_cell(one.n_paths, one.n_runs, one.success).lines,
            *(estimate_cell(time, or_never(lambda seconds: figure(1e3 * seconds, 3))).lines for time in one.seconds),
            estimate_cell(one.evaluations[-1], or_never("{:,.0f}".format)).lines,
            estimate_cell(one.cost, or_never(lambda cost: figure(cost, 6))).lines,
        ]
        rows.append(cells)
    shares = ", ".join(str(share) for share in TARGET_PERCENTS)
    bound = first.lower_bound
    targets = "unknown without a lower bound" if math.isnan(bound) else f"to a gap over {rounded_down(bound, 6)}"
    notes = [
        f"to first path, to {shares} %: time until then, building the graph included ({targets})",
        "medians over the runs; one that never gets there counts as infinite, so a median may be never",
        "below: 95 % intervals, of success by Clopper and Pearson, of medians from order statistics",
    ]
    if any(1 < one.n_runs < FEWEST_RUNS for one in found):
        notes.append(f"intervals of medians need at least {FEWEST_RUNS} runs (--seeds {FEWEST_RUNS})")
    title = f"{first.scenario}: how soon, in milliseconds"
    return FittedTable(title, ("solver",), heads, spare, notes, rows)


def _is_quiet(summary: Summary) -> bool:
    """Say whether an answer needs no remark."""
    return summary.status in {"optimal", "found"}


def _cells(summary: Summary) -> list[str]:
    return [
        summary.solver,
        summary.status,
        figure(summary.cost, 6),
        percent(summary.gap),
        percent(summary.excess),
        figure(summary.length, 6),
        figure(summary.risk, 4),
        figure(summary.clearance, 3),
        duration(summary.seconds),
        duration(summary.build_seconds) if summary.build_seconds else DASH,
        f"{summary.evaluations:,.0f}",
        percent(summary.spread),
    ]

"""Tables for the terminal."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from cgla_graph._text import DASH, duration, figure, percent, rounded_down
from cgla_graph.comparisons.leaderboard.performance import TARGET_PERCENTS, Performance
from cgla_graph.comparisons.numbers import estimate_cell, or_never, rate_cell
from cgla_graph.comparisons.statistics.intervals import FEWEST_RUNS
from cgla_graph.comparisons.study.rows import Summary, bound_note, claims_note, summaries
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.people.units import risk_unit
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario

#: The columns of numbers of one solver on one scenario.
SUMMARY_COLUMNS: Mapping[str, Callable[[Summary], str]] = {
    "runs": lambda one: f"{one.n_paths}/{one.n_runs}",
    "cost": lambda one: figure(one.cost, 6),
    "gap": lambda one: percent(one.gap),
    "excess": lambda one: percent(one.excess),
    "length": lambda one: figure(one.length, 6),
    "risk": lambda one: figure(one.risk, 4),
    "clearance": lambda one: figure(one.clearance, 3),
    "time": lambda one: duration(one.seconds),
    "build": lambda one: duration(one.build_seconds) if one.build_seconds else DASH,
    "evaluations": lambda one: f"{one.evaluations:,.0f}",
    "seed spread": lambda one: percent(one.spread),
}
#: Columns of `comparison_table` that a narrow terminal drops, in order.
_SPARE = ("evaluations", "clearance", "seed spread", "build", "excess", "risk", "length", "time", "gap")


def comparison_table(scenario: AnyScenario, runs: Sequence[Run], notes: Sequence[str] = ()) -> FittedTable:
    """Show one scenario: a line a solver, the least gap first; below, what the columns say, and `notes`."""
    if isinstance(scenario, GraphScenario):
        title, unit_of_risk, optimum = scenario.full_title, "", "least cost that an exact solver found"
    else:
        unit = "m" if scenario.projection else "map units"
        title = f"{scenario.full_title} (k = {scenario.problem.k:g}, lengths in {unit})"
        unit_of_risk, optimum = risk_unit(scenario.problem.field), "best exact optimum on the lattice"
    found = summaries(runs)
    quiet = {"optimal", "found"}
    remarks = [f"{one.solver}: {one.message}" for one in found if one.message and one.status not in quiet]
    explained = [
        f"gap: {bound_note(runs) or 'not known, as no lower bound was asked for'}",
        f"excess: over the {optimum}; time: to solve; build: to weigh and hand over the graph",
        "evaluations: pairs of points whose cost was asked for",
        "of several seeds: the median run; seed spread: how much more the most expensive costs than the cheapest",
    ]
    explained += [f"risk in {unit_of_risk}"] if unit_of_risk else []
    words = {"solver": lambda one: one.solver, "status": lambda one: one.status}
    left_out = {"runs", *(_unknown(found) if isinstance(scenario, GraphScenario) else ())}
    numbers = {head: write for head, write in SUMMARY_COLUMNS.items() if head not in left_out}
    for place, one in enumerate(found[0].measures if found else ()):
        numbers[one.head] = partial(_measured, place)
    claims = [note for note in [claims_note(runs)] if note]
    return FittedTable.of(title, found, words, numbers, _SPARE, [*explained, *claims, *notes, *remarks])


def _unknown(found: Sequence[Summary]) -> list[str]:
    """Name the columns of which a graph knows nothing: without positions lengths, without a risk field risk."""
    known = {"length": [one.length for one in found], "risk": [one.risk for one in found]}
    return ["clearance", *(head for head, values in known.items() if not any(map(math.isfinite, values)))]


def _measured(place: int, one: Summary) -> str:
    return measured_cells(one)[place]


def measured_cells(one: Summary) -> list[str]:
    """Write the values of metrics."""
    return [figure(measure.value, 4) for measure in one.measures]


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
            rate_cell(one.n_answers, one.n_runs, one.success).lines,
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

"""The table of `cgla results DIR --against DIR2`: what changed between two studies, and what does not pair."""

from collections.abc import Sequence

from cgla_graph.comparisons.leaderboard.regression import SIGNIFICANT, Change, Regression, RunKey, Verdict
from cgla_graph.comparisons.numbers import counted, estimate_cell, listed, p_value, ratio
from cgla_graph.comparisons.tables.fitted_table import FittedTable

_HEADS = (
    "pairs",
    "cost ratio",
    "p cost",
    "cheaper",
    "more expensive",
    "equal",
    "found",
    "lost",
    "p paths",
    "time ratio",
    "p time",
)
_SPARE = ("p time", "equal", "cheaper", "more expensive", "p paths", "found", "time ratio", "lost", "pairs", "p cost")
_WORDS = {
    Verdict.IDENTICAL: "identical",
    Verdict.BETTER: "better",
    Verdict.WORSE: "worse",
    Verdict.SAME: "no difference shown",
}
_NOTES = (
    "cost ratio, time ratio: new over old, run by run (Hodges-Lehmann), with 95 % intervals; below 1 is better",
    "p cost, p time: Wilcoxon's signed ranks, after Holm; times of other or busier machines differ by themselves",
    "found, lost: runs with a path only in the new study, only in the old one; p paths: McNemar, exact, not adjusted",
)


def regression_table(title: str, found: Regression) -> FittedTable:
    """Show what changed: a line a solver, and below what could not be paired."""
    rows: list[Sequence[str]] = [_cells(change) for change in found.changes]
    notes = list(_NOTES) if rows else ["no run of the one study has its like in the other"]
    return FittedTable(title, ("solver", "verdict"), _HEADS, _SPARE, [*notes, *_unpaired_lines(found)], rows)


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
    by_solver: dict[str, list[RunKey]] = {}
    for key in keys:
        by_solver.setdefault(key.solver, []).append(key)
    return listed([f"{solver} on {listed(_scenarios(group), 3)}" for solver, group in by_solver.items()])


def _scenarios(keys: Sequence[RunKey]) -> list[str]:
    return list(dict.fromkeys(key.scenario for key in keys))


def _cells(change: Change) -> list[str]:
    cost, seconds = change.cost, change.seconds
    return [
        change.solver,
        _WORDS[change.verdict],
        str(change.n),
        estimate_cell(cost.ratio, ratio, least=0.0).lines,
        p_value(cost.p_holm),
        str(cost.wins),
        str(cost.losses),
        str(cost.ties),
        str(cost.only_solver),
        str(cost.only_reference),
        p_value(cost.p_success),
        estimate_cell(seconds.ratio, ratio, least=0.0).lines,
        p_value(seconds.p_holm),
    ]


def summary_line(found: Regression) -> str:
    """Say in one line how many solvers became better, worse, or neither."""
    counts = {verdict: sum(change.verdict is verdict for change in found.changes) for verdict in Verdict}
    parts = [f"{count} {_WORDS[verdict]}" for verdict, count in counts.items() if count]
    return f"solvers: {', '.join(parts)} (of {len(found.changes)}; a difference is p < {SIGNIFICANT:g} after Holm)"

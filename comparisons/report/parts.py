"""Parts of the page that need no script: the ranking, the picture of ranks, and the failures, for the template."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from cgla_graph._text import DASH, counted, listed
from cgla_graph.comparisons.leaderboard.leaderboard import LeaderboardRow, failed, failure_groups
from cgla_graph.comparisons.numbers import Cell, p_equals
from cgla_graph.comparisons.statistics.ranking import Ranking, too_few_note
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.leaderboard_columns import columns_of

_SIDE, _AXIS = 240, 420  # pixels: room for names on either side, and the axis between
_LINE, _BAR_LINE = 20, 10  # pixels: between names, and between bars
_LONGEST = 26  # letters of a name
_CELL, _NAMES, _LETTER = 18, 190, 5.2  # pixels of the grid: cells, names on the left, a slanted letter's height
#: Most scenarios in the grid of failures.
MOST_COLUMNS = 80
#: Most groups of failures that are listed, and most scenarios that are named of each.
MOST_GROUPS, MOST_NAMES = 100, 4


def ranking_table(found: Sequence[LeaderboardRow], ranks: Ranking) -> dict[str, Any]:
    """Return the ranking table: its columns, a row a solver, and the note below."""
    columns = columns_of(found)
    rows = [
        {
            "place": one.place,
            "solver": one.solver,
            "cells": [_dashed(column.cell(one)) for column in columns],
            "failures": ", ".join(f"{count:,} {status.label}" for status, count in one.failures.items()),
        }
        for one in found
    ]
    too_few = too_few_note(ranks.n_instances, len(ranks.solvers))
    test = f"{too_few}. " if too_few else ""
    if ranks.p is not None and not too_few:
        test = f"Friedman's test that all rank alike, whichever may differ: {p_equals(ranks.p)}. "
    note = (
        f"{test}A scenario counts once, by the median over its seeds, and only where every solver has run it; "
        "a run without a path counts as infinitely costly and is never left out."
    )
    return {"columns": columns, "rows": rows, "note": note}


def _dashed(cell: Cell) -> Cell:
    """Write the dash that the page's script writes, too, for unknown values."""
    return Cell("–") if cell.value == DASH else cell


def rank_picture(ranks: Ranking) -> dict[str, Any] | None:
    """
    Place the picture of ranks, in pixels; None where there are no ranks to compare.

    The best are on the left; bars join those that do not differ significantly (Demsar, JMLR 7, 2006, fig. 1).

    Examples
    --------
    >>> from cgla_graph.comparisons.statistics.ranking import ranking
    >>> picture = rank_picture(ranking({"a": [1, 1, 1], "b": [2, 2, 2], "c": [3, 3, 3]}))
    >>> [(label["solver"], label["x"]) for label in picture["labels"]]
    [('a', 240.0), ('b', 450.0), ('c', 660.0)]
    """
    k = len(ranks.solvers)
    if k < 2 or not ranks.n_instances:  # noqa: PLR2004 - one solver has no difference
        return None

    def across(rank: float) -> float:
        return round(_SIDE + (rank - 1.0) / (k - 1) * _AXIS, 1)

    rank_of = dict(zip(ranks.solvers, ranks.average_ranks, strict=True))
    axis_y, half, every = 34.0, (k + 1) // 2, max(1, -(-k // 20))
    bars: list[dict[str, float]] = []
    ends: list[float] = []  # of each line of bars, which do not touch
    for group in ranks.groups:
        low, high = rank_of[group[0]], rank_of[group[-1]]
        line = next((line for line, end in enumerate(ends) if end < low), len(ends))
        ends[line : line + 1] = [high]
        bars.append({"x1": across(low) - 4, "x2": across(high) + 4, "y": axis_y + 12 + line * _BAR_LINE})
    first_y = axis_y + 14 + len(ends) * _BAR_LINE + 16
    labels = []
    for place, (solver, rank) in enumerate(rank_of.items()):
        # the better half on the left, the outer ranks on top, so that no lines cross
        left, row = place < half, min(place, k - 1 - place)
        x, y = across(rank), first_y + row * _LINE
        end = _SIDE - 14 if left else _SIDE + _AXIS + 14
        labels.append({
            "solver": solver,
            "text": short(solver),
            "rank": f"{rank:.2f}",
            "x": x,
            "points": f"{x},{axis_y} {x},{y} {end},{y}",
            "text_x": end - 6 if left else end + 6,
            "text_y": y + 4,
            "anchor": "end" if left else "start",
        })  # fmt: skip
    return {
        "width": 2 * _SIDE + _AXIS,
        "height": first_y + (half - 1) * _LINE + 20,
        "axis": {
            "x1": across(1.0),
            "x2": across(k),
            "y": axis_y,
            "ticks": [{"x": across(tick), "label": tick} for tick in range(1, k + 1) if (tick - 1) % every == 0],
        },
        "labels": labels,
        "groups": bars,
        "description": _described(ranks),
        "caption": _caption(ranks),
    }


def _described(ranks: Ranking) -> str:
    ordered = ", ".join(f"{s} {r:.2f}" for s, r in zip(ranks.solvers, ranks.average_ranks, strict=True))
    groups = "; ".join(f"{', '.join(group)}" for group in ranks.groups)
    return (
        f"Average ranks, best first: {ordered}. Without significant difference: {groups or 'none'}.{_not_joined(ranks)}"
    )


def _not_joined(ranks: Ranking) -> str:
    """Name pairs that do not differ significantly but that no bar can join without a solver between."""
    pairs = listed([" and ".join(pair) for pair in ranks.apart_in_rank])
    return f" Nor do these differ significantly: {pairs}." if pairs else ""


def _caption(ranks: Ranking) -> str:
    if ranks.p is None:
        return "Average ranks, best on the left. One scenario is too few to say which of them differ."
    note = too_few_note(ranks.n_instances, len(ranks.solvers))
    return (
        f"Average ranks over {ranks.n_instances:,} scenarios, best on the left. Solvers that a bar joins do not "
        "differ significantly by the table's test, Wilcoxon's signed ranks after Holm for all pairs (p below 0.05)."
        f"{_not_joined(ranks)}{note and f' {note}.'}"
    )


def failures(runs: Sequence[Run]) -> dict[str, Any]:
    """
    Return the table of failures, a row for each of `failure_groups`, the largest first.

    Examples
    --------
    >>> failures([])
    {'headline': 'No run failed.', 'groups': [], 'more': ''}
    """
    groups = sorted(failure_groups(runs), key=lambda group: len(group.runs), reverse=True)
    n_failed = len(failed(runs))
    shown = [
        {
            "count": f"{len(group.runs):,}",
            "solver": group.solver,
            "status": group.status.label,
            "sentence": group.status.value,
            "message": group.message,
            "scenarios": listed(group.scenarios, MOST_NAMES),
        }
        for group in groups[:MOST_GROUPS]
    ]
    rest = len(groups) - len(shown)
    headline = "No run failed."
    if n_failed:
        headline = f"{n_failed:,} of {counted(len(runs), 'run')} found no path that may be flown."
    more = f"{rest} more groups are not listed; the table of runs has them all." if rest else ""
    return {"headline": headline, "groups": shown, "more": more}


def failure_grid(found: Sequence[LeaderboardRow], runs: Sequence[Run]) -> dict[str, Any] | None:
    """
    Place a grid of solvers by scenarios, each cell the share of runs without a path; None where no run failed.

    Only solvers and scenarios with a failure are in it, of the scenarios the `MOST_COLUMNS` with the most.
    """
    n_runs = Counter((run.solver, run.scenario.name) for run in runs)
    n_failed = {one.solver: one.failed_on for one in found if one.failed_on}
    if not n_failed:
        return None
    totals: Counter[str] = Counter()
    for counts in n_failed.values():
        totals.update(counts)
    most = {name for name, _ in totals.most_common(MOST_COLUMNS)}
    columns = [name for name in dict.fromkeys(run.scenario.name for run in runs) if name in most]
    heads = round(14 + _LETTER * max(len(short(name, 18)) for name in columns))
    rows = []
    for number, (solver, counts) in enumerate(n_failed.items()):
        cells = []
        for place, name in enumerate(columns):
            if n := n_runs[solver, name]:
                bad = counts.get(name, 0)
                title = f"{solver} on {name}: {bad} of {n} runs without a path"
                cells.append({"x": _NAMES + place * _CELL, "share": round(bad / n, 3), "title": title})
        rows.append({"text": short(solver), "name": solver, "y": heads + number * _CELL, "cells": cells})
    worst = "; ".join(f"{solver}: {sum(counts.values())} on {len(counts)}" for solver, counts in n_failed.items())
    rest = len(totals) - len(columns)
    caption = (
        "Share of runs without a path, by solver and scenario: the darker the more, a cross where none has a path."
    )
    left_out = (
        f" Solvers and scenarios without a failure are left out{f', and {rest} scenarios with few' if rest else ''}."
    )
    return {
        "width": _NAMES + len(columns) * _CELL + heads,
        "height": heads + len(rows) * _CELL + 6,
        "left": _NAMES,
        "columns": [
            {"x": _NAMES + place * _CELL + 12, "y": heads - 6, "text": short(name, 18), "name": name}
            for place, name in enumerate(columns)
        ],
        "rows": rows,
        "description": f"Failed runs and the number of scenarios they are on. {worst}.",
        "caption": caption + left_out,
    }


def short(name: str, most: int = _LONGEST) -> str:
    """
    Cut a long name for a picture; the whole name stands beside it.

    Examples
    --------
    >>> short("a-solver-with-many-settings", 10)
    'a-solver-…'
    """
    return name if len(name) <= most else f"{name[: most - 1]}…"

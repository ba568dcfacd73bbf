"""Parts of the page that need no script: the ranking and the failures, as texts for the template."""

from collections.abc import Mapping, Sequence
from typing import Any

from cgla_graph.comparisons.leaderboard.failures import failed, failure_groups
from cgla_graph.comparisons.leaderboard.leaderboard import LeaderboardRow
from cgla_graph.comparisons.numbers import DASH, Cell, listed, p_equals
from cgla_graph.comparisons.statistics.ranking import Ranking, too_few_note
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.leaderboard_columns import COLUMNS
from cgla_graph.model.solution import Status

#: Most groups of failures that are listed, and most scenarios that are named of each.
MOST_GROUPS, MOST_NAMES = 100, 4


def ranking_table(found: Sequence[LeaderboardRow], ranks: Ranking) -> dict[str, Any]:
    """
    Return the ranking table: its columns, a row a solver, and the note below.

    Parameters
    ----------
    found
        The leaderboard, best first.
    ranks
        The ranking that they come from.
    """
    rows = [
        {
            "place": one.place,
            "solver": one.solver,
            "cells": [_dashed(column.cell(one)) for column in COLUMNS],
            "failures": _failures(one.failures),
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
    return {"columns": COLUMNS, "rows": rows, "note": note}


def _dashed(cell: Cell) -> Cell:
    """Write the dash that the page's script writes, too, for what is not known."""
    return Cell("–") if cell.value == DASH else cell


def _failures(counts: Mapping[Status, int]) -> str:
    return ", ".join(f"{count:,} {status.label}" for status, count in counts.items())


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
    headline = f"{n_failed:,} of {len(runs):,} runs found no path that may be flown." if n_failed else "No run failed."
    more = f"{rest} more groups are not listed; the table of runs has them all." if rest else ""
    return {"headline": headline, "groups": shown, "more": more}

"""The words of the report: who wins, by how much, how sure that is, and where each solver fails."""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cgla_graph.comparisons.paired import Paired
from cgla_graph.comparisons.ranking import Ranking
from cgla_graph.comparisons.runner import Run
from cgla_graph.comparisons.standings import NEAR_PERCENT, Standing
from cgla_graph.comparisons.statistics import CONFIDENCE, Estimate
from cgla_graph.comparisons.tables import duration, percent

#: Most groups of failures that are listed, and most names in a sentence.
MOST_GROUPS, MOST_NAMES = 100, 4
_LEVEL = 1.0 - CONFIDENCE
#: How strong the evidence of a p-value is, in words: below the bound on the left.
_STRENGTHS = ((0.001, "very strong evidence"), (0.01, "strong evidence"), (_LEVEL, "evidence"))


@dataclass(frozen=True)
class Answer:
    """One of the questions a reader brings, with its answer: a figure and the words that go with it."""

    question: str
    figure: str
    words: str


@dataclass(frozen=True)
class Summary:
    """What a reader gets at a glance."""

    headline: str
    answers: Sequence[Answer] = ()
    caution: str = ""


def summary(found: Sequence[Standing], ranks: Ranking, n_scenarios: int) -> Summary:
    """
    Answer the four questions.

    Parameters
    ----------
    found
        The standings, best first.
    ranks
        The ranking that they come from.
    n_scenarios
        How many scenarios the study has, run or not.

    Examples
    --------
    >>> from cgla_graph.comparisons.ranking import ranking
    >>> summary([], ranking({}), 3).headline
    'No run is done yet.'
    """
    if not found:
        return Summary("No run is done yet.")
    where = Answer("Where do they fail?", *_failing(found))
    first, n_instances = found[0], found[0].n_instances
    if not n_instances:
        return Summary("No scenario has been run by all solvers yet, so none can be ranked.", [where])
    if len(found) == 1:
        words = f"{first.solver} is the only solver: it found a path in {first.n_paths:,} of {first.n_runs:,} runs."
        return Summary(words, [where])
    answers = [_who(first), *_how_much(found[1:]), *_how_sure(found, ranks), where]
    return Summary(_headline(found), answers, _caution(ranks, n_scenarios))


def _headline(found: Sequence[Standing]) -> str:
    first = found[0]
    share = [one.solver for one in found if one.place == 1]
    scenarios = _count(first.n_instances, "scenario")
    if len(share) > 1:
        return f"{_names(share)} share the first place of {len(found)} solvers on {scenarios}."
    return f"{first.solver} ranks first of {len(found)} solvers on {scenarios}{_lead(found[1])}."


def _lead(next_one: Standing) -> str:
    """Say how far behind the next one is, where that is a plain number."""
    paired = next_one.versus_best
    if paired is None or not 1.0 < paired.ratio.median < 10.0:  # noqa: PLR2004 - beyond that, percentages say little
        return ""
    words = f"{100.0 * (paired.ratio.median - 1.0):.2g} % more ({_strength(paired.p_holm)})"
    return f"; the next one, {next_one.solver}, typically costs {words}"


def _who(first: Standing) -> Answer:
    words = f"average rank {first.average_rank:.2f}; cheapest, alone or jointly, on {first.wins} of {first.n_instances}"
    gap = f"; median gap {percent(first.gap.median)}" if math.isfinite(first.gap.median) else ""
    return Answer("Who wins?", first.solver, words + gap)


def _how_much(others: Sequence[Standing]) -> list[Answer]:
    """Compare the first with the next one."""
    paired = others[0].versus_best
    return [] if paired is None else [Answer("By how much?", _ratio_figure(paired), _ratio_words(paired))]


def _how_sure(found: Sequence[Standing], ranks: Ranking) -> list[Answer]:
    """
    Say who is shown to rank behind the first, and what the paired test says of the next one.

    The critical difference holds for all pairs at once, so also for the first, whoever that turns out to be. It tells
    many solvers apart on few scenarios, where paired tests adjusted for all pairs cannot.
    """
    first, others = found[0], found[1:]
    difference = ranks.critical_difference
    if difference is None:
        return []
    behind = [one.solver for one in others if one.average_rank - first.average_rank >= difference]
    level = [one.solver for one in others if one.solver not in behind]
    words = f"average ranks at least {difference:.3g} apart, the critical difference (Nemenyi, 95 %)"
    if level and behind:
        words += f"; not told apart from the first: {_names(level)}"
    paired = others[0].versus_best
    if paired is not None:
        words += f"; paired with {others[0].solver}: {_strength(paired.p_holm)} (Holm p {p_value(paired.p_holm)})"
    return [Answer("How sure?", f"{len(behind)} of {len(others)} rank behind it beyond chance", words)]


def _ratio_figure(paired: Paired) -> str:
    ratio = paired.ratio.median
    if not math.isfinite(ratio):
        return "no path against a path" if ratio > 0.0 else "not known"
    return percent(ratio - 1.0) if ratio < 2.0 else f"{ratio:.3g} times"  # noqa: PLR2004 - from here on, times read better


def _ratio_words(paired: Paired) -> str:
    low, high = paired.ratio.low, paired.ratio.high
    tally = f"dearer on {paired.losses} of {paired.n} scenarios, cheaper on {paired.wins}, equal on {paired.ties}"
    interval = _ratio_interval(paired.ratio) or "too few scenarios for an interval"
    known = f"95 % interval: {interval}" if low > 0.0 or high < math.inf else interval
    return f"is the cost of {paired.solver}, the next one, against the first ({known}); {tally}"


def _ratio_interval(ratio: Estimate) -> str:
    """Write the interval of a ratio of costs; nothing where there is none."""
    if math.isnan(ratio.low) or (ratio.low <= 0.0 and math.isinf(ratio.high)):
        return ""
    return f"{percent(ratio.low - 1.0)} to {percent(ratio.high - 1.0) if math.isfinite(ratio.high) else '∞'}"


def _strength(p: float) -> str:
    return next((words for bound, words in _STRENGTHS if p < bound), "not enough evidence")


def p_value(p: float) -> str:
    """
    Write a p-value, with its sign.

    Examples
    --------
    >>> p_value(0.2), p_value(1e-9)
    ('= 0.20', '< 0.001')
    """
    if math.isnan(p):
        return "unknown"
    return "< 0.001" if p < 0.001 else f"= {p:.2g}" if p < 0.1 else f"= {p:.2f}"  # noqa: PLR2004 - digits that matter


def _failing(found: Sequence[Standing]) -> tuple[str, str]:
    n_runs, n_failed = sum(one.n_runs for one in found), sum(one.n_runs - one.n_paths for one in found)
    if not n_failed:
        return "nowhere", f"each of the {n_runs:,} runs found a path"
    worst = sorted(found, key=lambda one: one.n_paths / one.n_runs)
    failing = [one for one in worst if one.n_paths < one.n_runs]
    parts = [
        f"{one.solver} in {one.n_runs - one.n_paths:,} of {one.n_runs:,} (on {_names(list(one.failed_on), 2)})"
        for one in failing[:3]
    ]
    more = f"; {len(failing) - 3} more solvers" if len(failing) > 3 else ""  # noqa: PLR2004 - those named above
    clean = len(found) - len(failing)
    return (
        f"{n_failed:,} of {n_runs:,} runs have no path",
        f"{'; '.join(parts)}{more}. {_count(clean, 'solver') if clean else 'No solver'} always found one",
    )


def _caution(ranks: Ranking, n_scenarios: int) -> str:
    notes = []
    if ranks.n_instances < n_scenarios:
        rest = _count(n_scenarios - ranks.n_instances, "scenario")
        notes.append(f"{rest} not run by all solvers yet: ranks leave that out.")
    fewest = ranks.fewest_instances
    if fewest is not None and ranks.n_instances < fewest:
        notes.append(
            f"{_count(ranks.n_instances, 'scenario')} cannot tell the average ranks of {len(ranks.solvers)} solvers "
            f"apart at 95 %, whatever happens on them; that needs {fewest} or more."
        )
    return " ".join(notes)


def ranking_table(found: Sequence[Standing], ranks: Ranking) -> dict[str, Any]:
    """Return heads, rows and the note of the ranking table: texts only."""
    heads = [
        ("average rank", "over the scenarios; 1 is best"),
        ("best on", "scenarios with the cheapest path, alone or jointly"),
        ("median gap", "over the proven lower bound; 95 % interval below"),
        ("cost / first", "typical ratio of costs, Hodges and Lehmann; 95 % interval below"),
        ("p (Holm)", "signed-rank test against the first, adjusted for all pairs"),
        ("success", "runs with a path; 95 % interval below"),
        (f"time to {NEAR_PERCENT} %", "median time until the cost is that near to the lower bound"),
    ]
    rows = [
        {
            "place": one.place,
            "solver": one.solver,
            "cells": _ranking_cells(one),
            "failures": _failures(one.failures) or "–",
        }
        for one in found
    ]
    test = f"Friedman's test that all are equal: p {p_value(ranks.p)}. " if ranks.p is not None else ""
    note = (
        f"{test}A scenario counts once, by the median over its seeds, and only where every solver has run it; "
        "a run without a path counts as infinitely costly and is never left out."
    )
    return {"heads": [{"label": label, "title": title} for label, title in heads], "rows": rows, "note": note}


def _ranking_cells(one: Standing) -> list[dict[str, str]]:
    paired = one.versus_best
    interval = f"{100 * one.success.low:.0f} to {100 * one.success.high:.0f} %"
    ratio = paired.ratio if paired else None
    return [
        _cell("–" if math.isnan(one.average_rank) else f"{one.average_rank:.2f}"),
        _cell(f"{one.wins}/{one.n_instances}"),
        _estimate_cell(one.gap, percent),
        _cell("–") if ratio is None else _cell(_times(ratio.median), _ratio_span(ratio)),
        _cell("–" if paired is None else p_value(paired.p_holm).removeprefix("= ")),
        _cell(f"{one.n_paths:,}/{one.n_runs:,}", interval if one.n_runs > 1 else ""),
        _estimate_cell(one.seconds_to_near, duration),
    ]


def _cell(value: str, interval: str = "", title: str = "") -> dict[str, str]:
    return {"value": value, "interval": interval, "title": title}


def _estimate_cell(found: Estimate, write: Any) -> dict[str, str]:  # noqa: ANN401 - a function of a number
    if math.isnan(found.median):
        return _cell("–", title="not known without a lower bound")
    low, high = _or_never(found.low, write), _or_never(found.high, write)
    # one unit is enough for two ends that share it
    if low.rpartition(" ")[2] == high.rpartition(" ")[2]:
        low = low.rpartition(" ")[0] or low
    interval = "" if math.isinf(found.low) else f"{low} to {high}"
    return _cell(_or_never(found.median, write), interval)


def _or_never(value: float, write: Any) -> str:  # noqa: ANN401 - a function of a number
    return str(write(value)) if value < math.inf else "never"


def _times(ratio: float) -> str:
    if math.isnan(ratio):
        return "–"
    return "∞" if math.isinf(ratio) else f"{ratio:.4f}" if ratio < 10.0 else f"{ratio:.3g}"  # noqa: PLR2004 - digits that matter


def _ratio_span(ratio: Estimate) -> str:
    return f"{_times(ratio.low)} to {_times(ratio.high)}" if _ratio_interval(ratio) else ""


def _failures(counts: Mapping[Any, int]) -> str:
    return ", ".join(f"{count:,} {status.label}" for status, count in counts.items())


def failures(runs: Sequence[Run]) -> dict[str, Any]:
    """
    Group the runs without a path by solver, status and message; messages that differ by numbers only are one group.

    Examples
    --------
    >>> failures([])
    {'headline': 'No run failed.', 'groups': [], 'more': ''}
    """
    groups: dict[tuple[str, str, str], list[Run]] = {}
    for run in runs:
        if not run.solution.status.is_path:
            pattern = re.sub(r"\d[\d.e+-]*", "#", str(run.solution.message))
            groups.setdefault((run.solver, run.solution.status.label, pattern), []).append(run)
    ordered = sorted(groups.values(), key=len, reverse=True)
    n_failed = sum(map(len, ordered))
    listed = [
        {
            "count": f"{len(group):,}",
            "solver": group[0].solver,
            "status": group[0].solution.status.label,
            "sentence": group[0].solution.status.value,
            "message": str(group[0].solution.message),
            "scenarios": _names(list(Counter(run.scenario.name for run in group))),
        }
        for group in ordered[:MOST_GROUPS]
    ]
    rest = len(ordered) - len(listed)
    headline = f"{n_failed:,} of {len(runs):,} runs found no path that may be flown." if n_failed else "No run failed."
    more = f"{rest} more groups are not listed; the table of runs has them all." if rest else ""
    return {"headline": headline, "groups": listed, "more": more}


def _count(number: int, word: str) -> str:
    return f"{number:,} {word}" if number == 1 else f"{number:,} {word}s"


def _names(names: Sequence[str], most: int = MOST_NAMES) -> str:
    """Join names for a sentence; the first few of many."""
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)

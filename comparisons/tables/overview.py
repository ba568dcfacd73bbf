"""The overview of a comparison, in words: who wins, by how much, how confident that is, and where each solver fails."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cgla_graph._text import counted, listed, percent
from cgla_graph.comparisons.leaderboard.leaderboard import LeaderboardRow
from cgla_graph.comparisons.numbers import estimate_cell
from cgla_graph.comparisons.statistics.paired import Paired
from cgla_graph.comparisons.statistics.ranking import LEVEL, too_few_note

#: Most names in a sentence.
_MOST_NAMES = 4
#: Words for the evidence of a p-value below the bound on the left.
#: The word for costs within a hundredth of a percent.
TIE = "a tie"
_STRENGTHS = ((0.001, "very strong evidence"), (0.01, "strong evidence"), (LEVEL, "evidence"))


@dataclass(frozen=True)
class Answer:
    """One of the questions a reader brings, with its answer: a figure and the words that go with it."""

    question: str
    figure: str
    words: str


@dataclass(frozen=True)
class Overview:
    """
    The summary of a study at a glance.

    Attributes
    ----------
    headline
        The first solver and its lead.
    answers
        The questions that can be answered so far.
    caution
        A reservation; empty if there is none.
    """

    headline: str
    answers: Sequence[Answer] = ()
    caution: str = ""


def overview(found: Sequence[LeaderboardRow], n_scenarios: int, sampled: str = "") -> Overview:
    """
    Answer the four questions.

    Parameters
    ----------
    found
        The leaderboard, best first.
    n_scenarios
        Number of scenarios of the study, run or not.
    sampled
        What is independent among them (`cgla_graph.comparisons.study.sampling.independence_note`); may be empty.

    Examples
    --------
    >>> overview([], 3).headline
    'No run is done yet.'
    """
    if not found:
        return Overview("No run is done yet.")
    where = Answer("Where do they fail?", *_failing(found))
    first, n_instances = found[0], found[0].n_instances
    if not n_instances:
        return Overview("No scenario has been run by all solvers yet, so none can be ranked.", [where])
    if len(found) == 1:
        runs = counted(first.n_runs, "run")
        words = f"{first.solver} is the only solver: it found a path in {first.n_paths:,} of {runs}."
        return Overview(words, [where])
    if not any(one.n_paths for one in found):
        return Overview(f"None of {len(found)} solvers found a path on {counted(n_instances, 'scenario')}.", [where])
    answers = [_who(found), *_how_much(found[1:]), _how_confident(found), where]
    caution = " ".join(
        filter(None, [_caution(n_instances, n_scenarios), sampled and f"{sampled[0].upper()}{sampled[1:]}."])
    )
    return Overview(_headline(found), answers, caution)


def _headline(found: Sequence[LeaderboardRow]) -> str:
    first = found[0]
    share = [one.solver for one in found if one.place == 1]
    scenarios = counted(first.n_instances, "scenario")
    if len(share) > 1:
        return f"{listed(share, _MOST_NAMES)} share the first place of {len(found)} solvers on {scenarios}."
    return f"{first.solver} ranks first of {len(found)} solvers on {scenarios}{_lead(found[1])}."


def _lead(next_one: LeaderboardRow) -> str:
    """Say how far behind the next one is, where that is a plain number."""
    paired = next_one.versus_best
    if paired is None or not 1.0 < paired.ratio.median < 10.0:  # noqa: PLR2004 - beyond that, percentages say little
        return ""
    words = f"{100.0 * (paired.ratio.median - 1.0):.2g} % more ({_strength(paired.p_holm)})"
    return f"; the next one, {next_one.solver}, typically costs {words}"


def _who(found: Sequence[LeaderboardRow]) -> Answer:
    first, share = found[0], [one.solver for one in found if one.place == 1]
    words = f"average rank {first.average_rank:.2f}; cheapest, alone or jointly, on {first.wins} of {first.n_instances}"
    gap = f"; median gap {percent(first.gap.median)}" if math.isfinite(first.gap.median) else ""
    if len(share) > 1:
        words = f"by average rank, a tie; of {first.solver}: {words}"
    return Answer("Who wins?", listed(share, _MOST_NAMES), words + gap)


def _how_much(others: Sequence[LeaderboardRow]) -> list[Answer]:
    """Compare the first with the next one."""
    paired = others[0].versus_best
    return [] if paired is None else [Answer("By how much?", _ratio_figure(paired), _ratio_words(paired))]


def _how_confident(found: Sequence[LeaderboardRow]) -> Answer:
    """
    Say which of the others are shown to differ from the first, by the p-values that the table has of them.

    These are adjusted for all pairs, so they also hold for the first, which the same costs have chosen.
    """
    first, others = found[0], found[1:]
    if note := too_few_note(first.n_instances, len(found)):
        return Answer("How confident?", "too few scenarios to say", note)
    shown = [one for one in others if one.versus_best is not None and one.versus_best.p_holm < LEVEL]
    worse = [one for one in shown if one.versus_best is not None and one.versus_best.effect > 0.0]
    cheaper = [one.solver for one in shown if one not in worse]
    level = [one.solver for one in others if one not in shown]
    words = f"p < {LEVEL:.2g} by Wilcoxon's signed ranks, scenario by scenario, after Holm for all pairs"
    if level:
        words += f"; no significant difference from the first: {listed(level, _MOST_NAMES)}"
    if cheaper:
        words += f"; shown to be cheaper than it, though behind in rank: {listed(cheaper, _MOST_NAMES)}"
    return Answer("How confident?", f"{len(worse)} of {len(others)} are more expensive beyond chance", words)


def _ratio_figure(paired: Paired) -> str:
    ratio = paired.ratio.median
    if not math.isfinite(ratio):
        return "no path against a path" if ratio > 0.0 else "not known"
    if round(100.0 * (ratio - 1.0), 2) == 0.0:
        return TIE
    # from two times on, times read better
    return percent(ratio - 1.0) if ratio < 2.0 else f"{ratio:.3g} times"  # noqa: PLR2004


def _ratio_words(paired: Paired) -> str:
    tally = f"more expensive on {paired.losses} of {counted(paired.n, 'scenario')}, "
    tally += f"cheaper on {paired.wins}, equal on {paired.ties}"
    interval = estimate_cell(paired.ratio, _excess, least=0.0).interval
    known = f"95 % interval, of this pair alone: {interval}" if interval else "too few scenarios for an interval"
    ratio = paired.ratio.median
    if not math.isfinite(ratio):
        lead = f"{paired.solver}, the next one, against {paired.reference}"
    elif _ratio_figure(paired) == TIE:
        lead = f"{paired.solver}, the next one, costs the same as {paired.reference}"
    elif ratio < 2.0:  # noqa: PLR2004 - as above
        word = "more" if ratio >= 1.0 else "less"
        lead = f"{paired.solver}, the next one, costs {abs(100.0 * (ratio - 1.0)):.2f} % {word} than {paired.reference}"
    else:
        lead = f"{paired.solver}, the next one, costs {ratio:.3g} times as much as {paired.reference}"
    return f"{lead} ({known}); {tally}"


def _excess(ratio: float) -> str:
    return percent(ratio - 1.0) if math.isfinite(ratio) else "∞"


def _strength(p: float) -> str:
    return next((words for bound, words in _STRENGTHS if p < bound), "not enough evidence")


def _failing(found: Sequence[LeaderboardRow]) -> tuple[str, str]:
    n_runs, n_failed = sum(one.n_runs for one in found), sum(one.n_runs - one.n_answers for one in found)
    if not n_failed:
        none = "" if all(one.n_paths == one.n_answers for one in found) else ", or that there is none"
        return "nowhere", f"{'the one run' if n_runs == 1 else f'each of the {n_runs:,} runs'} found a path{none}"
    worst = sorted(found, key=lambda one: one.n_answers / one.n_runs)
    failing = [one for one in worst if one.n_answers < one.n_runs]
    parts = [
        f"{one.solver} in {one.n_runs - one.n_answers:,} of {one.n_runs:,} (on {listed(list(one.failed_on), 2)})"
        for one in failing[:3]
    ]
    more = f"; {len(failing) - 3} more solvers" if len(failing) > 3 else ""  # noqa: PLR2004 - those named above
    clean = len(found) - len(failing)
    return (
        f"{n_failed:,} of {counted(n_runs, 'run')} have no path",
        f"{'; '.join(parts)}{more}. {counted(clean, 'solver') if clean else 'No solver'} always found one",
    )


def _caution(n_instances: int, n_scenarios: int) -> str:
    if n_instances >= n_scenarios:
        return ""
    return f"{counted(n_scenarios - n_instances, 'scenario')} not run by all solvers yet: ranks leave that out."

"""How solvers look in every picture: which run of each is drawn, who stands out in colour, and who stays grey."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.numbers import counted, figure
from cgla_graph.comparisons.plots.page import plain
from cgla_graph.comparisons.study.rows import by_solver, median_run, seeds_note, summaries
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Status

#: Where matplotlib begins in a pattern of dashes, and the lengths of dashes and gaps in line widths (None: no gaps).
Dashes: TypeAlias = tuple[float, tuple[float, ...] | None]

# Okabe and Ito's palette with brown and olive instead of yellow (faint on white) and vermilion (kept for infeasible
# paths). The numbers of colours, dashes and markers (of plot_trace) have no common factor: dozens of solvers differ.
#: Colours of solvers.
COLOURS = ("#0072B2", "#E69F00", "#56B4E9", "#000000", "#009E73", "#CC79A7", "#7A3B00", "#999933")
#: Dashes of solvers, once the colours are used up; the first has no gaps.
DASHES: tuple[Dashes, ...] = (
    (0, None),
    (0, (3.5, 1.5)),
    (0, (1, 1)),
    (0, (5, 1.5, 1, 1.5)),
    (0, (2, 0.8)),
)
#: The colour of solvers that do not stand out.
GREY = "0.62"
_INFEASIBLE_COLOUR = "#D55E00"
#: Infeasible paths have dashes of these lengths, and then the next number of dots between them.
_INFEASIBLE_DASHES = (6.0, 3.0, 9.0)
#: Up to so many solvers all stand out; of more, so many of the best do, and those that the user names.
MOST_COLOURED, BEST = len(COLOURS), 5


def dashes_of(number: int) -> Dashes:
    """
    Return the dashes that go with a colour: no two numbers share both.

    Examples
    --------
    >>> dashes_of(0), dashes_of(len(COLOURS))
    ((0, None), (0, (3.5, 1.5)))
    """
    turn = number // len(COLOURS)
    # there are more than that only where somebody names as many: a dash, and more and more dots
    return DASHES[turn] if turn < len(DASHES) else (0, (5.0, 1.5, *(1.0, 1.5) * (turn - len(DASHES) + 2)))


@dataclass(frozen=True, eq=False)
class Entry:
    """
    A solver in a picture: the run that is drawn, and how it looks.

    Attributes
    ----------
    label
        What the user called it.
    shown
        The run that is drawn: the median one (see `median_run`), as in tables and the report.
    n_runs, n_found
        How many runs it had, and how many of them found a path.
    look
        The number of its colour, dashes and marker, no other's in this picture; None for one that stays grey.
    """

    label: str
    shown: Run
    n_runs: int
    n_found: int
    look: int | None

    @property
    def path(self) -> FloatArray:
        """What is drawn, shape ``(n, 2)``, map units: a path that may be flown, or an infeasible one; else none."""
        solution = self.shown.solution
        shown = solution.status.has_path or solution.status is Status.INFEASIBLE
        return np.asarray(solution.path if shown else np.empty((0, 2)), dtype=np.float64)

    @property
    def infeasible(self) -> bool:
        """Whether its path may not be flown."""
        return self.shown.solution.status is Status.INFEASIBLE

    @property
    def stands_out(self) -> bool:
        """Whether it has a colour and a line of the legend."""
        return self.look is not None

    @property
    def colour(self) -> str:
        """Its colour; infeasible paths share one."""
        if self.look is None:
            return GREY
        return _INFEASIBLE_COLOUR if self.infeasible else COLOURS[self.look % len(COLOURS)]

    @property
    def dashes(self) -> Dashes:
        """The dashes of its path: none before the colours are used up; infeasible ones all have gaps."""
        look = self.look or 0
        if self.infeasible:
            dots, length = divmod(look, len(_INFEASIBLE_DASHES))
            return 0, (_INFEASIBLE_DASHES[length], 3.0, *(1.0, 2.0) * dots)
        return dashes_of(look)


def entries_of(runs: Sequence[Run], named: Collection[str] = ()) -> list[Entry]:
    """
    Choose how the solvers of a scenario look: the same in each of its pictures.

    Up to `MOST_COLOURED` solvers all stand out. Of more, the `BEST` best with a path do, and those that are named.

    Parameters
    ----------
    runs
        The runs of one scenario, in any order.
    named
        Labels of solvers that stand out in any case.

    Returns
    -------
    entries
        One for each solver, the best first, as in the table (see `summaries`).

    Examples
    --------
    >>> from cgla_graph.comparisons.study.entrant import Entrant
    >>> from cgla_graph.comparisons.study.runner import compare
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> runs = compare([load_scenario("one-threat")], [Entrant.parse("straight-line"), Entrant.parse("cgla")])
    >>> [(entry.label, entry.colour, entry.n_found) for entry in entries_of(list(runs))]
    [('cgla', '#E69F00', 1), ('straight-line', '#0072B2', 1)]
    """
    groups = by_solver(runs)
    ranked = [summary.solver for summary in summaries(runs)]
    shown = {label: median_run(group) for label, group in groups.items()}
    best = [label for label in ranked if shown[label].solution.status.has_path][:BEST]
    chosen = [label for label in groups if len(groups) <= MOST_COLOURED or label in {*best, *named}]
    places = {label: number for number, label in enumerate(groups)}
    looks = dict(zip(chosen, _looks(places[label] for label in chosen), strict=True))
    return [
        Entry(
            label,
            shown[label],
            len(groups[label]),
            sum(run.solution.status.has_path for run in groups[label]),
            looks.get(label),
        )
        for label in ranked
    ]


def _looks(places: Iterable[int]) -> list[int]:
    """Give each the colour of its place among all solvers, as the report does, or the first that is left."""
    looks: list[int] = []
    for place in places:
        wanted = place % len(COLOURS)
        free = (look for look in range(len(looks) + 1) if look not in looks)
        looks.append(wanted if wanted not in looks else next(free))
    return looks


def cost_label(entry: Entry, scale: float) -> str:
    """
    Say in one line of the legend what a solver found.

    That is its label, the cost of the run that is shown (times `scale`) or why there is none, and which of its seeds
    that is.
    """
    solution = entry.shown.solution
    found = figure(solution.cost * scale, 5) if solution.status.has_path else solution.status.label
    return f"{plain(entry.label, 36)}: {found}{seeds_note(entry.n_runs, entry.n_found)}"


def others_label(number: int, what: str = "") -> str:
    """
    Count solvers that share a line of the legend, and say what they have in common.

    Examples
    --------
    >>> others_label(24), others_label(1, "without a path")
    ('24 others', '1 other, without a path')
    """
    return f"{counted(number, 'other')}{what and f', {what}'}"

"""How solvers look in every picture: which run of each is drawn, its colour and its dashes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.runner import Run
from cgla_graph.solution import Status

#: Where matplotlib begins in a pattern of dashes, and the lengths of dashes and gaps in line widths (None: no gaps).
Dashes: TypeAlias = tuple[float, tuple[float, ...] | None]

# Okabe and Ito's palette with brown and olive instead of yellow (faint on white) and vermilion (kept for infeasible
# paths). The numbers of colours, dashes and markers (of plot_trace) have no common factor: dozens of solvers differ.
#: Colours of solvers: number `i` has the one at `i` modulo how many there are.
COLOURS = ("#0072B2", "#E69F00", "#56B4E9", "#000000", "#009E73", "#CC79A7", "#7A3B00", "#999933")
#: Dashes of solvers, in the same way; the first has no gaps.
DASHES: tuple[Dashes, ...] = (
    (0, None),
    (0, (3.5, 1.5)),
    (0, (1, 1)),
    (0, (5, 1.5, 1, 1.5)),
    (0, (2, 0.8)),
)
_INFEASIBLE_COLOUR = "#D55E00"
_INFEASIBLE_DASHES: tuple[Dashes, ...] = ((0, (6, 3)), (0, (3, 3)), (0, (9, 3, 2, 3)))


@dataclass(frozen=True, eq=False)
class Entry:
    """
    A solver in a picture: its best run, and its number, from which colour and dashes follow in every picture.

    Attributes
    ----------
    number
        Its place among the solvers, from 0.
    label
        What the user called it.
    best
        The run that is drawn.
    n_runs, n_found
        How many runs it had, and how many of them found a path.
    """

    number: int
    label: str
    best: Run
    n_runs: int
    n_found: int

    @property
    def path(self) -> FloatArray:
        """What is drawn, shape ``(n, 2)``, map units: a path that may be flown, or an infeasible one; else none."""
        solution = self.best.solution
        shown = solution.status.is_path or solution.status is Status.INFEASIBLE
        return np.asarray(solution.path if shown else np.empty((0, 2)), dtype=np.float64)

    @property
    def infeasible(self) -> bool:
        """Whether its best path may not be flown."""
        return self.best.solution.status is Status.INFEASIBLE

    @property
    def colour(self) -> str:
        """Its colour; infeasible paths share one."""
        return _INFEASIBLE_COLOUR if self.infeasible else COLOURS[self.number % len(COLOURS)]

    @property
    def dashes(self) -> Dashes:
        """The dashes of its path; infeasible ones all have gaps."""
        dashes = _INFEASIBLE_DASHES if self.infeasible else DASHES
        return dashes[self.number % len(dashes)]

    def covers(self, other: "Entry") -> bool:
        """Whether the two paths run one over the other, so that their widths must differ."""
        both_exact = self.best.exact and other.best.exact
        return both_exact or (self.path.shape == other.path.shape and bool(np.allclose(self.path, other.path)))


def entries_of(runs: Sequence[Run]) -> list[Entry]:
    """
    Take each solver's best run: a path before an infeasible one before none, then the least cost.

    Parameters
    ----------
    runs
        The runs of one scenario, in any order.

    Returns
    -------
    entries
        One for each solver, in the order of their first runs.

    Examples
    --------
    >>> from cgla_graph.comparisons.contender import Contender
    >>> from cgla_graph.comparisons.runner import compare
    >>> from cgla_graph.scenario import load_scenario
    >>> runs = compare([load_scenario("one-threat")], [Contender.parse("cgla"), Contender.parse("straight-line")])
    >>> [(entry.label, entry.colour, entry.n_found) for entry in entries_of(list(runs))]
    [('cgla', '#0072B2', 1), ('straight-line', '#E69F00', 1)]
    """
    groups: dict[str, list[Run]] = {}
    for run in runs:
        groups.setdefault(run.solver, []).append(run)
    return [
        Entry(number, label, min(group, key=_rank), len(group), sum(run.solution.status.is_path for run in group))
        for number, (label, group) in enumerate(groups.items())
    ]


def _rank(run: Run) -> tuple[bool, bool, float]:
    solution = run.solution
    return not solution.status.is_path, solution.status is not Status.INFEASIBLE, solution.cost

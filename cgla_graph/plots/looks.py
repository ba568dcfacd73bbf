"""The look of paths in pictures: colours and dashes, which ones stand out, and their rows in a legend."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cgla_graph._text import counted, figure
from cgla_graph._types import FloatArray
from cgla_graph.model.solution import Solution, Status
from cgla_graph.plots.page import plain
from cgla_graph.plots.standing_out import standing_out

#: Offset into a pattern of dashes, and the lengths of dashes and gaps in line widths (None: no gaps).
Dashes: TypeAlias = tuple[float, tuple[float, ...] | None]

# Okabe and Ito's palette with brown and olive instead of yellow (faint on white) and vermilion (kept for infeasible
# paths). The numbers of colours, dashes and markers (of costs over time) have no common factor: dozens of paths differ.
#: Colours of paths.
COLOURS = ("#0072B2", "#E69F00", "#56B4E9", "#000000", "#009E73", "#CC79A7", "#7A3B00", "#999933")
#: Dashes of paths, once the colours are used up; the first has no gaps.
DASHES: tuple[Dashes, ...] = (
    (0, None),
    (0, (3.5, 1.5)),
    (0, (1, 1)),
    (0, (5, 1.5, 1, 1.5)),
    (0, (2, 0.8)),
)
#: The colour of paths that do not stand out.
GREY = "0.62"
_INFEASIBLE_COLOUR = "#D55E00"
#: Infeasible paths have dashes of these lengths; further ones have more and more dots between the dashes.
_INFEASIBLE_DASHES = (6.0, 3.0, 9.0)


def dashes_of(number: int) -> Dashes:
    """
    Return the dashes of a number; no two numbers share both dashes and colour.

    Examples
    --------
    >>> dashes_of(0), dashes_of(len(COLOURS))
    ((0, None), (0, (3.5, 1.5)))
    """
    turn = number // len(COLOURS)
    # for more paths than that: a dash, and more and more dots
    return DASHES[turn] if turn < len(DASHES) else (0, (5.0, 1.5, *(1.0, 1.5) * (turn - len(DASHES) + 2)))


@dataclass(frozen=True, eq=False)
class LabelledPath:
    """
    A path in a picture: its label, its solution, and how it looks.

    Attributes
    ----------
    label
        The name that the user gave it.
    solution
        The path and its cost, or why there is none.
    look
        The number of its colour, dashes and marker, unique in the picture; None for a grey path.
    note
        Text after the cost in the legend; may be empty.
    """

    label: str
    solution: Solution
    look: int | None = 0
    note: str = ""

    @property
    def path(self) -> FloatArray:
        """The waypoints, shape ``(n, 2)``, map units; none where no path is known, not even an infeasible one."""
        known = self.solution.status.has_path or self.infeasible
        return np.asarray(self.solution.path if known else np.empty((0, 2)), dtype=np.float64)

    @property
    def places(self) -> FloatArray:
        """The places that a tour visits, shape ``(n, 2)``, map units; none for other paths."""
        return np.asarray(getattr(self.solution, "places", np.empty((0, 2))), dtype=np.float64)

    @property
    def infeasible(self) -> bool:
        """Whether the path is infeasible."""
        return self.solution.status is Status.INFEASIBLE

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
        """Its dashes: none before the colours are used up; infeasible ones all have gaps."""
        look = self.look or 0
        if self.infeasible:
            dots, length = divmod(look, len(_INFEASIBLE_DASHES))
            return 0, (_INFEASIBLE_DASHES[length], 3.0, *(1.0, 2.0) * dots)
        return dashes_of(look)

    def row(self, scale: float) -> str:
        """Return its row of the legend: label, cost (times `scale`) or status, and the note."""
        known = self.solution.status.has_path
        found = figure(self.solution.cost * scale, 5) if known else self.solution.status.label
        return f"{plain(self.label, 36)}: {found}{self.note}"


def labelled_paths(
    solutions: Mapping[str, Solution],
    ranked: Sequence[str] | None = None,
    named: Collection[str] = (),
    notes: Mapping[str, str] | None = None,
) -> list[LabelledPath]:
    """
    Choose how paths look: the same in each picture of them.

    Parameters
    ----------
    solutions
        By label; their order chooses the colours.
    ranked
        The labels, the best first; None: by cost.
    named
        Labels of those that are always in colour (see `standing_out`).
    notes
        Texts after the costs in the legend, by label.

    Returns
    -------
    paths
        The best first.

    Examples
    --------
    >>> costly, cheap = (Solution(Status.FOUND, cost=cost) for cost in (2.0, 1.0))
    >>> [(path.label, path.colour) for path in labelled_paths({"a": costly, "b": cheap})]
    [('b', '#E69F00'), ('a', '#0072B2')]
    """
    if ranked is None:
        ranked = sorted(solutions, key=lambda one: (not solutions[one].status.has_path, solutions[one].cost))
    best = [label for label in ranked if solutions[label].status.has_path]
    coloured = {*standing_out({label: solutions[label].solver for label in ranked}, best), *named}
    chosen = [label for label in solutions if label in coloured]
    places = {label: number for number, label in enumerate(solutions)}
    looks = dict(zip(chosen, _looks(places[label] for label in chosen), strict=True))
    return [LabelledPath(one, solutions[one], looks.get(one), (notes or {}).get(one, "")) for one in ranked]


def _looks(places: Iterable[int]) -> list[int]:
    """Give each path the colour of its place among all, as the report does, or the first free one."""
    looks: list[int] = []
    for place in places:
        wanted = place % len(COLOURS)
        free = (look for look in range(len(looks) + 1) if look not in looks)
        looks.append(wanted if wanted not in looks else next(free))
    return looks


def others_label(number: int, what: str = "") -> str:
    """
    Return the label of a line of the legend for several paths, with their common property.

    Examples
    --------
    >>> others_label(24), others_label(1, "without a path")
    ('24 others', '1 other, without a path')
    """
    return f"{counted(number, 'other')}{what and f', {what}'}"

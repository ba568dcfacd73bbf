"""The paper's figures and tables, remade, and some of ours: what each is, and where it is drawn or reckoned."""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

from cgla_graph.comparisons.claims.claim import Table
from cgla_graph.comparisons.claims.evidence import Evidence

#: Modules with artefacts.
MODULES = ("single_figures", "team_figures", "paper_tables", "panel_figure")


@dataclass(frozen=True)
class Picture:
    """
    A drawn figure.

    Attributes
    ----------
    caption
        What is to be seen, what is the paper's and what ours, in a few sentences.
    png, svg
        The picture, as files hold it.
    """

    caption: str
    png: bytes
    svg: bytes


@dataclass(frozen=True)
class TableRow:
    """
    One number of the paper's table, and what we have to put beside it.

    Attributes
    ----------
    label, quantity
        Whose number it is, and what: ``CGLA, K = 10``, ``risk sum``.
    paper
        The printed value.
    offline, online
        Ours, with the whole map known, and flown with limited sensing; None where there is none, as always where the
        two are not comparable and would mislead.
    comparable
        Whether the paper's value and ours measure the same.
    why
        Why, or why not.
    """

    label: str
    quantity: str
    paper: float
    offline: float | None
    online: float | None
    comparable: bool
    why: str


@dataclass(frozen=True)
class Comparison:
    """
    A table, remade.

    Attributes
    ----------
    caption
        What is compared, what is the paper's and what ours.
    rows
        Its rows; none where the paper has no such table.
    tables
        Of our own numbers, below it, each under a head that says whose they are.
    """

    caption: str
    rows: Sequence[TableRow] = ()
    tables: Sequence[Table] = ()


#: What an artefact is.
Content: TypeAlias = Picture | Comparison
#: What makes it; with experiments, from the evidence.
Make: TypeAlias = Callable[[], Content] | Callable[[Evidence], Content]


@dataclass(frozen=True)
class Artefact:
    """
    A figure or table of the paper, or one of ours.

    Attributes
    ----------
    label
        As the paper calls it: ``Fig. 5``, ``Table 1``. Ours, which the paper does not have, are ``Fig. A1`` and so on.
    title
        What it shows, in our words.
    make
        Draws it, or fills it, without random numbers; where it has experiments, it takes the `Evidence`.
    experiments
        Names of the experiments whose samples it shows (see `experiment`).
    """

    label: str
    title: str
    make: Callable[..., Content]
    experiments: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The file name without ending: ``fig-5``, ``table-1``."""
        return self.label.lower().replace(". ", "-").replace(" ", "-")

    @property
    def is_ours(self) -> bool:
        """
        Whether the paper has no such figure or table.

        Examples
        --------
        >>> Artefact("Fig. A1", "curves", lambda: Comparison("none")).is_ours
        True
        """
        return self.label.split()[-1].startswith("A")

    def made_from(self, evidence: Evidence) -> Content:
        """Make it from the samples of its experiments."""
        return self.make(evidence) if self.experiments else self.make()


def artefact(label: str, title: str, *, experiments: tuple[str, ...] = ()) -> Callable[[Make], Artefact]:
    """
    Make an artefact of what makes it, which stands below; what is given is as of `Artefact`.

    Examples
    --------
    >>> artefact("Fig. 5", "routes for K = 10, 50 and 200")(lambda: Picture("nothing", b"", b"")).name
    'fig-5'
    """
    return lambda make: Artefact(label, title, make, experiments)


@cache
def artefacts() -> Sequence[Artefact]:
    """
    Return all artefacts: the figures in the order of the paper, ours after them, then the tables likewise.

    Examples
    --------
    >>> [artefact.label for artefact in artefacts()][::8][:2]
    ['Fig. 1', 'Fig. 9']
    """
    modules = [importlib.import_module(f"cgla_graph.comparisons.claims.figures.{name}") for name in MODULES]
    found = [one for module in modules for one in vars(module).values() if isinstance(one, Artefact)]
    return sorted(found, key=_order)


def _order(one: Artefact) -> tuple[bool, bool, int]:
    return one.label.startswith("Table"), one.is_ours, int(one.label.split()[-1].removeprefix("A"))

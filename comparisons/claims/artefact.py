"""The paper's figures and tables, remade: what each is, and where it is drawn or reckoned."""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

#: Modules with artefacts.
MODULES = ("single_figures", "team_figures", "paper_tables")


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
        Its rows.
    """

    caption: str
    rows: Sequence[TableRow]


@dataclass(frozen=True)
class Artefact:
    """
    A figure or table of the paper.

    Attributes
    ----------
    label
        As the paper calls it: ``Fig. 5``, ``Table 1``.
    title
        What it shows, in our words.
    make
        Draws it, or fills it, without random numbers.
    """

    label: str
    title: str
    make: "Make"

    @property
    def name(self) -> str:
        """The file name without ending: ``fig-5``, ``table-1``."""
        return self.label.lower().replace(". ", "-").replace(" ", "-")


#: What makes an artefact.
Make: TypeAlias = Callable[[], Picture | Comparison]


def artefact(label: str, title: str) -> Callable[[Make], Artefact]:
    """
    Make an artefact of what makes it, which stands below; what is given is as of `Artefact`.

    Examples
    --------
    >>> artefact("Fig. 5", "routes for K = 10, 50 and 200")(lambda: Picture("nothing", b"", b"")).name
    'fig-5'
    """
    return lambda make: Artefact(label, title, make)


@cache
def artefacts() -> Sequence[Artefact]:
    """
    Return all artefacts: the figures in the order of the paper, then the tables.

    Examples
    --------
    >>> [artefact.label for artefact in artefacts()][::8]
    ['Fig. 1', 'Fig. 9', 'Table 5']
    """
    modules = [importlib.import_module(f"cgla_graph.comparisons.claims.paper.{name}") for name in MODULES]
    found = [one for module in modules for one in vars(module).values() if isinstance(one, Artefact)]
    return sorted(found, key=lambda one: (one.label.startswith("Table"), int(one.label.split()[-1])))

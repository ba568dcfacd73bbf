"""The paper's figures and tables, remade, and some of ours: what each is, and where it is drawn or reckoned."""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

from cgla_graph.comparisons.claims.claim import Table

#: Modules with artefacts.
MODULES = ("single_figures", "team_figures", "paper_tables", "panel_figure")


@dataclass(frozen=True)
class Content:
    """
    What a figure or table shows.

    Attributes
    ----------
    caption
        What is to be seen, what is the paper's and what ours, in a few sentences.
    png, svg
        The picture, as files hold it; empty of a table.
    table
        The table; None of a picture.
    """

    caption: str
    png: bytes = b""
    svg: bytes = b""
    table: Table | None = None


#: What makes it; with experiments, of the evidence.
Make: TypeAlias = Callable[..., Content]


@dataclass(frozen=True)
class Artefact:
    """
    A figure or table of the paper, or one of ours.

    Attributes
    ----------
    label, title
        As the paper calls it (``Fig. 5``; ours are ``Fig. A1`` and so on), and what it shows, in our words.
    make
        Draws it, or fills it, without random numbers; where it has experiments, it takes the `Evidence`.
    experiments
        Names of the experiments whose samples it shows (see `experiment`).
    """

    label: str
    title: str
    make: Make
    experiments: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The file name without ending: ``fig-5``, ``table-1``."""
        return self.label.lower().replace(". ", "-").replace(" ", "-")


def artefact(label: str, title: str, *, experiments: tuple[str, ...] = ()) -> Callable[[Make], Artefact]:
    """Make an artefact of what makes it, which stands below; what is given is as of `Artefact`."""
    return lambda make: Artefact(label, title, make, experiments)


@cache
def artefacts() -> Sequence[Artefact]:
    """
    Return all artefacts: the figures in the order of the paper, ours after them, then the tables.

    Examples
    --------
    >>> [artefact.label for artefact in artefacts()][::8][:2]
    ['Fig. 1', 'Fig. 9']
    """
    modules = [importlib.import_module(f"cgla_graph.comparisons.claims.figures.{name}") for name in MODULES]
    found = [one for module in modules for one in vars(module).values() if isinstance(one, Artefact)]
    return sorted(found, key=_order)


def _order(one: Artefact) -> tuple[bool, bool, int]:
    number = one.label.split()[-1]
    return one.label.startswith("Table"), number.startswith("A"), int(number.removeprefix("A"))

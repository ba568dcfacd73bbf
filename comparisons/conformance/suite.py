"""Stored instances of the suite: problems, proven bounds of their optima, and paths."""

import difflib
from collections.abc import Sequence
from functools import cache
from importlib import resources
from typing import Literal

from pydantic import Field

from cgla_graph._text import shown
from cgla_graph.comparisons.conformance.documents import VERSION, Document, Pair, ProblemDocument
from cgla_graph.errors import ScenarioError

#: The file in this package, and the greatest relative distance of its bounds.
FILE, WIDEST = "instances.json", 0.005


class Instance(Document):
    """
    A problem with proven bounds of its optimum.

    Examples
    --------
    >>> one = chosen(["walls-corner"])[0]
    >>> one.lower_bound < one.upper_bound == one.problem.build().evaluate(one.path).cost
    True
    """

    family: str
    title: str
    problem: ProblemDocument
    lower_bound: float | None = Field(description="no path costs less; null: it is proven that there is no path")
    upper_bound: float | None = Field(description="cost of the best known path; null where there is none")
    path: list[Pair] | None = Field(description="that path")

    def __repr__(self) -> str:
        """Return a short form: the problem and the path would fill pages."""
        return f"Instance({self.name!r})"

    @property
    def name(self) -> str:
        """The name of its problem."""
        return self.problem.name

    @property
    def has_path(self) -> bool:
        """Whether there is a path; both are proven."""
        return self.path is not None


class Suite(Document):
    """All instances."""

    version: Literal[1] = VERSION
    instances: list[Instance]


@cache
def suite() -> Sequence[Instance]:
    """
    Load all instances.

    Examples
    --------
    >>> len(suite())
    40
    """
    text = resources.files(__package__).joinpath(FILE).read_text(encoding="utf-8")
    return tuple(Suite.model_validate_json(text).instances)


def chosen(names: Sequence[str] = ()) -> list[Instance]:
    """
    Choose instances by their names or families; all by default.

    Raises
    ------
    ScenarioError
        If no instance has that name; the message offers similar names.

    Examples
    --------
    >>> [one.name for one in chosen(["walls-corner", "infeasible"])][:2]
    ['walls-corner', 'infeasible-wall']
    """
    known = {one.name for one in suite()} | {one.family for one in suite()}
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, sorted(known), n=3)
            hint = f"did you mean {', '.join(near)}?" if near else "cgla conform --list shows them"
            msg = f"there is no instance {shown(name)}; {hint}"
            raise ScenarioError(msg)
    return [one for one in suite() if not names or {one.name, one.family} & set(names)]

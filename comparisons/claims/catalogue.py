"""All claims, by id. A new claim is an entry of its topic's ``CLAIMS``; a new topic is a module and a row here."""

import importlib
from collections.abc import Mapping, Sequence
from functools import cache

from cgla_graph.comparisons.claims.claim import Claim
from cgla_graph.comparisons.claims.experiment import Experiment
from cgla_graph.errors import ClaimError

#: Modules with ``CLAIMS``, and those with ``EXPERIMENTS``.
TOPICS = (
    "field_claims",
    "matrix_claims",
    "convergence_claims",
    "complexity_claims",
    "learning_claims",
    "single_claims",
    "planner_claims",
    "team_claims",
)
EXPERIMENTS = (
    "single_experiments",
    "planner_experiments",
    "team_experiments",
)
_PACKAGE = "cgla_graph.comparisons.claims.paper"


@cache
def claims() -> Mapping[str, Claim]:
    """
    Return all claims by id, in the order of their numbers.

    Examples
    --------
    >>> len(claims()), claims()["C28"].place
    (54, 'Section 5.1')
    """
    found = [claim for topic in TOPICS for claim in importlib.import_module(f"{_PACKAGE}.{topic}").CLAIMS]
    return {claim.id: claim for claim in sorted(found, key=lambda claim: claim.number)}


@cache
def experiments() -> Mapping[str, Experiment]:
    """
    Return all experiments by name.

    Examples
    --------
    >>> "online-k" in experiments()
    True
    """
    found = [one for module in EXPERIMENTS for one in importlib.import_module(f"{_PACKAGE}.{module}").EXPERIMENTS]
    return {one.name: one for one in found}


def chosen(ids: Sequence[str]) -> list[Claim]:
    """
    Return the claims of some ids, in the order of their numbers; without ids all.

    Parameters
    ----------
    ids
        As ``C28`` or ``28``, in any case; ``C17-C19`` is a range.

    Raises
    ------
    ClaimError
        If there is no such claim.

    Examples
    --------
    >>> [claim.id for claim in chosen(["c28", "1-2"])]
    ['C1', 'C2', 'C28']
    """
    if not ids:
        return list(claims().values())
    numbers: set[int] = set()
    for text in ids:
        first, dash, last = text.partition("-")
        low = _number(first, text)
        numbers.update(range(low, (_number(last, text) if dash else low) + 1))
    return [claim for claim in claims().values() if claim.number in numbers]


def _number(text: str, given: str) -> int:
    digits = text.strip().removeprefix("C").removeprefix("c")
    known = {claim.number for claim in claims().values()}
    if not (digits.isascii() and digits.isdigit() and int(digits) in known):
        msg = f"no claim {given!r}; there are C1 to C{max(known)} (as C28, or C17-C19 for a range)"
        raise ClaimError(msg)
    return int(digits)

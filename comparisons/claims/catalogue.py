"""All claims, by id. A new claim is a check in the module of its topic; a new topic is a module and a row here."""

import importlib
from collections.abc import Iterator, Mapping, Sequence
from functools import cache

from cgla_graph.comparisons.claims.claim import Claim
from cgla_graph.comparisons.claims.experiment import Experiment
from cgla_graph.errors import ClaimError

#: Modules with claims and experiments.
TOPICS = (
    "field_claims",
    "matrix_claims",
    "path_claims",
    "convergence_claims",
    "complexity_claims",
    "time_claims",
    "learning_claims",
    "direction_claims",
    "weight_claims",
    "sudden_claims",
    "resolution_claims",
    "printed_claims",
    "planner_claims",
    "bcv_claims",
    "introduction_claims",
    "obstacle_claims",
    "sharing_claims",
    "one_matrix_claims",
    "sweeps",
)
PACKAGE = "cgla_graph.comparisons.claims.paper"


def _found() -> Iterator[object]:
    """List what the modules of all topics define."""
    for topic in TOPICS:
        yield from vars(importlib.import_module(f"{PACKAGE}.{topic}")).values()


@cache
def claims() -> Mapping[str, Claim]:
    """
    Return all claims by id, in the order of their numbers.

    Examples
    --------
    >>> len(claims()), claims()["C28"].place
    (54, 'Section 5.1')
    """
    found = [one for one in _found() if isinstance(one, Claim)]
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
    return {one.name: one for one in _found() if isinstance(one, Experiment)}


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

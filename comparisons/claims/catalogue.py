"""All claims, by number. A new claim is a check in the module of its topic; a new topic is a module and a row here."""

import difflib
import importlib
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache

from cgla_graph._text import shown
from cgla_graph.comparisons.claims.claim import Claim
from cgla_graph.comparisons.claims.experiment import Experiment
from cgla_graph.errors import ClaimError

PACKAGE = "cgla_graph.comparisons.claims.paper"
#: Modules with claims and experiments, in the order of the page, with their titles.
TOPICS: Mapping[str, str] = {
    "direction_claims": "Eight directions",
    "bcv_claims": "BCV",
    "weight_claims": "The risk weight K",
    "matrix_claims": "The cost matrix",
    "path_claims": "Paths of the cost matrix",
    "sharing_claims": "Several UAVs",
    "obstacle_claims": "Several UAVs",
    "arrival_claims": "Arriving",
    "sudden_claims": "Sudden threats",
    "rival_claims": "A2D and Q-Learning",
    "learning_claims": "A2D and Q-Learning",
    "complexity_claims": "Complexity and time",
    "resolution_claims": "Size of the lattice",
    "model_claims": "The model of risk",
    "introduction_claims": "Remarks of the introduction",
}
#: Modules with experiments only.
TABLES = tuple(
    f"cgla_graph.comparisons.claims.panel.{name}"
    for name in (
        *("single_uav", "learners", "resolution", "arrivals", "sudden"),
        *("complexity", "teams", "one_matrix", "company", "introduction"),
    )
)
#: Claims without weight, which are not checked, and why.
LEFT_OUT: Mapping[int, str] = {
    27: "it says only that the method is new",
    31: "it is a table of numbers without units, which C32 to C35 read",
    43: "it describes how the method is defined",
    47: "a finer lattice takes more time by C20",
    49: "it describes how the method is defined",
    51: "it follows from C17 and C22",
    52: "the table that it speaks of has no row of Q-Learning",
    54: "it is part of the reasons given for C17 and C19",
}


def _found() -> Iterator[tuple[str, object]]:
    """List what the modules of all topics define, with their topics."""
    for topic, title in TOPICS.items():
        yield from ((title, one) for one in vars(importlib.import_module(f"{PACKAGE}.{topic}")).values())
    for module in TABLES:
        yield from (("", one) for one in vars(importlib.import_module(module)).values())


@cache
def topics() -> Mapping[str, Sequence[Claim]]:
    """Return the claims of each topic, in the order of the page."""
    found: dict[str, dict[int, Claim]] = {}
    for title, one in _found():
        if isinstance(one, Claim):
            found.setdefault(title, {})[one.number] = one
    return {title: [of[number] for number in sorted(of)] for title, of in found.items()}


@cache
def claims() -> Mapping[str, Claim]:
    """
    Return all claims by id, in the order of their numbers.

    Examples
    --------
    >>> claims()["C32"].place
    'Section 5.1'
    """
    found = [claim for of in topics().values() for claim in of]
    return {claim.id: claim for claim in sorted(found, key=lambda claim: claim.number)}


@cache
def experiments() -> Mapping[str, Experiment]:
    """Return all experiments by name."""
    return {one.name: one for _, one in _found() if isinstance(one, Experiment)}


def _remark(number: int) -> str:
    """Say of a number that is no claim of its own where it went; empty of one that is."""
    for claim in claims().values():
        if number in claim.merged:
            return f"C{number} is part of {claim.id}"
    return f"C{number} is left out: {LEFT_OUT[number]}" if number in LEFT_OUT else ""


def remarks(ids: Sequence[str]) -> list[str]:
    """
    Say of ids (no ranges, no topics) where those went that are no claims of their own.

    Examples
    --------
    >>> remarks(["C29", "C32", "C1-C30"])
    ['C29 is part of C28']
    """
    names = {topic_name(title) for title in topics()}
    numbers = [text for text in ids if "-" not in text and text.strip().lower() not in names]
    return list(filter(None, [_remark(_number(text, text)) for text in numbers]))


def topic_name(title: str) -> str:
    """
    Return the name by which a topic is asked for.

    Examples
    --------
    >>> topic_name("The risk weight K"), topic_name("A2D and Q-Learning")
    ('risk-weight-k', 'a2d-and-q-learning')
    """
    return re.sub(r"[^a-z0-9]+", "-", title.lower().removeprefix("the ")).strip("-")


def chosen(ids: Sequence[str]) -> list[Claim]:
    """
    Return the claims of some ids or topics, in the order of their numbers; without ids all.

    A topic is a name as of `topic_name`. An id is ``C28`` or ``28``, in any case, and ``C17-C19`` is a range. A number
    that is part of another claim stands for that one; in a range, numbers that are left out are passed over.

    Raises
    ------
    ClaimError
        If there is no such claim, or it is left out.

    Examples
    --------
    >>> [claim.id for claim in chosen(["c32"])]
    ['C32']
    """
    if not ids:
        return list(claims().values())
    wanted = {number: one for one in claims().values() for number in (one.number, *one.merged)}
    kept: set[str] = set()
    by_topic = {topic_name(title): of for title, of in topics().items()}
    for text in ids:
        if text.strip().lower() in by_topic:
            kept |= {claim.id for claim in by_topic[text.strip().lower()]}
            continue
        first, dash, last = text.partition("-")
        low = _number(first, text)
        numbers = range(low, (_number(last, text) if dash else low) + 1)
        if not dash and low in LEFT_OUT:
            raise ClaimError(_remark(low))
        kept |= {wanted[number].id for number in numbers if number in wanted}
    return [claim for claim in claims().values() if claim.id in kept]


def _near(given: str, topics_: Sequence[str]) -> str:
    """Suggest topics like what was given, by their names or by a word of them."""
    word = topic_name(given[:60])
    found = [name for name in topics_ if word and word in name.split("-")]
    found += difflib.get_close_matches(word, topics_, n=3, cutoff=0.5)
    return f"did you mean {' or '.join(dict.fromkeys(found))}?" if found else ""


def _number(text: str, given: str) -> int:
    digits = text.strip().removeprefix("C").removeprefix("c")
    known = {number for claim in claims().values() for number in (claim.number, *claim.merged)} | LEFT_OUT.keys()
    if not (digits.isascii() and digits.isdigit() and int(digits) in known):
        names = [topic_name(title) for title in topics()]
        there_are = _near(given, names) or f"topics: {', '.join(names)}"
        msg = f"no claim {shown(given)}; {there_are}; claims: C1 to C{max(known)} (as C28, or C17-C19 for a range)"
        raise ClaimError(msg)
    return int(digits)

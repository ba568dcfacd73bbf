"""The first page: what users ask, in their order, and the rows that answer it."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, TypeAlias

from cgla_graph.comparisons.claims.claim import Answer, Table


class Part(NamedTuple):
    """A row that answers a part of a question: the part in a word (or nothing), a claim's id, and its statement."""

    name: str
    claim: str
    statement: str


class Headline(NamedTuple):
    """A question with the parts of its answer."""

    question: str
    parts: tuple[Part, ...]


def _bcv(objective: str) -> tuple[Part, ...]:
    statements = (("risk", "less risk"), ("length", "shorter"), ("cost", "less cost"))
    return tuple(Part(name, "C32", f"{words} than BCV-style ({objective})") for name, words in statements)


#: The questions, in the order in which users ask them.
HEADLINES: tuple[Headline, ...] = (
    Headline(
        "Do eight directions make a path longer, dearer, riskier?",
        tuple(Part(name, "C26", f"{name}: greater, all known") for name in ("length", "cost", "risk")),
    ),
    Headline("Has CGLA less risk, length, cost than BCV-style, which minimises length?", _bcv("length only")),
    Headline("The same, if BCV-style is averse to risk?", _bcv("risk-averse")),
)
#: Those that the toolkit was made for, shown in the README.
MADE_FOR = HEADLINES[:2]
#: How answers are written here.
_WORDS = {Answer.HOLDS.label: "yes", Answer.FAILS.label: "no"}
#: Rows of a document, by claim and statement.
Rows: TypeAlias = dict[tuple[str, str], Mapping[str, Any]]


def rows_of(document: Mapping[str, Any]) -> Rows:
    """Return the rows of a document (as of `page.results_document`) by claim and statement."""
    return {(claim["id"], row["statement"]): row for claim in document["claims"] for row in claim["rows"]}


def unanswered(document: Mapping[str, Any], asked: Iterable[Headline] = HEADLINES) -> list[tuple[str, str]]:
    """List the claims and statements that questions name and that a document has no row for."""
    rows = rows_of(document)
    return [part[1:] for one in asked for part in one.parts if part[1:] not in rows]


def headline_table(document: Mapping[str, Any], asked: Iterable[Headline] = HEADLINES) -> Table:
    """
    Tabulate the answers to the questions that a document (as of `page.results_document`) has all rows for.

    Examples
    --------
    >>> row = {"statement": "shorter", "answer": "holds", "where": "", "size": "x 0.9 (0.8 to 1)"}
    >>> asked = [Headline("Is it shorter?", (Part("length", "C1", "shorter"),))]
    >>> headline_table({"claims": [{"id": "C1", "rows": [row]}]}, asked).rows
    [('Is it shorter? (C1)', 'yes', 'length x 0.9 (0.8 to 1)')]
    """
    rows = rows_of(document)
    found = [_answered(one, rows) for one in asked if not unanswered(document, [one])]
    return Table("", ("question", "answer", "size"), found)


def _answered(headline: Headline, rows: Rows) -> tuple[str, str, str]:
    """Put parts together that have the same answer under the same condition."""
    parts = {part: rows[part[1:]] for part in headline.parts}
    names: dict[str, list[str]] = {}
    for part, row in parts.items():
        answer = _WORDS.get(row["answer"], row["answer"])
        names.setdefault(": ".join(filter(None, [answer, row["where"]])), []).append(part.name)
    answers = [answer if len(names) == 1 else f"{', '.join(of)}: {answer}" for answer, of in names.items()]
    sizes = [f"{part.name} {row['size']}".strip() for part, row in parts.items() if row["size"]]
    claims = ", ".join(dict.fromkeys(part.claim for part in headline.parts))
    return f"{headline.question} ({claims})", "; ".join(answers), "; ".join(sizes)

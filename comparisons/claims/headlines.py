"""The first page: what users ask, in their order, and the rows that answer it."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, TypeAlias

from cgla_graph.comparisons.claims.claim import Answer, Basis, Table


class Part(NamedTuple):
    """A row that answers a part of a question: the part in a word (or nothing), a claim's id, and its statement."""

    name: str
    claim: str
    statement: str


class Headline(NamedTuple):
    """A question with the parts of its answer."""

    question: str
    parts: tuple[Part, ...]


def _bcv(objective: str, words: str) -> tuple[Part, ...]:
    statements = (("risk", "less risk"), ("length", "shorter"), ("cost", "less cost"))
    return tuple(Part(name + words, "C32", f"{text} ({objective})") for name, text in statements)


#: The questions, in the order in which users ask them.
HEADLINES: tuple[Headline, ...] = (
    Headline(
        "Theorem 1: does G converge, and is the path optimal?",
        (Part("G", "C11", "G converges, and settled values stay"), Part("path", "C14", "no path has a lower J")),
    ),
    Headline(
        "Do eight directions make a path longer, dearer, riskier?",
        tuple(Part(name, "C26", f"{name}: greater, all known") for name in ("length", "cost", "risk")),
    ),
    Headline(
        "Has CGLA less risk, length and cost than BCV-style, which minimises length, or is averse to risk as well?",
        (*_bcv("length only", ""), *_bcv("risk-averse", " if averse")),
    ),
    Headline(
        "Does K = 200 take less risk than K = 10?",
        (
            Part("all known", "C28", "never more risk, never shorter, with all known"),
            Part("in flight", "C28", "less risk in flight, K = 200 against 10"),
        ),
    ),
    Headline(
        "Does sharing save risk and length?", (Part("risk", "C42", "less risk"), Part("length", "C42", "shorter"))
    ),
    Headline(
        "Do virtual obstacles prevent collisions?",
        (
            Part("all of them", "C41", "virtual obstacles always prevent collisions"),
            Part("some", "C41", "fewer collide with virtual obstacles"),
        ),
    ),
    Headline(
        "Does a flight take N^4 to N^5 operations?",
        tuple(
            Part(f"plans {when}", "C22", f"between N^4 and N^5, planning {when}")
            for when in ("on every move", "when something is seen")
        ),
    ),
    Headline("Is CGLA faster than Q-Learning?", (Part("", "C36", "CGLA takes less time than Q-Learning"),)),
    Headline(
        "Are paths for N = 15, 20, 25 nearly the same?",
        tuple(Part(mode, "C46", f"nearly the same on > 95% of maps, {mode}") for mode in ("all known", "in flight")),
    ),
    Headline("Does a UAV always arrive?", (Part("", "C17", "arrives"),)),
)
#: Those that the toolkit was made for, shown in the README.
MADE_FOR = HEADLINES[1:3]
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
        answer = _WORDS.get(row["answer"], str(row["answer"]))
        where = _first(row) if row.get("basis") == Basis.PANEL.label else row["where"]
        names.setdefault(f"{answer} ({where})" if where else answer, []).append(part.name)
    answers = [answer if len(names) == 1 else f"{', '.join(of)}: {answer}" for answer, of in names.items()]
    sizes = [(part.name, row["size"].rpartition(")")) for part, row in parts.items() if row["size"]]
    units = {size[-1] for _, size in sizes}
    # of one unit, it is said once
    unit = units.pop() if len(units) == 1 and all(size[0] for _, size in sizes) else ""
    said = "; ".join(f"{name} {''.join(size).removesuffix(unit)}".strip() for name, size in sizes) + unit
    claims = ", ".join(dict.fromkeys(part.claim for part in headline.parts))
    return f"{headline.question} ({claims})", "; ".join(answers), said


def _first(row: Mapping[str, Any]) -> str:
    """Leave the first exception that a row of the panel names; the row itself has all."""
    first, more, _ = str(row["where"]).partition("; ")
    return f"{first} …" if more else first

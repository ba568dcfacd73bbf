"""A statement of the paper as data, and the answers that its check finds."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeAlias

from cgla_graph.comparisons.claims.evidence import Evidence


class Answer(Enum):
    """
    What is known of one statement.

    Examples
    --------
    >>> Answer.NOT_TESTABLE.label
    'not testable'
    """

    HOLDS = "proved, or shown in every part of the panel and opposed in none"
    FAILS = "refuted by a counterexample, or the opposite holds in the same sense"
    DEPENDS = "it holds in some cases, and fails or is open in others, which the row names"
    OPEN = "the sample shows neither the statement nor its opposite"
    NOT_REPRODUCED = "the paper's number could not be reproduced with our programs"
    NOT_TESTABLE = "no program can decide it from the text of the paper"
    MISSING = "its check did not come to an end"

    @property
    def label(self) -> str:
        """The short form for tables and files."""
        return self.name.lower().replace("_", " ")


class Basis(Enum):
    """How an answer is known."""

    PROOF = "an argument, and a program that asserts each of its steps"
    COUNTEREXAMPLE = "a stored counterexample, which runs again each time"
    PANEL = "tests on the maps of the panel, by the rule"
    SAMPLE = "random instances of its own"
    TEXT = "the text of the paper"

    @property
    def label(self) -> str:
        """The short form for tables and files."""
        return self.name.lower()


#: An entry of a table: a number is written with four significant digits, None as a dash.
Entry: TypeAlias = str | int | float | bool | None


@dataclass(frozen=True)
class Table:
    """
    Numbers behind an answer.

    Attributes
    ----------
    title
        One line.
    columns
        Their heads.
    rows
        One entry for each head.
    note
        A remark on how to read it.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Entry]]
    note: str = ""


@dataclass(frozen=True)
class Row:
    """
    One statement with its answer: a line of the page.

    Attributes
    ----------
    statement
        One assertion, in a few words.
    answer
        What is known of it.
    basis
        How.
    where
        The condition of the answer. For `Answer.DEPENDS`: where the statement holds, and where it fails or is open.
    size
        How large the effect is here, as a range over the panel.
    printed
        How large it is in the paper.
    why
        The reason in a sentence, with numbers.
    """

    statement: str
    answer: Answer
    basis: Basis
    where: str = ""
    size: str = ""
    printed: str = ""
    why: str = ""


@dataclass(frozen=True)
class Finding:
    """
    What a check finds.

    Attributes
    ----------
    rows
        The statements of the claim, each with its answer: at least one.
    notes
        Proofs, readings and choices of ours, a short paragraph each.
    tables
        The evidence.
    counterexamples
        Names of stored counterexamples (see `counterexamples`).
    """

    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    counterexamples: tuple[str, ...] = ()

    @property
    def answers(self) -> tuple[Answer, ...]:
        """
        The different answers of its rows, in the order in which they are defined.

        Examples
        --------
        >>> rows = Row("risk", Answer.OPEN, Basis.PANEL), Row("length", Answer.HOLDS, Basis.PANEL)
        >>> [answer.label for answer in Finding(rows).answers]
        ['holds', 'open']
        """
        found = {row.answer for row in self.rows}
        return tuple(answer for answer in Answer if answer in found)


def missing(reason: str) -> Finding:
    """
    Return the finding of a check that did not come to an end.

    Examples
    --------
    >>> missing("no memory").answers[0].label
    'missing'
    """
    return Finding((Row("", Answer.MISSING, Basis.TEXT, why=reason),))


def require(holds: object, message: str) -> None:
    """
    End a check, so that its claim has no answer, unless `holds`; an assert would vanish under ``python -O``.

    Raises
    ------
    AssertionError
        With the message.

    Examples
    --------
    >>> require(1 + 1 == 2, "sums are wrong")
    """
    if not holds:
        raise AssertionError(message)


#: What decides a claim: at top level of its topic's module; its random numbers come from the evidence only.
Check: TypeAlias = Callable[[Evidence], Finding]


@dataclass(frozen=True)
class Claim:
    """
    One sentence of the paper, made testable.

    Attributes
    ----------
    number
        Its number, which stays: ``28`` for C28.
    place
        Where in the paper.
    sentence
        What it says, in our words.
    reads
        Which part of the panel its check reads, or what it does instead, and why: said before it runs.
    check
        The check.
    merged
        Numbers of claims that are part of this one.
    experiments
        Names of the experiments whose samples it reads (see `experiment`).
    figures
        Figures and tables of the paper that show it: ``Fig. 5``, ``Table 1``.
    """

    number: int
    place: str
    sentence: str
    reads: str
    check: Check
    merged: tuple[int, ...] = ()
    experiments: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """
        Its name, as ``C28``.

        Examples
        --------
        >>> Claim(7, "", "", "", lambda _: missing("")).id
        'C7'
        """
        return f"C{self.number}"


def claim(
    number: int,
    place: str,
    sentence: str,
    reads: str,
    *,
    merged: tuple[int, ...] = (),
    experiments: tuple[str, ...] = (),
    figures: tuple[str, ...] = (),
) -> Callable[[Check], Claim]:
    """
    Make a claim of its check, which stands below; the arguments are those of `Claim`.

    Examples
    --------
    >>> @claim(7, "Section 3.2", "The parts of a segment add up to it.", "A proof: no part of the panel.")
    ... def parts_add_up(evidence: Evidence) -> Finding:
    ...     return Finding((Row("A(p, r) = A(p, q) + A(q, r)", Answer.HOLDS, Basis.PROOF, why="integrals add up"),))
    >>> parts_add_up.id, parts_add_up.check(Evidence()).answers[0].label
    ('C7', 'holds')
    """
    return lambda check: Claim(number, place, sentence, reads, check, merged, experiments, figures)


def finding_document(finding: Finding) -> dict[str, Any]:
    """
    Turn a finding into a JSON document.

    Examples
    --------
    >>> finding_from(finding_document(missing("as above"))).rows[0].why
    'as above'
    """
    document = dataclasses.asdict(finding)
    for row in document["rows"]:
        row["answer"], row["basis"] = row["answer"].label, row["basis"].label
    for table in document["tables"]:
        table["rows"] = [[_entry(entry) for entry in row] for row in table["rows"]]
    return document


def _entry(entry: Any) -> Any:  # noqa: ANN401 - any entry of a table
    entry = entry.item() if hasattr(entry, "item") else entry
    if isinstance(entry, float) and not (abs(entry) < float("inf")):
        return {float("inf"): "∞", float("-inf"): "-∞"}.get(entry)
    return entry


def finding_from(document: Mapping[str, Any]) -> Finding:
    """Make a finding of its document."""
    answers, bases = ({one.label: one for one in kind} for kind in (Answer, Basis))
    return Finding(
        rows=tuple(
            Row(**{**row, "answer": answers[row["answer"]], "basis": bases[row["basis"]]}) for row in document["rows"]
        ),
        notes=tuple(document["notes"]),
        tables=tuple(
            Table(one["title"], tuple(one["columns"]), tuple(tuple(row) for row in one["rows"]), one["note"])
            for one in document["tables"]
        ),
        counterexamples=tuple(document["counterexamples"]),
    )

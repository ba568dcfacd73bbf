"""A statement of the paper as data, and the answers that its check finds."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple, TypeAlias

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
    """Numbers behind an answer: a title of one line, heads of columns, entries, and how to read them."""

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
    answer, basis
        What is known of it, and how.
    where
        The condition of the answer. For `Answer.DEPENDS`: where the statement holds, and where it fails or is open.
    size, printed
        How large the effect is here, as a range over the panel, and in the paper.
    why
        The reason in a sentence, with numbers.
    interval
        The size over all maps, with its 95 % interval.
    """

    statement: str
    answer: Answer
    basis: Basis
    where: str = ""
    size: str = ""
    printed: str = ""
    why: str = ""
    interval: str = ""


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


class Setting(NamedTuple):
    """
    What a user can set of a claim.

    Attributes
    ----------
    means
        What it means for the claim.
    least
        How many values it needs.
    usual
        The values in the study; empty for those of its panel.
    """

    means: str
    least: int = 1
    usual: tuple[float, ...] = ()


_WEIGHT = "risk weight K: cost = length + K * risk"
_K, _THREATS = Setting(_WEIGHT), Setting("threats on each random map")
#: What a user can set where all is known, and where UAVs fly with limited sight.
KNOWN: Mapping[str, Setting] = {"k": _K, "threats": _THREATS}
FLOWN: Mapping[str, Setting] = {**KNOWN, "radius": Setting("detection radius OR, map units (the map is 1 wide)")}
#: The same where K are compared, a greater one with a smaller one.
OVER_K: Mapping[str, Setting] = {**FLOWN, "k": Setting(f"{_WEIGHT}; two or more, which are compared", 2)}


def flown_at(*ks: float, radii: tuple[float, ...] = ()) -> Mapping[str, Setting]:
    """
    Say what a user can set where the study flies at K, or radii, that are not the panel's.

    Examples
    --------
    >>> flown_at(10.0)["k"].usual
    (10.0,)
    """
    return {**FLOWN, "k": _K._replace(usual=ks), "radius": FLOWN["radius"]._replace(usual=radii)}


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
    place, sentence
        Where in the paper it is, and what it says, in our words.
    reads
        Which part of the panel its check reads, or what it does instead, and why: said before it runs.
    check
        The check.
    merged, experiments, figures
        Numbers of claims that are part of this one, names of the experiments whose samples it reads, and figures and
        tables of the paper that show it (``Fig. 5``).
    settings
        What of its panel a user can set, by name: ``k``, ``threats``, ``radius``. Empty of proofs, and of what a map or
        a graph decides that is stored.
    """

    number: int
    place: str
    sentence: str
    reads: str
    check: Check
    merged: tuple[int, ...] = ()
    experiments: tuple[str, ...] = ()
    figures: tuple[str, ...] = ()
    settings: Mapping[str, Setting] = field(default_factory=dict)

    @property
    def id(self) -> str:
        """Its name, as ``C28``."""
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
    settings: Mapping[str, Setting] | None = None,
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
    return lambda check: Claim(number, place, sentence, reads, check, merged, experiments, figures, settings or {})


def finding_document(finding: Finding) -> dict[str, Any]:
    """
    Turn a finding into a JSON document.

    Examples
    --------
    >>> finding_from(finding_document(missing("as above"))).rows[0].why
    'as above'
    """
    rows = [{**vars(row), "answer": row.answer.label, "basis": row.basis.label} for row in finding.rows]
    tables = [table_document(table) for table in finding.tables]
    return {
        "rows": rows,
        "notes": list(finding.notes),
        "tables": tables,
        "counterexamples": list(finding.counterexamples),
    }


def table_document(table: Table) -> dict[str, Any]:
    """Turn a table into a JSON document, the fields of `Table`; infinite entries become words."""
    words = {math.inf: "∞", -math.inf: "-∞"}
    rows = [
        [words[one] if isinstance(one, float) and one in words else plain_value(one) for one in row]
        for row in table.rows
    ]
    return {**vars(table), "columns": list(table.columns), "rows": rows}


def plain_value(value: Any) -> Any:  # noqa: ANN401 - any entry of a record or a table
    """Turn a value into one that JSON has, to the last bit; of numbers that are not finite, None."""
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def finding_from(document: Mapping[str, Any]) -> Finding:
    """Make a finding of its document."""
    answers, bases = ({one.label: one for one in kind} for kind in (Answer, Basis))
    rows = [{**row, "answer": answers[row["answer"]], "basis": bases[row["basis"]]} for row in document["rows"]]
    return Finding(
        tuple(Row(**row) for row in rows),
        tuple(document["notes"]),
        tuple(Table(**table) for table in document["tables"]),
        tuple(document["counterexamples"]),
    )

"""A claim of the paper as data, and what its check finds."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeAlias

from cgla_graph.comparisons.claims.evidence import Evidence


class Kind(Enum):
    """
    How a claim is checked.

    Examples
    --------
    >>> Kind.PROOF.label, Kind.PROOF.value
    ('proof', 'an argument, and a program that asserts each of its steps')
    """

    PROOF = "an argument, and a program that asserts each of its steps"
    PROPERTY = "an assertion on random instances"
    STATISTIC = "a test on a sample of random maps"
    SCENARIO = "the paper's own situation, as far as it is stated"
    PROSE = "words that no program decides"

    @property
    def label(self) -> str:
        """The short form for tables and files."""
        return self.name.lower()


class Verdict(Enum):
    """
    What is found of a claim.

    Examples
    --------
    >>> Verdict.NOT_SUPPORTED.label
    'not supported'
    """

    PROVED = "holds always, under the stated condition"
    REFUTED = "does not hold: there is a counterexample, which is stored and can be run again"
    SUPPORTED = "the sample shows it"
    NOT_SUPPORTED = "the sample does not show it, or shows the opposite"
    NOT_TESTABLE = "no program can decide it from what the paper says"
    MISSING = "its check did not come to an end"

    @property
    def label(self) -> str:
        """The short form for tables and files."""
        return self.name.lower().replace("_", " ")


#: What stands in a table: a number is written with four significant digits, None as a dash.
Entry: TypeAlias = str | int | float | bool | None


@dataclass(frozen=True)
class Table:
    """
    Numbers behind a verdict.

    Attributes
    ----------
    title
        One line.
    columns
        Their heads.
    rows
        One entry for each head.
    note
        What has to be said with it.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Entry]]
    note: str = ""


@dataclass(frozen=True)
class Part:
    """
    One of several things that a claim says, with a verdict of its own.

    Attributes
    ----------
    statement
        What is asserted.
    verdict
        Of this part.
    result
        The numbers, in a sentence.
    """

    statement: str
    verdict: Verdict
    result: str


@dataclass(frozen=True)
class Finding:
    """
    What a check finds.

    Attributes
    ----------
    verdict
        Of the claim as the paper has it.
    result
        The reason in one or two sentences, with numbers: effect and interval, the counterexample, or the condition
        under which it is proved.
    parts
        Where the claim says several things.
    tables
        The evidence.
    notes
        Remarks: choices of ours, readings, what was left out.
    counterexample
        Of what is refuted: the name of the stored counterexample (see `counterexamples`).
    """

    verdict: Verdict
    result: str
    parts: tuple[Part, ...] = ()
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
    counterexample: str = ""


def supported(holds: object) -> Verdict:
    """Return the verdict of what a sample shows, or does not show."""
    return Verdict.SUPPORTED if holds else Verdict.NOT_SUPPORTED


def require(holds: object, message: str) -> None:
    """
    End a check, so that its claim has no verdict, unless `holds`; an assert would vanish under ``python -O``.

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
    id
        C1 to C54.
    place
        Where in the paper.
    sentence
        What it says, in our words.
    statement
        The same, formally: what exactly is checked.
    kind
        How.
    check
        The check.
    experiments
        Names of the experiments whose samples it looks at (see `experiment`).
    figures
        Figures and tables of the paper that show it: ``Fig. 5``, ``Table 1``.
    """

    id: str
    place: str
    sentence: str
    statement: str
    kind: Kind
    check: Check
    experiments: tuple[str, ...] = ()
    figures: tuple[str, ...] = field(default=())

    @property
    def number(self) -> int:
        """
        The number in its id.

        Examples
        --------
        >>> Claim("C7", "", "", "", Kind.PROSE, lambda _: Finding(Verdict.PROVED, "")).number
        7
        """
        return int(self.id[1:])


def claim(
    number: int,
    place: str,
    sentence: str,
    statement: str,
    kind: Kind,
    *,
    experiments: tuple[str, ...] = (),
    figures: tuple[str, ...] = (),
) -> Callable[[Check], Claim]:
    """
    Make a claim of its check, which stands below; what is given is as of `Claim`.

    Examples
    --------
    >>> @claim(7, "Section 3.2", "The parts of a segment add up to it.", "A(p, r) = A(p, q) + A(q, r)", Kind.PROOF)
    ... def parts_add_up(evidence: Evidence) -> Finding:
    ...     return Finding(Verdict.PROVED, "an integral is additive")
    >>> parts_add_up.id, parts_add_up.check(Evidence()).verdict.label
    ('C7', 'proved')
    """
    return lambda check: Claim(f"C{number}", place, sentence, statement, kind, check, experiments, figures)


def finding_document(finding: Finding) -> dict[str, Any]:
    """
    Turn a finding into what JSON can hold.

    Examples
    --------
    >>> finding_from(finding_document(Finding(Verdict.PROVED, "as above"))).result
    'as above'
    """
    document = dataclasses.asdict(finding)
    document["verdict"] = finding.verdict.name
    document["parts"] = [{**dataclasses.asdict(part), "verdict": part.verdict.name} for part in finding.parts]
    for table in document["tables"]:
        table["rows"] = [[_entry(entry) for entry in row] for row in table["rows"]]
    return document


def _entry(entry: Any) -> Any:  # noqa: ANN401 - any entry of a table
    entry = entry.item() if hasattr(entry, "item") else entry
    if isinstance(entry, float) and not (abs(entry) < float("inf")):
        return {float("inf"): "∞", float("-inf"): "-∞"}.get(entry)
    return entry


def finding_from(document: Mapping[str, Any]) -> Finding:
    """Make a finding of a document again."""
    return Finding(
        verdict=Verdict[document["verdict"]],
        result=document["result"],
        parts=tuple(Part(one["statement"], Verdict[one["verdict"]], one["result"]) for one in document["parts"]),
        tables=tuple(
            Table(one["title"], tuple(one["columns"]), tuple(tuple(row) for row in one["rows"]), one["note"])
            for one in document["tables"]
        ),
        notes=tuple(document["notes"]),
        counterexample=document["counterexample"],
    )

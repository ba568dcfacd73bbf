"""A claim of the paper as data, and what its check finds."""

import dataclasses
import itertools
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
    What is found of one thing that a claim says; its condition belongs to it (see `Part`).

    Examples
    --------
    >>> Verdict.NOT_TESTABLE.label
    'not testable'
    """

    PROVED = "holds always, under the condition that stands with it"
    REFUTED = "does not hold: there is a counterexample, which is stored and can be run again"
    SUPPORTED = "a test on random maps shows it, in every cell"
    CONTRADICTED = "a test on random maps shows the opposite"
    UNDECIDED = "the sample shows neither it nor the opposite in every cell, or is too small to"
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
    One thing that a claim says, with a verdict of its own.

    What holds under a condition, and not without it, is two parts: ``proved`` with the condition, and ``refuted`` as it
    is printed.

    Attributes
    ----------
    statement
        What is asserted; empty if it is the claim's whole sentence.
    verdict
        Of this part.
    result
        The reason in a sentence, with numbers.
    condition
        What belongs to the verdict wherever it is shown, so written that it can follow it: ``if all weights are
        positive``, ``as printed``, ``for gamma = 0.95``; empty if it holds without any.
    effect
        How large it is here, with its interval.
    printed
        How large it is in the paper.
    levels
        The levels of a factor that the condition names, where several have the same verdict.
    """

    statement: str
    verdict: Verdict
    result: str
    condition: str = ""
    effect: str = ""
    printed: str = ""
    levels: tuple[str, ...] = ()

    @property
    def ruling(self) -> str:
        """
        The verdict with its condition, and what it is about.

        Examples
        --------
        >>> Part("risk", Verdict.PROVED, "as above", condition="if F >= 0").ruling
        'risk: proved if F >= 0'
        """
        verdict = f"{self.verdict.label} {self.condition}".rstrip()
        return f"{self.statement}: {verdict}" if self.statement else verdict

    @property
    def sizes(self) -> str:
        """The effect here beside the paper's own; empty if there is none."""
        return " ".join(filter(None, [self.effect, f"(paper: {self.printed})" if self.printed else ""]))


@dataclass(frozen=True)
class Finding:
    """
    What a check finds.

    Attributes
    ----------
    parts
        What the claim says, each with its verdict: at least one.
    result
        The reason in one or two sentences, with numbers: effect and interval, or the counterexample.
    beside
        What the sentence does not say, but is worth knowing beside it; no part of the verdict.
    tables
        The evidence.
    notes
        Remarks: choices of ours, readings, what was left out.
    counterexample
        Of what is refuted: the name of the stored counterexample (see `counterexamples`).
    """

    parts: tuple[Part, ...]
    result: str
    beside: tuple[Part, ...] = ()
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
    counterexample: str = ""

    @property
    def is_proof(self) -> bool:
        """Whether something of it is proved: the argument, in the notes, then comes before the samples."""
        return any(part.verdict is Verdict.PROVED for part in self.parts)

    @classmethod
    def single(
        cls,
        verdict: Verdict,
        result: str,
        beside: tuple[Part, ...] = (),
        tables: tuple[Table, ...] = (),
        notes: tuple[str, ...] = (),
        counterexample: str = "",
        *,
        condition: str = "",
        effect: str = "",
        printed: str = "",
    ) -> "Finding":
        """
        Make the finding of a claim that says one thing.

        Examples
        --------
        >>> Finding.single(Verdict.PROVED, "by induction", condition="if all weights are positive").headline
        'proved if all weights are positive'
        """
        whole = Part("", verdict, result, condition, effect, printed)
        return cls((whole,), result, beside, tables, notes, counterexample)

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """The different verdicts of its parts, in the order in which they are defined."""
        found = {part.verdict for part in self.parts}
        return tuple(verdict for verdict in Verdict if verdict in found)

    @property
    def rulings(self) -> tuple[str, ...]:
        """The verdict of each part, with its condition."""
        return tuple(part.ruling for part in self.parts)

    @property
    def headline(self) -> str:
        """
        The rulings of all parts in one line; a statement is said once for parts that follow each other.

        Examples
        --------
        >>> parts = [Part("arrives", Verdict.PROVED, "", "if …"), Part("arrives", Verdict.REFUTED, "", "else")]
        >>> Finding((*parts, Part("at once", Verdict.UNDECIDED, "")), "").headline
        'arrives: proved if …; refuted else · at once: undecided'
        """
        groups = itertools.groupby(self.parts, key=lambda part: part.statement)
        lines = [
            (f"{statement}: " if statement else "")
            + "; ".join(dataclasses.replace(part, statement="").ruling for part in parts)
            for statement, parts in groups
        ]
        return " · ".join(lines)

    @property
    def sizes(self) -> str:
        """The effects of all parts, beside the paper's own; empty if there are none."""
        named = [(part.statement if len(self.parts) > 1 else "", part.sizes) for part in self.parts if part.sizes]
        return "; ".join(f"{name}: {sizes}" if name else sizes for name, sizes in named)


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
        >>> Claim("C7", "", "", "", Kind.PROSE, lambda _: Finding.single(Verdict.PROVED, "")).number
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
    ...     return Finding.single(Verdict.PROVED, "an integral is additive")
    >>> parts_add_up.id, parts_add_up.check(Evidence()).headline
    ('C7', 'proved')
    """
    return lambda check: Claim(f"C{number}", place, sentence, statement, kind, check, experiments, figures)


def finding_document(finding: Finding) -> dict[str, Any]:
    """
    Turn a finding into what JSON can hold.

    Examples
    --------
    >>> finding_from(finding_document(Finding.single(Verdict.PROVED, "as above"))).result
    'as above'
    """
    document = dataclasses.asdict(finding)
    for name in ("parts", "beside"):
        document[name] = [{**part, "verdict": part["verdict"].name} for part in document[name]]
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
    parts, beside = (
        tuple(
            Part(**{**one, "verdict": Verdict[one["verdict"]], "levels": tuple(one["levels"])})
            for one in document[name]
        )
        for name in ("parts", "beside")
    )
    return Finding(
        parts=parts,
        result=document["result"],
        beside=beside,
        tables=tuple(
            Table(one["title"], tuple(one["columns"]), tuple(tuple(row) for row in one["rows"]), one["note"])
            for one in document["tables"]
        ),
        notes=tuple(document["notes"]),
        counterexample=document["counterexample"],
    )

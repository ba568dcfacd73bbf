"""Claims in the terminal: a row each, or all that is known of a few."""

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from cgla_graph.comparisons import console
from cgla_graph.comparisons.claims.checking import Result
from cgla_graph.comparisons.claims.claim import Part, Table, Verdict
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.wording import counted, is_number, part_words, rerun, sampled, scale_words, written
from cgla_graph.comparisons.tables.fitted_table import FittedTable

#: Up to this many claims, all that is known of them is printed.
FEW = 3
_STYLES = {
    Verdict.PROVED: "green",
    Verdict.SUPPORTED: "green",
    Verdict.REFUTED: "red",
    Verdict.CONTRADICTED: "red",
    Verdict.UNDECIDED: "yellow",
    Verdict.NOT_TESTABLE: "dim",
    Verdict.MISSING: "bold red",
}


def print_results(results: Sequence[Result], scale: Scale) -> None:
    """Print a row for each claim; of a few claims the evidence as well."""
    if len(results) <= FEW:
        for result in results:
            console.out_table(_in_full(result, scale))
        return
    table = RichTable(title=Text(f"the paper's claims ({scale_words(scale)})"), title_justify="left", expand=True)
    table.add_column("claim", no_wrap=True)
    table.add_column("verdict, condition", ratio=2, overflow="fold")
    table.add_column("what the paper says", ratio=2, overflow="fold")
    table.add_column("what is found", ratio=3, overflow="fold")
    for result in results:
        cells = (result.claim.sentence, result.finding.result)
        table.add_row(result.claim.id, _rulings(result.finding.parts), *(Text(cell) for cell in cells))
    console.out_table(table)
    console.out(f"{counted(results)}\n")


def _rulings(parts: Sequence[Part]) -> Text:
    """Write a line for each part: its verdict and condition."""
    return Text("\n").join(Text(part.ruling, style=_STYLES[part.verdict]) for part in parts)


def _in_full(result: Result, scale: Scale) -> RenderableType:
    claim, finding = result.claim, result.finding
    lines: list[RenderableType] = [
        Text.assemble((f"{claim.id}: ", "bold"), _rulings(finding.parts)),
        Text(finding.result),
        Text(f"the paper ({claim.place}): {claim.sentence}"),
        Text(f"checked: {claim.statement} ({claim.kind.label})"),
    ]
    several = finding.parts if len(finding.parts) > 1 or finding.sizes else ()
    for words, parts in (("", several), ("beside it, ", finding.beside)):
        lines += [Padding(Text(words + part_words(part)), (0, 0, 0, 2)) for part in parts]
    tables = [_table(table) for table in finding.tables]
    notes = [Text(f"- {note}") for note in finding.notes]
    lines += [*notes, *tables] if finding.is_proof else [*tables, *notes]
    if finding.counterexample:
        lines.append(Text(f"counterexample: {finding.counterexample}"))
    lines.append(
        Text("; ".join(filter(None, [scale_words(scale), sampled(result), f"again: {rerun(claim.id, scale)}"])))
    )
    lines.append(Text())
    return Group(*lines)


def _table(table: Table) -> FittedTable:
    """Show a table: words on the left, then numbers, of which a narrow terminal leaves out the later ones."""
    order = sorted(range(len(table.columns)), key=lambda column: _is_of_numbers(table, column))
    heads = [table.columns[column] for column in order]
    n_words = sum(not _is_of_numbers(table, column) for column in order)
    rows: list[Sequence[str]] = [[written(row[column]) for column in order] for row in table.rows]
    spare = heads[:n_words:-1]
    notes = [table.note] if table.note else []
    return FittedTable(table.title, heads[:n_words], heads[n_words:], spare, notes, rows)


def _is_of_numbers(table: Table, column: int) -> bool:
    return all(is_number(row[column]) for row in table.rows)

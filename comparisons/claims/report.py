"""The report on the claims: Markdown, one HTML page that needs no other file, pictures and the numbers behind them."""

import base64
import json
from collections.abc import Iterator, Sequence
from importlib import resources
from pathlib import Path

import jinja2

import cgla_graph
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.artefact import Comparison, Picture, TableRow
from cgla_graph.comparisons.claims.checking import Result, Shown
from cgla_graph.comparisons.claims.claim import Entry, Kind, Table, Verdict
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.wording import (
    counted,
    counts,
    is_number,
    rerun,
    results_document,
    sampled,
    scale_words,
    written,
)
from cgla_graph.comparisons.files import make_folder, write_bytes, write_text

#: What the claims are about, by the number of the first.
SECTIONS = (
    (1, "Model"),
    (8, "Algorithm"),
    (20, "Cost of planning"),
    (24, "Other methods"),
    (28, "One UAV"),
    (39, "Several UAVs"),
    (50, "Planners, conclusion"),
)
#: What a reader has to know, whichever way the report is read.
ABOUT = (
    "Every path, whoever planned it, is weighed by one oracle: length plus k times the exact line integral of risk.",
    (
        "The paper does not print its maps. The one called paper here was found by a seeded search for a map on which "
        "some of its statements hold, so agreement on that map proves nothing; statistics are over random maps, which "
        "were not selected."
    ),
    (
        "Planners with -style in their name are re-implementations in the style of methods whose texts or programs are "
        "not public. They are not those methods, and nothing here says how good those are."
    ),
    (
        "Intervals have 95 % confidence: Hodges-Lehmann for shifts, Clopper-Pearson for rates. p-values are of "
        "Wilcoxon's signed ranks or McNemar's exact test. What has to hold in every cell is tested in each at the full "
        "level, an intersection-union test; that the opposite holds in one is adjusted by Holm's method."
    ),
)
#: Columns of the paper's tables, remade.
HEADS = ("whose", "what", "paper", "ours, offline", "ours, online", "comparable?", "why")


def write_report(folder: Path, results: Sequence[Result], shown: Sequence[Shown], scale: Scale) -> list[Path]:
    """
    Write ``report.md``, ``report.html``, ``claims.json``, the pictures and the counterexamples.

    Returns
    -------
    written
        The files; of pictures and counterexamples their folders.

    Raises
    ------
    OutputError
        If one cannot be written.
    """
    document = json.dumps(results_document(results, scale), ensure_ascii=False, allow_nan=False, indent=1)
    files = [
        write_text(folder / "report.html", report_html(results, shown, scale)),
        write_text(folder / "report.md", report_markdown(results, shown, scale)),
        write_text(folder / "claims.json", f"{document}\n"),
    ]
    pictures = [(one.artefact.name, one.content) for one in shown if isinstance(one.content, Picture)]
    if pictures:
        files.append(make_folder(folder / "figures"))
        for name, picture in pictures:
            write_bytes(folder / "figures" / f"{name}.png", picture.png)
            write_bytes(folder / "figures" / f"{name}.svg", picture.svg)
    # those that a finding names anywhere
    stored = [name for name in counterexamples.names() if name in document]
    if stored:
        files.append(make_folder(folder / "counterexamples"))
        for name in stored:
            write_text(folder / "counterexamples" / name, counterexamples.text(name))
    return files


def sections(results: Sequence[Result]) -> list[tuple[str, list[Result]]]:
    """Part the results by what the claims are about; sections without any are left out."""
    ends = [*(first for first, _ in SECTIONS[1:]), 1_000]
    parted = [
        (title, [result for result in results if first <= result.claim.number < end])
        for (first, title), end in zip(SECTIONS, ends, strict=True)
    ]
    return [(title, members) for title, members in parted if members]


def report_html(results: Sequence[Result], shown: Sequence[Shown], scale: Scale) -> str:
    """Write the page: verdicts first, then the evidence, then the figures and tables."""
    folder = resources.files("cgla_graph.comparisons.claims") / "templates"
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    environment.filters |= {"written": written, "base64": lambda data: base64.b64encode(data).decode()}
    environment.tests["number"] = is_number
    template = environment.from_string((folder / "report.html").read_text(encoding="utf-8"))
    return template.render(
        style=(folder / "report.css").read_text(encoding="utf-8"),
        version=cgla_graph.__version__,
        headline=counted(results),
        scale=scale_words(scale),
        counts=counts(results).items(),
        sections=sections(results),
        about=ABOUT,
        verdicts=list(Verdict),
        kinds=list(Kind),
        figures=[one for one in shown if not isinstance(one.content, Comparison)],
        tables=[one for one in shown if isinstance(one.content, Comparison)],
        heads=HEADS,
        table_row=_table_row,
        sampled=sampled,
        rerun=lambda claim: rerun(claim, scale),
        everything=rerun("", scale),
        drawn={one.artefact.label: one.artefact.name for one in shown},
    )


def _table_row(row: TableRow) -> list[Entry]:
    """Return the entries of a row of a remade table, in the order of `HEADS`; the paper's number as it is printed."""
    return [row.label, row.quantity, f"{row.paper:.9g}", row.offline, row.online, row.comparable, row.why]


def report_markdown(results: Sequence[Result], shown: Sequence[Shown], scale: Scale) -> str:
    """Write the same as text, for diffs and reviews."""
    return "\n".join(_markdown(results, shown, scale)).rstrip() + "\n"


def _markdown(results: Sequence[Result], shown: Sequence[Shown], scale: Scale) -> Iterator[str]:
    yield from (
        "# The paper's claims, checked",
        "",
        f"**{counted(results)}** ({scale_words(scale)}; version {cgla_graph.__version__}).",
        "",
    )
    yield from (f"- {line}" for line in ABOUT)
    yield from ("", "## Verdicts", "")
    rows = [(r.claim.id, r.finding.headline, r.claim.sentence, r.finding.result) for r in results]
    yield from _markdown_table(("claim", "verdict, condition", "what the paper says", "what is found"), rows)
    for title, members in sections(results):
        yield from ("", f"## {title}")
        for result in members:
            yield from _markdown_claim(result, scale)
    tables = [(one.artefact, one.content) for one in shown if isinstance(one.content, Comparison)]
    figures = [one for one in shown if not isinstance(one.content, Comparison)]
    for artefact, content in tables:
        yield from ("", f"## {artefact.label}: {artefact.title}", "", content.caption)
        if content.rows:
            yield ""
            yield from _markdown_table(HEADS, [_table_row(row) for row in content.rows])
        for table in content.tables:
            yield from _markdown_evidence(table)
    for one in figures:
        yield from ("", f"## {one.artefact.label}: {one.artefact.title}", "")
        if isinstance(one.content, Picture):
            yield from (f"![{one.artefact.label}](figures/{one.artefact.name}.png)", "", one.content.caption)
        else:
            yield f"It could not be made: {one.failed}"
    yield from ("", "## Words", "")
    yield from (f"- **{verdict.label}**: {verdict.value}" for verdict in Verdict)
    yield from (f"- {kind.label}: {kind.value}" for kind in Kind)


def _markdown_claim(result: Result, scale: Scale) -> Iterator[str]:
    claim, finding = result.claim, result.finding
    yield from ("", f"### {claim.id}: {finding.headline}", "", f"**{finding.result}**", "")
    yield f"The paper ({claim.place}): {claim.sentence}"
    yield from ("", f"Checked ({claim.kind.label}): {claim.statement}")
    for title, parts in (("what it says", finding.parts), ("beside it", finding.beside)):
        if parts:
            yield ""
            rows = [(part.statement, part.verdict.label, part.condition, part.result, part.sizes) for part in parts]
            yield from _markdown_table((title, "verdict", "condition", "result", "effect"), rows)
    tables = [line for table in finding.tables for line in _markdown_evidence(table)]
    notes = ["", *(f"- {note}" for note in finding.notes)] if finding.notes else []
    yield from [*notes, *tables] if finding.is_proof else [*tables, *notes]
    yield ""
    if finding.counterexample:
        yield f"Counterexample: [{finding.counterexample}](counterexamples/{finding.counterexample})."
    if sampled(result):
        yield f"Sample: {sampled(result)}."
    if claim.figures:
        yield f"See {', '.join(claim.figures)}."
    yield f"Again: `{rerun(claim.id, scale)}`"


def _markdown_evidence(table: Table) -> Iterator[str]:
    yield from ("", f"{table.title}:", "")
    yield from _markdown_table(table.columns, table.rows)
    if table.note:
        yield from ("", table.note)


def _markdown_table(columns: Sequence[str], rows: Sequence[Sequence[Entry]]) -> Iterator[str]:
    """Write a table; what would end a cell is escaped."""

    def line(cells: Sequence[Entry]) -> str:
        texts = (written(cell).replace("\\", "\\\\").replace("|", "\\|").replace("\n", " ") for cell in cells)
        return f"| {' | '.join(texts)} |"

    yield line(columns)
    right = [bool(rows) and all(is_number(row[number]) for row in rows) for number in range(len(columns))]
    yield f"|{'|'.join(' ---: ' if one else ' --- ' for one in right)}|"
    yield from (line(row) for row in rows)

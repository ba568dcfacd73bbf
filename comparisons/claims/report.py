"""The files of a study: the report in Markdown and HTML, pictures, counterexamples and all numbers."""

import base64
import json
import re
from collections.abc import Iterator, Sequence
from importlib import resources
from pathlib import Path

import jinja2
from markdown_it import MarkdownIt

import cgla_graph
from cgla_graph.comparisons.claims import counterexamples, own
from cgla_graph.comparisons.claims.artefact import Content
from cgla_graph.comparisons.claims.checking import Result, Shown
from cgla_graph.comparisons.claims.claim import Answer
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.page import Document, evidence, grid, page, rerun, topics
from cgla_graph.comparisons.files import make_folder, write_bytes, write_text
from cgla_graph.comparisons.tables.markdown import plain

#: Titles of a report: of a study, and of claims on a user's own settings.
TITLE, OWN_TITLE = "The paper's claims, checked", "Claims on own settings: no verdicts on the paper"


def write_report(
    folder: Path, results: Sequence[Result], shown: Sequence[Shown], scale: Scale, remarks: Sequence[str] = ()
) -> list[Path]:
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
    is_own = bool(scale.panel.own)
    document = own.document_of(results, scale, remarks)
    numbers = json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1)
    if is_own:
        text = "\n\n".join([f"# {OWN_TITLE}", *own.paragraphs(document)])
    else:
        text = "\n\n".join([*report(document, shown), f"All of it again: `{rerun('', scale)}`"])
    pictures = {one.artefact.name: one.content for one in shown if one.content and one.content.png}
    files = [
        write_text(folder / "report.html", html(text, pictures, OWN_TITLE if is_own else TITLE)),
        write_text(folder / "report.md", f"{text}\n"),
        write_text(folder / "claims.json", f"{numbers}\n"),
    ]
    if pictures:
        files.append(make_folder(folder / "figures"))
        for name, picture in pictures.items():
            write_bytes(folder / "figures" / f"{name}.png", picture.png)
            write_bytes(folder / "figures" / f"{name}.svg", picture.svg)
    # those that a finding names anywhere
    if stored := [name for name in counterexamples.names() if name in numbers]:
        files.append(make_folder(folder / "counterexamples"))
        for name in stored:
            write_text(folder / "counterexamples" / name, counterexamples.text(name))
    return files


def report(document: Document, shown: Sequence[Shown]) -> Iterator[str]:
    """Yield the paragraphs of the report: the page, the evidence for each claim, and figures and tables."""
    yield f"# {TITLE}"
    yield from page(document)
    for title, claims in topics(document):
        yield f"## Evidence: {title}"
        for claim in claims:
            yield from evidence(claim)
    if shown:
        yield "## Figures and tables"
    for one in shown:
        yield f"### {one.artefact.label}: {plain(one.artefact.title)}"
        if one.content is None:
            yield plain(f"It could not be made: {one.failed}")
            continue
        picture = f"![{one.artefact.label}](figures/{one.artefact.name}.png)"
        yield grid(one.content.table) if one.content.table else picture
        yield plain(one.content.caption)


def html(text: str, pictures: dict[str, Content], title: str = TITLE) -> str:
    """Write the report as one page that needs no other file; evidence is folded."""
    body: str = MarkdownIt("commonmark", {"html": False}).enable("table").render(text)
    body = re.sub(r"<h3>(C\d+)", r'<h3 id="\1">\1', body)
    body = re.sub(r"<td><strong>(C\d+)</strong>", r'<td><a href="#\1">\1</a>', body)
    body = re.sub(
        r"<h4>(.*?)</h4>(.*?)(?=<p>Again: )", r"<details><summary>\1</summary>\2</details>", body, flags=re.DOTALL
    )
    for answer in Answer:
        badge = f'<td><span class="verdict {answer.name.lower()}">{answer.label}</span>'
        body = re.sub(rf"<td>{answer.label}(?=</td>| \()", badge, body)
    for name, picture in pictures.items():
        body = body.replace(f"figures/{name}.png", f"data:image/png;base64,{base64.b64encode(picture.png).decode()}")
    heads = re.findall(r"<h2>(.*?)</h2>", body)
    for number, head in enumerate(heads):
        body = body.replace(f"<h2>{head}</h2>", f'<h2 id="part-{number}">{head}</h2>')
    folder = resources.files("cgla_graph.comparisons.claims") / "templates"
    style, template = ((folder / f"report.{kind}").read_text(encoding="utf-8") for kind in ("css", "html"))
    # all of the body was escaped above
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.from_string(template).render(
        title=title, style=style, version=cgla_graph.__version__, heads=heads, body=body
    )

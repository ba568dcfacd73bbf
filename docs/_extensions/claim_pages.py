"""The page of all claims, one by one: condition, verdict, effect, and a figure where intervals were measured."""

import re
import tomllib
from pathlib import Path
from typing import Any

import claim_pictures
from cgla_graph.comparisons.claims.summary import counted, shipped_verdicts
from cgla_graph.comparisons.claims.wording import rerun, scale_words
from generated import write
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.typing import ExtensionMetadata

import cgla_graph as cg
from cgla_graph.comparisons.claims.evidence import Scale

FOLDER = "generated/claims"
#: What reStructuredText would read as markup; code in backquotes is meant.
_MARKUP = re.compile(r"[\\*|]|_(?!\w)")
_INTRODUCTION = """\
What the paper says, sentence by sentence, with what the last full study found ({scale}): {counts}. What the verdicts
mean, and how claims are checked, is told on the page :doc:`/claims`.

In the figures a dot, or a bar between two dots, is the effect: one size, or the least and the greatest of all cells of
the experiment. The thin line is its 95 % interval, over all cells. The dashed line is what the test holds it against:
no difference, or the share or margin that the claim's rule names. A cross is the paper's own number. Blue is supported,
orange contradicted, grey undecided, green refuted or proved otherwise; the word stands beside each as well. Claims
without a figure are settled by an argument or a counterexample, and no interval belongs to them.
"""


def plain(text: str) -> str:
    r"""
    Write text so that reStructuredText shows it as it is.

    >>> plain("|A - A'| of p_r")
    "\\|A - A'\\| of p_r"
    """
    return " ".join(_MARKUP.sub(lambda found: f"\\{found[0]}", text).split())


def _part(part: dict[str, Any]) -> str:
    verdict = f"**{part['verdict']}** {plain(part['condition'])}".rstrip()
    said = f"{plain(part['statement'])}: {verdict}" if part["statement"] else verdict
    paper = f"(paper: {part['printed']})" if part["printed"] else ""
    sizes = " ".join(filter(None, [part["effect"], paper]))
    return f"- {said}{f'. Effect: {plain(sizes)}' if sizes else ''}"


def section(claim: dict[str, Any], alternative: str, scale: Scale) -> list[str]:
    """Write the section of a claim; with a picture if there are words for it."""
    lines = [f".. _claim-{claim['id'].lower()}:", "", claim["id"], "-" * len(claim["id"]), ""]
    lines += [f"*{plain(claim['sentence'])}* ({plain(claim['place'])}; {claim['kind']})", ""]
    lines += [*map(_part, claim["parts"]), ""]
    if alternative:
        lines += [f".. image:: {claim['id']}.png", f"   :alt: {alternative}", ""]
    return [*lines, f"To check it again: ``{rerun(claim['id'], scale)}``", ""]


def generate(app: Sphinx) -> None:
    """Write the page and its pictures."""
    folder = Path(app.srcdir) / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    panels_file = Path(app.srcdir) / "reference" / "claim-figures.toml"
    document = shipped_verdicts()
    scale = Scale(document["maps"], document["seed"])
    try:
        panels = claim_pictures.panels_of(document, tomllib.loads(panels_file.read_text(encoding="utf-8")))
    except ValueError as error:
        msg = f"reference/claim-figures.toml: {error}"
        raise ExtensionError(msg) from error
    claim_pictures.draw(panels, folder, panels_file)
    title = "The claims, one by one"
    lines = [title, "=" * len(title), ""]
    lines += [_INTRODUCTION.format(scale=scale_words(scale), counts=counted(document)), ""]
    for claim in document["claims"]:
        lines += section(claim, claim_pictures.in_words(claim["id"], panels.get(claim["id"], [])), scale)
    write(folder / "index.rst", "\n".join(lines))


def setup(app: Sphinx) -> ExtensionMetadata:
    """Generate before any page is read."""
    app.connect("builder-inited", generate)
    return {"version": cg.__version__, "parallel_read_safe": True, "parallel_write_safe": True}

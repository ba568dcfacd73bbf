"""
Excerpts below search results, also where the site is read from files.

Sphinx's search fetches each page that it found, which browsers refuse to pages of files. The texts of all pages are
written into one script instead, which the search page loads, and `_static/excerpts.js` answers from it.
"""

import json
from html import escape
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

#: What is not text to read: signatures have an entry of their own in the index.
LEFT_OUT = {"comment", "desc_signature", "raw", "title", "toctree"}
SCRIPTS = ("_static/page_texts.js", "_static/excerpts.js")


def _text(node: nodes.Node) -> str:
    """Write a page's sections and their text, without what is not shown."""
    if isinstance(node, nodes.Text):
        return escape(node.astext())
    if type(node).__name__ in LEFT_OUT or (isinstance(node, nodes.Element) and "sd-stretched-link" in node["classes"]):
        return ""
    inner = "".join(_text(child) for child in node.children)
    if isinstance(node, nodes.section):
        return f'<div id="{escape(node["ids"][0])}">{inner}</div>'
    return inner if isinstance(node, nodes.Inline) else f"{inner}\n"


def write_texts(app: Sphinx, error: Exception | None) -> None:
    """Write the script with the texts of all pages."""
    if error is None and app.builder.name == "html":
        texts = {name: _text(app.env.get_doctree(name)) for name in sorted(app.env.found_docs)}
        script = f"const PAGE_TEXTS = {json.dumps(texts, ensure_ascii=False)};\n"
        (Path(app.outdir) / SCRIPTS[0]).write_text(script, encoding="utf-8")


def _on_the_search_page(app: Sphinx, page: str, _template: str, _context: object, _tree: object) -> None:
    if page == "search":
        for script in SCRIPTS:
            app.add_js_file(script.removeprefix("_static/"))


def setup(app: Sphinx) -> ExtensionMetadata:
    """Write texts when all pages are there."""
    app.connect("html-page-context", _on_the_search_page)
    app.connect("build-finished", write_texts)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}

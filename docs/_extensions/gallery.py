"""The gallery: every figure of the manual, with the page that explains it and its script to download."""

import ast
import re
from pathlib import Path

from generated import write
from sphinx.application import Sphinx
from sphinx.util.typing import ExtensionMetadata

FIGURE = re.compile(r"^!\[([^\]]+)\]\((?:\.\./)?figures/(\w+)\.png\)$", re.MULTILINE)
TITLE = re.compile(r"^# (.+)$", re.MULTILINE)
HEAD = """# Gallery

Figures of this manual, each with the script that draws it. Scripts that import `drawing` need {download}`drawing.py
</_extensions/drawing.py>` beside them. Longer programs to start from: [examples](/tutorials/examples.rst).

::::{grid} 1 1 2 2
:gutter: 3
"""


def cards(docs: Path) -> list[str]:
    """Write a card for each figure, in the order of pages."""
    found, lines = set(), []
    for path in sorted(path for path in docs.rglob("*.md") if "generated" not in path.relative_to(docs).parts):
        text = path.read_text(encoding="utf-8")
        for alt, name in FIGURE.findall(text):
            if name in found or path.name == "index.md":
                continue
            found.add(name)
            script = (docs / "figures" / f"{name}.py").read_text(encoding="utf-8")
            told = (ast.get_docstring(ast.parse(script)) or name).splitlines()[0].rstrip(".")
            page, title = path.relative_to(docs).as_posix(), TITLE.search(text)
            lines += [f":::{{grid-item-card}} {told}", "", f"![{alt}](/figures/{name}.png)", ""]
            lines += [
                f"[{title[1] if title else page}](/{page})",
                f"· {{download}}`{name}.py </figures/{name}.py>`",
                ":::",
                "",
            ]
    return lines


def generate(app: Sphinx) -> None:
    """Write the page."""
    docs = Path(app.srcdir)
    (docs / "generated").mkdir(exist_ok=True)
    write(docs / "generated" / "gallery.md", "\n".join([HEAD, *cards(docs), "::::", ""]))


def setup(app: Sphinx) -> ExtensionMetadata:
    """Generate before any page is read."""
    app.connect("builder-inited", generate)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}

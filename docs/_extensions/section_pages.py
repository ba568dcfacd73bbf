"""A page for each section of the manual's index (`docs/README.md`), with a card for each of its pages."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from generated import write

if TYPE_CHECKING:
    # (tests read the sections without Sphinx)
    from sphinx.application import Sphinx
    from sphinx.util.typing import ExtensionMetadata

FOLDER = "generated/sections"
#: Pages that only the site has, by their section.
MADE = {
    "Compare planners": [
        ("generated/solvers/index", "All solvers", "each solver's path on three maps, promises, settings")
    ],
}
_ROW = re.compile(r"^\| \[([^\]]+)\]\(([^)]+)\.(?:md|rst)\) \| (.+) \|$", re.MULTILINE)


class Section(NamedTuple):
    """
    A section of the index.

    Attributes
    ----------
    title
        Its heading.
    text
        What stands before its table.
    pages
        Of each page its name for Sphinx, its title in tables of contents, and what it gives.
    """

    title: str
    text: str
    pages: list[tuple[str, str, str]]

    @property
    def name(self) -> str:
        """The page's name for Sphinx."""
        return f"{FOLDER}/{self.title.lower().replace(' ', '-')}"


def sections(index: str) -> list[Section]:
    """Read the sections with a table of pages."""
    found = []
    for part in index.split("\n## ")[1:]:
        title, _, rest = part.partition("\n")
        pages = [(target, shown, gives) for shown, target, gives in _ROW.findall(rest)]
        if pages:
            found.append(Section(title, rest.partition("\n|")[0].strip(), [*pages, *MADE.get(title, ())]))
    return found


def page(section: Section) -> str:
    """Write a section's page: cards to click, and its table of contents."""
    lines = [f"# {section.title}", "", section.text, "", "::::{grid} 1 1 2 2", ":gutter: 3", ""]
    for name, title, gives in section.pages:
        marked = gives.replace("tutorial:", "{bdg-primary-line}`tutorial`")
        lines += [f":::{{grid-item-card}} {title}", f":link: /{name}", ":link-type: doc", "", marked, ":::", ""]
    lines += ["::::", "", "```{toctree}", ":hidden:", ""]
    return "\n".join([*lines, *(f"{title} </{name}>" for name, title, _ in section.pages), "```", ""])


def generate(app: "Sphinx") -> None:
    """Write all pages."""
    folder = Path(app.srcdir) / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for section in sections((Path(app.srcdir) / "README.md").read_text(encoding="utf-8")):
        write(Path(app.srcdir) / f"{section.name}.md", page(section))


def setup(app: "Sphinx") -> "ExtensionMetadata":
    """Generate before any page is read."""
    app.connect("builder-inited", generate)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}

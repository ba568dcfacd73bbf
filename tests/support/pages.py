"""The README and the manual as tests read them: blocks of code, what they print, links."""

import math
import re
import shlex
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
README = ROOT / "README.md"
INDEX = ROOT / "docs" / "README.md"
#: The entrance first, then the manual.
PAGES = (
    README,
    INDEX,
    *sorted(path for path in INDEX.parent.rglob("*.md") if path != INDEX and "generated" not in path.parts),
)

#: A comment that steers a block: ``file: NAME``, ``slow`` or ``not run: WHY``.
NOTE = re.compile(r"<!-- (.+) -->")
#: The name of a file in a line of its own, which readers see and the site makes the caption of the block.
FILE = re.compile(r"\*\*`([\w.-]+)`\*\*")
#: What one run does not share with the next.
TIME = re.compile(r"[\d.,]+(e-?\d+)? (µs|ms|s|min|h)\b")
BOX = re.compile(r"[━─]+")
NUMBER = re.compile(r"[+-]?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?")
#: By how much numbers may differ, relative to them: the last digits of an optimum are those of the machine.
TOLERANCE = 1e-4


class Block(NamedTuple):
    """
    A fenced block of code on a page.

    Attributes
    ----------
    page
        Where it is.
    line
        The line of its fence, counted from 1.
    language
        As its fence says.
    text
        What is in it.
    notes
        The comments right above it, which readers do not see; a file's name, which they do, is ``file: NAME``.
    output
        What it prints, if a ``text`` block behind it says so.
    """

    page: Path
    line: int
    language: str
    text: str
    notes: tuple[str, ...] = ()
    output: str | None = None

    @property
    def place(self) -> str:
        """Page and line."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"

    def note(self, name: str) -> str | None:
        """Return what a note says: of ``file: mine.toml`` the name, of one word that word; None without it."""
        for note in self.notes:
            if note.split(":")[0] == name:
                return note.partition(":")[2].strip() or note
        return None


class Page:
    """
    One page.

    Attributes
    ----------
    path
        The file.
    text
        Its text.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.text = path.read_text(encoding="utf-8")

    @cached_property
    def blocks(self) -> list[Block]:
        """Its blocks; a ``text`` block that is no file belongs to the block before it."""
        found: list[Block] = []
        lines = self.text.splitlines()
        at = 0
        while at < len(lines):
            if lines[at].startswith("```"):
                end = next(n for n in range(at + 1, len(lines)) if lines[n] == "```")
                text = "".join(f"{line}\n" for line in lines[at + 1 : end])
                block = Block(self.path, at + 1, lines[at].removeprefix("```"), text, _notes_above(lines, at))
                if block.language.startswith("{"):
                    # a figure: the site's build runs it
                    pass
                elif block.language == "text" and not block.notes:
                    assert found, f"{block.place} is printed by nothing"
                    assert found[-1].output is None, f"{block.place}: {found[-1].place} prints it twice"
                    found[-1] = found[-1]._replace(output=text)
                else:
                    found.append(block)
                at = end
            at += 1
        return found

    @cached_property
    def prose(self) -> str:
        """Its text without blocks."""
        return re.sub(r"^```.*?^```$", "", self.text, flags=re.MULTILINE | re.DOTALL)

    @cached_property
    def links(self) -> list[str]:
        """The targets of its links and pictures."""
        return re.findall(r"\]\(([^)\s]+)\)", self.prose)

    @cached_property
    def anchors(self) -> set[str]:
        """What a link may point at on this page: its headings, as browsers of Markdown name them."""
        headings = re.findall(r"^#+ (.+)$", self.prose, flags=re.MULTILINE)
        return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}

    @cached_property
    def code(self) -> set[str]:
        """The words of everything that is set as code, in blocks and in lines."""
        spans = re.findall(r"`([^`\n]+)`", self.prose)
        return set(re.findall(r"[\w.-]*\w", " ".join([*spans, *(block.text for block in self.blocks)])))


def calls(block: Block) -> list[list[str]]:
    """Split the commands of a block into words; a backslash at the end of a line joins it to the next."""
    lines = block.text.replace("\\\n", " ").splitlines()
    return [words for line in lines if (words := shlex.split(line, comments=True))]


def put_files(page: Path, folder: Path) -> None:
    """Put the files that a page shows into a folder."""
    for block in BLOCKS:
        name = block.note("file")
        if name is not None and block.page == page:
            (folder / name).write_text(block.text, encoding="utf-8")


def _notes_above(lines: list[str], at: int) -> tuple[str, ...]:
    """Return the comments and the file's name right above a line."""
    notes: list[str] = []
    while at and (match := NOTE.fullmatch(lines[at - 1]) or FILE.fullmatch(lines[at - 1])):
        notes.insert(0, f"file: {match[1]}" if match.re is FILE else match[1])
        at -= 1
    return tuple(notes)


def agrees(stated: str, printed: str) -> bool:
    """
    Tell whether a page states what was printed.

    Times differ from run to run, and with them the widths of columns; numbers by their last digits. ``…`` stands for
    anything.
    """
    plain = _plain(stated)
    pattern = re.escape(NUMBER.sub("\0", plain)).replace("\0", f"({NUMBER.pattern})").replace("…", ".*?")
    found = re.fullmatch(pattern, _plain(printed), flags=re.DOTALL)
    pairs = zip(NUMBER.findall(plain), found.groups() if found else (), strict=False)
    return found is not None and all(_is_near(*pair) for pair in pairs)


def _is_near(stated: str, printed: str) -> bool:
    one, other = (float(text.replace(",", "")) for text in (stated, printed))
    return math.isclose(one, other, rel_tol=TOLERANCE)


def _plain(text: str) -> str:
    return " ".join(BOX.sub("─", TIME.sub("TIME", text)).split())


#: All pages, the entrance first, and all their blocks.
EVERY = [Page(path) for path in PAGES]
BLOCKS = [block for page in EVERY for block in page.blocks]

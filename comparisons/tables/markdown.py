"""Markdown: any text as one line without markup of its own, and tables."""

import re
from collections.abc import Sequence
from typing import TypeAlias

#: What a cell holds: a number is written with `DIGITS` significant digits, None as a dash.
Cell: TypeAlias = str | int | float | bool | None

DIGITS = 4
#: Whole numbers from here on get separators.
_MANY = 10_000
#: What Markdown would take for markup.
_MARKUP = re.compile(r"\\|\||(?<!\*)\*(?!\*)|<(?=[A-Za-z/!?])")


def plain(text: str) -> str:
    r"""
    Write a text in one line, with all markup escaped but **bold** words and `code`.

    Examples
    --------
    >>> print(plain("|A - A'| < <b>, in `a|b`"))
    \|A - A'\| < \<b>, in `a\|b`
    """
    parts = re.split(r"(`[^`]*`)", " ".join(text.split()))
    parts[::2] = (_MARKUP.sub(lambda found: f"\\{found[0]}", part) for part in parts[::2])
    parts[1::2] = (part.replace("|", "\\|") for part in parts[1::2])
    return "".join(parts)


def written(cell: Cell) -> str:
    """
    Write a cell of a table.

    Examples
    --------
    >>> [written(cell) for cell in (0.123456, 79800, None, True, "exact")]
    ['0.1235', '79,800', '–', 'yes', 'exact']
    """
    if cell is None or isinstance(cell, bool):
        return {None: "–", True: "yes", False: "no"}[cell]
    if isinstance(cell, int):
        return f"{cell:,}" if abs(cell) >= _MANY else str(cell)
    return f"{cell:.{DIGITS}g}" if isinstance(cell, float) else plain(cell)


def markdown_table(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """
    Write a table, columns of numbers on the right.

    Examples
    --------
    >>> print(markdown_table(["what", "size"], [("length", 0.5)]))
    |what|size|
    |---|---:|
    |length|0.5|
    """
    right = [bool(rows) and not any(isinstance(row[n], str | bool) for row in rows) for n in range(len(columns))]
    lines = [map(plain, columns), ("---:" if one else "---" for one in right), *(map(written, row) for row in rows)]
    return "\n".join(f"|{'|'.join(line)}|" for line in lines)

"""Lists of what there is, as tables; nothing else is imported for them, so that they are there at once."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.table import Table
from rich.text import Text


def listing(
    title: str, heads: Sequence[str], lines: Iterable[Mapping[str, Any]], widest: Mapping[str, int] | None = None
) -> Table:
    """
    Show records as a plain table, one column for each head; the first, names to be typed, is not folded.

    Columns in `widest` are at most so wide.
    """
    table = Table(title=title, title_justify="left", title_style="bold")
    for number, head in enumerate(heads):
        table.add_column(head, overflow="fold", no_wrap=number == 0, max_width=(widest or {}).get(head))
    for line in lines:
        table.add_row(*(Text(str(line[head])) for head in heads))
    return table

"""Tables that fit the terminal: they leave out whole columns, and say so, but cut no number in two."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self, TypeVar

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions
from rich.table import Table
from rich.text import Text

from cgla_graph._text import printable

T = TypeVar("T")
#: Columns of words are folded to this many characters before a column of numbers is left out, ...
_FOLDED = 20
#: ... and to this many where all is left out that can be.
_SQUEEZED = 8


@dataclass
class FittedTable:
    """
    A table that leaves out columns where the terminal is too narrow for all, so that no number is cut in two.

    Long words on the left are folded before that. A table that is still too wide runs over the edge of the terminal.

    Attributes
    ----------
    title
        Stands above.
    left, right
        The heads of columns of words, and those of columns of numbers that follow.
    spare
        Columns that may be left out, in order.
    notes
        Lines that stand below.
    rows
        The cells, one for each head; they appear as they are: no markup, no emoji codes.

    Examples
    --------
    >>> table = FittedTable("t", ("name",), ("length", "risk"), spare=("risk",), rows=[["a", "1.44000", "0.005833"]])
    >>> Console(width=24).print(table)
    t
    ┏━━━━━━┳━━━━━━━━━┓
    ┃ name ┃  length ┃
    ┡━━━━━━╇━━━━━━━━━┩
    │ a    │ 1.44000 │
    └──────┴─────────┘
    too narrow for: risk
    """

    title: str
    left: Sequence[str]
    right: Sequence[str]
    spare: Sequence[str] = ()
    notes: Sequence[str] = ()
    rows: list[Sequence[str]] = field(default_factory=list)

    @classmethod
    def of(
        cls,
        title: str,
        items: Iterable[T],
        left: Mapping[str, Callable[[T], str]],
        right: Mapping[str, Callable[[T], str]],
        spare: Sequence[str] = (),
        notes: Sequence[str] = (),
    ) -> Self:
        """
        Make a table with a line an item; columns are heads with functions that write an item's cell.

        Examples
        --------
        >>> FittedTable.of("t", [1.5], {"name": str}, {"half": lambda value: f"{value / 2:g}"}).rows
        [['1.5', '0.75']]
        """
        writers = [*left.values(), *right.values()]
        return cls(title, (*left,), (*right,), spare, notes, [[write(item) for write in writers] for item in items])

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Table]:
        """Yield the table with as many columns as there is room for; all text is printable."""
        rows: list[Sequence[str]] = [[printable(cell) for cell in row] for row in self.rows]
        notes = [printable(note) for note in self.notes]
        yield dataclasses.replace(self, title=printable(self.title), notes=notes, rows=rows).fitted(options)

    def fitted(self, options: ConsoleOptions) -> Table:
        """Return the table with as many columns as there is room for."""
        heads = [*self.left, *self.right]
        cells = [[head, *(row[number] for row in self.rows)] for number, head in enumerate(heads)]
        widths = dict(zip(heads, (_widest(column) for column in cells), strict=True))
        for missing, most in self._ways():
            kept = {head: width for head, width in widths.items() if head not in missing}
            folded = {head: min(kept[head], max(most, cell_len(head))) for head in self.left if head in kept}
            # two spaces a column, and a line on each side of it
            width = sum((kept | folded).values()) + 3 * len(kept) + 1
            if width <= options.max_width:
                break
        table = self._without(missing, folded)
        # rich would cut numbers
        table.width = width if width > options.max_width else None
        return table

    def _ways(self) -> Iterator[tuple[Sequence[str], int]]:
        """List what can be tried, the best first: the columns left out, and the width of words."""
        endless = max(map(_widest, zip(*self.rows, strict=True)), default=0)
        for number in range(len(self.spare) + 1):
            yield self.spare[:number], endless
            yield self.spare[:number], _FOLDED
        yield self.spare, _SQUEEZED

    def _without(self, missing: Sequence[str], widths: dict[str, int]) -> Table:
        heads = [*self.left, *self.right]
        kept = [number for number, head in enumerate(heads) if head not in missing]
        left, right = ([head for head in part if head not in missing] for part in (self.left, self.right))
        table = _table_of(self.title, left, right)
        for column, head in zip(table.columns, left, strict=False):
            column.no_wrap, column.overflow, column.width = False, "fold", widths[head]
        for row in self.rows:
            table.add_row(*(Text(row[number]) for number in kept))
        left_out = [f"too narrow for: {', '.join(head for head in heads if head in missing)}"] if missing else []
        lines = [*self.notes, *left_out]
        table.caption = Text("\n".join(lines)) if lines else None
        return table


def _widest(cells: Sequence[str]) -> int:
    """Return the width of the widest line of some cells."""
    return max((cell_len(line) for cell in cells for line in cell.splitlines()), default=0)


def _table_of(title: str, left: Sequence[str], right: Sequence[str]) -> Table:
    """Start a table: words in the columns on the left, numbers in those on the right; titles appear as they are."""
    table = Table(title=Text(title), title_justify="left", title_style="bold", caption_justify="left")
    for head in left:
        table.add_column(Text(head), no_wrap=True)
    for head in right:
        table.add_column(Text(head), justify="right", no_wrap=True)
    return table

"""The page of a picture: its style, texts, legend, and the places of its parts."""

import textwrap
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import get_font
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text

#: A row of a legend: an artist and its label.
Key: TypeAlias = tuple[Artist, str]
_PAD, _GAP = 0.1, 0.2  # inches: border, space between parts
_MOST_COVERED = 0.2  # of axes, by a legend inside them
_STYLE: dict[str, Any] = {
    "axes.linewidth": 0.6,
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same text everywhere
    "font.size": 8.5,
    "hatch.linewidth": 0.5,
    "svg.hashsalt": "cgla_graph",
    "text.parse_math": False,  # names are shown as they are, dollars too
}


@contextmanager
def style() -> Iterator[None]:
    """
    Draw in the toolkit's style and ignore the user's matplotlibrc.

    Examples
    --------
    >>> with style():
    ...     mpl.rcParams["font.size"]
    8.5
    """
    with mpl.rc_context():
        mpl.rcdefaults()
        settings: Any = mpl.rcParams  # some versions of matplotlib list every key as a type
        settings.update(_STYLE)
        yield


def add_legend(
    figure: Figure | Axes, rows: Iterable[Key], *, title: str = "", columns: int = 1, small: bool = False
) -> Legend:
    """
    Make a legend of the figure, which `arrange` places, or inside axes, where there is most room.

    Parameters
    ----------
    figure
        The figure, or axes.
    rows
        Artists and their labels, which are shown as they are.
    title
        Text above the rows; may be empty.
    columns
        Number of columns.
    small
        Whether letters and gaps are small, for small axes.
    """
    handles, labels = map(list, zip(*rows, strict=True))
    inside = isinstance(figure, Axes)
    pad: dict[str, Any] = {} if inside else {"borderaxespad": 0.0, "borderpad": 0.0, "labelspacing": 0.55}
    if small:
        pad = {"fontsize": 6.0, "labelspacing": 0.2, "borderpad": 0.3, "handletextpad": 0.5}
    legend = figure.legend(
        handles,
        [" "] * len(labels),
        title=title,
        ncols=columns,
        loc="best" if inside else "upper left",
        alignment="left",
        frameon=inside,
        handlelength=1.8 if small else 3.2,
        **pad,
    )
    legend.set_zorder(7.0)
    # set afterwards, as matplotlib leaves out labels that begin with an underscore
    for text, label in zip(legend.get_texts(), labels, strict=True):
        text.set_text(label)
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):
            # no marker reaches into the next row
            handle.set_markersize(min(handle.get_markersize(), 6.0 if small else 10.0))
    return legend


def add_table(figure: Figure, rows: Sequence[Sequence[str]]) -> Text:
    """
    Write a small table, the first column on the left and numbers on the right; `arrange` places it.

    Parameters
    ----------
    figure
        The figure.
    rows
        Cells; a row of one cell is a remark below the table.

    Examples
    --------
    >>> print(add_table(Figure(), [["", "length"], ["a", "1.25"], ["a remark"]]).get_text())
       length
    a    1.25
    a remark
    """
    tabular = [row for row in rows if len(row) > 1]
    widths = [max(len(row[i]) for row in tabular) for i in range(len(tabular[0]))] if tabular else []
    lines = []
    for row in rows:
        padded = [f"{cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=False)]
        lines.append("  ".join([f"{row[0]:<{widths[0]}}", *padded]) if len(row) > 1 else "".join(row))
    known = _glyphs("DejaVuSansMono.ttf") | {ord("\n")}
    text = "".join(char if ord(char) in known else "\N{REPLACEMENT CHARACTER}" for char in "\n".join(lines))
    return figure.text(0.0, 1.0, text, fontsize=7.0, family="DejaVu Sans Mono", linespacing=1.45, va="top", color="0.2")


def add_inner_legend(axes: Axes, rows: Sequence[Key], *, least: int, title: str = "") -> Legend | None:
    """
    Make a legend inside the user's axes, if it does not cover too much of the map.

    On small axes it gets smaller letters, then only its first rows, and then it is left out.

    Parameters
    ----------
    axes
        The axes, in their place.
    rows
        Artists and their labels.
    least
        Number of the first rows, which are the most important.
    title
        Text above the rows; may be empty.
    """
    canvas: Any = FigureCanvasAgg(axes.figure)  # type: ignore[arg-type]
    axes.apply_aspect()
    room = axes.get_window_extent(canvas.get_renderer())
    for small, some in ((False, rows), (True, rows), (True, rows[:least])):
        if not some:
            break
        legend = add_legend(axes, some, title="" if small else title, small=small)
        box = legend.get_window_extent(canvas.get_renderer())
        if box.width * box.height <= _MOST_COVERED * room.width * room.height and box.width <= room.width:
            return legend
        legend.remove()
    return None


@dataclass(frozen=True, eq=False)
class Part:
    """
    A part of a page, measured; all in inches.

    Attributes
    ----------
    artist
        Axes, a legend or a text.
    size
        Width and height: of axes without their labels.
    left, right, top, bottom
        How far labels stick out, and how far the parts below reach.
    below
        Another part, and its distance below the upper left corner of this one.
    """

    artist: Axes | Legend | Text
    size: tuple[float, float]
    left: float = 0.0
    right: float = 0.0
    top: float = 0.0
    bottom: float = 0.0
    below: tuple["Part", float] | None = None

    @classmethod
    def of(cls, figure: Figure, artist: Axes | Legend | Text, size: tuple[float, float] = (1.0, 1.0)) -> "Part":
        """Measure a legend or text, or axes of a given size without labels; for axes, the figure's size changes."""
        canvas: Any = FigureCanvasAgg(figure)  # matplotlib does not say all of its types
        renderer = canvas.get_renderer()
        if not isinstance(artist, Axes):
            extent = artist.get_window_extent(renderer)
            return cls(artist, (extent.width / figure.dpi, extent.height / figure.dpi))
        figure.set_size_inches(12.0, 12.0)
        artist.set_position((0.25, 0.25, size[0] / 12.0, size[1] / 12.0))
        inner, outer = artist.get_window_extent(renderer), artist.get_tightbbox(renderer) or artist.bbox
        sides = (inner.x0 - outer.x0, outer.x1 - inner.x1, outer.y1 - inner.y1, inner.y0 - outer.y0)
        return cls(artist, size, *(max(side / figure.dpi, 0.0) for side in sides))

    def over(self, other: "Part", gap: float) -> "Part":
        """Return this part with another part, without labels, below it and aligned with its labels on the left."""
        down = self.size[1] + self.bottom + gap
        right = max(self.right, other.size[0] + other.right - self.left - self.size[0])
        return replace(
            self, right=right, bottom=down + other.size[1] + other.bottom - self.size[1], below=(other, down)
        )

    def put(self, figure: Figure, x: float, y: float) -> None:
        """Put the upper left corner `x` inches from the left and `y` from the top of the page."""
        width, height = figure.get_size_inches().tolist()
        place = (x / width, 1.0 - y / height)
        if isinstance(self.artist, Axes):
            size = (self.size[0] / width, self.size[1] / height)
            self.artist.set_position((place[0], place[1] - size[1], *size))
        elif isinstance(self.artist, Text):
            self.artist.set_position(place)
        else:
            self.artist.set_bbox_to_anchor(place, transform=figure.transFigure)
        if self.below is not None:
            other, down = self.below
            other.put(figure, x - self.left, y + down)


def arrange(figure: Figure, heading: tuple[str, str], rows: Sequence[Sequence[Part]]) -> None:
    """
    Put rows of parts one below the other under the heading, and set the figure's size to fit.

    No layout engine of matplotlib supports maps of a fixed scale, outside legends and thin maps together: constrained
    layout fits axes into a page, and a legend beside them only if the page is high enough.

    Parameters
    ----------
    figure
        The figure.
    heading
        Name and title; an empty title takes no room.
    rows
        Rows of parts side by side, whose first parts are aligned.
    """
    left = right = _PAD + max(row[0].left for row in rows)
    places = []
    bottom = -_GAP
    for row in rows:
        x, y = left - row[0].left, bottom + _GAP + max(part.top for part in row)
        for part in row:
            x += part.left
            places.append((part, x, y))
            x += part.size[0] + part.right
            right, x = max(right, x), x + _GAP
        bottom = y + max(part.size[1] + part.bottom for part in row)
    head = _head(figure, heading, right - left)
    right, down = max(right, left + head.size[0] + head.right), _PAD + head.size[1] + head.bottom + 0.05
    figure.set_size_inches(right + _PAD, down + bottom + _PAD)
    head.put(figure, left, _PAD)
    for part, x, y in places:
        part.put(figure, x, down + y)


def _head(figure: Figure, heading: tuple[str, str], width: float) -> Part:
    """Write name and title, the title in lines of about `width` inches."""
    name, title = heading
    head = Part.of(figure, figure.text(0.0, 1.0, name, fontsize=11.0, verticalalignment="top"))
    if not title:
        return head
    text = figure.text(0.0, 1.0, title, verticalalignment="top", linespacing=1.3)
    share = width / Part.of(figure, text).size[0]
    text.set_text("\n".join(textwrap.wrap(title, max(24, int(share * len(title))))))
    return head.over(Part.of(figure, text), 0.05)


def heading(name: str, title: str, k: float | None) -> tuple[str, str]:
    """
    Return name and risk weight (None: without one), and the title, which may be empty; one line each.

    Examples
    --------
    >>> heading("one-threat", "", 10.0)
    ('one-threat,  k = 10', '')
    """
    name = plain(name, 48)
    weight = [] if k is None else [f"k = {k:g}"]
    return ",  ".join([*([name] if name else []), *weight]), plain(title, 160)


def plain(text: str, most: int) -> str:
    r"""
    Return any text as one line of at most `most` characters, without line breaks or control characters.

    Characters that the font lacks become replacement characters; a long text loses its middle.

    Examples
    --------
    >>> plain("of\n$x$ \N{ROBOT FACE}", 40), plain("rrt-star:iterations=2000", 15)
    ('of $x$ �', 'rrt-sta…ns=2000')
    """
    visible = []
    for char in text[: 50 * most]:
        kind = unicodedata.category(char)
        if char.isspace() or kind == "Cc":
            visible.append(" ")
        elif kind not in {"Cf", "Me", "Mn"} or ord(char) in _glyphs():
            visible.append(char if ord(char) in _glyphs() else "\N{REPLACEMENT CHARACTER}")
    line = " ".join("".join(visible).split())
    head = most // 2
    return line if len(line) <= most else f"{line[:head]}…{line[len(line) - (most - head - 1) :]}"


@cache
def _glyphs(file: str = "DejaVuSans.ttf") -> frozenset[int]:
    """Return the characters that a font can draw."""
    font = get_font(str(Path(mpl.get_data_path(), "fonts", "ttf", file)))
    return frozenset(int(code) for code in font.get_charmap())

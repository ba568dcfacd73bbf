"""The page of a picture: its style, its legend, and where its parts go."""

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text

_PAD, _GAP = 0.1, 0.2  # inches: border, space between parts
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
    Draw with this style, whatever the user's matplotlibrc says.

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


def add_legend(figure: Figure, handles: Sequence[Artist], labels: Sequence[str], *, title: str, columns: int) -> Legend:
    """
    Make a legend of the figure; `arrange` finds its place.

    Parameters
    ----------
    figure
        The figure.
    handles, labels
        One of each for a row: what is drawn, and what it is.
    title
        What stands above; may be empty.
    columns
        How many columns the rows are spread over.

    Returns
    -------
    legend
        Shows every label as it is.
    """
    legend = figure.legend(
        handles,
        [" "] * len(labels),
        title=title,
        ncols=columns,
        loc="upper left",
        alignment="left",
        frameon=False,
        borderaxespad=0.0,
        borderpad=0.0,
        handlelength=3.2,
        labelspacing=0.55,
    )
    # not given at once, as matplotlib leaves out labels that begin with an underscore
    for text, label in zip(legend.get_texts(), labels, strict=True):
        text.set_text(label)
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):
            handle.set_markersize(min(handle.get_markersize(), 10.0))  # no marker reaches into the next row
    return legend


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
        How far labels stand out.
    """

    artist: Axes | Legend | Text
    size: tuple[float, float]
    left: float = 0.0
    right: float = 0.0
    top: float = 0.0
    bottom: float = 0.0

    @classmethod
    def of(cls, figure: Figure, artist: Axes | Legend | Text, size: tuple[float, float] = (1.0, 1.0)) -> "Part":
        """
        Measure a legend or text, or axes that shall have a size.

        Parameters
        ----------
        figure
            What it is in; its size changes if it is axes.
        artist
            Axes, a legend or a text.
        size
            Width and height of axes without their labels, inches.
        """
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


def arrange(figure: Figure, heading: tuple[str, str], parts: Sequence[Part], *, wide: bool = False) -> None:
    """
    Put parts side by side (one below the other where `wide`) under the heading; the figure becomes as large as that.

    No layout engine of matplotlib keeps the scale of a map, legends outside and thin maps all together.

    Parameters
    ----------
    figure
        The figure.
    heading
        Name and title; an empty title takes no room.
    parts
        Measured, the map or plot first.
    wide
        Whether parts lie one below the other.
    """
    left = x = _PAD + parts[0].left
    y, right, bottom = parts[0].top, 0.0, 0.0
    places = []
    for part in parts:
        places.append((x, y))
        right, bottom = max(right, x + part.size[0] + part.right), max(bottom, y + part.size[1] + part.bottom)
        x, y = (x, bottom + _GAP) if wide else (right + _GAP, y)
    head = [Part.of(figure, text) for text in _heading_texts(figure, heading, right - left)]
    down = _PAD
    head_places = []
    for part in head:
        head_places.append((left, down))
        right, down = max(right, left + part.size[0]), down + part.size[1] + 0.05
    figure.set_size_inches(right + _PAD, down + bottom + _PAD)
    for part, place in zip(head, head_places, strict=True):
        part.put(figure, *place)
    for part, (x, y) in zip(parts, places, strict=True):
        part.put(figure, x, down + y)


def _heading_texts(figure: Figure, heading: tuple[str, str], width: float) -> Iterator[Text]:
    """Write name and title, the title in lines of about `width` inches."""
    name, title = heading
    yield figure.text(0.0, 1.0, name, fontsize=11.0, verticalalignment="top")
    if title:
        text = figure.text(0.0, 1.0, title, verticalalignment="top", linespacing=1.3)
        share = width / Part.of(figure, text).size[0]
        text.set_text("\n".join(textwrap.wrap(title, max(24, int(share * len(title))))))
        yield text

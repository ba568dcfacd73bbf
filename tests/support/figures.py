"""What tests of pictures share: names that are hard to draw, and whether a page is tidy."""

import itertools
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

HOSTILE = [
    "$x_1$",
    "$",
    "\\frac{1",
    "_hidden",
    "__nolegend__",
    "<b>&amp;]]>--</b>",
    "\U0001f9ff \N{THUMBS UP SIGN}\N{EMOJI MODIFIER FITZPATRICK TYPE-4} \u2764\ufe0f",
    "two\nlines\r\n\ttab",
    "nul\0 bell\a esc\x1b[31m",
    "\ud800 lone surrogate",
    "竞争 مرحبا עברית",
    "e\u0301\u0301\u0301 \u200f\u202e reversed",
    "W" * 5000,
    "many words " * 500,
    "",
    " ",
]


def assert_tidy(figure: Figure) -> None:
    """Check that all is on the page and no part lies over another."""
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    parts = [axes.get_tightbbox(renderer) for axes in figure.axes]
    parts += [legend.get_window_extent(renderer) for legend in figure.legends]
    parts += [text.get_window_extent(renderer) for text in figure.texts]
    for part in parts:
        assert part.x0 >= 0 and part.y0 >= 0 and part.x1 <= figure.bbox.x1 and part.y1 <= figure.bbox.y1  # noqa: PT018
    for one, other in itertools.combinations(parts, 2):
        shared = Bbox.intersection(one, other)
        assert shared is None or min(shared.width, shared.height) < 0.5
    for axes in figure.axes:
        ticks = [*axes.get_xticklabels(), *axes.get_yticklabels(), axes.xaxis.label, axes.yaxis.label]
        boxes = [tick.get_window_extent(renderer) for tick in ticks if tick.get_text() and tick.get_visible()]
        for one, other in itertools.combinations(boxes, 2):
            assert Bbox.intersection(one, other) is None

"""HTML for notebooks: a table of the fields that `repr` shows, beside a small picture."""

import base64
import io
from html import escape

from matplotlib.figure import Figure
from PIL import Image

from cgla_graph._text import fields_of
from cgla_graph.errors import CglaError
from cgla_graph.model.solution import Solution
from cgla_graph.plots.drawing import plot
from cgla_graph.plots.page import style

#: Rows of the table, at most.
MOST_ROWS = 14
#: Inches of a side of the picture, its dots per inch and its colours.
SIDE, DPI, COLOURS = 3.6, 92, 48


def html(thing: object, drawn: object = None) -> str:
    """
    Return a table of the fields of an object, beside its picture (or that of `drawn`) if there is one.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> text = html(Problem((0, 0), (1, 1), k=2.0))
    >>> "<td>k</td>" in text.replace(' style="text-align:left"', ""), "data:image/png" in text
    (True, True)
    """
    rows = list(fields_of(thing))
    if isinstance(thing, Solution) and thing.problem is None and not len(thing.path):
        rows.append(("", thing.status.value))
    left = ' style="text-align:left"'
    cells = "".join(f"<tr><td{left}>{escape(a)}</td><td{left}>{escape(b)}</td></tr>" for a, b in rows[:MOST_ROWS])
    caption = f"<caption{left}>{escape(type(thing).__name__)}</caption>"
    table = f'<table style="color:inherit">{caption}<tbody>{cells}</tbody></table>'
    picture = _picture(thing if drawn is None else drawn)
    return f'<div style="display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start">{picture}{table}</div>'


def _picture(thing: object) -> str:
    """Return the picture as a small image of few colours; empty if there is no picture."""
    drawn, file = io.BytesIO(), io.BytesIO()
    try:
        with style():
            figure = Figure((SIDE, SIDE), layout="constrained")
            plot(thing, figure.add_subplot())
            figure.savefig(drawn, format="png", dpi=DPI)
    except CglaError:
        return ""
    Image.open(drawn).convert("RGB").quantize(COLOURS).save(file, "PNG", optimize=True)
    data = base64.b64encode(file.getvalue()).decode()
    look = f"width:{96 * SIDE:.0f}px;max-width:100%"
    return f'<img alt="picture of a {type(thing).__name__}" style="{look}" src="data:image/png;base64,{data}"/>'

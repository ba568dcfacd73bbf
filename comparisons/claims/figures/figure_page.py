"""What the remade figures share: maps with routes on them, one page layout, and the files' bytes."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from matplotlib import patheffects
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cgla_graph._types import FloatArray, Point
from cgla_graph.comparisons.claims.artefact import Content
from cgla_graph.comparisons.claims.panel.settings import BOUNDS, START
from cgla_graph.comparisons.claims.paper.routes import GOAL
from cgla_graph.comparisons.plots.runs import labelled_flight
from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.plots.flight import flight_figure
from cgla_graph.plots.looks import dashes_of
from cgla_graph.plots.page import Part, add_legend, arrange, style
from cgla_graph.plots.pictures import save
from cgla_graph.plots.scene import Look, colour_of, draw_risk, line_key

#: What every figure on the map of Fig. 5 has to say.
SELECTED = (
    "The map is ours but for its threat at (0.6, 0.5), as the paper does not print its own; it was selected to agree "
    "with the paper, so that it proves nothing."
)
#: Inches: a side of a map that stands beside one other, and beside two.
WIDE, NARROW = 3.5, 2.75
#: What stands in a legend: what is drawn, and what it is.
Key = tuple[Artist, str]
_BAR = 0.12  # inches: thickness of the colour bar
_TICKS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
_HALO = [patheffects.withStroke(linewidth=2.2, foreground="white", alpha=0.9)]


@contextmanager
def page() -> Iterator[Figure]:
    """
    Give an empty figure to draw on, in the style of all pictures.

    Examples
    --------
    >>> with page() as figure:
    ...     axes = add_map(figure, RiskField(), "no threat")
    >>> axes.get_title(loc="left")
    'no threat'
    """
    with style():
        yield Figure()


def add_map(figure: Figure, field: RiskField, title: str, *, bar: bool = False) -> Axes:
    """Add a map of the unit square with its risk, from white (0) to violet (1), and the bar of colours if asked for."""
    axes = figure.add_subplot()
    drawn = draw_risk(figure, axes, Problem(START, GOAL, field, bounds=BOUNDS), wide=False)
    axes.set(xlim=BOUNDS[::2], ylim=BOUNDS[1::2], aspect="equal", xticks=_TICKS, yticks=_TICKS, xlabel="x", ylabel="y")
    axes.set_title(title, fontsize=9.0, loc="left")
    for image in axes.images:
        image.set_clim(0.0, 1.0)
    if drawn is not None and not bar:
        figure.delaxes(drawn.ax)
    return axes


def draw_route(axes: Axes, path: FloatArray, number: int, count: int, *, dashed: bool = False) -> Artist:
    """
    Draw a path, the first of several widest, so that each shows beside those on top of it; return its legend's key.

    Parameters
    ----------
    axes, path
        Where to; waypoints, shape ``(m, 2)``, map units.
    number, count
        Which of how many; its number is its colour.
    dashed
        Whether it is drawn with gaps: a path that is planned and not flown.
    """
    width = 1.5 + 1.1 * (count - 1 - number)
    look: Look = {"color": colour_of(number), "linestyle": (0, (2.5, 1.2)) if dashed else dashes_of(number)}
    axes.plot(*path.T, color="white", linewidth=width + 1.6, alpha=0.85, zorder=2.9, clip_on=False)
    axes.plot(*path.T, linewidth=width, zorder=3.0 + 0.01 * number, clip_on=False, **look)
    return line_key(linewidth=min(width, 3.0), **look)


def draw_end(axes: Axes, place: Point, *, goal: bool = False) -> Artist:
    """Draw a start (circle) or a goal (star); return its key for the legend."""
    look: Look = {"marker": "*", "markersize": 11.0} if goal else {"marker": "o", "markersize": 6.5}
    look |= {"linestyle": "none", "markerfacecolor": "white", "markeredgecolor": "0.15", "markeredgewidth": 1.2}
    axes.plot(*place, clip_on=False, zorder=5.0, **look)
    return line_key(**look)


def write_beside(axes: Axes, words: str, place: Point, shift: tuple[float, float], **look: object) -> None:
    """Write a few words near a place of the map, so many points right of and above it."""
    settings: Look = {"fontsize": 7.5, "zorder": 6.0, "path_effects": _HALO, "ha": "center", "va": "center"} | look
    axes.annotate(words, place, xytext=shift, textcoords="offset points", **settings)


def finish(
    figure: Figure,
    heading: tuple[str, str],
    rows: Sequence[Sequence[tuple[Axes, tuple[float, float]]]],
    keys: Sequence[Key],
    *,
    columns: int = 1,
) -> Figure:
    """
    Lay a page out: heading, rows of axes, and the legend below; the figure becomes as large as that.

    Parameters
    ----------
    figure, heading
        The figure; as the paper calls it, and what it shows.
    rows
        Axes side by side, with the width and height of each without labels, inches; the axes of the bars of maps that
        were added are taken along.
    keys, columns
        The legend, which may be empty, and its columns.
    """
    taken = {id(axes) for row in rows for axes, _ in row}
    bars = [(axes, (_BAR, rows[0][-1][1][1])) for axes in figure.axes if id(axes) not in taken]
    parts = [[Part.of(figure, *one) for one in row] for row in ([*rows[0], *bars], *rows[1:])]
    if keys:
        parts.append([Part.of(figure, add_legend(figure, keys, columns=columns))])
    arrange(figure, heading, parts)
    return figure


def picture(figure: Figure, caption: str) -> Content:
    """Return a figure with its caption: the same figure gives the same bytes."""
    # what writes pictures knows how to leave dates out, and writes to files
    with tempfile.TemporaryDirectory() as folder:
        png, svg = (save(figure, Path(folder, f"figure.{kind}")).read_bytes() for kind in ("png", "svg"))
    return Content(caption, png, svg)


def flights_page(heading: tuple[str, str], runs: Sequence[MissionRun]) -> Figure:
    """Draw flights as ``cgla fly`` does, but with the legend below, so that several are not too wide for a page."""
    figure = flight_figure(list(map(labelled_flight, runs)))
    with style():
        # the bar has no label below
        panels = [axes for axes in figure.axes if axes.get_xlabel()]
        for panel in panels:
            panel.set(xticks=_TICKS, yticks=_TICKS)
        (old,) = figure.legends
        pairs = zip(old.legend_handles, old.get_texts(), strict=True)
        keys = [(handle, text.get_text()) for handle, text in pairs if handle is not None]
        for artist in (*figure.texts, old):
            artist.remove()
        side, columns = {1: (1.3 * WIDE, 2), 2: (WIDE, 4)}.get(len(panels), (NARROW, 5))
        return finish(figure, heading, [[(panel, (side, side)) for panel in panels]], keys, columns=columns)

"""The picture of a corridor: what no near-optimal path leaves, what is certainly near-optimal, and the ways."""

from collections.abc import Iterator

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from cgla_graph._text import figure as digits_of
from cgla_graph._types import FloatArray
from cgla_graph.certificate.corridor import Corridor
from cgla_graph.plots.looks import COLOURS
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import Key, add_inner_legend, heading, style
from cgla_graph.plots.scene import TitledProblem, data_keys, line_key, outline, patch_key, unit_scale

#: Colours of the corridor and of what is certain in it; ways that are drawn, at most.
_OUTER, _INNER, _MOST_WAYS = "#FFB000", "#1A7F37", 6
_OPACITY = 0.35


def corridor_figure(shown: TitledProblem, corridor: Corridor, *, figure: Figure | None = None) -> Figure:
    """
    Draw a corridor over its map, whose axes are the first of the figure.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> scenario = cg.load_scenario("one-threat")
    >>> found = cg.lower_bound(scenario.problem).corridor(0.1)
    >>> [text.get_text() for text in corridor_figure(TitledProblem.of(scenario), found).legends[0].get_texts()][0]
    'contains every path within 10 %'
    """
    with style():
        base = BaseMap.of(shown, places=_places(corridor), figure=figure)
        keys = [*_draw(base.axes, corridor), *base.draw_marks(), *data_keys(shown.problem)]
        name, title = heading(shown.name, shown.title, shown.problem.k)
        base.arrange((f"{name}:  {title}" if title else name, corridor.message), [*base.parts, base.add_legend(keys)])
    return base.figure


def draw_corridor(axes: Axes, shown: TitledProblem, corridor: Corridor) -> None:
    """Draw the same on axes of the user's, with the legend inside."""
    with style():
        base = BaseMap.on(axes, shown, places=_places(corridor))
        rows = list(_draw(axes, corridor))
        add_inner_legend(axes, [*rows, *base.draw_marks()], least=len(rows))


def _places(corridor: Corridor) -> list[FloatArray]:
    """Return the corners of the box around a corridor."""
    if corridor.outer.is_empty:
        return []
    return [np.reshape(corridor.outer.bounds, (2, 2))]


def _draw(axes: Axes, corridor: Corridor) -> Iterator[Key]:
    """Draw polygons, paths and numbers of holes; yield the rows of the legend."""
    scale = unit_scale(corridor.problem)
    much = f"{100.0 * corridor.delta:g} %"
    shapes = (
        (corridor.outer, _OUTER, f"contains every path within {much}"),
        (corridor.inner, _INNER, f"cells of paths certainly within {much}"),
    )
    for number, (shape, colour, said) in enumerate(shapes):
        if not any(part.geom_type == "Polygon" for part in shapely.get_parts(shape)):
            continue
        rings = outline(shape, scale)
        axes.add_patch(PathPatch(rings, facecolor=(colour, _OPACITY), edgecolor="none", zorder=1.5 + 0.1 * number))
        axes.add_patch(PathPatch(rings, facecolor="none", edgecolor=colour, linewidth=0.8, zorder=1.7))
        yield patch_key(facecolor=(colour, _OPACITY), edgecolor=colour), said
    for number, way in enumerate(corridor.ways.known[:_MOST_WAYS]):
        if way.path is None:
            continue
        colour = COLOURS[number % len(COLOURS)]
        axes.plot(*(way.path * scale).T, color=colour, linewidth=1.4, zorder=4.0)
        yield line_key(color=colour, linewidth=1.4), f"way {number + 1}: {digits_of(way.cost * scale, 5)}, {way.passes}"
    for number, (x, y) in enumerate((corridor.ways.holes * scale).tolist(), 1):
        axes.text(x, y, str(number), ha="center", va="center", fontsize=7, zorder=5.0)

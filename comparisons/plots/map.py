"""The picture of a map: its risk, its no-fly area, and the path of every solver."""

import math
from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Rectangle
from matplotlib.path import Path as Outline
from matplotlib.ticker import MaxNLocator
from shapely import MultiPolygon, Polygon

from cgla_graph._types import Bounds
from cgla_graph.comparisons.plots.lines import lines_of, n_above
from cgla_graph.comparisons.plots.looks import Entry, entries_of
from cgla_graph.comparisons.plots.page import Part, add_legend, arrange, style
from cgla_graph.comparisons.plots.risk import draw_risk
from cgla_graph.comparisons.plots.text import cost_label, heading, others_label
from cgla_graph.comparisons.plots.units import axis_labels, cost_unit, unit_scale
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.scenarios.scenario import Scenario

_LONG, _WIDE_LONG, _SHORT = 4.8, 6.5, 0.9  # inches: longer side of the map, of a wide one, least shorter side
_WIDE = 2.5  # maps wider than this times their height have everything else below them
_BAR = 0.13  # inches: thickness of the colour bar
_ROW = 0.2  # inches that a row of the legend takes
_PEN, _DASHED, _THIN = 1.6, 1.2, 0.8  # points: width of the lines in colour, of infeasible ones, and of all others
_STEP = 0.9  # points: how much wider a line is for each better one that runs over it


def map_figure(scenario: Scenario, runs: Sequence[Run], named: Collection[str] = ()) -> Figure:
    """
    Draw a map with its risk, its no-fly area and the path of every solver.

    Parameters
    ----------
    scenario
        The map.
    runs
        Its runs. Of a solver's seeds the median run is drawn. Of many solvers the best are drawn in colour, the others
        in grey (see `entries_of`); those within the width of a pen of a better one are in its line.
    named
        Labels of solvers that are drawn in colour in any case.

    Returns
    -------
    figure
        Axes are map units, or kilometres where the map has longitudes and latitudes.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> figure = map_figure(load_scenario("paper"), [])
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y', 'risk per unit length']
    """
    entries = entries_of(runs, named)
    scale = unit_scale(scenario)
    with style():
        figure = Figure()
        axes = figure.add_subplot()
        size, inches = _frame_map(axes, scenario, entries)
        wide = size[0] > _WIDE * size[1]
        bar = draw_risk(figure, axes, scenario, wide=wide)
        drawn = [*_draw_paths(axes, entries, scale, _PEN / 72.0 / inches), *_draw_marks(axes, scenario)]
        handles, labels = [handle for handle, _ in drawn], [label for _, label in drawn]
        title = f"cost{cost_unit(scenario)}" if entries else ""
        rows = max(8, int(size[1] / _ROW) - 1)
        columns = max(1, int(size[0] / 2.1)) if wide else math.ceil(len(labels) / rows)
        legend = add_legend(figure, handles, labels, title=title, columns=columns)
        parts = [Part.of(figure, axes, size)]
        if bar is not None:
            parts.append(Part.of(figure, bar.ax, (min(3.0, size[0]), _BAR) if wide else (_BAR, size[1])))
        arrange(figure, heading(scenario), [*parts, Part.of(figure, legend)], wide=wide)
    return figure


def _frame_map(axes: Axes, scenario: Scenario, entries: Sequence[Entry]) -> tuple[tuple[float, float], float]:
    """Set limits and labels; return the width and height of the map, inches, and the inches of one unit."""
    (x_min, y_min, x_max, y_max), inches = _view(scenario, entries)
    axes.set_xlim(x_min, x_max)
    axes.set_ylim(*((y_max, y_min) if scenario.y_down else (y_min, y_max)))
    axes.set_aspect("equal")
    axes.set_facecolor("0.92")  # outside the bounds, where a path leaves them or the map is very thin
    size = (x_max - x_min) * inches, (y_max - y_min) * inches
    axes.xaxis.set_major_locator(MaxNLocator(max(1, int(1.3 * size[0])), steps=[1, 2, 5, 10], min_n_ticks=1))
    axes.yaxis.set_major_locator(MaxNLocator(max(2, int(1.3 * size[1])), steps=[1, 2, 5, 10]))
    x_label, y_label = axis_labels(scenario)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    return size, inches


def _view(scenario: Scenario, entries: Sequence[Entry]) -> tuple[Bounds, float]:
    """
    Choose what part of the plane is shown, and the inches of one unit.

    It is the bounds, and some room where an infeasible path leaves them; a thin map gets room on both sides.
    """
    scale = unit_scale(scenario)
    low, high = np.reshape(scenario.problem.bounds, (2, 2)) * scale
    room = 0.1 * (high - low).max()
    for entry in entries:
        if entry.infeasible and len(entry.path):
            low = np.minimum(low, np.maximum(entry.path.min(axis=0) * scale, low - room))
            high = np.maximum(high, np.minimum(entry.path.max(axis=0) * scale, high + room))
    width, height = high - low
    inches = (_WIDE_LONG if width > _WIDE * height else _LONG) / max(width, height)
    lacking = np.maximum(_SHORT / inches - (high - low), 0.0)
    low, high = low - 0.5 * lacking, high + 0.5 * lacking
    return (float(low[0]), float(low[1]), float(high[0]), float(high[1])), float(inches)


def _draw_paths(axes: Axes, entries: Sequence[Entry], scale: float, pen: float) -> Iterator[tuple[Artist, str]]:
    """Draw the paths, the best on top, those within the width of a pen as one; yield handles and labels."""
    with_path = [entry for entry in entries if len(entry.path)]
    lines = lines_of([entry for entry in with_path if entry.stands_out], pen / scale)
    drawn = _draw_lines(axes, [line[0] for line in lines], scale, pen)
    for handle, line in zip(drawn, lines, strict=True):
        yield handle, cost_label(line[0], scale)
        for entry in line[1:]:
            yield Line2D([], [], linestyle="none"), f"{cost_label(entry, scale)}, same line"
    for entry in entries:
        if entry.stands_out and not len(entry.path):
            yield Line2D([], [], linestyle="none"), cost_label(entry, scale)
    others = [entry for entry in with_path if not entry.stands_out]
    for infeasible in (False, True):
        alike = [entry for entry in others if entry.infeasible is infeasible]
        for handle in [_draw_path(axes, entry, scale, _THIN, 3.0) for entry in alike][:1]:
            yield handle, others_label(len(alike), "infeasible" if infeasible else "")
    if without := [entry for entry in entries if not entry.stands_out and not len(entry.path)]:
        yield Line2D([], [], linestyle="none"), others_label(len(without), "without a path")


def _draw_lines(axes: Axes, entries: Sequence[Entry], scale: float, pen: float) -> list[Artist]:
    """Draw those in colour, each as wide as shows it beside the better ones that run over it; return the lines."""
    # infeasible ones lie on top, with gaps through which those below are seen
    below = [entry.path for entry in entries if not entry.infeasible]
    widths = [_PEN + _STEP * count for count in n_above(below, pen / scale)]
    widths += [_DASHED] * (len(entries) - len(below))
    halo = LineCollection(
        [entry.path * scale for entry in entries],
        linewidths=[width + 1.4 for width in widths],
        colors="white",
        alpha=0.85,
        zorder=3.4,
    )
    axes.add_collection(halo, autolim=False)
    return [
        _draw_path(axes, entry, scale, width, 4.0 + 0.5 * entry.infeasible - 0.01 * depth)
        for depth, (entry, width) in enumerate(zip(entries, widths, strict=True))
    ]


def _draw_path(axes: Axes, entry: Entry, scale: float, width: float, zorder: float) -> Artist:
    """Draw one path; return the line."""
    path = entry.path
    (line,) = axes.plot(
        *(path.T * scale),
        color=entry.colour,
        linestyle=entry.dashes,
        linewidth=width,
        # a path of one point, or of equal points, has no line to see
        marker="o" if (path == path[0]).all() else "none",
        markersize=15.0 + 3.0 * width,
        clip_on=entry.infeasible,
        solid_joinstyle="round",
        dash_capstyle="butt",
        zorder=zorder,
    )
    return line


def _draw_marks(axes: Axes, scenario: Scenario) -> Iterator[tuple[Artist, str]]:
    """Draw start, goal and no-fly area; yield handles and labels of the legend."""
    problem, scale = scenario.problem, unit_scale(scenario)
    around = 15.0 if problem.start == problem.goal else 8.0
    for name, end, marker, size in (("start", problem.start, "o", around), ("goal", problem.goal, "*", 12.0)):
        (mark,) = axes.plot(
            end[0] * scale,
            end[1] * scale,
            linestyle="none",
            marker=marker,
            markersize=size,
            markerfacecolor="white",
            markeredgecolor="black",
            clip_on=False,
            zorder=5,
        )
        yield mark, name
    if problem.model.area.is_empty:
        return
    outline = _outline(problem.model.area.geometry, scale)
    x_min, y_min, x_max, y_max = np.multiply(problem.bounds, scale).tolist()
    inside = Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, transform=axes.transData)
    # two patches, as the hatch of one has the colour of its edge
    looks: tuple[dict[str, Any], ...] = (
        {"facecolor": "0.85", "edgecolor": "0.6", "hatch": "////", "linewidth": 0.0},
        {"facecolor": "none", "edgecolor": "0.25", "linewidth": 0.7},
    )
    for look in looks:
        axes.add_patch(PathPatch(outline, **look, zorder=2)).set_clip_path(inside)
    yield Patch(**looks[0] | {"edgecolor": "0.25", "linewidth": 0.7}), "no-fly area"


def _outline(area: Polygon | MultiPolygon, scale: float) -> Outline:
    """Return the rings of polygons; holes run the other way round than shells, so that they stay empty."""
    polygons = [area] if isinstance(area, Polygon) else area.geoms
    rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
    return Outline.make_compound_path(*(Outline(np.asarray(ring.coords) * scale, closed=True) for ring in rings))

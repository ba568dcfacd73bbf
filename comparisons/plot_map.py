"""The picture of a map: its risk, its no-fly area, and the path of every solver."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Rectangle
from matplotlib.path import Path as Outline
from matplotlib.ticker import MaxNLocator
from shapely import MultiPolygon, Polygon

from cgla_graph._types import Bounds
from cgla_graph.comparisons.plot_page import Part, add_legend, arrange, style
from cgla_graph.comparisons.plot_risk import draw_risk
from cgla_graph.comparisons.plot_solvers import Entry, entries_of
from cgla_graph.comparisons.plot_text import cost_label, heading
from cgla_graph.comparisons.plot_units import axis_labels, cost_unit, unit_scale
from cgla_graph.comparisons.runner import Run
from cgla_graph.scenario import Scenario

_LONG, _WIDE_LONG, _SHORT = 4.8, 6.5, 0.9  # inches: longer side of the map, of a wide one, least shorter side
_WIDE = 2.5  # maps wider than this times their height have everything else below them
_BAR = 0.13  # inches: thickness of the colour bar
_ROW = 0.2  # inches that a row of the legend takes


def map_figure(scenario: Scenario, runs: Sequence[Run]) -> Figure:
    """
    Draw a map with its risk, its no-fly area and the path of every solver.

    Parameters
    ----------
    scenario
        The map.
    runs
        Its runs. Of a solver's seeds the one with the least cost is drawn; solvers without a path are in the legend.

    Returns
    -------
    figure
        Axes are map units, or kilometres where the map has longitudes and latitudes.

    Examples
    --------
    >>> from cgla_graph.scenario import load_scenario
    >>> figure = map_figure(load_scenario("paper"), [])
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y', 'risk per unit length']
    """
    entries = entries_of(runs)
    scale = unit_scale(scenario)
    with style():
        figure = Figure()
        axes = figure.add_subplot()
        size = _frame_map(axes, scenario, entries)
        wide = size[0] > _WIDE * size[1]
        bar = draw_risk(figure, axes, scenario, wide=wide)
        handles, labels = _draw_paths(axes, entries, scale)
        for handle, label in _draw_marks(axes, scenario):
            handles.append(handle)
            labels.append(label)
        title = f"cost{cost_unit(scenario)}" if entries else ""
        rows = max(8, int(size[1] / _ROW) - 1)
        columns = max(1, int(size[0] / 2.1)) if wide else math.ceil(len(labels) / rows)
        legend = add_legend(figure, handles, labels, title=title, columns=columns)
        parts = [Part.of(figure, axes, size)]
        if bar is not None:
            parts.append(Part.of(figure, bar.ax, (min(3.0, size[0]), _BAR) if wide else (_BAR, size[1])))
        arrange(figure, heading(scenario), [*parts, Part.of(figure, legend)], wide=wide)
    return figure


def _frame_map(axes: Axes, scenario: Scenario, entries: Sequence[Entry]) -> tuple[float, float]:
    """Set limits and labels; return the width and height of the map, inches."""
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
    return size


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


def _draw_paths(axes: Axes, entries: Sequence[Entry], scale: float) -> tuple[list[Artist], list[str]]:
    """Draw one path for each solver; return handles and labels of the legend, in the order of the entries."""
    # exact solvers go below: their paths are wide, so that each shows beside the next
    order = sorted(entries, key=lambda entry: (entry.infeasible, not entry.best.exact, entry.number))
    drawn = [entry for entry in order if len(entry.path)]
    above = [sum(entry.covers(other) for other in drawn[i + 1 :]) for i, entry in enumerate(drawn)]
    step = min(1.3, 8.0 / max([1, *above]))
    handles: dict[int, Artist] = {entry.number: Line2D([], [], linestyle="none") for entry in entries}
    for depth, (entry, below) in enumerate(zip(drawn, above, strict=True)):
        width = (1.0 if entry.infeasible else 1.4) + step * below
        on_another = any(other.covers(entry) for other in drawn[:depth])
        halo = [patheffects.withStroke(linewidth=width + 1.4, foreground="white", alpha=0.85)]
        (line,) = axes.plot(
            *(entry.path.T * scale),
            color=entry.colour,
            linestyle=entry.dashes,
            linewidth=width,
            # a path of one point, or of equal points, has no line to see
            marker="o" if (entry.path == entry.path[0]).all() else "none",
            markersize=15.0 + 3.0 * width,
            clip_on=entry.infeasible,
            solid_joinstyle="round",
            dash_capstyle="butt",
            zorder=3.0 + 0.01 * depth,
            path_effects=[] if on_another else halo,
        )
        handles[entry.number] = line
    return [handles[entry.number] for entry in entries], [cost_label(entry, scale) for entry in entries]


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

"""The picture of a map: its risk, its no-fly area, and the path of every solver, alike ones as one."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, FloatArray
from cgla_graph.comparisons.numbers import at_most, rounded_down
from cgla_graph.comparisons.numbers import figure as digits
from cgla_graph.comparisons.plots.looks import Entry, cost_label, entries_of, others_label
from cgla_graph.comparisons.plots.page import (
    Key,
    Part,
    add_inner_legend,
    add_legend,
    add_table,
    arrange,
    heading,
    plain,
    style,
)
from cgla_graph.comparisons.plots.scene import (
    area_key,
    axis_labels,
    clip_to_bounds,
    cost_unit,
    data_keys,
    draw_area,
    draw_mark,
    draw_risk,
    unit_scale,
)
from cgla_graph.comparisons.plots.view import label_degrees, name_areas, view_of
from cgla_graph.comparisons.study.rows import scenario_bound
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.scenarios.scenario import Scenario

_LONG, _WIDE_LONG, _SHORT = 4.8, 6.5, 0.9  # inches: longer side of the map, of a wide one, least shorter side
_WIDE = 2.5  # maps wider than this times their height have everything else below them
_BAR = 0.13  # inches: thickness of the colour bar
_TABLE_GAP, _LEAST_COLUMN = 0.25, 4.2  # inches: above a table, and how high the column beside the map may be at least
_ROW = 0.2  # inches that a row of the legend takes
_PEN, _DASHED, _THIN = 1.6, 1.2, 0.8  # points: width of the lines in colour, of infeasible ones, and of all others
_STEP = 0.9  # points: how much wider a line is for each better one that runs over it
#: Between its corners, a segment is looked at every so many parts of its length.
_PARTS = 0.25
#: Corners that stand out less than this part of the pen's width are left out.
_FINE = 0.125
#: A line runs over another one where this part of the other one's length lies within its width.
_SHARED = 0.3


def map_figure(
    scenario: Scenario, runs: Sequence[Run], named: Collection[str] = (), *, figure: Figure | None = None
) -> Figure:
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
    figure
        An empty one to draw on; None makes one.

    Returns
    -------
    figure
        The first axes are the map's: map units, or kilometres where the map has longitudes and latitudes.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> figure = map_figure(load_scenario("paper"), [])
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y', 'risk per unit length']
    """
    entries = entries_of(runs, named)
    with style():
        base = BaseMap.of(scenario, entries, figure=figure)
        keys = [*base.draw_paths(entries), *base.draw_marks()]
        base.name_areas([entry.path for entry in entries])
        legend = base.add_legend(keys, f"cost{cost_unit(scenario)}" if entries else "")
        base.arrange(heading(scenario), [*base.parts, *base.with_table(legend, numbers_table(scenario, runs, entries))])
    return base.figure


def numbers_table(scenario: Scenario, runs: Sequence[Run], entries: Sequence[Entry]) -> list[list[str]]:
    """Write what else is to be known of the paths in colour: their gap to the proven bound, length and risk."""
    scale, bound = unit_scale(scenario), scenario_bound(runs)
    shown = [entry for entry in entries if entry.stands_out and len(entry.path) and not entry.infeasible]
    if not shown:
        return []
    proven = 0.0 < bound < math.inf
    unit = "" if scenario.projection is None else " km"
    table = [["", *(["gap at most"] if proven else []), f"length{cost_unit(scenario)}", "risk"]]
    for entry in shown:
        solution = entry.shown.solution
        gap = [at_most(max(solution.cost / bound - 1.0, 0.0))] if proven else []
        table.append([plain(entry.label, 20), *gap, digits(solution.length * scale, 5), digits(solution.risk, 4)])
    if proven:
        table.append([])
        table.append([f"no path costs less than {rounded_down(bound * scale, 5)}{unit}"])
    return table


def draw_map(axes: Axes, scenario: Scenario, runs: Sequence[Run]) -> None:
    """Draw the same on axes of the user's, with the legend inside and no bar of colours."""
    entries = entries_of(runs)
    with style():
        base = BaseMap.on(axes, scenario, entries)
        rows = list(base.draw_paths(entries))
        title = f"cost{cost_unit(scenario)}" if entries else ""
        add_inner_legend(axes, [*rows, *base.draw_marks()], least=len(rows), title=title)


@dataclass(frozen=True, eq=False)
class BaseMap:
    """
    A map with its risk and nothing else, for pictures to add to.

    Attributes
    ----------
    scenario
        The map.
    figure, axes, bar
        Where it is drawn, and the axes of its colour bar; None where there is no risk.
    size, inches
        Width and height of the map, and of one unit of its axes, inches.
    part
        What of the map is shown, map units.
    """

    scenario: Scenario
    figure: Figure
    axes: Axes
    bar: Axes | None
    size: tuple[float, float]
    inches: float
    part: Bounds

    @classmethod
    def of(
        cls,
        scenario: Scenario,
        entries: Sequence[Entry] = (),
        *,
        places: Sequence[FloatArray] = (),
        figure: Figure | None = None,
    ) -> "BaseMap":
        """Draw the risk where solvers' paths and other places (map units) are, and where infeasible paths leave it."""
        figure = figure or Figure()
        axes = figure.add_subplot()
        size, inches, part = _frame_map(axes, scenario, entries, places)
        bar = draw_risk(figure, axes, scenario, wide=size[0] > _WIDE * size[1], part=part)
        return cls(scenario, figure, axes, None if bar is None else bar.ax, size, inches, part)

    @classmethod
    def on(
        cls, axes: Axes, scenario: Scenario, entries: Sequence[Entry] = (), *, places: Sequence[FloatArray] = ()
    ) -> "BaseMap":
        """Draw the same on axes that are there, which keep their place; without a bar of colours."""
        figure = axes.figure
        while not isinstance(figure, Figure):
            figure = figure.figure  # of a figure inside another one
        *_, part = _frame_map(axes, scenario, entries, places)
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        width, height = abs(right - left), abs(high - low)
        room = axes.get_window_extent()
        inches = min(room.width / width, room.height / height) / figure.dpi
        draw_risk(figure, axes, scenario, with_bar=False, part=part)
        return cls(scenario, figure, axes, None, (width * inches, height * inches), inches, part)

    @property
    def wide(self) -> bool:
        """Whether everything else stands below the map."""
        return self.size[0] > _WIDE * self.size[1]

    @property
    def parts(self) -> list[Part]:
        """The map and its colour bar, measured."""
        parts = [Part.of(self.figure, self.axes, self.size)]
        if self.bar is not None:
            thin = (min(3.0, self.size[0]), _BAR) if self.wide else (_BAR, self.size[1])
            parts.append(Part.of(self.figure, self.bar, thin))
        return parts

    def add_legend(self, keys: Sequence[Key], title: str = "", width: float = 2.1) -> Part:
        """Make a legend as high as the map, or below a wide one with rows of so many inches; return it measured."""
        rows = max(8, int(self.size[1] / _ROW) - 1)
        columns = max(1, int(self.size[0] / width)) if self.wide else math.ceil(len(keys) / rows)
        return Part.of(self.figure, add_legend(self.figure, keys, title=title, columns=columns))

    def with_table(self, legend: Part, table: Sequence[Sequence[str]]) -> list[Part]:
        """Put a table below a legend where there is room for it beside the map; beside or below a wide map, anyway."""
        if not table:
            return [legend]
        text = add_table(self.figure, table)
        part = Part.of(self.figure, text)
        if not self.wide and legend.size[1] + _TABLE_GAP + part.size[1] > max(self.size[1], _LEAST_COLUMN):
            text.remove()
            return [legend]
        return [legend.over(part, _TABLE_GAP)]

    def arrange(self, heading: tuple[str, str], parts: Sequence[Part]) -> None:
        """Put parts beside each other; below each other where the map is wide."""
        arrange(self.figure, heading, [[part] for part in parts] if self.wide else [parts])

    def draw_paths(self, entries: Sequence[Entry]) -> Iterator[Key]:
        """Draw the paths of solvers, those within the width of a pen as one; yield the rows of the legend."""
        yield from _draw_paths(self.axes, entries, unit_scale(self.scenario), _PEN / 72.0 / self.inches)

    def name_areas(self, paths: Sequence[FloatArray]) -> None:
        """Write the names of areas where they hide neither each other nor paths (map units); the size is final then."""
        self.figure.set_size_inches(12.0, 12.0)
        self.axes.set_position((0.1, 0.1, self.size[0] / 12.0, self.size[1] / 12.0))
        ends = [np.array([end]) for end in (self.scenario.problem.start, self.scenario.problem.goal)]
        name_areas(self.axes, self.scenario.areas, unit_scale(self.scenario), [*paths, *ends])

    def draw_marks(self) -> Iterator[Key]:
        """Draw start, goal and no-fly area; yield the legend's rows."""
        problem, scale = self.scenario.problem, unit_scale(self.scenario)
        around = 15.0 if problem.start == problem.goal else 8.0
        for name, end, marker, size in (("start", problem.start, "o", around), ("goal", problem.goal, "*", 12.0)):
            place = np.multiply(end, scale)
            yield draw_mark(self.axes, place, marker, size, markeredgecolor="black", clip_on=False, zorder=5), name
        if not problem.area.is_empty:
            clip_to_bounds(self.axes, problem.bounds, draw_area(self.axes, problem.area.geometry, scale), scale)
            yield area_key(), "no-fly area"
        if problem.clearance > 0.0 and not problem.area.is_empty:
            look: dict[str, Any] = {"color": "0.35", "linestyle": (0, (2, 2)), "linewidth": 0.8}
            for ring in shapely.get_rings(shapely.get_parts(problem.model.area.geometry)):
                lines = self.axes.plot(*(shapely.get_coordinates(ring) * scale).T, **look, zorder=2.5)
                clip_to_bounds(self.axes, problem.bounds, lines, scale)
            yield Line2D([], [], **look), f"clearance {problem.clearance:g}{' m' if self.scenario.projection else ''}"
        yield from data_keys(problem)


def _frame_map(
    axes: Axes, scenario: Scenario, entries: Sequence[Entry], places: Sequence[FloatArray]
) -> tuple[tuple[float, float], float, Bounds]:
    """Set limits and labels; return the size of the map and of one unit, inches, and what part of it is shown."""
    problem, scale = scenario.problem, unit_scale(scenario)
    view = view_of(
        problem.bounds,
        np.array([problem.start, problem.goal], dtype=np.float64),
        [*(entry.path for entry in entries if len(entry.path) and not entry.infeasible), *places],
        [entry.path for entry in entries if len(entry.path) and entry.infeasible],
        crop=scenario.projection is not None,
    )
    low, high = np.reshape(view.frame, (2, 2)) * scale
    width, height = high - low
    inches = float((_WIDE_LONG if width > _WIDE * height else _LONG) / max(width, height))
    # a thin map gets room on both sides
    lacking = np.maximum(_SHORT / inches - (high - low), 0.0)
    (x_min, y_min), (x_max, y_max) = low - 0.5 * lacking, high + 0.5 * lacking
    axes.set_xlim(x_min, x_max)
    axes.set_ylim(*((y_max, y_min) if scenario.y_down else (y_min, y_max)))
    axes.set_aspect("equal")
    axes.set_facecolor("0.92")  # outside the bounds, where a path leaves them or the map is very thin
    size = float(x_max - x_min) * inches, float(y_max - y_min) * inches
    if scenario.projection is not None:
        label_degrees(axes, scenario.projection, (max(2, int(1.1 * size[0])), max(2, int(1.6 * size[1]))))
        return size, inches, view.part
    axes.xaxis.set_major_locator(MaxNLocator(max(1, int(1.3 * size[0])), steps=[1, 2, 5, 10], min_n_ticks=1))
    axes.yaxis.set_major_locator(MaxNLocator(max(2, int(1.3 * size[1])), steps=[1, 2, 5, 10]))
    x_label, y_label = axis_labels(scenario)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    return size, inches, view.part


def _draw_paths(axes: Axes, entries: Sequence[Entry], scale: float, pen: float) -> Iterator[Key]:
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


def lines_of(entries: Sequence[Entry], pen: float) -> list[list[Entry]]:
    """
    Put solvers together whose paths are one line, in order: the first of each is the one to draw.

    A path that may be flown is in none with one that may not.
    """
    kinds = ([entry for entry in entries if entry.infeasible is infeasible] for infeasible in (False, True))
    return [
        [kind[number] for number in together]
        for kind in kinds
        for together in one_line([one.path for one in kind], pen)
    ]


def one_line(paths: Sequence[FloatArray], pen: float) -> list[list[int]]:
    """
    Group paths that no pen can draw apart.

    Parameters
    ----------
    paths
        Shape ``(n, 2)`` each, at least one point; the ones to be drawn before others come first.
    pen
        The width of a line, in units of the paths.

    Returns
    -------
    groups
        The numbers of the paths, in order. The first of each group leads it: all others have no point further than
        `pen` from it, nor it from them.

    Examples
    --------
    >>> straight = np.array([(0.0, 0.0), (1.0, 1.0)])
    >>> one_line([straight, straight + 0.1, straight + 1e-4], pen=0.001)
    [[0, 2], [1]]
    """
    lines = [_line(path, pen) for path in paths]
    groups: list[list[int]] = []
    for number, line in enumerate(lines):
        for group in groups:
            if shapely.hausdorff_distance(lines[group[0]], line, densify=_PARTS) <= pen:
                group.append(number)
                break
        else:
            groups.append([number])
    return groups


def n_above(paths: Sequence[FloatArray], pen: float) -> list[int]:
    """
    Count for each path the ones before it that run over it for a while, so that a wider line shows it beside them.

    Parameters
    ----------
    paths
        Shape ``(n, 2)`` each, at least one point; the first is drawn on top.
    pen
        The width of a line, in units of the paths.

    Examples
    --------
    >>> straight = np.array([(0.0, 0.0), (1.0, 1.0)])
    >>> bent, aside = np.array([(0.0, 0.0), (0.5, 0.5), (1.0, 0.5)]), straight + (0.0, 0.1)
    >>> n_above([straight, bent, aside], pen=0.001)
    [0, 1, 0]
    """
    lines = [_line(path, pen) for path in paths]
    around = [line.buffer(pen) for line in lines]
    return [
        sum(line.intersection(other).length > _SHARED * line.length for other in around[:number])
        for number, line in enumerate(lines)
    ]


def _line(path: FloatArray, pen: float) -> BaseGeometry:
    """Return a path as a line, without what is too fine to be seen; one of a point too."""
    return LineString(np.vstack([path, path[-1:]])).simplify(_FINE * pen)

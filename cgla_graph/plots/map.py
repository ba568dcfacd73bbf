"""The picture of a map: its risk, its no-fly area, and the path of every solver, coinciding paths as one line."""

import math
from collections.abc import Iterator, Sequence
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

from cgla_graph._text import at_most, rounded_down
from cgla_graph._text import figure as digits
from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.problem import Problem
from cgla_graph.people.units import risk_unit
from cgla_graph.plots.looks import LabelledPath, others_label
from cgla_graph.plots.page import (
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
from cgla_graph.plots.scene import (
    TitledProblem,
    area_key,
    clip_to_bounds,
    cost_unit,
    data_keys,
    draw_area,
    draw_mark,
    draw_risk,
    unit_scale,
    write_beside,
)
from cgla_graph.plots.view import label_degrees, name_areas, view_of

_LONG, _WIDE_LONG, _SHORT = 4.8, 6.5, 0.9  # inches: longer side of the map, of a wide one, least shorter side
_WIDE = 2.5  # maps wider than this times their height have all other parts below them
_BAR = 0.13  # inches: thickness of the colour bar
_TABLE_GAP, _LEAST_COLUMN = 0.25, 4.2  # inches: above a table, and how high the column beside the map may be at least
_ROW = 0.2  # inches that a row of the legend takes
_PEN, _DASHED, _THIN = 1.6, 1.2, 0.8  # points: width of the lines in colour, of infeasible ones, and of all others
_STEP = 0.9  # points: how much wider a line is for each better one that covers it
#: Distances between lines are sampled at these parts of the length of each segment.
_PARTS = 0.25
#: Corners that stand out less than this part of the pen's width are removed.
_FINE = 0.125
#: A line covers another one if this part of the other one's length is within its width.
_SHARED = 0.3


def map_figure(
    shown: TitledProblem, paths: Sequence[LabelledPath], bound: float = math.nan, *, figure: Figure | None = None
) -> Figure:
    """
    Draw a map with its risk, its no-fly area and labelled paths.

    Parameters
    ----------
    shown
        The map.
    paths
        The best first. Those that stand out are drawn in colour, the others in grey; those within a pen's width of a
        better one are drawn as its line.
    bound
        A proven lower bound of the cost of every path, map units, for the table of the paths in colour; NaN: none.
    figure
        An empty one to draw on; None makes one.

    Returns
    -------
    figure
        The first axes are the map's: map units, or kilometres where the map has longitudes and latitudes.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> figure = map_figure(TitledProblem.of(load_scenario("paper")), [])
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y', 'risk per unit length']
    """
    problem = shown.problem
    with style():
        base = BaseMap.of(shown, paths, figure=figure)
        keys = [*base.draw_paths(paths), *base.draw_marks(), *base.draw_places(paths)]
        base.name_areas([one.path for one in paths])
        legend = base.add_legend(keys, f"cost{cost_unit(problem)}" if paths else "")
        table = numbers_table(problem, paths, bound)
        base.arrange(heading(shown.name, shown.title, problem.k), [*base.parts, *base.with_table(legend, table)])
    return base.figure


def numbers_table(problem: Problem, paths: Sequence[LabelledPath], bound: float) -> list[list[str]]:
    """Return a table of the gap to a proven bound, the length and the risk of the paths in colour."""
    scale = unit_scale(problem)
    rows = [one for one in paths if one.stands_out and len(one.path) and not one.infeasible]
    if not rows:
        return []
    proven = 0.0 < bound < math.inf
    unit = "" if problem.projection is None else " km"
    table = [["", *(["gap at most"] if proven else []), f"length{cost_unit(problem)}", "risk"]]
    for one in rows:
        solution = one.solution
        gap = [at_most(max(solution.cost / bound - 1.0, 0.0))] if proven else []
        table.append([plain(one.label, 20), *gap, digits(solution.length * scale, 5), digits(solution.risk, 4)])
    if proven:
        table.append([])
        what = "no tour" if any(len(one.places) for one in rows) else "no path"
        table.append([f"{what} costs less than {rounded_down(bound * scale, 5)}{unit}"])
    if of_risk := risk_unit(problem.field):
        table += [[], [f"risk in {of_risk}"]]
    return table


def draw_map(axes: Axes, shown: TitledProblem, paths: Sequence[LabelledPath]) -> None:
    """Draw the same on axes of the user's, with the legend inside and no bar of colours."""
    with style():
        base = BaseMap.on(axes, shown, paths)
        rows = list(base.draw_paths(paths))
        title = f"cost{cost_unit(shown.problem)}" if paths else ""
        marks = [*base.draw_marks(), *base.draw_places(paths)]
        add_inner_legend(axes, [*rows, *marks], least=len(rows), title=title)


@dataclass(frozen=True, eq=False)
class BaseMap:
    """
    A map with its risk, which pictures add other parts to.

    Attributes
    ----------
    shown
        The map.
    figure, axes, bar
        Where it is drawn, and the axes of its colour bar; None where there is no risk.
    size, inches
        Width and height of the map, and of one unit of its axes, inches.
    part
        The part of the map in the picture, map units.
    """

    shown: TitledProblem
    figure: Figure
    axes: Axes
    bar: Axes | None
    size: tuple[float, float]
    inches: float
    part: Bounds

    @classmethod
    def of(
        cls,
        shown: TitledProblem,
        paths: Sequence[LabelledPath] = (),
        *,
        places: Sequence[FloatArray] = (),
        figure: Figure | None = None,
    ) -> "BaseMap":
        """Draw the risk around paths and places (map units), with room for infeasible paths that leave the map."""
        figure = figure or Figure()
        axes = figure.add_subplot()
        size, inches, part = _frame_map(axes, shown, paths, places)
        bar = draw_risk(figure, axes, shown.problem, wide=size[0] > _WIDE * size[1], part=part)
        return cls(shown, figure, axes, None if bar is None else bar.ax, size, inches, part)

    @classmethod
    def on(
        cls, axes: Axes, shown: TitledProblem, paths: Sequence[LabelledPath] = (), *, places: Sequence[FloatArray] = ()
    ) -> "BaseMap":
        """Draw the same on existing axes, which keep their place, without a colour bar."""
        figure = axes.figure
        while not isinstance(figure, Figure):
            figure = figure.figure  # of a figure inside another one
        *_, part = _frame_map(axes, shown, paths, places)
        (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
        width, height = abs(right - left), abs(high - low)
        room = axes.get_window_extent()
        inches = min(room.width / width, room.height / height) / figure.dpi
        draw_risk(figure, axes, shown.problem, with_bar=False, part=part)
        return cls(shown, figure, axes, None, (width * inches, height * inches), inches, part)

    @property
    def wide(self) -> bool:
        """Whether all other parts are below the map."""
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
        """Make a legend as high as the map, or below a wide map with columns of `width` inches; return it measured."""
        rows = max(8, int(self.size[1] / _ROW) - 1)
        columns = max(1, int(self.size[0] / width)) if self.wide else math.ceil(len(keys) / rows)
        return Part.of(self.figure, add_legend(self.figure, keys, title=title, columns=columns))

    def with_table(self, legend: Part, table: Sequence[Sequence[str]]) -> list[Part]:
        """Put a table below a legend if there is room beside the map; for a wide map, always."""
        if not table:
            return [legend]
        text = add_table(self.figure, table)
        part = Part.of(self.figure, text)
        if not self.wide and legend.size[1] + _TABLE_GAP + part.size[1] > max(self.size[1], _LEAST_COLUMN):
            text.remove()
            return [legend]
        return [legend.over(part, _TABLE_GAP)]

    def arrange(self, heading: tuple[str, str], parts: Sequence[Part]) -> None:
        """Put parts beside each other, or below each other if the map is wide."""
        arrange(self.figure, heading, [[part] for part in parts] if self.wide else [parts])

    def draw_paths(self, paths: Sequence[LabelledPath]) -> Iterator[Key]:
        """Draw the paths of solvers, those within a pen's width as one line; yield the rows of the legend."""
        yield from _draw_paths(self.axes, paths, unit_scale(self.shown.problem), _PEN / 72.0 / self.inches)

    def name_areas(self, paths: Sequence[FloatArray]) -> None:
        """Write the names of areas where they hide neither each other nor paths (map units), at the final size."""
        self.figure.set_size_inches(12.0, 12.0)
        self.axes.set_position((0.1, 0.1, self.size[0] / 12.0, self.size[1] / 12.0))
        ends = [np.array([end]) for end in (self.shown.problem.start, self.shown.problem.goal)]
        name_areas(self.axes, self.shown.areas, unit_scale(self.shown.problem), [*paths, *ends])

    def draw_places(self, paths: Sequence[LabelledPath]) -> Iterator[Key]:
        """Draw the places that paths visit, with their numbers; yield the legend's row."""
        scale = unit_scale(self.shown.problem)
        for path in paths:
            for number, place in enumerate(np.multiply(path.places, scale).tolist(), start=1):
                mark = draw_mark(self.axes, place, "D", 6.0, markeredgecolor="black", clip_on=False, zorder=5)
                write_beside(self.axes, str(number), (place[0], place[1]), (5.0, 5.0), fontsize=8)
                if number == 1:
                    yield mark, "place to visit"

    def draw_marks(self) -> Iterator[Key]:
        """Draw start, goal and no-fly area; yield the legend's rows."""
        problem, scale = self.shown.problem, unit_scale(self.shown.problem)
        around = 15.0 if problem.start == problem.goal else 8.0
        for name, end, marker, size in (("start", problem.start, "o", around), ("goal", problem.goal, "*", 12.0)):
            place = np.multiply(end, scale)
            yield draw_mark(self.axes, place, marker, size, markeredgecolor="black", clip_on=False, zorder=5), name
        yield from self.draw_areas()

    def draw_areas(self) -> Iterator[Key]:
        """Draw the no-fly area; yield its rows of the legend, and that of places without data."""
        problem, scale = self.shown.problem, unit_scale(self.shown.problem)
        if not problem.area.is_empty:
            area = draw_area(self.axes, problem.area_as_given.geometry, scale)
            clip_to_bounds(self.axes, problem.bounds, area, scale)
            yield area_key(), "no-fly area"
        if problem.clearance > 0.0 and not problem.area.is_empty:
            look: dict[str, Any] = {"color": "0.35", "linestyle": (0, (2, 2)), "linewidth": 0.8}
            for ring in shapely.get_rings(shapely.get_parts(problem.model.area.geometry)):
                lines = self.axes.plot(*(shapely.get_coordinates(ring) * scale).T, **look, zorder=2.5)
                clip_to_bounds(self.axes, problem.bounds, lines, scale)
            yield Line2D([], [], **look), f"clearance {problem.clearance:g}{' m' if problem.projection else ''}"
        yield from data_keys(problem)


def _frame_map(
    axes: Axes, shown: TitledProblem, paths: Sequence[LabelledPath], places: Sequence[FloatArray]
) -> tuple[tuple[float, float], float, Bounds]:
    """Set limits and labels; return the size of the map and of one unit, inches, and the part that is shown."""
    problem, scale = shown.problem, unit_scale(shown.problem)
    view = view_of(
        problem.bounds,
        np.array([problem.start, problem.goal], dtype=np.float64),
        [*(one.path for one in paths if len(one.path) and not one.infeasible), *places],
        [one.path for one in paths if len(one.path) and one.infeasible],
        crop=problem.projection is not None,
    )
    low, high = np.reshape(view.frame, (2, 2)) * scale
    width, height = high - low
    inches = float((_WIDE_LONG if width > _WIDE * height else _LONG) / max(width, height))
    # a thin map is shown with room on both sides
    lacking = np.maximum(_SHORT / inches - (high - low), 0.0)
    (x_min, y_min), (x_max, y_max) = low - 0.5 * lacking, high + 0.5 * lacking
    axes.set_xlim(x_min, x_max)
    axes.set_ylim(*((y_max, y_min) if shown.y_down else (y_min, y_max)))
    axes.set_aspect("equal")
    axes.set_facecolor("0.92")  # outside the bounds, where a path leaves them or the map is very thin
    size = float(x_max - x_min) * inches, float(y_max - y_min) * inches
    if problem.projection is not None:
        label_degrees(axes, problem.projection, (max(2, int(1.1 * size[0])), max(2, int(1.6 * size[1]))))
        return size, inches, view.part
    axes.xaxis.set_major_locator(MaxNLocator(max(1, int(1.3 * size[0])), steps=[1, 2, 5, 10], min_n_ticks=1))
    axes.yaxis.set_major_locator(MaxNLocator(max(2, int(1.3 * size[1])), steps=[1, 2, 5, 10]))
    for axis, letter in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        axis.set_label_text(f"{letter} (cells)" if shown.y_down else letter)
    return size, inches, view.part


def _draw_paths(axes: Axes, paths: Sequence[LabelledPath], scale: float, pen: float) -> Iterator[Key]:
    """Draw the paths, the best on top, those within a pen's width as one line; yield handles and labels."""
    with_path = [one for one in paths if len(one.path)]
    lines = lines_of([one for one in with_path if one.stands_out], pen / scale)
    drawn = _draw_lines(axes, [line[0] for line in lines], scale, pen)
    for handle, line in zip(drawn, lines, strict=True):
        yield handle, line[0].row(scale)
        for one in line[1:]:
            yield Line2D([], [], linestyle="none"), f"{one.row(scale)}, same line"
    for one in paths:
        if one.stands_out and not len(one.path):
            yield Line2D([], [], linestyle="none"), one.row(scale)
    others = [one for one in with_path if not one.stands_out]
    for infeasible in (False, True):
        alike = [one for one in others if one.infeasible is infeasible]
        for handle in [_draw_path(axes, one, scale, _THIN, 3.0) for one in alike][:1]:
            yield handle, others_label(len(alike), "infeasible" if infeasible else "")
    if without := [one for one in paths if not one.stands_out and not len(one.path)]:
        yield Line2D([], [], linestyle="none"), others_label(len(without), "without a path")


def _draw_lines(axes: Axes, paths: Sequence[LabelledPath], scale: float, pen: float) -> list[Artist]:
    """Draw the paths in colour, each wide enough to be visible below better ones that cover it; return the lines."""
    # infeasible ones are on top, with gaps through which those below are visible
    below = [one.path for one in paths if not one.infeasible]
    widths = [_PEN + _STEP * count for count in n_above(below, pen / scale)]
    widths += [_DASHED] * (len(paths) - len(below))
    halo = LineCollection(
        [one.path * scale for one in paths],
        linewidths=[width + 1.4 for width in widths],
        colors="white",
        alpha=0.85,
        zorder=3.4,
    )
    axes.add_collection(halo, autolim=False)
    return [
        _draw_path(axes, one, scale, width, 4.0 + 0.5 * one.infeasible - 0.01 * depth)
        for depth, (one, width) in enumerate(zip(paths, widths, strict=True))
    ]


def _draw_path(axes: Axes, one: LabelledPath, scale: float, width: float, zorder: float) -> Artist:
    """Draw one path; return the line."""
    path = one.path
    (line,) = axes.plot(
        *(path.T * scale),
        color=one.colour,
        linestyle=one.dashes,
        linewidth=width,
        # a path of one point, or of equal points, has no visible line
        marker="o" if (path == path[0]).all() else "none",
        markersize=15.0 + 3.0 * width,
        clip_on=one.infeasible,
        solid_joinstyle="round",
        dash_capstyle="butt",
        zorder=zorder,
    )
    return line


def lines_of(paths: Sequence[LabelledPath], pen: float) -> list[list[LabelledPath]]:
    """
    Group paths that are drawn as one line, in order: the first of each group is drawn.

    Feasible and infeasible paths are never in one group.
    """
    kinds = ([one for one in paths if one.infeasible is infeasible] for infeasible in (False, True))
    return [[kind[number] for number in group] for kind in kinds for group in one_line([one.path for one in kind], pen)]


def one_line(paths: Sequence[FloatArray], pen: float) -> list[list[int]]:
    """
    Group paths that coincide at a pen's width.

    Parameters
    ----------
    paths
        Shape ``(n, 2)`` each, at least one point; paths that lead groups come first.
    pen
        The width of a line, in units of the paths.

    Returns
    -------
    groups
        The numbers of the paths, in order. The first of each group leads it: its Hausdorff distance to all others is
        at most `pen`.

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
    Count for each path the paths before it that cover a part of it, so that it is drawn wider.

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
    """Return a path, also one of one point, as a line without invisible corners."""
    return LineString(np.vstack([path, path[-1:]])).simplify(_FINE * pen)

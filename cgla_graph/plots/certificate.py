"""The picture of a certificate: the tubes that no better path can leave, and the bracket that closed grid by grid."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.ticker import MaxNLocator, NullLocator
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import at_most, rounded_down
from cgla_graph._text import figure as digits_of
from cgla_graph._types import FloatArray
from cgla_graph.certificate.certificate import Certificate, Grid
from cgla_graph.certificate.corridor import cells_outline
from cgla_graph.certificate.verdict import verdict
from cgla_graph.model.problem import Problem
from cgla_graph.plots.looks import COLOURS, LabelledPath
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import Key, Part, add_inner_legend, add_legend, arrange, heading, style
from cgla_graph.plots.scene import TitledProblem, cost_unit, outline, unit_scale

_WIDTH, _LOWEST = 3.6, 2.1  # inches: width of the plot of the bracket, and its least height
_OPACITY, _MOST_TICKS = 0.5, 6  # of tubes; of the axis of grid steps
#: Tubes from the coarsest to the finest: orange, as risk is violet, paths are blue and areas are grey.
_LIGHT, _DARK = "#FFDFA3", "#A34F00"


def certificate_figure(
    shown: TitledProblem, proof: Certificate, paths: Sequence[LabelledPath] = (), *, figure: Figure | None = None
) -> Figure:
    """
    Draw a certificate: the map with its path and the tube of each grid, and the bracket against the grid step.

    Parameters
    ----------
    shown
        The map.
    proof
        The certificate, with or without a bound.
    paths
        The path that the bound is compared with, if there is one.
    figure
        An empty one to draw on; None makes one.

    Returns
    -------
    figure
        The first axes are the map's, the last ones the bracket's.
        Costs are map units, or kilometres where the map has longitudes and latitudes.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> scenario = cg.load_scenario("one-threat")
    >>> figure = certificate_figure(TitledProblem.of(scenario), cg.lower_bound(scenario.problem, 0.1))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y', 'risk per unit length', 'cost']
    """
    problem, scale = shown.problem, unit_scale(shown.problem)
    with style():
        base = BaseMap.of(shown, paths, places=_corners(problem, proof.grids), figure=figure)
        tubes = list(_draw_tubes(base.axes, problem, proof.grids, scale))
        keys = [*base.draw_paths(paths), *base.draw_marks(), *tubes]
        base.name_areas([one.path for one in paths])
        about = "no better path leaves a tube" if tubes else ""
        legend = add_legend(base.figure, keys, title=about, columns=3 if base.wide else 4)
        parts, with_path = base.parts, any(one.solution.status.has_path for one in paths)
        if proof.grids and math.isfinite(proof.lower_bound):
            axes = base.figure.add_axes((0.0, 0.0, 0.5, 0.5))
            _draw_bracket(axes, proof, problem, with_path=with_path)
            height = _LOWEST if base.wide else max(base.size[1], _LOWEST)
            parts.append(Part.of(base.figure, axes, (_WIDTH, height)))
        name, title = heading(shown.name, shown.title, problem.k)
        unit = "" if problem.projection is None else " km"
        said = verdict(proof, with_path=with_path, digits=6, scale=scale, unit=unit)
        about_it = (f"{name}:  {title}" if title else name, said[0].upper() + said[1:])
        below = Part.of(base.figure, legend)
        arrange(base.figure, about_it, [*([part] for part in parts), [below]] if base.wide else [parts, [below]])
    return base.figure


def draw_certificate(
    axes: Sequence[Axes], shown: TitledProblem, proof: Certificate, paths: Sequence[LabelledPath]
) -> None:
    """Draw the same on axes of the user's: the map with its tubes, and if there are two, the bracket."""
    problem = shown.problem
    with style():
        base = BaseMap.on(axes[0], shown, paths, places=_corners(problem, proof.grids))
        tubes = list(_draw_tubes(axes[0], problem, proof.grids, unit_scale(problem)))
        rows = [*base.draw_paths(paths), *tubes]
        add_inner_legend(axes[0], [*rows, *base.draw_marks()], least=len(rows))
        if len(axes) > 1 and proof.grids and math.isfinite(proof.lower_bound):
            with_path = any(one.solution.status.has_path for one in paths)
            _draw_bracket(axes[1], proof, problem, with_path=with_path)


def _draw_tubes(axes: Axes, problem: Problem, grids: Sequence[Grid], scale: float) -> Iterator[Key]:
    """Shade the cells of each grid but the first; yield the legend's rows."""
    shades = LinearSegmentedColormap.from_list("tubes", [_LIGHT, _DARK])
    tubes = [_tube(problem, grid) for grid in grids[1:]]
    # each without the next one, so that risk is visible below the finest as well
    inner = [*tubes, shapely.Polygon()][1:]
    for number, (grid, tube, finer) in enumerate(zip(grids[1:], tubes, inner, strict=True)):
        colour = to_hex(shades(number / max(len(tubes) - 1, 1)))
        fill = outline(shapely.difference(tube, finer), scale)
        axes.add_patch(PathPatch(fill, facecolor=(colour, _OPACITY), edgecolor="none", zorder=1.5))
        axes.add_patch(PathPatch(outline(tube, scale), facecolor="none", edgecolor=colour, linewidth=0.8, zorder=1.6))
        yield Patch(facecolor=(colour, _OPACITY), edgecolor=colour), f"tube, grid step 1/{grid.steps}"


def _corners(problem: Problem, grids: Sequence[Grid]) -> list[FloatArray]:
    """Return the corners of the box around all tubes, a little inside: a tube may reach the edge of the map."""
    if len(grids) < 2:  # noqa: PLR2004 - the first is not shaded
        return []
    low, high = np.reshape(_tube(problem, grids[1]).bounds, (2, 2))
    within = 0.01 * (high - low)
    return [np.array([low + within, high - within])]


def _tube(problem: Problem, grid: Grid) -> BaseGeometry:
    """Return the cells of a grid inside the bounds, map units."""
    return cells_outline(problem.bounds, grid.last, grid.runs)


def _draw_bracket(axes: Axes, proof: Certificate, problem: Problem, *, with_path: bool) -> None:
    """Draw lower and upper bound against the grid step, coarse to fine, and write the gap."""
    grids, scale = proof.grids, unit_scale(problem)
    cells = np.array([grid.steps for grid in grids], dtype=np.float64)
    lower, upper = (
        np.array([getattr(grid, side) for grid in grids]) * scale for side in ("lower_bound", "upper_bound")
    )
    known = np.isfinite(upper)
    axes.fill_between(cells, lower, upper, where=known, color="0.9", linewidth=0.0, zorder=1)
    axes.plot(cells[known], upper[known], color=COLOURS[0], marker="o", markersize=4.0, linewidth=1.3, zorder=3)
    axes.plot(cells, lower, color=_DARK, marker="o", markersize=4.0, linewidth=1.3, zorder=3)
    axes.set_xscale("log")
    axes.set_xlim(cells[0] / 1.35, cells[-1] * 1.35)
    axes.xaxis.set_minor_locator(NullLocator())
    # the last one, and as many before it as there is room for
    shown = cells[:: -math.ceil(len(cells) / _MOST_TICKS)]
    axes.set_xticks(shown, [f"1/{count:.0f}" for count in shown])
    step = "distance of points" if proof.proof == "cells" else "grid step"
    axes.set_xlabel(f"{step}, of the map's longer side")
    axes.set_ylabel(f"cost{cost_unit(problem)}")
    every = np.concatenate([lower, upper[known]])
    reach = max(float(np.ptp(every)), 1e-3 * abs(float(every[-1])), 1e-9)
    axes.set_ylim(float(every.min()) - 0.22 * reach, float(every.max()) + 0.3 * reach)
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.yaxis.get_major_formatter().set_useOffset(False)  # type: ignore[attr-defined]
    axes.grid(color="0.9", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    if known[-1]:
        said = f"{'the path' if with_path else 'best known'}: {digits_of(float(upper[-1]), 5)}"
        axes.annotate(
            said, (cells[-1], upper[-1]), (0.0, 6.0), textcoords="offset points", ha="right", va="bottom", bbox=box
        )
    gap = f"\ngap at most {at_most(proof.gap)}" if known[-1] else ""
    axes.annotate(
        f"lower bound: {rounded_down(float(lower[-1]), 5)}{gap}",
        (cells[-1], lower[-1]),
        (0.97, 0.06),
        textcoords="axes fraction",
        ha="right",
        va="bottom",
        linespacing=1.4,
        bbox=box,
        arrowprops={"arrowstyle": "-", "color": "0.4", "linewidth": 0.7, "shrinkB": 4.0},
        zorder=4,
    )

"""The picture of a certificate: the tubes that no better path can leave, and the bracket that closed grid by grid."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.ticker import MaxNLocator, NullLocator
from shapely.geometry.base import BaseGeometry

from cgla_graph.certificate.certificate import Grid
from cgla_graph.comparisons.numbers import at_most, rounded_down
from cgla_graph.comparisons.plots.looks import COLOURS
from cgla_graph.comparisons.plots.map import map_figure
from cgla_graph.comparisons.plots.page import Part, add_legend, arrange, style
from cgla_graph.comparisons.plots.text import cost_text, heading
from cgla_graph.comparisons.plots.units import cost_unit, unit_scale
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.certificate import proof_of, verdict
from cgla_graph.model.problem import Problem

_WIDTH, _LOWEST, _HIGHEST = 3.6, 2.1, 3.4  # inches: width of the plot of the bracket, and within what its height is
_LABELS = 0.5  # inches: what its labels take below it
_BAR, _GAP = 0.13, 0.25  # inches: thickness of the colour bar, space above the legend
_WIDE = 2.5  # as the map's own picture: from here on, everything else is below
_OPACITY, _MOST_TICKS = 0.5, 6  # of tubes; of the axis of grid steps
#: Tubes from the coarsest to the finest: orange, as risk is violet, paths are blue and areas are grey.
_LIGHT, _DARK = "#FFDFA3", "#A34F00"


def certificate_figure(run: Run) -> Figure:
    """
    Draw a certificate: the map with its path and the tube of each grid, and the bracket against the grid step.

    Parameters
    ----------
    run
        With a certificate; without a path or a bound, what there is.

    Returns
    -------
    figure
        Costs are map units, or kilometres where the map has longitudes and latitudes.

    Examples
    --------
    >>> from cgla_graph.comparisons.commands.certify import certify
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> figure = certificate_figure(certify(load_scenario("one-threat")))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y', 'risk per unit length', 'cost']
    """
    scenario, proof = run.scenario, proof_of(run)
    scale = unit_scale(scenario)
    figure = map_figure(scenario, [run])
    with style():
        map_axes, *bars = figure.axes
        width, height = figure.get_size_inches().tolist()
        size = map_axes.get_position().width * width, map_axes.get_position().height * height
        wide = size[0] > _WIDE * size[1]
        for text in list(figure.texts):
            text.remove()
        tubes = _draw_tubes(map_axes, scenario.problem, proof.grids, scale)
        legend = _extended(figure, tubes, wide=wide)
        name, title = heading(scenario)
        parts = [Part.of(figure, map_axes, size)]
        thin = (min(3.0, size[0]), _BAR) if wide else (_BAR, size[1])
        parts += [Part.of(figure, bar, thin) for bar in bars]
        if proof.grids and math.isfinite(proof.lower_bound):
            axes = figure.add_axes((0.0, 0.0, 0.5, 0.5))
            _draw_bracket(axes, run, scale)
            room = size[1] - _LABELS - _GAP - Part.of(figure, legend).size[1]
            parts.append(Part.of(figure, axes, (_WIDTH, _LOWEST if wide else min(max(room, _LOWEST), _HIGHEST))))
        said = verdict(run, digits=6, scale=scale, unit="" if scenario.projection is None else " km")
        about = (f"{name}:  {title}" if title else name, said[0].upper() + said[1:])
        _lay_out(figure, about, parts, legend, wide=wide)
    return figure


def _lay_out(figure: Figure, about: tuple[str, str], parts: list[Part], legend: Legend, *, wide: bool) -> None:
    """Put the bracket beside the map and the legend below it; all below the map where that is wide."""
    if wide:
        left = max(part.left for part in parts)
        parts[0] = replace(parts[0], left=left)
        arrange(figure, about, [*parts, Part.of(figure, legend)], wide=True)
        return
    if not isinstance(parts[-1].artist, Axes) or parts[-1].size[0] != _WIDTH:
        arrange(figure, about, [*parts, Part.of(figure, legend)])
        return
    bracket, below = parts.pop(), Part.of(figure, legend)
    # the page is laid out as if the legend were labels of the bracket
    room = replace(
        bracket,
        bottom=bracket.bottom + _GAP + below.size[1],
        right=max(bracket.right, below.size[0] - bracket.left - bracket.size[0]),
    )
    spacer = Part(figure.text(0.0, 0.0, ""), (bracket.left, 0.0))
    arrange(figure, about, [*parts, spacer, room])
    width, height = figure.get_size_inches().tolist()
    place = bracket.artist.get_position() if isinstance(bracket.artist, Axes) else None
    if place is not None:
        below.put(figure, place.x0 * width - bracket.left, (1.0 - place.y0) * height + bracket.bottom + _GAP)


def _extended(figure: Figure, tubes: Sequence[tuple[Artist, str]], *, wide: bool) -> Legend:
    """Replace the legend of the map by one that tells the tubes as well."""
    old = figure.legends[0]
    handles = [handle for handle in old.legend_handles if handle is not None]
    labels = [text.get_text() for text in old.get_texts()]
    old.remove()
    handles += [handle for handle, _ in tubes]
    labels += [label for _, label in tubes]
    return add_legend(
        figure, handles, labels, title="no better path leaves a tube" if tubes else "", columns=3 if wide else 2
    )


def _draw_tubes(axes: Axes, problem: Problem, grids: Sequence[Grid], scale: float) -> list[tuple[Artist, str]]:
    """Shade the cells that each grid but the first looked at; return handles and labels of the legend."""
    drawn: list[tuple[Artist, str]] = []
    shades = LinearSegmentedColormap.from_list("tubes", [_LIGHT, _DARK])
    tubes = [_tube(problem, grid) for grid in grids[1:]]
    # each shows where the next does not, so that risk is seen below the finest as well
    inner = [*tubes, shapely.Polygon()][1:]
    for number, (grid, tube, finer) in enumerate(zip(grids[1:], tubes, inner, strict=True)):
        colour = to_hex(shades(number / max(len(tubes) - 1, 1)))
        fill = _outline(shapely.difference(tube, finer), scale)
        axes.add_patch(PathPatch(fill, facecolor=(colour, _OPACITY), edgecolor="none", zorder=1.5))
        axes.add_patch(PathPatch(_outline(tube, scale), facecolor="none", edgecolor=colour, linewidth=0.8, zorder=1.6))
        drawn.append((Patch(facecolor=(colour, _OPACITY), edgecolor=colour), f"tube, grid step 1/{max(grid.last)}"))
    return drawn


def _tube(problem: Problem, grid: Grid) -> BaseGeometry:
    """Return the cells that a grid looked at, inside the bounds, map units."""
    low, high = np.reshape(problem.bounds, (2, 2))
    steps = (high - low) / np.array(grid.last)
    rows, first, end = grid.runs.T
    boxes = shapely.box(
        low[0] + (first - 0.5) * steps[0],
        low[1] + (rows - 0.5) * steps[1],
        low[0] + (end - 0.5) * steps[0],
        low[1] + (rows + 0.5) * steps[1],
    )
    return shapely.intersection(shapely.union_all(boxes), shapely.box(*problem.bounds))


def _outline(area: BaseGeometry, scale: float) -> Outline:
    """Return the rings of an area; holes run the other way round than shells, so that they stay empty."""
    polygons = [part for part in shapely.get_parts(area) if isinstance(part, shapely.Polygon)]
    wound = [shapely.geometry.polygon.orient(polygon) for polygon in polygons]
    rings = [ring for polygon in wound for ring in (polygon.exterior, *polygon.interiors)]
    return Outline.make_compound_path(*(Outline(np.asarray(ring.coords) * scale, closed=True) for ring in rings))


def _draw_bracket(axes: Axes, run: Run, scale: float) -> None:
    """Draw lower and upper bound against the grid step, coarse to fine, and say what gap is left."""
    scenario, proof = run.scenario, proof_of(run)
    grids = proof.grids
    cells = np.array([max(grid.last) for grid in grids], dtype=np.float64)
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
    # the last one always, and as many before it as there is room for
    shown = cells[:: -math.ceil(len(cells) / _MOST_TICKS)]
    axes.set_xticks(shown, [f"1/{count:.0f}" for count in shown])
    axes.set_xlabel("grid step, of the map's longer side")
    axes.set_ylabel(f"cost{cost_unit(scenario)}")
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
        said = f"{'the path' if run.solution.status.has_path else 'best known'}: {cost_text(float(upper[-1]))}"
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

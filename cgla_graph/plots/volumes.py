"""The picture of volumes around a flight, over the risk and the no-fly areas of a map."""

from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray
from cgla_graph.airspace.volumes.volumes import Volumes
from cgla_graph.model.problem import Problem
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import Key, add_inner_legend, style
from cgla_graph.plots.scene import (
    TitledProblem,
    area_key,
    clip_to_bounds,
    data_keys,
    draw_area,
    line_key,
    outline,
    patch_key,
    unit_scale,
)

#: Colours of flight geography, contingency volume and ground risk buffer, as authorities draw them.
_COLOURS = ("#1a9641", "#f2a900", "#d7191c")
_OPACITY = 0.3


def volumes_figure(
    volumes: Volumes,
    on: Problem | None = None,
    *,
    name: str = "",
    areas: Sequence[tuple[str, BaseGeometry]] = (),
    figure: Figure | None = None,
) -> Figure:
    """
    Draw volumes.

    Parameters
    ----------
    volumes
        The volumes.
    on
        The map with its risk and its no-fly areas, in the coordinates of the volumes; None for none.
    name
        Name of the map; empty for that of the flight.
    areas
        Names and shapes of no-fly areas, map units.
    figure
        An empty one to draw on; None makes one.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> flight = cg.volumes([(24.0, 60.0), (24.01, 60.0)], height=60, speed=15, dimension=0.8, pitch=30)
    >>> [text.get_text() for text in volumes_figure(flight).legends[0].get_texts()][:3]
    ['flight geography: 16.00 m on both sides', 'contingency volume: 41.86 m more', 'ground risk buffer: 87.57 m more']
    """
    shown = _map_of(volumes, on, name or volumes.name, areas)
    with style():
        base = BaseMap.of(shown, places=[_places(volumes)], figure=figure)
        keys = list(_draw(base, volumes))
        base.arrange((shown.name, ""), [*base.parts, base.add_legend(keys)])
    return base.figure


def draw_volumes(axes: Axes, volumes: Volumes) -> None:
    """Draw the same on axes of the user's, with the legend inside."""
    with style():
        base = BaseMap.on(axes, _map_of(volumes, None, volumes.name, ()), places=[_places(volumes)])
        add_inner_legend(axes, list(_draw(base, volumes)), least=4)


def _places(volumes: Volumes) -> FloatArray:
    x_min, y_min, x_max, y_max = volumes.shapes[2].bounds
    return np.array([(x_min, y_min), (x_max, y_max)])


def _map_of(
    volumes: Volumes, on: Problem | None, name: str, areas: Sequence[tuple[str, BaseGeometry]]
) -> TitledProblem:
    """Return a map of the volumes, with the risk and the areas of a problem."""
    route = shapely.get_coordinates(volumes.lines)
    start, goal = ((float(x), float(y)) for x, y in (route[0], route[-1]))
    x_min, y_min, x_max, y_max = volumes.shapes[2].bounds
    problem = Problem(start, goal, bounds=(x_min, y_min, x_max, y_max), projection=volumes.projection)
    if on is not None:
        problem = Problem(start, goal, on.field, bounds=problem.bounds, projection=on.projection, no_fly=on.no_fly)
    return TitledProblem(problem, name, "", areas)


def _draw(base: BaseMap, volumes: Volumes) -> Iterator[Key]:
    """Draw the volumes, the path and no-fly areas; yield the rows of the legend."""
    axes, problem, scale = base.axes, base.shown.problem, unit_scale(base.shown.problem)
    said = volumes.lines_of_text()
    for number in (2, 1, 0):
        rings = outline(volumes.shapes[number], scale)
        for look in ({"alpha": _OPACITY, "linewidth": 0.0}, {"fill": False, "linewidth": 1.0}):
            patch = PathPatch(rings, facecolor=_COLOURS[number], edgecolor=_COLOURS[number], zorder=3.0, **look)
            axes.add_patch(patch)
    for colour, (name, words) in zip(_COLOURS, said.items(), strict=True):
        key = patch_key(facecolor=colour, edgecolor=colour, alpha=2.0 * _OPACITY)
        yield key, f"{name}: {words.split(',')[0].split(' (')[0]}"
    for part in shapely.get_parts(volumes.lines).tolist():
        axes.plot(*(shapely.get_coordinates(part) * scale).T, color="black", linewidth=0.9, zorder=4.0)
    yield line_key(color="black", linewidth=0.9), "path"
    if not problem.area.is_empty:
        clip_to_bounds(axes, problem.bounds, draw_area(axes, problem.area_as_given.geometry, scale), scale)
        yield area_key(), "no-fly area"
    yield from data_keys(problem)

"""The picture of a plan that was checked: its legs over areas and risk, and the pieces that are inside of areas."""

import dataclasses
from collections.abc import Sequence

import numpy as np
import shapely
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray
from cgla_graph.model.problem import Problem
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import Key, heading, style
from cgla_graph.plots.scene import TitledProblem, area_key, clip_to_bounds, draw_area, line_key, unit_scale

#: Blue, as the first solver's path in other pictures; and red, which no solver has.
_PLAN, _INSIDE = "#0072B2", "#C00000"


def check_figure(
    shown: TitledProblem, route: FloatArray, areas: Sequence[BaseGeometry], pieces: Sequence[FloatArray], *, clean: bool
) -> Figure:
    """
    Draw a plan that was checked.

    Parameters
    ----------
    shown
        The map; what closes it are the `areas`.
    route
        What is flown, shape ``(m, 2)``, map units; it may begin in an area, and leave the map.
    areas
        What no leg may cross, map units.
    pieces
        Those of legs that do, shape ``(2, 2)`` each.
    clean
        Whether nothing is wrong with the plan.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> route = np.array([(0.1, 0.1), (0.9, 0.9)])
    >>> shown = TitledProblem.of(load_scenario("one-threat"))
    >>> figure = check_figure(shown, route, [shapely.box(0.4, 0, 0.5, 0.8)], [route], clean=False)
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['plan, not clean', 'inside an area', 'start', 'goal', 'no-fly area']
    """
    old = shown.problem
    low, high = np.minimum(route.min(axis=0), old.bounds[:2]), np.maximum(route.max(axis=0), old.bounds[2:])
    bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    first, last = ((float(x), float(y)) for x, y in (route[0], route[-1]))
    problem = Problem(first, last, old.field, old.k, bounds, projection=old.projection)
    shown = dataclasses.replace(shown, problem=problem)
    scale = unit_scale(problem)
    with style():
        base = BaseMap.of(shown, places=[route])
        base.axes.plot(*(route * scale).T, color="white", linewidth=3.0, alpha=0.85, zorder=3.4)
        (line,) = base.axes.plot(*(route * scale).T, color=_PLAN, linewidth=1.6, zorder=4.0)
        if len(route) > 1:
            base.axes.plot(*(route[1:-1] * scale).T, ".", color=_PLAN, markersize=4.0, zorder=4.1)
        keys: list[Key] = [(line, "plan, clean" if clean else "plan, not clean")]
        if pieces:
            inside = LineCollection([piece * scale for piece in pieces], colors=_INSIDE, linewidths=3.0, zorder=4.2)
            base.axes.add_collection(inside, autolim=False)
            base.axes.plot(
                *(np.concatenate(pieces) * scale).T, "x", color=_INSIDE, markersize=5.0, markeredgewidth=1.2, zorder=4.3
            )
            keys.append((line_key(color=_INSIDE, linewidth=3.0), "inside an area"))
        keys += base.draw_marks()
        if areas:
            united = shapely.union_all(list(areas))
            clip_to_bounds(base.axes, bounds, draw_area(base.axes, united, scale), scale)
            keys.append((area_key(), "no-fly area"))
        base.name_areas([route])
        base.arrange(heading(shown.name, shown.title, problem.k), [*base.parts, base.add_legend(keys)])
    return base.figure

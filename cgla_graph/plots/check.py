"""The picture of a checked plan: its legs over areas and risk, and the pieces of legs inside areas."""

from collections.abc import Iterator

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from cgla_graph.airspace.plan_check.result import PlanCheck
from cgla_graph.model.problem import Problem
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import Key, add_inner_legend, heading, style
from cgla_graph.plots.scene import TitledProblem, area_key, clip_to_bounds, draw_area, line_key, outline, unit_scale

#: Blue, as the first path in other pictures; and red, which no path has.
_PLAN, _INSIDE = "#0072B2", "#C00000"
_FENCE = "black"


def check_figure(checked: PlanCheck, *, figure: Figure | None = None) -> Figure:
    """
    Draw a checked plan.

    Parameters
    ----------
    checked
        The checked plan. All of it is shown, even if it begins in an area or leaves the map.
    figure
        An empty one to draw on; None makes one.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> tower = cg.Problem((0, 0), (10, 0), bounds=(-5, -5, 15, 15), no_fly=shapely.box(4, -1, 5, 2))
    >>> figure = check_figure(cg.check([(0, 0), (10, 0)], tower))
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['plan, not clean', 'inside an area', 'start', 'goal', 'no-fly area']
    """
    shown = _map_of(checked)
    with style():
        base = BaseMap.of(shown, places=[checked.on.route], figure=figure)
        keys = list(_draw(base, checked))
        base.name_areas([checked.on.route])
        base.arrange(heading(shown.name, shown.title, shown.problem.k), [*base.parts, base.add_legend(keys)])
    return base.figure


def draw_check(axes: Axes, checked: PlanCheck) -> None:
    """Draw the same on axes of the user's, with the legend inside and no bar of colours."""
    with style():
        keys = list(_draw(BaseMap.on(axes, _map_of(checked), places=[checked.on.route]), checked))
        add_inner_legend(axes, keys, least=2)


def _map_of(checked: PlanCheck) -> TitledProblem:
    """Return a map that covers the whole plan."""
    on, old, route = checked.on, checked.on.problem, checked.on.route
    low, high = np.minimum(route.min(axis=0), old.bounds[:2]), np.maximum(route.max(axis=0), old.bounds[2:])
    bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    start, goal = ((float(x), float(y)) for x, y in (route[0], route[-1]))
    problem = Problem(start, goal, old.field, old.k, bounds, projection=old.projection)
    named = [(one.name, one.shape) for one in on.areas if not one.is_outside]
    return TitledProblem(problem, on.name, on.source.title, named, getattr(on.source, "y_down", False))


def _draw(base: BaseMap, checked: PlanCheck) -> Iterator[Key]:
    """Draw legs, the pieces inside areas, marks and areas; yield the rows of the legend."""
    axes, problem, scale = base.axes, base.shown.problem, unit_scale(base.shown.problem)
    route = checked.on.route * scale
    axes.plot(*route.T, color="white", linewidth=3.0, alpha=0.85, zorder=3.4)
    (line,) = axes.plot(*route.T, color=_PLAN, linewidth=1.6, zorder=4.0)
    axes.plot(*route[1:-1].T, ".", color=_PLAN, markersize=4.0, zorder=4.1)
    yield line, "plan, clean" if checked.is_clean else "plan, not clean"
    if checked.crossings.found:
        pieces = np.array([(one.entry, one.exit) for one in checked.crossings.found]) * scale
        axes.add_collection(LineCollection(list(pieces), colors=_INSIDE, linewidths=3.0, zorder=4.2), autolim=False)
        ends = np.concatenate(list(pieces))
        axes.plot(*ends.T, "x", color=_INSIDE, markersize=5.0, markeredgewidth=1.2, zorder=4.3)
        yield line_key(color=_INSIDE, linewidth=3.0), "inside an area"
    yield from base.draw_marks()
    filled = [one.shape for one in checked.on.areas if not one.is_outside]
    if filled:
        clip_to_bounds(axes, problem.bounds, draw_area(axes, shapely.union_all(filled), scale), scale)
        yield area_key(), "no-fly area"
    around = [one.shape for one in checked.on.areas if one.is_outside]
    if around:
        rings = outline(shapely.union_all(around), scale)
        fence = PathPatch(rings, edgecolor=_FENCE, linewidth=0.8, fill=False, zorder=3.5)
        clip_to_bounds(axes, problem.bounds, [axes.add_patch(fence)], scale)
        yield line_key(color=_FENCE, linewidth=0.8), "the plan's fence"

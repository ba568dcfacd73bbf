"""The picture of a front: risk against length, and its paths on the map, both coloured by the weight."""

import math

import numpy as np
from matplotlib import colormaps, patheffects
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from cgla_graph._text import at_most
from cgla_graph._text import figure as digits
from cgla_graph.people.units import risk_unit
from cgla_graph.plots.map import BaseMap, map_figure
from cgla_graph.plots.page import Part, arrange, plain, style
from cgla_graph.plots.scene import TitledProblem, cost_unit, draw_mark, unit_scale
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers.trade_off.front import Front, FrontPoint

_SIZE = (3.6, 3.2)  # inches: the plot of risk against length
_GAP_SIZE = (8.0, 1.1)  # inches: the plot of the proven gap
_BAR = 0.13  # inches: thickness of the colour bar


def pareto_figure(scenario: Scenario, front: Front) -> Figure:
    """
    Draw a front: risk against length, its knee, and its paths on the map; without points, the map alone.

    Returns
    -------
    figure
        Lengths are map units, or kilometres where the map has longitudes and latitudes; risk is in the map's own units.
        Colours say from which risk weight on a path is the cheapest. With a proof, what no path reaches is filled, and
        a plot below shows the gap over the weight.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> from cgla_graph.solvers.trade_off.pareto import pareto
    >>> scenario = load_scenario("one-threat")
    >>> figure = pareto_figure(scenario, pareto(scenario.problem, solver="cgla", resolution=6))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y', 'risk per unit length', 'length', 'best from k = … on']
    """
    if not front.points:
        return map_figure(TitledProblem.of(scenario), [])
    with style():
        base = BaseMap.of(TitledProblem.of(scenario), places=[point.path for point in front])
        legend = base.add_legend(list(base.draw_marks()))
        colours, norm = _colours(front)
        scale = unit_scale(scenario.problem)
        for point in front:
            base.axes.plot(
                *(point.path.T * scale),
                color=_colour(point, colours, norm),
                linewidth=1.1,
                solid_joinstyle="round",
                zorder=3,
                path_effects=[patheffects.withStroke(linewidth=2.0, foreground="white", alpha=0.7)],
            )
        axes = base.figure.add_axes((0.0, 0.0, 0.5, 0.5))
        handles = _draw_front(axes, front, colours, norm, scale)
        unit = risk_unit(scenario.problem.field)
        axes.set_xlabel(f"risk ({unit})" if unit else "risk")
        axes.set_ylabel(f"length{cost_unit(scenario.problem)}")
        # the upper right of a falling convex line is empty
        axes.legend(list(handles.values()), list(handles), loc="upper right", frameon=False, handlelength=1.6)
        parts = [Part.of(base.figure, axes, _SIZE)]
        if norm is not None:
            parts.append(Part.of(base.figure, _weight_bar(base.figure, colours, norm).ax, (_BAR, _SIZE[1])))
        rows = [[*parts, *base.parts, legend]]
        if front.bounds is not None and math.isfinite(front.gap):
            below = base.figure.add_axes((0.0, 0.0, 0.5, 0.2))
            _draw_gap(below, front)
            rows.append([Part.of(base.figure, below, _GAP_SIZE)])
        name = f"{plain(scenario.name, 48)},  {len(front)} paths"
        arrange(base.figure, (name, plain(scenario.title, 160)), rows)
    return base.figure


def _colours(front: Front) -> tuple[Colormap, LogNorm | None]:
    """Choose colours from blue to red, and their scale from the first weight above 0 to the last."""
    # without the pale ends, which white paper swallows
    colours = ListedColormap(colormaps["turbo"]([0.08 + 0.84 * i / 255 for i in range(256)]))
    weights = [point.k_low for point in front if point.k_low > 0.0]
    return colours, LogNorm(weights[0], weights[-1]) if len(weights) > 1 else None


def _colour(point: FrontPoint, colours: Colormap, norm: LogNorm | None) -> tuple[float, float, float, float]:
    if norm is None:
        return colours(0.0 if point.k_low == 0.0 else 1.0)
    return colours(float(norm(point.k_low)) if point.k_low > 0.0 else 0.0)


def _draw_front(axes: Axes, front: Front, colours: Colormap, norm: LogNorm | None, scale: float) -> dict[str, Artist]:
    """Draw hull, points and knee; return the legend's rows."""
    risks, lengths = [point.risk for point in front], [point.length * scale for point in front]
    (hull,) = axes.plot(risks, lengths, color="0.45", linewidth=0.9, zorder=2)
    handles: dict[str, Artist] = {"lower left hull": hull}
    handles |= _draw_bounds(axes, front, scale)
    for point, risk, length in zip(front, risks, lengths, strict=True):
        colour = _colour(point, colours, norm)
        dot = draw_mark(axes, (risk, length), "o", 4.2, colour, color=colour, zorder=3)
        handles.setdefault("a path", dot)
    knee = front.knee
    if knee is not None:
        ring = draw_mark(axes, (knee.risk, knee.length * scale), "o", 10.0, "none", markeredgecolor="black", zorder=4)
        handles[f"knee: k from {digits(knee.k_low, 3)} to {digits(knee.k_high, 3)}"] = ring
    axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.grid(color="0.9", linewidth=0.5, zorder=0)
    axes.set_axisbelow(True)
    if len(front) == 1:
        # one point alone gives matplotlib no scale
        axes.set_xlim(-0.05, max(2.0 * risks[0], 1.0))
        axes.set_ylim(0.0, 2.0 * max(lengths[0], math.ulp(1.0)))
    return handles


def _draw_bounds(axes: Axes, front: Front, scale: float) -> dict[str, Artist]:
    """Fill what no path reaches, and draw paths and bounds within budgets; return the legend's rows."""
    if front.bounds is None or not math.isfinite(front.gap):
        return {}
    handles: dict[str, Artist] = {}
    most, longest = front.points[0].risk, front.points[-1].length * scale
    risks = np.linspace(0.0, 1.02 * most, 400)
    least = front.least_length(risks) * scale
    lowest = front.points[0].length * scale - 0.05 * (longest - front.points[0].length * scale)
    shown = least < longest + 0.05 * (longest - lowest)
    area = axes.fill_between(risks[shown], lowest, least[shown], color="0.85", linewidth=0.0, zorder=1)
    handles[f"no path (proven; gap at most {at_most(front.gap)})"] = area
    for plan in front.budgets:
        bound = plan.lower_bound * scale
        if plan.status.has_path and math.isfinite(bound):
            bar = axes.plot(
                [plan.budget] * 2, [bound, plan.solution.length * scale], color="black", linewidth=1.4, zorder=4
            )
            handles.setdefault("best within a budget: from bound to path", bar[0])
    return handles


def _draw_gap(axes: Axes, front: Front) -> None:
    """Draw the proven gap over the risk weight."""
    if front.bounds is None:
        return
    known = front.bounds.weights[front.bounds.weights > 0.0]
    first = min([front.k_max, *known.tolist(), *(point.k_low for point in front if point.k_low > 0.0)]) / 3.0
    weights = np.unique(np.concatenate([np.geomspace(first, front.k_max, 500), known]))
    axes.plot(weights, [100.0 * front.gap_at(k) for k in weights], color="0.25", linewidth=0.9)
    axes.plot(known, [100.0 * front.gap_at(k) for k in known], "o", color="black", markersize=3.0)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda k, _: f"{k:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_ylim(0.0, 120.0 * front.gap or 1.0)
    axes.set_xlabel("k")
    axes.set_ylabel("gap at most, %")
    axes.grid(color="0.9", linewidth=0.5)
    axes.set_axisbelow(True)


def _weight_bar(figure: Figure, colours: Colormap, norm: LogNorm) -> Colorbar:
    """Explain the colours."""
    bar = figure.colorbar(ScalarMappable(norm, colours), cax=figure.add_axes((0.0, 0.0, 0.1, 0.1)))
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda k, _: f"{k:g}"))
    bar.ax.yaxis.set_minor_formatter(NullFormatter())
    bar.set_label("best from k = … on", labelpad=8.0)
    return bar

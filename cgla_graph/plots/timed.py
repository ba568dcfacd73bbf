"""Pictures of flights through risk that moves: what the map is like at some times, and the cost of each departure."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cgla_graph._files import write_files
from cgla_graph._text import figure as digits
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.plots.looks import COLOURS
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import style
from cgla_graph.plots.risk_samples import risk_samples
from cgla_graph.plots.scene import TitledProblem, clip_to_bounds, draw_area, draw_mark, unit_scale
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem

#: Times of the flight that are shown, as parts of it, and frames of a film.
MOMENTS, FRAMES = (0.0, 0.5, 1.0), 45
_PANEL, _CURVE = 3.4, 1.7  # inches: width of the map at a time, height of the costs of departures
_PROBES = 9  # times at which the greatest risk is looked for


def timed_figure(plan: TimedPlan, figure: Figure | None = None) -> Figure:
    """
    Draw a flight at its begin, its middle and its end, and what each departure costs about, if there is a choice.

    Parameters
    ----------
    plan
        A plan with a flight.
    figure
        An empty one to draw on; None makes one.

    Returns
    -------
    figure
        The first axes are the map's at departure.

    Raises
    ------
    ProblemError
        If the plan has no flight, or does not know its problem.
    """
    problem, has_choice, figure = problem_of(plan), len(plan.departures) > 1, figure or Figure()
    x_min, y_min, x_max, y_max = problem.bounds
    rise = min(max((y_max - y_min) / (x_max - x_min), 0.3), 2.0)
    with style():
        figure.set_size_inches(_PANEL * len(MOMENTS), _PANEL * rise + 0.7 + _CURVE * has_choice)
        ratios = [_PANEL * rise, *([_CURVE] if has_choice else [])]
        grid = figure.add_gridspec(len(ratios), len(MOMENTS), height_ratios=ratios, hspace=0.35, wspace=0.28)
        figure.subplots_adjust(left=0.06, right=0.98, top=0.94, bottom=0.1 if has_choice else 0.15)
        top = greatest_risk(plan)
        for column, part in enumerate(MOMENTS):
            draw_moment(figure.add_subplot(grid[0, column]), plan, plan.departure + part * plan.time, top)
        if has_choice:
            draw_departures(figure.add_subplot(grid[1, :]), plan)
    return figure


def problem_of(plan: TimedPlan) -> TimedProblem:
    """Return the problem of a plan; raise a `ProblemError` if it has none, or no flight."""
    if not plan.status.has_path:
        msg = f"there is no flight to draw: {plan.status.label}"
        raise ProblemError(msg)
    if not isinstance(plan.problem, TimedProblem):
        msg = "this plan does not know its problem, as copies from elsewhere; plan again: cg.solve(problem)"
        raise ProblemError(msg)
    return plan.problem


def greatest_risk(plan: TimedPlan) -> float:
    """Return the greatest risk of some times of a flight, about: colours mean the same at all of them."""
    times = np.linspace(plan.departure, plan.arrival, _PROBES).tolist()
    return max(risk_samples(_at(problem_of(plan), time), 120).top for time in times)


def draw_moment(axes: Axes, plan: TimedPlan, time: float, top: float) -> None:
    """Draw the risk and the closed areas at a time, the flight so far, and the rest of it as a thin line."""
    problem = problem_of(plan)
    shown = TitledProblem(_at(problem, time))
    with style():
        base = BaseMap.on(axes, shown, places=[plan.path])
        for image in axes.images:
            image.set_clim(0.0, max(top, np.finfo(float).tiny))
        scale, slab = unit_scale(shown.problem), problem.slab_at(time)
        if slab.no_fly is not None and not slab.no_fly.is_empty:
            clip_to_bounds(axes, problem.bounds, draw_area(axes, slab.no_fly, scale), scale)
        here = np.array(plan.at(time))
        flown = np.vstack([plan.path[plan.trajectory[:, 0] < time], here])
        axes.plot(*(plan.path * scale).T, color=COLOURS[0], linewidth=0.7, alpha=0.7, zorder=3.0)
        axes.plot(*(flown * scale).T, color=COLOURS[0], linewidth=1.8, zorder=3.1)
        for place, marker, size in ((problem.start, "o", 5.0), (problem.goal, "*", 9.0)):
            draw_mark(base.axes, np.multiply(place, scale), marker, size, markeredgecolor="black", zorder=4.0)
        draw_mark(axes, here * scale, "o", 6.0, face=COLOURS[0], markeredgecolor="white", zorder=5.0)
        axes.set_title(f"time {time:.4g}", fontsize=9)


def draw_departures(axes: Axes, plan: TimedPlan) -> None:
    """Draw about what flights cost by their departure, and mark that of the plan."""
    scale = 1.0 if plan.problem is None or plan.problem.projection is None else 1e-3
    times, costs = plan.departures.T
    known = np.isfinite(costs)
    axes.plot(times, np.where(known, costs * scale, np.nan), color="0.35", linewidth=1.2)
    draw_mark(axes, (plan.departure, plan.cost * scale), "o", 6.0, face=COLOURS[0], markeredgecolor="white", zorder=5.0)
    axes.set_title(f"departs at {plan.departure:.4g}, costs {digits(plan.cost * scale, 4)}", fontsize=9)
    axes.margins(y=0.15)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.set_xlabel("departure")
    axes.set_ylabel("least cost, about" if scale == 1.0 else "least cost, about, km")


class TimedFilm(FuncAnimation):
    """The film of a timed plan: the map at one time after the other."""

    def __init__(self, plan: TimedPlan, axes: Axes) -> None:
        self._plan, self._ax, self._top = plan, axes, greatest_risk(plan)
        root = axes.figure
        while not isinstance(root, Figure):
            root = root.figure
        times = np.linspace(plan.departure, plan.arrival, FRAMES).tolist()
        super().__init__(root, self._show, frames=times, init_func=list, interval=100)

    def _show(self, time: float) -> Sequence[Any]:
        self._ax.clear()
        draw_moment(self._ax, self._plan, time, self._top)
        return self._ax.get_children()


def write_film(plan: TimedPlan, path: Path) -> Path:
    """
    Write the film of a plan as GIF, whole or not at all: the same plan gives the same bytes.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    with style(), tempfile.TemporaryDirectory() as folder:
        film = TimedFilm(plan, Figure(figsize=(4.4, 4.4)).add_subplot())
        film.save(str(Path(folder, "film.gif")), writer=PillowWriter(fps=10), dpi=90)
        write_files({path: Path(folder, "film.gif").read_bytes()})
    return path


def _at(problem: TimedProblem, time: float) -> Problem:
    """Return the map at a time without its areas, as ends may be inside of them then."""
    still = problem.still
    return Problem(
        still.start, still.goal, problem.field_at(time), still.k, bounds=still.bounds, projection=still.projection
    )

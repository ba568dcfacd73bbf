"""Pictures of flights through risk that moves: the map at some times, and what each departure of a UAV costs."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cgla_graph._files import write_files
from cgla_graph._text import figure as digits
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.plots.looks import COLOURS
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import style
from cgla_graph.plots.risk_samples import risk_samples
from cgla_graph.plots.scene import Look, TitledProblem, clip_to_bounds, draw_area, draw_mark, draw_ring, unit_scale
from cgla_graph.timed.team_plan import TeamPlan
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem

#: Times of the flight that are shown, as parts of it, and frames of a film.
MOMENTS, FRAMES = (0.0, 0.5, 1.0), 45
_PANEL, _CURVE = 3.4, 1.7  # inches: width of the map at a time, height of the costs of departures
_PROBES = 9  # times at which the greatest risk is looked for
_ARROWS = 9  # arrows of wind along the longer side of the map


class Flights(NamedTuple):
    """The flights of a plan, and what their pictures have in common."""

    problem: TimedProblem
    plans: Sequence[TimedPlan]
    names: Sequence[str]
    others: Sequence[Trajectory]
    separation: float
    times: tuple[float, float]
    top: float
    gale: float

    @classmethod
    def of(cls, plan: TimedPlan | TeamPlan) -> "Flights":
        """Return those of a plan; raise a `ProblemError` if it has none, or does not know its problem."""
        if not plan.status.has_path:
            msg = f"there is no flight to draw: {plan.status.label}"
            raise ProblemError(msg)
        plans = (plan,) if isinstance(plan, TimedPlan) else plan.plans
        problem = plans[0].problem
        if not isinstance(problem, TimedProblem):
            msg = "this plan does not know its problem, as copies from elsewhere; plan again: cg.solve(problem)"
            raise ProblemError(msg)
        times = min(one.departure for one in plans), max(one.arrival for one in plans)
        # (colours mean the same at all times)
        top = max(risk_samples(_at(problem, time), 120).top for time in np.linspace(*times, _PROBES).tolist())
        gale = float(np.hypot(problem.wind_grid.u, problem.wind_grid.v).max())
        if isinstance(plan, TimedPlan):
            return cls(problem, plans, ("",), problem.others, problem.separation, times, top, gale)
        # (the problems of a team have its flights among the others)
        own = {_key(one.motion) for one in plans}
        beside = {_key(one): one for each in plans for one in each.problem.others if _key(one) not in own}
        return cls(problem, plans, plan.names, tuple(beside.values()), plan.separation, times, top, gale)

    @property
    def middle(self) -> float:
        """The time half way."""
        return 0.5 * sum(self.times)


def timed_figure(plan: TimedPlan | TeamPlan, figure: Figure | None = None) -> Figure:
    """
    Draw flights at their begin, middle and end; of one UAV also what each departure costs about, if there is a choice.

    Parameters
    ----------
    plan
        A plan with flights.
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
    flights, figure = Flights.of(plan), figure or Figure()
    has_choice = isinstance(plan, TimedPlan) and len(plan.departures) > 1
    x_min, y_min, x_max, y_max = flights.problem.bounds
    rise = min(max((y_max - y_min) / (x_max - x_min), 0.3), 2.0)
    # (degrees are longer words than kilometres)
    left, wide = (0.06, 0.28) if flights.problem.projection is None else (0.1, 0.55)
    with style():
        figure.set_size_inches(_PANEL * len(MOMENTS), _PANEL * rise + 0.7 + _CURVE * has_choice)
        ratios = [_PANEL * rise, *([_CURVE] if has_choice else [])]
        grid = figure.add_gridspec(len(ratios), len(MOMENTS), height_ratios=ratios, hspace=0.35, wspace=wide)
        figure.subplots_adjust(left=left, right=0.96, top=0.94, bottom=0.1 if has_choice else 0.15)
        begins, ends = flights.times
        for column, part in enumerate(MOMENTS):
            draw_moment(figure.add_subplot(grid[0, column]), flights, begins + part * (ends - begins))
        if isinstance(plan, TimedPlan) and has_choice:
            draw_departures(figure.add_subplot(grid[1, :]), plan)
    return figure


def draw_moment(axes: Axes, flights: Flights, time: float) -> None:
    """Draw risk, closed areas and wind at a time, the flights so far, the rest of them thin, and others in grey."""
    problem = flights.problem
    shown = TitledProblem(_at(problem, time))
    with style():
        base = BaseMap.on(axes, shown, places=[plan.path for plan in flights.plans])
        for image in axes.images:
            image.set_clim(0.0, max(flights.top, np.finfo(float).tiny))
        scale, slab = unit_scale(shown.problem), problem.slab_at(time)
        if slab.no_fly is not None and not slab.no_fly.is_empty:
            clip_to_bounds(axes, problem.bounds, draw_area(axes, slab.no_fly, scale), scale)
        if flights.gale > 0.0:
            _draw_wind(axes, flights, time, scale)
        for other in flights.others:
            clip_to_bounds(
                axes, problem.bounds, _draw_flight(axes, other, time, "0.3", flights.separation, scale), scale
            )
        for number, (plan, name) in enumerate(zip(flights.plans, flights.names, strict=True)):
            colour, place = COLOURS[number % len(COLOURS)], plan.at(time)
            here = place[0] * scale, place[1] * scale
            _draw_flight(axes, plan.motion, time, colour, flights.separation, scale)
            for end, marker, size in ((plan.path[0], "o", 5.0), (plan.path[-1], "*", 9.0)):
                draw_mark(base.axes, end * scale, marker, size, markeredgecolor="black", zorder=4.0)
            draw_mark(axes, here, "o", 6.0, face=colour, markeredgecolor="white", zorder=5.0)
            side = "left" if 2.0 * place[0] < problem.bounds[0] + problem.bounds[2] else "right"
            offset = (4 if side == "left" else -4, 4)
            axes.annotate(name, here, offset, textcoords="offset points", ha=side, fontsize=7, zorder=5.1)
        arrows = f", arrows: wind up to {flights.gale:.3g}" if flights.gale > 0.0 else ""
        axes.set_title(f"time {time:.4g}{arrows}", fontsize=9)


def _draw_flight(
    axes: Axes, motion: Trajectory, time: float, colour: str, separation: float, scale: float
) -> list[Artist]:
    """Draw a flight: thin, what is flown in bold, and half of the separation around it while it lasts."""
    flown = motion.part(motion.begins, time)
    drawn: list[Artist] = [*axes.plot(*(motion.points * scale).T, color=colour, linewidth=0.7, alpha=0.7, zorder=3.0)]
    if flown is not None:
        drawn += axes.plot(*(flown.points * scale).T, color=colour, linewidth=1.8, zorder=3.1)
    if separation > 0.0 and motion.begins <= time <= motion.ends:
        # (discs of two UAVs that keep apart do not overlap)
        here = np.multiply(motion.at(time), scale)
        drawn.append(draw_ring(axes, (here[0], here[1]), 0.5 * separation * scale, edgecolor=colour, linewidth=0.8))
    return drawn


def _draw_wind(axes: Axes, flights: Flights, time: float, scale: float) -> None:
    """Draw the wind at a time; the strongest one at all times is as long as the arrows are apart."""
    low, high = np.reshape(flights.problem.bounds, (2, 2))
    counts = np.maximum(np.rint(_ARROWS * (high - low) / (high - low).max()), 1).astype(int)
    x, y = (a + (b - a) * (np.arange(n) + 0.5) / n for a, b, n in zip(low, high, counts, strict=True))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    arrows = flights.problem.wind_at(places, time) * ((high - low).max() / _ARROWS / flights.gale)
    look: Look = {"pivot": "mid", "color": "0.45", "width": 0.004, "zorder": 2.6}
    axes.quiver(*(places * scale).T, *(arrows * scale).T, angles="xy", scale_units="xy", scale=1.0, **look)


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

    def __init__(self, flights: Flights, axes: Axes) -> None:
        self._flights, self._ax = flights, axes
        root = axes.figure
        while not isinstance(root, Figure):
            root = root.figure
        times = np.linspace(*flights.times, FRAMES).tolist()
        super().__init__(root, self._show, frames=times, init_func=list, interval=100)

    def _show(self, time: float) -> Sequence[Any]:
        self._ax.clear()
        draw_moment(self._ax, self._flights, time)
        return self._ax.get_children()


def write_film(plan: TimedPlan | TeamPlan, path: Path) -> Path:
    """
    Write the film of a plan as GIF, whole or not at all: the same plan gives the same bytes.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    with style(), tempfile.TemporaryDirectory() as folder:
        film = TimedFilm(Flights.of(plan), Figure(figsize=(4.4, 4.4)).add_subplot())
        film.save(str(Path(folder, "film.gif")), writer=PillowWriter(fps=10), dpi=90)
        write_files({path: Path(folder, "film.gif").read_bytes()})
    return path


def _key(motion: Trajectory) -> tuple[bytes, bytes]:
    """Return what equal trajectories have in common."""
    return motion.times.tobytes(), motion.points.tobytes()


def _at(problem: TimedProblem, time: float) -> Problem:
    """Return the map at a time without its areas, as ends may be inside of them then."""
    still = problem.still
    return Problem(
        still.start, still.goal, problem.field_at(time), still.k, bounds=still.bounds, projection=still.projection
    )

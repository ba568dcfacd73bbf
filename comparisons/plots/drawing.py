"""Pictures from Python: problems, solutions, certificates and flights, drawn by the functions of the command line."""

import base64
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.plots.animation import DPI, Film, frame_ticks
from cgla_graph.comparisons.plots.animation_file import animate as write_animation
from cgla_graph.comparisons.plots.animation_file import frame_milliseconds
from cgla_graph.comparisons.plots.certificate import certificate_figure, draw_certificate
from cgla_graph.comparisons.plots.flight import draw_flight, flight_figure
from cgla_graph.comparisons.plots.looks import COLOURS
from cgla_graph.comparisons.plots.map import draw_map, map_figure
from cgla_graph.comparisons.plots.page import style
from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import OutputError, ProblemError
from cgla_graph.mission.records import Flight
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario

#: Edges of a graph that are drawn, at most: of more, one sees nothing but ink.
_MOST_EDGES = 2000


def plot(thing: object, ax: Axes | None = None, *, solutions: Iterable[Solution] = ()) -> Axes:
    """
    Draw what has a picture on axes, or on a new figure.

    Raises
    ------
    ProblemError
        If it does not know its problem, or a graph has no positions.
    """
    match thing:
        case Problem():
            return plot_problem(thing, solutions, ax=ax)
        case GraphProblem():
            return _plot_graph(thing, None, ax)
        case Solution():
            return _plot_solution(thing, ax)
        case Certificate():
            both: Axes = _plot_certificate(thing, ax)
            return both
        case Flight():
            return _plot_flight(thing, ax)
    msg = f"a {type(thing).__name__} has no picture; plot a problem, a solution, a certificate or a flight"
    raise ProblemError(msg)


def plot_problem(problem: Problem, solutions: Iterable[Solution], *, ax: Axes | None = None) -> Axes:
    """
    Draw a map with the paths of solutions.

    Raises
    ------
    ProblemError
        If one of them is no solution.
    """
    scenario, runs = scenario_of(problem), _runs(problem, solutions)
    if ax is not None:
        draw_map(_axes(ax), scenario, runs)
        return ax
    return map_figure(scenario, runs, figure=_figure()).axes[0]


def scenario_of(problem: Problem) -> Scenario:
    """Make a scenario of a problem, as the pictures of the command line have it; without a name, as none is known."""
    return Scenario("", "", problem, Lattice(20, bounds=problem.bounds))


def view_of(flight: Flight) -> MissionRun:
    """Give a flight a name, as the pictures of the command line have it."""
    rules: Any = flight.mission
    return MissionRun("flight", "", "", "", rules, flight=flight)


def _runs(problem: Problem, solutions: Iterable[Solution]) -> list[Run]:
    """Name solutions after their solvers, and those of one solver by numbers."""
    runs: list[Run] = []
    for solution in solutions:
        if not isinstance(solution, Solution):
            msg = f"a {type(solution).__name__} is no solution; give what cg.solve returned: problem.plot(solution, …)"
            raise ProblemError(msg)
        name = solution.solver or "path"
        same = sum(run.solver.split(" (")[0] == name for run in runs)
        runs.append(
            Run(scenario_of(problem), f"{name} ({same + 1})" if same else name, None, exact=False, solution=solution)
        )
    return runs


def _axes(ax: object) -> Axes:
    if isinstance(ax, Axes):
        return ax
    msg = f"ax is a {type(ax).__name__}; give matplotlib axes, as of plt.subplots(), or none"
    raise ProblemError(msg)


def _figure() -> Figure:
    """Make a figure as `pyplot` does, so that notebooks show it and ``plt.show()`` opens it."""
    from matplotlib import pyplot as plt  # noqa: PLC0415 - its state is nobody's business who gives axes

    return plt.figure()


def _known(thing: Solution | Certificate) -> Problem | GraphProblem:
    if thing.problem is None:
        kind = type(thing).__name__.lower()
        msg = f"this {kind} does not know its problem; problem.plot(solution) draws a solution from elsewhere"
        raise ProblemError(msg)
    problem: Problem | GraphProblem = thing.problem
    return problem


def _plot_solution(solution: Solution, ax: Axes | None) -> Axes:
    problem = _known(solution)
    if isinstance(problem, GraphProblem):
        return _plot_graph(problem, solution, ax)
    return plot_problem(problem, [solution], ax=ax)


def _plot_graph(problem: GraphProblem, solution: Solution | None, ax: Axes | None) -> Axes:
    """Draw nodes, edges where they are few, and the path."""
    graph = problem.graph
    if graph.positions is None:
        msg = "the nodes of this graph have no positions, so that there is nothing to draw; build it with pos="
        raise ProblemError(msg)
    axes = _figure().add_subplot() if ax is None else _axes(ax)
    places = graph.positions
    with style():
        if graph.n_pairs <= _MOST_EDGES:
            for i in range(graph.n_nodes):
                row = graph.weights_from(i)
                for j in np.flatnonzero(np.isfinite(row) & (np.arange(graph.n_nodes) != i)).tolist():
                    axes.plot(*places[[i, j]].T, color="0.85", linewidth=0.6, zorder=1.0)
        axes.scatter(places[:, 0], places[:, 1], s=6.0, color="0.6", zorder=2.0)
        if solution is not None and solution.status.has_path:
            label = f"{solution.solver or 'path'}: {solution.cost:.5g}"
            axes.plot(*np.transpose(solution.path), color=COLOURS[0], linewidth=1.6, zorder=3.0, label=label)
        for name, node, marker in (("start", problem.source, "o"), ("goal", problem.target, "*")):
            place = places[graph.index_of(node)]
            look: dict[str, Any] = {"markersize": 9.0, "markerfacecolor": "white", "markeredgecolor": "black"}
            axes.plot(*place, linestyle="none", marker=marker, label=name, zorder=4.0, **look)
        axes.set_aspect("equal")
        axes.set_xlabel("x")
        axes.set_ylabel("y")
        axes.legend()
    return axes


def _plot_certificate(certificate: Certificate, ax: object) -> Any:  # noqa: ANN401 - axes, one or two
    problem = _known(certificate)
    if not isinstance(problem, Problem):
        msg = "this certificate is of a graph, and only those of maps are drawn"
        raise ProblemError(msg)
    name, solution = "", Solution(Status.NOT_FOUND, lower_bound=certificate.lower_bound)
    if certificate.path is not None:
        name = "path"
        solution = replace(solution, status=Status.FOUND, path=certificate.path, cost=certificate.upper_bound)
    run = Run(scenario_of(problem), name, None, exact=False, solution=solution, certificate=certificate)
    if ax is None:
        figure = certificate_figure(run, figure=_figure())
        return figure.axes[0], figure.axes[-1]
    both = [_axes(one) for one in np.ravel(np.array(ax, dtype=object))]
    draw_certificate(both, run)
    return ax


def _plot_flight(flight: Flight, ax: Axes | None) -> Axes:
    view = view_of(flight)
    if ax is not None:
        draw_flight(_axes(ax), view)
        return ax
    return flight_figure([view], figure=_figure()).axes[0]


class FlightAnimation(FuncAnimation):
    """The film of a flight on a figure of matplotlib's: shown by notebooks, written by `save`."""

    def __init__(self, view: MissionRun, ax: Axes | None) -> None:
        self._view = view
        ticks = frame_ticks(view.flight.ticks)
        with style():
            film = Film(view)
            first = np.asarray(film.frame(ticks[0]))
        if ax is None:
            height, width = first.shape[:2]
            figure = _figure()
            figure.set_size_inches(width / DPI, height / DPI)
            figure.set_dpi(DPI)
            ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        root = ax.figure
        while not isinstance(root, Figure):
            root = root.figure
        ax.set_axis_off()
        self._image = ax.imshow(first)
        draw = partial(self._show, film)
        super().__init__(
            root, draw, frames=ticks, init_func=lambda: [self._image], interval=frame_milliseconds(len(ticks))
        )

    def _show(self, film: Film, tick: int) -> Sequence[Any]:
        with style():
            self._image.set_data(np.asarray(film.frame(tick)))
        return [self._image]

    def save(self, filename: str | Path, *arguments: Any, **settings: Any) -> None:  # noqa: ANN401 - matplotlib's
        """
        Write ``.gif`` or ``.mp4`` as `cgla fly` does; with settings or other endings, as matplotlib does.

        Raises
        ------
        OutputError
            If it cannot be drawn or written.
        """
        if not arguments and not settings and Path(filename).suffix.lower() in {".gif", ".mp4"}:
            self._draw_was_started = True  # or matplotlib warns that nobody looked at it
            write_animation(self._view, [Path(filename)])
            return
        super().save(str(filename), *arguments, **settings)

    def _repr_html_(self) -> str:
        """Show it in a notebook, as an image that repeats."""
        self._draw_was_started = True
        with tempfile.TemporaryDirectory() as folder:
            (file,) = write_animation(self._view, [Path(folder, "flight.gif")], small=True)
            data = base64.b64encode(file.read_bytes()).decode()
        return f'<img alt="the flight, tick by tick" style="max-width:100%" src="data:image/gif;base64,{data}">'


def animate(flight: Flight, *, ax: Axes | None = None) -> FlightAnimation:
    """Return the film of a flight (see `cgla_graph.Flight.animate`)."""
    if not flight.uavs:
        msg = "nobody flies, so that there is nothing to show"
        raise OutputError(msg)
    return FlightAnimation(view_of(flight), None if ax is None else _axes(ax))

"""`cgla_graph.plot` and `cgla_graph.animate`: pictures of the library's objects."""

import base64
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial, singledispatch
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from cgla_graph._lazy import function_above
from cgla_graph._text import figure as digits
from cgla_graph.airspace.plan_check.result import PlanCheck
from cgla_graph.airspace.volumes.volumes import Volumes
from cgla_graph.certificate.answers import Answers
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.certificate.corridor import Corridor
from cgla_graph.certificate.isochrones import Isochrones
from cgla_graph.cost_to_go.cost_matrix import CostMatrix
from cgla_graph.errors import OutputError, ProblemError
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import Rules
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.plots.animation import DPI, Film, frame_ticks
from cgla_graph.plots.animation_file import animate as write_animation
from cgla_graph.plots.animation_file import frame_milliseconds
from cgla_graph.plots.answers import answers_figure, draw_answers
from cgla_graph.plots.certificate import certificate_figure, draw_certificate
from cgla_graph.plots.check import check_figure, draw_check
from cgla_graph.plots.corridor import corridor_figure, draw_corridor
from cgla_graph.plots.flight import LabelledFlight, draw_flight, flight_figure
from cgla_graph.plots.graph import draw_graph, draw_node, drawn_nodes
from cgla_graph.plots.looks import COLOURS, LabelledPath, labelled_paths
from cgla_graph.plots.map import draw_map, map_figure
from cgla_graph.plots.page import style
from cgla_graph.plots.scene import TitledProblem
from cgla_graph.plots.timed import Flights, TimedFilm, draw_moment, timed_figure
from cgla_graph.plots.volumes import draw_volumes, volumes_figure
from cgla_graph.scenarios.graphs.graph_scenario import GraphScenario
from cgla_graph.scenarios.mission_file import MissionFile
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.timed.team_plan import TeamPlan
from cgla_graph.timed.timed_plan import TimedPlan


@singledispatch
def plot(thing: object, ax: Axes | None = None, *, solutions: Iterable[Solution] = ()) -> Any:  # noqa: ANN401 - axes, one or two
    """
    Draw a problem, scenario, graph, cost matrix, solution, certificate, mission, flight, or another result.

    Parameters
    ----------
    thing
        An object of one of these kinds; other results are corridors, answers to many questions, isochrones, checked
        plans and volumes.
    ax
        Matplotlib axes to draw on, with a legend inside; None makes a figure, as ``pyplot`` does, with a legend beside
        the map. For a certificate, two axes may be given: for the map, and for the bounds of its grids.
    solutions
        For a problem: solutions whose paths are drawn on its map.

    Returns
    -------
    axes
        The axes of the picture (both for a certificate on a new figure). Coordinates are map units, or kilometres on a
        map in longitude and latitude.

    Raises
    ------
    ProblemError
        If there is no picture of such an object, it does not know its problem, or its graph has no positions.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> import cgla_graph as cg
    >>> problem = cg.Problem((0.1, 0.1), (0.9, 0.9))
    >>> axes = cg.plot(problem, Figure().add_subplot(), solutions=[cg.solve(problem, "straight-line")])
    >>> [text.get_text() for text in axes.get_legend().get_texts()]
    ['straight-line: 1.1314', 'start', 'goal']
    """
    del ax, solutions
    known = "problem, scenario, graph, cost matrix, solution, certificate, corridor, mission, flight, checked plan, "
    known += "volumes, timed plans, answers of cg.Map"
    msg = f"a {type(thing).__name__} has no picture; give a {known} or isochrones"
    raise ProblemError(msg)


@plot.register
def _(problem: Problem, ax: Axes | None = None, *, solutions: Iterable[Solution] = ()) -> Axes:
    paths = labelled_paths(_named(solutions))
    if ax is not None:
        draw_map(_axes(ax), TitledProblem(problem), paths)
        return ax
    bounds = [one.solution.lower_bound for one in paths if one.solution.status.has_path]
    bound = max((bound for bound in bounds if not np.isnan(bound)), default=np.nan)
    return map_figure(TitledProblem(problem), paths, bound, figure=_figure()).axes[0]


@plot.register
def _(scenario: Scenario, ax: Axes | None = None) -> Axes:
    return _drawn(ax, draw_map, map_figure, TitledProblem.of(scenario), [])


@plot.register
def _(solution: Solution, ax: Axes | None = None) -> Axes:
    problem = _known(solution)
    if isinstance(problem, GraphProblem):
        return _plot_graph_problem(problem, ax, solution)
    axes: Axes = plot(problem, ax, solutions=[solution])
    return axes


@plot.register
def _(certificate: Certificate, ax: Axes | None = None) -> Any:  # noqa: ANN401 - axes, one or two
    problem = _known(certificate)
    if not isinstance(problem, Problem):
        msg = "this certificate is of a graph, and only those of maps are drawn"
        raise ProblemError(msg)
    paths: list[LabelledPath] = []
    if certificate.path is not None:
        paths.append(LabelledPath("path", Solution(Status.FOUND, certificate.path, cost=certificate.upper_bound)))
    if ax is None:
        figure = certificate_figure(TitledProblem(problem), certificate, paths, figure=_figure())
        return figure.axes[0], figure.axes[-1]
    both = [_axes(one) for one in np.ravel(np.array(ax, dtype=object))]
    draw_certificate(both, TitledProblem(problem), certificate, paths)
    return ax


@plot.register
def _(corridor: Corridor, ax: Axes | None = None) -> Axes:
    return _drawn(ax, draw_corridor, corridor_figure, TitledProblem(corridor.problem), corridor)


@plot.register(Answers)
@plot.register(Isochrones)
def _(answers: Answers | Isochrones, ax: Axes | None = None) -> Axes:
    return _drawn(ax, draw_answers, answers_figure, TitledProblem(answers.problem), answers)


@plot.register
def _(checked: PlanCheck, ax: Axes | None = None) -> Axes:
    return _drawn(ax, draw_check, check_figure, checked)


@plot.register
def _(volumes: Volumes, ax: Axes | None = None) -> Axes:
    return _drawn(ax, draw_volumes, volumes_figure, volumes)


def _drawn(ax: Axes | None, draw: Callable[..., None], make: Callable[..., Figure], *shown: object) -> Axes:
    """Draw on axes of the user's, or on a new figure."""
    if ax is None:
        return make(*shown, figure=_figure()).axes[0]
    draw(_axes(ax), *shown)
    return ax


@plot.register(TimedPlan)
@plot.register(TeamPlan)
def _(plan: TimedPlan | TeamPlan, ax: Axes | None = None) -> Axes:
    """Draw a timed plan at some times, or at the middle of its flights on axes of the user's."""
    flights = Flights.of(plan)
    if ax is not None:
        draw_moment(_axes(ax), flights, flights.middle)
        return ax
    return timed_figure(plan, _figure()).axes[0]


@plot.register
def _(flight: Flight, ax: Axes | None = None) -> Axes:
    return _plot_flight(LabelledFlight(flight), ax)


@plot.register
def _(mission: Rules, ax: Axes | None = None) -> Axes:
    return _plot_flight(LabelledFlight.before(mission), ax)


@plot.register
def _(file: MissionFile, ax: Axes | None = None) -> Axes:
    """Draw the first variant before it is flown."""
    mission = next(iter(file.missions(function_above("solvers").get).values()))
    before = LabelledFlight.before(mission)
    return _plot_flight(replace(before, name=file.name, title=file.title, projection=file.projection), ax)


def _plot_flight(view: LabelledFlight, ax: Axes | None) -> Axes:
    if ax is not None:
        draw_flight(_axes(ax), view)
        return ax
    return flight_figure([view], figure=_figure()).axes[0]


@plot.register
def _(graph: GeometricGraph, ax: Axes | None = None) -> Axes:
    with style():
        return _on_axes(graph, ax)


@plot.register
def _plot_graph_problem(problem: GraphProblem, ax: Axes | None = None, solution: Solution | None = None) -> Axes:
    graph = problem.graph
    with style():
        axes = _on_axes(graph, ax)
        if solution is not None and solution.status.has_path:
            label = f"{solution.solver or 'path'}: {digits(solution.cost, 5)}"
            axes.plot(*np.transpose(solution.path), color=COLOURS[0], linewidth=1.6, zorder=3.0, label=label)
        draw_node(axes, graph, graph.index_of(problem.source), "start", "o")
        draw_node(axes, graph, graph.index_of(problem.target), "goal", "*")
        axes.legend()
    return axes


@plot.register
def _(scenario: GraphScenario, ax: Axes | None = None) -> Axes:
    return _plot_graph_problem(scenario.problem, ax)


@plot.register
def _(matrix: CostMatrix, ax: Axes | None = None) -> Axes:
    """Draw nodes in the colours of their costs-to-go, and the paths to the target."""
    graph, is_own = matrix.graph, ax is None
    with style():
        axes = _on_axes(graph, ax, edges=False)
        places = np.asarray(graph.positions)
        known = np.flatnonzero(np.isfinite(matrix.values) & drawn_nodes(graph))
        steps = known[matrix.successors[known] >= 0]
        ways = np.stack([places[steps], places[matrix.successors[steps]]], axis=1)
        axes.add_collection(LineCollection(list(ways), colors="0.75", linewidths=0.7, zorder=1.5))
        dots = axes.scatter(
            places[known, 0], places[known, 1], c=matrix.values[known], s=14.0, cmap="viridis", zorder=2.5
        )
        if is_own:
            axes.figure.colorbar(dots, ax=axes, label="least cost to the target")
        draw_node(axes, graph, matrix.target, "target", "*")
        axes.legend()
    return axes


def _on_axes(graph: GeometricGraph, ax: Axes | None, *, edges: bool = True) -> Axes:
    """Draw a graph on axes, or on those of a new figure."""
    if graph.positions is None:
        # (before a figure is opened)
        draw_graph(graph, Figure().add_subplot())
    axes = _figure().add_subplot() if ax is None else _axes(ax)
    draw_graph(graph, axes, edges=edges)
    return axes


def _named(solutions: Iterable[Solution]) -> dict[str, Solution]:
    """Name solutions after their solvers, and further ones of one solver by numbers."""
    named: dict[str, Solution] = {}
    for solution in solutions:
        if not isinstance(solution, Solution):
            msg = f"a {type(solution).__name__} is no solution; give the result of cg.solve: problem.plot(solution, …)"
            raise ProblemError(msg)
        name = solution.solver or "path"
        same = sum(other.split(" (")[0] == name for other in named)
        named[f"{name} ({same + 1})" if same else name] = solution
    return named


def _axes(ax: object) -> Axes:
    if isinstance(ax, Axes):
        return ax
    msg = f"ax is a {type(ax).__name__}; give matplotlib axes, as of plt.subplots(), or none"
    raise ProblemError(msg)


def _figure() -> Figure:
    """Make a figure as `pyplot` does, which notebooks show and ``plt.show()`` opens."""
    from matplotlib import pyplot as plt  # noqa: PLC0415 - where axes are given, its state stays as it is

    return plt.figure()


def _known(thing: Solution | Certificate) -> Problem | GraphProblem:
    if thing.problem is None:
        kind = type(thing).__name__.lower()
        msg = f"this {kind} does not know its problem; problem.plot(solution) draws a solution from elsewhere"
        raise ProblemError(msg)
    problem: Problem | GraphProblem = thing.problem
    return problem


class FlightAnimation(FuncAnimation):
    """The film of a flight on a matplotlib figure: notebooks show it, and `save` writes it."""

    def __init__(self, view: LabelledFlight, ax: Axes | None) -> None:
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
        Write ``.gif`` or ``.mp4`` as ``cgla fly`` does; with settings or other endings, as matplotlib does.

        Raises
        ------
        OutputError
            If it cannot be drawn or written.
        """
        if not arguments and not settings and Path(filename).suffix.lower() in {".gif", ".mp4"}:
            self._draw_was_started = True  # or matplotlib warns that the film was never shown
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


def animate(flight: Flight | TimedPlan | TeamPlan, ax: Axes | None = None) -> FuncAnimation:
    """
    Animate a flight: the true risk, and the knowledge and the plan of each UAV; or a plan through risk that moves.

    Parameters
    ----------
    flight
        The flight of a mission, or a timed plan, also of a team.
    ax
        Matplotlib axes that show the film; None makes a figure of its size.

    Returns
    -------
    animation
        Notebooks show it. ``animation.save("flight.gif")`` (or ``.mp4``, where ffmpeg is installed) writes what
        ``cgla fly`` writes.

    Raises
    ------
    OutputError
        If no UAV flies.
    ProblemError
        If `flight` is neither, or a plan without a flight.
    """
    if isinstance(flight, TimedPlan | TeamPlan):
        flights = Flights.of(flight)
        return TimedFilm(flights, _figure().add_subplot() if ax is None else _axes(ax))
    if not isinstance(flight, Flight):
        msg = (
            f"a {type(flight).__name__} cannot be animated; give a flight, as mission.fly() returns it, or a timed plan"
        )
        raise ProblemError(msg)
    if not flight.uavs:
        msg = "no UAV flies, so that there is nothing to show"
        raise OutputError(msg)
    return FlightAnimation(LabelledFlight(flight), None if ax is None else _axes(ax))

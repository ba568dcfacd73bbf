"""The picture of how soon anytime solvers find good paths: best cost over time, beside what the others found."""

import math
import statistics
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.plot_page import Part, add_legend, arrange, style
from cgla_graph.comparisons.plot_solvers import DASHES, Entry, entries_of
from cgla_graph.comparisons.plot_text import cost_label, cost_text, heading
from cgla_graph.comparisons.plot_units import cost_unit, unit_scale
from cgla_graph.comparisons.runner import Run
from cgla_graph.scenario import Scenario

_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_SAME_COST = 1e-6  # costs closer than this, relatively, are one


def trace_figure(scenario: Scenario, runs: Sequence[Run]) -> Figure | None:
    """
    Draw the best cost of anytime solvers against time, beside what the other solvers found.

    Parameters
    ----------
    scenario
        The map.
    runs
        Its runs; every seed is a line. Dashed lines are the costs of exact solvers, markers the results of all solvers
        without a trace, at the time that they needed (weighing the graph included).

    Returns
    -------
    figure
        Costs far above the first ones of anytime solvers are marked at the upper edge. None if no run found a path and
        has a trace.

    Examples
    --------
    >>> from cgla_graph.scenario import load_scenario
    >>> trace_figure(load_scenario("paper"), []) is None
    True
    """
    scale = unit_scale(scenario)
    traces = [(run, trace) for run in runs if len(trace := _trace(run, scale))]
    if not traces:
        return None
    entries = entries_of(runs)
    others = [run for run in runs if not run.solution.trace and run.solution.status.is_path]
    low, high = _cost_limits([trace for _, trace in traces], [run.solution.cost * scale for run in others])
    with style():
        figure = Figure()
        axes = figure.add_subplot()
        axes.set_ylim(low, high)
        drawn = _draw_traces(axes, entries, traces) | _draw_results(axes, entries, others, scale)
        shown = [entry for entry in entries if entry.label in drawn]
        handles = [drawn[entry.label] for entry in shown]
        labels = [cost_label(entry, scale, above=high) for entry in shown]
        for line, label in _draw_exact(axes, others, scale):
            handles.append(line)
            labels.append(label)
        unit = cost_unit(scenario)
        _frame_trace(axes, unit)
        legend = add_legend(figure, handles, labels, title=f"best cost{unit}", columns=math.ceil(len(labels) / 17))
        arrange(figure, heading(scenario), [Part.of(figure, axes, (4.6, 3.2)), Part.of(figure, legend)])
    return figure


def _trace(run: Run, scale: float) -> FloatArray:
    """Return the rows (seconds, cost) of a run that found a path, up to its end; none of them before the first path."""
    solution = run.solution
    points = [(point.seconds, point.cost * scale) for point in solution.trace if math.isfinite(point.cost)]
    if not points or not solution.status.is_path:
        return np.empty((0, 2))
    points.append((max(solution.seconds, points[-1][0]), points[-1][1]))
    return np.add(points, (solution.build_seconds, 0.0))


def _cost_limits(traces: Sequence[FloatArray], others: Sequence[float]) -> tuple[float, float]:
    """
    Choose the least and greatest cost to show: from the best to where the anytime solvers begin.

    A first cost far above the next one (or above other seeds') would press everything else flat.

    Examples
    --------
    >>> traces = [np.array([(0, 1000), (1, 2), (2, 1)])]
    >>> _cost_limits(traces, [1.5, 50])
    (0.94, 2.12)
    """
    best = min([*others, *(trace[-1, 1] for trace in traces)])
    begins = []
    for trace in traces:
        first, second = trace[0, 1] - best, trace[1, 1] - best
        begins.append(second if first > 10.0 * second > 0.0 else first)
    usual = statistics.median_low(begins)
    reach = max(begin for begin in begins if begin <= 4.0 * usual)
    near = [cost - best for cost in others if cost - best <= 1.5 * reach]
    reach = max([reach, *near]) or 0.01 * abs(best) or 1.0
    return float(best - 0.06 * reach), float(best + 1.12 * reach)


def _draw_traces(axes: Axes, entries: Sequence[Entry], traces: Sequence[tuple[Run, FloatArray]]) -> dict[str, Artist]:
    """Draw a line for each seed; return a handle for each solver."""
    by_label = {entry.label: entry for entry in entries}
    # a logarithmic axis has no 0
    earliest = min((t for _, trace in traces for t in trace[:, 0].tolist() if t > 0.0), default=1e-3)
    drawn: dict[str, Artist] = {}
    solvers = list(dict.fromkeys(run.solver for run, _ in traces))
    for run, trace in traces:
        entry = by_label[run.solver]
        (line,) = axes.step(
            np.maximum(trace[:, 0], earliest),
            trace[:, 1],
            where="post",
            color=entry.colour,
            linestyle=DASHES[solvers.index(run.solver) % len(DASHES)],
            linewidth=1.1,
            zorder=3,
        )
        drawn[run.solver] = line
    return drawn


def _draw_results(axes: Axes, entries: Sequence[Entry], runs: Sequence[Run], scale: float) -> dict[str, Artist]:
    """Draw a marker for each result without a trace, on the upper edge where it is above; return handles."""
    by_label = {entry.label: entry for entry in entries}
    drawn: dict[str, Artist] = {}
    for run in runs:
        entry, solution = by_label[run.solver], run.solution
        (mark,) = axes.plot(
            max(solution.seconds + solution.build_seconds, 1e-6),
            min(solution.cost * scale, axes.get_ylim()[1]),
            linestyle="none",
            color=entry.colour,
            marker=_MARKERS[entry.number % len(_MARKERS)],
            # equal costs in equal times: the first stands out behind the last
            markersize=max(6.0, 9.0 - 0.7 * entry.number),
            markeredgecolor="white",
            markeredgewidth=0.6,
            clip_on=False,
            zorder=4,
        )
        drawn[run.solver] = mark
    return drawn


def _draw_exact(axes: Axes, runs: Sequence[Run], scale: float) -> Iterator[tuple[Artist, str]]:
    """Draw a line for each cost of exact solvers (they mostly agree); yield handles and labels of the legend."""
    costs: list[float] = []
    for run in runs:
        cost = run.solution.cost * scale
        if run.exact and not any(math.isclose(cost, other, rel_tol=_SAME_COST) for other in costs):
            costs.append(cost)
    for cost in costs:
        if cost <= axes.get_ylim()[1]:
            yield (
                axes.axhline(cost, color="0.35", linestyle=(0, (5, 3)), linewidth=0.8, zorder=2),
                f"exact: {cost_text(cost)}",
            )


def _frame_trace(axes: Axes, unit: str) -> None:
    """Set up the axes: logarithmic seconds, in plain digits."""
    axes.set_xscale("log")
    axes.margins(x=0.04)
    axes.set_xlabel("time (s), weighing the graph included")
    axes.set_ylabel(f"best cost so far{unit}")
    first, last = axes.get_xlim()
    few = last < 30.0 * first  # less than two powers of ten would leave one label or none
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda seconds, _: f"{seconds:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(color="0.9", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)

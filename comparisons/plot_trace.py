"""The picture of how soon anytime solvers find good paths: median and band over time, beside what the others found."""

import math
import statistics
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from cgla_graph.comparisons.curves import Curve, median_curve
from cgla_graph.comparisons.plot_measure import Measure
from cgla_graph.comparisons.plot_page import Part, add_legend, arrange, style
from cgla_graph.comparisons.plot_solvers import DASHES, Entry, entries_of
from cgla_graph.comparisons.plot_text import cost_text, heading, plain
from cgla_graph.comparisons.rows import by_solver, scenario_bound
from cgla_graph.comparisons.runner import Run
from cgla_graph.scenario import Scenario

_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_SAME_COST = 1e-6  # costs closer than this, relatively, are one
_BAND, _BANDS = 0.2, 0.6  # opacity of a band, and of all of them where they lie over each other


def trace_figure(scenario: Scenario, runs: Sequence[Run]) -> Figure | None:
    """
    Draw the best cost of anytime solvers against time, beside what the other solvers found.

    Parameters
    ----------
    scenario
        The map.
    runs
        Its runs. Of an anytime solver the line is the median over its seeds, the band its 95 % interval, or from the
        least to the greatest where the runs are too few for one; runs without a path so far are infinitely costly, so
        that a band may reach up to the upper edge. Dashed lines are the costs of exact solvers, markers the results of
        all solvers without a trace, at the time that they needed (weighing the graph included).

    Returns
    -------
    figure
        Gaps over the scenario's lower bound, or costs where there is none. What is far above the first ones of anytime
        solvers is marked at the upper edge. None if no run found a path and has a trace.

    Examples
    --------
    >>> from cgla_graph.scenario import load_scenario
    >>> trace_figure(load_scenario("paper"), []) is None
    True
    """
    groups = by_solver(runs)
    curves = {
        solver: median_curve([run.solution for run in group])
        for solver, group in groups.items()
        if any(run.solution.trace and run.solution.status.is_path for run in group)
    }
    if not curves:
        return None
    entries = entries_of(runs)
    others = [run for run in runs if run.solver not in curves and run.solution.status.is_path]
    measure = Measure.of(scenario, scenario_bound(runs))
    edges = [edge for curve in curves.values() for edge in (curve.low, curve.median, curve.high)]
    heights = [measure.heights(edge[np.isfinite(edge)]) for edge in edges if np.isfinite(edge).any()]
    low, high = measure.limits(heights, measure.heights([run.solution.cost for run in others]).tolist())
    with style():
        figure = Figure()
        axes = figure.add_subplot()
        axes.set_ylim(low, high)
        drawn = _draw_curves(axes, entries, curves, measure) | _draw_results(axes, entries, others, measure)
        shown = [entry for entry in entries if entry.label in drawn]
        handles = [drawn[entry.label] for entry in shown]
        labels = [_label(entry, groups[entry.label], measure, high) for entry in shown]
        for handle, label in [*_explain_bands(list(curves.values())), *_draw_exact(axes, others, measure)]:
            handles.append(handle)
            labels.append(label)
        handles += _draw_unknown(axes, runs, measure)
        labels += ["the optimum is in here"] * measure.is_gap
        _frame_time(axes)
        measure.frame(axes)
        legend = add_legend(figure, handles, labels, title=f"cost{measure.unit}", columns=math.ceil(len(labels) / 17))
        arrange(figure, heading(scenario), [Part.of(figure, axes, (4.6, 3.2)), Part.of(figure, legend)])
    return figure


def _label(entry: Entry, runs: Sequence[Run], measure: Measure, high: float) -> str:
    """Say what a solver found, of several runs the median, and whether that is off the scale."""
    costs = [run.solution.cost if run.solution.status.is_path else math.inf for run in runs]
    cost = statistics.median_low(costs)
    found = cost_text(cost * measure.scale) if cost < math.inf else "none"
    seeds = f" (median of {entry.n_runs})" if entry.n_runs > 1 else ""
    if entry.n_found < entry.n_runs:
        seeds = f" (median of {entry.n_runs}, {entry.n_found} found)"
    off = ", above" if high < measure.heights(cost) < math.inf else ""
    return f"{plain(entry.label, 36)}: {found}{seeds}{off}"


def _draw_curves(axes: Axes, entries: Sequence[Entry], curves: dict[str, Curve], measure: Measure) -> dict[str, Artist]:
    """Draw median and band of each anytime solver; return a handle for each."""
    by_label = {entry.label: entry for entry in entries}
    # a logarithmic axis has no 0
    earliest = min((t for curve in curves.values() for t in curve.seconds.tolist() if t > 0.0), default=1e-3)
    opacity = min(_BAND, _BANDS / len(curves))
    drawn: dict[str, Artist] = {}
    for number, (solver, curve) in enumerate(curves.items()):
        colour = by_label[solver].colour
        seconds = np.maximum(curve.seconds, earliest)
        median = measure.heights(curve.median)
        if curve.n_runs > 1:
            low, high = (np.clip(measure.heights(edge), *axes.get_ylim()) for edge in (curve.low, curve.high))
            axes.fill_between(seconds, low, high, step="post", color=colour, alpha=opacity, linewidth=0.0, zorder=2)
        (line,) = axes.step(
            seconds,
            np.where(np.isfinite(median), median, np.nan),
            where="post",
            color=colour,
            linestyle=DASHES[number % len(DASHES)],
            linewidth=1.3,
            zorder=3,
        )
        drawn[solver] = line
    return drawn


def _explain_bands(curves: Sequence[Curve]) -> Iterator[tuple[Artist, str]]:
    """Yield handles and labels that say what bands are."""
    kinds = {curve.is_interval: curve for curve in curves if curve.n_runs > 1}
    texts = {True: "band: 95 % interval of the median", False: "band: least to greatest, as runs are few"}
    for is_interval in kinds:
        yield Patch(color="0.4", alpha=_BAND, linewidth=0.0), texts[is_interval]


def _draw_results(axes: Axes, entries: Sequence[Entry], runs: Sequence[Run], measure: Measure) -> dict[str, Artist]:
    """Draw a marker for each result without a trace, on the upper edge where it is above; return handles."""
    by_label = {entry.label: entry for entry in entries}
    drawn: dict[str, Artist] = {}
    for run in runs:
        entry, solution = by_label[run.solver], run.solution
        (mark,) = axes.plot(
            max(solution.total_seconds, 1e-6),
            min(float(measure.heights(solution.cost)), axes.get_ylim()[1]),
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


def _draw_exact(axes: Axes, runs: Sequence[Run], measure: Measure) -> Iterator[tuple[Artist, str]]:
    """Draw a line for each cost of exact solvers (they mostly agree); yield handles and labels of the legend."""
    costs: list[float] = []
    for run in runs:
        cost = run.solution.cost
        if run.exact and not any(math.isclose(cost, other, rel_tol=_SAME_COST) for other in costs):
            costs.append(cost)
    for cost in costs:
        height = float(measure.heights(cost))
        if height <= axes.get_ylim()[1]:
            yield (
                axes.axhline(height, color="0.35", linestyle=(0, (5, 3)), linewidth=0.8, zorder=2),
                f"exact: {cost_text(cost * measure.scale)}",
            )


def _draw_unknown(axes: Axes, runs: Sequence[Run], measure: Measure) -> list[Artist]:
    """Shade the gaps between the lower bound and the best path known, where the optimum must be; return a handle."""
    if not measure.is_gap:
        return []
    known = [run.solution.cost for run in runs if run.solution.status.is_path]
    known += [run.certificate.upper_bound for run in runs if run.certificate is not None]
    low, _ = axes.get_ylim()
    best = float(measure.heights(min(known)))
    return [
        axes.axhspan(low, max(best, low), facecolor="0.96", edgecolor="0.75", hatch="////", linewidth=0.0, zorder=0)
    ]


def _frame_time(axes: Axes) -> None:
    """Set up the axis of time: logarithmic seconds, in plain digits."""
    axes.set_xscale("log")
    axes.margins(x=0.04)
    axes.set_xlabel("time (s), weighing the graph included")
    first, last = axes.get_xlim()
    few = last < 30.0 * first  # less than two powers of ten would leave one label or none
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda seconds, _: f"{seconds:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(color="0.9", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)

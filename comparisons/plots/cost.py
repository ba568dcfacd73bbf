"""The picture of how soon anytime solvers find good paths: median and band over time, beside what the others found."""

import math
import statistics
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import ArrayLike

from cgla_graph._text import figure
from cgla_graph._types import FloatArray
from cgla_graph._validate import number_array
from cgla_graph.comparisons.plots.runs import paths_of, weight_of_risk
from cgla_graph.comparisons.statistics.intervals import Curve, median_curve, path_cost
from cgla_graph.comparisons.study.rows import by_solver, scenario_bound
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.plots.looks import GREY, LabelledPath, others_label
from cgla_graph.plots.page import Key, Part, add_legend, arrange, heading, style
from cgla_graph.plots.scene import cost_unit, unit_scale

#: Gaps below this, in percent, are drawn on the lower edge: a logarithmic axis has no 0.
LEAST_GAP = 0.01
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_SAME_COST = 1e-6  # costs closer than this, relatively, are one
_BAND, _BANDS = 0.2, 0.6  # opacity of a band, and of all of them where they lie over each other
_WIDTH, _THIN = 1.4, 0.7  # points: lines in colour, and all others
_SIZE, _SMALL = 7.0, 4.5  # points: markers in the same way


@dataclass(frozen=True)
class Measure:
    """
    How high a cost is drawn.

    Attributes
    ----------
    bound
        The lower bound that gaps are relative to, map units; anything but a positive number shows costs instead.
    scale
        What costs are multiplied with to be shown.
    unit
        That of costs, to follow a word.

    Examples
    --------
    >>> Measure(2.0, 1.0, "").heights([2.1, 4.0])
    array([  5., 100.])
    >>> Measure(math.nan, 1e-3, " (km)").heights([2000.0])
    array([2.])
    """

    bound: float
    scale: float
    unit: str

    @classmethod
    def of(cls, problem: Problem | GraphProblem, bound: float) -> "Measure":
        """Choose it for a map or a graph."""
        if isinstance(problem, GraphProblem):
            return cls(bound, 1.0, "")
        return cls(bound, unit_scale(problem), cost_unit(problem))

    @property
    def is_gap(self) -> bool:
        """Whether gaps are shown, in percent."""
        return 0.0 < self.bound < math.inf

    def heights(self, costs: ArrayLike) -> FloatArray:
        """Return how high costs of any shape are drawn, in the unit of the axis; infinite ones stay infinite."""
        values = number_array("costs", costs)
        if not self.is_gap:
            return values * self.scale
        return np.maximum(100.0 * (values / self.bound - 1.0), LEAST_GAP)

    def limits(self, curves: Iterable[FloatArray], others: Sequence[float]) -> tuple[float, float]:
        """
        Choose the least and the greatest height to show: from the best to where the anytime solvers begin.

        A first cost far above the next one (or above other solvers') would press everything else flat.

        Parameters
        ----------
        curves
            Finite heights over time of each anytime solver, shape ``(m,)`` with ``m >= 1``.
        others
            Heights of the other results.

        Examples
        --------
        >>> low, high = Measure(math.nan, 1.0, "").limits([np.array([1000.0, 2.0, 1.0])], [1.5, 50.0])
        >>> round(low, 6), round(high, 6)
        (0.94, 2.12)
        """
        curves = list(curves)
        best = min([*others, *(float(curve.min()) for curve in curves)])
        # a logarithmic axis has more room
        wide = 30.0 if self.is_gap else 10.0
        begins = []
        for curve in curves:
            first, second = curve[0] - best, curve[min(1, len(curve) - 1)] - best
            begins.append(second if first > wide * second > 0.0 else first)
        usual = statistics.median_low(begins)
        reach = max(begin for begin in begins if begin <= (wide if self.is_gap else 4.0) * usual)
        near = [height - best for height in others if height - best <= (4.0 if self.is_gap else 1.5) * reach]
        reach = max([reach, *near])
        if self.is_gap:
            return float(best / 1.6), float(max(1.6 * (best + reach), 10.0 * best))
        reach = reach or 0.01 * abs(best) or 1.0
        return float(best - 0.06 * reach), float(best + 1.12 * reach)

    def frame(self, axes: Axes) -> None:
        """Label the upward axis; limits are set before."""
        if not self.is_gap:
            axes.set_ylabel(f"best cost so far{self.unit}")
            return
        axes.set_ylabel(f"best cost so far: gap over {figure(self.bound * self.scale, 5)}{self.unit}")
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)))
        axes.yaxis.set_major_formatter(FuncFormatter(_gap_label))
        axes.yaxis.set_minor_formatter(NullFormatter())


def _gap_label(percent: float, _: object = None) -> str:
    """
    Write a gap beside its axis; the least one stands for all below it as well.

    Examples
    --------
    >>> _gap_label(5.0), _gap_label(LEAST_GAP)
    ('5 %', 'at most 0.01 %')
    """
    return f"{'at most ' if percent <= 1.001 * LEAST_GAP else ''}{percent:g} %"


def trace_figure(runs: Sequence[Run], named: Collection[str] = ()) -> Figure | None:
    """
    Draw the best cost of anytime solvers against time, beside what the other solvers found.

    Parameters
    ----------
    runs
        Those of one scenario. Of an anytime solver the line is the median over its seeds, the band its 95 % interval,
        or from the least to the greatest where the runs are too few for one; runs without a path so far are infinitely
        costly, so that a band may reach up to the upper edge. Dashed lines are the costs of exact solvers, markers the
        median runs of all solvers without a trace, at the time that they needed (weighing the graph included). Of many
        solvers the best are drawn in colour, the others in grey and without bands (see `paths_of`).
    named
        Labels of solvers that are drawn in colour in any case.

    Returns
    -------
    figure
        Gaps over the scenario's lower bound, or costs where there is none. Costs far above the first ones of anytime
        solvers are marked at the upper edge. None if no run found a path and has a trace.

    Examples
    --------
    >>> trace_figure([]) is None
    True
    """
    groups = by_solver(runs)
    curves = {
        solver: median_curve([run.solution for run in group])
        for solver, group in groups.items()
        if any(run.solution.trace and run.solution.status.has_path for run in group)
    }
    if not curves:
        return None
    paths = paths_of(runs, named)
    scenario = runs[0].scenario
    results = [one for one in paths if one.label not in curves and one.solution.status.has_path]
    found = [one.solution.cost for one in results]
    measure = Measure.of(scenario.problem, scenario_bound(runs))
    edges = [edge for curve in curves.values() for edge in (curve.low, curve.median, curve.high)]
    heights = [measure.heights(edge[np.isfinite(edge)]) for edge in edges if np.isfinite(edge).any()]
    low, high = measure.limits(heights, measure.heights(found).tolist())
    with style():
        page = Figure()
        axes = page.add_subplot()
        axes.set_ylim(low, high)
        drawn = _draw_curves(axes, paths, curves, measure)
        drawn |= {one.label: _draw_result(axes, one, measure) for one in results}
        rows = [
            *_explain_solvers([one for one in paths if one.label in drawn], drawn, measure, high),
            *_explain_bands([curves[one.label] for one in paths if one.stands_out and one.label in curves]),
            *_draw_exact(axes, [one for one in results if any(run.exact for run in groups[one.label])], measure),
            *_draw_unknown(axes, runs, measure),
        ]
        _frame_time(axes)
        measure.frame(axes)
        legend = add_legend(page, rows, title=f"cost{measure.unit}", columns=math.ceil(len(rows) / 17))
        head = heading(scenario.name, scenario.title, weight_of_risk(scenario.problem))
        arrange(page, head, [[Part.of(page, axes, (4.6, 3.2)), Part.of(page, legend)]])
    return page


def _explain_solvers(
    paths: Sequence[LabelledPath], drawn: Mapping[str, Artist], measure: Measure, high: float
) -> Iterator[Key]:
    """Yield handles and labels of those that stand out, and one for all others; say which ones are off the scale."""
    for one in paths:
        if one.stands_out:
            off = ", above" if high < measure.heights(path_cost(one.solution)) < math.inf else ""
            yield drawn[one.label], f"{one.row(measure.scale)}{off}"
    if others := [one for one in paths if not one.stands_out]:
        yield Line2D([], [], color=GREY, linewidth=_THIN, marker="o", markersize=_SMALL), others_label(len(others))


def _draw_curves(
    axes: Axes, paths: Sequence[LabelledPath], curves: Mapping[str, Curve], measure: Measure
) -> dict[str, Artist]:
    """Draw the median of each anytime solver, the best on top, with a band if it stands out; return the lines."""
    # a logarithmic axis has no 0
    earliest = min((t for curve in curves.values() for t in curve.seconds.tolist() if t > 0.0), default=1e-3)
    shown = [one for one in paths if one.label in curves]
    opacity = min(_BAND, _BANDS / max(1, sum(one.stands_out for one in shown)))
    drawn: dict[str, Artist] = {}
    for depth, one in enumerate(shown):
        curve = curves[one.label]
        seconds = np.maximum(curve.seconds, earliest)
        median = measure.heights(curve.median)
        if one.stands_out and curve.n_runs > 1:
            low, high = (np.clip(measure.heights(edge), *axes.get_ylim()) for edge in (curve.low, curve.high))
            band: dict[str, Any] = {"color": one.colour, "alpha": opacity, "linewidth": 0.0}
            axes.fill_between(seconds, low, high, step="post", zorder=2.0, **band)
        (drawn[one.label],) = axes.step(
            seconds,
            np.where(np.isfinite(median), median, np.nan),
            where="post",
            color=one.colour,
            linestyle=one.dashes,
            linewidth=_WIDTH if one.stands_out else _THIN,
            zorder=(3.5 if one.stands_out else 2.5) - 0.01 * depth,
        )
    return drawn


def _explain_bands(curves: Sequence[Curve]) -> Iterator[Key]:
    """Yield handles and labels that say what bands are."""
    kinds = {curve.is_interval: curve for curve in curves if curve.n_runs > 1}
    texts = {True: "band: 95 % interval of the median", False: "band: least to greatest, as runs are few"}
    for is_interval in kinds:
        yield Patch(color="0.4", alpha=_BAND, linewidth=0.0), texts[is_interval]


def _draw_result(axes: Axes, one: LabelledPath, measure: Measure) -> Artist:
    """Draw a marker for a result without a trace, on the upper edge where it is above; return it."""
    solution = one.solution
    (mark,) = axes.plot(
        max(solution.total_seconds, 1e-6),
        min(float(measure.heights(solution.cost)), axes.get_ylim()[1]),
        linestyle="none",
        color=one.colour,
        marker="o" if one.look is None else _MARKERS[one.look % len(_MARKERS)],
        # equal costs in equal times: the first stands out behind the last
        markersize=_SMALL if one.look is None else max(_SIZE - 1.0, _SIZE + 2.0 - 0.5 * one.look),
        markeredgecolor="white",
        markeredgewidth=0.6,
        clip_on=False,
        zorder=4.0 if one.stands_out else 2.8,
    )
    return mark


def _draw_exact(axes: Axes, paths: Sequence[LabelledPath], measure: Measure) -> Iterator[Key]:
    """Draw a line for each cost of exact solvers (they mostly agree); yield handles and labels of the legend."""
    costs: list[float] = []
    for one in paths:
        cost = one.solution.cost
        if not any(math.isclose(cost, other, rel_tol=_SAME_COST) for other in costs):
            costs.append(cost)
    for cost in costs:
        height = float(measure.heights(cost))
        if height <= axes.get_ylim()[1]:
            yield (
                axes.axhline(height, color="0.35", linestyle=(0, (5, 3)), linewidth=0.8, zorder=2),
                f"exact: {figure(cost * measure.scale, 5)}",
            )


def _draw_unknown(axes: Axes, runs: Sequence[Run], measure: Measure) -> Iterator[Key]:
    """Shade the gaps between the lower bound and the best path known, where the optimum must be; yield its row."""
    if not measure.is_gap:
        return
    known = [run.solution.cost for run in runs if run.solution.status.has_path]
    known += [run.certificate.upper_bound for run in runs if run.certificate is not None]
    low, _ = axes.get_ylim()
    best = float(measure.heights(min(known)))
    look: dict[str, Any] = {"facecolor": "0.96", "edgecolor": "0.75", "hatch": "////", "linewidth": 0.0}
    yield axes.axhspan(low, max(best, low), zorder=0, **look), "the optimum is in here"


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

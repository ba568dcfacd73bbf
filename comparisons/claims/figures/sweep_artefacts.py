"""What the paper does not have: every planner as a curve beside CGLA's, and our planners' numbers as they are."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from cgla_graph.comparisons.claims.artefact import Comparison, Picture, artefact
from cgla_graph.comparisons.claims.claim import Entry, Table
from cgla_graph.comparisons.claims.contrasts import finite
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.figures.figure_page import SELECTED, Key, finish, page, picture, write_beside
from cgla_graph.comparisons.claims.inference import Proportion, median, proportion
from cgla_graph.comparisons.claims.paper.printed_values import WORKING_SCALE
from cgla_graph.comparisons.claims.paper.sweeps import (
    CGLA,
    CURVES,
    FEWEST,
    SHOWN,
    Curve,
    Point,
    Sweep,
    is_dominated,
    on_paper_map,
    said,
)
from cgla_graph.comparisons.statistics.intervals import Estimate
from cgla_graph.plots.scene import Look, colour_of, line_key

#: What has to be said of every comparison of planners that do not always arrive.
_ARRIVALS = (
    "A planner is compared on the maps on which it and CGLA arrive: one that seldom arrives is seen on the easier ones."
)
_STYLE = "Planners called -style are in the style of the originals, which are not public."
#: Inches: a panel.
_PANEL = (2.6, 2.2)
#: Logarithms of length and risk: values of points that are nearer to each other would not be read.
_APART = (0.12, 0.22)
#: A point with fewer arrivals than this is drawn hollow.
_MOSTLY = 0.95


@artefact("Fig. A1", "risk against length: every planner over its knob, CGLA over K beside it", experiments=("sweeps",))
def _fig_a1(evidence: Evidence) -> Picture:
    sweep = Sweep(evidence)
    ours = sweep.points(CGLA)
    found = {name: [(each, sweep.points(each)) for each in curves] for name, curves in CURVES.items()}
    drawn = [ours, *(points for curves in found.values() for _, points in curves)]
    with page() as figure:
        panels = []
        for name, curves in found.items():
            axes = figure.add_subplot()
            _draw(axes, ours, 0, named=("0", "10", "200"))
            for number, (_, points) in enumerate(curves, 1):
                _draw(axes, points, number)
            _frame(axes, name, [each for each, _ in curves], drawn)
            panels.append(axes)
        keys: list[Key] = [
            (line_key(**_look(0)), "CGLA over K (0, 1, 2, 5, 10, 20, 50, 100, 200)"),
            (line_key(**_look(1)), "the planner over its knob (not all values are written)"),
            (
                line_key(**_look(1, hollow=True)),
                f"arrives on fewer than {_MOSTLY:.0%} of the maps: the share stands there",
            ),
        ]
        rows = [[(axes, _PANEL) for axes in panels[first : first + 3]] for first in range(0, len(panels), 3)]
        finish(figure, ("Fig. A1", "Risk against length on the same random maps"), rows, keys, columns=2)
    dominated = [each.title for curves in found.values() for each, points in curves if is_dominated(points)]
    return picture(
        figure,
        f"Flown with limited sight on the same {len(sweep.samples.maps)} random maps, which were not selected; curves "
        "and knobs are ours, the paper has none. Risk sum and length are over those of CGLA with K = 10, which is "
        f"where the thin lines cross (geometric means). {_ARRIVALS} Wholly above CGLA's curve at the same length, on "
        f"the same maps (95 %, see Table A1): {'; '.join(dominated) or 'none'}. {_STYLE}",
    )


def _draw(axes: Axes, points: Sequence[Point], number: int, named: Sequence[str] | None = None) -> None:
    """Draw a curve, with values at its points: of those that are named, or all."""
    known = [one for one in points if one.maps]
    xy = np.array([(one.length.median, one.risk.median) for one in known]).reshape(-1, 2)
    axes.plot(*xy.T, zorder=3.0 + number, **_look(number) | {"marker": "none"})
    written = np.empty((0, 2))
    for one, (x, y) in zip(known, xy.tolist(), strict=True):
        seldom = one.arrives.rate < _MOSTLY
        axes.plot(x, y, zorder=4.0 + number, **_look(number, hollow=seldom))
        # words would cover each other: values in between are left out
        apart = np.abs(np.log(np.array([x, y]) / written)) > _APART
        if one.value in named if named is not None else apart.any(axis=1).all():
            written = np.vstack([written, [x, y]])
            words = f"{one.value} ({one.arrives.rate:.0%})" if seldom else one.value
            # CGLA's to the left below, those of the planner to the right above, and of its second curve below
            shift, side = [((-4.0, -3.0), "right"), ((4.0, 3.0), "left"), ((4.0, -5.0), "left")][number]
            write_beside(axes, words, (x, y), shift, fontsize=6.5, color=colour_of(number), ha=side)


def _look(number: int, *, hollow: bool = False) -> Look:
    return {
        "color": colour_of(number),
        "linewidth": 2.0 if number == 0 else 1.3,
        "marker": "osD"[number],
        "markersize": 4.0,
        "markerfacecolor": "white" if hollow else colour_of(number),
    }


def _frame(axes: Axes, name: str, curves: Sequence[Curve], drawn: Sequence[Sequence[Point]]) -> None:
    """Label a panel; all have the same scales."""
    knobs = [each.title.removeprefix(name).removeprefix(", ") for each in curves]
    axes.set_title(f"{name} {knobs[0].strip()}" if len(knobs) == 1 else name, fontsize=8.5, loc="left")
    known = [one for points in drawn for one in points if one.maps]
    lengths, risks = ([getattr(one, of).median for one in known] for of in ("length", "risk"))
    axes.set(xscale="log", yscale="log", xlabel="length, CGLA with K = 10: 1", ylabel="risk sum")
    if known:
        axes.set(xlim=(0.95 * min(lengths), 1.3 * max(lengths)), ylim=(0.6 * min(risks), 1.9 * max(risks)))
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(plain)
        axis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(FixedLocator([0.8, 0.9, 1.0, 1.1, 1.2, 1.4, 1.6, 2.0, 3.0, 4.0]))
    axes.set_axisbelow(True)
    axes.grid(color="0.92", linewidth=0.5)
    axes.axhline(1.0, color="0.6", linewidth=0.6)
    axes.axvline(1.0, color="0.6", linewidth=0.6)
    if len(knobs) > 1:
        handles = [line_key(**_look(number)) for number in range(1, len(knobs) + 1)]
        axes.legend(handles, [one.strip() for one in knobs], fontsize=6.5, frameon=False, loc="upper right")


@artefact("Table A1", "every planner over its knob, held against CGLA's curve", experiments=("sweeps",))
def _table_a1(evidence: Evidence) -> Comparison:
    sweep = Sweep(evidence)
    tables, told = [], []
    for each in [CGLA, *(one for curves in CURVES.values() for one in curves)]:
        points = sweep.points(each)
        is_cgla = each is CGLA
        if not is_cgla:
            told.append(f"{each.title}: {said(points)}")
        tables.append(_of_curve(each, points, is_cgla=is_cgla))
    return Comparison(
        f"Ours, flown with limited sight on {len(sweep.samples.maps)} random maps; the paper has no such table. "
        "Length, risk sum and exposure (the length where F > 0.1, map units) are held against CGLA with K = 10: ratios "
        "of geometric means and a difference of means, with 95 % intervals (bootstrap over maps). Risk at the same "
        f"length is held against CGLA's curve over K, on the same maps. {_ARRIVALS} Shares of arrivals have "
        f"Clopper-Pearson intervals. {_STYLE} Where the curves lie: {'; '.join(told)}.",
        tables=tuple(tables),
    )


def _of_curve(each: Curve, points: Sequence[Point], *, is_cgla: bool) -> Table:
    sides = {1: "above", 0: "not told apart", -1: "below"}
    heads = ("value", "arrives", "maps", "length", "risk sum", "exposure", "risk at the same length", "CGLA's curve")
    rows: list[Sequence[Entry]] = []
    for one in points:
        value = f"{one.value} (default)" if one.value == each.default else one.value
        row = [value, _share(one.arrives), one.maps, *(_written(of) for of in (one.length, one.risk))]
        row.append(_written(one.exposure, "+.3f"))
        side = sides[one.side] if one.maps >= FEWEST else "too few maps"
        rows.append(row if is_cgla else [*row, _written(one.gap), side])
    return Table(each.title, heads[:6] if is_cgla else heads, rows)


def _share(one: Proportion) -> str:
    return f"{one.rate:.1%} ({one.interval.low:.1%} to {one.interval.high:.1%})"


def _written(one: Estimate, form: str = ".3f") -> str | None:
    """Write an estimate with its interval, as far as there is one."""
    if not np.isfinite(one.median):
        return None
    words = format(one.median, form)
    return f"{words} ({one.low:{form}} to {one.high:{form}})" if np.isfinite([one.low, one.high]).all() else words


@artefact("Table A2", "our planners in the paper's units", experiments=("sweeps",))
def _table_a2(evidence: Evidence) -> Comparison:
    sweep = Sweep(evidence)
    n = len(sweep.samples.maps)
    return Comparison(
        "All of it is ours. Lengths are in sides of the map, and at "
        f"{WORKING_SCALE:g} a side, a working reading of the paper's unit; the risk sum is F added up every 0.02 (E5); "
        "exposure is the length where F > 0.1. Planners that heed K have K = 10, but where theirs is said. "
        f"The map paper: {SELECTED} On {n} random maps, not selected, medians are over the maps on which a planner "
        f"arrives: of one that seldom does, over the easier ones. {_STYLE}",
        tables=(on_paper_map(SHOWN), *(_on_random_maps(sweep, mode) for mode in ("online", "offline"))),
    )


def _on_random_maps(sweep: Sweep, mode: str) -> Table:
    rows = []
    for one in SHOWN:
        names = ("length", "risk_sum", "seconds", "exposure") if mode == "online" else ("length", "risk_sum", "seconds")
        length, risk, seconds, *exposure = (median(sweep.column(name, one, mode=mode)) for name in names)
        share = _share(proportion(sweep.column("arrived", one, mode=mode)))
        rows.append(
            [f"ours: {one.label}", share, *finite(length, length * WORKING_SCALE, risk, 1e3 * seconds, *exposure)]
        )
    how = "flown with limited sight" if mode == "online" else "planned with the whole map known"
    heads = ["whose", "arrives", "length", f"length x {WORKING_SCALE:g}", "risk sum", "ms"]
    if mode == "online":
        heads.append("exposure")
    note = "ms: of the computer that made this report, for a whole flight" if mode == "online" else "ms: for the plan"
    return Table(f"Ours, on {len(sweep.samples.maps)} random maps, {how}: medians", heads, rows, note)

"""The paper's figures of the model and of a single UAV, remade: Figs 1, 2, 3, 5, 6 and 11."""

from collections.abc import Sequence

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from cgla_graph._types import Point
from cgla_graph.comparisons.claims.artefact import Content, artefact
from cgla_graph.comparisons.claims.claim import require
from cgla_graph.comparisons.claims.figures.figure_page import (
    NARROW,
    SELECTED,
    WIDE,
    Key,
    add_map,
    draw_end,
    draw_route,
    finish,
    page,
    picture,
    write_beside,
)
from cgla_graph.comparisons.claims.panel.flights import paper_lattice
from cgla_graph.comparisons.claims.panel.resolution import SIZES, farthest_pair
from cgla_graph.comparisons.claims.panel.settings import START
from cgla_graph.comparisons.claims.paper.model_claims import HIGH, LOW, weights_from_origin
from cgla_graph.comparisons.claims.paper.routes import (
    GOAL,
    RADIUS,
    Route,
    Routes,
    both,
    escape,
    flown,
    for_weights,
    paper_field,
)
from cgla_graph.model.risk import Reading, RiskField, Threat
from cgla_graph.plots.scene import (
    NEAR_COLOUR,
    OUTLINE_SPREADS,
    TIMED_LOOK,
    Look,
    colour_of,
    draw_ring,
    line_key,
    patch_key,
    risk_colours,
)

#: What Fig. 1 shows: one threat, and several of which two overlap.
ONE = (Threat(0.5, 0.5, 0.1),)
SEVERAL = (Threat(0.25, 0.5, 0.08), Threat(0.45, 0.5, 0.1), Threat(0.75, 0.35, 0.06), Threat(0.7, 0.75, 0.08))
#: The sigma of Fig. 3 that is drawn of those that are reckoned, and how readings of Eq. 1 are called.
SHOWN_SIGMA = 0.1
READINGS: dict[Reading, str] = {
    "membership": "peak 1 (our default)",
    "sigma2": "printed peak, usual exponent",
    "literal": "Eq. 1 as printed",
}
#: The regions that K = 10 is said to pass (Section 5.1), map units.
REGIONS = ((0.5, 0.5), (0.8, 0.8))
_CROSS: Look = {"linestyle": "none", "marker": "P", "markersize": 8.0}
_CROSS |= {"markerfacecolor": NEAR_COLOUR, "markeredgecolor": "white"}
_AT_HALF: Look = {"color": "0.2", "linewidth": 0.9, "linestyle": (0, (4, 3))}
_ALONE: Look = {"color": "0.55", "linewidth": 0.9, "linestyle": (0, (2, 1.5))}
_TOGETHER: Look = {"color": colour_of(0), "linewidth": 1.8}
_SUM: Look = {"color": colour_of(1), "linewidth": 1.2, "linestyle": (0, (5, 2))}


@artefact("Fig. 1", "the risk of one threat and of several")
def _fig_1() -> Content:
    with page() as figure:
        maps = [
            add_map(figure, RiskField(ONE), "one threat"),
            add_map(figure, RiskField(SEVERAL), "several threats", bar=True),
        ]
        for axes in maps:
            axes.axhline(0.5, zorder=2.6, **_AT_HALF)
        cut = figure.add_subplot()
        x = np.linspace(0.0, 1.0, 401)
        line = np.column_stack([x, np.full_like(x, 0.5)])
        alone = np.array([RiskField([threat]).density(line) for threat in SEVERAL])
        both = RiskField(SEVERAL).density(line)
        cut.plot(x, alone.T, **_ALONE)
        cut.plot(x, alone.sum(axis=0), **_SUM)
        cut.plot(x, both, **_TOGETHER)
        _frame(cut, "x", "along y = 0.5", xlim=(0.0, 1.0), ylim=(0.0, 1.3))
        names = ("y = 0.5", "each threat, Eq. 1", "together, Eq. 2", "their sum")
        looks = (_AT_HALF, _ALONE, _TOGETHER, _SUM)
        keys: list[Key] = [(line_key(**look), name) for look, name in zip(looks, names, strict=True)]
        rows = [[(axes, (NARROW, NARROW)) for axes in maps], [(cut, (2 * NARROW + 0.75, 1.5))]]
        finish(figure, ("Fig. 1", "The risk of one threat, and of several together"), rows, keys, columns=4)
    return picture(
        figure,
        "One threat (spread 0.1) and four; places and spreads are ours, as the paper prints none. Several threats "
        f"together (Eq. 2) stay a probability: at most {both.max():.3f} along y = 0.5, where their sum reaches "
        f"{alone.sum(axis=0).max():.3f}. Threats have peak 1; with the factor that Eq. 1 prints, a sigma below 0.399 "
        "gives a peak above 1.",
    )


@artefact("Fig. 2", "a straight segment and eight directions")
def _fig_2() -> Content:
    eight = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [3.0, 1.0], [4.0, 2.0], [5.0, 2.0]])
    ends = eight[[0, -1]]
    straight, octile = (Route(path, 0.0).length for path in (ends, eight))
    with page() as figure:
        axes = figure.add_subplot()
        points = np.mgrid[0:6, 0:3].reshape(2, -1)
        axes.plot(*points, linestyle="none", marker="o", markersize=3.5, color="0.6")
        keys: list[Key] = [
            (draw_route(axes, eight, 0, 2), f"eight directions: {octile:.4f} cells"),
            (draw_route(axes, ends, 1, 2), f"straight: {straight:.4f} cells"),
        ]
        axes.plot(*eight[1:-1].T, linestyle="none", marker="o", markersize=5.0, color=colour_of(0), zorder=4.0)
        for x, y in ends.tolist():
            draw_end(axes, (x, y))
        for name, (x, y) in zip("acdefb", eight.tolist(), strict=True):
            write_beside(axes, name, (x, y), (0.0, 10.0 if name in "adf" else -10.0), fontstyle="italic", fontsize=9.5)
        axes.set(xticks=range(6), yticks=range(3))
        _frame(axes, "cells", "cells", xlim=(-0.5, 5.5), ylim=(-0.5, 2.5), aspect="equal")
        finish(figure, ("Fig. 2", "A straight segment and eight directions"), [[(axes, (6.0, 3.0))]], keys, columns=2)
    return picture(
        figure,
        f"From a to b, 5 cells east and 2 north: {straight:.4f} cells straight, {octile:.4f} in eight directions, "
        f"{octile / straight - 1.0:.2%} more. The most that eight directions can add without risk is "
        f"{1.0 / np.cos(np.pi / 8.0) - 1.0:.2%} (1 / cos(pi / 8)). The comparison is the paper's, the numbers of cells "
        "are ours.",
    )


@artefact("Fig. 3", "weights of segments for K = 10 and 200")
def _fig_3() -> Content:
    lattice = paper_lattice()
    half = 0.5 / lattice.shape[0]
    tables = {reading: weights_from_origin(reading, SHOWN_SIGMA) for reading in READINGS}
    with page() as figure:
        norm = LogNorm(0.05, max(float(high.max()) for _, high in tables.values()))
        rows: list[list[tuple[Axes, tuple[float, float]]]] = []
        for number, k in enumerate((LOW, HIGH)):
            rows.append([])
            for reading, words in READINGS.items():
                axes = figure.add_subplot()
                weights = tables[reading][number].reshape(lattice.shape)
                seen: Look = {"cmap": risk_colours(), "norm": norm, "origin": "lower", "extent": (half, 1.0 + half) * 2}
                image = axes.imshow(weights, **seen)
                axes.plot(0.5, 0.5, **_CROSS)
                _frame(axes, "x", "y", xlim=(0.0, 1.0 + half), ylim=(0.0, 1.0 + half), aspect="equal", grid=False)
                axes.set_title(f"K = {k:g}: {words}", fontsize=8.5, loc="left")
                rows[-1].append((axes, (NARROW - 0.2, NARROW - 0.2)))
        beside = figure.add_axes((0.0, 0.0, 0.1, 0.1))
        bar = figure.colorbar(image, cax=beside, format=FuncFormatter(lambda weight, _: f"{weight:g}"))
        bar.set_label("weight A from (0, 0), logarithmic")
        heading = ("Fig. 3", f"Weights of the segments from (0, 0), one threat at (0.5, 0.5), sigma = {SHOWN_SIGMA}")
        finish(figure, heading, rows, [(line_key(**_CROSS), "the threat")])
    doubled = {reading: float((high >= 2.0 * low).mean()) for reading, (low, high) in tables.items()}
    told = "; ".join(f"{READINGS[reading]}: {share:.0%}" for reading, share in doubled.items())
    return picture(
        figure,
        "To the 400 points of the paper's lattice (N = 20). The paper says that K = 200 weighs much more than K = 10 "
        "for each point, and prints neither sigma nor a number. At least twice as much weigh, for sigma = "
        f"{SHOWN_SIGMA}: {told}. Behind the threat the weight is up to 20 times as much; points whose segment passes "
        "it by weigh their distance with any K.",
    )


@artefact("Fig. 5", "ways for K = 10, 50 and 200")
def _fig_5() -> Content:
    field = paper_field()
    found = for_weights()
    bcv = Routes("bcv-style", None, flown(field, k=10.0, solver="bcv-style"))
    heading = ("Fig. 5", "Ways on the reconstructed map, length / risk sum")
    figure = _known_and_flown(heading, field, [*found, bcv], regions=True)
    passed = "; ".join(f"{one.label}: {_nearest(one.online)}" for one in found)
    return picture(
        figure,
        "Risk sum is F summed over positions 0.02 apart; lengths are in sides of the map. In the paper K = 10 passes "
        f"the regions (0.5, 0.5) and (0.8, 0.8), greater K avoid them; here flights come as near as {passed}. "
        "bcv-style is a planner in the style of BCV, not the original, whose text is not public; its way here, with a "
        "risk aversion of 5, is short, the paper's way of BCV is long. Start, goal, N, step and K are "
        f"the paper's, the detection radius ({RADIUS:g}) is ours. {SELECTED}",
    )


def _nearest(route: Route) -> str:
    """Say how near a route comes to the two regions."""
    line = shapely.LineString(route.path)
    return " and ".join(f"{line.distance(shapely.Point(region)):.3f}" for region in REGIONS)


@artefact("Fig. 6", "a sudden threat, K = 10 and 100")
def _fig_6() -> Content:
    found = escape()
    heading = ("Fig. 6", "The escape from a sudden threat at (0.6, 0.5), length / risk sum")
    figure = _known_and_flown(heading, found.field, found.routes, start=found.start, sudden=found.sudden.threat)
    low, high = (one.online for one in found.routes)
    require(high.length > low.length and high.risk_sum < low.risk_sum, "Fig. 6: K = 100 is not longer and safer")
    return picture(
        figure,
        f"The threat appears on tick {found.sudden.appears}. As in the paper, K = 100 flies farther than K = 10 and "
        f"with less risk; here it is {high.length / low.length - 1.0:+.0%} length and "
        f"{high.risk_sum / low.risk_sum - 1.0:+.0%} risk sum, more than Table 2 has. Threat, goal, N, step and K are "
        "the paper's; where the UAV is when the threat appears, (0.5, 0.4), the spread of the threat, the other "
        "threats (those of the map of Fig. 5 without two) and the detection radius are ours.",
    )


@artefact("Fig. 11", "lattices of N = 15, 20 and 25")
def _fig_11() -> Content:
    field = paper_field()
    found = [both(f"N = {n}", field, k=40.0, n=n) for n in SIZES]
    figure = _known_and_flown(("Fig. 11", "Ways on lattices of N x N points, K = 40, length / risk sum"), field, found)
    known = farthest_pair([one.offline.path for one in found if one.offline is not None])
    seen = farthest_pair([one.online.path for one in found])
    return picture(
        figure,
        "The paper finds nearly the same way with N = 15, 20 and 25. Here no two are farther apart than "
        f"{known:.3f} with the whole map known and {seen:.3f} flown (Frechet distance); a cell is "
        f"{1.0 / SIZES[0]:.3f} to {1.0 / SIZES[-1]:.3f}. N and K are the paper's; start and goal are nodes of each "
        f"lattice, and a step is 0.02 with each N. {SELECTED}",
    )


def _known_and_flown(
    heading: tuple[str, str],
    field: RiskField,
    found: Sequence[Routes],
    *,
    start: Point = START,
    sudden: Threat | None = None,
    regions: bool = False,
) -> Figure:
    """Draw the routes with the whole map known beside those that are flown with limited sight."""
    with page() as figure:
        panels = [
            add_map(figure, field, "planned, the whole map known"),
            add_map(figure, field, f"flown, with sight as far as {RADIUS:g}", bar=True),
        ]
        routes: list[Key] = []
        for number, one in enumerate(found):
            if one.offline is not None:
                draw_route(panels[0], one.offline.path, number, len(found))
            routes.append((draw_route(panels[1], one.online.path, number, len(found)), one.words))
        marks: list[Key] = []
        for axes in panels:
            marks = [(draw_end(axes, start), "start"), (draw_end(axes, GOAL, goal=True), "goal")]
            if sudden is not None:
                draw_ring(axes, (sudden.x, sudden.y), OUTLINE_SPREADS * sudden.spread, zorder=2.2, **TIMED_LOOK)
                marks.append((patch_key(**TIMED_LOOK), "the sudden threat"))
            if regions:
                axes.plot(*np.transpose(REGIONS), zorder=2.8, **_CROSS)
                marks.append((line_key(**_CROSS), "regions that K = 10 passes in the paper"))
        keys = routes + marks
        return finish(figure, heading, [[(axes, (WIDE, WIDE)) for axes in panels]], keys, columns=2)


def _frame(axes: Axes, x: str, y: str, *, grid: bool = True, **limits: object) -> None:
    """Label axes that are no map."""
    axes.set(xlabel=x, ylabel=y, **limits)
    axes.set_axisbelow(True)
    if grid:
        axes.grid(color="0.92", linewidth=0.5)

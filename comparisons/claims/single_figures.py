"""The paper's figures of the model and of a single UAV, remade: Figs 1, 2, 3, 5, 6 and 11."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from cgla_graph._types import FloatArray, Point
from cgla_graph.comparisons.claims.exhibit import Exhibit, Picture
from cgla_graph.comparisons.claims.figure_page import (
    NARROW,
    SELECTED,
    WIDE,
    Key,
    add_map,
    draw_end,
    draw_way,
    finish,
    nearest,
    page,
    picture,
    write_beside,
)
from cgla_graph.comparisons.claims.paper_flight import BOUNDS, GOAL, RADIUS, START, fly_alone, paper_lattice, risk_sum
from cgla_graph.comparisons.claims.proving import improper_field, require
from cgla_graph.comparisons.plot_risk import risk_colours
from cgla_graph.comparisons.plot_scene import OUTLINE_SPREADS, TIMED_LOOK, colour_of, draw_ring, line_key, patch_key
from cgla_graph.cost_model import CostModel
from cgla_graph.flight import MissionStatus
from cgla_graph.mission_file import load_mission
from cgla_graph.problem import Problem
from cgla_graph.risk import Reading, RiskField, Threat
from cgla_graph.scenario import load_scenario
from cgla_graph.solvers import get, solve
from cgla_graph.world import TimedThreat

#: What Fig. 1 shows: one threat, and several of which two overlap.
ONE = (Threat(0.5, 0.5, 0.1),)
SEVERAL = (Threat(0.25, 0.5, 0.08), Threat(0.45, 0.5, 0.1), Threat(0.75, 0.35, 0.06), Threat(0.7, 0.75, 0.08))
#: Regions that K = 10 is said to pass (Section 5.1).
REGIONS: tuple[Point, ...] = ((0.5, 0.5), (0.8, 0.8))
#: The two K of Fig. 3, and the sigma that is drawn of those that are reckoned.
LOW, HIGH = 10.0, 200.0
SIGMAS, SHOWN_SIGMA = (0.05, 0.1, 0.2), 0.1
READINGS: tuple[tuple[Reading, str], ...] = (
    ("membership", "peak 1 (our default)"),
    ("sigma2", "printed peak, usual exponent"),
    ("literal", "Eq. 1 as printed"),
)
_CROSS = {"linestyle": "none", "marker": "P", "markersize": 8.0, "markerfacecolor": "#D55E00", "markeredgecolor": "white"}


def fig_1() -> Picture:
    """Draw the risk of one threat and of several, and a cut through each."""
    with page() as figure:
        maps = [
            add_map(figure, RiskField(ONE), "one threat"),
            add_map(figure, RiskField(SEVERAL), "several threats", bar=True),
        ]
        for axes in maps:
            axes.axhline(0.5, color="0.2", linewidth=0.9, linestyle=(0, (4, 3)), zorder=2.6)
        cut = figure.add_subplot()
        x = np.linspace(0.0, 1.0, 401)
        line = np.column_stack([x, np.full_like(x, 0.5)])
        alone = np.array([RiskField([threat]).density(line) for threat in SEVERAL])
        both = RiskField(SEVERAL).density(line)
        for one in alone:
            cut.plot(x, one, color="0.55", linewidth=0.9, linestyle=(0, (2, 1.5)))
        cut.plot(x, alone.sum(axis=0), color=colour_of(1), linewidth=1.2, linestyle=(0, (5, 2)))
        cut.plot(x, both, color=colour_of(0), linewidth=1.8)
        _frame(cut, "x", "along y = 0.5", xlim=(0.0, 1.0), ylim=(0.0, 1.3))
        keys: list[Key] = [
            (line_key(color="0.2", linewidth=0.9, linestyle=(0, (4, 3))), "y = 0.5"),
            (line_key(color="0.55", linewidth=0.9, linestyle=(0, (2, 1.5))), "each threat, Eq. 1"),
            (line_key(color=colour_of(0), linewidth=1.8), "together, Eq. 2"),
            (line_key(color=colour_of(1), linewidth=1.2, linestyle=(0, (5, 2))), "their sum"),
        ]
        sizes = [(axes, (NARROW, NARROW)) for axes in maps]
        finish(figure, ("Fig. 1", "The risk of one threat, and of several together"), [sizes, [(cut, (2 * NARROW + 0.75, 1.5))]], keys, columns=4)
    return picture(
        figure,
        "One threat (spread 0.1) and four; places and spreads are ours, as the paper prints none. Several threats "
        f"together (Eq. 2) stay a probability: at most {both.max():.3f} along y = 0.5, where their sum reaches "
        f"{alone.sum(axis=0).max():.3f}. Threats have peak 1; with the factor that Eq. 1 prints, a sigma below 0.399 "
        "gives a peak above 1.",
    )


def fig_2() -> Picture:
    """Draw the straight segment beside the shortest path in eight directions."""
    eight = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [3.0, 1.0], [4.0, 2.0], [5.0, 2.0]])
    ends = eight[[0, -1]]
    straight, octile = length_of(ends), length_of(eight)
    with page() as figure:
        axes = figure.add_subplot()
        points = np.mgrid[0:6, 0:3].reshape(2, -1)
        axes.plot(*points, linestyle="none", marker="o", markersize=3.5, color="0.6")
        keys: list[Key] = [
            (draw_way(axes, eight, 0, 2), f"eight directions: {octile:.4f} cells"),
            (draw_way(axes, ends, 1, 2), f"straight: {straight:.4f} cells"),
        ]
        axes.plot(*eight[1:-1].T, linestyle="none", marker="o", markersize=5.0, color=colour_of(0), zorder=4.0)
        draw_end(axes, (0.0, 0.0))
        draw_end(axes, (5.0, 2.0))
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


def fig_3() -> Picture:
    """Draw the weights of the segments from (0, 0) to all lattice points, for two K and three readings of Eq. 1."""
    lattice = paper_lattice()
    half = 0.5 / lattice.shape[0]
    tables = {reading: weights_from_origin(reading, SHOWN_SIGMA) for reading, _ in READINGS}
    with page() as figure:
        norm = LogNorm(0.05, max(float(high.max()) for _, high in tables.values()))
        rows: list[list[tuple[Axes, tuple[float, float]]]] = []
        for number, k in enumerate((LOW, HIGH)):
            rows.append([])
            for reading, words in READINGS:
                axes = figure.add_subplot()
                weights = tables[reading][number].reshape(lattice.shape)
                image = axes.imshow(
                    weights, cmap=risk_colours(), norm=norm, origin="lower", extent=(half, 1.0 + half) * 2
                )
                axes.plot(0.5, 0.5, **_CROSS)
                _frame(axes, "x", "y", xlim=(0.0, 1.0 + half), ylim=(0.0, 1.0 + half), aspect="equal", grid=False)
                axes.set_title(f"K = {k:g}: {words}", fontsize=8.5, loc="left")
                rows[-1].append((axes, (NARROW - 0.2, NARROW - 0.2)))
        bar = figure.colorbar(
            image, cax=figure.add_axes((0.0, 0.0, 0.1, 0.1)), format=FuncFormatter(lambda weight, _: f"{weight:g}")
        )
        bar.set_label("weight A from (0, 0), logarithmic")
        heading = ("Fig. 3", f"Weights of the segments from (0, 0), one threat at (0.5, 0.5), sigma = {SHOWN_SIGMA}")
        finish(figure, heading, rows, [(line_key(**_CROSS), "the threat")])
    shares = {reading: [doubled(reading, sigma) for sigma in SIGMAS] for reading, _ in READINGS}
    told = "; ".join(f"{words}: {', '.join(f'{s:.0%}' for s in shares[reading])}" for reading, words in READINGS)
    sigmas = ", ".join(f"{sigma:g}" for sigma in SIGMAS)
    return picture(
        figure,
        "To the 400 points of the paper's lattice (N = 20). The paper says that K = 200 weighs much more than K = 10 "
        f"for each point, and prints neither sigma nor a number. At least twice as much weigh, for sigma = {sigmas}: "
        f"{told}. Behind the threat the weight is up to 20 times as much; points whose segment passes it by weigh "
        "their distance, whatever K.",
    )


def weights_from_origin(reading: Reading, sigma: float) -> tuple[FloatArray, FloatArray]:
    """
    Return the weights of the segments from (0, 0) to the points of the lattice, for both K of Fig. 3.

    Parameters
    ----------
    reading
        Of Eq. 1.
    sigma
        Of its one threat.

    Returns
    -------
    low, high
        Shape ``(400,)`` each, map units.
    """
    points = paper_lattice().points
    field = improper_field([Threat.from_eq1(0.5, 0.5, sigma, reading=reading)])
    low, high = (CostModel(field, k).weights(np.zeros_like(points), points) for k in (LOW, HIGH))
    return low, high


def doubled(reading: Reading, sigma: float) -> float:
    """
    Return the share of lattice points that weigh at least twice as much with the greater K.

    Examples
    --------
    >>> doubled("membership", 0.05) < doubled("membership", 0.2)
    True
    """
    low, high = weights_from_origin(reading, sigma)
    return float((high >= 2.0 * low).mean())


@dataclass(frozen=True)
class Case:
    """
    One way of a figure: planned with the whole map known, and flown with limited sight.

    Attributes
    ----------
    label
        What the legend calls it.
    k
        Risk weight.
    n
        Points a side of the lattice.
    solver
        What plans.
    known
        Whether it is also planned with the whole map known.
    """

    label: str
    k: float
    n: int = 20
    solver: str = "cgla"
    known: bool = True


@dataclass(frozen=True, eq=False)
class Ways:
    """
    What came of a case.

    Attributes
    ----------
    case
        The case.
    known, flown
        Waypoints, shape ``(m, 2)``, map units; no way with the whole map known where the case asks for none.
    known_sum, flown_sum
        Their risk sums (E5).
    """

    case: Case
    known: FloatArray | None
    known_sum: float
    flown: FloatArray
    flown_sum: float

    @property
    def label(self) -> str:
        """The line of the legend."""
        flown = f"flown {length_of(self.flown):.3f} / {self.flown_sum:.3f}"
        known = "" if self.known is None else f"all known {length_of(self.known):.3f} / {self.known_sum:.3f}, "
        return f"{self.case.label}: {known}{flown}"


def ways(case: Case, field: RiskField, *, start: Point = START, timed: Sequence[TimedThreat] = ()) -> Ways:
    """
    Plan and fly a case from a start to the paper's goal.

    Parameters
    ----------
    case
        How.
    field
        The threats that are there from the start; known is all of them and the timed ones.
    start
        Map units.
    timed
        Threats that come up under way.

    Raises
    ------
    AssertionError
        If there is no way, or the flight does not arrive.
    """
    whole = field.with_threats([*field.threats, *(one.threat for one in timed)])
    solver = get(case.solver)
    flight = fly_alone(field, k=case.k, n=case.n, start=start, timed=timed, solver=solver)
    require(flight.status is MissionStatus.ARRIVED, f"{case.label}: {flight.status.value}")
    if not case.known:
        return Ways(case, None, math.nan, flight.path, flight.risk_sum)
    solution = solve(Problem(start, GOAL, whole, k=case.k, bounds=BOUNDS), solver, resolution=paper_lattice(case.n))
    require(solution.status.is_path, f"{case.label}: no path with the whole map known")
    return Ways(case, solution.path, risk_sum(whole, solution.path), flight.path, flight.risk_sum)


def length_of(path: FloatArray) -> float:
    """
    Return the length of a path, map units.

    Examples
    --------
    >>> length_of(np.array([[0.0, 0.0], [0.3, 0.4]]))
    0.5
    """
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def fig_5() -> Picture:
    """Draw the ways of three K, planned with the whole map known and flown, and the flight of BCV-style."""
    field = load_scenario("paper").problem.field
    cases = [Case(f"K = {k:g}", k) for k in (10.0, 50.0, 200.0)]
    found = [ways(case, field) for case in (*cases, Case("bcv-style", 10.0, solver="bcv-style", known=False))]
    figure = _known_and_flown(("Fig. 5", "Ways on the reconstructed map, length / risk sum"), field, found, regions=True)
    passed = "; ".join(
        f"K = {way.case.k:g}: {nearest(way.flown, REGIONS[0]):.3f} and {nearest(way.flown, REGIONS[1]):.3f}"
        for way in found[:3]
    )
    return picture(
        figure,
        "Risk sum is F summed over positions 0.02 apart, length is in sides of the map. In the paper K = 10 passes the "
        f"regions (0.5, 0.5) and (0.8, 0.8), greater K avoid them; flown here, the ways come as near as {passed}. "
        "bcv-style is a planner in the style of BCV, not the original, whose text is not public. Start, goal, N, step "
        f"and K are the paper's, the detection radius ({RADIUS:g}) is ours. {SELECTED}",
    )


def fig_6() -> Picture:
    """Draw the escape from a sudden threat."""
    opened = load_mission("fig6")
    missions = opened.missions(get)
    world, start = opened.world, next(iter(missions.values())).uavs[0].start
    field, timed = world.field_at(0), [one for one in world.timed if isinstance(one, TimedThreat)]
    found = [ways(Case(name, one.uavs[0].k), field, start=start, timed=timed) for name, one in missions.items()]
    heading = ("Fig. 6", "The escape from a sudden threat at (0.6, 0.5), length / risk sum")
    figure = _known_and_flown(heading, world.field_at(1), found, start=start, timed=timed)
    low, high = found
    longer = length_of(high.flown) / length_of(low.flown) - 1.0
    return picture(
        figure,
        "The threat appears on the first tick. From K = 10 to 100 the flown way has "
        f"{high.flown_sum / low.flown_sum - 1.0:+.0%} risk sum and {longer:+.0%} length; Table 2 prints -23 % and +5 %. "
        "Threat, goal, N, step and K are the paper's; where the UAV is then, (0.5, 0.4), the spread of the threat, the "
        "other threats (those of the map of Fig. 5 without two) and the detection radius are ours.",
    )


def fig_11() -> Picture:
    """Draw the ways on three lattices."""
    field = load_scenario("paper").problem.field
    found = [ways(Case(f"N = {n}", 40.0, n), field) for n in (15, 20, 25)]
    figure = _known_and_flown(("Fig. 11", "Ways on lattices of N x N points, K = 40, length / risk sum"), field, found)
    costs = [length_of(way.known) + 40.0 * field.line_integral(way.known[:-1], way.known[1:]).sum() for way in found]
    told = ", ".join(f"{cost:.3f}" for cost in costs)
    return picture(
        figure,
        "The paper finds nearly the same way with N = 15, 20 and 25. With the whole map known so do we: costs "
        f"{told}, all within {max(costs) / min(costs) - 1.0:.1%}; flown, what is seen first decides the rest of the "
        "way. N and K are the paper's; start and goal are nodes of each lattice, and a step is 0.02 with each N. "
        f"{SELECTED}",
    )


def _known_and_flown(
    heading: tuple[str, str],
    field: RiskField,
    found: Sequence[Ways],
    *,
    start: Point = START,
    timed: Sequence[TimedThreat] = (),
    regions: bool = False,
) -> Figure:
    """Draw the ways with the whole map known beside those that are flown with limited sight."""
    with page() as figure:
        panels = [
            add_map(figure, field, "the whole map known"),
            add_map(figure, field, f"flown, with sight as far as {RADIUS:g}", bar=True),
        ]
        keys: list[Key] = []
        for number, way in enumerate(found):
            if way.known is not None:
                draw_way(panels[0], way.known, number, len(found))
            keys.append((draw_way(panels[1], way.flown, number, len(found)), way.label))
        for axes in panels:
            ends = [(draw_end(axes, start), "start"), (draw_end(axes, GOAL, goal=True), "goal")]
            for one in timed:
                radius = OUTLINE_SPREADS * one.threat.spread
                draw_ring(axes, (one.threat.x, one.threat.y), radius, zorder=2.2, **TIMED_LOOK)
            if regions:
                axes.plot(*np.transpose(REGIONS), zorder=2.8, **_CROSS)
        keys += ends
        keys += [(patch_key(**TIMED_LOOK), "the sudden threat")] * bool(timed)
        keys += [(line_key(**_CROSS), "regions that K = 10 passes in the paper")] * regions
        return finish(figure, heading, [[(axes, (WIDE, WIDE)) for axes in panels]], keys, columns=2)


def _frame(axes: Axes, x: str, y: str, *, grid: bool = True, **limits: object) -> None:
    """Label axes that are no map."""
    axes.set(xlabel=x, ylabel=y, **limits)
    axes.set_axisbelow(True)
    if grid:
        axes.grid(color="0.92", linewidth=0.5)


EXHIBITS: tuple[Exhibit, ...] = (
    Exhibit("fig-1", "Fig. 1", "the risk of one threat and of several", fig_1),
    Exhibit("fig-2", "Fig. 2", "a straight segment and eight directions", fig_2),
    Exhibit("fig-3", "Fig. 3", "weights of segments for K = 10 and 200", fig_3),
    Exhibit("fig-5", "Fig. 5", "ways for K = 10, 50 and 200", fig_5),
    Exhibit("fig-6", "Fig. 6", "a sudden threat, K = 10 and 100", fig_6),
    Exhibit("fig-11", "Fig. 11", "lattices of N = 15, 20 and 25", fig_11),
)

"""A figure of ours: CGLA against BCV-style, with nothing but the length in its objective, and with risk in it."""

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from cgla_graph.comparisons.claims.artefact import Picture, artefact
from cgla_graph.comparisons.claims.contrasts import CELLS, MAIN, cell_name
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.figures.figure_page import (
    WIDE,
    Key,
    add_map,
    draw_end,
    draw_route,
    finish,
    page,
    picture,
)
from cgla_graph.comparisons.claims.paper.bcv_claims import POCKET, trapped_flights
from cgla_graph.comparisons.claims.paper.flights import GOAL, RADIUS, START, K, fly_alone
from cgla_graph.comparisons.claims.paper.planner_claims import AVERSE, BCV, LENGTH_ONLY, solver_of, versus_cgla
from cgla_graph.comparisons.claims.paper.printed_values import value
from cgla_graph.mission.records import UavFlight
from cgla_graph.plots.scene import colour_of, line_key
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario

#: Who flies, in the order of their colours, and what they are called.
WHO = {"cgla": "CGLA", LENGTH_ONLY: "BCV-style, aversion 0 (length only)", AVERSE: "BCV-style, aversion 5"}
#: What is compared, and how its axis is called, ticked and limited.
_QUANTITIES = {"length": "length", "risk_sum": "risk sum"}
_TICKS = {"length": (0.9, 0.95, 1.0, 1.05, 1.1), "risk_sum": (1.0, 2.0, 3.0, 5.0, 10.0)}
_LIMITS = {"length": (0.88, 1.12), "risk_sum": (0.8, 12.0)}
_RATIO = FuncFormatter(lambda ratio, _: f"{ratio:g}")


@artefact("Fig. A2", "CGLA against BCV-style, without and with risk in its objective", experiments=("planners",))
def _fig_a2(evidence: Evidence) -> Picture:
    samples = evidence.samples["planners"]
    seed = samples.maps[0]
    field, pocket = random_scenario(seed, k=K).problem.field, load_scenario(POCKET).problem
    on_random = {name: _fly(seed, name) for name in WHO}
    in_pocket = {name: trapped_flights()[POCKET, name, RADIUS] for name in WHO}
    with page() as figure:
        maps = [
            add_map(figure, field, "the first random map of the sample"),
            add_map(figure, pocket.field, f"the map {POCKET}: a pocket of threats", bar=True),
        ]
        keys: list[Key] = []
        for axes, flights in zip(maps, (on_random, in_pocket), strict=True):
            keys = [
                (draw_route(axes, flight.path, number, len(WHO)), WHO[name])
                for number, (name, flight) in enumerate(flights.items())
            ]
        for axes, start, goal in ((maps[0], START, GOAL), (maps[1], pocket.start, pocket.goal)):
            ends = [(draw_end(axes, start), "start"), (draw_end(axes, goal, goal=True), "goal")]
        ratios = [_ratios(figure, samples, measure) for measure in _QUANTITIES]
        keys += [*ends, (line_key(color="0.2", linestyle=(0, (4, 3))), "as printed in Table 1 (BCV's is quoted)")]
        heading = ("Fig. A2", "CGLA and BCV-style, flown with limited sight, K = 10")
        rows = [[(axes, (WIDE, WIDE)) for axes in maps], [(axes, (WIDE, 0.8 * WIDE)) for axes in ratios]]
        finish(figure, heading, rows, keys, columns=2)
    return picture(
        figure,
        "The paper complains of BCV that nothing but the length is in its objective, as with a risk aversion of 0; 5 "
        "is the default of our planner, which is in BCV's style and not the original. Above: flights with a detection "
        f"radius of {RADIUS:g}; {_told(in_pocket)} in the pocket, which was drawn as a local minimum. Below: "
        "BCV-style's length and risk sum over CGLA's on random maps (Hodges-Lehmann estimates and 95 % intervals), "
        f"one row for each of the {len(CELLS)} cells, from below: {cell_name(CELLS[0])} to {cell_name(CELLS[-1])}. "
        "Right of 1, CGLA has less.",
    )


def _fly(seed: int, name: str) -> UavFlight:
    """Fly on a random map in the main cell."""
    cell = MAIN if name == "cgla" else {"radius": MAIN["radius"]}
    return fly_alone(random_scenario(seed, k=K).problem.field, k=K, solver=solver_of(name), **cell)


def _ratios(figure: Figure, samples: Samples, measure: str) -> Axes:
    """Draw the ratios of all cells, with their intervals, and the printed one."""
    axes = figure.add_subplot()
    low, high = _LIMITS[measure]
    for number, name in enumerate(BCV, 1):
        shifts = [one.shift.shift for one in versus_cgla(samples, name, measure)]
        for row, one in enumerate(shifts):
            height = row + 0.2 * (1.5 - number)
            # few maps give intervals without an end
            ends = [min(max(end, low), high) for end in (one.low, one.high)]
            axes.plot(ends, [height, height], color=colour_of(number), linewidth=1.6)
            axes.plot(one.median, height, "o", color=colour_of(number), markersize=3.5)
    axes.axvline(1.0, color="0.6", linewidth=0.9)
    axes.axvline(_printed(measure), color="0.2", linewidth=1.0, linestyle=(0, (4, 3)))
    label = f"{_QUANTITIES[measure]} of BCV-style / CGLA"
    axes.set(xscale="log", xlabel=label, ylabel="cell", yticks=range(len(CELLS)), ylim=(-0.7, len(CELLS) - 0.3))
    axes.set_yticklabels([str(row + 1) for row in range(len(CELLS))])
    axes.set(xlim=(low, high), xticks=_TICKS[measure])
    axes.xaxis.set_major_formatter(_RATIO)
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_axisbelow(True)
    axes.grid(color="0.92", linewidth=0.5)
    return axes


def _printed(measure: str) -> float:
    bcv, cgla = (value("Table 1", method) for method in ("BCV", "CGLA, K = 10"))
    quantity = _QUANTITIES[measure]
    return bcv.printed[quantity] / cgla.printed[quantity]


def _told(flights: dict[str, UavFlight]) -> str:
    """Say how flights ended."""
    words: Sequence[str] = [f"{WHO[name]} {flight.status.label}" for name, flight in flights.items()]
    return ", ".join(words)

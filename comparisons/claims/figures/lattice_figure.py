"""A figure of ours: what a finer lattice gains, and what it takes to solve it exactly, from N = 10 to 1000."""

from collections.abc import Sequence

import numpy as np
from matplotlib.ticker import FuncFormatter

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.artefact import Picture, artefact
from cgla_graph.comparisons.claims.claim import require
from cgla_graph.comparisons.claims.figures.figure_page import WIDE, Key, finish, page, picture
from cgla_graph.comparisons.claims.inference import power_law
from cgla_graph.comparisons.claims.paper.flights import paper_lattice
from cgla_graph.model.problem import Problem
from cgla_graph.plots.scene import colour_of, line_key
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import solve
from cgla_graph.solvers.solving import lower_bound

#: Points a side: the complete graph of the last one has 5e11 edges.
SIZES = (10, 20, 40, 100, 200, 400, 1000)
#: So many of them make the rate: beyond, the bound's own slack is seen.
RATED = 4
#: How far below the least cost the bound may lie.
BOUND_WITHIN = 2e-4


def maps() -> dict[str, Problem]:
    """Return the maps by name: the reconstructed one of Fig. 5, and two random ones."""
    drawn = {f"random map {seed}": random_scenario(seed).problem for seed in (1, 2)}
    return {"map paper, K = 10": load_scenario("paper").problem, **drawn}


def excess(problem: Problem, sizes: Sequence[int]) -> tuple[FloatArray, float, list[int]]:
    """
    Return by how much least costs on lattices, and that of the best path known in the plane, exceed a proven bound.

    Returns
    -------
    lattices
        Shape ``(len(sizes),)``, relative to the bound.
    plane
        The same of the path in the plane: no more than this is the bound's own slack.
    weighed
        Edges that were weighed, by size.

    Examples
    --------
    >>> lattices, plane, weighed = excess(Problem((0.1, 0.1), (0.9, 0.85)), (10, 20))
    >>> lattices.round(9).tolist(), round(plane, 9), weighed
    ([0.0, 0.0], 0.0, [5050, 79800])
    """
    proof = lower_bound(problem, BOUND_WITHIN)
    found = [solve(problem, "cgla", resolution=paper_lattice(n)) for n in sizes]
    costs = np.array([one.cost for one in found])
    plane = min(float(costs.min()), solve(problem, "hybrid").cost)
    require(plane >= proof.lower_bound, f"a path costs {plane}, less than the bound {proof.lower_bound} of all")
    return costs / proof.lower_bound - 1.0, plane / proof.lower_bound - 1.0, [one.evaluations for one in found]


@artefact("Fig. A4", "the lattice's excess over the proven bound, and the edges weighed for it, from N = 10 to 1000")
def _fig_a4() -> Picture:
    with page() as figure:
        axes, work = figure.subplots(2)
        keys: list[Key] = []
        told = []
        for number, (name, problem) in enumerate(maps().items()):
            lattices, plane, weighed = excess(problem, SIZES)
            (line,) = axes.loglog(SIZES, lattices, "o-", color=colour_of(number), markersize=4, linewidth=1.6)
            work.loglog(SIZES, weighed, "o-", color=colour_of(number), markersize=4, linewidth=1.6)
            axes.axhline(plane, color=colour_of(number), linewidth=0.9, linestyle=(0, (4, 3)))
            rate = power_law(SIZES[:RATED], lattices[:RATED].tolist()).median
            keys.append((line, f"{name}: N to the {rate:.2g} up to N = {SIZES[:RATED][-1]}"))
            told.append(f"{name}: " + ", ".join(f"{one:.2g}" for one in lattices))
        keys.append((line_key(color="0.4", linestyle=(0, (4, 3))), "best path known in the plane"))
        work.loglog(SIZES, [0.5 * n**4 for n in SIZES], color="0.4", linestyle=":")
        keys.append((line_key(color="0.4", linestyle=":"), "all edges, which the paper's algorithm weighs: N^4 / 2"))
        axes.set(ylabel="excess over the proven bound")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda one, _: f"{100.0 * one:g} %"))
        work.yaxis.set_major_formatter(FuncFormatter(lambda one, _: f"{one:.0e}"))
        work.set(xlabel="N, points a side", ylabel="edges weighed")
        for each in (axes, work):
            each.set_xticks(SIZES, [str(n) for n in SIZES])
            each.minorticks_off()
            each.set_axisbelow(True)
            each.grid(color="0.92", linewidth=0.5)
        size = 1.6 * WIDE, 0.8 * WIDE
        finish(figure, ("Fig. A4", "What a finer lattice gains, and takes"), [[(axes, size)], [(work, size)]], keys)
    return picture(
        figure,
        "A figure of ours. Least cost on the complete graph of N x N points over a proven lower bound of every path's "
        "cost in the plane, less 1. The optimum is exact at each N: beyond 6,000 points only what can be part of it is "
        "weighed. Dashed: the best path known in the plane, so that what lies below is the bound's own slack. "
        f"The lower part has the edges weighed. In numbers, for N = {', '.join(map(str, SIZES))}: {'; '.join(told)}.",
    )

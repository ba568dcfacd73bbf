"""The size of the lattice (C46): whether it hardly matters."""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
import shapely

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    MOSTLY,
    Case,
    cell_name,
    share_part,
    share_table,
    shares,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import median, power_law, proportion
from cgla_graph.comparisons.claims.paper.complexity_claims import within
from cgla_graph.comparisons.claims.paper.flights import fly_alone, paper_lattice
from cgla_graph.comparisons.claims.paper.weight_claims import TIE
from cgla_graph.comparisons.statistics.intervals import estimate
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import solve
from cgla_graph.solvers.solving import lower_bound

#: Fig. 11: points a side, and K. The second sizes divide each other, so that one lattice holds the other's points.
SIZES = (15, 20, 25)
NESTED_SIZES = (10, 20, 40)
SIZES_K = 40.0
#: Paths are held against each other at points no farther apart than this, map units.
FINE = 0.01
#: A path that never is more than two cells of the coarsest lattice from another is nearly the same.
SAME_WITHIN = 2.0 / 15.0
#: What else could count as nearly the same, map units.
BARS = (0.05, 0.1, SAME_WITHIN, 0.2, 0.3)
#: On more than what share of maps they have to be: the paper, which shows one map, names none.
OFTEN = (0.9, MOSTLY)
RULE = (
    "Rule: supported if in every row the share is shown to be above that (exact binomial test, p below 0.05); "
    "contradicted if in some row it is shown to be below (Holm over the rows); else undecided."
)
#: Costs on different lattices that differ by less than this, relative to the least, are nearly the same.
COST_WITHIN = 0.05
#: Points a side for which the least cost is held against the proven bound for all paths, and how close that is.
EXCESS_SIZES = (10, 20, 40, 100, 200)
BOUND_WITHIN = 5e-4


@experiment("resolution", quick=9)
def resolution(seed: int) -> list[Record]:
    """Solve and fly a random map on lattices of several sizes; start and goal are nodes of all."""
    problem = random_scenario(seed, k=SIZES_K).problem
    solved = {n: solve(problem, "cgla", resolution=paper_lattice(n)) for n in sorted({*SIZES, *NESTED_SIZES})}
    costs = [solved[n].cost for n in SIZES]
    offline = {
        "mode": "offline",
        "integral": "exact",
        "frechet": farthest_pair([solved[n].path for n in SIZES]),
        "spread": max(costs) / min(costs) - 1.0,
        **{f"nested_{n}": solved[n].cost for n in NESTED_SIZES},
    }
    return [offline, *(_flown_on_sizes(problem.field, cell) for cell in CELLS)]


def farthest_pair(paths: Sequence[FloatArray]) -> float:
    """
    Return the greatest discrete Frechet distance of any two paths, each cut into pieces of at most `FINE`.

    Parameters
    ----------
    paths
        Waypoints, shape ``(m, 2)`` each, map units.

    Examples
    --------
    >>> farthest_pair([np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 0.25], [1.0, 0.25]])])
    0.25
    """
    lines = [shapely.segmentize(shapely.LineString(path), FINE) for path in paths]
    return max(float(shapely.frechet_distance(a, b)) for a, b in combinations(lines, 2))


def _flown_on_sizes(field: RiskField, cell: Case) -> Record:
    flights = [fly_alone(field, k=SIZES_K, n=n, **cell) for n in SIZES]
    lengths = [flight.length for flight in flights]
    return {
        "mode": "online",
        **cell,
        "frechet": farthest_pair([flight.path for flight in flights]),
        "spread": max(lengths) / min(lengths) - 1.0,
        "arrived": all(flight.status.label == "arrived" for flight in flights),
    }


@claim(
    46,
    "Section 5.2.3, Fig. 11",
    "The paths at N = 15, 20 and 25 are nearly the same (K = 40).",
    "P(Frechet distance of any two <= 2/15) is above 0.9, and above 0.95, all known and with limited sight.",
    Kind.STATISTIC,
    experiments=("resolution",),
    figures=("Fig. 11", "Fig. A4"),
)
def _check_c46(evidence: Evidence) -> Finding:
    excess = _excess_over_bound(evidence.scale.map_seeds(evidence.instances(40, 2)))
    return judge_c46(evidence.samples["resolution"], excess)


def judge_c46(samples: Samples, excess: FloatArray) -> Finding:
    """Decide by paths on several lattices, and `excess`, shape ``(maps, sizes)``: costs above the proven bound."""
    nested = _nested_costs_fall(samples)
    distances = {
        "all known": samples.column("frechet", mode="offline"),
        **{cell_name(cell): samples.column("frechet", mode="online", **cell) for cell in CELLS},
    }
    near = {name: np.where(np.isfinite(one), one <= SAME_WITHIN, math.nan) for name, one in distances.items()}
    same = {often: shares(near, often) for often in OFTEN}
    modes: dict[str, slice] = {"all known": slice(1), "with limited sight": slice(1, None)}
    parts = tuple(
        share_part("nearly the same", same[often][which], condition=f"{mode}, on more than {often:.0%} of maps")
        for mode, which in modes.items()
        for often in OFTEN
    )
    known, *seen = same[MOSTLY]
    rates = [one.found.rate for one in seen]
    return Finding(
        parts,
        f"All known: within 2/15 on {known.found.rate:.1%} of {known.found.n} maps ({known.found.interval.low:.1%} to "
        f"{known.found.interval.high:.1%}; median distance {median(distances['all known']):.3g}). With limited sight: "
        f"on {min(rates):.1%} to {max(rates):.1%} of them. With {BARS[1]:g} or {BARS[3]:g} for 2/15, all known: "
        f"{_share_within(distances['all known'], BARS[1]):.1%}, {_share_within(distances['all known'], BARS[3]):.1%}.",
        beside=(
            Part("a lattice that holds another's points never costs more", Verdict.PROVED, nested, "N = 10, 20, 40"),
            _cost_part(samples.column("spread", mode="offline")),
            _excess_part(excess),
        ),
        tables=(
            _bars_table(distances),
            *(
                share_table(
                    f"paths at N = 15, 20, 25 within 2/15 of each other, on more than {often:.0%} of maps", of, RULE
                )
                for often, of in same.items()
            ),
            _excess_table(excess),
        ),
        notes=(
            "Start and goal are nodes of every lattice; (0.1, 0.1) is a point of none but N = 10, 20, 40.",
            (
                "Proof for nested lattices: i/10 = 2i/20 = 4i/40, so each complete graph is part of the next, with the "
                "same weights; 15, 20 and 25 do not divide each other."
            ),
            (
                "2/15 is two cells of the coarsest lattice. The paper shows one map, so that the share of maps on "
                "which it has to be so is ours: nineteen in twenty was set first, and nine in ten added when the first "
                "sample had left that one open."
            ),
        ),
    )


def _cost_part(spreads: FloatArray) -> Part:
    """Say whether costs on different lattices are nearly the same on the median map."""
    spread = estimate(spreads[np.isfinite(spreads)].tolist())
    effect = f"{spread.median:.2%} ({spread.low:.2%} to {spread.high:.2%})"
    return Part(
        f"costs differ by less than {COST_WITHIN:.0%}",
        within(spread, -math.inf, COST_WITHIN),
        f"the greatest of three is {effect} above the least",
        "on the median map, all known",
        effect,
    )


def _share_within(distances: FloatArray, bar: float) -> float:
    return proportion(distances[np.isfinite(distances)] <= bar).rate


def _bars_table(distances: Mapping[str, FloatArray]) -> Table:
    """Tabulate on how many maps paths are within several distances, so that another bar can be read off."""
    rows: list[list[Entry]] = []
    for name, one in distances.items():
        kept = one[np.isfinite(one)]
        so_near = [_share_within(one, bar) for bar in BARS]
        rows.append([name, len(kept), *so_near, median(one), float(kept.max(initial=0.0))])
    heads = ("case", "maps", *(f"within {bar:.3g}" for bar in BARS), "median distance", "worst")
    return Table("share of maps on which the paths at N = 15, 20, 25 are so near (Frechet), K = 40", heads, rows)


def _excess_over_bound(seeds: Sequence[int]) -> FloatArray:
    """Return by how much least costs on lattices exceed a bound of all paths in the plane: shape ``(maps, sizes)``."""
    excess = []
    for seed in seeds:
        problem = random_scenario(seed, k=SIZES_K).problem
        bound = lower_bound(problem, BOUND_WITHIN).lower_bound
        costs = [solve(problem, "cgla", resolution=paper_lattice(n)).cost for n in EXCESS_SIZES]
        require(min(costs) >= bound, f"a path costs {min(costs)}, less than the bound {bound} of all")
        excess.append([cost / bound - 1.0 for cost in costs])
    return np.array(excess)


def _excess_table(excess: FloatArray) -> Table:
    rows: list[list[Entry]] = [
        [n, *estimate(of.tolist()), float(of.max())] for n, of in zip(EXCESS_SIZES, excess.T, strict=True)
    ]
    return Table(
        f"cost of the optimum above the proven bound of all paths in the plane, {len(excess)} maps, K = 40",
        ("N", "median excess", "95 % from", "to", "worst"),
        rows,
        f"Exact at each N; the bound is at most {BOUND_WITHIN:.2%} below the least cost of all paths, which is part of "
        "each excess.",
    )


def _excess_part(excess: FloatArray) -> Part:
    """Say how much of its cost a path at N = 20 could save on finer lattices."""
    middles = np.median(excess, axis=0)
    rate = power_law(EXCESS_SIZES, middles.tolist())
    at_20 = estimate(excess[:, EXCESS_SIZES.index(20)].tolist())
    effect = f"{middles[EXCESS_SIZES.index(20)]:.2%}, worst {excess[:, EXCESS_SIZES.index(20)].max():.2%}"
    return Part(
        f"N = 20 costs less than {COST_WITHIN:.0%} more than any path",
        within(at_20, -math.inf, COST_WITHIN),
        "median excess over the proven bound: "
        + ", ".join(f"{one:.2%} (N = {n})" for n, one in zip(EXCESS_SIZES, middles, strict=True))
        + f"; it falls like N to the {rate.median:.2g}",
        "on the median map, all known",
        effect,
    )


def _nested_costs_fall(samples: Samples) -> str:
    """Assert that nested lattices cost less and less; say by how much."""
    costs = np.column_stack([samples.column(f"nested_{n}", mode="offline") for n in NESTED_SIZES])
    # an optimum that is missing is NaN
    falls = (costs[:, 1:] <= costs[:, :-1] * (1.0 + TIE)).all()
    require(falls, "a lattice that holds another's points costs more: an optimum is none")
    gains = np.median(1.0 - costs[:, 1:] / costs[:, :-1], axis=0)
    return f"asserted on {len(costs)} maps; medians of what is saved: {gains[0]:.2%}, then {gains[1]:.2%}"

"""The size of the lattice (C46): whether it hardly matters."""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import shapely

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, Verdict, claim, require, supported
from cgla_graph.comparisons.claims.contrasts import ALPHA, CELLS, MOSTLY, SHARE_RULE, Case, cell_name, shares
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import bootstrapped, equivalence, median
from cgla_graph.comparisons.claims.paper.flights import fly_alone, paper_lattice
from cgla_graph.comparisons.claims.paper.weight_claims import TIE
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import solve

#: Fig. 11: points a side, and K. The second sizes divide each other, so that one lattice holds the other's points.
SIZES = (15, 20, 25)
NESTED_SIZES = (10, 20, 40)
SIZES_K = 40.0
#: Paths are held against each other at points no farther apart than this, map units.
FINE = 0.01
#: A path that never is more than two cells of the coarsest lattice from another is nearly the same.
SAME_WITHIN = 2.0 / 15.0
#: Costs on different lattices that differ by less than this, relative to the least, are nearly the same.
COST_WITHIN = 0.05


@experiment("resolution", quick=6)
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
    "Section 5.3",
    "The paths at N = 15, 20 and 25 are nearly the same (K = 40).",
    "P(Frechet distance of any two <= 2/15) > 0.95, all known and with limited sight",
    Kind.STATISTIC,
    experiments=("resolution",),
    figures=("Fig. 11",),
)
def _check_c46(evidence: Evidence) -> Finding:
    samples = evidence.samples["resolution"]
    nested = _nested_costs_fall(samples)
    distances = {
        "all known": samples.column("frechet", mode="offline"),
        **{cell_name(cell): samples.column("frechet", mode="online", **cell) for cell in CELLS},
    }
    same = shares({name: np.where(np.isfinite(one), one <= SAME_WITHIN, math.nan) for name, one in distances.items()})
    known, *seen = same
    far = [(median(one), float(one.max(initial=0.0, where=np.isfinite(one)))) for one in distances.values()]
    rows = [(*one.row, *pair, one.p_holm, one.holds) for one, pair in zip(same, far, strict=True)]
    rates = [one.found.rate for one in seen]
    spreads = samples.column("spread", mode="offline")
    spread, p_cost = bootstrapped(spreads, seed=evidence.scale.seed), equivalence(spreads, COST_WITHIN)
    columns = ("case", "maps", "same", "95 % from", "to", "median distance", "worst", "p (Holm)", "holds")
    title = "Share of maps on which the paths at N = 15, 20, 25 are within 2/15 of each other (Frechet), K = 40"
    return Finding(
        supported(all(one.holds for one in same)),
        f"All known: within 2/15 on {known.found.rate:.1%} of {known.found.n} maps (median distance "
        f"{far[0][0]:.3g}, worst {far[0][1]:.3g}). With limited sight: on {min(rates):.1%} to "
        f"{max(rates):.1%} of them.",
        parts=(
            Part(
                f"All known: nearly the same path on more than {MOSTLY:.0%} of maps",
                supported(known.holds),
                f"{known.found.rate:.1%} (from {known.found.interval.low:.3g})",
            ),
            Part(
                f"Limited sight: nearly the same flight on more than {MOSTLY:.0%} of maps",
                supported(all(one.holds for one in seen)),
                f"in {sum(one.holds for one in seen)} of {len(seen)} cells",
            ),
            Part("A lattice that holds another's points never costs more (N = 10, 20, 40)", Verdict.PROVED, nested),
            Part(
                f"All known: costs differ by less than {COST_WITHIN:.0%}, as a rule",
                supported(p_cost < ALPHA),
                f"by {spread.median:.2%} ({spread.low:.2%} to {spread.high:.2%}); equivalence: p = {p_cost:.2g}",
            ),
        ),
        tables=(Table(title, columns, rows, SHARE_RULE),),
        notes=(
            "Start and goal are nodes of every lattice; (0.1, 0.1) is a point of none but N = 10, 20, 40.",
            (
                "Proof of the last part: i/10 = 2i/20 = 4i/40, so each complete graph is part of the next, with the "
                "same weights; 15, 20 and 25 do not divide each other."
            ),
        ),
    )


def _nested_costs_fall(samples: Samples) -> str:
    """Assert that nested lattices cost less and less; say by how much."""
    costs = np.column_stack([samples.column(f"nested_{n}", mode="offline") for n in NESTED_SIZES])
    # an optimum that is missing is NaN
    falls = (costs[:, 1:] <= costs[:, :-1] * (1.0 + TIE)).all()
    require(falls, "a lattice that holds another's points costs more: an optimum is none")
    gains = np.median(1.0 - costs[:, 1:] / costs[:, :-1], axis=0)
    return f"asserted on {len(costs)} maps; medians of what is saved: {gains[0]:.2%}, then {gains[1]:.2%}"

"""What is measured of one UAV on random maps: flights and optima over K, sudden threats, lattices of other sizes."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import shapely

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.contrasts import CELLS
from cgla_graph.comparisons.claims.experiment import Experiment, Record
from cgla_graph.comparisons.claims.paper.flights import GOAL, fly_alone, measures, paper_lattice, risk_sum
from cgla_graph.mission.records import UavFlight
from cgla_graph.mission.world import TimedThreat
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import solve
from cgla_graph.solvers.trade_off.reweighing import Reweighed

#: The risk weights of Fig. 5 and Table 1, and of Fig. 6 and Table 2.
ONLINE_K = (10.0, 50.0, 200.0)
POPUP_K = (10.0, 100.0)
#: Those of the optima with full information.
OFFLINE_K = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)
#: The sudden threat of Fig. 6; where the UAV is then, and the spread, are ours (the paper does not say).
POPUP = Threat(0.6, 0.5, spread=0.055)
POPUP_START = (0.5, 0.4)
#: Fig. 11: points a side, and K. The second sizes divide each other, so that one lattice holds the other's points.
SIZES = (15, 20, 25)
NESTED_SIZES = (10, 20, 40)
SIZES_K = 40.0
#: Paths are held against each other at points no farther apart than this, map units.
FINE = 0.01


def online_k(seed: int) -> list[Record]:
    """Fly a random map under each K, in every cell."""
    field = random_scenario(seed).problem.field
    return [{**cell, "k": k, **measures(fly_alone(field, k=k, **_flown(cell)))} for cell in CELLS for k in ONLINE_K]


def offline_k(seed: int) -> list[Record]:
    """Solve a random map with full information under each K."""
    return _optima(random_scenario(seed).problem, OFFLINE_K)


def pop_up(seed: int) -> list[Record]:
    """
    Have a threat come up at (0.6, 0.5) when the UAV takes off at (0.5, 0.4), and not.

    The way from there is what the paper calls the rest of the flight; the rest of the map is random and unknown.
    """
    problem = random_scenario(seed, start=POPUP_START).problem
    timed = [TimedThreat(POPUP, appears=1)]
    flights = [
        {**cell, "k": k, "sudden": sudden, **measures(_escape(problem.field, k, cell, timed if sudden else []))}
        for cell in CELLS
        for k in POPUP_K
        for sudden in (True, False)
    ]
    known = Problem(POPUP_START, GOAL, field=problem.field.with_threats([POPUP]), k=problem.k, bounds=problem.bounds)
    optima = [{"integral": "known", "sudden": True, **record} for record in _optima(known, POPUP_K)]
    return [*flights, *optima]


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


def _flown_on_sizes(field: RiskField, cell: Mapping[str, Any]) -> Record:
    flights = [fly_alone(field, k=SIZES_K, n=n, **_flown(cell)) for n in SIZES]
    lengths = [flight.length for flight in flights]
    return {
        "mode": "online",
        **cell,
        "frechet": farthest_pair([flight.path for flight in flights]),
        "spread": max(lengths) / min(lengths) - 1.0,
        "arrived": all(flight.status.label == "arrived" for flight in flights),
    }


def _escape(field: RiskField, k: float, cell: Mapping[str, Any], timed: Sequence[TimedThreat]) -> UavFlight:
    return fly_alone(field, k=k, start=POPUP_START, timed=timed, **_flown(cell))


def _flown(cell: Mapping[str, Any]) -> dict[str, Any]:
    return {"integral": cell["integral"], "radius": cell["radius"]}


def _optima(problem: Problem, weights: Sequence[float]) -> list[Record]:
    """Solve one problem exactly under several risk weights; length and risk of all pairs are weighed once."""
    reweighed = Reweighed(problem, "cgla", resolution=paper_lattice())
    return [{"k": k, **_offline(problem.field, reweighed.at(k))} for k in weights]


def _offline(field: RiskField, solution: Solution) -> Record:
    return {
        "length": solution.length,
        "risk": solution.risk,
        "cost": solution.cost,
        "risk_sum": risk_sum(field, np.asarray(solution.path)),
    }


EXPERIMENTS = (
    Experiment("online-k", "a flight with limited sight under K = 10, 50, 200, in six cells", online_k, quick=10),
    Experiment("offline-k", "the optimum with full information under eight K", offline_k, quick=20),
    Experiment("pop-up", "a sudden threat near the UAV, K = 10 and 100, in six cells", pop_up, quick=10),
    Experiment("resolution", "paths and flights at N = 15, 20, 25, in seven cells", resolution, quick=6),
)

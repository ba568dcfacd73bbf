"""Answers to a draft: the path and its proof, quickly or in full, and other solvers' paths."""

import math
import time
from typing import Any, NamedTuple

import numpy as np

from cgla_graph._text import json_number
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.certificate.certificate import load_kernels, prove
from cgla_graph.certificate.costs import is_provable, proven
from cgla_graph.certificate.subsolution import Level, first_grid
from cgla_graph.certificate.through import kept
from cgla_graph.comparisons.live.areas import as_flat
from cgla_graph.comparisons.live.draft import Draft, LiveMap, unwarned
from cgla_graph.comparisons.study import runner
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import reason
from cgla_graph.eikonal import cell_runs
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import Evaluation, Problem
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import listing, registry
from cgla_graph.solvers.continuous.hybrid import Hybrid
from cgla_graph.solvers.solving import solve
from cgla_graph.solvers.warm_up import warm_up

#: Gains below this part of the bound are not worth another round.
AIM = 4e-3


class OneGrid(NamedTuple):
    """
    The proof of one grid.

    Attributes
    ----------
    lower_bound
        No path costs less, map units; infinite if there is no path, NaN without a bound.
    last, runs
        Column and row of the grid's last node, and the cells that a better path may pass, as `cgla_graph.Certificate`
        has them; None if unknown.
    """

    lower_bound: float
    last: tuple[int, int] | None = None
    runs: WholeArray | None = None


def prove_on_one_grid(problem: Problem, cost: float) -> OneGrid:
    """
    Bound the cost of every path on the first grid of a proof.

    Parameters
    ----------
    problem
        The problem.
    cost
        Of a feasible path; infinite if none is known.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> 1.34 < prove_on_one_grid(problem, 1.3516).lower_bound <= 1.3516
    True
    """
    if not problem.field.is_proper:
        return OneGrid(math.nan)
    straight = problem.least_length * (1.0 - 2.0**-50)
    if straight >= cost or not is_provable(problem):
        return OneGrid(min(straight, cost))
    last = first_grid(problem)
    # a path that touches its clearance counts as well
    level = Level.lay(problem.relaxed(), last, cell_runs.rectangle(last))
    bounds = level.both(AIM, charge=True)
    if bounds is None:
        # start and goal are apart: there is no path, or none better than the known one
        return OneGrid(cost)
    here = max(one.bound for one in bounds)
    runs = kept(level, *bounds, cost) if math.isfinite(cost) else None
    # the cost of a known path is an upper limit of the bound
    return OneGrid(max(straight, min(proven(problem, here), cost)), last, runs)


#: Solvers that may run in this process: our own, fast on most maps, without loops that may hang.
FAST = ("straight-line", "eight-direction", "lazy-theta-star", "cgla", "dijkstra", "fast-marching", "visibility-graph")
#: Seconds above which one of these runs in a process of its own from then on.
SLOW = 0.5
#: Most rectangles of a tube that is sent.
MOST_RUNS = 4000


#: While something moves, a path is searched with few candidates, and its proof has one grid.
QUICK = Hybrid(points=225, candidates=2, tolerance=None)
#: When nothing moves. No limit is one of time, so that a map has the same answer whenever it is drawn.
FULL = Hybrid(tolerance=None)
#: Tolerance and most cells of its proof, as `cgla_graph.lower_bound` has them.
TOLERANCE, MOST_CELLS = 0.001, 250_000


class Planner:
    """
    Plans on drafts of one map; used by one thread at a time.

    Parameters
    ----------
    live
        The map.

    Examples
    --------
    >>> live = LiveMap.open("one-threat")
    >>> answer = Planner(live).path(live.first, full=False)
    >>> answer["error"], answer["bound"] < answer["cost"] < 1.01 * answer["bound"]
    (None, True)
    """

    def __init__(self, live: LiveMap) -> None:
        """Plan nothing yet."""
        self.live = live
        self.slow: set[str] = set()

    def warm_up(self) -> None:
        """Load kernels and plan once, so that the first drag does not wait for them."""
        # (areas may be drawn)
        kind = MapKind.of(self.live.scenario.problem.model)._replace(walls=True)
        load_kernels(kind)
        warm_up(FULL, kind)
        self.path(self.live.first, full=False)

    def path(self, draft: Draft, *, full: bool) -> dict[str, Any]:
        """
        Return the best path known, a bound that no path can beat, and the tube that no better path leaves.

        All but its ``seconds`` follows from the draft. Without a path, its ``error`` gives the reason in one sentence.
        """
        began = time.perf_counter()
        try:
            scenario = self.live.drawn(draft)
            with unwarned():
                answer = _planned(scenario, full=full)
        except Exception as error:  # noqa: BLE001 - the page survives any draft
            answer = nothing(reason(error))
        return {**answer, **self.live.seen(draft), "seconds": time.perf_counter() - began, "full": full}

    def solver(self, draft: Draft, entrant: Entrant) -> dict[str, Any]:
        """Return the path of a fast solver."""
        began = time.perf_counter()
        try:
            scenario = self.live.drawn(draft)
        except Exception as error:  # noqa: BLE001 - the same
            return nothing(reason(error))
        with unwarned():
            solution = runner.run(runner.SharedGraph.lay(scenario, None), entrant, None)
        if time.perf_counter() - began > SLOW:
            self.slow.add(entrant.label)
        return solved(scenario, solution)

    def is_fast(self, entrant: Entrant) -> bool:
        """Return whether a solver may run in this process."""
        return entrant.name in FAST and entrant.label not in self.slow


def nothing(error: str) -> dict[str, Any]:
    """Return an answer without a path."""
    numbers = dict.fromkeys(("cost", "length", "risk", "clearance", "bound", "seconds"))
    return {"error": error, "path": [], "tube": None, "message": "", **numbers}


def _with_path(path: FloatArray, found: Solution | Evaluation) -> dict[str, Any]:
    numbers = {name: json_number(getattr(found, name)) for name in ("cost", "length", "risk", "clearance")}
    return {**nothing(""), "error": None, "path": as_flat(path), **numbers}


def _planned(scenario: Scenario, *, full: bool) -> dict[str, Any]:
    problem = scenario.problem
    found = solve(problem, FULL if full else QUICK)
    has_path = found.status.has_path
    if full:
        held = found.path if has_path else None
        certificate = prove(problem, held, tolerance=TOLERANCE, max_cells=MOST_CELLS)
        bound = certificate.lower_bound
        # the finest grid whose tube is small enough to send
        finer = reversed(certificate.grids[1:])
        last, runs = next(((grid.last, grid.runs) for grid in finer if len(grid.runs) <= MOST_RUNS), (None, None))
    else:
        bound, last, runs = prove_on_one_grid(problem, found.cost if has_path else math.inf)
    if not has_path:
        closed = math.isinf(bound)
        return nothing(
            "There is no path: the goal is closed off." if closed else f"No path was found: {found.message}."
        )
    return {
        **_with_path(found.path, found),
        "bound": json_number(bound),
        "tube": None if last is None or runs is None else _tube(problem, last, runs),
    }


def _tube(problem: Problem, last: tuple[int, int], runs: WholeArray) -> list[float]:
    """
    Return a tube as rectangles, x, y, width, height, …, map units.

    No path that leaves it is better than the known one.
    """
    low, high = np.reshape(problem.bounds, (2, 2))
    steps = (high - low) / np.array(last)
    rows, first, end = runs.T
    corners = np.stack([first - 0.5, rows - 0.5, end - 0.5, rows + 0.5], axis=1) * np.tile(steps, 2) + np.tile(low, 2)
    corners = np.clip(corners, np.tile(low, 2), np.tile(high, 2))
    corners[:, 2:] -= corners[:, :2]
    # as precise as a picture shows them
    digits = 5 - math.ceil(math.log10(float((high - low).max())))
    return as_flat(corners.round(digits))


def solved(scenario: Scenario, solution: Solution) -> dict[str, Any]:
    """Return a solver's answer."""
    if not solution.status.has_path:
        why = solution.message or solution.status.value
        return {**nothing(why), "seconds": json_number(solution.seconds)}
    found = _with_path(solution.path, scenario.problem.evaluate(solution.path))
    return {**found, "seconds": json_number(solution.total_seconds), "message": solution.message}


def offered() -> list[dict[str, Any]]:
    """
    List the solvers that the page offers beside hybrid: all that can run here; none is imported.

    Examples
    --------
    >>> offered()[0]["name"], offered()[0]["fast"]
    ('cgla', True)
    """
    built_in = [listing.describe(name) for name in listing.built_in() if name != "hybrid"]
    found = [
        {"name": one["name"], "summary": one["summary"], "fast": one["name"] in FAST}
        for one in built_in
        if one["available"] == "yes"
    ]
    others = [name for name in listing.plug_ins() if name not in listing.built_in()]
    return [*found, *({"name": name, "summary": "a plug-in", "fast": False} for name in others)]


def with_seed(entrant: Entrant) -> int | None:
    """Return the seed of a random solver: always the same, so that only changes of the map change its path."""
    return 1 if registry.traits(entrant.name).seeded and "seed" not in entrant.settings else None

"""The exact optimum on a lattice in space and time: every place at every tick, joined with all within reach."""

import math
from dataclasses import dataclass, field

import numpy as np

from cgla_graph._types import FloatArray, IntArray
from cgla_graph._validate import positive_number, whole_number
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solution import Status
from cgla_graph.solvers.timed.found_flight import FoundFlight
from cgla_graph.solvers.timed.joining import at_once, flight_times, joined_costs, joined_rows, leg_costs
from cgla_graph.timed.timed_problem import TimedProblem

#: Costs are equal if they differ by less than this part.
SAME = 1e-12


def plan_on_lattice(problem: TimedProblem, resolution: int = 16, ticks: int = 60, reach: float = 5.0) -> FoundFlight:
    """
    Find the flight of least cost on a graph of places and ticks.

    Parameters
    ----------
    problem
        A timed problem, in wind that does not change.
    resolution
        Points a side of the lattice over the bounds; the start is a node too. From 2 to 100.
    ticks
        How many of them the straight flight to the goal takes; from 1 to 10 000.
    reach
        Flights go from a node to those within so many steps of the lattice, and to itself: each takes the least number
        of ticks that it can, with a bend that takes up the rest. From every node, the last one goes straight to the
        goal, at any time. Infinite: the complete graph.
    """
    whole_number("resolution", resolution, at_least=2, at_most=100)
    whole_number("ticks", ticks, at_least=1, at_most=10_000)
    if reach != math.inf:
        positive_number("reach", reach)
    return at_once(problem) or _Search(problem, resolution, ticks, reach).run()


@dataclass
class _Search:
    """Labels of nodes, one layer of time after the other."""

    problem: TimedProblem
    resolution: int
    ticks: int
    reach: float
    labels: dict[int, FloatArray] = field(default_factory=dict)
    came: dict[tuple[int, int], tuple[int, int]] = field(default_factory=dict)
    evaluations: int = 0

    def __post_init__(self) -> None:
        problem = self.problem
        lattice = Lattice(self.resolution, bounds=problem.bounds)
        self.places = np.vstack([problem.start, lattice.points])
        (span,) = flight_times(problem, np.array([problem.start]), np.array([problem.goal]))
        x_min, y_min, x_max, y_max = problem.bounds
        across = math.hypot(x_max - x_min, y_max - y_min) / problem.speed
        self.tick = (span if 0.0 < span < math.inf else across) / self.ticks
        events = problem.events[np.isfinite(problem.events)]
        last = max([problem.departures[1], *events.tolist()]) + 4.0 * across
        last = last if problem.latest is None else min(last, problem.latest)
        self.layers = math.ceil((last - problem.departures[0]) / self.tick)
        step = max(x_max - x_min, y_max - y_min) / (self.resolution - 1)
        far = np.hypot(*(self.places[:, None] - self.places[None]).T).T
        firsts, lasts = np.nonzero(far <= self.reach * step * (1.0 + SAME))
        needed = flight_times(problem, self.places[firsts], self.places[lasts]) / self.tick
        with_flight = np.isfinite(needed)
        self.firsts, self.lasts = firsts[with_flight], lasts[with_flight]
        # (at least one tick: a loop, or a wait)
        self.taken: IntArray = np.maximum(np.ceil(needed[with_flight] * (1.0 - SAME)), 1).astype(np.int64)
        self.to_goal = flight_times(problem, self.places, np.tile(problem.goal, (len(self.places), 1)))

    def run(self) -> FoundFlight:
        """Search forwards in time; nothing is expanded that cannot be better than the best flight known."""
        problem, best, end = self.problem, math.inf, (0, 0)
        first, last = problem.departures
        for layer in range(self.layers + 1):
            label = self.labels.pop(layer, np.full(len(self.places), math.inf))
            departs = layer * self.tick <= (last - first) * (1.0 + SAME)
            if departs:
                # (places are not left before the departure, so that nothing was cheaper)
                label[0] = 0.0
                self.came.pop((layer, 0), None)
            elif not self.labels and not np.isfinite(label).any():
                break
            here = np.nonzero(label + problem.speed * self.to_goal < best)[0]
            if not len(here):
                continue
            states = self._states(layer, here)
            goals = np.column_stack([states[:, 0] + self.to_goal[here], np.tile(problem.goal, (len(here), 1))])
            total = label[here] + leg_costs(problem, states, goals)
            total[goals[:, 0] > (math.inf if problem.latest is None else problem.latest)] = math.inf
            if total.min() < best:
                best, end = float(total.min()), (layer, int(here[total.argmin()]))
            self._expand(label, here, layer, best)
        shape = f"a lattice of {self.resolution} x {self.resolution} places and ticks of {self.tick:.3g}"
        if math.isinf(best):
            return FoundFlight(Status.NOT_FOUND, evaluations=self.evaluations, message=f"there is none on {shape}")
        arrival = self._states(end[0], [end[1]])[0, 0] + self.to_goal[end[1]]
        flight = [np.array([arrival, *problem.goal])]
        if self.to_goal[end[1]] > 0.0:
            flight.insert(0, self._states(end[0], [end[1]])[0])
        while end in self.came:
            end = self.came[end]
            flight.insert(0, self._states(end[0], [end[1]])[0])
        rows = joined_rows(problem, flight)
        return FoundFlight(Status.FOUND, rows, evaluations=self.evaluations, message=f"the best on {shape}")

    def _states(self, layer: int | IntArray, nodes: IntArray | list[int]) -> FloatArray:
        places = self.places[nodes]
        return np.column_stack([self.problem.departures[0] + np.full(len(places), layer) * self.tick, places])

    def _expand(self, label: FloatArray, here: IntArray, layer: int, best: float) -> None:
        """Improve the labels of all that is joined with nodes of a layer."""
        joined = np.nonzero(np.isin(self.firsts, here))[0]
        firsts, lasts, taken = self.firsts[joined], self.lasts[joined], self.taken[joined]
        least = label[firsts] + self.problem.speed * (taken * self.tick + self.to_goal[lasts])
        worth = (least < best) & (layer + taken <= self.layers)
        # (where it is cheaper to wait, this is no bound)
        worth |= (firsts == lasts) & (layer + taken <= self.layers)
        firsts, lasts, taken = firsts[worth], lasts[worth], taken[worth]
        costs = label[firsts] + joined_costs(
            self.problem, self._states(layer, firsts), self._states(layer + taken, lasts)
        )
        self.evaluations += len(costs)
        # (of each state the cheapest way there, of equal ones the first)
        order = np.argsort(costs, kind="stable")
        order = order[costs[order] < math.inf]
        order = order[np.unique(taken[order] * len(self.places) + lasts[order], return_index=True)[1]]
        for ticks in np.unique(taken[order]):
            to, ways = layer + int(ticks), order[taken[order] == ticks]
            if to not in self.labels:
                self.labels[to] = np.full(len(self.places), math.inf)
            ways = ways[costs[ways] < self.labels[to][lasts[ways]]]
            self.labels[to][lasts[ways]] = costs[ways]
            for last, before in zip(lasts[ways].tolist(), firsts[ways].tolist(), strict=True):
                self.came[to, last] = layer, before

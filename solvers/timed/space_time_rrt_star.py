"""RRT* in space-time: states have a place and a time, so that joining them again changes nothing that follows."""

import math

import numpy as np

from cgla_graph._types import FloatArray, IntArray
from cgla_graph._validate import whole_number
from cgla_graph.model.solution import Status
from cgla_graph.solvers.timed.found_flight import FoundFlight
from cgla_graph.solvers.timed.joining import at_once, flight_times, joined_costs, joined_rows, leg_costs
from cgla_graph.timed.timed_problem import TimedProblem

#: Parts of the samples that are later departures, and that dawdle by up to half of the straight flight.
ROOTS, DAWDLES, LATER = 0.05, 0.2, 0.5


def plan_by_rrt_star(problem: TimedProblem, samples: int = 3000, seed: int = 0) -> FoundFlight:
    """
    Grow a tree of states from the start, and join states again where that costs less (Karaman and Frazzoli, 2011).

    A state is a place and a time. It is reached straight, or with a bend that takes up the time that is left.

    Parameters
    ----------
    problem
        A timed problem, in wind that does not change.
    samples
        Places that are drawn, from 1 to a million.
    seed
        Of the draws.
    """
    whole_number("samples", samples, at_least=1, at_most=1_000_000)
    whole_number("seed", seed, at_least=0, at_most=2**63 - 1)
    return at_once(problem) or _Tree(problem, samples).grown(np.random.default_rng(seed))


class _Tree:
    """The tree, its roots the departures."""

    def __init__(self, problem: TimedProblem, samples: int) -> None:
        self.problem, self.samples, self.size = problem, samples, 0
        self.states = np.empty((samples + 2, 3))
        self.costs = np.empty(samples + 2)
        self.parents = np.full(samples + 2, -1)
        self.to_goal: dict[int, float] = {}
        self.best, self.evaluations = math.inf, 0
        for departure in dict.fromkeys(problem.departures):
            self._add(np.array([departure, *problem.start]), 0.0, -1)

    def grown(self, rng: np.random.Generator) -> FoundFlight:
        """Grow it, and return its best flight."""
        problem = self.problem
        first, last = problem.departures
        low, high = np.reshape(problem.bounds, (2, 2))
        span = float(flight_times(problem, np.array([problem.start]), np.array([problem.goal]))[0])
        for _ in range(self.samples):
            place, chance, more = rng.uniform(low, high), rng.random(), rng.uniform(0.0, LATER)
            if first < last and chance < ROOTS:
                self._add(np.array([first + (last - first) * more / LATER, *problem.start]), 0.0, -1)
            else:
                self._extend(place, more * span if chance > 1.0 - DAWDLES and span < math.inf else 0.0)
        message = f"a tree of {self.size} states"
        if not self.to_goal:
            return FoundFlight(Status.NOT_FOUND, evaluations=self.evaluations, message=f"no flight on {message}")
        at = min(self.to_goal, key=lambda one: self.costs[one] + self.to_goal[one])
        states = [self._goal(at)]
        while at >= 0:
            states.insert(0, self.states[at])
            at = int(self.parents[at])
        return FoundFlight(Status.FOUND, joined_rows(problem, states), evaluations=self.evaluations, message=message)

    def _extend(self, place: FloatArray, dawdle: float) -> None:
        """Add a state at a place, reached as it costs least, and join its neighbours again."""
        problem = self.problem
        near = self._near(place)
        firsts = self.states[near]
        taken = flight_times(problem, firsts[:, 1:], np.tile(place, (len(near), 1)))
        lasts = np.column_stack([firsts[:, 0] + taken + dawdle, np.tile(place, (len(near), 1))])
        found = np.isfinite(taken) & (taken > 0.0)
        near, firsts, lasts = near[found], firsts[found], lasts[found]
        if not len(near):
            return
        costs = self.costs[near] + joined_costs(problem, firsts, lasts)
        self.evaluations += 2 * len(near)
        i = int(costs.argmin())
        rest = problem.speed * float(flight_times(problem, place[None], np.array([problem.goal]))[0])
        if not costs[i] + rest < self.best:
            return
        new = self._add(lasts[i], float(costs[i]), int(near[i]))
        later = near[firsts[:, 0] > lasts[i, 0]]
        later = later[self.parents[later] >= 0]
        if not len(later):
            return
        again = self.costs[new] + joined_costs(problem, np.tile(lasts[i], (len(later), 1)), self.states[later])
        for one, cost in zip(later, again, strict=True):
            if cost < self.costs[one]:
                self._lower(int(one), float(cost) - float(self.costs[one]))
                self.parents[one] = new

    def _near(self, place: FloatArray) -> IntArray:
        """Return the states nearest to a place: about as many as RRT* asks for, of those that may be of use."""
        far = np.hypot(*(self.states[: self.size, 1:] - place).T)
        count = min(self.size, math.ceil(2.0 * math.e * math.log(self.size + 1.0)))
        return np.argpartition(far, count - 1)[:count]

    def _add(self, state: FloatArray, cost: float, parent: int) -> int:
        at, self.size = self.size, self.size + 1
        self.states[at], self.costs[at], self.parents[at] = state, cost, parent
        goal = self._goal(at)
        if self.problem.latest is None or goal[0] <= self.problem.latest:
            last = float(leg_costs(self.problem, state[None], goal[None])[0])
            if math.isfinite(last):
                self.to_goal[at] = last
                self.best = min(self.best, cost + last)
        return at

    def _goal(self, at: int) -> FloatArray:
        """Return the goal at the time at which a state reaches it straight."""
        goal = np.array([self.problem.goal])
        taken = flight_times(self.problem, self.states[at : at + 1, 1:], goal)
        return np.array([self.states[at, 0] + taken[0], *self.problem.goal])

    def _lower(self, at: int, by: float) -> None:
        """Lower the costs of a state and of all that follow it."""
        following = np.array([at])
        while len(following):
            self.costs[following] += by
            following = np.nonzero(np.isin(self.parents[: self.size], following))[0]

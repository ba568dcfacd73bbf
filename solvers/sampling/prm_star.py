"""PRM* over the exact segment cost, in numpy and scipy: a random roadmap that grows."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import shapely
from scipy import sparse
from scipy.spatial import cKDTree

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Evaluations, Positive, Seed, Whole
from cgla_graph.solvers.budget import Budgeted, Incumbent, Meter
from cgla_graph.solvers.shortest_paths import least_cost_tree, path_to

#: The roadmap is searched when it has this many milestones, twice, four times … as many, and at its end.
FIRST_SEARCH = 64
#: Milestones placed, joined and weighed at a time; only a budget of seconds depends on it.
CHUNK = 256
#: Samples drawn at a time.
DRAWN = 1024
#: After so many samples in a row inside no-fly areas, the map counts as having no free place.
MAX_REJECTIONS = 100_000


@dataclass(frozen=True)
class PrmStar(Budgeted):
    """
    PRM* (Karaman, Frazzoli, IJRR 30(7), 2011): uniform random milestones, each joined to those nearby.

    The roadmap begins with start and goal. Milestone ``i`` is joined to every earlier one within

    ``r(i) = radius_factor * 2 sqrt(3/2) sqrt(free / pi) sqrt(log(i) / i)``,

    ``free`` being the area outside of the no-fly areas: the radius of their Section 3.3 for dimension 2. PRM* proper
    joins all milestones within the last, smallest radius; its edges are among those of this roadmap, which therefore
    has the same limit, and which never loses an edge while it grows. So the best cost only falls, and the result does
    not depend on when the roadmap was searched in between.

    Attributes
    ----------
    milestones
        Budget: size of the roadmap, start and goal included, at least 2; None: no limit. It is the default budget, so
        that a seed gives the same path on every machine.
    seconds
        Budget of time, in seconds; None: no limit. It is checked every 256 milestones and before every search, and
        exceeded by at most one of either. Once it ends the run, the same seed may give another path each time.
    evaluations
        Budget of segments weighed by Eq. 5; None: no limit. The milestone that reaches it is joined as a whole.
        The budget that is used up first ends the run.
    seed
        From 0 to 2^32 - 1.
    radius_factor
        Above 1, the cost converges to the optimum with probability 1.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.

    Examples
    --------
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9))
    >>> PrmStar(milestones=200, seed=1).solve(problem).status.label
    'found'
    """

    milestones: Annotated[int, Whole(2)] | None = 2000
    seconds: Positive | None = None
    evaluations: Evaluations | None = None
    seed: Seed = 1
    radius_factor: Positive = 1.1

    traits: ClassVar[Traits] = Traits(
        "prm-star", "PRM* roadmap over the same cost", domain="plane", anytime=True, seeded=True, needs_positive=True
    )
    counted: ClassVar[str] = "milestones"

    def solve(self, problem: Problem) -> Solution:
        """Grow the roadmap, and search it each time that it has doubled."""
        meter = self.budget.start()
        incumbent = Incumbent(problem, meter)
        roadmap = Roadmap(problem, self.seed, self.radius_factor)
        size = FIRST_SEARCH
        while not meter.spent and not roadmap.full:
            roadmap.grow(meter, size)
            # when time is up, another search would only exceed it more
            if not meter.late:
                path, cost = roadmap.best_path()
                if math.isfinite(cost):
                    incumbent.offer(path, cost)
            size *= 2
        reason = meter.spent or "no free place for more"
        return incumbent.solution(f"{roadmap.n_milestones} milestones do not join start and goal ({reason})")


class Roadmap:
    """
    A random geometric graph that grows: milestones 0 and 1 are start and goal.

    Attributes
    ----------
    positions
        The milestones, then samples for the next ones, shape ``(m, 2)`` with ``m >= n_milestones``, map units.
    n_milestones
        Milestones that have been joined.
    full
        Whether no free place was found for more milestones.

    Examples
    --------
    >>> from cgla_graph.solvers.budget import Budget
    >>> roadmap = Roadmap(Problem(start=(0.1, 0.1), goal=(0.9, 0.9)), seed=1, radius_factor=1.1)
    >>> roadmap.grow(Budget(iterations=100).start(), 100)
    >>> roadmap.n_milestones, bool(roadmap.best_path()[1] < 1.2)
    (100, True)
    """

    def __init__(self, problem: Problem, seed: int, radius_factor: float) -> None:
        """Place start and goal."""
        self.problem = problem
        self.positions = np.array([problem.start, problem.goal])
        self.n_milestones = 1
        self.full = False
        self._rng = np.random.default_rng(seed)
        free = shapely.box(*problem.bounds).difference(problem.model.area.geometry).area
        self._reach = radius_factor * 2.0 * math.sqrt(1.5) * math.sqrt(free / math.pi)
        self._edges: list[tuple[IntArray, IntArray, FloatArray]] = []

    def radius(self, number: FloatArray | IntArray) -> FloatArray:
        """
        Return how far the milestone that is the ``number``-th is joined, map units; any shape.

        ``log(i) / i`` rises up to 3, from where on the radius has to fall.
        """
        number = np.maximum(number, 3)
        return np.asarray(self._reach * np.sqrt(np.log(number) / number))

    def grow(self, meter: Meter, size: int) -> None:
        """
        Place and join milestones until there are `size`, or the budget is spent.

        Parameters
        ----------
        meter
            Is charged an iteration for each milestone and an evaluation for each segment.
        size
            How many milestones to have in the end.
        """
        self._place(int(min(size, meter.max_iterations)))
        last = int(min(size, meter.max_iterations, len(self.positions)))
        tree = cKDTree(self.positions[:last])
        while self.n_milestones < last and not meter.spent:
            self._join(meter, tree, min(self.n_milestones + CHUNK, last))
            meter.iterations = self.n_milestones

    def best_path(self) -> tuple[FloatArray, float]:
        """Search the roadmap by Dijkstra's algorithm; return waypoints, shape ``(m, 2)``, and cost (infinity: none)."""
        tails, heads, weights = (np.concatenate(parts) for parts in zip(*self._edges, strict=True))
        n = self.n_milestones
        matrix = sparse.csr_array((weights, (heads, tails)), shape=(n, n))
        costs, before = least_cost_tree(matrix, 0, directed=False)
        if not np.isfinite(costs[1]):
            return np.empty((0, 2)), math.inf
        return self.positions[path_to(1, before)], float(costs[1])

    def _place(self, size: int) -> None:
        """Draw samples outside of the no-fly area until there are at least `size` positions in all."""
        low, high = np.reshape(self.problem.bounds, (2, 2))
        found, missing, rejections = [self.positions], size - len(self.positions), 0
        while missing > 0 and not self.full:
            # many at a time, as few may be free; those to spare are the next milestones
            drawn = np.minimum(low + self._rng.random((DRAWN, 2)) * (high - low), high)
            found.append(drawn[~self.problem.model.area.contains(drawn)])
            missing -= len(found[-1])
            rejections = 0 if len(found[-1]) else rejections + DRAWN
            self.full = rejections >= MAX_REJECTIONS
        self.positions = np.concatenate(found)

    def _join(self, meter: Meter, tree: cKDTree, size: int) -> None:
        """Weigh the segments from each new milestone to the earlier ones in its reach, milestone after milestone."""
        points, old = self.positions, self.n_milestones
        reach = self.radius(np.arange(size) + 1)
        # a little more than the widest of them: which are near enough is judged below, the same for every `size`
        search = float(reach[old:].max()) * (1.0 + 1e-9)
        near = cKDTree(points[old:size]).sparse_distance_matrix(tree, search, output_type="coo_matrix")
        heads, tails = near.row.astype(np.int64) + old, near.col.astype(np.int64)
        chosen = tails < heads
        heads, tails = heads[chosen], tails[chosen]
        chosen = np.hypot(*(points[heads] - points[tails]).T) <= reach[heads]
        order = np.lexsort((tails[chosen], heads[chosen]))
        heads, tails = heads[chosen][order], tails[chosen][order]
        # the budget buys whole milestones; the one that reaches it is the last
        ends = np.searchsorted(heads, np.arange(old, size), side="right")
        n_joined = int(np.searchsorted(ends, meter.max_evaluations - meter.evaluations)) + 1
        if n_joined < len(ends):
            size = old + n_joined
            heads, tails = heads[: ends[n_joined - 1]], tails[: ends[n_joined - 1]]
        weights = self.problem.model.weights(points[heads], points[tails])
        meter.evaluations += len(weights)
        passable = np.isfinite(weights)
        self._edges.append((tails[passable], heads[passable], weights[passable]))
        self.n_milestones = size

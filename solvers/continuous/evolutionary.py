"""Differential evolution of B-splines: an evolutionary path planner in the style of Nikolos and others."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import shapely
from scipy.interpolate import BSpline

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Between, Count, Evaluations, NonNegative, Positive, Seed, Whole
from cgla_graph.solvers.budget import Budgeted, Incumbent

#: The cost of a path cannot be less than the distance; nearer to it than this, nothing is left to gain.
ROUNDING = 1e-12
#: A mutant is made of three others.
LEAST_POPULATION = 4
#: Cubic: the curvature is continuous.
DEGREE = 3


@dataclass(frozen=True)
class Evolutionary(Budgeted):
    """
    Evolves the control points of cubic B-splines by differential evolution (DE/rand/1/bin).

    **Public of the original.** Nikolos, Zografos and Brintaki ("UAV path planning using evolutionary algorithms",
    2007) evolve the control points of B-spline curves by the differential evolution of Storn and Price (1997), and
    rate a curve by its points inside obstacles, its length, its distance to obstacles and its least radius of
    curvature, in a weighted sum. Their code, terrain and weights are not public: this is *in the style of* theirs.

    **Our design.** A curve is rated by what all solvers minimise, ``length + k * risk`` of the polyline through its
    points. Constraints are no terms of a sum, whose weights one would have to guess, but come first (the rule of
    Deb 2000): of two curves, the one with less length inside no-fly areas wins; then the one that turns less tightly
    than `turn_radius`; then the cheaper one. Control points stay inside the bounds, and so do the curves. The first
    generation is the straight line, and curves through random points, which for every other curve are sorted along
    the way from start to goal. A mutant beyond the bounds comes back halfway between them and its parent.

    **Known failure modes.** A few control points cannot follow a maze, nor pass between obstacles of which each
    forces a turn; then the answer is ``not-found``, although there is a path. It converges to a local optimum: which
    one depends on the seed. A curve is smooth where the best path has a corner.

    `Solution.evaluations` counts the segments weighed, `segments` for each curve.

    Attributes
    ----------
    generations
        Budget: how often each curve of the population meets a rival; None: no limit. It is the default budget, so
        that a seed gives the same path on every machine.
    seconds
        Budget of time, in seconds, looked at between generations; None: no limit. Once it ends the run, the same seed
        may give another path each time.
    evaluations
        Budget of segments weighed by Eq. 5; None: no limit. The generation that reaches it is completed.
    seed
        From 0 to 2^32 - 1.
    population
        Curves, at least 4.
    control_points
        Of a curve, between start and goal, at least 1.
    segments
        Of the polyline that stands for a curve.
    scale
        How far a mutant goes along the difference of two others (the literature's F).
    crossover
        The chance of each coordinate to come from the mutant instead of the parent (CR), above 0 and at most 1.
    turn_radius
        Least radius of curvature of the path, map units; 0: no limit.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or the budget has no limit.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> answer = Evolutionary(seed=3).solve(problem)
    >>> 1.35 < answer.cost < 1.38
    True
    """

    generations: Count | None = 150
    seconds: Positive | None = None
    evaluations: Evaluations | None = None
    seed: Seed = 1
    population: Annotated[int, Whole(LEAST_POPULATION, 10_000)] = 40
    control_points: Annotated[int, Whole(1, 1000)] = 6
    segments: Annotated[int, Whole(2, 10_000)] = 64
    scale: Positive = 0.6
    crossover: Annotated[float, Between(0.0, 1.0, above=True)] = 0.9
    turn_radius: NonNegative = 0.0

    traits: ClassVar[Traits] = Traits(
        "evolutionary",
        "differential evolution of B-splines",
        domain="plane",
        anytime=True,
        seeded=True,
        complete=False,
        needs_positive=True,
    )
    counted: ClassVar[str] = "generations"

    def solve(self, problem: Problem) -> Solution:
        """Evolve until the budget is spent, or there is nothing left to gain."""
        meter = self.budget.start()
        incumbent = Incumbent(problem, meter)
        curves = _Curves(problem, self.control_points, self.segments, self.turn_radius)
        rng = np.random.default_rng(self.seed)
        genes = curves.first(self.population, rng)
        ratings = curves.rate(genes)
        meter.evaluations += curves.n_segments(genes)
        best = self._offered(incumbent, curves, genes, ratings)
        least = math.dist(problem.start, problem.goal) * (1.0 + ROUNDING)
        while not meter.spent and incumbent.cost > least:
            trials = self._trials(genes, rng)
            rivals = curves.rate(trials)
            meter.iterations += 1
            meter.evaluations += curves.n_segments(trials)
            wins = _is_better(rivals, ratings)
            genes[wins], ratings[wins] = trials[wins], rivals[wins]
            best = self._offered(incumbent, curves, genes, ratings)
        crossed, bent, _ = ratings[best]
        fault = f"crosses {crossed:.3g} of no-fly areas" if crossed > 0.0 else f"turns too tightly, by {bent:.3g}"
        return incumbent.solution(f"the best curve of {meter.iterations} generations {fault}")

    def _offered(self, incumbent: Incumbent, curves: "_Curves", genes: FloatArray, ratings: FloatArray) -> int:
        """Offer the best of the population, if it may be flown; return its number."""
        best = int(np.lexsort(ratings.T[::-1])[0])
        crossed, bent, cost = ratings[best]
        if crossed == bent == 0.0 and cost < incumbent.cost:
            path = curves.points(genes[best : best + 1])[0]
            incumbent.offer(path, incumbent.problem.evaluate(path).cost)
        return best

    def _trials(self, genes: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return a rival for each: another one plus the scaled difference of two more, crossed with the parent."""
        n, length = genes.shape
        order = rng.random((n, n))
        np.fill_diagonal(order, np.inf)
        # the first three of a random order of the others
        a, b, c = np.argsort(order, axis=1)[:, :3].T
        mutants = genes[a] + self.scale * (genes[b] - genes[c])
        mutants = np.where(mutants < 0.0, 0.5 * genes, np.where(mutants > 1.0, 0.5 * (1.0 + genes), mutants))
        taken = rng.random((n, length)) < self.crossover
        # at least one coordinate is the mutant's
        taken[np.arange(n), rng.integers(length, size=n)] = True
        return np.where(taken, mutants, genes)


class _Curves:
    """B-splines of one problem; the genes of a curve are its free control points, over the bounds."""

    def __init__(self, problem: Problem, free: int, segments: int, turn_radius: float) -> None:
        self.problem = problem
        self.free, self.segments, self.turn_radius = free, segments, turn_radius
        self.low, self.high = np.reshape(problem.bounds, (2, 2))
        self.bases = [basis(free + 2, segments + 1, derivative=order) for order in range(3)]
        self.ends = np.array([problem.start, problem.goal])

    def first(self, population: int, rng: np.random.Generator) -> FloatArray:
        """Return the first generation, shape ``(population, 2 * free)``, in [0, 1]."""
        start, goal = (self.ends - self.low) / (self.high - self.low)
        places = rng.random((population, self.free, 2))
        # a loop is shorter untied; every other curve may begin with one, as the way out of a trap does
        along = np.argsort(places[::2] @ (goal - start), axis=1)
        places[::2] = np.take_along_axis(places[::2], along[:, :, None], axis=1)
        parts = np.arange(1, self.free + 1)[:, None] / (self.free + 1)
        places[0] = start + parts * (goal - start)
        return np.clip(places, 0.0, 1.0).reshape(population, -1)

    def n_segments(self, genes: FloatArray) -> int:
        """Count the segments of some curves."""
        return len(genes) * self.segments

    def controls(self, genes: FloatArray) -> FloatArray:
        """Return control points, shape ``(n, free + 2, 2)``, map units."""
        free = self.low + genes.reshape(len(genes), self.free, 2) * (self.high - self.low)
        ends = np.broadcast_to(self.ends[:, None, None], (2, len(genes), 1, 2))
        return np.concatenate([ends[0], free, ends[1]], axis=1)

    def points(self, genes: FloatArray) -> FloatArray:
        """Return the polylines, shape ``(n, segments + 1, 2)``, map units."""
        points: FloatArray = np.clip(self.bases[0] @ self.controls(genes), self.low, self.high)
        points[:, [0, -1]] = self.ends
        return points

    def rate(self, genes: FloatArray) -> FloatArray:
        """
        Rate curves; less is better, the first column first.

        Parameters
        ----------
        genes
            Shape ``(n, 2 * free)``.

        Returns
        -------
        ratings
            Shape ``(n, 3)``, map units: the length inside no-fly areas; the length times how much more it turns
            there than it may; the cost, infinite if it crosses an area.
        """
        points = self.points(genes)
        starts, ends = points[:, :-1].reshape(-1, 2), points[:, 1:].reshape(-1, 2)
        costs = self.problem.model.weights(starts, ends).reshape(len(genes), -1).sum(axis=1)
        crossed = np.zeros(len(genes))
        blocked = np.isinf(costs)
        if blocked.any():
            inside = shapely.intersection(shapely.linestrings(points[blocked]), self.problem.model.area.geometry)
            # the area's own test is exact, this length is rounded, and may be 0
            crossed[blocked] = np.maximum(shapely.length(inside), np.finfo(np.float64).tiny)
        return np.column_stack([crossed, self._bent(genes), costs])

    def _bent(self, genes: FloatArray) -> FloatArray:
        """Return the integral of the excess curvature, times the turn radius, shape ``(n,)``, map units."""
        if self.turn_radius == 0.0:
            return np.zeros(len(genes))
        controls = self.controls(genes)
        velocity, acceleration = self.bases[1] @ controls, self.bases[2] @ controls
        excess = np.maximum(self.turn_radius * curvature(velocity, acceleration) - 1.0, 0.0)
        speed = np.hypot(velocity[..., 0], velocity[..., 1])
        # where a curve stands still it turns on the spot
        bent: FloatArray = np.where(np.isinf(excess), np.inf, excess * speed).mean(axis=1)
        return bent


def _is_better(rivals: FloatArray, ratings: FloatArray) -> BoolArray:
    """Compare row by row, the first column first; a tie is a win, so that the population drifts over plateaus."""
    better = rivals[:, -1] <= ratings[:, -1]
    for column in reversed(range(rivals.shape[1] - 1)):
        new, old = rivals[:, column], ratings[:, column]
        better = (new < old) | ((new == old) & better)
    return np.asarray(better)


def basis(n_controls: int, n_points: int, *, derivative: int = 0) -> FloatArray:
    """
    Return the weights of control points in points of a clamped uniform B-spline, cubic if there are enough.

    A curve begins at its first control point and ends at its last, along the lines to their neighbours, and stays in
    the convex hull of all (Piegl, Tiller: The NURBS Book, 1997, chapter 3).

    Parameters
    ----------
    n_controls
        Control points, at least 2; with fewer than 4, the degree is one less than that.
    n_points
        Points on the curve, at least 2, evenly spaced in the parameter, which runs from 0 to 1.
    derivative
        Of the curve, by its parameter: 0 is the curve itself.

    Returns
    -------
    matrix
        Shape ``(n_points, n_controls)``: ``matrix @ controls`` are points (or derivatives there).

    Examples
    --------
    >>> basis(4, 3) @ [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]
    array([[0.  , 0.  ],
           [0.5 , 0.75],
           [1.  , 0.  ]])
    """
    degree = min(DEGREE, n_controls - 1)
    inner = np.linspace(0.0, 1.0, n_controls - degree + 1)
    knots = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    curve = BSpline(knots, np.eye(n_controls), degree)
    return np.asarray(curve(np.linspace(0.0, 1.0, n_points), nu=derivative), dtype=np.float64)


def curvature(velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
    """
    Return the curvature of curves from their first two derivatives, one over map units.

    Parameters
    ----------
    velocity, acceleration
        Shape ``(..., 2)``, by any parameter.

    Returns
    -------
    curvature
        Shape ``(...)``, at least 0; infinite where the curve stands still.

    Examples
    --------
    >>> float(curvature(np.array([0.0, 2.0]), np.array([-2.0, 0.0])))
    0.5
    """
    cross = velocity[..., 0] * acceleration[..., 1] - velocity[..., 1] * acceleration[..., 0]
    speed = np.hypot(velocity[..., 0], velocity[..., 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        bent = np.abs(cross) / speed**3
    return np.where(speed > 0.0, bent, np.inf)

"""An elastic chain of virtual masses: springs pull it straight, risk pushes it away, until it is at rest."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._types import BoolArray, Bounds, FloatArray
from cgla_graph._validate import point_array
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import Threat

#: The chain is at rest once no force on a mass exceeds this, relative to a spring's.
AT_REST = 1e-4
#: Steps of the integration, at most.
MOST_STEPS = 3000
#: No mass moves further in a step than this share of the least spread: it must not jump over a threat.
FURTHEST = 0.25
#: Threats narrower than this, over the shorter side of the map, fall between the masses anyway, and limit no step.
SPECK = 1e-3
#: So many spreads from its centre, a threat's risk is 0 in floating point.
VANISHED = 40.0


@dataclass(frozen=True, eq=False)
class Relaxation:
    """
    A chain at rest.

    Attributes
    ----------
    path
        Waypoints, shape ``(m, 2)``, map units: the chain's or the given path's, the cheaper of the two.
    steps
        Of the integration.
    evaluations
        Points at which ``F`` and its gradient were computed.
    at_rest
        Whether the forces balance, but for masses that a no-fly area or the border holds.
    """

    path: FloatArray
    steps: int
    evaluations: int
    at_rest: bool


def relaxed(problem: Problem, path: ArrayLike, *, masses: int = 50) -> Relaxation:
    r"""
    Let a path relax like a chain of masses with springs between them, its ends held.

    The idea is Bortoff's (ACC 2000), whose chain is pushed by forces that fall with the fourth power of the distance
    to a radar. Ours is pushed by ``-n grad n`` with ``n = 1 + k F``, the refractive index of the cost, so that a
    chain at rest is a stationary path of `Problem.evaluate`: with :math:`q` a chain of :math:`N` links,

    .. math:: A = N \sum |q_{i+1} - q_i|^2, \qquad B = \frac{1}{N} \sum n(q_i)^2, \qquad \sqrt{A B} \ge \int n\,ds

    by the inequality of Cauchy and Schwarz (up to the chain's fineness), with equality where links are as long as
    ``n`` is large; there the least product is the least cost. Springs pull by the gradient of ``A / 2``, risk pushes
    by that of :math:`\omega^2 B / 2` with :math:`\omega^2 = A / B`, which balances the two in the product.

    The motion is integrated by dynamic relaxation (Day 1965; Barnes 1999): the rest does not depend on the masses, so
    each is the stiffness around it, which makes steps of time 1 stable. Dampers are critical for the slowest
    vibration of the chain. A mass whose move would lead a link through a no-fly area stays, and none leaves the
    bounds.

    Parameters
    ----------
    problem
        The map to avoid; its field has to be a probability. Its start and goal play no part.
    path
        Waypoints, shape ``(m, 2)`` with ``m >= 2``, map units, feasible. All of them become masses.
    masses
        Masses between the ends, at least; they are spread evenly along the path.

    Returns
    -------
    relaxation
        Never more expensive than the path given.

    Raises
    ------
    ProblemError
        If the path is malformed.

    Examples
    --------
    A string without risk is pulled straight.

    >>> bent = [(0.1, 0.1), (0.2, 0.9), (0.9, 0.5)]
    >>> problem = Problem(bent[0], bent[-1])
    >>> round(problem.evaluate(relaxed(problem, bent).path).cost, 4), round(float(np.hypot(0.8, 0.4)), 4)
    (0.8944, 0.8944)
    """
    given = point_array("path", path)
    chain = _Chain(problem, _with_masses(given, masses))
    steps = 0
    while steps < MOST_STEPS and not chain.at_rest:
        chain.step()
        steps += 1
    found = min((chain.points, given), key=lambda points: problem.evaluate(points).cost)
    return Relaxation(found, steps, steps * (len(chain.points) - 2), chain.at_rest)


class _Chain:
    """The state of the integration."""

    def __init__(self, problem: Problem, points: FloatArray) -> None:
        self.problem = problem
        self.points = points
        self.velocity = np.zeros((len(points) - 2, 2))
        self.at_rest = len(points) <= 2  # noqa: PLR2004 - nothing between the ends
        self.low, self.high = np.reshape(problem.bounds, (2, 2))
        # the others have no effect on the map, and squares of their distance may overflow
        threats = [t for t in problem.field.threats if _apart(t, problem.bounds) <= VANISHED * t.spread]
        self.table = np.array([(t.x, t.y, t.spread, t.peak) for t in threats]).reshape(-1, 4)
        side = problem.shorter_side
        self.furthest = FURTHEST * min([side, *(t.spread for t in threats if t.spread >= SPECK * side)])

    def step(self) -> None:
        """Move all masses by one step of time 1."""
        force, mass, tension = self._forces()
        # critical for the slowest vibration of the chain, that of a string; the faster ones fade as fast
        slowest = math.pi * math.sqrt(1.0 / ((len(mass) + 1) * float(mass.mean())))
        velocity = (1.0 - min(2.0 * slowest, 1.0)) * self.velocity + force / mass[:, None]
        fastest = float(np.hypot(*velocity.T).max())
        velocity *= min(1.0, self.furthest / max(fastest, 1e-300))
        self.points, free = self._moved(self.points[1:-1] + velocity)
        # a held mass has no velocity, and no force on it counts
        velocity *= free
        force *= free
        self.velocity = velocity
        self.at_rest = float(np.hypot(*force.T).max()) <= AT_REST * tension

    def _moved(self, targets: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return the chain with its masses moved as far as they may, and which coordinates are free, ``(n, 2)``."""
        inside = np.clip(targets, self.low, self.high)
        points = np.vstack([self.points[:1], inside, self.points[-1:]])
        stays = np.zeros(len(targets), dtype=np.bool_)
        area = self.problem.model.area
        # a mass that stays may bring the link to its neighbour into the area, which then stays as well
        while not area.is_empty and (crossing := area.crosses(points[:-1], points[1:])).any():
            stays |= crossing[:-1] | crossing[1:]
            points[1:-1][stays] = self.points[1:-1][stays]
        return points, (inside == targets) & ~stays[:, None]

    def _forces(self) -> tuple[FloatArray, FloatArray, float]:
        """Return the forces, shape ``(n, 2)``, the stiffness around each mass, ``(n,)``, and a spring's force."""
        links = np.diff(self.points, axis=0)
        count = len(links)
        k, field, inner = self.problem.k, self.problem.field, self.points[1:-1]
        index = 1.0 + k * field.density(self.points)
        squared = index**2
        # the trapezoidal rule: the ends count by half
        mean = float(squared.sum() - 0.5 * (squared[0] + squared[-1])) / count
        stretch = count * float((links**2).sum())
        share = stretch / mean / count
        force = count * np.diff(links, axis=0) - share * k * index[1:-1, None] * field.gradient(inner)
        slope, bend = self._roughness(inner)
        stiffness = 4.0 * count + share * (k * index[1:-1] * (bend + slope**2) + (k * slope) ** 2)
        return force, stiffness, float(np.sqrt(stretch))

    def _roughness(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bound the slope and the curvature of the threats' sum at points, shape ``(n,)`` each."""
        x, y, spread, peak = self.table.T
        apart2 = (points[:, :1] - x) ** 2 + (points[:, 1:] - y) ** 2
        risk = peak * np.exp(-0.5 * apart2 / spread**2) / spread**2
        return (risk * np.sqrt(apart2)).sum(axis=1), (risk * (1.0 + apart2 / spread**2)).sum(axis=1)


def _apart(threat: Threat, bounds: Bounds) -> float:
    """Return how far a threat's centre is from the map, map units; 0 on it."""
    x_min, y_min, x_max, y_max = bounds
    east, north = (
        max(low - at, at - high, 0.0) for at, low, high in ((threat.x, x_min, x_max), (threat.y, y_min, y_max))
    )
    return math.hypot(east, north)


def _with_masses(path: FloatArray, masses: int) -> FloatArray:
    """Add waypoints evenly along a path, without bending it, so that there are at least so many between its ends."""
    path = path[np.append((np.diff(path, axis=0) != 0.0).any(axis=1), True)]
    lengths = np.hypot(*np.diff(path, axis=0).T)
    if not len(lengths):
        return path
    # every link of the path is cut into as many as its share of the length asks for, at least one
    parts = np.maximum(1, np.ceil((masses + 1) * lengths / lengths.sum())).astype(np.int64)
    cuts = [
        start + (end - start) * (np.arange(count) / count)[:, None]
        for start, end, count in zip(path[:-1], path[1:], parts, strict=True)
    ]
    return np.vstack([*cuts, path[-1:]])

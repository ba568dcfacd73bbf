"""A mixed-integer linear program of the next few steps of a path, among convex obstacles."""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy import sparse
from scipy.optimize import Bounds, LinearConstraint, milp

from cgla_graph._types import FloatArray
from cgla_graph.solvers.geometry import around_circle

#: Directions in which lengths are measured: the longest shadow of a step is its length, short by at most 2 %.
FACETS = 16
SHADOW = math.cos(math.pi / FACETS)
#: Hard obstacles are avoided by this much of the unit: more than the solver's own tolerance.
MARGIN = 1e-5
#: A program with more choices is not tried: the limit of nodes does not bound the time for the first of them.
MOST_CHOICES = 100


@dataclass(frozen=True, eq=False)
class KeepOut:
    """
    A convex obstacle, as the half-planes that lie beyond its sides: ``normals @ p >= offsets`` in at least one.

    Attributes
    ----------
    normals
        Outward ones of length 1, shape ``(m, 2)``.
    offsets
        Shape ``(m,)``, in the unit of the program.
    layers
        Of a soft obstacle, shape ``(l, 2)``: the thickness of its layers from the rim inwards, the last one without
        end, and the price of a unit of depth in each for a unit of length, which rises. Empty: it is hard.
    """

    normals: FloatArray
    offsets: FloatArray
    layers: FloatArray = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def is_soft(self) -> bool:
        """Whether it may be entered at a price."""
        return len(self.layers) > 0

    def beyond(self, points: FloatArray) -> FloatArray:
        """Return how far points are beyond each side, shape ``(n, 2)`` to ``(n, m)``; negative: inside of it."""
        return np.asarray(points @ self.normals.T - self.offsets)


@dataclass(frozen=True, eq=False)
class Horizon:
    """
    The decision variables: a few legs of bounded length, to one of some places.

    Lengths are in a unit of about the size of the map, and places relative to where the path begins.

    Attributes
    ----------
    legs
        How many.
    reach
        How long each may be.
    low, high
        Corners of the bounds, shape ``(2,)``.
    obstacles
        To keep out of.
    places
        Where the path may end, shape ``(c, 2)``.
    costs_to_go
        The costs to go from there, shape ``(c,)``.
    """

    legs: int
    reach: float
    low: FloatArray
    high: FloatArray
    obstacles: list[KeepOut]
    places: FloatArray
    costs_to_go: FloatArray


@dataclass(frozen=True, eq=False)
class Plan:
    """
    The solution of the program.

    Attributes
    ----------
    points
        The path, from where it begins over the ends of its legs, shape ``(legs + 1, 2)``.
    place
        The number of the place where it ends.
    objective
        The value that the solver minimised.
    """

    points: FloatArray
    place: int
    objective: float


def best_plan(horizon: Horizon, *, gap: float, nodes: int) -> Plan | None:
    """
    Solve the program: minimise length, the price of entering soft obstacles, and the cost to go from the end.

    Each leg is bounded by a 16-gon inside the circle of its reach, and as long as its longest shadow in 16 directions.
    Both ends of a leg lie beyond the same side of each obstacle, so that no leg cuts a corner between them (Richards,
    Turnbull, IJRNC 25(4), 2015); into a soft one it may go, for a price that depends on how deep, and is paid for a
    whole leg.

    Parameters
    ----------
    horizon
        The program to solve.
    gap
        The solver may stop this near to the optimum, relative to it.
    nodes
        The solver stops after so many nodes of its search tree.

    Returns
    -------
    plan
        None if the solver found none, or there are more than 100 choices to make.

    Examples
    --------
    Around a square of side 1, over two corners:

    >>> square = KeepOut(np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1]]), np.array([1.5, 0.5, -0.5, 0.5]))
    >>> box = np.array([-9.0, -9.0]), np.array([9.0, 9.0])
    >>> goal = np.array([[2.0, 0.25]])
    >>> plan = best_plan(Horizon(3, 2.0, *box, [square], goal, np.zeros(1)), gap=1e-6, nodes=100)
    >>> bool(square.beyond(plan.points).max(axis=1).min() >= 0.0), 2.2 < plan.objective < 2.3
    (True, True)
    """
    return _Program(horizon).solved(gap, nodes)


class _Program:
    """The variables and rows of the program, collected one after the other."""

    def __init__(self, horizon: Horizon) -> None:
        self.horizon = horizon
        self.costs: list[float] = []
        self.least: list[float] = []
        self.most: list[float] = []
        self.whole: list[int] = []
        self.entries: list[tuple[int, int, float]] = []
        self.right: list[float] = []
        # columns of x and y between the legs; the path begins at the origin and ends at a place, which have none
        self.bends = [
            [self._variable(0.0, horizon.low[i], horizon.high[i]) for i in range(2)] for _ in range(horizon.legs - 1)
        ]
        self.chosen = [self._variable(cost, 0.0, 1.0, whole=True) for cost in horizon.costs_to_go.tolist()]
        for sign in (1.0, -1.0):
            self._row([(column, sign) for column in self.chosen], sign)
        self._measure()
        for obstacle in horizon.obstacles:
            for leg in range(horizon.legs):
                self._keep_out(obstacle, leg)

    def solved(self, gap: float, nodes: int) -> Plan | None:
        horizon = self.horizon
        if sum(self.whole) > MOST_CHOICES:
            return None
        rows, columns, values = zip(*self.entries, strict=True)
        matrix = sparse.csr_array((values, (rows, columns)), shape=(len(self.right), len(self.costs)))
        answer = milp(
            self.costs,
            integrality=np.array(self.whole),
            bounds=Bounds(self.least, self.most),
            constraints=LinearConstraint(matrix, lb=np.array(self.right)),
            options={"mip_rel_gap": gap, "node_limit": nodes},
        )
        if answer.x is None:
            return None
        place = int(np.argmax(answer.x[self.chosen]))
        bends = answer.x[np.array(self.bends, dtype=np.int64).reshape(-1, 2)]
        points = np.vstack([np.zeros((1, 2)), bends, horizon.places[place : place + 1]])
        return Plan(points, place, float(answer.fun))

    def _variable(self, cost: float, least: float, most: float, *, whole: bool = False) -> int:
        self.costs.append(cost)
        self.least.append(least)
        self.most.append(most)
        self.whole.append(int(whole))
        return len(self.costs) - 1

    def _row(self, terms: list[tuple[int, float]], at_least: float) -> None:
        """Add ``sum(factor * variable) >= at_least``."""
        number = len(self.right)
        self.entries += [(number, column, factor) for column, factor in terms if factor != 0.0]
        self.right.append(at_least)

    def _at(self, number: int, normal: list[float]) -> list[tuple[int, float]]:
        """Return ``normal @ p`` where a leg begins, in terms of variables."""
        if number == 0:
            return []
        if number < self.horizon.legs:
            return list(zip(self.bends[number - 1], normal, strict=True))
        shadows = self.horizon.places @ normal
        return list(zip(self.chosen, shadows.tolist(), strict=True))

    def _measure(self) -> None:
        """Bind the lengths of the legs to their ends, and limit them."""
        horizon = self.horizon
        directions = around_circle(FACETS).tolist()
        for leg in range(horizon.legs):
            length = self._variable(1.0, 0.0, horizon.reach * SHADOW)
            for direction in directions:
                back = [(column, -factor) for column, factor in self._at(leg + 1, direction)]
                self._row([(length, 1.0), *self._at(leg, direction), *back], 0.0)

    def _range(self, number: int, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the least and greatest ``normal @ p`` that there can be where a leg begins, shape ``(m,)`` each."""
        horizon = self.horizon
        to_low, to_high = normals * horizon.low, normals * horizon.high
        # so many legs from the beginning, and so many from some place
        since, left = number * horizon.reach, (horizon.legs - number) * horizon.reach
        shadows = horizon.places @ normals.T
        lowest = np.maximum(np.minimum(to_low, to_high).sum(axis=1), shadows.min(axis=0) - left)
        highest = np.minimum(np.maximum(to_low, to_high).sum(axis=1), shadows.max(axis=0) + left)
        return np.maximum(lowest, -since), np.minimum(highest, since)

    def _keep_out(self, obstacle: KeepOut, leg: int) -> None:
        """Keep a leg beyond one side of an obstacle, or let it pay for how deep it goes."""
        if obstacle.is_soft:
            prices = (obstacle.layers[:, 1] * self.horizon.reach).tolist()
            self._beyond_one(obstacle, obstacle.offsets, leg, prices)
        else:
            # the path may begin at the rim, where there is no margin
            room = float(obstacle.beyond(np.zeros((1, 2))).max()) if leg == 0 else MARGIN
            self._beyond_one(obstacle, obstacle.offsets + min(max(room, 0.0), MARGIN), leg, [])

    def _beyond_one(self, obstacle: KeepOut, offsets: FloatArray, leg: int, prices: list[float]) -> None:
        """Put both ends of a leg beyond one side, or as much inside of it as is paid for in its layers."""
        normals = obstacle.normals
        (low, high), (next_low, next_high) = self._range(leg, normals), self._range(leg + 1, normals)
        lacking = offsets - np.stack([low, next_low])
        if (lacking <= 0.0).all(axis=0).any():
            # wherever it goes, it is beyond that side
            return
        # what cannot even get to the middle of a soft obstacle is nearer to the opposite side
        open_ = np.minimum(high, next_high) >= offsets - obstacle.layers[:, 0].sum()
        thickness = [*obstacle.layers[:-1, 0].tolist(), math.inf]
        layers = [(self._variable(price, 0.0, most), 1.0) for price, most in zip(prices, thickness, strict=False)]
        sides = [self._variable(0.0, 0.0, 1.0, whole=True) for _ in range(int(open_.sum()))]
        self._row([(side, 1.0) for side in sides], 1.0)
        kept = zip(sides, normals[open_].tolist(), offsets[open_].tolist(), lacking.T[open_].tolist(), strict=True)
        for side, normal, offset, lacks in kept:
            for end, lack in zip((leg, leg + 1), lacks, strict=True):
                if lack > 0.0:
                    # satisfied anywhere unless this side is the chosen one
                    self._row([*self._at(end, normal), *layers, (side, -lack)], offset - lack)

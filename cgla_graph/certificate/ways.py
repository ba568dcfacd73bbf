"""
The ways through a corridor: classes of paths that pass its holes on different sides, with a bracket for each.

**Classes.** A vertical line through each hole cuts the corridor (`corridor`) into pieces without holes. Where a line
meets the corridor, each stretch of it is a *gate* between two pieces. Two paths in the corridor can be bent into each
other inside of it just if they pass the same gates in the same order, after a gate that is passed there and straight
back is struck out. This list of gates is the class of a path; the corridor contains every path within its limit, and so
does the graph of its pieces and gates.

**Lower bound of a class.** A path through the gates ``g_1, ..., g_m`` passes a place of each. It costs at least the
bound of all paths through each gate (`through`), and at least ``S(g_i) + c |g_i - g_{i+1}| + ... + T(g_j)``: ``S`` and
``T`` bound the cost to the start and to the goal from any place of a gate, ``|g - g'|`` is the least distance of two
gates, and ``c`` the least cost of a unit of length. The search over lists of gates, from the start on, ends a list
where its bound exceeds the limit. Lists that pass the same gate twice in the same direction wind around a hole; they
are left out.

**A path of each class** is the best of those that are known, or else the best one over a lattice that passes just these
gates, refined by `refine_path`. Its class is computed again from its waypoints, and its cost is that of the oracle.
"""

import heapq
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import json_number
from cgla_graph._types import BoolArray, FloatArray, WholeArray
from cgla_graph.certificate import certificate_kernels
from cgla_graph.certificate.costs import proven
from cgla_graph.certificate.through import GridThrough, costs_to_end
from cgla_graph.model.problem import Problem
from cgla_graph.refine.refine import refine_path

#: Gates in the order in which a path passes them, each with 1 (to the right) or -1 (to the left).
Passed: TypeAlias = tuple[tuple[int, int], ...]

#: Holes that count, at most: the largest ones. Lists of gates that are looked at, at most.
MOST_HOLES, MOST_LISTS = 40, 20_000
#: Classes for which a path is sought, for each way that may be listed.
SOUGHT = 2
#: Paths are refined if they cost at most so many times the limit: on a lattice, they may be longer by that. How closely
#: they are refined.
STEPPED, REFINED, POINTS = 1.1, 1e-5, 128
#: Where a line is between the sides of its hole: no line of a grid is there.
BETWEEN = 0.381966011250105
#: Lines of the lattice along the longer side of the corridor; neighbours of an end on it.
LATTICE, BESIDE = 80, 24
#: Holes narrower than this part of their perimeter are rounding.
SLIVER = 1e-7


@dataclass(frozen=True, eq=False)
class Way:
    """
    A class of paths that pass the holes of a corridor on the same sides.

    Attributes
    ----------
    path
        The best path known of this class, shape ``(n, 2)``, map units; None if none is known.
    cost
        Its cost; infinite if none is known.
    lower_bound
        No path of this class costs less.
    sides
        The holes that it passes, with 1 if above the hole (at greater y) and -1 if below, in its order.
    """

    path: FloatArray | None
    cost: float
    lower_bound: float
    sides: tuple[tuple[int, int], ...]

    @property
    def passes(self) -> str:
        """On which side of each hole it passes, in words."""
        return ", ".join(f"{'above' if side > 0 else 'below'} {hole + 1}" for hole, side in self.sides) or "no hole"

    def document(self) -> dict[str, Any]:
        """Return the numbers as JSON."""
        return {
            "cost": json_number(self.cost),
            "lower_bound": json_number(self.lower_bound),
            "passes": self.passes,
            "waypoints": 0 if self.path is None else len(self.path),
        }


@dataclass(frozen=True, eq=False)
class Ways:
    """
    Ways through a corridor.

    Attributes
    ----------
    known
        Those along which a path is known that costs at most the limit; the best first.
    undecided
        Those whose lower bound is at most the limit, but no such path is known.
    has_more
        Whether there may be more.
    holes
        A place in each hole that counts, from left to right, shape ``(h, 2)``.
    """

    known: tuple[Way, ...]
    undecided: tuple[Way, ...]
    has_more: bool
    holes: FloatArray


def ways_of(
    problem: Problem,
    grid: GridThrough,
    outer: BaseGeometry,
    limit: float,
    lower_bound: float,
    known: Sequence[FloatArray],
    most: int,
) -> Ways:
    """
    Find the ways through a corridor.

    Parameters
    ----------
    problem
        The problem.
    grid
        Bounds of all paths through each place, below `limit`.
    outer
        The corridor.
    limit
        Paths that cost more are of no interest.
    lower_bound
        No path costs less.
    known
        Feasible paths.
    most
        Ways that are listed, at most.

    Returns
    -------
    ways
        At most `most` of each kind.

    Examples
    --------
    >>> from cgla_graph.certificate.through import grids_through
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.4, 0.4, 0.6, 0.62))
    >>> way = np.array([(0.1, 0.5), (0.4, 0.4), (0.6, 0.4), (0.9, 0.5)])
    >>> *_, grid = grids_through(problem, limit=0.9, path=way, max_cells=50_000)
    >>> outer = shapely.difference(shapely.box(0.05, 0.3, 0.95, 0.7), problem.no_fly)
    >>> found = ways_of(problem, grid, outer, 0.9, 0.8, [way], 5)
    >>> [(way.passes, round(way.cost, 4)) for way in found.known], found.has_more
    ([('below 1', 0.8325), ('above 1', 0.8462)], False)
    """
    gates = Gates.of(problem, grid, outer, lower_bound)
    costs: dict[Passed, tuple[float, FloatArray]] = {}
    none: tuple[float, FloatArray | None] = (math.inf, None)

    def offer(path: FloatArray) -> Passed | None:
        judged = problem.evaluate(path)
        passed = gates.passed_by(path) if judged.feasible else None
        if passed is not None and judged.cost < costs.get(passed, (math.inf, path))[0]:
            costs[passed] = judged.cost, path
        return passed

    for path in known:
        offer(path)
    classes, has_more = gates.classes(limit, SOUGHT * most)
    lattice = _Lattice(problem, gates)
    for passed in classes:
        if passed not in costs and (found := lattice.path(passed, STEPPED * limit)) is not None:
            offer(found)
    # (those of other classes wind around a hole)
    near = [passed for passed in sorted(costs, key=lambda one: costs[one][0]) if costs[passed][0] <= STEPPED * limit]
    for passed in near[:most]:
        refined = refine_path(problem, costs[passed][1], tolerance=REFINED, max_points=POINTS).path
        offer(np.asarray(refined))
    # (paths that leave the grid cost at least the limit)
    bounds = {passed: min(gates.bound(passed), limit) for passed in {**classes, **costs}}
    ways = [gates.way(passed, *costs.get(passed, none), bounds[passed]) for passed in bounds]
    ways.sort(key=lambda one: (one.cost, one.lower_bound))
    inside = [way for way in ways if way.cost <= limit]
    left = [way for way in ways if way.cost > limit >= way.lower_bound]
    more = has_more or len(inside) > most or len(left) > most
    return Ways(tuple(inside[:most]), tuple(left[:most]), more, gates.holes)


@dataclass(frozen=True, eq=False)
class Gates:
    """
    The pieces of a corridor between vertical lines, and the gates between them.

    `lines` are the x of the lines, shape ``(n,)``. Of each gate, `line` is its line, `ends` are its least and greatest
    y, `sides` its pieces to the left and to the right, and `bounds` bound paths through it, and the cost from it to the
    start and to the goal, shape ``(g, 3)``. `start` and `goal` are pieces, -1 where there is none.
    """

    problem: Problem
    lower_bound: float
    least_cost: float
    holes: FloatArray
    has_more_holes: bool
    lines: FloatArray
    pieces: list[BaseGeometry]
    line: WholeArray
    ends: FloatArray
    sides: WholeArray
    bounds: FloatArray
    start: int
    goal: int

    @classmethod
    def of(cls, problem: Problem, grid: GridThrough, outer: BaseGeometry, lower_bound: float) -> "Gates":
        """Cut a corridor."""
        parts = shapely.get_parts(outer)
        holes, more = _holes(list(parts))
        lines = np.unique(holes[:, 0])
        x_min, y_min, x_max, y_max = shapely.bounds(outer).tolist()
        borders = [x_min - 1.0, *lines.tolist(), x_max + 1.0]
        pieces: list[BaseGeometry] = []
        of_slab: list[list[int]] = []
        for left, right in itertools.pairwise(borders):
            slab = shapely.intersection(outer, shapely.box(left, y_min - 1.0, right, y_max + 1.0))
            found = [one for one in shapely.get_parts(slab) if one.area > 0.0]
            of_slab.append(list(range(len(pieces), len(pieces) + len(found))))
            pieces += found
        line: list[int] = []
        ends: list[tuple[float, float]] = []
        sides: list[tuple[int, int]] = []
        for number, x in enumerate(lines.tolist()):
            cut = shapely.intersection(outer, shapely.LineString([(x, y_min - 1.0), (x, y_max + 1.0)]))
            for one in shapely.get_parts(cut):
                low, high = float(one.bounds[1]), float(one.bounds[3])
                middle = shapely.Point(x, 0.5 * (low + high))
                beside = [_nearest(pieces, of_slab[number + side], middle) for side in (0, 1)]
                if high > low and min(beside) >= 0:
                    line.append(number)
                    ends.append((low, high))
                    sides.append((beside[0], beside[1]))
        every = range(len(pieces))
        start, goal = (_nearest(pieces, every, shapely.Point(end)) for end in (problem.start, problem.goal))
        at = np.array(ends).reshape(-1, 2)
        least, bounds = _bounds_of(problem, grid, lines, np.array(line, dtype=np.int64), at)
        found_sides = np.array(sides, dtype=np.int64).reshape(-1, 2)
        whole = holes, more, lines, pieces, np.array(line, dtype=np.int64), at, found_sides, bounds, start, goal
        return cls(problem, lower_bound, least, *whole)

    @cached_property
    def apart(self) -> FloatArray:
        """A bound of the cost between two gates, shape ``(g, g)``."""
        x = self.lines[self.line]
        low, high = self.ends.T
        beside = np.maximum(np.maximum(low[:, None] - high, low - high[:, None]), 0.0)
        return np.asarray(self.least_cost * np.hypot(x[:, None] - x, beside))

    @cached_property
    def doors(self) -> list[list[tuple[int, int, int]]]:
        """The gates of each piece, with the direction and the piece behind."""
        found: list[list[tuple[int, int, int]]] = [[] for _ in self.pieces]
        for gate, (left, right) in enumerate(self.sides.tolist()):
            found[left].append((gate, 1, right))
            found[right].append((gate, -1, left))
        return found

    def classes(self, limit: float, most: int) -> tuple[dict[Passed, float], bool]:
        """List the classes whose bound is at most a limit, with their bounds; and tell whether some may be missing."""
        found: dict[Passed, float] = {}
        if min(self.start, self.goal) < 0 or self.lower_bound > limit:
            return found, False
        # bound, and so far: the number of the entry breaks ties
        heap: list[tuple[float, int, int, float, Passed]] = [(self.lower_bound, 0, self.start, 0.0, ())]
        count = itertools.count(1)
        while heap:
            bound, _, piece, so_far, passed = heapq.heappop(heap)
            if piece == self.goal:
                if len(found) == most:
                    return found, True
                found[passed] = bound
            for gate, direction, behind in self.doors[piece]:
                if (passed and passed[-1][0] == gate) or (gate, direction) in passed:
                    continue
                after, above = self._after(bound, so_far, passed, gate)
                if above <= limit:
                    if (number := next(count)) > MOST_LISTS:
                        return found, True
                    heapq.heappush(heap, (above, number, behind, after, (*passed, (gate, direction))))
        return found, self.has_more_holes

    def _after(self, bound: float, so_far: float, passed: Passed, gate: int) -> tuple[float, float]:
        """Return the bounds of the cost up to a further gate, and of all."""
        through, to_start, to_goal = self.bounds[gate].tolist()
        after = max(so_far + (float(self.apart[passed[-1][0], gate]) if passed else 0.0), to_start)
        return after, max(bound, through, after + to_goal)

    def bound(self, passed: Passed) -> float:
        """Bound the cost of all paths of a class."""
        bound, so_far = self.lower_bound, 0.0
        for number, (gate, _) in enumerate(passed):
            so_far, bound = self._after(bound, so_far, passed[:number], gate)
        return bound

    def passed_by(self, path: FloatArray) -> Passed | None:
        """Return the gates that a path passes, none there and straight back; None if it leaves the corridor."""
        passed: list[tuple[int, int]] = []
        for (x, y), (to_x, to_y) in itertools.pairwise(path.tolist()):
            lines = np.flatnonzero((self.lines >= x) != (self.lines >= to_x))
            for number in lines if to_x > x else lines[::-1]:
                at = y + (to_y - y) * (self.lines[number] - x) / (to_x - x)
                gate = self.gate_at(int(number), float(at))
                if gate < 0:
                    return None
                if passed and passed[-1][0] == gate:
                    passed.pop()
                else:
                    passed.append((gate, 1 if to_x > x else -1))
        return tuple(passed)

    def gate_at(self, line: int, y: float) -> int:
        """Return the gate of a line at a height; -1 if there is none."""
        here = np.flatnonzero((self.line == line) & (self.ends[:, 0] <= y) & (y <= self.ends[:, 1]))
        return int(here[0]) if len(here) else -1

    def way(self, passed: Passed, cost: float, path: FloatArray | None, bound: float) -> Way:
        """Describe a class by the sides on which it passes holes."""
        sides: list[tuple[int, int]] = []
        for gate, _ in passed:
            middle = 0.5 * float(self.ends[gate].sum())
            here = np.flatnonzero(self.holes[:, 0] == self.lines[self.line[gate]]).tolist()
            sides += [(hole, 1 if middle > self.holes[hole, 1] else -1) for hole in here]
        return Way(path, cost, min(bound, cost), tuple(sides))


def _nearest(pieces: list[BaseGeometry], some: Sequence[int], at: shapely.Point) -> int:
    """Return the piece at a point, or next to it; -1 if there is none."""
    if not some:
        return -1
    away = shapely.distance(np.array([pieces[one] for one in some]), at)
    return some[int(np.argmin(away))]


def _holes(parts: Sequence[BaseGeometry]) -> tuple[FloatArray, bool]:
    """Return a place in each of the largest holes, from left to right, shape ``(h, 2)``; and whether there are more."""
    rings = [shapely.Polygon(ring) for part in parts for ring in shapely.get_rings(part)[1:]]
    rings = [ring for ring in rings if ring.area > (SLIVER * ring.length) ** 2]
    chosen = sorted(rings, key=lambda ring: -ring.area)[:MOST_HOLES]
    places = []
    for ring in chosen:
        y = float(ring.representative_point().y)
        x_min, _, x_max, _ = ring.bounds
        inside = shapely.get_parts(shapely.intersection(ring, shapely.LineString([(x_min, y), (x_max, y)])))
        widest = max(inside, key=lambda one: one.length)
        low, high = widest.bounds[0], widest.bounds[2]
        places.append((low + BETWEEN * (high - low), y))
    return np.array(sorted(places)).reshape(-1, 2), len(rings) > len(chosen)


def _bounds_of(
    problem: Problem, grid: GridThrough, lines: FloatArray, line: WholeArray, ends: FloatArray
) -> tuple[float, FloatArray]:
    """Return the least cost of a unit of length, and the bounds of each gate (`Gates`): the least of its cells."""
    through, level, found = grid.through, grid.level, np.zeros((len(line), 3))
    least = level.bounds[grid.pieces][:, :, certificate_kernels.LEAST].min(initial=math.inf)
    if grid.bounds is None or not len(line):
        return float(least) if len(grid.pieces) else 0.0, found
    blocks = (level.start_block, grid.bounds[1]), (level.goal_block, grid.bounds[0])
    costs = [proven(problem, costs_to_end(level, one, block)[grid.pieces]) for block, one in blocks]
    low, spacing = np.array(problem.bounds[:2]), np.array(through.spacing)
    for gate, (number, (below, above)) in enumerate(zip(line, ends, strict=True)):
        # (a place on the border of two cells is in both)
        column = (lines[number] - low[0]) / spacing[0]
        rows = (below - low[1]) / spacing[1], (above - low[1]) / spacing[1]
        beside = np.abs(through.columns - column) <= 0.5 + 1e-6
        here = np.flatnonzero(beside & (through.rows >= rows[0] - 0.5 - 1e-6) & (through.rows <= rows[1] + 0.5 + 1e-6))
        if len(here):
            found[gate] = [max(float(one[here].min()), 0.0) for one in (through.least, *costs)]
    return float(least) * (1.0 - 2.0**-40), found


@dataclass(frozen=True, eq=False)
class _Lattice:
    """Points in a corridor and the segments between neighbours, which paths of a class are sought on."""

    problem: Problem
    gates: Gates

    @cached_property
    def _lines(self) -> tuple[FloatArray, FloatArray]:
        """The x and y of its lines: at least one between two lines of gates, and one through each gate."""
        bounds = shapely.bounds(np.array(self.gates.pieces)) if self.gates.pieces else np.zeros((1, 4))
        low, high = bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)
        step = float((high - low).max()) / LATTICE or 1.0
        x, y = (np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True))
        lines = self.gates.lines
        return np.unique([*x, *(0.5 * (lines[1:] + lines[:-1]))]), np.unique([*y, *self.gates.ends.mean(axis=1)])

    @cached_property
    def points(self) -> FloatArray:
        """All points, the ends last, shape ``(n, 2)``."""
        x, y = self._lines
        lattice = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        return np.vstack([lattice, self.problem.start, self.problem.goal])

    @cached_property
    def piece(self) -> WholeArray:
        """The piece of each point; -1 outside, and inside of areas."""
        found = np.full(len(self.points), -1)
        for number, piece in enumerate(self.gates.pieces):
            shapely.prepare(piece)
            found[shapely.contains_xy(piece, self.points)] = number
        found[self.problem.model.area.contains(self.points)] = -1
        found[-2:] = self.gates.start, self.gates.goal
        return found

    @cached_property
    def segments(self) -> tuple[WholeArray, WholeArray, FloatArray, WholeArray]:
        """Segments in both directions: from, to, cost, and the gate that they pass plus 1, with its direction, or 0."""
        x, y = self._lines
        index = np.arange(len(x) * len(y)).reshape(len(y), len(x))
        pairs = [
            (index[:, :-1], index[:, 1:]),
            (index[:-1], index[1:]),
            (index[:-1, :-1], index[1:, 1:]),
            (index[:-1, 1:], index[1:, :-1]),
        ]
        one = np.concatenate([a.ravel() for a, _ in pairs])
        other = np.concatenate([b.ravel() for _, b in pairs])
        for end in (len(self.points) - 2, len(self.points) - 1):
            same = np.flatnonzero(self.piece == self.piece[end])
            away = np.hypot(*(self.points[same] - self.points[end]).T)
            near = same[np.argsort(away, kind="stable")[: BESIDE + 1]]
            one, other = np.append(one, np.full(len(near), end)), np.append(other, near)
        inside = (self.piece[one] >= 0) & (self.piece[other] >= 0) & (one != other)
        one, other = one[inside], other[inside]
        starts, ends = self.points[one], self.points[other]
        free = ~self.problem.model.area.crosses(starts, ends)
        one, other, starts, ends = one[free], other[free], starts[free], ends[free]
        gate = self._gate_of(starts, ends)
        known = (gate != 0) | (self.piece[one] == self.piece[other])
        one, other, gate, starts, ends = one[known], other[known], gate[known], starts[known], ends[known]
        cost = np.hypot(*(ends - starts).T) + self.problem.k * self.problem.field.line_integral(starts, ends)
        return (
            np.concatenate([one, other]),
            np.concatenate([other, one]),
            np.tile(cost, 2),
            np.concatenate([gate, -gate]),
        )

    def _gate_of(self, starts: FloatArray, ends: FloatArray) -> WholeArray:
        """Return which gate segments pass, plus 1, and negative to the left; 0 for none."""
        lines, found = self.gates.lines, np.zeros(len(starts), dtype=np.int64)
        first, last = np.searchsorted(lines, starts[:, 0]), np.searchsorted(lines, ends[:, 0])
        for segment in np.flatnonzero(np.abs(last - first) == 1).tolist():
            (x, y), (to_x, to_y) = starts[segment].tolist(), ends[segment].tolist()
            number = int(min(first[segment], last[segment]))
            at = y + (to_y - y) * (float(lines[number]) - x) / (to_x - x)
            found[segment] = (self.gates.gate_at(number, at) + 1) * (1 if to_x > x else -1)
        return found

    def path(self, passed: Passed, most: float) -> FloatArray | None:
        """Find the best path over the lattice that passes just these gates; None if there is none below a cost."""
        from scipy.sparse import coo_array, csgraph  # noqa: PLC0415 - slow to import, and few proofs need it

        n = len(self.points)
        layers = list(self._layers(passed))
        one, other, cost = (np.concatenate(column) for column in zip(*layers, strict=True))
        used, index = np.unique(np.concatenate([one, other]), return_inverse=True)
        ends = np.searchsorted(used, [n - 2, len(passed) * n + n - 1])
        if not len(used) or (ends >= len(used)).any() or (used[ends] != [n - 2, len(passed) * n + n - 1]).any():
            return None
        graph = coo_array((cost, (index[: len(one)], index[len(one) :])), shape=(len(used), len(used))).tocsr()
        search: Any = csgraph.dijkstra
        costs, before = search(graph, indices=int(ends[0]), return_predecessors=True, limit=most)
        if not np.isfinite(costs[ends[1]]):
            return None
        nodes = [int(ends[1])]
        while nodes[-1] != ends[0]:
            nodes.append(int(before[nodes[-1]]))
        return np.asarray(self.points[used[nodes[::-1]] % n])

    def _layers(self, passed: Passed) -> Iterator[tuple[WholeArray, WholeArray, FloatArray]]:
        """Yield the segments before, at and between the gates of a class; the points of a layer are numbered anew."""
        one, other, cost, gate = self.segments
        n, piece = len(self.points), self.gates.start
        for layer, (number, direction) in enumerate([*passed, (-1, 0)]):
            here: BoolArray = (gate == 0) & (self.piece[one] == piece) & (self.piece[other] == piece)
            yield one[here] + layer * n, other[here] + layer * n, cost[here]
            if number >= 0:
                here = (gate == direction * (number + 1)) & (self.piece[one] == piece)
                yield one[here] + layer * n, other[here] + (layer + 1) * n, cost[here]
                piece = int(self.gates.sides[number, 1 if direction > 0 else 0])

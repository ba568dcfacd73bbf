"""
Check a proof file: a lower bound of the cost of all paths, and an upper bound of the cost of one.

This is one file, which needs Python and NumPy alone: copy it anywhere. It believes nothing that a proof file says. Such
a file holds a problem, a path and the values of surfaces; grids are laid here, and all that is printed is computed
here, with errors of rounding bounded. ``docs/how-it-works/proof-files.md`` states the argument and the format, and this
file follows its sections.

Usage: ``python check_proof.py NAME.proof [--most-work N]``. It prints what is proven (exit 0), or what is wrong (exit
1). A file that asks for more than N numbers to be computed is refused before that is done.
"""

import bz2
import hashlib
import io
import json
import math
import sys
import warnings
import zipfile
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from fractions import Fraction
from functools import reduce
from itertools import pairwise, product
from typing import Any, TypeAlias, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
Wholes: TypeAlias = NDArray[np.int64]
Truths: TypeAlias = NDArray[np.bool_]
Point: TypeAlias = tuple[float, float]
#: Reads an array of a proof file: name, ``f`` for floats or ``i`` for whole numbers, number of axes.
Reader: TypeAlias = Callable[[str, str, int], Any]

FORMAT, VERSION = "path-cost-proof", 6
#: Bytes of the description, and of all that is read, uncompressed.
MOST_TEXT, MOST_IN_ALL = 1 << 24, 1 << 29
#: Numbers are below this, and spreads above its reciprocal: no product here is too great for a float.
MOST = 1e60
#: Surfaces inside surfaces; cells of a grid; parts of cells; parts of a path; and numbers that are computed in all.
MOST_LEVELS, MOST_CELLS, MOST_PARTS, MOST_STEPS, MOST_WORK = 8, 1 << 21, 1 << 24, 1_000_000, 1e10
#: Boxes in one batch.
BATCH = 1 << 14
#: Risk below this part of a unit of cost is not looked at, which lowers the cost.
FAINT = 1e-8
#: Patches of a raster along the side of a box, at most, for which more than a constant is computed.
FEW_PATCHES = 5
#: Half of the minor axis of WGS84, metres.
POLAR_RADIUS = 6356752.314245


class Refused(Exception):  # noqa: N818 - a verdict, not an error of the program
    """What is wrong with a proof."""


def demand(condition: object, text: str | Callable[[], str]) -> None:
    """Refuse the proof unless a condition holds."""
    if not condition:
        raise Refused(text if isinstance(text, str) else text())


# --- Intervals --------------------------------------------------------------------------------------------------------

#: One part of a float that is at least the distance to the next one, and a distance for those near 0.
ULP, TINY = 2.0**-52, 2.0**-1060


def down(x: ArrayLike) -> Any:
    """Return a float below: the next one, or one or two further."""
    return np.multiply(x, 1.0 - np.copysign(ULP, x)) - TINY


def up(x: ArrayLike) -> Any:
    """Return a float above: the next one, or one or two further."""
    return np.multiply(x, 1.0 + np.copysign(ULP, x)) + TINY


class Interval:
    """Arrays of intervals: each operation encloses the exact result for any numbers inside."""

    #: NumPy leaves operations to this class.
    __array_ufunc__ = None

    def __init__(self, lo: ArrayLike, hi: ArrayLike | None = None) -> None:
        self.lo: Floats = np.asarray(lo, dtype=np.float64)
        self.hi: Floats = self.lo if hi is None else np.asarray(hi, dtype=np.float64)

    def __getitem__(self, key: Any) -> "Interval":
        return Interval(self.lo[key], self.hi[key])

    def put(self, key: Any, other: "Interval") -> None:
        """Replace some intervals."""
        self.lo[key], self.hi[key] = other.lo, other.hi

    def __neg__(self) -> "Interval":
        return Interval(-self.hi, -self.lo)

    def __add__(self, other: "Interval | ArrayLike") -> "Interval":
        other = enclosed(other)
        return Interval(down(self.lo + other.lo), up(self.hi + other.hi))

    def __sub__(self, other: "Interval | ArrayLike") -> "Interval":
        return self + -enclosed(other)

    def __rsub__(self, other: ArrayLike) -> "Interval":
        return -self + other

    def __mul__(self, other: "Interval | ArrayLike") -> "Interval":
        return self._of_ends(np.multiply, enclosed(other))

    def __truediv__(self, other: "Interval | ArrayLike") -> "Interval":
        other = enclosed(other)
        demand((other.lo > 0.0).all(), "a number is divided by one that may be 0")
        return self._of_ends(np.divide, other)

    def _of_ends(self, way: Callable[[Floats, Floats], Floats], other: "Interval") -> "Interval":
        """Enclose what an operation yields that is greatest and least for ends of both."""
        ends = [way(one, its) for one in (self.lo, self.hi) for its in (other.lo, other.hi)]
        return Interval(down(reduce(np.minimum, ends)), up(reduce(np.maximum, ends)))

    __radd__ = __add__
    __rmul__ = __mul__

    def square(self) -> "Interval":
        """Return the squares."""
        least = np.maximum(np.maximum(self.lo, -self.hi), 0.0)
        most = np.maximum(-self.lo, self.hi)
        return Interval(np.maximum(down(least * least), 0.0), up(most * most))

    def root(self) -> "Interval":
        """Return the square roots of numbers of at least 0."""
        return Interval(np.maximum(down(np.sqrt(np.maximum(self.lo, 0.0))), 0.0), up(np.sqrt(self.hi)))


def enclosed(x: "Interval | ArrayLike") -> Interval:
    """Turn numbers into intervals."""
    return x if isinstance(x, Interval) else Interval(x)


def length_of(x: Interval, y: Interval) -> Interval:
    """Enclose the lengths of vectors."""
    return (x.square() + y.square()).root()


#: Half of a third of the root of 3.
GAUSS = Interval(0.288675134594812, 0.288675134594813)
#: ``log 2``: a number of 33 bits, and the rest but for 2^-86.
LOG_2_HIGH, LOG_2_LOW = 0.693147180601954460, -4.2009150726810846e-11


def exp(x: Interval) -> Interval:
    """
    Enclose exp of numbers of at most 0.

    For the middle ``m = n log 2 + r`` of an interval, ``exp m = 2^n exp r`` with ``|r| < 0.35``. Products of n and the
    high part of log 2 are exact, and so is their difference from m: r is off by less than 2^-53. Taylor's polynomial to
    the power 14 is off by less than 2^-60, and by less than ``6 * 2^-53`` of itself for the rounding of Horner's rule.
    All of that is below 2^-49 of the result. With the half-width ``w < 1/2`` of the interval, ``exp m (1 - w) <= exp x
    <= exp m (1 + w + w^2)``.
    """
    middle = 0.5 * (x.lo + x.hi)
    width = up(np.maximum(x.hi - middle, middle - x.lo))
    power = np.rint(np.maximum(middle, -700.0) * 1.4426950408889634)
    rest = (np.maximum(middle, -700.0) - power * LOG_2_HIGH) - power * LOG_2_LOW
    value = np.ones_like(rest)
    for n in range(14, 0, -1):
        value = 1.0 + rest * value / n
    value = np.ldexp(value, power.astype(np.int64))
    low, high = value * (1.0 - 2.0**-48) * (1.0 - width), value * (1.0 + 2.0**-48) * (1.0 + width * (1.0 + width))
    # (below -700, and for wide intervals, no more is known than that exp rises, and is below 2^-865 at -600)
    known = (middle >= -700.0) & (width < 0.5)
    return Interval(np.where(known, down(low), 0.0), np.where(known, up(high), np.where(x.hi < -600.0, 2.0**-865, 1.0)))


# --- The cost ---------------------------------------------------------------------------------------------------------


class Problem:
    """
    Start, goal, bounds, the cost ``c = 1 + k F``, on a map of the Earth times its scale, and areas that are closed.

    ``F = 1 - prod (1 - f_i)``, with ``f_i = p exp(-r^2 / (2 s^2))`` at r from a threat, plus the risk of rasters.
    """

    def __init__(self, described: dict[str, Any], array: Reader, most_work: float = MOST_WORK) -> None:
        self.start, self.goal = (numbers_of(described[name], 2) for name in ("start", "goal"))
        self.bounds: list[float] = numbers_of(described["bounds"], 4)
        (self.k,) = numbers_of([described["k"]], 1)
        x_min, y_min, x_max, y_max = self.bounds
        demand(x_min < x_max and y_min < y_max and self.k >= 0.0, "the bounds are empty, or k is negative")
        for x, y in (self.start, self.goal):
            demand(x_min <= x <= x_max and y_min <= y <= y_max, "an end is outside of the bounds")
        self.threats: list[list[float]] = array(described["threats"], "f", 2).tolist()
        for _, _, spread, peak in self.threats:
            demand(spread > 1.0 / MOST and 0.0 <= peak <= 1.0, "a spread is not above 0, or a peak not between 0 and 1")
        self.rasters = [Raster(one, array) for one in described["rasters"]]
        rings = [array(name, "f", 2) for name in described["rings"]]
        #: Both ends of each edge of the areas, shape (n, 4).
        self.edges: Floats = np.concatenate(
            [np.empty((0, 4)), *(np.column_stack([ring, np.roll(ring, -1, axis=0)]) for ring in rings)]
        )
        self.on_earth: bool = described["on_earth"]
        demand(isinstance(self.on_earth, bool), "a map is on the Earth or not: true or false")
        self.left = float(most_work)

    def spend(self, *numbers: float) -> None:
        """Count numbers that are about to be computed, a product; refuse a file that asks for too many."""
        self.left -= math.prod(map(float, numbers))
        demand(self.left >= 0.0, "the file asks for more work than is allowed (--most-work N allows more)")

    def lower_costs(self, grid: "Grid", sides: list[Wholes]) -> Floats:
        """Return nine numbers for each box of a grid, of which the cost there is at least the mean (Bernstein)."""
        self.spend(len(sides[0]), 10 + len(self.threats))
        x, y = grid.places(sides)
        risk = self._risk(x, y) if self.threats else np.zeros((len(sides[0]), 3, 3))
        for raster in self.rasters:
            risk = down(risk + raster.floor(grid, sides))
        costs: Floats = down(1.0 + down(self.k * risk))
        if self.on_earth:
            # a unit of the plane is ``sin t / t > 1 - t^2 / 6`` on the Earth, or more, at t times the polar radius
            far = [Interval(np.maximum(np.abs(side[0].lo), np.abs(side[1].hi))) / POLAR_RADIUS for side in (x, y)]
            scale = (1.0 - (far[0].square() + far[1].square()) / 6.0).lo
            costs = down(costs * np.maximum(scale, 0.0)[:, None, None])
        return np.where(np.isnan(costs), -np.inf, costs)

    def _risk(self, x: list[Interval], y: list[Interval]) -> Floats:
        """
        Return nine numbers for each box, of which the risk of threats is at least the mean; 0 where they are negative.

        With ``q = 1 / s^2``, at d from the middle, ``1 - f_i <= u_i = 1 - f_i(0) + f_i(0) q_i (r_i . d + d^2 / 2)``, as
        ``exp t >= 1 + t``; values and slopes of both sides are equal at d = 0. So ``F(d) >= F(0) + grad F(0) . d - M
        d^2 / 2``, where no eigenvalue of the Hessian of ``prod u_i`` is above ``M = prod u_i (sum f_i q_i / u_i + sum
        |grad u_i| |grad u_j| / (u_i u_j))`` over all i and j that differ, with the greatest values in the box.
        """
        (middle_x, half_x), (middle_y, half_y) = (((a + b) * 0.5, (b - a) * 0.5) for a, b in (x, y))
        reach, n = length_of(half_x, half_y).hi, len(half_x.lo)
        slope_x, slope_y, clear = (Interval(np.full(n, one), np.full(n, one)) for one in (0.0, 0.0, 1.0))
        shares, slopes, squares, product = (np.full(n, one) for one in (0.0, 0.0, 0.0, 1.0))
        far = math.sqrt(-2.0 * math.log(FAINT / max(self.k, 1.0) / len(self.threats)))
        for at_x, at_y, spread, peak in self.threats:
            (near,) = np.nonzero(np.hypot(middle_x.lo - at_x, middle_y.lo - at_y) < spread * far)
            dx, dy, around = middle_x[near] - at_x, middle_y[near] - at_y, Interval(reach[near])
            q, square, before = Interval(1.0) / Interval(spread).square(), dx.square() + dy.square(), clear[near]
            value = exp(square * q * -0.5) * peak
            share, away, rest = value * q, square.root(), 1.0 - value
            factor = (rest + share * around * (away + around * 0.5)).hi
            slope = up((share * (away + around)).hi / factor)
            shares[near], slopes[near] = up(shares[near] + up(share.hi / factor)), up(slopes[near] + slope)
            squares[near], product[near] = down(squares[near] + down(slope * slope)), up(product[near] * factor)
            slope_x.put(near, slope_x[near] * rest - share * dx * before)
            slope_y.put(near, slope_y[near] * rest - share * dy * before)
            clear.put(near, before * rest)
        bend = up(product * up(shares + np.maximum(up(up(slopes * slopes) - squares), 0.0)))
        level = 1.0 - clear - Interval(reach).square() * bend * 0.5
        each, place = np.s_[:, None, None], np.array([-1.0, 0.0, 1.0])
        found = (level[each] + (slope_x * half_x)[each] * place + (slope_y * half_y)[each] * place[:, None]).lo
        return np.where(found.min(axis=(1, 2), keepdims=True) >= 0.0, found, 0.0)


def bilinear(s: Any, t: Any, corners: Any) -> Any:
    """Return values between those at corners (south-west, south-east, north-west, north-east)."""
    return (1 - t) * ((1 - s) * corners[0] + s * corners[1]) + t * ((1 - s) * corners[2] + s * corners[3])


class Raster:
    """
    Risk on cells: one value on each (on edges the lesser one), or bilinear between middles; 0 beyond the outer edges.

    It consists of patches between knots: edges of cells, or the outer edges and the middles. Each has four values, at
    its corners, `corners` (corner, row, column), and is bilinear between them.
    """

    def __init__(self, described: dict[str, Any], array: Reader) -> None:
        values: Floats = array(described["values"], "f", 2)
        bounds = numbers_of(described["bounds"], 4)
        self.is_flat = described["interpolation"] == "nearest"
        demand(self.is_flat or described["interpolation"] == "bilinear", "an interpolation is not known")
        demand(values.size > 0 and max(values.shape) < 1 << 18, "a raster is empty, or has too many rows or columns")
        demand(bounds[0] < bounds[2] and bounds[1] < bounds[3], "the bounds of a raster are empty")
        demand((values >= 0.0).all(), "a raster is negative somewhere")
        self.knots: list[list[Fraction]] = []
        for axis in range(2):
            n, low, high = values.shape[1 - axis], Fraction(bounds[axis]), Fraction(bounds[axis + 2])
            halves = range(0, 2 * n + 1, 2) if self.is_flat else [0, *range(1, 2 * n, 2), 2 * n]
            self.knots.append([low + (high - low) * step / (2 * n) for step in halves])
        near = [np.array([float(one) for one in knots]) for knots in self.knots]
        self.enclosed = [Interval(down(one), up(one)) for one in near]
        wide = np.pad(values, 1, mode="edge")
        self.corners = [values] * 4 if self.is_flat else [wide[:-1, :-1], wide[:-1, 1:], wide[1:, :-1], wide[1:, 1:]]

    def floor(self, grid: "Grid", sides: list[Wholes]) -> Floats:
        """
        Return nine numbers for each box, of which the risk is at least the mean (Bernstein), shape (n, 3, 3).

        A patch has such numbers on the whole box. The least ones of all patches that the box meets will do.
        """
        spans, inside = [], np.ones(len(sides[0]), dtype=np.bool_)
        for axis in range(2):
            begin, end = sides[2 * axis : 2 * axis + 2]
            (below, above, outer), most = grid.around(axis, self), len(self.knots[axis]) - 2
            inside &= (outer[0] <= begin) & (outer[1] >= end)
            first, last = np.searchsorted(above, begin, side="right") - 1, np.searchsorted(below, end) - 1
            spans.append((np.clip(first, 0, most), np.clip(last, 0, most)))
        columns, rows = ((np.where(inside, first, 0), np.where(inside, last, 0)) for first, last in spans)
        across, along = (int((last - first).max(initial=0)) + 1 for first, last in (columns, rows))
        # (a step of the loop takes as long as many numbers)
        grid.problem.spend(len(inside) + 1000, across, along)
        x, y = grid.places(sides)
        least, found = np.full((len(inside), 1, 1), np.inf), np.full((len(inside), 3, 3), np.inf)
        for di, dj in product(range(across), range(along)):
            # (smaller ranges repeat their last)
            i, j = np.minimum(columns[0] + di, columns[1]), np.minimum(rows[0] + dj, rows[1])
            corners = [corner[j, i] for corner in self.corners]
            least = np.minimum(least, np.min(corners, axis=0)[:, None, None])
            if self.is_flat or max(across, along) > FEW_PATCHES:
                continue
            s, t = (
                [(one - knots[n]) / (knots[n + 1] - knots[n]) for one in side]
                for side, knots, n in ((x, self.enclosed[0], i), (y, self.enclosed[1], j))
            )
            low, high = (_with_middle(*(bilinear(p, q, corners).lo for p in s)) for q in t)
            found = np.minimum(found, _with_middle(low, high))
        # (where several patches meet, a constant may be better)
        poor = ~(found.mean(axis=(1, 2), keepdims=True) >= least) | np.isinf(found[:, :1, :1])
        return np.where(inside[:, None, None], np.where(poor, least, found), 0.0)

    def exact(self, points: list[list[Fraction]], place: list[Fraction]) -> list[Fraction]:
        """Return the risk at points of the patch that holds a place, exactly; of several ones, the least."""
        held, found = [], []
        for at, knots in zip(place, self.knots, strict=True):
            if not knots[0] <= at <= knots[-1]:
                return [Fraction(0)] * len(points)
            held.append({min(max(one(knots, at) - 1, 0), len(knots) - 2) for one in (bisect_left, bisect_right)})
        for i, j in product(*held):
            corners = [Fraction(float(corner[j, i])) for corner in self.corners]
            (x, to_x), (y, to_y) = self.knots[0][i : i + 2], self.knots[1][j : j + 2]
            found.append([bilinear((p - x) / (to_x - x), (q - y) / (to_y - y), corners) for p, q in points])
        return min(found)


def _with_middle(one: Floats, other: Floats) -> Floats:
    """Return numbers, those in the middle or less, and other numbers, along a new axis."""
    return np.stack([one, down(0.5 * (one + other)), other], axis=1)


# --- Grids ------------------------------------------------------------------------------------------------------------


def ranges(first: ArrayLike, last: ArrayLike) -> tuple[Wholes, Wholes]:
    """Return all whole numbers from first to last ones, and before them which range each is of; some may be empty."""
    first, counts = np.asarray(first), np.maximum(np.subtract(last, first) + 1, 0)
    demand(counts.sum() < MOST_PARTS, "there are too many parts of cells, or of a path")
    counts = counts.astype(np.int64)
    which = np.repeat(np.arange(len(counts)), counts)
    return which, first.astype(np.int64)[which] + np.arange(len(which)) - (np.cumsum(counts) - counts)[which]


def distinct(numbers: Wholes) -> Wholes:
    """Return numbers from 0 on in order, each once; that is fast where they consist of ordered runs."""
    order: Wholes = np.sort(numbers, axis=None, kind="stable")
    return np.asarray(order[np.append(order[:1] >= 0, order[1:] != order[:-1])])


def is_among(numbers: Wholes, ordered: Wholes) -> Truths:
    """Tell which numbers are among others, which are in order."""
    return np.asarray(np.append(ordered, -1)[np.searchsorted(ordered, numbers)] == numbers)


def batches(n: int, size: int = 1) -> list[slice]:
    """Return slices of n items of a size."""
    step = max(BATCH // size, 1)
    return [slice(first, min(first + step, n)) for first in range(0, n, step)]


def joined(n: int, one: Wholes, other: Wholes) -> Wholes:
    """Return for each of n items the least one that pairs lead to."""
    least = np.arange(n)
    while len(one):
        # (of each pair, the greater one is no longer the least of its own)
        np.minimum.at(least, np.maximum(one, other), np.minimum(one, other))
        while ((new := least[least]) != least).any():
            least = new
        apart = least[one] != least[other]
        one, other = least[one[apart]], least[other[apart]]
    return least


def areas_at(problem: Problem, lines: list[Interval], i: Wholes, j: Wholes) -> tuple[Truths, Truths]:
    """
    Tell which rectangles, of columns i and rows j, edges of areas may meet, and which of the others are inside.

    `lines` are columns and rows: intervals, in order. Along a row, edges begin to be met, and end. Where none is met, a
    rectangle is inside if an odd number of edges that cross the middle of the row has ended before it.
    """
    (columns, rows), (ax, ay, bx, by) = lines, problem.edges.T
    first = np.searchsorted(rows.hi, np.minimum(ay, by))
    last = np.searchsorted(rows.lo, np.maximum(ay, by), side="right") - 1
    problem.spend(np.maximum(last - first + 1, 0).sum() + len(rows.lo) + np.broadcast(i, j).size, 10)
    edge, row = ranges(first, last)
    ax, ay, bx, by = problem.edges[edge].T
    rise = np.where(by == ay, 1.0, by - ay)
    # (places on an edge are off by less than 2^-48 of its coordinates)
    x, to_x = (
        ax + np.where(by == ay, end, np.clip((side[row] - ay) / rise, 0.0, 1.0)) * (bx - ax)
        for side, end in ((rows.lo, 0.0), (rows.hi, 1.0))
    )
    off = 2.0**-48 * (np.abs(ax) + np.abs(bx))
    width, middle = len(columns.lo) + 1, 0.5 * (rows.lo + rows.hi)[row]
    begin = row * width + np.searchsorted(columns.hi, np.minimum(x, to_x) - off)
    end = row * width + np.searchsorted(columns.lo, np.maximum(x, to_x) + off, side="right")
    crosses = (ay > middle) != (by > middle)
    # from each begin and end on: whether an edge is met, and whether an odd number has been crossed
    places, change, crossed = np.append(begin, end), np.repeat([1, -1], len(row)), np.append(0 * row, crosses)
    order = np.argsort(places, kind="stable")
    is_met = np.append(0, np.cumsum(change[order])) > 0
    is_inside = (np.append(0, np.cumsum(crossed[order])) % 2 == 1) & ~is_met
    at = np.searchsorted(places[order], j * width + i, side="right")
    return is_met[at], is_inside[at]


class Grid:
    """
    Cells, cut by areas into pieces, which are what paths may pass.

    Cell (i, j) is around node (i, j), where the map is from node (0, 0) to node `last`. Units are cells divided by an
    even number of parts: cell i is from unit ``i parts - parts / 2`` on. A cell that no edge of an area meets is a
    piece, or closed if it is inside an area. Another one consists of unit squares: those that no edge meets are closed
    if they are inside. The others are pieces, run by run along rows, equal runs of rows one above another together.
    Without parts, areas are not looked at.
    """

    def __init__(self, problem: Problem, last: list[int], parts: int, columns: Wholes, rows: Wholes) -> None:
        demand(0 <= parts <= 1 << 12 and parts % 2 == 0, "the parts of a cell are not an even number")
        demand(all(2 <= one < (1 << 30) // (parts or 2) for one in last), "a grid has too few cells, or too many")
        self.problem, self.last, self.parts = problem, last, parts or 2
        self.grids: dict[Any, Grid] = {}
        self.knots: dict[tuple[int, Raster], tuple[Wholes, Wholes, list[int]]] = {}
        #: The units of the map along each axis.
        self.units = [one * self.parts for one in last]
        order = distinct(rows * (last[0] + 1) + columns)
        demand(len(order) < MOST_CELLS, "a grid has too many cells")
        problem.spend(len(order), 100)
        #: Columns and rows of the cell of each piece, in order, whether an edge meets it, and the sides of each piece.
        self.columns, self.rows = order % (last[0] + 1), order // (last[0] + 1)
        self.is_cut, self.sides = np.zeros(len(order), dtype=np.bool_), self._sides_of_cells()
        if parts and len(problem.edges) and len(order):
            self._cut()
        #: The numbers of the control values around each piece, and the places of those that come first.
        self.controls, self.uncut_places = self._numbered()
        #: Boxes on each of which slopes are compared with nine numbers for the cost: the pieces, most often.
        self.boxes = self.sides
        is_bent = any(not one.is_flat for one in problem.rasters)
        for axis, index in enumerate((self.columns, self.rows) if is_bent else ()):
            # (rasters may have lines through the middles of cells: each box becomes four, one after all others)
            low, high = self.boxes[2 * axis : 2 * axis + 2]
            middle = np.clip(np.resize(index, len(low)) * self.parts, low, high)
            self.boxes = [np.append(side, side) for side in self.boxes]
            self.boxes[2 * axis : 2 * axis + 2] = np.append(low, middle), np.append(middle, high)
        demand(len(self.boxes[0]) < MOST_CELLS, "a grid has too many cells")
        costs = [problem.lower_costs(self, [side[some] for side in self.boxes]) for some in batches(len(self.boxes[0]))]
        self.costs: Floats = np.concatenate([np.empty((0, 3, 3)), *costs])
        self.least_cost = max(float(self.costs.min(initial=math.inf)), 0.0)

    @classmethod
    def over(cls, problem: Problem, last: list[int], parts: int, box: list[int]) -> "Grid":
        """Lay a grid over all cells of a rectangle: west, east, south, north."""
        west, east, south, north = (min(max(side, 0), last[n // 2] + 1) for n, side in enumerate(box))
        demand(west <= east and south <= north, "a box ends before it begins")
        demand((east - west + 1) * (north - south + 1) < MOST_CELLS, "a grid or a block is too large")
        columns, rows = np.meshgrid(np.arange(west, east), np.arange(south, north))
        return cls(problem, last, parts, columns.ravel(), rows.ravel())

    def inside_block(self, finer: int, parts: int, box: list[int]) -> "Grid":
        """Lay a grid inside of this one, over the cells of a box on the map; the same one for both surfaces."""
        key = finer, parts, *box
        if key not in self.grids:
            demand(finer % 2 == 1 and 1 < finer < 100, "a grid inside is not an odd number of times as fine")
            self.grids[key] = Grid.over(self.problem, [one * finer for one in self.last], parts, box)
        return self.grids[key]

    def finer(self, kept: Truths, parts: int) -> "Grid":
        """Lay a grid twice as fine over the cells of some pieces."""
        demand(kept.sum() < MOST_CELLS, "a grid has too many cells")
        last, step = [2 * one for one in self.last], np.arange(9)
        columns, rows = (
            np.clip(2 * index[kept] + by[:, None], 0, most).ravel()
            for index, by, most in zip((self.columns, self.rows), (step % 3 - 1, step // 3 - 1), last, strict=True)
        )
        return Grid(self.problem, last, parts, columns, rows)

    def unit_of(self, axis: int, place: Fraction) -> Fraction:
        """Return a place along an axis in units, exactly."""
        low, high = Fraction(self.problem.bounds[axis]), Fraction(self.problem.bounds[axis + 2])
        return (place - low) * self.units[axis] / (high - low)

    def cell_of(self, axis: int, place: float) -> Fraction:
        """Return a place along an axis in cells, exactly: cell i is from i to i + 1."""
        return self.unit_of(axis, Fraction(place)) / self.parts + Fraction(1, 2)

    def around(self, axis: int, raster: "Raster") -> tuple[Wholes, Wholes, list[int]]:
        """
        Return whole units below and above the knots of a raster, and those inside of its edges; they are found once.

        On a line between cells of a flat raster, the lesser one counts: so a knot that a unit touches, or nearly so, is
        beyond it. Several rasters with a common line may all be lesser there than on either side of it.
        """
        if (axis, raster) not in self.knots:
            self.problem.spend(len(raster.knots[axis]), 500)
            units, near = [self.unit_of(axis, one) for one in raster.knots[axis]], Fraction(raster.is_flat, 1 << 30)
            below, above = (
                np.array([way(u + by) for u in units]) for way, by in ((math.floor, -near), (math.ceil, near))
            )
            self.knots[axis, raster] = below, above, [math.ceil(units[0]), math.floor(units[-1])]
        return self.knots[axis, raster]

    def step(self, axis: int) -> Interval:
        """Enclose the length of a unit along an axis."""
        return (Interval(self.problem.bounds[axis + 2]) - self.problem.bounds[axis]) / float(self.units[axis])

    def place(self, axis: int, units: Wholes) -> Interval:
        """Enclose places along an axis in map units."""
        return Interval(units) * self.step(axis) + self.problem.bounds[axis]

    def places(self, sides: list[Wholes]) -> tuple[list[Interval], list[Interval]]:
        """Enclose the sides of boxes in map units: west and east, and south and north."""
        west, east, south, north = (self.place(n // 2, side) for n, side in enumerate(sides))
        return [west, east], [south, north]

    def lines(self, axis: int, first: int, count: int, size: int) -> Interval:
        """Enclose what is on the map of some parts along an axis, of so many units each, from a unit on."""
        demand(count < MOST_CELLS, "a grid is too fine")
        units = np.clip(first + size * np.arange(count + 1), 0, self.units[axis])
        places = self.place(axis, units)
        return Interval(places.lo[:-1], places.hi[1:])

    def name(self, piece: int) -> str:
        """Name the cell of a piece in a message."""
        return f"cell ({self.columns[piece]}, {self.rows[piece]}) of {self.last[0]}"

    def numbers(self, columns: Wholes, rows: Wholes) -> Wholes:
        """Return numbers of cells, row by row; those just outside of the map have some as well."""
        return (rows + 1) * (self.last[0] + 3) + columns + 1

    def around_cells(self, cells: Wholes) -> Wholes:
        """Return the numbers of three times three cells around each, shape (n, 9)."""
        around: Wholes = np.array([b * (self.last[0] + 3) + a for b in (-1, 0, 1) for a in (-1, 0, 1)])
        return cells[:, None] + around

    def _sides_of_cells(self) -> list[Wholes]:
        """Return west, east, south and north of the cells of all pieces, in units on the map."""
        half = self.parts // 2
        return [
            np.clip(index * self.parts + side, 0, units)
            for units, index in zip(self.units, (self.columns, self.rows), strict=True)
            for side in (-half, half)
        ]

    def _areas_at(self, columns: Wholes, rows: Wholes, size: int, begin: int) -> tuple[Truths, Truths]:
        """Tell which boxes of so many units, from a first one on, edges may meet, and which others are inside."""
        low = [int(index.min()) if index.size else 0 for index in (columns, rows)]
        lines = [
            self.lines(axis, low[axis] * size + begin, int(index.max(initial=-1)) + 1 - low[axis], size)
            for axis, index in enumerate((columns, rows))
        ]
        return areas_at(self.problem, lines, columns - low[0], rows - low[1])

    def _cut(self) -> None:
        """Replace cells that edges meet by the runs of their open squares, and drop those inside of areas."""
        half, steps = self.parts // 2, np.arange(self.parts)
        is_met, is_inside = self._areas_at(self.columns, self.rows, self.parts, -half)
        (cut,), (whole,) = np.nonzero(is_met), np.nonzero(~is_met & ~is_inside)
        demand(len(cut) * self.parts**2 < MOST_PARTS, "there are too many parts of cells")
        corner = np.array([self.columns[cut], self.rows[cut]])[:, :, None, None] * self.parts - half
        u, v = corner[0] + steps, corner[1] + steps[:, None]
        on_map = (u >= 0) & (u < self.units[0]) & (v >= 0) & (v < self.units[1])
        is_open = on_map & ~self._areas_at(u, v, 1, 0)[1]
        # (where squares along a row change, a run begins or ends; equal runs of rows one above another are one piece)
        cell, row, column = np.nonzero(np.diff(is_open, axis=2, prepend=False, append=False))
        v, u = corner[1, cell, 0, 0] + row, corner[0, cell, 0, 0] + column
        runs = np.array([cut[cell[::2]], u[::2], u[1::2], v[::2]])
        runs = runs[:, np.lexsort(runs[::-1])]
        first = (np.diff(runs, prepend=-2) != [[0], [0], [0], [1]]).any(axis=0)
        piece, sides = np.append(whole, runs[0, first]), [*runs[1:, first], runs[3, np.roll(first, -1)] + 1]
        order = np.argsort(piece, kind="stable")
        self.sides = [np.append(side[whole], ours)[order] for side, ours in zip(self.sides, sides, strict=True)]
        piece = piece[order]
        self.columns, self.rows, self.is_cut = self.columns[piece], self.rows[piece], is_met[piece]

    def _touching(self) -> tuple[Wholes, Wholes]:
        """Return pairs of pieces that touch, corners included, two cells or less from a cell that an edge meets."""
        cells, up = self.numbers(self.columns, self.rows), self.units[0] + 1
        around = distinct(self.around_cells(distinct(self.around_cells(cells[self.is_cut]))))
        (near,) = np.nonzero(is_among(cells, around))
        west, east, south, north = (side[near] for side in self.sides)
        # rows of squares, in order
        piece, v = ranges(south, north - 1)
        order = np.lexsort((west[piece], v))
        piece, row = piece[order], v[order] * up
        begin, end = row + west[piece], row + east[piece]
        (beside,) = np.nonzero((row[:-1] == row[1:]) & (end[:-1] >= begin[1:]))
        below, above = ranges(np.searchsorted(end, begin + up), np.searchsorted(begin, end + up, side="right") - 1)
        one, other = piece[np.append(beside, below)], piece[np.append(beside + 1, above)]
        pairs = distinct(one * len(cells) + other)
        return near[pairs // len(cells)], near[pairs % len(cells)]

    def _numbered(self) -> tuple[Wholes, Wholes]:
        """Return the numbers of control values around pieces, shape (m, 9): what touches shares those around both."""
        at = self.around_cells(self.numbers(self.columns, self.rows))
        n_shared = int(at.max(initial=0)) + 1
        # (where no cell around a place is cut, all share the value there)
        near = is_among(at, distinct(at[self.is_cut].T))
        one, other = self._touching()
        self.problem.spend(len(one), 100)
        demand(len(one) < MOST_CELLS, "too many pieces touch")
        pair, n, m = np.nonzero((at[one][:, :, None] == at[other][:, None]) & near[one][:, :, None])
        at[near] = n_shared + joined(at.size, 9 * one[pair] + n, 9 * other[pair] + m).reshape(at.shape)[near]
        places = distinct(at.T)
        return np.searchsorted(places, at), places[places < n_shared]

    def pieces_at(self, point: Point) -> Wholes:
        """List the pieces that hold a point."""
        seen = np.ones(len(self.columns), dtype=np.bool_)
        for axis in range(2):
            place, (low, high) = self.unit_of(axis, Fraction(point[axis])), self.sides[2 * axis : 2 * axis + 2]
            seen &= (low <= math.floor(place)) & (high >= math.ceil(place))
        return np.flatnonzero(seen)

    def leads(self) -> bool:
        """Tell whether pieces may lead from start to goal: those that touch share the values in their middles."""
        middle, beside = np.repeat(self.controls[:, 4], 4), self.controls[:, 5:].ravel()
        group = joined(int(self.controls.max(initial=-1)) + 1, middle, beside)
        start, goal = (group[self.controls[self.pieces_at(end)]] for end in (self.problem.start, self.problem.goal))
        return bool(np.isin(start, goal).any())

    def within(self, west: int, east: int, south: int, north: int) -> Truths:
        """Tell which pieces are in a rectangle of cells."""
        return (self.columns >= west) & (self.columns < east) & (self.rows >= south) & (self.rows < north)

    def rim(self, west: int, east: int, south: int, north: int) -> tuple[Wholes, list[Wholes]]:
        """Return the pieces that touch a rectangle of cells from outside, and the boxes where they do."""
        beside = self.within(west - 1, east + 1, south - 1, north + 1) & ~self.within(west, east, south, north)
        limits = (np.array([west, east, south, north]) * self.parts - self.parts // 2).tolist()
        sides, meet = common(self.sides, limits)
        (some,) = np.nonzero(beside & meet)
        return some, [side[some] for side in sides]


def common(one: list[Wholes], other: list[Any]) -> tuple[list[Wholes], Truths]:
    """Return what boxes have in common with others (west, east, south, north), and whether they meet."""
    west, east, south, north = ((np.minimum if n % 2 else np.maximum)(one[n], other[n]) for n in range(4))
    return [west, east, south, north], (west <= east) & (south <= north)


# --- Surfaces ---------------------------------------------------------------------------------------------------------


def by_columns(grid: Grid) -> Wholes:
    """Return the order by columns of the control values at places that are around no cell that an edge meets."""
    return np.lexsort((grid.uncut_places, grid.uncut_places % (grid.last[0] + 3)))


def doubled(controls: Wholes, axis: int) -> Wholes:
    """Return twice the Bernstein values, along one axis, of three control values each."""
    first, middle, last = np.moveaxis(controls, axis, 0)
    return np.stack([first + middle, 2 * middle, middle + last], axis=axis)


def bezier(controls: Wholes) -> Wholes:
    """Return four times the Bernstein values of splines with such control values, whole numbers, shape (n, 3, 3)."""
    return doubled(doubled(controls, 2), 1)


def restricted(values: Wholes, ends: Floats) -> Interval:
    """
    Turn Bernstein values on cells, shape (n, 3, 3), into those on boxes in the cells.

    `ends` are west, east, south and north of each box, in cells from the corner. The values on [s, t] are those of the
    polar form ``(1 - s) (1 - t) b_0 + ((1 - s) t + s (1 - t)) b_1 + s t b_2`` at (s, s), (s, t) and (t, t). Weights are
    off by less than ``6 * 2^-53`` and sums by less than ``42 * 2^-53`` of the greatest value.
    """
    found, off = values.astype(np.float64), np.zeros((len(values), 1, 1))
    (part,) = np.nonzero((ends != [0.0, 1.0, 0.0, 1.0]).any(axis=1))
    across, along = (
        np.array([[(1 - p) * (1 - q), (1 - p) * q + p * (1 - q), p * q] for p, q in ((s, s), (s, t), (t, t))])
        for s, t in (ends[part, :2].T, ends[part, 2:].T)
    )
    off[part] = 2.0**-47 * np.abs(found[part]).max(axis=(1, 2), keepdims=True)
    found[part] = along.transpose(2, 0, 1) @ found[part] @ across.transpose(2, 1, 0)
    return Interval(found - off, found + off)


class Surface:
    """
    A biquadratic spline on the pieces of a grid. Its control values are whole numbers times ``2^-exponent``.

    Outside of blocks, it is charged for where it is steeper than the cost, and blocks are charged for. With an end,
    there is a block around that.
    """

    def __init__(self, described: dict[str, Any], array: Reader, grid: Grid, end: Point | None, level: int = 0) -> None:
        demand(level < MOST_LEVELS, "too many surfaces are inside one another")
        grid.problem.spend(len(grid.costs), 100)
        self.grid, self.end = grid, end
        exponent, axes = numbers_of([described["exponent"], described.get("axes", 1)], 2, whole=True)
        demand(abs(exponent) < 1 << 9, "an exponent is out of range")
        demand(axes in (1, 2), "axes are neither 1 nor 2")
        #: One unit of `bezier`.
        self.unit = math.ldexp(0.25, -exponent)
        values = array(described["values"], "i", 1)
        demand(len(values) == grid.controls.max(initial=-1) + 1, "there are more or fewer control values than needed")
        if axes == 2:
            order = by_columns(grid)
            values[order] = np.cumsum(np.cumsum(values[order]))
        values = np.cumsum(np.cumsum(values))
        demand((np.abs(values.astype(np.float64)) < 2.0**46).all(), "a control value is too great")
        self.controls: Wholes = values[grid.controls].reshape(-1, 3, 3)
        self.in_block, self.in_end = (np.zeros(len(grid.columns), dtype=np.bool_) for _ in range(2))
        #: What a difference of two values may be above the cost of a path between the places or, with an end, what a
        #: value may be above the cost of a path to the end.
        self.loss = 0.0
        #: What most is charged for.
        self.fault, most = "it is not higher", 0.0
        for one in [*described["blocks"], *([described["end"]] if end else [])]:
            charge = self._charge_block(one, array, level, end if one is described.get("end") else None)
            self.loss = float(up(self.loss + charge))
            if charge > most:
                most, self.fault = charge, f"the block of cells {one['cells']} of {grid.last[0]} loses {charge:.3g}"
        self._charge_steep()

    def _charge_steep(self) -> None:
        """Measure how steep the surface is against the cost on each piece outside of blocks, and charge for that."""
        grid, n = self.grid, len(self.grid.columns)
        with np.errstate(divide="ignore", invalid="ignore"):
            parts = [self._squared_ratio(part).max(axis=(1, 2)) for part in batches(len(grid.costs))]
        #: (roundings of fewer than 16 products, sums and roots are less than 2^-48)
        ratios = np.sqrt(np.concatenate([np.empty(0), *parts])) * (1.0 + 2.0**-48)
        ratios[(grid.costs <= 1e-100).any(axis=(1, 2))] = np.inf
        self.steepness: Floats = ratios.reshape(len(ratios) // max(n, 1), n).max(axis=0, initial=0.0)
        self.steepness[self.in_block] = 0.0
        wrong = ~np.isfinite(self.steepness)
        demand(not wrong.any(), lambda: f"the slope has no bound in {grid.name(int(wrong.argmax()))}")
        steepest, (steep,) = self.steepness.max(initial=0.0), np.nonzero(self.steepness > 1.0)
        if len(steep):
            # (pieces with the same function count once)
            steep = steep[np.unique(grid.controls[steep], axis=0, return_index=True)[1]]
            spans = np.ptp(bezier(self.controls[steep]).reshape(-1, 9), axis=1) * self.unit
            lost = (Interval(up(math.fsum(spans.tolist()))) * (1.0 - Interval(1.0) / steepest)).hi
            self.loss = float(up(self.loss + lost))
            name = f"{grid.name(int(self.steepness.argmax()))} is {steepest:.12g} times as steep as the cost"
            self.fault = f"{name}, and {len(steep)} such cells lose {lost:.3g}; {self.fault}"

    def _squared_ratio(self, part: slice) -> Floats:
        """
        Compare the squares of the lengths of the Bernstein vectors of the gradient with those of costs, on boxes.

        Vectors on whole cells are means of differences of neighbouring control values: whole numbers.
        """
        grid, total = self.grid, np.zeros((1, 1, 1))
        pieces = np.arange(part.start, part.stop) % len(grid.columns)
        u, ends = self.controls[pieces], self._ends(pieces, [side[part] for side in grid.boxes], 1)
        for axis in range(2):
            # (the gradient is linear along its own axis: the middle value is the mean)
            first, last = np.moveaxis(2 * doubled(np.diff(u, axis=2 - axis), 1 + axis), 2 - axis, 0)
            values = restricted(np.stack([first, (first + last) // 2, last], axis=2 - axis), ends)
            size = (Interval(self.unit) / (grid.step(axis) * float(grid.parts))).hi
            total = total + (np.maximum(values.hi, -values.lo) * size) ** 2
        return np.asarray(total / grid.costs[part] ** 2)

    def _ends(self, pieces: Wholes, sides: list[Wholes], times: int) -> Floats:
        """Return sides of boxes, in so many times finer units, in cells from the corner of the cell of pieces."""
        found = []
        for n, side in enumerate(sides):
            size = self.grid.parts * times
            corner = (self.grid.columns, self.grid.rows)[n // 2][pieces] * size - size // 2
            found.append(np.clip((side - corner) / size, 0.0, 1.0))
        return np.stack(found, axis=1)

    def on(self, pieces: Wholes, sides: list[Wholes], times: int = 1) -> Interval:
        """Return the Bernstein values of the surface on boxes in pieces, whose sides are in finer units."""
        return restricted(bezier(self.controls[pieces]), self._ends(pieces, sides, times)) * self.unit

    def bound(self, point: Point) -> float:
        """Bound the cost of a path from a point to the end of the surface."""
        grid, pieces = self.grid, self.grid.pieces_at(point)
        if self.end and (self.in_end[pieces] >= self.in_block[pieces]).all() and self.in_end[pieces].any():
            # in the block around the end, a path stays in the box, or leaves it
            if self.inner:
                return min(self.inner.bound(point), self.leaving)
            far = length_of(*(Interval(one) - other for one, other in zip(point, self.end, strict=True)))
            return float((far * grid.least_cost).lo)
        if self.in_block[pieces].any():
            return -math.inf
        s, t = (
            np.array([float(grid.cell_of(axis, one) - at) for at in index[pieces].tolist()])
            for axis, (one, index) in enumerate(zip(point, (grid.columns, grid.rows), strict=True))
        )
        values = restricted(bezier(self.controls[pieces]), np.clip(np.stack([s, s, t, t], axis=1), 0.0, 1.0))
        return float(down((values * self.unit).lo.min(initial=math.inf) - self.loss))

    def _charge_block(self, described: dict[str, Any], array: Reader, level: int, end: Point | None) -> float:
        """
        Return by how much more the surface falls from a place on the rim of a block than a way through costs.

        In the block, a rectangle of cells, the surface may be anything. Another surface, on a finer grid over a box
        around the block, bounds the cost of ways from rim to rim or, in a block around an end, from the rim to the end.
        It may be anything in blocks of its own, none of which is beside the rim from outside. In the innermost block
        around an end, that is the distance to the end times the least cost on the grid.
        """
        grid, cells = self.grid, numbers_of(described["cells"], 4, whole=True)
        demand(cells[0] < cells[1] and cells[2] < cells[3], "a block is empty")
        grid.problem.spend(len(grid.columns), 5)
        within, (one, its) = grid.within(*cells), grid.rim(*cells)
        demand(not (self.in_block & within).any(), "two blocks overlap")
        self.in_block |= within
        for axis, at in enumerate(end or ()):
            inside = cells[2 * axis] <= grid.cell_of(axis, at) <= cells[2 * axis + 1]
            demand(inside, "the end is not in the block around it")
        if end:
            self.in_end, self.inner = within, None
        if end and "inside" not in described:
            apart = [
                Interval(np.maximum(np.maximum((low - at).lo, (at - high).lo), 0.0))
                for (low, high), at in zip(grid.places(its), end, strict=True)
            ]
            above = self.on(one, its).hi.max(axis=(1, 2)) - length_of(*apart) * grid.least_cost
            return float(above.hi.max()) if len(one) else 0.0
        inside = described["inside"]
        finer, parts = numbers_of([inside["finer"], inside["parts"]], 2, whole=True)
        box = numbers_of(inside["box"], 4, whole=True)
        around = grid.inside_block(finer, parts, box)
        inner = Surface(inside["surface"], array, around, end, level + 1)
        # the rectangle in cells of the grid inside, and its margins: a way that leaves the box pays twice for the least
        same = [one * finer - finer // 2 for one in cells]
        margins = [float(b - a if n % 2 else a - b) for n, (a, b) in enumerate(zip(same, box, strict=True))]
        demand(min(margins) > 0.0, "a block leaves its box")
        twice = [around.step(axis) * around.parts * (2.0 * around.least_cost) for axis in (0, 0, 1, 1)]
        leaving = min(float((one * margin).lo) for one, margin in zip(twice, margins, strict=True))
        if end:
            self.inner, self.leaving = inner, leaving
        # pairs of boxes on the rim that meet, all in common units
        other, others = around.rim(*same)
        times = finer * around.parts, grid.parts
        demand(len(one) * len(other) < MOST_CELLS, "the rim of a block has too many pieces")
        grid.problem.spend(len(one), len(other), 10)
        both, meet = common([side[:, None] * times[0] for side in its], [side * times[1] for side in others])
        p, q = np.nonzero(meet)
        demand(not inner.in_block[other[q]].any(), "a block inside a block is across its rim")
        if not len(p):
            return 0.0
        both = [side[p, q] for side in both]
        phi = self.on(one[p], both, times[0])
        more = phi - inner.on(other[q], both, times[1])
        charge = up((more.hi.max() if end else up(more.hi.max() - more.lo.min())) + inner.loss)
        beyond = up(up(phi.hi.max() - phi.lo.min()) - leaving)
        # (from rim to rim, a path stays in the box or leaves it; one to the end stays from some place on the rim on)
        return float(up(charge + np.maximum(beyond, 0.0)) if end else np.maximum(charge, beyond))


# --- Cells of constant cost -------------------------------------------------------------------------------------------


#: The sides of a cell (lower, upper, left, right) as places of a lattice from its lower left corner on: row and column.
SIDES = np.array(
    [[(0, 0), (0, 1), (0, 2)], [(2, 0), (2, 1), (2, 2)], [(0, 0), (1, 0), (2, 0)], [(0, 2), (1, 2), (2, 2)]]
)


def with_border(cells: Truths) -> Truths:
    """Tell which places of the lattice are such cells, or sides or corners of them."""
    rows, columns = (2 * n - 1 for n in cells.shape)
    found = np.zeros((rows + 2, columns + 2), dtype=np.bool_)
    for j, i in product(range(3), repeat=2):
        found[j : j + rows : 2, i : i + columns : 2] |= cells
    return found


class Cells:
    """
    Rectangles between lines, and the least cost of a unit of length in each and along each side.

    A line is a strip ``[a, b]``, most often of no width. Start and goal are on lines along both axes. The map is drawn
    together across all strips; sizes of cells are rounded down, so that no path gets longer by that. From here on, they
    are exact. On a lattice, odd rows and columns are those of cells, even ones are lines: sides are in an odd row or
    column, corners in neither.
    """

    def __init__(self, described: dict[str, Any], array: Reader, problem: Problem) -> None:
        is_flat = not problem.threats and not problem.on_earth and all(one.is_flat for one in problem.rasters)
        demand(is_flat, "the cost is not constant on cells")
        self.problem = problem
        self.lines: list[Floats] = [array(described[name], "f", 2) for name in ("x", "y")]
        #: Columns and rows of the corners that are start and goal.
        self.ends = np.zeros((2, 2), dtype=np.int64)
        for axis, line in enumerate(self.lines):
            low, high = problem.bounds[axis], problem.bounds[axis + 2]
            demand(line.shape[1] == 2 and len(line) > 1 and (np.diff(line) >= 0.0).all(), "lines are not begin, end")
            demand((line[1:, 0] > line[:-1, 1]).all(), "lines are not in order")
            demand(line[0, 0] <= low and line[-1, 1] >= high, "lines do not go around the map")
            at = np.array([problem.start[axis], problem.goal[axis]])
            self.ends[:, axis] = np.searchsorted(line[:, 0], at, side="right") - 1
            demand((at <= line[self.ends[:, axis], 1]).all(), "start or goal is not on a line")
        self.shape = len(self.lines[1]) - 1, len(self.lines[0]) - 1
        demand(self.shape[0] * self.shape[1] < MOST_CELLS, "there are too many cells")
        self.sizes = [down(line[1:, 0] - line[:-1, 1]) for line in self.lines]
        demand(min(float(size.min()) for size in self.sizes) > 0.0, "a cell has no size")
        #: On the lattice.
        self.costs = self._costs()
        demand((self.costs < 1e100).all(), "a cost is too great")
        #: Those that no edge of an area meets, with the lines around them, and that are inside.
        around = [Interval(line[:-1, 0], line[1:, 1]) for line in self.lines]
        self.closed = areas_at(problem, around, *np.indices(self.shape)[::-1])[1]

    def _costs(self) -> Floats:
        """Bound the cost from below on the lattice."""
        risk: Any = np.zeros([2 * n + 1 for n in self.shape])
        for raster in self.problem.rasters:
            # (one column more, as an end)
            values = np.pad(raster.corners[0], ((1, 1), (1, 2)))
            columns, rows = (self._touched(raster, axis) for axis in range(2))
            self.problem.spend(len(values) + len(rows), values.shape[1] + len(columns), 10)
            ends = np.array([(some.start, some.stop) for some in columns]).ravel()
            risk = down(risk + [np.minimum.reduceat(values[some].min(axis=0), ends)[::2] for some in rows])
        return np.asarray(np.maximum(down(1.0 + down(self.problem.k * risk)), 1.0))

    def _touched(self, raster: "Raster", axis: int) -> list[slice]:
        """List the columns or rows of a raster, counted from 1, that touch a line, or have a place between lines."""
        places, after, found = raster.knots[axis], 0, []
        for low, high in self.lines[axis].tolist():
            first = bisect_left(places, low)
            between, after = slice(after, first + 1), bisect_right(places, high)
            # (the outer edges belong to the raster)
            found += [between, slice(first + (low == places[0]), after + 1 - (high == places[-1]))]
        return found[1:]


class Net:
    """Points at corners and on sides of the cells that paths may enter, in the order of the lattice."""

    def __init__(self, parts: Floats, cells: Cells, is_open: Truths) -> None:
        self.cells, self.is_open = cells, is_open
        demand(len(parts) < 1 << 10 and (np.diff(parts, prepend=0.0, append=1.0) > 0.0).all(), "parts are not in order")
        self.parts: Floats = np.concatenate([[0.0], parts, [1.0]])
        counts = with_border(is_open).astype(np.int64)
        counts[::2, 1::2] *= len(parts)
        counts[1::2, ::2] *= len(parts)
        counts[1::2, 1::2] = 0
        self.count = int(counts.sum())
        demand(self.count < MOST_PARTS, "there are too many points")
        #: The first point of each place of the lattice, and those at the start and the goal.
        self.first = np.cumsum(counts).reshape(counts.shape) - counts
        columns, rows = 2 * cells.ends.T
        self.ends = self.first[rows, columns]
        demand((counts[rows, columns] > 0).all(), "an end is beside cells that are missing")
        self.rows, self.columns = np.nonzero(is_open)
        # (no path that costs less than what is claimed gets to the border of a cell that is not open)
        self.along = np.where(with_border(~is_open), np.inf, cells.costs)

    def points(self, part: slice) -> Wholes:
        """Return the numbers of the points on the sides of some open cells, shape (n, 4, m + 2)."""
        begin, middle, end = np.moveaxis(self.on_sides(self.first, part), 2, 0)[..., None]
        return np.concatenate([begin, middle + np.arange(len(self.parts) - 2), end], axis=2)

    def on_sides(self, lattice: Any, part: slice) -> Any:
        """Return what a lattice has at the begin, in the middle and at the end of sides of some open cells."""
        row, column = (2 * at[part, None, None] for at in (self.rows, self.columns))
        return lattice[row + SIDES[:, :, 0], column + SIDES[:, :, 1]]

    def least(self, values: Floats) -> Floats:
        """Return the least of the values on the border of each cell, shape (rows, columns)."""
        found = np.full(self.cells.shape, np.inf)
        for part in batches(len(self.rows), len(self.parts) // 4 + 1):
            found[self.rows[part], self.columns[part]] = values[self.points(part)].min(axis=(1, 2))
        return found


class Heights:
    """Values ``W`` at the points of a net, linear in between, which no path falls along faster than it costs."""

    def __init__(self, described: dict[str, Any], array: Reader, net: Net) -> None:
        (exponent,) = numbers_of([described["exponent"]], 1, whole=True)
        demand(abs(exponent) <= 200, "an exponent is too great")
        self.net, self.unit, self.whole = net, 2.0**-exponent, np.cumsum(array(described["values"], "i", 1))
        demand(len(self.whole) == net.count, "there are more or fewer values than points")
        demand((np.abs(self.whole.astype(np.float64)) < 2.0**50).all(), "a value is too great")
        #: Whether the values are the same on the whole border of each cell.
        self.is_flat = True
        for part in batches(len(net.rows), len(net.parts)):
            self._check(part)

    def _check(self, part: slice) -> None:
        """
        Check that ``W(p) - W(q) <= c |p - q|`` for all p and q on the border of some cells.

        Values and places are relative to the lower left corner; all of them are exact.
        """
        net, cells = self.net, self.net.cells
        j, i, numbers = net.rows[part], net.columns[part], net.points(part)
        cells.problem.spend(numbers.size, 100)
        sizes = np.stack([cells.sizes[0][i], cells.sizes[1][j]], axis=1)
        costs, along = cells.costs[2 * j + 1, 2 * i + 1], net.on_sides(net.along, part)[:, :, 1]
        values: Floats = (self.whole[numbers] - self.whole[numbers[:, :1, :1]]) * self.unit
        self.is_flat &= not values.any()
        places = net.parts * sizes[:, [0, 0, 1, 1], None]
        steps, rises = down(np.diff(places)), np.diff(values)
        steep = ~(np.abs(rises) <= down(np.minimum(costs[:, None], along)[:, :, None] * steps)).all(axis=(1, 2))
        # at a corner: p at s on one side and q at t on the other, s and t from there
        slopes = Interval(rises) / Interval(steps)
        for one, other, a, b in ((0, 2, 0, 0), (0, 3, -1, 0), (1, 2, 0, -1), (1, 3, -1, -1)):
            alpha, beta = slopes[:, one, a] * (1.0 + 2.0 * a), slopes[:, other, b] * (1.0 + 2.0 * b)
            for p, q in ((alpha.hi, -beta.lo), (-alpha.lo, beta.hi)):
                most = (Interval(np.maximum(p, 0.0)).square() + Interval(np.maximum(q, 0.0)).square()).hi
                steep |= ~(most <= down(costs * costs))
        steep[unclear_cells(places, sizes, values, costs, cells.problem)] = True
        demand(
            not steep.any(),
            lambda: f"cell ({i[steep.argmax()]}, {j[steep.argmax()]}): values fall faster than the cost",
        )


def unclear_cells(places: Floats, sizes: Floats, values: Floats, costs: Floats, problem: Problem) -> Wholes:
    """
    Return the cells in which values may fall faster than the cost from a place on one side to one on another side.

    Whole sides are compared first. Pairs of runs of points of which that is not clear are halved, down to intervals, of
    which those that meet in a corner have been looked at. The last point of a side is repeated.
    """
    length = 1 << max(places.shape[2] - 2, 0).bit_length()
    some = np.minimum(np.arange(length + 1), places.shape[2] - 1)
    x, y = np.zeros((2, len(values), 4, length + 1))
    x[:, :2], y[:, 2:], x[:, 3], y[:, 1] = places[:, :2, some], places[:, 2:, some], sizes[:, :1], sizes[:, 1:]
    #: Sums are off by less than 2^-49 of their parts.
    off = 2.0**-46 * (np.abs(values).max(axis=(1, 2)) + costs * sizes.sum(axis=1))
    border = x, y, values[:, :, some], costs, off
    cell, one, other = np.indices((len(values), 4, 4)).reshape(3, -1)
    pairs = np.column_stack([cell, one, 0 * cell, other, 0 * cell])[one != other]
    while len(pairs):
        problem.spend(len(pairs), length + 20)
        demand(len(pairs) < MOST_CELLS, "values fall faster than the cost, or too nearly so, at many places")
        pairs = pairs[np.concatenate([unclear(pairs[part], length, *border) for part in batches(len(pairs), length)])]
        if length == 1:
            break
        length //= 2
        pairs = np.concatenate([pairs * [1, 1, 2, 1, 2] + [0, 0, a, 0, b] for a in range(2) for b in range(2)])
    return np.asarray(pairs[:, 0])


def unclear(pairs: Wholes, length: int, x: Floats, y: Floats, values: Floats, costs: Floats, off: Floats) -> Truths:
    """
    Tell of which pairs of runs it is not clear that ``W(p) - W(q) <= c |p - q|`` for all p in one, q in the other.

    It is if some vector g of length c has ``W(p) - g . p <= W(q) - g . q`` for all points p and q of them. Pairs are
    rows: cell, side and number of the run, side and number of the other one.
    """
    cell, *runs = pairs.T
    costs, inner = costs[cell], np.arange(length + 1)[:, None]
    at = [(cell, side, number * length + inner) for side, number in (runs[:2], runs[2:])]
    (x, to_x), (y, to_y), (value, other) = ([of[one] for one in at] for of in (x, y, values))
    # (any direction would do: this one is in the middle of those that serve the ends of both)
    dx, dy, fall = (one[[0, 0, -1, -1]] - two[[0, -1, 0, -1]] for one, two in ((x, to_x), (y, to_y), (value, other)))
    far, mean_x, mean_y = np.hypot(dx, dy), dx.mean(axis=0), dy.mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.arccos(np.where(far > 0.0, np.clip(fall / (costs * far), -1.0, 1.0), -1.0))
    turn = np.arctan2(mean_x * dy - mean_y * dx, mean_x * dx + mean_y * dy)
    turn = np.arctan2(mean_y, mean_x) + 0.5 * ((turn - reach).max(axis=0) + (turn + reach).min(axis=0))
    size = costs * (1.0 - 2.0**-45)
    g_x, g_y = size * np.cos(turn), size * np.sin(turn)
    is_short = up(up(g_x * g_x) + up(g_y * g_y)) <= down(costs * costs)
    highest = (value - (g_x * x + g_y * y)).max(axis=0)
    lowest = (other - (g_x * to_x + g_y * to_y)).min(axis=0)
    meet = (far == 0.0).any(axis=0) & (length == 1)
    return ~np.asarray((is_short & (highest + off[cell] <= lowest)) | meet)


def bound_over_cells(described: dict[str, Any], array: Reader, problem: Problem) -> float:
    """
    Return a bound of the cost of all paths, infinite if there are none.

    From each level to the next, cells are left out that no path enters that costs less than the limit.
    """
    cells, most, bound = Cells(described, array, problem), math.inf, 0.0
    is_open, limit = ~cells.closed, limit_of(described)
    demand(0 < len(described["levels"]) < 1 << 6, "there are no points on cells, or too many levels")
    for one in described["levels"]:
        net = Net(array(one["parts"], "f", 1), cells, is_open)
        total, ways = np.zeros(net.count), [name for name in ("to_goal", "to_start") if name in one]
        for name in ways:
            heights, (begin, end) = Heights(one[name], array, net), net.ends[:: 1 if name == "to_goal" else -1]
            above = (heights.whole - heights.whole[end]) * heights.unit
            if heights.is_flat and above[begin] > 0.0:
                return most
            bound, total = max(bound, min(most, float(above[begin]))), down(total + above)
        most, is_open = limit, is_open & ~((net.least(total) >= limit) & (len(ways) == 2))
    return bound


# --- The bounds -------------------------------------------------------------------------------------------------------


def lower_bound(described: dict[str, Any], array: Reader, problem: Problem) -> tuple[float, str]:
    """
    Return a bound of the cost of all paths, infinite if there are none, and what has kept it from being greater.

    From each grid to the next, pieces are dropped that no path passes that costs less than the limit.
    """
    limit = limit_of(described)
    demand(described["grids"], "there is no grid")
    most, bound, fault = math.inf, 0.0, "no surface says more"
    grid: Grid | None = None
    surfaces: list[Surface] = []
    for number, one in enumerate(described["grids"], 1):
        (parts,) = numbers_of([one["parts"]], 1, whole=True)
        if grid is None:
            last = numbers_of(one["last"], 2, whole=True)
            grid = Grid.over(problem, last, parts, [0, last[0] + 1, 0, last[1] + 1])
        else:
            demand(len(surfaces) == 2, "a grid that is made finer has one surface")
            most, grid = limit, grid.finer(kept(surfaces[0], surfaces[1], limit), parts)
        if not grid.leads():
            return most, "the limit is less"
        surfaces = []
        for name, end, other in (("to_goal", problem.goal, problem.start), ("to_start", problem.start, problem.goal)):
            if name in one:
                surfaces.append(Surface(one[name], array, grid, end))
                found = float(np.minimum(most, surfaces[-1].bound(other)))
                if found > bound:
                    bound, fault = found, f"on grid {number}, {name}: {surfaces[-1].fault}"
    return bound, fault


def kept(to_goal: Surface, to_start: Surface, limit: float) -> Truths:
    """Tell which pieces a path that costs less than a limit may pass; those in blocks are kept."""
    total = down(bezier(to_goal.controls) * to_goal.unit + bezier(to_start.controls) * to_start.unit).min(axis=(1, 2))
    passes = ~(down(down(total - to_goal.loss) - to_start.loss) >= limit)
    return np.asarray(passes | to_goal.in_block | to_start.in_block)


# --- The path ---------------------------------------------------------------------------------------------------------


def check_free(problem: Problem, path: Floats) -> None:
    """
    Check that a path is nowhere inside of areas; it may touch them.

    Between places where a segment meets edges, it is inside or outside as a whole. All of this is exact.
    """
    low, high = (way(problem.edges[:, :2], problem.edges[:, 2:]) for way in (np.minimum, np.maximum))
    demand(not is_inside(problem, *exact(path[0])), "the path begins inside an area")
    for n, (begin, end) in enumerate(pairwise(path)):
        near = ((low <= np.maximum(begin, end)) & (high >= np.minimum(begin, end))).all(axis=1)
        problem.spend(len(near) + 1000 * near.sum() + 100)
        (x, y), (dx, dy) = exact(begin), exact(end) - exact(begin)
        ax, ay, bx, by = exact(problem.edges[near].T)
        across, to_edge = dx * (by - ay) - dy * (bx - ax), (ax - x) * (by - ay) - (ay - y) * (bx - ax)
        # (edges along a segment end where others of their outlines meet its line)
        some = across != 0
        cuts = {Fraction(0), Fraction(1), *(to_edge[some] / across[some])}
        for first, last in pairwise(sorted(t for t in cuts if 0 <= t <= 1)):
            t = (first + last) / 2
            demand(not is_inside(problem, x + t * dx, y + t * dy), f"the path crosses an area after waypoint {n}")


def exact(numbers: Floats) -> Any:
    """Return floats as fractions."""
    return np.array([Fraction(one) for one in numbers.ravel().tolist()], dtype=object).reshape(numbers.shape)


def is_inside(problem: Problem, x: Fraction, y: Fraction) -> bool:
    """Tell whether a point is inside of areas, and not on an edge."""
    edges, margin = problem.edges, 2.0**-40 * max(1.0, abs(float(y)))
    below, above = edges[:, [1, 3]].min(axis=1) - margin, edges[:, [1, 3]].max(axis=1) + margin
    near = edges[(below <= float(y)) & (above >= float(y))]
    problem.spend(len(edges) + 1000 * len(near))
    ax, ay, bx, by = exact(near.T)
    side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    is_on = (side == 0) & ((ax - x) * (bx - x) <= 0) & ((ay - y) * (by - y) <= 0)
    crosses = ((ay > y) != (by > y)) & ((side > 0) == (by > ay))
    return bool(not is_on.any() and crosses.sum() % 2 == 1)


def upper_bound(problem: Problem, path: Floats) -> float:
    """
    Bound the cost of a path from above.

    The rule of Gauss with two places is off by at most ``l^5 / 4320 max |F''''|`` on a part of length l. The latter is
    at most ``s_4 + 4 s_3 s_1 + 3 s_2^2 + 6 s_2 s_1^2 + s_1^4``, where s_n sums up the greatest n-th derivatives of all
    f_i: p / s^n times 0.607, 1, 1.381 and 3 for n from 1 to 4. With ``s_n <= r^n``, that is at most ``15 r^4``. For
    rasters, see `risk_of_raster`.
    """
    demand(path.shape[1] == 2 and len(path) > 0, "a path is not a list of points")
    demand(
        path[0].tolist() == problem.start and path[-1].tolist() == problem.goal, "the path does not join start and goal"
    )
    demand(((path >= problem.bounds[:2]) & (path <= problem.bounds[2:])).all(), "the path leaves the map")
    check_free(problem, path)
    sides = [Interval(path[1:, axis]) - path[:-1, axis] for axis in range(2)]
    length = length_of(*sides).hi
    total = cost = float(up(math.fsum(length.tolist())))
    if problem.threats and problem.k > 0.0:
        # (the rate of change: no n-th root of s_n is greater)
        rate = max(
            math.fsum(most * peak / spread**n for _, _, spread, peak in problem.threats) ** (1.0 / n)
            for n, most in enumerate((0.607, 1.0, 1.381, 3.0), 1)
        )
        bend = 15.0 * rate**4 * (1.0 + 1e-9)
        # so fine that the error is a part of 1e-7 of the length
        finest = max((4320e-7 / max(problem.k * bend, 1e-300)) ** 0.25, total / MOST_STEPS)
        counts = np.maximum(np.ceil(length / finest), 1.0)
        problem.spend(counts.sum(), 10 + 2 * len(problem.threats))
        which, number = ranges(np.zeros(len(counts)), counts - 1.0)
        for part in batches(len(which)):
            segment, n = which[part], counts[which[part]]
            step = Interval(length[segment]) / n
            risk = step.square().square() * bend / 4320.0
            for place in (0.5 - GAUSS, 0.5 + GAUSS):
                t, clear = (Interval(number[part].astype(np.float64)) + place) / n, Interval(np.ones(len(segment)))
                x, y = (t * side[segment] for side in sides)
                for at_x, at_y, spread, peak in problem.threats:
                    # (the difference of two places is closer than a place, on a small map far from (0, 0))
                    dx, dy = x + (Interval(path[segment, 0]) - at_x), y + (Interval(path[segment, 1]) - at_y)
                    square = (dx.square() + dy.square()) / Interval(spread).square()
                    clear = clear * (1.0 - exp(square * -0.5) * peak)
                risk = risk + (1.0 - clear) * 0.5
            cost = float(up(cost + math.fsum((risk * step * problem.k).hi.tolist())))
    for raster in problem.rasters:
        cost = float(up(cost + risk_of_raster(problem, raster, path, length) * problem.k * (1.0 + 4.0 * ULP)))
    return cost


def risk_of_raster(problem: Problem, raster: Raster, path: Floats, length: Floats) -> float:
    """Bound the integral of a raster along a path from above, patch by patch: on each it is a quadratic function."""
    total = 0.0
    for begin, end, far in zip(path[:-1].tolist(), path[1:].tolist(), length.tolist(), strict=True):
        at = [Fraction(one) for one in begin]
        side = [Fraction(b) - a for a, b in zip(at, end, strict=True)]
        cuts = {Fraction(0), Fraction(1)}
        for axis in range(2):
            low, high = sorted((begin[axis], end[axis]))
            knots = raster.knots[axis][bisect_right(raster.knots[axis], low) : bisect_left(raster.knots[axis], high)]
            cuts |= {(one - at[axis]) / side[axis] for one in knots}
        problem.spend(len(cuts), 5000)
        for first, last in pairwise(sorted(cuts)) if far > 0.0 else ():
            points = [[at[axis] + t * side[axis] for axis in range(2)] for t in (first, (first + last) / 2, last)]
            a, b, c = raster.exact(points, points[1])
            mean = (a + 4 * b + c) / 6
            total = float(up(total + up(up(float(mean * (last - first))) * far)))
    return total


# --- Files ------------------------------------------------------------------------------------------------------------


class Result(TypedDict):
    """What a proof file proves: no path costs less than `lower`, and its path costs at most `upper`."""

    lower: float
    upper: float
    problem: str


def numbers_of(x: Any, count: int, *, whole: bool = False) -> Any:
    """Return so many numbers of a file, whole ones or finite floats."""
    demand(isinstance(x, list) and len(x) == count, "there are more or fewer numbers than needed")
    for one in x:
        demand(isinstance(one, int if whole else int | float) and not isinstance(one, bool), "a number is none")
        demand(abs(one) < (1 << 50 if whole else MOST), "a number is not finite, or too great")
    return x if whole else [float(one) for one in x]


def limit_of(described: dict[str, Any], name: str = "limit") -> float:
    """Return a number of a file; null stands for infinity."""
    return math.inf if described[name] is None else float(numbers_of([described[name]], 1)[0])


def check(file: Any, most_work: float = MOST_WORK) -> Result:
    """
    Check a proof file.

    Parameters
    ----------
    file
        Its name, or a stream of bytes.
    most_work
        Numbers that are computed, at most: a file that asks for more is refused.

    Raises
    ------
    Refused
        If it does not prove what it claims.
    """
    try:
        with warnings.catch_warnings(action="ignore"), zipfile.ZipFile(file) as archive:
            return proven(description(archive), _reader(archive), most_work)
    except Refused:
        raise
    except Exception as error:  # any error that a file leads to is a fault of the file
        msg = f"the file is not a proof: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
        raise Refused(msg) from error


def description(archive: zipfile.ZipFile) -> Any:
    """Read what a file says."""
    return json.loads(_part(archive, "proof.json", MOST_TEXT))


def _part(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """Read a part of a file, of at most so many bytes; if its name ends in ``.bz2``, that is unpacked."""
    held = archive.getinfo(name)
    demand(held.file_size < most, "the description, or the arrays that are named, are too large together")
    # (of other methods, zipfile unpacks all there is before it looks at the size)
    is_plain = held.compress_type in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
    demand(is_plain, "a part is compressed by another method than deflate")
    with archive.open(held) as stream:
        data = stream.read(held.file_size)
    if name.endswith(".bz2"):
        unpacker = bz2.BZ2Decompressor()
        data = unpacker.decompress(data, most)
        demand(unpacker.eof, "the arrays that are named are too large together, or one is cut off")
    return data


def _reader(archive: zipfile.ZipFile) -> Reader:
    left = [MOST_IN_ALL]

    def array(name: str, kind: str, axes: int) -> Any:
        # (a name goes into messages; and a file may name an array as often as it likes)
        demand(name.isascii() and name.isprintable(), "a name of an array is not plain")
        found = np.lib.format.read_array(io.BytesIO(_part(archive, name, left[0])), allow_pickle=False)
        left[0] -= 8 * found.size
        demand(left[0] > 0, "the arrays that are named are too large together")
        demand(found.ndim == axes and found.dtype.kind == kind, f"{name} is of another kind")
        numbers = found.astype(np.float64 if kind == "f" else np.int64)
        demand(kind == "i" or (np.abs(numbers) < MOST).all(), f"{name} is not finite, or too great")
        return numbers

    return array


def proven(described: dict[str, Any], array: Reader, most_work: float = MOST_WORK) -> Result:
    """Check what a file describes (errors as `check`)."""
    known = described.get("format") == FORMAT and described.get("version") == VERSION
    demand(known, f"the format is not {FORMAT} of version {VERSION}")
    problem = Problem(described["problem"], array, most_work)
    lower = limit_of(described, "lower")
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        if "cells" in described:
            bound, fault = bound_over_cells(described["cells"], array, problem), "the values are not higher"
        else:
            bound, fault = lower_bound(described, array, problem)
        demand(bound >= lower, lambda: f"the surfaces prove {bound!r}, which is less than {lower!r}: {fault}")
        upper = upper_bound(problem, array(described["path"], "f", 2)) if "path" in described else math.inf
    return {"lower": lower, "upper": upper, "problem": digest(described["problem"], array)}


def digest(described: dict[str, Any], array: Reader) -> str:
    """Return a digest of a problem: of its description, with digests instead of the names of arrays."""

    def named(name: str) -> str:
        values = array(name, "f", 2)
        return hashlib.sha256(repr(values.shape).encode() + values.astype("<f8").tobytes()).hexdigest()

    rings = [named(one) for one in described["rings"]]
    rasters = [one | {"values": named(one["values"])} for one in described["rasters"]]
    whole = described | {"threats": named(described["threats"]), "rings": rings, "rasters": rasters}
    return hashlib.sha256(json.dumps(whole, sort_keys=True).encode()).hexdigest()


def main(arguments: list[str]) -> int:
    """Check a file, and print what it proves."""
    file, *more = arguments or [""]
    if not file or more[:1] not in ([], ["--most-work"]) or len(more) not in {0, 2}:
        sys.stdout.write(f"{__doc__}\n")
        return 2
    try:
        found = check(file, float(more[1]) if more else MOST_WORK)
    except (Refused, ValueError) as error:
        sys.stdout.write(f"refused: {error}\n".encode("ascii", "backslashreplace").decode())
        return 1
    no_less = f"no path costs less than {found['lower']!r}" if math.isfinite(found["lower"]) else "there is no path"
    at_most = f"; this path costs at most {found['upper']!r}" if math.isfinite(found["upper"]) else ""
    sys.stdout.write(f"verified: {no_less}{at_most}\nproblem {found['problem']}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

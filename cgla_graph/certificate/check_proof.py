"""
Check a proof file: a lower bound of the cost of all paths, and an upper bound of the cost of one.

This is one file, which needs Python and NumPy alone: copy it anywhere. It believes nothing that a proof file says. Such
a file holds a problem, a path and the values of surfaces; grids are laid here, and all that is printed is computed
here, in interval arithmetic. ``docs/how-it-works/proof-files.md`` states the argument and the format, and this file
follows its sections.

Usage: ``python check_proof.py NAME.proof [--most-work N]``. It prints what is proven (exit 0), or what is wrong (exit
1). A file that asks for more than N numbers to be computed is refused before that is done.
"""

import hashlib
import io
import json
import math
import sys
import zipfile
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import reduce
from itertools import pairwise, permutations, product
from typing import Any, TypeAlias, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
Wholes: TypeAlias = NDArray[np.int64]
Truths: TypeAlias = NDArray[np.bool_]
Point: TypeAlias = tuple[float, float]
#: Reads an array of a proof file: name, ``f`` for floats or ``i`` for whole numbers, number of axes.
Reader: TypeAlias = Callable[[str, str, int], Any]

FORMAT, VERSION = "path-cost-proof", 3
#: Bytes of the description, of one array, and of all that is read, uncompressed.
MOST_TEXT, MOST_BYTES, MOST_IN_ALL = 1 << 24, 1 << 28, 1 << 30
#: Surfaces inside surfaces; cells of a grid; parts of cells; parts of a path; and numbers that are computed in all.
MOST_LEVELS, MOST_CELLS, MOST_PARTS, MOST_STEPS, MOST_WORK = 8, 1 << 21, 1 << 24, 1_000_000, 1e10
#: Boxes in one batch; parts of each part of a rim around an end.
BATCH, RIM_PARTS = 1 << 14, 32
#: Risk below this part of a unit of cost is not looked at, which lowers the cost.
FAINT = 1e-8
#: Patches of a raster along the side of a box, at most, for which more than a constant is computed.
FEW_PATCHES = 4
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

    def within(self, least: float, most: float) -> "Interval":
        """Return the parts between two numbers: those of numbers that are known to be there."""
        return Interval(np.clip(self.lo, least, most), np.clip(self.hi, least, most))


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
        self.start, self.goal = point_of(described["start"]), point_of(described["goal"])
        self.bounds = [number_of(one) for one in described["bounds"]]
        self.k = number_of(described["k"])
        x_min, y_min, x_max, y_max = self.bounds
        demand(x_min < x_max and y_min < y_max, "the bounds are empty")
        for x, y in (self.start, self.goal):
            demand(x_min <= x <= x_max and y_min <= y <= y_max, "an end is outside of the bounds")
        demand(self.k >= 0.0, "k is negative")
        self.threats: list[list[float]] = array(described["threats"], "f", 2).tolist()
        for _, _, spread, peak in self.threats:
            demand(spread > 0.0 and 0.0 <= peak <= 1.0, "a spread is not above 0, or a peak not between 0 and 1")
        self.rasters = [Raster(one, array) for one in described["rasters"]]
        rings = [array(name, "f", 2) for name in described["rings"]]
        #: Both ends of each edge of the areas, shape (n, 4).
        self.edges: Floats = np.concatenate(
            [np.empty((0, 4)), *(np.column_stack([ring, np.roll(ring, -1, axis=0)]) for ring in rings)]
        )
        self.on_earth = described["on_earth"] is True
        self.left = float(most_work)

    def spend(self, *numbers: float) -> None:
        """Count numbers that are about to be computed, a product; refuse a file that asks for too many."""
        self.left -= math.prod(map(float, numbers))
        demand(self.left >= 0.0, "the file asks for more work than is allowed (--most-work N allows more)")

    def lower_costs(self, grid: "Grid", sides: list[Wholes]) -> Floats:
        """Return nine numbers for each box of a grid, of which the cost there is at least the mean (Bernstein)."""
        self.spend(len(sides[0]), 10 + len(self.threats))
        x, y = grid.places(sides)
        middle_x, middle_y = ((side[0] + side[1]) * 0.5 for side in (x, y))
        half_x, half_y = ((side[1] - side[0]) * 0.5 for side in (x, y))
        reach = length_of(half_x, half_y).hi
        risk, slope_x, slope_y, bend = self._risk(middle_x, middle_y, reach)
        lost = Interval(reach).square() * bend * 0.5
        rise_x, rise_y, place = slope_x * half_x, slope_y * half_y, np.array([-1.0, 0.0, 1.0])
        each = np.s_[:, None, None]
        total = (risk - lost)[each] + rise_x[each] * place + rise_y[each] * place[:, None]
        for raster in self.rasters:
            total = total + raster.floor(grid, sides)
        scale = self._scale(x, y) if self.on_earth else Interval(np.ones(len(reach)))
        found = ((total * self.k + 1.0) * scale[each]).lo
        found[np.isnan(found)] = -np.inf
        # where much is lost, a constant may be the better bound
        (poor,) = np.nonzero(~((lost * self.k * scale).hi < 0.1 * found.min(axis=(1, 2))))
        constant = self._constant_costs(grid, [side[poor] for side in sides], scale[poor])
        least, most = found[poor].min(axis=(1, 2)), found[poor].max(axis=(1, 2))
        better = (constant > found[poor, 1, 1]) | (constant * constant > least * most)
        found[poor[better]] = constant[better, None, None]
        return found

    def _constant_costs(self, grid: "Grid", sides: list[Wholes], scale: Interval) -> Floats:
        """Bound the cost from below on boxes by constants, shape (n,)."""
        x, y = grid.places(sides)
        clear = Interval(np.ones(len(x[0].lo)))
        for at_x, at_y, spread, peak in self.threats:
            far = [Interval(np.maximum((side[1] - at).hi, (at - side[0]).hi)) for side, at in ((x, at_x), (y, at_y))]
            square = (far[0].square() + far[1].square()) / Interval(spread).square()
            clear = clear * (1.0 - exp(square * -0.5) * peak)
        risk = Interval(np.maximum((1.0 - clear).lo, 0.0))
        for raster in self.rasters:
            risk = risk + raster.floor(grid, sides).min(axis=(1, 2))
        return ((risk * self.k + 1.0) * scale).lo

    def _risk(self, x: Interval, y: Interval, reach: Floats) -> tuple[Interval, Interval, Interval, Floats]:
        """
        Enclose the risk of threats and its slopes at points, and bound how much it bends down within reach of them.

        With ``q = 1 / s^2``, at d from a point, ``1 - f_i <= u_i = 1 - f_i(0) + f_i(0) q_i (r_i . d + d^2 / 2)``, as
        ``exp t >= 1 + t``; values and slopes of both sides are equal at d = 0. So ``F(d) >= F(0) + grad F(0) . d - M
        d^2 / 2``, where no eigenvalue of the Hessian of ``prod u_i`` is above ``M = prod u_i (sum f_i q_i / u_i + sum
        |grad u_i| |grad u_j| / (u_i u_j))`` over all i and j that differ, with the greatest values within reach.
        """
        n = len(reach)
        risk, slope_x, slope_y, clear = (Interval(np.full(n, one), np.full(n, one)) for one in (0.0, 0.0, 0.0, 1.0))
        shares, slopes, squares, product = (np.full(n, one) for one in (0.0, 0.0, 0.0, 1.0))
        far = math.sqrt(-2.0 * math.log(FAINT / max(self.k, 1.0) / max(len(self.threats), 1)))
        for at_x, at_y, spread, peak in self.threats:
            (near,) = np.nonzero(np.hypot(x.lo - at_x, y.lo - at_y) < spread * far)
            dx, dy, around = x[near] - at_x, y[near] - at_y, Interval(reach[near])
            q, square, before = Interval(1.0) / Interval(spread).square(), dx.square() + dy.square(), clear[near]
            value = exp(square * q * -0.5) * peak
            share, away, rest = value * q, square.root(), 1.0 - value
            factor = (rest + share * around * (away + around * 0.5)).hi
            slope = up((share * (away + around)).hi / factor)
            shares[near], slopes[near] = up(shares[near] + up(share.hi / factor)), up(slopes[near] + slope)
            squares[near], product[near] = down(squares[near] + down(slope * slope)), up(product[near] * factor)
            slope_x.put(near, slope_x[near] * rest - share * dx * before)
            slope_y.put(near, slope_y[near] * rest - share * dy * before)
            risk.put(near, risk[near] + before * value)
            clear.put(near, before * rest)
        pairs = np.maximum(up(up(slopes * slopes) - squares), 0.0)
        return risk, slope_x, slope_y, up(product * up(shares + pairs))

    @staticmethod
    def _scale(x: list[Interval], y: list[Interval]) -> Interval:
        """
        Bound the length on the Earth of a unit of the plane, from below.

        It is ``sin t / t >= 1 - t^2 / 6 + t^4 / 120 - t^6 / 5040`` or more, at t times the polar radius.
        """
        far = [Interval(np.maximum(np.abs(side[0].lo), np.abs(side[1].hi))) for side in (x, y)]
        t = (far[0].square() + far[1].square()) / Interval(POLAR_RADIUS).square()
        series = 1.0 - t / 6.0 * (1.0 - t / 20.0 * (1.0 - t / 42.0))
        return Interval(np.maximum(series.lo, 0.0))


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
        bounds = [number_of(one) for one in described["bounds"]]
        self.is_flat = described["interpolation"] == "nearest"
        demand(self.is_flat or described["interpolation"] == "bilinear", "an interpolation is not known")
        demand(values.size > 0 and (values >= 0.0).all(), "a raster is empty, or negative somewhere")
        demand(max(values.shape) < 1 << 18, "a raster has too many rows or columns")
        demand(bounds[0] < bounds[2] and bounds[1] < bounds[3], "the bounds of a raster are empty")
        self.knots: list[list[Fraction]] = []
        for axis in range(2):
            n, low, high = values.shape[1 - axis], Fraction(bounds[axis]), Fraction(bounds[axis + 2])
            middles = [0, *(2 * i + 1 for i in range(n)), 2 * n]
            halves = range(0, 2 * n + 1, 2) if self.is_flat else middles
            self.knots.append([low + (high - low) * step / (2 * n) for step in halves])
        self.floats = [np.array([float(one) for one in knots]) for knots in self.knots]
        self.enclosed = [Interval(down(one), up(one)) for one in self.floats]
        self.corners = [values] * 4
        if not self.is_flat:
            wide = np.pad(values, 1, mode="edge")
            self.corners = [wide[:-1, :-1], wide[:-1, 1:], wide[1:, :-1], wide[1:, 1:]]

    def patches(self, grid: "Grid", sides: list[Wholes]) -> tuple[list[tuple[Wholes, Wholes]], Truths]:
        """Return the first and last patch along each axis that each box meets, and whether no other risk does."""
        found, inside = [], np.ones(len(sides[0]), dtype=np.bool_)
        for axis in range(2):
            low, high = sides[2 * axis], sides[2 * axis + 1]
            (below, above), most = grid.around(axis, self.knots[axis]), len(self.knots[axis]) - 2
            first = np.searchsorted(above, low, side="right") - 1
            last = np.searchsorted(below, high, side="left") - 1
            inside &= (first >= 0) & (last <= most)
            # on the border of the map, a patch beyond it may be the lesser one, and no other box meets it
            beyond = np.searchsorted(above, low, side="left") - 1, np.searchsorted(below, high, side="right") - 1
            first = np.where(low <= 0, np.maximum(beyond[0], 0), first)
            last = np.where(high >= grid.units[axis], np.minimum(beyond[1], most), last)
            found.append((first, last))
        return [(np.where(inside, first, 0), np.where(inside, last, 0)) for first, last in found], inside

    def floor(self, grid: "Grid", sides: list[Wholes]) -> Floats:
        """
        Return nine numbers for each box, of which the risk is at least the mean (Bernstein), shape (n, 3, 3).

        A patch has such numbers on the whole box. The least ones of all patches that the box meets will do.
        """
        (columns, rows), inside = self.patches(grid, sides)
        across, along = (int((last - first).max(initial=0)) + 1 for first, last in (columns, rows))
        # (a step of the loop takes as long as many numbers)
        grid.problem.spend(len(inside) + 1000, across, along)
        x, y = grid.places(sides)
        least, found = np.full((len(inside), 1, 1), np.inf), np.full((len(inside), 3, 3), np.inf)
        for i, j in offsets(columns, rows):
            corners = [corner[j, i] for corner in self.corners]
            least = np.minimum(least, np.min(corners, axis=0)[:, None, None])
            if self.is_flat or max(across, along) > FEW_PATCHES + 1:
                continue
            s, t = (
                [(one - knots[n]) / (knots[n + 1] - knots[n]) for one in side]
                for side, knots, n in ((x, self.enclosed[0], i), (y, self.enclosed[1], j))
            )
            low, high = (_with_middle(*(bilinear(p, q, corners).lo for p in s)) for q in t)
            found = np.minimum(found, _with_middle(low, high))
        # (where several patches meet, a constant may be better)
        poor = ~(found.mean(axis=(1, 2)) >= least[:, 0, 0]) | np.isinf(found[:, 0, 0])
        found = np.where(poor[:, None, None], least, found)
        return np.where(inside[:, None, None], found, 0.0)

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


def offsets(columns: tuple[Wholes, Wholes], rows: tuple[Wholes, Wholes]) -> Iterator[tuple[Wholes, Wholes]]:
    """Yield columns and rows of all that is between the first and the last ones; smaller ranges repeat their last."""
    for dj in range(int((rows[1] - rows[0]).max(initial=0)) + 1):
        for di in range(int((columns[1] - columns[0]).max(initial=0)) + 1):
            yield np.minimum(columns[0] + di, columns[1]), np.minimum(rows[0] + dj, rows[1])


# --- Grids ------------------------------------------------------------------------------------------------------------


def ranges(first: ArrayLike, last: ArrayLike) -> tuple[Wholes, Wholes]:
    """Return all whole numbers from first to last ones, and before them which range each is of; some may be empty."""
    first, counts = np.asarray(first), np.maximum(np.subtract(last, first) + 1, 0)
    demand(counts.sum() < MOST_PARTS, "there are too many parts of cells, or of a path")
    counts = counts.astype(np.int64)
    which = np.repeat(np.arange(len(counts)), counts)
    return which, first.astype(np.int64)[which] + np.arange(len(which)) - (np.cumsum(counts) - counts)[which]


def batches(n: int, size: int = 1) -> list[slice]:
    """Return slices of n items of a size."""
    step = max(BATCH // size, 1)
    return [slice(first, min(first + step, n)) for first in range(0, n, step)]


def all_cells(west: int, east: int, south: int, north: int) -> tuple[Wholes, Wholes]:
    """Return columns and rows of all cells of a rectangle, row by row."""
    demand(west <= east and south <= north, "a box ends before it begins")
    demand((east - west + 1) * (north - south + 1) < MOST_CELLS, "a grid or a block is too large")
    columns, rows = np.meshgrid(np.arange(west, east), np.arange(south, north))
    return columns.ravel(), rows.ravel()


def joined(n: int, one: Wholes, other: Wholes) -> Wholes:
    """Return for each of n items the least one that pairs lead to."""
    least = np.arange(n)
    while True:
        low = np.minimum(least[one], least[other])
        new = least.copy()
        for ends in (one, other, least[one], least[other]):
            np.minimum.at(new, ends, low)
        new = new[new]
        if (new == least).all():
            return least
        least = new


def gaps(problem: Problem, columns: Interval, rows: Interval) -> tuple[Wholes, Wholes, Wholes, Truths]:
    """
    Find the rectangles that no edge of an area meets: rows, first columns, columns after the last, which are inside.

    Columns and rows are intervals, in order. Edges meet all rectangles of a row that are not in a gap. A gap is inside
    if an odd number of edges that cross the middle of the row is before it.
    """
    ax, ay, bx, by = problem.edges.T
    first = np.searchsorted(rows.hi, np.minimum(ay, by))
    last = np.searchsorted(rows.lo, np.maximum(ay, by), side="right") - 1
    problem.spend(np.maximum(last - first + 1, 0).sum() + len(rows.lo), 10)
    edge, row = ranges(first, last)
    ax, ay, bx, by = problem.edges[edge].T
    rise = np.where(by == ay, 1.0, by - ay)
    # (places on an edge are off by less than 2^-48 of its coordinates)
    x, to_x = (
        ax + np.where(by == ay, end, np.clip((side[row] - ay) / rise, 0.0, 1.0)) * (bx - ax)
        for side, end in ((rows.lo, 0.0), (rows.hi, 1.0))
    )
    off = 2.0**-48 * (np.abs(ax) + np.abs(bx))
    # as numbers, row by row, with one more at both ends that counts as met
    width = len(columns.lo) + 2
    starts = np.arange(len(rows.lo)) * width
    begin = row * width + np.searchsorted(columns.hi, np.minimum(x, to_x) - off) + 1
    end = row * width + np.searchsorted(columns.lo, np.maximum(x, to_x) + off, side="right") + 1
    middle = 0.5 * (rows.lo + rows.hi)[row]
    crossed = np.sort(end[(ay > middle) != (by > middle)])
    begin = np.concatenate([begin, starts, starts + width - 1])
    order = np.argsort(begin, kind="stable")
    end = np.maximum.accumulate(np.concatenate([end, starts + 1, starts + width])[order])
    begin = begin[order]
    (free,) = np.nonzero(begin[1:] > end[:-1])
    low, high = end[free], begin[free + 1]
    inside = np.searchsorted(crossed, low, side="right") % 2 == 1
    return low // width, low % width - 1, high - low // width * width - 1, inside


class Grid:
    """
    Cells, cut by areas into pieces, which are what paths may pass.

    Cell (i, j) is around node (i, j), where the map is from node (0, 0) to node `last`. Units are cells divided by an
    even number of parts: cell i is from unit ``i parts - parts / 2`` on. A cell that no edge of an area meets is a
    piece, or closed if it is inside an area. Another one consists of unit squares: those that no edge meets are closed
    if they are inside. The others are gathered into pieces: squares that touch, corners included, belong together. All
    there is of a piece is a list of rectangles (`owners`, `rectangles`), of which there is one in cells that are not
    cut. Without parts, areas are not looked at.
    """

    def __init__(self, problem: Problem, last: list[int], parts: int, columns: Wholes, rows: Wholes) -> None:
        demand(all(2 <= one < 1 << 30 for one in last), "a grid has too few cells, or too many")
        demand(0 <= parts <= 1 << 12 and parts % 2 == 0, "the parts of a cell are not an even number")
        self.problem, self.last, self.parts = problem, last, parts or 2
        self.grids: dict[Any, Grid] = {}
        self.knots: dict[int, tuple[Wholes, Wholes]] = {}
        #: The units of the map along each axis.
        self.units = [one * self.parts for one in last]
        demand(max(self.units) < 1 << 30, "a grid is too fine")
        order = np.unique(rows * (last[0] + 1) + columns)
        demand(len(order) < MOST_CELLS, "a grid has too many cells")
        problem.spend(len(order), 100)
        #: Columns and rows of the cell of each piece, in order, and whether an edge meets it.
        self.columns, self.rows = order % (last[0] + 1), order // (last[0] + 1)
        self.is_cut = np.zeros(len(order), dtype=np.bool_)
        self.owners, self.rectangles = np.arange(len(order)), self._sides(self.columns, self.rows)
        touching = self._cut() if parts and len(problem.edges) and len(order) else None
        #: The numbers of the control values around each piece, and the places of those that come first.
        self.controls, self.uncut_places = self._numbered(touching)
        #: The pieces in boxes, which hold what is open of them, and nine numbers for the cost there.
        self.in_box, self.boxes = self._boxes()
        costs = [problem.lower_costs(self, self.box(some)) for some in batches(len(self.in_box))]
        self.costs: Floats = np.concatenate([np.empty((0, 3, 3)), *costs])

    def unit_of(self, axis: int, place: Fraction) -> Fraction:
        """Return a place along an axis in units, exactly."""
        low, high = Fraction(self.problem.bounds[axis]), Fraction(self.problem.bounds[axis + 2])
        return (place - low) * self.units[axis] / (high - low)

    def around(self, axis: int, knots: list[Fraction]) -> tuple[Wholes, Wholes]:
        """Return the whole units below and above the knots of a raster, which are looked for once."""
        if id(knots) not in self.knots:
            units = [self.unit_of(axis, one) for one in knots]
            self.knots[id(knots)] = np.array([math.floor(u) for u in units]), np.array([math.ceil(u) for u in units])
        return self.knots[id(knots)]

    def step(self, axis: int) -> Interval:
        """Enclose the length of a unit along an axis."""
        return (Interval(self.problem.bounds[axis + 2]) - self.problem.bounds[axis]) / float(self.units[axis])

    def place(self, axis: int, units: ArrayLike) -> Interval:
        """Enclose the place of units along an axis."""
        return Interval(units) * self.step(axis) + self.problem.bounds[axis]

    def places(self, sides: list[Wholes]) -> tuple[list[Interval], list[Interval]]:
        """Enclose the sides of boxes in map units: west and east, and south and north."""
        west, east, south, north = (self.place(n // 2, side) for n, side in enumerate(sides))
        return [west, east], [south, north]

    def lines(self, axis: int, first: int, count: int, size: int) -> Interval:
        """Enclose what is on the map of some parts along an axis, of so many units each, from a unit on."""
        demand(count < MOST_CELLS, "a grid is too fine")
        places = self.place(axis, np.clip(first + size * np.arange(count + 1), 0, self.units[axis]))
        return Interval(places.lo[:-1], places.hi[1:])

    def name(self, piece: int) -> str:
        """Name the cell of a piece in a message."""
        return f"cell ({self.columns[piece]}, {self.rows[piece]}) of {self.last[0]}"

    def box(self, some: Any) -> list[Wholes]:
        """Return some of the boxes."""
        return [side[some] for side in self.boxes]

    def numbers(self, columns: Wholes, rows: Wholes) -> Wholes:
        """Return numbers of cells, row by row; those just outside of the map have some as well."""
        return (rows + 1) * (self.last[0] + 3) + columns + 1

    def around_cells(self, cells: Wholes) -> Wholes:
        """Return the numbers of three times three cells around each, shape (n, 9)."""
        around: Wholes = np.array([b * (self.last[0] + 3) + a for b in (-1, 0, 1) for a in (-1, 0, 1)])
        return cells[:, None] + around

    def _sides(self, columns: Wholes, rows: Wholes) -> list[Wholes]:
        """Return the sides of cells on the map, in units."""
        half, found = self.parts // 2, []
        for units, index in zip(self.units, (columns, rows), strict=True):
            found += [np.clip(index * self.parts + side, 0, units) for side in (-half, half)]
        return found

    def _cut(self) -> Wholes | None:
        """Replace cells by the pieces that areas leave of them; return pairs that touch, None if no cell is cut."""
        low, lines = (int(self.columns.min()), int(self.rows.min())), []
        for axis, index in enumerate((self.columns, self.rows)):
            count = int(index.max()) + 1 - low[axis]
            lines.append(self.lines(axis, low[axis] * self.parts - self.parts // 2, count, self.parts))
        row, first, after, inside = gaps(self.problem, *lines)
        cells = self.numbers(self.columns, self.rows)
        begin, end = (np.append(-1, self.numbers(low[0] + column, low[1] + row)) for column in (first, after))
        gap = np.searchsorted(begin, cells, side="right") - 1
        cut = cells >= end[gap]
        stays = cut | ~np.append(False, inside)[gap]
        self.columns, self.rows, cells, self.is_cut = self.columns[stays], self.rows[stays], cells[stays], cut[stays]
        self.owners, self.rectangles = np.arange(len(cells)), self._sides(self.columns, self.rows)
        if not self.is_cut.any():
            return None
        # cells beside those that are cut are taken apart as well
        apart = np.isin(cells, self.around_cells(cells[self.is_cut]))
        cell, *squares = self._rows_of_squares(np.flatnonzero(apart))
        one, other = touching_rows(*squares)
        own = cell[one] == cell[other]
        root = joined(len(cell), one[own], other[own])
        # pieces are in the order of cells, then of their first row
        (whole,), many = np.nonzero(~apart), len(cell) + 1
        found, piece = np.unique(np.append(whole * many, cell * many + root + 1), return_inverse=True)
        some, piece = self.is_cut[cell], piece[len(whole) :]
        self.columns, self.rows, self.is_cut = (one[found // many] for one in (self.columns, self.rows, self.is_cut))
        (uncut,) = np.nonzero(~self.is_cut)
        sides, (v, start, stop) = self._sides(self.columns[uncut], self.rows[uncut]), (one[some] for one in squares)
        self.owners = np.append(uncut, piece[some])
        order = np.argsort(self.owners, kind="stable")
        self.owners = self.owners[order]
        self.rectangles = [np.append(*both)[order] for both in zip(sides, (start, stop, v, v + 1), strict=True)]
        pairs, cells = [(piece[one[~own]], piece[other[~own]])], self.numbers(self.columns[uncut], self.rows[uncut])
        for beside in self.around_cells(cells).T[5:] if len(cells) else ():
            at = np.minimum(np.searchsorted(cells, beside), len(cells) - 1)
            (hit,) = np.nonzero(cells[at] == beside)
            pairs.append((uncut[hit], uncut[at[hit]]))
        return np.concatenate(pairs, axis=1)

    def _rows_of_squares(self, cells: Wholes) -> tuple[Wholes, Wholes, Wholes, Wholes]:
        """Return open squares: their cells, rows, first columns and columns after the last, in order of rows."""
        west, east, south, north = self._sides(self.columns[cells], self.rows[cells])
        left, bottom = int(west.min()), int(south.min())
        columns, rows = (
            self.lines(0, left, int(east.max()) - left, 1),
            self.lines(1, bottom, int(north.max()) - bottom, 1),
        )
        row, first, after, inside = gaps(self.problem, columns, rows)
        # numbers of squares, row by row: open ones are between closed ones
        width = self.units[0] + 1
        closed, to = ((bottom + row[inside]) * width + left + column[inside] for column in (first, after))
        begin, end = np.append(-1, to), np.append(closed, 1 << 62)
        which, v = ranges(south, north - 1)
        west, east = v * width + west[which], v * width + east[which]
        part, n = ranges(np.searchsorted(end, west, side="right"), np.searchsorted(begin, east) - 1)
        self.problem.spend(len(part), 10)
        start, stop = np.maximum(begin[n], west[part]), np.minimum(end[n], east[part])
        order = np.argsort(start, kind="stable")
        v, part = v[part[order]], part[order]
        return cells[which[part]], v, start[order] - v * width, stop[order] - v * width

    def _numbered(self, touching: Wholes | None) -> tuple[Wholes, Wholes]:
        """Return the numbers of control values around pieces, shape (m, 9): what touches shares those around both."""
        at, n_shared = self.around_cells(self.numbers(self.columns, self.rows)), None
        if touching is not None:
            # (where no cell around a place is cut, all share the value there)
            near, links = np.isin(at, np.unique(at[self.is_cut])), []
            which = np.cumsum(near).reshape(at.shape) - 1
            beside = np.asarray(near.any(axis=1))
            one, other = touching
            both = beside[one] & beside[other]
            one, other = one[both], other[both]
            across, along = self.columns[other] - self.columns[one], self.rows[other] - self.rows[one]
            for n in range(9):
                a, b = n % 3 - across, n // 3 - along
                some = near[one, n] & (a >= 0) & (a < 3) & (b >= 0) & (b < 3)
                links.append((which[one[some], n], which[other[some], (3 * b + a)[some]]))
            n_shared = at.max() + 1
            at[near] = n_shared + joined(int(near.sum()), *map(np.concatenate, zip(*links, strict=True)))
        places, numbers = np.unique(at, return_inverse=True)
        return numbers.reshape(at.shape), places if n_shared is None else places[places < n_shared]

    def _boxes(self) -> tuple[Wholes, list[Wholes]]:
        """Return boxes around what is open of pieces: rasters may have lines through the middles of cells."""
        pieces, sides = extents(self.owners, self.rectangles)
        for axis in range(2) if self.problem.rasters else ():
            middle = (self.columns, self.rows)[axis][pieces] * self.parts
            halves = [side.copy() for side in sides], [side.copy() for side in sides]
            halves[0][2 * axis + 1] = np.minimum(sides[2 * axis + 1], middle)
            halves[1][2 * axis] = np.maximum(sides[2 * axis], middle)
            sides, pieces = [np.append(*both) for both in zip(*halves, strict=True)], np.append(pieces, pieces)
            real = sides[2 * axis] < sides[2 * axis + 1]
            sides, pieces = [side[real] for side in sides], pieces[real]
        return pieces, sides

    def pieces_at(self, point: Point) -> Wholes:
        """List the pieces that hold a point."""
        seen = np.ones(len(self.owners), dtype=np.bool_)
        for axis in range(2):
            place, (low, high) = self.unit_of(axis, Fraction(point[axis])), self.rectangles[2 * axis : 2 * axis + 2]
            seen &= (low <= math.floor(place)) & (high >= math.ceil(place))
        return np.unique(self.owners[seen])

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
        """Return the pieces that touch a rectangle of cells from outside, and the boxes without area where they do."""
        beside = self.within(west - 1, east + 1, south - 1, north + 1) & ~self.within(west, east, south, north)
        some, half = beside[self.owners], self.parts // 2
        low, high = (np.array([one, other]) * self.parts - half for one, other in ((west, south), (east, north)))
        left, right, bottom, top = (
            (np.minimum(side[some], high[n // 2]) if n % 2 else np.maximum(side[some], low[n // 2]))
            for n, side in enumerate(self.rectangles)
        )
        seen = (left <= right) & (bottom <= top)
        return extents(self.owners[some][seen], [side[seen] for side in (left, right, bottom, top)])

    def inside_block(self, finer: int, parts: int, box: tuple[int, ...]) -> "Grid":
        """Lay a grid inside of this one, over the cells of a box on the map; the same one for both surfaces."""
        key = finer, parts, box
        if key not in self.grids:
            demand(finer % 2 == 1 and 1 < finer < 100, "a grid inside is not an odd number of times as fine")
            last = [one * finer for one in self.last]
            sides = [min(max(side, 0), last[n // 2] + 1) for n, side in enumerate(box)]
            self.grids[key] = Grid(self.problem, last, parts, *all_cells(*sides))
        return self.grids[key]

    def finer(self, kept: Truths, last: list[int], parts: int) -> "Grid":
        """Lay a finer grid over the cells of some pieces."""
        first, final = [], []
        for axis, index in enumerate((self.columns[kept], self.rows[kept])):
            demand(self.last[axis] <= last[axis] <= 4 * self.last[axis], "a grid is not finer, or by too much")
            size, side = 2 * self.last[axis], last[axis]
            first.append(np.maximum(((2 * index - 1) * side + self.last[axis]) // size, 0))
            final.append(np.minimum(-((-(2 * index + 1) * side - self.last[axis]) // size) - 1, side))
        demand(len(first[0]) < MOST_CELLS, "a grid has too many cells")
        some = list(offsets((first[0], final[0]), (first[1], final[1])))
        columns, rows = (np.concatenate([one[axis] for one in some]) for axis in range(2))
        return Grid(self.problem, last, parts, columns, rows)


def extents(owners: Wholes, rectangles: list[Wholes]) -> tuple[Wholes, list[Wholes]]:
    """Return the pieces that have rectangles, which are in their order, and the boxes around those of each."""
    pieces, first = np.unique(owners, return_index=True)
    ways = (np.minimum, np.maximum) * 2
    return pieces, [
        way.reduceat(side, first) if len(side) else side for way, side in zip(ways, rectangles, strict=True)
    ]


def touching_rows(v: Wholes, start: Wholes, stop: Wholes) -> tuple[Wholes, Wholes]:
    """Return pairs of rows of squares that touch, corners included; they are sorted by v, then start, and are apart."""
    width = int(stop.max()) + 1
    begin, end = v * width + start, v * width + stop
    (beside,) = np.nonzero((v[:-1] == v[1:]) & (stop[:-1] >= start[1:]))
    below, above = ranges(np.searchsorted(end, begin + width), np.searchsorted(begin, end + width, side="right") - 1)
    return np.append(beside, below), np.append(beside + 1, above)


# --- Surfaces ---------------------------------------------------------------------------------------------------------


def columns_of(grid: Grid) -> tuple[Wholes, Wholes]:
    """Return the order by columns of control values at places without cuts, and where in it a column begins."""
    places, width = grid.uncut_places, grid.last[0] + 3
    order = np.lexsort((places, places % width))
    return order, np.flatnonzero(np.diff(places[order], prepend=-1 - width) != width)


def summed(steps: Wholes, grid: Grid, axes: int) -> Wholes:
    """Return control values from their second differences along rows, and along columns for two axes."""
    if axes == 2:
        order, begin = columns_of(grid)
        for _ in range(2):
            total = np.cumsum(steps[order])
            before = np.append(0, total)[begin]
            steps[order] = total - np.repeat(before, np.diff(np.append(begin, len(order))))
    return np.cumsum(np.cumsum(steps))


def doubled(controls: Wholes, axis: int) -> Wholes:
    """Return twice the Bernstein values, along one axis, of three control values each."""
    first, middle, last = np.moveaxis(controls, axis, 0)
    return np.stack([first + middle, 2 * middle, middle + last], axis=axis)


def bezier(controls: Wholes) -> Wholes:
    """Return four times the Bernstein values of splines with such control values, whole numbers, shape (n, 3, 3)."""
    return doubled(doubled(controls, 2), 1)


def restricted(values: Floats, ends: list[Interval]) -> Interval:
    """
    Turn Bernstein values on cells, shape (n, 3, 3), into those on boxes in the cells.

    `ends` are west, east, south and north of each box, in cells from the corner. The values on [s, t] are those of the
    polar form ``(1 - s) (1 - t) b_0 + ((1 - s) t + s (1 - t)) b_1 + s t b_2`` at (s, s), (s, t) and (t, t).
    """
    whole = Interval(values.copy(), values.copy())
    (part,) = np.nonzero((ends[0].lo > 0.0) | (ends[1].hi < 1.0) | (ends[2].lo > 0.0) | (ends[3].hi < 1.0))
    found = Interval(values[part])
    for axis in (2, 1):
        s, t = (one[part, None] for one in ends[4 - 2 * axis : 6 - 2 * axis])
        b = [found[:, :, n] if axis == 2 else found[:, n] for n in range(3)]
        new = [
            (1.0 - p) * (1.0 - q) * b[0] + ((1.0 - p) * q + p * (1.0 - q)) * b[1] + p * q * b[2]
            for p, q in ((s, s), (s, t), (t, t))
        ]
        found = Interval(np.stack([one.lo for one in new], axis=axis), np.stack([one.hi for one in new], axis=axis))
    whole.put(part, found)
    return whole


class Surface:
    """
    A biquadratic spline on the pieces of a grid. Its control values are whole numbers times ``2^-exponent``.

    Outside of blocks, it is charged for where it is steeper than the cost, and blocks are charged for. With an end,
    there is a block around that.
    """

    def __init__(self, described: dict[str, Any], array: Reader, grid: Grid, end: Point | None, level: int = 0) -> None:
        demand(level < MOST_LEVELS, "too many surfaces are inside one another")
        grid.problem.spend(len(grid.in_box), 100)
        self.grid = grid
        exponent = whole_of(described["exponent"])
        demand(abs(exponent) < 1 << 9, "an exponent is out of range")
        #: One unit of `bezier`.
        self.unit = math.ldexp(0.25, -exponent)
        steps = array(described["values"], "i", 1)
        demand(len(steps) == grid.controls.max(initial=-1) + 1, "there are more or fewer control values than needed")
        axes = whole_of(described.get("axes", 1))
        demand(axes in (1, 2), "axes are neither 1 nor 2")
        values = summed(steps, grid, axes)
        demand((np.abs(values.astype(np.float64)) < 2.0**46).all(), "a control value is too great")
        self.controls = values[grid.controls].reshape(-1, 3, 3)
        self.in_block = np.zeros(len(grid.columns), dtype=np.bool_)
        #: What a difference of two values may be above the cost of a path between the places or, with an end, what a
        #: value may be above the cost of a path to the end.
        self.loss = 0.0
        #: What most is charged for.
        self.fault, most = "it is not higher", 0.0
        around = [(one, None) for one in described["blocks"]] + ([(described["end"], end)] if end else [])
        for one, its_end in around:
            pieces, charge = block(one, array, self, level, its_end)
            demand(not self.in_block[pieces].any(), "two blocks overlap")
            self.in_block[pieces] = True
            self.loss = float(up(self.loss + charge))
            if charge > most:
                most, self.fault = charge, f"the block of cells {one['cells']} of {grid.last[0]} loses {charge:.3g}"
        self._charge_steep()

    def _charge_steep(self) -> None:
        """Measure how steep the surface is against the cost on each piece outside of blocks, and charge for that."""
        grid = self.grid
        self.steepness = np.zeros(len(grid.columns))
        for part in batches(len(grid.in_box)):
            pieces, costs = grid.in_box[part], grid.costs[part]
            with np.errstate(divide="ignore"):
                ratio = up(self._squared_slopes(pieces, grid.box(part)) / down(costs * costs)).max(axis=(1, 2))
            ratio[~(costs > 1e-100).all(axis=(1, 2))] = np.inf
            np.maximum.at(self.steepness, pieces, up(np.sqrt(ratio)))
        self.steepness[self.in_block] = 0.0
        wrong = ~np.isfinite(self.steepness)
        demand(not wrong.any(), lambda: f"the slope has no bound in {grid.name(int(wrong.argmax()))}")
        steepest, (steep,) = self.steepness.max(initial=0.0), np.nonzero(self.steepness > 1.0)
        if len(steep):
            values = bezier(self.controls[steep])
            spans = (values.max(axis=(1, 2)) - values.min(axis=(1, 2))) * self.unit
            lost = (Interval(up(math.fsum(up(spans).tolist()))) * (1.0 - Interval(1.0) / steepest)).hi
            self.loss = float(up(self.loss + lost))
            name = f"{grid.name(int(self.steepness.argmax()))} is {steepest:.12g} times as steep as the cost"
            self.fault = f"{name}, and {len(steep)} such cells lose {lost:.3g}; {self.fault}"

    def _squared_slopes(self, pieces: Wholes, sides: list[Wholes]) -> Floats:
        """
        Bound the squares of the lengths of the Bernstein vectors of the gradient from above, on boxes in pieces.

        Those on whole cells are means of differences of neighbouring control values: whole numbers.
        """
        grid, u = self.grid, self.controls[pieces]
        total, ends = np.zeros(u.shape), self._ends(pieces, sides, [1, 1])
        for axis in range(2):
            # (the gradient is linear along its own axis: the middle value is the mean)
            first, last = np.moveaxis(2 * doubled(np.diff(u, axis=2 - axis), 1 + axis), 2 - axis, 0)
            vectors = np.stack([first, (first + last) // 2, last], axis=2 - axis)
            values = restricted(vectors.astype(np.float64), ends)
            most, size = np.maximum(values.hi, -values.lo), Interval(self.unit) / (grid.step(axis) * float(grid.parts))
            total = up(total + up(up(most * most) * size.square().hi))
        return total

    def _ends(self, pieces: Wholes, sides: list[Any], times: list[int]) -> list[Interval]:
        """Return sides, in so many times finer units, in cells from the corner of the cell of pieces."""
        found = []
        for n, side in enumerate(sides):
            size = self.grid.parts * times[n // 2]
            corner = (self.grid.columns, self.grid.rows)[n // 2][pieces] * size - size // 2
            found.append(((enclosed(side) - corner) / float(size)).within(0.0, 1.0))
        return found

    def on(self, pieces: Wholes, sides: list[Any], times: list[int]) -> Interval:
        """Return the Bernstein values of the surface on boxes in pieces, whose sides are in finer units."""
        values = bezier(self.controls[pieces]).astype(np.float64)
        return restricted(values, self._ends(pieces, sides, times)) * self.unit

    def least(self) -> Floats:
        """Bound the surface from below by its Bernstein values on each piece, shape (m, 3, 3)."""
        found: Floats = down(bezier(self.controls) * self.unit)
        return found

    def bound(self, point: Point) -> float:
        """Bound the cost of a path from a point to the end of the surface; a point in a block has no bound."""
        pieces, sides = self.grid.pieces_at(point), []
        if self.in_block[pieces].any():
            return -math.inf
        for axis in range(2):
            low, high = self.grid.problem.bounds[axis], self.grid.problem.bounds[axis + 2]
            place = (Interval(point[axis]) - low) / (Interval(high) - low) * float(self.grid.units[axis])
            sides += [Interval(np.full(len(pieces), place.lo), np.full(len(pieces), place.hi))] * 2
        return float(down(self.on(pieces, sides, [1, 1]).lo.min(initial=math.inf) - self.loss))


def block(
    described: dict[str, Any], array: Reader, outer: Surface, level: int, end: Point | None
) -> tuple[Wholes, float]:
    """
    Return the pieces in a block, and by how much more a surface falls from a place on its rim than a way through costs.

    In the block, a rectangle of cells, the surface may be anything. Another surface, on a finer grid over a box around
    the block, bounds the cost of ways from rim to rim or, in a block around an end, from the rim to the end. It may be
    anything in blocks of its own, none of which is beside the rim from outside.
    """
    grid, cells = outer.grid, [whole_of(one) for one in described["cells"]]
    demand(len(cells) == 4 and cells[0] < cells[1] and cells[2] < cells[3], "a block is empty")
    grid.problem.spend(len(grid.columns), 5)
    (pieces,) = np.nonzero(grid.within(*cells))
    for axis, at in enumerate(end or ()):
        place = grid.unit_of(axis, Fraction(at)) / grid.parts + Fraction(1, 2)
        demand(cells[2 * axis] <= place <= cells[2 * axis + 1], "the end is not in the block around it")
    if end and "inside" not in described:
        return pieces, above_cone(outer, cells, end)
    inside = described["inside"]
    finer, parts, box = whole_of(inside["finer"]), whole_of(inside["parts"]), [whole_of(one) for one in inside["box"]]
    demand(len(box) == 4, "a box has other sides than four")
    within = grid.inside_block(finer, parts, tuple(box))
    inner = Surface(inside["surface"], array, within, end, level + 1)
    # the rectangle in cells of the grid inside, and its margin to the sides of the box that are not beyond the map
    same = [one * finer - finer // 2 for one in cells]
    margins = [same[0] - box[0], box[1] - same[1], same[2] - box[2], box[3] - same[3]]
    is_open = [box[0] > 0, box[1] <= within.last[0], box[2] > 0, box[3] <= within.last[1]]
    demand(all(margin > 0 or not way for margin, way in zip(margins, is_open, strict=True)), "a block leaves its box")
    (one, its), (other, others) = grid.rim(*cells), within.rim(*same)
    # all of that in common units
    times = finer * within.parts, grid.parts
    its, others = ([side * by for side in sides] for sides, by in zip((its, others), times, strict=True))
    grid.problem.spend(len(one), len(other), 10)
    low, high = (
        [way(its[n][:, None], others[n]) for n in sides] for way, sides in ((np.maximum, (0, 2)), (np.minimum, (1, 3)))
    )
    p, q = np.nonzero((low[0] <= high[0]) & (low[1] <= high[1]))
    demand(not inner.in_block[other[q]].any(), "a block inside a block is across its rim")
    if not len(p):
        return pieces, 0.0
    both = [side[p, q] for side in (low[0], high[0], low[1], high[1])]
    phi, psi = (
        surface.on(some, both, [by, by])
        for surface, some, by in ((outer, one[p], times[0]), (inner, other[q], times[1]))
    )
    more = phi - psi
    charge = more.hi.max() if end else up(more.hi.max() - more.lo.min())
    # a way that leaves the box pays for the margin twice
    steps = [within.step(n // 2) * (float(within.parts) * margin) for n, margin in enumerate(margins) if is_open[n]]
    least = max(float(within.costs.min()), 0.0)
    beyond = max((up(phi.hi.max() - phi.lo.min()) - (step * (2.0 * least)).lo for step in steps), default=0.0)
    return pieces, float(up(up(charge + inner.loss) + up(max(beyond, 0.0))))


def least_cost_around(grid: Grid, end: Point, radius: float) -> float:
    """Bound the cost from below in a square around an end that holds a circle, in 16 x 16 boxes."""
    lines = []
    for axis in range(2):
        first, last = (grid.unit_of(axis, Fraction(end[axis]) + sign * Fraction(radius)) for sign in (-1, 1))
        span = max(math.floor(first), 0), min(math.ceil(last), grid.units[axis])
        lines.append(np.unique(np.linspace(*span, 17).astype(np.int64)))
    i, j = all_cells(0, len(lines[0]) - 1, 0, len(lines[1]) - 1)
    return float(grid.problem.lower_costs(grid, [lines[0][i], lines[0][i + 1], lines[1][j], lines[1][j + 1]]).min())


def above_cone(outer: Surface, cells: list[int], end: Point) -> float:
    """
    Bound by how much a surface is above the least cost nearby times the distance to its end, on the rim of a block.

    Nearby is what is as near to the end as the rim: a way that leaves that is longer than the distance as well.
    """
    grid = outer.grid
    pieces, sides = grid.rim(*cells)
    demand(len(pieces) > 0, "no cell is beside the block around an end")
    # each part of the rim in many, whose distance is that of their nearest point
    n, sides = np.arange(RIM_PARTS), [side[:, None] for side in sides]
    sides = [(sides[m - m % 2] * RIM_PARTS + (sides[m | 1] - sides[m - m % 2]) * (n + m % 2)).ravel() for m in range(4)]
    near, far = [], []
    for axis in range(2):
        low, high = (grid.place(axis, side / RIM_PARTS) - end[axis] for side in sides[2 * axis : 2 * axis + 2])
        near.append(Interval(np.maximum(np.maximum(low.lo, -high.hi), 0.0)))
        far.append(Interval(np.maximum(high.hi, -low.lo)))
    least = least_cost_around(grid, end, float(length_of(*far).hi.max()))
    demand(least > 0.0, "the cost around an end is not above 0")
    phi = outer.on(np.repeat(pieces, RIM_PARTS), sides, [RIM_PARTS] * 2).hi.max(axis=(1, 2))
    return float((phi - length_of(*near) * least).hi.max())


# --- Cells of constant cost -------------------------------------------------------------------------------------------


class Cells:
    """
    Rectangles between lines, the least cost of a unit of length in each, and the least one along each side.

    A line is a strip ``[a, b]``, most often of no width. The map is drawn together across all strips; sizes of cells
    are rounded down, so that no path gets longer by that. From here on, they are exact.
    """

    def __init__(self, described: dict[str, Any], array: Reader, problem: Problem) -> None:
        demand(
            not problem.threats and not problem.on_earth and all(one.is_flat for one in problem.rasters),
            "the cost is not constant on cells",
        )
        self.problem = problem
        self.lines: list[Floats] = [array(described[name], "f", 2) for name in ("x", "y")]
        for axis, line in enumerate(self.lines):
            low, high = problem.bounds[axis], problem.bounds[axis + 2]
            demand(line.shape[1] == 2 and len(line) > 1, "lines are not begin, end")
            demand((line[:, 0] <= line[:, 1]).all() and (line[1:, 0] > line[:-1, 1]).all(), "lines are not in order")
            demand(line[0, 0] <= low and line[-1, 1] >= high, "lines do not go around the map")
        self.shape = len(self.lines[1]) - 1, len(self.lines[0]) - 1
        demand(self.shape[0] * self.shape[1] < MOST_CELLS, "there are too many cells")
        self.sizes = [down(line[1:, 0] - line[:-1, 1]) for line in self.lines]
        demand(min(float(size.min()) for size in self.sizes) > 0.0, "a cell has no size")
        self.costs = self._costs(0, 0)
        demand((self.costs < 1e100).all(), "a cost is too great")
        #: Along horizontal lines, shape (rows + 1, columns), and vertical ones, shape (rows, columns + 1).
        self.along = self._costs(0, 1), self._costs(1, 0)
        #: Those that no edge of an area meets, with the lines around them, and that are inside.
        self.closed = np.zeros(self.shape, dtype=np.bool_)
        around = [Interval(line[:-1, 0], line[1:, 1]) for line in self.lines]
        for row, first, after, is_inside in zip(*gaps(problem, *around), strict=True):
            self.closed[row, first:after] = is_inside
        self.ends = [[self._place(axis, end[axis]) for axis in range(2)] for end in (problem.start, problem.goal)]

    def _costs(self, *is_line: int) -> Floats:
        """Bound the cost from below between lines along x and y, or on them."""
        shape = [self.shape[1 - axis] + is_line[axis] for axis in (1, 0)]
        risk = Interval(np.zeros(shape))
        for raster in self.problem.rasters:
            values = np.pad(raster.corners[0], 1)
            self.problem.spend(values.size + risk.lo.size, 10)
            columns, rows = (self._touched(raster, axis, is_line[axis]) for axis in range(2))
            across = np.stack([values[:, some].min(axis=1) for some in columns], axis=1)
            risk = risk + np.stack([across[some].min(axis=0) for some in rows])
        return (risk * self.problem.k + 1.0).lo

    def _touched(self, raster: "Raster", axis: int, is_line: int) -> list[slice]:
        """List the columns or rows of a raster, counted from 1, that have a place between lines, or touch a line."""
        places, line = raster.knots[axis], self.lines[axis]
        if not is_line:
            between = zip(line[:-1, 1].tolist(), line[1:, 0].tolist(), strict=True)
            return [slice(bisect_right(places, low), bisect_left(places, high) + 1) for low, high in between]
        # (the outer edges belong to the raster)
        return [
            slice(bisect_left(places, low) + (low == places[0]), bisect_right(places, high) + 1 - (high == places[-1]))
            for low, high in line.tolist()
        ]

    def _place(self, axis: int, at: float) -> tuple[int, float]:
        """Return the cell of a coordinate and where in it, or the line, and -1."""
        line = self.lines[axis]
        n = int(np.searchsorted(line[:, 0], at, side="right")) - 1
        return (n, -1.0) if at <= line[n, 1] else (n, min(at - float(line[n, 1]), float(self.sizes[axis][n])))


class Net:
    """
    Points on the sides of cells that paths may enter, in order: start, goal, corners, horizontal and vertical sides.

    Sides of a cell are the lower, upper, left and right one.
    """

    def __init__(self, described: dict[str, Any], array: Reader, cells: Cells, needed: Truths) -> None:
        self.cells, parts = cells, array(described["parts"], "f", 1)
        demand(len(parts) < 1 << 10 and (np.diff(parts, prepend=0.0, append=1.0) > 0.0).all(), "parts are not in order")
        self.parts: Floats = np.concatenate([[0.0], parts, [1.0]])
        self.is_open = np.zeros(cells.shape, dtype=np.bool_)
        for row, first, end in array(described["runs"], "i", 2).tolist():
            demand(0 <= row < cells.shape[0] and 0 <= first < end <= cells.shape[1], "a run leaves the map")
            cells.problem.spend(end - first)
            self.is_open[row, first:end] = True
        lacking = np.argwhere(needed & ~self.is_open)
        demand(not len(lacking), lambda: f"cell ({lacking[0][1]}, {lacking[0][0]}) is missing")
        wide, m = np.pad(self.is_open, 1), len(parts)
        has_side = wide[1:, 1:-1] | wide[:-1, 1:-1], wide[1:-1, 1:] | wide[1:-1, :-1]
        is_corner = np.pad(has_side[0], ((0, 0), (1, 0))) | np.pad(has_side[0], ((0, 0), (0, 1)))
        self.count, numbers = 2, []
        for has, size in ((is_corner, 1), (has_side[0], m), (has_side[1], m)):
            numbers.append(np.where(has, self.count + size * (np.cumsum(has).reshape(has.shape) - 1), -1))
            self.count += size * int(has.sum())
        demand(self.count < MOST_PARTS, "there are too many points")
        self.corner, self.side = numbers[0], numbers[1:]
        self.rows, self.columns = np.nonzero(self.is_open)
        # (no path that costs less than what is claimed gets to the border of a cell that is not open)
        inside = np.pad(self.is_open, 1, constant_values=True)
        is_used = inside[1:, 1:-1] & inside[:-1, 1:-1], inside[1:-1, 1:] & inside[1:-1, :-1]
        self.along = [np.where(used, cost, np.inf) for used, cost in zip(is_used, cells.along, strict=True)]

    def points(self, part: slice) -> Wholes:
        """Return the numbers of the points on the sides of some open cells, shape (n, 4, m + 2)."""
        j, i, inner, found = self.rows[part], self.columns[part], np.arange(len(self.parts) - 2), []
        for axis, up, right in ((0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 0, 1)):
            first = self.corner[j + up, i + right][:, None]
            last = self.corner[j + up + axis, i + right + 1 - axis][:, None]
            found.append(np.hstack([first, self.side[axis][j + up, i + right][:, None] + inner, last]))
        return np.stack(found, axis=1)

    def least(self, values: Floats) -> Floats:
        """Return the least of the values on the border of each cell, shape (rows, columns)."""
        found = np.full(self.cells.shape, np.inf)
        for part in batches(len(self.rows), len(self.parts) // 4 + 1):
            found[self.rows[part], self.columns[part]] = values[self.points(part)].min(axis=(1, 2))
        return found


class Heights:
    """
    Values ``W`` at the points of a net, linear in between, which no path falls along faster than it costs.

    Paths begin at one end, 0 for the start or 1 for the goal, and lead to the other one.
    """

    def __init__(self, described: dict[str, Any], array: Reader, net: Net, begin: int) -> None:
        self.begin = begin
        self.net, exponent = net, whole_of(described["exponent"])
        demand(-200 <= exponent <= 200, "an exponent is too great")
        self.whole: Wholes = np.cumsum(array(described["values"], "i", 1))
        demand(len(self.whole) == net.count, "values do not fit the points")
        demand((np.abs(self.whole) < 1 << 50).all(), "a value is too great")
        self.unit = 2.0**-exponent
        #: Whether the values are the same on the whole border of each cell.
        self.is_flat = True
        for part in batches(len(net.rows), len(net.parts)):
            self._check(part)

    def at(self, end: int) -> Interval:
        """Enclose the value at the start, 0, or the goal, 1."""
        net, ((i, x), (j, y)) = self.net, self.net.cells.ends[end]
        if x >= 0.0 and y >= 0.0:
            demand(net.is_open[j, i], "an end is in a cell that is missing")
            return Interval(self.whole[end] * self.unit)
        demand(net.corner[j, i] >= 0, "an end is on a line that is missing")
        if x < 0.0 and y < 0.0:
            return Interval(self.whole[net.corner[j, i]] * self.unit)
        axis, offset = (0, x) if x >= 0.0 else (1, y)
        first, inner = net.side[axis][j, i], np.arange(len(net.parts) - 2)
        demand(first >= 0, "an end is on a line that is missing")
        values = self.whole[[net.corner[j, i], *(first + inner), net.corner[j + axis, i + 1 - axis]]] * self.unit
        places = net.parts * net.cells.sizes[axis][(i, j)[axis]]
        # (the place is off by less than 2^-50 of the side)
        steepest = float(np.abs(np.diff(values) / np.diff(places)).max())
        off = 2.0**-46 * (float(np.abs(values).max()) + steepest * float(places[-1]))
        value = float(np.interp(offset, places, values))
        return Interval(value - off, value + off)

    def above(self, end: int) -> Interval:
        """Enclose by how much the values at all points are above that at an end."""
        return self.whole * self.unit - self.at(end)

    def _check(self, part: slice) -> None:
        """
        Check that ``W(p) - W(q) <= c |p - q|`` for all p and q on the border of some cells.

        Values and places are relative to the lower left corner; all of them are exact but for those of ends.
        """
        net, cells = self.net, self.net.cells
        j, i, numbers = net.rows[part], net.columns[part], net.points(part)
        cells.problem.spend(numbers.size, 100)
        width, height = cells.sizes[0][i], cells.sizes[1][j]
        costs, (up, right) = cells.costs[j, i], net.along
        along = np.stack([up[j, i], up[j + 1, i], right[j, i], right[j, i + 1]], axis=1)
        base = self.whole[numbers[:, 0, 0]]
        values: Floats = (self.whole[numbers] - base[:, None, None]).astype(np.float64) * self.unit
        self.is_flat &= not values.any()
        places = net.parts * np.stack([width, width, height, height], axis=1)[:, :, None]
        steps, rises = down(np.diff(places)), np.diff(values)
        steep = ~(np.abs(rises) <= down(np.minimum(costs[:, None], along)[:, :, None] * steps)).all(axis=(1, 2))
        # at a corner: p at s on one side and q at t on the other, s and t from there
        for one, other, a, b in ((0, 2, 0, 0), (0, 3, -1, 0), (1, 2, 0, -1), (1, 3, -1, -1)):
            alpha, beta = (
                Interval(rises[:, side, end] * (1.0 + 2.0 * end)) / Interval(steps[:, side, end])
                for side, end in ((one, a), (other, b))
            )
            for p, q in ((alpha, -beta), (-alpha, beta)):
                total = p.within(0.0, np.inf).square() + q.within(0.0, np.inf).square()
                steep |= ~(total.hi <= down(costs * costs))
        border, n = Border(values, places, width, height, costs), np.arange(len(i))
        sides = [(side, n) for side in range(4)]
        for end, ((column, x), (row, y)) in enumerate(cells.ends):
            (inside,) = np.nonzero((i == column) & (j == row) & (x >= 0.0) & (y >= 0.0))
            value = (self.whole[end] - base[inside]) * self.unit
            self.is_flat &= not value.any()
            border.put(4 + end, inside, x, y, value)
            sides.append((4 + end, inside))
        pairs = [
            np.column_stack(np.broadcast_arrays(np.intersect1d(held, also), one, 0, other, 0))
            for (one, held), (other, also) in permutations(sides, 2)
            if other != 4 + self.begin and one != 5 - self.begin
        ]
        steep[border.steep(np.concatenate(pairs), cells.problem)] = True
        demand(
            not steep.any(),
            lambda: f"cell ({i[steep.argmax()]}, {j[steep.argmax()]}): values fall faster than the cost",
        )


class Border:
    """
    Points of cells, shape (n, 6, 2^k + 1): x, y and values on the four sides, and at start and goal inside a cell.

    The last point of a side, and start and goal, are repeated.
    """

    def __init__(self, values: Floats, places: Floats, width: Floats, height: Floats, costs: Floats) -> None:
        self.size, m = 1, values.shape[2] - 1
        while self.size < m:
            self.size *= 2
        some = np.minimum(np.arange(self.size + 1), m)
        shape = len(values), 6, self.size + 1
        self.x, self.y, self.values = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self.values[:, :4] = values[:, :, some]
        self.x[:, :2], self.y[:, 2:4] = places[:, :2, some], places[:, 2:, some]
        self.x[:, 3], self.y[:, 1] = width[:, None], height[:, None]
        #: Sums are off by less than 2^-49 of their parts, and places of ends by less than 2^-50 of a side.
        self.off = 2.0**-46 * (np.abs(values).max(axis=(1, 2)) + costs * (width + height))
        self.costs = costs

    def put(self, side: int, cells: Wholes, x: float, y: float, values: Floats) -> None:
        """Put an end into cells."""
        self.x[cells, side], self.y[cells, side], self.values[cells, side] = x, y, values[:, None]
        self.off[cells] += 2.0**-46 * np.abs(values)

    def steep(self, pairs: Wholes, problem: Problem) -> Wholes:
        """
        Return the cells in which values may fall faster than the cost from one run of points to another one.

        Pairs are rows: cell, side and number of the run, side and number of the other one. Those of which that is not
        clear are halved, down to intervals, of which those that meet in a corner have been looked at.
        """
        length = self.size
        while len(pairs):
            problem.spend(len(pairs), length + 20)
            demand(len(pairs) < MOST_CELLS, "values fall faster than the cost, or too nearly so, at many places")
            unclear = [self._unclear(pairs[part], length) for part in batches(len(pairs), length)]
            pairs = pairs[np.concatenate(unclear)]
            if length == 1:
                break
            length //= 2
            pairs = np.concatenate([pairs * [1, 1, 2, 1, 2] + [0, 0, a, 0, b] for a in range(2) for b in range(2)])
        return pairs[:, 0]

    def _unclear(self, pairs: Wholes, length: int) -> Truths:
        """
        Tell of which pairs of runs it is not clear that ``W(p) - W(q) <= c |p - q|`` for all p in one, q in the other.

        It is if some vector g of length c has ``W(p) - g . p <= W(q) - g . q`` for all points p and q of them.
        """
        cell, *runs = pairs.T
        costs, inner, n = self.costs[cell], np.arange(length + 1)[:, None], self.size + 1
        at = [(cell * 6 + side) * n + number * length + inner for side, number in (runs[:2], runs[2:])]
        (x, to_x), (y, to_y), (value, other) = ([of.ravel()[one] for one in at] for of in (self.x, self.y, self.values))
        # (any direction would do: this one is in the middle of those that serve the ends of both)
        dx, dy, fall = (
            one[[0, 0, -1, -1]] - two[[0, -1, 0, -1]] for one, two in ((x, to_x), (y, to_y), (value, other))
        )
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
        clear = is_short & (highest + self.off[cell] <= lowest)
        meet = (far == 0.0).any(axis=0) & (runs[0] < 4) & (runs[2] < 4) & (length == 1)
        return ~np.asarray(clear | meet)


def bound_over_cells(described: dict[str, Any], array: Reader, problem: Problem, claimed: float) -> float:
    """Return the bound of the cost of all paths that cost less than what is claimed; infinite if there are none."""
    cells, bound = Cells(described, array, problem), 0.0
    needed = ~cells.closed
    demand(0 < len(described["levels"]) < 1 << 6, "there are no points on cells, or too many levels")
    for one in described["levels"]:
        net = Net(one["points"], array, cells, needed)
        total = Interval(np.zeros(net.count))
        ways = [way for way in (("to_goal", 0, 1), ("to_start", 1, 0)) if way[0] in one]
        demand(ways, "points on cells have no values")
        for name, begin, end in ways:
            heights = Heights(one[name], array, net, begin)
            height = float((heights.at(begin) - heights.at(end)).lo)
            if heights.is_flat and height > 0.0:
                return math.inf
            bound, total = max(bound, height), total + heights.above(end)
        is_left_out = (net.least(total.lo) >= claimed) & (len(ways) == 2)
        for (i, x), (j, y) in cells.ends:
            if x >= 0.0 and y >= 0.0:
                is_left_out[j, i] = False
        needed = net.is_open & ~is_left_out
    return bound


# --- The bounds -------------------------------------------------------------------------------------------------------


def lower_bound(described: dict[str, Any], array: Reader, problem: Problem) -> tuple[float, str]:
    """
    Return a bound of the cost of all paths, infinite if there are none, and what has kept it from being greater.

    From each grid to the next, pieces are dropped that no path passes that costs less than the limit.
    """
    limit = math.inf if described["limit"] is None else number_of(described["limit"])
    demand(described["grids"], "there is no grid")
    most, grid = math.inf, None
    surfaces: list[Surface] = []
    for number, one in enumerate(described["grids"], 1):
        last, parts = [whole_of(side) for side in one["last"]], whole_of(one["parts"])
        demand(len(last) == 2, "a grid has other sides than two")
        if grid is None:
            grid = Grid(problem, last, parts, *all_cells(0, last[0] + 1, 0, last[1] + 1))
            bound, fault = straight(grid), "the distance of the ends, times the least cost near the goal"
        else:
            demand(len(surfaces) == 2, "a grid that is made finer has one surface")
            most, grid = limit, grid.finer(kept(surfaces[0], surfaces[1], limit), last, parts)
        if not grid.leads():
            return most, "the limit is less"
        surfaces = []
        for name, end, other in (("to_goal", problem.goal, problem.start), ("to_start", problem.start, problem.goal)):
            if name in one:
                surfaces.append(Surface(one[name], array, grid, end))
                found = min(most, surfaces[-1].bound(other))
                if found > bound:
                    bound, fault = found, f"on grid {number}, {name}: {surfaces[-1].fault}"
    return bound, fault


def straight(grid: Grid) -> float:
    """Bound the cost of all paths by the distance of the ends, times the least cost as near to the goal as that."""
    start, goal = grid.problem.start, grid.problem.goal
    far = length_of(*(Interval(one) - other for one, other in zip(start, goal, strict=True)))
    return float((far * max(least_cost_around(grid, goal, float(far.hi)), 0.0)).lo)


def kept(to_goal: Surface, to_start: Surface, limit: float) -> Truths:
    """Tell which pieces a path that costs less than a limit may pass; those in blocks are kept."""
    total = down(to_goal.least() + to_start.least()).min(axis=(1, 2))
    passes = ~(down(down(total - to_goal.loss) - to_start.loss) >= limit)
    return np.asarray(passes | to_goal.in_block | to_start.in_block)


# --- The path ---------------------------------------------------------------------------------------------------------


def check_free(problem: Problem, path: Floats) -> None:
    """
    Check that a path is nowhere inside of areas; it may touch them.

    Between places where a segment meets edges, it is inside or outside as a whole. All of this is exact.
    """
    edges, ends = problem.edges, [(Fraction(x), Fraction(y)) for x, y in path.tolist()]
    demand(not is_inside(problem, ends[0]), "the path begins inside an area")
    for n, ((x, y), (to_x, to_y)) in enumerate(pairwise(ends)):
        problem.spend(len(edges) + 100)
        low, high = np.minimum(path[n], path[n + 1]), np.maximum(path[n], path[n + 1])
        apart = (np.minimum(edges[:, :2], edges[:, 2:]) > high) | (np.maximum(edges[:, :2], edges[:, 2:]) < low)
        dx, dy, near = to_x - x, to_y - y, edges[~apart.any(axis=1)]
        # (without any edge near, a segment is where its begin is)
        if not len(near) or not (dx or dy):
            continue
        problem.spend(len(near), 1000)
        cuts = {Fraction(0), Fraction(1)}
        for ax, ay, bx, by in (map(Fraction, edge) for edge in near.tolist()):
            across = dx * (by - ay) - dy * (bx - ax)
            if across:
                cuts.add(((ax - x) * (by - ay) - (ay - y) * (bx - ax)) / across)
            else:
                cuts |= {((p - x) * dx + (q - y) * dy) / (dx * dx + dy * dy) for p, q in ((ax, ay), (bx, by))}
        for first, last in pairwise(sorted(t for t in cuts if 0 <= t <= 1)):
            t = (first + last) / 2
            demand(not is_inside(problem, (x + t * dx, y + t * dy)), f"the path crosses an area after waypoint {n}")


def is_inside(problem: Problem, point: tuple[Fraction, Fraction]) -> bool:
    """Tell whether a point is inside of areas, and not on an edge."""
    (x, y), inside, edges = point, False, problem.edges
    near, margin = float(y), 2.0**-40 * max(1.0, abs(float(y)))
    low, high = np.minimum(edges[:, 1], edges[:, 3]), np.maximum(edges[:, 1], edges[:, 3])
    some = edges[(low <= near + margin) & (high >= near - margin)].tolist()
    problem.spend(len(edges) + 1000 * len(some))
    for edge in some:
        ax, ay, bx, by = map(Fraction, edge)
        side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        if side == 0 and min(ax, bx) <= x <= max(ax, bx) and min(ay, by) <= y <= max(ay, by):
            return False
        if (ay > y) != (by > y):
            inside ^= (side > 0) == (by > ay)
    return inside


def upper_bound(problem: Problem, path: Floats) -> float:
    """
    Bound the cost of a path from above.

    The rule of Gauss with two places is off by at most ``l^5 / 4320 max |F''''|`` on a part of length l. The latter is
    at most ``s_4 + 4 s_3 s_1 + 3 s_2^2 + 6 s_2 s_1^2 + s_1^4``, where s_n sums up the greatest n-th derivatives of all
    f_i: p / s^n times 0.607, 1, 1.381 and 3 for n from 1 to 4. For rasters, see `risk_of_raster`.
    """
    demand(path.shape[1] == 2 and len(path) > 0, "a path is not a list of points")
    demand(tuple(path[0]) == problem.start and tuple(path[-1]) == problem.goal, "the path does not join start and goal")
    inside = (path >= problem.bounds[:2]) & (path <= problem.bounds[2:])
    demand(inside.all(), "the path leaves the map")
    check_free(problem, path)
    sides = [Interval(path[1:, axis]) - path[:-1, axis] for axis in range(2)]
    length = length_of(*sides).hi
    total = cost = float(up(math.fsum(length.tolist())))
    if problem.k == 0.0:
        return total
    one, two, three, four = (
        sum(most * peak / spread**n for _, _, spread, peak in problem.threats)
        for n, most in enumerate((0.607, 1.0, 1.381, 3.0), 1)
    )
    bend = (four + 4.0 * three * one + 3.0 * two**2 + 6.0 * two * one**2 + one**4) * (1.0 + 1e-9)
    # so fine that the error is a part of 1e-7 of the length
    finest = max((4320e-7 / max(problem.k * bend, 1e-300)) ** 0.25, total / MOST_STEPS)
    counts = np.maximum(np.ceil(length / finest), 1.0)
    problem.spend(counts.sum(), 10 + 2 * len(problem.threats))
    which, number = ranges(np.zeros(len(counts)), counts - 1.0)
    for part in batches(len(which)):
        segment, n = which[part], counts[which[part]]
        step, risk = Interval(length[segment]) / n, Interval(0.0)
        for place in (0.5 - GAUSS, 0.5 + GAUSS):
            t, clear = (Interval(number[part].astype(np.float64)) + place) / n, Interval(np.ones(len(segment)))
            x, y = (t * side[segment] for side in sides)
            for at_x, at_y, spread, peak in problem.threats:
                # (the difference of two places is closer than a place, on a small map far from (0, 0))
                dx, dy = x + (Interval(path[segment, 0]) - at_x), y + (Interval(path[segment, 1]) - at_y)
                square = dx.square() + dy.square()
                clear = clear * (1.0 - exp(square / Interval(spread).square() * -0.5) * peak)
            risk = risk + (1.0 - clear).within(0.0, 1.0) * 0.5
        risk = risk + step.square().square() * bend / 4320.0
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
            first, last = np.searchsorted(raster.floats[axis], sorted((begin[axis], end[axis])))
            knots = raster.knots[axis][max(int(first) - 1, 0) : int(last) + 1] if side[axis] else ()
            cuts |= {t for t in ((one - at[axis]) / side[axis] for one in knots) if 0 < t < 1}
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


def number_of(x: object) -> float:
    """Return a finite number of a file."""
    demand(isinstance(x, int | float) and not isinstance(x, bool), "a number is none")
    found = float(x)  # type: ignore[arg-type]
    demand(abs(found) < 1e120, "a number is not finite, or too great")
    return found


def whole_of(x: object) -> int:
    """Return a whole number of a file."""
    if not isinstance(x, int) or isinstance(x, bool) or abs(x) >= 1 << 50:
        msg = "a whole number is none"
        raise Refused(msg)
    return x


def point_of(x: Any) -> Point:
    """Return two numbers of a file."""
    demand(isinstance(x, list) and len(x) == 2, "a point is not two numbers")
    return number_of(x[0]), number_of(x[1])


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
        with zipfile.ZipFile(file) as archive:
            demand(sum(one.file_size for one in archive.infolist()) < MOST_IN_ALL, "the file is too large")
            text = _part_of(archive, "proof.json", MOST_TEXT)
            return proven(json.loads(text), _reader(archive), most_work)
    except Refused:
        raise
    except Exception as error:  # any error that a file leads to is a fault of the file
        msg = f"the file is not a proof: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
        raise Refused(msg) from error


def _part_of(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    # (a name goes into messages)
    demand(name.isascii() and name.isprintable(), "a name of an array is not plain")
    demand(archive.getinfo(name).file_size < most, f"{name} is too large")
    with archive.open(name) as stream:
        return stream.read(most)


def _reader(archive: zipfile.ZipFile) -> Reader:
    read = 0

    def array(name: str, kind: str, axes: int) -> Any:
        nonlocal read
        found = np.lib.format.read_array(io.BytesIO(_part_of(archive, name, MOST_BYTES)), allow_pickle=False)
        demand(8 * found.size <= MOST_BYTES, f"{name} is too large")
        # (a file may name an array as often as it likes)
        read += 8 * found.size
        demand(read < MOST_IN_ALL, "the arrays that are named are too large together")
        demand(found.ndim == axes and found.dtype.kind in kind, f"{name} is of another kind")
        if kind == "i":
            return found.astype(np.int64)
        floats = found.astype(np.float64)
        demand((np.abs(floats) < 1e120).all(), f"{name} is not finite, or too great")
        return floats

    return array


def proven(described: dict[str, Any], array: Reader, most_work: float = MOST_WORK) -> Result:
    """Check what a file describes (errors as `check`)."""
    known = described.get("format") == FORMAT and described.get("version") == VERSION
    demand(known, f"the format is not {FORMAT} of version {VERSION}")
    problem = Problem(described["problem"], array, most_work)
    lower = math.inf if described["lower"] is None else number_of(described["lower"])
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        if "cells" in described:
            bound, fault = bound_over_cells(described["cells"], array, problem, lower), "the values are not higher"
        else:
            bound, fault = lower_bound(described, array, problem)
        demand(bound >= lower, lambda: f"the surfaces prove {bound!r}, which is less than {lower!r}: {fault}")
        upper = upper_bound(problem, array(described["path"], "f", 2)) if "path" in described else math.inf
    return {"lower": lower, "upper": upper, "problem": digest(described["problem"], array)}


def digest(described: dict[str, Any], array: Reader) -> str:
    """Return a digest of a problem: that of its numbers and arrays."""
    found = hashlib.sha256()
    arrays = [described["threats"], *described["rings"], *(one["values"] for one in described["rasters"])]
    bare = {name: one for name, one in described.items() if name not in {"threats", "rings", "rasters"}}
    rasters = [{name: one for name, one in raster.items() if name != "values"} for raster in described["rasters"]]
    found.update(json.dumps([bare, rasters], sort_keys=True).encode())
    for name in arrays:
        values = array(name, "f", 2)
        found.update(repr(values.shape).encode() + values.astype("<f8").tobytes())
    return found.hexdigest()


def main(arguments: list[str]) -> int:
    """Check a file, and print what it proves."""
    file, *more = arguments or [""]
    if not file or more[:1] not in ([], ["--most-work"]) or len(more) not in {0, 2}:
        sys.stdout.write(f"{__doc__}\n")
        return 2
    try:
        found = check(file, float(more[1]) if more else MOST_WORK)
    except Refused as error:
        sys.stdout.write(f"refused: {error}\n".encode("ascii", "backslashreplace").decode())
        return 1
    no_less = f"no path costs less than {found['lower']!r}" if math.isfinite(found["lower"]) else "there is no path"
    at_most = f"; this path costs at most {found['upper']!r}" if math.isfinite(found["upper"]) else ""
    sys.stdout.write(f"verified: {no_less}{at_most}\nproblem {found['problem']}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""
Check a proof file: a lower bound of the cost of all paths, and an upper bound of the cost of one.

This is one file, which needs Python and NumPy alone: copy it anywhere. It believes nothing that a proof file says. Such
a file holds a problem, a path and surfaces; all that is printed is computed here, in interval arithmetic.
``docs/how-it-works/proof-files.md`` states the argument and the format, and this file follows its sections.

Usage: ``python check_proof.py NAME.proof``. It prints what is proven (exit 0), or what is wrong (exit 1).
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
from itertools import pairwise, permutations
from typing import Any, TypeAlias, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
Wholes: TypeAlias = NDArray[np.int64]
Truths: TypeAlias = NDArray[np.bool_]
Point: TypeAlias = tuple[float, float]
#: Reads an array of a proof file: name, ``f`` for floats or ``i`` for whole numbers, number of axes.
Reader: TypeAlias = Callable[[str, str, int], Any]

FORMAT, VERSION = "path-cost-proof", 1
#: Bytes of one array, and of a file, uncompressed; surfaces inside surfaces; pieces in one batch; cells of a grid.
MOST_BYTES, MOST_IN_ALL, MOST_LEVELS, BATCH, MOST_CELLS = 1 << 28, 1 << 30, 8, 1 << 14, 1 << 26
#: Risk below this part of a unit of cost is not looked at, which lowers the cost; parts of a path, at most.
FAINT, MOST_PARTS = 1e-10, 1_000_000
#: Patches of a raster along the side of a box, at most, for which a linear bound is computed.
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

    def __mul__(self, other: "Interval | ArrayLike") -> "Interval":
        other = enclosed(other)
        four = self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi
        return _hull(four)

    def __truediv__(self, other: "Interval | ArrayLike") -> "Interval":
        other = enclosed(other)
        demand((other.lo > 0.0).all(), "a number is divided by one that may be 0")
        return _hull((self.lo / other.lo, self.lo / other.hi, self.hi / other.lo, self.hi / other.hi))

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: ArrayLike) -> "Interval":
        return enclosed(other) - self

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


def _hull(four: tuple[Floats, Floats, Floats, Floats]) -> Interval:
    """Return the least intervals that hold four numbers each, which are rounded."""
    a, b, c, d = four
    return Interval(
        down(np.minimum(np.minimum(a, b), np.minimum(c, d))), up(np.maximum(np.maximum(a, b), np.maximum(c, d)))
    )


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

    def __init__(self, described: dict[str, Any], array: Reader) -> None:
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

    def lower_costs(self, boxes: "Boxes") -> Floats:
        """Bound the cost from below on boxes by linear functions: their values at 3 x 3 places, shape (n, 3, 3)."""
        x, y = boxes.places()
        middle_x, middle_y = (x[0] + x[1]) * 0.5, (y[0] + y[1]) * 0.5
        half_x, half_y = (x[1] - x[0]) * 0.5, (y[1] - y[0]) * 0.5
        reach = (half_x.square() + half_y.square()).root().hi
        risk, slope_x, slope_y, bend = self._risk(middle_x, middle_y, reach)
        lost = Interval(reach).square() * bend * 0.5
        for raster in self.rasters:
            value, along, across, drop = raster.floor(boxes)
            risk, slope_x, slope_y, lost = risk + value, slope_x + along, slope_y + across, lost + drop
        scale = self._scale(x, y) if self.on_earth else Interval(1.0)
        found = np.empty((len(reach), 3, 3))
        for b in range(3):
            for a in range(3):
                total = risk + slope_x * half_x * (a - 1.0) + slope_y * half_y * (b - 1.0) - lost
                found[:, b, a] = ((total * self.k + 1.0) * scale).lo
        return np.where(np.isnan(found), -np.inf, found)

    def constant_costs(self, boxes: "Boxes") -> Floats:
        """Bound the cost from below on boxes by constants, shape (n,)."""
        x, y = boxes.places()
        middle_x, middle_y = (x[0] + x[1]) * 0.5, (y[0] + y[1]) * 0.5
        reach = (((x[1] - x[0]) * 0.5).square() + ((y[1] - y[0]) * 0.5).square()).root()
        clear = Interval(np.ones(len(reach.lo)))
        for at_x, at_y, spread, peak in self.threats:
            far = ((middle_x - at_x).square() + (middle_y - at_y).square()).root() + reach
            clear = clear * (1.0 - exp((far / spread).square() * -0.5) * peak)
        risk = Interval(np.maximum((1.0 - clear).lo, 0.0))
        for raster in self.rasters:
            risk = risk + raster.least(boxes)
        return ((risk * self.k + 1.0) * (self._scale(x, y) if self.on_earth else 1.0)).lo

    def _risk(self, x: Interval, y: Interval, reach: Floats) -> tuple[Interval, Interval, Interval, Floats]:
        """
        Enclose the risk of threats and its slopes at points, and bound how much it bends down within reach of them.

        With ``q = 1 / s^2``, at d from a point, ``1 - f_i <= u_i = 1 - f_i(0) + f_i(0) q_i (r_i . d + d^2 / 2)``, as
        ``exp t >= 1 + t``; values and slopes of both sides are equal at d = 0. So ``F(d) >= F(0) + grad F(0) . d - M
        d^2 / 2``, where no eigenvalue of the Hessian of ``prod u_i`` is above ``M = R sum f_i q_i + R' sum |grad u_i|
        |grad u_j|`` over all i and j that differ; R is the greatest product of all u_i but one, R' of all but two.
        """
        n = len(reach)
        risk, slope_x, slope_y, clear = (Interval(np.full(n, one), np.full(n, one)) for one in (0.0, 0.0, 0.0, 1.0))
        shares, slopes, squares, rest, least, second = (np.full(n, one) for one in (0.0, 0.0, 0.0, 1.0, 1.0, 1.0))
        count = np.zeros(n, dtype=np.int64)
        far = math.sqrt(-2.0 * math.log(FAINT / max(self.k, 1.0) / max(len(self.threats), 1)))
        for at_x, at_y, spread, peak in self.threats:
            (near,) = np.nonzero(np.hypot(x.lo - at_x, y.lo - at_y) < spread * far)
            dx, dy, around = x[near] - at_x, y[near] - at_y, Interval(reach[near])
            q = Interval(1.0) / Interval(spread).square()
            square = dx.square() + dy.square()
            value = exp(square * q * -0.5) * peak
            share, away, before = value * q, square.root(), clear[near]
            slope = (share * (away + around)).hi
            shares[near], slopes[near] = up(shares[near] + share.hi), up(slopes[near] + slope)
            squares[near] = down(squares[near] + down(slope * slope))
            # the two least factors u_i, and the product of the others
            factor = (1.0 - value + share * around * (away + around * 0.5)).hi
            one, two = np.where(count[near] > 0, least[near], np.inf), np.where(count[near] > 1, second[near], np.inf)
            greatest = np.maximum(two, factor)
            least[near] = np.where(count[near] > 0, np.minimum(one, factor), factor)
            second[near] = np.where(count[near] > 0, np.minimum(two, np.maximum(one, factor)), 1.0)
            rest[near] = up(rest[near] * np.where(count[near] > 1, greatest, 1.0))
            count[near] += 1
            slope_x.put(near, slope_x[near] * (1.0 - value) - share * dx * before)
            slope_y.put(near, slope_y[near] * (1.0 - value) - share * dy * before)
            risk.put(near, risk[near] + before * value)
            clear.put(near, before * (1.0 - value))
        bend = Interval(rest) * (
            Interval(second) * shares + Interval(np.maximum(up(up(slopes * slopes) - squares), 0.0))
        )
        return risk, slope_x, slope_y, bend.hi

    @staticmethod
    def _scale(x: list[Interval], y: list[Interval]) -> Interval:
        """
        Bound the length on the Earth of a unit of the plane, from below.

        It is ``sin t / t >= 1 - t^2 / 6 + t^4 / 120 - t^6 / 5040`` or more, at t times the polar radius.
        """
        far = (np.maximum(np.abs(side[0].lo), np.abs(side[1].hi)) for side in (x, y))
        t = sum((Interval(one).square() for one in far), Interval(0.0)) / Interval(POLAR_RADIUS).square()
        series = 1.0 - t / 6.0 * (1.0 - t / 20.0 * (1.0 - t / 42.0))
        return Interval(np.maximum(series.lo, 0.0))


class Raster:
    """
    Risk on cells: one value on each (on edges the lesser one), or bilinear between middles; 0 beyond the outer edges.

    It consists of patches between knots: edges of cells, or the outer edges and the middles.
    """

    def __init__(self, described: dict[str, Any], array: Reader) -> None:
        self.values: Floats = array(described["values"], "f", 2)
        self.bounds = [number_of(one) for one in described["bounds"]]
        self.is_bilinear = described["interpolation"] == "bilinear"
        demand(self.is_bilinear or described["interpolation"] == "nearest", "an interpolation is not known")
        demand(self.values.size > 0 and (self.values >= 0.0).all(), "a raster is empty, or negative somewhere")
        demand(max(self.values.shape) < 1 << 18, "a raster has too many rows or columns")
        demand(self.bounds[0] < self.bounds[2] and self.bounds[1] < self.bounds[3], "the bounds of a raster are empty")
        self.places: list[list[Fraction]] = []
        for axis in range(2):
            n, low, high = self.values.shape[1 - axis], Fraction(self.bounds[axis]), Fraction(self.bounds[axis + 2])
            middles = [Fraction(0), *(Fraction(2 * i + 1, 2) for i in range(n)), Fraction(n)]
            steps = middles if self.is_bilinear else [Fraction(i) for i in range(n + 1)]
            self.places.append([low + (high - low) * step / n for step in steps])
        near = [np.array([float(one) for one in places]) for places in self.places]
        self.knots = [Interval(down(one), up(one)) for one in near]
        if self.is_bilinear:
            self.values = np.pad(self.values, 1, mode="edge")
        self.shape = len(self.places[0]) - 1, len(self.places[1]) - 1
        self.known: dict[int, tuple[Any, list[tuple[Wholes, Wholes]]]] = {}

    def patches(self, boxes: "Boxes") -> tuple[list[tuple[Wholes, Wholes]], Truths]:
        """Return the first and last patch along each axis that each box meets, and whether no other risk does."""
        if id(boxes.grid) not in self.known:
            units = [[boxes.grid.unit_of(axis, one) for one in self.places[axis]] for axis in range(2)]
            whole = [(np.array([math.floor(u) for u in one]), np.array([math.ceil(u) for u in one])) for one in units]
            # (the grid is kept, so that no other one gets its number)
            self.known[id(boxes.grid)] = boxes.grid, whole
        found, inside = [], np.ones(len(boxes.sides[0]), dtype=np.bool_)
        for axis, (below, above) in enumerate(self.known[id(boxes.grid)][1]):
            low, high = boxes.sides[2 * axis], boxes.sides[2 * axis + 1]
            first = np.searchsorted(above, low, side="right") - 1
            last = np.searchsorted(below, high, side="left") - 1
            inside &= (first >= 0) & (last < self.shape[axis])
            # on the border of the map, a patch beyond it may be the lesser one, and no other box meets it
            border = boxes.grid.inside[axis]
            beyond = np.searchsorted(above, low, side="left") - 1, np.searchsorted(below, high, side="right") - 1
            first = np.where(low <= border[0], np.maximum(beyond[0], 0), first)
            last = np.where(high >= border[1], np.minimum(beyond[1], self.shape[axis] - 1), last)
            found.append((first, last))
        return [(np.where(inside, first, 0), np.where(inside, last, 0)) for first, last in found], inside

    def least(self, boxes: "Boxes") -> Floats:
        """Bound the risk on boxes from below by constants."""
        ((left, right), (bottom, top)), inside = self.patches(boxes)
        further = 1 if self.is_bilinear else 0
        found = np.full(len(left), np.inf)
        for i, j in offsets(left, right + further, bottom, top + further):
            found = np.minimum(found, self.values[j, i])
        return np.where(inside, found, 0.0)

    def floor(self, boxes: "Boxes") -> tuple[Interval, Interval, Interval, Interval]:
        """
        Bound the risk on boxes from below by linear functions: value in the middle, slopes, and the excess.

        A linear function less a bilinear one is greatest at a corner of what a box has of a patch.
        """
        ((left, right), (bottom, top)), inside = self.patches(boxes)
        nothing = Interval(np.zeros(len(left)))
        if not self.is_bilinear or max((right - left).max(initial=0), (top - bottom).max(initial=0)) > FEW_PATCHES:
            return Interval(self.least(boxes)), nothing, nothing, nothing
        x, y = boxes.places()
        corner = [[self.at(x[a], y[b], (left, right)[a], (bottom, top)[b]).lo for a in range(2)] for b in range(2)]
        (south_west, south_east), (north_west, north_east) = corner
        value = Interval(np.where(inside, 0.25 * (south_west + south_east + north_west + north_east), 0.0))
        rise_x, rise_y = (
            south_east + north_east - south_west - north_west,
            north_west + north_east - south_west - south_east,
        )
        slope_x = Interval(np.where(inside, 0.5 * rise_x / (x[1] - x[0]).hi, 0.0))
        slope_y = Interval(np.where(inside, 0.5 * rise_y / (y[1] - y[0]).hi, 0.0))
        middle_x, middle_y = (x[0] + x[1]) * 0.5, (y[0] + y[1]) * 0.5
        lost = np.full(len(left), -np.inf)
        for i, j in offsets(left, right, bottom, top):
            for u in (_greater(x[0], self.knots[0][i]), _lesser(x[1], self.knots[0][i + 1])):
                for v in (_greater(y[0], self.knots[1][j]), _lesser(y[1], self.knots[1][j + 1])):
                    line = value + slope_x * (u - middle_x) + slope_y * (v - middle_y)
                    lost = np.maximum(lost, (line - self.at(u, v, i, j)).hi)
        return value, slope_x, slope_y, Interval(np.where(inside, lost, 0.0))

    def at(self, x: Interval, y: Interval, i: Wholes, j: Wholes) -> Interval:
        """Enclose bilinear patches at points of them."""
        s, t = (
            ((place - knots[n]) / (knots[n + 1] - knots[n])).within(0.0, 1.0)
            for place, knots, n in ((x, self.knots[0], i), (y, self.knots[1], j))
        )
        low = (1.0 - s) * self.values[j, i] + s * self.values[j, i + 1]
        high = (1.0 - s) * self.values[j + 1, i] + s * self.values[j + 1, i + 1]
        return (1.0 - t) * low + t * high

    def exact(self, point: list[Fraction], where: list[list[int]]) -> Fraction:
        """Return the risk at a point in patches, exactly: the least of theirs."""
        if not where[0]:
            return Fraction(0)
        if not self.is_bilinear:
            return min(Fraction(float(self.values[j, i])) for i in where[0] for j in where[1])
        i, j = where[0][0], where[1][0]
        s, t = (
            (point[axis] - self.places[axis][n]) / (self.places[axis][n + 1] - self.places[axis][n])
            for axis, n in enumerate((i, j))
        )
        corner = [[Fraction(float(self.values[j + b, i + a])) for a in range(2)] for b in range(2)]
        low, high = ((1 - s) * line[0] + s * line[1] for line in corner)
        return (1 - t) * low + t * high


def offsets(left: Wholes, right: Wholes, bottom: Wholes, top: Wholes) -> Iterator[tuple[Wholes, Wholes]]:
    """Yield columns and rows of all that is between the first and the last ones; smaller ranges repeat their last."""
    for dj in range(int((top - bottom).max(initial=0)) + 1):
        for di in range(int((right - left).max(initial=0)) + 1):
            yield np.minimum(left + di, right), np.minimum(bottom + dj, top)


def _greater(one: Interval, other: Interval) -> Interval:
    return Interval(np.maximum(one.lo, other.lo), np.maximum(one.hi, other.hi))


def _lesser(one: Interval, other: Interval) -> Interval:
    return Interval(np.minimum(one.lo, other.lo), np.minimum(one.hi, other.hi))


# --- Grids ------------------------------------------------------------------------------------------------------------


class Boxes:
    """Boxes of a grid: sides in units, west, east, south and north, shapes (n,)."""

    def __init__(self, grid: "Grid", sides: list[Wholes]) -> None:
        self.grid, self.sides = grid, sides

    def __getitem__(self, key: Any) -> "Boxes":
        return Boxes(self.grid, [side[key] for side in self.sides])

    def places(self) -> tuple[list[Interval], list[Interval]]:
        """Enclose the sides in map units: west and east, and south and north."""
        x, y = ([self.grid.place(axis, side) for side in self.sides[2 * axis : 2 * axis + 2]] for axis in range(2))
        return x, y

    def quarters(self) -> Iterator[tuple[Truths, "Boxes"]]:
        """Yield which boxes have a part in each quarter of their cell, and that part."""
        parts = self.grid.parts
        middles = [(self.sides[2 * axis] + parts // 2) // parts * parts for axis in range(2)]
        for east in range(2):
            for north in range(2):
                sides = [one.copy() for one in self.sides]
                for axis, upper in enumerate((east, north)):
                    side = 2 * axis + 1 - upper
                    sides[side] = (np.minimum, np.maximum)[upper](sides[side], middles[axis])
                real = (sides[0] < sides[1]) & (sides[2] < sides[3])
                yield real, Boxes(self.grid, [side[real] for side in sides])


class Grid:
    """
    Cells, cut by areas into pieces.

    Unit u is at ``low + u (high - low) / divide`` of the span, along each axis. Cell (i, j) is a box of `parts` units,
    an even number, around unit (i parts, j parts). Each unit square of a cell that is cut has a label: 0 where it is
    closed, or the number of a piece. Pieces are in the order of cells (row by row), then of labels.
    """

    def __init__(self, described: dict[str, Any], array: Reader, problem: Problem) -> None:
        self.span = [number_of(one) for one in described["span"]]
        self.divide = [whole_of(one) for one in described["divide"]]
        self.parts = whole_of(described["parts"])
        demand(all(1 <= one < 1 << 40 for one in self.divide), "a grid is not divided")
        demand(self.span[0] < self.span[2] and self.span[1] < self.span[3], "the span of a grid is empty")
        demand(2 <= self.parts <= 1 << 12 and self.parts % 2 == 0, "the parts of a cell are not an even number")
        self._read_cells(array(described["runs"], "i", 2))
        self._read_labels(described, array)
        self.controls = self._read_controls(described, array)
        places = [[self.unit_of(axis, Fraction(problem.bounds[axis + end])) for end in (0, 2)] for axis in range(2)]
        #: The first unit of the map and the one after the last, along each axis.
        self.inside = [(math.floor(low), math.ceil(high)) for low, high in places]
        self._check_labels(problem)

    def _read_cells(self, runs: Wholes) -> None:
        demand(
            runs.shape[1] == 3 and len(runs) > 0 and (runs == np.clip(runs, -(1 << 30), 1 << 30)).all(),
            "runs are not row, first, end",
        )
        lengths, after = runs[:, 2] - runs[:, 1], np.diff(runs[:, 0])
        demand((lengths > 0).all() and lengths.sum() < MOST_CELLS, "a run is empty, or a grid too large")
        demand(((after > 0) | ((after == 0) & (runs[1:, 1] >= runs[:-1, 2]))).all(), "runs are not in order")
        self.rows = np.repeat(runs[:, 0], lengths)
        self.columns = np.arange(len(self.rows)) + np.repeat(runs[:, 1] - np.cumsum(lengths) + lengths, lengths)
        # a table of cells, one cell wider on each side
        self.corner = int(self.columns.min()) - 1, int(self.rows.min()) - 1
        self.shape = int(self.rows.max()) - self.corner[1] + 2, int(self.columns.max()) - self.corner[0] + 2
        demand(self.shape[0] * self.shape[1] < 2 * MOST_CELLS, "a grid is too wide")
        self.table = np.full(self.shape, -1, dtype=np.int64)
        self.table[self.rows - self.corner[1], self.columns - self.corner[0]] = np.arange(len(self.rows))

    def _read_labels(self, described: dict[str, Any], array: Reader) -> None:
        p, n, has_cuts = self.parts, len(self.rows), "cut" in described
        cut: Wholes = array(described["cut"], "i", 1) if has_cuts else np.empty(0, dtype=np.int64)
        self.labels: Wholes = array(described["labels"], "i", 3) if has_cuts else np.empty((0, p, p), dtype=np.int64)
        demand(self.labels.shape == (len(cut), p, p), "labels do not fit the cells that are cut")
        demand((np.diff(cut) > 0).all() and (cut >= 0).all() and (cut < n).all(), "cut cells are not in order")
        demand((self.labels >= 0).all() and (self.labels < 1 << 12).all(), "a label is out of range")
        self.cut = cut
        self.place_of_cut = np.full(n, -1, dtype=np.int64)
        self.place_of_cut[cut] = np.arange(len(cut))
        counts = np.ones(n, dtype=np.int64)
        counts[cut] = self.labels.max(axis=(1, 2), initial=0)
        self.first_piece = np.cumsum(counts) - counts
        self.cell = np.repeat(np.arange(n), counts)
        self.label = np.arange(len(self.cell)) - self.first_piece[self.cell] + 1

    def _read_controls(self, described: dict[str, Any], array: Reader) -> Wholes:
        """Return the numbers of the control values of each piece; row by row around all cells, if none are given."""
        if "controls" in described:
            found: Wholes = np.cumsum(array(described["controls"], "i", 2), axis=0)
            demand(found.shape == (len(self.cell), 9) and found.min() >= 0, "controls do not fit the pieces")
            return found
        demand(not len(self.cut), "a grid with cut cells has no controls")
        wide = np.zeros((self.shape[0] + 1, self.shape[1] + 1), dtype=np.bool_)
        around = [
            (self.rows - self.corner[1] + b, self.columns - self.corner[0] + a) for b in (-1, 0, 1) for a in (-1, 0, 1)
        ]
        for some in around:
            wide[some] = True
        numbers = np.cumsum(wide.ravel()).reshape(wide.shape) - 1
        return np.stack([numbers[some] for some in around], axis=1)

    def _check_labels(self, problem: Problem) -> None:
        """Check that units with label 0 are closed, and that the pieces of a cell do not touch."""
        for part in batches(len(self.cut), self.parts**2):
            labels, cells = self.labels[part], self.cut[part]
            which, v, u = np.nonzero(labels == 0)
            wrong = ~closed(self, problem, *self._units(cells[which], u, v))
            demand(not wrong.any(), lambda: f"a unit of {self.name(cells[which[wrong.argmax()]])} is not closed")
            for one, other in (
                (labels[:, 1:], labels[:, :-1]),
                (labels[:, :, 1:], labels[:, :, :-1]),
                (labels[:, 1:, 1:], labels[:, :-1, :-1]),
                (labels[:, 1:, :-1], labels[:, :-1, 1:]),
            ):
                demand(not ((one != other) & (one > 0) & (other > 0)).any(), "two pieces of a cell touch")

    def _units(self, cells: Wholes, u: Wholes, v: Wholes) -> tuple[Wholes, Wholes]:
        """Return units from those counted from the corner of their cells."""
        half = self.parts // 2
        return self.columns[cells] * self.parts - half + u, self.rows[cells] * self.parts - half + v

    def name(self, cell: int) -> str:
        """Name a cell in a message."""
        return f"cell ({self.columns[cell]}, {self.rows[cell]}) of 1/{self.divide[0] // self.parts}"

    def unit_of(self, axis: int, place: Fraction) -> Fraction:
        """Return a place along an axis in units, exactly."""
        low, high = Fraction(self.span[axis]), Fraction(self.span[axis + 2])
        return (place - low) * self.divide[axis] / (high - low)

    def place(self, axis: int, units: ArrayLike) -> Interval:
        """Enclose the place of units along an axis."""
        return Interval(units) * self.step(axis) + self.span[axis]

    def step(self, axis: int) -> Interval:
        """Enclose the length of a unit along an axis."""
        return (Interval(self.span[axis + 2]) - self.span[axis]) / float(self.divide[axis])

    def number(self, columns: Wholes, rows: Wholes) -> Wholes:
        """Return the numbers of cells, -1 where the grid has none."""
        i, j = columns - self.corner[0], rows - self.corner[1]
        seen = (i >= 0) & (j >= 0) & (i < self.shape[1]) & (j < self.shape[0])
        return np.where(seen, self.table[np.where(seen, j, 0), np.where(seen, i, 0)], -1)

    def labels_at(self, cells: Wholes, u: int, v: int) -> Wholes:
        """Return the labels of a unit of cells, counted from their corner."""
        place = self.place_of_cut[cells]
        return (
            np.where(place >= 0, self.labels[place, v, u], 1) if len(self.cut) else np.ones(len(cells), dtype=np.int64)
        )

    def boxes(self) -> Boxes:
        """Return the boxes around what is open and on the map of each piece."""
        half = self.parts // 2
        middle = self.columns[self.cell] * self.parts, self.rows[self.cell] * self.parts
        sides = [middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half]
        (cut,) = np.nonzero(self.place_of_cut[self.cell] >= 0)
        for part in batches(len(cut), self.parts**2):
            some = cut[part]
            is_open = self.labels[self.place_of_cut[self.cell[some]]] == self.label[some, None, None]
            for axis in range(2):
                along = is_open.any(axis=1 + axis)
                sides[2 * axis][some] += along.argmax(axis=1)
                sides[2 * axis + 1][some] -= along[:, ::-1].argmax(axis=1)
        return Boxes(self, [np.clip(side, *self.inside[n // 2]) for n, side in enumerate(sides)])

    def pieces_at(self, point: Point) -> list[int]:
        """List the pieces that hold a point."""
        units = [self.unit_of(axis, Fraction(point[axis])) for axis in range(2)]
        found, half = set(), self.parts // 2
        for u in {math.floor(units[0]), math.ceil(units[0]) - 1}:
            for v in {math.floor(units[1]), math.ceil(units[1]) - 1}:
                column, row = (u + half) // self.parts, (v + half) // self.parts
                cell = self.number(np.array([column]), np.array([row]))
                if cell[0] >= 0:
                    label = self.labels_at(cell, u + half - column * self.parts, v + half - row * self.parts)[0]
                    found |= {int(self.first_piece[cell[0]] + label - 1)} if label else set()
        return sorted(found)

    def touching(self) -> Iterator[tuple[Wholes, Wholes, int, int]]:
        """Yield pieces and the pieces of neighbouring cells that they touch, and by how much the cells are apart."""
        last, along = self.parts - 1, range(self.parts)
        for di, dj in ((1, 0), (0, 1), (1, 1), (-1, 1)):
            other = self.number(self.columns + di, self.rows + dj)
            (one,) = np.nonzero(other >= 0)
            other = other[one]
            cut = (self.place_of_cut[one] >= 0) | (self.place_of_cut[other] >= 0)
            yield self.first_piece[one[~cut]], self.first_piece[other[~cut]], di, dj
            one, other, found = one[cut], other[cut], []
            sides = [(a, b) for a in along for b in (a - 1, a, a + 1) if b in along] if 0 in {di, dj} else [(0, 0)]
            for a, b in sides:
                u, s = (a, b) if di == 0 else (last, 0) if di > 0 else (0, last)
                v, t = (a, b) if dj == 0 else (last, 0)
                p, q = self.labels_at(one, u, v), self.labels_at(other, s, t)
                pairs = np.column_stack([self.first_piece[one] + p - 1, self.first_piece[other] + q - 1])
                found.append(np.unique(pairs[(p > 0) & (q > 0)], axis=0))
            pairs = np.unique(np.concatenate(found), axis=0)
            yield pairs[:, 0], pairs[:, 1], di, dj

    def lacks(self, problem: Problem, columns: Wholes, rows: Wholes) -> Truths:
        """Tell which cells this grid has not, although a path may pass them."""
        found = self.number(columns, rows) < 0
        columns, rows = columns[found], rows[found]
        quarters = [closed(_Halves(self), problem, 2 * columns + i, 2 * rows + j) for i in range(2) for j in range(2)]
        found[found] = ~np.all(quarters, axis=0)
        return found


class _Halves:
    """The halves of the cells of a grid taken as units: cell i is from 2 i to 2 i + 2."""

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self.inside = [
            (math.floor(Fraction(2 * low, grid.parts)) + 1, math.ceil(Fraction(2 * high, grid.parts)) + 1)
            for low, high in grid.inside
        ]

    def unit_of(self, axis: int, place: Fraction) -> Fraction:
        """Return a place along an axis in halves of cells, exactly."""
        return self.grid.unit_of(axis, place) * 2 / self.grid.parts + 1


def closed(grid: "Grid | _Halves", problem: Problem, u: Wholes, v: Wholes) -> Truths:
    """
    Tell which unit squares no path can be inside of.

    Those are outside of the map, or in an area: no edge of it meets the square, and the middle is inside.
    """
    (x_low, x_high), (y_low, y_high) = grid.inside
    found = (u < x_low) | (u >= x_high) | (v < y_low) | (v >= y_high)
    (rest,) = np.nonzero(~found)
    if not len(rest) or not len(problem.edges):
        return found
    u, v = u[rest], v[rest]
    exact = [[grid.unit_of(n % 2, Fraction(one)) for n, one in enumerate(edge)] for edge in problem.edges.tolist()]
    ax, ay, bx, by = np.array([[float(one) for one in edge] for edge in exact]).T
    # edges in units, rounded by far less than `blur`: what is that near counts as met
    blur = 2.0**-40 * max(1.0, np.abs([ax, ay, bx, by]).max())
    demand(blur < 0.01, "an area is too far away, or a grid too fine")
    level = np.abs(by - ay) < 2.0**-10
    rise = np.where(level, 1.0, by - ay)
    # the rows that an edge crosses, and from where to where
    edge, row = ranges(
        np.maximum(np.floor(np.minimum(ay, by) - blur), v.min()),
        np.minimum(np.floor(np.maximum(ay, by) + blur), v.max()),
    )
    ends = [
        np.where(level[edge], end, ax[edge] + np.clip((y - ay[edge]) / rise[edge], 0.0, 1.0) * (bx - ax)[edge])
        for y, end in ((row - blur, ax[edge]), (row + 1.0 + blur, bx[edge]))
    ]
    # (a quotient is off by less than 2^-10 times the blur over the rise)
    reach = blur * (2.0 + 2.0**-10 * np.abs((bx - ax) / rise)[edge])
    first = np.maximum(np.floor(np.minimum(*ends) - reach), u.min())
    which, column = ranges(first, np.minimum(np.floor(np.maximum(*ends) + reach), u.max()))
    width = int(u.max()) + 1
    free = ~np.isin(v * width + u, np.unique(row[which].astype(np.int64) * width + column.astype(np.int64)))
    # the rows whose middle an edge crosses, exactly: each is crossed an even number of times
    levels = np.array([[math.floor(one[n] - Fraction(1, 2)) for n in (1, 3)] for one in exact], dtype=np.float64)
    edge, row = ranges(np.maximum(levels.min(axis=1) + 1.0, v.min()), np.minimum(levels.max(axis=1), v.max()))
    at = ax[edge] + np.clip((row + 0.5 - ay[edge]) / np.where(by == ay, 1.0, by - ay)[edge], 0.0, 1.0) * (bx - ax)[edge]
    order = np.lexsort((np.concatenate([at, u + 0.5]), np.concatenate([row, v])))
    crossed = np.empty(len(order), dtype=np.int64)
    crossed[order] = np.cumsum((order < len(at)).astype(np.int64))
    found[rest] = free & (crossed[len(at) :] % 2 == 1)
    return found


def ranges(first: Floats, last: Floats) -> tuple[Wholes, Floats]:
    """Return all whole numbers from first to last ones, and which range each is of; a range may be empty."""
    counts = np.maximum(last - first + 1.0, 0.0).astype(np.int64)
    demand(counts.sum() < MOST_CELLS, "the areas have too many edges for such a grid")
    which = np.repeat(np.arange(len(counts)), counts)
    return which, first[which] + np.arange(len(which)) - (np.cumsum(counts) - counts)[which]


def batches(n: int, size: int = 1) -> list[slice]:
    """Return slices of n items of a size."""
    step = max(BATCH // size, 1)
    return [slice(first, min(first + step, n)) for first in range(0, n, step)]


# --- Surfaces ---------------------------------------------------------------------------------------------------------


def bezier(controls: Wholes) -> Wholes:
    """Return four times the Bernstein values of splines with such control values, whole numbers, shape (n, 3, 3)."""
    half = np.stack(
        [controls[:, :, 0] + controls[:, :, 1], 2 * controls[:, :, 1], controls[:, :, 1] + controls[:, :, 2]], axis=2
    )
    return np.stack([half[:, 0] + half[:, 1], 2 * half[:, 1], half[:, 1] + half[:, 2]], axis=1)


def restricted(values: Floats, ends: list[Interval]) -> Interval:
    """
    Turn Bernstein values on cells, shape (n, 3, 3), into those on boxes in the cells.

    `ends` are west, east, south and north of each box, in cells from the corner. The values on [s, t] are those of the
    polar form ``(1 - s) (1 - t) b_0 + ((1 - s) t + s (1 - t)) b_1 + s t b_2`` at (s, s), (s, t) and (t, t).
    """
    found = Interval(values)
    for axis, (low, high) in ((2, ends[:2]), (1, ends[2:])):
        s, t = low[:, None], high[:, None]
        b = [found[:, :, n] if axis == 2 else found[:, n] for n in range(3)]
        new = [
            (1.0 - p) * (1.0 - q) * b[0] + ((1.0 - p) * q + p * (1.0 - q)) * b[1] + p * q * b[2]
            for p, q in ((s, s), (s, t), (t, t))
        ]
        found = Interval(np.stack([one.lo for one in new], axis=axis), np.stack([one.hi for one in new], axis=axis))
    return found


class Surface:
    """
    A biquadratic spline on the pieces of a grid. Its control values are whole numbers times ``2^-exponent``.

    It has to be continuous where pieces touch, and no steeper than the cost outside of blocks. Pieces that are steeper
    are charged for, and so are blocks.
    """

    def __init__(
        self, described: dict[str, Any], array: Reader, grid: Grid, problem: Problem, end: Point, level: int = 0
    ) -> None:
        demand(level < MOST_LEVELS, "too many surfaces are inside one another")
        self.grid, self.problem, self.end, self.level = grid, problem, end, level
        exponent = whole_of(described["exponent"])
        demand(abs(exponent) < 1 << 9, "an exponent is out of range")
        #: One unit of `bezier`.
        self.unit = math.ldexp(0.25, -exponent)
        values: Wholes = np.cumsum(array(described["values"], "i", 1))
        demand((np.abs(values.astype(np.float64)) < 2.0**46).all(), "a control value is too great")
        demand(grid.controls.max() < len(values), "a control value is missing")
        self.controls = values[grid.controls].reshape(-1, 3, 3)
        self._check_continuous()
        self.blocks = [Block(one, array, self) for one in described["blocks"]]
        self.end_block = Block(described["end"], array, self) if "end" in described else None
        self.in_block = np.zeros(len(grid.cell), dtype=np.bool_)
        for block in [*self.blocks, *([self.end_block] if self.end_block else [])]:
            demand(not self.in_block[block.pieces].any(), "two blocks overlap")
            self.in_block[block.pieces] = True
        self.steepness, self.least_cost = self.measured(np.ones(len(grid.cell), dtype=np.bool_))
        self.steepness[self.in_block] = 0.0
        wrong = ~np.isfinite(self.steepness)
        demand(not wrong.any(), lambda: f"the slope has no bound in {grid.name(int(grid.cell[wrong.argmax()]))}")
        #: What a difference of two values of the surface may be above the cost of a path between the places.
        self.loss = self._charge()
        #: What a value may be above the cost of a path to the end.
        self.excess = up(self.loss + self.end_block.excess()) if self.end_block else math.inf

    def _check_continuous(self) -> None:
        """Check that pieces that touch have the same control values around what they share."""
        for one, other, di, dj in self.grid.touching():
            a = self.controls[one][:, max(dj, 0) : 3 + min(dj, 0), max(di, 0) : 3 + min(di, 0)]
            b = self.controls[other][:, max(-dj, 0) : 3 + min(-dj, 0), max(-di, 0) : 3 + min(-di, 0)]
            wrong = (a != b).any(axis=(1, 2))
            demand(
                not wrong.any(),
                lambda: f"a surface breaks beside {self.grid.name(int(self.grid.cell[one[wrong.argmax()]]))}",
            )

    def measured(self, asked: Truths) -> tuple[Floats, float]:
        """Bound how steep the surface is against the cost on each piece that is asked for, and the cost from below."""
        grid, steepness, least_cost = self.grid, np.zeros(len(self.grid.cell)), math.inf
        boxes, (pieces,) = grid.boxes(), np.nonzero(asked)
        for part in batches(len(pieces)):
            some = pieces[part]
            whole = boxes[some]
            # (rasters may have lines through the middles of cells)
            for real, box in (
                whole.quarters() if self.problem.rasters else [(np.ones(len(some), dtype=np.bool_), whole)]
            ):
                costs = self.problem.lower_costs(box)
                slopes = self._squared_slopes(some[real], box)
                positive = np.maximum(costs, 0.0)
                with np.errstate(divide="ignore"):
                    ratio = up(slopes / down(positive * positive)).max(axis=(1, 2))
                ratio[(costs <= 0.0).any(axis=(1, 2))] = np.inf
                least = costs.min(axis=(1, 2))
                (hard,) = np.nonzero(ratio > 1.0)
                if len(hard):
                    # a constant bound serves as well
                    least[hard] = np.maximum(least[hard], self.problem.constant_costs(box[hard]))
                    demand((least[hard] > 0.0).all(), "a cost is not above 0")
                    ratio[hard] = np.minimum(ratio[hard], up(slopes[hard].max(axis=(1, 2)) / down(least[hard] ** 2)))
                least_cost = min(least_cost, float(least.min(initial=math.inf)))
                steepness[some[real]] = np.maximum(steepness[some[real]], up(np.sqrt(ratio)))
        return steepness, least_cost

    def _squared_slopes(self, pieces: Wholes, boxes: Boxes) -> Floats:
        """
        Bound the squares of the lengths of the Bernstein vectors of the gradient from above, on boxes in pieces.

        Those on whole cells are means of differences of neighbouring control values: whole numbers.
        """
        grid, u = self.grid, self.controls[pieces]
        total = Interval(np.zeros(u.shape))
        ends = self._ends(pieces, boxes.sides, [1, 1])
        for axis in range(2):
            # (the gradient is linear along its own axis: the middle value is the mean)
            d = np.diff(u if axis == 0 else u.swapaxes(1, 2), axis=2)
            across = np.stack([2 * (d[:, 0] + d[:, 1]), 4 * d[:, 1], 2 * (d[:, 1] + d[:, 2])], axis=1)
            vectors = np.stack([across[:, :, 0], (across[:, :, 0] + across[:, :, 1]) // 2, across[:, :, 1]], axis=2)
            values = (vectors if axis == 0 else vectors.swapaxes(1, 2)).astype(np.float64)
            on_box = self._on_parts(values, ends)
            total = total + (on_box * self.unit / (grid.step(axis) * float(grid.parts))).square()
        return total.hi

    @staticmethod
    def _on_parts(values: Floats, ends: list[Interval]) -> Interval:
        """Restrict Bernstein values to boxes, where these are not the whole cell."""
        part = (ends[0].lo > 0.0) | (ends[1].hi < 1.0) | (ends[2].lo > 0.0) | (ends[3].hi < 1.0)
        found = Interval(values.copy(), values.copy())
        if part.any():
            found.put(part, restricted(values[part], [one[part] for one in ends]))
        return found

    def _ends(self, pieces: Wholes, sides: list[Any], times: list[int]) -> list[Interval]:
        """Return sides, in so many times finer units, in cells from the corner of the cell of pieces."""
        grid, found = self.grid, []
        for n, side in enumerate(sides):
            size = grid.parts * times[n // 2]
            corner = (grid.columns, grid.rows)[n // 2][grid.cell[pieces]] * size - size // 2
            found.append((Interval((side - corner).astype(np.float64)) / float(size)).within(0.0, 1.0))
        return found

    def on(self, pieces: Wholes, sides: list[Any], times: list[int]) -> Interval:
        """Return the Bernstein values of the surface on boxes in pieces, whose sides are in finer units."""
        return (
            restricted(bezier(self.controls[pieces]).astype(np.float64), self._ends(pieces, sides, times)) * self.unit
        )

    def least(self) -> Floats:
        """Bound the surface from below by its Bernstein values on each piece, shape (m, 3, 3)."""
        found: Floats = down(bezier(self.controls) * self.unit)
        return found

    def at(self, point: Point) -> float:
        """Bound the surface from below at a point, in whose block there is no bound; infinite if no piece holds it."""
        grid, found = self.grid, math.inf
        for piece in grid.pieces_at(point):
            demand(not self.in_block[piece] or self.end_block is not None, "a block holds an end")
            if self.in_block[piece]:
                return -math.inf
            cell = grid.cell[piece]
            x, y = (
                grid.unit_of(axis, Fraction(point[axis])) / grid.parts + Fraction(1, 2) - int(index[cell])
                for axis, index in enumerate((grid.columns, grid.rows))
            )
            value = sum(
                (
                    _bernstein(b, y) * _bernstein(a, x) * int(value)
                    for b, line in enumerate(bezier(self.controls[[piece]])[0])
                    for a, value in enumerate(line)
                ),
                Fraction(0),
            )
            found = min(found, float(down(float(value * Fraction(self.unit)))))
        return found

    def _charge(self) -> float:
        """Bound what is lost on pieces that are too steep, and in blocks."""
        steepest, lost = float(self.steepness.max(initial=0.0)), 0.0
        if steepest > 1.0:
            values = bezier(self.controls[self.steepness > 1.0])
            spans = (values.max(axis=(1, 2)) - values.min(axis=(1, 2))) * self.unit
            lost = up(up(math.fsum(up(spans).tolist())) * (1.0 - Interval(1.0) / steepest).hi)
        for block in self.blocks:
            lost = up(lost + block.charge())
        return float(lost)


def _bernstein(n: int, t: Fraction) -> Fraction:
    return ((1 - t) ** 2, 2 * t * (1 - t), t**2)[n]


class Block:
    """
    A rectangle of cells in which a surface may be too steep.

    Another surface, on a finer grid over a box around it, bounds the cost of ways through it, or to the end in it. A
    block around an end may have none: then the cost is at least the least cost nearby times the distance.
    """

    def __init__(self, described: dict[str, Any], array: Reader, outer: Surface) -> None:
        self.outer, grid = outer, outer.grid
        west, east, south, north = (whole_of(one) for one in described["cells"])
        demand(west < east and south < north, "a block is empty")
        demand((east - west + 2) * (north - south + 2) < MOST_CELLS, "a block is too large")
        columns, rows, half = grid.columns[grid.cell], grid.rows[grid.cell], grid.parts // 2
        (self.pieces,) = np.nonzero((columns >= west) & (columns < east) & (rows >= south) & (rows < north))
        self.sides = [one * grid.parts - half for one in (west, east, south, north)]
        self.inner: Surface | None = None
        if "inside" in described:
            inner = Grid(described["inside"]["grid"], array, outer.problem)
            demand(inner.span == grid.span, "a surface inside a block has another span")
            self.inner = Surface(
                described["inside"]["surface"], array, inner, outer.problem, outer.end, outer.level + 1
            )
            self._check_box(inner, [whole_of(one) for one in described["inside"]["box"]])

    def _check_box(self, grid: Grid, box: list[int]) -> None:
        """Check that the inner grid has all cells of its box, and that the box is larger than the block."""
        demand(len(box) == 4 and box[0] < box[1] and box[2] < box[3], "a box is empty")
        demand((box[1] - box[0]) * (box[3] - box[2]) < MOST_CELLS, "a box is too large")
        lacking = grid.lacks(self.outer.problem, *all_cells(*box))
        demand(not lacking.any(), "a box lacks a cell")
        self.cells, self.box = box, [one * grid.parts - grid.parts // 2 for one in box]
        #: Whether paths may cross each side of the box, and the margin beside it, in units of the inner grid.
        self.opens = [
            self.box[n] > grid.inside[n // 2][0] if n % 2 == 0 else self.box[n] < grid.inside[n // 2][1]
            for n in range(4)
        ]
        times = [Fraction(grid.divide[axis], self.outer.grid.divide[axis]) for axis in range(2)]
        self.margins = [(self.sides[n] * times[n // 2] - self.box[n]) * (1 if n % 2 == 0 else -1) for n in range(4)]
        demand(
            all(one > 0 or not way for one, way in zip(self.margins, self.opens, strict=True)), "a block leaves its box"
        )

    def charge(self) -> float:
        """Bound by how much more the surface falls between places on the rim than a way between them costs."""
        inner = self.inner
        if inner is None or inner.end_block is not None:
            msg = "a block has no surface inside, or one to an end"
            raise Refused(msg)
        one, other = self._on_rim(inner)
        if not len(one.lo):
            return 0.0
        more = one - other
        inside = up(up(more.hi.max() - more.lo.min()) + inner.loss)
        # a way that leaves the box pays for the margin twice
        open_sides = [(n, margin) for n, (margin, way) in enumerate(zip(self.margins, self.opens, strict=True)) if way]
        margin = min(
            (inner.grid.step(n // 2).lo * down(float(down(float(one)))) for n, one in open_sides), default=math.inf
        )
        outside = up(up(one.hi.max() - one.lo.min()) - down(down(2.0 * margin) * max(inner.least_cost, 0.0)))
        return float(max(inside, outside, 0.0))

    def excess(self) -> float:
        """Bound by how much the surface is above the cost to its end, anywhere on the rim of the block around it."""
        grid, end, inner = self.outer.grid, self.outer.end, self.inner
        for axis in range(2):
            low, high = self.sides[2 * axis : 2 * axis + 2]
            demand(low <= grid.unit_of(axis, Fraction(end[axis])) <= high, "the end is not in the block around it")
        if inner is None:
            return self._above_cone()
        demand(
            inner.end_block is not None and not len(inner.grid.cut), "a surface around an end has no end, or has walls"
        )
        one, other = self._on_rim(inner)
        demand(len(one.lo) > 0, "no cell is beside the block around an end")
        # ways that leave the box enter it for the last time on its border
        columns, rows = inner.grid.columns[inner.grid.cell], inner.grid.rows[inner.grid.cell]
        west, east, south, north = self.cells
        sides = columns == west, columns == east - 1, rows == south, rows == north - 1
        border = np.any([side & way for side, way in zip(sides, self.opens, strict=True)], axis=0)
        demand(not inner.in_block[border].any(), "a block inside a block is on the border of its box")
        cap = inner.least()[border].min(initial=math.inf)
        return float(up(max((one - other).hi.max(), up(one.hi.max() - cap)) + inner.excess))

    def _above_cone(self) -> float:
        """Bound by how much the surface is above the least cost nearby times the distance to the end, on the rim."""
        grid, end, problem = self.outer.grid, self.outer.end, self.outer.problem
        away = [
            np.abs([one.lo, one.hi]).max()
            for one in (grid.place(n // 2, self.sides[n]) - end[n // 2] for n in range(4))
        ]
        radius = Fraction(float(up(up(math.hypot(max(away[:2]), max(away[2:]))))))
        lines = []
        for axis in range(2):
            low, high = (grid.unit_of(axis, Fraction(end[axis]) + sign * radius) for sign in (-1, 1))
            first, last = max(math.floor(low), grid.inside[axis][0]), min(math.ceil(high), grid.inside[axis][1])
            lines.append(np.unique(np.linspace(first, last, 17).astype(np.int64)))
        i, j = all_cells(0, len(lines[0]) - 1, 0, len(lines[1]) - 1)
        boxes = Boxes(grid, [lines[0][i], lines[0][i + 1], lines[1][j], lines[1][j + 1]])
        linear = problem.lower_costs(boxes).min(axis=(1, 2))
        least = float(np.maximum(problem.constant_costs(boxes), linear).min())
        demand(least > 0.0, "the cost around an end is not above 0")
        pieces, sides = rim(grid, self.sides, [1, 1])
        phi = self.outer.on(pieces, sides, [1, 1])
        # the distance is at least its part along any direction: here, that to the middle of a part of the rim
        x, y = (
            [
                grid.place(axis, one) - end[axis]
                for one in (sides[2 * axis], 0.5 * (sides[2 * axis] + sides[2 * axis + 1]), sides[2 * axis + 1])
            ]
            for axis in range(2)
        )
        length = np.maximum(np.hypot(x[1].lo, y[1].lo), 1e-300) * (1.0 + 2.0**-49)
        away_x, away_y = ([one * Interval(to[1].lo / length) for one in to] for to in (x, y))
        most = -math.inf
        for b in range(3):
            for a in range(3):
                distance = (away_x[a] + away_y[b]).lo
                most = max(most, float((phi[:, b, a] - Interval(distance) * least).hi.max(initial=-math.inf)))
        return most

    def _on_rim(self, inner: Surface) -> tuple[Interval, Interval]:
        """Return the Bernstein values of the outer and of the inner surface on all parts of the rim that both have."""
        grids = self.outer.grid, inner.grid
        common = [math.lcm(grids[0].divide[axis], grids[1].divide[axis]) for axis in range(2)]
        times = [[common[axis] // grid.divide[axis] for axis in range(2)] for grid in grids]
        sides = [self.sides[n] * times[0][n // 2] for n in range(4)]
        demand(max(map(abs, sides)) + (max(times[0]) + max(times[1])) * (1 << 12) < 1 << 60, "a grid is too fine")
        (one, a), (other, b) = (rim(grid, sides, some) for grid, some in zip(grids, times, strict=True))
        low, high = (
            [which(a[n][:, None], b[n][None, :]) for n in (first, first + 2)]
            for first, which in ((0, np.maximum), (1, np.minimum))
        )
        p, q = np.nonzero((low[0] <= high[0]) & (low[1] <= high[1]))
        # (in blocks of its own, the inner surface may be anything)
        demand(not inner.in_block[other[q]].any(), "a block inside a block is across its rim")
        both = [side[p, q] for side in (low[0], high[0], low[1], high[1])]
        return self.outer.on(one[p], both, times[0]), inner.on(other[q], both, times[1])


def all_cells(west: int, east: int, south: int, north: int) -> tuple[Wholes, Wholes]:
    """Return columns and rows of all cells of a rectangle."""
    columns, rows = np.meshgrid(np.arange(west, east), np.arange(south, north))
    return columns.ravel(), rows.ravel()


def rim(grid: Grid, sides: list[int], times: list[int]) -> tuple[Wholes, list[Wholes]]:
    """
    Return the pieces of a grid that touch a rectangle from outside, and the boxes without area where they do.

    Sides of the rectangle and of the boxes are in units that are so many times as fine as those of the grid.
    """
    half, cells = grid.parts // 2, []
    for n, side in enumerate(sides):
        index = Fraction(side, times[n // 2]) + half
        demand(index % grid.parts == 0, "a block is not in line with the grid inside")
        cells.append(int(index // grid.parts))
    west, east, south, north = cells
    columns, rows = all_cells(west - 1, east + 1, south - 1, north + 1)
    numbers = grid.number(columns, rows)
    around = (numbers >= 0) & ((columns < west) | (columns >= east) | (rows < south) | (rows >= north))
    found: list[list[Wholes]] = []
    for cell in numbers[around].tolist():
        corner = int(grid.columns[cell]) * grid.parts - half, int(grid.rows[cell]) * grid.parts - half
        place = grid.place_of_cut[cell]
        if place < 0:
            piece, v, u, size = np.array([grid.first_piece[cell]]), np.zeros(1, int), np.zeros(1, int), grid.parts
        else:
            v, u = np.nonzero(grid.labels[place])
            piece, size = grid.first_piece[cell] + grid.labels[place, v, u] - 1, 1
        ends = [corner[0] + u, corner[0] + u + size, corner[1] + v, corner[1] + v + size]
        # (what is beyond the map is of no path)
        ends = [np.clip(end, *grid.inside[n // 2]) * times[n // 2] for n, end in enumerate(ends)]
        low, high = ([(np.maximum, np.minimum)[way](ends[n], sides[n]) for n in (way, way + 2)] for way in range(2))
        seen = (low[0] <= high[0]) & (low[1] <= high[1])
        for name in np.unique(piece[seen]):
            own = seen & (piece == name)
            found.append([name, low[0][own].min(), high[0][own].max(), low[1][own].min(), high[1][own].max()])
    table = np.array(found, dtype=np.int64).reshape(-1, 5)
    return table[:, 0], [table[:, n] for n in range(1, 5)]


# --- Cells of constant cost -------------------------------------------------------------------------------------------


class Cells:
    """
    Rectangles between lines, the least cost of a unit of length in each, and the least one along each side.

    A line is a strip ``[a, b]``, most often of no width. The map is drawn together across all strips; sizes of cells
    are rounded down, so that no path gets longer by that. From here on, they are exact.
    """

    def __init__(self, described: dict[str, Any], array: Reader, problem: Problem) -> None:
        demand(
            not problem.threats and not problem.on_earth and not any(one.is_bilinear for one in problem.rasters),
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
        demand(self.shape[0] * self.shape[1] < MOST_CELLS // 8, "there are too many cells")
        self.sizes = [down(line[1:, 0] - line[:-1, 1]) for line in self.lines]
        demand(min(float(size.min()) for size in self.sizes) > 0.0, "a cell has no size")
        self.costs = self._costs(0, 0)
        demand((self.costs < 1e100).all(), "a cost is too great")
        #: Along horizontal lines, shape (rows + 1, columns), and vertical ones, shape (rows, columns + 1).
        self.along = self._costs(0, 1), self._costs(1, 0)
        self.closed = self._closed()
        self.ends = [[self._place(axis, end[axis]) for axis in range(2)] for end in (problem.start, problem.goal)]

    def _costs(self, *is_line: int) -> Floats:
        """Bound the cost from below between lines along x and y, or on them."""
        risk = Interval(np.zeros([self.shape[1 - axis] + is_line[axis] for axis in (1, 0)]))
        for raster in self.problem.rasters:
            columns, rows = (self._touched(raster, axis, is_line[axis]) for axis in range(2))
            values = np.pad(raster.values, 1)
            across = np.stack([values[:, some].min(axis=1) for some in columns], axis=1)
            risk = risk + np.stack([across[some].min(axis=0) for some in rows])
        return (risk * self.problem.k + 1.0).lo

    def _touched(self, raster: "Raster", axis: int, is_line: int) -> list[slice]:
        """List the columns or rows of a raster, counted from 1, that have a place between lines, or touch a line."""
        places, line = raster.places[axis], self.lines[axis]
        if not is_line:
            return [
                slice(bisect_right(places, low), bisect_left(places, high) + 1)
                for low, high in zip(line[:-1, 1].tolist(), line[1:, 0].tolist(), strict=True)
            ]
        found = []
        for low, high in np.clip(line, self.problem.bounds[axis], self.problem.bounds[axis + 2]).tolist():
            # (the outer edges belong to the raster)
            first, last = bisect_left(places, low), bisect_right(places, high)
            found.append(slice(first + (low == places[0]), last + 1 - (high == places[-1])))
        return found

    def _closed(self) -> Truths:
        """Tell which cells, with the lines around them, no edge of an area meets, and an odd number is before them."""
        (west, east), (south, north) = ((line[:-1, 0], line[1:, 1]) for line in self.lines)
        ax, ay, bx, by = self.problem.edges.T
        edge, row = ranges(
            np.searchsorted(north, np.minimum(ay, by)).astype(np.float64),
            np.searchsorted(south, np.maximum(ay, by), side="right") - 1.0,
        )
        at = row.astype(np.int64)
        ax, ay, bx, by = self.problem.edges[edge].T
        rise, level = np.where(by == ay, 1.0, by - ay), by == ay
        # (parts of an edge are off by less than 2^-50)
        ends = [
            ax + np.where(level, end, np.clip((y - ay) / rise, 0.0, 1.0)) * (bx - ax)
            for y, end in ((south[at], 0.0), (north[at], 1.0))
        ]
        off = 2.0**-48 * (np.abs(ax) + np.abs(bx))
        first = np.searchsorted(east, np.minimum(*ends) - off)
        last = np.searchsorted(west, np.maximum(*ends) + off, side="right")
        met, before = (np.zeros((self.shape[0], self.shape[1] + 1), dtype=np.int64) for _ in range(2))
        np.add.at(met, (at, first), 1)
        np.add.at(met, (at, last), -1)
        middle = 0.5 * (south[at] + north[at])
        np.add.at(before, (at, last), (ay > middle) != (by > middle))
        found: Truths = (met.cumsum(axis=1)[:, :-1] == 0) & (before.cumsum(axis=1)[:, :-1] % 2 == 1)
        return found

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
            demand(self.count < MOST_CELLS, "there are too many points")
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
        (i, x), (j, y) = self.net.cells.ends[end]
        if x >= 0.0 and y >= 0.0:
            demand(self.net.is_open[j, i], "an end is in a cell that is missing")
            return Interval(self.whole[end] * self.unit)
        if x < 0.0 and y < 0.0:
            first = last = self.net.corner[j, i]
            number, axis, inner = -1, 0, 0
        else:
            axis = 0 if x >= 0.0 else 1
            number, inner = int(self.net.side[axis][j, i]), len(self.net.parts) - 2
            first, last = self.net.corner[j, i], self.net.corner[j + axis, i + 1 - axis]
        demand(first >= 0 and last >= 0 and (number >= 0 or x == y), "an end is on a line that is missing")
        if first == last:
            return Interval(self.whole[first] * self.unit)
        values = self.whole[[first, *range(number, number + inner), last]] * self.unit
        places = self.net.parts * self.net.cells.sizes[axis][(i, j)[axis]]
        offset, steps, rises = max(x, y), np.diff(places), np.diff(values)
        n = min(int(np.searchsorted(places, offset, side="right")) - 1, len(steps) - 1)
        # (the place is off by less than 2^-50 of the side)
        off = 2.0**-46 * (float(np.abs(values).max()) + float(np.abs(rises / steps).max()) * float(places[-1]))
        value = float(values[n] + rises[n] * ((offset - places[n]) / steps[n]))
        return Interval(value - off, value + off)

    def _check(self, part: slice) -> None:
        """
        Check that ``W(p) - W(q) <= c |p - q|`` for all p and q on the border of some cells.

        Values and places are relative to the lower left corner; all of them are exact but for those of ends.
        """
        net, cells = self.net, self.net.cells
        j, i, numbers = net.rows[part], net.columns[part], net.points(part)
        width, height, zero = cells.sizes[0][i], cells.sizes[1][j], np.zeros(len(i))
        costs = cells.costs[j, i]
        up, right = net.along
        along = np.stack([up[j, i], up[j + 1, i], right[j, i], right[j, i + 1]])
        values: Floats = (self.whole[numbers] - self.whole[numbers[:, :1, :1]]).astype(np.float64) * self.unit
        self.is_flat &= not values.any()
        places = np.stack([net.parts * size[:, None] for size in (width, width, height, height)], axis=1)
        steps, rises = down(np.diff(places)), np.diff(values)
        steep = ~(np.abs(rises) <= down(np.minimum(costs[:, None], along.T)[..., None] * steps)).all(axis=(1, 2))
        # at a corner: p at s on one side and q at t on the other, s and t from there
        for one, other, a, b in ((0, 2, 0, 0), (0, 3, -1, 0), (1, 2, 0, -1), (1, 3, -1, -1)):
            rise = rises[:, one, a] * (1.0 + 2.0 * a), rises[:, other, b] * (1.0 + 2.0 * b)
            slope = [
                Interval(n) / Interval(steps[:, side, end])
                for n, side, end in zip(rise, (one, other), (a, b), strict=True)
            ]
            for p, q in ((slope[0], -slope[1]), (-slope[0], slope[1])):
                total = p.within(0.0, np.inf).square() + q.within(0.0, np.inf).square()
                steep |= ~(total.hi <= down(costs * costs))
        far = np.stack([zero, height, zero, width], axis=1)
        border = _Border(values, places, far, costs, width + height)
        n = np.arange(len(i))
        sides = [(side, n, len(net.parts) - 1) for side in range(4)]
        for end, ((column, x), (row, y)) in enumerate(cells.ends):
            (inside,) = np.nonzero((i == column) & (j == row) & (x >= 0.0) & (y >= 0.0))
            value = (self.whole[end] - self.whole[numbers[inside, 0, 0]]) * self.unit
            self.is_flat &= not value.any()
            border.put(4 + end, inside, x, y, value)
            sides.append((4 + end, inside, 0))
        pairs = []
        for (one, held, last), (other, also, other_last) in permutations(sides, 2):
            if other == 4 + self.begin or one == 5 - self.begin:
                continue
            both = held if len(held) < len(also) else also
            pairs.append(
                np.column_stack(np.broadcast_arrays(both, one, 0, last, other, 0, other_last))
                if np.isin(both, held).all() and np.isin(both, also).all()
                else np.empty((0, 7), dtype=np.int64)
            )
        steep[border.steep(np.concatenate(pairs))] = True
        demand(
            not steep.any(),
            lambda: f"cell ({i[steep.argmax()]}, {j[steep.argmax()]}): values fall faster than the cost",
        )


class _Border:
    """Values and places on the sides of cells, and at the start and the goal inside of one, as sides 4 and 5."""

    def __init__(self, values: Floats, places: Floats, far: Floats, costs: Floats, reach: Any) -> None:
        n, _, self.size = values.shape
        self.values, self.places, self.far = (np.zeros((n, 6, *shape)) for shape in ([self.size], [self.size], []))
        self.values[:, :4], self.places[:, :4], self.far[:, :4] = values, places, far
        self.costs, self.reach, self.most = costs, reach, np.abs(values).max(axis=(1, 2))

    def put(self, side: int, cells: Wholes, along: float, far: float, values: Floats) -> None:
        """Put an end into cells."""
        self.values[cells, side, 0], self.places[cells, side, 0], self.far[cells, side] = values, along, far
        self.most[cells] = np.maximum(self.most[cells], np.abs(values))

    def steep(self, pairs: Wholes) -> Wholes:
        """
        Return the cells in which values may fall faster than the cost from one run of points to another one.

        Pairs are rows: cell, side, first and last point, and the same for the other run. Pairs of which that is not
        clear are halved, down to intervals, of which those that meet in a corner have been looked at.
        """
        found = [np.empty(0, dtype=np.int64)]
        while len(pairs):
            longest = int((pairs[:, [3, 6]] - pairs[:, [2, 5]]).max()) + 1
            pairs = np.concatenate([pairs[part][self._unclear(pairs[part])] for part in batches(len(pairs), longest)])
            last = (pairs[:, [3, 6]] - pairs[:, [2, 5]] <= 1).all(axis=1)
            found.append(pairs[last, 0])
            pairs = pairs[~last]
            for first in (2, 5):
                long = pairs[:, first + 1] - pairs[:, first] > 1
                upper, middle = pairs[long], (pairs[long, first] + pairs[long, first + 1]) // 2
                pairs[long, first + 1] = upper[:, first] = middle
                pairs = np.concatenate([pairs, upper])
        return np.concatenate(found)

    def _unclear(self, pairs: Wholes) -> Truths:
        """
        Tell of which pairs of runs it is not clear that ``W(p) - W(q) <= c |p - q|`` for all p in one, q in the other.

        It is if some vector g of length c has ``W(p) - g . p <= W(q) - g . q`` for all points p and q of them.
        """
        cell, costs = pairs[:, 0], self.costs[pairs[:, 0]]
        runs = [_Run(self, cell, *pairs[:, first : first + 3].T) for first in (1, 4)]
        (x, y, value), (to_x, to_y, other) = (run.ends() for run in runs)
        dx, dy = x[:, None] - to_x, y[:, None] - to_y
        far, mean_x, mean_y = np.hypot(dx, dy), dx.mean(axis=(0, 1)), dy.mean(axis=(0, 1))
        # (any direction would do: this one is in the middle of those that serve the ends)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(far > 0.0, np.clip((value[:, None] - other) / (costs * far), -1.0, 1.0), -1.0)
        turn, reach = np.arctan2(mean_x * dy - mean_y * dx, mean_x * dx + mean_y * dy), np.arccos(ratio)
        turn = np.arctan2(mean_y, mean_x) + 0.5 * ((turn - reach).max(axis=(0, 1)) + (turn + reach).min(axis=(0, 1)))
        length = costs * (1.0 - 2.0**-45)
        g = length * np.cos(turn), length * np.sin(turn)
        is_short = up(up(g[0] * g[0]) + up(g[1] * g[1])) <= down(costs * costs)
        # (sums are off by less than 2^-49 of their parts, and places of ends by less than 2^-50 of a side)
        margin = 2.0**-46 * (self.most[cell] + costs * self.reach[cell])
        clear = is_short & (runs[0].beyond(g).max(axis=0) + margin <= runs[1].beyond(g).min(axis=0))
        meet = (far == 0.0).any(axis=(0, 1)) & (pairs[:, [1, 4]] < 4).all(axis=1)
        meet &= (pairs[:, [3, 6]] - pairs[:, [2, 5]] == 1).all(axis=1)
        found: Truths = ~(clear | meet)
        return found


class _Run:
    """Points on sides of cells, from first to last ones."""

    def __init__(self, border: _Border, cells: Wholes, sides: Wholes, first: Wholes, last: Wholes) -> None:
        self.is_upright, self.far = (sides >= 2) & (sides < 4), border.far[cells, sides]
        inner = np.minimum(first + np.arange(int((last - first).max(initial=0)) + 1)[:, None], last)
        at = (cells * 6 + sides) * border.size + inner
        self.values, self.places = border.values.ravel()[at], border.places.ravel()[at]

    def ends(self) -> tuple[Floats, Floats, Floats]:
        """Return coordinates and values of the first and last points, shape (2, n) each."""
        along, far = self.places[[0, -1]], self.far
        return np.where(self.is_upright, far, along), np.where(self.is_upright, along, far), self.values[[0, -1]]

    def beyond(self, g: tuple[Floats, Floats]) -> Any:
        """Return the values less the products of the places with a vector."""
        along, across = np.where(self.is_upright, g[1], g[0]), np.where(self.is_upright, g[0], g[1])
        return self.values - (along * self.places + across * self.far)


def bound_over_cells(described: dict[str, Any], array: Reader, problem: Problem, claimed: float) -> float:
    """Return the bound of the cost of all paths that cost less than what is claimed; infinite if there are none."""
    cells, bound = Cells(described, array, problem), 0.0
    needed = ~cells.closed
    demand(0 < len(described["levels"]) < 1 << 6, "there are no points on cells, or too many levels")
    for one in described["levels"]:
        net = Net(one["points"], array, cells, needed)
        ends = {"to_goal": (0, 1), "to_start": (1, 0)}
        found = [
            (Heights(one[name], array, net, begin), begin, end) for name, (begin, end) in ends.items() if name in one
        ]
        demand(found, "points on cells have no values")
        total = Interval(np.zeros(net.count))
        for heights, begin, end in found:
            height = float((heights.at(begin) - heights.at(end)).lo)
            if heights.is_flat and height > 0.0:
                return math.inf
            bound = max(bound, height)
            total = total + heights.whole * heights.unit - heights.at(end)
        is_left_out = net.least(total.lo) >= claimed if len(found) == len(ends) else ~net.is_open
        for (i, x), (j, y) in cells.ends:
            if x >= 0.0 and y >= 0.0:
                is_left_out[j, i] = False
        needed = net.is_open & ~is_left_out
    return bound


# --- The bounds -------------------------------------------------------------------------------------------------------


def lower_bound(described: list[dict[str, Any]], array: Reader, problem: Problem, claimed: float) -> float:
    """Return the bound of the cost of all paths that cost less than what is claimed; infinite if there are none."""
    demand(described, "there is no grid")
    ends = {"to_goal": (problem.goal, problem.start), "to_start": (problem.start, problem.goal)}
    bound, before, kept = -math.inf, None, np.empty(0, dtype=np.bool_)
    for n, one in enumerate(described):
        grid = Grid(one["grid"], array, problem)
        _check_covered(grid, problem, before, kept)
        if _is_apart(grid, problem):
            return math.inf
        surfaces = [Surface(one[name], array, grid, problem, end) for name, (end, _) in ends.items() if name in one]
        demand(surfaces, "a grid has no surface")
        for surface in surfaces:
            other = problem.start if surface.end == problem.goal else problem.goal
            bound = max(bound, float(down(surface.at(other) - surface.excess)))
        if n + 1 < len(described):
            demand(len(surfaces) == 2, "a grid that drops cells has one surface")
            to_goal, to_start = surfaces
            total = down(to_goal.least() + to_start.least()).min(axis=(1, 2))
            stays = ~(down(down(total - to_goal.excess) - to_start.excess) >= claimed)
            kept = np.zeros(len(grid.rows), dtype=np.bool_)
            kept[grid.cell[stays | to_goal.in_block | to_start.in_block]] = True
        before = grid
    return bound


def _check_covered(grid: Grid, problem: Problem, before: Grid | None, kept: Truths) -> None:
    """Check that a grid has all cells that a path may pass: all on the map, or all that the grid before has kept."""
    if before is None:
        low, high = (
            [math.floor(Fraction(side[end], grid.parts) + Fraction(1, 2)) for side in grid.inside] for end in range(2)
        )
        demand((high[0] - low[0] + 1) * (high[1] - low[1] + 1) < MOST_CELLS, "the map has too many cells")
        columns, rows = all_cells(low[0], high[0] + 1, low[1], high[1] + 1)
        parts = columns, rows
    else:
        demand(grid.span == before.span, "a grid has another span than the one before")
        first, last = [], []
        for axis, index in enumerate((before.columns[kept], before.rows[kept])):
            # sides of the coarser cells, in halves of units of both
            size, side = 2 * grid.parts * before.divide[axis], before.parts * grid.divide[axis]
            demand((size + side) * int(np.abs(index).max(initial=1) + 1) < 1 << 60, "a grid is too fine")
            first.append(((2 * index - 1) * side + size // 2) // size)
            last.append(-((-(2 * index + 1) * side - size // 2) // size) - 1)
        some = list(offsets(first[0], last[0], first[1], last[1]))
        parts = np.concatenate([i for i, _ in some]), np.concatenate([j for _, j in some])
    columns, rows = np.unique(np.column_stack(parts), axis=0).T
    lacking = grid.lacks(problem, columns, rows)
    demand(not lacking.any(), lambda: f"cell ({columns[lacking.argmax()]}, {rows[lacking.argmax()]}) is missing")


def _is_apart(grid: Grid, problem: Problem) -> bool:
    """Tell whether no pieces that touch lead from start to goal."""
    if not len(grid.cut):
        return False
    pairs = [(one, other) for one, other, _, _ in grid.touching()]
    one, other = (np.concatenate([pair[n] for pair in pairs]) for n in range(2))
    group, least = np.arange(len(grid.cell)), np.arange(len(grid.cell))
    while True:
        np.minimum.at(least, one, group[other])
        np.minimum.at(least, other, group[one])
        least = least[least]
        if (least == group).all():
            break
        group = least.copy()
    start, goal = (set(group[grid.pieces_at(end)].tolist()) for end in (problem.start, problem.goal))
    return not start & goal


def check_free(problem: Problem, path: Floats) -> None:
    """
    Check that a path is nowhere inside of areas; it may touch them.

    Between places where a segment meets edges, it is inside or outside as a whole. All of this is exact.
    """
    edges, ends = problem.edges, [(Fraction(x), Fraction(y)) for x, y in path.tolist()]
    demand(not _is_inside(edges, ends[0]), "the path begins inside an area")
    for n, (begin, end) in enumerate(pairwise(ends)):
        low, high = np.minimum(path[n], path[n + 1]), np.maximum(path[n], path[n + 1])
        apart = (np.minimum(edges[:, :2], edges[:, 2:]) > high) | (np.maximum(edges[:, :2], edges[:, 2:]) < low)
        dx, dy = end[0] - begin[0], end[1] - begin[1]
        if not dx and not dy:
            continue
        cuts = {Fraction(0), Fraction(1)}
        near = edges[~apart.any(axis=1)]
        for edge in near.tolist():
            ax, ay, bx, by = map(Fraction, edge)
            across = dx * (by - ay) - dy * (bx - ax)
            if across:
                cuts.add(((ax - begin[0]) * (by - ay) - (ay - begin[1]) * (bx - ax)) / across)
            else:
                cuts |= {
                    ((x - begin[0]) * dx + (y - begin[1]) * dy) / (dx * dx + dy * dy) for x, y in ((ax, ay), (bx, by))
                }
        order = sorted(t for t in cuts if 0 <= t <= 1)
        # (without any edge near, a segment is where its begin is)
        for first, last in pairwise(order) if len(near) else ():
            t = (first + last) / 2
            inside = _is_inside(edges, (begin[0] + t * dx, begin[1] + t * dy))
            demand(not inside, f"the path crosses an area after waypoint {n}")


def _is_inside(edges: Floats, point: tuple[Fraction, Fraction]) -> bool:
    """Tell whether a point is inside of areas, and not on an edge."""
    x, y = point
    near = float(y)
    margin = 2.0**-40 * max(1.0, abs(near))
    beside = (np.minimum(edges[:, 1], edges[:, 3]) <= near + margin) & (
        np.maximum(edges[:, 1], edges[:, 3]) >= near - margin
    )
    inside = False
    for edge in edges[beside].tolist():
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

    A part of length l costs at most ``l (1 + k F(middle)) + k l^3 / 24 max F''``, with ``|F''| <= sum p q + (sum p / (s
    sqrt(e)))^2`` for threats. For rasters, see `_risk_of_raster`.
    """
    demand(path.shape[1] == 2 and len(path) > 0, "a path is not a list of points")
    demand(tuple(path[0]) == problem.start and tuple(path[-1]) == problem.goal, "the path does not join start and goal")
    for axis in range(2):
        low, high = problem.bounds[axis], problem.bounds[axis + 2]
        demand(((path[:, axis] >= low) & (path[:, axis] <= high)).all(), "the path leaves the map")
    check_free(problem, path)
    sides = [Interval(path[1:, axis]) - path[:-1, axis] for axis in range(2)]
    length = (sides[0].square() + sides[1].square()).root().hi
    total = float(up(math.fsum(length.tolist())))
    if problem.k == 0.0:
        return total
    bend = sum(peak / spread**2 for _, _, spread, peak in problem.threats)
    bend = (bend + sum(0.607 * peak / spread for _, _, spread, peak in problem.threats) ** 2) * (1.0 + 1e-9)
    # so fine that the last term is a millionth of the length
    finest = max(math.sqrt(24e-6 / max(problem.k * bend, 1e-300)), total / MOST_PARTS)
    counts = np.maximum(np.ceil(length / finest), 1.0).astype(np.int64)
    which = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    cost = total
    for part in batches(len(which)):
        segment, n = which[part], counts[which[part]].astype(np.float64)
        t = (Interval(number[part].astype(np.float64)) + 0.5) / n
        x, y = (t * sides[axis][segment] + path[segment, axis] for axis in range(2))
        step = Interval(length[segment]) / n
        clear = Interval(np.ones(len(segment)))
        for at_x, at_y, spread, peak in problem.threats:
            square = (x - at_x).square() + (y - at_y).square()
            clear = clear * (1.0 - exp(square / Interval(spread).square() * -0.5) * peak)
        risk = (1.0 - clear).within(0.0, 1.0) + step.square() * bend / 24.0
        cost = float(up(cost + math.fsum((risk * step * problem.k).hi.tolist())))
    for raster in problem.rasters:
        cost = float(up(cost + _risk_of_raster(raster, path, length) * problem.k * (1.0 + 4.0 * ULP)))
    return cost


def _risk_of_raster(raster: Raster, path: Floats, length: Floats) -> float:
    """Bound the integral of a raster along a path from above, patch by patch: on each it is a quadratic function."""
    total, near = 0.0, [np.array([float(one) for one in places]) for places in raster.places]
    for x, y, to_x, to_y, far in zip(*path[:-1].T.tolist(), *path[1:].T.tolist(), length.tolist(), strict=True):
        begin, side = (Fraction(x), Fraction(y)), (Fraction(to_x) - Fraction(x), Fraction(to_y) - Fraction(y))
        cuts = {Fraction(0), Fraction(1)}
        for axis in range(2):
            if side[axis]:
                low, high = sorted(path_end[axis] for path_end in ((x, y), (to_x, to_y)))
                first, last = np.searchsorted(near[axis], [low, high])
                knots = raster.places[axis][max(int(first) - 1, 0) : int(last) + 1]
                cuts |= {t for t in ((one - begin[axis]) / side[axis] for one in knots) if 0 < t < 1}
        order = sorted(cuts)
        for first, last in pairwise(order) if far > 0.0 else ():
            middle = (first + last) / 2
            where = _patch_at(raster, [begin[axis] + middle * side[axis] for axis in range(2)])
            values = [
                raster.exact([begin[axis] + t * side[axis] for axis in range(2)], where) for t in (first, middle, last)
            ]
            mean = (values[0] + 4 * values[1] + values[2]) / 6
            total = float(up(total + up(up(float(mean * (last - first))) * far)))
    return total


def _patch_at(raster: Raster, point: list[Fraction]) -> list[list[int]]:
    """List the columns and rows of the patches that hold a point, none outside of the raster."""
    found = []
    for axis in range(2):
        places, last = raster.places[axis], raster.shape[axis] - 1
        if not places[0] <= point[axis] <= places[-1]:
            return [[], []]
        found.append(
            sorted(
                {
                    min(max(one - 1, 0), last)
                    for one in (bisect_left(places, point[axis]), bisect_right(places, point[axis]))
                }
            )
        )
    return found


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


def check(file: Any) -> Result:
    """
    Check a proof file.

    Parameters
    ----------
    file
        Its name, or a stream of bytes.

    Raises
    ------
    Refused
        If it does not prove what it claims.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            demand(sum(one.file_size for one in archive.infolist()) < MOST_IN_ALL, "the file is too large")
            return proven(json.loads(_part_of(archive, "proof.json")), _reader(archive))
    except Refused:
        raise
    except Exception as error:  # any error that a file leads to is a fault of the file
        msg = f"the file is not a proof: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
        raise Refused(msg) from error


def _part_of(archive: zipfile.ZipFile, name: str) -> bytes:
    # (a name goes into messages)
    demand(name.isascii() and name.isprintable(), "a name of an array is not plain")
    demand(archive.getinfo(name).file_size < MOST_BYTES, f"{name} is too large")
    with archive.open(name) as stream:
        return stream.read(MOST_BYTES)


def _reader(archive: zipfile.ZipFile) -> Reader:
    def array(name: str, kind: str, axes: int) -> Any:
        found = np.lib.format.read_array(io.BytesIO(_part_of(archive, name)), allow_pickle=False)
        demand(8 * found.size <= MOST_BYTES, f"{name} is too large")
        demand(found.ndim == axes and found.dtype.kind in kind, f"{name} is of another kind")
        if kind == "i":
            return found.astype(np.int64)
        demand((np.abs(found) < 1e120).all(), f"{name} is not finite, or too great")
        return found.astype(np.float64)

    return array


def proven(described: dict[str, Any], array: Reader) -> Result:
    """Check what a file describes (errors as `check`)."""
    demand(
        described.get("format") == FORMAT and described.get("version") == VERSION, "the format or version is not known"
    )
    problem = Problem(described["problem"], array)
    lower = math.inf if described["lower"] is None else number_of(described["lower"])
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        if "cells" in described:
            bound = bound_over_cells(described["cells"], array, problem, lower)
        else:
            bound = lower_bound(described["grids"], array, problem, lower)
        demand(bound >= lower, f"the surfaces prove {bound!r}, which is less than {lower!r}")
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
    if len(arguments) != 1:
        sys.stdout.write(f"{__doc__}\n")
        return 2
    try:
        found = check(arguments[0])
    except Refused as error:
        sys.stdout.write(f"refused: {error}\n".encode("ascii", "backslashreplace").decode())
        return 1
    no_less = f"no path costs less than {found['lower']!r}" if math.isfinite(found["lower"]) else "there is no path"
    at_most = f"; this path costs at most {found['upper']!r}" if math.isfinite(found["upper"]) else ""
    sys.stdout.write(f"verified: {no_less}{at_most}\nproblem {found['problem']}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

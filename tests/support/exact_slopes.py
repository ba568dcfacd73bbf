"""
An exact judge of one inequality: whether a spline is steeper than the cost somewhere in a cell.

It knows the mathematics alone: fractions for all numbers, and Taylor's series with its remainder for exp. It looks at
points, so that it can only tell that a slope is too steep, never that none is.
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

#: Rounding of bounds of exp, and places along each side of a cell that are looked at.
BITS, PLACES = 160, 5


def exp_bounds(x: Fraction) -> tuple[Fraction, Fraction]:
    """
    Return numbers below and above exp(-x), for x of at least 0.

    With ``y = x / 2^m <= 1/2``, partial sums of the alternating series are below and above exp(-y), and squaring keeps
    the order.

    Examples
    --------
    >>> low, high = exp_bounds(Fraction(1))
    >>> float(low), 0 < high - low < Fraction(1, 2**140)
    (0.36787944117144233, True)
    """
    halvings = 0
    while x > Fraction(1, 2):
        x, halvings = x / 2, halvings + 1
    term, total, n = Fraction(1), Fraction(1), 0
    low, high = Fraction(0), Fraction(1)
    while high - low > Fraction(1, 1 << BITS):
        n += 1
        term *= -x / n
        total += term
        low, high = (total, high) if n % 2 else (low, total)
    for _ in range(halvings):
        low, high = _rounded(low * low, up=False), _rounded(high * high, up=True)
    return low, high


def _rounded(x: Fraction, *, up: bool) -> Fraction:
    whole = (x.numerator << 2 * BITS) // x.denominator
    return Fraction(whole + up, 1 << 2 * BITS)


def cost_above(problem: dict[str, Any], threats: Sequence[Sequence[float]], x: Fraction, y: Fraction) -> Fraction:
    """Return a number above the cost of a unit of length at a point, ``1 + k F``, for a map of threats."""
    clear = Fraction(1)
    for at_x, at_y, spread, peak in threats:
        square = (x - Fraction(at_x)) ** 2 + (y - Fraction(at_y)) ** 2
        clear *= 1 - Fraction(peak) * exp_bounds(square / (2 * Fraction(spread) ** 2))[1]
    return 1 + Fraction(problem["k"]) * (1 - clear)


def gradient(controls: Sequence[Sequence[int]], s: Fraction, t: Fraction) -> tuple[Fraction, Fraction]:
    """
    Return the derivatives of a biquadratic spline along s and t, at (s, t) in the unit square around its middle value.

    `controls` are rows from the south, of values from the west: 3 x 3.
    """

    def weights(r: Fraction) -> list[Fraction]:
        return [(1 - r) ** 2 / 2, Fraction(1, 2) + r * (1 - r), r**2 / 2]

    def slopes(r: Fraction) -> list[Fraction]:
        return [r - 1, 1 - 2 * r, r]

    return (
        sum((b * a * value for b, row in zip(weights(t), controls, strict=True)
             for a, value in zip(slopes(s), row, strict=True)), Fraction(0)),
        sum((b * a * value for b, row in zip(slopes(t), controls, strict=True)
             for a, value in zip(weights(s), row, strict=True)), Fraction(0)),
    )  # fmt: skip


def steepness(
    problem: dict[str, Any],
    threats: Sequence[Sequence[float]],
    last: Sequence[int],
    cell: tuple[int, int],
    controls: Sequence[Sequence[int]],
    exponent: int,
) -> Fraction:
    """
    Return the square of a ratio of slope and cost that a cell reaches or exceeds: above 1, it is too steep.

    Cell (i, j) is around the node i / last[0] along the west-east side of the map, and j / last[1] along the other.
    """
    bounds, unit, best = [Fraction(one) for one in problem["bounds"]], Fraction(2) ** -exponent, Fraction(0)
    sizes = [(bounds[axis + 2] - bounds[axis]) / last[axis] for axis in range(2)]
    for i in range(PLACES):
        for j in range(PLACES):
            place = Fraction(i, PLACES - 1), Fraction(j, PLACES - 1)
            x, y = (bounds[axis] + (cell[axis] - Fraction(1, 2) + place[axis]) * sizes[axis] for axis in range(2))
            if not (bounds[0] <= x <= bounds[2] and bounds[1] <= y <= bounds[3]):
                continue
            along = [unit * one / size for one, size in zip(gradient(controls, *place), sizes, strict=True)]
            best = max(best, (along[0] ** 2 + along[1] ** 2) / cost_above(problem, threats, x, y) ** 2)
    return best

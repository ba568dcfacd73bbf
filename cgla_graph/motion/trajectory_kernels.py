"""
Compiled kernels of motion: where something is at a time, and how near two motions come to each other.

A motion is two arrays, as in `cgla_graph.motion.trajectory.Trajectory`: ``times``, shape ``(m,)``, ticks, strictly
increasing, and ``points``, shape ``(m, 2)``, map units. Before the first time and after the last it is not there.
"""

import math
from typing import Final, NamedTuple

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, IntArray, Point


class Disc(NamedTuple):
    """
    A disc, such as the surroundings of a goal; its rim belongs to it.

    Attributes
    ----------
    centre, radius
        Map units; a radius below 0 is no disc.
    """

    centre: Point
    radius: float


NO_DISC: Final = Disc((0.0, 0.0), -1.0)


@kernel
def piece_at(times: FloatArray, time: float) -> int:
    """Return the last piece that has begun by `time`: at least 0, at most the last piece; 0 for a single point."""
    low = 0
    high = times.shape[0] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if times[middle] <= time:
            low = middle
        else:
            high = middle
    return low


@kernel
def position(times: FloatArray, points: FloatArray, piece: int, time: float) -> tuple[float, float]:
    """Return the place at `time`, which `piece` spans; at its two ends, that is the waypoint to the last bit."""
    x, y = points[piece, 0], points[piece, 1]
    if piece + 1 == times.shape[0] or time <= times[piece]:
        return x, y
    if time >= times[piece + 1]:
        return points[piece + 1, 0], points[piece + 1, 1]
    part = (time - times[piece]) / (times[piece + 1] - times[piece])
    return x + (points[piece + 1, 0] - x) * part, y + (points[piece + 1, 1] - y) * part


@kernel
def least_gap(x1: float, y1: float, x2: float, y2: float, low: float, high: float) -> tuple[float, float]:
    """
    Return the least squared distance from the origin of a point that moves along a segment, and when.

    The point is at ``(x1, y1)`` at 0, at ``(x2, y2)`` at 1; only the moments from `low` to `high` count, and of equal
    distances the first.
    """
    dx, dy = x2 - x1, y2 - y1
    speed2 = dx * dx + dy * dy
    when = low
    if speed2 > 0.0:
        when = min(max(-(x1 * dx + y1 * dy) / speed2, low), high)
    # from the nearer end, so that an end is met to the last bit
    if when <= 0.5:
        x, y = x1 + when * dx, y1 + when * dy
    else:
        x, y = x2 - (1.0 - when) * dx, y2 - (1.0 - when) * dy
    return x * x + y * y, when


@kernel
def inside_disc(x1: float, y1: float, x2: float, y2: float, disc: Disc) -> tuple[float, float]:
    """
    Return from when to when a point that moves from ``(x1, y1)`` at 0 to ``(x2, y2)`` at 1 is in a disc.

    Both are in [0, 1], and 0 or 1 to the last bit where that end is in the disc; the first is greater than the second
    where the point never is.
    """
    (x, y), radius = disc
    ax, ay, bx, by = x1 - x, y1 - y, x2 - x, y2 - y
    first_in = radius >= 0.0 and ax * ax + ay * ay <= radius * radius
    last_in = radius >= 0.0 and bx * bx + by * by <= radius * radius
    if first_in and last_in:
        return 0.0, 1.0
    dx, dy = x2 - x1, y2 - y1
    a = dx * dx + dy * dy
    half_b = ax * dx + ay * dy
    # |a + s d|^2 = r^2; the product of cross and d tells how far the line passes from the centre
    cross = ax * dy - ay * dx
    root2 = radius * radius * a - cross * cross
    if radius < 0.0 or a == 0.0 or root2 < 0.0:
        if first_in:
            return 0.0, 0.0
        return (1.0, 1.0) if last_in else (1.0, 0.0)
    root = math.sqrt(root2)
    low = 0.0 if first_in else (-half_b - root) / a
    high = 1.0 if last_in else (-half_b + root) / a
    if not (first_in or last_in) and (high < 0.0 or low > 1.0):
        return 1.0, 0.0
    return min(max(low, 0.0), 1.0), min(max(high, 0.0), 1.0)


@kernel
def closest(
    times_a: FloatArray,
    points_a: FloatArray,
    times_b: FloatArray,
    points_b: FloatArray,
    disc_a: Disc,
    disc_b: Disc,
) -> tuple[float, float]:
    """
    Return the least distance of two motions while both are there, and the first time of it.

    Moments when each is in its own disc do not count. Infinity and NaN if no moment counts.
    """
    low = max(times_a[0], times_b[0])
    high = min(times_a[-1], times_b[-1])
    least = math.inf
    at = math.nan
    if not low <= high:
        return least, at
    i = piece_at(times_a, low)
    j = piece_at(times_b, low)
    time = low
    while True:
        end = high
        if i + 1 < times_a.shape[0]:
            end = min(end, times_a[i + 1])
        if j + 1 < times_b.shape[0]:
            end = min(end, times_b[j + 1])
        ax1, ay1 = position(times_a, points_a, i, time)
        ax2, ay2 = position(times_a, points_a, i, end)
        bx1, by1 = position(times_b, points_b, j, time)
        bx2, by2 = position(times_b, points_b, j, end)
        low_a, high_a = inside_disc(ax1, ay1, ax2, ay2, disc_a)
        low_b, high_b = inside_disc(bx1, by1, bx2, by2, disc_b)
        exempt_low, exempt_high = max(low_a, low_b), min(high_a, high_b)
        for side in range(2):
            first = 0.0
            last = 1.0
            if exempt_low <= exempt_high:
                # what is left: before the exempt time, and after it
                if side == 0:
                    last = exempt_low
                    if last <= 0.0:
                        continue
                else:
                    first = exempt_high
                    if first >= 1.0:
                        continue
            elif side == 1:
                continue
            gap2, when = least_gap(ax1 - bx1, ay1 - by1, ax2 - bx2, ay2 - by2, first, last)
            if gap2 < least:
                least = gap2
                at = min(time + when * (end - time), end)
        if end >= high:
            break
        time = end
        if i + 2 < times_a.shape[0] and times_a[i + 1] <= end:
            i += 1
        if j + 2 < times_b.shape[0] and times_b[j + 1] <= end:
            j += 1
    return math.sqrt(least), at


@kernel
def closest_of_pairs(
    times: FloatArray, points: FloatArray, ends: IntArray, discs: FloatArray, pairs: IntArray, out: FloatArray
) -> None:
    """
    Write the least distance of each pair of motions to `out`, shape ``(p,)``, as `closest` returns it.

    The motions lie behind each other in `times` and `points`: motion ``i`` from ``ends[i]`` up to ``ends[i + 1]``.
    `discs` holds centre and radius of each one's disc, shape ``(n, 3)``.
    """
    for row in range(pairs.shape[0]):
        i, j = pairs[row, 0], pairs[row, 1]
        a, b = slice(ends[i], ends[i + 1]), slice(ends[j], ends[j + 1])
        disc_a = Disc((discs[i, 0], discs[i, 1]), discs[i, 2])
        disc_b = Disc((discs[j, 0], discs[j, 1]), discs[j, 2])
        out[row] = closest(times[a], points[a], times[b], points[b], disc_a, disc_b)[0]

"""
Compiled kernels of the room that a path has beside a no-fly area.

A path may move along its *transversals*: one line through each waypoint, on which the waypoint may move by a certain
distance to either side. A segment then stays inside the convex hull of the two stretches on which its ends may be.
So if no hull meets the no-fly area, no path of this kind crosses it: the constraint is a bound on each single shift.
"""

import math

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.model.no_fly_kernels import AreaArrays, segment_crosses

# Bisection halves an interval this often: 2^-40 of it is left.
HALVINGS = 40


@kernel
def _reach(x: float, y: float, dx: float, dy: float, most: float, area: AreaArrays) -> float:
    """Return how far, up to `most`, one can go from a point in a direction without crossing the area."""
    if not segment_crosses(x, y, x + most * dx, y + most * dy, area):
        return most
    low, high = 0.0, most
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if segment_crosses(x, y, x + middle * dx, y + middle * dy, area):
            high = middle
        else:
            low = middle
    return low


@kernel
def _side(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax)


@kernel
def _first_right_of(x: float, corners: FloatArray) -> int:
    """Return the place of the first of some corners, sorted by x, that is not on the left of `x`."""
    low = 0
    high = corners.shape[0]
    while low < high:
        middle = (low + high) // 2
        if corners[middle, 0] < x:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def _in_triangle(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, corners: FloatArray, slack: float
) -> bool:
    """Tell whether a corner, of those sorted by x, is inside a triangle, deeper than `slack`, an area."""
    low_x, high_x = min(ax, bx, cx), max(ax, bx, cx)
    low_y, high_y = min(ay, by, cy), max(ay, by, cy)
    for i in range(_first_right_of(low_x, corners), corners.shape[0]):
        x, y = corners[i, 0], corners[i, 1]
        if x >= high_x:
            return False
        if low_y < y < high_y:
            one = _side(ax, ay, bx, by, x, y)
            two = _side(bx, by, cx, cy, x, y)
            three = _side(cx, cy, ax, ay, x, y)
            if (one > slack and two > slack and three > slack) or (one < -slack and two < -slack and three < -slack):
                return True
    return False


@kernel
def _pair_is_free(
    i: int,
    points: FloatArray,
    directions: FloatArray,
    room: FloatArray,
    scales: tuple[float, float],
    area: AreaArrays,
    corners: FloatArray,
) -> bool:
    """
    Tell whether the hull of the stretches at waypoints ``i`` and ``i + 1`` is free, their arms back and ahead scaled.

    The stretches are free themselves: the area meets the hull's inside if it crosses a line between their ends ``a``
    and ``b``, ``c`` and ``d``, or has a corner inside.
    """
    back, ahead = scales
    px, py, nx, ny = points[i, 0], points[i, 1], directions[i, 0], directions[i, 1]
    qx, qy, mx, my = points[i + 1, 0], points[i + 1, 1], directions[i + 1, 0], directions[i + 1, 1]
    s, t, v, w = back * room[i, 0], ahead * room[i, 1], back * room[i + 1, 0], ahead * room[i + 1, 1]
    ax, ay, bx, by = px - s * nx, py - s * ny, px + t * nx, py + t * ny
    cx, cy, dx, dy = qx - v * mx, qy - v * my, qx + w * mx, qy + w * my
    if (
        segment_crosses(ax, ay, cx, cy, area)
        or segment_crosses(bx, by, dx, dy, area)
        or segment_crosses(ax, ay, dx, dy, area)
        or segment_crosses(bx, by, cx, cy, area)
    ):
        return False
    slack = 1e-15 * ((bx - ax) ** 2 + (by - ay) ** 2 + (dx - ax) ** 2 + (dy - ay) ** 2)
    return not (
        _in_triangle(ax, ay, bx, by, cx, cy, corners, slack)
        or _in_triangle(bx, by, cx, cy, dx, dy, corners, slack)
        or _in_triangle(ax, ay, bx, by, dx, dy, corners, slack)
        or _in_triangle(ax, ay, cx, cy, dx, dy, corners, slack)
    )


@kernel
def free_reach(points: FloatArray, directions: FloatArray, area: AreaArrays, room: FloatArray) -> None:
    """
    Find how far each waypoint can go along its transversal before it meets the no-fly area.

    Parameters
    ----------
    points, directions
        Waypoints outside the area and unit vectors, shape ``(m, 2)``.
    area
        The no-fly area.
    room
        How far each waypoint may go against and along its direction, shape ``(m, 2)``: overwritten by the remaining
        room.
    """
    for i in range(points.shape[0]):
        x, y, dx, dy = points[i, 0], points[i, 1], directions[i, 0], directions[i, 1]
        room[i, 0] = _reach(x, y, -dx, -dy, room[i, 0], area)
        room[i, 1] = _reach(x, y, dx, dy, room[i, 1], area)


@kernel
def free_hulls(
    points: FloatArray, directions: FloatArray, area: AreaArrays, corners: FloatArray, room: FloatArray
) -> None:
    """
    Shorten the stretches that waypoints may use, free themselves, until no segment between them can cross the area.

    Parameters
    ----------
    points, directions
        Waypoints of a feasible path and unit vectors, shape ``(m, 2)``.
    area, corners
        The no-fly area, and its corners that are within the greatest room of the path, sorted by x, shape ``(c, 2)``.
    room
        How far each waypoint may go against and along its direction, shape ``(m, 2)``: overwritten by the remaining
        room.
    """
    n = points.shape[0]
    for i in range(n - 1):
        if _pair_is_free(i, points, directions, room, (1.0, 1.0), area, corners):
            continue
        # each side of the path for itself, so that an obstacle on one takes no room from the other; then both
        for side in range(3):
            back = 1.0 if side != 1 else 0.0
            ahead = 1.0 if side != 0 else 0.0
            if _pair_is_free(i, points, directions, room, (back, ahead), area, corners):
                continue
            low, high = 0.0, 1.0
            for _ in range(HALVINGS // 2):
                middle = 0.5 * (low + high)
                if _pair_is_free(i, points, directions, room, (middle * back, middle * ahead), area, corners):
                    low = middle
                else:
                    high = middle
            if back > 0.0:
                room[i, 0] *= low
                room[i + 1, 0] *= low
            if ahead > 0.0:
                room[i, 1] *= low
                room[i + 1, 1] *= low


@kernel
def nearest_on_path(points: FloatArray, corners: FloatArray, segment: IntArray, fraction: FloatArray) -> None:
    """
    Find the point of a polyline that is nearest to each corner.

    Writes the number of its segment and the fraction of it, 0 to 1, shapes ``(c,)``.
    """
    for c in range(corners.shape[0]):
        best = math.inf
        for i in range(points.shape[0] - 1):
            dx = points[i + 1, 0] - points[i, 0]
            dy = points[i + 1, 1] - points[i, 1]
            squared = dx * dx + dy * dy
            rx = corners[c, 0] - points[i, 0]
            ry = corners[c, 1] - points[i, 1]
            t = min(max((rx * dx + ry * dy) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
            distance = (rx - t * dx) ** 2 + (ry - t * dy) ** 2
            if distance < best:
                best = distance
                segment[c] = i
                fraction[c] = t

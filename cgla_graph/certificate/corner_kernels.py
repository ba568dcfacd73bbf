"""
Compiled kernels of blocks around corners: by how much a spline falls more, from rim to rim, than a way has to cost.

All places are relative to the corner. Let ``c_l = c_0 + g . x``. Along a straight line, its integral is ``|a - b| (c_0
+ g . (a + b) / 2)``. Over two short parts of the rim, that is at least a linear function of both ends: what ``|a - b|
>= u . (a - b)`` with a unit vector ``u`` yields, less a rest of second order. And on each part, a quadratic spline less
a linear function is at most the greatest of its Bézier control values.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.eikonal.marching_kernels import spline_value

#: Parts of the rim are halved so often, at most.
DEEPEST = 7
#: A charge is greater than it has to be by up to this part.
SLACK = 0.02
#: Where a wall is crossed within this part of the lengths, it does not count as crossed.
TINY = 1e-9
#: Columns of the numbers of a corner: cost there, its slopes, how fast it may bend down, the square of its greatest
#: slope over four times the least cost, the greatest cost over the least, the greatest cost, and how much further it is
#: over all corners of the block than over the one in the middle.
COST, SLOPE_X, SLOPE_Y, BEND, TURN, RATIO, MOST, SPAN = range(8)


@kernel
def curves(places: FloatArray, pieces: WholeArray, controls: WholeArray, values: FloatArray, out: FloatArray) -> None:
    """Write the Bézier control values of a spline along lines on pieces, shape ``(s, 4)``, to `out`: ``(s, 3)``."""
    for s in range(places.shape[0]):
        for i in range(3):
            u = places[s, 0] + 0.5 * i * (places[s, 2] - places[s, 0])
            v = places[s, 1] + 0.5 * i * (places[s, 3] - places[s, 1])
            out[s, i] = spline_value(controls[pieces[s]], u, v, values)
        out[s, 1] = 2.0 * out[s, 1] - 0.5 * (out[s, 0] + out[s, 2])


@kernel
def cut(line: FloatArray, curve: FloatArray, s: float, t: float, out: FloatArray) -> None:
    """Write the part of a line between two of its parameters to `out`: two ends, then three control values."""
    for axis in range(2):
        out[axis] = line[axis] + s * (line[2 + axis] - line[axis])
        out[2 + axis] = line[axis] + t * (line[2 + axis] - line[axis])
    out[4] = (1.0 - s) * (1.0 - s) * curve[0] + 2.0 * s * (1.0 - s) * curve[1] + s * s * curve[2]
    out[5] = (1.0 - s) * (1.0 - t) * curve[0] + (s * (1.0 - t) + t * (1.0 - s)) * curve[1] + s * t * curve[2]
    out[6] = (1.0 - t) * (1.0 - t) * curve[0] + 2.0 * t * (1.0 - t) * curve[1] + t * t * curve[2]


@kernel
def highest(part: FloatArray, sign: float, ux: float, uy: float) -> float:
    """Return the greatest control value of ``sign * phi - u . x`` on a part of the rim."""
    worst = -math.inf
    for i in range(3):
        x = part[0] + 0.5 * i * (part[2] - part[0])
        y = part[1] + 0.5 * i * (part[3] - part[1])
        worst = max(worst, sign * part[4 + i] - ux * x - uy * y)
    return worst


@kernel
def beside(px: float, py: float, qx: float, qy: float, rx: float, ry: float) -> float:
    """Return how far ``r`` is to the left of the line from ``p`` to ``q``, times its length, but for rounding."""
    value = (qx - px) * (ry - py) - (qy - py) * (rx - px)
    size = (abs(qx - px) + abs(qy - py)) * (abs(rx - px) + abs(ry - py))
    return value if abs(value) > TINY * size else 0.0


@kernel
def is_blocked(one: FloatArray, two: FloatArray, walls: FloatArray) -> bool:
    """
    Tell whether every straight line from one part of the rim to another crosses the same wall.

    On which side of such a line a point is, depends on both its ends bilinearly: what holds for the four lines between
    the ends of both parts holds for all.
    """
    for w in range(walls.shape[0]):
        ux, uy, wx, wy = walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]
        sign = 1.0 if beside(ux, uy, wx, wy, one[0], one[1]) > 0.0 else -1.0
        crossed = True
        for i in range(2):
            if not sign * beside(ux, uy, wx, wy, one[2 * i], one[2 * i + 1]) > 0.0:
                crossed = False
            if not sign * beside(ux, uy, wx, wy, two[2 * i], two[2 * i + 1]) < 0.0:
                crossed = False
        for i in range(2 if crossed else 0):
            for j in range(2):
                ax, ay, bx, by = one[2 * i], one[2 * i + 1], two[2 * j], two[2 * j + 1]
                if not sign * beside(ax, ay, bx, by, ux, uy) < 0.0 or not sign * beside(ax, ay, bx, by, wx, wy) > 0.0:
                    crossed = False
        if crossed:
            return True
    return False


@kernel
def leg(
    x: float, y: float, vx: float, vy: float, wide: float, numbers: FloatArray
) -> tuple[float, float, float, float, float]:
    """
    Bound the integral of ``c_l`` from ``a`` to ``b`` from below, near ``(x, y)`` and ``(vx, vy)``.

    Returns
    -------
    bound
        ``p . a + q . b + r`` as ``p_x, p_y, q_x, q_y, r``, where ``a`` and ``b`` together are at most `wide` off.
    """
    far = math.hypot(x - vx, y - vy)
    ux, uy = ((x - vx) / far, (y - vy) / far) if far > 0.0 else (0.0, 0.0)
    gx, gy = numbers[SLOPE_X], numbers[SLOPE_Y]
    cost = numbers[COST] + 0.5 * (gx * (x + vx) + gy * (y + vy))
    left = 0.5 * math.hypot(gx, gy) * wide * wide
    constant = far * (numbers[COST] - cost) - left
    return (
        cost * ux + 0.5 * far * gx,
        cost * uy + 0.5 * far * gy,
        0.5 * far * gx - cost * ux,
        0.5 * far * gy - cost * uy,
        constant,
    )


@kernel
def bent(length: float, off: float, numbers: FloatArray) -> float:
    """Bound what ways about so long, between points `off` from the corner together, may cost less as the cost bends."""
    along = length * numbers[RATIO]
    away = 0.5 * (off + along)
    lost: float = 0.5 * numbers[BEND] * away * away * along + numbers[TURN] * along * along * along * (2.0 / 3.0)
    return lost


@kernel
def over_bend(part: FloatArray, sign: float, x: float, y: float, walls: FloatArray, numbers: FloatArray) -> float:
    """Bound ``sign * phi`` on a part of the rim less the integral of ``c_l`` to a bend; -infinity behind a wall."""
    bend = np.array([x, y, x, y])
    if is_blocked(part, bend, walls):
        return -math.inf
    half = 0.5 * math.hypot(part[2] - part[0], part[3] - part[1])
    px, py, qx, qy, constant = leg(0.5 * (part[0] + part[2]), 0.5 * (part[1] + part[3]), x, y, half, numbers)
    bound: float = highest(part, sign, px, py) - qx * x - qy * y - constant
    return bound


@kernel
def excess_over(
    one: FloatArray, two: FloatArray, vertices: FloatArray, walls: FloatArray, numbers: FloatArray
) -> float:
    """Bound ``phi(a) - phi(b) - D(a, b)`` for all ``a`` and ``b`` on two parts of the rim (see `corners`)."""
    mx, my, nx, ny = 0.5 * (one[0] + one[2]), 0.5 * (one[1] + one[3]), 0.5 * (two[0] + two[2]), 0.5 * (two[1] + two[3])
    first = 0.5 * math.hypot(one[2] - one[0], one[3] - one[1])
    second = 0.5 * math.hypot(two[2] - two[0], two[3] - two[1])
    off = max(math.hypot(one[0], one[1]), math.hypot(one[2], one[3]))
    off += max(math.hypot(two[0], two[1]), math.hypot(two[2], two[3]))
    px, py, qx, qy, constant = leg(mx, my, nx, ny, first + second, numbers)
    straight: float = highest(one, 1.0, px, py) + highest(two, -1.0, qx, qy) - constant
    straight += bent(math.hypot(mx - nx, my - ny) + first + second, off, numbers)
    if straight <= 0.0 or not is_blocked(one, two, walls):
        return straight
    off += numbers[SPAN]
    # ways that are longer than any over these corners
    around: float = highest(one, 1.0, 0.0, 0.0) + highest(two, -1.0, 0.0, 0.0) - off * numbers[MOST]
    for v in range(vertices.shape[0]):
        vx, vy = vertices[v, 0], vertices[v, 1]
        over = over_bend(one, 1.0, vx, vy, walls, numbers)
        for w in range(vertices.shape[0] if over > -math.inf else 0):
            wx, wy = vertices[w, 0], vertices[w, 1]
            between = numbers[COST] + 0.5 * (numbers[SLOPE_X] * (vx + wx) + numbers[SLOPE_Y] * (vy + wy))
            both = over + over_bend(two, -1.0, wx, wy, walls, numbers) - math.hypot(vx - wx, vy - wy) * between
            around = max(around, both + bent(off, off, numbers))
    return min(straight, around)


@kernel
def most_fall(one: FloatArray, two: FloatArray) -> float:
    """Bound by how much ``phi`` falls from a part of the rim to another, by their control values."""
    fall: float = max(one[0], one[1], one[2]) - min(two[0], two[1], two[2])
    return fall


@kernel
def apart(one: FloatArray, two: FloatArray) -> float:
    """Bound the distance of two parts of the rim from below."""
    x, y = one[0] + one[2] - two[0] - two[2], one[1] + one[3] - two[1] - two[3]
    lengths = math.hypot(one[2] - one[0], one[3] - one[1]) + math.hypot(two[2] - two[0], two[3] - two[1])
    return max(0.5 * (math.hypot(x, y) - lengths), 0.0)


@kernel
def charge(
    lines: FloatArray,
    curve: FloatArray,
    vertices: FloatArray,
    walls: FloatArray,
    numbers: FloatArray,
    least: float,
    most: float,
) -> float:
    """
    Bound ``phi(a) - phi(b) - D(a, b)`` for all ``a`` and ``b`` on the rim of a block, no better than to `least`.

    Parts of the rim are halved where their bound is above the greatest value found. Where a control value is infinite,
    no path leads. The answer is infinite as soon as `most` is exceeded.
    """
    worst = least
    stack = np.empty((3 * DEEPEST + 8, 4))
    one = np.empty(7)
    two = np.empty(7)
    least_cost = numbers[MOST] / numbers[RATIO]
    for i in range(lines.shape[0]):
        for j in range(lines.shape[0]):
            if math.isinf(curve[i, 1]) or math.isinf(curve[j, 1]):
                continue
            # (no way is shorter than the straight line, and none costs less for its length than the least cost)
            if most_fall(curve[i], curve[j]) - least_cost * apart(lines[i], lines[j]) <= worst:
                continue
            stack[0, 0], stack[0, 1], stack[0, 2] = 0.0, 0.0, 1.0
            size = 1
            while size > 0:
                size -= 1
                s, t, width = stack[size, 0], stack[size, 1], stack[size, 2]
                cut(lines[i], curve[i], s, s + width, one)
                cut(lines[j], curve[j], t, t + width, two)
                found = excess_over(one, two, vertices, walls, numbers)
                if found <= worst:
                    continue
                if width <= 0.5**DEEPEST:
                    if not found <= most:
                        return math.inf
                    # a little more, so that not all that is about as bad is halved as often
                    worst = (1.0 + SLACK) * found + least
                    continue
                for k in range(4):
                    stack[size, 0] = s + 0.5 * width * (k % 2)
                    stack[size, 1] = t + 0.5 * width * (k // 2)
                    stack[size, 2] = 0.5 * width
                    size += 1
    return worst

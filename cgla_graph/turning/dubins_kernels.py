"""
Dubins' shortest curves between two poses, in closed form.

Dubins, "On curves of minimal length with a constraint on average curvature", Am. J. Math. 79(3), 1957: the shortest
curve that is no tighter than a radius is an arc, a line and an arc (LSL, RSR, LSR, RSL), or three arcs (LRL, RLR). The
formulas are those of Shkel and Lumelsky, "Classification of the Dubins set", Rob. Auton. Syst. 34(4), 2001.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray
from cgla_graph.turning.curve_kernels import CX, CY, RADIUS, TURN, X0, X1, Y0, Y1

#: How each of the three parts of a word turns: 1 left, 0 straight, -1 right.
WORDS = np.array([[1, 0, 1], [-1, 0, -1], [1, 0, -1], [-1, 0, 1], [1, -1, 1], [-1, 1, -1]], dtype=np.float64)
N_WORDS = 6
_TURN = 2.0 * math.pi


@kernel
def _whole(angle: float) -> float:
    """Return an angle in ``[0, 2 pi)``; just below a full turn it is rounding of none."""
    angle -= _TURN * math.floor(angle / _TURN)
    return 0.0 if angle > _TURN - 1e-9 else angle


@kernel
def word_parts(
    start: tuple[float, float, float], goal: tuple[float, float, float], radius: float, word: int
) -> tuple[float, float, float]:
    """
    Return the three parts of a word, in radii: angles of arcs, length of the line. They are infinite if there is none.

    Parameters
    ----------
    start, goal
        ``(x, y, heading)``, radians counter-clockwise from the x axis.
    radius
        Of the arcs, above 0.
    word
        Row of `WORDS`.

    Examples
    --------
    >>> [round(part, 9) for part in word_parts((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), 2.0, 0)]
    [0.0, 2.0, 0.0]
    """
    dx, dy = (goal[0] - start[0]) / radius, (goal[1] - start[1]) / radius
    d = math.hypot(dx, dy)
    bearing = math.atan2(dy, dx) if d > 0.0 else 0.0
    # words that begin to the right are those that begin to the left, in a mirror
    mirror = 1.0 if WORDS[word, 0] > 0.0 else -1.0
    a, b = mirror * (start[2] - bearing), mirror * (goal[2] - bearing)
    sa, ca, sb, cb = math.sin(a), math.cos(a), math.sin(b), math.cos(b)
    if word <= 1:
        squared = 2.0 + d * d - 2.0 * math.cos(a - b) + 2.0 * d * (sa - sb)
        line = math.sqrt(max(squared, 0.0))
        # (the circles are one: no line, and the first arc does it all)
        to = math.atan2(cb - ca, d + sa - sb) if line > 1e-12 else a
        return _whole(to - a), line, _whole(b - to)
    if word <= 3:
        squared = d * d - 2.0 + 2.0 * math.cos(a - b) + 2.0 * d * (sa + sb)
        if squared < 0.0:
            return math.inf, math.inf, math.inf
        line = math.sqrt(squared)
        to = math.atan2(-ca - cb, d + sa + sb) - math.atan2(-2.0, line)
        return _whole(to - a), line, _whole(to - b)
    cosine = (6.0 - d * d + 2.0 * math.cos(a - b) + 2.0 * d * (sb - sa)) / 8.0
    if abs(cosine) > 1.0:
        return math.inf, math.inf, math.inf
    middle = _whole(_TURN - math.acos(cosine))
    first = _whole(-a + math.atan2(-ca + cb, d + sa - sb) + 0.5 * middle)
    return first, middle, _whole(b - a - first + middle)


@kernel
def word_pieces(
    start: tuple[float, float, float], goal: tuple[float, float, float], radius: float, word: int, out: FloatArray
) -> int:
    """
    Write the pieces of a word to `out`, shape ``(3, 8)`` or more rows; return how many they are, -1 if there is none.

    The last piece ends at the goal itself.
    """
    parts = word_parts(start, goal, radius, word)
    if parts[0] == math.inf:
        return -1
    x, y, heading = start
    n = 0
    for i in range(3):
        turn = WORDS[word, i]
        # (what rounding leaves of no part at all)
        if parts[i] <= 1e-12:
            continue
        piece = out[n]
        piece[X0], piece[Y0] = x, y
        if turn == 0.0:
            piece[CX], piece[CY], piece[RADIUS], piece[TURN] = 0.0, 0.0, 0.0, 0.0
            x, y = x + radius * parts[i] * math.cos(heading), y + radius * parts[i] * math.sin(heading)
        else:
            cx, cy = x - turn * radius * math.sin(heading), y + turn * radius * math.cos(heading)
            heading += turn * parts[i]
            piece[CX], piece[CY], piece[RADIUS], piece[TURN] = cx, cy, radius, turn * parts[i]
            x, y = cx + turn * radius * math.sin(heading), cy - turn * radius * math.cos(heading)
        piece[X1], piece[Y1] = x, y
        n += 1
    if math.hypot(x - goal[0], y - goal[1]) > 1e-6 * radius * (1.0 + parts[0] + parts[1] + parts[2]):
        return -1
    if n > 0:
        out[n - 1, X1], out[n - 1, Y1] = goal[0], goal[1]
    return n


@kernel
def shortest(start: tuple[float, float, float], goal: tuple[float, float, float], radius: float) -> tuple[int, float]:
    """
    Return the shortest word and its length, map units.

    Examples
    --------
    >>> word, length = shortest((0.0, 0.0, 0.0), (0.0, 2.0, math.pi), 1.0)
    >>> word, round(length / math.pi, 12)
    (0, 1.0)
    """
    best, least = -1, math.inf
    for word in range(N_WORDS):
        parts = word_parts(start, goal, radius, word)
        length = parts[0] + parts[1] + parts[2]
        if length < least:
            best, least = word, length
    return best, radius * least

"""
Compiled kernels that bound the weight of a segment without integrating along it.

A weight is an integral, and dear; a bound is cheap. No risk is negative, so that a weight is at least its length. More
comes from single threats by Bonferroni's inequality, ``1 - prod(1 - f_i) >= sum f_i - sum f_i f_j`` for any subset of
the threats, integrated term by term; and ``1 - prod(1 - f_i) <= sum f_i`` bounds what threats added.
"""

import math

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray
from cgla_graph.model.risk_kernels import LOG_PEAK, ORDINARY, PRECISION, REACH2, ROOT, SPREAD, X, Y, erf

#: A threat whose risk stays below exp(-12) on the whole segment adds nothing to a bound that is worth its time.
FAINT = 24.0
#: The integrals of Eq. 6 err by less than this times the greatest spread (see `risk_kernels`).
RISK_ERROR = 2e-11
#: Relative rounding of a few operations, with room to spare: lower bounds are lowered by so much.
ULPS = 4e-15
#: ``sqrt(pi) / 2``, from the integral of ``exp(-x^2)``, and ``sqrt(2 pi)``, from that over the whole line.
HALF_SQRT_PI = 0.886226925452758
SQRT_2_PI = 2.5066282746310002
#: Who asks whether a threat reaches a segment may be told so too often, never too rarely.
REACH_SLACK = 1.000001


@kernel
def distance2(x1: float, y1: float, x2: float, y2: float, x: float, y: float) -> float:
    """Return the squared distance between a segment and a point."""
    dx, dy = x2 - x1, y2 - y1
    rx, ry = x - x1, y - y1
    length2 = dx * dx + dy * dy
    t = 0.0
    if length2 > 0.0:
        t = min(max((rx * dx + ry * dy) / length2, 0.0), 1.0)
    rx -= t * dx
    ry -= t * dy
    return rx * rx + ry * ry


@kernel
def in_reach(x1: float, y1: float, x2: float, y2: float, table: FloatArray) -> bool:
    """Tell whether a segment comes within reach of a threat, or nearly so; if not, its risk knows nothing of them."""
    for i in range(table.shape[0]):
        if distance2(x1, y1, x2, y2, table[i, X], table[i, Y]) <= REACH_SLACK * table[i, REACH2]:
            return True
    return False


@kernel
def in_boxes(x1: float, y1: float, x2: float, y2: float, boxes: FloatArray) -> bool:
    """Tell whether the box of a segment meets one of the boxes ``x_min, y_min, x_max, y_max``, shape ``(b, 4)``."""
    for box in boxes:
        if max(x1, x2) >= box[0] and min(x1, x2) <= box[2] and max(y1, y2) >= box[1] and min(y1, y2) <= box[3]:
            return True
    return False


@kernel
def gone_risk(x1: float, y1: float, x2: float, y2: float, table: FloatArray) -> float:
    """Bound the risk that threats added to a segment: no more than the sum of their single integrals."""
    length = math.hypot(x2 - x1, y2 - y1)
    total = 0.0
    if length == 0.0:
        return total
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    for row in table:
        rx, ry = row[X] - x1, row[Y] - y1
        t = rx * ux + ry * uy
        off = rx * uy - ry * ux
        beyond = min(t, 0.0) + max(t - length, 0.0)
        if off * off + beyond * beyond <= REACH_SLACK * row[REACH2]:
            amplitude = math.exp(row[LOG_PEAK] - 0.5 * off * off * row[PRECISION])
            total += HALF_SQRT_PI * amplitude / row[ROOT] * (erf((length - t) * row[ROOT]) + erf(t * row[ROOT]))
    return total


@kernel
def least_risk(
    x1: float, y1: float, x2: float, y2: float, table: FloatArray, near: FloatArray, enough: float, hint: int
) -> tuple[float, int]:
    """
    Bound the risk of a segment from below by Bonferroni's inequality, threat by threat; stop at `enough`.

    A threat is taken into the sum if it gains more than its products with those taken before lose; the products are
    integrated over the whole line, which is more. The threat `hint` comes first. Returns the bound, and the threat
    that reached `enough`, or the one that gave most. `near` is scratch memory, shape ``(m, 3)``.
    """
    # no hypot: the square cannot overflow on any map, and where it underflows the risk is nothing
    length = math.sqrt((x2 - x1) * (x2 - x1) + (y2 - y1) * (y2 - y1))
    if length == 0.0:
        return 0.0, hint
    inverse = 1.0 / length
    ux, uy = (x2 - x1) * inverse, (y2 - y1) * inverse
    total = 0.0
    most = 0.0
    strongest = hint
    taken = 0
    for turn in range(-1, table.shape[0]):
        row = hint if turn < 0 else turn
        if turn == hint:
            continue
        rx, ry = table[row, X] - x1, table[row, Y] - y1
        off = rx * uy - ry * ux
        precision = table[row, PRECISION]
        if off * off * precision > FAINT:
            continue
        t = rx * ux + ry * uy
        beyond = max(-t, t - length)
        if beyond > 0.0 and (off * off + beyond * beyond) * precision > FAINT:
            continue
        root = table[row, ROOT]
        amplitude = math.exp(table[row, LOG_PEAK] - 0.5 * off * off * precision)
        alone = HALF_SQRT_PI * amplitude / root * (erf((length - t) * root) + erf(t * root))
        if alone > most:
            most = alone
            strongest = row
            if most >= enough:
                return most, row
        gain = alone
        for j in range(taken):
            both = 1.0 / (precision + near[j, 1])
            apart = t - near[j, 0]
            power = min(0.5 * precision * near[j, 1] * apart * apart * both, FAINT)
            gain -= SQRT_2_PI * amplitude * near[j, 2] * math.exp(-power) * math.sqrt(both)
        if gain > 0.0:
            total += gain
            if total >= enough:
                return total, row
            near[taken, 0] = t
            near[taken, 1] = precision
            near[taken, 2] = amplitude
            taken += 1
    return max(most, total), strongest


@kernel
def risk_error(table: FloatArray) -> float:
    """Return how far computed integrals of Eq. 6 may be from the truth, and from each other, for a field."""
    widest, greatest = 0.0, -math.inf
    for row in table:
        widest = max(widest, row[SPREAD])
        greatest = max(greatest, row[LOG_PEAK])
    # (of weak threats alone, it is relative to them: see `risk_kernels.unit_of`)
    return RISK_ERROR * widest * min(ORDINARY * math.exp(greatest), 1.0)

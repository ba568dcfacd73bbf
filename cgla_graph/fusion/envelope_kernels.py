"""
Compiled kernels of the upper envelope: the integral of the largest of several risk fields over a segment.

Several fields reach a kernel as the tuple `Fields`. Along a segment the largest field changes where two fields cross.
Between the crossings one field is the largest, and its integral is `risk_kernels.segment_risk`, so that all that
is to be found here is the crossings. On a short panel, the difference of two fields is a polynomial of degree 15 with a
small error, and its Legendre coefficients ``c_k`` decide, as no ``|P_k|`` exceeds 1: ``|c_0| > sum |c_k|`` proves that
it has no root, and the same of its derivative that it has one at most. A panel where neither holds is halved, until
a wrong answer would no longer matter.
"""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.model.risk_kernels import (
    _NODES,
    _WEIGHTS,
    AT,
    HIGH,
    LOG2_E,
    LOG_AMPLITUDE,
    LOW,
    N_NODES,
    PRECISION_AT,
    ROW,
    Field,
    deeper_of,
    exp2,
    panel_end,
    panel_widths,
    segment_risk,
    threats_in_reach,
)

#: The table of all different threats (see `risk_kernels.threat_table`), shape ``(u, 8)``; how often each field has
#: each of them, shape ``(n, u)``; the fields' own tables one below the other, and the ``n + 1`` rows where they begin.
Fields: TypeAlias = tuple[FloatArray, IntArray, FloatArray, IntArray]
#: Scratch memory of one thread: threats in reach; Legendre coefficients of ``F`` on a panel for each rival; borders
#: of the pieces of a panel; scratch of `segment_risk` and `_sample`; indices of the rivals, which are the fields that
#: may be the largest somewhere; and of the rivals that may be the largest on a panel.
Work: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray, IntArray, IntArray]

#: Fused fields have no rasters.
NO_RASTERS = None
#: Fields that differ by less count as equal: over a whole segment a fifth of the error that is promised.
NO_DIFFERENCE = 2e-10
#: So do fields whose difference integrates to less on one panel, relative to the length of the segment.
NO_RISK = 1e-11
#: A panel may be this much wider than the one before it: where one had to be halved, so had the next.
GROWTH = 1.3


_ORDERS = np.arange(N_NODES)
#: The matrix that turns values at the nodes into the Legendre coefficients of their polynomial, transposed.
_SERIES = np.ascontiguousarray(
    _WEIGHTS[:, None] * np.polynomial.legendre.legvander(_NODES, N_NODES - 1) * (_ORDERS + 0.5)
)
# of the recurrence (k + 1) P_k+1 = (2 k + 1) x P_k - k P_k-1, as Clenshaw needs it
_UP, _DOWN = (2 * _ORDERS + 1) / (_ORDERS + 1), (_ORDERS + 1) / (_ORDERS + 2)


@kernel
def workspace(fields: Fields) -> Work:
    """Allocate the scratch memory of one thread."""
    n_threats = fields[0].shape[0]
    n_fields = fields[1].shape[0]
    return (
        np.empty((n_threats, 9)),
        np.empty((n_fields, N_NODES)),
        np.empty(n_fields * (n_fields - 1) // 2 + 2),
        np.empty((2 * fields[2].shape[0] + 3 + n_fields, N_NODES)),
        np.empty(n_fields, dtype=np.int64),
        np.empty(n_fields, dtype=np.int64),
    )


@kernel
def _rivals(m: int, active: FloatArray, counts: IntArray, rivals: IntArray) -> int:
    """
    List the fields that may be the largest somewhere, and count them.

    A field that has no threat here which another lacks is nowhere above that one (Eq. 2 grows with each threat).
    """
    n_rivals = 0
    for j in range(counts.shape[0]):
        reached = False
        for i in range(m):
            reached |= counts[j, int(active[i, ROW])] > 0
        beaten = not reached
        for other in range(counts.shape[0]):
            if beaten:
                break
            if other != j:
                below = True
                equal = True
                for i in range(m):
                    below &= counts[j, int(active[i, ROW])] <= counts[other, int(active[i, ROW])]
                    equal &= counts[j, int(active[i, ROW])] == counts[other, int(active[i, ROW])]
                beaten = below and (not equal or other < j)
        if not beaten:
            rivals[n_rivals] = j
            n_rivals += 1
    return n_rivals


@kernel
def _risk(at: float, j: int, m: int, active: FloatArray, counts: IntArray) -> float:
    """Evaluate ``F`` of field `j` at the distance `at` from the start of the segment."""
    risk = 0.0
    for i in range(m):
        for _ in range(counts[j, int(active[i, ROW])]):
            d = at - active[i, AT]
            risk += math.exp(active[i, LOG_AMPLITUDE] - 0.5 * active[i, PRECISION_AT] * d * d) * (1.0 - risk)
    return risk


@kernel
def _sample(start: float, end: float, m: int, active: FloatArray, counts: IntArray, n: int, work: Work) -> None:
    """Write the Legendre coefficients of ``F`` on a panel, for each of the `n` rivals."""
    series, scratch, rivals = work[1], work[3], work[4]
    half = 0.5 * (end - start)
    middle = 0.5 * (end + start)
    f, risk = scratch[0], scratch[1 : n + 1]
    risk[:] = 0.0
    for i in range(m):
        if active[i, LOW] < end and active[i, HIGH] > start:
            centre = active[i, AT]
            scale = -0.5 * active[i, PRECISION_AT] * LOG2_E
            offset = active[i, LOG_AMPLITUDE] * LOG2_E
            for node in range(N_NODES):
                d = middle + half * _NODES[node] - centre
                f[node] = exp2(offset + scale * d * d)
            for r in range(n):
                for _ in range(counts[rivals[r], int(active[i, ROW])]):
                    for node in range(N_NODES):
                        risk[r, node] += f[node] * (1.0 - risk[r, node])
    for r in range(n):
        series[r] = 0.0
        for node in range(N_NODES):
            for k in range(N_NODES):
                series[r, k] += _SERIES[node, k] * risk[r, node]


@kernel
def _rest(c: FloatArray) -> float:
    """
    Bound how far a Legendre series strays from its first coefficient, with the polynomial's own error.

    The last coefficients, doubled, stand for those that the polynomial lacks: they shrink fast on panels this narrow.
    """
    rest: float = abs(c[N_NODES - 1]) + abs(c[N_NODES - 2])
    for k in range(1, N_NODES):
        rest += abs(c[k])
    return rest


@kernel
def _differentiate(c: FloatArray, out: FloatArray) -> None:
    """Write the Legendre series of the derivative."""
    out[N_NODES - 1] = 0.0
    out[N_NODES - 2] = (2 * N_NODES - 3) * c[N_NODES - 1]
    for k in range(N_NODES - 3, -1, -1):
        out[k] = (2 * k + 1) * (c[k + 1] + out[k + 2] / (2 * k + 5))


@kernel
def _polynomial(c: FloatArray, x: float) -> float:
    """Evaluate a Legendre series by Clenshaw's recurrence."""
    later = 0.0
    here = 0.0
    for k in range(N_NODES - 1, 0, -1):
        here, later = c[k] + _UP[k] * x * here - _DOWN[k] * later, here
    value: float = c[0] + x * here - 0.5 * later
    return value


@kernel
def _root(c: FloatArray, size: float) -> float:
    """
    Find the root in (-1, 1) of a monotone Legendre series by the Illinois rule; 2 if there is none.

    It ends where the series is a millionth of its `size`: what that place costs the integral is of second order.
    """
    low = -1.0
    high = 1.0
    at_low = _polynomial(c, low)
    at_high = _polynomial(c, high)
    if (at_low > 0.0) == (at_high > 0.0):
        return 2.0
    x = 0.0
    side = 0
    for _ in range(60):
        x = (low * at_high - high * at_low) / (at_high - at_low)
        value = _polynomial(c, x)
        if abs(value) <= 1e-6 * size:
            break
        if (value > 0.0) == (at_high > 0.0):
            high = x
            at_high = value
            if side == 1:
                at_low *= 0.5
            side = 1
        else:
            low = x
            at_low = value
            if side == -1:
                at_high *= 0.5
            side = -1
    return x


@kernel
def _crossings(start: float, end: float, length: float, n: int, unit: float, work: Work) -> tuple[int, int]:
    """
    Find where the largest of the `n` rivals may change on a panel: in how many pieces, and between how many rivals.

    The borders of the pieces are written to the cuts, the rivals to the last indices of `work`. No piece (0, 0) means
    that the panel is too wide to say.
    """
    series, cuts, winners = work[1], work[2], work[5]
    difference, slope = work[3][0], work[3][1]
    top = 0
    for r in range(1, n):
        if series[r, 0] > series[top, 0]:
            top = r
    n_winners = 0
    for r in range(n):
        difference[:] = series[top] - series[r]
        if r == top or difference[0] <= _rest(difference):
            winners[n_winners] = r
            n_winners += 1
    cuts[0] = start
    n_pieces = 1
    for p in range(n_winners):
        for q in range(p + 1, n_winners):
            difference[:] = series[winners[p]] - series[winners[q]]
            rest = _rest(difference)
            size = abs(difference[0]) + rest
            alike = size <= NO_DIFFERENCE * unit or size * (end - start) <= NO_RISK * unit * length
            if alike or abs(difference[0]) > rest:
                continue
            _differentiate(difference, slope)
            if abs(slope[0]) <= _rest(slope):
                return 0, 0
            root = _root(difference, size)
            if root < 1.0:
                cut = 0.5 * (start + end) + 0.5 * (end - start) * root
                at = n_pieces
                while cuts[at - 1] > cut:
                    cuts[at] = cuts[at - 1]
                    at -= 1
                cuts[at] = cut
                n_pieces += 1
    cuts[n_pieces] = end
    return n_pieces, n_winners


@kernel
def _winner(at: float, n_winners: int, m: int, counts: IntArray, work: Work) -> int:
    """Return the field that is the largest at the distance `at` from the start of the segment."""
    active, rivals, winners = work[0], work[4], work[5]
    best = rivals[winners[0]]
    if n_winners == 1:
        return int(best)
    greatest = -math.inf
    for w in range(n_winners):
        j = rivals[winners[w]]
        risk = _risk(at, j, m, active, counts)
        if risk > greatest:
            greatest = risk
            best = j
    return int(best)


@kernel
def _piece(x1: float, y1: float, ux: float, uy: float, low: float, high: float, field: Field) -> float:
    """Integrate one field over the piece of a segment from `low` to `high`."""
    return segment_risk(x1 + low * ux, y1 + low * uy, x1 + high * ux, y1 + high * uy, field, math.inf)


@kernel
def envelope_risk(x1: float, y1: float, x2: float, y2: float, fields: Fields, work: Work) -> float:
    """
    Integrate ``max_j F^j`` over a segment, with an absolute error of less than 1e-9 on a map of unit size.

    Where one field is the largest all along, this is its `segment_risk` to the last bit. For the same float in both
    directions, the ends have to be in one order.
    """
    threats, counts, tables, rows = fields
    active, _, cuts, scratch, rivals, _ = work
    length = math.hypot(x2 - x1, y2 - y1)
    if length == 0.0:
        return 0.0
    ux = (x2 - x1) / length
    uy = (y2 - y1) / length
    m = threats_in_reach(x1, y1, ux, uy, length, threats, active)
    n = _rivals(m, active, counts, rivals)
    if n == 0:
        return 0.0
    total = 0.0
    largest = rivals[0]
    begun = 0.0
    # with one rival there is nothing to cut
    start = 0.0 if n > 1 else length
    # no wider than the panels of `segment_risk`, which resolve ``F``
    deeper = deeper_of(threats)
    unit = math.exp(-deeper)
    panel_widths(m, length, 1.0, deeper, active)
    last = length
    known = False
    while start < length:
        end, any_here = panel_end(start, length, m, active)
        if any_here:
            end = min(end, start + GROWTH * last)
            n_pieces = 0
            while n_pieces == 0:
                last = end - start
                _sample(start, end, m, active, counts, n, work)
                n_pieces, n_winners = _crossings(start, end, length, n, unit, work)
                if n_pieces == 0:
                    end = 0.5 * (start + end)
            for piece in range(n_pieces):
                now = _winner(0.5 * (cuts[piece] + cuts[piece + 1]), n_winners, m, counts, work)
                if known and now != largest:
                    field = tables[rows[largest] : rows[largest + 1]], scratch, False, NO_RASTERS
                    total += _piece(x1, y1, ux, uy, begun, cuts[piece], field)
                    begun = cuts[piece]
                largest = now
                known = True
        start = end
    field = tables[rows[largest] : rows[largest + 1]], scratch, False, NO_RASTERS
    if begun == 0.0:
        return segment_risk(x1, y1, x2, y2, field, math.inf)
    return total + _piece(x1, y1, ux, uy, begun, length, field)

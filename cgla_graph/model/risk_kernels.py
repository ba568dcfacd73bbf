"""
Compiled kernels of the risk field: density, gradient and the line integral of one segment.

A field reaches a kernel as the table that `threat_table` makes, one row a threat. The integral of
``F = 1 - prod(1 - f_i)`` over a segment is exact up to pruning: of ``m`` threats, each that stays below
``CUTOFF / m`` along the whole segment (less for most ``m``, see `reach_class`) is left out, and so is every product
of threats below ``CUTOFF / m^2``. As ``0 <= prod(1 - f_j) <= 1``, a pruned product ``g`` together with all its
multiples changes the result by at most the integral of ``g``, about ``2.5 * spread`` times its height. At most
``4 m^2`` branches are cut, so that all cuts together change the result by less than ``13 * CUTOFF`` times the greatest
spread.

That is for fields of which a risk of 1 per unit length is the measure. Under a great risk weight, or where all threats
are weak, a fainter risk matters: then all cut-offs are lower by the factor `unit_of`, and sums of small risks are added
up as such, without the difference from 1 that would round them away.

The table of a mixture (`mixture_table`) has two columns more: its threats stand in groups, and its field is the
weighted sum ``sum_g w_g (1 - prod(1 - f_i))`` over the groups.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, cast

import numpy as np

from cgla_graph._kernel import Intrinsic, inlined, kernel
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.model.risk_raster_kernels import Rasters, raster_risk

CUTOFF = 1e-12
LOG_CUTOFF = math.log(CUTOFF)
#: Up to this risk weight, and down to one over it for the greatest peak, a risk of 1 is the measure of cut-offs.
ORDINARY = 1e3
X, Y, REACH2, PRECISION, LOG_PEAK, ROOT, SPREAD, DEEPER, WEIGHT, END = range(10)
#: Columns of the table of one field; that of a mixture also has the weight of the row's group, and the row after it.
OF_ONE = 8
#: What a threat is along one segment: a Gaussian at a distance from the start, felt between two others; its spread,
#: then how wide a panel of the quadrature may be there; how far to the left of the segment its centre is; and its row
#: in the table.
AT, PRECISION_AT, LOG_AMPLITUDE, ROOT_AT, LOW, HIGH, WIDTH_AT, LEFT, ROW = range(9)
N_NODES = 16
#: How many times as wide as a panel of `N_NODES` nodes one of twice as many may be.
LONG = 2.2
#: Points that are asked together: of so many in a row, threats out of reach of all are looked for once.
BLOCK = 64
#: Below the exponential of this, a threat is not felt: ``1 - f`` is rounded to 1.
LOG_UNFELT = -38.0

#: `threat_table`, a work space of `workspace`, whether a peak is above 1, and the rasters.
Field: TypeAlias = tuple[FloatArray, FloatArray, bool, Rasters]


def reach_class(n_threats: int) -> int:
    """
    Return the number of threats that the reach of each is made for: `n_threats` up to the next power of two, least 16.

    So a threat keeps its reach while others come and go, and a segment out of reach of what changed keeps its risk to
    the last bit.

    Examples
    --------
    >>> [reach_class(n) for n in (0, 16, 17)]
    [16, 16, 32]
    """
    return max(16, 1 << max(n_threats - 1, 0).bit_length())


def unit_of(greatest_peak: float, k: float) -> float:
    """
    Return the risk that is the measure of all cut-offs: 1, or a power of 1/1000 that is as faint as can matter.

    Under a risk weight `k`, what costs far less than the way itself does not matter; and of weak threats alone, what is
    far weaker than the strongest.

    Examples
    --------
    >>> unit_of(0.9, 10.0), unit_of(1e-12, 10.0), unit_of(0.9, 1e12)
    (1.0, 1e-12, 1e-09)
    """
    # (in steps, so that a threat keeps its reach while `k` and others change a little)
    of_peak = math.floor(math.log10(greatest_peak) / 3.0 + 1e-9) if greatest_peak < 1.0 / ORDINARY else 0
    of_weight = -math.ceil(math.log10(k) / 3.0 - 1.0 - 1e-9) if k > ORDINARY else 0
    return float(10.0 ** (3.0 * max(min(of_peak, of_weight), -100)))


def threat_table(threats: FloatArray, *, improper: bool, unit: float = 1.0) -> FloatArray:
    """
    Precompute what the kernels need of each threat.

    Parameters
    ----------
    threats
        Rows ``x, y, spread, peak``, shape ``(m, 4)``, map units (peak: risk per unit length).
    improper
        Whether peaks above 1 occur; then other factors may exceed 1 and the reach grows by their product.
    unit
        The measure of cut-offs (`unit_of`).

    Returns
    -------
    table
        Rows ``x, y, reach^2, 1 / spread^2, ln peak, 1 / (sqrt(2) spread), spread, -ln unit``, shape ``(m, 8)``.
    """
    x, y, spread, peak = threats.T
    growth = float(np.log1p(peak).sum()) if improper else 0.0
    deeper = -math.log(unit)
    log_cutoff = LOG_CUTOFF - math.log(reach_class(len(peak))) - deeper
    reach2 = 2.0 * spread**2 * np.maximum(np.log(peak) - log_cutoff + growth, 0.0)
    columns = [x, y, reach2, spread**-2.0, np.log(peak), math.sqrt(0.5) / spread, spread, np.full_like(x, deeper)]
    return np.ascontiguousarray(np.column_stack(columns))


def mixture_table(groups: Sequence[FloatArray], weights: Sequence[float]) -> FloatArray:
    """
    Join the tables of several fields to that of their weighted sum.

    Parameters
    ----------
    groups
        Tables of `threat_table`, none of them empty, with one unit.
    weights
        The weight of each, above 0.

    Returns
    -------
    table
        All rows, each with the weight of its group and the number of the row after the group's last: ``(m, 10)``.

    Examples
    --------
    >>> one, two = (threat_table(np.ones((m, 4)), improper=False) for m in (1, 2))
    >>> mixture_table([one, two], [0.25, 0.75])[:, WEIGHT:].tolist()
    [[0.25, 1.0], [0.75, 3.0], [0.75, 3.0]]
    """
    table = np.empty((sum(map(len, groups)), OF_ONE + 2))
    start = 0
    for group, weight in zip(groups, weights, strict=True):
        end = start + len(group)
        table[start:end, :OF_ONE], table[start:end, WEIGHT], table[start:end, END] = group, weight, end
        start = end
    return table


def workspace(n_threats: int) -> FloatArray:
    """Allocate the scratch memory that `segment_risk` needs for a field of `n_threats`, shape ``(2 m + 2, 16)``."""
    return np.empty((2 * n_threats + 2, N_NODES))


def _erf_taylor() -> FloatArray:
    """Tabulate Taylor coefficients of erf about ``i / 32`` (orders 0 to 7), shape ``(194, 8)``."""
    x = np.arange(194) / 32.0
    hermite = [np.ones_like(x), 2.0 * x]
    for order in range(2, 7):
        hermite.append(2.0 * x * hermite[-1] - 2.0 * (order - 1) * hermite[-2])
    slope = 2.0 / math.sqrt(math.pi) * np.exp(-x * x)
    rows = [np.array([math.erf(value) for value in x])]
    rows += [slope * (-1.0) ** (n - 1) * hermite[n - 1] / math.factorial(n) for n in range(1, 8)]
    return np.ascontiguousarray(np.stack(rows, axis=1))


_ERF = _erf_taylor()
LOG2_E = 1.0 / math.log(2.0)
#: The polynomial that differs least from ``2^x``, relatively, for ``|x| <= 1/2``.
_E0, _E1, _E2, _E3 = 1.0000000000000127, 0.693147180559871, 0.24022650695649653, 0.05550410866868562
_E4, _E5, _E6 = 0.00961812919206719, 0.0013333557617603226, 0.00015403434948103767
_E7, _E8, _E9 = 1.5252984839481885e-05, 1.325940560405559e-06, 1.0150336545923619e-07
#: Added to a number, it leaves the nearest whole number in the last bits of the sum.
_ROUND = 1.5 * 2.0**52
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(N_NODES)
#: Of twice as many nodes, those above 0, their squares, and their weights.
_LONG_NODES, _LONG_WEIGHTS = (part[N_NODES:].copy() for part in np.polynomial.legendre.leggauss(2 * N_NODES))
_SQUARES = _LONG_NODES * _LONG_NODES


@kernel
def erf(x: float) -> float:
    """Evaluate the error function within 2e-16: a local Taylor series, three times as fast as the C library."""
    a = abs(x)
    if a >= 6.0:
        value = 1.0
    else:
        i = int(a * 32.0 + 0.5)
        d = a - i * 0.03125
        c = _ERF[i]
        value = c[0] + d * (c[1] + d * (c[2] + d * (c[3] + d * (c[4] + d * (c[5] + d * (c[6] + d * c[7]))))))
    return value if x >= 0.0 else -value


@kernel
def erf_sum(a: float, b: float) -> float:
    """Evaluate ``erf(a) + erf(b)`` for ``a + b > 0``, exact relative to itself where one is below 0."""
    low, high = min(a, b), max(a, b)
    return erf(low) + erf(high) if low > -1.0 else math.erfc(-low) - math.erfc(high)


@kernel
def deeper_of(table: FloatArray) -> float:
    """Return by how much the logarithms of all cut-offs are lower than usual."""
    return table[0, DEEPER] if table.shape[0] > 0 else 0.0


@kernel
def threats_near(low: tuple[float, float], high: tuple[float, float], table: FloatArray, near: IntArray) -> int:
    """Write the rows of the threats that may be felt in a box to `near`, shape ``(m,)``; return how many they are."""
    count = 0
    for i in range(table.shape[0]):
        dx = max(low[0] - table[i, X], table[i, X] - high[0], 0.0)
        dy = max(low[1] - table[i, Y], table[i, Y] - high[1], 0.0)
        exponent = table[i, LOG_PEAK] - 0.5 * table[i, PRECISION] * (dx * dx + dy * dy)
        if exponent + table[i, DEEPER] > LOG_UNFELT:
            near[count] = i
            count += 1
    return count


@kernel
def density(points: FloatArray, table: FloatArray, out: FloatArray) -> None:
    """Write ``F = 1 - prod(1 - f_i)`` of threats (Eq. 2) at `points`, shape ``(n, 2)``, to `out`, shape ``(n,)``."""
    if table.shape[1] == OF_ONE:
        _density_of_one(points, table, out)
        return
    out[:] = 0.0
    part = np.empty(out.shape[0])
    start = 0
    while start < table.shape[0]:
        end = int(table[start, END])
        _density_of_one(points, table[start:end], part)
        for n in range(out.shape[0]):
            out[n] += table[start, WEIGHT] * part[n]
        start = end


@kernel
def _density_of_one(points: FloatArray, table: FloatArray, out: FloatArray) -> None:
    """Write the ``F`` of one group of threats: `density`."""
    near = np.empty(table.shape[0], dtype=np.int64)
    deeper = deeper_of(table)
    unfelt = LOG_UNFELT - deeper
    for first in range(0, points.shape[0], BLOCK):
        stop = min(first + BLOCK, points.shape[0])
        left, right, bottom, top = math.inf, -math.inf, math.inf, -math.inf
        for n in range(first, stop):
            left = min(left, points[n, 0])
            right = max(right, points[n, 0])
            bottom = min(bottom, points[n, 1])
            top = max(top, points[n, 1])
        count = threats_near((left, bottom), (right, top), table, near)
        for n in range(first, stop):
            clear, risk = 1.0, 0.0
            for j in range(count):
                i = near[j]
                dx = points[n, 0] - table[i, X]
                dy = points[n, 1] - table[i, Y]
                exponent = table[i, LOG_PEAK] - 0.5 * table[i, PRECISION] * (dx * dx + dy * dy)
                if exponent > unfelt:
                    f = math.exp(exponent)
                    risk = fma(f, clear, risk)
                    clear *= 1.0 - f
            out[n] = risk if deeper > 0.0 else 1.0 - clear


@kernel
def gradient(points: FloatArray, table: FloatArray, out: FloatArray) -> None:
    """Write the gradient of the ``F`` of threats at `points`, shape ``(n, 2)``, to `out`, shape ``(n, 2)``."""
    if table.shape[1] == OF_ONE:
        _gradient_of_one(points, table, out)
        return
    out[:] = 0.0
    part = np.empty(out.shape)
    start = 0
    while start < table.shape[0]:
        end = int(table[start, END])
        _gradient_of_one(points, table[start:end], part)
        for n in range(out.shape[0]):
            out[n, 0] += table[start, WEIGHT] * part[n, 0]
            out[n, 1] += table[start, WEIGHT] * part[n, 1]
        start = end


@kernel
def _gradient_of_one(points: FloatArray, table: FloatArray, out: FloatArray) -> None:
    """Write the gradient of one group of threats: `gradient`."""
    for n in range(points.shape[0]):
        gx, gy, clear = 0.0, 0.0, 1.0
        for i in range(table.shape[0]):
            dx = points[n, 0] - table[i, X]
            dy = points[n, 1] - table[i, Y]
            f = math.exp(table[i, LOG_PEAK] - 0.5 * table[i, PRECISION] * (dx * dx + dy * dy))
            # the product rule for prod(1 - f_i), without a division: f_i may be 1
            slope = -clear * f * table[i, PRECISION]
            gx = gx * (1.0 - f) + slope * dx
            gy = gy * (1.0 - f) + slope * dy
            clear *= 1.0 - f
        out[n, 0] = gx
        out[n, 1] = gy


@kernel
def _closed_form(
    length: float, m: int, active: FloatArray, stack: FloatArray, log_cutoff: float, budget: int, deeper: float
) -> float:
    r"""
    Sum the inclusion-exclusion terms of the `m` active threats, or return -1 after `budget` terms.

    Along the segment, threat ``i`` is a Gaussian of amplitude ``a_i``, centre ``t_i`` and precision ``q_i``. A
    product of Gaussians is one again: precisions add, centres average, and the amplitude shrinks by
    ``exp(-q p (t - s)^2 / (2 (q + p)))``. The sets are walked depth first; a set below the cutoff ends its branch.
    """
    total = 0.0
    # (erfc of that is 2e-15 times the unit)
    tail = -math.sqrt(31.36 + deeper)
    depth = 0
    n_terms = 0
    j = 0
    while True:
        if j < m:
            above = True
            if depth == 0:
                centre = active[j, AT]
                precision = active[j, PRECISION_AT]
                log_amplitude = active[j, LOG_AMPLITUDE]
                root = active[j, ROOT_AT]
            else:
                p = stack[depth, PRECISION_AT]
                q = active[j, PRECISION_AT]
                precision = p + q
                distance = stack[depth, AT] - active[j, AT]
                log_amplitude = stack[depth, LOG_AMPLITUDE] + active[j, LOG_AMPLITUDE]
                # the test is free of division: most pairs end here
                above = 2.0 * (log_amplitude - log_cutoff) * precision > p * q * distance * distance
                if above:
                    inverse = 1.0 / precision
                    log_amplitude -= 0.5 * p * q * inverse * distance * distance
                    centre = (p * stack[depth, AT] + q * active[j, AT]) * inverse
                    root = math.sqrt(0.5 * precision)
            if above:
                after = (length - centre) * root
                before = centre * root
                if after > tail and before > tail:
                    n_terms += 1
                    if n_terms > budget:
                        return -1.0
                    both = erf_sum(after, before) if deeper > 0.0 else erf(after) + erf(before)
                    term = math.exp(log_amplitude) / root * both
                    total += -term if depth & 1 else term
                    depth += 1
                    stack[depth, AT] = centre
                    stack[depth, PRECISION_AT] = precision
                    stack[depth, LOG_AMPLITUDE] = log_amplitude
                    stack[depth, LOW] = j
            j += 1
        elif depth == 0:
            # sqrt(pi) / 2, from the integral of exp(-x^2)
            return total * 0.886226925452758
        else:
            j = int(stack[depth, LOW]) + 1
            depth -= 1


def _fma(_typing: Any, _x: Any, _y: Any, _z: Any) -> Any:  # noqa: ANN401 - numba has no hints
    """
    Multiply and add with one rounding: ``x * y + z``.

    One instruction where the processor has it, else a call of the C library: slow, yet the same float. To let the
    compiler fuse where it likes would be as fast, but then a segment might get another float in another kernel.
    """
    from numba import types  # noqa: PLC0415 - numba is imported when it compiles

    real = types.float64
    return real(real, real, real), lambda _context, builder, _signature, arguments: builder.fma(*arguments)


fma = cast("Callable[[float, float, float], float]", Intrinsic(_fma))


def _scaled(_typing: Any, _x: Any, _n: Any) -> Any:  # noqa: ANN401 - numba has no hints
    """
    Multiply `x` by ``2^n``, where the second argument is ``n + _ROUND``: shifts its last bits to the exponent of `x`.

    Only for results that are neither infinite nor subnormal.
    """
    from numba import types  # noqa: PLC0415 - the same

    real = types.float64

    def generate(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:  # noqa: ANN401
        whole = context.get_value_type(types.int64)
        x, shifted = (builder.bitcast(argument, whole) for argument in arguments)
        power = builder.shl(shifted, context.get_constant(types.int64, 52))
        return builder.bitcast(builder.add(x, power), arguments[0].type)

    return real(real, real), generate


scaled = cast("Callable[[float, float], float]", Intrinsic(_scaled))


@kernel
def exp2(x: float) -> float:
    """
    Evaluate ``2^x`` within a relative error of 2e-14, by arithmetic that the compiler turns into vectors.

    `x` is below 1023; below -1000 it counts as that, where the power is as good as 0.
    """
    x = max(x, -1000.0)
    shifted = x + _ROUND
    r = x - (shifted - _ROUND)
    power = fma(r, fma(r, fma(r, fma(r, fma(r, _E9, _E8), _E7), _E6), _E5), _E4)
    return scaled(fma(r, fma(r, fma(r, fma(r, power, _E3), _E2), _E1), _E0), shifted)


@kernel
def threats_in_reach(
    x1: float, y1: float, ux: float, uy: float, length: float, table: FloatArray, active: FloatArray
) -> int:
    """
    Describe the threats that reach a segment as Gaussians along it, and count them.

    Where each begins and ends is left to `panel_width`; until then, `HIGH` is the square of half the length that it
    reaches along the line. `active` has a row for each threat, of 9 columns or more.
    """
    m = int(np.int64(0))
    # (no branches: which threats are in reach is a coin toss. A row that is not kept is written over)
    for i in range(table.shape[0]):
        rx = table[i, X] - x1
        ry = table[i, Y] - y1
        t = rx * ux + ry * uy
        left = ry * ux - rx * uy
        beyond = max(-t, t - length, 0.0)
        active[m, AT] = t
        active[m, LEFT] = left
        active[m, ROW] = i
        m += int(left * left + beyond * beyond < table[i, REACH2])
    for j in range(m):
        i = int(active[j, ROW])
        left = active[j, LEFT]
        active[j, PRECISION_AT] = table[i, PRECISION]
        active[j, LOG_AMPLITUDE] = table[i, LOG_PEAK] - 0.5 * left * left * table[i, PRECISION]
        active[j, ROOT_AT] = table[i, ROOT]
        active[j, HIGH] = table[i, REACH2] - left * left
        active[j, WIDTH_AT] = table[i, SPREAD]
    return m


@kernel
def panel_widths(m: int, length: float, share: float, deeper: float, active: FloatArray) -> None:
    """
    Say where the `m` active threats begin and end, and how wide a panel of the quadrature may be for each.

    The error of 16 nodes on a Gaussian falls with the width of the panel: to keep it below 1e-12 of the spread, a panel
    may be 5 spreads wide where the threat has an amplitude of 1 on the segment, 7 at 1e-4, 20 at 1e-12. The errors of
    faint threats add up, so each has its share of that. All that is relative to the unit, whose logarithm is `-deeper`.
    Where threats overlap, ``F`` is steeper than each of them: on a Bernstein ellipse around the panel it may be as
    large as the exponential of the sum of their amplitudes. Panels are narrower by the logarithm of that sum, the more
    the more threats make it up (as many equal ones as would have the same sum and sum of squares). The factors are
    measured, on up to 100 threats on one spot and beside it, of peaks down to 1e-8 and spreads that differ up to ten
    times: the error is below 4e-12 of the greatest spread. Panels are `share` as wide as that. With twice as many
    nodes, one threat would allow 2.45 times as much, crowds 2.2 (`LONG`).
    """
    if m == 0:
        return
    crowd, squares = 0.0, 0.0
    log_m = math.log(m) + deeper
    for i in range(m):
        half = math.sqrt(active[i, HIGH])
        at = active[i, AT]
        active[i, LOW] = at - half
        active[i, HIGH] = at + half
        beyond = at if at < 0.0 else max(at - length, 0.0)
        log_amplitude = active[i, LOG_AMPLITUDE] - 0.5 * active[i, PRECISION_AT] * beyond * beyond
        if log_amplitude > 0.0:
            # (its square has to stay finite)
            amplitude = math.exp(min(log_amplitude, 300.0))
        else:
            # (no less than the exponential, and sooner done)
            root = 1.0 - 0.25 * log_amplitude + 0.03125 * log_amplitude * log_amplitude
            root *= root
            amplitude = 1.0 / (root * root)
            log_amplitude = min(log_amplitude + log_m, 0.0)
        crowd += amplitude
        squares += amplitude * amplitude
        active[i, WIDTH_AT] *= share * 19.6 / (3.826 + 0.1058 * max(log_amplitude, -26.7))
    narrower = 1.0 / (1.0 + math.log(1.0 + crowd) * (0.3 + 0.09 * math.log(crowd * crowd / squares)))
    # a spread far below the length gathers next to nothing, yet panels have to get on
    least = 1e-12 * length
    for i in range(m):
        active[i, WIDTH_AT] = max(active[i, WIDTH_AT] * narrower, least)


@kernel
def panel_end(start: float, length: float, m: int, active: FloatArray) -> tuple[float, bool]:
    """
    Return where the panel that begins at `start` ends, and whether any threat is in it.

    It is no wider than any threat active in it allows, and ends where another begins.
    """
    end = length
    any_here = False
    # (no branches: which threats are here is a coin toss)
    for i in range(m):
        ahead = active[i, HIGH] > start
        end = min(end, max(start + active[i, WIDTH_AT], active[i, LOW]) if ahead else length)
        any_here |= ahead & (active[i, LOW] <= start)
    if not any_here:
        end = length
        for i in range(m):
            if active[i, LOW] > start:
                end = min(end, active[i, LOW])
    return end, any_here


@kernel
def _deep_panel(count: int, exponents: FloatArray) -> float:
    """Sum ``F`` over the nodes of a panel as such: a small risk is not rounded away beside 1."""
    panel = 0.0
    for k in range(N_NODES):
        before, after = 0.0, 0.0
        for j in range(count):
            mean = fma(exponents[j, 2], _SQUARES[k], exponents[j, 0])
            before = fma(exp2(fma(-exponents[j, 1], _LONG_NODES[k], mean)), 1.0 - before, before)
            after = fma(exp2(fma(exponents[j, 1], _LONG_NODES[k], mean)), 1.0 - after, after)
        panel += _LONG_WEIGHTS[k] * (before + after)
    return panel


@kernel
def _quadrature(length: float, m: int, active: FloatArray, scratch: FloatArray, most: float, deep: bool) -> float:
    """
    Integrate by Gauss-Legendre on panels (`panel_end`) that adapt to the threats at hand, up to `most`.

    Panels are made for 32 nodes; of short ones, 16 do. With ``u`` from -1 to 1 along a panel, the exponent of a threat
    is ``constant + odd u + even u^2``: nodes at ``u`` and ``-u`` share a part of it.
    """
    before, after = scratch[0], scratch[scratch.shape[0] - 1]
    first = scratch.shape[0] // 2
    total = 0.0
    start = 0.0
    while start < length and total <= most:
        end, any_here = panel_end(start, length, m, active)
        if any_here:
            half = 0.5 * (end - start)
            middle = 0.5 * (end + start)
            # (which threats are here is a coin toss: they are listed without branches)
            short = True
            count = int(np.int64(0))
            for i in range(m):
                off = middle - active[i, AT]
                bits = -0.5 * LOG2_E * active[i, PRECISION_AT]
                even = bits * half * half
                scratch[first + count, 0] = fma(bits * off, off, LOG2_E * active[i, LOG_AMPLITUDE])
                scratch[first + count, 1] = 2.0 * bits * off * half
                scratch[first + count, 2] = even
                # (one far narrower than the narrowest panel there is would drown in rounding)
                here = (active[i, LOW] < end) & (active[i, HIGH] > start) & (even > -1e4)
                short &= (not here) | (LONG * (end - start) <= active[i, WIDTH_AT])
                count += int(here)
            for k in range(N_NODES):
                before[k] = 1.0
                after[k] = 1.0
            panel = 0.0
            if deep:
                panel = _deep_panel(count, scratch[first:])
            elif short:
                for j in range(count):
                    constant, odd, even = scratch[first + j, 0], scratch[first + j, 1], scratch[first + j, 2]
                    for k in range(N_NODES):
                        f = exp2(fma(fma(even, _NODES[k], odd), _NODES[k], constant))
                        before[k] = fma(-f, before[k], before[k])
                for k in range(N_NODES):
                    panel += _WEIGHTS[k] * (1.0 - before[k])
            else:
                for j in range(count):
                    constant, odd, even = scratch[first + j, 0], scratch[first + j, 1], scratch[first + j, 2]
                    for k in range(N_NODES):
                        mean = fma(even, _SQUARES[k], constant)
                        f = exp2(fma(-odd, _LONG_NODES[k], mean))
                        before[k] = fma(-f, before[k], before[k])
                        f = exp2(fma(odd, _LONG_NODES[k], mean))
                        after[k] = fma(-f, after[k], after[k])
                for k in range(N_NODES):
                    panel += _LONG_WEIGHTS[k] * (2.0 - before[k] - after[k])
            total += half * panel
        start = end
    return total


@kernel
def segment_risk(x1: float, y1: float, x2: float, y2: float, field: Field, most: float) -> float:
    """
    Integrate the risk field over the straight segment from ``(x1, y1)`` to ``(x2, y2)`` (Eq. 6).

    Of threats, the closed form serves where few overlap, quadrature where many do (its error: `panel_widths`).
    The risk of rasters is added. The ends are put in one order first, so that both directions give the same float.
    More risk than `most` need not be told: then the answer is some value between `most` and the integral.
    """
    if x2 < x1 or (x2 == x1 and y2 < y1):
        x1, x2 = x2, x1
        y1, y2 = y2, y1
    length = math.hypot(x2 - x1, y2 - y1)
    if length == 0.0:
        return 0.0
    table, scratch, improper, rasters = field
    of_rasters = raster_risk(x1, y1, x2, y2, rasters)
    ux = (x2 - x1) / length
    uy = (y2 - y1) / length
    if table.shape[1] > OF_ONE:
        return _mixed_risk(x1, y1, ux, uy, length, table, scratch) + of_rasters
    return _risk_of_one(x1, y1, ux, uy, length, table, scratch, improper, most - of_rasters) + of_rasters


@inlined
def _risk_of_one(
    x1: float,
    y1: float,
    ux: float,
    uy: float,
    length: float,
    table: FloatArray,
    scratch: FloatArray,
    improper: bool,
    most: float,
) -> float:
    """Integrate one group of threats along a segment from ``(x1, y1)`` in the direction ``(ux, uy)``."""
    active = scratch[1 : 1 + table.shape[0]]
    m = threats_in_reach(x1, y1, ux, uy, length, table, active)
    if m == 0:
        return 0.0
    deeper = deeper_of(table)
    if not improper:
        # A term of the closed form costs about as much as one threat in one panel of the quadrature.
        log_cutoff = LOG_CUTOFF - 2.0 * math.log(m) - deeper
        n_pairs = 0
        most_pairs = (3 * m) // 2
        for i in range(m):
            if n_pairs > most_pairs:
                break
            for j in range(i):
                q = active[i, PRECISION_AT] * active[j, PRECISION_AT]
                d = active[i, AT] - active[j, AT]
                room = active[i, LOG_AMPLITUDE] + active[j, LOG_AMPLITUDE] - log_cutoff
                if 2.0 * room * (active[i, PRECISION_AT] + active[j, PRECISION_AT]) > q * d * d:
                    n_pairs += 1
        if n_pairs <= most_pairs:
            value = _closed_form(length, m, active, scratch[1 + table.shape[0] :], log_cutoff, 4 * m, deeper)
            if value >= 0.0:
                return value
    panel_widths(m, length, 0.5 * LONG if improper else LONG, deeper, active)
    # (where peaks are above 1, there is negative risk to come)
    return _quadrature(length, m, active, scratch, math.inf if improper else most, deeper > 0.0)


@kernel
def _mixed_risk(
    x1: float, y1: float, ux: float, uy: float, length: float, table: FloatArray, scratch: FloatArray
) -> float:
    """Integrate the threats of a mixture: `_risk_of_one`, summed over its groups."""
    total, start = 0.0, 0
    while start < table.shape[0]:
        end = int(table[start, END])
        work = scratch[: 2 * (end - start) + 2]
        of_group = _risk_of_one(x1, y1, ux, uy, length, table[start:end], work, improper=False, most=math.inf)
        total += table[start, WEIGHT] * of_group
        start = end
    return total


@kernel
def segment_cost(x1: float, y1: float, x2: float, y2: float, k: float, field: Field) -> float:
    """Evaluate Eq. 5 for one segment: its length plus `k` times its risk."""
    length = math.hypot(x2 - x1, y2 - y1)
    return length + k * segment_risk(x1, y1, x2, y2, field, math.inf) if k > 0.0 else length


@kernel
def segment_risks(starts: FloatArray, ends: FloatArray, field: Field, out: FloatArray) -> None:
    """Write `segment_risk` of `n` segments, shapes ``(n, 2)``, to `out`, shape ``(n,)``."""
    for n in range(starts.shape[0]):
        out[n] = segment_risk(starts[n, 0], starts[n, 1], ends[n, 0], ends[n, 1], field, math.inf)

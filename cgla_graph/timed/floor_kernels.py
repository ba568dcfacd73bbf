r"""
Compiled kernels of lower bounds of moving risk on cells of space and time.

**Linear floor.** On a cell, let ``d`` be the way from its middle, ``|d| <= R``, and ``tau`` the time from it, ``|tau|
<= T``. A threat moves by ``u tau`` meanwhile, so that ``delta = d - u tau`` counts, ``|delta| <= D = R + |u| T``. The
logarithm of ``f`` is at least its value in the middle, plus a linear function that is at most `A` in size, less ``B /
2`` (`_shape`). As ``exp(x) >= 1 + x``, ``1 - f <= w(1)`` with ``w(s) = 1 - f_0 (1 + A s - B s^2 / 2)`` along the line
from the middle. So the product of ``1 - f_i`` exceeds its tangent by at most half of the greatest second derivative of
the product of the ``w_i``, which the product rule bounds.

**Constant floor.** ``f >= f_0 exp(-(A + B / 2))``, and ``1 - prod(1 - f_i)`` rises with each ``f_i``.

Threats left out lower the risk, and so no floor is too high without them.
"""

import math

import numpy as np

from cgla_graph._kernel import inlined, kernel
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph.model.risk_raster_kernels import raster_floor

#: Columns of threats in a slab of time: place, velocity, spread and its rate, peak and its rate.
X, Y, VX, VY, SPREAD, SPREAD_RATE, PEAK, PEAK_RATE = range(8)
#: A threat below the exponential of this is left out, with its sign turned.
FAINT = 40.0
#: Numbers of a floor: risk in the middle, its slopes along x, y and t, by how much it may be below that linear
#: function, and what it is at least.
FLOOR = 6


@kernel
def _shape(threat: FloatArray, r: float, reach: float, half_time: float) -> tuple[float, float, float]:
    """
    Describe how a threat's logarithm changes on a cell whose middle is `r` from it.

    With ``q = 1 / s^2 <= q_0 + q_1 tau + q_2 tau^2 / 2``, the logarithm is ``log p - q |r + delta|^2 / 2``.

    Returns
    -------
    linear, bend
        `A` and `B`.
    q_1
        See above.
    """
    spread, peak = threat[SPREAD], threat[PEAK]
    q = 1.0 / (spread * spread)
    big = reach + math.hypot(threat[VX], threat[VY]) * half_time
    linear, bend, q1 = q * r * big, q * big * big, 0.0
    if threat[SPREAD_RATE] != 0.0:
        least = spread - abs(threat[SPREAD_RATE]) * half_time
        if least <= 0.0:
            return math.inf, math.inf, 0.0
        q1 = -2.0 * threat[SPREAD_RATE] * q / spread
        q2 = 6.0 * threat[SPREAD_RATE] * threat[SPREAD_RATE] / (least * least * least * least)
        linear += 0.5 * abs(q1) * half_time * r * r
        bend += abs(q1) * half_time * (2.0 * r * big + big * big)
        bend += 0.5 * q2 * half_time * half_time * (r + big) * (r + big)
    if threat[PEAK_RATE] != 0.0:
        least = peak - abs(threat[PEAK_RATE]) * half_time
        if least <= 0.0:
            return math.inf, math.inf, 0.0
        linear += abs(threat[PEAK_RATE]) / peak * half_time
        bend += threat[PEAK_RATE] * threat[PEAK_RATE] / (least * least) * half_time * half_time
    # (places, times and these sums are rounded)
    return linear * (1.0 + 2.0**-44), bend * (1.0 + 2.0**-44), q1


@kernel
def moving_floor(x: float, y: float, reach: float, half_time: float, threats: FloatArray, out: FloatArray) -> None:
    """
    Bound the risk of threats from below on a cell.

    Parameters
    ----------
    x, y
        Its middle, map units.
    reach
        Half its diagonal in space.
    half_time
        Half its duration.
    threats
        Shape ``(m, 8)``, at the middle of its time.
    out
        The floor, shape ``(6,)``.
    """
    shares, slopes, squares = 0.0, 0.0, 0.0
    gx, gy, gt, clear, most, risk, floor = 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0
    first, second, rest = math.inf, math.inf, 1.0
    for i in range(threats.shape[0]):
        threat = threats[i]
        dx, dy = x - threat[X], y - threat[Y]
        r2 = dx * dx + dy * dy
        q = 1.0 / (threat[SPREAD] * threat[SPREAD])
        # (one without a peak fills a row)
        if not 0.5 * q * r2 < FAINT or threat[PEAK] <= 0.0:
            continue
        linear, bend, q1 = _shape(threat, math.sqrt(r2), reach, half_time)
        if linear == math.inf:
            continue
        f = threat[PEAK] * math.exp(-0.5 * q * r2)
        shares += f * bend
        slope = f * (linear + bend)
        slopes += slope
        squares += slope * slope
        factor = 1.0 - f + f * (linear + 0.5 * bend)
        if factor < first:
            first, factor = factor, first
        if factor < second:
            second, factor = factor, second
        if factor < math.inf:
            rest *= factor
        rate = q * (dx * threat[VX] + dy * threat[VY]) + threat[PEAK_RATE] / threat[PEAK] - 0.5 * q1 * r2
        gx = gx * (1.0 - f) - clear * f * q * dx
        gy = gy * (1.0 - f) - clear * f * q * dy
        gt = gt * (1.0 - f) + clear * f * rate
        risk += clear * f
        clear *= 1.0 - f
        least = f * math.exp(-min(linear + 0.5 * bend, 700.0))
        floor += most * least
        most *= 1.0 - least
    bend = rest * ((second if second < math.inf else 1.0) * shares + slopes * slopes - squares)
    blur = 2.0**-46 * (risk + abs(x * gx) + abs(y * gy))
    out[0], out[1], out[2], out[3] = risk, gx, gy, gt
    out[4] = math.inf if math.isnan(bend) else 0.5 * bend * (1.0 + 2.0**-40) + blur
    out[5] = floor * (1.0 - 2.0**-40)


@inlined
def _form(toll: FloatArray, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the product of two vectors by the quadratic form of a toll."""
    return float(toll[4] * ax * bx + toll[5] * (ax * by + ay * bx) + toll[6] * ay * by)


@kernel
def toll_floor(x: float, y: float, reach: float, half_time: float, tolls: FloatArray, out: FloatArray) -> None:
    """
    Bound tolls from below on a cell, as `moving_floor` bounds threats: value in the middle, slopes along x, y and t.

    With a price ``p + p_1 tau``, a toll is at least ``(p + p_1 tau) (1 - |r + delta|^2)``, in the norm of its form, `r`
    from its centre. But for ``- p |delta|^2 - p_1 tau (2 r . delta + |delta|^2)``, this is linear. Where that bound is
    below 0 in the middle, it is replaced by 0.

    Parameters
    ----------
    x, y, reach, half_time
        As of `moving_floor`.
    tolls
        At the middle of its time (`tolls.tolls_from`), shape ``(m, 9)``.
    out
        The floor, shape ``(4,)``.
    """
    out[:] = 0.0
    for i in range(tolls.shape[0]):
        toll = tolls[i]
        price, rate = toll[7], toll[8]
        dx, dy = x - toll[X], y - toll[Y]
        wide = 0.5 * (toll[4] + toll[6]) + math.hypot(0.5 * (toll[4] - toll[6]), toll[5])
        far = _form(toll, dx, dy, dx, dy)
        if not far < 1.0:
            continue
        big = math.sqrt(wide) * reach + math.sqrt(_form(toll, toll[VX], toll[VY], toll[VX], toll[VY])) * half_time
        change = abs(rate) * half_time
        drop = price * big * big + change * big * (2.0 * math.sqrt(far) + big)
        gx, gy = -2.0 * price * (toll[4] * dx + toll[5] * dy), -2.0 * price * (toll[5] * dx + toll[6] * dy)
        # (places, times and these sums are rounded)
        blur = 2.0**-40 * (drop + (price + change) * (1.0 + far)) + 2.0**-46 * (abs(x * gx) + abs(y * gy))
        value = price * (1.0 - far) - drop - blur
        if value > 0.0:
            out[0] += value
            out[1] += gx
            out[2] += gy
            out[3] += rate * (1.0 - far) - gx * toll[VX] - gy * toll[VY]


@kernel
def node_tolls(
    x_first: float,
    y_first: float,
    step: float,
    begin: WholeArray,
    end: WholeArray,
    tolls: FloatArray,
    unit: float,
    out: FloatArray,
) -> None:
    """Add tolls times `unit` at the nodes of one layer to `out`, as `node_risks` writes risks."""
    for m in range(tolls.shape[0]):
        for j in range(out.shape[0]):
            for i in range(begin[j], end[j]):
                dx, dy = x_first + i * step - tolls[m, X], y_first + j * step - tolls[m, Y]
                out[j, i] += unit * tolls[m, 7] * max(1.0 - _form(tolls[m], dx, dy, dx, dy), 0.0)


@kernel
def raster_floors(
    x_first: float,
    y_first: float,
    step: float,
    bounds: tuple[float, float, float, float],
    rasters: FloatArray,
    out: FloatArray,
) -> None:
    """Bound rasters from below on each cell inside the bounds: value, slopes, drop, least, shape ``(rows, n, 5)``."""
    for j in range(out.shape[0]):
        for i in range(out.shape[1]):
            x, y = x_first + i * step, y_first + j * step
            low = max(x - 0.5 * step, bounds[0]), max(y - 0.5 * step, bounds[1])
            high = min(x + 0.5 * step, bounds[2]), min(y + 0.5 * step, bounds[3])
            if low[0] < high[0] and low[1] < high[1]:
                at_x, at_y = min(max(x, low[0]), high[0]), min(max(y, low[1]), high[1])
                value, slope_x, slope_y, drop, least = raster_floor(low, high, at_x, at_y, rasters)
                out[j, i, 0] = value + slope_x * (x - at_x) + slope_y * (y - at_y)
                out[j, i, 1], out[j, i, 2], out[j, i, 3], out[j, i, 4] = slope_x, slope_y, drop, least


@kernel
def least_near(x: float, y: float, reach: float, half_time: float, threats: FloatArray) -> float:
    """
    Bound the risk of threats from below on a disc for a time, by the least of each threat.

    A threat's centre moves straight on, so that it is farthest from the disc at the beginning or at the end.
    """
    most, floor = 1.0, 0.0
    for i in range(threats.shape[0]):
        threat = threats[i]
        spread = threat[SPREAD] - abs(threat[SPREAD_RATE]) * half_time
        peak = threat[PEAK] - abs(threat[PEAK_RATE]) * half_time
        if spread <= 0.0 or peak <= 0.0:
            continue
        far = 0.0
        for side in range(-1, 2, 2):
            dx = x - threat[X] - side * half_time * threat[VX]
            dy = y - threat[Y] - side * half_time * threat[VY]
            far = max(far, math.hypot(dx, dy) + reach)
        far *= (1.0 + 2.0**-44) / spread
        least = peak * math.exp(-0.5 * min(far * far, 1000.0)) * (1.0 - 2.0**-40)
        floor += most * least
        most *= 1.0 - least
    return float(floor)


@kernel
def node_risks(
    x_first: float,
    y_first: float,
    step: float,
    begin: WholeArray,
    end: WholeArray,
    threats: FloatArray,
    still: FloatArray,
    out: FloatArray,
) -> None:
    """Write the risk at the nodes of one layer to `out`, from column `begin` to `end` of each row, both ``(rows,)``."""
    for j in range(out.shape[0]):
        y = y_first + j * step
        for i in range(begin[j], end[j]):
            x = x_first + i * step
            clear = 1.0
            for m in range(threats.shape[0]):
                dx, dy = x - threats[m, X], y - threats[m, Y]
                exponent = 0.5 * (dx * dx + dy * dy) / (threats[m, SPREAD] * threats[m, SPREAD])
                if exponent < FAINT:
                    clear *= 1.0 - threats[m, PEAK] * math.exp(-exponent)
            out[j, i] = 1.0 - clear + still[j, i]


@kernel
def end_formula(
    x: float,
    y: float,
    rim: float,
    reach: float,
    half_time: float,
    k: float,
    threats: FloatArray,
    raster: FloatArray,
    out: FloatArray,
) -> float:
    """
    Find a lower bound ``psi`` of the cost of paths to an end from nearby, as `certificate.tips.EndFormula` is one.

    Up to `reach` the cost of a unit of length is at least ``c_0 + g . d - H r^2 / 2`` at ``d`` from the end, ``r =
    |d|``, during a time. Then ``psi = c_0 r + r (g . d) / 2 - beta r^3 / 3``. Where this formula is no better, ``g``
    and `beta` are 0 and ``c_0`` is the least cost.

    Parameters
    ----------
    x, y
        The end.
    rim
        Where the bound is needed, map units.
    reach
        Of the disc, more than `rim`.
    half_time
        Half of the time.
    k
        Risk weight, for a unit of length.
    threats
        In the middle of the time.
    raster
        Floor of the rasters on the disc: value and slopes at the end, drop, and least, shape ``(5,)``.
    out
        ``c_0, g, beta``, and the least cost on the disc, shape ``(5,)``.

    Returns
    -------
    leaving
        No path that leaves the disc on its way from the rim to the end costs less.
    """
    floor = np.empty(6)
    rings = 16
    moving_floor(x, y, 0.25 * reach, half_time, threats, floor)
    inner = floor[4]
    bend = 0.0
    for ring in range(5, rings + 1):
        moving_floor(x, y, reach * ring / rings, half_time, threats, floor)
        bend = max(bend, 2.0 * k * (floor[4] - inner) / (reach * (ring - 1) / rings) ** 2)
    constant = 1.0 + k * (least_near(x, y, reach, half_time, threats) + raster[4])
    cost = 1.0 + k * (floor[0] + raster[0] - raster[3] - abs(floor[3]) * half_time - inner)
    gx, gy = k * (floor[1] + raster[1]), k * (floor[2] + raster[2])
    slope = math.hypot(gx, gy)
    least = cost - slope * reach - 0.5 * bend * reach * reach
    out[0], out[1], out[2], out[3], out[4] = constant, 0.0, 0.0, 0.0, max(least, constant)
    leaving = constant * (reach - rim) + constant * reach
    if least > 0.0 and slope * reach <= 2.0 * least:
        beta = 0.5 * bend + slope * slope / (4.0 * least)
        if cost * rim - beta * rim * rim * rim / 3.0 > constant * rim:
            out[0], out[1], out[2], out[3] = cost, gx, gy, beta
            leaving = max(least, constant) * (reach - rim)
            leaving += cost * reach - 0.5 * slope * reach * reach - beta * reach * reach * reach / 3.0
    return float(leaving)

"""
Compiled kernels of risk that moves: its integral along one piece of a timed path.

A piece lies between two events (`Slab`): it is flown, or waited, at constant speed over the ground, while each threat
moves at constant velocity. A threat of constant shape is then a Gaussian along the piece, as it is along a segment
while it stands still. So the panels of `risk_kernels` serve, with the motion relative to the threat: for a threat that
grows or shrinks too, whose panels are narrower.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray
from cgla_graph.model.risk_kernels import (
    AT,
    HIGH,
    LEFT,
    LOG_AMPLITUDE,
    LOG_CUTOFF,
    LONG,
    N_NODES,
    PRECISION_AT,
    ROW,
    WIDTH_AT,
    Field,
    X,
    Y,
    panel_end,
    panel_widths,
    segment_risk,
    threats_in_reach,
)
from cgla_graph.model.risk_raster_kernels import density_at, raster_risk

#: A moving threat within a slab: place, velocity, spread, its rate, peak, its rate.
MX, MY, VX, VY, WIDE, WIDE_RATE, HIGH_PEAK, PEAK_RATE = range(8)
#: A threat is felt within so many spreads, about.
REACH = 7.5
#: A relative motion below this part of a spread along a piece counts as none.
STILL = 1e-11
NODES, WEIGHTS = np.polynomial.legendre.leggauss(2 * N_NODES)


@kernel
def reach_constant(n_threats: int, deeper: float) -> float:
    """Return the logarithm of the risk below which one of so many threats is left out (`risk_kernels`)."""
    size = 16
    while size < n_threats:
        size *= 2
    return LOG_CUTOFF - math.log(float(size)) - deeper


@kernel
def moving_in_reach(
    x1: float,
    y1: float,
    step: tuple[float, float, float],
    length: float,
    moving: FloatArray,
    log_cutoff: float,
    active: FloatArray,
) -> int:
    """
    Describe the moving threats that reach a piece as Gaussians along it, and count them.

    Parameters
    ----------
    x1, y1
        Where the piece begins.
    step
        What changes in a unit of the piece's parameter: place, and time.
    length
        The piece ends at that parameter.
    moving
        The threats (`motion_in_slab`) when the piece begins.
    log_cutoff
        From `reach_constant`.
    active
        Rows as of `threats_in_reach`. One of a threat that changes its shape is that of a Gaussian that is nowhere
        lower, and its panels are as narrow as it needs.
    """
    m = int(np.int64(0))
    for i in range(moving.shape[0]):
        rx, ry = moving[i, MX] - x1, moving[i, MY] - y1
        ux, uy = step[0] - step[2] * moving[i, VX], step[1] - step[2] * moving[i, VY]
        widening = step[2] * moving[i, WIDE_RATE]
        last_spread = moving[i, WIDE] + length * widening
        spread, least = max(moving[i, WIDE], last_spread), min(moving[i, WIDE], last_spread)
        log_peak = math.log(max(moving[i, HIGH_PEAK], moving[i, HIGH_PEAK] + length * step[2] * moving[i, PEAK_RATE]))
        speed2 = ux * ux + uy * uy
        if speed2 * length * length > STILL * STILL * spread * spread:
            speed = math.sqrt(speed2)
            at = (rx * ux + ry * uy) / speed2
            left = (ry * ux - rx * uy) / speed
        else:
            # (it flies along with the piece)
            speed2 = (STILL * spread / length) ** 2
            speed = math.sqrt(speed2)
            at = 0.5 * length
            left = math.hypot(rx, ry)
        room = 2.0 * spread * spread * (log_peak - log_cutoff) - left * left
        beyond = max(-at, at - length, 0.0)
        if room <= beyond * beyond * speed2:
            continue
        active[m, AT] = at
        active[m, PRECISION_AT] = speed2 / (spread * spread)
        active[m, LOG_AMPLITUDE] = log_peak - 0.5 * left * left / (spread * spread)
        active[m, HIGH] = room / speed2
        active[m, WIDTH_AT] = least / (speed + REACH * abs(widening))
        active[m, LEFT] = left
        active[m, ROW] = i
        m += 1
    return m


@kernel
def moving_risk_at(
    s: float, x1: float, y1: float, step: tuple[float, float, float], moving: FloatArray, i: int
) -> float:
    """Evaluate a moving threat at a parameter of a piece."""
    after = step[2] * s
    spread = moving[i, WIDE] + after * moving[i, WIDE_RATE]
    dx = x1 + step[0] * s - moving[i, MX] - after * moving[i, VX]
    dy = y1 + step[1] * s - moving[i, MY] - after * moving[i, VY]
    peak = moving[i, HIGH_PEAK] + after * moving[i, PEAK_RATE]
    risk: float = peak * math.exp(-0.5 * (dx * dx + dy * dy) / (spread * spread))
    return risk


@kernel
def piece_risk(piece: FloatArray, moving: FloatArray, field: Field, deeper: float, scratch: FloatArray) -> float:
    """
    Integrate the risk along one piece: over its length, or over its duration if it is waited.

    Parameters
    ----------
    piece
        Both ends, and how long it takes: ``x1, y1, x2, y2, duration``.
    moving
        The threats (`motion_in_slab`) when the piece begins.
    field
        The risk that stands still.
    deeper
        By how much the logarithms of all cut-offs are lower than usual (`risk_kernels.unit_of`).
    scratch
        A row of 9 columns or more for each threat, standing or moving.
    """
    x1, y1, x2, y2, duration = piece[0], piece[1], piece[2], piece[3], piece[4]
    flown = math.hypot(x2 - x1, y2 - y1)
    length = flown if flown > 0.0 else duration
    if length <= 0.0:
        return 0.0
    table, _, _, rasters = field
    step = (x2 - x1) / length, (y2 - y1) / length, duration / length
    n_still = table.shape[0]
    log_cutoff = reach_constant(n_still + moving.shape[0], deeper)
    n_moving = moving_in_reach(x1, y1, step, length, moving, log_cutoff, scratch)
    if n_moving == 0 and flown > 0.0:
        return segment_risk(x1, y1, x2, y2, field, math.inf)
    # (those that stand still come after those that move)
    if flown > 0.0:
        total = raster_risk(x1, y1, x2, y2, rasters)
        m = n_moving + threats_in_reach(x1, y1, step[0], step[1], length, table, scratch[n_moving:])
    else:
        total = length * density_at(x1, y1, rasters)
        still = np.zeros((n_still, 8))
        for i in range(n_still):
            still[i, MX], still[i, MY], still[i, WIDE] = table[i, X], table[i, Y], table[i, 6]
            still[i, HIGH_PEAK] = math.exp(table[i, 4])
        m = n_moving + moving_in_reach(x1, y1, step, length, still, log_cutoff, scratch[n_moving:])
    panel_widths(m, length, 0.5 * LONG, deeper, scratch)
    start = 0.0
    while start < length:
        end, any_here = panel_end(start, length, m, scratch)
        if any_here:
            half, middle = 0.5 * (end - start), 0.5 * (end + start)
            panel = 0.0
            for node in range(NODES.shape[0]):
                s = middle + half * NODES[node]
                clear, risk = 1.0, 0.0
                for j in range(m):
                    if j < n_moving:
                        f = moving_risk_at(s, x1, y1, step, moving, int(scratch[j, ROW]))
                    else:
                        off = s - scratch[j, AT]
                        f = math.exp(scratch[j, LOG_AMPLITUDE] - 0.5 * scratch[j, PRECISION_AT] * off * off)
                    risk += f * clear
                    clear *= 1.0 - f
                panel += WEIGHTS[node] * (risk if deeper > 0.0 else 1.0 - clear)
            total += half * panel
        start = end
    return total


@kernel
def piece_risks(
    pieces: FloatArray, since: FloatArray, moving: FloatArray, field: Field, deeper: float, out: FloatArray
) -> None:
    """
    Write the risk of pieces within one slab to `out`, shape ``(n,)``: `piece_risk`.

    Parameters
    ----------
    pieces
        Shape ``(n, 5)``.
    since
        How long after the slab begins each piece begins, shape ``(n,)``.
    moving
        The threats when the slab begins, shape ``(m, 8)``.
    field, deeper
        As of `piece_risk`.
    out
        Shape ``(n,)``.
    """
    scratch = np.empty((field[0].shape[0] + moving.shape[0] + 1, N_NODES))
    now = moving.copy()
    for n in range(pieces.shape[0]):
        for i in range(moving.shape[0]):
            now[i, MX] = moving[i, MX] + since[n] * moving[i, VX]
            now[i, MY] = moving[i, MY] + since[n] * moving[i, VY]
            now[i, WIDE] = moving[i, WIDE] + since[n] * moving[i, WIDE_RATE]
            now[i, HIGH_PEAK] = moving[i, HIGH_PEAK] + since[n] * moving[i, PEAK_RATE]
        out[n] = piece_risk(pieces[n], now, field, deeper, scratch)

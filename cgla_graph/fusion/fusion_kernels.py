"""
Compiled kernels of fused risk: many segments at once, exact or over a raster.

`samples` is the number of parts of a segment for the raster, 0 for the exact integral.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray
from cgla_graph.fusion.envelope_kernels import Fields, Work, envelope_risk, workspace
from cgla_graph.model.risk_kernels import AT, LOG2_E, LOG_AMPLITUDE, PRECISION_AT, ROW, exp2, threats_in_reach


@kernel
def raster_risk(
    x1: float, y1: float, x2: float, y2: float, fields: Fields, samples: int, work: Work
) -> tuple[float, float]:
    """
    Add up ``max_j F^j`` at the far ends of `samples` equal parts of a segment, times their length, there and back.

    Threats out of reach of the segment (below 1e-12) are left out, as in the exact integral.
    """
    threats, counts, _, _ = fields
    active = work[0]
    length = math.hypot(x2 - x1, y2 - y1)
    if length == 0.0:
        return 0.0, 0.0
    m = threats_in_reach(x1, y1, (x2 - x1) / length, (y2 - y1) / length, length, threats, active)
    if m == 0:
        return 0.0, 0.0
    part = length / samples
    f = np.empty(samples + 1)
    risk = np.zeros((counts.shape[0], samples + 1))
    for i in range(m):
        centre = active[i, AT]
        scale = -0.5 * active[i, PRECISION_AT] * LOG2_E
        offset = active[i, LOG_AMPLITUDE] * LOG2_E
        for sample in range(samples + 1):
            d = sample * part - centre
            f[sample] = exp2(offset + scale * d * d)
        for j in range(counts.shape[0]):
            for _ in range(counts[j, int(active[i, ROW])]):
                for sample in range(samples + 1):
                    risk[j, sample] += f[sample] * (1.0 - risk[j, sample])
    most = risk[0]
    for j in range(1, counts.shape[0]):
        for sample in range(samples + 1):
            most[sample] = max(most[sample], risk[j, sample])
    inside = 0.0
    for sample in range(1, samples):
        inside += most[sample]
    return part * (inside + most[samples]), part * (inside + most[0])


@kernel
def _both_ways_in_order(
    x1: float, y1: float, x2: float, y2: float, fields: Fields, samples: int, work: Work
) -> tuple[float, float]:
    """Return the fused risk there and back of a segment whose ends are in order."""
    if samples > 0:
        return raster_risk(x1, y1, x2, y2, fields, samples, work)
    risk = envelope_risk(x1, y1, x2, y2, fields, work)
    return risk, risk


@kernel
def both_ways(
    x1: float, y1: float, x2: float, y2: float, fields: Fields, samples: int, work: Work
) -> tuple[float, float]:
    """Return the fused risk there and back."""
    # one order of the ends, so that a pair has the same floats however it is asked
    if x2 < x1 or (x2 == x1 and y2 < y1):
        back, there = _both_ways_in_order(x2, y2, x1, y1, fields, samples, work)
        return there, back
    return _both_ways_in_order(x1, y1, x2, y2, fields, samples, work)


@kernel
def segment_risks(
    starts: FloatArray, ends: FloatArray, fields: Fields, samples: int, first: int, step: int, out: FloatArray
) -> None:
    """
    Write the fused risk of `n` segments, shapes ``(n, 2)``, to `out`, shape ``(n,)``: a share of them.

    The share are the segments `first`, ``first + step``, ….
    """
    work = workspace(fields)
    for i in range(first, starts.shape[0], step):
        out[i], _ = both_ways(starts[i, 0], starts[i, 1], ends[i, 0], ends[i, 1], fields, samples, work)


@kernel
def pair_risks(positions: FloatArray, fields: Fields, samples: int, first: int, step: int, out: FloatArray) -> None:
    """
    Write the fused risk between `n` positions, shape ``(n, 2)``, to `out`, shape ``(n, n)``: a share of the rows.

    The share are the rows `first`, ``first + step``, …, from the diagonal on, and their columns.
    """
    work = workspace(fields)
    for i in range(first, positions.shape[0], step):
        x, y = positions[i, 0], positions[i, 1]
        out[i, i] = 0.0
        for j in range(i + 1, positions.shape[0]):
            out[i, j], out[j, i] = both_ways(x, y, positions[j, 0], positions[j, 1], fields, samples, work)

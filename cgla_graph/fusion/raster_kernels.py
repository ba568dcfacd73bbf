"""
Compiled kernels of plans with raster weights: A* on the complete graph that weighs only the pairs that may matter.

A raster sum (E20) is fifty exponentials a threat, the most expensive weight there is. So a pair is asked in turn for
its length, for the exact integral of a field that understates the risk (see `raster_search.understated`), for crossing
the no-fly area, for a sum of less precision, and only then for its weight.
"""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.cost_to_go.bound_kernels import ULPS, least_risk, risk_error
from cgla_graph.fusion.envelope_kernels import Fields, workspace
from cgla_graph.fusion.fusion_kernels import both_ways
from cgla_graph.model.graph_kernels import Model, pair_weight
from cgla_graph.model.risk_kernels import LOG2_E, LOG_PEAK, PRECISION, X, Y, exp2

#: `rough_risk` leaves out threats whose logarithm stays below this on the whole segment.
FAINT = -13.0
#: Rounding of one factor of `rough_risk`, with room to spare: `exp2` is within 2e-14.
ROUGH_ERROR = 1e-13
#: A path that is cheaper by less than this, relative to its cost, is not looked for: it may be rounding.
ALIKE = 1e-14

#: Positions of the nodes, shape ``(n, 2)``; width and height of the lattice that the first of them are.
Nodes: TypeAlias = tuple[FloatArray, int, int]
#: What weighs: a model of k = 0 with the no-fly area, k, the field, the parts of a segment.
Raster: TypeAlias = tuple[Model, float, Fields, int]


@kernel
def rough_risk(
    x1: float, y1: float, x2: float, y2: float, table: FloatArray, steps: FloatArray, clear: FloatArray
) -> float:
    """
    Bound the raster risk of a segment from below, closely: within 1e-5 a threat and unit length.

    `steps` holds ``1, 2, …`` up to the number of parts; `clear` is scratch memory of that size. Threats that are faint
    along the whole segment are left out, which lowers the sum.
    """
    samples = steps.shape[0]
    length = math.sqrt((x2 - x1) * (x2 - x1) + (y2 - y1) * (y2 - y1))
    if length == 0.0:
        return 0.0
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    part = length / samples
    taken = 0
    for row in table:
        rx, ry = row[X] - x1, row[Y] - y1
        off = rx * uy - ry * ux
        precision = row[PRECISION]
        log_amplitude = row[LOG_PEAK] - 0.5 * off * off * precision
        at = rx * ux + ry * uy
        beyond = max(-at, at - length, 0.0)
        if log_amplitude - 0.5 * beyond * beyond * precision < FAINT:
            continue
        if taken == 0:
            clear[:] = 1.0
        taken += 1
        offset, scale = log_amplitude * LOG2_E, -0.5 * precision * LOG2_E
        for sample in range(samples):
            d = steps[sample] * part - at
            clear[sample] *= 1.0 - exp2(offset + scale * d * d)
    if taken == 0:
        return 0.0
    total = 0.0
    for sample in range(samples):
        total += 1.0 - clear[sample]
    least: float = max(total * part - ROUGH_ERROR * (taken + 1) * length, 0.0)
    return least


@kernel
def weigh(nodes: Nodes, raster: Raster, tails: IntArray, heads: IntArray, out: FloatArray) -> None:
    """Write the weights from some nodes to others to `out`, as `fused_graph` has them, shapes ``(m,)``."""
    positions, width, height = nodes
    lengths, k, fields, samples = raster
    work = workspace(fields)
    for pair in range(tails.shape[0]):
        i, j = tails[pair], heads[pair]
        there, _ = both_ways(positions[i, 0], positions[i, 1], positions[j, 0], positions[j, 1], fields, samples, work)
        out[pair] = k * there + pair_weight(positions, width, height, i, j, lengths)


@kernel
def find_path(
    nodes: Nodes,
    raster: Raster,
    table: FloatArray,
    understated: FloatArray,
    bounds: FloatArray,
    target: int,
    costs: FloatArray,
    parents: IntArray,
) -> tuple[int, int]:
    """
    Run A* from the node of cost 0 to the target.

    Parameters
    ----------
    nodes, raster
        The graph.
    table
        `RiskField.table` of the field.
    understated
        That of a field whose exact integrals are nowhere above the raster sums.
    bounds
        Of the least costs from each node to the target, from below: a consistent heuristic, shape ``(n,)``.
    target
        The node to go to; its cost bounds that of the path from above.
    costs, parents
        Of a path that is known, 0 at its first node and infinite elsewhere; of the least-cost path on return, shapes
        ``(n,)``.

    Returns
    -------
    expanded, weighed
        Numbers of nodes expanded and of pairs weighed.

    Notes
    -----
    Ties go to the path that is known. A node is expanded once. Where computed bounds are consistent but for an error of
    ``e`` a segment, that costs no more than ``e`` times the segments of the path.
    """
    positions, width, height = nodes
    lengths, k, fields, samples = raster
    n = positions.shape[0]
    error = k * risk_error(understated)
    risky = k > 0.0 and understated.shape[0] > 0
    near = np.empty((understated.shape[0] + 1, 3))
    hints = np.zeros(n, dtype=np.int64)
    work = workspace(fields)
    steps, clear = np.arange(1.0, samples + 1.0), np.empty(samples)
    is_open = np.ones(n, dtype=np.bool_)
    n_expanded = 0
    n_weighed = 0
    while True:
        node = -1
        least = costs[target] * (1.0 - ALIKE)
        for i in range(n):
            if is_open[i] and costs[i] + bounds[i] < least:
                least = costs[i] + bounds[i]
                node = i
        if node < 0 or node == target:
            return n_expanded, n_weighed
        is_open[node] = False
        n_expanded += 1
        x1, y1, cost = positions[node, 0], positions[node, 1], costs[node]
        for j in range(n):
            x2, y2 = positions[j, 0], positions[j, 1]
            limit = min(costs[j], costs[target] * (1.0 - ALIKE) - bounds[j])
            offer = cost + math.sqrt((x2 - x1) * (x2 - x1) + (y2 - y1) * (y2 - y1)) * (1.0 - ULPS)
            if not (offer < limit and is_open[j]):
                continue
            if risky:
                enough = (limit - offer + error) / k * (1.0 + ULPS)
                risk, hints[j] = least_risk(x1, y1, x2, y2, understated, near, enough, hints[j])
                if not offer + (k * risk * (1.0 - ULPS) - error) < limit:
                    continue
            length = pair_weight(positions, width, height, node, j, lengths)
            if not cost + length < limit:
                continue
            if not offer + k * rough_risk(x1, y1, x2, y2, table, steps, clear) * (1.0 - ULPS) < limit:
                continue
            n_weighed += 1
            there, _ = both_ways(x1, y1, x2, y2, fields, samples, work)
            offer = cost + (k * there + length)
            if offer < costs[j]:
                costs[j] = offer
                parents[j] = node

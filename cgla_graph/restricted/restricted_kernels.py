"""
Compiled kernels of the restricted cost matrix; `restricted` says why what they leave out is no part of the optimum.

The half lattice has the lattice's points and the middles between them. A raster over it is stored flat, `width` entries
a column: entry ``x2 * width + y2`` is the node at ``(x2, y2)`` half steps.
"""

import math
from typing import TypeAlias

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import BoolArray, FloatArray, IntArray, WholeArray
from cgla_graph.eikonal.marching_kernels import Mesh, spline_value
from cgla_graph.model.array_kernels import doubled
from cgla_graph.model.graph_kernels import Model
from cgla_graph.model.no_fly_kernels import segment_crosses
from cgla_graph.model.risk_kernels import LOG_PEAK, PRECISION, REACH2, X, Y, deeper_of, segment_cost
from cgla_graph.model.risk_raster_kernels import Rasters as RiskRasters
from cgla_graph.model.risk_raster_kernels import density_at, raster_range

#: x and y of the nodes, map units; column and row in the lattice (-1: off it); bounds of the cost from the root, of
#: which the first may be subtracted from the second; bound of the cost to the other end; where differences count.
Kept: TypeAlias = tuple[FloatArray, FloatArray, IntArray, IntArray, FloatArray, FloatArray, FloatArray, BoolArray]
#: Costs of a unit of length over the half lattice: as they are, below and above; bounds from the root and to the other
#: end at middles; and the width.
Rasters: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, int]
#: What `search` counts.
SETTLED, PAIRS, NEAR_ENOUGH, PRIMITIVE, PAST_MIDDLE, PAST_RASTER, INTEGRATED = range(7)
#: How far around a node of the half lattice, in its steps, its margin looks at the curvature: no part of a segment that
#: uses the node is farther from it.
REACH = 2.25
#: Relative rounding of sums of a raster, and what threats out of reach and cut products may add to the risk.
ROUNDING, CUT = 1e-12, 1e-11


@kernel
def spline_bounds(
    points: FloatArray,
    end: tuple[float, float],
    values: FloatArray,
    mesh: Mesh,
    first_piece: WholeArray,
    last: tuple[int, int],
    matters: BoolArray,
    holds: BoolArray,
    least_cost: float,
    least: FloatArray,
    most: FloatArray,
) -> None:
    """
    Evaluate a proven bound of the cost to an end at points, shape ``(n, 2)``.

    A cell that an area cuts has several pieces, of which any may be the point's: `least` gets the least of their
    values, which is a bound, and `most` the greatest. Both are infinite where no cell of the tube is. Inside the block
    around the end the bound is that of the least cost nearby.
    """
    controls, columns, rows, origin, spacing = mesh
    for n in range(points.shape[0]):
        u = (points[n, 0] - origin[0]) / spacing[0]
        v = (points[n, 1] - origin[1]) / spacing[1]
        column = min(max(math.floor(u + 0.5), 0), last[0])
        row = min(max(math.floor(v + 0.5), 0), last[1])
        distance = math.hypot(points[n, 0] - end[0], points[n, 1] - end[1])
        low, high = math.inf, -math.inf
        piece = first_piece[row * (last[0] + 1) + column]
        while 0 <= piece < columns.shape[0] and columns[piece] == column and rows[piece] == row:
            if matters[piece]:
                value = least_cost * distance
                if not holds[piece]:
                    value = spline_value(controls[piece], u - column, v - row, values)
                # (infinite control values make no number)
                if not math.isnan(value):
                    low, high = min(low, value), max(high, value)
            piece += 1
        least[n] = max(low, distance)
        # the distance is a bound as well; of the greater of two, the greater is to be subtracted
        most[n] = max(high, distance) if high > -math.inf else math.inf


@kernel
def cost_rasters(
    columns: IntArray,
    rows: IntArray,
    origin: tuple[float, float],
    step: tuple[float, float],
    bounds: tuple[float, float, float, float],
    k: float,
    table: FloatArray,
    rasters: RiskRasters,
    plain: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> None:
    """
    Write the cost of a unit of length at nodes of the half lattice, and the same minus and plus a margin.

    The margin covers what linear interpolation between nodes and along a segment may be off: ``H / 8`` times the sum of
    the squares of both spacings, where ``H`` bounds the Hessian of the cost within `REACH` steps (see `restricted`).
    Rasters have none: their least and their greatest within `REACH` steps, inside the lattice's `bounds`, are taken.
    """
    reach = REACH * max(step[0], step[1])
    squares = max(step[0], step[1]) ** 2 + step[0] ** 2 + step[1] ** 2
    cut = CUT * math.exp(-deeper_of(table))
    for n in range(columns.shape[0]):
        x = origin[0] + columns[n] * step[0]
        y = origin[1] + rows[n] * step[1]
        risk, bend, slopes, slopes2 = 0.0, 0.0, 0.0, 0.0
        for t in range(table.shape[0]):
            dx = x - table[t, X]
            dy = y - table[t, Y]
            r2 = dx * dx + dy * dy
            r = math.sqrt(r2)
            q = table[t, PRECISION]
            if r2 < table[t, REACH2]:
                risk += math.exp(table[t, LOG_PEAK] - 0.5 * q * r2) * (1.0 - risk)
            near = max(r - reach, 0.0)
            if near * near < table[t, REACH2]:
                far = r + reach
                greatest = math.exp(table[t, LOG_PEAK] - 0.5 * q * near * near)
                bend += greatest * q * max(1.0, far * far * q - 1.0)
                slope = greatest * far * q
                slopes += slope
                slopes2 += slope * slope
        hessian = bend + slopes * slopes - slopes2
        cost = 1.0 + k * risk
        margin = k * (0.125 * hessian * squares + cut)
        here = density_at(x, y, rasters)
        least, greatest = raster_range(
            (max(x - reach, bounds[0]), max(y - reach, bounds[1])),
            (min(x + reach, bounds[2]), min(y + reach, bounds[3])),
            rasters,
        )
        plain[columns[n], rows[n]] = cost + k * here
        low[columns[n], rows[n]] = (max(cost - margin, 1.0) + k * least) * (1.0 - ROUNDING)
        high[columns[n], rows[n]] = (cost + margin + k * greatest) * (1.0 + ROUNDING)


@kernel
def raster_sum(raster: FloatArray, width: int, x2: int, y2: int, a: int, b: int, length: float, limit: float) -> float:
    """
    Sum a raster along the segment of ``(a, b)`` half steps from the node ``(x2, y2)`` of the half lattice.

    The trapezoid rule over the crossings with its columns, or with its rows if the segment is steep. Infinite as soon
    as it is known to reach `limit`: the rest of the segment costs at least its length.
    """
    if abs(a) >= abs(b):
        n = abs(a)
        along, across = (width if a > 0 else -width), 1
        side, base, slope = float(y2), x2 * width, b / n
    else:
        n = abs(b)
        along, across = (1 if b > 0 else -1), width
        side, base, slope = float(x2), y2, a / n
    delta = length / n
    stop = limit / delta
    total = 0.5 * (raster[x2 * width + y2] + raster[(x2 + a) * width + y2 + b])
    j = 1
    while j < n:
        end = min(j + 8, n)
        for t in range(j, end):
            at = side + t * slope
            near = int(at)
            share = at - near
            q = base + along * t + across * near
            # what lies beside may be infinite, and infinity times 0 is no number
            total += raster[q] * (1.0 - share) + raster[q + across] * share if share > 0.0 else raster[q]
        j = end
        if total + (n - j) >= stop:
            return math.inf
    found: float = total * delta
    return found


@kernel
def search(
    kept: Kept,
    root: tuple[float, float],
    rim: float,
    source: int,
    target: int,
    upper: float,
    primitive: BoolArray,
    rasters: Rasters,
    rough: bool,
    model: Model,
    counts: IntArray,
    values: FloatArray,
    successors: IntArray,
    order: IntArray,
    stop: BoolArray,
) -> int:
    """
    Run label setting from `source` over the kept nodes until `target` is settled; return the number of rounds.

    It ends before that when another thread sets ``stop[0]``.

    Of the nodes that a path cheaper than `upper` passes, `values` and `successors` (towards the source) are exact, and
    infinite and -1 where none does. `rough`: weights are sums of a raster, for a path that is weighed afterwards.

    Longer than most functions: its parts would have to hand on a dozen arrays, which grow as it goes.
    """
    k, field, area = model
    x, y, column, row, most_from, least_from, least_to, apart = kept
    plain, low, high, middle_from, middle_to, width = rasters
    n = x.shape[0]
    # the unsettled nodes, kept together: what the inner loops read
    px, py, pf, pt, node, pa = x.copy(), y.copy(), least_from.copy(), least_to.copy(), np.arange(n), apart.copy()
    exact, least, most = np.full(n, math.inf), np.full(n, math.inf), np.full(n, math.inf)
    # candidates: edges that may matter and are not weighed yet, a list for each node
    head = np.full(n, -1)
    room = 4096
    tail, bound, after = np.empty(room, dtype=np.int64), np.empty(room), np.empty(room, dtype=np.int64)
    used, free = 0, -1
    maybe = np.empty(n, dtype=np.bool_)
    n_left, r, at, rounds = n, source, source, 0
    values[source] = 0.0
    while True:
        order[rounds] = r
        rounds += 1
        n_left -= 1
        px[at], py[at], pf[at], pt[at] = px[n_left], py[n_left], pf[n_left], pt[n_left]
        node[at], pa[at] = node[n_left], pa[n_left]
        exact[at], least[at], most[at] = exact[n_left], least[n_left], most[n_left]
        if r == target or stop[0]:
            break
        counts[PAIRS] += n_left
        rx, ry, value, before = x[r], y[r], values[r], most_from[r]
        away = math.hypot(rx - root[0], ry - root[1])
        differs = apart[r] and away > rim
        safe = (away - rim) ** 2
        for j in range(n_left):
            dx = px[j] - rx
            dy = py[j] - ry
            left = min(most[j], upper - pt[j]) - value
            square = dx * dx + dy * dy
            misses = (dx * (root[0] - rx) + dy * (root[1] - ry) <= 0.0) | (square < safe)
            too_far = differs & pa[j] & misses & (pf[j] - before >= left)
            maybe[j] = (left > 0.0) & (square < left * left) & (not too_far)
        for j in range(n_left):
            if not maybe[j]:
                continue
            counts[NEAR_ENOUGH] += 1
            left = min(most[j], upper - pt[j]) - value
            i = node[j]
            length = math.sqrt((px[j] - rx) ** 2 + (py[j] - ry) ** 2)
            lower, higher = length, math.inf
            if column[r] >= 0 and column[i] >= 0:
                a = column[i] - column[r]
                b = row[i] - row[r]
                if not primitive[abs(a), abs(b)]:
                    continue
                counts[PRIMITIVE] += 1
                to_middle = left - 0.5 * length
                if not rough:
                    middle = (column[i] + column[r]) * width + row[i] + row[r]
                    passed = middle_from[middle]
                    if passed + middle_to[middle] >= upper or passed + 0.5 * length >= value + left:
                        continue
                    to_middle = min(to_middle, upper - middle_to[middle] - value)
                counts[PAST_MIDDLE] += 1
                raster = plain if rough else low
                lower = raster_sum(raster, width, 2 * column[r], 2 * row[r], a, b, 0.5 * length, to_middle)
                if lower >= to_middle:
                    continue
                rest = left - lower
                further = raster_sum(raster, width, column[r] + column[i], row[r] + row[i], a, b, 0.5 * length, rest)
                if further >= rest:
                    continue
                lower += further
                if not rough:
                    higher = raster_sum(high, width, 2 * column[r], 2 * row[r], 2 * a, 2 * b, length, math.inf)
            elif rough:
                lower = segment_cost(rx, ry, px[j], py[j], k, field)
                if lower >= left:
                    continue
            if segment_crosses(rx, ry, px[j], py[j], area):
                continue
            counts[PAST_RASTER] += 1
            if rough:
                exact[j] = most[j] = value + lower
                successors[i] = r
                continue
            most[j] = min(most[j], value + higher)
            least[j] = min(least[j], value + lower)
            if free >= 0:
                q = free
                free = after[q]
            else:
                if used == room:
                    tail, bound, after = doubled(tail), doubled(bound), doubled(after)
                    room *= 2
                q = used
                used += 1
            tail[q], bound[q], after[q] = r, value + lower, head[i]
            head[i] = q
        # the node of least label comes next; where a candidate may undercut its label, that is integrated first
        while True:
            best, at = math.inf, -1
            for j in range(n_left):
                label = min(exact[j], least[j])
                if label < best:
                    best, at = label, j
            if at < 0 or best >= upper or exact[at] <= least[at]:
                break
            i = node[at]
            while True:
                q, first, lowest = head[i], -1, math.inf
                while q >= 0:
                    if bound[q] < lowest:
                        first, lowest = q, bound[q]
                    q = after[q]
                if first < 0 or lowest >= exact[at] or lowest >= upper - pt[at]:
                    break
                bound[first] = math.inf
                p = tail[first]
                counts[INTEGRATED] += 1
                label = values[p] + segment_cost(x[p], y[p], x[i], y[i], k, field)
                if label < exact[at]:
                    exact[at] = label
                    successors[i] = p
            q = head[i]
            while q >= 0:
                following = after[q]
                after[q] = free
                free = q
                q = following
            head[i] = -1
            least[at] = math.inf
            most[at] = min(most[at], exact[at])
        if at < 0 or best >= upper:
            break
        r = node[at]
        values[r] = best
    counts[SETTLED] = rounds
    return rounds


@kernel
def coprime_steps(width: int, height: int) -> BoolArray:
    """Say of each step ``(a, b)`` whether its parts have no common divisor, shape ``(width, height)``."""
    out = np.empty((width, height), dtype=np.bool_)
    for a in range(width):
        for b in range(height):
            p, q = a, b
            while q:
                p, q = q, p % q
            out[a, b] = p == 1
    return out

"""
Compiled kernels of the restricted cost matrix; `restricted` says why what they leave out is no part of the optimum.

The half lattice has the lattice's points and the middles between them. A raster over it is stored in squares of `SIDE`
nodes a side, of which only those near the tube are held: `blocks` has the first entry of each square, and 0 for those
that are not held, as all entries of the first square are infinite. A small raster is held as a whole, `width` entries a
column, which is quicker.

Nodes of the lattice are searched tile by tile. From a node, whole tiles are left out by what holds for all straight
lines to them: how short they are, and that a box, through which all of them pass at the same share of their length,
holds no node of the half lattice near the tube (`holds_any`).
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
#: First node of each tile and, at last, the number of nodes; least and greatest x and y, then column and row.
Tiles: TypeAlias = tuple[IntArray, FloatArray, IntArray]
#: Costs of a unit of length over the half lattice: as they are, below and above; a bound of their fourth derivatives,
#: or no entry; bounds from the root and to the other end at middles; the squares, and the width if all are held; and
#: sums (`holds_any`) of the nodes that a cheap path may pass, and of those near the tube.
Rasters: TypeAlias = tuple[
    FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, WholeArray, int, WholeArray, WholeArray
]
#: What `search` counts.
SETTLED, PAIRS, NEAR_ENOUGH, PRIMITIVE, PAST_MIDDLE, PAST_SIMPSON, PAST_RASTER, INTEGRATED = range(8)
#: The squares of a raster have ``2 ** BITS`` nodes a side; sums count nodes by ``2 ** COARSE`` a side.
BITS, COARSE = 5, 2
SIDE = 1 << BITS
#: Shares of a line to a tile, in eighths, at which boxes are looked at.
EIGHTHS = (4, 2, 6)
#: How far around a node of the half lattice, in its steps, its margin looks at the curvature: no part of a segment that
#: uses the node is farther from it.
REACH = 2.25
#: Simpson's rule has up to so many steps of the half lattice between its points, and is used from so many steps on, as
#: long as of so many tries it leaves out most; if not, it is tried again after a pause.
STRIDE, LONG, TRIES, PAUSE = 12, 12, 1000, 20_000
#: Relative rounding of sums of a raster, and what threats out of reach and cut products may add to the risk.
ROUNDING, CUT = 1e-12, 1e-11


@kernel
def spline_bounds(
    points: FloatArray,
    end: tuple[float, float],
    values: FloatArray,
    mesh: Mesh,
    row_starts: IntArray,
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
    controls, columns, _, origin, spacing = mesh
    for n in range(points.shape[0]):
        u = (points[n, 0] - origin[0]) / spacing[0]
        v = (points[n, 1] - origin[1]) / spacing[1]
        column = min(max(math.floor(u + 0.5), 0), last[0])
        row = min(max(math.floor(v + 0.5), 0), last[1])
        distance = math.hypot(points[n, 0] - end[0], points[n, 1] - end[1])
        low, high = math.inf, -math.inf
        # pieces are in order row by row; of several pieces of a cell, the first
        piece, end_of_row = row_starts[row], row_starts[row + 1]
        beyond = end_of_row
        while piece < beyond:
            middle = (piece + beyond) // 2
            if columns[middle] < column:
                piece = middle + 1
            else:
                beyond = middle
        while piece < end_of_row and columns[piece] == column:
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
    places: IntArray,
    plain: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> None:
    """
    Write the cost of a unit of length at nodes of the half lattice, and the same minus and plus a margin, to `places`.

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
        plain[places[n]] = cost + k * here
        low[places[n]] = (cost - margin + k * least) * (1.0 - ROUNDING)
        high[places[n]] = (cost + margin + k * greatest) * (1.0 + ROUNDING)


@kernel
def place_of(blocks: WholeArray, width: int, x2: int, y2: int) -> int:
    """Return the entry of a raster for a node of the half lattice."""
    if width > 0:
        return x2 * width + y2
    return int(blocks[x2 >> BITS, y2 >> BITS]) + ((x2 & (SIDE - 1)) << BITS) + (y2 & (SIDE - 1))


@kernel
def raster_sum(
    raster: FloatArray, blocks: WholeArray, width: int, x2: int, y2: int, a: int, b: int, length: float, limit: float
) -> float:
    """
    Sum a raster along the segment of ``(a, b)`` half steps from the node ``(x2, y2)`` of the half lattice.

    The trapezoid rule over the crossings with its columns, or with its rows if the segment is steep. Infinite as soon
    as it is known to reach `limit`: the rest of the segment costs at least its length.
    """
    total = 0.5 * (raster[place_of(blocks, width, x2, y2)] + raster[place_of(blocks, width, x2 + a, y2 + b)])
    if abs(a) >= abs(b):
        n, ahead, slope = abs(a), (1 if a > 0 else -1), b / abs(a)
        side, base, along, across = float(y2), x2 * width, ahead * width, 1
    else:
        n, ahead, slope = abs(b), (1 if b > 0 else -1), a / abs(b)
        side, base, along, across = float(x2), y2, ahead, width
    delta = length / n
    stop = limit / delta
    j = 1
    while j < n:
        end = min(j + 8, n)
        if width > 0:
            for t in range(j, end):
                at = side + t * slope
                near = int(at)
                share = at - near
                here = base + along * t + across * near
                # what lies beside may be infinite, and infinity times 0 is no number
                total += raster[here] * (1.0 - share) + raster[here + across] * share if share > 0.0 else raster[here]
        elif abs(a) >= abs(b):
            for t in range(j, end):
                at = y2 + t * slope
                x, y = x2 + ahead * t, int(at)
                share = at - y
                here = place_of(blocks, width, x, y)
                if share > 0.0:
                    beside = here + 1 if y & (SIDE - 1) < SIDE - 1 else place_of(blocks, width, x, y + 1)
                    total += raster[here] * (1.0 - share) + raster[beside] * share
                else:
                    total += raster[here]
        else:
            for t in range(j, end):
                at = x2 + t * slope
                x, y = int(at), y2 + ahead * t
                share = at - x
                here = place_of(blocks, width, x, y)
                if share > 0.0:
                    beside = here + SIDE if x & (SIDE - 1) < SIDE - 1 else place_of(blocks, width, x + 1, y)
                    total += raster[here] * (1.0 - share) + raster[beside] * share
                else:
                    total += raster[here]
        j = end
        if total + (n - j) >= stop:
            return math.inf
    found: float = total * delta
    return found


@kernel
def fourth_derivatives(
    columns: IntArray,
    rows: IntArray,
    origin: tuple[float, float],
    step: tuple[float, float],
    k: float,
    table: FloatArray,
    places: IntArray,
    fourth: FloatArray,
) -> None:
    """
    Bound the fourth derivative of the cost of a unit of length along any line, near nodes of the half lattice.

    Near is as far as a panel of Simpson's rule that has a point beside the node. Along a line, the derivatives of ``f =
    p exp(-q r^2 / 2)`` are at most ``q^(m/2) |He_m(t)| f``, with Hermite polynomials of ``|t| <= sqrt(q) r``. Those of
    the product of ``1 - f_i`` follow as coefficients of the product of their Taylor polynomials.
    """
    reach = (2 * STRIDE + 2) * math.hypot(step[0], step[1])
    for n in range(columns.shape[0]):
        x = origin[0] + columns[n] * step[0]
        y = origin[1] + rows[n] * step[1]
        c1, c2, c3, c4 = 0.0, 0.0, 0.0, 0.0
        for t in range(table.shape[0]):
            r = math.hypot(x - table[t, X], y - table[t, Y])
            near = max(r - reach, 0.0)
            if near * near >= table[t, REACH2]:
                continue
            q = table[t, PRECISION]
            f = math.exp(table[t, LOG_PEAK] - 0.5 * q * near * near)
            root = math.sqrt(q)
            far = root * (r + reach)
            d1 = f * root * far
            d2 = f * q * max(1.0, far * far - 1.0) / 2.0
            d3 = f * q * root * max(2.0, far * far * far - 3.0 * far) / 6.0
            d4 = f * q * q * max(6.0, far * far * (far * far - 6.0) + 3.0) / 24.0
            c4 += c3 * d1 + c2 * d2 + c1 * d3 + d4
            c3 += c2 * d1 + c1 * d2 + d3
            c2 += c1 * d1 + d2
            c1 += d1
        fourth[places[n]] = 24.0 * k * c4


@kernel
def simpson_sum(
    raster: FloatArray,
    fourth: FloatArray,
    blocks: WholeArray,
    width: int,
    x2: int,
    y2: int,
    a: int,
    b: int,
    length: float,
    rough: bool,
) -> float:
    """
    Integrate a raster along a segment by Simpson's rule, at few points, less its greatest error unless `rough`.

    Between points `D` apart, that is ``D^4 / 180`` times the fourth derivative; a raster that is below the cost by what
    interpolation is off yields a lower bound.
    """
    parts = 2 * ((max(abs(a), abs(b)) + 2 * STRIDE - 1) // (2 * STRIDE))
    delta = length / parts
    off = 0.0 if rough else delta**4 / 180.0
    total = 0.0
    for j in range(parts + 1):
        u, v = x2 + a * j / parts, y2 + b * j / parts
        column, row = int(u), int(v)
        here = place_of(blocks, width, column, row)
        value = raster[here]
        # (what lies beside may be infinite, and infinity times 0 is no number)
        if v > row:
            value += (v - row) * (raster[place_of(blocks, width, column, row + 1)] - value)
        if u > column:
            other = raster[place_of(blocks, width, column + 1, row)]
            if v > row:
                other += (v - row) * (raster[place_of(blocks, width, column + 1, row + 1)] - other)
            value += (u - column) * (other - value)
        if not rough:
            value -= off * fourth[here]
        if not value < math.inf:
            return math.inf
        total += value * (1.0 if j * (parts - j) == 0 else 4.0 if j % 2 else 2.0)
    return total * delta / 3.0


@kernel
def holds_any(sums: WholeArray, x: int, y: int, right: int, top: int) -> bool:
    """Tell whether any node that `sums` counts may be in a box of the half lattice, its rim included."""
    a, b, c, d = x >> COARSE, y >> COARSE, (right >> COARSE) + 1, (top >> COARSE) + 1
    return bool(sums[c, d] - sums[a, d] - sums[c, b] + sums[a, b] > 0)


@kernel
def may_reach(column: int, row: int, t: int, spans: IntArray, passable: WholeArray, near: WholeArray) -> bool:
    """
    Tell whether a line from a node of the lattice to one of a tile may stay near the tube.

    All these lines pass, at the same share of their length, through a box, which grows with the share. The middle of a
    line is a node of the half lattice; of another point, the node to the south-west is near the tube if the point is in
    it.
    """
    for share in EIGHTHS:
        rest = 8 - share
        x, y = (rest * column + share * spans[t, 0]) >> 2, (rest * row + share * spans[t, 1]) >> 2
        right, top = (rest * column + share * spans[t, 2]) >> 2, (rest * row + share * spans[t, 3]) >> 2
        if not holds_any(passable if share == 4 else near, x, y, right, top):
            return False
    return True


@kernel
def search(
    kept: Kept,
    tiles: Tiles,
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

    It ends before that when another thread sets ``stop[0]``. Nodes are sorted by tiles.

    Of the nodes that a path cheaper than `upper` passes, `values` and `successors` (towards the source) are exact, and
    infinite and -1 where none does. `rough`: weights are sums of a raster, for a path that is weighed afterwards.

    Longer than most functions: its parts would have to hand on a dozen arrays, which grow as it goes.
    """
    k, field, area = model
    x, y, column, row, most_from, least_from, least_to, apart = kept
    first, boxes, spans = tiles
    plain, low, high, fourth, middle_from, middle_to, blocks, width, passable, near = rasters
    smooth, tried, left_out, skipped = fourth.shape[0] > 0, 0, 0, 0
    n, n_tiles = x.shape[0], first.shape[0] - 1
    # the unsettled nodes, kept together in their tiles: what the inner loops read
    px, py, pf, pt, node, pa = x.copy(), y.copy(), least_from.copy(), least_to.copy(), np.arange(n), apart.copy()
    exact, least, most = np.full(n, math.inf), np.full(n, math.inf), np.full(n, math.inf)
    # of each tile: its unsettled nodes, their least label, and a bound of the labels that still matter
    ends, lowest, matters = first[1:].copy(), np.full(n_tiles, math.inf), np.full(n_tiles, math.inf)
    tile_of = np.empty(n, dtype=np.int64)
    for t in range(n_tiles):
        tile_of[first[t] : first[t + 1]] = t
    # candidates: edges that may matter and are not weighed yet, a list for each node
    head = np.full(n, -1)
    room = 4096
    tail, bound, after = np.empty(room, dtype=np.int64), np.empty(room), np.empty(room, dtype=np.int64)
    used, free = 0, -1
    r, at, rounds = source, source, 0
    values[source] = 0.0
    while True:
        order[rounds] = r
        rounds += 1
        tile = tile_of[r]
        last = ends[tile] - 1
        ends[tile] = last
        px[at], py[at], pf[at], pt[at] = px[last], py[last], pf[last], pt[last]
        node[at], pa[at] = node[last], pa[last]
        exact[at], least[at], most[at] = exact[last], least[last], most[last]
        lowest[tile] = math.inf
        for j in range(first[tile], last):
            lowest[tile] = min(lowest[tile], exact[j], least[j])
        if r == target or stop[0]:
            break
        rx, ry, value, before = x[r], y[r], values[r], most_from[r]
        away = math.hypot(rx - root[0], ry - root[1])
        differs = apart[r] and away > rim
        safe = (away - rim) ** 2
        for t in range(n_tiles):
            left = matters[t] - value
            if left <= 0.0 or ends[t] == first[t]:
                continue
            dx = max(boxes[t, 0] - rx, rx - boxes[t, 2], 0.0)
            dy = max(boxes[t, 1] - ry, ry - boxes[t, 3], 0.0)
            if dx * dx + dy * dy >= left * left:
                continue
            on_lattice = column[r] >= 0 and spans[t, 0] >= 0
            if on_lattice and not may_reach(column[r], row[r], t, spans, passable, near):
                continue
            counts[PAIRS] += ends[t] - first[t]
            greatest = 0.0
            for j in range(first[t], ends[t]):
                most_label = min(most[j], upper - pt[j])
                greatest = max(greatest, most_label)
                left = most_label - value
                dx = px[j] - rx
                dy = py[j] - ry
                square = dx * dx + dy * dy
                if left <= 0.0 or square >= left * left:
                    continue
                # (where the segment misses the block around the root)
                misses = dx * (root[0] - rx) + dy * (root[1] - ry) <= 0.0 or square < safe
                falls = differs and misses and pa[j]
                if falls and pf[j] - before >= left:
                    continue
                counts[NEAR_ENOUGH] += 1
                i = node[j]
                length = math.sqrt(square)
                lower, higher = length, math.inf
                if on_lattice:
                    a = column[i] - column[r]
                    b = row[i] - row[r]
                    if not primitive[abs(a), abs(b)]:
                        continue
                    counts[PRIMITIVE] += 1
                    to_middle = left - 0.5 * length
                    if not rough:
                        middle = place_of(blocks, width, column[i] + column[r], row[i] + row[r])
                        passed = middle_from[middle]
                        if passed + middle_to[middle] >= upper or passed + 0.5 * length >= value + left:
                            continue
                        to_middle = min(to_middle, upper - middle_to[middle] - value)
                        if falls and passed - before >= to_middle:
                            continue
                    counts[PAST_MIDDLE] += 1
                    raster = plain if rough else low
                    half, x2, y2 = 0.5 * length, 2 * column[r], 2 * row[r]
                    beyond_x, beyond_y = x2 + a, y2 + b
                    is_long = smooth and max(abs(a), abs(b)) >= LONG
                    if is_long and not rough and tried >= TRIES and 2 * left_out < tried:
                        # (later, and elsewhere, it may)
                        skipped += 1
                        if skipped == PAUSE:
                            tried, left_out, skipped = 0, 0, 0
                    elif is_long:
                        tried += 1
                        left_out += 1
                        lower = simpson_sum(raster, fourth, blocks, width, x2, y2, a, b, half, rough)
                        if lower >= to_middle:
                            continue
                        lower += simpson_sum(raster, fourth, blocks, width, beyond_x, beyond_y, a, b, half, rough)
                        if lower >= left:
                            continue
                        left_out -= 1
                    counts[PAST_SIMPSON] += 1
                    if not (is_long and rough):
                        lower = raster_sum(raster, blocks, width, x2, y2, a, b, half, to_middle)
                        if lower >= to_middle:
                            continue
                        rest = left - lower
                        further = raster_sum(raster, blocks, width, beyond_x, beyond_y, a, b, half, rest)
                        if further >= rest:
                            continue
                        lower = max(lower + further, length)
                    if not rough:
                        higher = raster_sum(high, blocks, width, x2, y2, 2 * a, 2 * b, length, math.inf)
                elif rough:
                    lower = segment_cost(rx, ry, px[j], py[j], k, field)
                    if lower >= left:
                        continue
                if segment_crosses(rx, ry, px[j], py[j], area):
                    continue
                counts[PAST_RASTER] += 1
                if rough:
                    exact[j] = most[j] = value + lower
                    lowest[t] = min(lowest[t], value + lower)
                    successors[i] = r
                    continue
                most[j] = min(most[j], value + higher)
                least[j] = min(least[j], value + lower)
                lowest[t] = min(lowest[t], value + lower)
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
            matters[t] = greatest
        # the node of least label comes next; where a candidate may undercut its label, that is integrated first
        while True:
            best, tile, at = math.inf, -1, -1
            for t in range(n_tiles):
                if lowest[t] < best:
                    best, tile = lowest[t], t
            if tile < 0 or best >= upper:
                break
            for j in range(first[tile], ends[tile]):
                if min(exact[j], least[j]) == best:
                    at = j
                    break
            if exact[at] <= least[at]:
                break
            i = node[at]
            while True:
                q, nearest, earliest = head[i], -1, math.inf
                while q >= 0:
                    if bound[q] < earliest:
                        nearest, earliest = q, bound[q]
                    q = after[q]
                if nearest < 0 or earliest >= exact[at] or earliest >= upper - pt[at]:
                    break
                bound[nearest] = math.inf
                p = tail[nearest]
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
            lowest[tile] = math.inf
            for j in range(first[tile], ends[tile]):
                lowest[tile] = min(lowest[tile], exact[j], least[j])
        if at < 0 or best >= upper:
            break
        r = node[at]
        values[r] = best
    counts[SETTLED] = rounds
    return rounds


@kernel
def widen(columns: IntArray, rows: IntArray, reach: int, mask: BoolArray) -> None:
    """Mark cells, and those within `reach` cells of them in all eight directions."""
    for n in range(columns.shape[0]):
        top = min(rows[n] + reach + 1, mask.shape[1])
        for at in range(max(columns[n] - reach, 0), min(columns[n] + reach + 1, mask.shape[0])):
            for beside in range(max(rows[n] - reach, 0), top):
                mask[at, beside] = True


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

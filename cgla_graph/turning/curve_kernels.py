"""
Compiled kernels of curves of lines and arcs: where they are, what they cost, what they cross, how near they come.

A **piece** is a row of `COLUMNS` numbers: its two ends, and of an arc its centre, its radius and by how much it turns
(radians, positive to the left); a line has radius 0. Curves are arrays of pieces, shape ``(n, 8)``, map units.

**Risk along an arc** is integrated by 16-point Gauss-Legendre on panels that are no wider than the threats around
allow. Risk on rasters is cut where the arc crosses grid lines, between which the density is constant, or smooth.

**Crossings.** The intersections of an arc with the edges of an area, in closed form, cut it into parts that are either
inside or outside; the middle of each says which. So an arc may touch an area, as a line may.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.array_kernels import doubled
from cgla_graph.model.no_fly_kernels import AreaArrays, first_row, point_inside, segment_crosses, slab_of
from cgla_graph.model.risk_kernels import LOG_PEAK, PRECISION, REACH2, SPREAD, Field, X, Y, segment_risk
from cgla_graph.model.risk_raster_kernels import (
    BILINEAR,
    COLUMNS,
    HEADER,
    HEIGHT,
    ROWS,
    WIDTH,
    X_FIRST,
    Y_FIRST,
    Rasters,
    density_at,
    gradient_at,
)
from cgla_graph.refine.refine_kernels import threats_at

X0, Y0, X1, Y1, CX, CY, RADIUS, TURN = range(8)
N_COLUMNS = 8
#: Why a piece may not be flown: it crosses the area, it leaves the bounds.
CROSSES, LEAVES = 1, 2
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
#: Widest panel of the quadrature, radians, and in spreads of a threat around.
MOST_ANGLE, SPREADS = 0.8, 2.5
_TURN = 2.0 * math.pi


@kernel
def piece_length(piece: FloatArray) -> float:
    """Return the length of a piece."""
    if piece[RADIUS] > 0.0:
        return float(piece[RADIUS] * abs(piece[TURN]))
    return math.hypot(piece[X1] - piece[X0], piece[Y1] - piece[Y0])


@kernel
def place(piece: FloatArray, share: float) -> tuple[float, float]:
    """Return the point at a share of a piece, from 0 to 1; the ends are the stored ones."""
    if share <= 0.0:
        return piece[X0], piece[Y0]
    if share >= 1.0:
        return piece[X1], piece[Y1]
    if piece[RADIUS] == 0.0:
        return piece[X0] + share * (piece[X1] - piece[X0]), piece[Y0] + share * (piece[Y1] - piece[Y0])
    angle = math.atan2(piece[Y0] - piece[CY], piece[X0] - piece[CX]) + share * piece[TURN]
    return piece[CX] + piece[RADIUS] * math.cos(angle), piece[CY] + piece[RADIUS] * math.sin(angle)


@kernel
def places(pieces: FloatArray, which: FloatArray, shares: FloatArray, out: FloatArray) -> None:
    """Write the points at `shares` of the pieces `which` (whole numbers), both ``(n,)``, to `out`, ``(n, 2)``."""
    for i in range(which.shape[0]):
        x, y = place(pieces[int(which[i])], shares[i])
        out[i, 0] = x
        out[i, 1] = y


@kernel
def within_turn(angle: float, begin: float, turn: float) -> float:
    """
    Return the share of a turn at which an angle is met; above 1 where it is not.

    Examples
    --------
    >>> within_turn(0.5, 0.0, 1.0), within_turn(-0.5, 0.0, -1.0), within_turn(-0.5, 0.0, 1.0) > 1.0
    (0.5, 0.5, True)
    """
    if turn == 0.0:
        return 2.0
    ahead = (angle - begin) if turn > 0.0 else (begin - angle)
    ahead -= _TURN * math.floor(ahead / _TURN)
    return ahead / abs(turn)


@kernel
def density_and_gradient(x: float, y: float, table: FloatArray, rasters: Rasters) -> tuple[float, float, float]:
    """Evaluate ``F`` and its gradient at one point, without the threats that are out of reach."""
    gx, gy, risk = 0.0, 0.0, 0.0
    for i in range(table.shape[0]):
        dx = x - table[i, X]
        dy = y - table[i, Y]
        squared = dx * dx + dy * dy
        if squared < table[i, REACH2]:
            f = math.exp(table[i, LOG_PEAK] - 0.5 * table[i, PRECISION] * squared)
            slope = -(1.0 - risk) * f * table[i, PRECISION]
            gx = gx * (1.0 - f) + slope * dx
            gy = gy * (1.0 - f) + slope * dy
            risk += f * (1.0 - risk)
    more_x, more_y = gradient_at(x, y, rasters)
    return risk + density_at(x, y, rasters), gx + more_x, gy + more_y


@kernel
def _threats_along(cx: float, cy: float, radius: float, begin: float, turn: float, table: FloatArray) -> float:
    """Integrate the threats over an arc."""
    length = radius * abs(turn)
    crowd = 1.0 / (1.0 + 0.38 * math.log(1.0 + table.shape[0]))
    # (no panel is so short that the next one would begin in the same place)
    least = 1e-9 * length
    total = 0.0
    at = 0.0
    while at < length:
        angle = begin + turn * (at / length)
        x, y = cx + radius * math.cos(angle), cy + radius * math.sin(angle)
        width = min(length - at, MOST_ANGLE * radius)
        felt = False
        for i in range(table.shape[0]):
            # a point that is so far away stays out of reach for as long
            gap = math.hypot(x - table[i, X], y - table[i, Y]) - math.sqrt(table[i, REACH2])
            # from a far centre, a threat is narrower along the arc than it is wide
            far = math.hypot(cx - table[i, X], cy - table[i, Y])
            step = SPREADS * crowd * table[i, SPREAD] * min(1.0, math.sqrt(radius / far) if far > 0.0 else 1.0)
            felt = felt or gap < width
            width = min(width, max(gap, step))
        width = max(width, least)
        if felt:
            half = 0.5 * width
            panel = 0.0
            for j in range(_NODES.shape[0]):
                angle = begin + turn * ((at + half * (1.0 + _NODES[j])) / length)
                panel += _WEIGHTS[j] * threats_at(cx + radius * math.cos(angle), cy + radius * math.sin(angle), table)
            total += half * panel
        at += width
    return total


@kernel
def _cuts(
    middle: float,
    radius: float,
    first: float,
    step: float,
    count: int,
    turned: float,
    arc: FloatArray,
    cuts: FloatArray,
) -> int:
    """Write the shares at which an arc crosses parallel grid lines to `cuts`; return how many they are."""
    n = 0
    low = max(0, math.ceil((middle - radius - first) / step))
    high = min(count, math.floor((middle + radius - first) / step))
    for line in range(low, high + 1):
        offset = (first + line * step - middle) / radius
        if abs(offset) >= 1.0:
            continue
        half = math.acos(offset)
        for sign in (-1.0, 1.0):
            share = within_turn(turned + sign * half, arc[0], arc[1])
            if share < 1.0:
                cuts[n] = share
                n += 1
    return n


@kernel
def _rasters_along(cx: float, cy: float, radius: float, begin: float, turn: float, rasters: Rasters) -> float:
    """Integrate all rasters over an arc, between the grid lines that it crosses."""
    if rasters is None:
        return 0.0
    n_rasters = int(rasters[6]) // HEADER
    most = 2
    for r in range(n_rasters):
        head = rasters[HEADER * r : HEADER * (r + 1)]
        most += 2 * (int(min(head[COLUMNS] + 1.0, 2.0 * radius / head[WIDTH] + 2.0)) + 1)
        most += 2 * (int(min(head[ROWS] + 1.0, 2.0 * radius / head[HEIGHT] + 2.0)) + 1)
    cuts = np.empty(most + 16)
    arc = np.array([begin, turn])
    n = 0
    smooth = False
    for r in range(n_rasters):
        head = rasters[HEADER * r : HEADER * (r + 1)]
        n += _cuts(cx, radius, head[X_FIRST], head[WIDTH], int(head[COLUMNS]), 0.0, arc, cuts[n:])
        n += _cuts(cy, radius, head[Y_FIRST], head[HEIGHT], int(head[ROWS]), 0.5 * math.pi, arc, cuts[n:])
        # (interpolated rasters end half a cell inside of their outermost lines)
        if head[BILINEAR] > 0.0:
            smooth = True
            margin_x, margin_y = head[9] * head[WIDTH], head[9] * head[HEIGHT]
            n += _cuts(
                cx,
                radius,
                head[X_FIRST] + margin_x,
                head[WIDTH] * (head[COLUMNS] - 2.0 * head[9]),
                1,
                0.0,
                arc,
                cuts[n:],
            )
            n += _cuts(
                cy,
                radius,
                head[Y_FIRST] + margin_y,
                head[HEIGHT] * (head[ROWS] - 2.0 * head[9]),
                1,
                0.5 * math.pi,
                arc,
                cuts[n:],
            )
    parts = np.sort(cuts[:n])
    total = 0.0
    at = 0.0
    for i in range(n + 1):
        end = parts[i] if i < n else 1.0
        while at < end:
            width = min(end - at, MOST_ANGLE / abs(turn))
            # (a rest that rounding leaves)
            if at + width == at:
                break
            if smooth:
                for j in range(_NODES.shape[0]):
                    angle = begin + turn * (at + 0.5 * width * (1.0 + _NODES[j]))
                    total += (
                        0.5
                        * width
                        * _WEIGHTS[j]
                        * density_at(cx + radius * math.cos(angle), cy + radius * math.sin(angle), rasters)
                    )
            else:
                angle = begin + turn * (at + 0.5 * width)
                total += width * density_at(cx + radius * math.cos(angle), cy + radius * math.sin(angle), rasters)
            at += width
        at = end
    return radius * abs(turn) * total


@kernel
def piece_risk(piece: FloatArray, field: Field) -> float:
    """Integrate the risk field over a piece."""
    if piece[RADIUS] == 0.0:
        return segment_risk(piece[X0], piece[Y0], piece[X1], piece[Y1], field, math.inf)
    table, _, _, rasters = field
    begin = math.atan2(piece[Y0] - piece[CY], piece[X0] - piece[CX])
    cx, cy, radius, turn = piece[CX], piece[CY], piece[RADIUS], piece[TURN]
    if turn == 0.0:
        return 0.0
    total = _threats_along(cx, cy, radius, begin, turn, table) if table.shape[0] > 0 else 0.0
    return total + _rasters_along(cx, cy, radius, begin, turn, rasters)


@kernel
def piece_risks(pieces: FloatArray, field: Field, out: FloatArray) -> None:
    """Write the risk of each piece to `out`, shape ``(n,)``."""
    for i in range(pieces.shape[0]):
        out[i] = piece_risk(pieces[i], field)


@kernel
def arc_box(piece: FloatArray) -> tuple[float, float, float, float]:
    """Return the least box around a piece: ``x_min, y_min, x_max, y_max``."""
    low_x, high_x = min(piece[X0], piece[X1]), max(piece[X0], piece[X1])
    low_y, high_y = min(piece[Y0], piece[Y1]), max(piece[Y0], piece[Y1])
    if piece[RADIUS] > 0.0:
        begin = math.atan2(piece[Y0] - piece[CY], piece[X0] - piece[CX])
        if within_turn(0.0, begin, piece[TURN]) < 1.0:
            high_x = piece[CX] + piece[RADIUS]
        if within_turn(math.pi, begin, piece[TURN]) < 1.0:
            low_x = piece[CX] - piece[RADIUS]
        if within_turn(0.5 * math.pi, begin, piece[TURN]) < 1.0:
            high_y = piece[CY] + piece[RADIUS]
        if within_turn(-0.5 * math.pi, begin, piece[TURN]) < 1.0:
            low_y = piece[CY] - piece[RADIUS]
    return low_x, low_y, high_x, high_y


@kernel
def in_box(piece: FloatArray, bounds: Bounds, slack: float) -> bool:
    """Tell whether a piece stays inside the bounds, up to `slack`."""
    low_x, low_y, high_x, high_y = arc_box(piece)
    return bool(
        low_x >= bounds[0] - slack
        and low_y >= bounds[1] - slack
        and high_x <= bounds[2] + slack
        and high_y <= bounds[3] + slack
    )


@kernel
def arc_crosses(piece: FloatArray, area: AreaArrays) -> bool:
    """Tell whether an arc meets the interior of an area."""
    frame, slab_starts, rows = area
    low_x, low_y, high_x, high_y = arc_box(piece)
    if high_x <= frame[0] or low_x >= frame[2] or high_y <= frame[1] or low_y >= frame[3]:
        return False
    cx, cy, radius, turn = piece[CX], piece[CY], piece[RADIUS], piece[TURN]
    begin = math.atan2(piece[Y0] - cy, piece[X0] - cx)
    slabs = slab_starts.shape[0] - 1
    n = 0
    cuts = np.empty(16)
    for slab in range(slab_of(low_y, frame, slabs), slab_of(high_y, frame, slabs) + 1):
        stop = slab_starts[slab + 1]
        for i in range(first_row(low_x, slab_starts[slab], stop, rows), stop):
            if rows[i, 6] > high_x:
                break
            ax, ay, bx, by = rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]
            if max(ax, bx) < low_x or max(ay, by) < low_y or min(ay, by) > high_y:
                continue
            ex, ey = bx - ax, by - ay
            long = math.hypot(ex, ey)
            ux, uy = ex / long, ey / long
            # from the centre, the line of the edge is so far to the left, and its foot so far along
            aside = (ax - cx) * uy - (ay - cy) * ux
            foot = (cx - ax) * ux + (cy - ay) * uy
            squared = (radius - abs(aside)) * (radius + abs(aside))
            if squared < 0.0:
                continue
            half = math.sqrt(squared)
            for sign in (-1.0, 1.0):
                t = foot + sign * half
                if -1e-9 * radius <= t <= long + 1e-9 * radius:
                    share = within_turn(math.atan2(ay + t * uy - cy, ax + t * ux - cx), begin, turn)
                    if share < 1.0:
                        if n == cuts.shape[0]:
                            cuts = doubled(cuts)
                        cuts[n] = share
                        n += 1
    parts = np.sort(cuts[:n])
    at = 0.0
    for i in range(n + 1):
        end = parts[i] if i < n else 1.0
        # (a shorter part is a touch that rounding has made two of)
        if end - at > 1e-9:
            angle = begin + turn * 0.5 * (at + end)
            if point_inside(cx + radius * math.cos(angle), cy + radius * math.sin(angle), area):
                return True
        at = end
    return False


@kernel
def piece_crosses(piece: FloatArray, area: AreaArrays) -> bool:
    """Tell whether a piece meets the interior of an area."""
    if piece[RADIUS] == 0.0:
        return segment_crosses(piece[X0], piece[Y0], piece[X1], piece[Y1], area)
    return arc_crosses(piece, area)


@kernel
def first_fault(pieces: FloatArray, area: AreaArrays, bounds: Bounds, slack: float) -> tuple[int, int]:
    """Return the first piece that may not be flown, -1 if all may, and why: `CROSSES` or `LEAVES`."""
    for i in range(pieces.shape[0]):
        if not in_box(pieces[i], bounds, slack):
            return i, LEAVES
        if piece_crosses(pieces[i], area):
            return i, CROSSES
    return -1, 0


@kernel
def _to_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> tuple[float, float, float]:
    """Return how far a point is from a segment, and the point of the segment that is nearest."""
    ex, ey = bx - ax, by - ay
    squared = ex * ex + ey * ey
    t = ((x - ax) * ex + (y - ay) * ey) / squared if squared > 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    nx, ny = ax + t * ex, ay + t * ey
    return math.hypot(x - nx, y - ny), nx, ny


@kernel
def nearest(piece: FloatArray, ax: float, ay: float, bx: float, by: float) -> tuple[float, float, float, float]:
    """
    Return how far a piece is from a segment that it does not cross, at which share, and the segment's point there.

    The nearest points of an arc and a segment are an end of either, or the arc is parallel to the segment there.
    """
    best, share, qx, qy = math.inf, 0.0, ax, ay
    for end in range(2):
        x, y = (piece[X0], piece[Y0]) if end == 0 else (piece[X1], piece[Y1])
        d, nx, ny = _to_segment(x, y, ax, ay, bx, by)
        if d < best:
            best, share, qx, qy = d, float(end), nx, ny
    if piece[RADIUS] == 0.0:
        long = math.hypot(piece[X1] - piece[X0], piece[Y1] - piece[Y0])
        for end in range(2):
            x, y = (ax, ay) if end == 0 else (bx, by)
            d, nx, ny = _to_segment(x, y, piece[X0], piece[Y0], piece[X1], piece[Y1])
            if d < best and long > 0.0:
                best, qx, qy = d, x, y
                share = math.hypot(nx - piece[X0], ny - piece[Y0]) / long
        return best, share, qx, qy
    cx, cy, radius, turn = piece[CX], piece[CY], piece[RADIUS], piece[TURN]
    begin = math.atan2(piece[Y0] - cy, piece[X0] - cx)
    for end in range(2):
        x, y = (ax, ay) if end == 0 else (bx, by)
        d = abs(math.hypot(x - cx, y - cy) - radius)
        if d < best:
            part = within_turn(math.atan2(y - cy, x - cx), begin, turn)
            if part < 1.0:
                best, share, qx, qy = d, part, x, y
    across = math.atan2(-(bx - ax), by - ay)
    for end in range(2):
        angle = across + end * math.pi
        part = within_turn(angle, begin, turn)
        if part < 1.0:
            d, nx, ny = _to_segment(cx + radius * math.cos(angle), cy + radius * math.sin(angle), ax, ay, bx, by)
            if d < best:
                best, share, qx, qy = d, part, nx, ny
    return best, share, qx, qy


@kernel
def curve_clearance(pieces: FloatArray, edges: FloatArray) -> float:
    """Return the least distance between a curve that crosses no edge and edges, shape ``(n, 4)`` or more columns."""
    best = math.inf
    for i in range(pieces.shape[0]):
        low_x, low_y, high_x, high_y = arc_box(pieces[i])
        for j in range(edges.shape[0]):
            ax, ay, bx, by = edges[j, 0], edges[j, 1], edges[j, 2], edges[j, 3]
            dx = max(low_x - max(ax, bx), min(ax, bx) - high_x, 0.0)
            dy = max(low_y - max(ay, by), min(ay, by) - high_y, 0.0)
            if dx * dx + dy * dy < best * best:
                best = min(best, nearest(pieces[i], ax, ay, bx, by)[0])
    return best

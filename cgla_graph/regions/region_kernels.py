"""
Compiled kernels of least costs over points on the borders of cells.

A cell is a rectangle with four corners and `m` points inside each of its four sides. Its **border points** are numbered
corners first, ``(0, 0), (1, 0), (0, 1), (1, 1)``, then those of the lower, upper, left and right side, each ascending.
A table of a cell has the length of the way from each border point to each other; it is infinite for points of the same
side that are not neighbours.

**Nodes** of the map: first the corners, ``row * (columns + 1) + column``; after them come the points of the sides,
``m`` for each. The sides have numbers in two arrays, `horizontal` and `vertical`, and -1 stands for a side of no cell.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, IntArray, WholeArray
from cgla_graph.eikonal.queue_kernels import drop_first, push
from cgla_graph.refine.refine_kernels import newton_step


@kernel
def place_of(node: int, columns: int, n_corners: int, m: int, places: WholeArray) -> tuple[int, int, int, int]:
    """
    Return where a node is: 0 for a corner, 1 on a horizontal and 2 on a vertical side; row, column, and its number.

    Row and column are those of the corner, or of the lower left end of the side.
    """
    if node < n_corners:
        return 0, node // (columns + 1), node % (columns + 1), 0
    side = (node - n_corners) // m
    code = int(places[side])
    corner = code >> 1
    return 1 + (code & 1), corner // (columns + 1), corner % (columns + 1), (node - n_corners) % m


@kernel
def cell_at(kind: int, row: int, column: int, s: int, n: int, m: int) -> tuple[int, int, int]:
    """Return the `n`-th cell at a node, which may be beyond the map, and the node's number on its border."""
    if kind == 0:
        return row - (n >> 1), column - (n & 1), n
    if kind == 1:
        return row - n, column, 4 + n * m + s
    return row, column - n, 4 + (2 + n) * m + s


@kernel
def side_of(row: int, column: int, number: int, horizontal: WholeArray, vertical: WholeArray) -> int:
    """Return the number of a side of a cell: lower, upper, left, right."""
    if number < 2:
        return int(horizontal[row + number, column])
    return int(vertical[row, column + number - 2])


@kernel
def along_line(
    kind: int, row: int, column: int, s: int, n: int, horizontal: WholeArray, vertical: WholeArray, m: int
) -> tuple[int, int, int, int]:
    """
    Return the `n`-th interval of a line at a node (`place_of`), to the next node on it.

    Kind of its side, row and column, and its number on the side; kind -1 beyond the map, and where there is no side.
    """
    if kind != 0:
        return kind, row, column, s + n
    across = 1 - (n >> 1)
    back = n & 1
    j, i = row - (0 if across else back), column - (back if across else 0)
    sides = horizontal if across else vertical
    if j < 0 or i < 0 or j >= sides.shape[0] or i >= sides.shape[1] or sides[j, i] < 0:
        return -1, 0, 0, 0
    return (1 if across else 2), j, i, m * back


@kernel
def ends_of(
    kind: int, row: int, column: int, number: int, horizontal: WholeArray, vertical: WholeArray, m: int
) -> tuple[int, int]:
    """Return the two nodes at the ends of an interval of a side."""
    columns, n_corners = vertical.shape[1], horizontal.shape[0] * vertical.shape[1]
    side = int(horizontal[row, column]) if kind == 1 else int(vertical[row, column])
    corner, first = row * columns + column, n_corners + side * m
    one = corner if number == 0 else first + number - 1
    other = first + number if number < m else corner + (1 if kind == 1 else columns)
    return one, other


@kernel
def least_costs(
    costs: FloatArray,
    tables: FloatArray,
    table_of: WholeArray,
    horizontal: WholeArray,
    vertical: WholeArray,
    places: WholeArray,
    m: int,
    limit: float,
    values: FloatArray,
    lines: FloatArray,
) -> int:
    """
    Find the least cost of a way from the seeds to each node (Dijkstra 1959); edges are made when they are needed.

    Parameters
    ----------
    costs, table_of
        Cost of a unit of length, infinite where no way leads through, and number of the table of each cell, shape
        ``(rows, columns)``.
    tables
        Shape ``(n, 4 + 4 m, 4 + 4 m)``, map units.
    horizontal, vertical
        The numbers of the sides, shape ``(rows + 1, columns)`` and ``(rows, columns + 1)``.
    places
        Of each side, twice the number of the corner at its lower left end, and 1 more if it is vertical.
    m
        Points of a side, at most 64.
    limit
        Nodes beyond this cost are left out: the values of some are too great then.
    values
        Costs of the seeds, elsewhere infinite; on return the least costs, shape ``(n,)``, map units.
    lines
        Cost of each interval of the sides, which is not that of the cells then, shape ``(sides, m + 1)``; or none.

    Returns
    -------
    count
        Nodes whose costs were passed on.
    """
    rows, columns = costs.shape
    n_corners = (rows + 1) * (columns + 1)
    # a queue of corners and sides by the least value of a point that is not done: it has far fewer entries than one
    # of points
    n_items = n_corners + places.shape[0]
    least = np.full(n_items, math.inf)
    done = np.zeros(n_items, dtype=np.uint64)
    room = 1 << 12
    keys = np.full(room, math.inf)
    items: WholeArray = np.empty(room, dtype=np.uint32)
    size = int(np.int64(0))
    for v in range(values.shape[0]):
        if values[v] < math.inf:
            item = v if v < n_corners else n_corners + (v - n_corners) // m
            least[item] = min(least[item], values[v])
    for item in range(n_items):
        if least[item] < math.inf:
            if size + 8 > room:
                keys, items = _grown(keys, items)
                room *= 2
            size = push(keys, items, size, least[item], item)
    count = int(np.int64(0))
    while size > 0:
        key = keys[0]
        item = int(items[0])
        size = drop_first(keys, items, size)
        if key != least[item]:
            # that point was reached at a lesser cost
            continue
        if key > limit:
            break
        if size + 48 > room:
            keys, items = _grown(keys, items)
            room *= 2
        node = item if item < n_corners else -1
        least[item] = math.inf
        if item >= n_corners:
            first = n_corners + (item - n_corners) * m
            following = math.inf
            for p in range(m):
                if (done[item] >> np.uint64(p)) & np.uint64(1):
                    continue
                if values[first + p] == key and node < 0:
                    node = first + p
                    done[item] |= np.uint64(1) << np.uint64(p)
                else:
                    following = min(following, values[first + p])
            if following < math.inf:
                least[item] = following
                size = push(keys, items, size, following, item)
        count += 1
        kind, row, column, s = place_of(node, columns, n_corners, m, places)
        for n in range(4 if kind == 0 else 2):
            j, i, own = cell_at(kind, row, column, s, n, m)
            if j < 0 or i < 0 or j >= rows or i >= columns or costs[j, i] == math.inf:
                continue
            cost = costs[j, i]
            lengths = tables[table_of[j, i], own]
            corner = j * (columns + 1) + i
            for q in range(4):
                other = corner + (q & 1) + (q >> 1) * (columns + 1)
                value = key + cost * lengths[q]
                if value < values[other]:
                    values[other] = value
                    least[other] = value
                    size = push(keys, items, size, value, other)
            for q in range(4):
                side = side_of(j, i, q, horizontal, vertical)
                first = n_corners + side * m
                at = 4 + q * m
                lowest = math.inf
                for p in range(m):
                    value = key + cost * lengths[at + p]
                    if value < values[first + p]:
                        values[first + p] = value
                        lowest = min(lowest, value)
                if lowest < least[n_corners + side]:
                    least[n_corners + side] = lowest
                    size = push(keys, items, size, lowest, n_corners + side)
        if lines.shape[0] == 0:
            continue
        for n in range(4 if kind == 0 else 2):
            on, j, i, number = along_line(kind, row, column, s, n, horizontal, vertical, m)
            if on < 0:
                continue
            one, two = ends_of(on, j, i, number, horizontal, vertical, m)
            other = two if one == node else one
            value = key + lines[int(horizontal[j, i]) if on == 1 else int(vertical[j, i]), number]
            if value < values[other]:
                values[other] = value
                at = other if other < n_corners else n_corners + (other - n_corners) // m
                if value < least[at]:
                    least[at] = value
                    size = push(keys, items, size, value, at)
    return count


@kernel
def _grown(keys: FloatArray, items: WholeArray) -> tuple[FloatArray, WholeArray]:
    """Return a heap with twice the room."""
    size = keys.shape[0]
    more_keys = np.full(2 * size, math.inf)
    more_items: WholeArray = np.empty(2 * size, dtype=np.uint32)
    for i in range(size):
        more_keys[i] = keys[i]
        more_items[i] = items[i]
    return more_keys, more_items


@kernel
def descend(
    costs: FloatArray,
    tables: FloatArray,
    table_of: WholeArray,
    horizontal: WholeArray,
    vertical: WholeArray,
    places: WholeArray,
    m: int,
    values: FloatArray,
    lines: FloatArray,
    nodes: IntArray,
) -> int:
    """
    Follow least costs from a node to a seed.

    Parameters
    ----------
    costs, tables, table_of, horizontal, vertical, places, m, values, lines
        As `least_costs` takes and leaves them; tables are symmetric.
    nodes
        The first is where to begin; the others are filled in, as many as there is room for.

    Returns
    -------
    count
        How many nodes the way has.
    """
    rows, columns = costs.shape
    n_corners = (rows + 1) * (columns + 1)
    count = int(np.int64(1))
    while count < nodes.shape[0]:
        node = int(nodes[count - 1])
        # (no other node gives a seed its value)
        best, least = int(np.int64(-1)), values[node]
        kind, row, column, s = place_of(node, columns, n_corners, m, places)
        for n in range(4 if kind == 0 else 2):
            j, i, own = cell_at(kind, row, column, s, n, m)
            if j < 0 or i < 0 or j >= rows or i >= columns or costs[j, i] == math.inf:
                continue
            lengths = tables[table_of[j, i], own]
            corner = j * (columns + 1) + i
            for b in range(4 + 4 * m):
                if b < 4:
                    other = corner + (b & 1) + (b >> 1) * (columns + 1)
                else:
                    other = n_corners + side_of(j, i, (b - 4) // m, horizontal, vertical) * m + (b - 4) % m
                if values[other] < values[node] and values[other] + costs[j, i] * lengths[b] <= least:
                    best, least = other, values[other] + costs[j, i] * lengths[b]
        for n in range((4 if kind == 0 else 2) if lines.shape[0] else 0):
            on, j, i, number = along_line(kind, row, column, s, n, horizontal, vertical, m)
            if on < 0:
                continue
            one, two = ends_of(on, j, i, number, horizontal, vertical, m)
            other = two if one == node else one
            value = values[other] + lines[int(horizontal[j, i]) if on == 1 else int(vertical[j, i]), number]
            if values[other] < values[node] and value <= least:
                best, least = other, value
        if best < 0:
            break
        nodes[count] = best
        count += 1
    return count


@kernel
def _slopes(
    points: FloatArray,
    axes: WholeArray,
    weights: FloatArray,
    slope: FloatArray,
    diagonal: FloatArray,
    beside: FloatArray,
) -> float:
    """Cost a path, and write the first two derivatives of its cost by the coordinates that may change."""
    cost = 0.0
    slope[:] = 0.0
    diagonal[:] = 0.0
    beside[:] = 0.0
    for i in range(points.shape[0] - 1):
        dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        length = math.hypot(dx, dy)
        if length == 0.0:
            continue
        ux, uy, bend = dx / length, dy / length, weights[i] / length
        cost += weights[i] * length
        here, there = axes[i], axes[i + 1]
        if here >= 0:
            slope[i] -= weights[i] * (ux if here == 0 else uy)
            diagonal[i] += bend * (uy * uy if here == 0 else ux * ux)
        if there >= 0:
            slope[i + 1] += weights[i] * (ux if there == 0 else uy)
            diagonal[i + 1] += bend * (uy * uy if there == 0 else ux * ux)
        if here >= 0 and here == there:
            beside[i] = -bend * (uy * uy if here == 0 else ux * ux)
        elif here >= 0 and there >= 0:
            beside[i] = bend * ux * uy
    return cost


@kernel
def slide(
    points: FloatArray, axes: WholeArray, lows: FloatArray, highs: FloatArray, weights: FloatArray, rounds: int
) -> int:
    """
    Move the waypoints of a path along the borders that they are on until the path costs least (Snell's law).

    For given borders the cost is convex. All waypoints move together, by a projected Newton method: only neighbours
    depend on each other.

    Parameters
    ----------
    points
        Waypoints, shape ``(n, 2)``, map units; changed in place.
    axes
        The coordinate that may change, 0 or 1; -1 for a waypoint that stays, shape ``(n,)``.
    lows, highs
        Its limits, shape ``(n,)``, map units.
    weights
        Cost of a unit of length between waypoints, shape ``(n - 1,)``.
    rounds
        Steps, at most.

    Returns
    -------
    rounds
        How many were made.

    Examples
    --------
    >>> path = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    >>> _ = slide(path, np.array([-1, 0, -1]), np.zeros(3), np.ones(3), np.array([1.0, 0.5]), 9)
    >>> path[1].round(6).tolist()
    [0.57735, 1.0]
    """
    n = points.shape[0]
    slope, diagonal, beside, step, before = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    free = np.empty(n, dtype=np.bool_)
    damping = 0.0
    for number in range(rounds):
        cost = _slopes(points, axes, weights, slope, diagonal, beside)
        scale = 0.0
        for i in range(n):
            free[i] = axes[i] >= 0
            if free[i]:
                before[i] = points[i, axes[i]]
                free[i] = not (
                    (before[i] <= lows[i] and slope[i] >= 0.0) or (before[i] >= highs[i] and slope[i] <= 0.0)
                )
                scale = max(scale, diagonal[i])
        gain = -1.0
        while gain <= 0.0 and damping < 1e9 * scale:
            if newton_step(diagonal, beside, damping, slope, free, step):
                after = 0.0
                for i in range(n):
                    if axes[i] >= 0:
                        points[i, axes[i]] = min(max(before[i] + step[i], lows[i]), highs[i])
                    if i > 0:
                        after += weights[i - 1] * math.hypot(
                            points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1]
                        )
                gain = cost - after
            if gain <= 0.0:
                damping = max(8.0 * damping, 1e-6 * scale)
        if gain <= 0.0:
            for i in range(n):
                if axes[i] >= 0:
                    points[i, axes[i]] = before[i]
        if gain < 1e-12 * cost:
            return number + 1
        damping = 0.1 * damping if damping > 1e-9 * scale else 0.0
    return rounds
